//! The `plan` command as a person or a script meets it: exit codes, what goes to which stream, what
//! is written and what is not.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

use super::flying::scene;

/// Two drones far apart: feasible, and planned in no time.
const PAIR: &str = r#"Scenario(
  name: "pair",
  bounds_m: (min: (0, 0, 0), max: (12, 12, 4)),
  drones: [
    (name: "left", airframe: "kolibri", start_m: (2.5, 2.5, 1.5), tasks: [(to_m: (9.5, 2.5, 1.5))]),
    (name: "right", airframe: "kolibri", start_m: (9.5, 8.5, 1.5), tasks: [(to_m: (2.5, 8.5, 1.5))]),
  ],
)
"#;

/// `low` starts 2 m below `high`, on its axis.
const STACKED: &str = r#"Scenario(
  name: "stacked",
  bounds_m: (min: (0, 0, 0), max: (12, 12, 4)),
  drones: [
    (name: "high", airframe: "kolibri", start_m: (2.5, 2.5, 3.5), tasks: [(to_m: (9.5, 2.5, 3.5))]),
    (name: "low", airframe: "kolibri", start_m: (2.5, 2.5, 1.5), tasks: [(to_m: (9.5, 8.5, 1.5))]),
  ],
)
"#;

#[test]
fn a_folder_of_another_command_is_refused_and_left_as_it_is() {
    let desk = Desk::with(&[("pair.ron", PAIR), ("theirs/diagnosis.json", "{}")]);
    let output = desk.plan(&["pair.ron", "--no-contrast", "--out", "theirs"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("theirs holds what `plan diagnose` wrote"),
        "{said}"
    );
    assert_eq!(names_in(&desk.path("theirs")), ["diagnosis.json"]);
    // Its own it replaces.
    for _ in 0..2 {
        let output = desk.plan(&["pair.ron", "--no-contrast", "--out", "ours"]);
        assert_eq!(output.status.code(), Some(0));
    }
}

/// An empty folder with scenarios in it; the command runs there.
struct Desk(TempDir);

impl Desk {
    fn with(files: &[(&str, &str)]) -> Desk {
        let desk = Desk(tempfile::tempdir().unwrap());
        for (name, text) in files {
            let path = desk.path(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        desk
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn plan(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plan"));
        command.current_dir(self.0.path()).args(arguments);
        command
    }
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn with_json_asked_for_a_broken_question_is_one_object_too() {
    let broken = PAIR.replace("kolibri", "colibri");
    let desk = Desk::with(&[("broken.ron", &broken), ("pair.ron", PAIR)]);
    for (arguments, words) in [
        (&["broken.ron", "--format", "json"][..], "colibri"),
        (&["nowhere.ron", "--format=json"], "cannot read nowhere.ron"),
        (
            &["pair.ron", "--format", "json", "--no-such-option"],
            "--no-such-option",
        ),
    ] {
        let output = desk.plan(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let told: Value = serde_json::from_slice(&output.stdout).expect("one object");
        assert_eq!(told["exit_code"], 2);
        let error = told["error"].as_str().expect("a text");
        assert!(
            error.contains(words) && !error.contains('\u{1b}'),
            "{error}"
        );
        assert!(!output.stderr.is_empty());
    }
}

#[test]
fn a_mistyped_subcommand_is_reported_with_the_one_that_was_meant() {
    let desk = Desk::with(&[("chek", PAIR)]);
    let told = |arguments: &[&str]| {
        let output = desk.plan(arguments);
        (
            output.status.code(),
            String::from_utf8(output.stderr).unwrap(),
        )
    };
    let (code, error) = told(&["diagnse", "recordings"]);
    assert_eq!(code, Some(2));
    assert!(
        error.contains("no file or subcommand `diagnse`; did you mean `diagnose`?"),
        "{error}"
    );
    // A file of that name is a scenario.
    assert_eq!(told(&["chek"]).0, Some(0));
}

#[test]
fn without_arguments_it_prints_help_and_exits_2() {
    let output = Desk::with(&[]).plan(&[]);
    assert_eq!(code(&output), 2);
    assert_eq!(stdout(&output), "");
    assert!(stderr(&output).contains("Usage: plan [OPTIONS] <SCENARIO>"));
}

#[test]
fn a_feasible_scenario_is_planned_verified_and_written() {
    let desk = Desk::with(&[("pair.ron", PAIR)]);
    let output = desk.plan(&["pair.ron"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(stderr(&output), "");
    let report = stdout(&output);
    assert!(
        report.starts_with("pair: 2 drones (2 kolibri), 12 x 12 x 4 m\n"),
        "{report}"
    );
    assert!(report.contains("2 of 2 reach their goals"), "{report}");
    assert!(report.contains("verified: 0 violations"), "{report}");
    assert!(report.contains("\n  Ignoring downwash: "), "{report}");
    assert!(
        report.ends_with("\nwrote out/pair/plan.json  timing.json  plan.svg  plan.html\n"),
        "{report}"
    );
    assert_eq!(
        names_in(&desk.path("out/pair")),
        ["plan.html", "plan.json", "plan.svg", "timing.json"]
    );
    let plan: Value =
        serde_json::from_str(&fs::read_to_string(desk.path("out/pair/plan.json")).unwrap())
            .unwrap();
    assert_eq!(plan["format"], "plan/2");
    assert_eq!(plan["status"], "safe");
    let timing: Value =
        serde_json::from_str(&fs::read_to_string(desk.path("out/pair/timing.json")).unwrap())
            .unwrap();
    assert!(timing["planning_time_s"].is_number() && timing["verification_time_s"].is_number());
}

#[test]
fn a_written_plan_passes_the_check() {
    let desk = Desk::with(&[("pair.ron", PAIR)]);
    desk.plan(&["pair.ron", "--out", "here"]);
    let output = desk.plan(&["check", "here/plan.json"]);
    assert_eq!(code(&output), 0, "{}", stdout(&output));
    let told = stdout(&output);
    assert!(
        told.starts_with("pair: 2 drones, 0 violations\n  closest approach: "),
        "{told}"
    );
    assert!(told.contains("smallest time margin: "), "{told}");
    let output = desk.plan(&["check", "here/plan.json", "--scenario", "pair.ron"]);
    assert_eq!(code(&output), 0, "{}", stdout(&output));
    assert!(stdout(&output).starts_with("pair: 2 drones, 0 violations, answers its scenario\n"));
}

#[test]
fn a_plan_broken_on_purpose_fails_the_check_by_name() {
    let desk = Desk::with(&[("pair.ron", PAIR)]);
    desk.plan(&["pair.ron", "--out", "here"]);
    let path = desk.path("here/plan.json");
    let mut plan: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    plan["drones"][0]["airframe"]["max_speed_mps"] = 0.1.into();
    fs::write(&path, plan.to_string()).unwrap();
    let output = desk.plan(&["check", "here/plan.json"]);
    assert_eq!(code(&output), 1);
    assert!(
        stdout(&output).starts_with("`left` flies "),
        "{}",
        stdout(&output)
    );
    let output = desk.plan(&["check", "here/plan.json", "--format", "json"]);
    assert_eq!(code(&output), 1);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["violations"][0]["kind"], "speed");
}

#[test]
fn a_figure_that_does_not_follow_from_the_plan_is_named_and_the_answer_is_no() {
    let desk = Desk::with(&[("pair.ron", PAIR)]);
    desk.plan(&["pair.ron", "--out", "here"]);
    let path = desk.path("here/plan.json");
    let mut plan: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    plan["drones"][0]["dose_m"] = 7.5.into();
    fs::write(&path, plan.to_string()).unwrap();
    let output = desk.plan(&["check", "here/plan.json"]);
    assert_eq!(code(&output), 1);
    let told = stdout(&output);
    assert!(
        told.starts_with("`left`: `dose_m` is 7.5 in the file, "),
        "{told}"
    );
}

#[test]
fn the_page_of_a_check_counts_the_violations_that_the_check_counts() {
    // More at one place than are told one by one.
    let drone = |k: usize| {
        format!(
            r#"{{"name": "d{k}", "airframe": "kolibri", "trajectory": {{"t_s": [0], "position_m": [[5, 5, 4]]}}}}"#
        )
    };
    let drones: Vec<String> = (0..70).map(drone).collect();
    let plan = format!(
        r#"{{"format": "plan/1", "scenario": "crowd", "bounds_m": {{"min": [0, 0, 0], "max": [9, 9, 9]}}, "drones": [{}]}}"#,
        drones.join(",")
    );
    let desk = Desk::with(&[("plan.json", &plan)]);
    let output = desk.plan(&["check", "plan.json", "--out", "here"]);
    let counted = scene(&desk.path("here/plan.html"))["violation_count"].clone();
    let said = format!("crowd: 70 drones, {counted} violations, figures not compared\n");
    assert!(stdout(&output).contains(&said), "{said}");
}

#[test]
fn a_log_is_checked_with_its_airframes() {
    let log = "t_s,drone,x_m,y_m,z_m\n0,a,1,1,2\n2,a,3,1,2\n0,b,1,3,2\n2,b,3,3,2\n";
    let fleet = "(airframe: \"kolibri\")";
    let desk = Desk::with(&[("log.csv", log), ("fleet.ron", fleet), ("none.ron", "()")]);
    let output = desk.plan(&["check", "log.csv", "--airframes", "fleet.ron"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stdout(&output).starts_with("log: 2 drones, 0 violations\n"));
    let output = desk.plan(&["check", "log.csv", "--airframes", "none.ron"]);
    assert_eq!(code(&output), 2);
    assert!(stderr(&output).contains("drone `a` of the log has no airframe"));
    assert_eq!(code(&desk.plan(&["check", "log.csv"])), 2);
}

#[test]
fn a_file_that_is_no_plan_is_refused_with_the_field_and_the_place() {
    let broken = r#"{"format": "plan/1", "scenario": 3}"#;
    let desk = Desk::with(&[("plan.json", broken)]);
    let output = desk.plan(&["check", "plan.json"]);
    assert_eq!(code(&output), 2);
    assert_eq!(stdout(&output), "");
    assert!(
        stderr(&output).starts_with("error: plan.json: not a plan: `scenario`: "),
        "{}",
        stderr(&output)
    );
    assert!(
        stderr(&output).contains("line 1 column 34"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn as_json_standard_output_is_one_object_and_nothing_else() {
    let desk = Desk::with(&[("pair.ron", PAIR)]);
    let output = desk.plan(&["--format", "json", "pair.ron"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let written: Value =
        serde_json::from_str(&fs::read_to_string(desk.path("out/pair/plan.json")).unwrap())
            .unwrap();
    assert_eq!(printed["status"], "safe");
    assert_eq!(printed["plan"], written);
    assert_eq!(printed["files"][0], "out/pair/plan.json");
    assert!(printed["timing"]["planning_time_s"].is_number());
}

#[test]
fn starts_that_exclude_one_another_are_a_no_with_the_pair_and_the_way_out_and_no_files() {
    let desk = Desk::with(&[("stacked.ron", STACKED)]);
    let output = desk.plan(&["stacked.ron"]);
    assert_eq!(code(&output), 1);
    assert!(
        stdout(&output).contains("Ignoring downwash: "),
        "{}",
        stdout(&output)
    );
    let errors = stderr(&output);
    assert!(
        errors.contains("error: `low` starts in the downwash of `high`\n"),
        "{errors}"
    );
    assert!(
        errors.contains("low (2.5, 2.5, 1.5) is 2.0 m below high and 0.0 m off its axis"),
        "{errors}"
    );
    assert!(errors.contains("help: move low "), "{errors}");
    assert_eq!(names_in(desk.0.path()), ["stacked.ron"]);
    let printed = desk.plan(&["stacked.ron", "--format", "json"]);
    let printed: Value = serde_json::from_str(stdout(&printed)).unwrap();
    assert!(
        printed["ignoring_downwash"]["makespan_s"].is_number(),
        "{printed}"
    );
    let printed = desk.plan(&["stacked.ron", "--format", "json", "--no-contrast"]);
    let printed: Value = serde_json::from_str(stdout(&printed)).unwrap();
    assert!(printed.get("ignoring_downwash").is_none(), "{printed}");
}

#[test]
fn a_plan_that_a_refused_run_leaves_there_is_reported_to_be_of_an_earlier_one() {
    let desk = Desk::with(&[("pair.ron", PAIR), ("stacked.ron", STACKED)]);
    assert_eq!(code(&desk.plan(&["pair.ron", "--out", "o"])), 0);
    let folder = desk.0.path().join("o");
    let before = fs::read(folder.join("plan.json")).unwrap();
    let output = desk.plan(&["stacked.ron", "--out", "o", "--format", "json"]);
    assert_eq!(code(&output), 1);
    let earlier = "plan.json is of an earlier run: this one writes nothing";
    assert!(stderr(&output).contains(earlier), "{}", stderr(&output));
    let printed: Value = serde_json::from_str(stdout(&output)).unwrap();
    assert!(printed["notes"].to_string().contains(earlier), "{printed}");
    assert_eq!(fs::read(folder.join("plan.json")).unwrap(), before);
}

#[test]
fn a_broken_scenario_is_reported_on_standard_error_and_leaves_no_files() {
    let desk = Desk::with(&[("bad.ron", &PAIR.replace("start_m", "begin_m"))]);
    for format in ["text", "json"] {
        let output = desk.plan(&["bad.ron", "--format", format]);
        assert_eq!(code(&output), 2);
        assert_eq!(stdout(&output).is_empty(), format == "text");
        assert!(
            stderr(&output).contains("bad.ron:5:"),
            "{}",
            stderr(&output)
        );
    }
    assert_eq!(names_in(desk.0.path()), ["bad.ron"]);
}

#[test]
fn a_missing_scenario_is_named() {
    let output = Desk::with(&[]).plan(&["nowhere.ron"]);
    assert_eq!(code(&output), 2);
    assert!(
        stderr(&output).starts_with("error: cannot read nowhere.ron: "),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_folder_that_cannot_be_made_is_named_before_any_planning() {
    let desk = Desk::with(&[("pair.ron", PAIR), ("taken", "a file")]);
    let output = desk.plan(&["pair.ron", "--out", "taken/out"]);
    assert_eq!(code(&output), 2);
    assert_eq!(stdout(&output), "");
    assert!(
        stderr(&output).starts_with("error: cannot write taken/out: "),
        "{}",
        stderr(&output)
    );
}

#[test]
fn vehicles_that_cannot_be_read_are_reported_before_any_planning() {
    let desk = Desk::with(&[("pair.ron", PAIR)]);
    let output = desk.plan(&["pair.ron", "--vehicles", "nowhere.ron"]);
    assert_eq!(code(&output), 2);
    assert!(stderr(&output).contains("nowhere.ron"));
    assert!(!desk.path("out").exists());
}

#[test]
fn where_the_plan_cannot_be_written_nothing_is_and_where_its_picture_cannot_the_plan_is() {
    for (taken, left) in [
        ("timing.json", &["timing.json"][..]),
        ("plan.svg", &["plan.json", "plan.svg", "timing.json"][..]),
    ] {
        let desk = Desk::with(&[("pair.ron", PAIR)]);
        fs::create_dir_all(desk.path("here").join(taken)).unwrap();
        let output = desk.plan(&["pair.ron", "--out", "here"]);
        assert_eq!(code(&output), 2);
        let error = format!("error: cannot write here/{taken}: ");
        assert!(stderr(&output).starts_with(&error), "{}", stderr(&output));
        assert_eq!(names_in(&desk.path("here")), left);
    }
}

#[test]
fn off_a_terminal_and_under_no_color_nothing_is_coloured() {
    let desk = Desk::with(&[
        ("bad.ron", &PAIR.replace("start_m", "begin_m")),
        ("stacked.ron", STACKED),
    ]);
    for scenario in ["bad.ron", "stacked.ron", "nowhere.ron"] {
        for no_color in [None, Some("1")] {
            let mut command = desk.command(&[scenario]);
            if let Some(value) = no_color {
                command.env("NO_COLOR", value);
            }
            let output = command.output().unwrap();
            assert!(
                !output.stdout.contains(&0x1b) && !output.stderr.contains(&0x1b),
                "{scenario}"
            );
        }
    }
}

#[test]
fn the_same_scenario_gives_the_same_bytes_with_one_thread_and_with_two() {
    let desk = Desk::with(&[]);
    desk.plan(&[
        "generate", "hall", "--drones", "30", "--seed", "7", "--out", "hall.ron",
    ]);
    for jobs in ["1", "2"] {
        let output = desk.plan(&["hall.ron", "--jobs", jobs, "--out", jobs]);
        assert_ne!(code(&output), 2, "{}", stderr(&output));
    }
    for name in ["plan.json", "plan.svg", "plan.html"] {
        let read = |jobs: &str| fs::read(desk.path(jobs).join(name)).unwrap();
        assert!(read("1") == read("2"), "{name} differs");
    }
}

#[test]
fn a_generated_scenario_can_be_piped_into_the_planner() {
    let desk = Desk::with(&[]);
    let scenario = desk.plan(&["generate", "circle", "--drones", "4", "--radius", "5"]);
    assert_eq!(code(&scenario), 0);
    let mut child = desk
        .command(&["-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut pipe = child.stdin.take().unwrap();
    pipe.write_all(&scenario.stdout).unwrap();
    drop(pipe);
    let output = child.wait_with_output().unwrap();
    assert_ne!(code(&output), 2, "{}", stderr(&output));
    assert_eq!(names_in(&desk.path("out")), ["scenario"]);
}

#[test]
fn every_generated_scenario_is_one() {
    for (kind, options) in [
        ("hall", &["--drones", "50", "--seed", "1"][..]),
        ("field", &["--drones", "50", "--seed", "1"]),
        ("warehouse", &["--drones", "50", "--seed", "1"]),
        ("window", &[]),
        ("circle", &["--drones", "64", "--radius", "20"]),
    ] {
        let output = Desk::with(&[]).plan(&[&["generate", kind], options].concat());
        assert_eq!(code(&output), 0, "{kind}: {}", stderr(&output));
        let world = planner::read_world(stdout(&output));
        assert!(world.is_ok(), "{kind}: {:?}", world.err());
    }
}

#[test]
fn more_drones_than_fit_are_refused_with_the_number_that_fits() {
    let output = Desk::with(&[]).plan(&["generate", "hall", "--drones", "5000"]);
    assert_eq!(code(&output), 2);
    assert_eq!(stdout(&output), "");
    assert!(stderr(&output).contains("4096"), "{}", stderr(&output));
}

#[test]
fn options_out_of_range_are_refused() {
    let desk = Desk::with(&[("pair.ron", PAIR)]);
    for options in [
        ["--time-limit", "0"],
        ["--time-limit", "soon"],
        ["--jobs", "0"],
        ["--seed", "-1"],
        ["--format", "xml"],
    ] {
        let output = desk.plan(&[&["pair.ron"], &options[..]].concat());
        assert_eq!(code(&output), 2, "{options:?}");
        assert_eq!(stdout(&output), "");
    }
    assert_eq!(names_in(desk.0.path()), ["pair.ron"]);
}

/// A reader that goes away early (`plan generate ... | head -1`) is no reason to panic.
#[cfg(unix)]
#[test]
fn a_closed_pipe_on_standard_output_is_no_error() {
    let desk = Desk::with(&[]);
    let plan = env!("CARGO_BIN_EXE_plan");
    let mut child = Command::new(plan)
        .current_dir(desk.0.path())
        .args(["generate", "warehouse", "--drones", "2000"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(stderr(&output), "");
}
