//! A hypothesis fitted to samples: bounded Levenberg-Marquardt on whitened residuals, gross errors
//! weighed down, the instrument's own tolerance fitted along.
//!
//! ```text
//! minimise Σ ρ(e_i) + (n_g/s)² + (n_b/s)²,   e = L[(y - (1 + n_g) f(θ) - n_b)/sd],   ρ(e) = 2 c² (√(1 + e²/c²) - 1)
//! ```
//!
//! Gain `n_g` and offset `n_b` are in every fit, the empty one included, with hard bounds: what the
//! maker allows and no more. Soft priors alone let an offset swallow half a wind.
//!
//! The iteration is our own because every parameter here has hard bounds, at which many fits end,
//! and the crate `levenberg-marquardt`, which [`crate::calibrate`] uses, knows none; and because a
//! prediction is what takes long.

mod descent;

use nalgebra::{DMatrix, DVector};

use descent::Descent;

use crate::forward::hypothesis::Hypothesis;
use crate::forward::observed::{Explained, Observed};
use crate::forward::simulate::Channel;
use crate::infer::candidates::{Candidate, Parameter, Scope};
use crate::statistics::held_out::{FOLDS, log_densities};
use crate::statistics::noise::Noise;
use crate::statistics::quantile::difference;
use crate::statistics::robust::{loss, weight};

/// Spread (`s`) that gain (1) and offset (the channel's unit) have without evidence, within wide
/// bounds. Chosen here: two fifths of a stated 5 %.
const TOLERANCE_SD: f64 = 0.02;
/// From more starts than this, only the best few by cost are followed. Chosen here, for time.
const MOST_STARTS: usize = 6;
const BEST_STARTS: usize = 3;

/// What every fit of one recording shares.
#[derive(Clone, Debug)]
pub struct Setting<'a> {
    /// The samples.
    pub observed: &'a dyn Explained,
    /// Their scatter.
    pub noise: &'a Noise,
    /// What may be missing.
    pub candidates: &'a [Candidate],
    /// What is supposed before any candidate.
    pub base: Hypothesis,
    recorded: Vec<f64>,
    times_s: Vec<f64>,
    /// Which instrument read each value, from 0; each has a gain and an offset of its own.
    instrument_of: Vec<usize>,
    instruments: usize,
    tolerances: [f64; 2],
}

/// One fitted hypothesis.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Values of the candidates' parameters, one candidate after another.
    pub values: Vec<f64>,
    /// Of each instrument, fitted gain (1) and offset (the channel's unit) within its tolerance.
    pub tolerance: Vec<[f64; 2]>,
    /// Predicted readings, gain and offset included, in the channel's unit.
    pub predicted: Vec<f64>,
    /// Whitened residuals.
    pub whitened: Vec<f64>,
    /// Change of the whitened prediction with each parameter: samples by parameters, gains and
    /// offsets last.
    pub jacobian: DMatrix<f64>,
    /// Cost with the tolerance's priors: twice a negative log likelihood.
    pub cost: f64,
}

