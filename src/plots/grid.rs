//! A heat map of a wake in a plane through its axis: distance from the axis across, depth
//! downwards, both over the motor distance.

use diagnosis::statistics::quantile::quantile;

use super::axes::Chart;
use super::canvas::{Area, Canvas, fill};
use super::colours::{Colour, FAINT, Scale};
use super::readings::{Spread, sorted};

/// Rows and columns to try, finest first: even numbers of columns split at the axis.
const ROWS: [usize; 8] = [36, 30, 25, 20, 16, 13, 10, 8];
const COLUMNS: [usize; 8] = [40, 34, 28, 24, 20, 16, 12, 10];
/// A grid is fine enough when so many of its cells hold a sample.
/// Chosen here: of hover grids, thin at their edges, the middle is then filled.
const FILLED: f64 = 0.7;
/// A row with less than this of its cells filled is bare.
const BARE: f64 = 0.2;

/// Label of depths.
pub(super) const DEPTH: &str = "depth below the rotor plane s / l";
/// Label of the distance from the axis of readings.
pub(super) const SIGNED: &str = "distance from the axis r / l, signed by side of x";

/// Samples in cells. All cells of a row are as high, all cells as wide.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub(super) columns: usize,
    /// Edges of the rows: equal rows, but those at depths where hardly anything was measured have
    /// gone to their neighbours, half to each.
    depths: Vec<f64>,
    /// To both sides of the axis.
    across_to: f64,
    /// Which samples each cell holds, row by row from above, left to right.
    cells: Vec<Vec<usize>>,
}

impl Grid {
    /// The finest grid that samples at these places fill, by distance from the axis and depth;
    /// `None` without places.
    pub(super) fn of(places: &[(f64, f64)]) -> Option<Grid> {
        let across = sorted(places.iter().map(|(across, _)| across.abs()));
        let depths = sorted(places.iter().map(|(_, s)| *s));
        let s_from = *depths.first()?;
        // The outermost few would leave the rest too little room.
        let s_to = quantile(&depths, 0.99)?.max(s_from + 0.1);
        let across_to = quantile(&across, 0.98)?.max(0.1);
        let fitted = |(rows, columns): (usize, usize)| {
            let edge = |row: usize| s_from + (s_to - s_from) * row as f64 / rows as f64;
            let mut grid = Grid {
                columns,
                depths: (0..=rows).map(edge).collect(),
                across_to,
                cells: vec![Vec::new(); rows * columns],
            };
            for (index, (across, s)) in places.iter().enumerate() {
                let down = (s - s_from) / (s_to - s_from);
                let right = (across / across_to + 1.0) / 2.0;
                if (0.0..=1.0).contains(&down) && (0.0..=1.0).contains(&right) {
                    let row = ((down * rows as f64) as usize).min(rows - 1);
                    let column = ((right * columns as f64) as usize).min(columns - 1);
                    grid.cells[row * columns + column].push(index);
                }
            }
            grid.give_away_bare_rows();
            grid
        };
        let mut grids = ROWS.into_iter().zip(COLUMNS).map(fitted).peekable();
        while let Some(grid) = grids.next() {
            if filled(&grid.cells) >= FILLED || grids.peek().is_none() {
                return Some(grid);
            }
        }
        None
    }

    /// Flights over fixed probes come in a few depths: rows between these would stay empty.
    fn give_away_bare_rows(&mut self) {
        let rows = self.cells.chunks(self.columns).zip(self.depths.windows(2));
        let kept: Vec<_> = rows.filter(|(cells, _)| filled(cells) >= BARE).collect();
        let [first, .., last] = self.depths[..] else {
            return;
        };
        if !kept.is_empty() {
            let middle = |pair: &[(_, &[f64])]| (pair[0].1[1] + pair[1].1[0]) / 2.0;
            let middles = kept.windows(2).map(middle);
            let depths = [first].into_iter().chain(middles).chain([last]).collect();
            let cells = kept.iter().flat_map(|(cells, _)| cells.to_vec()).collect();
            (self.depths, self.cells) = (depths, cells);
        }
    }

    /// The median of a value of the samples in each cell.
    pub(super) fn medians(&self, value: impl Fn(usize) -> f64) -> Vec<Option<f64>> {
        let median = |held: &Vec<usize>| Spread::of(held.iter().map(|&index| value(index)));
        let medians = self.cells.iter().map(median);
        medians.map(|spread| Some(spread?.median)).collect()
    }

    /// Upper and lower corner of a cell, by distance from the axis and depth.
    pub(super) fn corners(&self, row: usize, column: usize) -> [(f64, f64); 2] {
        let part = |column: usize| 2.0 * column as f64 / self.columns as f64 - 1.0;
        let corner = |i: usize| (self.across_to * part(column + i), self.depths[row + i]);
        [corner(0), corner(1)]
    }

    /// Axes around it, and each cell in the colour of its value; grey where it has none. `across`
    /// is the label of the distance.
    pub(super) fn draw(
        &self,
        canvas: &mut Canvas,
        area: Area,
        (heading, across): (&str, &str),
        (scale, values): (&Scale, &[Option<f64>]),
    ) -> Chart {
        let last = self.depths.len() - 1;
        let x = (across, (-self.across_to, self.across_to));
        let y = (DEPTH, (self.depths[last], self.depths[0]));
        let chart = Chart::draw(canvas, area, heading, [x, y]);
        chart.ground(canvas, &fill(FAINT, 1.0));
        let colours: Vec<Colour> = (0..scale.steps).map(|step| scale.colour(step)).collect();
        let step = |value: &Option<f64>| value.map(|value| scale.step_of(value));
        let steps: Vec<Option<usize>> = values.iter().map(step).collect();
        let corners = |row, column| self.corners(row, column);
        chart.cells(canvas, steps.chunks(self.columns), &colours, corners);
        chart
    }
}

/// Share of cells that hold a sample.
fn filled(cells: &[Vec<usize>]) -> f64 {
    let held = cells.iter().filter(|cell| !cell.is_empty()).count();
    held as f64 / cells.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_readings_make_a_coarse_grid_and_many_a_fine_one() {
        let places = |steps: i32| -> Vec<(f64, f64)> {
            let part = |i: i32| f64::from(i) / f64::from(steps);
            let all = 0..steps * steps;
            all.map(|i| (part(i % steps) * 4.0 - 2.0, part(i / steps) * 10.0))
                .collect()
        };
        let rows = |steps| Grid::of(&places(steps)).map(|grid| grid.depths.len() - 1);
        let few = rows(9).unwrap_or_default();
        assert!(rows(60) == Some(36) && (3..=9).contains(&few), "{few}");
        assert!(Grid::of(&[]).is_none());
    }
}
