//! Whether something is there that the library does not hold, and its shape.
//!
//! The global lack-of-fit test says whether anything is there at all. Boosted trees over the
//! covariates are the yardstick for what the library leaves: they know no physics and can predict
//! whatever repeats. Where they gain much on blocks that neither has seen, something is missing
//! that has no name here. Then its shape is told: the covariates that it depends on, a curve, the
//! nearest library term, a short expression. The trees serve as correction inside what was sampled
//! only.

use nalgebra::{Matrix2, Vector2};
use serde::Serialize;

use crate::infer::candidates::Kind;
use crate::infer::fit::{Fit, Setting};
use crate::infer::select::{Selection, Tried};
use crate::statistics::bursts::bursts;
use crate::statistics::column::{self, Column};
use crate::statistics::expression::{self, Coordinate};
use crate::statistics::held_out::Gain;
use crate::statistics::lack_of_fit::{Evidence, LackOfFit, Rhythm, Statistic, lack_of_fit};
use crate::statistics::line::Line;
use crate::statistics::quantile::{difference, quantile_edges};
use crate::statistics::trees::{self, HeldOut};

/// Part of all that could be gained that must be left for "outside the library", and how sure that
/// must be: in standard errors, and in held-out log density. Chosen here: a third of what shows,
/// and surer than a term of the library, for trees follow whatever repeats.
const LEFT_SHARE: f64 = 0.35;
const LEAST_ERRORS: f64 = 2.5;
const LEAST_GAIN: f64 = 10.0;
/// A held-out gain from which a selection or a shape stands without the global test, and how many
/// standard errors it must be: where the scatter is read too small, a gain alone says little.
/// Chosen here.
const BEYOND_DOUBT: f64 = 40.0;
const BEYOND_DOUBT_ERRORS: f64 = 4.0;
/// p-value from which a spectral line is a pulsation. Chosen here, far below what the global test
/// accepts: nothing else vouches for it.
const LINE_P: f64 = 1e-5;
/// p-value of one block in all from which readings that differ at times are told: at most one
/// recording in a thousand without an effect (none of the 400 of `plan prove --seed 301 --count
/// 1000`). And that of a block which is then counted to it.
const PRESENT_P: f64 = 0.001;
const EACH_BURST_P: f64 = 0.05;
/// Part of the trees' gain that an expression must gain to be told. Chosen here.
const LEAST_TOLD: f64 = 0.2;
/// Steps in time that the global test looks for.
const STEPS: usize = 16;
/// Points of a curve.
const CURVE_POINTS: usize = 24;

/// Something without a name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shape {
    /// The covariates that matter most, with the share of what the trees explain.
    pub depends_on: Vec<(String, f64)>,
    /// Along the first of them: its value, and the mean correction there in the channel's unit.
    pub curve: Vec<(f64, f64)>,
    /// The best short expression for the correction; `None`: none predicts held-out blocks.
    pub expression: Option<String>,
    /// Part of what the trees gain that the expression gains, from 0 to 1.
    pub expression_share: f64,
    /// The library's nearest term, and the part of all that could be gained that it gains.
    pub nearest: Option<(String, f64)>,
    /// Period (s) of a pulsation, where that is what it is.
    pub period_s: Option<f64>,
    /// From when to when (s) the readings differ, where nothing but time tells.
    pub spans_s: Vec<[f64; 2]>,
    /// Whether it predicts blocks that were not fitted. What does not is there all the same.
    pub is_predictable: bool,
    /// The trees' correction of each sample, held out, in the channel's unit.
    #[serde(skip)]
    pub correction: Vec<f64>,
    /// What the correction leaves of each recorded value, in the channel's unit.
    #[serde(skip)]
    pub left: Vec<f64>,
}

/// What any function of the covariates still predicts after everything that is named.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Remains {
    /// Its gain in held-out log density.
    pub gain: f64,
    /// The standard error of that.
    pub gain_error: f64,
    /// Whether the gain is more than chance.
    pub is_sure: bool,
    /// Root mean square of what it predicts, in the channel's unit.
    pub rms: f64,
    /// Part of the samples where it is more than half a standard deviation.
    pub share: f64,
    /// Where that is; empty where it is nowhere.
    pub description: String,
}

/// Whether a held-out gain needs no global test.
pub(crate) fn is_beyond_doubt(gain: &Gain) -> bool {
    gain.total > BEYOND_DOUBT.max(BEYOND_DOUBT_ERRORS * gain.standard_error)
}

