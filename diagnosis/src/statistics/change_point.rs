//! Does a series step, when, and by how much: least squares of two levels, split again on either
//! side.
//!
//! ```text
//! D = max_k |Σ_{i<=k} (yᵢ - ȳ)|/(σ √n),     P(D > x) = 2 Σ (-1)^(j+1) exp(-2 j² x²)
//! ```
//!
//! The cut is where two means leave the least sum of squares; whether it is one is the CUSUM test,
//! whose limit is a Brownian bridge (Csörgő & Horváth 1997). σ is long-run: that of the residual
//! about both means, times `√((1 + r)/(1 - r))` for its memory r. Cuts are made one after the other
//! (Scott & Knott 1974), more than needed, then those that do not hold between their neighbours are
//! dropped.

use super::quantile::mean;
use super::tail;

/// A step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelStep {
    /// First sample after it.
    pub index: usize,
    /// Mean level from the step before, or the start, on.
    pub before: f64,
    /// Mean level up to the next step, or the end.
    pub after: f64,
    /// p-value of as much without a step.
    pub p: f64,
}

/// Least difference of levels of a ratio (throttle, power), and accepted p-value of a step. Chosen
/// here: smaller steps of throttle are trim and battery.
const LEAST_STEP: f64 = 0.03;
const ACCEPTED: f64 = 1e-3;
/// Samples that a level needs. Chosen here: ten tell a mean to a third of the scatter.
const LEAST_SAMPLES: usize = 10;
/// Most memory that is believed: near 1 the long-run variance has no bound, and nothing would ever
/// step.
const MOST_MEMORY: f64 = 0.95;

/// Cuts that are tried before any is judged: noise must be read beside all steps, or two that
/// cancel hide each other.
const MOST_CUTS: usize = 10;

/// Steps of a series of ratios in the order of time.
#[must_use]
pub fn steps(values: &[f64]) -> Vec<LevelStep> {
    steps_of(values, LEAST_STEP, ACCEPTED)
}

fn steps_of(values: &[f64], least_step: f64, accepted: f64) -> Vec<LevelStep> {
    let size = |step: &LevelStep| (step.after - step.before).abs();
    let holds = |step: &LevelStep| size(step) >= least_step && step.p <= accepted;
    let mut cuts = tried(values);
    loop {
        let found: Vec<LevelStep> = (0..cuts.len()).map(|k| step(values, &cuts, k)).collect();
        // The least likely to be one goes first, and its neighbours are read anew.
        let weakest = (0..found.len())
            .filter(|&k| !holds(&found[k]))
            .max_by(|&a, &b| {
                let by_p_value = found[a].p.total_cmp(&found[b].p);
                by_p_value.then(size(&found[b]).total_cmp(&size(&found[a])))
            });
        match weakest {
            Some(k) => cuts.remove(k),
            None => return found,
        };
    }
}

/// The cuts that take most off the sum of squares, one after the other, in the order of time.
fn tried(values: &[f64]) -> Vec<usize> {
    let mut bounds = vec![0, values.len()];
    while bounds.len() < MOST_CUTS + 2 {
        let cuts = bounds.windows(2).filter_map(|part| {
            let (cut, taken) = best_cut(&values[part[0]..part[1]])?;
            Some((part[0] + cut, taken))
        });
        // The first of equals.
        let Some((cut, _)) = cuts.min_by(|a, b| b.1.total_cmp(&a.1)) else {
            break;
        };
        bounds.push(cut);
        bounds.sort_unstable();
    }
    bounds[1..bounds.len() - 1].to_vec()
}

