//! How far readings scatter where nothing is missing: the yardstick for everything else.

use crate::forward::observed::{Explained, Observed};
use crate::forward::simulate::Channel;
use crate::statistics::noise::{Bounds, NoiseModel, Whitener, estimate};
use crate::statistics::sequence::{Blocks, Sequence};

/// Standard deviations of the samples, how much of one reading's error is in the next, and which belong together.
#[derive(Clone, Debug)]
pub struct Noise {
    /// One for each sample, in the channel's unit.
    pub sd: Vec<f64>,
    /// Block of each sample: neighbours in time, too far from other blocks to share their errors.
    pub block: Vec<usize>,
    /// How many blocks.
    pub blocks: usize,
    /// Takes scale and memory off.
    pub whitener: Whitener,
    /// The blocks, with who follows whom.
    pub sequence_blocks: Blocks,
}

impl Noise {
    /// Values over their scatter, with what neighbours share taken out: independent and of size 1 where nothing is missing.
    #[must_use]
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        self.whitener.whiten(values)
    }
}

/// The scatter of the samples around a simulation.
#[must_use]
pub fn noise(observed: &Observed, simulated: &[f64]) -> Noise {
    let times_s = observed.times_s();
    let sequence = Sequence::new(&times_s, &observed.series_of);
    let recorded = observed.recorded();
    let residual: Vec<f64> = recorded.iter().zip(simulated).map(|(y, f)| y - f).collect();
    // What the scatter grows with: the speed, or how much a throttle has to do with air at all.
    let flow: Vec<f64> = match observed.channel {
        Channel::Throttle | Channel::Power => {
            simulated.iter().map(|f| (f - 1.0).max(0.0)).collect()
        }
        _ => simulated.to_vec(),
    };
    let resolution = observed
        .recording
        .probes
        .as_ref()
        .map_or(1e-3, |probes| probes.instrument.resolution_mps);
    let bounds = Bounds {
        // Rounding alone: a uniform error of one step.
        least_s0: (resolution / 12.0_f64.sqrt()).max(1e-6),
        ..Bounds::default()
    };
    let model =
        estimate(&sequence, &residual, &flow, bounds).unwrap_or_else(|| overall(&residual, bounds));
    let blocks = Blocks::new(&sequence, &times_s);
    let whitener = Whitener::new(&model, &sequence, &flow);
    Noise {
        sd: whitener.sd().to_vec(),
        block: blocks.of_sample.clone(),
        blocks: blocks.count(),
        whitener,
        sequence_blocks: blocks,
    }
}

/// Too few neighbours to tell: the residual's own spread.
fn overall(residual: &[f64], bounds: Bounds) -> NoiseModel {
    let square = residual.iter().map(|r| r * r).sum::<f64>() / residual.len().max(1) as f64;
    NoiseModel {
        s0: square.sqrt().max(bounds.least_s0),
        s1: 0.0,
        rho: 0.0,
        step_s: 1.0,
    }
}
