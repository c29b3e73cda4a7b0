//! What a running plan promises, in a hall of its own.

use super::*;
use crate::plan::DronePlan;
use crate::scenario::read_world;
use crate::verify::examination::examine;
use crate::verify::verify;

/// Plans on once, from a plan and the world that it was made for.
fn replan(
    world: &World,
    plan: &Plan,
    at_s: f64,
    changes: &[Change],
    control: &Control<'_>,
) -> Result<(Running, Replanned), Vec<ChangeError>> {
    let mut running = Running::new(world.clone(), plan.clone()).expect("its plan");
    let told = running.replan(at_s, changes, control)?;
    Ok((running, told))
}

fn hall(drones: usize) -> (World, Plan) {
    planned(&tools::instances::hall(drones, 1).expect("the hall has room"))
}

/// Without margins: a drone that is late already may be within another's. Rules that it leaves open
/// are given up.
fn planned(text: &str) -> (World, Plan) {
    let world = read_world(text).expect("in order");
    let mut world = world.relaxed().unwrap_or(world);
    world.planning.margins = crate::plan::Margins::default();
    let outcome = crate::plan_world(&world, &Control::QUIET).expect("in order");
    let plan = outcome.into_planned().expect("a plan").plan;
    assert!(plan.violations.is_empty() && plan.unplanned.is_empty());
    (world, plan)
}

