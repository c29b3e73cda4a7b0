//! Logs written here, byte by byte after the format's description (docs.px4.io, "ULog File
//! Format"), and their tables.

use super::super::read_log;
use super::*;
use crate::record::recording::Track;
use nalgebra::{Point3, Vector3};

const CAMPAIGN: &str = r#"(
    name: "px4", air: (temperature_c: 20),
    types: { "quad": (mass_kg: Stated(1.5), propeller_diameter_m: Stated(0.25), motor_distance_m: Stated(0.45),
                      rotor_offset_m: Stated((0, 0, 0))) },
    vehicles: { "q1": "quad" },
)"#;

fn campaign() -> Campaign {
    Campaign::parse("c.ron", CAMPAIGN).expect("in order")
}

/// A log in the making.
struct Log(Vec<u8>);

impl Log {
    /// Magic, version, start time, and flags without any set.
    fn new() -> Log {
        let mut log = Log(b"ULog\x01\x12\x35\x01".to_vec());
        log.0.extend(0_u64.to_le_bytes());
        log.record(b'B', &[0; 40]);
        log
    }

    fn record(&mut self, kind: u8, payload: &[u8]) {
        let size = u16::try_from(payload.len()).expect("short");
        self.0.extend(size.to_le_bytes());
        self.0.push(kind);
        self.0.extend(payload);
    }

    fn formats(&mut self) {
        for format in [
            "vehicle_local_position:uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;bool xy_valid;bool z_valid;uint8_t[6] _padding0;",
            "vehicle_attitude:uint64_t timestamp;float[4] q;",
            "sensor_combined:uint64_t timestamp;float[3] accelerometer_m_s2;",
            "actuator_motors:uint64_t timestamp;float[12] control;",
            "battery_status:uint64_t timestamp;float voltage_v;",
        ] {
            self.record(b'F', format.as_bytes());
        }
    }

    fn subscribe(&mut self, instance: u8, id: u16, topic: &str) {
        let mut payload = vec![instance];
        payload.extend(id.to_le_bytes());
        payload.extend(topic.as_bytes());
        self.record(b'A', &payload);
    }

    fn data(&mut self, id: u16, t_us: u64, floats: &[f32], flags: &[u8]) {
        let mut payload = id.to_le_bytes().to_vec();
        payload.extend(t_us.to_le_bytes());
        for float in floats {
            payload.extend(float.to_le_bytes());
        }
        payload.extend(flags);
        self.record(b'D', &payload);
    }
}

/// Two seconds: north at 1 m/s, 2 m east, 3 m up, level with the nose east; the estimator distrusts
/// itself in the last sample.
fn flight() -> Log {
    flight_with(&[])
}

/// The same, with definitions that it does not use.
fn flight_with(others: &[&str]) -> Log {
    let mut log = Log::new();
    log.formats();
    (others.iter()).for_each(|format| log.record(b'F', format.as_bytes()));
    for (id, topic) in [
        "vehicle_local_position",
        "vehicle_attitude",
        "sensor_combined",
        "actuator_motors",
        "battery_status",
    ]
    .into_iter()
    .enumerate()
    {
        log.subscribe(0, u16::try_from(id).expect("few"), topic);
    }
    log.subscribe(1, 5, "battery_status");
    let half = std::f32::consts::FRAC_1_SQRT_2;
    for tick in 0..200_u64 {
        let t_us = 5_000_000 + tick * 10_000;
        if tick % 2 == 0 {
            let north_m = tick as f32 * 0.01;
            let valid = u8::from(tick < 198);
            log.data(0, t_us, &[north_m, 2.0, -3.0, 1.0, 0.0, 0.0], &[valid, 1]);
        }
        if tick % 5 == 0 {
            // The same attitude with the sign of every other record turned.
            let sign = if tick % 10 == 0 { 1.0 } else { -1.0 };
            log.data(1, t_us + 300, &[sign * half, 0.0, 0.0, sign * half], &[]);
        }
        // One gravity upwards, which is down's opposite, shaken by 1 m/s2 at every other reading.
        let shake = if tick % 2 == 0 { 1.0 } else { -1.0 };
        log.data(2, t_us + 700, &[0.0, 0.0, -9.81 + shake], &[]);
        if tick % 4 == 0 {
            let mut control = [f32::NAN; 12];
            control[..4].copy_from_slice(&[0.4, 0.5, 0.6, 0.7]);
            log.data(3, t_us, &control, &[]);
        }
        if tick % 100 == 0 {
            log.data(4, t_us, &[16.2], &[]);
            log.data(5, t_us, &[5.0], &[]);
        }
    }
    log
}

