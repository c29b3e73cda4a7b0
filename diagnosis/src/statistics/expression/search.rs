//! All short products on a grid of inner constants, the best of each length, and their fit.

use std::collections::BTreeMap;

use super::{Coordinate, Expression, Factor, LONGEST, Shape};

/// What is fitted.
pub(super) struct Data<'a> {
    pub(super) coordinates: &'a [Coordinate<'a>],
    pub(super) y: &'a [f64],
    pub(super) weights: &'a [f64],
}

/// A product, with or without d.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Form {
    factors: Vec<Factor>,
    has_constant: bool,
}

/// A form with its coefficients.
pub(super) struct Fitted {
    pub(super) form: Form,
    coefficient: f64,
    constant: f64,
}

/// Samples that the grid is searched on; more are thinned evenly.
const SEARCHED: usize = 1000;
/// Samples that a fit needs.
const LEAST_SAMPLES: usize = 20;
/// Inner constants of the grid, over the coordinate's largest size: from a tenth to three times, evenly in the logarithm.
const GRID: [f64; 7] = [0.1, 0.18, 0.31, 0.55, 0.97, 1.7, 3.0];
/// Forms of each length that are judged.
const JUDGED: usize = 4;
/// Golden sections of each constant, rounds over the constants, and the factor either way that is searched.
const SECTIONS: usize = 16;
const ROUNDS: usize = 3;
const REACH: f64 = 2.0;

/// A factor on the searched samples.
struct Column {
    factor: Factor,
    values: Vec<f64>,
}

/// The best forms of each length, by sum of squares on the grid.
pub(super) fn best_forms(data: &Data<'_>, rows: &[usize]) -> Vec<Form> {
    if rows.len() < LEAST_SAMPLES {
        return Vec::new();
    }
    let step = rows.len().div_ceil(SEARCHED);
    let rows: Vec<usize> = rows.iter().copied().step_by(step).collect();
    let columns = columns(data, &rows);
    let mut best = Best::default();
    let mut chosen = Vec::new();
    let ones = vec![1.0; rows.len()];
    extend(data, &rows, &columns, 0, &ones, &mut chosen, &mut best);
    best.forms()
}

fn columns(data: &Data<'_>, rows: &[usize]) -> Vec<Column> {
    let mut columns = Vec::new();
    for (coordinate, of) in data.coordinates.iter().enumerate() {
        let values = || rows.iter().map(|&i| of.values[i]);
        let least = values().fold(f64::INFINITY, f64::min);
        let most = values().fold(0.0f64, |most, x| most.max(x.abs()));
        let shapes: &[Shape] = if of.is_angle {
            &Shape::OF_ANGLES
        } else {
            &Shape::OF_LENGTHS
        };
        for &shape in shapes.iter().filter(|shape| shape.allows(least)) {
            let constants: Vec<f64> = if shape.has_constant() {
                GRID.iter()
                    .map(|share| share * most)
                    .filter(|a| *a > 0.0)
                    .collect()
            } else {
                vec![1.0]
            };
            for constant in constants {
                let factor = Factor {
                    coordinate,
                    shape,
                    constant,
                };
                let values = values().map(|x| factor.at(x)).collect();
                columns.push(Column { factor, values });
            }
        }
    }
    columns
}

/// Tries the chosen factors times every later column, and goes on from there.
fn extend(
    data: &Data<'_>,
    rows: &[usize],
    columns: &[Column],
    length: usize,
    product: &[f64],
    chosen: &mut Vec<(usize, Factor)>,
    best: &mut Best,
) {
    let first = chosen.last().map_or(0, |(at, _)| at + 1);
    for at in first..columns.len() {
        let column = &columns[at];
        let length = length + column.factor.shape.length();
        if length > LONGEST
            || chosen
                .iter()
                .any(|(_, other)| is_like(other, &column.factor))
        {
            continue;
        }
        let product: Vec<f64> = product
            .iter()
            .zip(&column.values)
            .map(|(p, v)| p * v)
            .collect();
        chosen.push((at, column.factor));
        best.offer(data, rows, &product, chosen);
        if length < LONGEST {
            extend(data, rows, columns, length, &product, chosen, best);
        }
        chosen.pop();
    }
}

/// Two factors that would be one: the same function, or two powers, of one coordinate.
fn is_like(a: &Factor, b: &Factor) -> bool {
    a.coordinate == b.coordinate
        && (a.shape == b.shape || (a.shape.is_power() && b.shape.is_power()))
}

/// Names a form without its inner constants.
type Key = (bool, Vec<(usize, Shape)>);

#[derive(Default)]
struct Best {
    /// Sum of squares taken, and the constants that take most.
    taken: BTreeMap<Key, (f64, Form)>,
}

impl Best {
    fn offer(
        &mut self,
        data: &Data<'_>,
        rows: &[usize],
        product: &[f64],
        chosen: &[(usize, Factor)],
    ) {
        let sums = Sums::of(data, rows, product);
        for has_constant in [false, true] {
            let Some((_, _, taken)) = sums.solve(has_constant) else {
                continue;
            };
            let shapes = chosen
                .iter()
                .map(|(_, f)| (f.coordinate, f.shape))
                .collect();
            let held = self.taken.entry((has_constant, shapes));
            let form = || Form {
                factors: chosen.iter().map(|(_, factor)| *factor).collect(),
                has_constant,
            };
            held.and_modify(|held| {
                if taken > held.0 {
                    *held = (taken, form());
                }
            })
            .or_insert_with(|| (taken, form()));
        }
    }

