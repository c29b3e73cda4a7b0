//! Whether something is there that the library does not hold, and its shape.
//!
//! Boosted trees over the circumstances are the yardstick: they know no physics and can predict whatever repeats. Where they gain much on what
//! the best of the library leaves, on blocks that neither has seen, something is missing that has no name here. Then its shape is told: the
//! circumstances that it depends on, a curve, the nearest library term, a short expression. The trees serve as correction inside what was sampled only.

use nalgebra::{DMatrix, Matrix2, Vector2};
use serde::Serialize;

use crate::infer::candidates::{Candidate, Kind as CandidateKind};
use crate::infer::diagnose::is_beyond_doubt;
use crate::infer::fit::{Fit, Setting};
use crate::infer::select::{Selection, flexible};
use crate::statistics::column::{self, Column, Covariate, Kind};
use crate::statistics::expression::{self, Coordinate};
use crate::statistics::gate::{Evidence, Gate, Options, Rhythm, Statistic, gate};
use crate::statistics::trees;

/// Part of all that could be gained that must be left for "outside the library", and how sure that must be.
const LEFT_SHARE: f64 = 0.35;
const LEAST_ERRORS: f64 = 2.5;
const LEAST_GAIN: f64 = 10.0;
/// A line is a pulsation from here on (chance of noise). Chosen here, far below the gate's own level: nothing else vouches for it.
const LINE_CHANCE: f64 = 1e-5;
/// Steps in time that the gate looks for.
const STEPS: usize = 16;
/// Points of a curve.
const CURVE_POINTS: usize = 24;

/// Something without a name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shape {
    /// The circumstances that matter most, with the share of what the trees explain.
    pub depends_on: Vec<(String, f64)>,
    /// Along the first of them: its value, and the mean correction there in the channel's unit.
    pub curve: Vec<(f64, f64)>,
    /// The best short expression for the correction; `None`: none predicts held-out blocks.
    pub expression: Option<String>,
    /// Part of what the trees gain that the expression gains.
    pub expression_share: f64,
    /// The library's nearest term, and the part of all that could be gained that it gains.
    pub nearest: Option<(String, f64)>,
    /// Period (s) of a pulsation, where that is what it is.
    pub period_s: Option<f64>,
    /// The trees' correction of each sample, held out, in the channel's unit.
    #[serde(skip)]
    pub correction: Vec<f64>,
    /// What the correction leaves of each recorded value, in the channel's unit.
    #[serde(skip)]
    pub left: Vec<f64>,
}

/// Is anything there at all, beside the instrument's tolerance?
#[must_use]
pub fn anything(setting: &Setting, candidates: &[Candidate], nothing: &Fit) -> Gate {
    let observed = setting.observed;
    let noise = setting.noise;
    let clean = observed.predict(&setting.base);
    let mut columns: Vec<Column> = Vec::new();
    for candidate in candidates {
        for start in &candidate.starts {
            let changed = observed.predict(&candidate.on(&setting.base, start));
            let values: Vec<f64> = changed
                .iter()
                .zip(&clean)
                .map(|(to, from)| to - from)
                .collect();
            columns.push(Column {
                name: candidate.name.to_owned(),
                kind: Kind::Tangent,
                values,
            });
        }
    }
    let around = observed.circumstances();
    let covariates: Vec<Covariate> = around
        .names
        .iter()
        .zip(around.columns)
        .map(|((name, _), values)| Covariate { name, values })
        .collect();
    columns.extend(column::bins(&covariates, &noise.sd));
    columns.extend(column::steps(&observed.times_s(), &noise.sd, STEPS));
    let columns = column::whitened(&columns, &noise.whitener);
    // Gain and offset where they are free to take more.
    let free: Vec<usize> = (0..2)
        .filter(|&j| !setting.at_tolerance(j, nothing.tolerance[j]))
        .collect();
    let nuisances = DMatrix::from_fn(clean.len(), free.len(), |i, j| {
        nothing.jacobian[(i, free[j])]
    });
    let rhythms = rhythms(setting, &clean);
    gate(
        &Evidence {
            residual: &nothing.whitened,
            columns: &columns,
            nuisances: &nuisances,
            blocks: &noise.sequence_blocks,
            rhythms: &rhythms,
        },
        Options::default(),
    )
}

/// Every series on the clock of the air's release: a pulsation of the rotors is periodic there.
fn rhythms(setting: &Setting, clean: &[f64]) -> Vec<Rhythm> {
    let releases = setting.observed.releases();
    releases
        .into_iter()
        .map(|(samples, clock_s)| {
            let weight = samples
                .iter()
                .map(|&i| clean[i] / setting.noise.sd[i])
                .collect();
            Rhythm {
                samples,
                clock_s,
                weight,
            }
        })
        .collect()
}

