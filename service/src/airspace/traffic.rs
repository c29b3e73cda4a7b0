//! Random traffic over a site of square areas, for tests and measurements: drones that have nothing
//! to do are given a place in their own area, or are handed to a neighbour.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nalgebra::Point3;
use planner::plan::{AtEnd, Bounds};
use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use super::message::Offer;
use super::{Area, Site};
use crate::message::{OneChange, Retask, Task};

/// Height of the site (m).
const HEIGHT_M: f64 = 6.0;
/// How far beside an Offboard 2 its wake or body matters to another at most, in this height (m):
/// bodies, and margins of both, included.
const REACH_M: f64 = 3.0;
/// Tries to find a free place.
const TRIES: usize = 20;
/// Tries to find one for a drone at the beginning. Chosen here: an area that is so full is no site.
const MOST_TRIES: usize = 10_000;

/// A site of square areas side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Areas along x, and along y.
    pub areas: [usize; 2],
    /// Side of an area without its strips (m, whole).
    pub side_m: usize,
    /// How far its world reaches into its neighbours' (m, whole).
    pub strip_m: usize,
    /// Drones of an area at the beginning.
    pub drones: usize,
    /// Draws where they are.
    pub seed: u64,
}

impl Grid {
    /// What the planners agree on; changes are flown so long after they are asked (s).
    pub fn site(&self, lead_s: f64) -> Site {
        let areas = (0..self.areas[0]).flat_map(|x| (0..self.areas[1]).map(move |y| [x, y]));
        Site {
            areas: areas
                .map(|at| (name(at), self.bounds_m(at, self.strip_m)))
                .collect(),
            reach_m: REACH_M,
            lead_s,
            silent_s: 3.0,
        }
    }

    /// An area with so much around it (m), as far as the site reaches.
    fn bounds_m(&self, at: [usize; 2], around_m: usize) -> Bounds {
        let low = |k: usize| (at[k] * self.side_m).saturating_sub(around_m) as f64;
        let high = |k: usize| {
            let end = self.areas[k] * self.side_m;
            ((at[k] + 1) * self.side_m + around_m).min(end) as f64
        };
        Bounds {
            min: Point3::new(low(0), low(1), 0.0),
            max: Point3::new(high(0), high(1), HEIGHT_M),
        }
    }

    /// All of it (m).
    pub fn whole_m(&self) -> Bounds {
        let side = |k: usize| (self.areas[k] * self.side_m) as f64;
        Bounds {
            min: Point3::origin(),
            max: Point3::new(side(0), side(1), HEIGHT_M),
        }
    }

    /// An area's scenario: its drones hover where they are.
    ///
    /// # Errors
    /// The area has no room for so many.
    pub fn scenario(&self, area: &str) -> Result<String, String> {
        let at = self.at(area);
        let (core, world) = (self.bounds_m(at, 0), self.bounds_m(at, self.strip_m));
        let (min, max) = (world.min, world.max);
        let mut draws = Draws::new(self.seed ^ (1 + at[0] as u64 * 1000 + at[1] as u64));
        let mut text = format!(
            "Scenario(name: \"{area}\", bounds_m: (min: ({}, {}, 0), max: ({}, {}, {HEIGHT_M})), drones: [\n",
            min.x, min.y, max.x, max.y
        );
        let mut taken: Vec<Point3<f64>> = Vec::new();
        let mut tries = 0;
        while taken.len() < self.drones {
            if tries == MOST_TRIES {
                let Grid { drones, side_m, .. } = self;
                return Err(format!(
                    "`{area}`: {drones} drones do not hover 2 m apart in an area of {side_m} m, less 3 m on each side"
                ));
            }
            tries += 1;
            let place_m = draws.place(&core, 3.0);
            if taken
                .iter()
                .all(|it| (it.xy() - place_m.xy()).norm() >= 2.0)
            {
                let index = taken.len();
                // Writing to a text does not fail.
                let _ = writeln!(
                    text,
                    "  (name: \"{area}-{index}\", airframe: \"offboard-2\", start_m: ({}, {}, {})),",
                    place_m.x, place_m.y, place_m.z
                );
                taken.push(place_m);
                tries = 0;
            }
        }
        Ok(text + "])\n")
    }

    fn at(&self, area: &str) -> [usize; 2] {
        let mut parts = area
            .trim_start_matches('a')
            .split('-')
            .map(|it| it.parse().unwrap_or(0));
        [parts.next().unwrap_or(0), parts.next().unwrap_or(0)]
    }
}

fn name([x, y]: [usize; 2]) -> String {
    format!("a{x}-{y}")
}

#[derive(Clone, Debug)]
struct Draws(SplitMix64);

impl Draws {
    fn new(seed: u64) -> Draws {
        Draws(SplitMix64::seed_from_u64(seed))
    }

    fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count.max(1) as u64) as usize
    }

    /// The centre of a cell of 1 m, so far within bounds (m).
    fn place(&mut self, within: &Bounds, edge_m: f64) -> Point3<f64> {
        let mut along = |k: usize, edge_m: f64| {
            let low = within.min[k] + edge_m;
            let cells = (within.max[k] - edge_m - low).max(1.0) as usize;
            low + self.below(cells) as f64 + 0.5
        };
        let (x, y) = (along(0, edge_m), along(1, edge_m));
        Point3::new(x, y, along(2, 1.0))
    }
}

