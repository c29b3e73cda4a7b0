//! From the text of a plan to what the checks need; what contradicts itself is named here.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Point3;

use super::Found;
use super::flight::{Flight, Scene};
use super::hangar::{Hangar, air};
use super::solid::{RawShape, Solid};
use super::wake_bound::BoundedWake;
use super::wake_end::Stops;
use crate::plan::trajectory::{SAME_PLACE_M, SAME_TIME_S, Tail, Trajectory};
use crate::plan::{AtEnd, AtStart, DronePlan, FORMAT, Plan, ShapeEntry, Violation, ViolationKind};

/// Those who stay are judged at rest for this long after the last time (s); any length would do.
const REST_S: f64 = 1.0;

/// A part of the mass by which a drone may be lighter than its airframe: rounding in the file.
const MASS_ROUNDING: f64 = 1e-6;

/// How far from its support a drone that has landed may rest (m), chosen here: what a planner may round.
const LANDING_M: f64 = 0.01;

/// A contradiction of the plan as a whole, or of one drone.
fn malformed(index: usize, drone: &str, why: String, at: (f64, Point3<f64>)) -> Found {
    let violation = Violation {
        kind: ViolationKind::Malformed,
        drone: drone.to_owned(),
        with: Some(why),
        from_s: at.0,
        until_s: Some(at.0),
        position_m: at.1,
        value: 0.0,
        limit: 0.0,
        unit: String::new(),
    };
    (index, violation)
}

/// Reads a plan; `None` where nothing can be judged.
pub(super) fn read(plan: &Plan) -> (Option<Scene<'_>>, Vec<Found>) {
    let mut found = Vec::new();
    let nowhere = (0.0, Point3::origin());
    let mut whole = |why: String| found.push(malformed(0, "plan", why, nowhere));
    if plan.format != FORMAT {
        whole(format!("format `{}` is not `{FORMAT}`", plan.format));
    }
    let air = air(plan).map_err(&mut whole).ok();
    let (min, max) = (plan.bounds_m.min, plan.bounds_m.max);
    let bounded = (0..3).all(|k| min[k].is_finite() && max[k].is_finite() && min[k] <= max[k]);
    if !bounded {
        whole("the bounds are no box".to_owned());
    }
    let mut solids = Vec::new();
    for entry in &plan.obstacles {
        let raw = match &entry.shape {
            ShapeEntry::Box { min_m, max_m } => RawShape::Box {
                min_m: *min_m,
                max_m: *max_m,
            },
            ShapeEntry::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => RawShape::Cylinder {
                base_m: *base_m,
                radius_m: *radius_m,
                height_m: *height_m,
            },
            ShapeEntry::Mesh {
                vertices_m,
                triangles,
                ..
            } => RawShape::Mesh {
                vertices_m,
                triangles,
            },
        };
        match Solid::new(&entry.name, raw) {
            Ok(solid) => solids.push(solid),
            Err(why) => whole(why),
        }
    }
    let zones = plan.zones.iter().filter(|zone| {
        let ok = (0..3).all(|k| {
            zone.min_m[k].is_finite() && zone.max_m[k].is_finite() && zone.min_m[k] <= zone.max_m[k]
        }) && zone.air_limit_mps >= 0.0;
        if !ok {
            whole(format!("zone `{}` is no box with a limit", zone.name));
        }
        ok
    });
    let zones = zones.collect();
    let mut names: Vec<&str> = plan
        .drones
        .iter()
        .map(|drone| drone.name.as_str())
        .collect();
    names.sort_unstable();
    for twice in names.windows(2).filter(|pair| pair[0] == pair[1]) {
        whole(format!("two drones are called `{}`", twice[0]));
    }
    for unplanned in plan
        .unplanned
        .iter()
        .filter(|one| names.binary_search(&one.name.as_str()).is_err())
    {
        whole(format!(
            "unplanned `{}` is not among the drones",
            unplanned.name
        ));
    }
    let (Some(air), true) = (air, bounded) else {
        return (None, found);
    };

    let last_s = plan
        .drones
        .iter()
        .filter_map(|drone| drone.trajectory.t_s.last().copied());
    let last_s = last_s.filter(|t_s| t_s.is_finite()).fold(0.0, f64::max);
    let mut scene = Scene {
        bounds_m: plan.bounds_m,
        stops: Stops::new(plan.bounds_m.min.z, &solids),
        solids,
        zones,
        superposition: air.superposition,
        receiver_gain: air.flown.receiver_gain,
        draught_mps: air.flown.draught_mps,
        wall: air.flown.wall,
        convection: air.flown.convection,
        longest_lag_s: 0.0,
        last_s,
        horizon_s: last_s + REST_S,
        flights: Vec::with_capacity(plan.drones.len()),
    };
    let mut hangar = Hangar::new(air, max.z - min.z);
    // Those who come lighter than their airframe are told of, and judged all the same.
    scene.longest_lag_s = longest_lag_s(plan, &mut hangar, max.z - min.z);
    scene.horizon_s += scene.longest_lag_s;
    for (index, drone) in plan.drones.iter().enumerate() {
        let unplanned = plan.unplanned.iter().any(|one| one.name == drone.name);
        match flight(&scene, &mut hangar, index, drone, unplanned) {
            Ok((flight, doubts)) => {
                let at = (
                    flight.airborne_s.0.clamp(0.0, last_s),
                    drone.trajectory.position_m[0],
                );
                found.extend(
                    doubts
                        .into_iter()
                        .map(|why| malformed(index, &drone.name, why, at)),
                );
                scene.flights.push(flight);
            }
            Err(why) => {
                let at = drone
                    .trajectory
                    .position_m
                    .first()
                    .copied()
                    .unwrap_or(Point3::origin());
                found.push(malformed(index, &drone.name, why, (0.0, at)));
            }
        }
    }
    (Some(scene), found)
}

