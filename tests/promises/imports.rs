//! `plan check` on shows and tables of other programs: judged as the plan that they were, told
//! where they are broken, their light programs kept.

use std::fs;
use std::io::{Cursor, Read as _, Write as _};
use std::path::Path;

use super::run;
use exchange::{Options, Target, export};
use planner::plan::file::{self, PlanFile};
use serde_json::{Value, json};

/// One passes below another, `below_m` down and `beside_m` off at 5 s; a third flies by itself,
/// curved.
fn passing(below_m: f64, beside_m: f64) -> PlanFile {
    let drone = |name: &str, trajectory: Value| json!({"name": name, "airframe": "crazyflie-2.1", "trajectory": trajectory});
    let curve = json!({
        "t_s": [0, 2, 4, 6, 8, 10],
        "position_m": [[2, 9, 2], [2.5, 9, 2.1], [5, 9, 2.6], [7.5, 9, 3.1], [8, 9, 3.2], [8, 9, 3.2]],
        "control_m": [
            [[2, 9, 2], [2, 9, 2]], [[3, 9, 2.2], [4, 9, 2.4]], [[6, 9, 2.8], [7, 9, 3]],
            [[8, 9, 3.2], [8, 9, 3.2]], [],
        ],
    });
    let plan = json!({
        "format": "plan/2", "scenario": "passing",
        "quasi_static": false, "air_delay": {"convection": [0.6, 1.0]},
        "bounds_m": {"min": [0, 0, 0], "max": [40, 20, 8]},
        "drones": [
            drone("above", json!({"t_s": [0, 10], "position_m": [[5, 5, 4], [5, 5, 4]]})),
            drone("below", json!({"t_s": [0, 10], "position_m": [[0.5, 5.0 + beside_m, 4.0 - below_m], [9.5, 5.0 + beside_m, 4.0 - below_m]]})),
            drone("curve", curve),
        ],
    });
    file::read(&plan.to_string()).expect("a plan")
}

/// The plan's files in a format, below `folder/o`.
fn exported(folder: &Path, file: &PlanFile, to: Target, own_origin: bool) {
    let options = Options {
        plan_id: "0123456789abcdef".to_owned(),
        georeference: None,
        axes: exchange::frame::Axes::Ned,
        rate_hz: 50.0,
        own_origin,
        compressed_alone: false,
        untimed_ok: false,
        kept: Default::default(),
    };
    let made = export(&file.plan, to, &options).expect("it fits");
    fs::create_dir_all(folder.join("o")).unwrap();
    let manifest = serde_json::to_string(&made.manifest).unwrap();
    fs::write(folder.join("o/export.json"), manifest).unwrap();
    for file in made.files {
        fs::write(folder.join("o").join(file.name), file.bytes).unwrap();
    }
}

/// What the command says of some files, as JSON.
fn judged(folder: &Path, what: &str) -> (Option<i32>, Value) {
    let line = format!("check {what} --airframe crazyflie-2.1 --format json");
    let (code, told, errors) = run(folder, &line);
    assert!(code != Some(2), "{what}: {errors}");
    (code, serde_json::from_str(&told).unwrap())
}

