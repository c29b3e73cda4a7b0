//! The figures of `plan diagnose`: where samples and simulation differ, along which coordinates,
//! and how well the correction does.

use diagnosis::campaign::COORDINATES;
use diagnosis::campaign::CampaignFinding;
use diagnosis::forward::observed::{COVARIATES, Observed};
use diagnosis::forward::simulate::{Channel, Sample};
use diagnosis::infer::finding::Finding;
use diagnosis::infer::noise::noise;
use diagnosis::record::recording::Recording;

use super::agreement;
use super::residual_map::{Above, ResidualMap};
use super::signature::{self, Mismatch};
use crate::report::sections::Figure;
use crate::report::slice::{self, Placed};
use crate::report::words::{channel_words, figures, joined};

/// Medians further off than so many standard deviations of one sample get a sign: chosen here.
const SIGNS: f64 = 2.0;
/// Curves side by side.
const CURVES: usize = 2;
/// Coordinates, what an axis calls them, and a group: those of one group say nearly the same of a
/// sample, and one of them is drawn.
const LABELS: [(&str, &str, u8); 22] = [
    ("probe", "number of the probe", 7),
    ("s/l", "depth below the rotor plane s / l", 1),
    ("depth m", "depth below the drone above (m)", 1),
    ("emitter z m", "height of the drone above (m)", 1),
    ("height m", "height above the floor (m)", 1),
    ("height/half-width", "height over the half-width", 1),
    ("r/l", "distance from the axis r / l", 2),
    ("xi", "distance from the axis over the half-width", 2),
    ("air m/s", "simulated air there (m/s)", 2),
    ("beside m", "distance from its axis (m)", 2),
    ("beside/half-width", "distance over the half-width", 2),
    ("cos az", "cosine of the azimuth (1: towards +x)", 3),
    ("sin az", "sine of the azimuth (1: towards +y)", 3),
    ("time s", "time (s)", 4),
    ("battery V", "battery (V)", 4),
    ("emitter speed m/s", "speed of the drone above (m/s)", 5),
    ("climb m/s", "climb of the drone above (m/s)", 5),
    ("second jet/first", "second strongest jet / strongest", 6),
    ("emitter climb m/s", "climb of the drone above (m/s)", 0),
    ("own climb m/s", "own climb (m/s)", 0),
    ("own speed m/s", "own speed (m/s)", 0),
    ("thrust N", "thrust (N)", 0),
];

/// The samples of a finding with what it says of each.
struct Seen {
    samples: Vec<Sample>,
    corrected: Vec<f64>,
    noise: Vec<f64>,
    /// Whether they lie in the region of the mismatch.
    inside: Vec<bool>,
    /// Names of the coordinates.
    names: Vec<&'static str>,
    /// One column for each of them.
    covariates: Vec<Vec<f64>>,
}

/// Residuals, signature and agreement of one recording; none where it does not hold the finding's
/// channel.
pub(crate) fn draw(recording: &Recording, finding: &Finding, subtitle: &str) -> Vec<Figure> {
    let Some(observed) = Observed::of(recording, Some(finding.channel)) else {
        return Vec::new();
    };
    let corrected = |sample: &Sample| {
        let predicted = finding.prediction.get(sample.row).copied();
        let known = predicted.filter(|value| value.is_finite());
        known.unwrap_or(sample.simulated)
    };
    let corrected: Vec<f64> = observed.samples.iter().map(corrected).collect();
    let rows = &finding.region.sample_indices;
    let is_inside = |sample: &Sample| rows.binary_search(&sample.row).is_ok();
    let seen = Seen {
        noise: noise(&observed, &corrected).sd().to_vec(),
        inside: observed.samples.iter().map(is_inside).collect(),
        corrected,
        names: COVARIATES.map(|(name, _)| name).to_vec(),
        covariates: observed.covariates,
        samples: observed.samples,
    };
    all(&recording.name, subtitle, finding, &seen)
}

/// The same of several flights together.
pub(crate) fn draw_campaign(name: &str, found: &CampaignFinding, subtitle: &str) -> Vec<Figure> {
    let rows = &found.finding.region.sample_indices;
    let is_inside = |row: usize| rows.binary_search(&row).is_ok();
    let seen = Seen {
        samples: found.samples.clone(),
        corrected: found.finding.prediction.clone(),
        noise: found.noise_n.clone(),
        inside: (0..found.samples.len()).map(is_inside).collect(),
        names: COORDINATES.map(|(name, _)| name).to_vec(),
        covariates: found.columns.clone(),
    };
    all(name, subtitle, &found.finding, &seen)
}

fn all(name: &str, subtitle: &str, finding: &Finding, seen: &Seen) -> Vec<Figure> {
    let with_slice = |figure: Figure| Figure {
        live: slice::html(channel_words(finding.channel).unit, &placed(seen)),
        ..figure
    };
    let figures = [
        Figure::of(
            "residuals",
            residuals(name, subtitle, finding.channel, seen),
            "Medians by cell, by place in the strongest wake there, folded onto the plane through its axis in which the two sides differ most; azimuths from x towards y. \
             Blue: the simulation is too high; red: too low. Outlined: cells of which half the samples or more lie in the region.",
        )
        .map(with_slice),
        Figure::of(
            "signature",
            signature(name, subtitle, finding, seen),
            "The coordinates along which the correction changes most, or the residual where there is none; as many samples in every bin.",
        ),
        Figure::of(
            "agreement",
            agreement(name, subtitle, finding.channel, seen),
            "Every sample; the line is where both are equal. The rms here is over all samples, fitted ones too; FIT above has that of blocks that were not fitted.",
        ),
    ];
    figures.into_iter().flatten().collect()
}

