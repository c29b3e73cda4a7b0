//! One area's planner.

use std::collections::{BTreeSet, VecDeque};

use planner::plan::{AtEnd, AtStart, DronePlan};
use planner::replan::GivenError;
use planner::replan::change::{Change, ChangeError};
use planner::scenario::world::{Drone, World};
use planner::{Control, Plan, Running};

use super::message::{Border, Fact, Message, Offer, PROTOCOL, Proposal, Says, Settled, Vote};
use super::neighbourhood::{Candidate, Neighbourhood};
use super::site::{Site, extent, is_inside};
use super::{Record, Refused};
use crate::handler::{asked, name_of, tasks};
use crate::message::{OneChange, Refusal, Task};

/// How often neighbours are told of the border (s). Chosen here: a third of [`Site::silent_s`]'s
/// usual value.
const TELL_S: f64 = 1.0;
/// For how long a planner speaks for its drones at least (s). Chosen here: as long as people need
/// to start it again.
const SPEAKS_S: f64 = 60.0;
/// How much of what was flown is kept (s), and how often the rest is dropped. Chosen here: longer
/// than air is under way.
const HISTORY_S: f64 = 60.0;
/// How many of what is counted one by one are kept, the last ones. Chosen here: enough for a
/// percentile.
const MOST_KEPT: usize = 1000;

/// What has been counted since the planner began.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counts {
    /// Changes flown without asking a neighbour.
    pub alone: u64,
    /// Proposals made.
    pub proposed: u64,
    /// Of these, flown.
    pub flown: u64,
    /// Drones taken over.
    pub taken: u64,
    /// Proposals of neighbours agreed to, and not.
    pub votes: [u64; 2],
    /// Times that own drones were replanned for events.
    pub gave_way: u64,
    /// From proposal to agreement of all (s), each of the last ones.
    pub agreed_in_s: VecDeque<f64>,
    /// Impossible statements of neighbours, the last ones, with the neighbour.
    pub contradictions: VecDeque<(String, String)>,
}

/// Keeps one more of the last ones.
fn keep<T>(all: &mut VecDeque<T>, one: T) {
    all.push_back(one);
    if all.len() > MOST_KEPT {
        all.pop_front();
    }
}

/// A proposal of this planner.
#[derive(Clone, Debug)]
struct Mine {
    proposal: Proposal,
    since_s: f64,
    candidate: Running,
    changes: Vec<OneChange>,
    took: Option<Offer>,
    /// Missing votes.
    missing: BTreeSet<String>,
    /// All neighbours that were asked.
    asked: BTreeSet<String>,
}

/// The planner of one area.
#[derive(Clone, Debug)]
pub struct Area {
    name: String,
    /// Its plan, with what neighbours fly near its world.
    pub(super) running: Running,
    known: Neighbourhood,
    /// Of its plan.
    pub(super) revision: u64,
    number: u64,
    settled: u64,
    /// No change, of its own drones or of others, was from later (s).
    clock_s: f64,
    tidied_s: f64,
    reported_s: f64,
    mine: Option<Mine>,
    outbox: Vec<Message>,
    records: Vec<Record>,
    counts: Counts,
}

impl Area {
    /// Takes over the plan of an area's own drones.
    ///
    /// # Errors
    /// The plan is not one of this world, or cannot be flown.
    pub fn new(site: Site, name: &str, world: World, plan: Plan) -> Result<Area, GivenError> {
        let rules = Plan {
            drones: Vec::new(),
            unplanned: Vec::new(),
            violations: Vec::new(),
            ..plan.clone()
        };
        let running = Running::new(world, plan)?;
        let known = Neighbourhood::new(site, name, rules);
        Ok(Area {
            name: name.to_owned(),
            running,
            known,
            revision: 1,
            number: 0,
            settled: 0,
            clock_s: 0.0,
            tidied_s: 0.0,
            reported_s: f64::NEG_INFINITY,
            mine: None,
            outbox: Vec::new(),
            records: Vec::new(),
            counts: Counts::default(),
        })
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the drones of its plan fly, without exposures.
    pub fn drones(&self) -> &[DronePlan] {
        &self.running.flown().drones
    }

    /// The drones that this planner answers for.
    pub fn own(&self) -> impl Iterator<Item = &DronePlan> {
        let drones = self.drones().iter();
        drones.filter(|it| self.known.owns(&it.name))
    }

    /// A proposal is under way.
    pub fn is_busy(&self) -> bool {
        self.mine.is_some()
    }

    /// What has been counted.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Messages to be sent, once what [`Area::take_records`] gives is kept.
    pub fn take_messages(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.outbox)
    }

