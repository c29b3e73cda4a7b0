//! A straight piece of flight at constant velocity.

use nalgebra::{Point3, Vector3};

/// From one place and time to another, in a straight line at constant velocity; equal ends are a hover.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Where it starts, in the world (m).
    pub start_m: Point3<f64>,
    /// Where it ends, in the world (m).
    pub end_m: Point3<f64>,
    /// When it starts (s).
    pub start_s: f64,
    /// When it ends (s); not before it starts, infinite for a hover without end.
    pub end_s: f64,
}

impl Flight {
    /// A hover at one place.
    pub fn hover(at_m: Point3<f64>, start_s: f64, end_s: f64) -> Self {
        Self {
            start_m: at_m,
            end_m: at_m,
            start_s,
            end_s,
        }
    }

    /// How long it takes (s).
    pub fn duration_s(&self) -> f64 {
        self.end_s - self.start_s
    }

    /// Velocity (m/s); zero for a hover, and for a flight without duration.
    pub fn velocity_mps(&self) -> Vector3<f64> {
        let duration_s = self.duration_s();
        if duration_s > 0.0 && duration_s.is_finite() {
            (self.end_m - self.start_m) / duration_s
        } else {
            Vector3::zeros()
        }
    }

    /// Position at a time (m); held at the ends outside of the flight.
    pub fn position_m(&self, time_s: f64) -> Point3<f64> {
        if time_s >= self.end_s {
            return self.end_m;
        }
        let elapsed_s = (time_s - self.start_s).max(0.0);
        self.start_m + self.velocity_mps() * elapsed_s
    }

    /// The times shared with another flight, start before end; `None` if they share less than an instant.
    pub fn common_s(&self, other: &Flight) -> Option<(f64, f64)> {
        let start_s = self.start_s.max(other.start_s);
        let end_s = self.end_s.min(other.end_s);
        (start_s < end_s).then_some((start_s, end_s))
    }
}
