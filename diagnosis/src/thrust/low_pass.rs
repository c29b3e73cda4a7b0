//! Low-passes for logged series. The zero-phase one: second-order Butterworth, forwards and then
//! backwards, exact at any spacing.
//!
//! Between two samples the input is taken as linear, and the filter's differential equation is
//! solved, not approximated, so uneven steps are nothing special. Across gaps and samples that are
//! not numbers nothing is carried: each run is filtered alone.
//!
//! ```text
//! y'' + √2 ω y' + ω² y = ω² u,   ω = 2π f
//! ```

use std::f64::consts::{SQRT_2, TAU};
use std::ops::Range;

/// The filter, by the frequency at which one pass halves the power (two passes: quarter it, half
/// the amplitude).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPass {
    /// Cut-off (Hz), above 0.
    pub cutoff_hz: f64,
}

/// Parts of a series without a step longer than `longest_step_s` and without a row that is not
/// `usable`; in order, none empty.
#[must_use]
pub fn runs(t_s: &[f64], longest_step_s: f64, usable: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (row, &time_s) in t_s.iter().enumerate() {
        if !usable(row) {
            continue;
        }
        match runs.last_mut() {
            Some(run) if run.end == row && time_s - t_s[row - 1] <= longest_step_s => {
                run.end += 1;
            }
            _ => runs.push(row..row + 1),
        }
    }
    runs
}

impl LowPass {
    /// Filters a run in place.
    ///
    /// ```
    /// let t_s: Vec<f64> = (0..100).map(|i| 0.02 * f64::from(i)).collect();
    /// let mut spike = vec![0.0; 100];
    /// spike[50] = 1.0;
    /// diagnosis::thrust::low_pass::LowPass { cutoff_hz: 5.0 }.smooth(&t_s, &mut spike);
    /// assert!(spike[50] < 0.3 && spike[50] > spike[49], "lower, and still in its place");
    /// ```
    /// It starts and ends as if the first and the last value had stood before and after.
    ///
    /// `t_s` and `values` have the same length; times rise strictly.
    pub fn smooth(&self, t_s: &[f64], values: &mut [f64]) {
        let rows = t_s.len().min(values.len());
        self.pass(t_s, values, 0..rows);
        self.pass(t_s, values, (0..rows).rev());
    }

    /// Filters rows in one direction.
    fn pass(&self, t_s: &[f64], values: &mut [f64], mut rows: impl Iterator<Item = usize>) {
        let Some(mut last) = rows.next() else {
            return;
        };
        let mut before = values[last];
        let mut pass = Pass::new(self.cutoff_hz, before);
        for row in rows {
            let now = values[row];
            values[row] = pass.step((t_s[row] - t_s[last]).abs(), before, now);
            (last, before) = (row, now);
        }
    }
}

/// First-order lag of a run in place, starting at its first value; each value stands over the step
/// that leads to it, as a command does.
pub(crate) fn lag(lag_s: f64, t_s: &[f64], values: &mut [f64]) {
    if lag_s <= 0.0 {
        return;
    }
    let (mut step_s, mut share) = (0.0, 0.0);
    for row in 1..values.len() {
        let this_s = t_s[row] - t_s[row - 1];
        if this_s != step_s {
            (step_s, share) = (this_s, -(-this_s / lag_s).exp_m1());
        }
        values[row] = values[row - 1] + share * (values[row] - values[row - 1]);
    }
}

/// One pass over a run: the output, its slope, and the last step's factors.
struct Pass {
    /// `ω/√2`: both the damping and the frequency of a Butterworth pair (1/s).
    rate_per_s: f64,
    value: f64,
    slope: f64,
    step_s: f64,
    /// `exp(-σt) cos σt` and `exp(-σt) sin σt` of the last step; steps seldom change.
    cosine: f64,
    sine: f64,
}

impl Pass {
    /// At rest at a value.
    fn new(cutoff_hz: f64, value: f64) -> Pass {
        Pass {
            rate_per_s: TAU * cutoff_hz / SQRT_2,
            value,
            slope: 0.0,
            step_s: 0.0,
            cosine: 1.0,
            sine: 0.0,
        }
    }

