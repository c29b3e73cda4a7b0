//! Calibrations as people read them.

use diagnosis::calibrate::{Calibration, Dropped, Estimate, Interval, ResidualTest, Unit, Verdict};

use crate::report::page::Table;
use crate::report::words::count;

fn table(headings: &[&str], rows: Vec<Vec<String>>) -> Table {
    Table {
        headings: headings.iter().map(|&heading| heading.to_owned()).collect(),
        rows,
    }
}

/// `8 recordings, 4 drones in the fit (kolibri, ...), 2 beside it (...)`.
pub(super) fn what(found: &Calibration) -> String {
    let names = |in_fit: bool| -> Vec<&str> {
        let drones = found.drones.iter().filter(|drone| drone.in_fit == in_fit);
        drones.map(|drone| drone.airframe.as_str()).collect()
    };
    let mut text = format!(
        "{}, {} in the fit ({})",
        count(found.recordings.len(), "recording", "recordings"),
        count(names(true).len(), "airframe", "airframes"),
        names(true).join(", ")
    );
    if !names(false).is_empty() {
        text += &format!(
            ", {} beside it ({})",
            count(names(false).len(), "canted one", "canted ones"),
            names(false).join(", ")
        );
    }
    text
}

fn verdict(found: &Calibration) -> &'static str {
    match found.goodness.verdict {
        Verdict::Fits => "fits",
        Verdict::Poor => "POOR FIT",
        Verdict::Undecided => "undecided",
    }
}

/// B, S and s₀ with their intervals beside the paper's.
pub(super) fn constants(found: &Calibration) -> Table {
    let paper = airflow::Jet::default();
    let jet = &found.jet;
    let row = |name: &str, estimate: &Estimate, digits: usize, paper: f64| {
        let Interval { low, high } = estimate.interval;
        vec![
            name.to_owned(),
            format!("{:.digits$}", estimate.value),
            format!("{low:.digits$} to {high:.digits$}"),
            format!("{paper:.digits$}"),
        ]
    };
    table(
        &["", "value", "95 % interval", "the paper's"],
        vec![
            row(
                "B, centreline: U_C/U_H = B/(s/l - s0)",
                &jet.centreline,
                3,
                paper.centreline,
            ),
            row(
                "S, spreading: r_half/l = S (s/l - s0)",
                &jet.spreading,
                5,
                paper.spreading,
            ),
            row("s0, virtual origin (l)", &jet.origin, 3, paper.origin),
        ],
    )
}

/// How the intervals were made and what they do not know.
pub(super) fn about_the_constants(found: &Calibration) -> Vec<String> {
    let jet = &found.jet;
    let drawn = match jet.resampling.unit {
        Unit::Flight => format!("{} whole flights", jet.resampling.units),
        Unit::Block => format!(
            "{} blocks of time{}, too few flights for whole ones; the probe's stated accuracy is added",
            jet.resampling.units,
            jet.resampling
                .block_s
                .map_or(String::new(), |block_s| format!(
                    " of {block_s:.0} s or more"
                ))
        ),
    };
    let Interval { low, high } = jet.centreline_if_one_gain;
    vec![
        format!(
            "Intervals from {} bootstrap draws of {drawn}.",
            jet.resampling.draws
        ),
        format!(
            "B if all flights shared one gain of the probe, which resampling cannot see: {low:.3} to {high:.3}."
        ),
        format!(
            "Correlations of the estimates: B with S {:+.2}, B with s0 {:+.2}, S with s0 {:+.2}.",
            jet.correlation.centreline_spreading,
            jet.correlation.centreline_origin,
            jet.correlation.spreading_origin
        ),
    ]
}

/// One row an airframe.
pub(super) fn drones(found: &Calibration) -> Table {
    let rows = found
        .drones
        .iter()
        .map(|drone| {
            let slices = drone
                .profiles
                .iter()
                .filter(|profile| profile.fit.is_some())
                .count();
            let merge = drone
                .lobes_merge_s_over_l
                .map_or("not seen".to_owned(), |merge| {
                    format!("{:.2} to {:.2} l", merge.low, merge.high)
                });
            vec![
                format!(
                    "{}{}",
                    drone.airframe,
                    if drone.in_fit {
                        ""
                    } else {
                        " (beside the fit)"
                    }
                ),
                format!("{:.2}", drone.induced_velocity_mps),
                format!("{:.3}", drone.motor_distance_m),
                drone.flights.to_string(),
                drone.samples.to_string(),
                slices.to_string(),
                merge,
            ]
        })
        .collect();
    table(
        &[
            "airframe",
            "U_H m/s",
            "l m",
            "flights",
            "readings",
            "slices",
            "lobes merge",
        ],
        rows,
    )
}

/// Canted drones against the jet of the others.
pub(super) fn departures(found: &Calibration) -> Table {
    let mut rows = Vec::new();
    for drone in found.drones.iter().filter(|drone| !drone.in_fit) {
        rows.push(vec![drone.airframe.clone()]);
        for departure in &drone.departures {
            rows.push(vec![
                format!("  xi {} to {}", departure.xi_from, departure.xi_to),
                departure.cells.to_string(),
                format!("{:+.3}", departure.mean),
                format!("{:.3}", departure.deviation),
            ]);
        }
    }
    table(&["", "cells", "mean / U_C", "deviation / U_C"], rows)
}

