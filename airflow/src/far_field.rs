//! The merged jet from 2.5 motor distances down: profile, decay, spread, entrained radial flow,
//! gradients, fluxes.
//!
//! Frame: depth `s` below the rotor plane, radius `r` from the axis, both in metres; axial speed
//! positive downwards, radial speed positive outwards. Everything that needs a depth is `None`
//! above 2.5 l, where the fit does not hold.
//!
//! In metres the paper's three formulas collapse into one rational function, which is what makes a
//! point cheap (one division, no power, no exponential):
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
    decay_m2_per_s: f64,
    /// `U_H B l` (m²/s): what carries the air down.
    carried_m2_per_s: f64,
    /// `q S`: half-width over depth below the virtual origin.
    spreading: f64,
    /// `G = a/(q S)²`.
    steepness: f64,
}

impl FarField {
    /// The jet of a drone with induced velocity `U_H` and motor distance `l`; `width_factor` widens
    /// it at constant momentum.
    #[must_use]
    pub fn new(
        induced_velocity_mps: f64,
        motor_distance_m: f64,
        width_factor: f64,
        jet: &Jet,
    ) -> FarField {
        let spreading = width_factor * jet.spreading;
        let carried_m2_per_s = induced_velocity_mps * jet.centreline * motor_distance_m;
        FarField {
            from_m: FAR_FIELD_FROM_S_OVER_L * motor_distance_m,
            origin_above_m: -jet.origin * motor_distance_m,
            decay_m2_per_s: carried_m2_per_s / width_factor,
            carried_m2_per_s,
            spreading,
            steepness: PROFILE_A / (spreading * spreading),
        }
    }

    /// The same formulas right up to the rotor plane, where the fit does not hold: what
    /// [`crate::Wake::extrapolated`] is made of.
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
    fn sigma_m(&self, depth_m: f64) -> Option<f64> {
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

    /// Mean radial speed over the radius, `V/r` (1/s), finite on the axis: from continuity,
    /// outwards near the axis, inwards (entrainment) beyond ξ = 1/√a = 1.5538, where `V` tends to
    /// `-U_C q S/(2 a ξ)`. Also upstream of 2.5 l, for the merging near field.
    ///
    /// ```text
    /// V/U_C = q S ξ (1 - a ξ²) / (2 (1 + a ξ²)²)         (Pope, Turbulent Flows, 2000, section 5.2)
    /// ```
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

    /// A bound on `|grad U|/U` (1/m) at a depth and below, at any radius; with `y = √a ξ`, which
    /// nothing but the two quotients depends on:
    ///
    /// ```text
    /// |∂U/∂r|/U = 4 √a/r_half · y/(1 + y²) <= 2 √a/r_half,   |∂U/∂s|/U = |3 y² - 1|/(σ (1 + y²)) <= 3/σ
    /// ```
    #[must_use]
    pub fn steepest_over_speed_per_m(&self, depth_m: f64) -> Option<f64> {
        let sigma_m = self.sigma_m(depth_m)?;
        Some((4.0 * self.steepness + 9.0).sqrt() / sigma_m)
    }

    /// A bound on `(u'²/u + |u''|)/u` (1/m²) along straight paths at a depth and below, a prime
    /// being a derivative with the length of the path. With `u = N σ³/q²`, `q = σ² + A r²` and
    /// `A = a σ²/r_half²`, the steepness,
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
    /// Momentum flux over density (m⁴/s²), the same at every depth.
    ///
    /// ```text
    /// J = π U_C² r_half² / (3 a) = K U_H² l²
    /// ```
    #[must_use]
    pub fn momentum_flux_m4_per_s2(&self) -> f64 {
        PI * self.decay_m2_per_s * self.decay_m2_per_s / (3.0 * self.steepness)
    }

    /// Time (s) that air takes from the rotor plane to a depth, moving at `convection` times the
    /// speed on the axis of a jet of ordinary width: how fast a wider or narrower one of the same
    /// momentum is carried is not known. The formula is carried up to the rotor plane, where it is
    /// an estimate.
    ///
    /// ```text
    /// τ = ∫₀^s ds'/(k q U_C) = (σ² - s₀² l²) / (2 k U_H B l)
    /// ```
    #[must_use]
    pub fn transport_time_s(&self, depth_m: f64, convection: f64) -> f64 {
        let sigma_m = depth_m.max(0.0) + self.origin_above_m;
        (sigma_m * sigma_m - self.origin_above_m * self.origin_above_m)
            / (2.0 * convection * self.carried_m2_per_s)
    }

    /// How much longer air takes down to a depth for each metre more (s/m), at the centreline's
    /// speed: the derivative of [`FarField::transport_time_s`]; above the rotor plane 0.
    ///
    /// ```text
    /// dτ/ds = σ l / (U_H B l)
    /// ```
    #[must_use]
    pub fn transport_time_s_per_m(&self, depth_m: f64) -> f64 {
        if depth_m < 0.0 {
            return 0.0;
        }
        (depth_m + self.origin_above_m) / self.carried_m2_per_s
    }

    /// Depth (m) that air reaches in a time (s): the inverse of [`FarField::transport_time_s`].
    ///
    /// ```text
    /// s = l (√(s₀² + 2 k U_H B τ/l) + s₀)
    /// ```
    #[must_use]
    pub fn transported_m(&self, time_s: f64, convection: f64) -> f64 {
        let origin_m = self.origin_above_m;
        let square_m2 = 2.0 * convection * self.carried_m2_per_s * time_s.max(0.0);
        // Without the difference of two nearly equal roots.
        square_m2 / ((origin_m * origin_m + square_m2).sqrt() + origin_m)
    }

    /// Radius (m) within which the speed exceeds `speed_mps`: the iso-speed volume. `None` where
    /// the axis itself is slower.
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

    /// Depth (m) at which the axis has slowed to `speed_mps`: the lower tip of that volume. `None`
    /// if all of the far field is slower; infinite for a speed of 0.
    ///
    /// ```text
    /// s = l (B U_H/(q U) + s₀)
    /// ```
    #[must_use]
    pub fn iso_speed_end_m(&self, speed_mps: f64) -> Option<f64> {
        let end_m = self.decay_m2_per_s / speed_mps.max(0.0) - self.origin_above_m;
        (end_m >= self.from_m).then_some(end_m)
    }

    /// The jet at one depth, prepared for many radii. Also upstream of 2.5 l, for the merging near
    /// field.
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

/// A horizontal cross-section of the jet: what is left to do per point is one division.
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

    /// Radius (m) within which it is faster than a speed; 0: nowhere.
    pub(crate) fn radius_at_speed_m(&self, speed_mps: f64) -> f64 {
        let denominator = (self.numerator / speed_mps.max(0.0)).sqrt();
        let radius2_m2 = (denominator - self.sigma2_m2) / self.steepness;
        radius2_m2.max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests;
