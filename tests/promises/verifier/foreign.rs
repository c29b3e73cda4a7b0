//! Plans and logs from anywhere: what is left out is filled in, what is claimed is recomputed, what
//! a scenario asks for is looked for, what was flown is judged.

use planner::plan::file::{NotAPlan, PlanFile, read, schema};
use planner::plan::{AtEnd, AtStart, DronePlan, Plan, Solid, ViolationKind};
use planner::scenario::{Files, FlownError, missing, read_samples, samples_as_plan};
use planner::verify::examination::examine;
use planner::{Control, read_world};
use serde_json::{Value, json};

use super::broken;
use super::plans::{drone, plan};

/// The least that is a plan: presets by name, points, no results.
const LEAST: &str = r#"{"format": "plan/2", "bounds_m": {"min": [0, 0, 0], "max": [20, 10, 8]}, "drones": [
    {"name": "k", "airframe": "kolibri", "trajectory": {"t_s": [0, 4], "position_m": [[1, 5, 2], [9, 5, 2]]}},
    {"name": "m", "airframe": {"name": "matrice-300", "max_speed_mps": 3.0}, "at_start": "landed", "at_end": "land",
     "trajectory": {"t_s": [0, 2, 6, 7, 10], "position_m": [[15, 5, 0.7137], [15, 5, 4], [17, 5, 4], [17, 5, 2], [17, 5, 0.7137]]}}]}"#;

fn file(text: &str) -> PlanFile {
    read(text).unwrap_or_else(|error| panic!("{error}"))
}

fn changed(text: &str, change: impl FnOnce(&mut Value)) -> String {
    let mut plan: Value = serde_json::from_str(text).unwrap();
    change(&mut plan);
    plan.to_string()
}

/// What a change is called, and what it does.
type Change<T> = (&'static str, fn(&mut T));

#[test]
fn a_plan_without_results_takes_presets_by_name_and_defaults() {
    let file = file(LEAST);
    let [kolibri, matrice] = &file.plan.drones[..] else {
        panic!("two drones");
    };
    let preset = airflow::Airframe::preset("kolibri").unwrap();
    assert_eq!(kolibri.airframe.airframe().unwrap(), preset);
    assert!((kolibri.airframe.body_radius_m - preset.tip_radius_m()).abs() < 1e-12);
    assert_eq!(
        (kolibri.air_limit, kolibri.airframe.max_speed_mps),
        (0.3, 2.0)
    );
    assert!((kolibri.airframe.hover_induced_velocity_mps - 7.41).abs() < 0.02);
    assert_eq!(kolibri.airborne_s, (0.0, None));
    assert_eq!(kolibri.trajectory.mass_kg, [0.23, 0.23]);
    assert_eq!(matrice.airborne_s, (0.0, Some(10.0)));
    assert_eq!(matrice.airframe.max_speed_mps, 3.0);
    // Limits are those of a scenario that states none.
    assert_eq!(kolibri.airframe.max_descent_mps, Some(2.0));
    let induced_mps = matrice.airframe.hover_induced_velocity_mps;
    assert_eq!(
        (
            matrice.airframe.max_climb_mps,
            matrice.airframe.max_descent_mps
        ),
        (Some(3.0), Some(f64::min(3.0, 0.4 * induced_mps)))
    );
    let filled = [
        ("mass_kg", 2),
        ("airborne_s", 2),
        ("air_limit", 2),
        ("body_radius_m", 2),
        ("max_speed_mps", 1),
        ("max_climb_mps", 2),
        ("max_descent_mps", 2),
        ("max_acceleration_mps2", 2),
        ("max_jerk_mps3", 2),
    ];
    assert_eq!(file.filled, filled);
    assert!(file.remarks[0].starts_with("no margins stated"));
    let found = examine(&file, true);
    assert!(
        found.plan.violations.is_empty(),
        "{:?}",
        found.plan.violations
    );
    assert!(found.differences.is_empty(), "{:?}", found.differences);
    // Arrivals are those of the last dwell: before the descent.
    assert_eq!(found.plan.drones[1].arrives_s, 6.0);
    assert_eq!(found.late.len(), 2);
}

#[test]
fn limits_that_are_omitted_hold_in_plan_2_and_not_in_plan_1() {
    let fast = |format: &'static str| {
        changed(LEAST, |plan| {
            plan["format"] = json!(format);
            plan["drones"][1]["trajectory"]["t_s"] = json!([0, 2, 6, 7, 8]);
        })
    };
    let kinds = |file: &PlanFile| {
        let found = examine(file, false).plan.violations.into_iter();
        found.map(|it| it.kind).collect::<Vec<_>>()
    };
    assert_eq!(kinds(&file(&fast("plan/2"))), [ViolationKind::Touchdown]);
    let before = file(&fast("plan/1"));
    assert_eq!(kinds(&before), []);
    assert_eq!(before.plan.drones[1].airframe.max_descent_mps, None);
    assert!(before.remarks[0].contains("none are judged"));
}

