//! What a file says of one drone: polynomials in time.

use nalgebra::Point3;
use planner::plan::cause::as_typed;
use planner::scenario::RowFaults;
use planner::verify::{COORDINATES_M, EXTENTS_M, SPEEDS_MPS, TIMES_S};

/// One drone as a file has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flown {
    /// In order of time, back to back.
    pub spans: Vec<Span>,
}

/// A motion over a span of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// s.
    pub from_s: f64,
    /// s.
    pub until_s: f64,
    /// Of x, y and z (m): ascending powers of the time since `from_s` (s).
    pub axes: [Vec<f64>; 3],
}

impl Span {
    /// Place at a time (s; m): Horner's scheme.
    #[must_use]
    pub fn at_m(&self, t_s: f64) -> Point3<f64> {
        let since_s = t_s - self.from_s;
        let value = |axis: &Vec<f64>| axis.iter().rev().fold(0.0, |sum, a| sum * since_s + a);
        Point3::new(
            value(&self.axes[0]),
            value(&self.axes[1]),
            value(&self.axes[2]),
        )
    }

    /// What of it no plan can hold, sampled in [`LOOKS`] steps: places, speeds, and how far and how
    /// long it goes.
    pub(crate) fn fault(&self) -> Option<String> {
        let duration_s = self.until_s - self.from_s;
        let out = |what: &str, value: f64, (low, high): (f64, f64), unit: &str| {
            let is_in = (low..=high).contains(&value);
            (!is_in).then(|| format!("{what} {} {unit}, not within {low} to {high}", shown(value)))
        };
        if let Some(told) = out("lasts", duration_s, TIMES_S, "s") {
            return Some(told);
        }
        let at_m = |k: u32| self.at_m(self.from_s + duration_s * f64::from(k) / f64::from(LOOKS));
        let places_m: Vec<Point3<f64>> = (0..=LOOKS).map(at_m).collect();
        let coordinates_m = places_m.iter().flat_map(|it| it.iter().copied());
        // What is no number is greater than all.
        let farthest_m = coordinates_m.max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let far = farthest_m.and_then(|it| out("reaches", it, COORDINATES_M, "m"));
        far.or_else(|| {
            let steps = places_m.windows(2).map(|two| (two[1] - two[0]).norm());
            let fastest_mps = steps.fold(0.0, f64::max) * f64::from(LOOKS) / duration_s;
            out("is flown at", fastest_mps, (0.0, SPEEDS_MPS.1), "m/s")
        })
        .or_else(|| {
            let gone_m = places_m.iter().map(|it| (it - places_m[0]).norm());
            out("goes", gone_m.fold(0.0, f64::max), EXTENTS_M, "m")
        })
    }
}

/// A number as people write it.
fn shown(value: f64) -> String {
    match value.abs() < MOST_DIGITS {
        true => format!("{value:.2}"),
        false => format!("{value:.3e}"),
    }
}

/// Numbers from here on are printed with an exponent: chosen here, six digits can be read.
const MOST_DIGITS: f64 = 1e6;

/// Steps in which a span is sampled for what no plan can hold: chosen here, two for each
/// coefficient of the highest degree that a format has.
const LOOKS: u32 = 16;

/// Ascending powers of the time since its beginning of a polynomial that is given by its Bernstein
/// coefficients over a duration (s).
#[must_use]
pub fn powers(bernstein: &[f64], duration_s: f64) -> Vec<f64> {
    // The j-th power's coefficient is binomial(n, j) times the j-th forward difference.
    let degree = bernstein.len().saturating_sub(1);
    let mut differences = bernstein.to_vec();
    let mut scale = 1.0;
    let mut powers = Vec::with_capacity(bernstein.len());
    for j in 0..=degree {
        powers.push(scale * differences.first().copied().unwrap_or(0.0));
        differences = differences.windows(2).map(|two| two[1] - two[0]).collect();
        scale *= (degree - j) as f64 / ((j + 1) as f64 * duration_s);
    }
    powers
}

impl Flown {
    /// The same, each moment by so much earlier (s).
    #[must_use]
    pub fn earlier_by(mut self, by_s: f64) -> Flown {
        for span in &mut self.spans {
            span.from_s -= by_s;
            span.until_s -= by_s;
        }
        self
    }

    /// Straight from place to place (s, m).
    #[must_use]
    pub fn through(points: &[(f64, Point3<f64>)]) -> Flown {
        let span = |two: &[(f64, Point3<f64>)]| {
            let ((from_s, a), (until_s, b)) = (two[0], two[1]);
            let per_s = match until_s - from_s {
                0.0 => 0.0,
                duration_s => 1.0 / duration_s,
            };
            Span {
                from_s,
                until_s,
                axes: [0, 1, 2].map(|axis| vec![a[axis], (b[axis] - a[axis]) * per_s]),
            }
        };
        Flown {
            spans: points.windows(2).map(span).collect(),
        }
    }

    /// [`Flown::through`] the rows of a table, each with its line; of a single one a second of
    /// standing there. Rows before which time does not go on, or that no plan can hold, are
    /// reported and left out.
    pub(crate) fn through_rows(
        rows: impl IntoIterator<Item = (u64, f64, Point3<f64>)>,
        faults: &mut RowFaults,
    ) -> Flown {
        let mut points: Vec<(f64, Point3<f64>)> = Vec::new();
        for (line, t_s, at_m) in rows {
            let step = match points.last() {
                Some((before_s, _)) if t_s <= *before_s => {
                    let [t_s, before_s] = [t_s, *before_s].map(as_typed);
                    faults.add(
                        line,
                        format!("time does not go on: {t_s} s after {before_s} s"),
                    );
                    continue;
                }
                Some(before) => [*before, (t_s, at_m)],
                None => [(t_s, at_m), (t_s + 1.0, at_m)],
            };
            if let Some(what) = Flown::through(&step).spans.first().and_then(Span::fault) {
                faults.add(line, what);
                continue;
            }
            points.push((t_s, at_m));
        }
        if let [(t_s, at_m)] = points[..] {
            points.push((t_s + 1.0, at_m));
        }
        Flown::through(&points)
    }

    /// Place at a time (s; m), held before its first span and after its last; `None`: it has none.
    #[must_use]
    pub fn at_m(&self, t_s: f64) -> Option<Point3<f64>> {
        let after = self.spans.partition_point(|span| span.from_s <= t_s);
        let span = self.spans.get(after.saturating_sub(1))?;
        Some(span.at_m(t_s.clamp(span.from_s, span.until_s)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bernstein_coefficients_mean_what_their_sum_says() {
        let given = [0.3, -1.0, 4.0, 2.5, 0.0, 7.0, -3.0, 1.0];
        for degree in [0, 1, 3, 7] {
            let given = &given[..=degree];
            let powers = powers(given, 2.5);
            for k in 0..=20 {
                let u = f64::from(k) / 20.0;
                // De Casteljau.
                let mut row = given.to_vec();
                while row.len() > 1 {
                    row = row.windows(2).map(|w| w[0] + (w[1] - w[0]) * u).collect();
                }
                let sum = powers.iter().rev().fold(0.0, |sum, a| sum * (u * 2.5) + a);
                assert!(
                    (sum - row[0]).abs() < 1e-9,
                    "{degree} {u}: {sum} {}",
                    row[0]
                );
            }
        }
    }
}
