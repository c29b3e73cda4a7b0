//! Receivers in synthetic flights, where everything is known: thrust map, lag, clock and force are
//! found again.

use airflow::{Air, Airframe, Jet, Wake, mean_over_discs_mps};
use diagnosis::forward::clock::{self, ClockKnown};
use diagnosis::forward::flow::Flow;
use diagnosis::forward::force;
use diagnosis::forward::held_out::{ForceTest, ForceTestError, clock_offsets, held_out_force};
use diagnosis::forward::simulate::Channel;
use diagnosis::record::baseline::{Baseline, ReceiverLaw};
use diagnosis::record::recording::{
    Clock, Environment, ReceiverSample, Recording, Role, Track, Vehicle,
};
use diagnosis::record::remark::RemarkKind;
use diagnosis::record::thrust_map::{CUBIC_FROM_ZERO, OFFSET, ThrustMap};
use diagnosis::record::track::ThrustSource;
use diagnosis::thrust::identify::{IdentifyError, Lag, Options, identify};
use diagnosis::thrust::low_pass::LowPass;
use nalgebra::{Point3, UnitQuaternion, Vector3};

const AIR: Air = Air {
    temperature_c: 20.0,
    pressure_pa: 101_325.0,
};

const LOW_PASS: LowPass = LowPass { cutoff_hz: 5.0 };

const LAG_S: f64 = 0.06;

fn airframe() -> Airframe {
    Airframe::preset("crazyflie-2.1-deck").unwrap()
}

/// About 0.33 N at duty 0.6 and 3.8 V: hover of 34 g.
fn truth() -> ThrustMap {
    let newtons = vec![0.05, 0.04, -0.1, 0.12, 0.1];
    ThrustMap::new(
        CUBIC_FROM_ZERO.into_iter().zip(newtons).collect(),
        4.2,
        LAG_S,
        [0.1, 0.9],
    )
    .unwrap()
}

/// Thrust (N) by that map and its lag, from duty cycles and battery voltage.
fn flown_n(track: &Track) -> Vec<f64> {
    let (duty, battery_v) = (track.duty.as_ref(), track.battery_v.as_ref());
    let rows = duty.unwrap().iter().zip(battery_v.unwrap());
    let mut thrust_n: Vec<f64> = rows.map(|(&duty, &v)| truth().steady_n(duty, v)).collect();
    for row in 1..thrust_n.len() {
        let step_s = track.t_s[row] - track.t_s[row - 1];
        let share = 1.0 - (-step_s / LAG_S).exp();
        thrust_n[row] = thrust_n[row - 1] + share * (thrust_n[row] - thrust_n[row - 1]);
    }
    thrust_n
}

/// Numbers between -1 and 1 that look like noise, the same in every run.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// 40 s at 50 Hz: duties that wander, a battery that sags, and at each moment the thrust that is
/// left under `air_mps`.
fn drone(
    id: &str,
    seed: u64,
    place: impl Fn(f64) -> Point3<f64>,
    air_mps: impl Fn(f64) -> f64,
) -> Vehicle {
    let airframe = airframe();
    let mut noise = Noise(seed);
    let mut track = Track {
        longest_step_s: 0.05,
        ..Track::default()
    };
    let (mut duties, mut batteries_v) = (Vec::new(), Vec::new());
    let phase = noise.next();
    for step in 0..2000 {
        let t_s = 0.02 * f64::from(step);
        track.t_s.push(t_s);
        track.position_m.push(place(t_s));
        track.velocity_mps.push(Vector3::zeros());
        track.attitude.push(UnitQuaternion::from_euler_angles(
            0.1 * (t_s + phase).sin(),
            0.05,
            1.0,
        ));
        let wander = 0.2 * (3.0 * t_s + phase).sin() + 0.15 * (7.7 * t_s + 2.0 * phase).sin();
        duties.push(
            [0.0, 0.02, -0.01, 0.03].map(|apart| 0.58 + wander + apart + 0.02 * noise.next()),
        );
        batteries_v.push(4.1 - 0.012 * t_s + 0.1 * phase - 0.3 * wander);
    }
    (track.duty, track.battery_v) = (Some(duties), Some(batteries_v));
    let hover_mps =
        airframe.hover_induced_velocity_mps(airframe.mass_kg(), AIR.density_kg_per_m3());
    let thrust_n = flown_n(&track);
    let felt = |(row, thrust_n): (usize, &f64)| {
        let alpha = air_mps(track.t_s[row]) / hover_mps;
        let left = airflow::power::thrust_ratio_at_constant_power(alpha);
        let body_axis = track.attitude[row] * Vector3::z();
        body_axis * (left * thrust_n / airframe.mass_kg()) + Vector3::repeat(0.3 * noise.next())
    };
    track.specific_force_mps2 = Some(thrust_n.iter().enumerate().map(felt).collect());
    Vehicle {
        id: id.to_owned(),
        airframe,
        role: Role::Both,
        track,
        thrust_map: None,
        clock: Clock::Own { within_s: 0.04 },
    }
}

