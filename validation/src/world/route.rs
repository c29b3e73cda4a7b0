//! Where a drone is: knots joined by straight lines, and a slow swaying about them.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::jet::GRAVITY;
use diagnosis::statistics::draws::Draws;

/// Sway of a hovering drone (m), standard deviation per axis.
const SWAY_M: f64 = 0.003;

/// One knot of a route.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Knot {
    pub(crate) t_s: f64,
    pub(crate) place_m: Vector3<f64>,
    pub(crate) yaw_rad: f64,
    /// Roll and pitch (rad).
    pub(crate) lean_rad: [f64; 2],
}

/// A route through space and time; before its first and after its last knot the drone stands there.
#[derive(Clone, Debug, Default)]
pub(crate) struct Route {
    knots: Vec<Knot>,
    /// Amplitude (m), angular speed (rad/s), phase: three for each axis.
    sways: [[[f64; 3]; 3]; 3],
}

impl Route {
    /// A route that sways as a hovering drone does.
    pub(crate) fn swaying(random: &mut Draws) -> Route {
        let sways = [(); 3].map(|()| {
            [(); 3].map(|()| {
                // Three sines of equal power; 0.1 to 0.3 Hz is how hovering drones sway (chosen
                // here).
                let rad_per_s = TAU * random.between(0.1, 0.3);
                [
                    SWAY_M * (2f64 / 3.0).sqrt(),
                    rad_per_s,
                    random.between(0.0, TAU),
                ]
            })
        });
        Route {
            knots: Vec::new(),
            sways,
        }
    }

    pub(crate) fn end_s(&self) -> f64 {
        self.knots.last().map_or(0.0, |knot| knot.t_s)
    }

    /// Flies straight to a place at a speed (m/s); the first call is where it starts.
    pub(crate) fn go(&mut self, place_m: Vector3<f64>, speed_mps: f64) {
        let before = self.knots.last().copied();
        let takes_s = before.map_or(0.0, |knot| (place_m - knot.place_m).norm() / speed_mps);
        self.knots.push(Knot {
            t_s: self.end_s() + takes_s.max(1e-3),
            place_m,
            yaw_rad: before.map_or(0.0, |knot| knot.yaw_rad),
            lean_rad: before.map_or([0.0; 2], |knot| knot.lean_rad),
        });
    }

    pub(crate) fn stay(&mut self, seconds: f64) {
        if let Some(&knot) = self.knots.last() {
            self.knots.push(Knot {
                t_s: knot.t_s + seconds,
                ..knot
            });
        }
    }

    /// Turns where it is, within a second.
    pub(crate) fn turn(&mut self, yaw_rad: f64, lean_rad: [f64; 2]) {
        self.stay(1.0);
        if let Some(knot) = self.knots.last_mut() {
            knot.yaw_rad = yaw_rad;
            knot.lean_rad = lean_rad;
        }
    }

    /// Flies to and fro some times along an azimuth (rad), with this period (s) and highest
    /// acceleration (m/s²), its thrust tilted as that takes.
    pub(crate) fn shake(&mut self, azimuth: f64, most_mps2: f64, period_s: f64, times: usize) {
        let Some(&middle) = self.knots.last() else {
            return;
        };
        let aside = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let (sin_yaw, cos_yaw) = middle.yaw_rad.sin_cos();
        let amplitude_m = most_mps2 * (period_s / TAU).powi(2);
        let parts = 24;
        for part in 1..=parts * times {
            let phase = part as f64 / parts as f64;
            let swing = (TAU * phase).sin();
            let pull = -most_mps2 * swing / GRAVITY * aside;
            let (ahead, left) = (
                cos_yaw * pull.x + sin_yaw * pull.y,
                cos_yaw * pull.y - sin_yaw * pull.x,
            );
            self.knots.push(Knot {
                t_s: middle.t_s + phase * period_s,
                place_m: middle.place_m + amplitude_m * swing * aside,
                // Roll first, then pitch: what is ahead is tilted by pitch, what is left by roll.
                lean_rad: [-left.atan2(ahead.hypot(1.0)), ahead.atan()],
                ..middle
            });
        }
    }

    /// The knot that a drone passes at a time, without its swaying.
    pub(crate) fn knot(&self, t_s: f64) -> Knot {
        let after = self.knots.partition_point(|knot| knot.t_s <= t_s);
        let before = self.knots.get(after.saturating_sub(1)).copied();
        let resting = Knot {
            t_s,
            place_m: Vector3::zeros(),
            yaw_rad: 0.0,
            lean_rad: [0.0; 2],
        };
        match (before, self.knots.get(after)) {
            (Some(from), Some(to)) if after > 0 => {
                let share = (t_s - from.t_s) / (to.t_s - from.t_s);
                let between = |a: f64, b: f64| a + share * (b - a);
                Knot {
                    t_s,
                    place_m: from.place_m.lerp(&to.place_m, share),
                    yaw_rad: between(from.yaw_rad, to.yaw_rad),
                    lean_rad: [0, 1].map(|i| between(from.lean_rad[i], to.lean_rad[i])),
                }
            }
            (Some(only), _) => Knot { t_s, ..only },
            (None, _) => resting,
        }
    }

    pub(crate) fn position_m(&self, t_s: f64) -> Vector3<f64> {
        let mut place_m = self.knot(t_s).place_m;
        for (axis, sways) in self.sways.iter().enumerate() {
            for [amplitude_m, rad_per_s, phase] in sways {
                place_m[axis] += amplitude_m * (rad_per_s * t_s + phase).sin();
            }
        }
        place_m
    }

    /// How far it goes along a horizontal unit vector, from the origin (m), without its swaying.
    pub(crate) fn reaches_m(&self, [x, y]: [f64; 2]) -> f64 {
        let along = self
            .knots
            .iter()
            .map(|knot| x * knot.place_m.x + y * knot.place_m.y);
        along.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Velocity (m/s): as a tracker has it, over a tenth of a second.
    pub(crate) fn velocity_mps(&self, t_s: f64) -> Vector3<f64> {
        (self.position_m(t_s + 0.05) - self.position_m(t_s - 0.05)) / 0.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shaken_drone_leans_as_its_acceleration_takes() {
        let mut route = Route::default();
        route.go(Vector3::zeros(), 1.0);
        route.shake(0.7, 2.0, 2.0, 2);
        for t_s in [0.3, 0.9, 1.7, 3.1] {
            let [before, at, after] = [t_s - 0.1, t_s, t_s + 0.1].map(|t_s| route.position_m(t_s));
            let pull = (before + after - 2.0 * at) / 0.01 + GRAVITY * Vector3::z();
            let [roll, pitch] = route.knot(t_s).lean_rad;
            let up = nalgebra::Rotation3::from_euler_angles(roll, pitch, 0.0) * Vector3::z();
            // Straight lines between knots: a few parts in a hundred of the acceleration.
            assert!((up - pull.normalize()).norm() < 0.02, "{t_s}: {up} {pull}");
        }
    }
}
