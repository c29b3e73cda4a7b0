//! Shapes that a residual is held against: tangents of laws, steps in time, bins of covariates.

use super::noise::Whitener;

/// A shape, one value a sample, in the residual's unit per unit of its parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// What it stands for, for reports.
    pub name: String,
    /// Where it comes from.
    pub kind: Kind,
    /// Of every sample.
    pub values: Vec<f64>,
}

/// Where a column comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// How a candidate's prediction changes with its parameter, per unit of it.
    Tangent,
    /// Nothing before a time, something after it.
    Step {
        /// When (s).
        from_s: f64,
    },
    /// Something within an interval of a covariate, nothing outside.
    Bin {
        /// Which covariate, by its place in the list.
        covariate: usize,
        /// Lower end, included.
        from: f64,
        /// Upper end, included.
        to: f64,
    },
}

/// A quantity known at every sample, beside the reading.
#[derive(Clone, Copy, Debug)]
pub struct Covariate<'a> {
    /// What reports call it.
    pub name: &'a str,
    /// Of every sample; NaN where it has none (no drone above).
    pub values: &'a [f64],
}

/// Bins of a covariate.
pub const BINS: usize = 8;
/// Parts of it, of which the outermost are regions of their own.
const TAILS: usize = 32;
/// Parts of it between which it is cut in two.
const QUARTERS: usize = 4;
/// Samples that a bin or either side of a step needs. Chosen here: fewer are an accident, not a region.
const LEAST_SAMPLES: usize = 5;

/// Values that part a covariate into at most `bins` intervals of equal count, ends included; ties share an interval. Empty where
/// nothing varies.
#[must_use]
pub fn quantile_edges(values: &[f64], bins: usize) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let (Some(&least), Some(&most)) = (sorted.first(), sorted.last()) else {
        return Vec::new();
    };
    if least == most {
        return Vec::new();
    }
    let mut edges = vec![least];
    for bin in 1..bins {
        let edge = sorted[bin * sorted.len() / bins];
        if edges.last().is_some_and(|&last| edge > last) {
            edges.push(edge);
        }
    }
    if edges.last().is_some_and(|&last| most > last) {
        edges.push(most);
    }
    edges
}

/// Which interval of edges a value lies in: the lower end belongs to it, and the last takes both; `None` for NaN and beyond.
#[must_use]
pub fn interval_of(edges: &[f64], value: f64) -> Option<usize> {
    let (&least, &most) = (edges.first()?, edges.last()?);
    if value.is_nan() || value < least || value > most {
        return None;
    }
    let above = edges.partition_point(|&edge| edge <= value);
    Some((above - 1).min(edges.len().saturating_sub(2)))
}

/// Regions of every covariate: eight bins of equal count, its outermost thirty-seconds, where rare regimes are, and all below and all
/// above each quarter. Within a region the column is `amplitude` (the noise's standard deviation, say, or the flow), outside it is
/// 0. Regions of fewer than five samples, and those of all samples, are left out.
#[must_use]
pub fn bins(covariates: &[Covariate<'_>], amplitude: &[f64]) -> Vec<Column> {
    let mut columns = Vec::new();
    for (index, covariate) in covariates.iter().enumerate() {
        let edges = quantile_edges(covariate.values, BINS);
        let ends = quantile_edges(covariate.values, TAILS);
        let quarters = quantile_edges(covariate.values, QUARTERS);
        let parts = edges.len().saturating_sub(1);
        let mut places: Vec<(&[f64], std::ops::Range<usize>)> =
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
        for (edges, bins) in places {
            columns.extend(bin_column(index, covariate, amplitude, edges, bins));
        }
    }
    columns
}

fn bin_column(
    index: usize,
    covariate: &Covariate<'_>,
    amplitude: &[f64],
    edges: &[f64],
    bins: std::ops::Range<usize>,
) -> Option<Column> {
    let within = |value: &f64| interval_of(edges, *value).is_some_and(|bin| bins.contains(&bin));
    let (from, to) = (edges[bins.start], edges[bins.end]);
    let count = covariate.values.iter().filter(|v| within(v)).count();
    if count < LEAST_SAMPLES || count == covariate.values.len() {
        return None;
    }
    let values = covariate.values.iter().zip(amplitude);
    Some(Column {
        name: format!("{} {from:.3}..{to:.3}", covariate.name),
        kind: Kind::Bin {
            covariate: index,
            from,
            to,
        },
        values: values
            .map(|(value, &size)| if within(value) { size } else { 0.0 })
            .collect(),
    })
}

/// Steps at `count` times that part the samples evenly; after each the column is `amplitude`.
#[must_use]
pub fn steps(t_s: &[f64], amplitude: &[f64], count: usize) -> Vec<Column> {
    let edges = quantile_edges(t_s, count + 1);
    let inner = edges.get(1..edges.len().saturating_sub(1)).unwrap_or(&[]);
    inner
        .iter()
        .filter(|&&from_s| t_s.iter().filter(|&&t| t < from_s).count() >= LEAST_SAMPLES)
        .map(|&from_s| Column {
            name: format!("step at {from_s:.1} s"),
            kind: Kind::Step { from_s },
            values: t_s
                .iter()
                .zip(amplitude)
                .map(|(&t, &size)| if t >= from_s { size } else { 0.0 })
                .collect(),
        })
        .collect()
}

/// The same columns in whitened samples.
#[must_use]
pub fn whitened(columns: &[Column], whitener: &Whitener) -> Vec<Column> {
    columns
        .iter()
        .map(|column| Column {
            name: column.name.clone(),
            kind: column.kind,
            values: whitener.whiten(&column.values),
        })
        .collect()
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
        let covariates = [Covariate {
            name: "x",
            values: &values,
        }];
        let columns = bins(&covariates, &[2.0; 101]);
        // Bins come first; halves follow.
        let columns = &columns[..quantile_edges(&values, BINS).len() - 1];
        for (i, value) in values.iter().enumerate() {
            let total: f64 = columns.iter().map(|c| c.values[i]).sum();
            assert_eq!(total, if value.is_nan() { 0.0 } else { 2.0 });
        }
    }

    #[test]
    fn a_covariate_that_never_changes_makes_no_bins() {
        let covariates = [Covariate {
            name: "x",
            values: &[3.0; 50],
        }];
        assert!(bins(&covariates, &[1.0; 50]).is_empty());
    }

    #[test]
    fn steps_part_the_time_evenly() {
        let t_s: Vec<f64> = (0..100).map(f64::from).collect();
        let columns = steps(&t_s, &[1.0; 100], 3);
        let after: Vec<f64> = columns.iter().map(|c| c.values.iter().sum()).collect();
        assert_eq!(after, [75.0, 50.0, 25.0]);
    }
}
