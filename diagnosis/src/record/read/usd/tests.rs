//! Logs written here, byte by byte after the firmware's own reader (`tools/usdlog/cfusdlog.py`).

use super::super::read_log;
use super::*;
use nalgebra::{Point3, Vector3};

const CAMPAIGN: &str = r#"(
    name: "cf", air: (temperature_c: 20),
    types: { "cf": (mass_kg: Stated(0.034), propeller_diameter_m: Stated(0.046), motor_distance_m: Stated(0.092),
                    rotor_offset_m: Stated((0, 0, 0))) },
    vehicles: { "cf7": "cf" },
)"#;

fn campaign() -> Campaign {
    Campaign::parse("c.ron", CAMPAIGN).expect("in order")
}

fn closed(mut log: Vec<u8>) -> Vec<u8> {
    log.extend(crc32fast::hash(&log).to_le_bytes());
    log
}

/// A second at 1 m height, north-west at half a metre a second, nose up by 10 degrees; the battery
/// in an event of its own.
fn flight(version: u16) -> Vec<u8> {
    let mut log = vec![0xBC];
    log.extend(version.to_le_bytes());
    log.extend(2_u16.to_le_bytes());
    let types: [(&str, &[&str]); 2] = [
        (
            "fixedFrequency",
            &[
                "stateEstimateZ.x(h)",
                "stateEstimateZ.y(h)",
                "stateEstimateZ.z(h)",
                "stateEstimate.vx(e)",
                "stateEstimate.vy(f)",
                "stateEstimate.vz(f)",
                "stateEstimate.roll(f)",
                "stateEstimate.pitch(f)",
                "stateEstimate.yaw(f)",
                "acc.x(f)",
                "acc.y(f)",
                "acc.z(f)",
                "motor.m1(H)",
                "motor.m2(I)",
                "motor.m3(H)",
                "motor.m4(H)",
                "ctrltarget.x(d)",
            ],
        ),
        ("battery", &["pm.vbat(f)"]),
    ];
    for (id, (name, variables)) in types.into_iter().enumerate() {
        log.extend((id as u16 + 7).to_le_bytes());
        log.extend(name.bytes().chain([0]));
        log.extend((variables.len() as u16).to_le_bytes());
        variables
            .iter()
            .for_each(|of| log.extend(of.bytes().chain([0])));
    }
    let stamp = |log: &mut Vec<u8>, id: u16, t_ms: u32| {
        log.extend(id.to_le_bytes());
        match version {
            1 => log.extend(t_ms.to_le_bytes()),
            _ => log.extend((u64::from(t_ms) * 1000).to_le_bytes()),
        }
    };
    for tick in 0..100_u16 {
        let t_ms = 90_000 + u32::from(tick) * 10;
        if tick % 50 == 0 {
            stamp(&mut log, 8, t_ms);
            log.extend(3.9_f32.to_le_bytes());
        }
        stamp(&mut log, 7, t_ms);
        let run_mm = tick as i16 * 5;
        [run_mm, run_mm, 1000]
            .iter()
            .for_each(|mm| log.extend(mm.to_le_bytes()));
        log.extend(0x3800_u16.to_le_bytes()); // 0.5 in half precision
        // Nose up by 10 degrees: the body's x leans against gravity.
        let (along, up) = (10_f32.to_radians().sin(), 10_f32.to_radians().cos());
        let floats = [0.5, 0.0, 0.0, 10.0, 0.0, along, 0.0, up];
        floats
            .iter()
            .for_each(|of: &f32| log.extend(of.to_le_bytes()));
        log.extend(32768_u16.to_le_bytes());
        log.extend(32768_u32.to_le_bytes());
        [16384_u16, 49152]
            .iter()
            .for_each(|of| log.extend(of.to_le_bytes()));
        log.extend(0_f64.to_le_bytes());
    }
    closed(log)
}

fn problem(bytes: &[u8]) -> String {
    let problems = read_log("log07", "log07", bytes, &campaign()).expect_err("is refused");
    problems.0[0].to_string()
}

#[test]
fn logs_of_both_versions_read_without_a_word_about_columns() {
    for version in [1, 2] {
        let read = read_log("log07", "log07", &flight(version)[..], &campaign()).expect("in order");
        assert_eq!(read.vehicles[0].id, "cf7");
        let track = &read.vehicles[0].track;
        assert_eq!(track.t_s.len(), 100);
        assert!((track.t_s[99] - track.t_s[0] - 0.99).abs() < 1e-6);
        // Millimetres, exactly; single precision in the rest.
        assert!((track.position_m[60] - Point3::new(0.3, 0.3, 1.0)).norm() < 1e-12);
        assert!((track.velocity_mps[60] - Vector3::new(0.5, 0.5, 0.0)).norm() < 1e-6);
        let force = track.specific_force_mps2.as_ref().expect("logged")[60];
        assert!(
            (force - Vector3::new(0.0, 0.0, 9.81)).norm() < 1e-5,
            "{force}"
        );
        let duty = track.duty.as_ref().expect("logged")[60];
        for (read, written) in duty.iter().zip([32768.0, 32768.0, 16384.0, 49152.0]) {
            assert!((read - written / 65535.0).abs() < 1e-12);
        }
        // Logged twice a second, and brought to all moments between.
        let volts = track.battery_v.as_ref().expect("logged")[60];
        assert!((volts - 3.9).abs() < 1e-6);
        let mut said = read.remarks.iter().map(|remark| remark.message.as_str());
        let unused = "variables of log07 that are not used: `ctrltarget.x`";
        assert!(said.any(|message| message == unused));
    }
}

#[test]
fn what_is_damaged_is_told_with_its_place() {
    let mut log = flight(2);
    let end = log.len() - CRC_BYTES;
    log[end / 2] ^= 1;
    let said = problem(&log);
    let place = format!("log07: at byte {end}: the checksum is ");
    assert!(said.starts_with(&place), "{said}");
    // Cut within the last event, and closed all the same.
    let cut = flight(1)[..end / 2].to_vec();
    let said = problem(&closed(cut));
    assert!(said.ends_with("the log ends within an event"), "{said}");
    let letter = flight(2);
    let at = letter
        .windows(3)
        .position(|of| of == b"(h)")
        .expect("there")
        + 1;
    let mut letter = letter[..end].to_vec();
    letter[at] = b'x';
    let said = problem(&closed(letter));
    assert_eq!(
        said,
        "log07: at byte 24: `stateEstimateZ.x(x)` has no type that is known"
    );
}

#[test]
fn an_event_of_no_declared_type_is_told_with_its_place() {
    let mut log = flight(2);
    let end = log.len() - CRC_BYTES;
    log.truncate(end);
    log.extend([9, 0, 0, 0]);
    let said = problem(&closed(log));
    let place = format!("log07: at byte {end}: an event of the type 9, which the head lacks");
    assert_eq!(said, place);
}

#[test]
fn a_log_without_a_position_says_what_to_log() {
    let log = [
        &[0xBC, 2, 0, 1, 0, 1, 0, b'e', 0, 1, 0][..],
        b"pm.vbat(f)\0",
    ]
    .concat();
    let said = problem(&closed(log));
    assert_eq!(said, "log07: no event has all three of a position");
}
