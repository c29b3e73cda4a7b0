//! The lines that ARCHITECTURE.md draws, held against the manifests and the sources as they are.

mod rooms;
mod sources;

use std::collections::BTreeSet;
use std::fs;

use sources::{Source, dependencies, files_below, read, root, sources_of};

const LIBRARIES: [&str; 8] = [
    "airflow",
    "costmap",
    "planner",
    "flight",
    "exchange",
    "viewer",
    "diagnosis",
    "service",
];

/// Parts of `planner` that judge a plan without the search, and may therefore ask `airflow`.
const JUDGES: [&str; 3] = [
    "planner/src/verify/",
    "planner/src/solver/endpoints.rs",
    "planner/src/solver/endpoints/",
];

fn assert_none(broken: &[String]) {
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
}

/// `file: name` for every name at or below one of these paths.
fn named(sources: &[Source], paths: &[&str]) -> Vec<String> {
    sources
        .iter()
        .flat_map(|source| {
            paths.iter().flat_map(move |path| {
                source
                    .names_below(path)
                    .map(move |name| format!("{}: {name}", source.file))
            })
        })
        .collect()
}

/// Prose alone: a formula, a table or an example that is laid out by hand keeps its width.
#[test]
fn comments_have_at_most_a_hundred_columns() {
    let others = ["loader", "validation", "tools", "src", "benches", "tests"];
    let folders = LIBRARIES.into_iter().chain(others);
    let mut broken = Vec::new();
    let files = folders.flat_map(files_below);
    for file in files.filter(|file| file.ends_with(".rs")) {
        let mut is_laid_out = false;
        for (index, line) in read(&file).lines().enumerate() {
            let Some(comment) = line.trim_start().strip_prefix("//") else {
                continue;
            };
            let text = comment.trim_start_matches(['/', '!']).trim_start();
            is_laid_out ^= text.starts_with("```");
            if !is_laid_out && !text.starts_with('|') && line.chars().count() > 100 {
                broken.push(format!("{file}:{}", index + 1));
            }
        }
    }
    assert_none(&broken);
}

#[test]
fn dependencies_run_one_way() {
    assert!(
        read("Cargo.toml").contains(
            r#"members = ["airflow", "costmap", "planner", "flight", "exchange", "viewer", "diagnosis", "loader", "service", "tools", "validation", "benches"]"#
        ),
        "a new crate needs its line here and in ARCHITECTURE.md"
    );
    for (crate_name, below) in [
        ("airflow", &[][..]),
        ("costmap", &["airflow"]),
        ("planner", &["airflow", "costmap"]),
        ("flight", &["airflow", "costmap", "planner"]),
        ("exchange", &["planner"]),
        ("viewer", &["airflow", "planner", "flight"]),
        ("diagnosis", &["airflow"]),
        ("service", &["planner"]),
    ] {
        let depends = dependencies(&format!("{crate_name}/Cargo.toml"));
        assert!(depends.contains("nalgebra"), "{crate_name}: {depends:?}");
        for other in LIBRARIES.iter().chain(&["leeward"]) {
            assert!(
                below.contains(other) || !depends.contains(*other),
                "{crate_name} depends on {other}"
            );
        }
    }
}

#[test]
fn the_air_knows_no_shapes_graphs_or_files() {
    let expected = ["nalgebra", "serde", "thiserror"].map(String::from);
    assert_eq!(dependencies("airflow/Cargo.toml"), BTreeSet::from(expected));
    let depends = dependencies("costmap/Cargo.toml");
    for not_for_volumes in ["petgraph", "ron", "serde", "serde_json"] {
        assert!(!depends.contains(not_for_volumes), "costmap: {depends:?}");
    }
}

#[test]
fn libraries_read_no_file_clock_or_environment_and_print_nothing() {
    for library in LIBRARIES {
        let sources = sources_of(&format!("{library}/src"));
        assert!(!sources.is_empty());
        let mut broken = named(
            &sources,
            &[
                "std::fs",
                "std::env",
                "std::io",
                "std::net",
                "std::process",
                "std::time",
                "std::thread",
                "Instant",
                "SystemTime",
                "print!",
                "println!",
                "eprint!",
                "eprintln!",
                "dbg!",
                "env!",
                "option_env!",
                "include_str!",
                "include_bytes!",
            ],
        );
        if library == "exchange" {
            // Archives are written to memory and read from it.
            let in_memory = ["Cursor", "Read", "Error"].map(|it| format!("std::io::{it}"));
            broken.retain(|it| !in_memory.iter().any(|name| it.contains(name)));
        }
        if library == "viewer" {
            // Markup, style and scripts are compiled in.
            broken.retain(|it| !it.ends_with("include_str!"));
        }
        if library == "diagnosis" {
            // Logs are longer than memory: they are taken as they come from what the caller opened.
            let handed_in =
                ["BufRead", "Read", "Result", "ErrorKind"].map(|it| format!("std::io::{it}"));
            broken.retain(|it| !handed_in.iter().any(|name| it.ends_with(name)));
        }
        assert_none(&broken);
    }
}

