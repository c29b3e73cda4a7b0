//! Questions that are answered by a command each: what is said is what the model says, asked anew.

use std::fs;

use super::run;
use airflow::{Air, Airframe, Jet, Source, Superposition, Wake, mean_over_discs_mps};
use nalgebra::{Point3, Vector3};
use serde_json::Value;

fn wake(name: &str) -> Wake {
    let airframe = Airframe::preset(name).unwrap();
    let density = Air::default().density_kg_per_m3();
    Wake::new(&airframe, airframe.mass_kg(), density, &Jet::default())
}

/// Alpha of one drone below another, both hovering.
fn alpha(lower: &str, upper: &Wake, below_m: f64, beside_m: f64) -> f64 {
    let lower = Airframe::preset(lower).unwrap();
    let density = Air::default().density_kg_per_m3();
    let source = [Source {
        wake: upper,
        position_m: Point3::origin(),
        ends_at_z_m: f64::NEG_INFINITY,
    }];
    let at_m = Point3::new(beside_m, 0.0, -below_m);
    let mean = mean_over_discs_mps(&source, &lower.disc_points(), at_m, Superposition::Momentum);
    mean / lower.hover_induced_velocity_mps(lower.mass_kg(), density)
}

#[test]
fn a_separation_keeps_the_limit_and_its_table_is_the_model_s() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    for (lower, upper, limit) in [
        ("kolibri", "matrice-300", 0.3),
        ("crazyflie-2.1", "kolibri", 0.15),
    ] {
        let line =
            format!("separation {lower} --under {upper} --limit {limit} --speed 1.5 --format json");
        let (code, told, errors) = run(folder, &line);
        assert_eq!(code, Some(0), "{errors}");
        let told: Value = serde_json::from_str(&told).unwrap();
        let number = |of: &Value, key: &str| of[key].as_f64().unwrap();
        let (below_m, beside_m) = (number(&told, "below_m"), number(&told, "beside_m"));
        let wake = wake(upper);
        assert!((alpha(lower, &wake, below_m, 0.0) - limit).abs() < 1e-3 * limit);
        for k in 1..=200 {
            let depth_m = 1.5 * below_m * f64::from(k) / 200.0;
            assert!(
                alpha(lower, &wake, depth_m, beside_m) <= 1.02 * limit,
                "{depth_m}"
            );
            assert!(depth_m <= below_m || alpha(lower, &wake, depth_m, 0.0) <= limit);
        }
        let rows = told["rows"].as_array().unwrap();
        assert!(rows.len() >= 8);
        for row in rows {
            let said = number(row, "alpha");
            assert!((said - alpha(lower, &wake, number(row, "below_m"), 0.0)).abs() < 1e-9);
            assert!(
                (number(row, "power") - (said / 2.0 + (said * said / 4.0 + 1.0).sqrt())).abs()
                    < 1e-9
            );
            // What is over the limit hovering is so for a while in passing.
            assert_eq!(number(&row["passing"], "over_limit_s") > 0.0, said > limit);
        }
        let ellipsoid = &told["ellipsoid"];
        let (a, c) = (number(ellipsoid, "beside_m"), number(ellipsoid, "below_m"));
        assert!(c > below_m && a >= beside_m * 0.9);
        let files = told["files"].to_string();
        assert!(
            files.contains("separation.svg") && files.contains("report.html"),
            "{files}"
        );
    }
    let svg =
        fs::read_to_string(folder.join("out/separation/kolibri-under-matrice-300/separation.svg"))
            .unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("ellipsoid"));
    for (line, said) in [
        (
            "separation kolibri --under hornet",
            "no airframe is called `hornet`",
        ),
        (
            "separation kolibri --under kolibri --limit 0",
            "must be above 0",
        ),
    ] {
        let (code, _, errors) = run(folder, line);
        assert_eq!(code, Some(2));
        assert!(errors.contains(said), "{errors}");
        // Of the flag, and once for all values: it is not in the file.
        assert!(!errors.contains("two.ron:"), "{errors}");
        assert_eq!(errors.matches("error: ").count(), 1, "{errors}");
    }
}

