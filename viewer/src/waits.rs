//! Which drones stop, how long, and for which drone: in the page, and in reports as bottlenecks.
//!
//! The cause is a picture's measure of distances along paths. `plan explain` asks the verifier.

use nalgebra::Point3;
use planner::World;
use planner::plan::{DronePlan, Plan, Sample};
use planner::scenario::dwells;
use planner::scenario::world::Task;
use rayon::prelude::*;

use crate::air::AirOfPlan;

/// Moments at which drones are sampled, over the fleet: chosen here, about half a second of one
/// core.
const MOST_SAMPLES: f64 = 80_000.0;
/// Between two moments (s), at least and at most: chosen here.
const STEP_S: [f64; 2] = [0.1, 0.6];
/// A stop between two moves that is this long is shown (s), chosen here: half a step of a cell.
const WAITS_FROM_S: f64 = 0.25;
/// How far beyond a wait its cause is looked for (s), chosen here: two crossings take less.
const CAUSE_WITHIN_S: f64 = 15.0;
/// Share of a rule's limit at which one drone counts as waiting for another: chosen here, since
/// plans keep margins of time as well.
const NEARLY: f64 = 0.7;
/// A smooth path stops where it is slower than this share of the highest speed, chosen here, but
/// not where it climbs off the ground or comes down to it, at half a metre a second.
const SLOW: f64 = 0.2;
/// m/s.
const SLOWEST_MPS: f64 = 0.4;
/// And comes below this share in between, but turns by less than 60 degrees: chosen here, such a
/// turn alone leaves it 0.87 of its speed.
const STILL: f64 = 0.1;
/// Between two samples of speed (s): chosen here, five to the shortest stop shown.
const LOOK_S: f64 = 0.05;

/// Places nearer to one another are one (m): chosen here, what a smooth path lacks of its task
/// while it comes to rest.
const SAME_PLACE_M: f64 = 1e-3;
/// Times nearer to one another are one (s): rounding.
const SAME_TIME_S: f64 = 1e-6;

/// A stop between two moves, or a dwell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// s.
    pub from_s: f64,
    /// s.
    pub until_s: f64,
    /// `dwell`, `wait`, or `stop` where that is not known.
    pub what: &'static str,
    /// Which drone it waits for; `None`: no single drone blocks it.
    pub waits_for: Option<usize>,
    /// Of a wait, how much later the drone is for it (s): its part of what the plan says that the
    /// drone waits ([`DronePlan::waits_s`]). A smooth path is slow for longer than it is late. 0 of
    /// one after its last task, and before an appointment that it is early for all the same.
    pub costs_s: Option<f64>,
    /// Of a wait before such an appointment, from and until when it stays there (s).
    pub held_s: Option<(f64, f64)>,
    /// m.
    pub at_m: Point3<f64>,
}

/// The stops of a whole plan.
pub(crate) struct Waits {
    /// Moments at which the fleet is sampled.
    pub(crate) samples: Vec<Sample>,
    /// Between two of them (s), whole milliseconds.
    pub(crate) step_s: f64,
    /// Of each drone, by their beginning.
    pub(crate) stops: Vec<Vec<Stop>>,
}

impl Waits {
    /// With its world the stops of a plan are classified: dwells, and waits.
    pub(crate) fn of(plan: &Plan, world: Option<&World>, air: &AirOfPlan<'_>) -> Waits {
        let fleet = plan.drones.len();
        let end_s = plan.ends_s();
        // Whole milliseconds, so that the page counts them as they are here. A very long plan has
        // at most so many moments in all.
        let step_s = (end_s * fleet as f64 / MOST_SAMPLES)
            .clamp(STEP_S[0], STEP_S[1])
            .max(end_s / MOST_SAMPLES.sqrt() / 30.0);
        let step_s = (step_s * 1e3).ceil() / 1e3;
        let samples = plan.sample(1.0 / step_s);
        let of_drone = |k: usize| {
            let mut stops = stops(plan, world, k);
            // Without its world a dwell looks like a wait.
            for stop in stops.iter_mut().filter(|it| it.what == "wait") {
                let span_s = (stop.from_s, stop.until_s);
                stop.waits_for = waits_for(plan, (air, &samples), k, span_s);
            }
            stops
        };
        let stops = (0..fleet).into_par_iter().map(of_drone).collect();
        Waits {
            samples,
            step_s,
            stops,
        }
    }
}