/// How long air may be under way down to a depth below any drone that can be read (s).
fn longest_lag_s(plan: &Plan, hangar: &mut Hangar, depth_m: f64) -> f64 {
    let mut longest_s = 0.0_f64;
    if hangar.air.flown.convection.is_none() {
        return longest_s;
    }
    for drone in &plan.drones {
        let Ok((_, bare, _)) = hangar.get(&drone.airframe) else {
            continue;
        };
        for &mass_kg in drone.trajectory.mass_kg.iter().filter(|kg| **kg > 0.0) {
            let wake = bare.wake.with_mass(mass_kg);
            longest_s = longest_s.max(hangar.air.flown.lag_s(&wake, depth_m));
        }
    }
    longest_s
}

/// One drone and what contradicts itself in it; an error where it cannot be judged at all.
fn flight(
    scene: &Scene<'_>,
    hangar: &mut Hangar,
    index: usize,
    drone: &DronePlan,
    unplanned: bool,
) -> Result<(Flight, Vec<String>), String> {
    let positive = |what: &str, value: f64| {
        if value.is_finite() && value > 0.0 {
            Ok(value)
        } else {
            Err(format!("its {what} is {value}"))
        }
    };
    let (airframe, bare, discs) = hangar.get(&drone.airframe)?;
    positive("body radius", drone.airframe.body_radius_m)?;
    positive("highest speed", drone.airframe.max_speed_mps)?;
    if !(drone.air_limit.is_finite() && drone.air_limit >= 0.0) {
        return Err(format!("its air limit is {}", drone.air_limit));
    }
    for &mass_kg in &drone.trajectory.mass_kg {
        positive("mass", mass_kg)?;
    }
    let stays = unplanned || drone.at_end != AtEnd::Leave;
    let tail = if stays {
        Tail::Stays {
            until_s: scene.horizon_s,
        }
    } else {
        Tail::Gone
    };
    let mut trajectory =
        Trajectory::new(&drone.trajectory, tail).map_err(|error| error.to_string())?;
    if let Some(enters_s) = drone.enters_s {
        let first_s = drone.trajectory.t_s[0];
        if (enters_s - first_s).abs() > SAME_TIME_S {
            return Err(format!(
                "it comes at {enters_s:.3} s, but its trajectory begins at {first_s:.3} s"
            ));
        }
        trajectory = trajectory.entering();
    }
    let mut doubts = airborne_doubts(scene, drone, &trajectory, unplanned);
    if drone
        .trajectory
        .mass_kg
        .iter()
        .any(|&mass_kg| mass_kg < airframe.mass_kg() * (1.0 - MASS_ROUNDING))
    {
        doubts.push("it is lighter than its airframe".to_owned());
    }

    let mut by_mass: BTreeMap<u64, Arc<BoundedWake>> = BTreeMap::new();
    let mut hovering = |mass_kg: f64| {
        if mass_kg == airframe.mass_kg() {
            return Arc::clone(&bare);
        }
        Arc::clone(
            by_mass
                .entry(mass_kg.to_bits())
                .or_insert_with(|| Arc::new(bare.with_mass(mass_kg))),
        )
    };
    let flown = &hangar.air.flown;
    let wakes: Vec<Arc<BoundedWake>> = trajectory
        .pieces()
        .iter()
        .map(|piece| {
            let wake = hovering(piece.mass_kg);
            let climb_mps = piece.motion.climb_mps();
            if climb_mps == 0.0 || !flown.depends_on_climb() {
                return wake;
            }
            Arc::new(wake.climbing(flown, climb_mps))
        })
        .collect();
    let stops = trajectory.pieces().iter().zip(&wakes).map(|(piece, wake)| {
        scene.stops.candidates(
            &wake.wake,
            &piece
                .motion
                .box_m(piece.motion.from_s, piece.motion.until_s),
        )
    });
    let stops = stops.collect();
    let until_s = match drone.airborne_s {
        (_, None) if stays => f64::INFINITY,
        (_, None) => trajectory.last_s(),
        (_, Some(until_s)) => until_s,
    };
    let flight = Flight {
        index,
        name: drone.name.clone(),
        airborne_s: (drone.airborne_s.0.max(0.0), until_s),
        air_limit: drone.air_limit,
        max_speed_mps: drone.airframe.max_speed_mps,
        body_radius_m: drone.airframe.body_radius_m,
        tip_radius_m: airframe.tip_radius_m(),
        discs,
        wakes,
        stops,
        trajectory,
    };
    Ok((flight, doubts))
}

