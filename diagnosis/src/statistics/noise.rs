//! How far values scatter about any smooth law: a constant part, a part that grows with the flow,
//! and memory.
//!
//! ```text
//! σ²(U) = s₀² + s₁² U²,        corr(εᵢ, εᵢ₊₁) = ρ^(Δt/Δt₀)
//! ```
//!
//! Read from first differences of the residual where the baseline hardly changes: what the
//! simulation gets wrong there is nearly the same on both sides and drops out, so real signals do
//! not pass for noise. For noise of the first order
//!
//! ```text
//! var(d) = 2 σ² (1 - ρ),       corr(dᵢ, dᵢ₊₁) = -(1 - ρ)/2  =>  ρ = 1 + 2 corr(dᵢ, dᵢ₊₁)
//! ```
//!
//! Variances are Huber's scale ("Proposal 2", Huber 1964, Ann. Math. Stat. 35:73), which a third of
//! wild differences cannot carry away and which, unlike a median, does not jump with the resolution
//! of the instrument.

use super::line::Line;
use super::quantile::median;
use super::robust::{HuberScale, loss};
use super::sequence::{Blocks, Sequence, correlation};

/// Scatter of a recording's samples and how they depend on one another: what fits, folds, tests and
/// intervals share.
#[derive(Clone, Debug)]
pub struct Noise {
    /// Takes scale and memory off.
    pub whitener: Whitener,
    /// Neighbours in time, each block too far from the others to share their errors.
    pub blocks: Blocks,
}

impl Noise {
    /// Standard deviation of every sample, in the channel's unit.
    #[must_use]
    pub fn sd(&self) -> &[f64] {
        &self.whitener.sd
    }

    /// Inverse variance of every sample.
    #[must_use]
    pub fn weights(&self) -> Vec<f64> {
        self.sd().iter().map(|sd| (sd * sd).recip()).collect()
    }

    /// Values over their scatter, with what neighbours share taken out: independent and of variance
    /// 1 where nothing is missing.
    #[must_use]
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        self.whitener.whiten(values)
    }
}

/// Noise of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseModel {
    /// Standard deviation in still air, in the channel's unit.
    pub s0: f64,
    /// Standard deviation over flow, where the flow rules (turbulence).
    pub s1: f64,
    /// Correlation of neighbours at the typical step.
    pub rho: f64,
    /// Typical step (s).
    pub step_s: f64,
}

/// Most correlation of neighbours that is believed. A pulsation that is slow against the samples
/// looks like memory; this keeps it from being taken for noise altogether. Chosen here: memory
/// beyond ten samples belongs to the blocks.
const MOST_RHO: f64 = 0.9;
/// Differences a variance needs. Chosen here: below 20, a bin's variance is off by a third.
const LEAST_DIFFERENCES: usize = 20;
/// Bins of flow that σ² is read in. Chosen here.
const MOST_BINS: usize = 12;
/// A step is typical within this factor of the typical one: others would need ρ to be read.
const TYPICAL: std::ops::RangeInclusive<f64> = 0.67..=1.5;
/// A baseline that changes by less than this share of itself is flat. Chosen here: a law that is
/// wrong by half shows as 1 %.
const FLAT_SHARE: f64 = 0.02;
/// Bound on a difference where its memory is read, in standard deviations. Chosen here: twice
/// Huber's.
const BOUND: f64 = 3.0;
/// Least standard deviation that values are divided by, in the channel's unit.
const LEAST_SD: f64 = 1e-12;
/// Rounds of weights, which settle geometrically.
const ROUNDS: usize = 60;

/// One first difference of the residual.
struct Difference {
    /// The sample that it ends at.
    at: usize,
    flow: f64,
    value: f64,
    change: f64,
}

