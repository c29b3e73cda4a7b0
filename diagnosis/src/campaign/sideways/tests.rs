//! Flights in which the force sideways is known: each effect alone is named, two at once are, and
//! where there is none nothing is.

use airflow::{Air, Airframe, Jet};
use nalgebra::{Point3, UnitQuaternion};

use super::*;
use crate::record::baseline::Baseline;
use crate::record::recording::{Clock, Environment, Role, Track, Vehicle};
use crate::statistics::draws::Draws;

const G: f64 = 9.81;
const STEP_S: f64 = 0.05;
const ROWS: usize = 2400;

/// What acts sideways on the drone (m/s²), of its velocity, heading, time and flight.
type Acts = fn(Vector2<f64>, Vector2<f64>, f64, usize) -> Vector2<f64>;

/// Two minutes of one drone that flies to and fro and turns, with noise that remembers half a
/// second. `hung`: a payload of so much of its mass, and the frequency (rad/s) of its cord.
fn flight(index: usize, seed: u64, acts: Acts, hung: (f64, f64)) -> Recording {
    let mut draws = Draws::new(seed * 100 + index as u64);
    let airframe = Airframe::preset("crazyflie-2.1-deck").expect("known");
    let mass_kg = airframe.mass_kg();
    let phase = 6.0 * draws.uniform();
    let mut track = Track {
        longest_step_s: 0.2,
        attitude_is_logged: true,
        ..Track::default()
    };
    let (mut thrust_n, mut felt) = (Vec::new(), Vec::new());
    let (mut noise, mut pull, mut slope) = (Vector2::zeros(), Vector2::zeros(), Vector2::zeros());
    for row in 0..ROWS {
        let t_s = STEP_S * row as f64;
        let wave = |radps: f64, of: f64| (radps * t_s + of + phase).sin();
        let velocity = Vector2::new(0.8 * wave(0.9, 0.0), 0.6 * wave(1.3, 1.0));
        let lean = Vector2::new(
            0.06 * wave(0.9, 0.4) + 0.03 * wave(2.9, 0.0),
            0.05 * wave(1.3, 2.0) + 0.03 * wave(3.7, 0.5),
        );
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.11 * t_s + phase);
        let tilt = UnitQuaternion::from_euler_angles(-lean.y, lean.x, 0.0);
        let attitude = tilt * yaw;
        let axis = attitude * Vector3::z();
        let heading = (attitude * Vector3::x()).xy().normalize();
        let push = Vector2::new(draws.normal(), draws.normal());
        noise = noise * 0.9 + push * (0.08 * (1.0_f64 - 0.81).sqrt());
        let force = acts(velocity, heading, t_s, index) + pull * hung.0 + noise;
        let thrust_mps2 = G / axis.z * (1.0 + 0.05 * wave(0.7, 3.0));
        let felt_mps2 = axis * thrust_mps2 + Vector3::new(force.x, force.y, 0.01 * draws.normal());
        for _ in 0..10 {
            let swings = -(felt_mps2.xy() + pull) * (hung.1 * hung.1) - slope * (0.06 * hung.1);
            slope += swings * (STEP_S / 10.0);
            pull += slope * (STEP_S / 10.0);
        }
        track.t_s.push(t_s);
        track.position_m.push(Point3::new(0.0, 0.0, 1.5));
        track.velocity_mps.push(velocity.push(0.0));
        track.attitude.push(attitude);
        thrust_n.push(thrust_mps2 * mass_kg);
        felt.push(felt_mps2);
    }
    track.thrust_n = Some(thrust_n);
    track.specific_force_mps2 = Some(felt);
    Recording {
        name: format!("flight {index}"),
        environment: Environment {
            gravity_mps2: G,
            air: Air::default(),
            floor_z_m: None,
            ceiling_z_m: None,
            ambient_mps: 0.0,
            ambient_is_subtracted: false,
        },
        vehicles: vec![Vehicle {
            id: "a".to_owned(),
            airframe,
            role: Role::Both,
            track,
            thrust_map: None,
            clock: Clock::Shared,
        }],
        probes: None,
        receivers: Vec::new(),
        baseline: Baseline::default(),
        jet: Jet::default(),
        remarks: Vec::new(),
    }
}

fn told(seed: u64, acts: Acts, hung: (f64, f64)) -> SidewaysFinding {
    let flights: Vec<Recording> = (0..4)
        .map(|index| flight(index, seed, acts, hung))
        .collect();
    diagnose_sideways(&flights, &CampaignOptions::default()).expect("enough flight")
}

fn names(found: &SidewaysFinding) -> Vec<&str> {
    let mut names: Vec<&str> = found.effects.iter().map(|of| of.name.as_str()).collect();
    names.sort_unstable();
    names
}

const NOTHING: Acts = |_, _, _, _| Vector2::new(0.0, 0.0);

#[test]
fn where_nothing_acts_sideways_nothing_is_named() {
    // `SIDEWAYS_NULLS` asks for another number.
    let asked = std::env::var("SIDEWAYS_NULLS").ok();
    let seeds = asked.and_then(|typed| typed.parse().ok()).unwrap_or(4);
    for seed in 0..seeds {
        let found = told(seed, NOTHING, (0.0, 1.0));
        assert!(found.effects.is_empty(), "seed {seed}: {:?}", found.effects);
        assert!(found.rms_after_mps2 == found.rms_before_mps2);
    }
}

