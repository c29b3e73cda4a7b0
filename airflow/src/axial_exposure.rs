//! Axial exposure below 2.5 motor distances, in closed form: the integral of the axial speed over
//! time along a straight path.

use nalgebra::Vector3;

use crate::far_field::FarField;

impl FarField {
    /// Integral over time of the axial speed (m) at a point that goes straight and steadily from
    /// one offset to another in `duration_s`. Offsets are from the rotor centre, world frame, z up.
    /// `None` if either end is above 2.5 l.
    ///
    /// Closed form for every direction: along the path both σ and the denominator's `σ² + G r²` are
    /// polynomials. In the stretched space `P = (√G x, √G y, σ)` the jet is `k σ³/|P|⁴`; with τ the
    /// stretched arc length from the path's nearest approach `ρ` to the virtual origin,
    /// `σ = σ_n + u τ`, `c = σ_n/ρ`, `L = τ² + ρ²`:
    ///
    /// ```text
    /// ∫ σ³/L² dτ = u³ (ln L)/2 + [ρ² u (u² - 3 c²) + ρ τ c (c² - 3 u²)] / (2 L) + c (c² + 3 u²) atan(τ/ρ) / 2
    /// ```
    ///
    /// A level crossing through the axis at speed `v`, from far away to far away, gives
    /// `π k / (2 √G v)`, at every depth the same.
    #[must_use]
    pub fn dose_m(&self, from_m: Vector3<f64>, to_m: Vector3<f64>, duration_s: f64) -> Option<f64> {
        let stretch = self.steepness.sqrt();
        let start = Vector3::new(
            stretch * from_m.x,
            stretch * from_m.y,
            self.sigma_m(-from_m.z)?,
        );
        let end = Vector3::new(stretch * to_m.x, stretch * to_m.y, self.sigma_m(-to_m.z)?);
        let length = (end - start).norm();
        // A standing point, or one whose step is lost in the rounding of the closed form: the speed
        // is linear along it.
        if length < 1e-6 * start.norm() {
            let middle = 0.5 * (start + end);
            let speed_mps = self.decay_m2_per_s * middle.z * middle.z * middle.z
                / middle.norm_squared().powi(2);
            return Some(duration_s * speed_mps);
        }
        let along = (end - start) / length;
        let nearest = along.cross(&start.cross(&along)); // start minus its part along the path, without cancellation
        let rho = nearest.norm();
        let c = if rho > 0.0 { nearest.z / rho } else { 0.0 };
        let u = along.z;
        let rational_and_atan = |tau: f64| {
            let l = tau * tau + rho * rho;
            let fraction =
                rho * rho * u * (u * u - 3.0 * c * c) + rho * tau * c * (c * c - 3.0 * u * u);
            0.5 * fraction / l + 0.5 * c * (c * c + 3.0 * u * u) * tau.atan2(rho)
        };
        let logarithm = u * u * u * (end.norm() / start.norm()).ln();
        let integral =
            logarithm + rational_and_atan(end.dot(&along)) - rational_and_atan(start.dot(&along));
        Some(duration_s * self.decay_m2_per_s * integral / length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::Jet;

    /// Offboard 2 with propellers canted outwards, so that no formula can forget the width factor.
    fn jet() -> FarField {
        FarField::new(9.66, 0.266, 1.15, &Jet::default())
    }

    /// Simpson over the model itself.
    fn dose_by_quadrature_m(from_m: Vector3<f64>, to_m: Vector3<f64>, duration_s: f64) -> f64 {
        let n = 4000;
        let speed = |i: i32| {
            let p = from_m + (to_m - from_m) * (f64::from(i) / f64::from(n));
            jet().axial_speed_mps(-p.z, p.x.hypot(p.y)).expect("deep")
        };
        let weight = |i: i32| {
            if i == 0 || i == n {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        duration_s * (0..=n).map(|i| weight(i) * speed(i)).sum::<f64>() / (3.0 * f64::from(n))
    }

    #[test]
    fn the_dose_along_any_straight_path_is_that_of_a_quadrature() {
        let corners = [
            Vector3::new(-3.0, 0.0, -1.0),
            Vector3::new(3.0, 0.0, -1.0),
            Vector3::new(0.0, 0.0, -0.7),
            Vector3::new(0.0, 0.0, -9.0),
            Vector3::new(0.3, -0.2, -0.7),
            Vector3::new(0.3, -0.2, -9.0),
            Vector3::new(-1.0, 2.0, -4.0),
            Vector3::new(0.31, -0.2, -9.0),
            Vector3::new(0.300_000_1, -0.2, -9.0),
        ];
        for from_m in corners {
            for to_m in corners {
                let closed_m = jet().dose_m(from_m, to_m, 7.0).expect("far field");
                let summed_m = dose_by_quadrature_m(from_m, to_m, 7.0);
                // Simpson with 4000 intervals on these paths, and the cancellation of a step of
                // 1e-7 m in 9 m.
                assert!(
                    (closed_m / summed_m - 1.0).abs() < 1e-7,
                    "{from_m} to {to_m}: {closed_m} and {summed_m} m"
                );
            }
        }
    }
}
