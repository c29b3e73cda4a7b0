//! Whether a plan is a plan of this scenario: the same place, air and fleet, and all that was asked
//! of it.
//!
//! Places reached, dwells and loads are read from the trajectories alone. A margin may be larger
//! than asked for, and a limit tighter; everything else has to be the same. Places of a formation
//! are those of the drones that are there.

use std::borrow::Cow;

use airflow::Convection;
use nalgebra::Point3;

use super::formations::{NEVER_MS, least_cost};
use crate::plan::cause::as_typed;
use crate::plan::trajectory::{Motion, Piece, SAME_PLACE_M, Tail, Trajectory};
use crate::plan::{AtEnd, DronePlan, Obstacle, Plan, Solid};
use crate::scenario::world::{Drone, PathMotion, Task, World};

/// How near to a task a drone counts as there (m), chosen here: a millimetre, as for bodies.
const THERE_M: f64 = 1e-3;
/// How much shorter a dwell may be (s): rounding of times.
const SHORT_S: f64 = 1e-6;
/// Relative differences up to this are rounding.
const ROUNDING: f64 = 1e-6;

/// What a scenario asks for and a plan does not have, as sentences; empty where it answers the
/// scenario.
pub fn missing(world: &World, plan: &Plan) -> Vec<String> {
    held(world, plan, false)
}

/// The same of a plan that is being flown: since when each drone is known, and which have no path,
/// is as the plan says.
pub fn missing_in_flight(world: &World, plan: &Plan) -> Vec<String> {
    held(world, plan, true)
}

fn held(world: &World, plan: &Plan, in_flight: bool) -> Vec<String> {
    let mut missing = of_place(world, plan);
    // A drone that is being flown may have some of its tasks behind it.
    let drones = match in_flight {
        true => Cow::Borrowed(&world.drones),
        false => Cow::Owned(with_places_assigned(world, plan)),
    };
    for drone in drones.iter() {
        let entry = plan.drone(&drone.name);
        let Some(entry) = entry else {
            missing.push(format!("`{}` is not in the plan", drone.name));
            continue;
        };
        let faults = of_drone(drone, entry, (world, plan, in_flight));
        missing.extend(
            faults
                .into_iter()
                .map(|why| format!("`{}`: {why}", drone.name)),
        );
    }
    let is_asked = |entry: &&DronePlan| world.drones.iter().any(|it| it.name == entry.name);
    let more = plan.drones.iter().filter(|it| !is_asked(it));
    missing.extend(more.map(|it| format!("`{}` is not in the scenario", it.name)));
    missing
}

/// The world's drones, each formation's places assigned to the drones at them in a plan.
fn with_places_assigned(world: &World, plan: &Plan) -> Vec<Drone> {
    let mut drones = world.drones.clone();
    for tasks in &world.formations {
        let found = tasks.iter().map(|(name, task)| {
            let drone = drones.iter().position(|it| it.name == *name)?;
            (*task < drones[drone].tasks.len()).then_some((drone, *task))
        });
        let Some(group) = found.collect::<Option<Vec<(usize, usize)>>>() else {
            continue;
        };
        let places_m: Vec<_> = (group.iter())
            .map(|&(drone, task)| drones[drone].tasks[task].to_m)
            .collect();
        // What each flies, and from when on it is on its way there (s).
        let flown = group.iter().map(|&(drone, task)| {
            let drone = &drones[drone];
            let entry = plan.drone(&drone.name)?;
            let since_s = match task.checked_sub(1) {
                Some(last) => dwells(drone, entry).get(last)?.1,
                None => 0.0,
            };
            Some((trajectory_of(drone, entry)?, since_s))
        });
        let flown: Vec<Option<(Trajectory, f64)>> = flown.collect();
        // When it is done there (ms): it may come to the same places more than once.
        let cost_ms = |k: usize, place: usize| {
            let (drone, task) = group[k];
            let asked = Task {
                to_m: places_m[place],
                ..drones[drone].tasks[task].clone()
            };
            let reached = |it: &(Trajectory, f64)| reached(&it.0, &asked, it.1, None);
            let done = flown[k].as_ref().and_then(reached);
            done.map_or(NEVER_MS, |(_, done_s)| (1e3 * done_s) as i64)
        };
        let row = |k: usize| (0..group.len()).map(|place| cost_ms(k, place)).collect();
        let costs: Vec<Vec<i64>> = (0..group.len()).map(row).collect();
        for (&(drone, task), place) in group.iter().zip(least_cost(&costs)) {
            drones[drone].tasks[task].to_m = places_m[place];
        }
    }
    drones
}

