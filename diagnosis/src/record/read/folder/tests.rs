//! Small folders written here, sound and spoilt.

use super::*;
use crate::record::baseline::{ReceiverLaw, Upper};
use crate::record::recording::Role;

const META_JSON: &str = r#"{
 "format": "downwash-recording/1", "g_mps2": 9.81,
 "environment": {"pressure_pa": 101325.0, "temperature_k": 300.15, "floor_z_m": 0.0, "ceiling_z_m": null,
                 "ambient_speed_before_takeoff_mps": 0.1, "ambient_is_subtracted": false},
 "vehicles": {
  "v0": {"type": "Kolibri", "mass_kg": 0.23, "prop_diameter_m": 0.0737, "n_props": 4, "motor_distance_m": 0.118, "role": "emitter"},
  "recv": {"type": "Of my own", "mass_kg": 1.0, "prop_diameter_m": 0.2, "n_props": 6, "motor_distance_m": 0.5, "role": "receiver"}},
 "probe": {"kind": "hot_ball", "measures": "speed_magnitude", "rate_hz": 1.0, "lowpass_tau_s": 0.0,
           "accuracy_abs_mps": 0.03, "accuracy_rel": 0.05, "resolution_mps": 0.01},
 "baseline": {"superposition": "linear_sum", "emitter_delay": "none", "near_field": "far_field_extrapolated",
              "receiver_air": "centre", "receiver_law": "throttle = sqrt(beta)", "observation": "sqrt(U_axial^2 + ambient^2)"},
 "channels": ["vehicles.csv", "probes.csv", "receiver.csv"]
}"#;

const VEHICLES_CSV: &str = "t_s,vehicle_id,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,roll_rad,pitch_rad,yaw_rad,throttle_ratio,power_w
0.0,v0,0,0,3,0,0,0,0,0,0,1.0,27
0.0,recv,0,0,1,0,0,0,0,0,0,,
0.25,v0,0,0,3,0,0,0,0,0,0,1.01,27
0.25,recv,0,0,1,0,0,0,0,0,0,,
0.5,v0,0,0,3,0,0,0,0,0,0,1.01,27
0.5,recv,0,0,1,0,0,0,0,0,0,,
";

const RECEIVER_CSV: &str =
    "t_s,vehicle_id,throttle_ratio,battery_v\n0.0,recv,1.2,16.6\n1.0,recv,1.3,\n";

fn probes_csv(speeds: &[f64]) -> String {
    let mut text = "t_s,probe_id,x_m,y_m,z_m,speed_mps\n".to_owned();
    for (row, speed) in speeds.iter().enumerate() {
        text.push_str(&format!("{row},0,0,0,1,{speed}\n"));
    }
    text
}

fn files(changed: &[(&str, String)]) -> BTreeMap<String, Vec<u8>> {
    let mut files: BTreeMap<String, Vec<u8>> = [
        ("meta.json", META_JSON.to_owned()),
        ("vehicles.csv", VEHICLES_CSV.to_owned()),
        ("probes.csv", probes_csv(&[1.0, 1.1, 1.2])),
        ("receiver.csv", RECEIVER_CSV.to_owned()),
    ]
    .into_iter()
    .map(|(name, text)| (name.to_owned(), text.into_bytes()))
    .collect();
    for (name, text) in changed {
        files.insert((*name).to_owned(), text.clone().into_bytes());
    }
    files
}

fn said(changed: &[(&str, String)]) -> Vec<String> {
    let problems = read_folder("r", &files(changed)).expect_err("is refused").0;
    problems.iter().map(ToString::to_string).collect()
}

#[test]
fn a_folder_reads_as_its_metadata_say() {
    let recording = read_folder("r", &files(&[])).expect("in order");
    assert_eq!(recording.name, "r");
    assert!((recording.environment.air.temperature_c - 27.0).abs() < 1e-9);
    assert_eq!(recording.environment.ceiling_z_m, None);
    assert_eq!(recording.baseline.upper, Upper::FarFieldExtrapolated);
    assert_eq!(
        recording.baseline.receiver_law,
        ReceiverLaw::HoldsThrust { exponent: 0.5 }
    );
    let ids: Vec<&str> = recording
        .vehicles
        .iter()
        .map(|vehicle| vehicle.id.as_str())
        .collect();
    assert_eq!(ids, ["recv", "v0"]);
    let [receiver, emitter] = recording.vehicles.as_slice() else {
        panic!("two vehicles");
    };
    assert_eq!(
        (receiver.role, emitter.role),
        (Role::Receiver, Role::Emitter)
    );
    assert_eq!(receiver.airframe.name(), "Of my own");
    assert_eq!(receiver.airframe.propellers(), 6);
    assert_eq!(
        emitter.track.throttle_ratio.as_deref(),
        Some(&[1.0, 1.01, 1.01][..])
    );
    assert!(receiver.track.throttle_ratio.is_none());
    assert_eq!(recording.probes.map(|probes| probes.samples.len()), Some(3));
    let [first, second] = recording.receivers.as_slice() else {
        panic!("two rows");
    };
    assert_eq!((first.vehicle, first.battery_v), (0, Some(16.6)));
    assert_eq!((second.throttle_ratio, second.battery_v), (1.3, None));
}

