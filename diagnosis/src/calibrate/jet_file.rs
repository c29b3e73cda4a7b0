//! The text of `jet.ron`: what a scenario cites to fly with a calibrated jet.

use std::fmt::Write as _;

use super::calibration::{Calibration, Estimate, Interval, Verdict};

/// The fitted jet with its intervals and where it comes from, as RON that a scenario cites: `air: (jet: "jet.ron")`.
///
/// ```text
/// Jet(
///     centreline: 10.11,           B; the three constants are required
///     spreading: 0.07668,          S
///     origin: -5.817,              s₀ in motor distances
///     centreline_95: (9.8, 10.4),  95 % intervals, and what else is known: optional
///     ...
/// )
/// ```
///
/// It names recordings and counts, no date: the same recordings give the same bytes.
#[must_use]
pub fn jet_ron(calibration: &Calibration) -> String {
    let jet = &calibration.jet;
    let mut text = String::from(
        "// The mean jet below hovering drones, calibrated: U_C/U_H = centreline/(s/l - origin), half-width/l = spreading (s/l - origin).\n\
         // A scenario flies with it: air: (jet: \"jet.ron\")\n\
         Jet(\n",
    );
    let constants: [(&str, &Estimate, usize); 3] = [
        ("centreline", &jet.centreline, 4),
        ("spreading", &jet.spreading, 6),
        ("origin", &jet.origin, 4),
    ];
    for (key, estimate, digits) in constants {
        let _ = writeln!(text, "    {key}: {:.digits$},", estimate.value);
    }
    for (key, estimate, digits) in constants {
        let Interval { low, high } = estimate.interval;
        let _ = writeln!(text, "    {key}_95: ({low:.digits$}, {high:.digits$}),");
    }
    let Interval { low, high } = jet.centreline_if_one_gain;
    let _ = writeln!(
        text,
        "    // If all flights shared one gain of the probe, which resampling cannot see:\n    \
         centreline_95_if_one_gain: ({low:.4}, {high:.4}),"
    );
    let correlation = &jet.correlation;
    let _ = writeln!(
        text,
        "    // Of centreline with spreading, centreline with origin, spreading with origin:\n    \
         correlation: ({:.3}, {:.3}, {:.3}),",
        correlation.centreline_spreading,
        correlation.centreline_origin,
        correlation.spreading_origin
    );
    let fit = match calibration.goodness.verdict {
        Verdict::Fits => "Fits",
        Verdict::Poor => "Poor",
        Verdict::Undecided => "Undecided",
    };
    let _ = writeln!(
        text,
        "    // {}\n    fit: {fit},",
        calibration.goodness.sentence
    );
    let counts = &calibration.counts;
    let _ = writeln!(
        text,
        "    readings: {},\n    cells: {},",
        counts.far, counts.cells
    );
    let _ = writeln!(text, "    flights: {},\n    recordings: [", jet.gains.len());
    for name in &calibration.recordings {
        // Rust and RON escape a text alike.
        let _ = writeln!(text, "        {name:?},");
    }
    text.push_str("    ],\n)\n");
    text
}
