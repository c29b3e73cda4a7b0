//! Flights in which a drone is the instrument: its throttle is recorded.

use nalgebra::Vector3;

use super::{day, emitter};
use crate::scene::{Receiver, Scene};
use crate::truth::Size;
use crate::world::{Answer, Drone, KOLIBRI, MATRICE, OFFBOARD_1, OFFBOARD_2, Route};
use diagnosis::statistics::draws::Draws;

/// Noise and channel of a throttle.
fn throttle_day(random: &mut Draws) -> Scene {
    let mut scene = day(random);
    scene.probes.clear();
    scene.noise.white = random.between(0.009, 0.0125);
    scene
}

fn receiver(drone: Drone, route: Route, random: &mut Draws) -> Receiver {
    Receiver {
        drone,
        route,
        answer: Answer::default(),
        full_v: 16.6,
        sags_v: random.between(1.2, 2.0),
    }
}

pub(super) fn under(random: &mut Draws) -> Scene {
    let mut scene = throttle_day(random);
    let mut above = Route::swaying(random);
    above.go(Vector3::z() * 4.0, 1.0);
    let mut route = Route::swaying(random);
    for _ in 0..45 {
        let (y_m, z_m) = (0.35 * random.normal(), random.between(1.0, 3.2));
        let side = random.sign();
        route.go(Vector3::new(-1.6 * side, y_m, z_m), 3.0);
        route.go(
            Vector3::new(1.6 * side, y_m, z_m),
            random.between(0.25, 0.5),
        );
    }
    scene.emitters.push(emitter(OFFBOARD_2, above));
    scene.receiver = Some(receiver(KOLIBRI, route, random));
    scene
}

pub(super) fn to_surface(up: bool, size: Size, random: &mut Draws) -> Scene {
    let mut scene = throttle_day(random);
    let drone = [OFFBOARD_2, MATRICE][random.index(2)];
    let radius_m = 0.5 * drone.propeller_m;
    let nearest_m = size.of([3.0, 1.8, 1.0]) * radius_m;
    scene.ceiling_z_m = up.then_some(5.0);
    // Another drone hovers far away: a recording without any wake would be another kind.
    let mut above = Route::swaying(random);
    above.go(Vector3::new(0.0, 0.0, 4.5), 1.0);
    let mut route = Route::swaying(random);
    for step in 0..70 {
        let gap_m = nearest_m * random.between(0.0, 3.0).exp();
        let z_m = if up {
            5.0 - gap_m.min(4.0)
        } else {
            gap_m.min(3.0)
        };
        // Every third point lies below the other drone's wake.
        let aside_m = if step % 3 == 0 {
            random.between(0.0, 0.6)
        } else {
            random.between(2.5, 4.0)
        };
        let x_m = if up { aside_m + 3.0 } else { aside_m };
        route.go(Vector3::new(x_m, 0.2 * random.normal(), z_m), 0.8);
        route.stay(5.0);
    }
    scene.emitters.push(emitter(OFFBOARD_1, above));
    scene.receiver = Some(receiver(drone, route, random));
    scene
}

pub(super) fn rare_to_ceiling(random: &mut Draws) -> Scene {
    let mut scene = under(random);
    scene.ceiling_z_m = Some(6.0);
    if let Some(receiver) = &mut scene.receiver {
        receiver.drone = MATRICE;
        receiver.route.go(Vector3::new(4.0, 0.0, 5.6), 1.5);
        receiver.route.stay(16.0);
    }
    scene
}