/// Stops between two moves, in order, and which are dwells at a task; without causes.
pub fn stops(plan: &Plan, world: Option<&World>, drone: usize) -> Vec<Stop> {
    let path = &plan.drones[drone].trajectory;
    let points = path.t_s.len().min(path.position_m.len());
    let mut found = Vec::new();
    let mut next = 0;
    let is_same = |a: &Point3<f64>, b: &Point3<f64>| (a - b).norm() < SAME_PLACE_M;
    let entry = &plan.drones[drone];
    let asked = world.and_then(|it| it.drones.iter().find(|it| it.name == entry.name));
    // One may have been flown straight through, and has no stay.
    let dwells = asked.map_or(Vec::new(), |asked| dwells(asked, entry));
    for stay in path.position_m[..points].chunk_by(is_same) {
        let from_s = path.t_s[next];
        next += stay.len();
        let until_s = path.t_s[next - 1];
        let here = dwells.iter().filter(|(there_s, _)| {
            (from_s - SAME_TIME_S..=until_s + SAME_TIME_S).contains(there_s)
        });
        let dwelt_s = here.map(|(_, leaves_s)| *leaves_s).fold(from_s, f64::max);
        let stop = |from_s, until_s, what| Stop {
            from_s,
            until_s,
            what,
            waits_for: None,
            costs_s: None,
            held_s: None,
            at_m: stay[0],
        };
        if until_s - dwelt_s >= WAITS_FROM_S && next < points {
            let word = if asked.is_some() { "wait" } else { "stop" };
            // It waits where it is after its dwell.
            found.push(stop(dwelt_s, until_s, word));
        }
        if dwelt_s > from_s + SAME_TIME_S {
            found.push(stop(from_s, dwelt_s.min(until_s), "dwell"));
        }
    }
    let is_apart = |&(from_s, until_s): &(f64, f64)| {
        let overlaps = |it: &Stop| it.from_s < until_s && from_s < it.until_s;
        !found.iter().any(overlaps)
    };
    let crawls = crawls(entry).into_iter().filter(is_apart);
    let crawls: Vec<Stop> = crawls
        .filter_map(|(from_s, until_s)| {
            let at_m = path.position_m((from_s + until_s) / 2.0)?;
            let is_at = |task: &Task| (task.to_m - at_m).norm() < AT_TASK_M;
            let is_at_task = asked.is_some_and(|it| it.tasks.iter().any(is_at));
            (!is_at_task).then_some(Stop {
                from_s,
                until_s,
                what: if asked.is_some() { "wait" } else { "stop" },
                waits_for: None,
                costs_s: None,
                held_s: None,
                at_m,
            })
        })
        .collect();
    found.extend(crawls);
    found.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    // It goes on no earlier from there, however early it came: it leaves when the appointment ends.
    let is_held = |task: &Task, leaves_s: f64| {
        task.during_s
            .is_some_and(|[_, until_s]| leaves_s <= until_s + SAME_TIME_S)
    };
    let tasks = asked.iter().flat_map(|it| &it.tasks);
    let held = tasks.zip(dwells.iter().copied());
    let held = held.filter(|(task, stay_s)| is_held(task, stay_s.1));
    let held: Vec<(f64, f64)> = held.map(|(_, stay_s)| stay_s).collect();
    for stop in found.iter_mut().filter(|it| it.what == "wait") {
        let mut later = held.iter();
        stop.held_s = later.find(|it| stop.until_s <= it.0 + SAME_TIME_S).copied();
    }
    share(entry, &mut found);
    found
}

/// What a smooth stop takes beyond its rest (s), about: turns of 2 m/s at 3 m/s² and 8 m/s³.
/// Plans count it as waiting.
const STOPPING_S: f64 = 0.8;