#[test]
fn bodies_do_not_touch_at_any_separation_that_is_reported() {
    let desk = tempfile::tempdir().unwrap();
    let (lower, upper) = ("matrice-300", "crazyflie-2.1");
    let tips_m = |name: &str| Airframe::preset(name).unwrap().tip_radius_m();
    let bodies_m = tips_m(lower) + tips_m(upper);
    let line = format!("separation {lower} --under {upper}");
    let (_, told, _) = run(desk.path(), &line);
    let held = format!("{bodies_m:.2} m");
    for said in [
        format!("at least {held} straight below"),
        format!("straight below: from {held} down"),
    ] {
        assert!(told.contains(&said), "{told}");
    }
    let (_, told, _) = run(desk.path(), &format!("{line} --format json"));
    let told: Value = serde_json::from_str(&told).unwrap();
    for key in ["below_m", "beside_m"] {
        assert!(told[key].as_f64().unwrap() >= bodies_m, "{told}");
    }
}

#[test]
fn the_air_of_a_drone_is_quiet_where_it_is_said_to_be() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    let (code, told, errors) = run(folder, "air kolibri --less-than 0.8 --format json");
    assert_eq!(code, Some(0), "{errors}");
    let told: Value = serde_json::from_str(&told).unwrap();
    let number = |key: &str| told["quiet"][key].as_f64().unwrap();
    let wake = wake("kolibri");
    let speed =
        |below_m: f64, beside_m: f64| wake.axial_speed_mps(Vector3::new(beside_m, 0.0, -below_m));
    let below_m = number("below_m");
    assert!((speed(below_m, 0.0) - 0.8).abs() < 1e-3);
    for k in 1..=200 {
        let depth_m = 1.2 * below_m * f64::from(k) / 200.0;
        assert!(
            speed(depth_m, number("beside_m")) <= 0.8 * 1.01,
            "{depth_m}"
        );
        assert!(depth_m < below_m || speed(depth_m, 0.0) <= 0.8);
    }
    // Slower air takes longer, deeper air too.
    let rows = told["rows"].as_array().unwrap();
    let times: Vec<f64> = rows
        .iter()
        .map(|it| it["arrives_s"][1].as_f64().unwrap())
        .collect();
    assert!(times.is_sorted() && number("after_s") > times[0]);
    // At a faint limit the four jets are wider than twice their column.
    let (_, told, errors) = run(folder, "air kolibri --less-than 0.01 --format json");
    let told: Value = serde_json::from_str(&told).unwrap_or_else(|_| panic!("{errors}"));
    for row in told["rows"].as_array().unwrap() {
        let [depth_m, beside_m] = ["depth_m", "quiet_beside_m"].map(|key| row[key].as_f64());
        let (depth_m, beside_m) = (depth_m.unwrap(), beside_m.unwrap());
        for k in 0..200 {
            let there_m = beside_m * (1.001 + 0.01 * f64::from(k));
            assert!(speed(depth_m, there_m) <= 0.01, "{depth_m} {there_m}");
        }
    }
    let (code, told, _) = run(folder, "air matrice-300 --mass 8 --out here");
    assert_eq!(code, Some(0));
    assert!(
        told.contains("less than 1 m/s from") && told.contains("here/air.json"),
        "{told}"
    );
}

#[test]
fn a_width_factor_that_is_chosen_is_reported_wherever_its_jet_is() {
    let desk = tempfile::tempdir().unwrap();
    let told = |line: &str| {
        let (_, told, _) = run(desk.path(), line);
        told.matches("is chosen, not measured").count()
    };
    assert_eq!(told("air kolibri"), 0);
    assert_eq!(told("air mavic-3e"), 1);
    assert_eq!(told("separation kolibri --under elios-3"), 1);
    assert_eq!(told("separation elios-3 --under elios-3"), 1);
    assert_eq!(told("separation elios-3 --under mavic-3e"), 2);
}

