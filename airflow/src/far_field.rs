//! The merged jet from 2.5 motor distances down: profile, decay, spread, entrained radial flow, gradients, fluxes.
//!
//! Frame: depth `s` below the rotor plane, radius `r` from the axis, both in metres; axial speed positive downwards, radial speed
//! positive outwards. Everything that needs a depth is `None` above 2.5 l, where the fit does not hold.
//!
//! In metres the paper's three formulas collapse into one rational function, which is what makes a point cheap (one division, no
//! power, no exponential):
//!
//! ```text
//! σ = s - s₀ l           depth below the virtual origin (m)
//! U = k σ³ / (σ² + G r²)²,     k = U_H B l / q,     G = a / (q S)²
//! ```

use std::f64::consts::PI;

use crate::jet::{FAR_FIELD_FROM_S_OVER_L, Jet, PROFILE_A};

/// Mean flow of one hovering drone below 2.5 motor distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FarField {
    /// Shallowest depth at which the fit holds (m).
    from_m: f64,
    /// `-s₀ l`: the virtual origin's height above the rotor plane (m).
    origin_above_m: f64,
    /// `k = U_H B l / q` (m²/s): centreline speed times depth below the virtual origin.
    pub(crate) decay_m2_per_s: f64,
    /// `q S`: half-width over depth below the virtual origin.
    spreading: f64,
    /// `G = a/(q S)²`.
    pub(crate) steepness: f64,
}

impl FarField {
    /// The jet of a drone with induced velocity `U_H` and motor distance `l`; `width_factor` widens it at constant momentum.
    #[must_use]
    pub fn new(
        induced_velocity_mps: f64,
        motor_distance_m: f64,
        width_factor: f64,
        jet: &Jet,
    ) -> FarField {
        let spreading = width_factor * jet.spreading;
        FarField {
            from_m: FAR_FIELD_FROM_S_OVER_L * motor_distance_m,
            origin_above_m: -jet.origin * motor_distance_m,
            decay_m2_per_s: induced_velocity_mps * jet.centreline * motor_distance_m / width_factor,
            spreading,
            steepness: PROFILE_A / (spreading * spreading),
        }
    }

    /// The same formulas right up to the rotor plane, where the fit does not hold: what [`crate::Wake::extrapolated`] is made of.
    #[must_use]
    pub fn extrapolated(mut self) -> FarField {
        self.from_m = f64::MIN_POSITIVE; // any depth below the plane, but not the plane
        self
    }

    pub(crate) fn is_extrapolated(&self) -> bool {
        self.from_m == f64::MIN_POSITIVE
    }

    /// Shallowest depth (m) at which it is evaluated: 2.5 l, where the fit begins to hold.
    #[must_use]
    pub fn from_m(&self) -> f64 {
        self.from_m
    }

    /// `σ` at a depth where the fit holds.
    pub(crate) fn sigma_m(&self, depth_m: f64) -> Option<f64> {
        (depth_m >= self.from_m).then_some(depth_m + self.origin_above_m)
    }

    /// Speed on the axis (m/s).
    ///
    /// ```text
    /// U_C = U_H B / (q (s/l - s₀))
    /// ```
    #[must_use]
    pub fn centreline_mps(&self, depth_m: f64) -> Option<f64> {
        Some(self.decay_m2_per_s / self.sigma_m(depth_m)?)
    }

    /// Radius (m) at which the speed is half of that on the axis.
    ///
    /// ```text
    /// r_half = q S l (s/l - s₀)
    /// ```
    #[must_use]
    pub fn half_width_m(&self, depth_m: f64) -> Option<f64> {
        Some(self.spreading * self.sigma_m(depth_m)?)
    }

    /// Mean axial speed (m/s), downwards.
    ///
    /// ```text
    /// U = U_C / (1 + (√2 - 1) ξ²)²,   ξ = r / r_half
    /// ```
    #[must_use]
    pub fn axial_speed_mps(&self, depth_m: f64, radius_m: f64) -> Option<f64> {
        self.sigma_m(depth_m)?;
        Some(self.level(depth_m).axial_speed_mps(radius_m * radius_m))
    }

