//! Bags that other programs wrote (`diagnosis/logs/make_bags.py`), and what is wrong with others.

use super::super::read_log;
use super::*;
use crate::record::problem::Problems;
use crate::record::recording::Track;

const FOXGLOVE: &[u8] = include_bytes!("../../../../logs/foxglove.mcap");
const LZ4: &[u8] = include_bytes!("../../../../logs/lz4.mcap");
const ROSBAGS: &[u8] = include_bytes!("../../../../logs/rosbags.mcap");
const PLAIN: &[u8] = include_bytes!("../../../../logs/plain.mcap");
/// Times are stamped in nanoseconds, positions are doubles.
const ROUNDING: f64 = 1e-9;

fn campaign(columns: &str) -> Campaign {
    let text = format!(
        r#"(name: "bags", air: (temperature_c: 20), columns: {{ {columns} }},
        types: {{ "cf": (mass_kg: Stated(0.034), propeller_diameter_m: Stated(0.046), motor_distance_m: Stated(0.092),
                         rotor_offset_m: Stated((0, 0, 0))) }},
        vehicles: {{ "cf1": "cf", "cf2": "cf" }})"#
    );
    Campaign::parse("c.ron", &text).expect("in order")
}

const MOTORS: &str = r#""pwm1_u16": "motors.values[0]", "pwm2_u16": "motors.values[1]",
    "pwm3_u16": "motors.values[2]", "pwm4_u16": "motors.values[3]""#;

fn read(bag: &[u8], columns: &str) -> Result<Recording, Problems> {
    read_log("bag", "bag.mcap", bag, &campaign(columns))
}

fn said(recording: &Recording) -> String {
    let remarks = recording.remarks.iter();
    let all: Vec<&str> = remarks.map(|remark| remark.message.as_str()).collect();
    all.join("\n")
}

/// cf1 flies its circle: half a metre of radius, 1 rad/s, its nose along its way.
fn is_on_its_circle(track: &Track) {
    assert_eq!(track.t_s.len(), 100);
    for (row, &t_s) in track.t_s.iter().enumerate() {
        let (sine, cosine) = t_s.sin_cos();
        let (at_m, nose) = (track.position_m[row], track.attitude[row] * Vector3::x());
        assert!((at_m - nalgebra::Point3::new(0.5 * cosine, 0.5 * sine, 1.0)).norm() < ROUNDING);
        assert!((nose - Vector3::new(-sine, cosine, 0.0)).norm() < ROUNDING);
    }
}

#[test]
fn odometry_imu_battery_and_motors_of_a_packed_bag_are_those_that_were_written() {
    for bag in [FOXGLOVE, LZ4] {
        let recording = read(bag, MOTORS).expect("in order");
        let [cf1, cf2] = &recording.vehicles[..] else {
            panic!("two vehicles: {recording:?}");
        };
        let track = &cf1.track;
        is_on_its_circle(track);
        for row in 0..track.t_s.len() {
            // Logged as 0.5 m/s ahead, in the body.
            let ahead_mps = track.attitude[row] * Vector3::new(0.5, 0.0, 0.0);
            assert!((track.velocity_mps[row] - ahead_mps).norm() < ROUNDING);
        }
        let force = track.specific_force_mps2.as_ref().expect("of the IMU");
        assert!(
            (force[30].z - 9.81).abs() < ROUNDING && (force[30].xy().norm() - 0.5).abs() < ROUNDING
        );
        assert_eq!(
            track.battery_v.as_ref().expect("logged")[0],
            f64::from(3.9_f32)
        );
        let duty = track.duty.as_ref().expect("named in columns")[99];
        assert!((duty[3] - 0.53).abs() < 1e-7, "{duty:?}");
        assert!((cf2.track.duty.as_ref().expect("named")[0][3] - 0.54).abs() < 1e-7);
        assert_eq!(cf2.track.position_m[7].z, 2.0);
        let said = said(&recording);
        assert!(
            said.contains("REP 105") && said.contains("no battery"),
            "{said}"
        );
    }
}