#[test]
fn the_search_never_evaluates_a_jet() {
    let whole = sources_of("planner/src");
    for module in [
        "graph",
        "scenario/placement",
        "scenario/solid",
        "sipp/goal_occupancy",
        "sipp/search",
        "solver/fleet",
        "solver/priority",
    ] {
        let places = [
            format!("planner/src/{module}.rs"),
            format!("planner/src/{module}/"),
        ];
        let sources = || {
            let here = |source: &&Source| places.iter().any(|place| source.file.starts_with(place));
            whole.iter().filter(here)
        };
        assert!(sources().next().is_some(), "{module} has moved");
        for source in sources() {
            assert_none(&named(std::slice::from_ref(source), &["airflow"]));
        }
    }
}

#[test]
fn outside_its_judges_the_planner_takes_descriptions_from_airflow_and_no_wake() {
    // What the air is (airframe, air, jet constants, superposition, how fast it is carried down,
    // what a finding adds), and beta for words about a price.
    let allowed = [
        "airflow::Air",
        "airflow::Airframe",
        "airflow::Convection",
        "airflow::Flown",
        "airflow::Jet",
        "airflow::Superposition",
        "airflow::effects",
        "airflow::power::beta",
    ];
    let sources = sources_of("planner/src");
    let broken: Vec<String> = sources
        .iter()
        .filter(|source| !source.is_in(&JUDGES))
        .flat_map(|source| {
            source
                .names_below("airflow")
                .filter(|name| {
                    !allowed.iter().any(|path| {
                        name.strip_prefix(path)
                            .is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
                    })
                })
                .map(|name| format!("{}: {name}", source.file))
        })
        .collect();
    assert_none(&broken);
}

#[test]
fn the_verifier_shares_nothing_with_the_search_but_the_plan_itself() {
    let sources = sources_of("planner/src");
    let closure = [
        "planner/src/verify/",
        "planner/src/plan/trajectory",
        "planner/src/plan/mod.rs",
    ];
    let judged: Vec<Source> = sources
        .into_iter()
        .filter(|source| source.is_in(&closure))
        .collect();
    assert!(judged.len() > 3);
    assert_none(&named(&judged, &["costmap", "petgraph", "super::super"]));
    let broken: Vec<String> = judged
        .iter()
        .flat_map(|source| {
            source
                .names_below("crate")
                .filter(|name| {
                    // `crate` alone is the one in `pub(crate)`.
                    let module = name.split("::").nth(1);
                    module.is_some_and(|module| !["plan", "trajectory", "verify"].contains(&module))
                })
                .map(|name| format!("{}: {name}", source.file))
        })
        .collect();
    assert_none(&broken);
    // From the module's own root `super` is the crate.
    let roots = [
        "planner/src/verify/mod.rs",
        "planner/src/plan/trajectory.rs",
        "planner/src/plan/mod.rs",
    ];
    for source in judged
        .iter()
        .filter(|source| roots.contains(&source.file.as_str()))
    {
        assert_none(&named(std::slice::from_ref(source), &["super"]));
    }
}

#[test]
fn the_synthetic_world_shares_no_code_with_the_physics_that_is_to_find_it() {
    // The model cannot be named at all; Cargo holds that.
    let depends = dependencies("validation/Cargo.toml");
    assert!(!depends.contains("airflow"), "{depends:?}");
    let whole = sources_of("validation/src");
    let world: Vec<&Source> = whole
        .iter()
        .filter(|source| source.is_in(&["validation/src/world"]))
        .collect();
    assert!(world.len() > 5);
    let broken: Vec<String> = world
        .iter()
        .flat_map(|source| {
            let ours = source.names_below("diagnosis").chain(
                source
                    .names_below("crate")
                    // `crate` alone is the one in `pub(crate)`.
                    .filter(|name| *name != "crate"),
            );
            ours.filter(|name| !name.starts_with("diagnosis::statistics::draws::"))
                .map(|name| format!("{}: {name}", source.file))
        })
        .collect();
    assert_none(&broken);
    // Around it, nothing simulates: neither what is recorded nor the metrics.
    assert_none(&named(
        &whole,
        &["diagnosis::forward", "diagnosis::calibrate"],
    ));
}