    /// Mean radial speed (m/s), outwards, from continuity: outwards near the axis, inwards (entrainment) beyond ξ = 1/√a = 1.5538,
    /// where it tends to `-U_C q S/(2 a ξ)`.
    ///
    /// ```text
    /// V/U_C = q S ξ (1 - a ξ²) / (2 (1 + a ξ²)²)         (Pope, Turbulent Flows, 2000, ch. 5, in this form; recalled)
    /// ```
    #[must_use]
    pub fn radial_speed_mps(&self, depth_m: f64, radius_m: f64) -> Option<f64> {
        self.sigma_m(depth_m)?;
        Some(radius_m * self.radial_speed_over_radius_per_s(depth_m, radius_m * radius_m))
    }

    /// `V/r` (1/s), which is finite on the axis. Also upstream of 2.5 l, for the merging near field.
    pub(crate) fn radial_speed_over_radius_per_s(&self, depth_m: f64, radius2_m2: f64) -> f64 {
        let sigma_m = depth_m + self.origin_above_m;
        let x = self.steepness * radius2_m2 / (sigma_m * sigma_m); // a ξ²
        self.decay_m2_per_s * (1.0 - x) / (2.0 * sigma_m * sigma_m * (1.0 + x) * (1.0 + x))
    }

    /// `∫₀^r U r' dr' / r²` (m/s): the stream function over `r²`, finite on the axis.
    pub(crate) fn stream_over_radius2_mps(&self, depth_m: f64, radius2_m2: f64) -> f64 {
        let sigma_m = depth_m + self.origin_above_m;
        let x = self.steepness * radius2_m2 / (sigma_m * sigma_m);
        self.decay_m2_per_s / (2.0 * sigma_m * (1.0 + x))
    }

    /// Change of the axial speed with radius, `∂U/∂r` (1/s).
    ///
    /// ```text
    /// ∂U/∂r = -4 a ξ U_C / ( r_half (1 + a ξ²)³ )
    /// ```
    #[must_use]
    pub fn radial_gradient_per_s(&self, depth_m: f64, radius_m: f64) -> Option<f64> {
        let sigma_m = self.sigma_m(depth_m)?;
        let x = self.steepness * radius_m * radius_m / (sigma_m * sigma_m);
        let cube = (1.0 + x) * (1.0 + x) * (1.0 + x);
        Some(
            -4.0 * self.decay_m2_per_s * self.steepness * radius_m
                / (sigma_m * sigma_m * sigma_m * cube),
        )
    }

    /// Change of the axial speed with depth, `∂U/∂s` (1/s): negative near the axis, positive where `a ξ² > 1/3`, because the
    /// jet widens. Nowhere larger in size than on the axis, `U_C/σ`.
    ///
    /// ```text
    /// ∂U/∂s = U_C (3 a ξ² - 1) / ( σ (1 + a ξ²)³ )
    /// ```
    #[must_use]
    pub fn axial_gradient_per_s(&self, depth_m: f64, radius_m: f64) -> Option<f64> {
        let sigma_m = self.sigma_m(depth_m)?;
        let x = self.steepness * radius_m * radius_m / (sigma_m * sigma_m);
        let cube = (1.0 + x) * (1.0 + x) * (1.0 + x);
        Some(self.decay_m2_per_s * (3.0 * x - 1.0) / (sigma_m * sigma_m * cube))
    }

