//! Two steps that begin at the same moment and last as long: along one axis each, or none, or
//! between a stop beside the lattice and a place next to it.

use rayon::prelude::*;

use super::directions::{index, neighbour};
use super::shape::{AdvectedStep, Extent, Shape};
use super::steps::{StepFootprint, Steps};

/// Directions of a step along one axis, the first of them none.
pub(crate) const DIRECTIONS: [[i32; 3]; 7] = [
    [0, 0, 0],
    [0, 0, -1],
    [0, -1, 0],
    [-1, 0, 0],
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
];
/// The direction of a stay.
pub(crate) const STAYS: usize = 0;

/// Which of [`NEIGHBOURS`](crate::graph::lattice::NEIGHBOURS) each of [`DIRECTIONS`] leads to;
/// staying counts for nothing.
pub(crate) const AMONG_NEIGHBOURS: [usize; 7] = among_neighbours();

const fn among_neighbours() -> [usize; 7] {
    let mut among = [0; 7];
    let mut direction = 1;
    while direction < 7 {
        among[direction] = match neighbour(index(DIRECTIONS[direction])) {
            Some(n) => n,
            None => 0,
        };
        direction += 1;
    }
    among
}

/// A step of one drone, or a stay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SynchronousStep {
    /// What flies.
    pub(crate) class: usize,
    /// The lattice place where it begins, or the one next to that (steps).
    pub(crate) at: [i32; 3],
    /// Where it leads.
    pub(crate) direction: StepDirection,
    /// What led there, just before.
    pub(crate) previous_direction: StepDirection,
}

/// Where a step leads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum StepDirection {
    /// From a lattice place in one of [`DIRECTIONS`].
    Axis(usize),
    /// From or to a stop beside the lattice, or staying there.
    Beside {
        /// Where it begins (cells from the first place).
        from: [f64; 3],
        /// How far it leads (cells).
        by: [f64; 3],
    },
}

impl StepDirection {
    /// A stay.
    pub(crate) const STAY: StepDirection = StepDirection::Axis(STAYS);

    fn moves(&self) -> bool {
        *self != StepDirection::STAY
    }

    /// How far it leads (cells).
    fn by(&self) -> [f64; 3] {
        match self {
            StepDirection::Axis(direction) => DIRECTIONS[*direction].map(f64::from),
            StepDirection::Beside { by, .. } => *by,
        }
    }
}

/// What two steps do to one another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum StepInteraction {
    /// What they fill of one another's budgets, in parts of [`super::steps::LOADS`].
    Loads([u8; 2]),
    /// They are too near one another.
    TooNear,
    /// One is too near what the other did before, whatever that one does now.
    TooNearBefore,
}

impl SynchronousStep {
    fn footprint(&self, direction: usize) -> StepFootprint {
        StepFootprint {
            class: self.class,
            at: self.at,
            by: DIRECTIONS[direction],
        }
    }

    /// Where it begins (cells).
    fn from(&self) -> [f64; 3] {
        match self.direction {
            StepDirection::Axis(_) => self.at.map(f64::from),
            StepDirection::Beside { from, .. } => from,
        }
    }
}

/// What such steps do to one another.
#[derive(Debug)]
pub(crate) struct StepInteractions<'a> {
    pub(crate) steps: &'a Steps,
    /// How long each lasts.
    pub(crate) ticks: u32,
    /// How far two drones may be apart on their steps within the time margins (parts of a step).
    apart: f64,
    /// `[class][other class]`.
    tables: Vec<SynchronousTable>,
    /// Whether wakes are advected.
    is_advected: bool,
}

/// What wakes of close drones may fill of a budget, parts of [`super::steps::LOADS`]. Chosen here:
/// three fifths, the rest is for the many farther off: with nine tenths the costmap found some nine
/// hundred legs of 2000 drones on half the columns of a hall too near others, with three fifths
/// none.
pub(crate) const MOST_LOADS: i32 = 150;

const TOO_NEAR: [u8; 2] = [u8::MAX; 2];

/// Least and greatest part of a step that two drones may be apart within the time margins: chosen
/// here. Less makes every step long, more keeps drones farther apart than their wakes do.
const APART: [f64; 2] = [0.07, 0.4];

