//! From a vehicle's rows to its track: checked, turned into the world frame with z up, moved to the
//! rotor plane.

use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::checks::{FlightLimits, check};
use super::found::{Found, Place};
use super::samples::{Attitude, Samples};
use crate::record::recording::Track;
use crate::record::remark::RemarkKind;

/// Frame of the logged positions, velocities and attitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum Frame {
    /// World z up; body x forward, y left, z up.
    #[default]
    ZUp,
    /// World x north, y east, z down; body x forward, y right, z down. Turned by half a turn about
    /// x, into x north, y west, z up.
    NorthEastDown,
}

/// What the logged acceleration is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Acceleration {
    /// What an accelerometer feels, turned into the world: at hover one gravity upwards.
    SpecificForceInWorld,
    /// What an accelerometer feels, in its own frame.
    SpecificForceInBody,
    /// Change of velocity, in the world: 0 at hover.
    GravityRemovedInWorld,
    /// Change of velocity, in the frame of the body.
    GravityRemovedInBody,
}

/// Which way the logged quaternion turns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum Turns {
    /// Vectors of the body into the world.
    #[default]
    BodyToWorld,
    /// Vectors of the world into the body.
    WorldToBody,
}

/// Sign of the logged pitch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Pitch {
    /// Positive with the nose down: right-handed about y to the left.
    NoseDown,
    /// Positive with the nose up: right-handed about y to the right, and in the Crazyflie's logs.
    NoseUp,
}

/// How a log is to be understood.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conventions {
    pub(super) frame: Frame,
    /// `None`: the log has none, or it is not to be used.
    pub(super) acceleration: Option<Acceleration>,
    pub(super) rotation: Turns,
    /// `None`: right-handed in the frame of the log.
    pub(super) pitch: Option<Pitch>,
    pub(super) gravity_mps2: f64,
    /// From the logged point to the centre of the rotor plane, in the body (x forward, y left, z
    /// up; m).
    pub(super) rotor_offset_m: Vector3<f64>,
    pub(super) limits: FlightLimits,
}

/// The track of one vehicle. `None` where no row is left: a remark or a problem says why.
pub(super) fn track(
    vehicle: &str,
    file: &str,
    mut samples: Samples,
    how: &Conventions,
    found: &mut Found,
) -> Option<Track> {
    if how.frame == Frame::NorthEastDown {
        samples.turn_up();
    }
    right_handed_pitch(&mut samples, how);
    let checked = check(vehicle, &samples, &how.limits, found);
    if checked.keep.is_empty() {
        if checked.only_stood {
            let message = "never left the floor: not part of the recording";
            found.remark(RemarkKind::Touch, Some(vehicle), message);
        } else {
            let message = format!("no row of vehicle `{vehicle}` can be used");
            let help = found.remarks.iter().rev();
            let help = help
                .filter(|remark| remark.subject.as_deref() == Some(vehicle))
                .map(|remark| remark.message.clone())
                .next();
            found.helped(Place::file(file), message, help);
        }
        return None;
    }
    let keep = &checked.keep;
    let t_s = picked(&samples.t_s, keep);
    let attitude = attitude(
        vehicle,
        samples.attitude.as_ref(),
        keep,
        how.rotation,
        found,
    );
    let position_m: Vec<Point3<f64>> = keep
        .iter()
        .zip(&attitude)
        .map(|(&row, attitude)| {
            Point3::from(samples.position_m[row]) + attitude * how.rotor_offset_m
        })
        .collect();
    let velocity_mps = match &samples.velocity_mps {
        Some(all) => keep.iter().map(|&row| Vector3::from(all[row])).collect(),
        None => {
            let message = "velocity is not logged: taken from the change of position";
            found.remark(RemarkKind::Assumed, Some(vehicle), message);
            differentiated(&t_s, &position_m, checked.longest_step_s)
        }
    };
    let specific_force_mps2 = how.acceleration.zip(samples.acceleration_mps2.as_ref());
    let specific_force_mps2 = specific_force_mps2.map(|(kind, all)| {
        let force = |(&row, attitude): (&usize, &UnitQuaternion<f64>)| {
            specific_force(kind, Vector3::from(all[row]), attitude, how.gravity_mps2)
        };
        keep.iter().zip(&attitude).map(force).collect()
    });
    let columns = |column: &Option<Vec<f64>>| column.as_ref().map(|column| picked(column, keep));
    Some(Track {
        throttle_ratio: columns(&samples.throttle_ratio),
        power_w: columns(&samples.power_w),
        battery_v: columns(&samples.battery_v),
        duty: samples.duty.as_ref().map(|duty| picked(duty, keep)),
        t_s,
        position_m,
        velocity_mps,
        attitude,
        specific_force_mps2,
        longest_step_s: checked.longest_step_s,
    })
}