fn task(x: f64, y: f64, z: f64) -> Task {
    Task {
        to_m: Point3::new(x, y, z),
        dwell_s: 1.0,
        load_kg: None,
        during_s: None,
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

/// A place in a column in which no drone starts or ends.
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

/// What the plan violates and is not over at a moment (s).
fn ahead(running: &Running, at_s: f64) -> Vec<Violation> {
    let all = running.plan().violations.iter();
    all.filter(|it| it.matters_from(at_s)).cloned().collect()
}

/// What was judged before a change and still holds is what the whole plan judged anew says.
fn exposed_as_judged_anew(running: &Running) {
    let plan = running.plan();
    for (drone, met) in plan.drones.iter().zip(&verify(plan).exposures) {
        for (told, found, slack) in [
            (drone.worst_air_mps, met.worst_air_mps, 0.02),
            (drone.extra_energy_j, met.extra_energy_j, 1e-3),
        ] {
            assert!(
                (told - found).abs() <= slack * (1.0 + found),
                "{}: {told} and {found}",
                drone.name
            );
        }
    }
}

#[test]
fn flights_judged_again_where_others_changed_break_what_the_whole_plan_judged_anew_says() {
    let (world, plan) = hall(60);
    let mut running = Running::new(world, plan.clone()).expect("its plan");
    let mut broken = 0;
    for by_s in [1.5, 0.0] {
        for drone in plan.drones.iter().step_by(7) {
            let mut noted = drone.clone();
            let times_s = noted.trajectory.t_s.iter_mut();
            times_s.skip(1).for_each(|t_s| *t_s += by_s);
            noted.arrives_s += by_s;
            running.note(0.0, &[noted]).expect("a trajectory");
            assert_eq!(
                running.flown().violations,
                verify(running.flown()).violations
            );
            let others = running.flown().violations.iter();
            broken += others.filter(|it| it.with.is_some()).count();
        }
        exposed_as_judged_anew(&running);
    }
    assert!(broken > 0);
    assert_eq!(running.flown().violations, []);
}

#[test]
fn violations_before_a_change_stay_reported_after_it() {
    let (world, plan) = hall(60);
    let mut running = Running::new(world, plan.clone()).expect("its plan");
    let later = |drone: &DronePlan, since_s: f64| {
        let mut noted = drone.clone();
        let times_s = noted.trajectory.t_s.iter_mut();
        times_s
            .filter(|t_s| **t_s > since_s)
            .for_each(|t_s| *t_s += 1.5);
        noted.arrives_s += 1.5;
        noted
    };
    let (early, late): (Vec<_>, Vec<_>) = (plan.drones.iter().enumerate())
        .filter(|(k, _)| k % 7 == 0)
        .partition(|(k, _)| k % 14 == 0);
    for (_, drone) in early {
        running.note(0.0, &[later(drone, 0.0)]).expect("in order");
    }
    let with = |running: &Running, until_s: f64| {
        let all = running.flown().violations.iter();
        let past = |it: &&Violation| it.until_s.is_some_and(|it| it < until_s);
        all.filter(|it| it.with.is_some() && past(it)).count()
    };
    let before = with(&running, 8.0);
    assert!(before > 0);
    for (_, drone) in late {
        running.note(10.0, &[later(drone, 10.0)]).expect("in order");
        assert_eq!(
            running.flown().violations,
            verify(running.flown()).violations
        );
    }
    assert_eq!(with(&running, 8.0), before);
}

/// What a plan says of itself is what follows from its trajectories.
fn figures_follow(plan: &Plan) {
    let text = serde_json::to_string(plan).expect("a plan");
    let file = crate::plan::file::read(&text).expect("a plan");
    assert_eq!(examine(&file, false).differences, []);
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
fn a_drone_that_is_later_than_it_has_flown_is_where_it_begins() {
    let (world, plan) = hall(20);
    let late_at = |at_s: f64, by_s: f64| {
        let change = late("d3", by_s);
        replan(&world, &plan, at_s, &[change], &Control::QUIET).expect("in order")
    };
    let (running, told) = late_at(2.0, 6.0);
    sound(&running);
    assert_eq!(told.changed[0].cause, Cause::Late);
    let (old, new) = (find(&plan, "d3"), find(running.plan(), "d3"));
    let begins_m = old.trajectory.position_m[0];
    assert_eq!(new.trajectory.position_m(2.0), Some(begins_m));
    // As late as it can be by then.
    assert_eq!(running.plan(), late_at(2.0, 2.0).0.plan());
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
    // Where it comes from another drone may have been before.
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
    for (nth, some) in changes.chunks(3).enumerate() {
        let before = running.plan().clone();
        let at_s = 2.0 + 1.37 * nth as f64;
        let told = running
            .replan(at_s, some, &Control::QUIET)
            .expect("in order");
        assert_eq!(told.refused, []);
        sound(&running);
        exposed_as_judged_anew(&running);
        others_keep_theirs(&before, running.plan(), &told);
    }
    // The same drones again, changed already.
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
fn a_replan_that_is_stopped_leaves_every_path_as_it_was() {
    let (world, plan) = hall(40);
    let [x, y] = free_column(&plan, 1);
    let changes = [
        retasked("d4", vec![task(x, y, 3.5)]),
        retasked("d5", Vec::new()),
    ];
    let stopped = Control {
        stop: &|| true,
        ..Control::QUIET
    };
    let (running, told) = replan(&world, &plan, 2.0, &changes, &stopped).expect("in order");
    assert_eq!(told.changed, []);
    let refused: Vec<&str> = told.refused.iter().map(|it| &it.name[..]).collect();
    assert_eq!(refused, ["d4", "d5"]);
    sound(&running);
    for (old, new) in plan.drones.iter().zip(&running.plan().drones) {
        assert_eq!(old.trajectory, new.trajectory, "{}", old.name);
    }
}

mod by_default;
mod refusals;

#[test]
fn a_late_drone_within_the_margins_of_another_is_reported_with_that_drone_and_the_distance() {
    let text = r#"Scenario(name: "crossing", bounds_m: (min: (0, 0, 0), max: (16, 10, 3)),
        planning: (cell_m: 1), drones: [
        (name: "along", airframe: "kolibri", start_m: (1.5, 5.5, 1.5), tasks: [(to_m: (14.5, 5.5, 1.5))]),
        (name: "across", airframe: "kolibri", start_m: (8.5, 0.5, 1.5), tasks: [(to_m: (8.5, 9.5, 1.5))]),
        (name: "back", airframe: "kolibri", start_m: (12.5, 9.5, 1.5), tasks: [(to_m: (4.5, 1.5, 1.5))])])"#;
    let world = read_world(text).expect("in order");
    assert!(world.planning.margins.time_s > 0.0);
    let outcome = crate::plan_world(&world, &Control::QUIET).expect("in order");
    let plan = outcome.into_planned().expect("a plan").plan;
    assert!(plan.is_safe());
    let mut told_of_margins = 0;
    for step in 4..26 {
        for (name, by_s) in [
            ("along", 0.4),
            ("across", 0.4),
            ("along", 1.0),
            ("back", 0.7),
        ] {
            let at_s = 0.2 * f64::from(step);
            let changes = [late(name, by_s)];
            let told = replan(&world, &plan, at_s, &changes, &Control::QUIET);
            let (running, told) = told.expect("in order");
            assert_eq!(
                running.plan().violations,
                told.unavoidable,
                "{name} at {at_s}"
            );
            for it in &told.unavoidable {
                let words = it.to_string();
                let with = it.with.as_deref().expect("another drone");
                assert!(it.drone == name || with == name, "{words}");
                assert!(words.contains(&it.drone) && words.contains(with) && words.contains(" m "));
                told_of_margins += usize::from(it.kind != it.kind.without_margin());
            }
        }
    }
    assert!(told_of_margins > 0);
}

/// What is flown stays where it was before a change, and is continuous after it.
#[test]
fn smooth_flights_are_changed_without_a_jump() {
    let text = tools::instances::hall(16, 3).expect("the hall has room");
    let mut world = read_world(&text).expect("in order");
    world.planning.motion = crate::scenario::world::PathMotion::Smooth;
    let outcome = crate::plan_world(&world, &Control::QUIET).expect("in order");
    let plan = outcome.into_planned().expect("a plan").plan;
    assert!(plan.violations.is_empty() && plan.unplanned.is_empty());
    assert!(plan.drones.iter().any(|drone| drone.trajectory.is_smooth()));
    let mut running = Running::new(world, plan.clone()).expect("its plan");
    let mut before = plan;
    for (at_s, changes) in [
        (
            4.0,
            vec![retasked(
                "d3",
                vec![task(40.5, 20.5, 3.5), task(12.5, 30.5, 3.5)],
            )],
        ),
        (
            6.3,
            vec![retasked("d5", vec![task(30.5, 30.5, 4.5)]), removed("d7")],
        ),
        (8.1, vec![retasked("d3", vec![task(20.5, 20.5, 3.5)])]),
    ] {
        let told = running
            .replan(at_s, &changes, &Control::QUIET)
            .expect("changes in order");
        assert_eq!(told.refused, []);
        assert_eq!(running.plan().violations, [], "{at_s} s");
        for (old, new) in before.drones.iter().zip(&running.plan().drones) {
            for k in 0..(at_s * 50.0) as u32 {
                let t_s = f64::from(k) / 50.0;
                let places = [old, new].map(|it| it.trajectory.position_m(t_s).expect("points"));
                let apart_m = (places[0] - places[1]).norm();
                assert!(apart_m < 1e-6, "{} at {t_s} s: {apart_m} m", old.name);
            }
        }
        before = running.plan().clone();
    }
}

#[test]
fn drones_that_are_to_land_land_and_those_that_found_no_place_go_on_as_before() {
    let (world, plan) = hall(12);
    let mut running = Running::new(world, plan.clone()).expect("its plan");
    let land = |drone: &DronePlan, over_m| Change::Landed {
        drone: drone.name.clone(),
        over_m: Some(over_m),
    };
    let columns = (0..).map(|nth| free_column(&plan, nth));
    let drones = plan.drones.iter().skip(2);
    let mut changes: Vec<Change> = drones
        .zip(columns)
        .map(|(drone, [x, y])| land(drone, Point3::new(x, y, 3.5)))
        .collect();
    // Over one another two do not land.
    let first = &plan.drones[0];
    let Change::Landed {
        over_m: Some(taken_m),
        ..
    } = changes[0].clone()
    else {
        panic!("it lands");
    };
    changes.push(land(first, taken_m));
    let told = running
        .replan(5.0, &changes, &Control::QUIET)
        .expect("in order");
    sound(&running);
    others_keep_theirs(&plan, running.plan(), &told);
    let [out] = &told.refused[..] else {
        panic!("{:?}", told.refused);
    };
    for (old, new) in plan.drones.iter().zip(&running.plan().drones) {
        history_is_kept(old, new, 5.0);
        let is_asked = changes.iter().any(|it| it.drone() == old.name);
        if is_asked && old.name != out.name {
            assert_eq!(new.at_end, AtEnd::Land, "{}", old.name);
            assert!(new.airborne_s.1.is_some(), "{}", old.name);
        } else {
            assert_eq!((new.at_end, &new.trajectory), (old.at_end, &old.trajectory));
        }
    }
}

/// One drone in a yard of its own.
fn alone(at_end: &str, motion: &str) -> Running {
    let (world, plan) = planned(&format!(
        r#"Scenario(name: "one", bounds_m: (min: (0, 0, 0), max: (14, 10, 5)), drones: [
            (name: "a", airframe: "kolibri", start_m: (1.5, 1.5, 1.5), at_end: {at_end},
              tasks: [(to_m: (8.5, 1.5, 1.5))]),
        ], planning: (motion: {motion}))"#
    ));
    Running::new(world, plan).expect("its plan")
}

#[test]
fn a_drone_that_drops_all_it_had_to_do_comes_to_rest_before_it_leaves_or_lands() {
    for motion in ["Straight", "Smooth"] {
        for at_end in ["Leave", "Land", "Hover"] {
            let mut running = alone(at_end, motion);
            let dropped = [retasked("a", Vec::new())];
            let told = running.replan(1.1, &dropped, &Control::QUIET);
            assert_eq!(told.expect("in order").refused, []);
            sound(&running);
            figures_follow(running.plan());
            let last_s = running.plan().drones[0].trajectory.t_s.last().copied();
            assert!(last_s < Some(6.0), "{motion} {at_end}: {last_s:?}");
        }
    }
}

#[test]
fn a_flying_drone_without_a_place_comes_to_rest_and_lands() {
    for motion in ["Straight", "Smooth"] {
        let mut running = alone("Hover", motion);
        let lands = Change::Landed {
            drone: "a".to_owned(),
            over_m: None,
        };
        running
            .replan(1.1, &[lands], &Control::QUIET)
            .expect("in order");
        sound(&running);
        let entry = find(running.plan(), "a");
        let last_m = entry.trajectory.position_m.last().expect("points");
        assert!(last_m.z < 0.2 && entry.at_end == AtEnd::Land, "{last_m}");
    }
}

#[test]
fn a_drone_that_drops_all_it_had_to_do_over_a_zone_is_refused_with_a_place_to_land_beside_it() {
    let over_desk = |start_x_m: f64, motion: &str| {
        let (world, plan) = planned(&format!(
            r#"Scenario(name: "desk", bounds_m: (min: (0, 0, 0), max: (14, 10, 6)),
            zones: [(name: "desk", min_m: (4, 3, 0), max_m: (8, 7, 1.5), keep_out: true)],
            drones: [(name: "a", airframe: "kolibri", start_m: ({start_x_m}, 5.5, 3.5),
              at_end: Land, tasks: [(to_m: (12.5, 5.5, 3.5))])],
            planning: (motion: {motion}))"#
        ));
        Running::new(world, plan).expect("its plan")
    };
    let lands = Change::Landed {
        drone: "a".to_owned(),
        over_m: None,
    };
    for motion in ["Straight", "Smooth"] {
        let mut running = over_desk(1.5, motion);
        let before = running.plan().clone();
        for change in [retasked("a", Vec::new()), lands.clone()] {
            let told = running.replan(2.0, &[change], &Control::QUIET);
            let [ChangeError::Misplaced { drone, why }] = &told.expect_err("no place to land")[..]
            else {
                panic!("{motion}: one place");
            };
            let words = ["`a` lands in keep_out zone `desk`", "nearest free place"];
            assert!(
                drone == "a" && words.iter().all(|it| why.contains(it)),
                "{why}"
            );
        }
        assert_eq!(*running.plan(), before);
        // Where it began is not asked.
        let mut running = over_desk(5.5, motion);
        let dropped = [retasked("a", Vec::new())];
        let told = running.replan(3.0, &dropped, &Control::QUIET);
        assert_eq!(told.expect("beside the desk").refused, []);
        sound(&running);
        let entry = find(running.plan(), "a");
        let last_m = entry.trajectory.position_m.last().expect("points");
        assert!(last_m.z < 0.2 && last_m.x < 12.0, "{motion}: {last_m}");
    }
}