    fn forms(self) -> Vec<Form> {
        let mut by_length: BTreeMap<usize, Vec<(f64, Form)>> = BTreeMap::new();
        for (taken, form) in self.taken.into_values() {
            by_length
                .entry(form.length())
                .or_default()
                .push((taken, form));
        }
        let mut forms = Vec::new();
        for mut of_length in by_length.into_values() {
            // A stable sort: equals stay in the order of their names.
            of_length.sort_by(|a, b| b.0.total_cmp(&a.0));
            forms.extend(of_length.into_iter().take(JUDGED).map(|(_, form)| form));
        }
        forms
    }
}

/// Weighted sums of a product f and y.
#[derive(Default)]
struct Sums {
    w: f64,
    f: f64,
    ff: f64,
    y: f64,
    fy: f64,
}

impl Sums {
    fn of(data: &Data<'_>, rows: &[usize], product: &[f64]) -> Self {
        let mut sums = Self::default();
        for (&i, &f) in rows.iter().zip(product) {
            let (w, y) = (data.weights[i], data.y[i]);
            sums.w += w;
            sums.f += w * f;
            sums.ff += w * f * f;
            sums.y += w * y;
            sums.fy += w * f * y;
        }
        sums
    }

    /// c, d and the sum of squares they take; `None` where f is 0, not finite, or a constant beside d.
    fn solve(&self, has_constant: bool) -> Option<(f64, f64, f64)> {
        let (c, d) = if has_constant {
            let determinant = self.w * self.ff - self.f * self.f;
            if determinant <= 1e-6 * self.w * self.ff {
                return None;
            }
            let c = (self.w * self.fy - self.f * self.y) / determinant;
            (c, (self.y - c * self.f) / self.w)
        } else {
            (self.fy / self.ff, 0.0)
        };
        let taken = c * self.fy + d * self.y;
        taken.is_finite().then_some((c, d, taken))
    }
}

/// Fits coefficients and inner constants, from the form's own.
pub(super) fn fit(data: &Data<'_>, rows: &[usize], form: &Form) -> Option<Fitted> {
    if rows.len() < LEAST_SAMPLES {
        return None;
    }
    let mut form = form.clone();
    let taken = |form: &Form| {
        let sums = Sums::of(data, rows, &form.products(data, rows));
        sums.solve(form.has_constant)
            .map_or(f64::NEG_INFINITY, |(_, _, taken)| taken)
    };
    let free: Vec<usize> = (0..form.factors.len())
        .filter(|&k| form.factors[k].shape.has_constant())
        .collect();
    // One constant is found in one round.
    let rounds = if free.len() > 1 { ROUNDS } else { 1 };
    for _ in 0..rounds {
        for &k in &free {
            let middle = form.factors[k].constant.ln();
            let at = |log: f64, form: &mut Form| {
                form.factors[k].constant = log.exp();
                taken(form)
            };
            let reach = REACH.ln();
            let best = golden_section(middle - reach, middle + reach, |log| at(log, &mut form));
            form.factors[k].constant = best.exp();
        }
    }
    let sums = Sums::of(data, rows, &form.products(data, rows));
    let (coefficient, constant, _) = sums.solve(form.has_constant)?;
    Some(Fitted {
        form,
        coefficient,
        constant,
    })
}

/// Where a function of one maximum is largest.
fn golden_section(mut low: f64, mut high: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let mut left = high - GOLDEN * (high - low);
    let mut right = low + GOLDEN * (high - low);
    let (mut at_left, mut at_right) = (f(left), f(right));
    for _ in 0..SECTIONS {
        if at_left > at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - GOLDEN * (high - low);
            at_left = f(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + GOLDEN * (high - low);
            at_right = f(right);
        }
    }
    0.5 * (low + high)
}

impl Form {
    pub(super) fn length(&self) -> usize {
        let factors: usize = self.factors.iter().map(|f| f.shape.length()).sum();
        factors + usize::from(self.has_constant)
    }

    fn products(&self, data: &Data<'_>, rows: &[usize]) -> Vec<f64> {
        rows.iter().map(|&i| self.product(data, i)).collect()
    }

    fn product(&self, data: &Data<'_>, i: usize) -> f64 {
        self.factors
            .iter()
            .map(|f| f.at(data.coordinates[f.coordinate].values[i]))
            .product()
    }
}

impl Fitted {
    pub(super) fn at(&self, data: &Data<'_>, i: usize) -> f64 {
        self.coefficient * self.form.product(data, i) + self.constant
    }

    pub(super) fn expression(&self, coordinates: &[Coordinate<'_>]) -> Expression {
        Expression {
            coefficient: self.coefficient,
            factors: self.form.factors.clone(),
            constant: self.form.has_constant.then_some(self.constant),
            letters: coordinates.iter().map(|c| c.letter.to_owned()).collect(),
        }
    }
}
