//! Starts, goals and tasks that exclude one another, found before any search.
//!
//! Two sets are judged, each as if it lasted: all drones at their starts at time 0, and those that
//! stay at their goals after the last arrival. Then all that are at one time at tasks that say when
//! they are due, and tasks where another drone stays for good. Bodies, columns, wakes and zones are
//! judged as [`verify`](crate::verify::verify) judges them, with the clearance between bodies in
//! addition: an endpoint is chosen by the planner's rules. Where an endpoint lies (bounds,
//! obstacles) is not asked here, except of the places proposed instead.

mod sites;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use costmap::leg::DroneId;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::plan::cause::Exclusion;
use crate::plan::outcome::{Blocker, EndpointConflict, EndpointConflicts, EndpointKind, Meeting};
use crate::plan::trajectory::SAME_PLACE_M;
use crate::scenario::world::World;
use crate::verify::FAINTEST_WAKE_MPS;
use crate::verify::checks::obstacle::TOUCH_M;
use crate::verify::checks::zone::{Downwash, Peak};
use sites::{EndpointJudge, Site, Sites};

/// Spacing of the places proposed (m), chosen here: what a person would move a goal by.
const STEP_M: f64 = 0.1;
/// How far is still near (m), chosen here: beyond it a person would rather choose anew.
const FARTHEST_M: f64 = 8.0;
/// Bearings tried at each distance, chosen here: 15 degrees apart.
const BEARINGS: usize = 24;

/// Most conflicts of starts, and of goals, that are all described with a place that would do:
/// chosen here, those of a large fleet, which are mended together. Alike ones share a line.
const MOST_DESCRIBED: usize = 200;
/// So many are where there are more: chosen here, two screens' worth.
const DESCRIBED_OF_MORE: usize = 40;
/// Places that are judged in all for what would do: chosen here, a second of work.
const MOST_PLACES: usize = 80_000;
/// Where more goals than this are described they are moved together first: chosen here, as many as
/// are asked about one by one.
pub(crate) const MOST_ALONE: usize = 8;
/// Most pairs that are kept of a fleet (56 bytes each): all pairs of a thousand drones at one
/// place.
const MOST_KEPT: usize = 1 << 20;
/// As many are kept of every drone, however large the fleet; of a drone that is in so many pairs
/// the air is not asked about. Both chosen here: no way out of such a crowd is by one drone.
const CROWD: usize = 64;

/// Factors on the air that drones are in, in turn until the fleet is planned: chosen here, drones
/// meet more on their way.
const RAISES: [f64; 3] = [1.0, 1.1, 1.25];
/// Multiples of the distance to the nearest place in order by which drones are moved, in turn until
/// the fleet is planned: chosen here, they need room to fly.
const FARTHER: [f64; 3] = [1.0, 1.5, 2.0];
/// In so many ways drones are moved in turn until the fleet is planned, at most: chosen here, as
/// far up, down and to four sides.
const MOST_MOVES: usize = 16;

/// In the order in which they are told.
const KINDS: [EndpointKind; 3] = [
    EndpointKind::Starts,
    EndpointKind::Goals,
    EndpointKind::Tasks,
];

/// One exclusion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Excluded {
    /// The drone affected: index in the world's drones.
    pub(crate) drone: usize,
    pub(crate) blocker: Blocker,
    pub(crate) why: Exclusion,
    /// Of tasks: which, and when.
    pub(crate) meeting: Option<Meeting>,
}

/// What is found of a world's endpoints.
#[derive(Default)]
pub(crate) struct Exclusions {
    /// For people.
    pub(crate) conflicts: EndpointConflicts,
    /// Every exclusion of goals, by drone, then of tasks. Of a drone that is in more than [`CROWD`]
    /// pairs the nearest in the fleet's order, where all together would be too many to keep.
    pub(crate) goals: Vec<Excluded>,
    /// The places proposed for goals and tasks are those of a plan of all together.
    pub(crate) is_planned_together: bool,
}

