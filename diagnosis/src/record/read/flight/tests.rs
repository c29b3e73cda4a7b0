//! Small logs written here, sound and spoilt.

use super::super::read_log;
use super::*;
use crate::campaign::hardware::Effort;
use crate::record::remark::Remark;

const CAMPAIGN: &str = r#"(
    name: "two", floor_z_m: 0, acceleration: SpecificForceInWorld, clock: Own(within_s: 0.03), air: (temperature_c: 15),
    types: { "small": (mass_kg: Stated(0.034), propeller_diameter_m: Inferred(0.0462), motor_distance_m: Stated(0.092),
                       rotor_offset_m: Stated((0, 0, 0.01)), touch_z_m: 0.07) },
    vehicles: { "a": "small", "b": "small" },
)"#;

const HEADER: &str = "t_s,vehicle,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,qx,qy,qz,qw,pwm1,pwm2,pwm3,pwm4,vbat_v\n";

fn campaign(text: &str) -> Campaign {
    Campaign::parse("c.ron", text).expect("in order")
}

/// A row of vehicle `a` that hovers 1 m up.
fn row(t_s: f64) -> String {
    format!("{t_s:.3},a,0,0,1,0,0,0,0,0,9.81,0,0,0,1,0.5,0.5,0.5,0.5,3.9\n")
}

/// Fifty rows at 50 Hz, some of them changed.
fn log(changed: &[(usize, &str, &str)]) -> String {
    let mut text = HEADER.to_owned();
    for index in 0..50_u32 {
        let mut line = row(f64::from(index) / 50.0);
        for (_, from, to) in changed.iter().filter(|(at, _, _)| *at == index as usize) {
            assert!(line.contains(from), "{from} in {line}");
            line = line.replacen(from, to, 1);
        }
        text.push_str(&line);
    }
    text
}

fn read(text: &str) -> Recording {
    read_log("f", "f.csv", text.as_bytes(), &campaign(CAMPAIGN)).expect("in order")
}

fn problems(text: &str, metadata: &str) -> Vec<String> {
    let problems = read_log("f", "f.csv", text.as_bytes(), &campaign(metadata));
    let problems = problems.expect_err("is refused").0;
    problems.iter().map(ToString::to_string).collect()
}

/// Remarks on vehicle `a`.
fn on_a(recording: &Recording) -> Vec<&Remark> {
    let of_a = |remark: &&Remark| remark.subject.as_deref() == Some("a");
    recording.remarks.iter().filter(of_a).collect()
}

#[test]
fn a_sound_log_reads_with_nothing_to_remark() {
    let recording = read(&log(&[]));
    assert_eq!(recording.remarks, []);
    let [a] = recording.vehicles.as_slice() else {
        panic!("one vehicle");
    };
    assert_eq!(a.track.t_s.len(), 50);
    assert_eq!(a.track.position_m[7].z, 1.01); // the rotor offset added
    assert_eq!(a.track.duty.as_ref().map(|duty| duty[3]), Some([0.5; 4]));
    assert_eq!(a.clock, Clock::Own { within_s: 0.03 });
    assert_eq!(recording.environment.air.pressure_pa, 101_325.0);
}

