//! Whether a plan does what its world asked for: every task in order, with its dwell and its load.

use nalgebra::Point3;
use planner::plan::{DronePlan, Plan, Status, TrajectoryEntry};
use planner::scenario::world::{AtEnd, AtStart, Drone, World};

/// Rounding of a place that is computed twice (m).
const SAME_PLACE_M: f64 = 1e-6;
/// Rounding of a time that is a whole number of ticks (s).
const SAME_TIME_S: f64 = 1e-9;
/// How high a landed body may rest (m): to a centimetre, as coordinates are typed.
const REST_M: f64 = 0.011;

/// Asserts that every drone does its tasks or is named as unplanned, and that what the plan says of
/// itself is so.
pub(super) fn assert_done(world: &World, plan: &Plan) {
    let expected = match (plan.violations.is_empty(), plan.unplanned.is_empty()) {
        (false, _) => Status::Unsafe,
        (true, false) => Status::Partial,
        (true, true) => Status::Safe,
    };
    assert_eq!(plan.status, expected);
    assert_eq!(plan.drones.len(), world.drones.len());
    let mut arrivals_s = 0.0;
    for (drone, done) in world.drones.iter().zip(&plan.drones) {
        assert_eq!(drone.name, done.name);
        assert_eq!(
            done.trajectory.position_m.first(),
            Some(&drone.start_m),
            "{done:#?}"
        );
        assert_eq!(done.trajectory.t_s.first(), Some(&0.0));
        let unplanned: Vec<_> = plan
            .unplanned
            .iter()
            .filter(|it| it.name == drone.name)
            .collect();
        match unplanned[..] {
            [] => {
                assert_flown(world, drone, done);
                arrivals_s += done.arrives_s;
            }
            [it] => {
                assert_eq!(done.trajectory.t_s.len(), 1);
                assert!(!it.reason.is_empty());
                let wake_s = match drone.at_start {
                    AtStart::Hover => (0.0, None),
                    AtStart::Landed => (0.0, Some(0.0)),
                };
                assert_eq!(done.airborne_s, wake_s, "{done:#?}");
            }
            _ => panic!("`{}` is left out twice", drone.name),
        }
    }
    assert!((arrivals_s - plan.fleet.sum_of_arrivals_s).abs() < 1e-5);
}

fn assert_flown(world: &World, drone: &Drone, done: &DronePlan) {
    let name = &drone.name;
    let track = &done.trajectory;
    assert!(
        done.alone_s <= done.arrives_s + SAME_TIME_S,
        "`{name}` arrives at {} s, alone at {} s",
        done.arrives_s,
        done.alone_s
    );
    let bare_kg = drone.vehicle.airframe.mass_kg();
    let mut mass_kg = bare_kg;
    let mut now_s = 0.0;
    let mut straight_m = 0.0;
    let mut here_m = drone.start_m;
    for (k, task) in drone.tasks.iter().enumerate() {
        let then_kg = task.load_kg.map_or(mass_kg, |load_kg| bare_kg + load_kg);
        let arrival_s = arrivals_s(track, now_s, task.to_m)
            .into_iter()
            .find(|&at_s| holds(track, at_s, at_s + task.dwell_s, task.to_m, then_kg));
        let Some(arrival_s) = arrival_s else {
            panic!("`{name}` never does task {k} after {now_s} s: {track:#?}");
        };
        let masses = track.t_s.iter().zip(&track.mass_kg);
        let towards = masses.filter(|(t_s, _)| now_s < **t_s && **t_s < arrival_s - SAME_TIME_S);
        for (t_s, kg) in towards {
            assert_eq!(*kg, mass_kg, "`{name}` at {t_s} s, towards task {k}");
        }
        now_s = arrival_s + task.dwell_s;
        mass_kg = then_kg;
        straight_m += (task.to_m - here_m).norm();
        here_m = task.to_m;
    }
    assert!(done.arrives_s >= now_s - SAME_TIME_S, "`{name}`: {now_s} s");
    let dwells_s: f64 = drone.tasks.iter().map(|task| task.dwell_s).sum();
    assert!(done.alone_s >= straight_m / drone.vehicle.max_speed_mps + dwells_s - SAME_TIME_S);
    if let Some(task) = drone.tasks.last() {
        let from_s = done.arrives_s - task.dwell_s;
        assert!(
            holds(track, from_s, done.arrives_s, task.to_m, mass_kg),
            "`{name}`"
        );
    }
    assert_ended(world, drone, done, here_m, mass_kg);
}

