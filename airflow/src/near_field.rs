//! Four rotor jets that merge, from the rotor plane to 2.5 motor distances, with the momentum of
//! the far field at every depth.
//!
//! The paper sees two maxima in each plane through two rotors, moving inwards and meeting on the
//! axis between 1.5 and 2.5 l, no speed above 1.25 U_H, and a slow core. Moving the jets themselves
//! onto the axis at constant momentum would overshoot to 1.5 and more; jets that stay under their
//! rotors and spread until they overlap show it but for the highest speed: close below the rotors
//! the momentum of the far field, in jets as wide as a propeller, takes 1.23 U_H (`kolibri`) to
//! 1.63 (`offboard-1`, whose propellers are small for its frame) and 1.73 (`elios-3`). So, with
//! lengths in `l`, speeds in `U_H`, and the rotors `x_k` at radius 1/2 on the diagonals:
//!
//! ```text
//! b(s) = (d/l)/2 + 0.11 s                                                   half-width of one rotor's jet
//! n    = [1 - D exp(-(r/r_b)²)] Σ_k exp(-ln2 |x - x_k|²/b²),   D = D₀ exp(-s/s_b)      D: shadow of the body
//! w(s) = q₅((s - 1.8)/0.7),   q₅(t) = t³ (10 - 15 t + 6 t²)                 merging
//! U    = (1 - w) A n + w U_far
//! ```
//!
//! `A` makes the momentum `∫ U² dA` that of the far field, `K`, at every depth:
//!
//! ```text
//! A = K (1 + w) / ( w I_nf + √(w² I_nf² + I_nn K (1 - w²)) ),   I_nn = ∫ n² dA,   I_nf = ∫ n U_far dA
//! ```
//!
//! `rotor_jets` holds `n` and its integrals.

use crate::far_field::{FarField, Level};
use crate::jet::{FAR_FIELD_FROM_S_OVER_L, Jet};
use crate::rotor_jets::{RotorJets, Shadow};

/// Depth at which the far field begins to be mixed in, in `l`. Chosen here: just before the paper's
/// far field is complete.
const MERGE_FROM: f64 = 1.8;

/// Depth over which it replaces the rotor jets, in `l`.
const MERGE_OVER: f64 = FAR_FIELD_FROM_S_OVER_L - MERGE_FROM;

/// Intervals of the table of `I_nf` over the merging depths. Chosen here: cubic interpolation is
/// then good to 1e-8.
const INTERVALS: usize = 28;

/// The flow under four rotors down to 2.5 l; lengths in `l`, speeds in `U_H`, so it serves every
/// mass and density.
#[derive(Clone, Debug)]
pub(crate) struct NearField {
    diameter: f64,
    shadow: Shadow,
    momentum: f64,
    far: FarField,
    /// `I_nf` and its derivative at equally spaced depths from 1.8 to 2.5 l.
    overlap: [[f64; 2]; INTERVALS + 1],
}

/// `w`, the share of the far field, and its derivative with depth.
fn merged(s: f64) -> [f64; 2] {
    let t = ((s - MERGE_FROM) / MERGE_OVER).clamp(0.0, 1.0);
    let rest = 1.0 - t;
    [
        t * t * t * (10.0 + t * (6.0 * t - 15.0)),
        30.0 * t * t * rest * rest / MERGE_OVER,
    ]
}

impl NearField {
    /// The near field of a quadrotor whose propellers measure `diameter_over_l`, joined to the far
    /// field of `jet` and `width_factor`.
    pub(crate) fn new(
        diameter_over_l: f64,
        width_factor: f64,
        jet: &Jet,
        shadow: Shadow,
    ) -> NearField {
        let mut near = NearField {
            diameter: diameter_over_l,
            shadow,
            momentum: jet.momentum(),
            far: FarField::new(1.0, 1.0, width_factor, jet),
            overlap: [[0.0; 2]; INTERVALS + 1],
        };
        // Step of the central difference: its error, 1e-8 of the third derivative, is that of the
        // interpolation.
        let step = 1e-4;
        for i in 0..=INTERVALS {
            let s = MERGE_FROM + MERGE_OVER * i as f64 / INTERVALS as f64;
            let slope = (near.far_overlap(s + step) - near.far_overlap(s - step)) / (2.0 * step);
            near.overlap[i] = [near.far_overlap(s), slope];
        }
        near
    }

    /// `I_nf` by quadrature. The algebraic profile is a mixture of Gaussians,
    /// `1/(1 + x)² = ∫₀^∞ t exp(-t (1 + x)) dt`, and for a Gaussian the integral over the plane is
    /// closed; the one over `t` is left to the double-exponential rule.
    fn far_overlap(&self, s: f64) -> f64 {
        // Chosen here: the mixture is then exact to a part in 1e9 out to four half-widths.
        const STEP: f64 = 0.25;
        let jets = RotorJets::new(s, self.diameter, self.shadow);
        let level = self.far.level(s);
        let centreline = level.axial_speed_mps(0.0);
        let narrowness = level.gaussian_exponent_per_m2();
        let mut sum = 0.0;
        for i in -12..=16 {
            let u = STEP * f64::from(i);
            let t = (u - (-u).exp()).exp();
            let dt = t * (1.0 + (-u).exp()) * STEP;
            sum += t * (-t).exp() * jets.overlap_with_gaussian(t * narrowness) * dt;
        }
        centreline * sum
    }

