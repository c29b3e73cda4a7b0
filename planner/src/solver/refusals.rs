//! Drones to be refused are tried again first: on other cells, mostly finer ones, and with the
//! verifier's judgement in place of the search's bounds. So a "no" is about the place, as far as it
//! was looked at, and not about the lattice.
//!
//! Small fleets are planned again whole; then, and in large ones, the refused with their blockers
//! among all others as they are. All of it within a budget of states.

use std::collections::BTreeMap;

use costmap::leg::DroneId;
use rayon::prelude::*;

use crate::graph::lattice::Spacing;
use crate::plan::cause::Extent;
use crate::plan::outcome::{Control, Effort};
use crate::scenario::limits::lattice_places;
use crate::scenario::world::World;
use crate::sipp::search::{
    IMMOVABLE, Obstruction, Obstructor, SearchOutcome, SearchSetting, search,
};
use crate::solver::lanes;
use crate::solver::prepare::Job;
use crate::solver::priority::{
    FailureKind, MOST_SMALL, Paths, UNTABULATED_LATE_STATES, UNTABULATED_STATES, is_far_from_bound,
    score,
};
use crate::solver::subfleet::{Prepared, Replanned, Subfleet, Terms};

/// Cells are not made smaller (m): chosen here, what a drone can hold its place to.
const LEAST_CELL_M: f64 = 0.1;
/// Lattices of more places are not made: chosen here, a second of work.
const MOST_PLACES: f64 = 150_000.0;
/// States for all that is tried for one group: chosen here, some seconds of work.
const MOST_EXPANSIONS: u64 = 100_000;
/// The same where air takes time, or no table answers for steps, as beside zones: chosen here, as
/// much work.
const MOST_DEAR_EXPANSIONS: u64 = 16_000;
/// Plans with higher bounds that the verifier is asked about for one group: chosen here, up to a
/// second of work each.
const MOST_JUDGED: usize = 3;
/// On so many lattices for one group the range between bounds that are too low and those by which
/// the verifier refuses a plan is bisected, and how often: chosen here, to a few percent of the
/// limit.
const MOST_NARROWED: usize = 2;
const MOST_HALVINGS: usize = 3;
/// On what is tried in turn: into how many parts cells are divided, and how many times their limits
/// drones and zones may reach by the bounds of the search, where the verifier decides. Chosen here:
/// bounds on one wake over the discs are a few percent above it, those on several whose speeds add
/// up are up to half as much again, those on a whole zone up to twice. Lanes that halves do not
/// have thirds or two fifths may, or larger cells: two drones may pass one another between walls
/// where there is no place half-way.
const WHOLE: [(f64, [f64; 2]); 16] = [
    (2.0, [1.0, 1.0]),
    (1.0, [1.1, 1.2]),
    (1.0, [1.45, 1.5]),
    (COARSER, [1.0, 1.0]),
    (2.5, [1.0, 1.0]),
    (4.0, [1.0, 1.0]),
    (3.0, [1.45, 1.5]),
    (2.5, [1.45, 1.5]),
    (2.0, [1.1, 1.2]),
    (2.0, [1.45, 1.5]),
    (4.0, [2.0, 2.5]),
    (1.0, [1.25, 1.0]),
    (1.0, [2.0, 2.5]),
    (8.0, [1.0, 1.0]),
    (2.0, [2.0, 2.5]),
    (4.0, [1.25, 1.5]),
];
/// Larger cells that are tried: chosen here, two fifths of a metre for a quarter.
const COARSER: f64 = 0.625;
/// The same of a few among all others: chosen here.
const GROUP: [(f64, [f64; 2]); 6] = [
    (2.0, [1.0, 1.0]),
    (1.0, [1.1, 1.2]),
    (1.0, [1.45, 1.5]),
    (4.0, [1.0, 1.0]),
    (1.0, [1.75, 1.0]),
    (1.0, [2.0, 2.5]),
];
/// States for the next attempt, an eighth of them without tables, if so many are left: chosen here,
/// what a few drones need.
const EXPANSIONS_OF_ONE: u64 = 20_000;
/// The same of a whole small fleet on larger cells: chosen here, a second or two of work; for eight
/// drones that pass one another in a tunnel with bays, on cells of 0.4 m, 20 000 are too few.
const EXPANSIONS_OF_FLEET: u64 = 100_000;
/// The same along the sides of gaps, where drones pass at once or not at all: chosen here.
const EXPANSIONS_OF_LANES: u64 = 5_000;
/// For how many groups it is tried: chosen here.
const MOST_GROUPS: usize = 3;
/// Groups larger than this are not looked at as one: chosen here.
pub(crate) const LARGEST_GROUP: usize = 6;
/// States of a search for an obstruction: chosen here, a second of work.
const MOST_OBSTRUCTION_EXPANSIONS: u64 = 20_000;
/// The same where air takes time: chosen here, as much work.
const MOST_LATE_OBSTRUCTION_EXPANSIONS: u64 = 2_000;
/// For how many refused drones the obstruction is asked for: chosen here.
const MOST_ASKED: usize = 12;

