//! Bytes that no one meant: valid files changed at random, with an eye for what they are made of,
//! and plain noise. They are read, or refused with reasons; nothing panics, and nothing takes long.
//!
//! `FUZZ_INPUTS` asks for another number of each kind:
//! `FUZZ_INPUTS=100000 cargo test --release --features long --test promises fuzz`.

use std::collections::BTreeMap;
use std::io::{Cursor, Write as _};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use diagnosis::record::read::{Campaign, read_folder, read_log};
use diagnosis::statistics::draws::Draws;
use exchange::{Options, Target, export};
use planner::plan::{self, Plan, Solid};
use planner::scenario::{intended_as_plan, read_samples, samples_as_plan};
use planner::verify::examination::examine;
use planner::verify::verify;
use planner::{Control, Files};

use super::samples;

/// Inputs of each kind.
fn inputs() -> u64 {
    match std::env::var("FUZZ_INPUTS") {
        Ok(typed) => typed
            .parse()
            .unwrap_or_else(|_| panic!("FUZZ_INPUTS is no number: {typed}")),
        Err(_) => samples(1_000, 5_000),
    }
}
/// No input takes longer (s), in builds for tests.
const LONGEST_S: f64 = 5.0;
/// Nor does the whole process ever hold more (bytes).
const MOST_BYTES: u64 = 1 << 30;

/// Words that readers trip over: ends of ranges, of types, of texts.
const WORDS: [&str; 44] = [
    "0",
    "-0",
    "1",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "1e19",
    "4294967296",
    "18446744073709551616",
    "NaN",
    "nan",
    "inf",
    "-inf",
    "None",
    "null",
    "true",
    "\"\"",
    "\"\\u{0}\"",
    "\"a\"",
    "()",
    "[]",
    "{}",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    ":",
    ";",
    "\n",
    "\r\n",
    "\u{feff}",
    "\t",
    "//",
    "/*",
    "(0,0,0)",
    "[0,0,0]",
    "0.001",
    "20000",
    "1.0000000000000002",
    "\u{1F681}",
];

/// What a changed file is judged by.
struct Judged<'a> {
    /// What it is, for messages.
    what: &'static str,
    /// Valid files.
    seeds: Vec<Vec<u8>>,
    /// Changes in a row, at most.
    changes: usize,
    /// Reads one, and does with it what a command does next; may refuse it, must not panic.
    read: &'a dyn Fn(&[u8]),
}

impl Judged<'_> {
    fn holds(&self) {
        let _pool = own_pool();
        for index in 0..inputs() {
            let mut draws = Draws::new(index);
            let bytes = changed(&self.seeds, self.changes, &mut draws);
            one_holds((self.what, index), &bytes, || (self.read)(&bytes));
        }
        takes_little_memory(self.what);
    }
}

/// Neither panics nor takes long; an input that does is kept.
fn one_holds((what, index): (&str, u64), bytes: &[u8], run: impl FnOnce()) {
    let (started, used_s) = (Instant::now(), cpu_s());
    let ran = catch_unwind(AssertUnwindSafe(run));
    // Of the processor, where the system tells: the machine may do other things as well.
    let cpu_s = cpu_s()
        .zip(used_s)
        .map(|(now_s, before_s)| now_s - before_s);
    let took_s = cpu_s.unwrap_or(started.elapsed().as_secs_f64());
    let kept = || {
        let path = std::env::temp_dir().join(format!("{what}-{index}"));
        std::fs::write(&path, bytes).unwrap();
        path
    };
    assert!(ran.is_ok(), "{what} panics: {}", kept().display());
    assert!(
        took_s < LONGEST_S,
        "{what} takes {took_s} s: {}",
        kept().display()
    );
}

/// What this process has held so far.
fn takes_little_memory(what: &str) {
    if let Some(bytes) = peak_bytes() {
        assert!(bytes < MOST_BYTES, "{what}: {bytes} bytes");
    }
}

/// Work of this thread stays on it from now on, and that of other tests off it: what an input takes
/// is that of this thread.
fn own_pool() -> Option<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
    pool.use_current_thread().build().ok()
}

/// Time of the processor that this thread has used (s), where the system tells: Linux counts
/// hundredths of a second (proc(5), fields 14 and 15 of /proc/thread-self/stat).
fn cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/thread-self/stat").ok()?;
    let after_name = stat.rsplit_once(')')?.1;
    let mut ticks = after_name.split_ascii_whitespace().skip(11);
    let [user, system] = [ticks.next()?, ticks.next()?].map(str::parse::<f64>);
    Some((user.ok()? + system.ok()?) / 100.0)
}

