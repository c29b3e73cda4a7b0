//! What README.md shows is what happens: its console blocks, its picture, its code, its short
//! scenario.
//!
//! Where a plan has changed for the better, `UPDATE_README=1 cargo test --test promises readme`
//! writes the new run and its picture; look at both before they are committed.

use std::fs;
use std::path::Path;
use std::process::Command;

pub(super) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn updating() -> bool {
    std::env::var_os("UPDATE_README").is_some()
}

fn readme() -> String {
    fs::read_to_string(root().join("README.md")).unwrap()
}

/// The fenced blocks of one language, without their fences.
pub(super) fn blocks(text: &str, language: &str) -> Vec<String> {
    let mut lines = text.lines();
    let mut found = Vec::new();
    let fence = format!("```{language}");
    while lines.any(|line| line == fence) {
        let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
        found.push(block.join("\n"));
    }
    found
}

/// An empty folder with the scenarios in it, as after a clone.
fn clone() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy(&root().join("scenarios"), &folder.path().join("scenarios"));
    folder
}

/// A folder with all that is in it.
pub(super) fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let there = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &there);
        } else {
            fs::copy(entry.path(), there).unwrap();
        }
    }
}

/// The text with the time that planning took blotted out: it is the only figure that differs
/// between runs.
fn without_wall_clock(text: &str) -> String {
    let mark = "planned in ";
    let Some(at) = text.find(mark) else {
        return text.trim_end().to_owned();
    };
    let (before, after) = text.split_at(at + mark.len());
    let after = after.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
    format!("{before}...{after}").trim_end().to_owned()
}

#[test]
fn the_console_blocks_of_the_readme_are_what_the_command_prints() {
    let folder = clone();
    let mut runs = 0;
    for block in blocks(&readme(), "console") {
        for session in block.split("$ ").skip(1) {
            let (command, shown) = session.split_once('\n').unwrap_or((session, ""));
            let Some(arguments) = command.strip_prefix("cargo run --release -- ") else {
                assert_eq!(shown.trim(), "", "no test looks at what `{command}` prints");
                continue;
            };
            let output = Command::new(env!("CARGO_BIN_EXE_plan"))
                .current_dir(folder.path())
                .args(arguments.split_whitespace())
                .output()
                .unwrap();
            let printed = String::from_utf8(output.stdout).unwrap();
            if updating() && without_wall_clock(shown) != without_wall_clock(&printed) {
                let text = readme().replace(shown.trim_end(), printed.trim_end());
                fs::write(root().join("README.md"), text).unwrap();
                continue;
            }
            assert_eq!(
                without_wall_clock(shown),
                without_wall_clock(&printed),
                "README.md shows the left, `{command}` prints\n{printed}"
            );
            assert_eq!(output.status.code(), Some(0), "{command}");
            runs += 1;
        }
    }
    assert!(runs > 0 || updating(), "README.md shows no run");
}

#[test]
fn the_picture_in_the_readme_is_of_the_run_beside_it() {
    assert!(readme().contains("](docs/warehouse.svg)"));
    let picture = fs::read_to_string(root().join("docs/warehouse.svg")).unwrap();
    let folder = clone();
    super::succeeds(
        Command::new(env!("CARGO_BIN_EXE_plan"))
            .current_dir(folder.path())
            .args(["scenarios/warehouse.ron", "--out", "now"]),
    );
    let now = fs::read_to_string(folder.path().join("now/plan.svg")).unwrap();
    if updating() {
        fs::write(root().join("docs/warehouse.svg"), now).unwrap();
        return;
    }
    // Titles name the fleet, its makespan and the worst air: coordinates may differ in a last digit
    // where another machine's sine does.
    for tag in ["aria-label=\"", "<desc>"] {
        let text = |svg: &str| {
            let after = svg.split(tag).nth(1).unwrap_or_default();
            after
                .split(['"', '<'])
                .next()
                .unwrap_or_default()
                .to_owned()
        };
        assert!(!text(&now).is_empty());
        assert_eq!(
            text(&picture),
            text(&now),
            "draw docs/warehouse.svg again, see README.md"
        );
    }
}

#[test]
fn the_library_call_in_the_readme_is_the_example_of_the_planner_crate() {
    let source = fs::read_to_string(root().join("planner/src/lib.rs")).unwrap();
    let example: Vec<&str> = source
        .lines()
        .map_while(|line| line.strip_prefix("//!"))
        .map(|line| line.strip_prefix(' ').unwrap_or(line))
        .skip_while(|line| *line != "```")
        .skip(1)
        .take_while(|line| *line != "```")
        // Hidden on the page of the crate, too.
        .filter(|line| !line.starts_with("# "))
        .collect();
    assert!(example.len() > 5, "planner/src/lib.rs has lost its example");
    assert_eq!(blocks(&readme(), "rust"), [example.join("\n")]);
}

#[test]
fn the_short_scenario_in_the_readme_is_read_without_complaint() {
    let [short] = &blocks(&readme(), "ron")[..] else {
        panic!("README.md has one scenario");
    };
    let world = planner::read_world(short).unwrap();
    assert_eq!(world.drones.len(), 1);
}