#[test]
fn what_is_exported_is_judged_as_it_was_when_it_comes_back() {
    for (below_m, beside_m, expected) in [(0.35, 0.0, Some(1)), (1.9, 0.8, Some(0))] {
        let file = passing(below_m, beside_m);
        let before = planner::verify::examination::examine(&file, false);
        assert_eq!(before.plan.violations.is_empty(), expected == Some(0));
        let worst = before.worst_air.expect("there is air");
        for (to, own_origin, what) in [
            (Target::Setpoints, false, "o"),
            (Target::Setpoints, true, "o"),
            (Target::Crazyswarm, false, "o"),
            (
                Target::Crazyswarm,
                false,
                "o/above.cfpoly o/below.cfpoly o/curve.cfpoly",
            ),
            (Target::Skybrush, false, "o/show.skyc"),
            (
                Target::Skybrush,
                false,
                "o/above.skyb o/below.skyb o/curve.skyb",
            ),
        ] {
            let desk = tempfile::tempdir().unwrap();
            exported(desk.path(), &file, to, own_origin);
            let (code, told) = judged(desk.path(), what);
            assert_eq!(code, expected, "{what}: {told}");
            let found = &told["examination"]["worst_air"];
            assert_eq!(found["drone"], worst.drone.as_str(), "{what}");
            assert_eq!(found["from"], worst.from.as_deref().unwrap(), "{what}");
            let near = |key: &str, is: f64, within: f64| {
                let said = found[key].as_f64().unwrap();
                assert!((said - is).abs() <= within, "{what}: {key} {said}, {is}");
            };
            near("alpha", worst.alpha, 0.01 * worst.alpha);
            near("at_s", worst.at_s, 0.02);
            let kinds = |all: &Value| -> Vec<String> {
                let all = all.as_array().unwrap().iter();
                let mut kinds: Vec<String> = all
                    .map(|it| format!("{} {} {}", it["kind"], it["drone"], it["with"]))
                    .collect();
                kinds.sort();
                kinds.dedup();
                kinds
            };
            let own = serde_json::to_value(&before.plan.violations).unwrap();
            assert_eq!(kinds(&told["violations"]), kinds(&own), "{what}");
            let first = &told["first_exposure"];
            assert_eq!(first.is_null(), expected == Some(0), "{what}");
            if !first.is_null() {
                assert!(
                    (first["from_s"].as_f64().unwrap() - own[0]["from_s"].as_f64().unwrap()).abs()
                        < 0.03
                );
            }
        }
    }
}

/// A zip of JSON files.
#[test]
fn tables_are_read_as_other_programs_write_them() {
    let desk = tempfile::tempdir().unwrap();
    // Crazyswarm's tables end each line in a comma.
    let coefficients = |axis: &str| (0..8).map(|k| format!("{axis}^{k},")).collect::<String>();
    let header: String = ["x", "y", "z", "yaw"]
        .into_iter()
        .map(coefficients)
        .collect();
    let at = |value: f64| format!("{value},{}", "0,".repeat(7));
    let row = format!("2,{}{}{}{}", at(1.0), at(2.0), at(3.0), at(0.0));
    let tables = [
        ("swarm.csv", format!("Duration,{header}\n{row}\n{row}\n")),
        (
            "told.csv",
            "t_s,x_m,y_m,z_m,note\n0,1,2,3,\n4,1,2,3,\"here, still\"\n".to_owned(),
        ),
        (
            "shown.csv",
            "Time_msec,X_m,Y_m,Z_m,Color\n0,1,2,3,#ff0000\n4000,1,2,3,red\n".to_owned(),
        ),
    ];
    for (name, text) in tables {
        fs::write(desk.path().join(name), text).unwrap();
        assert_eq!(judged(desk.path(), name).0, Some(0), "{name}");
    }
    // A cell that is missing is still told.
    let short = "t_s,x_m,y_m,z_m,note\n0,1,2,3\n4,1,2,3,x\n";
    fs::write(desk.path().join("short.csv"), short).unwrap();
    let (code, _, errors) = run(desk.path(), "check short.csv --airframe crazyflie-2.1");
    assert_eq!(code, Some(2));
    assert!(errors.contains("4 columns, 5 expected"), "{errors}");
}

