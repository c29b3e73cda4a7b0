//! A hovering Offboard 2 over probes and over a Kolibri, against closed forms.

use airflow::{Air, Airframe, Jet, Superposition};
use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::*;
use crate::forward::hypothesis::Hypothesis;
use crate::forward::observed::{Explained, Observed};
use crate::record::baseline::{Baseline, Delay, Observation, ReceiverAir, Upper};
use crate::record::recording::{
    Clock, Environment, Instrument, Measures, ProbeSample, Probes, ReceiverSample, Role, Track,
    Vehicle,
};

const AMBIENT_MPS: f64 = 0.1;

/// Stands at a place, or flies along x at a speed, for 100 s at 10 Hz.
fn vehicle(id: &str, airframe: &str, role: Role, from_m: Point3<f64>, speed_mps: f64) -> Vehicle {
    let t_s: Vec<f64> = (0..=1000).map(|i| f64::from(i) * 0.1).collect();
    let at = |t_s: &f64| from_m + Vector3::new(speed_mps * t_s, 0.0, 0.0);
    Vehicle {
        id: id.into(),
        airframe: Airframe::preset(airframe).expect("a preset"),
        role,
        track: Track {
            position_m: t_s.iter().map(at).collect(),
            velocity_mps: vec![Vector3::x() * speed_mps; t_s.len()],
            attitude: vec![UnitQuaternion::identity(); t_s.len()],
            longest_step_s: 0.5,
            t_s,
            ..Track::default()
        },
        thrust_map: None,
        clock: Clock::Shared,
    }
}

fn recording(vehicles: Vec<Vehicle>, probes: Vec<ProbeSample>, tau_s: f64) -> Recording {
    Recording {
        name: "test".into(),
        environment: Environment {
            gravity_mps2: 9.81,
            air: Air::default(),
            floor_z_m: Some(0.0),
            ceiling_z_m: None,
            ambient_mps: AMBIENT_MPS,
            ambient_is_subtracted: false,
        },
        vehicles,
        probes: Some(Probes {
            instrument: Instrument {
                kind: "hot_ball".into(),
                measures: Measures::SpeedMagnitude,
                rate_hz: 1.0,
                lowpass_tau_s: tau_s,
                accuracy_abs_mps: 0.03,
                accuracy_rel: 0.05,
                resolution_mps: 0.01,
            },
            samples: probes,
        }),
        receivers: Vec::new(),
        baseline: Baseline {
            wakes: true,
            superposition: Superposition::Linear,
            delay: Delay::None,
            upper: Upper::FarFieldExtrapolated,
            receiver_air: ReceiverAir::Centre,
            receiver_law: ReceiverLaw::HoldsThrust { exponent: 0.5 },
            observation: Observation::AxialAndAmbient,
        },
        jet: Jet::default(),
        remarks: Vec::new(),
    }
}

fn probe(t_s: f64, x_m: f64, z_m: f64) -> ProbeSample {
    ProbeSample {
        t_s,
        probe_id: 0,
        position_m: Point3::new(x_m, 0.0, z_m),
        speed_mps: 0.0,
    }
}

/// The paper's jet of an Offboard 2, by hand.
fn axial_mps(s_m: f64, r_m: f64) -> f64 {
    let (l_m, a) = (0.266, 2.0_f64.sqrt() - 1.0);
    let sigma = s_m / l_m + 5.817;
    let xi = r_m / l_m / (0.07668 * sigma);
    let airframe = Airframe::preset("offboard-2").expect("a preset");
    let u_h_mps = airframe.hover_induced_velocity_mps(1.207, Air::default().density_kg_per_m3());
    u_h_mps * 10.11 / sigma / (1.0 + a * xi * xi).powi(2)
}

fn above(z_m: f64, speed_mps: f64) -> Vehicle {
    let from_m = Point3::new(0.0, 0.0, z_m);
    vehicle("v0", "offboard-2", Role::Emitter, from_m, speed_mps)
}

