//! What moves on a roadmap, and how long a step of the lattice takes it.

use costmap::leg::Tick;

use crate::graph::lattice::{AXES, Lattice, NEIGHBOURS};
use crate::graph::roadmap::{Edge, Roadmap, Vertex};
use crate::scenario::world::{LIFT_MPS, Vehicle};

/// No path at all.
pub(crate) const UNREACHABLE: u32 = u32::MAX;

/// How fast a drone flies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Speeds {
    /// Along every edge (m/s).
    pub(crate) along_mps: f64,
    /// Upwards (m/s).
    pub(crate) climb_mps: f64,
    /// Downwards (m/s).
    pub(crate) descent_mps: f64,
}

impl Speeds {
    pub(crate) fn of(vehicle: &Vehicle) -> Speeds {
        Speeds {
            along_mps: vehicle.max_speed_mps,
            climb_mps: vehicle.max_climb_mps.min(vehicle.max_speed_mps),
            descent_mps: vehicle.max_descent_mps.min(vehicle.max_speed_mps),
        }
    }

    /// Whole ticks that a straight path takes, at least one.
    pub(crate) fn ticks(&self, length_m: f64, rise_m: f64) -> u32 {
        let vertical_s = (rise_m / self.climb_mps).max(-rise_m / self.descent_mps);
        Tick::lasting((length_m / self.along_mps).max(vertical_s)).max(1)
    }

    /// The same next to where it stands.
    pub(crate) fn lift_ticks(&self, rise_m: f64) -> u32 {
        let most_mps = LIFT_MPS.min(self.climb_mps).min(self.descent_mps);
        Tick::lasting(rise_m.abs() / most_mps).max(1)
    }
}

/// What limits a drone on a roadmap.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mover {
    /// Along every edge.
    pub(crate) speeds: Speeds,
    /// Of the ball that must stay clear: body and clearance (m).
    pub(super) radius_m: f64,
    /// The stops it may use; others' are not for it.
    pub(super) stops: Vec<Vertex>,
    /// Ticks of the lattice's steps to each of [`NEIGHBOURS`].
    steps: [u32; 26],
}

impl Mover {
    /// A ball of `radius_m` that may use these stops beyond the lattice.
    pub(crate) fn new(
        lattice: &Lattice,
        speeds: Speeds,
        radius_m: f64,
        stops: Vec<Vertex>,
    ) -> Mover {
        let lengths_m = lattice.step_lengths_m();
        let ticks = |n: usize| {
            let rise_m = NEIGHBOURS[n][2] as f32 * lengths_m[0];
            speeds.ticks(f64::from(lengths_m[AXES[n]]), f64::from(rise_m))
        };
        Mover {
            speeds,
            radius_m,
            stops,
            steps: std::array::from_fn(ticks),
        }
    }

    /// The same with more stops beyond the lattice that it may use.
    #[must_use]
    pub(crate) fn with_stops(mut self, more: impl Iterator<Item = Vertex>) -> Mover {
        self.stops.extend(more);
        self.stops.sort_unstable();
        self.stops.dedup();
        self
    }

    /// The stops beyond the lattice that it may use.
    pub(crate) fn stops(&self) -> &[Vertex] {
        &self.stops
    }

    /// Of the ball that it needs (m).
    pub(crate) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Whole ticks that an edge takes; `None` where it may not go.
    pub(crate) fn ticks(&self, roadmap: &Roadmap, to: Vertex, edge: Edge) -> Option<u32> {
        if !edge.fits(self.radius_m) || (roadmap.is_stop(to) && !self.stops.contains(&to)) {
            return None;
        }
        let rise_m = f64::from(edge.rise_m);
        Some(match edge.is_lift {
            true => self.speeds.lift_ticks(rise_m),
            false => self.speeds.ticks(f64::from(edge.length_m), rise_m),
        })
    }

    /// Ticks of a step of the lattice to each of [`NEIGHBOURS`].
    pub(crate) fn step_ticks(&self) -> &[u32; 26] {
        &self.steps
    }

