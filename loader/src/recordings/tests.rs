//! Folders of recordings written here, sound and spoilt.

use super::*;

const CAMPAIGN_RON: &str = r#"(
    name: "c", air: (temperature_c: 20),
    types: { "t": (mass_kg: Stated(1), propeller_diameter_m: Stated(0.2), motor_distance_m: Stated(0.4), rotor_offset_m: Stated((0, 0, 0))) },
    vehicles: { "v": "t" },
)"#;
const ASKED: Meta<'_> = Meta {
    file: None,
    option: "--meta",
};
const LOG: &str = "t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps\n0,0,0,1,0,0,0\n0.02,0,0,1,0,0,0\n";

fn packed(text: &str) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut packer, text.as_bytes()).expect("memory takes it");
    packer.finish().expect("memory takes it")
}

fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, bytes) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("below the folder")).expect("made");
        fs::write(path, bytes).expect("written");
    }
    folder
}

fn names(read: &ReadAll) -> Vec<&str> {
    read.recordings
        .iter()
        .map(|recording| recording.name.as_str())
        .collect()
}

fn said(answer: Result<ReadAll, LoadError>) -> String {
    answer.expect_err("is refused").to_string()
}

#[test]
fn logs_plain_and_packed_are_found_with_the_campaign_file_above_them_and_sorted_by_name() {
    let packed = packed(LOG);
    let folder = folder(&[
        ("campaign.ron", CAMPAIGN_RON.as_bytes()),
        ("flights/b.csv", LOG.as_bytes()),
        ("flights/a.csv.gz", &packed),
        ("flights/notes.txt", b"not a log"),
        ("index.csv", b"beside, not a flight"),
    ]);
    let read = read_all(&[folder.path().to_owned()], ASKED).expect("in order");
    assert_eq!(names(&read), ["a", "b"]);
    let one = [
        folder.path().join("flights/b.csv"),
        folder.path().join("flights/b.csv"),
    ];
    assert_eq!(names(&read_all(&one, ASKED).expect("in order")), ["b"]);
}

#[test]
fn a_campaign_file_named_by_hand_goes_before_any_other() {
    let spoilt = CAMPAIGN_RON.replace("mass_kg: Stated(1)", "mass_kg: Stated(-1)");
    let folder = folder(&[
        ("campaign.ron", spoilt.as_bytes()),
        ("mine.ron", CAMPAIGN_RON.as_bytes()),
        ("a.csv", LOG.as_bytes()),
    ]);
    let paths = [folder.path().join("a.csv")];
    let by_hand = folder.path().join("mine.ron");
    assert_eq!(
        names(
            &read_all(
                &paths,
                Meta {
                    file: Some(&by_hand),
                    ..ASKED
                }
            )
            .expect("in order")
        ),
        ["a"]
    );
    let said = said(read_all(&paths, ASKED));
    assert!(
        said.contains("campaign.ron:3: column 36: -1 is not a finite number above 0"),
        "{said}"
    );
}

#[test]
fn all_problems_of_all_files_are_printed_at_once_each_at_its_place() {
    let spoilt = LOG.replace("0.02,0", "0.02,zero");
    let unit_less = LOG.replace(",z_m", ",z");
    let folder = folder(&[
        ("campaign.ron", CAMPAIGN_RON.as_bytes()),
        ("a.csv", spoilt.as_bytes()),
        ("b.csv", unit_less.as_bytes()),
    ]);
    let said = said(read_all(&[folder.path().to_owned()], ASKED));
    assert!(
        said.contains("a.csv:3: `x_m`: is not a number: \"zero\""),
        "{said}"
    );
    assert!(
        said.contains("b.csv:1: `z`: has no unit in its name"),
        "{said}"
    );
    assert!(said.contains("help: name it one of `z_m`"), "{said}");
    assert_eq!(said.matches("help: ").count(), 1, "{said}");
}

#[test]
fn a_flight_of_several_logs_is_not_named_after_a_path() {
    let joined = "joined: { \"../x\": { \"v\": \"a\" } },\n)";
    let campaign = CAMPAIGN_RON.replace("\n)", &format!("\n    {joined}"));
    let folder = folder(&[
        ("campaign.ron", campaign.as_bytes()),
        ("a.csv", LOG.as_bytes()),
    ]);
    let said = said(read_all(&[folder.path().to_owned()], ASKED));
    assert!(
        said.contains("flight `../x` has the name of a path"),
        "{said}"
    );
}

#[test]
fn what_is_no_recording_is_said_with_the_way_out() {
    let folder = folder(&[
        ("a.csv", LOG.as_bytes()),
        ("b.txt", b""),
        ("empty/c.txt", b""),
        ("torn.csv.gz", b"\x1f\x8b\x08"),
    ]);
    let ask = |name: &str| said(read_all(&[folder.path().join(name)], ASKED));
    assert!(ask("a.csv").contains("has no campaign file"));
    assert!(ask("b.txt").contains("is no flight log"));
    assert!(ask("empty").contains("holds no recording"));
    assert!(ask("nowhere").starts_with("cannot read"));
    let paths = ["nowhere", "neither", "b.txt"].map(|name| folder.path().join(name));
    let all = said(read_all(&paths, ASKED));
    for name in ["nowhere: ", "neither: ", "b.txt: is no flight log"] {
        assert!(all.contains(name), "{all}");
    }
    let by_hand = folder.path().join("mine.ron");
    fs::write(&by_hand, CAMPAIGN_RON).expect("written");
    let torn = said(read_all(
        &[folder.path().join("torn.csv.gz")],
        Meta {
            file: Some(&by_hand),
            ..ASKED
        },
    ));
    assert!(torn.contains("torn.csv.gz: cannot be read: "), "{torn}");
}

