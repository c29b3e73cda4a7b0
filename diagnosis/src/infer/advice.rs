//! What to measure next: what tells two explanations apart, confirms the only one, or narrows what
//! has no name.
//!
//! A measurement decides between rivals where their predictions differ most for its noise
//! (T-optimality, Atkinson & Fedorov 1975, Biometrika 62:57): both are asked for the reading of a
//! probe at places below a hovering drone. Rivals that agree everywhere in the air differ in what a
//! drone or an instrument logs; what settles those is known beforehand.

use nalgebra::{UnitQuaternion, Vector3};

use crate::forward::anemometer::steady_reading_mps;
use crate::forward::flow::{Flow, Wakes};
use crate::forward::hypothesis::Sensor;
use crate::forward::observed::Observed;
use crate::forward::simulate::Sample;
use crate::infer::diagnose::mean;
use crate::infer::fit::Setting;
use crate::infer::outside::{RELEASE, Shape};
use crate::infer::select::{Selection, Tried};
use crate::record::recording::{Recording, Role, Vehicle};

/// Measurements that are named.
const MOST: usize = 3;
/// Readings that differ by less than this share of one reading's noise decide nothing in an hour.
/// Chosen here.
const LEAST_APART: f64 = 0.3;
/// Depths (motor distances), radii (half-widths) and bearings (rad, from east) at which a probe is
/// imagined.
const DEPTHS: [f64; 9] = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 12.0, 15.0];
const RADII: [f64; 7] = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0];
const BEARINGS: [(f64, &str); 4] = [(0.0, "east"), (0.5, "north"), (1.0, "west"), (1.5, "south")];

/// Covariates that a flight can be made to sweep: not what comes of others, nor time.
const SWEPT: [&str; 16] = [
    "s/l",
    "r/l",
    "xi",
    "height m",
    "emitter z m",
    "emitter speed m/s",
    "climb m/s",
    "height/half-width",
    "x m",
    "y m",
    // Of flights.
    "depth m",
    "beside m",
    "beside/half-width",
    "own climb m/s",
    "own speed m/s",
    "emitter climb m/s",
];

/// Measurements that would decide between what was chosen and what does as well, most telling
/// first; where nothing does as well, what would refute the choice; where something has no name,
/// what would narrow it. Empty where nothing is missing.
#[must_use]
pub fn advice(
    setting: &Setting,
    observed: &Observed,
    selection: &Selection,
    shape: Option<&Shape>,
) -> Vec<String> {
    if let Some(shape) = shape {
        return narrowing(shape);
    }
    let chosen = &selection.chosen;
    let mut kept: Vec<String> = Vec::new();
    for (place, rivals) in selection.rivals.iter().enumerate() {
        let Some((_, rival)) = rivals.first() else {
            continue;
        };
        let own = chosen.which.get(place);
        let other = rival.which.iter().find(|k| !chosen.which.contains(k));
        let both = own.into_iter().chain(own.and(other));
        let settled_by = both.map(|&k| setting.candidates[k].settled_by.to_owned());
        let lines = places(setting, observed, [chosen, rival]).into_iter();
        for line in lines.chain(settled_by.filter(|line| !line.is_empty())) {
            if !kept.contains(&line) {
                kept.push(line);
            }
        }
    }
    if kept.is_empty() && !chosen.which.is_empty() {
        kept = refuting(setting, observed, selection);
    }
    kept.truncate(MOST);
    kept
}

/// What would settle an answer without a rival: where the next best would read most differently,
/// what settles its terms, and the same flight once more.
fn refuting(setting: &Setting, observed: &Observed, selection: &Selection) -> Vec<String> {
    let chosen = &selection.chosen;
    let mut others = selection.singles.iter();
    let next = others.find(|one| !chosen.which.contains(&one.which[0]));
    let next = next.map(|next| places(setting, observed, [chosen, next]));
    let settled_by = chosen.which.iter();
    let settled_by = settled_by.map(|&k| setting.candidates[k].settled_by.to_owned());
    let settled_by = settled_by.filter(|line| !line.is_empty());
    let again = "the same flight on another day: what is named must come back within its intervals";
    let lines = next.into_iter().flatten().take(1).chain(settled_by);
    let mut once: Vec<String> = Vec::new();
    for line in lines.chain([again.to_owned()]) {
        if !once.contains(&line) {
            once.push(line);
        }
    }
    once
}

