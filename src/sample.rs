//! Plans made up for the tests of what is printed and drawn: plausible, unverified.

use airflow::{Air, Airframe, Jet, Superposition};
use nalgebra::{Point3, Vector3};
use planner::plan::{
    AirModel, AirframeEntry, AtEnd, AtStart, Corners, DronePlan, FORMAT, Fleet, IgnoringDownwash,
    JetEntry, ObstacleEntry, Plan, ShapeEntry, Status, TrajectoryEntry, Unplanned, ZoneEntry,
};
use planner::scenario::world::{self, Bounds, Drone, Planning, Task, Vehicle, World};

/// Four drones, two shelves, a column and a desk.
pub(crate) fn warehouse() -> Plan {
    let shelf = |name: &str, x: f64| ObstacleEntry {
        name: name.into(),
        shape: ShapeEntry::Box {
            min_m: Point3::new(x, 4.0, 0.0),
            max_m: Point3::new(x + 2.0, 16.0, 6.0),
        },
    };
    let column = ObstacleEntry {
        name: "column".into(),
        shape: ShapeEntry::Cylinder {
            base_m: Point3::new(25.0, 15.0, 0.0),
            radius_m: 0.6,
            height_m: 8.0,
        },
    };
    let mut k1 = drone(
        "k1",
        "kolibri",
        &[[1., 1., 1.], [1., 10., 7.], [20., 10., 7.], [20., 10., 3.]],
    );
    k1.arrives_s = 18.4;
    k1.detour_m = 0.6;
    (k1.worst_air_mps, k1.worst_air_from, k1.worst_air_at_s) = (0.2, Some("m1".into()), Some(7.1));
    k1.extra_energy_percent = 0.1;
    let mut k2 = drone(
        "k2",
        "kolibri",
        &[[3., 18., 1.], [3., 18., 1.], [12., 18., 4.], [12., 10., 2.]],
    );
    (k2.arrives_s, k2.waits_s, k2.detour_m) = (23.0, 2.0, -0.01);
    let mut m1 = drone(
        "m1",
        "matrice-300",
        &[[28., 18., 7.], [22., 12., 7.], [15., 2., 7.]],
    );
    m1.arrives_s = 12.0;
    let m2 = drone("m2", "matrice-300", &[[27., 3., 5.]]);
    Plan {
        obstacles: vec![shelf("rack-1", 4.0), shelf("rack-2", 9.0), column],
        zones: vec![ZoneEntry {
            name: "packing desk".into(),
            min_m: Point3::new(22.0, 5.0, 0.0),
            max_m: Point3::new(26.0, 8.0, 2.0),
            air_limit_mps: 1.5,
        }],
        drones: vec![k1, k2, m1, m2],
        status: Status::Partial,
        unplanned: vec![Unplanned {
            name: "m2".into(),
            reason: "its goal lies in the column of `m1`".into(),
        }],
        fleet: Fleet {
            makespan_s: 23.0,
            ..Fleet::default()
        },
        ignoring_downwash: Some(IgnoringDownwash {
            makespan_s: 20.0,
            drones_over_limit: 2,
            worst_air_mps: 6.1,
            time_over_limit_s: 9.4,
            zones_over_limit: 0,
            worst_zone_air_mps: 0.0,
            unplanned: 0,
        }),
        ..empty([30.0, 20.0, 8.0])
    }
}

/// Many drones in an empty hall, each by way of one corner.
pub(crate) fn hall(drones: usize) -> Plan {
    // Steps of the golden ratio's fractions scatter evenly without a random generator.
    let scatter =
        |index: usize, step: f64, span: f64| ((index as f64 * step).fract() * span).floor() + 0.5;
    let fleet = (0..drones)
        .map(|index| {
            let start = [
                scatter(index, 0.618, 64.0),
                scatter(index, 0.414, 64.0),
                scatter(index, 0.732, 8.0),
            ];
            let goal = [
                scatter(index, 0.236, 64.0),
                scatter(index, 0.872, 64.0),
                scatter(index, 0.317, 8.0),
            ];
            let corner = [goal[0], start[1], start[2]];
            let mut flown = drone(
                &format!("d{}", index + 1),
                "offboard-2",
                &[start, corner, goal],
            );
            flown.alone_s = flown.arrives_s - (index % 7) as f64;
            if index == 17 {
                (
                    flown.worst_air_mps,
                    flown.worst_air_from,
                    flown.worst_air_at_s,
                ) = (2.4, Some("d3".into()), Some(9.0));
            }
            flown
        })
        .collect();
    Plan {
        drones: fleet,
        ..empty([64.0, 64.0, 8.0])
    }
}

