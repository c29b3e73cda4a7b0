//! Numbers that read as such and cannot be meant: units that slipped, columns that hold something
//! else, instruments that are dead. Each is a problem that says what it looks like; no physics is
//! made of it.
//!
//! The ranges are chosen here: wide enough for every multirotor that flies, narrower than the
//! slips, which are factors of 3.6 and more.

use airflow::Airframe;
use nalgebra::Vector3;

use super::found::Found;
use crate::record::problem::Problem;
use crate::record::recording::{Instrument, Track};
use crate::record::track::IDLE_RADPS;
use crate::statistics::quantile::{median, nearest_rank};

/// What a number has to lie in, and what it is mistaken for.
pub(super) struct Range {
    /// In words: "the pressure of air that drones fly in".
    what: &'static str,
    unit: &'static str,
    least: f64,
    most: f64,
    /// Other units: a value times the factor, plus the second number, is ours.
    slips: &'static [(&'static str, f64, f64)],
}

const LENGTHS: &[(&str, f64, f64)] = &[
    ("mm", 1e-3, 0.0),
    ("cm", 1e-2, 0.0),
    ("inches", 0.0254, 0.0),
];

/// From the top of Everest (33.7 kPa) to the highest ever read at sea level (108.5 kPa).
pub(super) const PRESSURE: Range = Range {
    what: "the pressure of air that drones fly in",
    unit: "Pa",
    least: 30_000.0,
    most: 110_000.0,
    slips: &[("hPa", 100.0, 0.0), ("kPa", 1000.0, 0.0), ("bar", 1e5, 0.0)],
};
/// -90 to 60 °C: the coldest and the hottest ever read.
pub(super) const TEMPERATURE_K: Range = Range {
    what: "the temperature of air that drones fly in",
    unit: "K",
    least: 183.0,
    most: 333.0,
    slips: &[("degrees Celsius", 1.0, 273.15)],
};
/// The same in degrees Celsius.
pub(super) const TEMPERATURE_C: Range = Range {
    what: "the temperature of air that drones fly in",
    unit: "degrees Celsius",
    least: -90.0,
    most: 60.0,
    slips: &[("K", 1.0, -273.15)],
};
/// The Earth has 9.76 to 9.84; some logs round to 10.
pub(super) const GRAVITY: Range = Range {
    what: "gravity on the Earth",
    unit: "m/s2",
    least: 9.7,
    most: 10.0,
    slips: &[("g", 9.81, 0.0), ("cm/s2", 1e-2, 0.0), ("mm/s2", 1e-3, 0.0)],
};
const MASS: Range = Range {
    what: "the mass of a multirotor",
    unit: "kg",
    least: 0.005,
    most: 1000.0,
    slips: &[("g", 1e-3, 0.0)],
};
const DIAMETER: Range = Range {
    what: "the diameter of a propeller",
    unit: "m",
    least: 0.01,
    most: 3.0,
    slips: LENGTHS,
};
const DISTANCE: Range = Range {
    what: "the distance of opposite motors",
    unit: "m",
    least: 0.02,
    most: 10.0,
    slips: LENGTHS,
};
/// A Crazyflie's is 50 N/m², a racer's 200.
const DISC_LOADING: Range = Range {
    what: "the disc loading of a multirotor",
    unit: "N/m2",
    least: 3.0,
    most: 2000.0,
    slips: &[("that of a mass in grams", 1e-3, 0.0)],
};
/// Propellers side by side have 0.71 of the motor distance at most with four motors, 0.5 with six.
const DIAMETER_RATIO: Range = Range {
    what: "a propeller's diameter over the distance of opposite motors",
    unit: "",
    least: 0.08,
    most: 1.5,
    slips: &[
        ("the ratio of mm to m", 1e-3, 0.0),
        ("the ratio of cm to m", 1e-2, 0.0),
        ("the ratio of inches to m", 0.0254, 0.0),
        ("the ratio of m to mm", 1e3, 0.0),
        ("the ratio of m to cm", 1e2, 0.0),
        ("the ratio of m to inches", 1.0 / 0.0254, 0.0),
    ],
};
const ACCURACY_ABS: Range = Range {
    what: "the accuracy of an anemometer",
    unit: "m/s",
    least: 0.0,
    most: 1.0,
    slips: &[("mm/s", 1e-3, 0.0), ("cm/s", 1e-2, 0.0)],
};
const ACCURACY_REL: Range = Range {
    what: "the accuracy of an anemometer as a part of its reading",
    unit: "",
    least: 0.0,
    most: 0.5,
    slips: &[("percent", 1e-2, 0.0)],
};
const RESOLUTION: Range = Range {
    what: "the resolution of an anemometer",
    unit: "m/s",
    least: 0.0,
    most: 0.5,
    slips: &[("mm/s", 1e-3, 0.0), ("cm/s", 1e-2, 0.0)],
};
const TIME_CONSTANT: Range = Range {
    what: "the time constant of an anemometer",
    unit: "s",
    least: 0.0,
    most: 30.0,
    slips: &[("ms", 1e-3, 0.0)],
};
const AMBIENT: Range = Range {
    what: "the speed of air that probes read before take-off",
    unit: "m/s",
    least: 0.0,
    most: 15.0,
    slips: &[("mm/s", 1e-3, 0.0), ("cm/s", 1e-2, 0.0)],
};

