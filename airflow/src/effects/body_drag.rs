//! Body drag: the frame itself stands in the air that passes it.
//!
//! ```text
//! F = -½ ρ (a l²) w |w|,   w = U + V_z: the air's downward speed past the drone
//! ```
//!
//! `a l²` is the drag area `C_D A` of frame, battery and arms seen from above, in squared motor
//! distances: 0.1 to 0.4 for a frame that covers a tenth to a third of `l²` (chosen here from `C_D`
//! about 1.2 for plates across the flow: Hoerner, Fluid-Dynamic Drag, 1965, ch. 3). Range: any
//! speed. Taken for: a receiver gain above 1 ([`super::ReceiverInflow`]), whose force grows with
//! the speed where this one grows with its square; the drone's own climb tells them apart only
//! where it is fast.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, OWN, Parameter};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "body_drag",
    aliases: &[],
    equation: "F = -1/2 rho a l^2 w |w|, w = U + V_z",
    description: "the frame itself stands in the air that passes it",
    parameters: &[Parameter::ratio("area_over_l2", &["a"], 0.0, [0.0, 10.0]).fit(0.0, 0.6)],
    essential: 1,
    home: Home::Receiver,
    treatment: |_| OWN,
    get: |effects| Some(vec![effects.body_drag?.area_over_l2]),
    set: |effects, p| effects.body_drag = Some(BodyDrag { area_over_l2: p[0] }),
};

/// Drag of the frame along the vertical.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyDrag {
    /// `a`: drag area over the squared motor distance.
    pub area_over_l2: f64,
}

impl BodyDrag {
    /// Vertical force (N, up positive) of air that passes downwards at `past_mps`.
    #[must_use]
    pub fn force_n(&self, density_kg_per_m3: f64, motor_distance_m: f64, past_mps: f64) -> f64 {
        let area_m2 = self.area_over_l2 * motor_distance_m * motor_distance_m;
        -0.5 * density_kg_per_m3 * area_m2 * past_mps * past_mps.abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn air_from_above_pushes_down_and_air_from_below_up() {
        let drag = BodyDrag { area_over_l2: 0.25 };
        // ½ · 1.2 · 0.25 · 0.1² · 4² = 24 mN.
        assert!((drag.force_n(1.2, 0.1, 4.0) + 0.024).abs() < 1e-15);
        assert!((drag.force_n(1.2, 0.1, -4.0) - 0.024).abs() < 1e-15);
    }
}
