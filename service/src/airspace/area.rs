//! One area's planner.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;

use nalgebra::Point3;
use planner::plan::{AtEnd, AtStart, Bounds, DronePlan, Violation, ViolationKind};
use planner::replan::GivenError;
use planner::replan::change::{Change, ChangeError};
use planner::scenario::world::{Drone, World};
use planner::{Control, Plan, Running};

use super::Record;
use super::message::{Border, Fact, Message, Offer, PROTOCOL, Proposal, Says, Settled, Vote};
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
/// How far a drone may be from where it was said to be, or to have come by (m). Chosen here, as for
/// positions that come in.
const JUMP_M: f64 = 5.0;
/// Slack in comparing times (s), places (m) and masses (kg).
const SAME_S: f64 = 1e-6;
const SAME_M: f64 = 1e-6;
const SAME_KG: f64 = 1e-6;
/// How many of what is counted one by one are kept, the last ones. Chosen here: enough for a
/// percentile.
const MOST_KEPT: usize = 1000;

/// What all planners of a site agree on.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// The worlds of the areas, by name: each with the strips that it shares with its neighbours.
    pub areas: BTreeMap<String, Bounds>,
    /// How far beside itself a drone's wake or body matters to another at most (m).
    pub reach_m: f64,
    /// How long after it is asked a change is to be flown (s): planning, and a message there and
    /// back.
    pub lead_s: f64,
    /// A planner that was not heard for so long is silent (s).
    pub silent_s: f64,
}

/// Why a change is not made, or not proposed.
#[derive(Clone, Debug, PartialEq)]
pub enum Refused {
    /// A proposal is under way: ask again.
    Busy,
    /// The changes are not in order, or find no path.
    Changes(Vec<String>),
    /// The verifier finds this, against all that is known of the neighbours.
    NotVerified(String),
    /// It comes near the world of a neighbour that is not heard.
    Silent(String),
    /// It comes within reach of where the drones of a neighbour come down that is not heard any
    /// more, and nearer than what is flown now, or takes one of them.
    Closed(String),
    /// The drone is offered to a neighbour.
    Offered(String),
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refused::Busy => f.write_str("a proposal is under way"),
            Refused::Changes(all) => f.write_str(&all.join("; ")),
            Refused::NotVerified(what) => f.write_str(what),
            Refused::Silent(area) => write!(f, "near the world of `{area}`, which is not heard"),
            Refused::Closed(area) => {
                write!(f, "`{area}` is lost, and its drones come down in its area")
            }
            Refused::Offered(drone) => write!(f, "`{drone}` is offered to a neighbour"),
        }
    }
}

impl std::error::Error for Refused {}

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
    /// Times that own drones gave way to what had happened.
    pub gave_way: u64,
    /// From proposal to agreement of all (s), each of the last ones.
    pub agreed_in_s: VecDeque<f64>,
    /// What neighbours said last that cannot be, with who said it.
    pub contradictions: VecDeque<(String, String)>,
}

/// Keeps one more of the last ones.
fn keep<T>(all: &mut VecDeque<T>, one: T) {
    all.push_back(one);
    if all.len() > MOST_KEPT {
        all.pop_front();
    }
}

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
    told_s: Option<f64>,
    /// Up to when it speaks for its drones (s).
    until_s: f64,
    /// What was agreed to, by number: room is kept for it.
    agreed: BTreeMap<u64, Proposal>,
}

impl Neighbour {
    /// Up to which proposal it is known of each what became of it.
    fn knows(&self) -> u64 {
        let open = self.agreed.keys().next();
        open.map_or(self.settled, |open| self.settled.min(open - 1))
    }
}

/// What this planner has proposed.
#[derive(Clone, Debug)]
struct Mine {
    proposal: Proposal,
    since_s: f64,
    candidate: Running,
    changes: Vec<OneChange>,
    took: Option<(String, Offer)>,
    /// Whose vote is missing.
    missing: BTreeSet<String>,
    /// All that were asked.
    asked: BTreeSet<String>,
}

