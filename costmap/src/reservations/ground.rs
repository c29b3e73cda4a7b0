//! The floor in square bins: where a leg is, roughly, and how far from others at least.

use std::ops::Range;

use crate::leg::Leg;

/// A horizontal box: everything above and below it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Lowest x and y (m).
    pub min_m: [f64; 2],
    /// Highest x and y (m).
    pub max_m: [f64; 2],
}

impl Footprint {
    /// The box around a leg, wider by a margin on every side.
    pub fn around(leg: &Leg, margin_m: f64) -> Footprint {
        let (a, b) = (leg.from_m, leg.to_m);
        Footprint {
            min_m: [a.x.min(b.x) - margin_m, a.y.min(b.y) - margin_m],
            max_m: [a.x.max(b.x) + margin_m, a.y.max(b.y) + margin_m],
        }
    }

    /// Wider by a margin on every side.
    #[must_use]
    pub fn grown(&self, margin_m: f64) -> Footprint {
        Footprint {
            min_m: self.min_m.map(|at_m| at_m - margin_m),
            max_m: self.max_m.map(|at_m| at_m + margin_m),
        }
    }

    /// The box around both.
    #[must_use]
    pub fn joined(&self, other: &Footprint) -> Footprint {
        Footprint {
            min_m: [0, 1].map(|axis| self.min_m[axis].min(other.min_m[axis])),
            max_m: [0, 1].map(|axis| self.max_m[axis].max(other.max_m[axis])),
        }
    }

    /// Horizontal distance between two of them; 0 where they meet (m).
    pub fn gap_m(&self, other: &Footprint) -> f64 {
        let along = |axis: usize| {
            (self.min_m[axis] - other.max_m[axis])
                .max(other.min_m[axis] - self.max_m[axis])
                .max(0.0)
        };
        length_m(along(0), along(1))
    }
}

/// Of what is this far along one axis and the other (m); `hypot`, which guards against lengths that
/// no floor has, takes five times as long.
fn length_m(x_m: f64, y_m: f64) -> f64 {
    (x_m * x_m + y_m * y_m).sqrt()
}

/// A floor cut into bins; what lies outside counts to the bins at its edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    low_m: [f64; 2],
    bin_m: f64,
    counts: [usize; 2],
}

/// Bins from a lowest to a highest one, on both axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bins {
    low: [u16; 2],
    high: [u16; 2],
}

impl Bins {
    /// How many they are.
    pub(crate) fn count(&self) -> usize {
        let along = |axis: usize| usize::from(self.high[axis] - self.low[axis]) + 1;
        along(0) * along(1)
    }
}

/// Chosen here: a table over all bins is then 256 kB.
const MOST_BINS: f64 = 65_536.0;