fn zip(files: &[(&str, Value)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, value) in files {
        zip.start_file(*name, zip::write::SimpleFileOptions::default())
            .unwrap();
        zip.write_all(value.to_string().as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// A show as Studio lays it out: `b` hovers below `a`, with lights.
fn show(version: u64, below_m: f64) -> Vec<u8> {
    let drone = |name: &str, k: usize, lights: Value| {
        let trajectory = format!("./drones/{k}/trajectory.json#");
        json!({"type": "generic", "settings": {
            "name": name, "home": [0, 0, 0], "trajectory": {"$ref": trajectory}, "lights": lights,
        }})
    };
    let hovers = |takeoff_s: f64, z_m: f64, x_m: f64| {
        let points = json!([
            [0, [x_m, 0, 0], []],
            [4, [x_m, 0, z_m], []],
            [10, [4, 0, z_m], [[x_m, 0, z_m], [4, 0, z_m]]],
            [20, [4, 0, z_m], []],
        ]);
        json!({"version": 1, "takeoffTime": takeoff_s, "points": points})
    };
    let swarm = json!({"drones": [
        drone("Drone 1", 1, json!({"$ref": "./drones/1/lights.json#"})),
        drone("Drone 2", 2, json!({"version": 1, "data": "CAEC"})),
    ]});
    zip(&[
        (
            "show.json",
            json!({"version": version, "environment": {"type": "indoor"}, "swarm": swarm}),
        ),
        ("drones/1/trajectory.json", hovers(0.0, 6.0, 0.0)),
        (
            "drones/1/lights.json",
            json!({"version": 1, "data": "BAECAwA="}),
        ),
        ("drones/2/trajectory.json", hovers(2.5, 6.0 - below_m, 8.0)),
    ])
}

#[test]
fn a_show_names_first_and_worst_exposure_and_is_a_page_and_a_plan() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("show.skyc"), show(1, 0.6)).unwrap();
    let (code, _, errors) = run(folder, "check show.skyc");
    assert_eq!(code, Some(2));
    assert!(errors.contains("--airframe NAME"), "{errors}");
    fs::write(folder.join("plan.json"), "{}").unwrap();
    let (_, _, errors) = run(folder, "check plan.json --airframe crazyflie-2.1");
    assert!(errors.contains("leave --airframe"), "{errors}");
    let line = "check show.skyc --airframe crazyflie-2.1 --out out";
    let (code, told, errors) = run(folder, line);
    assert_eq!(code, Some(1), "{told}{errors}");
    assert!(told.contains("by up to 8.00 m (`Drone 2`)"), "{told}");
    for said in [
        "first exposure over a limit: `Drone 2` is exposed",
        "mostly from `Drone 1`",
        "worst air: `Drone 2`",
        "may be",
        "read as a Skybrush show",
        "light programs of 2 of 2 drones are kept",
        "the floor is at z = 0 m",
    ] {
        assert!(told.contains(said), "{said}\n{told}");
    }
    let page = fs::read_to_string(folder.join("out/plan.html")).unwrap();
    assert!(page.contains("Drone 2") && page.contains("is exposed to downwash"));
    // The plan beside it is judged the same.
    let (code, told, _) = run(folder, "check out/checked.json");
    assert_eq!(code, Some(1));
    assert!(
        told.contains("first exposure over a limit: `Drone 2`"),
        "{told}"
    );
    assert!(told.contains("turns_at_once"), "{told}");
    // It stands until 2.5 s without a wake, and hovers on at its end.
    let plan = fs::read_to_string(folder.join("out/checked.json")).unwrap();
    let plan: Value = serde_json::from_str(&plan).unwrap();
    assert_eq!(plan["drones"][1]["airborne_s"], json!([2.5, null]));
    assert_eq!(plan["drones"][1]["at_start"], "landed");
    // A few lines say more: a heavier one above, the lower one bears more.
    let fleet = "Fleet(airframe: \"kolibri\", drones: [(name: \"Drone 2\", airframe: \"crazyflie-2.1\", air_limit: 1.2)])";
    fs::write(folder.join("fleet.ron"), fleet).unwrap();
    let (_, told, _) = run(
        folder,
        "check show.skyc --airframes fleet.ron --format json",
    );
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["examination"]["worst_air"]["limit"], 1.2);
    // The fleet's limit is that of every drone with none of its own.
    let fleet = "Fleet(airframe: \"crazyflie-2.1\", air_limit: 0.9)";
    fs::write(folder.join("fleet.ron"), fleet).unwrap();
    let (_, told, _) = run(
        folder,
        "check show.skyc --airframes fleet.ron --format json",
    );
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["examination"]["worst_air"]["limit"], 0.9);
}

