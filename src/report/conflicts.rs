//! Endpoints that exclude one another, in words: what is wrong, by how much, and the smallest
//! change that mends it.

use nalgebra::Point3;
use planner::plan::cause::{Exclusion, format_distinct, raised_together};
use planner::plan::outcome::{Blocker, EndpointConflict, EndpointConflicts, EndpointKind, Meeting};
use planner::scenario::world::{AtEnd, Drone, World};
use serde::Serialize;

use crate::report::words::{decimal, place};

/// One conflict, ready to print or to hand on as JSON.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct ConflictEntry {
    /// The one exposed.
    drone: String,
    /// The drone or zone that excludes it.
    with: String,
    /// `starts` or `goals`.
    when: EndpointKind,
    /// What is wrong.
    message: String,
    /// Where both are, and by how much it is wrong.
    detail: String,
    /// The smallest change that mends this pair.
    help: String,
    /// A place for `drone` where this pair is in order (m).
    nearest_fix_m: Option<Point3<f64>>,
}

/// Puts every conflict into words, in the planner's order.
pub(crate) fn describe_all(conflicts: &EndpointConflicts, world: &World) -> Vec<ConflictEntry> {
    let raised = conflicts.raised(|drone| &world.drones[drone].name);
    let conflicts = conflicts.worst.iter();
    conflicts
        .map(|conflict| describe(conflict, &raised, world))
        .collect()
}

impl ConflictEntry {
    /// As an error: what, where both are, the change that mends it.
    pub(crate) fn lines(&self) -> Vec<String> {
        let detail = format!("    {}", self.detail);
        vec![self.message.clone(), detail, format!("help: {}", self.help)]
    }
}

/// `raised`: the limits of air that are raised in the plan that shows that they are enough.
fn describe(conflict: &EndpointConflict, raised: &[(String, f64)], world: &World) -> ConflictEntry {
    let drone = &world.drones[conflict.drone];
    let name = &drone.name;
    let here = place_in(drone, conflict.task_of(drone.tasks.len()));
    let (with, there) = match conflict.blocker {
        Blocker::Drone(index) => {
            let other = &world.drones[index];
            (
                other.name.clone(),
                Some(place_in(other, conflict.their_task_of(other.tasks.len()))),
            )
        }
        Blocker::Zone(index) => (world.zones[index].name.clone(), None),
    };
    let lands = conflict.when == EndpointKind::Goals && drone.at_end == AtEnd::Land;
    let verb = match (conflict.when, lands) {
        (EndpointKind::Starts, _) => "starts",
        (EndpointKind::Goals, true) => "lands",
        (EndpointKind::Goals, false) => "ends",
        (EndpointKind::Tasks, _) => "is",
    };
    let landed = if lands { ", landed below" } else { "" };
    let when = conflict.meeting.map_or(String::new(), |it| during(&it));
    let at = format!("{name}{landed} {}{when}", place(&here));
    let below = there
        .map(|there| offset(&here, &there, &with))
        .unwrap_or_default();
    let (message, detail) = match conflict.why {
        Exclusion::Bodies { gap_m, needs_m, .. } => (
            format!("`{name}` {verb} too close to `{with}`"),
            match (-gap_m, format_distinct(gap_m, needs_m, 2)) {
                (by_m @ 0.0.., _) => format!(
                    "{at}: the bodies overlap by {by_m:.2} m, between them must be {needs_m:.2} m"
                ),
                (_, [gap, needs]) if needs_m > world.planning.clearance_m => format!(
                    "{at}: {gap} m between the bodies, it must be {needs} m: each that flies may be off \
                     its path by tracking_m, {:.2} m",
                    world.planning.margins.tracking_m
                ),
                (_, [gap, needs]) => {
                    format!("{at}: {gap} m between the bodies, it must be {needs} m")
                }
            },
        ),
        Exclusion::Column => (
            format!("`{name}` {verb} in the near-field column of `{with}`"),
            format!("{at} is {below}: no limit allows that"),
        ),
        Exclusion::Air {
            air_mps,
            alpha,
            limit,
            ..
        } => {
            let [alpha, limit] = format_distinct(alpha, limit, 2);
            (
                format!("`{name}` {verb} in the downwash of `{with}`"),
                format!(
                    "{at} is {below}: {air_mps:.1} m/s of downwash, alpha {alpha}, its limit is {limit}"
                ),
            )
        }
        Exclusion::Zone {
            air_mps,
            limit_mps,
            together,
        } => {
            let others = if together {
                ", with that of others,"
            } else {
                ""
            };
            let [air_mps, limit_mps] = format_distinct(air_mps, limit_mps, 1);
            (
                match is_inside(conflict.blocker, &here, world) {
                    true => format!("`{name}` {verb} in zone `{with}`"),
                    false => format!("`{name}` {verb} above zone `{with}`"),
                },
                format!(
                    "{at}: its downwash there{others} reaches {air_mps} m/s, the limit is {limit_mps} m/s"
                ),
            )
        }
    };
    let fix = conflict.nearest_fix_m.map(|to| step(name, &here, &to));
    let rule = match conflict.why {
        Exclusion::Air { enough, .. } => enough.map(|limit| match raised {
            [_, _, ..] => format!("with {} all are planned", raised_together(name, raised, "")),
            _ => format!("with the air_limit of {name} raised to {limit:.2} all are planned"),
        }),
        Exclusion::Bodies { tracking_m, .. } => {
            tracking_m.map(|m| format!("with planning: (tracking_m: {m}) all are planned"))
        }
        Exclusion::Column | Exclusion::Zone { .. } => None,
    };
    let help = match (fix, rule) {
        (Some(fix), Some(rule)) => format!("{fix}; {rule}"),
        (Some(way), None) | (None, Some(way)) => way,
        // Another place for the other, or one farther off, was not tried.
        (None, None) => format!("no place near is known for {name} with which all are planned"),
    };
    ConflictEntry {
        drone: name.clone(),
        with,
        when: conflict.when,
        message,
        detail,
        help,
        nearest_fix_m: conflict.nearest_fix_m,
    }
}