    /// What a journal has to keep.
    pub fn take_records(&mut self) -> Vec<Record> {
        std::mem::take(&mut self.records)
    }

    /// Changes the own drones from [`Site::lead_s`] on: at once where no neighbour is affected,
    /// else by a proposal. `true`: it is flown.
    ///
    /// # Errors
    /// Why not; then nothing has changed.
    pub fn ask(&mut self, now_s: f64, changes: Vec<OneChange>) -> Result<bool, Refused> {
        self.propose(now_s, changes, None)
    }

    /// What has happened to own drones (late, failed, removed): it is flown already. The neighbours
    /// are told, and replan around it.
    ///
    /// # Errors
    /// The changes are not in order; then nothing has changed.
    pub fn report(&mut self, at_s: f64, changes: Vec<OneChange>) -> Result<(), Refused> {
        let at_s = at_s.max(self.clock_s);
        let (candidate, changed) = self.planned(at_s, &changes, None)?;
        self.drop_mine();
        let before = std::mem::replace(&mut self.running, candidate);
        self.flown(at_s, changes, None, 0);
        self.tell_fact(&before, &changed);
        Ok(())
    }

    /// Offers an own drone that hovers, or will, in the strip shared with a neighbour. What it
    /// still has to do goes with it.
    ///
    /// # Errors
    /// It is not an own drone that ends hovering in the neighbour's world, it is promised already,
    /// or a task lies outside that world.
    pub fn offer(&mut self, to: &str, offer: Offer) -> Result<(), Refused> {
        let wrong = |why: &str| {
            let what = format!("`{}` cannot be offered to `{to}`: {why}", offer.drone);
            Err(Refused::Changes(vec![what]))
        };
        let Some(bounds_m) = self.known.site().areas.get(to) else {
            return wrong("no area is called that");
        };
        let own = self.running.flown().drone(&offer.drone);
        let Some(entry) = own.filter(|it| self.known.owns(&it.name)) else {
            return wrong("it is not planned here");
        };
        let ends_m = entry.trajectory.position_m.last();
        if entry.at_end != AtEnd::Hover || !ends_m.is_some_and(|it| is_inside(bounds_m, it)) {
            return wrong("it does not end hovering in that world");
        }
        if let Some(area) = self.known.promised(&offer.drone) {
            return wrong(&format!("it is promised to `{area}`"));
        }
        let is_beyond = |it: &Task| !is_inside(bounds_m, &it.to_m.into());
        if let Some(index) = offer.tasks.iter().position(is_beyond) {
            return wrong(&format!("task {} lies outside that world", index + 1));
        }
        let to = to.to_owned();
        self.enact(Record::Offered { to, offer });
        // With the next border, and every one from then on.
        self.reported_s = f64::NEG_INFINITY;
        Ok(())
    }

    /// Takes an offer back.
    ///
    /// # Errors
    /// It is not offered, or a neighbour may take it by a proposal that was agreed to.
    pub fn withdraw(&mut self, drone: &str) -> Result<(), Refused> {
        let wrong = |why: String| Err(Refused::Changes(vec![format!("`{drone}` {why}")]));
        if let Some(area) = self.known.promised(drone) {
            return wrong(format!("is promised to `{area}`"));
        }
        if !self.known.offers(drone) {
            return wrong("is not offered".to_owned());
        }
        let drone = drone.to_owned();
        self.enact(Record::Withdrawn { drone });
        self.reported_s = f64::NEG_INFINITY;
        Ok(())
    }

    /// A drone is offered to a neighbour.
    pub fn is_offered(&self, drone: &str) -> bool {
        self.known.offers(drone)
    }

    /// The work due as time passes: drops proposals not agreed to in time, sends neighbours the
    /// border, takes offers.
    pub fn tick(&mut self, now_s: f64) {
        if (self.mine.as_ref()).is_some_and(|it| now_s >= it.proposal.from_s) {
            self.drop_mine();
        }
        if now_s - self.reported_s >= TELL_S {
            self.reported_s = now_s;
            for neighbour in self.known.names() {
                let border = self.border(&neighbour, now_s);
                self.say(&neighbour, Says::Border(border));
            }
        }
        if self.mine.is_none() {
            self.take_offer(now_s);
        }
        if self.mine.is_none() && now_s - self.tidied_s >= HISTORY_S {
            self.tidied_s = now_s;
            self.running.forget(now_s - HISTORY_S);
            self.records.push(Record::Forgot {
                before_s: now_s - HISTORY_S,
            });
        }
    }