fn picked<T: Copy>(column: &[T], keep: &[usize]) -> Vec<T> {
    keep.iter().map(|&row| column[row]).collect()
}

/// Turns a pitch that is positive with the nose up. Half a turn about x has done it already for
/// north-east-down.
fn right_handed_pitch(samples: &mut Samples, how: &Conventions) {
    let nose_up_is_positive = match (how.pitch, how.frame) {
        (None, _) => false,
        (Some(pitch), Frame::ZUp) => pitch == Pitch::NoseUp,
        // Turned already as the right-handed one that it should be, nose up.
        (Some(pitch), Frame::NorthEastDown) => pitch == Pitch::NoseDown,
    };
    if let (true, Some(Attitude::Angles(angles))) = (nose_up_is_positive, &mut samples.attitude) {
        for [_, pitch, _] in angles {
            *pitch = -*pitch;
        }
    }
}

fn attitude(
    vehicle: &str,
    logged: Option<&Attitude>,
    keep: &[usize],
    rotation: Turns,
    found: &mut Found,
) -> Vec<UnitQuaternion<f64>> {
    let turned = |attitude: UnitQuaternion<f64>| match rotation {
        Turns::BodyToWorld => attitude,
        Turns::WorldToBody => attitude.inverse(),
    };
    match logged {
        Some(Attitude::Quaternion(all)) => keep
            .iter()
            .map(|&row| {
                let [x, y, z, w] = all[row];
                turned(UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)))
            })
            .collect(),
        Some(Attitude::Angles(all)) => keep
            .iter()
            .map(|&row| {
                let [roll, pitch, yaw] = all[row];
                UnitQuaternion::from_euler_angles(roll, pitch, yaw)
            })
            .collect(),
        None => {
            let message = "attitude is not logged: taken as level, x forward";
            found.remark(RemarkKind::Assumed, Some(vehicle), message);
            vec![UnitQuaternion::identity(); keep.len()]
        }
    }
}

/// Specific force in the world (m/s²): acceleration minus gravity.
fn specific_force(
    kind: Acceleration,
    logged: Vector3<f64>,
    attitude: &UnitQuaternion<f64>,
    gravity_mps2: f64,
) -> Vector3<f64> {
    let up = Vector3::new(0.0, 0.0, gravity_mps2);
    match kind {
        Acceleration::SpecificForceInWorld => logged,
        Acceleration::SpecificForceInBody => attitude * logged,
        Acceleration::GravityRemovedInWorld => logged + up,
        Acceleration::GravityRemovedInBody => attitude * logged + up,
    }
}

