//! A complete plan made better, for so many states and while there is time: the drone that loses
//! most is planned again at the cost of a few others.
//!
//! Large neighbourhood search (J. Li, Z. Chen, D. Harabor, P. J. Stuckey, S. Koenig, "Anytime
//! multi-agent path finding via large neighborhood search", IJCAI 2021), with neighbourhoods that
//! the search chooses: a delayed drone may take what others hold, cheaply; those are planned again
//! among all the rest, who stay as they are. What is not better in sum is taken back, so that there
//! is a safe plan at every moment.

use std::cmp::Reverse;

use costmap::leg::{DroneId, Leg};

use super::Attempt;
use crate::graph::agent::Agent;
use crate::plan::outcome::Progress;
use crate::sipp::search::{IMMOVABLE, Path, Setting, search};

/// Prices of taking what another holds (ticks), one round after another. Chosen here: a tenth of a
/// second finds those who lose hardly anything, two seconds only those who hold a drone up for
/// long.
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
    /// As they were reserved.
    legs: Vec<Leg>,
    /// `None`: it stayed at its start.
    path: Option<Path>,
}

impl Attempt<'_> {
    /// Makes a plan in which every drone has a path better until so many states are expanded in
    /// all and for as long as the caller says, or until a whole round finds nothing any more; notes
    /// by how much (ticks).
    pub(super) fn improve_by_lns(&mut self, until_expansions: u64) {
        (self.control.progress)(Progress::Improving);
        let (is_asked, before) = ((self.control.improve)(), self.sum_of_costs());
        self.gives_up_at = (!is_asked).then_some(until_expansions);
        while PRICES
            .map(|price| self.improve(price, until_expansions))
            .contains(&true)
        {}
        self.end_at_goals();
        let gained = before - self.sum_of_costs();
        self.effort.improved_ticks = (is_asked || gained > 0).then_some(gained);
    }

    /// Plans those again that leave their last task's place and come back: they wait elsewhere and
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
            let setting = Setting {
                weights: &immovable,
                ends_at_goal: true,
                careful: self.careful[drone.0 as usize],
                most_expansions: self.left(),
                ..self.setting()
            };
            let searched = search(setting, &self.agents[drone.0 as usize]);
            let arrived = before.path.as_ref().map(|path| path.arrives);
            let path = self.counted(searched);
            let path = path.filter(|path| Some(path.arrives) <= arrived);
            if !path.is_some_and(|path| self.put(drone, path)) {
                self.reserve(before.legs);
                self.paths[drone.0 as usize] = before.path;
            }
        }
    }

    /// In ticks.
    fn sum_of_costs(&self) -> u64 {
        let paths = self.paths.iter().flatten();
        paths.map(|path| u64::from(path.arrives.0)).sum()
    }

    /// Plans every delayed drone again at a price (ticks), the most delayed first, until then;
    /// whether that made the sum of costs less.
    fn improve(&mut self, price: u32, until_expansions: u64) -> bool {
        let delay = |agent: &Agent| {
            let path = self.paths[agent.drone.0 as usize].as_ref()?;
            let delay = path.arrives.0.saturating_sub(agent.alone_ticks);
            (delay > 0).then_some((Reverse(delay), agent.drone))
        };
        let mut delayed: Vec<_> = self.agents.iter().filter_map(delay).collect();
        delayed.sort_unstable();
        let mut found = false;
        for (_, drone) in delayed {
            let goes_on = self.effort.expansions < until_expansions || (self.control.improve)();
            if !goes_on || (self.control.stop)() {
                return false;
            }
            found |= self.gain(drone, price);
        }
        found
    }

    /// Plans one again, and those in its way. Whether that was worth it.
    fn gain(&mut self, drone: DroneId, price: u32) -> bool {
        let mut before = vec![self.take_out(drone)];
        let asked = |weight: &u32| match *weight {
            IMMOVABLE => IMMOVABLE,
            _ => price,
        };
        let weights: Vec<u32> = self.weights.iter().map(asked).collect();
        let gained = match self.searched(drone, &weights) {
            Some(path) if path.met.len() <= MOST_OTHERS => {
                before.extend(path.met.iter().map(|other| self.take_out(*other)));
                self.put(drone, path) && self.replan(&before[1..], &before)
            }
            _ => false,
        };
        if !gained {
            for known in &before {
                self.take_out(known.drone);
            }
            for known in before {
                self.reserve(known.legs);
                self.paths[known.drone.0 as usize] = known.path;
            }
        }
        gained
    }

    /// Whether all of these find a path again, and all that was changed is less in sum.
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
        let setting = Setting {
            weights,
            careful: self.careful[drone.0 as usize],
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
        let legs = self.legs[drone.0 as usize].clone();
        if !legs.is_empty() {
            self.release(drone);
        }
        Before {
            drone,
            legs,
            path: self.paths[drone.0 as usize].take(),
        }
    }

    /// Takes a path over, unless others far off cannot bear it.
    fn put(&mut self, drone: DroneId, path: Path) -> bool {
        let flown = self.agents[drone.0 as usize].flown(&path.legs);
        if !self.costmap.is_borne(&flown) {
            return false;
        }
        self.reserve(path.legs.clone());
        self.paths[drone.0 as usize] = Some(path);
        true
    }
}
