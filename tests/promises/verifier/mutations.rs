//! One plan of each kind under two hundred changes: whatever moves a drone, or changes its mass,
//! its limits or what is claimed of it, is named.
//!
//! How the test decides: the plan is checked against its scenario, as `plan check --scenario` does.
//! A change of anything that the scenario fixes, or that follows from the rest, must be named: by a
//! violation, a figure that differs, or a lack. A point moved, a time shifted or a limit tightened
//! may make another good plan, with all that it claims still so; that it is one, samples say that
//! share no code with the verifier.

use planner::plan::file::read;
use planner::replan::change::Change;
use planner::scenario::missing;
use planner::scenario::world::Task;
use planner::verify::examination::examine;
use planner::verify::lateness;
use planner::{Control, Running, World};
use serde_json::{Value, json};

use crate::planner::sampler;

/// A small generator of its own: xorshift64*.
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    /// Between a tenth and ten tenths, of either sign.
    fn share(&mut self) -> f64 {
        let share = 0.1 + 0.9 * (self.next() % 1000) as f64 / 1000.0;
        if self.next().is_multiple_of(2) {
            share
        } else {
            -share
        }
    }
}

/// A change of a plan, and whether it moves a drone or only makes it tighter: such a plan may be a
/// good one.
type Mutation = (&'static str, bool, fn(&mut Value, &mut Draw));

/// One of the drones.
fn drone<'v>(plan: &'v mut Value, draw: &mut Draw) -> &'v mut Value {
    let drones = plan["drones"].as_array_mut().unwrap();
    let index = draw.below(drones.len());
    &mut drones[index]
}

fn scaled(value: &mut Value, by: f64) {
    let number = value.as_f64().unwrap_or(0.0);
    // A figure of 0 is changed by a tenth and more of a unit.
    let changed = if number == 0.0 {
        by
    } else {
        number * (1.0 + by)
    };
    *value = json!(changed);
}

fn added(value: &mut Value, by: f64) {
    *value = json!(value.as_f64().unwrap_or(0.0) + by);
}

/// One entry of a list of a trajectory.
fn entry<'v>(plan: &'v mut Value, list: &str, draw: &mut Draw) -> &'v mut Value {
    let list = drone(plan, draw)["trajectory"][list]
        .as_array_mut()
        .unwrap();
    let index = draw.below(list.len());
    &mut list[index]
}

