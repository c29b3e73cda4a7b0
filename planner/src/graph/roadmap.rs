//! The edges through free space: a 26-connected lattice, and a petgraph of the edges to every place
//! beyond it that a drone starts from or is sent to.
//!
//! One roadmap serves all sizes of drones: each edge carries its clearance, and a drone uses those
//! that are wide enough for its body. Lattice places come first and keep their numbers, blocked or
//! not.

use std::sync::Arc;

use nalgebra::Point3;
use petgraph::graphmap::DiGraphMap;
use rayon::prelude::*;
use rustc_hash::FxBuildHasher;

use crate::graph::lattice::{AXES, BoxCount, Lattice, NEIGHBOURS, Spacing};
use crate::scenario::solid::Solids;
use crate::scenario::world::Bounds;
use links::Links;
pub(crate) use survey::{Edge, Stop, Vertex};
use survey::{Forward, Survey, is_wide};

/// What a ball of one radius can do on the lattice.
#[derive(Clone, Debug)]
struct StepsOfRadius {
    /// Of the ball, clearance included (m).
    radius_m: f64,
    /// The lattice places from which some step is blocked.
    narrow: BoxCount,
    /// By place, which of [`NEIGHBOURS`] it may step to, as bits.
    open: Vec<u32>,
}

/// Edges through free space.
#[derive(Clone, Debug)]
pub(crate) struct Roadmap {
    /// Its places keep their numbers as vertices.
    lattice: Lattice,
    /// Clearances of the lattice's own edges.
    forward: Forward,
    /// Edges to and from the other places, both directions.
    beyond: Beyond,
    /// Where the places beyond the lattice are (m).
    places_m: Vec<Point3<f64>>,
    /// For each radius asked for.
    steps: Vec<StepsOfRadius>,
    /// Up to where clearances were measured (m).
    widest_m: f64,
    /// Paths beyond the lattice, and the stops along each.
    channels: Vec<(Channel, Vec<Vertex>)>,
    /// What bodies keep out of, for corners that are cut; `None`: nothing.
    solids: Option<Arc<Solids>>,
}

/// A path through free space that no lattice has, for a ball.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Channel {
    /// Of the ball, clearance included (m).
    pub(crate) radius_m: f64,
    /// Straight pieces between these, both ends among them (m).
    pub(crate) points_m: Vec<Point3<f64>>,
}

/// Edges from and to the stops beyond the lattice, in ascending order of where they lead.
type Beyond = DiGraphMap<Vertex, Edge, FxBuildHasher>;

impl Roadmap {
    /// Connects a lattice and the stops around the obstacles; returns the vertex of each stop.
    pub(crate) fn new(
        bounds: &Bounds,
        spacing: &Spacing,
        solids: Option<&Solids>,
        stops: &[Stop],
    ) -> (Roadmap, Vec<Vertex>) {
        let points_m: Vec<Point3<f64>> = stops.iter().map(|stop| stop.point_m).collect();
        let lattice = Lattice::new(bounds, spacing, &points_m);
        let radii_m = |it: &Stop| [it.radius_m, it.radius_m + it.corner_deviation_m];
        let mut radii_m: Vec<f64> = stops.iter().flat_map(radii_m).collect();
        radii_m.sort_by(f64::total_cmp);
        radii_m.dedup();
        let survey = Survey {
            lattice: &lattice,
            solids,
            floor_z_m: bounds.min.z,
            widest_m: radii_m.last().copied().unwrap_or(0.0),
        };
        let forward = survey.forward_clearances();
        let of_radius = |&radius_m: &f64| {
            let edges = |place| around(&lattice, &forward, place);
            let blocked = |place| !edges(place).all(|(_, _, c)| is_wide(c, radius_m));
            StepsOfRadius {
                radius_m,
                narrow: BoxCount::new(&lattice, blocked),
                open: open_steps(&lattice, &forward, radius_m),
            }
        };
        let opens = |place: Vertex, radius_m: f64| {
            around(&lattice, &forward, place).any(|(_, _, c)| is_wide(c, radius_m))
        };
        let connected = || {
            let mut links = Links::new(&survey, bounds, &opens, Vec::new());
            let vertices = stops.iter().map(|stop| links.connect(stop)).collect();
            (links.places_m, links.edges, vertices)
        };
        let ((places_m, edges, vertices), steps) =
            rayon::join(connected, || radii_m.iter().map(of_radius).collect());
        let widest_m = survey.widest_m;
        let mut roadmap = Roadmap {
            lattice,
            forward,
            beyond: Beyond::default(),
            places_m,
            steps,
            widest_m,
            channels: Vec::new(),
            solids: None,
        };
        roadmap.add(edges);
        (roadmap, vertices)
    }

