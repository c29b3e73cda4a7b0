//! Who is in the way of hovering where, and when, kept up to date leg by leg.
//!
//! Searches ask of every place they think of who is in the way there, and again from one search to the next.
//! On the lattice that is a matter of a table: a step in some direction forbids hovering at some offsets from
//! where it began, for some part of its time. So every reservation writes its intervals to the places around
//! it, and a search reads them: SIPP's safe intervals (M. Phillips and M. Likhachev, ICRA 2011), shared.
//!
//! A step is taken to be at its beginning for the first part of its time and at its end for the last. That is
//! guidance, not a verdict: pairs only, and no ways. Whoever plans with it has the [`Costmap`] judge
//! what was found.

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, KindId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict, Why};
use nalgebra::{Point3, Vector3};

use crate::lattice::Lattice;
use crate::roadmap::Vertex;

pub use habits::Habits;
use habits::{PARTS, STILL};

/// Somebody's leg, as it concerns hovering at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    drone: DroneId,
    began: Tick,
    clear: Tick,
    hold: Hold,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Hold {
    /// Forbidden.
    Forbids(Why),
    /// At a price (s/s).
    Costs(f32),
}

/// Everybody's intervals.
#[derive(Clone, Debug)]
pub struct Crowd<'a> {
    habits: &'a Habits,
    /// By class and place.
    entries: Vec<Vec<Vec<Entry>>>,
}

const WHYS: [Why; 3] = [Why::Bodies, Why::OwnLimit, Why::TheirLimit];

