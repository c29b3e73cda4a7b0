//! Requests, answers and the records of a journal, as data: `serve/1`.
//!
//! World frame: metres, z up; a position is the centre of a drone's rotor plane. Times are seconds
//! from the plan's beginning.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use planner::Plan;
use planner::form::{self, FieldFault};
use planner::plan::{AtEnd, AtStart, EndWord, StartWord, TrajectoryEntry, Unplanned, Violation};
use planner::replan::rolling::Cause;
use planner::scenario::limits::{BUSY_S, DELAY_S, DWELL_S, LOAD_KG, PLACE_M};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// The version of requests, answers and records.
pub const PROTOCOL: &str = "serve/1";
/// Longest line of a request (bytes). Chosen here: a plan of 10 000 drones is a tenth of it.
pub const MOST_BYTES: usize = 256 << 20;
/// Most changes in one request. Chosen here: as many drones as are planned in about a second.
pub const MOST_CHANGES: usize = 1_000;
/// Most drones in one `state`. Chosen here: the largest fleet that is benched.
pub const MOST_DRONES: usize = 10_000;
/// Longest time limit (s): a day. Chosen here: left out, there is none.
pub const MOST_TIME_LIMIT_S: f64 = 86_400.0;

/// One line in.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Message {
    /// Comes back in the answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<Id>,
    /// What is asked.
    #[serde(flatten)]
    pub request: Request,
}

/// A name for a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Id {
    /// A whole number.
    Number(i64),
    /// A text.
    Text(String),
}

/// What can be asked.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "method", content = "params", rename_all = "snake_case")]
pub enum Request {
    /// Plans a scenario, or takes over a plan of it.
    Open(Box<Open>),
    /// Plans on from a moment with changes.
    Change(Change),
    /// Says where drones are.
    State(State),
    /// Has every drone that flies land, as soon as it may.
    LandAll(LandAll),
    /// Asks for the plan as it is now.
    Plan,
    /// Ends the plan; another can be opened.
    Close,
}

/// A scenario, or a scenario and its plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Open {
    /// The text of a scenario (RON) that cites no files.
    pub scenario: String,
    /// Its plan, as in plan.json; left out: it is planned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Plan>")]
    pub plan: Option<Value>,
    /// Longest time that it may take (s); left out: no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = MOST_TIME_LIMIT_S))]
    pub time_limit_s: Option<f64>,
}

/// Changes at a moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Change {
    /// Of the plan that the changes are meant for.
    pub revision: u64,
    /// When (s); no earlier than any time told before.
    #[schemars(range(min = BUSY_S.low, max = BUSY_S.high))]
    pub at_s: f64,
    /// At most one a drone.
    #[schemars(length(min = 1, max = MOST_CHANGES))]
    pub changes: Vec<OneChange>,
    /// Longest time that it may take (s); when it is over, what is flown goes on. Left out: no
    /// limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = MOST_TIME_LIMIT_S))]
    pub time_limit_s: Option<f64>,
}

/// What is not as the plan says, or shall not be any more.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum OneChange {
    /// A drone is behind its plan.
    Late(Late),
    /// A drone comes.
    Add(Add),
    /// A drone is taken out, body and wake.
    Remove(Remove),
    /// A drone has failed and come down: its wake has ended, and its body lies there until it is
    /// removed, as `NAME (wreck)`.
    Fail(Fail),
    /// A drone drops what it still had to do, and does this.
    Retask(Retask),
    /// A drone drops what it still had to do, and lands.
    Land(Land),
}

/// A drone is where the plan had it some time ago.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Late {
    /// Its name.
    pub drone: String,
    /// How long ago (s).
    #[schemars(range(min = DELAY_S.low, max = DELAY_S.high))]
    pub by_s: f64,
}

/// A drone comes, to where it starts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Add {
    /// Its name.
    pub drone: String,
    /// The drone of the plan whose airframe, limits of motion and limit of air it has.
    pub like: String,
    /// Where it starts (m).
    #[schemars(inner(range(min = PLACE_M.low, max = PLACE_M.high)))]
    pub start_m: [f64; 3],
    /// How it starts.
    #[serde(default)]
    #[schemars(with = "StartWord")]
    pub at_start: AtStart,
    /// What it does, in order.
    #[serde(default)]
    pub tasks: Vec<Task>,
    /// What it does after that.
    #[serde(default)]
    #[schemars(with = "EndWord")]
    pub at_end: AtEnd,
}

/// A drone is taken out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Remove {
    /// Its name.
    pub drone: String,
}

/// A drone has failed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fail {
    /// Its name.
    pub drone: String,
    /// Where its rotor plane's centre lies (m), on the floor or an obstacle, to 5 cm; left out: on
    /// the highest surface below where its plan has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = PLACE_M.low, max = PLACE_M.high)))]
    pub lies_m: Option<[f64; 3]>,
}

/// Other tasks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Retask {
    /// Its name.
    pub drone: String,
    /// From now on, in order.
    pub tasks: Vec<Task>,
}