fn recording(name: &str, vehicles: Vec<Vehicle>) -> Recording {
    Recording {
        name: name.to_owned(),
        environment: Environment {
            gravity_mps2: 9.81,
            air: AIR,
            floor_z_m: Some(0.0),
            ceiling_z_m: None,
            ambient_mps: 0.0,
            ambient_is_subtracted: false,
        },
        vehicles,
        probes: None,
        receivers: Vec::new(),
        baseline: Baseline::default(),
        jet: Jet::default(),
        remarks: Vec::new(),
    }
}

fn alone(seed: u64) -> Recording {
    recording(
        &format!("alone {seed}"),
        vec![drone("a", seed, |_| Point3::new(0.0, 0.0, 1.0), |_| 0.0)],
    )
}

/// Where the upper drone is: to and fro over the lower one, which stands at the origin, with two
/// speeds.
fn upper(t_s: f64) -> Point3<f64> {
    Point3::new(0.6 * (1.1 * t_s).sin() + 0.1 * (2.9 * t_s).sin(), 0.02, 1.5)
}

const LOWER: Point3<f64> = Point3::new(0.0, 0.0, 1.0);

/// A drone that stands below another; the upper one's clock is ahead by `clock_s`.
fn pair(seed: u64, clock_s: f64) -> Recording {
    let wake = Wake::new(
        &airframe(),
        airframe().mass_kg(),
        AIR.density_kg_per_m3(),
        &Jet::default(),
    );
    let discs = airframe().disc_points();
    let air_mps = |t_s: f64| {
        let source = airflow::Source {
            wake: &wake,
            position_m: upper(t_s),
            ends_at_z_m: 0.0,
        };
        mean_over_discs_mps(&[source], &discs, LOWER, airflow::Superposition::Momentum)
    };
    let lower = drone("a", seed, |_| LOWER, air_mps);
    let upper = drone("b", seed + 50, |t_s| upper(t_s - clock_s), |_| 0.0);
    recording(&format!("pair {seed}"), vec![lower, upper])
}

#[test]
fn the_thrust_map_of_made_up_flights_is_found_again() {
    let flights: Vec<Recording> = (1..=6).map(alone).collect();
    let all: Vec<(usize, usize)> = (0..6).map(|flight| (flight, 0)).collect();
    let found = identify(&flights, &all, &Options::default()).unwrap();
    assert_eq!((found.rows, found.flights), (12_000, 6));
    // The noise is uniform, 0.3 m/s² wide on 34 g: 5.9 mN of scatter, of which a 5 Hz low-pass
    // passed twice leaves less than half.
    assert!(found.scatter_n < 3e-3, "{} N", found.scatter_n);
    // Scatter over the root of some 2000 independent rows is 0.07 mN; five terms, and the ends of
    // the range, a few times that.
    for duty in [0.3, 0.6, 0.8] {
        for battery_v in [3.7, 4.0] {
            let apart_n =
                found.map.steady_n([duty; 4], battery_v) - truth().steady_n([duty; 4], battery_v);
            assert!(
                apart_n.abs() < 1e-3,
                "at {duty}, {battery_v} V: {apart_n} N"
            );
        }
    }
    let lag_error_s = found.lag_standard_error_s.unwrap();
    // Four standard errors, and what the parabola through a 10 ms grid leaves.
    assert!(
        (found.map.lag_s() - LAG_S).abs() < 4.0 * lag_error_s + 5e-4,
        "{} s",
        found.map.lag_s()
    );
    assert!(lag_error_s < 2e-3);
    assert_eq!(found.offset_n, 0.0);
    let [low, high] = found.map.duty_range();
    assert!(low > 0.1 && high < 1.0 && found.rows_outside > 0 && found.rows_outside < 480);
}

