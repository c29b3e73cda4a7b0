//! Space-time A* for one drone among those already planned.
//!
//! A state is a place, a task and a moment. From there the drone steps to a neighbouring place,
//! dwells, or ends. Who is in the way is asked of the tables of reservations, where there are any,
//! and the way that was found is judged by the costmap; without them every step is. A drone in the
//! way does not forbid a step: it may be met, once, at a price, and gives way afterwards (ejection
//! chains: F. Glover, "Ejection chains, reference structures and alternating path methods for
//! traveling salesman problems", Discrete Applied Mathematics 65, 1996; here as penalties in the
//! search, as in PBS and LNS2 for multi-agent path finding). An immovable one forbids it. Or the
//! step is taken later.
//!
//! A state stands for all the time for which hovering at its place is free from then on, as in
//! safe-interval path planning (M. Phillips and M. Likhachev, "SIPP", ICRA 2011): later arrivals
//! within it are dropped, and the neighbouring places are reached in each of their own intervals.

use std::rc::Rc;

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict, Why};
use nalgebra::Point3;
use rustc_hash::FxHashSet;

use crate::graph::agent::Agent;
use crate::graph::roadmap::{Roadmap, Vertex};
use crate::sipp::conflicts::ReservationTable;
use crate::sipp::goal_occupancy::Stays;

mod heuristic;
mod label;
mod met;
mod node;
mod walk;

use heuristic::Heuristic;
use walk::Search;
pub(crate) use walk::joined;

/// A drone that no drone can make give way.
pub(crate) const IMMOVABLE: u32 = u32::MAX;

/// What is left to fly counts one part in 2ⁿ more than it takes, so that of ways that differ by
/// less the one found first will do. The part bounds the excess of an answer over the best. Chosen
/// here.
const PLAIN_SHIFT: u32 = 5;
/// A plain look, where hardly anybody is in the way and nothing in between, takes so many states:
/// chosen here.
const PLAIN_STATES: u64 = 64;
/// Past those who stay the search is in more of a hurry the longer it takes: the part, and up to
/// how many states. Chosen here: the first nearly always answers, and the others keep a crowd from
/// costing seconds a drone.
const WEIGHT_SCHEDULE: [(u32, u64); 4] = [(5, 500), (3, 1_500), (2, 5_000), (0, u64::MAX)];
/// Where more of all places than this are closed for good there is no plain look: chosen here.
const PLAIN_SHARE: f64 = 0.12;
/// A plain look may take a state more for each of these ticks of the way: chosen here, two a step
/// of 1 m at 2 m/s.
const TICKS_A_STATE: u64 = 25;

/// What a search works on.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    /// Ways through free space.
    pub(crate) roadmap: &'a Roadmap,
    /// Every drone planned so far.
    pub(crate) costmap: &'a Costmap,
    /// The same in brief, for searches whose answer is judged afterwards.
    pub(crate) reservations: Option<&'a ReservationTable<'a>>,
    /// Price in ticks of meeting each drone, or [`IMMOVABLE`].
    pub(crate) weights: &'a [u32],
    /// Until when each drone goes on as it does, whatever its price; empty: no drone is under way.
    pub(crate) under_way: &'a [Tick],
    /// Seconds of delay that a second's worth of hover energy is worth.
    pub(crate) energy_weight: f64,
    /// Whether a detour around those who stay for good is looked for before any of them gives way.
    /// Where half of the floor is held for good, those who are led around others end up in their
    /// way, and quarrels do not end.
    pub(crate) detours: bool,
    /// Whether every step is judged in full, weak wakes on those far off included.
    pub(crate) careful: bool,
    /// States after which the search gives up.
    pub(crate) most_expansions: u64,
    /// Asked now and then.
    pub(crate) stop: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> Scene<'a> {
    /// Every step judged in full by the costmap, among drones that have these prices.
    pub(crate) fn judged(
        roadmap: &'a Roadmap,
        costmap: &'a Costmap,
        weights: &'a [u32],
        stop: &'a (dyn Fn() -> bool + Sync),
    ) -> Scene<'a> {
        Scene {
            roadmap,
            costmap,
            reservations: None,
            weights,
            under_way: &[],
            energy_weight: 0.0,
            detours: true,
            careful: true,
            most_expansions: u64::MAX,
            stop,
        }
    }

    /// What is in the way is flown already, and cannot be taken back.
    fn is_under_way(&self, blocker: &Blocker) -> bool {
        let until = self.under_way.get(blocker.drone.0 as usize);
        until.is_some_and(|until| blocker.clear <= *until)
    }

    /// Price of what is in the way.
    pub(crate) fn weight(&self, blocker: &Blocker) -> u32 {
        if self.is_under_way(blocker) {
            return IMMOVABLE;
        }
        self.weights[blocker.drone.0 as usize]
    }

    /// Who is in the way of a leg, by the costmap: far-off drones' weak wakes count only where it is careful.
    pub(crate) fn judge(&self, leg: &Leg, verdict: &mut Verdict) {
        if self.careful {
            self.costmap.judge(leg, verdict);
        } else {
            self.costmap.judge_nearby(leg, verdict);
        }
    }
}

/// A way from start to end.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Path {
    /// Back to back from where its agent begins; the last one may last until the end.
    pub(crate) legs: Vec<Leg>,
    /// End of the last dwell.
    pub(crate) arrives: Tick,
    /// Who must give way.
    pub(crate) met: Vec<DroneId>,
}

