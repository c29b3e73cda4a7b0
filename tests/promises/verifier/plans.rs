//! Small plans by hand, and the same judged by dense samples.

use airflow::{Air, Airframe, Source, Superposition, Wake, mean_over_discs_mps};
use nalgebra::Point3;
use planner::plan::smoothing::Kernel;
use planner::plan::trajectory::{Tail, Trajectory};
use planner::plan::{
    AirModel, AirframeEntry, AtEnd, AtStart, Bounds, DronePlan, FORMAT, Fleet, Margins, Obstacle,
    Plan, Solid, Status, TrajectoryEntry, ViolationKind, Zone,
};

/// A point (m) at a time (s).
pub(crate) type Knot = (f64, [f64; 3]);

pub(crate) fn preset(name: &str) -> AirframeEntry {
    let airframe = Airframe::preset(name).expect("a preset");
    AirframeEntry {
        name: name.to_owned(),
        mass_kg: airframe.mass_kg(),
        propellers: airframe.propellers(),
        propeller_diameter_m: airframe.propeller_diameter_m(),
        motor_distance_m: airframe.motor_distance_m(),
        width_factor: airframe.width_factor(),
        body_radius_m: airframe.tip_radius_m(),
        max_speed_mps: 2.0,
        hover_induced_velocity_mps: airframe
            .hover_induced_velocity_mps(airframe.mass_kg(), Air::default().density_kg_per_m3()),
        ..AirframeEntry::default()
    }
}

/// Hovers from 0 s on along the knots, and stays at the last one.
pub(crate) fn drone(name: &str, airframe: &str, knots: &[Knot]) -> DronePlan {
    let airframe = preset(airframe);
    let last_s = knots.last().map_or(0.0, |knot| knot.0);
    DronePlan {
        name: name.to_owned(),
        air_limit: 0.3,
        enters_s: None,
        at_start: AtStart::Hover,
        at_end: AtEnd::Hover,
        airborne_s: (0.0, None),
        landed_s: Vec::new(),
        trajectory: TrajectoryEntry {
            t_s: knots.iter().map(|knot| knot.0).collect(),
            position_m: knots.iter().map(|knot| Point3::from(knot.1)).collect(),
            mass_kg: vec![airframe.mass_kg; knots.len()],
            ..TrajectoryEntry::default()
        },
        airframe,
        arrives_s: last_s,
        alone_s: last_s,
        waits_s: 0.0,
        detour_m: 0.0,
        worst_air_mps: 0.0,
        worst_air_from: None,
        worst_air_at_s: None,
        dose_m: 0.0,
        extra_energy_j: 0.0,
        extra_energy_percent: 0.0,
        may_be_late_s: None,
    }
}

/// The same as it is flown with these limits: speed (m/s), acceleration (m/s²), jerk (m/s³); after
/// half the kernel at rest.
pub(crate) fn smooth(mut drone: DronePlan, [speed, acceleration, jerk]: [f64; 3]) -> DronePlan {
    let kernel = Kernel::new(speed, acceleration, jerk);
    let path = &mut drone.trajectory;
    path.t_s.iter_mut().for_each(|t_s| *t_s += kernel.half_s());
    path.t_s.insert(0, 0.0);
    path.position_m.insert(0, path.position_m[0]);
    path.mass_kg.insert(0, path.mass_kg[0]);
    drone.trajectory = kernel.smooth(path).expect("it begins at rest");
    drone.airframe.max_speed_mps = speed;
    drone.airframe.max_acceleration_mps2 = Some(acceleration);
    drone.airframe.max_jerk_mps3 = Some(jerk);
    drone
}

/// Lands at the last knot.
pub(crate) fn lands(mut drone: DronePlan) -> DronePlan {
    drone.at_end = AtEnd::Land;
    drone.airborne_s.1 = drone.trajectory.t_s.last().copied();
    drone
}

/// Leaves at the last knot.
pub(crate) fn leaves(mut drone: DronePlan) -> DronePlan {
    drone.at_end = AtEnd::Leave;
    drone.airborne_s.1 = drone.trajectory.t_s.last().copied();
    drone
}

/// A hall of 40 x 40 x 12 m.
pub(crate) fn plan(drones: Vec<DronePlan>) -> Plan {
    Plan {
        format: FORMAT.to_owned(),
        scenario: "by hand".to_owned(),
        status: Status::Safe,
        quasi_static: true,
        air_delay: None,
        air: AirModel {
            density_kg_per_m3: Air::default().density_kg_per_m3(),
            jet: airflow::Jet {
                centreline: 10.11,
                spreading: 0.07668,
                origin: -5.817,
            },
            superposition: "momentum".to_owned(),
            effects: None,
        },
        bounds_m: Bounds {
            min: Point3::origin(),
            max: Point3::new(40.0, 40.0, 12.0),
        },
        obstacles: Vec::new(),
        zones: Vec::new(),
        clearance_m: Some(0.1),
        cell_m: None,
        margins: Margins::default(),
        drones,
        unplanned: Vec::new(),
        fleet: Fleet::default(),
        ignoring_downwash: None,
        origin: None,
        zone_air: Vec::new(),
        violations: Vec::new(),
    }
}