#[test]
fn a_drone_that_is_late_while_it_descends_arrives_when_it_did() {
    for motion in ["Straight", "Smooth"] {
        for later_s in [0.1, 0.8, 1.3] {
            let mut running = alone("Land", motion);
            let arrives_s = find(running.plan(), "a").arrives_s;
            let told = running.replan(arrives_s + later_s, &[late("a", 0.6)], &Control::QUIET);
            told.expect("in order");
            figures_follow(running.plan());
        }
    }
}

#[test]
fn the_path_of_a_smooth_flight_leads_through_the_very_places_of_the_lattice() {
    let text = tools::instances::hall(12, 1).expect("the hall has room");
    let text = text
        .replace("(64, 64, 8)", "(64.3, 64.3, 8.1)")
        .replace(".5, ", ".57, ");
    let world = read_world(&text).expect("in order");
    let outcome = crate::plan_world(&world, &Control::QUIET).expect("in order");
    let plan = outcome.into_planned().expect("a plan").plan;
    assert!(plan.drones.iter().all(|it| it.trajectory.is_smooth()));
    let running = Running::new(world, plan).expect("it is its plan");
    let lattice = running.job.roadmap.lattice();
    let mut through = 0;
    for leg in running.tracks.iter().flat_map(|track| &track.legs) {
        let place = lattice.at(lattice.nearest(&leg.from_m)).expect("within");
        let off_m = (lattice.position_m(place) - leg.from_m).norm();
        if off_m < 1e-3 {
            assert_eq!(lattice.place_at(&leg.from_m), Some(place), "{off_m} m");
            through += 1;
        }
    }
    assert!(through > 50, "{through}");
}

