//! What blows into a box: wakes from above, and the wall jets that they become along the floor.
//!
//! Wakes from above add up as the plan says, wall jets as vectors. A wall jet spreads along the floor from below every airborne drone,
//! whatever stands between them.

use airflow::effects::GroundImpingement;
use airflow::{Source, Superposition, Wake, axial_speed_mps};
use nalgebra::{Point3, Vector3};

use super::flight::{level_gap_m, superpose};
use super::late::Late;
use super::wake_bound::BoundedWake;
use super::wake_end::Stops;
use super::zone::Peak;
use crate::plan::trajectory::Motion;

type Places = (Vector3<f64>, Vector3<f64>);

/// A wake that may blow into a box.
pub(crate) struct Blow<'a> {
    /// Whose: an index of the caller's.
    pub(crate) from: usize,
    pub(crate) wake: &'a BoundedWake,
    pub(crate) motion: Motion,
    pub(crate) stops: &'a [u32],
    /// Where air takes its time: the whole flight, in place of the wake, its stops and its motion, which lasts as long as its air.
    pub(crate) late: Option<Late<'a>>,
}

impl Blow<'_> {
    pub(super) fn max_speed_mps(&self) -> f64 {
        (self.late.as_ref()).map_or_else(|| self.motion.max_speed_mps(), Late::fastest_mps)
    }
}

/// What all searches of one caller share.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    pub(crate) stops: &'a Stops,
    pub(crate) superposition: Superposition,
    /// Where jets that meet the floor spread along it.
    pub(crate) wall: Option<Wall>,
}

/// The floor and what becomes of a jet there.
#[derive(Clone, Copy)]
pub(crate) struct Wall {
    pub(crate) effect: GroundImpingement,
    pub(crate) floor_z_m: f64,
}

/// Speed from above and along the floor (m/s).
type Speeds = (f64, f64);

fn higher(a: Speeds, b: Speeds) -> Speeds {
    (a.0.max(b.0), a.1.max(b.1))
}

/// An upper bound of one wake over places and a span of time (m/s).
pub(crate) fn high_mps(
    field: &Field<'_>,
    blow: &Blow<'_>,
    places_m: &Places,
    span_s: (f64, f64),
) -> f64 {
    let (above_mps, along_mps) = highs_mps(field, blow, places_m, span_s);
    above_mps.hypot(along_mps)
}