#[test]
fn light_programs_are_kept_when_a_show_is_exported_again() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    fs::write(folder.join("show.skyc"), show(1, 5.0)).unwrap();
    let line = "export show.skyc --airframe crazyflie-2.1 --to skybrush --out o";
    let (code, told, errors) = run(folder, line);
    assert_eq!(code, Some(0), "{told}{errors}");
    assert!(!told.contains("no light program"), "{told}");
    let bytes = fs::read(folder.join("o/show.skyc")).unwrap();
    let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut json = |name: &str| -> Value {
        let mut text = String::new();
        zip.by_name(name)
            .unwrap()
            .read_to_string(&mut text)
            .unwrap();
        serde_json::from_str(&text).unwrap()
    };
    let index = json("show.json");
    for (k, data) in ["BAECAwA=", "CAEC"].into_iter().enumerate() {
        let lights = &index["swarm"]["drones"][k]["settings"]["lights"]["$ref"];
        let name = lights.as_str().unwrap().trim_start_matches("./");
        let program = json(name.trim_end_matches('#'));
        assert_eq!(program, json!({"version": 1, "data": data}));
    }
    // Block 2 of the binary files, its length and its bytes.
    let mut skyb: Vec<_> = fs::read_dir(folder.join("o"))
        .unwrap()
        .map(|it| it.unwrap().path())
        .filter(|it| it.extension().is_some_and(|it| it == "skyb"))
        .collect();
    skyb.sort();
    let bytes = fs::read(&skyb[0]).unwrap();
    let block = [2, 5, 0, 4, 1, 2, 3, 0];
    assert!(bytes.windows(8).any(|it| it == block), "{bytes:?}");
    let (code, told, _) = run(
        folder,
        "export show.skyc --airframe crazyflie-2.1 --to setpoints --out p",
    );
    assert_eq!(code, Some(0));
    assert!(
        told.contains("light programs: Skybrush's formats alone"),
        "{told}"
    );
}

/// A JSON file of a zip.
fn json_in(zip: &[u8], name: &str) -> Value {
    let mut zip = zip::ZipArchive::new(Cursor::new(zip)).unwrap();
    let mut text = String::new();
    let mut file = zip.by_name(name).unwrap();
    file.read_to_string(&mut text).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn a_drone_of_a_show_without_a_name_is_called_by_its_place() {
    let desk = tempfile::tempdir().unwrap();
    let trajectory = json!({"version": 1, "points": [[0, [0, 0, 2], []], [4, [3, 0, 2], []]]});
    let drone = json!({"settings": {"name": " ", "trajectory": trajectory}});
    let index = json!({"version": 1, "swarm": {"drones": [drone]}});
    let show = zip(&[("show.json", index)]);
    fs::write(desk.path().join("a.skyc"), show).unwrap();
    let line = "check a.skyc --airframe crazyflie-2.1 --out o";
    let (code, text, errors) = run(desk.path(), line);
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("`drone-1`"), "{text}");
}

