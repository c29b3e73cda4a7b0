//! A judge that only samples: every 20 ms, the far field alone, its formula written again here.
//!
//! It sees less than the verifier (no near field, nothing between samples), but it owes it nothing:
//! whatever it finds above a limit is there.

use nalgebra::Point3;
use planner::plan::{AtEnd, DronePlan, Plan, Solid};

const STEP_S: f64 = 0.02;
const GRAVITY_MPS2: f64 = 9.81;
/// The verifier forgives a thousandth of the induced velocity.
const AIR_TOLERANCE: f64 = 1e-3;
/// The verifier forgives a millimetre between bodies.
const TOUCH_M: f64 = 1e-3;
/// The verifier leaves out single wakes below this (m/s), so does the sampler.
const FAINT_MPS: f64 = 0.01;
/// The verifier forgives half a percent in a zone.
const ZONE_TOLERANCE: f64 = 5e-3;

/// One drone at one moment.
struct Now<'a> {
    drone: &'a DronePlan,
    at_m: Point3<f64>,
    flying: bool,
    induced_mps: f64,
    wake_end_z_m: f64,
}

/// Asserts that no sample of the plan breaks a limit, and that no drone met more air than the plan
/// says.
pub(crate) fn assert_safe(plan: &Plan) {
    let last_s = plan
        .drones
        .iter()
        .filter_map(|drone| drone.trajectory.t_s.last().copied())
        .fold(0.0, f64::max);
    // One second more: drones that hover at their goals hover on.
    for step in 0..=((last_s + 1.0) / STEP_S) as usize {
        judge(plan, step as f64 * STEP_S);
    }
}

fn judge(plan: &Plan, now_s: f64) {
    let present: Vec<Now> = plan
        .drones
        .iter()
        .filter_map(|drone| now(plan, drone, now_s))
        .collect();
    for (index, me) in present.iter().enumerate() {
        bounds_and_obstacles(plan, me, now_s);
        for other in &present[..index] {
            let gap_m = (me.at_m - other.at_m).norm()
                - me.drone.airframe.body_radius_m
                - other.drone.airframe.body_radius_m;
            let names = (&me.drone.name, &other.drone.name);
            assert!(gap_m >= -TOUCH_M, "{names:?} touch at {now_s} s: {gap_m} m");
        }
        if !me.flying {
            continue;
        }
        let air_mps = air_on(plan, me, &present);
        assert!(
            air_mps <= (me.drone.air_limit + AIR_TOLERANCE) * me.induced_mps,
            "`{}` meets {air_mps} m/s at {now_s} s, limit {} of {} m/s",
            me.drone.name,
            me.drone.air_limit,
            me.induced_mps
        );
        // What the plan reports is good to a thousandth; of advected wakes it is of the mean delay.
        assert!(
            !plan.quasi_static
                || air_mps <= me.drone.worst_air_mps * 1.002 + AIR_TOLERANCE * me.induced_mps,
            "`{}` meets {air_mps} m/s at {now_s} s, but the plan says {} at worst",
            me.drone.name,
            me.drone.worst_air_mps
        );
        for other in present.iter().filter(|other| other.flying) {
            assert!(
                !in_column(me, other),
                "`{}` is in the column of `{}` at {now_s} s",
                me.drone.name,
                other.drone.name
            );
        }
    }
    zones(plan, &present, now_s);
}

fn now<'a>(plan: &Plan, drone: &'a DronePlan, now_s: f64) -> Option<Now<'a>> {
    let track = &drone.trajectory;
    let gone = drone.at_end == AtEnd::Leave && now_s >= *track.t_s.last()?;
    if gone {
        return None;
    }
    let (from_s, until_s) = drone.airborne_s;
    let piece = track.t_s.partition_point(|t_s| *t_s <= now_s).max(1) - 1;
    let frame = &drone.airframe;
    let radius_m = frame.propeller_diameter_m / 2.0;
    let discs_m2 = f64::from(frame.propellers) * std::f64::consts::PI * radius_m * radius_m;
    let weight_n = track.mass_kg[piece] * GRAVITY_MPS2;
    let at_m = track.position_m(now_s)?;
    Some(Now {
        drone,
        at_m,
        flying: from_s <= now_s && until_s.is_none_or(|until_s| now_s < until_s),
        induced_mps: (weight_n / (2.0 * plan.air.density_kg_per_m3 * discs_m2)).sqrt(),
        wake_end_z_m: wake_end_z_m(plan, drone, at_m),
    })
}