/// Two drones cross; the second waits 2 s before it goes on, or it would touch the first.
fn crossing(waits_s: f64) -> String {
    let drone = |name: &str, trajectory: Value| serde_json::json!({"name": name, "airframe": "kolibri", "trajectory": trajectory});
    let goes_s = 4.0 + waits_s;
    let drones = [
        drone(
            "first",
            serde_json::json!({"t_s": [0, 10], "position_m": [[0, 5, 2], [10, 5, 2]]}),
        ),
        drone(
            "second",
            serde_json::json!({"t_s": [0, 2, goes_s - 2.0, goes_s + 3.0], "position_m": [[5, 0, 2], [5, 2, 2], [5, 2, 2], [5, 7, 2]]}),
        ),
    ];
    let plan = serde_json::json!({
        "format": "plan/1", "scenario": "crossing", "drones": drones,
        "bounds_m": {"min": [-1, -1, 0], "max": [12, 12, 6]},
    });
    plan.to_string()
}

#[test]
fn a_wait_is_explained_by_what_would_break_without_it() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    // Without its wait the second is at (5, 5) at 5 s, when the first is.
    fs::write(folder.join("plan.json"), crossing(2.0)).unwrap();
    let line = "explain plan.json --drone second --at 3 --format json";
    let (_, told, errors) = run(folder, line);
    let told: Value = serde_json::from_str(&told).expect(&errors);
    assert_eq!(told["page"], Value::Null, "there is none");
    fs::write(folder.join("plan.html"), "").unwrap();
    let (code, told, errors) = run(folder, line);
    assert_eq!(code, Some(0), "{errors}");
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(
        (&told["does"], &told["waits_for"]),
        (&"stop".into(), &"first".into()),
        "{told}"
    );
    assert_eq!(told["span_s"], serde_json::json!([2.0, 4.0]));
    let otherwise = told["otherwise"].as_array().unwrap();
    assert!(
        otherwise.iter().any(|it| it["kind"] == "collision"),
        "{told}"
    );
    assert_eq!(told["page"], "plan.html#t=3&drone=second");
    // As the page reads it: an address's fragment of fields.
    let odd = crossing(2.0).replace("second", "n\u{ba} 2 & #3=\u{fc}");
    fs::write(folder.join("odd.json"), odd).unwrap();
    let line = [
        "explain",
        "odd.json",
        "--drone",
        "n\u{ba} 2 & #3=\u{fc}",
        "--at",
        "3",
        "--format",
        "json",
    ];
    let (_, told, errors) = super::run_words(folder, &line);
    let told: Value = serde_json::from_str(&told).expect(&errors);
    assert_eq!(
        told["page"],
        "plan.html#t=3&drone=n%C2%BA%202%20%26%20%233%3D%C3%BC"
    );
    let (_, told, _) = run(folder, "explain plan.json --drone second --at 3");
    assert!(
        told.contains("It dwells, or waits for `first`") && told.contains("overlap by"),
        "{told}"
    );
    let (_, told, _) = run(folder, "explain plan.json --drone second --at 5");
    assert!(told.contains("flies at 1.00 m/s"), "{told}");
    // A stop that no other drone asks for is none.
    fs::write(folder.join("plan.json"), crossing(9.0)).unwrap();
    let (_, told, _) = run(
        folder,
        "explain plan.json --drone first --at 3 --format json",
    );
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["does"], "flies");
    let (code, _, errors) = run(folder, "explain plan.json --drone third --at 3");
    assert_eq!(code, Some(2));
    assert!(
        errors.contains("no drone is called `third`; there are first, second"),
        "{errors}"
    );
}

