//! Two motions, each at a moment of its own: one drone early or late against the other.
//!
//! With `t` on the clock of the one and `u` on that of the other, a range of shifts is the strip
//! `low <= u - t <= high`. Of two straight motions over their spans it cuts a convex polygon, over
//! which the offset `one(t) - other(u)` is linear: its box, its nearest place to the origin and to
//! the vertical through it follow from the corners and edges, without sampling. A cubic goes by its
//! chord, and all answers allow for how far it may be from that.

use nalgebra::{Vector2, Vector3};

use super::motion::{Motion, nearer};

/// On the edge counts as inside: up to this (s, and m where heights are cut) is rounding.
const EDGE: f64 = 1e-9;

/// Corners that a polygon may have: cuts run along four directions (either clock, the shift, the
/// height), two a direction; a few more for corners that rounding makes twice.
const MOST_CORNERS: usize = 12;

/// Where one drone can be as seen from another, over all moments of both that a range of shifts
/// allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shifted {
    /// Both clocks count from here (s).
    since_s: f64,
    /// Moments of the one and of the other, counter-clockwise; the first `count` of them (s).
    corners_s: [Vector2<f64>; MOST_CORNERS],
    count: usize,
    /// Offset where both clocks are 0 (m).
    start_m: Vector3<f64>,
    /// Of the one, and of the other (m/s).
    velocities_mps: [Vector3<f64>; 2],
    /// How far the offset may be from this, where motions are not straight (m).
    off_m: f64,
}

/// A moment of each drone (s), and how far apart they are then (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Of the one.
    pub t_s: f64,
    /// Of the other.
    pub other_s: f64,
    /// m.
    pub distance_m: f64,
}

impl Shifted {
    /// Both motions over their spans, the clock of the other ahead by at least and at most so much
    /// (s); `None`: no two moments of them are so far apart.
    pub fn new(one: &Motion, other: &Motion, shift_s: (f64, f64)) -> Option<Shifted> {
        Shifted::of_chords(&one.chord(), &other.chord(), shift_s)
    }

    /// The same of their chords, and how far they may be from those ([`Motion::chord`]).
    pub(crate) fn of_chords(
        (one, one_off_m): &(Motion, f64),
        (other, other_off_m): &(Motion, f64),
        shift_s: (f64, f64),
    ) -> Option<Shifted> {
        let off_m = one_off_m + other_off_m;
        let since_s = one.from_s;
        let (t_s, u_s) = (
            (0.0, one.until_s - since_s),
            (other.from_s - since_s, other.until_s - since_s),
        );
        let mut corners_s = [Vector2::zeros(); MOST_CORNERS];
        let rectangle = [
            (t_s.0, u_s.0),
            (t_s.1, u_s.0),
            (t_s.1, u_s.1),
            (t_s.0, u_s.1),
        ];
        for (corner, (t, u)) in corners_s.iter_mut().zip(rectangle) {
            *corner = Vector2::new(t, u);
        }
        let all = Shifted {
            since_s,
            corners_s,
            count: rectangle.len(),
            start_m: one.at_m(since_s) - other.at_m(since_s),
            velocities_mps: [one, other].map(|it| it.velocity_mps(it.from_s)),
            off_m,
        };
        all.with_shift(shift_s)
    }

    /// What is left of it where `normal . (t, u) <= most`; `None`: nothing.
    fn cut(mut self, normal: Vector2<f64>, most: f64) -> Option<Shifted> {
        let beyond = |corner: &Vector2<f64>| normal.dot(corner) - most;
        let corners = self.corners_s;
        let corners = &corners[..self.count];
        // Mostly all of it is.
        if corners.iter().all(|corner| beyond(corner) <= EDGE) {
            return Some(self);
        }
        self.count = 0;
        for (k, corner) in corners.iter().enumerate() {
            let next = &corners[(k + 1) % corners.len()];
            let (here, there) = (beyond(corner), beyond(next));
            if here <= EDGE {
                self.push(*corner);
            }
            if (here > EDGE) != (there > EDGE) {
                self.push(corner + (next - corner) * ((here - EDGE) / (here - there)));
            }
        }
        (self.count > 0).then_some(self)
    }

