use std::collections::BTreeSet;

use costmap::verdict::Verdict;
use costmap::volumes::conflict_volume::WakeSection;
use costmap::volumes::downwash::Section;
use costmap::volumes::frame::centred;
use costmap::volumes::swept::{Mover, may_meet};
use nalgebra::Point3;
use parry3d::bounding_volume::BoundingVolume;
use parry3d::shape::Ball;

use super::directions::neighbour;
use super::shape::Shape;
use super::steps::DelaySpan;
use super::synchronous::{
    DIRECTIONS, StepDirection, StepInteraction, StepInteractions, SynchronousStep,
};
use super::*;
use crate::graph::passage::Passages;
use crate::scenario::read_world;
use crate::solver::prepare::{Job, prepare};

const HALL: &str = r#"Scenario(
    name: "crowd",
    bounds_m: (min: (0, 0, 0), max: (7, 7, 8)),
    obstacles: [(name: "rack", min_m: (3, 0, 0), max_m: (5, 7, 3))],
    drones: [
        (name: "a", airframe: "offboard-2", start_m: (0.5, 0.5, 4.5), tasks: [(to_m: (6.5, 6.5, 6.5))]),
        (name: "b", airframe: "kolibri", start_m: (6.5, 0.5, 4.5), tasks: [(to_m: (0.5, 6.5, 2.5))]),
    ],
    planning: (motion: Straight, time_margin_s: 0, tracking_m: 0),
)"#;

/// The hall with quasi-static or advected wakes.
fn job(late: bool) -> (Job, Costmap) {
    let air = if late {
        "air: (convection: (0.6, 1.0)),\n"
    } else {
        "air: (convection: None),\n"
    };
    let text = HALL.replace("drones: [", &format!("{air}    drones: ["));
    let world = read_world(&text).expect("in order");
    let job = prepare(&world, &Passages::of(&world), &|| false);
    let costmap = job.costmap(&world, world.drones.len());
    (job, costmap)
}

/// A step of the second drone, half a second long.
fn step(job: &Job, drone: usize, from: [i32; 3], direction: usize, start: u32) -> Option<Leg> {
    let lattice = job.roadmap.lattice();
    let to = [0, 1, 2].map(|axis| from[axis] + cells(direction)[axis]);
    let agent = &job.agents[drone];
    let ticks = agent.mover.step_ticks()[neighbour(direction).unwrap_or_default()];
    Some(Leg {
        drone: agent.drone,
        kind: agent.kinds[0],
        start: Tick(start),
        end: Tick(start + ticks),
        from_m: lattice.position_m(lattice.at(from)?),
        to_m: lattice.position_m(lattice.at(to)?),
        flying: true,
        air_limit: agent.air_limit,
    })
}

fn vertices(job: &Job, leg: &Leg) -> [Vertex; 2] {
    let lattice = job.roadmap.lattice();
    [leg.from_m, leg.to_m].map(|at_m| lattice.place_at(&at_m).expect("on the lattice"))
}

/// Every direction past every other: what the tables let pass, the costmap lets pass.
#[test]
fn no_step_that_the_costmap_forbids_is_free_in_the_crowd() {
    let past = past_one_another(false);
    assert!(past.forbidden > 3000 && past.refuted == 0, "{past:?}");
    assert!(past.too_careful < past.tried / 10, "{past:?}");
}

/// Tables let advected wakes pass up to a greater share of a budget: the costmap, which bounds
/// depth and distance apart, refutes few of these steps.
#[test]
fn few_steps_that_advected_wakes_forbid_are_free_in_the_crowd() {
    let past = past_one_another(true);
    assert!(past.forbidden > 1500, "{past:?}");
    assert!(past.refuted < past.forbidden / 50, "{past:?}");
    assert!(past.too_careful < past.tried / 10, "{past:?}");
}

/// What became of steps past others.
#[derive(Debug, Default)]
struct Past {
    tried: usize,
    /// By the costmap.
    forbidden: usize,
    /// Free in the tables, but not by the costmap.
    refuted: usize,
    /// The other way round: the rest of a budget is kept for wakes farther off.
    too_careful: usize,
}