const CHANGES: [Mutation; 58] = [
    ("place", true, |plan, draw| {
        let axis = draw.below(3);
        let by_m = 0.5 * draw.share();
        let place = &mut entry(plan, "position_m", draw)[axis];
        *place = json!(place.as_f64().unwrap() + by_m);
    }),
    ("time", true, |plan, draw| {
        let by_s = 0.5 * draw.share();
        let time = entry(plan, "t_s", draw);
        *time = json!((time.as_f64().unwrap() + by_s).max(0.0));
    }),
    ("all times", true, |plan, draw| {
        let by_s = 0.5 * draw.share().abs();
        let times = drone(plan, draw)["trajectory"]["t_s"]
            .as_array_mut()
            .unwrap();
        times
            .iter_mut()
            .for_each(|it| *it = json!(it.as_f64().unwrap() + by_s));
    }),
    ("mass flown", false, |plan, draw| {
        let by = 0.3 * draw.share();
        scaled(entry(plan, "mass_kg", draw), by);
    }),
    ("mass_kg", false, |plan, draw| {
        scaled(
            &mut drone(plan, draw)["airframe"]["mass_kg"],
            0.3 * draw.share(),
        )
    }),
    ("propellers", false, |plan, draw| {
        drone(plan, draw)["airframe"]["propellers"] = json!(6)
    }),
    ("diameter", false, |plan, draw| {
        scaled(
            &mut drone(plan, draw)["airframe"]["propeller_diameter_m"],
            0.3 * draw.share(),
        );
    }),
    ("motors", false, |plan, draw| {
        scaled(
            &mut drone(plan, draw)["airframe"]["motor_distance_m"],
            0.3 * draw.share(),
        );
    }),
    ("width", false, |plan, draw| {
        scaled(
            &mut drone(plan, draw)["airframe"]["width_factor"],
            0.3 * draw.share(),
        );
    }),
    ("body", true, |plan, draw| {
        scaled(
            &mut drone(plan, draw)["airframe"]["body_radius_m"],
            0.3 * draw.share(),
        );
    }),
    ("smaller body", false, |plan, draw| {
        scaled(
            &mut drone(plan, draw)["airframe"]["body_radius_m"],
            -0.3 * draw.share().abs(),
        );
    }),
    ("faster", false, |plan, draw| {
        scaled(
            &mut drone(plan, draw)["airframe"]["max_speed_mps"],
            0.5 * draw.share().abs(),
        );
    }),
    ("slower", true, |plan, draw| {
        scaled(
            &mut drone(plan, draw)["airframe"]["max_speed_mps"],
            -0.5 * draw.share().abs(),
        );
    }),
    ("sinks faster", false, |plan, draw| {
        scaled(
            &mut drone(plan, draw)["airframe"]["max_descent_mps"],
            0.5 * draw.share().abs(),
        );
    }),
    ("hover velocity", false, |plan, draw| {
        scaled(
            &mut drone(plan, draw)["airframe"]["hover_induced_velocity_mps"],
            0.2 * draw.share(),
        );
    }),
    ("air_limit", false, |plan, draw| {
        scaled(&mut drone(plan, draw)["air_limit"], draw.share().abs())
    }),
    ("at_start", false, |plan, draw| {
        let drone = drone(plan, draw);
        drone["at_start"] = json!(if drone["at_start"] == "hover" {
            "landed"
        } else {
            "hover"
        });
    }),
    ("at_end", false, |plan, draw| {
        let drone = drone(plan, draw);
        drone["at_end"] = json!(if drone["at_end"] == "leave" {
            "hover"
        } else {
            "leave"
        });
    }),
    ("airborne from", false, |plan, draw| {
        let drone = drone(plan, draw);
        let from = drone["airborne_s"][0].as_f64().unwrap();
        drone["airborne_s"][0] = json!(from + 0.5 * draw.share().abs());
    }),
    ("airborne until", false, |plan, draw| {
        let drone = drone(plan, draw);
        let last_s = drone["trajectory"]["t_s"]
            .as_array()
            .unwrap()
            .last()
            .unwrap()
            .as_f64()
            .unwrap();
        drone["airborne_s"][1] = json!(last_s - 0.5 * draw.share().abs());
    }),
    ("arrives_s", false, |plan, draw| {
        scaled(&mut drone(plan, draw)["arrives_s"], 0.2 * draw.share())
    }),
    ("alone_s", false, |plan, draw| {
        scaled(&mut drone(plan, draw)["alone_s"], 0.2 * draw.share())
    }),
    ("worst_air_mps", false, |plan, draw| {
        added(&mut drone(plan, draw)["worst_air_mps"], 0.2 * draw.share())
    }),
    ("worst_air_from", false, |plan, draw| {
        drone(plan, draw)["worst_air_from"] = json!("x")
    }),
    ("dose_m", false, |plan, draw| {
        added(&mut drone(plan, draw)["dose_m"], 0.5 * draw.share())
    }),
    ("extra_energy_j", false, |plan, draw| {
        added(&mut drone(plan, draw)["extra_energy_j"], 2.0 * draw.share());
    }),
    ("fleet", false, |plan, draw| {
        let keys = [
            "makespan_s",
            "sum_of_arrivals_s",
            "sum_alone_s",
            "extra_energy_j",
        ];
        scaled(&mut plan["fleet"][keys[draw.below(4)]], 0.2 * draw.share());
    }),
    ("status", false, |plan, _| plan["status"] = json!("unsafe")),
    ("density", false, |plan, draw| {
        scaled(&mut plan["air"]["density_kg_per_m3"], 0.2 * draw.share())
    }),
    ("jet", false, |plan, draw| {
        let keys = ["centreline", "spreading", "origin"];
        scaled(
            &mut plan["air"]["jet"][keys[draw.below(3)]],
            0.2 * draw.share(),
        );
    }),
    ("superposition", false, |plan, _| {
        plan["air"]["superposition"] = json!("strongest")
    }),
    ("margins", false, |plan, _| {
        plan["margins"] = json!({"time_s": 0.0, "tracking_m": 0.0})
    }),
    ("bounds", false, |plan, draw| {
        let axis = draw.below(3);
        let corner = &mut plan["bounds_m"]["max"][axis];
        *corner = json!(corner.as_f64().unwrap() + draw.share());
    }),
    ("name", false, |plan, draw| {
        drone(plan, draw)["name"] = json!("another")
    }),
    ("less time margin", false, |plan, draw| {
        scaled(&mut plan["margins"]["time_s"], -draw.share().abs());
    }),
    ("less tracking margin", false, |plan, draw| {
        scaled(&mut plan["margins"]["tracking_m"], -draw.share().abs());
    }),
    ("larger margins", true, |plan, draw| {
        let key = ["time_s", "tracking_m"][draw.below(2)];
        scaled(&mut plan["margins"][key], draw.share().abs());
    }),
    ("no margins", false, |plan, _| {
        plan.as_object_mut().unwrap().remove("margins");
    }),
    ("clearance_m", false, |plan, draw| {
        scaled(&mut plan["clearance_m"], 0.5 * draw.share());
    }),
    ("climbs faster", false, |plan, draw| {
        scaled(
            &mut drone(plan, draw)["airframe"]["max_climb_mps"],
            0.5 * draw.share().abs(),
        );
    }),
    ("climbs or sinks slower", true, |plan, draw| {
        let key = ["max_climb_mps", "max_descent_mps"][draw.below(2)];
        scaled(
            &mut drone(plan, draw)["airframe"][key],
            -0.5 * draw.share().abs(),
        );
    }),
    ("brakes harder", false, |plan, draw| {
        let key = ["max_acceleration_mps2", "max_jerk_mps3"][draw.below(2)];
        scaled(
            &mut drone(plan, draw)["airframe"][key],
            0.5 * draw.share().abs(),
        );
    }),
    ("limited less", false, |plan, draw| {
        scaled(&mut drone(plan, draw)["air_limit"], draw.share().abs());
    }),
    ("limited more", true, |plan, draw| {
        scaled(&mut drone(plan, draw)["air_limit"], -draw.share().abs());
    }),
    ("a point left out", true, |plan, draw| {
        let trajectory = &mut drone(plan, draw)["trajectory"];
        let count = trajectory["t_s"].as_array().unwrap().len();
        let index = draw.below(count);
        for list in ["t_s", "position_m", "mass_kg"] {
            let list = trajectory[list].as_array_mut().unwrap();
            if list.len() > 1 {
                list.remove(index);
            }
        }
    }),
    ("a point twice", true, |plan, draw| {
        let trajectory = &mut drone(plan, draw)["trajectory"];
        let count = trajectory["t_s"].as_array().unwrap().len();
        let index = draw.below(count);
        for list in ["t_s", "position_m", "mass_kg"] {
            let list = trajectory[list].as_array_mut().unwrap();
            let entry = list[index].clone();
            list.insert(index, entry);
        }
    }),
    ("another's trajectory", false, |plan, _| {
        plan["drones"][0]["trajectory"] = plan["drones"][1]["trajectory"].clone();
    }),
    ("curved", false, |plan, draw| {
        drone(plan, draw)["trajectory"]["control_m"] = json!([[[1, 1, 1], [2, 2, 2]]]);
    }),
    ("air_delay", false, |plan, _| {
        plan["air_delay"] = json!({"convection": [0.6, 1.0]});
    }),
    ("quasi_static", false, |plan, _| {
        plan["quasi_static"] = json!(false)
    }),
    ("effects", false, |plan, _| {
        let air = plan["air"].as_object_mut().unwrap();
        if air.remove("effects").is_none() {
            air.insert(
                "effects".to_owned(),
                json!({"crossflow": {"wind_mps": [0.1, 0.0]}}),
            );
        }
    }),
    ("enters_s", false, |plan, draw| {
        drone(plan, draw)["enters_s"] = json!(0.5 * draw.share().abs());
    }),
    ("worst_air_at_s", false, |plan, draw| {
        let drone = drone(plan, draw);
        let at_s = drone["worst_air_at_s"].as_f64();
        drone["worst_air_at_s"] = json!(at_s.map_or(1.0, |at_s| at_s + 3.0));
    }),
    ("extra_energy_percent", false, |plan, draw| {
        added(&mut drone(plan, draw)["extra_energy_percent"], draw.share());
    }),
    ("may_be_late_s", false, |plan, draw| {
        added(&mut drone(plan, draw)["may_be_late_s"], 0.5 * draw.share());
    }),
    ("unplanned", false, |plan, draw| {
        let name = drone(plan, draw)["name"].clone();
        plan["unplanned"] = json!([{"name": name, "reason": "none"}]);
    }),
    ("a zone", false, |plan, draw| {
        let zones = plan["zones"].as_array_mut().unwrap();
        let Some(zone) = zones.first_mut() else {
            return;
        };
        match draw.below(4) {
            0 => scaled(&mut zone["air_limit_mps"], draw.share().abs()),
            1 => added(&mut zone["min_m"][draw.below(3)], draw.share().abs()),
            2 => zone["name"] = json!("another"),
            _ => drop(zones.pop()),
        }
    }),
    ("the air of a zone", false, |plan, draw| {
        let Some(air) = plan.get_mut("zone_air").map(|all| &mut all[0]) else {
            return;
        };
        match draw.below(5) {
            0 => added(&mut air["worst_air_mps"], draw.share()),
            1 => added(&mut air["at_most_mps"], draw.share()),
            2 => scaled(&mut air["at_most_mps"], draw.share()),
            3 => air["worst_air_from"] = json!("x"),
            _ => air["entered_by"] = json!(["x"]),
        }
    }),
];

