//! How far readings scatter where nothing is missing: the yardstick for everything else.

use crate::observed::Observed;

/// Standard deviations of the samples, and how much of one reading's error is in the next.
#[derive(Clone, Debug)]
pub struct Noise {
    /// One for each sample, in the channel's unit.
    pub sd: Vec<f64>,
    /// Correlation with the sample before it; 0 at the beginning of a series and after a gap.
    pub with_before: Vec<f64>,
    /// Block of each sample: neighbours in time, too far from other blocks to share their errors.
    pub block: Vec<usize>,
    /// How many blocks.
    pub blocks: usize,
    /// What samples share beyond their neighbours, in the order in which it is taken out.
    pub shared: Vec<Shared>,
}

/// A pattern of unknown size that runs through a stretch of samples: an offset of one flight, a map that is a little too steep.
///
/// Its size is normal with mean 0, so it adds `a aᵀ` to the covariance (`a`: the pattern times its standard deviation, whitened by what
/// came before), and whitening takes out of every vector most of what lies along `a`.
#[derive(Clone, Debug)]
pub struct Shared {
    /// First sample.
    pub from: usize,
    /// `a`.
    pub pattern: Vec<f64>,
}

impl Shared {
    /// Takes it out of whitened values.
    ///
    /// ```text
    /// (1 + a aᵀ)^(-1/2) = 1 - k a aᵀ,   k = (1 - 1/√(1 + a²))/a²
    /// ```
    pub fn take_out(&self, whitened: &mut [f64]) {
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

impl Noise {
    /// Values over their scatter, with what neighbours share taken out: independent and of size 1 where nothing is missing.
    #[must_use]
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        let mut white = self.without_memory(values, 0, values.len());
        for shared in &self.shared {
            shared.take_out(&mut white);
        }
        white
    }

    /// A pattern over some samples, whitened with what is shared so far.
    pub(crate) fn whiten_stretch(&self, values: &[f64], from: usize) -> Vec<f64> {
        let mut white = vec![0.0; from];
        white.extend(self.without_memory(values, from, values.len()));
        for shared in self.shared.iter().filter(|shared| shared.from == from) {
            shared.take_out(&mut white);
        }
        white.split_off(from)
    }

    /// Values of `count` samples over their scatter, what each remembers of the one before taken off.
    fn without_memory(&self, values: &[f64], from: usize, count: usize) -> Vec<f64> {
        let scaled = |i: usize| values[i - from] / self.sd[i];
        (from..from + count)
            .map(|i| {
                let rho = self.with_before[i];
                if rho == 0.0 || i == from {
                    scaled(i)
                } else {
                    (scaled(i) - rho * scaled(i - 1)) / (1.0 - rho * rho).sqrt()
                }
            })
            .collect()
    }
}

/// Length of a block (s), and in sampling steps. Chosen here: several dwells, or several eddies.
const BLOCK_S: f64 = 15.0;
const BLOCK_STEPS: f64 = 8.0;

/// The scatter of the samples around a simulation, from differences of successive residuals where the simulated air is flat.
#[must_use]
pub fn noise(observed: &Observed, simulated: &[f64]) -> Noise {
    let count = observed.samples.len();
    let times_s = observed.times_s();
    let residual: Vec<f64> = observed
        .samples
        .iter()
        .zip(simulated)
        .map(|(sample, simulated)| sample.recorded - simulated)
        .collect();
    let mut steps: Vec<f64> = (1..count)
        .filter(|&i| observed.series_of[i] == observed.series_of[i - 1])
        .map(|i| times_s[i] - times_s[i - 1])
        .collect();
    steps.sort_by(f64::total_cmp);
    let step_s = steps.get(steps.len() / 2).copied().unwrap_or(1.0);
    let follows = |i: usize| {
        i > 0
            && observed.series_of[i] == observed.series_of[i - 1]
            && times_s[i] - times_s[i - 1] < 2.5 * step_s
    };
    // Pairs at nearly the same place in the jet: what differs between them is noise, whatever else is missing.
    let place = |i: usize| {
        observed.samples[i]
            .place
            .map(|place| (place.s_over_l, place.r_over_l))
    };
    let still = |i: usize, most: f64| {
        follows(i)
            && match (place(i - 1), place(i)) {
                (Some((s, r)), Some((s_next, r_next))) => (s - s_next).hypot(r - r_next) < most,
                (a, b) => a.is_none() && b.is_none(),
            }
    };
    let enough = |most: f64| 4 * (1..count).filter(|&i| still(i, most)).count() > count;
    // A drone in flight is never at the same place twice: then successive residuals must do.
    let most = [0.1, 0.3, 1.0]
        .into_iter()
        .find(|&most| enough(most))
        .unwrap_or(f64::INFINITY);
    let flat = |i: usize| still(i, most);
    let mut pairs: Vec<(f64, f64)> = (1..count)
        .filter(|&i| flat(i))
        .map(|i| {
            let level = 0.5 * (simulated[i] + simulated[i - 1]);
            (level, residual[i] - residual[i - 1])
        })
        .collect();
    let resolution = observed
        .recording
        .probes
        .as_ref()
        .map_or(1e-3, |probes| probes.instrument.resolution_mps);
    let least = 0.3 * resolution.max(1e-4);
    // Correlation of successive differences: -1/2 for white noise, 1 + 2 c of an AR(1) is its coefficient.
    let doubles: Vec<(f64, f64)> = (2..count)
        .filter(|&i| flat(i) && flat(i - 1))
        .map(|i| {
            (
                residual[i] - residual[i - 1],
                residual[i - 1] - residual[i - 2],
            )
        })
        .collect();
    let limit = 4.0 * median(pairs.iter().map(|(_, d)| d.abs()).collect()).max(least);
    let kept = doubles
        .iter()
        .filter(|(a, b)| a.abs() < limit && b.abs() < limit);
    let (product, square) = kept.fold((0.0, 0.0), |(p, s), (a, b)| {
        (p + a * b, s + 0.5 * (a * a + b * b))
    });
    let rho = if square > 0.0 {
        (1.0 + 2.0 * product / square).clamp(0.0, 0.9)
    } else {
        0.0
    };
    // sd² = s0² + s1² U², from medians of |difference| in groups by level.
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let groups = (pairs.len() / 25).clamp(1, 12);
    let (mut levels, mut variances) = (Vec::new(), Vec::new());
    for group in pairs.chunks(pairs.len().div_ceil(groups).max(1)) {
        let spread = 1.4826 * median(group.iter().map(|(_, d)| d.abs()).collect());
        let mean_square = group.iter().map(|(u, _)| u * u).sum::<f64>() / group.len() as f64;
        levels.push(mean_square);
        variances.push((spread * spread / (2.0 * (1.0 - rho))).max(least * least));
    }
    let (s0_2, s1_2) = line_through(&levels, &variances, least * least);
    let sd = simulated
        .iter()
        .map(|u| (s0_2 + s1_2 * u * u).sqrt())
        .collect();
    let length_s = BLOCK_S.max(BLOCK_STEPS * step_s);
    let mut block = vec![0; count];
    let mut began_s = times_s.first().copied().unwrap_or(0.0);
    for i in 1..count {
        let new_series = observed.series_of[i] != observed.series_of[i - 1];
        let new = new_series || times_s[i] - began_s >= length_s;
        block[i] = block[i - 1] + usize::from(new);
        if new {
            began_s = times_s[i];
        }
    }
    Noise {
        sd,
        with_before: (0..count)
            .map(|i| if follows(i) { rho } else { 0.0 })
            .collect(),
        blocks: block.last().map_or(0, |last| last + 1),
        block,
        shared: Vec::new(),
    }
}

/// `v = a + b x` with `a`, `b` not negative and `a` at least `least`, by the medians of slopes.
fn line_through(x: &[f64], v: &[f64], least: f64) -> (f64, f64) {
    let mut slopes = Vec::new();
    for i in 0..x.len() {
        for j in 0..i {
            if (x[i] - x[j]).abs() > 1e-12 {
                slopes.push((v[i] - v[j]) / (x[i] - x[j]));
            }
        }
    }
    let slope = if slopes.is_empty() {
        0.0
    } else {
        median(slopes).max(0.0)
    };
    let rests: Vec<f64> = x.iter().zip(v).map(|(x, v)| v - slope * x).collect();
    let level = if rests.is_empty() {
        least
    } else {
        median(rests)
    };
    (level.max(least), slope)
}

/// The middle of some values; 0 of none.
fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
