//! How well forces are predicted in flights that were not fitted, by place, with intervals over
//! whole flights; and the curves to see it by.
//!
//! Thrust maps differ by some tenths of a gram between flights: one offset for each vehicle in each
//! flight is taken off before anything is judged.

use serde::Serialize;

use super::forces::Forces;
use crate::forward::held_out::{LEAST_ROWS, R2Figures, R2Sums};
use crate::forward::observed::Explained;
use crate::statistics::quantile::{difference, median};

/// Where a row lies under another drone, in words.
pub const UNDER_ANOTHER: &str = "under another drone (within 2 half-widths, 0.3 m above the floor)";

/// What a row counts under along a curve; `None` where it does not belong to it.
type Abscissa<'a> = &'a dyn Fn(usize) -> Option<f64>;

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

/// Mean force along one coordinate.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
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

/// The judged rows as recorded and as predicted by a fit to other flights, before and after.
pub(super) struct Judged<'a> {
    /// Depth (m), distance from the axis in half-widths, and height (m) of each row.
    places: [&'a [f64]; 3],
    /// Flight of each row.
    flights: Vec<usize>,
    recorded: Vec<f64>,
    before: Vec<f64>,
    after: Vec<f64>,
}

impl<'a> Judged<'a> {
    /// Of held-out predictions by the baseline and by the corrected simulation.
    /// `most_n`: how far the offset of one flight may be from 0 (N).
    pub(super) fn new(
        forces: &Forces,
        columns: &'a [Vec<f64>],
        [before, after]: &[Vec<f64>; 2],
        most_n: f64,
    ) -> Judged<'a> {
        let recorded = forces.recorded();
        Judged {
            places: [0, 2, 3].map(|at| columns[at].as_slice()),
            flights: forces.judged().map(|(part, _)| part.flight).collect(),
            before: with_offsets((forces, most_n), &recorded, before),
            after: with_offsets((forces, most_n), &recorded, after),
            recorded,
        }
    }

    /// What the baseline leaves of the recorded force, one offset a vehicle and flight off (N).
    pub(super) fn rest_n(&self) -> Vec<f64> {
        difference(&self.recorded, &self.before)
    }

    /// Skills over all rows, below another drone, beside its jet, and near the floor; those without
    /// rows are left out.
    pub(super) fn skills(&self) -> Vec<Skill> {
        let [depth_m, xi, height_m] = self.places;
        let places: [(&str, &dyn Fn(usize) -> bool); 4] = [
            ("all rows", &|_| true),
            (UNDER_ANOTHER, &|i| self.is_under(i)),
            ("depth 0.2 to 0.8 m, within a half-width", &|i| {
                xi[i] < 1.0 && (0.2..0.8).contains(&depth_m[i])
            }),
            ("lower than 0.15 m", &|i| height_m[i] < 0.15),
        ];
        let skills = places.into_iter();
        skills
            .filter_map(|(name, test)| self.skill(name, test))
            .collect()
    }

    fn is_under(&self, i: usize) -> bool {
        let [_, xi, height_m] = self.places;
        xi[i] < 2.0 && height_m[i] > 0.3
    }

    /// What `R²` gains under another drone, or over all rows where none is, with its interval.
    pub(super) fn r2_gained(&self) -> Option<[f64; 3]> {
        let skill = self.skill("", &|i| self.is_under(i));
        let skill = skill.or_else(|| self.skill("", &|_| true));
        Some(skill?.r2_gained)
    }

    /// Whether `R²` falls over all rows.
    pub(super) fn is_worse_in_all(&self) -> bool {
        let skill = self.skill("", &|_| true);
        skill.is_some_and(|skill| skill.r2_gained[0] < 0.0)
    }

    fn skill(&self, name: &str, test: &dyn Fn(usize) -> bool) -> Option<Skill> {
        let mut by_flight = vec![R2Sums::default(); self.flights.iter().max()? + 1];
        for i in (0..self.recorded.len()).filter(|&i| test(i)) {
            let predicted = [self.before[i], self.after[i]];
            by_flight[self.flights[i]].add(self.recorded[i], predicted);
        }
        by_flight.retain(|sums| sums.rows > 0.0);
        let figures = R2Figures::over(&by_flight)?;
        Some(Skill {
            rows_where: name.to_owned(),
            rows: figures.rows,
            flights: by_flight.len(),
            rms_before_n: figures.rms.0,
            rms_after_n: figures.rms.1,
            r2_before: figures.r2.0,
            r2_after: figures.r2.1,
            r2_gained: figures.r2_gained,
        })
    }

    /// Force by depth and by distance from the axis of a drone above, and by height where none is.
    pub(super) fn curves(&self) -> Vec<Curve> {
        let [depth_m, xi, height_m] = self.places;
        let curves: [(&str, &[f64], Abscissa<'_>); 3] = [
            (
                "depth m, within a half-width",
                &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0],
                &|i| (xi[i] < 1.0).then_some(depth_m[i]),
            ),
            (
                "distance/half-width, depth 0.2 to 0.8 m",
                &[0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0],
                &|i| (0.2..0.8).contains(&depth_m[i]).then_some(xi[i]),
            ),
            (
                "height m, no drone above",
                &[0.05, 0.07, 0.09, 0.11, 0.14, 0.18, 0.25, 0.35, 0.5],
                &|i| xi[i].is_nan().then_some(height_m[i]),
            ),
        ];
        let curves = curves.into_iter();
        curves
            .filter_map(|(along, edges, value)| self.curve(along, edges, value))
            .collect()
    }

    fn curve(&self, along: &str, edges: &[f64], value: Abscissa<'_>) -> Option<Curve> {
        let mut curve = Curve {
            along: along.to_owned(),
            ..Curve::default()
        };
        for ends in edges.windows(2) {
            let is_inside = |i: &usize| value(*i).is_some_and(|x| x >= ends[0] && x < ends[1]);
            let inside: Vec<usize> = (0..self.recorded.len()).filter(is_inside).collect();
            if inside.len() < LEAST_ROWS {
                continue;
            }
            let count = inside.len() as f64;
            let mean =
                |of: &dyn Fn(usize) -> f64| inside.iter().map(|&i| of(i)).sum::<f64>() / count;
            let left_n = |i: usize| self.recorded[i] - self.after[i];
            let level_n = mean(&left_n);
            let mut by_flight = vec![0.0; self.flights.last().map_or(0, |last| last + 1)];
            for &i in &inside {
                by_flight[self.flights[i]] += left_n(i) - level_n;
            }
            let square: f64 = by_flight.iter().map(|sum| sum * sum).sum();
            curve.bins.push([ends[0], ends[1]]);
            curve.rows.push(inside.len());
            curve.recorded_n.push(mean(&|i| self.recorded[i]));
            curve.error_n.push(square.sqrt() / count);
            curve.before_n.push(mean(&|i| self.before[i]));
            curve.after_n.push(mean(&|i| self.after[i]));
        }
        (!curve.bins.is_empty()).then_some(curve)
    }
}

/// Predictions with one offset a vehicle and flight, as far as flights differ, that brings their
/// median to the recorded one: a thrust map is not known better, and the baseline gets the same.
fn with_offsets((forces, most_n): (&Forces, f64), recorded: &[f64], predicted: &[f64]) -> Vec<f64> {
    let mut shifted = predicted.to_vec();
    let mut from = 0;
    for part in &forces.parts {
        let span = from..from + part.judged.len();
        from = span.end;
        let mut rests: Vec<f64> = span.clone().map(|i| recorded[i] - predicted[i]).collect();
        let offset_n = median(&mut rests).unwrap_or(0.0).clamp(-most_n, most_n);
        shifted[span].iter_mut().for_each(|f| *f += offset_n);
    }
    shifted
}