#[test]
fn all_fields_of_a_plan_that_are_wrong_are_reported_at_once() {
    let text = changed(LEAST, |plan| {
        let drones = &mut plan["drones"];
        drones[0]["trajectory"]["t_s"][1] = json!("four");
        drones[0]["trajectory"]["position_m"][0] = json!([1, 5]);
        drones[1]["at_end"] = json!("fall");
        drones[1]["name"] = json!(7);
    });
    let told = read(&text).expect_err("it is no plan").to_string();
    let first = told.lines().next().unwrap_or_default();
    assert!(
        first.starts_with("`drones[0].trajectory.t_s[1]`: a number, not \"four\" at line 1"),
        "{told}"
    );
    for (place, count) in [
        ("`drones[0].trajectory.t_s[1]`", 1),
        ("`drones[0].trajectory.position_m[0]`: a list of 3", 1),
        ("`drones[1].at_end`: \"hover\" or", 1),
        ("`drones[1].name`: a text, not 7", 1),
        ("\n", 3),
    ] {
        assert_eq!(told.matches(place).count(), count, "{place}: {told}");
    }
    assert_eq!(read(LEAST).map(|it| it.plan.drones.len()), Ok(2));
}

#[test]
fn what_cannot_be_judged_is_refused_with_its_field() {
    let field = |text: &str| match read(text) {
        Err(NotAPlan::Fields { faults, .. }) => faults[0].place.clone(),
        Err(other) => other.to_string(),
        Ok(_) => "read".to_owned(),
    };
    let cases: [Change<Value>; 12] = [
        ("`drones`: there are none", |plan| {
            plan["drones"] = json!([])
        }),
        ("plan/3", |plan| plan["format"] = json!("plan/3")),
        ("drones[0].airframe", |plan| {
            plan["drones"][0]["airframe"] = json!("colibri")
        }),
        ("drones[1].trajectory.t_s[2]", |plan| {
            plan["drones"][1]["trajectory"]["t_s"][2] = json!("six");
        }),
        ("drones[0].trajectory.control_m[0][1]", |plan| {
            plan["drones"][0]["trajectory"]["control_m"] = json!([[[2, 5, 2], [7, 5]]]);
        }),
        ("air_delay.convection", |plan| {
            plan["air_delay"] = json!({"convection": [1.0, 0.6]})
        }),
        ("air_delay.convection", |plan| {
            plan["air_delay"] = json!({"convection": [0.0, 1.0]})
        }),
        ("air_delay", |plan| {
            plan["air_delay"] = json!({"convection": [0.6, 1.0], "k": 1})
        }),
        ("air_delay", |plan| {
            plan["format"] = json!("plan/1");
            plan["air_delay"] = json!({"convection": [0.6, 1.0]});
        }),
        ("quasi_static", |plan| {
            plan["quasi_static"] = json!(true);
            plan["air_delay"] = json!({"convection": [0.6, 1.0]});
        }),
        ("quasi_static", |plan| plan["quasi_static"] = json!(false)),
        ("bounds_m", |plan| {
            plan.as_object_mut().unwrap().remove("bounds_m");
        }),
    ];
    for (told, change) in cases {
        let found = field(&changed(LEAST, change));
        let whole = read(&changed(LEAST, change)).unwrap_err().to_string();
        assert!(
            found.contains(told) || whole.contains(told),
            "{told}: {found}, {whole}"
        );
    }
    // Straight pieces may say so; then they are held to what smooth ones are.
    let straight = changed(LEAST, |plan| {
        plan["drones"][0]["trajectory"]["control_m"] = json!([[]]);
        plan["air_delay"] = Value::Null;
    });
    assert_eq!(field(&straight), "read");
}