#[test]
fn what_a_show_says_beside_its_trajectories_is_kept_or_reported_as_lost() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    let points = json!([[0, [0, 0, 2], []], [4, [3, 0, 2], []]]);
    let pyro = json!({"version": 1, "events": [[2.0, 1, "flare"]], "payloads": {}});
    let yaw = json!({"version": 1, "setpoints": [[0, 0], [5, 180]]});
    let settings = json!({
        "name": "a", "home": [0, 0, 0], "trajectory": {"$ref": "./t/all.json#/flown/0"},
        "pyro": {"$ref": "./fire.json#"}, "yawControl": yaw,
    });
    let cues = json!({"version": 1, "items": [{"time": 1.5, "name": "go"}]});
    let place = json!({
        "type": "outdoor",
        "location": {"origin": [474_000_000, 85_500_000, 488_000], "orientation": "30"},
    });
    let index = json!({
        "version": 1, "environment": place,
        "settings": {"cues": cues, "validation": {"minDistance": 3}},
        "media": {"audio": {"url": "./song.mp3"}}, "meta": {"title": "Harbour (final)"},
        "swarm": {"drones": [{"type": "heavy", "settings": settings}]},
    });
    let show = zip(&[
        ("show.json", index.clone()),
        (
            "t/all.json",
            json!({"flown": [{"version": 1, "takeoffTime": 1.5, "points": points}]}),
        ),
        ("fire.json", pyro.clone()),
        ("song.mp3", json!("la")),
    ]);
    fs::write(folder.join("show.skyc"), show).unwrap();
    let (code, told, errors) = run(
        folder,
        "check show.skyc --airframe crazyflie-2.1 --out checked",
    );
    assert_eq!(code, Some(0), "{told}{errors}");
    let kept = "pyro, yaw, cues, media are kept, not judged";
    assert!(told.contains(kept), "{told}");
    // Once more, from what was written: nothing is added and nothing is lost.
    for (from, to) in [("show.skyc", "o"), ("o/show.skyc", "p")] {
        let line = format!("export {from} --airframe crazyflie-2.1 --to skybrush --out {to}");
        let (code, told, errors) = run(folder, &line);
        assert_eq!(code, Some(0), "{told}{errors}");
        assert!(told.contains("pyro, yaw: the .skyc has them"), "{told}");
        assert!(!told.contains("indoor"), "{told}");
        let written = fs::read(folder.join(to).join("show.skyc")).unwrap();
        let now = json_in(&written, "show.json");
        for key in ["environment", "settings", "media"] {
            assert_eq!(now[key], index[key], "{key}");
        }
        let title = now["meta"]["title"].as_str().unwrap();
        assert!(title.starts_with("Harbour (final) (plan "), "{title}");
        assert_eq!(title.matches("(plan ").count(), 1, "{title}");
        let drone = &now["swarm"]["drones"][0];
        assert_eq!(drone["type"], "heavy");
        assert_eq!(drone["settings"]["yawControl"], yaw);
        assert_eq!(drone["settings"]["pyro"]["$ref"], "./fire.json#");
        assert_eq!(json_in(&written, "fire.json"), pyro);
        assert_eq!(json_in(&written, "song.mp3"), json!("la"));
        let mut files = zip::ZipArchive::new(Cursor::new(&written[..])).unwrap();
        assert!(files.by_name("t/all.json").is_err(), "it is no longer used");
    }
    let (code, told, _) = run(
        folder,
        "export show.skyc --airframe crazyflie-2.1 --to setpoints --out q --format json",
    );
    assert_eq!(code, Some(0));
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["axes"]["heading_deg"], 30.0);
    let lost = "pyro, yaw, cues, media: Skybrush's formats alone hold them";
    assert!(told["lost"].to_string().contains(lost), "{told}");
    // A plan of the show keeps where it lies.
    let checked: Value =
        serde_json::from_slice(&fs::read(folder.join("checked/checked.json")).unwrap()).unwrap();
    assert_eq!(checked["origin"]["latitude_deg"], 47.4);
    let line =
        "export show.skyc --airframe crazyflie-2.1 --to skybrush --georeference 1,2,3,4 --out r";
    assert_eq!(run(folder, line).0, Some(0));
    let moved = json_in(&fs::read(folder.join("r/show.skyc")).unwrap(), "show.json");
    let location = &moved["environment"]["location"];
    assert_eq!(location["origin"], json!([10_000_000, 20_000_000, 3000]));
}

#[test]
fn a_show_that_begins_before_its_clock_keeps_its_times() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    let drone = |name: &str, k: usize| {
        let trajectory = json!({"$ref": format!("./t/{k}.json#")});
        json!({"type": "generic", "settings": {"name": name, "home": [k, 0, 0], "trajectory": trajectory}})
    };
    let flies = |x_m: f64, takeoff_s: f64| {
        let points = json!([[0, [x_m, 0, 2], []], [4, [x_m, 3, 2], []]]);
        json!({"version": 1, "takeoffTime": takeoff_s, "points": points})
    };
    let cues = json!({"version": 1, "items": [{"time": 1.5, "name": "go"}]});
    let show = zip(&[
        (
            "show.json",
            json!({
                "version": 1, "environment": {"type": "indoor"}, "settings": {"cues": cues},
                "swarm": {"drones": [drone("a", 1), drone("b", 4)]},
            }),
        ),
        ("t/1.json", flies(1.0, -2.0)),
        ("t/4.json", flies(4.0, 1.0)),
    ]);
    fs::write(folder.join("show.skyc"), show).unwrap();
    let line = "export show.skyc --airframe crazyflie-2.1 --to skybrush --out o";
    let (code, told, errors) = run(folder, line);
    assert_eq!(code, Some(0), "{told}{errors}");
    let written = fs::read(folder.join("o/show.skyc")).unwrap();
    for (k, ends_s) in [(1, 2.0), (2, 5.0)] {
        let flown = json_in(&written, &format!("drones/drone_{k:04}/trajectory.json"));
        let last = flown["points"].as_array().unwrap().last().unwrap();
        let ends = flown["takeoffTime"].as_f64().unwrap() + last[0].as_f64().unwrap();
        assert_eq!(ends, ends_s, "{flown}");
    }
}

