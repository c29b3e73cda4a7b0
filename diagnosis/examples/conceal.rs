//! Writes made-up recordings with their truths beside them, to look at:
//! `cargo run --release -p diagnosis --example conceal -- FOLDER COUNT SEED`.

use std::error::Error;
use std::fs;
use std::path::Path;

use diagnosis::made_up::texts;
use diagnosis::prove::{Answer, Case, case};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("which folder?")?;
    let count: usize = arguments.next().ok_or("how many?")?.parse()?;
    let seed: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let truths = Path::new(&folder).join("truth");
    fs::create_dir_all(&truths)?;
    for index in 0..count {
        let Case { recording, truth } = case(seed, index);
        let here = Path::new(&folder).join(&recording.name);
        fs::create_dir_all(&here)?;
        for (name, text) in texts(&recording) {
            fs::write(here.join(name), text)?;
        }
        let truth = truth.open(&Answer::nothing());
        println!(
            "{} {} chi2 {:.0}",
            recording.name, truth.family, truth.oracle_chi2
        );
        let text = serde_json::to_string(&truth)?;
        fs::write(truths.join(format!("{}.json", recording.name)), text)?;
    }
    Ok(())
}
