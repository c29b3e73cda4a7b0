//! The shortest formula for a shape: every product of a few functions of a few coordinates, by
//! least squares.
//!
//! ```text
//! y ~ c · f₁(x_i; a) · f₂(x_j; b) · ... (+ d),      fₖ in  x, x², √x, 1/x, exp(-x/a), exp(-(x/a)²), 1/(1 + x/a), 1/(1 + (x/a)²),
//!                                                          cos φ, sin φ, cos 2φ, sin 2φ
//! ```
//!
//! Coefficients c and d are linear and solved for; inner constants a and b are searched (variable
//! projection, Golub & Pereyra 1973), first on a grid, then by golden sections. A formula's length
//! counts coordinates, functions and constants but c: `U exp(-h/a)` is 3. The best of every length
//! is judged on blocks it has not seen, and the shortest within a standard error of the best is
//! taken (Breiman et al. 1984; the ladder of lengths is that of PySR, Cranmer 2023).

use std::collections::BTreeMap;
use std::fmt;

use airflow::GoldenSection;
use rayon::prelude::*;

use super::held_out::{self, FOLDS, Gain};
use super::line::Line;
use super::noise::Noise;

/// A coordinate that a formula may name.
#[derive(Clone, Copy, Debug)]
pub struct Coordinate<'a> {
    /// Its letter in the formula.
    pub letter: &'a str,
    /// Of every sample; samples where it is not finite are left out of the search and predicted as
    /// 0.
    pub values: &'a [f64],
    /// Whether it is an angle (rad): then only sines and cosines of it are tried.
    pub is_angle: bool,
}

/// Whether a function is tried on a coordinate, from whether that is an angle and its least value.
type Domain = fn(bool, f64) -> bool;
/// Lengths, speeds, times of any sign; those never negative; those never 0, either; angles.
const ANY: Domain = |is_angle, _| !is_angle;
const NOT_NEGATIVE: Domain = |is_angle, least| !is_angle && least >= 0.0;
const POSITIVE: Domain = |is_angle, least| !is_angle && least > 0.0;
const ANGLE: Domain = |is_angle, _| is_angle;

/// A function of one coordinate `x`, with an inner constant `a` in its unit where its text has one.
struct Function {
    /// In a formula, `X` and `A` standing for the coordinate's letter and the constant.
    text: &'static str,
    /// Coordinate, function and constant that it adds to a formula's length.
    length: usize,
    domain: Domain,
    at: fn(f64, f64) -> f64,
}

impl Function {
    const fn new(
        text: &'static str,
        length: usize,
        domain: Domain,
        at: fn(f64, f64) -> f64,
    ) -> Function {
        Function {
            text,
            length,
            domain,
            at,
        }
    }

    fn has_constant(&self) -> bool {
        self.text.contains('A')
    }
}

/// Powers of a coordinate come first: two of the same coordinate are a third.
const POWERS: usize = 4;
static FUNCTIONS: [Function; 12] = [
    Function::new("X", 1, ANY, |x, _| x),
    Function::new("X^2", 2, ANY, |x, _| x * x),
    // Of a coordinate that was never negative where it was fitted.
    Function::new("sqrt(X)", 2, NOT_NEGATIVE, |x, _| x.max(0.0).sqrt()),
    Function::new("/ X", 2, POSITIVE, |x, _| 1.0 / x),
    Function::new("exp(-X/A)", 2, NOT_NEGATIVE, |x, a| (-x / a).exp()),
    Function::new("exp(-(X/A)^2)", 2, ANY, |x, a| (-(x / a) * (x / a)).exp()),
    Function::new("/ (1 + X/A)", 2, NOT_NEGATIVE, |x, a| 1.0 / (1.0 + x / a)),
    Function::new("/ (1 + (X/A)^2)", 2, ANY, |x, a| {
        1.0 / (1.0 + (x / a) * (x / a))
    }),
    Function::new("cos(X)", 1, ANGLE, |x, _| x.cos()),
    Function::new("sin(X)", 1, ANGLE, |x, _| x.sin()),
    Function::new("cos(2 X)", 2, ANGLE, |x, _| (2.0 * x).cos()),
    Function::new("sin(2 X)", 2, ANGLE, |x, _| (2.0 * x).sin()),
];