    /// Keeps what bodies keep out of, for corners that are cut.
    pub(crate) fn keep_solids(&mut self, solids: &Arc<Solids>) {
        self.solids = (!solids.is_empty()).then(|| solids.clone());
    }

    /// What bodies keep out of, as far as it is known here.
    pub(crate) fn solids(&self) -> Option<&Solids> {
        self.solids.as_deref()
    }

    /// The lattice within.
    pub(crate) fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Number of places.
    pub(crate) fn place_count(&self) -> usize {
        self.lattice.place_count() + self.places_m.len()
    }

    /// Whether a vertex is one of the stops beyond the lattice.
    pub(crate) fn is_stop(&self, vertex: Vertex) -> bool {
        vertex as usize >= self.lattice.place_count()
    }

    pub(crate) fn position_m(&self, vertex: Vertex) -> Point3<f64> {
        match (vertex as usize).checked_sub(self.lattice.place_count()) {
            Some(stop) => self.places_m[stop],
            None => self.lattice.position_m(vertex),
        }
    }

    /// Edges out of a vertex, in ascending order of where they lead.
    pub(crate) fn edges(&self, vertex: Vertex) -> impl Iterator<Item = (Vertex, Edge)> + '_ {
        let lengths_m = self.lattice.step_lengths_m();
        let on_lattice =
            (!self.is_stop(vertex)).then(|| around(&self.lattice, &self.forward, vertex));
        let on_lattice = on_lattice.into_iter().flatten();
        let free = on_lattice.filter(|(_, _, clearance_m)| *clearance_m > 0.0);
        free.map(move |(n, to, clearance_m)| {
            let length_m = lengths_m[AXES[n]];
            let edge = Edge {
                length_m,
                rise_m: NEIGHBOURS[n][2] as f32 * lengths_m[0],
                is_lift: false,
                clearance_m,
            };
            (to, edge)
        })
        .chain(self.edges_beyond(vertex))
    }

    /// Of these the edges that are not the lattice's own.
    pub(crate) fn edges_beyond(&self, vertex: Vertex) -> impl Iterator<Item = (Vertex, Edge)> + '_ {
        let edges = self.beyond.edges(vertex);
        edges.map(|(_, to, edge)| (to, *edge))
    }

    /// Adds edges beyond the lattice, each as (from, to).
    fn add(&mut self, edges: impl IntoIterator<Item = ((Vertex, Vertex), Edge)>) {
        for ((from, to), edge) in edges {
            self.beyond.add_edge(from, to, edge);
        }
    }

    /// What a ball of this radius (m) can do; `None` if no drone has it.
    fn steps_of(&self, radius_m: f64) -> Option<&StepsOfRadius> {
        self.steps.iter().find(|known| known.radius_m == radius_m)
    }

    /// By lattice place, the steps that a ball of this radius may take, as bits in the order of
    /// [`NEIGHBOURS`]; `None` if the radius was not asked for.
    pub(crate) fn open_steps(&self, radius_m: f64) -> Option<&[u32]> {
        Some(&self.steps_of(radius_m)?.open)
    }

    /// Lattice places where a ball of this radius cannot take every step; `None` if the radius was
    /// not asked for.
    pub(crate) fn narrow(&self, radius_m: f64) -> Option<&BoxCount> {
        Some(&self.steps_of(radius_m)?.narrow)
    }

    /// Highest radius of a body for which clearances are known (m).
    pub(crate) fn widest_m(&self) -> f64 {
        self.widest_m
    }

    /// Adds a path beyond the lattice, in pieces of a cell at most, between the places at its ends
    /// and with edges to the lattice along it. Only drones that ask for its stops use it.
    pub(crate) fn open_channel(&mut self, bounds: &Bounds, solids: &Solids, channel: &Channel) {
        let points_m = &channel.points_m;
        let (Some(&first_m), Some(&last_m)) = (points_m.first(), points_m.last()) else {
            return;
        };
        let ends = [first_m, last_m].map(|end_m| self.vertices_at(end_m));
        let cell_m = self.lattice.cell_m();
        let piece = |pair: &[Point3<f64>]| {
            let [a_m, b_m] = [pair[0], pair[1]];
            let count = ((b_m - a_m).norm() / cell_m).ceil().max(1.0);
            (1..=count as u32).map(move |k| a_m + (b_m - a_m) * (f64::from(k) / count))
        };
        let mut inner_m: Vec<Point3<f64>> = points_m.windows(2).flat_map(piece).collect();
        inner_m.pop();
        let stop = |point_m: Point3<f64>| Stop {
            point_m,
            radius_m: channel.radius_m,
            corner_deviation_m: 0.0,
            lift_m: None,
        };
        let stops: Vec<Stop> = inner_m.into_iter().map(stop).collect();
        let inner = self.linked(bounds, Some(solids), |links| {
            let inner: Vec<Vertex> = stops.iter().map(|stop| links.connect(stop)).collect();
            let [first, last] = &ends;
            let mut before = first.clone();
            for next in (inner.iter().map(|it| vec![*it])).chain([last.clone()]) {
                links.join(&before, &next);
                before = next;
            }
            inner
        });
        self.channels.push((channel.clone(), inner));
    }

    /// Whether there are paths beyond the lattice.
    pub(crate) fn has_channels(&self) -> bool {
        !self.channels.is_empty()
    }

    /// The paths beyond the lattice.
    pub(crate) fn channels(&self) -> Vec<Channel> {
        self.channels.iter().map(|(it, _)| it.clone()).collect()
    }

    /// The stops of paths beyond the lattice that a ball of this radius (m) fits along.
    pub(crate) fn channel_stops(&self, radius_m: f64) -> impl Iterator<Item = Vertex> + '_ {
        let wide = move |(it, _): &&(Channel, Vec<Vertex>)| it.radius_m >= radius_m;
        let stops = self.channels.iter().filter(wide);
        let stops = stops.flat_map(|(_, stops)| stops.iter().copied());
        stops.filter(|stop| self.is_stop(*stop))
    }

    /// Whether a vertex is a stop of a path beyond the lattice.
    pub(crate) fn is_in_channel(&self, vertex: Vertex) -> bool {
        let mut channels = self.channels.iter();
        self.is_stop(vertex) && channels.any(|(_, stops)| stops.contains(&vertex))
    }

    /// All vertices at exactly this place (m).
    fn vertices_at(&self, at_m: Point3<f64>) -> Vec<Vertex> {
        let beyond = (self.lattice.place_count()..).zip(&self.places_m);
        let beyond = beyond.filter(|(_, place_m)| **place_m == at_m);
        let beyond = beyond.map(|(vertex, _)| vertex as Vertex);
        self.lattice
            .place_at(&at_m)
            .into_iter()
            .chain(beyond)
            .collect()
    }

    /// Connects more stops; returns the vertex of each. All others keep their numbers.
    pub(crate) fn connect(
        &mut self,
        bounds: &Bounds,
        solids: Option<&Solids>,
        stops: &[Stop],
    ) -> Vec<Vertex> {
        self.linked(bounds, solids, |links| {
            stops.iter().map(|stop| links.connect(stop)).collect()
        })
    }

    /// Adds what `link` adds.
    fn linked(
        &mut self,
        bounds: &Bounds,
        solids: Option<&Solids>,
        link: impl FnOnce(&mut Links<'_>) -> Vec<Vertex>,
    ) -> Vec<Vertex> {
        let lattice = self.lattice.clone();
        let survey = Survey {
            lattice: &lattice,
            solids,
            floor_z_m: bounds.min.z,
            widest_m: self.widest_m,
        };
        let open =
            |place: Vertex, radius_m: f64| self.edges(place).any(|(_, edge)| edge.fits(radius_m));
        let mut links = Links::new(&survey, bounds, &open, self.places_m.clone());
        let vertices = link(&mut links);
        let (places_m, edges) = (links.places_m, links.edges);
        self.places_m = places_m;
        // In ascending order still: stops of later come after all others.
        self.add(edges);
        vertices
    }
}

