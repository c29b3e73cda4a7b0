//! How cost grows with the fleet: straight lines by least squares.

use serde::Serialize;

use super::row::Row;
use crate::instances::Floor;

/// A line needs a residual to tell how well it is known: two points have none.
pub(crate) const FEWEST_ROWS: usize = 3;

/// How one place's cost grows.
#[derive(Debug, Serialize)]
pub struct Growth {
    /// Where.
    pub place: Floor,
    /// Sizes that the lines are drawn through.
    pub fitted_drones: Vec<usize>,
    /// Sizes that were left out: planned by other rules, a drone left out, not verified, or stopped
    /// early.
    pub left_out_drones: Vec<usize>,
    /// Natural logarithm of planning time (s) over that of the number of drones; the slope is the
    /// power.
    pub log_planning_time: Option<Line>,
    /// Peak of memory (MiB) over the number of drones.
    pub memory_mib: Option<Line>,
}

/// `y = intercept + slope · x`, by ordinary least squares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Line {
    /// `y` at `x` = 0.
    pub intercept: f64,
    /// `y` for each `x`.
    pub slope: f64,
    /// Standard error of the slope, from the residuals.
    pub slope_error: f64,
    /// Part of the scatter of `y` that the line explains.
    pub r_squared: f64,
}

/// One entry for each place, in the order of the rows.
#[must_use]
pub fn growth(rows: &[Row]) -> Vec<Growth> {
    let mut places: Vec<Floor> = Vec::new();
    for row in rows {
        if !places.contains(&row.place) {
            places.push(row.place);
        }
    }
    let grown = places.into_iter().map(|place| {
        let here = || rows.iter().filter(|row| row.place == place);
        // Time grows by another law where other rules hold: that of the largest fleets is fitted.
        let last = here().rfind(|row| row.is_complete()).map(Row::rules);
        let is_fitted = |row: &&Row| row.is_complete() && Some(row.rules()) == last;
        let (fitted, left_out): (Vec<&Row>, Vec<&Row>) = here().partition(is_fitted);
        let points = |of: &dyn Fn(&Row) -> Option<f64>| -> Vec<(f64, f64)> {
            let pairs = fitted.iter().map(|row| Some((row.drones as f64, of(row)?)));
            pairs.flatten().collect()
        };
        let times = points(&Row::planning_time_s).into_iter();
        let logs: Vec<(f64, f64)> = times.map(|(n, time_s)| (n.ln(), time_s.ln())).collect();
        Growth {
            place,
            fitted_drones: fitted.iter().map(|row| row.drones).collect(),
            left_out_drones: left_out.iter().map(|row| row.drones).collect(),
            log_planning_time: line(&logs),
            memory_mib: line(&points(&Row::peak_memory_mib)),
        }
    });
    grown.collect()
}

/// `None` below three points, where all lie above one another, or where one is not finite.
fn line(points: &[(f64, f64)]) -> Option<Line> {
    let count = points.len() as f64;
    let finite = points.iter().all(|(x, y)| x.is_finite() && y.is_finite());
    if points.len() < FEWEST_ROWS || !finite {
        return None;
    }
    let mean_x = points.iter().map(|(x, _)| x).sum::<f64>() / count;
    let mean_y = points.iter().map(|(_, y)| y).sum::<f64>() / count;
    let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        points.iter().map(|(x, y)| of(x - mean_x, y - mean_y)).sum()
    };
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    if xx <= 0.0 {
        return None;
    }
    let slope = xy / xx;
    let left = sum(&|x, y| (y - slope * x).powi(2));
    Some(Line {
        intercept: mean_y - slope * mean_x,
        slope,
        slope_error: (left / (count - 2.0) / xx).sqrt(),
        r_squared: if yy > 0.0 { 1.0 - left / yy } else { 1.0 },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_found_again_with_no_error_left() {
        let points: Vec<(f64, f64)> = [100.0_f64, 200.0, 500.0, 1000.0]
            .map(|n| (n.ln(), (0.002 * n.powf(1.4)).ln()))
            .to_vec();
        let found = line(&points).expect("four points");
        assert!((found.slope - 1.4).abs() < 1e-12, "{found:?}");
        assert!((found.intercept - 0.002_f64.ln()).abs() < 1e-12);
        assert!(found.slope_error < 1e-7 && found.r_squared > 1.0 - 1e-12);
    }

    #[test]
    fn the_standard_error_is_that_of_a_case_worked_by_hand() {
        // y = x + (1, -2, 1)/3: slope 1, residuals squared 6/9, one degree of freedom, Σ(x - x̄)² =
        // 2.
        let points = [(0.0, 1.0 / 3.0), (1.0, 1.0 / 3.0), (2.0, 7.0 / 3.0)];
        let found = line(&points).expect("three points");
        assert!((found.slope - 1.0).abs() < 1e-12);
        assert!((found.slope_error - (1.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((found.r_squared - 0.75).abs() < 1e-12);
    }

    #[test]
    fn two_rows_or_one_size_have_no_growth() {
        assert_eq!(line(&[(1.0, 1.0), (2.0, 2.0)]), None);
        assert_eq!(line(&[(1.0, 1.0), (1.0, 2.0), (1.0, 3.0)]), None);
    }
}
