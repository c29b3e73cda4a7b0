//! The regular grid of places that a roadmap connects.

use nalgebra::{Point3, Vector3};

use crate::scenario::world::Bounds;

/// Places `origin + cell · (i, j, k)`, all within the bounds, numbered x first, then y, then z.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lattice {
    /// The place numbered 0 (m).
    origin_m: Point3<f64>,
    /// Spacing (m).
    cell_m: f64,
    counts: [usize; 3],
    /// Coordinates on each axis (m).
    along_m: [Vec<f64>; 3],
    strides: [i32; 26],
}

/// How far apart the places of a lattice are, and where some of them have to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spacing {
    /// From one place to the next (m).
    pub(crate) cell_m: f64,
    /// On each axis a coordinate that places have (m); `None`: it is shifted as its stops are.
    pub(crate) through_m: [Option<f64>; 3],
}

impl Spacing {
    /// Cells of one size (m), wherever they are.
    pub(crate) fn of(cell_m: f64) -> Spacing {
        Spacing {
            cell_m,
            through_m: [None; 3],
        }
    }
}

/// Steps to the 26 neighbours, in ascending order of their numbers.
pub(crate) const NEIGHBOURS: [[i32; 3]; 26] = neighbours();

/// The 26 offsets of a 3 x 3 x 3 cube without its middle, x fastest.
const fn neighbours() -> [[i32; 3]; 26] {
    let mut steps = [[0; 3]; 26];
    let (mut cube, mut filled) = (0, 0);
    while cube < 27 {
        if cube != 13 {
            steps[filled] = [cube % 3 - 1, cube / 3 % 3 - 1, cube / 9 - 1];
            filled += 1;
        }
        cube += 1;
    }
    steps
}

/// Which of [`NEIGHBOURS`] is so many steps away.
pub(crate) fn neighbour(by: [i32; 3]) -> Option<u8> {
    if by == [0; 3] || by.iter().any(|steps| steps.abs() > 1) {
        return None;
    }
    let cube = by[0] + 1 + 3 * (by[1] + 1) + 9 * (by[2] + 1);
    Some((cube - i32::from(cube > 13)) as u8)
}

/// Along how many axes each of [`NEIGHBOURS`] is, less one.
pub(crate) const AXES: [usize; 26] = axes();

/// One entry for each neighbour: 0 along an axis, 1 on a face's diagonal, 2 on the cube's.
const fn axes() -> [usize; 26] {
    let mut axes = [0; 26];
    let mut n = 0;
    while n < 26 {
        let [x, y, z] = NEIGHBOURS[n];
        axes[n] = (x * x + y * y + z * z) as usize - 1;
        n += 1;
    }
    axes
}

impl Lattice {
    /// Fits a lattice into the bounds. On each axis it has places where they are asked for, or else
    /// is shifted so that it meets most of `places`: cells centred between the bounds' faces,
    /// unless more places lie on whole cells from them, or most places have another shift in
    /// common. An axis shorter than a cell has one layer, in its middle unless its places know
    /// better.
    pub(crate) fn new(bounds: &Bounds, spacing: &Spacing, places: &[Point3<f64>]) -> Lattice {
        let Spacing { cell_m, through_m } = *spacing;
        let mut origin_m = bounds.min;
        let mut counts = [1; 3];
        for axis in 0..3 {
            let low_m = bounds.min[axis];
            let size_m = bounds.max[axis] - low_m;
            let on = |shift: f64| {
                let offset = |p: &&Point3<f64>| {
                    let cells = (p[axis] - low_m) / cell_m - shift;
                    (cells - cells.round()).abs() < 1e-6
                };
                places.iter().filter(offset).count()
            };
            let middle = 0.5 * (size_m / cell_m).min(1.0);
            let shared = shared_shift(places, axis, low_m, cell_m);
            let better = |best, shift| if on(shift) > on(best) { shift } else { best };
            let asked = through_m[axis].map(|at_m| {
                let cells = (at_m - low_m) / cell_m;
                cells - (cells + 1e-9).floor()
            });
            let met = || [0.0].into_iter().chain(shared).fold(middle, better);
            let shift = asked.unwrap_or_else(met);
            origin_m[axis] = low_m + shift * cell_m;
            // A part in 10⁹ of a cell forgives the division.
            counts[axis] = ((size_m / cell_m - shift + 1e-9).floor() as usize) + 1;
        }
        let along_m = [0, 1, 2].map(|axis| {
            let at_m = |step: usize| origin_m[axis] + step as f64 * cell_m;
            (0..counts[axis])
                .map(|step| to_the_nanometre(at_m(step)))
                .collect()
        });
        let [nx, ny, _] = counts.map(|count| count as i32);
        Lattice {
            origin_m,
            cell_m,
            counts,
            along_m,
            strides: NEIGHBOURS.map(|[x, y, z]| x + nx * (y + ny * z)),
        }
    }

