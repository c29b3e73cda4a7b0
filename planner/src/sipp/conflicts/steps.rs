//! What two steps on the lattice do to one another, as a table.
//!
//! Bodies, columns and wakes of two drones keep them a radius apart that depends on the height
//! between them alone. Two steps from neighbouring places break it for some delays of one against
//! the other, which are one interval: so all of it fits into a table by direction, direction and
//! offset. It serves to find paths, not to judge them: pairs only, no sums, and the height between
//! two steps counts as all that it becomes on the way.

use std::sync::Arc;

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, KindId, Leg, Tick};
use nalgebra::Point3;

use super::column::StepRecord;
use super::directions::neighbour;
pub(super) use super::directions::{STILL, cells};
use super::shape::{PairAir, Shape};
use super::table::ConflictTable;
use crate::graph::agent::Agent;
use crate::graph::lattice::Lattice;

/// Fleets of more classes than this get no tables. Chosen here: every class keeps intervals of its
/// own.
const MOST_CLASSES: usize = 4;
/// Fleets of up to so many drones get no tables among zones whose air is limited. Chosen here:
/// tables leave one wake less of a drone's budget than it bears, which a few can do without.
const MOST_AMONG_ZONES: usize = 30;
/// Velocities that differ by no more are one (m/s): rounding.
const SAME_MPS: f64 = 1e-6;
/// Tables of more entries than this are not made. Chosen here: an eighth of them may be asked for
/// and kept, 10 MiB.
const MOST_ENTRIES: usize = 8 << 20;
/// The same of smooth flights, whose wakes and bodies are somewhat wider: chosen here.
const MOST_SMOOTH_ENTRIES: usize = 16 << 20;

/// What flies alike as others are concerned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Class {
    pub(super) kind: KindId,
    pub(super) air_limit: f64,
    /// Of a step to each of the neighbours of a place.
    pub(super) ticks: [u32; 26],
    /// By how much it is ahead of a change from rest, and behind one to rest (ticks).
    pub(super) ahead: u32,
}

/// What one step does to another that begins at some offset from it.
///
/// Both move: the delays of the first against the second, in ticks, at which they are too near. One
/// stands still: when the other is too near, in ticks since it began. No drone moves: not empty if
/// they are too near, from as much before the second comes, and to a tick and as much after it
/// goes, as air is under way (reversed, as where the second stands still).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct DelaySpan {
    pub(super) from: i16,
    pub(super) to: i16,
    /// What it costs both while they are not too near (thousandths of a second a second).
    pub(super) price: u16,
    /// What the second's wake fills of the first's budget, at most, while they are not too near
    /// (parts of [`LOADS`]), and the other way round.
    pub(super) on_first: u8,
    pub(super) on_second: u8,
}

/// Parts of a budget that are told apart: chosen here, what a byte holds.
pub(super) const LOADS: f64 = 250.0;

impl DelaySpan {
    pub(super) fn is_empty(&self) -> bool {
        self.from >= self.to
    }
}

/// Tables of a fleet: they do not change while it is planned. Copies share them.
#[derive(Clone, Debug)]
pub(crate) struct Steps {
    pub(super) lattice: Arc<Lattice>,
    classes: Vec<Class>,
    /// Per drone, its classes by kind.
    of_drones: Vec<Vec<(KindId, usize)>>,
    /// `[class][other class]`.
    tables: Arc<[ConflictTable]>,
    /// By class and place, the lowest layer that the wake of a drone hovering there reaches; empty
    /// without covers.
    wake_ends: Arc<[Vec<u16>]>,
    /// How much earlier or later than planned one drone may be, seen from another (ticks): every
    /// interval grows by so much at both ends, and stays one.
    pub(crate) shift: u32,
    /// How long air may matter after it left (ticks); 0 where wakes are quasi-static.
    pub(crate) wake_persistence_ticks: u32,
}

/// A step, or a stay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StepFootprint {
    /// What steps.
    pub(crate) class: usize,
    /// Where it begins, in steps of the lattice.
    pub(crate) at: [i32; 3],
    /// Where it leads from there.
    pub(crate) by: [i32; 3],
}

