//! The frustum against its closed form, and bodies on the move.

use super::{random_point, signed_distance_m};
use costmap::volumes::frame::{centred, upright};
use costmap::volumes::frustum::Frustum;
use costmap::volumes::swept::{Mover, SEPARATION_M, may_meet};
use diagnosis::statistics::draws::Draws;
use nalgebra::{Point3, Vector3};
use parry3d::math::{Pose, Rotation, Vector};
use parry3d::query::details::intersection_test_support_map_support_map as support_maps_meet;
use parry3d::query::{self, ShapeCastOptions};
use parry3d::shape::{Ball, Capsule, Cylinder, SupportMap};
use std::f64::consts::PI;

/// What GJK resolves at lengths of a few metres: its own tolerance is 1e-7 of the distance.
/// Measured with margin.
const GJK_M: f64 = 1e-6;

fn random_frustum(random: &mut Draws) -> Frustum {
    let (top, bottom) = (random.between(0.0, 1.5), random.between(0.0, 1.5));
    Frustum::new(random.between(0.01, 3.0), top, bottom).expect("positive lengths")
}

fn random_pose(random: &mut Draws, reach: f64) -> Pose {
    let axis = random_point(random, 1.0);
    let turn = Vector::new(axis.x, axis.y, axis.z) * PI;
    let at = random_point(random, reach);
    Pose::from_parts(
        Vector::new(at.x, at.y, at.z),
        Rotation::from_scaled_axis(turn),
    )
}

/// A point of a frustum, in its own frame.
fn random_inside(random: &mut Draws, frustum: &Frustum) -> Vector {
    loop {
        let at = random_point(random, 1.5);
        let at = Vector::new(at.x, at.y * frustum.height_m() / 3.0, at.z);
        if signed_distance_m(frustum, at) <= 0.0 {
            return at;
        }
        // As thin as a needle: its axis will do.
        if random.uniform() < 0.02 {
            return Vector::new(0.0, at.y, 0.0);
        }
    }
}

/// Smallest value of a convex function on [0, 1].
fn least(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let (left, right) = (low + 0.382 * (high - low), low + 0.618 * (high - low));
        if f(left) < f(right) {
            high = right;
        } else {
            low = left;
        }
    }
    f((low + high) / 2.0).min(f(0.0)).min(f(1.0))
}

#[test]
fn the_support_map_and_the_closed_form_agree_on_balls() {
    let mut random = Draws::new(10);
    let mut met = 0;
    for _ in 0..100_000 {
        let frustum = random_frustum(&mut random);
        let ball = Ball::new(random.between(0.01, 1.0));
        let at = random_point(&mut random, 1.5);
        let centre = Vector::new(at.x, at.y, at.z);
        let gap_m = signed_distance_m(&frustum, centre) - ball.radius;
        let pose = Pose::from_translation(centre);
        let meets = support_maps_meet(&pose, &frustum, &ball);
        met += usize::from(meets);
        if gap_m.abs() > GJK_M {
            assert_eq!(
                meets,
                gap_m < 0.0,
                "{frustum:?}, ball {} at {at}",
                ball.radius
            );
        }
    }
    assert!(
        (20_000..80_000).contains(&met),
        "{met} of 100000 met: one-sided draws"
    );
}

#[test]
fn the_support_point_is_on_the_frustum_and_nothing_lies_beyond_it() {
    let mut random = Draws::new(11);
    for _ in 0..20_000 {
        let frustum = random_frustum(&mut random);
        let direction = random_pose(&mut random, 1.0).translation.normalize();
        let support = frustum.local_support_point(direction);
        assert!(
            signed_distance_m(&frustum, support).abs() < 1e-12,
            "rounding only"
        );
        let inside = random_inside(&mut random, &frustum);
        assert!(inside.dot(direction) <= support.dot(direction) + 1e-12);
    }
}

#[test]
fn lengths_no_frustum_has_are_refused() {
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(Frustum::new(bad, 1.0, 1.0).is_none());
        assert!(Frustum::new(1.0, bad, 1.0).is_none());
        assert!(Frustum::new(1.0, 1.0, bad).is_none());
    }
}

