//! `plan export` as a person or a script meets it. What is written is read here by hand, without
//! the crate that wrote it.

use std::fs;
use std::path::Path;

use super::run;
use serde_json::{Value, json};

/// A straight flight after a wait with a stop in it, a smooth one, and one that stays.
fn plan() -> Value {
    // Jerk of 3/8 m/s3, its opposite twice, and itself, for 2 s each; then 2 s at rest.
    let up = |x: f64| json!([x, 9.0, 2.0 + (x - 2.0) / 5.0]);
    let inner = |[b, c]: [f64; 2]| json!([up(b), up(c)]);
    let places = [2.0, 2.5, 5.0, 7.5, 8.0, 8.0].map(up);
    let smooth = json!({
        "t_s": [0, 2, 4, 6, 8, 10],
        "position_m": places,
        "control_m": [inner([2.0, 2.0]), inner([3.0, 4.0]), inner([6.0, 7.0]), inner([8.0, 8.0]), json!([])],
    });
    let straight = json!({
        "t_s": [1.5, 4.5, 5.5, 9.5], "position_m": [[2, 2, 2], [5, 2, 2], [5, 2, 2], [5, 6, 2]],
    });
    let stays = json!({"t_s": [0], "position_m": [[15, 15, 1]]});
    fleet(&[("straight", straight), ("smooth", smooth), ("stays", stays)])
}

fn fleet(drones: &[(&str, Value)]) -> Value {
    let drone = |(name, trajectory): &(&str, Value)| json!({"name": name, "airframe": "crazyflie-2.1", "trajectory": trajectory});
    let drones: Vec<Value> = drones.iter().map(drone).collect();
    json!({
        "format": "plan/1", "scenario": "test",
        "bounds_m": {"min": [0, 0, 0], "max": [40, 20, 8]}, "drones": drones,
    })
}

/// Where the smooth one is (m).
fn smooth_m(t_s: f64) -> [f64; 3] {
    let speeds_up_m = |s: f64| match s {
        s if s < 1.0 => 0.5 * s.powi(3),
        s => 0.5 + 1.5 * (s - 1.0) + 1.5 * (s - 1.0).powi(2) - 0.5 * (s - 1.0).powi(3),
    };
    let along_m = match t_s.min(8.0) / 2.0 {
        s if s < 2.0 => speeds_up_m(s),
        s => 6.0 - speeds_up_m(4.0 - s),
    };
    [2.0 + along_m, 9.0, 2.0 + along_m / 5.0]
}

fn straight_m(t_s: f64) -> [f64; 3] {
    let (along, across) = ((t_s - 1.5).clamp(0.0, 3.0), (t_s - 5.5).clamp(0.0, 4.0));
    [2.0 + along, 2.0 + across, 2.0]
}

fn desk(plan: &Value) -> tempfile::TempDir {
    let desk = tempfile::tempdir().unwrap();
    fs::write(desk.path().join("plan.json"), plan.to_string()).unwrap();
    desk
}

/// The numbers below the header of a table.
fn table(path: &Path) -> (String, Vec<Vec<f64>>) {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap().to_owned();
    let row = |line: &str| line.split(',').map(|it| it.parse().unwrap()).collect();
    (header, lines.map(row).collect())
}

fn assert_near(said: [f64; 3], expected: [f64; 3], within: f64, what: &str) {
    for (a, b) in said.into_iter().zip(expected) {
        assert!((a - b).abs() <= within, "{what}: {said:?} {expected:?}");
    }
}

#[test]
fn where_a_scenario_lies_its_exports_lie() {
    let mut lies = plan();
    lies["origin"] = json!({
        "latitude_deg": 47.4, "longitude_deg": 8.5, "altitude_m": 488.0, "heading_deg": 30.0
    });
    let (told, stated) = (desk(&plan()), desk(&lies));
    let at = " --georeference 47.4,8.5,488,30";
    for (to, file) in [("setpoints", "smooth.csv"), ("czml", "plan.czml")] {
        let line = format!("export plan.json --to {to} --out o-{to}");
        let (code, _, errors) = run(told.path(), &format!("{line}{at}"));
        assert_eq!(code, Some(0), "{errors}");
        let (code, said, errors) = run(stated.path(), &line);
        assert_eq!(code, Some(0), "{errors}");
        assert!(!said.contains("no --georeference"), "{said}");
        let [one, other] = [&told, &stated].map(|it| {
            let text = fs::read_to_string(it.path().join(format!("o-{to}/{file}"))).unwrap();
            // The id of the plan is of all its bytes.
            let lines = text.lines().filter(|line| !line.contains("plan"));
            lines.map(str::to_owned).collect::<Vec<_>>()
        });
        assert_eq!(one, other, "{to}");
    }
    lies["origin"]["latitude_deg"] = json!(91);
    let nowhere = desk(&lies);
    let (code, _, errors) = run(nowhere.path(), "export plan.json --to setpoints --out o");
    assert_eq!(code, Some(2), "{errors}");
    assert!(
        errors.contains("`origin` of the plan: the latitude"),
        "{errors}"
    );
}

