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

use super::forces::Forces;
use crate::forward::observed::Explained;
use crate::statistics::noise::{Noise, NoiseModel, Whitener};
use crate::statistics::quantile::median;
use crate::statistics::sequence::{Blocks, Sequence};

/// Most that one flight's offset may be (N): a gram.
pub(super) const MOST_OFFSET_N: f64 = 0.0098;
/// Least, where flights happen to agree (N).
const LEAST_OFFSET_N: f64 = 0.001;
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
}

/// The scatter around a simulation, which is given at every step of every part; steps are `step_s`
/// apart.
pub(super) fn scatter(forces: &Forces, simulated_n: &[Vec<f64>], step_s: f64) -> Scatter {
    let still = still(forces, simulated_n);
    let parts = forces.parts.iter().enumerate();
    let series: Vec<usize> = parts
        .flat_map(|(index, part)| part.judged.iter().map(move |_| index))
        .collect();
    let block: Vec<usize> = forces.judged().map(|(part, _)| part.flight).collect();
    let simulated_judged_n = forces.at_judged(simulated_n);
    let flow: Vec<f64> = simulated_judged_n.iter().map(|n| n.abs()).collect();
    let both = forces.judged().zip(&simulated_judged_n);
    let rest: Vec<f64> = both.map(|((_, step), n)| step.recorded_n - n).collect();
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
    offset_n: f64,
}

/// What steps in still air say.
fn still(forces: &Forces, simulated_n: &[Vec<f64>]) -> Still {
    let mut rests: Vec<f64> = Vec::new();
    let mut offsets: Vec<(f64, f64)> = Vec::new();
    let (mut product, mut square) = (0.0, 0.0);
    for (part, simulated_n) in forces.parts.iter().zip(simulated_n) {
        let rest = |at: usize| part.steps[at].recorded_n - simulated_n[at];
        let all = 0..part.steps.len();
        let free: Vec<usize> = all.filter(|&at| part.steps[at].is_free).collect();
        // Ten seconds: less says little about a flight's offset.
        if free.len() < 100 {
            continue;
        }
        let mean = free.iter().map(|&at| rest(at)).sum::<f64>() / free.len() as f64;
        offsets.push((mean, free.len() as f64));
        rests.extend(free.iter().map(|&at| (rest(at) - mean).abs()));
        for pair in free.windows(2) {
            if pair[1] == pair[0] + 1 {
                let (a, b) = (rest(pair[0]) - mean, rest(pair[1]) - mean);
                product += a * b;
                square += 0.5 * (a * a + b * b);
            }
        }
    }
    let offset_n2 = offsets.iter().map(|(mean, _)| mean * mean).sum::<f64>();
    let offset_n = (offset_n2 / offsets.len().max(1) as f64).sqrt();
    // A tenth of a gram: no instrument of these flights knows better.
    let sd_n = median(&mut rests).map_or(0.01, |median| MAD * median);
    Still {
        sd_n: sd_n.max(0.001),
        memory: (product / square.max(f64::MIN_POSITIVE)).clamp(0.0, 0.95),
        offset_n: offset_n.clamp(LEAST_OFFSET_N, MOST_OFFSET_N),
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
        let steps = || part.judged.iter().map(|&at| &part.steps[at]);
        let mean_n = steps().map(|step| step.thrust_n).sum::<f64>() / count as f64;
        let [first_s, last_s] = [0, count - 1].map(|at| part.steps[part.judged[at]].t_s);
        let span_s = (last_s - first_s).max(1.0);
        let slope = steps().map(|step| SLOPE * (step.thrust_n - mean_n));
        let drift = steps().map(|step| offset_n * ((step.t_s - first_s) / span_s - 0.5));
        for pattern in [vec![offset_n; count], slope.collect(), drift.collect()] {
            whitener.share(from, &pattern);
        }
        from += count;
    }
}
