//! Four rotor jets that merge, from the rotor plane to 2.5 motor distances, with the momentum of the far field at every depth.
//!
//! The paper sees two maxima in each plane through two rotors, moving inwards and meeting on the axis between 1.5 and 2.5 l, no
//! speed above 1.25 U_H, and a slow core. Moving the jets themselves onto the axis at constant momentum would overshoot to 1.5
//! and more; jets that stay under their rotors and spread until they overlap show all of it. So, with lengths in `l`,
//! speeds in `U_H`, and the rotors `x_k` at radius 1/2 on the diagonals:
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
//! As products of Gaussians are Gaussians, `I_nn` has a closed form, and so has the horizontal flow that continuity asks for.

use std::f64::consts::{LN_2, PI};

use crate::far_field::FarField;
use crate::jet::{FAR_FIELD_FROM_S_OVER_L, Jet};

/// Radius of the circle on which the rotor hubs lie, in `l`: half the diagonal.
const HUB_RADIUS: f64 = 0.5;

/// Hubs at (±h, ±h), in `l`.
const HUB_OFFSET: f64 = HUB_RADIUS * std::f64::consts::FRAC_1_SQRT_2;

/// Growth of one rotor jet's half-width per depth. Chosen here: a little above a free round jet's (0.094 to 0.10, recalled), and
/// with it the maxima meet between 1.75 and 2.0 l, as the paper measures (1.5 to 2.5).
const ROTOR_SPREADING: f64 = 0.11;

/// Share of the flow that the body takes away on the axis at the rotor plane (`D₀`). Chosen here: gives the slow core that
/// the paper shows, about 0.5 to 0.7 U_H at 0.5 l.
const SHADOW: f64 = 0.5;

/// Radius of the body's shadow, in `l` (`r_b`). Chosen here: about the body's own radius.
const SHADOW_RADIUS: f64 = 0.2;

/// Depth over which the shadow fills, in `l` (`s_b`). Chosen here: gone where the maxima meet.
const SHADOW_DEPTH: f64 = 0.7;

/// Exponent of the shadow, `1/r_b²`, in 1/l².
const SHADOW_EXPONENT: f64 = 1.0 / (SHADOW_RADIUS * SHADOW_RADIUS);

/// Depth at which the far field begins to be mixed in, in `l`. Chosen here: just before the paper's far field is complete.
pub(crate) const MERGE_FROM: f64 = 1.8;

/// Depth over which it replaces the rotor jets, in `l`.
const MERGE_OVER: f64 = FAR_FIELD_FROM_S_OVER_L - MERGE_FROM;

/// Intervals of the table of `I_nf` over the merging depths. Chosen here: cubic interpolation is then good to 1e-8.
const INTERVALS: usize = 28;

/// The flow under four rotors down to 2.5 l; lengths in `l`, speeds in `U_H`, so it serves every mass and density.
#[derive(Clone, Debug)]
pub(crate) struct NearField {
    diameter: f64,
    momentum: f64,
    far: FarField,
    /// `I_nf` and its derivative at equally spaced depths from 1.8 to 2.5 l.
    overlap: [[f64; 2]; INTERVALS + 1],
}

/// Everything that depends on depth alone; a prime is a derivative with depth.
#[derive(Clone, Copy, Debug)]
struct Slice {
    merged: f64,
    merged_prime: f64,
    exponent: f64, // ln2/b²
    exponent_prime: f64,
    shadow: f64,
    shadow_prime: f64,
}

/// `a exp(-p |x - c|²)` with the centre on a diagonal, and how it changes with depth.
struct Gaussian {
    amplitude: f64,
    amplitude_prime: f64,
    exponent: f64,
    exponent_prime: f64,
    /// Distance of the centre from the axis, over that of the hub.
    centre: f64,
    centre_prime: f64,
}

impl Slice {
    fn new(s: f64, diameter: f64) -> Slice {
        let t = ((s - MERGE_FROM) / MERGE_OVER).clamp(0.0, 1.0);
        let half_width = 0.5 * diameter + ROTOR_SPREADING * s;
        let exponent = LN_2 / (half_width * half_width);
        let shadow = SHADOW * (-s / SHADOW_DEPTH).exp();
        Slice {
            merged: t * t * t * (10.0 + t * (6.0 * t - 15.0)),
            merged_prime: 30.0 * t * t * (1.0 - t) * (1.0 - t) / MERGE_OVER,
            exponent,
            exponent_prime: -2.0 * exponent * ROTOR_SPREADING / half_width,
            shadow,
            shadow_prime: -shadow / SHADOW_DEPTH,
        }
    }

