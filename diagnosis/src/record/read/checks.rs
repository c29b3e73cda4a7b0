//! What cannot be in a vehicle's rows: times out of order, values that no drone has, holes, a
//! frozen position, the floor, a crash.
//!
//! A row with a value that cannot be is left out as a whole and counted, except for values that its
//! thrust does not need ([`spare`]); nothing is mended.

use std::ops::RangeInclusive;

use super::columns::{Role, RoleOf};
use super::conventions::Conventions;
use super::found::{Found, RowRemarks};
use super::samples::Samples;
use crate::record::problem::Problem;
use crate::record::remark::RemarkKind;
use crate::statistics::quantile::median;

/// Farthest coordinate (m). Chosen here: a site in its own frame, not a map in UTM metres.
const FARTHEST_M: f64 = 10_000.0;
/// Fastest (m/s). Chosen here: twice a racing drone.
const FASTEST_MPS: f64 = 100.0;
/// Hardest acceleration (m/s²). Chosen here: 50 g, beyond the ±16 g of the IMUs that are flown.
const HARDEST_MPS2: f64 = 500.0;
/// Fastest rotor (rad/s). Chosen here: twice what the smallest racing drones turn.
const FASTEST_ROTOR_RADPS: f64 = 100_000.0 * std::f64::consts::TAU / 60.0;
/// Largest force (N). Chosen here: the weight of a tonne.
const MOST_FORCE_N: f64 = 1e4;
/// How far a quaternion's norm may be from 1. Chosen here: compressed quaternions are within 0.2 %.
const NORM_TOLERANCE: f64 = 0.02;
/// Largest throttle over hover. Chosen here: no multirotor hovers on a fifth of its throttle range.
const MOST_THROTTLE_RATIO: f64 = 5.0;
/// Half a turn and its rounding in a log of two decimals (rad).
const HALF_TURN_RAD: f64 = 3.15;
/// Highest battery (V). Chosen here: 24 cells are beyond any multirotor that is flown by hand.
const MOST_BATTERY_V: f64 = 100.0;
/// Steps back in time, as a share of all, from which rows are not in order. Chosen here: a log
/// that lost its order has half.
const BACKWARD: f64 = 0.05;
/// How far below the floor a position may be read (m). Chosen here: a bad marker model, not a
/// cellar.
pub(super) const BELOW_FLOOR_M: f64 = 0.2;
/// A gap is longer than this many median steps ...
const GAP_OVER_MEDIAN: f64 = 3.0;
/// ... and longer than this (s): chosen here, the time in which a Crazyflie's attitude can turn by
/// 45°.
const GAP_S: f64 = 0.05;
/// Steps off the median by more than this part of it count as uneven; reported when one in a
/// hundred is. Chosen here.
const UNEVEN: f64 = 0.25;
/// Identical positions in a row that make a frozen position, provided the velocity says it moved by
/// [`FROZEN_M`].
const FROZEN_ROWS: usize = 8;
/// Chosen here: twenty times the millimetre to which positions are logged.
const FROZEN_M: f64 = 0.02;
/// What is cut before the tilt limit is passed (s): as the Neural-Swarm2 flights were cut.
const CUT_BEFORE_CRASH_S: f64 = 0.5;
/// Most spans spelled out in one remark.
const MOST_SPANS: usize = 5;

/// Which rows are left, and the longest step that is no gap.
#[derive(Debug)]
pub(super) struct Checked {
    pub(super) keep: Vec<usize>,
    pub(super) longest_step_s: f64,
    /// Whether all that is missing was spent on the floor.
    pub(super) only_stood: bool,
}

