//! `plan fly` as a person or a script meets it.

use std::fs;
use std::path::Path;

use super::run;
use serde_json::Value;

/// Two drones that fly towards one another where `apart_m` is 0, else past one another, and one
/// that crosses above a third.
fn plan(apart_m: f64) -> String {
    let drone = |name: &str, airframe: &str, from: [f64; 3], to: [f64; 3]| {
        format!(
            r#"{{"name": "{name}", "airframe": "{airframe}", "trajectory": {{"t_s": [0, 6], "position_m": [{from:?}, {to:?}]}}}}"#
        )
    };
    let y = 5.0 + apart_m;
    let drones = [
        drone("a", "kolibri", [2.0, 5.0, 2.0], [14.0, 5.0, 2.0]),
        drone("b", "kolibri", [14.0, y, 2.0], [2.0, y, 2.0]),
        drone("low", "kolibri", [8.0, 15.0, 2.0], [8.0, 15.0, 2.0]),
        drone("high", "offboard-2", [2.0, 15.0, 6.0], [14.0, 15.0, 6.0]),
    ];
    format!(
        r#"{{"format": "plan/1", "scenario": "test", "bounds_m": {{"min": [0, 0, 0], "max": [20, 20, 8]}}, "drones": [{}]}}"#,
        drones.join(",")
    )
}

#[test]
fn the_exit_code_says_whether_the_flight_is_within_limits() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("apart.json"), plan(2.0)).unwrap();
    fs::write(folder.join("head-on.json"), plan(0.0)).unwrap();
    let only_one = "--convection 1 --gusts 0";
    // The one above passes: more than the limit of 0.3 for a moment.
    let (code, told, _) = run(folder, &format!("fly apart.json {only_one} --out passed"));
    assert_eq!(code, Some(1), "{told}");
    assert!(told.contains("1 over their limit of air"), "{told}");
    assert!(told.contains("`low`") && !told.contains("touch:"), "{told}");
    for file in ["flight.json", "flight.svg", "report.html", "plan.html"] {
        assert!(folder.join("passed").join(file).exists(), "{file}");
    }
    let (code, told, _) = run(folder, &format!("fly head-on.json {only_one} --out met"));
    assert_eq!(code, Some(1));
    assert!(told.contains("Bodies touch: `a`, `b`"), "{told}");
    // Until before anything happens.
    let early = format!("fly apart.json {only_one} --until 0.5 --out early");
    let (code, told, _) = run(folder, &early);
    assert_eq!(code, Some(0), "{told}");
    assert!(told.contains("within limits"), "{told}");
}

/// What a plan.html shows, as data.
pub(super) fn scene(page: &Path) -> Value {
    let html = fs::read_to_string(page).unwrap();
    let data = html.split_once("type=\"application/json\">").unwrap().1;
    serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn the_page_of_a_flight_says_of_a_plan_without_results_what_the_verifier_finds() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("plan.json"), plan(0.0)).unwrap();
    let (code, ..) = run(folder, "check plan.json --out checked");
    assert_eq!(code, Some(1));
    let line = "fly plan.json --convection 1 --gusts 0 --until 0.5 --out flown";
    let (_, _, errors) = run(folder, line);
    let [flown, checked] = ["flown", "checked"].map(|it| scene(&folder.join(it).join("plan.html")));
    assert_eq!(flown["status"], "unsafe", "{errors}");
    for key in ["status", "violations", "violation_count"] {
        assert_eq!(flown[key], checked[key], "{key}");
    }
    for key in [
        "arrives_s",
        "worst_air_mps",
        "worst_air_from",
        "may_be_late_s",
    ] {
        for k in 0..4 {
            assert_eq!(flown["drones"][k][key], checked["drones"][k][key], "{key}");
        }
    }
    assert_eq!(flown["drones"][0]["arrives_s"], 6.0);
    assert!(flown["drones"][2]["worst_air_mps"].as_f64() > Some(1.0));
}

#[test]
fn drones_without_a_path_are_named() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    let unplanned = r#"{"unplanned": [{"name": "low", "reason": "blocked"}], "format""#;
    let plan = plan(2.0).replacen(r#"{"format""#, unplanned, 1);
    fs::write(folder.join("plan.json"), plan).unwrap();
    let line = "fly plan.json --convection 1 --gusts 0 --until 0.5";
    let (_, told, errors) = run(folder, line);
    assert!(
        told.contains("Not planned, stays at its start: `low`."),
        "{told}{errors}"
    );
    let (_, told, _) = run(folder, &format!("{line} --format json"));
    let told: Value = serde_json::from_str(&told).expect("one object");
    assert_eq!(told["unplanned"], serde_json::json!(["low"]));
}

#[test]
fn one_seed_is_one_answer_on_any_number_of_threads() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("plan.json"), plan(2.0)).unwrap();
    let flown = |jobs: u32, seed: u32, out: &str| {
        let arguments = format!(
            "fly plan.json --jobs {jobs} --seed {seed} --controller both --out {out} --format json"
        );
        let (code, told, _) = run(folder, &arguments);
        assert_eq!(code, Some(1));
        let told: Value = serde_json::from_str(&told).expect("one object");
        assert_eq!(told["format"], "flight/1");
        // Two controllers, two speeds of the air, four kinds of feed-forward.
        assert_eq!(told["flights"].as_array().unwrap().len(), 16);
        fs::read(folder.join(out).join("flight.json")).unwrap()
    };
    let one = flown(1, 7, "one");
    assert_eq!(one, flown(2, 7, "two"));
    assert_ne!(one, flown(2, 8, "three"));
}