#[test]
fn what_a_wait_costs_is_one_figure_in_all_that_is_reported() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    let scenario = format!("{}/scenarios/warehouse.ron", env!("CARGO_MANIFEST_DIR"));
    run(
        folder,
        &format!("{scenario} --no-contrast --no-page --out why"),
    );
    let line = format!("explain why/plan.json --drone scan-5 --scenario {scenario} --at");
    let (_, told, errors) = run(folder, &format!("{line} 0 --format json"));
    let told: Value = serde_json::from_str(&told).expect(&errors);
    let stops: Vec<(f64, f64, String, Option<f64>)> =
        serde_json::from_value(told["stops"].clone()).unwrap();
    let costs = stops.iter().filter_map(|it| Some((it, it.3?)));
    let mut rests = costs.filter(|(it, costs_s)| *costs_s > it.1 - it.0);
    let (stop, costs_s) = rests.next().expect("it slows down for a wait");
    let (_, told, _) = run(folder, &format!("{line} {}", (stop.0 + stop.1) / 2.0));
    let said = format!("{costs_s:.2} s earlier");
    assert!(told.contains(&said), "{said}: {told}");
}

#[test]
fn a_wait_before_an_appointment_makes_no_drone_later_and_is_explained_all_the_same() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    // One gap for both; who comes second is early all the same.
    let scenario = r#"Scenario(name: "gap", bounds_m: (min: (0, 0, 0), max: (16, 6, 3)),
        obstacles: [(name: "w1", min_m: (7, 0, 0), max_m: (8, 2.5, 3)),
            (name: "w2", min_m: (7, 3.5, 0), max_m: (8, 6, 3))],
        drones: [
            (name: "a", airframe: "kolibri", start_m: (2, 3, 1.5),
                tasks: [(to_m: (14, 3, 1.5), during_s: (20, 24))]),
            (name: "b", airframe: "kolibri", start_m: (13, 3, 1.5),
                tasks: [(to_m: (1, 3, 1.5), during_s: (9, 12))]),
            (name: "c", airframe: "kolibri", start_m: (13, 4, 1.5),
                tasks: [(to_m: (1, 4, 1.5), during_s: (9.5, 12))]),
        ], planning: (cell_m: 0.5))"#;
    fs::write(folder.join("gap.ron"), scenario).unwrap();
    run(folder, "gap.ron --no-contrast --no-page --out gap");
    let line = "explain gap/plan.json --scenario gap.ron --drone a --at 4.1";
    let (_, told, errors) = run(folder, &format!("{line} --format json"));
    let json: Value = serde_json::from_str(&told).expect(&errors);
    assert_eq!(
        (&json["does"], &json["costs_s"]),
        (&"wait".into(), &0.0.into())
    );
    // The first whom it would meet.
    let other = &json["otherwise"][0]["with"];
    assert!(*other == "b" || *other == "c", "{json}");
    assert_eq!(json["waits_for"], *other, "{json}");
    let kinds = json["otherwise"].as_array().unwrap();
    assert!(
        kinds.iter().any(|it| it["kind"] == "collision_margin"),
        "{json}"
    );
    let (_, told, _) = run(folder, line);
    assert!(
        told.contains("it would be no earlier at its goal"),
        "{told}"
    );
}

#[test]
fn a_drone_that_has_not_come_or_has_left_is_reported_and_a_scenario_of_others_is_refused() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    let mut plan: Value = serde_json::from_str(&crossing(2.0)).unwrap();
    plan["drones"][1]["enters_s"] = 1.5.into();
    plan["drones"][1]["at_end"] = "leave".into();
    fs::write(folder.join("plan.json"), plan.to_string()).unwrap();
    for (at_s, said) in [
        (1.0, "It is not there: it comes at 1.50 s."),
        (12.0, "It is not there: it has left at 9.00 s."),
    ] {
        let line = format!("explain plan.json --drone second --at {at_s}");
        let (_, told, errors) = run(folder, &line);
        assert!(told.contains(said), "{told}{errors}");
        let (_, told, _) = run(folder, &format!("{line} --format json"));
        let told: Value = serde_json::from_str(&told).unwrap();
        let expected = ("not there".into(), Value::Null);
        assert_eq!(
            (&told["does"], &told["position_m"]),
            (&expected.0, &expected.1)
        );
    }
    let scenario = r#"Scenario(name: "x", bounds_m: (min: (0, 0, 0), max: (12, 12, 6)), drones: [
        (name: "second", airframe: "kolibri", start_m: (5, 1, 2)),
        (name: "third", airframe: "kolibri", start_m: (9, 9, 2)),
    ])"#;
    fs::write(folder.join("other.ron"), scenario).unwrap();
    let line = "explain plan.json --drone second --at 3 --scenario other.ron";
    let (code, _, errors) = run(folder, line);
    assert_eq!(code, Some(2));
    let said = "only the scenario has `third`, only the plan has `first`";
    assert!(errors.contains(said), "{errors}");
}