#[test]
fn rows_with_values_that_cannot_be_are_left_out_counted_and_told() {
    let cases = [
        (
            "0.5,0.5,0.5,0.5",
            "0.5,1.04,0.5,0.5",
            "1 row left out: a duty cycle outside 0 to 1 (first 1.0400)",
        ),
        (
            "3.9",
            "0",
            "1 row left out: a battery voltage outside 0 to 100 V (first 0.0000)",
        ),
        (
            "0,0,0,1,0.5",
            "0,0,0,1.03,0.5",
            "1 row left out: the quaternion's norm is not 1 within 2 % (first 1.0300)",
        ),
        (
            "a,0,0,1",
            "a,20000,0,1",
            "1 row left out: a coordinate beyond 10 km (first 20000.0000)",
        ),
        (
            "a,0,0,1",
            "a,0,0,-1",
            "1 row left out: more than 0.2 m below the floor (first -1.0000)",
        ),
        (
            "a,0,0,1",
            "a,nan,0,1",
            "1 row left out: a value is missing or not finite (first NaN)",
        ),
        (
            "9.81",
            "",
            "1 row left out: a value is missing or not finite (first NaN)",
        ),
        (
            "1,0,0,0,0,0,9.81",
            "1,0,400,0,0,0,9.81",
            "1 row left out: a velocity beyond 100 m/s (first 400.0000)",
        ),
        (
            "9.81",
            "9810",
            "1 row left out: an acceleration beyond 500 m/s2 (first 9810.0000)",
        ),
    ];
    for (from, to, said) in cases {
        let recording = read(&log(&[(20, from, to)]));
        let [remark] = on_a(&recording)[..] else {
            panic!("one remark for {to}: {:?}", recording.remarks);
        };
        assert_eq!(remark.message, said);
        assert_eq!(remark.span_s, Some((0.4, 0.4)));
        assert_eq!(remark.kind, RemarkKind::Impossible);
        assert_eq!(recording.vehicles[0].track.t_s.len(), 49);
    }
}

#[test]
fn where_rotors_tell_the_thrust_a_spoilt_battery_costs_no_row() {
    let header = HEADER.replace("vbat_v", "vbat_v,rpm1,rpm2,rpm3,rpm4");
    for (from, to, of) in [
        ("3.9", "0", "battery"),
        ("0.5", "1.5", "duty"),
        ("3.9", "", "battery"),
    ] {
        let spoilt = log(&[(20, &format!(",{from}"), &format!(",{to}"))]);
        let rows = spoilt
            .replace(HEADER, "")
            .replace('\n', ",20000,20000,20000,20000\n");
        let recording = read(&format!("{header}{rows}"));
        let track = &recording.vehicles[0].track;
        assert_eq!(track.t_s.len(), 50);
        let (duty, battery_v) = (track.duty.as_ref(), track.battery_v.as_ref());
        let of_duty = duty.expect("is kept").iter().map(|of| of.iter().sum());
        let rows: Vec<f64> = match of {
            "duty" => of_duty.collect(),
            _ => battery_v.expect("is kept").clone(),
        };
        let faulty: Vec<usize> = (0..50).filter(|&row| !rows[row].is_finite()).collect();
        assert_eq!(faulty, [20]);
        let remark = on_a(&recording)[0];
        let said = &remark.message;
        assert!(said.contains("that can be: left out alone"), "{said}");
        assert_eq!((remark.samples, remark.span_s), (1, Some((0.4, 0.4))));
    }
}

#[test]
fn one_glitch_of_the_battery_or_a_duty_cycle_costs_a_flight_no_more_than_its_row_of_hover() {
    let header = HEADER.replace("vbat_v", "vbat_v,rpm1,rpm2,rpm3,rpm4");
    for (from, to) in [(",3.9", ",0"), ("0.5,3.9", "1.5,3.9"), (",3.9", ",")] {
        let rows = (0..150_u32).map(|index| match index {
            20 => row(0.4).replacen(from, to, 1),
            _ => row(f64::from(index) / 50.0),
        });
        let rows: String = rows.collect();
        let rows = rows.replace('\n', ",20000,20000,20000,20000\n");
        let effort = Effort::of(&read(&format!("{header}{rows}"))).expect("it hovers");
        assert_eq!(effort.rows, 149);
        assert!((effort.volts[3] - 0.5 * 3.9).abs() < 1e-12, "{effort:?}");
    }
}