#[test]
fn a_plan_is_quasi_static_exactly_where_it_states_no_delay() {
    let plain = file(LEAST).plan;
    assert!(plain.quasi_static && plain.air_delay.is_none());
    let late = file(&changed(LEAST, |plan| {
        plan["air_delay"] = json!({"convection": [0.6, 1.0]});
    }));
    let convection = late.plan.air_delay.expect("stated").convection;
    assert_eq!(convection.factors(), [0.6, 1.0]);
    assert!(!late.plan.quasi_static);
    // What is written is read again.
    let written = serde_json::to_string(&late.plan).unwrap();
    assert_eq!(file(&written).plan, late.plan);
    // The delay of a finding is one, too.
    let found = file(&changed(LEAST, |plan| {
        plan["air"] = json!({"density_kg_per_m3": 1.2, "jet": {"centreline": 10.11, "spreading": 0.07668, "origin": -5.817},
            "effects": {"wake_transport": {"lag_factor": 2.0}}});
    }));
    let convection = found.plan.air_delay.expect("of the finding").convection;
    assert_eq!(convection.factors(), [0.5, 0.5]);
    assert!(!found.plan.quasi_static);
    let before = file(&changed(LEAST, |plan| plan["format"] = json!("plan/1")));
    assert!(before.plan.quasi_static);
    assert!(before.remarks.iter().any(|it| it.contains("quasi-static")));
}

#[test]
fn numbers_that_are_not_physical_and_times_beyond_reason_are_malformed() {
    let cases: [fn(&mut Plan); 11] = [
        // More than any lifts, and faster air than any rotor's.
        |plan| plan.drones[0].trajectory.mass_kg.fill(100.0),
        |plan| {
            plan.drones[0].airframe.mass_kg = 100.0;
            plan.drones[0].trajectory.mass_kg.fill(100.0);
        },
        |plan| plan.drones[0].airframe.max_speed_mps = 1e9,
        |plan| plan.drones[0].airframe.body_radius_m = 1e7,
        |plan| plan.drones[0].air_limit = 1e6,
        |plan| plan.drones[0].airframe.max_descent_mps = Some(-1.0),
        |plan| plan.air.density_kg_per_m3 = 1e3,
        |plan| plan.air.jet.centreline = 1e9,
        |plan| plan.drones[0].trajectory.t_s[1] = 1e12,
        |plan| plan.margins.time_s = -0.1,
        |plan| plan.bounds_m.max.x = 1e12,
    ];
    for (k, change) in cases.into_iter().enumerate() {
        let mut file = file(LEAST);
        change(&mut file.plan);
        let found = planner::verify(&file.plan).violations;
        let is_told = |it: &planner::plan::Violation| it.kind == ViolationKind::Malformed;
        assert!(found.iter().any(is_told), "case {k}: {found:?}");
    }
}