/// The global lack-of-fit test of what the instrument's tolerance alone (`nothing`) leaves: against
/// the tangents of all candidates, bins of all covariates and steps in time.
#[must_use]
pub fn global_test(setting: &Setting, nothing: &Fit) -> LackOfFit {
    let observed = setting.observed;
    let noise = setting.noise;
    let clean = observed.predict(&setting.base);
    let mut columns: Vec<Column> = Vec::new();
    for candidate in setting.candidates {
        let tangent = |start: &Vec<f64>| Column {
            is_law: true,
            values: setting.change(candidate, start, &clean),
        };
        columns.extend(candidate.starts.iter().map(tangent));
    }
    columns.extend(column::bins(observed.covariates().columns, noise.sd()));
    columns.extend(column::steps(&observed.times_s(), noise.sd(), STEPS));
    // Every series on the clock of the air's release: a pulsation of the rotors is periodic there.
    let releases = observed.releases().into_iter();
    let rhythm = |(samples, clock_s): (Vec<usize>, Vec<f64>)| Rhythm {
        weight: samples.iter().map(|&i| clean[i] / noise.sd()[i]).collect(),
        samples,
        clock_s,
    };
    let rhythms: Vec<Rhythm> = releases.map(rhythm).collect();
    lack_of_fit(&Evidence {
        residual: &nothing.whitened,
        columns: &column::whitened(&columns, &noise.whitener),
        nuisances: &setting.free_columns(nothing),
        blocks: &noise.blocks,
        rhythms: &rhythms,
    })
}

/// What the chosen terms leave that something else would predict; `None`: nothing worth a name.
#[must_use]
pub fn outside(
    setting: &Setting,
    selection: &Selection,
    test: &LackOfFit,
    left: &HeldOut,
) -> Option<Shape> {
    let chosen = &selection.chosen;
    let library = chosen.gain.total.max(0.0);
    let gain = &left.gain;
    let enough = is_sure(gain);
    // Where something is named, that something is there is settled.
    let stands = test.is_significant || is_beyond_doubt(gain) || !chosen.which.is_empty();
    if enough && gain.total > LEFT_SHARE * (library + gain.total) && stands {
        return Some(shape(setting, selection, left));
    }
    if !chosen.which.is_empty() {
        return None;
    }
    let is_rhythm = test.statistic == Statistic::Rhythm;
    let line = test.line.filter(|line| is_rhythm && line.p < LINE_P);
    if let Some(line) = line {
        return Some(pulsation(setting, &chosen.fit, line.frequency_hz));
    }
    // Too small to act on, and explained.
    let is_explained = |tried: &&Tried| !tried.practical && is_beyond_doubt(&tried.gain);
    if selection
        .singles
        .first()
        .is_some_and(|first| is_explained(&first))
    {
        return None;
    }
    at_times(setting, &chosen.fit)
}

/// Whether a gain of trees is more than chance.
pub(crate) fn is_sure(gain: &Gain) -> bool {
    gain.total > LEAST_GAIN.max(LEAST_ERRORS * gain.standard_error)
}

/// Readings that differ at times: none of it comes back in the same place, so nothing predicts it
/// on blocks that were held out.
fn at_times(setting: &Setting, fit: &Fit) -> Option<Shape> {
    let blocks = &setting.noise.blocks;
    let found = bursts(&fit.whitened, &fit.predicted, blocks, EACH_BURST_P);
    if found.p > PRESENT_P {
        return None;
    }
    let times_s = setting.observed.times_s();
    let rest = setting.left(&fit.predicted);
    let mut correction = vec![0.0; rest.len()];
    let mut spans_s: Vec<[f64; 2]> = Vec::new();
    for &burst in &found.blocks {
        let inside = || (0..rest.len()).filter(|&i| blocks.of_sample[i] == burst);
        // Readings of a loose contact go with what they should be, not by one amount.
        let mut line = Line::default();
        inside().for_each(|i| line.add(1.0, fit.predicted[i], rest[i]));
        let (slope, constant) = line.fit(1e-9).unwrap_or((0.0, line.mean()));
        inside().for_each(|i| correction[i] = slope * fit.predicted[i] + constant);
        let ends = inside().fold([f64::INFINITY, f64::NEG_INFINITY], |ends, i| {
            [ends[0].min(times_s[i]), ends[1].max(times_s[i])]
        });
        match spans_s.last_mut() {
            Some(last) if blocks.follows[burst] && found.blocks.contains(&(burst - 1)) => {
                last[1] = ends[1];
            }
            _ => spans_s.push(ends),
        }
    }
    Some(Shape {
        depends_on: vec![("time s".to_owned(), 1.0)],
        spans_s,
        ..not_predictable(correction, rest)
    })
}