/// A function of one coordinate, with its inner constant.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Factor {
    /// Which coordinate, by its place in the list.
    coordinate: usize,
    /// Place in [`FUNCTIONS`].
    function: usize,
    /// Inner constant in the coordinate's unit; 1 for a function that has none.
    constant: f64,
}

impl Factor {
    fn of(&self) -> &'static Function {
        &FUNCTIONS[self.function]
    }

    fn at(&self, x: f64) -> f64 {
        (self.of().at)(x, self.constant)
    }

    /// Two factors that would be one: the same function, or two powers, of one coordinate.
    fn is_like(&self, other: &Factor) -> bool {
        let is_power = |factor: &Factor| factor.function < POWERS;
        self.coordinate == other.coordinate
            && (self.function == other.function || (is_power(self) && is_power(other)))
    }
}

/// A product, with or without d.
#[derive(Clone, Debug, PartialEq)]
struct Form {
    /// In the order of coordinates.
    factors: Vec<Factor>,
    has_constant: bool,
}

impl Form {
    fn length(&self) -> usize {
        let factors: usize = self.factors.iter().map(|f| f.of().length).sum();
        factors + usize::from(self.has_constant)
    }

    fn product(&self, data: &Data<'_>, i: usize) -> f64 {
        let at = |f: &Factor| f.at(data.coordinates[f.coordinate].values[i]);
        self.factors.iter().map(at).product()
    }
}

/// A formula `c · f₁ · f₂ ... + d`, written as one by `Display`.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    form: Form,
    coefficient: f64,
    /// d; 0 where the form has none.
    constant: f64,
    letters: Vec<String>,
}

/// A formula and how it does on blocks that it was not fitted to.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundExpression {
    /// Fitted to everything.
    pub expression: Expression,
    /// Against predicting 0.
    pub gain: Gain,
}

/// Most length of a formula, d apart. Chosen here: four read at a glance.
const LONGEST: usize = 4;
/// Samples that the grid is searched on; more are thinned evenly. Chosen here, for time.
const SEARCHED: usize = 1000;
/// Samples that a fit needs. Chosen here.
const LEAST_SAMPLES: usize = 20;
/// Inner constants of the grid, over the coordinate's largest size: from a tenth to three times,
/// evenly in the logarithm.
const GRID: [f64; 7] = [0.1, 0.18, 0.31, 0.55, 0.97, 1.7, 3.0];
/// Forms of each length that are judged. Chosen here: rivals that the grid ranks close.
const JUDGED: usize = 4;
/// Golden sections of each constant (to a thousandth of the range), rounds over the constants, and
/// the factor either way that is searched: a step of the grid.
const SECTIONS: usize = 16;
const ROUNDS: usize = 3;
const REACH: f64 = 2.0;

/// The shortest formula within a standard error of the best; `None` where nothing can be fitted.
///
/// `y` is a residual or a correction in the values' unit, one value a sample.
#[must_use]
pub fn find(coordinates: &[Coordinate<'_>], y: &[f64], noise: &Noise) -> Option<FoundExpression> {
    let found = judged(coordinates, y, noise);
    let (best, others) = found.split_first()?;
    let close = |found: &&FoundExpression| {
        let beyond = best.gain.beyond(&found.gain);
        beyond.total <= beyond.standard_error
    };
    let close = [best].into_iter().chain(others.iter().filter(close));
    // The first of the shortest is the best of them.
    let shortest = close.min_by_key(|found| found.expression.form.length());
    shortest.cloned()
}

/// Formulas, the best on held-out blocks first.
fn judged(coordinates: &[Coordinate<'_>], y: &[f64], noise: &Noise) -> Vec<FoundExpression> {
    let finite =
        |i: &usize| y[*i].is_finite() && coordinates.iter().all(|c| c.values[*i].is_finite());
    let rows: Vec<usize> = (0..y.len()).filter(finite).collect();
    let fold_of = held_out::folds(&noise.blocks);
    let data = Data {
        coordinates,
        y,
        weights: &noise.weights(),
    };
    let mut found: Vec<FoundExpression> = best_forms(&data, &rows)
        .par_iter()
        .filter_map(|form| {
            let expression = data.fit(&rows, form)?;
            let mut after = y.to_vec();
            for fold in 0..FOLDS {
                let of_rows = rows.iter().copied();
                let (held, seen): (Vec<usize>, Vec<usize>) =
                    of_rows.partition(|&i| fold_of[i] == fold);
                // A fold that cannot be fitted is predicted as 0.
                let Some(fitted) = data.fit(&seen, &expression.form) else {
                    continue;
                };
                for i in held {
                    let product = fitted.form.product(&data, i);
                    after[i] -= fitted.coefficient * product + fitted.constant;
                }
            }
            let gain = Gain::between(noise, y, &after);
            Some(FoundExpression { expression, gain })
        })
        .collect();
    found.sort_by(|a, b| b.gain.total.total_cmp(&a.gain.total));
    found
}

/// What is fitted.
struct Data<'a> {
    coordinates: &'a [Coordinate<'a>],
    y: &'a [f64],
    weights: &'a [f64],
}

