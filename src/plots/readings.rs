//! Readings in the coordinates of the wake that they were taken in, binned for pictures.

/// One recorded value beside the simulated one, in the wake that blows hardest there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    /// Depth below the rotor plane over the motor distance.
    pub(crate) s_over_l: f64,
    /// Distance from the axis over the motor distance, negative on the side of negative x.
    pub(crate) across_over_l: f64,
    pub(crate) recorded: f64,
    pub(crate) simulated: f64,
    /// What the instrument is accurate to, in the unit of the values.
    pub(crate) accuracy: f64,
}

/// Median and the middle 68 % of some values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    pub(crate) median: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// Quantile by linear interpolation of sorted values; `values` is not empty.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let place = part * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

/// `None`: no values.
pub(crate) fn spread(mut values: Vec<f64>) -> Option<Spread> {
    if values.is_empty() {
        return None;
    }
    values.sort_by(f64::total_cmp);
    Some(Spread {
        median: quantile(&values, 0.5),
        // One standard deviation to either side, where the values are normal.
        low: quantile(&values, 0.1587),
        high: quantile(&values, 0.8413),
    })
}

/// Depth downwards, distance across, in equal cells.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) s_from: f64,
    pub(super) s_to: f64,
    /// Upper and lower end of each row: equal rows, but those at depths where hardly anything was measured have gone to their
    /// neighbours, half to each.
    rows_s: Vec<(f64, f64)>,
    /// To both sides of the axis.
    pub(super) across_to: f64,
    /// Row by row from above, left to right.
    pub(super) cells: Vec<Option<Medians>>,
}

/// What a cell shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Medians {
    pub(super) recorded: f64,
    pub(super) simulated: f64,
    pub(super) residual: f64,
    pub(super) accuracy: f64,
}

/// Rows and columns to try, finest first: even numbers of columns split at the axis.
const FINENESS: [(usize, usize); 8] = [
    (36, 40),
    (30, 34),
    (25, 28),
    (20, 24),
    (16, 20),
    (13, 16),
    (10, 12),
    (8, 10),
];
/// A grid is fine enough when so many of its cells hold a reading.
/// Chosen here: of hover grids, thin at their edges, the middle is then filled.
const FILLED: f64 = 0.7;
/// A row with less than this of its cells filled is bare.
const BARE: f64 = 0.2;

impl Grid {
    /// The finest grid that the readings fill; `None` without readings.
    pub(super) fn of(readings: &[Reading]) -> Option<Grid> {
        let mut depths: Vec<f64> = readings.iter().map(|reading| reading.s_over_l).collect();
        let mut across: Vec<f64> = readings
            .iter()
            .map(|reading| reading.across_over_l.abs())
            .collect();
        if depths.is_empty() {
            return None;
        }
        depths.sort_by(f64::total_cmp);
        across.sort_by(f64::total_cmp);
        // The outermost few would leave the rest too little room.
        let (s_from, s_to) = (quantile(&depths, 0.0), quantile(&depths, 0.99));
        let across_to = quantile(&across, 0.98).max(0.1);
        let s_to = s_to.max(s_from + 0.1);
        let fitted = |(rows, columns)| {
            let mut grid = Grid {
                rows,
                columns,
                s_from,
                s_to,
                across_to,
                rows_s: (0..rows)
                    .map(|row| {
                        let edge = |row| s_from + (s_to - s_from) * row as f64 / rows as f64;
                        (edge(row), edge(row + 1))
                    })
                    .collect(),
                cells: Vec::new(),
            };
            grid.fill(readings);
            grid.give_away_bare_rows();
            grid
        };
        FINENESS
            .into_iter()
            .map(fitted)
            .find(|grid| grid.filled() >= FILLED)
            .or_else(|| FINENESS.last().copied().map(fitted))
    }

    fn filled(&self) -> f64 {
        self.cells.iter().flatten().count() as f64 / self.cells.len() as f64
    }

    fn fill(&mut self, readings: &[Reading]) {
        let mut held: Vec<Vec<&Reading>> = vec![Vec::new(); self.rows * self.columns];
        for reading in readings {
            let down = (reading.s_over_l - self.s_from) / (self.s_to - self.s_from);
            let right = (reading.across_over_l / self.across_to + 1.0) / 2.0;
            if (0.0..=1.0).contains(&down) && (0.0..=1.0).contains(&right) {
                let row = ((down * self.rows as f64) as usize).min(self.rows - 1);
                let column = ((right * self.columns as f64) as usize).min(self.columns - 1);
                held[row * self.columns + column].push(reading);
            }
        }
        let median = |held: &[&Reading], of: fn(&Reading) -> f64| {
            spread(held.iter().map(|reading| of(reading)).collect()).map(|spread| spread.median)
        };
        self.cells = held
            .iter()
            .map(|held| {
                Some(Medians {
                    recorded: median(held, |reading| reading.recorded)?,
                    simulated: median(held, |reading| reading.simulated)?,
                    residual: median(held, |reading| reading.recorded - reading.simulated)?,
                    accuracy: median(held, |reading| reading.accuracy)?,
                })
            })
            .collect();
    }