impl<'a> StepInteractions<'a> {
    /// Of steps that last at least `ticks`, and so long that where one drone is late, another may
    /// still follow it around a corner; or, where bodies have no room for that, straight on.
    ///
    /// Of 500 drones on 32 by 32 columns, with the default margins, following around corners takes
    /// 78 steps of 1.33 s, straight on 516 of 0.5 s.
    pub(crate) fn new(steps: &'a Steps, ticks: u32) -> StepInteractions<'a> {
        let bodies = (steps.shapes()).map(|shape| shape.conflict_volume.body_radius());
        let bodies = bodies.fold(0.0, f64::max);
        let (corner, straight) = (1.0 - bodies * std::f64::consts::SQRT_2, 1.0 - bodies);
        let room = if corner >= APART[0] { corner } else { straight };
        // Some turn while others do not.
        let shift = f64::from(steps.shift + 2 * steps.most_ahead());
        let slow = (shift / room.clamp(APART[0], APART[1])).ceil() as u32;
        let ticks = ticks.max(slow);
        let apart = shift / f64::from(ticks);
        let count = steps.class_count();
        let is_advected = steps.wake_persistence_ticks > 0;
        let late = is_advected.then_some((ticks, shift));
        let shapes: Vec<&Shape> = steps.shapes().collect();
        let alone = (shapes.par_iter()).map(|shape| SynchronousTable::new(shape, apart, late));
        let mut tables: Vec<SynchronousTable> = alone.collect();
        let columns = (0..tables.len()).map(|it| {
            let reversed = it % count * count + it / count;
            tables[it].columns(&tables[reversed])
        });
        let columns: Vec<_> = columns.collect();
        for (table, near) in tables.iter_mut().zip(columns) {
            table.near = near;
        }
        StepInteractions {
            steps,
            ticks,
            apart,
            tables,
            is_advected,
        }
    }

    /// For how many rounds air matters after the one in which it left.
    pub(crate) fn rounds_back(&self) -> usize {
        let all = self.tables.iter().flat_map(|table| &table.advected);
        let rounds = all.map(|it| it.rounds[1].max(if it.load > 0 { it.lasts } else { 0 }));
        usize::from(rounds.max().unwrap_or(0))
    }

    /// What air that the other left so many rounds ago fills of the budget of the one, in parts of
    /// [`super::steps::LOADS`]; `None`: it is too much by itself.
    pub(crate) fn meets_air(
        &self,
        one: &SynchronousStep,
        other: &SynchronousStep,
        rounds: usize,
    ) -> Option<u8> {
        let advected = self.advected(one, other);
        let [first, last] = advected.rounds.map(usize::from);
        let is_met = first > 0 && (first..=last).contains(&rounds);
        let load = match rounds <= usize::from(advected.lasts) {
            true => advected.load,
            false => 0,
        };
        if !is_met && load == 0 || !self.reaches(one, other) {
            return Some(0);
        }
        (!is_met).then_some(load)
    }

    fn advected(&self, one: &SynchronousStep, other: &SynchronousStep) -> AdvectedStep {
        if !self.is_advected {
            return AdvectedStep::default();
        }
        let (StepDirection::Axis(direction), StepDirection::Axis(others)) =
            (one.direction, other.direction)
        else {
            let (from, from_other) = (one.from(), other.from());
            let offset = [0, 1, 2].map(|axis| from_other[axis] - from[axis]);
            let by = [one.direction.by(), other.direction.by()];
            let shape = self.steps.shape(one.class, other.class);
            let shift = self.apart * f64::from(self.ticks);
            return shape.advected(by, offset, (self.ticks, shift));
        };
        let offset = [0, 1, 2].map(|axis| other.at[axis] - one.at[axis]);
        let table = self.table(one.class, other.class);
        table.advected_at([direction, others], offset)
    }

    /// Whether wakes of two steps reach down to one another, or bodies may touch; steps from and to
    /// stops beside the lattice count as if they did.
    fn reaches(&self, one: &SynchronousStep, other: &SynchronousStep) -> bool {
        let (StepDirection::Axis(direction), StepDirection::Axis(others)) =
            (one.direction, other.direction)
        else {
            return true;
        };
        (self.steps).can_meet(&one.footprint(direction), &other.footprint(others), true)
    }

    fn table(&self, class: usize, other: usize) -> &SynchronousTable {
        &self.tables[class * self.steps.class_count() + other]
    }

    /// Columns around the beginning of a step in which others can matter to it: those on the
    /// lattice, or all where some are `beside`.
    pub(crate) fn near(&self, one: &SynchronousStep, other: usize, beside: bool) -> &[[i32; 2]] {
        let table = self.table(one.class, other);
        match (one.previous_direction, one.direction) {
            (StepDirection::Axis(before), StepDirection::Axis(direction)) if !beside => {
                &table.near[before * DIRECTIONS.len() + direction]
            }
            _ => &table.all,
        }
    }

    /// What the two do to one another on these steps, and each of them to the other's last where
    /// one is early and the other late.
    pub(crate) fn meet(&self, one: &SynchronousStep, other: &SynchronousStep) -> StepInteraction {
        if self.advected(one, other).now && self.reaches(one, other) {
            return StepInteraction::TooNear;
        }
        let Some(mut loads) = self.meet_now(one, other) else {
            return StepInteraction::TooNear;
        };
        if self.apart > 0.0 {
            // A drone that stays now or did before is where it was: that is asked already.
            if one.previous_direction.moves() && other.direction.moves() {
                let Some(pair_loads) = self.cross(one, other) else {
                    return StepInteraction::TooNearBefore;
                };
                loads = [0, 1].map(|side| loads[side].max(pair_loads[side]));
            }
            if other.previous_direction.moves() && one.direction.moves() {
                let Some(pair_loads) = self.cross(other, one) else {
                    return StepInteraction::TooNearBefore;
                };
                loads = [0, 1].map(|side| loads[side].max(pair_loads[1 - side]));
            }
        }
        StepInteraction::Loads(loads)
    }

    fn meet_now(&self, one: &SynchronousStep, other: &SynchronousStep) -> Option<[u8; 2]> {
        let (StepDirection::Axis(direction), StepDirection::Axis(others)) =
            (one.direction, other.direction)
        else {
            // Few are beside the lattice, and not for long: they are not tabulated.
            let ([from, by], [from_other, by_other]) =
                [one, other].map(|it| [it.from(), it.direction.by()]).into();
            let offset = [0, 1, 2].map(|axis| from_other[axis] - from[axis]);
            let shape = self.steps.shape(one.class, other.class);
            return shape.synchronous([by, by_other], offset, [-self.apart, self.apart]);
        };
        let offset = [0, 1, 2].map(|axis| other.at[axis] - one.at[axis]);
        let table = self.table(one.class, other.class);
        let pair_loads = table.at(&table.meetings, [direction, others], offset);
        if pair_loads != TOO_NEAR {
            return Some(pair_loads);
        }
        (!self.reaches(one, other)).then_some([0; 2])
    }

    /// What the last step of one drone and the next of another do to one another.
    fn cross(&self, one: &SynchronousStep, other: &SynchronousStep) -> Option<[u8; 2]> {
        let (StepDirection::Axis(before), StepDirection::Axis(others)) =
            (one.previous_direction, other.direction)
        else {
            let (from, from_other) = (one.from(), other.from());
            let by = one.previous_direction.by();
            let offset = [0, 1, 2].map(|axis| from_other[axis] - from[axis] + by[axis]);
            let shape = self.steps.shape(one.class, other.class);
            return shape.synchronous([by, other.direction.by()], offset, crossing(self.apart));
        };
        let offset = [0, 1, 2].map(|axis| other.at[axis] - one.at[axis]);
        let table = self.table(one.class, other.class);
        let pair_loads = table.at(&table.crossings, [before, others], offset);
        if pair_loads != TOO_NEAR {
            return Some(pair_loads);
        }
        let previous = StepFootprint {
            at: [0, 1, 2].map(|axis| one.at[axis] - DIRECTIONS[before][axis]),
            ..one.footprint(before)
        };
        let reach = (self.steps).can_meet(&previous, &other.footprint(others), true);
        (!reach).then_some([0; 2])
    }
}

/// How far ahead of the next step of another a drone is on its last, where one is early and the
/// other late (parts of a step).
fn crossing(apart: f64) -> [f64; 2] {
    [1.0 - apart, 1.0 + apart]
}

/// What two classes do to one another on synchronous steps.
#[derive(Debug)]
struct SynchronousTable {
    /// Of the table.
    extent: Extent,
    /// `[direction][direction][dz][dy][dx]`: loads on both, or [`TOO_NEAR`].
    meetings: Vec<[u8; 2]>,
    /// The same of the first's last step and the second's next; empty without time margins.
    crossings: Vec<[u8; 2]>,
    /// As the meetings, what advected wakes mean; empty where they are quasi-static.
    advected: Vec<AdvectedStep>,
    /// By directions of the first, before and now: columns in which something can matter.
    near: Vec<Vec<[i32; 2]>>,
    /// Columns in which something can matter to a step from or to a stop beside the lattice, or one
    /// there to it: one more on every side.
    all: Vec<[i32; 2]>,
}

impl SynchronousTable {
    /// Without columns.
    fn new(shape: &Shape, apart: f64, late: Option<(u32, f64)>) -> SynchronousTable {
        // Room for a drone off its nominal place.
        let more = i32::from(apart > 0.0);
        let extent = Extent {
            reach: shape.extent.reach + more,
            layers: shape.extent.layers + more,
            ..shape.extent
        };
        let table = |of: &(dyn Fn([usize; 2], [i32; 3]) -> Option<[u8; 2]> + Sync)| {
            let directions = 0..DIRECTIONS.len() * DIRECTIONS.len();
            let of_directions = |directions: usize| {
                let directions = [directions / DIRECTIONS.len(), directions % DIRECTIONS.len()];
                let pair_loads =
                    offsets(extent).map(|offset| of(directions, offset).unwrap_or(TOO_NEAR));
                pair_loads.collect::<Vec<_>>()
            };
            directions
                .into_par_iter()
                .flat_map_iter(of_directions)
                .collect()
        };
        let by = |directions: [usize; 2]| {
            directions.map(|direction| DIRECTIONS[direction].map(f64::from))
        };
        let meetings = table(&|directions, offset| {
            shape.synchronous(by(directions), offset.map(f64::from), [-apart, apart])
        });
        let crossings = match apart > 0.0 {
            true => table(&|directions, offset| {
                if directions.contains(&STAYS) {
                    return Some([0; 2]);
                }
                let before = DIRECTIONS[directions[0]];
                let offset = [0, 1, 2].map(|axis| f64::from(offset[axis] + before[axis]));
                shape.synchronous(by(directions), offset, crossing(apart))
            }),
            false => Vec::new(),
        };
        let advected = late.map(|late| {
            let all = 0..DIRECTIONS.len() * DIRECTIONS.len();
            let of_directions = |both: usize| {
                let directions = [both / DIRECTIONS.len(), both % DIRECTIONS.len()];
                let step =
                    |offset: [i32; 3]| shape.advected(by(directions), offset.map(f64::from), late);
                offsets(extent).map(step).collect::<Vec<_>>()
            };
            all.into_par_iter().flat_map_iter(of_directions).collect()
        });
        let wide = -extent.reach - 1..=extent.reach + 1;
        let row = |dy: i32| wide.clone().map(move |dx| [dx, dy]);
        SynchronousTable {
            extent,
            meetings,
            crossings,
            advected: advected.unwrap_or_default(),
            near: Vec::new(),
            all: wide.clone().flat_map(row).collect(),
        }
    }