#[test]
fn setpoints_are_the_plan_in_ned_and_in_enu_with_velocity_and_acceleration() {
    let desk = desk(&plan());
    let folder = desk.path();
    // Heading, axes, and what (x, y, z) is there.
    type Seen = fn([f64; 3]) -> [f64; 3];
    let cases: [(&str, &str, Seen); 4] = [
        ("", "ned", |[x, y, z]| [y, x, -z]),
        ("", "enu", |at| at),
        (" --georeference 47.4,8.5,488,0", "ned", |[x, y, z]| {
            [x, -y, -z]
        }),
        (" --georeference -33.9,-70.1,500,180", "enu", |[x, y, z]| {
            [y, -x, z]
        }),
    ];
    for (georeference, frame, seen) in cases {
        let line = format!(
            "export plan.json --to setpoints --frame {frame}{georeference} --rate 10 --out o"
        );
        let (code, told, errors) = run(folder, &line);
        assert_eq!(code, Some(0), "{told}{errors}");
        assert_eq!(told.contains("no --georeference"), georeference.is_empty());
        for (name, at_m) in [
            ("smooth", smooth_m as fn(f64) -> [f64; 3]),
            ("straight", straight_m),
        ] {
            let (header, rows) = table(&folder.join(format!("o/{name}.csv")));
            let first = if frame == "ned" {
                "t_s,n_m,e_m,d_m,"
            } else {
                "t_s,x_m,y_m,z_m,"
            };
            assert!(header.starts_with(first), "{header}");
            let last_s = if name == "smooth" { 10.0 } else { 9.5 };
            assert_eq!(rows.last().unwrap()[0], last_s);
            for (k, row) in rows.iter().enumerate() {
                let t_s = k as f64 / 10.0;
                assert!((row[0] - t_s).abs() < 1e-6);
                assert_near([row[1], row[2], row[3]], seen(at_m(t_s)), 2e-6, name);
                if name == "smooth" && t_s > 0.1 && t_s < 7.9 {
                    let [early, late] = [t_s - 1e-3, t_s + 1e-3].map(|it| seen(at_m(it)));
                    let speed = [0, 1, 2].map(|k| (late[k] - early[k]) / 2e-3);
                    assert_near([row[4], row[5], row[6]], speed, 1e-5, "velocity");
                    let now = seen(at_m(t_s));
                    let bend = [0, 1, 2].map(|k| (late[k] - 2.0 * now[k] + early[k]) / 1e-6);
                    assert_near([row[7], row[8], row[9]], bend, 1e-3, "acceleration");
                }
            }
        }
    }
    // From each drone's own start.
    let (code, ..) = run(
        folder,
        "export plan.json --to setpoints --origin own --frame enu --out o",
    );
    assert_eq!(code, Some(0));
    let (_, rows) = table(&folder.join("o/straight.csv"));
    assert_eq!(rows[0][1..4], [0.0; 3]);
    assert_eq!(rows.last().unwrap()[1..4], [3.0, 4.0, 0.0]);
}

