//! Where a drone is when: pieces with a time span each, read from the break points of a plan.
//!
//! Pieces are straight today. Nothing outside this file may assume so: the rest of the crate asks a
//! [`Motion`] where it is, in which box it stays, and when it is inside a ball or an upright
//! cylinder. A piece of higher order has to answer the same questions.
//!
//! World frame, z up, metres and seconds.

use nalgebra::{Point3, Vector3};
use thiserror::Error;

use crate::plan::TrajectoryEntry;

/// Two break points this close in time are one moment (s): the plan's times are whole multiples of
/// a tick that is far longer, so a difference this small is rounding.
pub const SAME_TIME_S: f64 = 1e-9;

/// Displacements up to this are rounding (m), chosen here: a micrometre, far below any clearance.
pub const SAME_PLACE_M: f64 = 1e-6;

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

    /// Stands still.
    pub fn still(span_s: (f64, f64), at_m: Point3<f64>) -> Motion {
        Motion {
            from_s: span_s.0,
            until_s: span_s.1,
            start_m: at_m.coords,
            velocity_mps: Vector3::zeros(),
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

    /// Farthest that any place of the window lies from the place at its middle (m), or an upper bound.
    pub fn half_path_m(&self, from_s: f64, until_s: f64) -> f64 {
        0.5 * self.max_speed_mps() * (until_s - from_s)
    }

    /// Smallest and greatest horizontal distance from the vertical axis through minus
    /// `shift_m`, over a time window (m): closed form.
    pub fn axis_distance_m(&self, from_s: f64, until_s: f64, shift_m: [f64; 2]) -> (f64, f64) {
        let shift = Vector3::new(shift_m[0], shift_m[1], 0.0);
        let (a, b) = (self.at_m(from_s) + shift, self.at_m(until_s) + shift);
        let (a, b) = (a.xy(), b.xy());
        let along = b - a;
        let length2 = along.norm_squared();
        let nearest = if length2 > 0.0 {
            a + along * (-a.dot(&along) / length2).clamp(0.0, 1.0)
        } else {
            a
        };
        (nearest.norm(), a.norm().max(b.norm()))
    }

    /// When and how near it comes to the origin (s, m): closed form.
    pub fn nearest_to_origin(&self) -> (f64, f64) {
        let speed2 = self.velocity_mps.norm_squared();
        let t_s = if speed2 > 0.0 {
            (self.from_s - self.start_m.dot(&self.velocity_mps) / speed2)
                .clamp(self.from_s, self.until_s)
        } else {
            self.from_s
        };
        (t_s, self.at_m(t_s).norm())
    }

    /// Spans inside the open ball of this radius around the origin (s), in order.
    pub fn inside_ball_s(&self, radius_m: f64) -> Vec<(f64, f64)> {
        let span = below_zero(
            self.velocity_mps.norm_squared(),
            self.start_m.dot(&self.velocity_mps),
            self.start_m.norm_squared() - radius_m * radius_m,
        );
        self.spans(span)
    }

    /// Spans inside the open upright cylinder around the origin's axis, between two heights (s), in order.
    pub fn inside_cylinder_s(&self, radius_m: f64, z_m: (f64, f64)) -> Vec<(f64, f64)> {
        let (p, v) = (self.start_m, self.velocity_mps);
        let within_radius = below_zero(
            v.xy().norm_squared(),
            p.xy().dot(&v.xy()),
            p.xy().norm_squared() - radius_m * radius_m,
        );
        let within_heights = if v.z != 0.0 {
            let (a, b) = ((z_m.0 - p.z) / v.z, (z_m.1 - p.z) / v.z);
            Some((a.min(b), a.max(b)))
        } else {
            (z_m.0 < p.z && p.z < z_m.1).then_some((f64::NEG_INFINITY, f64::INFINITY))
        };
        let both = within_radius
            .zip(within_heights)
            .map(|(a, b)| (a.0.max(b.0), a.1.min(b.1)));
        self.spans(both.filter(|(a, b)| a <= b))
    }

    /// A span counted from `from_s`, cut to this motion's own.
    fn spans(&self, after_start_s: Option<(f64, f64)>) -> Vec<(f64, f64)> {
        after_start_s
            .map(|(a, b)| {
                (
                    (self.from_s + a).max(self.from_s),
                    (self.from_s + b).min(self.until_s),
                )
            })
            .filter(|(a, b)| a <= b)
            .into_iter()
            .collect()
    }
}

/// The open interval of τ where `a τ² + 2 b τ + c < 0`, for `a >= 0`; everything or nothing where `a = 0`
/// (then `b` is 0 too: two drones at rest to one another, the case a ray cast misses).
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

/// A motion in the world with the mass flown during it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Where the centre of the rotor plane is.
    pub motion: Motion,
    /// With payload (kg).
    pub mass_kg: f64,
}

