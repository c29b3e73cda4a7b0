//! A plan's motions as cubic Bézier pieces, back to back from time 0: what the writers take.

use nalgebra::{Point3, Vector3};
use planner::Plan;
use planner::plan::trajectory::{SAME_PLACE_M, SAME_TIME_S};
use planner::plan::{AtEnd, AtStart, DronePlan, MotionState};

/// A motion over a span of time, its parameter linear in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// s.
    pub from_s: f64,
    /// s.
    pub until_s: f64,
    /// Bézier points (m); those of a straight piece lie at its thirds.
    pub points_m: [Point3<f64>; 4],
    /// At constant velocity.
    pub is_straight: bool,
}

impl Piece {
    /// At constant velocity.
    #[must_use]
    pub fn straight(from_s: f64, until_s: f64, ends_m: [Point3<f64>; 2]) -> Piece {
        let [a, b] = ends_m;
        let across = b - a;
        Piece {
            from_s,
            until_s,
            points_m: [a, a + across / 3.0, b - across / 3.0, b],
            is_straight: true,
        }
    }

    /// s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.until_s - self.from_s
    }

    /// Both sides of a moment within its span (s; de Casteljau).
    #[must_use]
    pub fn split(&self, at_s: f64) -> [Piece; 2] {
        let share = (at_s - self.from_s) / self.duration_s();
        let between = |a: Point3<f64>, b: Point3<f64>| a + (b - a) * share;
        let [a, b, c, d] = self.points_m;
        let (ab, bc, cd) = (between(a, b), between(b, c), between(c, d));
        let (abc, bcd) = (between(ab, bc), between(bc, cd));
        let middle = between(abc, bcd);
        let part = |from_s, until_s, points_m| Piece {
            from_s,
            until_s,
            points_m,
            is_straight: self.is_straight,
        };
        [
            part(self.from_s, at_s, [a, ab, abc, middle]),
            part(at_s, self.until_s, [middle, bcd, cd, d]),
        ]
    }

    /// Parts of equal duration, none longer than this (s).
    #[must_use]
    pub fn parts(self, most_s: f64) -> Vec<Piece> {
        let count = (self.duration_s() / most_s).ceil().max(1.0);
        let mut parts = Vec::new();
        let mut rest = self;
        for k in 1..count as u64 {
            let at_s = self.from_s + self.duration_s() * (k as f64 / count);
            let [first, second] = rest.split(at_s);
            parts.push(first);
            rest = second;
        }
        parts.push(rest);
        parts
    }

    /// Whether both are parts of one straight motion.
    fn goes_on_as(&self, next: &Piece) -> bool {
        let velocity = |it: &Piece| (it.points_m[3] - it.points_m[0]) / it.duration_s();
        let turned_mps = velocity(self) - velocity(next);
        let longer_s = self.duration_s().max(next.duration_s());
        self.is_straight && next.is_straight && turned_mps.norm() * longer_s < SAME_PLACE_M
    }
}

/// What one drone does from time 0 on.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Of the drone.
    pub name: String,
    /// Back to back, at least one; straight motions that go on as they were are one piece.
    pub pieces: Vec<Piece>,
    /// It stands on something until it first moves.
    pub starts_landed: bool,
    /// It ends on something, where it never left it too.
    pub lands: bool,
    /// It is not there before (s): its course holds its first place until then.
    pub enters_s: Option<f64>,
    /// It is not there after its course.
    pub leaves: bool,
    /// It takes up or drops a payload.
    pub changes_mass: bool,
}

impl Course {
    /// Its first place (m).
    #[must_use]
    pub fn start_m(&self) -> Point3<f64> {
        self.pieces[0].points_m[0]
    }

    /// The end of its last piece (s).
    #[must_use]
    pub fn until_s(&self) -> f64 {
        self.pieces.last().map_or(0.0, |it| it.until_s)
    }

    /// At a time (s): at rest after its end; between two pieces, as it goes on.
    #[must_use]
    pub fn state(&self, t_s: f64) -> MotionState {
        let after = self.pieces.partition_point(|it| it.from_s <= t_s);
        let piece = &self.pieces[after.saturating_sub(1)];
        if t_s >= piece.until_s {
            return MotionState {
                position_m: piece.points_m[3],
                velocity_mps: Vector3::zeros(),
                acceleration_mps2: Vector3::zeros(),
            };
        }
        let u = (t_s - piece.from_s) / piece.duration_s();
        let per_s = 1.0 / piece.duration_s();
        let [a, b, c, d] = piece.points_m;
        let steps = [b - a, c - b, d - c];
        let turns = [steps[1] - steps[0], steps[2] - steps[1]];
        let along = |from: Vector3<f64>, to: Vector3<f64>| from + (to - from) * u;
        let (early, late) = (along(steps[0], steps[1]), along(steps[1], steps[2]));
        let between = |a: Point3<f64>, b: Point3<f64>| a + (b - a) * u;
        let (ab, bc, cd) = (between(a, b), between(b, c), between(c, d));
        let place_m = between(between(ab, bc), between(bc, cd));
        MotionState {
            position_m: match piece.is_straight {
                true => a + (d - a) * u,
                false => place_m,
            },
            velocity_mps: match piece.is_straight {
                true => (d - a) * per_s,
                false => along(early, late) * (3.0 * per_s),
            },
            acceleration_mps2: match piece.is_straight {
                true => Vector3::zeros(),
                false => along(turns[0], turns[1]) * (6.0 * per_s * per_s),
            },
        }
    }
}