/// Highest resident memory of this process so far, where the system tells.
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

/// One of the files with a few changes in a row, or noise.
fn changed(seeds: &[Vec<u8>], changes: usize, draws: &mut Draws) -> Vec<u8> {
    let noise = |draws: &mut Draws| -> Vec<u8> {
        let length = draws.index(200);
        (0..length).map(|_| draws.index(256) as u8).collect()
    };
    if draws.index(50) == 0 {
        return noise(draws);
    }
    let mut bytes = seeds[draws.index(seeds.len())].clone();
    for _ in 0..=draws.index(changes) {
        let at = draws.index(bytes.len() + 1);
        let span = at..(at + draws.index(40)).min(bytes.len());
        match draws.index(10) {
            // Bits and bytes.
            0 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << draws.index(8);
                }
            }
            1 => drop(bytes.splice(span, noise(draws))),
            2 => drop(bytes.drain(span)),
            3 => {
                let twice = bytes[span.clone()].to_vec();
                bytes.splice(at..at, twice);
            }
            4 => bytes.truncate(at),
            // Lines.
            5 => {
                let mut lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
                let (from, to) = (draws.index(lines.len()), draws.index(lines.len()));
                if !lines.is_empty() {
                    lines.swap(from, to);
                    bytes = lines.concat();
                }
            }
            // What another file has there.
            6 => {
                let other = &seeds[draws.index(seeds.len())];
                let from = draws.index(other.len());
                let length = draws.index(120).min(other.len() - from);
                bytes.splice(span, other[from..from + length].iter().copied());
            }
            // Numbers and words, whole.
            _ => {
                let is_part = |byte: &u8| byte.is_ascii_alphanumeric() || b"+-._".contains(byte);
                let ahead = bytes[at..].iter().position(is_part);
                let Some(first) = ahead.map(|ahead| at + ahead) else {
                    continue;
                };
                let length = bytes[first..]
                    .iter()
                    .take_while(|byte| is_part(byte))
                    .count();
                let word = WORDS[draws.index(WORDS.len())];
                bytes.splice(first..first + length, word.bytes());
            }
        }
    }
    bytes
}

fn shipped(folder: &str, ending: &str) -> Vec<(String, Vec<u8>)> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = std::fs::read_dir(folder).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut paths: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|it| it == ending))
        .collect();
    paths.sort();
    let read = |path: std::path::PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (name, std::fs::read(path).unwrap())
    };
    paths.into_iter().map(read).collect()
}

