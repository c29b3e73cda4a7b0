//! Directions of a step, and what turning does to them.

/// Number of directions, standing still included.
pub(super) const DIRECTIONS: usize = 27;
/// The direction of standing still.
pub(super) const STILL: usize = 13;

/// Cells of a direction along x, y and z.
pub(super) const fn cells(direction: usize) -> [i32; 3] {
    let direction = direction as i32;
    [direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1]
}

/// Symmetries of a square: quarter turns, mirrored or not.
pub(super) const TURNS: usize = 8;

/// A direction or offset, turned by quarters and mirrored.
pub(super) fn turned([x, y, z]: [i32; 3], turn: usize) -> [i32; 3] {
    let (x, y) = if turn & 1 == 0 { (x, y) } else { (y, x) };
    let x = if turn & 2 == 0 { x } else { -x };
    let y = if turn & 4 == 0 { y } else { -y };
    [x, y, z]
}

/// Which of the lattice's neighbours a direction leads to: they are in the same order, without
/// standing still.
pub(super) const fn neighbour(direction: usize) -> Option<usize> {
    match direction {
        STILL => None,
        before if before < STILL => Some(before),
        after => Some(after - 1),
    }
}

/// Number of a direction.
pub(super) const fn index([x, y, z]: [i32; 3]) -> usize {
    (x + 1 + 3 * (y + 1) + 9 * (z + 1)) as usize
}