#[test]
fn crazyswarm_files_hold_the_plan_s_own_polynomials_and_the_crazyflie_s_bytes() {
    let desk = desk(&plan());
    let folder = desk.path();
    let (code, told, errors) = run(
        folder,
        "export plan.json --to crazyswarm --out o --format json",
    );
    assert_eq!(code, Some(0), "{told}{errors}");
    let told: Value = serde_json::from_str(&told).unwrap();
    assert!(told["deviation"]["largest_m"].as_f64().unwrap() < 0.002);
    for (name, at_m) in [
        ("smooth", smooth_m as fn(f64) -> [f64; 3]),
        ("straight", straight_m),
        ("stays", |_| [15.0, 15.0, 1.0]),
    ] {
        let (_, rows) = table(&folder.join(format!("o/{name}.csv")));
        // One row is no table to the format's own reader.
        assert!(rows.len() >= 2 && rows.iter().all(|row| row.len() == 33));
        let mut since_s = 0.0;
        for row in rows {
            for k in 0..=20 {
                let t_s = row[0] * f64::from(k) / 20.0;
                let value = |axis: usize| {
                    let powers = row[1 + 8 * axis..9 + 8 * axis].iter();
                    powers.rev().fold(0.0, |sum, a| sum * t_s + a)
                };
                assert_near([0, 1, 2].map(value), at_m(since_s + t_s), 1e-8, name);
            }
            since_s += row[0];
        }
    }
    // (15, 15, 1) m, yaw 0; constant for 1000 ms; the end.
    let bytes = fs::read(folder.join("o/stays.cfpoly")).unwrap();
    let expected = [0x98, 0x3A, 0x98, 0x3A, 0xE8, 3, 0, 0, 0, 0xE8, 3, 0, 0, 0];
    assert_eq!(bytes, expected);
    // (2, 2, 2); constant 1.5 s; x straight to 5 in 3 s; constant 1 s; y straight to 6 in 4 s.
    let bytes = fs::read(folder.join("o/straight.cfpoly")).unwrap();
    let expected = [
        0xD0, 7, 0xD0, 7, 0xD0, 7, 0, 0, 0, 0xDC, 5, 1, 0xB8, 0x0B, 0x88, 0x13, 0, 0xE8, 3, 4,
        0xA0, 0x0F, 0x70, 0x17, 0, 0, 0,
    ];
    assert_eq!(bytes, expected);
    // Four cubics of 2 s along x and z; constant for 2 s.
    let bytes = fs::read(folder.join("o/smooth.cfpoly")).unwrap();
    let mut expected = Vec::new();
    let put = |to: &mut Vec<u8>, all: &[i16]| {
        all.iter().for_each(|it| to.extend(it.to_le_bytes()));
    };
    put(&mut expected, &[2000, 9000, 2000, 0]);
    for (x, z) in [
        ([2000, 2000, 2500], [2000, 2000, 2100]),
        ([3000, 4000, 5000], [2200, 2400, 2600]),
        ([6000, 7000, 7500], [2800, 3000, 3100]),
        ([8000, 8000, 8000], [3200, 3200, 3200]),
    ] {
        expected.extend([0b10_00_10, 0xD0, 0x07]);
        put(&mut expected, &x);
        put(&mut expected, &z);
    }
    expected.extend([0, 0xD0, 0x07, 0, 0, 0]);
    assert_eq!(bytes, expected);
}

#[test]
fn a_skybrush_show_holds_the_plan_and_each_binary_file_its_checksum() {
    let desk = desk(&plan());
    let folder = desk.path();
    let line = "export plan.json --to skybrush --georeference 47.4,-8.55,488,30 --out o";
    let (code, told, errors) = run(folder, line);
    assert_eq!(code, Some(0), "{told}{errors}");
    let show = fs::read(folder.join("o/show.skyc")).unwrap();
    let (first, last) = (show[..4].to_vec(), show.len());
    assert!(first == *b"PK\x03\x04" && last > 500);
    let bytes = fs::read(folder.join("o/stays.skyb")).unwrap();
    // Version 2 with a checksum; a trajectory of 12 bytes: unit 1 mm, (15, 15, 1), 1000 ms.
    assert_eq!(&bytes[..6], b"skyb\x02\x01");
    let body = [
        1, 12, 0, 1, 0x98, 0x3A, 0x98, 0x3A, 0xE8, 3, 0, 0, 0, 0xE8, 3,
    ];
    assert_eq!(&bytes[10..25], body);
    assert!(String::from_utf8_lossy(&bytes[28..]).ends_with("/stays"));
    // The polynomial's remainder, of the file with 0 in place of its checksum.
    let mut rest = 0_u32;
    for (k, byte) in bytes.iter().enumerate() {
        for bit in 0..8 {
            let one = !(6..10).contains(&k) && byte >> bit & 1 == 1;
            let carry = (rest & 1 == 1) != one;
            rest = rest >> 1 ^ if carry { 0xEDB8_8320 } else { 0 };
        }
    }
    assert_eq!(bytes[6..10], rest.to_le_bytes());
    // Farther than whole millimetres count: in steps of two.
    fs::write(
        folder.join("plan.json"),
        fleet(&[("far", zigzag(3, 35.0))]).to_string(),
    )
    .unwrap();
    let (code, told, _) = run(folder, "export plan.json --to skybrush --out o");
    assert_eq!(code, Some(0));
    assert!(
        told.contains("multiples of up to 2 mm") && told.contains("indoor"),
        "{told}"
    );
    assert!(!folder.join("o/stays.skyb").exists());
}