/// Whether a place (m) is within what excludes it, where that is a zone.
fn is_inside(blocker: Blocker, at_m: &Point3<f64>, world: &World) -> bool {
    let Blocker::Zone(index) = blocker else {
        return false;
    };
    let zone = &world.zones[index];
    (0..3).all(|k| (zone.min_m[k]..=zone.max_m[k]).contains(&at_m[k]))
}

/// Where one of its tasks, from 0, or its start, is (m).
fn place_in(drone: &Drone, task: Option<usize>) -> Point3<f64> {
    task.map_or(drone.start_m, |task| drone.tasks[task].to_m)
}

/// " at its task 2 (12 to 14 s)"
fn during(meeting: &Meeting) -> String {
    let place = meeting.task.map_or(" where it stays".to_owned(), |task| {
        format!(" at its task {task}")
    });
    let while_there = meeting.during_s.map(|during_s| {
        let [from_s, until_s] = during_s.map(decimal);
        format!(" ({from_s} to {until_s} s)")
    });
    place + &while_there.unwrap_or_default()
}

/// "4.0 m below m1 and 0.3 m off its axis"
fn offset(here: &Point3<f64>, there: &Point3<f64>, name: &str) -> String {
    let off_m = (here.xy() - there.xy()).norm();
    let below_m = there.z - here.z;
    let side = if below_m < 0.0 { "above" } else { "below" };
    let apart_m = below_m.abs();
    format!("{apart_m:.1} m {side} {name} and {off_m:.1} m off its axis")
}

/// "move k4 1.4 m sideways (to (5, 7.4, 1))"
fn step(name: &str, from: &Point3<f64>, to: &Point3<f64>) -> String {
    let step = to - from;
    let direction = match (step.xy().norm() > 0.005, step.z) {
        (true, z) if z.abs() <= 0.005 => " sideways",
        (false, z) if z > 0.0 => " up",
        (false, _) => " down",
        _ => "",
    };
    let (by, to) = (decimal(step.norm()), place(to));
    format!("move {name} {by} m{direction} (to {to})")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests as sample;

    #[test]
    fn a_start_in_a_downwash_names_the_place_the_air_and_the_smallest_fix() {
        let world = sample::two_above_each_other();
        let conflict = EndpointConflict {
            drone: 1,
            blocker: Blocker::Drone(0),
            when: EndpointKind::Starts,
            meeting: None,
            why: Exclusion::Air {
                air_mps: 4.6,
                alpha: 0.618,
                limit: 0.3,
                enough: Some(0.62),
            },
            nearest_fix_m: Some(Point3::new(5.0, 7.4, 1.0)),
        };
        let entry = describe(&conflict, &[], &world);
        assert_eq!(entry.message, "`k4` starts in the downwash of `m1`");
        assert_eq!(
            entry.detail,
            "k4 (5, 6, 1) is 4.0 m below m1 and 0.3 m off its axis: 4.6 m/s of downwash, alpha 0.62, its limit is 0.30"
        );
        assert_eq!(
            entry.help,
            "move k4 1.4 m sideways (to (5, 7.4, 1)); with the air_limit of k4 raised to 0.62 all are planned"
        );
    }

    #[test]
    fn bodies_that_overlap_say_by_how_much() {
        let world = sample::two_above_each_other();
        let conflict = EndpointConflict {
            drone: 0,
            blocker: Blocker::Drone(1),
            when: EndpointKind::Goals,
            meeting: None,
            why: Exclusion::Bodies {
                gap_m: -0.05,
                needs_m: 0.1,
                tracking_m: None,
            },
            nearest_fix_m: None,
        };
        let entry = describe(&conflict, &[], &world);
        assert_eq!(entry.message, "`m1` ends too close to `k4`");
        assert!(
            entry.detail.contains("overlap by 0.05 m"),
            "{}",
            entry.detail
        );
        assert_eq!(
            entry.help,
            "no place near is known for m1 with which all are planned"
        );
    }
}
