//! The flights of the synthetic campaign, before any effect is injected.

mod receivers;

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

use crate::scene::{ACCURACY_ABS_MPS, ACCURACY_REL, Probe, Scene};
use crate::truth::Size;
use crate::world::{
    Air, Drone, Emitter, Faults, Instrument, KOLIBRI, Load, Noise, OFFBOARD_1, OFFBOARD_2, Route,
};
use diagnosis::statistics::draws::Draws;

/// Kinds of flights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flight {
    /// Five to six seconds at each of some hundred points above a probe.
    Grid,
    /// The same, far out to the side as well.
    WideGrid,
    /// The same, some points close above the probe.
    NearGrid,
    /// A grid with one point in thirty close above the probe.
    RareNearGrid,
    /// Some two hundred readings.
    Sparse,
    /// A grid in rough air.
    Noisy,
    /// A grid with the drone turned at every point.
    Turning,
    /// A grid by a drone that leans all the time, held by a line.
    Leaning,
    /// Straight passes over a probe at 10 Hz.
    Passes,
    /// Slow passes at 4 Hz.
    SlowPasses,
    /// Up and down above a probe at 10 Hz.
    UpAndDown,
    /// A rake of four probes near the floor.
    Rake,
    /// A rake high above it and one low probe, switched on for the last third.
    RareRake,
    /// Three probes in a row.
    Row,
    /// Two drones side by side.
    Pair,
    /// Two kinds of drones, one after the other.
    Swap,
    /// A small drone crosses below a large one.
    Under,
    /// A drone goes down towards the floor.
    ToFloor,
    /// A drone goes up towards the ceiling.
    ToCeiling,
    /// A drone that once goes up to the ceiling.
    RareToCeiling,
    /// Sideways over a rake of probes.
    Sideways,
    /// Slowly down past a probe and up again, beside its axis.
    Traverse,
    /// A probe on a second drone that crosses below.
    Carried,
    /// To and fro over a probe at 10 Hz, leaning as it speeds up and brakes; the baseline has air
    /// take its time.
    Shaken,
}

/// Height of the probe above the floor (m).
const PROBE_Z_M: f64 = 3.0;

pub(super) fn scene(flight: Flight, size: Size, random: &mut Draws) -> Scene {
    let small = [KOLIBRI, OFFBOARD_1, OFFBOARD_2][random.index(3)];
    let mut scene = match flight {
        Flight::Grid | Flight::Noisy => {
            grid(small, 115 + random.index(25), [2.6, 14.0], 1.0, random)
        }
        Flight::WideGrid => grid(small, 125, [2.6, 14.0], 2.2, random),
        Flight::NearGrid => grid(small, 130, [0.45, 12.0], 1.0, random),
        Flight::RareNearGrid => rare_near_grid(small, random),
        Flight::Sparse => grid(small, 22, [2.6, 14.0], 1.0, random),
        Flight::Turning => turned(grid(small, 110, [2.6, 14.0], 1.0, random), random),
        Flight::Leaning => leaning(small, size, random),
        Flight::Passes => passes(small, 10.0, [0.2, 3.0], random),
        Flight::SlowPasses => passes(small, 4.0, [0.2, 0.9], random),
        Flight::UpAndDown => up_and_down(small, size, random),
        Flight::Rake => rake(size, random),
        Flight::RareRake => rare_rake(random),
        Flight::Row => row(random),
        Flight::Pair => pair(random),
        Flight::Swap => swap(random),
        Flight::Under => receivers::under(random),
        Flight::ToFloor => receivers::to_surface(false, size, random),
        Flight::ToCeiling => receivers::to_surface(true, size, random),
        Flight::RareToCeiling => receivers::rare_to_ceiling(random),
        Flight::Sideways => sideways(small, random),
        Flight::Traverse => traverse(small, random),
        Flight::Carried => carried(small, random),
        Flight::Shaken => shaken(small, size, random),
    };
    if flight == Flight::Noisy {
        scene.noise.turbulence = 0.2;
    }
    scene
}