/// Drones that were planned together again, and how far that went.
#[derive(Clone, Debug)]
pub(crate) struct RetriedGroup {
    /// Ascending.
    pub(crate) drones: Vec<DroneId>,
    /// How far missing paths were searched for.
    pub(crate) extent: Extent,
}

/// Plans again what would be refused, on cells divided into so many parts at most; what was tried,
/// group by group.
pub(crate) fn retry_refused(
    world: &World,
    job: &mut Job,
    mut paths: Paths,
    (control, most_parts): (&Control<'_>, f64),
    effort: &mut Effort,
) -> (Paths, Vec<RetriedGroup>) {
    let mut tried: Vec<RetriedGroup> = Vec::new();
    let mut answered = AnsweredQuestions::default();
    if job.agents.len() <= MOST_SMALL && is_refused(job, &paths) {
        let helpless = |drone: DroneId| {
            let mut unplanned = paths.unplanned.iter();
            unplanned.any(|refused| refused.0 == drone && !may_be_helped(job, refused))
        };
        let all = job.agents.iter().map(|agent| agent.drone);
        let drones: Vec<DroneId> = all.filter(|drone| !helpless(*drone)).collect();
        let whole = Refused {
            world,
            control,
            drones: &drones,
            attempts: &WHOLE,
            most_parts,
        };
        let extent = whole.retry_group(job, &mut paths, &mut answered, effort);
        tried.push(RetriedGroup { drones, extent });
    }
    for drones in groups(job, &paths, control) {
        let group = Refused {
            world,
            control,
            drones: &drones,
            attempts: &GROUP,
            most_parts,
        };
        let extent = group.retry_group(job, &mut paths, &mut answered, effort);
        tried.push(RetriedGroup { drones, extent });
    }
    (paths, tried)
}

/// Plans a small fleet that is slow for what it has to do on finer and larger cells, too, and takes
/// the better.
pub(crate) fn planned_on_other_cells(
    world: &World,
    job: &mut Job,
    mut paths: Paths,
    control: &Control<'_>,
    effort: &mut Effort,
) -> Paths {
    let chosen: Vec<DroneId> = job.agents.iter().map(|agent| agent.drone).collect();
    let on_cells = |parts: f64| divided_cells_m(world, parts).map(Spacing::of);
    let finer = [2.0, 4.0].into_iter().map_while(on_cells);
    let lanes = std::iter::once_with(|| lanes_of(world, &chosen)).flatten();
    for spacing in finer.chain(lanes).chain(on_cells(COARSER)) {
        if !is_far_from_bound(job, &paths) || !paths.unplanned.is_empty() || (control.stop)() {
            break;
        }
        let subfleet = Subfleet {
            world,
            job,
            paths: &paths,
            chosen: &chosen,
            control,
            prepared: &Prepared::default(),
        };
        let terms = Terms {
            spacing,
            raised: [1.0; 2],
            most_expansions: match spacing.cell_m > world.planning.cell_m {
                true => EXPANSIONS_OF_FLEET,
                false => EXPANSIONS_OF_ONE,
            },
            improves: true,
        };
        let found = subfleet.replanned(&terms, effort);
        if let Some(found) = found.filter(|found| score(&found.paths) < score(&paths)) {
            paths = found.paths.clone();
            found.note_lower_bounds(&chosen, job);
        }
    }
    paths
}

/// Whether there are drones that another try might help.
fn is_refused(job: &Job, paths: &Paths) -> bool {
    let mut unplanned = paths.unplanned.iter();
    unplanned.any(|refused| may_be_helped(job, refused))
}

/// Whether another lattice, or a closer look, could help.
fn may_be_helped(job: &Job, (drone, why): &(DroneId, FailureKind)) -> bool {
    match why {
        FailureKind::NoPath | FailureKind::Zone(_) => !job.is_closed(*drone),
        FailureKind::Obstructed(_) => true,
        FailureKind::Late(..) => {
            let agent = &job.agents[drone.0 as usize];
            agent.comes_late(&job.roadmap).is_none()
        }
        FailureKind::EndpointConflict | FailureKind::Landing(_) | FailureKind::Stopped => false,
    }
}

/// Drones planned together again among all others: the refused with their blockers.
fn groups(job: &Job, paths: &Paths, control: &Control<'_>) -> Vec<Vec<DroneId>> {
    if !is_refused(job, paths) || (control.stop)() {
        return Vec::new();
    }
    let refused = paths.unplanned.iter().filter(|it| may_be_helped(job, it));
    let refused: Vec<&(DroneId, FailureKind)> = refused.take(MOST_ASKED).collect();
    // A drone that a zone stops alone is stopped among others, too.
    let alone = |(drone, why): &&&(DroneId, FailureKind)| match why {
        FailureKind::Zone(by) => Some((*drone, Some(*by))),
        _ => None,
    };
    let open = refused.iter().filter(|it| alone(it).is_none());
    let open: Vec<DroneId> = open.map(|(drone, _)| *drone).collect();
    let mut stopped = obstructions_of(job, paths, &open, control);
    stopped.extend(refused.iter().filter_map(|it| alone(&it)));
    let mut groups = joined(&paths.unplanned, &stopped);
    groups.retain(|group| group.len() <= LARGEST_GROUP);
    groups.truncate(MOST_GROUPS);
    groups
}

/// Unplanned drones with their blockers, each group ascending and a question of its own; no drone
/// is in two of them. `stopped` says by drone what stops it while every other keeps to its plan.
pub(crate) fn joined(
    unplanned: &[(DroneId, FailureKind)],
    stopped: &BTreeMap<DroneId, Option<Obstruction>>,
) -> Vec<Vec<DroneId>> {
    let mut groups: Vec<Vec<DroneId>> = Vec::new();
    for (&drone, by) in stopped {
        // A drone that no other order helps is no part of this.
        let helps = |other: &DroneId| {
            stopped.contains_key(other) || unplanned.iter().all(|(drone, _)| drone != other)
        };
        let other = by.and_then(|by| match by.by {
            Obstructor::Drone(other, _) => Some(other).filter(helps),
            Obstructor::Zone(_) => None,
        });
        let mut joined: Vec<DroneId> = std::iter::once(drone).chain(other).collect();
        let touches = |group: &mut Vec<DroneId>| group.iter().any(|it| joined.contains(it));
        let same: Vec<Vec<DroneId>> = groups.extract_if(.., touches).collect();
        joined.extend(same.into_iter().flatten());
        joined.sort_unstable();
        joined.dedup();
        groups.push(joined);
    }
    groups
}

/// What stops each of some drones if every other drone keeps to its plan.
pub(crate) fn obstructions_of(
    job: &Job,
    paths: &Paths,
    drones: &[DroneId],
    control: &Control<'_>,
) -> BTreeMap<DroneId, Option<Obstruction>> {
    let stopped = drones.par_iter();
    let stopped = stopped.map(|&drone| (drone, obstruction_of(job, paths, drone, control)));
    stopped.collect()
}

/// The same of one.
fn obstruction_of(
    job: &Job,
    paths: &Paths,
    drone: DroneId,
    control: &Control<'_>,
) -> Option<Obstruction> {
    let weights = vec![IMMOVABLE; job.agents.len()];
    let setting = SearchSetting {
        most_expansions: match paths.costmap.wake_persistence_ticks() > 0 {
            true => MOST_LATE_OBSTRUCTION_EXPANSIONS,
            false => MOST_OBSTRUCTION_EXPANSIONS,
        },
        ..SearchSetting::judged(&job.roadmap, &paths.costmap, &weights, control.stop)
    };
    match search(setting, &job.agents[drone.0 as usize]).found {
        SearchOutcome::Blocked(by) => by,
        SearchOutcome::Path(_) | SearchOutcome::Stopped => None,
    }
}

/// The world's cells divided into so many parts (m), if a lattice of them is made.
pub(crate) fn divided_cells_m(world: &World, parts: f64) -> Option<f64> {
    let size_m = world.bounds_m.max - world.bounds_m.min;
    let cell_m = world.planning.cell_m / parts;
    let fits = cell_m >= LEAST_CELL_M && lattice_places(size_m, cell_m) <= MOST_PLACES;
    (parts == 1.0 || fits).then_some(cell_m)
}

/// Lattices with lanes for some drones along the sides of gaps, none of them too large.
fn lanes_of(world: &World, drones: &[DroneId]) -> Vec<Spacing> {
    let size_m = world.bounds_m.max - world.bounds_m.min;
    let drones = drones.iter().map(|it| &world.drones[it.0 as usize]);
    let mut found = lanes::spacings(world, &drones.collect::<Vec<_>>());
    found.retain(|it| lattice_places(size_m, it.cell_m) <= MOST_PLACES);
    found
}

/// What was asked already.
#[derive(Default)]
struct AnsweredQuestions(Vec<Question>);

/// Drones planned together again on other terms, and what came of it.
struct Question {
    /// Ascending.
    drones: Vec<DroneId>,
    spacing: Spacing,
    raised: [f64; 2],
    /// States that it counts as.
    states: u64,
    /// Whether its states ended first.
    has_ended: bool,
}

impl AnsweredQuestions {
    /// The same question, or of one drone that a zone stops alone the same with others: no better
    /// answer comes of it.
    fn known(
        &self,
        drones: &[DroneId],
        paths: &Paths,
        (on, raised): (Spacing, [f64; 2]),
    ) -> Option<&Question> {
        let is_alone = |drone: &DroneId| {
            let mut unplanned = paths.unplanned.iter();
            unplanned.any(|(it, why)| it == drone && matches!(why, FailureKind::Zone(_)))
        };
        self.0.iter().find(|it| {
            let is_same = match drones {
                [drone] if is_alone(drone) => it.drones.contains(drone),
                _ => it.drones == drones,
            };
            is_same && it.spacing == on && it.raised == raised
        })
    }
}

/// Drones among which some were refused.
struct Refused<'a> {
    world: &'a World,
    control: &'a Control<'a>,
    /// Planned together again.
    drones: &'a [DroneId],
    /// What is tried in turn.
    attempts: &'a [(f64, [f64; 2])],
    /// Cells are divided into so many parts at most.
    most_parts: f64,
}

