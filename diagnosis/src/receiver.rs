//! How a drone answers to air from above, `alpha` of its own induced velocity, by the law that the baseline declares.
//!
//! The two laws are two ends of what an autopilot does. One that holds height raises its power by `beta`; a drone at a limit of
//! its power, or faster through the jet than its controller, loses thrust instead. `beta` is the power to *hold* thrust: taken as
//! thrust lost, `T (1 - 1/beta)`, it predicts far too much.

use airflow::power;

use crate::baseline::{ReceiverAir, ReceiverLaw};
use crate::flow::Flow;
use crate::recording::Vehicle;
use nalgebra::Point3;

/// Throttle over that of hover in still air.
#[must_use]
pub fn throttle_ratio(law: ReceiverLaw, alpha: f64) -> f64 {
    match law {
        ReceiverLaw::HoldsThrust { exponent } => power::throttle_factor(alpha, exponent),
        ReceiverLaw::HoldsPower => 1.0,
    }
}

/// Power over that of hover in still air.
#[must_use]
pub fn power_ratio(law: ReceiverLaw, alpha: f64) -> f64 {
    match law {
        ReceiverLaw::HoldsThrust { .. } => power::beta(alpha),
        ReceiverLaw::HoldsPower => 1.0,
    }
}

/// Thrust over what the same throttle gives in still air.
#[must_use]
pub fn thrust_ratio(law: ReceiverLaw, alpha: f64) -> f64 {
    match law {
        ReceiverLaw::HoldsThrust { .. } => 1.0,
        ReceiverLaw::HoldsPower => power::thrust_ratio_at_constant_power(alpha),
    }
}

/// Air (m/s, downwards) that a vehicle of the recording meets at a time with its rotor plane centred at `centre_m`: at the centre
/// or over its discs, as declared. `None` where some other drone's place is not known.
#[must_use]
pub fn air_met_mps(
    flow: &Flow,
    air: ReceiverAir,
    vehicles: &[Vehicle],
    vehicle: usize,
    t_s: f64,
    centre_m: Point3<f64>,
) -> Option<f64> {
    let mut sources = Vec::with_capacity(vehicles.len());
    if !flow.sources_at(t_s, centre_m, Some(vehicle), &mut sources) {
        return None;
    }
    let superposition = flow.superposition();
    Some(match air {
        ReceiverAir::Centre => airflow::axial_speed_mps(&sources, centre_m, superposition),
        ReceiverAir::DiscMean => {
            let discs = vehicles[vehicle].airframe.disc_points();
            airflow::mean_over_discs_mps(&sources, &discs, centre_m, superposition)
        }
    })
}
