//! Where one drone is relative to another, each on a straight line at a moment of its own.
//!
//! The offset of the mover from the reference is linear in both moments. Over a convex set of pairs
//! of moments it fills a plane polygon in space; a volume that is convex is met on a convex part of
//! the pairs, so that everything asked here has a closed form: the nearest distance to a vertical
//! axis, and the least and greatest delay between the two with which the volume is met.

use nalgebra::{SVector, Vector3};

use super::downwash::Section;

/// A straight line at constant velocity, for as long as asked (any unit of length and time).
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Place at moment zero (z up).
    pub origin: Vector3<f64>,
    /// Motion in a unit of time.
    pub velocity: Vector3<f64>,
}

/// A rectangle has four corners, and each half plane that cuts it adds one, two with rounding:
/// four for moments, two for a range of depths.
const MOST_CORNERS: usize = 16;
/// Relative tolerance of tests that decide between closed forms: thousands of times their rounding.
const TOLERANCE: f64 = 1e-9;

/// A convex polygon of pairs of moments `[reference's, mover's]`, its corners anticlockwise.
#[derive(Clone, Copy, Debug)]
struct Moments {
    corners: [[f64; 2]; MOST_CORNERS],
    count: usize,
}

impl Moments {
    fn corners(&self) -> &[[f64; 2]] {
        &self.corners[..self.count]
    }

    /// Each corner with the next one.
    fn edges(&self) -> impl Iterator<Item = (&[f64; 2], &[f64; 2])> {
        let corners = self.corners();
        corners.iter().zip(corners.iter().cycle().skip(1))
    }

    /// Leaves the part where a linear function is not negative.
    fn clip(&mut self, value: impl Fn(&[f64; 2]) -> f64) {
        if self.corners().iter().all(|corner| value(corner) >= 0.0) {
            return;
        }
        let whole = *self;
        self.count = 0;
        for (here, next) in whole.edges() {
            let (a, b) = (value(here), value(next));
            if a >= 0.0 {
                self.push(*here);
            }
            if (a < 0.0) != (b < 0.0) {
                let share = a / (a - b);
                self.push([0, 1].map(|axis| here[axis] + share * (next[axis] - here[axis])));
            }
        }
    }

    fn push(&mut self, corner: [f64; 2]) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    /// Whether a pair of moments is in it; nothing is in an empty one.
    fn holds(&self, [reference, mover]: [f64; 2]) -> bool {
        if self.count == 0 {
            return false;
        }
        let side = |(a, b): (&[f64; 2], &[f64; 2])| {
            (b[0] - a[0]) * (mover - a[1]) - (b[1] - a[1]) * (reference - a[0])
        };
        self.edges().map(side).fold(f64::INFINITY, f64::min) >= -TOLERANCE
    }
}

/// All offsets of a mover from a reference while both are on their lines.
#[derive(Clone, Copy, Debug)]
pub struct Relative {
    moments: Moments,
    /// Offset at moment zero of both, and how it changes with each one's moment:
    /// `origin + mover · t - reference · t'`.
    origin: Vector3<f64>,
    mover: Vector3<f64>,
    reference: Vector3<f64>,
}

impl Relative {
    /// Of two lines, each between two moments of its own: the reference's first.
    pub fn new(reference: &Line, mover: &Line, [of_reference, of_mover]: [[f64; 2]; 2]) -> Self {
        let ([left_0, left_1], [met_0, met_1]) = (of_reference, of_mover);
        let mut moments = Moments {
            corners: [[0.0; 2]; MOST_CORNERS],
            count: 0,
        };
        for corner in [
            [left_0, met_0],
            [left_1, met_0],
            [left_1, met_1],
            [left_0, met_1],
        ] {
            moments.push(corner);
        }
        Self {
            moments,
            origin: mover.origin - reference.origin,
            mover: mover.velocity,
            reference: reference.velocity,
        }
    }