/// The samples below a drone, for the slice.
fn placed(seen: &Seen) -> Vec<Placed> {
    let samples = seen.samples.iter().zip(&seen.corrected);
    let placed = samples.filter_map(|(sample, corrected)| {
        let place = sample.place?;
        Some(Placed {
            r_over_l: place.r_over_l,
            azimuth_rad: place.azimuth_rad,
            s_over_l: place.s_over_l,
            recorded: sample.recorded,
            before: sample.residual(),
            after: sample.recorded - corrected,
        })
    });
    placed.collect()
}

fn residuals(name: &str, subtitle: &str, channel: Channel, seen: &Seen) -> Option<String> {
    let towards_rad = direction_rad(seen);
    let samples = || seen.samples.iter().enumerate();
    let placed = || samples().filter_map(|(i, sample)| Some((i, sample, sample.place?)));
    let places = placed().map(|(_, _, place)| {
        let side = (place.azimuth_rad - towards_rad).cos();
        (place.r_over_l.copysign(side), place.s_over_l)
    });
    let before = placed().map(|(_, sample, _)| sample.residual());
    let after = placed().map(|(i, sample, _)| sample.recorded - seen.corrected[i]);
    let noise = placed().map(|(i, ..)| SIGNS * seen.noise[i]);
    let title = format!("Recorded minus simulated, before and after: {name}");
    let (degrees, corrected) = (towards_rad.to_degrees(), "after the correction");
    let map = ResidualMap {
        title: (&title, subtitle),
        unit: channel_words(channel).unit,
        across: &format!("distance from the axis r / l, right: azimuth {degrees:.0} deg"),
        places: places.collect(),
        panels: [("before", before.collect()), (corrected, after.collect())].into(),
        noise: (noise.collect(), "twice the noise"),
        above: Above::Region(placed().map(|(i, ..)| seen.inside[i]).collect()),
    };
    map.draw()
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

/// Where the emitter is in the room.
const OF_EMITTER: [&str; 2] = ["emitter x m", "emitter y m"];

fn signature(name: &str, subtitle: &str, finding: &Finding, seen: &Seen) -> Option<String> {
    let each = |value: fn(&Sample, f64) -> f64| {
        let samples = seen.samples.iter().zip(&seen.corrected);
        samples
            .map(|(sample, corrected)| value(sample, *corrected))
            .collect()
    };
    let mismatch = Mismatch {
        before: each(|sample, _| sample.residual()),
        after: each(|sample, corrected| sample.recorded - corrected),
        law: each(|sample, corrected| corrected - sample.simulated),
    };
    let is_corrected = mismatch.law.iter().any(|change| *change != 0.0);
    let (law, before) = (&mismatch.law, &mismatch.before);
    let shown = if is_corrected { law } else { before };
    let columns = seen.covariates.iter().zip(0..);
    let shares = columns.map(|(column, index)| (signature::share(column, shown), index));
    let mut shares: Vec<(f64, usize)> = shares.filter(|(share, _)| *share > 0.0).collect();
    shares.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    // What trees depend on goes first; where the emitter is in the room only says more than where
    // the air is below it where they do.
    let shape = finding.shape.as_ref();
    let first = shape.and_then(|shape| shape.depends_on.first());
    let is_first = |column: usize| first.is_some_and(|(name, _)| seen.names[column] == name);
    shares.retain(|(_, column)| is_first(*column) || !OF_EMITTER.contains(&seen.names[*column]));
    shares.sort_by_key(|(_, column)| !is_first(*column));
    let (mut coordinates, mut groups) = (Vec::new(), Vec::new());
    for (_, column) in shares {
        let name = seen.names[column];
        let known = LABELS.iter().find(|(known, ..)| *known == name);
        let (label, group) = known.map_or((name, 0), |(_, label, group)| (*label, *group));
        if groups.len() < CURVES && !groups.contains(&group) {
            groups.push(group);
            coordinates.push((label, &seen.covariates[column][..]));
        }
    }
    let names = joined(finding.effects.iter().map(|effect| &effect.name), " and ");
    let law = match names.is_empty() {
        true => "corrected - simulated".to_owned(),
        false => format!("fitted {names}"),
    };
    let law = is_corrected.then_some(&law[..]);
    let title = format!("Signature of the mismatch: {name}");
    let unit = channel_words(finding.channel).unit;
    let y = format!("recorded - simulated ({unit})");
    signature::draw((&title, subtitle), (&y, law), &coordinates, &mismatch)
}

fn agreement(name: &str, subtitle: &str, channel: Channel, seen: &Seen) -> Option<String> {
    let words = channel_words(channel);
    let samples = seen.samples.iter();
    let before = samples.map(|sample| (sample.recorded, sample.simulated));
    let before: Vec<(f64, f64)> = before.collect();
    let recorded = before.iter().map(|(recorded, _)| *recorded);
    let after: Vec<(f64, f64)> = recorded.zip(seen.corrected.iter().copied()).collect();
    let heading = |what: &str, pairs: &[(f64, f64)]| {
        let square = pairs.iter().map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let rms = (square / pairs.len().max(1) as f64).sqrt();
        format!("{what}: rms {} {}", figures(rms), words.unit)
    };
    let simulated = heading("as simulated", &before);
    let corrected = heading("corrected", &after);
    let title = format!("Recorded against predicted: {name}");
    let panels = [(&simulated[..], &before[..]), (&corrected, &after)];
    agreement::before_and_after((&title, subtitle), words.quantity, panels)
}
