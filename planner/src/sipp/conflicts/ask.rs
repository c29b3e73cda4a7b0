//! What a search asks of the reservation table.

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Tick};
use costmap::verdict::{Blocker, IncomingLoad, Verdict, Why, peak};

use super::column::spells;
use super::directions::index;
use super::steps::{DelaySpan, LOADS, STILL};
use super::table::Near;
use super::{FORBIDDEN, ReservationTable, StepRecord, UnsafeInterval};
use crate::graph::roadmap::Vertex;

/// What wakes may add up to here (parts of `LOADS`): chosen here, a fifth more than a budget, since
/// each counts as at its nearest: of 6 038 that add up to nine tenths and more in `plan bench hall
/// --drones 1000 --seeds 1` (ca21ed3), 6 035 were free.
const MOST_LOADS: u32 = 300;

/// Where more than this share of closed places is in columns closed from bottom to top, one may as
/// well look at the floor alone: chosen here.
const WHOLE_SHARE: f64 = 0.8;

/// The searching drone. Its own legs, begun ones included, do not block it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Querier {
    pub(crate) drone: DroneId,
    pub(crate) class: usize,
}

/// A step that is generated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct StepQuery {
    /// The drone.
    pub(crate) by: Querier,
    /// From where and to where: neighbours on the lattice.
    pub(crate) ends: [Vertex; 2],
    /// From when and until when.
    pub(crate) time: [Tick; 2],
    /// By how much it may be ahead of that, beyond the margins (ticks).
    pub(crate) early: u32,
    /// By how much it may be behind that, beyond the margins (ticks).
    pub(crate) late: u32,
}

impl StepQuery {
    /// When others may be under way that matter to it, or it to them, within margins of time, and
    /// while air lasts: its own, and theirs (ticks).
    fn window(&self, shift: u32, [own, others]: [u32; 2]) -> [Tick; 2] {
        let [from, until] = self.time;
        [from.before(shift + others), until.after(shift + own)]
    }
}