#[test]
fn all_that_is_wrong_with_a_show_is_reported_at_once_each_at_its_place() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    let put = |name: &str, bytes: &[u8]| {
        fs::create_dir_all(folder.join(name).parent().unwrap()).unwrap();
        fs::write(folder.join(name), bytes).unwrap();
    };
    let drone = |trajectory: Value| json!({"settings": {"trajectory": trajectory}});
    let points = |points: Value| drone(json!({"version": 1, "points": points}));
    let drones = json!([
        points(json!([
            [0, [0, 0, 1], []],
            [0, [1, 0, 1], []],
            [1, [1e300, 0, 1], []],
            [2, [1, 0, 1], [[], []]]
        ])),
        points(json!([
            [0, [0, 0, 1], []],
            [0, [1, 0, 1], []],
            [0.001, [100, 0, 1], []]
        ])),
        drone(json!({"$ref": "./gone.json#"})),
        drone(json!({"version": 7, "points": []})),
        points(json!([[0, [0, 0, 1], []], [3, [0, "one", 1], []]])),
        json!({"settings": {"lights": {"version": 3}, "trajectory": {"version": 1, "points": []}}}),
    ]);
    let index = json!({"version": 1, "swarm": {"drones": drones}});
    put("bad.skyc", &zip(&[("show.json", index)]));
    put(
        "big.csv",
        b"t_s,x_m,y_m,z_m\n0,0,0,1\n10,1e300,0,1\n20,0,0,1\n20.001,9,0,1\n",
    );
    put("once.csv", b"Time_msec,X_m,Y_m,Z_m\n0,1,2,-1e9\n");
    put("low.csv", b"t_s,x_m,y_m,z_m\n0,1,2,0\n2,1,2,-3\n");
    put("lower.csv", b"t_s,x_m,y_m,z_m\n0,3,2,0\n2,3,2,-4\n");
    let log = b"t_s,drone,x_m,y_m,z_m\n0,a,1,1,1\n1,a,1,2,1\n";
    put("logs/one.csv", log);
    put("logs2/one.csv", log);
    put("logs2/two.csv", log);
    let setpoints = b"\xef\xbb\xbft_s,x_m,y_m,z_m\n0,1,2,1\n2,1,2,1.5\n";
    put("marked/a.csv", setpoints);
    put("broken/a.csv", setpoints);
    put("broken/export.json", b"{\"drones\": 7}");
    put("short/a.csv", setpoints);
    let named =
        |name: &str, file: &str| json!({"name": name, "start_m": [1, 1, 1], "files": [file]});
    let export = |origin: &str| {
        let axes = json!({"frame": "enu", "heading_deg": 90, "origin": origin, "rate_hz": 20});
        let drones = [named("k1", "a.csv"), named("k2", "b.csv")];
        json!({"format": "export/1", "axes": axes, "drones": drones}).to_string()
    };
    put("short/export.json", export("common").as_bytes());
    put("own/export.json", export("own").as_bytes());
    put("own/a.csv", setpoints);
    put("own/b.csv", setpoints);
    put("own/c.csv", setpoints);
    for (what, said) in [
        (
            "bad.skyc",
            &[
                "swarm.drones[0].settings.trajectory: points[3]",
                "swarm.drones[1].settings.trajectory: points[1]: time does not go on",
                "swarm.drones[1].settings.trajectory: points[2]: is flown at 100000.00 m/s, not within 0 to 1000",
                "gone.json: ",
                "swarm.drones[3].settings.trajectory: version 7",
                "swarm.drones[4].settings.trajectory: points[1]",
                "swarm.drones[5].settings.lights: lights of version 3",
                "swarm.drones[5].settings.trajectory: no points",
            ][..],
        ),
        (
            "big.csv once.csv",
            &[
                "big.csv: line 3: reaches 1.000e300 m, not within -10000000 to 10000000",
                "line 5: is flown at 9000.00 m/s",
                "once.csv: line 2: reaches -1.000e9 m",
            ],
        ),
        (
            "low.csv lower.csv",
            &["`low` is at z = -3.00 m", "`lower` is at z = -4.00 m"],
        ),
        (
            "gone.csv low.csv away.csv",
            &["read gone.csv", "read away.csv"],
        ),
        (
            "logs2",
            &[
                "one.csv: line 1: a log, which has all drones in it",
                "two.csv: line 1",
            ],
        ),
        (
            "broken",
            &["broken/export.json: not a plan: line 1: it does not say what the files"],
        ),
        ("broken/a.csv", &["broken/export.json: not a plan"]),
        (
            "short",
            &["short/export.json: not a plan: drone `k2`: its file b.csv is not there"],
        ),
        (
            "own",
            &["c.csv: not a plan: the file: export.json beside it counts each drone"],
        ),
    ] {
        let (code, told, errors) = run(folder, &format!("check {what} --airframe kolibri"));
        assert_eq!(code, Some(2), "{what}: {told}{errors}");
        let one_line = errors.split_whitespace().collect::<Vec<_>>().join(" ");
        for said in said {
            assert!(one_line.contains(said), "{what}: {said}\n{one_line}");
        }
    }
    for what in ["logs", "marked", "short/a.csv", "own/a.csv own/b.csv"] {
        let (code, told, errors) = run(folder, &format!("check {what} --airframe kolibri"));
        assert!(matches!(code, Some(0 | 1)), "{what}: {told}{errors}");
    }
}