/// No drone yet: weather, instrument and noise of a day.
fn day(random: &mut Draws) -> Scene {
    Scene {
        emitters: Vec::new(),
        receiver: None,
        probes: vec![Probe::at(Vector3::z() * PROBE_Z_M)],
        air: Air::default(),
        faults: Faults::default(),
        noise: Noise {
            white: random.between(0.035, 0.055),
            // What a slow probe sees of a jet's turbulence of a quarter.
            turbulence: random.between(0.06, 0.1),
            memory_s: random.between(0.4, 1.0),
            is_heavy: false,
        },
        instrument: Instrument {
            rate_hz: 1.0,
            lowpass_s: 0.0,
            ambient_mps: (random.between(0.06, 0.12) * 1e3).round() / 1e3,
            resolution_mps: 0.01,
            own_gain: random.within(ACCURACY_REL),
            own_offset_mps: random.within(ACCURACY_ABS_MPS),
        },
        temperature_k: (random.between(287.0, 302.0) * 100.0).round() / 100.0,
        pressure_pa: 101_325.0,
        density_factor: 1.0,
        floor_z_m: 0.0,
        ceiling_z_m: None,
        track_hz: 4.0,
        declares_momentum_sum: false,
        declares_radial: false,
        declares_convection: None,
        begins_s: f64::NEG_INFINITY,
        lost_s: Vec::new(),
        effects: Vec::new(),
        is_outside: false,
    }
}

fn emitter(drone: Drone, route: Route) -> Emitter {
    Emitter {
        drone,
        route,
        load: Load::default(),
    }
}

fn around(azimuth_rad: f64, radius_m: f64) -> Vector3<f64> {
    Vector3::new(
        radius_m * azimuth_rad.cos(),
        radius_m * azimuth_rad.sin(),
        0.0,
    )
}

/// A hover point above the probe: depth (in motor distances) even in its logarithm, most of them
/// within two half-widths.
fn hover_point(drone: &Drone, depths: [f64; 2], wide: f64, random: &mut Draws) -> Vector3<f64> {
    let [low, high] = depths.map(f64::ln);
    let depth_m = random.between(low, high).exp() * drone.motors_m;
    let xi = if random.uniform() < 0.7 {
        (wide * random.normal()).abs()
    } else {
        random.between(0.0, 3.5 * wide)
    };
    let place_m = around(
        random.between(0.0, TAU),
        xi.min(3.5 * wide) * drone.half_m(depth_m),
    );
    place_m + Vector3::z() * (PROBE_Z_M + depth_m)
}

fn grid(drone: Drone, points: usize, depths: [f64; 2], wide: f64, random: &mut Draws) -> Scene {
    let mut scene = day(random);
    let mut route = Route::swaying(random);
    for _ in 0..points {
        route.go(hover_point(&drone, depths, wide, random), 0.35);
        route.stay(random.between(5.0, 9.0));
    }
    scene.emitters.push(emitter(drone, route));
    scene
}

fn rare_near_grid(drone: Drone, random: &mut Draws) -> Scene {
    let mut scene = day(random);
    let mut route = Route::swaying(random);
    for point in 0..130 {
        if point % 32 == 16 {
            let depth_m = random.between(0.5, 1.1) * drone.motors_m;
            let place_m = around(
                random.between(0.0, TAU),
                random.between(0.0, 0.6) * drone.motors_m,
            );
            route.go(place_m + Vector3::z() * (PROBE_Z_M + depth_m), 0.35);
        } else {
            route.go(hover_point(&drone, [2.6, 14.0], 1.0, random), 0.35);
        }
        route.stay(6.0);
    }
    scene.emitters.push(emitter(drone, route));
    scene
}

/// The same points, each with its own heading.
fn turned(mut scene: Scene, random: &mut Draws) -> Scene {
    let drone = scene.emitters[0].drone;
    let mut route = Route::swaying(random);
    for _ in 0..120 {
        route.go(hover_point(&drone, [2.6, 14.0], 1.0, random), 0.35);
        route.turn(random.between(-PI, PI), [0.0; 2]);
        route.stay(6.0);
    }
    scene.emitters[0].route = route;
    scene
}

