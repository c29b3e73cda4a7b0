//! When two steps are too near one another, in closed form: straight ways at constant speed, and a
//! circle.
//!
//! Both begin at places of the lattice. With `δ` how much later one begins than the other, the
//! least distance over the time that they share is convex in `δ` (the minimum of a convex function
//! over part of a convex set), so that the `δ` at which they are too near are one interval.

use costmap::GoldenSection;

/// A way on the floor, in cells: where it begins, how far it leads, and its ticks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    pub(super) from: [f64; 2],
    pub(super) by: [f64; 2],
    pub(super) ticks: f64,
}

/// Rounds of search for the nearest: chosen here, a ten-thousandth of the delays looked at, a
/// hundredth of a tick for steps of seconds.
const ROUNDS: usize = 20;
/// Rounds of search for where it is too near: chosen here, a four-thousandth of these delays.
const EDGE_ROUNDS: usize = 12;

/// First and last moment of a way, in ticks since it began, at which it is nearer to the origin
/// than `radius`.
pub(super) fn passing(way: &Way, radius: f64) -> Option<[f64; 2]> {
    let [x, y] = way.from;
    let [u, v] = way.by;
    let (a, b, c) = (
        u * u + v * v,
        x * u + y * v,
        x * x + y * y - radius * radius,
    );
    if a == 0.0 {
        return (c < 0.0).then_some([0.0, way.ticks]);
    }
    let root = b * b - a * c;
    if root <= 0.0 {
        return None;
    }
    let share = |sign: f64| ((-b + sign * root.sqrt()) / a).clamp(0.0, 1.0);
    let (first, last) = (share(-1.0), share(1.0));
    (first < last).then_some([first * way.ticks, last * way.ticks])
}

/// Least distance of a way from the origin.
pub(super) fn least_distance(way: &Way) -> f64 {
    let [x, y] = way.from;
    let [u, v] = way.by;
    nearest_square_on(x, y, u, v).sqrt()
}

/// How much later, in ticks, the first way begins than the second when they come nearest, and their
/// least distance then, if it is less than `far`; else a bound.
pub(super) fn nearest(first: &Way, second: &Way, far: f64) -> (f64, f64) {
    let range = |axis: usize, way: &Way| {
        let ends = [way.from[axis], way.from[axis] + way.by[axis]];
        [ends[0].min(ends[1]), ends[0].max(ends[1])]
    };
    let apart = |axis: usize| {
        let ([a, b], [c, d]) = (range(axis, first), range(axis, second));
        (a - d).max(c - b).max(0.0)
    };
    let gap = apart(0).hypot(apart(1));
    let (low, high) = (-first.ticks, second.ticks);
    if gap >= far {
        return (low, gap);
    }
    let least = |delta: f64| nearest_square(first, second, delta);
    let middle = GoldenSection::of([low, high], ROUNDS, least).middle();
    (middle, least(middle).sqrt())
}

/// How much later, in ticks, the first way may not begin than the second: from and to. They are too
/// near if it begins `delta` later.
pub(super) fn too_near(first: &Way, second: &Way, delta: f64, radius: f64) -> [f64; 2] {
    let least = |delta: f64| nearest_square(first, second, delta);
    let square = radius * radius;
    // From within outwards.
    let edge = |outside: f64| {
        if least(outside) < square {
            return outside;
        }
        let (mut inside, mut outside) = (delta, outside);
        for _ in 0..EDGE_ROUNDS {
            let between = 0.5 * (inside + outside);
            if least(between) < square {
                inside = between;
            } else {
                outside = between;
            }
        }
        outside
    };
    [-first.ticks, second.ticks].map(edge)
}

/// Square of the least distance while both last, if the first begins `delta` ticks later.
fn nearest_square(first: &Way, second: &Way, delta: f64) -> f64 {
    let time = [delta.max(0.0), second.ticks.min(delta + first.ticks)];
    let apart = |at: f64| {
        [0, 1].map(|axis| {
            let one = first.from[axis] + first.by[axis] * (at - delta) / first.ticks;
            let other = second.from[axis] + second.by[axis] * at / second.ticks;
            one - other
        })
    };
    let ([x, y], [p, q]) = (apart(time[0]), apart(time[1]));
    nearest_square_on(x, y, p - x, q - y)
}

/// Square of the least distance from the origin of a way that begins at `x`, `y` and leads on by
/// `u`, `v`.
fn nearest_square_on(x: f64, y: f64, u: f64, v: f64) -> f64 {
    let square = u * u + v * v;
    let share = if square == 0.0 {
        0.0
    } else {
        (-(x * u + y * v) / square).clamp(0.0, 1.0)
    };
    (x + share * u).powi(2) + (y + share * v).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn way(from: [f64; 2], by: [f64; 2], ticks: f64) -> Way {
        Way { from, by, ticks }
    }

    #[test]
    fn a_way_past_a_circle_is_in_it_between_two_moments() {
        let past = way([-1.0, 0.3], [2.0, 0.0], 100.0);
        let [first, last] = passing(&past, 0.5).expect("0.3 is nearer");
        assert!((first - 30.0).abs() < 1e-9 && (last - 70.0).abs() < 1e-9);
        assert_eq!(passing(&past, 0.25), None);
        assert_eq!(
            passing(&way([0.2, 0.0], [0.0; 2], 9.0), 0.5),
            Some([0.0, 9.0])
        );
    }

    #[test]
    fn a_drone_may_follow_another_when_it_is_a_radius_ahead() {
        // Both one cell in 50 ticks along x, the first one cell behind: half a cell apart from 25
        // ticks on.
        let behind = way([-1.0, 0.0], [1.0, 0.0], 50.0);
        let ahead = way([0.0, 0.0], [1.0, 0.0], 50.0);
        let (delta, least) = nearest(&behind, &ahead, 2.0);
        assert!(least < 0.5);
        let [from, to] = too_near(&behind, &ahead, delta, 0.5);
        assert!((to + 25.0).abs() < 0.1, "{from} {to}");
    }

    #[test]
    fn no_delay_outside_the_interval_brings_two_steps_too_near() {
        let radius = 0.55;
        for case in 0..27 * 27 {
            let (a, b) = (case % 27, case / 27);
            let by = |k: i32| [f64::from(k % 3 - 1), f64::from(k / 3 % 3 - 1)];
            let ticks = |k: i32| [50.0, 71.0, 87.0][(k % 3) as usize];
            let first = way([0.0, 0.0], by(a), ticks(a));
            let second = way([f64::from(case % 5 - 2), 1.0], by(b), ticks(b));
            let (at_best, least) = nearest(&first, &second, 2.0);
            let found = (least < radius).then(|| too_near(&first, &second, at_best, radius));
            for delta in -(first.ticks as i32)..=second.ticks as i32 {
                let delta = f64::from(delta);
                let near = nearest_square(&first, &second, delta).sqrt() < radius;
                let said = found.is_some_and(|[from, to]| from <= delta && delta <= to);
                assert!(said || !near, "case {case}, {delta} ticks");
                // A search ends within a hundredth of a tick or two.
                assert!(nearest_square(&first, &second, delta).sqrt() >= least - 1e-3);
            }
        }
    }
}