    /// All that may matter to a neighbour now.
    pub fn border(&self, neighbour: &str, now_s: f64) -> Border {
        let drones = self
            .known
            .border_drones(self.running.flown(), neighbour, now_s);
        let ends_s = drones.iter().filter_map(|it| it.trajectory.t_s.last());
        Border {
            revision: self.revision,
            at_s: now_s,
            until_s: ends_s.copied().fold(now_s + SPEAKS_S, f64::max),
            settled: self.settled,
            heard: self.known.knows(neighbour),
            drones,
            offers: self.known.offered_to(neighbour),
        }
    }

    /// Handles a neighbour's message. An impossible one is refused: its last wakes stay.
    pub fn receive(&mut self, now_s: f64, message: &Message) {
        let from = &message.from;
        if message.to != self.name || !self.known.has(from) {
            return;
        }
        let heard = match &message.says {
            _ if message.protocol != PROTOCOL => Err(format!(
                "it speaks `{}`, this planner `{PROTOCOL}`",
                message.protocol
            )),
            Says::Border(border) => self.hear_border(now_s, from, border),
            Says::Propose(proposal) => self.hear_proposal(now_s, from, proposal),
            Says::Vote(vote) => self.hear_vote(now_s, from, vote),
            Says::Settle(settled) => self.hear_settled(now_s, from, *settled),
            Says::Fact(fact) => self.hear_fact(now_s, from, fact),
        };
        match heard {
            Ok(()) => self.known.heard(now_s, from),
            Err(what) => keep(&mut self.counts.contradictions, (from.clone(), what)),
        }
    }

    /// Does again what a journal has kept.
    ///
    /// # Errors
    /// A record that does not follow from those before it.
    pub fn replay(&mut self, record: Record) -> Result<(), Refused> {
        match record {
            Record::Changed {
                revision,
                at_s,
                changes,
                took,
                number,
            } => {
                if revision != self.revision + 1 {
                    let now = self.revision;
                    let what = format!("revision {revision} does not follow revision {now}");
                    return Err(Refused::Changes(vec![what]));
                }
                let (candidate, _) = self.planned(at_s, &changes, took.as_ref())?;
                self.running = candidate;
                self.number = self.number.max(number);
                self.flown(at_s, changes, took, number);
            }
            Record::Noted {
                at_s,
                from,
                number,
                drones,
                gave_way,
            } => {
                let done = self.note(at_s, (&from, number), &drones, gave_way);
                done.map_err(|it| Refused::Changes(vec![it]))?;
            }
            Record::Proposed { number } => {
                self.number = self.number.max(number);
                // If nothing says that it is flown, it is dropped.
                self.settled = self.settled.max(number);
            }
            Record::Forgot { before_s } => self.running.forget(before_s),
            of_neighbours => self.known.enact(&of_neighbours),
        }
        self.records.clear();
        Ok(())
    }

    fn propose(
        &mut self,
        now_s: f64,
        changes: Vec<OneChange>,
        took: Option<Offer>,
    ) -> Result<bool, Refused> {
        if self.mine.is_some() {
            return Err(Refused::Busy);
        }
        let names = changes.iter().map(name_of);
        if let Some(it) = { names }.find(|it| self.known.offers(it)) {
            return Err(Refused::Offered(it.to_owned()));
        }
        let at_s = (now_s + self.known.site().lead_s).max(self.clock_s);
        let (candidate, changed) = self.planned(at_s, &changes, took.as_ref())?;
        let comes = coming(&changes, took.as_ref());
        self.is_sound(&candidate, &comes, at_s)?;
        let plan = candidate.flown();
        let wanted = Candidate {
            plan,
            changed: &changed,
            comes: &comes,
            took: took.as_ref(),
            at_s,
        };
        let asked = self.known.asked(now_s, self.running.flown(), &wanted)?;
        if asked.is_empty() {
            self.running = candidate;
            self.counts.alone += 1;
            self.flown(at_s, changes, took, 0);
            return Ok(true);
        }
        let drones = entries(plan, &changed);
        self.number += 1;
        self.records.push(Record::Proposed {
            number: self.number,
        });
        self.counts.proposed += 1;
        let proposal = Proposal {
            number: self.number,
            revision: self.revision + 1,
            seen: 0,
            from_s: at_s,
            drones,
            takes: took.as_ref().map(|it| it.drone.clone()),
        };
        for area in &asked {
            let seen = self.known.revision(area);
            let proposal = proposal.clone();
            self.say(area, Says::Propose(Proposal { seen, ..proposal }));
        }
        self.mine = Some(Mine {
            proposal,
            since_s: now_s,
            candidate,
            changes,
            took,
            missing: asked.clone(),
            asked,
        });
        Ok(false)
    }

