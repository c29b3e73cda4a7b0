//! `plan simulate`, `plan calibrate` and `plan generate recordings` as a person or a script meets
//! them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The synthetic flights that ship.
fn shelf() -> PathBuf {
    root().join("recordings/hover-grids")
}

/// The command in an empty folder.
fn plan(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plan"));
    command.current_dir(folder).args(arguments);
    command
}

fn shipped(name: &str) -> String {
    shelf().join(name).display().to_string()
}

fn texts(output: &Output) -> (i32, &str, &str) {
    (
        output.status.code().unwrap(),
        std::str::from_utf8(&output.stdout).unwrap(),
        std::str::from_utf8(&output.stderr).unwrap(),
    )
}

/// Every file below a folder with its bytes, sorted.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let inside = path.strip_prefix(folder).unwrap().to_owned();
                found.push((inside, fs::read(&path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

fn names(folder: &Path) -> Vec<String> {
    contents(folder)
        .into_iter()
        .map(|(path, _)| path.display().to_string())
        .collect()
}

/// Nothing that a browser would fetch, and nothing that runs.
fn assert_opens_offline(html: &str) {
    assert!(html.starts_with("<!DOCTYPE html>") && html.trim_end().ends_with("</html>"));
    for fetched in ["src=", "href=", "url(", "@import", "<script", "<link"] {
        assert!(!html.contains(fetched), "{fetched}");
    }
    let names = html.replace("http://www.w3.org/2000/svg", "");
    assert!(!names.contains("http://") && !names.contains("https://"));
    assert_eq!(html.matches("<svg").count(), html.matches("</svg>").count());
}

#[test]
fn a_recording_is_simulated_sample_by_sample_and_its_report_opens_offline() {
    let desk = tempfile::tempdir().unwrap();
    let output = plan(desk.path(), &["simulate", &shipped("kolibri-1")]);
    let (code, report, errors) = texts(&output);
    assert_eq!((code, errors), (0, ""));
    assert!(
        report.starts_with("kolibri-1: recorded and simulated\n1 recording, "),
        "{report}"
    );
    assert!(report.contains("depth s/l"), "{report}");
    let folder = desk.path().join("out/simulate/kolibri-1");
    assert_eq!(
        names(&folder),
        [
            "expansion.svg",
            "field.svg",
            "profiles.svg",
            "report.html",
            "residuals.json",
            "residuals.svg",
            "speed.csv"
        ]
    );
    let table = fs::read_to_string(folder.join("speed.csv")).unwrap();
    assert!(
        table.starts_with(
            "recording,row,t_s,subject,x_m,y_m,z_m,height_m,recorded_mps,simulated_mps,residual_mps,"
        ),
        "{table}"
    );
    let recorded = fs::read_to_string(shelf().join("kolibri-1/probes.csv")).unwrap();
    assert_eq!(table.lines().count(), recorded.lines().count());
    let residuals: Value =
        serde_json::from_str(&fs::read_to_string(folder.join("residuals.json")).unwrap()).unwrap();
    assert_eq!(residuals["samples"], table.lines().count() - 1);
    assert!(residuals["regions"].as_array().unwrap().len() > 10);
    let html = fs::read_to_string(folder.join("report.html")).unwrap();
    assert_opens_offline(&html);
    assert_eq!(html.matches("<figure>").count(), 4);
}

#[test]
fn thrust_maps_of_one_airframe_each_say_what_they_take_and_an_exact_one_of_rotors_leaves_nothing() {
    let desk = tempfile::tempdir().unwrap();
    let mut log = String::from(
        "t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,qx,qy,qz,qw,rpm1,rpm2,rpm3,rpm4\n",
    );
    for tick in 0..2000 {
        let t_s = f64::from(tick) * 0.01;
        let (sine, cosine) = (2.0 * t_s).sin_cos();
        let (z_m, vz_mps, az_mps2) = (1.5 - 0.1 * sine, -0.2 * cosine, 9.81 + 0.4 * sine);
        let rpm = 20_000.0 * (az_mps2 / 9.81).sqrt();
        log += &format!(
            "{t_s},0,0,{z_m},0,0,{vz_mps},0,0,{az_mps2},0,0,0,1,{rpm},{rpm},{rpm},{rpm}\n"
        );
    }
    fs::write(desk.path().join("log.csv"), &log).unwrap();
    let campaign = r#"(name: "c", air: (temperature_c: 20), acceleration: SpecificForceInWorld, types: { "s": (
        mass_kg: Stated(0.034), propeller_diameter_m: Stated(0.046), motor_distance_m: Stated(0.092),
        rotor_offset_m: Stated((0, 0, 0))) }, vehicles: { "a": "s" })"#;
    fs::write(desk.path().join("campaign.ron"), campaign).unwrap();
    let output = plan(desk.path(), &["simulate", "log.csv", "--out", "o"]);
    let (code, told, errors) = texts(&output);
    assert_eq!(code, 0, "{errors}");
    let map = "lag 0 ms; leaves 0.0000 N rms of 2000 rows in 1 flights; for tips of rotors at 0.14 to 0.14 of the speed of sound";
    assert!(told.contains(map), "{told}");
    // The same flight told by its thrust, too.
    let of_thrust = log.lines().map(|line| {
        let rest = line.rsplitn(5, ',').last().unwrap();
        let az_mps2 = rest.split(',').nth(9).unwrap().parse::<f64>();
        let thrust_n = az_mps2.map_or("thrust_n".to_owned(), |az| (0.034 * az).to_string());
        format!("{rest},{thrust_n}\n")
    });
    let both = desk.path().join("both");
    fs::create_dir(&both).unwrap();
    fs::write(both.join("thrust.csv"), of_thrust.collect::<String>()).unwrap();
    fs::write(both.join("rotors.csv"), log).unwrap();
    fs::write(both.join("campaign.ron"), campaign).unwrap();
    let output = plan(desk.path(), &["simulate", "both", "--format", "json"]);
    let printed: Value = serde_json::from_str(texts(&output).1).unwrap();
    let maps = printed["thrust_maps"].as_array().unwrap().iter();
    let kinds: Vec<_> = maps.map(|map| [&map["airframe"], &map["source"]]).collect();
    assert_eq!(kinds, [["s", "thrust"], ["s", "rotor_speed"]]);
}

