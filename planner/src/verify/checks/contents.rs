//! From the data of a plan to what the checks need; contradictions are reported here.
//!
//! A plan may come from any program. Numbers that are not finite or not positive where they must
//! be, air that no model covers, names that do not match and claims of being airborne that the
//! trajectory denies become violations of the kind `malformed`; the rest is judged if it can be.

use std::ops::RangeInclusive;
use std::str::FromStr;
use std::sync::Arc;

use airflow::{FarField, Flown, Superposition};
use nalgebra::Point3;

use crate::plan::cause::as_typed;
use crate::plan::limits::{MOST_INDUCED_VELOCITY_MPS, MOST_MASS_RATIO, is_overloaded};
use crate::plan::trajectory::{SAME_PLACE_M, SAME_TIME_S, Tail, Trajectory};
use crate::plan::{AtEnd, AtStart, DronePlan, FORMAT, FORMAT_BEFORE, Margins, Plan, Zone};
use crate::verify::bounds::obstacles::{NamedSolid, Obstacles};
use crate::verify::bounds::wake::{BoundedWake, WakeCache};
use crate::verify::extents::is_box;
use crate::verify::scene::{Flight, Scene, Smooth};
use crate::verify::violation::{IndexedViolation, malformed};

/// Drones that stay are judged at rest for this long after the last time (s); any length would do.
const REST_S: f64 = 1.0;

/// A part of the mass by which a drone may be lighter than its airframe, or heavier than it lifts:
/// rounding in the file.
const MASS_ROUNDING: f64 = 1e-6;

/// How far from its support a drone that has landed may rest (m), chosen here: what a planner may
/// round.
const LANDING_M: f64 = 0.01;

/// The same where a drone starts landed (m), chosen here: pads are measured to a few centimetres.
const SUPPORT_M: f64 = 0.05;

/// Margins that can be judged (s, m), chosen here: more than drones fly with, and few enough
/// shifts.
const TIME_MARGIN_S: RangeInclusive<f64> = 0.0..=60.0;
const TRACKING_M: RangeInclusive<f64> = 0.0..=10.0;

/// A drone farther than this from the bounds is reported, and not judged (m). Horizontally: as far
/// as bounds may extend, so that drones of any neighbouring area are judged. Vertically: chosen
/// here, areas share their heights.
const AROUND_M: [f64; 3] = [20_000.0, 20_000.0, 100.0];

/// A quantity of a drone, what it may be, and its unit: wider than any drone, air or place known
/// here, and narrow enough for what is worked out from it to be finite.
type Physical = (&'static str, RangeInclusive<f64>, &'static str);
/// Coordinates that a plan may have (m); what lies beyond is malformed, as for the next three.
pub const COORDINATES_M: (f64, f64) = (-1e7, 1e7);
/// Extents of the whole (m).
pub const EXTENTS_M: (f64, f64) = (0.0, 2e4);
/// A drone's highest speed (m/s).
pub const SPEEDS_MPS: (f64, f64) = (1e-3, 1e3);
/// A drone's last time (s).
pub const TIMES_S: (f64, f64) = (0.0, 1e9);
const MASS: Physical = ("mass", 1e-4..=1e5, "kg");
const SIZE: Physical = ("body radius", 1e-3..=1e3, "m");
const SPEED: Physical = ("highest speed", SPEEDS_MPS.0..=SPEEDS_MPS.1, "m/s");
const VERTICAL: Physical = ("highest climb or descent", 1e-3..=1e3, "m/s");
const ACCELERATION: Physical = ("highest acceleration", 1e-3..=1e5, "m/s2");
const JERK: Physical = ("highest jerk", 1e-3..=1e7, "m/s3");
const AIR_LIMIT: Physical = ("air limit", 0.0..=100.0, "of its induced velocity");
const PROPELLER: Physical = ("propeller diameter", 1e-3..=100.0, "m");
const MOTORS: Physical = ("motor distance", 1e-3..=100.0, "m");
const WIDTH: Physical = ("width factor", 0.05..=20.0, "");
const TIME: Physical = ("last time", TIMES_S.0..=TIMES_S.1, "s");
const DENSITY: Physical = ("the air's density", 1e-3..=100.0, "kg/m3");
const CENTRELINE: Physical = ("the jet's centreline", 1e-2..=1e3, "");
const SPREADING: Physical = ("the jet's spreading", 1e-4..=10.0, "");
const ORIGIN: Physical = ("the jet's origin", -1e3..=-1e-3, "motor distances");
const COORDINATE: Physical = ("a coordinate", COORDINATES_M.0..=COORDINATES_M.1, "m");
const EXTENT: Physical = ("an extent", EXTENTS_M.0..=EXTENTS_M.1, "m");
const ZONE_LIMIT: Physical = ("the limit of a zone", 0.0..=1e3, "m/s");

