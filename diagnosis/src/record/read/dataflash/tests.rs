//! Logs written here, byte by byte after ArduPilot's own declarations
//! (`libraries/AP_Logger/LogStructure.h`, `AP_NavEKF3/LogStructure.h`).

use super::super::read_log;
use super::*;
use crate::record::problem::Problems;
use nalgebra::{Point3, Vector3};

const CAMPAIGN: &str = r#"(
    name: "copter", air: (temperature_c: 20),
    types: { "quad": (mass_kg: Stated(1.5), propeller_diameter_m: Stated(0.25), motor_distance_m: Stated(0.45),
                      rotor_offset_m: Stated((0, 0, 0))) },
    vehicles: { "q1": "quad" },
)"#;

fn read(bytes: &[u8]) -> Result<Recording, Problems> {
    let campaign = Campaign::parse("c.ron", CAMPAIGN).expect("in order");
    read_log("00000007", "00000007.bin", bytes, &campaign)
}

struct Writer(Vec<u8>);

impl Writer {
    fn put(&mut self, kind: u8, payload: &[u8]) {
        self.0.extend([0xA3, 0x95, kind]);
        self.0.extend(payload);
    }

    fn declare(&mut self, kind: u8, length: u8, name: &str, format: &str, labels: &str) {
        let mut payload = vec![0; FMT_BYTES];
        payload[0] = kind;
        payload[1] = length;
        for (from, text) in [(2, name), (6, format), (22, labels)] {
            payload[from..from + text.len()].copy_from_slice(text.as_bytes());
        }
        self.put(FMT, &payload);
    }
}

/// Two seconds from 60 s on: north at 1 m/s, 2 m east, 3 m up, the nose east and up by 10 degrees;
/// a second core and a second battery speak, too.
fn flight() -> Vec<u8> {
    let mut log = Writer(Vec::new());
    log.declare(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
    let xkf1 = "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH";
    log.declare(80, 56, "XKF1", "QBccCfffffffccce", xkf1);
    let att = "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF";
    log.declare(81, 28, "ATT", "QccccCCCCB", att);
    let imu = "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz";
    log.declare(82, 54, "IMU", "QBffffffIIfBBHH", imu);
    let rcou = "TimeUS,C1,C2,C3,C4,C5,C6,C7,C8,C9,C10,C11,C12,C13,C14";
    log.declare(83, 39, "RCOU", "QHHHHHHHHHHHHHH", rcou);
    let bat = "TimeUS,Inst,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct,H,SH";
    log.declare(84, 41, "BAT", "QBfffffcfBBB", bat);
    log.declare(85, 75, "MSG", "QZ", "TimeUS,Message");
    log.put(85, &[0; 72]);
    let floats =
        |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|of| of.to_le_bytes()).collect() };
    for tick in 0..200_u64 {
        let stamp = (60_000_000 + tick * 10_000).to_le_bytes();
        if tick % 4 == 0 {
            for core in [0, 1] {
                let north_m = tick as f32 * 0.01 + 7.0 * f32::from(core);
                let values = floats(&[1.0, 0.0, 0.0, 0.0, north_m, 2.0, -3.0]);
                log.put(
                    80,
                    &[&stamp[..], &[core], &[0; 6], &values, &[0; 10]].concat(),
                );
            }
            // Hundredths of a degree: pitch 10, yaw 90.
            let angles = [0_u16, 0, 0, 1000, 0, 9000, 0, 0]
                .map(u16::to_le_bytes)
                .concat();
            log.put(81, &[&stamp[..], &angles, &[3]].concat());
            let mut pulses = [0_u16; 14];
            pulses[..4].copy_from_slice(&[1400, 1500, 1600, 1700]);
            log.put(
                83,
                &[&stamp[..], &pulses.map(u16::to_le_bytes).concat()].concat(),
            );
        }
        // Level would be 0, 0, -9.81 in the forward-right-down body.
        let tilt = 10_f32.to_radians();
        let felt = floats(&[0.0, 0.0, 0.0, 9.81 * tilt.sin(), 0.0, -9.81 * tilt.cos()]);
        log.put(82, &[&stamp[..], &[0], &felt, &[0; 18]].concat());
        if tick % 100 == 0 {
            for (battery, volts) in [(0, 16.2), (1, 5.0)] {
                log.put(
                    84,
                    &[&stamp[..], &[battery], &floats(&[volts; 5]), &[0; 9]].concat(),
                );
            }
        }
    }
    log.0
}