#[test]
fn diagnose_tells_the_remarks_that_simulate_tells_and_what_to_measure_next() {
    let desk = tempfile::tempdir().unwrap();
    // A probe that stands still for twenty readings.
    let folder = desk.path().join("stuck-hall");
    fs::create_dir(&folder).unwrap();
    let shipped = root().join("recordings/draughty-hall");
    for (path, bytes) in contents(&shipped) {
        fs::write(folder.join(path), bytes).unwrap();
    }
    let readings = fs::read_to_string(folder.join("probes.csv")).unwrap();
    let mut last: Option<String> = None;
    let stuck = readings.lines().enumerate().map(|(row, line)| {
        let (place, speed) = line.rsplit_once(',').unwrap();
        let speed = match (row, &last) {
            (101..=120, Some(held)) => held.clone(),
            _ => speed.to_owned(),
        };
        last = Some(speed.clone());
        format!("{place},{speed}\n")
    });
    let stuck: String = stuck.collect();
    fs::write(folder.join("probes.csv"), stuck).unwrap();
    let said = |command: &str| {
        let output = plan(desk.path(), &[command, "stuck-hall", "--format", "json"]);
        let (code, printed, errors) = texts(&output);
        assert_eq!((code, errors), (0, ""), "{command}");
        serde_json::from_str::<Value>(printed).unwrap()
    };
    let (simulated, diagnosed) = (said("simulate"), said("diagnose"));
    assert_eq!(simulated["remarks"], diagnosed["remarks"]);
    let remarks = diagnosed["remarks"].as_array().unwrap();
    let is_stuck = |remark: &Value| remark["kind"] == "stuck";
    assert!(remarks.iter().any(is_stuck), "{remarks:?}");
    assert!(!diagnosed["advice"].as_array().unwrap().is_empty());
    let page = desk.path().join("out/diagnose/stuck-hall/report.html");
    let page = fs::read_to_string(page).unwrap();
    assert!(
        page.contains("Remarks") && page.contains("left out"),
        "{remarks:?}"
    );
}

#[test]
fn the_jet_is_calibrated_from_the_recordings_that_ship() {
    let desk = tempfile::tempdir().unwrap();
    let all = shelf().display().to_string();
    let output = plan(
        desk.path(),
        &["calibrate", &all, "--out", "here", "--format", "json"],
    );
    let (code, printed, errors) = texts(&output);
    assert_eq!((code, errors), (0, ""));
    let printed: Value = serde_json::from_str(printed).unwrap();
    assert_eq!(printed["format"], "calibration/1");
    let first = &printed["remarks"][0];
    assert!(
        first["recording"].is_string() && first["message"].is_string(),
        "{first}"
    );
    let page = fs::read_to_string(desk.path().join("here/report.html")).unwrap();
    assert!(page.contains("jackknife") && !page.contains("bootstrap"));
    // Made from the paper's jet: what made them lies in the intervals.
    for (name, truth) in [
        ("centreline", 10.11),
        ("spreading", 0.07668),
        ("origin", -5.817),
    ] {
        let interval = &printed["jet"][name]["interval"];
        let (low, high) = (
            interval["low"].as_f64().unwrap(),
            interval["high"].as_f64().unwrap(),
        );
        assert!(low < truth && truth < high, "{name}: {low} to {high}");
    }
    let drones = printed["drones"].as_array().unwrap();
    assert_eq!(
        drones
            .iter()
            .filter(|drone| drone["in_fit"] == false)
            .count(),
        2
    );
    let folder = desk.path().join("here");
    assert_eq!(
        names(&folder),
        [
            "calibration.json",
            "expansion.svg",
            "jet.ron",
            "profiles.svg",
            "report.html",
            "residuals.svg"
        ]
    );
    assert_opens_offline(&fs::read_to_string(folder.join("report.html")).unwrap());
    let kept: Value =
        serde_json::from_str(&fs::read_to_string(folder.join("calibration.json")).unwrap())
            .unwrap();
    assert_eq!(kept["jet"], printed["jet"]);
    let jet = fs::read_to_string(folder.join("jet.ron")).unwrap();
    assert!(jet.contains("Jet(") && jet.contains("centreline:"), "{jet}");
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let all = shelf().display().to_string();
    let run = |threads: &str| {
        let desk = tempfile::tempdir().unwrap();
        for (verb, to) in [("simulate", "a"), ("calibrate", "b")] {
            super::succeeds(
                command(desk.path(), &[verb, &all, "--out", to]).env("RAYON_NUM_THREADS", threads),
            );
        }
        contents(desk.path())
    };
    let (one, two) = (run("1"), run("2"));
    assert!(one.len() > 10);
    for ((path, first), (other, second)) in one.iter().zip(&two) {
        assert_eq!(path, other);
        assert!(first == second, "{}", path.display());
    }
}