#[test]
fn a_published_map_gets_the_offset_that_it_lacks() {
    let flights: Vec<Recording> = (1..=3).map(alone).collect();
    let mut terms: Vec<_> = truth().terms().collect();
    terms.push((OFFSET[0], -0.004));
    let published = ThrustMap::new(terms, 4.2, LAG_S, [0.1, 0.9]).unwrap();
    let options = Options {
        terms: OFFSET.to_vec(),
        base: Some(published),
        lag: Lag::Fixed(LAG_S),
        ..Options::default()
    };
    let found = identify(&flights, &[(0, 0), (1, 0), (2, 0)], &options).unwrap();
    // Four motors; the scatter of some thousand independent rows.
    assert!(found.offset_n.abs() < 5e-4, "{} N", found.offset_n);
    assert_eq!(found.lag_standard_error_s, None);
}

#[test]
fn under_another_drone_nothing_is_identified() {
    let flights = [pair(1, 0.0)];
    let error = identify(&flights, &[(0, 0)], &Options::default()).unwrap_err();
    assert!(
        matches!(
            error,
            IdentifyError::TooFewRows { .. } | IdentifyError::Degenerate(_)
        ),
        "{error}"
    );
}

#[test]
fn the_force_of_a_flight_that_obeys_the_model_is_predicted_and_the_disc_mean_beats_the_centre() {
    let mut flights: Vec<Recording> = (1..=4).map(alone).collect();
    flights.extend((1..=4).map(|seed| pair(seed, 0.0)));
    let test = ForceTest {
        folds: 4,
        ..ForceTest::default()
    };
    let skill = held_out_force(&flights, &[], &test).unwrap();
    assert_eq!(skill.flights, 4);
    // Pushes of 0.03 to 0.09 N against 3 mN of noise.
    assert!(skill.r2_disc_mean > 0.98, "{}", skill.r2_disc_mean);
    assert!(skill.r2_disc_mean > skill.r2_centre);
    assert_eq!(
        held_out_force(&flights, &[], &ForceTest { folds: 1, ..test }),
        Err(ForceTestError::Folds(1))
    );
}

/// The same flight told by something else than duty cycles: rotor speeds that lead to the same
/// thrust (at 3e-8 N a square of rad/s), thrust that is logged a tenth too high, or the ready force
/// beside the thrust.
fn told_otherwise(mut flight: Recording, source: ThrustSource) -> Recording {
    for vehicle in &mut flight.vehicles {
        let track = &mut vehicle.track;
        let thrust_n = flown_n(track);
        (track.duty, track.battery_v) = (None, None);
        match source {
            ThrustSource::RotorSpeed => {
                let speed = |thrust_n: &f64| [(thrust_n / 4.0 / 3e-8).sqrt(); 4];
                track.rotor_speed_radps = Some(thrust_n.iter().map(speed).collect());
            }
            ThrustSource::Thrust => {
                track.thrust_n = Some(thrust_n.iter().map(|of| 1.1 * of).collect());
            }
            _ => {
                let felt = track.specific_force_mps2.take().unwrap();
                let mass_kg = vehicle.airframe.mass_kg();
                let rows = felt.iter().zip(&track.attitude).zip(&thrust_n);
                let force = |((felt, attitude), thrust_n): ((&Vector3<f64>, _), &f64)| {
                    let attitude: &UnitQuaternion<f64> = attitude;
                    felt * mass_kg - attitude * Vector3::z() * *thrust_n
                };
                track.force_n = Some(rows.map(force).collect());
                track.thrust_n = Some(thrust_n);
            }
        }
    }
    flight
}

#[test]
fn the_same_force_is_identified_by_rotor_speeds_by_thrust_and_as_it_stands() {
    let test = ForceTest {
        folds: 4,
        ..ForceTest::default()
    };
    for source in [
        ThrustSource::RotorSpeed,
        ThrustSource::Thrust,
        ThrustSource::ReadyForce,
    ] {
        let flights = (1..=4)
            .map(alone)
            .chain((1..=4).map(|seed| pair(seed, 0.0)));
        let flights: Vec<Recording> = flights.map(|of| told_otherwise(of, source)).collect();
        assert_eq!(flights[0].vehicles[0].track.thrust_source(), Some(source));
        let skill = held_out_force(&flights, &[], &test).unwrap();
        // As with duty cycles.
        assert!(
            skill.r2_disc_mean > 0.98,
            "{source:?}: {}",
            skill.r2_disc_mean
        );
    }
}