/// Reads the noise from a residual (recorded - simulated, in the channel's unit) and the baseline
/// flow `U`, one value a sample each; `None` below 20 differences of neighbours. `least_s0`: least
/// standard deviation in still air, the resolution over √12, say.
#[must_use]
pub fn estimate(
    sequence: &Sequence,
    residual: &[f64],
    flow: &[f64],
    least_s0: f64,
) -> Option<NoiseModel> {
    let difference = |&at: &usize| {
        let before = sequence.previous[at]?;
        let is_typical = TYPICAL.contains(&(sequence.step_s[at] / sequence.typical_step_s));
        is_typical.then(|| Difference {
            at,
            flow: 0.5 * (flow[at] + flow[before]).abs(),
            value: residual[at] - residual[before],
            change: (flow[at] - flow[before]).abs(),
        })
    };
    let mut differences: Vec<Difference> = sequence.order.iter().filter_map(difference).collect();
    if differences.len() < LEAST_DIFFERENCES {
        return None;
    }
    differences.sort_by(|a, b| a.flow.total_cmp(&b.flow).then(a.at.cmp(&b.at)));
    let bins = (differences.len() / (2 * LEAST_DIFFERENCES)).clamp(1, MOST_BINS);
    let mut flat = Vec::new();
    let mut variances = Vec::new();
    for bin in 0..bins {
        let [from, to] = [bin, bin + 1].map(|end| end * differences.len() / bins);
        let part = &differences[from..to];
        let mut changes: Vec<f64> = part.iter().map(|d| d.change).collect();
        let median = median(&mut changes)?;
        let is_flat = |d: &&Difference| d.change <= median.max(FLAT_SHARE * d.flow);
        let kept: Vec<&Difference> = part.iter().filter(is_flat).collect();
        let count = kept.len() as f64;
        let flow2 = kept.iter().map(|d| d.flow * d.flow).sum::<f64>() / count;
        let squares = kept.iter().map(|d| (d.value * d.value, 1.0));
        variances.push((flow2, HuberScale::OF_DIFFERENCES.variance(squares), count));
        flat.extend(kept);
    }
    let (a, b) = constant_and_slope(&variances);
    let rho = memory(sequence, &flat, a, b).clamp(0.0, MOST_RHO);
    let of_value = 1.0 / (2.0 * (1.0 - rho));
    Some(NoiseModel {
        s0: (a * of_value).sqrt().max(least_s0),
        s1: (b * of_value).sqrt(),
        rho,
        step_s: sequence.typical_step_s,
    })
}

/// `a, b >= 0` of `v = a + b U²`, by least squares weighted with each variance's own error, `√(2/n)
/// v`.
fn constant_and_slope(variances: &[(f64, f64, f64)]) -> (f64, f64) {
    let count: f64 = variances.iter().map(|(_, _, n)| n).sum();
    let overall = variances.iter().map(|(_, v, n)| v * n).sum::<f64>() / count;
    // Nothing varies: a stuck instrument. The caller's least s₀ takes over.
    if overall <= 0.0 {
        return (0.0, 0.0);
    }
    let (mut a, mut b) = (overall, 0.0);
    for _ in 0..ROUNDS {
        let mut line = Line::default();
        for &(x, y, n) in variances {
            let expected = (a + b * x).max(1e-6 * overall);
            line.add(n / (expected * expected), x, y);
        }
        let (slope, constant) = line.fit(1e-9).unwrap_or((0.0, line.mean()));
        (a, b) = if slope < 0.0 {
            (line.mean(), 0.0)
        } else if constant < 0.0 {
            (0.0, line.proportion())
        } else {
            (constant, slope)
        };
    }
    (a, b)
}

/// ρ from successive differences, each bounded and in units of its own standard deviation; 0 where
/// none follow one another.
fn memory(sequence: &Sequence, flat: &[&Difference], a: f64, b: f64) -> f64 {
    let mut scaled = vec![None; sequence.order.len()];
    for d in flat {
        let sd = (a + b * d.flow * d.flow).sqrt();
        if sd > 0.0 {
            scaled[d.at] = Some((d.value / sd).clamp(-BOUND, BOUND));
        }
    }
    let pairs = sequence.order.iter();
    let pairs = pairs.filter_map(|&at| Some((scaled[sequence.previous[at]?]?, scaled[at]?)));
    correlation(pairs).map_or(0.0, |correlation| 1.0 + 2.0 * correlation)
}

impl NoiseModel {
    /// Standard deviation at a baseline flow, in the channel's unit.
    #[must_use]
    pub fn sd(&self, flow: f64) -> f64 {
        self.s0.hypot(self.s1 * flow)
    }
}

