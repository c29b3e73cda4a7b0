//! The lines that ARCHITECTURE.md draws, held against the manifests and the sources as they are.
//!
//! Sources are read as tokens, so that comments, texts and layout cannot matter; code under
//! `#[cfg(test)]` is left out, because tests may print and reach where they like.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

const LIBRARIES: [&str; 3] = ["airflow", "costmap", "planner"];

/// Parts of `planner` that judge a plan without the search, and may therefore ask `airflow`.
const JUDGES: [&str; 3] = [
    "planner/src/verify/",
    "planner/src/endpoints.rs",
    "planner/src/endpoints/",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every file below a folder of the checkout, as paths from its root with `/`, sorted.
fn files_below(folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path: PathBuf = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let parts: Vec<_> = path
                    .strip_prefix(root())
                    .unwrap()
                    .iter()
                    .map(|part| part.to_str().unwrap())
                    .collect();
                found.push(parts.join("/"));
            }
        }
    }
    found.sort();
    found
}

fn read(file: &str) -> String {
    fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// The sources of one crate, without its tests, examples and benches.
fn sources_of(folder: &str) -> Vec<Source> {
    files_below(folder)
        .into_iter()
        .filter(|file| file.ends_with(".rs"))
        .map(Source::read)
        .collect()
}

/// One source file: every path it names (`std::fs::File`, one for each leaf of a `use`), and macros with their `!`.
struct Source {
    file: String,
    names: BTreeSet<String>,
}

impl Source {
    fn read(file: String) -> Source {
        let tokens: TokenStream = read(&file)
            .parse()
            .unwrap_or_else(|error| panic!("{file}: {error}"));
        let mut names = BTreeSet::new();
        collect(tokens, "", &mut names);
        Source { file, names }
    }

    /// The names at or below a path: `std::fs` finds `std::fs::File`, not `std::fstab`.
    fn names_below<'a>(&'a self, path: &'a str) -> impl Iterator<Item = &'a str> {
        self.names.iter().map(String::as_str).filter(move |name| {
            name.strip_prefix(path)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
        })
    }

    fn is_in(&self, places: &[&str]) -> bool {
        places.iter().any(|place| self.file.starts_with(place))
    }
}

/// Walks tokens; `before` is the path that a group in braces continues, as in `use std::{fs, env}`.
fn collect(tokens: TokenStream, before: &str, names: &mut BTreeSet<String>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut at = 0;
    let mut path = before.to_owned();
    let mut goes_on = !before.is_empty();
    while let Some(token) = tokens.get(at) {
        match token {
            TokenTree::Ident(word) => {
                path = if goes_on {
                    format!("{path}::{word}")
                } else {
                    word.to_string()
                };
                goes_on = false;
                let separated = is_mark(&tokens, at + 1, ':') && is_mark(&tokens, at + 2, ':');
                if separated {
                    goes_on = true;
                    at += 2;
                } else {
                    let mark = if is_mark(&tokens, at + 1, '!') {
                        "!"
                    } else {
                        ""
                    };
                    names.insert(format!("{path}{mark}"));
                }
            }
            TokenTree::Group(group) => {
                let prefix = if goes_on { path.as_str() } else { "" };
                collect(group.stream(), prefix, names);
                goes_on = false;
            }
            TokenTree::Punct(mark) if mark.as_char() == '#' && is_cfg_test(tokens.get(at + 1)) => {
                at = end_of_item(&tokens, at + 2);
                continue;
            }
            TokenTree::Punct(mark) if mark.as_char() == ',' => {
                path = before.to_owned();
                goes_on = !before.is_empty();
            }
            TokenTree::Punct(_) | TokenTree::Literal(_) => goes_on = false,
        }
        at += 1;
    }
}

fn is_mark(tokens: &[TokenTree], at: usize, mark: char) -> bool {
    matches!(tokens.get(at), Some(TokenTree::Punct(found)) if found.as_char() == mark)
}

fn is_cfg_test(token: Option<&TokenTree>) -> bool {
    token.is_some_and(|token| token.to_string().replace(' ', "") == "[cfg(test)]")
}

/// The place after the item that starts here: after its body in braces, or its semicolon.
fn end_of_item(tokens: &[TokenTree], from: usize) -> usize {
    let ends = |token: &TokenTree| match token {
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        TokenTree::Punct(mark) => mark.as_char() == ';',
        _ => false,
    };
    let length = tokens[from.min(tokens.len())..].iter().position(ends);
    length.map_or(tokens.len(), |length| from + length + 1)
}

/// The crates that a manifest names in `[dependencies]`, `[dev-dependencies]` and the like.
fn dependencies(manifest: &str) -> BTreeSet<String> {
    let mut inside = false;
    let mut found = BTreeSet::new();
    for line in read(manifest).lines().map(str::trim) {
        if line.starts_with('[') {
            inside = line.trim_matches(['[', ']']).ends_with("dependencies")
                && !line.contains("workspace");
        } else if let Some((name, _)) = line.split_once('=').filter(|_| inside) {
            let name = name.trim().split('.').next().unwrap();
            if !name.starts_with('#') {
                found.insert(name.to_owned());
            }
        }
    }
    found
}

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

#[test]
fn dependencies_run_one_way() {
    assert!(
        read("Cargo.toml").contains(r#"members = ["airflow", "costmap", "planner"]"#),
        "a new crate needs its line here and in ARCHITECTURE.md"
    );
    for (crate_name, below) in [
        ("airflow", &[][..]),
        ("costmap", &["airflow"]),
        ("planner", &["airflow", "costmap"]),
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
    let expected = ["nalgebra", "thiserror"].map(String::from);
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
        assert_none(&named(
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
        ));
    }
}

#[test]
fn the_search_never_evaluates_a_jet() {
    let whole = sources_of("planner/src");
    let search = [
        "distances",
        "errand",
        "fleet",
        "lattice",
        "placement",
        "priority",
        "roadmap",
        "search",
        "solid",
    ]
    .map(|module| format!("planner/src/{module}.rs"));
    for file in &search {
        let source = whole.iter().find(|source| source.file == *file);
        let source = source.unwrap_or_else(|| panic!("{file} has moved"));
        assert_none(&named(std::slice::from_ref(source), &["airflow"]));
    }
}

#[test]
fn outside_its_judges_the_planner_takes_descriptions_from_airflow_and_no_wake() {
    // What is blown (airframe, air, jet constants, how jets add up), and beta for words about a price.
    let allowed = [
        "airflow::Air",
        "airflow::Airframe",
        "airflow::Jet",
        "airflow::Superposition",
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
        "planner/src/trajectory",
        "planner/src/plan.rs",
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
        "planner/src/trajectory.rs",
        "planner/src/plan.rs",
    ];
    for source in judged
        .iter()
        .filter(|source| roots.contains(&source.file.as_str()))
    {
        assert_none(&named(std::slice::from_ref(source), &["super"]));
    }
}

#[test]
fn shapes_are_stood_up_in_one_place() {
    // Parry's round shapes stand on y: whoever hangs one into the world needs a rotation.
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
        sources.retain(|source| source.file != "costmap/src/frame.rs");
        assert_none(&named(&sources, &turning));
        assert_none(&named(&sources, &poses));
    }
    // The planner's own use of parry needs none: boxes, segments, rays and meshes in world coordinates.
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
    let doors = [
        "planner::contrast",
        "planner::instances",
        "planner::outcome",
        "planner::plan",
        "planner::plan_world",
        "planner::scenario",
        "planner::verify",
        "planner::world",
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

#[test]
fn the_text_belongs_to_no_machine() {
    let mut files = files_below("scenarios");
    for folder in [
        ".ci", "airflow", "benches", "costmap", "docs", "planner", "src", "tests",
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

#[test]
fn the_reader_of_sources_sees_through_comments_groups_and_tests() {
    let text = r##"
        //! std::fs in words
        use std::{fs, path::{self, Path}};
        /* println!("no") */
        fn f() { let s = "eprintln!"; crate::search::g(s); println!("yes"); }
        #[cfg(test)]
        mod tests { use std::time::Instant; }
        fn after() { std::env::args(); }
    "##;
    let mut names = BTreeSet::new();
    collect(text.parse().unwrap(), "", &mut names);
    let seen = |name: &str| names.contains(name);
    for name in [
        "std::fs",
        "std::path::Path",
        "crate::search::g",
        "println!",
        "std::env::args",
    ] {
        assert!(seen(name), "{name} in {names:?}");
    }
    assert!(
        !seen("std::time::Instant") && !seen("eprintln!"),
        "{names:?}"
    );
}