/// Whether a number is physical.
///
/// # Errors
///
/// In words, that it is not.
fn physical((what, range, unit): &Physical, value: f64) -> Result<(), String> {
    if range.contains(&value) {
        return Ok(());
    }
    let (low, high) = (range.start(), range.end());
    let value = as_typed(value);
    let words = format!("{what} is {value} {unit}: not within {low} to {high}");
    Err(words.replace(" :", ":"))
}

/// Whether all coordinates of some places are physical.
///
/// # Errors
///
/// In words, that one is not.
fn places(places_m: &[Point3<f64>]) -> Result<(), String> {
    let mut all = places_m.iter().flat_map(|place_m| place_m.iter());
    all.try_for_each(|it| physical(&COORDINATE, *it))
}

/// Reads a plan; `None` where nothing can be judged.
pub(crate) fn read(plan: &Plan) -> (Option<Scene<'_>>, Vec<IndexedViolation>) {
    let mut found = Vec::new();
    let nowhere = (0.0, Point3::origin());
    let mut whole = |why: String| found.push(malformed((0, "plan"), why, nowhere));
    if ![FORMAT, FORMAT_BEFORE].contains(&plan.format.as_str()) {
        let known = format!("`{FORMAT}` nor `{FORMAT_BEFORE}`");
        whole(format!("format `{}` is neither {known}", plan.format));
    }
    let air = air(plan).map_err(&mut whole).ok();
    let (min, max) = (plan.bounds_m.min, plan.bounds_m.max);
    let mut bounded = is_box(&min, &max);
    if !bounded {
        whole("the bounds are no box".to_owned());
    }
    let mut extents_m = (0..3).map(|k| max[k] - min[k]);
    let is_known = places(&[min, max]);
    if let Err(why) = is_known.and_then(|()| extents_m.try_for_each(|it| physical(&EXTENT, it))) {
        whole(format!("the bounds: {why}"));
        bounded = false;
    }
    let solids = plan.obstacles.iter().map(|it| {
        let solid = NamedSolid::new(it)?;
        let is_near = places(&solid.corners_m());
        is_near.map_err(|why| format!("obstacle `{}`: {why}", it.name))?;
        Ok(solid)
    });
    let solids: Vec<NamedSolid> = (solids.filter_map(|it| it.map_err(&mut whole).ok())).collect();
    let zones = plan.zones.iter().filter(|zone| {
        let ok = is_box(&zone.min_m, &zone.max_m)
            && places(&[zone.min_m, zone.max_m]).is_ok()
            && zone
                .air_limit_mps
                .is_none_or(|mps| physical(&ZONE_LIMIT, mps).is_ok());
        if !ok {
            whole(format!("zone `{}` is no box with a limit", zone.name));
        }
        ok
    });
    let zones: Vec<&Zone> = zones.collect();
    let mut margins = plan.margins;
    let Margins { time_s, tracking_m } = margins;
    if !(TIME_MARGIN_S.contains(&time_s) && TRACKING_M.contains(&tracking_m)) {
        margins = Margins::default();
        whole(format!(
            "its margins are {} s and {} m; at most {} s and {} m can be judged",
            as_typed(time_s),
            as_typed(tracking_m),
            TIME_MARGIN_S.end(),
            TRACKING_M.end()
        ));
    }
    let mut names: Vec<&str> = plan.drones.iter().map(|it| it.name.as_str()).collect();
    names.sort_unstable();
    for twice in names.windows(2).filter(|pair| pair[0] == pair[1]) {
        whole(format!("two drones are called `{}`", twice[0]));
    }
    let unplanned = plan.unplanned.iter().map(|it| it.name.as_str());
    for name in unplanned.filter(|name| names.binary_search(name).is_err()) {
        whole(format!("unplanned `{name}` is not among the drones"));
    }
    let (Some((superposition, flown, mut cache)), true) = (air, bounded) else {
        return (None, found);
    };

    let last_s = (plan.drones.iter()).filter_map(|drone| drone.trajectory.t_s.last().copied());
    let last_s = last_s
        .filter(|t_s| TIME.1.contains(t_s))
        .fold(0.0, f64::max);
    let longest_lag_s = longest_lag_s(plan, &flown, &mut cache);
    let mut scene = Scene {
        bounds_m: plan.bounds_m,
        obstacles: Obstacles {
            floor_z_m: min.z,
            solids,
        },
        keep_out: (zones.iter().filter(|it| it.keep_out))
            .map(|it| NamedSolid::of_zone(it))
            .collect(),
        zones,
        margins,
        superposition,
        flown,
        longest_lag_s,
        last_s,
        horizon_s: last_s + REST_S + longest_lag_s,
        flights: Vec::with_capacity(plan.drones.len()),
    };
    for (index, drone) in plan.drones.iter().enumerate() {
        let subject = (index, drone.name.as_str());
        let first_m = drone.trajectory.position_m.first().copied();
        let first_m = first_m.unwrap_or(Point3::origin());
        let unplanned = plan.is_unplanned(&drone.name);
        match flight(&scene, &mut cache, index, drone, unplanned) {
            Ok((flight, contradictions)) => {
                let at = (flight.airborne_s.0.clamp(0.0, last_s), first_m);
                found.extend(
                    contradictions
                        .into_iter()
                        .map(|why| malformed(subject, why, at)),
                );
                scene.flights.push(flight);
            }
            Err(why) => found.push(malformed(subject, why, (0.0, first_m))),
        }
    }
    (Some(scene), found)
}