#[test]
fn columns_that_others_stand_for_are_told() {
    let header = HEADER.replace("vbat_v", "vbat_v,thrust_n,rpm1,rpm2,rpm3,rpm4,roll_deg");
    let rows = log(&[]).replace(HEADER, "");
    let rows = rows.replace('\n', ",0.3,20000,20000,20000,20000,0\n");
    let recording = read(&format!("{header}{rows}"));
    let said: Vec<&str> = (on_a(&recording).iter())
        .map(|remark| &remark.message[..])
        .collect();
    assert_eq!(
        said,
        [
            "roll, pitch and yaw are not used: there is a quaternion",
            "its force is told by speeds of rotors, not by thrust",
        ]
    );
    // Without a force to be told there are the motors to be judged.
    let rows = rows.replace("0,0,9.81,", "");
    let recording = read(&format!(
        "{}{rows}",
        header.replace("ax_mps2,ay_mps2,az_mps2,", "")
    ));
    let is_of_force = |remark: &&Remark| remark.message.contains("force is told");
    assert_eq!(on_a(&recording).into_iter().find(is_of_force), None);
}

#[test]
fn times_that_repeat_or_go_back_are_left_out_and_one_leap_does_not_take_the_rest_with_it() {
    for (at, from, to) in [
        (10, "0.200", "0.180"),
        (10, "0.200", "0.100"),
        (10, "0.200", "900"),
        (0, "0.000", "900"),
        (1, "0.020", "-900"),
        (10, "0.200", ""),
    ] {
        let recording = read(&log(&[(at, from, to)]));
        assert_eq!(
            on_a(&recording)[0].message,
            "1 row left out: their time is missing, repeats or goes back",
            "{to}"
        );
        assert_eq!(recording.vehicles[0].track.t_s.len(), 49, "{to}");
    }
}

#[test]
fn gaps_and_uneven_steps_are_told_with_count_and_longest() {
    let rows = |times: &[f64]| {
        let rows: String = times.iter().map(|&t_s| row(t_s)).collect();
        read(&format!("{HEADER}{rows}"))
    };
    let holed: Vec<f64> = (0..60)
        .map(|i| f64::from(i) / 50.0)
        .filter(|t| !(0.41..0.49).contains(t))
        .collect();
    let recording = rows(&holed);
    assert_eq!(
        on_a(&recording)[0].message,
        "1 row with a gap after them, the longest of 0.100 s at 0.40 s (the median step is 0.020 s); nothing is interpolated across them"
    );
    assert!((recording.vehicles[0].track.longest_step_s - 0.06).abs() < 1e-9);
    let uneven: Vec<f64> = (0..60)
        .map(|i| f64::from(i) / 50.0 + if i % 9 == 0 { 0.008 } else { 0.0 })
        .collect();
    let recording = rows(&uneven);
    let [remark] = on_a(&recording)[..] else {
        panic!("one remark");
    };
    assert_eq!(remark.kind, RemarkKind::UnevenSteps);
    assert_eq!(
        remark.message,
        "13 rows with uneven steps, 0.012 to 0.028 s (the median is 0.020 s)"
    );
}

#[test]
fn touches_of_the_floor_are_cut_and_told_by_span() {
    let low: Vec<(usize, &str, &str)> = (0..5)
        .chain(30..33)
        .map(|at| (at, "a,0,0,1", "a,0,0,0.05"))
        .collect();
    let recording = read(&log(&low));
    let [remark] = on_a(&recording)[..] else {
        panic!("one remark");
    };
    assert_eq!(remark.kind, RemarkKind::Touch);
    assert_eq!(
        remark.message,
        "8 rows cut: on the floor or touching it (below 0.07 m) at 0.00-0.08, 0.60-0.64 s"
    );
    assert_eq!(recording.vehicles[0].track.t_s.len(), 42);
}

#[test]
fn a_crash_is_cut_from_half_a_second_before() {
    // Upside down from row 40 on.
    let upside_down: Vec<(usize, &str, &str)> = (40..50)
        .map(|at| (at, "0,0,0,1,0.5", "1,0,0,0,0.5"))
        .collect();
    let recording = read(&log(&upside_down));
    let [remark] = on_a(&recording)[..] else {
        panic!("one remark");
    };
    assert_eq!(remark.kind, RemarkKind::Touch);
    assert_eq!(
        remark.message,
        "34 rows cut, from 0.5 s before the tilt passes 45 deg at 0.80 s: a crash"
    );
    assert_eq!(recording.vehicles[0].track.t_s.last(), Some(&0.3));
}

