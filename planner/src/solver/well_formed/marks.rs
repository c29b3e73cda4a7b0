//! What everybody's endpoints leave free: places to hover at, and steps along the axes between them.

use super::Endpoint;
use crate::graph::roadmap::Vertex;
use crate::plan::outcome::{Offence, OffenceKind};
use crate::sipp::conflicts::steps::Pace;
use crate::sipp::conflicts::synchronous::{FORWARDS, MOST_LOADS, STAYS, SynchronousSteps, WAYS};
use crate::solver::prepare::Job;

/// A place, and the steps from it to the next place along x, y and z.
const SLOTS: usize = 4;
const NOBODY: u32 = u32::MAX;
/// More than two.
const MANY: u32 = u32::MAX - 1;

/// By class and slot, whose endpoints keep it from being free.
pub(super) struct Marks {
    closers: Vec<Vec<[u32; 2]>>,
}

/// Everybody's endpoints, by column of the floor.
struct Columns<'a> {
    ends: &'a [Endpoint],
    at: Vec<[i32; 3]>,
    counts: [usize; 3],
    columns: Vec<Vec<u32>>,
}

impl Marks {
    /// Also says whose goals and others' starts exclude one another.
    pub(super) fn new(
        job: &Job,
        synchronous: &SynchronousSteps<'_>,
        ends: &[Endpoint],
    ) -> (Marks, Vec<Offence>) {
        let lattice = job.roadmap.lattice();
        let columns = Columns::new(job, ends);
        let mut offences = Vec::new();
        let mut filled = vec![0; ends.len()];
        for index in 0..ends.len() {
            columns.around(synchronous, index, |other, met| {
                let (end, other) = (&ends[index], &ends[other]);
                match met {
                    Some([on_me, _]) => filled[index] += i32::from(on_me),
                    None if end.is_goal && !other.is_goal => offences.push(Offence {
                        drone: end.drone,
                        other: other.drone,
                        kind: OffenceKind::GoalAtStart,
                    }),
                    None => {}
                }
            });
        }
        let classes = synchronous.steps.class_count();
        let slots = SLOTS * lattice.place_count();
        let mut marks = Marks {
            closers: vec![vec![[NOBODY; 2]; slots]; classes],
        };
        for class in 0..classes {
            let mut loads = vec![0_u16; slots];
            let beside: Vec<Vec<_>> = (0..classes)
                .map(|hovering| synchronous.beside(class, hovering).collect())
                .collect();
            for (end, filled) in ends.iter().zip(&filled) {
                let there = lattice.steps(end.place);
                let hovers = Pace {
                    class: end.class,
                    at: there,
                    by: WAYS[STAYS],
                };
                for &(way, by) in &beside[end.class] {
                    let Some(slot) = slot_of(way) else { continue };
                    let at = [0, 1, 2].map(|axis| there[axis] + by[axis]);
                    let Some(place) = lattice.at(at) else {
                        continue;
                    };
                    let slot = SLOTS * place as usize + slot;
                    let passes = Pace {
                        class,
                        at,
                        by: WAYS[way],
                    };
                    match synchronous.meet(&passes, &hovers, [way, STAYS]) {
                        Some([on_me, on_them]) => {
                            loads[slot] = loads[slot].saturating_add(u16::from(on_me));
                            if on_them > 0 && filled + i32::from(on_them) > MOST_LOADS {
                                marks.close(class, slot, end.drone);
                            }
                        }
                        None => marks.close(class, slot, end.drone),
                    }
                }
            }
            for (slot, load) in loads.into_iter().enumerate() {
                if i32::from(load) > MOST_LOADS {
                    marks.closers[class][slot][1] = MANY;
                }
            }
        }
        (marks, offences)
    }

    fn close(&mut self, class: usize, slot: usize, drone: usize) {
        let [first, second] = &mut self.closers[class][slot];
        let drone = drone as u32;
        if *first == NOBODY {
            *first = drone;
        } else if *first != drone && *second == NOBODY {
            *second = drone;
        } else if *first != drone && *second != drone {
            *second = MANY;
        }
    }

    /// Those who keep a place from being free.
    pub(super) fn at(&self, class: usize, place: Vertex) -> [u32; 2] {
        self.closers[class][SLOTS * place as usize]
    }

    /// Those who keep the step from a place to the next along an axis from being free.
    pub(super) fn along(&self, class: usize, place: Vertex, axis: usize) -> [u32; 2] {
        self.closers[class][SLOTS * place as usize + 1 + axis]
    }
}

/// Whether nobody is among those, or the drone alone.
pub(super) fn is_free(closers: [u32; 2], drone: Option<usize>) -> bool {
    let own = |closer: u32| drone.is_some_and(|drone| drone as u32 == closer);
    closers
        .into_iter()
        .all(|closer| closer == NOBODY || own(closer))
}

/// Those among them who are drones, and others.
pub(super) fn others(closers: [u32; 2], drone: usize) -> impl Iterator<Item = u32> {
    let named = move |closer: &u32| *closer < MANY && *closer != drone as u32;
    closers.into_iter().filter(named)
}

fn slot_of(way: usize) -> Option<usize> {
    if way == STAYS {
        return Some(0);
    }
    // Steps back are those of the place that they lead to.
    let axis = FORWARDS.iter().position(|forwards| *forwards == way);
    axis.map(|axis| axis + 1)
}

impl<'a> Columns<'a> {
    fn new(job: &Job, ends: &'a [Endpoint]) -> Columns<'a> {
        let lattice = job.roadmap.lattice();
        let counts = lattice.counts();
        let mut columns = vec![Vec::new(); counts[0] * counts[1]];
        for (index, end) in ends.iter().enumerate() {
            columns[end.place as usize % (counts[0] * counts[1])].push(index as u32);
        }
        Columns {
            ends,
            at: ends.iter().map(|end| lattice.steps(end.place)).collect(),
            counts,
            columns,
        }
    }

    /// Calls `f` with all endpoints of others near one of them, and what hovering at both does.
    fn around(
        &self,
        synchronous: &SynchronousSteps<'_>,
        index: usize,
        mut f: impl FnMut(usize, Option<[u8; 2]>),
    ) {
        let pace = |index: usize| Pace {
            class: self.ends[index].class,
            at: self.at[index],
            by: WAYS[STAYS],
        };
        let mine = pace(index);
        let [nx, ny, _] = self.counts;
        for class in 0..synchronous.steps.class_count() {
            for aside in synchronous.near(mine.class, class, STAYS) {
                let [i, j] = [mine.at[0] + aside[0], mine.at[1] + aside[1]];
                if i < 0 || j < 0 || i as usize >= nx || j as usize >= ny {
                    continue;
                }
                for &other in &self.columns[i as usize + nx * j as usize] {
                    let other = other as usize;
                    let theirs = pace(other);
                    if theirs.class == class && self.ends[other].drone != self.ends[index].drone {
                        f(other, synchronous.meet(&mine, &theirs, [STAYS; 2]));
                    }
                }
            }
        }
    }
}
