//! A hypothesis fitted to samples: bounded Levenberg-Marquardt on whitened residuals, gross errors weighed down, the instrument's own
//! tolerance fitted along.
//!
//! ```text
//! minimise Σ ρ(e_i) + (n_g/s)² + (n_b/s)²,   e = L[(y - (1 + n_g) f(θ) - n_b)/sd],   ρ(e) = 2 c² (√(1 + e²/c²) - 1)
//! ```
//!
//! Gain `n_g` and offset `n_b` are in every fit, the empty one included, with hard bounds: what the maker allows and no more. Soft
//! priors alone let an offset swallow half a wind.

mod bounded;
mod left_out;

use nalgebra::DMatrix;

use bounded::bounded_step;
pub use left_out::{held_out, held_out_residuals, refit_without};

use crate::forward::hypothesis::Hypothesis;
use crate::forward::observed::{Explained, Observed};
use crate::forward::simulate::Channel;
use crate::infer::candidates::{Candidate, Parameter};
use crate::infer::noise::Noise;

/// Where gross errors begin to count less, in standard deviations (`c`).
const GROSS: f64 = 3.0;
/// Spread (`s`) that gain and offset have without evidence.
pub(crate) const TOLERANCE_SD: f64 = 0.02;
/// Most turns of a fit, and the relative gain in cost at which it stops.
const TURNS: usize = 25;
/// From more starts than this, only the best few by cost are followed.
const MOST_STARTS: usize = 6;
const BEST_STARTS: usize = 3;
const ENOUGH: f64 = 1e-4;

/// What every fit of one recording shares.
#[derive(Clone, Debug)]
pub struct Setting<'a> {
    /// The samples.
    pub observed: &'a dyn Explained,
    /// Their scatter.
    pub noise: &'a Noise,
    /// What is supposed before any candidate.
    pub base: Hypothesis,
    recorded: Vec<f64>,
    tolerances: [f64; 2],
}

/// One fitted hypothesis.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Values of the candidates' parameters, one candidate after another.
    pub values: Vec<f64>,
    /// Fitted gain and offset within the instrument's tolerance.
    pub tolerance: [f64; 2],
    /// Predicted readings.
    pub predicted: Vec<f64>,
    /// Whitened residuals.
    pub whitened: Vec<f64>,
    /// Change of the whitened prediction with each parameter, gain and offset last.
    pub jacobian: DMatrix<f64>,
    /// Cost with the tolerance's priors.
    pub cost: f64,
}

impl<'a> Setting<'a> {
    /// Fits of these samples, on top of `base`.
    #[must_use]
    pub fn new(observed: &'a Observed<'a>, noise: &'a Noise, base: Hypothesis) -> Setting<'a> {
        let instrument = observed
            .recording
            .probes
            .as_ref()
            .map(|probes| &probes.instrument);
        let tolerances = match (observed.channel, instrument) {
            (Channel::Speed, Some(probe)) => [
                probe.accuracy_rel,
                probe.accuracy_abs_mps + probe.resolution_mps,
            ],
            // A throttle ratio refers to the drone's own hover: a percent, as far as hovers agree.
            _ => [0.01, 1e-6],
        };
        Setting::within(observed, noise, base, tolerances)
    }

    /// The same of anything that can be explained; `tolerances` bound gain (1) and offset (the channel's unit).
    #[must_use]
    pub fn within(
        observed: &'a dyn Explained,
        noise: &'a Noise,
        base: Hypothesis,
        tolerances: [f64; 2],
    ) -> Setting<'a> {
        Setting {
            observed,
            noise,
            base,
            recorded: observed.recorded(),
            tolerances,
        }
    }

    /// Whether a fitted gain (0) or offset (1) has reached what the maker allows: it can take no more.
    #[must_use]
    pub fn at_tolerance(&self, which: usize, value: f64) -> bool {
        value.abs() > 0.999 * self.tolerances[which]
    }

    /// Everything together at given values.
    #[must_use]
    pub fn hypothesis(&self, candidates: &[&Candidate], values: &[f64]) -> Hypothesis {
        let mut hypothesis = self.base;
        let mut rest = values;
        for candidate in candidates {
            let (own, others) = rest.split_at(candidate.parameters.len());
            candidate.set(own, &mut hypothesis);
            rest = others;
        }
        hypothesis
    }

    /// Fits candidates together, from each of some starts; the best.
    #[must_use]
    pub fn fit(&self, candidates: &[&Candidate], starts: &[Vec<f64>]) -> Option<Fit> {
        if starts.len() <= MOST_STARTS {
            let fits = starts.iter().map(|start| self.fit_from(candidates, start));
            return fits.min_by(|a, b| a.cost.total_cmp(&b.cost));
        }
        let cost = |start: &Vec<f64>| {
            let predicted = self.observed.predict(&self.hypothesis(candidates, start));
            self.cost(&self.whitened(&predicted, &[0.0, 0.0]), &[0.0, 0.0])
        };
        let mut by_cost: Vec<(f64, &Vec<f64>)> = starts.iter().map(|s| (cost(s), s)).collect();
        by_cost.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best: Vec<Vec<f64>> = by_cost
            .into_iter()
            .take(BEST_STARTS)
            .map(|(_, start)| start.clone())
            .collect();
        self.fit(candidates, &best)
    }

