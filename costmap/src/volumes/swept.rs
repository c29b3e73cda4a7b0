//! A convex body on the move, and whether two of them meet.
//!
//! A body translated along a straight line covers body + segment (Minkowski sum), which is convex
//! again:
//!
//! ```text
//! support(d) = body.support(d) + (d·Δ > 0 ? Δ : 0)
//! ```
//!
//! Two bodies moving at constant velocities over the same interval meet if and only if one at rest
//! meets the other swept by the relative displacement. That is one GJK query, and it also sees what
//! `cast_shapes` misses: bodies that overlap all along without moving relative to each other.
//!
//! Every doubt counts as a meeting. "They do not meet" is only ever said with a proof in hand: a
//! direction along which the two bodies do not overlap, checked here and not taken from GJK's word.

use crate::volumes::frame;
use nalgebra::Vector3;
use parry3d::bounding_volume::Aabb;
use parry3d::math::{Pose, Vector};
use parry3d::query::details::{
    closest_points_support_map_support_map_with_params,
    intersection_test_support_map_support_map_with_params,
};
use parry3d::query::gjk::{GJKResult, VoronoiSimplex};
use parry3d::shape::SupportMap;

/// How much apart two bodies must be to be called apart (m). Chosen here: a micrometre is a
/// thousandth of the smallest length of a plan, and ten thousand times the rounding of a coordinate
/// of 10⁵ m.
pub const SEPARATION_M: f64 = 1e-6;

/// All places of a convex body that moves by `displacement`, grown by `growth_m` all around.
///
/// Everything is in the body's own frame; a support map itself, so that it can be swept or queried
/// again.
pub struct Swept<'a> {
    body: &'a dyn SupportMap,
    displacement: Vector,
    growth_m: f64,
}

impl SupportMap for Swept<'_> {
    fn local_support_point(&self, dir: Vector) -> Vector {
        let mut point = self.body.local_support_point(dir);
        if dir.dot(self.displacement) > 0.0 {
            point += self.displacement;
        }
        point + dir.normalize_or_zero() * self.growth_m
    }
}

/// A convex body with its place at the start of an interval and its straight path during it.
#[derive(Clone, Copy)]
pub struct Mover<'a> {
    body: &'a dyn SupportMap,
    start: Pose,
    displacement: Vector,
}

impl<'a> Mover<'a> {
    /// A body that starts at `start` and ends `displacement_m` from there (world frame), at
    /// constant velocity and without turning.
    pub fn new(body: &'a dyn SupportMap, start: Pose, displacement_m: Vector3<f64>) -> Self {
        Self {
            body,
            start,
            displacement: frame::vector(displacement_m),
        }
    }

    /// A box in the world that holds the body during the whole interval.
    pub fn aabb(&self) -> Aabb {
        let extent = |dir: Vector| {
            let reach = self.body.support_point(&self.start, dir).dot(dir)
                + self.displacement.dot(dir).max(0.0);
            reach + SEPARATION_M
        };
        let maxs = Vector::new(extent(Vector::X), extent(Vector::Y), extent(Vector::Z));
        let mins = -Vector::new(extent(-Vector::X), extent(-Vector::Y), extent(-Vector::Z));
        Aabb::new(mins, maxs)
    }
}

/// Whether two bodies may come within [`SEPARATION_M`] of each other while both move; `false` is
/// proven.
///
/// Both are taken to move during the same interval. Cut legs to their common time first.
pub fn may_meet(first: &Mover, second: &Mover) -> bool {
    let in_second = second.start.rotation.inverse();
    let relative = Swept {
        body: second.body,
        displacement: in_second * (second.displacement - first.displacement),
        growth_m: SEPARATION_M,
    };
    !are_apart(first.body, &relative, &first.start.inv_mul(&second.start))
}

/// Whether a separating plane could be found; `second_in_first` is the pose of the second in the
/// frame of the first.
fn are_apart(first: &dyn SupportMap, second: &Swept, second_in_first: &Pose) -> bool {
    let simplex = &mut VoronoiSimplex::new();
    let (touching, direction) = intersection_test_support_map_support_map_with_params(
        second_in_first,
        first,
        second,
        simplex,
        None,
    );
    if touching {
        return false;
    }
    // Almost always proven at once; GJK may also give up, or name the direction of the step before.
    if separates(direction, first, second, second_in_first) {
        return true;
    }
    match closest_points_support_map_support_map_with_params(
        second_in_first,
        first,
        second,
        f64::MAX,
        &mut VoronoiSimplex::new(),
        Some(direction),
    ) {
        GJKResult::ClosestPoints(on_first, on_second, _) => {
            let gap = (on_second - on_first).normalize_or_zero();
            separates(gap, first, second, second_in_first)
        }
        _ => false,
    }
}

/// Whether the second lies wholly beyond the first along `direction` (frame of the first).
fn separates(
    direction: Vector,
    first: &dyn SupportMap,
    second: &Swept,
    second_in_first: &Pose,
) -> bool {
    let end_of_first = first.local_support_point(direction).dot(direction);
    let start_of_second = second
        .support_point(second_in_first, -direction)
        .dot(direction);
    start_of_second > end_of_first
}