#[test]
fn polynomials_of_degree_seven_are_judged_within_what_is_said() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    // 3 m along x in 3 s, from rest to rest without jerk at the ends; then a second at rest.
    let rows = |z_m: f64| {
        let d = 3.0_f64;
        let mut x = vec![0.0; 4];
        x.extend(
            [35.0, -84.0, 70.0, -20.0]
                .iter()
                .enumerate()
                .map(|(k, a)| 3.0 * a / d.powi(4 + k as i32)),
        );
        let powers = |all: &[f64]| {
            (0..8)
                .map(|k| format!(",{}", all.get(k).unwrap_or(&0.0)))
                .collect::<String>()
        };
        let row = |d: f64, x: &[f64]| {
            format!(
                "{d}{}{}{}{}\n",
                powers(x),
                powers(&[1.0]),
                powers(&[z_m]),
                powers(&[])
            )
        };
        let header = "duration,x^0,x^1,x^2,x^3,x^4,x^5,x^6,x^7,y^0,y^1,y^2,y^3,y^4,y^5,y^6,y^7,z^0,z^1,z^2,z^3,z^4,z^5,z^6,z^7,yaw^0,yaw^1,yaw^2,yaw^3,yaw^4,yaw^5,yaw^6,yaw^7\n";
        header.to_owned() + &row(d, &x) + &row(1.0, &[3.0])
    };
    fs::write(folder.join("cf1.csv"), rows(1.0)).unwrap();
    fs::write(folder.join("cf2.csv"), rows(1.2)).unwrap();
    let (code, told) = judged(folder, "cf1.csv cf2.csv");
    assert_eq!(code, Some(1));
    let remarks = told["remarks"].to_string();
    assert!(
        remarks.contains("2 pieces of a degree above 3") && remarks.contains("within 0.1 mm"),
        "{remarks}"
    );
    let exposed = told["violations"].as_array().unwrap().iter();
    assert!(exposed.clone().all(|it| it["drone"] == "cf1"), "{told}");
    // Counted from each one's own place.
    let fleet = "Fleet(drones: [(name: \"cf1\", airframe: \"crazyflie-2.1\"), (name: \"cf2\", airframe: \"crazyflie-2.1\", origin_m: (0, 3, 0))])";
    fs::write(folder.join("fleet.ron"), fleet).unwrap();
    let (code, told, errors) = run(folder, "check cf1.csv cf2.csv --airframes fleet.ron");
    assert_eq!(code, Some(0), "{told}{errors}");
}

