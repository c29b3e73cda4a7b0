//! Distances to obstacles, against closed forms by hand and against dense sampling.

use crate::scenario::solid::Solids;
use crate::scenario::world::{Obstacle, Solid};
use nalgebra::Point3;
use proptest::prelude::*;

fn block(min: [f64; 3], max: [f64; 3]) -> Obstacle {
    Obstacle {
        name: "box".into(),
        shape: Solid::Box {
            min_m: min.into(),
            max_m: max.into(),
        },
    }
}

fn post(base_m: [f64; 3], radius_m: f64, height_m: f64) -> Obstacle {
    Obstacle {
        name: "post".into(),
        shape: Solid::Cylinder {
            base_m: base_m.into(),
            radius_m,
            height_m,
        },
    }
}

/// The box of `block` as twelve triangles; `inward` turns them all inside out.
fn mesh(min: [f64; 3], max: [f64; 3], inward: bool) -> Obstacle {
    let vertices_m: Vec<Point3<f64>> = (0..8)
        .map(|i| {
            Point3::from([0, 1, 2].map(|axis| {
                if i >> axis & 1 == 0 {
                    min[axis]
                } else {
                    max[axis]
                }
            }))
        })
        .collect();
    let quads: [[u32; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let mut triangles: Vec<[u32; 3]> = quads
        .iter()
        .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
        .collect();
    if inward {
        triangles
            .iter_mut()
            .for_each(|triangle| triangle.swap(0, 1));
    }
    Obstacle {
        name: "mesh".into(),
        shape: Solid::Mesh {
            mesh: "box.obj".into(),
            vertices_m,
            triangles,
        },
    }
}

fn at(x: f64, y: f64, z: f64) -> Point3<f64> {
    Point3::new(x, y, z)
}

#[test]
fn points_outside_touching_and_inside_know_their_distance_and_their_obstacle() {
    let solids = Solids::new(&[
        block([0.0; 3], [2.0, 4.0, 6.0]),
        post([10.0, 0.0, 0.0], 1.0, 3.0),
    ]);
    let cases = [
        (at(-3.0, 2.0, 3.0), 3.0, 0),
        (at(-3.0, -4.0, 3.0), 5.0, 0),
        (at(2.0, 2.0, 3.0), 0.0, 0),
        (at(0.5, 2.0, 3.0), -0.5, 0),
        (at(12.0, 0.0, 1.0), 1.0, 1),
        (at(10.0, 4.0, 7.0), 5.0, 1),
        (at(10.0, 0.0, 1.5), -1.0, 1),
        (at(10.2, 0.0, 2.9), -0.1, 1),
    ];
    for (point, distance_m, obstacle) in cases {
        let (found_m, whose) = solids.distance_to_point_m(point);
        // Sums of a few exact coordinates.
        assert!((found_m - distance_m).abs() < 1e-12, "{point}: {found_m}");
        assert_eq!(whose, Some(obstacle), "{point}");
    }
}

#[test]
fn a_leg_wholly_inside_a_solid_has_no_clearance() {
    for solid in [
        block([0.0; 3], [4.0; 3]),
        mesh([0.0; 3], [4.0; 3], false),
        mesh([0.0; 3], [4.0; 3], true),
    ] {
        let solids = Solids::new(&[solid]);
        assert!(
            (solids.segment_clearance_m(at(1.0, 2.0, 2.0), at(3.0, 2.0, 2.0), 10.0) + 1.0).abs()
                < 1.001
        );
        assert!(
            solids.segment_clearance_m(at(1.0, 2.0, 2.0), at(3.0, 2.0, 2.0), 10.0) <= -1.0 + 1e-9
        );
        assert!(solids.segment_clearance_m(at(-1.0, 2.0, 2.0), at(5.0, 2.0, 2.0), 10.0) <= 1e-9);
    }
}

#[test]
fn clearance_is_capped_and_the_nearest_obstacle_is_named() {
    let solids = Solids::new(&[
        block([0.0; 3], [1.0; 3]),
        block([9.0, 0.0, 0.0], [10.0, 1.0, 1.0]),
    ]);
    let (a, b) = (at(3.0, -1.0, 0.5), at(3.0, 2.0, 0.5));
    assert_eq!(solids.segment_clearance_m(a, b, 0.5), 0.5);
    assert!((solids.segment_clearance_m(a, b, 5.0) - 2.0).abs() < 1e-9);
    assert_eq!(solids.nearest(a, b).1, Some(0));
    assert_eq!(
        solids.nearest(at(7.0, 0.0, 0.0), at(6.0, 0.0, 0.0)).1,
        Some(1)
    );
}

#[test]
fn without_obstacles_everything_is_clear_and_the_floor_supports() {
    let solids = Solids::new(&[]);
    assert_eq!(
        solids.distance_to_point_m(at(1.0, 2.0, 3.0)),
        (f64::INFINITY, None)
    );
    assert_eq!(
        solids.segment_clearance_m(at(1.0, 2.0, 3.0), at(1.0, 2.0, 4.0), 0.7),
        0.7
    );
    assert_eq!(
        solids.nearest(at(1.0, 2.0, 3.0), at(1.0, 2.0, 4.0)),
        (f64::INFINITY, None)
    );
    assert_eq!(
        solids.support_below_z_m(at(1.0, 2.0, 3.0), -0.5),
        (-0.5, None)
    );
}

#[test]
fn the_highest_surface_straight_below_supports() {
    let solids = Solids::new(&[
        block([0.0; 3], [4.0, 4.0, 1.0]),
        post([2.0, 2.0, 0.0], 0.5, 2.0),
        mesh([0.0, 0.0, 5.0], [1.0, 1.0, 6.0], false),
    ]);
    assert_eq!(
        solids.support_below_z_m(at(3.0, 3.0, 9.0), 0.0),
        (1.0, Some(0))
    );
    assert_eq!(
        solids.support_below_z_m(at(2.2, 2.2, 9.0), 0.0),
        (2.0, Some(1))
    );
    assert_eq!(
        solids.support_below_z_m(at(2.2, 2.2, 1.5), 0.0),
        (1.0, Some(0))
    );
    assert_eq!(
        solids.support_below_z_m(at(6.0, 2.2, 1.5), 0.0),
        (0.0, None)
    );
    assert_eq!(
        solids.support_below_z_m(at(4.0, 4.0, 1.0), 0.0),
        (1.0, Some(0))
    );
    let (top_z_m, whose) = solids.support_below_z_m(at(0.3, 0.6, 9.0), 0.0);
    assert!((top_z_m - 6.0).abs() < 1e-9 && whose == Some(2));
}

#[test]
fn a_crate_has_an_inside_whatever_touches_it_at_a_corner() {
    let mut obstacle = mesh([0.0; 3], [2.0; 3], false);
    let Solid::Mesh {
        vertices_m,
        triangles,
        ..
    } = &mut obstacle.shape
    else {
        unreachable!("it is a mesh");
    };
    vertices_m.extend([at(3.0, 2.0, 2.0), at(3.0, 3.0, 2.0)]);
    triangles.push([7, 8, 9]);
    let solids = Solids::new(&[obstacle]);
    assert!((solids.distance_to_point_m(at(1.0, 1.0, 1.0)).0 + 1.0).abs() < 1e-9);
}

#[test]
fn an_open_sheet_has_no_inside() {
    let vertices_m = vec![at(0.0, 0.0, 1.0), at(4.0, 0.0, 1.0), at(0.0, 4.0, 1.0)];
    let shape = Solid::Mesh {
        mesh: "sheet.obj".into(),
        vertices_m,
        triangles: vec![[0, 1, 2]],
    };
    let solids = Solids::new(&[Obstacle {
        name: "sheet".into(),
        shape,
    }]);
    for z_m in [0.25, 1.75] {
        assert!((solids.distance_to_point_m(at(1.0, 1.0, z_m)).0 - 0.75).abs() < 1e-12);
    }
    assert!(
        solids
            .segment_clearance_m(at(1.0, 1.0, 0.0), at(1.0, 1.0, 2.0), 1.0)
            .abs()
            < 1e-9
    );
}

fn place() -> impl Strategy<Value = Point3<f64>> {
    (-2.0..8.0, -2.0..8.0, -2.0..8.0).prop_map(|(x, y, z)| at(x, y, z))
}

fn corners() -> impl Strategy<Value = ([f64; 3], [f64; 3])> {
    (
        [0.0..5.0, 0.0..5.0, 0.0..5.0f64],
        [0.2..3.0, 0.2..3.0, 0.2..3.0f64],
    )
        .prop_map(|(min, size)| (min, [min[0] + size[0], min[1] + size[1], min[2] + size[2]]))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// 1000 steps along a leg of at most 18 m: what lies between two samples differs by 9 mm at
    /// most.
    #[test]
    fn clearance_of_a_leg_is_the_least_distance_along_it(
        (min, max) in corners(), base in [0.0..5.0, 0.0..5.0, 0.0..5.0f64], a in place(), b in place(),
    ) {
        let solids = Solids::new(&[block(min, max), post(base, 0.7, 2.0), mesh([7.0, 0.0, 0.0], [7.5, 1.0, 1.0], false)]);
        let clearance_m = solids.segment_clearance_m(a, b, 100.0);
        let sampled_m = (0..=1000)
            .map(|i| solids.distance_to_point_m(a + (b - a) * (f64::from(i) / 1000.0)).0)
            .fold(f64::INFINITY, f64::min);
        // A leg that pierces a mesh has clearance 0, however deep it goes.
        let (least_m, known_m) = (sampled_m.max(0.0), clearance_m.max(0.0));
        prop_assert!(known_m <= least_m + 1e-9, "{clearance_m} {sampled_m}");
        prop_assert!(clearance_m >= sampled_m - 0.009, "{clearance_m} {sampled_m}");
        prop_assert_eq!(solids.nearest(a, b).0, clearance_m);
        let capped_m = solids.segment_clearance_m(a, b, 0.4);
        prop_assert!((capped_m - clearance_m.min(0.4)).abs() < 1e-12);
    }

    /// Rounding of parry's projection onto triangles leaves 1e-9 m at these sizes.
    #[test]
    fn a_box_and_its_mesh_are_the_same_solid((min, max) in corners(), a in place(), b in place(), inward: bool) {
        let (solid, hull) = (Solids::new(&[block(min, max)]), Solids::new(&[mesh(min, max, inward)]));
        let (solid_m, hull_m) = (solid.distance_to_point_m(a).0, hull.distance_to_point_m(a).0);
        prop_assert!((solid_m - hull_m).abs() < 1e-9, "{solid_m} {hull_m}");
        let (solid_m, hull_m) = (solid.segment_clearance_m(a, b, 99.0), hull.segment_clearance_m(a, b, 99.0));
        prop_assert!((solid_m.max(0.0) - hull_m.max(0.0)).abs() < 1e-7, "{solid_m} {hull_m}");
    }
}