    /// Flights over fixed probes come in a few depths: rows between these would stay empty.
    fn give_away_bare_rows(&mut self) {
        let columns = self.columns;
        let held = |row: &usize| {
            let cells = &self.cells[row * columns..(row + 1) * columns];
            cells.iter().flatten().count() as f64 >= BARE * columns as f64
        };
        let kept: Vec<usize> = (0..self.rows).filter(held).collect();
        if kept.is_empty() {
            return;
        }
        let mut rows_s: Vec<(f64, f64)> = kept.iter().map(|&row| self.rows_s[row]).collect();
        for i in 1..rows_s.len() {
            let middle = (rows_s[i - 1].1 + rows_s[i].0) / 2.0;
            (rows_s[i - 1].1, rows_s[i].0) = (middle, middle);
        }
        if let Some(first) = rows_s.first_mut() {
            first.0 = self.s_from;
        }
        if let Some(last) = rows_s.last_mut() {
            last.1 = self.s_to;
        }
        self.cells = kept
            .iter()
            .flat_map(|row| self.cells[row * columns..(row + 1) * columns].to_vec())
            .collect();
        (self.rows, self.rows_s) = (kept.len(), rows_s);
    }

    /// Corners `(across, s)` of a cell.
    pub(super) fn corners(&self, row: usize, column: usize) -> ((f64, f64), (f64, f64)) {
        let (s_from, s_to) = self.rows_s[row];
        let across =
            |column: usize| self.across_to * (2.0 * column as f64 / self.columns as f64 - 1.0);
        ((across(column), s_from), (across(column + 1), s_to))
    }

    pub(super) fn at(&self, row: usize, column: usize) -> Option<Medians> {
        self.cells[row * self.columns + column]
    }
}

/// Readings of one range of depths, by distance from the axis.
#[derive(Clone, Debug)]
pub(crate) struct RadialSlice {
    pub(crate) s_from: f64,
    pub(crate) s_to: f64,
    pub(crate) bins: Vec<RadialBin>,
}

/// Some neighbouring readings of a slice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RadialBin {
    /// Their median distance from the axis over the motor distance.
    pub(crate) r_over_l: f64,
    pub(crate) recorded: Spread,
    /// Median of the simulated values of the same readings.
    pub(crate) simulated: f64,
}

/// Cuts the readings into so many slices of as many readings each, each slice into bins of equal width.
pub(crate) fn radial_slices(readings: &[Reading], slices: usize, bins: usize) -> Vec<RadialSlice> {
    let mut by_depth: Vec<&Reading> = readings.iter().collect();
    by_depth.sort_by(|a, b| a.s_over_l.total_cmp(&b.s_over_l));
    let each = by_depth.len().div_ceil(slices.max(1)).max(1);
    by_depth
        .chunks(each)
        .map(|slice| {
            let mut distances: Vec<f64> = slice
                .iter()
                .map(|reading| reading.across_over_l.abs())
                .collect();
            distances.sort_by(f64::total_cmp);
            let widest = quantile(&distances, 0.99).max(1e-6);
            let mut held: Vec<Vec<&Reading>> = vec![Vec::new(); bins];
            for reading in slice {
                let place = reading.across_over_l.abs() / widest * bins as f64;
                if place <= bins as f64 {
                    held[(place as usize).min(bins - 1)].push(reading);
                }
            }
            let of = |held: &[&Reading], value: fn(&Reading) -> f64| {
                spread(held.iter().map(|reading| value(reading)).collect())
            };
            RadialSlice {
                s_from: slice.first().map_or(0.0, |reading| reading.s_over_l),
                s_to: slice.last().map_or(0.0, |reading| reading.s_over_l),
                bins: held
                    .iter()
                    .filter_map(|held| {
                        Some(RadialBin {
                            r_over_l: of(held, |reading| reading.across_over_l.abs())?.median,
                            recorded: of(held, |reading| reading.recorded)?,
                            simulated: of(held, |reading| reading.simulated)?.median,
                        })
                    })
                    .collect(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_of_a_normal_sample_is_one_standard_deviation_to_either_side() {
        // Quantiles of the uniform distribution stand in: 0, 0.001, ... 1.
        let found = spread((0..=1000).map(|i| f64::from(i) / 1000.0).collect());
        assert_eq!(
            found,
            Some(Spread {
                median: 0.5,
                low: 0.1587,
                high: 0.8413
            })
        );
        assert_eq!(spread(Vec::new()), None);
    }

    #[test]
    fn few_readings_make_a_coarse_grid_and_many_a_fine_one() {
        let readings = |steps: i32| -> Vec<Reading> {
            (0..steps * steps)
                .map(|i| Reading {
                    s_over_l: f64::from(i / steps) / f64::from(steps) * 10.0,
                    across_over_l: f64::from(i % steps) / f64::from(steps) * 4.0 - 2.0,
                    recorded: 1.0,
                    simulated: 1.0,
                    accuracy: 0.1,
                })
                .collect()
        };
        let rows = |steps| Grid::of(&readings(steps)).map(|grid| grid.rows);
        let few = rows(9).unwrap_or_default();
        assert!(rows(60) == Some(36) && (3..=9).contains(&few), "{few}");
        assert!(Grid::of(&[]).is_none());
    }
}