/// What `plan check --scenario` names; empty: it finds the plan good.
fn named(world: &World, text: &str) -> Vec<String> {
    let file = match read(text) {
        Ok(file) => file,
        Err(error) => return vec![error.to_string()],
    };
    let states = |it: &planner::plan::DronePlan| it.may_be_late_s.is_some();
    let found = examine(&file, file.plan.drones.iter().any(states));
    let violations = found.plan.violations.iter().map(ToString::to_string);
    let differences = found.differences.iter().map(ToString::to_string);
    violations
        .chain(differences)
        .chain(missing(world, &found.plan))
        .collect()
}

/// Every change of a plan of one kind; how many went unnamed as another good plan.
fn all_named(kind: &str, world: &World, plan: &planner::Plan, seed: u64) -> usize {
    let good = serde_json::to_value(plan).unwrap();
    // Worked out only where it is stated.
    let mut with_lateness = plan.clone();
    let late = lateness::of_all(plan, &|| false);
    for (drone, late) in with_lateness.drones.iter_mut().zip(late) {
        drone.may_be_late_s = late.map(|it| it.late_s);
    }
    let with_lateness = serde_json::to_value(&with_lateness).unwrap();
    assert!(named(world, &with_lateness.to_string()).is_empty());
    assert_eq!(
        named(world, &good.to_string()),
        Vec::<String>::new(),
        "{kind}"
    );
    let mut draw = Draw(seed);
    let mut unnamed = 0;
    for k in 0..200 {
        let (what, may_be_good, change) = CHANGES[k % CHANGES.len()];
        let mut changed = match what {
            "may_be_late_s" => with_lateness.clone(),
            _ => good.clone(),
        };
        change(&mut changed, &mut draw);
        if changed == good {
            continue;
        }
        let text = changed.to_string();
        if !named(world, &text).is_empty() {
            continue;
        }
        assert!(may_be_good, "{kind}: change {k}, {what}, goes unnamed");
        // Samples that share no code with the verifier agree that it is another good plan; they
        // know nothing of what a finding adds to the air.
        unnamed += 1;
        if plan.air.effects.is_none() {
            sampler::assert_safe(&read(&text).unwrap().plan);
        }
    }
    unnamed
}