    /// By directions of the first, before and now: columns in which something can matter, the table
    /// the other way round given.
    fn columns(&self, reversed: &SynchronousTable) -> Vec<Vec<[i32; 2]>> {
        let offsets: Vec<[i32; 3]> = offsets(self.extent).collect();
        let matters = |before: usize, direction: usize| {
            let is_something = |[dx, dy, dz]: [i32; 3]| {
                (0..DIRECTIONS.len()).any(|others| {
                    let offset = [dx, dy, dz];
                    self.at(&self.meetings, [direction, others], offset) != [0; 2]
                        || self.at(&self.crossings, [before, others], offset) != [0; 2]
                        || reversed.at(&reversed.crossings, [others, direction], [-dx, -dy, -dz])
                            != [0; 2]
                        || self.advected_at([direction, others], offset).matters()
                })
            };
            let somewhere = offsets.iter().filter(|offset| is_something(**offset));
            let mut columns: Vec<[i32; 2]> = somewhere.map(|[dx, dy, _]| [*dx, *dy]).collect();
            columns.sort_unstable();
            columns.dedup();
            columns
        };
        let all = (0..DIRECTIONS.len() * DIRECTIONS.len()).into_par_iter();
        all.map(|both| matters(both / DIRECTIONS.len(), both % DIRECTIONS.len()))
            .collect()
    }

