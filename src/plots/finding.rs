//! The figures of a finding: where, along which coordinates, how well.

use diagnosis::campaign::CampaignFinding;
use diagnosis::campaign::covariates::COORDINATES;
use diagnosis::forward::observed::{COVARIATES, Observed};
use diagnosis::forward::simulate::{Channel, Sample};
use diagnosis::infer::finding::Finding;
use diagnosis::infer::noise::noise;
use diagnosis::record::recording::Recording;

use super::Figure;
use super::agreement;
use super::before_after::{self, Spot, Words};
use super::readings::spread;
use super::signature::{self, Bin, Curve};
use crate::report::words::{figures, unit};

/// Bins of a signature curve, with as many samples each.
const BINS: usize = 16;
/// Fewer samples than these in a bin say nothing about its median.
const LEAST_IN_BIN: usize = 8;
/// Medians further off than so many standard deviations of one sample get a sign.
const SIGNS: f64 = 2.0;
/// Curves side by side.
const CURVES: usize = 2;
/// Coordinates that say nearly the same of a sample: one curve of each group.
const ALIKE: [&[&str]; 6] = [
    &[
        "s/l",
        "depth m",
        "emitter z m",
        "height m",
        "height/half-width",
    ],
    &["r/l", "xi", "air m/s", "beside m", "beside/half-width"],
    &["cos az", "sin az"],
    &["time s", "battery V"],
    &["emitter speed m/s", "climb m/s"],
    &["second jet/first"],
];

/// The samples of a finding with what it says of each.
struct Seen {
    samples: Vec<Sample>,
    corrected: Vec<f64>,
    noise: Vec<f64>,
    inside: Vec<bool>,
    /// Names of the coordinates.
    names: Vec<&'static str>,
    /// One column for each of them.
    covariates: Vec<Vec<f64>>,
}

/// In the order of the report.
pub(crate) fn draw(recording: &Recording, finding: &Finding, subtitle: &str) -> Vec<Figure> {
    let Some(seen) = seen(recording, finding) else {
        return Vec::new();
    };
    all(&recording.name, subtitle, finding, &seen)
}

/// The same of several flights.
pub(crate) fn draw_campaign(name: &str, found: &CampaignFinding, subtitle: &str) -> Vec<Figure> {
    let rows = &found.finding.region.sample_indices;
    let seen = Seen {
        samples: found.samples.clone(),
        corrected: found.finding.prediction.clone(),
        noise: found.noise_n.clone(),
        inside: (0..found.samples.len())
            .map(|row| rows.binary_search(&row).is_ok())
            .collect(),
        names: COORDINATES.map(|(name, _)| name).to_vec(),
        covariates: found.columns.clone(),
    };
    all(name, subtitle, &found.finding, &seen)
}

fn all(name: &str, subtitle: &str, finding: &Finding, seen: &Seen) -> Vec<Figure> {
    let figures = [
        residuals(name, subtitle, unit(finding.channel), seen),
        signature(name, subtitle, finding, seen),
        agreement(name, subtitle, finding, seen),
    ];
    figures.into_iter().flatten().collect()
}

fn seen(recording: &Recording, finding: &Finding) -> Option<Seen> {
    let observed = Observed::of(recording, Some(finding.channel))?;
    let corrected: Vec<f64> = observed
        .samples
        .iter()
        .map(|sample| {
            let predicted = finding.prediction.get(sample.row).copied();
            predicted
                .filter(|value| value.is_finite())
                .unwrap_or(sample.simulated)
        })
        .collect();
    let rows = &finding.region.sample_indices;
    Some(Seen {
        noise: noise(&observed, &corrected).sd().to_vec(),
        inside: observed
            .samples
            .iter()
            .map(|sample| rows.binary_search(&sample.row).is_ok())
            .collect(),
        corrected,
        names: COVARIATES.map(|(name, _)| name).to_vec(),
        covariates: observed.covariates,
        samples: observed.samples,
    })
}

