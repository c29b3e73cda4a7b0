//! Where a wake ends: at the floor, or at a top face wide enough to stop it.

use airflow::Wake;
use nalgebra::Point3;

/// A level top face that stops a wake falling wholly on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Top {
    /// The top of a box.
    Rectangle {
        /// Lowest x and y (m).
        min_m: [f64; 2],
        /// Highest x and y (m).
        max_m: [f64; 2],
        /// Height in the world (m).
        z_m: f64,
    },
    /// The top of an upright cylinder.
    Disc {
        /// Axis (m).
        centre_m: [f64; 2],
        /// Radius (m).
        radius_m: f64,
        /// Height in the world (m).
        z_m: f64,
    },
}

impl Top {
    fn z_m(&self) -> f64 {
        match *self {
            Top::Rectangle { z_m, .. } | Top::Disc { z_m, .. } => z_m,
        }
    }

    /// Without so much (m) of its edge.
    #[must_use]
    pub fn shrunk(self, by_m: f64) -> Top {
        match self {
            Top::Rectangle { min_m, max_m, z_m } => Top::Rectangle {
                min_m: min_m.map(|edge_m| edge_m + by_m),
                max_m: max_m.map(|edge_m| edge_m - by_m),
                z_m,
            },
            Top::Disc {
                centre_m,
                radius_m,
                z_m,
            } => Top::Disc {
                centre_m,
                radius_m: radius_m - by_m,
                z_m,
            },
        }
    }

    /// Lowest and highest x (m).
    fn along_x_m(&self) -> [f64; 2] {
        match *self {
            Top::Rectangle { min_m, max_m, .. } => [min_m[0], max_m[0]],
            Top::Disc {
                centre_m, radius_m, ..
            } => [centre_m[0] - radius_m, centre_m[0] + radius_m],
        }
    }

    /// Whether a whole disc (m) about a place lies on this face.
    fn holds(&self, [x_m, y_m]: [f64; 2], disc_m: f64) -> bool {
        match *self {
            Top::Rectangle { min_m, max_m, .. } => {
                let margin_m = (x_m - min_m[0])
                    .min(max_m[0] - x_m)
                    .min(y_m - min_m[1])
                    .min(max_m[1] - y_m);
                margin_m > 0.0 && disc_m <= margin_m
            }
            Top::Disc {
                centre_m, radius_m, ..
            } => {
                let off_m = (x_m - centre_m[0]).hypot(y_m - centre_m[1]);
                off_m < radius_m && off_m + disc_m <= radius_m
            }
        }
    }

    /// Whether the whole half-width disc of a wake from here lies on this face.
    fn stops(&self, wake: &Wake, rotor_m: &Point3<f64>) -> bool {
        let depth_m = rotor_m.z - self.z_m();
        depth_m > 0.0 && self.holds([rotor_m.x, rotor_m.y], wake.half_width_m(depth_m))
    }

    /// The same for a moved wake, from everywhere between two places. Any place between them is a
    /// mixture of both, and a face that holds a disc about two places holds it about every mixture:
    /// so it is enough that both ends hold every disc that comes up.
    fn holds_moved(&self, wake: &Wake, ends_m: [&Point3<f64>; 2]) -> bool {
        let [from_m, to_m] = ends_m.map(|end_m| end_m.z - self.z_m());
        if from_m <= 0.0 || to_m <= 0.0 {
            return false;
        }
        let steps = if from_m == to_m { 0 } else { MOVED_STEPS };
        let discs_m = (0..=steps)
            .map(|k| from_m + f64::from(k) / f64::from(steps.max(1)) * (to_m - from_m))
            .map(|depth_m| Some((wake.axis_m(depth_m)?, wake.spread_m(depth_m)?)));
        // Where the wind has taken the jet away there is nothing left to stop.
        let Some(discs_m) = discs_m.collect::<Option<Vec<_>>>() else {
            return false;
        };
        let gaps_m = discs_m.windows(2).map(|two| {
            let [(a_m, a), (b_m, b)] = [two[0], two[1]];
            (a_m[0] - b_m[0]).hypot(a_m[1] - b_m[1]) + (a - b).abs()
        });
        // Between two discs looked at it is nowhere farther from one of them than they are apart.
        let between_m = gaps_m.fold(0.0, f64::max);
        discs_m.iter().all(|(axis_m, spread_m)| {
            ends_m.iter().all(|end_m| {
                let place_m = [end_m.x + axis_m[0], end_m.y + axis_m[1]];
                self.holds(place_m, spread_m + between_m)
            })
        })
    }
}

