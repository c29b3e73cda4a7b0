//! The ways through free space: a 26-connected lattice, and a petgraph of the ways to every place
//! beyond it that a drone starts from or is sent to.
//!
//! One roadmap serves all sizes of drones: each way carries its clearance, and a drone uses those
//! that are wide enough for its body. Lattice places come first and keep their numbers, blocked or
//! not.

use nalgebra::Point3;
use petgraph::graphmap::DiGraphMap;
use rayon::prelude::*;
use rustc_hash::FxBuildHasher;

use crate::graph::lattice::{AXES, BoxCount, Lattice, NEIGHBOURS};
use crate::scenario::solid::Solids;
use crate::scenario::world::Bounds;
use links::Links;

/// A place in a [`Roadmap`].
pub(crate) type Vertex = u32;

/// Clearances are kept to a tenth of a millimetre, below what the verifier forgives (m).
const CLEARANCE_TOLERANCE_M: f64 = 1e-4;

/// A straight way between two places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Way {
    /// m.
    pub(crate) length_m: f32,
    /// Distance to the nearest obstacle, and of its ends to the floor (m); capped at what the
    /// largest drone needs.
    pub(crate) clearance_m: f32,
}

impl Way {
    /// Whether a ball of this radius fits all along.
    pub(crate) fn fits(&self, radius_m: f64) -> bool {
        is_wide(self.clearance_m, radius_m)
    }
}

/// Whether a way of this clearance (m) holds a ball of this radius (m).
fn is_wide(clearance_m: f32, radius_m: f64) -> bool {
    f64::from(clearance_m) + CLEARANCE_TOLERANCE_M >= radius_m
}

/// What a ball of one radius can do on the lattice.
#[derive(Debug)]
struct StepsOfRadius {
    /// Of the ball, clearance included (m).
    radius_m: f64,
    /// The lattice places from which some step is blocked.
    narrow: BoxCount,
    /// By place, which of [`NEIGHBOURS`] it may step to, as bits.
    open: Vec<u32>,
}

/// Ways through free space.
#[derive(Debug)]
pub(crate) struct Roadmap {
    /// Its places keep their numbers as vertices.
    lattice: Lattice,
    /// Clearances of the lattice's own ways.
    forward: Forward,
    /// Ways to and from the other places, both directions.
    beyond: Beyond,
    /// Where the places beyond the lattice are (m).
    places_m: Vec<Point3<f64>>,
    /// For each radius asked for.
    steps: Vec<StepsOfRadius>,
    /// Up to where clearances were measured (m).
    widest_m: f64,
}

/// Ways from and to the stops beyond the lattice, in ascending order of where they lead.
type Beyond = DiGraphMap<Vertex, Way, FxBuildHasher>;

/// A place beyond the lattice that a drone must be able to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stop {
    /// m.
    pub(crate) point_m: Point3<f64>,
    /// Radius of the ball that must stay clear on the ways from and to here (m).
    pub(crate) radius_m: f64,
    /// Smaller clearance forgiven on the way straight up from here: the drone stands on something.
    pub(crate) grounded: bool,
}

impl Roadmap {
    /// Connects the lattice and the stops around the obstacles; returns the vertex of each stop.
    pub(crate) fn new(
        bounds: &Bounds,
        cell_m: f64,
        solids: Option<&Solids>,
        stops: &[Stop],
    ) -> (Roadmap, Vec<Vertex>) {
        let points_m: Vec<Point3<f64>> = stops.iter().map(|stop| stop.point_m).collect();
        let lattice = Lattice::new(bounds, cell_m, &points_m);
        let mut radii_m: Vec<f64> = stops.iter().map(|stop| stop.radius_m).collect();
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
            let ways = |place| around(&lattice, &forward, place);
            let blocked = |place| !ways(place).all(|(_, _, c)| is_wide(c, radius_m));
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
            (links.places_m, links.ways, vertices)
        };
        let ((places_m, ways, vertices), steps) =
            rayon::join(connected, || radii_m.iter().map(of_radius).collect());
        let widest_m = survey.widest_m;
        let mut roadmap = Roadmap {
            lattice,
            forward,
            beyond: Beyond::default(),
            places_m,
            steps,
            widest_m,
        };
        roadmap.add(ways);
        (roadmap, vertices)
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

    /// Where a vertex is (m).
    pub(crate) fn position_m(&self, vertex: Vertex) -> Point3<f64> {
        match (vertex as usize).checked_sub(self.lattice.place_count()) {
            Some(stop) => self.places_m[stop],
            None => self.lattice.position_m(vertex),
        }
    }

