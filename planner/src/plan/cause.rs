//! Why a drone has no path, as data; `Display` makes the sentence that `plan.json` holds.

use std::fmt;

use nalgebra::Point3;
use serde::Serialize;
use thiserror::Error;

use super::UnplannedCause;
use super::outcome::Meeting;

/// Room that a descent to a pad lacks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MissingRoom {
    /// How much is missing (m).
    pub short_m: f64,
    /// Whether it is height, below something overhead; else it is room beside an obstacle.
    pub is_height: bool,
}

impl fmt::Display for MissingRoom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Rounded up, so that it never prints as 0.
        let short_m = (self.short_m * 100.0).ceil() / 100.0;
        let of = match self.is_height {
            true => "height below what is overhead",
            false => "room beside an obstacle",
        };
        write!(f, "{short_m:.2} m of {of}")
    }
}

/// Why a drone stays at its start.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureCause {
    /// The roadmap has no path through free space to one of its tasks; where that is known, which.
    NoPath(Option<MissingPath>),
    /// It cannot be at one of its tasks in time, with no other drone there.
    TooLate {
        /// Which task, counted from 1.
        task: usize,
        /// When it is there, and at rest, along the lattice (s).
        at_s: f64,
        /// When it is due (s), where that is known.
        due_s: Option<f64>,
        /// Whether no path is short enough; else none was found.
        is_proven: bool,
    },
    /// Its goal and another's, or a zone, exclude one another; where that is known, how.
    GoalConflict(Option<GoalConflict>),
    /// The descent from its last task is too narrow.
    NoRoomToLand {
        /// How much is missing.
        #[serde(flatten)]
        lacks: MissingRoom,
        /// What would help, as far as that was looked for.
        remedy: Remedy,
    },
    /// Other drones block it, or a zone that its wake is too strong for.
    Obstructed {
        /// What blocked it nearest to the goal; `None`: the eviction limit was reached.
        by: Option<Hindrance>,
        /// What would help, as far as that was looked for.
        remedy: Remedy,
        /// The extent of the search; absent where a flight under way is replanned.
        extent: Option<Extent>,
    },
    /// The run was stopped first; with how crowded the floor is, where it is.
    Stopped(Option<Crowding>),
}

impl FailureCause {
    /// The place (m) near a drone's goal, or near a task's place, that the cause proposes, if any.
    pub(crate) fn goal_m(&self, of: &str, at: Option<&Meeting>) -> Option<Point3<f64>> {
        let task = |meeting: Option<&Meeting>| meeting.and_then(|it| it.task);
        match self {
            FailureCause::GoalConflict(Some(it)) => (it.drone == of
                && task(it.meeting.as_ref()) == task(at)
                && it.meeting.is_some() == at.is_some())
            .then_some(it.nearest_fix_m)?,
            _ => None,
        }
    }

    /// The same for programs, of a drone by its name.
    pub fn data(&self, drone: &str) -> UnplannedCause {
        let bare = |kind: &str| UnplannedCause {
            kind: kind.to_owned(),
            blocker: None,
            at_m: None,
            at_s: None,
        };
        match self {
            FailureCause::NoPath(path) => UnplannedCause {
                at_m: path.as_ref().map(|path| path.to_m),
                ..bare("no_path")
            },
            FailureCause::TooLate { at_s, .. } => UnplannedCause {
                at_s: Some(*at_s),
                ..bare("too_late")
            },
            FailureCause::GoalConflict(conflict) => UnplannedCause {
                blocker: conflict.as_ref().map(|it| match it.drone == drone {
                    true => it.with.split('`').nth(1).unwrap_or(&it.with).to_owned(),
                    false => it.drone.clone(),
                }),
                at_m: conflict.as_ref().map(|it| it.at_m),
                at_s: (conflict.as_ref())
                    .and_then(|it| it.meeting?.during_s)
                    .map(|[from_s, _]| from_s),
                ..bare("goal_conflict")
            },
            FailureCause::NoRoomToLand { .. } => bare("no_room_to_land"),
            FailureCause::Obstructed { by: None, .. } => bare("eviction_limit"),
            FailureCause::Obstructed { by: Some(by), .. } => {
                let (kind, blocker) = match &by.kind {
                    HindranceKind::Zone { zone, .. } => ("zone", zone),
                    HindranceKind::Body(name) => ("body", name),
                    HindranceKind::Column(name) => ("column", name),
                    HindranceKind::Downwash(name) => ("downwash", name),
                    HindranceKind::OwnDownwash(name) => ("own_downwash", name),
                    HindranceKind::ZoneTogether(name) => ("zone_together", name),
                };
                UnplannedCause {
                    blocker: Some(blocker.clone()),
                    at_m: Some(by.at_m),
                    at_s: Some(by.from_s),
                    ..bare(kind)
                }
            }
            FailureCause::Stopped(_) => bare("stopped"),
        }
    }
}