#[test]
fn a_late_drone_that_flies_smoothly_is_where_and_as_fast_as_it_was() {
    let text = tools::instances::hall(6, 1).expect("the hall has room");
    let world = read_world(&text).expect("in order");
    let outcome = crate::plan_world(&world, &Control::QUIET).expect("in order");
    let plan = outcome.into_planned().expect("a plan").plan;
    for by_s in [0.1, 0.4, 2.5] {
        let (running, _) =
            replan(&world, &plan, 3.0, &[late("d1", by_s)], &Control::QUIET).expect("in order");
        let (was, now) = (
            &plan.drones[0].trajectory,
            &running.plan().drones[0].trajectory,
        );
        assert!(was.is_smooth() && now.is_smooth());
        let off_m = |after_s: f64| {
            let known_m = was.position_m(3.0 - by_s + after_s).expect("there");
            (now.position_m(3.0 + after_s).expect("there") - known_m).norm()
        };
        // Until it can do something else it does what it did.
        assert!(off_m(0.0) < 1e-9 && off_m(0.1) < 1e-9, "{by_s}");
    }
}

#[test]
fn a_failed_drone_is_an_obstacle_until_it_is_taken_out() {
    let (world, plan) = hall(12);
    let mut running = Running::new(world, plan).expect("its plan");
    let failed = find(running.plan(), "d1").clone();
    let at_m = failed.trajectory.position_m(4.0).expect("it flies");
    // Another was to land where the body comes to lie.
    let over = task(at_m.x.floor() + 0.5, at_m.y.floor() + 0.5, 3.5);
    let lands = Change::Landed {
        drone: "d2".to_owned(),
        over_m: Some(over.to_m),
    };
    running
        .replan(2.0, &[lands], &Control::QUIET)
        .expect("in order");
    let fails = Change::Failed {
        drone: "d1".to_owned(),
        lies_m: None,
    };
    let told = running.replan(4.0, std::slice::from_ref(&fails), &Control::QUIET);
    let told = told.expect("in order");
    sound(&running);
    let causes: Vec<Cause> = told.changed.iter().map(|it| it.cause).collect();
    assert!(causes.contains(&Cause::Failed) && causes.contains(&Cause::Wreck));
    let gone = find(running.plan(), "d1");
    assert_eq!(gone.at_end, AtEnd::Leave);
    assert!(gone.airborne_s.1.expect("its wake ends") < 6.0);
    let wreck = find(running.plan(), "d1 (wreck)");
    let radius_m = wreck.airframe.body_radius_m;
    let lies_m = wreck.trajectory.position_m[0];
    assert_eq!(lies_m, Point3::new(at_m.x, at_m.y, radius_m));
    // From when the drone is gone on.
    let gone_s = *gone.trajectory.t_s.last().expect("it flew");
    assert_eq!(wreck.airborne_s, (gone_s, Some(gone_s)));
    let last_m = find(running.plan(), "d2")
        .trajectory
        .position_m(1e4)
        .expect("it stays");
    assert!((last_m - lies_m).norm() > 2.0 * radius_m, "{last_m}");

    let wrong = running
        .replan(5.0, &[fails], &Control::QUIET)
        .expect_err("it has failed");
    assert!(
        matches!(wrong[..], [ChangeError::Known(_)] | [ChangeError::Gone(_)]),
        "{wrong:?}"
    );
    let [x, y, z] = lies_m.coords.into();
    let comes = another(running.world(), "d1 (wreck)", [x, y, z + 3.0], over.clone());
    let wrong = running.replan(5.0, &[comes], &Control::QUIET);
    assert!(
        matches!(&wrong, Err(wrong) if wrong[..] == [ChangeError::Known("d1 (wreck)".to_owned())])
    );
    let wrong = running.replan(5.0, &[late("d1 (wreck)", 1.0)], &Control::QUIET);
    assert_eq!(
        wrong,
        Err(vec![ChangeError::Fixed("d1 (wreck)".to_owned())])
    );
    for (lies_m, words) in [
        (Point3::new(-3.0, 0.0, 0.0), "outside the bounds"),
        (
            Point3::new(x, y, z + 0.1),
            "0.100 m above what it could lie on: say a height of 0.198 m",
        ),
    ] {
        let lies = Change::Failed {
            drone: "d3".to_owned(),
            lies_m: Some(lies_m),
        };
        let wrong = running.replan(5.0, &[lies], &Control::QUIET);
        let wrong = wrong.expect_err("no place for it");
        assert!(wrong[0].to_string().contains(words), "{wrong:?}");
    }
    running
        .replan(6.0, &[removed("d1 (wreck)")], &Control::QUIET)
        .expect("it is carried off");
    sound(&running);
    // What lies there needs a name of its own.
    let fails = |drone: &str| Change::Failed {
        drone: drone.to_owned(),
        lies_m: None,
    };
    let [x, y] = free_column(running.plan(), 2);
    let world = running.world().clone();
    let comes = |name: &str| another(&world, name, [x, y, 5.5], task(x, y, 4.5));
    let both = [fails("d3"), comes("d3 (wreck)")];
    let wrong = running.replan(7.0, &both, &Control::QUIET);
    assert_eq!(
        wrong,
        Err(vec![ChangeError::Twice("d3 (wreck)".to_owned())])
    );
    let long = "d".repeat(96);
    running
        .replan(7.0, &[comes(&long)], &Control::QUIET)
        .expect("it comes");
    let wrong = running.replan(8.0, &[fails(&long)], &Control::QUIET);
    assert!(matches!(&wrong, Err(wrong) if matches!(wrong[..], [ChangeError::Number { .. }])));
}