/// `(s/l - s₀) l` with `s` at least 2.5 l.
fn past_origin_m(plan: &Plan, drone: &DronePlan, depth_m: f64) -> f64 {
    let l = drone.airframe.motor_distance_m;
    depth_m.max(2.5 * l) - plan.air.jet.origin * l
}

fn half_width_m(plan: &Plan, drone: &DronePlan, depth_m: f64) -> f64 {
    drone.airframe.width_factor * plan.air.jet.spreading * past_origin_m(plan, drone, depth_m)
}

/// The paper's far field: `U_C = U_H B l / (q (s - s₀ l))`,
/// `U = U_C / (1 + (√2 - 1)(r / r_half)²)²`.
fn far_field_mps(plan: &Plan, emitter: &Now, point_m: Point3<f64>) -> f64 {
    let l = emitter.drone.airframe.motor_distance_m;
    let depth_m = emitter.at_m.z - point_m.z;
    if depth_m < 2.5 * l {
        return 0.0;
    }
    let centre_mps = emitter.induced_mps * plan.air.jet.centreline * l
        / (emitter.drone.airframe.width_factor * past_origin_m(plan, emitter.drone, depth_m));
    let xi = (point_m - emitter.at_m).xy().norm() / half_width_m(plan, emitter.drone, depth_m);
    centre_mps / (1.0 + (std::f64::consts::SQRT_2 - 1.0) * xi * xi).powi(2)
}

fn superposed(plan: &Plan, wakes_mps: impl Iterator<Item = f64>) -> f64 {
    let wakes_mps = wakes_mps.filter(|speed| *speed >= FAINT_MPS);
    match plan.air.superposition.as_str() {
        "momentum" => wakes_mps.map(|speed| speed * speed).sum::<f64>().sqrt(),
        "linear" => wakes_mps.sum(),
        "strongest" => wakes_mps.fold(0.0, f64::max),
        other => panic!("unknown superposition {other}"),
    }
}

/// Hubs at 45° and every further share of a turn; on each disc the centre (1/4) and six points at
/// √(2/3) of the radius (1/8 each).
fn air_on(plan: &Plan, me: &Now, present: &[Now]) -> f64 {
    let above: Vec<&Now> = present
        .iter()
        .filter(|other| !std::ptr::eq(*other, me) && other.flying)
        .filter(|other| other.at_m.z > me.at_m.z && me.at_m.z >= other.wake_end_z_m - 1e-6)
        .collect();
    if above.is_empty() {
        return 0.0;
    }
    let frame = &me.drone.airframe;
    let turn = std::f64::consts::TAU;
    let mut mean_mps = 0.0;
    for hub in 0..frame.propellers {
        let azimuth = turn / 8.0 + turn * f64::from(hub) / f64::from(frame.propellers);
        let ring_m = (2.0_f64 / 3.0).sqrt() * frame.propeller_diameter_m / 2.0;
        for k in 0..7 {
            let (weight, off_m) = if k == 0 { (0.25, 0.0) } else { (0.125, ring_m) };
            let around = turn * f64::from(k) / 6.0;
            let mut point_m = me.at_m;
            point_m.x += frame.motor_distance_m / 2.0 * azimuth.cos() + off_m * around.cos();
            point_m.y += frame.motor_distance_m / 2.0 * azimuth.sin() + off_m * around.sin();
            let wakes = above
                .iter()
                .map(|other| far_field_mps(plan, other, point_m));
            mean_mps += weight * superposed(plan, wakes) / f64::from(frame.propellers);
        }
    }
    mean_mps
}

