//! Which sample follows which, and blocks of neighbours that are drawn, flipped and held out
//! together.

use super::quantile::median;

/// Steps longer than this many typical ones are gaps: what came before says nothing about what
/// comes after. Chosen here, as the shortest block has as many steps.
const GAP_STEPS: f64 = 8.0;
/// A block is at least this long (s): the slowest turbulence in a jet of these sizes (`r_half/U_C`
/// below 2 s) is over by then.
const BLOCK_S: f64 = 15.0;
/// And at least this many typical steps.
const BLOCK_STEPS: f64 = 8.0;

/// Samples in the order of their series, and of time within each.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// Indices of samples, series by series in the order of their numbers, each in the order of
    /// time.
    pub order: Vec<usize>,
    /// Of every sample, the one before it in its series; `None` at the start of a series and after
    /// a gap.
    pub previous: Vec<Option<usize>>,
    /// Time since that one (s); 0 without one.
    pub step_s: Vec<f64>,
    /// Median step (s); 0 where no sample follows another.
    pub typical_step_s: f64,
}

impl Sequence {
    /// Orders samples by series, then time (finite, s); ties by index.
    #[must_use]
    pub fn new(t_s: &[f64], series: &[usize]) -> Self {
        let mut order: Vec<usize> = (0..t_s.len()).collect();
        order.sort_by(|&a, &b| {
            let by_time = t_s[a].total_cmp(&t_s[b]);
            series[a].cmp(&series[b]).then(by_time).then(a.cmp(&b))
        });
        let pairs = order.windows(2).map(|pair| (pair[0], pair[1]));
        let neighbours = pairs.filter(|&(before, at)| series[before] == series[at]);
        let steps = neighbours.map(|(before, at)| (before, at, t_s[at] - t_s[before]));
        let steps: Vec<_> = steps.filter(|(.., step)| *step > 0.0).collect();
        let mut lengths_s: Vec<f64> = steps.iter().map(|(.., step)| *step).collect();
        let typical_step_s = median(&mut lengths_s).unwrap_or(0.0);
        let mut previous = vec![None; t_s.len()];
        let mut step_s = vec![0.0; t_s.len()];
        for (before, at, step) in steps {
            if step <= GAP_STEPS * typical_step_s {
                previous[at] = Some(before);
                step_s[at] = step;
            }
        }
        Self {
            order,
            previous,
            step_s,
            typical_step_s,
        }
    }

    /// Stretches without a gap, in order, as indices of samples.
    fn runs(&self) -> impl Iterator<Item = &[usize]> {
        self.order
            .chunk_by(|_, &next| self.previous[next].is_some())
    }
}

/// Correlation of neighbours of mean 0 and equal variance, `Σ x y / Σ ½ (x² + y²)`; `None` where
/// nothing varies.
pub(super) fn correlation(pairs: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let sums = pairs.fold((0.0, 0.0), |(product, square), (x, y)| {
        (product + x * y, square + 0.5 * (x * x + y * y))
    });
    (sums.1 > 0.0).then(|| sums.0 / sums.1)
}

/// Sizes over the scatter count no more than this, so that no single one decides. Chosen here, as
/// Huber's bound of a residual.
const MOST_SIZE: f64 = 3.0;

/// Whether large values follow one another more than by chance: the correlation of neighbours'
/// sizes (over the scatter) is three standard errors above 0 (`1/√n`, Bartlett 1946, Suppl. J. R.
/// Stat. Soc. 8:27).
#[must_use]
pub fn large_follow_large(sequence: &Sequence, values: &[f64], sd: &[f64]) -> bool {
    let sizes = values.iter().zip(sd);
    let sizes: Vec<f64> = sizes.map(|(e, sd)| (e / sd).abs().min(MOST_SIZE)).collect();
    let mean = sizes.iter().sum::<f64>() / sizes.len().max(1) as f64;
    let pairs = || (0..sizes.len()).filter_map(|at| Some((at, sequence.previous[at]?)));
    let about = pairs().map(|(at, before)| (sizes[at] - mean, sizes[before] - mean));
    let least = 3.0 / (pairs().count() as f64).sqrt();
    correlation(about).is_some_and(|r| r > least)
}

/// Neighbouring samples that are taken as one draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocks {
    /// Of every sample, its block; blocks are numbered in the order of time, series by series or
    /// across all of them.
    pub of_sample: Vec<usize>,
    /// Of every block, whether it goes on where the one before it ended.
    pub follows: Vec<bool>,
}

impl Blocks {
    /// Equal parts of every stretch without a gap, each at least `max(15 s, 8 steps)` long; a
    /// shorter stretch is one block. Each series has blocks of its own.
    #[must_use]
    pub fn new(sequence: &Sequence, t_s: &[f64]) -> Self {
        Self::of_runs(sequence.runs(), sequence.typical_step_s, t_s)
    }

    /// The same of time alone: a block holds the samples of all series. Series that err together
    /// are one draw, and are held out together.
    #[must_use]
    pub fn across(sequence: &Sequence, t_s: &[f64]) -> Self {
        let mut order: Vec<usize> = (0..t_s.len()).collect();
        order.sort_by(|&a, &b| t_s[a].total_cmp(&t_s[b]).then(a.cmp(&b)));
        let gap_s = GAP_STEPS * sequence.typical_step_s;
        let runs = order.chunk_by(|&before, &at| t_s[at] - t_s[before] <= gap_s);
        Self::of_runs(runs, sequence.typical_step_s, t_s)
    }