/// Takes scale and memory off values: what is left of noise has variance 1 and no correlation.
///
/// ```text
/// eᵢ = (rᵢ/σᵢ - kᵢ rᵢ₋₁/σᵢ₋₁)/√(1 - kᵢ²),    kᵢ = ρ^(Δt/Δt₀);    e = r/σ at the start of a series and after a gap
/// ```
///
/// Linear: columns of a model are whitened as residuals are.
#[derive(Clone, Debug)]
pub struct Whitener {
    sd: Vec<f64>,
    /// Of every sample: the one before, and kᵢ.
    before: Vec<Option<(usize, f64)>>,
    /// In the order in which it is taken out.
    shared: Vec<Shared>,
}

/// A pattern of unknown size that runs through a stretch of samples: an offset of one flight, a map
/// that is a little too steep.
///
/// Its size is normal with mean 0, so it adds `a aᵀ` to the covariance (`a`: the pattern times its
/// standard deviation, whitened by what came before), and whitening takes out of every vector most
/// of what lies along `a`.
#[derive(Clone, Debug)]
struct Shared {
    from: usize,
    pattern: Vec<f64>,
}

impl Shared {
    /// Takes it out of whitened values.
    ///
    /// ```text
    /// (1 + a aᵀ)^(-1/2) = 1 - k a aᵀ,   k = (1 - 1/√(1 + a²))/a²
    /// ```
    fn take_out(&self, whitened: &mut [f64]) {
        let stretch = &mut whitened[self.from..self.from + self.pattern.len()];
        let square: f64 = self.pattern.iter().map(|a| a * a).sum();
        if square <= 0.0 {
            return;
        }
        let along: f64 = self.pattern.iter().zip(&*stretch).map(|(a, x)| a * x).sum();
        let share = (1.0 - (1.0 + square).sqrt().recip()) / square * along;
        for (x, a) in stretch.iter_mut().zip(&self.pattern) {
            *x -= share * a;
        }
    }
}

impl Whitener {
    /// For samples at baseline flows, in a sequence.
    #[must_use]
    pub fn new(noise: &NoiseModel, sequence: &Sequence, flow: &[f64]) -> Self {
        let pairs = sequence.previous.iter().zip(&sequence.step_s);
        let before = pairs.map(|(previous, step_s)| {
            let kept = noise.rho.powf(step_s / noise.step_s);
            previous.map(|previous| (previous, kept))
        });
        Self {
            // No noise at all would make every residual infinitely surprising; far below any
            // instrument, and squares stay finite.
            sd: flow.iter().map(|&u| noise.sd(u).max(LEAST_SD)).collect(),
            before: before.collect(),
            shared: Vec::new(),
        }
    }

    /// Samples `from` to `to` share a pattern of unknown size with this standard deviation, in the
    /// channel's unit, beside what they share already.
    pub fn share(&mut self, from: usize, pattern: &[f64]) {
        let mut values = vec![0.0; self.sd.len()];
        values[from..from + pattern.len()].copy_from_slice(pattern);
        let whitened = self.whiten(&values);
        let pattern = whitened[from..from + pattern.len()].to_vec();
        self.shared.push(Shared { from, pattern });
    }

    /// Values, whitened, in the order of samples.
    #[must_use]
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        let mut white = vec![0.0; values.len()];
        for (at, white) in white.iter_mut().enumerate() {
            let own = values[at] / self.sd[at];
            *white = match self.before[at] {
                Some((before, kept)) => {
                    (own - kept * values[before] / self.sd[before]) / (1.0 - kept * kept).sqrt()
                }
                None => own,
            };
        }
        for shared in &self.shared {
            shared.take_out(&mut white);
        }
        white
    }

    /// Log density of values, up to a constant; gross ones count as pseudo-Huber has it.
    #[must_use]
    pub fn log_density(&self, values: &[f64]) -> f64 {
        let white = self.whiten(values);
        let scales = self.sd.iter().zip(&self.before).map(|(sd, before)| {
            let kept = before.map_or(0.0, |(_, kept)| kept);
            (sd * (1.0 - kept * kept).sqrt()).ln()
        });
        let pairs = white.iter().zip(scales);
        pairs.map(|(e, scale)| -0.5 * loss(*e) - scale).sum()
    }
}

#[cfg(test)]
mod tests;
