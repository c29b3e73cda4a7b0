//! How far the readings of one recording scatter where nothing is missing: the yardstick for
//! everything else.

use crate::forward::observed::{Explained, Observed};
use crate::forward::simulate::Channel;
use crate::statistics::noise::{Noise, NoiseModel, Whitener, estimate};
use crate::statistics::quantile::{difference, root_mean_square};
use crate::statistics::sequence::{Blocks, Sequence};
use crate::statistics::simultaneous::err_together;

/// The scatter of the samples around a simulation, one value a sample in the channel's unit.
#[must_use]
pub fn noise(observed: &Observed, simulated: &[f64]) -> Noise {
    let times_s = observed.times_s();
    let sequence = Sequence::new(&times_s, &observed.series_of);
    let recorded = observed.recorded();
    let residual = difference(&recorded, simulated);
    // What the scatter grows with: the speed, or how much a throttle has to do with air at all.
    let flow: Vec<f64> = match observed.channel {
        Channel::Throttle | Channel::Power => {
            simulated.iter().map(|f| (f - 1.0).max(0.0)).collect()
        }
        _ => simulated.to_vec(),
    };
    let probes = observed.recording.probes.as_ref();
    let resolution = probes.map_or(1e-3, |probes| probes.instrument.resolution_mps);
    // Rounding alone: a uniform error of one step.
    let least_s0 = (resolution / 12.0_f64.sqrt()).max(1e-6);
    // With too few neighbours to tell, the residual's own spread.
    let spread = NoiseModel::white(root_mean_square(&residual).max(least_s0));
    let model = estimate(&sequence, &residual, &flow, least_s0).unwrap_or(spread);
    let whitener = Whitener::new(&model, &sequence, &flow);
    // A block is what counts as one witness, is held out as one, and has one sign in a flip. Series
    // that err together (probes of a rake in one gust) are told by each other: in blocks of their
    // own, what is held out of one is known from another, and N of them pass for N witnesses.
    let scattered = [&times_s, &flow, &residual, whitener.sd()];
    let blocks = match err_together(&sequence, &observed.series_of, scattered) {
        true => Blocks::across(&sequence, &times_s),
        false => Blocks::new(&sequence, &times_s),
    };
    Noise { whitener, blocks }
}
