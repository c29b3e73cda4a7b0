//! `plan bench` as a person or a script meets it, at sizes that take no time.

use serde_json::Value;
use std::process::Command;

fn bench(arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plan"));
    let output = command.arg("bench").args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (
        output.status.code().unwrap(),
        text(output.stdout),
        text(output.stderr),
    )
}

/// The cells of the table's rows, without its head.
fn rows(markdown: &str) -> Vec<Vec<String>> {
    let lines = markdown.lines().filter(|line| line.starts_with('|'));
    let cells = |line: &str| -> Vec<String> {
        let inner = line.trim_matches('|');
        inner
            .split('|')
            .map(|cell| cell.trim().to_owned())
            .collect()
    };
    lines.skip(2).map(cells).collect()
}

#[test]
fn the_table_has_a_row_for_every_place_and_size_and_says_how_to_get_it_again() {
    let (code, printed, stderr) =
        bench(&["hall", "field", "--drones", "2,4,6", "--seeds", "1,2,3"]);
    assert_eq!((code, stderr.as_str()), (0, ""), "{printed}");
    assert!(
        printed.starts_with("`plan bench hall field --drones 2,4,6 --seeds 1,2,3`\n"),
        "{printed}"
    );
    assert!(printed.contains(" core"), "{printed}");
    let rows = rows(&printed);
    let asked: Vec<(&str, &str)> = rows
        .iter()
        .map(|row| (row[0].as_str(), row[1].as_str()))
        .collect();
    let places = ["hall", "field"];
    let sizes = ["2", "4", "6"];
    let all = places
        .iter()
        .flat_map(|place| sizes.map(|size| (*place, size)));
    assert_eq!(asked, all.collect::<Vec<_>>());
    for row in &rows {
        assert_eq!(row.len(), 15, "{row:?}");
        assert_eq!((&*row[3], &*row[4]), ("smooth, advected", "3 of 3"));
        for figure in [5, 6, 7, 8, 9, 10, 11] {
            assert!(row[figure].parse::<f64>().is_ok(), "{row:?}");
        }
    }
    for place in places {
        let growth = format!("Growth in the {place}: planning time ");
        assert!(printed.contains(&growth), "{printed}");
    }
    assert!(
        printed.contains(", p = ") && printed.contains("R²"),
        "{printed}"
    );
}

#[test]
fn two_sizes_are_not_made_into_a_law() {
    let (_, printed, _) = bench(&["hall", "--drones", "2,4", "--seeds", "1"]);
    assert!(
        printed.ends_with("Growth in the hall: not fitted, 3 rows are needed and there are 2.\n"),
        "{printed}"
    );
}

#[test]
fn a_fleet_that_is_not_planned_in_time_keeps_its_row_and_the_answer_is_no() {
    let limit = ["--seeds", "1", "--time-limit", "0.000001"];
    let (code, printed, _) = bench(&[&["hall", "--drones", "20"], &limit[..]].concat());
    assert_eq!(code, 1, "{printed}");
    let rows = rows(&printed);
    assert_eq!(rows.len(), 1);
    assert!(rows[0][4].starts_with("0 of 1; seed 1: "), "{printed}");
    assert!(printed.contains("without N = 20"), "{printed}");
}