/// Where two means leave the least sum of squares, and how much they take; the earlier of equals.
fn best_cut(values: &[f64]) -> Option<(usize, f64)> {
    let count = values.len();
    let mean = mean(values);
    let mut sum = 0.0;
    let mut best = None;
    for cut in 1..count {
        sum += values[cut - 1] - mean;
        if cut < LEAST_SAMPLES || count - cut < LEAST_SAMPLES {
            continue;
        }
        // Between-group sum of squares of sums that cancel: S²(1/k + 1/(n - k)).
        let taken = sum * sum * (1.0 / cut as f64 + 1.0 / (count - cut) as f64);
        if best.is_none_or(|(_, most)| taken > most) {
            best = Some((cut, taken));
        }
    }
    best.filter(|(_, taken)| *taken > 0.0)
}

/// The step at one cut, between its neighbours.
fn step(values: &[f64], cuts: &[usize], k: usize) -> LevelStep {
    let from = if k == 0 { 0 } else { cuts[k - 1] };
    let to = cuts.get(k + 1).copied().unwrap_or(values.len());
    let part = &values[from..to];
    let cut = cuts[k] - from;
    let (before, after) = (mean(&part[..cut]), mean(&part[cut..]));
    let rows = part.iter().enumerate();
    let left = rows.map(|(i, y)| y - if i < cut { before } else { after });
    let left: Vec<f64> = left.collect();
    let count = part.len() as f64;
    let square: f64 = left.iter().map(|r| r * r).sum();
    let product: f64 = left.windows(2).map(|r| r[0] * r[1]).sum();
    // Without any scatter there is no memory either, and every step is certain.
    let memory = (product / square.max(f64::MIN_POSITIVE)).clamp(0.0, MOST_MEMORY);
    let long_run = square / (count - 2.0).max(1.0) * (1.0 + memory) / (1.0 - memory);
    // The largest sum is the one at the cut, up to the weighting of ends.
    let level = mean(part);
    let sum: f64 = part[..cut].iter().map(|y| y - level).sum();
    LevelStep {
        index: cuts[k],
        before,
        after,
        p: tail::kolmogorov(sum.abs() / (long_run * count).max(f64::MIN_POSITIVE).sqrt()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::draws::Draws;

    fn series(seed: u64, level: impl Fn(usize) -> f64, sd: f64, memory: f64) -> Vec<f64> {
        let mut random = Draws::new(seed);
        let mut state = 0.0;
        (0..600)
            .map(|i| {
                state = memory * state + (1.0 - memory * memory).sqrt() * random.normal();
                level(i) + sd * state
            })
            .collect()
    }

    #[test]
    fn a_payload_picked_up_and_put_down_makes_two_steps() {
        let level = |i| if (200..450).contains(&i) { 1.08 } else { 1.0 };
        let found = steps(&series(1, level, 0.02, 0.5));
        assert_eq!(found.len(), 2, "{found:?}");
        // A step of four standard deviations is placed to a sample or two.
        assert!(found[0].index.abs_diff(200) <= 2 && found[1].index.abs_diff(450) <= 2);
        assert!((found[0].after - 1.08).abs() < 0.01 && (found[1].after - 1.0).abs() < 0.01);
    }

    #[test]
    fn noise_with_memory_makes_no_step() {
        let mut found = 0;
        for seed in 0..500 {
            found += usize::from(!steps_of(&series(seed, |_| 1.0, 0.1, 0.6), 0.0, 0.01).is_empty());
        }
        // 5 expected; four standard deviations more.
        assert!(found <= 14, "{found}");
    }

    #[test]
    fn a_step_below_what_counts_is_not_told() {
        let level = |i| if i < 300 { 1.0 } else { 1.02 };
        assert!(steps(&series(2, level, 0.005, 0.0)).is_empty());
    }

    #[test]
    fn an_exact_step_has_no_chance_and_a_level_series_has_none() {
        let exact: Vec<f64> = (0..40).map(|i| if i < 20 { 1.0 } else { 1.1 }).collect();
        let found = steps(&exact);
        assert_eq!((found.len(), found[0].index, found[0].p), (1, 20, 0.0));
        assert!(steps(&[1.0; 40]).is_empty());
        assert!(steps(&[]).is_empty());
    }
}
