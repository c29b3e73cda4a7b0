#![allow(missing_docs)]
use diagnosis::campaign::*;
use std::io::Read;
fn all(set: &str) -> Vec<diagnosis::recording::Recording> {
    let root = std::path::PathBuf::from(format!("/work/shared/recordings/{set}/flights"));
    let text = std::fs::read_to_string(format!("/work/wt/real/recordings/{set}.ron")).unwrap();
    let campaign = diagnosis::read::Campaign::parse("m", &text).unwrap();
    let mut paths: Vec<_> = std::fs::read_dir(&root)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    paths.sort();
    paths
        .iter()
        .filter_map(|p| {
            let mut bytes = Vec::new();
            flate2::read::GzDecoder::new(std::fs::File::open(p).unwrap())
                .read_to_end(&mut bytes)
                .unwrap();
            let name = p
                .file_name()
                .unwrap()
                .to_string_lossy()
                .replace(".csv.gz", "");
            diagnosis::read::read_flight(&name, &name, &bytes, &campaign)
                .map_err(|e| eprintln!("{name}: {e:?}"))
                .ok()
        })
        .collect()
}
#[test]
fn run() {
    let which = std::env::var("WHICH").unwrap();
    let rows: usize = std::env::var("ROWS")
        .ok()
        .map_or(6000, |s| s.parse().unwrap());
    if which == "hardware" {
        let recordings = all("crazypad");
        let drones: Vec<&str> = recordings
            .iter()
            .map(|r| if r.name.contains("__E8") { "E8" } else { "E9" })
            .collect();
        let normal: Vec<bool> = recordings
            .iter()
            .map(|r| r.name.starts_with("normal"))
            .collect();
        print!(
            "{}",
            table::hardware_markdown(&table::hardware_rows(&recordings, &drones, &normal))
        );
        return;
    }
    let recordings = all("neural_swarm2");
    let mut options = CampaignOptions {
        most_rows: rows,
        most_effects: std::env::var("MOST").ok().map_or(6, |s| s.parse().unwrap()),
        ..CampaignOptions::default()
    };
    match which.as_str() {
        "alone" => options.alone = true,
        "jet" => {}
        "floor" => options.judge = near_floor(&recordings),
        _ => panic!(),
    }
    let t0 = std::time::Instant::now();
    let f = diagnose_campaign(&recordings, &options).unwrap();
    eprintln!("{:?}", t0.elapsed());
    print!("{}", table::report(&f));
    println!(
        "verdict {:?} chance {} shape {:?}",
        f.finding.verdict, f.finding.chance, f.finding.shape
    );
    for r in &f.finding.candidates {
        println!(
            "  {:22} {:9.1} +- {:7.1} {} {:?}",
            r.name, r.gain, r.gain_error, r.practical, r.parameters
        );
    }
    print!("{}", table::markdown(&[table::row(&which, &f, 1)]));
}
