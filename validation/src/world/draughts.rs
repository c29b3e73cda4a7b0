//! Draughts and obstacles besides jets: a room in motion, and what no library of effects has.

use nalgebra::Vector3;

/// A room that its jets set in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Room {
    pub(crate) speed_mps: f64,
    pub(crate) spin_up_s: f64,
    /// Above the horizon and around it (rad).
    pub(crate) elevation_rad: f64,
    pub(crate) azimuth_rad: f64,
}

/// A local flow in one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Vent {
    pub(crate) at_m: [f64; 2],
    pub(crate) radius_m: f64,
    pub(crate) blows_mps: [f64; 2],
    /// Period (s) at which it is switched on and off again, half of the time each; infinite:
    /// always on.
    pub(crate) period_s: f64,
}

/// A shelf: what comes from above reaches the places below it weakened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shelf {
    pub(crate) at_m: [f64; 2],
    pub(crate) half_m: [f64; 2],
    pub(crate) z_m: f64,
    /// Part of the speed that it takes away.
    pub(crate) takes: f64,
}

/// An upright wall, by a horizontal unit normal and its distance from the origin (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wall {
    pub(crate) normal: [f64; 2],
    pub(crate) away_m: f64,
}

/// An upright panel beside the probes: jets from behind it reach them weakened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Panel {
    pub(crate) azimuth_rad: f64,
    pub(crate) half_angle_rad: f64,
    /// Part of the speed that it takes away.
    pub(crate) takes: f64,
}

/// A jet that pulsates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Flap {
    pub(crate) part: f64,
    pub(crate) hz: f64,
}

impl Shelf {
    /// Part of the speed that passes from a drone to a point: the line between them against the
    /// shelf, with edges of a few centimetres.
    pub(super) fn lets_through(&self, drone_m: Vector3<f64>, point_m: Vector3<f64>) -> f64 {
        if !(point_m.z..drone_m.z).contains(&self.z_m) {
            return 1.0;
        }
        let at_m = point_m.lerp(&drone_m, (self.z_m - point_m.z) / (drone_m.z - point_m.z));
        let inside = |axis: usize| {
            let beyond_m = (at_m[axis] - self.at_m[axis]).abs() - self.half_m[axis];
            1.0 / (1.0 + (beyond_m / 0.02).exp())
        };
        1.0 - self.takes * inside(0) * inside(1)
    }
}

impl Wall {
    /// The mirror image of a point.
    pub(super) fn mirrored(&self, point_m: Vector3<f64>) -> Vector3<f64> {
        let normal = Vector3::new(self.normal[0], self.normal[1], 0.0);
        point_m + 2.0 * (self.away_m - point_m.dot(&normal)) * normal
    }
}

impl Vent {
    /// 1 while it blows, 0 while it is off.
    pub(super) fn is_on(&self, t_s: f64) -> f64 {
        f64::from(u8::from((t_s / self.period_s).rem_euclid(1.0) < 0.5))
    }

    pub(super) fn velocity_mps(&self, point_m: Vector3<f64>) -> Vector3<f64> {
        let away = (point_m.x - self.at_m[0]).hypot(point_m.y - self.at_m[1]) / self.radius_m;
        (-0.5 * away * away).exp() * Vector3::new(self.blows_mps[0], self.blows_mps[1], 0.0)
    }
}

impl Panel {
    /// Part of the speed that passes, for a drone at a place seen from the probe.
    pub(super) fn lets_through(&self, drone_m: Vector3<f64>, motors_m: f64) -> f64 {
        let radius_m = drone_m.x.hypot(drone_m.y);
        let turn = drone_m.y.atan2(drone_m.x) - self.azimuth_rad;
        let turn = turn.sin().atan2(turn.cos()).abs();
        // Edges of four degrees; the panel stands a fifth of a motor distance away from the probe.
        let behind = 1.0 / (1.0 + ((turn - self.half_angle_rad) / 0.07).exp());
        let beyond = 1.0 / (1.0 + ((0.2 - radius_m / motors_m) / 0.03).exp());
        1.0 - self.takes * behind * beyond
    }
}

impl Room {
    pub(super) fn velocity_mps(&self, t_s: f64) -> Vector3<f64> {
        let speed_mps = self.speed_mps * (1.0 - (-t_s.max(0.0) / self.spin_up_s).exp());
        let (up, level) = self.elevation_rad.sin_cos();
        let (y, x) = self.azimuth_rad.sin_cos();
        speed_mps * Vector3::new(level * x, level * y, up)
    }
}
