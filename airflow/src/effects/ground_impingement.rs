//! The floor: a jet that meets it stops and spreads along it as a wall jet.
//!
//! With height `h` of the point and `H` of the drone above the floor, `r_f` the half-width that the
//! free jet would have there, and `√J` its momentum:
//!
//! ```text
//! axial:   U → U (1 - exp(-(h/(c r_f))²))
//! outward: U_m = a · 1.32 (√J/H) (r/H)^-1.10,   δ = 0.098 H (r/H)^0.90        (Poreh, Tsuei & Cermak 1967, J. Appl. Mech. 34:457)
//!          u = U_m · 1.4794 η^(1/7) (1 - erf(0.67753 η)),   η = h/δ            (Verhoff 1963, Princeton Univ. Rep. 626)
//!          inside r < 1.3 r_f: rising linearly from the stagnation point
//! ```
//!
//! An Offboard 2 three metres up: 1.4 m/s at 3 m from below it. Taken for: recirculation (not tied
//! to the height), wind near the floor.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// `η` at which Verhoff's profile is highest, and a little more than it is there: it rises before
/// and falls after.
pub(crate) const FASTEST_ETA: f64 = 0.1655;
pub(crate) const HIGHEST_PROFILE: f64 = 1.0005;

/// Verhoff's profile.
pub(crate) fn profile(eta: f64) -> f64 {
    1.4794 * eta.powf(1.0 / 7.0) * erfc(0.67753 * eta)
}

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "ground_impingement",
    aliases: &["ground_effect", "wall_jet"],
    equation: "U -> U (1 - exp(-(h/(c r_f))^2)), wall jet u = a 1.32 (sqrt J/H)(r/H)^-1.1",
    description: "the jet stops at the floor and spreads along it",
    parameters: &[
        Parameter::ratio("wall_jet", &["a"], 0.0, [0.0, 10.0]).fit(0.0, 4.0),
        Parameter::ratio("reach", &["c"], 0.05, [0.0, 10.0]).fit(0.05, 3.0),
    ],
    essential: 2,
    home: Home::Surroundings,
    treatment: |_| {
        Treatment::Bounded(
            "wakes keep their speed down to the floor; the wall jet along it counts in zones, and not for drones, whose limits \
         count vertical air",
        )
    },
    get: |effects| (effects.ground_impingement).map(|effect| vec![effect.wall_jet, effect.reach]),
    set: |effects, p| {
        effects.ground_impingement = Some(GroundImpingement {
            wall_jet: p[0],
            reach: p[1],
        });
    },
};

/// Stagnation and wall jet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroundImpingement {
    /// `c`: height over `r_f` at which the jet begins to stop; about 1.
    pub reach: f64,
    /// `a`: strength of the wall jet; 1: as in the literature.
    pub wall_jet: f64,
}

/// One point near the floor below a jet; lengths in one unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearFloor {
    /// Height of the point above the floor.
    pub(crate) height: f64,
    /// Height of the rotor plane above the floor.
    pub(crate) emitter_height: f64,
    /// Distance from the axis.
    pub(crate) radius: f64,
    /// Half-width that the free jet would have at the floor.
    pub(crate) half_width: f64,
    /// Root of the kinematic momentum flux, speed times length.
    pub(crate) root_momentum: f64,
}

impl GroundImpingement {
    /// Factor on the axial speed, and the outward speed to add.
    pub(crate) fn meet(&self, at: &NearFloor) -> (f64, f64) {
        let height = at.height.max(0.0);
        let stopped = height / (self.reach * at.half_width);
        let axial = -(-stopped * stopped).exp_m1();
        let inner = 1.3 * at.half_width;
        let radius = at.radius.max(inner);
        let over = radius / at.emitter_height;
        let fastest =
            self.wall_jet * 1.32 * at.root_momentum / at.emitter_height * over.powf(-1.10);
        let thickness = 0.098 * at.emitter_height * over.powf(0.90);
        let eta = height / thickness;
        let inside = (at.radius / inner).min(1.0);
        (axial, fastest * profile(eta) * inside)
    }
}

/// `1 - erf(x)` for `x ≥ 0`, to 1.5e-7 (Abramowitz & Stegun 7.1.26).
fn erfc(x: f64) -> f64 {
    let t = (1.0 + 0.327_591_1 * x).recip();
    let series = t
        * (0.254_829_592
            + t * (-0.284_496_736
                + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    series * (-x * x).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offboard_2_at_three_metres_makes_1_4_m_per_s_along_the_floor_three_metres_out() {
        let effect = GroundImpingement {
            reach: 1.0,
            wall_jet: 1.0,
        };
        let at = |height| NearFloor {
            height,
            emitter_height: 3.0,
            radius: 3.0,
            half_width: 0.07668 * (3.0 + 5.817 * 0.266),
            root_momentum: 3.17,
        };
        let fastest = (1..400)
            .map(|i| effect.meet(&at(f64::from(i) * 1e-3)).1)
            .fold(0.0, f64::max);
        // 1.32 · 3.17/3 = 1.39 at the maximum of the profile, which is 1 to two parts in a
        // thousand.
        assert!((fastest - 1.39).abs() < 0.01, "{fastest}");
        assert!(effect.meet(&at(2.9)).0 > 0.999 && effect.meet(&at(0.0)).0 == 0.0);
    }
}