/// Moments from `from_s` on at which a track reaches a place: break points there, and passages.
fn arrivals_s(track: &TrajectoryEntry, from_s: f64, place_m: Point3<f64>) -> Vec<f64> {
    let mut found = vec![from_s];
    for (k, &start_s) in track.t_s.iter().enumerate() {
        let end_s = track.t_s.get(k + 1).copied();
        let (a_m, b_m) = (
            track.position_m[k],
            track.position_m[(k + 1).min(track.t_s.len() - 1)],
        );
        let way_m = b_m - a_m;
        let share = if way_m.norm() > 0.0 {
            ((place_m - a_m).dot(&way_m) / way_m.norm_squared()).clamp(0.0, 1.0)
        } else {
            0.0
        };
        found.push(start_s + share * (end_s.unwrap_or(start_s) - start_s));
    }
    found.retain(|&at_s| {
        at_s >= from_s - SAME_TIME_S
            && track
                .position_m(at_s)
                .is_some_and(|at_m| (at_m - place_m).norm() < SAME_PLACE_M)
    });
    found.sort_by(f64::total_cmp);
    found
}

/// Whether a track stays at a place, at a mass, for a span of time.
fn holds(track: &TrajectoryEntry, from_s: f64, until_s: f64, at_m: Point3<f64>, kg: f64) -> bool {
    let there = |t_s: f64| {
        track
            .position_m(t_s)
            .is_some_and(|place_m| (place_m - at_m).norm() < SAME_PLACE_M)
    };
    let piece = track
        .t_s
        .partition_point(|t_s| *t_s <= from_s + SAME_TIME_S)
        .max(1)
        - 1;
    // The last break point of a drone that leaves ends the piece before.
    let within = (piece..track.t_s.len())
        .take_while(|&k| k == piece || track.t_s[k] < until_s - SAME_TIME_S);
    let ends_at_once = piece + 1 == track.t_s.len() && piece > 0 && until_s - from_s < 1e-9;
    there(from_s)
        && there(until_s)
        && within.into_iter().all(|k| {
            (track.mass_kg[k] == kg || ends_at_once)
                && (k == piece || (track.position_m[k] - at_m).norm() < SAME_PLACE_M)
        })
}

fn assert_ended(world: &World, drone: &Drone, done: &DronePlan, last_m: Point3<f64>, kg: f64) {
    let track = &done.trajectory;
    let (name, last) = (&drone.name, track.t_s.len() - 1);
    let (end_s, end_m) = (track.t_s[last], track.position_m[last]);
    let moves = (1..track.t_s.len()).find(|&k| track.position_m[k] != track.position_m[k - 1]);
    let lifts_s = match drone.at_start {
        AtStart::Hover => Some(0.0),
        AtStart::Landed => moves.map(|k| track.t_s[k - 1]),
    };
    let stays_grounded = lifts_s.is_none();
    let until_s = match drone.at_end {
        AtEnd::Hover => {
            assert_eq!(done.at_end, AtEnd::Hover);
            assert!(
                (end_m - last_m).norm() < SAME_PLACE_M,
                "`{name}` ends elsewhere"
            );
            None
        }
        AtEnd::Leave => {
            assert_eq!(done.at_end, AtEnd::Leave);
            // One without tasks is at its start for a tick.
            let tick_s = if drone.tasks.is_empty() { 0.01 } else { 0.0 };
            let lingers_s = end_s - done.arrives_s;
            assert!(
                -SAME_TIME_S < lingers_s && lingers_s < tick_s + SAME_TIME_S,
                "`{name}` lingers"
            );
            Some(end_s)
        }
        AtEnd::Land => {
            assert_eq!(done.at_end, AtEnd::Land);
            assert!((end_m.xy() - last_m.xy()).norm() < SAME_PLACE_M);
            let rest_m = height_above_support_m(world, end_m);
            let body_m = drone.vehicle.body_radius_m;
            assert!(
                stays_grounded || rest_m < body_m + REST_M,
                "`{name}` rests at {rest_m} m"
            );
            Some(end_s)
        }
    };
    if drone.at_end != AtEnd::Leave {
        assert_eq!(track.mass_kg[last], kg, "`{name}` ends with another load");
    }
    let expected = match (lifts_s, until_s) {
        (None, _) => (0.0, Some(0.0)),
        // Gone, or on the ground, at once.
        (Some(from_s), Some(until_s)) if from_s == until_s => (0.0, Some(0.0)),
        (Some(from_s), until_s) => (from_s, until_s),
    };
    assert_eq!(done.airborne_s, expected, "{done:#?}");
}

fn height_above_support_m(world: &World, at_m: Point3<f64>) -> f64 {
    use planner::scenario::world::Solid;
    let tops = world
        .obstacles
        .iter()
        .filter_map(|obstacle| match &obstacle.shape {
            Solid::Box { min_m, max_m } => {
                let over =
                    (0..2).all(|axis| min_m[axis] <= at_m[axis] && at_m[axis] <= max_m[axis]);
                over.then_some(max_m.z)
            }
            Solid::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => ((at_m - base_m).xy().norm() <= *radius_m).then_some(base_m.z + height_m),
            Solid::Mesh { .. } => None,
        });
    let below = tops.filter(|top_z_m| *top_z_m <= at_m.z);
    at_m.z - below.fold(world.bounds_m.min.z, f64::max)
}