#[test]
fn logs_are_flown_too() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    let mut log = String::from("t_s,drone,x_m,y_m,z_m\n");
    for k in 0..100 {
        let t_s = f64::from(k) * 0.05;
        log += &format!("{t_s},a,{},1,1.5\n", 1.0 + 0.5 * t_s);
    }
    fs::write(folder.join("log.csv"), log).unwrap();
    fs::write(folder.join("fleet.ron"), r#"(airframe: "crazyflie-2.1")"#).unwrap();
    let (code, told, error) = run(folder, "fly log.csv --airframes fleet.ron --gusts 0");
    assert_eq!(code, Some(0), "{told}{error}");
    assert!(told.contains("1 drone flown"), "{told}");
    // Its battery is known, and what the log does not claim is not told.
    assert!(
        told.contains(" %\n") && !told.contains("not known"),
        "{told}"
    );
}

#[test]
fn the_table_says_what_flight_json_holds() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("plan.json"), plan(2.0)).unwrap();
    let line = "fly plan.json --convection 1 --gusts 0 --feed-forward matched --out out";
    let (_, told, errors) = run(folder, line);
    let row = told.lines().find(|it| it.trim_start().starts_with("low "));
    let row = row.unwrap_or_else(|| panic!("{told}{errors}"));
    let text = fs::read_to_string(folder.join("out/flight.json")).unwrap();
    let flown: Value = serde_json::from_str(&text).unwrap();
    let flights = flown["flights"].as_array().unwrap();
    let low = |flight: &Value, key: &str| flight["drones"][2][key].as_f64().unwrap();
    // Over what it takes in calm air.
    let percent = |it: &Value| {
        let extra_j = low(it, "extra_energy_j");
        100.0 * extra_j / (low(it, "energy_j") - extra_j)
    };
    let most = flights.iter().map(percent).fold(0.0, f64::max);
    assert!(row.contains(&format!("{most:+.1} %")), "{most}: {row}");
    let with_mm = 1e3 * low(&flights[1], "altitude_rms_by_air_m");
    assert!(
        row.contains(&format!("{with_mm:.0} mm")),
        "{with_mm}: {row}"
    );
}

#[test]
fn a_drone_that_draws_more_than_its_battery_holds_is_warned_of() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("plan.json"), plan(2.0)).unwrap();
    fs::write(folder.join("small.ron"), "(others: (battery_wh: 0.01))").unwrap();
    let line = "fly plan.json --convection 1 --gusts 0 --until 0.5 --vehicles small.ron";
    let (_, told, errors) = run(folder, line);
    let said = "Warning: more than a full battery holds: ";
    assert!(told.contains(said), "{told}{errors}");
    assert!(!errors.contains("airframe"), "{errors}");
    fs::write(folder.join("slip.ron"), r#"(airframes: {"kolibry": ()})"#).unwrap();
    for line in ["fly plan.json --until 0.5", "check plan.json"] {
        let (_, _, errors) = run(folder, &format!("{line} --vehicles slip.ron"));
        let note = "no drone of the plan has an airframe `kolibry`";
        assert!(errors.contains(note), "{line}: {errors}");
    }
    let line = line.replace(" --vehicles small.ron", "");
    assert!(!run(folder, &line).1.contains(said));
}

#[test]
fn broken_questions_are_reported_and_answered_with_2() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("plan.json"), plan(2.0)).unwrap();
    fs::write(
        folder.join("heavy.json"),
        plan(2.0).replace("[0, 6]", "[0, 6e5]"),
    )
    .unwrap();
    fs::write(folder.join("setup.ron"), "(\n  others: (tilt: 3),\n)").unwrap();
    fs::write(
        folder.join("range.ron"),
        "(others: (max_tilt_deg: 0, thrust_to_weight: 0.4))",
    )
    .unwrap();
    for (arguments, words) in [
        ("fly nowhere.json", "cannot read nowhere.json"),
        ("fly setup.ron", "not a plan"),
        ("fly heavy.json", "drone-seconds"),
        (
            "fly plan.json --vehicles setup.ron",
            "setup.ron: line 2, column",
        ),
        ("fly plan.json --vehicles range.ron", "max_tilt_deg is 0"),
        (
            "fly plan.json --vehicles range.ron",
            "thrust_to_weight is 0.4",
        ),
        ("fly plan.json --convection 0", "must be from"),
        ("fly plan.json --gusts 2", "must be from"),
        ("fly plan.json --paper", "--paper"),
        ("fly", "PLAN.json"),
    ] {
        let (code, _, error) = run(folder, arguments);
        assert_eq!(code, Some(2), "{arguments}: {error}");
        assert!(error.contains(words), "{arguments}: {error}");
    }
    assert!(!folder.join("out").exists());
}
