//! Reservation table: blockers of steps on the lattice, and when: what searches ask millions of
//! times.
//!
//! Every drone's steps are kept by the column of the floor in which they begin, in order of time; a
//! query looks up the steps around it. For hovering at a place the answer is written down there,
//! leg by leg as it is reserved, since searches ask for it again and again: SIPP's safe intervals
//! (M. Phillips and M. Likhachev, ICRA 2011), shared by all searches.
//!
//! All intervals are wider by both drones' margins of time, at both ends.
//!
//! It serves to find paths: pairs, of sums only whether they may be too much, and legs off the
//! lattice count as standing still at the places next to them in turn. It knows of no zone. The
//! search asks the [`Costmap`] of zones at every step, and has it judge the path found.

use costmap::costmap::{Costmap, part_at};
use costmap::leg::{DroneId, KindId, Leg, Tick};

use crate::graph::roadmap::Vertex;

mod ask;
mod column;
mod directions;
mod pieces;
mod shape;
pub(crate) mod steps;
pub(crate) mod synchronous;
mod table;

pub(crate) use ask::{Querier, StepQuery};
use column::{OccupancyMask, StepColumn, StepRecord};
use pieces::pieces;
pub(crate) use steps::Steps;
use steps::{STILL, StepFootprint, cells};
use table::Hovering;

/// A drone's leg, as it concerns hovering at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
struct UnsafeInterval {
    began: Tick,
    clear: Tick,
    /// See [`Blocker::flown`](costmap::verdict::Blocker::flown).
    flown: [Tick; 2],
    drone: DroneId,
    /// Thousandths of a second a second; [`FORBIDDEN`].
    price: u16,
}

impl UnsafeInterval {
    /// Whether it forbids to hover there for good.
    fn closes(&self) -> bool {
        self.clear == Tick::FOREVER && self.price == FORBIDDEN
    }
}

/// The price of what may not be.
const FORBIDDEN: u16 = u16::MAX;

/// Every drone's steps.
#[derive(Clone, Debug)]
pub(crate) struct ReservationTable<'a> {
    steps: &'a Steps,
    /// By column: x first, then y.
    columns: Vec<StepColumn>,
    /// Of each, when a drone may be there.
    occupancy_masks: Vec<OccupancyMask>,
    /// By class and place, in order of beginning.
    unsafe_intervals: Vec<Vec<Vec<UnsafeInterval>>>,
    /// By class and place, from when on hovering there is forbidden for good.
    closed: Vec<Vec<Tick>>,
    /// By class, how many places that are.
    closed_count: Vec<u32>,
    /// By class and column, from when on hovering is forbidden for good at all of its places.
    closed_columns: Vec<Vec<Tick>>,
    /// By class, how many columns that are.
    whole_columns: Vec<u32>,
}

