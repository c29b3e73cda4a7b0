//! How a drone answers to air from above, `alpha` of its own induced velocity, by the law that the baseline declares.
//!
//! The two laws are two ends of what an autopilot does. One that holds height raises its power by `beta`; a drone at a limit of
//! its power, or faster through the jet than its controller, loses thrust instead. `beta` is the power to *hold* thrust: taken as
//! thrust lost, `T (1 - 1/beta)`, it predicts far too much.

use airflow::effects::{Effects, Reception};
use airflow::{DiscPoints, power};
use nalgebra::{Point3, Vector3};

use crate::forward::flow::Flow;
use crate::forward::hypothesis::Sensor;
use crate::record::baseline::{ReceiverAir, ReceiverLaw};
use crate::record::recording::{ReceiverSample, Recording, Track};

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
    vehicle: usize,
    discs: &DiscPoints,
    t_s: f64,
    centre_m: Point3<f64>,
) -> Option<f64> {
    let down_mps = |point_m| Some(-flow.velocity_mps(t_s, point_m, Some(vehicle))?.z);
    match air {
        ReceiverAir::Centre => down_mps(centre_m),
        ReceiverAir::DiscMean if *flow.effects() == Effects::default() => {
            let mut sources = Vec::new();
            flow.sources_at(t_s, centre_m, Some(vehicle), &mut sources)
                .then(|| {
                    airflow::mean_over_discs_mps(&sources, discs, centre_m, flow.superposition())
                })
        }
        ReceiverAir::DiscMean => {
            let mut mean_mps = 0.0;
            for (&[x, y], weight) in discs.offsets_m.iter().zip(&discs.weights) {
                mean_mps += weight * down_mps(centre_m + Vector3::new(x, y, 0.0))?;
            }
            Some(mean_mps)
        }
    }
}

/// Part of its own induced velocity below which the air from above does not count as a wake.
const STILL: f64 = 0.02;
/// Entries that a reference needs. Chosen here: twenty means of a noise of 5 % are known to 1 %.
const LEAST_STILL: usize = 20;

/// Power of each row of the receivers over that of the same drone where nobody blows on it; not a number where none was logged, or
/// nobody knows what it is without a wake.
#[must_use]
pub fn recorded_power_ratios(recording: &Recording) -> Vec<f64> {
    let flow = Flow::new(recording);
    let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
    let power_w = |sample: &ReceiverSample| {
        let track = &recording.vehicles[sample.vehicle].track;
        let column = track.power_w.as_ref()?;
        Some(Track::value_at(column, track.moment(sample.t_s)?))
            .filter(|power_w| power_w.is_finite())
    };
    let mut ratios = vec![f64::NAN; recording.receivers.len()];
    for (index, vehicle) in recording.vehicles.iter().enumerate() {
        let airframe = &vehicle.airframe;
        let hover_mps = airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3);
        let is_still = |sample: &ReceiverSample| {
            let moment = vehicle.track.moment(sample.t_s)?;
            let centre_m = vehicle.track.position_at(moment);
            let air_mps = -flow.velocity_mps(sample.t_s, centre_m, Some(index))?.z;
            Some(air_mps < STILL * hover_mps)
        };
        let own = recording.receivers.iter().enumerate();
        let own: Vec<(usize, &ReceiverSample)> =
            own.filter(|(_, sample)| sample.vehicle == index).collect();
        let mut still_w: Vec<f64> = own
            .iter()
            .filter(|(_, sample)| is_still(sample).unwrap_or(false))
            .filter_map(|(_, sample)| power_w(sample))
            .collect();
        if still_w.len() < LEAST_STILL {
            continue;
        }
        still_w.sort_by(f64::total_cmp);
        let reference_w = still_w[still_w.len() / 2];
        for (row, sample) in own {
            ratios[row] = power_w(sample).map_or(f64::NAN, |power_w| power_w / reference_w);
        }
    }
    ratios
}

/// Throttle or power ratios of one receiver, whose samples come in the order of time; `None` where some drone's place is not known.
#[must_use]
pub fn ratios(
    recording: &Recording,
    flow: &Flow,
    sensor: &Sensor,
    samples: &[ReceiverSample],
    first_s: f64,
    is_power: bool,
) -> Vec<Option<f64>> {
    let Some(vehicle_index) = samples.first().map(|sample| sample.vehicle) else {
        return Vec::new();
    };
    let vehicle = &recording.vehicles[vehicle_index];
    let baseline = &recording.baseline;
    let airframe = &vehicle.airframe;
    let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
    let hover_mps = airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3);
    let discs = airframe.disc_points();
    let first_v = samples.iter().find_map(|sample| sample.battery_v);
    let ratio_of = |sample: &ReceiverSample| {
        let moment = vehicle.track.moment(sample.t_s + sensor.clock_s)?;
        let centre_m = vehicle.track.position_at(moment);
        let air = baseline.receiver_air;
        let air_mps = air_met_mps(flow, air, vehicle_index, &discs, sample.t_s, centre_m)?;
        let height_m = recording.environment.floor_z_m.map(|z_m| centre_m.z - z_m);
        let gap_m = recording
            .environment
            .ceiling_z_m
            .map(|z_m| z_m - centre_m.z);
        let reception = Reception {
            height_m,
            gap_m,
            propeller_radius_m: 0.5 * airframe.propeller_diameter_m(),
            voltage_ratio: sample
                .battery_v
                .zip(first_v)
                .map(|(now, first)| now / first),
        };
        let effects = flow.effects();
        let own_mps = vehicle.track.velocity_at(moment) / hover_mps;
        let felt = effects.receiver_alpha(air_mps / hover_mps);
        let (alpha, lift) = effects.own_motion.map_or((felt, 1.0), |motion| {
            let forward = own_mps.x.hypot(own_mps.y);
            (motion.alpha(felt, own_mps.z), motion.thrust_ratio(forward))
        });
        let law = baseline.receiver_law;
        let steady = if is_power {
            power_ratio(law, alpha) * effects.power_factor(&reception) / lift.powf(1.5)
        } else {
            throttle_ratio(law, alpha) * effects.throttle_factor(&reception) / lift.sqrt()
        };
        Some(sensor.reads(steady, sample.t_s - first_s))
    };
    samples.iter().map(ratio_of).collect()
}
