//! Goal-occupancy cost: least cost of a stay, by arrival; others may still pass.
//!
//! A drone that has to dwell where another hovers for ten seconds more can wait, or evict it. Known
//! before the search, the cheaper of the two keeps it from expanding every early arrival.

use costmap::leg::{DroneId, KindId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict, Why};

use crate::graph::agent::{Agent, Ending};
use crate::graph::roadmap::Vertex;
use crate::sipp::search::setting::{IMMOVABLE, SearchSetting};

/// What it costs to dwell at each task, and to end.
#[derive(Debug)]
pub(crate) struct GoalOccupancyCosts {
    /// In order; those that cost nothing are left out.
    priced: Vec<Stay>,
    /// An immovable drone that never leaves, and from when on it is there.
    pub(crate) never: Option<(DroneId, Why, Tick)>,
}

/// A stay that costs something.
#[derive(Debug)]
struct Stay {
    /// After which it begins.
    waypoint: u16,
    /// From its beginning to the end of the last dwell, with no other drone there.
    rest_ticks: u32,
    /// By its beginning.
    price: GoalOccupancyCost,
}

/// Least time plus price of a stay, as a function of the arrival.
#[derive(Clone, Debug, Default)]
struct GoalOccupancyCost {
    /// From when on, and the price of all drones met by a stay from then.
    steps: Vec<(u32, u32)>,
    /// Least total of any later step.
    later: Vec<u32>,
    /// Drones met at any time, and their prices.
    drones: Vec<(DroneId, u32)>,
    /// See [`GoalOccupancyCosts::never`].
    never: Option<(DroneId, Why, Tick)>,
}

/// How long a stay lasts.
#[derive(Clone, Copy, Debug)]
struct Lasts {
    /// From its beginning, at least; [`Tick::FOREVER`]'s: until the end.
    ticks: u32,
    /// And no shorter than until this tick.
    until: u32,
}

impl Lasts {
    /// When one ends that begins at this tick.
    fn until(self, begin: u32) -> u32 {
        begin.saturating_add(self.ticks).max(self.until)
    }
}

impl GoalOccupancyCost {
    /// The price of `stay`, whenever it begins, for as long as it lasts.
    fn new(setting: &SearchSetting<'_>, stay: Leg, lasts: Lasts) -> GoalOccupancyCost {
        let mut verdict = Verdict::default();
        setting.judge(&stay, &mut verdict);
        let blockers = &mut verdict.blockers;
        blockers.sort_unstable_by_key(|b| (b.drone, b.began, b.clear));
        blockers.dedup_by_key(|b| (b.drone, b.began, b.clear));
        // A dwell may end before others come.
        let first = lasts.until(stay.start.0);
        let stays = |b: &&Blocker| {
            let is_immovable = setting.weights[b.drone.0 as usize] == IMMOVABLE;
            is_immovable && b.clear == Tick::FOREVER && b.began.0 < first
        };
        let never = blockers.iter().find(stays);
        let never = never.map(|b| (b.drone, b.why, b.began));
        let steps = steps(setting.weights, blockers, lasts);
        let mut later = vec![u32::MAX; steps.len()];
        for index in (1..steps.len()).rev() {
            let (from, price) = steps[index];
            later[index - 1] = later[index].min(from.saturating_add(price));
        }
        blockers.dedup_by_key(|b| b.drone);
        let weighed = |b: &Blocker| (b.drone, setting.weights[b.drone.0 as usize]);
        GoalOccupancyCost {
            steps,
            later,
            drones: blockers.iter().map(weighed).collect(),
            never,
        }
    }

    /// Whenever it begins, it costs nothing.
    fn is_free(&self) -> bool {
        self.steps.is_empty()
    }

    /// The last step that begins no later than this tick; `None` where nothing is priced.
    fn step(&self, arrives: u32) -> Option<usize> {
        let begun = self.steps.partition_point(|(from, _)| *from <= arrives);
        begun.checked_sub(1)
    }

    /// Least of later arrival and price, beyond arriving at this tick and what is paid.
    fn excess(&self, arrives: u32, is_paid: impl Fn(DroneId) -> bool) -> u32 {
        let least = self.step(arrives).map_or(0, |step| {
            let later = self.later[step].saturating_sub(arrives);
            self.steps[step].1.min(later)
        });
        if least == 0 {
            return 0;
        }
        let paid = self.drones.iter().filter(|(drone, _)| is_paid(*drone));
        paid.fold(least, |left, (_, price)| left.saturating_sub(*price))
    }