#[test]
fn as_json_every_run_is_there_with_what_the_table_is_made_of() {
    let small = ["mixed-hall", "--drones", "10", "--seeds", "3,4"];
    let (code, printed, _) = bench(&[&small[..], &["--format", "json"]].concat());
    assert_eq!(code, 0, "{printed}");
    let printed: Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(printed["format"], "bench/1");
    let row = &printed["rows"][0];
    assert_eq!(
        (&row["place"], &row["drones"]),
        (&"mixed-hall".into(), &10.into())
    );
    let seeds: Vec<&Value> = row["runs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|run| &run["seed"])
        .collect();
    assert_eq!(seeds, [3, 4]);
    let figures = &row["runs"][1]["figures"];
    assert_eq!(figures["status"], "safe");
    assert!(figures["over_limit_ignoring_downwash"].is_u64());
    assert!(figures["sum_of_arrivals_s"].as_f64() >= figures["sum_alone_s"].as_f64());
    // A run by itself plans the same.
    let (code, alone, _) = bench(&["mixed-hall", "--drones", "10", "--seeds", "4", "--one"]);
    assert_eq!(code, 0, "{alone}");
    let alone: Value = serde_json::from_str(&alone).unwrap();
    for figure in ["sum_of_arrivals_s", "extra_energy_j", "expansions"] {
        assert_eq!(alone[figure], figures[figure], "{figure}");
    }
}

#[test]
fn what_does_not_fit_is_refused_before_anything_is_planned() {
    let (code, printed, stderr) = bench(&["field", "hall", "--drones", "5000", "--seeds", "1"]);
    assert_eq!((code, printed.as_str()), (2, ""));
    assert!(stderr.contains("4096 free columns"), "{stderr}");
    let (code, _, stderr) = bench(&["hall", "--drones", "2,3", "--seeds", "1", "--one"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("not 2"), "{stderr}");
}

#[test]
fn the_table_in_the_docs_has_the_columns_that_are_printed() {
    let (_, printed, _) = bench(&["hall", "--drones", "2", "--seeds", "1"]);
    let head = printed.lines().find(|line| line.starts_with('|')).unwrap();
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/benchmarks.md");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(
        page.contains(head),
        "print it again, by `plan bench`: {head}"
    );
}

/// Where one drone after another finds no path any more the whole fleet moves step by step, at
/// several times the sum of the drones' own times.
/// A planner of straight paths that stands in for MAPF-LNS2: it reads and writes what that does.
#[cfg(unix)]
const STRAIGHT: &str = r#"#!/bin/sh
for word in "$@"; do case $word in --outputPaths=*) out=${word#*=};; esac; done
awk -F '\t' 'NF > 8 {
    x = $5; y = $6; printf "Agent %d:(%d,%d)->", n++, y, x
    while (x != $7) { x += x < $7 ? 1 : -1; printf "(%d,%d)->", y, x }
    while (y != $8) { y += y < $8 ? 1 : -1; printf "(%d,%d)->", y, x }
    print ""
}' floor.scen > "$out"
"#;

#[cfg(unix)]
#[test]
fn other_planners_are_run_where_they_are_found_and_their_plans_judged() {
    use std::os::unix::fs::PermissionsExt as _;

    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("lns");
    std::fs::write(&program, STRAIGHT).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let asked = ["hall", "--drones", "3,60", "--seeds", "1", "--relaxed"];
    let peers = ["--peers", folder.path().to_str().unwrap()];
    let (code, printed, stderr) = bench(&[&asked[..], &peers[..]].concat());
    assert_eq!((code, stderr.as_str()), (0, ""), "{printed}");
    let rows = rows(&printed);
    let of = |size: &str, planner: &str| {
        let mut rows = rows.iter().filter(|row| row.len() == 7);
        let found = rows.find(|row| row[1] == size && row[2] == planner);
        found.unwrap_or_else(|| panic!("{printed}"))[3..].to_vec()
    };
    assert_eq!(of("3", "LaCAM3"), ["not found", "-", "-", "-"]);
    let few = of("3", "MAPF-LNS2");
    assert_eq!((&*few[0], &*few[2], &*few[3]), ("1 of 1", "1.000", "0"));
    // None gives way.
    let many = of("60", "MAPF-LNS2");
    assert!(many[3].contains(" air"), "{many:?}");
    assert_eq!(of("60", "this one")[3], "0");

    let (code, _, stderr) = bench(&["hall", "--peers", "no-such-folder"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("no-such-folder"), "{stderr}");
}

#[cfg(feature = "long")]
#[test]
fn a_thousand_drones_are_planned_one_after_another_at_little_above_their_own_times() {
    let command = "hall warehouse --drones 1000 --seeds 1 --format json";
    let (code, printed, stderr) = bench(&command.split(' ').collect::<Vec<_>>());
    assert_eq!(code, 0, "{stderr}");
    let printed: Value = serde_json::from_str(&printed).unwrap();
    for row in printed["rows"].as_array().unwrap() {
        let figures = &row["runs"][0]["figures"];
        let ratio = figures["sum_of_arrivals_s"].as_f64().unwrap()
            / figures["sum_alone_s"].as_f64().unwrap();
        assert!(ratio < 1.15, "{}: {ratio}", row["place"]);
    }
}
