//! A plan as the checks see it, read once.

use std::sync::Arc;

use airflow::{Convection, DiscPoints, FarField, Flown, Source, Superposition};
use nalgebra::Point3;
use rayon::iter::Either;

use super::bounds::obstacles::{NamedSolid, Obstacles};
use super::bounds::wake::BoundedWake;
use super::extents::{Places, Span};
use crate::plan::trajectory::{Motion, Trajectory};
use crate::plan::{Bounds, Margins, Zone};

/// All that the checks need of a plan: its geometry, its air, and every flight that could be read.
///
/// World frame, z up; metres, seconds, m/s.
pub(crate) struct Scene<'a> {
    /// Limits of every rotor-plane centre.
    pub(crate) bounds_m: Bounds,
    /// Floor and solids.
    pub(crate) obstacles: Obstacles,
    /// Those with a box and a limit.
    pub(crate) zones: Vec<&'a Zone>,
    /// Zones that keep bodies out.
    pub(crate) keep_out: Vec<NamedSolid>,
    /// How early or late, and how far off its path, every drone may be.
    pub(crate) margins: Margins,
    /// How wakes add up at a point.
    pub(crate) superposition: Superposition,
    /// What a finding adds to the hover jet.
    pub(crate) flown: Flown,
    /// The longest convective delay of any wake down to the floor (s); 0 where wakes are
    /// quasi-static.
    pub(crate) longest_lag_s: f64,
    /// Last time of any drone (s): from here on all rest.
    pub(crate) last_s: f64,
    /// Drones that stay are judged up to here (s): `last_s`, the longest delay, and a second of
    /// rest, which stands for all time after it.
    pub(crate) horizon_s: f64,
    /// In the plan's order, those that cannot be read left out.
    pub(crate) flights: Vec<Flight>,
}

/// A part of a flight within one piece, all of it in the air or none.
pub(crate) struct Part {
    /// Index of the piece.
    pub(crate) piece: usize,
    /// The piece's, over this part alone.
    pub(crate) motion: Motion,
    /// Whether the drone is airborne in it.
    pub(crate) flies: bool,
}

/// One drone whose trajectory could be read.
pub(crate) struct Flight {
    /// In the plan.
    pub(crate) index: usize,
    /// The plan's name for it.
    pub(crate) name: String,
    /// Up to the scene's horizon where it stays.
    pub(crate) trajectory: Trajectory,
    /// When its wake is on and its air is limited (s); empty where the second is not after the
    /// first.
    pub(crate) airborne_s: Span,
    /// When it stands landed in between (s), in order.
    pub(crate) landed_s: Vec<Span>,
    /// Highest mean air over its discs, over its induced velocity.
    pub(crate) air_limit: f64,
    /// Along every piece (m/s).
    pub(crate) max_speed_mps: f64,
    /// Of the ball that must stay clear (m).
    pub(crate) body_radius_m: f64,
    /// Highest vertical speeds, up and down (m/s); `None`: not limited.
    pub(crate) vertical_mps: [Option<f64>; 2],
    /// Of a trajectory that claims to be smooth.
    pub(crate) smooth: Option<Smooth>,
    /// Where it stands before it takes off (m); `None`: it begins in the air.
    pub(crate) takes_off_m: Option<Point3<f64>>,
    /// Where it stands after it has landed (m); `None`: it does not land.
    pub(crate) lands_m: Option<Point3<f64>>,
    /// From its centre to the tips of its rotors (m).
    pub(crate) tip_radius_m: f64,
    /// Points over which its mean air is taken.
    pub(crate) discs: Arc<DiscPoints>,
    /// One per piece of the trajectory, at its mass.
    pub(crate) wakes: Vec<Arc<BoundedWake>>,
    /// Solids on whose top the wake of each piece may end.
    pub(crate) stops: Vec<Vec<u32>>,
    /// Lowest and highest height of each piece (m).
    pub(crate) heights_m: Vec<(f64, f64)>,
    /// The highest of all (m).
    pub(crate) top_m: f64,
    /// Of its wakes the one whose air is the slowest, at any depth: they differ by their speed
    /// alone, which is that of one airframe.
    pub(crate) slowest: FarField,
}