#[test]
fn frozen_positions_and_motors_at_full_are_told_and_kept() {
    let moving: Vec<(usize, &str, &str)> =
        (20..35).map(|at| (at, "1,0,0,0", "1,0.5,0,0")).collect();
    let recording = read(&log(&moving));
    assert_eq!(on_a(&recording)[0].kind, RemarkKind::Stuck);
    let recording = read(&log(&[(20, "0.5,0.5,0.5,0.5", "0.5,1,0.5,0.5")]));
    assert_eq!(
        on_a(&recording)[0].message,
        "1 row with a motor at full duty cycle; kept"
    );
    assert_eq!(recording.vehicles[0].track.t_s.len(), 50);
}

#[test]
fn a_vehicle_that_never_flies_is_told_and_one_without_a_usable_row_is_an_error() {
    let stands: String = (0..9)
        .map(|i| row(f64::from(i) / 50.0).replace(",a,0,0,1", ",b,0,0,0.05"))
        .collect();
    let recording = read(&format!("{}{stands}", log(&[])));
    let ids: Vec<&str> = recording
        .vehicles
        .iter()
        .map(|vehicle| vehicle.id.as_str())
        .collect();
    assert_eq!(ids, ["a"]);
    assert!(
        recording
            .remarks
            .iter()
            .any(|remark| remark.message == "never left the floor: not part of the recording")
    );
    let nowhere: String = (0..9)
        .map(|i| row(f64::from(i) / 50.0).replace(",a,0,", ",b,,"))
        .collect();
    assert_eq!(
        problems(&format!("{}{nowhere}", log(&[])), CAMPAIGN),
        ["f.csv: no row of vehicle `b` can be used"]
    );
}

#[test]
fn unknown_vehicles_are_errors_that_name_the_known() {
    let text = format!("{}{}", log(&[]), row(0.0).replace(",a,", ",c,"));
    let problems =
        read_log("f", "f.csv", text.as_bytes(), &campaign(CAMPAIGN)).expect_err("is refused");
    assert_eq!(
        problems.0[0].to_string(),
        "f.csv:52: vehicle `c` is not in the metadata (1 rows)"
    );
    assert_eq!(problems.0[0].help.as_deref(), Some("known are `a`, `b`"));
}

#[test]
fn what_the_metadata_leave_open_is_an_error_or_said() {
    let no_kind = CAMPAIGN.replace("acceleration: SpecificForceInWorld, ", "");
    assert_eq!(
        problems(&log(&[]), &no_kind),
        ["f.csv:1: `ax_mps2`: is an acceleration, and the metadata do not say of which kind"]
    );
    let no_column = log(&[]).replace("vehicle", "who");
    assert_eq!(
        problems(&no_column, CAMPAIGN),
        ["f.csv:1: `vehicle`: is missing, and the campaign has several vehicles: `a`, `b`"]
    );
    let half = log(&[]).replace("pwm4", "m4").replace("vz_mps", "climb");
    assert_eq!(
        problems(&half, CAMPAIGN),
        [
            "f.csv:1: has the columns `vx_mps`, `vy_mps` but none for `vz`",
            "f.csv:1: has the columns `pwm1`, `pwm2`, `pwm3` but none for `pwm4`",
        ]
    );
    let open = CAMPAIGN
        .replace("air: (temperature_c: 15),", "")
        .replace("Stated(0.034)", "Assumed(0.034)")
        .replace("rotor_offset_m: Stated((0, 0, 0.01)),", "");
    let recording =
        read_log("f", "f.csv", log(&[]).as_bytes(), &campaign(&open)).expect("in order");
    let said: Vec<&str> = recording
        .remarks
        .iter()
        .map(|remark| remark.message.as_str())
        .collect();
    assert_eq!(
        said,
        [
            "its mass is assumed: 0.034 kg",
            "the logged point is taken as the centre of the rotor plane",
            "the air is not stated: taken as 20 °C and 101325 Pa",
        ]
    );
}

