//! Two controllers: a cascade as PX4 has it, and a stiff one as in research, without integral.
//!
//! ```text
//! v_c = v_r + K_p (p_r - p)
//! a_c = a_r + K_v (v_c - v) + ∫ K_i (v_c - v) dt - K_d dv/dt + g e_z
//! ```
//!
//! with the vertical force within idle and full thrust, and the horizontal one within the largest
//! tilt; the horizontal integral rests while that limit holds. Place and velocity are known
//! exactly; so is the mass, payload included.

use airflow::GRAVITY_MPS2;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reference::Reference;
use crate::vehicle::{Body, Command, Dynamics};

/// Which controller flies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Controller {
    /// PX4's cascade of position and velocity with its default gains.
    Px4,
    /// A stiff cascade without integral, as research vehicles fly.
    Research,
}

impl Controller {
    /// As files and the command line have it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Controller::Px4 => "px4",
            Controller::Research => "research",
        }
    }
}

/// Gains of the cascade; pairs are horizontal, vertical.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// `K_p` (1/s).
    pub position_per_s: [f64; 2],
    /// `K_v` (1/s).
    pub velocity_per_s: [f64; 2],
    /// `K_i` (1/s²).
    pub integral_per_s2: [f64; 2],
    /// `K_d` (without unit), of the drone's own acceleration.
    pub damping: [f64; 2],
}

/// PX4's defaults: MPC_XY_P, MPC_Z_P; MPC_XY_VEL_P_ACC, MPC_Z_VEL_P_ACC; .._I_ACC; .._D_ACC (PX4
/// user guide, parameter reference).
pub const PX4: Gains = Gains {
    position_per_s: [0.95, 1.0],
    velocity_per_s: [1.8, 4.0],
    integral_per_s2: [0.4, 2.0],
    damping: [0.2, 0.0],
};

/// Assumed here: a position loop of 2 to 2.5 rad/s on a velocity loop of 6, no integral.
pub const RESEARCH: Gains = Gains {
    position_per_s: [2.5, 2.0],
    velocity_per_s: [6.0, 6.0],
    integral_per_s2: [0.0, 0.0],
    damping: [0.0, 0.0],
};

/// Largest horizontal and vertical integral (m/s²), chosen here: a tilt of 17 degrees, and all of
/// the weight.
const MOST_INTEGRAL_MPS2: [f64; 2] = [3.0, GRAVITY_MPS2];
/// Least vertical force over the weight: rotors are not stopped. Assumed.
const LEAST_LIFT: f64 = 0.25;

/// The velocity asked for stays within this many times the vehicle's highest speed, and a little
/// (m/s); assumed, so that a large error does not ask for more than a stack would.
pub(crate) fn most_speed_mps(max_speed_mps: f64) -> f64 {
    1.5 * max_speed_mps + 1.0
}

impl Gains {
    /// Every gain that makes no controller.
    #[must_use]
    pub fn problems(&self) -> Vec<String> {
        let fields = [
            ("position_per_s", self.position_per_s, 50.0),
            ("velocity_per_s", self.velocity_per_s, 100.0),
            ("integral_per_s2", self.integral_per_s2, 100.0),
            ("damping", self.damping, 10.0),
        ];
        let wrong = fields.into_iter().filter_map(|(key, [a, b], most)| {
            let is_gain = |it: f64| (0.0..=most).contains(&it);
            (!is_gain(a) || !is_gain(b))
                .then(|| format!("{key} is ({a}, {b}); both must lie within 0 to {most}"))
        });
        wrong.collect()
    }
}

/// What the controller of one drone remembers.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cascade {
    integral_mps2: Vector3<f64>,
    velocity_before_mps: Vector3<f64>,
}

impl Cascade {
    /// The command for a step, and whether the largest tilt limits it.
    pub(crate) fn command(
        &mut self,
        gains: &Gains,
        (dynamics, max_speed_mps): (&Dynamics, f64),
        (reference, body): (&Reference, &Body),
        step_s: f64,
    ) -> (Command, bool) {
        let each = |[level, upright]: [f64; 2]| Vector3::new(level, level, upright);
        let most_mps = most_speed_mps(max_speed_mps);
        let off_m = reference.position_m - body.position_m;
        let mut asked_mps =
            reference.velocity_mps + off_m.component_mul(&each(gains.position_per_s));
        let level_mps = asked_mps.xy().cap_magnitude(most_mps);
        asked_mps = Vector3::new(
            level_mps.x,
            level_mps.y,
            asked_mps.z.clamp(-most_mps, most_mps),
        );
        let error_mps = asked_mps - body.velocity_mps;
        let gained_mps2 = (body.velocity_mps - self.velocity_before_mps) / step_s;
        self.velocity_before_mps = body.velocity_mps;
        let mut force_mps2 = reference.acceleration_mps2
            + error_mps.component_mul(&each(gains.velocity_per_s))
            + self.integral_mps2
            - gained_mps2.component_mul(&each(gains.damping))
            + Vector3::z() * GRAVITY_MPS2;
        let most_lift_mps2 =
            dynamics.vehicle.thrust_to_weight * dynamics.weight_n / reference.mass_kg;
        let least_lift_mps2 = (LEAST_LIFT * GRAVITY_MPS2).min(most_lift_mps2);
        force_mps2.z = force_mps2.z.clamp(least_lift_mps2, most_lift_mps2);
        let (level, most) = (force_mps2.xy(), force_mps2.z * dynamics.most_tilt);
        let is_full = level.norm() > most;
        let grown_mps2 = error_mps.component_mul(&each(gains.integral_per_s2)) * step_s;
        let [most_level, most_upright] = MOST_INTEGRAL_MPS2;
        let integral = &mut self.integral_mps2;
        if is_full {
            let level = level.cap_magnitude(most);
            force_mps2 = Vector3::new(level.x, level.y, force_mps2.z);
        } else {
            integral.x = (integral.x + grown_mps2.x).clamp(-most_level, most_level);
            integral.y = (integral.y + grown_mps2.y).clamp(-most_level, most_level);
        }
        integral.z = (integral.z + grown_mps2.z).clamp(-most_upright, most_upright);
        let command = Command {
            up: force_mps2.normalize(),
            lift_n: reference.mass_kg * force_mps2.z,
            speed_factor: 1.0,
        };
        (command, is_full)
    }
}