/// What happens after the last break point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tail {
    /// It stays; a last piece at rest reaches up to this time (s), or to the last break point if that is later.
    Stays {
        /// s.
        until_s: f64,
    },
    /// Gone.
    Gone,
}

/// Where a drone is when: pieces in order of time, without gaps in time.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    pieces: Vec<Piece>,
    last_s: f64,
    last_m: Point3<f64>,
}

/// Why break points make no trajectory.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TrajectoryError {
    /// No break point.
    #[error("the trajectory has no points")]
    Empty,
    /// The three lists differ in length.
    #[error("the trajectory lists {times} times, {positions} positions and {masses} masses")]
    Lengths {
        /// Times.
        times: usize,
        /// Positions.
        positions: usize,
        /// Masses.
        masses: usize,
    },
    /// A number is not finite.
    #[error("point {point} of the trajectory is not finite")]
    NotFinite {
        /// Index.
        point: usize,
    },
    /// A time before 0 or before its predecessor.
    #[error("time runs backwards at point {point} of the trajectory")]
    Backwards {
        /// Index.
        point: usize,
    },
}

impl Trajectory {
    /// Reads break points; the first place is held from time 0 on.
    ///
    /// Two points at one time make no piece: the second takes over there (a change of mass, or, if the
    /// places differ, one of [`Trajectory::jumps`]).
    ///
    /// # Errors
    ///
    /// Lists of different length or without points, numbers that are not finite, times that run backwards.
    pub fn new(entry: &TrajectoryEntry, tail: Tail) -> Result<Trajectory, TrajectoryError> {
        let (times, positions, masses) =
            (entry.t_s.len(), entry.position_m.len(), entry.mass_kg.len());
        if times != positions || times != masses {
            return Err(TrajectoryError::Lengths {
                times,
                positions,
                masses,
            });
        }
        let finite = |k: usize| {
            entry.t_s[k].is_finite()
                && entry.mass_kg[k].is_finite()
                && entry.position_m[k].iter().all(|c| c.is_finite())
        };
        if let Some(point) = (0..times).find(|&k| !finite(k)) {
            return Err(TrajectoryError::NotFinite { point });
        }
        let before = |k: usize| if k == 0 { 0.0 } else { entry.t_s[k - 1] };
        if let Some(point) = (0..times).find(|&k| entry.t_s[k] < before(k)) {
            return Err(TrajectoryError::Backwards { point });
        }
        let Some(last) = times.checked_sub(1) else {
            return Err(TrajectoryError::Empty);
        };

        let mut pieces = Vec::with_capacity(times + 1);
        if entry.t_s[0] > SAME_TIME_S {
            let motion = Motion::still((0.0, entry.t_s[0]), entry.position_m[0]);
            pieces.push(Piece {
                motion,
                mass_kg: entry.mass_kg[0],
            });
        }
        for k in 0..last {
            let span_s = (entry.t_s[k], entry.t_s[k + 1]);
            if span_s.1 - span_s.0 > SAME_TIME_S {
                let motion = Motion::straight(span_s, entry.position_m[k], entry.position_m[k + 1]);
                pieces.push(Piece {
                    motion,
                    mass_kg: entry.mass_kg[k],
                });
            }
        }
        let (last_s, last_m) = (entry.t_s[last], entry.position_m[last]);
        if let Tail::Stays { until_s } = tail {
            let motion = Motion::still((last_s, until_s.max(last_s)), last_m);
            pieces.push(Piece {
                motion,
                mass_kg: entry.mass_kg[last],
            });
        }
        Ok(Trajectory {
            pieces,
            last_s,
            last_m,
        })
    }

