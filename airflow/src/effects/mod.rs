//! What the hover jet leaves out, one file for each: equation, source, range, and what it is easily
//! taken for.
//!
//! The same code serves simulation, diagnosis, volumes and verification, so that an effect which
//! was found in recordings can be flown through. An effect acts in one of three places ([`Home`]):
//!
//! - in one drone's jet, as a function of the place below it ([`crate::Wake::with_effects`]):
//!   cross-flow, tilt, cant, wander, tail, scale, density, size of propellers, payload, near field,
//!   buoyancy, swirl, radial flow;
//! - in how the jet meets its surroundings at one moment ([`crate::Surroundings::velocity_mps`]):
//!   transport, lean, climb, floor, recirculation, merging;
//! - in how a receiver answers ([`Effects::receiver_alpha`], [`Effects::thrust_ratio`],
//!   [`Effects::throttle_factor`]): ground and ceiling effect on thrust, inflow, battery, own
//!   motion, drag of the body.
//!
//! Lengths in motor distances `l` and speeds in `U_H` inside, metres and seconds in the fields.

mod air_density;
mod battery_sag;
mod body_drag;
mod buoyancy;
mod ceiling_effect;
mod climb_descent;
mod crossflow;
mod dl_ratio;
mod entrainment_radial;
mod ground_effect_thrust;
mod ground_impingement;
mod jet_merging;
mod momentum_scale;
mod near_field;
mod own_motion;
mod payload_mass;
mod profile_tail;
mod receive;
mod receiver_inflow;
mod recirculation;
mod rotor_cant;
mod spec;
mod swirl;
mod wake_lean;
mod wake_tilt;
mod wake_transport;
mod wander;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

pub use air_density::AirDensity;
pub use battery_sag::BatterySag;
pub use body_drag::BodyDrag;
pub use buoyancy::Buoyancy;
pub use ceiling_effect::CeilingEffect;
pub use climb_descent::ClimbDescent;
pub use crossflow::Crossflow;
pub(crate) use crossflow::{MOST_WIND, Plume};
pub use dl_ratio::DlRatio;
pub use entrainment_radial::EntrainmentRadial;
pub use ground_effect_thrust::GroundEffectThrust;
pub use ground_impingement::GroundImpingement;
pub(crate) use ground_impingement::{FASTEST_ETA, HIGHEST_PROFILE, NearFloor, profile};
pub use jet_merging::JetMerging;
pub use momentum_scale::MomentumScale;
pub use near_field::NearFieldShape;
pub use own_motion::OwnMotion;
pub use payload_mass::PayloadMass;
pub use profile_tail::ProfileTail;
pub use receive::Reception;
pub use receiver_inflow::ReceiverInflow;
pub use recirculation::Recirculation;
pub use rotor_cant::RotorCant;
pub use spec::{EffectSpec, FitOver, Home, OutOfRange, Parameter, Treatment};
pub use swirl::Swirl;
pub use wake_lean::WakeLean;
pub use wake_tilt::WakeTilt;
pub use wake_transport::WakeTransport;
pub use wander::Wander;

/// Every effect, in the order of the fields of [`Effects`]: the effect table.
pub const EFFECTS: [&EffectSpec; 25] = [
    &crossflow::SPEC,
    &wake_tilt::SPEC,
    &rotor_cant::SPEC,
    &wander::SPEC,
    &profile_tail::SPEC,
    &momentum_scale::SPEC,
    &payload_mass::SPEC,
    &air_density::SPEC,
    &dl_ratio::SPEC,
    &near_field::SPEC,
    &buoyancy::SPEC,
    &swirl::SPEC,
    &entrainment_radial::SPEC,
    &jet_merging::SPEC,
    &wake_transport::SPEC,
    &wake_lean::SPEC,
    &climb_descent::SPEC,
    &ground_impingement::SPEC,
    &recirculation::SPEC,
    &ground_effect_thrust::SPEC,
    &ceiling_effect::SPEC,
    &receiver_inflow::SPEC,
    &battery_sag::SPEC,
    &own_motion::SPEC,
    &body_drag::SPEC,
];