impl<'a> Setting<'a> {
    /// Fits of these samples, on top of `base`, within what the maker of the instrument allows.
    #[must_use]
    pub fn new(
        observed: &'a Observed<'a>,
        noise: &'a Noise,
        candidates: &'a [Candidate],
        base: Hypothesis,
    ) -> Setting<'a> {
        let probes = observed.recording.probes.as_ref();
        let tolerances = match (observed.channel, probes.map(|probes| &probes.instrument)) {
            (Channel::Speed, Some(probe)) => [
                probe.accuracy_rel,
                probe.accuracy_abs_mps + probe.resolution_mps,
            ],
            // A throttle ratio refers to the drone's own hover: a percent, as far as hovers agree.
            _ => [0.01, 1e-6],
        };
        let mut setting = Setting::within(observed, noise, candidates, tolerances);
        setting.base = base;
        setting
    }

    /// The same of anything that can be explained, on top of nothing; `tolerances` bound gain (1)
    /// and offset (the channel's unit).
    #[must_use]
    pub fn within(
        observed: &'a dyn Explained,
        noise: &'a Noise,
        candidates: &'a [Candidate],
        tolerances: [f64; 2],
    ) -> Setting<'a> {
        let instrument_of = observed.instruments();
        Setting {
            observed,
            noise,
            candidates,
            base: Hypothesis::default(),
            recorded: observed.recorded(),
            times_s: observed.times_s(),
            instruments: instrument_of.iter().max().map_or(1, |last| last + 1),
            instrument_of,
            tolerances,
        }
    }

    /// The same for other samples, to predict them: this noise is not theirs.
    #[must_use]
    pub fn of(&self, observed: &'a dyn Explained) -> Setting<'a> {
        let mut setting = Setting::within(observed, self.noise, self.candidates, self.tolerances);
        setting.base = self.base;
        setting
    }

    /// What predictions leave of the recorded values, in the channel's unit.
    #[must_use]
    pub fn left(&self, predicted: &[f64]) -> Vec<f64> {
        difference(&self.recorded, predicted)
    }

    /// Change of the prediction from the base when a candidate's parameters take these values, in
    /// the channel's unit; `clean` is what the base predicts.
    #[must_use]
    pub fn change(&self, candidate: &Candidate, values: &[f64], clean: &[f64]) -> Vec<f64> {
        difference(&self.predicted(&[candidate], values), clean)
    }

    /// What everything together predicts at given values, one candidate after another, before gain
    /// and offset; each counts in its own scope.
    #[must_use]
    pub fn predicted(&self, members: &[&Candidate], values: &[f64]) -> Vec<f64> {
        if members.iter().all(|of| of.scope == Scope::Whole) {
            return self.observed.predict(&self.hypothesis(members, values));
        }
        // For each value, in whose scopes it is: one bit a member.
        let bits_of = |i: usize| {
            let holds = |of: &Candidate| of.scope.holds(self.times_s[i], self.instrument_of[i]);
            let members = members.iter().enumerate();
            members.fold(0u32, |bits, (k, of)| bits | u32::from(holds(of)) << k)
        };
        let of_value: Vec<u32> = (0..self.times_s.len()).map(bits_of).collect();
        let mut all = of_value.clone();
        all.sort_unstable();
        all.dedup();
        let mut predicted = vec![0.0; of_value.len()];
        for bits in all {
            let mut hypothesis = self.base;
            for (k, (of, own)) in by_member(members, values).enumerate() {
                if bits >> k & 1 != 0 {
                    of.set(own, &mut hypothesis);
                }
            }
            let now = self.observed.predict(&hypothesis);
            for (i, now) in now.into_iter().enumerate() {
                if of_value[i] == bits {
                    predicted[i] = now;
                }
            }
        }
        predicted
    }

    /// How many instruments read.
    pub(crate) fn instrument_count(&self) -> usize {
        self.instruments
    }

    /// Values as they are where a scope holds, and 0 elsewhere.
    pub(crate) fn in_scope(&self, scope: &Scope, values: &[f64]) -> Vec<f64> {
        let holds = |i: usize| scope.holds(self.times_s[i], self.instrument_of[i]);
        let values = values.iter().enumerate();
        values
            .map(|(i, value)| if holds(i) { *value } else { 0.0 })
            .collect()
    }

    /// Cost of predictions read with a gain and an offset: twice a negative log likelihood.
    pub(crate) fn cost_of(&self, plain: &[f64], tolerance: &[[f64; 2]]) -> f64 {
        let at = tolerance.as_flattened();
        self.cost(&self.whitened(plain, at), at)
    }

    /// The columns of a fit's derivatives that can take more: all but gain and offset where they
    /// have reached what the maker allows.
    #[must_use]
    pub fn free_columns(&self, fit: &Fit) -> DMatrix<f64> {
        let count = fit.values.len();
        let tolerance = fit.tolerance.as_flattened();
        let is_free =
            |which: &usize| tolerance[*which].abs() <= 0.999 * self.tolerances[*which % 2];
        let last = (0..tolerance.len()).filter(is_free);
        let free = (0..count).chain(last.map(|which| count + which));
        fit.jacobian.select_columns(&free.collect::<Vec<usize>>())
    }

    /// What each instrument's gain and offset change of predictions, whitened, and as much of
    /// either as the maker allows.
    pub(crate) fn tolerated(&self, clean: &[f64]) -> Vec<[(Vec<f64>, f64); 2]> {
        let of = |which: usize| {
            let both = self
                .of_instrument(clean, which)
                .map(|of| self.noise.whiten(&of));
            let [of_gain, of_offset] = both;
            let [gain, offset] = self.tolerances;
            [(of_gain, gain), (of_offset, offset)]
        };
        (0..self.instruments).map(of).collect()
    }

    /// What an instrument's gain and offset change of its readings: their predictions, and one.
    fn of_instrument(&self, plain: &[f64], which: usize) -> [Vec<f64>; 2] {
        let own = |i: usize, value: f64| {
            if self.instrument_of[i] == which {
                value
            } else {
                0.0
            }
        };
        let gain = plain.iter().enumerate().map(|(i, value)| own(i, *value));
        [
            gain.collect(),
            (0..plain.len()).map(|i| own(i, 1.0)).collect(),
        ]
    }

    /// Gain and offset of each instrument, which stand last.
    fn tolerance_in<'f>(&self, at: &'f [f64]) -> &'f [[f64; 2]] {
        let (last, _) = at[at.len() - 2 * self.instruments..].as_chunks();
        last
    }

    /// What instruments with these gains and offsets read.
    fn read(&self, plain: &[f64], tolerance: &[[f64; 2]]) -> Vec<f64> {
        let each = plain.iter().zip(&self.instrument_of);
        let read = each.map(|(value, &which)| {
            let [gain, offset] = tolerance[which];
            (1.0 + gain) * value + offset
        });
        read.collect()
    }

    /// Everything together at given values, one candidate after another.
    #[must_use]
    pub fn hypothesis(&self, members: &[&Candidate], values: &[f64]) -> Hypothesis {
        let mut hypothesis = self.base;
        for (candidate, own) in by_member(members, values) {
            candidate.set(own, &mut hypothesis);
        }
        hypothesis
    }

    /// Fits candidates together, from each of some starts; the best. `None` without a start.
    #[must_use]
    pub fn fit(&self, candidates: &[&Candidate], starts: &[Vec<f64>]) -> Option<Fit> {
        let mut starts: Vec<&[f64]> = starts.iter().map(Vec::as_slice).collect();
        if starts.len() > MOST_STARTS {
            let cost = |start: &[f64]| {
                let predicted = self.predicted(candidates, start);
                self.cost_of(&predicted, &vec![[0.0; 2]; self.instruments])
            };
            let mut by_cost: Vec<_> = starts.into_iter().map(|s| (cost(s), s)).collect();
            by_cost.sort_by(|a, b| a.0.total_cmp(&b.0));
            let best = by_cost.into_iter().take(BEST_STARTS);
            starts = best.map(|(_, start)| start).collect();
        }
        let ends = starts.into_iter().map(|start| {
            let mut descent = Descent::from(self, candidates, start);
            descent.go_down();
            descent
        });
        let best = ends.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        Some(best.settled())
    }

    /// Nothing but the instrument's tolerance.
    #[must_use]
    pub fn nothing(&self) -> Fit {
        Descent::from(self, &[], &[]).settled()
    }

    /// How far gain and offset may be off at all: no more than their bounds allow, `b/√3` where
    /// anything between is as likely. Fits go by bounds and by the wider spread, so that one which
    /// has reached its bound is known to.
    pub(crate) fn spreads(&self) -> Vec<f64> {
        let spreads = (self.tolerances).map(|most| TOLERANCE_SD.min(most / 3.0_f64.sqrt()));
        spreads.repeat(self.instruments)
    }

    /// Their wide spreads.
    fn wide_spreads(&self) -> Vec<f64> {
        vec![TOLERANCE_SD; 2 * self.instruments]
    }

    fn bounds(&self, parameters: &[Parameter]) -> Vec<[f64; 2]> {
        let own = parameters.iter().map(|p| [p.low, p.high]);
        let last = self.tolerances.map(|most| [-most, most]);
        own.chain(last.repeat(self.instruments)).collect()
    }

    fn whitened(&self, plain: &[f64], at: &[f64]) -> Vec<f64> {
        let read = self.read(plain, self.tolerance_in(at));
        self.noise.whiten(&self.left(&read))
    }

    fn cost(&self, whitened: &[f64], at: &[f64]) -> f64 {
        let prior = |x: f64| (x / TOLERANCE_SD) * (x / TOLERANCE_SD);
        let last = self.tolerance_in(at).as_flattened().iter();
        whitened.iter().map(|e| loss(*e)).sum::<f64>() + last.map(|x| prior(*x)).sum::<f64>()
    }

    /// How well each sample is predicted by what was learnt from the others: blocks are left out by
    /// folds, and the linearised fit is solved again without them. One log density (up to a
    /// constant) for each sample.
    #[must_use]
    pub fn held_out(&self, candidates: &[&Candidate], fit: &Fit) -> Vec<f64> {
        let mut residuals = fit.whitened.clone();
        for fold in 0..FOLDS {
            let moved = &fit.jacobian * self.step_without(candidates, fit, fold);
            for i in self.of_fold(fold) {
                residuals[i] = fit.whitened[i] - moved[i];
            }
        }
        log_densities(&residuals)
    }

    /// What each sample is predicted to be, gain and offset included, by the fit without its fold's
    /// blocks, in the channel's unit.
    #[must_use]
    pub fn predicted_held_out(&self, candidates: &[&Candidate], fit: &Fit) -> Vec<f64> {
        let mut predicted = fit.predicted.clone();
        let count = fit.values.len();
        for fold in 0..FOLDS {
            let step = self.step_without(candidates, fit, fold);
            let at = fit.values.iter().chain(fit.tolerance.as_flattened());
            let moved: Vec<f64> = at.zip(step.iter()).map(|(x, d)| x + d).collect();
            let plain = self.predicted(candidates, &moved[..count]);
            let of_fold = self.read(&plain, self.tolerance_in(&moved));
            for i in self.of_fold(fold) {
                predicted[i] = of_fold[i];
            }
        }
        predicted
    }

    fn of_fold(&self, fold: usize) -> impl Iterator<Item = usize> {
        let block_of = &self.noise.blocks.of_sample;
        (0..block_of.len()).filter(move |&i| block_of[i] % FOLDS == fold)
    }

    /// From the fit of everything to the linearised one without one fold's blocks: a step of
    /// values, gains and offsets.
    fn step_without(&self, candidates: &[&Candidate], fit: &Fit, fold: usize) -> DVector<f64> {
        let bounds = self.bounds(&parameters(candidates));
        let at = [&fit.values[..], fit.tolerance.as_flattened()].concat();
        let mut weights: Vec<f64> = fit.whitened.iter().map(|e| weight(*e)).collect();
        self.of_fold(fold).for_each(|i| weights[i] = 0.0);
        let errors = (&fit.whitened[..], &weights[..]);
        let (normal, gradient) = normal_equations(&fit.jacobian, errors, &at, &self.wide_spreads());
        bounded_step(&normal, &gradient, &at, &bounds, 1e-9)
    }
}

