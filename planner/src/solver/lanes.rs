//! Lattices for gaps that two drones can just pass one another in: with places as far to either
//! side as their bodies may be, and none between, where one would block the other whatever that
//! does.
//!
//! Drones are planned one after another. In such a gap the first flies along its middle on any
//! lattice that has it, and each of the two would have to leave it for the other.

use nalgebra::{Point3, Vector3};
use parry3d::bounding_volume::Aabb;

use crate::graph::lattice::Spacing;
use crate::scenario::cell::gap_between;
use crate::scenario::solid::Solids;
use crate::scenario::world::{Drone, World};

/// Lattices for gaps that are tried: chosen here.
const MOST_SPACINGS: usize = 4;
/// A gap in which this many times the room of two side by side is left has lanes on any lattice.
const WIDE: f64 = 2.0;

/// Between what stands in a world, and the sides that bound it.
struct Gap {
    /// Along which axis.
    axis: usize,
    /// From where to where (m).
    sides_m: [f64; 2],
    /// Of each side: whether bodies keep off it, or centres may be on it.
    keeps_off: [bool; 2],
}

impl Gap {
    /// From where to where the centre of a body may be that keeps so far from solids (m).
    fn centres_m(&self, radius_m: f64) -> [f64; 2] {
        let [low_m, high_m] = self.sides_m;
        let off_m = self
            .keeps_off
            .map(|keeps| if keeps { radius_m } else { 0.0 });
        [low_m + off_m[0], high_m - off_m[1]]
    }
}

/// The lattices by which some drones of a world may pass one another in its gaps, each with lanes
/// along both sides of one of them; the narrowest first. One body is the largest, the other as
/// large as the next or the smallest.
pub(crate) fn spacings(world: &World, drones: &[&Drone]) -> Vec<Spacing> {
    let mut radii_m: Vec<f64> = drones.iter().map(|it| it.vehicle.body_radius_m).collect();
    radii_m.sort_unstable_by(|a, b| b.total_cmp(a));
    let ([largest_m, second_m, ..], Some(&smallest_m)) = (&radii_m[..], radii_m.last()) else {
        return Vec::new();
    };
    let off_m = world.planning.gap_to_solids_m();
    let gaps = gaps(world, largest_m + off_m);
    // Axis, lower lane, and how far it is to the upper one (m).
    let mut lanes: Vec<(usize, f64, f64)> = Vec::new();
    for other_m in [*second_m, smallest_m] {
        let apart_m = largest_m + other_m + world.planning.gap_to_bodies_m(2);
        // One above the other is in its wake.
        for gap in gaps.iter().filter(|gap| gap.axis < 2) {
            let [of_one_m, of_other_m] = [*largest_m, other_m].map(|it| gap.centres_m(it + off_m));
            let either_way = [(of_one_m[0], of_other_m[1]), (of_other_m[0], of_one_m[1])];
            let either_way = either_way.map(|(low_m, high_m)| (gap.axis, low_m, high_m - low_m));
            lanes.extend(
                either_way
                    .iter()
                    .filter(|it| (apart_m..WIDE * apart_m).contains(&it.2)),
            );
        }
    }
    lanes.sort_by(|a, b| a.2.total_cmp(&b.2));
    let heights_m = gaps.iter().filter(|gap| gap.axis == 2);
    let heights_m: Vec<[f64; 2]> = heights_m
        .map(|gap| gap.centres_m(largest_m + off_m))
        .collect();
    let mut found: Vec<Spacing> = Vec::new();
    for (axis, low_m, cell_m) in lanes {
        // Where there is less than a cell of height, a layer may lie beside it.
        let low_ceilings = heights_m
            .iter()
            .filter(|[low_m, high_m]| high_m - low_m < cell_m);
        let layers_m = low_ceilings.map(|[low_m, high_m]| Some(f64::midpoint(*low_m, *high_m)));
        for height_m in std::iter::once(None).chain(layers_m) {
            let mut through_m = [None, None, height_m];
            through_m[axis] = Some(low_m);
            let spacing = Spacing { cell_m, through_m };
            if !found.iter().any(|it| is_same(it, &spacing)) {
                found.push(spacing);
            }
            if found.len() == MOST_SPACINGS {
                return found;
            }
        }
    }
    found
}

