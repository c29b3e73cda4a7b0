//! Some drones of a planned fleet, planned once more among the rest, on other terms.

use std::cell::RefCell;

use costmap::leg::{DroneId, Leg};

use crate::graph::agent::Agent;
use crate::graph::lattice::Spacing;
use crate::plan::Plan;
use crate::plan::outcome::{Control, Effort};
use crate::scenario::world::World;
use crate::sipp::search::{Obstructor, Path};
use crate::solver::assemble::assemble;
use crate::solver::fleet::FleetRun;
use crate::solver::prepare::{Job, prepare_with};
use crate::solver::priority::{FailureKind, Paths};
use crate::verify::{Report, verify_drones};

/// Some drones of a fleet, among others whose legs stay as they are.
#[derive(Clone, Copy)]
pub(crate) struct Subfleet<'a> {
    /// The whole world.
    pub(crate) world: &'a World,
    /// Of the whole fleet.
    pub(crate) job: &'a Job,
    /// Of the whole fleet, as they are now.
    pub(crate) paths: &'a Paths,
    /// Drones planned again, ascending.
    pub(crate) chosen: &'a [DroneId],
    /// Says when to stop.
    pub(crate) control: &'a Control<'a>,
    /// Of the same drones in the same world.
    pub(crate) prepared: &'a Prepared,
}

/// Roadmap and agents of a subfleet by the spacing of the lattice: it is planned on the same
/// several times.
#[derive(Debug, Default)]
pub(crate) struct Prepared(RefCell<Vec<(Spacing, Job)>>);

impl Prepared {
    fn job(&self, spacing: Spacing, prepare: impl FnOnce() -> Job) -> Job {
        let mut known = self.0.borrow_mut();
        if let Some((_, job)) = known.iter().find(|(own, _)| *own == spacing) {
            return job.clone();
        }
        let job = prepare();
        known.push((spacing, job.clone()));
        job
    }
}

/// On what a subfleet is planned.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Terms {
    /// Its lattice.
    pub(crate) spacing: Spacing,
    /// How many times the limits of drones, and of zones, wakes may reach by the bounds of the
    /// search. Beyond 1 a plan has to be verified.
    pub(crate) raised: [f64; 2],
    /// States of all searches.
    pub(crate) most_expansions: u64,
    /// Whether more is asked than which can be planned: a better plan.
    pub(crate) improves: bool,
}

/// A subfleet planned once more.
pub(crate) struct Replanned {
    /// Its own roadmap, and the agents of the chosen alone.
    job: Job,
    /// The whole fleet's, with the new ones in them.
    pub(crate) paths: Paths,
    /// How many of the chosen have no path.
    pub(crate) unplanned: usize,
}

impl Subfleet<'_> {
    /// Plans the chosen on these terms; adds what that took to `effort`. `None` where the states
    /// ended first, or where it was stopped.
    pub(crate) fn replanned(&self, terms: &Terms, effort: &mut Effort) -> Option<Replanned> {
        let quiet = self.control.trying();
        let is_chosen = |drone: &DroneId| self.chosen.binary_search(drone).is_ok();
        let all = (0..self.world.drones.len() as u32).map(DroneId);
        let order: Vec<DroneId> = (self.chosen.iter().copied())
            .chain(all.filter(|drone| !is_chosen(drone)))
            .collect();
        let mut whole = self.world.clone();
        whole.planning.cell_m = terms.spacing.cell_m;
        let drones = order.iter();
        whole.drones = drones
            .map(|it| self.world.drones[it.0 as usize].clone())
            .collect();
        let mut own = whole.clone();
        own.drones.truncate(self.chosen.len());
        let prepare = || prepare_with(&own, &terms.spacing, &self.job.roadmap.channels());
        let job = self.prepared.job(terms.spacing, prepare);
        let most = (terms.most_expansions, terms.improves);
        let mut run = FleetRun::limited(&own, &quiet, job, most);
        let rest = order.iter().enumerate().skip(self.chosen.len());
        let fixed = rest.map(|(index, drone)| {
            let legs = self.paths.costmap.legs(*drone).iter();
            let mut own = |leg: &Leg| {
                let (vehicle, mass_kg) = self.job.kinds.of(leg.kind);
                Leg {
                    drone: DroneId(index as u32),
                    kind: run.job.kinds.kind(vehicle, mass_kg),
                    air_limit: whole.drones[index].air_limit,
                    ..*leg
                }
            };
            legs.map(&mut own).collect()
        });
        let fixed: Vec<Vec<Leg>> = fixed.collect();
        let [drones, zones] = terms.raised;
        let costmap = run.job.costmap(&whole, whole.drones.len());
        let found = run.paths(costmap.with_limits_raised(drones, zones), fixed);
        effort.add(&run.effort);
        let found = found?;
        let is_stopped = |(_, why): &(DroneId, FailureKind)| *why == FailureKind::Stopped;
        if found.unplanned.iter().any(is_stopped) {
            return None;
        }
        let job = run.job;
        Some(Replanned {
            unplanned: found.unplanned.len(),
            paths: self.merged(&job, found, &order),
            job,
        })
    }

    /// The whole fleet's paths with those of the chosen in them; `order` says which drone each of
    /// the subfleet's is.
    fn merged(&self, job: &Job, found: Paths, order: &[DroneId]) -> Paths {
        let mut paths = self.paths.clone();
        paths.unplanned.retain(|(it, _)| !self.chosen.contains(it));
        for &drone in self.chosen {
            paths.costmap.remove(drone);
        }
        let back = |leg: &Leg| {
            let (vehicle, mass_kg) = job.kinds.of(leg.kind);
            Leg {
                drone: order[leg.drone.0 as usize],
                // The whole fleet flies whatever the subfleet does.
                kind: self.job.kinds.known(vehicle, mass_kg).unwrap_or(leg.kind),
                ..*leg
            }
        };
        for (path, &drone) in found.paths.into_iter().zip(self.chosen) {
            let agent: &Agent = &self.job.agents[drone.0 as usize];
            let path = path.map(|path| Path {
                legs: path.legs.iter().map(back).collect(),
                evicted: Vec::new(),
                ..path
            });
            paths.costmap.insert(match &path {
                Some(path) => agent.flown(&path.legs).into_owned(),
                None => vec![agent.stays_at_start(&self.job.roadmap)],
            });
            paths.paths[drone.0 as usize] = path;
        }
        for (drone, mut why) in found.unplanned {
            if let FailureKind::Obstructed(Some(by)) | FailureKind::Zone(by) = &mut why
                && let Obstructor::Drone(other, _) = &mut by.by
            {
                *other = order[other.0 as usize];
            }
            paths.unplanned.push((order[drone.0 as usize], why));
        }
        paths
    }

    /// What the verifier finds in the whole plan with these paths in it, but for the highest air of
    /// its zones.
    pub(crate) fn judged(&self, replanned: &Replanned) -> (Plan, Report) {
        let plan = assemble(self.world, self.job, &replanned.paths);
        let report = verify_drones(&plan);
        (plan, report)
    }
}

impl Replanned {
    /// Notes in the whole fleet's job how long the chosen take alone, on the roadmap that they are
    /// planned on now.
    pub(crate) fn note_lower_bounds(&self, chosen: &[DroneId], job: &mut Job) {
        for (own, drone) in self.job.agents.iter().zip(chosen) {
            let agent = &mut job.agents[drone.0 as usize];
            (agent.lower_bound_ticks, agent.lower_bound_m) =
                (own.lower_bound_ticks, own.lower_bound_m);
        }
    }
}
