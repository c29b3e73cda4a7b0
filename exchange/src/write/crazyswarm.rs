//! Trajectories of Crazyswarm2 and `uav_trajectories`: one CSV a drone, a polynomial piece a row.
//!
//! The layout is that of `crazyflie_py/uav_trajectory.py` in IMRCLab/crazyswarm2: a header line
//! that is skipped, then duration (s) and eight ascending coefficients each of x, y, z (m) and yaw
//! (rad) in the piece's own time. To be flown with `relative=False`: places are the world's.

use crate::course::{Course, Piece};

/// Pieces that fit into a Crazyflie: 4096 bytes (`TRAJECTORY_MEMORY_SIZE` in
/// `crtp_commander_high_level.c` of crazyflie-firmware) by 132 a piece.
pub const MOST_PIECES: usize = 4096 / 132;

/// Coefficients of an axis.
const COEFFICIENTS: usize = 8;

/// By so much the last piece lasts longer (s): its reader asserts that a time lies within the sum
/// of
/// the durations, which rounds.
const END_LATE_S: f64 = 1e-9;

/// The pieces that are written: two at least, as the format's reader takes one row for no table.
#[must_use]
pub fn pieces(course: &Course) -> Vec<Piece> {
    match course.pieces[..] {
        [only] => only.split((only.from_s + only.until_s) / 2.0).to_vec(),
        _ => course.pieces.clone(),
    }
}

/// One drone's table.
#[must_use]
pub fn table(pieces: &[Piece]) -> String {
    let mut text = "Duration".to_owned();
    for axis in ["x", "y", "z", "yaw"] {
        for power in 0..COEFFICIENTS {
            text += &format!(",{axis}^{power}");
        }
    }
    text += "\n";
    for (k, piece) in pieces.iter().enumerate() {
        let duration_s = piece.duration_s();
        let late_s = if k + 1 == pieces.len() {
            END_LATE_S
        } else {
            0.0
        };
        text += &format!("{}", duration_s + late_s);
        let [a, b, c, d] = piece.points_m;
        for axis in 0..3 {
            let (a, b, c, d) = (a[axis], b[axis], c[axis], d[axis]);
            let powers = match piece.is_straight {
                true => [a, (d - a) / duration_s, 0.0, 0.0],
                false => [
                    a,
                    3.0 * (b - a) / duration_s,
                    3.0 * (a - 2.0 * b + c) / duration_s.powi(2),
                    (d - 3.0 * (c - b) - a) / duration_s.powi(3),
                ],
            };
            for power in 0..COEFFICIENTS {
                text += &format!(",{}", powers.get(power).map_or(0.0, |it| it + 0.0));
            }
        }
        text += &",0".repeat(COEFFICIENTS);
        text += "\n";
    }
    text
}