    /// `I_nf` and its derivative from the table, cubic Hermite; the ends are held outside the
    /// merging depths.
    fn tabulated_overlap(&self, s: f64) -> [f64; 2] {
        let h = MERGE_OVER / INTERVALS as f64;
        let place = ((s - MERGE_FROM) / h).clamp(0.0, INTERVALS as f64);
        let i = (place as usize).min(INTERVALS - 1);
        let t = place - i as f64;
        let ([f0, g0], [f1, g1]) = (self.overlap[i], self.overlap[i + 1]);
        let (g0, g1) = (g0 * h, g1 * h);
        let rise = f1 - f0;
        let (quadratic, cubic) = (3.0 * rise - 2.0 * g0 - g1, g0 + g1 - 2.0 * rise);
        [
            f0 + t * (g0 + t * (quadratic + t * cubic)),
            (g0 + t * (2.0 * quadratic + t * 3.0 * cubic)) / h,
        ]
    }

    /// `A` and its derivative with depth. The momentum of the mixture, divided by 1 - w, is the
    /// quadratic `(1 - w) I_nn A² + 2 w I_nf A = K (1 + w)`; the derivative follows from it.
    fn amplitude(&self, s: f64, jets: &RotorJets) -> [f64; 2] {
        let [w, w_prime] = merged(s);
        let [nn, nn_prime] = jets.self_overlap();
        let [nf, nf_prime] = if w > 0.0 {
            self.tabulated_overlap(s)
        } else {
            [0.0; 2]
        };
        let k = self.momentum;
        let a = k * (1.0 + w) / (w * nf + (w * w * nf * nf + nn * k * (1.0 - w * w)).sqrt());
        let by_a = 2.0 * ((1.0 - w) * a * nn + w * nf);
        let by_w = a * (2.0 * nf - a * nn) - k;
        let rest = by_w * w_prime + (1.0 - w) * a * a * nn_prime + 2.0 * w * a * nf_prime;
        [a, -rest / by_a]
    }

    /// The flow at depth `s` (0 to 2.5), prepared for many points.
    pub(crate) fn level(&self, s: f64) -> NearLevel {
        let jets = RotorJets::new(s, self.diameter, self.shadow);
        let [w, _] = merged(s);
        let [a, _] = self.amplitude(s, &jets);
        NearLevel {
            jets,
            strength: (1.0 - w) * a,
            far: (w > 0.0).then(|| (w, self.far.level(s))),
        }
    }

    /// Axial speed at depth `s` (0 to 2.5) and horizontal offset (x, y).
    pub(crate) fn axial_speed(&self, x: f64, y: f64, s: f64) -> f64 {
        self.level(s).axial_speed(x, y)
    }

    /// Horizontal velocity (x, y) that goes with it by continuity.
    pub(crate) fn horizontal_velocity(&self, x: f64, y: f64, s: f64) -> [f64; 2] {
        let jets = RotorJets::new(s, self.diameter, self.shadow);
        let [w, w_prime] = merged(s);
        let [a, a_prime] = self.amplitude(s, &jets);
        let mut v =
            jets.horizontal_velocity(x, y, (1.0 - w) * a, (1.0 - w) * a_prime - w_prime * a);
        if w > 0.0 {
            let r2 = x * x + y * y;
            let per_radius = w * self.far.radial_speed_over_radius_per_s(s, r2)
                - w_prime * self.far.stream_over_radius2_mps(s, r2);
            v[0] += per_radius * x;
            v[1] += per_radius * y;
        }
        v
    }
}

/// A horizontal cross-section of the near field.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearLevel {
    jets: RotorJets,
    /// `(1 - w) A`.
    strength: f64,
    /// `w` and the far field, where it is mixed in.
    far: Option<(f64, Level)>,
}

impl NearLevel {
    /// Axial speed at a horizontal offset (x, y).
    pub(crate) fn axial_speed(&self, x: f64, y: f64) -> f64 {
        let rotors = self.strength * self.jets.shape(x, y);
        match &self.far {
            Some((w, far)) => rotors + w * far.axial_speed_mps(x * x + y * y),
            None => rotors,
        }
    }

