//! How far values scatter about any smooth law: white noise of the instrument, and gusts, which
//! grow with the flow and have memory.
//!
//! ```text
//! ε = w + g,   var w = σ_w²,   var g = s₀² + s₁² U²,   corr(g(t), g(t + Δ)) = exp(-Δ/T)
//! ```
//!
//! Read from the structure function of the residual, half the mean square of its differences over
//! so many steps,
//!
//! ```text
//! D(Δ, U) = σ_w² + (s₀² + s₁² U²)(1 - exp(-Δ/T))
//! ```
//!
//! where the baseline hardly changes: what the simulation gets wrong there is nearly the same on
//! both sides and drops out, so real signals do not pass for noise. Of the memories that fit as
//! well, the shortest: it supposes least of what no difference shows.
//!
//! Mean squares are Huber's scale ("Proposal 2", Huber 1964, Ann. Math. Stat. 35:73), which a third
//! of wild differences cannot carry away and which, unlike a median, does not jump with the
//! resolution of the instrument. The whitener is a Kalman filter (Kalman 1960, J. Basic Eng. 82:35)
//! with the gust as its state.

use nalgebra::{Matrix3, Vector3};

use super::quantile::median;
use super::robust::{HuberScale, loss};
use super::sequence::{Blocks, Sequence};

/// Scatter of a recording's samples and how they depend on one another: what fits, folds, tests and
/// intervals share.
#[derive(Clone, Debug)]
pub struct Noise {
    /// Takes scale and memory off.
    pub whitener: Whitener,
    /// Neighbours in time, each block too far from the others to share their errors: of one series
    /// each, or of all where these err together.
    pub blocks: Blocks,
}

impl Noise {
    /// Standard deviation of every sample, in the channel's unit.
    #[must_use]
    pub fn sd(&self) -> &[f64] {
        self.whitener.sd()
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

    /// Each of some columns so, in less time than one after another.
    #[must_use]
    pub fn whiten_all(&self, columns: &[&[f64]]) -> Vec<Vec<f64>> {
        self.whitener.whiten_all(columns)
    }
}

/// Noise of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseModel {
    /// Standard deviation of white noise, in the channel's unit.
    pub white: f64,
    /// Standard deviation of gusts in still air, in the channel's unit.
    pub s0: f64,
    /// Standard deviation of gusts over flow, where the flow rules (turbulence).
    pub s1: f64,
    /// Memory of gusts (s).
    pub memory_s: f64,
}

/// Longest difference that is read (s), and longest memory (s). Chosen here: the slowest turbulence
/// in a jet of these sizes has `r_half/U_C` below 2 s, and a block outlasts five of these.
const LONGEST_LAG_S: f64 = 1.5;
const LONGEST_MEMORY_S: f64 = 3.0;
/// Steps that differences are read over. The first two at any rate: they tell memory from none.
const LAGS: [usize; 10] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32];
/// Memories that are tried, from a fifth of a step on, each so many times the one before.
const SHORTEST_MEMORY: f64 = 0.2;
const MEMORY_RATIO: f64 = 1.2;
/// Deviance by which a shorter memory may fit worse than the best: one standard error (Breiman,
/// Friedman, Olshen & Stone 1984, section 3.4.3).
const AS_WELL: f64 = 1.0;
/// Differences a variance needs. Chosen here: below 20, a bin's variance is off by a third.
const LEAST_DIFFERENCES: usize = 20;
/// Bins of flow that σ² is read in. Chosen here.
const MOST_BINS: usize = 12;
/// A step is typical within this factor of the typical one.
const TYPICAL: std::ops::RangeInclusive<f64> = 0.67..=1.5;
/// A baseline that changes by less than this share of itself is flat. Chosen here: a law that is
/// wrong by half shows as 1 %.
const FLAT_SHARE: f64 = 0.02;
/// Least standard deviation that values are divided by, in the channel's unit.
const LEAST_SD: f64 = 1e-12;
/// Columns that are whitened beside one another. Chosen here: more are no faster.
const BESIDE: usize = 4;
/// Rounds of weights, which settle geometrically, from those of the memory before.
const ROUNDS: usize = 8;