#[test]
fn a_czml_lies_where_its_georeference_says_and_an_mcap_names_its_schema() {
    let desk = desk(&plan());
    let folder = desk.path();
    // x points north, and 0 lies on the equator: a degree is 110 574 m along, 111 319.5 m across.
    let line = "export plan.json --to czml --georeference 0,7,100,0 --out c --format json";
    let (code, told, errors) = run(folder, line);
    assert_eq!(code, Some(0), "{told}{errors}");
    let told: Value = serde_json::from_str(&told).unwrap();
    // Between two points a tenth of a second apart.
    assert!(
        told["deviation"]["largest_m"].as_f64().unwrap() < 0.002,
        "{told}"
    );
    let text = fs::read_to_string(folder.join("c/plan.czml")).unwrap();
    let packets: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(packets.as_array().unwrap().len(), 4);
    let packet = &packets[1];
    assert_eq!(packet["name"], "straight");
    let degrees = packet["position"]["cartographicDegrees"]
        .as_array()
        .unwrap();
    let degrees: Vec<f64> = degrees.iter().map(|it| it.as_f64().unwrap()).collect();
    for four in degrees.chunks(4) {
        let [x, y, z] = straight_m(four[0]);
        let seen = [
            four[2] * 110_574.3,
            (7.0 - four[1]) * 111_319.5,
            four[3] - 100.0,
        ];
        assert_near(seen, [x, y, z], 3e-4, "czml");
    }
    let (code, told, errors) = run(folder, "export plan.json --to mcap --out m");
    assert_eq!(code, Some(0), "{told}{errors}");
    let bytes = fs::read(folder.join("m/scene.mcap")).unwrap();
    assert!(bytes.starts_with(b"\x89MCAP0\r\n") && bytes.ends_with(b"\x89MCAP0\r\n"));
    let text = String::from_utf8_lossy(&bytes);
    for said in [
        "foxglove.SceneUpdate",
        "jsonschema",
        "/leeward/scene",
        "\"key\":\"name\",\"value\":\"smooth\"",
    ] {
        assert!(text.contains(said), "{said}");
    }
}

#[test]
fn what_is_looked_at_shows_drones_that_come_and_leave_and_what_is_flown_says_that_it_does_not() {
    let mut plan = plan();
    plan["drones"][0]["enters_s"] = 1.5.into();
    plan["drones"][1]["at_end"] = "leave".into();
    let desk = desk(&plan);
    let czml = "czml --georeference 47.4,8.55,488,90";
    for (to, is_told) in [("mcap", false), (czml, false), ("setpoints", true)] {
        let line = format!("export plan.json --to {to}");
        let to = to.split(' ').next().unwrap();
        let line = format!("{line} --out {to}");
        let (code, _, errors) = run(desk.path(), &line);
        let file = desk.path().join(to).join("export.json");
        let manifest = fs::read_to_string(file).expect(&errors);
        assert_eq!(code, Some(0), "{errors}");
        for what in ["waits at its first place", "stands at its last place"] {
            assert_eq!(manifest.contains(what), is_told, "{to}: {manifest}");
        }
    }
}

#[test]
fn drones_that_come_or_leave_and_would_stand_in_others_way_are_refused_by_name() {
    // One leaves where the other comes to later; a third comes where the first has flown.
    let meets = |far: f64| {
        let first = json!({"t_s": [0, 3], "position_m": [[2, 2, 2], [5, 2, 2]]});
        let second =
            json!({"t_s": [0, 2, 6], "position_m": [[5, 8, 2], [5, 8, 2], [5, 2.0 + far, 2]]});
        let third =
            json!({"t_s": [9, 12], "position_m": [[3.5, 2.0 + far, 2], [3.5, 2.0 + far, 2]]});
        let mut plan = fleet(&[("first", first), ("second", second), ("third", third)]);
        plan["drones"][0]["at_end"] = "leave".into();
        plan["drones"][2]["enters_s"] = 9.into();
        plan
    };
    let desk = desk(&meets(0.0));
    let line = "export plan.json --to setpoints --out o";
    let (code, told, errors) = run(desk.path(), line);
    assert_eq!(code, Some(1), "{told}");
    assert!(
        errors.contains("`first`: in files that are flown"),
        "{errors}"
    );
    assert!(
        errors.contains("`third`: in files that are flown"),
        "{errors}"
    );
    assert!(!errors.contains("`second`: ") && !desk.path().join("o").exists());
    let (code, _, errors) = run(desk.path(), "export plan.json --to mcap --out m");
    assert_eq!(code, Some(0), "{errors}");
    fs::write(desk.path().join("plan.json"), meets(2.0).to_string()).unwrap();
    let (code, _, errors) = run(desk.path(), line);
    assert_eq!(code, Some(0), "{errors}");
}

/// How high a Crazyflie's rotor plane is over the floor that it stands on (m): its body's radius.
const LIES_M: f64 = 0.0691;

