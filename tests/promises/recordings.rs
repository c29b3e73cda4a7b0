//! Recordings of others are read as they lie: every flight, every table, nothing dropped in
//! silence.
//!
//! They are not part of this repository; where they are absent, these tests are ignored.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use diagnosis::record::read::{self, Campaign};
use diagnosis::record::recording::{Clock, Recording};
use diagnosis::record::remark::RemarkKind;
use rayon::prelude::*;

use super::shared;

fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.sort();
    paths
}

fn campaign(file: &str) -> Campaign {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("recordings")
        .join(file);
    Campaign::parse(file, &fs::read_to_string(path).unwrap()).unwrap()
}

/// Every flight of a campaign, as `plan` reads them.
fn flights(set: &str, campaign_file: &str) -> Vec<Recording> {
    let folder = shared(set).join("flights");
    let campaign = campaign(campaign_file);
    entries(&folder)
        .par_iter()
        .map(|path| {
            let packed = fs::read(path).unwrap();
            let mut bytes = Vec::new();
            flate2::read::MultiGzDecoder::new(packed.as_slice())
                .read_to_end(&mut bytes)
                .unwrap();
            let name = path.file_name().unwrap().to_str().unwrap();
            read::read_log(name, name, bytes.as_slice(), &campaign)
                .unwrap_or_else(|problems| panic!("{problems}"))
        })
        .collect()
}

fn seconds(recordings: &[Recording]) -> f64 {
    let of_vehicle = |t_s: &Vec<f64>| t_s.last().unwrap() - t_s[0];
    recordings
        .iter()
        .flat_map(|recording| &recording.vehicles)
        .map(|vehicle| of_vehicle(&vehicle.track.t_s))
        .sum()
}

#[test]
#[cfg_attr(
    not(shared_recordings = "neural_swarm2"),
    ignore = "no recordings of neural_swarm2 beside the project"
)]
fn every_flight_of_neural_swarm2_is_read_as_it_lies() {
    let recordings = flights("neural_swarm2", "neural_swarm2.ron");
    assert_eq!(recordings.len(), 90);
    // The set's own index states 90 flights; a vehicle is in the air for most of each.
    let hours = seconds(&recordings) / 3600.0;
    println!("{hours:.2} vehicle-hours between first and last row kept");
    let mut hover_mps2 = Vec::new();
    for recording in &recordings {
        for vehicle in &recording.vehicles {
            let track = &vehicle.track;
            assert!(track.t_s.is_sorted_by(|a, b| a < b), "{}", recording.name);
            assert!(track.duty.is_some() && track.battery_v.is_some());
            assert_eq!(track.specific_force_mps2.is_some(), vehicle.id != "cf100");
            assert_eq!(vehicle.clock, Clock::Own { within_s: 0.031 });
            let forces = track.specific_force_mps2.iter().flatten();
            hover_mps2.extend(forces.map(|force| force.z));
        }
    }
    // In the mean over hours a drone that stays in the room carries its weight: one gravity, within
    // the calibration of its IMU.
    let mean_mps2 = hover_mps2.iter().sum::<f64>() / hover_mps2.len() as f64;
    assert!((mean_mps2 - 9.81).abs() < 0.1, "{mean_mps2}");
    tell(&recordings);
}

#[test]
#[cfg_attr(
    not(shared_recordings = "crazypad"),
    ignore = "no recordings of crazypad beside the project"
)]
fn every_flight_of_crazypad_is_read_as_it_lies() {
    let recordings = flights("crazypad", "crazypad.ron");
    assert_eq!(recordings.len(), 48);
    for recording in &recordings {
        let [vehicle] = recording.vehicles.as_slice() else {
            panic!("one vehicle in {}", recording.name);
        };
        // What is not known is said.
        let said: Vec<&str> = recording
            .remarks
            .iter()
            .map(|remark| remark.message.as_str())
            .collect();
        assert!(said.contains(&"its mass is assumed: 0.027 kg"), "{said:?}");
        assert!(
            said.contains(&"pitch is not logged: taken as 0"),
            "{said:?}"
        );
        assert!(
            said.iter().any(|said| said.contains("cut: on the floor")),
            "{said:?}"
        );
        // Gravity was taken off in the log and is back on in the track. The estimate drifts less
        // than 3 % of it over a flight (chosen here, far below the factor between 0 and 1 that is
        // tested).
        let forces = vehicle.track.specific_force_mps2.as_ref().unwrap();
        let mean_mps2 = forces.iter().map(|force| force.z).sum::<f64>() / forces.len() as f64;
        assert!(
            (mean_mps2 - 9.81).abs() < 0.3,
            "{} {mean_mps2}",
            recording.name
        );
    }
    tell(&recordings);
}

#[test]
#[cfg_attr(
    not(shared_recordings = "concealed_practice"),
    ignore = "no recordings of concealed_practice beside the project"
)]
fn every_practice_folder_is_read_as_it_lies() {
    let folder = shared("concealed_practice");
    let folders: Vec<PathBuf> = entries(&folder)
        .into_iter()
        .filter(|path| path.join("meta.json").is_file())
        .collect();
    assert_eq!(folders.len(), 27);
    let recordings: Vec<Recording> = folders
        .iter()
        .map(|folder| {
            let files: BTreeMap<String, Vec<u8>> = entries(folder)
                .into_iter()
                .map(|path| {
                    let name = path.file_name().unwrap().to_str().unwrap().to_owned();
                    (name, fs::read(path).unwrap())
                })
                .collect();
            let name = folder.file_name().unwrap().to_str().unwrap();
            let recording = read::read_folder(name, &files)
                .unwrap_or_else(|problems| panic!("{name}: {problems}"));
            // Sample i is data row i, whatever was noticed.
            let rows = |file: &str| {
                let lines = files
                    .get(file)
                    .map(|bytes| bytes.iter().filter(|&&byte| byte == b'\n').count());
                lines.map_or(0, |lines| lines - 1)
            };
            let samples = recording
                .probes
                .as_ref()
                .map_or(0, |probes| probes.samples.len());
            assert_eq!(samples, rows("probes.csv"), "{name}");
            assert_eq!(recording.receivers.len(), rows("receiver.csv"), "{name}");
            recording
        })
        .collect();
    tell(&recordings);
}

/// Remarks counted by kind, and one of each: what a person would want to look at.
fn tell(recordings: &[Recording]) {
    let mut by_kind: BTreeMap<RemarkKind, (usize, String)> = BTreeMap::new();
    for recording in recordings {
        for remark in &recording.remarks {
            let entry = by_kind.entry(remark.kind).or_insert_with(|| {
                let subject = remark.subject.as_deref().unwrap_or("all");
                (
                    0,
                    format!("{}, {subject}: {}", recording.name, remark.message),
                )
            });
            entry.0 += 1;
        }
    }
    for (kind, (count, first)) in by_kind {
        println!("{count} remarks {kind:?}, the first: {first}");
    }
}