/// What a trajectory must meet that claims to be smooth.
#[derive(Clone, Copy)]
pub(crate) struct Smooth {
    /// m/s²; `None`: not limited.
    pub(crate) acceleration_mps2: Option<f64>,
    /// m/s³; `None`: not limited.
    pub(crate) jerk_mps3: Option<f64>,
    /// Whether it is at rest when it begins, and when it ends: one that comes or leaves need not
    /// be.
    pub(crate) rests: [bool; 2],
}

impl Scene<'_> {
    /// Lags that the plan has to bear: delays of air over those at the centreline's speed, from
    /// none on.
    pub(crate) fn lags(&self) -> Span {
        (
            0.0,
            self.flown.convection.map_or(0.0, Convection::longest_lag),
        )
    }

    /// The lag of the mean flow, at which exposure and energy are summed.
    pub(crate) fn mean_lag(&self) -> f64 {
        self.flown.convection.map_or(0.0, Convection::mean_lag)
    }
}

impl Flight {
    /// The wake of one of its pieces during a motion, which is the piece's or a part of it; `from`
    /// is the caller's index of the drone.
    pub(crate) fn attached(&self, from: usize, piece: usize, motion: Motion) -> Attached<'_> {
        Attached {
            from,
            wake: &self.wakes[piece],
            motion,
            stops: &self.stops[piece],
        }
    }

    /// The parts of its pieces that lie within a span of time (s), in order.
    pub(crate) fn parts(&self, (from_s, until_s): Span) -> impl Iterator<Item = Part> + '_ {
        let pieces = self.trajectory.pieces();
        let within = self.trajectory.pieces_during(from_s, until_s);
        within.flat_map(move |piece| {
            let motion = &pieces[piece].motion;
            let (from_s, until_s) = (motion.from_s.max(from_s), motion.until_s.min(until_s));
            let (up_s, down_s) = self.airborne_s;
            let (up_s, down_s) = (up_s.clamp(from_s, until_s), down_s.clamp(from_s, until_s));
            let thirds = [(from_s, up_s), (up_s, down_s), (down_s, until_s)];
            let thirds = thirds.into_iter().zip([false, true, false]);
            let parts = match self.landed_s.is_empty() {
                true => Either::Left(thirds),
                false => Either::Right(thirds.flat_map(|(span_s, flies)| self.cut(span_s, flies))),
            };
            let lasting = parts.filter(|((from_s, until_s), _)| from_s < until_s);
            lasting.map(move |((from_s, until_s), flies)| Part {
                piece,
                motion: motion.during(from_s, until_s),
                flies,
            })
        })
    }

    /// A span (s) cut where it lands and rises again, each part with whether it flies.
    fn cut(&self, (from_s, until_s): Span, flies: bool) -> Vec<(Span, bool)> {
        let mut parts = Vec::new();
        let mut at_s = from_s;
        for &(lands_s, rises_s) in self.landed_s.iter().filter(|_| flies) {
            let rest_s = (lands_s.clamp(at_s, until_s), rises_s.clamp(at_s, until_s));
            parts.push(((at_s, rest_s.0), true));
            parts.push((rest_s, false));
            at_s = rest_s.1;
        }
        parts.push(((at_s, until_s), flies));
        parts
    }

    /// Whether it stands landed between two flights at a time.
    pub(crate) fn rests_at(&self, t_s: f64) -> bool {
        let mut rests = self.landed_s.iter();
        rests.any(|(lands_s, rises_s)| *lands_s < t_s && t_s < *rises_s)
    }

    /// Where it lands and rises again (m).
    pub(crate) fn rests_m(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        let rests = self.landed_s.iter();
        rests.map(|(lands_s, rises_s)| self.position_m(0.5 * (lands_s + rises_s)))
    }

    /// Its wakes without those that repeat: consecutive pieces share one while the mass stays the
    /// same.
    pub(crate) fn different_wakes(&self) -> Vec<Arc<BoundedWake>> {
        let mut different: Vec<Arc<BoundedWake>> = Vec::new();
        for wake in &self.wakes {
            if !different.iter().rev().any(|known| Arc::ptr_eq(known, wake)) {
                different.push(Arc::clone(wake));
            }
        }
        different
    }

    /// Greatest radius of its near-field column over all its masses (m).
    pub(crate) fn column_radius_m(&self) -> f64 {
        let radii_m = self.wakes.iter().map(|wake| wake.wake.column_radius_m());
        radii_m.fold(self.tip_radius_m, f64::max)
    }

    /// End of the flight that exposure and energy count to (s).
    pub(crate) fn flight_end_s(&self) -> f64 {
        self.airborne_s.1.min(self.trajectory.last_s())
    }

    /// Where it is at a time, or where it was last (m).
    pub(crate) fn position_m(&self, t_s: f64) -> Point3<f64> {
        let there_m = self.trajectory.position_m(t_s);
        there_m.unwrap_or_else(|| self.trajectory.last_m())
    }
}