/// Stops once a time is over, as `--time-limit` does.
fn within(limit: Duration, run: impl FnOnce(&Control<'_>)) {
    let started = Instant::now();
    run(&Control {
        stop: &|| started.elapsed() >= limit,
        ..Control::QUIET
    });
}

const CUBE: &str = "o cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// One in so many scenarios that are in order is planned.
const PLANNED: u64 = 20;

/// The least share of scenarios that are in order after one change that is not within a comment:
/// what is planned is not all noise. Of 20 000 inputs 0.085 are; less three standard errors of a
/// thousand.
const IN_ORDER: f64 = 0.058;

#[test]
fn scenarios_of_any_bytes_are_read_and_planned_or_refused() {
    let mut seeds: Vec<Vec<u8>> = shipped("scenarios", "ron")
        .into_iter()
        .map(|it| it.1)
        .collect();
    seeds.push(
        br#"(name: "all", bounds_m: (min: (0, 0, 0), max: (9, 8, 5)), air: (temperature_c: 20, pressure_pa: 101325),
        obstacles: [(name: "b", min_m: (4, 2, 0), max_m: (5, 6, 2)), (name: "c", base_m: (7, 2, 0), radius_m: 0.4, height_m: 5),
          (name: "m", mesh: "cube.obj", at_m: (2, 6, 0))],
        zones: [(name: "z", min_m: (0, 0, 0), max_m: (2, 2, 1), air_limit_mps: 1.5, keep_out: true)],
        airframes: {"own": (mass_kg: 1.6, propellers: 4, propeller_diameter_m: 0.2, motor_distance_m: 0.45, max_speed_mps: 2)},
        drones: [(name: "k", airframe: "kolibri", start_m: (3, 1, 1), tasks: [(to_m: (8, 6, 3), dwell_s: 2, load_kg: 0.05)]),
          (name: "o", airframe: "own", start_m: (1, 4, 0.325), at_start: Landed, tasks: [(to_m: (6, 7, 2))], at_end: Land, air_limit: 0.4)],
        planning: (cell_m: 1, air_limit: 0.3, clearance_m: 0.1, time_margin_s: 0.1, tracking_m: 0.1, seed: 0))"#
            .to_vec(),
    );
    let findings: BTreeMap<String, Vec<u8>> =
        shipped("scenarios/findings", "ron").into_iter().collect();
    let load = |file: &str| {
        let known = findings
            .iter()
            .find(|(name, _)| file.ends_with(name.as_str()));
        let known = known.map(|(_, bytes)| String::from_utf8_lossy(bytes).into_owned());
        known
            .or_else(|| file.ends_with(".obj").then(|| CUBE.to_owned()))
            .ok_or_else(|| "no file".to_owned())
    };
    let read_count = std::cell::Cell::new(0_u64);
    let read = |bytes: &[u8]| {
        let Ok(text) = std::str::from_utf8(bytes) else {
            return;
        };
        let Ok(world) = planner::read_world_with(text, &Files::new(&load)) else {
            return;
        };
        assert_eq!(world.check(), Ok(()));
        read_count.set(read_count.get() + 1);
        // Tables of the air of a finding take seconds by themselves.
        let is_still = world.effects == airflow::effects::Effects::default();
        if is_still && u64::is_multiple_of(read_count.get(), PLANNED) {
            within(Duration::from_millis(500), |control| {
                planner::plan_world(&world, control).expect("in order");
            });
        }
    };
    let is_comment = |line: &&[u8]| line.trim_ascii_start().starts_with(b"//");
    let bare = seeds.iter().map(|seed| {
        let lines = seed.split_inclusive(|byte| *byte == b'\n');
        let lines: Vec<&[u8]> = lines.filter(|it| !is_comment(it)).collect();
        lines.concat()
    });
    let (bare, what) = (bare.collect(), "scenario");
    for (seeds, changes) in [(seeds, 5), (bare, 1)] {
        read_count.set(0);
        Judged {
            what,
            seeds,
            changes,
            read: &read,
        }
        .holds();
    }
    let share = read_count.get() as f64 / inputs() as f64;
    assert!(share > IN_ORDER, "{share}");
}

#[test]
fn meshes_of_any_bytes_are_read_or_refused() {
    let more = "# two\no a\nv 0 0 0\nv 0 2 0\nv 0 0 2 1.0\nvn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1\ng b\nf -1 -2 -3\nusemtl x\ns off\nl 1 2\np 1\n";
    let read_count = std::cell::Cell::new(0_u64);
    Judged {
        what: "mesh",
        seeds: vec![CUBE.into(), more.into()],
        changes: 5,
        read: &|bytes| {
            let load = |_: &str| String::from_utf8(bytes.to_vec()).map_err(|it| it.to_string());
            let text = r#"(name: "m", bounds_m: (min: (-9, -9, 0), max: (9, 9, 5)), obstacles: [(name: "m", mesh: "m.obj")],
                drones: [(name: "k", airframe: "kolibri", start_m: (7, 7, 4.5))])"#;
            let read = planner::read_world_with(text, &Files::new(&load));
            read_count.set(read_count.get() + u64::from(read.is_ok()));
        },
    }
    .holds();
    assert!(read_count.get() > inputs() / 20, "{}", read_count.get());
}

/// How late its drones may be is asked of one in so many plans.
const LATE: u64 = 20;