fn residuals(name: &str, subtitle: &str, unit: &str, seen: &Seen) -> Option<Figure> {
    let towards_rad = direction_rad(seen);
    let spots: Vec<Spot> = (0..seen.samples.len())
        .filter_map(|i| {
            let sample = &seen.samples[i];
            let place = sample.place?;
            Some(Spot {
                s_over_l: place.s_over_l,
                across_over_l: place
                    .r_over_l
                    .copysign((place.azimuth_rad - towards_rad).cos()),
                before: sample.residual(),
                after: sample.recorded - seen.corrected[i],
                noise: SIGNS * seen.noise[i],
                inside: seen.inside[i],
            })
        })
        .collect();
    let unit = format!(" ({unit})");
    let across = format!(
        "distance from the axis r / l, right: azimuth {:.0} deg",
        towards_rad.to_degrees()
    );
    let words = Words {
        title: &format!("Recorded minus simulated, before and after: {name}"),
        subtitle,
        unit: &unit,
        across: &across,
        headings: ["before", "after the correction"],
    };
    let svg = before_after::draw(&words, &spots)?;
    Some(Figure {
        name: "residuals".into(),
        svg,
        caption: "Medians by cell, by place in the wake that blows hardest there, folded onto the plane through its axis in which the two sides differ most; azimuths from x towards y. \
                  Blue: the simulation is too high; red: too low. Outlined: cells of which half the samples or more lie in the region.".into(),
    })
}

/// Azimuth (rad) towards which the correction adds most air; along x where it has no side.
fn direction_rad(seen: &Seen) -> f64 {
    let (mut x, mut y, mut all) = (0.0, 0.0, 0.0);
    for (sample, corrected) in seen.samples.iter().zip(&seen.corrected) {
        if let Some(place) = sample.place {
            let change = corrected - sample.simulated;
            let (sin, cos) = place.azimuth_rad.sin_cos();
            x += change * cos;
            y += change * sin;
            all += change.abs();
        }
    }
    // Chosen here: less than a tenth to one side is how the samples lie.
    if x.hypot(y) < 0.1 * all || all == 0.0 {
        return 0.0;
    }
    y.atan2(x)
}

fn signature(name: &str, subtitle: &str, finding: &Finding, seen: &Seen) -> Option<Figure> {
    let law: Vec<f64> = seen
        .samples
        .iter()
        .zip(&seen.corrected)
        .map(|(sample, corrected)| corrected - sample.simulated)
        .collect();
    let is_corrected = law.iter().any(|change| *change != 0.0);
    let shown: Vec<f64> = if is_corrected {
        law.clone()
    } else {
        seen.samples.iter().map(Sample::residual).collect()
    };
    let mut shares: Vec<(f64, usize)> = (0..seen.names.len())
        .map(|column| (share(&seen.covariates[column], &shown), column))
        .filter(|(share, _)| *share > 0.0)
        .collect();
    shares.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    // What trees depend on goes first.
    let first = finding
        .shape
        .as_ref()
        .and_then(|shape| shape.depends_on.first());
    if let Some((name, _)) = first {
        shares.sort_by_key(|(_, column)| seen.names[*column] != name);
    }
    let group = |column: usize| ALIKE.iter().position(|g| g.contains(&seen.names[column]));
    let mut taken: Vec<usize> = Vec::new();
    for (_, column) in shares {
        if taken.len() < CURVES && taken.iter().all(|&other| group(other) != group(column)) {
            taken.push(column);
        }
    }
    let curves: Vec<Curve> = taken
        .iter()
        .map(|&column| curve(column, &law, seen))
        .collect();
    let names: Vec<&str> = finding.effects.iter().map(|e| e.name.as_str()).collect();
    let law = match (is_corrected, names.is_empty()) {
        (false, _) => None,
        (true, true) => Some("corrected - simulated".to_owned()),
        (true, false) => Some(format!("fitted {}", names.join(" and "))),
    };
    let y = match finding.channel {
        Channel::Speed => "recorded - simulated (m/s)",
        Channel::VerticalForce => "recorded - simulated (N)",
        Channel::Throttle | Channel::Power => "recorded - simulated (of hover)",
    };
    let svg = signature::draw(
        &format!("Signature of the mismatch: {name}"),
        subtitle,
        y,
        law.as_deref(),
        &curves,
    )?;
    Some(Figure {
        name: "signature".into(),
        svg,
        caption: "The coordinates along which the correction changes most, or the residual where there is none; as many samples in every bin.".into(),
    })
}

/// Places where a column is cut into bins of as many samples; fewer where many values are the same.
fn bins(column: &[f64]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..column.len())
        .filter(|&i| column[i].is_finite())
        .collect();
    order.sort_by(|&a, &b| column[a].total_cmp(&column[b]).then(a.cmp(&b)));
    let each = order.len().div_ceil(BINS).max(LEAST_IN_BIN);
    let mut bins: Vec<Vec<usize>> = Vec::new();
    for i in order {
        match bins.last_mut() {
            Some(bin)
                if bin.len() < each
                    || bin.last().is_some_and(|&last| column[last] == column[i]) =>
            {
                bin.push(i);
            }
            _ => bins.push(vec![i]),
        }
    }
    if bins.len() > 1 && bins.last().is_some_and(|bin| bin.len() < LEAST_IN_BIN) {
        bins.pop();
    }
    bins
}

