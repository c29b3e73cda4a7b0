//! Whether something is there that the library does not hold, and its shape.
//!
//! The global lack-of-fit test says whether anything is there at all. Then the library's best has
//! to hold its own against explanations that know no physics: a curve of the reading, boosted trees
//! over the covariates, a pulsation, stretches of time; and against the noise. Where one of them
//! takes more than the laws that are named may be off, or these leave more than they and the noise
//! may be, something is missing that has no name here, and its shape is told: the covariates that
//! it depends on, a curve, the nearest library term, a short expression. What they predict serves
//! as correction inside what was sampled only.

use nalgebra::{Matrix2, Vector2};
use serde::Serialize;

use crate::forward::observed::PROBE;
use crate::infer::candidates::GAIN;
use crate::infer::diagnose::departing;
use crate::infer::fit::{Fit, Setting};
use crate::infer::select::{Selection, Tried, beyond_closure, closure};
use crate::statistics::bursts::bursts;
use crate::statistics::column::{self, Column};
use crate::statistics::curve;
use crate::statistics::expression::{self, Coordinate};
use crate::statistics::held_out::{Gain, log_densities};
use crate::statistics::lack_of_fit::{
    Evidence, LackOfFit, Rhythm, bounded, lack_of_fit, strongest_line,
};
use crate::statistics::line::Line;
use crate::statistics::quantile::{difference, quantile_edges, root_mean_square};
use crate::statistics::trees::{self, HeldOut};

/// How sure a gain of trees must be: in standard errors, as a term of the library, and in held-out
/// log density. Chosen here: surer than a term, for trees follow whatever repeats.
const LEAST_ERRORS: f64 = 2.5;
const LEAST_GAIN: f64 = 10.0;
/// A held-out gain from which a selection or a shape stands without the global test, and how many
/// standard errors it must be: where the scatter is read too small, a gain alone says little.
/// Chosen here.
const BEYOND_DOUBT: f64 = 40.0;
const BEYOND_DOUBT_ERRORS: f64 = 4.0;
/// How many standard errors a smaller gain must be for that, from flight to flight: one in some ten
/// thousand of Student's t of six flights. An amount that all flights share is what the global test
/// leaves to their offsets, however large.
const STEADY_ERRORS: f64 = 10.0;
/// Mean square of whitened readings that the noise's own estimate allows: that of 79 simulated
/// recordings without an effect (seed 31) is 0.90 to 1.21, and 1.31 where there are 212 readings.
const MISREAD: f64 = 1.25;
/// p-value from which a spectral line is a pulsation. Chosen here, far below what the global test
/// accepts: nothing else vouches for it.
const LINE_P: f64 = 1e-5;
/// p-value of one block in all from which readings that differ at times are reported: at most one
/// recording in a thousand without an effect (none of the 160 of the two runs in
/// docs/diagnosis.md). And that of a block which is then counted to it.
const PRESENT_P: f64 = 0.001;
const EACH_BURST_P: f64 = 0.05;
/// Part of the trees' gain that an expression must gain to be reported. Chosen here.
const LEAST_TOLD: f64 = 0.2;
/// Steps in time that the global test looks for.
const STEPS: usize = 16;
/// What a curve of the reading depends on.
pub const EXPECTED_READING: &str = "expected reading m/s";
/// What a pulsation of the rotors depends on.
pub const RELEASE: &str = "time of release s";
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
    /// From when to when (s) the readings differ, where time alone shows it.
    pub spans_s: Vec<[f64; 2]>,
    /// Whether it predicts blocks that were not fitted. What does not is there all the same.
    pub is_predictable: bool,
    /// Root mean square of the correction over that of the recorded values, where it is more than
    /// half a standard deviation, or of all where it nowhere is.
    pub part: f64,
    /// The trees' correction of each sample, held out, in the channel's unit, on top of what the
    /// chosen terms predict with gain and offset.
    #[serde(skip)]
    pub correction: Vec<f64>,
    /// What the correction leaves of each recorded value, in the channel's unit.
    #[serde(skip)]
    pub left: Vec<f64>,
    /// Of each instrument, gain (1) and offset (the channel's unit) that the correction lies on.
    #[serde(skip)]
    pub tolerance: Vec<[f64; 2]>,
}

/// Part of what depends on covariates from which which probe reads is more than a detail. Chosen
/// here.
const OF_A_PROBE: f64 = 0.2;

/// Part of what is read below which something without a name is too small to matter for planning:
/// as of a gain.
const PRACTICAL_PART: f64 = GAIN.parameters[0].practical;