#[test]
fn every_key_of_a_plan_stands_in_its_schema_and_the_other_way_round() {
    let schema = schema().to_value();
    let plan: Value = serde_json::to_value(&file(LEAST).plan).unwrap();
    let keys = |value: &Value| -> Vec<String> {
        let object = value.as_object().unwrap();
        object.keys().cloned().collect()
    };
    let of_schema = |at: &Value| keys(&at["properties"]);
    let properties = of_schema(&schema);
    assert!(keys(&plan).iter().all(|key| properties.contains(key)));
    let drone = of_schema(&schema["$defs"]["DronePlan"]);
    assert!(
        keys(&plan["drones"][0])
            .iter()
            .all(|key| drone.contains(key))
    );
    let airframe = of_schema(&schema["$defs"]["Airframe"]);
    assert!(
        keys(&plan["drones"][0]["airframe"])
            .iter()
            .all(|key| airframe.contains(key))
    );
    let required = |at: &Value| at["required"].clone();
    assert_eq!(required(&schema), json!(["format", "bounds_m", "drones"]));
    let drone = required(&schema["$defs"]["DronePlan"]);
    assert_eq!(drone, json!(["name", "airframe", "trajectory"]));
}

const WORLD: &str = r#"Scenario(name: "asked", bounds_m: (min: (0, 0, 0), max: (20, 10, 8)),
    obstacles: [(name: "rack", min_m: (9, 4, 0), max_m: (11, 6, 3))],
    zones: [(name: "desk", min_m: (0, 8, 0), max_m: (2, 10, 2), air_limit_mps: 1.5)],
    drones: [
        (name: "a", airframe: "offboard-2", start_m: (1, 1, 1), at_end: Land,
         tasks: [(to_m: (15, 1, 2), dwell_s: 3, load_kg: 0.4), (to_m: (15, 8, 2), load_kg: 0)]),
        (name: "b", airframe: "kolibri", start_m: (18, 9, 4), tasks: [(to_m: (3, 3, 4), dwell_s: 2)]),
    ])"#;

#[test]
fn a_plan_is_held_against_its_scenario() {
    let world = read_world(WORLD).unwrap();
    let outcome = planner::plan_world(&world, &Control::QUIET).unwrap();
    let plan = outcome.into_planned().unwrap().plan;
    assert_eq!(missing(&world, &plan), Vec::<String>::new());
    // What it does not name may be given up.
    let by_weaker_rules = |plan: &mut Plan| {
        plan.drones[1].trajectory.control_m.clear();
        plan.air_delay = None;
    };
    let weaker = broken(plan.clone(), by_weaker_rules);
    assert_eq!(missing(&world, &weaker), Vec::<String>::new());
    let named = WORLD.replace(
        "zones:",
        "air: (convection: (0.6, 1.0)), planning: (motion: Smooth), zones:",
    );
    let world = read_world(&named).unwrap();
    assert_eq!(missing(&world, &plan), Vec::<String>::new());
    let lacks: [Change<Plan>; 16] = [
        ("`b` is not in the plan", |plan| drop(plan.drones.pop())),
        ("`c` is not in the scenario", |plan| {
            plan.drones[1].name = "c".to_owned()
        }),
        ("task 1 at", |plan| {
            let t_s = &mut plan.drones[1].trajectory.t_s;
            *t_s.last_mut().unwrap() -= 0.5;
            plan.drones[1].at_end = AtEnd::Leave;
        }),
        ("task 1 at", |plan| {
            let mass_kg = &mut plan.drones[0].trajectory.mass_kg;
            mass_kg.iter_mut().for_each(|it| *it = it.min(1.3));
        }),
        ("ends as", |plan| plan.drones[1].at_end = AtEnd::Leave),
        ("starts in another state", |plan| {
            plan.drones[0].at_start = AtStart::Landed
        }),
        ("from 2.00 s on alone", |plan| {
            plan.drones[1].enters_s = Some(2.0)
        }),
        ("may turn in no time", |plan| {
            plan.drones[1].trajectory.control_m.clear()
        }),
        ("convection is down to 0.6", |plan| plan.air_delay = None),
        ("other bounds", |plan| plan.bounds_m.max.z = 9.0),
        ("obstacle `rack` is not in the plan", |plan| {
            plan.obstacles.clear()
        }),
        ("obstacle `rack` of the plan is not", |plan| {
            let mut another = plan.obstacles[0].clone();
            if let Solid::Box { max_m, .. } = &mut another.shape {
                max_m.z += 0.5;
            }
            plan.obstacles.push(another);
        }),
        ("zone `desk`", |plan| {
            plan.zones[0].air_limit_mps = Some(1.6)
        }),
        ("other air", |plan| plan.air.density_kg_per_m3 *= 1.01),
        ("air_limit", |plan| plan.drones[0].air_limit = 0.4),
        ("another airframe", |plan| {
            plan.drones[0].airframe.mass_kg *= 0.9
        }),
    ];
    for (told, change) in lacks {
        let mut plan = plan.clone();
        change(&mut plan);
        let found = missing(&world, &plan);
        assert!(
            found.iter().any(|it| it.contains(told)),
            "{told}: {found:?}"
        );
    }
}