fn leaning(drone: Drone, size: Size, random: &mut Draws) -> Scene {
    let mut scene = day(random);
    let mut route = Route::swaying(random);
    let lean_rad = size.of([2.0, 4.5, 9.0]).to_radians() * random.between(0.85, 1.15);
    let azimuth = random.between(0.0, TAU);
    for point in 0..120 {
        route.go(hover_point(&drone, [2.6, 14.0], 1.3, random), 0.35);
        if point == 0 {
            route.turn(0.0, [lean_rad * azimuth.cos(), lean_rad * azimuth.sin()]);
        }
        route.stay(6.0);
    }
    scene.emitters.push(emitter(drone, route));
    scene
}

fn shaken(drone: Drone, size: Size, random: &mut Draws) -> Scene {
    let mut scene = day(random);
    scene.declares_convection = Some(1.0);
    scene.instrument.rate_hz = 10.0;
    scene.track_hz = 20.0;
    let mut route = Route::swaying(random);
    while route.end_s() < 330.0 {
        route.go(hover_point(&drone, [2.6, 14.0], 1.0, random), 0.35);
        let most_mps2 = size.of([0.5, 1.0, 2.0]) * random.between(0.85, 1.15);
        route.shake(
            random.between(0.0, TAU),
            most_mps2,
            random.between(1.4, 2.4),
            3,
        );
    }
    scene.emitters.push(emitter(drone, route));
    scene
}

fn passes(drone: Drone, rate_hz: f64, speeds_mps: [f64; 2], random: &mut Draws) -> Scene {
    let mut scene = day(random);
    scene.instrument.rate_hz = rate_hz;
    scene.track_hz = rate_hz;
    let mut route = Route::swaying(random);
    let half_m = 5.1 * drone.motors_m;
    let most_s = if rate_hz > 5.0 { 330.0 } else { 500.0 };
    let [slow, fast] = speeds_mps.map(f64::ln);
    while route.end_s() < most_s {
        let depth_m = random.between(2.7, 12.0) * drone.motors_m;
        let azimuth = random.between(0.0, TAU);
        let missing_m = random.normal() * 0.6 * drone.half_m(depth_m);
        let middle_m = around(azimuth + 0.5 * PI, missing_m) + Vector3::z() * (PROBE_Z_M + depth_m);
        route.go(middle_m - around(azimuth, half_m), 0.75);
        route.stay(0.5);
        route.go(
            middle_m + around(azimuth, half_m),
            random.between(slow, fast).exp(),
        );
        route.stay(0.6);
    }
    scene.emitters.push(emitter(drone, route));
    scene
}

/// A rate (Hz) between two, even in its logarithm; probes and tracker alike.
fn rate_hz(scene: &mut Scene, [low, high]: [f64; 2], random: &mut Draws) -> f64 {
    let rate_hz = random.between(low.ln(), high.ln()).exp();
    scene.instrument.rate_hz = (rate_hz * 10.0).round() / 10.0;
    scene.track_hz = scene.instrument.rate_hz.max(4.0);
    scene.instrument.rate_hz
}

/// Readings that a flight of several rates should come to, about, and the span (s) that it must
/// last.
const READINGS: f64 = 4000.0;
const SPAN_S: [f64; 2] = [170.0, 600.0];

fn sideways(drone: Drone, random: &mut Draws) -> Scene {
    let mut scene = day(random);
    let probes = 3 + random.index(3);
    let rate_hz = rate_hz(&mut scene, [3.0, 12.0], random);
    let apart_m = random.between(0.5, 1.4) * drone.motors_m;
    let aside_m = |probe: usize| (probe as f64 - 0.5 * (probes - 1) as f64) * apart_m;
    let places_m = (0..probes).map(|probe| Vector3::new(aside_m(probe), 0.0, PROBE_Z_M));
    scene.probes = places_m.map(Probe::at).collect();
    let span_s = (READINGS / rate_hz / probes as f64).clamp(SPAN_S[0], SPAN_S[1]);
    let mut route = Route::swaying(random);
    while route.end_s() < span_s {
        let depth_m = random.between(2.7, 12.0) * drone.motors_m;
        let x_m = random.within(0.6 * probes as f64 * apart_m);
        let y_m = 4.5 * drone.motors_m * random.sign();
        let from_m = Vector3::new(x_m, y_m, PROBE_Z_M + depth_m);
        route.go(from_m, 0.8);
        let to_m = Vector3::new(x_m + random.within(apart_m), -y_m, from_m.z);
        route.go(to_m, random.between(0.25, 1.5));
        route.stay(0.5);
    }
    scene.emitters.push(emitter(drone, route));
    scene
}

