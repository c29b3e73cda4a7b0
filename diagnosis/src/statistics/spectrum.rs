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
//!
//! Below the slowest period of blocks a step or a drift has more power the slower it is. There a
//! line has to stand out among the slower frequencies as well: over the mean of `m` powers,
//!
//! ```text
//! P(power/mean > x) = (1 + x/m)^-m
//! ```

use std::ops::RangeInclusive;

use nalgebra::Complex;

use super::quantile::{mean, median};

/// A line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Frequency on the given clock (Hz).
    pub frequency_hz: f64,
    /// p-value of one as strong anywhere in the spectrum, in noise alone.
    pub p: f64,
}

/// Periods up to this (s) are looked for by [`strongest_line`], longer ones by [`slow_line`]. The
/// length of the shortest block: what is slower, whole blocks show.
const LONGEST_PERIOD_S: f64 = 15.0;
/// Cycles that a slow line needs: twice as many independent frequencies as a line spills into, so
/// that some slower ones are left.
const LEAST_CYCLES: f64 = 2.0 * SPILLED as f64;
/// p-value of a slow line among the slower frequencies. Chosen here: a step has 0.9 there.
const AMONG_SLOWER_P: f64 = 0.01;
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
    let timed = Timed::new(clock_s)?;
    let lowest = timed.nearest_above(LONGEST_PERIOD_S.recip());
    let highest = timed.highest();
    if highest < lowest + 2 * NEIGHBOURS * OVERSAMPLING {
        return None;
    }
    // Slower ones are neighbours all the same: without them the lowest line would be compared with
    // a floor that has sloped away.
    let first = lowest.saturating_sub(NEIGHBOURS * OVERSAMPLING).max(1);
    let powers = timed.powers(values, first..=highest);
    timed.strongest(&powers, first, lowest..=highest, |at| {
        against_neighbours(&powers, at)
    })
}

/// The strongest line with a period from 15 s to a sixth of the record, in values at times of any
/// order (s): a source that is switched on and off. `None` below 64 samples or where the record is
/// too short for one.
#[must_use]
pub fn slow_line(clock_s: &[f64], values: &[f64]) -> Option<Line> {
    let timed = Timed::new(clock_s)?;
    let lowest = timed.nearest_above(LEAST_CYCLES / timed.span_s);
    let highest = timed.nearest_above(LONGEST_PERIOD_S.recip());
    let last = highest.max(lowest + 2 * NEIGHBOURS * OVERSAMPLING);
    if highest <= lowest || last > timed.highest() {
        return None;
    }
    let powers = timed.powers(values, 1..=last);
    timed.strongest(&powers, 1, lowest..=highest, |at| {
        let stands_out = among_slower(&powers, at) <= AMONG_SLOWER_P;
        stands_out.then(|| against_neighbours(&powers, at))?
    })
}

/// A record's times about its middle, and the frequencies that it resolves.
struct Timed {
    times_s: Vec<f64>,
    span_s: f64,
    step_s: f64,
    spacing_hz: f64,
}

impl Timed {
    fn new(clock_s: &[f64]) -> Option<Timed> {
        if clock_s.len() < LEAST_SAMPLES {
            return None;
        }
        let mut sorted = clock_s.to_vec();
        sorted.sort_by(f64::total_cmp);
        let mut steps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let step_s = median(&mut steps)?;
        let (first, last) = (sorted[0], sorted[sorted.len() - 1]);
        let span_s = last - first;
        // The middle of the record as origin: rotations stay small.
        let times_s = clock_s.iter().map(|t| t - first - 0.5 * span_s).collect();
        (step_s > 0.0 && span_s.is_finite()).then_some(Timed {
            times_s,
            span_s,
            step_s,
            spacing_hz: 1.0 / (span_s * OVERSAMPLING as f64),
        })
    }

    fn nearest_above(&self, frequency_hz: f64) -> usize {
        (frequency_hz / self.spacing_hz).ceil() as usize
    }

    /// Short of the Nyquist frequency by the neighbours that a sine there would be confused with.
    fn highest(&self) -> usize {
        let nyquist = (0.5 / (self.step_s * self.spacing_hz)).floor() as usize;
        nyquist.saturating_sub(SPILLED * OVERSAMPLING)
    }

    fn powers(&self, values: &[f64], of: RangeInclusive<usize>) -> Vec<f64> {
        powers(&self.times_s, values, of, self.spacing_hz)
    }

    /// The line of least p-value among some frequencies, all of them counted; the first of `powers`
    /// is number `first`.
    fn strongest(
        &self,
        powers: &[f64],
        first: usize,
        among: RangeInclusive<usize>,
        p_value: impl Fn(usize) -> Option<f64>,
    ) -> Option<Line> {
        let count = among.clone().count() as f64;
        let (at, p) = (among.start() - first..powers.len().min(among.end() + 1 - first))
            .filter_map(|at| Some((at, p_value(at)?)))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(Line {
            frequency_hz: (first + at) as f64 * self.spacing_hz,
            p: (p * count).min(1.0),
        })
    }
}

/// p-value of the power over the mean of the slower ones that it does not spill into.
fn among_slower(powers: &[f64], at: usize) -> f64 {
    let slower = &powers[..at.saturating_sub(SPILLED * OVERSAMPLING)];
    // Only every second frequency is independent of the others.
    let count = slower.len() as f64 / OVERSAMPLING as f64;
    let ratio = powers[at] / mean(slower).max(f64::MIN_POSITIVE);
    (1.0 + ratio / count.max(1.0)).powf(-count)
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
        // Sine and cosine are alike at these times: no power can be estimated.
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
    fn what_is_switched_on_and_off_is_a_slow_line_and_what_sets_in_or_drifts_is_none() {
        let t_s: Vec<f64> = (0..900).map(f64::from).collect();
        let p = |seed: u64, signal: &dyn Fn(f64) -> f64| {
            let mut random = Draws::new(seed);
            let values = t_s.iter().map(|&t| signal(t) + random.normal());
            let line = slow_line(&t_s, &values.collect::<Vec<f64>>());
            line.map_or((1.0, 0.0), |line| (line.p, line.frequency_hz))
        };
        let switched = |t: f64| f64::from(u8::from((t / 47.0).fract() < 0.5));
        let (found, frequency_hz) = p(1, &switched);
        // Half the spacing of independent frequencies, 1/900 s.
        assert!(
            found < 1e-6 && (frequency_hz - 1.0 / 47.0).abs() < 6e-4,
            "{found}"
        );
        let signals: [&dyn Fn(f64) -> f64; 3] =
            [&|_| 0.0, &|t| 2.0 * f64::from(u8::from(t > 380.0)), &|t| {
                0.004 * t
            }];
        for signal in signals {
            let alarms = (0..200).filter(|&seed| p(seed, signal).0 < 0.01).count();
            // 1 % of 200, and three standard deviations.
            assert!(alarms <= 6, "{alarms}");
        }
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
