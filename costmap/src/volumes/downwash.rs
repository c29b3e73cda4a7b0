//! Volumes of one airborne drone: the near-field column and the far-field cone, hung below its
//! rotors.
//!
//! A volume is a stack of [`Section`]s, figures of revolution about the vertical through the rotor
//! centre, given by depth below the rotor plane. They depend on the airframe and its mass alone.
//! [`Section::placed_below`] places one in the world.

use crate::volumes::frame;
use crate::volumes::frustum::Frustum;
use crate::volumes::relative::nearest_radius_m;
use airflow::Wake;
use nalgebra::{Point3, Vector3};
use parry3d::math::Pose;

/// A slice of a figure of revolution about the vertical below a rotor centre, with straight sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Depth of its upper face below the rotor plane (m).
    pub from_depth_m: f64,
    /// Depth of its lower face below the rotor plane (m).
    pub to_depth_m: f64,
    /// Radius of its upper face (m).
    pub from_radius_m: f64,
    /// Radius of its lower face (m).
    pub to_radius_m: f64,
}

/// A frustum standing somewhere in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// The shape, in its own frame (axis on y).
    pub frustum: Frustum,
    /// Its pose in the world; upright.
    pub pose: Pose,
}

/// Where no other drone's rotor centre may be: from the rotor plane to the end of the near field,
/// out to the rotor tips.
pub fn column(wake: &Wake) -> Section {
    Section {
        from_depth_m: 0.0,
        to_depth_m: wake.near_field_depth_m(),
        from_radius_m: wake.column_radius_m(),
        to_radius_m: wake.column_radius_m(),
    }
}

/// All points of the far field within the half-width, `ξ ≤ 1`, down to a depth: exact, since the
/// half-width is linear in depth. `None` if the depth does not reach the far field, and for a jet
/// that effects have moved or widened: that is no cone.
pub fn cone(wake: &Wake, to_depth_m: f64) -> Option<Section> {
    let from_depth_m = wake.near_field_depth_m();
    (to_depth_m > from_depth_m && !wake.is_shaped()).then(|| Section {
        from_depth_m,
        to_depth_m,
        from_radius_m: wake.half_width_m(from_depth_m),
        to_radius_m: wake.half_width_m(to_depth_m),
    })
}

/// Column and cone of a wake as a picture draws them (m): straight between three heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outline {
    /// Rotor-plane centre, in the world.
    pub at_m: Point3<f64>,
    /// Radius of the near-field column.
    pub column_radius_m: f64,
    /// Half-width where the far field begins, and where the wake ends.
    pub half_width_m: [f64; 2],
    /// Heights at which the far field begins and the wake ends.
    pub z_m: [f64; 2],
    /// How far wind or tilt have moved the axis there.
    pub aside_m: [[f64; 2]; 2],
}

impl Outline {
    /// Of a wake below a rotor centre, down to the height where it ends. Where the wind has taken
    /// the jet away it is drawn as it begins.
    pub fn new(wake: &Wake, at_m: Point3<f64>, ends_at_z_m: f64) -> Outline {
        let column = column(wake);
        let joins_z_m = (at_m.z - column.to_depth_m).max(ends_at_z_m);
        let depths_m = [joins_z_m, ends_at_z_m].map(|z_m| at_m.z - z_m);
        let of_tips = ([0.0; 2], wake.tip_radius_m());
        let (upper, lower) = match cone(wake, depths_m[1]) {
            Some(cone) => (([0.0; 2], cone.from_radius_m), ([0.0; 2], cone.to_radius_m)),
            None => {
                let level = |depth_m| Some((wake.axis_m(depth_m)?, wake.spread_m(depth_m)?));
                let upper = level(depths_m[0]).unwrap_or(of_tips);
                (upper, level(depths_m[1]).unwrap_or(upper))
            }
        };
        Outline {
            at_m,
            column_radius_m: column.to_radius_m,
            half_width_m: [upper.1, lower.1],
            z_m: [joins_z_m, ends_at_z_m],
            aside_m: [upper.0, lower.0],
        }
    }
}

impl Section {
    /// Whether a straight path relative to the rotor centre (m, z up) enters a section with upright
    /// sides. One that only touches its upper or lower face stays outside.
    pub(crate) fn is_entered(&self, from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> bool {
        let Some((from_m, to_m)) = clip_depth(from_m, to_m, self.from_depth_m, self.to_depth_m)
        else {
            return false;
        };
        if from_m.z.max(to_m.z) <= -self.to_depth_m || from_m.z.min(to_m.z) >= -self.from_depth_m {
            return false;
        }
        nearest_radius_m(&from_m, &to_m) < self.from_radius_m.max(self.to_radius_m)
    }

    /// Grown by a length in every direction.
    #[must_use]
    pub fn grown(&self, by_m: f64) -> Section {
        Section {
            from_depth_m: self.from_depth_m - by_m,
            to_depth_m: self.to_depth_m + by_m,
            from_radius_m: self.from_radius_m + by_m,
            to_radius_m: self.to_radius_m + by_m,
        }
    }

    /// Distance between its faces (m).
    pub fn height_m(&self) -> f64 {
        self.to_depth_m - self.from_depth_m
    }

    /// Its radius at a depth (m); `None` above and below it.
    pub fn radius_m(&self, depth_m: f64) -> Option<f64> {
        if !(self.from_depth_m..=self.to_depth_m).contains(&depth_m) {
            return None;
        }
        if self.height_m() <= 0.0 {
            return Some(self.from_radius_m.max(self.to_radius_m));
        }
        let along = (depth_m - self.from_depth_m) / self.height_m();
        Some(self.from_radius_m + along * (self.to_radius_m - self.from_radius_m))
    }

    /// Whether it holds a point, given as its offset from the rotor centre (m, z up).
    #[cfg(test)]
    pub(crate) fn holds(&self, offset_m: Vector3<f64>) -> bool {
        self.radius_m(-offset_m.z)
            .is_some_and(|radius_m| offset_m.x.hypot(offset_m.y) <= radius_m)
    }

    /// Placed below a rotor centre (m, world); `None` unless its lengths are finite and none of
    /// them negative.
    pub fn placed_below(&self, rotor_centre_m: Point3<f64>) -> Option<Placed> {
        let depth_m = f64::midpoint(self.from_depth_m, self.to_depth_m);
        let frustum = Frustum::new(self.height_m(), self.from_radius_m, self.to_radius_m);
        frustum.map(|frustum| Placed {
            frustum,
            pose: frame::upright(rotor_centre_m - Vector3::z() * depth_m),
        })
    }
}

/// The part of a path whose depth below the emitter lies in a range, both ends included.
pub(crate) fn clip_depth(
    from_m: &Vector3<f64>,
    to_m: &Vector3<f64>,
    shallow_m: f64,
    deep_m: f64,
) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let (from_depth_m, to_depth_m) = (-from_m.z, -to_m.z);
    let fall_m = to_depth_m - from_depth_m;
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    if fall_m.abs() < 1e-12 {
        if from_depth_m < shallow_m || from_depth_m > deep_m {
            return None;
        }
    } else {
        let a = (shallow_m - from_depth_m) / fall_m;
        let b = (deep_m - from_depth_m) / fall_m;
        first = first.max(a.min(b));
        last = last.min(a.max(b));
    }
    if first > last {
        return None;
    }
    let path_m = to_m - from_m;
    Some((from_m + path_m * first, from_m + path_m * last))
}
