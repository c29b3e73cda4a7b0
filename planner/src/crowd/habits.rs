//! What a step in some direction does to hovering at some offset from it, as a table.

use costmap::costmap::Costmap;
use costmap::fleet::{BUDGET, Fleet, Meeting};
use costmap::leg::{DroneId, KindId, Leg, Tick};
use costmap::verdict::price;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::errand::Errand;
use crate::lattice::Lattice;
use crate::roadmap::Roadmap;

/// Fleets of more classes than this are planned without. Chosen here: every class keeps intervals of its own.
const MOST_CLASSES: usize = 4;
/// Tables larger than this are not made. Chosen here: half a second of work.
const MOST_OFFSETS: usize = 2_000_000;
/// Parts of a step's time that are told apart: chosen here, a hundredth of a second or two.
pub(super) const PARTS: u32 = 32;
/// Prices below this are left to the verdict: chosen here, three hundredths of a second a step (s/s).
const LEAST_PRICE: f32 = 0.0625;

/// What flies alike as others are concerned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Class {
    kind: KindId,
    air_limit: f64,
}

/// What a step does to hovering at one offset from where it began.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Effect {
    pub(super) offset: [i32; 3],
    /// From and to which part of its time: bodies, its wake on who hovers, the other way round.
    pub(super) spans: [Option<[u32; 2]>; 3],
    /// Prices of its wake on who hovers, and the other way round (s/s).
    pub(super) prices: [f32; 2],
}

/// What does not change while a fleet is planned.
#[derive(Debug)]
pub struct Habits {
    pub(super) classes: Vec<Class>,
    pub(super) lattice: Lattice,
    /// `[class who hovers][class who steps][direction]`.
    pub(super) effects: Vec<Vec<Effect>>,
    /// By class: for which part of a step along one axis its beginning is taken.
    pub(super) lingers: Vec<f64>,
    /// By class and place, where the wake of who hovers there ends (m).
    pub(super) wake_end_z_m: Vec<Vec<f64>>,
}

pub(super) const STILL: usize = 13;

pub(super) fn direction(index: usize) -> [i32; 3] {
    let index = index as i32;
    [index % 3 - 1, index / 3 % 3 - 1, index / 9 - 1]
}

impl Habits {
    /// Tables for a fleet; `None` where there are zones, too many classes, or too much to tabulate.
    pub fn new(roadmap: &Roadmap, errands: &[Errand], costmap: &Costmap) -> Option<Habits> {
        let lattice = roadmap.lattice().clone();
        let mut classes: Vec<Class> = Vec::new();
        for errand in errands {
            for &kind in &errand.kinds {
                let class = Class {
                    kind,
                    air_limit: errand.air_limit,
                };
                if !classes.contains(&class) {
                    classes.push(class);
                }
            }
            if classes.len() > MOST_CLASSES {
                return None;
            }
        }
        let fleet = costmap.fleet();
        let cells = (fleet.near_m() / lattice.cell_m()).ceil() as i32 + 1;
        let layers = lattice.counts()[2] as i32;
        let offsets = (2 * cells + 1).pow(2) * (2 * layers + 1) * 27;
        if costmap.has_zones() || offsets as usize * classes.len().pow(2) > MOST_OFFSETS {
            return None;
        }
        let jobs: Vec<(Class, Class, usize)> = classes
            .iter()
            .flat_map(|&me| classes.iter().map(move |&other| (me, other)))
            .flat_map(|(me, other)| (0..27).map(move |way| (me, other, way)))
            .collect();
        let effects: Vec<Vec<Effect>> = jobs
            .par_iter()
            .map(|&(me, other, way)| {
                let step = Step {
                    fleet,
                    me,
                    other,
                    cell_m: lattice.cell_m(),
                    way: direction(way),
                };
                step.effects(cells, layers)
            })
            .collect();
        let wake_end_z_m = classes
            .iter()
            .map(|class| {
                let places = 0..lattice.place_count() as u32;
                let hover = |place| class.leg(0, lattice.position_m(place), lattice.position_m(place));
                places.map(|place| costmap.wake_end_z_m(&hover(place))).collect()
            })
            .collect();
        let mut habits = Habits {
            lingers: Vec::new(),
            classes,
            lattice,
            effects,
            wake_end_z_m,
        };
        // A step along x: how long its beginning stays taken for one like it.
        let along_x = STILL + 1;
        habits.lingers = (0..habits.classes.len())
            .map(|class| {
                let own = &habits.effects[habits.table(class, class, along_x)];
                let taken = own.iter().filter(|effect| effect.offset == [0; 3]);
                let last = taken.flat_map(|effect| effect.spans.iter().flatten().map(|span| span[1]));
                let last = f64::from(last.max().unwrap_or(PARTS / 2)) / f64::from(PARTS);
                // Within limits chosen here, wide fleets are judged by where they are mostly.
                last.clamp(0.5, 0.7)
            })
            .collect();
        Some(habits)
    }

