//! Four Gaussian jets under four rotors, shaded by the body: the upper near field, with lengths in
//! `l`.
//!
//! The model and its symbols stand in `near_field`. As products of Gaussians are Gaussians, the
//! integrals over the plane have closed forms, and so has the horizontal flow that continuity asks
//! for.

use std::f64::consts::{LN_2, PI};

/// Radius of the circle on which the rotor hubs lie, in `l`: half the diagonal.
const HUB_RADIUS: f64 = 0.5;

/// Hubs at (±h, ±h), in `l`.
const HUB_OFFSET: f64 = HUB_RADIUS * std::f64::consts::FRAC_1_SQRT_2;

/// Growth of one rotor jet's half-width per depth. Chosen here: a little above a free round jet's
/// (0.094 to 0.102, Pope, Turbulent Flows, 2000, table 5.1), and with it the maxima meet between
/// 1.75 and 2.0 l, as the paper measures (1.5 to 2.5).
const ROTOR_SPREADING: f64 = 0.11;

/// The body's shadow on the axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shadow {
    /// Share of the flow that it takes away at the rotor plane (`D₀`).
    pub(crate) at_rotors: f64,
    /// Depth over which it fills, in `l` (`s_b`).
    pub(crate) depth: f64,
}

/// That of a drone of which nothing else is known. Chosen here: the share gives the slow core that
/// the paper shows, about 0.5 to 0.7 U_H at 0.5 l, and it is gone where the maxima meet.
pub(crate) const SHADOW: Shadow = Shadow {
    at_rotors: 0.5,
    depth: 0.7,
};

/// Radius of the body's shadow, in `l` (`r_b`). Chosen here: about the body's own radius.
const SHADOW_RADIUS: f64 = 0.2;

/// Exponent of the shadow, `1/r_b²`, in 1/l².
const SHADOW_EXPONENT: f64 = 1.0 / (SHADOW_RADIUS * SHADOW_RADIUS);

/// The four rotor jets at one depth, before their strength `A` is known; a prime is a derivative
/// with depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RotorJets {
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

impl RotorJets {
    pub(crate) fn new(s: f64, diameter: f64, shadow: Shadow) -> RotorJets {
        let half_width = 0.5 * diameter + ROTOR_SPREADING * s;
        let exponent = LN_2 / (half_width * half_width);
        let taken = shadow.at_rotors * (-s / shadow.depth).exp();
        RotorJets {
            exponent,
            exponent_prime: -2.0 * exponent * ROTOR_SPREADING / half_width,
            shadow: taken,
            shadow_prime: -taken / shadow.depth,
        }
    }

    /// `n`. The sum over four hubs at (±h, ±h) is a product of two sums.
    pub(crate) fn shape(&self, x: f64, y: f64) -> f64 {
        let pair = |x: f64| {
            let (near, far) = (x - HUB_OFFSET, x + HUB_OFFSET);
            (-self.exponent * near * near).exp() + (-self.exponent * far * far).exp()
        };
        let lit = 1.0 - self.shadow * (-SHADOW_EXPONENT * (x * x + y * y)).exp();
        lit * pair(x) * pair(y)
    }

    /// A bound on the radius within which `n` exceeds a value: four jets, none nearer than its hub.
    pub(crate) fn reach_at_shape(&self, shape: f64) -> f64 {
        let rest = (4.0 / shape.max(0.0)).ln().max(0.0);
        HUB_RADIUS + (rest / self.exponent).sqrt()
    }

    /// `I_nn` and its derivative.
    pub(crate) fn self_overlap(&self) -> [f64; 2] {
        let apart = (-self.exponent * HUB_RADIUS * HUB_RADIUS).exp();
        let [plain, plain_p] = self.pair_overlap(0.0, apart);
        let [once, once_p] = self.pair_overlap(SHADOW_EXPONENT, apart);
        let [twice, twice_p] = self.pair_overlap(2.0 * SHADOW_EXPONENT, apart);
        let d = self.shadow;
        let by_exponent = plain_p - 2.0 * d * once_p + d * d * twice_p;
        let by_shadow = 2.0 * (d * twice - once);
        [
            plain - 2.0 * d * once + d * d * twice,
            by_exponent * self.exponent_prime + by_shadow * self.shadow_prime,
        ]
    }