/// The extent of a search for a path, and so what a "no" means.
#[derive(Clone, Copy, Debug, Error, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Extent {
    /// No path exists at any resolution: bodies and walls close every passage, or the downwash of a
    /// drone that hovers at one of its tasks is too strong for a zone.
    #[error("proven: there is none at any resolution")]
    Proven,
    /// None on lattices down to this spacing, all states looked at.
    #[error("not found on cells down to {} m", as_typed(*cell_m))]
    NotFound {
        /// Spacing of the finest of them (m).
        cell_m: f64,
    },
    /// The budget of states ended before.
    #[error(
        "not found: the budget of states ended on cells of {} m, after {states} in all",
        as_typed(*cell_m)
    )]
    BudgetEnded {
        /// States of all searches.
        states: u64,
        /// Smallest spacing of a lattice on which a budget ended (m).
        cell_m: f64,
    },
    /// Planning was stopped before.
    #[error("not found on cells down to {} m when planning was stopped", as_typed(*cell_m))]
    Stopped {
        /// Spacing of the finest lattice that was looked at (m).
        cell_m: f64,
    },
}

impl Extent {
    /// Spacing of the finest lattice that was looked at (m); 0 where any is.
    pub fn cell_m(&self) -> f64 {
        match *self {
            Extent::Proven => 0.0,
            Extent::NotFound { cell_m }
            | Extent::BudgetEnded { cell_m, .. }
            | Extent::Stopped { cell_m } => cell_m,
        }
    }
}

/// The part of a drone's job that no path leads along.
#[derive(Clone, Debug, Error, PartialEq, Serialize)]
#[error(
    "no path through free space from {} to task {task} at {} for a body of {body_radius_m:.2} m radius with \
     {clearance_m:.2} m clearance ({extent}); {closed_by}",
    place(from_m),
    place(to_m)
)]
pub struct MissingPath {
    /// From here (m).
    pub from_m: Point3<f64>,
    /// To this task, counted from 1.
    pub task: usize,
    /// Where that is (m).
    pub to_m: Point3<f64>,
    /// Radius of the body (m).
    pub body_radius_m: f64,
    /// Kept from obstacles beyond it (m).
    pub clearance_m: f64,
    /// The extent of the search.
    pub extent: Extent,
    /// What blocks the path.
    pub closed_by: ClosedBy,
}

/// What blocks the path to a task.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ClosedBy {
    /// Zones that keep bodies out: without them there is a path.
    Zones(Vec<String>),
    /// Solids, for a body of any size.
    Solids,
    /// The clearance: with this one (m) there is a path.
    Clearance(f64),
    /// A gap that is too narrow, or an unknown cause.
    Gap,
    /// What is above or beside its pad: it goes straight up by so much (m) before it turns.
    TakeOff(f64),
}

impl fmt::Display for ClosedBy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ClosedBy::Zones(names) => {
                let names: Vec<String> = names.iter().map(|it| format!("`{it}`")).collect();
                let (zones, keep) = match names.len() {
                    1 => ("zone", "keeps"),
                    _ => ("zones", "keep"),
                };
                write!(
                    f,
                    "{zones} {} {keep} bodies out of the only way: make room beside or above",
                    names.join(" and ")
                )
            }
            ClosedBy::Solids => f.write_str("no body of any size fits through: open a way"),
            ClosedBy::Clearance(clearance_m) => write!(
                f,
                "with planning: (clearance_m: {}) there is a way",
                as_typed(*clearance_m)
            ),
            ClosedBy::Gap => f.write_str("widen the gap, or fly a smaller airframe"),
            ClosedBy::TakeOff(rises_m) => write!(
                f,
                "from its pad it goes straight up by {rises_m:.2} m before it turns, and what is above or beside it \
                 is in the way: clear it, or begin elsewhere"
            ),
        }
    }
}

