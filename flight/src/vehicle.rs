//! What an airframe is to its flight: limits, lags, drag, battery; and how it moves.
//!
//! A point mass with a direction of thrust that lags, rotors that lag, and drag:
//!
//! ```text
//! m dv/dt = T n - m g e_z - ½ ρ C_D A |w| diag(c, c, 1) w - m k (v_x, v_y, 0),   w = v + U e_z
//! dn/dt = (n_c - n)/τ_n, at most ω_n        dΩ/dt = (Ω_c - Ω)/τ_m
//! ```
//!
//! `U` is the air from above, counted downwards; `T` is of [`Rotor`]. Not modelled: torque and
//! sideways force of gradients, entrained air, vortex ring state, ground effect. Yaw is held.

use airflow::{Airframe, GRAVITY_MPS2};
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::rotor::Rotor;

/// Motor lag (s) at a propeller diameter of [`MOTOR_LAG_AT_M`]; it grows with the root of the
/// diameter. Assumed, not in the paper: within the 30 to 60 ms of 5-inch propellers.
const MOTOR_LAG_S: f64 = 0.045;
/// m.
const MOTOR_LAG_AT_M: f64 = 0.13;
/// Lag of the direction of thrust (s) at a motor distance of [`ATTITUDE_LAG_AT_M`], and its root.
/// Assumed, not in the paper: an attitude loop of 12 rad/s.
const ATTITUDE_LAG_S: f64 = 0.08;
/// m.
const ATTITUDE_LAG_AT_M: f64 = 0.27;
/// Fastest turn of the direction of thrust (rad/s). Assumed, not in the paper: PX4's default limit
/// of roll and pitch rate (220 deg/s), to one digit.
const TILT_RATE_RADPS: f64 = 4.0;
/// Drag area seen from above over the squared motor distance: the middle of what
/// [`airflow::effects::BodyDrag`] has for frames.
const DRAG_AREA_OVER_L2: f64 = 0.2;
/// The same from the side, over that from above. Assumed: arms and battery stand edge on.
const SIDEWAYS_DRAG: f64 = 0.6;
/// Rotor drag over mass and own horizontal speed (1/s). Assumed, within the 0.2 to 0.5 of small
/// quadrotors (linear rotor drag: M. Faessler, A. Franchi, D. Scaramuzza, RA-L 2018,
/// arXiv:1712.02402).
const ROTOR_DRAG_PER_S: f64 = 0.3;
/// Least rotor speed over that at hover: motors idle. Assumed.
const LEAST_SPEED: f64 = 0.3;

/// What goes by an airframe's name.
struct Preset {
    thrust_to_weight: f64,
    max_tilt_deg: f64,
    battery_wh: Option<f64>,
    drive_efficiency: f64,
}

/// A preset by its name. Thrust and tilt are assumed, not in the paper. Batteries as their makers
/// state them: Matrice 300 two TB60, Mavic 3E 5000 mAh at 15.4 V, Elios 3 4350 mAh at 22.8 V,
/// Crazyflie 2.1 250 mAh at 3.7 V; the paper names none for its own drones. On that a Crazyflie 2.1
/// hovers for 7 minutes, as its maker states, electronics included; else a figure of merit of 0.6
/// and a drive of 0.8 are assumed.
fn preset(airframe: &str) -> Preset {
    let (thrust_to_weight, max_tilt_deg, battery_wh) = match airframe {
        "kolibri" | "offboard-1" => (4.0, 35.0, None),
        "offboard-2" => (2.4, 35.0, None),
        "matrice-300" => (1.9, 30.0, Some(548.0)),
        "mavic-3e" => (2.0, 35.0, Some(77.0)),
        "elios-3" => (1.8, 30.0, Some(99.0)),
        "crazyflie-2.1" => (1.9, 30.0, Some(0.925)),
        "crazyflie-2.1-deck" => (1.6, 30.0, Some(0.925)),
        // Assumed.
        _ => (2.0, 30.0, None),
    };
    let drive_efficiency = match airframe {
        "crazyflie-2.1" | "crazyflie-2.1-deck" => 0.136,
        _ => 0.5,
    };
    Preset {
        thrust_to_weight,
        max_tilt_deg,
        battery_wh,
        drive_efficiency,
    }
}