impl Exclusions {
    /// Adds places that would do, for all that are described together.
    pub(crate) fn advise(&mut self, world: &World) {
        if self.conflicts.worst.is_empty() {
            return;
        }
        let (judge, mut cache) = EndpointJudge::new(world);
        let directions = directions();
        let mut left = MOST_PLACES;
        for described in (self.conflicts.worst).chunk_by_mut(|a, b| a.when == b.when) {
            let sites = Sites::new(&judge, &mut cache, described[0].when);
            // All that is advised can be done together.
            let mut advised: Vec<Site> = Vec::new();
            for it in described {
                let among = (&mut advised, &directions[..]);
                it.nearest_fix_m = advise_one(&judge, &sites, it.place(), among, &mut left);
            }
        }
    }

    /// The gaps between bodies that a smaller tracking margin would do for, and which (m).
    fn bearable_m(&mut self) -> impl Iterator<Item = &mut Option<f64>> {
        let worst = self.conflicts.worst.iter_mut().map(|it| &mut it.why);
        let goals = self.goals.iter_mut().map(|it| &mut it.why);
        worst.chain(goals).filter_map(|why| match why {
            Exclusion::Bodies { tracking_m, .. } => Some(tracking_m),
            _ => None,
        })
    }

    /// Proposes for goals and tasks the places of a plan of all of them together, where those are
    /// more than are asked about one by one and the world with them `is_planned`: the nearest, or
    /// as many times as far.
    pub(crate) fn confirm_together(&mut self, world: &World, is_planned: impl Fn(&World) -> bool) {
        let EndpointConflicts { worst, more } = &mut self.conflicts;
        if *more > 0 || worst.len() <= MOST_ALONE {
            return;
        }
        let all: Vec<&EndpointConflict> = worst.iter().collect();
        let moves = nearest_m(&all).into_iter().flat_map(farther);
        let Some(planned) = moved(world, &all, moves, is_planned) else {
            return;
        };
        for it in worst {
            it.nearest_fix_m = Some(from_m(&planned, it));
        }
        self.is_planned_together = true;
    }

    /// Proposes for goals and tasks only those places (m) with which there was a plan, or of a
    /// drone that has to move at several of them all together, where the world with them
    /// `is_planned`.
    pub(crate) fn confirm_goals(
        &mut self,
        world: &World,
        planned_m: impl Fn(&EndpointConflict) -> Option<Point3<f64>>,
        is_planned: impl Fn(&World) -> bool,
    ) {
        if self.is_planned_together {
            return;
        }
        let starts = |it: &EndpointConflict| it.when == EndpointKind::Starts;
        let worst = &mut self.conflicts.worst;
        let places = |drone: usize| {
            let own = worst.iter().filter(|it| it.drone == drone && !starts(it));
            let tasks = own.map(|it| (it.task_of(world.drones[drone].tasks.len()), it));
            tasks.collect::<BTreeMap<_, _>>()
        };
        let drones: BTreeSet<usize> = worst.iter().map(|it| it.drone).collect();
        let together = drones.into_iter().filter_map(|drone| {
            let own: Vec<&EndpointConflict> = places(drone).into_values().collect();
            let to_m = nearest_m(&own).filter(|to_m| to_m.len() > 1);
            let moves = to_m.into_iter().flat_map(farther);
            Some((drone, moved(world, &own, moves, &is_planned)?))
        });
        let together: BTreeMap<usize, World> = together.collect();
        for conflict in worst.iter_mut().filter(|it| !starts(it)) {
            conflict.nearest_fix_m = match together.get(&conflict.drone) {
                Some(moved) => Some(from_m(moved, conflict)),
                None => planned_m(conflict),
            };
        }
    }

    /// Leaves of the tracking margins only one with which the fleet `is_planned`: the least, half
    /// of it, since drones just so far apart cannot move, or none at all.
    pub(crate) fn confirm_tracking(&mut self, is_planned: impl Fn(f64) -> bool) {
        let least_m = self.bearable_m().filter_map(|it| *it).reduce(f64::min);
        // To the millimetre, downwards: it is typed back.
        let halved_m = |least_m: f64| (0.5e3 * least_m).floor() / 1e3;
        let smaller_m = least_m.map(|least_m| [least_m, halved_m(least_m), 0.0]);
        let enough_m = (smaller_m.into_iter().flatten()).find(|it| is_planned(*it));
        for bears_m in self.bearable_m() {
            *bears_m = bears_m.and(enough_m);
        }
    }