/// Whether two numbers are the same but for rounding.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs()).max(ROUNDING)
}

fn same_place(a: &Point3<f64>, b: &Point3<f64>) -> bool {
    (a - b).norm() <= ROUNDING
}

/// Bounds, obstacles, zones, margins and air.
fn of_place(world: &World, plan: &Plan) -> Vec<String> {
    let mut missing = Vec::new();
    let bounds = [
        (world.bounds_m.min, plan.bounds_m.min),
        (world.bounds_m.max, plan.bounds_m.max),
    ];
    if !bounds.iter().all(|(a, b)| same_place(a, b)) {
        missing.push("the plan has other bounds".to_owned());
    }
    // A log, or a show, does not say.
    if plan.origin.is_some_and(|it| world.origin != Some(it)) {
        missing.push("the plan lies elsewhere on the Earth".to_owned());
    }
    for obstacle in &world.obstacles {
        let named = plan.obstacles.iter().filter(|it| it.name == obstacle.name);
        let mut shapes = named.map(|it| same_shape(&it.shape, &obstacle.shape));
        if !shapes.any(|is_same| is_same) {
            let name = &obstacle.name;
            missing.push(format!(
                "obstacle `{name}` is not in the plan, or has another shape"
            ));
        }
    }
    let is_asked = |it: &&Obstacle| {
        let mut named = world.obstacles.iter().filter(|asked| asked.name == it.name);
        named.any(|asked| same_shape(&it.shape, &asked.shape))
    };
    let more = plan.obstacles.iter().filter(|it| !is_asked(it));
    missing.extend(more.map(|it| {
        let name = &it.name;
        format!("obstacle `{name}` of the plan is not in the scenario, or has another shape")
    }));
    for zone in &world.zones {
        let is_kept = plan.zones.iter().any(|it| {
            let limit = match (zone.air_limit_mps, it.air_limit_mps) {
                (Some(asked), Some(kept)) => kept <= asked * (1.0 + ROUNDING),
                (asked, _) => asked.is_none(),
            };
            let corners = same_place(&it.min_m, &zone.min_m) && same_place(&it.max_m, &zone.max_m);
            it.name == zone.name && corners && limit && (it.keep_out || !zone.keep_out)
        });
        if !is_kept {
            let name = &zone.name;
            missing.push(format!(
                "zone `{name}` is not in the plan, or asks for less there"
            ));
        }
    }
    let (asked, kept) = (world.planning.margins, plan.margins);
    for (what, asked, kept, unit) in [
        ("time_margin_s", asked.time_s, kept.time_s, "s"),
        ("tracking_m", asked.tracking_m, kept.tracking_m, "m"),
    ] {
        if kept < asked * (1.0 - ROUNDING) {
            let [asked, kept] = [asked, kept].map(as_typed);
            missing.push(format!(
                "{what} is {asked} {unit}, the plan has {kept} {unit}"
            ));
        }
    }
    // No rule of the verifier: only compared with what the plan states, if it does.
    let asked_m = world.planning.clearance_m;
    if let Some(kept_m) = plan.clearance_m.filter(|kept_m| !same(asked_m, *kept_m)) {
        missing.push(format!(
            "clearance_m is {} m, the plan has {} m",
            as_typed(asked_m),
            as_typed(kept_m)
        ));
    }
    let density = (world.air.density_kg_per_m3(), plan.air.density_kg_per_m3);
    let jets = [world.jet, plan.air.jet].map(|it| [it.centreline, it.spreading, it.origin]);
    let is_same_air = same(density.0, density.1)
        && (0..3).all(|k| same(jets[0][k], jets[1][k]))
        && world.superposition.as_str() == plan.air.superposition
        && world.effects == plan.air.effects.unwrap_or_default();
    if !is_same_air {
        missing.push("the plan assumes other air".to_owned());
    }
    let lag = |it: Option<Convection>| it.map_or(0.0, Convection::longest_lag);
    let relaxed = world.relaxed();
    let least = relaxed.as_ref().unwrap_or(world).flown();
    let (asked, kept) = (least.convection, plan.convection());
    if lag(kept) < lag(asked) * (1.0 - ROUNDING) {
        let words = |it: Option<Convection>| match it {
            None => "none".to_owned(),
            Some(it) => format!("{}", it.factors()[0]),
        };
        let (asked, kept) = (words(asked), words(kept));
        missing.push(format!(
            "convection is down to {asked} times the centreline's speed, the plan has {kept}"
        ));
    }
    missing
}

