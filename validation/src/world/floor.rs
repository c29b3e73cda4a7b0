//! A jet that meets the floor: it stops, turns, and runs outwards along it.

use std::f64::consts::TAU;

use super::jet::{Drone, MOMENTUM_OF_PROFILE};

/// Height over which the jet stops, in half-widths at the floor. Chosen here within the
/// literature's 0.8 to 1.
const STOPS: f64 = 0.95;
/// Radius at which it has turned, in half-widths at the floor.
const TURNED: f64 = 1.3;
/// Part of its momentum that is left after the turn, and the power by which friction takes of it on
/// the route out. Chosen here: a jet of unit momentum from unit height then runs at 1.2 at unit
/// radius (assumed here, because Poreh et al. 1967 report 1.3).
const LEFT: f64 = 0.85;
const FRICTION: f64 = 0.1;
/// Growth of the layer's half-height with radius (assumed here, because Glauert 1956 and later
/// measurements lie at 0.08 to 0.1).
const GROWTH: f64 = 0.087;
/// Height of the fastest air over the half-height.
const FASTEST: f64 = 0.15;

/// Downward share and outward speed (m/s) at a height above the floor and a distance from where the
/// axis meets it, for a jet from `drop_m` above the floor.
pub(crate) fn turned(
    drone: &Drone,
    hover_mps: f64,
    drop_m: f64,
    height_m: f64,
    radius_m: f64,
) -> (f64, f64) {
    let half_m = drone.half_m(drop_m);
    let stops = (height_m.max(0.0) / (STOPS * half_m)).powi(3);
    let share = (stops / (1.0 + stops)).cbrt();
    let turned_m = TURNED * half_m;
    let out_m = radius_m.max(turned_m);
    let layer_m = GROWTH * out_m + 0.01 * drop_m;
    let momentum =
        *MOMENTUM_OF_PROFILE * (hover_mps * drone.centre(0.0) * drone.half_m(0.0)).powi(2);
    let left = LEFT * momentum * (turned_m / out_m).powf(2.0 * FRICTION);
    let fastest_mps = (left / (TAU * out_m * layer_m * LAYER_MOMENTUM)).sqrt();
    // From nothing on the axis, straight, to what it is where it has turned.
    let inner = radius_m / turned_m;
    let ramp = inner / (1.0 + inner.powi(6)).powf(1.0 / 6.0);
    (share, fastest_mps * ramp * layer(height_m / layer_m))
}

/// `∫ layer² dη`, by its sum.
const LAYER_MOMENTUM: f64 = 0.7596;

/// Speed over the fastest, at a height over that of half the speed: a seventh power from the floor,
/// then as a free shear layer.
fn layer(eta: f64) -> f64 {
    if eta <= 0.0 {
        return 0.0;
    }
    if eta < FASTEST {
        return (eta / FASTEST).powf(1.0 / 7.0);
    }
    // sech² is one half at 0.8814.
    (0.8814 * (eta - FASTEST) / (1.0 - FASTEST)).cosh().powi(-2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::jet::OFFBOARD_2;

    #[test]
    fn the_layer_s_momentum_is_its_sum() {
        let step = 1e-4;
        let sum: f64 = (0..80_000)
            .map(|i| layer((f64::from(i) + 0.5) * step).powi(2) * step)
            .sum();
        assert!((sum - LAYER_MOMENTUM).abs() < 2e-3, "{sum}");
    }

    #[test]
    fn the_wall_jet_is_of_the_measured_size() {
        // After Poreh et al. 1967: 1.32 √J/H at r = H; 3.17 m²/s is √J of this drone.
        let fastest_mps = (1..400)
            .map(|i| turned(&OFFBOARD_2, 9.66, 3.0, 0.002 * f64::from(i), 3.0).1)
            .fold(0.0, f64::max);
        let over = fastest_mps * 3.0 / 3.17;
        assert!((1.1..1.5).contains(&over), "{over}");
    }
}
