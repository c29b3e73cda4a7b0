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
//! prediction is what takes long. Slopes are measured where a descent begins and where the best one
//! ends, and brought up to date by what every step tells in between.

use nalgebra::{DMatrix, DVector};

use crate::forward::hypothesis::Hypothesis;
use crate::forward::observed::{Explained, Observed};
use crate::forward::simulate::Channel;
use crate::infer::candidates::{Candidate, Parameter};
use crate::statistics::held_out::{FOLDS, log_densities};
use crate::statistics::noise::Noise;
use crate::statistics::quantile::difference;
use crate::statistics::robust::{loss, weight};

/// Spread (`s`) that gain (1) and offset (the channel's unit) have without evidence. Chosen here:
/// two fifths of a stated 5 %.
const TOLERANCE_SD: f64 = 0.02;
/// Most iterations of a fit, and the relative gain in cost at which it stops.
const ITERATIONS: usize = 25;
const ENOUGH: f64 = 1e-4;
/// Dampings that are tried in one iteration before it counts as converged.
const DAMPINGS: usize = 6;
/// From more starts than this, only the best few by cost are followed. Chosen here, for time.
const MOST_STARTS: usize = 6;
const BEST_STARTS: usize = 3;
/// Step of a difference quotient, in parts of what matters of a parameter.
const DIFFERENCE: f64 = 0.02;

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
    tolerances: [f64; 2],
}

/// One fitted hypothesis.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Values of the candidates' parameters, one candidate after another.
    pub values: Vec<f64>,
    /// Fitted gain (1) and offset (the channel's unit) within the instrument's tolerance.
    pub tolerance: [f64; 2],
    /// Predicted readings, gain and offset included, in the channel's unit.
    pub predicted: Vec<f64>,
    /// Whitened residuals.
    pub whitened: Vec<f64>,
    /// Change of the whitened prediction with each parameter: samples by parameters, gain and
    /// offset last.
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
        Setting {
            observed,
            noise,
            candidates,
            base: Hypothesis::default(),
            recorded: observed.recorded(),
            times_s: observed.times_s(),
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
    /// and offset; each counts from its own moment on.
    #[must_use]
    pub fn predicted(&self, members: &[&Candidate], values: &[f64]) -> Vec<f64> {
        let moment = |member: &Candidate| member.since.map_or(f64::NEG_INFINITY, |of| of.at_s);
        let mut moments_s: Vec<f64> = members.iter().map(|member| moment(member)).collect();
        moments_s.push(f64::NEG_INFINITY);
        moments_s.sort_by(f64::total_cmp);
        moments_s.dedup();
        let mut predicted = Vec::new();
        for from_s in moments_s {
            let mut hypothesis = self.base;
            let begun = by_member(members, values).filter(|(of, _)| moment(of) <= from_s);
            begun.for_each(|(of, own)| of.set(own, &mut hypothesis));
            let now = self.observed.predict(&hypothesis);
            if predicted.is_empty() {
                predicted = now;
                continue;
            }
            for (i, now) in now.into_iter().enumerate() {
                if self.times_s[i] >= from_s {
                    predicted[i] = now;
                }
            }
        }
        predicted
    }

    /// Cost of predictions read with a gain and an offset: twice a negative log likelihood.
    pub(crate) fn cost_of(&self, plain: &[f64], tolerance: [f64; 2]) -> f64 {
        self.cost(&self.whitened(plain, &tolerance), &tolerance)
    }

    /// The columns of a fit's derivatives that can take more: all but gain and offset where they
    /// have reached what the maker allows.
    #[must_use]
    pub fn free_columns(&self, fit: &Fit) -> DMatrix<f64> {
        let count = fit.values.len();
        let is_free =
            |which: &usize| fit.tolerance[*which].abs() <= 0.999 * self.tolerances[*which];
        let free = (0..count).chain((0..2).filter(is_free).map(|which| count + which));
        fit.jacobian.select_columns(&free.collect::<Vec<usize>>())
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
                self.cost(&self.whitened(&predicted, &[0.0, 0.0]), &[0.0, 0.0])
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

    fn bounds(&self, parameters: &[Parameter]) -> Vec<[f64; 2]> {
        let own = parameters.iter().map(|p| [p.low, p.high]);
        own.chain(self.tolerances.map(|most| [-most, most]))
            .collect()
    }

    fn whitened(&self, plain: &[f64], at: &[f64]) -> Vec<f64> {
        let [gain, offset] = [at[at.len() - 2], at[at.len() - 1]];
        let pairs = self.recorded.iter().zip(plain);
        let rest: Vec<f64> = pairs.map(|(y, f)| y - (1.0 + gain) * f - offset).collect();
        self.noise.whiten(&rest)
    }

    fn cost(&self, whitened: &[f64], at: &[f64]) -> f64 {
        let prior = |x: f64| (x / TOLERANCE_SD) * (x / TOLERANCE_SD);
        whitened.iter().map(|e| loss(*e)).sum::<f64>()
            + prior(at[at.len() - 2])
            + prior(at[at.len() - 1])
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
            let at = fit.values.iter().chain(&fit.tolerance);
            let moved: Vec<f64> = at.zip(step.iter()).map(|(x, d)| x + d).collect();
            let plain = self.predicted(candidates, &moved[..count]);
            let of_fold = read(&plain, [moved[count], moved[count + 1]]);
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
    /// values, gain and offset.
    fn step_without(&self, candidates: &[&Candidate], fit: &Fit, fold: usize) -> DVector<f64> {
        let bounds = self.bounds(&parameters(candidates));
        let at = [&fit.values[..], &fit.tolerance].concat();
        let mut weights: Vec<f64> = fit.whitened.iter().map(|e| weight(*e)).collect();
        self.of_fold(fold).for_each(|i| weights[i] = 0.0);
        let (normal, gradient) = normal_equations(&fit.jacobian, &fit.whitened, &weights, &at);
        bounded_step(&normal, &gradient, &at, &bounds, 1e-9)
    }
}

/// A fit on its way down from a start.
struct Descent<'a> {
    setting: &'a Setting<'a>,
    candidates: &'a [&'a Candidate],
    parameters: Vec<Parameter>,
    bounds: Vec<[f64; 2]>,
    /// Values, gain and offset.
    at: Vec<f64>,
    /// Predicted before gain and offset.
    plain: Vec<f64>,
    whitened: Vec<f64>,
    cost: f64,
    slopes: Slopes,
    damping: f64,
    /// Iterations that are left.
    left: usize,
}

