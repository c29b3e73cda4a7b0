//! One motion: a straight line or a cubic in time, with the questions that checks ask of it.
//!
//! A straight motion answers in closed form. A cubic is bounded by its Bernstein control points, of
//! which every part of it has its own: it stays in the box of its four places, no faster than its
//! three velocities, and no farther from its chord at the same time than three quarters of how far
//! the two inner places are from theirs on the chord. Where a chord decides nothing the span is
//! halved (G. Farin, "Curves and Surfaces for CAGD", chapters 5 and 6).

use nalgebra::{Point3, Vector2, Vector3};

/// Two break points this close in time are one moment (s): the plan's times are whole multiples of
/// a tick that is far longer, so a difference this small is rounding.
pub const SAME_TIME_S: f64 = 1e-9;

/// A part of a cubic that stays this near to its chord counts as the chord (m): chosen here, a
/// hundredth of what bodies may touch by.
const STRAIGHT_M: f64 = 1e-5;

/// Halvings of one cubic at most: a part is a millionth of it then.
const MOST_HALVINGS: u32 = 20;

/// First and last time (s) at which a chord is in a shape that is widened by a length (m).
type InsideOfChord<'a> = dyn Fn(&Motion, f64) -> Option<(f64, f64)> + 'a;

/// A motion over a span of time, of a drone in the world or of one drone as seen from another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Begin of the span (s).
    pub from_s: f64,
    /// End of the span (s).
    pub until_s: f64,
    /// Place at `from_s` (m).
    start_m: Vector3<f64>,
    /// At `from_s` (m/s).
    velocity_mps: Vector3<f64>,
    /// At `from_s` (m/s²); 0 where it is straight.
    acceleration_mps2: Vector3<f64>,
    /// Constant over the span (m/s³); 0 where it is straight.
    jerk_mps3: Vector3<f64>,
    /// Its velocity is constant.
    is_straight: bool,
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
            acceleration_mps2: Vector3::zeros(),
            jerk_mps3: Vector3::zeros(),
            is_straight: true,
        }
    }

    /// The cubic with these Bézier points (m) over a span that is longer than [`SAME_TIME_S`], its
    /// parameter linear in time.
    pub fn cubic(span_s: (f64, f64), [a, b, c, d]: [Point3<f64>; 4]) -> Motion {
        let duration_s = span_s.1 - span_s.0;
        let per_s = 1.0 / duration_s;
        let (first_m, last_m) = (b - a, d - c);
        let middle_m = c - b;
        let acceleration_mps2 = (middle_m - first_m) * (6.0 * per_s * per_s);
        let jerk_mps3 = (last_m - middle_m * 2.0 + first_m) * (6.0 * per_s * per_s * per_s);
        Motion {
            from_s: span_s.0,
            until_s: span_s.1,
            start_m: a.coords,
            velocity_mps: first_m * (3.0 * per_s),
            acceleration_mps2,
            jerk_mps3,
            is_straight: acceleration_mps2 == Vector3::zeros() && jerk_mps3 == Vector3::zeros(),
        }
    }

    /// Whether its velocity is constant.
    #[inline]
    pub fn is_straight(&self) -> bool {
        self.is_straight
    }

    /// This motion as seen from `other`, over the time both last; `None` where they share none.
    pub(crate) fn seen_from(&self, other: &Motion) -> Option<Motion> {
        let (from_s, until_s) = (
            self.from_s.max(other.from_s),
            self.until_s.min(other.until_s),
        );
        (from_s <= until_s).then(|| Motion {
            from_s,
            until_s,
            start_m: self.at_m(from_s) - other.at_m(from_s),
            velocity_mps: self.velocity_mps(from_s) - other.velocity_mps(from_s),
            acceleration_mps2: self.acceleration_mps2(from_s) - other.acceleration_mps2(from_s),
            jerk_mps3: self.jerk_mps3 - other.jerk_mps3,
            is_straight: self.is_straight && other.is_straight,
        })
    }

    /// The same motion over a part of its span.
    pub fn during(&self, from_s: f64, until_s: f64) -> Motion {
        Motion {
            from_s,
            until_s,
            start_m: self.at_m(from_s),
            velocity_mps: self.velocity_mps(from_s),
            acceleration_mps2: self.acceleration_mps2(from_s),
            jerk_mps3: self.jerk_mps3,
            is_straight: self.is_straight,
        }
    }

    /// Both halves of it.
    pub fn halves(&self) -> [Motion; 2] {
        let middle_s = 0.5 * (self.from_s + self.until_s);
        [
            self.during(self.from_s, middle_s),
            self.during(middle_s, self.until_s),
        ]
    }

    /// Place at a time (m); the formula is not cut off at the ends of the span.
    pub fn at_m(&self, t_s: f64) -> Vector3<f64> {
        let since_s = t_s - self.from_s;
        if self.is_straight() {
            return self.start_m + self.velocity_mps * since_s;
        }
        let bent = self.acceleration_mps2 / 2.0 + self.jerk_mps3 * (since_s / 6.0);
        self.start_m + (self.velocity_mps + bent * since_s) * since_s
    }

    /// Velocity at a time (m/s).
    pub fn velocity_mps(&self, t_s: f64) -> Vector3<f64> {
        if self.is_straight {
            return self.velocity_mps;
        }
        let since_s = t_s - self.from_s;
        self.velocity_mps + (self.acceleration_mps2 + self.jerk_mps3 * (since_s / 2.0)) * since_s
    }

    /// Acceleration at a time (m/s²).
    pub fn acceleration_mps2(&self, t_s: f64) -> Vector3<f64> {
        self.acceleration_mps2 + self.jerk_mps3 * (t_s - self.from_s)
    }

    /// Constant over the span (m/s³).
    pub(crate) fn jerk_mps3(&self) -> Vector3<f64> {
        self.jerk_mps3
    }

    /// Its Bézier points over a time window (m).
    fn points_m(&self, from_s: f64, until_s: f64) -> [Vector3<f64>; 4] {
        let third_s = (until_s - from_s) / 3.0;
        let (a, d) = (self.at_m(from_s), self.at_m(until_s));
        [
            a,
            a + self.velocity_mps(from_s) * third_s,
            d - self.velocity_mps(until_s) * third_s,
            d,
        ]
    }

    /// Velocities whose hull holds all of a time window (m/s).
    fn velocities_mps(&self, from_s: f64, until_s: f64) -> [Vector3<f64>; 3] {
        let first_mps = self.velocity_mps(from_s);
        let half_s = 0.5 * (until_s - from_s);
        [
            first_mps,
            first_mps + self.acceleration_mps2(from_s) * half_s,
            self.velocity_mps(until_s),
        ]
    }

    /// How far it may be, at most, from its chord over a time window, both at the same time (m).
    pub(crate) fn off_chord_m(&self, from_s: f64, until_s: f64) -> f64 {
        match self.is_straight {
            true => 0.0,
            false => off_chord_m(&self.points_m(from_s, until_s)),
        }
    }

    /// Its chord, straight from its first place to its last, and how far it may be from that, at
    /// most, both at the same time (m).
    pub fn chord(&self) -> (Motion, f64) {
        if self.is_straight {
            return (*self, 0.0);
        }
        let span_s = (self.from_s, self.until_s);
        let points_m = self.points_m(self.from_s, self.until_s);
        let [from_m, .., to_m] = points_m.map(Point3::from);
        let chord = Motion::straight(span_s, from_m, to_m);
        (chord, off_chord_m(&points_m))
    }

    /// Lowest and highest corner of the box that holds the motion over a time window (m).
    pub(crate) fn box_m(&self, from_s: f64, until_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        if self.is_straight {
            let (a, d) = (self.at_m(from_s), self.at_m(until_s));
            return (a.inf(&d), a.sup(&d));
        }
        let [a, b, c, d] = self.points_m(from_s, until_s);
        let (low_m, high_m) = (a.inf(&d), a.sup(&d));
        (low_m.inf(&b).inf(&c), high_m.sup(&b).sup(&c))
    }

    /// Its ends, and when it turns back along an axis between them (s): along each, it is farthest
    /// out at one of these.
    pub(crate) fn turns_s(&self) -> impl Iterator<Item = f64> + use<> {
        let (from_s, until_s) = (self.from_s, self.until_s);
        let of_axis = |k: usize| {
            // v + a t + j/2 t² = 0, without differences of what is nearly equal.
            let (v, a) = (self.velocity_mps[k], self.acceleration_mps2[k]);
            let half_jerk = self.jerk_mps3[k] / 2.0;
            let root = (a * a - 4.0 * half_jerk * v).sqrt();
            let q = -0.5 * (a + root.copysign(a));
            [q / half_jerk, v / q].map(|since_s| from_s + since_s)
        };
        let turns = [0, 1, 2].map(of_axis).into_iter().flatten();
        let within = turns.filter(move |t_s| from_s < *t_s && *t_s < until_s);
        [from_s, until_s].into_iter().chain(within)
    }

    /// Lowest and highest height of that box (m).
    pub fn heights_m(&self, from_s: f64, until_s: f64) -> (f64, f64) {
        let (from_s, until_s) = (from_s - self.from_s, until_s - self.from_s);
        let (z, vz) = (self.start_m.z, self.velocity_mps.z);
        if self.is_straight {
            let (a, d) = (z + vz * from_s, z + vz * until_s);
            return (a.min(d), a.max(d));
        }
        let (bend, jerk) = (self.acceleration_mps2.z, self.jerk_mps3.z);
        let at_m = |t_s: f64| z + (vz + (bend / 2.0 + jerk * (t_s / 6.0)) * t_s) * t_s;
        let speed_mps = |t_s: f64| vz + (bend + jerk * (t_s / 2.0)) * t_s;
        let third_s = (until_s - from_s) / 3.0;
        let (a, d) = (at_m(from_s), at_m(until_s));
        let (b, c) = (
            a + speed_mps(from_s) * third_s,
            d - speed_mps(until_s) * third_s,
        );
        (a.min(d).min(b).min(c), a.max(d).max(b).max(c))
    }

    /// An upper bound of its speed (m/s); of a straight motion, the speed.
    pub fn max_speed_mps(&self) -> f64 {
        self.speed_within_mps(self.from_s, self.until_s)
    }

    /// An upper bound of its speed over a time window (m/s).
    fn speed_within_mps(&self, from_s: f64, until_s: f64) -> f64 {
        if self.is_straight() {
            return self.velocity_mps.norm();
        }
        let speeds = self.velocities_mps(from_s, until_s).map(|it| it.norm());
        speeds.into_iter().fold(0.0, f64::max)
    }

    /// The highest value of a measure of its velocity that is convex in it and at least `over`, and
    /// when (s): by halves, until the hull of the velocities has none.
    pub(crate) fn highest_over(
        &self,
        measure: &dyn Fn(&Vector3<f64>) -> f64,
        over: f64,
    ) -> Option<(f64, f64)> {
        let mut worst: Option<(f64, f64)> = None;
        let mut open = vec![(self.from_s, self.until_s, 0)];
        while let Some((from_s, until_s, halvings)) = open.pop() {
            let beyond = worst.map_or(over, |(value, _)| value);
            let hull = self.velocities_mps(from_s, until_s);
            let bound = hull.iter().map(measure).fold(f64::NEG_INFINITY, f64::max);
            if bound <= beyond {
                continue;
            }
            for t_s in [from_s, until_s] {
                let value = measure(&self.velocity_mps(t_s));
                if value > worst.map_or(over, |(value, _)| value) {
                    worst = Some((value, t_s));
                }
            }
            if halvings < MOST_HALVINGS && !self.is_straight() {
                let middle_s = 0.5 * (from_s + until_s);
                open.push((middle_s, until_s, halvings + 1));
                open.push((from_s, middle_s, halvings + 1));
            }
        }
        worst
    }

    /// Bounds of how fast it climbs (m/s, up positive); equal where it is straight.
    pub(crate) fn climb_mps(&self) -> (f64, f64) {
        self.climb_within_mps(self.from_s, self.until_s)
    }

    /// The same within a time window.
    pub(crate) fn climb_within_mps(&self, from_s: f64, until_s: f64) -> (f64, f64) {
        if self.is_straight {
            return (self.velocity_mps.z, self.velocity_mps.z);
        }
        let climbs = self.velocities_mps(from_s, until_s).map(|it| it.z);
        let low = climbs.into_iter().fold(f64::INFINITY, f64::min);
        (low, climbs.into_iter().fold(f64::NEG_INFINITY, f64::max))
    }

    /// Whether it keeps its height.
    pub fn is_level(&self) -> bool {
        self.climb_mps() == (0.0, 0.0)
    }

    /// Farthest that any place of the window lies from the place at its middle (m), or an upper
    /// bound.
    pub(crate) fn half_path_m(&self, from_s: f64, until_s: f64) -> f64 {
        0.5 * self.speed_within_mps(from_s, until_s) * (until_s - from_s)
    }

    /// The motion over a time window as seen from above, made ready for many axes.
    pub(crate) fn level_path(&self, from_s: f64, until_s: f64) -> LevelPath {
        let (begin_m, end_m) = (self.at_m(from_s).xy(), self.at_m(until_s).xy());
        let along_m = end_m - begin_m;
        LevelPath {
            begin_m,
            along_m,
            length2_m2: along_m.norm_squared(),
            off_m: self.off_chord_m(from_s, until_s),
        }
    }

    /// When and how near it comes to the origin (s, m): closed form, or to `STRAIGHT_M`.
    pub(crate) fn nearest_to_origin(&self) -> (f64, f64) {
        self.nearest(self.from_s, self.until_s, Vector3::repeat(1.0))
    }

    /// When it is nearest to the vertical axis through the origin within a span (s): closed form,
    /// or to `STRAIGHT_M`.
    pub(crate) fn nearest_to_axis_s(&self, span_s: (f64, f64)) -> f64 {
        self.nearest(span_s.0, span_s.1, Vector3::new(1.0, 1.0, 0.0))
            .0
    }

    /// When and how near it comes to the origin within a span (s, m), along the axes that count.
    fn nearest(&self, from_s: f64, until_s: f64, counts: Vector3<f64>) -> (f64, f64) {
        let exact_m = |t_s: f64| self.at_m(t_s).component_mul(&counts).norm();
        let whole = self.during(from_s, until_s);
        if self.is_straight {
            let t_s = whole.nearest_s(&counts);
            return (t_s, exact_m(t_s));
        }
        let mut best = (from_s, exact_m(from_s));
        whole.nearer(&counts, &exact_m, &mut best);
        best
    }

    /// Brings down when and how near (s, m) by this part of a cubic of which the exact distances
    /// are told, the later half first.
    fn nearer(&self, counts: &Vector3<f64>, exact_m: &impl Fn(f64) -> f64, best: &mut (f64, f64)) {
        let (chord, off_m) = self.chord();
        let t_s = chord.nearest_s(counts);
        let chord_m = chord.at_m(t_s).component_mul(counts).norm();
        let here_m = exact_m(t_s);
        if here_m < best.1 {
            *best = (t_s, here_m);
        }
        if off_m > STRAIGHT_M && chord_m - off_m < best.1 - STRAIGHT_M {
            let [first, second] = self.halves();
            second.nearer(counts, exact_m, best);
            first.nearer(counts, exact_m, best);
        }
    }

    /// When a straight motion is nearest to the origin, along the axes that count (s).
    fn nearest_s(&self, counts: &Vector3<f64>) -> f64 {
        let along_mps = self.velocity_mps.component_mul(counts);
        let speed2 = along_mps.norm_squared();
        if speed2 > 0.0 {
            let at_s = self.from_s - self.start_m.dot(&along_mps) / speed2;
            at_s.clamp(self.from_s, self.until_s)
        } else {
            self.from_s
        }
    }

    /// When it is inside the open ball of this radius (m) around the origin (s): from first to
    /// last; `None`: never.
    pub(crate) fn inside_ball_s(&self, radius_m: f64) -> Option<(f64, f64)> {
        self.inside_s(STRAIGHT_M, &|chord, off_m| {
            let wide_m = radius_m + off_m;
            let span = below_zero(
                chord.velocity_mps.norm_squared(),
                chord.start_m.dot(&chord.velocity_mps),
                chord.start_m.norm_squared() - wide_m * wide_m,
            );
            chord.cut(span?)
        })
    }

    /// When it is inside the open upright cylinder of this radius (m) around the origin's axis,
    /// between two heights (m), in s: from first to last; `None`: never.
    pub(crate) fn inside_cylinder_s(&self, radius_m: f64, z_m: (f64, f64)) -> Option<(f64, f64)> {
        self.near_cylinder_s(radius_m, z_m, STRAIGHT_M)
    }

    /// The same to a length (m): it may be told to be inside where it is outside by no more.
    pub(crate) fn near_cylinder_s(
        &self,
        radius_m: f64,
        z_m: (f64, f64),
        within_m: f64,
    ) -> Option<(f64, f64)> {
        self.inside_s(within_m, &|chord, off_m| {
            let (p, v) = (chord.start_m, chord.velocity_mps);
            let wide_m = radius_m + off_m;
            let z_m = (z_m.0 - off_m, z_m.1 + off_m);
            let within_radius = below_zero(
                v.xy().norm_squared(),
                p.xy().dot(&v.xy()),
                p.xy().norm_squared() - wide_m * wide_m,
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
            chord.cut(Some(both).filter(|(a, b)| a <= b)?)
        })
    }

    /// First and last time in a shape, from what a chord says of the shape widened (m): parts are
    /// halved until they are as good as their chords, widened by no more than a length (m).
    fn inside_s(&self, within_m: f64, of_chord: &InsideOfChord<'_>) -> Option<(f64, f64)> {
        let (chord, off_m) = self.chord();
        let here = of_chord(&chord, off_m)?;
        if off_m <= within_m {
            return Some(here);
        }
        let [first, second] = self.halves().map(|half| half.inside_s(within_m, of_chord));
        match (first, second) {
            (Some((from_s, _)), Some((_, until_s))) => Some((from_s, until_s)),
            (one, other) => one.or(other),
        }
    }

    /// A span counted from `from_s`, cut to this motion's own; `None`: nothing is left of it.
    fn cut(&self, (a, b): (f64, f64)) -> Option<(f64, f64)> {
        let begin_s = (self.from_s + a).max(self.from_s);
        let end_s = (self.from_s + b).min(self.until_s);
        (begin_s <= end_s).then_some((begin_s, end_s))
    }
}