#[test]
fn a_show_that_cannot_be_read_is_reported_where_it_is_broken() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    let put = |name: &str, bytes: &[u8]| fs::write(folder.join(name), bytes).unwrap();
    put("v2.skyc", &show(2, 1.0));
    put("no.skyc", b"PK, but not for long");
    let bad = zip(&[(
        "show.json",
        json!({"version": 1, "swarm": {"drones": [
            {"settings": {"trajectory": {"version": 1, "points": [[0, [0, 0, 1], []], [0, [1, 0, 1], []]]}}}
        ]}}),
    )]);
    put("time.skyc", &bad);
    let dark = zip(&[(
        "show.json",
        json!({"version": 1, "swarm": {"drones": [
            {"settings": {"lights": {"version": 3, "data": ""}, "trajectory": {"version": 1, "points": [[0, [0, 0, 1], []]]}}}
        ]}}),
    )]);
    put("dark.skyc", &dark);
    put("columns.csv", b"time,px,py,pz\n0,1,2,3\n");
    put("short.csv", b"t_s,x_m,y_m,z_m\n0,1,2,3\n1,1,2\n");
    put(
        "many.csv",
        b"t_s,x_m,y_m,z_m\n0,1,2,3\n1,one,2,3\n2,1,2\n3,1,2\n",
    );
    put(
        "back.csv",
        b"Time_msec,X_m,Y_m,Z_m\n0,1,2,3\n500,1,2,3\n400,1,2,3\n",
    );
    put("poly.csv", b"Duration,x^0\n1,2\n");
    put("tabs.csv", b"t_s\tx_m\ty_m\tz_m\n0\t1\t2\t3\n");
    // Up where down is asked for, and down where up is.
    put("ned.csv", b"t_s,n_m,e_m,d_m\n0,1,2,-0.1\n3,1,2,2.5\n");
    put("enu.csv", b"t_s,x_m,y_m,z_m\n0,1,2,0\n2,1,2,-3\n4,1,2,-3\n");
    for (what, said) in [
        (
            "v2.skyc",
            "v2.skyc: not a plan: show.json: version 2, this program reads 1",
        ),
        ("no.skyc", "no zip"),
        (
            "time.skyc",
            "swarm.drones[0].settings.trajectory: points[1]: time does not go on",
        ),
        (
            "dark.skyc",
            "swarm.drones[0].settings.lights: lights of version 3",
        ),
        (
            "columns.csv",
            "columns.csv: not a plan: line 1: no table that is known begins `time,px,py,pz`",
        ),
        ("short.csv", "line 3: 3 columns, 4 expected"),
        (
            "many.csv",
            "line 3: column 2: `one` is no finite number lines 4, 5: 3 columns, 4 expected",
        ),
        ("back.csv", "line 4: time does not go on"),
        ("poly.csv", "line 2: 2 columns, 33 expected"),
        ("tabs.csv", "write commas instead of tabs"),
        (
            "ned.csv",
            "`ned` is at z = -2.50 m at 3.00 s, below the floor (z = 0 m)",
        ),
        (
            "enu.csv",
            "`enu` is at z = -3.00 m at 2.00 s, below the floor (z = 0 m); z_m counts up and d_m down: columns of the other kind",
        ),
        (
            "short.csv columns.csv",
            "short.csv: line 3: 3 columns, 4 expected columns.csv: line 1: no table",
        ),
        ("enu.csv ./enu.csv", "a second drone `enu`"),
        (".", "dark.skyc"),
    ] {
        let (code, told, errors) = run(folder, &format!("check {what} --airframe kolibri"));
        assert_eq!(code, Some(2), "{what}: {told}{errors}");
        let one_line = errors.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(one_line.contains(said), "{what}: {one_line}");
    }
    // A floor that lies deeper is no mistake.
    put(
        "pit.ron",
        b"Fleet(airframe: \"kolibri\", bounds_m: (min: (-5, -5, -4), max: (5, 5, 5)))",
    );
    let (code, told, errors) = run(folder, "check enu.csv --airframes pit.ron");
    assert_eq!(code, Some(0), "{told}{errors}");
    let (code, _, errors) = run(folder, "check enu.csv --airframe quadcopter");
    assert_eq!(code, Some(2));
    assert!(
        errors.contains("no airframe is called `quadcopter`"),
        "{errors}"
    );
    put(
        "more.ron",
        b"Fleet(airframe: \"kolibri\", drones: [(name: \"x\", airframe: \"kolibri\")])",
    );
    let (code, _, errors) = run(folder, "check short.csv --airframes more.ron");
    assert_eq!(code, Some(2), "{errors}");
    let (code, _, errors) = run(folder, "check ned.csv --airframes more.ron");
    assert_eq!(code, Some(2));
    assert!(errors.contains("drone `x` is not in the show"), "{errors}");
}
