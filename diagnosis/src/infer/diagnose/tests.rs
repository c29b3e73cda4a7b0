//! What is put into the simulation of a recording is what is said of it, in figures that agree.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use airflow::Superposition;
use airflow::effects::{Crossflow, Effects, NearFieldShape};
use nalgebra::Vector3;

use super::*;
use crate::forward::hypothesis::Sensor;
use crate::forward::simulate::{Sample, simulate};
use crate::infer::advice::narrowing;
use crate::infer::finding::Verdict;
use crate::infer::finding_file::{finding_ron, read_finding};
use crate::infer::outside::EXPECTED_READING;
use crate::record::baseline::Delay;
use crate::record::read::read_folder;
use crate::record::recording::{ProbeSample, ReceiverSample, Role};
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

/// The draughty hall with other readings.
fn read_as(seed: u64, reads_mps: impl Fn(&Sample, &mut Draws) -> f64) -> Recording {
    read_of(hall(), seed, reads_mps)
}

/// Other readings: what is made of each simulated sample, with the instrument's scatter (5 cm/s,
/// and 5 % of the speed) and resolution.
fn read_of(
    mut recording: Recording,
    seed: u64,
    reads_mps: impl Fn(&Sample, &mut Draws) -> f64,
) -> Recording {
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

#[test]
fn a_ceiling_is_named_unless_readings_lie_above_it() {
    for exceeds in [false, true] {
        let mut recording = read_as(8, |of, _| of.simulated);
        let random = &mut Draws::new(9);
        let simulated = simulate(&recording).samples;
        let fastest = simulated.iter().map(|of| of.simulated);
        let top_mps = 0.7 * fastest.fold(0.0, f64::max);
        let probes = recording.probes.as_mut().expect("it has probes");
        let mut at_ceiling = 0;
        for of in &simulated {
            let mps = of.simulated * (1.0 + 0.003 * random.normal()) + 0.005 * random.normal();
            at_ceiling += u32::from(mps > top_mps);
            // One in ten readings that a ceiling would cut is not.
            let is_cut = !exceeds || at_ceiling % 10 != 0;
            let mps = if is_cut { mps.min(top_mps) } else { mps };
            probes.samples[of.row].speed_mps = mps.max(0.0);
        }
        let found = diagnose(&recording).expect("it can be compared");
        let is_named = found
            .effects
            .iter()
            .any(|of| of.name == "sensor_saturation");
        assert_eq!(is_named, !exceeds, "{:?}", found.effects);
    }
}

/// The same hall with another drone beside its own.
fn doubled() -> Recording {
    let mut recording = hall();
    let mut second = recording.vehicles[0].clone();
    second.id = "second".to_owned();
    let places = second.track.position_m.iter_mut();
    places.for_each(|place| place.x += 0.16);
    recording.vehicles.push(second);
    recording
}

/// A drone that hovers, and one that passes below it with a throttle that follows the air as it
/// should, its readings taken so much too late (s).
fn passing(seed: u64, late_s: f64) -> Recording {
    let mut recording = hall();
    recording.probes = None;
    let emitter = &mut recording.vehicles[0];
    let hover_m = emitter.track.position_m[0];
    emitter.track.position_m.fill(hover_m);
    emitter.track.velocity_mps.fill(Vector3::zeros());
    let mut receiver = emitter.clone();
    receiver.id = "low".to_owned();
    receiver.role = Role::Receiver;
    (receiver.track.throttle_ratio, receiver.track.power_w) = (None, None);
    let x_m = |t_s: f64| 1.5 * (TAU * t_s / 40.0).sin();
    for (i, &t_s) in receiver.track.t_s.iter().enumerate() {
        receiver.track.position_m[i] = hover_m + Vector3::new(x_m(t_s), 0.1, -1.5);
        receiver.track.velocity_mps[i] = Vector3::x() * (x_m(t_s + 0.5) - x_m(t_s - 0.5));
    }
    let last_s = *receiver.track.t_s.last().expect("it flies");
    recording.vehicles.push(receiver);
    let reading = |i: u32| ReceiverSample {
        t_s: 1.0 + 0.25 * f64::from(i),
        vehicle: 1,
        throttle_ratio: 1.0,
        battery_v: None,
    };
    let readings = (0..).map(reading).take_while(|of| of.t_s < last_s - 2.0);
    recording.receivers = readings.collect();
    let mut shifted = recording.clone();
    let rows = shifted.receivers.iter_mut();
    rows.for_each(|row| row.t_s += late_s);
    let random = &mut Draws::new(seed);
    for of in simulate(&shifted).samples {
        recording.receivers[of.row].throttle_ratio = of.simulated + 0.01 * random.normal();
    }
    recording
}

/// The hall with a drone that sweeps to and fro above the probe.
pub(crate) fn sweeping() -> Recording {
    let mut sweeping = hall();
    let track = &mut sweeping.vehicles[0].track;
    for (i, &t_s) in track.t_s.iter().enumerate() {
        let phase = TAU * t_s / 8.3;
        track.position_m[i].x += 0.6 * phase.sin();
        track.velocity_mps[i].x += 0.6 * TAU / 8.3 * phase.cos();
    }
    sweeping
}

fn named(found: &Finding) -> Vec<&str> {
    found.effects.iter().map(|of| of.name.as_str()).collect()
}

#[test]
fn what_a_recording_declares_is_neutral_and_what_the_air_did_instead_is_named() {
    let plain = |of: &Sample, _: &mut Draws| of.simulated;
    let declared = [Superposition::Momentum, Superposition::Linear];
    for (k, declared) in (0..).zip(declared) {
        let mut recording = doubled();
        recording.baseline.superposition = declared;
        let found = diagnose(&read_of(recording.clone(), 10 + k, plain)).expect("comparable");
        assert_eq!(
            found.verdict,
            Verdict::None,
            "{declared}: {:?}",
            found.effects
        );
        let merges = found.detectable.iter().find(|of| of.name == "jet_merging");
        assert!(merges.is_some_and(|of| of.departure.is_finite()));
        let mut read = read_of(recording, 10 + k, plain);
        let others = [Superposition::Linear, Superposition::Momentum];
        read.baseline.superposition = others[k as usize];
        let found = diagnose(&read).expect("comparable");
        assert_eq!(named(&found), ["jet_merging"], "as {declared}");
        let q = &found.effects[0].parameters["q"];
        assert!((q.value - [2.0, 1.0][k as usize]).abs() < 0.1, "{q:?}");
    }
    let mut read = read_of(sweeping(), 12, plain);
    read.baseline.delay = Delay::Transport { convection: 1.0 };
    let found = diagnose(&read).expect("comparable");
    assert_eq!(named(&found), ["wake_transport"], "{found:#?}");
    let m = &found.effects[0].parameters["m"];
    assert!(m.value < 0.1 && !m.at_bound, "{m:?}");
}

#[test]
fn a_clock_that_is_off_is_named_where_the_receiver_alone_moves() {
    let found = diagnose(&passing(13, 0.6)).expect("comparable");
    assert_eq!(named(&found), ["clock_misalignment"]);
    let dt = &found.effects[0].parameters["dt"];
    assert!((dt.value - 0.6).abs() < 0.1, "{dt:?}");
    let found = diagnose(&passing(14, 0.0)).expect("comparable");
    assert_eq!(found.verdict, Verdict::None, "{:?}", found.effects);
}

#[test]
fn an_instrument_that_cannot_be_told_from_the_air_is_named_first() {
    // Half of the jet, and all of the still air around it: a gain of a half but for the latter.
    let ambient_mps = hall().environment.ambient_mps;
    let weak = |of: &Sample, _: &mut Draws| ambient_mps.hypot(0.5 * of.air_mps);
    let found = diagnose(&read_as(15, weak)).expect("comparable");
    let [effect] = &found.effects[..] else {
        panic!("{:?}", found.effects);
    };
    assert_eq!(effect.kind, Some(Kind::Sensor));
    assert!(effect.alternatives.contains(&"momentum_scale".to_owned()));
    let gain = |name: &str| {
        found
            .candidates
            .iter()
            .find(|of| of.name == name)
            .map(|of| of.gain)
    };
    assert!(gain("momentum_scale") > gain("sensor_gain"));
}

#[test]
fn the_scale_of_an_instrument_is_told_only_where_it_beats_every_effect() {
    let mut recording = doubled();
    recording.baseline.superposition = Superposition::Strongest;
    let mut read = read_of(recording, 16, |of, _| of.simulated);
    read.baseline.superposition = Superposition::Linear;
    let found = diagnose(&read).expect("comparable");
    // The strongest jet alone is no exponent within the range.
    let best = &found.candidates[0];
    assert!(best.name == "jet_merging" && best.at_bound, "{best:?}");
    let on = found.shape.iter().flat_map(|shape| &shape.depends_on);
    let on: Vec<&str> = on.map(|(name, _)| name.as_str()).collect();
    assert!(!on.contains(&EXPECTED_READING), "{on:?}");
    // What any function of the covariates takes from what is left is told all the same.
    assert!(found.remains.gain_error > 0.0, "{:?}", found.remains);
}

/// The hall with a second probe beside the first.
fn two_probes() -> Recording {
    let mut recording = hall();
    let probes = recording.probes.as_mut().expect("it has probes");
    let mut second = probes.samples.clone();
    for sample in &mut second {
        sample.probe_id = 1;
        sample.position_m.x += 0.1;
    }
    probes.samples.extend(second);
    recording
}

#[test]
fn what_is_of_one_of_several_probes_is_told_by_its_number() {
    let recording = two_probes();
    let observed = Observed::of(&recording, None).expect("it has readings");
    let own = |i: &usize| observed.samples[*i].subject == 1;
    let of_one: Vec<usize> = (0..observed.samples.len()).filter(own).collect();
    let weight = |i: usize| if own(&i) { 1.0 } else { 0.05 };
    let all: Vec<usize> = (0..observed.samples.len()).collect();
    assert_eq!(one_probe(&observed, &all, weight), Some(1));
    assert_eq!(one_probe(&observed, &all, |_| 1.0), None);
    let (words, ends) = bounds(&observed, &of_one);
    assert!(words == "probe 1" && ends.is_empty(), "{words}");
    let (words, _) = bounds(&observed, &of_one[..of_one.len() / 3]);
    assert!(
        words.starts_with("probe 1, ") && words.contains("time s"),
        "{words}"
    );
}

#[test]
fn probes_that_are_off_each_within_its_tolerance_are_no_mismatch() {
    // The maker allows 5 % and 3 cm/s.
    let off = |of: &Sample, _: &mut Draws| match of.subject {
        1 => 0.96 * of.simulated - 0.02,
        _ => 1.04 * of.simulated + 0.02,
    };
    let found = diagnose(&read_of(two_probes(), 5, off)).expect("it can be compared");
    assert_eq!(found.verdict, Verdict::None, "{:?}", found.effects);
    assert_eq!(found.held_out.instruments, 2);
}

#[test]
fn a_gain_of_one_of_several_probes_is_its_own_and_that_of_all_is_not() {
    let one = |of: &Sample, _: &mut Draws| match of.subject {
        1 => 1.3 * of.simulated,
        _ => of.simulated,
    };
    let found = diagnose(&read_of(two_probes(), 6, one)).expect("it can be compared");
    let [effect] = &found.effects[..] else {
        panic!("{:?}", found.effects);
    };
    assert_eq!(effect.label(), "sensor_gain of probe 1");
    let gain = &effect.parameters["g"];
    assert!(gain.low <= 0.3 && 0.3 <= gain.high, "{gain:?}");
    // It is not applied to other recordings, and said to be that probe's.
    let file = read_finding(&finding_ron(&found)).expect("a finding");
    assert_eq!(file.correction.sensor, Sensor::default());
    assert_eq!(file.of_one_probe, [("sensor_gain".to_owned(), 1)]);
    assert!(file.names.is_empty());

    let all = |of: &Sample, _: &mut Draws| 1.3 * of.simulated;
    let found = diagnose(&read_of(two_probes(), 6, all)).expect("it can be compared");
    let labels = found.effects.iter().map(Effect::label);
    assert_eq!(labels.collect::<Vec<String>>(), ["sensor_gain"]);
}

#[test]
fn no_sweep_of_time_or_azimuth_is_advised_and_probes_are_swapped() {
    let shape = |names: &[(&str, f64)]| Shape {
        depends_on: names
            .iter()
            .map(|(n, share)| ((*n).to_owned(), *share))
            .collect(),
        curve: vec![(0.0, 0.0), (1.0, 1.0)],
        expression: None,
        expression_share: 0.0,
        nearest: None,
        period_s: None,
        spans_s: Vec::new(),
        is_predictable: true,
        part: 0.5,
        correction: Vec::new(),
        left: Vec::new(),
        tolerance: vec![[0.0; 2]],
    };
    let first = |names: &[(&str, f64)]| narrowing(&shape(names)).swap_remove(0);
    assert!(first(&[("time s", 0.5), ("probe", 0.4)]).contains("one another's places"));
    assert!(first(&[("xi", 0.9), ("probe", 0.1)]).contains("sweep of xi"));
    for name in ["time s", "cos az", EXPECTED_READING] {
        assert!(!first(&[(name, 1.0)]).contains("sweep"), "{name}");
    }
    let mut of_one_place = shape(&[("xi", 1.0)]);
    of_one_place.curve = vec![(0.801, 0.0), (0.803, 1.0)];
    assert!(!narrowing(&of_one_place)[0].contains("sweep"));
}

#[test]
fn a_region_has_bounds_where_it_is_a_part_and_is_everywhere_where_it_is_not() {
    let recording = hall();
    let observed = Observed::of(&recording, None).expect("it has readings");
    let count = observed.samples.len();
    let place = |inside: Vec<usize>| bounds(&observed, &inside);
    let (words, ends) = place((0..count - count / 20).collect());
    assert!(words == "everywhere" && ends.is_empty(), "{words}");
    let (words, ends) = place((0..count).step_by(2).collect());
    assert!(words.starts_with("scattered") && ends.is_empty(), "{words}");
    let (words, _) = place((0..count / 3).collect());
    assert!(words.contains("time s"), "{words}");
}

#[test]
fn a_channel_that_cannot_be_compared_is_named_with_what_it_lacks() {
    let mut recording = hall();
    let asked = |recording: &Recording, channel| {
        let error = diagnose_channel(recording, channel).expect_err("there is none");
        error.to_string()
    };
    let error = asked(&recording, Some(Channel::Power));
    assert!(
        error.contains("no power, for receiver.csv is missing"),
        "{error}"
    );
    recording.probes = None;
    let error = asked(&recording, Some(Channel::Speed));
    assert!(
        error.contains("no speed, for probes.csv is missing"),
        "{error}"
    );
    assert!(!error.contains("throttle"), "{error}");
}

#[test]
fn what_settles_a_fault_of_a_receiver_needs_no_probe() {
    let recording = passing(18, 0.0);
    let observed = Observed::of(&recording, None).expect("it has readings");
    let candidates = applicable(&observed);
    let faults = candidates.iter().filter(|of| of.kind == Kind::Sensor);
    let settled_by: Vec<&str> = faults.map(|of| of.settled_by).collect();
    assert!(!settled_by.is_empty());
    assert!(
        settled_by
            .iter()
            .all(|line| !line.contains("the probe") && !line.contains("second"))
    );
}

#[test]
fn a_payload_that_throttle_alone_tells_and_a_term_cancels_is_withdrawn_with_it() {
    let mut recording = read_as(19, |of, _| of.simulated);
    let track = &mut recording.vehicles[0].track;
    track.power_w = None;
    let throttle = track.throttle_ratio.as_mut().expect("it is logged");
    throttle.iter_mut().for_each(|ratio| *ratio *= 1.2);
    let found = diagnose(&recording).expect("comparable");
    assert_eq!(named(&found), [""; 0]);
    let withdrawn = found.withdrawn.expect("it was named");
    assert_eq!(withdrawn.effects[0].name, "payload_mass");
    assert!(withdrawn.effects.len() > 1, "{withdrawn:?}");
    assert_eq!(found.correction, Hypothesis::default());
}

#[test]
fn a_receivers_load_that_its_power_tells_stands_beside_the_fault_of_an_instrument() {
    let mut recording = passing(20, 0.0);
    let root: f64 = 1.2_f64.sqrt();
    for row in &mut recording.receivers {
        row.throttle_ratio *= root;
    }
    let found = diagnose(&recording).expect("comparable");
    assert!(
        found.effects[0].name.starts_with("sensor_"),
        "{:?}",
        named(&found)
    );
    assert!(
        !found.effects[0]
            .alternatives
            .contains(&"payload_mass".to_owned())
    );
    let [emitter, receiver] = &mut recording.vehicles[..] else {
        panic!("an emitter and a receiver");
    };
    // As the emitter's, for another mass.
    let times = |column: &Option<Vec<f64>>, factor: f64| {
        let column = column.as_ref().expect("it is logged").iter();
        Some(column.map(|value| value * factor).collect())
    };
    receiver.track.throttle_ratio = times(&emitter.track.throttle_ratio, root);
    receiver.track.power_w = times(&emitter.track.power_w, root.powi(3));
    let found = diagnose(&recording).expect("comparable");
    assert!(
        found.effects[0].name.starts_with("sensor_"),
        "{:?}",
        named(&found)
    );
    assert!(
        found.effects[0]
            .alternatives
            .contains(&"payload_mass".to_owned())
    );
    assert!(found.advice.iter().any(|line| line.contains("scale")));
}

#[test]
fn what_is_too_small_to_matter_is_named_all_the_same_and_told_to_be() {
    let mut recording = hall();
    let mut hypothesis = Hypothesis::default();
    let spec = airflow::effects::EffectSpec::named("crossflow").expect("it is a row");
    spec.set(&mut hypothesis.effects, &[0.05, 0.0]);
    let observed = Observed::of(&recording, None).expect("it has probes");
    let rows: Vec<usize> = observed.samples.iter().map(|of| of.row).collect();
    let read = observed.predict(&hypothesis);
    drop(observed);
    let random = &mut Draws::new(31);
    let probes = recording.probes.as_mut().expect("it has probes");
    for (row, mps) in rows.into_iter().zip(read) {
        let mps = mps * (1.0 + 0.01 * random.normal()) + 0.005 * random.normal();
        probes.samples[row].speed_mps = (100.0 * mps.max(0.0)).round() / 100.0;
    }
    let found = diagnose(&recording).expect("it can be compared");
    let effects: Vec<_> = found
        .effects
        .iter()
        .map(|of| (&*of.name, of.too_small))
        .collect();
    assert_eq!(effects, [("crossflow", true)]);
    assert_ne!(found.verdict, Verdict::OutsideLibrary);
}

#[test]
fn a_shape_lies_on_the_gain_and_the_offset_that_it_was_fitted_beside() {
    // A ring, which no law of the library has.
    let is_there = |of: &Sample| of.place.is_some_and(|of| (0.4..1.0).contains(&of.xi));
    let recording = read_as(33, |of, _| {
        of.simulated * if is_there(of) { 1.5 } else { 1.0 }
    });
    let found = diagnose(&recording).expect("it can be compared");
    assert_eq!(
        found.verdict,
        Verdict::OutsideLibrary,
        "{:?}",
        found.effects
    );
    let [gain, offset] = found.held_out.tolerance_after;
    assert!(gain.abs() > 0.01 || offset.abs() > 0.01, "{gain} {offset}");
    let samples = simulate(&recording).samples;
    let left = samples
        .iter()
        .map(|of| of.recorded - found.prediction[of.row]);
    let left = root_mean_square(&left.collect::<Vec<f64>>());
    assert!((left - found.held_out.rms_after).abs() < 1e-6, "{left}");
}

#[test]
fn a_region_is_told_by_what_tells_it_from_the_rest() {
    let marked: Vec<bool> = (0..100).map(|i| i < 50).collect();
    let of = |in_box: fn(usize) -> bool| ((0..100).map(in_box).collect(), String::new());
    // A narrow coordinate of which the region has no more than the rest; what tells; what tells
    // half of the rest.
    let boxes = [
        of(|i| i % 10 == 0),
        of(|i| i < 60),
        of(|i| i < 55 || i % 2 == 0),
    ];
    assert_eq!(telling(&boxes, &marked), [1, 2]);
}

/// The draughty hall with the drone half as high above its probe, which reads the jet with these
/// effects.
fn close(seed: u64, effects: Effects) -> Recording {
    let mut recording = hall();
    let places = recording.vehicles[0].track.position_m.iter_mut();
    places.for_each(|place| place.z = 3.0 + 0.5 * (place.z - 3.0));
    let reads_mps = through(&recording, effects);
    read_of(recording, seed, |of, _| reads_mps[&of.row])
}

/// What its readings would be through a jet with these effects, by row.
fn through(recording: &Recording, effects: Effects) -> BTreeMap<usize, f64> {
    let observed = Observed::of(recording, None).expect("it has readings");
    let missing = Hypothesis {
        effects,
        ..Hypothesis::default()
    };
    let reads = observed.predict(&missing);
    let rows = observed.samples.iter().map(|of| of.row);
    rows.zip(reads).collect()
}

/// The draughty hall with a rake of five probes in place of its one, which read the jet with these
/// effects in gusts of 15 % of the speed and 4 s of memory that meet all five at once.
fn rake_in_gusts(seed: u64, effects: Effects) -> Recording {
    let mut recording = hall();
    let probes = recording.probes.as_mut().expect("it has probes");
    let single = std::mem::take(&mut probes.samples);
    for probe_id in 0..5 {
        let beside_m = Vector3::x() * (0.3 * f64::from(probe_id) - 0.6);
        let own = single.iter().map(|sample| ProbeSample {
            probe_id,
            position_m: sample.position_m + beside_m,
            ..*sample
        });
        probes.samples.extend(own);
    }
    // A reading a second.
    let random = &mut Draws::new(seed);
    let kept = (-1.0f64 / 4.0).exp();
    let mut gust = random.normal();
    let gusts: Vec<f64> = (0..=single.last().map_or(0, |last| last.t_s as usize))
        .map(|_| {
            gust = kept * gust + (1.0 - kept * kept).sqrt() * random.normal();
            gust
        })
        .collect();
    let reads_mps = through(&recording, effects);
    read_of(recording, seed, |of, _| {
        reads_mps[&of.row] * (1.0 + 0.15 * gusts[of.t_s as usize])
    })
}

#[test]
fn gusts_that_meet_all_probes_of_a_rake_are_no_mismatch() {
    for seed in 50..54 {
        let found = diagnose(&rake_in_gusts(seed, Effects::default())).expect("comparable");
        assert_eq!(found.verdict, Verdict::None, "{seed}: {:?}", found.shape);
    }
}

#[test]
fn a_wind_is_named_in_gusts_that_meet_all_probes_of_a_rake() {
    let wind = Effects {
        crossflow: Some(Crossflow {
            wind_mps: [0.25, 0.1],
        }),
        ..Effects::default()
    };
    let found = diagnose(&rake_in_gusts(54, wind)).expect("comparable");
    assert_eq!(named(&found), ["crossflow"], "{:?}", found.shape);
}

/// A body whose shadow reaches as deep as the near field.
fn deep_shadow() -> Effects {
    Effects {
        near_field: Some(NearFieldShape {
            share: 1.0,
            shadow: 0.8,
            shadow_depth_over_l: 2.0,
        }),
        ..Effects::default()
    }
}

#[test]
fn how_deep_a_body_shades_its_jet_is_found_and_leaves_nothing_outside_the_library() {
    let found = diagnose(&close(11, deep_shadow())).expect("it can be compared");
    assert_eq!(named(&found), ["near_field"], "{:?}", found.shape);
    let depth = &found.effects[0].parameters["s_b"];
    assert!((depth.low..=depth.high).contains(&2.0), "{depth:?}");
    let [off, usual] = [2.0, 0.7].map(|depth_over_l: f64| (depth.value - depth_over_l).abs());
    assert!(off < usual, "{depth:?}");
}

#[test]
fn a_faint_wind_is_named_beside_a_near_field_for_what_it_does_further_down() {
    let wind = Effects {
        crossflow: Some(Crossflow {
            wind_mps: [0.12, 0.05],
        }),
        ..deep_shadow()
    };
    let found = diagnose(&close(12, wind)).expect("it can be compared");
    let mut names = named(&found);
    names.sort_unstable();
    assert_eq!(names, ["crossflow", "near_field"], "{:?}", found.runner_up);
}