impl Range {
    /// A problem at `place` where the value cannot be meant.
    pub(super) fn holds(&self, value: f64, place: Problem, found: &mut Found) -> bool {
        if (self.least..=self.most).contains(&value) {
            return true;
        }
        let Range {
            what,
            unit,
            least,
            most,
            slips,
        } = self;
        let ours = |(word, factor, more): &(&str, f64, f64)| {
            let ours = value * factor + more;
            (*least..=*most)
                .contains(&ours)
                .then(|| format!("in {word}? {value} would be {}", spelled(ours, unit)))
        };
        let message = format!(
            "is {}; {what} is {least} to {}",
            spelled(value, unit),
            spelled(*most, unit)
        );
        found.helped(place, message, slips.iter().find_map(ours));
        false
    }
}

fn spelled(value: f64, unit: &str) -> String {
    let rounded = format!("{value:.6}");
    let short = match rounded.contains('.') {
        true => rounded.trim_end_matches('0').trim_end_matches('.'),
        false => &rounded,
    };
    match unit {
        "" => short.to_owned(),
        unit => format!("{short} {unit}"),
    }
}

/// What is stated of an airframe; `place` is where each of its fields stands.
pub(super) fn airframe(
    airframe: &Airframe,
    gravity_mps2: f64,
    place: impl Fn(&str) -> Problem,
    found: &mut Found,
) {
    let (diameter_m, distance_m) = (airframe.propeller_diameter_m(), airframe.motor_distance_m());
    let mut holds = MASS.holds(airframe.mass_kg(), place("mass_kg"), found);
    holds &= DIAMETER.holds(diameter_m, place("propeller_diameter_m"), found);
    holds &= DISTANCE.holds(distance_m, place("motor_distance_m"), found);
    if !holds {
        return;
    }
    let place_of_diameter = place("propeller_diameter_m");
    let ratio = diameter_m / distance_m;
    if !DIAMETER_RATIO.holds(ratio, place_of_diameter, found) {
        return;
    }
    let disc_m2 = std::f64::consts::PI * 0.25 * diameter_m * diameter_m;
    let discs_m2 = disc_m2 * f64::from(airframe.propellers());
    let loading = airframe.mass_kg() * gravity_mps2 / discs_m2;
    DISC_LOADING.holds(loading, place("mass_kg"), found);
}

/// What is stated of a probe.
pub(super) fn instrument(of: &Instrument, place: impl Fn(&str) -> Problem, found: &mut Found) {
    for (range, field, value) in [
        (&ACCURACY_ABS, "accuracy_abs_mps", of.accuracy_abs_mps),
        (&ACCURACY_REL, "accuracy_rel", of.accuracy_rel),
        (&RESOLUTION, "resolution_mps", of.resolution_mps),
        (&TIME_CONSTANT, "lowpass_tau_s", of.lowpass_tau_s),
    ] {
        range.holds(value, place(field), found);
    }
}

