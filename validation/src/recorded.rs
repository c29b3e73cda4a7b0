//! From a synthetic flight to what is recorded of it, in the types of `diagnosis`. The one place
//! where the synthetic world meets those of `airflow`, and only their descriptions.

use nalgebra::{Point3, UnitQuaternion};

use crate::scene::{ACCURACY_ABS_MPS, ACCURACY_REL, Row, Scene, TrackRow};
use crate::world::Drone;
use diagnosis::record::baseline::{Baseline, Delay, Observation, ReceiverAir, ReceiverLaw, Upper};
use diagnosis::record::recording::{
    Clock, Environment, Instrument, Measures, ProbeSample, Probes, ReceiverSample, Recording, Role,
    Track, Vehicle,
};
use diagnosis::record::{Air, Airframe, Superposition};
use diagnosis::statistics::draws::Draws;

/// 0 °C in kelvin.
const ZERO_CELSIUS_K: f64 = 273.15;
/// Steps longer than so many of the usual are gaps.
const LONGEST_STEP: f64 = 2.5;

pub(super) fn recording(scene: &Scene, name: &str, rows: &[Row], random: &mut Draws) -> Recording {
    let mut vehicles: Vec<Vehicle> = Vec::new();
    for (index, emitter) in scene.emitters.iter().enumerate() {
        let rows = scene.track(emitter, random);
        vehicles.push(vehicle(
            format!("v{index}"),
            &emitter.drone,
            Role::Emitter,
            &rows,
            scene.track_hz,
        ));
    }
    if let Some(receiver) = &scene.receiver {
        let rows = scene.route_rows(&receiver.route, random);
        vehicles.push(vehicle(
            "recv".to_owned(),
            &receiver.drone,
            Role::Receiver,
            &rows,
            scene.track_hz,
        ));
    }
    vehicles.sort_by(|a, b| a.id.cmp(&b.id));
    let receiving = vehicles
        .iter()
        .position(|vehicle| vehicle.role == Role::Receiver);
    let reading = |row: &Row| ProbeSample {
        t_s: row.t_s,
        probe_id: row.probe as u32,
        position_m: Point3::from(
            scene.probes[row.probe]
                .position_m(row.t_s)
                .map(|value| (value * 1e4).round() / 1e4),
        ),
        speed_mps: row.logged,
    };
    let throttle = |row: &Row| {
        Some(ReceiverSample {
            t_s: row.t_s,
            vehicle: receiving?,
            throttle_ratio: row.logged,
            battery_v: row.battery_v,
        })
    };
    let instrument = &scene.instrument;
    Recording {
        name: name.to_owned(),
        environment: Environment {
            gravity_mps2: crate::world::GRAVITY,
            air: Air {
                temperature_c: scene.temperature_k - ZERO_CELSIUS_K,
                pressure_pa: scene.pressure_pa,
            },
            floor_z_m: Some(scene.floor_z_m),
            ceiling_z_m: scene.ceiling_z_m,
            ambient_mps: instrument.ambient_mps,
            ambient_is_subtracted: false,
        },
        probes: receiving.is_none().then(|| Probes {
            instrument: Instrument {
                kind: "hot_ball".to_owned(),
                measures: Measures::SpeedMagnitude,
                rate_hz: instrument.rate_hz,
                lowpass_tau_s: instrument.lowpass_s,
                accuracy_abs_mps: ACCURACY_ABS_MPS,
                accuracy_rel: ACCURACY_REL,
                resolution_mps: instrument.resolution_mps,
            },
            samples: rows.iter().map(reading).collect(),
        }),
        receivers: rows.iter().filter_map(throttle).collect(),
        vehicles,
        baseline: Baseline {
            wakes: true,
            superposition: if scene.declares_momentum_sum {
                Superposition::Momentum
            } else {
                Superposition::Linear
            },
            delay: match scene.declares_convection {
                Some(convection) => Delay::Transport { convection },
                None => Delay::None,
            },
            upper: Upper::FarFieldExtrapolated,
            receiver_air: ReceiverAir::Centre,
            receiver_law: ReceiverLaw::HoldsThrust { exponent: 0.5 },
            observation: if scene.declares_radial {
                Observation::VelocityAndAmbient
            } else {
                Observation::AxialAndAmbient
            },
        },
        jet: Default::default(),
        remarks: Vec::new(),
    }
}

fn vehicle(id: String, drone: &Drone, role: Role, rows: &[TrackRow], track_hz: f64) -> Vehicle {
    let airframe = Airframe::new(
        drone.name,
        drone.mass_kg,
        4,
        drone.propeller_m,
        drone.motors_m,
        1.0,
    );
    let attitude = |row: &TrackRow| {
        let [roll, pitch, yaw] = row.attitude_rad;
        UnitQuaternion::from_euler_angles(roll, pitch, yaw)
    };
    let has_wake = role != Role::Receiver;
    Vehicle {
        id,
        airframe: airframe.expect("the drones of the synthetic world are constants, and sound"),
        role,
        track: Track {
            t_s: rows.iter().map(|row| row.t_s).collect(),
            position_m: rows.iter().map(|row| Point3::from(row.place_m)).collect(),
            velocity_mps: rows.iter().map(|row| row.velocity_mps).collect(),
            attitude: rows.iter().map(attitude).collect(),
            attitude_is_logged: true,
            throttle_ratio: has_wake.then(|| rows.iter().map(|row| row.throttle).collect()),
            power_w: has_wake.then(|| rows.iter().map(|row| row.power_w).collect()),
            longest_step_s: LONGEST_STEP / track_hz,
            ..Track::default()
        },
        thrust_map: None,
        clock: Clock::Shared,
    }
}