#[test]
fn of_a_stated_thrust_map_nothing_but_the_offset_is_identified_and_without_flights_it_stands() {
    let stated = |mut flight: Recording| {
        let vehicles = flight.vehicles.iter_mut();
        vehicles.for_each(|vehicle| vehicle.thrust_map = Some(truth()));
        flight
    };
    let pairs = || (1..=4).map(|seed| stated(pair(seed, 0.0)));
    let flights: Vec<Recording> = (1..=4).map(alone).map(stated).chain(pairs()).collect();
    let skill = held_out_force(&flights, &[], &ForceTest::default()).unwrap();
    let others = |map: &ThrustMap| map.terms().filter(|(term, _)| *term != OFFSET[0]).collect();
    for of in &skill.maps {
        let (found, known): (Vec<_>, Vec<_>) = (others(&of.found.map), others(&truth()));
        assert_eq!((found, of.found.map.lag_s()), (known, LAG_S));
        assert!(of.found.rows > 0 && of.found.offset_n.abs() < 0.25);
    }
    assert!(skill.r2_disc_mean > 0.98, "{}", skill.r2_disc_mean);
    // No other flight to find an offset in.
    let one: Vec<Recording> = pairs().take(1).collect();
    let skill = held_out_force(&one, &[], &ForceTest::default()).unwrap();
    assert_eq!(skill.maps[0].found.map, truth());
}

#[test]
fn one_flight_alone_has_no_thrust_map_to_be_judged_by() {
    let error = held_out_force(&[alone(1)], &[], &ForceTest::default()).unwrap_err();
    let ForceTestError::Identify(failed) = &error else {
        panic!("{error}");
    };
    assert_eq!(failed.error, IdentifyError::NoOtherFlight);
}

#[test]
fn any_number_of_threads_gives_the_same_answer() {
    let mut flights: Vec<Recording> = (1..=4).map(alone).collect();
    flights.extend((1..=4).map(|seed| pair(seed, 0.01)));
    let test = ForceTest {
        folds: 2,
        ..ForceTest::default()
    };
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let skill = held_out_force(&flights, &[], &test).unwrap();
            let clocks = clock_offsets(&flights, &skill, &test);
            (skill, clocks)
        })
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn forces_beside_their_simulation_count_what_is_missing_and_what_is_out_of_range() {
    let mut flight = pair(3, 0.0);
    flight.vehicles[0].thrust_map = Some(truth());
    let battery_v = flight.vehicles[0].track.battery_v.as_mut().unwrap();
    battery_v[100..110].fill(f64::NAN);
    let (samples, remarks) = force::simulate(&flight, &Flow::new(&flight), LOW_PASS);
    assert_eq!(samples.len(), 1990);
    assert!(
        samples
            .iter()
            .all(|sample| sample.channel == Channel::VerticalForce && sample.subject == 0)
    );
    // Noise of 3 mN, at its largest in 2000 rows four times that.
    assert!(samples.iter().all(|sample| sample.residual().abs() < 0.012));
    let counted: Vec<(RemarkKind, usize)> = remarks
        .iter()
        .map(|remark| (remark.kind, remark.samples))
        .collect();
    let outside = truth().rows_outside(flight.vehicles[0].track.duty.as_deref().unwrap());
    assert_eq!(counted[0], (RemarkKind::Gap, 10));
    assert!(outside == 0 || counted[1] == (RemarkKind::OutOfRange, outside));
}