/// Each candidate with its values, which stand one candidate after another.
pub(crate) fn by_member<'f>(
    candidates: &'f [&'f Candidate],
    values: &'f [f64],
) -> impl Iterator<Item = (&'f Candidate, &'f [f64])> {
    let mut rest = values;
    candidates.iter().map(move |candidate| {
        let own;
        (own, rest) = rest.split_at(candidate.parameters.len());
        (*candidate, own)
    })
}

/// Parameters of candidates, one after another.
fn parameters(candidates: &[&Candidate]) -> Vec<Parameter> {
    let all = candidates.iter().flat_map(|c| c.parameters.iter().copied());
    all.collect()
}

/// `JᵀWJ` and `JᵀWe` with the priors of gains and offsets in the last places, of these spreads.
pub(crate) fn normal_equations(
    jacobian: &DMatrix<f64>,
    (whitened, weights): (&[f64], &[f64]),
    at: &[f64],
    spreads: &[f64],
) -> (DMatrix<f64>, DVector<f64>) {
    let mut weighted = jacobian.clone();
    for mut column in weighted.column_iter_mut() {
        let pairs = column.iter_mut().zip(weights);
        pairs.for_each(|(value, weight)| *value *= weight);
    }
    let mut normal = weighted.tr_mul(jacobian);
    let mut gradient = weighted.tr_mul(&DVector::from_column_slice(whitened));
    let from = jacobian.ncols() - spreads.len();
    for (j, spread) in (from..).zip(spreads) {
        let prior = (spread * spread).recip();
        normal[(j, j)] += prior;
        gradient[j] -= prior * at[j];
    }
    (normal, gradient)
}

