//! One motion: straight, with its questions answered in closed form.

use nalgebra::{Point3, Vector2, Vector3};

/// Two break points this close in time are one moment (s): the plan's times are whole multiples of
/// a tick that is far longer, so a difference this small is rounding.
pub const SAME_TIME_S: f64 = 1e-9;

/// A motion over a span of time, of a drone in the world or of one drone as seen from another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Begin of the span (s).
    pub from_s: f64,
    /// End of the span (s).
    pub until_s: f64,
    /// Place at `from_s` (m).
    start_m: Vector3<f64>,
    /// Constant over the span (m/s).
    velocity_mps: Vector3<f64>,
}

impl Motion {
    /// From one place to another at constant velocity; a span of no length stands at `from_m`.
    pub fn straight(span_s: (f64, f64), from_m: Point3<f64>, to_m: Point3<f64>) -> Motion {
        let duration_s = span_s.1 - span_s.0;
        let moved_m = to_m - from_m;
        let moves = duration_s > SAME_TIME_S && moved_m != Vector3::zeros();
        let velocity_mps = if moves {
            moved_m / duration_s
        } else {
            Vector3::zeros()
        };
        Motion {
            from_s: span_s.0,
            until_s: span_s.1,
            start_m: from_m.coords,
            velocity_mps,
        }
    }

    /// This motion as seen from `other`, over the time both last; `None` where they share none.
    pub fn seen_from(&self, other: &Motion) -> Option<Motion> {
        let (from_s, until_s) = (
            self.from_s.max(other.from_s),
            self.until_s.min(other.until_s),
        );
        (from_s <= until_s).then(|| Motion {
            from_s,
            until_s,
            start_m: self.at_m(from_s) - other.at_m(from_s),
            velocity_mps: self.velocity_mps - other.velocity_mps,
        })
    }

    /// The same motion over a part of its span.
    pub fn during(&self, from_s: f64, until_s: f64) -> Motion {
        Motion {
            from_s,
            until_s,
            start_m: self.at_m(from_s),
            velocity_mps: self.velocity_mps,
        }
    }

    /// Place at a time (m); the formula is not cut off at the ends of the span.
    pub fn at_m(&self, t_s: f64) -> Vector3<f64> {
        self.start_m + self.velocity_mps * (t_s - self.from_s)
    }

    /// Lowest and highest corner of the box that holds the motion over a time window (m).
    pub fn box_m(&self, from_s: f64, until_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (a, b) = (self.at_m(from_s), self.at_m(until_s));
        (a.inf(&b), a.sup(&b))
    }

    /// Highest speed (m/s).
    pub fn max_speed_mps(&self) -> f64 {
        self.velocity_mps.norm()
    }

    /// Constant over the span (m/s): for what moves with it in this module alone.
    pub(super) fn velocity_mps(&self) -> Vector3<f64> {
        self.velocity_mps
    }

    /// How fast it climbs (m/s, up positive).
    pub fn climb_mps(&self) -> f64 {
        self.velocity_mps.z
    }

    /// Farthest that any place of the window lies from the place at its middle (m), or an upper
    /// bound.
    pub fn half_path_m(&self, from_s: f64, until_s: f64) -> f64 {
        0.5 * self.max_speed_mps() * (until_s - from_s)
    }

    /// The motion over a time window as seen from above, made ready for many axes.
    pub fn level_path(&self, from_s: f64, until_s: f64) -> LevelPath {
        let (begin_m, end_m) = (self.at_m(from_s).xy(), self.at_m(until_s).xy());
        let along_m = end_m - begin_m;
        LevelPath {
            begin_m,
            along_m,
            length2_m2: along_m.norm_squared(),
        }
    }

    /// When and how near it comes to the origin (s, m): closed form.
    pub fn nearest_to_origin(&self) -> (f64, f64) {
        let span_s = (self.from_s, self.until_s);
        let t_s = self.nearest_s(&self.velocity_mps, span_s);
        (t_s, self.at_m(t_s).norm())
    }

