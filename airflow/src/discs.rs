//! Quadrature over the rotor discs of a receiver.

use std::f64::consts::FRAC_PI_3;

/// Weight of a disc's centre, relative to its disc.
const CENTRE_WEIGHT: f64 = 1.0 / 4.0;

/// Weight of each of the six points on the ring at √(2/3) of the disc's radius, relative to its
/// disc.
const RING_WEIGHT: f64 = 1.0 / 8.0;

/// Points over level rotor discs, all at the height of the drone's centre, and what each counts in
/// their mean.
///
/// Filled by [`crate::Airframe::disc_points`]; make your own for finer discs. The two lists have
/// the same length.
#[derive(Clone, Debug, PartialEq)]
pub struct DiscPoints {
    /// Offset (x, y) of each point from the drone's centre (m), world frame at yaw 0.
    pub offsets_m: Vec<[f64; 2]>,
    /// Weight of each point; they sum to 1.
    pub weights: Vec<f64>,
}

impl DiscPoints {
    /// Seven points on each of several equal discs: the hub, and six at √(2/3) of the radius, the
    /// first along x. Exact for polynomials up to degree 5 (Radon's seven-point rule, here for the
    /// disc).
    #[must_use]
    pub(crate) fn seven_per_disc(hubs_m: &[[f64; 2]], disc_radius_m: f64) -> DiscPoints {
        let ring_m = (2.0_f64 / 3.0).sqrt() * disc_radius_m;
        let share = 1.0 / hubs_m.len() as f64;
        let mut offsets_m = Vec::with_capacity(7 * hubs_m.len());
        let mut weights = Vec::with_capacity(7 * hubs_m.len());
        for &[x, y] in hubs_m {
            offsets_m.push([x, y]);
            weights.push(share * CENTRE_WEIGHT);
            for k in 0..6 {
                let azimuth = f64::from(k) * FRAC_PI_3;
                offsets_m.push([x + ring_m * azimuth.cos(), y + ring_m * azimuth.sin()]);
                weights.push(share * RING_WEIGHT);
            }
        }
        DiscPoints { offsets_m, weights }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of x^m y^n over a disc of radius 1 centred at 0, by the radial integral and Wallis'
    /// formula.
    fn moment(m: i32, n: i32) -> f64 {
        fn double_factorial(k: i32) -> f64 {
            if k <= 0 {
                1.0
            } else {
                f64::from(k) * double_factorial(k - 2)
            }
        }
        if m % 2 == 1 || n % 2 == 1 {
            return 0.0;
        }
        let circle = double_factorial(m - 1) * double_factorial(n - 1) / double_factorial(m + n);
        circle * 2.0 / f64::from(m + n + 2)
    }

    #[test]
    fn polynomials_of_degree_five_are_averaged_exactly() {
        let rule = DiscPoints::seven_per_disc(&[[0.0, 0.0]], 1.0);
        for m in 0..=5 {
            for n in 0..=(5 - m) {
                let mean: f64 = rule
                    .offsets_m
                    .iter()
                    .zip(&rule.weights)
                    .map(|(p, w)| w * p[0].powi(m) * p[1].powi(n))
                    .sum();
                // Rounding of seven terms of size at most 1.
                assert!((mean - moment(m, n)).abs() < 1e-15, "x^{m} y^{n}: {mean}");
            }
        }
    }

    #[test]
    fn weights_sum_to_one_whatever_the_number_of_discs() {
        for discs in 1..=8 {
            let rule = DiscPoints::seven_per_disc(&vec![[0.3, -0.2]; discs], 0.1);
            // Rounding of up to 56 terms.
            assert!((rule.weights.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        }
    }
}
