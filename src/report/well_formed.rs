//! Endpoints that make drones wait for one another, in words.

use planner::plan::Plan;
use planner::plan::outcome::{Offence, OffenceKind, WellFormed};
use serde::Serialize;

use crate::report::words::count;

/// Ready to hand on as JSON.
#[derive(Debug, Serialize)]
pub(crate) struct WellFormedEntry<'a> {
    /// Whether any order of the fleet leads to a plan.
    proven: bool,
    /// Drones that may have to wait for others.
    waiting: Vec<&'a str>,
    /// What keeps it from being proven.
    pairs: Vec<PairEntry<'a>>,
}

#[derive(Debug, Serialize)]
struct PairEntry<'a> {
    /// The drone that has to wait.
    drone: &'a str,
    /// For this one.
    with: &'a str,
    /// `goal_at_start`: the goal of the one lies in the wake or at the place of the other's start, or the reverse;
    /// `enclosed`: start or goal of the other is beside the room that the one cannot leave.
    why: OffenceKind,
}

/// All of it, with names.
pub(crate) fn describe<'a>(known: &WellFormed, plan: &'a Plan) -> WellFormedEntry<'a> {
    let pair = |offence: &Offence| PairEntry {
        drone: &plan.drones[offence.drone].name,
        with: &plan.drones[offence.other].name,
        why: offence.kind,
    };
    let name = |drone: &usize| plan.drones[*drone].name.as_str();
    WellFormedEntry {
        proven: known.is_proven(),
        waiting: known.waiting.iter().map(name).collect(),
        pairs: known.offences.iter().map(pair).collect(),
    }
}

/// "Endpoints are wake-well-formed: ..."
pub(crate) fn in_a_line(known: &WellFormed, plan: &Plan) -> String {
    if known.is_proven() {
        return "Endpoints are wake-well-formed: every drone has a path that all other starts and goals leave free.".into();
    }
    let name = |index: usize| &plan.drones[index].name;
    let first = known.offences.first().map(|first| {
        let (drone, other) = (name(first.drone), name(first.other));
        match first.kind {
            OffenceKind::GoalAtStart => format!("{drone} ends where {other} starts"),
            OffenceKind::Enclosed => format!("{drone} has no path around {other}"),
        }
    });
    let first = first.unwrap_or_else(|| "too many wakes add up around them".into());
    let more = match known.offences.len().saturating_sub(1) {
        0 => String::new(),
        more => format!("; --format json has {} more", count(more, "pair", "pairs")),
    };
    format!(
        "Endpoints are not wake-well-formed: {} of {} may have to wait for others ({first}{more}).",
        known.waiting.len(),
        known.drones,
    )
}
