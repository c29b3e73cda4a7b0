//! Families of synthetic recordings: a flight, and the effects injected into it.

use crate::flights::{Flight, scene};
use crate::injected::{Effect, inject};
use crate::scene::{ACCURACY_ABS_MPS, ACCURACY_REL, Scene};
use crate::truth::Size;
use diagnosis::statistics::draws::Draws;

/// A kind of recording.
#[derive(Clone, Copy, Debug)]
pub(super) struct Family {
    pub(super) name: &'static str,
    flight: Flight,
    injects: &'static [Effect],
    twist: Twist,
}

/// What is unusual about a recording without being missing from its simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Twist {
    None,
    /// Gain and offset at the very end of what the maker allows.
    AtSpec,
    /// The logger lost a tenth.
    Gaps,
    /// A low-pass, stated.
    StatedLag,
    /// The metadata declare that momenta add.
    MomentumSum,
    /// The metadata declare that probes feel the radial flow.
    Radial,
    /// Turbulence that remembers for three seconds.
    LongMemory,
    /// A draughty hall, measured before take-off.
    Ambient,
    /// High and warm: thin air, stated.
    Mountain,
}

const fn family(name: &'static str, flight: Flight, injects: &'static [Effect]) -> Family {
    Family {
        name,
        flight,
        injects,
        twist: Twist::None,
    }
}

const fn null(name: &'static str, flight: Flight, twist: Twist) -> Family {
    Family {
        name,
        flight,
        injects: &[],
        twist,
    }
}

/// Recordings without an injected effect.
pub(super) const NULLS: &[Family] = &[
    null("null_grid", Flight::Grid, Twist::None),
    null("null_grid_noisy", Flight::Noisy, Twist::None),
    null("null_sparse", Flight::Sparse, Twist::None),
    null("null_passes", Flight::Passes, Twist::None),
    null("null_receiver", Flight::Under, Twist::None),
    null("null_pair", Flight::Pair, Twist::None),
    null("null_swap", Flight::Swap, Twist::None),
    null("null_slow_passes", Flight::SlowPasses, Twist::None),
    null("null_up_and_down", Flight::UpAndDown, Twist::None),
    null("null_row", Flight::Row, Twist::None),
    null("null_turning", Flight::Turning, Twist::None),
    null("null_wide", Flight::WideGrid, Twist::None),
    null("null_at_spec", Flight::Grid, Twist::AtSpec),
    null("null_passes_at_spec", Flight::Passes, Twist::AtSpec),
    null("null_gaps", Flight::Grid, Twist::Gaps),
    null("null_stated_lag", Flight::SlowPasses, Twist::StatedLag),
    null("null_momentum_sum", Flight::Pair, Twist::MomentumSum),
    null("null_radial", Flight::WideGrid, Twist::Radial),
    null("null_long_memory", Flight::Grid, Twist::LongMemory),
    null("null_ambient", Flight::Grid, Twist::Ambient),
    null("null_mountain", Flight::Grid, Twist::Mountain),
];

/// Recordings with one effect.
const SINGLES: &[Family] = &[
    family("single_crossflow", Flight::Grid, &[Effect::Crossflow]),
    family("single_motion", Flight::Passes, &[Effect::WakeTransport]),
    family("single_climb", Flight::UpAndDown, &[Effect::ClimbDescent]),
    family("single_ground", Flight::Rake, &[Effect::GroundImpingement]),
    family(
        "single_ground_thrust",
        Flight::ToFloor,
        &[Effect::GroundEffectThrust],
    ),
    family("single_ceiling", Flight::ToCeiling, &[Effect::Ceiling]),
    family(
        "single_recirculation",
        Flight::Grid,
        &[Effect::Recirculation],
    ),
    family("single_cant", Flight::Grid, &[Effect::RotorCant]),
    family("single_payload", Flight::Grid, &[Effect::PayloadMass]),
    family("single_payload_step", Flight::Grid, &[Effect::PayloadStep]),
    family("single_density", Flight::Grid, &[Effect::AirDensity]),
    family("single_size", Flight::Swap, &[Effect::DlRatio]),
    family("single_momentum", Flight::Swap, &[Effect::MomentumScale]),
    family("single_near", Flight::NearGrid, &[Effect::NearField]),
    family("single_tail", Flight::Grid, &[Effect::ProfileTail]),
    family("single_merging", Flight::Pair, &[Effect::JetMerging]),
    family("single_buoyancy", Flight::Grid, &[Effect::Buoyancy]),
    family("single_swirl", Flight::Grid, &[Effect::Swirl]),
    family("single_wander", Flight::Grid, &[Effect::Wander]),
    family("single_battery", Flight::Under, &[Effect::BatterySag]),
    family("single_inflow", Flight::Under, &[Effect::ReceiverInflow]),
    family("single_tilt", Flight::Leaning, &[Effect::WakeTilt]),
    family("sensor_gain", Flight::Grid, &[Effect::Gain]),
    family("sensor_offset", Flight::Grid, &[Effect::Offset]),
    family("sensor_drift", Flight::Grid, &[Effect::Drift]),
    family("sensor_lag", Flight::SlowPasses, &[Effect::Lag]),
    family("sensor_saturation", Flight::Grid, &[Effect::Saturation]),
    family("sensor_clock", Flight::SlowPasses, &[Effect::Clock]),
    family("sensor_clock_passes", Flight::Passes, &[Effect::Clock]),
    family("sensor_magnitude", Flight::WideGrid, &[Effect::Magnitude]),
];