#[test]
fn where_a_drone_cannot_lie_a_height_is_named_at_which_it_can_or_none() {
    let text = |drones: &str| {
        format!(
            r#"Scenario(name: "desk", bounds_m: (min: (0, 0, 0), max: (14, 10, 4)), obstacles: [
            (name: "desk", min_m: (8, 2, 0), max_m: (10, 3, 0.8)),
            (name: "board", min_m: (11, 2, 2), max_m: (13, 3, 2.2)),
        ], drones: [{drones}], planning: (motion: Straight))"#
        )
    };
    let drones = r#"(name: "a", airframe: "kolibri", start_m: (1.5, 5.5, 1.5),
        tasks: [(to_m: (12.5, 5.5, 1.5))])"#;
    let (world, plan) = planned(&text(drones));
    let running = Running::new(world, plan).expect("its plan");
    let wrong = |lies_m: [f64; 3]| {
        let lies = Change::Failed {
            drone: "a".to_owned(),
            lies_m: Some(lies_m.into()),
        };
        let wrong = running.check(2.0, &[lies]).err().unwrap_or_default();
        wrong.first().map(ToString::to_string)
    };
    for (lies_m, words, height_m) in [
        (
            [9.2, 2.5, 0.4],
            "in an obstacle: say a height of 0.896 m",
            Some(0.896),
        ),
        (
            [9.2, 2.5, 1.2],
            "0.304 m above what it could lie on",
            Some(0.896),
        ),
        (
            [12.0, 2.5, 2.1],
            "in an obstacle: say a height of 2.296 m",
            Some(2.296),
        ),
        (
            [12.0, 2.5, 1.0],
            "say a height of 0.096 m, or no place",
            Some(0.096),
        ),
        ([7.95, 2.5, 0.9], "no room to lie: say no place", None),
    ] {
        let told = wrong(lies_m).expect("in mid-air, or in an obstacle");
        assert!(told.contains(words), "{told}");
        let [x, y, _] = lies_m;
        assert_eq!(height_m.and_then(|z| wrong([x, y, z])), None);
    }
}