/// Part of the values' variance that lies between the bins of a column.
fn share(column: &[f64], values: &[f64]) -> f64 {
    let bins = bins(column);
    if bins.len() < 3 {
        return 0.0;
    }
    let inside = || bins.iter().flatten().map(|&i| values[i]);
    let count = bins.iter().map(Vec::len).sum::<usize>() as f64;
    let mean = inside().sum::<f64>() / count;
    let all: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    let between: f64 = bins
        .iter()
        .map(|bin| {
            let of_bin = bin.iter().map(|&i| values[i]).sum::<f64>() / bin.len() as f64;
            bin.len() as f64 * (of_bin - mean).powi(2)
        })
        .sum();
    if all > 0.0 { between / all } else { 0.0 }
}

fn curve(column: usize, law: &[f64], seen: &Seen) -> Curve {
    let values = &seen.covariates[column];
    let bins = bins(values);
    let of = |bin: &[usize], value: &dyn Fn(usize) -> f64| {
        spread(bin.iter().map(|&i| value(i)).collect())
    };
    let bins = bins.iter().filter_map(|bin| {
        Some(Bin {
            x: of(bin, &|i| values[i])?.median,
            before: of(bin, &|i| seen.samples[i].residual())?,
            after: of(bin, &|i| seen.samples[i].recorded - seen.corrected[i])?.median,
            law: of(bin, &|i| law[i])?.median,
        })
    });
    Curve {
        label: label(seen.names[column]).to_owned(),
        bins: bins.collect(),
    }
}

/// A coordinate as an axis says it.
fn label(covariate: &str) -> &str {
    match covariate {
        "s/l" => "depth below the rotor plane s / l",
        "r/l" => "distance from the axis r / l",
        "xi" => "distance from the axis over the half-width",
        "cos az" => "cosine of the azimuth around the axis (1: towards +x)",
        "sin az" => "sine of the azimuth around the axis (1: towards +y)",
        "height m" => "height above the floor (m)",
        "time s" => "time (s)",
        "air m/s" => "simulated air there (m/s)",
        "emitter z m" => "height of the drone above (m)",
        "emitter speed m/s" => "speed of the drone above (m/s)",
        "climb m/s" | "emitter climb m/s" => "climb of the drone above (m/s)",
        "depth m" => "depth below the drone above (m)",
        "beside m" => "distance from its axis (m)",
        "beside/half-width" => "distance from its axis over the half-width",
        "own climb m/s" => "own climb (m/s)",
        "own speed m/s" => "own speed (m/s)",
        "thrust N" => "thrust (N)",
        "second jet/first" => "second strongest jet over the strongest",
        "battery V" => "battery (V)",
        "height/half-width" => "height above the floor over the half-width",
        other => other,
    }
}

fn agreement(name: &str, subtitle: &str, finding: &Finding, seen: &Seen) -> Option<Figure> {
    let before: Vec<(f64, f64)> = seen
        .samples
        .iter()
        .map(|sample| (sample.recorded, sample.simulated))
        .collect();
    let after: Vec<(f64, f64)> = seen
        .samples
        .iter()
        .zip(&seen.corrected)
        .map(|(sample, corrected)| (sample.recorded, *corrected))
        .collect();
    let heading = |what: &str, pairs: &[(f64, f64)]| {
        let square = pairs.iter().map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let rms = (square / pairs.len().max(1) as f64).sqrt();
        format!("{what}: rms {} {}", figures(rms), unit(finding.channel))
    };
    let quantity = match finding.channel {
        Channel::Speed => "speed (m/s)",
        Channel::Throttle => "throttle / hover",
        Channel::Power => "power / hover",
        Channel::VerticalForce => "vertical force (N)",
    };
    let headings = [
        heading("as simulated", &before),
        heading("corrected", &after),
    ];
    let svg = agreement::draw(
        &format!("Recorded against predicted: {name}"),
        subtitle,
        quantity,
        [(&headings[0], &before), (&headings[1], &after)],
    )?;
    Some(Figure {
        name: "agreement".into(),
        svg,
        caption: "Every sample; the line is where both are equal. The rms here is over all samples, fitted ones too; FIT above has that of blocks that were not fitted.".into(),
    })
}
