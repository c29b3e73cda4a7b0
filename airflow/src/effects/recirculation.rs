//! Recirculation: the jets set a closed room in motion.
//!
//! ```text
//! u_r(t) = u_∞ (1 - exp(-(t - t₀)/τ_r))
//! ```
//!
//! A return flow that grows after take-off, everywhere; for a hall of 25 x 25 x 7 m some 0.1 m/s
//! after ten minutes (order of magnitude, assumed here because no measurement is known). What the
//! jets carry down must come up between them: the part `e` of it rises (against the jets), the rest
//! has no direction that a speed probe could tell and adds in squares. Taken for: a probe's offset
//! or drift, which do not grow with flight time and stay after landing; wind.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "recirculation",
    aliases: &["background_flow"],
    equation: "u_r(t) = u (1 - exp(-t/tau)), of which e rises",
    description: "the jets set the room in motion: a return flow that grows after take-off, part of it upwards against the jets",
    parameters: &[
        Parameter::new("speed_mps", &["u"], "m/s", [0.0, 5.0]).fit(0.0, 2.0),
        Parameter::new("time_s", &["tau"], "s", [1e-3, 1e5])
            .neutral(120.0)
            .fit(5.0, 3000.0),
        Parameter {
            is_optional: true,
            ..Parameter::ratio("rise", &["e"], 0.0, [-1.0, 1.0])
        },
    ],
    essential: 1,
    home: Home::Surroundings,
    treatment: |_| Treatment::Bounded("every limit is lower by the return flow at its strongest"),
    get: |effects| (effects.recirculation).map(|room| vec![room.speed_mps, room.time_s, room.rise]),
    set: |effects, p| {
        effects.recirculation = Some(Recirculation {
            speed_mps: p[0],
            time_s: p[1],
            rise: p[2],
        });
    },
};

/// A growing return flow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recirculation {
    /// `u_∞` (m/s).
    pub speed_mps: f64,
    /// `τ_r` (s).
    pub time_s: f64,
    /// `e`, the sine of its elevation, -1 to 1: upwards positive.
    #[serde(default)]
    pub rise: f64,
}

impl Recirculation {
    /// The return flow at a time since take-off (s): what rises (m/s, world), and the speed (m/s)
    /// without direction.
    #[must_use]
    pub fn return_flow_mps(&self, since_takeoff_s: f64) -> (Vector3<f64>, f64) {
        let speed_mps = self.speed_mps * -(-since_takeoff_s.max(0.0) / self.time_s).exp_m1();
        let level = (1.0 - self.rise * self.rise).max(0.0).sqrt();
        (
            Vector3::new(0.0, 0.0, self.rise * speed_mps),
            level * speed_mps,
        )
    }
}