#[test]
fn of_a_bag_of_several_the_only_vehicle_of_the_campaign_has_its_own_topics_alone() {
    let mut campaign = campaign("");
    campaign.vehicles.0.retain(|(id, _)| id == "cf2");
    let recording = read_log("bag", "bag.mcap", FOXGLOVE, &campaign).expect("in order");
    let [cf2] = &recording.vehicles[..] else {
        panic!("one vehicle: {recording:?}");
    };
    assert!(cf2.track.position_m.iter().all(|at_m| at_m.z == 2.0));
    let said = said(&recording);
    assert!(said.contains("not used: `/cf1/imu`, `/cf1/odom`"), "{said}");
}

#[test]
fn speeds_of_rotors_are_read_whatever_their_direction() {
    let recording = read(PLAIN, "").expect("in order");
    let track = &recording.vehicles[0].track;
    let speeds = track.rotor_speed_radps.as_ref().expect("of the actuators");
    assert_eq!(speeds[9], [2000.0, 2100.0, 2000.0, 2100.0]);
    assert!(track.duty.is_none(), "an empty array is no motor");
}

#[test]
fn poses_with_names_go_to_their_vehicles() {
    let recording = read(ROSBAGS, "").expect("in order");
    is_on_its_circle(&recording.vehicles[0].track);
    let other = &recording.vehicles[1].track;
    assert!(other.specific_force_mps2.is_some() && other.position_m[0].z == 2.0);
    assert!(
        said(&recording).contains("poses of `wand`"),
        "{}",
        said(&recording)
    );
}

#[test]
fn a_bag_is_told_by_its_first_bytes_and_read_to_where_it_breaks_off() {
    assert_eq!(super::super::log_name("noon", &FOXGLOVE[..8]), Some("noon"));
    let cut = read(&FOXGLOVE[..FOXGLOVE.len() / 2], "").expect("what stands before is read");
    assert!(said(&cut).contains("the bag breaks off: it ends within a record"));
    assert!(cut.vehicles[0].track.t_s.len() < 100);
    let mut damaged = FOXGLOVE.to_vec();
    // Within the first chunk.
    damaged[600] ^= 0xFF;
    let refused = read(&damaged, "").map(|recording| said(&recording));
    let told = format!("{refused:?}");
    assert!(told.contains("chunk"), "{told}");
}

#[test]
fn what_is_not_there_is_said_with_what_is() {
    let text = r#"(name: "b", types: { "cf": (mass_kg: Stated(0.034), propeller_diameter_m: Stated(0.046), motor_distance_m: Stated(0.092)) },
        vehicles: { "uav7": "cf", "uav8": "cf" })"#;
    let strange = Campaign::parse("c.ron", text).expect("in order");
    let Problems(problems) = read_log("b", "b.mcap", FOXGLOVE, &strange).expect_err("no one's");
    let help = problems[0].help.clone().unwrap_or_default();
    assert!(help.contains("/cf1/odom (nav_msgs/Odometry)"), "{help}");
    let Problems(problems) =
        read(FOXGLOVE, r#""vbat_v": "power.values[0]""#).expect_err("no such topic");
    let said = problems[0].to_string();
    assert!(said.contains("`power.values[0]`: is in no topic"), "{said}");
    let Problems(problems) = read(b"\x89MCAP0\r\n", "").expect_err("nothing in it");
    assert!(
        problems[0].to_string().contains("is no bag"),
        "{problems:?}"
    );
}

