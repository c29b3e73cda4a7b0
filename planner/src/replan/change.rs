//! What may change while a plan is flown, and what is wrong with a change.

use std::collections::BTreeSet;

use nalgebra::Point3;
use thiserror::Error;

use super::{GivenError, given};
use crate::plan::cause::as_typed;
use crate::plan::{AtEnd, DronePlan, WRECK, failed};
use crate::scenario::WorldError;
use crate::scenario::limits::{BUSY_S, DELAY_S, name_fault};
use crate::scenario::placement::{
    SUPPORT_TOLERANCE_M, Spot, landing_place_m, lying_place_m, misplaced,
};
use crate::scenario::solid::Solids;
use crate::scenario::world::{AtStart, Drone, Task, World};
use crate::solver::prepare::ending_from;

/// Something that is not as the plan says, or shall not be any more.
#[derive(Clone, Debug)]
pub enum Change {
    /// A drone is behind its plan: where the plan had it `by_s` ago, and where it begins if it was
    /// nowhere then. It goes on from there at once.
    Late {
        /// Its name.
        drone: String,
        /// How far behind (s).
        by_s: f64,
    },
    /// A drone comes, to where it starts; one of another planner is planned here from now on, with
    /// the load that it has where it hovers there.
    Added(Drone),
    /// A drone is taken out, body and wake.
    Removed {
        /// Its name.
        drone: String,
    },
    /// A drone has failed and come down: its wake has ended, and its body lies there until that is
    /// removed, as `NAME (wreck)`, or `NAME (wreck 2)` where that is in the plan already.
    Failed {
        /// Its name.
        drone: String,
        /// Where its rotor plane's centre lies (m), on the floor or an obstacle; `None`: on the
        /// highest surface below where the plan has it.
        lies_m: Option<Point3<f64>>,
    },
    /// A drone of another planner flies this from now on, whatever is planned here: body and wake
    /// are moving obstacles. One that was planned here is the other's from now on.
    Fixed(Box<DronePlan>),
    /// A drone drops what it still had to do, and does this.
    Retasked {
        /// Its name.
        drone: String,
        /// From now on. What it does after the last stays as the scenario says; one that was told
        /// to land lands.
        tasks: Vec<Task>,
    },
    /// A drone drops what it still had to do, and lands.
    Landed {
        /// Its name.
        drone: String,
        /// Over which place (m); it comes down from there. `None`, of a drone that stands on the
        /// ground: it stays there.
        over_m: Option<Point3<f64>>,
    },
}

impl Change {
    /// The name of the drone that it is about.
    pub fn drone(&self) -> &str {
        match self {
            Change::Late { drone, .. }
            | Change::Removed { drone }
            | Change::Failed { drone, .. }
            | Change::Retasked { drone, .. }
            | Change::Landed { drone, .. } => drone,
            Change::Added(drone) => &drone.name,
            Change::Fixed(entry) => &entry.name,
        }
    }
}

/// The name of what lies where a drone came down, in the plan of these drones: a drone of that name
/// may have come down before.
pub(super) fn wreck_of(drone: &str, drones: &[Drone]) -> String {
    let numbered = (2_usize..).map(|nth| format!("{drone}{WRECK} {nth})"));
    let is_known = |name: &String| drones.iter().any(|it| it.name == *name);
    let first = format!("{drone}{WRECK})");
    let mut names = std::iter::once(first).chain(numbered);
    (names.find(|name| !is_known(name))).expect("there are more numbers than drones")
}

/// What is wrong with a change, or with the moment.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ChangeError {
    /// Not a time of a plan.
    #[error("{0} s is no time to plan from: times are from 0 to {high} s", high = BUSY_S.high)]
    Time(f64),
    /// Planned from later already.
    #[error("at {at_s:.2} s is before {known_s:.2} s, from when on this plan was made")]
    Past {
        /// Asked for (s).
        at_s: f64,
        /// Of the plan (s).
        known_s: f64,
    },
    /// No drone is called that.
    #[error("no drone is called `{0}`")]
    Unknown(String),
    /// A drone is called that already, or was.
    #[error("`{0}` is in the plan already; give the drone that comes another name")]
    Known(String),
    /// It lies where it came down, or is another planner's.
    #[error("`{0}` is not planned here: it has failed, or is another planner's")]
    Fixed(String),
    /// What another planner flies cannot be read, or is out of range.
    #[error(transparent)]
    Given(Box<GivenError>),
    /// More than one change.
    #[error("`{0}` changes twice; say all of it in one change")]
    Twice(String),
    /// It has left or was taken out, leaves before it could do anything else, or has not come yet.
    #[error("`{0}` is not there any more, or not yet")]
    Gone(String),
    /// Not a delay that can be.
    #[error(
        "`{drone}` cannot be {} s behind its plan: delays are from 0 to {high} s",
        as_typed(*by_s),
        high = DELAY_S.high
    )]
    Delay {
        /// The drone's name.
        drone: String,
        /// How far behind (s).
        by_s: f64,
    },
    /// A number that no scenario may have.
    #[error("{fault}")]
    Number {
        /// The drone's name.
        drone: String,
        /// What is wrong with which number.
        fault: Box<WorldError>,
    },
    /// A place where it cannot be.
    #[error("{why}")]
    Misplaced {
        /// The drone's name.
        drone: String,
        /// Which place, what obstructs it, and a place near it that would do, as a sentence.
        why: String,
    },
    /// Larger than all drones that the roadmap was made for.
    #[error(
        "the body of `{drone}` has a radius of {radius_m:.3} m, and the roadmap is made for {known_m:.3} m at most; \
         plan the whole scenario with it"
    )]
    TooLarge {
        /// The drone's name.
        drone: String,
        /// m.
        radius_m: f64,
        /// m.
        known_m: f64,
    },
}

