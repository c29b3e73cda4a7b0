//! What any function of one coordinate explains: a broken line.
//!
//! Straight between knots at quantiles of the coordinate, fitted to whitened values by least
//! squares with gross errors weighed down, and held out by folds of blocks.

use nalgebra::{DMatrix, DVector};

use super::held_out::{FOLDS, folds};
use super::noise::Noise;
use super::quantile::{difference, quantile_edges};
use super::robust::weight;

/// Pieces of the line. Chosen here: as many bins as the test for anything has of a covariate.
const PIECES: usize = 8;
/// Rounds of weights. Chosen here: the second changes a mean by less than its error.
const ROUNDS: usize = 3;
/// Weight that draws every knot to 0, in parts of the mean one: keeps knots that no sample is near.
const RIDGE: f64 = 1e-6;

/// What a line predicts for blocks it has not seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Of every sample, by the line that was fitted without its fold, in the unit of the values.
    pub predictions: Vec<f64>,
    /// What that leaves of the values.
    pub left: Vec<f64>,
    /// Knots of the line fitted to all samples, and its values there.
    pub line: Vec<(f64, f64)>,
}

/// Fits values `y` at a coordinate, one of each a sample, and holds out; `None` where the
/// coordinate does not vary.
#[must_use]
pub fn held_out(coordinate: &[f64], y: &[f64], noise: &Noise) -> Option<Curve> {
    let knots = quantile_edges(coordinate, PIECES);
    if knots.len() < 2 {
        return None;
    }
    let hats = DMatrix::from_fn(y.len(), knots.len(), |i, k| hat(&knots, k, coordinate[i]));
    let columns = hats.column_iter();
    let whitened = columns.map(|hat| DVector::from_vec(noise.whiten(hat.as_slice())));
    let whitened = DMatrix::from_columns(&whitened.collect::<Vec<_>>());
    let target = DVector::from_vec(noise.whiten(y));
    let fold_of = folds(&noise.blocks);
    let at_knots = |fold: usize| {
        let mut values = DVector::zeros(knots.len());
        for _ in 0..ROUNDS {
            let rest = &target - &whitened * &values;
            let counts = |i: usize| f64::from(u8::from(fold_of[i] != fold));
            let weights = DVector::from_fn(y.len(), |i, _| counts(i) * weight(rest[i]));
            let mut weighted = whitened.clone();
            for mut column in weighted.column_iter_mut() {
                column.component_mul_assign(&weights);
            }
            let normal = weighted.tr_mul(&whitened);
            let ridge = RIDGE * normal.trace() / knots.len() as f64 + f64::MIN_POSITIVE;
            let normal = normal + DMatrix::identity(knots.len(), knots.len()) * ridge;
            values = normal.cholesky()?.solve(&weighted.tr_mul(&target));
        }
        Some(values)
    };
    let mut predictions = vec![0.0; y.len()];
    for fold in 0..FOLDS {
        let of_fold = &hats * at_knots(fold)?;
        let samples = (0..y.len()).filter(|&i| fold_of[i] == fold);
        samples.for_each(|i| predictions[i] = of_fold[i]);
    }
    // No fold has this number: nothing is left out.
    let values = at_knots(FOLDS)?;
    Some(Curve {
        left: difference(y, &predictions),
        predictions,
        line: knots.iter().copied().zip(values.iter().copied()).collect(),
    })
}

/// Height at a place of the hat over a knot: 1 there, 0 at its neighbours and beyond.
fn hat(knots: &[f64], knot: usize, at: f64) -> f64 {
    let at = at.clamp(knots[0], knots[knots.len() - 1]);
    let towards = |other: usize| (at - knots[other]) / (knots[knot] - knots[other]);
    let side = match at < knots[knot] {
        true => knot.checked_sub(1),
        false => Some(knot + 1).filter(|&next| next < knots.len()),
    };
    side.map_or(1.0, |other| towards(other).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::draws::Draws;
    use crate::statistics::noise::{NoiseModel, Whitener};
    use crate::statistics::sequence::{Blocks, Sequence};

    #[test]
    fn a_root_is_followed_within_a_tenth_of_its_scatter() {
        let t_s: Vec<f64> = (0..1200).map(f64::from).collect();
        let sequence = Sequence::new(&t_s, &[0; 1200]);
        let model = NoiseModel::white(0.1);
        let noise = Noise {
            whitener: Whitener::new(&model, &sequence, &[0.0; 1200]),
            blocks: Blocks::new(&sequence, &t_s),
        };
        let mut random = Draws::new(1);
        let x: Vec<f64> = (0..1200).map(|_| random.between(0.5, 4.0)).collect();
        let y: Vec<f64> = x.iter().map(|x| x.sqrt() + 0.1 * random.normal()).collect();
        let curve = held_out(&x, &y, &noise).expect("x varies");
        let off = |(x, value): (&f64, &f64)| (value - x.sqrt()).powi(2);
        let square: f64 = x.iter().zip(&curve.predictions).map(off).sum();
        // Nine knots of 1200 samples: 0.1 √(9/1000), and the chord of a piece.
        assert!(
            (square / 1200.0).sqrt() < 0.012,
            "{}",
            (square / 1200.0).sqrt()
        );
        assert_eq!(curve.line.len(), 9);
        assert!(held_out(&vec![1.0; 1200], &y, &noise).is_none());
    }
}