fn not_predictable(correction: Vec<f64>, rest: Vec<f64>) -> Shape {
    Shape {
        depends_on: Vec::new(),
        curve: Vec::new(),
        expression: None,
        expression_share: 0.0,
        nearest: None,
        period_s: None,
        spans_s: Vec::new(),
        is_predictable: false,
        correction,
        left: rest,
    }
}

/// A jet whose strength oscillates.
fn pulsation(setting: &Setting, fit: &Fit, frequency_hz: f64) -> Shape {
    let observed = setting.observed;
    let clean = observed.predict(&setting.base);
    let left = setting.left(&fit.predicted);
    let omega = std::f64::consts::TAU * frequency_hz;
    let mut clock_s = observed.times_s();
    for (samples, released_s) in observed.releases() {
        for (i, released_s) in samples.into_iter().zip(released_s) {
            clock_s[i] = released_s;
        }
    }
    let column = |(clean, t_s): (&f64, &f64)| {
        let (sin, cos) = (omega * t_s).sin_cos();
        Vector2::new(clean * sin, clean * cos)
    };
    let columns: Vec<Vector2<f64>> = clean.iter().zip(&clock_s).map(column).collect();
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for ((column, left), weight) in columns.iter().zip(&left).zip(setting.noise.weights()) {
        normal += weight * column * column.transpose();
        right += weight * *left * column;
    }
    let part = normal.lu().solve(&right).unwrap_or_else(Vector2::zeros);
    let correction: Vec<f64> = columns.iter().map(|column| part.dot(column)).collect();
    Shape {
        depends_on: vec![("time of release s".to_owned(), 1.0)],
        curve: Vec::new(),
        expression: Some(format!(
            "{:.3} U sin(2 pi t/{:.2} s {:+.2})",
            part.norm(),
            frequency_hz.recip(),
            part.y.atan2(part.x)
        )),
        expression_share: 1.0,
        nearest: None,
        period_s: Some(frequency_hz.recip()),
        spans_s: Vec::new(),
        is_predictable: true,
        left: difference(&left, &correction),
        correction,
    }
}

fn shape(setting: &Setting, selection: &Selection, held_out: &HeldOut) -> Shape {
    let around = setting.observed.covariates();
    let noise = setting.noise;
    let rest = setting.left(&selection.chosen.fit.predicted);
    let forest = trees::fit(around.columns, &rest, &noise.weights());
    let mut shares: Vec<(usize, f64)> = forest.shares().into_iter().enumerate().collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let first = shares.first().map_or(0, |(k, _)| *k);
    let edges = quantile_edges(&around.columns[first], CURVE_POINTS);
    let along = forest.partial_dependence(around.columns, first, &edges);
    let share_of = |name: &str| -> f64 {
        let is_it = |(k, _): &&(usize, f64)| around.names[*k].0.ends_with(name);
        shares.iter().filter(is_it).map(|(_, share)| share).sum()
    };
    let in_body = share_of("az body") > share_of("az");
    let azimuth = around.azimuth_rad(in_body);
    // Three covariates and the azimuth: more would be no short expression.
    let others = shares.iter().map(|(k, _)| *k);
    let others = others.filter(|&k| !around.names[k].0.contains(" az"));
    let coordinates = others.take(3).map(|k| Coordinate {
        letter: around.names[k].1,
        values: &around.columns[k],
        is_angle: false,
    });
    let mut coordinates: Vec<Coordinate> = coordinates.collect();
    coordinates.extend(azimuth.as_ref().map(|values| Coordinate {
        letter: if in_body { "phi_b" } else { "phi" },
        values,
        is_angle: true,
    }));
    let total = held_out.gain.total;
    let found = expression::find(&coordinates, &rest, noise)
        .filter(|found| found.gain.total > LEAST_TOLD * total);
    let all = total + selection.chosen.gain.total.max(0.0);
    let singles = selection.singles.iter();
    let nearest = singles
        .map(|tried| (&setting.candidates[tried.which[0]], tried.gain.total))
        .filter(|(candidate, _)| candidate.kind == Kind::Physics)
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(candidate, gain)| (candidate.name.to_owned(), (gain / all).clamp(0.0, 1.0)));
    let depends_on = shares.iter().take(3);
    let told = found.as_ref().map_or(0.0, |found| found.gain.total);
    Shape {
        depends_on: depends_on
            .map(|&(k, share)| (around.names[k].0.to_owned(), share))
            .collect(),
        curve: edges.into_iter().zip(along).collect(),
        expression_share: (told / total).clamp(0.0, 1.0),
        expression: found.map(|found| found.expression.to_string()),
        nearest,
        period_s: None,
        spans_s: Vec::new(),
        is_predictable: true,
        left: difference(&rest, &held_out.predictions),
        correction: held_out.predictions.clone(),
    }
}