/// Central differences; one-sided at the ends and beside gaps.
fn differentiated(
    t_s: &[f64],
    position_m: &[Point3<f64>],
    longest_step_s: f64,
) -> Vec<Vector3<f64>> {
    let near = |a: usize, b: usize| t_s[b] - t_s[a] <= longest_step_s;
    (0..t_s.len())
        .map(|at| {
            let before = if at > 0 && near(at - 1, at) {
                at - 1
            } else {
                at
            };
            let after = if at + 1 < t_s.len() && near(at, at + 1) {
                at + 1
            } else {
                at
            };
            if before == after {
                return Vector3::zeros();
            }
            (position_m[after] - position_m[before]) / (t_s[after] - t_s[before])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const G: f64 = 9.81;
    /// Rounding of a few products of numbers near 10.
    const ROUNDING: f64 = 1e-12;

    fn how(frame: Frame, acceleration: Acceleration) -> Conventions {
        Conventions {
            frame,
            acceleration: Some(acceleration),
            rotation: Turns::BodyToWorld,
            pitch: None,
            gravity_mps2: G,
            rotor_offset_m: Vector3::zeros(),
            limits: FlightLimits {
                floor_z_m: None,
                touch_z_m: None,
                tilt_rad: 1.0,
            },
        }
    }

    /// Two rows at one place.
    fn rows(position_m: [f64; 3], acceleration_mps2: [f64; 3], attitude: Attitude) -> Samples {
        Samples {
            t_s: vec![0.0, 0.1],
            position_m: vec![position_m; 2],
            velocity_mps: Some(vec![[0.1, 0.2, 0.3]; 2]),
            acceleration_mps2: Some(vec![acceleration_mps2; 2]),
            attitude: Some(attitude),
            ..Samples::default()
        }
    }

    fn read(samples: Samples, how: &Conventions) -> (Track, Found) {
        let mut found = Found::default();
        let read = track("v", "f.csv", samples, how, &mut found).expect("rows are left");
        (read, found)
    }

    #[test]
    fn hover_reads_one_gravity_upwards_whatever_the_kind_and_the_frame() {
        let level = || Attitude::Quaternion(vec![[0.0, 0.0, 0.0, 1.0]; 2]);
        for (frame, kind, logged) in [
            (
                Frame::ZUp,
                Acceleration::SpecificForceInWorld,
                [0.0, 0.0, G],
            ),
            (Frame::ZUp, Acceleration::SpecificForceInBody, [0.0, 0.0, G]),
            (Frame::ZUp, Acceleration::GravityRemovedInWorld, [0.0; 3]),
            (Frame::ZUp, Acceleration::GravityRemovedInBody, [0.0; 3]),
            (
                Frame::NorthEastDown,
                Acceleration::SpecificForceInBody,
                [0.0, 0.0, -G],
            ),
            (
                Frame::NorthEastDown,
                Acceleration::GravityRemovedInWorld,
                [0.0; 3],
            ),
        ] {
            let (track, _) = read(rows([0.0; 3], logged, level()), &how(frame, kind));
            let force = track.specific_force_mps2.expect("asked for")[0];
            assert!(
                (force - Vector3::new(0.0, 0.0, G)).norm() < ROUNDING,
                "{kind:?}"
            );
        }
    }

    #[test]
    fn north_east_down_becomes_north_west_up() {
        // Nose up by 0.3 rad: positive pitch about y to the right.
        let angles = Attitude::Angles(vec![[0.0, 0.3, 0.0]; 2]);
        let how = how(Frame::NorthEastDown, Acceleration::SpecificForceInBody);
        let (track, _) = read(rows([1.0, 2.0, -3.0], [0.0, 0.0, -G], angles), &how);
        assert_eq!(track.position_m[0], Point3::new(1.0, -2.0, 3.0));
        assert_eq!(track.velocity_mps[0], Vector3::new(0.1, -0.2, -0.3));
        // The nose points up, so thrust leans back, to the south.
        let nose = track.attitude[0] * Vector3::x();
        let thrust = track.attitude[0] * Vector3::z();
        assert!((nose - Vector3::new(0.3_f64.cos(), 0.0, 0.3_f64.sin())).norm() < ROUNDING);
        assert!(thrust.x < 0.0);
    }

    #[test]
    fn a_pitch_with_the_nose_up_is_turned_over() {
        let angles = || Attitude::Angles(vec![[0.0, 0.2, 0.0]; 2]);
        let mut how = how(Frame::ZUp, Acceleration::SpecificForceInWorld);
        for (pitch, nose_z_sign) in [
            (None, -1.0),
            (Some(Pitch::NoseDown), -1.0),
            (Some(Pitch::NoseUp), 1.0),
        ] {
            how.pitch = pitch;
            let (track, _) = read(rows([0.0; 3], [0.0, 0.0, G], angles()), &how);
            let nose = track.attitude[0] * Vector3::x();
            assert!(nose.z * nose_z_sign > 0.1);
        }
    }

    #[test]
    fn quaternions_of_the_other_direction_are_inverted_and_the_offset_turns_with_the_body() {
        // World to body: the inverse of a quarter turn to the left.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let attitude = Attitude::Quaternion(vec![[0.0, 0.0, -half, half]; 2]);
        let mut how = how(Frame::ZUp, Acceleration::SpecificForceInWorld);
        how.rotation = Turns::WorldToBody;
        how.rotor_offset_m = Vector3::new(0.1, 0.0, 0.02);
        let (track, _) = read(rows([1.0, 1.0, 1.0], [0.0, 0.0, G], attitude), &how);
        assert!((track.position_m[0] - Point3::new(1.0, 1.1, 1.02)).norm() < ROUNDING);
    }

    #[test]
    fn a_missing_velocity_or_attitude_is_worked_out_and_said() {
        let samples = Samples {
            t_s: vec![0.0, 0.1, 0.2],
            position_m: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]],
            ..Samples::default()
        };
        let (track, found) = read(
            samples,
            &how(Frame::ZUp, Acceleration::SpecificForceInWorld),
        );
        for velocity_mps in &track.velocity_mps {
            assert!((velocity_mps - Vector3::x()).norm() < ROUNDING);
        }
        let said: Vec<&str> = found
            .remarks
            .iter()
            .map(|remark| remark.message.as_str())
            .collect();
        assert_eq!(
            said,
            [
                "attitude is not logged: taken as level, x forward",
                "velocity is not logged: taken from the change of position"
            ]
        );
        assert!(track.specific_force_mps2.is_none());
    }
}