/// Neighbours of a lattice place, in ascending order: which of [`NEIGHBOURS`] each is, and the
/// clearance of the edge there.
fn around<'a>(
    lattice: &'a Lattice,
    forward: &'a Forward,
    place: Vertex,
) -> impl Iterator<Item = (usize, Vertex, f32)> + 'a {
    let [i, j, k] = lattice.steps(place);
    NEIGHBOURS.iter().enumerate().filter_map(move |(n, d)| {
        let to = lattice.at([i + d[0], j + d[1], k + d[2]])?;
        let clearance_m = match n.checked_sub(13) {
            Some(ahead) => forward[place as usize][ahead],
            None => forward[to as usize][12 - n],
        };
        Some((n, to, clearance_m))
    })
}

/// By place, the steps that a ball of this radius (m) may take, as bits in the order of
/// [`NEIGHBOURS`].
fn open_steps(lattice: &Lattice, forward: &Forward, radius_m: f64) -> Vec<u32> {
    let of_place = |place: Vertex| {
        let is_open = |(_, _, c): &(usize, Vertex, f32)| is_wide(*c, radius_m) && *c > 0.0;
        let open = around(lattice, forward, place).filter(is_open);
        open.fold(0, |open, (n, _, _)| open | 1 << n)
    };
    (0..lattice.place_count() as Vertex)
        .into_par_iter()
        .map(of_place)
        .collect()
}

mod links;
mod survey;
#[cfg(test)]
mod tests;