/// The structure function over one lag in one bin of flow.
struct Cell {
    lag_s: f64,
    /// Mean square of the flow.
    flow2: f64,
    value: f64,
    /// Differences that are independent of one another.
    count: f64,
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
    let cells = cells(sequence, residual, flow)?;
    let count: f64 = cells.iter().map(|cell| cell.count).sum();
    let overall = cells
        .iter()
        .map(|cell| cell.value * cell.count)
        .sum::<f64>()
        / count;
    let mut noise = NoiseModel {
        white: least_s0,
        s0: 0.0,
        s1: 0.0,
        memory_s: 0.0,
    };
    // Nothing varies: a stuck instrument.
    if overall <= 0.0 {
        return Some(noise);
    }
    let mut memories_s = vec![0.0];
    let mut memory_s = SHORTEST_MEMORY * sequence.typical_step_s;
    while memory_s < LONGEST_MEMORY_S {
        memories_s.push(memory_s);
        memory_s *= MEMORY_RATIO;
    }
    let mut values = Vector3::new(overall, 0.0, 0.0);
    let of_memory = |&memory_s: &f64| {
        let deviance = fit(&cells, 1e-6 * overall, memory_s, &mut values);
        (memory_s, values, deviance)
    };
    let fits: Vec<(f64, Vector3<f64>, f64)> = memories_s.iter().map(of_memory).collect();
    let least = fits.iter().map(|fit| fit.2).fold(f64::INFINITY, f64::min);
    let (memory_s, values, _) = *fits.iter().find(|fit| fit.2 <= least + AS_WELL)?;
    let [white2, s02, s12] = values.into();
    noise.memory_s = memory_s;
    (noise.s0, noise.s1) = (s02.sqrt(), s12.sqrt());
    noise.white = white2.max(least_s0 * least_s0 - s02).sqrt();
    Some(noise)
}

/// The structure function, by lag and flow.
fn cells(sequence: &Sequence, residual: &[f64], flow: &[f64]) -> Option<Vec<Cell>> {
    let is_typical = |at: usize| TYPICAL.contains(&(sequence.step_s[at] / sequence.typical_step_s));
    let step = |at: usize| sequence.previous[at].filter(|_| is_typical(at));
    let mut cells = Vec::new();
    // Of every sample, the one so many steps before it.
    let mut before: Vec<Option<usize>> = (0..residual.len()).map(Some).collect();
    let mut steps = 0;
    for lag in LAGS {
        if lag > 2 && lag as f64 * sequence.typical_step_s > LONGEST_LAG_S {
            break;
        }
        while steps < lag {
            before.iter_mut().for_each(|at| *at = at.and_then(step));
            steps += 1;
        }
        // By flow: the change of the baseline, the mean square of the flow, the square of the
        // difference.
        let pairs = sequence.order.iter();
        let pairs = pairs.filter_map(|&at| Some((at, before[at]?)));
        let difference = |(at, before): (usize, usize)| {
            let flow2 = 0.5 * (flow[at] * flow[at] + flow[before] * flow[before]);
            let value = residual[at] - residual[before];
            (flow2, (flow[at] - flow[before]).abs(), 0.5 * value * value)
        };
        let mut differences: Vec<(f64, f64, f64)> = pairs.map(difference).collect();
        if differences.len() < LEAST_DIFFERENCES {
            break;
        }
        differences.sort_by(|a, b| a.0.total_cmp(&b.0));
        let bins = (differences.len() / (2 * LEAST_DIFFERENCES)).clamp(1, MOST_BINS);
        for bin in 0..bins {
            let [from, to] = [bin, bin + 1].map(|end| end * differences.len() / bins);
            let part = &differences[from..to];
            let mut changes: Vec<f64> = part.iter().map(|(_, change, _)| *change).collect();
            let median = median(&mut changes)?;
            let is_flat = |d: &&(f64, f64, f64)| d.1 <= median.max(FLAT_SHARE * d.0.sqrt());
            let flat: Vec<&(f64, f64, f64)> = part.iter().filter(is_flat).collect();
            let count = flat.len() as f64;
            cells.push(Cell {
                lag_s: lag as f64 * sequence.typical_step_s,
                flow2: flat.iter().map(|d| d.0).sum::<f64>() / count,
                value: HuberScale::OF_DIFFERENCES.variance(flat.iter().map(|d| (d.2, 1.0))),
                count: count / lag as f64,
            });
        }
    }
    (!cells.is_empty()).then_some(cells)
}

