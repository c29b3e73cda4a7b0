//! What a request does to the plan that is being flown.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;
use std::sync::atomic::{self, AtomicBool};

use nalgebra::Point3;
use planner::form::{FieldFault, FieldFaultKind};
use planner::plan::file::NotAPlan;
use planner::plan::{self, TrajectoryEntry, Violation};
use planner::replan::change::{self as planned, ChangeError};
use planner::replan::rolling::Replanned;
use planner::scenario::limits::BUSY_S;
use planner::scenario::{missing_in_flight, world};
use planner::{Control, Outcome, Problems, Running};
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::landing::Landings;
use crate::message::{
    self, Add, Answer, Change, Changed, Closed, Code, Id, LandAll, Landing, Late, MOST_BYTES,
    MOST_CHANGES, MOST_DRONES, OffPath, OneChange, Open, PROTOCOL, Patch, Record, Refusal, Seen,
    State, Task, Told, Whole, of_one_line,
};
use crate::off_plan::{self, OffPlan};
use crate::repeated;

/// One plan that is being flown, or none.
#[derive(Clone, Debug, Default)]
pub struct Service {
    flown: Option<FlownPlan>,
    /// The first answer has been given.
    has_answered: bool,
}

/// A plan that is being flown.
#[derive(Clone, Debug)]
struct FlownPlan {
    running: Running,
    /// Rises by one with every patch.
    revision: u64,
    /// The latest time told (s).
    clock_s: f64,
    /// When history was dropped last (s).
    tidied_s: f64,
    /// Where drones said last that they are: when (s), and where (m).
    seen: BTreeMap<String, (f64, Point3<f64>)>,
    /// Those that have left and are dropped from the plan, the latest last.
    gone: VecDeque<String>,
    /// No time was told since a journal was replayed, which keeps those of changes alone.
    is_replayed: bool,
}

/// What became of a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Handled {
    /// To be sent, but not before `record` is kept.
    pub answer: Answer,
    /// What a journal has to keep.
    pub record: Option<Record>,
    /// What was asked for, where it could be read.
    pub method: Option<&'static str>,
}

const METHODS: [&str; 6] = ["open", "change", "state", "land_all", "plan", "close"];

/// Why a journal cannot be replayed.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayError(String);

impl fmt::Display for ReplayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for ReplayError {}

/// What is wrong, one or more.
type Refusals = Vec<Refusal>;
/// A result, and what a journal has to keep of it.
type Done = (Told, Option<Record>);

fn refusal(code: Code, place: impl Into<String>, message: impl Into<String>) -> Refusal {
    Refusal {
        code,
        message: message.into(),
        place: place.into(),
        also: Vec::new(),
    }
}

fn refused<T>(
    code: Code,
    place: impl Into<String>,
    message: impl Into<String>,
) -> Result<T, Refusals> {
    Err(vec![refusal(code, place, message)])
}

impl Service {
    /// Answers one line. `elapsed_s` says how long ago it came (s), and is asked for time limits
    /// alone: without one, the same lines give the same answers.
    ///
    /// A request that is refused changes nothing.
    pub fn handle(&mut self, line: &str, elapsed_s: &(dyn Fn() -> f64 + Sync)) -> Handled {
        let (mut id, mut method) = (None, None);
        let done = self.answer(line, (&mut id, &mut method), elapsed_s);
        let protocol = (!self.has_answered).then_some(PROTOCOL);
        self.has_answered = true;
        let (result, record, error) = match done {
            Ok((told, record)) => (Some(told), record, None),
            Err(mut refusals) => {
                let also = refusals.split_off(refusals.len().min(1));
                let first = refusals.pop();
                (None, None, first.map(|it| Refusal { also, ..it }))
            }
        };
        let answer = Answer {
            id,
            protocol,
            result,
            error,
        };
        Handled {
            answer,
            record,
            method,
        }
    }

    /// Refuses a line that could not be handed in as a text.
    pub fn refuse(&mut self, code: Code, message: &str) -> Answer {
        let protocol = (!self.has_answered).then_some(PROTOCOL);
        self.has_answered = true;
        Answer {
            protocol,
            ..Answer::refused(code, message)
        }
    }

    /// The revision of the plan, if one is open.
    pub fn revision(&self) -> Option<u64> {
        self.flown.as_ref().map(|it| it.revision)
    }

    /// How many drones the plan has; none is open: 0.
    pub fn drones(&self) -> usize {
        let flown = self.flown.as_ref();
        flown.map_or(0, |it| it.running.flown().drones.len())
    }

