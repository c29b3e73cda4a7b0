//! What one planner knows of its neighbours, and which planner owns which drone.
//!
//! A planner owns every drone that is not known to be a neighbour's. A hand-over leaves traces here
//! until both sides know of it: an own drone is offered; it is promised once this planner has
//! agreed to a neighbour's proposal that takes it; a drone that was taken is owed to its former
//! planner, whose borders may list it as their own until that planner has heard of it.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;
use planner::Plan;
use planner::plan::{AtEnd, DronePlan, Violation, ViolationKind};

use super::message::{Border, Fact, Offer, Proposal, Settled};
use super::site::{Site, both, extent, grown, is_inside, meet};
use super::{Record, Refused};

/// How far a drone may be from where it was said to be, or to have come by (m). Chosen here, as for
/// positions that come in.
const JUMP_M: f64 = 5.0;
/// Slack in comparing times (s), places (m) and masses (kg).
const SAME_S: f64 = 1e-6;
const SAME_M: f64 = 1e-6;
const SAME_KG: f64 = 1e-6;

/// What is known of a neighbour.
#[derive(Clone, Debug, Default)]
struct Neighbour {
    revision: u64,
    /// Of the last border that it has said: all of it is known.
    whole: u64,
    /// Its last proposal.
    number: u64,
    /// Its last proposal of which it is known what became of it.
    settled: u64,
    /// When it was heard (s).
    heard_s: Option<f64>,
    /// When a border of it was taken (s): all of it was known then.
    reported_s: Option<f64>,
    /// Up to when it speaks for its drones (s).
    until_s: f64,
    /// What was agreed to, by number: room is kept for it.
    agreed: BTreeMap<u64, Proposal>,
}

impl Neighbour {
    fn forget(&mut self, number: u64) {
        self.agreed.remove(&number);
        self.settled = self.settled.max(number);
        self.number = self.number.max(number);
    }

    fn takes(&self, drone: &str) -> bool {
        let mut agreed = self.agreed.values();
        agreed.any(|it| it.takes.as_deref() == Some(drone))
    }
}

/// A plan with changes that is to be flown from a moment on.
pub(super) struct Candidate<'a> {
    pub(super) plan: &'a Plan,
    /// The drones that fly something else than now.
    pub(super) changed: &'a [String],
    /// The drones that are own with it.
    pub(super) comes: &'a BTreeSet<&'a str>,
    /// One of them that a neighbour has offered.
    pub(super) took: Option<&'a Offer>,
    pub(super) at_s: f64,
}

/// All that is known of the neighbours.
#[derive(Clone, Debug)]
pub(super) struct Neighbourhood {
    /// The own area.
    name: String,
    site: Site,
    /// A plan without drones, by which parts of it are judged.
    rules: Plan,
    all: BTreeMap<String, Neighbour>,
    /// Drones of neighbours, and the owner of each.
    theirs: BTreeMap<String, String>,
    /// Own drones that are offered, the receiving area, and the offer.
    offered: BTreeMap<String, (String, Offer)>,
    /// Drones that can be taken, and their area: as neighbours' last borders say.
    offers: Vec<(String, Offer)>,
    /// Drones that were taken, from which area, by which proposal: until that neighbour knows, and
    /// whichever planner owns them by then.
    owed: BTreeMap<(String, String), u64>,
}

impl Neighbourhood {
    /// Nothing is known yet of those that an area is near to.
    pub(super) fn new(site: Site, name: &str, rules: Plan) -> Neighbourhood {
        let others = site.areas.iter().filter(|(other, _)| *other != name);
        let near = others.filter(|(_, it)| site.are_near(it, &rules.bounds_m));
        let all = near.map(|(other, _)| (other.clone(), Neighbour::default()));
        Neighbourhood {
            name: name.to_owned(),
            all: all.collect(),
            site,
            rules,
            theirs: BTreeMap::new(),
            offered: BTreeMap::new(),
            offers: Vec::new(),
            owed: BTreeMap::new(),
        }
    }

