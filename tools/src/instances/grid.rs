//! An instance in cells, as planners on grids take it.

/// Cells of 1 m, free or blocked, and which drone goes where. Cell `[x, y, z]` reaches from there
/// to the next whole metre on every axis, z up.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    name: String,
    size: [usize; 3],
    /// By x, then y, then z.
    blocked: Vec<bool>,
    agents: Vec<Agent>,
}

/// One drone of a grid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Agent {
    /// Letters and digits.
    pub name: String,
    /// Its cell at the beginning.
    pub start: [usize; 3],
    /// Its cell at the end.
    pub goal: [usize; 3],
}

impl Grid {
    pub(super) fn open(name: String, size: [usize; 3]) -> Grid {
        Grid {
            name,
            size,
            blocked: vec![false; size.iter().product()],
            agents: Vec::new(),
        }
    }

    /// Blocks the cells from `low` up to, not including, `high`.
    pub(super) fn block(&mut self, low: [usize; 3], high: [usize; 3]) {
        for z in low[2]..high[2] {
            for y in low[1]..high[1] {
                for x in low[0]..high[0] {
                    let index = self.index([x, y, z]);
                    self.blocked[index] = true;
                }
            }
        }
    }

    pub(super) fn add(&mut self, name: String, start: [usize; 3], goal: [usize; 3]) {
        self.agents.push(Agent { name, start, goal });
    }

    /// What the instance is called; its files too.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Cells along x, y and z.
    #[must_use]
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Every drone, in the scenario's order.
    #[must_use]
    pub fn agents(&self) -> &[Agent] {
        &self.agents
    }

    /// Whether no drone can be in a cell; cells outside are blocked.
    #[must_use]
    pub fn is_blocked(&self, cell: [usize; 3]) -> bool {
        let outside = (0..3).any(|axis| cell[axis] >= self.size[axis]);
        outside || self.blocked[self.index(cell)]
    }

    /// Every blocked cell, by x, then y, then z.
    pub fn blocked(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        let blocked = (0..self.blocked.len()).filter(|&index| self.blocked[index]);
        blocked.map(|index| self.cell(index))
    }

    /// Seen from above, one cell high: a column is blocked where any of its cells is.
    #[must_use]
    pub(crate) fn projected(&self) -> Grid {
        let mut flat = Grid::open(self.name.clone(), [self.size[0], self.size[1], 1]);
        for [x, y, _] in self.blocked() {
            flat.block([x, y, 0], [x + 1, y + 1, 1]);
        }
        for agent in &self.agents {
            let below = |[x, y, _]: [usize; 3]| [x, y, 0];
            flat.add(agent.name.clone(), below(agent.start), below(agent.goal));
        }
        flat
    }

    pub(super) fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.size[0] * (y + self.size[1] * z)
    }

    pub(super) fn cell(&self, index: usize) -> [usize; 3] {
        let [x, y, _] = self.size;
        [index % x, index / x % y, index / (x * y)]
    }

    pub(super) fn cells(&self) -> usize {
        self.blocked.len()
    }
}