/// Plans of two or three drones: landing, payload, zones, a mesh, advected wakes.
fn plans() -> Vec<Plan> {
    let files = |file: &str| match file {
        "cube.obj" => Ok(CUBE.to_owned()),
        _ => Ok(
            "Finding(verdict: library, effects: (wake_transport: (lag_factor: 1.3)))".to_owned(),
        ),
    };
    let planned = |text: &str| {
        let world = planner::read_world_with(text, &Files::new(&files)).expect("in order");
        // Advected wakes are those of the finding.
        let world = crate::straight_and_quasi_static(world);
        let outcome = planner::plan_world(&world, &Control::QUIET).expect("in order");
        outcome.into_planned().expect("a plan").plan
    };
    let yard = r#"(name: "yard", bounds_m: (min: (0, 0, 0), max: (9, 8, 5)),
        obstacles: [(name: "b", min_m: (4, 2, 0), max_m: (5, 6, 2)), (name: "c", base_m: (7, 2, 0), radius_m: 0.4, height_m: 5)],
        zones: [(name: "z", min_m: (0, 0, 0), max_m: (2, 2, 1), air_limit_mps: 1.5)],
        drones: [(name: "k", airframe: "kolibri", start_m: (3, 1, 1), tasks: [(to_m: (8, 6, 3), dwell_s: 2, load_kg: 0.05)]),
          (name: "o", airframe: "offboard-2", start_m: (1, 4, 0.2), at_start: Landed, tasks: [(to_m: (6, 7, 2))], at_end: Land)])"#;
    let pair = r#"(name: "pair", bounds_m: (min: (0, 0, 0), max: (9, 8, 5)),
        drones: [(name: "k", airframe: "kolibri", start_m: (1, 1, 1), tasks: [(to_m: (8, 6, 3))]),
          (name: "l", airframe: "kolibri", start_m: (8, 6, 1), tasks: [(to_m: (1, 1, 1))], at_end: Leave)])"#;
    let late = r#"(name: "late", bounds_m: (min: (0, 0, 0), max: (9, 8, 5)), air: (finding: "finding.ron"),
        obstacles: [(name: "m", mesh: "cube.obj", at_m: (2, 6, 0))],
        zones: [(name: "z", min_m: (4, 0, 0), max_m: (6, 2, 1), air_limit_mps: 3, keep_out: true)],
        drones: [(name: "k", airframe: "kolibri", start_m: (1, 1, 1), tasks: [(to_m: (8, 6, 1))]),
          (name: "o", airframe: "offboard-2", start_m: (8, 1, 4), tasks: [(to_m: (1, 6, 4))])])"#;
    [yard, pair, late].map(planned).into()
}

#[test]
fn plans_of_any_bytes_are_verified_or_refused() {
    let seeds = plans().into_iter();
    let seeds = seeds.map(|plan| serde_json::to_vec(&plan).expect("plain data"));
    let read_count = std::cell::Cell::new(0_u64);
    Judged {
        what: "plan",
        seeds: seeds.collect(),
        changes: 5,
        read: &|bytes| {
            if let Ok(plan) = serde_json::from_slice::<Plan>(bytes) {
                verify(&plan);
            }
            let Ok(text) = std::str::from_utf8(bytes) else {
                return;
            };
            if let Ok(file) = plan::file::read(text) {
                read_count.set(read_count.get() + 1);
                examine(&file, u64::is_multiple_of(read_count.get(), LATE));
            }
        },
    }
    .holds();
    assert!(read_count.get() > inputs() / 20, "{}", read_count.get());
}

/// Every number of a plan that is not a result.
fn numbers(plan: &mut Plan) -> Vec<&mut f64> {
    let Plan {
        air,
        bounds_m,
        obstacles,
        zones,
        margins,
        drones,
        ..
    } = plan;
    let mut all = vec![
        &mut air.density_kg_per_m3,
        &mut air.jet.centreline,
        &mut air.jet.spreading,
        &mut air.jet.origin,
        &mut margins.time_s,
        &mut margins.tracking_m,
    ];
    all.extend(bounds_m.min.iter_mut().chain(bounds_m.max.iter_mut()));
    for obstacle in obstacles {
        match &mut obstacle.shape {
            Solid::Box { min_m, max_m } => all.extend(min_m.iter_mut().chain(max_m.iter_mut())),
            Solid::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => {
                all.extend(base_m.iter_mut());
                all.extend([radius_m, height_m]);
            }
            Solid::Mesh { vertices_m, .. } => {
                all.extend(vertices_m.iter_mut().flat_map(|it| it.iter_mut()));
            }
        }
    }
    for zone in zones {
        all.extend(zone.min_m.iter_mut().chain(zone.max_m.iter_mut()));
        all.extend(zone.air_limit_mps.as_mut());
    }
    for drone in drones {
        let airframe = &mut drone.airframe;
        all.extend([
            &mut drone.air_limit,
            &mut drone.airborne_s.0,
            &mut drone.arrives_s,
            &mut airframe.mass_kg,
            &mut airframe.propeller_diameter_m,
            &mut airframe.motor_distance_m,
            &mut airframe.width_factor,
            &mut airframe.body_radius_m,
            &mut airframe.max_speed_mps,
        ]);
        all.extend(drone.airborne_s.1.as_mut());
        all.extend(drone.enters_s.as_mut());
        all.extend(airframe.max_climb_mps.as_mut());
        all.extend(airframe.max_descent_mps.as_mut());
        all.extend(&mut drone.trajectory.t_s);
        all.extend(&mut drone.trajectory.mass_kg);
        let places_m = drone.trajectory.position_m.iter_mut();
        all.extend(places_m.flat_map(|it| it.iter_mut()));
    }
    all
}

