//! Order statistics: quantiles, medians, and intervals of equal count; means and differences.

/// Arithmetic mean; 0 of no values.
#[must_use]
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Root of the mean square, in the values' unit; 0 of no values.
#[must_use]
pub fn root_mean_square(values: &[f64]) -> f64 {
    let square: f64 = values.iter().map(|x| x * x).sum();
    (square / values.len().max(1) as f64).sqrt()
}

/// Values less others, one by one.
#[must_use]
pub fn difference(values: &[f64], others: &[f64]) -> Vec<f64> {
    let pairs = values.iter().zip(others);
    pairs.map(|(value, other)| value - other).collect()
}

/// Quantile of values in ascending order, linear between neighbours (definition 7 of Hyndman & Fan
/// 1996, Am. Stat. 50:361); `share` from 0 to 1. `None` of no values.
#[must_use]
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = share * last as f64;
    let below = place as usize;
    let above = (below + 1).min(last);
    Some(between(
        [sorted[below], sorted[above]],
        place - below as f64,
    ))
}

/// The same of values in any order, which it changes.
#[must_use]
pub fn selected(values: &mut [f64], share: f64) -> Option<f64> {
    let place = share * values.len().checked_sub(1)? as f64;
    let (_, low, above) = values.select_nth_unstable_by(place as usize, f64::total_cmp);
    let high = above.iter().copied().min_by(f64::total_cmp);
    Some(between([*low, high.unwrap_or(*low)], place.fract()))
}

fn between([low, high]: [f64; 2], part: f64) -> f64 {
    // Infinite values have no difference.
    match part == 0.0 || low == high {
        true => low,
        false => low + part * (high - low),
    }
}

/// The value nearest to a quantile of values in ascending order, so that it is always one of them
/// (an end of a region, a draw); `share` from 0 to 1. `None` of no values.
#[must_use]
pub fn nearest_rank(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    Some(sorted[(share * last as f64).round() as usize])
}

/// The middle of the values, the upper one of two, so that it is always one of them (a step of a
/// clock, a reading). Reorders them. `None` of no values.
#[must_use]
pub fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Values that part a covariate into at most `bins` intervals of equal count, both ends included;
/// ties share an interval, values that are not finite have none. Empty where nothing varies.
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
    let inner = (1..bins).map(|bin| sorted[bin * sorted.len() / bins]);
    let mut edges = vec![least];
    for edge in inner.chain([most]) {
        if edges.last().is_some_and(|&last| edge > last) {
            edges.push(edge);
        }
    }
    edges
}

/// The interval between ascending edges that a value lies in: the lower end belongs to it, and the
/// last takes both. `None` for NaN and beyond the ends.
#[must_use]
pub fn interval_of(edges: &[f64], value: f64) -> Option<usize> {
    let (&least, &most) = (edges.first()?, edges.last()?);
    if !(value >= least && value <= most) {
        return None;
    }
    let above = edges.partition_point(|&edge| edge <= value);
    Some((above - 1).min(edges.len().saturating_sub(2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_linear_between_values_ranks_and_medians_are_values() {
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.5), Some(2.0));
        assert_eq!(quantile(&[1.0, 2.0], 0.1), Some(1.1));
        assert_eq!(quantile(&[3.0], 1.0), Some(3.0));
        assert_eq!(quantile(&[], 0.5), None);
        let mut values = [4.0, 1.0, f64::INFINITY, 2.0, 7.0, 2.0];
        for share in [0.0, 0.1, 0.25, 0.4, 0.5, 0.9, 1.0] {
            let found = selected(&mut values, share);
            let mut sorted = values;
            sorted.sort_by(f64::total_cmp);
            assert_eq!(found, quantile(&sorted, share));
        }
        assert_eq!(selected(&mut [], 0.5), None);
        assert_eq!(nearest_rank(&[1.0, 2.0, 4.0], 0.8), Some(4.0));
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(median(&mut []), None);
    }
}