    /// The part in which the mover's moment is later than the reference's by no less than `least`
    /// and no more than `most`; `None`: there is none.
    pub fn delayed(mut self, [least, most]: [f64; 2]) -> Option<Self> {
        self.moments.clip(|[left, met]| met - left - least);
        self.moments.clip(|[left, met]| most - (met - left));
        (self.moments.count > 0).then_some(self)
    }

    /// The part in which the mover is no less and no more than so far below the reference; `None`:
    /// there is none.
    pub(crate) fn between_depths(mut self, [shallow, deep]: [f64; 2]) -> Option<Self> {
        let (origin, mover, reference) = (self.origin.z, self.mover.z, self.reference.z);
        let depth = |[left, met]: &[f64; 2]| -(origin + mover * met - reference * left);
        self.moments.clip(|at| depth(at) - shallow);
        self.moments.clip(|at| deep - depth(at));
        (self.moments.count > 0).then_some(self)
    }

    /// The same with the mover higher by so much.
    #[must_use]
    pub fn raised(mut self, by: f64) -> Self {
        self.origin.z += by;
        self
    }

    fn offset(&self, [left, met]: [f64; 2]) -> Vector3<f64> {
        self.origin + self.mover * met - self.reference * left
    }

    /// Least and greatest depth of the mover below the reference.
    pub fn depths(&self) -> [f64; 2] {
        let corners = self.moments.corners().iter();
        let depths = corners.map(|&corner| -self.offset(corner).z);
        depths.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], depth| {
            [low.min(depth), high.max(depth)]
        })
    }

    /// Smallest horizontal distance of the mover from a vertical axis that moves with the
    /// reference, `[x, y]` beside it.
    pub fn nearest(&self, [x, y]: [f64; 2]) -> f64 {
        let axis = Vector3::new(x, y, 0.0);
        if self.crosses(&axis) {
            return 0.0;
        }
        let aside = |moments: &[f64; 2]| (self.offset(*moments) - axis).xy();
        let Some(last) = self.moments.corners().last() else {
            return f64::INFINITY;
        };
        let (mut from, mut square) = (aside(last), f64::INFINITY);
        for corner in self.moments.corners() {
            let to = aside(corner);
            square = nearest_square(&from, &to).min(square);
            from = to;
        }
        square.sqrt()
    }

    /// Whether it meets the axis inside. Where both fly along one line, or one stays, the nearest
    /// place is on an edge as well.
    fn crosses(&self, axis: &Vector3<f64>) -> bool {
        let (met_by, left_by) = (self.mover, -self.reference);
        let to = axis - self.origin;
        let turned = met_by.x * left_by.y - met_by.y * left_by.x;
        if turned.abs() <= 1e-12 * met_by.norm() * left_by.norm() {
            return false;
        }
        let met = (to.x * left_by.y - to.y * left_by.x) / turned;
        let left = (met_by.x * to.y - met_by.y * to.x) / turned;
        self.moments.holds([left, met])
    }

    /// By how much the reference's moment is ahead of the mover's, at least and at most, while the
    /// mover's centre is in a section that hangs below the reference; `None`: it never is.
    pub(crate) fn delays_in(&self, section: &Section) -> Option<[f64; 2]> {
        let depth = |moments: &[f64; 2]| -self.offset(*moments).z;
        let mut within = self.moments;
        within.clip(|at| depth(at) - section.from_depth_m);
        within.clip(|at| section.to_depth_m - depth(at));
        let height = section.height_m();
        let widening = if height > 0.0 {
            (section.to_radius_m - section.from_radius_m) / height
        } else {
            0.0
        };
        let flat = |v: &Vector3<f64>| Vector3::new(v.x, v.y, 0.0);
        let round = LinearBall {
            origin: flat(&self.origin),
            mover: flat(&self.mover),
            reference: flat(&self.reference),
            radius: section.from_radius_m - widening * (self.origin.z + section.from_depth_m),
            radius_by_mover: -widening * self.mover.z,
            radius_by_reference: widening * self.reference.z,
        };
        round.delays(&within)
    }

    /// The same while it is nearer to the reference than `radius`.
    pub(crate) fn delays_near(&self, radius: f64) -> Option<[f64; 2]> {
        let round = LinearBall {
            origin: self.origin,
            mover: self.mover,
            reference: self.reference,
            radius,
            radius_by_mover: 0.0,
            radius_by_reference: 0.0,
        };
        round.delays(&self.moments)
    }
}