fn in_column(me: &Now, other: &Now) -> bool {
    let frame = &other.drone.airframe;
    let tips_m = (frame.motor_distance_m + frame.propeller_diameter_m) / 2.0;
    let depth_m = other.at_m.z - me.at_m.z;
    // A micrometre is forgiven on every side.
    depth_m > 1e-6
        && depth_m < 2.5 * frame.motor_distance_m - 1e-6
        && (me.at_m - other.at_m).xy().norm() < tips_m - 1e-6
        && me.at_m.z >= other.wake_end_z_m
}

/// The floor, or the highest top face below that holds the whole half-width disc.
fn wake_end_z_m(plan: &Plan, drone: &DronePlan, at_m: Point3<f64>) -> f64 {
    let tops = plan
        .obstacles
        .iter()
        .filter_map(|obstacle| match &obstacle.shape {
            Solid::Box { min_m, max_m } => {
                let margins = [
                    at_m.x - min_m.x,
                    max_m.x - at_m.x,
                    at_m.y - min_m.y,
                    max_m.y - at_m.y,
                ];
                Some((max_m.z, margins.into_iter().fold(f64::INFINITY, f64::min)))
            }
            Solid::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => Some((base_m.z + height_m, radius_m - (at_m - base_m).xy().norm())),
            Solid::Mesh { .. } => None,
        });
    tops.filter(|(top_z_m, margin_m)| {
        *top_z_m < at_m.z && half_width_m(plan, drone, at_m.z - top_z_m) <= *margin_m
    })
    .map(|(top_z_m, _)| top_z_m)
    .fold(plan.bounds_m.min.z, f64::max)
}

fn bounds_and_obstacles(plan: &Plan, me: &Now, now_s: f64) {
    let name = &me.drone.name;
    for axis in 0..3 {
        let inside = plan.bounds_m.min[axis] - 1e-6..=plan.bounds_m.max[axis] + 1e-6;
        assert!(
            inside.contains(&me.at_m[axis]),
            "`{name}` is out of bounds at {now_s} s"
        );
    }
    for obstacle in &plan.obstacles {
        let distance_m = match &obstacle.shape {
            Solid::Box { min_m, max_m } => {
                let nearest = me.at_m.coords.sup(&min_m.coords).inf(&max_m.coords);
                (me.at_m.coords - nearest).norm()
            }
            Solid::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => {
                let aside_m = ((me.at_m - base_m).xy().norm() - radius_m).max(0.0);
                let up_m = me.at_m.z - base_m.z;
                aside_m.hypot((up_m - height_m).max(-up_m).max(0.0))
            }
            Solid::Mesh { .. } => continue,
        };
        // Resting on something: half a centimetre, the rounding of typed coordinates.
        assert!(
            distance_m >= me.drone.airframe.body_radius_m - 5e-3 - TOUCH_M,
            "`{name}` is {distance_m} m from `{}` at {now_s} s",
            obstacle.name
        );
    }
}

fn zones(plan: &Plan, present: &[Now], now_s: f64) {
    for zone in &plan.zones {
        let steps =
            |axis: usize| (((zone.max_m[axis] - zone.min_m[axis]) / 0.4).ceil() as usize).max(1);
        let along = |axis: usize, k: usize| {
            let share = k as f64 / steps(axis) as f64;
            zone.min_m[axis] + share * (zone.max_m[axis] - zone.min_m[axis])
        };
        for (i, j, k) in (0..=steps(0))
            .flat_map(|i| (0..=steps(1)).flat_map(move |j| (0..=steps(2)).map(move |k| (i, j, k))))
        {
            let point_m = Point3::new(along(0, i), along(1, j), along(2, k));
            let blowing = present
                .iter()
                .filter(|it| it.flying && it.wake_end_z_m <= point_m.z)
                .map(|it| far_field_mps(plan, it, point_m));
            let air_mps = superposed(plan, blowing);
            let limit_mps = zone.air_limit_mps.unwrap_or(f64::INFINITY);
            assert!(
                air_mps <= limit_mps * (1.0 + ZONE_TOLERANCE),
                "{air_mps} m/s in `{}` at {point_m} at {now_s} s, it allows {}",
                zone.name,
                limit_mps
            );
        }
    }
}