/// Judges the rows of one vehicle and remarks on what is wrong with them.
pub(super) fn check(
    (vehicle, file): (&str, &str),
    samples: &Samples,
    limits: &Conventions,
    found: &mut Found,
) -> Checked {
    let t_s = samples.column(Role::Time);
    let place = || Problem::field(file, vehicle);
    if is_shuffled(t_s) {
        let help = "sort the rows by time, or name the column that holds it";
        let message = "its rows are not in the order of time";
        found.helped(place(), message, Some(help.to_owned()));
    }
    let mut yaws = samples.column(Role::Angle(2)).iter();
    let first_yaw = yaws.find(|yaw| yaw.is_finite());
    let turns = std::f64::consts::TAU;
    if let Some(yaw) = first_yaw.filter(|yaw| yaw.abs() > turns) {
        let message = format!("its yaw begins at {yaw:.2} rad, more than a turn");
        let help = "in degrees? `yaw_deg`, `roll_deg`, `pitch_deg`";
        found.helped(place(), message, Some(help.to_owned()));
    }
    let mut log = RowRemarks {
        found,
        subject: Some(vehicle),
        noun: "row",
        t_s,
    };
    let (mut keep, backward) = in_order(t_s);
    let what = format!("left out: {OUT_OF_ORDER}");
    log.tell(RemarkKind::Impossible, &backward, &what);
    let longest_step_s = steps(&keep, &mut log);
    let mut faulty: Vec<(&str, f64, Vec<usize>)> = Vec::new();
    let is_spared = is_told_by_rotors(samples, limits);
    keep.retain(|&row| {
        let Some((words, value)) = fault(samples, (limits, is_spared), row) else {
            return true;
        };
        match faulty.iter_mut().find(|(known, ..)| *known == words) {
            Some((.., rows)) => rows.push(row),
            None => faulty.push((words, value, vec![row])),
        }
        false
    });
    for (words, first, rows) in faulty {
        let what = format!("left out: {words} (first {first:.4})");
        log.tell(RemarkKind::Impossible, &rows, &what);
    }
    frozen(samples, &keep, &mut log);
    at_full(samples, &keep, &mut log);
    crash(
        samples,
        (limits.crash_tilt_rad, place()),
        &mut keep,
        &mut log,
    );
    let before_floor = keep.len();
    if let Some(touch_z_m) = limits.touch_z_m {
        let z_m = samples.column(Role::Position(2));
        floor(z_m, touch_z_m, &mut keep, &mut log);
    }
    Checked {
        only_stood: keep.is_empty() && before_floor > 0,
        keep,
        longest_step_s,
    }
}

/// Whether speeds of rotors give the thrust: duty cycles and battery are not needed for it.
fn is_told_by_rotors(samples: &Samples, limits: &Conventions) -> bool {
    let has = |role| samples.columns.contains_key(&role);
    let is_felt = limits.acceleration.is_some() && has(Role::Acceleration(0));
    has(Role::RotorSpeed(0)) && (is_felt || !has(Role::Force(0)))
}

/// Where speeds of rotors give the thrust, a duty cycle or battery voltage that cannot be is left
/// out alone, as not a number, not its row.
pub(super) fn spare(vehicle: &str, samples: &mut Samples, limits: &Conventions, found: &mut Found) {
    if !is_told_by_rotors(samples, limits) {
        return;
    }
    let t_s = samples.column(Role::Time).to_vec();
    let spares: [(&str, RoleOf, usize); 2] = [
        ("duty cycles", Role::Duty, 4),
        ("a battery voltage", |_| Role::Battery, 1),
    ];
    for (name, role, count) in spares {
        let mut faulty: Vec<usize> = Vec::new();
        for role in (0..count).map(role) {
            let column = samples.columns.get_mut(&role).into_iter().flatten();
            for (row, value) in column.enumerate() {
                if !value.is_finite() || of_value(role, *value).is_some() {
                    *value = f64::NAN;
                    faulty.push(row);
                }
            }
        }
        faulty.sort_unstable();
        faulty.dedup();
        let what = format!(
            "without {name} that can be: left out alone, for speeds of rotors tell the thrust"
        );
        let mut log = RowRemarks {
            found,
            subject: Some(vehicle),
            noun: "row",
            t_s: &t_s,
        };
        log.tell(RemarkKind::Unused, &faulty, &what);
    }
}