    /// A bound on the radius within which it is faster than a speed: a mixture is no faster than
    /// the faster of its parts. Beyond the hubs, `r > R`, no rotor's jet is stronger than
    /// `exp(-p (r - R)²)`.
    pub(crate) fn reach_at_speed(&self, speed: f64) -> f64 {
        let (w, far) = match &self.far {
            Some((w, level)) => (*w, level.radius_at_speed_m(speed)),
            None => (0.0, 0.0),
        };
        match w < 1.0 {
            true => far.max(self.jets.reach_at_shape(speed * (1.0 - w) / self.strength)),
            false => far,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotor_jets::SHADOW;
    use crate::rotor_jets::tests::over_the_plane;

    const DIAMETERS: [f64; 3] = [0.4868, 0.6246, 0.9];

    fn near(diameter: f64) -> NearField {
        NearField::new(diameter, 1.0, &Jet::default(), SHADOW)
    }

    #[test]
    fn a_deep_shadow_is_slow_air_on_the_axis_at_the_same_momentum_and_draws_air_in_by_continuity() {
        let deep = Shadow {
            at_rotors: 0.8,
            depth: 2.0,
        };
        let [usual, deep] =
            [SHADOW, deep].map(|of| NearField::new(0.6246, 1.0, &Jet::default(), of));
        assert!(deep.axial_speed(0.0, 0.0, 1.5) < 0.7 * usual.axial_speed(0.0, 0.0, 1.5));
        for s in [0.5, 1.5, 2.1] {
            let momentum = over_the_plane(|x, y| deep.axial_speed(x, y, s).powi(2));
            assert!(
                (momentum / deep.momentum - 1.0).abs() < 0.02,
                "at {s} l: {momentum}"
            );
            let h = 1e-4;
            for [x, y] in [[0.05, 0.02], [0.2, -0.1], [0.5, 0.3]] {
                let along = |at: f64| deep.axial_speed(x, y, at);
                let [east, west] = [x + h, x - h].map(|x| deep.horizontal_velocity(x, y, s)[0]);
                let [north, south] = [y + h, y - h].map(|y| deep.horizontal_velocity(x, y, s)[1]);
                let outwards = (east - west + north - south) / (2.0 * h);
                let faster = (along(s + h) - along(s - h)) / (2.0 * h);
                // Central differences of third derivatives of order 100.
                assert!((outwards + faster).abs() < 1e-5, "at {x}, {y}, {s} l");
            }
        }
    }

    #[test]
    fn the_overlap_with_the_far_field_is_that_of_a_quadrature_between_its_nodes_too() {
        for diameter in DIAMETERS {
            let near = near(diameter);
            for s in [1.8, 1.8125, 2.111, 2.4875, 2.5] {
                let jets = RotorJets::new(s, diameter, SHADOW);
                let level = near.far.level(s);
                let summed =
                    over_the_plane(|x, y| jets.shape(x, y) * level.axial_speed_mps(x * x + y * y));
                let [table, _] = near.tabulated_overlap(s);
                // The Hermite cubic over 0.025 l: fourth power of the step times a fourth
                // derivative of order 1, over 384.
                assert!(
                    (table / summed - 1.0).abs() < 1e-8,
                    "at {s} l: {table} and {summed}"
                );
            }
        }
    }

    #[test]
    fn derivatives_with_depth_are_those_of_the_values() {
        let h = 1e-5;
        for diameter in DIAMETERS {
            let near = near(diameter);
            for s in [0.1, 0.9, 1.79, 1.95, 2.2, 2.45] {
                let at = |s: f64| {
                    let jets = RotorJets::new(s, diameter, SHADOW);
                    let [a, a_prime] = near.amplitude(s, &jets);
                    let [nn, nn_prime] = jets.self_overlap();
                    let [w, w_prime] = merged(s);
                    ([a, nn, w], [a_prime, nn_prime, w_prime])
                };
                let ((before, _), (_, slopes), (after, _)) = (at(s - h), at(s), at(s + h));
                for ((before, after), slope) in before.into_iter().zip(after).zip(slopes) {
                    // Central differences: 1e-10 of a third derivative of order 100, and 1e-11 of
                    // rounding; the table adds 1e-7.
                    assert!(
                        ((after - before) / (2.0 * h) - slope).abs() < 1e-6,
                        "at {s} l, d/l = {diameter}"
                    );
                }
            }
        }
    }

    #[test]
    fn far_to_the_side_nothing_overflows() {
        let near = near(0.2);
        for s in [0.0, 1.0, 2.3] {
            let (speed, [x, y]) = (
                near.axial_speed(500.0, -300.0, s),
                near.horizontal_velocity(500.0, -300.0, s),
            );
            assert!(
                (0.0..1e-6).contains(&speed) && x < 0.0 && y > 0.0,
                "at {s} l: {speed}, {x}, {y}"
            );
        }
    }

    #[test]
    fn beyond_the_reach_of_a_speed_no_air_is_faster_at_any_azimuth() {
        for diameter in DIAMETERS {
            let near = near(diameter);
            for k in 0..=24 {
                let s = 0.1 * f64::from(k);
                let level = near.level(s);
                for speed in [0.01, 0.1, 0.3, 0.6, 0.9, 1.2] {
                    let reach = level.reach_at_speed(speed);
                    for (away, turn) in (0..30).flat_map(|it| (0..36).map(move |on| (it, on))) {
                        let r = reach + 1e-9 + 0.05 * f64::from(away);
                        let (sin, cos) = (f64::from(turn) * 2.5_f64).to_radians().sin_cos();
                        let there = level.axial_speed(r * cos, r * sin);
                        assert!(there <= speed, "{diameter} {s} {speed} {r}: {there}");
                    }
                }
            }
        }
    }
}
