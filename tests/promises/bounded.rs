//! Memory and time are bounded by what is asked and answered: not by the clock, and not by what no
//! fleet is.

use std::fs;
use std::process::{Command, Output};

use planner::replan::change::Change;
use planner::replan::rolling::Running;
use planner::scenario::world::Task;
use planner::{Control, Outcome};
use serde_json::Value;
use tempfile::TempDir;

/// More than any of these plans takes (bytes), and a thousandth of what a bin for every second
/// would.
const LITTLE_BYTES: f64 = 96e6;

/// Two drones that change places past a zone, with as many dwells, each so long (s).
fn dwells(count: usize, dwell_s: f64) -> String {
    let drone = |name: &str, y_m: f64, airframe: &str| {
        let task = |k: usize| {
            let x_m = if k.is_multiple_of(2) { 9.5 } else { 2.5 };
            format!("(to_m: ({x_m}, {y_m}, 3), dwell_s: {dwell_s})")
        };
        let tasks: Vec<String> = (0..count).map(task).collect();
        let tasks = tasks.join(", ");
        format!(
            r#"(name: "{name}", airframe: "{airframe}", start_m: (2.5, {y_m}, 3), tasks: [{tasks}])"#
        )
    };
    let (a, b) = (drone("a", 2.5, "kolibri"), drone("b", 8.5, "offboard-2"));
    format!(
        r#"Scenario(name: "dwells", bounds_m: (min: (0, 0, 0), max: (12, 12, 5)), drones: [{a}, {b}],
           zones: [(name: "desk", min_m: (5, 5, 0), max_m: (7, 6, 1), air_limit_mps: 3)])"#
    )
}

fn plan(folder: &TempDir, scenario: &str) -> Output {
    let path = folder.path().join("it.ron");
    fs::write(&path, scenario).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_plan"));
    command.arg(path).args(["--no-contrast", "--out"]);
    command.arg(folder.path().join("out")).output().unwrap()
}

#[test]
fn a_day_takes_no_more_memory_than_a_second() {
    let folder = tempfile::tempdir().unwrap();
    for dwell_s in [1.0, 86_400.0] {
        let output = plan(&folder, &dwells(60, dwell_s));
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let timing = fs::read_to_string(folder.path().join("out/timing.json")).unwrap();
        let timing: Value = serde_json::from_str(&timing).unwrap();
        if let Some(bytes) = timing["peak_memory_bytes"].as_f64() {
            assert!(bytes < LITTLE_BYTES, "dwells of {dwell_s} s: {bytes}");
        }
    }
}

#[test]
fn tasks_that_outlast_the_clock_are_refused_at_their_place() {
    let output = plan(&tempfile::tempdir().unwrap(), &dwells(400, 86_400.0));
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("the tasks of drone `a` take too long"),
        "{said}"
    );
    assert!(
        said.contains("the tasks of drone `b` take too long"),
        "{said}"
    );
}

#[test]
fn a_plan_is_changed_after_months_as_after_seconds() {
    let world = planner::read_world(&dwells(2, 3.0)).unwrap();
    let outcome = planner::plan_world(&world, &Control::QUIET).unwrap();
    let Outcome::Safe(planned) = outcome else {
        panic!("two drones far apart: {outcome:?}");
    };
    for at_s in [30.0, 1e7] {
        let mut running = Running::new(world.clone(), planned.plan.clone()).unwrap();
        let task = Task {
            to_m: [6.0, 10.5, 3.0].into(),
            dwell_s: 86_400.0,
            load_kg: None,
            during_s: None,
        };
        let change = Change::Retasked {
            drone: "b".to_owned(),
            tasks: vec![task],
        };
        let told = running.replan(at_s, &[change], &Control::QUIET).unwrap();
        assert_eq!(told.refused, []);
        assert_eq!(running.plan().violations, []);
        assert!(running.plan().drones[1].arrives_s > at_s + 86_400.0);
    }
}

#[test]
fn more_of_anything_than_a_fleet_has_is_refused() {
    let obstacle = r#"(name: "o", min_m: (5, 5, 0), max_m: (6, 6, 1)), "#;
    let many = format!("obstacles: [{}],", obstacle.repeat(20_001));
    let scenario = dwells(1, 1.0).replace("zones:", &(many + "zones:"));
    let output = plan(&tempfile::tempdir().unwrap(), &scenario);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("20001 items, at most 20000"), "{said}");
}

/// Linux alone has a file without end.
#[cfg(target_os = "linux")]
#[test]
fn a_file_without_end_is_refused() {
    let zero = "/dev/zero";
    let mesh = r#"Scenario(name: "m", bounds_m: (min: (0, 0, 0), max: (9, 9, 5)),
        obstacles: [(name: "it", mesh: "/dev/zero")],
        drones: [(name: "a", airframe: "kolibri", start_m: (1, 1, 1))])"#;
    let folder = tempfile::tempdir().unwrap();
    let scenario = folder.path().join("mesh.ron");
    fs::write(&scenario, mesh).unwrap();
    let scenario = scenario.to_str().unwrap();
    for arguments in [vec![zero], vec!["check", zero], vec![scenario]] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plan"));
        let output = command
            .current_dir(folder.path())
            .args(&arguments)
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains("MiB"), "{arguments:?}: {said}");
    }
}