/// The air of the plan, checked: how wakes add up, what a finding adds, and a cache for wakes in
/// it.
fn air(plan: &Plan) -> Result<(Superposition, Flown, WakeCache), String> {
    let density_kg_per_m3 = plan.air.density_kg_per_m3;
    physical(&DENSITY, density_kg_per_m3)?;
    let jet = plan.air.jet;
    physical(&CENTRELINE, jet.centreline)?;
    physical(&SPREADING, jet.spreading)?;
    physical(&ORIGIN, jet.origin)?;
    if let Some(problem) = jet.problems().first() {
        return Err(format!("the jet: {problem}"));
    }
    let superposition =
        Superposition::from_str(&plan.air.superposition).map_err(|error| error.to_string())?;
    if plan.quasi_static != plan.convection().is_none() {
        let why = "quasi_static is true exactly where no convective delay is stated";
        return Err(format!("it contradicts itself: {why}"));
    }
    let effects = plan.air.effects.unwrap_or_default();
    if let Some(problem) = effects.problems().first() {
        return Err(format!("an effect: {problem}"));
    }
    let flown = Flown::of(&effects).map_err(|refused| {
        let (name, why) = refused[0];
        format!("`{name}` cannot be judged: {why}")
    })?;
    let flown = flown.with_convection(plan.air_delay.map(|it| it.convection));
    let drones = plan.drones.iter();
    let accelerations = drones.map(|it| it.airframe.max_acceleration_mps2);
    let most_mps2 = accelerations.map(|most| most.unwrap_or(f64::INFINITY));
    let flown = flown.accelerating(most_mps2.fold(0.0, f64::max));
    let deepest_m = plan.bounds_m.max.z - plan.bounds_m.min.z;
    let cache = WakeCache::new(density_kg_per_m3, jet, flown, deepest_m);
    Ok((flown.superposition.unwrap_or(superposition), flown, cache))
}

/// The longest convective delay down to a depth below any drone that can be read (s).
fn longest_lag_s(plan: &Plan, flown: &Flown, cache: &mut WakeCache) -> f64 {
    let mut longest_s = 0.0_f64;
    if flown.convection.is_none() {
        return longest_s;
    }
    let depth_m = plan.bounds_m.max.z - plan.bounds_m.min.z;
    for drone in &plan.drones {
        let airframe = drone.airframe.airframe().ok();
        let Some(airframe) = airframe.filter(|it| cache.beyond(it).is_none()) else {
            continue;
        };
        // Drones lighter than their airframe are reported, and judged all the same.
        for &mass_kg in drone.trajectory.mass_kg.iter().filter(|kg| **kg > 0.0) {
            let (wake, _) = cache.get(&airframe, mass_kg);
            longest_s = longest_s.max(flown.lag_s(&wake.wake, depth_m));
        }
    }
    longest_s
}