/// Where an offset is no longer than a radius, both linear in two moments: convex.
struct LinearBall {
    origin: Vector3<f64>,
    mover: Vector3<f64>,
    reference: Vector3<f64>,
    radius: f64,
    radius_by_mover: f64,
    radius_by_reference: f64,
}

impl LinearBall {
    fn at(&self, [left, met]: [f64; 2]) -> (Vector3<f64>, f64) {
        (
            self.origin + self.mover * met - self.reference * left,
            self.radius + self.radius_by_mover * met + self.radius_by_reference * left,
        )
    }

    /// Least and greatest `reference's - mover's` moment: at a corner, on an edge, or where a line
    /// of one delay touches the edge of the round inside the polygon.
    fn delays(&self, moments: &Moments) -> Option<[f64; 2]> {
        let mut found: Option<[f64; 2]> = None;
        let mut add = |[left, met]: [f64; 2]| {
            let delay = left - met;
            let [low, high] = found.unwrap_or([delay; 2]);
            found = Some([low.min(delay), high.max(delay)]);
        };
        for (from, to) in moments.edges() {
            let ((offset, radius), (end, end_radius)) = (self.at(*from), self.at(*to));
            let (by, widening) = (end - offset, end_radius - radius);
            let outside = offset.norm_squared() - radius * radius;
            if outside <= 0.0 {
                add(*from);
            }
            let square = by.norm_squared() - widening * widening;
            let half = offset.dot(&by) - radius * widening;
            for share in roots(square, half, outside) {
                if (0.0..=1.0).contains(&share) {
                    add([0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis])));
                }
            }
        }
        for corner in self.touching().into_iter().flatten() {
            if moments.holds(corner) && self.at(corner).1 >= 0.0 {
                add(corner);
            }
        }
        found
    }

    /// Pairs of moments `(s + delay, s)` at which a line of one delay touches the edge.
    fn touching(&self) -> [Option<[f64; 2]>; 2] {
        let along = self.mover - self.reference;
        let widening = self.radius_by_mover + self.radius_by_reference;
        let square = along.norm_squared() - widening * widening;
        if square <= TOLERANCE * TOLERANCE {
            return [None; 2];
        }
        // Half the linear term in s, and the constant one, by powers of the delay.
        let half = [
            along.dot(&self.origin) - widening * self.radius,
            -along.dot(&self.reference) - widening * self.radius_by_reference,
        ];
        let rest = [
            self.origin.norm_squared() - self.radius * self.radius,
            -self.origin.dot(&self.reference) - self.radius * self.radius_by_reference,
            self.reference.norm_squared() - self.radius_by_reference * self.radius_by_reference,
        ];
        // Both solutions for s are one: the discriminant vanishes.
        let delays = roots(
            half[1] * half[1] - square * rest[2],
            half[0] * half[1] - square * rest[1],
            half[0] * half[0] - square * rest[0],
        );
        delays.map(|delay| {
            let mover = -(half[0] + half[1] * delay) / square;
            let corner = [mover + delay, mover];
            corner.iter().all(|at| at.is_finite()).then_some(corner)
        })
    }
}

/// Solutions of `square x² + 2 half x + rest = 0`; NaN or infinite where there are fewer.
fn roots(square: f64, half: f64, rest: f64) -> [f64; 2] {
    let discriminant = half * half - square * rest;
    if discriminant < 0.0 {
        return [f64::NAN; 2];
    }
    // Of both signs the one that adds: nothing cancels, and a vanishing square leaves the other
    // solution exact.
    let sum = -(half + discriminant.sqrt().copysign(half));
    [sum / square, rest / sum]
}