impl Steps {
    /// Tables for a fleet, and for other drones in the costmap; `None` where a few fly among zones
    /// whose air is limited, where there are too many classes, or too much to tabulate.
    pub(crate) fn new(lattice: &Lattice, agents: &[Agent], costmap: &Costmap) -> Option<Steps> {
        if costmap.has_air_limits_of_zones() && agents.len() <= MOST_AMONG_ZONES {
            return None;
        }
        let mut classes = Vec::new();
        let of_drones = of_drones(&mut classes, agents, costmap);
        if classes.len() > MOST_CLASSES {
            return None;
        }
        let mut airs: Vec<PairAir> = Vec::with_capacity(classes.len() * classes.len());
        for (me, other) in pairs(classes.len()) {
            let air = match me <= other {
                true => PairAir::new(lattice, costmap.fleet(), [classes[me], classes[other]]),
                false => airs[other * classes.len() + me].reversed(),
            };
            airs.push(air);
        }
        let of_pairs = pairs(classes.len()).zip(airs);
        let shape = |((me, other), air)| {
            let classes = [classes[me], classes[other]];
            Shape::new((lattice, costmap.fleet()), classes, air)
        };
        let shapes: Vec<Shape> = of_pairs.map(shape).collect();
        let entries = shapes.iter().map(Shape::entries).sum::<usize>();
        let most = match agents.iter().any(|agent| agent.smoothing.is_some()) {
            true => MOST_SMOOTH_ENTRIES,
            false => MOST_ENTRIES,
        };
        if entries > most || shapes.iter().any(Shape::is_too_slow) {
            return None;
        }
        let wake_ends = if costmap.has_blocking_surfaces() {
            let of_class = |class| wake_ends(lattice, costmap, class);
            classes.iter().map(of_class).collect()
        } else {
            Vec::new()
        };
        Some(Steps {
            lattice: Arc::new(lattice.clone()),
            classes,
            of_drones,
            tables: shapes.into_iter().map(ConflictTable::new).collect(),
            wake_ends: wake_ends.into(),
            shift: costmap.fleet().conditions().shift,
            wake_persistence_ticks: costmap.wake_persistence_ticks(),
        })
    }

    /// The same for the fleet as it is by now, in a costmap of the same airframes and limits: what
    /// flies as others did is not tabulated again.
    pub(crate) fn renewed(&self, agents: &[Agent], costmap: &Costmap) -> Option<Steps> {
        let mut classes = self.classes.clone();
        let of_drones = of_drones(&mut classes, agents, costmap);
        match classes.len() == self.classes.len() {
            true => Some(Steps {
                of_drones,
                ..self.clone()
            }),
            false => Steps::new(&self.lattice, agents, costmap),
        }
    }

    /// Places along x, y and z.
    pub(crate) fn counts(&self) -> [usize; 3] {
        self.lattice.counts()
    }

    /// The most by which any drone is ahead of a step, or behind it, beyond the margins (ticks).
    pub(super) fn most_ahead(&self) -> u32 {
        self.classes.iter().map(|it| it.ahead).max().unwrap_or(0)
    }

    /// By how much a drone of a class is ahead of a leg between two others, and behind it (ticks).
    pub(super) fn shifted(&self, class: usize, legs: [Option<&Leg>; 3]) -> [u16; 2] {
        let ahead = self.classes[class].ahead as u16;
        let [before, Some(leg), after] = legs else {
            return [0; 2];
        };
        if ahead == 0 || leg.stays() {
            return [0; 2];
        }
        let rests = |it: Option<&Leg>| it.is_none_or(Leg::stays);
        let turns = [before, after]
            .into_iter()
            .flatten()
            .any(|it| !it.stays() && (it.velocity_mps() - leg.velocity_mps()).norm() > SAME_MPS);
        match turns {
            true => [ahead; 2],
            false => [rests(before), rests(after)].map(|rests| if rests { ahead } else { 0 }),
        }
    }

    pub(crate) fn class_count(&self) -> usize {
        self.classes.len()
    }

    /// The class of a drone as it flies now.
    pub(crate) fn class(&self, drone: DroneId, kind: KindId) -> Option<usize> {
        let own = self.of_drones.get(drone.0 as usize)?;
        let found = own.iter().find(|(known, _)| *known == kind);
        found.map(|(_, class)| *class)
    }

    /// What two classes are to one another.
    pub(super) fn table(&self, me: usize, other: usize) -> &ConflictTable {
        &self.tables[me * self.classes.len() + other]
    }

    /// How far two classes keep from one another.
    pub(super) fn shape(&self, me: usize, other: usize) -> &Shape {
        &self.table(me, other).shape
    }

    /// The same of all pairs, `[class][other class]`.
    pub(super) fn shapes(&self) -> impl Iterator<Item = &Shape> {
        self.tables.iter().map(|table| &table.shape)
    }

    /// From when until when a step forbids another to stand still beside it, within its margins of
    /// time.
    pub(super) fn unsafe_time(&self, span: &DelaySpan, step: &StepRecord) -> [Tick; 2] {
        let direction = usize::from(step.direction);
        if direction == STILL {
            let [before, after] = [span.to - 1, -span.from].map(|it| it.max(0) as u32);
            return [step.start.before(before), step.end.after(after)];
        }
        let moment = |ticks: i16| Tick(step.start.0.saturating_add_signed(i32::from(ticks)));
        // Air lasts beyond the end of the step that it left in; nothing else does.
        let late =
            i32::from(span.to) - self.classes[usize::from(step.class)].ticks(direction) as i32;
        let last = step.end.after(late.max(0) as u32);
        [moment(span.from), moment(span.to).min(last)]
    }

