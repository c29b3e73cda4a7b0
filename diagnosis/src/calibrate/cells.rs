//! The paper's median per grid cell: one cell of one flight, so that a flight can be drawn with all that is its own.

use super::options::Options;
use super::samples::Sample;

/// A drone that comes back to a grid cell after so long (s) makes a new median: the two are independent, and the two sides of
/// the axis are two places of the paper's grid. Chosen here: two of the paper's dwells.
const PAUSE_S: f64 = 10.0;

/// Readings of one flight that fall into one grid cell.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    pub(super) flight: usize,
    /// Mean time (s), depth and radius over the motor distance.
    pub(super) t_s: f64,
    pub(super) s: f64,
    pub(super) r: f64,
    /// Median reading (m/s).
    pub(super) median_mps: f64,
    /// Its readings in the sorted list.
    pub(super) from: usize,
    pub(super) to: usize,
}

impl Cell {
    pub(super) fn count(&self) -> usize {
        self.to - self.from
    }
}

/// Sorts readings into cells; each cell's readings then stand together, in order of time. Cells are in order of flight and time.
pub(super) fn cells(samples: &mut [Sample], options: &Options) -> Vec<Cell> {
    let key = |sample: &Sample| {
        (
            sample.flight,
            (sample.s / options.cell_s_over_l) as u32,
            (sample.r / options.cell_r_over_l) as u32,
            sample.probe,
        )
    };
    samples.sort_by(|a, b| key(a).cmp(&key(b)).then(a.t_s.total_cmp(&b.t_s)));
    let mut cells = Vec::new();
    let mut from = 0;
    for group in samples.chunk_by(|a, b| key(a) == key(b) && b.t_s - a.t_s < PAUSE_S) {
        let n = group.len() as f64;
        let mean = |of: fn(&Sample) -> f64| group.iter().map(of).sum::<f64>() / n;
        let mut speeds: Vec<f64> = group.iter().map(|sample| sample.speed_mps).collect();
        cells.push(Cell {
            flight: group[0].flight,
            t_s: mean(|sample| sample.t_s),
            s: mean(|sample| sample.s),
            r: mean(|sample| sample.r),
            median_mps: quantile(&mut speeds, 0.5),
            from,
            to: from + group.len(),
        });
        from += group.len();
    }
    cells.sort_by(|a, b| {
        (a.flight.cmp(&b.flight))
            .then(a.t_s.total_cmp(&b.t_s))
            .then(a.from.cmp(&b.from))
    });
    cells
}

/// Quantile of values in any order; 0 of nothing.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    crate::statistics::quantile::quantile(values, share).unwrap_or(0.0)
}