/// A long run of a few drones: each gets another task once it has done the last, some leave and
/// others come.
fn lives(text: &str, forgets: bool) -> Running {
    let world = read_world(text).expect("in order");
    let outcome = crate::plan_world(&world, &Control::QUIET).expect("in order");
    let plan = outcome.into_planned().expect("a plan").plan;
    let mut running = Running::new(world, plan).expect("its plan");
    let first = running.world().drones[0].clone();
    for round in 0..12_u32 {
        let at_s = 10.0 * f64::from(round + 1);
        let at = |k: u32| f64::from((7 * round + 3 * k) % 18) + 1.5;
        let mut changes = vec![
            retasked("a", vec![task(at(0), 2.5, 1.5), task(at(1), 7.5, 2.5)]),
            late("b", 0.5),
        ];
        if round == 2 {
            changes[1] = removed("b");
        } else if round > 2 {
            let name = format!("c{round}");
            changes[1] = Change::Added(Drone {
                name,
                start_m: Point3::new(at(2), 11.5, 1.5),
                // Each at a mass of its own.
                tasks: vec![Task {
                    load_kg: Some(0.001 * f64::from(round)),
                    ..task(at(3), 11.5, 1.5)
                }],
                at_end: AtEnd::Leave,
                ..first.clone()
            });
        }
        running
            .replan(at_s, &changes, &Control::QUIET)
            .expect("in order");
        sound(&running);
        exposed_as_judged_anew(&running);
        if forgets {
            running.forget(at_s - 5.0);
            sound(&running);
        }
        figures_follow(running.plan());
    }
    running
}

