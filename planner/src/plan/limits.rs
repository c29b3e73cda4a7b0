//! Limits of a vehicle whose airframe states none.

use airflow::Airframe;

/// Share of its induced velocity at hover below which a drone may descend: rotors enter vortex ring
/// state at descents of about half of it (Johnson, "Model for vortex ring state influence on
/// rotorcraft flight dynamics", NASA/TP-2005-213477); chosen here, with a margin of a fifth.
const DESCENT_SHARE: f64 = 0.4;
/// Motor distance (m) from which an airframe counts as large: chosen here, between research frames
/// and industrial ones.
const LARGE_M: f64 = 0.6;
/// Acceleration and jerk of small airframes (m/s², m/s³): chosen here, between the defaults of
/// PX4's missions (MPC_ACC_HOR 3, MPC_JERK_AUTO 4) and its manual flight (5 and 8 and more), a
/// third of what tilting by 45 degrees gives.
const SMALL_AGILITY: (f64, f64) = (4.0, 20.0);
/// The same of large airframes: chosen here, lower as their motors and inertias are slower.
const LARGE_AGILITY: (f64, f64) = (2.5, 8.0);

/// Greatest mass, load included, over the airframe's own: the best racing drones lift some ten
/// times their mass at full thrust, none hovers at half of that.
pub(crate) const MOST_MASS_RATIO: f64 = 5.0;
/// Greatest induced velocity (m/s) at hover with a load: the paper's airframes have 5 to 10,
/// helicopters up to 20.
pub(crate) const MOST_INDUCED_VELOCITY_MPS: f64 = 60.0;

/// Whether an airframe hovers with a load at no such mass (kg), in air of a density (kg/m³).
pub(crate) fn is_overloaded(airframe: &Airframe, mass_kg: f64, density_kg_per_m3: f64) -> bool {
    mass_kg > airframe.mass_kg() * MOST_MASS_RATIO
        || airframe.hover_induced_velocity_mps(mass_kg, density_kg_per_m3)
            > MOST_INDUCED_VELOCITY_MPS
}

/// Limits of an airframe that states none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DefaultLimits {
    /// Highest vertical speed upwards (m/s): full speed.
    pub(crate) max_climb_mps: f64,
    /// Highest vertical speed downwards (m/s): two fifths of its induced velocity at hover, at most
    /// full speed.
    pub(crate) max_descent_mps: f64,
    /// By its size (m/s²).
    pub(crate) max_acceleration_mps2: f64,
    /// By its size (m/s³).
    pub(crate) max_jerk_mps3: f64,
}

impl DefaultLimits {
    /// Those of an airframe at a highest speed (m/s) in air of a density (kg/m³).
    pub(crate) fn of(airframe: &Airframe, max_speed_mps: f64, density_kg_per_m3: f64) -> Self {
        let induced_mps =
            airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3);
        let (max_acceleration_mps2, max_jerk_mps3) = match airframe.motor_distance_m() {
            small if small < LARGE_M => SMALL_AGILITY,
            _ => LARGE_AGILITY,
        };
        DefaultLimits {
            max_climb_mps: max_speed_mps,
            max_descent_mps: max_speed_mps.min(DESCENT_SHARE * induced_mps),
            max_acceleration_mps2,
            max_jerk_mps3,
        }
    }
}