/// Plans a scenario of a few drones in a hall, with margins.
fn planned(place: &str, drones: &str) -> (World, planner::Plan) {
    let text = format!(
        r#"Scenario(name: "kind", bounds_m: (min: (0, 0, 0), max: (16, 10, 8)), {place}
        planning: (time_margin_s: 0.1, tracking_m: 0.05), drones: [{drones}])"#
    );
    let finding = |_: &str| {
        Ok("Finding(verdict: library, effects: (crossflow: (wind_mps: (0.2, 0.1))))".to_owned())
    };
    let world = planner::read_world_with(&text, &planner::Files::new(&finding)).unwrap();
    let outcome = planner::plan_world(&world, &Control::QUIET).unwrap();
    (world, outcome.into_planned().expect("a plan").plan)
}

const OVER: &str = r#"(name: "over", airframe: "offboard-2", start_m: (1, 5, 6), tasks: [(to_m: (15, 5, 6), dwell_s: 1)])"#;
const UNDER: &str = r#"(name: "under", airframe: "kolibri", start_m: (15, 4, 2), tasks: [(to_m: (2, 4, 2), dwell_s: 2), (to_m: (2, 8, 3))])"#;

#[test]
fn every_change_of_a_plan_with_payloads_or_zones_or_mixed_airframes_is_named() {
    let lifter = r#"(name: "lifter", airframe: "offboard-2", start_m: (8, 1, 3),
        tasks: [(to_m: (8, 9, 3), dwell_s: 1, load_kg: 0.3), (to_m: (3, 9, 3), load_kg: 0)])"#;
    let (world, plan) = planned("", &[OVER, UNDER, lifter].join(","));
    let unnamed = all_named("payload", &world, &plan, 11);
    let zone = r#"zones: [(name: "desk", min_m: (7, 3, 0), max_m: (9, 7, 1), air_limit_mps: 4),
        (name: "aisle", min_m: (4, 8, 0), max_m: (12, 10, 4), keep_out: true)],"#;
    let (world, plan) = planned(zone, &[OVER, UNDER].join(","));
    let unnamed = unnamed + all_named("zones", &world, &plan, 12);
    let large = r#"(name: "large", airframe: "matrice-300", start_m: (1, 1, 5), tasks: [(to_m: (14, 8, 5))])"#;
    let (world, plan) = planned("", &[OVER, UNDER, large].join(","));
    let unnamed = unnamed + all_named("mixed", &world, &plan, 13);
    assert!(unnamed < 45, "{unnamed}");
}