#[test]
fn what_is_forgotten_changes_nothing_that_is_still_flown() {
    for motion in ["Straight", "Smooth"] {
        let text = format!(
            r#"Scenario(name: "yard", bounds_m: (min: (0, 0, 0), max: (20, 14, 5)), drones: [
                (name: "a", airframe: "kolibri", start_m: (2.5, 2.5, 1.5), tasks: [(to_m: (15.5, 7.5, 1.5), dwell_s: 1)]),
                (name: "b", airframe: "kolibri", start_m: (15.5, 4.5, 1.5), tasks: [(to_m: (4.5, 4.5, 1.5))]),
            ], planning: (motion: {motion}))"#
        );
        let (whole, short) = (lives(&text, false), lives(&text, true));
        assert!(whole.plan().drones.len() > 10);
        assert!(
            short.plan().drones.len() < 6,
            "{}",
            short.plan().drones.len()
        );
        for new in &short.plan().drones {
            let old = find(whole.plan(), &new.name);
            let begins_s = new.enters_s.unwrap_or(0.0);
            let last_s = old.trajectory.t_s.last().copied().expect("it flies");
            for step in 0..=200 {
                let at_s = begins_s + (last_s + 1.0 - begins_s) * f64::from(step) / 200.0;
                let place = |it: &DronePlan| it.trajectory.position_m(at_s).expect("it is there");
                assert!(
                    (place(old) - place(new)).norm() < 1e-6,
                    "{} at {at_s} s",
                    old.name
                );
            }
        }
        let kinds = [&whole, &short].map(|it| it.job.kinds.len());
        assert!(kinds[0] > 8 && kinds[1] < 6, "{kinds:?}");
        let points = |it: &Running| {
            it.plan()
                .drones
                .iter()
                .map(|it| it.trajectory.t_s.len())
                .sum::<usize>()
        };
        assert!(
            points(&short) < points(&whole) / 3,
            "{} of {}",
            points(&short),
            points(&whole)
        );
    }
}

#[test]
fn what_is_forgotten_leaves_the_rest_to_the_last_byte() {
    let (world, plan) = planned(
        r#"Scenario(name: "yard", bounds_m: (min: (0, 0, 0), max: (20, 14, 7)), drones: [
            (name: "a", airframe: "kolibri", start_m: (1.5, 1.5, 2.5), at_end: Land, tasks: [
              (to_m: (12.5, 1.5, 2.5), dwell_s: 3), (to_m: (3.5, 1.5, 2.5), dwell_s: 37),
              (to_m: (14.5, 1.5, 2.5), dwell_s: 25), (to_m: (1.5, 1.5, 2.5))])],
            planning: (motion: Smooth))"#,
    );
    let mut running = Running::new(world, plan).expect("its plan");
    for at_s in [25.0, 78.0] {
        let before = running.plan().drones[0].trajectory.clone();
        let told = running.replan(at_s, &[], &Control::QUIET);
        assert_eq!(told.expect("in order").changed, []);
        running.forget(at_s);
        let after = &running.plan().drones[0].trajectory;
        let dropped = before.t_s.len() - after.t_s.len();
        assert!(dropped > 0 && after.is_smooth());
        // But for where it begins now.
        assert_eq!(after.t_s[1..], before.t_s[dropped + 1..]);
        assert_eq!(after.position_m[1..], before.position_m[dropped + 1..]);
        assert_eq!(after.control_m[1..], before.control_m[dropped + 1..]);
    }
}

