//! What cannot be in a vehicle's rows: times out of order, values that no drone has, holes, a
//! frozen position, the floor, a crash.
//!
//! A row with a value that cannot be is left out as a whole and counted; nothing is mended.

use super::found::Found;
use super::samples::{Attitude, Samples};
use crate::record::remark::RemarkKind;
use crate::statistics::quantile::median;

/// Farthest coordinate (m). Chosen here: a site in its own frame, not a map in UTM metres.
const FARTHEST_M: f64 = 10_000.0;
/// Fastest (m/s). Chosen here: twice a racing drone.
const FASTEST_MPS: f64 = 100.0;
/// Hardest acceleration (m/s²). Chosen here: 50 g, beyond the ±16 g of the IMUs that are flown.
const HARDEST_MPS2: f64 = 500.0;
/// How far a quaternion's norm may be from 1. Chosen here: compressed quaternions are within 0.2 %.
const NORM_TOLERANCE: f64 = 0.02;
/// Largest throttle over hover. Chosen here: no multirotor hovers on a fifth of its throttle range.
const MOST_THROTTLE_RATIO: f64 = 5.0;
/// How far below the floor a position may be read (m). Chosen here: a bad marker model, not a
/// cellar.
const BELOW_FLOOR_M: f64 = 0.2;
/// A gap is longer than this many median steps ...
const GAP_OVER_MEDIAN: f64 = 3.0;
/// ... and longer than this (s): chosen here, the time in which a Crazyflie's attitude can turn by
/// 45°.
const GAP_S: f64 = 0.05;
/// Steps off the median by more than this part of it count as uneven; told when one in a hundred
/// is. Chosen here.
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

/// Where rows stop being flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FlightLimits {
    /// Height of the floor (m), if there is one.
    pub(super) floor_z_m: Option<f64>,
    /// Logged height (m) below which the vehicle stands on the floor or touches it.
    pub(super) touch_z_m: Option<f64>,
    /// Tilt (rad) that is a crash.
    pub(super) tilt_rad: f64,
}

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
    vehicle: &str,
    samples: &Samples,
    limits: &FlightLimits,
    found: &mut Found,
) -> Checked {
    let t_s = &samples.t_s;
    let mut log = Log {
        vehicle,
        t_s,
        found,
    };
    let (mut keep, backward) = in_order(t_s);
    log.rows(
        RemarkKind::Impossible,
        &backward,
        "left out: their time is missing, repeats or goes back",
    );
    let longest_step_s = steps(&keep, &mut log);
    for (words, fault) in FAULTS {
        let mut first = None;
        let mut faulty = Vec::new();
        keep.retain(|&row| match fault(samples, row, limits) {
            None => true,
            Some(value) => {
                first.get_or_insert(value);
                faulty.push(row);
                false
            }
        });
        if let Some(value) = first {
            let what = format!("left out: {words} (first {value:.4})");
            log.rows(RemarkKind::Impossible, &faulty, &what);
        }
    }
    frozen(samples, &keep, &mut log);
    at_full(samples, &keep, &mut log);
    crash(samples, limits, &mut keep, &mut log);
    let before_floor = keep.len();
    floor(samples, limits, &mut keep, &mut log);
    Checked {
        only_stood: keep.is_empty() && before_floor > 0,
        keep,
        longest_step_s,
    }
}

/// What can be wrong with the values of a row: in words, and the value at fault in the unit of its
/// column.
type Fault = (
    &'static str,
    fn(&Samples, usize, &FlightLimits) -> Option<f64>,
);

