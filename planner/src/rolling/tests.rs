//! What a running plan promises, in a hall of its own.

use std::collections::BTreeSet;

use nalgebra::Point3;

use super::*;
use crate::outcome::Outcome;
use crate::plan::{AtEnd, DronePlan};
use crate::scenario::read_world;
use crate::world::{AtStart, Drone, Task};

fn hall(drones: usize) -> (World, Plan) {
    planned(&crate::instances::hall(drones, 1).expect("the hall has room"))
}

fn planned(text: &str) -> (World, Plan) {
    let world = read_world(text, &|file| Err(format!("there is no {file}"))).expect("in order");
    let Outcome::Planned { plan, .. } = crate::plan_world(&world, &Control::QUIET) else {
        panic!("no plan");
    };
    assert!(plan.violations.is_empty() && plan.unplanned.is_empty());
    (world, plan)
}

fn task(x: f64, y: f64, z: f64) -> Task {
    Task {
        to_m: Point3::new(x, y, z),
        dwell_s: 1.0,
        load_kg: None,
    }
}

fn late(drone: &str, by_s: f64) -> Change {
    Change::Late {
        drone: drone.to_owned(),
        by_s,
    }
}

fn retasked(drone: &str, tasks: Vec<Task>) -> Change {
    Change::Retasked {
        drone: drone.to_owned(),
        tasks,
    }
}

fn removed(drone: &str) -> Change {
    Change::Removed {
        drone: drone.to_owned(),
    }
}

fn another(world: &World, name: &str, at_m: [f64; 3], to: Task) -> Change {
    Change::Added(Drone {
        name: name.to_owned(),
        start_m: at_m.into(),
        at_start: AtStart::Hover,
        tasks: vec![to],
        ..world.drones[0].clone()
    })
}

/// A place in a column that nobody starts or ends in.
fn free_column(plan: &Plan, nth: usize) -> [f64; 2] {
    let taken: BTreeSet<[i64; 2]> = plan
        .drones
        .iter()
        .flat_map(|drone| {
            let at = &drone.trajectory.position_m;
            [at[0], at[at.len() - 1]]
        })
        .map(|p| [p.x.floor() as i64, p.y.floor() as i64])
        .collect();
    let all = (0..4096).map(|cell: i64| [(cell * 37) % 64, (cell * 37) / 64 % 64]);
    let free = all.filter(|column| !taken.contains(column)).nth(nth * 29);
    free.expect("free columns").map(|cell| cell as f64 + 0.5)
}

fn sound(running: &Running) {
    let plan = running.plan();
    assert!(plan.violations.is_empty(), "{:#?}", plan.violations);
    assert_eq!(verify(plan).violations, []);
}

fn others_keep_theirs(before: &Plan, after: &Plan, told: &Replanned) {
    for (old, new) in before.drones.iter().zip(&after.drones) {
        if told.changed.iter().all(|changed| changed.drone != old.name) {
            assert_eq!(old.trajectory, new.trajectory, "{}", old.name);
            assert_eq!(
                (old.airborne_s, old.arrives_s),
                (new.airborne_s, new.arrives_s)
            );
        }
    }
}

fn history_is_kept(old: &DronePlan, new: &DronePlan, until_s: f64) {
    for step in 0..=20 {
        let at_s = until_s * f64::from(step) / 20.0;
        let place = |drone: &DronePlan| drone.trajectory.position_m(at_s).expect("it is there");
        assert!(
            (place(old) - place(new)).norm() < 1e-9,
            "{} at {at_s} s",
            old.name
        );
    }
}

fn find<'a>(plan: &'a Plan, name: &str) -> &'a DronePlan {
    plan.drones
        .iter()
        .find(|drone| drone.name == name)
        .expect("in the plan")
}

fn ten_changes(world: &World, plan: &Plan) -> Vec<Change> {
    let to = |nth: usize| {
        let [x, y] = free_column(plan, nth);
        task(x, y, 3.5)
    };
    let at = |nth: usize| {
        let [x, y] = free_column(plan, nth);
        [x, y, 6.5]
    };
    vec![
        late("d1", 2.0),
        late("d2", 0.7),
        late("d3", 1.3),
        retasked("d4", vec![to(1)]),
        retasked("d5", vec![to(2), to(3)]),
        retasked("d6", Vec::new()),
        removed("d7"),
        removed("d8"),
        another(world, "new-1", at(4), to(5)),
        another(world, "new-2", at(6), to(7)),
    ]
}

