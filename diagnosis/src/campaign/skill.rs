//! How well forces are predicted in flights that were not fitted, by place, with intervals over whole flights; and the curves to see it by.
//!
//! Thrust maps differ by some tenths of a gram between flights: one offset for each vehicle in each flight is taken off before anything is judged.

use serde::Serialize;

use super::forces::Forces;
use super::scatter::MOST_OFFSET_N;
use crate::forward::observed::Explained;
use crate::statistics::bootstrap::intervals_95;
use crate::statistics::quantile::median;

/// Draws of flights with replacement. Chosen here: enough for two digits of a 95 % interval.
const DRAWS: usize = 400;

/// Error and `R²` over some rows; intervals are 95 % over flights: lower end, value, upper end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Skill {
    /// Which rows.
    pub rows_where: String,
    /// How many, and of how many flights.
    pub rows: usize,
    /// Flights with any.
    pub flights: usize,
    /// Root mean square of what the baseline leaves (N).
    pub rms_before_n: f64,
    /// The same corrected.
    pub rms_after_n: [f64; 3],
    /// `R²` against the mean of these rows: baseline.
    pub r2_before: f64,
    /// Corrected.
    pub r2_after: [f64; 3],
    /// The difference.
    pub r2_gained: [f64; 3],
}

/// Predictions with one offset a vehicle and flight, at most a gram, that brings their median to the recorded one: a thrust map is not known
/// better, and the baseline gets the same.
fn with_offsets(forces: &Forces, recorded: &[f64], predicted: &[f64]) -> Vec<f64> {
    let mut shifted = predicted.to_vec();
    let mut from = 0;
    for part in &forces.parts {
        let span = from..from + part.judged.len();
        from = span.end;
        let mut rests: Vec<f64> = span.clone().map(|i| recorded[i] - predicted[i]).collect();
        let offset_n = median(&mut rests)
            .unwrap_or(0.0)
            .clamp(-MOST_OFFSET_N, MOST_OFFSET_N);
        shifted[span].iter_mut().for_each(|f| *f += offset_n);
    }
    shifted
}

/// Mean force along one coordinate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Coordinate, with its unit, and which rows.
    pub along: String,
    /// Lower and upper end of each bin.
    pub bins: Vec<[f64; 2]>,
    /// Rows in each.
    pub rows: Vec<usize>,
    /// Mean recorded force (N).
    pub recorded_n: Vec<f64>,
    /// Standard error of what is left, over flights (N).
    pub error_n: Vec<f64>,
    /// Mean held-out force of the baseline (N).
    pub before_n: Vec<f64>,
    /// Corrected.
    pub after_n: Vec<f64>,
}

/// Sums of one flight.
#[derive(Clone, Copy, Default)]
struct Sums([f64; 5]);

impl Sums {
    fn add(&mut self, more: &Sums) {
        self.0.iter_mut().zip(more.0).for_each(|(a, b)| *a += b);
    }

    /// `[R² before, R² after, their difference, rms after]`.
    fn figures(&self) -> [f64; 4] {
        let [rows, sum, square, before, after] = self.0;
        let spread = square - sum * sum / rows;
        let (a, b) = (1.0 - before / spread, 1.0 - after / spread);
        [a, b, b - a, (after / rows).sqrt()]
    }
}

/// Skills over all rows, below another drone, beside its jet, and near the floor; those without rows are left out.
#[must_use]
pub fn skills(forces: &Forces, columns: &[Vec<f64>], held_out: &[Vec<f64>; 2]) -> Vec<Skill> {
    let places: [(&str, &dyn Fn(usize) -> bool); 4] = [
        ("all rows", &|_| true),
        (
            "under another drone (within 2 half-widths, 0.3 m above the floor)",
            &|i| columns[2][i] < 2.0 && columns[3][i] > 0.3,
        ),
        ("depth 0.2 to 0.8 m, within a half-width", &|i| {
            columns[2][i] < 1.0 && (0.2..0.8).contains(&columns[0][i])
        }),
        ("lower than 0.15 m", &|i| columns[3][i] < 0.15),
    ];
    places
        .into_iter()
        .filter_map(|(name, test)| skill(forces, held_out, name, test))
        .collect()
}

