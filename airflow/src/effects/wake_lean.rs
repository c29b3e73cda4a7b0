//! Lean: the jet leaves its drone against the thrust, which a drone that accelerates or flies
//! against drag tilts.
//!
//! ```text
//! x(s) = g s tan χ,   tan χ = -t_xy/t_z        t: direction of the thrust when the air left
//! ```
//!
//! Momentum theory: the air that a rotor moves gains momentum against its thrust, so `g = 1` in
//! still air; the paper's jet stays vertical, `g = 0`. Range: 0 to 1, tilts to 45 degrees, beyond
//! which recordings are cut. Taken for: a constant tilt, where a drone keeps leaning one way; late
//! air, where it leans as it is about to move.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::air::GRAVITY_MPS2;

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "wake_lean",
    aliases: &[],
    equation: "x(s) = g s tan(chi), chi the tilt of the thrust when the air left",
    description: "the jet leaves its drone against the thrust and leans as its drone does",
    parameters: &[Parameter::ratio("share", &["g"], 0.0, [0.0, 1.0])],
    essential: 1,
    home: Home::Surroundings,
    treatment: |_| {
        Treatment::Bounded(
            "every wake leans every way at once, as far as the highest acceleration in the fleet can tilt a thrust",
        )
    },
    get: |effects| Some(vec![effects.wake_lean?.share]),
    set: |effects, p| effects.wake_lean = Some(WakeLean { share: p[0] }),
};

/// A leaning thrust is taken for no flatter than this (its vertical share): chosen here, 73
/// degrees, beyond which no drone holds its height.
const LEAST_UPRIGHT: f64 = 0.3;

/// How far a jet follows the tilt of its drone's thrust.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WakeLean {
    /// `g`; 0: the jet stays vertical, 1: it leans as the thrust does.
    pub share: f64,
}

impl WakeLean {
    /// The most that a jet leans, sideways over down, in whatever direction, of a drone that
    /// accelerates by so much (m/s²) in whatever direction: thrust balances gravity and
    /// acceleration, so that `sin χ <= a/g`. Infinite from one gravity on.
    #[must_use]
    pub fn most(&self, acceleration_mps2: f64) -> f64 {
        let sine = acceleration_mps2 / GRAVITY_MPS2;
        match sine {
            _ if self.share == 0.0 => 0.0,
            steep if steep < 1.0 => self.share * steep / (1.0 - steep * steep).sqrt(),
            _ => f64::INFINITY,
        }
    }

    /// Metres sideways (x and y of the world) for each metre down of air pushed away by a thrust
    /// along `up`, a unit vector of the world.
    #[must_use]
    pub fn against(up: Vector3<f64>) -> [f64; 2] {
        [up.x, up.y].map(|sideways| -sideways / up.z.max(LEAST_UPRIGHT))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_acceleration_within_the_limit_leans_farther() {
        let lean = WakeLean { share: 0.8 };
        let most = lean.most(4.0);
        let mut highest = 0.0_f64;
        for step in 0..=360 {
            let angle = f64::from(step) * 0.5_f64.to_radians();
            let (sin, cos) = angle.sin_cos();
            let thrust = Vector3::new(4.0 * sin, 0.0, GRAVITY_MPS2 + 4.0 * cos).normalize();
            highest = highest.max(lean.share * WakeLean::against(thrust)[0].abs());
        }
        assert!(
            (0.999..=1.0).contains(&(highest / most)),
            "{highest} of {most}"
        );
        assert_eq!(lean.most(GRAVITY_MPS2), f64::INFINITY);
        assert_eq!(WakeLean { share: 0.0 }.most(f64::INFINITY), 0.0);
    }

    #[test]
    fn air_leaves_against_the_thrust() {
        let up = Vector3::new(0.6, 0.0, 0.8);
        let [x, y] = WakeLean::against(up);
        assert!((x + 0.75).abs() < 1e-12 && y == 0.0);
        let [flattest, _] = WakeLean::against(-Vector3::x());
        assert_eq!(flattest, LEAST_UPRIGHT.recip());
    }
}
