//! Generated instances: endpoints free of one another's air at every size, and files that other
//! planners read.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use tools::instances::{Floor, InstanceError};

fn world(floor: Floor, drones: usize, seed: u64) -> planner::scenario::world::World {
    let text = floor.scenario(drones, seed).unwrap();
    planner::read_world(&text).unwrap()
}

#[test]
fn no_drone_starts_or_ends_in_the_wake_of_another_however_many_they_are() {
    for (floor, drones) in [
        (Floor::Hall, 2000),
        (Floor::Hall, 4096),
        (Floor::Warehouse, 2000),
        (Floor::Warehouse, 2976),
        (Floor::Field, 5000),
        (Floor::MixedHall, 500),
    ] {
        let found = planner::endpoint_conflicts(&world(floor, drones, 1)).worst;
        assert!(found.is_empty(), "{floor:?} {drones}: {:?}", found[0]);
    }
}

#[test]
fn a_mixed_hall_filled_to_the_last_column_still_has_endpoints_in_order() {
    for seed in 1..=3 {
        let Err(InstanceError::TooManyMixed { room, .. }) =
            Floor::MixedHall.scenario(usize::MAX, seed)
        else {
            panic!("no drone has so much room");
        };
        let world = world(Floor::MixedHall, room, seed);
        let heavy = world.drones.iter().skip(9).step_by(10);
        assert!(heavy.clone().count() > 100);
        assert!(
            heavy
                .into_iter()
                .all(|drone| drone.vehicle.airframe.name() == "matrice-300")
        );
        let found = planner::endpoint_conflicts(&world).worst;
        assert!(found.is_empty(), "seed {seed}: {:?}", found[0]);
    }
}

#[test]
fn more_of_a_mixed_fleet_than_fits_is_refused_with_the_number_that_does() {
    let output = generate(&["hall", "--every-tenth", "matrice-300", "--drones", "4000"]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8(output.stderr).unwrap();
    let Err(error) = Floor::MixedHall.scenario(4000, 0) else {
        panic!("it does not fit");
    };
    assert!(said.contains(&error.to_string()), "{said}");
}

fn generate(arguments: &[&str]) -> std::process::Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plan"));
    command.arg("generate").args(arguments).output().unwrap()
}

/// What `plan generate warehouse --drones 40 --seed 3` writes in another form, by ending.
fn exported(form: &str) -> BTreeMap<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new").join("folder");
    let out_word = out.to_str().unwrap();
    let fleet = ["warehouse", "--drones", "40", "--seed", "3"];
    let output = generate(&[&fleet[..], &["--format", form, "--out", out_word]].concat());
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(output.stdout.is_empty());
    let read = |entry: std::io::Result<fs::DirEntry>| {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let ending = name.strip_prefix("warehouse-40-3.").unwrap().to_owned();
        (ending, fs::read_to_string(path).unwrap())
    };
    fs::read_dir(&out).unwrap().map(read).collect()
}

/// Cell of a place in metres.
fn cell(place_m: &nalgebra::Point3<f64>) -> [usize; 3] {
    [place_m.x, place_m.y, place_m.z].map(|at_m| at_m.floor() as usize)
}

/// Starts and goals of the scenario itself.
fn flights() -> Vec<([usize; 3], [usize; 3])> {
    let world = world(Floor::Warehouse, 40, 3);
    let ends = |drone: &planner::scenario::world::Drone| {
        (cell(&drone.start_m), cell(&drone.tasks[0].to_m))
    };
    world.drones.iter().map(ends).collect()
}

/// Whether the scenario has a shelf in a cell.
fn shelved(at: [usize; 3]) -> bool {
    let [x, y, z] = at;
    let along = |at: usize, pitch: usize, width: usize, most: usize| {
        at >= 3 && (at - 3) % pitch < width && (at - 3) / pitch < most
    };
    z < 6 && along(x, 4, 2, 19) && along(y, 14, 12, 4)
}

fn numbers(line: &str) -> Vec<f64> {
    line.split_whitespace()
        .map(|word| word.parse().unwrap())
        .collect()
}