#[test]
fn faults_of_the_metadata_are_said_all_at_once_each_at_its_path() {
    let meta = META_JSON
        .replace("\"pressure_pa\": 101325.0", "\"pressure_pa\": -1")
        .replace("\"mass_kg\": 0.23", "\"mass_kg\": \"heavy\"")
        .replace("\"n_props\": 6", "\"n_props\": 4.5")
        .replace("\"rate_hz\": 1.0, ", "")
        .replace("linear_sum", "sum");
    assert_eq!(
        said(&[("meta.json", meta)]),
        [
            "meta.json: `environment.pressure_pa`: is -1; it must be above 0",
            "meta.json: `vehicles.recv.n_props`: is 4.5; it must be a whole number",
            "meta.json: `vehicles.v0.mass_kg`: must be a number, not a text",
            "meta.json: `probe.rate_hz`: is missing",
            "meta.json: `baseline.superposition`: is not known: \"sum\"",
        ]
    );
    let no_probe = META_JSON.replace("\"probe\"", "\"sonde\"");
    assert_eq!(
        said(&[("meta.json", no_probe)]),
        ["meta.json: `probe`: is missing, and probes.csv needs it"]
    );
}

#[test]
fn what_is_no_recording_of_this_format_is_said() {
    let other = META_JSON.replace("downwash-recording/1", "downwash-recording/2");
    assert_eq!(
        said(&[("meta.json", other)]),
        ["meta.json: `format`: is \"downwash-recording/2\"; this reads \"downwash-recording/1\""]
    );
    assert_eq!(
        said(&[("meta.json", "{\n\"format\": }".to_owned())]),
        ["meta.json:2: is no JSON: expected value at line 2 column 11"]
    );
    let none = read_folder("r", &BTreeMap::new()).expect_err("is refused");
    assert_eq!(none.0[0].to_string(), "meta.json: is missing");
    let typo = META_JSON.replace("\"receiver.csv\"", "\"receivers.csv\"");
    let problems = read_folder("r", &files(&[("meta.json", typo)]))
        .expect_err("is refused")
        .0;
    assert_eq!(
        problems[0].to_string(),
        "meta.json: `channels`: names \"receivers.csv\"; tables are `vehicles.csv`, `probes.csv`, `receiver.csv`"
    );
    assert_eq!(
        problems[0].help.as_deref(),
        Some("did you mean `receiver.csv`?")
    );
}

#[test]
fn vehicles_without_metadata_and_metadata_without_vehicle_are_errors() {
    let vehicles = VEHICLES_CSV.replace(",recv,", ",rcev,");
    assert_eq!(
        said(&[("vehicles.csv", vehicles)]),
        [
            "vehicles.csv:3: vehicle `rcev` is not in the metadata (3 rows)",
            "meta.json: `vehicles.recv`: has no row in vehicles.csv",
        ]
    );
    let receivers = RECEIVER_CSV.replace("recv", "recu");
    assert_eq!(
        said(&[("receiver.csv", receivers)]),
        ["receiver.csv:2: vehicle `recu` is not in the metadata (2 rows)"]
    );
}

