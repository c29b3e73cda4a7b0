//! Where baseline and corrected simulation differ.

use std::collections::BTreeMap;

use crate::forward::observed::{COVARIATES, Observed};
use crate::infer::finding::Region;
use crate::infer::noise::Noise;

/// Where baseline and corrected simulation differ by more than half a standard deviation.
pub(super) fn region(observed: &Observed, noise: &Noise, corrected: &[f64]) -> Region {
    let inside: Vec<usize> = (0..corrected.len())
        .filter(|&i| (corrected[i] - observed.samples[i].simulated).abs() > 0.5 * noise.sd[i])
        .collect();
    if inside.is_empty() {
        return Region::default();
    }
    let count = inside.len() as f64;
    let error = |i: usize| observed.samples[i].residual();
    let mean_error = inside.iter().map(|&i| error(i)).sum::<f64>() / count;
    let recorded = inside
        .iter()
        .map(|&i| observed.samples[i].recorded)
        .sum::<f64>()
        / count;
    let square = inside
        .iter()
        .map(|&i| (error(i) / noise.sd[i]).powi(2))
        .sum::<f64>()
        / count;
    let mut bounds = BTreeMap::new();
    let mut narrow: Vec<(f64, String)> = Vec::new();
    for (name, column) in COVARIATES.iter().zip(&observed.covariates) {
        let within = span(inside.iter().map(|&i| column[i]).collect(), 0.05);
        let whole = span(column.clone(), 0.02);
        let part = (within[1] - within[0]) / (whole[1] - whole[0]);
        // A coordinate that the region covers as widely as the recording says nothing about it.
        if part < 0.7 {
            bounds.insert((*name).to_owned(), within);
            narrow.push((part, format!("{name} {:.2} to {:.2}", within[0], within[1])));
        }
    }
    narrow.sort_by(|a, b| a.0.total_cmp(&b.0));
    let words: Vec<String> = narrow
        .into_iter()
        .take(SAID)
        .map(|(_, text)| text)
        .collect();
    let mut sample_indices: Vec<usize> = inside.iter().map(|&i| observed.samples[i].row).collect();
    sample_indices.sort_unstable();
    Region {
        description: if words.is_empty() {
            "everywhere".into()
        } else {
            words.join(", ")
        },
        bounds,
        sample_indices,
        share: count / corrected.len() as f64,
        mean_error,
        relative_error: mean_error / recorded,
        error_over_noise: square.sqrt(),
    }
}

/// Coordinates that a region is described by: those that narrow it most.
const SAID: usize = 3;

/// The values without so much at either end.
fn span(mut values: Vec<f64>, tail: f64) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    let at = |share: f64| {
        values
            .get((share * last as f64).round() as usize)
            .copied()
            .unwrap_or(0.0)
    };
    [at(tail), at(1.0 - tail)]
}