/// The damped step that lowers the linearised cost most without leaving the bounds: parameters that
/// would leave are put on their bound, the rest solved again.
fn bounded_step(
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    at: &[f64],
    bounds: &[[f64; 2]],
    damping: f64,
) -> DVector<f64> {
    let count = gradient.len();
    let mut step = DVector::zeros(count);
    let mut fixed = vec![false; count];
    for _ in 0..=count {
        let free: Vec<usize> = (0..count).filter(|&j| !fixed[j]).collect();
        if free.is_empty() {
            break;
        }
        let mut matrix = normal.select_rows(&free).select_columns(&free);
        // What those on their bounds take over already.
        let held = DVector::from_fn(count, |j, _| if fixed[j] { step[j] } else { 0.0 });
        let right = (gradient - normal * held).select_rows(&free);
        for a in 0..free.len() {
            // Marquardt's scaling, and a floor for parameters that change nothing.
            matrix[(a, a)] += damping * matrix[(a, a)] + 1e-12;
        }
        let Some(solved) = matrix.cholesky().map(|factor| factor.solve(&right)) else {
            break;
        };
        // One at a time, the furthest out for its range first: what it leaves undone may keep the
        // others inside.
        let (mut most_out, mut furthest) = (0.0, None);
        for (&j, solved) in free.iter().zip(&solved) {
            let to = at[j] + solved;
            let [low, high] = bounds[j];
            step[j] = to.clamp(low, high) - at[j];
            let out = (low - to).max(to - high) / (high - low);
            if out > most_out {
                (most_out, furthest) = (out, Some(j));
            }
        }
        match furthest {
            Some(j) => fixed[j] = true,
            None => break,
        }
    }
    step
}