#[test]
fn a_probe_reads_the_axial_speed_and_the_ambient_as_the_baseline_declares() {
    // 2 m and 0.2 m below, the latter above 2.5 l, where this baseline extrapolates.
    let samples = vec![probe(5.0, 0.3, 1.0), probe(6.0, 0.1, 2.8)];
    let recording = recording(vec![above(3.0, 0.0)], samples, 0.0);
    let simulated = simulate(&recording);
    assert!(simulated.left_out.is_empty());
    for (sample, (s_m, r_m)) in simulated.samples.iter().zip([(2.0, 0.3), (0.2, 0.1)]) {
        let expected_mps = axial_mps(s_m, r_m).hypot(AMBIENT_MPS);
        assert!((sample.simulated - expected_mps).abs() < 1e-9, "{sample:?}");
        let place = sample.place.expect("below the drone");
        assert!((place.s_over_l - s_m / 0.266).abs() < 1e-9);
    }
}

#[test]
fn with_the_radial_flow_a_probe_at_three_half_widths_reads_five_percent_more() {
    // V/U at xi = 3 is 0.31, so the magnitude is 1.05 U.
    let (s_m, half_width_m) = (2.0, 0.07668 * (2.0 + 5.817 * 0.266));
    let sample = probe(5.0, 3.0 * half_width_m, 1.0);
    let mut recording = recording(vec![above(3.0, 0.0)], vec![sample], 0.0);
    recording.environment.ambient_mps = 0.0;
    recording.baseline.observation = Observation::VelocityAndAmbient;
    let reading_mps = simulate(&recording).samples[0].simulated;
    let ratio = reading_mps / axial_mps(s_m, 3.0 * half_width_m);
    assert!((ratio - 1.05).abs() < 0.005, "{ratio}");
}

#[test]
fn a_slow_probe_lags_a_passing_jet_and_reads_less_at_its_peak() {
    let pass = |tau_s| {
        let readings = (0..=100).map(|i| probe(f64::from(i), 25.0, 1.0)).collect();
        let samples = simulate(&recording(vec![above(3.0, 0.5)], readings, tau_s)).samples;
        let peak = samples
            .iter()
            .max_by(|a, b| a.simulated.total_cmp(&b.simulated));
        peak.map(|sample| (sample.t_s, sample.simulated))
            .expect("samples")
    };
    let ((at_s, peak_mps), (late_s, low_mps)) = (pass(0.0), pass(2.0));
    assert_eq!(at_s, 50.0, "right above after 25 m at 0.5 m/s");
    assert!(late_s > at_s && late_s <= at_s + 2.0, "{late_s}");
    assert!(low_mps < 0.9 * peak_mps, "{low_mps} of {peak_mps} m/s");
}

#[test]
fn a_slow_probe_reads_the_same_however_seldom_it_is_asked() {
    let readings = |every: usize| -> Vec<f64> {
        let rows = (0..=2000).step_by(every);
        let rows = rows.map(|i| probe(f64::from(i as u32) * 0.05, 25.0, 1.0));
        let recording = recording(vec![above(3.0, 0.5)], rows.collect(), 0.5);
        let samples = simulate(&recording).samples;
        samples.iter().map(|sample| sample.simulated).collect()
    };
    let often = readings(1);
    let peak_mps = often.iter().copied().fold(0.0, f64::max);
    // Every 5 s: ten time constants, of which eight are remembered.
    let seldom = readings(100).into_iter().zip(often.iter().step_by(100));
    for (seldom_mps, often_mps) in seldom {
        assert!((seldom_mps - often_mps).abs() < 0.01 * peak_mps);
    }
}

#[test]
fn with_transport_the_jet_of_a_passing_drone_arrives_later() {
    let passes = |delay| {
        let readings = (450..=550)
            .map(|i| probe(f64::from(i) * 0.1, 25.0, 1.0))
            .collect();
        let mut recording = recording(vec![above(3.0, 0.5)], readings, 0.0);
        recording.baseline.delay = delay;
        let samples = simulate(&recording).samples;
        let peak = samples
            .iter()
            .max_by(|a, b| a.simulated.total_cmp(&b.simulated));
        peak.map(|sample| sample.t_s).expect("samples")
    };
    // 2 m below an Offboard 2: (σ² - s₀²)/(2 B U_H) l = (13.336² - 5.817²)/(2 · 10.11 · 9.66) ·
    // 0.266 = 0.196 s
    let late_s = passes(Delay::Transport { convection: 1.0 }) - passes(Delay::None);
    assert!(
        (late_s - 0.2).abs() < 0.051,
        "{late_s} s, to the step of 0.1 s"
    );
}

