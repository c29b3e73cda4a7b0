//! A complete plan made better, for so many states and while there is time: the most delayed drone
//! is planned again at the cost of a few others.
//!
//! Large neighbourhood search (J. Li, Z. Chen, D. Harabor, P. J. Stuckey, S. Koenig, "Anytime
//! multi-agent path finding via large neighborhood search", IJCAI 2021), with neighbourhoods that
//! the search chooses: a delayed drone may evict others, cheaply; those are planned again among all
//! the rest, which keep their paths. What does not lower the sum of costs is undone, so that there
//! is a safe plan at every moment.

use std::cmp::Reverse;

use costmap::costmap::Reservation;
use costmap::leg::{DroneId, Leg};
use rustc_hash::FxHashMap;

use super::Attempt;
use crate::graph::agent::Agent;
use crate::plan::outcome::Progress;
use crate::sipp::search::{IMMOVABLE, Path, SearchSetting, search};

/// Prices of evicting a drone (ticks), one round after another. Chosen here: a tenth of a second
/// finds drones that lose hardly anything, two seconds only drones that delay another for long.
const PRICES: [u32; 3] = [10, 50, 200];
/// Drones planned again for one: chosen here, more of them hardly ever all find a path.
const MOST_OTHERS: usize = 6;

/// States of all searches for those that leave their goals: chosen here, a tenth of a second of
/// work.
const MOST_ENDING_EXPANSIONS: u64 = 50_000;
/// States of one search: chosen here, a fraction of what a first search may take.
const MOST_EXPANSIONS: u64 = 20_000;

/// What one drone had before.
struct Before {
    /// Which drone.
    drone: DroneId,
    /// Before they are smoothed.
    legs: Vec<Leg>,
    /// As they were reserved.
    reservation: Option<Reservation>,
    /// `None`: it stayed at its start.
    path: Option<Path>,
}

/// Which drones were tried at which price, in vain, since the plan last became better: they need
/// not be tried again.
#[derive(Default)]
struct InVain {
    gains: u64,
    tried: FxHashMap<(DroneId, u32), u64>,
}

