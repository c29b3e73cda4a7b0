//! Radial flow: more or less air drawn in than the mean profile asks for.
//!
//! ```text
//! V → κ V
//! ```
//!
//! Range: 0 to 3. To a probe of magnitude it matters beyond 3 half-widths, where `V` exceeds a
//! third of `U`. Taken for: the tail, the ambient.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, SIDEWAYS};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "entrainment_radial",
    aliases: &[],
    equation: "V -> kappa V",
    description: "the jet draws in more or less air than its mean profile asks for",
    parameters: &[Parameter::ratio("factor", &["kappa"], 1.0, [0.0, 3.0])],
    essential: 1,
    home: Home::Jet,
    treatment: |_| SIDEWAYS,
    get: |effects| Some(vec![effects.entrainment_radial?.factor]),
    set: |effects, p| effects.entrainment_radial = Some(EntrainmentRadial { factor: p[0] }),
};

/// A factor on the radial flow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EntrainmentRadial {
    /// `κ`; 1: continuity of the paper's profile.
    pub factor: f64,
}