impl Shape {
    /// Whether it is there, and too small to matter for planning: a label.
    #[must_use]
    pub fn is_small(&self) -> bool {
        self.part < PRACTICAL_PART
    }

    /// Whether it depends on which probe reads: on an instrument, or on what stands in its place.
    #[must_use]
    pub fn is_of_a_probe(&self) -> bool {
        let mut on = self.depends_on.iter();
        on.any(|(name, share)| name == PROBE && *share >= OF_A_PROBE)
    }
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

/// Whether a held-out gain that every flight has alike needs no global test.
pub(crate) fn is_steady(gain: &Gain) -> bool {
    gain.total > LEAST_GAIN.max(STEADY_ERRORS * gain.standard_error)
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
    lack_of_fit(&Evidence {
        residual: &nothing.whitened,
        columns: &column::whitened(&columns, &noise.whitener),
        nuisances: &setting.free_columns(nothing),
        blocks: &noise.blocks,
        rhythms: &of_rotors(setting),
    })
}

/// Every series on the clock of the air's release: a pulsation of the rotors is periodic there, and
/// goes with the flow.
fn of_rotors(setting: &Setting) -> Vec<Rhythm> {
    let clean = setting.observed.predict(&setting.base);
    let sd = setting.noise.sd();
    let releases = setting.observed.releases().into_iter();
    let rhythm = |(samples, clock_s): (Vec<usize>, Vec<f64>)| Rhythm {
        weight: samples.iter().map(|&i| clean[i] / sd[i]).collect(),
        samples,
        clock_s,
        is_slow: false,
    };
    releases.map(rhythm).collect()
}

/// Every series on its own clock: what is switched on and off in the room adds to the reading.
fn of_the_room(setting: &Setting) -> Vec<Rhythm> {
    let times_s = setting.observed.times_s();
    let sd = setting.noise.sd();
    let releases = setting.observed.releases().into_iter();
    let rhythm = |(samples, _): (Vec<usize>, Vec<f64>)| Rhythm {
        weight: samples.iter().map(|&i| sd[i].recip()).collect(),
        clock_s: samples.iter().map(|&i| times_s[i]).collect(),
        samples,
        is_slow: true,
    };
    releases.map(rhythm).collect()
}

/// What the chosen terms leave that something else would predict; `None`: nothing worth a name.
///
/// In this order: a curve of the reading alone (of probes, whose readings are the air's speed) that
/// does better than the terms; trees that take more than the laws of the terms may be off; a
/// pulsation, of rotors or of something in the room; stretches of time that differ; what named
/// terms leave of readings beyond their own errors and the noise's.
#[must_use]
pub fn outside(
    setting: &Setting,
    selection: &Selection,
    test: &LackOfFit,
    left: &HeldOut,
    is_of_probes: bool,
) -> Option<Shape> {
    let chosen = &selection.chosen;
    // Where something is named, that something is there is settled.
    let stands = test.is_significant || is_beyond_doubt(&left.gain) || !chosen.which.is_empty();
    if stands
        && is_of_probes
        && let Some(shape) = instrument(setting, selection)
    {
        return Some(shape);
    }
    let beyond = takes_beyond(setting, selection, &left.predictions);
    if stands && takes_surely(&beyond, &left.gain, chosen.which.is_empty()) {
        return Some(shape(setting, selection, left));
    }
    let fit = &chosen.fit;
    // The surer first: what is switched has lines at three and five times its frequency, too.
    let lines = [of_rotors(setting), of_the_room(setting)].into_iter();
    let lines = lines.filter_map(|rhythms| {
        let line = strongest_line(&rhythms, &fit.whitened)?;
        (line.p < LINE_P).then_some((line.p, line.frequency_hz, rhythms))
    });
    let mut lines: Vec<(f64, f64, Vec<Rhythm>)> = lines.collect();
    lines.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut regular = lines
        .iter()
        .map(|(_, frequency_hz, rhythms)| pulsation(setting, fit, rhythms, *frequency_hz));
    // Beside something that is named, a pulsation or stretches of time have to take more than it
    // may be off; that they are no chance their own p-value says.
    if !chosen.which.is_empty() {
        let takes_more =
            |shape: &Shape| takes_beyond(setting, selection, &shape.correction).total > 0.0;
        return regular
            .find(takes_more)
            .or_else(|| at_times(setting, fit).filter(takes_more))
            // Of forces the noise leaves out what no force in still air shows.
            .or_else(|| unexplained(setting, selection, left).filter(|_| is_of_probes));
    }
    if let Some(shape) = regular.next() {
        return Some(shape);
    }
    at_times(setting, fit)
}

/// A shape as far as it stands: one with which errors on blocks that were not fitted do not fall
/// corrects nothing. Beside terms that are named there is then none (`None`), for these do lower
/// them; alone it says that something is there.
#[must_use]
pub fn standing(setting: &Setting, selection: &Selection, shape: Shape) -> Option<Shape> {
    let nothing = &selection.nothing.fit;
    let before = setting.left(&setting.predicted_held_out(&[], nothing));
    if !shape.is_predictable || root_mean_square(&shape.left) < root_mean_square(&before) {
        return Some(shape);
    }
    selection.chosen.which.is_empty().then(|| Shape {
        depends_on: shape.depends_on,
        ..without_prediction(setting, nothing)
    })
}

/// A curve of the expected reading that predicts more, held out, than the chosen terms and every
/// single effect do, by more than its error: an instrument that fails in a form of its own. `None`:
/// some of them does as well.
fn instrument(setting: &Setting, selection: &Selection) -> Option<Shape> {
    let noise = setting.noise;
    let expected = &selection.nothing.fit.predicted;
    let rest = setting.left(expected);
    let found = curve::held_out(expected, &rest, noise)?;
    let density = log_densities(&noise.whiten(&found.left));
    let over = |other: &Tried| Gain::over(&noise.blocks, &density, &other.log_density);
    let chosen = &selection.chosen;
    let mut others = std::iter::once(chosen).chain(&selection.singles);
    if !others.all(|other| is_sure(&over(other))) {
        return None;
    }
    // One curve against one term, which may be off (gusts blur a ceiling): it has to take more than
    // that. Against two terms it is the simpler explanation, and doing better is enough.
    let terms = difference(&chosen.fit.predicted, expected);
    let correction = difference(&found.predictions, &terms);
    let in_place = difference(&setting.left(&chosen.fit.predicted), &found.left);
    if chosen.which.len() == 1 && takes_beyond(setting, selection, &in_place).total <= 0.0 {
        return None;
    }
    let coordinate = Coordinate {
        letter: "y",
        values: expected,
        is_angle: false,
    };
    let total = over(&selection.nothing).total;
    let told = expression::find(&[coordinate], &rest, noise)
        .filter(|told| told.gain.total > LEAST_TOLD * total);
    let share = told.as_ref().map_or(0.0, |told| told.gain.total / total);
    Some(Shape {
        depends_on: vec![(EXPECTED_READING.to_owned(), 1.0)],
        curve: found.line,
        expression: told.map(|told| told.expression.to_string()),
        expression_share: share.clamp(0.0, 1.0),
        nearest: nearest(setting, selection, total),
        period_s: None,
        spans_s: Vec::new(),
        is_predictable: true,
        part: part(setting, &correction),
        // The curve stands in the place of the chosen terms, not on top of them.
        correction,
        left: found.left,
        tolerance: selection.nothing.fit.tolerance.clone(),
    })
}

/// The library's term that gains most, and its part of all that could be gained.
fn nearest(setting: &Setting, selection: &Selection, all: f64) -> Option<(String, f64)> {
    let singles = selection.singles.iter();
    singles
        .map(|tried| (&setting.candidates[tried.which[0]], tried.gain.total))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(candidate, gain)| (candidate.name.to_owned(), (gain / all).clamp(0.0, 1.0)))
}