#[test]
fn only_those_affected_change_and_the_whole_is_verified() {
    let (world, plan) = hall(60);
    let changes = ten_changes(&world, &plan);
    let (running, told) = replan(&world, &plan, 6.0, &changes, &Control::QUIET).expect("in order");
    assert_eq!(told.refused, []);
    assert_eq!(told.unavoidable, []);
    sound(&running);
    others_keep_theirs(&plan, running.plan(), &told);
    assert!(told.changed.len() < 20, "{:?}", told.changed);
    for name in ["d4", "d5", "d6", "d7"] {
        history_is_kept(find(&plan, name), find(running.plan(), name), 6.0);
    }
}

#[test]
fn a_drone_given_another_task_ends_there() {
    let (world, plan) = hall(20);
    let [x, y] = free_column(&plan, 3);
    let change = retasked("d2", vec![task(x, y, 2.5)]);
    let (running, told) = replan(&world, &plan, 4.0, &[change], &Control::QUIET).expect("in order");
    sound(&running);
    let drone = find(running.plan(), "d2");
    let last_m = drone.trajectory.position_m.last().expect("it flies");
    assert_eq!(*last_m, Point3::new(x, y, 2.5));
    assert!(drone.arrives_s >= drone.alone_s);
    assert_eq!(told.changed[0].cause, Cause::Retasked);
    history_is_kept(find(&plan, "d2"), drone, 4.0);
}

#[test]
fn a_late_drone_stands_where_it_was_and_goes_on_from_there() {
    let (world, plan) = hall(20);
    let (running, told) =
        replan(&world, &plan, 4.0, &[late("d3", 1.5)], &Control::QUIET).expect("in order");
    sound(&running);
    let (old, new) = (find(&plan, "d3"), find(running.plan(), "d3"));
    history_is_kept(old, new, 2.5);
    let place = |drone: &DronePlan, at_s: f64| drone.trajectory.position_m(at_s).expect("there");
    assert_eq!(place(new, 4.0), place(old, 2.5));
    assert!(new.arrives_s >= old.arrives_s + 1.0);
    assert_eq!(told.changed[0].cause, Cause::Late);
}

#[test]
fn a_drone_that_comes_is_nowhere_before() {
    let (world, plan) = hall(20);
    let [x, y] = free_column(&plan, 2);
    let [u, v] = free_column(&plan, 5);
    let change = another(&world, "new", [x, y, 5.5], task(u, v, 1.5));
    let (running, told) = replan(&world, &plan, 5.0, &[change], &Control::QUIET).expect("in order");
    sound(&running);
    let new = find(running.plan(), "new");
    assert_eq!(new.enters_s, Some(5.0));
    assert_eq!(new.trajectory.t_s[0], 5.0);
    assert_eq!(told.changed.last().expect("it changed").cause, Cause::Added);
    // Where it comes from somebody else may have been before.
    let mut shared = running.plan().clone();
    let index = shared.drones.len() - 1;
    shared.drones[0].trajectory.position_m[0] = Point3::new(x, y, 5.5);
    shared.drones[0].trajectory.t_s = vec![0.0];
    shared.drones[0].trajectory.position_m.truncate(1);
    shared.drones[0].trajectory.mass_kg.truncate(1);
    shared.drones[0].at_end = AtEnd::Leave;
    shared.drones[0].airborne_s = (0.0, Some(0.0));
    assert_eq!(
        verify(&shared).violations,
        [],
        "{}",
        shared.drones[index].name
    );
}

#[test]
fn a_drone_taken_out_is_gone() {
    let (world, plan) = hall(20);
    let (running, _) =
        replan(&world, &plan, 5.0, &[removed("d4")], &Control::QUIET).expect("in order");
    sound(&running);
    let gone = find(running.plan(), "d4");
    assert_eq!(
        (gone.at_end, gone.trajectory.t_s.last()),
        (AtEnd::Leave, Some(&5.0))
    );
    history_is_kept(find(&plan, "d4"), gone, 5.0);
}