    /// Largest `|∂U/∂r|` (1/s) at a depth, found at ξ = 1/√(5 a) = 0.695: a Lipschitz bound across the jet.
    ///
    /// ```text
    /// max |∂U/∂r| = (25 √(5a) / 54) · U_C / r_half = 0.666 U_C / r_half
    /// ```
    #[must_use]
    pub fn steepest_radial_gradient_per_s(&self, depth_m: f64) -> Option<f64> {
        let sigma_m = self.sigma_m(depth_m)?;
        let factor = 25.0 * (5.0 * PROFILE_A).sqrt() / 54.0; // 4 a ξ/(1 + a ξ²)³ at a ξ² = 1/5: (4/5)·√(5a)·(5/6)³
        Some(factor * self.decay_m2_per_s / (self.spreading * sigma_m * sigma_m))
    }

    /// A bound on `|grad U|/U` (1/m) at a depth and below, at any radius; with `y = √a ξ`, which nothing but the two quotients depends on:
    ///
    /// ```text
    /// |∂U/∂r|/U = 4 √a/r_half · y/(1 + y²) <= 2 √a/r_half,   |∂U/∂s|/U = |3 y² - 1|/(σ (1 + y²)) <= 3/σ
    /// ```
    #[must_use]
    pub fn steepest_over_speed_per_m(&self, depth_m: f64) -> Option<f64> {
        let sigma_m = self.sigma_m(depth_m)?;
        Some((4.0 * self.steepness + 9.0).sqrt() / sigma_m)
    }

    /// A bound on `(u'²/u + |u''|)/u` (1/m²) along straight ways at a depth and below, a prime being a derivative with the length of the
    /// way. With `u = N σ³/q²`, `q = σ² + A r²` and `A = a σ²/r_half²`, the steepness,
    ///
    /// ```text
    /// u'/u = 3 σ'/σ - 2 q'/q               (u'/u)² <= (4 A + 9)/σ²
    /// (u'/u)' = -3 σ'²/σ² - 2 q''/q + 2 q'²/q²,   q'² <= 4 q (σ'² + A (1 - σ'²)) = 2 q q''
    ///         so it lies within ±(4 A + 7)/σ²
    /// u''/u = (u'/u)' + (u'/u)²
    /// ```
    #[must_use]
    pub fn bent_over_speed_per_m2(&self, depth_m: f64) -> Option<f64> {
        let sigma_m = self.sigma_m(depth_m)?;
        Some((12.0 * self.steepness + 25.0) / (sigma_m * sigma_m))
    }

    /// Volume flux (m³/s) through the whole plane at a depth; it grows by entrainment.
    ///
    /// ```text
    /// Q = π U_C r_half² / a
    /// ```
    #[must_use]
    pub fn volume_flux_m3_per_s(&self, depth_m: f64) -> Option<f64> {
        Some(PI * self.decay_m2_per_s * self.sigma_m(depth_m)? / self.steepness)
    }

    /// Momentum flux over density (m⁴/s²), the same at every depth.
    ///
    /// ```text
    /// J = π U_C² r_half² / (3 a) = K U_H² l²
    /// ```
    #[must_use]
    pub fn momentum_flux_m4_per_s2(&self) -> f64 {
        PI * self.decay_m2_per_s * self.decay_m2_per_s / (3.0 * self.steepness)
    }

    /// Time (s) that air takes from the rotor plane to a depth, moving at `convection` times the speed on the axis. The formula is
    /// carried up to the rotor plane, where it is an estimate.
    ///
    /// ```text
    /// τ = ∫₀^s ds'/(k U_C) = (σ² - s₀² l²) / (2 k U_H B l/q)
    /// ```
    #[must_use]
    pub fn transport_time_s(&self, depth_m: f64, convection: f64) -> f64 {
        let sigma_m = depth_m.max(0.0) + self.origin_above_m;
        (sigma_m * sigma_m - self.origin_above_m * self.origin_above_m)
            / (2.0 * convection * self.decay_m2_per_s)
    }

    /// Mean axial speed (m/s) over a level disc centred on the axis, exact.
    ///
    /// ```text
    /// ⟨U⟩ = U_C / (1 + a (R/r_half)²)
    /// ```
    #[must_use]
    pub fn disc_mean_mps(&self, depth_m: f64, disc_radius_m: f64) -> Option<f64> {
        self.sigma_m(depth_m)?;
        Some(2.0 * self.stream_over_radius2_mps(depth_m, disc_radius_m * disc_radius_m))
    }