impl<'a> Descent<'a> {
    fn from(
        setting: &'a Setting<'a>,
        candidates: &'a [&'a Candidate],
        start: &[f64],
    ) -> Descent<'a> {
        let parameters = parameters(candidates);
        let plain = setting.predicted(candidates, start);
        let mut at = start.to_vec();
        at.extend([0.0, 0.0]);
        let whitened = setting.whitened(&plain, &at);
        let mut descent = Descent {
            setting,
            candidates,
            bounds: setting.bounds(&parameters),
            parameters,
            cost: setting.cost(&whitened, &at),
            at,
            plain,
            whitened,
            slopes: Slopes::default(),
            damping: 1e-3,
            left: ITERATIONS,
        };
        descent.measure();
        descent
    }

    /// Slopes by differences.
    fn measure(&mut self) {
        let predict = |at: &[f64]| self.predicted(at);
        self.slopes = Slopes::measured(&self.parameters, &self.at, &self.plain, &predict);
    }

    fn predicted(&self, at: &[f64]) -> Vec<f64> {
        let count = self.parameters.len();
        self.setting.predicted(self.candidates, &at[..count])
    }

    /// As far as slopes lead that are measured once.
    fn go_down(&mut self) {
        while self.left > 0 && self.step() {}
    }

    /// Where slopes that are measured there lead no further.
    fn settled(mut self) -> Fit {
        self.go_down();
        while self.left > 0 && !self.slopes.is_measured {
            self.measure();
            self.go_down();
        }
        if !self.slopes.is_measured {
            self.measure();
        }
        let jacobian = self.jacobian();
        let count = self.parameters.len();
        let tolerance = [self.at[count], self.at[count + 1]];
        self.at.truncate(count);
        Fit {
            predicted: read(&self.plain, tolerance),
            values: self.at,
            tolerance,
            whitened: self.whitened,
            jacobian,
            cost: self.cost,
        }
    }

    /// Whether a step led on.
    fn step(&mut self) -> bool {
        self.left -= 1;
        let weights: Vec<f64> = self.whitened.iter().map(|e| weight(*e)).collect();
        let (normal, gradient) =
            normal_equations(&self.jacobian(), &self.whitened, &weights, &self.at);
        let enough = ENOUGH * self.cost.max(1.0);
        // Slopes that were brought up to date may be why a step fails.
        let dampings = if self.slopes.is_measured { DAMPINGS } else { 1 };
        for _ in 0..dampings {
            let step = bounded_step(&normal, &gradient, &self.at, &self.bounds, self.damping);
            let ends = self.bounds.iter().zip(self.at.iter().zip(&step));
            let next: Vec<f64> = ends
                .map(|([low, high], (at, step))| (at + step).clamp(*low, *high))
                .collect();
            // Gain and offset act after the air: the air need not be asked again for them alone.
            let count = self.parameters.len();
            let moved = next[..count] != self.at[..count];
            let plain = if moved {
                self.predicted(&next)
            } else {
                self.plain.clone()
            };
            let whitened = self.setting.whitened(&plain, &next);
            let cost = self.setting.cost(&whitened, &next);
            if cost < self.cost {
                let leads_on = self.cost - cost > enough;
                if moved && leads_on {
                    let change = difference(&plain, &self.plain);
                    self.slopes
                        .update(&self.parameters, [&self.at, &next], change);
                }
                (self.at, self.plain) = (next, plain);
                (self.whitened, self.cost) = (whitened, cost);
                self.damping = (self.damping * 0.2).max(1e-9);
                return leads_on;
            }
            let promised = 2.0 * gradient.dot(&step) - step.dot(&(&normal * &step));
            if promised <= enough {
                return false;
            }
            self.damping = (self.damping * 8.0).min(1e9);
        }
        false
    }

    /// Change of the whitened prediction with each parameter, gain and offset last.
    fn jacobian(&self) -> DMatrix<f64> {
        let gain = 1.0 + self.at[self.parameters.len()];
        let of_parameters = self.slopes.columns.iter();
        let mut columns: Vec<Vec<f64>> = of_parameters
            .map(|column| column.iter().map(|slope| gain * slope).collect())
            .collect();
        columns.push(self.plain.clone());
        columns.push(vec![1.0; self.plain.len()]);
        let noise = self.setting.noise;
        let whitened: Vec<f64> = columns.iter().flat_map(|c| noise.whiten(c)).collect();
        DMatrix::from_vec(self.plain.len(), columns.len(), whitened)
    }
}

