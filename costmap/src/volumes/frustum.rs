//! The truncated cone as a parry support map: exact, no facets.
//!
//! In its own frame the axis is y, the centre lies halfway up, and the top and bottom faces are
//! discs at `y = +half height` and `y = -half height`. A cylinder is the frustum with equal radii,
//! a cone the one with a radius of zero; a height of zero leaves a disc. The support map needs one
//! comparison; parry's GJK asks nothing else.

use parry3d::math::Vector;
use parry3d::shape::SupportMap;

/// A solid truncated cone with its axis on local y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    half_height_m: f64,
    top_radius_m: f64,
    bottom_radius_m: f64,
}

impl Frustum {
    /// From its height and the radii of its upper and lower face (m); `None` unless all three are
    /// finite and not negative.
    pub fn new(height_m: f64, top_radius_m: f64, bottom_radius_m: f64) -> Option<Self> {
        let lengths_m = [height_m, top_radius_m, bottom_radius_m];
        let valid = |length_m: &f64| length_m.is_finite() && *length_m >= 0.0;
        lengths_m.iter().all(valid).then_some(Self {
            half_height_m: height_m / 2.0,
            top_radius_m,
            bottom_radius_m,
        })
    }

    /// Distance between its faces (m).
    pub fn height_m(&self) -> f64 {
        2.0 * self.half_height_m
    }

    /// Radius of the face at `y = +half height` (m).
    pub fn top_radius_m(&self) -> f64 {
        self.top_radius_m
    }

    /// Radius of the face at `y = -half height` (m).
    pub fn bottom_radius_m(&self) -> f64 {
        self.bottom_radius_m
    }
}

impl SupportMap for Frustum {
    fn local_support_point(&self, dir: Vector) -> Vector {
        let sideways = dir.x.hypot(dir.z);
        let outward = if sideways > 0.0 {
            Vector::new(dir.x / sideways, 0.0, dir.z / sideways)
        } else {
            Vector::X
        };
        let top = Vector::new(0.0, self.half_height_m, 0.0) + outward * self.top_radius_m;
        let bottom = Vector::new(0.0, -self.half_height_m, 0.0) + outward * self.bottom_radius_m;
        // top·d - bottom·d, with outward·d = sideways
        let top_minus_bottom = 2.0 * self.half_height_m * dir.y
            + (self.top_radius_m - self.bottom_radius_m) * sideways;
        if top_minus_bottom > 0.0 { top } else { bottom }
    }
}