    /// Proposes limits of air for drones that are in another's wake, where nothing else excludes
    /// any, and the world with all of them `is_planned`: the air itself, or somewhat more.
    pub(crate) fn confirm_limits(&mut self, world: &World, is_planned: impl Fn(&World) -> bool) {
        let EndpointConflicts { worst, more } = &mut self.conflicts;
        let exposed = |it: &EndpointConflict| match it.why {
            Exclusion::Air { alpha, .. } => Some((it.drone, alpha)),
            _ => None,
        };
        let exposed: Option<Vec<(usize, f64)>> = worst.iter().map(exposed).collect();
        let Some(exposed) = exposed.filter(|all| *more == 0 && !all.is_empty()) else {
            return;
        };
        let raised = |times: &f64| {
            let mut raised = world.clone();
            for &(drone, alpha) in &exposed {
                let limit = &mut raised.drones[drone].air_limit;
                // To two decimals, upwards: it is typed back.
                *limit = limit.max((times * alpha * 100.0).ceil() / 100.0);
            }
            raised
        };
        let Some(planned) = RAISES.iter().map(raised).find(|it| is_planned(it)) else {
            return;
        };
        let of_goals = self.goals.iter_mut().map(|it| (it.drone, &mut it.why));
        let of_worst = worst.iter_mut().map(|it| (it.drone, &mut it.why));
        for (drone, why) in of_worst.chain(of_goals) {
            if let Exclusion::Air { enough, .. } = why {
                *enough = Some(planned.drones[drone].air_limit);
            }
        }
    }

    /// Proposes places only where the world in which all move to them `is_planned`: the nearest,
    /// those nearest in one direction, or as many times as far.
    pub(crate) fn confirm_moves(&mut self, world: &World, is_planned: impl Fn(&World) -> bool) {
        let EndpointConflicts { worst, more } = &mut self.conflicts;
        let all: Vec<&EndpointConflict> = worst.iter().collect();
        let planned = nearest_m(&all).filter(|_| *more == 0).and_then(|to_m| {
            // Where the nearest do, no others are looked for.
            let others = std::iter::once_with(|| other_moves(world, &all, &to_m)).flatten();
            let moves = std::iter::once((to_m.clone(), 1.0)).chain(others);
            moved(world, &all, moves.take(MOST_MOVES), is_planned)
        });
        for conflict in worst {
            conflict.nearest_fix_m = planned.as_ref().map(|it| from_m(it, conflict));
        }
    }
}

/// The places that are proposed for some conflicts (m), if there is one for each.
fn nearest_m(conflicts: &[&EndpointConflict]) -> Option<Vec<Point3<f64>>> {
    conflicts.iter().map(|it| it.nearest_fix_m).collect()
}

/// The same places (m), so many times as far.
fn farther(to_m: Vec<Point3<f64>>) -> [(Vec<Point3<f64>>, f64); 3] {
    FARTHER.map(|times| (to_m.clone(), times))
}

/// The world after the first of some `moves` of all drones in some conflicts with which it is in
/// order and `is_planned`: each to a place (m), or as many times as far.
fn moved(
    world: &World,
    conflicts: &[&EndpointConflict],
    moves: impl Iterator<Item = (Vec<Point3<f64>>, f64)>,
    is_planned: impl Fn(&World) -> bool,
) -> Option<World> {
    let moved = |(to_m, times): (Vec<Point3<f64>>, f64)| {
        let mut moved = world.clone();
        for (conflict, to_m) in conflicts.iter().zip(&to_m) {
            let from_m = from_m(world, conflict);
            let to_m = from_m + times * (to_m - from_m);
            let drone = &mut moved.drones[conflict.drone];
            let place_m = match conflict.task_of(drone.tasks.len()) {
                Some(task) => &mut drone.tasks[task].to_m,
                None => &mut drone.start_m,
            };
            // To the centimetre: it is typed back.
            *place_m = to_m.map(|at_m| (at_m * 100.0).round() / 100.0);
        }
        moved
    };
    { moves }
        .map(moved)
        .find(|moved| moved.check().is_ok() && is_planned(moved))
}