    /// Number of places.
    pub(crate) fn place_count(&self) -> usize {
        self.counts.iter().product()
    }

    /// Places along x, y and z.
    pub(crate) fn counts(&self) -> [usize; 3] {
        self.counts
    }

    /// Spacing (m).
    pub(crate) fn cell_m(&self) -> f64 {
        self.cell_m
    }

    /// Lengths of a step along one, two and three axes, as paths keep them (m).
    pub(crate) fn step_lengths_m(&self) -> [f32; 3] {
        [1.0_f64, 2.0, 3.0].map(|square| (square.sqrt() * self.cell_m) as f32)
    }

    /// Steps of a place from the first one.
    pub(crate) fn steps(&self, place: u32) -> [i32; 3] {
        let [nx, ny, _] = self.counts.map(|count| count as u32);
        let (row, layer) = (place / nx, place / nx / ny);
        [
            (place - row * nx) as i32,
            (row - layer * ny) as i32,
            layer as i32,
        ]
    }

    /// Number of the column of the floor that a place is in: x first, then y.
    pub(crate) fn column(&self, place: u32) -> usize {
        place as usize % (self.counts[0] * self.counts[1])
    }

    /// How much farther on in number each of [`NEIGHBOURS`] is; those outside, too.
    pub(crate) fn strides(&self) -> &[i32; 26] {
        &self.strides
    }

    /// Where open steps lead from a place, ascending: which of [`NEIGHBOURS`], and the place. The
    /// bits of `open` are in the order of [`NEIGHBOURS`]; none of them leads outside.
    #[inline]
    pub(crate) fn stepped(&self, from: u32, mut open: u32) -> impl Iterator<Item = (usize, u32)> {
        std::iter::from_fn(move || {
            let n = open.trailing_zeros() as usize;
            open &= open.wrapping_sub(1);
            (n < 32).then(|| (n, from.wrapping_add_signed(self.strides[n])))
        })
    }

    /// The place at these steps from the first one, if there is one.
    pub(crate) fn at(&self, steps: [i32; 3]) -> Option<u32> {
        let inside = (0..3).all(|axis| (0..self.counts[axis] as i32).contains(&steps[axis]));
        let [nx, ny, _] = self.counts;
        inside
            .then(|| steps[0] as u32 + nx as u32 * (steps[1] as u32 + ny as u32 * steps[2] as u32))
    }

    pub(crate) fn position_m(&self, place: u32) -> Point3<f64> {
        let [i, j, k] = self.steps(place).map(|step| step as usize);
        Point3::new(self.along_m[0][i], self.along_m[1][j], self.along_m[2][k])
    }

    /// The steps of the place at or before a point on every axis; may lie outside.
    pub(crate) fn cell_of(&self, point_m: &Point3<f64>) -> [i32; 3] {
        let of = |axis: usize| {
            ((point_m[axis] - self.origin_m[axis]) / self.cell_m + 1e-6).floor() as i32
        };
        [of(0), of(1), of(2)]
    }

    /// A point as steps from the first place, whole where a place is.
    pub(crate) fn in_cells(&self, point_m: &Point3<f64>) -> [f64; 3] {
        [0, 1, 2].map(|axis| (point_m[axis] - self.origin_m[axis]) / self.cell_m)
    }

    /// The steps of the place next to a point.
    pub(crate) fn nearest(&self, point_m: &Point3<f64>) -> [i32; 3] {
        let half_m = Vector3::from([0.5 * self.cell_m; 3]);
        let cell = self.cell_of(&(point_m + half_m));
        [0, 1, 2].map(|axis| cell[axis].clamp(0, self.counts[axis] as i32 - 1))
    }

    /// The place that is at exactly this point.
    pub(crate) fn place_at(&self, point_m: &Point3<f64>) -> Option<u32> {
        let place = self.at(self.cell_of(point_m))?;
        (self.position_m(place) == *point_m).then_some(place)
    }
}

/// Without the last digits, which only adding made: 2.57 stays 2.57.
fn to_the_nanometre(coordinate_m: f64) -> f64 {
    (coordinate_m * 1e9).round() / 1e9
}

/// How many marked places a box of a lattice holds, in constant time (a summed-area table in three
/// dimensions).
#[derive(Clone, Debug)]
pub(crate) struct BoxCount {
    counts: [usize; 3],
    /// At `(i, j, k)`, marked places with less than `i`, `j` and `k` steps from the first.
    sums: Vec<u32>,
}

impl BoxCount {
    /// Counts the places marked.
    pub(crate) fn new(lattice: &Lattice, marked: impl Fn(u32) -> bool) -> BoxCount {
        let [nx, ny, nz] = lattice.counts();
        let counts = [nx + 1, ny + 1, nz + 1];
        let mut table = BoxCount {
            counts,
            sums: vec![0; counts.iter().product()],
        };
        let mut place = 0;
        for k in 1..=nz {
            for j in 1..=ny {
                let mut row = 0;
                for i in 1..=nx {
                    row += u32::from(marked(place));
                    place += 1;
                    let sum = row + table.sum(i, j - 1, k) + table.sum(i, j, k - 1)
                        - table.sum(i, j - 1, k - 1);
                    let at = table.index(i, j, k);
                    table.sums[at] = sum;
                }
            }
        }
        table
    }

