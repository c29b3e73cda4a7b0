//! The injected effects: how each is set into its air, its drones or its instruments, weak, as met,
//! or strong.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use crate::names;
use crate::scene::Scene;
use crate::truth::{Injected, Size};
use crate::world::{Flap, Odd, Panel, Room, Shelf, Summing, Vent, Wall, stability};
use diagnosis::statistics::draws::Draws;

/// Every effect that this world can inject.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effect {
    Crossflow,
    WakeTransport,
    ClimbDescent,
    GroundImpingement,
    GroundEffectThrust,
    Ceiling,
    Recirculation,
    RotorCant,
    PayloadMass,
    PayloadStep,
    RarePayload,
    AirDensity,
    DlRatio,
    MomentumScale,
    NearField,
    ProfileTail,
    JetMerging,
    Buoyancy,
    Swirl,
    Wander,
    BatterySag,
    ReceiverInflow,
    WakeTilt,
    Gain,
    Offset,
    Drift,
    Lag,
    Saturation,
    RareSaturation,
    Clock,
    Magnitude,
    /// Wider propellers and the payload that gives the axis its speed back.
    CantMaskedByPayload,
    /// A payload and the gain that takes its speed away again.
    PayloadMaskedByGain,
    Panel,
    Vent,
    LimpPropeller,
    Flapping,
    /// A shelf that stands in the room, between the drone and where it is measured.
    Shelf,
    /// A wall beside the probes.
    Wall,
    /// A vent that is switched on and off.
    SwitchedVent,
    /// Instruments that fail in other forms than those of the library.
    BentScale,
    StartingSpeed,
    LooseContact,
    /// Jets that lean as their drones do when these speed up and brake.
    WakeLean,
}

/// Sets an effect into a scene.
pub(super) fn inject(effect: Effect, size: Size, scene: &mut Scene, random: &mut Draws) {
    let mut amount = |values: [f64; 3]| size.of(values) * random.between(0.88, 1.12);
    match effect {
        Effect::Crossflow => {
            let fastest = scene.emitters[0].drone.hover_mps(1.19);
            let wind_mps = amount([0.022, 0.06, 0.11]) * fastest;
            let azimuth = random.between(0.0, TAU);
            let wind_mps = [wind_mps * azimuth.cos(), wind_mps * azimuth.sin()];
            scene.air.wind_mps = Some(wind_mps);
            named(
                scene,
                "crossflow",
                &[("wind_x", wind_mps[0]), ("wind_y", wind_mps[1])],
            );
        }
        Effect::WakeTransport => {
            let slowness = amount([1.0, 1.6, 2.3]);
            scene.air.convection = Some(1.0 / slowness);
            named(scene, "wake_transport", &[("m", slowness)]);
        }
        Effect::ClimbDescent => {
            scene.air.climbs = true;
            named(scene, "climb_descent", &[("p", 1.0)]);
        }
        Effect::GroundImpingement => {
            scene.air.floor = true;
            named(scene, "ground_impingement", &[]);
        }
        Effect::Recirculation => {
            let (speed_mps, spin_up_s) = (amount([0.2, 0.4, 0.7]), amount([90.0, 140.0, 200.0]));
            let elevation_rad =
                [random.between(0.0, 0.3), random.between(1.2, 1.57)][random.index(2)];
            scene.air.room = Some(Room {
                speed_mps,
                spin_up_s,
                elevation_rad,
                azimuth_rad: random.between(0.0, TAU),
            });
            named(scene, "recirculation", &[("u", speed_mps)]);
        }
        Effect::RotorCant => {
            let wider = amount([0.07, 0.15, 0.28]);
            let factor = if random.uniform() < 0.5 {
                1.0 + wider
            } else {
                1.0 / (1.0 + wider)
            };
            scene.air.across.width = factor;
            named(scene, "rotor_cant", &[("q", factor)]);
        }
        Effect::MomentumScale => {
            let part = amount([0.1, 0.18, 0.3]) * random.sign();
            scene.air.strength = 1.0 + part;
            named(scene, "momentum_scale", &[("f", 1.0 + part)]);
        }
        Effect::DlRatio => {
            let power = amount([0.3, 0.6, 1.0]);
            scene.air.size_exponent = power;
            named(scene, "dl_ratio", &[("p", power)]);
        }
        Effect::NearField => {
            scene.air.lobes = Some(amount([0.3, 0.5, 0.75]));
            named(scene, "near_field", &[]);
        }
        Effect::ProfileTail => {
            scene.air.across.edge = Some([amount([2.9, 2.2, 1.7]), amount([0.8, 0.7, 0.5])]);
            named(scene, "profile_tail", &[]);
        }
        Effect::JetMerging => {
            let exponent = amount([1.3, 1.6, 2.0]).min(2.0);
            scene.air.summing = Summing {
                exponent,
                attraction: size.of([0.0, 0.25, 0.5]),
            };
            named(scene, "jet_merging", &[("q", exponent)]);
        }
        Effect::Buoyancy => {
            scene.air.stability = stability(amount([1.5, 4.0, 8.0]), scene.temperature_k);
            named(scene, "buoyancy", &[]);
        }
        Effect::Swirl => {
            scene.air.across.swirl = amount([0.25, 0.45, 0.8]);
            named(scene, "swirl", &[]);
        }
        Effect::Wander => {
            scene.air.across.wander = amount([0.035, 0.055, 0.085]);
            named(scene, "wander", &[]);
        }
        Effect::WakeTilt => {
            scene.air.leans = 1.0;
            named(scene, "wake_tilt", &lean(scene));
        }
        Effect::WakeLean => {
            let share = random.between(0.6, 1.0);
            scene.air.leans = share;
            named(scene, "wake_lean", &[("g", share)]);
        }
        Effect::Magnitude => {
            scene.air.radial = true;
            named(scene, "magnitude_sensor", &[("kappa", 1.0)]);
        }
        Effect::GroundEffectThrust
        | Effect::Ceiling
        | Effect::BatterySag
        | Effect::ReceiverInflow => at_the_receiver(effect, size, scene, random),
        Effect::PayloadMass
        | Effect::PayloadStep
        | Effect::RarePayload
        | Effect::AirDensity
        | Effect::CantMaskedByPayload
        | Effect::PayloadMaskedByGain => in_the_scales(effect, size, scene, random),
        Effect::Gain
        | Effect::Offset
        | Effect::Drift
        | Effect::Lag
        | Effect::Saturation
        | Effect::RareSaturation
        | Effect::Clock => in_the_instrument(effect, size, scene, random),
        Effect::Panel
        | Effect::Vent
        | Effect::LimpPropeller
        | Effect::Flapping
        | Effect::Shelf
        | Effect::Wall
        | Effect::SwitchedVent
        | Effect::BentScale
        | Effect::StartingSpeed
        | Effect::LooseContact => outside(effect, size, scene, random),
    }
}