    /// Nothing but the instrument's tolerance.
    #[must_use]
    pub fn nothing(&self) -> Fit {
        self.fit_from(&[], &[])
    }

    fn fit_from(&self, candidates: &[&Candidate], start: &[f64]) -> Fit {
        let parameters: Vec<Parameter> = candidates
            .iter()
            .flat_map(|candidate| candidate.parameters.iter().copied())
            .collect();
        let bounds = self.bounds(&parameters);
        let mut at: Vec<f64> = start.to_vec();
        at.extend([0.0, 0.0]);
        let clean = |at: &[f64]| {
            let values = &at[..parameters.len()];
            self.observed.predict(&self.hypothesis(candidates, values))
        };
        let mut plain = clean(&at);
        let mut whitened = self.whitened(&plain, &at);
        let mut cost = self.cost(&whitened, &at);
        let mut jacobian = self.jacobian(&parameters, &bounds, &at, &plain, &clean);
        let mut damping = 1e-3;
        for _ in 0..TURNS {
            let weights: Vec<f64> = whitened.iter().map(|e| weight(*e)).collect();
            let mut taken = false;
            for _ in 0..6 {
                let step = bounded_step(&jacobian, &whitened, &weights, &at, &bounds, damping);
                let next: Vec<f64> = at
                    .iter()
                    .zip(step.iter())
                    .zip(&bounds)
                    .map(|((x, d), [low, high])| (x + d).clamp(*low, *high))
                    .collect();
                // Gain and offset act after the air: the air need not be asked again for them alone.
                let moved = next[..parameters.len()] != at[..parameters.len()];
                let next_plain = if moved { clean(&next) } else { plain.clone() };
                let next_whitened = self.whitened(&next_plain, &next);
                let next_cost = self.cost(&next_whitened, &next);
                if next_cost < cost {
                    taken = cost - next_cost > ENOUGH * cost.max(1.0);
                    (at, plain, whitened, cost) = (next, next_plain, next_whitened, next_cost);
                    damping = (damping * 0.2).max(1e-9);
                    break;
                }
                damping = (damping * 8.0).min(1e9);
            }
            if !taken {
                break;
            }
            jacobian = self.jacobian(&parameters, &bounds, &at, &plain, &clean);
        }
        let tolerance = [at[parameters.len()], at[parameters.len() + 1]];
        at.truncate(parameters.len());
        Fit {
            predicted: plain
                .iter()
                .map(|f| (1.0 + tolerance[0]) * f + tolerance[1])
                .collect(),
            values: at,
            tolerance,
            whitened,
            jacobian,
            cost,
        }
    }

    fn bounds(&self, parameters: &[Parameter]) -> Vec<[f64; 2]> {
        let own = parameters
            .iter()
            .map(|parameter| [parameter.low, parameter.high]);
        own.chain(self.tolerances.map(|most| [-most, most]))
            .collect()
    }

    fn whitened(&self, plain: &[f64], at: &[f64]) -> Vec<f64> {
        let [gain, offset] = [at[at.len() - 2], at[at.len() - 1]];
        let rest: Vec<f64> = self
            .recorded
            .iter()
            .zip(plain)
            .map(|(y, f)| y - (1.0 + gain) * f - offset)
            .collect();
        self.noise.whiten(&rest)
    }

    fn cost(&self, whitened: &[f64], at: &[f64]) -> f64 {
        let prior = |x: f64| (x / TOLERANCE_SD) * (x / TOLERANCE_SD);
        whitened.iter().map(|e| loss(*e)).sum::<f64>()
            + prior(at[at.len() - 2])
            + prior(at[at.len() - 1])
    }

    /// By differences for the candidates' parameters, exact for gain and offset.
    fn jacobian(
        &self,
        parameters: &[Parameter],
        bounds: &[[f64; 2]],
        at: &[f64],
        plain: &[f64],
        clean: &impl Fn(&[f64]) -> Vec<f64>,
    ) -> DMatrix<f64> {
        let count = plain.len();
        let gain = 1.0 + at[parameters.len()];
        let mut jacobian = DMatrix::zeros(count, parameters.len() + 2);
        for (j, parameter) in parameters.iter().enumerate() {
            let step = 0.02 * parameter.practical;
            let step = if at[j] + step > bounds[j][1] {
                -step
            } else {
                step
            };
            let mut moved = at.to_vec();
            moved[j] += step;
            let changed: Vec<f64> = clean(&moved)
                .iter()
                .zip(plain)
                .map(|(to, from)| gain * (to - from) / step)
                .collect();
            jacobian
                .column_mut(j)
                .copy_from_slice(&self.noise.whiten(&changed));
        }
        let ones = vec![1.0; count];
        for (j, column) in [plain, &ones].into_iter().enumerate() {
            let whitened = self.noise.whiten(column);
            jacobian
                .column_mut(parameters.len() + j)
                .copy_from_slice(&whitened);
        }
        jacobian
    }
}

/// `ρ(e)`: `e²` for small errors, `2 c |e|` for gross ones.
#[must_use]
pub fn loss(e: f64) -> f64 {
    2.0 * GROSS * GROSS * ((1.0 + (e / GROSS) * (e / GROSS)).sqrt() - 1.0)
}

/// `ρ'(e)/(2 e)`.
#[must_use]
pub fn weight(e: f64) -> f64 {
    (1.0 + (e / GROSS) * (e / GROSS)).sqrt().recip()
}
