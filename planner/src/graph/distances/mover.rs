//! What moves on a roadmap, and how long a step of the lattice takes it.

use costmap::leg::Tick;

use crate::graph::lattice::{AXES, Lattice};
use crate::graph::roadmap::{Edge, Roadmap, Vertex};

/// No path at all.
pub(crate) const UNREACHABLE: u32 = u32::MAX;

/// What limits a drone on a roadmap.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mover {
    /// Along every edge (m/s).
    pub(super) speed_mps: f64,
    /// Of the ball that must stay clear: body and clearance (m).
    pub(super) radius_m: f64,
    /// The stops it may use; others' are not for it.
    pub(super) stops: Vec<Vertex>,
    /// Lengths of the lattice's steps along one, two and three axes (m), and their ticks.
    pub(super) steps: [(f32, u32); 3],
}

impl Mover {
    /// A ball of `radius_m` at `speed_mps` that may use these stops beyond the lattice.
    pub(crate) fn new(
        lattice: &Lattice,
        speed_mps: f64,
        radius_m: f64,
        stops: Vec<Vertex>,
    ) -> Mover {
        let mut mover = Mover {
            speed_mps,
            radius_m,
            stops,
            steps: [(0.0, 0); 3],
        };
        mover.steps = lattice
            .step_lengths_m()
            .map(|length_m| (length_m, mover.duration(f64::from(length_m))));
        mover
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
        let mut steps = self.steps.iter();
        let step = steps.find(|(length_m, _)| *length_m == edge.length_m);
        let duration = || self.duration(f64::from(edge.length_m));
        Some(step.map_or_else(duration, |(_, ticks)| *ticks))
    }

    /// Ticks of a step of the lattice along one, two and three axes.
    pub(crate) fn step_ticks(&self) -> [u32; 3] {
        self.steps.map(|(_, ticks)| ticks)
    }

    /// By lattice place, which steps are open, if it uses no stops beyond.
    pub(super) fn open_steps<'a>(&self, roadmap: &'a Roadmap) -> Option<&'a [u32]> {
        let on_lattice = self.stops.is_empty() && self.diagonal_steps().is_some();
        roadmap.open_steps(self.radius_m).filter(|_| on_lattice)
    }

    /// Calls `f` with the places that it may step to, in ascending order, and the ticks that each
    /// takes.
    pub(crate) fn steps_from(
        &self,
        roadmap: &Roadmap,
        from: Vertex,
        mut f: impl FnMut(Vertex, u32),
    ) {
        let fitting = |(to, edge): (Vertex, Edge)| Some((to, self.ticks(roadmap, to, edge)?));
        let open = roadmap.open_steps(self.radius_m);
        let Some(open) = open.filter(|_| !roadmap.is_stop(from)) else {
            let edges = roadmap.edges(from).filter_map(fitting);
            return edges.for_each(|(to, ticks)| f(to, ticks));
        };
        for (n, to) in roadmap.lattice().stepped(from, open[from as usize]) {
            f(to, self.steps[AXES[n]].1);
        }
        if !self.stops.is_empty() {
            let edges = roadmap.edges_beyond(from).filter_map(fitting);
            edges.for_each(|(to, ticks)| f(to, ticks));
        }
    }

    /// Whole ticks that a length takes, at least one.
    fn duration(&self, length_m: f64) -> u32 {
        Tick::lasting(length_m / self.speed_mps).max(1)
    }

    /// Ticks of a step along one, two and three axes, if diagonals first is always shortest.
    pub(super) fn diagonal_steps(&self) -> Option<[u32; 3]> {
        let [a, b, c] = self.steps.map(|(_, ticks)| ticks);
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
