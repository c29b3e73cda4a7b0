//! What is shipped in `scenarios/` keeps the promise of the comment atop each file.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use planner::plan::{DronePlan, Plan, Status, ViolationKind};
use planner::scenario::world::{AtEnd, AtStart, World};
use planner::verify::{lateness, verify};
use planner::{Control, Files};

/// The verifier's arithmetic and the file agree far below the digits that are printed.
const SAME: f64 = 1e-9;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios")
}

fn shipped() -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "ron"))
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    names.sort();
    names
}

fn text(name: &str) -> String {
    fs::read_to_string(folder().join(format!("{name}.ron"))).unwrap()
}

fn world(name: &str) -> World {
    let cited =
        |file: &str| fs::read_to_string(folder().join(file)).map_err(|error| error.to_string());
    planner::read_world_with(&text(name), &Files::new(&cited)).unwrap()
}

fn planned(world: &World) -> Plan {
    let control = Control {
        contrast: true,
        ..Control::QUIET
    };
    let outcome = planner::plan_world(world, &control).expect("in order");
    outcome.into_planned().expect("a plan").plan
}

/// The plan of a world by so many threads.
fn planned_by(threads: usize, world: &World) -> Plan {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.unwrap().install(|| planned(world))
}

/// The plan of a shipped scenario by two threads; each is planned once for all tests.
fn shipped_plan(name: &str) -> &'static Plan {
    static PLANS: LazyLock<BTreeMap<String, Plan>> = LazyLock::new(|| {
        let plans = shipped().into_iter();
        plans
            .map(|name| (name.clone(), planned_by(2, &world(&name))))
            .collect()
    });
    &PLANS[name]
}

fn drone<'a>(plan: &'a Plan, name: &str) -> &'a DronePlan {
    let named = |drone: &&DronePlan| drone.name == name;
    plan.drones.iter().find(named).unwrap()
}

/// The lowest induced velocity that a drone has on its way: it hovers slowest when it carries least
/// (m/s).
fn lowest_induced_velocity_mps(drone: &DronePlan) -> f64 {
    let lightest_kg = drone
        .trajectory
        .mass_kg
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min);
    // U_H grows with the root of the mass.
    drone.airframe.hover_induced_velocity_mps * (lightest_kg / drone.airframe.mass_kg).sqrt()
}

#[test]
fn the_shipped_scenarios_are_the_ones_that_the_readme_can_name() {
    assert_eq!(
        shipped(),
        [
            "circle-16",
            "corridor",
            "draughty-hall",
            "landing-pads",
            "light-show",
            "mixed-fleet",
            "no-downwash-zone",
            "shaft",
            "warehouse",
            "window",
        ]
    );
}

#[test]
fn each_is_called_like_its_file_and_says_how_to_run_it() {
    for name in shipped() {
        assert_eq!(world(&name).name, name);
        let run = format!("// Run:  plan scenarios/{name}.ron\n");
        assert!(text(&name).contains(&run), "{name} lacks {run:?}");
    }
}

#[test]
fn every_feasible_one_is_planned_whole_and_the_verifier_agrees() {
    for name in shipped().iter().filter(|name| *name != "corridor") {
        let plan = shipped_plan(name);
        assert_eq!(plan.unplanned, [], "{name}");
        assert_eq!(plan.violations, [], "{name}");
        assert_eq!(plan.status, Status::Safe, "{name}");
        let again = serde_json::to_string(&plan).unwrap();
        let report = verify(&serde_json::from_str(&again).unwrap());
        assert_eq!(report.violations, [], "{name}, read back");
    }
}

#[test]
fn no_drone_is_exposed_to_more_than_its_limit() {
    for name in shipped() {
        for drone in &shipped_plan(&name).drones {
            // Whose mass changes may meet more while it is heavy; the verifier judges that moment
            // by moment.
            let constant = drone.trajectory.mass_kg.windows(2).all(|m| m[0] == m[1]);
            let alpha = drone.worst_air_mps / lowest_induced_velocity_mps(drone);
            assert!(
                !constant || alpha <= drone.air_limit + SAME,
                "{name}: {} meets {alpha} of its induced velocity",
                drone.name
            );
        }
    }
}

#[test]
fn without_regard_for_downwash_each_would_exceed_a_limit() {
    for name in shipped() {
        let ignoring = shipped_plan(&name).ignoring_downwash.as_ref().unwrap();
        assert!(
            ignoring.drones_over_limit + ignoring.zones_over_limit > 0,
            "{name} shows nothing"
        );
    }
}

#[test]
fn in_the_warehouse_at_least_five_drones_would_fly_through_downwash() {
    let ignoring = shipped_plan("warehouse")
        .ignoring_downwash
        .as_ref()
        .unwrap();
    assert!(ignoring.drones_over_limit >= 5, "{ignoring:?}");
}

#[test]
fn the_courier_of_the_warehouse_is_heavier_from_the_parcel_to_the_table() {
    let plan = shipped_plan("warehouse");
    let courier = drone(plan, "courier");
    let mut masses_kg = courier.trajectory.mass_kg.clone();
    masses_kg.dedup();
    assert_eq!(masses_kg.len(), 3, "{masses_kg:?}");
    let parcel_kg = [0.0, 0.35, 0.0];
    for (mass_kg, load_kg) in masses_kg.iter().zip(parcel_kg) {
        assert!((mass_kg - courier.airframe.mass_kg - load_kg).abs() < SAME);
    }
}

