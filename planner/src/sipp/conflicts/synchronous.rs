//! Two steps that begin at the same moment and last as long: along one axis each, or none, or
//! between a stop beside the lattice and a place next to it.

use super::directions::{index, neighbour};
use super::pair::Extent;
use super::shape::Shape;
use super::steps::{Pace, Steps};

/// Directions of a step along one axis, the first of them none.
pub(crate) const DIRECTIONS: [[i32; 3]; 7] = [
    [0, 0, 0],
    [0, 0, -1],
    [0, -1, 0],
    [-1, 0, 0],
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
];
/// The direction of who stays.
pub(crate) const STAYS: usize = 0;

/// Which of [`NEIGHBOURS`](crate::graph::lattice::NEIGHBOURS) each of [`DIRECTIONS`] leads to;
/// staying counts for nothing.
pub(crate) const AMONG_NEIGHBOURS: [usize; 7] = among_neighbours();

const fn among_neighbours() -> [usize; 7] {
    let mut among = [0; 7];
    let mut direction = 1;
    while direction < 7 {
        among[direction] = match neighbour(index(DIRECTIONS[direction])) {
            Some(n) => n,
            None => 0,
        };
        direction += 1;
    }
    among
}

/// A step of one drone, or a stay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stride {
    /// What flies.
    pub(crate) class: usize,
    /// The lattice place where it begins, or the one next to that (steps).
    pub(crate) at: [i32; 3],
    /// Where it leads.
    pub(crate) course: Course,
}

/// Where a step leads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Course {
    /// From a lattice place in one of [`DIRECTIONS`].
    Axis(usize),
    /// From or to a stop beside the lattice, or staying there.
    Beside {
        /// Where it begins (cells from the first place).
        from: [f64; 3],
        /// How far it leads (cells).
        by: [f64; 3],
    },
}

impl Stride {
    fn pace(&self, direction: usize) -> Pace {
        Pace {
            class: self.class,
            at: self.at,
            by: DIRECTIONS[direction],
        }
    }

    /// Where it begins, and how far it leads (cells).
    fn line(&self) -> [[f64; 3]; 2] {
        match self.course {
            Course::Axis(direction) => {
                [self.at, DIRECTIONS[direction]].map(|steps| steps.map(f64::from))
            }
            Course::Beside { from, by } => [from, by],
        }
    }
}

/// What such steps do to one another.
#[derive(Debug)]
pub(crate) struct SynchronousSteps<'a> {
    pub(crate) steps: &'a Steps,
    /// How long each lasts.
    pub(crate) ticks: u32,
    /// How far each drone may go within the time margins (cells).
    astray: f64,
    /// `[class][other class]`.
    pairs: Vec<Pair>,
}

#[derive(Debug)]
struct Pair {
    /// Of the table.
    extent: Extent,
    /// `[direction][direction][dz][dy][dx]`: loads on both, or [`TOO_NEAR`].
    meetings: Vec<[u8; 2]>,
    /// By direction of the first: columns in which something can matter.
    near: Vec<Vec<[i32; 2]>>,
    /// Columns in which something can matter to a step from or to a stop beside the lattice, or one
    /// there to it: one more on every side.
    all: Vec<[i32; 2]>,
}

/// What wakes of those who are close may fill of a budget, parts of [`super::steps::LOADS`]. Chosen
/// here: three fifths, the rest is for the many farther off: with nine tenths the costmap found
/// some nine hundred legs of 2000 drones on half the columns of a hall too near others, with three
/// fifths none.
pub(crate) const MOST_LOADS: i32 = 150;

const TOO_NEAR: [u8; 2] = [u8::MAX; 2];

/// Least and greatest distance that a drone may go within the time margins (cells): chosen here.
/// Less makes every step long, more keeps drones farther apart than their wakes do.
const ASTRAY: [f64; 2] = [0.1, 0.25];