#[test]
fn no_two_bodies_come_nearer_than_the_closest_approach() {
    let spread = |k: usize, step: f64| (k as f64 * step).fract();
    let place = |k: usize| [40.0, 40.0, 12.0].map(|side_m| side_m * spread(k, 0.618 + side_m));
    let body_m = airflow::Airframe::preset("kolibri").unwrap().tip_radius_m();
    let mut near = 0;
    for fleet in 0..40 {
        let legs = (0..2 + fleet % 9).map(|k| {
            let n = 20 * fleet + 2 * k;
            let until_s = 12.0 + spread(n, 0.37);
            drone(
                &format!("d{k}"),
                "kolibri",
                &[(spread(n, 0.71), place(n)), (until_s, place(n + 1))],
            )
        });
        let mut drones: Vec<DronePlan> = legs.collect();
        // On the ground side by side: nearer than most, and no approach.
        for x_m in [39.0, 39.3] {
            let mut rests = drone(
                &format!("at {x_m}"),
                "kolibri",
                &[(0.0, [x_m, 39.0, 0.096])],
            );
            rests.at_start = AtStart::Landed;
            rests.airborne_s = (0.0, Some(0.0));
            drones.push(rests);
        }
        let plan = plan(drones);
        let mut least_m = f64::INFINITY;
        for sample in plan.sample(200.0) {
            let at_m: Vec<_> = sample.position_m.into_iter().flatten().collect();
            for k in 0..at_m.len() - 2 {
                for other in k + 1..at_m.len() {
                    least_m = least_m.min((at_m[k] - at_m[other]).norm() - 2.0 * body_m);
                }
            }
        }
        let text = serde_json::to_string(&plan).unwrap();
        let found = examine(&file(&text), false).closest.expect("they fly");
        // Between two samples both fly on by 5 ms, at up to 5 m/s.
        assert!(
            (-0.05..1e-6).contains(&(found.gap_m - least_m)),
            "{fleet}: {found:?} {least_m}"
        );
        near += usize::from(found.gap_m < 1.0);
    }
    assert!((1..39).contains(&near), "{near}");
}

#[test]
fn a_drone_that_flies_off_and_back_keeps_no_dwell() {
    let world = r#"(name: "w", bounds_m: (min: (0, 0, 0), max: (10, 10, 5)),
        drones: [(name: "k", airframe: "kolibri", start_m: (1, 1, 1), tasks: [(to_m: (5, 5, 2), dwell_s: 5)])],
        planning: (time_margin_s: 0, tracking_m: 0))"#;
    let world = read_world(world).unwrap();
    let stays_within = |off_m: f64| {
        let text = r#"{"format": "plan/2", "bounds_m": {"min": [0, 0, 0], "max": [10, 10, 5]},
            "air_delay": {"convection": [0.6, 1.0]}, "quasi_static": false,
            "drones": [{"name": "k", "airframe": "kolibri", "arrives_s": 9.0,
            "trajectory": {"t_s": [0, 4, 9], "position_m": [[1, 1, 1], [5, 5, 2], [5, 5, 2]],
                "control_m": [[], [[5, 5, 2], [5, 5, 2]]], "turns_at_once": true}}]}"#;
        let mut plan = file(text).plan;
        plan.drones[0].trajectory.control_m[1][0].x += off_m;
        missing(&world, &plan)
    };
    // At four ninths of the way to its control point.
    assert_eq!(stays_within(2.2e-3), [""; 0]);
    for off_m in [2.3e-3, 4.0] {
        let lacks = stays_within(off_m);
        assert!(
            lacks[0].starts_with("`k`: its last dwell ends at 14"),
            "{lacks:?}"
        );
    }
}