/// Change of the prediction, before gain and offset, with each of the candidates' parameters.
#[derive(Default)]
struct Slopes {
    columns: Vec<Vec<f64>>,
    /// By differences, and not brought up to date since.
    is_measured: bool,
}

impl Slopes {
    /// By differences at a point, where the prediction is `plain`.
    fn measured(
        parameters: &[Parameter],
        at: &[f64],
        plain: &[f64],
        clean: &impl Fn(&[f64]) -> Vec<f64>,
    ) -> Slopes {
        let column = |(j, parameter): (usize, &Parameter)| {
            let mut step = DIFFERENCE * parameter.practical;
            if at[j] + step > parameter.high {
                step = -step;
            }
            let mut moved = at.to_vec();
            moved[j] += step;
            let changed = clean(&moved);
            let pairs = changed.iter().zip(plain);
            pairs.map(|(to, from)| (to - from) / step).collect()
        };
        Slopes {
            columns: parameters.iter().enumerate().map(column).collect(),
            is_measured: true,
        }
    }

    /// The least change of them, in parts of what matters of each parameter, with which they tell
    /// the step that was taken (C. G. Broyden, "A class of methods for solving nonlinear
    /// simultaneous equations", Mathematics of Computation 19, 1965): a prediction less for each
    /// parameter.
    fn update(&mut self, parameters: &[Parameter], [from, to]: [&[f64]; 2], mut missed: Vec<f64>) {
        let step: Vec<f64> = (0..parameters.len()).map(|j| to[j] - from[j]).collect();
        let scaled = |j: usize| step[j] / parameters[j].practical;
        let square: f64 = (0..step.len()).map(|j| scaled(j) * scaled(j)).sum();
        for (column, step) in self.columns.iter().zip(&step) {
            let told = missed.iter_mut().zip(column);
            told.for_each(|(missed, slope)| *missed -= slope * step);
        }
        for (j, column) in self.columns.iter_mut().enumerate() {
            let share = scaled(j) / parameters[j].practical / square;
            let pairs = column.iter_mut().zip(&missed);
            pairs.for_each(|(slope, missed)| *slope += share * missed);
        }
        self.is_measured = false;
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

/// What an instrument with this gain and offset reads.
fn read(plain: &[f64], [gain, offset]: [f64; 2]) -> Vec<f64> {
    plain.iter().map(|f| (1.0 + gain) * f + offset).collect()
}

/// `JᵀWJ` and `JᵀWe` with the priors of gain and offset in the last two places.
pub(crate) fn normal_equations(
    jacobian: &DMatrix<f64>,
    whitened: &[f64],
    weights: &[f64],
    at: &[f64],
) -> (DMatrix<f64>, DVector<f64>) {
    let mut weighted = jacobian.clone();
    for mut column in weighted.column_iter_mut() {
        let pairs = column.iter_mut().zip(weights);
        pairs.for_each(|(value, weight)| *value *= weight);
    }
    let mut normal = weighted.tr_mul(jacobian);
    let mut gradient = weighted.tr_mul(&DVector::from_column_slice(whitened));
    let prior = (TOLERANCE_SD * TOLERANCE_SD).recip();
    let count = jacobian.ncols();
    for j in count.saturating_sub(2)..count {
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