/// How one airframe flies.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Vehicle {
    /// Highest thrust over weight, without payload, in still air.
    pub thrust_to_weight: f64,
    /// Largest angle of the thrust from the vertical (deg).
    pub max_tilt_deg: f64,
    /// Time constant of the rotors' speed (s).
    pub motor_lag_s: f64,
    /// Time constant of the direction of thrust (s).
    pub attitude_lag_s: f64,
    /// Fastest turn of the direction of thrust (rad/s).
    pub max_tilt_rate_radps: f64,
    /// Drag area seen from above over the squared motor distance.
    pub drag_area_over_l2: f64,
    /// The same from the side, over that from above.
    pub sideways_drag: f64,
    /// Rotor drag over mass and own horizontal speed (1/s).
    pub rotor_drag_per_s: f64,
    /// How the rotors' thrust changes with the air through them.
    pub rotor: Rotor,
    /// Energy of a full battery (Wh); `None`: not known, and nothing is said of it.
    pub battery_wh: Option<f64>,
    /// Aerodynamic over electrical power.
    pub drive_efficiency: f64,
}

/// What a file says of a vehicle; the rest keeps its default.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleEntry {
    /// As [`Vehicle::thrust_to_weight`]; above 1.
    pub thrust_to_weight: Option<f64>,
    /// As [`Vehicle::max_tilt_deg`]; 1 to 80.
    pub max_tilt_deg: Option<f64>,
    /// As [`Vehicle::motor_lag_s`]; 0.001 to 1.
    pub motor_lag_s: Option<f64>,
    /// As [`Vehicle::attitude_lag_s`]; 0.001 to 1.
    pub attitude_lag_s: Option<f64>,
    /// As [`Vehicle::max_tilt_rate_radps`]; 0.1 to 100.
    pub max_tilt_rate_radps: Option<f64>,
    /// As [`Vehicle::drag_area_over_l2`]; 0 to 10.
    pub drag_area_over_l2: Option<f64>,
    /// As [`Vehicle::sideways_drag`]; 0 to 10.
    pub sideways_drag: Option<f64>,
    /// As [`Vehicle::rotor_drag_per_s`]; 0 to 10.
    pub rotor_drag_per_s: Option<f64>,
    /// As [`Vehicle::rotor`].
    pub rotor: Option<Rotor>,
    /// As [`Vehicle::battery_wh`]; above 0.
    pub battery_wh: Option<f64>,
    /// As [`Vehicle::drive_efficiency`]; 0.01 to 1.
    pub drive_efficiency: Option<f64>,
}

impl VehicleEntry {
    /// Every value that no vehicle has, with what it may be.
    #[must_use]
    pub fn problems(&self) -> Vec<String> {
        let kappa = match self.rotor {
            Some(Rotor::Blade { kappa }) => Some(kappa),
            _ => None,
        };
        let fields = [
            ("thrust_to_weight", self.thrust_to_weight, 1.01, 50.0),
            ("max_tilt_deg", self.max_tilt_deg, 1.0, 80.0),
            ("motor_lag_s", self.motor_lag_s, 0.001, 1.0),
            ("attitude_lag_s", self.attitude_lag_s, 0.001, 1.0),
            ("max_tilt_rate_radps", self.max_tilt_rate_radps, 0.1, 100.0),
            ("drag_area_over_l2", self.drag_area_over_l2, 0.0, 10.0),
            ("sideways_drag", self.sideways_drag, 0.0, 10.0),
            ("rotor_drag_per_s", self.rotor_drag_per_s, 0.0, 10.0),
            ("rotor: kappa", kappa, 0.0, 10.0),
            ("battery_wh", self.battery_wh, 1e-3, 1e6),
            ("drive_efficiency", self.drive_efficiency, 0.01, 1.0),
        ];
        let wrong = fields.into_iter().filter_map(|(key, value, low, high)| {
            let value = value.filter(|it| !(low..=high).contains(it))?;
            Some(format!(
                "{key} is {value}; it must lie within {low} to {high}"
            ))
        });
        wrong.collect()
    }