fn read(log: &[u8]) -> Recording {
    read_log("flight", "flight.ulg", log, &campaign()).expect("in order")
}

fn track(recording: &Recording) -> &Track {
    assert_eq!(recording.vehicles.len(), 1);
    &recording.vehicles[0].track
}

/// Single precision in the log, of numbers up to 16.
const SINGLE: f64 = 2e-6;

fn check(track: &Track) {
    assert_eq!(track.t_s.len(), 99); // the hundredth is not trusted
    assert_eq!(track.t_s[0], 0.0);
    assert!((track.t_s[98] - 1.96).abs() < 1e-9);
    // North, 2 m east is -2 m west, 3 m up.
    assert!((track.position_m[50] - Point3::new(1.0, -2.0, 3.0)).norm() < SINGLE);
    assert!((track.velocity_mps[50] - Vector3::x()).norm() < SINGLE);
    // The nose points east, thrust up.
    assert!((track.attitude[50] * Vector3::x() + Vector3::y()).norm() < SINGLE);
    assert!((track.attitude[50] * Vector3::z() - Vector3::z()).norm() < SINGLE);
    let force = track.specific_force_mps2.as_ref().expect("logged")[50];
    assert!(
        (force - Vector3::new(0.0, 0.0, 9.81)).norm() < SINGLE,
        "{force}"
    );
    let duty = track.duty.as_ref().expect("logged")[50];
    for (read, written) in duty.iter().zip([0.4, 0.5, 0.6, 0.7]) {
        assert!((read - written).abs() < SINGLE);
    }
    let volts = track.battery_v.as_ref().expect("logged")[50];
    assert!((volts - 16.2).abs() < SINGLE);
}

#[test]
fn a_log_of_px4_reads_into_north_west_up() {
    let recording = read(&flight().0);
    check(track(&recording));
    let said: Vec<&str> = recording
        .remarks
        .iter()
        .map(|remark| remark.message.as_str())
        .collect();
    assert_eq!(
        said,
        [
            "2 records of battery_status 1 are not used: another instance is",
            "1 row whose horizontal position the estimator says is not valid",
            "1 row left out: a value is missing or not finite (first NaN)",
        ]
    );
}

#[test]
fn a_log_that_breaks_off_is_read_as_far_as_it_goes_and_lost_data_are_told() {
    let mut log = flight();
    log.record(b'O', &250_u16.to_le_bytes());
    log.data(4, 9_000_000, &[16.0], &[]);
    let cut = &log.0[..log.0.len() - 3];
    let recording = read(cut);
    check(track(&recording));
    let gaps: Vec<&str> = recording
        .remarks
        .iter()
        .filter(|remark| remark.kind == RemarkKind::Gap)
        .map(|remark| remark.message.as_str())
        .collect();
    assert_eq!(
        gaps,
        [
            "the log ends in the middle of a record; what stands before is read",
            "the logger lost data 1 times, 250 ms in all, 250 ms at the longest",
        ]
    );
}

#[test]
fn what_is_no_log_or_has_no_position_is_an_error() {
    for (bytes, said) in [
        (&b"t_s,x_m\n0,1\n"[..], "flight.ulg: is no ULog: "),
        (
            &b"ULog"[..],
            "flight.ulg: is no ULog: it ends in its header",
        ),
    ] {
        let problems = read_log("flight", "flight.ulg", bytes, &campaign())
            .expect_err("is refused")
            .0;
        assert!(problems[0].to_string().starts_with(said), "{}", problems[0]);
    }
    let mut empty = Log::new();
    empty.formats();
    empty.subscribe(0, 4, "battery_status");
    empty.data(4, 0, &[16.0], &[]);
    let problems = read_log("flight", "flight.ulg", &empty.0[..], &campaign())
        .expect_err("is refused")
        .0;
    assert_eq!(
        problems[0].to_string(),
        "flight.ulg: `vehicle_local_position`: is missing: there is no position in this log"
    );
}

