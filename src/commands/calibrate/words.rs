//! Calibrations as people read them.

use diagnosis::calibrate::{Calibration, Dropped, Estimate, Interval, ResidualTest, Unit, Verdict};

use crate::report::sections::{Figure, Part, Report};
use crate::report::words::{count, decimal, joined};

/// What was found, how well it is known, and what it was found from.
pub(super) fn report(name: &str, found: &Calibration, figures: Vec<Figure>) -> Report {
    let mut report = Report::new(format!("{name}: the jet, calibrated"), what(found));
    // The expansion comes first.
    let mut figures = figures.into_iter().map(Part::Figure);
    let mut parts = vec![
        constants(found),
        Part::List(about_the_constants(found)),
        Part::Line(format!("{}: {}.", verdict(found), found.goodness.sentence)),
    ];
    parts.extend(figures.next());
    report.section("", parts);
    let mut parts = vec![drones(found)];
    parts.extend(figures);
    report.section("Drone by drone", parts);
    report.section("Canted drones beside the fit", departures(found));
    report.section("Where the jet is off", regions(found));
    report.section("The paper's residual test", tests(found));
    let mut parts = vec![counts(found)];
    parts.extend(Part::list(found.caveats.clone()));
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
    let recordings = count(found.recordings.len(), "recording", "recordings");
    let airframes = count(fitted.len(), "airframe", "airframes");
    let text = format!(
        "{recordings}, {airframes} in the fit ({})",
        fitted.join(", ")
    );
    if beside.is_empty() {
        return text;
    }
    let canted = count(beside.len(), "canted one", "canted ones");
    format!("{text}, {canted} beside it ({})", beside.join(", "))
}

fn verdict(found: &Calibration) -> &'static str {
    match found.goodness.verdict {
        Verdict::Fits => "fits",
        Verdict::Poor => "POOR FIT",
        Verdict::Undecided => "undecided",
    }
}

/// B, S and s₀ with their intervals beside the paper's.
fn constants(found: &Calibration) -> Part {
    let (paper, jet) = (airflow::Jet::default(), &found.jet);
    let rows = [
        ("B, centreline: U_C/U_H = B/(s/l - s0)", 3),
        ("S, spreading: r_half/l = S (s/l - s0)", 5),
        ("s0, virtual origin (l)", 3),
    ];
    let estimates = [&jet.centreline, &jet.spreading, &jet.origin];
    let papers = [paper.centreline, paper.spreading, paper.origin];
    let rows = rows.iter().zip(estimates).zip(papers);
    let row = |((&(name, digits), estimate), paper): ((&(&str, usize), &Estimate), f64)| {
        let Interval { low, high } = estimate.interval;
        vec![
            name.to_owned(),
            format!("{:.digits$}", estimate.value),
            format!("{low:.digits$} to {high:.digits$}"),
            format!("{paper:.digits$}"),
        ]
    };
    let headings = " | value | 95 % interval | the paper's";
    Part::table("lrrr", headings, rows.map(row))
}