fn same_shape(a: &Solid, b: &Solid) -> bool {
    match (a, b) {
        (
            Solid::Box { min_m, max_m },
            Solid::Box {
                min_m: low_m,
                max_m: high_m,
            },
        ) => same_place(min_m, low_m) && same_place(max_m, high_m),
        (
            Solid::Cylinder {
                base_m,
                radius_m,
                height_m,
            },
            Solid::Cylinder {
                base_m: foot_m,
                radius_m: wide_m,
                height_m: tall_m,
            },
        ) => same_place(base_m, foot_m) && same(*radius_m, *wide_m) && same(*height_m, *tall_m),
        (
            Solid::Mesh {
                vertices_m,
                triangles,
                ..
            },
            Solid::Mesh {
                vertices_m: points_m,
                triangles: faces,
                ..
            },
        ) => {
            let mut pairs = vertices_m.iter().zip(points_m);
            let same_points = vertices_m.len() == points_m.len();
            same_points && triangles == faces && pairs.all(|(a, b)| same_place(a, b))
        }
        _ => false,
    }
}

/// The airframe, its limits, both ends and the tasks of one drone.
fn of_drone(
    drone: &Drone,
    entry: &DronePlan,
    (world, plan, in_flight): (&World, &Plan, bool),
) -> Vec<String> {
    let mut missing = Vec::new();
    let (asked, flown) = (&drone.vehicle, &entry.airframe);
    let airframe = &asked.airframe;
    let numbers = [
        (airframe.mass_kg(), flown.mass_kg),
        (
            f64::from(airframe.propellers()),
            f64::from(flown.propellers),
        ),
        (airframe.propeller_diameter_m(), flown.propeller_diameter_m),
        (airframe.motor_distance_m(), flown.motor_distance_m),
        (airframe.width_factor(), flown.width_factor),
    ];
    if !numbers.iter().all(|(a, b)| same(*a, *b)) {
        missing.push(format!(
            "it flies another airframe than `{}`",
            airframe.name()
        ));
    }
    if flown.body_radius_m < asked.body_radius_m * (1.0 - ROUNDING) {
        missing.push("its body is smaller than the scenario's".to_owned());
    }
    let is_limited = entry.airframe.max_descent_mps.is_some() || plan.margins != Default::default();
    let stated = |limit: Option<f64>| limit.unwrap_or(f64::INFINITY);
    let mut limits = vec![
        ("max_speed_mps", asked.max_speed_mps, flown.max_speed_mps),
        ("air_limit", drone.air_limit, entry.air_limit),
    ];
    if is_limited {
        limits.extend([
            (
                "max_climb_mps",
                asked.max_climb_mps,
                stated(flown.max_climb_mps),
            ),
            (
                "max_descent_mps",
                asked.max_descent_mps,
                stated(flown.max_descent_mps),
            ),
            (
                "max_acceleration_mps2",
                asked.max_acceleration_mps2,
                stated(flown.max_acceleration_mps2),
            ),
            (
                "max_jerk_mps3",
                asked.max_jerk_mps3,
                stated(flown.max_jerk_mps3),
            ),
        ]);
    }
    for (what, most, has) in limits {
        if has > most * (1.0 + ROUNDING) {
            missing.push(format!("its {what} is {has}, the scenario's {most}"));
        }
    }
    if entry.at_start != drone.at_start {
        missing.push("it starts in another state".to_owned());
    }
    let first_m = entry.trajectory.position_m.first();
    if first_m.is_none_or(|it| (it - drone.start_m).norm() > THERE_M) {
        missing.push("it starts at another place".to_owned());
    }
    let comes_later = |it: &f64| !in_flight && *it > SHORT_S;
    if let Some(enters_s) = entry.enters_s.filter(comes_later) {
        missing.push(format!(
            "it is there from {enters_s:.2} s on alone (`enters_s`: it comes then, or what it flew \
             before was dropped), in the scenario from 0 s on"
        ));
    }
    let moves = |it: &Point3<f64>| (it - drone.start_m).norm() > THERE_M;
    let flown = &entry.trajectory;
    if world.planning.motion == PathMotion::Smooth
        && !world.planning.relaxable.motion
        && !flown.claims_continuity()
        && (flown.is_smooth() || flown.position_m.iter().any(moves))
    {
        missing.push("it may turn in no time, the scenario's motion is Smooth".to_owned());
    }
    if plan.is_unplanned(&drone.name) {
        missing.extend((!in_flight).then(|| "it is unplanned".to_owned()));
        return missing;
    }
    if entry.at_end != drone.at_end {
        missing.push(format!(
            "it ends as {:?}, not as {:?}",
            entry.at_end, drone.at_end
        ));
    }
    missing.extend(of_tasks(drone, entry));
    missing
}

