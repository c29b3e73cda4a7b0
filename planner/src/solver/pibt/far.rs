//! How many steps along the axes it is to a goal.
//!
//! Where nothing is in the way, all fly in the middle layer: a drone is not exposed to the wake of
//! another at its own height, and the fewer layers there are between two, the less. `plan bench
//! hall
//! --drones 2000 --seeds 1` takes 206 steps this way, and 358 with a goal layer for each drone.

use crate::graph::lattice::{AXES, Lattice};
use crate::graph::roadmap::{Roadmap, Vertex};

/// Steps from everywhere to one goal.
pub(super) enum Far {
    /// Nothing is in the way: steps of the goal from the lattice's first place. By direction of the
    /// middle layer.
    Straight([i32; 3]),
    /// By place.
    Table(Vec<u16>),
}

/// No path.
const UNREACHED: u16 = u16::MAX;

impl Far {
    /// For a ball of this radius; `None` if the roadmap was not asked for it.
    pub(super) fn new(roadmap: &Roadmap, goal: Vertex, radius_m: f64) -> Option<Far> {
        let lattice = roadmap.lattice();
        let narrow = roadmap.narrow(radius_m)?;
        let last = lattice.counts().map(|count| count as i32 - 1);
        if narrow.is_free([0; 3], last) {
            return Some(Far::Straight(lattice.steps(goal)));
        }
        let open = roadmap.open_steps(radius_m)?;
        let mut table = vec![UNREACHED; lattice.place_count()];
        table[goal as usize] = 0;
        let mut reached = vec![goal];
        let mut next = 0;
        while let Some(&place) = reached.get(next) {
            next += 1;
            for (n, to) in lattice.stepped(place, open[place as usize]) {
                if AXES[n] == 0 && table[to as usize] == UNREACHED {
                    table[to as usize] = table[place as usize].saturating_add(1).min(UNREACHED - 1);
                    reached.push(to);
                }
            }
        }
        Some(Far::Table(table))
    }

    /// Steps along the axes from a place to the goal; [`u16::MAX`] where there is no path.
    pub(super) fn steps(&self, lattice: &Lattice, from: Vertex) -> u32 {
        match self {
            Far::Straight(goal) => {
                let from = lattice.steps(from);
                let aside = from[0].abs_diff(goal[0]) + from[1].abs_diff(goal[1]);
                let middle = lattice.counts()[2] as i32 / 2;
                aside
                    + if aside == 0 {
                        from[2].abs_diff(goal[2])
                    } else {
                        from[2].abs_diff(middle) + middle.abs_diff(goal[2])
                    }
            }
            Far::Table(table) => u32::from(table[from as usize]),
        }
    }
}