/// Two goals, or a goal and a zone, or two tasks, that exclude one another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GoalConflict {
    /// The exposed drone.
    pub drone: String,
    /// Of tasks: which, and when.
    pub meeting: Option<Meeting>,
    /// To what: "`name`" of a drone, or "zone `name`".
    pub with: String,
    /// How.
    pub why: Exclusion,
    /// A place for `drone` near its own where this pair is in order (m).
    pub nearest_fix_m: Option<Point3<f64>>,
    /// The place of the drone that stays (m): one of the two.
    pub at_m: Point3<f64>,
    /// Of air allowed by another limit: all limits raised in the plan that shows it, by drone.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub raised: Vec<(String, f64)>,
}

/// How two endpoints exclude one another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Exclusion {
    /// The gap between the bodies is too small (m).
    Bodies {
        /// Gap between the balls (m); negative: they overlap.
        gap_m: f64,
        /// What it must be (m).
        needs_m: f64,
        /// A `tracking_m` (m) with which this gap and all others of the fleet would do, where that
        /// margin asks for more than the clearance: planned.
        tracking_m: Option<f64>,
    },
    /// The centre is in the near-field column.
    Column,
    /// The mean air over the rotor discs, all wakes summed, exceeds the limit.
    Air {
        /// Mean air over the discs (m/s).
        air_mps: f64,
        /// The same over the induced velocity.
        alpha: f64,
        /// The drone's limit.
        limit: f64,
        /// Another limit that allows this: planned, with all drones in another's air at limits that
        /// allow it.
        enough: Option<f64>,
    },
    /// The drone's wake reaches into a zone.
    Zone {
        /// Highest summed speed in the zone (m/s).
        air_mps: f64,
        /// The zone's limit (m/s).
        limit_mps: f64,
        /// Several drones' air breaks the limit, none alone; else this drone's.
        together: bool,
    },
}

/// What blocked a search.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hindrance {
    /// What it is.
    pub kind: HindranceKind,
    /// How far the drone could get, or where it comes nearest to the other as it lands (m).
    pub at_m: Point3<f64>,
    /// It blocked the landing.
    pub lands: bool,
    /// When the drone would have gone on (s).
    pub from_s: f64,
}

/// What can block a search.
#[derive(Clone, Debug, Error, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum HindranceKind {
    /// A zone that the drone's own wake is too strong for.
    #[error(
        "its own downwash is too strong for zone `{zone}`, which allows {air_limit_mps:.1} m/s,"
    )]
    Zone {
        /// Its name.
        zone: String,
        /// Its limit (m/s).
        air_limit_mps: f64,
    },
    /// The body of another drone.
    #[error("the body of `{0}` is in its way")]
    Body(String),
    /// The near-field column of either of the two.
    #[error("the near-field column between it and `{0}` is in its way")]
    Column(String),
    /// The downwash of another drone.
    #[error("the downwash of `{0}` is in its way")]
    Downwash(String),
    /// Its own downwash, on another drone.
    #[error("its downwash would fall on `{0}`")]
    OwnDownwash(String),
    /// Its downwash and another drone's together, in a zone.
    #[error("its downwash and that of `{0}` are too much for a zone")]
    ZoneTogether(String),
}

/// What could be done about it; shown with the semicolon that sets it off from the obstruction.
#[derive(Clone, Debug, Error, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Remedy {
    /// Not looked for, or none known.
    #[error("")]
    Unknown,
    /// The floor is crowded.
    #[error(
        "; {} of the floor's {} columns ({:.0} %) are under drones that hover without end: let some of them land or \
         leave, or give the fleet more floor",
        .0.held, .0.open, 100.0 * .0.share()
    )]
    LessCrowding(Crowding),
    /// The same as for this drone, which the group has in common.
    #[error("; see `{0}`")]
    SameAs(String),
    /// No pass was found at any air limit either.
    #[error("; none was found at any air limit either: bodies, columns or zones are in the way")]
    NoneAtAnyLimit,
    /// Higher air limits.
    #[error("; {0}")]
    RaiseLimits(Exposure),
    /// Another place for a task: planned.
    #[error("; with {0} it is planned{then}", then = .0.then())]
    MoveTask(Moved),
    /// The same, where the landing after it is the cause.
    #[error("; its landing is the cause: with {0} it is planned{then}", then = .0.then())]
    MoveLanding(Moved),
    /// No landing, which is the cause: planned.
    #[error("; its landing is the cause: with at_end: Hover it is planned")]
    StayUp,
    /// Higher bounds, and where its own task is too near above a zone another height for it:
    /// planned.
    #[error("; {0}")]
    RaiseBounds(Higher),
    /// The budget for looking, of states or of drones, ended before anything that helps was found.
    #[error("; what would help was not found: the budget for looking ended")]
    BudgetEnded,
    /// A higher limit of a zone: planned.
    #[error("; with an air_limit_mps of {air_limit_mps} in zone `{zone}` it is planned")]
    RaiseZone {
        /// Its name.
        zone: String,
        /// What its limit would have to be (m/s).
        air_limit_mps: f64,
    },
}

