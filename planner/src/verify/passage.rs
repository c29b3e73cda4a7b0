//! The highest speed of one wake over ranges of depths and distances: what a receiver passes through on a short way, made ready for many
//! points of it.
//!
//! Far field: the centreline falls and the half-width grows with depth, the profile falls outwards, so
//!
//! ```text
//! U <= U_C(s_lo) f(r_lo / r_half(s_hi))
//! ```
//!
//! and that is one value of the field times a ratio of centreline speeds. Near field (and the
//! join, which is smooth) and moved wakes: from tables, the highest speed and the steepest slope; the speed over a short way differs from
//! that at its middle by at most slope times half the way. All of it closes in on the field as the ranges shrink.

use std::ops::RangeInclusive;

use airflow::{CrossSection, Wake};
use nalgebra::{Vector2, Vector3};

use super::moved_wake::MovedTable;
use super::near_table::NearTable;
use super::wake_bound::{Bounds, JUST_BELOW};

/// One wake over a range of depths.
pub(crate) struct Passage<'a> {
    wake: &'a Wake,
    half_path_m: f64,
    /// Whether the whole range lies below the rotor plane, where air begins.
    below: bool,
    middle_depth_m: f64,
    /// Made when first asked for.
    middle: Option<CrossSection<'a>>,
    kind: Kind<'a>,
}

enum Kind<'a> {
    Calm,
    Round {
        far: Option<Far<'a>>,
        near: Option<(&'a NearTable, RangeInclusive<usize>)>,
    },
    Moved {
        table: &'a MovedTable,
        unit_mps: f64,
    },
}

/// The far field's part of the depths.
pub(super) struct Far<'a> {
    bottom: CrossSection<'a>,
    /// Centreline speed at the top over that at the bottom.
    ratio: f64,
}

impl<'a> Passage<'a> {
    pub(super) fn new(
        wake: &'a Wake,
        bounds: &'a Bounds,
        depth_m: (f64, f64),
        half_path_m: f64,
        middle_depth_m: f64,
    ) -> Passage<'a> {
        let kind = if depth_m.1 <= 0.0 {
            Kind::Calm
        } else {
            match bounds {
                Bounds::Moved { table, gain, .. } => Kind::Moved {
                    table,
                    unit_mps: gain * wake.induced_velocity_mps(),
                },
                Bounds::Round { near, .. } => {
                    let near_depth_m = wake.near_field_depth_m();
                    let layers = || near.layers(depth_m.0.max(0.0), depth_m.1.min(near_depth_m));
                    Kind::Round {
                        far: (depth_m.1 > near_depth_m).then(|| Far::new(wake, depth_m)),
                        near: (depth_m.0 < near_depth_m).then(|| (&**near, layers())),
                    }
                }
            }
        };
        Passage {
            wake,
            half_path_m,
            below: depth_m.0 > 0.0,
            middle_depth_m,
            middle: None,
            kind,
        }
    }

    /// The far field's part, where nothing else counts.
    pub(super) fn far_alone(&self) -> Option<&Far<'a>> {
        match &self.kind {
            Kind::Round { far, near: None } => far.as_ref(),
            _ => None,
        }
    }

    /// Highest axial speed (m/s) at and beyond a place, as seen from the drone from above (m), along a way with a known middle. A moved
    /// wake goes by the box of offsets instead.
    pub(super) fn highest_mps(
        &mut self,
        nearest_m: Vector2<f64>,
        places_m: &(Vector3<f64>, Vector3<f64>),
        middle_m: Vector2<f64>,
    ) -> f64 {
        let (speed_mps, slope_per_s) = match &self.kind {
            Kind::Calm => return 0.0,
            Kind::Round { far, near } => {
                let far_mps = far.as_ref().map_or(0.0, |far| far.highest_mps(nearest_m));
                let Some((near, layers)) = near else {
                    return far_mps;
                };
                let unit_mps = self.wake.induced_velocity_mps();
                let (speed, slope_per_m) = near.highest(layers.clone(), nearest_m.norm());
                (far_mps.max(speed * unit_mps), slope_per_m * unit_mps)
            }
            Kind::Moved { table, unit_mps } => {
                let (speed, slope_per_m) = table.highest(places_m);
                (speed * unit_mps, slope_per_m * unit_mps)
            }
        };
        let change_mps = slope_per_s * self.half_path_m;
        // A way so long that the slope tells no more than the table is not looked at; nor one through the rotor plane, where air begins.
        if !self.below || change_mps.is_nan() || change_mps >= speed_mps {
            return speed_mps;
        }
        let (wake, depth_m) = (self.wake, self.middle_depth_m);
        let middle = self
            .middle
            .get_or_insert_with(|| wake.cross_section(depth_m));
        speed_mps.min(middle.axial_speed_mps(middle_m.x, middle_m.y) + change_mps)
    }
}

impl<'a> Far<'a> {
    pub(super) fn new(wake: &'a Wake, depth_m: (f64, f64)) -> Far<'a> {
        let top_m = depth_m.0.max(wake.near_field_depth_m() * JUST_BELOW);
        let bottom_m = depth_m.1.max(top_m);
        let ratio = match (wake.centreline_mps(top_m), wake.centreline_mps(bottom_m)) {
            (Some(top), Some(bottom)) if bottom > 0.0 => top / bottom,
            _ => 1.0,
        };
        Far {
            bottom: wake.cross_section(bottom_m),
            ratio,
        }
    }

    /// Highest axial speed (m/s) at and beyond a place, as seen from the drone from above (m).
    #[inline]
    pub(super) fn highest_mps(&self, nearest_m: Vector2<f64>) -> f64 {
        self.bottom.axial_speed_mps(nearest_m.x, nearest_m.y) * self.ratio
    }
}
