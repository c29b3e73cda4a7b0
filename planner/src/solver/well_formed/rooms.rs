//! Rooms that all endpoints leave free, and who stands around them.

use std::collections::BTreeSet;

use petgraph::unionfind::UnionFind;
use rustc_hash::FxHashSet;

use super::is_open;
use super::marks::{Marks, is_free, others};
use crate::graph::agent::Errand;
use crate::graph::lattice::Lattice;
use crate::graph::roadmap::{Roadmap, Vertex};
use crate::sipp::conflicts::synchronous::{AMONG_NEIGHBOURS, BACK, FORWARDS};

/// Places of a room that is looked around in for whoever encloses it: chosen here, a pocket has a few, and who stands
/// around a hall says nothing.
const POCKET: usize = 256;

/// Which places are joined by free steps, for one class.
pub(super) struct Rooms {
    class: usize,
    /// By place, the room; its own for those that are not free.
    room: Vec<Vertex>,
}

impl Rooms {
    pub(super) fn new(roadmap: &Roadmap, marks: &Marks, class: usize, errand: &Errand) -> Rooms {
        let count = roadmap.lattice().place_count();
        let mut joined: UnionFind<Vertex> = UnionFind::new(count);
        for place in 0..count as Vertex {
            if !is_free(marks.at(class, place), None) {
                continue;
            }
            for (axis, way) in FORWARDS.into_iter().enumerate() {
                let n = AMONG_NEIGHBOURS[way];
                let to = place.wrapping_add_signed(roadmap.lattice().strides()[n]);
                if is_open(roadmap, errand, place, n)
                    && is_free(marks.along(class, place, axis), None)
                    && is_free(marks.at(class, to), None)
                {
                    joined.union(place, to);
                }
            }
        }
        Rooms {
            class,
            room: joined.into_labeling(),
        }
    }

    /// Who stands around the smaller of the rooms in which a drone's way begins and ends; `None` if it has a way.
    pub(super) fn between(
        &self,
        roadmap: &Roadmap,
        marks: &Marks,
        errand: &Errand,
        [from, to]: [Vertex; 2],
    ) -> Option<BTreeSet<u32>> {
        let view = View {
            roadmap,
            marks,
            errand,
            class: self.class,
        };
        let near = |place: Vertex| -> FxHashSet<Vertex> {
            let own = view.look_around(place, usize::MAX, true).places;
            own.into_iter()
                .map(|place| self.room[place as usize])
                .collect()
        };
        let (first, last) = (near(from), near(to));
        if !first.is_disjoint(&last) {
            return None;
        }
        let (around, other) = (
            view.look_around(from, POCKET, false),
            view.look_around(to, POCKET, false),
        );
        let smaller =
            if other.is_whole && (!around.is_whole || other.places.len() < around.places.len()) {
                other
            } else {
                around
            };
        Some(smaller.closers)
    }
}

/// What one drone sees of the endpoints.
struct View<'a> {
    roadmap: &'a Roadmap,
    marks: &'a Marks,
    errand: &'a Errand,
    class: usize,
}

/// Places that a drone can reach.
struct Around {
    places: FxHashSet<Vertex>,
    /// Others who keep it from going on.
    closers: BTreeSet<u32>,
    /// Whether those are all.
    is_whole: bool,
}

impl View<'_> {
    /// Looks around from a place, through what others' endpoints leave free; up to the free rooms alone, or in them as well.
    fn look_around(&self, from: Vertex, most: usize, is_own_alone: bool) -> Around {
        let drone = self.errand.drone.0 as usize;
        let lattice: &Lattice = self.roadmap.lattice();
        let mut around = Around {
            places: FxHashSet::default(),
            closers: BTreeSet::new(),
            is_whole: true,
        };
        let start = self.marks.at(self.class, from);
        around.closers.extend(others(start, drone));
        if !is_free(start, Some(drone)) {
            return around;
        }
        around.places.insert(from);
        let mut open = vec![from];
        while let Some(place) = open.pop() {
            if is_own_alone && place != from && is_free(self.marks.at(self.class, place), None) {
                continue;
            }
            if around.places.len() > most {
                around.is_whole = false;
                break;
            }
            for axis in 0..3 {
                for (way, is_back) in [(FORWARDS[axis], false), (BACK[axis], true)] {
                    let n = AMONG_NEIGHBOURS[way];
                    if !is_open(self.roadmap, self.errand, place, n) {
                        continue;
                    }
                    let to = place.wrapping_add_signed(lattice.strides()[n]);
                    let begins = if is_back { to } else { place };
                    let along = self.marks.along(self.class, begins, axis);
                    let there = self.marks.at(self.class, to);
                    if is_free(along, Some(drone)) && is_free(there, Some(drone)) {
                        if around.places.insert(to) {
                            open.push(to);
                        }
                    } else {
                        around.closers.extend(others(along, drone));
                        around.closers.extend(others(there, drone));
                    }
                }
            }
        }
        around
    }
}