/// The first thing that is wrong with a row, in words, and the value at fault.
fn fault(
    samples: &Samples,
    (limits, is_spared): (&Conventions, bool),
    row: usize,
) -> Option<(&'static str, f64)> {
    let columns = samples
        .columns
        .iter()
        .map(|(&role, column)| (role, column[row]));
    let values = columns.filter(|(role, _)| match role {
        Role::Time => false,
        Role::Duty(_) | Role::Battery => !is_spared,
        _ => true,
    });
    if let Some((_, value)) = values.clone().find(|(_, value)| !value.is_finite()) {
        return Some(("a value is missing or not finite", value));
    }
    let of_norm = || {
        let norm = norm(samples.group::<4>(Role::Quaternion)?, row);
        let words = "the quaternion's norm is not 1 within 2 %";
        ((norm - 1.0).abs() > NORM_TOLERANCE).then_some((words, norm))
    };
    let of_floor = || {
        let z_m = samples.column(Role::Position(2))[row];
        let words = "more than 0.2 m below the floor";
        (z_m < limits.floor_z_m? - BELOW_FLOOR_M).then_some((words, z_m))
    };
    let found = values
        .clone()
        .find_map(|(role, value)| of_value(role, value));
    found.or_else(of_norm).or_else(of_floor)
}

/// What is wrong with a value, in words, and the value.
fn of_value(role: Role, value: f64) -> Option<(&'static str, f64)> {
    let (possible, words) = possible(role)?;
    (!possible.contains(&value)).then_some((words, value))
}

/// What a drone's values lie within, and in words what others are; `None`: they may be anything.
fn possible(role: Role) -> Option<(RangeInclusive<f64>, &'static str)> {
    let within = |most: f64| -most..=most;
    Some(match role {
        Role::Position(_) => (within(FARTHEST_M), "a coordinate beyond 10 km"),
        Role::Velocity(_) => (within(FASTEST_MPS), "a velocity beyond 100 m/s"),
        Role::Acceleration(_) => (within(HARDEST_MPS2), "an acceleration beyond 500 m/s2"),
        Role::Duty(_) => (0.0..=1.0, "a duty cycle outside 0 to 1"),
        Role::Battery => (
            f64::MIN_POSITIVE..=MOST_BATTERY_V,
            "a battery voltage outside 0 to 100 V",
        ),
        Role::Throttle => (
            0.0..=MOST_THROTTLE_RATIO,
            "a throttle outside 0 to 5 times hover",
        ),
        Role::Power => (0.0..=f64::MAX, "a negative power"),
        // Some motors report the other direction of rotation by a sign; it is taken off.
        Role::RotorSpeed(_) => (
            within(FASTEST_ROTOR_RADPS),
            "a rotor faster than 100 000 rpm",
        ),
        Role::Thrust => (0.0..=MOST_FORCE_N, "a thrust outside 0 to 10 kN"),
        Role::Force(_) => (within(MOST_FORCE_N), "a force beyond 10 kN"),
        // Roll and pitch; a yaw may count turns.
        Role::Angle(0 | 1) => (within(HALF_TURN_RAD), "a roll or pitch beyond half a turn"),
        Role::Time | Role::Quaternion(_) | Role::Angle(_) => return None,
    })
}

fn norm<const N: usize>(columns: [&[f64]; N], row: usize) -> f64 {
    let squares = columns.map(|column| column[row] * column[row]);
    squares.iter().sum::<f64>().sqrt()
}

/// Whether the rows are in no order of time: a clock that was set back once is no shuffle.
pub(super) fn is_shuffled(t_s: &[f64]) -> bool {
    let back = t_s.windows(2).filter(|pair| pair[1] < pair[0]).count();
    back > 4 && back as f64 > BACKWARD * t_s.len() as f64
}

/// Why rows are left out whose times do not rise.
pub(super) const OUT_OF_ORDER: &str = "their time is missing, repeats or goes back";

/// As many rows as can be whose times rise strictly, and the others: times that are far ahead of
/// their neighbours are the culprits, not all that follow them.
///
/// The longest increasing subsequence (Schensted 1961, Can. J. Math. 13:179); of several, that
/// which ends earliest.
pub(super) fn in_order(t_s: &[f64]) -> (Vec<usize>, Vec<usize>) {
    // By length, the last row of the sequence that ends earliest.
    let mut lasts: Vec<usize> = Vec::new();
    let mut before = vec![None; t_s.len()];
    for row in (0..t_s.len()).filter(|row| t_s[*row].is_finite()) {
        let longest = lasts.partition_point(|last| t_s[*last] < t_s[row]);
        before[row] = longest.checked_sub(1).map(|shorter| lasts[shorter]);
        match lasts.get_mut(longest) {
            // Of rows of one time the first stays.
            Some(last) if t_s[*last] > t_s[row] => *last = row,
            Some(_) => {}
            None => lasts.push(row),
        }
    }
    let mut is_kept = vec![false; t_s.len()];
    let kept = std::iter::successors(lasts.last().copied(), |row| before[*row]);
    kept.for_each(|row| is_kept[row] = true);
    (0..t_s.len()).partition(|row| is_kept[*row])
}