/// Speed of the air before take-off.
pub(super) fn ambient(ambient_mps: f64, place: Problem, found: &mut Found) {
    AMBIENT.holds(ambient_mps, place, found);
}

/// Least steps and time (s) of a stretch over which position and velocity are compared, and
/// velocity and acceleration. Chosen here: noise of both averages out, and turns are still
/// followed.
const STRETCH_STEPS: usize = 8;
const STRETCH_S: f64 = 0.4;
/// Fewest stretches that are judged. Chosen here: an accidental correlation of 0.8 among eight
/// pairs has a probability of a hundredth.
const STRETCHES: usize = 8;
/// Root mean square of the path (m) over a stretch that is no noise of a position ...
const MOVED_M: f64 = 0.1;
/// ... and of the speed (m/s) that is no bias of an estimator. Chosen here.
const MOVING_MPS: f64 = 0.3;
/// The same along one axis, where the correlation tells more (m).
const AXIS_M: f64 = 0.02;
/// Root mean square of a change of velocity, over the time it took (m/s²), that is no noise. Chosen
/// here: what a tilt of two degrees brings about.
const ACCELERATING_MPS2: f64 = 0.3;
/// Correlation that is one, and one that is none. Chosen here.
const ALIKE: f64 = 0.8;
const UNLIKE: f64 = 0.3;
/// Position over integrated velocity that a unit makes: mm, cm, and km/h; or a time in ms.
const SLIPS: [(f64, &str); 8] = [
    (1e3, "positions in mm, or velocities in km/s"),
    (1e2, "positions in cm"),
    (1e-3, "velocities in mm/s, or times in ms"),
    (1e-2, "velocities in cm/s"),
    (1.0 / 3.6, "velocities in km/h"),
    (3.6, "velocities in m/s written as km/h"),
    (1e-6, "times in us"),
    (1e6, "times in s written as us"),
];

/// What a track says of itself: position against velocity, weight against acceleration.
pub(super) fn track(
    vehicle: &str,
    file: &str,
    track: &Track,
    gravity_mps2: f64,
    found: &mut Found,
) {
    let place = || Problem::field(file, vehicle);
    let stretches = stretches(track);
    if let Some((message, help)) = motion(&stretches) {
        found.helped(place(), message, Some(help));
    }
    if let Some((message, help)) = felt(track, gravity_mps2) {
        found.helped(place(), message, Some(help));
    }
    if let Some(force_mps2) = &track.specific_force_mps2 {
        let mut up: Vec<f64> = force_mps2.iter().map(|force| force.z).collect();
        // Over a flight the mean force carries the weight.
        let up = median(&mut up).unwrap_or(gravity_mps2) / gravity_mps2;
        if !(0.7..=1.3).contains(&up) {
            let message = format!(
                "its specific force upwards is {up:.2} gravities in the middle, and a drone that flies feels one"
            );
            let help = match up {
                up if (-0.3..=0.3).contains(&up) => {
                    "gravity is off already (`acceleration: GravityRemovedInWorld` or `...InBody`), the axes are swapped, or the unit is g (`az_g`)"
                }
                up if (1.7..=2.3).contains(&up) => {
                    "gravity is in already: `acceleration: SpecificForceInWorld` or `...InBody`"
                }
                up if (-1.3..=-0.7).contains(&up) => {
                    "z points down: `frame: NorthEastDown`, or the other kind of acceleration"
                }
                _ => "which unit and which kind is it? `ax_g`, `ax_mps2`; `acceleration`",
            };
            found.helped(place(), message, Some(help.to_owned()));
        }
    }
    if let Some(throttle) = &track.throttle_ratio {
        let mut sorted = throttle.clone();
        sorted.sort_by(f64::total_cmp);
        let (top, middle) = (nearest_rank(&sorted, 0.9), nearest_rank(&sorted, 0.5));
        if top.is_some_and(|top| top < 0.3) {
            let message = format!(
                "its throttle is at most {:.3} of hover: it never flies",
                sorted.last().copied().unwrap_or(0.0)
            );
            let help = "a dead column, or no ratio to hover: `throttle_ratio` is 1 in hover";
            found.helped(place(), message, Some(help.to_owned()));
        } else if let (Some(middle), Some(top)) = (middle, top)
            && (top < 0.6 || middle > 1.7)
        {
            let message =
                format!("its throttle is {middle:.3} of hover in the middle of the flight");
            let help = "`throttle_ratio` is 1 in hover at the stated mass; is this a duty cycle, or the mass another?";
            found.helped(place(), message, Some(help.to_owned()));
        }
    }
    if let Some(rotors) = &track.rotor_speed_radps {
        let mut means: Vec<f64> = rotors
            .iter()
            .map(|of| of.iter().sum::<f64>() / 4.0)
            .collect();
        means.sort_by(f64::total_cmp);
        if let Some(top) = nearest_rank(&means, 0.9).filter(|top| *top < IDLE_RADPS) {
            let message = format!("its rotors turn at {top:.2} rad/s at most: it never flies");
            let help =
                "dead columns, or another unit: `rpm1` is in turns a minute, `rpm1_radps` in rad/s";
            found.helped(place(), message, Some(help.to_owned()));
        }
    }
    if let Some(duty) = &track.duty {
        let mut means: Vec<f64> = duty.iter().map(|of| of.iter().sum::<f64>() / 4.0).collect();
        means.retain(|mean| mean.is_finite());
        means.sort_by(f64::total_cmp);
        if let Some(top) = nearest_rank(&means, 0.9).filter(|top| *top < 0.05) {
            let message = format!("its motors are given {top:.4} of full at most: it never flies");
            let help = "dead columns, or another unit: `pwm1` is 0 to 1, `pwm1_u16` 0 to 65535";
            found.helped(place(), message, Some(help.to_owned()));
        }
    }
}