#[test]
fn angles_in_degrees_that_say_radians_are_refused() {
    let metadata = CAMPAIGN.replace(", \"b\": \"small\"", "");
    let said = |angles: &str| {
        let row = |tick: u32| format!("{},0,0,1,{angles}\n", 0.02 * f64::from(tick));
        let rows: String = (0..50).map(row).collect();
        let text = format!("t_s,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad\n{rows}");
        let read = read_log("f", "f.csv", text.as_bytes(), &campaign(&metadata));
        read.map(|_| String::new())
            .unwrap_or_else(|problems| problems.to_string())
    };
    assert_eq!(said("0.1,0.1,3.1"), "");
    assert!(said("0.1,0.1,90").contains("its yaw begins at 90.00 rad"));
    for tilt in ["3.6,0,0", "0,-3.6,0"] {
        let said = said(tilt);
        assert!(said.contains("no row of vehicle `a` can be used"), "{said}");
    }
}

#[test]
fn one_vehicle_needs_no_column_and_units_are_those_of_the_names() {
    let metadata = CAMPAIGN.replace(", \"b\": \"small\"", "").replace(
        "SpecificForceInWorld",
        "GravityRemovedInWorld, columns: { \"t_ms\": \"time\" }",
    );
    let text = "time,x_mm,y_mm,z_mm,ax_g,ay_g,az_g,roll_deg,yaw_deg\n0,0,0,1000,0,0,0.1,0,90\n20,0,0,1000,0,0,0.1,0,90\n";
    let recording =
        read_log("f", "f.csv", text.as_bytes(), &campaign(&metadata)).expect("in order");
    let track = &recording.vehicles[0].track;
    assert_eq!(track.t_s, [0.0, 0.02]);
    assert!((track.position_m[0].z - 1.01).abs() < 1e-12);
    // A tenth of a gravity upwards on top of the one that was taken off.
    let force = track.specific_force_mps2.as_ref().expect("logged")[0];
    assert!((force - Vector3::new(0.0, 0.0, 1.1 * 9.81)).norm() < 1e-12);
    // A quarter turn to the left.
    assert!((track.attitude[0] * Vector3::x() - Vector3::y()).norm() < 1e-12);
    assert!(
        on_a(&recording)
            .iter()
            .any(|remark| remark.message == "pitch is not logged: taken as 0")
    );
}

#[test]
fn a_published_thrust_map_is_taken_over_in_newtons() {
    let map = "thrust_map: (terms: [(thrust: GramForce(10)), (duty_power: 2, battery_power: 1, thrust: Newtons(0.2))], battery_reference_v: 4.2, lag_s: 0.04, duty_range: (0.12, 0.96)), touch_z_m";
    let metadata = CAMPAIGN.replace("touch_z_m", map);
    let recording =
        read_log("f", "f.csv", log(&[]).as_bytes(), &campaign(&metadata)).expect("in order");
    assert!(recording.vehicles[0].thrust_map.is_some());
    // It takes duty cycles, and nothing else.
    let header = HEADER.replace("vbat_v", "vbat_v,rpm1,rpm2,rpm3,rpm4");
    let rows = log(&[]).replace(HEADER, "");
    let of_rotors = header + &rows.replace('\n', ",20000,20000,20000,20000\n");
    let recording = read_log("f", "f.csv", of_rotors.as_bytes(), &campaign(&metadata));
    let recording = recording.expect("in order");
    assert_eq!(recording.vehicles[0].thrust_map, None);
    let is_told = |remark: &&Remark| remark.message.starts_with("its thrust map is not used");
    assert!(on_a(&recording).iter().any(is_told));
    let metadata = metadata.replace("(0.12, 0.96)", "(0.96, 0.12)");
    let problems = Campaign::parse("c.ron", &metadata).expect_err("is refused");
    assert!(
        problems.0[0]
            .to_string()
            .starts_with("c.ron:3: `types`: thrust map of `small`: "),
        "{problems}"
    );
}