#[test]
fn a_replan_of_a_replan_of_a_replan_is_sound() {
    let (world, plan) = hall(40);
    let mut running = Running::new(world.clone(), plan.clone()).expect("its plan");
    let changes = ten_changes(&world, &plan);
    for (turn, some) in changes.chunks(3).enumerate() {
        let before = running.plan().clone();
        let at_s = 2.0 + 1.37 * turn as f64;
        let told = running
            .replan(at_s, some, &Control::QUIET)
            .expect("in order");
        assert_eq!(told.refused, []);
        sound(&running);
        others_keep_theirs(&before, running.plan(), &told);
    }
    // The same drones again, who have been changed already.
    let [x, y] = free_column(running.plan(), 9);
    let again = [
        late("d1", 1.0),
        retasked("new-1", vec![task(x, y, 4.5)]),
        removed("d5"),
    ];
    running
        .replan(9.0, &again, &Control::QUIET)
        .expect("in order");
    sound(&running);
    // A plan that was changed is a plan like any other.
    let taken_over = Running::new(running.world().clone(), running.plan().clone());
    let mut taken_over = taken_over.expect("its plan");
    taken_over
        .replan(10.0, &[late("d9", 0.5)], &Control::QUIET)
        .expect("in order");
    sound(&taken_over);
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let (world, plan) = hall(60);
    let changes = ten_changes(&world, &plan);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| {
            let told = replan(&world, &plan, 6.0, &changes, &Control::QUIET);
            let (running, told) = told.expect("in order");
            (
                serde_json::to_string(running.plan()).expect("plain data"),
                told,
            )
        })
    };
    assert_eq!(on(1), on(4));
}

#[test]
fn whoever_is_in_the_way_gives_way() {
    // `b` waits for nobody: its goal is where `a` is told to hover for a while.
    let (world, plan) = planned(
        r#"Scenario(name: "corridor", bounds_m: (min: (0, 0, 0), max: (24, 5, 3)),
          drones: [
            (name: "a", airframe: "kolibri", start_m: (2.5, 1.5, 1.5), tasks: [(to_m: (20.5, 1.5, 1.5))]),
            (name: "b", airframe: "kolibri", start_m: (21.5, 3.5, 1.5), tasks: [(to_m: (3.5, 3.5, 1.5))]),
          ])"#,
    );
    let change = retasked(
        "a",
        vec![
            Task {
                dwell_s: 600.0,
                ..task(3.5, 3.5, 1.5)
            },
            task(20.5, 1.5, 1.5),
        ],
    );
    let (running, told) = replan(&world, &plan, 2.0, &[change], &Control::QUIET).expect("in order");
    sound(&running);
    // Either has to wait for the other, and it is not the one that nobody asked.
    assert_eq!(told.refused.len() + told.changed.len(), 1, "{told:#?}");
    assert_eq!(
        find(running.plan(), "b").trajectory,
        find(&plan, "b").trajectory
    );
}

#[test]
fn a_late_drone_that_is_in_conflict_already_is_told_of() {
    // `b` follows `a` at a distance; `a` stops, and `b` is in its body before it can stop.
    let (world, plan) = planned(
        r#"Scenario(name: "behind", bounds_m: (min: (0, 0, 0), max: (24, 1, 1)),
          drones: [
            (name: "a", airframe: "kolibri", start_m: (1.5, 0.5, 0.5), tasks: [(to_m: (22.5, 0.5, 0.5))]),
            (name: "b", airframe: "kolibri", start_m: (0.5, 0.5, 0.5), tasks: [(to_m: (20.5, 0.5, 0.5))]),
          ])"#,
    );
    let (running, told) =
        replan(&world, &plan, 4.25, &[late("a", 1.0)], &Control::QUIET).expect("in order");
    assert!(!told.unavoidable.is_empty());
    assert_eq!(running.plan().violations, told.unavoidable);
}

#[test]
fn whoever_finds_no_way_goes_on_with_what_it_had() {
    let (world, plan) = hall(20);
    let goal = find(&plan, "d2")
        .trajectory
        .position_m
        .last()
        .copied()
        .expect("it flies");
    let change = retasked(
        "d1",
        vec![Task {
            dwell_s: 0.0,
            ..task(goal.x, goal.y, goal.z)
        }],
    );
    let (running, told) =
        replan(&world, &plan, 30.0, &[change], &Control::QUIET).expect("in order");
    assert_eq!(told.refused[0].name, "d1");
    assert_eq!(told.changed, []);
    assert_eq!(
        find(running.plan(), "d1").trajectory,
        find(&plan, "d1").trajectory
    );
    sound(&running);
}