#[test]
fn the_tables_of_one_px4_log_are_one_recording() {
    let position = "timestamp,x,y,z,vx,vy,vz\n0,0,0,-1,0,0,0\n20000,0,0,-1,0,0,0\n";
    let folder = folder(&[
        ("campaign.ron", CAMPAIGN_RON.as_bytes()),
        ("log_7_vehicle_local_position_0.csv", position.as_bytes()),
        ("log_7_cpuload_0.csv", b"timestamp,load\n0,0.1\n"),
    ]);
    let read = read_all(&[folder.path().to_owned()], ASKED).expect("in order");
    assert_eq!(names(&read), ["log_7"]);
    assert_eq!(read.recordings[0].vehicles[0].track.position_m[0].z, 1.0);
}

#[test]
fn a_flight_that_cannot_be_used_is_left_out_with_a_remark_and_copies_are_one_flight() {
    let folder = folder(&[
        ("campaign.ron", CAMPAIGN_RON.as_bytes()),
        ("a.csv", LOG.as_bytes()),
        ("b.csv", b"t_s,x_m,y_m,z_m\n0,zero,0,1\n"),
        ("c.csv", LOG.as_bytes()),
    ]);
    let read = read_all(&[folder.path().to_owned()], ASKED).expect("one is left");
    assert_eq!(names(&read), ["a"]);
    // Each under its own name.
    let is_told = |of: &str, words: &str| {
        let mut left_out = read.left_out.iter();
        left_out.any(|(name, remark)| name == of && remark.message.contains(words))
    };
    assert!(is_told("b", "b.csv is left out"), "{read:#?}");
    assert!(is_told("b", "is not a number: \"zero\""), "{read:#?}");
    assert!(is_told("c", "c.csv is a copy of"), "{read:#?}");
    // What is named is not left out.
    let said = said(read_all(
        &[folder.path().join("a.csv"), folder.path().join("b.csv")],
        ASKED,
    ));
    assert!(said.contains("b.csv:2"), "{said}");
}

#[test]
fn a_log_without_metadata_asks_for_the_fewest_lines_that_would_do() {
    let folder = folder(&[("a.csv", LOG.as_bytes())]);
    let path = folder.path().join("a.csv");
    let asked = said(read_all(std::slice::from_ref(&path), ASKED));
    assert!(asked.contains("vehicles: { \"a\": \"drone\" }"), "{asked}");
}

#[test]
fn a_folder_of_tables_without_their_metadata_is_told_of_and_not_read() {
    let folder = folder(&[
        ("campaign.ron", CAMPAIGN_RON.as_bytes()),
        ("a.csv", LOG.as_bytes()),
        ("bare/probes.csv", b"t,probe,s\n"),
        ("notes/read.me", b"no recording"),
    ]);
    let read = read_all(&[folder.path().to_owned()], ASKED).expect("one is in order");
    assert_eq!(names(&read), ["a"]);
    let [(name, remark)] = &read.left_out[..] else {
        panic!("{:?}", read.left_out);
    };
    let bare = folder.path().join("bare");
    let message = format!(
        "{} is left out: {}: is missing",
        bare.display(),
        bare.join("meta.json").display()
    );
    assert_eq!((&name[..], &remark.message), ("bare", &message));
}

#[test]
fn folders_in_a_folder_that_hold_recordings_are_told_to_be_left_out() {
    let folder = folder(&[
        ("campaign.ron", CAMPAIGN_RON.as_bytes()),
        ("all/a.csv", LOG.as_bytes()),
        ("all/day2/b.csv", LOG.replace("0.02", "0.03").as_bytes()),
        ("all/notes/c.txt", b"no log"),
        ("days/day1/c.csv", LOG.as_bytes()),
    ]);
    let [all, days] = ["all", "days"].map(|name| folder.path().join(name));
    let read = read_all(std::slice::from_ref(&all), ASKED).expect("in order");
    assert_eq!(names(&read), ["a"]);
    let [(name, remark)] = &read.left_out[..] else {
        panic!("{:?}", read.left_out);
    };
    assert_eq!(name, "day2");
    assert!(
        remark.message.contains("name it, too"),
        "{}",
        remark.message
    );
    let both = [all.clone(), all.join("day2")];
    let read = read_all(&both, ASKED).expect("in order");
    assert_eq!(names(&read), ["a", "b"]);
    assert!(read.left_out.is_empty(), "{:?}", read.left_out);
    let said = said(read_all(&[days], ASKED));
    assert!(said.contains("name them: "), "{said}");
    assert!(said.contains("day1"), "{said}");
}