fn past_one_another(late: bool) -> Past {
    let (job, empty) = job(late);
    let steps = Steps::new(job.roadmap.lattice(), &job.agents, &empty).expect("a small fleet");
    let mut past = Past::default();
    for case in 0..27 * 27 {
        let (direction, others) = (case % 27, case / 27);
        let Some(other) = step(&job, 1, [3, 3, 4], others, 200) else {
            continue;
        };
        let mut costmap = empty.clone();
        costmap.insert(vec![other]);
        let reservations = ReservationTable::new(&steps, &costmap, &[]);
        for offset in 0..60 {
            let from = [
                2 + offset % 3,
                2 + offset / 3 % 3,
                (1 + 2 * (offset / 9)).min(7),
            ];
            let spread = if late { 400 } else { 140 };
            let start = (130 + (case as u32 * 37 + offset as u32 * 11) % spread).max(1);
            let Some(leg) = step(&job, 0, from, direction, start) else {
                continue;
            };
            let mut exact = Verdict::default();
            costmap.judge(&leg, &mut exact);
            let query = StepQuery {
                by: reservations.querier(leg.drone, leg.kind).expect("known"),
                ends: vertices(&job, &leg),
                time: [leg.start, leg.end],
                early: 0,
                late: 0,
            };
            let mut brief = Verdict::default();
            let mut is_free = reservations.step(&costmap, &query, &mut brief);
            if direction == STILL {
                reservations.stay(query.by, query.ends[0], query.time, &mut brief);
                is_free = true;
            }
            let allows = is_free && brief.blockers.is_empty();
            let is_forbidden = !exact.is_allowed();
            assert!(
                late || !(is_forbidden && allows),
                "{direction} past {others} from {from:?} at {start}: {exact:?}"
            );
            past.forbidden += usize::from(is_forbidden);
            past.refuted += usize::from(is_forbidden && allows);
            past.too_careful += usize::from(!is_forbidden && !brief.blockers.is_empty());
            past.tried += 1;
        }
    }
    past
}

/// No drone blocks a step once its departures are said to be clear.
#[test]
fn a_step_is_free_when_it_departs_after_all_are_clear() {
    for late in [false, true] {
        free_when_clear(late);
    }
}

fn free_when_clear(late: bool) {
    let (job, empty) = job(late);
    let steps = Steps::new(job.roadmap.lattice(), &job.agents, &empty).expect("a small fleet");
    let mut met = 0;
    for case in 0..26 * 26 {
        let direction = |index: usize| index + usize::from(index >= STILL);
        let (direction, others) = (direction(case % 26), direction(case / 26));
        let other = step(&job, 1, [3, 3, 4], others, 200).expect("inside");
        let mut costmap = empty.clone();
        costmap.insert(vec![other]);
        let reservations = ReservationTable::new(&steps, &costmap, &[]);
        for z in [3, 4, 6] {
            let leg = step(&job, 0, [3, 3, z], direction, 210).expect("inside");
            let ask = |departs: u32| {
                let mut verdict = Verdict::default();
                let query = StepQuery {
                    by: reservations.querier(leg.drone, leg.kind).expect("known"),
                    ends: vertices(&job, &leg),
                    time: [Tick(departs), Tick(departs + leg.end.0 - leg.start.0)],
                    early: 0,
                    late: 0,
                };
                reservations.step(&costmap, &query, &mut verdict);
                verdict.blockers
            };
            if let Some(blocker) = ask(210).first() {
                met += 1;
                assert!(blocker.began < Tick(210) && Tick(210) < blocker.clear);
                assert_eq!(ask(blocker.clear.0), []);
                assert_eq!(ask(blocker.began.0), []);
            }
        }
    }
    assert!(met > 500, "{met}");
}

#[test]
fn a_removed_drone_leaves_nothing_in_the_tables() {
    let (job, mut costmap) = job(true);
    let steps = Steps::new(job.roadmap.lattice(), &job.agents, &costmap).expect("a small fleet");
    let first = step(&job, 0, [3, 3, 4], 14, 0).expect("inside");
    let second = step(&job, 1, [3, 4, 6], 22, 30).expect("inside");
    let hover = Leg {
        start: second.end,
        end: Tick::FOREVER,
        from_m: second.to_m,
        ..second
    };
    costmap.insert(vec![first]);
    let before = ReservationTable::new(&steps, &costmap, &[]);
    costmap.insert(vec![second, hover]);
    let mut reservations = before.clone();
    reservations.insert(costmap.legs(second.drone));
    let place = job
        .roadmap
        .lattice()
        .place_at(&hover.to_m)
        .expect("a place");
    let below = job.roadmap.lattice().at([3, 4, 6]).expect("a place");
    let class = reservations.class(first.drone, first.kind).expect("known");
    assert_eq!(reservations.closed_from(class)[place as usize], hover.start);
    assert_ne!(reservations.unsafe_intervals, before.unsafe_intervals);
    assert!(reservations.closed_from(class)[below as usize] <= hover.start);
    let hovers = |drone, kind| {
        let mut verdict = Verdict::default();
        let by = reservations.querier(drone, kind).expect("known");
        reservations.stay(by, place, [hover.start, Tick::FOREVER], &mut verdict);
        let until = reservations.free_until(by, place, hover.start, |_| false).0;
        (verdict.blockers.len(), until)
    };
    assert_eq!(hovers(first.drone, first.kind), (1, hover.start));
    assert_eq!(hovers(second.drone, second.kind), (0, Tick::FOREVER));
    reservations.remove(costmap.legs(second.drone));
    assert_eq!(reservations.columns, before.columns);
    assert_eq!(reservations.occupancy_masks, before.occupancy_masks);
    assert_eq!(reservations.unsafe_intervals, before.unsafe_intervals);
    assert_eq!(reservations.closed, before.closed);
}