#[test]
fn whoever_comes_and_finds_no_way_is_not_let_in() {
    let (world, plan) = hall(20);
    let goal = |name: &str| {
        find(&plan, name)
            .trajectory
            .position_m
            .last()
            .copied()
            .expect("it flies")
    };
    let taken = goal("d2");
    let [x, y] = free_column(&plan, 1);
    let [u, v] = free_column(&plan, 4);
    let changes = [
        another(
            &world,
            "shut-out",
            [x, y, 6.5],
            task(taken.x, taken.y, taken.z),
        ),
        another(&world, "let-in", [u, v, 6.5], task(u, v, 2.5)),
        retasked("d5", vec![task(x, y, 3.5)]),
    ];
    let (running, told) = replan(&world, &plan, 30.0, &changes, &Control::QUIET).expect("in order");
    assert_eq!(told.refused.len(), 1, "{told:#?}");
    assert_eq!(told.refused[0].name, "shut-out");
    assert!(
        running
            .plan()
            .drones
            .iter()
            .all(|drone| drone.name != "shut-out")
    );
    assert_eq!(running.plan().drones.len(), running.world().drones.len());
    assert_eq!(find(running.plan(), "let-in").enters_s, Some(30.0));
    sound(&running);
}

#[test]
fn all_that_is_wrong_is_said_and_nothing_changes() {
    let (world, plan) = hall(10);
    let mut running = Running::new(world.clone(), plan.clone()).expect("its plan");
    let changes = [
        late("nobody", 1.0),
        late("d1", f64::NAN),
        removed("d1"),
        retasked("d2", vec![task(99.0, 1.5, 1.5)]),
        another(&world, "d3", [1.5, 1.5, 1.5], task(2.5, 2.5, 2.5)),
    ];
    let errors = running
        .replan(3.0, &changes, &Control::QUIET)
        .expect_err("five mistakes");
    assert_eq!(errors.len(), 5, "{errors:#?}");
    assert_eq!(*running.plan(), plan);
    assert!(running.replan(f64::INFINITY, &[], &Control::QUIET).is_err());
    running
        .replan(3.0, &[], &Control::QUIET)
        .expect("nothing to do");
    assert!(running.replan(2.0, &[], &Control::QUIET).is_err());
}

#[test]
fn loads_landings_and_grounded_drones_go_on_as_they_are() {
    let (world, plan) = planned(
        r#"Scenario(name: "yard", bounds_m: (min: (0, 0, 0), max: (20, 14, 6)),
          drones: [
            (name: "carrier", airframe: "matrice-300", start_m: (2.5, 2.5, 3.5), at_end: Land,
             tasks: [(to_m: (8.5, 2.5, 3.5), dwell_s: 3, load_kg: 1.0), (to_m: (16.5, 2.5, 3.5), dwell_s: 2, load_kg: 0)]),
            (name: "sleeper", airframe: "kolibri", start_m: (4.5, 11.5, 0.1), at_start: Landed,
             tasks: [(to_m: (15.5, 11.5, 2.5))]),
            (name: "leaver", airframe: "kolibri", start_m: (2.5, 8.5, 2.5), at_end: Leave, tasks: [(to_m: (6.5, 8.5, 2.5))]),
          ])"#,
    );
    let mut running = Running::new(world, plan.clone()).expect("its plan");
    // Between its tasks it carries a kilogram, and goes on carrying it where it is sent instead.
    let carried = find(&plan, "carrier").clone();
    let loaded_s = carried.trajectory.t_s[carried
        .trajectory
        .mass_kg
        .iter()
        .position(|kg| *kg > 6.5)
        .unwrap_or(0)];
    let at_s = loaded_s + 4.5;
    let send = retasked("carrier", vec![task(12.5, 5.5, 3.5)]);
    running
        .replan(at_s, &[send, late("sleeper", 0.5)], &Control::QUIET)
        .expect("in order");
    sound(&running);
    let carrier = find(running.plan(), "carrier");
    let last_kg = carrier
        .trajectory
        .mass_kg
        .last()
        .copied()
        .expect("it flies");
    assert!((last_kg - carried.airframe.mass_kg - 1.0).abs() < 1e-9);
    assert_eq!(carrier.at_end, AtEnd::Land);
    // Once down it rises again.
    let down_s = carrier
        .airborne_s
        .1
        .expect("it lands")
        .max(find(&plan, "leaver").arrives_s)
        + 1.0;
    assert!(matches!(
        running
            .replan(down_s, &[late("leaver", 1.0)], &Control::QUIET)
            .as_deref_err(),
        Some([ChangeError::Gone(_)])
    ));
    let rise = retasked("carrier", vec![task(4.5, 5.5, 3.5)]);
    let told = running
        .replan(down_s, &[rise], &Control::QUIET)
        .expect("in order");
    assert_eq!(told.refused, []);
    sound(&running);
}

trait AsDerefErr<E> {
    fn as_deref_err(&self) -> Option<&[E]>;
}

impl<T, E> AsDerefErr<E> for Result<T, Vec<E>> {
    fn as_deref_err(&self) -> Option<&[E]> {
        self.as_ref().err().map(Vec::as_slice)
    }
}
