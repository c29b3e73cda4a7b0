//! Flights of small drones over one another (Neural-Swarm2: G. Shi, W. Hönig, X. Shi, Y. Yue, S.-J. Chung, IEEE T-RO 2021,
//! arXiv:2012.05457): the force on the lower one, in flights that nothing was fitted to.
//!
//! The recordings carry no licence and do not ship. They are looked for beside the workspace, or where `LEEWARD_RECORDINGS` points.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use airflow::{Air, Airframe, Jet, Superposition};
use diagnosis::baseline::Baseline;
use diagnosis::clock::{ClockKnown, ClockOffset};
use diagnosis::force_sums::ForceSums;
use diagnosis::held_out::{ForceSkill, ForceTest, clock_offsets, held_out_force};
use diagnosis::recording::{Clock, Environment, Known, Origin, Recording, Role, Track, Vehicle};
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use rayon::prelude::*;

/// Where the flights lie, or `None`, said aloud.
fn folder() -> Option<PathBuf> {
    let root = std::env::var_os("LEEWARD_RECORDINGS").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/recordings"),
        PathBuf::from,
    );
    let folder = root.join("neural_swarm2/flights");
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no Neural-Swarm2 flights at {}", folder.display());
    None
}

/// The two kinds of drone, as the source's controller states them; propeller diameters inferred.
fn airframe(id: &str) -> Airframe {
    let large = ["cf100", "cf101", "cf102"].contains(&id);
    let (name, mass_kg, diameter_m, motor_distance_m) = match large {
        true => ("large", 0.067, 0.066, 0.120),
        false => ("small", 0.034, 0.0462, 0.092),
    };
    Airframe::new(name, mass_kg, 4, diameter_m, motor_distance_m, 1.0).expect("valid")
}

const COLUMNS: [&str; 16] = [
    "t_s", "x_m", "y_m", "z_m", "ax_mps2", "ay_mps2", "az_mps2", "qx", "qy", "qz", "qw", "pwm1",
    "pwm2", "pwm3", "pwm4", "vbat_v",
];

fn read(path: &Path) -> Recording {
    let mut text = String::new();
    let file = File::open(path).expect("readable");
    flate2::read::GzDecoder::new(file)
        .read_to_string(&mut text)
        .expect("gzip of text");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let place = |name: &str| {
        header
            .iter()
            .position(|column| *column == name)
            .expect("a known column")
    };
    let places = COLUMNS.map(place);
    let of_vehicle = place("vehicle");
    let mut tracks: Vec<(String, Track)> = Vec::new();
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        let [
            t_s,
            x,
            y,
            z,
            ax,
            ay,
            az,
            qx,
            qy,
            qz,
            qw,
            duty @ ..,
            battery_v,
        ] = places.map(|place| fields[place].parse::<f64>().expect("a number"));
        let id = fields[of_vehicle];
        let track = match tracks.iter().position(|(known, _)| known == id) {
            Some(known) => &mut tracks[known].1,
            None => {
                let track = Track {
                    specific_force_mps2: Some(Vec::new()),
                    duty: Some(Vec::new()),
                    battery_v: Some(Vec::new()),
                    longest_step_s: 0.05,
                    ..Track::default()
                };
                tracks.push((id.to_owned(), track));
                &mut tracks.last_mut().expect("just pushed").1
            }
        };
        track.t_s.push(t_s);
        track.position_m.push(Point3::new(x, y, z));
        track.velocity_mps.push(Vector3::zeros());
        track
            .attitude
            .push(UnitQuaternion::from_quaternion(Quaternion::new(
                qw, qx, qy, qz,
            )));
        track
            .specific_force_mps2
            .get_or_insert_default()
            .push(Vector3::new(ax, ay, az));
        track.duty.get_or_insert_default().push(duty);
        track.battery_v.get_or_insert_default().push(battery_v);
    }
    tracks.sort_by(|a, b| a.0.cmp(&b.0));
    let vehicle = |(id, track): (String, Track)| Vehicle {
        airframe: airframe(&id),
        known: Known {
            mass: Origin::Stated,
            propeller_diameter: Origin::Inferred,
            motor_distance: Origin::Stated,
        },
        role: Role::Both,
        track,
        thrust_map: None,
        clock: Clock::Own { within_s: 0.04 },
        id,
    };
    let name = path.file_name().expect("a file").to_string_lossy();
    Recording {
        name: name.trim_end_matches(".csv.gz").to_owned(),
        environment: Environment {
            gravity_mps2: 9.81,
            air: Air {
                temperature_c: 20.0,
                pressure_pa: 101_325.0,
            },
            floor_z_m: Some(0.0),
            ceiling_z_m: None,
            ambient_mps: 0.0,
            ambient_is_subtracted: false,
        },
        vehicles: tracks.into_iter().map(vehicle).collect(),
        probes: None,
        receivers: Vec::new(),
        baseline: Baseline::default(),
        jet: Jet::default(),
        remarks: Vec::new(),
    }
}

fn flights(folder: &Path) -> Vec<Recording> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    paths.par_iter().map(|path| read(path)).collect()
}

/// The source says not to use the force of its older unit.
fn test() -> ForceTest {
    ForceTest {
        except: vec!["cf100".to_owned()],
        ..ForceTest::default()
    }
}

/// The figures are printed with `--nocapture`.
#[test]
fn force_below_another_drone_is_predicted_in_flights_that_nothing_was_fitted_to() {
    let Some(folder) = folder() else {
        return;
    };
    let mut recordings = flights(&folder);
    let test = test();
    let momentum = held_out_force(&recordings, &[], &test).expect("ninety flights");
    tell("momentum sum", &momentum);
    for collection in ["19", "20", "21", "22", "23"] {
        let mut sums = ForceSums::default();
        let flights = momentum.by_recording.iter();
        for flight in flights.filter(|flight| flight.name.starts_with(collection)) {
            sums += flight.sums;
        }
        eprintln!(
            "  collection {collection}: {:.3}, {:.3}; force over simulated {:.2}",
            sums.r2_disc_mean(),
            sums.r2_centre(),
            sums.disc_mean.slope()
        );
    }

    let clocks = clock_offsets(&recordings, &momentum, &test);
    let told = clocks
        .iter()
        .flatten()
        .filter(|clock| clock.known == ClockKnown::Told)
        .count();
    let offsets = |clocks: &Vec<ClockOffset>| clocks.iter().map(|clock| clock.offset_s).collect();
    let clocks_s: Vec<Vec<f64>> = clocks.iter().map(offsets).collect();
    let shifted = held_out_force(&recordings, &clocks_s, &test).expect("ninety flights");
    tell(&format!("clocks shifted, {told} told"), &shifted);

    for recording in &mut recordings {
        recording.baseline.superposition = Superposition::Linear;
    }
    let linear = held_out_force(&recordings, &[], &test).expect("ninety flights");
    tell("linear sum", &linear);

    // What the planner's air is worth in flight, as the project states it.
    assert!(momentum.r2_disc_mean >= 0.65);
    // Averaging over the discs, and adding momentum rather than speed, are each worth more than any number fitted.
    assert!(momentum.r2_disc_mean > momentum.r2_centre);
    assert!(momentum.r2_disc_mean > linear.r2_disc_mean);
}

fn tell(what: &str, skill: &ForceSkill) {
    eprintln!(
        "held-out R² of the vertical force, {what}, {} rows of {} flights: disc mean {:.3}, centre {:.3}",
        skill.rows, skill.flights, skill.r2_disc_mean, skill.r2_centre
    );
}