/// Whether two have the same places.
fn is_same(one: &Spacing, other: &Spacing) -> bool {
    /// Rounding of a scenario's decimals (m).
    const SAME_M: f64 = 1e-6;
    let cell_m = one.cell_m;
    let is_met = |pair: (&Option<f64>, &Option<f64>)| match pair {
        (Some(one_m), Some(other_m)) => {
            let cells = (one_m - other_m) / cell_m;
            (cells - cells.round()).abs() * cell_m < SAME_M
        }
        (one_m, other_m) => one_m == other_m,
    };
    (cell_m - other.cell_m).abs() < SAME_M
        && (one.through_m.iter().zip(&other.through_m)).all(is_met)
}

/// The gaps that a body of a radius (m) that keeps so far from solids has its place in.
fn gaps(world: &World, radius_m: f64) -> Vec<Gap> {
    let (low_m, high_m) = (world.bounds_m.min, world.bounds_m.max);
    let within = |it: &Aabb| (0..3).all(|k| it.maxs[k] > low_m[k] && it.mins[k] < high_m[k]);
    let mut boxes = Solids::of(world).boxes();
    boxes.retain(within);
    let mut boxes: Vec<(Aabb, bool)> = boxes.into_iter().map(|it| (it, true)).collect();
    boxes.extend(walls(low_m, high_m, radius_m));
    let mut found = Vec::new();
    for (index, (a, a_keeps_off)) in boxes.iter().enumerate() {
        for (b, b_keeps_off) in &boxes[index + 1..] {
            let gap = gap_between(a, b, 2.0 * radius_m);
            let gap = gap.map(|(axis, low_m, high_m)| Gap {
                axis,
                sides_m: [low_m, high_m],
                keeps_off: match a.maxs[axis] == low_m {
                    true => [*a_keeps_off, *b_keeps_off],
                    false => [*b_keeps_off, *a_keeps_off],
                },
            });
            let has_room = |gap: &Gap| {
                let [low_m, high_m] = gap.centres_m(radius_m);
                low_m <= high_m
            };
            found.extend(gap.filter(has_room));
        }
    }
    found
}

