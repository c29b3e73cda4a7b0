//! Calibrations as people read them.

use diagnosis::calibrate::{Calibration, Dropped, Estimate, Interval, ResidualTest, Unit, Verdict};

use crate::report::words::{count, decimal};
use crate::report::{Figure, Part, Report, Table};

/// What was found, how well it is known, and what it was found from.
pub(super) fn report(name: &str, found: &Calibration, figures: Vec<Figure>) -> Report {
    let goodness = &found.goodness;
    let mut report = Report::new(format!("{name}: the jet, calibrated"), what(found));
    // The expansion comes first.
    let mut figures = figures.into_iter().map(Part::Figure);
    let mut parts = vec![
        Part::table(constants(found)),
        Part::List(about_the_constants(found)),
        Part::Line(format!("{}: {}.", verdict(found), goodness.sentence)),
    ];
    parts.extend(figures.next());
    report.section("", parts);
    let mut parts = vec![Part::table(drones(found))];
    parts.extend(figures);
    report.section("Drone by drone", parts);
    if found.drones.iter().any(|drone| !drone.in_fit) {
        report.section(
            "Canted drones beside the fit",
            vec![
                Part::Line("Measured minus the jet of the others, over the centreline speed, by distance over half-width xi.".into()),
                Part::table(departures(found)),
            ],
        );
    }
    let standing = goodness.regions.iter().filter(|region| region.significant);
    report.section(
        "Where the jet is off",
        vec![
            Part::Line(format!(
                "The rms misfit of the cells is {:.4} U_C; {} of {} regions stand out.",
                goodness.rms_over_centreline,
                standing.count(),
                goodness.regions.len()
            )),
            Part::Table {
                table: regions(found),
                on_screen: 0,
            },
        ],
    );
    report.section(
        "The paper's residual test",
        vec![
            Part::Line("Is the mean of eps = (predicted - measured)/U_C above 0 in an interval of xi? One-sided t test at 5 %, first as the paper has it, then with the samples that count as independent and Holm's correction for the number of rows.".into()),
            Part::table(tests(found)),
            Part::List(found.residual_tests.caveats.clone()),
        ],
    );
    let mut parts = vec![Part::table(counts(found))];
    if !found.caveats.is_empty() {
        parts.push(Part::List(found.caveats.clone()));
    }
    report.section("What was used, and what to know", parts);
    report
}

/// `8 recordings, 4 drones in the fit (kolibri, ...), 2 beside it (...)`.
fn what(found: &Calibration) -> String {
    let names = |in_fit: bool| -> Vec<&str> {
        let drones = found.drones.iter().filter(|drone| drone.in_fit == in_fit);
        drones.map(|drone| drone.airframe.as_str()).collect()
    };
    let (fitted, beside) = (names(true), names(false));
    let beside = match beside.len() {
        0 => String::new(),
        some => format!(
            ", {} beside it ({})",
            count(some, "canted one", "canted ones"),
            beside.join(", ")
        ),
    };
    format!(
        "{}, {} in the fit ({}){beside}",
        count(found.recordings.len(), "recording", "recordings"),
        count(fitted.len(), "airframe", "airframes"),
        fitted.join(", ")
    )
}

fn verdict(found: &Calibration) -> &'static str {
    match found.goodness.verdict {
        Verdict::Fits => "fits",
        Verdict::Poor => "POOR FIT",
        Verdict::Undecided => "undecided",
    }
}

/// B, S and s₀ with their intervals beside the paper's.
fn constants(found: &Calibration) -> Table {
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
    Table::new(
        "lrrr",
        " | value | 95 % interval | the paper's",
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
fn about_the_constants(found: &Calibration) -> Vec<String> {
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
fn drones(found: &Calibration) -> Table {
    let rows = found
        .drones
        .iter()
        .map(|drone| {
            let slices = drone
                .profiles
                .iter()
                .filter(|profile| profile.fit.is_some())
                .count();
            let merge = match &drone.lobes_merge_s_over_l {
                Some(merge) => format!("{:.2} to {:.2} l", merge.low, merge.high),
                None => "not seen".to_owned(),
            };
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
    Table::new(
        "lrrrrrr",
        "airframe | U_H m/s | l m | flights | readings | slices | lobes merge",
        rows,
    )
}

/// Canted drones against the jet of the others.
fn departures(found: &Calibration) -> Table {
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
    Table::new("lrrr", " | cells | mean / U_C | deviation / U_C", rows)
}

/// Mean misfit by region.
fn regions(found: &Calibration) -> Table {
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
    Table::new(
        "lrrrr",
        "measured - fitted, over U_C | cells | mean | t | stands out",
        rows,
    )
}

/// An end of an interval; `any` where it has none.
fn bound(value: f64) -> String {
    match value.is_finite() {
        true => decimal(value),
        false => "any".into(),
    }
}

/// Both forms of the paper's test.
fn tests(found: &Calibration) -> Table {
    let mut rows = Vec::new();
    let forms: [(&str, &[ResidualTest]); 2] = [
        (
            "through the observation operator",
            &found.residual_tests.through_operator,
        ),
        (
            "as the paper does: a scalar ambient speed subtracted",
            &found.residual_tests.scalar_subtracted,
        ),
    ];
    for (heading, tests) in forms {
        rows.push(vec![heading.to_owned()]);
        for test in tests {
            rows.push(row(test));
        }
    }
    Table::new(
        "lrrrrrrrrrr",
        "xi | n | n eff | mean | deviation | t | p-value | above 0 | p-value eff, Holm | still | p-value normal",
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
fn counts(found: &Calibration) -> Table {
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
    Table::new("lr", "readings | count", rows)
}
