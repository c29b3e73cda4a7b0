//! From a vehicle's rows to its track: checked, turned into the world frame with z up, moved to the
//! rotor plane.

use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};

use super::checks::{check, spare};
use super::columns::Role;
use super::conventions::{Acceleration, Conventions, Frame, Pitch, Turns};
use super::found::Found;
use super::plausible;
use super::samples::Samples;
use crate::record::problem::Problem;
use crate::record::recording::Track;
use crate::record::remark::RemarkKind;

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
    let is_pitch_turned = match how.frame {
        Frame::ZUp => how.pitch == Some(Pitch::NoseUp),
        // Turned already as the right-handed one that it should be, nose up.
        Frame::NorthEastDown => how.pitch == Some(Pitch::NoseDown),
    };
    let rotation = match samples.columns.contains_key(&Role::Quaternion(0)) {
        true => how.rotation,
        false => Turns::BodyToWorld,
    };
    samples.quaternions_from_angles(is_pitch_turned);
    spare(vehicle, &mut samples, how, found);
    let checked = check((vehicle, file), &samples, how, found);
    let keep = &checked.keep;
    if keep.is_empty() {
        if checked.only_stood {
            let message = "never left the floor: not part of the recording";
            found.remark(RemarkKind::Touch, Some(vehicle), message);
            return None;
        }
        let message = format!("no row of vehicle `{vehicle}` can be used");
        let mut remarks = found.remarks.iter().rev();
        let last = remarks.find(|remark| remark.subject.as_deref() == Some(vehicle));
        let help = last.map(|remark| remark.message.clone());
        found.helped(Problem::file(file), message, help);
        return None;
    }
    let mut assumed = |message| found.remark(RemarkKind::Assumed, Some(vehicle), message);
    let column = |role| {
        let column = samples.columns.get(&role)?;
        Some(keep.iter().map(|&row| column[row]).collect::<Vec<f64>>())
    };
    let vectors = |role| {
        let axes = samples.group::<3>(role)?;
        let vector = |&row: &usize| Vector3::from(axes.map(|axis| axis[row]));
        Some(keep.iter().map(vector).collect::<Vec<_>>())
    };
    let t_s = column(Role::Time).unwrap_or_default();
    let attitude: Vec<UnitQuaternion<f64>> = match samples.group(Role::Quaternion) {
        Some([x, y, z, w]) => {
            let logged = |&row: &usize| {
                let quaternion = Quaternion::new(w[row], x[row], y[row], z[row]);
                let attitude = UnitQuaternion::from_quaternion(quaternion);
                match rotation {
                    Turns::BodyToWorld => attitude,
                    Turns::WorldToBody => attitude.inverse(),
                }
            };
            keep.iter().map(logged).collect()
        }
        None => {
            assumed("attitude is not logged: taken as level, x forward");
            vec![UnitQuaternion::identity(); keep.len()]
        }
    };
    let logged_m = vectors(Role::Position).unwrap_or_default().into_iter();
    let position_m: Vec<Point3<f64>> = logged_m
        .zip(&attitude)
        .map(|(logged_m, attitude)| Point3::from(logged_m) + attitude * how.rotor_offset_m)
        .collect();
    let velocity_mps = vectors(Role::Velocity).unwrap_or_else(|| {
        assumed("velocity is not logged: taken from the change of position");
        differentiated(&t_s, &position_m, checked.longest_step_s)
    });
    let logged_mps2 = how.acceleration.zip(vectors(Role::Acceleration));
    let specific_force_mps2 = logged_mps2.map(|(kind, all)| {
        let force = |(&logged, attitude): (&Vector3<f64>, &UnitQuaternion<f64>)| {
            specific_force(kind, logged, attitude, how.gravity_mps2)
        };
        all.iter().zip(&attitude).map(force).collect()
    });
    let duty = samples.group::<4>(Role::Duty).map(|motors| {
        let rows = keep.iter();
        rows.map(|&row| motors.map(|duty| duty[row])).collect()
    });
    let rotor_speed = samples.group::<4>(Role::RotorSpeed).map(|rotors| {
        let rows = keep.iter();
        // Of some motors the sign is that of their direction.
        rows.map(|&row| rotors.map(|radps| radps[row].abs()))
            .collect()
    });
    let read = Track {
        attitude_is_logged: samples.columns.contains_key(&Role::Quaternion(0)),
        rotor_speed_radps: rotor_speed,
        thrust_n: column(Role::Thrust),
        force_n: vectors(Role::Force),
        throttle_ratio: column(Role::Throttle),
        power_w: column(Role::Power),
        battery_v: column(Role::Battery),
        duty,
        t_s,
        position_m,
        velocity_mps,
        attitude,
        specific_force_mps2,
        longest_step_s: checked.longest_step_s,
    };
    plausible::track(vehicle, file, &read, how.gravity_mps2, found);
    Some(read)
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
    let last = t_s.len().saturating_sub(1);
    let near = |a: usize, b: usize| t_s[b] - t_s[a] <= longest_step_s;
    let slope = |at: usize| {
        let before = at.saturating_sub(1);
        let before = if near(before, at) { before } else { at };
        let after = (at + 1).min(last);
        let after = if near(at, after) { after } else { at };
        if before == after {
            return Vector3::zeros();
        }
        (position_m[after] - position_m[before]) / (t_s[after] - t_s[before])
    };
    (0..t_s.len()).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::super::columns::RoleOf;
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
            floor_z_m: None,
            touch_z_m: None,
            crash_tilt_rad: 1.0,
        }
    }

    /// Two rows at one place, with an attitude of a quaternion or angles.
    fn rows(position_m: [f64; 3], acceleration_mps2: [f64; 3], attitude: &[f64]) -> Samples {
        let role: RoleOf = match attitude.len() {
            4 => Role::Quaternion,
            _ => Role::Angle,
        };
        let groups: [(RoleOf, &[f64]); 4] = [
            (Role::Position, &position_m),
            (Role::Velocity, &[0.1, 0.2, 0.3]),
            (Role::Acceleration, &acceleration_mps2),
            (role, attitude),
        ];
        let mut samples = Samples::default();
        samples.columns.insert(Role::Time, vec![0.0, 0.1]);
        for (role, values) in groups {
            for (axis, &value) in values.iter().enumerate() {
                samples.columns.insert(role(axis), vec![value; 2]);
            }
        }
        samples
    }

    fn read(samples: Samples, how: &Conventions) -> (Track, Found) {
        let mut found = Found::default();
        let read = track("v", "f.csv", samples, how, &mut found).expect("rows are left");
        (read, found)
    }

    #[test]
    fn hover_reads_one_gravity_upwards_whatever_the_kind_and_the_frame() {
        let level = [0.0, 0.0, 0.0, 1.0];
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
            let (track, _) = read(rows([0.0; 3], logged, &level), &how(frame, kind));
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
        let angles = [0.0, 0.3, 0.0];
        let how = how(Frame::NorthEastDown, Acceleration::SpecificForceInBody);
        let (track, _) = read(rows([1.0, 2.0, -3.0], [0.0, 0.0, -G], &angles), &how);
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
        let angles = [0.0, 0.2, 0.0];
        let mut how = how(Frame::ZUp, Acceleration::SpecificForceInWorld);
        for (pitch, nose_z_sign) in [
            (None, -1.0),
            (Some(Pitch::NoseDown), -1.0),
            (Some(Pitch::NoseUp), 1.0),
        ] {
            how.pitch = pitch;
            let (track, _) = read(rows([0.0; 3], [0.0, 0.0, G], &angles), &how);
            let nose = track.attitude[0] * Vector3::x();
            assert!(nose.z * nose_z_sign > 0.1);
        }
    }

    #[test]
    fn quaternions_of_the_other_direction_are_inverted_and_the_offset_turns_with_the_body() {
        // World to body: the inverse of a quarter turn to the left.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let attitude = [0.0, 0.0, -half, half];
        let mut how = how(Frame::ZUp, Acceleration::SpecificForceInWorld);
        how.rotation = Turns::WorldToBody;
        how.rotor_offset_m = Vector3::new(0.1, 0.0, 0.02);
        let (track, _) = read(rows([1.0, 1.0, 1.0], [0.0, 0.0, G], &attitude), &how);
        assert!((track.position_m[0] - Point3::new(1.0, 1.1, 1.02)).norm() < ROUNDING);
    }

    #[test]
    fn a_missing_velocity_or_attitude_is_worked_out_and_said() {
        let mut samples = Samples::default();
        for role in [Role::Time, Role::Position(0)] {
            samples.columns.insert(role, vec![0.0, 0.1, 0.2]);
        }
        for axis in [1, 2] {
            samples.columns.insert(Role::Position(axis), vec![0.0; 3]);
        }
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