/// Ways in which a drone claims no wake where it has one.
fn airborne_doubts(
    scene: &Scene<'_>,
    drone: &DronePlan,
    trajectory: &Trajectory,
    unplanned: bool,
) -> Vec<String> {
    let mut doubts = Vec::new();
    let moves_s = trajectory.moves_s();
    let (from_s, until_s) = (
        drone.airborne_s.0,
        drone.airborne_s.1.unwrap_or(f64::INFINITY),
    );
    if !from_s.is_finite() || until_s.is_nan() || until_s < from_s {
        return vec!["airborne_s is no span of time".to_owned()];
    }
    if until_s == from_s {
        let waits_landed = drone.at_start == AtStart::Landed && moves_s.is_none();
        let gone_at_once =
            drone.at_end != AtEnd::Hover && !unplanned && trajectory.last_s() <= SAME_TIME_S;
        let rests = drone.at_end == AtEnd::Leave || rests(scene, drone, trajectory);
        if !(waits_landed || gone_at_once && rests) {
            doubts.push("it is said never to be airborne, but it is not landed".to_owned());
        }
        return doubts;
    }
    let enters_s = drone.enters_s.unwrap_or(0.0);
    if drone.at_start == AtStart::Hover && from_s > enters_s + SAME_TIME_S {
        doubts.push(format!(
            "it starts in the air but is said to be airborne from {from_s:.3} s only"
        ));
    }
    let hidden = moves_s.is_some_and(|(first_s, last_s)| {
        first_s < from_s - SAME_TIME_S || last_s > until_s + SAME_TIME_S
    });
    if hidden {
        doubts.push("it moves while it is said not to be airborne".to_owned());
    }
    let ends = if unplanned {
        AtEnd::Hover
    } else {
        drone.at_end
    };
    match ends {
        AtEnd::Hover if until_s.is_finite() => {
            doubts.push(format!(
                "it hovers at its end but is said to be airborne until {until_s:.3} s only"
            ));
        }
        // Who has landed may leave later.
        AtEnd::Leave if until_s.is_finite() && rests(scene, drone, trajectory) => {}
        AtEnd::Land | AtEnd::Leave if until_s < trajectory.last_s() - SAME_TIME_S => {
            doubts.push(format!(
                "it is said to be airborne until {until_s:.3} s only, before its last time"
            ));
        }
        AtEnd::Land if until_s.is_finite() && !rests(scene, drone, trajectory) => {
            doubts.push("it is said to have landed, but nothing is under it".to_owned());
        }
        _ => {}
    }
    doubts
}

/// Whether the last place is a landing: the floor or a solid one body radius below.
fn rests(scene: &Scene<'_>, drone: &DronePlan, trajectory: &Trajectory) -> bool {
    let place_m = trajectory.last_m();
    let supports_m = scene
        .solids
        .iter()
        .filter_map(|solid| solid.support_z_m(&place_m));
    let support_m = supports_m.fold(scene.bounds_m.min.z, f64::max);
    let gap_m = place_m.z - support_m - drone.airframe.body_radius_m;
    gap_m <= LANDING_M + SAME_PLACE_M
}