    /// Ways out of a vertex, in ascending order of where they lead.
    pub(crate) fn ways(&self, vertex: Vertex) -> impl Iterator<Item = (Vertex, Way)> + '_ {
        let lengths_m = self.lattice.step_lengths_m();
        let on_lattice =
            (!self.is_stop(vertex)).then(|| around(&self.lattice, &self.forward, vertex));
        let on_lattice = on_lattice.into_iter().flatten();
        let free = on_lattice.filter(|(_, _, clearance_m)| *clearance_m > 0.0);
        free.map(move |(n, to, clearance_m)| {
            let length_m = lengths_m[AXES[n]];
            let way = Way {
                length_m,
                clearance_m,
            };
            (to, way)
        })
        .chain(self.ways_beyond(vertex))
    }

    /// Of these the ways that are not the lattice's own.
    pub(crate) fn ways_beyond(&self, vertex: Vertex) -> impl Iterator<Item = (Vertex, Way)> + '_ {
        let ways = self.beyond.edges(vertex);
        ways.map(|(_, to, way)| (to, *way))
    }

    /// Adds ways beyond the lattice, each as (from, to).
    fn add(&mut self, ways: impl IntoIterator<Item = ((Vertex, Vertex), Way)>) {
        for ((from, to), way) in ways {
            self.beyond.add_edge(from, to, way);
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

    /// Connects more stops; returns the vertex of each. All others keep their numbers.
    pub(crate) fn connect(
        &mut self,
        bounds: &Bounds,
        solids: Option<&Solids>,
        stops: &[Stop],
    ) -> Vec<Vertex> {
        let lattice = self.lattice.clone();
        let survey = Survey {
            lattice: &lattice,
            solids,
            floor_z_m: bounds.min.z,
            widest_m: self.widest_m,
        };
        let open =
            |place: Vertex, radius_m: f64| self.ways(place).any(|(_, way)| way.fits(radius_m));
        let mut links = Links::new(&survey, bounds, &open, self.places_m.clone());
        let vertices = stops.iter().map(|stop| links.connect(stop)).collect();
        let (places_m, ways) = (links.places_m, links.ways);
        self.places_m = places_m;
        // In ascending order still: stops of later come after all others.
        self.add(ways);
        vertices
    }
}

/// Clearance of the 13 ways from a lattice place to neighbours of higher number; the others are
/// theirs.
type Forward = Vec<[f32; 13]>;

/// Neighbours of a lattice place, in ascending order: which of [`NEIGHBOURS`] each is, and the
/// clearance of the way there.
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

/// By place, the steps that a ball of this radius (m) may take, as bits in the order of [`NEIGHBOURS`].
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

/// What is needed to measure clearances.
struct Survey<'a> {
    /// Where places are.
    lattice: &'a Lattice,
    /// `None`: no obstacle anywhere.
    solids: Option<&'a Solids>,
    /// Height of the floor, which bodies keep off too (m).
    floor_z_m: f64,
    /// More clearance than this is not told apart (m).
    widest_m: f64,
}

impl Survey<'_> {
    /// Clearance of every way to a neighbour of higher number, in parallel; negative infinity where there
    /// is no neighbour.
    fn forward_clearances(&self) -> Forward {
        let step_m = self.lattice.cell_m() * 3.0_f64.sqrt();
        let places = 0..self.lattice.place_count() as u32;
        let far_m = self.widest_m + step_m;
        let at_place_m = |place: u32| {
            let here_m = self.lattice.position_m(place);
            self.solids.map_or(far_m, |solids| {
                solids.segment_clearance_m(here_m, here_m, far_m)
            })
        };
        let at_places_m: Vec<f64> = places.clone().into_par_iter().map(at_place_m).collect();
        places
            .into_par_iter()
            .map(|place| {
                let from_m = self.lattice.position_m(place);
                let [i, j, k] = self.lattice.steps(place);
                std::array::from_fn(|ahead| {
                    let d = NEIGHBOURS[13 + ahead];
                    let Some(to) = self.lattice.at([i + d[0], j + d[1], k + d[2]]) else {
                        return f32::NEG_INFINITY;
                    };
                    let to_m = self.lattice.position_m(to);
                    // Bodies keep off the floor too, though bounds limit only their centres.
                    let floor_m = from_m.z.min(to_m.z) - self.floor_z_m;
                    let [a_m, b_m] = [place, to].map(|end| at_places_m[end as usize]);
                    let ends_m = a_m.min(b_m);
                    let between_m = 0.5 * (a_m + b_m - (to_m - from_m).norm());
                    let free_m = if ends_m <= 0.0 {
                        // No drone fits, wherever the way is narrowest.
                        ends_m
                    } else if between_m >= self.widest_m {
                        // Distances change by no more than one moves.
                        self.widest_m
                    } else {
                        self.clearance_m(from_m, to_m)
                    };
                    free_m.min(floor_m) as f32
                })
            })
            .collect()
    }

    /// Distance of a straight way from all obstacles, at most `widest_m` (m).
    fn clearance_m(&self, a_m: Point3<f64>, b_m: Point3<f64>) -> f64 {
        self.solids.map_or(self.widest_m, |solids| {
            solids.segment_clearance_m(a_m, b_m, self.widest_m)
        })
    }
}

mod links;
#[cfg(test)]
mod tests;
