//! How much room there is along straight edges, and where drones stop beyond the lattice.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::graph::lattice::{Lattice, NEIGHBOURS};
use crate::scenario::solid::Solids;

/// A place in a roadmap: lattice places first, then stops.
pub(crate) type Vertex = u32;

/// Clearances are kept to a tenth of a millimetre, below what the verifier forgives (m).
pub(super) const CLEARANCE_TOLERANCE_M: f64 = 1e-4;

/// A straight edge between two places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    pub(crate) length_m: f32,
    /// Upwards (m).
    pub(crate) rise_m: f32,
    /// Straight up from, or down to, where a drone stands.
    pub(crate) is_lift: bool,
    /// Distance to the nearest obstacle, and of its ends to the floor (m); capped at what the
    /// largest drone needs.
    pub(crate) clearance_m: f32,
}

impl Edge {
    /// Whether a ball of this radius fits all along.
    pub(crate) fn fits(&self, radius_m: f64) -> bool {
        is_wide(self.clearance_m, radius_m)
    }

    /// The same the other way round.
    pub(crate) fn reversed(self) -> Edge {
        Edge {
            rise_m: -self.rise_m,
            ..self
        }
    }
}

/// Whether an edge of this clearance (m) holds a ball of this radius (m).
pub(super) fn is_wide(clearance_m: f32, radius_m: f64) -> bool {
    f64::from(clearance_m) + CLEARANCE_TOLERANCE_M >= radius_m
}

/// A place beyond the lattice that a drone must be able to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stop {
    pub(crate) point_m: Point3<f64>,
    /// Radius of the ball that must stay clear on the edges from and to here (m).
    pub(crate) radius_m: f64,
    /// How far from a corner of its path the drone may pass (m).
    pub(crate) corner_deviation_m: f64,
    /// A drone that stands on something leaves straight up, at least so far (m); smaller clearance
    /// is forgiven on that path. `None`: it hovers.
    pub(crate) lift_m: Option<f64>,
}

/// Clearance of the 13 edges from a lattice place to neighbours of higher number; the others are
/// theirs.
pub(super) type Forward = Vec<[f32; 13]>;

/// What is needed to measure clearances.
pub(super) struct Survey<'a> {
    /// Where places are.
    pub(super) lattice: &'a Lattice,
    /// `None`: no obstacle anywhere.
    pub(super) solids: Option<&'a Solids>,
    /// Height of the floor, which bodies keep off too (m).
    pub(super) floor_z_m: f64,
    /// More clearance than this is not told apart (m).
    pub(super) widest_m: f64,
}

impl Survey<'_> {
    /// Clearance of every edge to a neighbour of higher number, in parallel; negative infinity
    /// where there is no neighbour.
    pub(super) fn forward_clearances(&self) -> Forward {
        let step_m = self.lattice.cell_m() * 3.0_f64.sqrt();
        let places = 0..self.lattice.place_count() as u32;
        let far_m = self.widest_m + step_m;
        let at_place_m = |place: u32| {
            let here_m = self.lattice.position_m(place);
            self.solids.map_or(far_m, |solids| {
                solids.segment_clearance_m(here_m, here_m, far_m)
            })
        };
        let at_places_m: Vec<f64> = places.clone().into_par_iter().map(at_place_m).collect();
        places
            .into_par_iter()
            .map(|place| {
                let from_m = self.lattice.position_m(place);
                let [i, j, k] = self.lattice.steps(place);
                std::array::from_fn(|ahead| {
                    let d = NEIGHBOURS[13 + ahead];
                    let Some(to) = self.lattice.at([i + d[0], j + d[1], k + d[2]]) else {
                        return f32::NEG_INFINITY;
                    };
                    let to_m = self.lattice.position_m(to);
                    // Bodies keep off the floor too, though bounds limit only their centres.
                    let floor_m = from_m.z.min(to_m.z) - self.floor_z_m;
                    let [a_m, b_m] = [place, to].map(|end| at_places_m[end as usize]);
                    let ends_m = a_m.min(b_m);
                    let between_m = 0.5 * (a_m + b_m - (to_m - from_m).norm());
                    let free_m = if ends_m <= 0.0 {
                        // No drone fits, wherever the edge is narrowest.
                        ends_m
                    } else if between_m >= self.widest_m {
                        // Distances change by no more than one moves.
                        self.widest_m
                    } else {
                        self.clearance_m(from_m, to_m)
                    };
                    free_m.min(floor_m) as f32
                })
            })
            .collect()
    }

    /// Distance of a straight edge from all obstacles, at most `widest_m` (m).
    pub(super) fn clearance_m(&self, a_m: Point3<f64>, b_m: Point3<f64>) -> f64 {
        self.solids.map_or(self.widest_m, |solids| {
            solids.segment_clearance_m(a_m, b_m, self.widest_m)
        })
    }
}