    pub(super) fn site(&self) -> &Site {
        &self.site
    }

    pub(super) fn names(&self) -> Vec<String> {
        self.all.keys().cloned().collect()
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.all.contains_key(name)
    }

    /// The revision of a neighbour's plan that is known.
    pub(super) fn revision(&self, name: &str) -> u64 {
        self.all.get(name).map_or(0, |it| it.revision)
    }

    /// The last proposal of a neighbour of which it is known what became of it.
    pub(super) fn settled(&self, name: &str) -> u64 {
        self.all.get(name).map_or(0, |it| it.settled)
    }

    /// Up to which proposal of a neighbour it is known of each what became of it.
    pub(super) fn knows(&self, name: &str) -> u64 {
        let open = self.all.get(name).and_then(|it| it.agreed.keys().next());
        let settled = self.settled(name);
        open.map_or(settled, |open| settled.min(open - 1))
    }

    /// Proposals up to one that were agreed to, and of which it was not known what became of them.
    pub(super) fn open(&self, name: &str, settled: u64) -> Vec<u64> {
        let agreed = self.all.get(name).map(|it| it.agreed.range(..=settled));
        agreed.into_iter().flatten().map(|(it, _)| *it).collect()
    }

    pub(super) fn owns(&self, drone: &str) -> bool {
        !self.theirs.contains_key(drone)
    }

    /// It is known to be that neighbour's.
    pub(super) fn is_of(&self, drone: &str, area: &str) -> bool {
        self.theirs.get(drone).is_some_and(|it| it == area)
    }

    /// A drone was taken from a neighbour that may not know it yet.
    fn owes(&self, drone: &str, to: &str) -> bool {
        let owed = (drone.to_owned(), to.to_owned());
        self.owed.contains_key(&owed)
    }

    /// An own drone is offered to a neighbour.
    pub(super) fn offers(&self, drone: &str) -> bool {
        self.offered.contains_key(drone)
    }

    /// What is offered to a neighbour.
    pub(super) fn offered_to(&self, area: &str) -> Vec<Offer> {
        let offered = self.offered.values().filter(|(to, _)| to == area);
        offered.map(|(_, offer)| offer.clone()).collect()
    }

    /// The first drone offered by its planner that can be taken, which is looked at last from now
    /// on.
    pub(super) fn next_offer(&mut self, can_be: impl Fn(&str) -> bool) -> Option<Offer> {
        let can_be = |(area, offer): &(String, Offer)| {
            self.is_of(&offer.drone, area) && can_be(&offer.drone)
        };
        let index = self.offers.iter().position(can_be)?;
        let next = self.offers.remove(index);
        self.offers.push(next.clone());
        Some(next.1)
    }

    /// A neighbour may have taken a drone by now.
    fn is_taking(&self, from: &str, drone: &str) -> bool {
        let is_offered = self.offered.get(drone).is_some_and(|(to, _)| to == from);
        is_offered || self.all[from].takes(drone)
    }

    /// The neighbour that may take a drone by a proposal that was agreed to.
    pub(super) fn promised(&self, drone: &str) -> Option<&str> {
        let mut takes = self.all.iter().filter(|(_, it)| it.takes(drone));
        takes.next().map(|(name, _)| &name[..])
    }

    /// What a border tells of a plan: the drones that come near a neighbour's world, and what was
    /// taken from it.
    pub(super) fn border_drones(&self, plan: &Plan, neighbour: &str, now_s: f64) -> Vec<DronePlan> {
        let is_told = |it: &&DronePlan| {
            let is_near = || self.owns(&it.name) && self.site.matters(it, neighbour, now_s);
            self.owes(&it.name, neighbour) || is_near()
        };
        plan.drones.iter().filter(is_told).cloned().collect()
    }