impl Attempt<'_> {
    /// Makes a plan in which every drone has a path better until so many states are expanded in
    /// all and for as long as the caller says, or until a whole round finds nothing any more; notes
    /// by how much (ticks).
    pub(super) fn improve_by_lns(&mut self, until_expansions: u64) {
        (self.control.progress)(Progress::Improving);
        let (is_asked, before) = ((self.control.improve)(), self.sum_of_costs());
        self.gives_up_at = (!is_asked).then_some(until_expansions);
        // Among the threads that share the work: little of it can be handed on from outside.
        rayon::scope(|_| {
            let mut in_vain = InVain::default();
            while PRICES
                .map(|price| self.improve(price, until_expansions, &mut in_vain))
                .contains(&true)
            {}
            self.end_at_goals();
        });
        let gained = before - self.sum_of_costs();
        self.effort.improved_ticks = (is_asked || gained > 0).then_some(gained);
    }

    /// Plans drones again that leave their last task's place and come back: they wait elsewhere and
    /// come once, where that takes no longer.
    fn end_at_goals(&mut self) {
        let roadmap = self.setting().roadmap;
        let leaves = |agent: &Agent| {
            let goal_m = roadmap.position_m(agent.last_vertex());
            let path = self.paths[agent.drone.0 as usize].as_ref()?;
            let away = |leg: &Leg| leg.from_m == goal_m && leg.to_m != goal_m;
            let last = path.legs.iter().rposition(away)?;
            let returns = path.legs[last + 1..].iter().any(|leg| leg.to_m == goal_m);
            returns.then_some(agent.drone)
        };
        let leaving: Vec<DroneId> = self.agents.iter().filter_map(leaves).collect();
        let immovable = vec![IMMOVABLE; self.weights.len()];
        let until = self.effort.expansions + MOST_ENDING_EXPANSIONS;
        self.gives_up_at = Some(until);
        for drone in leaving {
            if self.left() == 0 || (self.control.stop)() {
                return;
            }
            let before = self.take_out(drone);
            let setting = SearchSetting {
                weights: &immovable,
                ends_at_goal: true,
                judges_far_wakes: self.judges_far_wakes[drone.0 as usize],
                most_expansions: self.left(),
                ..self.setting()
            };
            let searched = search(setting, &self.agents[drone.0 as usize]);
            let arrived = before.path.as_ref().map(|path| path.arrives);
            let path = self.counted(searched);
            let path = path.filter(|path| Some(path.arrives) <= arrived);
            if !path.is_some_and(|path| self.put(drone, path)) {
                self.put_back(before);
            }
        }
    }

    /// In ticks.
    fn sum_of_costs(&self) -> u64 {
        let paths = self.paths.iter().flatten();
        paths.map(|path| u64::from(path.arrives.0)).sum()
    }

    /// Plans every delayed drone again at a price (ticks), the most delayed first, until then;
    /// whether that lowered the sum of costs.
    fn improve(&mut self, price: u32, until_expansions: u64, in_vain: &mut InVain) -> bool {
        let delay = |agent: &Agent| {
            let path = self.paths[agent.drone.0 as usize].as_ref()?;
            let delay = path.arrives.0.saturating_sub(agent.lower_bound_ticks);
            (delay > 0).then_some((Reverse(delay), agent.drone))
        };
        let mut delayed: Vec<_> = self.agents.iter().filter_map(delay).collect();
        delayed.sort_unstable();
        let gains = in_vain.gains;
        let mut found = false;
        for (_, drone) in delayed {
            let goes_on = self.effort.expansions < until_expansions || (self.control.improve)();
            if !goes_on || (self.control.stop)() {
                return false;
            }
            if in_vain.tried.get(&(drone, price)) == Some(&in_vain.gains) {
                continue;
            }
            match self.gain(drone, price) {
                true => in_vain.gains += 1,
                false => _ = in_vain.tried.insert((drone, price), in_vain.gains),
            }
            found |= in_vain.gains > gains;
        }
        found
    }

    /// Plans a drone and those it evicts again. Whether that was worth it.
    fn gain(&mut self, drone: DroneId, price: u32) -> bool {
        let mut before = vec![self.take_out(drone)];
        let asked = |weight: &u32| match *weight {
            IMMOVABLE => IMMOVABLE,
            _ => price,
        };
        let weights: Vec<u32> = self.weights.iter().map(asked).collect();
        let gained = match self.searched(drone, &weights) {
            Some(path) if path.evicted.len() <= MOST_OTHERS && self.may_gain(&before[0], &path) => {
                before.extend(path.evicted.iter().map(|other| self.take_out(*other)));
                self.put(drone, path) && self.replan(&before[1..], &before)
            }
            _ => false,
        };
        if !gained {
            for known in &before {
                self.take_out(known.drone);
            }
            for known in before {
                self.put_back(known);
            }
        }
        gained
    }

    /// Whether a path in place of its drone's former one lowers the sum of costs, if all drones it
    /// meets arrive at their lower bounds.
    fn may_gain(&self, before: &Before, path: &Path) -> bool {
        let delay = |drone: DroneId, path: &Path| {
            let lower_bound_ticks = self.agents[drone.0 as usize].lower_bound_ticks;
            u64::from(path.arrives.0.saturating_sub(lower_bound_ticks))
        };
        let of_evicted = |drone: &DroneId| {
            let known = self.paths[drone.0 as usize].as_ref();
            known.map_or(0, |known| delay(*drone, known))
        };
        let own = before.path.as_ref().map_or(0, |it| delay(before.drone, it));
        let others: u64 = path.evicted.iter().map(of_evicted).sum();
        delay(before.drone, path) < own + others
    }

    /// Whether all of these find a path again, and the sum over all changed is less.
    fn replan(&mut self, others: &[Before], all: &[Before]) -> bool {
        let immovable = vec![IMMOVABLE; self.weights.len()];
        let arrives =
            |path: &Option<Path>| path.as_ref().map_or(0, |path| u64::from(path.arrives.0));
        let sum: u64 = all.iter().map(|known| arrives(&known.path)).sum();
        for known in others {
            let Some(path) = self.searched(known.drone, &immovable) else {
                return false;
            };
            if !self.put(known.drone, path) {
                return false;
            }
        }
        let now: u64 = (all.iter())
            .map(|known| arrives(&self.paths[known.drone.0 as usize]))
            .sum();
        now < sum
    }

    /// A path at these prices; `None` if there is none within the states that are left.
    fn searched(&mut self, drone: DroneId, weights: &[u32]) -> Option<Path> {
        let setting = SearchSetting {
            weights,
            judges_far_wakes: self.judges_far_wakes[drone.0 as usize],
            most_expansions: self.left(),
            ..self.setting()
        };
        let searched = search(setting, &self.agents[drone.0 as usize]);
        self.counted(searched)
    }

    /// States of the next search.
    fn left(&self) -> u64 {
        let left = |until: u64| until.saturating_sub(self.effort.expansions);
        let left = self.gives_up_at.map_or(MOST_EXPANSIONS, left);
        left.min(MOST_EXPANSIONS)
    }

    /// Takes a drone out of the plan, and remembers what it had.
    fn take_out(&mut self, drone: DroneId) -> Before {
        let (legs, reservation) = self.release(drone);
        Before {
            drone,
            legs,
            reservation,
            path: self.paths[drone.0 as usize].take(),
        }
    }

    /// Puts a drone back as it was.
    fn put_back(&mut self, before: Before) {
        if let Some(reservation) = before.reservation {
            self.take_over(before.legs, reservation);
        }
        self.paths[before.drone.0 as usize] = before.path;
    }

    /// Takes a path over, unless others far off cannot bear it.
    fn put(&mut self, drone: DroneId, path: Path) -> bool {
        let flown = self.agents[drone.0 as usize].flown(&path.legs);
        if !self.costmap.are_loads_within_budget(&flown) {
            return false;
        }
        self.reserve(path.legs.clone());
        self.paths[drone.0 as usize] = Some(path);
        true
    }
}