impl<'a> SynchronousSteps<'a> {
    /// Of steps that last at least `ticks`, and so long that drones that fly one behind the other,
    /// a cell apart, stay apart when one of them is late.
    pub(crate) fn new(steps: &'a Steps, ticks: u32) -> SynchronousSteps<'a> {
        let nearest = |shape: &Shape| 1.0 - shape.keep_out.body_radius();
        let room = steps.shapes.iter().map(nearest).fold(1.0, f64::min);
        let shift = f64::from(steps.shift);
        let slow = (shift / room.clamp(ASTRAY[0], ASTRAY[1])).ceil() as u32;
        let ticks = ticks.max(slow);
        let pair = |shape: &Shape| Pair::new(shape, shift / f64::from(ticks));
        SynchronousSteps {
            steps,
            ticks,
            astray: shift / f64::from(ticks),
            pairs: steps.shapes.iter().map(pair).collect(),
        }
    }

    fn pair(&self, class: usize, other: usize) -> &Pair {
        &self.pairs[class * self.steps.class_count() + other]
    }

    /// Columns around the beginning of a step in which others can matter to it: those on the
    /// lattice, or all where some are `beside`.
    pub(crate) fn near(&self, one: &Stride, other: usize, beside: bool) -> &[[i32; 2]] {
        let pair = self.pair(one.class, other);
        match one.course {
            Course::Axis(direction) if !beside => &pair.near[direction],
            _ => &pair.all,
        }
    }

    /// What the two fill of one another's budgets, in parts of [`super::steps::LOADS`]; `None`:
    /// they are too near one another.
    pub(crate) fn meet(&self, one: &Stride, other: &Stride) -> Option<[u8; 2]> {
        let (Course::Axis(direction), Course::Axis(others)) = (one.course, other.course) else {
            // Few are beside the lattice, and not for long: they are not tabulated.
            let ([from, by], [from_other, by_other]) = (one.line(), other.line());
            let offset = [0, 1, 2].map(|axis| from_other[axis] - from[axis]);
            let shape = &self.steps.shapes[one.class * self.steps.class_count() + other.class];
            return shape.synchronous([by, by_other], offset, self.astray);
        };
        let offset = [0, 1, 2].map(|axis| other.at[axis] - one.at[axis]);
        let met = self
            .pair(one.class, other.class)
            .at([direction, others], offset);
        if met != TOO_NEAR {
            return Some(met);
        }
        let reach = (self.steps).can_meet(&one.pace(direction), &other.pace(others), true);
        (!reach).then_some([0; 2])
    }
}

impl Pair {
    fn new(shape: &Shape, astray: f64) -> Pair {
        // Room for who is not where it is taken to be.
        let more = i32::from(astray > 0.0);
        let extent = Extent {
            reach: shape.extent.reach + more,
            layers: shape.extent.layers + more,
            ..shape.extent
        };
        let Extent { reach, layers, .. } = extent;
        let mut meetings = Vec::new();
        let mut near = Vec::new();
        for direction in DIRECTIONS {
            let mut own: Vec<[i32; 2]> = Vec::new();
            for others in DIRECTIONS {
                for dz in -layers..=layers {
                    for dy in -reach..=reach {
                        for dx in -reach..=reach {
                            let steps = [direction, others].map(|steps| steps.map(f64::from));
                            let offset = [dx, dy, dz].map(f64::from);
                            let met = shape.synchronous(steps, offset, astray);
                            if met != Some([0; 2]) && !own.contains(&[dx, dy]) {
                                own.push([dx, dy]);
                            }
                            meetings.push(met.unwrap_or(TOO_NEAR));
                        }
                    }
                }
            }
            own.sort_unstable();
            near.push(own);
        }
        let wide = -reach - 1..=reach + 1;
        let row = |dy: i32| wide.clone().map(move |dx| [dx, dy]);
        Pair {
            extent,
            meetings,
            near,
            all: wide.clone().flat_map(row).collect(),
        }
    }

    fn at(&self, [direction, others]: [usize; 2], [dx, dy, dz]: [i32; 3]) -> [u8; 2] {
        let Extent { reach, layers, .. } = self.extent;
        if dx.abs() > reach || dy.abs() > reach || dz.abs() > layers {
            return [0; 2];
        }
        let (wide, tall) = (2 * reach + 1, 2 * layers + 1);
        let offset = (dx + reach) + wide * ((dy + reach) + wide * (dz + layers));
        let of_directions = (direction * DIRECTIONS.len() + others) * (wide * wide * tall) as usize;
        self.meetings[of_directions + offset as usize]
    }
}