/// What a correction on top of the chosen terms takes beyond what their laws may be off.
fn takes_beyond(setting: &Setting, selection: &Selection, correction: &[f64]) -> Gain {
    let chosen = &selection.chosen;
    let after = difference(&setting.left(&chosen.fit.predicted), correction);
    beyond_closure(setting, &selection.nothing, chosen, &after)
}

/// Whether trees surely take more than the laws of what is named may be off, by their gain in
/// squares beyond that and in log density. Where nothing is named no law may be off, and either
/// tells: squares rest on what is largest, so where a few blocks have most of them their sum is no
/// surer than one of these, while a log density counts a large error as little more than a small
/// one.
fn takes_surely(beyond: &Gain, density: &Gain, is_nothing_named: bool) -> bool {
    let is_told = is_nothing_named && is_sure(density) && beyond.total > 0.0;
    is_told || beyond.total > LEAST_ERRORS * beyond.standard_error
}

/// What the terms that are named leave, where that is surely more than noise may be misread by, and
/// more of the squares than their laws may be off: then they are no explanation, whatever predicts
/// the rest.
fn unexplained(setting: &Setting, selection: &Selection, left: &HeldOut) -> Option<Shape> {
    let fit = &selection.chosen.fit;
    let excess = fit.whitened.iter().map(|e| bounded(*e).powi(2) - MISREAD);
    let excess = Gain::new(setting.noise.blocks.sums(excess));
    let floor: f64 = setting.noise.sd().iter().map(|sd| sd * sd).sum();
    let square = |values: &[f64]| values.iter().map(|e| e * e).sum::<f64>();
    let beyond_noise = |fit: &Fit| square(&setting.left(&fit.predicted)) - MISREAD * floor;
    let off = closure(setting, &selection.chosen);
    let (before, rest) = (beyond_noise(&selection.nothing.fit), beyond_noise(fit));
    let is_sure = excess.total > LEAST_ERRORS * excess.standard_error;
    if !is_sure || rest <= off * off * before.max(0.0) {
        return None;
    }
    let corrected = difference(&setting.left(&fit.predicted), &left.predictions);
    Some(
        match square(&corrected) < square(&setting.left(&fit.predicted)) {
            true => shape(setting, selection, left),
            false => Shape {
                nearest: nearest(setting, selection, selection.chosen.gain.total),
                ..without_prediction(setting, fit)
            },
        },
    )
}

