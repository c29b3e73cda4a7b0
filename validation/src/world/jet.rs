//! The hover jet of the synthetic world: the fit of Bauersfeld et al. (RA-L 2025) written anew, and
//! what may change its cross-section.

use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use nalgebra::Vector3;

/// Decay, spreading rate and virtual origin of the paper's fit, in motor distances.
const DECAY: f64 = 10.11;
pub(super) const SPREADING: f64 = 0.07668;
const ORIGIN: f64 = -5.817;

/// Molar mass (kg/mol) and gas constant (J/(mol K)), as the paper takes them.
const MOLAR_MASS: f64 = 0.028966;
const GAS_CONSTANT: f64 = 8.3144;
/// Gravity (m/s²).
pub(crate) const GRAVITY: f64 = 9.81;

/// A drone with four propellers: the numbers of the paper's table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Drone {
    pub(crate) name: &'static str,
    pub(crate) mass_kg: f64,
    pub(crate) propeller_m: f64,
    pub(crate) motors_m: f64,
}

pub(crate) const KOLIBRI: Drone = drone("Kolibri", 0.230, 0.0737, 0.118);
pub(crate) const OFFBOARD_1: Drone = drone("Offboard1", 0.572, 0.1295, 0.266);
pub(crate) const OFFBOARD_2: Drone = drone("Offboard2", 1.207, 0.1295, 0.266);
pub(crate) const MATRICE: Drone = drone("Matrice300", 6.300, 0.5334, 0.894);

const fn drone(name: &'static str, mass_kg: f64, propeller_m: f64, motors_m: f64) -> Drone {
    Drone {
        name,
        mass_kg,
        propeller_m,
        motors_m,
    }
}

/// Density (kg/m³) of an ideal gas.
pub(crate) fn density(pressure_pa: f64, temperature_k: f64) -> f64 {
    pressure_pa * MOLAR_MASS / GAS_CONSTANT / temperature_k
}

impl Drone {
    /// Induced speed at hover (m/s): thrust of one propeller is `2 ρ (π d²/4) v²`.
    pub(crate) fn hover_mps(&self, density: f64) -> f64 {
        let thrust_n = self.mass_kg * GRAVITY / 4.0;
        let disc_m2 = PI * self.propeller_m * self.propeller_m / 4.0;
        (thrust_n / (2.0 * density * disc_m2)).sqrt()
    }

    pub(crate) fn past_origin(&self, s_m: f64) -> f64 {
        s_m / self.motors_m - ORIGIN
    }

    /// Speed on the axis over the induced speed.
    pub(crate) fn centre(&self, s_m: f64) -> f64 {
        DECAY / self.past_origin(s_m)
    }

    /// Radius (m) of half the centre speed.
    pub(crate) fn half_m(&self, s_m: f64) -> f64 {
        SPREADING * self.past_origin(s_m) * self.motors_m
    }
}

/// The profile across: one half at 1.
pub(crate) fn profile(xi: f64) -> f64 {
    let bracket = xi.powi(2).mul_add(2f64.sqrt() - 1.0, 1.0);
    1.0 / (bracket * bracket)
}

/// `∫ u² dA / (u_c² r_half²)` of that profile, by its sum: 2.5282.
pub(super) static MOMENTUM_OF_PROFILE: LazyLock<f64> = LazyLock::new(|| {
    let step = 0.01;
    (0..4000)
        .map(|i| (f64::from(i) + 0.5) * step)
        .map(|xi| TAU * xi * profile(xi).powi(2) * step)
        .sum()
});

/// What the air does across the axis, besides the paper's profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Across {
    /// Factor on the half-width, and on the inverse of the centre speed: propellers leaning
    /// outwards (above 1) or inwards.
    pub(crate) width: f64,
    /// The jet is there only part of the time near its edge: place and width of the edge, in
    /// half-widths.
    pub(crate) edge: Option<[f64; 2]>,
    /// Standard deviation of the axis's place over the depth.
    pub(crate) wander: f64,
    /// Speed of turning on the ring of fastest turning, over the centre speed at the rotor plane.
    pub(crate) swirl: f64,
    /// One propeller weaker: relative excess at one half-width on one side.
    pub(crate) limp: f64,
}

impl Default for Across {
    fn default() -> Across {
        Across {
            width: 1.0,
            edge: None,
            wander: 0.0,
            swirl: 0.0,
            limp: 0.0,
        }
    }
}

/// A cut through a jet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    /// Route along the axis (m).
    pub(crate) s_m: f64,
    /// Speed on the axis (m/s) and half-width (m) before anything changes them across.
    pub(crate) centre_mps: f64,
    pub(crate) half_m: f64,
    /// From the axis to the point (m), at a right angle to the axis.
    pub(crate) off_m: Vector3<f64>,
    /// Unit vector along the jet.
    pub(crate) along: Vector3<f64>,
    /// Heading of the drone (rad).
    pub(crate) yaw_rad: f64,
}

/// Rings and spokes over which a wandering axis is averaged: equal shares of its probability.
const RINGS: usize = 10;
const SPOKES: usize = 12;

/// Radius of every ring over the standard deviation of the axis's place.
static RING: LazyLock<[f64; RINGS]> = LazyLock::new(|| {
    std::array::from_fn(|ring| {
        let inside = (ring as f64 + 0.5) / RINGS as f64;
        (-2.0 * (1.0 - inside).ln()).sqrt()
    })
});
/// Sine and cosine of every spoke.
static SPOKE: LazyLock<[(f64, f64); SPOKES]> =
    LazyLock::new(|| std::array::from_fn(|spoke| (TAU * spoke as f64 / SPOKES as f64).sin_cos()));