/// When each task of a drone is reached, and when its dwell ends (s), in order, up to the first
/// that is not reached; loads and due times are not looked at.
pub fn dwells(drone: &Drone, entry: &DronePlan) -> Vec<(f64, f64)> {
    let Some(trajectory) = trajectory_of(drone, entry) else {
        return Vec::new();
    };
    let mut since_s = 0.0;
    let next = |task: &Task| {
        let held = task.during_s.map(|[_, until_s]| [f64::INFINITY, until_s]);
        let task = Task {
            during_s: held,
            ..task.clone()
        };
        let found = reached(&trajectory, &task, since_s, None)?;
        since_s = found.1;
        Some(found)
    };
    drone.tasks.iter().map_while(next).collect()
}

/// What a drone flies, and where it stays afterwards.
fn trajectory_of(drone: &Drone, entry: &DronePlan) -> Option<Trajectory> {
    // What stays after the last time may dwell as long as asked for.
    let longest_s: f64 = drone.tasks.iter().map(|it| it.dwell_s).sum();
    let held = drone.tasks.iter().filter_map(|it| it.during_s);
    let longest_s = held.fold(longest_s, |longest_s, [_, until_s]| longest_s.max(until_s));
    let last_s = entry.trajectory.t_s.last().copied().unwrap_or(0.0);
    let tail = match entry.at_end {
        AtEnd::Hover => Tail::Stays {
            until_s: last_s + longest_s,
        },
        AtEnd::Land | AtEnd::Leave => Tail::Gone,
    };
    Trajectory::new(&entry.trajectory, tail).ok()
}

/// The tasks, in order, each with its dwell and its load, and the time of the last arrival.
fn of_tasks(drone: &Drone, entry: &DronePlan) -> Vec<String> {
    let Some(trajectory) = trajectory_of(drone, entry) else {
        return vec!["its trajectory cannot be read".to_owned()];
    };
    let bare_kg = drone.vehicle.airframe.mass_kg();
    let mut mass_kg = bare_kg;
    let mut since_s = 0.0;
    let mut is_kept = true;
    let mut missing = Vec::new();
    for (k, task) in drone.tasks.iter().enumerate() {
        let number = k + 1;
        let before_kg = mass_kg;
        mass_kg = task.load_kg.map_or(mass_kg, |load_kg| bare_kg + load_kg);
        // A load taken up and changed at once, or taken up as the drone leaves, does not show.
        is_kept = match drone.tasks.get(k + 1) {
            _ if task.dwell_s > 0.0 || task.during_s.is_some_and(|[a, b]| b > a) => true,
            Some(next) => next.to_m != task.to_m || next.load_kg.is_none(),
            None => drone.at_end != AtEnd::Leave,
        };
        let asked_kg = (entry.trajectory.mass_kg.last().filter(|_| is_kept))
            .map(|last_kg| [mass_kg, *last_kg]);
        let Some((from_s, until_s)) = reached(&trajectory, task, since_s, asked_kg) else {
            missing.push(format!(
                "task {number} at ({:.2}, {:.2}, {:.2}) is not reached after {since_s:.2} s, stayed at for {} s{} \
                 and left at {mass_kg:.3} kg",
                task.to_m.x, task.to_m.y, task.to_m.z, as_typed(task.dwell_s),
                task.during_s.map_or(String::new(), |during_s| {
                    let [from_s, until_s] = during_s.map(as_typed);
                    format!(", from {from_s} to {until_s} s,")
                })
            ));
            return missing;
        };
        if let Some(wrong_kg) = other_mass(&trajectory, (since_s, from_s), before_kg) {
            missing.push(format!(
                "on the way to task {number} it weighs {wrong_kg:.3} kg instead of {before_kg:.3} kg"
            ));
        }
        since_s = until_s;
    }
    let after = other_mass(&trajectory, (since_s, f64::INFINITY), mass_kg);
    if let Some(wrong_kg) = after.filter(|_| is_kept) {
        let load = "after its last task it weighs";
        missing.push(format!(
            "{load} {wrong_kg:.3} kg instead of {mass_kg:.3} kg"
        ));
    }
    let tolerance_s = SHORT_S + THERE_M / drone.vehicle.max_speed_mps.min(1.0);
    if !drone.tasks.is_empty() && since_s > entry.arrives_s + tolerance_s {
        let last = "its last dwell ends at";
        missing.push(format!(
            "{last} {since_s:.3} s, after `arrives_s`, {:.3} s",
            entry.arrives_s
        ));
    }
    missing
}