/// Where else (m) drones in conflicts may go, and how many times as far, if their `nearest` places
/// will not do; the nearest of all first.
fn other_moves(
    world: &World,
    conflicts: &[&EndpointConflict],
    nearest_m: &[Point3<f64>],
) -> Vec<(Vec<Point3<f64>>, f64)> {
    let (judge, mut cache) = EndpointJudge::new(world);
    let sites = KINDS.map(|when| (when, Sites::new(&judge, &mut cache, when)));
    let mut left = MOST_PLACES;
    // All of them in one direction; a drone in order nowhere there stays with its nearest.
    let mut towards = |direction: Vector3<f64>| {
        let mut to_m = nearest_m.to_vec();
        for (when, sites) in &sites {
            let mut advised: Vec<Site> = Vec::new();
            let of_kind = conflicts.iter().zip(&mut to_m);
            for (it, to_m) in of_kind.filter(|(it, _)| it.when == *when) {
                let among = (&mut advised, &[direction][..]);
                if let Some(place_m) = advise_one(&judge, sites, it.place(), among, &mut left) {
                    *to_m = place_m;
                }
            }
        }
        to_m
    };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let directions = axes.into_iter().flat_map(|axis| [axis, -axis]);
    let mut moves: Vec<Vec<Point3<f64>>> = vec![nearest_m.to_vec()];
    for to_m in directions.map(&mut towards) {
        if !moves.contains(&to_m) {
            moves.push(to_m);
        }
    }
    let mut moves: Vec<_> = moves.into_iter().flat_map(farther).skip(1).collect();
    let far_m = |(to_m, times): &(Vec<Point3<f64>>, f64)| {
        let each_m = conflicts.iter().zip(to_m);
        let each_m = each_m.map(|(it, to_m)| (to_m - from_m(world, it)).norm());
        times * each_m.sum::<f64>()
    };
    moves.sort_by(|a, b| far_m(a).total_cmp(&far_m(b)));
    moves
}

/// Place of the affected drone (m), in a world as it is.
fn from_m(world: &World, conflict: &EndpointConflict) -> Point3<f64> {
    let drone = &world.drones[conflict.drone];
    match conflict.task_of(drone.tasks.len()) {
        Some(task) => drone.tasks[task].to_m,
        None => drone.start_m,
    }
}

/// Every pair of starts, of goals at which drones stay, and of tasks at one time, that no plan can
/// have; and every drone that starts or ends where it breaks a zone's limit. By drone, starts
/// before goals before tasks; of very many the worst.
///
/// A pair is named once, under the later of two bodies that touch and under the drone that suffers
/// from a column or a wake. Where only a sum of wakes exceeds a limit, the strongest of them is
/// named. The world has to be in order ([`World::check`]).
pub fn check(world: &World) -> EndpointConflicts {
    let mut found = find(world);
    found.advise(world);
    found.conflicts
}

/// For each of some drones the first of some of its tasks, and the first zone, whose limit it
/// breaks as it hovers there with no other drone in the air.
pub(crate) fn breaking_zones_alone(
    world: &World,
    tasks: &[(DroneId, Range<usize>)],
) -> Vec<Option<(usize, usize)>> {
    let (judge, mut cache) = EndpointJudge::new(world);
    let sites = tasks.iter().map(|(drone, tasks)| {
        let tasks = tasks.clone().map(|task| (drone.0 as usize, task));
        let hovers =
            tasks.filter_map(|(drone, task)| Some((task, judge.hovers(&mut cache, drone, task)?)));
        hovers.collect::<Vec<_>>()
    });
    let sites: Vec<Vec<(usize, Site)>> = sites.collect();
    let broken = sites.par_iter().map(|sites| {
        let mut all = (sites.iter()).flat_map(|it| (0..world.zones.len()).map(move |k| (it, k)));
        let broken = all.find(|((_, site), k)| breaks_alone(&judge, site, *k));
        broken.map(|((task, _), k)| (*task, k))
    });
    broken.collect()
}