#[test]
fn readings_that_cannot_be_are_left_out_counted_and_told_and_keep_their_row() {
    let mut speeds = vec![1.0, -0.2, 300.0, f64::NAN];
    speeds.extend([2.5; 9]);
    speeds.extend([0.0; 9]);
    speeds.push(3.0);
    let recording =
        read_folder("r", &files(&[("probes.csv", probes_csv(&speeds))])).expect("in order");
    let samples = recording.probes.expect("probes").samples;
    assert_eq!(samples.len(), speeds.len());
    let left: Vec<f64> = samples
        .iter()
        .map(|sample| sample.speed_mps)
        .filter(|v| v.is_finite())
        .collect();
    // The first of the stuck readings may be one; air at rest may well read 0 again and again.
    assert_eq!(left, [&[1.0, 2.5][..], &[0.0; 9], &[3.0]].concat());
    let told: Vec<(RemarkKind, usize)> = recording
        .remarks
        .iter()
        .filter(|remark| remark.subject.as_deref() == Some("probe 0"))
        .map(|remark| (remark.kind, remark.samples))
        .collect();
    assert_eq!(
        told,
        [
            (RemarkKind::Impossible, 1),
            (RemarkKind::Impossible, 2),
            (RemarkKind::Stuck, 8),
            (RemarkKind::Gap, 1), // where the three were
        ]
    );
}

#[test]
fn a_plateau_at_the_highest_speed_is_told_and_kept() {
    let mut speeds: Vec<f64> = (0..40).map(|row| 1.0 + 0.02 * f64::from(row)).collect();
    speeds.extend([2.0; 10]);
    let recording =
        read_folder("r", &files(&[("probes.csv", probes_csv(&speeds))])).expect("in order");
    let samples = recording.probes.expect("probes").samples;
    assert!(samples.iter().all(|sample| sample.speed_mps.is_finite()));
    let told: Vec<RemarkKind> = recording
        .remarks
        .iter()
        .filter(|remark| remark.subject.as_deref() == Some("probe 0"))
        .map(|remark| remark.kind)
        .collect();
    assert_eq!(told, [RemarkKind::Saturated]);
}

#[test]
fn probes_without_a_time_or_an_id_and_gaps_are_told() {
    let text = "t_s,probe_id,x_m,y_m,z_m,speed_mps\n,0,0,0,1,1\n1,0.5,0,0,1,1\n".to_owned();
    assert_eq!(
        said(&[("probes.csv", text)]),
        [
            "probes.csv:2: `t_s`: has no time",
            "probes.csv:3: `probe_id`: is 0.5; it must be a whole number, 0 or more",
        ]
    );
    let text = "t_s,probe_id,x_m,y_m,z_m,speed_mps\n0,0,0,0,1,1\n1,0,0,0,1,1.1\n9,0,0,0,1,1\n9,0,0,0,1,1\n".to_owned();
    let recording = read_folder("r", &files(&[("probes.csv", text)])).expect("in order");
    let told: Vec<&str> = recording
        .remarks
        .iter()
        .filter(|remark| remark.subject.as_deref() == Some("probe 0"))
        .map(|remark| remark.message.as_str())
        .collect();
    assert_eq!(
        told,
        [
            "1 reading left out: their time repeats or goes back",
            "1 reading with a gap after them, the longest of 8.00 s (the rate is 1 Hz)",
        ]
    );
}

#[test]
fn receivers_that_cannot_be_are_left_out_and_keep_their_row() {
    let text =
        "t_s,vehicle_id,throttle_ratio\n0,recv,1.1\n1,recv,-1\n1,recv,1.1\n2,recv,1.2\n".to_owned();
    let recording = read_folder("r", &files(&[("receiver.csv", text)])).expect("in order");
    let usable: Vec<bool> = recording
        .receivers
        .iter()
        .map(|sample| sample.throttle_ratio.is_finite())
        .collect();
    assert_eq!(usable, [true, false, false, true]);
    let told = recording
        .remarks
        .iter()
        .find(|remark| remark.kind == RemarkKind::Impossible);
    assert_eq!(told.map(|remark| remark.samples), Some(2));
}

#[test]
fn keys_tables_and_columns_that_nothing_uses_are_named() {
    let meta = META_JSON
        .replace("\"g_mps2\"", "\"weather\": \"fine\", \"g_mps2\"")
        .replace(", \"receiver.csv\"]", "]");
    let probes = "t_s,probe_id,x_m,y_m,z_m,speed_mps,colour\n0,0,0,0,1,1,2\n".to_owned();
    let recording =
        read_folder("r", &files(&[("meta.json", meta), ("probes.csv", probes)])).expect("in order");
    let told: Vec<&str> = recording
        .remarks
        .iter()
        .filter(|remark| remark.kind == RemarkKind::Unused && remark.subject.is_none())
        .map(|remark| remark.message.as_str())
        .collect();
    assert_eq!(
        told,
        [
            "`weather` of meta.json is not used",
            "receiver.csv is there but not among the `channels` of meta.json: not used",
            "column `colour` of probes.csv is not used",
        ]
    );
}
