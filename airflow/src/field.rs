//! Many drones at one instant: the air at a point, and its mean over a receiver's rotor discs.
//!
//! How mean jets add is not settled. The momentum sum is the default: for jets side by side
//! momentum adds, not speed (Reichardt's hypothesis, VDI-Forschungsheft 414, 1942), and in measured
//! pairs above a third drone it fits without a scale where the linear sum is a third too strong.
//! The linear sum bounds it from above, the strongest jet alone from below.

use std::fmt;
use std::str::FromStr;

use nalgebra::Point3;

use crate::discs::DiscPoints;
use crate::wake::Wake;

/// Heights that differ by less are the same height (m): a receiver at the end of a wake still feels
/// it, one in the rotor plane of another does not. Chosen here: far below any positioning error,
/// far above rounding.
pub const HEIGHT_TOLERANCE_M: f64 = 1e-6;

/// Points whose sums are held on the stack at a time; a quadrotor's 28 fit.
const CHUNK: usize = 32;

/// How the axial speeds `U_i` of several wakes add up at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Superposition {
    /// `√(Σ U_i²)`: momentum adds.
    #[default]
    Momentum,
    /// `Σ U_i`: speed adds; never less than the others.
    Linear,
    /// `max U_i`: never more than the others.
    Strongest,
}

/// A name that is no way to add wakes up.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("superposition \"{0}\" is not known; use \"momentum\", \"linear\" or \"strongest\"")]
pub struct UnknownSuperposition(String);

impl Superposition {
    /// All of them, the default first.
    pub const ALL: [Superposition; 3] = [
        Superposition::Momentum,
        Superposition::Linear,
        Superposition::Strongest,
    ];

    /// Its name in files: `momentum`, `linear`, `strongest`.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Superposition::Momentum => "momentum",
            Superposition::Linear => "linear",
            Superposition::Strongest => "strongest",
        }
    }

    /// One more wake on what has been gathered so far.
    #[inline]
    #[must_use]
    pub fn gather(self, so_far: f64, speed_mps: f64) -> f64 {
        match self {
            Superposition::Momentum => so_far + speed_mps * speed_mps,
            Superposition::Linear => so_far + speed_mps,
            Superposition::Strongest => {
                if speed_mps > so_far {
                    speed_mps
                } else {
                    so_far
                }
            }
        }
    }

    /// From what has been gathered to a speed (m/s).
    #[inline]
    #[must_use]
    pub fn finish(self, gathered: f64) -> f64 {
        match self {
            Superposition::Momentum => gathered.sqrt(),
            Superposition::Linear | Superposition::Strongest => gathered,
        }
    }
}

impl fmt::Display for Superposition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl FromStr for Superposition {
    type Err = UnknownSuperposition;

    fn from_str(name: &str) -> Result<Superposition, UnknownSuperposition> {
        let known = Superposition::ALL
            .into_iter()
            .find(|way| way.as_str() == name);
        known.ok_or_else(|| UnknownSuperposition(name.to_owned()))
    }
}

/// A wake in the world.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// The air it makes.
    pub wake: &'a Wake,
    /// Centre of its rotor plane (m).
    pub position_m: Point3<f64>,
    /// Height (m) of what stops it: no air below; a point exactly at it still feels the wake.
    pub ends_at_z_m: f64,
}

impl Source<'_> {
    /// Whether its air reaches a height.
    #[inline]
    fn reaches(&self, z_m: f64) -> bool {
        z_m < self.position_m.z - HEIGHT_TOLERANCE_M && z_m >= self.ends_at_z_m - HEIGHT_TOLERANCE_M
    }
}

/// Axial speed (m/s), downwards, of all sources together at a point of the world. Added in the
/// order of the slice.
#[must_use]
pub fn axial_speed_mps(
    sources: &[Source],
    point_m: Point3<f64>,
    superposition: Superposition,
) -> f64 {
    let mut gathered = 0.0;
    for source in sources.iter().filter(|source| source.reaches(point_m.z)) {
        gathered = superposition.gather(
            gathered,
            source.wake.axial_speed_mps(point_m - source.position_m),
        );
    }
    superposition.finish(gathered)
}

/// Axial speed (m/s) that a level receiver centred at `centre_m` is exposed to: all sources added
/// up at each point of its rotor discs, then the weighted mean. Divided by the receiver's own `U_H`
/// it is its `alpha`.
#[must_use]
pub fn mean_over_discs_mps(
    sources: &[Source],
    discs: &DiscPoints,
    centre_m: Point3<f64>,
    superposition: Superposition,
) -> f64 {
    let mut mean = 0.0;
    for (offsets_m, weights) in discs
        .offsets_m
        .chunks(CHUNK)
        .zip(discs.weights.chunks(CHUNK))
    {
        let mut gathered = [0.0; CHUNK];
        for source in sources.iter().filter(|source| source.reaches(centre_m.z)) {
            let offset_m = centre_m - source.position_m;
            let section = source.wake.cross_section(-offset_m.z);
            section.gather(offset_m.xy(), offsets_m, superposition, &mut gathered);
        }
        for (&gathered, weight) in gathered.iter().zip(weights) {
            mean += weight * superposition.finish(gathered);
        }
    }
    mean
}