fn traverse(drone: Drone, random: &mut Draws) -> Scene {
    let mut scene = day(random);
    let rate_hz = rate_hz(&mut scene, [3.0, 25.0], random);
    let span_s = (READINGS / rate_hz).clamp(SPAN_S[0], SPAN_S[1]);
    let mut route = Route::swaying(random);
    while route.end_s() < span_s {
        let xi = (0.9 * random.normal()).abs().min(3.0);
        let aside_m = around(
            random.between(0.0, TAU),
            xi * drone.half_m(6.0 * drone.motors_m),
        );
        let depths_m = [2.7, random.between(9.0, 14.0)].map(|depth| depth * drone.motors_m);
        let [low_m, high_m] = depths_m.map(|m| aside_m + Vector3::z() * (PROBE_Z_M + m));
        route.go(high_m, 0.6);
        route.go(low_m, random.between(0.08, 0.3));
        route.go(high_m, random.between(0.08, 0.3));
    }
    scene.emitters.push(emitter(drone, route));
    scene
}

fn carried(drone: Drone, random: &mut Draws) -> Scene {
    let mut scene = day(random);
    let rate_hz = rate_hz(&mut scene, [3.0, 25.0], random);
    let span_s = (READINGS / rate_hz).clamp(SPAN_S[0], SPAN_S[1]);
    let mut above = Route::swaying(random);
    let mut below = Route::swaying(random);
    let height_m = PROBE_Z_M + 14.0 * drone.motors_m;
    while below.end_s() < span_s {
        // The upper drone hovers at another place every now and then; the lower one crosses.
        above.go(
            around(random.between(0.0, TAU), 0.3) + Vector3::z() * height_m,
            0.3,
        );
        above.stay(random.between(15.0, 40.0));
        while below.end_s() < above.end_s() {
            let depth_m = random.between(2.7, 12.0) * drone.motors_m;
            let azimuth = random.between(0.0, TAU);
            let missing_m = random.normal() * 0.7 * drone.half_m(depth_m);
            let middle_m = above.position_m(below.end_s()) - Vector3::z() * depth_m
                + around(azimuth + 0.5 * PI, missing_m);
            let half_m = random.between(2.0, 4.0) * drone.motors_m;
            below.go(middle_m - around(azimuth, half_m), 0.8);
            below.go(
                middle_m + around(azimuth, half_m),
                random.between(0.15, 0.8),
            );
        }
    }
    scene.probes = vec![Probe {
        carried_by: Some(below),
        ..Probe::at(Vector3::zeros())
    }];
    scene.emitters.push(emitter(drone, above));
    scene
}

fn up_and_down(drone: Drone, size: Size, random: &mut Draws) -> Scene {
    let mut scene = day(random);
    scene.instrument.rate_hz = 10.0;
    scene.track_hz = 10.0;
    let mut route = Route::swaying(random);
    let low_m = Vector3::z() * (PROBE_Z_M + 3.0 * drone.motors_m);
    let high_m = Vector3::z() * (PROBE_Z_M + 14.0 * drone.motors_m);
    while route.end_s() < 300.0 {
        let aside_m = around(
            random.between(0.0, TAU),
            random.normal().abs() * 0.7 * drone.motors_m,
        );
        let speed_mps = size.of([0.9, 1.6, 2.6]) * random.between(0.6, 1.2);
        route.go(low_m + aside_m, 1.0);
        route.stay(1.0);
        route.go(high_m + aside_m, speed_mps);
        route.stay(1.0);
        route.go(low_m + aside_m, 0.8 * speed_mps);
    }
    scene.emitters.push(emitter(drone, route));
    scene
}

fn rake(size: Size, random: &mut Draws) -> Scene {
    let mut scene = day(random);
    let drone = [OFFBOARD_1, OFFBOARD_2][random.index(2)];
    let heights_m = [0.04, 0.12, 0.3, 0.7];
    scene.probes = heights_m
        .iter()
        .map(|z_m| Probe::at(Vector3::z() * *z_m))
        .collect();
    let mut route = Route::swaying(random);
    let lowest = size.of([9.0, 4.0, 3.2]);
    let highest = size.of([16.0, 12.8, 8.0]);
    for _ in 0..100 {
        let z_m = random.between(lowest, highest) * drone.motors_m;
        let place_m = around(
            random.between(0.0, TAU),
            (0.5 * random.normal().abs()).min(1.5),
        );
        route.go(place_m + Vector3::z() * z_m, 0.35);
        route.stay(random.between(5.0, 8.0));
    }
    scene.emitters.push(emitter(drone, route));
    scene
}