    /// How much later it is best to arrive.
    fn slack(&self, arrives: u32) -> u32 {
        let Some(step) = self.step(arrives) else {
            return 0;
        };
        if arrives.saturating_add(self.steps[step].1) <= self.later[step] {
            return 0;
        }
        let total = |index: &usize| self.steps[*index].0.saturating_add(self.steps[*index].1);
        (step + 1..self.steps.len())
            .min_by_key(total)
            .map_or(0, |index| self.steps[index].0 - arrives)
    }
}

impl GoalOccupancyCosts {
    /// Those of an agent among every drone planned.
    pub(crate) fn new(setting: &SearchSetting<'_>, agent: &Agent) -> GoalOccupancyCosts {
        let stay = |at: Vertex, kind: KindId, flying: bool| Leg {
            flying,
            start: agent.departs,
            ..agent.hover(setting.roadmap.position_m(at), kind)
        };
        let dwells = agent.waypoints.iter().zip(&agent.kinds[1..]);
        let dwells = dwells.map(|(waypoint, &kind)| {
            let lasts = Lasts {
                ticks: waypoint.dwell_ticks,
                until: waypoint.until.0,
            };
            let hovers = stay(waypoint.distances.goal(), kind, true);
            let price = match (lasts.ticks, lasts.until) {
                (0, 0) => GoalOccupancyCost::default(),
                _ => GoalOccupancyCost::new(setting, hovers, lasts),
            };
            (waypoint.rest_ticks, price)
        });
        let flies = !agent.waypoints.is_empty() || !agent.grounded;
        let end = match (agent.ending, agent.kinds.last()) {
            (Ending::Hover, Some(&kind)) => {
                let ticks = u32::MAX;
                let lasts = Lasts { ticks, until: 0 };
                GoalOccupancyCost::new(setting, stay(agent.last_vertex(), kind, flies), lasts)
            }
            _ => GoalOccupancyCost::default(),
        };
        let mut never = None;
        let all = dwells.chain(std::iter::once((0, end)));
        let priced = (0..)
            .zip(all)
            .filter_map(|(waypoint, (rest_ticks, price))| {
                never = never.or(price.never);
                (!price.is_free()).then_some(Stay {
                    waypoint,
                    rest_ticks,
                    price,
                })
            });
        GoalOccupancyCosts {
            priced: priced.collect(),
            never,
        }
    }

    /// Least of later arrivals and prices that is still to come after a waypoint, beyond `ends`:
    /// the end of the last dwell at the earliest. Drones evicted already are paid for.
    pub(crate) fn excess(
        &self,
        waypoint: u16,
        ends: u32,
        is_paid: impl Fn(DroneId) -> bool + Copy,
    ) -> u32 {
        let ahead = self.ahead(waypoint, ends);
        let excess = ahead.map(|(stay, at)| stay.excess(at, is_paid));
        excess.max().unwrap_or(0)
    }

    /// How much later it is best to arrive.
    pub(crate) fn slack(&self, waypoint: u16, ends: u32) -> u32 {
        let ahead = self.ahead(waypoint, ends);
        let dearest = ahead.max_by_key(|(stay, at)| stay.excess(*at, |_| false));
        dearest.map_or(0, |(stay, at)| stay.slack(at))
    }

    /// Prices of the stays that are still to come, each with the least tick at which it can begin.
    fn ahead(&self, waypoint: u16, ends: u32) -> impl Iterator<Item = (&GoalOccupancyCost, u32)> {
        let priced = self.priced.iter();
        let ahead = priced.filter(move |stay| stay.waypoint >= waypoint);
        ahead.map(move |stay| (&stay.price, ends.saturating_sub(stay.rest_ticks)))
    }
}

