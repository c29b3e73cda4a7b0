//! A leg as steps on the lattice.

use costmap::leg::{Leg, Tick};

use super::directions::{STILL, index};
use crate::graph::lattice::Lattice;

/// Calls `f` with a leg as steps on the lattice: where each begins, its direction, and when. A leg
/// off the lattice counts as standing still at the places next to it in turn.
pub(super) fn pieces(lattice: &Lattice, leg: &Leg, mut f: impl FnMut([i32; 3], usize, [Tick; 2])) {
    let exact = (lattice.place_at(&leg.from_m), lattice.place_at(&leg.to_m));
    if let (Some(from), Some(to)) = exact {
        let (a, b) = (lattice.steps(from), lattice.steps(to));
        let by = [0, 1, 2].map(|axis| b[axis] - a[axis]);
        if by.iter().all(|cells| cells.abs() <= 1) {
            return f(a, index(by), [leg.start, leg.end]);
        }
    }
    let length_m = (leg.to_m - leg.from_m).norm();
    let count = (2.0 * length_m / lattice.cell_m()).ceil().max(1.0) as u32;
    if leg.end == Tick::FOREVER || count == 1 {
        let middle_m = nalgebra::center(&leg.from_m, &leg.to_m);
        return f(lattice.nearest(&middle_m), STILL, [leg.start, leg.end]);
    }
    let ticks = u64::from(leg.end.0 - leg.start.0);
    for k in 0..count {
        // Of kilometres over hours the product is beyond 32 bits.
        let [start, end] = [k, k + 1].map(|k| {
            let part = ticks * u64::from(k) / u64::from(count);
            leg.start.after(part as u32)
        });
        if start < end {
            let part = leg.between(start, end);
            let middle_m = nalgebra::center(&part.from_m, &part.to_m);
            f(lattice.nearest(&middle_m), STILL, [start, end]);
        }
    }
}

#[cfg(test)]
mod tests {
    use costmap::leg::{DroneId, KindId};
    use nalgebra::Point3;

    use super::*;
    use crate::graph::lattice::Spacing;
    use crate::scenario::world::Bounds;

    #[test]
    fn ten_kilometres_in_five_hours_are_pieces_back_to_back() {
        let bounds = Bounds {
            min: Point3::origin(),
            max: Point3::new(10_000.0, 1.0, 1.0),
        };
        let lattice = Lattice::new(&bounds, &Spacing::of(1.0), &[]);
        let leg = Leg {
            drone: DroneId(0),
            kind: KindId(0),
            start: Tick(7),
            end: Tick(7 + 5 * 3600 * 100),
            from_m: Point3::new(0.1, 0.5, 0.5),
            to_m: Point3::new(9_999.9, 0.5, 0.5),
            flying: true,
            air_limit: 0.3,
        };
        let mut until = leg.start;
        pieces(&lattice, &leg, |_, _, [start, end]| {
            assert_eq!(start, until);
            until = end;
        });
        assert_eq!(until, leg.end);
    }
}