/// The traffic of one area.
#[derive(Clone, Debug)]
pub struct Traffic {
    grid: Grid,
    draws: Draws,
    /// Of a hundred tasks so many lead to a neighbour.
    crossing: usize,
    /// Drones on their way to the strip, and the area that takes each.
    to: BTreeMap<String, String>,
    /// Changes that were not made, by why.
    refused: BTreeMap<&'static str, u64>,
}

impl Traffic {
    /// Of an area; of a hundred tasks so many lead to a neighbour.
    pub fn new(grid: Grid, area: &str, crossing: usize) -> Traffic {
        let [x, y] = grid.at(area);
        Traffic {
            draws: Draws::new(grid.seed ^ (77 + x as u64 * 1000 + y as u64)),
            grid,
            crossing,
            to: BTreeMap::new(),
            refused: BTreeMap::new(),
        }
    }

    /// Changes that were not made, by why.
    pub fn refused(&self) -> &BTreeMap<&'static str, u64> {
        &self.refused
    }

    /// Gives one drone something to do, and offers those that are on their way to the strip.
    pub fn step(&mut self, area: &mut Area, now_s: f64) {
        self.offer(area);
        if area.is_busy() {
            return;
        }
        let is_idle = |last_s: Option<&f64>| last_s.is_none_or(|it| *it + 1.0 < now_s);
        let idle = area
            .own()
            .filter(|it| it.at_end == AtEnd::Hover && is_idle(it.trajectory.t_s.last()));
        let idle: Vec<String> = idle.map(|it| it.name.clone()).collect();
        if idle.is_empty() {
            return;
        }
        let drone = idle[self.draws.below(idle.len())].clone();
        if self.to.contains_key(&drone) {
            return;
        }
        let here = self.grid.at(area.name());
        let core = self.grid.bounds_m(here, 0);
        let mut to = None;
        let mut within = core;
        if self.draws.below(100) < self.crossing {
            let beside = self.beside(here);
            if !beside.is_empty() {
                let there = beside[self.draws.below(beside.len())];
                within = self.shared_m(here, there);
                to = Some(name(there));
            }
        }
        let edge_m = if to.is_some() { 0.0 } else { 1.0 };
        let Some(to_m) = self.free(area, &within, edge_m, &drone) else {
            return;
        };
        let retask = OneChange::Retask(Retask {
            drone: drone.clone(),
            tasks: vec![task(to_m)],
        });
        match area.ask(now_s, vec![retask]) {
            Ok(_) => {
                if let Some(to) = to {
                    self.to.insert(drone, to);
                }
            }
            Err(why) => {
                let why = match why {
                    super::Refused::Busy => "busy",
                    super::Refused::Changes(_) => "no path",
                    super::Refused::NotVerified(_) => "verifier",
                    super::Refused::Silent(_) => "silent neighbour",
                    super::Refused::Closed(_) => "lost neighbour",
                    super::Refused::Offered(_) => "offered",
                };
                *self.refused.entry(why).or_default() += 1;
            }
        }
    }

    /// Offers the drones whose plans lead to the strip; the others are forgotten.
    fn offer(&mut self, area: &mut Area) {
        if area.is_busy() {
            return;
        }
        for (drone, to) in std::mem::take(&mut self.to) {
            let there = self.grid.bounds_m(self.grid.at(&to), 0);
            let is_own = area.own().any(|it| it.name == drone);
            if is_own && !area.is_offered(&drone) {
                let to_m = self.free(area, &there, 1.0, &drone);
                let offer = Offer {
                    drone: drone.clone(),
                    tasks: to_m.map(task).into_iter().collect(),
                    at_end: AtEnd::Hover,
                };
                if area.offer(&to, offer).is_err() {
                    continue;
                }
            }
            if is_own {
                self.to.insert(drone, to);
            }
        }
    }

    fn beside(&self, [x, y]: [usize; 2]) -> Vec<[usize; 2]> {
        let [columns, rows] = self.grid.areas;
        let all = [
            (x > 0).then(|| [x - 1, y]),
            (x + 1 < columns).then(|| [x + 1, y]),
            (y > 0).then(|| [x, y - 1]),
            (y + 1 < rows).then(|| [x, y + 1]),
        ];
        all.into_iter().flatten().collect()
    }

    /// The strip that two worlds share (m).
    fn shared_m(&self, here: [usize; 2], there: [usize; 2]) -> Bounds {
        let strip = self.grid.strip_m;
        let [a, b] = [here, there].map(|at| self.grid.bounds_m(at, strip));
        Bounds {
            min: a.min.sup(&b.min),
            max: a.max.inf(&b.max),
        }
    }

    /// A place in a column that no other drone ends near.
    fn free(
        &mut self,
        area: &Area,
        within: &Bounds,
        edge_m: f64,
        drone: &str,
    ) -> Option<Point3<f64>> {
        let ends = area.drones().iter().filter(|it| it.name != drone);
        let ends: Vec<Point3<f64>> = ends
            .filter_map(|it| it.trajectory.position_m.last().copied())
            .collect();
        (0..TRIES)
            .map(|_| self.draws.place(within, edge_m))
            .find(|at_m| ends.iter().all(|it| (it.xy() - at_m.xy()).norm() >= 1.5))
    }
}

fn task(to_m: Point3<f64>) -> Task {
    Task {
        to_m: to_m.coords.into(),
        dwell_s: 0.0,
        load_kg: None,
    }
}
