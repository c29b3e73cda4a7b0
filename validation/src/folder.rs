//! A recording as the texts of a `downwash-recording/1` folder.

use std::fmt::Write as _;

use serde_json::{Map, json};

use diagnosis::record::Superposition;
use diagnosis::record::baseline::{Delay, Observation, ReceiverAir, ReceiverLaw, Upper};
use diagnosis::record::recording::{Measures, Recording, Role};

/// File names and texts: `meta.json`, `vehicles.csv`, and `probes.csv` and `receiver.csv` where
/// there are probes and receivers.
///
/// Where a track has no throttle it is written as 1, and as empty for a receiver, whose own table
/// has it; no power is written as empty.
#[must_use]
pub fn texts(recording: &Recording) -> Vec<(&'static str, String)> {
    let mut files = vec![
        ("meta.json", meta(recording)),
        ("vehicles.csv", vehicles(recording)),
    ];
    if let Some(probes) = &recording.probes {
        let mut text = String::from("t_s,probe_id,x_m,y_m,z_m,speed_mps\n");
        for sample in &probes.samples {
            let [x, y, z] = sample.position_m.coords.into();
            let (t_s, id, speed) = (sample.t_s, sample.probe_id, sample.speed_mps);
            let _ = writeln!(text, "{t_s:.3},{id},{x:.4},{y:.4},{z:.4},{speed:.3}");
        }
        files.push(("probes.csv", text));
    }
    if !recording.receivers.is_empty() {
        let mut text = String::from("t_s,vehicle_id,throttle_ratio,battery_v\n");
        for sample in &recording.receivers {
            let id = &recording.vehicles[sample.vehicle].id;
            let battery = sample
                .battery_v
                .map_or(String::new(), |volts| format!("{volts:.2}"));
            let _ = writeln!(
                text,
                "{:.3},{id},{:.4},{battery}",
                sample.t_s, sample.throttle_ratio
            );
        }
        files.push(("receiver.csv", text));
    }
    files
}

fn meta(recording: &Recording) -> String {
    let environment = &recording.environment;
    let vehicles: Map<String, serde_json::Value> = recording
        .vehicles
        .iter()
        .map(|vehicle| {
            let airframe = &vehicle.airframe;
            let role = match vehicle.role {
                Role::Emitter => "emitter",
                Role::Receiver => "receiver",
                Role::Both => "both",
            };
            let mut described = json!({
                "type": airframe.name(),
                "mass_kg": airframe.mass_kg(),
                "prop_diameter_m": airframe.propeller_diameter_m(),
                "n_props": airframe.propellers(),
                "motor_distance_m": airframe.motor_distance_m(),
                "role": role,
            });
            // Canted propellers: a calibration leaves them beside its fit.
            if airframe.fit_excludes() {
                described["width_factor"] = json!(airframe.width_factor());
            }
            (vehicle.id.clone(), described)
        })
        .collect();
    let probe = recording.probes.as_ref().map(|probes| {
        let instrument = &probes.instrument;
        json!({
            "kind": instrument.kind,
            "measures": match instrument.measures {
                Measures::SpeedMagnitude => "speed_magnitude",
                Measures::Axial => "axial",
            },
            "rate_hz": instrument.rate_hz,
            "lowpass_tau_s": instrument.lowpass_tau_s,
            "accuracy_abs_mps": instrument.accuracy_abs_mps,
            "accuracy_rel": instrument.accuracy_rel,
            "resolution_mps": instrument.resolution_mps,
        })
    });
    let baseline = &recording.baseline;
    let mut channels = vec!["vehicles.csv"];
    channels.extend(probe.is_some().then_some("probes.csv"));
    channels.extend((!recording.receivers.is_empty()).then_some("receiver.csv"));
    let meta = json!({
        "format": "downwash-recording/1",
        "g_mps2": environment.gravity_mps2,
        "environment": {
            "pressure_pa": environment.air.pressure_pa,
            "temperature_k": environment.air.temperature_c + 273.15,
            "floor_z_m": environment.floor_z_m,
            "ceiling_z_m": environment.ceiling_z_m,
            "ambient_speed_before_takeoff_mps": environment.ambient_mps,
            "ambient_is_subtracted": environment.ambient_is_subtracted,
        },
        "vehicles": vehicles,
        "probe": probe,
        "baseline": {
            "superposition": match baseline.superposition {
                Superposition::Linear => "linear_sum",
                Superposition::Momentum => "momentum_sum",
                Superposition::Strongest => "strongest",
            },
            "emitter_delay": match baseline.delay {
                Delay::None => "none",
                Delay::Transport { .. } => "transport",
            },
            "near_field": match baseline.upper {
                Upper::FarFieldExtrapolated => "far_field_extrapolated",
                Upper::FourRotors => "four_rotors",
            },
            "receiver_air": match baseline.receiver_air {
                ReceiverAir::Centre => "centre",
                ReceiverAir::DiscMean => "disc_mean",
            },
            "receiver_law": match baseline.receiver_law {
                ReceiverLaw::HoldsThrust { .. } => "throttle = sqrt(beta)",
                ReceiverLaw::HoldsPower => "holds_power",
            },
            "observation": match baseline.observation {
                Observation::AxialAndAmbient => "sqrt(U_axial^2 + ambient^2)",
                Observation::VelocityAndAmbient => "sqrt(U_axial^2 + V_radial^2 + ambient^2)",
            },
        },
        "channels": channels,
    });
    format!("{meta:#}\n")
}

fn vehicles(recording: &Recording) -> String {
    let mut text = String::from(
        "t_s,vehicle_id,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,roll_rad,pitch_rad,yaw_rad,throttle_ratio,power_w\n",
    );
    for vehicle in &recording.vehicles {
        let track = &vehicle.track;
        for (i, t_s) in track.t_s.iter().enumerate() {
            let [x, y, z] = track.position_m[i].coords.into();
            let [vx, vy, vz]: [f64; 3] = track.velocity_mps[i].into();
            let (roll, pitch, yaw) = track.attitude[i].euler_angles();
            let throttle = match &track.throttle_ratio {
                Some(ratios) => format!("{:.4}", ratios[i]),
                None if vehicle.role == Role::Receiver => String::new(),
                None => "1.0000".to_owned(),
            };
            let power = track
                .power_w
                .as_ref()
                .map_or(String::new(), |powers| format!("{:.1}", powers[i]));
            let _ = writeln!(
                text,
                "{t_s:.3},{},{x:.4},{y:.4},{z:.4},{vx:.4},{vy:.4},{vz:.4},{roll:.4},{pitch:.4},{yaw:.4},{throttle},{power}",
                vehicle.id
            );
        }
    }
    text
}