    /// Whether what keeps two steps apart is there: bodies or, of drones that are `flying`, wakes
    /// that no cover stops.
    pub(super) fn can_meet(
        &self,
        one: &StepFootprint,
        other: &StepFootprint,
        flying: bool,
    ) -> bool {
        self.can_touch(one, other) || flying && self.wake_reaches(one, other)
    }

    /// Whether bodies can come near one another, by the layers between them.
    fn can_touch(&self, one: &StepFootprint, other: &StepFootprint) -> bool {
        let (mine, theirs) = (one.by[2], other.by[2]);
        // At the beginning, and when either or both have arrived.
        let rises = [0, mine, -theirs, mine - theirs];
        let heights = rises.map(|rise| one.at[2] - other.at[2] + rise);
        let bodies = self.shape(one.class, other.class).extent.bodies;
        heights.iter().any(|height| height.abs() < bodies)
    }

    /// Whether the wake of the drone that is higher reaches down to the other.
    fn wake_reaches(&self, one: &StepFootprint, other: &StepFootprint) -> bool {
        let (above, below) = match one.at[2] < other.at[2] {
            true => (other, one),
            false => (one, other),
        };
        below.at[2].max(below.at[2] + below.by[2]) >= self.wake_end(above)
    }

    /// The lowest layer that the wake of a drone on its way reaches.
    fn wake_end(&self, footprint: &StepFootprint) -> i32 {
        let Some(ends) = self.wake_ends.get(footprint.class) else {
            return 0;
        };
        let end = |at: [i32; 3]| {
            let place = self.lattice.at(at);
            place.map_or(0, |place| i32::from(ends[place as usize]))
        };
        end(footprint.at).min(end(
            [0, 1, 2].map(|axis| footprint.at[axis] + footprint.by[axis])
        ))
    }
}

/// Of so many classes, each with each: in the order of tables.
fn pairs(classes: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..classes).flat_map(move |me| (0..classes).map(move |other| (me, other)))
}

/// Per drone, its classes by kind; those that are new are added.
fn of_drones(
    classes: &mut Vec<Class>,
    agents: &[Agent],
    costmap: &Costmap,
) -> Vec<Vec<(KindId, usize)>> {
    let mut of_drones = Vec::with_capacity(costmap.drone_count());
    for agent in agents {
        let ticks = *agent.mover.step_ticks();
        let ahead = agent.smoothing.as_ref().map_or(0, |it| it.ahead_ticks());
        let mut own = Vec::new();
        for &kind in &agent.kinds {
            let class = Class {
                kind,
                air_limit: agent.air_limit,
                ticks,
                ahead,
            };
            own.push((kind, index_of(classes, class)));
        }
        of_drones.push(own);
    }
    for drone in agents.len()..costmap.drone_count() {
        let legs = costmap.legs(DroneId(drone as u32)).iter();
        let own = legs.map(|leg| {
            let class = Class {
                kind: leg.kind,
                air_limit: leg.air_limit,
                // It is taken to stand still a while here, a while there.
                ticks: [1; 26],
                ahead: 0,
            };
            (leg.kind, index_of(classes, class))
        });
        let mut own: Vec<(KindId, usize)> = own.collect();
        own.dedup();
        of_drones.push(own);
    }
    of_drones
}

fn index_of(classes: &mut Vec<Class>, class: Class) -> usize {
    let known = classes.iter().position(|known| *known == class);
    known.unwrap_or_else(|| {
        classes.push(class);
        classes.len() - 1
    })
}

fn wake_ends(lattice: &Lattice, costmap: &Costmap, class: &Class) -> Vec<u16> {
    let of = |place: u32| {
        let at_m = lattice.position_m(place);
        let end_z_m = costmap.wake_end_z_m(&class.leg(0, at_m, at_m));
        let [i, j, _] = lattice.steps(place);
        let reached = (0..lattice.counts()[2] as i32).position(|k| {
            let there = lattice.at([i, j, k]);
            there.is_some_and(|there| lattice.position_m(there).z >= end_z_m - 1e-6)
        });
        reached.unwrap_or(lattice.counts()[2]) as u16
    };
    (0..lattice.place_count() as u32).map(of).collect()
}

impl Class {
    pub(super) fn leg(&self, drone: u32, from_m: Point3<f64>, to_m: Point3<f64>) -> Leg {
        Leg {
            drone: DroneId(drone),
            kind: self.kind,
            start: Tick(0),
            end: Tick(1),
            from_m,
            to_m,
            flying: true,
            air_limit: self.air_limit,
        }
    }

    /// Ticks of a step in a direction; of standing still, any.
    pub(super) fn ticks(&self, direction: usize) -> f64 {
        f64::from(self.ticks[neighbour(direction).unwrap_or_default()])
    }
}