fn problem(bytes: &[u8]) -> String {
    read(bytes).expect_err("is refused").0[0].to_string()
}

#[test]
fn a_log_of_ardupilot_reads_into_north_west_up() {
    let read = read(&flight()).expect("in order");
    let track = &read.vehicles[0].track;
    assert_eq!(track.t_s.len(), 50);
    // Single precision in the log, of numbers up to 16.
    let single = 2e-6;
    assert!((track.position_m[25] - Point3::new(1.0, -2.0, 3.0)).norm() < single);
    assert!((track.velocity_mps[25] - Vector3::x()).norm() < single);
    let nose = track.attitude[25] * Vector3::x();
    let up = 10_f64.to_radians();
    assert!(
        (nose - Vector3::new(0.0, -up.cos(), up.sin())).norm() < single,
        "{nose}"
    );
    let force = track.specific_force_mps2.as_ref().expect("logged")[25];
    assert!(
        (force - Vector3::new(0.0, 0.0, 9.81)).norm() < 1e-5,
        "{force}"
    );
    let duty = track.duty.as_ref().expect("logged")[25];
    for (read, written) in duty.iter().zip([0.4, 0.5, 0.6, 0.7]) {
        assert!((read - written).abs() < 1e-12);
    }
    let volts = track.battery_v.as_ref().expect("logged")[25];
    assert!((volts - 16.2).abs() < single);
    let said: Vec<&str> = read.remarks.iter().map(|of| of.message.as_str()).collect();
    assert_eq!(
        said,
        [
            "2 messages BAT 1 are not used: another instance is",
            "50 messages XKF1 1 are not used: another instance is",
            "motors from RCOU 1 to 4, taken as pulse widths of 1000 to 2000 us",
        ]
    );
}

#[test]
fn a_log_that_breaks_off_is_read_as_far_as_it_goes() {
    let log = flight();
    let read = read(&log[..log.len() - 5]).expect("in order");
    let gap = read.remarks.iter().find(|of| of.kind == RemarkKind::Gap);
    let at = log.len() - 54;
    let said = format!("at byte {at}: the log ends within a message; what stands before is read");
    assert_eq!(gap.expect("told").message, said);
}

#[test]
fn what_is_damaged_before_anything_is_read_is_told_with_its_place() {
    assert_eq!(
        problem(b"t_s,x_m\n"),
        "00000007.bin: at byte 0: here no message begins"
    );
    let mut unknown = Writer(Vec::new());
    unknown.declare(80, 11, "XKF1", "Qx", "TimeUS,PN");
    let said = "00000007.bin: at byte 0: XKF1.PN is declared of the type `x`, which is not known";
    assert_eq!(problem(&unknown.0), said);
    for length in 0..11 {
        let mut short = Writer(Vec::new());
        short.declare(80, length, "XKF1", "Q", "TimeUS");
        short.put(80, &[0; 20]);
        let said = format!(
            "00000007.bin: at byte 0: XKF1 is declared as {length} bytes, and its fields need 11"
        );
        assert_eq!(problem(&short.0), said);
    }
    let mut stranger = Writer(Vec::new());
    stranger.put(7, &[0; 20]);
    let said = "00000007.bin: at byte 0: a message of the type 7, which none declares";
    assert_eq!(problem(&stranger.0), said);
}

#[test]
fn a_log_without_a_position_is_an_error() {
    let mut log = Writer(Vec::new());
    log.declare(84, 15, "BAT", "Qf", "TimeUS,Volt");
    log.put(84, &[0; 12]);
    let said = "00000007.bin: `XKF1`: is missing: there is no position in this log";
    assert_eq!(problem(&log.0), said);
}