#[test]
fn a_drone_taken_away_after_it_landed_lies_where_it_came_down_and_a_wreck_is_left_out() {
    let lies =
        |t_s: Value| json!({"t_s": t_s, "position_m": [[2, 2, 2], [2, 2, LIES_M], [2, 2, LIES_M]]});
    let flies = json!({"t_s": [0, 20], "position_m": [[9, 2, 2], [9, 12, 2]]});
    let rests = json!({"t_s": [9], "position_m": [[2, 2, LIES_M]]});
    let drones = [
        ("down", lies(json!([0, 5, 9]))),
        ("on", flies),
        ("down (wreck)", rests),
    ];
    for drones in [&drones[..2], &drones[..]] {
        let mut plan = fleet(drones);
        plan["drones"][0]["at_end"] = "leave".into();
        plan["drones"][0]["airborne_s"] = json!([0, 5]);
        let has_failed = drones.len() > 2;
        if has_failed {
            plan["drones"][2]["enters_s"] = 9.into();
            plan["drones"][2]["airborne_s"] = json!([9, 9]);
            plan["drones"][2]["at_start"] = "landed".into();
        }
        let desk = desk(&plan);
        for to in ["setpoints", "crazyswarm", "skybrush"] {
            let line = format!("export plan.json --to {to} --out {to}");
            let (code, _, errors) = run(desk.path(), &line);
            assert_eq!(code, Some(0), "{to}: {errors}");
            let manifest = fs::read_to_string(desk.path().join(to).join("export.json")).unwrap();
            let left_out = "is not flown, is left out: `down (wreck)`";
            assert_eq!(manifest.contains(left_out), has_failed, "{manifest}");
            assert_eq!(manifest.matches("(wreck)").count(), usize::from(has_failed));
        }
    }
}

/// To and fro along x, so many times a second each.
fn zigzag(pieces: usize, from_m: f64) -> Value {
    let at = |k: usize| [from_m + (k % 2) as f64 * 0.5, 3.0, 2.0];
    let times: Vec<usize> = (0..=pieces).collect();
    let places: Vec<_> = times.iter().map(|k| at(*k)).collect();
    json!({"t_s": times, "position_m": places})
}

#[test]
fn what_does_not_fit_is_refused_by_drone_and_limit_and_nothing_is_written() {
    let many = fleet(&[("fits", zigzag(31, 2.0)), ("long", zigzag(32, 12.0))]);
    let desk = desk(&many);
    let folder = desk.path();
    let (code, told, errors) = run(folder, "export plan.json --to crazyswarm --out o");
    assert_eq!(code, Some(1), "{told}");
    assert!(
        errors.contains("`long`: 32 pieces, a Crazyflie's memory takes 31"),
        "{errors}"
    );
    assert!(
        !errors.contains("`fits`") && errors.contains("--compressed"),
        "{errors}"
    );
    assert!(!folder.join("o").exists());
    let (code, told, _) = run(
        folder,
        "export plan.json --to crazyswarm --compressed --out o",
    );
    assert_eq!(code, Some(0), "{told}");
    assert!(folder.join("o/long.cfpoly").exists() && !folder.join("o/long.csv").exists());
    // Beyond 32.767 m, and more than a byte can count, each by name.
    let wrong = fleet(&[("far", zigzag(3, 33.0)), ("longer", zigzag(300, 12.0))]);
    fs::write(folder.join("plan.json"), wrong.to_string()).unwrap();
    let (code, _, errors) = run(
        folder,
        "export plan.json --to crazyswarm --compressed --out p",
    );
    assert_eq!(code, Some(1));
    assert!(errors.contains("`far`: reaches 33.50 m from 0"), "{errors}");
    assert!(
        errors.contains("`longer`: 300 compressed pieces"),
        "{errors}"
    );
    let json = "export plan.json --to crazyswarm --compressed --out p --format json";
    let (_, told, _) = run(folder, json);
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["refused"].as_array().unwrap().len(), 2);
    assert_eq!(told["refused"][0]["drone"], "far");
}

/// Two hundred days of two drones: rows by the gigabyte.
#[test]
fn what_no_memory_holds_is_refused_before_it_is_written() {
    let days = json!({"t_s": [0, 10, 1.7e7], "position_m": [[2, 2, 2], [5, 2, 2], [5, 2, 2]]});
    let brief = json!({"t_s": [0, 10], "position_m": [[2, 9, 2], [5, 9, 2]]});
    let desk = desk(&fleet(&[("brief", brief), ("days", days)]));
    for (format, said) in [
        ("setpoints", "rows at 20 a second"),
        ("mcap", "drones in scenes at 10 a second"),
        ("czml --georeference 47,8,400,90", "places to compare"),
    ] {
        let line = format!("export plan.json --to {format} --out o");
        let (code, _, errors) = run(desk.path(), &line);
        assert_eq!(code, Some(1), "{errors}");
        assert!(errors.contains("`days`: it takes 17000000 s"), "{errors}");
        assert!(
            errors.contains(said) && !errors.contains("`brief`"),
            "{errors}"
        );
    }
    assert!(!desk.path().join("o").exists());
}