    /// Does again what a journal has kept, in its order; what that changed in the plan.
    ///
    /// # Errors
    /// A record that does not follow from those before it.
    pub fn replay(&mut self, record: Record) -> Result<Option<Patch>, ReplayError> {
        let told = |errors: Refusals| {
            let messages: Vec<String> = errors.into_iter().map(|it| it.message).collect();
            ReplayError(messages.join("; "))
        };
        match record {
            Record::Journal(protocol) if protocol == PROTOCOL => Ok(None),
            Record::Journal(other) => Err(ReplayError(format!(
                "the journal is of `{other}`, this program reads `{PROTOCOL}`"
            ))),
            Record::Opened { scenario, plan } => {
                let open = Open {
                    scenario,
                    plan: Some(plan),
                    time_limit_s: None,
                };
                self.open(Params::of(open), &|| 0.0, true).map_err(told)?;
                self.flown().map_err(told)?.is_replayed = true;
                Ok(None)
            }
            Record::Changed {
                revision,
                at_s,
                changes,
            } => {
                // Its time was held against positions that no journal keeps.
                let flown = self.flown().map_err(told)?;
                if revision != flown.revision + 1 {
                    let now = flown.revision;
                    let what = format!("revision {revision} does not follow revision {now}");
                    return Err(ReplayError(what));
                }
                let limit = Limit::new(None, &|| 0.0);
                let (mut patch, _) = flown.replan(at_s, changes, &limit).map_err(told)?;
                // One may have been kept of what changed nothing.
                (flown.revision, patch.revision) = (revision, revision);
                flown.is_replayed = true;
                Ok(Some(patch))
            }
            Record::Closed => self.close().map(|_| None).map_err(told),
        }
    }