/// Smallest horizontal distance of a straight path from the vertical axis.
pub(crate) fn nearest_radius_m(from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> f64 {
    nearest_square(&from_m.xy(), &to_m.xy()).sqrt()
}

/// Square of the smallest distance of a straight path from the origin.
pub(crate) fn nearest_square<const D: usize>(from: &SVector<f64, D>, to: &SVector<f64, D>) -> f64 {
    let path = to - from;
    let length_square = path.norm_squared();
    if length_square < 1e-18 {
        return from.norm_squared();
    }
    let at = (-from.dot(&path) / length_square).clamp(0.0, 1.0);
    (from + path * at).norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number from 0 to 1, the same for the same index and unrelated to its neighbours': the
    /// finaliser of MurmurHash3.
    fn at(index: u32) -> f64 {
        let mut bits = index.wrapping_add(1).wrapping_mul(0x9e37_79b9);
        bits = (bits ^ (bits >> 16)).wrapping_mul(0x85eb_ca6b);
        bits = (bits ^ (bits >> 13)).wrapping_mul(0xc2b2_ae35);
        f64::from(bits ^ (bits >> 16)) / f64::from(u32::MAX)
    }

    #[test]
    fn delays_hold_all_pairs_of_moments_in_a_volume_and_end_at_some() {
        const STEPS: u32 = 80;
        let mut met = 0;
        for case in 0..2_000 {
            let value = |k: u32| 2.0 * at(29 * case + k) - 1.0;
            let line = |k: u32| {
                // Every third line lies level, every fifth stands still.
                let level = f64::from(u8::from(!(case + k).is_multiple_of(3)));
                let moves = f64::from(u8::from(!(case + k).is_multiple_of(5)));
                Line {
                    origin: Vector3::new(value(k), value(k + 1), value(k + 2)),
                    velocity: Vector3::new(value(k + 3), value(k + 4), level * value(k + 5))
                        * moves,
                }
            };
            let (reference, mover) = (line(1), line(7));
            let moments = [[0.0, 1.0 + value(13)], [0.0, 1.0 + value(14)]];
            let relative = Relative::new(&reference, &mover, moments);
            let section = Section {
                from_depth_m: 0.4 * value(15) - 0.3,
                to_depth_m: 0.4 * value(16) + 0.5,
                from_radius_m: 0.3 + 0.2 * value(17),
                to_radius_m: 0.3 + 0.3 * value(18),
            };
            let ball = 0.5 + 0.3 * value(19);
            let said = [relative.delays_in(&section), relative.delays_near(ball)];
            let mut seen: [Option<[f64; 2]>; 2] = [None; 2];
            let part =
                |[from, to]: [f64; 2], k: u32| from + (to - from) * f64::from(k) / f64::from(STEPS);
            for (left, met) in (0..=STEPS).flat_map(|a| (0..=STEPS).map(move |b| (a, b))) {
                let pair = [part(moments[0], left), part(moments[1], met)];
                let offset = relative.offset(pair);
                let delay = pair[0] - pair[1];
                let inside = [section.holds(offset), offset.norm() <= ball];
                for (seen, _) in seen.iter_mut().zip(inside).filter(|(_, inside)| *inside) {
                    let [low, high] = seen.unwrap_or([delay; 2]);
                    *seen = Some([low.min(delay), high.max(delay)]);
                }
            }
            for (said, seen) in said.into_iter().zip(seen) {
                let Some([low, high]) = seen else { continue };
                let [from, to] = said.expect("a pair of moments is inside");
                met += 1;
                // Rounding, and what lies between the pairs that were looked at.
                assert!(
                    from <= low + 1e-9 && high - 1e-9 <= to,
                    "{case}: {said:?} {seen:?}"
                );
                let between = 6.0 / f64::from(STEPS);
                assert!(
                    low - from < between + 0.2 && to - high < between + 0.2,
                    "{case}: {said:?} {seen:?}"
                );
            }
        }
        assert!(met > 300, "{met}");
    }
}