/// Ten seconds of flight after three days: rows and scenes begin at time 0.
#[test]
fn what_would_be_written_before_a_drone_enters_counts_too() {
    let late = json!({"t_s": [250_000, 250_010], "position_m": [[2, 9, 2], [5, 9, 2]]});
    let mut plan = fleet(&[("brief", zigzag(3, 2.0)), ("late", late)]);
    plan["drones"][0]["at_end"] = "leave".into();
    plan["drones"][1]["enters_s"] = 250_000.into();
    let desk = desk(&plan);
    for (format, said) in [
        (
            "setpoints",
            "`late`: it takes 250010 s, all drones together 250013 s",
        ),
        (
            "mcap",
            "`late`: it ends at 250010 s: 2500100 scenes at 10 a second",
        ),
    ] {
        let line = format!("export plan.json --to {format} --out o");
        let (code, _, errors) = run(desk.path(), &line);
        assert!(code == Some(1) && errors.contains(said), "{errors}");
    }
}

/// Forty lines, then a rest of ten days: every twentieth of a second of it against every line.
#[test]
fn a_mission_that_would_be_compared_for_minutes_is_refused() {
    let at = |k: usize| [2.0 + 0.5 * k as f64, 3.0 + (k % 2) as f64, 2.0];
    let times = (0..=40).chain([900_000]);
    let places: Vec<_> = (0..=40).chain([40]).map(at).collect();
    let rests = json!({"t_s": times.collect::<Vec<_>>(), "position_m": places});
    let desk = desk(&fleet(&[("rests", rests)]));
    let line = "export plan.json --to qgc --georeference 47,8,400,90 --untimed-ok --out o";
    let (code, _, errors) = run(desk.path(), line);
    assert_eq!(code, Some(1), "{errors}");
    assert!(
        errors.contains("`rests`: 18000001 moments to compare"),
        "{errors}"
    );
}

#[test]
fn a_plan_that_is_not_safe_is_not_exported_and_a_broken_question_is_reported() {
    let mut together = plan();
    together["drones"][2]["trajectory"]["position_m"] = json!([[5, 2, 2]]);
    let desk = desk(&together);
    let folder = desk.path();
    fs::write(folder.join("apart.json"), plan().to_string()).unwrap();
    let (code, _, errors) = run(folder, "export plan.json --to setpoints --out o");
    assert_eq!(code, Some(1));
    assert!(
        errors.contains("not exported") && !folder.join("o").exists(),
        "{errors}"
    );
    for (line, said) in [
        ("export missing.json --to setpoints", "cannot read"),
        (
            "export plan.json --to paper",
            "setpoints, crazyswarm, skybrush, mcap, czml, qgc",
        ),
        (
            "export apart.json --to czml",
            "--georeference LAT,LON,AMSL,HEADING",
        ),
        ("export plan.json --to setpoints --rate 1", "2 to 1000"),
        (
            "export plan.json --to setpoints --georeference 1,2,3",
            "LAT,LON,AMSL,HEADING",
        ),
        (
            "export plan.json --to setpoints --georeference 91,2,3,0",
            "the latitude",
        ),
    ] {
        let (code, _, errors) = run(folder, line);
        assert_eq!(code, Some(2), "{line}");
        assert!(errors.contains(said), "{line}: {errors}");
    }
}

#[test]
fn options_that_are_not_for_the_format_are_refused_all_at_once() {
    let desk = desk(&plan());
    let folder = desk.path();
    let all = "--georeference 47.4,8.5,488,30 --frame enu --rate 20 --origin own --compressed \
               --untimed-ok";
    let names = [
        "georeference",
        "frame",
        "rate",
        "origin",
        "compressed",
        "untimed-ok",
    ];
    let fit: [(&str, &[&str]); 6] = [
        ("setpoints", &["georeference", "frame", "rate", "origin"]),
        ("crazyswarm", &["compressed"]),
        ("skybrush", &["georeference"]),
        ("mcap", &[]),
        ("czml", &["georeference"]),
        ("qgc", &["georeference", "untimed-ok"]),
    ];
    for (to, own) in fit {
        let (code, said, errors) =
            run(folder, &format!("export plan.json --to {to} {all} --out o"));
        assert_eq!((code, &said[..]), (Some(2), ""), "{to}");
        assert!(!folder.join("o").exists(), "{to}");
        for name in names {
            let is_told = errors.contains(&format!("`--{name}` is for --to "));
            assert_eq!(is_told, !own.contains(&name), "{to} {name}: {errors}");
        }
    }
    let line = "export plan.json --to mcap --rate 20 --compressed --out o --format json";
    let (_, _, errors) = run(folder, line);
    assert!(
        errors.contains("`--rate` is for --to setpoints: it says nothing of mcap")
            && errors.contains("`--compressed` is for --to crazyswarm: it says nothing of mcap"),
        "{errors}"
    );
}

