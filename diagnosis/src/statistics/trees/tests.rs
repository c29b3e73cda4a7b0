//! Laws that trees must learn, and noise that they must not.

use super::*;
use crate::statistics::draws::Draws;
use crate::statistics::noise::{NoiseModel, Whitener};
use crate::statistics::sequence::{Blocks, Sequence};

/// Five covariates, even from 0 to 1.
fn covariates(count: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut random = Draws::new(seed);
    let mut column = || (0..count).map(|_| random.uniform()).collect();
    (0..5).map(|_| column()).collect()
}

fn predict(forest: &Forest, x: &[Vec<f64>]) -> Vec<f64> {
    let of_row = |row: usize| forest.value(|c| bin_of(&forest.edges[c], x[c][row]));
    (0..x[0].len()).map(of_row).collect()
}

#[test]
fn an_interaction_of_two_covariates_is_learned() {
    let x = covariates(4000, 1);
    let law = |row: &[f64]| if row[0] > 0.5 { row[1] } else { -row[1] };
    let truth: Vec<f64> = (0..4000).map(|i| law(&[x[0][i], x[1][i]])).collect();
    let forest = fit(&x, &truth, &[1.0; 4000]);
    let fresh = covariates(1000, 2);
    let predicted = predict(&forest, &fresh);
    let (mut left, mut all) = (0.0, 0.0);
    for i in 0..1000 {
        let value = law(&[fresh[0][i], fresh[1][i]]);
        left += (predicted[i] - value).powi(2);
        all += value * value;
    }
    // Bins of 1/32 leave an error of 1/(32 √12), and one bin in 32 straddles the jump.
    assert!(left / all < 0.05, "{}", left / all);
    let shares = forest.shares();
    assert!(shares[0] + shares[1] > 0.99, "{shares:?}");
}

#[test]
fn the_partial_dependence_follows_the_law_of_its_covariate() {
    let x = covariates(4000, 3);
    let y: Vec<f64> = (0..4000).map(|i| x[2][i].powi(2) + x[3][i]).collect();
    let forest = fit(&x, &y, &[1.0; 4000]);
    let at = [0.1, 0.5, 0.9];
    let curve = forest.partial_dependence(&x, 2, &at);
    for pair in [(0, 1), (1, 2)] {
        let expected = at[pair.1].powi(2) - at[pair.0].powi(2);
        // A bin's width times the steepest slope, 2/32.
        assert!(
            (curve[pair.1] - curve[pair.0] - expected).abs() < 0.07,
            "{curve:?}"
        );
    }
}

#[test]
fn weights_of_zero_do_not_count() {
    let x = covariates(1000, 4);
    let y: Vec<f64> = (0..1000).map(|i| if i < 500 { 1.0 } else { 9.0 }).collect();
    let weights: Vec<f64> = (0..1000).map(|i| if i < 500 { 1.0 } else { 0.0 }).collect();
    let forest = fit(&x, &y, &weights);
    for value in predict(&forest, &x) {
        // Shrinkage: 10 of 500, and less with every tree.
        assert!((value - 1.0).abs() < 0.02, "{value}");
    }
}

#[test]
fn missing_covariates_are_a_regime_of_their_own() {
    let mut x = covariates(2000, 5);
    for i in (0..2000).step_by(4) {
        x[0][i] = f64::NAN;
    }
    let y: Vec<f64> = (0..2000)
        .map(|i| if i % 4 == 0 { 2.0 } else { 0.0 })
        .collect();
    let forest = fit(&x, &y, &[1.0; 2000]);
    let predicted = predict(&forest, &x);
    // What ten samples' weight of shrinkage leaves in leaves of 500.
    assert!((predicted[0] - 2.0).abs() < 0.05 && predicted[1].abs() < 0.05);
}

fn white_noise(t_s: &[f64]) -> Noise {
    let sequence = Sequence::new(t_s, &vec![0; t_s.len()]);
    let noise = NoiseModel::white(1.0);
    Noise {
        whitener: Whitener::new(&noise, &sequence, &vec![0.0; t_s.len()]),
        blocks: Blocks::new(&sequence, t_s),
    }
}

#[test]
fn held_out_gain_is_positive_for_a_law_and_negative_for_noise() {
    let x = covariates(2000, 6);
    let t_s: Vec<f64> = (0..2000).map(f64::from).collect();
    let scatter = white_noise(&t_s);
    let mut random = Draws::new(7);
    let noise: Vec<f64> = (0..2000).map(|_| random.normal()).collect();
    let gain = held_out(&x, &noise, &scatter).gain;
    assert!(gain.total < 0.0, "{}", gain.total);
    let law: Vec<f64> = (0..2000)
        .map(|i| noise[i] + 2.0 * (x[1][i] - 0.5))
        .collect();
    let gain = held_out(&x, &law, &scatter).gain;
    // The law's own χ²/2 is 2000 · 4/12/2 = 333, of which pseudo-Huber keeps 0.88.
    assert!(
        gain.total > 200.0 && gain.total > 5.0 * gain.standard_error,
        "{gain:?}"
    );
}

#[test]
fn one_thread_and_two_predict_the_same_bits() {
    let x = covariates(600, 8);
    let y: Vec<f64> = (0..600).map(|i| x[0][i] - x[4][i]).collect();
    let t_s: Vec<f64> = (0..600).map(f64::from).collect();
    let scatter = white_noise(&t_s);
    let run = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a small pool")
            .install(|| held_out(&x, &y, &scatter))
    };
    assert_eq!(run(1), run(2));
}