    /// The plan with changes, and the drones that fly something else.
    fn planned(
        &self,
        at_s: f64,
        changes: &[OneChange],
        took: Option<&Offer>,
    ) -> Result<(Running, Vec<String>), Refused> {
        let told =
            |all: &[Refusal]| Refused::Changes(all.iter().map(|it| it.message.clone()).collect());
        let is_theirs = |name: &str| {
            let known = self
                .running
                .flown()
                .drone(name)
                .filter(|_| !self.known.owns(name));
            known.is_some_and(|it| extent(it, at_s).is_some())
        };
        let theirs = added(changes).filter(|it| is_theirs(it));
        let theirs: Vec<String> = theirs
            .map(|it| format!("`{it}` is a neighbour's; give the drone that comes another name"))
            .collect();
        if !theirs.is_empty() {
            return Err(Refused::Changes(theirs));
        }
        let mut candidate = self.running.clone();
        let mut changes = asked(&candidate, at_s, changes).map_err(|it| told(&it))?;
        changes.extend(took.and_then(|it| self.taken(it)));
        let wanted: BTreeSet<String> = changes.iter().map(|it| it.drone().to_owned()).collect();
        let told = candidate.replan(at_s, &changes, &Control::QUIET);
        let told = told.map_err(|errors| {
            Refused::Changes(errors.iter().map(ChangeError::to_string).collect())
        })?;
        let out = told.refused.iter().filter(|it| wanted.contains(&it.name));
        let out: Vec<String> = out
            .map(|it| format!("`{}`: {}", it.name, it.reason))
            .collect();
        let is_fact = |it: &Change| {
            matches!(
                it,
                Change::Late { .. } | Change::Removed { .. } | Change::Failed { .. }
            )
        };
        if !out.is_empty() && !changes.iter().all(is_fact) {
            return Err(Refused::Changes(out));
        }
        let changed = told.changed.into_iter().map(|it| it.drone);
        Ok((candidate, changed.collect()))
    }

    /// A drone that is offered, as one that comes to where it hovers.
    fn taken(&self, offer: &Offer) -> Option<Change> {
        let entry = self.running.flown().drone(&offer.drone)?;
        let density_kg_per_m3 = self.running.flown().air.density_kg_per_m3;
        Some(Change::Added(Drone {
            name: offer.drone.clone(),
            vehicle: entry.airframe.vehicle(density_kg_per_m3).ok()?,
            start_m: *entry.trajectory.position_m.last()?,
            at_start: AtStart::Hover,
            tasks: tasks(&offer.tasks),
            at_end: offer.at_end,
            air_limit: entry.air_limit,
        }))
    }

    /// Whether the verifier finds nothing new of own drones, those that come included.
    fn is_sound(
        &self,
        candidate: &Running,
        comes: &BTreeSet<&str>,
        at_s: f64,
    ) -> Result<(), Refused> {
        let plans = [self.running.flown(), candidate.flown()];
        match self.known.violated(plans, comes, at_s) {
            Some(it) => Err(Refused::NotVerified(it.to_string())),
            None => Ok(()),
        }
    }

    /// The candidate is the plan now.
    fn flown(&mut self, at_s: f64, changes: Vec<OneChange>, took: Option<Offer>, number: u64) {
        self.revision += 1;
        self.clock_s = self.clock_s.max(at_s);
        self.settled = self.settled.max(number);
        let comes = coming(&changes, took.as_ref());
        self.known.own(&comes, took.as_ref(), number);
        self.counts.taken += u64::from(took.is_some());
        self.records.push(Record::Changed {
            revision: self.revision,
            at_s,
            changes,
            took,
            number,
        });
    }

    fn drop_mine(&mut self) {
        if let Some(mine) = self.mine.take() {
            let number = mine.proposal.number;
            self.settled = number;
            for area in &mine.asked {
                let is_flown = false;
                self.say(area, Says::Settle(Settled { number, is_flown }));
            }
        }
    }