    /// `n`. The sum over four hubs at (±h, ±h) is a product of two sums.
    fn shape(&self, x: f64, y: f64) -> f64 {
        let pair = |x: f64| {
            let (near, far) = (x - HUB_OFFSET, x + HUB_OFFSET);
            (-self.exponent * near * near).exp() + (-self.exponent * far * far).exp()
        };
        let lit = 1.0 - self.shadow * (-SHADOW_EXPONENT * (x * x + y * y)).exp();
        lit * pair(x) * pair(y)
    }

    /// `I_nn` and its derivative.
    fn self_overlap(&self) -> [f64; 2] {
        let [plain, plain_p] = self.pair_overlap(0.0);
        let [once, once_p] = self.pair_overlap(SHADOW_EXPONENT);
        let [twice, twice_p] = self.pair_overlap(2.0 * SHADOW_EXPONENT);
        let d = self.shadow;
        let by_exponent = plain_p - 2.0 * d * once_p + d * d * twice_p;
        let by_shadow = 2.0 * (d * twice - once);
        [
            plain - 2.0 * d * once + d * d * twice,
            by_exponent * self.exponent_prime + by_shadow * self.shadow_prime,
        ]
    }

    /// `∫ exp(-c r²) (Σ_k exp(-p |x - x_k|²))² dA` and its derivative with `p`: over the 16 pairs of rotors
    /// (4 the same, 8 neighbours, 4 opposite) the Gaussian integrals sum to a square.
    ///
    /// ```text
    /// 4π/(c + 2p) · [ exp(-p R²) + exp(-p R² c/(c + 2p)) ]²,   R = 1/2
    /// ```
    fn pair_overlap(&self, c: f64) -> [f64; 2] {
        const R2: f64 = HUB_RADIUS * HUB_RADIUS;
        let p = self.exponent;
        let sum = c + 2.0 * p;
        let (apart, together) = ((-p * R2).exp(), (-p * R2 * c / sum).exp());
        let root = apart + together;
        let root_prime = -R2 * (apart + together * (c / sum) * (c / sum));
        let value = 4.0 * PI / sum * root * root;
        [
            value,
            4.0 * PI / sum * root * (2.0 * root_prime - 2.0 * root / sum),
        ]
    }

    /// `∫ n exp(-c r²) dA`.
    fn overlap_with_gaussian(&self, c: f64) -> f64 {
        let p = self.exponent;
        let rotors =
            |c: f64| 4.0 * PI / (c + p) * (-p * c / (c + p) * HUB_RADIUS * HUB_RADIUS).exp();
        rotors(c) - self.shadow * rotors(c + SHADOW_EXPONENT)
    }

    /// The two kinds of Gaussian of `a n`, one of each per rotor: its jet, and the body's shadow on it. The product of jet
    /// and shadow is a Gaussian nearer to the axis.
    fn gaussians(&self, a: f64, a_prime: f64) -> [Gaussian; 2] {
        let (p, p_prime) = (self.exponent, self.exponent_prime);
        let sum = p + SHADOW_EXPONENT;
        let centre = p / sum;
        let centre_prime = SHADOW_EXPONENT * p_prime / (sum * sum);
        let reach = SHADOW_EXPONENT * HUB_RADIUS * HUB_RADIUS;
        let taken = -self.shadow * (-reach * centre).exp();
        let taken_prime = taken * (self.shadow_prime / self.shadow - reach * centre_prime);
        [
            Gaussian {
                amplitude: a,
                amplitude_prime: a_prime,
                exponent: p,
                exponent_prime: p_prime,
                centre: 1.0,
                centre_prime: 0.0,
            },
            Gaussian {
                amplitude: a * taken,
                amplitude_prime: a_prime * taken + a * taken_prime,
                exponent: sum,
                exponent_prime: p_prime,
                centre,
                centre_prime,
            },
        ]
    }
}

impl Gaussian {
    /// Horizontal velocity that keeps this Gaussian of axial speed free of divergence: the flow towards its own axis that feeds
    /// its flux `M (1 - exp(-p ρ²))`, `M = π a/p`, and the drift of its centre.
    fn entrained(&self, x: f64, y: f64, hub: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (x - self.centre * hub[0], y - self.centre * hub[1]);
        let p = self.exponent;
        let rho2 = dx * dx + dy * dy;
        let value = (-p * rho2).exp();
        // (1 - exp(-p ρ²))/ρ², whose limit on the Gaussian's axis is p.
        let filled = if rho2 > f64::MIN_POSITIVE {
            -(-p * rho2).exp_m1() / rho2
        } else {
            p
        };
        let flux_prime = (self.amplitude_prime - self.amplitude * self.exponent_prime / p) / p;
        let inward = 0.5 * (flux_prime * filled + self.amplitude / p * self.exponent_prime * value);
        let drift = self.amplitude * value * self.centre_prime;
        [drift * hub[0] - inward * dx, drift * hub[1] - inward * dy]
    }
}