#[test]
fn moving_ai_voxels_are_the_scenarios_shelves_starts_and_goals() {
    let files = exported("movingai");
    assert_eq!(
        files.keys().collect::<Vec<_>>(),
        ["3dmap", "3dscen", "map", "scen"]
    );
    let mut lines = files["3dmap"].lines();
    assert_eq!(lines.next(), Some("voxel 80 60 8"));
    let blocked: Vec<[usize; 3]> = lines
        .map(|line| {
            numbers(line)
                .into_iter()
                .map(|n| n as usize)
                .collect::<Vec<_>>()
        })
        .map(|voxel| voxel.try_into().unwrap())
        .collect();
    assert_eq!(blocked.len(), 76 * 2 * 12 * 6);
    assert!(blocked.iter().all(|&voxel| shelved(voxel)));

    let mut lines = files["3dscen"].lines();
    assert_eq!(lines.next(), Some("version 1"));
    assert_eq!(lines.next(), Some("warehouse-40-3.3dmap"));
    let pairs: Vec<Vec<f64>> = lines.map(numbers).collect();
    for (pair, (start, goal)) in pairs.iter().zip(flights()) {
        let ends: Vec<f64> = start.iter().chain(&goal).map(|&at| at as f64).collect();
        assert_eq!(pair[..6], ends);
        let straight = (0..3)
            .map(|k| (pair[k] - pair[k + 3]).powi(2))
            .sum::<f64>()
            .sqrt();
        assert!(pair[6] >= straight - 1e-8 && pair[7] >= 1.0, "{pair:?}");
    }
    assert_eq!(pairs.len(), 40);
}

#[test]
fn the_moving_ai_map_is_the_floor_from_above() {
    let files = exported("movingai");
    let lines: Vec<&str> = files["map"].lines().collect();
    assert_eq!(lines[..4], ["type octile", "height 60", "width 80", "map"]);
    let rows = &lines[4..];
    assert_eq!(rows.len(), 60);
    for (y, row) in rows.iter().enumerate() {
        let expected = (0..80).map(|x| if shelved([x, y, 0]) { '@' } else { '.' });
        assert_eq!(*row, expected.collect::<String>());
    }
    let mut pairs = files["scen"].lines();
    assert_eq!(pairs.next(), Some("version 1"));
    for (line, (start, goal)) in pairs.zip(flights()) {
        let fields: Vec<&str> = line.split('\t').collect();
        assert_eq!(fields[1..4], ["warehouse-40-3.map", "80", "60"]);
        let places: Vec<usize> = fields[4..8].iter().map(|at| at.parse().unwrap()).collect();
        assert_eq!(places, [start[0], start[1], goal[0], goal[1]]);
        let length: f64 = fields[8].parse().unwrap();
        assert_eq!(fields[0], ((length / 4.0) as usize).to_string());
    }
    assert_eq!(files["scen"].lines().count(), 41);
}

#[test]
fn the_yaml_of_lib_multi_robot_planning_holds_the_same_and_its_first_two_numbers_are_the_floor() {
    let files = exported("libmultirobotplanning");
    let text = &files["yaml"];
    let triple = |words: &str| -> [usize; 3] {
        let inner = words
            .strip_prefix('[')
            .and_then(|it| it.strip_suffix(']'))
            .unwrap();
        let all: Vec<usize> = inner.split(", ").map(|at| at.parse().unwrap()).collect();
        all.try_into().unwrap()
    };
    let after = |mark: &str| -> Vec<[usize; 3]> {
        text.lines()
            .filter_map(|line| line.strip_prefix(mark))
            .map(triple)
            .collect()
    };
    let (starts, goals) = (after("  start: "), after("  goal: "));
    assert_eq!(starts.into_iter().zip(goals).collect::<Vec<_>>(), flights());
    let names: Vec<&str> = text
        .lines()
        .filter_map(|line| line.strip_prefix("- name: "))
        .collect();
    assert_eq!((names.len(), names[0], names[39]), (40, "d1", "d40"));
    assert_eq!(after("  dimensions: "), [[80, 60, 8]]);
    let blocked = after("  - ");
    assert_eq!(blocked.len(), 76 * 2 * 12 * 6);
    assert!(blocked.iter().all(|&at| shelved(at)));
    // A reader of two numbers sees every shelf as a wall, and no drone in one.
    assert!(
        flights()
            .iter()
            .all(|(start, goal)| { ![start, goal].iter().any(|at| shelved([at[0], at[1], 0])) })
    );
    // Nothing else is in the file.
    let known = 1 + 3 * 40 + 3 + blocked.len();
    assert_eq!(text.lines().count(), known);
}

#[test]
fn files_by_name_need_a_folder() {
    for form in ["movingai", "libmultirobotplanning"] {
        let output = generate(&["hall", "--drones", "2", "--format", form]);
        assert_eq!(output.status.code(), Some(2));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains("--out"), "{said}");
    }
}