#[test]
fn each_effect_sideways_is_named_with_its_size() {
    let drag: Acts = |velocity, _, _, _| velocity * -0.3;
    let wind: Acts = |_, _, _, flight| Vector2::new(0.1, -0.05 * flight as f64);
    let turning: Acts = |_, _, t_s, _| {
        let (sine, cosine) = (t_s * std::f64::consts::TAU / 80.0).sin_cos();
        Vector2::new(cosine, sine) * 0.15
    };
    let misaligned: Acts = |_, heading, _, _| heading * (0.02 * G);
    let both: Acts = |velocity, heading, _, _| heading * (0.02 * G) - velocity * 0.3;
    for (acts, hung, named, parameter, is) in [
        (drag, (0.0, 1.0), &["rotor_drag"][..], 0, 0.3),
        (wind, (0.0, 1.0), &["wind"], 0, 0.1),
        (turning, (0.0, 1.0), &["wind_turning"], 0, 0.15),
        (misaligned, (0.0, 1.0), &["thrust_misalignment"], 0, 0.02),
        // A fifth of the drone is a sixth of both.
        (NOTHING, (0.2, 2.9), &["swinging_payload"], 0, 1.0 / 6.0),
        (
            both,
            (0.0, 1.0),
            &["rotor_drag", "thrust_misalignment"],
            0,
            0.3,
        ),
    ] {
        let found = told(3, acts, hung);
        assert_eq!(names(&found), named, "{:?}", found.effects);
        assert!(found.rms_after_mps2 < found.rms_before_mps2);
        let first = found
            .effects
            .iter()
            .find(|of| of.name == named[0])
            .expect("named");
        let got = first.parameters[parameter].value;
        // The low-pass and the grid leave a tenth.
        assert!(
            (got - is).abs() < 0.1 * is + 0.01,
            "{named:?}: {got}, not {is}"
        );
    }
}

#[test]
fn what_lies_between_the_points_of_a_grid_is_found() {
    let turning: Acts = |velocity, _, t_s, _| {
        let (sine, cosine) = (t_s * std::f64::consts::TAU / 90.0).sin_cos();
        Vector2::new(cosine, sine) * 0.3 - velocity * 0.3
    };
    let found = told(7, turning, (0.0, 1.0));
    assert_eq!(names(&found), ["rotor_drag", "wind_turning"]);
    let [drag, wind] = &found.effects[..] else {
        panic!("two: {found:?}");
    };
    assert!((drag.parameters[0].value - 0.3).abs() < 0.01, "{drag:?}");
    let turns = wind.parameters.last().expect("told").value;
    assert!(
        (turns * 90.0 / std::f64::consts::TAU - 1.0).abs() < 0.02,
        "{turns}"
    );
    let found = told(8, NOTHING, (0.2, 3.4));
    assert_eq!(names(&found), [SWING]);
    // With a fifth of the drone on its cord.
    let omega = found.effects[0].parameters[1].value;
    assert!(
        (omega / (3.4 * 1.2_f64.sqrt()) - 1.0).abs() < 0.01,
        "{omega}"
    );
}

#[test]
fn an_attitude_that_is_logged_late_is_a_lag_and_no_payload() {
    let flights = (0..4).map(|index| {
        let mut flight = flight(index, 5, NOTHING, (0.0, 1.0));
        let attitude = &mut flight.vehicles[0].track.attitude;
        attitude.pop();
        attitude.insert(0, attitude[0]);
        flight
    });
    let flights: Vec<Recording> = flights.collect();
    let found = diagnose_sideways(&flights, &CampaignOptions::default()).expect("enough flight");
    // A slope is all of a short lag, and nearly all of one of 50 ms: the rest looks like a gain.
    let named = names(&found);
    assert!(
        named.iter().all(|of| of.starts_with("sensor_")),
        "{named:?}"
    );
    let lag = found
        .effects
        .iter()
        .find(|of| of.name == "sensor_lag")
        .expect("named");
    let lag = &lag.parameters[0];
    assert!((lag.value - STEP_S).abs() < 0.01, "{lag:?}");
}

#[test]
fn what_follows_the_motion_far_below_its_own_frequency_is_no_swing() {
    // A wall on one side pushes where the drone is near, at the pace of its own motion.
    let wall: Acts =
        |velocity, _, _, _| Vector2::new(0.5 * (-(velocity.x - 0.6).powi(2) / 0.1).exp(), 0.0);
    let found = told(6, wall, (0.0, 1.0));
    let swings =
        |of: &&SidewaysEffect| of.name == SWING || of.alternatives.iter().any(|of| of == SWING);
    assert!(
        !found.effects.iter().any(|of| swings(&of)),
        "{:?}",
        found.effects
    );
}

#[test]
fn what_remains_beyond_noise_is_told_with_its_size() {
    let found = told(7, NOTHING, (0.0, 1.0));
    assert!(found.rms_after_mps2 < 1.4 * found.noise_mps2, "{found:?}");
    // Half a minute of a gust in each flight, which nothing here has.
    let gust: Acts = |_, _, t_s, flight| {
        let at_s = t_s - 20.0 - 25.0 * flight as f64;
        Vector2::new(0.6 * (-(at_s / 10.0).powi(2)).exp(), 0.0)
    };
    let found = told(7, gust, (0.0, 1.0));
    assert!(found.rms_after_mps2 > 1.5 * found.noise_mps2, "{found:?}");
}

#[test]
fn a_flight_without_an_attitude_says_so() {
    let mut flights: Vec<Recording> = (0..4)
        .map(|index| flight(index, 1, NOTHING, (0.0, 1.0)))
        .collect();
    for flight in &mut flights {
        flight.vehicles[0].track.attitude_is_logged = false;
    }
    let error = diagnose_sideways(&flights, &CampaignOptions::default()).expect_err("none");
    assert!(
        error
            .to_string()
            .contains("`a` of flight 0 lacks an attitude (qx qy qz qw"),
        "{error}"
    );
}