#[cfg(test)]
mod tests {
    use airflow::Airframe;
    use nalgebra::Point3;

    use super::*;
    use crate::vehicle::{Vehicle, VehicleEntry};

    const STEP_S: f64 = 0.01;

    fn dynamics() -> Dynamics {
        let airframe = Airframe::preset("offboard-2").expect("a preset");
        let vehicle = Vehicle::of(&airframe, &VehicleEntry::default());
        Dynamics::new(vehicle, &airframe, 1.204)
    }

    fn at_m(position_m: Point3<f64>) -> Reference {
        Reference {
            position_m,
            velocity_mps: Vector3::zeros(),
            acceleration_mps2: Vector3::zeros(),
            mass_kg: 1.207,
        }
    }

    /// Places at every step of a flight towards a place one metre away on every axis.
    fn step_response(gains: &Gains, seconds: f64) -> Vec<Vector3<f64>> {
        let dynamics = dynamics();
        let reference = at_m(Point3::new(1.0, 1.0, 1.0));
        let mut body = dynamics.hovering(Point3::origin(), 1.207);
        let mut cascade = Cascade::default();
        let steps = (seconds / STEP_S) as usize;
        let step = |_| {
            let (command, _) =
                cascade.command(gains, (&dynamics, 2.0), (&reference, &body), STEP_S);
            dynamics.step(&mut body, &command, (1.207, 0.0), STEP_S);
            body.position_m.coords
        };
        (0..steps).map(step).collect()
    }

    #[test]
    fn a_drone_that_hovers_stays() {
        let dynamics = dynamics();
        let reference = at_m(Point3::new(1.0, 2.0, 3.0));
        for gains in [PX4, RESEARCH] {
            let mut body = dynamics.hovering(reference.position_m, 1.207);
            let mut cascade = Cascade::default();
            for _ in 0..1000 {
                let (command, is_full) =
                    cascade.command(&gains, (&dynamics, 2.0), (&reference, &body), STEP_S);
                assert!(!is_full);
                let effort = dynamics.step(&mut body, &command, (1.207, 0.0), STEP_S);
                assert!((effort.thrust_n / (1.207 * GRAVITY_MPS2) - 1.0).abs() < 1e-9);
            }
            // Rounding over a thousand steps.
            assert!((body.position_m - reference.position_m).norm() < 1e-9);
        }
    }

    #[test]
    fn both_controllers_reach_a_step_and_the_stiff_one_sooner() {
        let rises_s = [PX4, RESEARCH].map(|gains| {
            let places = step_response(&gains, 20.0);
            let last = places[places.len() - 1];
            // PX4's horizontal integral creeps; a centimetre is a hundredth of the step.
            assert!((last - Vector3::repeat(1.0)).amax() < 0.01, "{last}");
            let highest = places.iter().map(|it| it.amax()).fold(0.0, f64::max);
            assert!(highest < 1.5, "overshoot: {highest}");
            let first = places
                .iter()
                .position(|it| it.x > 0.632)
                .expect("gets there");
            first as f64 * STEP_S
        });
        // A first-order position loop rises in 1/K_p, 1.05 and 0.4 s, and what the loops in it
        // take.
        assert!((0.9..1.7).contains(&rises_s[0]), "{rises_s:?}");
        assert!((0.4..0.9).contains(&rises_s[1]), "{rises_s:?}");
    }

    #[test]
    fn rotors_take_their_lag_and_the_thrust_its_limits() {
        let dynamics = dynamics();
        let mut body = dynamics.hovering(Point3::origin(), 1.207);
        let full = Command {
            up: Vector3::z(),
            lift_n: 100.0,
            speed_factor: 1.0,
        };
        let most = dynamics.vehicle.thrust_to_weight.sqrt();
        let lag_s = dynamics.vehicle.motor_lag_s;
        let steps = (lag_s / 1e-4) as usize;
        for _ in 0..steps {
            dynamics.step(&mut body, &full, (1.207, 0.0), 1e-4);
        }
        let risen = (body.rotor_speed - 1.0) / (most - 1.0);
        // 1 - 1/e after one lag, to the step over the lag.
        assert!((risen - (1.0 - (-1.0_f64).exp())).abs() < 2e-3, "{risen}");
        // 45 ms at 0.13 m, and its root.
        assert!((lag_s - 0.045 * (0.1295_f64 / 0.13).sqrt()).abs() < 1e-12);
        for _ in 0..10_000 {
            dynamics.step(&mut body, &full, (1.207, 0.0), 1e-4);
        }
        assert!(body.rotor_speed <= most);
    }
}
