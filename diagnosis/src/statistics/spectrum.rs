//! Does it pulsate? The strongest line of a Lomb-Scargle spectrum against its own neighbourhood.
//!
//! Blocks of random sign average a pulsation out, and an estimate of memory swallows it; its
//! spectrum shows it. Power at a frequency is what a sine and a cosine take off the sum of squares
//! (Lomb 1976, Scargle 1982), so uneven steps and gaps do no harm. It is held against the median of
//! its neighbours, which follows a spectrum that slopes. For noise that is level over the
//! neighbourhood, powers are exponential; the median of `n` of them is the `m`-th of `n` order
//! statistics, whose Laplace transform (Rényi 1953) makes the p-value exact:
//!
//! ```text
//! P(power/median > x) = Π_{i<m} (n - i)/(n - i + x)
//! ```
//!
//! Multiplied by the number of frequencies looked at (Bonferroni; Fisher's g test of 1929 with a
//! floor that may slope).

use std::ops::RangeInclusive;

use nalgebra::Complex;

use super::quantile::median;

/// A line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Frequency on the given clock (Hz).
    pub frequency_hz: f64,
    /// p-value of one as strong anywhere in the spectrum, in noise alone.
    pub p: f64,
}

/// Slower than this (s) is the business of steps and bins, and of blocks. The length of the
/// shortest block.
const LONGEST_PERIOD_S: f64 = 15.0;
/// Frequencies per independent one: a line between two of them loses at most a fifth of its power.
const OVERSAMPLING: usize = 2;
/// Independent frequencies on either side that make the neighbourhood, and those that a line itself
/// spills into.
const NEIGHBOURS: usize = 40;
const SPILLED: usize = 3;
/// Samples that a spectrum needs.
const LEAST_SAMPLES: usize = 64;

/// The strongest line in values at times of any order (s); `None` below 64 samples or where no
/// period below 15 s fits.
///
/// The clock may be convected: time since what arrives now left the rotors.
#[must_use]
pub fn strongest_line(clock_s: &[f64], values: &[f64]) -> Option<Line> {
    if clock_s.len() < LEAST_SAMPLES {
        return None;
    }
    let first = clock_s.iter().copied().fold(f64::INFINITY, f64::min);
    let last = clock_s.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut times: Vec<f64> = clock_s.iter().map(|t| t - first).collect();
    let mut sorted = times.clone();
    sorted.sort_by(f64::total_cmp);
    let mut steps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let step_s = median(&mut steps)?;
    let span_s = last - first;
    if step_s <= 0.0 || !span_s.is_finite() {
        return None;
    }
    // The middle of the record as origin: rotations stay small.
    times.iter_mut().for_each(|t| *t -= 0.5 * span_s);
    let spacing_hz = 1.0 / (span_s * OVERSAMPLING as f64);
    let lowest = (1.0 / (LONGEST_PERIOD_S * spacing_hz)).ceil() as usize;
    // Short of the Nyquist frequency by the neighbours that a sine there would be confused with.
    let highest = (0.5 / (step_s * spacing_hz)).floor() as usize;
    let highest = highest.saturating_sub(SPILLED * OVERSAMPLING);
    if highest < lowest + 2 * NEIGHBOURS * OVERSAMPLING {
        return None;
    }
    // Slower ones are neighbours all the same: without them the lowest line would be held against a
    // floor that has sloped away.
    let first_power = lowest.saturating_sub(NEIGHBOURS * OVERSAMPLING).max(1);
    let powers = powers(&times, values, first_power..=highest, spacing_hz);
    let (at, p) = (lowest - first_power..powers.len())
        .filter_map(|at| Some((at, against_neighbours(&powers, at)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Line {
        frequency_hz: (first_power + at) as f64 * spacing_hz,
        p: (p * (highest - lowest + 1) as f64).min(1.0),
    })
}

/// Sum of squares that a sine and a cosine explain, at some successive multiples of the spacing.
fn powers(times: &[f64], values: &[f64], of: RangeInclusive<usize>, spacing_hz: f64) -> Vec<f64> {
    let angle = |t: f64, k: usize| std::f64::consts::TAU * spacing_hz * k as f64 * t;
    let phases = |k: usize| times.iter().map(move |&t| Complex::cis(angle(t, k)));
    let mut phase: Vec<Complex<f64>> = phases(*of.start()).collect();
    let turn: Vec<Complex<f64>> = phases(1).collect();
    let count = times.len() as f64;
    let mut powers = Vec::new();
    for _ in of {
        let (mut xc, mut xs, mut cc, mut cs) = (0.0, 0.0, 0.0, 0.0);
        for ((phase, x), turn) in phase.iter_mut().zip(values).zip(&turn) {
            xc += x * phase.re;
            xs += x * phase.im;
            cc += phase.re * phase.re;
            cs += phase.re * phase.im;
            *phase *= turn;
        }
        let ss = count - cc;
        let determinant = cc * ss - cs * cs;
        // Sine and cosine are alike at these times: no power can be told.
        let told = determinant > 0.01 * count * count;
        let power = (xc * xc * ss - 2.0 * xc * xs * cs + xs * xs * cc) / determinant;
        powers.push(if told { power } else { 0.0 });
    }
    powers
}

/// p-value of the power over the median of its neighbourhood; `None` in a silent one.
fn against_neighbours(powers: &[f64], at: usize) -> Option<f64> {
    let reach = NEIGHBOURS * OVERSAMPLING;
    let spill = SPILLED * OVERSAMPLING;
    // At an end of the spectrum the neighbourhood moves inwards and keeps its size.
    let last = powers.len().saturating_sub(2 * reach + 1);
    let from = at.saturating_sub(reach).min(last);
    let to = (from + 2 * reach + 1).min(powers.len());
    let neighbours = (from..to).filter(|k| k.abs_diff(at) > spill);
    let mut neighbours: Vec<f64> = neighbours.map(|k| powers[k]).collect();
    let floor = median(&mut neighbours).filter(|floor| *floor > 0.0)?;
    let ratio = powers[at] / floor;
    // Only every second frequency is independent of the others.
    let n = neighbours.len() / OVERSAMPLING;
    let left = (0..n.div_ceil(2)).map(|i| (n - i) as f64);
    Some(left.map(|left| left / (left + ratio)).product())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::draws::Draws;

    #[test]
    fn a_pulsation_of_half_the_noise_is_found_at_its_frequency() {
        let mut random = Draws::new(4);
        let t_s: Vec<f64> = (0..1000)
            .map(|i| f64::from(i) + 0.3 * random.uniform())
            .collect();
        let values: Vec<f64> = t_s
            .iter()
            .map(|t| 0.5 * (std::f64::consts::TAU * 0.237 * t).sin() + random.normal())
            .collect();
        let line = strongest_line(&t_s, &values).expect("long enough");
        // Half the spacing of independent frequencies, 1/1000 s.
        assert!((line.frequency_hz - 0.237).abs() < 5e-4, "{line:?}");
        assert!(line.p < 1e-6, "{line:?}");
    }

    #[test]
    fn noise_with_memory_makes_no_line() {
        let mut below = 0;
        for seed in 0..200 {
            let mut random = Draws::new(seed);
            let mut state = 0.0;
            let values: Vec<f64> = (0..600)
                .map(|_| {
                    state = 0.6 * state + random.normal();
                    state
                })
                .collect();
            let t_s: Vec<f64> = (0..600).map(f64::from).collect();
            below += usize::from(strongest_line(&t_s, &values).is_some_and(|l| l.p < 0.05));
        }
        // 10 expected at most; five standard deviations of that more.
        assert!(below <= 26, "{below}");
    }
}
