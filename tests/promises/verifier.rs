//! The verifier refuses what is wrong, accepts what is right, and misses nothing between samples.

mod advected;
mod air;
mod foreign;
mod margins;
mod mutations;
pub(crate) mod plans;
mod smooth;
mod zones;

use airflow::effects::{Effects, JetMerging};
use nalgebra::Point3;
use planner::plan::{Obstacle, Plan, Solid, Unplanned, ViolationKind};
use planner::verify::verify;

use plans::{drone, kinds, lands, plan, preset, with_box, with_cylinder, with_mesh_box, with_zone};

/// Asserts that the first plan is refused for exactly this, and the second for nothing.
fn refused(kind: ViolationKind, broken: &Plan, repaired: &Plan) {
    assert_eq!(kinds(broken), [kind], "{:#?}", verify(broken).violations);
    let report = verify(repaired);
    assert!(report.violations.is_empty(), "{:#?}", report.violations);
}

fn one(knots: &[plans::Knot]) -> Plan {
    plan(vec![drone("a", "offboard-2", knots)])
}

fn broken(mut plan: Plan, change: impl FnOnce(&mut Plan)) -> Plan {
    change(&mut plan);
    plan
}

#[test]
fn a_plan_that_contradicts_itself_is_refused_as_malformed() {
    let good = one(&[(0.0, [1.0, 1.0, 1.0]), (5.0, [5.0, 1.0, 1.0])]);
    let good = with_zone(good, [30.0, 30.0, 0.0], [32.0, 32.0, 2.0], 1.5);
    let good = with_box(good, "rack", [20.0, 20.0, 0.0], [22.0, 22.0, 3.0]);
    let good = with_mesh_box(good, "net", [20.0, 30.0, 0.0], [22.0, 32.0, 3.0]);
    let good = with_cylinder(good, "column", [30.0, 20.0, 0.0], 0.5, 3.0);
    let of_the_whole: [fn(&mut Plan); 9] = [
        |plan| plan.format = "plan/0".to_owned(),
        |plan| plan.air.density_kg_per_m3 = 0.0,
        |plan| plan.air.jet.spreading = -0.1,
        |plan| plan.air.superposition = "vector".to_owned(),
        |plan| {
            plan.air.effects = Some(Effects {
                jet_merging: Some(JetMerging { exponent: 0.8 }),
                ..Effects::default()
            });
        },
        |plan| plan.bounds_m.max.z = -1.0,
        |plan| plan.zones[0].air_limit_mps = Some(f64::NAN),
        |plan| plan.zones[0].max_m.x = 29.0,
        |plan| {
            let twice = plan.drones[0].clone();
            plan.drones.push(twice);
        },
    ];
    for fault in of_the_whole {
        let broken = broken(good.clone(), fault);
        assert!(kinds(&broken).contains(&ViolationKind::Malformed));
    }
    for index in 0..3 {
        let broken = broken(good.clone(), |plan| {
            match &mut plan.obstacles[index].shape {
                Solid::Box { min_m, .. } => min_m.z = 4.0,
                Solid::Mesh { triangles, .. } => triangles[0][0] = 8,
                Solid::Cylinder { radius_m, .. } => *radius_m = -1.0,
            }
        });
        refused(ViolationKind::Malformed, &broken, &good);
    }
    let faults: [fn(&mut Plan); 16] = [
        |plan| plan.drones[0].trajectory.t_s.push(9.0),
        |plan| plan.drones[0].trajectory.t_s[0] = 6.0,
        |plan| plan.drones[0].trajectory.position_m[1].y = f64::NAN,
        |plan| plan.drones[0].trajectory.mass_kg[0] = -1.0,
        |plan| plan.drones[0].trajectory.mass_kg[0] = 0.5,
        |plan| plan.drones[0].trajectory = Default::default(),
        |plan| plan.drones[0].airframe.motor_distance_m = 0.0,
        |plan| plan.drones[0].airborne_s = (6.0, None),
        |plan| plan.drones[0].airborne_s = (0.0, Some(4.0)),
        |plan| plan.drones[0].airborne_s = (0.0, Some(0.0)),
        |plan| plan.drones[0].airborne_s = (1.0, None),
        |plan| plan.drones[0].airframe.body_radius_m = 0.0,
        |plan| plan.drones[0].airframe.max_speed_mps = f64::INFINITY,
        |plan| plan.drones[0].air_limit = f64::NAN,
        |plan| plan.drones[0].enters_s = Some(1.0),
        |plan| {
            plan.unplanned.push(Unplanned {
                name: "unknown".to_owned(),
                reason: String::new(),
                cause: None,
            })
        },
    ];
    for fault in faults {
        refused(
            ViolationKind::Malformed,
            &broken(good.clone(), fault),
            &good,
        );
    }
}

#[test]
fn a_drone_that_says_it_has_landed_in_mid_air_is_refused() {
    let landed = |z_m| {
        plan(vec![lands(drone(
            "a",
            "offboard-2",
            &[(0.0, [1.0, 1.0, 3.0]), (2.0, [1.0, 1.0, z_m])],
        ))])
    };
    let body_m = preset("offboard-2").body_radius_m;
    refused(ViolationKind::Malformed, &landed(2.0), &landed(body_m));
    let on_shelf = |z_m| with_box(landed(z_m), "shelf", [0.0, 0.0, 0.0], [2.0, 2.0, 1.0]);
    refused(
        ViolationKind::Malformed,
        &on_shelf(1.5),
        &on_shelf(1.0 + body_m),
    );
}