    /// This entry where it says something, else the other.
    #[must_use]
    pub fn or(&self, other: &VehicleEntry) -> VehicleEntry {
        VehicleEntry {
            thrust_to_weight: self.thrust_to_weight.or(other.thrust_to_weight),
            max_tilt_deg: self.max_tilt_deg.or(other.max_tilt_deg),
            motor_lag_s: self.motor_lag_s.or(other.motor_lag_s),
            attitude_lag_s: self.attitude_lag_s.or(other.attitude_lag_s),
            max_tilt_rate_radps: self.max_tilt_rate_radps.or(other.max_tilt_rate_radps),
            drag_area_over_l2: self.drag_area_over_l2.or(other.drag_area_over_l2),
            sideways_drag: self.sideways_drag.or(other.sideways_drag),
            rotor_drag_per_s: self.rotor_drag_per_s.or(other.rotor_drag_per_s),
            rotor: self.rotor.or(other.rotor),
            battery_wh: self.battery_wh.or(other.battery_wh),
            drive_efficiency: self.drive_efficiency.or(other.drive_efficiency),
        }
    }
}

impl Vehicle {
    /// The vehicle of an airframe: what an entry says, and defaults by name and size.
    #[must_use]
    pub fn of(airframe: &Airframe, entry: &VehicleEntry) -> Vehicle {
        let preset = preset(airframe.name());
        let scaled = |at_s: f64, ratio: f64| at_s * ratio.sqrt();
        let motor_lag_s = scaled(
            MOTOR_LAG_S,
            airframe.propeller_diameter_m() / MOTOR_LAG_AT_M,
        );
        let attitude_lag_s = scaled(
            ATTITUDE_LAG_S,
            airframe.motor_distance_m() / ATTITUDE_LAG_AT_M,
        );
        Vehicle {
            thrust_to_weight: entry.thrust_to_weight.unwrap_or(preset.thrust_to_weight),
            max_tilt_deg: entry.max_tilt_deg.unwrap_or(preset.max_tilt_deg),
            motor_lag_s: entry.motor_lag_s.unwrap_or(motor_lag_s),
            attitude_lag_s: entry.attitude_lag_s.unwrap_or(attitude_lag_s),
            max_tilt_rate_radps: entry.max_tilt_rate_radps.unwrap_or(TILT_RATE_RADPS),
            drag_area_over_l2: entry.drag_area_over_l2.unwrap_or(DRAG_AREA_OVER_L2),
            sideways_drag: entry.sideways_drag.unwrap_or(SIDEWAYS_DRAG),
            rotor_drag_per_s: entry.rotor_drag_per_s.unwrap_or(ROTOR_DRAG_PER_S),
            rotor: entry.rotor.unwrap_or_default(),
            battery_wh: entry.battery_wh.or(preset.battery_wh),
            drive_efficiency: entry.drive_efficiency.unwrap_or(preset.drive_efficiency),
        }
    }
}

/// A vehicle in air of one density: what a step of its motion needs.
#[derive(Clone, Debug)]
pub(crate) struct Dynamics {
    pub(crate) vehicle: Vehicle,
    /// Weight without payload (N).
    pub(crate) weight_n: f64,
    /// Induced velocity at hover without payload (m/s).
    pub(crate) induced_mps: f64,
    /// Tangent of the largest tilt.
    pub(crate) most_tilt: f64,
    /// `½ ρ C_D A` seen from above (kg/m).
    drag_kg_per_m: f64,
}

/// Where a drone is and what its rotors do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Body {
    /// Centre of the rotor plane (m).
    pub(crate) position_m: Point3<f64>,
    /// m/s.
    pub(crate) velocity_mps: Vector3<f64>,
    /// Direction of thrust, of length 1.
    pub(crate) up: Vector3<f64>,
    /// Speed of the rotors over that at hover without payload.
    pub(crate) rotor_speed: f64,
}