impl ReservationTable<'_> {
    /// The share of all places that are closed for good at some time, to a class.
    pub(crate) fn closed_share(&self, class: usize) -> f64 {
        f64::from(self.closed_count[class]) / self.steps.lattice.place_count() as f64
    }

    /// By place, from when on hovering there is forbidden for good; [`Tick::FOREVER`] if it is not.
    pub(crate) fn closed_from(&self, class: usize) -> &[Tick] {
        &self.closed[class]
    }

    /// By column, from when on hovering is forbidden for good at all of its places, if nearly all
    /// closed places are in such columns.
    pub(crate) fn closed_columns(&self, class: usize) -> Option<&[Tick]> {
        let tall = self.steps.lattice.counts()[2] as f64;
        let (whole, all) = (self.whole_columns[class], self.closed_count[class]);
        let share = f64::from(whole) * tall / f64::from(all.max(1));
        (share > WHOLE_SHARE).then_some(&self.closed_columns[class])
    }

    /// When a place is taken by others, in order of beginning.
    fn unsafe_intervals_for(
        &self,
        by: Querier,
        place: Vertex,
    ) -> impl Iterator<Item = &UnsafeInterval> {
        let intervals = self.unsafe_intervals[by.class][place as usize].iter();
        intervals.filter(move |it| it.drone != by.drone)
    }

    /// Until when a place is free to hover at from a moment on but for evicted drones, and when it
    /// is again.
    pub(crate) fn free_until(
        &self,
        by: Querier,
        place: Vertex,
        from: Tick,
        is_evicted: impl Fn(DroneId) -> bool,
    ) -> (Tick, Tick) {
        let mut intervals = self.unsafe_intervals_for(by, place);
        let next =
            intervals.find(|it| it.clear > from && it.price == FORBIDDEN && !is_evicted(it.drone));
        next.map_or((Tick::FOREVER, Tick::FOREVER), |it| {
            (it.began.max(from), it.clear)
        })
    }

    /// Adds the blockers of hovering at a place between two moments, and what it costs.
    pub(crate) fn stay(
        &self,
        by: Querier,
        place: Vertex,
        [from, to]: [Tick; 2],
        verdict: &mut Verdict,
    ) {
        for it in self.unsafe_intervals_for(by, place) {
            if it.began >= to {
                break;
            }
            if it.clear <= from {
                continue;
            }
            if it.price == FORBIDDEN {
                verdict
                    .blockers
                    .push(blocker(it.drone, [it.began, it.clear], it.flown));
            } else if to != Tick::FOREVER {
                let seconds = it.clear.min(to).seconds() - it.began.max(from).seconds();
                verdict.price_s += f64::from(it.price) / 1000.0 * seconds;
            }
        }
    }

    /// Adds the blockers of being at a place at the end of a step. Their times are those of its
    /// departure.
    pub(crate) fn arrive(
        &self,
        by: Querier,
        place: Vertex,
        [from, to]: [Tick; 2],
        verdict: &mut Verdict,
    ) {
        let ticks = to.0 - from.0;
        for it in self.unsafe_intervals_for(by, place) {
            if it.began > to {
                break;
            }
            if it.clear > to && it.price == FORBIDDEN {
                let clear = match it.clear {
                    Tick::FOREVER => Tick::FOREVER,
                    clear => Tick(clear.0 - ticks),
                };
                let began = Tick(it.began.0.saturating_sub(ticks));
                verdict
                    .blockers
                    .push(blocker(it.drone, [began, clear], it.flown));
            }
        }
    }

    /// Adds the blockers of a step, and what it costs. Their times are those of its departure.
    ///
    /// `false` if no drone blocks it, but wakes may add up to too much: it has to be judged in
    /// full.
    pub(crate) fn step(&self, costmap: &Costmap, query: &StepQuery, verdict: &mut Verdict) -> bool {
        let mut loads = Loads {
            is_smooth: self.steps.most_ahead() > 0,
            ..Loads::default()
        };
        let lattice = &self.steps.lattice;
        let [at, to] = query.ends.map(|place| lattice.steps(place));
        let direction = index([0, 1, 2].map(|axis| to[axis] - at[axis]));
        let shift = self.steps.shift + self.steps.most_ahead();
        for other in 0..self.steps.class_count() {
            let table = self.steps.table(query.by.class, other);
            let window = query.window(shift, table.longest());
            let spells = spells(window);
            let mut look_at = |near: &Near, record: &StepRecord| {
                let [dx, dy] = near.aside;
                let dz = i32::from(record.layer) - at[2];
                let is_far = dz.abs() > table.shape.extent.layers;
                if usize::from(record.class) != other || is_far || record.drone == query.by.drone {
                    return;
                }
                let directions = [direction, usize::from(record.direction)];
                let lasts = table.lasts(directions, dz);
                let now = query.window(shift, lasts);
                if record.end <= now[0] || now[1] <= record.start {
                    return;
                }
                let span = table.span(directions, near, dz);
                let there = [at[0] + dx, at[1] + dy, at[2] + dz];
                if !self.is_against(query, [at, there], direction, &span, record, verdict) {
                    let late = [shift, shift + lasts[1]];
                    loads.add(costmap, (now, late), &span, record);
                }
            };
            for (near, column) in self.columns_near(table.near(direction), at) {
                if self.occupancy_masks[column].may_be_passed(spells) {
                    let passing = self.columns[column].passing(window);
                    passing.for_each(|record| look_at(near, record));
                }
            }
            for (near, column) in self.columns_near(table.near_still(direction), at) {
                if self.occupancy_masks[column].is_held(window[1]) {
                    let staying = self.columns[column].staying(window[1]);
                    staying.for_each(|record| look_at(near, record));
                }
            }
        }
        !verdict.blockers.is_empty() || loads.are_within_budget(query.time)
    }

    /// Those of the columns beside a place that there are.
    fn columns_near<'b>(
        &self,
        near: &'b [Near],
        [x, y, _]: [i32; 3],
    ) -> impl Iterator<Item = (&'b Near, usize)> {
        near.iter().filter_map(move |near| {
            let [dx, dy] = near.aside;
            Some((near, self.column([x + dx, y + dy])?))
        })
    }

    /// Whether a drone's step conflicts, or would if its wake reached; adds that, or what it costs.
    fn is_against(
        &self,
        query: &StepQuery,
        [at, there]: [[i32; 3]; 2],
        direction: usize,
        span: &DelaySpan,
        record: &StepRecord,
        verdict: &mut Verdict,
    ) -> bool {
        let (me, other) = (query.by.class, usize::from(record.class));
        let others = usize::from(record.direction);
        let [from, until] = query.time;
        if span.is_empty() {
            if span.price > 0 {
                let seconds = record.end.min(until).seconds() - record.start.max(from).seconds();
                verdict.price_s += f64::from(span.price) / 1000.0 * seconds.max(0.0);
            }
            return false;
        }
        // Departures from `began` until `clear` are too near.
        let (began, clear) = if others == STILL {
            (
                i64::from(record.start.0) - i64::from(span.to),
                if record.end == Tick::FOREVER {
                    i64::from(u32::MAX)
                } else {
                    i64::from(record.end.0) - i64::from(span.from)
                },
            )
        } else {
            let start = i64::from(record.start.0);
            (start + i64::from(span.from), start + i64::from(span.to))
        };
        let shift = self.steps.shift;
        let sooner = i64::from(shift + query.late + u32::from(record.early));
        let longer = i64::from(shift + query.early + u32::from(record.late));
        let (began, clear) = (began - sooner, (clear + longer).min(i64::from(u32::MAX)));
        let departs = i64::from(from.0);
        if departs <= began || clear <= departs {
            return false;
        }
        if !self.reaches([me, other], at, direction, there, record) {
            return true;
        }
        let departures = [Tick(began.max(0) as u32), Tick(clear as u32)];
        let flown = [record.start, record.end];
        verdict
            .blockers
            .push(blocker(record.drone, departures, flown));
        true
    }
}