/// One drone and its contradictions; an error where it cannot be judged at all.
fn flight(
    scene: &Scene<'_>,
    cache: &mut WakeCache,
    index: usize,
    drone: &DronePlan,
    unplanned: bool,
) -> Result<(Flight, Vec<String>), String> {
    let its = |quantity: &Physical, value: f64| {
        physical(quantity, value).map_err(|why| format!("its {why}"))
    };
    let entry = &drone.airframe;
    its(&MASS, entry.mass_kg)?;
    its(&PROPELLER, entry.propeller_diameter_m)?;
    its(&MOTORS, entry.motor_distance_m)?;
    its(&WIDTH, entry.width_factor)?;
    let airframe = entry.airframe()?;
    if let Some(why) = cache.beyond(&airframe) {
        return Err(why);
    }
    its(&SIZE, entry.body_radius_m)?;
    its(&SPEED, entry.max_speed_mps)?;
    for (quantity, limit) in [
        (&VERTICAL, entry.max_climb_mps),
        (&VERTICAL, entry.max_descent_mps),
        (&ACCELERATION, entry.max_acceleration_mps2),
        (&JERK, entry.max_jerk_mps3),
    ] {
        limit.map_or(Ok(()), |limit| its(quantity, limit))?;
    }
    its(&AIR_LIMIT, drone.air_limit)?;
    for &mass_kg in &drone.trajectory.mass_kg {
        its(&MASS, mass_kg)?;
    }
    drone
        .trajectory
        .t_s
        .last()
        .map_or(Ok(()), |last_s| its(&TIME, *last_s))?;
    let (low_m, high_m) = (scene.bounds_m.min, scene.bounds_m.max);
    let is_near = |place_m: &Point3<f64>| {
        (0..3).all(|k| (low_m[k] - AROUND_M[k]..=high_m[k] + AROUND_M[k]).contains(&place_m[k]))
    };
    let controls_m = drone.trajectory.control_m.iter().flatten();
    if !drone
        .trajectory
        .position_m
        .iter()
        .chain(controls_m)
        .all(is_near)
    {
        let far = "and is not judged any further";
        return Err(format!(
            "it leaves the bounds by more than {} m to the side, or {} m up or down, {far}",
            AROUND_M[0], AROUND_M[2]
        ));
    }
    let stays = unplanned || drone.at_end != AtEnd::Leave;
    let until_s = scene.horizon_s;
    let tail = match stays {
        true => Tail::Stays { until_s },
        false => Tail::Gone,
    };
    let trajectory = Trajectory::new(&drone.trajectory, tail);
    let mut trajectory = trajectory.map_err(|error| error.to_string())?;
    if let Some(enters_s) = drone.enters_s {
        let first_s = drone.trajectory.t_s[0];
        let is_same = (enters_s - first_s).abs() <= SAME_TIME_S;
        if !is_same {
            return Err(format!(
                "it comes at {enters_s:.3} s, but its trajectory begins at {first_s:.3} s"
            ));
        }
        trajectory = trajectory.entering();
    }
    let mut airborne_from_s = drone.airborne_s.0.max(0.0);
    if trajectory.pieces().is_empty() && drone.enters_s.is_none() {
        // It leaves at once: on time it is never there.
        let before_s = 2.0 * scene.margins.time_s;
        trajectory = trajectory.leaving_late(drone.trajectory.mass_kg[0], before_s);
        if drone.at_start == AtStart::Hover {
            airborne_from_s -= before_s;
        }
    }
    let mut contradictions = airborne_contradictions(scene, drone, &trajectory, unplanned);
    let landed_s = match rest_contradiction(scene, drone, &trajectory) {
        None => drone.landed_s.clone(),
        Some(wrong) => {
            contradictions.push(wrong);
            Vec::new()
        }
    };
    let bare_kg = airframe.mass_kg() * (1.0 - MASS_ROUNDING);
    if drone.trajectory.mass_kg.iter().any(|&it| it < bare_kg) {
        contradictions.push("it is lighter than its airframe".to_owned());
    }
    let density_kg_per_m3 = cache.density_kg_per_m3();
    let is_overloaded =
        |kg: &&f64| is_overloaded(&airframe, *kg * (1.0 - MASS_ROUNDING), density_kg_per_m3);
    if let Some(mass_kg) = drone.trajectory.mass_kg.iter().find(is_overloaded) {
        let [mass_kg, own_kg] = [*mass_kg, airframe.mass_kg()].map(as_typed);
        contradictions.push(format!(
            "it weighs {mass_kg} kg, its airframe {own_kg} kg: none hovers at more than \
             {MOST_MASS_RATIO} times its mass, nor at an induced velocity above \
             {MOST_INDUCED_VELOCITY_MPS} m/s"
        ));
    }

    let (mut hovering, discs) = cache.get(&airframe, airframe.mass_kg());
    let mut hovers_at_kg = airframe.mass_kg();
    let mut wakes: Vec<Arc<BoundedWake>> = Vec::with_capacity(trajectory.pieces().len());
    for piece in trajectory.pieces() {
        if piece.mass_kg != hovers_at_kg {
            (hovering, _) = cache.get(&airframe, piece.mass_kg);
            hovers_at_kg = piece.mass_kg;
        }
        // A drone that sinks has the stronger wake.
        let (climb_mps, _) = piece.motion.climb_mps();
        wakes.push(if climb_mps == 0.0 || !scene.flown.depends_on_climb() {
            Arc::clone(&hovering)
        } else {
            Arc::new(hovering.climbing(&scene.flown, climb_mps))
        });
    }
    let stops = trajectory.pieces().iter().zip(&wakes).map(|(piece, wake)| {
        let motion = &piece.motion;
        let places_m = motion.box_m(motion.from_s, motion.until_s);
        scene.obstacles.that_may_stop(&wake.wake, &places_m)
    });
    let stops = stops.collect();
    let heights = trajectory.pieces().iter().map(|piece| {
        let motion = &piece.motion;
        motion.heights_m(motion.from_s, motion.until_s)
    });
    let heights_m: Vec<(f64, f64)> = heights.collect();
    let tops_m = heights_m.iter().map(|(_, high_m)| *high_m);
    let top_m = tops_m.fold(f64::NEG_INFINITY, f64::max);
    let takes_s = |far: &FarField| far.transport_time_s(1.0, 1.0);
    let fars = wakes.iter().map(|it| *it.wake.far_field());
    let slowest = fars.max_by(|a, b| takes_s(a).total_cmp(&takes_s(b)));
    let slowest = slowest.unwrap_or(*hovering.wake.far_field());
    let until_s = match drone.airborne_s {
        (_, None) if stays => f64::INFINITY,
        (_, None) => trajectory.last_s(),
        (_, Some(until_s)) => until_s,
    };
    let places_m = &drone.trajectory.position_m;
    let flight = Flight {
        index,
        name: drone.name.clone(),
        airborne_s: (airborne_from_s, until_s),
        landed_s,
        air_limit: drone.air_limit,
        max_speed_mps: drone.airframe.max_speed_mps,
        body_radius_m: drone.airframe.body_radius_m,
        vertical_mps: [drone.airframe.max_climb_mps, drone.airframe.max_descent_mps],
        smooth: drone.trajectory.claims_continuity().then_some(Smooth {
            acceleration_mps2: entry.max_acceleration_mps2,
            jerk_mps3: entry.max_jerk_mps3,
            rests: [drone.enters_s.is_none(), stays],
        }),
        takes_off_m: (places_m.first().copied()).filter(|_| drone.at_start == AtStart::Landed),
        lands_m: (places_m.last().copied()).filter(|_| drone.has_landed() && !unplanned),
        tip_radius_m: airframe.tip_radius_m(),
        discs,
        wakes,
        stops,
        heights_m,
        top_m,
        slowest,
        trajectory,
    };
    Ok((flight, contradictions))
}