#[test]
fn plans_of_any_numbers_are_verified() {
    let ends = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MAX,
        f64::MIN_POSITIVE,
        5e-324,
        1e300,
        -1e300,
        1e154,
        1e9,
        1e7,
        -1e7,
        1e3,
        1.0,
        0.0,
        -0.0,
        -1.0,
        1e-3,
        1e-9,
    ];
    let seeds = plans();
    let _pool = own_pool();
    for index in 0..inputs() {
        let mut draws = Draws::new(index);
        let mut plan = seeds[draws.index(seeds.len())].clone();
        if draws.index(3) == 0 {
            let count = plan.drones.len();
            plan.drones[draws.index(count)].enters_s = Some(0.0);
        }
        let mut all = numbers(&mut plan);
        for _ in 0..=draws.index(4) {
            let at = draws.index(all.len());
            let other = *all[draws.index(all.len())];
            let number = &mut *all[at];
            *number = match draws.index(6) {
                0 => number.next_up(),
                1 => number.next_down(),
                2 => other,
                3 => *number * ends[draws.index(ends.len())],
                _ => ends[draws.index(ends.len())],
            };
        }
        let told = format!("{plan:?}");
        one_holds(("numbers", index), told.as_bytes(), || drop(verify(&plan)));
    }
    takes_little_memory("numbers");
}

#[test]
fn flown_tables_of_any_bytes_are_judged_or_refused() {
    let table = b"t_s,drone,x_m,y_m,z_m,mass_kg\n0,a,1,1,3,\n0,b,1,1,1,0.05\n0.5,a,2,1,3,\n0.5,b,1,2,1,\n1,a,3,1,3,\n1,b,1,3,1,\n";
    let fleet = br#"F(airframe: "crazyflie-2.1", airframes: { "courier": (mass_kg: 1.6, propeller_diameter_m: 0.2, motor_distance_m: 0.45) },
        drones: [(name: "a", airframe: "courier", air_limit: 0.4)], bounds_m: (min: (0, 0, 0), max: (9, 8, 5)),
        obstacles: [(name: "b", min_m: (4, 2, 0), max_m: (5, 6, 2))], zones: [(name: "z", min_m: (6, 0, 0), max_m: (8, 2, 1), air_limit_mps: 1.5)])"#;
    let read_count = std::cell::Cell::new(0_u64);
    let as_text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Judged {
        what: "flown",
        // Few changes leave RON in order.
        seeds: [vec![[b"T", &table[..]].concat(); 4], vec![fleet.to_vec()]].concat(),
        changes: 5,
        read: &|bytes| {
            // The first byte says which of the two files it is; the other one is in order.
            let (table, fleet) = match bytes {
                [b'T', rest @ ..] => (as_text(rest), as_text(&fleet[1..])),
                [b'F', rest @ ..] => (as_text(table), as_text(rest)),
                _ => return,
            };
            let Ok(samples) = read_samples(&table) else {
                return;
            };
            let load = |_: &str| Ok(CUBE.to_owned());
            if let Ok(file) = samples_as_plan("log", &samples, &fleet, &Files::new(&load)) {
                read_count.set(read_count.get() + 1);
                examine(&file, u64::is_multiple_of(read_count.get(), LATE));
            }
        },
    }
    .holds();
    assert!(read_count.get() > inputs() / 40, "{}", read_count.get());
}