/// Whether the wake of a drone alone is too strong for a zone.
fn breaks_alone(judge: &EndpointJudge<'_>, site: &Site, zone: usize) -> bool {
    let own = judge.downwash(site, zone);
    own.is_some_and(|own| judge.breaks_zone(zone, &[&own]))
}

/// [`check`], with every exclusion of goals and without advice.
pub(crate) fn find(world: &World) -> Exclusions {
    let (judge, mut cache) = EndpointJudge::new(world);
    let mut conflicts = EndpointConflicts::default();
    let mut kept = Vec::new();
    for when in KINDS {
        let sites = Sites::new(&judge, &mut cache, when);
        // Starts that exclude one another are only described.
        let most = match when {
            EndpointKind::Starts => CROWD,
            EndpointKind::Goals | EndpointKind::Tasks => {
                CROWD.max(MOST_KEPT / world.drones.len().max(1))
            }
        };
        let pairs = sites.all().par_iter();
        let pairs: Vec<(Vec<Excluded>, usize)> = pairs
            .map(|site| exclusions(&judge, &sites, site, most))
            .collect();
        let omitted: usize = pairs.iter().map(|(_, omitted)| omitted).sum();
        // Of tasks above zones those that no drone can do alone are found by the search.
        let zones = match when {
            EndpointKind::Starts | EndpointKind::Goals => 0..world.zones.len(),
            EndpointKind::Tasks => 0..0,
        };
        let zones = zones.into_par_iter();
        let zones: Vec<Excluded> = zones.flat_map(|k| in_zone(&judge, &sites, k)).collect();
        let pairs = pairs.into_iter().flat_map(|(found, _)| found);
        let mut found: Vec<Excluded> = pairs.chain(zones).collect();
        if when == EndpointKind::Tasks {
            found.extend(other_tasks(&judge, &sites, &kept));
        }
        found.sort_by_key(|it| it.drone);
        let worst = worst(&found);
        conflicts.more += omitted + found.len() - worst.len();
        let described = worst.into_iter().map(|it| EndpointConflict {
            drone: it.drone,
            blocker: it.blocker,
            when,
            meeting: it.meeting,
            why: it.why,
            nearest_fix_m: None,
        });
        conflicts.worst.extend(described);
        if when != EndpointKind::Starts {
            kept.extend(found);
        }
    }
    Exclusions {
        conflicts,
        goals: kept,
        is_planned_together: false,
    }
}

/// All exclusions, or the worst where they are more than [`MOST_DESCRIBED`], in the order in which
/// they were found.
fn worst(found: &[Excluded]) -> Vec<Excluded> {
    let mut order: Vec<usize> = (0..found.len()).collect();
    // Of equals the first.
    order.sort_by(|&a, &b| severity(&found[b].why).total_cmp(&severity(&found[a].why)));
    if order.len() > MOST_DESCRIBED {
        order.truncate(DESCRIBED_OF_MORE);
    }
    order.sort_unstable();
    order.into_iter().map(|index| found[index]).collect()
}

/// How bad an exclusion is: bodies before columns before air; bodies by what the gap lacks (m), air
/// by how many times its limit it is. No gap lacks as much, and no air is as many times its limit,
/// as these classes are apart.
fn severity(why: &Exclusion) -> f64 {
    const CLASS: f64 = 1e9;
    match *why {
        Exclusion::Bodies { gap_m, needs_m, .. } => 2.0 * CLASS + needs_m - gap_m,
        Exclusion::Column => CLASS,
        Exclusion::Air { alpha, limit, .. } => alpha / limit,
        Exclusion::Zone {
            air_mps, limit_mps, ..
        } => air_mps / limit_mps,
    }
}