fn skill(
    forces: &Forces,
    [before, after]: &[Vec<f64>; 2],
    name: &str,
    test: &dyn Fn(usize) -> bool,
) -> Option<Skill> {
    let recorded = forces.recorded();
    let flights: Vec<usize> = forces.judged().map(|(part, _)| part.flight).collect();
    let [before, after] =
        [before, after].map(|predicted| with_offsets(forces, &recorded, predicted));
    let mut by_flight = vec![Sums::default(); flights.iter().max()? + 1];
    let mut total = Sums::default();
    for i in (0..recorded.len()).filter(|&i| test(i)) {
        let y = recorded[i];
        let one = Sums([
            1.0,
            y,
            y * y,
            (y - before[i]).powi(2),
            (y - after[i]).powi(2),
        ]);
        by_flight[flights[i]].add(&one);
        total.add(&one);
    }
    by_flight.retain(|sums| sums.0[0] > 0.0);
    let rows = total.0[0] as usize;
    if rows < 20 {
        return None;
    }
    let figures = total.figures();
    let ends = intervals_95(by_flight.len(), DRAWS, rows as u64, |picked| {
        let mut sums = Sums::default();
        picked
            .iter()
            .for_each(|&flight| sums.add(&by_flight[flight]));
        sums.figures()
    });
    let interval = |which: usize| [ends[which][0], figures[which], ends[which][1]];
    Some(Skill {
        rows_where: name.to_owned(),
        rows,
        flights: by_flight.len(),
        rms_before_n: (total.0[3] / total.0[0]).sqrt(),
        rms_after_n: interval(3),
        r2_before: figures[0],
        r2_after: interval(1),
        r2_gained: interval(2),
    })
}

/// Force by depth on the axis of a drone above, and by height where nobody is.
#[must_use]
pub fn curves(forces: &Forces, columns: &[Vec<f64>], held_out: &[Vec<f64>; 2]) -> Vec<Curve> {
    let depths = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0];
    let heights = [0.05, 0.07, 0.09, 0.11, 0.14, 0.18, 0.25, 0.35, 0.5];
    let radii = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0];
    let curves = [
        curve(
            forces,
            held_out,
            "depth m, within a half-width",
            &depths,
            &|i| (columns[2][i] < 1.0).then_some(columns[0][i]),
        ),
        curve(
            forces,
            held_out,
            "distance/half-width, depth 0.2 to 0.8 m",
            &radii,
            &|i| (0.2..0.8).contains(&columns[0][i]).then_some(columns[2][i]),
        ),
        curve(forces, held_out, "height m, nobody above", &heights, &|i| {
            columns[2][i].is_nan().then_some(columns[3][i])
        }),
    ];
    curves.into_iter().flatten().collect()
}

fn curve(
    forces: &Forces,
    [before, after]: &[Vec<f64>; 2],
    along: &str,
    edges: &[f64],
    value: &dyn Fn(usize) -> Option<f64>,
) -> Option<Curve> {
    let recorded = forces.recorded();
    let flights: Vec<usize> = forces.judged().map(|(part, _)| part.flight).collect();
    let [before, after] =
        [before, after].map(|predicted| with_offsets(forces, &recorded, predicted));
    let mut curve = Curve {
        along: along.to_owned(),
        bins: Vec::new(),
        rows: Vec::new(),
        recorded_n: Vec::new(),
        error_n: Vec::new(),
        before_n: Vec::new(),
        after_n: Vec::new(),
    };
    for ends in edges.windows(2) {
        let inside: Vec<usize> = (0..recorded.len())
            .filter(|&i| value(i).is_some_and(|x| x >= ends[0] && x < ends[1]))
            .collect();
        if inside.len() < 20 {
            continue;
        }
        let count = inside.len() as f64;
        let mean = |of: &dyn Fn(usize) -> f64| inside.iter().map(|&i| of(i)).sum::<f64>() / count;
        let level = mean(&|i| recorded[i] - after[i]);
        let mut by_flight = vec![0.0; flights.last().map_or(0, |last| last + 1)];
        for &i in &inside {
            by_flight[flights[i]] += recorded[i] - after[i] - level;
        }
        let square: f64 = by_flight.iter().map(|sum| sum * sum).sum();
        curve.bins.push([ends[0], ends[1]]);
        curve.rows.push(inside.len());
        curve.recorded_n.push(mean(&|i| recorded[i]));
        curve.error_n.push(square.sqrt() / count);
        curve.before_n.push(mean(&|i| before[i]));
        curve.after_n.push(mean(&|i| after[i]));
    }
    (!curve.bins.is_empty()).then_some(curve)
}
