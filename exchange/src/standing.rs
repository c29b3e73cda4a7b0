//! Plans in formats in which every drone is there from the beginning to the end: a drone that comes
//! later stands at its first place until then, one that leaves stands at its last.

use planner::Plan;
use planner::plan::{AtEnd, AtStart, DronePlan, Violation};

use crate::export::Refusal;

/// A drone as such files have it; `None`: as in the plan.
fn standing(drone: &DronePlan) -> Option<DronePlan> {
    let enters_s = drone.enters_s.filter(|it| *it > 0.0);
    let leaves = drone.at_end == AtEnd::Leave;
    if enters_s.is_none() && !leaves {
        return None;
    }
    let mut drone = drone.clone();
    let (from_s, until_s) = drone.airborne_s;
    let path = &mut drone.trajectory;
    // A drone that has come down, or was never up, lies where it is.
    let is_up = until_s.is_none_or(|it| it > from_s && Some(it) >= path.t_s.last().copied());
    if leaves && is_up {
        (drone.at_end, drone.airborne_s.1) = (AtEnd::Hover, None);
    } else if leaves {
        drone.at_end = AtEnd::Land;
        path.end_at(until_s.unwrap_or(from_s));
    }
    if enters_s.is_some() {
        path.hold_from_0();
        drone.enters_s = None;
        let never_flies = until_s == Some(from_s);
        if never_flies || drone.at_start == AtStart::Hover {
            drone.airborne_s.0 = 0.0;
        }
        if never_flies {
            drone.airborne_s.1 = Some(0.0);
        }
    }
    Some(drone)
}

/// What the plan breaks if its drones stand where files that are flown have them, by drone: the one
/// that stands, where it is one.
pub(crate) fn refusals(plan: &Plan) -> Vec<Refusal> {
    let stand: Vec<Option<DronePlan>> = plan.drones.iter().map(standing).collect();
    if stand.iter().all(Option::is_none) {
        return Vec::new();
    }
    let stands = |name: &str| stand.iter().flatten().any(|it| it.name == name);
    let drones = plan.drones.iter().zip(&stand);
    let drones = drones.map(|(as_planned, it)| it.as_ref().unwrap_or(as_planned).clone());
    let copy = Plan {
        drones: drones.collect(),
        ..plan.clone()
    };
    let refused = |it: &Violation| {
        let both = std::iter::once(&it.drone).chain(&it.with);
        let mut drones: Vec<String> = both.filter(|it| stands(it)).cloned().collect();
        if drones.is_empty() {
            drones.push(it.drone.clone());
        }
        let what = format!(
            "in files that are flown a drone that comes later stands at its first place, and one that leaves at its last: {it}"
        );
        let refusal = move |drone| Refusal {
            drone,
            what: what.clone(),
        };
        drones.into_iter().map(refusal)
    };
    let found = planner::verify(&copy).violations;
    let mut refused: Vec<Refusal> = found.iter().flat_map(refused).collect();
    // Of each drone the first.
    refused.sort_by(|a, b| a.drone.cmp(&b.drone));
    refused.dedup_by(|a, b| a.drone == b.drone);
    refused
}