#[test]
fn a_jump_is_refused() {
    let good = one(&[
        (0.0, [1.0, 1.0, 1.0]),
        (2.0, [2.0, 1.0, 1.0]),
        (2.0, [2.0, 1.0, 1.0]),
        (4.0, [3.0, 1.0, 1.0]),
    ]);
    let jump = broken(good.clone(), |plan| {
        plan.drones[0].trajectory.position_m[2].x = 2.001
    });
    refused(ViolationKind::Jump, &jump, &good);
}

#[test]
fn more_than_the_highest_speed_is_refused() {
    let leg = |until_s| one(&[(0.0, [1.0, 1.0, 1.0]), (until_s, [5.0, 1.0, 1.0])]);
    refused(ViolationKind::Speed, &leg(1.999), &leg(2.0));
}

#[test]
fn a_centre_outside_the_bounds_is_refused() {
    let leg = |z_m| one(&[(0.0, [1.0, 1.0, 1.0]), (20.0, [5.0, 1.0, z_m])]);
    refused(ViolationKind::Bounds, &leg(12.01), &leg(12.0));
}

#[test]
fn a_body_that_clips_a_corner_between_break_points_is_refused() {
    // Passes the vertical edge at (10, 10) diagonally; the body's radius is 0.198 m.
    let past = |miss_m: f64| {
        let shift = miss_m / 2.0_f64.sqrt();
        let leg = one(&[
            (0.0, [7.0 - shift, 13.0 - shift, 1.0]),
            (5.0, [13.0 - shift, 7.0 - shift, 1.0]),
        ]);
        // The axis of the cylinder is 0.5 m from the edge, away from the path.
        let axis_m = 10.0 + 0.5 / 2.0_f64.sqrt();
        [
            with_box(leg.clone(), "rack", [10.0, 10.0, 0.0], [12.0, 12.0, 3.0]),
            with_mesh_box(leg.clone(), "rack", [10.0, 10.0, 0.0], [12.0, 12.0, 3.0]),
            with_cylinder(leg, "column", [axis_m, axis_m, 0.0], 0.5, 3.0),
        ]
    };
    for (broken, repaired) in past(0.19).iter().zip(&past(0.20)) {
        refused(ViolationKind::Obstacle, broken, repaired);
    }
}

#[test]
fn a_drone_inside_a_closed_mesh_is_refused() {
    let hovering = |x_m| {
        with_mesh_box(
            one(&[(0.0, [x_m, 15.0, 5.0])]),
            "hall",
            [10.0, 10.0, 0.0],
            [20.0, 20.0, 10.0],
        )
    };
    refused(ViolationKind::Obstacle, &hovering(15.0), &hovering(25.0));
}

#[test]
fn each_crate_of_a_mesh_has_an_inside_whatever_is_beside_it() {
    // One in another, one turned inside out that shares a corner with that, a sheet on its own.
    let hovering = |at_m: [f64; 3]| {
        let crates = [
            ([0.0; 3], [9.0; 3]),
            ([3.0; 3], [6.0; 3]),
            ([9.0; 3], [12.0; 3]),
        ];
        let mut plan = one(&[(0.0, at_m)]);
        let (mut vertices_m, mut triangles) = (Vec::new(), Vec::new());
        for (k, (min_m, max_m)) in crates.into_iter().enumerate() {
            plan = with_mesh_box(plan, "crate", min_m, max_m);
            let shape = plan.obstacles.pop().map(|it| it.shape);
            let Some(Solid::Mesh {
                vertices_m: corners_m,
                triangles: faces,
                ..
            }) = shape
            else {
                panic!("a mesh")
            };
            let before = vertices_m.len() as u32;
            vertices_m.extend(corners_m);
            triangles.extend(faces.iter().map(|&[a, b, c]| match k {
                2 => [a, c, b].map(|it| it + before),
                _ => [a, b, c].map(|it| it + before),
            }));
        }
        let before = vertices_m.len() as u32;
        vertices_m.extend([[15.0, 1.0, 1.0], [16.0, 1.0, 1.0], [16.0, 2.0, 1.0]].map(Point3::from));
        triangles.push([0, 1, 2].map(|it| it + before));
        let mesh = "crates.obj".to_owned();
        let shape = Solid::Mesh {
            mesh,
            vertices_m,
            triangles,
        };
        let name = "crates".to_owned();
        plan.obstacles.push(Obstacle { name, shape });
        plan
    };
    for inside_m in [[1.5; 3], [4.5; 3], [10.5; 3]] {
        let outside_m = [12.5, 2.0, 5.0];
        refused(
            ViolationKind::Obstacle,
            &hovering(inside_m),
            &hovering(outside_m),
        );
    }
}

#[test]
fn two_drones_that_swap_between_two_break_points_collide() {
    let swap = |aside_m| {
        plan(vec![
            drone(
                "a",
                "kolibri",
                &[(0.0, [1.0, 1.0, 1.0]), (0.4, [1.7, 1.0, 1.0])],
            ),
            drone(
                "b",
                "kolibri",
                &[
                    (0.0, [1.7, 1.0 + aside_m, 1.0]),
                    (0.4, [1.0, 1.0 + aside_m, 1.0]),
                ],
            ),
        ])
    };
    let report = verify(&swap(0.1));
    assert_eq!(kinds(&swap(0.1)), [ViolationKind::Collision]);
    // Half of 0.7 m at twice 1.75 m/s: they meet at 0.2 s.
    assert!(report.violations[0].from_s < 0.2 && report.violations[0].until_s > Some(0.2));
    refused(ViolationKind::Collision, &swap(0.1), &swap(0.3));
}