/// Depths looked at where a moved wake falls from different heights; chosen here.
const MOVED_STEPS: u32 = 8;

/// The floor and every top face of a world.
#[derive(Clone, Debug, Default)]
pub struct BlockingSurfaces {
    floor_z_m: f64,
    tops: Vec<Top>,
    /// By x, in strips of [`STRIP_M`] from `low_x_m` on: the faces above the floor there.
    strips: Vec<Vec<usize>>,
    low_x_m: f64,
}

/// Chosen here: narrower than most shelves.
const STRIP_M: f64 = 1.0;

impl BlockingSurfaces {
    /// A floor and the faces above it.
    pub fn new(floor_z_m: f64, tops: Vec<Top>) -> BlockingSurfaces {
        let mut stops = BlockingSurfaces {
            floor_z_m,
            tops,
            strips: Vec::new(),
            low_x_m: f64::INFINITY,
        };
        let raised = |top: &&Top| top.z_m() > floor_z_m;
        for top in stops.tops.iter().filter(raised) {
            stops.low_x_m = stops.low_x_m.min(top.along_x_m()[0]);
        }
        for (index, top) in stops.tops.iter().enumerate() {
            if !raised(&top) {
                continue;
            }
            let [first, last] = top.along_x_m().map(|x_m| stops.strip(x_m));
            if stops.strips.len() <= last {
                stops.strips.resize(last + 1, Vec::new());
            }
            for strip in &mut stops.strips[first..=last] {
                strip.push(index);
            }
        }
        stops
    }

    /// Whether there is a face above the floor.
    pub(crate) fn has_tops(&self) -> bool {
        !self.strips.is_empty()
    }

    /// Where a wake falls from within a face, the face is in the list of that strip.
    fn strip(&self, x_m: f64) -> usize {
        ((x_m - self.low_x_m) / STRIP_M) as usize
    }

    /// Height (m) at which a wake ends wherever the drone is on the path between two places.
    ///
    /// A face counts only if it stops the wake at both ends: faces are convex and the half-width
    /// grows at most linearly with height, so it stops it in between, too. Where it stops the wake
    /// on a part of the path only, the wake is taken to pass: outward.
    pub fn wake_end_z_m(&self, wake: &Wake, from_m: &Point3<f64>, to_m: &Point3<f64>) -> f64 {
        if wake.is_shaped() {
            // It may come down on a face that its drone is not above.
            let raised = self.tops.iter().filter(|top| top.z_m() > self.floor_z_m);
            let covering = raised.filter(|top| top.holds_moved(wake, [from_m, to_m]));
            return covering.map(Top::z_m).fold(self.floor_z_m, f64::max);
        }
        let tops = self.strips.get(self.strip(from_m.x));
        tops.into_iter()
            .flatten()
            .map(|&index| &self.tops[index])
            .filter(|top| top.stops(wake, from_m) && (from_m == to_m || top.stops(wake, to_m)))
            .map(Top::z_m)
            .fold(self.floor_z_m, f64::max)
    }

    /// The floor (m).
    pub fn floor_z_m(&self) -> f64 {
        self.floor_z_m
    }
}

#[cfg(test)]
mod tests {
    use airflow::{Airframe, Jet};

    use super::*;

    fn wake() -> Wake {
        let airframe = Airframe::preset("offboard-2").expect("a preset");
        Wake::new(&airframe, airframe.mass_kg(), 1.204, &Jet::default())
    }

    fn tops() -> Vec<Top> {
        let shelf = |x_m: f64, width_m: f64, z_m: f64| Top::Rectangle {
            min_m: [x_m, 0.0],
            max_m: [x_m + width_m, 6.0],
            z_m,
        };
        let tank = Top::Disc {
            centre_m: [5.5, 3.0],
            radius_m: 1.5,
            z_m: 3.0,
        };
        vec![
            shelf(0.0, 2.0, 2.0),
            shelf(1.0, 3.0, 1.2),
            tank,
            shelf(-9.0, 20.0, -3.0),
        ]
    }