#[test]
fn a_receiver_two_metres_below_holds_its_thrust_by_the_root_of_beta() {
    let below_m = Point3::new(0.0, 0.0, 1.0);
    let receiver = vehicle("recv", "kolibri", Role::Receiver, below_m, 0.0);
    let mut recording = recording(vec![above(3.0, 0.0), receiver], Vec::new(), 0.0);
    recording.receivers = vec![ReceiverSample {
        t_s: 5.0,
        vehicle: 1,
        throttle_ratio: 1.2,
        battery_v: None,
    }];
    let sample = simulate(&recording).samples[0];
    // Offboard 2 two metres above a Kolibri: 7.32 m/s of air, alpha 0.988, beta 1.610.
    assert!((sample.air_mps - 7.32).abs() < 0.01, "{}", sample.air_mps);
    assert!(
        (sample.simulated - 1.610_f64.sqrt()).abs() < 1e-3,
        "{}",
        sample.simulated
    );
}

#[test]
fn samples_in_a_gap_of_the_track_are_named_and_not_simulated() {
    let mut drone = above(3.0, 0.0);
    drone
        .track
        .t_s
        .iter_mut()
        .skip(500)
        .for_each(|t_s| *t_s += 10.0);
    let samples = (40..70).map(|t| probe(f64::from(t), 0.0, 1.0)).collect();
    let simulated = simulate(&recording(vec![drone], samples, 0.0));
    // The gap is from 49.9 s to 60.0 s.
    assert_eq!(simulated.samples.len(), 20);
    assert_eq!(simulated.left_out.len(), 1);
    assert_eq!(simulated.left_out[0].samples, 10);
    assert_eq!(simulated.left_out[0].span_s, Some((50.0, 59.0)));
}

#[test]
fn without_wakes_every_drone_flies_alone() {
    let mut recording = recording(vec![above(3.0, 0.0)], vec![probe(5.0, 0.0, 1.0)], 0.0);
    recording.baseline.wakes = false;
    assert_eq!(simulate(&recording).samples[0].simulated, AMBIENT_MPS);
}

#[test]
fn a_drone_with_idle_rotors_does_not_blow() {
    let mut drone = above(3.0, 0.0);
    drone.track.throttle_ratio = Some(vec![0.1; 1001]);
    let simulated = simulate(&recording(vec![drone], vec![probe(5.0, 0.0, 1.0)], 0.0));
    assert_eq!(simulated.samples[0].simulated, AMBIENT_MPS);
}

/// A sensor that is so much slower (s) than declared, and nothing else.
fn slow(lag_s: f64) -> Hypothesis {
    Hypothesis {
        sensor: Sensor {
            lag_s,
            ..Sensor::default()
        },
        ..Hypothesis::default()
    }
}