fn longest_of_median_s(median_s: f64) -> f64 {
    (GAP_OVER_MEDIAN * median_s).max(GAP_S)
}

/// The longest step of some times that is no gap (s).
pub(super) fn longest_step_s(t_s: &[f64]) -> f64 {
    let steps_s = t_s.windows(2).map(|pair| pair[1] - pair[0]);
    let median_s = median(&mut steps_s.collect::<Vec<_>>());
    median_s.map_or(GAP_S, longest_of_median_s)
}

/// Gaps and uneven steps; returns the longest step that is no gap.
fn steps(keep: &[usize], log: &mut RowRemarks<'_>) -> f64 {
    let t_s = log.t_s;
    let step = |pair: &[usize]| (pair[0], t_s[pair[1]] - t_s[pair[0]]);
    let steps: Vec<(usize, f64)> = keep.windows(2).map(step).collect();
    let mut all_s: Vec<f64> = steps.iter().map(|(_, step_s)| *step_s).collect();
    let Some(median_s) = median(&mut all_s) else {
        return GAP_S;
    };
    let longest_step_s = longest_of_median_s(median_s);
    let is_gap = |(_, step_s): &(usize, f64)| *step_s > longest_step_s;
    let (gaps, mut uneven): (Vec<_>, Vec<_>) = steps.into_iter().partition(is_gap);
    if let Some((row, longest_s)) = gaps.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
        let what = format!(
            "with a gap after them, the longest of {longest_s:.3} s at {:.2} s (the median step is {median_s:.3} s); nothing is interpolated across them",
            t_s[*row]
        );
        let rows: Vec<usize> = gaps.iter().map(|(row, _)| *row).collect();
        log.tell(RemarkKind::Gap, &rows, &what);
    }
    uneven.retain(|(_, step_s)| (step_s - median_s).abs() > UNEVEN * median_s);
    if uneven.len() * 100 > all_s.len() {
        let (rows, steps_s): (Vec<usize>, Vec<f64>) = uneven.into_iter().unzip();
        let low_s = steps_s.iter().copied().fold(f64::MAX, f64::min);
        let high_s = steps_s.iter().copied().fold(0.0, f64::max);
        let what = format!(
            "with uneven steps, {low_s:.3} to {high_s:.3} s (the median is {median_s:.3} s)"
        );
        log.tell(RemarkKind::UnevenSteps, &rows, &what);
    }
    longest_step_s
}

/// Positions that stand still while the velocity says otherwise.
fn frozen(samples: &Samples, keep: &[usize], log: &mut RowRemarks<'_>) {
    let groups = samples.group::<3>(Role::Position);
    let Some((position_m, velocity_mps)) = groups.zip(samples.group::<3>(Role::Velocity)) else {
        return;
    };
    let stands = |a: &usize, b: &usize| position_m.iter().all(|axis_m| axis_m[*a] == axis_m[*b]);
    let path_m =
        |pair: &[usize]| norm(velocity_mps, pair[0]) * (log.t_s[pair[1]] - log.t_s[pair[0]]);
    let mut rows = Vec::new();
    for run in keep.chunk_by(stands) {
        let moved_m: f64 = run.windows(2).map(path_m).sum();
        if run.len() >= FROZEN_ROWS && moved_m > FROZEN_M {
            rows.extend_from_slice(run);
        }
    }
    let words = "with a frozen position although the velocity is not 0; kept";
    log.tell(RemarkKind::Stuck, &rows, words);
}