/// What excludes one site, as far as pairs are named under it: the pairs that are kept, `most` of
/// them, and how many more there are.
fn exclusions(
    judge: &EndpointJudge<'_>,
    sites: &Sites,
    site: &Site,
    most: usize,
) -> (Vec<Excluded>, usize) {
    let mut found = Vec::new();
    let mut omitted = 0;
    let near = sites.near(site);
    let mut named = Vec::new();
    let mut tell = |it: Excluded| match found.len() < most {
        true => found.push(it),
        false => omitted += 1,
    };
    // Backwards: of many, those nearest before it in the fleet are kept.
    for other in near.iter().rev() {
        if let Some(gap_m) = body_gap_m(judge, site, other) {
            named.push(other.drone);
            if other.drone < site.drone {
                let why = Exclusion::Bodies {
                    gap_m,
                    needs_m: judge.needs_m(site, other),
                    tracking_m: judge.bearable_tracking_m(site, other, gap_m),
                };
                tell(pair(site, other, why));
            }
        } else if judge.in_column(site, other) {
            named.push(other.drone);
            tell(pair(site, other, Exclusion::Column));
        }
    }
    found.reverse();
    if named.len() >= CROWD {
        return (found, omitted);
    }
    // Fewer wakes are no more air.
    if !judge.over_limit(site, judge.air_mps(site, &near)) {
        return (found, omitted);
    }
    let moments = sites.moments(site, &near).into_iter();
    let worst = (moments.map(|present| (judge.air_mps(site, &present), present)))
        .reduce(|a, b| if b.0 > a.0 { b } else { a });
    let Some((air_mps, near)) = worst.filter(|(air_mps, _)| judge.over_limit(site, *air_mps))
    else {
        return (found, omitted);
    };
    let why = Exclusion::Air {
        air_mps,
        alpha: air_mps / site.induced_velocity_mps,
        limit: site.air_limit,
        enough: None,
    };
    let alone = near.iter();
    let alone = alone.map(|other| (*other, judge.air_mps(site, &[other])));
    let alone: Vec<(&Site, f64)> = alone.collect();
    let over = |(_, alone_mps): &&(&Site, f64)| judge.over_limit(site, *alone_mps);
    let mut by: Vec<&Site> = alone.iter().filter(over).map(|(other, _)| *other).collect();
    by.retain(|other| !named.contains(&other.drone));
    if by.is_empty() && named.is_empty() {
        let strongest = (alone.into_iter()).reduce(|a, b| if b.1 > a.1 { b } else { a });
        by.extend(strongest.map(|(other, _)| other));
    }
    let room = most.saturating_sub(found.len());
    omitted += by.len().saturating_sub(room);
    let by = by.into_iter().take(room);
    found.extend(by.map(|other| pair(site, other, why)));
    (found, omitted)
}

/// The exclusion of a site by another.
fn pair(site: &Site, other: &Site, why: Exclusion) -> Excluded {
    let counted = |site: &Site| site.task.map(|task| task + 1);
    let meeting = |during_s| Meeting {
        task: counted(site),
        their_task: counted(other),
        during_s,
    };
    let at_tasks = site.task.or(other.task).and(site.together_s(other));
    Excluded {
        drone: site.drone,
        blocker: Blocker::Drone(other.drone),
        why,
        meeting: at_tasks.map(meeting),
    }
}

/// The gap between two bodies, if it is too small (m).
fn body_gap_m(judge: &EndpointJudge<'_>, one: &Site, other: &Site) -> Option<f64> {
    let gap_m = (one.place_m - other.place_m).norm() - one.body_radius_m - other.body_radius_m;
    // Rounding of a scenario's decimals is no conflict.
    (gap_m < judge.needs_m(one, other) - SAME_PLACE_M).then_some(gap_m)
}

