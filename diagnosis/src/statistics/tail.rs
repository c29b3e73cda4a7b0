//! Tail probabilities.

use statrs::function::erf::{erfc, erfc_inv};

/// Probability that a normal value lies further than `z` standard deviations from its mean, on
/// either side: `erfc(|z|/√2)`.
#[must_use]
pub fn normal_two_sided(z: f64) -> f64 {
    erfc(z.abs() / std::f64::consts::SQRT_2)
}

/// The standard deviations beyond which a normal value lies, on either side, with probability `p`.
#[must_use]
pub fn normal_two_sided_quantile(p: f64) -> f64 {
    std::f64::consts::SQRT_2 * erfc_inv(p)
}

/// Probability that a value of Student's law with so many degrees of freedom lies further than `t`
/// from 0, on either side, by the regularised incomplete beta function.
#[must_use]
pub fn student_two_sided(t: f64, freedom: f64) -> f64 {
    statrs::function::beta::beta_reg(0.5 * freedom, 0.5, freedom / (freedom + t * t))
}

/// Probability that a Brownian bridge leaves ±`x` (Kolmogorov 1933): `2 Σ (-1)^(k+1) exp(-2 k²
/// x²)`.
#[must_use]
pub fn kolmogorov(x: f64) -> f64 {
    // Below this the sum needs many terms, and the probability is 1 to nine digits.
    if x < 0.3 {
        return 1.0;
    }
    let term = |k: i32| {
        let kx = f64::from(k) * x;
        let size = 2.0 * (-2.0 * kx * kx).exp();
        if k % 2 == 1 { size } else { -size }
    };
    (1..=20).map(term).sum::<f64>().clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_tails_match_tables() {
        for (z, p) in [
            (0.0, 1.0),
            (1.959_964, 0.05),
            (3.290_527, 1e-3),
            (4.891_638, 1e-6),
            (-4.891_638, 1e-6),
        ] {
            // The fit's own error and the six decimals of the table.
            assert!((normal_two_sided(z) / p - 1.0).abs() < 3e-6, "{z}");
            assert!((normal_two_sided_quantile(p) - z.abs()).abs() < 3e-6, "{z}");
        }
    }

    #[test]
    fn student_s_tails_match_tables() {
        for (t, freedom, p) in [
            (2.228, 10.0, 0.05),
            (4.604, 4.0, 0.01),
            (3.551, 30.0, 0.0013),
        ] {
            // The three decimals of the table.
            assert!(
                (student_two_sided(t, freedom) / p - 1.0).abs() < 2e-2,
                "{t}"
            );
        }
    }

    #[test]
    fn the_bridge_leaves_its_tabulated_bands() {
        for (x, p) in [(1.358_099, 0.05), (1.627_624, 0.01), (1.949_475, 0.001)] {
            assert!((kolmogorov(x) / p - 1.0).abs() < 1e-4, "{x}");
        }
        assert_eq!(kolmogorov(0.1), 1.0);
    }
}
