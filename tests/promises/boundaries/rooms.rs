//! Imports between the rooms of a crate: its files and folders next to `lib.rs`, one room each.

use std::collections::{BTreeMap, BTreeSet};

use super::sources::{Source, sources_of};

/// Crates whose rooms must make no circle of imports, by the folder of their sources.
const COVERED: [&str; 5] = [
    "airflow/src",
    "costmap/src",
    "planner/src",
    "diagnosis/src",
    "src",
];

/// Which rooms each room imports from, and where it does.
type Arrows = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

#[test]
fn rooms_import_one_another_without_circles() {
    for folder in COVERED {
        let arrows = arrows(folder);
        assert!(arrows.len() > 3, "{folder} has {} rooms", arrows.len());
        let circles = circles(&arrows);
        assert!(
            circles.is_empty(),
            "{folder} has {} circles of imports:\n{}",
            circles.len(),
            circles.join("\n")
        );
    }
}

#[test]
fn a_circle_of_three_rooms_is_found_and_a_room_outside_it_is_not() {
    let arrow = |from: &str, to: &str| {
        let places = BTreeSet::from([format!("{from}.rs")]);
        (from.to_owned(), BTreeMap::from([(to.to_owned(), places)]))
    };
    let arrows = Arrows::from([
        arrow("plan", "scenario"),
        arrow("scenario", "graph"),
        arrow("graph", "plan"),
        arrow("solver", "plan"),
    ]);
    let circles = circles(&arrows);
    assert_eq!(circles.len(), 1, "{circles:?}");
    assert!(circles[0].contains("graph (graph.rs) -> plan"));
    assert!(!circles[0].contains("solver"), "{circles:?}");
}

/// The imports of every file below a folder of sources, but `lib.rs`, which only names them all.
fn arrows(folder: &str) -> Arrows {
    let sources = sources_of(folder);
    let path_of = |source: &Source| -> Vec<String> {
        let below = &source.file[folder.len() + 1..source.file.len() - ".rs".len()];
        let parts = below.split('/').filter(|part| *part != "mod");
        parts.map(str::to_owned).collect()
    };
    let is_root = |path: &[String]| ["lib", "main", "bin"].contains(&path[0].as_str());
    let rooms: BTreeSet<String> = (sources.iter().map(path_of))
        .filter(|path| !is_root(path))
        .map(|path| path[0].clone())
        .collect();
    // What `lib.rs` gives out under a shorter name counts for the room that it comes from.
    let lent: BTreeMap<String, String> = (sources.iter())
        .filter(|source| path_of(source) == ["lib"])
        .flat_map(|source| source.names.iter())
        .filter_map(|name| {
            let (room, rest) = name.split_once("::")?;
            let last = rest.rsplit("::").next()?;
            (rooms.contains(room)).then(|| (last.to_owned(), room.to_owned()))
        })
        .collect();
    let mut arrows = Arrows::new();
    for source in &sources {
        let path = path_of(source);
        if is_root(&path) {
            continue;
        }
        let from = arrows.entry(path[0].clone()).or_default();
        for name in source.names.iter() {
            let Some(to) = first_segment(name, &path) else {
                continue;
            };
            let to = lent.get(&to).unwrap_or(&to);
            if rooms.contains(to) && *to != path[0] {
                let places = from.entry(to.clone()).or_default();
                places.insert(source.file.clone());
            }
        }
    }
    arrows
}

/// The first segment below the crate's root of a path that begins with `crate` or leads there by
/// `super`.
fn first_segment(name: &str, path: &[String]) -> Option<String> {
    let mut segments = name.split("::").peekable();
    if segments.peek() == Some(&"crate") {
        return segments.nth(1).map(str::to_owned);
    }
    let ups = name.split("::").take_while(|part| *part == "super").count();
    (ups == path.len())
        .then(|| segments.nth(ups))
        .flatten()
        .map(str::to_owned)
}

/// One line for each set of rooms that reach one another: their arrows, with the files that draw
/// them.
fn circles(arrows: &Arrows) -> Vec<String> {
    let reached_from = |room: &String| {
        let mut reached: BTreeSet<&String> = BTreeSet::new();
        let mut open = vec![room];
        while let Some(room) = open.pop() {
            for to in arrows.get(room).into_iter().flat_map(BTreeMap::keys) {
                if reached.insert(to) {
                    open.push(to);
                }
            }
        }
        reached
    };
    let reached: BTreeMap<&String, BTreeSet<&String>> = (arrows.keys())
        .map(|room| (room, reached_from(room)))
        .collect();
    let mut told: BTreeSet<&String> = BTreeSet::new();
    let mut circles = Vec::new();
    for (room, onward) in &reached {
        if !onward.contains(*room) || told.contains(*room) {
            continue;
        }
        let back = |other: &&&String| reached.get(**other).is_some_and(|it| it.contains(*room));
        let circle: BTreeSet<&String> = onward.iter().filter(back).copied().collect();
        told.extend(&circle);
        let within = circle.iter().flat_map(|from| {
            let to = arrows[*from].iter().filter(|(to, _)| circle.contains(to));
            to.map(move |(to, places)| {
                let places: Vec<&str> = places.iter().map(String::as_str).collect();
                format!("{from} ({}) -> {to}", places.join(", "))
            })
        });
        circles.push(within.collect::<Vec<_>>().join("; "));
    }
    circles
}
