//! Where a drone is when: pieces with a time span each, read from the break points of a plan.
//!
//! Pieces are straight or cubic. Nothing outside this module tells them apart: the rest of the
//! crate asks a [`Motion`] where it is, in which box it stays, and when it is inside a ball or an
//! upright cylinder, and two of them, [`Shifted`] against one another in time, how near they come.
//!
//! World frame, z up, metres and seconds.

mod motion;
mod shifted;

use nalgebra::{Point3, Vector3};
use thiserror::Error;

pub use motion::{LevelPath, Motion, SAME_TIME_S};
pub use shifted::{Approach, LevelRegion, Shifted};

use crate::plan::TrajectoryEntry;

/// Displacements up to this are rounding (m), chosen here: a micrometre, far below any clearance.
pub const SAME_PLACE_M: f64 = 1e-6;

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
    /// It stays; a last piece at rest reaches up to this time (s), or to the last break point if
    /// that is later.
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
    /// In order of time, back to back.
    pieces: Vec<Piece>,
    /// First break point (s).
    first_s: f64,
    /// Place of the first break point (m).
    first_m: Point3<f64>,
    /// Last break point (s).
    last_s: f64,
    /// Place of the last break point (m).
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
    /// Control points are listed, but not for every piece.
    #[error(
        "the trajectory has {pieces} pieces between its points, but control_m lists {controls}"
    )]
    Controls {
        /// Between its points.
        pieces: usize,
        /// Listed.
        controls: usize,
    },
    /// Neither none nor two.
    #[error(
        "piece {piece} of the trajectory has {count} control points: a cubic has 2, a straight piece none"
    )]
    ControlCount {
        /// Index.
        piece: usize,
        /// How many.
        count: usize,
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
    /// Two points at one time make no piece: the second takes over there (a change of mass, or, if
    /// the places differ, one of [`Trajectory::jumps`]).
    ///
    /// # Errors
    ///
    /// Lists of different length or without points, numbers that are not finite, times that run
    /// backwards.
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
        let pieces = times.saturating_sub(1);
        let controls = entry.control_m.len();
        if controls != 0 && controls != pieces {
            return Err(TrajectoryError::Controls { pieces, controls });
        }
        for (piece, control_m) in entry.control_m.iter().enumerate() {
            let count = control_m.len();
            if count != 0 && count != 2 {
                return Err(TrajectoryError::ControlCount { piece, count });
            }
            if !control_m
                .iter()
                .flat_map(|it| it.iter())
                .all(|c| c.is_finite())
            {
                return Err(TrajectoryError::NotFinite { point: piece });
            }
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
            let first_m = entry.position_m[0];
            pieces.push(Piece {
                motion: Motion::straight((0.0, entry.t_s[0]), first_m, first_m),
                mass_kg: entry.mass_kg[0],
            });
        }
        let between = (0..last).filter_map(|k| {
            Some(Piece {
                motion: entry.motion(k)?,
                mass_kg: entry.mass_kg[k],
            })
        });
        pieces.extend(between);
        let (last_s, last_m) = (entry.t_s[last], entry.position_m[last]);
        if let Tail::Stays { until_s } = tail {
            let span_s = (last_s, until_s.max(last_s));
            pieces.push(Piece {
                motion: Motion::straight(span_s, last_m, last_m),
                mass_kg: entry.mass_kg[last],
            });
        }
        Ok(Trajectory {
            pieces,
            first_s: entry.t_s[0],
            first_m: entry.position_m[0],
            last_s,
            last_m,
        })
    }

    /// The same for a drone that comes at its first break point, and is nowhere before.
    #[must_use]
    pub(crate) fn entering(mut self) -> Trajectory {
        // What it holds until then is its first piece.
        if self.first_s > SAME_TIME_S {
            self.pieces.remove(0);
        }
        self
    }

    /// The same for a drone that leaves when it begins, and was there for so long before (s): what
    /// it does where it is late.
    #[must_use]
    pub(crate) fn leaving_late(mut self, mass_kg: f64, before_s: f64) -> Trajectory {
        if before_s > 0.0 {
            let span_s = (self.first_s - before_s, self.first_s);
            let motion = Motion::straight(span_s, self.first_m, self.first_m);
            self.pieces.push(Piece { motion, mass_kg });
        }
        self
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
        let pieces = &self.pieces;
        let after = pieces.partition_point(|piece| piece.motion.from_s <= t_s);
        let index = after.checked_sub(1)?;
        (t_s <= self.pieces[index].motion.until_s).then_some(index)
    }

    /// Indices of the pieces that share more than a moment with a time window.
    pub(crate) fn pieces_during(&self, from_s: f64, until_s: f64) -> std::ops::Range<usize> {
        let pieces = &self.pieces;
        let first = pieces.partition_point(|piece| piece.motion.until_s <= from_s);
        let end = pieces.partition_point(|piece| piece.motion.from_s < until_s);
        first..end.max(first)
    }

    /// Place at a time (m); `None`: not there.
    pub fn position_m(&self, t_s: f64) -> Option<Point3<f64>> {
        self.piece_index(t_s)
            .map(|k| self.pieces[k].motion.at_m(t_s).into())
    }

    /// Lowest and highest corner of the box it stays in over a time window (m); `None`: not there.
    pub(crate) fn box_m(&self, from_s: f64, until_s: f64) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let pieces = self.pieces[self.pieces_during(from_s, until_s)].iter();
        let boxes = pieces.map(|Piece { motion, .. }| {
            motion.box_m(from_s.max(motion.from_s), until_s.min(motion.until_s))
        });
        boxes.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))
    }

    /// Moments at which it is in two places: time (s) and both places (m).
    pub fn jumps(&self) -> impl Iterator<Item = (f64, Point3<f64>, Point3<f64>)> + '_ {
        let motions = || self.pieces.iter().map(|piece| piece.motion);
        let ends = motions().map(|motion| (motion.until_s, motion.at_m(motion.until_s)));
        let begins = motions().map(|motion| motion.at_m(motion.from_s));
        // From the first break point, and to the last: no piece may hold them.
        let ends = std::iter::once((self.first_s, self.first_m.coords)).chain(ends);
        let begins = begins.chain(std::iter::once(self.last_m.coords));
        ends.zip(begins)
            .filter(|((_, a), b)| (a - b).norm() > SAME_PLACE_M)
            .map(|((t_s, a), b)| (t_s, a.into(), b.into()))
    }

    /// First and last moment at which it moves (s); `None`: never.
    pub(crate) fn moves_s(&self) -> Option<(f64, f64)> {
        let moving = |piece: &&Piece| {
            let motion = &piece.motion;
            motion.max_speed_mps() * (motion.until_s - motion.from_s) > SAME_PLACE_M
        };
        let first = self.pieces.iter().find(moving)?.motion.from_s;
        let last = self.pieces.iter().rev().find(moving)?.motion.until_s;
        Some((first, last))
    }
}
