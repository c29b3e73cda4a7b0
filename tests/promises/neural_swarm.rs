//! Flights of small drones over one another (Neural-Swarm2: G. Shi, W. Hönig, X. Shi, Y. Yue, S.-J.
//! Chung, IEEE T-RO 2021, arXiv:2012.05457): the force on the lower one, in flights that nothing
//! was fitted to.
//!
//! The recordings carry no licence and do not ship. They are looked for beside the project, or
//! where `LEEWARD_RECORDINGS` points when the tests are built.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use airflow::Superposition;
use diagnosis::forward::clock::{ClockKnown, ClockOffset};
use diagnosis::forward::held_out::{ForceSkill, ForceTest, clock_offsets, held_out_force};
use diagnosis::record::read::{Campaign, read_log};
use diagnosis::record::recording::Recording;
use rayon::prelude::*;

fn read(path: &Path, campaign: &Campaign) -> Recording {
    let mut text = Vec::new();
    let file = File::open(path).expect("readable");
    flate2::read::GzDecoder::new(file)
        .read_to_end(&mut text)
        .expect("gzip");
    let file = path.file_name().expect("a file").to_string_lossy();
    let name = file.trim_end_matches(".csv.gz");
    read_log(name, &file, text.as_slice(), campaign).expect("a flight of this campaign")
}

fn flights(folder: &Path) -> Vec<Recording> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    let meta = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings/neural_swarm2.ron");
    let text = std::fs::read_to_string(meta).expect("it ships");
    let campaign = Campaign::parse("neural_swarm2.ron", &text).expect("in order");
    paths.par_iter().map(|path| read(path, &campaign)).collect()
}

/// The figures are printed with `--nocapture`.
#[test]
#[cfg_attr(
    not(shared_recordings = "neural_swarm2"),
    ignore = "no recordings of neural_swarm2 beside the project"
)]
fn force_below_another_drone_is_predicted_in_flights_that_nothing_was_fitted_to() {
    let folder = super::shared("neural_swarm2").join("flights");
    let mut recordings = flights(&folder);
    let test = ForceTest::default();
    let momentum = held_out_force(&recordings, &[], &test).expect("ninety flights");
    tell("momentum sum", &momentum);
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
    // Averaging over the discs, and adding momentum rather than speed, are each worth more than any
    // number fitted.
    assert!(momentum.r2_disc_mean > momentum.r2_centre);
    assert!(momentum.r2_disc_mean > linear.r2_disc_mean);
}

fn tell(what: &str, skill: &ForceSkill) {
    eprintln!(
        "held-out R² of the vertical force, {what}, {} rows of {} flights: disc mean {:.3}, centre {:.3}",
        skill.rows, skill.flights, skill.r2_disc_mean, skill.r2_centre
    );
}