/// A body or a point that moves straight (cells).
fn moves(ball: &Ball, [from, to]: [Point3<f64>; 2]) -> Mover<'_> {
    Mover::new(ball, centred(from), to - from)
}

/// Touching is not meeting: a little within the outward margins of both.
const INWARD: f64 = 4e-6;

/// Whether two bodies meet on straight paths flown in the same time (cells); swept, by parry.
fn bodies_meet(shape: &Shape, paths: [[Point3<f64>; 2]; 2]) -> bool {
    let balls = [0.0, shape.conflict_volume.body_radius() - INWARD].map(Ball::new);
    let (a, b) = (moves(&balls[0], paths[0]), moves(&balls[1], paths[1]));
    a.aabb().intersects(&b.aabb()) && may_meet(&a, &b)
}

/// Whether a drone's centre meets what hangs below another on straight paths flown in the same time
/// (cells); swept, by parry.
fn meets(wake_section: &WakeSection, paths: [[Point3<f64>; 2]; 2]) -> bool {
    let section = &wake_section.section;
    // What lies above hangs below the first.
    let is_below = !wake_section.is_above;
    let [from_depth, to_depth] = if is_below {
        [section.from_depth_m, section.to_depth_m]
    } else {
        [-section.to_depth_m, -section.from_depth_m]
    };
    let mut radii = [section.from_radius_m, section.to_radius_m].map(|it| it - INWARD);
    if !is_below {
        radii.reverse();
    }
    let [[from, to], others] = if is_below {
        [paths[1], paths[0]]
    } else {
        paths
    };
    let section = Section {
        from_depth_m: from_depth + INWARD,
        to_depth_m: to_depth,
        from_radius_m: radii[0],
        to_radius_m: radii[1],
    };
    let placed = section.placed_below(from).expect("a frustum");
    let wake = Mover::new(&placed.frustum, placed.pose, to - from);
    let ball = Ball::new(0.0);
    let point = moves(&ball, others);
    point.aabb().intersects(&wake.aabb()) && may_meet(&point, &wake)
}

/// Each interval of the tables holds the delays at which parry finds the swept volumes of two steps
/// to meet, and all of them together are hardly longer.
#[test]
fn the_tables_are_the_swept_volumes_sampled() {
    tables_are_volumes(false);
}

/// The same with air that is under way for any time up to its longest: each delay at which volumes
/// meet at once, and all those after or before it by no more than that.
#[test]
fn the_tables_of_advected_wakes_are_the_swept_volumes_sampled_and_delayed() {
    tables_are_volumes(true);
}

/// What is left out of the columns beside a step forbids nothing, costs nothing and brings no load.
#[test]
fn columns_that_are_not_looked_at_hold_nothing() {
    let mut skipped = 0;
    for late in [false, true] {
        let (job, empty) = job(late);
        let steps = Steps::new(job.roadmap.lattice(), &job.agents, &empty).expect("a small fleet");
        let classes = 0..steps.class_count();
        let pairs = classes
            .clone()
            .flat_map(|me| classes.clone().map(move |other| (me, other)));
        for (me, other) in pairs {
            let table = steps.table(me, other);
            let aside = -table.shape.extent.reach..=table.shape.extent.reach;
            let columns = aside
                .clone()
                .flat_map(|x| aside.clone().map(move |y| [x, y]));
            for (direction, column) in
                (0..27).flat_map(|it| columns.clone().map(move |at| (it, at)))
            {
                let holds = |others: usize| {
                    let spans = table.shape.spans(direction, others, column);
                    spans.iter().any(|span| *span != DelaySpan::default())
                };
                if table
                    .near(direction)
                    .iter()
                    .all(|near| near.aside != column)
                {
                    skipped += 1;
                    let held = (0..27).find(|others| holds(*others));
                    assert_eq!(held, None, "{direction} {column:?}");
                }
                if table
                    .near_still(direction)
                    .iter()
                    .all(|near| near.aside != column)
                {
                    assert!(!holds(STILL), "{direction} {column:?}");
                }
            }
        }
    }
    assert!(skipped > 500, "{skipped}");
}

