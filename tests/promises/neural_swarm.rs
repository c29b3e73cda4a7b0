//! Flights of small drones over one another (Neural-Swarm2: G. Shi, W. Hönig, X. Shi, Y. Yue, S.-J. Chung, IEEE T-RO 2021,
//! arXiv:2012.05457): the force on the lower one, in flights that nothing was fitted to.
//!
//! The recordings carry no licence and do not ship. They are looked for beside the workspace, or where `LEEWARD_RECORDINGS` points.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use airflow::{Air, Airframe, Jet, Superposition};
use diagnosis::baseline::Baseline;
use diagnosis::held_out::{ForceSkill, ForceTest, Share, held_out_force};
use diagnosis::identify::{Lag, Options};
use diagnosis::recording::{Clock, Environment, Known, Origin, Recording, Role, Track, Vehicle};
use diagnosis::thrust_map::{OFFSET, Term, ThrustMap};
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

#[test]
fn force_below_another_drone_is_predicted_in_flights_that_nothing_was_fitted_to() {
    let Some(folder) = folder() else {
        return;
    };
    let recordings = flights(&folder);
    let skill = held_out_force(&recordings, &[], &test()).expect("ninety flights");
    eprintln!(
        "held-out R² of the vertical force, {} rows of {} flights: disc mean {:.3}, centre {:.3}",
        skill.rows, skill.flights, skill.r2_disc_mean, skill.r2_centre
    );
    assert!(skill.r2_disc_mean >= 0.65);
    assert!(skill.r2_disc_mean > skill.r2_centre);
    if std::env::var_os("LEEWARD_TABLE").is_some() {
        table(recordings);
    }
}

fn table(mut recordings: Vec<Recording>) {
    let line = |what: &str, recordings: &[Recording], test: &ForceTest| {
        let start = std::time::Instant::now();
        let s = held_out_force(recordings, &[], test).unwrap();
        eprintln!(
            "{what:40} {:6} {:3} disc {:.3} centre {:.3} | folds {:?} | {:.2} s",
            s.rows,
            s.flights,
            s.r2_disc_mean,
            s.r2_centre,
            s.folds
                .iter()
                .map(|f| (f.sums.r2_disc_mean() * 1000.0).round() / 1000.0)
                .collect::<Vec<_>>(),
            start.elapsed().as_secs_f64()
        );
        s
    };
    let published = |large: bool| {
        let g = 9.80665e-3;
        let c = if large {
            [
                44.10386631845999,
                -122.51151800146272,
                -36.18484254283743,
                53.10772568607133,
                107.6819263349139,
            ]
        } else {
            [
                11.093358483549203,
                -39.08104165843915,
                -9.525647587583181,
                20.573302305476638,
                38.42885066644033,
            ]
        };
        ThrustMap::new(
            diagnosis::thrust_map::QUADRATIC.to_vec(),
            c.iter().map(|c| c * g).collect(),
            4.2,
            0.0402,
            [0.122, 0.96],
        )
        .unwrap()
    };
    for sup in [Superposition::Momentum, Superposition::Linear] {
        for r in &mut recordings {
            r.baseline.superposition = sup;
        }
        eprintln!("{sup}");
        let s = line("identified", &recordings, &test());
        for (g, m) in &s.folds[0].maps {
            eprintln!(
                "  {g} {:?} se {:?} lag se {:?} scatter {:.2} g battery {:.3}/V rows {} outside {} range {:?} V {:?}",
                m.map
                    .terms()
                    .map(|(t, c)| (t.duty_power, t.battery_power, c))
                    .collect::<Vec<_>>(),
                m.standard_errors_n,
                m.lag_standard_error_s,
                m.scatter_n / 0.00981,
                m.battery_per_v,
                m.rows,
                m.rows_outside,
                m.map.duty_range(),
                m.battery_range_v
            );
            eprintln!("  lag {}", m.map.lag_s());
        }
        for c in ["19", "20", "21", "22", "23"] {
            let mut t = diagnosis::held_out::ForceSums::default();
            for r in s.by_recording.iter().filter(|r| r.name.starts_with(c)) {
                t += r.sums;
            }
            eprintln!(
                "  collection {c}: rows {} outside {} disc {:.3} centre {:.3} slope {:.3} bias {:.2} g",
                t.rows,
                t.rows_outside,
                t.r2_disc_mean(),
                t.r2_centre(),
                t.disc_mean.slope(),
                t.disc_mean.left_n / t.rows as f64 / 0.00981
            );
        }
        line(
            "one a vehicle",
            &recordings,
            &ForceTest {
                share: Share::Nobody,
                ..test()
            },
        );
        line(
            "lag as published",
            &recordings,
            &ForceTest {
                identify: Options {
                    lag: Lag::Fixed(0.0402),
                    ..Options::default()
                },
                ..test()
            },
        );
        let mut terms = diagnosis::thrust_map::CUBIC_FROM_ZERO.to_vec();
        terms.push(Term::new(0, 0));
        line(
            "with a constant",
            &recordings,
            &ForceTest {
                identify: Options {
                    terms,
                    ..Options::default()
                },
                ..test()
            },
        );
        line(
            "quadratic",
            &recordings,
            &ForceTest {
                identify: Options {
                    terms: diagnosis::thrust_map::QUADRATIC.to_vec(),
                    ..Options::default()
                },
                ..test()
            },
        );
        line(
            "quadratic, lag published",
            &recordings,
            &ForceTest {
                identify: Options {
                    terms: diagnosis::thrust_map::QUADRATIC.to_vec(),
                    lag: Lag::Fixed(0.0402),
                    ..Options::default()
                },
                ..test()
            },
        );
        for (name, keep) in [("large", true), ("small", false)] {
            let except: Vec<String> = ["cf100", "cf101", "cf102", "cf50", "cf51", "cf52"]
                .iter()
                .filter(|id| (airframe(id).name() == "large") != keep || **id == "cf100")
                .map(|s| s.to_string())
                .collect();
            for (what, lag) in [
                ("published+offset", Lag::Fixed(0.0402)),
                ("published+offset, lag found", Lag::UpTo(0.15)),
            ] {
                line(
                    &format!("{name} {what}"),
                    &recordings,
                    &ForceTest {
                        except: except.clone(),
                        identify: Options {
                            terms: OFFSET.to_vec(),
                            base: Some(published(keep)),
                            lag,
                            ..Options::default()
                        },
                        ..test()
                    },
                );
            }
            line(
                &format!("{name} identified"),
                &recordings,
                &ForceTest { except, ..test() },
            );
        }
        line("2 folds", &recordings, &ForceTest { folds: 2, ..test() });
        line(
            "10 folds",
            &recordings,
            &ForceTest {
                folds: 10,
                ..test()
            },
        );
    }
}
