//! Do series err together? Probes of a rake stand in the same turbulence.
//!
//! A gust larger than the gap between two probes moves the readings of both, so that what one reads
//! at a time tells the other's error then: the two are not two witnesses. Told by how readings of
//! one time have changed together since up to 1.5 s before, where the simulation hardly changes and
//! what it gets wrong drops out:
//!
//! ```text
//! z = Σ d_i d_j/√(1.5 Σ (d_i d_j)²)     over all pairs (i, j) of two series at one time
//! ```
//!
//! with `d` the change of the residual, gross ones bounded. In the channel's unit, since gusts are
//! largest where the flow is, and still air tells of the instruments alone. Where series err
//! independently, products have mean 0, whatever the memory and the tails of each, and are
//! uncorrelated but for neighbours in time: one change begins with the reading that the other ends
//! with.

use super::quantile::median;
use super::robust::weight;
use super::sequence::Sequence;
use super::tail::normal_two_sided;

/// Changes over at most so long (s): the longest that the noise is read from.
const LONGEST_S: f64 = 1.5;
/// A simulation is flat where it changes by at most this share of itself, or by no more than it
/// does at half of all samples. Chosen here, as where the noise is read.
const FLAT_SHARE: f64 = 0.02;
/// Variance of a sum of products over the sum of their squares, at most: changes of white noise
/// that share a reading have the correlation -1/2, and their products 1/4, with the change before
/// and with the next.
const SHARED_ENDS: f64 = 1.5;
/// p-value below which series err together. Chosen here: independent ones that are taken for such
/// once in a hundred times are judged by fewer and larger blocks, which is no error.
const TOGETHER_P: f64 = 0.01;

/// Whether samples of different series, in any order, err together: from their times (s), what is
/// expected of them, residuals and their standard deviation, one of each a sample.
#[must_use]
pub fn err_together(
    sequence: &Sequence,
    series_of: &[usize],
    [t_s, expected, residual, sd]: [&[f64]; 4],
) -> bool {
    let step_s = sequence.typical_step_s;
    if step_s <= 0.0 || series_of.iter().all(|of| *of == series_of[0]) {
        return false;
    }
    let steps = (LONGEST_S / step_s).max(1.0) as usize;
    let before = |at: usize| (0..steps).try_fold(at, |at, _| sequence.previous[at]);
    let first_s = t_s.iter().copied().fold(f64::INFINITY, f64::min);
    let moment = |at: usize| ((t_s[at] - first_s) / step_s).round();
    let change = |at: usize| {
        let before = before(at).filter(|_| moment(at) % steps as f64 == 0.0)?;
        let [now, then] = [at, before].map(|at| expected[at]);
        let share = (now - then).abs() / now.abs().max(then.abs()).max(f64::MIN_POSITIVE);
        let change = residual[at] - residual[before];
        let bounded = change * weight(change / (std::f64::consts::SQRT_2 * sd[at]));
        Some((at, share, bounded))
    };
    let changes: Vec<_> = (0..t_s.len()).filter_map(change).collect();
    let mut shares: Vec<f64> = changes.iter().map(|(_, share, _)| *share).collect();
    let most = median(&mut shares).unwrap_or(0.0).max(FLAT_SHARE);
    let flat = changes.into_iter().filter(|(_, share, _)| *share <= most);
    let mut flat: Vec<(f64, usize, f64)> = flat.map(|(at, _, d)| (moment(at), at, d)).collect();
    flat.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let (mut sum, mut squares) = (0.0, 0.0);
    for together in flat.chunk_by(|a, b| a.0 == b.0) {
        for (k, &(_, at, d)) in together.iter().enumerate() {
            let others = together[..k].iter();
            let others = others.filter(|(_, other, _)| series_of[*other] != series_of[at]);
            for (.., other) in others {
                sum += d * other;
                squares += (d * other).powi(2);
            }
        }
    }
    let z = sum / (SHARED_ENDS * squares).sqrt();
    z > 0.0 && 0.5 * normal_two_sided(z) < TOGETHER_P
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::draws::Draws;

    /// Three probes at 2 Hz below a drone that stays 9 s at each of its places, where the
    /// simulation is wrong by as much for all of them; gusts of 3 s memory, of which a share (of
    /// the variance) is common.
    fn is_told(seed: u64, shared: f64, wrong: f64) -> bool {
        let mut random = Draws::new(seed);
        let (count, probes) = (600, 3);
        let kept = (-0.5f64 / 3.0).exp();
        let mut gusts = vec![0.0; probes + 1];
        let (mut place, mut t_s, mut series) = (0.0, Vec::new(), Vec::new());
        let (mut expected, mut residual) = (Vec::new(), Vec::new());
        for i in 0..count {
            if i % 18 == 0 {
                place = random.normal();
            }
            for gust in &mut gusts {
                *gust = kept * *gust + (1.0 - kept * kept).sqrt() * random.normal();
            }
            for probe in 0..probes {
                let gust = shared.sqrt() * gusts[probes] + (1.0 - shared).sqrt() * gusts[probe];
                t_s.push(0.5 * f64::from(i));
                series.push(probe);
                expected.push(3.0 + place + 0.1 * probe as f64);
                residual.push(gust + 0.5 * random.normal() + wrong * place);
            }
        }
        let sd = vec![1.25f64.sqrt(); t_s.len()];
        let sequence = Sequence::new(&t_s, &series);
        err_together(&sequence, &series, [&t_s, &expected, &residual, &sd])
    }

    #[test]
    fn probes_in_one_gust_err_together_and_others_as_seldom_as_said() {
        let told = |shared: f64| (0..200).filter(|&seed| is_told(seed, shared, 0.0)).count();
        // Three standard errors of a share of 0.01 from 200.
        assert!(told(0.0) <= 6, "{}", told(0.0));
        assert_eq!(told(0.5), 200);
        assert_eq!(told(1.0), 200);
    }

    #[test]
    fn a_simulation_that_is_wrong_below_each_place_is_no_gust() {
        let told = (0..200).filter(|&seed| is_told(seed, 0.0, 2.0)).count();
        assert!(told <= 6, "{told}");
    }
}