/// `k4` hovers four metres below `m1`, a little beside its axis.
pub(crate) fn two_above_each_other() -> World {
    let drone = |name: &str, airframe: &str, start_m: Point3<f64>| Drone {
        name: name.into(),
        vehicle: Vehicle {
            airframe: frame(airframe),
            body_radius_m: 0.1,
            max_speed_mps: 2.0,
        },
        start_m,
        at_start: world::AtStart::Hover,
        tasks: vec![Task {
            to_m: start_m + Vector3::x(),
            dwell_s: 0.0,
            load_kg: None,
        }],
        at_end: world::AtEnd::Hover,
        air_limit: 0.3,
    };
    World {
        name: "pair".into(),
        bounds_m: Bounds {
            min: Point3::origin(),
            max: Point3::new(10.0, 10.0, 8.0),
        },
        air: Air::default(),
        jet: Jet::default(),
        superposition: Superposition::default(),
        effects: airflow::effects::Effects::default(),
        obstacles: Vec::new(),
        zones: Vec::new(),
        drones: vec![
            drone("m1", "matrice-300", Point3::new(5.3, 6.0, 5.0)),
            drone("k4", "kolibri", Point3::new(5.0, 6.0, 1.0)),
        ],
        planning: Planning {
            cell_m: 1.0,
            clearance_m: 0.1,
            seed: 0,
            energy_weight: 1.0,
        },
        notes: Vec::new(),
    }
}

fn empty(size_m: [f64; 3]) -> Plan {
    let jet = Jet::default();
    Plan {
        format: FORMAT.into(),
        scenario: "sample".into(),
        status: Status::Safe,
        quasi_static: true,
        air: AirModel {
            density_kg_per_m3: 1.204,
            jet: JetEntry {
                centreline: jet.centreline,
                spreading: jet.spreading,
                origin: jet.origin,
            },
            superposition: "momentum".into(),
            effects: None,
        },
        bounds_m: Corners {
            min: Point3::origin(),
            max: Point3::from(size_m),
        },
        obstacles: Vec::new(),
        zones: Vec::new(),
        clearance_m: 0.1,
        drones: Vec::new(),
        unplanned: Vec::new(),
        fleet: Fleet::default(),
        ignoring_downwash: None,
        violations: Vec::new(),
    }
}

/// Flies through the points at 2 m/s; a repeated point is a wait of 5 s.
fn drone(name: &str, airframe: &str, points: &[[f64; 3]]) -> DronePlan {
    let position_m: Vec<Point3<f64>> = points.iter().copied().map(Point3::from).collect();
    let mut t_s = vec![0.0];
    for pair in position_m.windows(2) {
        let length_m = (pair[1] - pair[0]).norm();
        t_s.push(t_s[t_s.len() - 1] + if length_m == 0.0 { 5.0 } else { length_m / 2.0 });
    }
    let arrives_s = t_s[t_s.len() - 1];
    let frame = frame(airframe);
    DronePlan {
        name: name.into(),
        airframe: AirframeEntry {
            name: airframe.into(),
            mass_kg: frame.mass_kg(),
            propellers: frame.propellers(),
            propeller_diameter_m: frame.propeller_diameter_m(),
            motor_distance_m: frame.motor_distance_m(),
            width_factor: frame.width_factor(),
            body_radius_m: frame.tip_radius_m(),
            max_speed_mps: 2.0,
            hover_induced_velocity_mps: frame.hover_induced_velocity_mps(frame.mass_kg(), 1.204),
        },
        air_limit: 0.3,
        enters_s: None,
        at_start: AtStart::Hover,
        at_end: AtEnd::Hover,
        airborne_s: (0.0, None),
        trajectory: TrajectoryEntry {
            mass_kg: vec![frame.mass_kg(); t_s.len()],
            t_s,
            position_m,
        },
        arrives_s,
        alone_s: arrives_s,
        waits_s: 0.0,
        detour_m: 0.0,
        worst_air_mps: 0.0,
        worst_air_from: None,
        worst_air_at_s: None,
        dose_m: 0.0,
        extra_energy_j: 0.0,
        extra_energy_percent: 0.0,
    }
}

fn frame(name: &str) -> Airframe {
    Airframe::preset(name).expect("a preset of airflow")
}