pub(crate) fn with_box(mut plan: Plan, name: &str, min_m: [f64; 3], max_m: [f64; 3]) -> Plan {
    let shape = Solid::Box {
        min_m: min_m.into(),
        max_m: max_m.into(),
    };
    plan.obstacles.push(Obstacle {
        name: name.to_owned(),
        shape,
    });
    plan
}

pub(crate) fn with_cylinder(
    mut plan: Plan,
    name: &str,
    base_m: [f64; 3],
    radius_m: f64,
    height_m: f64,
) -> Plan {
    plan.obstacles.push(Obstacle {
        name: name.to_owned(),
        shape: Solid::Cylinder {
            base_m: base_m.into(),
            radius_m,
            height_m,
        },
    });
    plan
}

/// A closed box of twelve triangles.
pub(crate) fn with_mesh_box(mut plan: Plan, name: &str, min_m: [f64; 3], max_m: [f64; 3]) -> Plan {
    let corner = |k: usize| {
        Point3::from(std::array::from_fn::<f64, 3, _>(|axis| {
            if k >> axis & 1 == 1 {
                max_m[axis]
            } else {
                min_m[axis]
            }
        }))
    };
    let faces: [[u32; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = faces
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    let shape = Solid::Mesh {
        mesh: "box.obj".to_owned(),
        vertices_m: (0..8).map(corner).collect(),
        triangles,
    };
    plan.obstacles.push(Obstacle {
        name: name.to_owned(),
        shape,
    });
    plan
}

pub(crate) fn with_zone(
    mut plan: Plan,
    min_m: [f64; 3],
    max_m: [f64; 3],
    air_limit_mps: f64,
) -> Plan {
    plan.zones.push(Zone {
        name: "desk".to_owned(),
        min_m: min_m.into(),
        max_m: max_m.into(),
        air_limit_mps: Some(air_limit_mps),
        keep_out: false,
    });
    plan
}

pub(crate) fn kinds(plan: &Plan) -> Vec<ViolationKind> {
    let mut kinds: Vec<_> = planner::verify::verify(plan)
        .violations
        .iter()
        .map(|violation| violation.kind)
        .collect();
    kinds.sort();
    kinds.dedup();
    kinds
}

/// What dense samples say of one drone.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sampled {
    pub(crate) worst_mps: f64,
    pub(crate) dose_m: f64,
    /// Smallest gap to another body (m), and how deep in a column (m, 0: never).
    pub(crate) gap_m: f64,
    pub(crate) in_column_m: f64,
    pub(crate) induced_velocity_mps: f64,
}

/// Every drone by samples one step apart, hovering on at the end; no obstacles, no landings.
pub(crate) fn sample(plan: &Plan, step_s: f64) -> Vec<Sampled> {
    let last_s = plan
        .drones
        .iter()
        .filter_map(|drone| drone.trajectory.t_s.last().copied())
        .fold(0.0, f64::max);
    let frames: Vec<(Airframe, Wake, Trajectory)> = plan
        .drones
        .iter()
        .map(|drone| {
            let airframe = Airframe::preset(&drone.airframe.name).expect("a preset");
            let wake = Wake::new(
                &airframe,
                airframe.mass_kg(),
                plan.air.density_kg_per_m3,
                &airflow::Jet::default(),
            );
            let trajectory = Trajectory::new(
                &drone.trajectory,
                Tail::Stays {
                    until_s: last_s + 1.0,
                },
            )
            .expect("good");
            (airframe, wake, trajectory)
        })
        .collect();
    let mut sampled: Vec<Sampled> = frames
        .iter()
        .map(|(_, wake, _)| Sampled {
            gap_m: f64::INFINITY,
            induced_velocity_mps: wake.induced_velocity_mps(),
            ..Sampled::default()
        })
        .collect();
    for k in 0..=(last_s / step_s) as usize {
        let t_s = k as f64 * step_s;
        let places: Vec<Point3<f64>> = frames
            .iter()
            .map(|(_, _, trajectory)| trajectory.position_m(t_s).expect("there"))
            .collect();
        for (i, (airframe, _, _)) in frames.iter().enumerate() {
            let mut sources = Vec::new();
            for (j, (_, wake, _)) in frames.iter().enumerate().filter(|(j, _)| *j != i) {
                sources.push(Source {
                    wake,
                    position_m: places[j],
                    ends_at_z_m: 0.0,
                });
                let offset = places[i] - places[j];
                let bodies =
                    plan.drones[i].airframe.body_radius_m + plan.drones[j].airframe.body_radius_m;
                sampled[i].gap_m = sampled[i].gap_m.min(offset.norm() - bodies);
                if offset.z < 0.0 && -offset.z < wake.near_field_depth_m() {
                    let depth = (wake.tip_radius_m() - offset.xy().norm())
                        .min(-offset.z)
                        .min(wake.near_field_depth_m() + offset.z);
                    sampled[i].in_column_m = sampled[i].in_column_m.max(depth);
                }
            }
            let discs = airframe.disc_points();
            let mean = mean_over_discs_mps(&sources, &discs, places[i], Superposition::Momentum);
            sampled[i].worst_mps = sampled[i].worst_mps.max(mean);
            if t_s <= plan.drones[i].trajectory.t_s.last().copied().unwrap_or(0.0) {
                sampled[i].dose_m += mean * step_s;
            }
        }
    }
    sampled
}