impl<'a> Crowd<'a> {
    /// Nobody is there yet.
    pub fn new(habits: &'a Habits) -> Crowd<'a> {
        let places = habits.lattice.place_count();
        Crowd {
            habits,
            entries: vec![vec![Vec::new(); places]; habits.classes.len()],
        }
    }

    /// Writes down what a drone's legs forbid.
    pub fn insert(&mut self, costmap: &Costmap, legs: &[Leg]) {
        self.around(costmap, legs, |entries, entry| {
            // What lasts on is one interval; whoever is there once more comes later.
            let last = entries.iter().rposition(|known| known.drone == entry.drone);
            if let Some(known) = last.map(|last| &mut entries[last])
                && known.hold == entry.hold
                && known.began <= entry.began
                && entry.began <= known.clear
            {
                known.clear = known.clear.max(entry.clear);
                return;
            }
            let at = entries.partition_point(|known| known.began <= entry.began);
            entries.insert(at, entry);
        });
    }

    /// Takes it back.
    pub fn remove(&mut self, costmap: &Costmap, legs: &[Leg]) {
        self.around(costmap, legs, |entries, entry| {
            entries.retain(|known| known.drone != entry.drone);
        });
    }

    fn around(
        &mut self,
        costmap: &Costmap,
        legs: &[Leg],
        mut change: impl FnMut(&mut Vec<Entry>, Entry),
    ) {
        let habits = self.habits;
        for leg in legs {
            let Some(other) = habits.class(leg.kind, leg.air_limit) else {
                continue;
            };
            let end_z_m = costmap.wake_end_z_m(leg);
            for (piece, way, [start, end]) in pieces(&habits.lattice, leg) {
                let from = habits.lattice.steps(piece);
                let highest_z_m = leg.from_m.z.max(leg.to_m.z);
                let ticks = |part: u32| {
                    if leg.end == Tick::FOREVER {
                        return if part == 0 { start } else { end };
                    }
                    let ticks = u64::from(end.0 - start.0) * u64::from(part);
                    // Who follows a step one cell behind it is not in its way.
                    start.after(ticks.div_ceil(u64::from(PARTS)) as u32)
                };
                for me in 0..habits.classes.len() {
                    for effect in &habits.effects[habits.table(me, other, way)] {
                        let at = [0, 1, 2].map(|axis| from[axis] + effect.offset[axis]);
                        let Some(place) = habits.lattice.at(at) else {
                            continue;
                        };
                        let own_z_m = habits.lattice.position_m(place).z;
                        let own_end_z_m = habits.wake_end_z_m[me][place as usize];
                        let reaches = [
                            true,
                            leg.flying && own_z_m >= end_z_m - 1e-6,
                            leg.flying && highest_z_m >= own_end_z_m - 1e-6,
                        ];
                        let mut span: Option<([u32; 2], Why)> = None;
                        let mut cost = 0.0;
                        for index in (0..3).filter(|index| reaches[*index]) {
                            if let Some([first, last]) = effect.spans[index] {
                                let (known, why) = span.unwrap_or(([first, last], WHYS[index]));
                                span = Some(([known[0].min(first), known[1].max(last)], why));
                            }
                            if index > 0 {
                                cost += effect.prices[index - 1];
                            }
                        }
                        let ([first, last], hold) = match span {
                            Some((span, why)) => (span, Hold::Forbids(why)),
                            None if cost > 0.0 => ([0, PARTS], Hold::Costs(cost)),
                            None => continue,
                        };
                        let entry = Entry {
                            drone: leg.drone,
                            began: ticks(first),
                            clear: ticks(last),
                            hold,
                        };
                        change(&mut self.entries[me][place as usize], entry);
                    }
                }
            }
        }
    }

    /// Whether it knows of drones of this kind at this place.
    pub fn knows(&self, place: Vertex) -> bool {
        (place as usize) < self.habits.lattice.place_count()
    }

    fn at(&self, kind: KindId, air_limit: f64, place: Vertex) -> &[Entry] {
        self.habits
            .class(kind, air_limit)
            .map_or(&[], |class| &self.entries[class][place as usize])
    }

    /// Until when a place is free to hover at from a moment on, and when it is again.
    pub fn free_until(&self, kind: KindId, air_limit: f64, place: Vertex, from: Tick) -> (Tick, Tick) {
        let mut entries = self.at(kind, air_limit, place).iter();
        let next = entries.find(|it| it.clear > from && matches!(it.hold, Hold::Forbids(_)));
        next.map_or((Tick::FOREVER, Tick::FOREVER), |it| (it.began.max(from), it.clear))
    }

    /// Adds who is in the way of hovering at a place between two moments, and what it costs.
    pub fn stay(
        &self,
        kind: KindId,
        air_limit: f64,
        place: Vertex,
        [from, to]: [Tick; 2],
        verdict: &mut Verdict,
    ) {
        self.during(kind, air_limit, place, [from, to], 0, verdict);
    }

    /// Adds who is in the way of a step, and what it costs. Their times are those of its departure.
    pub fn step(
        &self,
        kind: KindId,
        air_limit: f64,
        [here, there]: [Vertex; 2],
        [from, to]: [Tick; 2],
        verdict: &mut Verdict,
    ) {
        let Some(class) = self.habits.class(kind, air_limit) else {
            return;
        };
        let ticks = f64::from(to.0 - from.0);
        let arrives = (self.habits.lingers[class] * ticks).ceil() as u32;
        let leaves = ((1.0 - self.habits.lingers[class]) * ticks).floor() as u32;
        let first = [from, from.after(leaves.max(1))];
        self.during(kind, air_limit, here, first, 0, verdict);
        let last = [from.after(arrives.min(to.0 - from.0 - 1)), to];
        self.during(kind, air_limit, there, last, arrives, verdict);
    }

    #[allow(clippy::too_many_arguments, reason = "one place and one time, of one class")]
    fn during(
        &self,
        kind: KindId,
        air_limit: f64,
        place: Vertex,
        [from, to]: [Tick; 2],
        shift: u32,
        verdict: &mut Verdict,
    ) {
        for it in self.at(kind, air_limit, place) {
            if it.began >= to {
                break;
            }
            if it.clear <= from {
                continue;
            }
            match it.hold {
                Hold::Forbids(why) => {
                    verdict.blockers.push(Blocker {
                        drone: it.drone,
                        why,
                        began: Tick(it.began.0.saturating_sub(shift)),
                        clear: if it.clear == Tick::FOREVER {
                            Tick::FOREVER
                        } else {
                            Tick(it.clear.0.saturating_sub(shift))
                        },
                    });
                }
                Hold::Costs(cost) if to != Tick::FOREVER => {
                    let seconds = it.clear.min(to).seconds() - it.began.max(from).seconds();
                    verdict.price_s += f64::from(cost) * seconds;
                }
                _ => {}
            }
        }
    }
}

/// A leg as steps on the lattice: where each begins, its direction, and when. A leg off the lattice counts as
/// staying at the places around it in turn.
fn pieces(lattice: &Lattice, leg: &Leg) -> Vec<(Vertex, usize, [Tick; 2])> {
    let nearest = |at_m: &Point3<f64>| {
        let half_m = Vector3::from([0.5 * lattice.cell_m(); 3]);
        let cell = lattice.cell_of(&(at_m + half_m));
        let counts = lattice.counts();
        lattice.at([0, 1, 2].map(|axis| cell[axis].clamp(0, counts[axis] as i32 - 1)))
    };
    let exact = (lattice.place_at(&leg.from_m), lattice.place_at(&leg.to_m));
    if let (Some(from), Some(to)) = exact {
        let (a, b) = (lattice.steps(from), lattice.steps(to));
        let d = [0, 1, 2].map(|axis| b[axis] - a[axis] + 1);
        if d.iter().all(|d| (0..3).contains(d)) {
            let way = (d[0] + 3 * d[1] + 9 * d[2]) as usize;
            return vec![(from, way, [leg.start, leg.end])];
        }
    }
    let length_m = (leg.to_m - leg.from_m).norm();
    let count = (2.0 * length_m / lattice.cell_m()).ceil().max(1.0) as u32;
    if leg.end == Tick::FOREVER || count == 1 {
        let place = nearest(&nalgebra::center(&leg.from_m, &leg.to_m));
        return Vec::from_iter(place.map(|place| (place, STILL, [leg.start, leg.end])));
    }
    let ticks = leg.end.0 - leg.start.0;
    (0..count)
        .filter_map(|k| {
            let [start, end] = [k, k + 1].map(|k| leg.start.after(ticks * k / count));
            let part = leg.between(start, end);
            let place = nearest(&nalgebra::center(&part.from_m, &part.to_m))?;
            (start < end).then_some((place, STILL, [start, end]))
        })
        .collect()
}

mod habits;
#[cfg(test)]
mod tests;
