//! Close below the rotors: four flat-topped jets whose momenta add (Reichardt), a slow core behind
//! the body, and as much momentum through every cut as further down.

use std::f64::consts::{FRAC_PI_4, TAU};

use super::jet::{Drone, MOMENTUM_OF_PROFILE};

/// Depths of the table (in motor distances) and where the four have become one.
const STEP: f64 = 0.1;
const MERGED: f64 = 2.5;
/// Where the merging begins. The paper sees it between 1.5 and 2.5.
const MERGING: f64 = 1.6;

/// The air above 2.5 motor distances.
#[derive(Clone, Debug)]
pub(crate) struct Lobes {
    propeller: f64,
    /// Part of the speed that the body takes away on the axis.
    core: f64,
    /// Speed of a lobe over the induced speed, at multiples of the step.
    strength: Vec<f64>,
}

impl Lobes {
    pub(crate) fn new(drone: &Drone, core: f64) -> Lobes {
        let mut lobes = Lobes {
            propeller: drone.propeller_m / drone.motors_m,
            core,
            strength: Vec::new(),
        };
        let half = drone.half_m(0.0) / drone.motors_m;
        let momentum = *MOMENTUM_OF_PROFILE * (drone.centre(0.0) * half).powi(2);
        for i in 0..=(MERGED / STEP) as usize {
            let s = i as f64 * STEP;
            let (rings, spokes, width) = (80, 24, 0.025);
            let mut sum = 0.0;
            for ring in 0..rings {
                let r = (f64::from(ring) + 0.5) * width;
                for spoke in 0..spokes {
                    let azimuth = TAU * (f64::from(spoke) + 0.5) / f64::from(spokes);
                    let shape = lobes.shape(s, r * azimuth.cos(), r * azimuth.sin());
                    sum += shape * shape * r * width * TAU / f64::from(spokes);
                }
            }
            lobes.strength.push((momentum / sum).sqrt());
        }
        lobes
    }

    fn shape(&self, s: f64, x: f64, y: f64) -> f64 {
        let radius = 0.45 * self.propeller + 0.12 * s;
        let squares: f64 = (0..4)
            .map(|k| FRAC_PI_4 * f64::from(2 * k + 1))
            .map(|at| (x - 0.5 * at.cos()).hypot(y - 0.5 * at.sin()) / radius)
            .map(|rho| (1.0 + rho.powi(4)).powi(-2))
            .sum();
        let shadow =
            self.core * (-(x * x + y * y) / 0.18f64.powi(2)).exp() * (1.0 - s / MERGED).max(0.0);
        squares.sqrt() * (1.0 - shadow)
    }

    /// Speed (m/s) at a place in the body's frame (m), given that of the merged jet there.
    pub(crate) fn speed_mps(
        &self,
        drone: &Drone,
        hover_mps: f64,
        place_m: [f64; 3],
        merged_mps: f64,
    ) -> f64 {
        let [x, y, s] = place_m.map(|length_m| length_m / drone.motors_m);
        if s >= MERGED {
            return merged_mps;
        }
        let at = s / STEP;
        let i = (at as usize).min(self.strength.len() - 2);
        let strength =
            self.strength[i] + (at - i as f64) * (self.strength[i + 1] - self.strength[i]);
        let share = ((s - MERGING) / (MERGED - MERGING)).clamp(0.0, 1.0);
        let share = share * share * (3.0 - 2.0 * share);
        let lobes_mps = hover_mps * strength * self.shape(s, x, y);
        lobes_mps + share * (merged_mps - lobes_mps)
    }
}
