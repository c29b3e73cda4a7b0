//! Space-time A* for one drone among those already planned.
//!
//! A state is a place, a task and a moment. From there the drone steps to a neighbouring place,
//! dwells, or ends. The reservation table, if any, says which drones conflict with a step, and the
//! costmap judges the path found; without a table it judges every step. A conflicting drone does
//! not forbid a step: the path may meet it, once, at a price, and evicts it afterwards (ejection
//! chains: F. Glover, "Ejection chains, reference structures and alternating path methods for
//! traveling salesman problems", Discrete Applied Mathematics 65, 1996; here as penalties in the
//! search, as in PBS and LNS2 for multi-agent path finding). An immovable one forbids it. Or the
//! step is taken later.
//!
//! A state stands for all the time for which hovering at its place is free from then on, as in
//! safe-interval path planning (M. Phillips and M. Likhachev, "SIPP", ICRA 2011): later arrivals
//! within it are dropped, and the neighbouring places are reached in each of their own intervals.
//! Where wakes fill their columns a whole column is one such place.

use std::cell::RefCell;
use std::rc::Rc;

use costmap::leg::{Leg, Tick};
use costmap::verdict::{Blocker, Verdict};

use crate::graph::agent::{Agent, TOLERANCE_TICKS};
use crate::sipp::goal_occupancy::GoalOccupancyCosts;

mod answer;
mod eviction_lists;
mod heuristic;
mod label;
mod memo;
mod node;
pub(crate) mod setting;
mod walk;

pub(crate) use answer::{Obstruction, Obstructor, Path, SearchOutcome, Searched, joined};
use heuristic::Heuristic;
use memo::Memo;
use setting::Refuted;
pub(crate) use setting::{IMMOVABLE, SearchSetting};
use walk::PathSearch;

/// What is left to fly counts one part in 2ⁿ more than it takes, so that of paths that differ by
/// less the one found first will do. The part bounds the excess of an answer over the best. Chosen
/// here.
const PLAIN_SHIFT: u32 = 5;
/// A plain look, where few drones obstruct and no solid is in between, takes so many states: chosen
/// here.
const PLAIN_STATES: u64 = 64;
/// Past drones that stay the heuristic weighs more the longer the search takes: the part, and up to
/// how many states. Chosen here: the first nearly always answers, and the others keep a crowd from
/// costing seconds a drone.
const WEIGHT_SCHEDULE: [(u32, u64); 4] = [(5, 500), (3, 1_500), (2, 5_000), (0, u64::MAX)];
/// The same where drones may be early or late: more departures are closed, and more states are met
/// before one that leads on. Chosen here, on halls of 500 and 1000 drones.
const WEIGHT_SCHEDULE_WITHIN_MARGINS: [(u32, u64); 4] =
    [(5, 200), (3, 500), (2, 1_200), (0, u64::MAX)];
/// Where more of all places than this are closed for good there is no plain look: chosen here.
const PLAIN_SHARE: f64 = 0.12;
/// A plain look may take a state more for each of these ticks of the path: chosen here, two a step
/// of 1 m at 2 m/s.
const TICKS_A_STATE: u64 = 25;

/// A search in which only what a drone does at first is judged in full takes as many times as many
/// states as one in which all of it is: chosen here, few of them are without tables.
const STATES_AT_FIRST: u64 = 8;

/// In a fleet under way that is larger than this no search judges every step in full where the
/// tables leave no path: chosen here. In halls of 500 drones one of 260 such searches found a path,
/// and they took a tenth of the time.
const MOST_JUDGED_IN_FULL: usize = 100;

/// Paths tried by the reservation table's intervals before every step is judged; chosen here.
const MOST_TRIES: usize = 16;

/// Finds the cheapest path for one agent.
///
/// With a reservation table the path is searched for by the table and judged in the end; refuted
/// edges are judged at once in the next try. A drone on the ground that is due somewhere waits
/// there for as long as that neither makes it late nor evicts a drone; half of the states may go
/// into that.
pub(crate) fn search(setting: SearchSetting<'_>, agent: &Agent) -> Searched {
    let within = |agent: &Agent, most_expansions| {
        let setting = SearchSetting {
            most_expansions,
            ..setting
        };
        find(setting, agent)
    };
    let most = setting.most_expansions;
    let late = agent.takes_off_late(setting.roadmap);
    let late = late.map(|late| within(&late, most / 2));
    let evicts_none = |it: &Searched| match &it.found {
        SearchOutcome::Path(path) => path.evicted.is_empty(),
        _ => false,
    };
    let searched = match late {
        Some(late) if evicts_none(&late) => late,
        late => {
            let spent = late.map_or(0, |late| late.expansions);
            let mut searched = within(agent, most.saturating_sub(spent));
            searched.expansions += spent;
            searched
        }
    };
    agent.forget();
    searched
}

