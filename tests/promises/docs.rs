//! What docs/ shows is what happens: its commands run, its scenario is read, its links lead
//! somewhere, its formats are those that the command writes.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::readme::{blocks, copy, root};

/// Every page of docs/, with its text.
fn pages() -> Vec<(PathBuf, String)> {
    let mut pages: Vec<(PathBuf, String)> = fs::read_dir(root().join("docs"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "md"))
        .map(|path| {
            let text = fs::read_to_string(&path).unwrap();
            (path, text)
        })
        .collect();
    pages.sort();
    assert!(pages.len() >= 6, "docs/ has lost a page");
    pages
}

#[test]
fn every_command_shown_in_the_docs_runs() {
    let folder = tempfile::tempdir().unwrap();
    for shipped in ["scenarios", "recordings"] {
        copy(&root().join(shipped), &folder.path().join(shipped));
    }
    let mut runs = 0;
    for (page, text) in pages() {
        // What a page has its reader save, under the name in its first line.
        for block in blocks(&text, "ron") {
            let first = block
                .lines()
                .next()
                .and_then(|line| line.strip_prefix("// "));
            if let Some(name) = first.filter(|name| name.ends_with(".ron")) {
                fs::write(folder.path().join(name), &block).unwrap();
            }
        }
        for block in blocks(&text, "console") {
            for line in block.lines() {
                let arguments = line.strip_prefix("$ plan ").unwrap_or_else(|| {
                    panic!("{}: no test knows how to run `{line}`", page.display())
                });
                let output = Command::new(env!("CARGO_BIN_EXE_plan"))
                    .current_dir(folder.path())
                    .args(arguments.split_whitespace())
                    .output()
                    .unwrap();
                assert_eq!(
                    output.status.code(),
                    Some(0),
                    "{}: {line}\n{}",
                    page.display(),
                    String::from_utf8_lossy(&output.stderr)
                );
                runs += 1;
            }
        }
    }
    assert!(runs >= 5, "the docs show {runs} commands");
}

#[test]
fn the_scenario_in_the_docs_is_read_without_complaint() {
    let text = fs::read_to_string(root().join("docs/formats.md")).unwrap();
    let [scenario] = &blocks(&text, "ron")[..] else {
        panic!("docs/formats.md has one scenario");
    };
    let world = planner::read_world(scenario).unwrap();
    assert_eq!(world.drones.len(), 2);
}

#[test]
fn every_key_of_a_plan_stands_in_the_docs() {
    let folder = tempfile::tempdir().unwrap();
    Command::new(env!("CARGO_BIN_EXE_plan"))
        .current_dir(root())
        .args(["scenarios/corridor.ron", "--out"])
        .arg(folder.path())
        .output()
        .unwrap();
    let plan = fs::read_to_string(folder.path().join("plan.json")).unwrap();
    let plan: serde_json::Value = serde_json::from_str(&plan).unwrap();
    let text = fs::read_to_string(root().join("docs/formats.md")).unwrap();
    let drone = plan["drones"][0].as_object().unwrap();
    let missing: BTreeSet<&String> = plan
        .as_object()
        .unwrap()
        .keys()
        .chain(drone.keys())
        .filter(|key| !text.contains(&format!("`{key}")))
        .collect();
    assert!(
        missing.is_empty(),
        "docs/formats.md does not name {missing:?}"
    );
}

#[test]
fn every_link_between_the_pages_leads_to_a_file() {
    let mut broken = Vec::new();
    let top = ["README.md", "ARCHITECTURE.md", "STYLE.md", "CHANGELOG.md"];
    let mut pages = pages();
    pages.extend(top.map(|file| {
        let path = root().join(file);
        let text = fs::read_to_string(&path).unwrap();
        (path, text)
    }));
    for (page, text) in &pages {
        let beside = page.parent().unwrap_or(Path::new(""));
        for link in text.split("](").skip(1) {
            let link = link.split([')', '#']).next().unwrap_or_default();
            let elsewhere = link.is_empty() || link.starts_with("http");
            if !elsewhere && !beside.join(link).exists() {
                broken.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
}

#[test]
fn the_readme_stays_short() {
    let text = fs::read_to_string(root().join("README.md")).unwrap();
    let words = text.split_whitespace().count();
    assert!(words <= 1300, "README.md has {words} words");
}