/// A factor on the searched samples.
struct FactorColumn {
    factor: Factor,
    values: Vec<f64>,
}

/// The best forms of each length, by sum of squares on the grid.
fn best_forms(data: &Data<'_>, rows: &[usize]) -> Vec<Form> {
    if rows.len() < LEAST_SAMPLES {
        return Vec::new();
    }
    let step = rows.len().div_ceil(SEARCHED);
    let rows: Vec<usize> = rows.iter().copied().step_by(step).collect();
    let mut grid = ExpressionGrid {
        data,
        columns: columns(data, &rows),
        taken: BTreeMap::new(),
        rows,
    };
    let ones = vec![1.0; grid.rows.len()];
    grid.extend(0, &ones, &mut Vec::new());
    grid.forms()
}

fn columns(data: &Data<'_>, rows: &[usize]) -> Vec<FactorColumn> {
    let mut columns = Vec::new();
    for (coordinate, of) in data.coordinates.iter().enumerate() {
        let values = || rows.iter().map(|&i| of.values[i]);
        let least = values().fold(f64::INFINITY, f64::min);
        let most = values().fold(0.0f64, |most, x| most.max(x.abs()));
        let functions = FUNCTIONS.iter().enumerate();
        for (function, tried) in functions.filter(|(_, f)| (f.domain)(of.is_angle, least)) {
            let scaled = GRID.map(|share| share * most);
            let constants = match tried.has_constant() {
                true => &scaled[..],
                false => &[1.0],
            };
            for &constant in constants.iter().filter(|a| **a > 0.0) {
                let factor = Factor {
                    coordinate,
                    function,
                    constant,
                };
                let values = values().map(|x| factor.at(x)).collect();
                columns.push(FactorColumn { factor, values });
            }
        }
    }
    columns
}

/// Names a form without its inner constants: whether it has d, and coordinates with functions.
type Key = (bool, Vec<(usize, usize)>);

/// The search over the grid of inner constants.
struct ExpressionGrid<'a> {
    data: &'a Data<'a>,
    rows: Vec<usize>,
    columns: Vec<FactorColumn>,
    /// Sum of squares taken, and the constants that take most.
    taken: BTreeMap<Key, (f64, Form)>,
}

impl ExpressionGrid<'_> {
    /// Tries the chosen factors times every later column, and goes on from there.
    fn extend(&mut self, length: usize, product: &[f64], chosen: &mut Vec<(usize, Factor)>) {
        let first = chosen.last().map_or(0, |(at, _)| at + 1);
        for at in first..self.columns.len() {
            let column = &self.columns[at];
            let factor = column.factor;
            let length = length + factor.of().length;
            if length > LONGEST || chosen.iter().any(|(_, other)| other.is_like(&factor)) {
                continue;
            }
            let pairs = product.iter().zip(&column.values);
            let product: Vec<f64> = pairs.map(|(p, v)| p * v).collect();
            chosen.push((at, factor));
            self.offer(&product, chosen);
            if length < LONGEST {
                self.extend(length, &product, chosen);
            }
            chosen.pop();
        }
    }

    fn offer(&mut self, product: &[f64], chosen: &[(usize, Factor)]) {
        let sums = self.data.sums(&self.rows, product.iter().copied());
        for has_constant in [false, true] {
            let Some((_, taken)) = solve(&sums, has_constant) else {
                continue;
            };
            let functions = chosen.iter().map(|(_, f)| (f.coordinate, f.function));
            let key = (has_constant, functions.collect());
            if self.taken.get(&key).is_none_or(|(most, _)| taken > *most) {
                let form = Form {
                    factors: chosen.iter().map(|(_, factor)| *factor).collect(),
                    has_constant,
                };
                self.taken.insert(key, (taken, form));
            }
        }
    }

    fn forms(self) -> Vec<Form> {
        let mut forms: Vec<(f64, Form)> = self.taken.into_values().collect();
        let by_length = |a: &Form, b: &Form| a.length().cmp(&b.length());
        // A stable sort: equals stay in the order of their names.
        forms.sort_by(|a, b| by_length(&a.1, &b.1).then(b.0.total_cmp(&a.0)));
        let of_length = forms.chunk_by(|a, b| by_length(&a.1, &b.1).is_eq());
        let judged = of_length.flat_map(|forms| forms.iter().take(JUDGED));
        judged.map(|(_, form)| form.clone()).collect()
    }
}