    /// Radius (m) within which the speed exceeds `speed_mps`: the iso-speed spindle. `None` where the axis itself is slower.
    ///
    /// ```text
    /// ξ² = ( √(U_C/U) - 1 ) / a
    /// ```
    #[must_use]
    pub fn radius_at_speed_m(&self, depth_m: f64, speed_mps: f64) -> Option<f64> {
        let sigma_m = self.sigma_m(depth_m)?;
        let x = (self.decay_m2_per_s / (sigma_m * speed_mps.max(0.0))).sqrt() - 1.0;
        (x >= 0.0).then(|| sigma_m * (x / self.steepness).sqrt())
    }

    /// Depth (m) at which the axis has slowed to `speed_mps`, the spindle's lower tip; `None` if all of the far field is slower.
    /// Infinite for a speed of 0.
    ///
    /// ```text
    /// s = l (B U_H/(q U) + s₀)
    /// ```
    #[must_use]
    pub fn spindle_end_m(&self, speed_mps: f64) -> Option<f64> {
        let end_m = self.decay_m2_per_s / speed_mps.max(0.0) - self.origin_above_m;
        (end_m >= self.from_m).then_some(end_m)
    }

    /// The jet at one depth, prepared for many radii. Also upstream of 2.5 l, for the merging near field.
    pub(crate) fn level(&self, depth_m: f64) -> Level {
        let sigma_m = depth_m + self.origin_above_m;
        let sigma2 = sigma_m * sigma_m;
        Level {
            numerator: self.decay_m2_per_s * sigma_m * sigma2,
            sigma2_m2: sigma2,
            steepness: self.steepness,
        }
    }
}

/// A horizontal cut of the jet: what is left to do per point is one division.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level {
    numerator: f64,
    sigma2_m2: f64,
    steepness: f64,
}

impl Level {
    /// `a/r_half²` (1/m²): the profile is `1/(1 + that · r²)²`.
    pub(crate) fn gaussian_exponent_per_m2(&self) -> f64 {
        self.steepness / self.sigma2_m2
    }