    /// Does what a journal keeps of neighbours; what it keeps of the plan is not done here.
    pub(super) fn enact(&mut self, record: &Record) {
        match record {
            Record::Agreed { from, proposal } => {
                if let Some(it) = self.all.get_mut(from) {
                    it.number = proposal.number;
                    it.agreed.insert(proposal.number, proposal.clone());
                }
            }
            Record::Dropped { from, number } => {
                if let Some(it) = self.all.get_mut(from) {
                    it.forget(*number);
                }
            }
            Record::Knows { from, number } => self
                .owed
                .retain(|(_, to), taken| to != from || *taken > *number),
            Record::Offered { to, offer } => {
                let offered = (to.clone(), offer.clone());
                self.offered.insert(offer.drone.clone(), offered);
            }
            Record::Withdrawn { drone } => {
                self.offered.remove(drone);
            }
            Record::Changed { .. }
            | Record::Noted { .. }
            | Record::Proposed { .. }
            | Record::Forgot { .. } => {}
        }
    }

    /// Drones are own from now on: those that come, and one that was taken by a proposal.
    pub(super) fn own(&mut self, comes: &BTreeSet<&str>, took: Option<&Offer>, number: u64) {
        if let Some(Offer { drone, .. }) = took {
            self.offers.retain(|(_, it)| it.drone != *drone);
            if let Some(from) = self.theirs.get(drone) {
                self.owed.insert((drone.clone(), from.clone()), number);
            }
        }
        for drone in comes {
            self.theirs.remove(*drone);
        }
    }

    /// Drones are a neighbour's from now on. `true`: what another neighbour is owed is among them.
    pub(super) fn note(&mut self, from: &str, number: u64, drones: &[DronePlan]) -> bool {
        for entry in drones {
            self.theirs.insert(entry.name.clone(), from.to_owned());
            self.offered.remove(&entry.name);
            self.owed.remove(&(entry.name.clone(), from.to_owned()));
        }
        if let Some(it) = self.all.get_mut(from) {
            it.forget(number);
        }
        let is_owed = |(drone, _): &(String, String)| drones.iter().any(|it| it.name == *drone);
        self.owed.keys().any(is_owed)
    }

    /// It has said something that can be.
    pub(super) fn heard(&mut self, now_s: f64, from: &str) {
        if let Some(it) = self.all.get_mut(from) {
            it.heard_s = Some(now_s);
        }
    }

    /// The neighbours whose votes a plan needs that is to replace another.
    pub(super) fn asked(
        &self,
        now_s: f64,
        flown: &Plan,
        candidate: &Candidate<'_>,
    ) -> Result<BTreeSet<String>, Refused> {
        let Candidate { plan, at_s, .. } = *candidate;
        let mut asked = BTreeSet::new();
        for (area, neighbour) in &self.all {
            for proposal in neighbour.agreed.values() {
                let from_s = proposal.from_s.min(at_s);
                let found = self.conflict(plan, candidate.comes, &proposal.drones, from_s);
                found.map_or(Ok(()), |it| Err(Refused::NotVerified(it)))?;
            }
            let new_and_old = |name: &str| [plan, flown].map(|plan| plan.drone(name));
            let matters = |name: &&String| {
                let mut entries = new_and_old(name).into_iter().flatten();
                entries.any(|it| self.site.matters(it, area, at_s))
            };
            let is_taken = candidate.took.is_some_and(|it| self.is_of(&it.drone, area));
            let mut near = candidate.changed.iter().filter(matters).peekable();
            if near.peek().is_none() && !is_taken {
                continue;
            }
            match neighbour.heard_s {
                Some(heard_s) if now_s - heard_s <= self.site.silent_s => {
                    asked.insert(area.clone());
                }
                Some(_) if neighbour.until_s < now_s => {
                    // It cannot be asked; a drone that flies away from its world may.
                    let is_nearer = |name: &String| {
                        let beside_m = |it: Option<&DronePlan>| self.site.beside_m(it?, area, at_s);
                        let [new, old] = new_and_old(name).map(beside_m);
                        new.is_some_and(|new| old.is_none_or(|old| new < old - SAME_M))
                    };
                    if is_taken || near.any(is_nearer) {
                        return Err(Refused::Closed(area.clone()));
                    }
                }
                _ => return Err(Refused::Silent(area.clone())),
            }
        }
        Ok(asked)
    }

