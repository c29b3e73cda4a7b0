//! The shortest formula for a shape: every product of a few functions of a few coordinates, by least squares.
//!
//! ```text
//! y ~ c · f₁(x_i; a) · f₂(x_j; b) · ... (+ d),      fₖ in  x, x², √x, 1/x, exp(-x/a), exp(-(x/a)²), 1/(1 + x/a), 1/(1 + (x/a)²),
//!                                                          cos φ, sin φ, cos 2φ, sin 2φ
//! ```
//!
//! Coefficients c and d are linear and solved for; inner constants a and b are searched (variable projection, Golub &
//! Pereyra 1973), first on a grid, then by golden sections. A formula's length counts coordinates, functions and constants
//! but c: `U exp(-h/a)` is 3. The best of every length is judged on blocks it has not seen, and the shortest within a standard
//! error of the best is taken (Breiman et al. 1984; the ladder of lengths is that of PySR, Cranmer 2023).

mod factor;
mod search;

use std::fmt;

pub use factor::{Factor, Shape};
use rayon::prelude::*;

use super::held_out::{self, Gain};
use super::noise::Whitener;
use super::sequence::Blocks;

/// A coordinate that a formula may name.
#[derive(Clone, Copy, Debug)]
pub struct Coordinate<'a> {
    /// Its letter in the formula.
    pub letter: &'a str,
    /// Of every sample; samples where it is not finite are left out of the search and predicted as 0.
    pub values: &'a [f64],
    /// Whether it is an angle (rad): then only sines and cosines of it are tried.
    pub is_angle: bool,
}

/// A formula.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    /// c.
    pub coefficient: f64,
    /// In the order of coordinates.
    pub factors: Vec<Factor>,
    /// d; `None`: 0 by form.
    pub constant: Option<f64>,
    letters: Vec<String>,
}

/// A formula and how it does on blocks that it was not fitted to.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Fitted to everything.
    pub expression: Expression,
    /// Against predicting 0.
    pub gain: Gain,
}

/// Most length of a formula, d apart. Chosen here: four read at a glance.
pub const LONGEST: usize = 4;
/// Folds of blocks.
const FOLDS: usize = 6;

/// The shortest formula within a standard error of the best, first, then the others that were judged, best first; empty where nothing
/// can be fitted.
///
/// `y` is a residual or a correction in the values' unit.
#[must_use]
pub fn find(
    coordinates: &[Coordinate<'_>],
    y: &[f64],
    whitener: &Whitener,
    blocks: &Blocks,
) -> Vec<Found> {
    let finite =
        |i: &usize| y[*i].is_finite() && coordinates.iter().all(|c| c.values[*i].is_finite());
    let rows: Vec<usize> = (0..y.len()).filter(finite).collect();
    let weights: Vec<f64> = whitener.sd().iter().map(|sd| 1.0 / (sd * sd)).collect();
    let fold_of = held_out::folds(blocks, FOLDS);
    let data = search::Data {
        coordinates,
        y,
        weights: &weights,
    };
    let forms = search::best_forms(&data, &rows);
    let mut found: Vec<(usize, Found)> = forms
        .par_iter()
        .filter_map(|form| {
            let fitted = search::fit(&data, &rows, form)?;
            let mut after = y.to_vec();
            for fold in 0..FOLDS {
                let seen: Vec<usize> = rows
                    .iter()
                    .copied()
                    .filter(|&i| fold_of[i] != fold)
                    .collect();
                // A fold that cannot be fitted is predicted as 0.
                let Some(fitted) = search::fit(&data, &seen, &fitted.form) else {
                    continue;
                };
                for &i in rows.iter().filter(|&&i| fold_of[i] == fold) {
                    after[i] -= fitted.at(&data, i);
                }
            }
            let gain = Gain::between(whitener, blocks, y, &after);
            let length = fitted.form.length();
            let expression = fitted.expression(coordinates);
            Some((length, Found { expression, gain }))
        })
        .collect();
    found.sort_by(|a, b| b.1.gain.total.total_cmp(&a.1.gain.total));
    let shortest = found.first().map(|(_, best)| {
        let close = |found: &Found| {
            let beyond = best.gain.beyond(&found.gain);
            beyond.total <= beyond.standard_error
        };
        (0..found.len())
            .filter(|&k| k == 0 || close(&found[k].1))
            // The first of the shortest is the best of them.
            .min_by_key(|&k| found[k].0)
            .unwrap_or(0)
    });
    if let Some(k) = shortest {
        let chosen = found.remove(k);
        found.insert(0, chosen);
    }
    found.into_iter().map(|(_, found)| found).collect()
}

impl Expression {
    /// At coordinates in the order that it was found with.
    #[must_use]
    pub fn at(&self, x: &[f64]) -> f64 {
        let product: f64 = self.factors.iter().map(|f| f.at(x[f.coordinate])).product();
        self.coefficient * product + self.constant.unwrap_or(0.0)
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", factor::three_digits(self.coefficient))?;
        for factor in &self.factors {
            write!(f, " {}", factor.written(&self.letters[factor.coordinate]))?;
        }
        match self.constant {
            Some(d) if d < 0.0 => write!(f, " - {}", factor::three_digits(-d)),
            Some(d) => write!(f, " + {}", factor::three_digits(d)),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;