/// What a drone does before it lands.
pub(super) fn landing(over_m: Option<Point3<f64>>) -> Vec<Task> {
    let task = |to_m| Task {
        to_m,
        dwell_s: 0.0,
        load_kg: None,
        during_s: None,
    };
    over_m.map(task).into_iter().collect()
}

/// What a drone does that drops all it had to do: in flight it comes to rest (m) before it sinks or
/// leaves.
pub(super) fn resting(at_end: AtEnd, at_m: Point3<f64>, grounded: bool) -> Vec<Task> {
    match at_end {
        AtEnd::Land | AtEnd::Leave if !grounded => landing(Some(at_m)),
        _ => Vec::new(),
    }
}

/// All that is wrong with these changes at a moment (s), on a roadmap for bodies of a radius (m);
/// `is_there` says which drones can still be changed, `goes_on` from where (m) one can still be
/// sent elsewhere, and whether it stands on the ground there, `is_fixed` which are not planned
/// here.
pub(super) fn problems(
    world: &World,
    solids: &Solids,
    (at_s, widest_m): (f64, f64),
    changes: &[Change],
    is_there: impl Fn(usize) -> bool,
    goes_on: impl Fn(usize) -> Option<(Point3<f64>, bool)>,
    is_fixed: impl Fn(usize) -> bool,
) -> Vec<ChangeError> {
    let mut found = Vec::new();
    let mut seen: BTreeSet<String> = BTreeSet::new();
    let mut placed: Vec<Drone> = Vec::new();
    let mut rests: BTreeSet<&str> = BTreeSet::new();
    for change in changes {
        let name = change.drone();
        if !seen.insert(name.to_owned()) {
            found.push(ChangeError::Twice(name.to_owned()));
        }
        let index = world.drones.iter().position(|drone| drone.name == name);
        match (change, index) {
            (Change::Added(_), Some(index)) if !is_fixed(index) || failed(name).is_some() => {
                found.push(ChangeError::Known(name.to_owned()))
            }
            (Change::Added(drone), _) => {
                let radius_m = drone.vehicle.body_radius_m;
                let known_m = widest_m - world.planning.gap_to_solids_m();
                if radius_m > known_m {
                    found.push(ChangeError::TooLarge {
                        drone: name.to_owned(),
                        radius_m,
                        known_m,
                    });
                }
                placed.push(drone.clone());
            }
            (Change::Fixed(entry), _) => {
                if let Err(error) = given(entry, world) {
                    found.push(ChangeError::Given(Box::new(error)));
                }
            }
            (_, None) => found.push(ChangeError::Unknown(name.to_owned())),
            (_, Some(index)) if !is_there(index) => found.push(ChangeError::Gone(name.to_owned())),
            (change, Some(index))
                if is_fixed(index) && !matches!(change, Change::Removed { .. }) =>
            {
                found.push(ChangeError::Fixed(name.to_owned()));
            }
            (Change::Failed { lies_m, .. }, Some(index)) => {
                let wreck = wreck_of(name, &world.drones);
                let fault = name_fault(&wreck).map(|fault| WorldError::Name {
                    owner: format!("the wreck of `{name}`"),
                    fault,
                });
                found.extend(fault.map(|fault| number(name, fault)));
                if !seen.insert(wreck.clone()) {
                    found.push(ChangeError::Twice(wreck));
                }
                // Whether a body fits there is not asked: it lies there.
                let radius_m = world.drones[index].vehicle.body_radius_m;
                let fault = |it| Some((it, lying_fault(world, solids, it, radius_m)?));
                let fault = lies_m.and_then(fault);
                found.extend(fault.map(|(it, what)| ChangeError::Misplaced {
                    drone: name.to_owned(),
                    why: format!("`{name}` lies at ({}, {}, {}) m, {what}", it.x, it.y, it.z),
                }));
            }
            (Change::Late { by_s, .. }, _) if !DELAY_S.contain(*by_s) => {
                found.push(ChangeError::Delay {
                    drone: name.to_owned(),
                    by_s: *by_s,
                });
            }
            (Change::Retasked { .. } | Change::Landed { .. }, Some(index)) => {
                let Some((at_m, grounded)) = goes_on(index) else {
                    found.push(ChangeError::Gone(name.to_owned()));
                    continue;
                };
                let known = &world.drones[index];
                let (mut tasks, at_end) = match change {
                    Change::Retasked { tasks, .. } => (tasks.clone(), known.at_end),
                    Change::Landed { over_m, .. } => (landing(*over_m), AtEnd::Land),
                    _ => continue,
                };
                if tasks.is_empty() {
                    tasks = resting(at_end, at_m, grounded);
                    rests.insert(name);
                }
                // Where it is now is not asked.
                placed.extend(tasks.first().map(|task| task.to_m).map(|start_m| Drone {
                    tasks,
                    start_m,
                    at_start: AtStart::Hover,
                    at_end,
                    ..known.clone()
                }));
            }
            _ => {}
        }
    }
    let known = |name: &str| world.drones.iter().position(|known| known.name == name);
    let comes = |name: &str| known(name).is_none_or(&is_fixed);
    let faults = placed.iter().flat_map(|drone| {
        let is_there = known(&drone.name).filter(|_| !comes(&drone.name));
        let start_m = is_there.map_or(drone.start_m, |it| world.drones[it].start_m);
        let mut faults = world.faults_of(
            &Drone {
                start_m,
                ..drone.clone()
            },
            at_s,
        );
        faults.extend(world.slow_to_stop(drone));
        let faults = faults.into_iter();
        faults.map(move |fault| number(&drone.name, fault))
    });
    found.extend(faults);
    placed.retain(|drone| {
        let goals_m = drone.tasks.iter().map(|task| task.to_m);
        let mut places_m = goals_m.chain([drone.start_m]);
        places_m.all(|at_m| at_m.iter().all(|c| c.is_finite()))
    });
    let placed = World {
        drones: placed,
        ..world.clone()
    };
    let mut reported: BTreeSet<&str> = BTreeSet::new();
    let mut report = |name: &str, why: String| {
        let drone = name.to_owned();
        found.push(ChangeError::Misplaced { drone, why });
    };
    for it in misplaced(&placed, solids) {
        let name = &placed.drones[it.drone].name;
        // Where a drone that is there already starts, or comes to rest, is not asked.
        let is_asked = match it.spot {
            Spot::Start => comes(name),
            Spot::Task(_) => !rests.contains(&name[..]),
            Spot::Landing => true,
        };
        if is_asked {
            reported.insert(name);
            report(name, it.words(&placed).to_string());
        }
    }
    for drone in &placed.drones {
        let name = &drone.name;
        let last_m = drone.tasks.last().map_or(drone.start_m, |task| task.to_m);
        if let Err(lacks) = ending_from(&placed, solids, drone, last_m)
            && !reported.contains(name.as_str())
        {
            report(
                name,
                format!("the descent of `{name}` to its pad lacks {lacks}"),
            );
        }
    }
    found
}