    fn at(
        &self,
        table: &[[u8; 2]],
        [direction, others]: [usize; 2],
        [dx, dy, dz]: [i32; 3],
    ) -> [u8; 2] {
        let index = self.index([direction, others], [dx, dy, dz]);
        let pair_loads = index.and_then(|index| table.get(index));
        pair_loads.copied().unwrap_or([0; 2])
    }

    /// What advected wakes mean.
    fn advected_at(&self, directions: [usize; 2], offset: [i32; 3]) -> AdvectedStep {
        let index = self.index(directions, offset);
        let late = index.and_then(|index| self.advected.get(index));
        late.copied().unwrap_or_default()
    }

    /// Where two steps stand in the tables; `None`: too far apart.
    fn index(&self, [direction, others]: [usize; 2], [dx, dy, dz]: [i32; 3]) -> Option<usize> {
        let Extent { reach, layers, .. } = self.extent;
        if dx.abs() > reach || dy.abs() > reach || dz.abs() > layers {
            return None;
        }
        let (wide, tall) = (2 * reach + 1, 2 * layers + 1);
        let offset = (dx + reach) + wide * ((dy + reach) + wide * (dz + layers));
        let of_directions = (direction * DIRECTIONS.len() + others) * (wide * wide * tall) as usize;
        Some(of_directions + offset as usize)
    }
}

/// All offsets within a table, in its order.
fn offsets(Extent { reach, layers, .. }: Extent) -> impl Iterator<Item = [i32; 3]> {
    let aside = -reach..=reach;
    (-layers..=layers).flat_map(move |dz| {
        let aside = aside.clone();
        (aside.clone()).flat_map(move |dy| aside.clone().map(move |dx| [dx, dy, dz]))
    })
}