/// In the order in which rows are judged.
const FAULTS: [Fault; 10] = [
    ("a value is missing or not finite", |samples, row, _| {
        let mut values = samples.row(row).into_iter();
        values.find(|value| !value.is_finite())
    }),
    ("a coordinate beyond 10 km", |samples, row, _| {
        let mut position_m = samples.position_m[row].into_iter();
        position_m.find(|value| value.abs() > FARTHEST_M)
    }),
    ("a velocity beyond 100 m/s", |samples, row, _| {
        let mut velocity_mps = samples.velocity_mps.as_ref()?[row].into_iter();
        velocity_mps.find(|value| value.abs() > FASTEST_MPS)
    }),
    ("an acceleration beyond 500 m/s2", |samples, row, _| {
        let mut acceleration_mps2 = samples.acceleration_mps2.as_ref()?[row].into_iter();
        acceleration_mps2.find(|value| value.abs() > HARDEST_MPS2)
    }),
    (
        "the quaternion's norm is not 1 within 2 %",
        |samples, row, _| match samples.attitude.as_ref()? {
            Attitude::Quaternion(all) => {
                let norm = all[row].iter().map(|v| v * v).sum::<f64>().sqrt();
                ((norm - 1.0).abs() > NORM_TOLERANCE).then_some(norm)
            }
            Attitude::Angles(_) => None,
        },
    ),
    ("a duty cycle outside 0 to 1", |samples, row, _| {
        let mut duty = samples.duty.as_ref()?[row].into_iter();
        duty.find(|duty| !(0.0..=1.0).contains(duty))
    }),
    ("a battery voltage of 0 or below", |samples, row, _| {
        Some(samples.battery_v.as_ref()?[row]).filter(|&v| v <= 0.0)
    }),
    (
        "a throttle outside 0 to 5 times hover",
        |samples, row, _| {
            Some(samples.throttle_ratio.as_ref()?[row])
                .filter(|ratio| !(0.0..=MOST_THROTTLE_RATIO).contains(ratio))
        },
    ),
    ("a negative power", |samples, row, _| {
        Some(samples.power_w.as_ref()?[row]).filter(|&w| w < 0.0)
    }),
    ("more than 0.2 m below the floor", |samples, row, limits| {
        let z_m = samples.position_m[row][2];
        (z_m < limits.floor_z_m? - BELOW_FLOOR_M).then_some(z_m)
    }),
];

/// Rows whose times rise strictly, and the others. A single time far ahead of its neighbours is the
/// culprit, not all that follow it.
fn in_order(t_s: &[f64]) -> (Vec<usize>, Vec<usize>) {
    let (mut kept, mut left_out) = (Vec::with_capacity(t_s.len()), Vec::new());
    let mut last_s = f64::NEG_INFINITY;
    for (row, &time_s) in t_s.iter().enumerate() {
        let next_s = t_s.get(row + 1).copied();
        let leaps = next_s.is_some_and(|next_s| next_s < time_s && next_s > last_s && row > 0);
        if time_s.is_finite() && time_s > last_s && !leaps {
            last_s = time_s;
            kept.push(row);
        } else {
            left_out.push(row);
        }
    }
    (kept, left_out)
}

/// Gaps and uneven steps; returns the longest step that is no gap.
fn steps(keep: &[usize], log: &mut Log<'_>) -> f64 {
    let t_s = log.t_s;
    let step = |pair: &[usize]| t_s[pair[1]] - t_s[pair[0]];
    let all_s: Vec<f64> = keep.windows(2).map(step).collect();
    let Some(median_s) = median(&mut all_s.clone()) else {
        return GAP_S;
    };
    let longest_step_s = (GAP_OVER_MEDIAN * median_s).max(GAP_S);
    let gaps: Vec<usize> = (0..all_s.len())
        .filter(|&at| all_s[at] > longest_step_s)
        .collect();
    if let Some(longest) = gaps
        .iter()
        .copied()
        .max_by(|&a, &b| all_s[a].total_cmp(&all_s[b]))
    {
        let rows: Vec<usize> = gaps.iter().map(|&at| keep[at]).collect();
        let what = format!(
            "with a gap after them, the longest of {:.3} s at {:.2} s (the median step is {median_s:.3} s); nothing is interpolated across them",
            all_s[longest], t_s[keep[longest]]
        );
        log.rows(RemarkKind::Gap, &rows, &what);
    }
    let even = |step_s: f64| (step_s - median_s).abs() <= UNEVEN * median_s;
    let uneven: Vec<usize> = (0..all_s.len())
        .filter(|&at| all_s[at] <= longest_step_s && !even(all_s[at]))
        .collect();
    if uneven.len() * 100 > all_s.len() {
        let of = uneven.iter().map(|&at| all_s[at]);
        let (low_s, high_s) = of.fold((f64::MAX, 0.0_f64), |(l, h), s| (l.min(s), h.max(s)));
        let rows: Vec<usize> = uneven.iter().map(|&at| keep[at]).collect();
        let what = format!(
            "with uneven steps, {low_s:.3} to {high_s:.3} s (the median is {median_s:.3} s)"
        );
        log.rows(RemarkKind::UnevenSteps, &rows, &what);
    }
    longest_step_s
}