/// See [`Shape::part`].
fn part(setting: &Setting, correction: &[f64]) -> f64 {
    let recorded = setting.observed.recorded();
    let inside = departing(&vec![0.0; correction.len()], correction, setting.noise.sd());
    let inside = match inside.is_empty() {
        true => (0..correction.len()).collect(),
        false => inside,
    };
    let of = |values: &[f64]| inside.iter().map(|&i| values[i].powi(2)).sum::<f64>();
    (of(correction) / of(&recorded).max(f64::MIN_POSITIVE)).sqrt()
}

/// Whether a gain of trees is more than chance.
pub(crate) fn is_sure(gain: &Gain) -> bool {
    gain.total > LEAST_GAIN.max(LEAST_ERRORS * gain.standard_error)
}

/// Readings that differ at times: none of it comes back in the same place, so nothing predicts it
/// on blocks that were held out.
fn at_times(setting: &Setting, fit: &Fit) -> Option<Shape> {
    let blocks = &setting.noise.blocks;
    let along = setting.noise.whiten(&fit.predicted);
    let found = bursts(
        &fit.whitened,
        [&fit.predicted, &along],
        blocks,
        EACH_BURST_P,
    );
    if found.p > PRESENT_P {
        return None;
    }
    let times_s = setting.observed.times_s();
    let rest = setting.left(&fit.predicted);
    let mut correction = vec![0.0; rest.len()];
    let mut spans_s: Vec<[f64; 2]> = Vec::new();
    let mut ended = None;
    for window in found.windows {
        // Readings of a loose contact go with what they should be, not by one amount.
        let mut line = Line::default();
        let inside = || window.clone();
        inside().for_each(|i| line.add(1.0, fit.predicted[i], rest[i]));
        let (slope, constant) = line.fit(1e-9).unwrap_or((0.0, line.mean()));
        inside().for_each(|i| correction[i] = slope * fit.predicted[i] + constant);
        let [from_s, to_s] = [window.start, window.end - 1].map(|i| times_s[i]);
        match spans_s.last_mut() {
            Some(last) if ended == Some(window.start) => last[1] = to_s,
            _ => spans_s.push([from_s, to_s]),
        }
        ended = Some(window.end);
    }
    Some(Shape {
        depends_on: vec![("time s".to_owned(), 1.0)],
        spans_s,
        ..not_predictable(correction, rest, fit)
    })
}

/// Something that a fit leaves, without a correction.
fn without_prediction(setting: &Setting, fit: &Fit) -> Shape {
    let rest = setting.left(&fit.predicted);
    not_predictable(vec![0.0; rest.len()], rest, fit)
}

fn not_predictable(correction: Vec<f64>, rest: Vec<f64>, fit: &Fit) -> Shape {
    Shape {
        depends_on: Vec::new(),
        curve: Vec::new(),
        expression: None,
        expression_share: 0.0,
        nearest: None,
        period_s: None,
        spans_s: Vec::new(),
        is_predictable: false,
        part: 0.0,
        correction,
        left: rest,
        tolerance: fit.tolerance.clone(),
    }
}