/// Electrical power against what momentum theory asks of an ideal rotor in hover.
pub(super) fn power((vehicle, file): (&str, &str), track: &Track, ideal_w: f64, found: &mut Found) {
    let Some(power_w) = &track.power_w else {
        return;
    };
    let mut known: Vec<f64> = power_w.iter().copied().filter(|w| w.is_finite()).collect();
    let Some(middle_w) = median(&mut known).filter(|_| ideal_w > 0.0) else {
        return;
    };
    // Figures of merit of small rotors with their motors are 0.15 to 0.8.
    if !(0.7..=20.0).contains(&(middle_w / ideal_w)) {
        let message = format!(
            "its power is {middle_w:.4} W in the middle of the flight; an ideal rotor of its mass hovers on {ideal_w:.4} W"
        );
        let slips = [("mW", 1e-3), ("kW", 1e3), ("a share of hover", ideal_w)];
        let slip = slips
            .iter()
            .find(|(_, factor)| (0.7..=20.0).contains(&(middle_w * factor / ideal_w)));
        let help = slip.map(|(word, _)| format!("in {word}?"));
        found.helped(Problem::field(file, vehicle), message, help);
    }
}

/// What position and integrated velocity say of each other, where they cannot both be right.
fn motion(stretches: &[Stretch]) -> Option<(String, String)> {
    if stretches.len() < STRETCHES {
        return None;
    }
    let sum = |of: &dyn Fn(&Stretch) -> f64| stretches.iter().map(of).sum::<f64>();
    let count = stretches.len() as f64;
    let (pp, vv) = (
        sum(&|s| s.moved_m.norm_squared()),
        sum(&|s| s.integrated_m.norm_squared()),
    );
    let pv = sum(&|s| s.moved_m.dot(&s.integrated_m));
    let (moved_m, integrated_m) = ((pp / count).sqrt(), (vv / count).sqrt());
    let speed_mps = integrated_m / (sum(&|s| s.lasted_s) / count);
    for (i, name) in AXES.into_iter().enumerate() {
        let square_m2 = sum(&|s| s.integrated_m[i] * s.integrated_m[i]);
        let is_dead = stretches.iter().all(|s| s.moved_m[i] == 0.0);
        if is_dead && (square_m2 / count).sqrt() > AXIS_M {
            let said = format!("its {name} stands still while its v{name} says that it moves");
            return Some((said, format!("{name} is a dead column")));
        }
    }
    if moved_m.max(integrated_m) < MOVED_M {
        return None;
    }
    let said = format!(
        "in {:.2} s it moves {} by its positions and {} by its velocities",
        sum(&|s| s.lasted_s) / count,
        spelled(moved_m, "m"),
        spelled(integrated_m, "m")
    );
    let correlation = pv / (pp * vv).sqrt().max(f64::MIN_POSITIVE);
    let ratio = match correlation > ALIKE {
        true => pv / vv,
        false => moved_m / integrated_m.max(1e-12),
    };
    let looks = || {
        let near = |(factor, _): &&(f64, &str)| (ratio / factor).ln().abs() < 0.4;
        let slip = SLIPS.iter().find(near);
        let dead = "velocities or positions of a dead column, or in another unit";
        slip.map_or(dead, |(_, word)| word)
    };
    let by_far = match ratio > 1.0 {
        true => ratio > 5.0 && (moved_m > 3.0 * MOVED_M || integrated_m == 0.0),
        false => speed_mps > MOVING_MPS && ratio < 0.2,
    };
    if by_far || correlation > ALIKE && !(0.5..=2.0).contains(&ratio) {
        return Some((said, looks().to_owned()));
    }
    let axis = |of: &dyn Fn(&Stretch) -> (f64, f64)| {
        let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
        for (a, b) in stretches.iter().map(of) {
            (aa, bb, ab) = (aa + a * a, bb + b * b, ab + a * b);
        }
        let rms_m = (aa.min(bb) / count).sqrt();
        (rms_m > AXIS_M).then(|| ab / (aa * bb).sqrt())
    };
    let pair = |i: usize, j: usize| axis(&|s: &Stretch| (s.moved_m[i], s.integrated_m[j]));
    for (i, name) in AXES.into_iter().enumerate() {
        if pair(i, i).is_some_and(|r| r < -ALIKE) {
            let said = format!("its {name} falls while its v{name} says that it rises");
            return Some((said, format!("the sign of {name} or of v{name} is turned")));
        }
        let other = (0..3).find(|&j| j != i && pair(i, j).is_some_and(|r| r.abs() > ALIKE));
        if let Some(j) = other
            && pair(i, i).is_none_or(|r| r.abs() < UNLIKE)
        {
            let other = AXES[j];
            let said = format!("its {name} moves as its v{other} says, not as its v{name}");
            return Some((said, "axes are swapped, or columns shifted".to_owned()));
        }
    }
    let both_move = moved_m > 3.0 * MOVED_M && speed_mps > MOVING_MPS;
    (both_move && correlation.abs() < UNLIKE).then(|| {
        let said = format!(
            "its positions and its velocities have nothing in common (correlation {correlation:.2}): {said}"
        );
        (said, "columns or rows are shifted, or not of one vehicle".to_owned())
    })
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// What velocities and accelerations say of each other, sideways, where they cannot be of one
/// flight; and accelerations that no instrument reads.
fn felt(track: &Track, gravity_mps2: f64) -> Option<(String, String)> {
    let force_mps2 = track.specific_force_mps2.as_ref()?;
    let runs: Vec<GaplessRows> = runs(track).collect();
    if runs.len() < STRETCHES {
        return None;
    }
    let (first, z) = (force_mps2.first()?, Vector3::z());
    if force_mps2.iter().all(|force| force.z == first.z) {
        let said = format!(
            "its specific force upwards is {} throughout",
            spelled(first.z, "m/s2")
        );
        return Some((said, "a dead column".to_owned()));
    }
    // Without an attitude a body's acceleration says nothing of the world's.
    if !track.attitude_is_logged {
        return None;
    }
    let (mut aa, mut bb, mut ab, mut lasted_s) = (0.0, 0.0, 0.0, 0.0);
    for run in &runs {
        let changed = (track.velocity_mps[run.to] - track.velocity_mps[run.from]).xy();
        let rows = run.from..run.to;
        let pushed = rows.map(|row| {
            let step_s = track.t_s[row + 1] - track.t_s[row];
            (0.5 * (force_mps2[row] + force_mps2[row + 1]) - z * gravity_mps2) * step_s
        });
        let pushed = pushed.sum::<Vector3<f64>>().xy();
        aa += changed.norm_squared();
        bb += pushed.norm_squared();
        ab += changed.dot(&pushed);
        lasted_s += track.t_s[run.to] - track.t_s[run.from];
    }
    let count = runs.len() as f64;
    let [changed, pushed] = [aa, bb].map(|sum| (sum / count).sqrt() / (lasted_s / count));
    let correlation = ab / (aa * bb).sqrt().max(f64::MIN_POSITIVE);
    (changed.min(pushed) > ACCELERATING_MPS2 && correlation < UNLIKE).then(|| {
        let said = format!(
            "its velocities change by {} sideways and its accelerations say {}, with nothing in common (correlation {correlation:.2})",
            spelled(changed, "m/s2"),
            spelled(pushed, "m/s2")
        );
        let help = "rows or columns are shifted, not of one vehicle, or of another frame (`acceleration`, `quaternion`)";
        (said, help.to_owned())
    })
}

/// A ready force against the weight (N), which holds the drone up beside it.
pub(super) fn force(
    (vehicle, file): (&str, &str),
    track: &Track,
    weight_n: f64,
    found: &mut Found,
) {
    let Some(force_n) = &track.force_n else {
        return;
    };
    let mut up: Vec<f64> = force_n.iter().map(|force| force.z / weight_n).collect();
    up.sort_by(f64::total_cmp);
    let [low, middle, high] = [0.1, 0.5, 0.9].map(|share| nearest_rank(&up, share).unwrap_or(0.0));
    let help = match (low, middle, high) {
        (0.0, _, 0.0) => "a dead column",
        // A wake takes all of the thrust at most, and no air holds a drone up that has none.
        (low, _, high) if low < -1.5 || high > 1.5 => "in another unit? `fz_mn`, `fz_gf`",
        (_, middle, _) if middle < -0.5 => "is the weight in it? it is beyond thrust and weight",
        (_, middle, _) if middle > 0.5 => "is the thrust in it? it is beyond thrust and weight",
        _ => return,
    };
    let message = format!(
        "its force upwards is {low:.2} to {high:.2} weights, {middle:.2} in the middle of the flight"
    );
    found.helped(
        Problem::field(file, vehicle),
        message,
        Some(help.to_owned()),
    );
}

/// Some steps of a track.
struct Stretch {
    moved_m: Vector3<f64>,
    /// Velocity summed over time, by the trapezoidal rule.
    integrated_m: Vector3<f64>,
    lasted_s: f64,
}

/// Rows without a gap, from and to.
struct GaplessRows {
    from: usize,
    to: usize,
}

fn runs(track: &Track) -> impl Iterator<Item = GaplessRows> + '_ {
    let mut next = 0;
    std::iter::from_fn(move || {
        'starts: while next + STRETCH_STEPS < track.t_s.len() {
            let from = next;
            for to in from + 1..track.t_s.len() {
                if track.t_s[to] - track.t_s[to - 1] > track.longest_step_s {
                    next = to;
                    continue 'starts;
                }
                if to - from >= STRETCH_STEPS && track.t_s[to] - track.t_s[from] >= STRETCH_S {
                    next = to;
                    return Some(GaplessRows { from, to });
                }
            }
            break;
        }
        None
    })
}

fn stretches(track: &Track) -> Vec<Stretch> {
    let stretch = |GaplessRows { from, to }: GaplessRows| {
        let mut integrated_m = Vector3::zeros();
        for row in from..to {
            let step_s = track.t_s[row + 1] - track.t_s[row];
            let mean_mps = 0.5 * (track.velocity_mps[row] + track.velocity_mps[row + 1]);
            integrated_m += mean_mps * step_s;
        }
        Stretch {
            moved_m: track.position_m[to] - track.position_m[from],
            integrated_m,
            lasted_s: track.t_s[to] - track.t_s[from],
        }
    };
    runs(track).map(stretch).collect()
}
