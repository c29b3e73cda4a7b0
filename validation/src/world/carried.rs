//! Wakes of drones that move: parcels let go at fixed times, each sinking as fast as the jet
//! carries it.

use nalgebra::Vector3;

use super::jet::Drone;
use super::route::Route;

/// Between one parcel and the next (s): a drone at 3 m/s moves 6 cm, a third of the smallest
/// half-width flown.
const BETWEEN_S: f64 = 0.02;
/// Oldest parcels kept (s).
const OLDEST_S: f64 = 12.0;

/// How far a parcel has sunk at multiples of [`BETWEEN_S`] (m).
#[derive(Clone, Debug)]
pub(crate) struct Carried {
    sunk_m: Vec<f64>,
}

impl Carried {
    /// `convection`: speed of a parcel over that on the axis.
    pub(crate) fn new(drone: &Drone, hover_mps: f64, convection: f64) -> Carried {
        let parts = 8;
        let dt = BETWEEN_S / f64::from(parts);
        let mut depth_m = 0.0;
        let mut sunk_m = vec![0.0];
        for _ in 0..(OLDEST_S / BETWEEN_S) as usize {
            for _ in 0..parts {
                let half_way_m =
                    depth_m + 0.5 * dt * convection * hover_mps * drone.centre(depth_m);
                depth_m += dt * convection * hover_mps * drone.centre(half_way_m);
            }
            sunk_m.push(depth_m);
        }
        Carried { sunk_m }
    }

    /// Where the axis crosses a height, and how far its air has come since it left the rotors.
    /// `None`: no air of this drone is there yet.
    pub(crate) fn crossing(
        &self,
        route: &Route,
        t_s: f64,
        z_m: f64,
    ) -> Option<(Vector3<f64>, f64, f64)> {
        let mut newer: Option<(Vector3<f64>, f64, f64)> = None;
        for (age, &sunk_m) in self.sunk_m.iter().enumerate() {
            let let_go_s = t_s - age as f64 * BETWEEN_S;
            let left_m = route.position_m(let_go_s);
            let height_m = left_m.z - sunk_m;
            if height_m <= z_m {
                let Some((newer_m, newer_sunk_m, newer_s)) = newer else {
                    return None; // the drone itself is below
                };
                let above_m = newer_m.z - newer_sunk_m - z_m;
                let share = above_m / (above_m + z_m - height_m).max(1e-12);
                let depth_m = newer_sunk_m + share * (sunk_m - newer_sunk_m);
                let at_s = newer_s + share * (let_go_s - newer_s);
                return Some((newer_m.lerp(&left_m, share), depth_m, at_s));
            }
            newer = Some((left_m, sunk_m, let_go_s));
        }
        None
    }

    /// Age (s) of air that has sunk so far.
    pub(crate) fn age_s(&self, depth_m: f64) -> f64 {
        self.sunk_m.partition_point(|&sunk_m| sunk_m < depth_m) as f64 * BETWEEN_S
    }
}