#[test]
fn what_another_planner_flies_is_kept_clear_of_and_changes_hands_both_ways() {
    let read = |motion: &str, drones: &str| {
        read_world(&format!(
            r#"Scenario(name: "area", bounds_m: (min: (0, 0, 0), max: (20, 14, 6)), drones: [{drones}],
               planning: (motion: {motion}))"#
        ))
        .expect("in order")
    };
    let of = |world: &World| {
        let told = crate::plan_world(world, &Control::QUIET).expect("in order");
        told.into_planned().expect("a plan").plan
    };
    for (mine, theirs) in [
        ("Straight", "Smooth"),
        ("Smooth", "Straight"),
        ("Smooth", "Smooth"),
    ] {
        let ours = read(
            mine,
            r#"(name: "low", airframe: "kolibri", start_m: (2.5, 6.5, 1.5), tasks: [(to_m: (17.5, 6.5, 1.5))]),
                (name: "heavy", airframe: "matrice-300", start_m: (17.5, 11.5, 4.5))"#,
        );
        let theirs = of(&read(
            theirs,
            r#"(name: "lifter", airframe: "matrice-300", start_m: (9.5, 0.9, 4.5), tasks: [(to_m: (9.5, 11.5, 4.5))])"#,
        ));
        let mut running = Running::new(ours.clone(), of(&ours)).expect("its plan");
        let comes = Change::Fixed(Box::new(theirs.drones[0].clone()));
        // Taken note of alone, it breaks what the verifier says.
        let mut noted = running.clone();
        noted.note(0.0, &theirs.drones).expect("in order");
        assert!(!noted.plan().violations.is_empty());
        assert_eq!(
            find(noted.plan(), "low").trajectory,
            find(running.plan(), "low").trajectory
        );
        let told = running
            .replan(0.0, std::slice::from_ref(&comes), &Control::QUIET)
            .expect("in order");
        sound(&running);
        assert_eq!(told.changed[0].cause, Cause::GaveWay, "{:?}", told.changed);
        assert_eq!(
            find(running.plan(), "lifter").trajectory,
            theirs.drones[0].trajectory
        );
        let wrong = running.replan(1.0, &[late("lifter", 1.0)], &Control::QUIET);
        assert_eq!(wrong, Err(vec![ChangeError::Fixed("lifter".to_owned())]));

        // One that is in motion for months is no flight.
        let mut slow = theirs.drones[0].clone();
        slow.trajectory.t_s.iter_mut().for_each(|t_s| *t_s *= 1e5);
        let refused = given(&slow, &ours).expect_err("too long").to_string();
        assert!(refused.contains("it is in motion for"), "{refused}");

        // Where it hovers at its end it is taken over.
        let lifter = Drone {
            start_m: Point3::new(9.5, 11.5, 4.5),
            tasks: vec![task(3.5, 11.5, 4.5)],
            ..given(&theirs.drones[0], &ours).expect("in order")
        };
        running
            .replan(40.0, &[Change::Added(lifter)], &Control::QUIET)
            .expect("in order");
        sound(&running);
        let entry = find(running.plan(), "lifter");
        // Where it hovered until then is flown here, too.
        let flown_s = theirs.drones[0].trajectory.t_s.last().expect("its flight");
        let enters_s = entry.enters_s.expect("it comes later");
        assert!((enters_s - flown_s).abs() < 0.011, "{enters_s} {flown_s}");
        assert_eq!(
            entry.trajectory.position_m(enters_s),
            Some(Point3::new(9.5, 11.5, 4.5))
        );
        assert_eq!(
            entry.trajectory.position_m(80.0),
            Some(Point3::new(3.5, 11.5, 4.5))
        );
        // And given back.
        let mut hovers = entry.clone();
        hovers.enters_s = Some(90.0);
        hovers.airborne_s.0 = 90.0;
        hovers.trajectory = TrajectoryEntry {
            t_s: vec![90.0],
            position_m: vec![Point3::new(3.5, 11.5, 4.5)],
            mass_kg: vec![*entry.trajectory.mass_kg.last().expect("its mass")],
            ..TrajectoryEntry::default()
        };
        running
            .replan(90.0, &[Change::Fixed(Box::new(hovers))], &Control::QUIET)
            .expect("in order");
        sound(&running);
        let wrong = running.replan(91.0, &[retasked("lifter", vec![])], &Control::QUIET);
        assert!(wrong.is_err());
        running
            .replan(
                92.0,
                &[
                    removed("lifter"),
                    retasked("low", vec![task(3.5, 11.5, 1.5)]),
                ],
                &Control::QUIET,
            )
            .expect("in order");
        sound(&running);
    }
}

#[test]
fn room_for_what_others_fly_is_given_back_once_they_have_left() {
    let text = |name: &str, y_m: f64| {
        format!(
            r#"Scenario(name: "yard", bounds_m: (min: (0, 0, 0), max: (20, 14, 5)), drones: [
                (name: "{name}", airframe: "kolibri", start_m: (2.5, {y_m}, 1.5), at_end: Leave,
                 tasks: [(to_m: (15.5, {y_m}, 1.5))]),
            ], planning: (motion: Smooth))"#
        )
    };
    let (_, theirs) = planned(&text("theirs", 10.5));
    let (world, plan) = planned(&text("own", 2.5));
    let mut running = Running::new(world, plan).expect("its plan");
    running.note(0.0, &theirs.drones).expect("in order");
    assert!(running.job.fixed_path_deviation_m > 0.0);
    let own = running.world().drones[0].clone();
    let comes = Change::Added(Drone {
        name: "next".to_owned(),
        ..own
    });
    let told = running.replan(60.0, &[comes], &Control::QUIET);
    told.expect("in order");
    assert!(running.job.fixed_path_deviation_m > 0.0);
    running.forget(55.0);
    assert_eq!(running.plan().drones.len(), 1);
    assert_eq!(running.job.fixed_path_deviation_m, 0.0);
}

#[test]
fn a_drone_that_the_plan_does_not_have_is_neither_there_nor_on_the_ground() {
    let (world, plan) = hall(2);
    let running = Running::new(world, plan).expect("its plan");
    assert!(running.is_there(1, 0.0) && !running.is_there(2, 0.0));
    assert_eq!(running.on_ground(2, 0.0), None);
}