    /// The definition by samples: a face stops a wake if points all around the half-width disc lie
    /// on it.
    fn sampled_end_z_m(stops: &BlockingSurfaces, wake: &Wake, rotor_m: Point3<f64>) -> f64 {
        let mut end_z_m = stops.floor_z_m;
        for top in &stops.tops {
            let depth_m = rotor_m.z - top.z_m();
            if depth_m <= 0.0 {
                continue;
            }
            let half_m = wake.half_width_m(depth_m.max(wake.near_field_depth_m()));
            let on_it = |angle_rad: f64, radius_m: f64| {
                let x = rotor_m.x + radius_m * angle_rad.cos();
                let y = rotor_m.y + radius_m * angle_rad.sin();
                match *top {
                    Top::Rectangle { min_m, max_m, .. } => {
                        (min_m[0]..=max_m[0]).contains(&x) && (min_m[1]..=max_m[1]).contains(&y)
                    }
                    Top::Disc {
                        centre_m, radius_m, ..
                    } => (x - centre_m[0]).hypot(y - centre_m[1]) <= radius_m,
                }
            };
            let all = (0..720).all(|k| on_it(f64::from(k).to_radians() / 2.0, half_m));
            if all && on_it(0.0, 0.0) {
                end_z_m = end_z_m.max(top.z_m());
            }
        }
        end_z_m
    }

    #[test]
    fn a_wake_ends_on_the_highest_face_that_holds_its_whole_disc() {
        let (wake, stops) = (wake(), BlockingSurfaces::new(0.0, tops()));
        let mut stopped = 0;
        for i in 0..20_000_u32 {
            let at = |k: f64| (f64::from(i) * k).fract();
            let rotor_m = Point3::new(
                9.0 * at(0.819_172_513_396) - 1.0,
                8.0 * at(0.671_043_606_704) - 1.0,
                6.0 * at(0.549_700_477_902),
            );
            let end_z_m = stops.wake_end_z_m(&wake, &rotor_m, &rotor_m);
            let sampled_z_m = sampled_end_z_m(&stops, &wake, rotor_m);
            // Between two samples of the circle a disc may stick out by 1e-5 of its radius.
            let shifted = [-1e-4, 1e-4].map(|dx| {
                let beside_m = Point3::new(rotor_m.x + dx, rotor_m.y, rotor_m.z);
                stops.wake_end_z_m(&wake, &beside_m, &beside_m)
            });
            assert!(
                end_z_m == sampled_z_m || shifted.contains(&sampled_z_m),
                "{rotor_m}"
            );
            stopped += u32::from(end_z_m > 0.0);
        }
        assert!(stopped > 1_000, "{stopped}");
    }

    #[test]
    fn a_way_only_partly_over_a_shelf_is_not_covered() {
        let (wake, stops) = (wake(), BlockingSurfaces::new(0.0, tops()));
        let over = Point3::new(1.0, 3.0, 3.0);
        let beside = Point3::new(-2.0, 3.0, 3.0);
        let along = Point3::new(1.0, 4.0, 3.0);
        assert_eq!(stops.wake_end_z_m(&wake, &over, &over), 2.0);
        assert_eq!(stops.wake_end_z_m(&wake, &over, &along), 2.0);
        assert_eq!(stops.wake_end_z_m(&wake, &over, &beside), 0.0);
        assert_eq!(stops.wake_end_z_m(&wake, &beside, &over), 0.0);
    }

    #[test]
    fn on_a_way_a_wake_never_ends_above_where_it_ends_anywhere_on_it() {
        let (wake, stops) = (wake(), BlockingSurfaces::new(0.0, tops()));
        for i in 0..4_000_u32 {
            let at = |k: f64| (f64::from(i) * k).fract();
            let from_m = Point3::new(7.0 * at(0.819), 6.0 * at(0.671), 6.0 * at(0.5497));
            let to_m =
                from_m + nalgebra::Vector3::new(at(0.301) - 0.5, at(0.777) - 0.5, at(0.123) - 0.5);
            let end_z_m = stops.wake_end_z_m(&wake, &from_m, &to_m);
            for k in 0..=20 {
                let here_m = from_m + (to_m - from_m) * (f64::from(k) / 20.0);
                assert!(
                    end_z_m <= stops.wake_end_z_m(&wake, &here_m, &here_m),
                    "{from_m} {to_m}"
                );
            }
        }
    }
}