/// Where a drone claims to stand landed between two flights and does not.
fn rest_contradiction(
    scene: &Scene<'_>,
    drone: &DronePlan,
    trajectory: &Trajectory,
) -> Option<String> {
    let (mut before_s, until_s) = (
        drone.airborne_s.0,
        drone.airborne_s.1.unwrap_or(f64::INFINITY),
    );
    for &(lands_s, rises_s) in &drone.landed_s {
        let told = format!("it is said to stand landed from {lands_s:.3} s to {rises_s:.3} s");
        let is_span = before_s <= lands_s && lands_s < rises_s && rises_s <= until_s;
        if !(is_span && rises_s.is_finite()) {
            return Some(format!(
                "{told}, which is no span in the order of its flights"
            ));
        }
        before_s = rises_s;
        let Some(stands_m) = trajectory.position_m(0.5 * (lands_s + rises_s)) else {
            return Some(format!("{told}, but it is not there"));
        };
        let moves = trajectory
            .box_m(lands_s, rises_s)
            .is_none_or(|(low_m, high_m)| (high_m - low_m).norm() > SAME_PLACE_M);
        if moves {
            return Some(format!("{told}, but it moves"));
        }
        let gap_m = stands_m.z - scene.obstacles.support_z_m(&stands_m);
        if gap_m - drone.airframe.body_radius_m > LANDING_M + SAME_PLACE_M {
            return Some(format!("{told}, but nothing is under it"));
        }
    }
    None
}