fn rare_rake(random: &mut Draws) -> Scene {
    let drone = OFFBOARD_1;
    let mut scene = grid(drone, 105, [4.0, 12.0], 1.0, random);
    // Probes from 1.6 m up, which the floor does not reach, and one at 0.08 m.
    scene.probes = [1.6, 2.0, 2.4, 2.8]
        .iter()
        .map(|z_m| Probe::at(Vector3::z() * *z_m))
        .collect();
    let end_s = scene.end_s();
    scene.probes.push(Probe {
        on_s: [0.84 * end_s, end_s],
        ..Probe::at(Vector3::z() * 0.08)
    });
    scene
}

fn row(random: &mut Draws) -> Scene {
    let drone = [OFFBOARD_1, OFFBOARD_2][random.index(2)];
    let mut scene = day(random);
    scene.probes = [-0.9, 0.0, 0.9]
        .iter()
        .map(|x_m| Probe::at(Vector3::new(*x_m, 0.0, PROBE_Z_M)))
        .collect();
    let mut route = Route::swaying(random);
    for _ in 0..115 {
        let over_m = Vector3::x() * [-0.9, 0.0, 0.9][random.index(3)];
        route.go(over_m + hover_point(&drone, [2.6, 13.0], 1.0, random), 0.4);
        route.stay(6.0);
    }
    scene.emitters.push(emitter(drone, route));
    scene
}

fn pair(random: &mut Draws) -> Scene {
    let mut scene = day(random);
    let drone = [OFFBOARD_1, OFFBOARD_2][random.index(2)];
    let mut routes = [Route::swaying(random), Route::swaying(random)];
    let mut places_m: [Vector3<f64>; 2] = [Vector3::zeros(); 2];
    for _ in 0..125 {
        let azimuth = random.between(0.0, TAU);
        let apart_m = random.between(1.3, 4.5) * drone.motors_m;
        let middle_m = around(random.between(0.0, TAU), 0.3 * random.normal().abs());
        let height_m = Vector3::z() * (PROBE_Z_M + random.between(3.0, 12.0) * drone.motors_m);
        let next_m = [-0.5, 0.5].map(|side| middle_m + around(azimuth, side * apart_m) + height_m);
        // Both take as long.
        let way_m = (0..2)
            .map(|i| (next_m[i] - places_m[i]).norm())
            .fold(0.1, f64::max);
        for (i, route) in routes.iter_mut().enumerate() {
            let own_m = (next_m[i] - places_m[i]).norm().max(1e-6);
            route.go(next_m[i], 0.6 * own_m / way_m);
            route.stay(7.0);
        }
        places_m = next_m;
    }
    scene.emitters = routes
        .into_iter()
        .map(|route| emitter(drone, route))
        .collect();
    scene
}

fn swap(random: &mut Draws) -> Scene {
    let mut scene = day(random);
    let away_m = Vector3::new(40.0, 40.0, 20.0);
    let drones = [KOLIBRI, [OFFBOARD_1, OFFBOARD_2][random.index(2)]];
    let mut routes = [Route::swaying(random), Route::swaying(random)];
    routes[1].go(away_m, 8.0);
    for _ in 0..65 {
        routes[0].go(hover_point(&drones[0], [2.6, 14.0], 1.0, random), 0.35);
        routes[0].stay(6.0);
    }
    routes[0].go(away_m, 8.0);
    let swapped_s = routes[0].end_s();
    routes[1].stay(swapped_s);
    for _ in 0..65 {
        routes[1].go(hover_point(&drones[1], [2.6, 14.0], 1.0, random), 0.35);
        routes[1].stay(6.0);
    }
    let [first, second] = routes;
    scene.emitters = vec![emitter(drones[0], first), emitter(drones[1], second)];
    scene
}