/// Why a drone has no course.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CourseError {
    /// No points, lists of different length, times that run backwards, numbers that are not finite.
    #[error("its trajectory has no points, or its lists do not fit one another")]
    Malformed,
    /// It is in two places at a time.
    #[error("it jumps at {0} s")]
    Jumps(f64),
}

/// The course of one drone.
///
/// # Errors
///
/// Its trajectory is none.
pub fn of(drone: &DronePlan) -> Result<Course, CourseError> {
    let entry = &drone.trajectory;
    let count = entry.t_s.len();
    let fits = count > 0
        && entry.position_m.len() == count
        && entry.mass_kg.len() == count
        && (entry.control_m.is_empty() || entry.control_m.len() + 1 == count)
        && entry.t_s[0] >= 0.0
        && entry.t_s.is_sorted()
        && entry.t_s.iter().all(|t_s| t_s.is_finite())
        && entry.control_m.iter().all(|it| matches!(it.len(), 0 | 2));
    let mut places_m = entry
        .position_m
        .iter()
        .chain(entry.control_m.iter().flatten());
    if !fits || !places_m.all(|at| at.iter().all(|m| m.is_finite())) {
        return Err(CourseError::Malformed);
    }
    let mut pieces: Vec<Piece> = Vec::new();
    let mut add = |piece: Piece| match pieces.last_mut() {
        Some(last) if last.goes_on_as(&piece) => {
            let ends_m = [last.points_m[0], piece.points_m[3]];
            *last = Piece::straight(last.from_s, piece.until_s, ends_m);
        }
        _ => pieces.push(piece),
    };
    let first_m = entry.position_m[0];
    if entry.t_s[0] > SAME_TIME_S {
        add(Piece::straight(0.0, entry.t_s[0], [first_m; 2]));
    }
    for k in 1..count {
        let (from_s, until_s) = (entry.t_s[k - 1], entry.t_s[k]);
        let ends_m = [entry.position_m[k - 1], entry.position_m[k]];
        if until_s - from_s <= SAME_TIME_S {
            if (ends_m[1] - ends_m[0]).norm() > SAME_PLACE_M {
                return Err(CourseError::Jumps(until_s));
            }
            continue;
        }
        add(match entry.control_m.get(k - 1).map(Vec::as_slice) {
            Some(&[b, c]) => Piece {
                from_s,
                until_s,
                points_m: [ends_m[0], b, c, ends_m[1]],
                is_straight: false,
            },
            _ => Piece::straight(from_s, until_s, ends_m),
        });
    }
    if pieces.is_empty() {
        // It stays where it is: a second of that is its course.
        pieces.push(Piece::straight(0.0, 1.0, [first_m; 2]));
    }
    let starts_landed = drone.at_start == AtStart::Landed;
    let mut places_m = pieces.iter().flat_map(|it| &it.points_m);
    let stays = places_m.all(|at_m| (at_m - first_m).norm() <= SAME_PLACE_M);
    Ok(Course {
        name: drone.name.clone(),
        pieces,
        starts_landed,
        lands: drone.has_landed() || starts_landed && stays,
        enters_s: drone.enters_s.filter(|it| *it > 0.0),
        leaves: drone.at_end == AtEnd::Leave,
        changes_mass: entry.mass_kg.iter().any(|it| *it != entry.mass_kg[0]),
    })
}

/// The courses of all drones, or what is wrong with each that has none.
///
/// # Errors
///
/// The name of each such drone, and why.
pub fn of_all(plan: &Plan) -> Result<Vec<Course>, Vec<(String, CourseError)>> {
    let mut courses = Vec::with_capacity(plan.drones.len());
    let mut wrong = Vec::new();
    for drone in &plan.drones {
        match of(drone) {
            Ok(course) => courses.push(course),
            Err(error) => wrong.push((drone.name.clone(), error)),
        }
    }
    if wrong.is_empty() {
        Ok(courses)
    } else {
        Err(wrong)
    }
}