impl NearField {
    /// The near field of a quadrotor whose propellers measure `diameter_over_l`, joined to the far field of `jet` and `width_factor`.
    pub(crate) fn new(diameter_over_l: f64, width_factor: f64, jet: &Jet) -> NearField {
        let mut near = NearField {
            diameter: diameter_over_l,
            momentum: jet.momentum(),
            far: FarField::new(1.0, 1.0, width_factor, jet),
            overlap: [[0.0; 2]; INTERVALS + 1],
        };
        // Step of the central difference: its error, 1e-8 of the third derivative, is that of the interpolation.
        let step = 1e-4;
        for i in 0..=INTERVALS {
            let s = MERGE_FROM + MERGE_OVER * i as f64 / INTERVALS as f64;
            let slope = (near.far_overlap(s + step) - near.far_overlap(s - step)) / (2.0 * step);
            near.overlap[i] = [near.far_overlap(s), slope];
        }
        near
    }

    /// `I_nf` by quadrature. The algebraic profile is a mixture of Gaussians, `1/(1 + x)² = ∫₀^∞ t exp(-t (1 + x)) dt`, and
    /// for a Gaussian the integral over the plane is closed; the one over `t` is left to the double-exponential rule.
    fn far_overlap(&self, s: f64) -> f64 {
        const STEP: f64 = 0.125;
        let slice = Slice::new(s, self.diameter);
        let level = self.far.level(s);
        let centreline = level.axial_speed_mps(0.0);
        let narrowness = level.gaussian_exponent_per_m2();
        let mut sum = 0.0;
        for i in -24..=32 {
            let u = STEP * f64::from(i);
            let t = (u - (-u).exp()).exp();
            let dt = t * (1.0 + (-u).exp()) * STEP;
            sum += t * (-t).exp() * slice.overlap_with_gaussian(t * narrowness) * dt;
        }
        centreline * sum
    }

    /// `I_nf` and its derivative from the table, cubic Hermite; the ends are held outside the merging depths.
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

    /// `A` and its derivative with depth. The momentum of the mixture, divided by 1 - w, is the quadratic
    /// `(1 - w) I_nn A² + 2 w I_nf A = K (1 + w)`; the derivative follows from it.
    fn amplitude(&self, s: f64, slice: &Slice) -> [f64; 2] {
        let w = slice.merged;
        let [nn, nn_prime] = slice.self_overlap();
        let [nf, nf_prime] = if w > 0.0 {
            self.tabulated_overlap(s)
        } else {
            [0.0; 2]
        };
        let k = self.momentum;
        let a = k * (1.0 + w) / (w * nf + (w * w * nf * nf + nn * k * (1.0 - w * w)).sqrt());
        let by_a = 2.0 * ((1.0 - w) * a * nn + w * nf);
        let by_w = a * (2.0 * nf - a * nn) - k;
        let rest =
            by_w * slice.merged_prime + (1.0 - w) * a * a * nn_prime + 2.0 * w * a * nf_prime;
        [a, -rest / by_a]
    }

    /// Axial speed at depth `s` (0 to 2.5) and horizontal offset (x, y).
    pub(crate) fn axial_speed(&self, x: f64, y: f64, s: f64) -> f64 {
        let slice = Slice::new(s, self.diameter);
        let w = slice.merged;
        let [a, _] = self.amplitude(s, &slice);
        let rotors = (1.0 - w) * a * slice.shape(x, y);
        if w > 0.0 {
            rotors + w * self.far.level(s).axial_speed_mps(x * x + y * y)
        } else {
            rotors
        }
    }

    /// Horizontal velocity (x, y) that goes with it by continuity.
    pub(crate) fn horizontal_velocity(&self, x: f64, y: f64, s: f64) -> [f64; 2] {
        let slice = Slice::new(s, self.diameter);
        let (w, w_prime) = (slice.merged, slice.merged_prime);
        let [a, a_prime] = self.amplitude(s, &slice);
        let mut v = [0.0; 2];
        for gaussian in slice.gaussians((1.0 - w) * a, (1.0 - w) * a_prime - w_prime * a) {
            for hub in [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]] {
                let [vx, vy] = gaussian.entrained(x, y, hub.map(|side| side * HUB_OFFSET));
                v[0] += vx;
                v[1] += vy;
            }
        }
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