    pub(super) fn table(&self, me: usize, other: usize, way: usize) -> usize {
        (me * self.classes.len() + other) * 27 + way
    }

    pub(super) fn class(&self, kind: KindId, air_limit: f64) -> Option<usize> {
        self.classes.iter().position(|class| *class == Class { kind, air_limit })
    }
}

impl Class {
    fn leg(&self, drone: u32, from_m: Point3<f64>, to_m: Point3<f64>) -> Leg {
        Leg {
            drone: DroneId(drone),
            kind: self.kind,
            start: Tick(0),
            end: Tick(PARTS),
            from_m,
            to_m,
            flying: true,
            air_limit: self.air_limit,
        }
    }
}

/// One step of one class beside another that hovers.
struct Step<'a> {
    fleet: &'a Fleet,
    me: Class,
    other: Class,
    cell_m: f64,
    way: [i32; 3],
}

impl Step<'_> {
    fn effects(&self, cells: i32, layers: i32) -> Vec<Effect> {
        let mut effects = Vec::new();
        for dz in -layers..=layers {
            for dy in -cells..=cells {
                for dx in -cells..=cells {
                    effects.extend(self.effect([dx, dy, dz]));
                }
            }
        }
        effects
    }

    fn effect(&self, offset: [i32; 3]) -> Option<Effect> {
        let at_m = |steps: [i32; 3]| {
            Point3::from(Vector3::from(steps.map(f64::from)) * self.cell_m)
        };
        let hover = self.me.leg(0, at_m(offset), at_m(offset));
        let step = self.other.leg(1, at_m([0; 3]), at_m(self.way));
        let mut effect = Effect {
            offset,
            ..Effect::default()
        };
        for (index, span) in effect.spans.iter_mut().enumerate() {
            let ends = wake_ends(index);
            let meets = |from: u32, to: u32| {
                let part = Leg {
                    start: Tick(from),
                    end: Tick(to),
                    ..hover
                };
                self.fleet.meet(&part, &step, ends)
            };
            let Some(whole) = meets(0, PARTS) else { continue };
            if holds(&whole, index) {
                let part = |k: &u32| meets(*k, k + 1).is_some_and(|met| holds(&met, index));
                let first = (0..PARTS).find(part);
                let last = (0..PARTS).rev().find(part);
                *span = first.zip(last).map(|(first, last)| [first, last + 1]);
            } else if index > 0 {
                let cost = (price(whole.alpha_first) + price(whole.alpha_second)) as f32;
                effect.prices[index - 1] = if cost < LEAST_PRICE { 0.0 } else { cost };
            }
        }
        let matters = effect.spans.iter().any(Option::is_some) || effect.prices != [0.0; 2];
        matters.then_some(effect)
    }
}

/// Wakes that reach everything or nothing: for bodies alone, for the other's wake, for one's own.
fn wake_ends(index: usize) -> [f64; 2] {
    let [low, high] = [f64::NEG_INFINITY, f64::INFINITY];
    [[high, high], [high, low], [low, high]][index]
}

fn holds(meeting: &Meeting, index: usize) -> bool {
    match index {
        0 => meeting.bodies,
        1 => meeting.column || meeting.load_on_first > BUDGET,
        _ => meeting.column || meeting.load_on_second > BUDGET,
    }
}