/// `σ_w², s₀², s₁² >= 0` of the structure function for one memory, from values near them, by least
/// squares weighted with each cell's own error, `√(2/n) D`; and the deviance, `Σ n (D̂/D - 1 - ln
/// D̂/D)`. No `D` counts as less than `least`.
fn fit(cells: &[Cell], least: f64, memory_s: f64, values: &mut Vector3<f64>) -> f64 {
    let parts = |cell: &Cell| {
        let gone = 1.0 - kept(memory_s, cell.lag_s);
        Vector3::new(1.0, gone, gone * cell.flow2)
    };
    let parts: Vec<Vector3<f64>> = cells.iter().map(parts).collect();
    let cells = || cells.iter().zip(&parts);
    for _ in 0..ROUNDS {
        let (mut gram, mut along) = (Matrix3::zeros(), Vector3::zeros());
        for (cell, parts) in cells() {
            let weight = cell.count / parts.dot(values).max(least).powi(2);
            gram += parts * parts.transpose() * weight;
            along += parts * (weight * cell.value);
        }
        *values = non_negative(&gram, &along);
    }
    let deviance = |(cell, parts): (&Cell, &Vector3<f64>)| {
        let ratio = cell.value.max(least) / parts.dot(values).max(least);
        cell.count * (ratio - 1.0 - ratio.ln())
    };
    cells().map(deviance).sum()
}

/// Least squares with no value below 0, from the normal equations: the best of all choices of which
/// are 0.
fn non_negative(gram: &Matrix3<f64>, along: &Vector3<f64>) -> Vector3<f64> {
    let mut best = (Vector3::zeros(), 0.0);
    for choice in 1..8usize {
        let chosen = [0, 1, 2].map(|k| f64::from(u8::from(choice >> k & 1 == 1)));
        let chosen = Matrix3::from_diagonal(&Vector3::from(chosen));
        let part = chosen * gram * chosen + (Matrix3::identity() - chosen);
        // White noise and gusts without memory are one: together they are not told.
        let Some(solved) = part.cholesky() else {
            continue;
        };
        let solved = solved.solve(&(chosen * along));
        let taken = solved.dot(along);
        if solved.min() >= 0.0 && taken > best.1 * (1.0 + 1e-9) {
            best = (solved, taken);
        }
    }
    best.0
}

impl NoiseModel {
    /// White noise alone.
    #[must_use]
    pub fn white(sd: f64) -> NoiseModel {
        NoiseModel {
            white: sd,
            s0: 0.0,
            s1: 0.0,
            memory_s: 0.0,
        }
    }

    /// Standard deviation at a baseline flow, in the channel's unit.
    #[must_use]
    pub fn sd(&self, flow: f64) -> f64 {
        self.white.hypot(self.of_gusts(flow))
    }

    fn of_gusts(&self, flow: f64) -> f64 {
        self.s0.hypot(self.s1 * flow)
    }

    fn kept(&self, while_s: f64) -> f64 {
        kept(self.memory_s, while_s)
    }
}

/// Share of a gust with some memory (s) that is left after a while (s).
fn kept(memory_s: f64, while_s: f64) -> f64 {
    (-while_s / memory_s.max(f64::MIN_POSITIVE)).exp()
}