/// Shares what a drone waits, as its plan counts it, among its waits by their length, to none more
/// than it takes: the rest the drone waits elsewhere, in stops that are too short to be shown. In a
/// plan that does not count them a drone waits for as long as it stands. Waits that make it no
/// later at its goal are not counted.
fn share(drone: &DronePlan, stops: &mut [Stop]) {
    let path = &drone.trajectory;
    let begins_s = path.t_s.first().copied().unwrap_or(0.0);
    // One that stood already does not stop for its wait.
    let is_at_rest = |from_s: f64| {
        let mut before = stops.iter().map(|it| it.until_s);
        from_s <= begins_s || before.any(|until_s| (until_s - from_s).abs() < SAME_TIME_S)
    };
    let is_done = |it: &Stop| drone.arrives_s > 0.0 && it.until_s > drone.arrives_s + SAME_TIME_S;
    let is_counted = |it: &Stop| it.what == "wait" && it.held_s.is_none() && !is_done(it);
    let stands_s = |it: &Stop| match is_counted(it) {
        true => it.until_s - it.from_s,
        false => 0.0,
    };
    let takes_s = |it: &Stop| match is_counted(it) {
        true if path.is_smooth() && !is_at_rest(it.from_s) => stands_s(it) + STOPPING_S,
        _ => stands_s(it),
    };
    let each_s: Vec<f64> = stops.iter().map(takes_s).collect();
    let all_s: f64 = each_s.iter().sum();
    // A drone that arrives as early as alone waits for none.
    let is_as_alone = drone.alone_s > 0.0 && drone.arrives_s - drone.alone_s < SAME_TIME_S;
    let counted_s = match drone.waits_s > 0.0 || is_as_alone {
        true => drone.waits_s.min(all_s),
        false => stops.iter().map(stands_s).sum(),
    };
    let each = stops.iter_mut().zip(each_s);
    for (stop, takes_s) in each.filter(|(it, _)| it.what == "wait") {
        stop.costs_s = Some(match takes_s > 0.0 {
            true => counted_s * takes_s / all_s,
            false => 0.0,
        });
    }
}

/// A path that turns at a task without a dwell comes so near to it (m): chosen here.
const AT_TASK_M: f64 = 0.1;

/// Spans (s) in which a smooth path goes on so slowly that it stops, without being at rest for long
/// enough to be a stay; in order.
fn crawls(drone: &DronePlan) -> Vec<(f64, f64)> {
    let path = &drone.trajectory;
    let last_s = path.t_s.last().copied().unwrap_or(0.0).min(drone.arrives_s);
    if !path.is_smooth() {
        return Vec::new();
    }
    let most_mps = drone.airframe.max_speed_mps;
    let slow_mps = (SLOW * most_mps).min(SLOWEST_MPS);
    let steps = (last_s / LOOK_S) as usize;
    // However long it rests, its beginning and its end suffice.
    let rests_until_s = |t_s: f64| {
        let piece = path.point_at(t_s)?;
        let [from_m, to_m] = [piece, piece + 1].map(|it| path.position_m.get(it));
        let control_m = path.control_m.get(piece).into_iter().flatten();
        let rests = from_m == to_m && { control_m }.all(|it| Some(it) == from_m);
        path.t_s.get(piece + 1).copied().filter(|_| rests)
    };
    let mut times_s = Vec::new();
    let mut step = 0;
    while step <= steps {
        let t_s = step as f64 * LOOK_S;
        times_s.push(t_s);
        let rested = rests_until_s(t_s).map_or(0, |it| (it / LOOK_S) as usize);
        step = rested.max(step + 1);
    }
    let speed_mps = |t_s: &f64| {
        let state = path.state(*t_s);
        state.map_or(0.0, |it| it.velocity_mps.norm())
    };
    let speeds: Vec<f64> = times_s.iter().map(speed_mps).collect();
    let mut found = Vec::new();
    let mut k = 0;
    for span in speeds.chunk_by(|a, b| (*a < slow_mps) == (*b < slow_mps)) {
        let from = k;
        k += span.len();
        let least_mps = span.iter().copied().fold(f64::INFINITY, f64::min);
        let Some(&until_s) = times_s.get(k) else {
            // The last is its end.
            break;
        };
        let span_s = (times_s[from], until_s);
        // Sharper turns are slow as well.
        let velocities = [span_s.0, span_s.1].map(|t_s| path.state(t_s).map(|it| it.velocity_mps));
        let goes_on = match velocities {
            [Some(a), Some(b)] => a.dot(&b) > 0.5 * a.norm() * b.norm(),
            _ => false,
        };
        // The first is its beginning.
        if least_mps < STILL * most_mps && from > 0 && goes_on {
            found.push(span_s);
        }
    }
    found
}