/// Where a drone claims no wake although it has one.
fn airborne_contradictions(
    scene: &Scene<'_>,
    drone: &DronePlan,
    trajectory: &Trajectory,
    unplanned: bool,
) -> Vec<String> {
    let mut contradictions = Vec::new();
    let moves_s = trajectory.moves_s();
    let from_s = drone.airborne_s.0;
    let until_s = drone.airborne_s.1.unwrap_or(f64::INFINITY);
    if !from_s.is_finite() || until_s.is_nan() || until_s < from_s {
        return vec!["airborne_s is no span of time".to_owned()];
    }
    // Whether a place is a landing: the floor or a solid one body radius below, within a tolerance.
    let rests_at = |place_m: Point3<f64>, tolerance_m: f64| {
        let gap_m = place_m.z - scene.obstacles.support_z_m(&place_m);
        gap_m - drone.airframe.body_radius_m <= tolerance_m + SAME_PLACE_M
    };
    let rests = || rests_at(trajectory.last_m(), LANDING_M);
    if drone.at_start == AtStart::Landed && !rests_at(drone.trajectory.position_m[0], SUPPORT_M) {
        contradictions.push("it is said to start landed, but nothing is under it".to_owned());
    }
    if until_s == from_s {
        let waits_landed = drone.at_start == AtStart::Landed && moves_s.is_none();
        let gone_at_once =
            drone.at_end != AtEnd::Hover && !unplanned && trajectory.last_s() <= SAME_TIME_S;
        if !(waits_landed || gone_at_once && (drone.at_end == AtEnd::Leave || rests())) {
            contradictions.push("it is said never to be airborne, but it is not landed".to_owned());
        }
        return contradictions;
    }
    let enters_s = drone.enters_s.unwrap_or(0.0);
    if drone.at_start == AtStart::Hover && from_s > enters_s + SAME_TIME_S {
        contradictions.push(format!(
            "it starts in the air but is said to be airborne from {from_s:.3} s only"
        ));
    }
    let hidden = moves_s.is_some_and(|(first_s, last_s)| {
        first_s < from_s - SAME_TIME_S || last_s > until_s + SAME_TIME_S
    });
    if hidden {
        contradictions.push("it moves while it is said not to be airborne".to_owned());
    }
    match if unplanned {
        AtEnd::Hover
    } else {
        drone.at_end
    } {
        AtEnd::Hover if until_s.is_finite() => {
            contradictions.push(format!(
                "it hovers at its end but is said to be airborne until {until_s:.3} s only"
            ));
        }
        // A drone that has landed may leave later.
        AtEnd::Leave if until_s.is_finite() && rests() => {}
        AtEnd::Land | AtEnd::Leave if until_s < trajectory.last_s() - SAME_TIME_S => {
            contradictions.push(format!(
                "it is said to be airborne until {until_s:.3} s only, before its last time"
            ));
        }
        AtEnd::Land | AtEnd::Leave if until_s.is_infinite() => {
            let last_s = trajectory.last_s();
            contradictions.push(format!(
                "it is said to be airborne for good, its trajectory ends at {last_s:.3} s"
            ));
        }
        AtEnd::Land if until_s.is_finite() && !rests() => {
            contradictions.push("it is said to have landed, but nothing is under it".to_owned());
        }
        _ => {}
    }
    contradictions
}