/// Takes scale and memory off values: what is left of noise has variance 1 and no correlation.
///
/// ```text
/// eᵢ = (rᵢ - σ_g,ᵢ kᵢ ĝᵢ₋₁)/Sᵢ,     ĝᵢ = kᵢ ĝᵢ₋₁ + Kᵢ eᵢ,     kᵢ = exp(-Δt/T)
/// Pᵢ = kᵢ² Qᵢ₋₁ + 1 - kᵢ²,   Sᵢ² = σ_g,ᵢ² Pᵢ + σ_w²,   Kᵢ = Pᵢ σ_g,ᵢ/Sᵢ,   Qᵢ = Pᵢ - Kᵢ²
/// ```
///
/// `ĝ`: the gust over its standard deviation `σ_g`, 0 with `Q` = 1 before a series begins and after
/// a gap. Linear: columns of a model are whitened as residuals are.
#[derive(Clone, Debug)]
pub struct Whitener {
    sd: Vec<f64>,
    /// In the order of series and of time.
    steps: Vec<FilterStep>,
    /// In the order in which it is taken out.
    shared: Vec<Shared>,
}

#[derive(Clone, Copy, Debug)]
struct FilterStep {
    at: usize,
    /// The sample before, and what is kept of the gust there, `k`; itself and 0 without one.
    before: usize,
    kept: f64,
    /// Standard deviation of gusts, `σ_g`.
    of_gusts: f64,
    /// Standard deviation of the surprise, `S`, one over it, and what it tells of the gust, `K`.
    spread: f64,
    over_spread: f64,
    told: f64,
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
        // No noise at all would make every residual infinitely surprising; far below any
        // instrument, and squares stay finite.
        let white = noise.white.max(LEAST_SD);
        let mut unknown = vec![1.0; flow.len()];
        let step = |&at: &usize| {
            let before = sequence.previous[at];
            let kept = before.map_or(0.0, |_| noise.kept(sequence.step_s[at]));
            let before = before.unwrap_or(at);
            let of_gusts = noise.of_gusts(flow[at]);
            let unsure = kept * kept * unknown[before] + 1.0 - kept * kept;
            let spread = white.hypot(of_gusts * unsure.sqrt());
            let told = unsure * of_gusts / spread;
            unknown[at] = unsure - told * told;
            FilterStep {
                at,
                before,
                kept,
                of_gusts,
                spread,
                over_spread: spread.recip(),
                told,
            }
        };
        Self {
            steps: sequence.order.iter().map(step).collect(),
            sd: flow.iter().map(|&u| noise.sd(u).max(LEAST_SD)).collect(),
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

    /// Standard deviation of every sample, in the channel's unit.
    pub(crate) fn sd(&self) -> &[f64] {
        &self.sd
    }

    /// Values, whitened, in the order of samples.
    #[must_use]
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        let [white] = self.beside([values]);
        white
    }

    /// Each of some columns, whitened.
    #[must_use]
    pub fn whiten_all(&self, columns: &[&[f64]]) -> Vec<Vec<f64>> {
        let fours = columns.chunks(BESIDE);
        let whitened = fours.flat_map(|some| match <[&[f64]; BESIDE]>::try_from(some) {
            Ok(four) => Vec::from(self.beside(four)),
            Err(_) => some.iter().map(|column| self.whiten(column)).collect(),
        });
        whitened.collect()
    }

    /// Some columns beside one another: each step waits for the one before it, and not for those of
    /// other columns.
    fn beside<const N: usize>(&self, columns: [&[f64]; N]) -> [Vec<f64>; N] {
        let count = self.sd.len();
        let mut white = columns.map(|_| vec![0.0; count]);
        let mut gust = vec![[0.0; N]; count];
        for step in &self.steps {
            let before = gust[step.before];
            for k in 0..N {
                let expected = step.kept * before[k];
                let surprise = (columns[k][step.at] - step.of_gusts * expected) * step.over_spread;
                gust[step.at][k] = expected + step.told * surprise;
                white[k][step.at] = surprise;
            }
        }
        for shared in &self.shared {
            white.iter_mut().for_each(|white| shared.take_out(white));
        }
        white
    }

    /// Log density of values, up to a constant; gross ones count as pseudo-Huber has it.
    #[must_use]
    pub fn log_density(&self, values: &[f64]) -> f64 {
        let of_losses: f64 = self.whiten(values).iter().map(|e| -0.5 * loss(*e)).sum();
        of_losses - self.steps.iter().map(|step| step.spread.ln()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests;