#[test]
fn the_clock_of_gps_says_when_a_log_begins() {
    let mut log = Writer(flight());
    let gps = "TimeUS,I,Status,GMS,GWk,NSats";
    log.declare(90, 20, "GPS", "QBBIHB", gps);
    // Week 2300, 100 s, at 62 s of the log; one without a fix says nothing.
    for (status, week) in [(1, 0_u16), (3, 2300)] {
        let stamp = 62_000_000_u64.to_le_bytes();
        let time = [&100_000_u32.to_le_bytes()[..], &week.to_le_bytes()].concat();
        log.put(90, &[&stamp[..], &[0, status], &time, &[9]].concat());
    }
    let campaign = Campaign::parse("c.ron", CAMPAIGN).expect("in order");
    let mut found = Found::default();
    let bytes = &mut &log.0[..];
    super::super::log::read_into("q", "q.bin", bytes, &campaign, &mut found).expect("in order");
    // 2024-02-04 00:01:40 of GPS is 18 s more than UTC; the log began 62 s before.
    let start = found.starts.expect("a fix");
    assert_eq!(start.at_s, 1_707_004_900.0 - 18.0 - 62.0);
}

#[test]
fn logs_of_one_flight_are_brought_into_the_frame_of_the_first() {
    // The second vehicle took off 20 m to the north, 30 m to the east and 5 m higher.
    let log = |latitude: i32, longitude: i32, altitude_cm: i32| {
        let mut log = Writer(flight());
        log.declare(91, 24, "ORGN", "QBLLe", "TimeUS,Type,Lat,Lng,Alt");
        // Home is somewhere else.
        for (kind, more) in [(1, 5_000_000), (0, 0)] {
            let place = [latitude + more, longitude, altitude_cm].map(i32::to_le_bytes);
            log.put(91, &[&[0; 8][..], &[kind], &place.concat()].concat());
        }
        log.0
    };
    let text = CAMPAIGN.replace(
        r#"vehicles: { "q1": "quad" },"#,
        r#"vehicles: { "q1": "quad", "q2": "quad" }, floor_z_m: 0,
        joined: { "noon": { "q1": "a", "q2": "b" } }, starts_s: { "a": 0, "b": 0 },"#,
    );
    let campaign = Campaign::parse("c.ron", &text).expect("in order");
    for (altitude_cm, higher_m) in [(40_500, 5.0), (30_000, -100.0)] {
        let bytes = [
            log(470_000_000, 80_000_000, 40_000),
            log(470_001_799, 80_003_947, altitude_cm),
        ];
        let logs = [("q1", "a"), ("q2", "b")].into_iter().zip(&bytes);
        let logs = logs.map(|((vehicle, log), bytes)| super::super::JoinedLog {
            vehicle: vehicle.to_owned(),
            log: log.to_owned(),
            file: format!("{log}.bin"),
            bytes: bytes.as_slice(),
        });
        let joined = super::super::read_joined("noon", logs.collect(), &campaign);
        let joined = joined.expect("in order");
        let [first, second] = [0, 1].map(|of| joined.vehicles[of].track.position_m[0]);
        // x north, y west, z up; a ten-millionth of a degree is a centimetre.
        let apart_m = second - first;
        assert!(
            (apart_m - Vector3::new(20.0, -30.0, higher_m)).norm() < 0.02,
            "{apart_m}"
        );
        let said = joined.remarks.iter().map(|of| of.message.as_str());
        let moved: Vec<&str> = said.filter(|of| of.contains("are moved by")).collect();
        let [moved] = moved[..] else {
            panic!("{moved:?}");
        };
        assert_eq!(moved.contains("below the floor"), higher_m < 0.0, "{moved}");
    }
}

#[test]
fn of_a_long_log_every_second_message_is_kept_and_that_is_said() {
    let mut log = Writer(Vec::new());
    log.declare(80, 36, "XKF1", "QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD");
    for tick in 0..300_000_u64 {
        let stamp = (tick * 2_500).to_le_bytes();
        log.put(
            80,
            &[&stamp[..], &[0; 21], &(-3_f32).to_le_bytes()].concat(),
        );
    }
    let recording = read(&log.0).expect("in order");
    assert_eq!(recording.vehicles[0].track.t_s.len(), 150_000);
    let said = |of: &crate::record::remark::Remark| of.message == "XKF1: one entry in 2 is kept";
    assert!(recording.remarks.iter().any(said));
}