    /// The pieces, in order of time.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Last break point (s).
    pub fn last_s(&self) -> f64 {
        self.last_s
    }

    /// Place of the last break point (m).
    pub fn last_m(&self) -> Point3<f64> {
        self.last_m
    }

    /// Index of the piece under way at a time; at a break point the later one. `None`: not there.
    pub fn piece_index(&self, t_s: f64) -> Option<usize> {
        let after = self
            .pieces
            .partition_point(|piece| piece.motion.from_s <= t_s);
        let index = after.checked_sub(1)?;
        (t_s <= self.pieces[index].motion.until_s).then_some(index)
    }

    /// Indices of the pieces that share more than a moment with a time window.
    pub fn pieces_during(&self, from_s: f64, until_s: f64) -> std::ops::Range<usize> {
        let first = self
            .pieces
            .partition_point(|piece| piece.motion.until_s <= from_s);
        let end = self
            .pieces
            .partition_point(|piece| piece.motion.from_s < until_s);
        first..end.max(first)
    }

    /// Place at a time (m); `None`: not there.
    pub fn position_m(&self, t_s: f64) -> Option<Point3<f64>> {
        self.piece_index(t_s)
            .map(|k| self.pieces[k].motion.at_m(t_s).into())
    }

    /// Mass at a time (kg); `None`: not there.
    pub fn mass_kg(&self, t_s: f64) -> Option<f64> {
        self.piece_index(t_s).map(|k| self.pieces[k].mass_kg)
    }

    /// Lowest and highest corner of the box it stays in over a time window (m); `None`: not there.
    pub fn box_m(&self, from_s: f64, until_s: f64) -> Option<(Vector3<f64>, Vector3<f64>)> {
        self.pieces[self.pieces_during(from_s, until_s)]
            .iter()
            .map(|piece| {
                let (a_s, b_s) = (
                    from_s.max(piece.motion.from_s),
                    until_s.min(piece.motion.until_s),
                );
                piece.motion.box_m(a_s, b_s)
            })
            .reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))
    }

    /// Moments at which it is in two places: time (s) and both places (m).
    pub fn jumps(&self) -> impl Iterator<Item = (f64, Point3<f64>, Point3<f64>)> + '_ {
        let ends = self.pieces.iter().map(|piece| {
            (
                piece.motion.until_s,
                piece.motion.at_m(piece.motion.until_s),
            )
        });
        let begins = self
            .pieces
            .iter()
            .skip(1)
            .map(|piece| piece.motion.at_m(piece.motion.from_s));
        ends.zip(begins)
            .filter(|((_, a), b)| (a - b).norm() > SAME_PLACE_M)
            .map(|((t_s, a), b)| (t_s, a.into(), b.into()))
    }

    /// First and last moment at which it moves (s); `None`: never.
    pub fn moves_s(&self) -> Option<(f64, f64)> {
        let moving = |piece: &&Piece| {
            let motion = &piece.motion;
            motion.max_speed_mps() * (motion.until_s - motion.from_s) > SAME_PLACE_M
        };
        let first = self.pieces.iter().find(moving)?.motion.from_s;
        let last = self.pieces.iter().rev().find(moving)?.motion.until_s;
        Some((first, last))
    }
}