    fn hear_proposal(&mut self, now_s: f64, from: &str, it: &Proposal) -> Result<(), String> {
        let own = (self.running.flown(), self.revision);
        self.known.hear_proposal(now_s, from, it, own)?;
        let against = self.against(now_s, from, it);
        self.counts.votes[usize::from(against.is_some())] += 1;
        if against.is_none() {
            self.enact(Record::Agreed {
                from: from.to_owned(),
                proposal: it.clone(),
            });
        }
        let number = it.number;
        self.say(from, Says::Vote(Vote { number, against }));
        Ok(())
    }

    /// Why a proposal may not be flown.
    fn against(&mut self, now_s: f64, from: &str, it: &Proposal) -> Option<String> {
        if now_s >= it.from_s {
            return Some("it comes too late".to_owned());
        }
        let plan = self.running.flown();
        let keeps = |drone| self.known.keeps(plan, from, drone);
        let found = it.takes.as_deref().and_then(keeps);
        let found = found.or_else(|| {
            self.known
                .conflict_with_proposal(plan, &BTreeSet::new(), it)
        });
        if found.is_some() {
            return found;
        }
        let mine = self.mine.as_ref()?;
        let comes = coming(&mine.changes, mine.took.as_ref());
        let found = (self.known).conflict_with_proposal(mine.candidate.flown(), &comes, it)?;
        // Of two that propose at once the first by name goes first.
        if from < &self.name[..] {
            self.drop_mine();
            return None;
        }
        Some(found)
    }

    fn hear_vote(&mut self, now_s: f64, from: &str, vote: &Vote) -> Result<(), String> {
        let Some(mine) = &mut self.mine else {
            return Ok(());
        };
        if vote.number > mine.proposal.number {
            return Err(format!(
                "it votes on proposal {}, there is none such yet",
                vote.number
            ));
        }
        if vote.number < mine.proposal.number {
            return Ok(());
        }
        mine.missing.remove(from);
        if vote.against.is_some() || now_s >= mine.proposal.from_s {
            self.drop_mine();
        } else if mine.missing.is_empty()
            && let Some(mine) = self.mine.take()
        {
            let number = mine.proposal.number;
            self.running = mine.candidate;
            self.counts.flown += 1;
            keep(&mut self.counts.agreed_in_s, now_s - mine.since_s);
            self.flown(mine.proposal.from_s, mine.changes, mine.took, number);
            for area in &mine.asked {
                let is_flown = true;
                self.say(area, Says::Settle(Settled { number, is_flown }));
            }
        }
        Ok(())
    }

    fn hear_settled(&mut self, now_s: f64, from: &str, settled: Settled) -> Result<(), String> {
        let number = settled.number;
        match self.known.hear_settled(from, settled)? {
            None => Ok(()),
            Some(proposal) if settled.is_flown => {
                self.noted(now_s, (from, number), &proposal.drones)
            }
            Some(_) => {
                self.drop_agreed(from, number);
                Ok(())
            }
        }
    }

    fn hear_fact(&mut self, now_s: f64, from: &str, fact: &Fact) -> Result<(), String> {
        let plan = self.running.flown();
        self.known.hear_fact(now_s, from, fact, plan)?;
        let settled = self.known.settled(from);
        self.noted(now_s, (from, settled), &fact.drones)
    }

    fn hear_border(&mut self, now_s: f64, from: &str, border: &Border) -> Result<(), String> {
        if self.known.follows(from, border)? {
            self.enact(Record::Knows {
                from: from.to_owned(),
                number: border.heard,
            });
        }
        let plan = self.running.flown();
        let other = self.known.hear_border(now_s, from, border, plan)?;
        for number in self.known.open(from, border.settled) {
            self.drop_agreed(from, number);
        }
        if other.is_empty() {
            return Ok(());
        }
        self.noted(now_s, (from, border.settled), &other)
    }