/// c and d of a product f, and the sum of squares they take; `None` where f is 0, not finite, or a
/// constant beside d.
fn solve(sums: &Line, has_constant: bool) -> Option<((f64, f64), f64)> {
    let line = match has_constant {
        true => sums.fit(1e-6)?,
        false => (sums.proportion(), 0.0),
    };
    let taken = sums.taken(line);
    taken.is_finite().then_some((line, taken))
}

impl Data<'_> {
    /// Weighted sums of a product and y over some samples.
    fn sums(&self, rows: &[usize], product: impl Iterator<Item = f64>) -> Line {
        let mut sums = Line::default();
        for (&i, f) in rows.iter().zip(product) {
            sums.add(self.weights[i], f, self.y[i]);
        }
        sums
    }

    /// Fits coefficients and inner constants, from the form's own.
    fn fit(&self, rows: &[usize], form: &Form) -> Option<Expression> {
        if rows.len() < LEAST_SAMPLES {
            return None;
        }
        let mut form = form.clone();
        let solved = |form: &Form| {
            let sums = self.sums(rows, rows.iter().map(|&i| form.product(self, i)));
            solve(&sums, form.has_constant)
        };
        let has_constant = |k: &usize| form.factors[*k].of().has_constant();
        let free: Vec<usize> = (0..form.factors.len()).filter(has_constant).collect();
        // One constant is found in one round.
        let rounds = if free.len() > 1 { ROUNDS } else { 1 };
        for _ in 0..rounds {
            for &k in &free {
                let middle = form.factors[k].constant.ln();
                let reach = REACH.ln();
                let best = GoldenSection::of([middle - reach, middle + reach], SECTIONS, |log| {
                    form.factors[k].constant = log.exp();
                    solved(&form).map_or(f64::INFINITY, |(_, taken)| -taken)
                });
                form.factors[k].constant = best.middle().exp();
            }
        }
        let ((coefficient, constant), _) = solved(&form)?;
        let letters = self.coordinates.iter().map(|c| c.letter.to_owned());
        Some(Expression {
            form,
            coefficient,
            constant,
            letters: letters.collect(),
        })
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", three_digits(self.coefficient))?;
        // What divides comes last: from left to right, everything before it is divided.
        let is_divisor = |factor: &&Factor| factor.of().text.starts_with('/');
        let (divisors, factors): (Vec<&Factor>, Vec<&Factor>) =
            self.form.factors.iter().partition(is_divisor);
        for factor in factors.into_iter().chain(divisors) {
            // The constant first: a letter may hold an A, a number holds no X.
            let text = factor.of().text;
            let text = text.replace('A', &three_digits(factor.constant));
            let letter = &self.letters[factor.coordinate];
            let text = match letter.contains('/') {
                true => text.replace('X', &format!("({letter})")),
                false => text.replace('X', letter),
            };
            write!(f, " {text}")?;
        }
        match self.constant {
            _ if !self.form.has_constant => Ok(()),
            d if d < 0.0 => write!(f, " - {}", three_digits(-d)),
            d => write!(f, " + {}", three_digits(d)),
        }
    }
}

/// Three significant digits, without zeros at the end.
fn three_digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor() as i32;
    if !(-4..6).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    let decimals = usize::try_from(2 - magnitude).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests;