/// Positions that stand still while the velocity says otherwise.
fn frozen(samples: &Samples, keep: &[usize], log: &mut Log<'_>) {
    let Some(velocity_mps) = &samples.velocity_mps else {
        return;
    };
    let mut rows = Vec::new();
    for run in keep.chunk_by(|&a, &b| samples.position_m[a] == samples.position_m[b]) {
        let path = |pair: &[usize]| {
            let speed = velocity_mps[pair[0]]
                .iter()
                .map(|v| v * v)
                .sum::<f64>()
                .sqrt();
            speed * (samples.t_s[pair[1]] - samples.t_s[pair[0]])
        };
        let moved_m: f64 = run.windows(2).map(path).sum();
        if run.len() >= FROZEN_ROWS && moved_m > FROZEN_M {
            rows.extend_from_slice(run);
        }
    }
    log.rows(
        RemarkKind::Stuck,
        &rows,
        "with a frozen position although the velocity is not 0; kept",
    );
}

/// Motors that are given all there is.
fn at_full(samples: &Samples, keep: &[usize], log: &mut Log<'_>) {
    let Some(duty) = &samples.duty else {
        return;
    };
    // Half of the last of 16 bits below full.
    let full = |row: &&usize| duty[**row].iter().any(|&duty| duty > 1.0 - 0.5 / 65_536.0);
    let rows: Vec<usize> = keep.iter().filter(full).copied().collect();
    log.rows(
        RemarkKind::Saturated,
        &rows,
        "with a motor at full duty cycle; kept",
    );
}

/// Cuts everything from shortly before the tilt limit is passed.
fn crash(samples: &Samples, limits: &FlightLimits, keep: &mut Vec<usize>, log: &mut Log<'_>) {
    let Some(attitude) = &samples.attitude else {
        return;
    };
    let tilt_rad = |row: usize| {
        let cosine = match attitude {
            Attitude::Quaternion(all) => {
                let [x, y, z, w] = all[row];
                1.0 - 2.0 * (x * x + y * y) / (x * x + y * y + z * z + w * w)
            }
            Attitude::Angles(all) => all[row][0].cos() * all[row][1].cos(),
        };
        cosine.clamp(-1.0, 1.0).acos()
    };
    let Some(&tipped) = keep.iter().find(|&&row| tilt_rad(row) > limits.tilt_rad) else {
        return;
    };
    let from_s = samples.t_s[tipped] - CUT_BEFORE_CRASH_S;
    let end = keep.partition_point(|&row| samples.t_s[row] < from_s);
    let what = format!(
        "cut, from {CUT_BEFORE_CRASH_S} s before the tilt passes {:.0} deg at {:.2} s: a crash",
        limits.tilt_rad.to_degrees(),
        samples.t_s[tipped]
    );
    log.rows(RemarkKind::Touch, &keep[end..], &what);
    keep.truncate(end);
}

/// Cuts what stands on the floor or touches it.
fn floor(samples: &Samples, limits: &FlightLimits, keep: &mut Vec<usize>, log: &mut Log<'_>) {
    let Some(touch_z_m) = limits.touch_z_m else {
        return;
    };
    let low = |row: usize| samples.position_m[row][2] < touch_z_m;
    let spans: Vec<String> = keep
        .chunk_by(|&a, &b| low(a) == low(b))
        .filter(|run| low(run[0]))
        .map(|run| {
            let (first, last) = (run[0], run[run.len() - 1]);
            format!("{:.2}-{:.2}", samples.t_s[first], samples.t_s[last])
        })
        .collect();
    let rows: Vec<usize> = keep.iter().copied().filter(|&row| low(row)).collect();
    let more = match spans.len().checked_sub(MOST_SPANS) {
        Some(more) if more > 0 => format!(" and {more} more"),
        _ => String::new(),
    };
    let listed = spans[..spans.len().min(MOST_SPANS)].join(", ");
    let what =
        format!("cut: on the floor or touching it (below {touch_z_m} m) at {listed} s{more}");
    log.rows(RemarkKind::Touch, &rows, &what);
    keep.retain(|&row| !low(row));
}

/// Writes remarks on rows of one vehicle.
struct Log<'a> {
    vehicle: &'a str,
    t_s: &'a [f64],
    found: &'a mut Found,
}

impl Log<'_> {
    fn rows(&mut self, kind: RemarkKind, rows: &[usize], what: &str) {
        let times_s = rows.iter().map(|&row| self.t_s[row]);
        let subject = Some(self.vehicle);
        self.found.rows(kind, subject, ("row", times_s), what);
    }
}
