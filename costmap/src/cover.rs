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

    /// Whether the whole half-width disc of a wake from here lies on this face.
    fn covers(&self, wake: &Wake, rotor_m: &Point3<f64>) -> bool {
        let depth_m = rotor_m.z - self.z_m();
        if depth_m <= 0.0 {
            return false;
        }
        match *self {
            Top::Rectangle { min_m, max_m, .. } => {
                let margin_m = (rotor_m.x - min_m[0])
                    .min(max_m[0] - rotor_m.x)
                    .min(rotor_m.y - min_m[1])
                    .min(max_m[1] - rotor_m.y);
                margin_m > 0.0 && wake.half_width_m(depth_m) <= margin_m
            }
            Top::Disc {
                centre_m, radius_m, ..
            } => {
                let off_m = (rotor_m.x - centre_m[0]).hypot(rotor_m.y - centre_m[1]);
                off_m < radius_m && off_m + wake.half_width_m(depth_m) <= radius_m
            }
        }
    }
}

/// The floor and every top face of a world.
#[derive(Clone, Debug, Default)]
pub struct Covers {
    floor_z_m: f64,
    tops: Vec<Top>,
}

impl Covers {
    /// A floor and the faces above it.
    pub fn new(floor_z_m: f64, tops: Vec<Top>) -> Covers {
        Covers { floor_z_m, tops }
    }

    /// Height at which a wake ends wherever the drone is on the way between two places.
    ///
    /// A face counts only if it stops the wake at both ends: faces are convex and the half-width
    /// grows at most linearly with height, so it stops it in between, too. Where it stops the wake on
    /// a part of the way only, the wake is taken to pass: outward.
    pub fn wake_end_z_m(&self, wake: &Wake, from_m: &Point3<f64>, to_m: &Point3<f64>) -> f64 {
        self.tops
            .iter()
            .filter(|top| top.z_m() > self.floor_z_m)
            .filter(|top| top.covers(wake, from_m) && (from_m == to_m || top.covers(wake, to_m)))
            .map(Top::z_m)
            .fold(self.floor_z_m, f64::max)
    }

    /// The floor (m).
    pub fn floor_z_m(&self) -> f64 {
        self.floor_z_m
    }
}
