//! What a search answers: a path, or an obstruction.

use costmap::leg::{DroneId, Leg, Tick};
use costmap::verdict::Why;
use nalgebra::Point3;

/// A path from start to end.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Path {
    /// Back to back from where its agent begins; the last one may last until the end.
    pub(crate) legs: Vec<Leg>,
    /// End of the last dwell.
    pub(crate) arrives: Tick,
    /// Evicted drones.
    pub(crate) evicted: Vec<DroneId>,
}

impl Path {
    /// A path that evicts no drone.
    pub(crate) fn new(legs: Vec<Leg>, arrives: Tick) -> Path {
        Path {
            legs,
            arrives,
            evicted: Vec::new(),
        }
    }
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum SearchOutcome {
    /// The cheapest path.
    Path(Path),
    /// None, and the obstruction closest to the goal.
    Blocked(Option<Obstruction>),
    /// Told to stop.
    Stopped,
}

/// What blocks a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Obstruction {
    /// Drone or zone.
    pub(crate) by: Obstructor,
    /// Where the drone could get to, or where it meets the other as it lands (m).
    pub(crate) at_m: Point3<f64>,
    /// It obstructed the landing.
    pub(crate) lands: bool,
    /// When it would have gone on.
    pub(crate) at: Tick,
    /// Ticks that were left to fly.
    pub(super) remaining: u32,
}

impl Obstruction {
    /// That a drone's wake is too strong for a zone where its task is (m), at a moment.
    pub(crate) fn at_task(zone: usize, at_m: Point3<f64>, at: Tick) -> Obstruction {
        Obstruction {
            by: Obstructor::Zone(zone),
            at_m,
            lands: false,
            at,
            remaining: 0,
        }
    }
}

/// What can obstruct a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Obstructor {
    /// Another drone, and how.
    Drone(DroneId, Why),
    /// A zone (its index) that the drone's own wake is too strong for.
    Zone(usize),
}

/// Result and effort of one search.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Searched {
    /// What was found.
    pub(crate) found: SearchOutcome,
    /// States expanded.
    pub(crate) expansions: u64,
}

/// Joins stays that follow one another at one place.
pub(crate) fn joined(legs: Vec<Leg>) -> Vec<Leg> {
    let mut joined: Vec<Leg> = Vec::with_capacity(legs.len());
    for leg in legs {
        match joined.last_mut() {
            Some(last)
                if last.stays()
                    && leg.stays()
                    && last.from_m == leg.from_m
                    && last.kind == leg.kind
                    && last.flying == leg.flying =>
            {
                last.end = leg.end;
            }
            _ => joined.push(leg),
        }
    }
    joined
}