    /// What a plan violates from a time on (s), and the one before does not, with an own drone in
    /// it or one that comes.
    pub(super) fn violated<'a>(
        &self,
        [before, plan]: [&'a Plan; 2],
        comes: &BTreeSet<&str>,
        from_s: f64,
    ) -> Option<&'a Violation> {
        let is_own = |name: &str| comes.contains(name) || self.owns(name);
        let is_ours = |it: &Violation| is_own(&it.drone) || it.with.as_deref().is_some_and(is_own);
        let is_new = |it: &&Violation| {
            it.matters_from(from_s) && is_ours(it) && !before.violations.contains(it)
        };
        plan.violations.iter().find(is_new)
    }

    /// What the verifier finds between own drones of a plan, those that come among them, and what
    /// others fly from a time on (s).
    fn conflict(
        &self,
        plan: &Plan,
        comes: &BTreeSet<&str>,
        theirs: &[DronePlan],
        from_s: f64,
    ) -> Option<String> {
        let extents = theirs.iter().filter_map(|it| extent(it, from_s));
        let near = grown(
            &extents.reduce(|a, b| both(&a, &b))?,
            2.0 * self.site.reach_m,
        );
        let is_theirs = |name: &str| theirs.iter().any(|it| it.name == name);
        let is_near = |it: &&DronePlan| {
            !is_theirs(&it.name) && extent(it, from_s).is_some_and(|it| meet(&near, &it))
        };
        let mut rules = self.rules.clone();
        rules.drones = plan.drones.iter().filter(is_near).cloned().collect();
        rules.drones.extend_from_slice(theirs);
        let is_own = |name: &str| !is_theirs(name) && (comes.contains(name) || self.owns(name));
        let counts = |it: &Violation| {
            it.matters_from(from_s)
                && (is_own(&it.drone) || it.with.as_deref().is_some_and(is_own))
                && !plan.violations.contains(it)
        };
        let found = planner::verify(&rules).violations.into_iter();
        { found }.find(counts).map(|it| it.to_string())
    }

    /// Conflicts between a neighbour's proposal and a plan, whose own drones include those that
    /// come.
    pub(super) fn conflict_with_proposal(
        &self,
        plan: &Plan,
        comes: &BTreeSet<&str>,
        it: &Proposal,
    ) -> Option<String> {
        self.conflict(plan, comes, &it.drones, it.from_s - SAME_S)
    }

    /// Why a drone may not be taken by a neighbour's proposal.
    pub(super) fn keeps(&self, plan: &Plan, from: &str, drone: &str) -> Option<String> {
        if !self.owns(drone) {
            return None;
        }
        let is_offered = self.offered.get(drone).is_some_and(|(to, _)| to == from);
        if plan.drone(drone).is_some() && !is_offered {
            return Some(format!("`{drone}` is not offered"));
        }
        let promised = self.promised(drone).filter(|area| *area != from);
        promised.map(|area| format!("`{drone}` is promised to `{area}`"))
    }

    /// Takes in that a neighbour proposes something.
    pub(super) fn hear_proposal(
        &mut self,
        now_s: f64,
        from: &str,
        it: &Proposal,
        (plan, revision): (&Plan, u64),
    ) -> Result<(), String> {
        let known = &self.all[from];
        if it.number <= known.number || it.revision <= known.revision {
            return Err(format!(
                "proposal {} of revision {}, after {} of {}",
                it.number, it.revision, known.number, known.revision
            ));
        }
        if it.seen > revision {
            return Err(format!(
                "it has seen revision {}, there is none such yet",
                it.seen
            ));
        }
        self.can_be(plan, (from, it.takes.as_deref()), &it.drones, it.from_s)?;
        self.can_fly(now_s, from, &it.drones)?;
        if let Some(known) = self.all.get_mut(from) {
            known.number = it.number;
        }
        Ok(())
    }

    /// Takes in what became of a neighbour's proposal, and gives it where it was agreed to.
    pub(super) fn hear_settled(
        &mut self,
        from: &str,
        Settled { number, is_flown }: Settled,
    ) -> Result<Option<Proposal>, String> {
        let known = &self.all[from];
        let agreed = known.agreed.get(&number).cloned();
        if agreed.is_none() && is_flown && number > known.settled {
            return Err(format!(
                "it flies proposal {number}, which was not agreed to"
            ));
        }
        if let Some(proposal) = agreed.as_ref().filter(|_| is_flown)
            && let Some(it) = self.all.get_mut(from)
        {
            it.revision = it.revision.max(proposal.revision);
        }
        Ok(agreed)
    }

    /// Takes in what has happened to a neighbour's drones.
    pub(super) fn hear_fact(
        &mut self,
        now_s: f64,
        from: &str,
        fact: &Fact,
        plan: &Plan,
    ) -> Result<(), String> {
        let known = self.all[from].revision;
        if fact.revision <= known {
            return Err(format!("revision {} after revision {known}", fact.revision));
        }
        self.can_be(plan, (from, None), &fact.drones, now_s)?;
        self.can_fly(now_s, from, &fact.drones)?;
        if let Some(it) = self.all.get_mut(from) {
            it.revision = fact.revision;
        }
        Ok(())
    }

    /// Whether a border can be the next of a neighbour, and whether it says that this neighbour
    /// knows more of what was taken from it.
    pub(super) fn follows(&self, from: &str, border: &Border) -> Result<bool, String> {
        let known = self.revision(from);
        if border.revision < known {
            return Err(format!(
                "revision {} after revision {known}",
                border.revision
            ));
        }
        let mut owed = self.owed.iter();
        Ok(owed.any(|((_, to), taken)| to == from && *taken <= border.heard))
    }

    /// Takes in a neighbour's border, and gives what its drones fly otherwise than known.
    pub(super) fn hear_border(
        &mut self,
        now_s: f64,
        from: &str,
        border: &Border,
        plan: &Plan,
    ) -> Result<Vec<DronePlan>, String> {
        let other = self.otherwise(now_s, from, border, plan)?;
        if let Some(it) = self.all.get_mut(from) {
            it.revision = border.revision;
            it.whole = border.revision;
            it.reported_s = Some(now_s);
            it.until_s = border.until_s;
            it.settled = it.settled.max(border.settled);
            it.number = it.number.max(border.settled);
        }
        self.offers
            .retain(|(of, it)| of != from || border.offers.contains(it));
        for offer in &border.offers {
            let offer = (from.to_owned(), offer.clone());
            if !self.offers.contains(&offer) {
                self.offers.push(offer);
            }
        }
        Ok(other)
    }

    /// What a neighbour's drones fly otherwise than known, by its border.
    fn otherwise(
        &self,
        now_s: f64,
        from: &str,
        border: &Border,
        plan: &Plan,
    ) -> Result<Vec<DronePlan>, String> {
        let known = &self.all[from];
        // Of what was taken from it, it may not know yet; nor may this planner of what was taken
        // from here, and handed on.
        let is_handed_on = |drone: &str| {
            self.owns(drone)
                && plan.drone(drone).is_some()
                && self.promised(drone).is_some_and(|area| area != from)
        };
        // Of what a third has taken near here, it may not know yet either: this planner was asked.
        let is_near = |drone: &str| {
            let flown = plan.drone(drone);
            flown.is_some_and(|it| self.site.comes_near(&plan.bounds_m, it, now_s))
        };
        let was_agreed = |drone: &str| {
            let mut settled = known.agreed.range(..=border.settled);
            settled.any(|(_, it)| it.takes.as_deref() == Some(drone))
        };
        let is_thirds = |drone: &str| {
            !self.owns(drone) && !self.is_of(drone, from) && is_near(drone) && !was_agreed(drone)
        };
        let was_its = |it: &&DronePlan| {
            !self.owes(&it.name, from) && !is_handed_on(&it.name) && !is_thirds(&it.name)
        };
        let said: Vec<DronePlan> = border.drones.iter().filter(was_its).cloned().collect();
        self.can_be(plan, (from, None), &said, now_s)?;
        let is_other = |it: &DronePlan| {
            let old = plan.drone(&it.name);
            old.is_none_or(|old| !is_same(old, it, now_s) || self.owns(&it.name))
        };
        let other: Vec<DronePlan> = said.into_iter().filter(is_other).collect();
        if border.revision == known.whole && other.iter().any(|it| self.is_of(&it.name, from)) {
            return Err(format!(
                "it says two things of revision {}",
                border.revision
            ));
        }
        self.can_fly(now_s, from, &other)?;
        // What it would say here if it flew it still is not there any more. What a neighbour may
        // have taken is said by that one.
        let is_omitted = |it: &&DronePlan| {
            self.is_of(&it.name, from)
                && self.site.matters(it, &self.name, border.at_s)
                && !border.drones.iter().any(|said| said.name == it.name)
                && self.promised(&it.name).is_none()
        };
        let omitted = plan.drones.iter().filter(is_omitted);
        let omitted = omitted.map(|it| gone(it, border.at_s.min(now_s)));
        Ok(omitted.chain(other).collect())
    }

    /// Whether drones that a neighbour speaks of, one of which it takes, can be its own, and be
    /// there.
    fn can_be(
        &self,
        plan: &Plan,
        (from, takes): (&str, Option<&str>),
        drones: &[DronePlan],
        at_s: f64,
    ) -> Result<(), String> {
        let mut names = BTreeSet::new();
        for entry in drones {
            let name = &entry.name[..];
            if !names.insert(name) {
                return Err(format!("it says two things of `{name}`"));
            }
            // What was offered may have been taken, and flown on, while nothing was heard.
            let is_known = takes == Some(name) || !self.is_taking(from, name);
            let Some(known) = plan.drone(name).filter(|_| is_known) else {
                continue;
            };
            let is_there = extent(known, at_s).is_some();
            // A drone that has left no longer blocks its name.
            let is_own = self.owns(name) && is_there;
            if takes != Some(name) && (is_own || self.owes(name, from)) {
                let owner = self.theirs.get(name).unwrap_or(&self.name);
                return Err(format!("`{name}` is of `{owner}`"));
            }
            // What is far off may have changed without this planner being told.
            let near = grown(&plan.bounds_m, self.site.reach_m);
            let places = [known, entry].map(|it| it.trajectory.position_m(at_s));
            let most_m = JUMP_M + self.unreported_distance_m(from, known, at_s);
            if let [Some(a), Some(b)] = places
                && is_there
                && is_inside(&near, &a)
                && off_m(known, at_s, &b) > most_m
            {
                let off_m = (a - b).norm();
                return Err(format!(
                    "`{name}` is {off_m:.1} m from where it said, at {at_s:.2} s"
                ));
            }
        }
        Ok(())
    }

    /// How far a drone that one neighbour speaks of, and another did so far, may have flown by a
    /// time (s) since both have told all that they fly (m).
    fn unreported_distance_m(&self, from: &str, known: &DronePlan, at_s: f64) -> f64 {
        let Some(owner) = self.theirs.get(&known.name) else {
            return 0.0;
        };
        let reported_s = [from, owner].map(|it| self.all.get(it).and_then(|it| it.reported_s));
        let [Some(from_s), Some(owner_s)] = reported_s else {
            return f64::INFINITY;
        };
        known.airframe.max_speed_mps * (at_s - from_s.min(owner_s)).max(0.0)
    }

    /// Whether drones move, since their planner told of them all, as their airframes can.
    fn can_fly(&self, now_s: f64, from: &str, drones: &[DronePlan]) -> Result<(), String> {
        let since_s = self.all[from].reported_s.unwrap_or(now_s);
        let is_too_fast = |it: &Violation| {
            let kinds = [ViolationKind::Jump, ViolationKind::Speed];
            kinds.contains(&it.kind) && it.matters_from(since_s)
        };
        for entry in drones {
            let mut alone = self.rules.clone();
            alone.drones = vec![entry.clone()];
            let mut found = planner::verify(&alone).violations.into_iter();
            if let Some(it) = found.find(is_too_fast) {
                return Err(it.to_string());
            }
        }
        Ok(())
    }
}