/// What would narrow something without a name.
pub(crate) fn narrowing(shape: &Shape) -> Vec<String> {
    let other_probe =
        "the same flight with another instrument: what comes back is not the instrument's";
    if !shape.spans_s.is_empty() {
        return vec![
            "what else happened at these times: doors, fans, other aircraft, contacts and cables of the instrument".into(),
            other_probe.into(),
        ];
    }
    if let Some(period_s) = shape.period_s {
        let is_of_rotors = shape.depends_on.iter().any(|(name, _)| name == RELEASE);
        let what = match is_of_rotors {
            true => format!(
                "the drone's attitude and motors at {:.0} Hz or more: does anything there repeat every {period_s:.2} s?",
                (10.0 / period_s).ceil()
            ),
            false => format!(
                "the room with no drone in the air: does anything there switch on and off every {period_s:.0} s?"
            ),
        };
        return vec![what, other_probe.into()];
    }
    let ends = shape.curve.first().zip(shape.curve.last());
    let first = shape.depends_on.first().map(|(name, _)| name.as_str());
    let sweep = first
        .zip(ends)
        .filter(|(name, _)| SWEPT.contains(name))
        .and_then(|(name, (first, last))| {
            let [from, to] = [first.0, last.0].map(|end| format!("{end:.2}"));
            // Of one place there is no sweep.
            (from != to).then(|| {
                format!("a slow sweep of {name} from {from} to {to} with everything else held")
            })
        });
    let turned = "the same flight turned by 90 degrees and moved by 2 m: what stays in its place stands in the room";
    let swapped = "the same flight with the probes in one another's places: what goes with one of them is its own";
    let swapped = shape.is_of_a_probe().then(|| swapped.to_owned());
    let swapped_or_swept = swapped.or(sweep);
    swapped_or_swept
        .into_iter()
        .chain([other_probe.to_owned(), turned.to_owned()])
        .collect()
}

/// A recording with each drone still and level where it was in the middle of its track.
fn held_still(recording: &Recording) -> Recording {
    let mut still = recording.clone();
    for vehicle in &mut still.vehicles {
        let track = &mut vehicle.track;
        let middle = track.t_s.get(track.t_s.len() / 2);
        let Some(middle) = middle.and_then(|t_s| track.moment(*t_s)) else {
            continue;
        };
        let there_m = track.position_at(middle);
        track.position_m.fill(there_m);
        track.velocity_mps.fill(Vector3::zeros());
        for attitude in &mut track.attitude {
            let (_, _, yaw) = attitude.euler_angles();
            *attitude = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        }
    }
    still
}