/// Recordings with few samples, in rough air, or with an effect in a few percent of the samples.
const HARD: &[Family] = &[
    family("sparse_cant", Flight::Sparse, &[Effect::RotorCant]),
    family("sparse_crossflow", Flight::Sparse, &[Effect::Crossflow]),
    family("sparse_payload", Flight::Sparse, &[Effect::PayloadMass]),
    family("noisy_tail", Flight::Noisy, &[Effect::ProfileTail]),
    family("noisy_crossflow", Flight::Noisy, &[Effect::Crossflow]),
    family("noisy_wander", Flight::Noisy, &[Effect::Wander]),
    family("rare_near", Flight::RareNearGrid, &[Effect::NearField]),
    family(
        "rare_ground",
        Flight::RareRake,
        &[Effect::GroundImpingement],
    ),
    family("rare_payload", Flight::Grid, &[Effect::RarePayload]),
    family("rare_saturation", Flight::Grid, &[Effect::RareSaturation]),
    family("rare_ceiling", Flight::RareToCeiling, &[Effect::Ceiling]),
];

/// Recordings with two effects, `masked` where one takes back what the other does.
const PAIRS: &[Family] = &[
    family(
        "two_ground_crossflow",
        Flight::Rake,
        &[Effect::GroundImpingement, Effect::Crossflow],
    ),
    family(
        "two_crossflow_payload",
        Flight::Grid,
        &[Effect::Crossflow, Effect::PayloadMass],
    ),
    family(
        "two_tail_payload",
        Flight::Grid,
        &[Effect::ProfileTail, Effect::PayloadMass],
    ),
    family(
        "two_cant_crossflow",
        Flight::Grid,
        &[Effect::RotorCant, Effect::Crossflow],
    ),
    family(
        "two_motion_density",
        Flight::Passes,
        &[Effect::WakeTransport, Effect::AirDensity],
    ),
    family(
        "two_motion_cant",
        Flight::Passes,
        &[Effect::WakeTransport, Effect::RotorCant],
    ),
    family(
        "two_merging_payload",
        Flight::Pair,
        &[Effect::JetMerging, Effect::PayloadMass],
    ),
    family(
        "two_inflow_battery",
        Flight::Under,
        &[Effect::ReceiverInflow, Effect::BatterySag],
    ),
    family(
        "two_floor_battery",
        Flight::ToFloor,
        &[Effect::GroundEffectThrust, Effect::BatterySag],
    ),
    family(
        "two_cant_offset",
        Flight::Grid,
        &[Effect::RotorCant, Effect::Offset],
    ),
    family(
        "two_near_crossflow",
        Flight::NearGrid,
        &[Effect::NearField, Effect::Crossflow],
    ),
    family(
        "two_lag_cant",
        Flight::SlowPasses,
        &[Effect::Lag, Effect::RotorCant],
    ),
    family(
        "masked_cant_payload",
        Flight::Grid,
        &[Effect::CantMaskedByPayload],
    ),
    family(
        "masked_payload_gain",
        Flight::Grid,
        &[Effect::PayloadMaskedByGain],
    ),
];

/// Recordings with something that no library has.
const OUTSIDE: &[Family] = &[
    family("outside_panel", Flight::Grid, &[Effect::Panel]),
    family("outside_vent", Flight::Row, &[Effect::Vent]),
    family(
        "outside_limp_propeller",
        Flight::Turning,
        &[Effect::LimpPropeller],
    ),
    family("outside_flapping", Flight::SlowPasses, &[Effect::Flapping]),
];

/// How many families inject an effect.
pub(super) fn injecting_families() -> usize {
    SINGLES.len() + HARD.len() + PAIRS.len() + OUTSIDE.len()
}

/// One of them.
pub(super) fn injecting(index: usize) -> &'static Family {
    let mut all = SINGLES.iter().chain(HARD).chain(PAIRS).chain(OUTSIDE);
    all.nth(index % injecting_families()).unwrap_or(&SINGLES[0])
}

impl Family {
    pub(super) fn is_null(&self) -> bool {
        self.injects.is_empty()
    }

    pub(super) fn scene(&self, size: Size, random: &mut Draws) -> Scene {
        let mut scene = scene(self.flight, size, random);
        for &effect in self.injects {
            inject(effect, size, &mut scene, random);
        }
        self.twist.into_scene(&mut scene, random);
        scene
    }
}

impl Twist {
    fn into_scene(self, scene: &mut Scene, random: &mut Draws) {
        match self {
            Twist::None => {}
            Twist::AtSpec => {
                scene.instrument.own_gain = 0.98 * ACCURACY_REL * random.sign();
                scene.instrument.own_offset_mps = 0.98 * ACCURACY_ABS_MPS * random.sign();
            }
            Twist::Gaps => {
                let end_s = scene.end_s();
                scene.lost_s = (0..4)
                    .map(|_| random.between(0.0, 0.95) * end_s)
                    .map(|from_s| [from_s, from_s + 0.03 * end_s])
                    .collect();
            }
            Twist::StatedLag => scene.instrument.lowpass_s = 0.8,
            Twist::MomentumSum => scene.declares_momentum_sum = true,
            Twist::Radial => scene.declares_radial = true,
            Twist::LongMemory => scene.noise.memory_s = 3.0,
            Twist::Ambient => scene.instrument.ambient_mps = 0.25,
            Twist::Mountain => {
                scene.pressure_pa = 83_500.0;
                scene.temperature_k = 305.0;
            }
        }
    }
}
