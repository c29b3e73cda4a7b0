//! What is put into the simulation of a recording is what is said of it, in figures that agree.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::*;
use crate::forward::simulate::{Sample, simulate};
use crate::infer::finding::Verdict;
use crate::record::read::read_folder;
use crate::record::remark::RemarkKind;
use crate::statistics::draws::Draws;

/// The draughty hall, as it ships.
pub(crate) fn hall() -> Recording {
    let files = [
        (
            "meta.json",
            &include_bytes!("../../../../recordings/draughty-hall/meta.json")[..],
        ),
        (
            "probes.csv",
            include_bytes!("../../../../recordings/draughty-hall/probes.csv"),
        ),
        (
            "vehicles.csv",
            include_bytes!("../../../../recordings/draughty-hall/vehicles.csv"),
        ),
    ];
    let files: BTreeMap<String, Vec<u8>> = files
        .map(|(name, bytes)| (name.to_owned(), bytes.to_vec()))
        .into();
    read_folder("hall", &files).expect("it ships")
}

/// The draughty hall with other readings: what is made of each simulated sample, with the
/// instrument's scatter (5 cm/s, and 5 % of the speed) and resolution.
fn read_as(seed: u64, reads_mps: impl Fn(&Sample, &mut Draws) -> f64) -> Recording {
    let mut recording = hall();
    let random = &mut Draws::new(seed);
    let simulated = simulate(&recording).samples;
    let probes = recording.probes.as_mut().expect("it has probes");
    for sample in &mut probes.samples {
        sample.speed_mps = f64::NAN;
    }
    for sample in &simulated {
        let mps = reads_mps(sample, random);
        let mps = if mps == 0.0 {
            0.0
        } else {
            mps + random.normal() * (0.05 + 0.05 * mps.abs())
        };
        probes.samples[sample.row].speed_mps = (100.0 * mps.max(0.0)).round() / 100.0;
    }
    recording
}

/// What that scatter comes to over these samples.
fn scatter_mps(recording: &Recording) -> f64 {
    let samples = simulate(recording).samples;
    let sds: Vec<f64> = samples
        .iter()
        .map(|of| 0.05 + 0.05 * of.simulated)
        .collect();
    root_mean_square(&sds)
}

#[test]
fn a_probe_that_is_dead_for_a_while_is_named_and_its_readings_explain_nothing() {
    let recording = read_as(1, |of, _| match of.row {
        300..500 => 0.0,
        _ => of.simulated,
    });
    let left_out = simulate(&recording).left_out;
    let dead = left_out.iter().find(|of| of.kind == RemarkKind::Stuck);
    let dead = dead.unwrap_or_else(|| panic!("{left_out:?}"));
    assert!((190..=210).contains(&dead.samples), "{}", dead.message);
    assert!(dead.message.contains("dead"), "{}", dead.message);
    let found = diagnose(&recording).expect("enough is left");
    assert_eq!(found.verdict, Verdict::None);
}

#[test]
fn still_air_that_reads_0_is_no_dead_probe() {
    // A vane that does not turn below 0.5 m/s.
    let recording = read_as(2, |of, _| match of.simulated < 0.5 {
        true => 0.0,
        false => of.simulated,
    });
    assert!(simulate(&recording).left_out.is_empty());
}

#[test]
fn what_sets_in_part_way_or_pulsates_is_not_told_as_noise() {
    let midway = |of: &Sample, _: &mut Draws| match of.row < 480 {
        true => of.simulated,
        false => 0.5 * of.simulated,
    };
    let pulsating =
        |of: &Sample, _: &mut Draws| of.simulated * (1.0 + 0.6 * (TAU * of.t_s / 2.7).sin());
    for (what, recording) in [
        ("midway", read_as(3, midway)),
        ("pulsating", read_as(4, pulsating)),
    ] {
        let found = diagnose(&recording).expect("it can be compared");
        let HeldOut {
            rms_before,
            rms_after,
            noise_floor,
            ..
        } = found.held_out;
        assert!(rms_after < rms_before, "{what}: {:?}", found.held_out);
        assert!(noise_floor <= rms_after, "{what}: {:?}", found.held_out);
        // A pulsation on another clock than the air's is not followed to the end.
        let off = noise_floor / scatter_mps(&recording);
        let is_known = what == "pulsating" || (0.7..1.3).contains(&off);
        assert!(is_known, "{what}: {off}, {:?}", found.held_out);
    }
}

#[test]
fn what_is_switched_in_the_room_is_outside_the_library_and_its_period_told() {
    let switched = |of: &Sample, _: &mut Draws| {
        let is_on = (of.t_s / 41.0).fract() < 0.5;
        let more_mps = if is_on { 0.25 } else { -0.25 };
        of.simulated + if of.simulated > 0.3 { more_mps } else { 0.0 }
    };
    let found = diagnose(&read_as(7, switched)).expect("it can be compared");
    assert_eq!(found.verdict, Verdict::OutsideLibrary);
    let period_s = found.shape.and_then(|shape| shape.period_s);
    assert!(
        period_s.is_some_and(|s| (s - 41.0).abs() < 2.0),
        "{period_s:?}"
    );
}

#[test]
fn errors_in_stretches_are_told_from_single_wild_readings() {
    let cauchy = |random: &mut Draws| 0.1 * (random.within(1.5)).tan();
    let wild = read_as(5, |of, random| of.simulated + cauchy(random));
    assert!(!diagnose(&wild).expect("comparable").errors_follow);
    let stretches = read_as(6, |of, random| match (of.row / 40) % 5 {
        0 => of.simulated * (1.0 + random.within(0.8)),
        _ => of.simulated,
    });
    assert!(diagnose(&stretches).expect("comparable").errors_follow);
}

#[test]
fn a_ceiling_from_some_moment_on_has_its_level_from_then_on_and_keeps_its_moment() {
    let mut recording = read_as(8, |of, _| of.simulated);
    let random = &mut Draws::new(9);
    let simulated = simulate(&recording).samples;
    let fastest = simulated.iter().map(|of| of.simulated);
    let top_mps = (70.0 * fastest.fold(0.0, f64::max)).round() / 100.0;
    let half_s = 0.5 * recording.vehicles[0].track.t_s.last().expect("some");
    let probes = recording.probes.as_mut().expect("it has probes");
    // An instrument that scatters less than its ceiling takes away.
    for of in &simulated {
        let mps = of.simulated * (1.0 + 0.003 * random.normal()) + 0.005 * random.normal();
        let mps = (100.0 * mps.max(0.0)).round() / 100.0;
        let most_mps = if of.t_s < half_s { mps } else { top_mps };
        probes.samples[of.row].speed_mps = mps.min(most_mps);
    }
    let found = diagnose(&recording).expect("it can be compared");
    let mut effects = found.effects.iter();
    let effect = effects.find(|of| of.name == "sensor_saturation");
    let parameters = &effect.expect("it is named").parameters;
    let [t0, y_max] = ["t0", "y_max"].map(|name| &parameters[name]);
    // The next pass tells.
    assert!(
        (half_s..half_s + 40.0).contains(&t0.value),
        "{parameters:?}"
    );
    assert!((y_max.value - top_mps).abs() < 0.02, "{parameters:?}");
    assert_eq!((&*t0.unit, &*y_max.unit), ("s", "m/s"));
}