#[test]
fn every_export_names_its_plan_and_replaces_what_was_there() {
    let desk = desk(&plan());
    let folder = desk.path();
    let manifest = || -> Value {
        let text = fs::read_to_string(folder.join("o/export.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    };
    let line = "export plan.json --to crazyswarm --out o";
    assert_eq!(run(folder, line).0, Some(0));
    let first = manifest();
    let id = first["plan"]["id"].as_str().unwrap().to_owned();
    assert_eq!(first["drones"][1]["id"], format!("{id}/smooth"));
    fs::write(folder.join("o/mine.txt"), "kept").unwrap();
    // Another fleet, of which one name cannot be a file's, and two are one where case is not told.
    let stays = |x: f64| json!({"t_s": [0], "position_m": [[x, 5, 2]]});
    let others = [("../x", stays(2.0)), ("A", stays(8.0)), ("a", stays(14.0))];
    fs::write(folder.join("plan.json"), fleet(&others).to_string()).unwrap();
    assert_eq!(run(folder, line).0, Some(0));
    assert_ne!(manifest()["plan"]["id"], id.as_str());
    let mut names: Vec<String> = fs::read_dir(folder.join("o"))
        .unwrap()
        .map(|it| it.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let expected = [
        "A.cfpoly",
        "A.csv",
        "drone-0001.cfpoly",
        "drone-0001.csv",
        "drone-0003.cfpoly",
        "drone-0003.csv",
        "export.json",
        "mine.txt",
    ];
    assert_eq!(names, expected);
}

#[test]
fn missions_hold_no_times_so_they_are_written_only_when_that_will_do_and_say_what_lateness_costs() {
    let stays = |x: f64, z: f64| json!({"t_s": [0, 30], "position_m": [[x, 9, z], [x, 9, z]]});
    // Passes under the other before that comes; five seconds late it passes under it.
    let passes =
        json!({"t_s": [0, 4, 8, 30], "position_m": [[4, 9, 2], [4, 9, 2], [12, 9, 2], [12, 9, 2]]});
    let comes = json!({"t_s": [0, 5, 9, 30], "position_m": [[8, 1, 3.2], [8, 1, 3.2], [8, 9, 3.2], [8, 9, 3.2]]});
    // On the ground until 3 s, 2 s at 1.5 m, and down again.
    let hops = json!({"t_s": [0, 3, 6, 8, 12, 14], "position_m": [
        [20, 9, 0], [20, 9, 0], [20, 9, 1.5], [20, 9, 1.5], [20, 9, 0], [20, 9, 0],
    ]});
    let mut plan = fleet(&[
        ("passes", passes),
        ("comes", comes),
        ("far", stays(30.0, 2.0)),
        ("hops", hops),
    ]);
    (plan["drones"][3]["at_start"], plan["drones"][3]["at_end"]) = ("landed".into(), "land".into());
    let desk = desk(&plan);
    let folder = desk.path();
    let line = "export plan.json --to qgc --georeference 47.4,8.55,488,90 --out o";
    let (code, _, errors) = run(folder, line);
    assert_eq!(code, Some(1));
    assert!(errors.contains("--untimed-ok") && !folder.join("o").exists());
    assert!(
        errors.contains("5 s late, all others on time: of 4"),
        "{errors}"
    );
    assert!(errors.contains("when `passes` is late"), "{errors}");
    let (code, told, errors) = run(folder, &format!("{line} --untimed-ok"));
    assert_eq!(code, Some(0), "{told}{errors}");
    assert!(
        told.contains("warning: each drone in turn 5 s late"),
        "{told}"
    );
    let manifest = fs::read_to_string(folder.join("o/export.json")).unwrap();
    let manifest: Value = serde_json::from_str(&manifest).unwrap();
    let worst = &manifest["untimed"]["worst"];
    assert_eq!(
        (&worst[0], &worst[1]["from"]),
        (&json!("passes"), &json!("comes"))
    );
    assert!(worst[1]["alpha"].as_f64() > worst[1]["limit"].as_f64());
    // By hand: a degree of latitude and of longitude on the ellipsoid at 47.4 degrees.
    let mission = fs::read_to_string(folder.join("o/comes.plan")).unwrap();
    let mission: Value = serde_json::from_str(&mission).unwrap();
    let items = mission["mission"]["items"].as_array().unwrap();
    let commands: Vec<&Value> = items.iter().map(|it| &it["command"]).collect();
    assert_eq!(commands, [22, 16, 16]);
    let first = [&items[0]["params"][0], &items[1]["params"][0]];
    assert_eq!(
        first,
        [0.0, 5.0],
        "a take-off holds nothing: its is a pitch"
    );
    let home = &mission["mission"]["plannedHomePosition"];
    assert_eq!(home[2], 488.0);
    for (k, x, y) in [(0, 8.0, 1.0), (1, 8.0, 1.0), (2, 8.0, 9.0)] {
        let at = |index: usize| items[k]["params"][index].as_f64().unwrap();
        assert!(((at(4) - 47.4) * 111_178.0 - y).abs() < 0.01, "{items:?}");
        assert!(((at(5) - 8.55) * 75_489.0 - x).abs() < 0.01, "{items:?}");
        assert_eq!(at(6), 3.2);
    }
    let text = fs::read_to_string(folder.join("o/comes.waypoints")).unwrap();
    let lines: Vec<Vec<&str>> = text.lines().map(|it| it.split('\t').collect()).collect();
    assert_eq!((lines[0][0], lines.len()), ("QGC WPL 110", 5));
    assert_eq!((lines[2][3], lines[2][4], lines[3][10]), ("22", "0", "3.2"));
    assert_eq!((lines[3][3], lines[3][4]), ("16", "5"));
    let text = fs::read_to_string(folder.join("o/hops.waypoints")).unwrap();
    let items = text
        .lines()
        .skip(2)
        .map(|it| it.split('\t').collect::<Vec<_>>());
    let items: Vec<[String; 2]> = items.map(|it| [it[3].into(), it[4].into()]).collect();
    assert_eq!(items, [["22", "0"], ["16", "2"], ["21", "0"]]);
    let waits = "waits on the ground in the plan, takes off at once here: `hops`";
    assert!(manifest["lost"].to_string().contains(waits), "{manifest}");
}

#[test]
fn a_drone_that_never_leaves_the_ground_has_no_mission_and_does_not_end_hovering() {
    let hops = json!({"t_s": [0, 3, 6], "position_m": [[20, 9, 0], [20, 9, 1.5], [20, 9, 0]]});
    let parked = json!({"t_s": [0], "position_m": [[4, 9, 0]]});
    let mut plan = fleet(&[("hops", hops), ("parked", parked)]);
    for drone in [0, 1] {
        plan["drones"][drone]["at_start"] = "landed".into();
    }
    plan["drones"][0]["at_end"] = "land".into();
    let desk = desk(&plan);
    let folder = desk.path();
    let line = "export plan.json --to qgc --georeference 47.4,8.55,488,90 --untimed-ok --out q";
    let (code, told, errors) = run(folder, line);
    assert_eq!(code, Some(0), "{told}{errors}");
    let parked = "never leaves the ground, has no mission: `parked`";
    assert!(told.contains(parked), "{told}");
    assert!(folder.join("q/hops.plan").exists() && !folder.join("q/parked.plan").exists());
    let (code, told, errors) = run(folder, "export plan.json --to skybrush --out s");
    assert_eq!(code, Some(0), "{told}{errors}");
    assert!(!told.contains("end hovering"), "{told}");
}

#[test]
fn no_scenarios_name_leads_out_of_the_folder_of_a_command() {
    for scenario in ["/elsewhere", "..", "../../../up", "a/b"] {
        let desk = tempfile::tempdir().unwrap();
        let folder = desk.path().join("here");
        fs::create_dir(&folder).unwrap();
        let mut plan = plan();
        plan["scenario"] = match scenario.strip_prefix('/') {
            Some(name) => json!(desk.path().join(name)),
            None => json!(scenario),
        };
        fs::write(folder.join("flown.json"), plan.to_string()).unwrap();
        let (_, told, errors) = run(&folder, "export flown.json --to setpoints");
        assert!(
            told.contains("wrote out/export/flown/setpoints/"),
            "{told}{errors}"
        );
        let line = "fly flown.json --until 0.1 --gusts 0 --convection 1";
        let (_, told, errors) = run(&folder, line);
        assert!(told.contains("wrote out/fly/flown/"), "{told}{errors}");
        let beside = fs::read_dir(desk.path()).unwrap().count();
        assert_eq!(beside, 1, "{scenario}");
    }
}