/// Files of other programs, as they are written here, each behind a letter that says which it is;
/// the JSON of a show twice, as a change seldom leaves a zip whole.
fn shows() -> Vec<Vec<u8>> {
    let plan = r#"{"format": "plan/2", "scenario": "shows", "bounds_m": {"min": [0,0,0], "max": [20,20,9]}, "drones": [
        {"name": "a", "airframe": "crazyflie-2.1", "trajectory": {"t_s": [0, 2, 4, 6, 8, 10],
            "position_m": [[2,9,2], [2.5,9,2.1], [5,9,2.6], [7.5,9,3.1], [8,9,3.2], [8,9,3.2]],
            "control_m": [[[2,9,2],[2,9,2]], [[3,9,2.2],[4,9,2.4]], [[6,9,2.8],[7,9,3]], [[8,9,3.2],[8,9,3.2]], []]}}]}"#;
    let plan = planner::plan::file::read(plan).unwrap().plan;
    let options = Options {
        plan_id: "0123456789abcdef".to_owned(),
        georeference: None,
        axes: exchange::frame::Axes::Ned,
        rate_hz: 5.0,
        own_origin: false,
        compressed_alone: false,
        untimed_ok: false,
        kept: Default::default(),
    };
    let of = |to: Target, ending: &str, letter: u8| {
        let made = export(&plan, to, &options).unwrap();
        let file = made.files.iter().find(|it| it.name.ends_with(ending));
        [&[letter], &file.unwrap().bytes[..]].concat()
    };
    let show = br#"J{"version": 1, "swarm": {"drones": [{"type": "generic", "settings": {"name": "a", "home": [1, 2, 0], "landAt": [1, 2, 0],
        "trajectory": {"version": 1, "takeoffTime": 1.5, "points": [[0, [1, 2, 0], []], [2, [1, 2, 3], []],
        [5, [4, 2, 3], [[2, 2, 3], [3, 2, 3]]], [7, [4, 4, 3], [[4, 3, 3]]], [9, [4, 4, 0], []]]}}}]}}"#;
    let studio = b"Ta\nTime_msec,X_m,Y_m,Z_m,R,G,B\n0,1,1,0,255,0,0\n1000,1,1,2,255,0,0\n3000,4,1,2,0,0,255\n";
    let all = [
        of(Target::Skybrush, ".skyc", b'C'),
        of(Target::Skybrush, ".skyb", b'B'),
        of(Target::Crazyswarm, ".cfpoly", b'P'),
        of(Target::Crazyswarm, ".csv", b'T'),
        of(Target::Setpoints, ".csv", b'T'),
        [b"T", &studio[3..]].concat(),
    ];
    // Tables stay in order the most often.
    let tables = all[4..].to_vec();
    [
        all.to_vec(),
        vec![show.to_vec(); 2],
        vec![tables; 3].concat(),
    ]
    .concat()
}

#[test]
fn shows_of_any_bytes_are_judged_or_refused() {
    let fleet =
        r#"Fleet(airframe: "crazyflie-2.1", bounds_m: (min: (-50, -50, -1), max: (50, 50, 50)))"#;
    let read_count = std::cell::Cell::new(0_u64);
    Judged {
        what: "shows",
        seeds: shows(),
        changes: 5,
        read: &|bytes| {
            let Some((letter, rest)) = bytes.split_first() else {
                return;
            };
            let (name, bytes) = match letter {
                b'C' => ("show.skyc", rest.to_vec()),
                b'J' => ("show.skyc", zipped("show.json", rest)),
                b'B' => ("a.skyb", rest.to_vec()),
                b'P' => ("a.cfpoly", rest.to_vec()),
                _ => ("a.csv", rest.to_vec()),
            };
            let file = exchange::File {
                name: name.to_owned(),
                bytes,
            };
            let Ok(show) = exchange::read_show(&[file], Default::default()) else {
                return;
            };
            let load = |_: &str| Err("no files".to_owned());
            let files = Files::new(&load);
            if let Ok(file) = intended_as_plan("show", show.drones, fleet, &files) {
                read_count.set(read_count.get() + 1);
                examine(&file, false);
            }
        },
    }
    .holds();
    assert!(read_count.get() > inputs() / 40, "{}", read_count.get());
}

/// One file in a zip.
fn zipped(name: &str, bytes: &[u8]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    zip.start_file(name, zip::write::SimpleFileOptions::default())
        .unwrap();
    zip.write_all(bytes).unwrap();
    zip.finish().unwrap().into_inner()
}

const LOGS: &str = r#"(
    name: "two", floor_z_m: 0, acceleration: SpecificForceInWorld, clock: Own(within_s: 0.03), air: (temperature_c: 15),
    types: { "small": (mass_kg: Stated(0.034), propeller_diameter_m: Inferred(0.0462), motor_distance_m: Stated(0.092),
                       rotor_offset_m: Stated((0, 0, 0.01)), touch_z_m: 0.07) },
    vehicles: { "a": "small", "b": "small" },
)"#;