/// A smooth flight with a rest of a second and one of 0.19 s, from where it goes on to a place
/// (x, y in m); it does not say when it arrives.
fn with_rests(to_m: [f64; 2]) -> String {
    let at = |[x_m, y_m]: [f64; 2]| [x_m, y_m, 2.0];
    let [a, b, c, d] = [[1.0, 1.0], [3.0, 1.0], [5.0, 1.0], to_m].map(at);
    let plan = serde_json::json!({
        "format": "plan/1", "scenario": "rests", "bounds_m": {"min": [0, 0, 0], "max": [9, 9, 9]},
        "drones": [{"name": "k", "airframe": "kolibri", "trajectory": {
            "t_s": [1, 4, 5, 8, 8.1875, 12], "position_m": [a, b, b, c, c, d],
            "control_m": [[a, b], [], [b, c], [], [c, d]],
        }}],
    });
    plan.to_string()
}

#[test]
fn a_drone_at_rest_in_mid_flight_is_not_reported_to_have_not_begun() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("plan.json"), with_rests([5.0, 3.0])).unwrap();
    let rests = "It rests between two moves from 8.00 s to 8.19 s (0.19 s)";
    for (at_s, does, said) in [
        (0.5, "stands", "It stands: it has not begun"),
        (4.0, "stop", "It stops from 4.00 s to 5.00 s (1.00 s)"),
        (5.0, "stop", "It stops from 4.00 s to 5.00 s (1.00 s)"),
        (6.0, "flies", "It flies at"),
        (8.125, "rests", rests),
        (8.1875, "rests", rests),
        (12.0, "stands", "It stands: it is done"),
    ] {
        let line = format!("explain plan.json --drone k --at {at_s}");
        let (_, told, errors) = run(folder, &line);
        assert!(told.contains(said), "{at_s}: {told}{errors}");
        let (_, told, _) = run(folder, &format!("{line} --format json"));
        let told: Value = serde_json::from_str(&told).unwrap();
        assert_eq!(told["does"], does, "{at_s}");
    }
}

#[test]
fn slow_flight_is_a_stop_also_of_a_plan_that_does_not_say_when_its_drones_arrive() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("plan.json"), with_rests([7.0, 1.0])).unwrap();
    let (_, told, errors) = run(folder, "explain plan.json --drone k --at 8.125");
    let said = "It stops from 7.70 s to 8.80 s (1.10 s)";
    assert!(told.contains(said), "{told}{errors}");
}

