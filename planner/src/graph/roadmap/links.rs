//! Stops beyond the lattice, and the edges between them and the places around.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::survey::{CLEARANCE_TOLERANCE_M, Edge, Stop, Survey, Vertex};
use crate::scenario::world::Bounds;

/// The stops beyond the lattice and their edges, while a roadmap is being made.
pub(super) struct Links<'a> {
    /// Measures clearances.
    survey: &'a Survey<'a>,
    /// No lift leads higher than these.
    bounds: &'a Bounds,
    /// Whether a body of some radius can leave a lattice place at all.
    open: &'a dyn Fn(Vertex, f64) -> bool,
    /// Places beyond the lattice (m), by vertex from its number of places on.
    pub(super) places_m: Vec<Point3<f64>>,
    known: BTreeMap<[u64; 5], Vertex>,
    /// Edges found, in both directions.
    pub(super) edges: BTreeMap<(Vertex, Vertex), Edge>,
}

impl<'a> Links<'a> {
    /// Goes on from places that are there already.
    pub(super) fn new(
        survey: &'a Survey<'a>,
        bounds: &'a Bounds,
        open: &'a dyn Fn(Vertex, f64) -> bool,
        places_m: Vec<Point3<f64>>,
    ) -> Links<'a> {
        Links {
            survey,
            bounds,
            open,
            places_m,
            known: BTreeMap::new(),
            edges: BTreeMap::new(),
        }
    }

    /// The vertex of a stop: a lattice place that is exactly there, or a new place with edges to
    /// those around.
    pub(super) fn connect(&mut self, stop: &Stop) -> Vertex {
        let lattice = self.survey.lattice;
        if stop.lift_m.is_none()
            && let Some(place) = lattice.place_at(&stop.point_m)
            && (self.open)(place, stop.radius_m)
        {
            return place;
        }
        let p = stop.point_m;
        let key = [p.x, p.y, p.z, stop.radius_m, stop.lift_m.unwrap_or(0.0)].map(f64::to_bits);
        if let Some(&vertex) = self.known.get(&key) {
            return vertex;
        }
        let vertex = self.add(p);
        self.known.insert(key, vertex);
        let Some(lift_m) = stop.lift_m else {
            self.link_to_lattice(vertex, stop);
            return vertex;
        };
        if let Some(lifted) = self.lift(stop, lift_m) {
            let above = self.connect(&lifted);
            let edge = Edge {
                is_lift: true,
                ..edge(stop.point_m, lifted.point_m, stop.radius_m)
            };
            self.link(vertex, above, edge);
        }
        vertex
    }

    /// A new vertex at a point (m).
    fn add(&mut self, point_m: Point3<f64>) -> Vertex {
        self.places_m.push(point_m);
        (self.survey.lattice.place_count() + self.places_m.len() - 1) as Vertex
    }

    /// The lowest place straight above, at least so far (m), where the body is as clear as it must
    /// be.
    fn lift(&self, stop: &Stop, lift_m: f64) -> Option<Stop> {
        /// Chosen here: finer than any clearance worth asking for.
        const RISE_M: f64 = 0.02;
        let clear_m = self.survey.clearance_m(stop.point_m, stop.point_m);
        let least_m = clear_m.min(stop.radius_m) - CLEARANCE_TOLERANCE_M;
        let mut point_m = stop.point_m;
        point_m.z += lift_m;
        while point_m.z <= self.bounds.max.z {
            // It may leave what it stands on, but come closer to nothing than that, or than it may.
            if self.survey.clearance_m(stop.point_m, point_m) < least_m {
                return None;
            }
            if self.survey.clearance_m(point_m, point_m) >= stop.radius_m {
                return Some(Stop {
                    point_m,
                    lift_m: None,
                    ..*stop
                });
            }
            point_m.z += RISE_M;
        }
        None
    }

    /// Edges to the corners of the stop's cell or, where one of them is blocked, to those around as
    /// well.
    fn link_to_lattice(&mut self, vertex: Vertex, stop: &Stop) {
        let lattice = self.survey.lattice;
        let [i, j, k] = lattice.cell_of(&stop.point_m);
        let mut linked = 0;
        for (low, high) in [(0, 1), (-1, 2), (-2, 3)] {
            let mut open = true;
            for [dx, dy, dz] in cube(low, high) {
                let inner = [dx, dy, dz].iter().all(|d| (low + 1..high).contains(d));
                if low < 0 && inner {
                    continue;
                }
                let Some(to) = lattice.at([i + dx, j + dy, k + dz]) else {
                    continue;
                };
                let to_m = lattice.position_m(to);
                let clearance_m = self.survey.clearance_m(stop.point_m, to_m).min(
                    (to_m.z - self.survey.floor_z_m).max(stop.point_m.z - self.survey.floor_z_m),
                );
                if clearance_m + CLEARANCE_TOLERANCE_M < stop.radius_m {
                    open = false;
                    continue;
                }
                self.link(vertex, to, edge(stop.point_m, to_m, clearance_m));
                linked += 1;
            }
            if open && linked > 0 {
                return;
            }
        }
    }

    /// Edges between all of some vertices and all of others.
    pub(super) fn join(&mut self, some: &[Vertex], others: &[Vertex]) {
        for (&a, &b) in some.iter().flat_map(|a| others.iter().map(move |b| (a, b))) {
            let [a_m, b_m] = [a, b].map(|vertex| self.place_m(vertex));
            let clearance_m = self.survey.clearance_m(a_m, b_m);
            self.link(a, b, edge(a_m, b_m, clearance_m));
        }
    }

    fn place_m(&self, vertex: Vertex) -> Point3<f64> {
        let lattice = self.survey.lattice;
        match (vertex as usize).checked_sub(lattice.place_count()) {
            Some(stop) => self.places_m[stop],
            None => lattice.position_m(vertex),
        }
    }

    /// An edge in both directions.
    fn link(&mut self, a: Vertex, b: Vertex, edge: Edge) {
        self.edges.insert((a, b), edge);
        self.edges.insert((b, a), edge.reversed());
    }
}

/// From one point to another (m), of this clearance (m).
fn edge(a_m: Point3<f64>, b_m: Point3<f64>, clearance_m: f64) -> Edge {
    Edge {
        length_m: (b_m - a_m).norm() as f32,
        rise_m: (b_m.z - a_m.z) as f32,
        is_lift: false,
        clearance_m: clearance_m as f32,
    }
}

/// All offsets with coordinates from `low` to `high`, x fastest.
fn cube(low: i32, high: i32) -> impl Iterator<Item = [i32; 3]> {
    (low..=high)
        .flat_map(move |z| (low..=high).flat_map(move |y| (low..=high).map(move |x| [x, y, z])))
}