    fn answer(
        &mut self,
        line: &str,
        (id, asked): (&mut Option<Id>, &mut Option<&'static str>),
        elapsed_s: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Done, Refusals> {
        if line.len() > MOST_BYTES {
            let message = format!("the line has more than {} MiB", MOST_BYTES >> 20);
            return refused(Code::TooMuch, "", message);
        }
        let (value, repeated) = repeated::read(line).map_err(|error| {
            let (place, what) = of_one_line(&error);
            vec![refusal(Code::Malformed, place, format!("no JSON: {what}"))]
        })?;
        let Value::Object(mut fields) = value else {
            return refused(Code::Field, "", "a request is an object");
        };
        if let Some(given) = fields.remove("id").filter(|it| !it.is_null()) {
            *id = Some(read(given, "Id", "id")?.asked);
        }
        let method: String = match fields.remove("method") {
            Some(Value::String(given)) => given,
            other => {
                let given = other.map_or("missing".to_owned(), |it| format!("{it} is none"));
                let message = format!("`method`: {given}: there are {}", METHODS.join(", "));
                return refused(Code::Field, "method", message);
            }
        };
        *asked = METHODS.into_iter().find(|known| *known == method);
        if !repeated.is_empty() {
            let told = repeated
                .into_iter()
                .map(|(place, key)| refusal(Code::Field, place, format!("`{key}` is given twice")));
            return Err(told.collect());
        }
        let params = fields.remove("params");
        if let Some(unknown) = fields.keys().next() {
            let message = format!("`{unknown}`: no such field, there are id, method, params");
            return refused(Code::Field, unknown, message);
        }
        let given = |it: Option<Value>| match it {
            Some(params) => Ok(params),
            None => refused(Code::Field, "params", "`params`: missing: an object"),
        };
        let none = |it: Option<Value>| match it {
            None | Some(Value::Null) => Ok(()),
            Some(Value::Object(fields)) if fields.is_empty() => Ok(()),
            Some(_) => refused(Code::Field, "params", "`params`: this method takes none"),
        };
        match &method[..] {
            "open" => self.open(read(given(params)?, "Open", "params")?, elapsed_s, false),
            "change" => self.change(read(given(params)?, "Change", "params")?, elapsed_s),
            "state" => self.state(read(given(params)?, "State", "params")?, elapsed_s),
            "land_all" => self.land_all(read(given(params)?, "LandAll", "params")?, elapsed_s),
            "plan" => none(params).and_then(|()| Ok((self.flown()?.whole(), None))),
            "close" => none(params).and_then(|()| self.close()),
            other => refused(
                Code::UnknownMethod,
                "method",
                format!(
                    "no method is called `{other}`, there are {}",
                    METHODS.join(", ")
                ),
            ),
        }
    }

    fn flown(&mut self) -> Result<&mut FlownPlan, Refusals> {
        let none = || vec![refusal(Code::NotOpen, "method", "no plan is open")];
        self.flown.as_mut().ok_or_else(none)
    }

    fn close(&mut self) -> Result<Done, Refusals> {
        let closed = self.flown()?.revision;
        self.flown = None;
        Ok((Told::Closed(Closed { closed }), Some(Record::Closed)))
    }

    fn open(
        &mut self,
        asked: Params<Open>,
        elapsed_s: &(dyn Fn() -> f64 + Sync),
        is_replay: bool,
    ) -> Result<Done, Refusals> {
        if self.flown.is_some() {
            return refused(
                Code::AlreadyOpen,
                "method",
                "a plan is open; close it first",
            );
        }
        let world = planner::read_world(&asked.asked.scenario);
        let world = world.map_err(|problems| of_scenario(&asked.asked.scenario, problems));
        let (open, world) = asked.with(world)?;
        let limit = Limit::new(open.time_limit_s, elapsed_s);
        let plan = match &open.plan {
            Some(given) => {
                let plan = taken_over(given)?;
                if !is_replay {
                    answers(&plan, &world)?;
                }
                plan
            }
            None => planned_anew(&world, &limit)?,
        };
        let running = Running::new(world, plan)
            .map_err(|error| vec![refusal(Code::Plan, "params.plan", error.to_string())])?;
        limit.check()?;
        let flown = FlownPlan {
            running,
            revision: 1,
            clock_s: 0.0,
            tidied_s: 0.0,
            seen: BTreeMap::new(),
            gone: VecDeque::new(),
            is_replayed: false,
        };
        let told = flown.whole();
        let plan = serde_json::to_value(flown.running.plan())
            .map_err(|error| vec![refusal(Code::Plan, "params.plan", error.to_string())])?;
        let record = Record::Opened {
            scenario: open.scenario,
            plan,
        };
        self.flown = Some(flown);
        Ok((told, Some(record)))
    }

    fn change(
        &mut self,
        asked: Params<Change>,
        elapsed_s: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Done, Refusals> {
        let flown = self.flown()?;
        flown.is_meant(asked.asked.revision)?;
        let mut in_order = flown.on_time(asked.asked.at_s);
        if !asked.beyond.is_empty() {
            in_order = flown.in_order(&asked.asked);
        }
        let (change, ()) = asked.with(in_order)?;
        let limit = Limit::new(change.time_limit_s, elapsed_s);
        let count = change.changes.len();
        if count == 0 || count > MOST_CHANGES {
            let code = if count == 0 {
                Code::Change
            } else {
                Code::TooMuch
            };
            let message = format!("{count} changes, of 1 to {MOST_CHANGES}");
            return refused(code, "params.changes", message);
        }
        let (patch, record) = flown.replan(change.at_s, change.changes, &limit)?;
        Ok((Told::Patch(patch), record))
    }

    fn land_all(
        &mut self,
        asked: Params<LandAll>,
        elapsed_s: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Done, Refusals> {
        let flown = self.flown()?;
        (asked.asked.revision).map_or(Ok(()), |it| flown.is_meant(it))?;
        let on_time = flown.on_time(asked.asked.at_s);
        let (asked, ()) = asked.with(on_time)?;
        let limit = Limit::new(asked.time_limit_s, elapsed_s);
        let (landing, record) = flown.land_all(asked.at_s, &limit)?;
        Ok((Told::Landing(landing), record))
    }

    fn state(
        &mut self,
        asked: Params<State>,
        elapsed_s: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Done, Refusals> {
        let flown = self.flown()?;
        let count = asked.asked.drones.len();
        if count > MOST_DRONES {
            let message = format!("{count} drones, of at most {MOST_DRONES}");
            return refused(Code::TooMuch, "params.drones", message);
        }
        let limit = Limit::new(asked.asked.time_limit_s, elapsed_s);
        let on_time = flown.on_time(asked.asked.at_s);
        let seen = on_time.and_then(|()| flown.judge(&asked.asked, &limit));
        let (state, sighting) = asked.with(seen)?;
        let Sighting {
            seen,
            late,
            off_path,
        } = sighting;
        let (patch, record) = match late.is_empty() {
            true => (None, None),
            false => {
                let (patch, record) = flown.replan(state.at_s, late, &limit)?;
                (record.is_some().then_some(patch), record)
            }
        };
        flown.tell(state.at_s);
        for name in seen {
            let place_m = Point3::from(state.drones[&name].position_m);
            flown.seen.insert(name, (state.at_s, place_m));
        }
        let revision = flown.revision;
        let seen = Seen {
            revision,
            patch,
            off_path,
        };
        Ok((Told::Seen(seen), record))
    }
}

/// How often places to land are looked for anew, for drones without a path to theirs. Chosen here:
/// each time costs a replan of the fleet.
const MOST_LANDINGS: usize = 3;

/// How much of what was flown is kept (s). Chosen here: all of it is verified with every patch, and
/// a drone that rests where it was to be so long ago, and is not there, is lost rather than late.
const HISTORY_S: f64 = 45.0;
/// How often what is older is dropped (s). Chosen here: it fills the costmap anew.
const TIDY_S: f64 = 15.0;
/// Longest time from one time told to the next (s): a day. Chosen here: a clock that leaps further
/// is wrong, and times never go back from what was believed.
const LONGEST_LEAP_S: f64 = 86_400.0;

/// Why the planner has not gone on.
enum Failed {
    Changes(Vec<ChangeError>),
    Refused(Refusals),
    /// With the violations of what it planned.
    NotVerified(Vec<Violation>, Refusals),
}

/// What positions say of the drones.
struct Sighting {
    /// The drones that are there.
    seen: Vec<String>,
    late: Vec<OneChange>,
    off_path: Vec<OffPath>,
}

impl FlownPlan {
    fn whole(&self) -> Told {
        Told::Whole(Box::new(Whole {
            revision: self.revision,
            plan: self.running.plan().clone(),
        }))
    }

    fn is_meant(&self, given: u64) -> Result<(), Refusals> {
        let now = self.revision;
        let (code, what) = match given.cmp(&now) {
            Ordering::Equal => return Ok(()),
            Ordering::Less => (Code::StaleRevision, "the plan has changed since"),
            Ordering::Greater => (Code::FutureRevision, "there is none such yet"),
        };
        let message = format!("revision {given} of a plan at revision {now}: {what}");
        refused(code, "params.revision", message)
    }

    /// It is so late by now (s).
    fn tell(&mut self, at_s: f64) {
        self.clock_s = at_s;
        self.is_replayed = false;
    }

    fn on_time(&self, at_s: f64) -> Result<(), Refusals> {
        if at_s < self.clock_s {
            let message = format!("at {at_s:.2} s, and {:.2} s was told before", self.clock_s);
            return refused(Code::ClockBack, "params.at_s", message);
        }
        if !self.is_replayed && at_s - self.clock_s > LONGEST_LEAP_S {
            let message = format!(
                "at {at_s:.2} s is more than a day after {:.2} s, which was told last",
                self.clock_s
            );
            return refused(Code::Time, "params.at_s", message);
        }
        Ok(())
    }

    /// Whether changes name drones and places that are there, of a request with numbers that are
    /// out of range: a time that is one of them is passed over.
    fn in_order(&self, change: &Change) -> Result<(), Refusals> {
        let at_s = change.at_s.max(self.clock_s);
        let at_s = if BUSY_S.contain(at_s) {
            at_s
        } else {
            self.clock_s
        };
        let given = asked(&self.running, at_s, &change.changes)?;
        let told = self.running.check(at_s, &given);
        told.map_err(|errors| {
            let refusals = errors.iter().map(|it| of_change(it, &change.changes));
            refusals.collect()
        })
    }

    /// Holds positions against the plan; drones that are not there yet or any more are passed over.
    fn judge(&self, state: &State, limit: &Limit<'_>) -> Result<Sighting, Refusals> {
        let plan = self.running.flown();
        let (mut late, mut off_path, mut wrong) = (Vec::new(), Vec::new(), Vec::new());
        let mut seen = Vec::new();
        let drones = plan.drones.iter().enumerate();
        let known: BTreeMap<&str, (usize, &plan::DronePlan)> = drones
            .map(|(index, it)| (&it.name[..], (index, it)))
            .collect();
        for (name, place) in &state.drones {
            limit.check()?;
            let at = format!("params.drones.{name}");
            let Some(&(index, entry)) = known.get(&name[..]) else {
                if self.gone.contains(name) {
                    continue;
                }
                let message = format!("no drone is called `{name}`");
                wrong.push(refusal(Code::UnknownDrone, at, message));
                continue;
            };
            if !self.running.is_there(index, state.at_s) {
                continue;
            }
            seen.push(name.clone());
            let enters_s = entry.enters_s.unwrap_or(0.0);
            let position_m = Point3::from(place.position_m);
            let before = self.seen.get(name).copied();
            let before =
                before.or_else(|| Some((enters_s, entry.trajectory.position_m(enters_s)?)));
            if let Some((then_s, then_m)) = before {
                let (moved_m, in_s) = ((position_m - then_m).norm(), state.at_s - then_s);
                if moved_m > off_plan::reach_m(entry, in_s) {
                    let at = format!("{at}.position_m");
                    let message =
                        format!("`{name}` is {moved_m:.1} m from where it was {in_s:.2} s before");
                    wrong.push(refusal(Code::Jump, at, message));
                    continue;
                }
            }
            match off_plan::judge(entry, &plan.margins, state.at_s, &position_m) {
                OffPlan::No => {}
                OffPlan::Late(by_s) => late.push(OneChange::Late(Late {
                    drone: name.clone(),
                    by_s,
                })),
                OffPlan::Path(off_m) => off_path.push(OffPath {
                    drone: name.clone(),
                    off_m,
                }),
            }
        }
        match wrong.is_empty() {
            true => Ok(Sighting {
                seen,
                late,
                off_path,
            }),
            false => Err(wrong),
        }
    }

    /// Has all that fly land, as many as find a place and a path; where that is refused, all is as
    /// it was. Where all land already nothing changes, and there is nothing to record.
    fn land_all(
        &mut self,
        at_s: f64,
        limit: &Limit<'_>,
    ) -> Result<(Landing, Option<Record>), Refusals> {
        let mut landings = Landings::of(&self.running, at_s);
        let before = self.clone();
        let mut best: Option<(FlownPlan, Landing, Option<Record>)> = None;
        let mut tries = 0;
        while tries < MOST_LANDINGS {
            landings.choose();
            let changes = landings.changes();
            if changes.is_empty() {
                let message = match &landings.without()[..] {
                    [] => {
                        self.tell(at_s);
                        return Ok((self.unchanged(at_s), None));
                    }
                    drones => format!("there is no place to land for {}", drones.join(", ")),
                };
                return refused(Code::Change, "params", message);
            }
            let told = match self.replan_or(at_s, changes.clone(), limit) {
                Ok(told) => told,
                Err(Failed::Changes(errors)) => {
                    for error in &errors {
                        match error {
                            ChangeError::Misplaced { drone, .. } => {
                                landings.ban(drone);
                            }
                            ChangeError::Gone(drone) => landings.leave_out(drone),
                            _ => return Err(vec![of_change(error, &changes)]),
                        }
                    }
                    match limit.check() {
                        Err(_) if best.is_some() => break,
                        checked => checked?,
                    }
                    continue;
                }
                // What was found before still holds.
                Err(_) if best.is_some() => break,
                Err(Failed::Refused(refusals)) => return Err(refusals),
                Err(Failed::NotVerified(found, refusals)) => {
                    tries += 1;
                    if !landings.give_up(&found) || tries == MOST_LANDINGS {
                        return Err(refusals);
                    }
                    continue;
                }
            };
            tries += 1;
            let (patch, record) = told;
            let mut not_landing = landings.without();
            let out = patch.refused.iter().map(|it| &it.name);
            let out = out.filter(|name| changes.iter().any(|it| name_of(it) == *name));
            let out: Vec<String> = out.cloned().collect();
            not_landing.extend(out.iter().cloned());
            not_landing.sort_unstable();
            let flown = std::mem::replace(self, before.clone());
            let revision = patch.revision;
            let landing = Landing {
                revision,
                patch,
                not_landing,
            };
            let is_better = |(_, known, _): &(FlownPlan, Landing, Option<Record>)| {
                landing.not_landing.len() < known.not_landing.len()
            };
            if best.as_ref().is_none_or(is_better) {
                best = Some((flown, landing, record));
            }
            if out.is_empty() {
                break;
            }
            for name in &out {
                landings.ban(name);
            }
        }
        match best {
            Some((flown, landing, record)) => {
                *self = flown;
                Ok((landing, record))
            }
            None => refused(Code::Change, "params", "no drone flies"),
        }
    }

    /// All land as they do.
    fn unchanged(&self, at_s: f64) -> Landing {
        Landing {
            revision: self.revision,
            patch: Patch {
                revision: self.revision,
                from_s: Running::moment_s(at_s),
                changed: Vec::new(),
                refused: Vec::new(),
                unavoidable: Vec::new(),
            },
            not_landing: Vec::new(),
        }
    }

    /// Plans on; where that is refused, or takes too long, all is as it was. Where nothing changes
    /// there is nothing to record.
    fn replan(
        &mut self,
        at_s: f64,
        changes: Vec<OneChange>,
        limit: &Limit<'_>,
    ) -> Result<(Patch, Option<Record>), Refusals> {
        let done = self.replan_or(at_s, changes.clone(), limit);
        done.map_err(|failed| match failed {
            Failed::Refused(refusals) | Failed::NotVerified(_, refusals) => refusals,
            Failed::Changes(errors) => {
                let refusals = errors.iter().map(|it| of_change(it, &changes));
                refusals.collect()
            }
        })
    }

    fn replan_or(
        &mut self,
        at_s: f64,
        changes: Vec<OneChange>,
        limit: &Limit<'_>,
    ) -> Result<(Patch, Option<Record>), Failed> {
        let asked = asked(&self.running, at_s, &changes).map_err(Failed::Refused)?;
        let before = self.running.clone();
        let done = self.tried(at_s, &asked, &changes, limit);
        let is_new = |it: &Patch| !it.changed.is_empty() || !it.refused.is_empty();
        if !done.as_ref().is_ok_and(is_new) {
            self.running = before;
        }
        let mut patch = done?;
        self.tell(at_s);
        if !is_new(&patch) {
            patch.revision = self.revision;
            return Ok((patch, None));
        }
        self.revision = patch.revision;
        self.forget(at_s);
        let record = Record::Changed {
            revision: patch.revision,
            at_s,
            changes,
        };
        Ok((patch, Some(record)))
    }

    /// Drops history, now and then: the plan of a fleet that flies for days stays as small as that
    /// of one that flies for minutes. Places beyond the lattice that no task names any more stay in
    /// the roadmap: all distances count on its order of places.
    fn forget(&mut self, at_s: f64) {
        if at_s - self.tidied_s < TIDY_S {
            return;
        }
        self.tidied_s = at_s;
        let names = |it: &Running| -> BTreeSet<String> {
            it.flown().drones.iter().map(|it| it.name.clone()).collect()
        };
        let before = names(&self.running);
        self.running.forget(at_s - HISTORY_S);
        let known = names(&self.running);
        self.seen.retain(|name, _| known.contains(name));
        self.gone.extend(before.difference(&known).cloned());
        self.gone.retain(|name| !known.contains(name));
        let most = self.gone.len().saturating_sub(MOST_DRONES);
        self.gone.drain(..most);
    }

    fn tried(
        &mut self,
        at_s: f64,
        asked: &[planned::Change],
        changes: &[OneChange],
        limit: &Limit<'_>,
    ) -> Result<Patch, Failed> {
        let known = self.running.flown().violations.clone();
        let stop = || limit.is_over();
        let control = Control {
            stop: &stop,
            ..Control::QUIET
        };
        let told = self.running.replan(at_s, asked, &control);
        let told = told.map_err(Failed::Changes)?;
        limit.check().map_err(Failed::Refused)?;
        let from_s = told.from_s;
        let plan = self.running.flown();
        let is_new = |it: &&Violation| {
            it.matters_from(from_s) && !told.unavoidable.contains(it) && !known.contains(it)
        };
        let new: Vec<Violation> = plan.violations.iter().filter(is_new).cloned().collect();
        if !new.is_empty() {
            // Why, where a drone has found no path.
            let out = told.refused.iter().map(|it| {
                let place = place_of(&it.name, changes, |_| true);
                refusal(Code::NoPlan, place, format!("`{}`: {}", it.name, it.reason))
            });
            let found = new.iter();
            let found = found.map(|it| refusal(Code::NotVerified, "params", it.to_string()));
            let refusals = found.chain(out).collect();
            return Err(Failed::NotVerified(new, refusals));
        }
        Ok(self.patch(told))
    }

    fn patch(&self, told: Replanned) -> Patch {
        let from_s = told.from_s;
        let plan = self.running.flown();
        let changed = told.changed.into_iter().filter_map(|it| {
            let entry = plan.drone(&it.drone)?;
            Some(Changed {
                drone: it.drone,
                cause: it.cause,
                trajectory: rest(&entry.trajectory, from_s),
                at_end: entry.at_end,
            })
        });
        Patch {
            revision: self.revision + 1,
            from_s,
            changed: changed.collect(),
            refused: told.refused,
            unavoidable: told.unavoidable,
        }
    }
}

/// Changes as the planner takes them.
pub(crate) fn asked(
    running: &Running,
    at_s: f64,
    changes: &[OneChange],
) -> Result<Vec<planned::Change>, Refusals> {
    let mut wrong = Vec::new();
    let asked = changes.iter().enumerate().filter_map(|(index, it)| {
        let change = match it {
            OneChange::Late(it) => planned::Change::Late {
                drone: it.drone.clone(),
                by_s: it.by_s,
            },
            OneChange::Remove(it) => planned::Change::Removed {
                drone: it.drone.clone(),
            },
            OneChange::Fail(it) => planned::Change::Failed {
                drone: it.drone.clone(),
                lies_m: it.lies_m.map(Point3::from),
            },
            OneChange::Retask(it) => planned::Change::Retasked {
                drone: it.drone.clone(),
                tasks: tasks(&it.tasks),
            },
            OneChange::Land(it) if it.over_m.is_none() && flies(running, &it.drone, at_s) => {
                let place = format!("params.changes[{index}].land.over_m");
                let message = format!(
                    "`{}` flies: say over which place it lands, or ask `land_all` to find one",
                    it.drone
                );
                wrong.push(refusal(Code::Change, place, message));
                return None;
            }
            OneChange::Land(it) => planned::Change::Landed {
                drone: it.drone.clone(),
                over_m: it.over_m.map(Point3::from),
            },
            OneChange::Add(it) => match added(running, it) {
                Some(drone) => planned::Change::Added(drone),
                None => {
                    let place = format!("params.changes[{index}].add.like");
                    let message = format!("no drone is called `{}`", it.like);
                    wrong.push(refusal(Code::UnknownDrone, place, message));
                    return None;
                }
            },
        };
        Some(change)
    });
    let asked: Vec<planned::Change> = asked.collect();
    if wrong.is_empty() {
        Ok(asked)
    } else {
        Err(wrong)
    }
}

/// Whether a drone of the plan is off the ground at a time (s).
fn flies(running: &Running, drone: &str, at_s: f64) -> bool {
    let mut drones = running.flown().drones.iter();
    let index = drones.position(|it| it.name == drone);
    index.is_some_and(|it| running.is_there(it, at_s) && running.on_ground(it, at_s).is_none())
}

fn added(running: &Running, it: &Add) -> Option<world::Drone> {
    let mut drones = running.world().drones.iter();
    let like = drones.find(|known| known.name == it.like)?;
    Some(world::Drone {
        name: it.drone.clone(),
        start_m: it.start_m.into(),
        at_start: it.at_start,
        tasks: tasks(&it.tasks),
        at_end: it.at_end,
        ..like.clone()
    })
}

/// How long a request may take.
struct Limit<'a> {
    limit_s: f64,
    elapsed_s: &'a (dyn Fn() -> f64 + Sync),
    /// Work has been cut short.
    was_over: AtomicBool,
}

impl<'a> Limit<'a> {
    fn new(limit_s: Option<f64>, elapsed_s: &'a (dyn Fn() -> f64 + Sync)) -> Limit<'a> {
        Limit {
            limit_s: limit_s.unwrap_or(f64::INFINITY),
            elapsed_s,
            was_over: AtomicBool::new(false),
        }
    }

    fn is_over(&self) -> bool {
        let is_over = self.limit_s.is_finite() && (self.elapsed_s)() >= self.limit_s;
        if is_over {
            self.was_over.store(true, atomic::Ordering::Relaxed);
        }
        is_over
    }

    /// What was made in time is whole: nothing that was cut short is handed out.
    fn check(&self) -> Result<(), Refusals> {
        if self.was_over.load(atomic::Ordering::Relaxed) || self.is_over() {
            let message = format!("not done within {} s; what is flown goes on", self.limit_s);
            return refused(Code::Deadline, "params.time_limit_s", message);
        }
        Ok(())
    }
}

/// What is asked, and the numbers in it that are out of range.
struct Params<T> {
    asked: T,
    beyond: Refusals,
}

impl<T> Params<T> {
    fn of(asked: T) -> Params<T> {
        Params {
            asked,
            beyond: Vec::new(),
        }
    }

    /// What is asked and what was made of it; or all that is wrong, each at its place once.
    fn with<U>(self, made: Result<U, Refusals>) -> Result<(T, U), Refusals> {
        if self.beyond.is_empty() {
            return Ok((self.asked, made?));
        }
        let mut wrong = self.beyond;
        let is_told = |it: &Refusal| {
            let mut numbers = wrong.iter();
            numbers.any(|known| known.place.starts_with(&it.place))
        };
        let more = made.err().unwrap_or_default().into_iter();
        let more: Refusals = more.filter(|it| !is_told(it)).collect();
        wrong.extend(more);
        Err(wrong)
    }
}

/// Reads a value by the name of its part of the schema; all fields at fault are told in the
/// schema's words.
fn read<T: DeserializeOwned>(value: Value, part: &str, place: &str) -> Result<Params<T>, Refusals> {
    let faults = message::faults(part, &value, place);
    let is_range = |it: &FieldFault| it.kind == FieldFaultKind::Range;
    let is_read = faults.iter().all(is_range);
    let told = faults.iter().map(|it| {
        let code = if is_range(it) {
            Code::Range
        } else {
            Code::Field
        };
        refusal(code, &it.place[..], it.to_string())
    });
    let told: Refusals = told.collect();
    match serde_json::from_value(value) {
        Ok(asked) if is_read => Ok(Params {
            asked,
            beyond: told,
        }),
        Err(_) if told.is_empty() => {
            let message = format!("`{place}`: not as `plan schema serve` says");
            refused(Code::Field, place, message)
        }
        _ => Err(told),
    }
}

/// A plan that was handed in; what it claims of itself is judged anew.
fn taken_over(given: &Value) -> Result<planner::Plan, Refusals> {
    let file = plan::file::read(&given.to_string());
    let place = "params.plan";
    let file = file.map_err(|error| match error {
        NotAPlan::Fields { faults, .. } => {
            let told = faults.into_iter().map(|it| match &it.place[..] {
                "." => refusal(Code::Plan, place, it.what),
                path => refusal(Code::Plan, format!("{place}.{path}"), it.to_string()),
            });
            told.collect()
        }
        other => vec![refusal(Code::Plan, place, other.to_string())],
    })?;
    let found = planner::verify(&file.plan).violations;
    let wrong = found.iter().take(MOST_LISTED);
    let wrong: Refusals = wrong
        .map(|it| refusal(Code::NotVerified, place, it.to_string()))
        .collect();
    if wrong.is_empty() {
        Ok(file.plan)
    } else {
        Err(wrong)
    }
}

/// Whether a plan is one of this scenario: what is changed later goes by the scenario.
fn answers(plan: &planner::Plan, world: &planner::World) -> Result<(), Refusals> {
    let missing = missing_in_flight(world, plan);
    if missing.is_empty() {
        return Ok(());
    }
    let what = "the plan is none of this scenario, or was changed in flight: send a scenario that \
                says what is flown by now";
    let told = std::iter::once(what.to_owned()).chain(missing);
    let told = told.map(|it| refusal(Code::Plan, "params.plan", it));
    Err(told.collect())
}

/// Violations of a plan that are listed: chosen here, a screen's worth.
const MOST_LISTED: usize = 20;

fn planned_anew(world: &planner::World, limit: &Limit<'_>) -> Result<planner::Plan, Refusals> {
    let stop = || limit.is_over();
    let control = Control {
        stop: &stop,
        contrast: false,
        ..Control::QUIET
    };
    let outcome = planner::plan_world(world, &control).map_err(|faults| {
        vec![refusal(
            Code::Scenario,
            "params.scenario",
            faults.to_string(),
        )]
    })?;
    limit.check()?;
    match outcome {
        Outcome::Safe(planned) | Outcome::Partial(planned) => Ok(planned.plan),
        Outcome::Unsafe(planned) => {
            let found = planned.plan.violations.iter().take(MOST_LISTED);
            let told =
                found.map(|it| refusal(Code::NotVerified, "params.scenario", it.to_string()));
            Err(told.collect())
        }
        Outcome::Infeasible { conflicts } => refused(
            Code::NoPlan,
            "params.scenario",
            format!("{} pairs of places exclude one another", conflicts.count()),
        ),
    }
}

pub(crate) fn tasks(given: &[Task]) -> Vec<world::Task> {
    let task = |it: &Task| world::Task {
        to_m: it.to_m.into(),
        dwell_s: it.dwell_s,
        load_kg: it.load_kg,
        during_s: None,
    };
    given.iter().map(task).collect()
}

/// All that is still flown from a time on (s): from the last break point at or before it.
fn rest(whole: &TrajectoryEntry, from_s: f64) -> TrajectoryEntry {
    let first = whole
        .t_s
        .partition_point(|t_s| *t_s <= from_s)
        .saturating_sub(1);
    fn after<T: Clone>(all: &[T], first: usize) -> Vec<T> {
        all.get(first..).unwrap_or_default().to_vec()
    }
    TrajectoryEntry {
        t_s: after(&whole.t_s, first),
        position_m: after(&whole.position_m, first),
        mass_kg: after(&whole.mass_kg, first),
        control_m: after(&whole.control_m, first),
        turns_at_once: whole.turns_at_once,
    }
}

/// What is wrong with a change, at its place.
fn of_change(error: &ChangeError, changes: &[OneChange]) -> Refusal {
    let (code, drone) = match error {
        ChangeError::Time(_) => (Code::Time, None),
        ChangeError::Past { .. } => (Code::ClockBack, None),
        ChangeError::Unknown(drone) => (Code::UnknownDrone, Some(drone)),
        ChangeError::Known(drone)
        | ChangeError::Fixed(drone)
        | ChangeError::Twice(drone)
        | ChangeError::Gone(drone) => (Code::Change, Some(drone)),
        ChangeError::Delay { drone, .. }
        | ChangeError::Misplaced { drone, .. }
        | ChangeError::Number { drone, .. }
        | ChangeError::TooLarge { drone, .. } => (Code::Change, Some(drone)),
        ChangeError::Given(_) => (Code::Change, None),
    };
    let place = match (code, drone) {
        (Code::Time | Code::ClockBack, _) => "params.at_s".to_owned(),
        (_, None) => "params.changes".to_owned(),
        (_, Some(name)) => place_of(name, changes, |it| can_be_meant(error, it)),
    };
    refusal(code, place, error.to_string())
}

/// Whether it may be this change of its drone that an error is about.
fn can_be_meant(error: &ChangeError, change: &OneChange) -> bool {
    match (error, change) {
        (ChangeError::Delay { by_s, .. }, OneChange::Late(late)) => late.by_s == *by_s,
        (ChangeError::Delay { .. }, _) => false,
        (ChangeError::TooLarge { .. } | ChangeError::Known(_), _) => {
            matches!(change, OneChange::Add(_))
        }
        (ChangeError::Misplaced { .. } | ChangeError::Number { .. }, _) => {
            !matches!(change, OneChange::Late(_) | OneChange::Remove(_))
        }
        _ => true,
    }
}

/// Of a drone's change in a request; of several that name it the last that can be meant.
fn place_of(name: &str, changes: &[OneChange], is_meant: impl Fn(&OneChange) -> bool) -> String {
    let mut changes = changes.iter();
    let last = changes.rposition(|it| name_of(it) == name && is_meant(it));
    last.map_or("params.changes".to_owned(), |it| {
        format!("params.changes[{it}]")
    })
}

pub(crate) fn name_of(change: &OneChange) -> &str {
    match change {
        OneChange::Late(it) => &it.drone,
        OneChange::Add(it) => &it.drone,
        OneChange::Remove(it) => &it.drone,
        OneChange::Fail(it) => &it.drone,
        OneChange::Retask(it) => &it.drone,
        OneChange::Land(it) => &it.drone,
    }
}

/// What is wrong with a scenario, each at its line and column, from 1.
fn of_scenario(text: &str, Problems(problems): Problems) -> Refusals {
    let told = problems.into_iter().map(|it| {
        let place = match it.line_column(text) {
            Some((line, column)) => format!("params.scenario:{line}:{column}"),
            None => "params.scenario".to_owned(),
        };
        let help = it.help.map(|help| format!("; {help}")).unwrap_or_default();
        refusal(Code::Scenario, place, it.message + &help)
    });
    told.collect()
}

#[cfg(test)]
mod tests;