/// Motors that are given all there is.
fn at_full(samples: &Samples, keep: &[usize], log: &mut RowRemarks<'_>) {
    let Some(motors) = samples.group::<4>(Role::Duty) else {
        return;
    };
    // Half of the last of 16 bits below full.
    let full = |row: &&usize| motors.iter().any(|duty| duty[**row] > 1.0 - 0.5 / 65_536.0);
    let rows: Vec<usize> = keep.iter().filter(full).copied().collect();
    let words = "with a motor at full duty cycle; kept";
    log.tell(RemarkKind::Saturated, &rows, words);
}

/// Cuts everything from shortly before the tilt limit is passed.
fn crash(
    samples: &Samples,
    (limit_rad, place): (f64, Problem),
    keep: &mut Vec<usize>,
    log: &mut RowRemarks<'_>,
) {
    let Some([x, y, z, w]) = samples.group(Role::Quaternion) else {
        return;
    };
    let tilt_rad = |row: usize| {
        let [x2, y2, z2, w2] = [x, y, z, w].map(|part| part[row] * part[row]);
        let cosine: f64 = 1.0 - 2.0 * (x2 + y2) / (x2 + y2 + z2 + w2);
        cosine.clamp(-1.0, 1.0).acos()
    };
    let is_tipped = |row: &&usize| tilt_rad(**row) > limit_rad;
    let Some(&tipped) = keep.iter().find(is_tipped) else {
        return;
    };
    // A drone on the ground for longer than the flight took looks the same: both are named.
    if 2 * keep.iter().filter(is_tipped).count() > keep.len() {
        let message = format!(
            "its tilt is beyond {:.0} deg in more than half of the rows",
            limit_rad.to_degrees()
        );
        let help = "angles in degrees, another order of the quaternion (`qx qy qz qw`) or direction (`quaternion: WorldToBody`), another frame (`NorthEastDown`), or a wreck: cut the log";
        log.found.helped(place, message, Some(help.to_owned()));
        keep.clear();
        return;
    }
    let from_s = log.t_s[tipped] - CUT_BEFORE_CRASH_S;
    let end = keep.partition_point(|&row| log.t_s[row] < from_s);
    let what = format!(
        "cut, from {CUT_BEFORE_CRASH_S} s before the tilt passes {:.0} deg at {:.2} s: a crash",
        limit_rad.to_degrees(),
        log.t_s[tipped]
    );
    log.tell(RemarkKind::Touch, &keep[end..], &what);
    keep.truncate(end);
}

/// Cuts what stands on the floor or touches it.
fn floor(z_m: &[f64], touch_z_m: f64, keep: &mut Vec<usize>, log: &mut RowRemarks<'_>) {
    let low = |row: &usize| z_m[*row] < touch_z_m;
    let spans: Vec<String> = keep
        .chunk_by(|a, b| low(a) == low(b))
        .filter(|run| low(&run[0]))
        .map(|run| {
            let (first, last) = (run[0], run[run.len() - 1]);
            format!("{:.2}-{:.2}", log.t_s[first], log.t_s[last])
        })
        .collect();
    let rows: Vec<usize> = keep.extract_if(.., |row| low(row)).collect();
    let more = match spans.len().checked_sub(MOST_SPANS) {
        Some(more) if more > 0 => format!(" and {more} more"),
        _ => String::new(),
    };
    let listed = spans[..spans.len().min(MOST_SPANS)].join(", ");
    let what =
        format!("cut: on the floor or touching it (below {touch_z_m} m) at {listed} s{more}");
    log.tell(RemarkKind::Touch, &rows, &what);
}

#[cfg(test)]
mod tests {
    use super::in_order;

    #[test]
    fn times_far_ahead_are_left_out_and_not_what_follows_them() {
        for (t_s, left_out) in [
            (&[0.0, 1.0, 90.0, 91.0, 2.0, 3.0, 4.0][..], &[2, 3][..]),
            (&[80.0, 0.0, 1.0, 2.0], &[0]),
            (&[0.0, 1.0, f64::NAN, 1.0, 2.0, f64::INFINITY], &[2, 3, 5]),
            (&[0.0, 1.0, 2.0, 90.0, 3.0], &[3]),
            // A clock that was set back.
            (&[0.0, 1.0, 2.0, 3.0, 1.5, 2.5, 3.5], &[2, 3]),
            (&[], &[]),
        ] {
            assert_eq!(in_order(t_s).1, left_out, "{t_s:?}");
        }
    }
}