impl Ground {
    /// Bins of this size, or larger where they would be too many; best with the places where drones
    /// hover in the middle of bins.
    pub fn new(low_m: [f64; 2], high_m: [f64; 2], bin_m: f64) -> Ground {
        let size_m = [0, 1].map(|axis| (high_m[axis] - low_m[axis]).max(bin_m));
        let bin_m = bin_m.max((size_m[0] * size_m[1] / MOST_BINS).sqrt());
        Ground {
            low_m,
            bin_m,
            // One more for what rounding pushes over the edge.
            counts: size_m
                .map(|size_m| ((size_m / bin_m).ceil() as usize + 1).min(usize::from(u16::MAX))),
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.counts[0] * self.counts[1]
    }

    /// Of them, in a row.
    pub(crate) fn width(&self) -> usize {
        self.counts[0]
    }

    /// How many rows they are.
    pub(crate) fn row_count(&self) -> usize {
        self.counts[1]
    }

    /// All bins that a footprint touches.
    pub fn bins(&self, footprint: &Footprint) -> Bins {
        let bin = |at_m: f64, axis: usize| {
            let bin = ((at_m - self.low_m[axis]) / self.bin_m).max(0.0) as usize;
            bin.min(self.counts[axis] - 1) as u16
        };
        Bins {
            low: [bin(footprint.min_m[0], 0), bin(footprint.min_m[1], 1)],
            high: [bin(footprint.max_m[0], 0), bin(footprint.max_m[1], 1)],
        }
    }

    /// The indices of bins, row by row.
    pub fn rows(&self, bins: Bins) -> impl Iterator<Item = Range<usize>> + use<> {
        let width = self.counts[0];
        (bins.low[1]..=bins.high[1]).map(move |y| {
            let row = usize::from(y) * width;
            row + usize::from(bins.low[0])..row + usize::from(bins.high[0]) + 1
        })
    }

    /// Whether a bin is the first of those that two boxes of bins have in common.
    pub(crate) fn is_first_common(&self, bin: usize, a: Bins, b: Bins) -> bool {
        let first = |axis: usize| usize::from(a.low[axis].max(b.low[axis]));
        bin == first(1) * self.counts[0] + first(0)
    }

    /// What a box of bins covers, wider by a margin on every side.
    pub(crate) fn hull(&self, bins: Bins, margin_m: f64) -> Footprint {
        let at_m = |bin: f64, axis: usize| self.low_m[axis] + bin * self.bin_m;
        Footprint {
            min_m: [0, 1].map(|axis| at_m(f64::from(bins.low[axis]), axis) - margin_m),
            max_m: [0, 1].map(|axis| at_m(f64::from(bins.high[axis]) + 1.0, axis) + margin_m),
        }
    }

    /// Horizontal distances between a footprint and these bins, in the order of [`Ground::rows`]
    /// (m). Bins at the edge of the floor cover all beyond.
    pub(crate) fn gaps_m(&self, from: &Footprint, bins: Bins) -> Vec<f64> {
        let along = |axis: usize| {
            let numbers = usize::from(bins.low[axis])..=usize::from(bins.high[axis]);
            numbers.map(move |number| {
                let [low_m, high_m] = self.edges_m(number, axis);
                (from.min_m[axis] - high_m)
                    .max(low_m - from.max_m[axis])
                    .max(0.0)
            })
        };
        let x_m: Vec<f64> = along(0).collect();
        let mut gaps_m = Vec::with_capacity(bins.count());
        for y_m in along(1) {
            gaps_m.extend(x_m.iter().map(|x_m| length_m(*x_m, y_m)));
        }
        gaps_m
    }

    /// Where a column or row of bins begins and ends (m).
    fn edges_m(&self, number: usize, axis: usize) -> [f64; 2] {
        let edge_m = |number: usize| self.low_m[axis] + number as f64 * self.bin_m;
        let is_last = number + 1 == self.counts[axis];
        [
            if number == 0 {
                f64::NEG_INFINITY
            } else {
                edge_m(number)
            },
            if is_last {
                f64::INFINITY
            } else {
                edge_m(number + 1)
            },
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_footprint_lies_within_the_bins_it_touches() {
        let ground = Ground::new([-0.5, 1.0], [9.5, 6.0], 1.0);
        for k in 0..500_u32 {
            let at = |n: u32| (f64::from(7 * k + n) * 0.754_877_666_246_69).fract();
            let corner_m = [14.0 * at(1) - 2.0, 9.0 * at(2) - 1.0];
            let footprint = Footprint {
                min_m: corner_m,
                max_m: [corner_m[0] + 3.0 * at(3), corner_m[1] + 3.0 * at(4)],
            };
            let bins: Vec<usize> = ground.rows(ground.bins(&footprint)).flatten().collect();
            let gaps_m = ground.gaps_m(&footprint, ground.bins(&footprint));
            assert_eq!(gaps_m, vec![0.0; bins.len()]);
            for corner in 0..4 {
                let pick = |axis: usize| match corner >> axis & 1 {
                    0 => footprint.min_m[axis],
                    _ => footprint.max_m[axis],
                };
                let point = Footprint {
                    min_m: [pick(0), pick(1)],
                    max_m: [pick(0), pick(1)],
                };
                let gaps_m = ground.gaps_m(&point, ground.bins(&footprint));
                assert!(gaps_m.contains(&0.0));
            }
        }
    }
}