impl Refused<'_> {
    /// Plans them on finer cells and larger ones, and with higher bounds if the verifier finds
    /// nothing in the plan. Whatever leaves fewer of them unplanned is taken over.
    fn retry_group(
        &self,
        job: &mut Job,
        paths: &mut Paths,
        answered: &mut AnsweredQuestions,
        effort: &mut Effort,
    ) -> Extent {
        let own_m = self.world.planning.cell_m;
        let (mut finest_m, mut ended) = (own_m, None);
        let begun = effort.expansions;
        let (is_advected, zones) = (
            paths.costmap.wake_persistence_ticks() > 0,
            paths.costmap.has_air_limits_of_zones(),
        );
        let mut left = match is_advected || zones {
            true => MOST_DEAR_EXPANSIONS,
            false => MOST_EXPANSIONS,
        };
        // States of whose steps tables know take less.
        let tabulated = match (zones, is_advected) {
            (true, _) => 1,
            (false, true) => UNTABULATED_STATES * UNTABULATED_LATE_STATES,
            (false, false) => UNTABULATED_STATES,
        };
        let (mut judged, mut narrowed) = (0, 0);
        let mut too_low = None;
        let prepared = Prepared::default();
        let attempts = self.attempts.iter();
        let attempts = attempts.filter(|(parts, _)| *parts <= self.most_parts);
        let mut attempts = attempts.filter_map(|(parts, raised)| {
            let cell_m = divided_cells_m(self.world, *parts)?;
            Some((Spacing::of(cell_m), *raised))
        });
        let first = attempts.next();
        let lanes = std::iter::once_with(|| lanes_of(self.world, self.drones)).flatten();
        let lanes = lanes.map(|spacing| (spacing, [1.0; 2]));
        for (spacing, raised) in first.into_iter().chain(lanes).chain(attempts) {
            let is_of_lanes = spacing != Spacing::of(spacing.cell_m);
            if self.unplanned(paths) == 0 || left == 0 || (self.control.stop)() {
                break;
            }
            if let Some(known) = answered.known(self.drones, paths, (spacing, raised)) {
                let share = (known.drones.len() / self.drones.len()) as u64;
                left = left.saturating_sub(known.states / share);
                match known.has_ended {
                    _ if is_of_lanes => {}
                    true => {
                        ended = Some(ended.map_or(spacing.cell_m, |it: f64| it.min(spacing.cell_m)))
                    }
                    false => finest_m = finest_m.min(spacing.cell_m),
                }
                continue;
            }
            let is_exact = raised == [1.0; 2];
            let terms = Terms {
                spacing,
                raised,
                most_expansions: match is_of_lanes {
                    true => EXPANSIONS_OF_LANES,
                    false if spacing.cell_m > own_m => EXPANSIONS_OF_FLEET,
                    false => EXPANSIONS_OF_ONE.min(UNTABULATED_STATES * left),
                },
                improves: true,
            };
            let subfleet = Subfleet {
                world: self.world,
                job,
                paths,
                chosen: self.drones,
                control: self.control,
                prepared: &prepared,
            };
            let before = effort.expansions;
            let found = subfleet.replanned(&terms, effort);
            let spent = effort.expansions - before;
            let states = if is_exact { spent / tabulated } else { spent };
            left = left.saturating_sub(states);
            answered.0.push(Question {
                drones: self.drones.to_vec(),
                spacing,
                raised,
                states,
                has_ended: found.is_none(),
            });
            let Some(found) = found else {
                if (self.control.stop)() {
                    break;
                }
                if !is_of_lanes {
                    ended = Some(ended.map_or(spacing.cell_m, |it: f64| it.min(spacing.cell_m)));
                }
                continue;
            };
            if !is_of_lanes {
                finest_m = finest_m.min(spacing.cell_m);
            }
            let is_better = found.unplanned < self.unplanned(paths);
            if !is_better {
                too_low = Some((spacing, raised));
                continue;
            }
            let mut is_kept = |found: &Replanned| {
                judged += 1;
                judged <= MOST_JUDGED && subfleet.judged(found).1.violations.is_empty()
            };
            let mut found = Some(found).filter(|it| is_exact || is_kept(it));
            if found.is_none() && narrowed < MOST_NARROWED {
                narrowed += 1;
                let low = too_low.filter(|(on, _)| *on == spacing);
                let low = low.map_or([1.0; 2], |(_, raised)| raised);
                let before = effort.expansions;
                found = self.narrowed(&subfleet, (low, terms), effort);
                left = left.saturating_sub(effort.expansions - before);
            }
            if let Some(found) = found {
                *paths = found.paths.clone();
                found.note_lower_bounds(self.drones, job);
            }
        }
        match ended {
            _ if (self.control.stop)() => Extent::Stopped { cell_m: finest_m },
            Some(cell_m) if cell_m <= finest_m => Extent::BudgetEnded {
                states: effort.expansions - begun,
                cell_m,
            },
            _ => Extent::NotFound { cell_m: finest_m },
        }
    }

    /// Plans them with bounds between those that are too low and those by which a plan is found
    /// that the verifier refuses: the higher they are, the nearer a drone passes to save time, and
    /// the way that holds may ask for little more than the limit.
    fn narrowed(
        &self,
        subfleet: &Subfleet<'_>,
        (mut low, terms): ([f64; 2], Terms),
        effort: &mut Effort,
    ) -> Option<Replanned> {
        let mut high = terms.raised;
        for _ in 0..MOST_HALVINGS {
            let raised = [0, 1].map(|k| f64::midpoint(low[k], high[k]));
            let found = subfleet.replanned(&Terms { raised, ..terms }, effort)?;
            if found.unplanned >= self.unplanned(subfleet.paths) {
                low = raised;
            } else if subfleet.judged(&found).1.violations.is_empty() {
                return Some(found);
            } else {
                high = raised;
            }
        }
        None
    }

    /// How many of them have no path.
    fn unplanned(&self, paths: &Paths) -> usize {
        let unplanned = paths.unplanned.iter();
        unplanned
            .filter(|(drone, _)| self.drones.contains(drone))
            .count()
    }
}
