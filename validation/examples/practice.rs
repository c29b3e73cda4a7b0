//! Assesses a diagnosis on the practice set: `cargo run --release -p leeward-validation --example
//! practice -- FOLDER`.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;

use diagnosis::record::read::read_folder;
use diagnosis::record::recording::Recording;
use validation::metrics::{Assessed, Metrics, practice};
use validation::{Truth, ask};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("which folder?")?;
    let mut names: Vec<String> = Vec::new();
    for entry in fs::read_dir(Path::new(&folder).join("truth"))? {
        let name = entry?
            .file_name()
            .into_string()
            .map_err(|_| "a name that is no text")?;
        names.extend(name.strip_suffix(".json").map(str::to_owned));
    }
    names.sort();
    let mut assessed = Vec::new();
    for name in names {
        let recording = recording(&Path::new(&folder).join(&name), &name)?;
        let started = Instant::now();
        let mut answer = ask(&recording);
        answer.seconds = started.elapsed().as_secs_f64();
        // Unblinded only now.
        let text = fs::read_to_string(
            Path::new(&folder)
                .join("truth")
                .join(format!("{name}.json")),
        )?;
        let truth: Truth = practice(&text, recording.probes.is_none())?;
        let of_this = Assessed::of(&truth, &answer);
        println!("{name} {}", of_this.line());
        assessed.push(of_this);
    }
    let metrics = Metrics::over(assessed);
    println!(
        "\n{}{}\n{}",
        metrics.table(),
        metrics.time_line(),
        metrics.confusion_table()
    );
    Ok(())
}

fn recording(folder: &Path, name: &str) -> Result<Recording, Box<dyn Error>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let file = entry
            .file_name()
            .into_string()
            .map_err(|_| "a name that is no text")?;
        files.insert(file, fs::read(entry.path())?);
    }
    Ok(read_folder(name, &files)?)
}
