//! Battery: as its voltage falls, the same thrust takes more throttle.
//!
//! ```text
//! throttle → throttle (1 + k (V₀ - V)/V₀)
//! ```
//!
//! `V₀`: the voltage at the beginning of the recording. `k = 1` where thrust goes with the square
//! of duty times voltage. Range: -2 to 4, of which a fit takes what its sign allows. Present
//! outside every jet, and monotone in the voltage: that tells it from air.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "battery_sag",
    aliases: &["thrust_map_drift"],
    equation: "throttle -> throttle (1 + k (V0 - V)/V0)",
    description: "as the battery weakens, the same thrust takes more throttle",
    parameters: &[Parameter::ratio("sensitivity", &["k"], 0.0, [-2.0, 4.0]).fit(0.0, 4.0)],
    essential: 1,
    home: Home::Receiver,
    treatment: |_| {
        Treatment::Ignored("it changes the throttle of a drone, not the air that it meets")
    },
    get: |effects| Some(vec![effects.battery_sag?.sensitivity]),
    set: |effects, p| effects.battery_sag = Some(BatterySag { sensitivity: p[0] }),
};

/// Throttle gained as the voltage falls.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BatterySag {
    /// `k`.
    pub sensitivity: f64,
}

impl BatterySag {
    /// Factor on the throttle at a voltage over that of the beginning.
    #[must_use]
    pub fn throttle_factor(&self, voltage_ratio: f64) -> f64 {
        1.0 + self.sensitivity * (1.0 - voltage_ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_fit_makes_a_weaker_battery_take_less_throttle() {
        let [low, high] = SPEC.parameters[0].fit.unwrap_or_default();
        let weakened = |sensitivity| BatterySag { sensitivity }.throttle_factor(0.9);
        assert!(weakened(low) >= 1.0 && weakened(high) > 1.0);
    }
}