/// A quasi-static wake: attached to a drone during one piece of its flight.
pub(crate) struct Attached<'a> {
    /// The drone: an index of the caller's.
    pub(crate) from: usize,
    /// At that piece's mass and climb.
    pub(crate) wake: &'a BoundedWake,
    /// Of the drone, over the time that the wake is attached to it.
    pub(crate) motion: Motion,
    /// Solids on whose top it may end.
    pub(crate) stops: &'a [u32],
}

impl<'a> Attached<'a> {
    /// The wake at a time (s).
    pub(crate) fn source(&self, obstacles: &Obstacles, t_s: f64) -> Source<'a> {
        let position_m = Point3::from(self.motion.at_m(t_s));
        let wake = &self.wake.wake;
        Source {
            wake,
            position_m,
            ends_at_z_m: obstacles.end_z_m(wake, &position_m, self.stops),
        }
    }

    /// Whether it surely reaches all of some heights (m) over a span of time, and whether it may
    /// reach one.
    pub(crate) fn reaches(
        &self,
        obstacles: &Obstacles,
        heights_m: Span,
        (from_s, until_s): Span,
    ) -> (bool, bool) {
        let from_m = self.motion.box_m(from_s, until_s);
        reaches(self.wake, self.stops, &from_m, obstacles, heights_m)
    }
}

/// Whether a wake whose drone is in a box surely reaches all of some heights (m), and whether it
/// may reach one.
pub(crate) fn reaches(
    wake: &BoundedWake,
    stops: &[u32],
    from_m: &Places,
    obstacles: &Obstacles,
    heights_m: (f64, f64),
) -> (bool, bool) {
    let (lowest_m, highest_m) = obstacles.end_range_m(&wake.wake, from_m, stops);
    (
        heights_m.0 >= highest_m,
        heights_m.1 >= lowest_m - airflow::HEIGHT_TOLERANCE_M,
    )
}

/// Several speeds at one point as one (m/s).
pub(crate) fn superpose(how: Superposition, speeds_mps: impl Iterator<Item = f64>) -> f64 {
    how.finish(speeds_mps.fold(0.0, |so_far, speed_mps| how.gather(so_far, speed_mps)))
}

/// Smallest horizontal distance between two boxes (m).
pub(crate) fn level_gap_m(a: &Places, b: &Places) -> f64 {
    let gap = |k: usize| (a.0[k] - b.1[k]).max(b.0[k] - a.1[k]).max(0.0);
    (gap(0) * gap(0) + gap(1) * gap(1)).sqrt()
}
