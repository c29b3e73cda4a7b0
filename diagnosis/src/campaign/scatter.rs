//! The noise of recorded forces where nothing is missing, and what all rows of one flight share.
//!
//! ```text
//! σ² = σ₀² + σ₁² F²,     k = ρ^Δ  between rows Δ steps apart,     plus for each vehicle in each flight:
//! an offset ~ N(0, s²),  a thrust map too steep by N(0, (2.5 %)²),  a drift over the flight ~ N(0, (s/2)²)
//! ```
//!
//! `σ₀`, `ρ` and `s` come from steps with no drone above and the floor far away; `σ₁` from how much
//! more a row surprises where the simulated force is large. What a flight shares is in the
//! covariance, so that no effect is credited with a weak battery or a bent propeller, and no flight
//! counts as hundreds of witnesses.

use super::forces::{Forces, VehicleFlight};
use crate::forward::observed::Explained;
use crate::infer::intervals::NINETY_FIVE;
use crate::statistics::noise::{Noise, NoiseModel, Whitener};
use crate::statistics::quantile::median;
use crate::statistics::sequence::{Blocks, Sequence};
use crate::statistics::tail;

/// Most that one flight's offset may be, of the weight of the heaviest drone: a gram of a
/// Crazyflie's 34. Chosen here.
const MOST_OFFSET_OF_WEIGHT: f64 = 1.0 / 34.0;
/// Least, where flights happen to agree (N).
pub const LEAST_OFFSET_N: f64 = 0.001;
/// p-value (Student's t of the flights' own offsets) from which all flights share one. Chosen here:
/// a tenth of what is asked of any finding, for drones of one flight may share theirs.
const SHARED_P: f64 = 1e-4;
/// How far the thrust map's slope may be off in one flight. Chosen here: what a changed propeller
/// or pack is worth.
const SLOPE: f64 = 0.025;
/// A median absolute deviation over a normal's standard deviation.
const MAD: f64 = 1.4826;

/// The scatter of a campaign's forces, and what it was worked out from.
#[derive(Clone, Debug)]
pub(super) struct Scatter {
    /// For the fits; blocks are whole flights.
    pub(super) noise: Noise,
    /// `s` (N).
    pub(super) offset_n: f64,
    /// Most that it may be (N).
    most_n: f64,
    /// Whether all flights share an offset.
    is_shared: bool,
}

impl Scatter {
    /// How far one flight's offset may be from 0 without a fault (N): so much of the weight, and
    /// where all share one, that is none of a flight's own, by 95 % of a normal law at most.
    pub(super) fn most_offset_n(&self) -> f64 {
        match self.is_shared {
            true => (NINETY_FIVE * self.offset_n).min(self.most_n),
            false => self.most_n,
        }
    }
}

/// Weight of the heaviest drone (N).
pub(super) fn heaviest_n(forces: &Forces) -> f64 {
    let weight_n = |part: &VehicleFlight| {
        let of = &forces.recordings[part.recording];
        of.vehicles[part.vehicle].airframe.mass_kg() * of.environment.gravity_mps2
    };
    forces.parts.iter().map(weight_n).fold(0.0, f64::max)
}

/// [`MOST_OFFSET_OF_WEIGHT`] (N).
fn most_offset_n(forces: &Forces) -> f64 {
    (MOST_OFFSET_OF_WEIGHT * heaviest_n(forces)).max(LEAST_OFFSET_N)
}

/// The scatter around a simulation, which is given at every moment of every part; steps are
/// `step_s` apart.
pub(super) fn scatter(forces: &Forces, simulated_n: &[Vec<f64>], step_s: f64) -> Scatter {
    let still = still(forces, simulated_n);
    let parts = forces.parts.iter().enumerate();
    let series: Vec<usize> = parts
        .flat_map(|(index, part)| part.judged.iter().map(move |_| index))
        .collect();
    let block: Vec<usize> = forces.judged().map(|(part, _)| part.flight).collect();
    let simulated_judged_n = forces.at_judged(simulated_n);
    let flow: Vec<f64> = simulated_judged_n.iter().map(|n| n.abs()).collect();
    // A part's own offset is in the covariance below, and no surprise of any row.
    let offsets_n = still.of_parts_n.iter().zip(&forces.parts);
    let offsets_n = offsets_n.flat_map(|(n, part)| part.judged.iter().map(move |_| n));
    let both = forces.judged().zip(&simulated_judged_n).zip(offsets_n);
    let rest: Vec<f64> = both
        .map(|(((_, step), n), offset_n)| step.recorded_n - n - offset_n)
        .collect();
    let sequence = Sequence::new(&forces.times_s(), &series);
    let mut model = NoiseModel {
        s0: still.sd_n,
        memory_s: -step_s / still.memory.ln(),
        ..NoiseModel::white(0.0)
    };
    model.s1 = per_force(&model, &sequence, &flow, &rest);
    let mut whitener = Whitener::new(&model, &sequence, &flow);
    share(forces, &mut whitener, still.offset_n);
    let blocks = Blocks {
        follows: vec![false; block.iter().max().map_or(0, |last| last + 1)],
        of_sample: block,
    };
    Scatter {
        noise: Noise { whitener, blocks },
        offset_n: still.offset_n,
        most_n: most_offset_n(forces),
        is_shared: still.is_shared,
    }
}