    /// The output after a step over which the input went linearly from one value to another.
    fn step(&mut self, step_s: f64, from: f64, to: f64) -> f64 {
        let sigma = self.rate_per_s;
        // Times are decimal fractions: steps that differ by rounding only are the same step.
        if (step_s - self.step_s).abs() > 1e-9 {
            let decay = (-sigma * step_s).exp();
            let (sine, cosine) = (sigma * step_s).sin_cos();
            (self.step_s, self.cosine, self.sine) = (step_s, decay * cosine, decay * sine);
        }
        // A ramp is followed at a distance of √2/ω = 1/σ times its slope; what is off that dies
        // away as the free oscillation e'' + 2σ e' + 2σ² e = 0.
        let ramp = (to - from) / step_s;
        let off = self.value - (from - ramp / sigma);
        let off_slope = self.slope - ramp;
        self.value =
            (to - ramp / sigma) + off * self.cosine + (off + off_slope / sigma) * self.sine;
        self.slope = ramp + off_slope * self.cosine - (off_slope + 2.0 * sigma * off) * self.sine;
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIVE_HZ: LowPass = LowPass { cutoff_hz: 5.0 };

    /// Amplitude and phase shift of what is left of a sine of a frequency, away from the ends.
    fn response(frequency_hz: f64, times_s: &[f64]) -> (f64, f64) {
        let mut values: Vec<f64> = times_s
            .iter()
            .map(|t_s| (TAU * frequency_hz * t_s).sin())
            .collect();
        FIVE_HZ.smooth(times_s, &mut values);
        let (mut ss, mut cc, mut sc, mut sy, mut cy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (t_s, y) in times_s.iter().zip(&values) {
            if !(2.0..8.0).contains(t_s) {
                continue;
            }
            let (s, c) = (TAU * frequency_hz * t_s).sin_cos();
            (ss, cc, sc) = (ss + s * s, cc + c * c, sc + s * c);
            (sy, cy) = (sy + s * y, cy + c * y);
        }
        let det = ss * cc - sc * sc;
        let (a, b) = ((sy * cc - cy * sc) / det, (cy * ss - sy * sc) / det);
        (a.hypot(b), b.atan2(a))
    }

    #[test]
    fn it_halves_the_cutoff_and_shifts_nothing_at_even_and_at_uneven_steps() {
        let even: Vec<f64> = (0..10_000).map(|i| f64::from(i) * 1e-3).collect();
        let uneven: Vec<f64> = (0..10_000)
            .map(|i| f64::from(i) * 1e-3 + if i % 3 == 0 { 0.0 } else { 4e-4 })
            .collect();
        for times_s in [even, uneven] {
            for frequency_hz in [1.0_f64, 5.0, 12.0] {
                let (amplitude, phase) = response(frequency_hz, &times_s);
                let expected = 1.0 / (1.0 + (frequency_hz / 5.0).powi(4));
                // A chord of 1.4 ms lies below a sine of 12 Hz by (2π·12·0.0014)²/8 = 0.14 % at
                // most.
                assert!((amplitude - expected).abs() < 2e-3 * expected.max(0.1));
                assert!(phase.abs() < 2e-3, "{frequency_hz} Hz: {phase} rad");
            }
        }
    }

    #[test]
    fn a_constant_stays_and_a_run_of_one_sample_too() {
        let mut values = vec![3.5; 40];
        let t_s: Vec<f64> = (0..40).map(|i| 0.02 * f64::from(i)).collect();
        FIVE_HZ.smooth(&t_s, &mut values);
        // Rounding.
        assert!(values.iter().all(|v| (v - 3.5).abs() < 1e-14));
        let mut one = [7.0];
        FIVE_HZ.smooth(&[0.0], &mut one);
        assert_eq!(one, [7.0]);
    }

    #[test]
    fn runs_end_at_gaps_and_at_rows_that_cannot_be_used() {
        let t_s = [0.0, 0.02, 0.04, 0.11, 0.13, 0.15, 0.17];
        assert_eq!(runs(&t_s, 0.05, |row| row != 4), [0..3, 3..4, 5..7]);
        assert!(runs(&t_s, 0.05, |_| false).is_empty());
    }

    #[test]
    fn a_step_is_followed_to_63_percent_in_one_lag_however_it_is_sampled() {
        for t_s in [
            (0..=20).map(|i| 0.005 * f64::from(i)).collect::<Vec<_>>(),
            vec![0.0, 0.01, 0.05, 0.1],
        ] {
            let mut values = vec![1.0; t_s.len()];
            values[0] = 0.0;
            lag(0.1, &t_s, &mut values);
            let last = values[values.len() - 1];
            // Rounding.
            assert!((last - (1.0 - (-1.0_f64).exp())).abs() < 1e-14);
        }
    }
}