/// The planner of one area.
#[derive(Clone, Debug)]
pub struct Area {
    name: String,
    site: Site,
    running: Running,
    /// A plan without drones, by which parts of it are judged.
    rules: Plan,
    revision: u64,
    number: u64,
    settled: u64,
    /// No change, of its own drones or of others, was from later (s).
    clock_s: f64,
    tidied_s: f64,
    told_s: f64,
    /// Drones that are not its own, and whose they are.
    theirs: BTreeMap<String, String>,
    neighbours: BTreeMap<String, Neighbour>,
    mine: Option<Mine>,
    /// Own drones that are offered, to whom, and with what.
    offered: BTreeMap<String, (String, Offer)>,
    /// Drones that can be taken, and from whom: as neighbours' last borders say.
    offers: Vec<(String, Offer)>,
    /// Drones that were taken, and from whom, by which proposal: until that neighbour knows, and
    /// whichever planner has them by then.
    owed: BTreeMap<(String, String), u64>,
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
        let bounds_m = running.plan().bounds_m;
        let is_near = |it: &Bounds| meet(&grown(it, 2.0 * site.reach_m), &bounds_m);
        let others = site.areas.iter().filter(|(other, _)| *other != name);
        let neighbours = others.filter(|(_, it)| is_near(it));
        let neighbours = neighbours.map(|(other, _)| (other.clone(), Neighbour::default()));
        Ok(Area {
            name: name.to_owned(),
            neighbours: neighbours.collect(),
            site,
            running,
            rules,
            revision: 1,
            number: 0,
            settled: 0,
            clock_s: 0.0,
            tidied_s: 0.0,
            told_s: f64::NEG_INFINITY,
            theirs: BTreeMap::new(),
            mine: None,
            offered: BTreeMap::new(),
            offers: Vec::new(),
            owed: BTreeMap::new(),
            outbox: Vec::new(),
            records: Vec::new(),
            counts: Counts::default(),
        })
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The plan, with what neighbours fly near its world.
    pub fn plan(&self) -> &Plan {
        self.running.plan()
    }

    /// The drones that this planner answers for.
    pub fn own(&self) -> impl Iterator<Item = &DronePlan> {
        let drones = self.running.plan().drones.iter();
        drones.filter(|it| !self.theirs.contains_key(&it.name))
    }

    /// Of its plan.
    pub fn revision(&self) -> u64 {
        self.revision
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

    /// Changes the own drones from [`Site::lead_s`] on: at once where no neighbour is concerned,
    /// else proposed. `true`: it is flown.
    ///
    /// # Errors
    /// Why not; then nothing has changed.
    pub fn ask(&mut self, now_s: f64, changes: Vec<OneChange>) -> Result<bool, Refused> {
        self.propose(now_s, changes, None)
    }

    /// What has happened to own drones (late, failed, removed): it is flown already. The neighbours
    /// are told, and give way.
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
        let Some(bounds_m) = self.site.areas.get(to) else {
            return wrong("no area is called that");
        };
        let Some(entry) = self.own().find(|it| it.name == offer.drone) else {
            return wrong("it is not planned here");
        };
        let ends_m = entry.trajectory.position_m.last();
        if entry.at_end != AtEnd::Hover || !ends_m.is_some_and(|it| is_inside(bounds_m, it)) {
            return wrong("it does not end hovering in that world");
        }
        if let Some(area) = self.promised(&offer.drone) {
            return wrong(&format!("it is promised to `{area}`"));
        }
        let is_beyond = |it: &Task| !is_inside(bounds_m, &it.to_m.into());
        if let Some(index) = offer.tasks.iter().position(is_beyond) {
            return wrong(&format!("task {} lies outside that world", index + 1));
        }
        self.records.push(Record::Offered {
            to: to.to_owned(),
            offer: offer.clone(),
        });
        self.offered
            .insert(offer.drone.clone(), (to.to_owned(), offer));
        // With the next border, and every one from then on.
        self.told_s = f64::NEG_INFINITY;
        Ok(())
    }

    /// Takes an offer back.
    ///
    /// # Errors
    /// It is not offered, or a neighbour may take it by a proposal that was agreed to.
    pub fn withdraw(&mut self, drone: &str) -> Result<(), Refused> {
        let wrong = |why: String| Err(Refused::Changes(vec![format!("`{drone}` {why}")]));
        if let Some(area) = self.promised(drone) {
            return wrong(format!("is promised to `{area}`"));
        }
        if self.offered.remove(drone).is_none() {
            return wrong("is not offered".to_owned());
        }
        self.records.push(Record::Withdrawn {
            drone: drone.to_owned(),
        });
        self.told_s = f64::NEG_INFINITY;
        Ok(())
    }

    /// A drone is offered to a neighbour.
    pub fn is_offered(&self, drone: &str) -> bool {
        self.offered.contains_key(drone)
    }