/// What bounds a world, as boxes, and whether bodies keep off it: they do off its floor, off its
/// other sides centres alone.
fn walls(
    low_m: Point3<f64>,
    high_m: Point3<f64>,
    radius_m: f64,
) -> impl Iterator<Item = (Aabb, bool)> {
    let around = Vector3::repeat(2.0 * radius_m);
    (0..3).flat_map(move |axis| {
        let [mut before, mut behind] = [(low_m - around, high_m + around); 2];
        before.1[axis] = low_m[axis];
        behind.0[axis] = high_m[axis];
        [(before, axis == 2), (behind, false)].map(|((mins, maxs), keeps_off)| {
            let [mins, maxs] = [mins, maxs].map(|it| [it.x, it.y, it.z].into());
            (Aabb { mins, maxs }, keeps_off)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::cause::{FailureCause, Remedy};
    use crate::plan::outcome::{Control, Planned};
    use crate::scenario::read_world;

    /// Two Kolibris that trade places along x; from where to where, how far to the side and how
    /// high (m).
    fn trade(place: &str, between_m: [f64; 4], rules: &str) -> World {
        trade_of(["kolibri"; 2], place, between_m, rules)
    }

    fn trade_of(
        [one, other]: [&str; 2],
        place: &str,
        [from_x, to_x, y, z]: [f64; 4],
        rules: &str,
    ) -> World {
        let drone = |name: &str, airframe: &str, from_x: f64, to_x: f64| {
            format!(
                r#"(name: "{name}", airframe: "{airframe}", start_m: ({from_x}, {y}, {z}),
                tasks: [(to_m: ({to_x}, {y}, {z}))])"#
            )
        };
        let drones = [
            drone("a", one, from_x, to_x),
            drone("b", other, to_x, from_x),
        ]
        .join(", ");
        let text = format!(r#"(name: "trade", {place}, drones: [{drones}], {rules})"#);
        read_world(&text).expect("in order")
    }

    fn tunnel(width_m: f64, rules: &str) -> World {
        let place = format!("bounds_m: (min: (0, 0, 0), max: (6, {width_m}, {width_m}))");
        let middle_m = 0.5 * width_m;
        trade(&place, [1.0, 5.0, middle_m, middle_m], rules)
    }

    fn planned(world: &World) -> Planned {
        let outcome = crate::plan_world(world, &Control::QUIET).expect("in order");
        outcome.into_planned().expect("starts are apart")
    }

    #[test]
    fn two_that_trade_ends_of_a_tunnel_pass_side_by_side_where_it_just_holds_both() {
        // Bodies of 0.192 m, 0.2 m between them.
        for (width_m, rules) in [
            (0.5, "planning: (motion: Straight)"),
            (0.6, ""),
            (0.65, "planning: (motion: Straight, cell_m: 0.5)"),
            (0.6, "planning: (motion: Straight, cell_m: 0.125)"),
        ] {
            let planned = planned(&tunnel(width_m, rules));
            assert!(
                planned.plan.is_safe() && planned.failures.is_empty(),
                "{width_m} m, {rules}: {:?}",
                planned.failures
            );
        }
    }

    #[test]
    fn so_do_two_between_racks_that_lie_beside_the_lattice() {
        let place = r#"bounds_m: (min: (0, 0, 0), max: (7, 6, 2)), obstacles: [
            (name: "left", min_m: (2, 0, 0), max_m: (5, 2.37, 2)),
            (name: "right", min_m: (2, 3.31, 0), max_m: (5, 6, 2)),
            (name: "above", min_m: (2, 2.37, 1.43), max_m: (5, 3.31, 2)),
            (name: "below", min_m: (2, 2.37, 0), max_m: (5, 3.31, 0.83))]"#;
        let rules = "planning: (motion: Straight), air: (convection: None)";
        let planned = planned(&trade(place, [1.0, 6.0, 3.0, 1.0], rules));
        assert!(planned.plan.is_safe(), "{:?}", planned.failures);
    }

    #[test]
    fn a_small_drone_passes_a_large_one_where_two_large_ones_could_not() {
        let rules = "planning: (motion: Straight), air: (convection: None)";
        let between = |width_m: f64| {
            let place = format!(
                r#"bounds_m: (min: (0, 0, 0), max: (9, 6, 2)), obstacles: [
                (name: "left", min_m: (3, 0, 0), max_m: (6, 2.37, 2)),
                (name: "right", min_m: (3, {}, 0), max_m: (6, 6, 2))]"#,
                2.37 + width_m
            );
            trade_of(
                ["offboard-2", "kolibri"],
                &place,
                [1.0, 8.0, 2.8, 1.0],
                rules,
            )
        };
        let [large_m, small_m] = [0, 1].map(|k| between(1.0).drones[k].vehicle.body_radius_m);
        // Both, 0.1 m off the racks and 0.2 m between them.
        let least_m = 2.0 * (large_m + small_m) + 0.4;
        assert!(least_m + 0.02 < 3.0 * large_m + small_m + 0.4);
        let planned = planned(&between(least_m + 0.02));
        assert!(planned.plan.is_safe(), "{:?}", planned.failures);
    }

    #[test]
    fn lanes_lie_along_both_sides_of_what_holds_two_and_nowhere_else() {
        let spacings = |width_m: f64| {
            let world = tunnel(width_m, "");
            super::spacings(&world, &world.drones.iter().collect::<Vec<_>>())
        };
        let found = spacings(0.6);
        assert_eq!(
            (found[0].cell_m, found[0].through_m),
            (0.6, [None, Some(0.0), None])
        );
        // And on layers half-way up the tunnel.
        assert!(
            found.iter().all(|it| it.through_m[1] == Some(0.0)),
            "{found:?}"
        );
        assert!(spacings(0.38).is_empty() && spacings(1.0).is_empty());
    }

    #[test]
    fn advice_that_leaves_another_refused_names_it_and_is_no_advice_for_that_one() {
        let rules = "planning: (motion: Straight), air: (convection: None)";
        let mut world = tunnel(0.3, rules);
        let refused = planned(&world).failures;
        let [
            FailureCause::Obstructed { remedy: first, .. },
            FailureCause::Obstructed { remedy: second, .. },
        ] = [&refused[0].cause, &refused[1].cause]
        else {
            panic!("{refused:?}");
        };
        let Remedy::MoveTask(moved) = first else {
            panic!("{first:?}");
        };
        assert_eq!(moved.refused, ["b"]);
        assert!(
            first
                .to_string()
                .ends_with("it is planned, but then `b` is refused")
        );
        assert_eq!(*second, Remedy::NoneAtAnyLimit);
        world.drones[0].tasks[0].to_m = moved.to_m;
        let left = planned(&world).failures;
        assert_eq!(left.len(), 1);
        assert_eq!(left[0].drone, "b");
    }
}
