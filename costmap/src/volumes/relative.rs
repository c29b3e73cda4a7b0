//! Where one drone is relative to another, each on a straight line at a moment of its own.
//!
//! The offset of the mover from the reference is linear in both moments. Over a convex set of pairs
//! of moments it fills a plane polygon in space, so that the depths and the nearest distance to a
//! vertical axis have a closed form.

use nalgebra::Vector3;

/// A straight line at constant velocity, for as long as asked (any unit of length and time).
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Place at moment zero (z up).
    pub origin: Vector3<f64>,
    /// Motion in a unit of time.
    pub velocity: Vector3<f64>,
}

/// A rectangle has four corners, and each half plane that cuts it adds one, two with rounding:
/// two for moments, two for a range of depths.
const MOST_CORNERS: usize = 12;
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

    /// The part where a linear function is not negative.
    fn clip(&self, value: impl Fn(&[f64; 2]) -> f64) -> Moments {
        let mut kept = Moments {
            corners: [[0.0; 2]; MOST_CORNERS],
            count: 0,
        };
        for (here, next) in self.edges() {
            let (a, b) = (value(here), value(next));
            if a >= 0.0 {
                kept.push(*here);
            }
            if (a < 0.0) != (b < 0.0) {
                let share = a / (a - b);
                kept.push([0, 1].map(|axis| here[axis] + share * (next[axis] - here[axis])));
            }
        }
        kept
    }

    fn push(&mut self, corner: [f64; 2]) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    fn holds(&self, [reference, mover]: [f64; 2]) -> bool {
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

    /// The part in which the mover's moment is later than the reference's, by no more than `most`;
    /// `None`: there is none.
    pub fn delayed(mut self, most: f64) -> Option<Self> {
        self.moments = self.moments.clip(|[left, met]| met - left);
        self.moments = self.moments.clip(|[left, met]| most - (met - left));
        (self.moments.count > 0).then_some(self)
    }

    /// The same with the mover higher by so much.
    #[must_use]
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

    /// Smallest horizontal distance of the mover from a vertical axis that moves with the reference, `[x, y]` beside it.
    pub fn nearest(&self, [x, y]: [f64; 2]) -> f64 {
        let axis = Vector3::new(x, y, 0.0);
        if self.passes(&axis) {
            return 0.0;
        }
        let side = |(a, b): (&[f64; 2], &[f64; 2])| {
            nearest_radius_m(&(self.offset(*a) - axis), &(self.offset(*b) - axis))
        };
        (self.moments.edges())
            .map(side)
            .fold(f64::INFINITY, f64::min)
    }

    /// Whether it meets the axis inside. Where both fly along one line, or one stays, the nearest place is on an edge as well.
    fn passes(&self, axis: &Vector3<f64>) -> bool {
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
}

/// Smallest horizontal distance of a straight path from the vertical axis.
pub fn nearest_radius_m(from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> f64 {
    let (from_m, path_m) = (from_m.xy(), to_m.xy() - from_m.xy());
    let length_square = path_m.norm_squared();
    if length_square < 1e-18 {
        return from_m.norm();
    }
    let at = (-from_m.dot(&path_m) / length_square).clamp(0.0, 1.0);
    (from_m + path_m * at).norm()
}