impl Path {
    /// A way on which no drone has to give way.
    pub(crate) fn new(legs: Vec<Leg>, arrives: Tick) -> Path {
        Path {
            legs,
            arrives,
            met: Vec::new(),
        }
    }
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Found {
    /// The cheapest way.
    Path(Path),
    /// None, and what was in the way closest to the goal.
    Blocked(Option<Obstruction>),
    /// Told to stop.
    Stopped,
}

/// What was in the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Obstruction {
    /// Who or what.
    pub(crate) by: Obstructor,
    /// Where the drone could get to (m).
    pub(crate) at_m: Point3<f64>,
    /// When it would have gone on.
    pub(crate) at: Tick,
    /// Ticks that were left to fly.
    remaining: u32,
}

/// Who or what can be in the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Obstructor {
    /// Another drone, and how.
    Drone(DroneId, Why),
    /// A zone (its index) that the drone's own wake is too strong for.
    Zone(usize),
}

/// Result and effort of one search.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Searched {
    /// What was found.
    pub(crate) found: Found,
    /// States expanded.
    pub(crate) expansions: u64,
}

/// Ways tried by the reservation table's intervals before every step is judged; chosen here.
const MOST_TRIES: usize = 8;

/// Steps and stays that looked free in brief and are not: from where and to where.
pub(crate) type RefutedEdges = FxHashSet<(Vertex, Vertex)>;

/// Finds the cheapest way for one agent.
///
/// With a reservation table it is looked for in brief, and judged in the end; steps that were taken
/// for free are judged at once when it is looked for again.
pub(crate) fn search(mut scene: Scene<'_>, agent: &Agent) -> Searched {
    if !agent.forgiven.is_empty() {
        // What is forgiven depends on how a drone is in the way.
        scene.reservations = None;
    }
    let searched = find(scene, agent);
    agent.forget();
    searched
}

/// Tries by the reservation table until a path holds, then with every step judged in full.
fn find(scene: Scene<'_>, agent: &Agent) -> Searched {
    let mut refuted = Rc::new(RefutedEdges::default());
    let mut expansions = 0;
    let mut heuristic = None;
    let stays = Rc::new(Stays::new(&scene, agent));
    for _ in 0..MOST_TRIES {
        if scene.reservations.is_none() {
            break;
        }
        let searched = look(scene, agent, &refuted, &stays, &mut heuristic);
        expansions += searched.expansions;
        let known = refuted.len();
        match &searched.found {
            Found::Stopped => {
                return Searched {
                    expansions,
                    ..searched
                };
            }
            Found::Blocked(_) => break,
            Found::Path(path) => {
                if is_valid(&scene, path, Rc::make_mut(&mut refuted)) {
                    return Searched {
                        expansions,
                        ..searched
                    };
                }
            }
        }
        if refuted.len() == known {
            break;
        }
    }
    let whole = Scene {
        reservations: None,
        ..scene
    };
    let searched = look(whole, agent, &Rc::default(), &stays, &mut None);
    Searched {
        expansions: expansions + searched.expansions,
        ..searched
    }
}

/// Whether a plain look is in vain, or takes as long as one past those who stay.
fn is_crowded(scene: &Scene<'_>, agent: &Agent) -> bool {
    let Some(reservations) = scene.reservations else {
        return false;
    };
    let class = reservations.class(agent.drone, agent.kinds[0]);
    let share = class.map_or(0.0, |class| reservations.closed_share(class));
    share > PLAIN_SHARE || !agent.is_straight(scene.roadmap)
}

/// Whether the costmap says of a path what was thought of it; if not, what is in doubt.
fn is_valid(scene: &Scene<'_>, path: &Path, refuted: &mut RefutedEdges) -> bool {
    let lattice = scene.roadmap.lattice();
    let mut verdict = Verdict::default();
    let mut sound = true;
    for leg in &path.legs {
        scene.judge(leg, &mut verdict);
        let met = |it: &Blocker| path.met.contains(&it.drone) && !scene.is_under_way(it);
        if verdict.breaks_zone.is_some() || !verdict.blockers.iter().all(met) {
            sound = false;
            let ends = (lattice.place_at(&leg.from_m), lattice.place_at(&leg.to_m));
            if let (Some(from), Some(to)) = ends {
                refuted.insert((from, to));
            }
        }
    }
    sound
}

/// One search: a plain look first where few are in the way, then past the drones that stay, with the
/// weight schedule.
fn look<'a>(
    scene: Scene<'a>,
    agent: &'a Agent,
    refuted: &Rc<RefutedEdges>,
    stays: &Rc<Stays>,
    heuristic: &mut Option<Heuristic<'a>>,
) -> Searched {
    let mut expansions = 0;
    if !is_crowded(&scene, agent) {
        let far = u64::from(agent.alone_ticks) / TICKS_A_STATE;
        let by = Heuristic::plain(scene, agent);
        let (refuted, stays) = (refuted.clone(), stays.clone());
        let mut search = Search::new(scene, agent, refuted, by, stays, PLAIN_SHIFT);
        let found = search.run(scene.most_expansions.min(PLAIN_STATES + far));
        expansions = search.expansions;
        if let Some(found) = found {
            return Searched { found, expansions };
        }
    }
    let by = heuristic
        .take()
        .unwrap_or_else(|| Heuristic::new(scene, agent));
    let (refuted, stays) = (refuted.clone(), stays.clone());
    let mut search = Search::new(scene, agent, refuted, by, stays, WEIGHT_SCHEDULE[0].0);
    let mut found = None;
    for (weight_shift, most_expansions) in WEIGHT_SCHEDULE {
        search.reweigh(weight_shift);
        found = search.run(most_expansions.min(scene.most_expansions));
        if found.is_some() {
            break;
        }
    }
    expansions += search.expansions;
    *heuristic = Some(search.nodes.into_heuristic());
    Searched {
        found: found.unwrap_or(Found::Blocked(None)),
        expansions,
    }
}