    /// A neighbour's drones fly something else; own drones are replanned where they must be.
    fn noted(
        &mut self,
        now_s: f64,
        (from, number): (&str, u64),
        drones: &[DronePlan],
    ) -> Result<(), String> {
        // What is proposed was not planned around them.
        self.drop_mine();
        let at_s = now_s.max(self.clock_s);
        let (before, revision) = (self.running.clone(), self.revision);
        self.note(at_s, (from, number), drones, false)?;
        let plans = [before.flown(), self.running.flown()];
        let violated = self.known.violated(plans, &BTreeSet::new(), at_s);
        if violated.is_none() {
            return Ok(());
        }
        self.records.pop();
        (self.running, self.revision) = (before.clone(), revision);
        self.note(at_s, (from, number), drones, true)?;
        self.counts.gave_way += 1;
        let is_other =
            |it: &&DronePlan| before.flown().drone(&it.name).is_some_and(|old| old != *it);
        let changed = self.own().filter(is_other).map(|it| it.name.clone());
        let changed: Vec<String> = changed.collect();
        self.tell_fact(&before, &changed);
        Ok(())
    }

    fn note(
        &mut self,
        at_s: f64,
        (from, number): (&str, u64),
        drones: &[DronePlan],
        gave_way: bool,
    ) -> Result<(), String> {
        let wrong = |errors: Vec<ChangeError>| {
            let all: Vec<String> = errors.iter().map(ChangeError::to_string).collect();
            all.join("; ")
        };
        if gave_way {
            let fixed = |it: &DronePlan| Change::Fixed(Box::new(it.clone()));
            let changes: Vec<Change> = drones.iter().map(fixed).collect();
            let told = self.running.replan(at_s, &changes, &Control::QUIET);
            told.map_err(wrong)?;
        } else {
            self.running.note(at_s, drones).map_err(wrong)?;
        }
        self.clock_s = self.clock_s.max(at_s);
        // What is said of drones that have gone on has changed, too.
        if self.known.note(from, number, drones) || gave_way {
            self.revision += 1;
        }
        self.records.push(Record::Noted {
            at_s,
            from: from.to_owned(),
            number,
            drones: drones.to_vec(),
            gave_way,
        });
        Ok(())
    }

    fn drop_agreed(&mut self, from: &str, number: u64) {
        let from = from.to_owned();
        self.enact(Record::Dropped { from, number });
    }

    /// Does what a journal keeps of neighbours, and has it kept.
    fn enact(&mut self, record: Record) {
        self.known.enact(&record);
        self.records.push(record);
    }

    /// Tells the neighbours that it may matter to.
    fn tell_fact(&mut self, before: &Running, changed: &[String]) {
        for area in self.known.names() {
            let matters = |name: &String| {
                let plans = [self.running.flown(), before.flown()];
                let mut both = plans.into_iter().filter_map(|plan| plan.drone(name));
                both.any(|it| self.known.site().matters(it, &area, self.clock_s))
            };
            let near = changed.iter().filter(|it| matters(it));
            let drones = entries(self.running.flown(), near);
            if !drones.is_empty() {
                let revision = self.revision;
                self.say(&area, Says::Fact(Fact { revision, drones }));
            }
        }
    }

    /// Proposes to take the first drone that is offered and hovers: what it still flies would be in
    /// no plan.
    fn take_offer(&mut self, now_s: f64) {
        let plan = self.running.flown();
        let hovers = |drone: &str| {
            plan.drone(drone).is_some_and(|it| {
                let last_s = it.trajectory.t_s.last().copied().unwrap_or(0.0);
                it.at_end == AtEnd::Hover && last_s <= now_s
            })
        };
        // What is refused now is tried again after all others.
        if let Some(offer) = self.known.next_offer(hovers) {
            let _ = self.propose(now_s, Vec::new(), Some(offer));
        }
    }

    fn say(&mut self, to: &str, says: Says) {
        self.outbox.push(Message {
            protocol: PROTOCOL.to_owned(),
            from: self.name.clone(),
            to: to.to_owned(),
            says,
        });
    }
}

/// The drones that are to be let in.
fn added(changes: &[OneChange]) -> impl Iterator<Item = &str> {
    changes.iter().filter_map(|it| match it {
        OneChange::Add(it) => Some(&it.drone[..]),
        _ => None,
    })
}

/// The drones that are own with changes: those let in, and the one taken.
fn coming<'a>(changes: &'a [OneChange], took: Option<&'a Offer>) -> BTreeSet<&'a str> {
    let taken = took.map(|it| &it.drone[..]);
    added(changes).chain(taken).collect()
}

fn entries<'a>(plan: &Plan, names: impl IntoIterator<Item = &'a String>) -> Vec<DronePlan> {
    let entries = names.into_iter().filter_map(|it| plan.drone(it));
    entries.cloned().collect()
}