/// The drones that break a zone's limit: all that do so alone, or else the strongest.
fn in_zone(judge: &EndpointJudge<'_>, sites: &Sites, k: usize) -> Vec<Excluded> {
    let Some(limit_mps) = judge.world.zones[k].air_limit_mps else {
        return Vec::new();
    };
    let downwash = sites.all().iter();
    let downwash: Vec<Downwash<'_>> = downwash.filter_map(|it| judge.downwash(it, k)).collect();
    let run: Vec<&Downwash<'_>> = downwash.iter().collect();
    let excluded = |drone, peak: &Peak, together| Excluded {
        drone,
        blocker: Blocker::Zone(k),
        why: Exclusion::Zone {
            air_mps: peak.air_mps,
            limit_mps,
            together,
        },
        meeting: None,
    };
    let alone = run.iter().filter_map(|it| {
        let peak = judge.zone_peak(k, &[*it])?;
        Some(excluded(it.from(), &peak, false))
    });
    let alone: Vec<Excluded> = alone.collect();
    if !alone.is_empty() {
        return alone;
    }
    let peak = judge.zone_peak(k, &run);
    let by = peak.and_then(|peak| Some((judge.field().strongest(&run, &peak)?, peak)));
    let together = by.map(|(drone, peak)| excluded(drone, &peak, true));
    together.into_iter().collect()
}

/// Of drones whose goals break a zone's limit, the other tasks that break one: they are not
/// searched for, so that the search does not find them.
fn other_tasks(judge: &EndpointJudge<'_>, sites: &Sites, goals: &[Excluded]) -> Vec<Excluded> {
    let over_zones = goals.iter().filter_map(|it| match it.blocker {
        Blocker::Zone(_) => Some(it.drone),
        Blocker::Drone(_) => None,
    });
    let over_zones: BTreeSet<usize> = over_zones.collect();
    let tasks = sites.all().iter();
    let tasks = tasks.filter(|it| it.task.is_some() && over_zones.contains(&it.drone));
    let tasks: Vec<&Site> = tasks.collect();
    let broken = tasks.into_par_iter().flat_map_iter(|site| {
        (0..judge.world.zones.len()).filter_map(move |k| {
            let own = judge.downwash(site, k)?;
            let peak = judge.zone_peak(k, &[&own])?;
            Some(Excluded {
                drone: site.drone,
                blocker: Blocker::Zone(k),
                why: Exclusion::Zone {
                    air_mps: peak.air_mps,
                    limit_mps: judge.world.zones[k].air_limit_mps?,
                    together: false,
                },
                meeting: Some(Meeting {
                    task: site.task.map(|task| task + 1),
                    their_task: None,
                    during_s: site.task.and_then(|task| {
                        let asked = judge.world.drones[site.drone].tasks.get(task)?;
                        asked.during_s
                    }),
                }),
            })
        })
    });
    broken.collect()
}

/// Where a drone is advised to be (m): as before, or at the [`nearest`] place, noted among all that
/// is advised.
fn advise_one(
    judge: &EndpointJudge<'_>,
    sites: &Sites,
    place: (usize, Option<usize>),
    (advised, directions): (&mut Vec<Site>, &[Vector3<f64>]),
    left: &mut usize,
) -> Option<Point3<f64>> {
    let known = advised.iter().find(|it| (it.drone, it.task) == place);
    if let Some(known) = known {
        return Some(known.nominal_m);
    }
    let site = nearest(judge, sites, place, (advised, directions), left)?;
    let place_m = site.nominal_m;
    advised.push(site);
    Some(place_m)
}

/// The nearest place at which a drone is in order with all others of its set, those that are
/// advised to move where they are then, by rings of growing distance in some directions, while
/// there are places `left` to judge.
fn nearest(
    judge: &EndpointJudge<'_>,
    sites: &Sites,
    (drone, task): (usize, Option<usize>),
    (advised, directions): (&[Site], &[Vector3<f64>]),
    left: &mut usize,
) -> Option<Site> {
    let site = sites.of(drone, task)?;
    (1..=(FARTHEST_M / STEP_M) as usize).find_map(|ring| {
        *left = left.checked_sub(directions.len())?;
        let distance_m = ring as f64 * STEP_M;
        let places_m = (directions.iter()).map(|towards| site.nominal_m + towards * distance_m);
        let moved = places_m.map(|place_m| judge.moved(site, place_m));
        { moved }.find(|moved| in_order(judge, sites, moved, advised))
    })
}

