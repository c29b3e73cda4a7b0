//! Two steps that begin at the same moment and last as long: along one axis each, or none.

use super::shape::Shape;
use super::steps::{Pace, Steps};

/// Directions of a step along one axis, the first of them none.
pub(crate) const WAYS: [[i32; 3]; 7] = [
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

/// What such steps do to one another.
#[derive(Debug)]
pub(crate) struct Abreast<'a> {
    pub(crate) steps: &'a Steps,
    /// `[class][other class]`.
    pairs: Vec<Pair>,
}

#[derive(Debug)]
struct Pair {
    /// Columns aside and layers above and below in the table.
    reach: i32,
    layers: i32,
    /// `[direction][direction][dz][dy][dx]`: loads on both, or [`TOO_NEAR`].
    meetings: Vec<[u8; 2]>,
    /// By direction of the first: columns in which something can matter.
    near: Vec<Vec<[i32; 2]>>,
}

const TOO_NEAR: [u8; 2] = [u8::MAX; 2];

impl<'a> Abreast<'a> {
    pub(crate) fn new(steps: &'a Steps) -> Abreast<'a> {
        Abreast {
            steps,
            pairs: steps.shapes.iter().map(Pair::new).collect(),
        }
    }

    fn pair(&self, class: usize, other: usize) -> &Pair {
        &self.pairs[class * self.steps.class_count() + other]
    }

    /// Columns around the beginning of a step in which others can matter to it.
    pub(crate) fn near(&self, class: usize, other: usize, way: usize) -> &[[i32; 2]] {
        &self.pair(class, other).near[way]
    }

    /// What the two fill of one another's budgets, in parts of [`super::steps::LOADS`]; `None`: they are too near one
    /// another.
    pub(crate) fn meet(
        &self,
        one: &Pace,
        other: &Pace,
        [way, others]: [usize; 2],
    ) -> Option<[u8; 2]> {
        let met = self
            .pair(one.class, other.class)
            .meeting(one, other, [way, others]);
        if met != TOO_NEAR {
            return Some(met);
        }
        let is_there = self.steps.can_touch(one, other) || self.steps.can_blow(one, other);
        (!is_there).then_some([0; 2])
    }
}

impl Pair {
    fn new(shape: &Shape) -> Pair {
        let (reach, layers) = (shape.reach, shape.layers);
        let mut meetings = Vec::new();
        let mut near = Vec::new();
        for way in WAYS {
            let mut own: Vec<[i32; 2]> = Vec::new();
            for others in WAYS {
                for dz in -layers..=layers {
                    for dy in -reach..=reach {
                        for dx in -reach..=reach {
                            let met = shape.abreast([way, others], [dx, dy, dz]);
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
        Pair {
            reach,
            layers,
            meetings,
            near,
        }
    }

    fn meeting(&self, one: &Pace, other: &Pace, [way, others]: [usize; 2]) -> [u8; 2] {
        let [dx, dy, dz] = [0, 1, 2].map(|axis| other.at[axis] - one.at[axis]);
        let (reach, layers) = (self.reach, self.layers);
        if dx.abs() > reach || dy.abs() > reach || dz.abs() > layers {
            return [0; 2];
        }
        let (wide, tall) = (2 * reach + 1, 2 * layers + 1);
        let offset = (dx + reach) + wide * ((dy + reach) + wide * (dz + layers));
        let of_ways = (way * WAYS.len() + others) * (wide * wide * tall) as usize;
        self.meetings[of_ways + offset as usize]
    }
}