/// The first moment from a time on at which a task's place is reached, the dwell kept and the load
/// taken up, where a mass is asked for, beside that at the end of the path, and the end of that
/// dwell (s).
fn reached(
    trajectory: &Trajectory,
    task: &Task,
    since_s: f64,
    mass_kg: Option<[f64; 2]>,
) -> Option<(f64, f64)> {
    let pieces = trajectory.pieces();
    let from = pieces.partition_point(|it| it.motion.until_s < since_s);
    for (k, piece) in pieces.iter().enumerate().skip(from) {
        let Some(there_s) = there_s(piece, &task.to_m, since_s) else {
            continue;
        };
        // As long as it stays.
        let mut until_s = there_s;
        for next in &pieces[k..] {
            let (begin_s, end_s) = (next.motion.from_s.max(there_s), next.motion.until_s);
            if !stays(&next.motion.during(begin_s, end_s), &task.to_m) {
                break;
            }
            until_s = end_s;
        }
        // It may have stood there before it takes up the load, at last where its path ends.
        let carries = |it: &&Piece| it.motion.until_s > there_s + SHORT_S;
        let later = pieces[k..].iter().filter(carries);
        let later = later.map(|it| (it.motion.from_s.max(there_s), it.mass_kg));
        let last = mass_kg.map(|[_, last_kg]| (trajectory.last_s().max(there_s), last_kg));
        let mut later = (later.chain(last)).take_while(|it| it.0 <= until_s + SHORT_S);
        let loaded_s = match mass_kg {
            Some([asked_kg, _]) => later.find(|it| same(it.1, asked_kg)).map(|it| it.0),
            None => Some(there_s),
        };
        let Some(loaded_s) = loaded_s else {
            continue;
        };
        let (due_s, held_s) = task
            .during_s
            .map_or((f64::INFINITY, 0.0), |[due_s, held_s]| (due_s, held_s));
        let leaves_s = (loaded_s + task.dwell_s).max(held_s);
        if until_s >= leaves_s - SHORT_S && there_s <= due_s + SHORT_S {
            return Some((there_s, leaves_s));
        }
    }
    None
}

/// Whether all of a motion is at a place (m): a straight one is where its ends are, a cubic where
/// the box of its control points is; else its halves decide, down to what counts as one place.
fn stays(motion: &Motion, place_m: &Point3<f64>) -> bool {
    let ends_s = [motion.from_s, motion.until_s];
    let is_there = |t_s: f64| (motion.at_m(t_s) - place_m.coords).norm() <= THERE_M;
    if !ends_s.into_iter().all(is_there) {
        return false;
    }
    let (low_m, high_m) = motion.box_m(motion.from_s, motion.until_s);
    let farthest_m = (place_m.coords - low_m).sup(&(high_m - place_m.coords));
    motion.is_straight()
        || farthest_m.norm() <= THERE_M
        || (high_m - low_m).norm() <= SAME_PLACE_M
        || motion.halves().iter().all(|half| stays(half, place_m))
}

/// When a piece first comes to a place (m), from a time on (s).
fn there_s(piece: &Piece, place_m: &Point3<f64>, since_s: f64) -> Option<f64> {
    let motion = &piece.motion;
    let span_s = (motion.from_s.max(since_s), motion.until_s);
    if span_s.0 > span_s.1 {
        return None;
    }
    let stands = Motion::straight(span_s, *place_m, *place_m);
    let (t_s, apart_m) = motion
        .during(span_s.0, span_s.1)
        .seen_from(&stands)?
        .nearest_to_origin();
    (apart_m <= THERE_M).then_some(t_s)
}