fn tables_are_volumes(late: bool) {
    let (job, empty) = job(late);
    let steps = Steps::new(job.roadmap.lattice(), &job.agents, &empty).expect("a small fleet");
    let (mut of_tables, mut of_volumes) = (0.0, 0.0);
    for (index, shape) in steps.shapes().enumerate() {
        for case in 0..400_usize {
            // Even cover of pairs of directions, columns and layers.
            let number = (4 * case + index) as f64;
            let pick = |step: f64, of: i32| ((number * step).fract() * f64::from(of)) as i32;
            let wide = 2 * shape.extent.reach + 1;
            let directions =
                [0.819_172_513_396, 0.671_043_606_704].map(|step| pick(step, 27) as usize);
            let [x, y] =
                [0.549_700_477_902, 0.450_318_4].map(|step| pick(step, wide) - shape.extent.reach);
            let layer = pick(0.368_912_3, 2 * shape.extent.layers + 1) - shape.extent.layers;
            let ticks = [
                shape.me.ticks(directions[0]),
                shape.other.ticks(directions[1]),
            ];
            let still = directions.map(|direction| direction == STILL);
            if still == [true; 2] {
                continue;
            }
            let relative = shape.relative(directions, [x, y]);
            let [from, to] = shape
                .forbidden(&relative, directions, layer)
                .unwrap_or_default();
            of_tables += to - from;
            let span = shape.spans(directions[0], directions[1], [x, y])
                [(layer + shape.extent.layers) as usize];
            let place = |side: usize, at: f64| {
                let from = [[0; 3], [x, y, layer]][side];
                let by = cells(directions[side]).map(f64::from);
                Point3::from(
                    [0, 1, 2].map(|axis| f64::from(from[axis]) + by[axis] * at / ticks[side]),
                )
            };
            let depths = relative.raised(-f64::from(layer)).depths();
            // How far each kind of meeting reaches before and after, by delay of the first.
            let wake_sections = shape.conflict_volume.wake_sections().iter();
            let wake_sections: Vec<(&WakeSection, [i32; 2])> = wake_sections
                .map(|it| {
                    (
                        it,
                        it.lasts(depths, &shape.delays).map(|ticks| ticks as i32),
                    )
                })
                .collect();
            let first = if still[0] { 0 } else { -ticks[0] as i32 };
            let last = if still[1] { 0 } else { ticks[1] as i32 };
            let mut delays: BTreeSet<i32> = BTreeSet::new();
            for delay in first + 1..last {
                // For a still drone the table says when in its step the other is too near.
                let time = match still {
                    [true, _] => [f64::from(delay); 2],
                    [_, true] => [-f64::from(delay); 2],
                    _ => {
                        let begins = f64::from(delay);
                        [begins.max(0.0), ticks[1].min(begins + ticks[0])]
                    }
                };
                let begins = if still == [false; 2] {
                    f64::from(delay)
                } else {
                    0.0
                };
                let paths = [
                    time.map(|at| place(0, at - begins)),
                    time.map(|at| place(1, at)),
                ];
                if bodies_meet(shape, paths) {
                    delays.insert(delay);
                }
                for (it, [before, after]) in &wake_sections {
                    if meets(it, paths) {
                        delays.extend(delay - before..=delay + after);
                    }
                }
            }
            of_volumes += delays.len() as f64;
            for delay in delays {
                let delay = if still[1] { -delay } else { delay };
                let held = i32::from(span.from) < delay && delay < i32::from(span.to);
                assert!(
                    held,
                    "{directions:?}, {x} {y} {layer}, {delay} ticks: {span:?}"
                );
            }
        }
    }
    println!("{of_tables:.0} ticks in tables, {of_volumes:.0} in volumes");
    assert!(of_volumes > 10_000.0 && of_tables < 1.02 * of_volumes);
}

