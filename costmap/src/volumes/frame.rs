//! The crossing between the world (nalgebra, metres, z up) and parry (glam, shapes standing on y).
//!
//! Parry's world is ours, coordinate by coordinate; only its round shapes stand on their local y
//! axis. [`upright`] therefore turns local y to world z, and everything else copies three numbers.
//! Numbers that are not finite stop here: parry answers "intersecting" to a NaN pose, or panics.

use nalgebra::{Point3, Vector3};
use parry3d::math::{Pose, Rotation, Vector};
use std::f64::consts::FRAC_1_SQRT_2;
use thiserror::Error;

/// A coordinate is NaN or infinite, so no geometry can be asked about it.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("not finite: {what} ({x}, {y}, {z})")]
pub struct NotFinite {
    /// What the coordinates describe.
    pub what: &'static str,
    /// First coordinate.
    pub x: f64,
    /// Second coordinate.
    pub y: f64,
    /// Third coordinate.
    pub z: f64,
}

/// A quarter turn about x, as a quaternion: local y becomes world z, local z becomes world -y.
const Y_UP_TO_Z_UP: Rotation = Rotation::from_xyzw(FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2);

/// Pose, in the world, of a parry shape that stands upright with its local origin at `centre_m`.
///
/// # Errors
/// A coordinate is NaN or infinite.
pub fn upright(centre_m: Point3<f64>) -> Result<Pose, NotFinite> {
    Ok(Pose::from_parts(point(centre_m)?, Y_UP_TO_Z_UP))
}

/// Pose, in the world, of a shape without a preferred axis (a ball, a box) centred at `centre_m`.
///
/// # Errors
/// A coordinate is NaN or infinite.
pub fn centred(centre_m: Point3<f64>) -> Result<Pose, NotFinite> {
    Ok(Pose::from_translation(point(centre_m)?))
}

/// A world point for parry.
///
/// # Errors
/// A coordinate is NaN or infinite.
pub fn point(point_m: Point3<f64>) -> Result<Vector, NotFinite> {
    finite("position", point_m.x, point_m.y, point_m.z)
}

/// A world vector for parry.
///
/// # Errors
/// A component is NaN or infinite.
pub fn vector(vector_m: Vector3<f64>) -> Result<Vector, NotFinite> {
    finite("displacement", vector_m.x, vector_m.y, vector_m.z)
}

/// A parry world vector as a point of the world.
pub(crate) fn world_point(vector: Vector) -> Point3<f64> {
    Point3::new(vector.x, vector.y, vector.z)
}

/// Refuses a pose that was made elsewhere and carries NaN or infinity.
///
/// # Errors
/// Its translation or rotation is not finite.
pub fn checked(pose: &Pose) -> Result<(), NotFinite> {
    let t = pose.translation;
    finite("pose", t.x, t.y, t.z)?;
    if pose.rotation.is_finite() {
        Ok(())
    } else {
        Err(NotFinite {
            what: "rotation of the pose at",
            x: t.x,
            y: t.y,
            z: t.z,
        })
    }
}

fn finite(what: &'static str, x: f64, y: f64, z: f64) -> Result<Vector, NotFinite> {
    if x.is_finite() && y.is_finite() && z.is_finite() {
        Ok(Vector::new(x, y, z))
    } else {
        Err(NotFinite { what, x, y, z })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_up_becomes_world_up() {
        let pose = upright(Point3::new(1.0, 2.0, 3.0)).expect("finite");
        let tip = world_point(pose * Vector::Y);
        // Rounding of one quaternion product.
        assert!((tip - Point3::new(1.0, 2.0, 4.0)).norm() < 1e-15);
    }

    #[test]
    fn no_pose_carries_nan_or_infinity() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for axis in 0..3 {
                let mut at = Point3::new(0.0, 0.0, 0.0);
                at[axis] = bad;
                assert!(upright(at).is_err() && centred(at).is_err());
                assert!(vector(at.coords).is_err());
                let pose = Pose::from_translation(Vector::new(at.x, at.y, at.z));
                assert!(checked(&pose).is_err());
            }
        }
        assert!(
            checked(&Pose::from_parts(
                Vector::ZERO,
                Rotation::from_xyzw(f64::NAN, 0., 0., 1.)
            ))
            .is_err()
        );
    }
}
