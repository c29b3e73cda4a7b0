//! Shapes that a residual is tested against: tangents of laws, steps in time, bins of covariates.

use std::ops::Range;

use super::noise::Whitener;
use super::quantile::{interval_of, quantile_edges};

/// A shape, one value a sample, in the residual's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Whether it is a law (how a candidate's prediction changes, a step in time) rather than a bin
    /// of a covariate: the global lack-of-fit test refers the two to their own largest scores.
    pub is_law: bool,
    /// Of every sample.
    pub values: Vec<f64>,
}

/// Bins of a covariate.
const BINS: usize = 8;
/// Parts of it, of which the outermost are regions of their own.
const TAILS: usize = 32;
/// Parts of it between which it is cut in two.
const QUARTERS: usize = 4;
/// Samples that a bin or either side of a step needs. Chosen here: fewer are an accident, not a
/// region.
const LEAST_SAMPLES: usize = 5;

/// Regions of covariates, each of which has a value for every sample (NaN where it has none: no
/// drone above): eight bins of equal count, the outermost thirty-seconds, where rare regimes are,
/// and all below and all above each quarter.
///
/// Within a region the column is `amplitude` (the noise's standard deviation, say, or the flow; one
/// for every sample), outside it is 0. Regions of fewer than five samples, and those of all
/// samples, are left out.
#[must_use]
pub fn bins(covariates: &[Vec<f64>], amplitude: &[f64]) -> Vec<Column> {
    let mut columns = Vec::new();
    for values in covariates {
        let edges = quantile_edges(values, BINS);
        let ends = quantile_edges(values, TAILS);
        let quarters = quantile_edges(values, QUARTERS);
        let parts = edges.len().saturating_sub(1);
        let mut places: Vec<(&[f64], Range<usize>)> =
            (0..parts).map(|bin| (&edges[..], bin..bin + 1)).collect();
        // Where values are tied an end may be a whole bin: once is enough.
        if ends.len() > edges.len() {
            places.push((&ends[..], 0..1));
            places.push((&ends[..], ends.len() - 2..ends.len() - 1));
        }
        if edges.len() > quarters.len() {
            let parts = quarters.len().saturating_sub(1);
            places.extend((1..parts).map(|below| (&quarters[..], 0..below)));
            places.extend((1..parts).map(|above| (&quarters[..], above..parts)));
        }
        columns.extend(places.into_iter().filter_map(|(edges, bins)| {
            let within = |value: f64| interval_of(edges, value).is_some_and(|b| bins.contains(&b));
            let count = values.iter().filter(|v| within(**v)).count();
            let is_region = count >= LEAST_SAMPLES && count < values.len();
            is_region.then(|| Column {
                is_law: false,
                values: where_true(values, amplitude, within),
            })
        }));
    }
    columns
}

/// Steps at `count` times (s) that part the samples evenly; after each the column is `amplitude`.
#[must_use]
pub fn steps(t_s: &[f64], amplitude: &[f64], count: usize) -> Vec<Column> {
    let edges = quantile_edges(t_s, count + 1);
    let inner = edges.get(1..edges.len().saturating_sub(1)).unwrap_or(&[]);
    inner
        .iter()
        .filter(|&&from_s| t_s.iter().filter(|&&t| t < from_s).count() >= LEAST_SAMPLES)
        .map(|&from_s| Column {
            is_law: true,
            values: where_true(t_s, amplitude, |t| t >= from_s),
        })
        .collect()
}

fn where_true(values: &[f64], amplitude: &[f64], test: impl Fn(f64) -> bool) -> Vec<f64> {
    let pairs = values.iter().zip(amplitude);
    pairs
        .map(|(&value, &size)| if test(value) { size } else { 0.0 })
        .collect()
}

/// The same columns in whitened samples.
#[must_use]
pub fn whitened(columns: &[Column], whitener: &Whitener) -> Vec<Column> {
    let values: Vec<&[f64]> = columns.iter().map(|of| &of.values[..]).collect();
    let whitened = columns.iter().zip(whitener.whiten_all(&values));
    let column = |(of, values): (&Column, Vec<f64>)| Column {
        is_law: of.is_law,
        values,
    };
    whitened.map(column).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_with_a_value_lies_in_one_bin() {
        let values: Vec<f64> = (0..101)
            .map(|i| {
                if i % 10 == 0 {
                    f64::NAN
                } else {
                    f64::from(i % 7)
                }
            })
            .collect();
        let columns = bins(std::slice::from_ref(&values), &[2.0; 101]);
        // Bins come first; halves follow.
        let columns = &columns[..quantile_edges(&values, BINS).len() - 1];
        for (i, value) in values.iter().enumerate() {
            let total: f64 = columns.iter().map(|c| c.values[i]).sum();
            assert_eq!(total, if value.is_nan() { 0.0 } else { 2.0 });
        }
    }

    #[test]
    fn a_covariate_that_never_changes_makes_no_bins() {
        assert!(bins(&[vec![3.0; 50]], &[1.0; 50]).is_empty());
    }

    #[test]
    fn steps_part_the_time_evenly() {
        let t_s: Vec<f64> = (0..100).map(f64::from).collect();
        let columns = steps(&t_s, &[1.0; 100], 3);
        let after: Vec<f64> = columns.iter().map(|c| c.values.iter().sum()).collect();
        assert_eq!(after, [75.0, 50.0, 25.0]);
    }
}