/// A drone lands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Land {
    /// Its name.
    pub drone: String,
    /// Over which place (m): it comes down from there. Left out, of a drone that stands on the
    /// ground: it stays there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = PLACE_M.low, max = PLACE_M.high)))]
    pub over_m: Option<[f64; 3]>,
}

/// Every drone that flies lands; one that stands on the ground stays there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LandAll {
    /// Of the plan that is meant; left out: of whatever it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub revision: Option<u64>,
    /// When (s); no earlier than any time told before.
    #[schemars(range(min = BUSY_S.low, max = BUSY_S.high))]
    pub at_s: f64,
    /// Longest time that it may take (s); when it is over, what is flown goes on. Left out: no
    /// limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = MOST_TIME_LIMIT_S))]
    pub time_limit_s: Option<f64>,
}

/// A place to reach.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// Where (m).
    #[schemars(inner(range(min = PLACE_M.low, max = PLACE_M.high)))]
    pub to_m: [f64; 3],
    /// How long it hovers there (s).
    #[serde(default)]
    #[schemars(range(min = DWELL_S.low, max = DWELL_S.high))]
    pub dwell_s: f64,
    /// Payload from arrival on (kg); left out: unchanged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = LOAD_KG.low, max = LOAD_KG.high))]
    pub load_kg: Option<f64>,
}

/// Where drones are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// When (s); no earlier than any time told before.
    #[schemars(range(min = BUSY_S.low, max = BUSY_S.high))]
    pub at_s: f64,
    /// By name, any number of them.
    #[schemars(extend("maxProperties" = MOST_DRONES))]
    pub drones: BTreeMap<String, Place>,
    /// Longest time that it may take to plan on (s); when it is over, what is flown goes on. Left
    /// out: no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = MOST_TIME_LIMIT_S))]
    pub time_limit_s: Option<f64>,
}

/// Where one drone is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// m.
    #[schemars(inner(range(min = PLACE_M.low, max = PLACE_M.high)))]
    pub position_m: [f64; 3],
}

/// One line out: the answer to one line in.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Answer {
    /// Of the request, where it could be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<Id>,
    /// `serve/1`: in the first answer alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub protocol: Option<&'static str>,
    /// What was asked for, if there is no error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub result: Option<Told>,
    /// Why not; then nothing has changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<Refusal>,
}

impl Answer {
    /// Of a request that is refused before anyone has read what it asks.
    pub fn refused(code: Code, message: impl Into<String>) -> Answer {
        let error = Refusal {
            code,
            message: message.into(),
            place: String::new(),
            also: Vec::new(),
        };
        Answer {
            error: Some(error),
            ..Answer::default()
        }
    }

    /// What it changes in the plan.
    pub fn patch(&self) -> Option<&Patch> {
        match &self.result {
            Some(Told::Patch(patch)) => Some(patch),
            Some(Told::Seen(seen)) => seen.patch.as_ref(),
            Some(Told::Landing(landing)) => Some(&landing.patch),
            _ => None,
        }
    }
}

/// What is told to all that listen, in the order in which it happened.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "event", content = "data", rename_all = "snake_case")]
pub enum Event {
    /// The plan has changed.
    Patch(Patch),
    /// A plan was opened: ask for it.
    Opened(At),
    /// The plan was closed.
    Closed(Closed),
    /// What came after the event that was named last is not known any more: ask for the plan.
    AskPlan(At),
}

/// Where a plan is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct At {
    /// Its revision; `null`: none is open.
    pub revision: Option<u64>,
}

/// A result.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Told {
    /// Of `open` and `plan`.
    Whole(Box<Whole>),
    /// Of `change`.
    Patch(Patch),
    /// Of `state`.
    Seen(Seen),
    /// Of `land_all`.
    Landing(Landing),
    /// Of `close`.
    Closed(Closed),
}

/// The plan as it is now.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Whole {
    /// Rises by one with every patch.
    pub revision: u64,
    /// What has been flown and what will be, verified.
    pub plan: Plan,
}

/// What has changed; verified with all that has not.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Patch {
    /// Of the plan with this patch.
    pub revision: u64,
    /// The moment of the changes, in whole hundredths of a second (s).
    pub from_s: f64,
    /// Drones that fly something else from here on.
    pub changed: Vec<Changed>,
    /// Drones for which no path was found, and what they do instead.
    pub refused: Vec<Unplanned>,
    /// What it is too late to avoid, or what a drone without a path is in whether it stops or goes
    /// on. It is flown.
    pub unavoidable: Vec<Violation>,
}

/// A drone that flies something else.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Changed {
    /// Its name.
    pub drone: String,
    /// Why: `late`, `added`, `removed`, `failed`, `wreck` (what lies where one has failed),
    /// `retasked`, or it `gave_way` to one of these.
    #[schemars(with = "String")]
    pub cause: Cause,
    /// All that it still flies, from the last break point at or before `from_s` on.
    pub trajectory: TrajectoryEntry,
    /// What it does after that.
    #[schemars(with = "EndWord")]
    pub at_end: AtEnd,
}