/// Half a second of two drones, as a table.
fn log() -> Vec<u8> {
    let mut text = "t_s,vehicle,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,qx,qy,qz,qw,pwm1,pwm2,pwm3,pwm4,vbat_v\n".to_owned();
    for index in 0..25 {
        let t_s = f64::from(index) / 50.0;
        for name in ["a", "b"] {
            text += &format!("{t_s:.3},{name},0,0,1,0,0,0,0,0,9.81,0,0,0,1,0.5,0.5,0.5,0.5,3.9\n");
        }
    }
    text.into_bytes()
}

/// A fifth of a second on a Crazyflie's card, without its checksum, after the firmware's own reader
/// (`tools/usdlog/cfusdlog.py`).
fn card() -> Vec<u8> {
    let mut log = vec![0xBC, 2, 0, 2, 0, 0, 0];
    log.extend(b"fast\0\x05\0stateEstimateZ.x(h)\0stateEstimateZ.y(h)\0stateEstimate.z(f)\0acc.z(e)\0motor.m1(H)\0");
    log.extend(b"\x01\0slow\0\x02\0pm.vbat(f)\0pm.state(B)\0");
    for tick in 0..10_u64 {
        log.extend(0_u16.to_le_bytes());
        log.extend((20_000 * tick).to_le_bytes());
        log.extend([0, 1, 0, 1, 0, 0, 0x80, 0x3F, 0, 0x3C, 0, 0x80]);
        if tick % 5 == 0 {
            log.extend(1_u16.to_le_bytes());
            log.extend((20_000 * tick + 3).to_le_bytes());
            log.extend(3.9_f32.to_le_bytes());
            log.push(0);
        }
    }
    log
}

/// A fifth of a second of one drone, after ArduPilot's declarations
/// (`libraries/AP_Logger/LogStructure.h`).
fn dataflash() -> Vec<u8> {
    let mut log = Vec::new();
    let kinds: [([u8; 2], [&str; 3]); 3] = [
        ([80, 24], ["XKF1", "QBfff", "TimeUS,C,PN,PE,PD"]),
        ([81, 17], ["ATT", "QccC", "TimeUS,Roll,Pitch,Yaw"]),
        ([82, 19], ["RCOU", "QHHHH", "TimeUS,C1,C2,C3,C4"]),
    ];
    for (head, texts) in kinds {
        let mut payload = [0; 86];
        payload[..2].copy_from_slice(&head);
        for (from, text) in [2, 6, 22].into_iter().zip(texts) {
            payload[from..from + text.len()].copy_from_slice(text.as_bytes());
        }
        log.extend([0xA3, 0x95, 128]);
        log.extend(payload);
    }
    for tick in 0..10_u64 {
        let stamp = (20_000 * tick).to_le_bytes();
        log.extend([&[0xA3, 0x95, 80], &stamp[..], &[0; 11], &[0x80, 0xBF]].concat());
        log.extend([&[0xA3, 0x95, 81], &stamp[..], &[0; 6]].concat());
        log.extend(
            [
                &[0xA3, 0x95, 82],
                &stamp[..],
                &[0xDC, 5, 0xDC, 5, 0xDC, 5, 0xDC, 5],
            ]
            .concat(),
        );
    }
    log
}

/// A tenth of a second of one drone, after the format's description (docs.px4.io, "ULog File
/// Format").
fn ulog() -> Vec<u8> {
    let mut log = b"ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0".to_vec();
    let mut put = |kind: u8, parts: &[&[u8]]| {
        let payload = parts.concat();
        log.extend(u16::try_from(payload.len()).unwrap().to_le_bytes());
        log.push(kind);
        log.extend(payload);
    };
    put(b'B', &[&[0; 40]]);
    let topics = [
        "vehicle_local_position:uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;bool xy_valid;bool z_valid;",
        "vehicle_attitude:uint64_t timestamp;float[4] q;",
        "sensor_combined:uint64_t timestamp;float[3] accelerometer_m_s2;",
        "actuator_motors:uint64_t timestamp;float[12] control;",
        "battery_status:uint64_t timestamp;float voltage_v;",
    ];
    topics
        .iter()
        .for_each(|format| put(b'F', &[format.as_bytes()]));
    for (id, format) in topics.iter().enumerate() {
        let topic = format.split(':').next().unwrap();
        put(b'A', &[&[0], &(id as u16).to_le_bytes(), topic.as_bytes()]);
    }
    for tick in 0..20_u64 {
        let floats =
            |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|it| it.to_le_bytes()).collect() };
        let mut motors = [0.5_f32; 12];
        motors[4..].fill(f32::NAN);
        let values: [(&[f32], &[u8]); 5] = [
            (&[0.1, 2.0, -3.0, 1.0, 0.0, 0.0], &[1, 1]),
            (&[0.7, 0.0, 0.0, 0.7], &[]),
            (&[0.0, 0.0, -9.8], &[]),
            (&motors, &[]),
            (&[16.2], &[]),
        ];
        for (id, (values, flags)) in values.into_iter().enumerate() {
            let t_us = 5_000_000 + 20_000 * tick;
            put(
                b'D',
                &[
                    &(id as u16).to_le_bytes(),
                    &t_us.to_le_bytes(),
                    &floats(values),
                    flags,
                ],
            );
        }
    }
    log
}