#[test]
fn shapes_are_stood_up_in_one_place() {
    // Parry's round shapes stand on y: to hang one into the world takes a rotation.
    let turning = ["parry3d::math::Rotation", "parry3d::glamx", "glam", "glamx"];
    let poses = [
        "Pose::from_parts",
        "Pose::from_rotation",
        "Pose::new",
        "Pose::rotation",
        "Rotation",
    ];
    for library in LIBRARIES {
        let mut sources = sources_of(&format!("{library}/src"));
        sources.retain(|source| source.file != "costmap/src/volumes/frame.rs");
        assert_none(&named(&sources, &turning));
        assert_none(&named(&sources, &poses));
    }
    // The planner's own use of parry needs none: boxes, segments, rays and meshes in world
    // coordinates.
    let round = [
        "Cylinder",
        "Cone",
        "Capsule",
        "RoundCylinder",
        "RoundCone",
        "HalfSpace",
    ];
    for source in sources_of("planner/src") {
        for shape in round {
            let imported = format!("parry3d::shape::{shape}");
            assert!(
                !source.names.contains(&imported),
                "{}: {imported}",
                source.file
            );
        }
    }
}

#[test]
fn the_command_plans_through_the_planner_s_front_door() {
    let sources = sources_of("src");
    // What a fleet manager needs stands at the root; the plan, the scenario and the check have more
    // names.
    let doors = [
        "planner::Control",
        "planner::Files",
        "planner::Outcome",
        "planner::Outline",
        "planner::Plan",
        "planner::Planned",
        "planner::WakeOutlines",
        "planner::World",
        "planner::contrast",
        "planner::plan",
        "planner::plan_world",
        "planner::read_world",
        "planner::read_world_with",
        "planner::scenario",
        "planner::verify",
    ];
    let all = named(&sources, &["planner"]);
    let through: BTreeSet<String> = named(&sources, &doors).into_iter().collect();
    let broken: Vec<String> = all
        .into_iter()
        .filter(|name| !through.contains(name))
        .collect();
    assert_none(&broken);
    assert_none(&named(&sources, &["costmap", "parry3d", "petgraph"]));
}

/// `.ci/run` runs once more, with the feature `long`, the modules that take more samples then, and
/// no others.
#[test]
fn what_takes_longer_with_the_feature_long_is_run_so() {
    let module = |file: &str| {
        let path = file.strip_prefix("tests/promises/")?.strip_suffix(".rs")?;
        Some(path.replace('/', "::") + "::")
    };
    let takes_more = |file: &String| {
        let text = read(file);
        [
            "crate::samples",
            "super::samples",
            "cfg(feature = \"long\")",
        ]
        .iter()
        .any(|mark| text.contains(mark))
    };
    let files = files_below("tests/promises").into_iter();
    let files =
        files.filter(|file| !file.ends_with("/main.rs") && !file.ends_with("boundaries.rs"));
    let mut long: BTreeSet<String> = files
        .filter(takes_more)
        .filter_map(|it| module(&it))
        .collect();
    let main = read("tests/promises/main.rs");
    let alone = main.split("#[cfg(feature = \"long\")]\nmod ").skip(1);
    long.extend(alone.filter_map(|rest| Some(rest.split_once(';')?.0.to_owned() + "::")));

    let ci = read(".ci/run").replace("\\\n", " ");
    let runs = ci.split("cargo test --features long --test promises -- ");
    let run: BTreeSet<&str> = runs
        .skip(1)
        .filter_map(|rest| rest.lines().next())
        .flat_map(|line| {
            line.trim_start_matches("--skip verifier::")
                .split_whitespace()
        })
        .collect();
    let lacks = long
        .iter()
        .filter(|it| !run.iter().any(|of| it.starts_with(of)));
    let lacks = lacks.map(|it| format!(".ci/run does not run {it} with `long`"));
    let idle = run
        .iter()
        .filter(|of| !long.iter().any(|it| it.starts_with(*of)));
    let idle = idle.map(|of| format!(".ci/run runs {of} with `long`, which changes nothing there"));
    assert_none(&lacks.chain(idle).collect::<Vec<_>>());
}

#[test]
fn the_text_belongs_to_no_machine() {
    let mut files = files_below("scenarios");
    for folder in [
        ".ci", "airflow", "benches", "costmap", "docs", "exchange", "flight", "planner", "service",
        "src", "tests",
    ] {
        files.extend(files_below(folder));
    }
    let top = [
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "Cargo.toml",
        "README.md",
        "STYLE.md",
    ];
    files.extend(top.map(String::from));
    let homes = ["home", "root", "work", "tmp", "Users"].map(|folder| format!("/{folder}/"));
    let mut broken = Vec::new();
    for file in files {
        let Ok(text) = fs::read_to_string(root().join(&file)) else {
            continue;
        };
        for (number, line) in text.lines().enumerate() {
            let names_home = homes.iter().any(|home| {
                line.match_indices(home.as_str()).any(|(at, _)| {
                    // "https://.../work/" and "out/tmp/" are no absolute paths.
                    !line[..at].ends_with(|c: char| c.is_alphanumeric() || "._-/".contains(c))
                })
            });
            if names_home || line.contains('\u{2014}') {
                broken.push(format!("{file}:{}: {line}", number + 1));
            }
        }
    }
    assert_none(&broken);
}