#[test]
fn every_change_of_a_plan_with_landings_or_a_finding_or_made_anew_is_named() {
    let lands = r#"(name: "lands", airframe: "offboard-1", start_m: (4, 2, 0.19775), at_start: Landed, at_end: Land,
        tasks: [(to_m: (12, 2, 3), dwell_s: 1)])"#;
    let (world, plan) = planned("", &[OVER, UNDER, lands].join(","));
    let unnamed = all_named("landing", &world, &plan, 14);
    let (world, plan) = planned(
        r#"air: (finding: "finding.ron"),"#,
        &[OVER, UNDER].join(","),
    );
    let unnamed = unnamed + all_named("finding", &world, &plan, 15);
    let (world, plan) = planned("", &[OVER, UNDER].join(","));
    let mut running = Running::new(world, plan).unwrap();
    let retasked = Change::Retasked {
        drone: "under".to_owned(),
        tasks: vec![Task {
            to_m: [3.0, 9.0, 4.0].into(),
            dwell_s: 1.0,
            load_kg: None,
            during_s: None,
        }],
    };
    let told = running.replan(3.0, &[retasked], &Control::QUIET);
    told.unwrap();
    let unnamed = unnamed + all_named("replanned", running.world(), running.plan(), 16);
    assert!(unnamed < 45, "{unnamed}");
}