#[test]
fn speeds_of_rotors_and_the_clock_of_gps_are_read() {
    for (every, is_read) in [(5, true), (40, false)] {
        let mut log = flight_with(&[
            "esc_report:uint64_t timestamp;int32_t esc_rpm;float esc_voltage;",
            "esc_status:uint64_t timestamp;uint8_t esc_count;esc_report[4] esc;",
            "vehicle_gps_position:uint64_t timestamp;uint64_t time_utc_usec;",
        ]);
        log.subscribe(0, 8, "esc_status");
        log.subscribe(0, 9, "vehicle_gps_position");
        for tick in (0..200_u64).step_by(every) {
            let mut payload = [
                &8_u16.to_le_bytes()[..],
                &(5_000_000 + tick * 10_000).to_le_bytes(),
                &[4],
            ]
            .concat();
            for rpm in [3000_i32, -3000, 3300, -3300] {
                payload.extend(0_u64.to_le_bytes());
                payload.extend(rpm.to_le_bytes());
                payload.extend(16_f32.to_le_bytes());
            }
            log.record(b'D', &payload);
        }
        for utc_us in [0_u64, 1_700_000_001_000_000] {
            let stamps = [6_000_000, utc_us].map(u64::to_le_bytes).concat();
            log.record(b'D', &[&9_u16.to_le_bytes()[..], &stamps].concat());
        }
        let mut found = Found::default();
        let bytes = &mut &log.0[..];
        let read = super::super::log::read_into("f", "f.ulg", bytes, &campaign(), &mut found);
        let recording = read.expect("in order");
        let speeds = track(&recording).rotor_speed_radps.as_ref();
        assert_eq!(speeds.is_some(), is_read, "every {every} ticks");
        if let Some(speeds) = speeds {
            let [first, second, third, _] = speeds[10];
            assert!((first - 3000.0 * std::f64::consts::TAU / 60.0).abs() < 1e-9);
            assert!((second - first).abs() < 1e-9 && (third / first - 1.1).abs() < 1e-9);
        }
        // The log's time begins with its first position, at 5 s.
        assert_eq!(found.starts.expect("of GPS").at_s, 1_700_000_000.0);
    }
}

#[test]
fn with_several_vehicles_the_log_is_that_of_its_name() {
    let two = CAMPAIGN.replace("\"q1\": \"quad\"", "\"q1\": \"quad\", \"q2\": \"quad\"");
    let two = Campaign::parse("c.ron", &two).expect("in order");
    let log = flight().0;
    let recording = read_log("q2", "q2.ulg", &log[..], &two).expect("in order");
    assert_eq!(recording.vehicles[0].id, "q2");
    let problems = read_log("flight", "flight.ulg", &log[..], &two)
        .expect_err("is refused")
        .0;
    assert_eq!(
        problems[0].to_string(),
        "flight.ulg: is of one vehicle, and the campaign has several: `q1`, `q2`"
    );
}