/// Level, up and down.
fn directions() -> Vec<Vector3<f64>> {
    let level = (0..BEARINGS).map(|k| {
        let bearing = k as f64 / BEARINGS as f64 * std::f64::consts::TAU;
        Vector3::new(bearing.cos(), bearing.sin(), 0.0)
    });
    level.chain([Vector3::z(), -Vector3::z()]).collect()
}

/// Whether a drone may be there: in bounds, clear of solids, in order with all others and the
/// zones.
fn in_order(judge: &EndpointJudge<'_>, sites: &Sites, moved: &Site, advised: &[Site]) -> bool {
    let bounds_m = &judge.world.bounds_m;
    let fits = |place_m: &Point3<f64>, clearance_m: f64| {
        let inside = |k: usize| {
            place_m[k] >= bounds_m.min[k] - SAME_PLACE_M
                && place_m[k] <= bounds_m.max[k] + SAME_PLACE_M
        };
        let (needs_m, here) = (moved.body_radius_m + clearance_m, place_m.coords);
        (0..3).all(inside)
            && judge.obstacles.solids.iter().all(|solid| {
                solid.box_distance_m(&(here, here)) >= needs_m || solid.distance_m(&here) >= needs_m
            })
    };
    // What it stands on touches it.
    let clearance_m = if moved.airborne || moved.lands {
        judge.world.planning.gap_to_solids_m()
    } else {
        -TOUCH_M
    };
    // No drone is told to hover with its body in the floor.
    let floor_m = moved.nominal_m.z - bounds_m.min.z;
    if moved.airborne && floor_m < moved.body_radius_m - SAME_PLACE_M {
        return false;
    }
    if !fits(&moved.nominal_m, clearance_m) || moved.lands && !fits(&moved.place_m, -TOUCH_M) {
        return false;
    }
    // Whatever the others do: most places above a zone are out of the question for this.
    if (0..judge.world.zones.len()).any(|k| breaks_alone(judge, moved, k)) {
        return false;
    }
    let mut near = sites.near(moved);
    near.retain(|it| !advised.iter().any(|other| other.is_same(it)));
    near.extend((advised.iter()).filter(|it| it.together_s(moved).is_some()));
    let apart = near.iter().all(|other| {
        body_gap_m(judge, moved, other).is_none()
            && !judge.in_column(moved, other)
            && !judge.in_column(other, moved)
    });
    apart
        && !judge.over_limit(moved, judge.air_mps(moved, &near))
        && near.iter().all(|other| spares(judge, sites, moved, other))
        && (0..judge.world.zones.len()).all(|k| spares_zone(judge, sites, (moved, advised), k))
}

/// Whether another drone stays within its limit, or is not exposed to this one.
fn spares(judge: &EndpointJudge<'_>, sites: &Sites, moved: &Site, other: &Site) -> bool {
    if judge.air_mps(other, &[moved]) <= FAINTEST_WAKE_MPS {
        return true;
    }
    let mut all = sites.near(other);
    all.retain(|third| third.drone != moved.drone);
    all.push(moved);
    !judge.over_limit(other, judge.air_mps(other, &all))
}

/// Whether a zone keeps its limit, or is not exposed to this drone; those that break the limit
/// alone have to move themselves.
fn spares_zone(
    judge: &EndpointJudge<'_>,
    sites: &Sites,
    (moved, advised): (&Site, &[Site]),
    zone: usize,
) -> bool {
    let Some(own) = judge.downwash(moved, zone) else {
        return true;
    };
    let is_moved = |site: &Site| advised.iter().any(|it| it.is_same(site));
    let others = sites.all().iter().filter(|site| !is_moved(site));
    let others = others.chain(advised);
    let others = others.filter(|site| site.together_s(moved).is_some());
    let others: Vec<Downwash<'_>> = others.filter_map(|it| judge.downwash(it, zone)).collect();
    let mut all: Vec<&Downwash<'_>> = others.iter().chain([&own]).collect();
    if !judge.breaks_zone(zone, &all) {
        return true;
    }
    all.retain(|it| !judge.breaks_zone(zone, &[*it]));
    !judge.breaks_zone(zone, &all)
}