/// Bounds that reach farther up.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Higher {
    /// Highest z of the bounds (m).
    pub max_z_m: f64,
    /// Where a task of the drone would have to be within them, if not where it is.
    pub moved: Option<Moved>,
}

impl fmt::Display for Higher {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Higher { max_z_m, moved } = self;
        write!(f, "with bounds_m up to z = {} m", as_typed(*max_z_m))?;
        if let Some(moved) = moved {
            write!(f, " and {moved}")?;
        }
        f.write_str(" it is planned")
    }
}

/// Another place for a task.
#[derive(Clone, Debug, Error, PartialEq, Serialize)]
#[error("its task {task} at {}", place(to_m))]
pub struct Moved {
    /// Which one, counted from 1.
    pub task: usize,
    /// Where it would have to be (m).
    pub to_m: Point3<f64>,
    /// Drones refused then, still or newly, by name: no place was found with which all are planned.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub refused: Vec<String>,
}

impl Moved {
    /// ", but then `b` is refused"; nothing where all are planned.
    fn then(&self) -> String {
        let names: Vec<String> = self
            .refused
            .iter()
            .map(|name| format!("`{name}`"))
            .collect();
        match names.len() {
            0 => String::new(),
            1 => format!(", but then {} is refused", names[0]),
            _ => format!(", but then {} are refused", names.join(", ")),
        }
    }
}

/// The gentlest pass there is, and the air limits that it wants.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Exposure {
    /// The most exposed drone.
    pub drone: String,
    /// Where (m).
    pub at_m: Point3<f64>,
    /// The emitter, how far above (m), and how far aside (m).
    pub beside: Option<(String, f64, f64)>,
    /// Mean downwash over the rotor discs, over its induced velocity.
    pub alpha: f64,
    /// What that costs (% of the power).
    pub extra_percent: f64,
    /// Axial exposure (m) and extra energy (J) of its whole flight.
    pub whole: (f64, f64),
    /// Drones whose limits must be raised.
    pub drones: Vec<String>,
    /// The limit with which it is planned. `None`: no limit that was tried is enough.
    pub air_limit: Option<f64>,
}

/// Columns of the floor under drones that hover until the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Crowding {
    /// Columns held.
    pub held: usize,
    /// Columns that there are.
    pub open: usize,
}

impl Crowding {
    /// Held columns over all, 0 to 1.
    pub fn share(&self) -> f64 {
        self.held as f64 / self.open.max(1) as f64
    }
}

/// Most limits named that are raised together: chosen here, a line or two.
const MOST_RAISED: usize = 8;

/// Limits of air, by drone, that are raised together, that of `of` first, names between `quotes`:
/// "the air_limits of b to 0.72 and d to 0.72 raised together".
pub fn raised_together(of: &str, raised: &[(String, f64)], quotes: &str) -> String {
    let (own, others): (Vec<_>, Vec<_>) = raised.iter().partition(|(name, _)| name == of);
    let told = own.into_iter().chain(others).take(MOST_RAISED);
    let mut told: Vec<String> = told
        .map(|(name, limit)| format!("{quotes}{name}{quotes} to {limit:.2}"))
        .collect();
    let more = raised.len() - told.len();
    let last = match more {
        0 => told.pop().unwrap_or_default(),
        _ => format!("{more} more as at their own conflicts"),
    };
    format!(
        "the air_limits of {} and {last} raised together",
        told.join(", ")
    )
}

