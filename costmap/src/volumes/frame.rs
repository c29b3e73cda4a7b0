//! The crossing between the world (nalgebra, metres, z up) and parry (glam, shapes standing on y).
//!
//! Parry's world is ours, coordinate by coordinate; only its round shapes stand on their local y
//! axis. [`upright`] therefore turns local y to world z, and everything else copies three numbers.

use nalgebra::{Point3, Vector3};
use parry3d::math::{Pose, Rotation, Vector};
use std::f64::consts::FRAC_1_SQRT_2;

/// A quarter turn about x, as a quaternion: local y becomes world z, local z becomes world -y.
const Y_UP_TO_Z_UP: Rotation = Rotation::from_xyzw(FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2);

/// Pose, in the world, of a parry shape that stands upright with its local origin at `centre_m`.
pub fn upright(centre_m: Point3<f64>) -> Pose {
    Pose::from_parts(vector(centre_m.coords), Y_UP_TO_Z_UP)
}

/// Pose, in the world, of a shape without a preferred axis (a ball, a box) centred at `centre_m`.
pub fn centred(centre_m: Point3<f64>) -> Pose {
    Pose::from_translation(vector(centre_m.coords))
}

/// A world vector for parry.
pub(crate) fn vector(vector_m: Vector3<f64>) -> Vector {
    Vector::new(vector_m.x, vector_m.y, vector_m.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_up_becomes_world_up() {
        let pose = upright(Point3::new(1.0, 2.0, 3.0));
        let tip = pose * Vector::Y;
        // Rounding of one quaternion product.
        assert!((tip - Vector::new(1.0, 2.0, 4.0)).length() < 1e-15);
    }
}