#[test]
fn the_corridor_has_no_safe_pass_and_the_answer_names_the_gentlest() {
    let plan = shipped_plan("corridor");
    assert_eq!(plan.status, Status::Partial);
    assert_eq!(plan.violations, []);
    let [left_out] = &plan.unplanned[..] else {
        panic!(
            "one of the two flies, the other stays: {:?}",
            plan.unplanned
        )
    };
    let other = match left_out.name.as_str() {
        "westbound" => "`eastbound`",
        "eastbound" => "`westbound`",
        name => panic!("no drone is called {name}"),
    };
    let reason = &left_out.reason;
    for part in [
        other,
        "at (",
        " s on",
        "the gentlest",
        "m below",
        "alpha 0.",
        "% power",
    ] {
        assert!(reason.contains(part), "{part:?} is missing in: {reason}");
    }
}

#[test]
fn the_light_show_is_in_place_together_holds_it_and_lands_where_it_stood() {
    let show = world("light-show");
    let plan = shipped_plan("light-show");
    assert_eq!(plan.drones.len(), 100);
    assert_eq!(planner::scenario::missing(&show, plan), [""; 0]);
    for (asked, flown) in show.drones.iter().zip(&plan.drones) {
        let place_m = asked.tasks[0].to_m;
        let Some([from_s, until_s]) = asked.tasks[0].during_s else {
            panic!("{} has no time", asked.name)
        };
        assert_eq!([from_s, until_s], [8.0, 18.0]);
        let trajectory = &flown.trajectory;
        let stays = |k: &usize| {
            let [a, b] = [k - 1, *k].map(|k| (trajectory.t_s[k], trajectory.position_m[k]));
            let is_there = [a.1, b.1].iter().all(|at| (at - place_m).norm() < 1e-6);
            a.0 <= from_s + SAME && b.0 >= until_s - SAME && is_there
        };
        let holds = (1..trajectory.t_s.len()).any(|k| stays(&k));
        assert!(holds, "{} is not held at {place_m}", asked.name);
        let beside_m = trajectory.position_m.last().unwrap() - asked.start_m;
        assert!(beside_m.xy().norm() < 1e-6, "{}: {beside_m}", asked.name);
        assert!(flown.airborne_s.1.is_some(), "{} hovers", asked.name);
    }
}

#[test]
fn without_its_zones_the_desk_would_be_exposed() {
    let desk = world("no-downwash-zone");
    let mut unguarded = desk.clone();
    unguarded.zones.clear();
    let mut plan = planned(&unguarded);
    assert_eq!(plan.violations, []);
    plan.zones = planned(&desk).zones;
    let exposed = verify(&plan).violations;
    assert!(
        exposed
            .iter()
            .any(|found| found.kind == ViolationKind::Zone),
        "the way round is flown without the zone, too"
    );
}

#[test]
fn a_drone_that_has_landed_has_no_wake_from_then_on() {
    let pads = world("landing-pads");
    let plan = planned(&pads);
    for (asked, flown) in pads.drones.iter().zip(&plan.drones) {
        let last_s = *flown.trajectory.t_s.last().unwrap();
        if asked.at_end == AtEnd::Land {
            let (from_s, Some(until_s)) = flown.airborne_s else {
                panic!("{} hovers without end", flown.name)
            };
            assert!(from_s < until_s && (until_s - last_s).abs() < SAME);
        } else {
            assert_eq!(flown.airborne_s, (0.0, Some(0.0)), "{}", flown.name);
        }
    }
}

#[test]
fn drones_that_hover_where_others_are_parked_are_passed_elsewhere() {
    let mut pads = world("landing-pads");
    let over = planned(&pads);
    for drone in &mut pads.drones {
        if drone.at_start == AtStart::Landed {
            drone.at_start = AtStart::Hover;
            // Off its pad by the clearance that a flying body needs.
            drone.start_m.z += pads.planning.clearance_m;
        }
    }
    let plan = planned(&pads);
    assert_eq!((plan.unplanned.len(), plan.violations.len()), (0, 0));
    let flown = |plan: &Plan| plan.drones.last().unwrap().trajectory.clone();
    assert_ne!(flown(&plan), flown(&over));
}

#[test]
fn drones_whose_margin_of_time_is_kept_may_be_late_by_as_much() {
    for name in ["draughty-hall", "window"] {
        let plan = shipped_plan(name);
        for (drone, late) in plan.drones.iter().zip(lateness::of_all(plan, &|| false)) {
            let late_s = late.expect("it can be judged").late_s;
            let least_s = plan.margins.time_s - lateness::FINE_S;
            assert!(late_s >= least_s, "{name}: {} {late_s} s", drone.name);
        }
    }
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    for name in shipped() {
        let one = planned_by(1, &world(&name));
        let [one, two] = [&one, shipped_plan(&name)].map(|it| serde_json::to_string(it).unwrap());
        assert_eq!(one, two, "{name}");
    }
}