/// A flight at 20 Hz with noise of a centimetre: rises, flies level, lands; the second passes below
/// the first at a height (m).
fn log(below_m: f64) -> String {
    let mut text = "t_s,drone,x_m,y_m,z_m,battery\n".to_owned();
    let noise =
        |k: u32| 0.02 * (f64::from(k.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24) - 0.5);
    for k in 0..400_u32 {
        let t_s = f64::from(k) / 20.0;
        let level = (1.5 * (t_s - 6.0)).clamp(0.0, 9.0);
        let rise = |top_m: f64| {
            0.1 + (0.5 * t_s - 0.5)
                .clamp(0.0, top_m - 0.1)
                .min((18.0 - t_s).max(0.0))
        };
        let places = [
            ("a", [2.0 + level, 4.0, rise(2.5)]),
            ("b", [11.0 - level, 4.0, rise(2.5 - below_m)]),
        ];
        for (n, (name, place)) in (0..).zip(places) {
            let [x, y, z] =
                [0, 1, 2].map(|axis| place[axis as usize] + noise(6 * k + 3 * n + axis));
            text += &format!(
                "{:.3},{name},{x:.3},{y:.3},{z:.3},87\n",
                1_700_000_000.0 + t_s
            );
        }
    }
    text
}

const FLEET: &str = r#"Fleet(airframe: "kolibri", drones: [(name: "b", airframe: "own", air_limit: 0.6)],
    airframes: {"own": (mass_kg: 0.25, propeller_diameter_m: 0.08, motor_distance_m: 0.12)})"#;

fn flown(text: &str, fleet: &str) -> Result<PlanFile, FlownError> {
    let none = |file: &str| Err(format!("`{file}` was not given"));
    samples_as_plan("log", &read_samples(text)?, fleet, &Files::new(&none))
}

#[test]
fn a_log_at_20_hz_is_judged_by_what_was_flown() {
    let apart = flown(&log(1.5), FLEET).unwrap();
    let found = examine(&apart, true);
    assert!(
        found.plan.violations.is_empty(),
        "{:?}",
        found.plan.violations
    );
    let drones = &found.plan.drones;
    assert!(
        drones
            .iter()
            .all(|it| it.at_start == AtStart::Landed && it.at_end == AtEnd::Land)
    );
    assert!(drones[0].airborne_s.0 > 0.8 && drones[0].airborne_s.1 < Some(18.2));
    assert!(
        apart
            .remarks
            .iter()
            .any(|it| it.contains("floor is at z = 0 m")),
        "{:?}",
        apart.remarks
    );
    // Half a metre below another it is in the downwash; at its height the bodies meet.
    let below = examine(&flown(&log(0.45), FLEET).unwrap(), false)
        .plan
        .violations;
    let is_told = |kind: ViolationKind| below.iter().any(|it| it.kind == kind && it.drone == "b");
    assert!(is_told(ViolationKind::Air), "{below:?}");
    let meet = examine(&flown(&log(0.0), FLEET).unwrap(), false)
        .plan
        .violations;
    assert!(
        meet.iter().any(|it| it.kind == ViolationKind::Collision),
        "{meet:?}"
    );
}