/// A value and its limit, with so many decimals; with more where they read alike.
pub fn format_distinct(value: f64, limit: f64, decimals: usize) -> [String; 2] {
    let told = |decimals: usize| [value, limit].map(|it| format!("{it:.decimals$}"));
    let mut finer = (decimals..MOST_DECIMALS).map(told);
    let apart = finer.find(|[value, limit]| value != limit);
    apart.unwrap_or_else(|| told(MOST_DECIMALS))
}

/// What is nearer to its limit is no conflict: a hundredth of what makes two places the same.
const MOST_DECIMALS: usize = 8;

/// A number that was worked out as a person would type it: to nine digits, which hides what binary
/// fractions leave of 0.2, and nothing that is measured. Wherever a sentence has a number with all
/// its digits, it is this one.
pub fn as_typed(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap_or(value)
}

/// A place as sentences write it, to the centimetre.
fn place(point_m: &Point3<f64>) -> String {
    format!("({:.2}, {:.2}, {:.2})", point_m.x, point_m.y, point_m.z)
}

impl fmt::Display for FailureCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FailureCause::NoPath(Some(missing)) => missing.fmt(f),
            FailureCause::NoPath(None) => f.write_str(
                "there is no path through free space to one of its tasks that its body fits through",
            ),
            FailureCause::TooLate {
                task,
                at_s,
                due_s,
                is_proven,
            } => {
                let none = match is_proven {
                    true => "no path is short enough",
                    false => "no shorter path was found",
                };
                write!(
                    f,
                    "with no other drone there it is at task {task} at {at_s:.2} s along the lattice, \
                     and {none}"
                )?;
                due_s.map_or(Ok(()), |due_s| {
                    write!(f, ": it is due at {} s", as_typed(due_s))
                })
            }
            FailureCause::GoalConflict(Some(conflict)) => conflict.fmt(f),
            FailureCause::GoalConflict(None) => {
                f.write_str("its end and another's exclude one another")
            }
            FailureCause::NoRoomToLand { lacks, remedy } => {
                write!(f, "the descent to its pad lacks {lacks}")?;
                remedy.fmt(f)
            }
            FailureCause::Obstructed { by, remedy, extent } => {
                match by {
                    Some(by) => by.fmt(f)?,
                    None => f.write_str("it and others reached the eviction limit in conflict with one another")?,
                }
                if let Some(extent) = extent {
                    write!(f, " ({extent})")?;
                }
                remedy.fmt(f)
            }
            FailureCause::Stopped(crowding) => {
                f.write_str("planning was stopped before its turn")?;
                crowding.map_or(Ok(()), |crowding| Remedy::LessCrowding(crowding).fmt(f))
            }
        }
    }
}

impl GoalConflict {
    /// Where its drone is: "goal", "task 2" or "start".
    fn place(&self) -> String {
        match self.meeting.map(|it| it.task) {
            None => "goal".to_owned(),
            Some(Some(task)) => format!("task {task}"),
            Some(None) => "start".to_owned(),
        }
    }

    /// At which task the other is, and when: " at its task 1 (10 to 12 s)".
    fn when(&self) -> String {
        let Some(meeting) = self.meeting else {
            return String::new();
        };
        let there = meeting
            .their_task
            .map_or(", which stays there".to_owned(), |task| {
                format!(" at its task {task}")
            });
        let during = meeting.during_s.map_or(String::new(), |during_s| {
            let [from_s, until_s] = during_s.map(as_typed);
            format!(" ({from_s} to {until_s} s)")
        });
        there + &during
    }
}