#[test]
fn recordings_of_any_bytes_are_read_or_refused() {
    let campaign = Campaign::parse("c.ron", LOGS).expect("in order");
    let folder: BTreeMap<String, Vec<u8>> = ["json", "csv"]
        .into_iter()
        .flat_map(|ending| shipped("recordings/hover-grids/kolibri-1", ending))
        .map(|(name, mut bytes)| {
            // A few rows are enough.
            let rows = bytes.split_inclusive(|byte| *byte == b'\n').take(60);
            if name.ends_with("csv") {
                bytes = rows.collect::<Vec<_>>().concat();
            }
            (name, bytes)
        })
        .collect();
    let of_bags = LOGS.replace(
        r#""a": "small", "b": "small""#,
        r#""cf1": "small", "cf2": "small""#,
    );
    let of_bags = Campaign::parse("c.ron", &of_bags).expect("in order");
    let kinds = [b"T", b"U", b"C", b"K", b"B", b"M", b"M", b"M"];
    let mut seeds: Vec<Vec<u8>> = vec![log(), ulog(), LOGS.into(), card(), dataflash()];
    // Chunks have checksums; beside them a bag without.
    let bags = ["plain", "foxglove", "lz4"].map(|name| format!("diagnosis/logs/{name}.mcap"));
    seeds.extend(bags.map(|bag| std::fs::read(bag).expect("in the repository")));
    seeds
        .iter_mut()
        .zip(kinds)
        .for_each(|(seed, kind)| drop(seed.splice(0..0, kind.iter().copied())));
    seeds.extend(
        folder
            .iter()
            .map(|(name, bytes)| [name.as_bytes(), b"|", &bytes[..]].concat()),
    );
    let read_count = std::cell::Cell::new(0_u64);
    Judged {
        what: "recording",
        seeds,
        changes: 5,
        read: &|bytes| {
            // The first byte, or the name before the bar, says what it is read as.
            let is_read = match bytes {
                [b'T', rest @ ..] => read_log("f", "f.csv", rest, &campaign).is_ok(),
                [b'U', rest @ ..] => read_log("a", "a.ulg", rest, &campaign).is_ok(),
                [b'B', rest @ ..] => read_log("a", "a.bin", rest, &campaign).is_ok(),
                [b'M', rest @ ..] => read_log("a", "a.mcap", rest, &of_bags).is_ok(),
                // With a checksum that is right, or nothing behind it would be read.
                [b'K', rest @ ..] => {
                    let crc = crc32fast::hash(rest).to_le_bytes();
                    let log = [rest, &crc].concat();
                    let _ = read_log("a", "a", rest, &campaign);
                    read_log("a", "a", &log[..], &campaign).is_ok()
                }
                [b'C', rest @ ..] => std::str::from_utf8(rest)
                    .is_ok_and(|text| Campaign::parse("c.ron", text).is_ok()),
                _ => {
                    let mut files = folder.clone();
                    let bar = bytes.iter().position(|byte| *byte == b'|').unwrap_or(0);
                    let name = String::from_utf8_lossy(&bytes[..bar]).into_owned();
                    let known = files.contains_key(&name);
                    let name = if known { name } else { "meta.json".to_owned() };
                    files.insert(name, bytes[(bar + 1).min(bytes.len())..].to_vec());
                    read_folder("r", &files).is_ok()
                }
            };
            read_count.set(read_count.get() + u64::from(is_read));
        },
    }
    .holds();
    assert!(read_count.get() > inputs() / 20, "{}", read_count.get());
}