/// Tries paths by the reservation table until one holds (lazy validation); where all reachable
/// states lead nowhere, once more with paths that come back; for a drone under way then once more,
/// with its first steps judged in full. Blockers that refute a path obstruct the next; those left
/// in the end are evicted, or every step is judged in full.
fn find(setting: SearchSetting<'_>, agent: &Agent) -> Searched {
    let mut refuted = Rc::new(Refuted::default());
    let mut expansions = 0;
    let mut heuristic = None;
    let mut free = Vec::new();
    let memo = Rc::new(RefCell::new(Memo::default()));
    let goal_costs = Rc::new(GoalOccupancyCosts::new(&setting, agent));
    let tries = setting.reservations.map_or(0, |_| MOST_TRIES);
    // A drone under way may at first be too near to others for any table.
    let at_first = (!setting.under_way.is_empty()).then(|| {
        let most = STATES_AT_FIRST.saturating_mul(setting.most_untabulated);
        (agent.departs.after(TOLERANCE_TICKS), most)
    });
    let by_tables = [false, true].map(|allows_revisits| (Tick(0), u64::MAX, allows_revisits));
    let at_first = at_first.map(|(until, most)| (until, most, false));
    // Whether all reachable states were expanded in vain.
    let mut is_exhausted = false;
    let mut obstruction = None;
    for (judged_until, most, allows_revisits) in by_tables.into_iter().chain(at_first) {
        if allows_revisits && (setting.allows_revisits || !is_exhausted) {
            continue;
        }
        let most = most.min(setting.most_expansions.saturating_sub(expansions));
        let until = expansions + most;
        for left in (0..tries).rev() {
            // All tries together take no more states than one search may.
            let rest = SearchSetting {
                most_expansions: until.saturating_sub(expansions),
                judged_until,
                allows_revisits: allows_revisits || setting.allows_revisits,
                ..setting
            };
            let mut searched = look(rest, agent, &refuted, (&goal_costs, &memo), &mut heuristic);
            expansions += searched.expansions;
            searched.expansions = expansions;
            let SearchOutcome::Path(path) = &mut searched.found else {
                match searched.found {
                    SearchOutcome::Blocked(by) => obstruction = by,
                    _ => return searched,
                }
                is_exhausted = expansions < until;
                break;
            };
            let against = refute_path(&setting, agent, path, &mut free, Rc::make_mut(&mut refuted));
            let may_evict =
                |path: &mut Path| (left == 0 || !against.are_new) && against.evict_all(path);
            if against.all.is_allowed() || may_evict(path) {
                return searched;
            }
            if !against.are_new {
                break;
            }
        }
    }
    if setting.reservations.is_some() && setting.under_way.len() > MOST_JUDGED_IN_FULL {
        return Searched {
            found: SearchOutcome::Blocked(obstruction),
            expansions,
        };
    }
    let left = setting.most_expansions.saturating_sub(expansions);
    let whole = SearchSetting {
        reservations: None,
        most_expansions: match setting.reservations {
            Some(_) => left.min(setting.most_untabulated),
            None => left,
        },
        ..setting
    };
    let memo = Rc::default();
    let mut searched = look(
        whole,
        agent,
        &Rc::default(),
        (&goal_costs, &memo),
        &mut None,
    );
    searched.expansions += expansions;
    if let SearchOutcome::Path(path) = &mut searched.found
        && agent.smoothing.is_some()
    {
        // Changes of velocity that follow one another closely were judged one by one.
        let refuted = &mut Refuted::default();
        let against = refute_path(&whole, agent, path, &mut Vec::new(), refuted);
        if !against.evict_all(path) {
            searched.found = SearchOutcome::Blocked(None);
        }
    }
    searched
}

/// What the costmap has against a path that the search did not know of.
#[derive(Default)]
struct PathRefutation {
    /// All of it.
    all: Verdict,
    /// Any of it is new: it is refuted then.
    are_new: bool,
    /// A blocker cannot be evicted.
    any_firm: bool,
}

impl PathRefutation {
    /// Whether all blockers of the path can be evicted; then the path evicts them.
    fn evict_all(&self, path: &mut Path) -> bool {
        if self.all.breaks_zone.is_some() || self.any_firm {
            return false;
        }
        path.evicted
            .extend(self.all.blockers.iter().map(|it| it.drone));
        path.evicted.sort_unstable();
        path.evicted.dedup();
        true
    }
}

