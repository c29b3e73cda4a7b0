//! Inflow: a rotor feels more or less of the air from above than momentum theory has it.
//!
//! ```text
//! α → η α
//! ```
//!
//! At fixed speed of rotation blades lose `dT/dV` between 0 and `T/v_h` (blade-element theory:
//! Leishman, Principles of Helicopter Aerodynamics, 2006, ch. 3); the paper's own controller
//! over-compensates, its mean error changing from -38 to +19 mm, which says `η < 1`. Range: 0 to
//! 2.5. Taken for: a stronger or weaker emitter, which its throttle would show.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "receiver_inflow",
    aliases: &["thrust_inflow"],
    equation: "alpha -> eta alpha",
    description: "the rotors feel more or less of the air from above than momentum theory has it",
    parameters: &[Parameter::ratio("factor", &["eta"], 1.0, [0.0, 2.5])],
    essential: 1,
    home: Home::Receiver,
    treatment: |_| Treatment::Exact,
    get: |effects| Some(vec![effects.receiver_inflow?.factor]),
    set: |effects, p| effects.receiver_inflow = Some(ReceiverInflow { factor: p[0] }),
};

/// A factor on the air that a receiver feels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReceiverInflow {
    /// `η`; 1: momentum theory.
    pub factor: f64,
}

impl ReceiverInflow {
    /// The air that counts, over that of momentum theory.
    #[must_use]
    pub fn alpha(&self, alpha: f64) -> f64 {
        self.factor * alpha
    }
}