/// Whether two say the same of what is still flown.
fn is_same(a: &DronePlan, b: &DronePlan, from_s: f64) -> bool {
    let ends = |it: &DronePlan| {
        (
            (it.air_limit, it.at_end),
            // When it landed may be dropped with what it flew before.
            it.airborne_s.1.map(|until_s| until_s.max(from_s)),
            it.trajectory.position_m.last().copied(),
        )
    };
    let masses_kg = |it: &DronePlan| {
        let first = it.trajectory.point_at(from_s).unwrap_or(0);
        let masses_kg = it.trajectory.mass_kg.iter().skip(first);
        masses_kg.copied().collect::<Vec<f64>>()
    };
    let weigh_the_same = || {
        let [a, b] = [a, b].map(masses_kg);
        a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| (a - b).abs() < SAME_KG)
    };
    let is_there = |it: &DronePlan| {
        let times_s = it.trajectory.t_s.iter().copied();
        times_s.filter(|t_s| *t_s >= from_s).collect::<Vec<f64>>()
    };
    let (times_s, places) = (is_there(a), |it: &DronePlan, t_s| {
        it.trajectory.position_m(t_s)
    });
    a.airframe == b.airframe
        && ends(a) == ends(b)
        && weigh_the_same()
        && times_s == is_there(b)
        && { times_s.iter().copied() }.all(|t_s| match (places(a, t_s), places(b, t_s)) {
            (Some(a), Some(b)) => (a - b).norm() < SAME_M,
            _ => false,
        })
}