/// Whether a plain look fails, or takes as long as one past parked drones.
fn is_crowded(setting: &SearchSetting<'_>, agent: &Agent) -> bool {
    let Some(reservations) = setting.reservations else {
        return false;
    };
    let class = reservations.class(agent.drone, agent.kinds[0]);
    let share = class.map_or(0.0, |class| reservations.closed_share(class));
    share > PLAIN_SHARE || !agent.is_straight(setting.roadmap)
}

/// What the costmap has against a path. Legs that are `free` need not be judged, and those that are
/// join them.
fn refute_path(
    setting: &SearchSetting<'_>,
    agent: &Agent,
    path: &Path,
    free: &mut Vec<Leg>,
    refuted: &mut Refuted,
) -> PathRefutation {
    let lattice = setting.roadmap.lattice();
    let mut found = PathRefutation::default();
    // What has begun is flown in any case, but for how it goes on.
    let begun = (!agent.begun.is_empty()).then(|| agent.departs.before(agent.lead_ticks()));
    let flown = agent.flown(&path.legs);
    let ahead = flown
        .iter()
        .filter(|leg| agent.smoothing.is_none() || begun.is_none_or(|begun| leg.end > begun));
    let is_evicted = |it: &Blocker, departs| {
        let free = agent.free_departure(departs);
        path.evicted.contains(&it.drone) && !setting.is_under_way(it, free)
    };
    for leg in ahead {
        if free.contains(leg) {
            continue;
        }
        // A drone is evicted by this path, not by the next.
        let mut meets_any = false;
        let mut is_known = |it: &Blocker| {
            let is_known = is_evicted(it, leg.start) || agent.tolerates(it, leg.start);
            meets_any |= is_known;
            is_known
        };
        let mut against = Verdict::default();
        setting.add_unknown(leg, &mut is_known, &mut against);
        if against.is_allowed() {
            if !meets_any {
                free.push(*leg);
            }
            continue;
        }
        let meant = (path.legs.iter()).filter(|it| it.start < leg.end && leg.start < it.end);
        for leg in meant {
            let ends = (lattice.place_at(&leg.from_m), lattice.place_at(&leg.to_m));
            if let (Some(from), Some(to)) = ends {
                found.are_new |= refuted.add((from, to), leg, &against);
            }
        }
        let free = agent.free_departure(leg.start);
        let is_firm = |it: &Blocker| setting.weight(it, free) == IMMOVABLE;
        found.any_firm |= against.blockers.iter().any(is_firm);
        found.all.breaks_zone = found.all.breaks_zone.or(against.breaks_zone);
        found.all.blockers.append(&mut against.blockers);
    }
    found
}

/// One search: a plain look first where few drones obstruct, then past parked drones, with the
/// weight schedule.
fn look<'a>(
    setting: SearchSetting<'a>,
    agent: &'a Agent,
    refuted: &Rc<Refuted>,
    (goal_costs, memo): (&Rc<GoalOccupancyCosts>, &Rc<RefCell<Memo>>),
    heuristic: &mut Option<Heuristic<'a>>,
) -> Searched {
    let mut expansions = 0;
    let begun = |by, weight_shift| {
        let (refuted, known) = (refuted.clone(), (goal_costs.clone(), memo.clone()));
        PathSearch::new(setting, agent, refuted, by, known, weight_shift)
    };
    if refuted.is_empty() && !is_crowded(&setting, agent) {
        let far = u64::from(agent.lower_bound_ticks) / TICKS_A_STATE;
        let mut search = begun(Heuristic::plain(setting, agent), PLAIN_SHIFT);
        let found = search.run(setting.most_expansions.min(PLAIN_STATES + far));
        expansions = search.expansions;
        if let Some(found) = found {
            return Searched { found, expansions };
        }
    }
    let by = (heuristic.take()).unwrap_or_else(|| Heuristic::new(setting, agent));
    let mut search = begun(by, WEIGHT_SCHEDULE[0].0);
    let mut found = None;
    let schedule = match setting.costmap.fleet().conditions().shift {
        0 => WEIGHT_SCHEDULE,
        _ => WEIGHT_SCHEDULE_WITHIN_MARGINS,
    };
    let left = setting.most_expansions.saturating_sub(expansions);
    for (weight_shift, most_expansions) in schedule {
        search.reweigh(weight_shift);
        found = search.run(most_expansions.min(left));
        if found.is_some() {
            break;
        }
    }
    expansions += search.expansions;
    let nearest = search.obstruction;
    *heuristic = Some(search.nodes.into_heuristic());
    Searched {
        found: found.unwrap_or(SearchOutcome::Blocked(nearest)),
        expansions,
    }
}
