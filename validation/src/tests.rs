use std::collections::{BTreeMap, BTreeSet};

use super::*;
use crate::folder::texts;
use diagnosis::forward::simulate::simulate;
use diagnosis::record::read::read_folder;

/// One case of every family without an injected effect, and as many others.
const EVERY_NULL: usize = 55;

fn unblinded(seed: u64, index: usize) -> (Recording, Truth) {
    let Case { recording, truth } = case(Half::Shown, seed, index);
    (recording, truth.unblind(&Answer::nothing()))
}

fn recorded(recording: &Recording) -> Vec<f64> {
    match &recording.probes {
        Some(probes) => probes
            .samples
            .iter()
            .map(|sample| sample.speed_mps)
            .collect(),
        None => recording
            .receivers
            .iter()
            .map(|sample| sample.throttle_ratio)
            .collect(),
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn the_declared_simulation_is_the_one_that_the_diagnosis_makes() {
    let worst = (0..EVERY_NULL).into_par_iter().map(|index| {
        let (recording, truth) = unblinded(3, index);
        let samples = simulate(&recording).samples;
        let of = |row: usize| truth.baseline_clean[row];
        // Rows whose drone is known; nearly all.
        assert!(
            samples.len() as f64 > 0.99 * truth.baseline_clean.len() as f64,
            "{}",
            truth.family
        );
        let squares = samples
            .iter()
            .map(|sample| ((sample.simulated - of(sample.row)) / truth.noise[sample.row]).powi(2));
        (mean(squares).sqrt(), truth.family)
    });
    for (off, family) in worst.collect::<Vec<_>>() {
        // The tracker's 1.5 mm, and 0.1 to 0.25 s between rows of a track, at gradients of up to 60
        // /s: below a third of the noise.
        assert!(off < 0.33, "{family}: {off}");
    }
}

#[test]
fn recordings_without_an_injected_effect_differ_from_the_simulation_by_noise_and_calibration() {
    let nulls = (0..EVERY_NULL).filter(|index| index % 5 == 0 || index % 5 == 2);
    for index in nulls {
        let (recording, truth) = unblinded(4, index);
        assert_eq!(truth.label(), "none");
        assert!(truth.region.is_empty());
        // What an oracle sees beside gain and offset within their accuracy: less than one
        // deviation.
        assert!(
            truth.oracle_chi2 < 1.0,
            "{}: {}",
            truth.family,
            truth.oracle_chi2
        );
        let rows: Vec<usize> = (0..truth.noise.len()).collect();
        let away = |row: &usize| {
            let allowed = 0.05 * truth.truth_clean[*row] + 0.03;
            let off = (recorded(&recording)[*row] - truth.truth_clean[*row]).abs();
            (off - allowed).max(0.0) / truth.noise[*row]
        };
        // Less than noise of deviation 1 beside what the calibration may be off.
        let rows: Vec<usize> = rows.into_iter().step_by(7).collect();
        assert!(
            mean(rows.iter().map(|row| away(row).powi(2))) < 1.3,
            "{}",
            truth.family
        );
    }
}

#[test]
fn an_injected_effect_is_there_and_has_names() {
    let mut families = BTreeSet::new();
    // Every second turn is of listed families.
    let count = 10 * injecting_families().div_ceil(INJECTING_A_TURN);
    let cases: Vec<(Recording, Truth)> = (0..count)
        .into_par_iter()
        .map(|index| unblinded(5, index))
        .collect();
    for (recording, truth) in cases.iter().filter(|(_, truth)| !truth.effects.is_empty()) {
        let (family, _size) = truth
            .family
            .rsplit_once('_')
            .expect("its size, or its flight, is behind it");
        if !truth.family.starts_with("drawn") {
            families.insert(family.to_owned());
        }
        let is_masked = truth.family.starts_with("masked_payload_gain");
        // Each that can be seen at all is seen somewhere; a payload and a gain that cancel are seen
        // in the throttle alone.
        if truth.oracle_chi2 >= DETECTABLE_CHI2 && !is_masked {
            assert!(!truth.region.is_empty(), "{}", truth.family);
        }
        for effect in &truth.effects {
            assert_eq!(
                effect.accepted.is_empty(),
                truth.is_outside,
                "{}",
                truth.family
            );
            if !truth.is_outside {
                assert_eq!(effect.accepted[0], effect.name);
            }
        }
        assert!(
            truth
                .truth_clean
                .iter()
                .chain(&recorded(recording))
                .all(|value| value.is_finite())
        );
        if truth.family.starts_with("rare") {
            let share = truth.region.len() as f64 / truth.noise.len() as f64;
            assert!(share < 0.08, "{}: {share}", truth.family);
        }
    }
    assert_eq!(families.len(), injecting_families());
}

#[test]
fn the_texts_of_a_recording_read_back_as_the_recording() {
    // A grid, a pair, a receiver: nulls and others.
    for index in [0, 1, 2, 4, 10] {
        let (recording, truth) = unblinded(6, index);
        let files: BTreeMap<String, Vec<u8>> = texts(&recording)
            .into_iter()
            .map(|(name, text)| (name.to_owned(), text.into_bytes()))
            .collect();
        let read = read_folder(&recording.name, &files).expect("what is written can be read");
        assert_eq!(read.baseline, recording.baseline, "{}", truth.family);
        let pairs = recorded(&read).into_iter().zip(recorded(&recording));
        // Steps of the reading: what is written has all its digits.
        assert!(
            pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-9),
            "{}",
            truth.family
        );
        for (a, b) in read.vehicles.iter().zip(&recording.vehicles) {
            assert_eq!(
                a.track.throttle_ratio, b.track.throttle_ratio,
                "{}",
                truth.family
            );
            assert_eq!(a.track.power_w, b.track.power_w, "{}", truth.family);
            let apart = a.track.position_m.iter().zip(&b.track.position_m);
            assert!(apart.into_iter().all(|(a, b)| (a - b).norm() < 1e-9));
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let texts_of = |seed| texts(&case(Half::Shown, seed, 1).recording);
    assert_eq!(texts_of(7), texts_of(7));
    assert_ne!(texts_of(7), texts_of(8));
    let metrics = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a pool of a few threads")
            .install(|| prove(Half::Shown, 7, 10, |_| Answer::nothing()))
    };
    assert_eq!(metrics(1), metrics(3));
}

#[test]
fn who_answers_nothing_is_marked_so() {
    let metrics = prove(Half::Shown, 9, 30, |_| Answer::nothing());
    assert_eq!(
        (metrics.false_alarms.hits, metrics.false_alarms.of),
        (0, 12)
    );
    assert_eq!((metrics.detected.hits, metrics.named.hits), (0, 0));
    assert_eq!(metrics.skill_median, Some(0.0));
    assert!(metrics.confusion["none"]["none"] == 12);
}

#[test]
fn three_times_round_every_family_has_met_every_size() {
    let turns = injecting_families(); // three a turn
    let met: BTreeSet<(&str, Size)> = (0..5 * turns)
        .map(kind)
        .filter(|(family, _)| !family.is_null())
        .map(|(family, size)| (family.name, size))
        .collect();
    assert_eq!(met.len(), 3 * injecting_families());
}