/// A mass other than the one expected between two times (kg), if there is one.
fn other_mass(trajectory: &Trajectory, (from_s, until_s): (f64, f64), mass_kg: f64) -> Option<f64> {
    let pieces = trajectory.pieces().iter();
    let within =
        |it: &&Piece| it.motion.from_s.max(from_s) + SHORT_S < it.motion.until_s.min(until_s);
    let mut wrong = pieces.filter(within).map(|it| it.mass_kg);
    wrong.find(|it| !same(*it, mass_kg))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Control, read_world};

    #[test]
    fn places_of_a_formation_may_be_taken_by_any_of_its_drones_but_not_omitted() {
        let world = |tasks: [&str; 2], formations: &str| {
            let text = format!(
                r#"(name: "h", bounds_m: (min: (0, 0, 0), max: (12, 10, 6)), drones: [
                (name: "a", airframe: "kolibri", start_m: (2, 5, 3), tasks: [{}]),
                (name: "b", airframe: "kolibri", start_m: (2, 2, 3), tasks: [{}])],
                formations: [{formations}])"#,
                tasks[0], tasks[1]
            );
            read_world(&text).expect("in order")
        };
        let typed = world(
            [
                "(to_m: (8, 2, 3), dwell_s: 3), (to_m: (4, 5, 3))",
                "(to_m: (8, 5, 3), dwell_s: 3), (to_m: (4, 2, 3))",
            ],
            "",
        );
        let outcome = crate::plan_world(&typed, &Control::QUIET).expect("in order");
        let plan = outcome.into_planned().expect("a plan").plan;
        let both = "(to_m: [(8, 5, 3), (8, 2, 3)], dwell_s: 3), (to_m: [(4, 5, 3), (4, 2, 3)])";
        assert_eq!(missing(&world([""; 2], both), &plan), [""; 0]);
        let other = "(to_m: [(8, 5, 3), (8, 3, 3)], dwell_s: 3), (to_m: [(4, 5, 3), (4, 2, 3)])";
        let missing = missing(&world([""; 2], other), &plan);
        assert_eq!(missing.len(), 1, "{missing:?}");
        assert!(missing[0].contains("(8.00, 3.00, 3.00) is not reached"));
        // Back to the same places, and not to one's own.
        let again = format!("{both}, (to_m: [(8, 5, 3), (8, 2, 3)], dwell_s: 3)");
        let tasks = |first: [i32; 2]| {
            let at = |x: i32, y: i32| format!("(to_m: ({x}, {y}, 3), dwell_s: 3)");
            let [y, other] = first;
            [at(8, y), at(4, other), at(8, other)].join(", ")
        };
        let [a, b] = [tasks([2, 5]), tasks([5, 2])];
        let typed = world([&a, &b], "");
        let outcome = crate::plan_world(&typed, &Control::QUIET).expect("in order");
        let plan = outcome.into_planned().expect("a plan").plan;
        assert_eq!(super::missing(&world([""; 2], &again), &plan), [""; 0]);
    }

    #[test]
    fn loads_that_are_changed_where_a_drone_stands_already_are_seen() {
        let twice = [
            "(to_m: (5, 5, 2)), (to_m: (5, 5, 2), load_kg: 0.1)",
            "(to_m: (5, 5, 2), load_kg: 0.1, dwell_s: 3), (to_m: (5, 5, 2), load_kg: 0)",
            "(to_m: (5, 5, 2), load_kg: 0.1), (to_m: (5, 5, 2), load_kg: 0.05, dwell_s: 2)",
            "(to_m: (5, 5, 2), load_kg: 0.1, during_s: (9, 12))",
        ];
        for (tasks, planning) in twice
            .iter()
            .flat_map(|it| [(it, ""), (it, "motion: Straight")])
        {
            let text = format!(
                r#"Scenario(name: "load", bounds_m: (min: (0, 0, 0), max: (8, 8, 4)), drones: [
                (name: "x", airframe: "kolibri", start_m: (1, 1, 1), tasks: [{tasks}], at_end: Leave)],
                planning: ({planning}))"#
            );
            let world = read_world(&text).expect("in order");
            let outcome = crate::plan_world(&world, &Control::QUIET).expect("in order");
            let mut plan = outcome.into_planned().expect("a plan").plan;
            assert_eq!(missing(&world, &plan), Vec::<String>::new(), "{text}");
            let masses_kg = &mut plan.drones[0].trajectory.mass_kg;
            let light_kg = masses_kg[0];
            masses_kg.fill(light_kg);
            let is_seen = !tasks.ends_with("load_kg: 0.1)");
            assert!(!is_seen || !missing(&world, &plan).is_empty(), "{text}");
        }
    }
}