    /// Appends a corner, unless it is the one before.
    fn push(&mut self, corner: Vector2<f64>) {
        let is_known = self.count > 0 && self.corners_s[self.count - 1] == corner;
        if !is_known && self.count < MOST_CORNERS {
            self.corners_s[self.count] = corner;
            self.count += 1;
        }
    }

    fn corners(&self) -> &[Vector2<f64>] {
        &self.corners_s[..self.count]
    }

    /// The moments of the one from a time on and up to another (s); `None`: none.
    pub fn during(&self, from_s: f64, until_s: f64) -> Option<Shifted> {
        self.cut(Vector2::x(), until_s - self.since_s)?
            .cut(-Vector2::x(), self.since_s - from_s)
    }

    /// The moments of the other from a time on and up to another (s); `None`: none.
    pub(crate) fn other_during(&self, from_s: f64, until_s: f64) -> Option<Shifted> {
        self.cut(Vector2::y(), until_s - self.since_s)?
            .cut(-Vector2::y(), self.since_s - from_s)
    }

    /// Where the one is between two heights as seen from the other (m); `None`: nowhere.
    pub(crate) fn between_heights(&self, low_m: f64, high_m: f64) -> Option<Shifted> {
        let along = Vector2::new(self.velocities_mps[0].z, -self.velocities_mps[1].z);
        let start_m = self.start_m.z;
        self.cut(along, high_m + self.off_m - start_m)?
            .cut(-along, start_m - low_m + self.off_m)
    }

    /// Only shifts within a range (s); `None`: none.
    pub(crate) fn with_shift(&self, (low_s, high_s): (f64, f64)) -> Option<Shifted> {
        self.cut(Vector2::new(-1.0, 1.0), high_s)?
            .cut(Vector2::new(1.0, -1.0), -low_s)
    }

    /// First and last moment of the one, and of the other (s).
    pub(crate) fn spans_s(&self) -> [(f64, f64); 2] {
        let first = self.corners_s[0];
        let (low, high) = (self.corners().iter()).fold((first, first), |(low, high), it| {
            (low.inf(it), high.sup(it))
        });
        [0, 1].map(|k| (self.since_s + low[k], self.since_s + high[k]))
    }

    /// Lowest and highest corner of the box that holds every offset (m).
    pub(crate) fn box_m(&self) -> (Vector3<f64>, Vector3<f64>) {
        let first_m = self.offset_m(&self.corners_s[0]);
        let offsets = self.corners()[1..].iter().map(|it| self.offset_m(it));
        let (low_m, high_m) = offsets.fold((first_m, first_m), |(low, high), it| {
            (low.inf(&it), high.sup(&it))
        });
        let off_m = Vector3::repeat(self.off_m);
        (low_m - off_m, high_m + off_m)
    }

    /// How far the offset may be from what is said of it, where motions are not straight (m).
    pub fn off_m(&self) -> f64 {
        self.off_m
    }

    /// Offset at a moment of each clock (m).
    fn offset_m(&self, at: &Vector2<f64>) -> Vector3<f64> {
        let [one, other] = &self.velocities_mps;
        self.start_m + one * at.x - other * at.y
    }

    /// Where the two are nearest to one another: closed form; never farther than they come.
    pub fn nearest(&self) -> Approach {
        let (at, offset_m) = self.least(self.start_m, &self.velocities_mps);
        self.approach(&at, offset_m.norm())
    }

    /// Where the one is nearest to the vertical through the other: closed form; never farther than
    /// it comes.
    pub(crate) fn nearest_to_axis(&self) -> Approach {
        let (start_m, velocities_mps) = self.seen_from_above();
        let (at, offset_m) = self.least(start_m, &velocities_mps);
        self.approach(&at, offset_m.norm())
    }

    /// Every offset as seen from above, made ready for many points.
    pub(crate) fn level_region(&self) -> LevelRegion {
        let mut region = LevelRegion {
            edges: [Edge::default(); MOST_CORNERS],
            count: 0,
            off_m: self.off_m,
        };
        let mut from_m = self.offset_m(&self.corners_s[self.count - 1]).xy();
        for corner in self.corners() {
            let to_m = self.offset_m(corner).xy();
            let along_m = to_m - from_m;
            let length_m2 = along_m.norm_squared();
            // Drones that hover, or fly side by side, are at one place all the while.
            if length_m2 > 0.0 {
                region.edges[region.count] = Edge {
                    from_m,
                    along_m,
                    over_length_m2: length_m2.recip(),
                };
                region.count += 1;
            }
            from_m = to_m;
        }
        if region.count == 0 {
            (region.edges[0].from_m, region.count) = (from_m, 1);
        }
        region
    }