/// What has been flown up to a time (s) by a drone that is not there any more.
fn gone(entry: &DronePlan, at_s: f64) -> DronePlan {
    let mut entry = entry.clone();
    let flown = &mut entry.trajectory;
    // One that has not come yet does not stay.
    let at_s = flown.t_s.first().map_or(at_s, |it| it.max(at_s));
    if let Some((last, place_m)) = flown.point_at(at_s).zip(flown.position_m(at_s)) {
        flown.t_s.truncate(last + 1);
        flown.position_m.truncate(last + 1);
        flown.mass_kg.truncate(last + 1);
        flown.t_s.push(at_s);
        flown.position_m.push(place_m);
        flown.mass_kg.extend(flown.mass_kg.last().copied());
        if flown.is_smooth() {
            flown.control_m.truncate(last);
            flown.control_m.resize(last + 1, Vec::new());
        }
    }
    let (from_s, until_s) = entry.airborne_s;
    let until_s = until_s.unwrap_or(at_s).min(at_s);
    entry.airborne_s = (from_s.min(until_s), Some(until_s));
    entry.landed_s.retain(|rest_s| rest_s.1 <= until_s);
    entry.at_end = AtEnd::Leave;
    entry
}

/// How far a place is from the path of a drone up to a time (s), where it may be if it is late (m).
fn off_m(entry: &DronePlan, until_s: f64, at_m: &Point3<f64>) -> f64 {
    let flown = &entry.trajectory;
    let points = flown.t_s.iter().zip(&flown.position_m);
    let points = points.take_while(|(t_s, _)| **t_s <= until_s);
    let last_m = flown.position_m(until_s);
    let points: Vec<Point3<f64>> = points.map(|(_, it)| *it).chain(last_m).collect();
    let from_piece_m = |ends: &[Point3<f64>]| {
        let (way, to) = (ends[1] - ends[0], at_m - ends[0]);
        let share = to.dot(&way) / way.norm_squared().max(SAME_M * SAME_M);
        (to - way * share.clamp(0.0, 1.0)).norm()
    };
    let first_m = points.first().map(|it| (at_m - it).norm());
    let pieces_m = points.windows(2).map(from_piece_m);
    pieces_m.chain(first_m).fold(f64::INFINITY, f64::min)
}