impl fmt::Display for GoalConflict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let GoalConflict { drone, with, .. } = self;
        let (place, when) = (self.place(), self.when());
        let of = match self.meeting.and_then(|it| it.task) {
            Some(_) => place.clone(),
            None => format!("the {place}"),
        };
        match self.why {
            Exclusion::Bodies { gap_m, needs_m, .. } if gap_m < 0.0 => {
                let by_m = -gap_m;
                write!(
                    f,
                    "at its {place} the body of `{drone}` overlaps that of {with}{when} by {by_m:.2} m, \
                     between them must be {needs_m:.2} m"
                )
            }
            Exclusion::Bodies {
                gap_m,
                needs_m,
                tracking_m,
            } => {
                let [gap_m, needs_m] = format_distinct(gap_m, needs_m, 2);
                write!(
                    f,
                    "{of} of `{drone}` is {gap_m} m from the body of {with}{when}, it needs {needs_m} m"
                )?;
                match tracking_m {
                    Some(bears_m) => {
                        write!(f, " (with planning: (tracking_m: {bears_m}) it is planned)")
                    }
                    None => Ok(()),
                }
            }
            Exclusion::Column => write!(
                f,
                "{of} of `{drone}` is in the near-field column of {with}{when}"
            ),
            Exclusion::Air {
                air_mps,
                alpha,
                limit,
                enough,
            } => {
                let [alpha, limit] = format_distinct(alpha, limit, 2);
                write!(
                    f,
                    "{of} of `{drone}` is in the downwash of {with}{when}: {air_mps:.1} m/s, \
                     alpha {alpha}, its limit is {limit}"
                )?;
                match (enough, &self.raised[..]) {
                    (Some(_), raised @ [_, _, ..]) => {
                        write!(
                            f,
                            " (with {} all are planned)",
                            raised_together(drone, raised, "`")
                        )
                    }
                    (Some(enough), _) => {
                        write!(f, " (with air_limit: {enough:.2} it is planned)")
                    }
                    (None, _) => Ok(()),
                }
            }
            Exclusion::Zone {
                air_mps,
                limit_mps,
                together,
            } => {
                let [air_mps, limit_mps] = format_distinct(air_mps, limit_mps, 1);
                let others = if together {
                    ", with that of others,"
                } else {
                    ""
                };
                write!(
                    f,
                    "downwash from {of} of `{drone}`{others} reaches {air_mps} m/s in {with}, \
                     which allows {limit_mps} m/s"
                )
            }
        }?;
        match &self.nearest_fix_m {
            Some(fix_m) => write!(f, "; move `{drone}`'s {place} to {}", self::place(fix_m)),
            None => Ok(()),
        }
    }
}

impl fmt::Display for Hindrance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Hindrance {
            kind,
            at_m,
            lands,
            from_s,
        } = self;
        let lands = if *lands { " as it lands," } else { "" };
        write!(f, "{kind}{lands} at {} from {from_s:.1} s on", place(at_m))
    }
}

impl fmt::Display for Exposure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<String> = self.drones.iter().map(|name| format!("`{name}`")).collect();
        let (names, at) = (names.join(", "), place(&self.at_m));
        let Exposure {
            drone,
            alpha,
            extra_percent,
            air_limit,
            ..
        } = self;
        write!(
            f,
            "no pass without exposure was found: the gentlest puts `{drone}` at {at}"
        )?;
        if let Some((other, below_m, aside_m)) = &self.beside {
            write!(
                f,
                ", {below_m:.1} m below and {aside_m:.1} m beside `{other}`"
            )?;
        }
        write!(f, ", alpha {alpha:.2}, +{extra_percent:.0} % power")?;
        let (dose_m, energy_j) = self.whole;
        write!(
            f,
            " there, {dose_m:.1} m of axial exposure and {energy_j:.0} J in all"
        )?;
        match air_limit {
            Some(air_limit) => write!(
                f,
                "; with the air_limit of {names} raised to {air_limit:.2} it is planned"
            ),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{as_typed, format_distinct};

    #[test]
    fn a_number_reads_as_it_was_typed() {
        for (value, typed) in [
            (0.6 / 3.0, "0.2"),
            (2.55 + 4.440892098500626e-16, "2.55"),
            (0.1 + 0.2, "0.3"),
            (1234567.25, "1234567.25"),
            (0.0, "0"),
            (-0.125, "-0.125"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(as_typed(value).to_string(), typed);
        }
        assert!(as_typed(f64::NAN).is_nan());
    }

    #[test]
    fn what_is_too_much_never_reads_as_its_limit() {
        assert_eq!(format_distinct(1.52, 1.3, 1), ["1.5", "1.3"]);
        assert_eq!(format_distinct(0.849, 0.7897, 1), ["0.85", "0.79"]);
        assert_eq!(format_distinct(0.301, 0.3, 2), ["0.301", "0.300"]);
        assert_eq!(format_distinct(0.099998, 0.1, 2), ["0.099998", "0.100000"]);
    }
}