/// An upper bound of all wakes over places and a span of time (m/s).
pub(super) fn together_mps(
    field: &Field<'_>,
    blows: &[&Blow<'_>],
    places_m: &Places,
    span_s: (f64, f64),
) -> f64 {
    let all: Vec<Speeds> = blows
        .iter()
        .map(|blow| highs_mps(field, blow, places_m, span_s))
        .collect();
    let above_mps = superpose(field.superposition, all.iter().map(|(above, _)| *above));
    if field.wall.is_none() {
        return above_mps;
    }
    above_mps.hypot(all.iter().map(|(_, along)| along).sum())
}

fn highs_mps(field: &Field<'_>, blow: &Blow<'_>, places_m: &Places, span_s: (f64, f64)) -> Speeds {
    let along_mps = |wake: &Wake, from_m: &Places| {
        field.wall.map_or(0.0, |wall| {
            let floor_z_m = wall.floor_z_m;
            (wall.effect).highest_between_mps(wake, floor_z_m, from_m, places_m)
        })
    };
    if let Some(late) = &blow.late {
        let left = late.left(span_s, (places_m.0.z, places_m.1.z));
        let highs = left.iter().map(|left| {
            let along_mps = along_mps(&left.wake.wake, &left.places_m);
            let (lowest_m, _) =
                (field.stops).end_range_m(&left.wake.wake, &left.places_m, left.stops);
            if places_m.1.z < lowest_m - airflow::HEIGHT_TOLERANCE_M {
                return (0.0, along_mps);
            }
            (left.highest_mps(&left.offsets_m(places_m)), along_mps)
        });
        return highs.fold((0.0, 0.0), higher);
    }
    let from_m = blow.motion.box_m(span_s.0, span_s.1);
    let along_mps = along_mps(&blow.wake.wake, &from_m);
    let depths_m = (from_m.0.z - places_m.1.z, from_m.1.z - places_m.0.z);
    let (lowest_m, _) = field
        .stops
        .end_range_m(&blow.wake.wake, &from_m, blow.stops);
    if depths_m.1 <= 0.0 || places_m.1.z < lowest_m - airflow::HEIGHT_TOLERANCE_M {
        return (0.0, along_mps);
    }
    let near_m = level_gap_m(&from_m, places_m);
    let middle_s = 0.5 * (span_s.0 + span_s.1);
    let half_way_m =
        blow.motion.half_path_m(span_s.0, span_s.1) + 0.5 * (places_m.1 - places_m.0).norm();
    let middle_m = 0.5 * (places_m.0 + places_m.1) - blow.motion.at_m(middle_s);
    let offsets_m = (places_m.0 - from_m.1, places_m.1 - from_m.0);
    let above_mps = blow
        .wake
        .high_mps(depths_m, near_m, &offsets_m, &middle_m, half_way_m);
    (above_mps, along_mps)
}

/// Where the air of one wake at a height and time comes from; several where its drone sinks faster than its air.
fn sources<'s>(field: &Field<'_>, blow: &'s Blow<'s>, t_s: f64, z_m: f64) -> Vec<Source<'s>> {
    if let Some(late) = &blow.late {
        return late.sources(field.stops, t_s, z_m);
    }
    let position_m = Point3::from(blow.motion.at_m(t_s));
    let wake = &blow.wake.wake;
    vec![Source {
        wake,
        position_m,
        ends_at_z_m: field.stops.end_z_m(wake, &position_m, blow.stops),
    }]
}

/// One wake at one place and time: from above (m/s), and along the floor (m/s, x and y).
fn one_mps(
    field: &Field<'_>,
    blow: &Blow<'_>,
    t_s: f64,
    place_m: Point3<f64>,
) -> (f64, Vector3<f64>) {
    let (mut above_mps, mut along_mps) = (0.0_f64, Vector3::zeros());
    for source in sources(field, blow, t_s, place_m.z) {
        above_mps = above_mps.max(axial_speed_mps(&[source], place_m, field.superposition));
        let Some(wall) = &field.wall else { continue };
        let height_m = source.position_m.z - wall.floor_z_m;
        let offset_m = place_m - source.position_m;
        let [x, y] = wall.effect.outward_mps(source.wake, height_m, offset_m);
        let here_mps = Vector3::new(x, y, 0.0);
        if here_mps.norm() > along_mps.norm() {
            along_mps = here_mps;
        }
    }
    (above_mps, along_mps)
}

/// All wakes at one place and time (m/s).
pub(super) fn at_mps(
    field: &Field<'_>,
    blows: &[&Blow<'_>],
    t_s: f64,
    place_m: Point3<f64>,
) -> f64 {
    let all: Vec<_> = blows
        .iter()
        .map(|blow| one_mps(field, blow, t_s, place_m))
        .collect();
    let above_mps = superpose(field.superposition, all.iter().map(|(above, _)| *above));
    let along_mps: Vector3<f64> = all.iter().map(|(_, along)| along).sum();
    above_mps.hypot(along_mps.norm())
}

/// Whose wake is the strongest at a peak.
pub(crate) fn strongest(field: &Field<'_>, blows: &[&Blow<'_>], peak: &Peak) -> Option<usize> {
    let alone = blows.iter().map(|blow| {
        let (above_mps, along_mps) = one_mps(field, blow, peak.t_s, peak.place_m);
        (blow.from, above_mps.hypot(along_mps.norm()))
    });
    alone
        .reduce(|a, b| if b.1 > a.1 { b } else { a })
        .map(|(from, _)| from)
}