#[test]
fn two_moving_bodies_are_said_to_meet_exactly_when_they_do() {
    let mut random = Draws::new(15);
    let mut met = 0;
    for round in 0..4_000 {
        let frustum = random_frustum(&mut random);
        let (half_m, radius_m) = (random.between(0.05, 1.0), random.between(0.05, 0.5));
        let capsule = Capsule::new_y(half_m, radius_m);
        let (at_a, at_b) = (random_pose(&mut random, 1.5), random_pose(&mut random, 1.5));
        let (by_a, mut by_b) = (
            random_point(&mut random, 1.5).coords,
            random_point(&mut random, 1.5).coords,
        );
        if round % 10 == 0 {
            by_b = by_a; // at rest relative to each other
        }
        let meet = may_meet(
            &Mover::new(&frustum, at_a, by_a),
            &Mover::new(&capsule, at_b, by_b),
        );
        met += usize::from(meet);
        // The distance from the frustum is convex along the capsule's axis and in time: the least
        // of it is found exactly.
        let by = Vector::new(by_b.x - by_a.x, by_b.y - by_a.y, by_b.z - by_a.z);
        let axis = |t: f64, part: f64| {
            let on_axis = at_b * Vector::new(0.0, (2.0 * part - 1.0) * half_m, 0.0) + by * t;
            at_a.inverse_transform_point(on_axis)
        };
        let gap_m = |t: f64| least(|part| signed_distance_m(&frustum, axis(t, part)));
        let least_m = least(gap_m) - radius_m;
        if meet {
            assert!(
                least_m <= SEPARATION_M + GJK_M,
                "said to meet, {least_m} m apart"
            );
        } else {
            assert!(least_m > 0.0, "said to be apart: {frustum:?} {capsule:?}");
        }
    }
    assert!((800..3_200).contains(&met), "{met}");
}

#[test]
fn a_sweep_holds_every_place_on_the_way() {
    let mut random = Draws::new(16);
    for _ in 0..20_000 {
        let frustum = random_frustum(&mut random);
        let start = random_pose(&mut random, 3.0);
        let way = random_point(&mut random, 5.0).coords;
        let mover = Mover::new(&frustum, start, way);
        let inside = random_inside(&mut random, &frustum);
        let t = random.uniform();
        let there = start * inside + Vector::new(way.x, way.y, way.z) * t;
        let speck = Ball::new(1e-9);
        let at = centred(Point3::new(there.x, there.y, there.z));
        assert!(may_meet(&mover, &Mover::new(&speck, at, Vector3::zeros())));
        assert!(mover.aabb().contains_local_point(there));
    }
}

/// Two hovering drones, one in the other's wake: the case that parry's cast misses and safety
/// depends on.
#[test]
fn overlap_without_relative_motion_is_caught_although_parrys_cast_misses_it() {
    let mut random = Draws::new(18);
    let (mut overlaps, mut missed) = (0, 0);
    for _ in 0..2_000 {
        let cylinder = Cylinder::new(random.between(0.01, 1.5), random.between(0.0, 1.5));
        let ball = Ball::new(0.3);
        let at_cylinder = upright(Point3::origin());
        let at_ball = centred(random_point(&mut random, 1.0));
        if !support_maps_meet(&at_cylinder.inv_mul(&at_ball), &cylinder, &ball) {
            continue;
        }
        overlaps += 1;
        let options = ShapeCastOptions::with_max_time_of_impact(10.0);
        let cast = query::cast_shapes(
            &at_cylinder,
            Vector::ZERO,
            &cylinder,
            &at_ball,
            Vector::ZERO,
            &ball,
            options,
        );
        missed += usize::from(cast.expect("supported").is_none());
        // Both drift together: at rest relative to each other.
        let drift = Vector3::new(1.0, 2.0, 0.5);
        let first = Mover::new(&cylinder, at_cylinder, drift);
        let second = Mover::new(&ball, at_ball, drift);
        assert!(may_meet(&first, &second), "{cylinder:?}");
    }
    assert!(overlaps > 500, "{overlaps}");
    // The day this fails parry has changed: read its release notes, then delete this line.
    assert_eq!(
        missed, overlaps,
        "cast_shapes reports overlaps at rest after all"
    );
}
