//! Where a drone says it is, against where its plan has it.

use nalgebra::Point3;
use planner::plan::{DronePlan, Margins};

/// Positions nearer than this to the plan are the plan's, where its tracking margin is smaller (m).
/// Chosen here: what is left of ultra-wideband positioning's error when it is filtered; motion
/// capture errs by millimetres.
const MEASURED_M: f64 = 0.1;
/// Step with which delays are tried (s): the tick of the planner.
const TICK_S: f64 = 0.01;
/// Longest delay that is looked for (s). Chosen here: a later drone is to be given a task.
const LATEST_S: f64 = 120.0;
/// How much further than its highest speed allows a position may be from the one before (m).
/// Chosen here: a switch of the positioning system, or a gust.
const SLACK_M: f64 = 5.0;
/// A drone may be this much faster than its highest speed (ratio). Chosen here: gusts.
const SPEED_RATIO: f64 = 2.0;

/// What a position says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum OffPlan {
    /// Where the plan bears it.
    No,
    /// Where the plan had it this long ago (s).
    Late(f64),
    /// This far from where the plan has it (m), and not late.
    Path(f64),
}

/// Judges a position (m) at a time (s).
pub(crate) fn judge(
    entry: &DronePlan,
    margins: &Margins,
    at_s: f64,
    position_m: &Point3<f64>,
) -> OffPlan {
    let off_m = |t_s: f64| {
        let planned_m = entry.trajectory.position_m(t_s.max(0.0));
        planned_m.map_or(f64::INFINITY, |it| (it - position_m).norm())
    };
    let borne_m = margins.tracking_m.max(MEASURED_M);
    let within = (margins.time_s / TICK_S).floor() as i64;
    let shifted_s = |ticks: i64| at_s - ticks as f64 * TICK_S;
    if (-within..=within).any(|ticks| off_m(shifted_s(ticks)) <= borne_m) {
        return OffPlan::No;
    }
    let latest = (LATEST_S.min(at_s) / TICK_S).floor() as i64;
    let mut late = (within + 1)..=latest;
    match late.find(|ticks| off_m(shifted_s(*ticks)) <= borne_m) {
        Some(ticks) => OffPlan::Late(nearest_s(ticks, latest, |ticks| off_m(shifted_s(ticks)))),
        None => OffPlan::Path(off_m(at_s)),
    }
}

/// From the first delay within bounds on, the one where the distance stops falling (s).
fn nearest_s(first: i64, latest: i64, off_m: impl Fn(i64) -> f64) -> f64 {
    let mut ticks = first;
    while ticks < latest && off_m(ticks + 1) < off_m(ticks) {
        ticks += 1;
    }
    ticks as f64 * TICK_S
}

/// How far a drone can have come in a time (s) (m).
pub(crate) fn reach_m(entry: &DronePlan, in_s: f64) -> f64 {
    let airframe = &entry.airframe;
    let sinks_mps = airframe.max_descent_mps.unwrap_or(0.0);
    let speed_mps = airframe.max_speed_mps.max(sinks_mps);
    SLACK_M + SPEED_RATIO * speed_mps * in_s.max(0.0)
}