/// Beginnings of a stay between which the same drones are met, and what they cost together.
fn steps(weights: &[u32], blockers: &[Blocker], lasts: Lasts) -> Vec<(u32, u32)> {
    if blockers.is_empty() {
        return Vec::new();
    }
    let mut begins: Vec<u32> = vec![0];
    for blocker in blockers {
        begins.push((blocker.began.0 + 1).saturating_sub(lasts.ticks));
        if blocker.clear != Tick::FOREVER {
            begins.push(blocker.clear.0);
        }
    }
    begins.sort_unstable();
    begins.dedup();
    let priced = begins.into_iter().map(|begin| {
        let mut price = 0_u32;
        let mut last = None;
        for blocker in blockers {
            let meets = blocker.began.0 < lasts.until(begin) && begin < blocker.clear.0;
            // Blockers are sorted by drone: each is paid for once.
            if meets && last != Some(blocker.drone) {
                price = price.saturating_add(weights[blocker.drone.0 as usize]);
                last = Some(blocker.drone);
            }
        }
        (begin, price)
    });
    priced.collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::graph::passage::Passages;
    use crate::scenario::read_world;
    use crate::solver::prepare::prepare;

    fn blocker(drone: u32, began: u32, clear: u32) -> Blocker {
        Blocker {
            drone: DroneId(drone),
            why: Why::Bodies,
            began: Tick(began),
            clear: Tick(clear),
            flown: [Tick(began), Tick(clear)],
        }
    }

    #[test]
    fn a_stay_pays_once_for_each_drone_it_meets() {
        let blockers = [
            blocker(0, 100, 200),
            blocker(0, 200, 300),
            blocker(1, 500, 600),
        ];
        let weights = [50, 70];
        assert_eq!(
            steps(
                &weights,
                &blockers,
                Lasts {
                    ticks: 100,
                    until: 0
                }
            ),
            [
                (0, 0),
                (1, 50),
                (101, 50),
                (200, 50),
                (300, 0),
                (401, 70),
                (600, 0)
            ]
        );
        assert_eq!(
            steps(
                &weights,
                &blockers,
                Lasts {
                    ticks: u32::MAX,
                    until: 0
                }
            ),
            [(0, 120), (200, 120), (300, 70), (600, 0)]
        );
    }

    #[test]
    fn a_stay_until_a_moment_meets_all_drones_that_come_before_it() {
        let blockers = [blocker(0, 100, 200), blocker(1, 500, 600)];
        let lasts = Lasts {
            ticks: 50,
            until: 300,
        };
        assert_eq!(
            steps(&[50, 70], &blockers, lasts),
            [(0, 50), (51, 50), (200, 0), (451, 70), (600, 0)]
        );
    }

    /// What stays for these tasks, and for the end, in a place with such zones, where an immovable
    /// drone comes to hover at a place (m) from a moment on.
    fn beside_one_that_comes(
        (zones, at_m): (&str, Point3<f64>),
        began: u32,
        tasks: &str,
    ) -> GoalOccupancyCosts {
        let text = format!(
            r#"Scenario(name: "hall", bounds_m: (min: (0, 0, 0), max: (9, 9, 3)),
                zones: [{zones}], drones: [
                (name: "a", airframe: "kolibri", start_m: (0.5, 0.5, 1.5), tasks: [{tasks}]),
                (name: "b", airframe: "kolibri", start_m: (8.5, 8.5, 1.5), tasks: [])])"#
        );
        let world = read_world(&text).expect("in order");
        let job = prepare(&world, &Passages::of(&world), &|| false);
        let mut costmap = job.costmap(&world, 2);
        costmap.insert(vec![Leg {
            start: Tick(began),
            ..job.agents[1].hover(at_m, job.agents[1].kinds[0])
        }]);
        let setting = SearchSetting::judged(&job.roadmap, &costmap, &[500, IMMOVABLE], &|| false);
        GoalOccupancyCosts::new(&setting, &job.agents[0])
    }

    #[test]
    fn a_task_may_be_over_before_one_comes_that_stays_and_the_end_may_not() {
        // The second in a zone that holds the air of one of them alone.
        let zone = r#"(name: "desk", min_m: (3, 3, 0), max_m: (6, 6, 0.5), air_limit_mps: 7)"#;
        for (zones, at_m, by) in [
            ("", Point3::new(5.5, 5.5, 1.5), Why::Bodies),
            (zone, Point3::new(3.5, 3.5, 1.5), Why::Zone),
        ] {
            let there = "(to_m: (5.5, 5.5, 1.5), dwell_s: 1)";
            let on = format!("{there}, (to_m: (0.5, 8.5, 1.5))");
            let never = |began: u32, tasks: &str| {
                let costs = beside_one_that_comes((zones, at_m), began, tasks);
                costs.never.map(|(drone, why, _)| (drone, why))
            };
            let blocked = Some((DroneId(1), by));
            assert_eq!(never(3_000, &on), None);
            assert_eq!(never(50, &on), blocked);
            assert_eq!(never(3_000, there), blocked);
        }
    }

    #[test]
    fn to_wait_is_chosen_where_it_is_cheaper() {
        let stay = GoalOccupancyCost {
            steps: vec![(0, 500), (300, 0)],
            later: vec![300, u32::MAX],
            drones: vec![(DroneId(0), 500)],
            never: None,
        };
        assert_eq!((stay.excess(100, |_| false), stay.slack(100)), (200, 200));
        assert_eq!((stay.excess(300, |_| false), stay.slack(300)), (0, 0));
        // A drone evicted on the way there is paid for once.
        assert_eq!(stay.excess(100, |drone| drone == DroneId(0)), 0);
        let dear_wait = GoalOccupancyCost {
            steps: vec![(0, 50), (300, 0)],
            later: vec![300, u32::MAX],
            drones: vec![(DroneId(0), 50)],
            never: None,
        };
        assert_eq!(
            (dear_wait.excess(100, |_| false), dear_wait.slack(100)),
            (50, 0)
        );
    }
}