#[test]
fn a_drone_of_a_log_that_stands_at_zero_or_in_noise_below_it_stands_on_the_floor() {
    let fleet = r#"Fleet(airframe: "matrice-300")"#;
    for (z_m, floor) in [("0", "z = 0 m"), ("-0.01", "z = -0.01 m")] {
        let rows = "t_s,drone,x_m,y_m,z_m\n0,a,1,1,2\n5,a,5,1,2\n10,a,9,1,2\n";
        let file = flown(&format!("{rows}0,b,5,1,{z_m}\n10,b,5,1,{z_m}\n"), fleet).unwrap();
        let told = &file.remarks;
        assert!(told.iter().any(|it| it.contains(floor)), "{told:?}");
        assert_eq!(file.plan.drones[1].at_start, AtStart::Landed);
        assert_eq!(examine(&file, false).plan.violations, []);
    }
}

/// A log whose samples of one drone end in the air: another flies through its place later.
#[test]
fn a_drone_of_a_log_whose_samples_end_in_the_air_hovers_on() {
    let fleet = r#"Fleet(airframe: "offboard-2")"#;
    let header = "t_s,drone,x_m,y_m,z_m\n";
    let meet = |rows: &str| {
        let file = flown(&format!("{header}{rows}"), fleet).unwrap();
        let violations = examine(&file, false).plan.violations;
        let meet = |it: &planner::plan::Violation| it.kind == ViolationKind::Collision;
        (violations.iter().any(meet), file.remarks.join("\n"))
    };
    let ended = "0,a,2,0,3\n6,a,2,0,3\n0,b,2,6,3\n20,b,2,-6,3\n";
    let (is_hit, told) = meet(ended);
    assert!(is_hit, "{told}");
    let said = "`a`: its samples end at 6.0 s in the air, 14.0 s before the log's";
    assert!(told.contains(said), "{told}");
    // Samples of one moment, and of a drone that comes last of all.
    assert!(meet("0,a,2,0,2\n0,b,2,0.1,2\n").0);
    assert!(!meet("0,a,2,0,2\n0,b,2,6,2\n").0);
    assert!(!meet("0,a,2,0,3\n10,a,2,0,3\n20,b,2,6,3\n").0);
}