/// How far a cubic with these Bézier points may be from its chord, at most, both at the same time
/// (m).
fn off_chord_m(&[a, b, c, d]: &[Vector3<f64>; 4]) -> f64 {
    let off_m2 = |inner: Vector3<f64>, on_chord: Vector3<f64>| (inner - on_chord).norm_squared();
    let first_m2 = off_m2(b, (a * 2.0 + d) / 3.0);
    0.75 * first_m2.max(off_m2(c, (a + d * 2.0) / 3.0)).sqrt()
}

/// A motion over a window of time as seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelPath {
    begin_m: Vector2<f64>,
    /// From its begin to its end (m).
    along_m: Vector2<f64>,
    /// Square of its length (m²); 0: it stands.
    length2_m2: f64,
    /// How far it may be from its chord (m).
    off_m: f64,
}

impl LevelPath {
    /// Its nearest place to the vertical axis through minus `shift_m` (m, x and y), as seen from
    /// there (m): closed form; of a cubic, no farther than its nearest place.
    #[inline]
    pub(crate) fn nearest_m(&self, shift_m: [f64; 2]) -> Vector2<f64> {
        let begin_m = self.begin_m + Vector2::from(shift_m);
        if self.length2_m2 <= 0.0 {
            return nearer(begin_m, self.off_m);
        }
        let share = -begin_m.dot(&self.along_m) / self.length2_m2;
        nearer(begin_m + self.along_m * share.clamp(0.0, 1.0), self.off_m)
    }
}