    /// `U` at a squared radius (m²).
    #[inline]
    pub(crate) fn axial_speed_mps(&self, radius2_m2: f64) -> f64 {
        let denominator = self.sigma2_m2 + self.steepness * radius2_m2;
        self.numerator / (denominator * denominator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn air_below_offboard_1_takes_half_a_second_over_three_metres() {
        // U_H = 6.66 m/s; 0.51 s by the closed form, against the sum of ds/U_C.
        let jet = FarField::new(6.66, 0.266, 1.0, &Jet::default());
        let closed_s = jet.transport_time_s(3.0, 1.0);
        assert!((closed_s - 0.51).abs() < 0.005, "{closed_s}");
        let extrapolated = jet.extrapolated();
        let speed_mps = |s_m| {
            extrapolated
                .centreline_mps(s_m)
                .expect("evaluated anywhere")
        };
        let summed_s: f64 = (0..3000)
            .map(|i| 0.001 / speed_mps((f64::from(i) + 0.5) * 0.001))
            .sum();
        assert!(
            (closed_s - summed_s).abs() < 1e-6,
            "midpoint rule: {summed_s}"
        );
    }

    #[test]
    fn extrapolated_it_is_the_same_formula_up_to_the_rotor_plane() {
        let (held, extrapolated) = (jet(), jet().extrapolated());
        assert_eq!(
            held.axial_speed_mps(1.0, 0.1),
            extrapolated.axial_speed_mps(1.0, 0.1)
        );
        assert_eq!(held.centreline_mps(0.1), None);
        // U_C/U_H = B/(q (1 - s₀)) one motor distance down
        let expected_mps = 9.66 * 10.11 / (1.15 * 6.817);
        let found_mps = extrapolated
            .centreline_mps(0.266)
            .expect("evaluated anywhere");
        assert!((found_mps - expected_mps).abs() < 1e-9, "{found_mps}");
        assert_eq!(extrapolated.centreline_mps(0.0), None);
    }

    /// Offboard 2 with propellers canted outwards, so that no formula can forget the width factor.
    fn jet() -> FarField {
        FarField::new(9.66, 0.266, 1.15, &Jet::default())
    }

    const DEPTHS_M: [f64; 3] = [0.7, 2.0, 9.0];
    const XIS: [f64; 6] = [0.0, 0.4, 0.695, 1.0, 1.6, 4.0];

    fn points() -> impl Iterator<Item = (f64, f64)> {
        let radius_m = |s: f64, xi: f64| xi * jet().half_width_m(s).expect("deep");
        DEPTHS_M
            .into_iter()
            .flat_map(move |s| XIS.into_iter().map(move |xi| (s, radius_m(s, xi))))
    }

    #[test]
    fn the_rational_form_is_the_papers_profile() {
        for (s, r) in points() {
            let centreline_mps = jet().centreline_mps(s).expect("deep");
            let xi = r / jet().half_width_m(s).expect("deep");
            let paper_mps = centreline_mps / (1.0 + PROFILE_A * xi * xi).powi(2);
            // Rounding.
            assert!((jet().axial_speed_mps(s, r).expect("deep") / paper_mps - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn gradients_are_those_of_the_speed() {
        let h = 1e-5; // m
        for (s, r) in points() {
            let speed = |s: f64, r: f64| jet().axial_speed_mps(s, r).expect("deep");
            let across = (speed(s, r + h) - speed(s, r - h)) / (2.0 * h);
            let along = (speed(s + h, r) - speed(s - h, r)) / (2.0 * h);
            // Speeds near 10 m/s: rounding leaves 1e-10, the third derivative (1e4 at most) times h² 1e-6.
            assert!((jet().radial_gradient_per_s(s, r).expect("deep") - across).abs() < 2e-6);
            assert!((jet().axial_gradient_per_s(s, r).expect("deep") - along).abs() < 2e-6);
        }
    }

    #[test]
    fn no_gradient_exceeds_its_bound_and_the_bound_is_met() {
        for s in DEPTHS_M {
            let half_width_m = jet().half_width_m(s).expect("deep");
            let bound_per_s = jet().steepest_radial_gradient_per_s(s).expect("deep");
            let steepest_per_s = (0..5000)
                .filter_map(|i| jet().radial_gradient_per_s(s, 1e-3 * f64::from(i) * half_width_m))
                .fold(0.0_f64, |steepest, gradient| steepest.max(gradient.abs()));
            // A scan in steps of 0.001 half-widths misses the flat maximum by less than 1e-6 of it.
            assert!(
                steepest_per_s <= bound_per_s * (1.0 + 1e-12)
                    && steepest_per_s > bound_per_s * (1.0 - 1e-6)
            );
            let in_words = 0.666 * jet().centreline_mps(s).expect("deep") / half_width_m;
            assert!((bound_per_s / in_words - 1.0).abs() < 1e-3); // three digits
        }
    }

    #[test]
    fn no_gradient_is_steeper_over_its_speed_than_the_bound() {
        for s in DEPTHS_M {
            let bound_per_m = jet().steepest_over_speed_per_m(s).expect("deep");
            let half_width_m = jet().half_width_m(s).expect("deep");
            for r in (0..1000).map(|i| 0.01 * f64::from(i) * half_width_m) {
                let across = jet().radial_gradient_per_s(s, r).expect("deep");
                let along = jet().axial_gradient_per_s(s, r).expect("deep");
                let speed_mps = jet().axial_speed_mps(s, r).expect("deep");
                assert!(across.hypot(along) <= bound_per_m * speed_mps);
            }
        }
    }

    #[test]
    fn no_straight_way_is_bent_more_than_the_bound() {
        let h = 1e-4; // m
        for (s, r) in points() {
            let bound_per_m2 = jet().bent_over_speed_per_m2(s).expect("deep");
            for k in 0..16 {
                let (up, level) = (0.1 * f64::from(k)).sin_cos();
                for turn in [0.0, 0.6, 1.2, 1.571] {
                    let at_mps = |way_m: f64| {
                        let (x, y) = (
                            r + way_m * level * f64::cos(turn),
                            way_m * level * f64::sin(turn),
                        );
                        jet()
                            .axial_speed_mps(s + way_m * up + 2.0 * h, x.hypot(y))
                            .expect("deep")
                    };
                    let [before, here, after] = [-h, 0.0, h].map(at_mps);
                    let slope = (after - before) / (2.0 * h);
                    let bent = (after - 2.0 * here + before) / (h * h);
                    // Rounding of 10 m/s over h² leaves 1e-6 / s² or so.
                    assert!(slope * slope / here + bent.abs() <= bound_per_m2 * here + 1e-5);
                }
            }
        }
    }

    #[test]
    fn mass_and_momentum_through_a_plane_are_the_integrals_of_the_profile() {
        let s = 2.0;
        let half_width_m = jet().half_width_m(s).expect("deep");
        // Midpoints in t = ξ²/(1 + ξ²) bring the whole plane into 0..1: error of order 1/n².
        let n = 20_000;
        let integral = |power: i32| -> f64 {
            let over = |t: f64| {
                let xi2 = t / (1.0 - t);
                let speed_mps = jet()
                    .axial_speed_mps(s, half_width_m * xi2.sqrt())
                    .expect("deep");
                speed_mps.powi(power) / ((1.0 - t) * (1.0 - t))
            };
            let sum: f64 = (0..n)
                .map(|i| over((f64::from(i) + 0.5) / f64::from(n)))
                .sum();
            PI * half_width_m * half_width_m * sum / f64::from(n)
        };
        assert!((integral(1) / jet().volume_flux_m3_per_s(s).expect("deep") - 1.0).abs() < 1e-7);
        assert!((integral(2) / jet().momentum_flux_m4_per_s2() - 1.0).abs() < 1e-7);
    }

    #[test]
    fn the_mean_over_a_centred_disc_is_that_of_a_quadrature() {
        for s in DEPTHS_M {
            for disc_m in [0.01, 0.13, 1.0] {
                let n = 4000; // equal areas, midpoints: error of order 1/n²
                let mean: f64 = (0..n)
                    .map(|i| disc_m * ((f64::from(i) + 0.5) / f64::from(n)).sqrt())
                    .map(|r| jet().axial_speed_mps(s, r).expect("deep"))
                    .sum::<f64>()
                    / f64::from(n);
                assert!((jet().disc_mean_mps(s, disc_m).expect("deep") / mean - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn the_spindle_is_where_the_speed_is_met_and_ends_where_the_axis_meets_it() {
        for s in DEPTHS_M {
            for share in [0.999, 0.5, 0.03] {
                let speed_mps = share * jet().centreline_mps(s).expect("deep");
                let radius_m = jet()
                    .radius_at_speed_m(s, speed_mps)
                    .expect("slower than the axis");
                // The root of √(U_C/U) - 1 loses three digits at 0.999.
                assert!(
                    (jet().axial_speed_mps(s, radius_m).expect("deep") / speed_mps - 1.0).abs()
                        < 1e-12
                );
            }
            let axis_mps = jet().centreline_mps(s).expect("deep");
            assert_eq!(jet().radius_at_speed_m(s, 1.001 * axis_mps), None);
            assert!(
                (jet().spindle_end_m(axis_mps).expect("reached") - s).abs() < 1e-13 * s.max(1.5)
            );
        }
        assert_eq!(jet().spindle_end_m(20.0), None);
        assert_eq!(jet().spindle_end_m(0.0), Some(f64::INFINITY));
    }
}