#[test]
fn the_recordings_that_ship_are_what_their_command_writes() {
    let page = fs::read_to_string(root().join("docs/recordings.md")).unwrap();
    let line = page
        .lines()
        .find_map(|line| line.strip_prefix("plan generate "))
        .expect("docs/recordings.md states its command");
    let desk = tempfile::tempdir().unwrap();
    let mut arguments = vec!["generate"];
    arguments.extend(line.split_whitespace());
    super::succeeds(&mut command(desk.path(), &arguments));
    let now = contents(&desk.path().join("recordings/hover-grids"));
    assert!(now.len() == 18);
    let mut bytes = 0;
    for (path, made) in &now {
        let kept = fs::read(shelf().join(path)).unwrap();
        assert!(kept == *made, "{} differs", path.display());
        bytes += kept.len();
    }
    // What a clone has to carry.
    assert!(bytes < 350_000, "{bytes}");
}

#[test]
fn what_cannot_be_read_or_compared_is_a_broken_question_and_writes_nothing() {
    let desk = tempfile::tempdir().unwrap();
    fs::create_dir(desk.path().join("empty")).unwrap();
    let questions: [&[&str]; 6] = [
        &["simulate", "nowhere"],
        &["simulate", "empty"],
        &["calibrate", "empty"],
        &["simulate"],
        &["generate", "recordings"],
        &[
            "generate",
            "recordings",
            "--drones",
            "zeppelin",
            "--out",
            "made",
        ],
    ];
    for question in questions {
        let output = plan(desk.path(), question);
        let (code, printed, errors) = texts(&output);
        assert_eq!((code, printed), (2, ""), "{question:?}");
        assert!(errors.contains("error"), "{question:?}: {errors}");
        assert!(!desk.path().join("out").exists() && !desk.path().join("made").exists());
    }
}

#[test]
fn a_folder_that_cannot_be_written_leaves_no_file_behind() {
    let desk = tempfile::tempdir().unwrap();
    // A folder where a file should go.
    fs::create_dir_all(desk.path().join("here/report.html")).unwrap();
    let output = plan(
        desk.path(),
        &["simulate", &shipped("kolibri-1"), "--out", "here"],
    );
    assert_eq!(texts(&output).0, 2);
    assert_eq!(names(&desk.path().join("here")), Vec::<String>::new());
}

#[test]
fn the_expansion_picture_in_the_docs_is_of_the_run_beside_it() {
    let page = fs::read_to_string(root().join("docs/diagnosis.md")).unwrap();
    assert!(page.contains("](expansion.svg)"));
    let desk = tempfile::tempdir().unwrap();
    let all = shelf().display().to_string();
    super::succeeds(&mut command(desk.path(), &["calibrate", &all]));
    let now =
        fs::read_to_string(desk.path().join("out/calibrate/hover-grids/expansion.svg")).unwrap();
    let kept = fs::read_to_string(root().join("docs/expansion.svg")).unwrap();
    // Coordinates may differ in a last digit where another machine's sine does; the words hold all
    // figures of the fit.
    let words = |svg: &str| -> Vec<String> {
        svg.split("<text ")
            .skip(1)
            .filter_map(|text| text.split_once('>')?.1.split_once('<'))
            .map(|(word, _)| word.to_owned())
            .collect()
    };
    assert!(
        words(&now)
            .iter()
            .any(|word| word.starts_with("calibrated: "))
    );
    assert_eq!(
        words(&kept),
        words(&now),
        "draw docs/expansion.svg again, see docs/diagnosis.md"
    );
}