#[test]
fn a_thinned_recording_has_every_third_sample_of_each_probe_at_every_phase() {
    let sample = |probe_id: u32, i: u32| ProbeSample {
        t_s: f64::from(i) * 0.1,
        probe_id,
        position_m: Point3::new(0.1, 0.0, 3.0),
        speed_mps: 0.0,
    };
    let samples = (0..900).flat_map(|i| [sample(7, i), sample(9, i)]);
    let emitter = vehicle(
        "e",
        "offboard-2",
        Role::Emitter,
        Point3::new(-2.0, 0.0, 5.0),
        0.05,
    );
    let mut recording = recording(vec![emitter], samples.collect(), 0.0);
    // A slow sensor begins from what it reads.
    for sample in simulate(&recording).samples {
        let probes = recording.probes.as_mut().expect("it has two");
        probes.samples[sample.row].speed_mps = sample.simulated;
    }
    let whole = Observed::of(&recording, None).expect("it has readings");
    assert!(whole.thinned(1800).is_none(), "no more than that");
    let (thinned, every) = whole.thinned(600).expect("more than that");
    assert_eq!(every, 3);
    assert!((598..=602).contains(&thinned.samples.len()));
    let mut phases = [0; 3];
    for series in [0, 1] {
        let own = thinned.samples.iter().zip(&thinned.series_of);
        let own = own.filter(|(_, of)| **of == series);
        let places: Vec<usize> = own.map(|(sample, _)| sample.row / 2).collect();
        places.iter().for_each(|place| phases[place % 3] += 1);
        let even = places.windows(2).filter(|pair| pair[1] - pair[0] == 3);
        assert!(
            even.count() >= places.len() - 6,
            "nearly all steps are even"
        );
    }
    assert!(phases.iter().all(|count| *count > 60), "{phases:?}");
    // It is simulated as the whole is, whether or not it has looked for the drones, and through a
    // slow sensor.
    let mut looking = thinned.clone();
    looking.look();
    for lag_s in [0.0, 0.7] {
        let slow = slow(lag_s);
        let all = whole.predict(&slow);
        assert_eq!(thinned.predict(&slow), looking.predict(&slow));
        for (sample, own) in thinned.samples.iter().zip(thinned.predict(&slow)) {
            let at = whole.samples.iter().position(|of| of.row == sample.row);
            let other = all[at.expect("one of the whole")];
            assert!((own - other).abs() < 2e-3 * other, "{own} of {other}");
        }
    }
    // What is known at those is carried to the nearest.
    let known: Vec<f64> = thinned.samples.iter().map(|sample| sample.t_s).collect();
    let carried = whole.carried(&thinned, &known);
    for (sample, t_s) in whole.samples.iter().zip(carried) {
        assert!((sample.t_s - t_s).abs() < 0.41, "{} from {t_s}", sample.t_s);
    }
}

#[test]
fn a_slow_probe_begins_from_what_it_reads_and_lags_behind_its_declared_low_pass() {
    let sample = |i: u32| ProbeSample {
        t_s: f64::from(i) * 0.1,
        probe_id: 1,
        position_m: Point3::new(5.0, 0.0, 1.0),
        speed_mps: 2.0,
    };
    // Still air, and a reading that is left of a pass before the first sample.
    let recording = recording(vec![above(3.0, 0.0)], (0..60).map(sample).collect(), 0.5);
    let observed = Observed::of(&recording, None).expect("it has readings");
    for lag_s in [0.0, 1.2] {
        let slow = slow(lag_s);
        for (sample, read_mps) in observed.samples.iter().zip(observed.predict(&slow)) {
            // Both begin at what is read: ẋ₁ = -x₁/τ₁, ẋ₂ = (x₁ - x₂)/τ₂ over the ambient speed.
            let left = |tau_s: f64| (-sample.t_s / tau_s).exp();
            let left = match lag_s {
                0.0 => left(0.5),
                lag_s => (lag_s * left(lag_s) - 0.5 * left(0.5)) / (lag_s - 0.5),
            };
            let expected_mps = AMBIENT_MPS + (2.0 - AMBIENT_MPS) * left;
            // The low-pass is taken as linear within a step.
            assert!(
                (read_mps - expected_mps).abs() < 0.02,
                "{read_mps} of {expected_mps}"
            );
        }
    }
}

#[test]
fn below_a_drone_that_hovers_a_late_clock_moves_a_probe_and_below_one_that_flies_the_drone() {
    // The probe passes below at 0.2 m/s; its readings are of half a second later.
    let samples: Vec<ProbeSample> = (0..40)
        .map(|i| probe(5.0 + 0.1 * f64::from(i), 0.02 * f64::from(i) - 0.4, 1.0))
        .collect();
    let late = Hypothesis {
        sensor: Sensor {
            clock_s: 0.5,
            ..Sensor::default()
        },
        ..Hypothesis::default()
    };
    // Where it then is, and where the drone then is from it.
    for (speed_mps, later_m) in [(0.0, 0.1), (0.4, -0.2)] {
        let recording = recording(vec![above(3.0, speed_mps)], samples.clone(), 0.0);
        let observed = Observed::of(&recording, None).expect("probes");
        let read = observed.predict(&late);
        for (row, at) in samples.iter().enumerate().take(34) {
            let beside_m = at.position_m.x - speed_mps * at.t_s + later_m;
            let expected_mps = axial_mps(2.0, beside_m).hypot(AMBIENT_MPS);
            assert!((read[row] - expected_mps).abs() < 1e-9, "{speed_mps} {row}");
        }
    }
}