    fn of_runs<'a>(
        runs: impl Iterator<Item = &'a [usize]>,
        typical_step_s: f64,
        t_s: &[f64],
    ) -> Self {
        let least_s = BLOCK_S.max(BLOCK_STEPS * typical_step_s);
        let mut of_sample = vec![0; t_s.len()];
        let mut follows = Vec::new();
        for run in runs {
            let (first, last) = (run[0], run[run.len() - 1]);
            // A sample stands for the step before it, too: n samples cover n steps.
            let covered_s = t_s[last] - t_s[first] + typical_step_s;
            let parts = (covered_s / least_s).floor().max(1.0);
            let mut at = 0;
            follows.push(false);
            for &sample in run {
                let part = ((t_s[sample] - t_s[first]) / covered_s * parts).floor();
                let part = part.clamp(0.0, parts - 1.0) as usize;
                // A part may hold no sample: numbers count those that do.
                if part > at {
                    at = part;
                    follows.push(true);
                }
                of_sample[sample] = follows.len() - 1;
            }
        }
        Self { of_sample, follows }
    }

    /// How many.
    #[must_use]
    pub fn count(&self) -> usize {
        self.follows.len()
    }

    /// Every block joined with the one that follows it: half as many, twice as long. Returns, for
    /// every block, its new number, and whether each new block follows the one before.
    #[must_use]
    pub fn pairs(follows: &[bool]) -> (Vec<usize>, Vec<bool>) {
        let mut joined = Vec::with_capacity(follows.len());
        let mut joined_follows: Vec<bool> = Vec::new();
        let mut is_first = false;
        for &goes_on in follows {
            is_first = !(goes_on && is_first);
            if is_first {
                joined_follows.push(goes_on);
            }
            joined.push(joined_follows.len() - 1);
        }
        (joined, joined_follows)
    }

    /// Sums of a value over the samples of every block, in the order of samples.
    #[must_use]
    pub fn sums(&self, values: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let mut sums = vec![0.0; self.count()];
        for (&block, value) in self.of_sample.iter().zip(values) {
            sums[block] += value;
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_last_fifteen_seconds_and_never_span_a_gap_or_two_series() {
        // Two series at 1 Hz; the first pauses for 100 s after 40 samples.
        let mut t_s: Vec<f64> = (0..40).map(f64::from).collect();
        t_s.extend((0..20).map(|i| 140.0 + f64::from(i)));
        t_s.extend((0..50).map(f64::from));
        let series: Vec<usize> = (0..110).map(|i| usize::from(i >= 60)).collect();
        let sequence = Sequence::new(&t_s, &series);
        assert_eq!(sequence.typical_step_s, 1.0);
        let blocks = Blocks::new(&sequence, &t_s);
        // 40 s: 2 of 20; 20 s: 1; 50 s: 3.
        assert_eq!(blocks.follows, [false, true, false, false, true, true]);
        assert_eq!(blocks.sums(vec![1.0; 110])[..3], [20.0, 20.0, 20.0]);
        for block in 0..blocks.count() {
            let times: Vec<f64> = (0..110)
                .filter(|&i| blocks.of_sample[i] == block)
                .map(|i| t_s[i])
                .collect();
            assert!(times.len() >= 15);
            assert!(times.last().unwrap_or(&0.0) - times[0] < 30.0);
        }
    }

    #[test]
    fn slow_sampling_makes_blocks_of_eight_steps() {
        let t_s: Vec<f64> = (0..64).map(|i| f64::from(i) * 5.0).collect();
        let blocks = Blocks::new(&Sequence::new(&t_s, &[0; 64]), &t_s);
        assert_eq!(blocks.count(), 8);
    }

    #[test]
    fn pairs_join_neighbours_only() {
        let (joined, follows) = Blocks::pairs(&[false, true, true, false, true, true, true, false]);
        assert_eq!(joined, [0, 0, 1, 2, 2, 3, 3, 4]);
        assert_eq!(follows, [false, true, false, true, false]);
    }

    #[test]
    fn large_values_that_follow_one_another_are_told_from_such_that_do_not() {
        let random = &mut crate::statistics::draws::Draws::new(1);
        let t_s: Vec<f64> = (0..2000).map(f64::from).collect();
        let sequence = Sequence::new(&t_s, &[0; 2000]);
        // A hundred nulls, a third of whose values are wild: three standard errors are passed once
        // in 740 of a normal law.
        let mut alarms = 0;
        for _ in 0..100 {
            let wild: Vec<f64> = (0..2000).map(|_| random.within(1.55).tan()).collect();
            alarms += usize::from(large_follow_large(&sequence, &wild, &[1.0; 2000]));
        }
        assert!(alarms <= 1, "{alarms}");
        let size = |i: usize| if (i / 50).is_multiple_of(4) { 4.0 } else { 1.0 };
        let gusty: Vec<f64> = (0..2000).map(|i| size(i) * random.normal()).collect();
        assert!(large_follow_large(&sequence, &gusty, &[1.0; 2000]));
    }

    #[test]
    fn samples_may_come_in_any_order() {
        let t_s = [3.0, 1.0, 2.0, 0.0];
        let sequence = Sequence::new(&t_s, &[0; 4]);
        assert_eq!(sequence.order, [3, 1, 2, 0]);
        assert_eq!(sequence.previous, [Some(2), Some(3), Some(1), None]);
    }
}