/// What the chosen terms leave that something else would predict; `None`: nothing worth a name.
#[must_use]
pub fn outside(
    setting: &Setting,
    candidates: &[Candidate],
    selection: &Selection,
    gate: &Gate,
) -> Option<Shape> {
    let chosen = &selection.chosen;
    let left = flexible(setting, &chosen.fit);
    let library = chosen.gain.total.max(0.0);
    let gain = &left.gain;
    let enough = gain.total > LEAST_GAIN.max(LEAST_ERRORS * gain.standard_error);
    let stands = gate.passed || is_beyond_doubt(gain.total, gain.standard_error);
    if enough && gain.total > LEFT_SHARE * (library + gain.total) && stands {
        return Some(shape(setting, candidates, selection, &left));
    }
    let line = gate
        .line
        .as_ref()
        .filter(|(_, line)| line.p < LINE_CHANCE && chosen.which.is_empty());
    line.filter(|_| gate.statistic == Statistic::Rhythm)
        .map(|(_, line)| pulsation(setting, &chosen.fit, line.frequency_hz))
}

/// A jet that is stronger and weaker by turns.
fn pulsation(setting: &Setting, fit: &Fit, frequency_hz: f64) -> Shape {
    let observed = setting.observed;
    let clean = observed.predict(&setting.base);
    let recorded = observed.recorded();
    let turn = std::f64::consts::TAU * frequency_hz;
    let mut clock_s = observed.times_s();
    for (samples, released_s) in observed.releases() {
        for (i, released_s) in samples.into_iter().zip(released_s) {
            clock_s[i] = released_s;
        }
    }
    let columns: Vec<[f64; 2]> = (0..clean.len())
        .map(|i| {
            let (sin, cos) = (turn * clock_s[i]).sin_cos();
            [clean[i] * sin, clean[i] * cos]
        })
        .collect();
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for (i, &[s, c]) in columns.iter().enumerate() {
        let weight = setting.noise.sd[i].powi(-2);
        let column = Vector2::new(s, c);
        normal += weight * column * column.transpose();
        right += weight * (recorded[i] - fit.predicted[i]) * column;
    }
    let part = normal.lu().solve(&right).unwrap_or_else(Vector2::zeros);
    let correction: Vec<f64> = columns
        .iter()
        .map(|&[s, c]| part.x * s + part.y * c)
        .collect();
    let left = (0..clean.len())
        .map(|i| recorded[i] - fit.predicted[i] - correction[i])
        .collect();
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
        correction,
        left,
    }
}

fn shape(
    setting: &Setting,
    candidates: &[Candidate],
    selection: &Selection,
    left: &trees::HeldOut,
) -> Shape {
    let around = setting.observed.circumstances();
    let noise = setting.noise;
    let recorded = setting.observed.recorded();
    let x = DMatrix::from_fn(recorded.len(), around.columns.len(), |i, j| {
        around.columns[j][i]
    });
    let chosen = &selection.chosen.fit.predicted;
    let rest: Vec<f64> = recorded.iter().zip(chosen).map(|(y, f)| y - f).collect();
    let weights: Vec<f64> = noise.sd.iter().map(|sd| (sd * sd).recip()).collect();
    let forest = trees::fit(&x, &rest, &weights, trees::Options::default());
    let mut shares: Vec<(usize, f64)> = forest.shares().into_iter().enumerate().collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let first = shares.first().map_or(0, |(k, _)| *k);
    let edges = column::quantile_edges(&around.columns[first], CURVE_POINTS);
    let along = forest.partial_dependence(&x, first, &edges);
    let share_of = |name: &str| {
        let of_name = shares
            .iter()
            .filter(|(k, _)| around.names[*k].0.ends_with(name));
        of_name.map(|(_, share)| share).sum::<f64>()
    };
    let in_body = share_of("az body") > share_of("az");
    let azimuth = around.azimuth_rad(in_body);
    // Three circumstances and the azimuth: more would be no short expression.
    let mut coordinates: Vec<Coordinate> = shares
        .iter()
        .filter(|(k, _)| !around.names[*k].0.contains(" az"))
        .take(3)
        .map(|&(k, _)| Coordinate {
            letter: around.names[k].1,
            values: &around.columns[k],
            is_angle: false,
        })
        .collect();
    coordinates.extend(azimuth.as_ref().map(|values| Coordinate {
        letter: if in_body { "phi_b" } else { "phi" },
        values,
        is_angle: true,
    }));
    let found = expression::find(&coordinates, &rest, &noise.whitener, &noise.sequence_blocks);
    let found = found
        .first()
        .filter(|found| found.gain.total > 0.2 * left.gain.total);
    let all = left.gain.total + selection.chosen.gain.total.max(0.0);
    let nearest = selection
        .singles
        .iter()
        .filter(|tried| candidates[tried.which[0]].kind == CandidateKind::Physics)
        .max_by(|a, b| a.gain.total.total_cmp(&b.gain.total))
        .map(|tried| {
            (
                candidates[tried.which[0]].name.to_owned(),
                (tried.gain.total / all).clamp(0.0, 1.0),
            )
        });
    Shape {
        depends_on: shares
            .iter()
            .take(3)
            .map(|&(k, share)| (around.names[k].0.to_owned(), share))
            .collect(),
        curve: edges.into_iter().zip(along).collect(),
        expression: found.map(|found| found.expression.to_string()),
        expression_share: found.map_or(0.0, |found| {
            (found.gain.total / left.gain.total).clamp(0.0, 1.0)
        }),
        nearest,
        period_s: None,
        left: rest
            .iter()
            .zip(&left.predictions)
            .map(|(rest, correction)| rest - correction)
            .collect(),
        correction: left.predictions.clone(),
    }
}