    /// Start and velocities without heights.
    fn seen_from_above(&self) -> (Vector3<f64>, [Vector3<f64>; 2]) {
        let level = |v: &Vector3<f64>| Vector3::new(v.x, v.y, 0.0);
        let [one, other] = &self.velocities_mps;
        (level(&self.start_m), [level(one), level(other)])
    }

    fn approach(&self, at: &Vector2<f64>, distance_m: f64) -> Approach {
        Approach {
            t_s: self.since_s + at.x,
            other_s: self.since_s + at.y,
            distance_m: (distance_m - self.off_m).max(0.0),
        }
    }

    /// Where `|start + v t - w u|` is least over the polygon, and the vector there: at the foot of
    /// the perpendicular on the plane of the offsets if that lies within, else on an edge.
    fn least(
        &self,
        start_m: Vector3<f64>,
        [v, w]: &[Vector3<f64>; 2],
    ) -> (Vector2<f64>, Vector3<f64>) {
        let at = |it: &Vector2<f64>| start_m + v * it.x - w * it.y;
        let (vv, vw, ww) = (v.norm_squared(), v.dot(w), w.norm_squared());
        let determinant = vv * ww - vw * vw;
        // Where both fly along one line the least is on an edge.
        if determinant > 1e-9 * vv * ww {
            let (along_v, along_w) = (start_m.dot(v), start_m.dot(w));
            let foot = Vector2::new(
                (vw * along_w - ww * along_v) / determinant,
                (vv * along_w - vw * along_v) / determinant,
            );
            if self.holds(&foot) {
                return (foot, at(&foot));
            }
        }
        let corners = self.corners();
        let mut best = (corners[0], at(&corners[0]));
        let mut best_m2 = best.1.norm_squared();
        for (k, corner) in corners.iter().enumerate() {
            let next = &corners[(k + 1) % corners.len()];
            let (from_m, along_m) = (at(corner), at(next) - at(corner));
            let length_m2 = along_m.norm_squared();
            let share = match length_m2 > 0.0 {
                true => (-from_m.dot(&along_m) / length_m2).clamp(0.0, 1.0),
                false => 0.0,
            };
            let here_m = from_m + along_m * share;
            if here_m.norm_squared() < best_m2 {
                best_m2 = here_m.norm_squared();
                best = (corner + (next - corner) * share, here_m);
            }
        }
        best
    }

    /// Whether a moment of each clock lies within.
    fn holds(&self, at: &Vector2<f64>) -> bool {
        let corners = self.corners();
        let mut ends = corners.iter().zip(corners.iter().cycle().skip(1));
        corners.len() > 2 && ends.all(|(a, b)| (b - a).perp(&(at - a)) >= 0.0)
    }
}

/// A convex region as seen from above (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelRegion {
    /// In order, either way around, or one without length; the first `count` of them.
    edges: [Edge; MOST_CORNERS],
    count: usize,
    /// How far a place may be beside it (m).
    off_m: f64,
}

/// From one corner of a region to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Edge {
    from_m: Vector2<f64>,
    /// To the next (m).
    along_m: Vector2<f64>,
    /// One over the square of its length (1/m²); 0 without length.
    over_length_m2: f64,
}