/// What is asked of a body over one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Command {
    /// Direction of thrust, of length 1.
    pub(crate) up: Vector3<f64>,
    /// Vertical force (N).
    pub(crate) lift_n: f64,
    /// Factor of feed-forward on the rotors' speed; 1: none.
    pub(crate) speed_factor: f64,
}

/// What a body had over one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ThrustAndPower {
    /// Thrust (N).
    pub(crate) thrust_n: f64,
    /// Aerodynamic power (W).
    pub(crate) power_w: f64,
}

impl Dynamics {
    pub(crate) fn new(vehicle: Vehicle, airframe: &Airframe, density_kg_per_m3: f64) -> Dynamics {
        let mass_kg = airframe.mass_kg();
        let length_m = airframe.motor_distance_m();
        let drag_area_m2 = vehicle.drag_area_over_l2 * length_m * length_m;
        Dynamics {
            weight_n: mass_kg * GRAVITY_MPS2,
            induced_mps: airframe.hover_induced_velocity_mps(mass_kg, density_kg_per_m3),
            most_tilt: vehicle.max_tilt_deg.to_radians().tan(),
            drag_kg_per_m: 0.5 * density_kg_per_m3 * drag_area_m2,
            vehicle,
        }
    }

    /// At rest, hovering with a mass (kg).
    pub(crate) fn hovering(&self, position_m: Point3<f64>, mass_kg: f64) -> Body {
        Body {
            position_m,
            velocity_mps: Vector3::zeros(),
            up: Vector3::z(),
            rotor_speed: (mass_kg * GRAVITY_MPS2 / self.weight_n).sqrt(),
        }
    }

    /// One step of a body with a mass (kg), in air that comes down at `air_mps`.
    pub(crate) fn step(
        &self,
        body: &mut Body,
        command: &Command,
        (mass_kg, air_mps): (f64, f64),
        step_s: f64,
    ) -> ThrustAndPower {
        let vehicle = &self.vehicle;
        let share = |lag_s: f64| 1.0 - (-step_s / lag_s).exp();
        // The direction of thrust turns towards what is asked, no faster than it can.
        let turn = (command.up - body.up) * share(vehicle.attitude_lag_s);
        let most = vehicle.max_tilt_rate_radps * step_s;
        body.up = (body.up + turn.cap_magnitude(most)).normalize();
        // The flight stack knows thrust by the rotors' speed in still air.
        let least_upright = vehicle.max_tilt_deg.to_radians().cos();
        let lift_n = command.lift_n / body.up.z.max(least_upright.min(LEAST_UPRIGHT));
        let asked = (lift_n / self.weight_n).max(0.0).sqrt() * command.speed_factor;
        let asked = asked.clamp(LEAST_SPEED, vehicle.thrust_to_weight.sqrt());
        body.rotor_speed += (asked - body.rotor_speed) * share(vehicle.motor_lag_s);

        let past_mps = body.velocity_mps + Vector3::z() * air_mps;
        let inflow = past_mps.dot(&body.up) / self.induced_mps;
        let (thrust, power) = vehicle.rotor.thrust_and_power(body.rotor_speed, inflow);
        let thrust_n = thrust * self.weight_n;
        let drag_per_s = self.drag_kg_per_m * past_mps.norm() / mass_kg;
        let across_per_s = vehicle.sideways_drag * drag_per_s + vehicle.rotor_drag_per_s;
        let drag_mps2 =
            past_mps.component_mul(&Vector3::new(across_per_s, across_per_s, drag_per_s));
        let weight_mps2 = Vector3::z() * GRAVITY_MPS2;
        let acceleration_mps2 = body.up * (thrust_n / mass_kg) - weight_mps2 - drag_mps2;
        body.velocity_mps += acceleration_mps2 * step_s;
        body.position_m += body.velocity_mps * step_s;
        ThrustAndPower {
            thrust_n,
            power_w: power * self.weight_n * self.induced_mps,
        }
    }
}

/// Lift is divided by no less than this part of the thrust's vertical share, or that at the largest
/// tilt: chosen here, a tilt of 53 degrees, beyond every largest tilt above.
const LEAST_UPRIGHT: f64 = 0.6;