#[test]
fn a_bag_without_a_campaign_says_whose_positions_it_holds() {
    for (bag, listed) in [
        (FOXGLOVE, r#"vehicles: { "cf1": "drone", "cf2": "drone" }"#),
        (
            ROSBAGS,
            r#"vehicles: { "cf1": "drone", "cf2": "drone", "wand": "drone" }"#,
        ),
    ] {
        let asked = super::super::needed("bag", "bag.mcap", bag);
        assert!(asked.contains(listed), "{asked}");
    }
}

/// A bag of poses: a topic, and how high each of its fifty poses is (m).
fn poses(topics: &[(&str, f64)]) -> Vec<u8> {
    bag_of(topics, &[])
}

/// The same beside topics of empty strings.
fn bag_of(topics: &[(&str, f64)], strings: &[&str]) -> Vec<u8> {
    let rule = "=".repeat(80);
    let definition = [
        "std_msgs/Header header\ngeometry_msgs/Pose pose",
        "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id",
        "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec",
        "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
        "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z",
        "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    ]
    .join(&format!("\n{rule}\n"));
    let mut bag = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new()
        .compression(None)
        .create(&mut bag)
        .expect("begins");
    let of = "geometry_msgs/msg/PoseStamped";
    let schema = writer.add_schema(of, "ros2msg", definition.as_bytes());
    let schema = schema.expect("fits");
    for (topic, height_m) in topics {
        let channel = writer.add_channel(schema, topic, "cdr", &BTreeMap::new());
        let channel_id = channel.expect("fits");
        for tick in 0..50_u32 {
            // Little-endian, a stamp, an empty frame, and doubles at the next multiple of 8.
            let mut data = vec![0, 1, 0, 0];
            data.extend(1_u32.to_le_bytes());
            data.extend((tick * 20_000_000).to_le_bytes());
            data.extend([1, 0, 0, 0, 0, 0, 0, 0]);
            let numbers = [0.0, 0.0, *height_m, 0.0, 0.0, 0.0, 1.0].map(f64::to_le_bytes);
            data.extend(numbers.concat());
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence: tick,
                log_time: 0,
                publish_time: 0,
            };
            writer.write_to_known_channel(&header, &data).expect("fits");
        }
    }
    let schema = writer.add_schema("std_msgs/msg/String", "ros2msg", b"string data");
    let schema = schema.expect("fits");
    for topic in strings {
        let channel = writer.add_channel(schema, topic, "cdr", &BTreeMap::new());
        let header = mcap::records::MessageHeader {
            channel_id: channel.expect("fits"),
            sequence: 0,
            log_time: 0,
            publish_time: 0,
        };
        let data = [0, 1, 0, 0, 1, 0, 0, 0, 0];
        writer.write_to_known_channel(&header, &data).expect("fits");
    }
    writer.finish().expect("ends");
    drop(writer);
    bag.into_inner()
}

#[test]
fn of_two_topics_with_a_place_one_is_taken_not_what_is_asked_for_and_both_are_told() {
    for (topics, height_m, other) in [
        (["goal_pose", "pose"], 2.0, "goal_pose"),
        (["pose", "estimate"], 1.0, "estimate"),
    ] {
        let [first, second] = topics.map(|topic| format!("/cf1/{topic}"));
        let bag = poses(&[(&first, 1.0), (&second, 2.0)]);
        let recording = read(&bag, "").expect("in order");
        assert_eq!(recording.vehicles[0].track.position_m[7].z, height_m);
        let told = format!("its positions are those of `/cf1/pose`, not those of `/cf1/{other}`");
        assert!(said(&recording).contains(&told), "{}", said(&recording));
    }
}

#[test]
fn who_is_a_part_of_topics_that_say_no_place_has_those_without_it_and_a_goal_alone_is_told() {
    let mut campaign = campaign("");
    campaign.vehicles.0.retain(|(id, _)| id == "cf1");
    let read = |topics: &[(&str, f64)]| {
        read_log("bag", "bag.mcap", &poses(topics)[..], &campaign).expect("in order")
    };
    let asks = "`/cf1/goal_pose` asks for: no topic says where it was";
    for (topics, height_m, is_told) in [
        (&[("/pose", 1.0), ("/cf1/goal_pose", 2.0)][..], 1.0, false),
        (&[("/pose", 1.0), ("/cf1/pose", 2.0)], 2.0, false),
        (&[("/cf1/goal_pose", 2.0)], 2.0, true),
    ] {
        let recording = read(topics);
        assert_eq!(recording.vehicles[0].track.position_m[7].z, height_m);
        assert_eq!(said(&recording).contains(asks), is_told, "{topics:?}");
    }
    // Of a type that is not read.
    let with_status = bag_of(&[("/pose", 1.0)], &["/cf1/status"]);
    let recording = read_log("bag", "bag.mcap", &with_status[..], &campaign).expect("in order");
    assert_eq!(recording.vehicles[0].track.position_m[7].z, 1.0);
}