impl<'a> ReservationTable<'a> {
    /// Drones in a costmap already, each by its `legs` before they are smoothed, where these are
    /// known.
    pub(crate) fn new(
        steps: &'a Steps,
        costmap: &Costmap,
        legs: &[Vec<Leg>],
    ) -> ReservationTable<'a> {
        let [nx, ny, _] = steps.lattice.counts();
        let mut reservations = ReservationTable {
            steps,
            columns: vec![StepColumn::default(); nx * ny],
            occupancy_masks: vec![OccupancyMask::default(); nx * ny],
            unsafe_intervals: vec![
                vec![Vec::new(); steps.lattice.place_count()];
                steps.class_count()
            ],
            closed: vec![vec![Tick::FOREVER; steps.lattice.place_count()]; steps.class_count()],
            closed_count: vec![0; steps.class_count()],
            closed_columns: vec![vec![Tick::FOREVER; nx * ny]; steps.class_count()],
            whole_columns: vec![0; steps.class_count()],
        };
        for drone in 0..costmap.drone_count() as u32 {
            let known = legs.get(drone as usize).filter(|it| !it.is_empty());
            let flown = costmap.legs(DroneId(drone));
            reservations.insert(known.map_or(flown, |legs| legs));
        }
        reservations
    }

    /// Whether it knows of a place.
    pub(crate) fn knows(&self, place: Vertex) -> bool {
        (place as usize) < self.steps.lattice.place_count()
    }

    /// The class of a drone as it flies now.
    pub(crate) fn class(&self, drone: DroneId, kind: KindId) -> Option<usize> {
        self.steps.class(drone, kind)
    }

    /// A drone that asks, as it flies now.
    pub(crate) fn querier(&self, drone: DroneId, kind: KindId) -> Option<Querier> {
        let class = self.class(drone, kind)?;
        Some(Querier { drone, class })
    }

    fn column(&self, [i, j]: [i32; 2]) -> Option<usize> {
        let [nx, ny, _] = self.steps.lattice.counts();
        let inside = (0..nx as i32).contains(&i) && (0..ny as i32).contains(&j);
        inside.then(|| i as usize + nx * j as usize)
    }

    /// Adds a drone's legs: all that it reserves.
    pub(crate) fn insert(&mut self, legs: &[Leg]) {
        self.each_step(legs, |table, column, at, record| {
            table.columns[column].insert(record);
            table.occupancy_masks[column].add(&record);
            table.add_unsafe_intervals(at, &record);
        });
    }

    /// Calls `f` with every step of a drone's legs: its column, and where it begins.
    fn each_step(&mut self, legs: &[Leg], f: impl Fn(&mut Self, usize, [i32; 3], StepRecord)) {
        let mut next_part = 0;
        for (index, leg) in legs.iter().enumerate() {
            let first_part = next_part;
            next_part += 1 + part_at(leg, Tick(leg.end.0.saturating_sub(1)));
            let Some(class) = self.steps.class(leg.drone, leg.kind) else {
                continue;
            };
            let around = [index.checked_sub(1), Some(index), Some(index + 1)];
            let around = around.map(|index| index.and_then(|index| legs.get(index)));
            let [early, late] = self.steps.shifted(class, around);
            pieces(&self.steps.lattice, leg, |at, direction, [start, end]| {
                let record = StepRecord {
                    start,
                    end,
                    drone: leg.drone,
                    part: first_part + part_at(leg, start),
                    early,
                    late,
                    layer: at[2] as i16,
                    direction: direction as u8,
                    class: class as u8,
                    flying: leg.flying,
                };
                if let Some(column) = self.column([at[0], at[1]]) {
                    f(self, column, at, record);
                }
            });
        }
    }

    fn add_unsafe_intervals(&mut self, at: [i32; 3], record: &StepRecord) {
        for me in 0..self.steps.class_count() {
            self.around(me, at, record, |reservations, place, interval| {
                if interval.closes() {
                    let closed = &mut reservations.closed[me][place as usize];
                    reservations.closed_count[me] += u32::from(*closed == Tick::FOREVER);
                    *closed = interval.began.min(*closed);
                    reservations.settle_column(me, place);
                }
                let all = &mut reservations.unsafe_intervals[me][place as usize];
                // What lasts on is one interval.
                let last = all.iter().rposition(|known| known.drone == interval.drone);
                if let Some(known) = last.map(|last| &mut all[last])
                    && known.price == interval.price
                    && known.began <= interval.began
                    && interval.began <= known.clear
                {
                    known.clear = known.clear.max(interval.clear);
                    known.flown[1] = known.flown[1].max(interval.flown[1]);
                    return;
                }
                let index = all.partition_point(|known| known.began <= interval.began);
                all.insert(index, interval);
            });
        }
    }

    fn settle_column(&mut self, class: usize, place: Vertex) {
        let column = self.steps.lattice.column(place);
        let places = self.closed[class].iter().skip(column);
        let last = places.step_by(self.columns.len()).max();
        let known = &mut self.closed_columns[class][column];
        let is_whole = last.is_some_and(|last| *last != Tick::FOREVER);
        self.whole_columns[class] -= u32::from(*known != Tick::FOREVER);
        self.whole_columns[class] += u32::from(is_whole);
        *known = last.copied().unwrap_or(Tick::FOREVER);
    }

    /// Takes a drone's legs back.
    pub(crate) fn remove(&mut self, legs: &[Leg]) {
        self.each_step(legs, |table, column, at, record| {
            table.columns[column].remove(record.drone);
            table.occupancy_masks[column] = table.columns[column].occupancy_mask();
            for me in 0..table.steps.class_count() {
                table.around(me, at, &record, |table, place, _| {
                    let all = &mut table.unsafe_intervals[me][place as usize];
                    all.retain(|known| known.drone != record.drone);
                    let closing = all.iter().filter(|it| it.closes());
                    let first = closing.map(|it| it.began).min();
                    let first = first.unwrap_or(Tick::FOREVER);
                    let closed = &mut table.closed[me][place as usize];
                    let opens = *closed != Tick::FOREVER && first == Tick::FOREVER;
                    table.closed_count[me] -= u32::from(opens);
                    *closed = first;
                    table.settle_column(me, place);
                });
            }
        });
    }

    /// Calls `f` with all places at which hovering is forbidden, or costs, because of a step.
    fn around(
        &mut self,
        me: usize,
        at: [i32; 3],
        record: &StepRecord,
        mut f: impl FnMut(&mut Self, Vertex, UnsafeInterval),
    ) {
        let steps = self.steps;
        let other = usize::from(record.class);
        let direction = usize::from(record.direction);
        for Hovering { offset, span } in steps.table(me, other).hovering(direction) {
            let here = [0, 1, 2].map(|axis| at[axis] - offset[axis]);
            let Some(place) = steps.lattice.at(here) else {
                continue;
            };
            if !self.reaches([me, other], here, STILL, at, record) {
                continue;
            }
            let flown = [record.start, record.end];
            let interval = if span.is_empty() {
                UnsafeInterval {
                    began: record.start,
                    clear: record.end,
                    flown,
                    drone: record.drone,
                    price: span.price,
                }
            } else {
                let [began, clear] = steps.unsafe_time(span, record);
                UnsafeInterval {
                    began: began.before(steps.shift + u32::from(record.early)),
                    clear: clear.after(steps.shift + u32::from(record.late)),
                    flown,
                    drone: record.drone,
                    price: FORBIDDEN,
                }
            };
            f(self, place, interval);
        }
    }

    /// Whether what keeps two steps apart is there: bodies, or air that no cover stops.
    fn reaches(
        &self,
        [me, other]: [usize; 2],
        at: [i32; 3],
        direction: usize,
        others: [i32; 3],
        record: &StepRecord,
    ) -> bool {
        let footprint = |class, at, direction| {
            let by = cells(direction);
            StepFootprint { class, at, by }
        };
        let mine = footprint(me, at, direction);
        let theirs = footprint(other, others, usize::from(record.direction));
        self.steps.can_meet(&mine, &theirs, record.flying)
    }
}

#[cfg(test)]
mod tests;