/// The two places at which a probe would tell one explanation from another best.
fn places(setting: &Setting, observed: &Observed, both: [&Tried; 2]) -> Vec<String> {
    let recording = &held_still(observed.recording);
    let wakes = Wakes::new(recording);
    let hovering = || {
        let instrument = &recording.probes.as_ref()?.instrument;
        let is_emitter = |vehicle: &Vehicle| vehicle.role != Role::Receiver;
        let index = recording.vehicles.iter().position(is_emitter)?;
        let track = &recording.vehicles[index].track;
        let t_s = *track.t_s.get(track.t_s.len() / 2)?;
        let drone_m = track.position_at(track.moment(t_s)?);
        let times_s = [t_s, t_s - track.t_s[0]];
        Some((instrument, wakes.of(0, index)?, times_s, drone_m))
    };
    let Some((instrument, wake, [t_s, since_s], drone_m)) = hovering() else {
        return Vec::new();
    };
    let floor_m = recording.environment.floor_z_m;
    let [one, other] = both.map(|tried| {
        let members = tried.members(setting.candidates).into_iter();
        let names: Vec<&str> = members.map(|member| member.name).collect();
        names.join(" with ")
    });
    let names = format!("{one} and {other}");
    let both = both.map(|tried| {
        let hypothesis = setting.explanation(tried);
        let flow = Flow::supposing(recording, &wakes, &hypothesis);
        (flow, hypothesis.sensor, mean(&tried.fit.tolerance))
    });
    type Explained<'a> = (Flow<'a>, Sensor, [f64; 2]);
    let reading = |(flow, sensor, tolerance): &Explained, point_m| {
        let steady_mps = steady_reading_mps(flow, instrument.measures, t_s, point_m)?;
        Some((1.0 + tolerance[0]) * sensor.reads(steady_mps, since_s) + tolerance[1])
    };
    let length_m = wake.motor_distance_m();
    let mut found: Vec<(f64, f64, f64, f64, &str, f64)> = Vec::new();
    for depth in DEPTHS {
        let depth_m = depth * length_m;
        if floor_m.is_some_and(|floor_m| drone_m.z - depth_m < floor_m + 0.05) {
            continue;
        }
        for radius in RADII {
            for (half_turns, bearing) in BEARINGS {
                let (sin, cos) = (half_turns * std::f64::consts::PI).sin_cos();
                let radius_m = radius * wake.half_width_m(depth_m);
                let point_m = drone_m + Vector3::new(radius_m * cos, radius_m * sin, -depth_m);
                let [Some(one), Some(other)] = both.each_ref().map(|of| reading(of, point_m))
                else {
                    continue;
                };
                let apart = (one - other).abs();
                let noise = noise_at(setting, observed, one);
                found.push((apart / noise, apart, depth, radius, bearing, depth_m));
                if radius == 0.0 {
                    break;
                }
            }
        }
    }
    found.retain(|(over_noise, ..)| *over_noise >= LEAST_APART);
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut taken: Vec<(f64, f64)> = Vec::new();
    let mut lines = Vec::new();
    for (over_noise, apart, depth, radius, bearing, depth_m) in found {
        let is_near = |&(d, r): &(f64, f64)| d == depth || r == radius;
        if lines.len() == 2 || taken.iter().any(is_near) {
            continue;
        }
        taken.push((depth, radius));
        let beside = match radius {
            0.0 => "on the axis".to_owned(),
            _ => format!("{radius} half-widths {bearing} of the axis"),
        };
        lines.push(format!(
            "a probe {depth_m:.1} m below a hovering drone ({depth} motor distances), {beside}: {names} differ by {apart:.2} m/s there, {over_noise:.1} times the noise of a reading"
        ));
    }
    lines
}

/// Noise of a reading: that of the sample that reads most alike.
fn noise_at(setting: &Setting, observed: &Observed, reading: f64) -> f64 {
    let samples = observed.samples.iter().zip(setting.noise.sd());
    let off = |sample: &Sample| (sample.simulated - reading).abs();
    let nearest = samples.min_by(|(a, _), (b, _)| off(a).total_cmp(&off(b)));
    nearest.map_or(1.0, |(_, sd)| *sd)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forward::hypothesis::Hypothesis;
    use crate::infer::diagnose::tests::sweeping;

    /// Whatever the drones of a recording flew, below one that hovers a late clock and slow air
    /// change no reading.
    #[test]
    fn clocks_and_delays_change_nothing_below_a_hovering_drone() {
        let late = Hypothesis {
            sensor: Sensor {
                clock_s: 0.6,
                ..Sensor::default()
            },
            ..Hypothesis::default()
        };
        // By how much it changes the reading 1 m below the drone, a quarter of a sweep later.
        let change_mps = |recording: &Recording| {
            let track = &recording.vehicles[0].track;
            let t_s = track.t_s[track.t_s.len() / 2] + 2.0;
            let there = track.moment(t_s).expect("it flies");
            let below_m = track.position_at(there) - Vector3::new(0.1, 0.0, 1.0);
            let wakes = Wakes::new(recording);
            let measures = recording
                .probes
                .as_ref()
                .expect("it has probes")
                .instrument
                .measures;
            let [now, then] = [Hypothesis::default(), late].map(|of| {
                let flow = Flow::supposing(recording, &wakes, &of);
                steady_reading_mps(&flow, measures, t_s, below_m).expect("it flies")
            });
            (then - now).abs()
        };
        let flown = sweeping();
        assert!(change_mps(&flown) > 0.1, "{}", change_mps(&flown));
        assert_eq!(change_mps(&held_still(&flown)), 0.0);
    }
}