/// A place seen from the origin, moved towards it by a length (m), at most as far as there.
#[inline]
pub(super) fn nearer(place_m: Vector2<f64>, by_m: f64) -> Vector2<f64> {
    if by_m <= 0.0 {
        return place_m;
    }
    let far_m = place_m.norm();
    match far_m > by_m {
        true => place_m * (1.0 - by_m / far_m),
        false => Vector2::zeros(),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in 0..1 that follow from an index alone.
    fn cubic(k: u64) -> Motion {
        let mut state = k.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(k | 1);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let from_s = 10.0 * random();
        let span_s = (from_s, from_s + 0.05 + 2.0 * random());
        let mut place = || Point3::from([0; 3].map(|_| 4.0 * random() - 2.0));
        Motion::cubic(span_s, [place(), place(), place(), place()])
    }

    /// Times all over a span.
    fn times(from_s: f64, until_s: f64) -> impl Iterator<Item = f64> {
        (0..=2000).map(move |k| from_s + (until_s - from_s) * f64::from(k) / 2000.0)
    }

    #[test]
    fn a_cubic_is_the_bezier_curve_of_its_points_and_any_part_of_it_is_itself() {
        let points_m = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 2.0],
            [2.0, -1.0, 0.0],
            [4.0, 1.0, 1.0],
        ];
        let points_m = points_m.map(Point3::from);
        let motion = Motion::cubic((3.0, 5.0), points_m);
        for t_s in times(3.0, 5.0) {
            let u = (t_s - 3.0) / 2.0;
            let weights = [
                (1.0 - u).powi(3),
                3.0 * u * (1.0 - u).powi(2),
                3.0 * u * u * (1.0 - u),
                u.powi(3),
            ];
            let there = points_m
                .iter()
                .zip(weights)
                .map(|(point, weight)| point.coords * weight);
            let there_m: Vector3<f64> = there.sum();
            assert!((motion.at_m(t_s) - there_m).norm() < 1e-12);
            let part = motion.during(3.5, 4.25);
            assert!((part.at_m(t_s) - there_m).norm() < 1e-12);
            assert!((part.velocity_mps(t_s) - motion.velocity_mps(t_s)).norm() < 1e-12);
        }
    }

    #[test]
    fn its_bounds_hold_at_every_time_and_its_nearest_places_are_found() {
        let mut inside = 0;
        for k in 0..300 {
            let motion = cubic(k);
            let span_s = (motion.from_s, motion.until_s);
            let (low_m, high_m) = motion.box_m(span_s.0, span_s.1);
            let (chord, off_m) = motion.chord();
            assert_eq!(off_m, motion.off_chord_m(span_s.0, span_s.1));
            assert_eq!(motion.heights_m(span_s.0, span_s.1), (low_m.z, high_m.z));
            let level = motion.level_path(span_s.0, span_s.1);
            let half_path_m = motion.half_path_m(span_s.0, span_s.1);
            let middle_m = motion.at_m(0.5 * (span_s.0 + span_s.1));
            let (near_s, near_m) = motion.nearest_to_origin();
            let axis_s = motion.nearest_to_axis_s(span_s);
            let fastest = motion.highest_over(&|v| v.norm(), 0.0).expect("it moves").0;
            let ball_s = motion.inside_ball_s(1.0);
            let heights_m = (-0.8, 0.3);
            let cylinder_s = motion.inside_cylinder_s(1.2, heights_m);
            let (mut least_m, mut level_m, mut speed) = (f64::INFINITY, f64::INFINITY, 0.0_f64);
            for t_s in times(span_s.0, span_s.1) {
                let here_m = motion.at_m(t_s);
                assert!((low_m - here_m).max() < 1e-9 && (here_m - high_m).max() < 1e-9);
                assert!((here_m - chord.at_m(t_s)).norm() <= off_m + 1e-9);
                assert!((here_m - middle_m).norm() <= half_path_m + 1e-9);
                assert!(motion.velocity_mps(t_s).norm() <= motion.max_speed_mps() + 1e-9);
                assert!(level.nearest_m([0.0; 2]).norm() <= here_m.xy().norm() + 1e-9);
                least_m = least_m.min(here_m.norm());
                level_m = level_m.min(here_m.xy().norm());
                speed = speed.max(motion.velocity_mps(t_s).norm());
                let is_within = |span_s: Option<(f64, f64)>| {
                    span_s.is_some_and(|(from_s, until_s)| {
                        from_s - 1e-9 <= t_s && t_s <= until_s + 1e-9
                    })
                };
                if here_m.norm() < 1.0 {
                    inside += 1;
                    assert!(is_within(ball_s), "{k}: {t_s} {ball_s:?}");
                }
                if here_m.xy().norm() < 1.2 && heights_m.0 < here_m.z && here_m.z < heights_m.1 {
                    assert!(is_within(cylinder_s), "{k}: {t_s} {cylinder_s:?}");
                }
            }
            assert!(
                near_m <= least_m + 2e-5 && (motion.at_m(near_s).norm() - near_m).abs() < 1e-12
            );
            assert!(motion.at_m(axis_s).xy().norm() <= level_m + 2e-5);
            assert!(
                (fastest - speed).abs() < 1e-3 * speed,
                "{k}: {fastest} {speed}"
            );
            // First and last are no wider than what a step of the samples may miss.
            if let Some((from_s, until_s)) = ball_s {
                for t_s in [from_s, until_s] {
                    assert!(motion.at_m(t_s).norm() < 1.0 + 1e-4, "{k}");
                }
            }
        }
        assert!(inside > 1000, "{inside}");
    }
}