#[test]
fn no_zone_is_said_to_be_a_drone_that_another_waits_for() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    let drone = |name: &str, t_s: &[f64], x_m: &[f64]| {
        let position_m: Vec<[f64; 3]> = x_m.iter().map(|&x_m| [x_m, 5.0, 11.9]).collect();
        serde_json::json!({"name": name, "airframe": "matrice-300", "trajectory": {"t_s": t_s, "position_m": position_m}})
    };
    // Beside one another they are too much for the zone.
    let drones = [
        drone("up", &[0.0, 2.0, 12.0, 16.0], &[1.0, 3.0, 3.0, 6.2]),
        drone("o2", &[0.0, 9.0, 14.0], &[7.8, 7.8, 15.0]),
    ];
    let plan = serde_json::json!({
        "format": "plan/1", "scenario": "zone", "drones": drones,
        "bounds_m": {"min": [0, 0, 0], "max": [20, 20, 12]},
        "zones": [{"name": "desk", "min_m": [6, 4, 0], "max_m": [8, 6, 1], "air_limit_mps": 3.0}],
    });
    fs::write(folder.join("plan.json"), plan.to_string()).unwrap();
    let line = "explain plan.json --drone up --at 5";
    let (_, told, errors) = run(folder, line);
    let said = "waits so that the air in zone `desk` keeps its limit";
    assert!(
        told.contains(said) && told.contains("the air in zone `desk` is over 3.00 m/s from"),
        "{told}{errors}"
    );
    let (_, told, _) = run(folder, &format!("{line} --format json"));
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["otherwise"][0]["kind"], "zone", "{told}");
    assert_eq!(told["waits_for"], Value::Null, "{told}");
}

#[test]
fn two_plans_are_compared_by_what_follows_from_them() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("a.json"), crossing(2.0)).unwrap();
    fs::write(folder.join("b.json"), crossing(0.125)).unwrap();
    let (code, told, errors) = run(folder, "compare a.json b.json --format json");
    assert_eq!(code, Some(1), "{errors}");
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["a"]["violations"], 0);
    assert!(told["b"]["violations"].as_u64().unwrap() > 0, "{told}");
    assert_eq!(
        told["drones"][0],
        serde_json::json!({"drone": "second", "arrives_s": [9.0, 7.125]})
    );
    assert_eq!(told["a"]["sum_of_arrivals_s"], 19.0);
    // One that is not planned arrives nowhere.
    let mut plan: Value = serde_json::from_str(&crossing(2.0)).unwrap();
    plan["unplanned"] = serde_json::json!([{"name": "second", "reason": ""}]);
    let trajectory = serde_json::json!({"t_s": [0], "position_m": [[5, 0, 2]]});
    plan["drones"][1]["trajectory"] = trajectory;
    fs::write(folder.join("stays.json"), plan.to_string()).unwrap();
    let (_, listed, errors) = run(folder, "compare stays.json a.json --format json");
    let listed: Value = serde_json::from_str(&listed).expect(&errors);
    let first = serde_json::json!([{"drone": "first", "arrives_s": [10.0, 10.0]}]);
    assert_eq!(listed["drones"], first);
    assert!(told["files"].to_string().contains("arrivals.svg"));
    assert_eq!(told["differs"], Value::Null);
}

#[test]
fn plans_of_different_scenarios_are_compared_with_a_remark_of_what_differs() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("a.json"), crossing(2.0)).unwrap();
    let mut other: Value = serde_json::from_str(&crossing(2.0)).unwrap();
    other["bounds_m"]["max"] = serde_json::json!([12, 12, 8]);
    other["drones"][0]["airframe"] = "crazyflie-2.1".into();
    other["drones"][0]["trajectory"]["position_m"][0] = serde_json::json!([0, 6, 2]);
    other["drones"][0]["trajectory"]["position_m"][1] = serde_json::json!([11, 7, 2]);
    other["drones"][1]["name"] = "third".into();
    other["cell_m"] = 0.5.into();
    fs::write(folder.join("b.json"), other.to_string()).unwrap();
    let (_, told, errors) = run(folder, "compare a.json b.json --format json");
    let told: Value = serde_json::from_str(&told).expect(&errors);
    let differs = serde_json::json!({
        "only_in_a": ["second"], "only_in_b": ["third"], "airframe": ["first"],
        "start": ["first"], "end": ["first"], "place": ["bounds"],
    });
    assert_eq!(told["differs"], differs);
    assert_eq!(told["a"]["cell_m"], Value::Null);
    assert_eq!(told["b"]["cell_m"], 0.5);
    let (_, told, _) = run(folder, "compare a.json b.json");
    for said in [
        "plans of different scenarios",
        "only in A: 1 drone, `second`",
        "only in B: 1 drone, `third`",
        "Planned in A alone: `second`.",
        "the place: other bounds",
        "cells (m)",
    ] {
        assert!(told.contains(said), "{said}: {told}");
    }
    let (_, told, _) = run(folder, "compare a.json a.json");
    assert!(!told.contains("different scenarios"), "{told}");
}