    /// `∫ exp(-c r²) (Σ_k exp(-p |x - x_k|²))² dA` and its derivative with `p`: over the 16 pairs
    /// of rotors (4 the same, 8 neighbours, 4 opposite) the Gaussian integrals sum to a square.
    ///
    /// ```text
    /// 4π/(c + 2p) · [ exp(-p R²) + exp(-p R² c/(c + 2p)) ]²,   R = 1/2
    /// ```
    ///
    /// `apart` is `exp(-p R²)`, the same for every `c`.
    fn pair_overlap(&self, c: f64, apart: f64) -> [f64; 2] {
        const R2: f64 = HUB_RADIUS * HUB_RADIUS;
        let p = self.exponent;
        let sum = c + 2.0 * p;
        let together = if c > 0.0 {
            (-p * R2 * c / sum).exp()
        } else {
            1.0
        };
        let root = apart + together;
        let root_prime = -R2 * (apart + together * (c / sum) * (c / sum));
        let value = 4.0 * PI / sum * root * root;
        [
            value,
            4.0 * PI / sum * root * (2.0 * root_prime - 2.0 * root / sum),
        ]
    }

    /// `∫ n exp(-c r²) dA`.
    pub(crate) fn overlap_with_gaussian(&self, c: f64) -> f64 {
        let p = self.exponent;
        let rotors =
            |c: f64| 4.0 * PI / (c + p) * (-p * c / (c + p) * HUB_RADIUS * HUB_RADIUS).exp();
        rotors(c) - self.shadow * rotors(c + SHADOW_EXPONENT)
    }

    /// Horizontal velocity (x, y) that keeps `a n` free of divergence.
    pub(crate) fn horizontal_velocity(&self, x: f64, y: f64, a: f64, a_prime: f64) -> [f64; 2] {
        let mut v = [0.0; 2];
        for gaussian in self.gaussians(a, a_prime) {
            for hub in [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]] {
                let [vx, vy] = gaussian.entrained(x, y, hub.map(|side| side * HUB_OFFSET));
                v[0] += vx;
                v[1] += vy;
            }
        }
        v
    }

    /// The two kinds of Gaussian of `a n`, one of each per rotor: its jet, and the body's shadow on
    /// it. The product of jet and shadow is a Gaussian nearer to the axis.
    fn gaussians(&self, a: f64, a_prime: f64) -> [Gaussian; 2] {
        let (p, p_prime) = (self.exponent, self.exponent_prime);
        let sum = p + SHADOW_EXPONENT;
        let centre = p / sum;
        let centre_prime = SHADOW_EXPONENT * p_prime / (sum * sum);
        let reach = SHADOW_EXPONENT * HUB_RADIUS * HUB_RADIUS;
        let taken = -self.shadow * (-reach * centre).exp();
        let shadow_prime = -self.shadow_prime * (-reach * centre).exp();
        let taken_prime = shadow_prime - taken * reach * centre_prime;
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
    /// Horizontal velocity that keeps this Gaussian of axial speed free of divergence: the flow
    /// towards its own axis that feeds its flux `M (1 - exp(-p ρ²))`, `M = π a/p`, and the drift of
    /// its centre.
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

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// `∫ f dA` by the trapezoid rule, which converges faster than any power for what decays like a
    /// Gaussian.
    pub(crate) fn over_the_plane(f: impl Fn(f64, f64) -> f64) -> f64 {
        const N: i32 = 200;
        const H: f64 = 4.0 / N as f64;
        let mut sum = 0.0;
        for i in -N..=N {
            for j in -N..=N {
                sum += f(H * f64::from(i), H * f64::from(j));
            }
        }
        sum * H * H
    }

    #[test]
    fn the_overlap_of_the_rotor_jets_with_themselves_is_that_of_a_quadrature() {
        for diameter in [0.4868, 0.6246, 0.9] {
            for s in [0.0, 0.5, 1.7, 2.4] {
                let jets = RotorJets::new(s, diameter, SHADOW);
                let [closed, _] = jets.self_overlap();
                let summed = over_the_plane(|x, y| jets.shape(x, y).powi(2));
                assert!((closed / summed - 1.0).abs() < 1e-12); // rounding of 160 000 terms
            }
        }
    }
}