/// How the intervals were made and what they do not know.
fn about_the_constants(found: &Calibration) -> Vec<String> {
    let jet = &found.jet;
    let block = jet.resampling.block_s;
    let block = block.map(|block_s| format!(" of {block_s:.0} s or more"));
    let left_out = match jet.resampling.unit {
        Unit::Flight => format!("{} whole flights", jet.resampling.units),
        Unit::Block => format!(
            "{} blocks of time{}, too few flights for whole ones; the probe's stated accuracy is added",
            jet.resampling.units,
            joined(block, "")
        ),
    };
    let Interval { low, high } = jet.centreline_if_one_gain;
    vec![
        format!("Intervals: jackknife standard errors over {left_out}, times Student's t."),
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
fn drones(found: &Calibration) -> Part {
    let rows = found.drones.iter().map(|drone| {
        let slices = drone.profiles.iter().filter(|slice| slice.fit.is_some());
        let merge = match &drone.lobes_merge_s_over_l {
            Some(merge) => format!("{:.2} to {:.2} l", merge.low, merge.high),
            None => "not seen".to_owned(),
        };
        let name = match drone.in_fit {
            true => drone.airframe.clone(),
            false => format!("{} (beside the fit)", drone.airframe),
        };
        vec![
            name,
            format!("{:.2}", drone.induced_velocity_mps),
            format!("{:.3}", drone.motor_distance_m),
            drone.flights.to_string(),
            drone.samples.to_string(),
            slices.count().to_string(),
            merge,
        ]
    });
    let headings = "airframe | U_H m/s | l m | flights | readings | slices | lobes merge";
    Part::table("lrrrrrr", headings, rows)
}

/// Canted drones against the jet of the others; empty where there are none.
fn departures(found: &Calibration) -> Vec<Part> {
    let mut rows = Vec::new();
    for drone in found.drones.iter().filter(|drone| !drone.in_fit) {
        rows.push(vec![drone.airframe.clone()]);
        rows.extend(drone.departures.iter().map(|departure| {
            vec![
                format!("  xi {} to {}", departure.xi_from, departure.xi_to),
                departure.cells.to_string(),
                format!("{:+.3}", departure.mean),
                format!("{:.3}", departure.deviation),
            ]
        }));
    }
    if rows.is_empty() {
        return Vec::new();
    }
    let headings = " | cells | mean / U_C | deviation / U_C";
    vec![
        Part::line(
            "Measured minus the jet of the others, over the centreline speed, by distance over half-width xi.",
        ),
        Part::table("lrrr", headings, rows),
    ]
}

/// Mean misfit by region.
fn regions(found: &Calibration) -> Vec<Part> {
    let goodness = &found.goodness;
    let rows = goodness.regions.iter().map(|region| {
        let [xi_from, xi_to] = [region.xi_from, region.xi_to].map(bound);
        let [s_from, s_to] = [region.s_from, region.s_to].map(bound);
        vec![
            format!("xi {xi_from} to {xi_to}, s/l {s_from} to {s_to}"),
            region.cells.to_string(),
            format!("{:+.4}", region.mean),
            format!("{:+.2}", region.t),
            yes(region.significant),
        ]
    });
    let standing = goodness.regions.iter().filter(|region| region.significant);
    let (standing, all) = (standing.count(), goodness.regions.len());
    let rms = goodness.rms_over_centreline;
    let misfit = format!(
        "The rms misfit of the cells is {rms:.4} U_C; {standing} of {all} regions stand out."
    );
    let headings = "measured - fitted, over U_C | cells | mean | t | stands out";
    vec![
        Part::Line(misfit),
        Part::table("lrrrr", headings, rows).shortened(0),
    ]
}

fn yes(answer: bool) -> String {
    if answer { "yes" } else { "no" }.to_owned()
}

/// An end of an interval; `any` where it has none.
fn bound(value: f64) -> String {
    match value.is_finite() {
        true => decimal(value),
        false => "any".into(),
    }
}

/// The paper's test in both forms.
fn tests(found: &Calibration) -> Vec<Part> {
    let tests = &found.residual_tests;
    let heading = |text: &str| vec![vec![text.to_owned()]];
    let mut rows = heading("through the observation operator");
    rows.extend(tests.through_operator.iter().map(row));
    let scalar = "as the paper does: a scalar ambient speed subtracted";
    rows.extend(heading(scalar));
    rows.extend(tests.scalar_subtracted.iter().map(row));
    let headings = "xi | n | n eff | mean | deviation | t | p-value | above 0 | p-value eff, Holm | still | p-value normal";
    vec![
        Part::line(
            "Is the mean of eps = (predicted - measured)/U_C above 0 in an interval of xi? One-sided t test at 5 %, first as the paper has it, then with the samples that count as independent and Holm's correction for the number of rows.",
        ),
        Part::table("lrrrrrrrrrr", headings, rows),
        Part::List(tests.caveats.clone()),
    ]
}

fn row(test: &ResidualTest) -> Vec<String> {
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
    match p < 0.0005 {
        true => "<0.001".into(),
        false => format!("{p:.3}"),
    }
}

/// Readings used and dropped, and why.
fn counts(found: &Calibration) -> Part {
    let counts = &found.counts;
    let dropped = counts.dropped.iter().map(|dropped| {
        let why = match dropped.reason {
            Dropped::NotAReading => "not a speed",
            Dropped::NoTrack => "no track at that time",
            Dropped::NoneFlying => "no drone in the air",
            Dropped::SeveralFlying => "several drones in the air",
            Dropped::Moving => "drone faster than 0.1 m/s",
            Dropped::Above => "probe above the rotors",
            Dropped::NearFloor => "too near the floor",
            Dropped::FarOut => "further out than is compared",
        };
        (format!("left out: {why}"), dropped.samples)
    });
    let used = [
        ("read".to_owned(), counts.read),
        ("fitted, far field".to_owned(), counts.fitted),
        (
            "beside the fit, far field below canted drones".to_owned(),
            counts.far - counts.fitted,
        ),
        ("used, near field".to_owned(), counts.near),
    ];
    let row = |(what, samples): (String, usize)| vec![what, samples.to_string()];
    let rows = used.into_iter().chain(dropped).map(row);
    Part::table("lr", "readings | count", rows)
}