/// What is added to the hover jet, each effect at most once. The default adds nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Effects {
    /// Horizontal wind.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crossflow: Option<Crossflow>,
    /// An axis that is not vertical.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wake_tilt: Option<WakeTilt>,
    /// Propellers canted in or out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotor_cant: Option<RotorCant>,
    /// An axis that meanders.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wander: Option<Wander>,
    /// Another outer edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile_tail: Option<ProfileTail>,
    /// Another strength, cause unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub momentum_scale: Option<MomentumScale>,
    /// Another mass than stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub payload_mass: Option<PayloadMass>,
    /// Another density than stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub air_density: Option<AirDensity>,
    /// Strength that depends on propeller size over motor distance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dl_ratio: Option<DlRatio>,
    /// Four rotor jets above 2.5 motor distances.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub near_field: Option<NearFieldShape>,
    /// Air warmer or colder than its surroundings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub buoyancy: Option<Buoyancy>,
    /// Rotation about the axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub swirl: Option<Swirl>,
    /// More or less entrained flow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub entrainment_radial: Option<EntrainmentRadial>,
    /// Several jets that become one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jet_merging: Option<JetMerging>,
    /// Convective delay.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wake_transport: Option<WakeTransport>,
    /// A jet that leans as its drone's thrust does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wake_lean: Option<WakeLean>,
    /// A drone that climbs or sinks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub climb_descent: Option<ClimbDescent>,
    /// The floor below.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground_impingement: Option<GroundImpingement>,
    /// A room that begins to circulate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recirculation: Option<Recirculation>,
    /// Thrust near the floor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground_effect_thrust: Option<GroundEffectThrust>,
    /// Thrust near the ceiling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ceiling_effect: Option<CeilingEffect>,
    /// How much of the air from above counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub receiver_inflow: Option<ReceiverInflow>,
    /// A battery that weakens.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub battery_sag: Option<BatterySag>,
    /// Drag of the frame in the air that passes it.
    pub body_drag: Option<BodyDrag>,
    /// The receiver's own velocity.
    pub own_motion: Option<OwnMotion>,
}

impl Effects {
    /// The rows of the effects that are there, in the order of the fields.
    pub fn specs(&self) -> impl Iterator<Item = &'static EffectSpec> {
        EFFECTS
            .into_iter()
            .filter(|spec| (spec.get)(self).is_some())
    }

    /// Every parameter that is not in its range, not a number included; empty when all can be used.
    #[must_use]
    pub fn problems(&self) -> Vec<OutOfRange> {
        let mut problems = Vec::new();
        for spec in self.specs() {
            let values = spec.values(self).unwrap_or_default();
            for ((&parameter, _), value) in spec.components().zip(values) {
                let [low, high] = parameter.range;
                if !(low..=high).contains(&value) {
                    problems.push(OutOfRange {
                        effect: spec.name,
                        parameter,
                        value,
                    });
                }
            }
        }
        problems
    }

    /// What becomes of each effect that is there, in the order of the fields.
    #[must_use]
    pub fn treatments(&self) -> Vec<(&'static str, Treatment)> {
        self.specs()
            .map(|spec| (spec.name, (spec.treatment)(self)))
            .collect()
    }

    /// Air (m/s, world) that moves without any jet, and the speed (m/s) without direction beside
    /// it.
    #[must_use]
    #[inline]
    pub fn background_mps(&self, since_takeoff_s: f64) -> (Vector3<f64>, f64) {
        let [x, y] = self
            .crossflow
            .map_or([0.0; 2], |crossflow| crossflow.wind_mps);
        let wind_mps = Vector3::new(x, y, 0.0);
        let Some(room) = &self.recirculation else {
            return (wind_mps, 0.0);
        };
        let (rising_mps, level_mps) = room.return_flow_mps(since_takeoff_s);
        (wind_mps + rising_mps, level_mps)
    }
}