impl Across {
    /// Speed along the jet (m/s).
    pub(crate) fn speed_mps(&self, cut: &Cut) -> f64 {
        let (half_m, centre_mps) = (cut.half_m * self.width, cut.centre_mps / self.width);
        let shape = |off_m: Vector3<f64>| self.shape(off_m, half_m, cut.yaw_rad);
        if self.wander == 0.0 {
            return centre_mps * shape(cut.off_m);
        }
        let (first, second) = beside(cut.along);
        let mut sum = 0.0;
        for ring in &*RING {
            let radius_m = self.wander * cut.s_m * ring;
            for (sin, cos) in &*SPOKE {
                sum += shape(cut.off_m - radius_m * (*cos * first + *sin * second));
            }
        }
        centre_mps * sum / (RINGS * SPOKES) as f64
    }

    fn shape(&self, off_m: Vector3<f64>, half_m: f64, yaw_rad: f64) -> f64 {
        let xi = off_m.norm() / half_m;
        let mut shape = profile(xi);
        if let Some([place, width]) = self.edge {
            // Normal distribution of the edge's place.
            shape *=
                complementary_error((xi - place) / width) / complementary_error(-place / width);
        }
        if self.limp != 0.0 && xi > 0.0 {
            let azimuth = off_m.y.atan2(off_m.x) - yaw_rad;
            shape *= 1.0 + self.limp * azimuth.cos() * 2.0 * xi / (1.0 + xi * xi);
        }
        shape
    }

    /// Speed around the axis (m/s): a vortex with a core of half a half-width, slowing with the
    /// square of the depth.
    pub(crate) fn around_mps(&self, cut: &Cut, drone: &Drone) -> f64 {
        let core = (cut.off_m.norm() / (0.5 * cut.half_m)).max(1e-9);
        // The largest value of (1 - exp(-x²))/x is 0.638.
        let vortex = (1.0 - (-core * core).exp()) / core / 0.638;
        self.swirl * cut.centre_mps * vortex * drone.past_origin(0.0) / drone.past_origin(cut.s_m)
    }

    /// `∫ r dr` of the shape from the axis to a radius (m²).
    fn inside(&self, radius_m: f64, half_m: f64) -> f64 {
        if self.edge.is_none() && self.limp == 0.0 {
            let xi = radius_m / half_m;
            return 0.5 * radius_m * radius_m / xi.powi(2).mul_add(2f64.sqrt() - 1.0, 1.0);
        }
        let rings = 60;
        let width_m = radius_m / f64::from(rings);
        (0..rings)
            .map(|ring| (f64::from(ring) + 0.5) * width_m)
            .map(|r_m| self.shape(Vector3::x() * r_m, half_m, 0.0) * r_m * width_m)
            .sum()
    }

    /// Speed away from the axis (m/s), from what flows through the cuts above and below it.
    pub(crate) fn outwards_mps(&self, cut: &Cut, drone: &Drone) -> f64 {
        let radius_m = cut.off_m.norm();
        if radius_m < 1e-6 {
            return 0.0;
        }
        let hover_mps = cut.centre_mps / drone.centre(cut.s_m);
        let step_m = 0.05 * drone.motors_m;
        let flow = |s_m: f64| {
            let half_m = drone.half_m(s_m) * self.width;
            hover_mps * drone.centre(s_m) / self.width * self.inside(radius_m, half_m)
        };
        (flow(cut.s_m - step_m) - flow(cut.s_m + step_m)) / (2.0 * step_m) / radius_m
    }
}

/// Two unit vectors at right angles to a third.
pub(super) fn beside(along: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let first = along
        .cross(&Vector3::y())
        .try_normalize(1e-9)
        .unwrap_or_else(Vector3::x);
    (first, along.cross(&first))
}

/// `erfc`, Abramowitz & Stegun 7.1.26: good to 1.5e-7.
fn complementary_error(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let series = [
        1.061_405_429,
        -1.453_152_027,
        1.421_413_741,
        -0.284_496_736,
        0.254_829_592,
    ]
    .iter()
    .fold(0.0, |sum, term| (sum + term) * t);
    let above = series * (-x * x).exp();
    if x >= 0.0 { above } else { 2.0 - above }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_s_numbers_come_out() {
        // The paper's table, rounded to 0.005; the rest of the tolerance is its rounded masses.
        assert!((KOLIBRI.hover_mps(1.204) - 7.41).abs() < 0.012);
        assert!((MATRICE.hover_mps(1.204) - 5.36).abs() < 0.012);
        assert!((OFFBOARD_1.centre(2.5 * OFFBOARD_1.motors_m) - 1.2156).abs() < 1e-4);
        assert!((profile(1.0) - 0.5).abs() < 1e-12);
        // π/(3 (√2 - 1)); the sum stops at 40 half-widths.
        assert!((*MOMENTUM_OF_PROFILE - 2.5282).abs() < 1e-3);
    }

    #[test]
    fn what_flows_inside_a_radius_is_the_sum_over_rings() {
        let plain = Across::default();
        let with_edge = Across {
            edge: Some([1e6, 1.0]),
            ..plain
        };
        for radius_m in [0.05, 0.2, 1.0] {
            let [exact, summed] = [plain, with_edge].map(|it| it.inside(radius_m, 0.2));
            assert!((exact / summed - 1.0).abs() < 2e-3, "{exact} {summed}");
        }
    }

    #[test]
    fn the_error_function_is_that_of_the_tables() {
        for (x, y) in [
            (0.0, 1.0),
            (0.5, 0.479_500_1),
            (-1.0, 1.842_700_8),
            (2.0, 0.004_677_7),
        ] {
            assert!((complementary_error(x) - y).abs() < 2e-7);
        }
    }
}