    /// What has to be done as time goes by: proposals that were not agreed to in time are dropped,
    /// neighbours are told of the border, offers are taken.
    pub fn tick(&mut self, now_s: f64) {
        if (self.mine.as_ref()).is_some_and(|it| now_s >= it.proposal.from_s) {
            self.drop_mine();
        }
        if now_s - self.told_s >= TELL_S {
            self.told_s = now_s;
            let all: Vec<String> = self.neighbours.keys().cloned().collect();
            for neighbour in all {
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
        let is_told = |it: &&DronePlan| {
            let is_near = || self.owns(&it.name) && self.matters(it, neighbour, now_s);
            self.owes(&it.name, neighbour) || is_near()
        };
        let drones = self.running.plan().drones.iter().filter(is_told);
        let drones: Vec<DronePlan> = drones.cloned().collect();
        let ends_s = drones.iter().filter_map(|it| it.trajectory.t_s.last());
        Border {
            revision: self.revision,
            at_s: now_s,
            until_s: ends_s.copied().fold(now_s + SPEAKS_S, f64::max),
            settled: self.settled,
            heard: self.neighbours.get(neighbour).map_or(0, Neighbour::knows),
            drones,
            offers: (self.offered.values())
                .filter(|(to, _)| to == neighbour)
                .map(|(_, offer)| offer.clone())
                .collect(),
        }
    }

    /// Hears what a neighbour says. What cannot be is refused: the neighbour's last wakes stay.
    pub fn receive(&mut self, now_s: f64, message: &Message) {
        let from = &message.from;
        if message.to != self.name || !self.neighbours.contains_key(from) {
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
            Ok(()) => {
                if let Some(it) = self.neighbours.get_mut(from) {
                    it.heard_s = Some(now_s);
                }
            }
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
                let took = took.map(|offer| {
                    let from = self.theirs.get(&offer.drone).cloned().unwrap_or_default();
                    (from, offer)
                });
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
            Record::Agreed { from, proposal } => {
                if let Some(it) = self.neighbours.get_mut(&from) {
                    it.number = proposal.number;
                    it.agreed.insert(proposal.number, proposal);
                }
            }
            Record::Dropped { from, number } => self.forget_agreed(&from, number),
            Record::Knows { from, number } => {
                self.forget_owed(&from, number);
            }
            Record::Proposed { number } => {
                self.number = self.number.max(number);
                // If nothing says that it is flown, it is dropped.
                self.settled = self.settled.max(number);
            }
            Record::Offered { to, offer } => {
                self.offered.insert(offer.drone.clone(), (to, offer));
            }
            Record::Withdrawn { drone } => {
                self.offered.remove(&drone);
            }
            Record::Forgot { before_s } => self.running.forget(before_s),
        }
        self.records.clear();
        Ok(())
    }

    fn propose(
        &mut self,
        now_s: f64,
        changes: Vec<OneChange>,
        took: Option<(String, Offer)>,
    ) -> Result<bool, Refused> {
        if self.mine.is_some() {
            return Err(Refused::Busy);
        }
        let names = changes.iter().map(name_of);
        if let Some(it) = { names }.find(|it| self.offered.contains_key(*it)) {
            return Err(Refused::Offered(it.to_owned()));
        }
        let at_s = (now_s + self.site.lead_s).max(self.clock_s);
        let (candidate, changed) = self.planned(at_s, &changes, took.as_ref())?;
        let comes = coming(&changes, took.as_ref());
        self.is_sound(&candidate, &comes, at_s)?;
        let plan = candidate.plan();
        let found = |plan: &'_ Plan, name: &str| plan.drones.iter().position(|it| it.name == name);
        let mut asked = BTreeSet::new();
        for (area, neighbour) in &self.neighbours {
            for proposal in neighbour.agreed.values() {
                let from_s = proposal.from_s.min(at_s);
                let found = self.conflict(plan, &comes, &proposal.drones, from_s);
                found.map_or(Ok(()), |it| Err(Refused::NotVerified(it)))?;
            }
            let matters = |name: &String| {
                let [new, old] = [plan, self.running.plan()].map(|plan| {
                    found(plan, name).is_some_and(|it| self.matters(&plan.drones[it], area, at_s))
                });
                new || old
            };
            if !changed.iter().any(matters) && took.as_ref().is_none_or(|it| it.0 != *area) {
                continue;
            }
            match neighbour.heard_s {
                Some(heard_s) if now_s - heard_s <= self.site.silent_s => {
                    asked.insert(area.clone());
                }
                Some(_) if neighbour.until_s < now_s => {
                    // It is not there to be asked; who goes away from its world may.
                    let is_taken = took.as_ref().is_some_and(|it| it.0 == *area);
                    let mut near = changed.iter().filter(|it| matters(it));
                    let is_nearer = |name: &String| {
                        let [new, old] = [plan, self.running.plan()].map(|plan| {
                            let entry = found(plan, name).map(|it| &plan.drones[it]);
                            entry.and_then(|it| self.off_world_m(it, area, at_s))
                        });
                        new.is_some_and(|new| old.is_none_or(|old| new < old - SAME_M))
                    };
                    if is_taken || near.any(is_nearer) {
                        return Err(Refused::Closed(area.clone()));
                    }
                }
                _ => return Err(Refused::Silent(area.clone())),
            }
        }
        if asked.is_empty() {
            self.running = candidate;
            self.counts.alone += 1;
            self.flown(at_s, changes, took, 0);
            return Ok(true);
        }
        let entries = changed.iter().filter_map(|name| found(plan, name));
        let drones: Vec<DronePlan> = entries.map(|it| plan.drones[it].clone()).collect();
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
            takes: took.as_ref().map(|(_, offer)| offer.drone.clone()),
        };
        for area in &asked {
            let seen = self.neighbours[area].revision;
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

    /// The plan with changes, and who flies something else.
    fn planned(
        &self,
        at_s: f64,
        changes: &[OneChange],
        took: Option<&(String, Offer)>,
    ) -> Result<(Running, Vec<String>), Refused> {
        let told =
            |all: &[Refusal]| Refused::Changes(all.iter().map(|it| it.message.clone()).collect());
        let is_theirs = |name: &str| {
            let mut drones = self.running.plan().drones.iter();
            let known = drones.find(|it| it.name == name && self.theirs.contains_key(name));
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
        changes.extend(took.and_then(|(_, offer)| self.taken(offer)));
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
        let mut drones = self.running.plan().drones.iter();
        let entry = drones.find(|it| it.name == offer.drone)?;
        let density_kg_per_m3 = self.running.plan().air.density_kg_per_m3;
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

    /// Whether the verifier finds nothing new of own drones, those that come among them.
    fn is_sound(
        &self,
        candidate: &Running,
        comes: &BTreeSet<&str>,
        at_s: f64,
    ) -> Result<(), Refused> {
        let known = &self.running.plan().violations;
        let is_new = |it: &&Violation| {
            it.matters_from(at_s) && self.is_ours(it, comes) && !known.contains(it)
        };
        match candidate.plan().violations.iter().find(is_new) {
            Some(it) => Err(Refused::NotVerified(it.to_string())),
            None => Ok(()),
        }
    }

    /// A drone of this planner is in it, or one that comes.
    fn is_ours(&self, it: &Violation, comes: &BTreeSet<&str>) -> bool {
        let is_own = |name: &str| comes.contains(name) || self.owns(name);
        is_own(&it.drone) || it.with.as_deref().is_some_and(is_own)
    }

    /// A drone was taken from a neighbour that may not know it yet.
    fn owes(&self, drone: &str, to: &str) -> bool {
        let owed = (drone.to_owned(), to.to_owned());
        self.owed.contains_key(&owed)
    }

    fn owns(&self, drone: &str) -> bool {
        !self.theirs.contains_key(drone)
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

    /// Whether what a drone flies from a time on (s) comes near a neighbour's world.
    fn matters(&self, entry: &DronePlan, neighbour: &str, from_s: f64) -> bool {
        let near = self.site.areas.get(neighbour);
        let near = near.map(|it| grown(it, self.site.reach_m));
        near.zip(extent(entry, from_s))
            .is_some_and(|(near, it)| meet(&near, &it))
    }

    /// How far beside a neighbour's world a drone stays from a time on (s), less than 0 within it
    /// (m); seen from above.
    fn off_world_m(&self, entry: &DronePlan, neighbour: &str, from_s: f64) -> Option<f64> {
        let world = self.site.areas.get(neighbour)?;
        let flown = extent(entry, from_s)?;
        let beside_m = |k| {
            let [below_m, above_m] = [world.min[k] - flown.max[k], flown.min[k] - world.max[k]];
            f64::max(below_m, above_m)
        };
        Some(beside_m(0).max(beside_m(1)))
    }

    /// The candidate is the plan now.
    fn flown(
        &mut self,
        at_s: f64,
        changes: Vec<OneChange>,
        took: Option<(String, Offer)>,
        number: u64,
    ) {
        self.revision += 1;
        self.clock_s = self.clock_s.max(at_s);
        self.settled = self.settled.max(number);
        for name in coming(&changes, took.as_ref()) {
            self.theirs.remove(name);
        }
        if let Some((from, offer)) = &took {
            self.counts.taken += 1;
            self.offers.retain(|(_, it)| it.drone != offer.drone);
            self.owed
                .insert((offer.drone.clone(), from.clone()), number);
        }
        self.records.push(Record::Changed {
            revision: self.revision,
            at_s,
            changes,
            took: took.map(|(_, offer)| offer),
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
        let neighbour = &self.neighbours[from];
        if it.number <= neighbour.number || it.revision <= neighbour.revision {
            return Err(format!(
                "proposal {} of revision {}, after {} of {}",
                it.number, it.revision, neighbour.number, neighbour.revision
            ));
        }
        if it.seen > self.revision {
            return Err(format!(
                "it has seen revision {}, there is none such yet",
                it.seen
            ));
        }
        self.can_be(from, it.takes.as_deref(), &it.drones, it.from_s)?;
        self.can_fly(now_s, from, &it.drones)?;
        if let Some(known) = self.neighbours.get_mut(from) {
            known.number = it.number;
        }
        let against = self.against(now_s, from, it);
        self.counts.votes[usize::from(against.is_some())] += 1;
        if against.is_none() {
            let agreed = |known: &mut Neighbour| known.agreed.insert(it.number, it.clone());
            self.neighbours.get_mut(from).map(agreed);
            self.records.push(Record::Agreed {
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
        if let Some(drone) = &it.takes
            && !self.theirs.contains_key(drone)
            && self
                .running
                .plan()
                .drones
                .iter()
                .any(|known| known.name == *drone)
            && self.offered.get(drone).is_none_or(|(to, _)| to != from)
        {
            return Some(format!("`{drone}` is not offered"));
        }
        let own = it.takes.as_deref().filter(|it| self.owns(it));
        if let Some(area) = own.and_then(|it| self.promised(it))
            && area != from
        {
            return Some(format!("`{}` is promised to `{area}`", own?));
        }
        let from_s = it.from_s - SAME_S;
        if let Some(found) =
            self.conflict(self.running.plan(), &BTreeSet::new(), &it.drones, from_s)
        {
            return Some(found);
        }
        let mine = self.mine.as_ref()?;
        let comes = coming(&mine.changes, mine.took.as_ref());
        let found = self.conflict(mine.candidate.plan(), &comes, &it.drones, from_s)?;
        // Of two that propose at once the first by name goes first.
        if from < &self.name[..] {
            self.drop_mine();
            return None;
        }
        Some(found)
    }

    /// Whether drones that a neighbour speaks of can be its own, and be there.
    fn can_be(
        &self,
        from: &str,
        takes: Option<&str>,
        drones: &[DronePlan],
        at_s: f64,
    ) -> Result<(), String> {
        let mut names = BTreeSet::new();
        for entry in drones {
            let name = &entry.name[..];
            if !names.insert(name) {
                return Err(format!("it says two things of `{name}`"));
            }
            let known = self.running.plan().drones.iter().find(|it| it.name == name);
            // What was offered may have been taken, and flown on, while nothing was heard.
            let is_known = takes == Some(name) || !self.is_taking(from, name);
            if let Some(known) = known.filter(|_| is_known) {
                // One that has left is no longer in the way of its name.
                let is_own = self.owns(name) && extent(known, at_s).is_some();
                if takes != Some(name) && (is_own || self.owes(name, from)) {
                    let owner = self.theirs.get(name).unwrap_or(&self.name);
                    return Err(format!("`{name}` is of `{owner}`"));
                }
                // What is far off may have changed without this planner being told.
                let near = grown(&self.running.plan().bounds_m, self.site.reach_m);
                let places = [known, entry].map(|it| it.trajectory.position_m(at_s));
                let most_m = JUMP_M + self.astray_m(from, known, at_s);
                if let [Some(a), Some(b)] = places
                    && extent(known, at_s).is_some()
                    && is_inside(&near, &a)
                    && off_m(known, at_s, &b) > most_m
                {
                    let off_m = (a - b).norm();
                    return Err(format!(
                        "`{name}` is {off_m:.1} m from where it said, at {at_s:.2} s"
                    ));
                }
            }
        }
        Ok(())
    }

    /// How far a drone that one neighbour speaks of, and another did so far, may have flown by a
    /// time (s) since both have told all that they fly (m).
    fn astray_m(&self, from: &str, known: &DronePlan, at_s: f64) -> f64 {
        let Some(owner) = self.theirs.get(&known.name) else {
            return 0.0;
        };
        let told_s = [from, owner].map(|it| self.neighbours.get(it).and_then(|it| it.told_s));
        let [Some(from_s), Some(owner_s)] = told_s else {
            return f64::INFINITY;
        };
        known.airframe.max_speed_mps * (at_s - from_s.min(owner_s)).max(0.0)
    }

    /// Whether drones move, since their planner told of them all, as their airframes can.
    fn can_fly(&self, now_s: f64, from: &str, drones: &[DronePlan]) -> Result<(), String> {
        let since_s = self.neighbours[from].told_s.unwrap_or(now_s);
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

    /// A neighbour may have taken a drone by now.
    fn is_taking(&self, from: &str, drone: &str) -> bool {
        let is_offered = self.offered.get(drone).is_some_and(|(to, _)| to == from);
        let mut agreed = self.neighbours[from].agreed.values();
        is_offered || agreed.any(|it| it.takes.as_deref() == Some(drone))
    }

    /// The neighbour that may take a drone by a proposal that was agreed to.
    fn promised(&self, drone: &str) -> Option<&str> {
        let takes = |it: &Neighbour| {
            let mut agreed = it.agreed.values();
            agreed.any(|it| it.takes.as_deref() == Some(drone))
        };
        let mut neighbours = self.neighbours.iter();
        neighbours
            .find(|(_, it)| takes(it))
            .map(|(name, _)| &name[..])
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
        let Settled { number, is_flown } = settled;
        let neighbour = &self.neighbours[from];
        let agreed = neighbour.agreed.get(&number).cloned();
        match agreed {
            None if is_flown && number > neighbour.settled => Err(format!(
                "it flies proposal {number}, which was not agreed to"
            )),
            None => Ok(()),
            Some(_) if !is_flown => {
                self.drop_agreed(from, number);
                Ok(())
            }
            Some(proposal) => {
                if let Some(it) = self.neighbours.get_mut(from) {
                    it.revision = it.revision.max(proposal.revision);
                }
                self.noted(now_s, (from, number), &proposal.drones)
            }
        }
    }

    fn hear_fact(&mut self, now_s: f64, from: &str, fact: &Fact) -> Result<(), String> {
        let known = self.neighbours[from].revision;
        if fact.revision <= known {
            return Err(format!("revision {} after revision {known}", fact.revision));
        }
        self.can_be(from, None, &fact.drones, now_s)?;
        self.can_fly(now_s, from, &fact.drones)?;
        if let Some(it) = self.neighbours.get_mut(from) {
            it.revision = fact.revision;
        }
        let settled = self.neighbours[from].settled;
        self.noted(now_s, (from, settled), &fact.drones)
    }

    fn hear_border(&mut self, now_s: f64, from: &str, border: &Border) -> Result<(), String> {
        let known = &self.neighbours[from];
        if border.revision < known.revision {
            return Err(format!(
                "revision {} after revision {}",
                border.revision, known.revision
            ));
        }
        if self.forget_owed(from, border.heard) {
            self.records.push(Record::Knows {
                from: from.to_owned(),
                number: border.heard,
            });
        }
        let known = &self.neighbours[from];
        // Of what was taken from it, it may not know yet; nor may this planner of what was taken
        // from here, and handed on.
        let is_handed_on = |it: &DronePlan| {
            self.own().any(|own| own.name == it.name)
                && self.promised(&it.name).is_some_and(|area| area != from)
        };
        let was_its = |it: &&DronePlan| !self.owes(&it.name, from) && !is_handed_on(it);
        // Of what a third has taken near here, it may not know yet either: this planner was asked.
        let near = grown(&self.running.plan().bounds_m, self.site.reach_m);
        let is_near = |name: &str| {
            let known = self.running.plan().drones.iter().find(|it| it.name == name);
            let flown = known.and_then(|it| extent(it, now_s));
            flown.is_some_and(|it| meet(&near, &it))
        };
        let was_agreed = |drone: &str| {
            let mut settled = known.agreed.range(..=border.settled);
            settled.any(|(_, it)| it.takes.as_deref() == Some(drone))
        };
        let is_thirds = |it: &DronePlan| {
            let owner = self.theirs.get(&it.name);
            owner.is_some_and(|owner| owner != from) && is_near(&it.name) && !was_agreed(&it.name)
        };
        let said = border
            .drones
            .iter()
            .filter(was_its)
            .filter(|it| !is_thirds(it));
        let said: Vec<DronePlan> = said.cloned().collect();
        self.can_be(from, None, &said, now_s)?;
        let plan = self.running.plan();
        let is_other = |it: &&DronePlan| {
            let mut drones = plan.drones.iter();
            let old = drones.find(|old| old.name == it.name);
            old.is_none_or(|old| !is_same(old, it, now_s) || !self.theirs.contains_key(&it.name))
        };
        let other: Vec<DronePlan> = said.iter().filter(is_other).cloned().collect();
        let is_known = |it: &DronePlan| self.theirs.get(&it.name).is_some_and(|it| it == from);
        if border.revision == known.whole && other.iter().any(is_known) {
            return Err(format!(
                "it says two things of revision {}",
                border.revision
            ));
        }
        self.can_fly(now_s, from, &other)?;
        // What it would say here if it flew it still is not there any more. What a neighbour may
        // have taken is said by that one.
        let is_left_out = |it: &&DronePlan| {
            self.theirs.get(&it.name).is_some_and(|it| it == from)
                && self.matters(it, &self.name, border.at_s)
                && !border.drones.iter().any(|said| said.name == it.name)
                && self.promised(&it.name).is_none()
        };
        let left_out = plan.drones.iter().filter(is_left_out);
        let other: Vec<DronePlan> = left_out
            .map(|it| gone(it, border.at_s.min(now_s)))
            .chain(other)
            .collect();
        let open: Vec<u64> = known.agreed.keys().copied().collect();
        let open = open.into_iter().filter(|it| *it <= border.settled);
        for number in open.collect::<Vec<u64>>() {
            self.drop_agreed(from, number);
        }
        if let Some(it) = self.neighbours.get_mut(from) {
            it.revision = border.revision;
            it.whole = border.revision;
            it.told_s = Some(now_s);
            it.until_s = border.until_s;
            it.settled = it.settled.max(border.settled);
            it.number = it.number.max(border.settled);
        }
        let is_offered = |it: &Offer| border.offers.iter().any(|offer| offer == it);
        self.offers.retain(|(of, it)| of != from || is_offered(it));
        for offer in &border.offers {
            if !self.offers.iter().any(|(of, it)| of == from && it == offer) {
                self.offers.push((from.to_owned(), offer.clone()));
            }
        }
        if other.is_empty() {
            return Ok(());
        }
        self.noted(now_s, (from, border.settled), &other)
    }

    /// A neighbour's drones fly something else; own ones give way where they must.
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
        let known = &before.plan().violations;
        let violations = self.running.plan().violations.iter();
        let is_new = |it: &Violation| {
            it.matters_from(at_s) && self.is_ours(it, &BTreeSet::new()) && !known.contains(it)
        };
        if !{ violations }.any(is_new) {
            return Ok(());
        }
        self.records.pop();
        (self.running, self.revision) = (before.clone(), revision);
        self.note(at_s, (from, number), drones, true)?;
        self.counts.gave_way += 1;
        let old = |name: &str| before.plan().drones.iter().find(|it| it.name == name);
        let changed = self
            .own()
            .filter(|it| old(&it.name).is_some_and(|old| old != *it));
        let changed: Vec<String> = changed.map(|it| it.name.clone()).collect();
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
        for entry in drones {
            self.theirs.insert(entry.name.clone(), from.to_owned());
            self.offered.remove(&entry.name);
            self.owed.remove(&(entry.name.clone(), from.to_owned()));
        }
        // What is said of drones that have gone on has changed, too.
        let is_owed = |(drone, _): &(String, String)| drones.iter().any(|it| it.name == *drone);
        if gave_way || self.owed.keys().any(is_owed) {
            self.revision += 1;
        }
        self.forget_agreed(from, number);
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
        self.forget_agreed(from, number);
        self.records.push(Record::Dropped {
            from: from.to_owned(),
            number,
        });
    }

    /// A neighbour knows what was taken from it, up to a proposal; whether that is news.
    fn forget_owed(&mut self, from: &str, number: u64) -> bool {
        let count = self.owed.len();
        self.owed
            .retain(|(_, to), taken| to != from || *taken > number);
        self.owed.len() < count
    }

    fn forget_agreed(&mut self, from: &str, number: u64) {
        if let Some(it) = self.neighbours.get_mut(from) {
            it.agreed.remove(&number);
            it.settled = it.settled.max(number);
            it.number = it.number.max(number);
        }
    }

    /// Tells those neighbours that it may matter to.
    fn tell_fact(&mut self, before: &Running, changed: &[String]) {
        let of =
            |plan: &Plan, name: &String| plan.drones.iter().find(|it| it.name == *name).cloned();
        let areas: Vec<String> = self.neighbours.keys().cloned().collect();
        for area in areas {
            let matters = |name: &&String| {
                let plans = [self.running.plan(), before.plan()];
                let mut both = plans.into_iter().filter_map(|plan| of(plan, name));
                both.any(|it| self.matters(&it, &area, self.clock_s))
            };
            let near = changed.iter().filter(matters);
            let drones: Vec<DronePlan> =
                near.filter_map(|it| of(self.running.plan(), it)).collect();
            if !drones.is_empty() {
                let revision = self.revision;
                self.say(&area, Says::Fact(Fact { revision, drones }));
            }
        }
    }

    /// Proposes to take the first drone that is offered and hovers: what it still flies would be in
    /// no plan.
    fn take_offer(&mut self, now_s: f64) {
        let hovers = |drone: &str| {
            let mut drones = self.running.plan().drones.iter();
            let entry = drones.find(|it| it.name == drone);
            entry.is_some_and(|it| {
                let last_s = it.trajectory.t_s.last().copied().unwrap_or(0.0);
                it.at_end == AtEnd::Hover && last_s <= now_s
            })
        };
        let from = |drone: &str| self.theirs.get(drone);
        let can_be = |(area, offer): &(String, Offer)| {
            from(&offer.drone) == Some(area) && hovers(&offer.drone)
        };
        let Some(index) = self.offers.iter().position(can_be) else {
            return;
        };
        let taken = self.offers.remove(index);
        // What is refused now is tried again after all others.
        self.offers.push(taken.clone());
        let _ = self.propose(now_s, Vec::new(), Some(taken));
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
fn coming<'a>(changes: &'a [OneChange], took: Option<&'a (String, Offer)>) -> BTreeSet<&'a str> {
    let taken = took.map(|(_, offer)| &offer.drone[..]);
    added(changes).chain(taken).collect()
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
    entry.at_end = AtEnd::Leave;
    entry
}

/// How far a place is from where a drone was up to a time (s), which is where it may be that is
/// late (m).
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

/// Where a drone is from a time on (s).
fn extent(entry: &DronePlan, from_s: f64) -> Option<Bounds> {
    let flown = &entry.trajectory;
    let first = flown
        .t_s
        .partition_point(|t_s| *t_s <= from_s)
        .saturating_sub(1);
    let has_left = entry.at_end == AtEnd::Leave && flown.t_s.last().is_some_and(|it| *it < from_s);
    let points = flown.position_m.get(first..)?.iter();
    let inner = flown
        .control_m
        .get(first..)
        .unwrap_or_default()
        .iter()
        .flatten();
    let points = points.chain(inner).map(|it| Bounds { min: *it, max: *it });
    points.reduce(|a, b| both(&a, &b)).filter(|_| !has_left)
}

fn both(a: &Bounds, b: &Bounds) -> Bounds {
    Bounds {
        min: a.min.inf(&b.min),
        max: a.max.sup(&b.max),
    }
}

/// Wider to all sides (m); heights do not matter.
fn grown(it: &Bounds, by_m: f64) -> Bounds {
    let by = nalgebra::Vector3::repeat(by_m);
    Bounds {
        min: it.min - by,
        max: it.max + by,
    }
}

/// Seen from above.
fn meet(a: &Bounds, b: &Bounds) -> bool {
    (0..2).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k])
}

fn is_inside(it: &Bounds, at_m: &Point3<f64>) -> bool {
    (0..3).all(|k| it.min[k] <= at_m[k] && at_m[k] <= it.max[k])
}