/// A drone that blocks from a tick until another; the tables do not tell how.
fn blocker(drone: DroneId, [began, clear]: [Tick; 2], flown: [Tick; 2]) -> Blocker {
    Blocker {
        drone,
        why: Why::OwnLimit,
        began,
        clear,
        flown,
    }
}

/// What wakes add up to around a step.
#[derive(Default)]
struct Loads {
    /// What is flown is in other parts than the steps.
    is_smooth: bool,
    /// Loads on the stepping drone, and when.
    on_me: Vec<IncomingLoad>,
    sum: u32,
    is_too_much_for_others: bool,
}

impl Loads {
    /// Those of a step that is under way at some time of a window, and comes earlier and lasts
    /// longer by so many ticks.
    fn add(
        &mut self,
        costmap: &Costmap,
        (window, [before, after]): ([Tick; 2], [u32; 2]),
        span: &DelaySpan,
        record: &StepRecord,
    ) {
        if span.on_first > 0 {
            let load = u32::from(span.on_first);
            self.on_me.push(IncomingLoad {
                from: record.drone,
                start: record.start.before(before),
                end: record.end.after(after),
                load,
            });
            self.sum += load;
        }
        if span.on_second > 0 && !self.is_too_much_for_others {
            let most = f64::from(MOST_LOADS) - f64::from(span.on_second);
            // Mostly it is little at any time.
            let (drone, part) = (record.drone, record.part);
            self.is_too_much_for_others = match self.is_smooth {
                true => {
                    let lasts = [record.start.max(window[0]), record.end.min(window[1])];
                    costmap.is_filled_during(drone, lasts, most / LOADS)
                }
                false => {
                    costmap.filled(drone, part) * LOADS > most
                        && costmap.filled_between(drone, part, window) * LOADS > most
                }
            };
        }
    }

    fn are_within_budget(&mut self, time: [Tick; 2]) -> bool {
        !self.is_too_much_for_others && (self.sum <= MOST_LOADS || self.peak(time) <= MOST_LOADS)
    }

    /// The most that they are at any moment of a time.
    fn peak(&mut self, [from, until]: [Tick; 2]) -> u32 {
        self.on_me.sort_by_key(|it| it.from);
        peak(&self.on_me, from, until) as u32
    }
}