/// What oscillates: jets together, in parts of their speed, or what is switched in the room, to
/// which each series is exposed by its own amount.
fn pulsation(setting: &Setting, fit: &Fit, rhythms: &[Rhythm], frequency_hz: f64) -> Shape {
    let left = setting.left(&fit.predicted);
    let (sd, weights) = (setting.noise.sd(), setting.noise.weights());
    let omega = std::f64::consts::TAU * frequency_hz;
    let is_slow = rhythms.iter().any(|rhythm| rhythm.is_slow);
    let together = if is_slow { 1 } else { rhythms.len().max(1) };
    let mut correction = vec![0.0; left.len()];
    let mut strongest = Vector2::zeros();
    for rhythms in rhythms.chunks(together) {
        let of_rhythm = |rhythm: &Rhythm| {
            let timed = rhythm.samples.iter().zip(&rhythm.clock_s);
            let column = |((&i, t_s), weight): ((&usize, &f64), &f64)| {
                let (sin, cos) = (omega * t_s).sin_cos();
                (i, weight * sd[i] * Vector2::new(sin, cos))
            };
            timed.zip(&rhythm.weight).map(column).collect::<Vec<_>>()
        };
        let columns: Vec<(usize, Vector2<f64>)> = rhythms.iter().flat_map(of_rhythm).collect();
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for (i, column) in &columns {
            normal += weights[*i] * column * column.transpose();
            right += weights[*i] * left[*i] * column;
        }
        let part = normal.lu().solve(&right).unwrap_or_else(Vector2::zeros);
        let along = columns.iter().map(|(i, column)| (*i, part.dot(column)));
        along.for_each(|(i, along)| correction[i] = along);
        if part.norm() > strongest.norm() {
            strongest = part;
        }
    }
    let (clock, of_flow) = match is_slow {
        true => ("time s", ""),
        false => (RELEASE, "U "),
    };
    Shape {
        depends_on: vec![(clock.to_owned(), 1.0)],
        curve: Vec::new(),
        expression: Some(format!(
            "{:.3} {of_flow}sin(2 pi t/{:.2} s {:+.2})",
            strongest.norm(),
            frequency_hz.recip(),
            strongest.y.atan2(strongest.x)
        )),
        expression_share: 1.0,
        nearest: None,
        period_s: Some(frequency_hz.recip()),
        spans_s: Vec::new(),
        is_predictable: true,
        part: part(setting, &correction),
        left: difference(&left, &correction),
        correction,
        tolerance: fit.tolerance.clone(),
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
    // The number of a probe is no quantity.
    let is_quantity = |&k: &usize| !around.names[k].0.contains(" az") && around.names[k].0 != PROBE;
    let others = others.filter(is_quantity);
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
    // Where it is sure in squares alone, nothing is a part of the density.
    let total = held_out.gain.total.max(LEAST_GAIN);
    let found = expression::find(&coordinates, &rest, noise)
        .filter(|found| found.gain.total > LEAST_TOLD * total);
    let all = total + selection.chosen.gain.total.max(0.0);
    let depends_on = shares.iter().take(3);
    let told = found.as_ref().map_or(0.0, |found| found.gain.total);
    Shape {
        depends_on: depends_on
            .map(|&(k, share)| (around.names[k].0.to_owned(), share))
            .collect(),
        curve: edges.into_iter().zip(along).collect(),
        expression_share: (told / total).clamp(0.0, 1.0),
        expression: found.map(|found| found.expression.to_string()),
        nearest: nearest(setting, selection, all),
        period_s: None,
        spans_s: Vec::new(),
        is_predictable: true,
        part: part(setting, &held_out.predictions),
        left: difference(&rest, &held_out.predictions),
        correction: held_out.predictions.clone(),
        tolerance: selection.chosen.fit.tolerance.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_every_flight_gains_alike_stands_and_what_one_gains_does_not() {
        assert!(is_steady(&Gain::new(vec![4.0, 4.1, 3.9, 4.2, 4.0, 3.8])));
        assert!(!is_steady(&Gain::new(vec![0.1, 0.2, 23.0, 0.1, 0.3, 0.2])));
        // However alike: a term that gains so little is none.
        assert!(!is_steady(&Gain::new(vec![1.5; 6])));
    }

    #[test]
    fn where_one_block_has_most_of_the_squares_the_log_density_tells_unless_a_law_is_named() {
        let mut squares = vec![0.1; 20];
        squares[3] = 40.0;
        let (squares, density) = (Gain::new(squares), Gain::new(vec![5.0; 20]));
        assert!(squares.total < LEAST_ERRORS * squares.standard_error);
        assert!(takes_surely(&squares, &density, true));
        assert!(!takes_surely(&squares, &density, false));
        // Nor where squares rise, or the density is as unsure.
        assert!(!takes_surely(&Gain::new(vec![-0.1; 20]), &density, true));
        assert!(!takes_surely(&squares, &squares, true));
    }
}
