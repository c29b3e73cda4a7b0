//! What planning answers, and how a caller watches and stops it.

use crate::plan::Plan;
use nalgebra::Point3;

/// The answer to "plan this world".
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "one value a run, and the large variant is the usual one"
)]
pub enum Outcome {
    /// A verified plan; those who could not be planned stay at their starts and are named in it.
    Planned {
        /// The plan, with the verifier's findings in it.
        plan: Plan,
        /// Goals that exclude one another; the drones dropped for it are in [`Plan::unplanned`].
        conflicts: Vec<EndpointConflict>,
        /// Whether every order of the fleet leads to a plan; `None` where that is not examined: among zones, in air that
        /// takes its time, around others' fixed ways, where somebody lands, and where a start or a task lies beside the lattice.
        well_formed: Option<WellFormed>,
        /// What the search did.
        effort: Effort,
    },
    /// The starts themselves exclude one another: no plan can be safe.
    Blocked {
        /// Every offending pair, starts and goals.
        conflicts: Vec<EndpointConflict>,
    },
    /// Stopped before there was any plan.
    Stopped,
}

/// What the search did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Searches for one drone.
    pub searches: u64,
    /// States expanded over all searches.
    pub expansions: u64,
    /// Drones whose plan was taken back for another's.
    pub evictions: u64,
    /// Steps of everybody at once that were tried, where one after another found no way.
    pub rounds: u64,
    /// By how much the sum of arrivals fell once everybody had a way (ticks of 1/100 s); `None`: nobody asked for it.
    pub improved_ticks: Option<u64>,
}

impl Effort {
    /// By how much the sum of arrivals fell once everybody had a way (s); `None`: nobody asked for it.
    pub fn improved_s(&self) -> Option<f64> {
        let ticks = self.improved_ticks?;
        Some(ticks as f64 / costmap::leg::Tick::PER_SECOND)
    }
}

/// Two places, or a place and a zone, that exclude one another.
#[derive(Clone, Debug, PartialEq)]
pub struct EndpointConflict {
    /// Index in [`crate::scenario::world::World::drones`] of the one who suffers.
    pub drone: usize,
    /// Who or what is in the way.
    pub blocker: Blocker,
    /// Both at their starts, or both at their goals.
    pub when: EndpointKind,
    /// How they exclude one another.
    pub why: Exclusion,
    /// A place for `drone` near its endpoint where this pair is in order, if there is one near.
    pub nearest_fix_m: Option<Point3<f64>>,
}

/// Who or what is in the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blocker {
    /// Index in [`crate::scenario::world::World::drones`].
    Drone(usize),
    /// Index in [`crate::scenario::world::World::zones`].
    Zone(usize),
}

/// Which endpoints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndpointKind {
    /// At time 0.
    Starts,
    /// After the last arrival.
    Goals,
}

/// How two endpoints exclude one another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exclusion {
    /// The gap between the bodies is too small (m).
    Bodies {
        /// Gap between the balls (m); negative: they overlap.
        gap_m: f64,
        /// What it must be (m).
        needs_m: f64,
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
    },
    /// The drone blows into a zone.
    Zone {
        /// Highest summed speed in the zone (m/s).
        air_mps: f64,
        /// The zone's limit (m/s).
        limit_mps: f64,
    },
}

/// Whether every order of the fleet leads to a plan; see [`crate::solver::well_formed`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WellFormed {
    /// Drones examined: the whole fleet.
    pub drones: usize,
    /// Those among them that may have to wait for others, indices in the world's drones.
    pub waiting: Vec<usize>,
    /// What keeps the endpoints from being well-formed, by drone.
    pub offences: Vec<Offence>,
}

/// Two drones whose endpoints make one of them wait for the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Offence {
    /// Who has to wait, an index in the world's drones.
    pub drone: usize,
    /// For whom.
    pub other: usize,
    /// What it is about.
    pub kind: OffenceKind,
}

/// How two drones' endpoints are in one another's way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum OffenceKind {
    /// The goal of the first and the start of the other exclude one another.
    GoalAtStart,
    /// The start or the goal of the other is beside the room that the first cannot leave.
    Enclosed,
}

impl WellFormed {
    /// Whether every order leads to a plan.
    pub fn is_proven(&self) -> bool {
        self.waiting.is_empty()
    }
}

/// How a caller watches and stops a planner that reads no clock itself.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Asked often; once it says `true` the best safe plan so far is returned.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Asked when everybody has a way: whether to go on and make the plan better.
    pub improve: &'a (dyn Fn() -> bool + Sync),
    /// Told now and then.
    pub progress: &'a (dyn Fn(Progress) + Sync),
}

/// How far planning has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Roadmap, heuristics, volumes.
    Preparing,
    /// Drones that have a path, of all.
    Searching {
        /// With a path now.
        planned: usize,
        /// In the fleet.
        drones: usize,
        /// Taken back so far.
        evictions: u64,
    },
    /// Everybody has a way; better ones are looked for while there is time.
    Improving,
    /// The continuous-time check.
    Verifying,
    /// The second plan, without wakes.
    IgnoringDownwash,
}

impl Control<'_> {
    /// Never stops, tells nobody.
    pub const QUIET: Control<'static> = Control {
        stop: &|| false,
        improve: &|| false,
        progress: &|_| {},
    };
}