/// What positions say.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Seen {
    /// Of the plan now.
    pub revision: u64,
    /// What follows from it; `null`: all are where the plan bears it.
    pub patch: Option<Patch>,
    /// Drones that are where their plan neither has nor had them, beyond its margins: no change of
    /// a plan says this. Their plans go on.
    pub off_path: Vec<OffPath>,
}

/// Drones that land, and drones that do not.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Landing {
    /// Of the plan with this patch.
    pub revision: u64,
    /// What follows.
    pub patch: Patch,
    /// Drones that fly and found no place to land, or no path there: they go on with what they had
    /// to do.
    pub not_landing: Vec<String>,
}

/// A drone off its path.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct OffPath {
    /// Its name.
    pub drone: String,
    /// How far from where its plan has it now (m).
    pub off_m: f64,
}

/// The plan is closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Closed {
    /// Its last revision.
    pub closed: u64,
}

/// Why a request is refused.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Refusal {
    /// For programs.
    pub code: Code,
    /// For people.
    pub message: String,
    /// Where in the line: `params.changes[0].late.by_s`, `column 12`, or, of a scenario,
    /// `params.scenario:LINE:COLUMN`; empty: all of it.
    pub place: String,
    /// What else is wrong.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    pub also: Vec<Refusal>,
}

/// What kind of refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Code {
    /// Not JSON.
    Malformed,
    /// No such method.
    UnknownMethod,
    /// A field that is missing, unknown, given twice, or of another kind.
    Field,
    /// The line is too long, or lists too much.
    TooMuch,
    /// No plan is open.
    NotOpen,
    /// A plan is open already.
    AlreadyOpen,
    /// The scenario is not in order.
    Scenario,
    /// The plan is none, or not that of the scenario.
    Plan,
    /// There is no plan that may be flown.
    NoPlan,
    /// The revision is an earlier one.
    StaleRevision,
    /// There is no such revision yet.
    FutureRevision,
    /// A number outside its range.
    Range,
    /// Not one of the times that may come next.
    Time,
    /// Earlier than a time told before.
    ClockBack,
    /// No drone is called that.
    UnknownDrone,
    /// A position that the drone cannot have come to.
    Jump,
    /// A change is not in order.
    Change,
    /// It took longer than it may.
    Deadline,
    /// The verifier found violations in what was planned.
    NotVerified,
    /// HTTP: there is nothing at this path.
    UnknownPath,
    /// HTTP: not with this method.
    HttpMethod,
    /// HTTP: the body is not said to be JSON.
    MediaType,
    /// HTTP: without the token.
    Unauthorized,
    /// HTTP: asked for under the name of another host.
    ForeignHost,
    /// HTTP: as many wait as may.
    Busy,
    /// HTTP: the body did not come in time.
    Slow,
    /// HTTP: the process is about to end.
    Stopping,
}

impl Code {
    /// As it is written in an answer.
    pub fn name(self) -> String {
        let value = serde_json::to_value(self).unwrap_or_default();
        value.as_str().unwrap_or_default().to_owned()
    }
}

/// What a journal keeps: each is one line, and replayed they give the same plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Record {
    /// The first line.
    Journal(String),
    /// A plan was opened.
    Opened {
        /// Of the scenario.
        scenario: String,
        /// As it was planned, or handed in.
        #[schemars(with = "Plan")]
        plan: Value,
    },
    /// It was changed.
    Changed {
        /// Which it has then.
        revision: u64,
        /// When (s).
        at_s: f64,
        /// What.
        changes: Vec<OneChange>,
    },
    /// It was closed.
    Closed,
}

impl Record {
    /// Reads a line of a journal.
    ///
    /// # Errors
    /// It is none: where, and why.
    pub fn read(line: &str) -> Result<Record, String> {
        serde_json::from_str(line).map_err(|error| {
            let (place, what) = of_one_line(&error);
            format!("{place}: {what}")
        })
    }
}

/// Where in its line JSON is wrong, and why.
pub(crate) fn of_one_line(error: &serde_json::Error) -> (String, String) {
    let what = error.to_string();
    let at = format!(" at line {} column {}", error.line(), error.column());
    let what = what.strip_suffix(&at).unwrap_or(&what);
    (format!("column {}", error.column()), what.to_owned())
}

/// A value by the name of its part of the schema: all fields that are not as it says, at their
/// place.
pub(crate) fn faults(part: &str, value: &Value, place: &str) -> Vec<FieldFault> {
    static MESSAGE: LazyLock<Value> = LazyLock::new(|| {
        let mut whole = schemars::schema_for!(Message).to_value();
        // What reads a plan takes more than is written, and tells itself what is wrong.
        whole["$defs"]["Plan"] = json!({});
        whole
    });
    form::faults(&MESSAGE, &MESSAGE["$defs"][part], value, place)
}

/// The JSON schema of every message: what goes in, what comes out, what is told to all that listen,
/// and what a journal keeps.
pub fn schema() -> schemars::Schema {
    schemars::json_schema!({
        "protocol": PROTOCOL,
        "message": schemars::schema_for!(Message),
        "answer": schemars::schema_for!(Answer),
        "event": schemars::schema_for!(Event),
        "record": schemars::schema_for!(Record),
    })
}