fn number(drone: &str, fault: WorldError) -> ChangeError {
    ChangeError::Number {
        drone: drone.to_owned(),
        fault: Box::new(fault),
    }
}

/// What is wrong with a place (m) for a wreck of a radius (m): a plan knows none in mid-air.
fn lying_fault(
    world: &World,
    solids: &Solids,
    lies_m: Point3<f64>,
    radius_m: f64,
) -> Option<String> {
    let (min, max) = (world.bounds_m.min, world.bounds_m.max);
    if !(0..3).all(|k| min[k] <= lies_m[k] && lies_m[k] <= max[k]) {
        return Some("which is outside the bounds".to_owned());
    }
    let rest_m = landing_place_m(&world.bounds_m, solids, lies_m, radius_m);
    let gap_m = lies_m.z - rest_m.z;
    let is_inside = Solids::new(&world.obstacles).distance_to_point_m(lies_m).0 < 0.0;
    if gap_m <= SUPPORT_TOLERANCE_M && !is_inside {
        return None;
    }
    Some(
        match lying_place_m(world, lies_m, radius_m).map(|it| it.z) {
            Some(z_m) if z_m > lies_m.z => {
                format!("in an obstacle: say a height of {z_m:.3} m, or no place")
            }
            Some(z_m) => format!(
                "{gap_m:.3} m above what it could lie on: say a height of {z_m:.3} m, or no place"
            ),
            None => "where it has no room to lie: say no place".to_owned(),
        },
    )
}