fn named(scene: &mut Scene, name: &str, parameters: &[(&str, f64)]) {
    scene.effects.push(Injected {
        name: name.to_owned(),
        accepted: names::accepted(name),
        parameters: parameters
            .iter()
            .map(|&(name, value)| (name.to_owned(), value))
            .collect(),
    });
}

/// Slope of the leaning axis in the world, as the route has it.
fn lean(scene: &Scene) -> [(&'static str, f64); 2] {
    let route = &scene.emitters[0].route;
    let knot = route.knot(0.5 * route.end_s());
    let [roll, pitch] = knot.lean_rad;
    let down =
        nalgebra::Rotation3::from_euler_angles(roll, pitch, knot.yaw_rad) * -nalgebra::Vector3::z();
    [("lean_x", -down.x / down.z), ("lean_y", -down.y / down.z)]
}

fn at_the_receiver(effect: Effect, size: Size, scene: &mut Scene, random: &mut Draws) {
    let Some(receiver) = &mut scene.receiver else {
        return;
    };
    let mut amount = |values: [f64; 3]| size.of(values) * random.between(0.88, 1.12);
    match effect {
        Effect::GroundEffectThrust => {
            receiver.answer.floor = true;
            named(scene, "ground_effect_thrust", &[]);
        }
        Effect::Ceiling => {
            receiver.answer.ceiling = true;
            named(scene, "ceiling_effect", &[]);
        }
        Effect::BatterySag => {
            receiver.answer.battery = amount([0.35, 0.8, 1.5]);
            named(scene, "battery_sag", &[]);
        }
        _ => {
            receiver.answer.inflow = amount([0.08, 0.25, 0.6]);
            named(scene, "receiver_inflow", &[]);
        }
    }
}

/// Mass, density and what hides them.
fn in_the_scales(effect: Effect, size: Size, scene: &mut Scene, random: &mut Draws) {
    let heavier = size.of([0.12, 0.33, 0.65]) * random.between(0.88, 1.12);
    let is_lighter = random.uniform() < 0.35;
    let factor = if is_lighter {
        1.0 / (1.0 + heavier)
    } else {
        1.0 + heavier
    };
    let end_s = scene.end_s();
    match effect {
        Effect::AirDensity => {
            let thinner = size.of([0.08, 0.2, 0.3]) * random.between(0.88, 1.12);
            scene.density_factor = 1.0 - thinner;
            named(scene, "air_density", &[]);
        }
        Effect::CantMaskedByPayload => {
            // U_C goes with √m/q: unchanged for m = q².
            let width = 1.0 + size.of([0.08, 0.15, 0.25]) * random.between(0.88, 1.12);
            scene.air.across.width = width;
            load(scene, width * width, [f64::NEG_INFINITY, f64::INFINITY]);
            named(scene, "rotor_cant", &[("q", width)]);
            named(scene, "payload_mass", &[("m/m0", width * width)]);
        }
        Effect::PayloadMaskedByGain => {
            load(scene, factor, [f64::NEG_INFINITY, f64::INFINITY]);
            let gain = 1.0 / factor.sqrt() - 1.0;
            scene.faults.gain = gain;
            named(scene, "payload_mass", &[("m/m0", factor)]);
            named(scene, "sensor_gain", &[("g", gain)]);
        }
        Effect::PayloadStep => {
            let at_s = end_s * random.between(0.3, 0.7);
            load(scene, factor, [at_s, f64::INFINITY]);
            named(scene, "payload_mass", &[("m/m0", factor), ("t0", at_s)]);
        }
        Effect::RarePayload => {
            let from_s = end_s * random.between(0.2, 0.9);
            // Heavy: what is there for a minute has to be seen in a minute.
            load(scene, 1.0 + 1.6 * heavier, [from_s, from_s + 0.045 * end_s]);
            named(scene, "payload_mass", &[]);
        }
        _ => {
            load(scene, factor, [f64::NEG_INFINITY, f64::INFINITY]);
            named(scene, "payload_mass", &[("m/m0", factor)]);
        }
    }
}

fn load(scene: &mut Scene, factor: f64, span_s: [f64; 2]) {
    for emitter in &mut scene.emitters {
        emitter.load.factor = factor;
        [emitter.load.from_s, emitter.load.to_s] = span_s;
    }
}

fn in_the_instrument(effect: Effect, size: Size, scene: &mut Scene, random: &mut Draws) {
    let (sign, is_of_zero) = (random.sign(), random.uniform() < 0.5);
    let mut amount = |values: [f64; 3]| size.of(values) * random.between(0.88, 1.12);
    let is_throttle = scene.receiver.is_some();
    let fastest_mps = scene.emitters[0].drone.hover_mps(1.19);
    match effect {
        Effect::Gain => {
            scene.faults.gain = amount([0.12, 0.2, 0.32]) * sign;
            named(scene, "sensor_gain", &[("g", scene.faults.gain)]);
        }
        Effect::Offset => {
            let offset = amount([0.13, 0.25, 0.5]) * if is_throttle { 0.2 } else { 1.0 };
            scene.faults.offset = offset;
            named(scene, "sensor_offset", &[("b", offset)]);
        }
        Effect::Drift => {
            let hours = scene.end_s() / 3600.0;
            if is_of_zero {
                // Upwards: a speed that falls below nothing is cut off there.
                scene.faults.offset_per_h = amount([0.2, 0.35, 0.7]) / hours;
            } else {
                scene.faults.gain_per_h = sign * amount([0.12, 0.25, 0.45]) / hours;
            }
            let (gain, offset) = (scene.faults.gain_per_h, scene.faults.offset_per_h);
            named(scene, "sensor_drift", &[("g'", gain), ("b'", offset)]);
        }
        Effect::Lag => {
            scene.faults.lag_s = amount([0.45, 1.2, 2.8]);
            named(scene, "sensor_lag", &[("tau", scene.faults.lag_s)]);
        }
        Effect::Saturation => {
            scene.faults.highest =
                (amount([0.85, 0.65, 0.45]) * fastest_mps * 100.0).round() / 100.0;
            named(
                scene,
                "sensor_saturation",
                &[("y_max", scene.faults.highest)],
            );
        }
        Effect::RareSaturation => {
            scene.faults.highest = (amount([1.0, 0.95, 0.9]) * fastest_mps * 100.0).round() / 100.0;
            named(
                scene,
                "sensor_saturation",
                &[("y_max", scene.faults.highest)],
            );
        }
        _ => {
            scene.faults.clock_s = amount([0.3, 0.9, 2.0]) * sign;
            named(scene, "clock_misalignment", &[("dt", scene.faults.clock_s)]);
        }
    }
}

/// What no library has.
fn outside(effect: Effect, size: Size, scene: &mut Scene, random: &mut Draws) {
    let hz = scene.instrument.rate_hz * random.between(0.03, 0.12);
    let mut amount = |values: [f64; 3]| size.of(values) * random.between(0.88, 1.12);
    let name = match effect {
        Effect::Panel => {
            scene.air.panel = Some(Panel {
                takes: amount([0.35, 0.6, 0.85]),
                half_angle_rad: amount([0.6, 0.7, 0.8]),
                azimuth_rad: random.between(0.0, TAU),
            });
            "obstacle_shadow"
        }
        Effect::Vent => {
            let (speed_mps, azimuth) = (amount([0.3, 0.6, 1.1]), random.between(0.0, TAU));
            scene.air.vent = Some(Vent {
                at_m: [0.9 * random.sign(), random.between(-0.3, 0.3)],
                radius_m: random.between(0.3, 0.45),
                blows_mps: [speed_mps * azimuth.cos(), speed_mps * azimuth.sin()],
                period_s: f64::INFINITY,
            });
            "vent"
        }
        Effect::SwitchedVent => {
            let (speed_mps, azimuth) = (amount([0.4, 0.8, 1.2]), random.between(0.0, TAU));
            let at_m = scene.probes[random.index(scene.probes.len())].place_m;
            scene.air.vent = Some(Vent {
                at_m: [at_m.x + random.within(0.2), at_m.y + random.within(0.2)],
                radius_m: random.between(0.3, 0.6),
                blows_mps: [speed_mps * azimuth.cos(), speed_mps * azimuth.sin()],
                period_s: random.between(25.0, 70.0),
            });
            "switched_vent"
        }
        Effect::Shelf => {
            let motors_m = scene.emitters[0].drone.motors_m;
            scene.air.shelf = Some(Shelf {
                takes: amount([0.4, 0.65, 0.95]),
                at_m: [(); 2].map(|()| random.within(1.2 * motors_m)),
                half_m: [(); 2].map(|()| random.between(0.4, 0.9) * motors_m),
                z_m: scene.probes[0].position_m(0.0).z + random.between(0.8, 1.8) * motors_m,
            });
            "shelf"
        }
        Effect::Wall => {
            let gap_m = amount([2.6, 1.9, 1.3]) * 0.5 * scene.emitters[0].drone.motors_m;
            let (sin, cos) = random.between(0.0, TAU).sin_cos();
            let normal = [cos, sin];
            // Drones fly and probes stand on one side of it.
            let away_m = scene.reaches_m(normal) + gap_m;
            scene.air.wall = Some(Wall { normal, away_m });
            "wall"
        }
        Effect::BentScale => {
            let power = amount([0.85, 0.75, 0.6]);
            let reference = scene.emitters[0].drone.hover_mps(1.19);
            scene.faults.odd = Odd::Bent { power, reference };
            "bent_scale"
        }
        Effect::StartingSpeed => {
            let at_mps = amount([0.12, 0.18, 0.28]) * scene.emitters[0].drone.hover_mps(1.19);
            scene.faults.odd = Odd::Starts { at_mps };
            "starting_speed"
        }
        Effect::LooseContact => {
            let part = 1.0 - amount([0.25, 0.4, 0.7]);
            let end_s = scene.end_s();
            let spans = 4 + random.index(4);
            let span_s = |_| {
                let from_s = random.between(0.0, 0.95) * end_s;
                [from_s, from_s + random.between(0.02, 0.05) * end_s]
            };
            scene.faults.odd = Odd::Loose {
                part,
                spans_s: (0..spans).map(span_s).collect(),
            };
            "loose_contact"
        }
        Effect::LimpPropeller => {
            scene.air.across.limp = amount([0.1, 0.2, 0.35]);
            "damaged_propeller"
        }
        _ => {
            scene.air.flap = Some(Flap {
                part: amount([0.12, 0.22, 0.4]),
                hz,
            });
            "flapping"
        }
    };
    scene.is_outside = true;
    scene.effects.push(Injected {
        name: name.to_owned(),
        accepted: Vec::new(),
        parameters: BTreeMap::new(),
    });
}