/// The drone with which a waiting one would have broken a rule first, had it gone on at once:
/// bodies too near, or too much air for either. `None`: no single drone.
fn waits_for(
    plan: &Plan,
    (air, samples): (&AirOfPlan<'_>, &[Sample]),
    drone: usize,
    (from_s, until_s): (f64, f64),
) -> Option<usize> {
    let own = &plan.drones[drone];
    let flown = plan.flown();
    let limit_mps = |it: &DronePlan, t_s: f64| {
        let u_h_mps = flown.hover_velocity_mps(it.hover_mps(t_s));
        flown.mean_mps(it.air_limit, u_h_mps).max(1e-6)
    };
    let apart_m = plan.clearance_m.unwrap_or(0.0) + 2.0 * plan.margins.tracking_m;
    let first = samples.partition_point(|it| it.t_s < from_s);
    let mut nearest = (NEARLY, None);
    for sample in &samples[first..] {
        if sample.t_s > until_s + CAUSE_WITHIN_S {
            break;
        }
        let place_m = own.trajectory.position_m(sample.t_s + until_s - from_s)?;
        for (other, there) in plan.drones.iter().enumerate() {
            let Some(other_m) = sample.position_m[other].filter(|_| other != drone) else {
                continue;
            };
            let level_m = (other_m.xy() - place_m.xy()).norm();
            let (above, below) = (other_m.z > place_m.z, other_m.z <= place_m.z);
            let reach_m = match above {
                true => air.farthest_m(other),
                false => air.farthest_m(drone),
            };
            if level_m > reach_m + apart_m + own.airframe.motor_distance_m {
                continue;
            }
            let bodies_m = own.airframe.body_radius_m + there.airframe.body_radius_m + apart_m;
            let mut share = bodies_m / (other_m - place_m).norm().max(1e-6);
            if above {
                let met_mps = air.brings_mps(other, drone, (place_m, sample.t_s));
                share = share.max(met_mps / limit_mps(own, sample.t_s + until_s - from_s));
            }
            if below {
                let own = (drone, place_m);
                let met_mps = air.would_bring_mps(own, other, (other_m, sample.t_s));
                share = share.max(met_mps / limit_mps(there, sample.t_s));
            }
            if share > nearest.0 {
                nearest = (share, Some(other));
            }
        }
        if nearest.0 >= 1.0 {
            break;
        }
    }
    nearest.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_waits_of_a_drone_cost_together_what_its_plan_says_that_it_waits() {
        let stop = |from_s, until_s, what| Stop {
            from_s,
            until_s,
            what,
            waits_for: None,
            costs_s: None,
            held_s: None,
            at_m: Point3::origin(),
        };
        let all = [
            stop(1.0, 2.0, "wait"),
            stop(4.0, 9.0, "dwell"),
            stop(9.0, 12.0, "wait"),
        ];
        let costs_of = |drone: &DronePlan, mut stops: [Stop; 3]| {
            share(drone, &mut stops);
            stops.map(|it| it.costs_s.map(|costs_s| (costs_s * 1e9).round() / 1e9))
        };
        let costs = |drone: &DronePlan| costs_of(drone, all);
        let mut drone = DronePlan {
            waits_s: 2.0,
            ..DronePlan::default()
        };
        assert_eq!(costs(&drone), [Some(0.5), None, Some(1.5)]);
        // None costs more than it takes.
        drone.waits_s = 40.0;
        assert_eq!(costs(&drone), [Some(1.0), None, Some(3.0)]);
        // A plan that does not count them, and a drone that is no later for them.
        drone.waits_s = 0.0;
        (drone.alone_s, drone.arrives_s) = (8.0, 12.0);
        assert_eq!(costs(&drone), [Some(1.0), None, Some(3.0)]);
        drone.alone_s = 12.0;
        assert_eq!(costs(&drone), [Some(0.0), None, Some(0.0)]);
        // A smooth one slows down for its stop, but not where it has dwelt.
        drone.waits_s = 5.6;
        drone.trajectory.control_m = vec![vec![Point3::origin(); 2]];
        assert_eq!(costs(&drone), [Some(1.8), None, Some(3.0)]);
        // After its last task, and before an appointment.
        drone.arrives_s = 9.0;
        assert_eq!(costs(&drone), [Some(1.8), None, Some(0.0)]);
        let mut before = all;
        before[0].held_s = Some((4.0, 9.0));
        drone.arrives_s = 12.0;
        assert_eq!(costs_of(&drone, before), [Some(0.0), None, Some(3.0)]);
    }

    #[test]
    fn a_task_that_is_flown_straight_through_and_the_order_of_drones_change_no_dwell() {
        let text = r#"Scenario(
            name: "one",
            bounds_m: (min: (0, 0, 0), max: (30, 20, 8)), planning: (motion: Straight),
            drones: [
                (name: "k1", airframe: "kolibri", start_m: (1, 1, 2), tasks: [(to_m: (10, 1, 2)),
                    (to_m: (20, 1, 2), dwell_s: 10), (to_m: (20, 10, 2), dwell_s: 5)]),
                (name: "k2", airframe: "kolibri", start_m: (1, 18, 2)),
            ],
        )"#;
        let mut world = planner::read_world(text).expect("in order");
        let outcome = planner::plan_world(&world, &planner::Control::QUIET).expect("in order");
        let plan = outcome.into_planned().expect("a plan").plan;
        for late in [false, true] {
            if late {
                // It comes later than it was to: what it does there is the same.
                world.drones[1].tasks[1].during_s = Some([0.1, 0.2]);
            }
            let stops = stops(&plan, Some(&world), 0);
            let told: Vec<_> = stops
                .iter()
                .map(|it| (it.what, it.until_s - it.from_s))
                .collect();
            let [("dwell", first_s), ("dwell", last_s)] = told[..] else {
                panic!("{told:?}");
            };
            assert!(
                (first_s - 10.0).abs() < 1e-6 && (last_s - 5.0).abs() < 1e-6,
                "{told:?}"
            );
            world.drones.reverse();
        }
    }

    #[test]
    fn a_place_that_is_held_until_a_time_is_dwelt_at_from_when_the_drone_comes() {
        let text = r#"Scenario(
            name: "one",
            bounds_m: (min: (0, 0, 0), max: (10, 10, 8)),
            drones: [(name: "k4", airframe: "kolibri", start_m: (5, 6, 5), tasks: [(to_m: (6, 6, 5))])],
        )"#;
        let mut world = planner::read_world(text).expect("in order");
        let drone = &mut world.drones[0];
        drone.tasks[0].during_s = Some([5.0, 9.0]);
        let mut home = drone.tasks[0].clone();
        (home.to_m, home.during_s) = (drone.start_m, None);
        drone.tasks.push(home);
        let outcome = planner::plan_world(&world, &planner::Control::QUIET).expect("in order");
        let plan = outcome.into_planned().expect("a plan").plan;
        let stops = stops(&plan, Some(&world), 0);
        let dwell = stops.iter().find(|stop| stop.what == "dwell");
        let &Stop {
            from_s, until_s, ..
        } = dwell.expect("it holds its place");
        assert!(from_s < 5.0 && (until_s - 9.0).abs() < 1e-6, "{stops:?}");
        assert!(stops.iter().all(|stop| stop.what == "dwell"), "{stops:?}");
    }
}
