//! Many drones at one instant: the air at a point, and its mean over a receiver's rotor discs.

use nalgebra::Point3;

use crate::discs::DiscPoints;
use crate::superposition::Superposition;
use crate::wake::Wake;

/// Heights that differ by less are the same height (m): a receiver at the end of a wake still feels
/// it, one in the rotor plane of another does not. Chosen here: far below any positioning error,
/// far above rounding.
pub const HEIGHT_TOLERANCE_M: f64 = 1e-6;

/// Points whose sums are held on the stack at a time, chosen here: a quadrotor's 28 fit.
const CHUNK: usize = 32;

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