#[test]
fn what_is_wrong_with_a_log_is_reported_with_its_line() {
    let told = |text: &str, fleet: &str| flown(text, fleet).unwrap_err().to_string();
    assert!(told("t_s,drone,x_m\n0,a,1\n", FLEET).contains("y_m, z_m"));
    assert!(told("t_s,drone,x_m,y_m,z_m\n", FLEET).contains("no rows"));
    let twice = "t_s,drone,x_m,y_m,z_m,x_m\n0,a,1,1,1,9\n";
    assert!(told(twice, FLEET).starts_with("line 1: the column `x_m`"));
    let rows = "t_s,drone,x_m,y_m,z_m\n0,a,1,1,1\n1,a,1,one,1\n";
    assert!(
        told(rows, FLEET).starts_with("line 3: `y_m` is `one`"),
        "{}",
        told(rows, FLEET)
    );
    let leaps = told(
        "t_s,drone,x_m,y_m,z_m\n0,a,1,1,1\n0.05,a,51,1,1\n0.1,a,1,1,1\n",
        FLEET,
    );
    assert!(
        leaps.contains("line 3: `a` is flown at 1000 m/s"),
        "{leaps}"
    );
    let several = "t_s,drone,x_m,y_m,z_m\n0,a,1,x,y\n1,a,1,1\n2,a,1,x,1\n";
    let told_all = told(several, FLEET);
    for what in [
        "lines 2, 4: `y_m` is `x`",
        "line 2: `z_m` is `y`",
        "line 3: 4 columns, 5 expected",
    ] {
        assert!(told_all.contains(what), "{told_all}");
    }
    let back = "t_s,drone,x_m,y_m,z_m\n1,a,1,1,1\n0.5,a,1,1,1\n";
    assert!(told(back, FLEET).starts_with("line 3: `a` is at 0.5 s"));
    let good = "t_s,drone,x_m,y_m,z_m\n0,a,1,1,1\n1,a,1,1,1\n";
    assert!(told(good, "Fleet()").contains("`a` of the log has no airframe"));
    assert!(told(good, r#"(airframe: "kolibrri")"#).contains("did you mean `kolibri`"));
    assert!(told(good, FLEET).contains("`b` is not in the log"));
}

/// A hundred drones at one place and two beside it: the crowd is named, pair by pair up to a point,
/// the rest of its pairs counted, and what else is wrong is not forgotten.
#[test]
fn of_a_crowd_at_one_place_the_worst_pairs_are_reported_and_the_rest_counted() {
    let text = changed(LEAST, |plan| {
        let one =
            json!({"airframe": "kolibri", "trajectory": {"t_s": [0], "position_m": [[5, 8, 4]]}});
        let named = |k: usize, place_m: [f64; 3]| {
            let mut drone = one.clone();
            drone["name"] = json!(format!("c{k}"));
            drone["trajectory"]["position_m"] = json!([place_m]);
            drone
        };
        let drones = plan["drones"].as_array_mut().expect("a list");
        drones.extend((0..100).map(|k| named(k, [5.0, 8.0, 4.0])));
        drones.push(named(100, [1.0, 8.0, 4.0]));
        drones.push(named(101, [1.1, 8.0, 4.0]));
    });
    let found = examine(&file(&text), false);
    let collisions = found.plan.violations.iter();
    let collisions = collisions.filter(|it| it.kind == ViolationKind::Collision);
    let pairs: Vec<(&str, Option<&str>)> = collisions
        .map(|it| (it.drone.as_str(), it.with.as_deref()))
        .collect();
    assert_eq!(pairs.len() + found.omitted, 100 * 99 / 2 + 1);
    assert_eq!(pairs.iter().filter(|(one, _)| *one == "c0").count(), 64);
    assert!((0..99).all(|k| pairs.iter().any(|(one, _)| *one == format!("c{k}"))));
    assert!(pairs.contains(&("c100", Some("c101"))));
}

/// Thousands on one path: the crowd is named, a few pairs of each are judged, the rest counted, and
/// what is not judged is said. A drone elsewhere is judged as ever.
#[test]
fn of_thousands_on_one_path_a_few_pairs_each_are_judged_and_the_rest_counted() {
    let text = changed(LEAST, |plan| {
        let points = 0..60;
        let t_s: Vec<f64> = points.clone().map(|k| 0.25 * f64::from(k)).collect();
        let place_m = |k: i32| [3.0 + 0.2 * f64::from(k), 8.0 + 0.1 * f64::from(k % 2), 4.0];
        let places_m: Vec<[f64; 3]> = points.map(place_m).collect();
        let drones = plan["drones"].as_array_mut().expect("a list");
        drones.extend((0..2000).map(|k| {
            json!({"name": format!("c{k}"), "airframe": "kolibri",
                "trajectory": {"t_s": t_s, "position_m": places_m}})
        }));
        drones[0]["trajectory"]["position_m"] = json!([[1, 5, 2], [21, 5, 2]]);
    });
    let found = examine(&file(&text), true);
    assert_eq!(found.crowded, 2000);
    let of = |kind: ViolationKind| {
        let violations = found.plan.violations.iter();
        violations.filter(move |it| it.kind == kind)
    };
    let collisions = of(ViolationKind::Collision).count();
    assert_eq!(collisions + found.omitted, 2000 * 1999 / 2);
    assert!(collisions < 10_000, "{collisions}");
    let outside: Vec<&str> = of(ViolationKind::Bounds)
        .map(|it| it.drone.as_str())
        .collect();
    assert!(
        !outside.is_empty() && outside.iter().all(|it| *it == "k"),
        "{outside:?}"
    );
    let closest = found.closest.expect("two bodies");
    assert!(closest.gap_m < -0.1, "{closest:?}");
    assert!(found.late.iter().all(Option::is_none));
}