/// Two drones on two steps each, as the tables allow them: whatever the clocks are apart within the
/// time margins, neither is where the other keeps it out of.
#[test]
fn steps_together_keep_apart_where_one_is_early_and_the_other_late() {
    let text = HALL
        .replace("time_margin_s: 0, tracking_m: 0", "")
        .replace(r#"(name: "rack", min_m: (3, 0, 0), max_m: (5, 7, 3))"#, "");
    let world = read_world(&text).expect("in order");
    let world = world.relaxed().expect("it leaves the air open");
    let job = prepare(&world, &Passages::of(&world), &|| false);
    let empty = job.costmap(&world, world.drones.len());
    let steps = Steps::new(job.roadmap.lattice(), &job.agents, &empty).expect("a small fleet");
    let together = StepInteractions::new(&steps, 50);
    let apart = f64::from(steps.shift) / f64::from(together.ticks);
    assert!(apart > 0.1, "{apart}");
    let (mut allowed, mut around_corners) = (0, 0);
    for case in 0..6_000 {
        let number = f64::from(case);
        let pick = |step: f64, of: i32| ((number * step).fract() * f64::from(of)) as i32;
        let courses = [
            0.819_172_513_396,
            0.671_043_606_704,
            0.549_700_477_902,
            0.450_318_4,
        ]
        .map(|step| pick(step, DIRECTIONS.len() as i32) as usize);
        let offset = [0.368_912_3, 0.301_727_1, 0.247_013_7].map(|step| pick(step, 5) - 2);
        let classes = [0.202_141, 0.165_411].map(|step| pick(step, steps.class_count() as i32));
        // Each where it is between its two steps.
        let at = [[10; 3], offset.map(|steps| 10 + steps)];
        let synchronous_step = |drone: usize, step: usize| {
            let (before, now) = (courses[2 * drone], courses[2 * drone + 1]);
            let (at, previous_direction) = (at[drone], StepDirection::Axis(before));
            let back = [0, 1, 2].map(|axis| at[axis] - DIRECTIONS[before][axis]);
            SynchronousStep {
                class: classes[drone] as usize,
                at: [back, at][step],
                direction: [previous_direction, StepDirection::Axis(now)][step],
                previous_direction: [StepDirection::STAY, previous_direction][step],
            }
        };
        let is_allowed = |step: usize| {
            matches!(
                together.meet(&synchronous_step(0, step), &synchronous_step(1, step)),
                StepInteraction::Loads(_)
            )
        };
        if !is_allowed(0) || !is_allowed(1) {
            continue;
        }
        allowed += 1;
        let [a, b] = [courses[1], courses[3]].map(|course| DIRECTIONS[course]);
        let turns = a != b && a != b.map(|steps| -steps) && a != [0; 3] && b != [0; 3];
        around_corners += i32::from(turns && offset == a);
        let place = |drone: usize, clock: f64| {
            let steps = [courses[2 * drone], courses[2 * drone + 1]].map(|it| DIRECTIONS[it]);
            let parts = [clock.clamp(0.0, 1.0) - 1.0, (clock - 1.0).clamp(0.0, 1.0)];
            [0, 1, 2].map(|axis| {
                let moved = [0, 1].map(|step| f64::from(steps[step][axis]) * parts[step]);
                f64::from(at[drone][axis]) + moved[0] + moved[1]
            })
        };
        let conflict_volume = &steps
            .shape(classes[0] as usize, classes[1] as usize)
            .conflict_volume;
        for moment in 0..=40 {
            for shift in -2..=2 {
                let clock = f64::from(moment) / 20.0;
                let clocks = [clock, clock + apart * f64::from(shift) / 2.0];
                let [one, other] = [0, 1].map(|drone| place(drone, clocks[drone]));
                let [x, y, z] = [0, 1, 2].map(|axis| one[axis] - other[axis]);
                let room = x.hypot(y).hypot(z) - conflict_volume.body_radius();
                assert!(room > -1e-6, "{courses:?} {offset:?} {clocks:?}: {room}");
                for section in conflict_volume.wake_sections().iter().map(|it| it.section) {
                    let depth = -z;
                    let inside = section.from_depth_m + 1e-6..section.to_depth_m - 1e-6;
                    let radius = section.radius_m(depth).unwrap_or(0.0);
                    let is_in = inside.contains(&depth) && x.hypot(y) < radius - 1e-6;
                    assert!(!is_in, "{courses:?} {offset:?} {clocks:?}");
                }
            }
        }
    }
    assert!(
        allowed > 1_000 && around_corners > 0,
        "{allowed} {around_corners}"
    );
}