#[test]
fn the_tables_of_ulog2csv_read_like_the_log() {
    let mut files: BTreeMap<String, String> = BTreeMap::new();
    let mut add = |topic: &str, header: &str, line: String| {
        let table = files
            .entry(format!("log_7_{topic}_0.csv"))
            .or_insert_with(|| format!("{header}\n"));
        table.push_str(&line);
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for tick in 0..100_u32 {
        let t_us = 5_000_000 + tick * 20_000;
        let (north_m, valid) = (f64::from(tick) * 0.02, u8::from(tick < 99));
        add(
            "vehicle_local_position",
            "timestamp,ref_timestamp,x,y,z,vx,vy,vz,xy_valid,z_valid",
            format!("{t_us},0,{north_m},2,-3,1,0,0,{valid},1\n"),
        );
        add(
            "vehicle_attitude",
            "timestamp,q[0],q[1],q[2],q[3]",
            format!("{t_us},{half},0,0,{half}\n"),
        );
        add(
            "vehicle_acceleration",
            "timestamp,xyz[0],xyz[1],xyz[2]",
            format!("{t_us},0,0,-9.81\n"),
        );
        add(
            "actuator_outputs",
            "timestamp,noutputs,output[0],output[1],output[2],output[3]",
            format!("{t_us},4,1400,1500,1600,1700\n"),
        );
        add(
            "battery_status",
            "timestamp,voltage_v",
            format!("{t_us},16.2\n"),
        );
        add("cpuload", "timestamp,load", format!("{t_us},0.3\n"));
    }
    let files: BTreeMap<String, Vec<u8>> = files
        .into_iter()
        .map(|(name, text)| (name, text.into_bytes()))
        .collect();
    let recording = read_ulog_tables("log_7", &files, &campaign()).expect("in order");
    check(track(&recording));
    assert!(recording.remarks.iter().any(|remark| remark.message
        == "motors from actuator_outputs 0, taken as pulse widths of 1000 to 2000 us"));
}

#[test]
fn what_positions_count_from_is_where_it_lies_in_a_frame_that_resets_do_not_move() {
    let header = "timestamp,x,y,z,vx,vy,vz,z_reset_counter,delta_z";
    let header =
        format!("{header},xy_reset_counter,delta_xy[0],delta_xy[1],ref_lat,ref_lon,ref_alt");
    let mut position = header + "\n";
    for tick in 0..100_u32 {
        // With its first fix the estimator moves its origin 4 m down and says where that is.
        let row = match tick < 50 {
            true => "0.3,0.2,-3.0,0,0,0,1,0,0,0,0,nan,nan,nan",
            false => "0.3,0.2,-7.0,0,0,0,2,-4,0,0,0,47.5,8.5,431",
        };
        position += &format!("{},{row}\n", tick * 20_000);
    }
    let files = [("log_7_vehicle_local_position_0.csv".into(), position.into())];
    let mut found = Found::default();
    let topics = from_tables(&files.into(), &mut found);
    super::flight("log_7", "log_7", &topics, &campaign(), &mut found).expect("in order");
    let below_m = Vector3::new(0.0, 0.0, -4.0);
    let origin = Origin::new([47.5, 8.5], Some(431.0), below_m);
    assert_eq!(found.origin, origin);
}

#[test]
fn motors_of_another_instance_heights_alone_and_moved_origins_are_read() {
    let mut position =
        String::from("timestamp,x,y,z,vx,vy,vz,xy_valid,z_valid,z_reset_counter,delta_z\n");
    let [mut standing, mut turning] =
        [(); 2].map(|()| String::from("timestamp,output[0],output[1],output[2],output[3]\n"));
    for tick in 0..100_u32 {
        let t_us = tick * 20_000;
        // From the fifty-first on the origin lies 4 m deeper.
        let (z_m, resets, delta_m) = match tick < 50 {
            true => (-3.0, 1, 0.0),
            false => (-7.0, 2, -4.0),
        };
        position += &format!("{t_us},0.3,0.2,{z_m},0,0,0,0,1,{resets},{delta_m}\n");
        standing += &format!("{t_us},0,0,0,0\n");
        let command = 4000 + tick % 10 * 50;
        turning += &format!("{t_us},{command},{command},{command},{command}\n");
    }
    let files = [
        ("vehicle_local_position_0", position),
        ("actuator_outputs_0", standing),
        ("actuator_outputs_1", turning),
    ]
    .map(|(topic, text)| (format!("log_7_{topic}.csv"), text.into_bytes()));
    let recording = read_ulog_tables("log_7", &files.into(), &campaign()).expect("in order");
    let track = track(&recording);
    assert_eq!(track.position_m.len(), 100);
    for at_m in &track.position_m {
        assert!(
            (at_m - Point3::new(0.0, 0.0, 3.0)).norm() < SINGLE,
            "{at_m}"
        );
    }
    let duty = track.duty.as_ref().expect("of instance 1")[0][0];
    assert!((duty - 4000.0 / 8191.0).abs() < SINGLE);
}

#[test]
fn of_two_resets_between_two_rows_the_earlier_is_told_as_unknown_and_makes_a_gap() {
    let mut position =
        String::from("timestamp,x,y,z,vx,vy,vz,xy_valid,z_valid,z_reset_counter,delta_z\n");
    for tick in 0..100_u32 {
        // 255, then past 0 to 1: by an unknown height and by 4 m.
        let row = match tick < 50 {
            true => "0.3,0.2,-3.0,0,0,0,1,1,255,0",
            false => "0.3,0.2,-8.0,0,0,0,1,1,1,-4",
        };
        position += &format!("{},{row}\n", tick * 20_000);
    }
    let files = [("log_7_vehicle_local_position_0.csv".into(), position.into())];
    let recording = read_ulog_tables("log_7", &files.into(), &campaign()).expect("in order");
    let track = track(&recording);
    let is_gap = |pair: &[f64]| pair[1] - pair[0] > track.longest_step_s;
    let gap = track.t_s.windows(2).position(is_gap).expect("a gap");
    assert_eq!(track.position_m[gap].z, 3.0);
    assert_eq!(track.position_m[gap + 1].z, 4.0);
    let said = recording.remarks.iter().map(|remark| &remark.message[..]);
    let said = said.collect::<Vec<_>>().join("\n");
    assert!(said.contains("origin vertically 2 times"), "{said}");
    assert!(
        said.contains("1 row before which the estimator moved"),
        "{said}"
    );
}