#[test]
fn a_sweep_plans_each_value_as_a_scenario_of_its_own_would_be() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    let scenario = |limit: f64| {
        format!(
            r#"Scenario(name: "two", bounds_m: (min: (0, 0, 0), max: (14, 6, 8)),
        drones: [
            (name: "m", airframe: "matrice-300", start_m: (1, 3, 7), tasks: [(to_m: (13, 3, 7))]),
            (name: "k", airframe: "kolibri", start_m: (13, 3, 2), tasks: [(to_m: (1, 3, 2))]),
        ], planning: (cell_m: 1, air_limit: {limit}))"#
        )
    };
    fs::write(folder.join("two.ron"), scenario(0.3)).unwrap();
    let (code, told, errors) = run(
        folder,
        "sweep two.ron --set planning.air_limit=0.1:0.9:0.4 --format json",
    );
    assert!(code == Some(0) || code == Some(1), "{errors}");
    let told: Value = serde_json::from_str(&told).unwrap();
    let rows = told["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 3);
    for row in rows {
        let world = planner::read_world(&scenario(row["value"].as_f64().unwrap())).unwrap();
        let outcome = planner::plan_world(&world, &planner::Control::QUIET).unwrap();
        let plan = &outcome.planned().unwrap().plan;
        assert_eq!(row["sum_of_arrivals_s"], plan.fleet.sum_of_arrivals_s);
        assert_eq!(row["status"], plan.status.as_str());
    }
    // Of another command's folder, and which rules are given up.
    fs::create_dir(folder.join("theirs")).unwrap();
    fs::write(folder.join("theirs/diagnosis.json"), "{}").unwrap();
    let slow = r#"Scenario(name: "slow", bounds_m: (min: (0, 0, 0), max: (14, 6, 8)),
        airframes: {"barge": (mass_kg: 6, propeller_diameter_m: 0.5, motor_distance_m: 0.9, max_acceleration_mps2: 0.1)},
        drones: [(name: "m", airframe: "barge", start_m: (1, 3, 5), tasks: [(to_m: (13, 3, 5))])])"#;
    fs::write(folder.join("slow.ron"), slow).unwrap();
    let line = "sweep slow.ron --set planning.air_limit=0.2,0.4";
    let (code, told, errors) = run(folder, line);
    assert_eq!(code, Some(0), "{errors}");
    let note = "at each value: planned in straight motion";
    assert!(told.contains(note), "{told}");
    let (_, told, _) = run(folder, &format!("{line} --format json"));
    let told: Value = serde_json::from_str(&told).unwrap();
    let notes = told["rows"][1]["notes"].to_string();
    assert!(notes.contains("takes 20"), "{told}");
    for (line, said) in [
        (
            "sweep two.ron --set planning.air_limit=1 --out theirs",
            "theirs holds what `plan diagnose` wrote",
        ),
        (
            "sweep two.ron --set planning.airlimit=1,2",
            "error: --set planning.airlimit=1,2: ",
        ),
        (
            "sweep two.ron --set planning.air_limit=0.1,400",
            "error: --set planning.air_limit=400: ",
        ),
        (
            "sweep two.ron --set planning.air_limit=-1,400",
            "error: --set planning.air_limit=-1,400: ",
        ),
        ("sweep two.ron --set air_limit=1", "SECTION.KEY"),
        (
            "sweep two.ron --set planning.seed=9007199254740993",
            "`9007199254740993` is too large",
        ),
    ] {
        let (code, _, errors) = run(folder, line);
        assert_eq!(code, Some(2), "{line}: {errors}");
        assert!(errors.contains(said), "{errors}");
    }
}