/// `σ₁`: how much more a row surprises where the simulated force is large.
fn per_force(still: &NoiseModel, sequence: &Sequence, flow: &[f64], rest: &[f64]) -> f64 {
    let surprises = Whitener::new(still, sequence, &vec![0.0; flow.len()]).whiten(rest);
    let large: Vec<usize> = (0..flow.len())
        .filter(|&i| sequence.previous[i].is_some() && flow[i] > 2.0 * still.s0)
        .collect();
    // A hundred surprises tell their spread to 10 %.
    if large.len() < 100 {
        return 0.0;
    }
    let mut sizes: Vec<f64> = large.iter().map(|&i| surprises[i].abs()).collect();
    let spread_n = MAD * median(&mut sizes).unwrap_or(0.0) * still.s0;
    let more_n2 = (spread_n * spread_n - still.s0 * still.s0).max(0.0);
    let square_n2: f64 = large.iter().map(|&i| flow[i] * flow[i]).sum();
    (more_n2 * large.len() as f64 / square_n2).sqrt()
}

struct Still {
    sd_n: f64,
    memory: f64,
    /// How far flights' offsets scatter: about 0, or about what they share, where they do, which is
    /// a fault of its own.
    offset_n: f64,
    is_shared: bool,
    /// Of each part, its offset; that of all where it has too little still air.
    of_parts_n: Vec<f64>,
}

/// What steps in still air say.
fn still(forces: &Forces, simulated_n: &[Vec<f64>]) -> Still {
    let mut rests: Vec<f64> = Vec::new();
    let mut means_n: Vec<Option<f64>> = Vec::new();
    let (mut product, mut square) = (0.0, 0.0);
    for (part, simulated_n) in forces.parts.iter().zip(simulated_n) {
        let of = |step: usize| part.steps[step];
        let rest = |step: usize| part.moments[of(step)].recorded_n - simulated_n[of(step)];
        let all = 0..part.steps.len();
        let free: Vec<usize> = all.filter(|&k| part.moments[of(k)].is_free).collect();
        // Ten seconds: less says little about a flight's offset.
        if free.len() < 100 {
            means_n.push(None);
            continue;
        }
        let mean = free.iter().map(|&k| rest(k)).sum::<f64>() / free.len() as f64;
        means_n.push(Some(mean));
        rests.extend(free.iter().map(|&k| (rest(k) - mean).abs()));
        for pair in free.windows(2) {
            if pair[1] == pair[0] + 1 {
                let (a, b) = (rest(pair[0]) - mean, rest(pair[1]) - mean);
                product += a * b;
                square += 0.5 * (a * a + b * b);
            }
        }
    }
    let known_n = || means_n.iter().flatten();
    let count = known_n().count() as f64;
    let mean_n = known_n().sum::<f64>() / count.max(1.0);
    let spread_n = |about_n: f64, freedom: f64| {
        let squares_n2: f64 = known_n().map(|mean| (mean - about_n).powi(2)).sum();
        (squares_n2 / freedom.max(1.0)).sqrt()
    };
    let about_mean_n = spread_n(mean_n, count - 1.0).max(LEAST_OFFSET_N);
    let t = mean_n * count.sqrt() / about_mean_n;
    let is_shared = count > 1.0 && tail::student_two_sided(t, count - 1.0) < SHARED_P;
    let (shared_n, offset_n) = match is_shared {
        true => (mean_n, about_mean_n),
        false => (0.0, spread_n(0.0, count)),
    };
    // A tenth of a gram: no instrument of these flights knows better.
    let sd_n = median(&mut rests).map_or(0.01, |median| MAD * median);
    Still {
        sd_n: sd_n.max(0.001),
        memory: (product / square.max(f64::MIN_POSITIVE)).clamp(0.0, 0.95),
        offset_n: offset_n.clamp(LEAST_OFFSET_N, most_offset_n(forces)),
        is_shared,
        of_parts_n: means_n.into_iter().map(|n| n.unwrap_or(shared_n)).collect(),
    }
}

/// Offset, slope and drift of every part.
fn share(forces: &Forces, whitener: &mut Whitener, offset_n: f64) {
    let mut from = 0;
    for part in &forces.parts {
        let count = part.judged.len();
        if count == 0 {
            continue;
        }
        let steps = || part.judged.iter().map(|&at| &part.moments[at]);
        let mean_n = steps().map(|step| step.smooth_n).sum::<f64>() / count as f64;
        let [first_s, last_s] = [0, count - 1].map(|at| part.moments[part.judged[at]].t_s);
        let span_s = (last_s - first_s).max(1.0);
        let slope = steps().map(|step| SLOPE * (step.smooth_n - mean_n));
        let drift = steps().map(|step| offset_n * ((step.t_s - first_s) / span_s - 0.5));
        for pattern in [vec![offset_n; count], slope.collect(), drift.collect()] {
            whitener.share(from, &pattern);
        }
        from += count;
    }
}