/// Mean misfit by region.
pub(super) fn regions(found: &Calibration) -> Table {
    let rows = found
        .goodness
        .regions
        .iter()
        .map(|region| {
            vec![
                format!(
                    "xi {} to {}, s/l {} to {}",
                    bound(region.xi_from),
                    bound(region.xi_to),
                    bound(region.s_from),
                    bound(region.s_to)
                ),
                region.cells.to_string(),
                format!("{:+.4}", region.mean),
                format!("{:+.2}", region.t),
                if region.significant { "yes" } else { "no" }.to_owned(),
            ]
        })
        .collect();
    table(
        &[
            "measured - fitted, over U_C",
            "cells",
            "mean",
            "t",
            "stands out",
        ],
        rows,
    )
}

fn bound(value: f64) -> String {
    if !value.is_finite() {
        return "any".into();
    }
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Both ways of the paper's test.
pub(super) fn tests(found: &Calibration) -> Table {
    let mut rows = Vec::new();
    let ways: [(&str, &[ResidualTest]); 2] = [
        (
            "through the observation operator",
            &found.residual_tests.through_operator,
        ),
        (
            "the paper's way: a scalar ambient speed subtracted",
            &found.residual_tests.scalar_subtracted,
        ),
    ];
    for (heading, tests) in ways {
        rows.push(vec![heading.to_owned()]);
        for test in tests {
            rows.push(row(test));
        }
    }
    table(
        &[
            "xi",
            "n",
            "n eff",
            "mean",
            "deviation",
            "t",
            "p",
            "above 0",
            "p eff, Holm",
            "still",
            "p normal",
        ],
        rows,
    )
}

fn row(test: &ResidualTest) -> Vec<String> {
    let yes = |answer: bool| if answer { "yes" } else { "no" }.to_owned();
    vec![
        format!("  {} to {}", bound(test.xi_from), bound(test.xi_to)),
        test.n.to_string(),
        format!("{:.0}", test.n_effective),
        format!("{:+.4}", test.mean),
        format!("{:.4}", test.deviation),
        format!("{:+.2}", test.t),
        probability(test.p),
        yes(test.above_zero),
        probability(test.p_effective_holm),
        yes(test.above_zero_corrected),
        test.p_normal.map_or("too few".to_owned(), probability),
    ]
}

fn probability(p: f64) -> String {
    if p < 0.0005 {
        "<0.001".into()
    } else {
        format!("{p:.3}")
    }
}

/// Readings used and dropped, and why.
pub(super) fn counts(found: &Calibration) -> Table {
    let counts = &found.counts;
    let mut rows = vec![
        vec!["read".to_owned(), counts.read.to_string()],
        vec!["used, far field".to_owned(), counts.far.to_string()],
        vec!["used, near field".to_owned(), counts.near.to_string()],
    ];
    for dropped in &counts.dropped {
        let why = match dropped.reason {
            Dropped::NotAReading => "not a speed",
            Dropped::NoTrack => "no track at that time",
            Dropped::NobodyBlows => "no drone in the air",
            Dropped::SeveralBlow => "several drones in the air",
            Dropped::Moving => "drone faster than 0.1 m/s",
            Dropped::Above => "probe above the rotors",
            Dropped::NearFloor => "too near the floor",
            Dropped::FarOut => "further out than is compared",
        };
        rows.push(vec![
            format!("left out: {why}"),
            dropped.samples.to_string(),
        ]);
    }
    table(&["readings", "count"], rows)
}

/// The report for the terminal.
pub(super) fn text(name: &str, found: &Calibration) -> String {
    let mut text = format!("{name}: {}\n\n", what(found));
    text += &constants(found).text();
    for line in about_the_constants(found) {
        text += &format!("  {line}\n");
    }
    text += &format!("\n  {}: {}\n", verdict(found), found.goodness.sentence);
    let standing = found
        .goodness
        .regions
        .iter()
        .filter(|region| region.significant)
        .count();
    text += &format!(
        "  rms misfit of the cells {:.4} U_C; {} of {} regions stand out\n\n",
        found.goodness.rms_over_centreline,
        standing,
        found.goodness.regions.len()
    );
    text += &drones(found).text();
    if found.drones.iter().any(|drone| !drone.in_fit) {
        text += "\n  canted drones beside the fit, measured - fitted\n";
        text += &departures(found).text();
    }
    text += "\n  the paper's residual test: is eps = (predicted - measured)/U_C above 0?\n";
    text += &tests(found).text();
    for caveat in &found.residual_tests.caveats {
        text += &format!("  {caveat}\n");
    }
    text.push('\n');
    text += &counts(found).text();
    if !found.caveats.is_empty() {
        text.push('\n');
    }
    for caveat in &found.caveats {
        text += &format!("  {caveat}\n");
    }
    text
}