impl LevelRegion {
    /// Its nearest place to the vertical axis through minus `shift_m` (m, x and y), as seen from
    /// there (m): closed form; never farther than it comes.
    pub(crate) fn nearest_m(&self, shift_m: [f64; 2]) -> Vector2<f64> {
        let shift_m = Vector2::from(shift_m);
        let (mut nearest_m, mut nearest_m2) = (Vector2::zeros(), f64::INFINITY);
        let (mut left, mut right) = (self.count > 2, self.count > 2);
        for edge in &self.edges[..self.count] {
            let from_m = edge.from_m + shift_m;
            let turn = from_m.perp(&edge.along_m);
            left &= turn > 0.0;
            right &= turn < 0.0;
            let share = -from_m.dot(&edge.along_m) * edge.over_length_m2;
            let here_m = from_m + edge.along_m * share.clamp(0.0, 1.0);
            let here_m2 = here_m.norm_squared();
            if here_m2 < nearest_m2 {
                (nearest_m, nearest_m2) = (here_m, here_m2);
            }
        }
        match left || right {
            true => Vector2::zeros(),
            false => nearer(nearest_m, self.off_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number in 0..1 that depends on an index alone.
    fn at(k: u32) -> f64 {
        let mixed = u64::from(k).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        ((mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 11) as f64
            / (1_u64 << 53) as f64
    }

    fn motion(k: u32, since_s: f64) -> Motion {
        let place = |n: u32| {
            [0, 1, 2]
                .map(|axis| 4.0 * at(10 * k + 3 * n + axis) - 2.0)
                .into()
        };
        let from_s = since_s + at(10 * k + 7);
        let to_m = if k.is_multiple_of(5) {
            place(0)
        } else {
            place(1)
        };
        Motion::straight((from_s, from_s + 0.2 + at(10 * k + 8)), place(0), to_m)
    }

    #[test]
    fn the_nearest_place_of_two_shifted_motions_is_that_of_a_fine_grid_of_moments_of_both() {
        let mut met = 0;
        for k in 0..400 {
            let since_s = if k % 3 == 0 { 1e6 } else { 0.0 };
            let (one, other) = (motion(2 * k, since_s), motion(2 * k + 1, since_s));
            let shift_s = (-0.3 * at(k), 0.3 * at(k + 1));
            let shifted = Shifted::new(&one, &other, shift_s);
            let (mut near_m, mut level_m) = (f64::INFINITY, f64::INFINITY);
            let heights_m = (-1.0, -0.1);
            let mut between_m = f64::INFINITY;
            let steps = 120;
            for n in 0..=steps * steps {
                let share = |n: u32| f64::from(n) / f64::from(steps);
                let t_s = one.from_s + share(n % (steps + 1)) * (one.until_s - one.from_s);
                let u_s = other.from_s + share(n / (steps + 1)) * (other.until_s - other.from_s);
                if u_s - t_s < shift_s.0 || u_s - t_s > shift_s.1 {
                    continue;
                }
                let offset_m = one.at_m(t_s) - other.at_m(u_s);
                near_m = near_m.min(offset_m.norm());
                level_m = level_m.min(offset_m.xy().norm());
                if offset_m.z > heights_m.0 && offset_m.z < heights_m.1 {
                    between_m = between_m.min(offset_m.xy().norm());
                }
                let (low_m, high_m) = shifted.as_ref().expect("they share moments").box_m();
                assert!((low_m - offset_m).max() < 1e-6 && (offset_m - high_m).max() < 1e-6);
            }
            if near_m == f64::INFINITY {
                continue;
            }
            met += 1;
            let shifted = shifted.expect("they share moments");
            // A step of the grid is at most 0.07 m of path; the least is at most half of it on each
            // of two clocks nearer.
            let close = |found_m: f64, sampled_m: f64| {
                assert!(found_m < sampled_m + 1e-6, "{k}: {found_m} > {sampled_m}");
                assert!(found_m > sampled_m - 0.2, "{k}: {found_m} < {sampled_m}");
            };
            let nearest = shifted.nearest();
            close(nearest.distance_m, near_m);
            let apart_m = (one.at_m(nearest.t_s) - other.at_m(nearest.other_s)).norm();
            assert!((apart_m - nearest.distance_m).abs() < 1e-6);
            let shift = nearest.other_s - nearest.t_s;
            assert!(shift >= shift_s.0 - 1e-6 && shift <= shift_s.1 + 1e-6);
            close(shifted.nearest_to_axis().distance_m, level_m);
            close(shifted.level_region().nearest_m([0.0; 2]).norm(), level_m);
            let between = shifted.between_heights(heights_m.0, heights_m.1);
            if between_m < f64::INFINITY {
                let between = between.expect("a sample lies between");
                close(between.nearest_to_axis().distance_m, between_m);
            }
        }
        assert!(met > 250, "{met} pairs meet");
    }
}
