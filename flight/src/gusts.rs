//! The jet's own turbulence: speed that comes on top of the mean, with memory, by seed.
//!
//! ```text
//! U'(t) = I √(U_C U) g(t),   dg = -g dt/T + √(2/T) dW,   T = r_half/(2 U_C)
//! ```
//!
//! `I` is a quarter: the intensity of round jets on their axis (Pope, Turbulent Flows, 2000, fig.
//! 5.7). Off the axis the root of the mean profile follows the measured intensity within 0.03 U_C
//! up to two half-widths, beyond which the air is mostly not turbulent; there is none from there
//! on. `T` is the integral time of the jet seen from a place at rest. One value for all discs of a
//! drone: eddies are as large as the jet is wide.

use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Intensity on the axis, over the centreline speed.
pub const INTENSITY: f64 = 0.25;

/// Radius over the half-width from which on there is none.
pub(crate) const EDGE: f64 = 2.0;

/// Integral time over `r_half/U_C`: the middle of the 0.4 to 0.6 of measurements.
const MEMORY: f64 = 0.5;

/// The jet that a drone is in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct JetAt {
    /// Mean speed at the drone's centre (m/s).
    pub(crate) mean_mps: f64,
    /// On the axis at that depth (m/s).
    pub(crate) centreline_mps: f64,
    pub(crate) half_width_m: f64,
    /// Distance to the axis (m).
    pub(crate) radius_m: f64,
}

/// Gusts of one drone.
#[derive(Clone, Debug)]
pub(crate) struct Gusts {
    draws: SplitMix64,
    /// In units of its own deviation.
    now: f64,
}

impl Gusts {
    /// Of a drone by its index: streams of different drones share nothing, and none depends on
    /// threads.
    pub(crate) fn new(seed: u64, drone: usize) -> Gusts {
        let mut gusts = Gusts {
            draws: SplitMix64::seed_from_u64(
                seed ^ (drone as u64).wrapping_mul(0xd134_2543_de82_ef95),
            ),
            now: 0.0,
        };
        gusts.now = gusts.normal();
        gusts
    }

    /// The gust (m/s, down positive) after a step in the strongest jet there; `None`: in no jet.
    /// One number is drawn at every step, so that flights of one seed have the same gusts.
    pub(crate) fn step(&mut self, jet: Option<&JetAt>, intensity: f64, step_s: f64) -> f64 {
        let drawn = self.normal();
        let within = |it: &&JetAt| it.radius_m < EDGE * it.half_width_m && it.centreline_mps > 0.0;
        let Some(jet) = jet.filter(within) else {
            return 0.0;
        };
        let memory_s = MEMORY * jet.half_width_m / jet.centreline_mps;
        let kept = (-step_s / memory_s).exp();
        self.now = kept * self.now + (1.0 - kept * kept).sqrt() * drawn;
        intensity * (jet.centreline_mps * jet.mean_mps).max(0.0).sqrt() * self.now
    }

    /// Even on [0, 1).
    fn even(&mut self) -> f64 {
        (self.draws.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Mean 0, variance 1 (Box & Muller 1958).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.even()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.even()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const JET: JetAt = JetAt {
        mean_mps: 8.0,
        centreline_mps: 8.0,
        half_width_m: 0.4,
        radius_m: 0.0,
    };

    #[test]
    fn gusts_have_a_quarter_of_the_centreline_and_a_memory() {
        let mut gusts = Gusts::new(3, 7);
        let step_s = 0.0125; // half of the memory of 0.025 s
        let n = 100_000;
        let drawn: Vec<f64> = (0..n)
            .map(|_| gusts.step(Some(&JET), INTENSITY, step_s))
            .collect();
        let mean = drawn.iter().sum::<f64>() / f64::from(n);
        let square = drawn.iter().map(|it| it * it).sum::<f64>() / f64::from(n);
        let lagged = drawn.windows(2).map(|two| two[0] * two[1]).sum::<f64>() / f64::from(n);
        // Deviation 2 m/s; some 40 000 draws without memory: half a per cent is one deviation.
        assert!(mean.abs() < 0.04 && (square.sqrt() - 2.0).abs() < 0.04);
        assert!((lagged / square - (-0.5_f64).exp()).abs() < 0.015);
    }

    #[test]
    fn outside_a_jet_there_are_none_and_the_stream_goes_on() {
        let (mut one, mut other) = (Gusts::new(1, 0), Gusts::new(1, 0));
        let beside = JetAt {
            radius_m: 0.9,
            ..JET
        };
        assert_eq!(one.step(None, INTENSITY, 0.02), 0.0);
        assert_eq!(other.step(Some(&beside), INTENSITY, 0.02), 0.0);
        let next = one.step(Some(&JET), INTENSITY, 0.02);
        assert_eq!(next, other.step(Some(&JET), INTENSITY, 0.02));
        assert_ne!(next, Gusts::new(2, 0).step(Some(&JET), INTENSITY, 0.02));
    }
}
