//! Errors on held-out blocks, candidates side by side, and the smallest effects that would have shown.

use crate::forward::hypothesis::Hypothesis;
use crate::infer::candidates::Candidate;
use crate::infer::finding::{HeldOut, Ranked, Smallest};
use crate::infer::fit::{Fit, Setting, refit_without};
use crate::infer::noise::Noise;
use crate::infer::outside::Shape;
use crate::infer::select::{FOLDS, Selection};
use crate::statistics::draws::Draws;

/// Errors on blocks by turns left out of the fit.
pub(super) fn held_out(
    setting: &Setting,
    members: &[&Candidate],
    selection: &Selection,
    shape: Option<&Shape>,
    noise: &Noise,
) -> HeldOut {
    let squares = |setting: &Setting, members: &[&Candidate], fit: &Fit| {
        let recorded = setting.observed.recorded();
        let mut squares = vec![0.0; recorded.len()];
        for fold in 0..FOLDS {
            let predicted = refit_without(setting, members, fit, fold, FOLDS);
            for i in 0..recorded.len() {
                if noise.block[i] % FOLDS == fold {
                    squares[i] = (recorded[i] - predicted[i]).powi(2);
                }
            }
        }
        squares
    };
    let rms = |squares: &[f64]| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    // Before: without what throttle and power have answered already.
    let mut plain = setting.clone();
    plain.base = Hypothesis::default();
    let before = squares(&plain, &[], &plain.nothing());
    let after = match shape {
        // The trees' corrections are held out themselves; what they lie on is a handful of parameters.
        Some(shape) => shape.left.iter().map(|left| left * left).collect(),
        None => squares(setting, members, &selection.chosen.fit),
    };
    let mut blocks = vec![(0.0, 0.0); noise.blocks];
    for (square, &block) in after.iter().zip(&noise.block) {
        blocks[block].0 += square;
        blocks[block].1 += 1.0;
    }
    // Blocks drawn with replacement; 200 are enough for two digits of a 95 % interval.
    let mut random = Draws::new(noise.blocks as u64);
    let mut drawn: Vec<f64> = (0..200)
        .map(|_| {
            let picked = (0..blocks.len()).map(|_| blocks[random.index(blocks.len())]);
            let (sum, count) = picked.fold((0.0, 0.0), |(s, c), (a, b)| (s + a, c + b));
            (sum / f64::max(count, 1.0)).sqrt()
        })
        .collect();
    drawn.sort_by(f64::total_cmp);
    let variances: Vec<f64> = noise.sd.iter().map(|sd| sd * sd).collect();
    HeldOut {
        rms_before: rms(&before),
        rms_after: rms(&after),
        rms_after_low: drawn[4],
        rms_after_high: drawn[195],
        noise_floor: rms(&variances),
    }
}

pub(crate) fn ranked(candidates: &[Candidate], selection: &Selection) -> Vec<Ranked> {
    let of = |tried: &crate::infer::select::Tried| {
        let candidate = &candidates[tried.which[0]];
        let names = candidate
            .parameters
            .iter()
            .map(|parameter| parameter.name.to_owned());
        Ranked {
            name: candidate.name.into(),
            gain: tried.gain.total,
            gain_error: tried.gain.error,
            practical: tried.practical,
            parameters: names.zip(tried.fit.values.iter().copied()).collect(),
        }
    };
    selection.singles.iter().map(of).collect()
}

/// Minimal departures that this recording would have shown: 80 % power at 5 %.
pub(crate) fn smallest(
    setting: &Setting,
    candidates: &[Candidate],
    noise: &Noise,
) -> Vec<Smallest> {
    let clean = setting.observed.predict(&setting.base);
    candidates
        .iter()
        .filter_map(|candidate| {
            let parameter = candidate.parameters.first()?;
            let mut values = candidate.starts.first()?.clone();
            let step = values[0] - parameter.neutral;
            let changed = setting
                .observed
                .predict(&candidate.on(&setting.base, &values));
            values[0] = parameter.neutral;
            let change: Vec<f64> = changed
                .iter()
                .zip(&clean)
                .map(|(to, from)| (to - from) / step)
                .collect();
            let square: f64 = noise.whiten(&change).iter().map(|g| g * g).sum();
            (square > 0.0).then(|| Smallest {
                name: candidate.name.into(),
                parameter: parameter.name.into(),
                departure: (1.96 + 0.84) / square.sqrt(),
                unit: parameter.unit.into(),
            })
        })
        .collect()
}