    /// Index of a corner in `sums`.
    fn index(&self, i: usize, j: usize, k: usize) -> usize {
        i + self.counts[0] * (j + self.counts[1] * k)
    }

    /// Marked places below a corner.
    fn sum(&self, i: usize, j: usize, k: usize) -> u32 {
        self.sums[self.index(i, j, k)]
    }

    /// Whether no place of the box between two places, both included, is marked.
    pub(crate) fn is_free(&self, a: [i32; 3], b: [i32; 3]) -> bool {
        if self.sums.last() == Some(&0) {
            return true;
        }
        let low = |axis: usize| a[axis].min(b[axis]) as usize;
        let high = |axis: usize| a[axis].max(b[axis]) as usize + 1;
        let slab = |k: usize| {
            self.sum(high(0), high(1), k) + self.sum(low(0), low(1), k)
                - self.sum(low(0), high(1), k)
                - self.sum(high(0), low(1), k)
        };
        slab(high(2)) == slab(low(2))
    }
}

/// How far into a cell more than half of the places lie on this axis (cells), if they agree.
fn shared_shift(places: &[Point3<f64>], axis: usize, low_m: f64, cell_m: f64) -> Option<f64> {
    let shift = |p: &Point3<f64>| ((p[axis] - low_m) / cell_m).rem_euclid(1.0);
    let mut shifts: Vec<f64> = places.iter().map(shift).collect();
    shifts.sort_unstable_by(f64::total_cmp);
    // What more than half of them share is the one in the middle.
    let median = *shifts.get(shifts.len() / 2)?;
    let sharing = shifts.iter().filter(|it| (*it - median).abs() < 1e-6);
    (2 * sharing.count() > shifts.len()).then_some(median)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds(x: f64, y: f64, z: f64) -> Bounds {
        Bounds {
            min: Point3::origin(),
            max: Point3::new(x, y, z),
        }
    }

    #[test]
    fn cells_are_centred_unless_places_lie_on_whole_cells() {
        let centred = Lattice::new(&bounds(4.0, 3.0, 2.0), &Spacing::of(1.0), &[]);
        assert_eq!(centred.counts(), [4, 3, 2]);
        assert_eq!(centred.position_m(0), Point3::new(0.5, 0.5, 0.5));
        let whole = Lattice::new(
            &bounds(4.0, 3.0, 2.0),
            &Spacing::of(1.0),
            &[Point3::new(1.0, 2.0, 1.0)],
        );
        assert_eq!(whole.counts(), [5, 4, 3]);
        assert_eq!(
            whole.place_at(&Point3::new(1.0, 2.0, 1.0)),
            whole.at([1, 2, 1])
        );
    }

    #[test]
    fn a_corridor_narrower_than_a_cell_is_flown_along_its_middle_or_where_its_places_are() {
        let narrow = Lattice::new(&bounds(16.0, 0.9, 3.0), &Spacing::of(1.0), &[]);
        assert_eq!(narrow.counts(), [16, 1, 3]);
        assert_eq!(narrow.position_m(0), Point3::new(0.5, 0.45, 0.5));
        let aside = Point3::new(1.2, 0.3, 0.5);
        let shared = Lattice::new(&bounds(16.0, 0.9, 3.0), &Spacing::of(1.0), &[aside]);
        assert_eq!(shared.counts(), [16, 1, 3]);
        assert!((shared.position_m(1) - aside).norm() < 1e-9);
    }

    #[test]
    fn neighbours_ascend() {
        let lattice = Lattice::new(&bounds(5.0, 5.0, 5.0), &Spacing::of(1.0), &[]);
        let centre = lattice.at([2, 2, 2]).expect("inside");
        let [i, j, k] = lattice.steps(centre);
        let around: Vec<u32> = NEIGHBOURS
            .iter()
            .filter_map(|d| lattice.at([i + d[0], j + d[1], k + d[2]]))
            .collect();
        assert_eq!(around.len(), 26);
        assert!(around.is_sorted());
    }

    #[test]
    fn a_box_is_free_when_none_of_its_places_is_marked() {
        let lattice = Lattice::new(&bounds(6.0, 5.0, 4.0), &Spacing::of(1.0), &[]);
        let marked = lattice.at([3, 2, 1]).expect("inside");
        let count = BoxCount::new(&lattice, |place| place == marked);
        assert!(!count.is_free([0, 0, 0], [5, 4, 3]));
        assert!(!count.is_free([3, 2, 1], [3, 2, 1]));
        assert!(count.is_free([0, 0, 0], [2, 4, 3]));
        assert!(count.is_free([5, 4, 3], [0, 0, 2]));
    }
}
