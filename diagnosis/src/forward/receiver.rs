//! How a drone answers to air from above, `alpha` of its own induced velocity, by the law that the
//! baseline declares.
//!
//! The two laws are two ends of what an autopilot does. One that holds height raises its power by
//! `beta`; a drone at a limit of its power, or faster through the jet than its controller, loses
//! thrust instead. `beta` is the power to *hold* thrust: taken as thrust lost, `T (1 - 1/beta)`, it
//! predicts far too much.

use airflow::effects::Reception;
use airflow::power;

use crate::forward::anemometer::LowPass;
use crate::forward::flow::Flow;
use crate::forward::hypothesis::Sensor;
use crate::record::baseline::ReceiverLaw;
use crate::record::recording::{ReceiverSample, Recording, Track};
use crate::statistics::quantile::median;

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

/// Part of its own induced velocity below which the air from above does not count as a wake.
const STILL: f64 = 0.02;
/// Entries that a reference needs. Chosen here: twenty means of a noise of 5 % are known to 1 %.
const LEAST_STILL: usize = 20;

/// Whether a drone of the flow's recording is in no wake then; `None` where some drone's place is
/// not known.
pub(crate) fn is_still(flow: &Flow, vehicle_index: usize, t_s: f64) -> Option<bool> {
    let recording = flow.recording();
    let vehicle = &recording.vehicles[vehicle_index];
    let centre_m = flow.position_m(vehicle_index, vehicle.track.moment(t_s)?);
    let air_mps = -flow.velocity_mps(t_s, centre_m, Some(vehicle_index))?.z;
    Some(air_mps < STILL * recording.hover_mps(vehicle))
}

/// Power of each row of the receivers over that of the same drone in no wake; not a number where
/// none was logged, or the drone is never out of a wake.
#[must_use]
pub fn recorded_power_ratios(recording: &Recording) -> Vec<f64> {
    let flow = Flow::new(recording);
    let power_w = |sample: &ReceiverSample| {
        let track = &recording.vehicles[sample.vehicle].track;
        let column = track.power_w.as_ref()?;
        Some(Track::value_at(column, track.moment(sample.t_s)?))
            .filter(|power_w| power_w.is_finite())
    };
    let mut ratios = vec![f64::NAN; recording.receivers.len()];
    for index in 0..recording.vehicles.len() {
        let own = || {
            let all = recording.receivers.iter().enumerate();
            all.filter(|(_, sample)| sample.vehicle == index)
        };
        let still = own().filter(|(_, sample)| is_still(&flow, index, sample.t_s) == Some(true));
        let mut still_w: Vec<f64> = still.filter_map(|(_, sample)| power_w(sample)).collect();
        if still_w.len() < LEAST_STILL {
            continue;
        }
        let reference_w = median(&mut still_w).unwrap_or(f64::NAN);
        for (row, sample) in own() {
            ratios[row] = power_w(sample).map_or(f64::NAN, |power_w| power_w / reference_w);
        }
    }
    ratios
}

/// Throttle or power ratios of one receiver in some rows of its recording's, which come in the
/// order of time, with the lag and the clock of an instrument, before what else is wrong with it;
/// `None` where some drone's place is not known. What lags begins at its first value, and changes
/// linearly from row to row.
#[must_use]
pub fn ratios(flow: &Flow, sensor: &Sensor, rows: &[usize], is_power: bool) -> Vec<Option<f64>> {
    let mut ratios = prompt_ratios(flow, sensor.clock_s, rows, is_power);
    if sensor.lag_s == 0.0 {
        return ratios;
    }
    let receivers = &flow.recording().receivers;
    let mut before: Option<(f64, [f64; 2])> = None;
    for (ratio, &row) in ratios.iter_mut().zip(rows) {
        let t_s = receivers[row].t_s;
        before = ratio.map(|now| {
            let lags = |(from_s, held): (f64, [f64; 2])| match t_s > from_s {
                true => LowPass::new(sensor.lag_s, t_s - from_s).after(held, now),
                false => held[1],
            };
            let read = before.map_or(now, lags);
            *ratio = Some(read);
            (t_s, [now, read])
        });
    }
    ratios
}

/// The same of an instrument that follows at once.
fn prompt_ratios(flow: &Flow, clock_s: f64, rows: &[usize], is_power: bool) -> Vec<Option<f64>> {
    let recording = flow.recording();
    let all = &recording.receivers;
    let samples = || rows.iter().map(|&row| &all[row]);
    let Some(vehicle_index) = samples().next().map(|sample| sample.vehicle) else {
        return Vec::new();
    };
    let vehicle = &recording.vehicles[vehicle_index];
    let baseline = &recording.baseline;
    let airframe = &vehicle.airframe;
    let hover_mps = recording.hover_mps(vehicle);
    let discs = airframe.disc_points();
    let first_v = samples().find_map(|sample| sample.battery_v);
    let ratio_of = |sample: &ReceiverSample| {
        let moment = vehicle.track.moment(sample.t_s + clock_s)?;
        let centre_m = flow.position_m(vehicle_index, moment);
        let air = baseline.receiver_air;
        let others = |other| other != vehicle_index;
        let air_mps = flow.met_mps(air, &discs, (sample.t_s, centre_m), others)?;
        let environment = &recording.environment;
        let voltages = sample.battery_v.zip(first_v);
        let reception = Reception {
            height_m: environment.floor_z_m.map(|z_m| centre_m.z - z_m),
            gap_m: environment.ceiling_z_m.map(|z_m| z_m - centre_m.z),
            propeller_radius_m: 0.5 * airframe.propeller_diameter_m(),
            voltage_ratio: voltages.map(|(now, first)| now / first),
        };
        let effects = flow.effects();
        let own_mps = vehicle.track.velocity_at(moment) / hover_mps;
        let received = effects.receiver_alpha(air_mps / hover_mps);
        let (alpha, lift) = effects.own_motion.map_or((received, 1.0), |motion| {
            let lift = motion.thrust_ratio(own_mps.x.hypot(own_mps.y));
            (motion.alpha(received, own_mps.z), lift)
        });
        let law = baseline.receiver_law;
        Some(if is_power {
            power_ratio(law, alpha) * effects.power_factor(&reception) / lift.powf(1.5)
        } else {
            throttle_ratio(law, alpha) * effects.throttle_factor(&reception) / lift.sqrt()
        })
    };
    samples().map(ratio_of).collect()
}