    /// When it is nearest to the vertical axis through the origin within a span (s): closed form.
    pub fn nearest_to_axis_s(&self, span_s: (f64, f64)) -> f64 {
        let along_mps = Vector3::new(self.velocity_mps.x, self.velocity_mps.y, 0.0);
        self.nearest_s(&along_mps, span_s)
    }

    /// When it is nearest to the origin within a span (s), along these parts of its velocity (m/s).
    fn nearest_s(&self, along_mps: &Vector3<f64>, (low_s, high_s): (f64, f64)) -> f64 {
        let speed2 = along_mps.norm_squared();
        if speed2 > 0.0 {
            (self.from_s - self.start_m.dot(along_mps) / speed2).clamp(low_s, high_s)
        } else {
            low_s
        }
    }

    /// When it is inside the open ball of this radius (m) around the origin (s); `None`: never.
    pub fn inside_ball_s(&self, radius_m: f64) -> Option<(f64, f64)> {
        let span = below_zero(
            self.velocity_mps.norm_squared(),
            self.start_m.dot(&self.velocity_mps),
            self.start_m.norm_squared() - radius_m * radius_m,
        );
        self.cut(span?)
    }

    /// When it is inside the open upright cylinder of this radius (m) around the origin's axis,
    /// between two heights (m), in s; `None`: never.
    pub fn inside_cylinder_s(&self, radius_m: f64, z_m: (f64, f64)) -> Option<(f64, f64)> {
        let (p, v) = (self.start_m, self.velocity_mps);
        let within_radius = below_zero(
            v.xy().norm_squared(),
            p.xy().dot(&v.xy()),
            p.xy().norm_squared() - radius_m * radius_m,
        );
        let within_heights = if v.z != 0.0 {
            let (a, b) = ((z_m.0 - p.z) / v.z, (z_m.1 - p.z) / v.z);
            (a.min(b), a.max(b))
        } else if z_m.0 < p.z && p.z < z_m.1 {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            return None;
        };
        let (a, b) = (within_radius?, within_heights);
        let both = (a.0.max(b.0), a.1.min(b.1));
        self.cut(Some(both).filter(|(a, b)| a <= b)?)
    }

    /// A span counted from `from_s`, cut to this motion's own; `None`: nothing is left of it.
    fn cut(&self, (a, b): (f64, f64)) -> Option<(f64, f64)> {
        let begin_s = (self.from_s + a).max(self.from_s);
        let end_s = (self.from_s + b).min(self.until_s);
        (begin_s <= end_s).then_some((begin_s, end_s))
    }
}

/// A motion over a window of time as seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelPath {
    /// Where it begins (m, x and y).
    begin_m: Vector2<f64>,
    /// From its begin to its end (m).
    along_m: Vector2<f64>,
    /// Square of its length (m²); 0: it stands.
    length2_m2: f64,
}

impl LevelPath {
    /// Its nearest place to the vertical axis through minus `shift_m` (m, x and y), as seen from
    /// there (m): closed form.
    #[inline]
    pub fn nearest_m(&self, shift_m: [f64; 2]) -> Vector2<f64> {
        let begin_m = self.begin_m + Vector2::from(shift_m);
        if self.length2_m2 <= 0.0 {
            return begin_m;
        }
        let share = -begin_m.dot(&self.along_m) / self.length2_m2;
        begin_m + self.along_m * share.clamp(0.0, 1.0)
    }
}

/// The open interval of τ where `a τ² + 2 b τ + c < 0`, for `a >= 0`; everything or nothing where
/// `a = 0` (then `b` is 0 too: two drones at rest to one another, the case a ray cast misses).
fn below_zero(a: f64, b: f64, c: f64) -> Option<(f64, f64)> {
    if a <= 0.0 {
        return (c < 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let discriminant = b * b - a * c;
    if discriminant <= 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    Some(((-b - root) / a, (-b + root) / a))
}