    /// Ticks of the slowest step along one axis.
    pub(crate) fn slowest_axis_ticks(&self) -> u32 {
        let along_one = (0..26).filter(|n| AXES[*n] == 0);
        along_one.map(|n| self.steps[n]).max().unwrap_or(1)
    }

    /// By lattice place, which steps are open, if it uses no stops beyond.
    pub(super) fn open_steps<'a>(&self, roadmap: &'a Roadmap) -> Option<&'a [u32]> {
        let on_lattice = self.stops.is_empty() && self.diagonal_steps().is_some();
        roadmap.open_steps(self.radius_m).filter(|_| on_lattice)
    }

    /// Calls `f` with the places that it may step to, in ascending order, the ticks that each
    /// takes, and which of [`NEIGHBOURS`] it is, where that is known at once.
    pub(crate) fn steps_from(
        &self,
        roadmap: &Roadmap,
        from: Vertex,
        mut f: impl FnMut(Vertex, u32, Option<usize>),
    ) {
        let fitting = |(to, edge): (Vertex, Edge)| Some((to, self.ticks(roadmap, to, edge)?));
        let open = roadmap.open_steps(self.radius_m);
        let Some(open) = open.filter(|_| !roadmap.is_stop(from)) else {
            let edges = roadmap.edges(from).filter_map(fitting);
            return edges.for_each(|(to, ticks)| f(to, ticks, None));
        };
        for (n, to) in roadmap.lattice().stepped(from, open[from as usize]) {
            f(to, self.steps[n], Some(n));
        }
        if !self.stops.is_empty() {
            let edges = roadmap.edges_beyond(from).filter_map(fitting);
            edges.for_each(|(to, ticks)| f(to, ticks, None));
        }
    }

    /// Calls `f` with the places from which it may step here, in ascending order, and the ticks
    /// that each takes.
    pub(crate) fn steps_to(&self, roadmap: &Roadmap, to: Vertex, mut f: impl FnMut(Vertex, u32)) {
        let may_be_left = |from: Vertex| !roadmap.is_stop(from) || self.stops.contains(&from);
        let fitting = |(from, edge): (Vertex, Edge)| {
            let ticks = self.ticks(roadmap, to, edge.reversed())?;
            may_be_left(from).then_some((from, ticks))
        };
        let open = roadmap.open_steps(self.radius_m);
        let Some(open) = open.filter(|_| !roadmap.is_stop(to)) else {
            let edges = roadmap.edges(to).filter_map(fitting);
            return edges.for_each(|(from, ticks)| f(from, ticks));
        };
        for (n, from) in roadmap.lattice().stepped(to, open[to as usize]) {
            f(from, self.steps[25 - n]);
        }
        if !self.stops.is_empty() {
            let edges = roadmap.edges_beyond(to).filter_map(fitting);
            edges.for_each(|(from, ticks)| f(from, ticks));
        }
    }

    /// Ticks of a step along one, two and three axes, if diagonals first is always shortest: not
    /// where climbs or descents take longer.
    pub(super) fn diagonal_steps(&self) -> Option<[u32; 3]> {
        let along = |axes: usize| {
            let mut all = (0..26).filter(|n| AXES[*n] == axes).map(|n| self.steps[n]);
            let first = all.next()?;
            all.all(|ticks| ticks == first).then_some(first)
        };
        let (a, b, c) = (along(0)?, along(1)?, along(2)?);
        (b <= 2 * a && c <= a + b && a + c <= 2 * b).then_some([a, b, c])
    }
}

/// Ticks between two lattice places (steps from the first one), nothing in between: as many steps
/// along three axes as possible, then along two, then along one. Exact where `diagonal_steps` is.
pub(super) fn diagonals_first(a: [i32; 3], b: [i32; 3], [one, two, three]: [u32; 3]) -> u32 {
    let [x, y, z] = [0, 1, 2].map(|axis| a[axis].abs_diff(b[axis]));
    let (least, most) = (x.min(y).min(z), x.max(y).max(z));
    let middle = x + y + z - least - most;
    least * three + (middle - least) * two + (most - middle) * one
}
