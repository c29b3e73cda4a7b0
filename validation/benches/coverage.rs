//! How often do the intervals of a calibration hold the true constants of the jet, and how often is
//! a fit called poor?
//!
//! `cargo bench -p leeward-validation --bench coverage -- 1000 4` (campaigns; flights a drone). The
//! answers stand in the documentation of `diagnosis::calibrate`.

use diagnosis::calibrate::{Options, Verdict, calibrate};
use rayon::prelude::*;
use validation::hover_grid::{HoverGrid, TrueJet, TrueProfile};

/// The drones of the paper without cant.
const UNCANTED: [&str; 4] = ["kolibri", "offboard-1", "offboard-2", "matrice-300"];

/// Which of the three constants an interval holds, and whether the fit is called poor.
type Answer = ([bool; 3], bool);

fn campaign(seed: u64, flights: u64, profile: TrueProfile) -> Answer {
    let mut recordings = Vec::new();
    for (name, drone) in UNCANTED.iter().zip(0..) {
        let mut grid = HoverGrid::over_one_probe(name).expect("a drone of the paper");
        grid.jet.profile = profile;
        recordings.extend((0..flights).map(|flight| grid.fly(seed * 1000 + drone * 100 + flight)));
    }
    let found = calibrate(&recordings, &Options::default()).expect("enough readings");
    let truth = TrueJet::default();
    let held = [
        (&found.jet.centreline, truth.centreline),
        (&found.jet.spreading, truth.spreading),
        (&found.jet.origin, truth.origin),
    ]
    .map(|(estimate, value)| (estimate.interval.low..=estimate.interval.high).contains(&value));
    (held, found.goodness.verdict == Verdict::Poor)
}

fn main() {
    let mut numbers = std::env::args().filter_map(|word| word.parse::<u64>().ok());
    let campaigns = numbers.next().unwrap_or(100);
    let flights = numbers.next().unwrap_or(4);
    println!(
        "{campaigns} campaigns of {flights} flights a drone: intervals that hold B, S, s0; fits called poor (%)"
    );
    for profile in [
        TrueProfile::Paper,
        TrueProfile::Gaussian,
        TrueProfile::GaussianTail,
        TrueProfile::TopHat,
    ] {
        let answers: Vec<Answer> = (0..campaigns)
            .into_par_iter()
            .map(|seed| campaign(seed, flights, profile))
            .collect();
        let percent = |hit: &dyn Fn(&Answer) -> bool| {
            100.0 * answers.iter().filter(|answer| hit(answer)).count() as f64 / campaigns as f64
        };
        let held = [0, 1, 2].map(|k| percent(&|answer| answer.0[k]));
        println!(
            "{profile:?}: {held:.1?}  {:.1}",
            percent(&|answer| answer.1)
        );
    }
}
