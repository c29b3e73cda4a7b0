//! Families that the seed draws: any effect in any flight that can show it, alone or with another,
//! from the beginning or from some moment on, with rates, baselines, instruments and noise that
//! differ from case to case.
//!
//! They fall in two halves by their effects and flight. One is shown case by case; the other is for
//! totals alone, so that nothing is set while looking at it.

use crate::flights::{Flight, scene};
use crate::injected::{Effect, inject};
use crate::scene::{ACCURACY_ABS_MPS, ACCURACY_REL, Scene};
use crate::truth::Size;
use diagnosis::statistics::draws::Draws;

/// Which half of the drawn families.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Half {
    /// Listed families and drawn ones in turn, with a line for each miss.
    Shown,
    /// Drawn families that are in no other run: totals alone.
    Unseen,
}

/// Flights past or over probes in which any effect of the air or the instrument shows.
const OVER_PROBES: &[Flight] = &[
    Flight::Grid,
    Flight::WideGrid,
    Flight::Row,
    Flight::Passes,
    Flight::Sideways,
    Flight::Traverse,
    Flight::Carried,
];
const ON_THE_MOVE: &[Flight] = &[Flight::Passes, Flight::SlowPasses, Flight::Sideways];
const BELOW: &[Flight] = &[Flight::Under, Flight::ToFloor];

/// Effects with the flights that can show them.
const SHOWN_BY: &[(Effect, &[Flight])] = &[
    (Effect::Crossflow, OVER_PROBES),
    (Effect::WakeTransport, ON_THE_MOVE),
    (Effect::ClimbDescent, &[Flight::UpAndDown]),
    (Effect::GroundImpingement, &[Flight::Rake]),
    (Effect::GroundEffectThrust, &[Flight::ToFloor]),
    (Effect::Ceiling, &[Flight::ToCeiling]),
    (Effect::Recirculation, OVER_PROBES),
    (Effect::RotorCant, OVER_PROBES),
    (Effect::PayloadMass, OVER_PROBES),
    (Effect::PayloadStep, OVER_PROBES),
    (Effect::AirDensity, OVER_PROBES),
    (Effect::DlRatio, &[Flight::Swap]),
    (Effect::MomentumScale, &[Flight::Swap]),
    (Effect::NearField, &[Flight::NearGrid]),
    (Effect::ProfileTail, OVER_PROBES),
    (Effect::JetMerging, &[Flight::Pair]),
    (Effect::Buoyancy, OVER_PROBES),
    (Effect::Swirl, OVER_PROBES),
    (Effect::Wander, OVER_PROBES),
    (Effect::BatterySag, BELOW),
    (Effect::ReceiverInflow, BELOW),
    (Effect::WakeTilt, &[Flight::Leaning]),
    (Effect::Gain, OVER_PROBES),
    (Effect::Offset, OVER_PROBES),
    (Effect::Drift, OVER_PROBES),
    (Effect::Lag, ON_THE_MOVE),
    (Effect::Saturation, OVER_PROBES),
    (Effect::Clock, ON_THE_MOVE),
    (Effect::Magnitude, OVER_PROBES),
    (Effect::Panel, &[Flight::Grid, Flight::WideGrid]),
    (Effect::Vent, &[Flight::Row]),
    (Effect::LimpPropeller, &[Flight::Turning]),
    (Effect::Flapping, &[Flight::SlowPasses, Flight::Passes]),
    (Effect::Shelf, OVER_PROBES),
    (Effect::Wall, OVER_PROBES),
    (Effect::SwitchedVent, OVER_PROBES),
    (Effect::BentScale, OVER_PROBES),
    (Effect::StartingSpeed, OVER_PROBES),
    (Effect::LooseContact, OVER_PROBES),
    (Effect::WakeLean, &[Flight::Shaken]),
];

/// Effects that may be joined by a second one: neither changes what the other is.
const JOINED: &[Effect] = &[
    Effect::Crossflow,
    Effect::RotorCant,
    Effect::ProfileTail,
    Effect::PayloadMass,
    Effect::Offset,
    Effect::Lag,
    Effect::Saturation,
    Effect::WakeTransport,
    Effect::NearField,
    Effect::JetMerging,
    Effect::Drift,
];
const SECOND: &[Effect] = &[
    Effect::Crossflow,
    Effect::RotorCant,
    Effect::PayloadMass,
    Effect::Offset,
    Effect::Drift,
    Effect::Saturation,
];
/// Effects that may set in half-way: a door, a bump, a knock.
const MIDWAY: &[Effect] = &[
    Effect::Crossflow,
    Effect::Gain,
    Effect::Offset,
    Effect::Panel,
    Effect::Vent,
    Effect::LimpPropeller,
    Effect::Shelf,
    Effect::Clock,
];