#[test]
fn a_clock_that_the_forces_tell_is_found_and_one_that_they_do_not_stays() {
    let map = truth();
    for clock_s in [-0.015, 0.0, 0.025] {
        let flight = pair(7, clock_s);
        let found = clock::offsets(&flight, &[Some(&map), Some(&map)], LOW_PASS);
        assert_eq!(found[0].known, ClockKnown::Shared);
        assert_eq!(found[1].known, ClockKnown::Told);
        let [low_s, high_s] = found[1].interval_s;
        // The interval, and as much again: one flight in twenty lies outside by design.
        let reach_s = high_s - low_s;
        assert!(
            (found[1].offset_s - clock_s).abs() < reach_s,
            "{clock_s}: {:?}",
            found[1]
        );
        assert!(reach_s < 0.02);
    }
    let beyond = clock::offsets(&pair(7, 0.07), &[Some(&map), Some(&map)], LOW_PASS);
    assert_eq!(
        (beyond[1].known, beyond[1].offset_s),
        (ClockKnown::AtBound, 0.04)
    );
    let mut apart = pair(7, 0.02);
    for position_m in &mut apart.vehicles[1].track.position_m {
        position_m.y += 5.0;
    }
    let none = clock::offsets(&apart, &[Some(&map), Some(&map)], LOW_PASS);
    assert_eq!(
        (none[1].known, none[1].offset_s),
        (ClockKnown::CannotBeTold, 0.0)
    );
    assert_eq!(none[1].interval_s, [-0.04, 0.04]);
}

/// The lower drone's power in the wake of the upper one that passes, `eta` times the air of
/// momentum theory felt, with 1 % noise.
fn powered(eta: f64) -> Recording {
    let mut recording = pair(3, 0.0);
    let density = AIR.density_kg_per_m3();
    let airframe = airframe();
    let hover_mps = airframe.hover_induced_velocity_mps(airframe.mass_kg(), density);
    let wake = Wake::new(&airframe, airframe.mass_kg(), density, &Jet::default());
    let discs = airframe.disc_points();
    let mut noise = Noise(7);
    let baseline = &mut recording.baseline;
    baseline.receiver_law = ReceiverLaw::HoldsThrust { exponent: 0.5 };
    let lower = &mut recording.vehicles[0];
    lower.track.duty = None;
    let powers_w = lower.track.t_s.iter().map(|&t_s| {
        let source = airflow::Source {
            wake: &wake,
            position_m: upper(t_s),
            ends_at_z_m: 0.0,
        };
        let sources = [source];
        let sum = airflow::Superposition::Momentum;
        let air_mps = mean_over_discs_mps(&sources, &discs, LOWER, sum);
        9.0 * airflow::power::beta(eta * air_mps / hover_mps) * (1.0 + 0.01 * noise.next())
    });
    lower.track.power_w = Some(powers_w.collect());
    recording.vehicles[1].track.duty = None;
    // Ten times slower, so that there are blocks to hold out.
    for vehicle in &mut recording.vehicles {
        vehicle.track.t_s.iter_mut().for_each(|t_s| *t_s *= 10.0);
        vehicle.track.longest_step_s *= 10.0;
    }
    // Every fifth moment: a throttle that cannot be read.
    let moments = recording.vehicles[0].track.t_s.iter().step_by(5);
    recording.receivers = moments
        .map(|&t_s| ReceiverSample {
            t_s,
            vehicle: 0,
            throttle_ratio: f64::NAN,
            battery_v: None,
        })
        .collect();
    recording
}

#[test]
fn the_power_of_a_drone_in_a_wake_is_simulated_over_its_power_without_one() {
    let recording = powered(1.0);
    let samples = diagnosis::forward::simulate::simulate(&recording).samples;
    let of_power: Vec<_> = samples
        .iter()
        .filter(|sample| sample.channel == Channel::Power)
        .collect();
    assert_eq!(of_power.len(), recording.receivers.len());
    let most = of_power.iter().map(|s| s.recorded).fold(0.0, f64::max);
    assert!(most > 1.3, "the wake is met: {most}");
    for sample in of_power {
        // 1 % noise on the sample, and a third of it on the reference.
        let apart = sample.residual().abs() / sample.simulated;
        assert!(apart < 0.02, "{apart} at {} s", sample.t_s);
    }
}

#[test]
fn a_power_that_feels_less_of_the_wake_is_named_so() {
    let finding =
        diagnosis::infer::diagnose::diagnose_channel(&powered(0.7), Some(Channel::Power)).unwrap();
    let [effect] = &finding.effects[..] else {
        panic!("one effect: {:?}", finding.effects);
    };
    assert_eq!(effect.name, "receiver_inflow");
    let eta = &effect.parameters["eta"];
    assert!((eta.low..=eta.high).contains(&0.7), "{eta:?}");
    assert!(finding.held_out.rms_after < 0.5 * finding.held_out.rms_before);
}