/// Flights of recordings without an effect.
const NULLS: &[Flight] = &[
    Flight::Grid,
    Flight::WideGrid,
    Flight::Row,
    Flight::Passes,
    Flight::SlowPasses,
    Flight::Sideways,
    Flight::Traverse,
    Flight::Carried,
    Flight::Under,
    Flight::ToFloor,
    Flight::Pair,
    Flight::Swap,
    Flight::Turning,
    Flight::Noisy,
    Flight::Shaken,
];

/// A drawn scene, and what it is called.
pub(super) fn drawn(half: Half, is_null: bool, random: &mut Draws) -> (String, Scene) {
    let size = Size::ALL[random.index(3)];
    if is_null {
        let flights: Vec<&Flight> = NULLS
            .iter()
            .filter(|flight| is_of(half, **flight as usize))
            .collect();
        let flight = *flights[random.index(flights.len())];
        let mut scene = scene(flight, Size::Mid, random);
        weather(&mut scene, random);
        return (format!("drawn_null_{flight:?}").to_lowercase(), scene);
    }
    loop {
        let (effect, flights) = SHOWN_BY[random.index(SHOWN_BY.len())];
        let flight = flights[random.index(flights.len())];
        let second = SECOND[random.index(SECOND.len())];
        let shows_second = SHOWN_BY.iter().any(|(of, flights)| {
            *of == second && (flights.contains(&flight) || flight == Flight::NearGrid)
        });
        let joins =
            random.uniform() < 0.35 && second != effect && JOINED.contains(&effect) && shows_second;
        let number = effect as usize + flight as usize + usize::from(joins) * second as usize;
        if !is_of(half, number) {
            continue;
        }
        let mut scene = scene(flight, size, random);
        weather(&mut scene, random);
        inject(effect, size, &mut scene, random);
        let mut name = format!("drawn_{effect:?}");
        if joins {
            inject(second, size, &mut scene, random);
            name += &format!("_{second:?}");
        } else if MIDWAY.contains(&effect) && random.uniform() < 0.35 {
            let at_s = random.between(0.25, 0.65) * scene.end_s();
            scene.begins_s = at_s;
            scene.faults.from_s = at_s - 1.0;
            name += "_midway";
        }
        return (format!("{name}_{flight:?}").to_lowercase(), scene);
    }
}

fn is_of(half: Half, number: usize) -> bool {
    number.is_multiple_of(2) == (half == Half::Shown)
}

/// What differs from day to day without being missing from the simulation: rate, resolution, noise,
/// gaps, declared baseline, weather.
fn weather(scene: &mut Scene, random: &mut Draws) {
    let is_probe = scene.receiver.is_none();
    let mut chance = |share: f64| random.uniform() < share;
    let (is_heavy, has_gaps, is_at_spec) = (chance(0.3), chance(0.25), chance(0.2));
    let (is_high, is_lagged, is_radial, adds_momenta) =
        (chance(0.2), chance(0.15), chance(0.15), chance(0.25));
    scene.noise.is_heavy = is_heavy;
    scene.noise.white *= random.between(0.6, 1.5);
    scene.noise.turbulence *= random.between(0.6, 1.6);
    scene.noise.memory_s *= random.between(0.5, 2.0);
    if is_at_spec {
        scene.instrument.own_gain = 0.98 * ACCURACY_REL * random.sign();
        scene.instrument.own_offset_mps = 0.98 * ACCURACY_ABS_MPS * random.sign();
    }
    if has_gaps {
        let end_s = scene.end_s();
        let count = 1 + random.index(5);
        let starts_s = (0..count).map(|_| random.between(0.0, 0.95) * end_s);
        scene.lost_s = starts_s.map(|s| [s, s + 0.03 * end_s]).collect();
    }
    if is_high {
        scene.pressure_pa = random.between(70_000.0, 95_000.0).round();
        scene.temperature_k = random.between(265.0, 310.0).round();
    }
    if !is_probe {
        return;
    }
    scene.instrument.resolution_mps = [0.01, 0.01, 0.02, 0.05][random.index(4)];
    scene.instrument.ambient_mps = (random.between(0.03, 0.3) * 1e3).round() / 1e3;
    // Hovers are read at the rate that the logger happens to have.
    if scene.instrument.rate_hz <= 1.0 {
        scene.instrument.rate_hz = (random.between(0.8, 2.5) * 10.0).round() / 10.0;
    }
    if is_lagged {
        scene.instrument.lowpass_s = (random.between(0.1, 1.0) * 10.0).round() / 10.0;
    }
    scene.declares_radial = is_radial;
    scene.declares_momentum_sum = adds_momenta && scene.emitters.len() > 1;
}
