//! Volumes of one airborne drone: the near-field column and the far-field cone, hung below its rotors.
//!
//! A volume is a stack of [`Section`]s, figures of revolution about the vertical through the rotor centre, given by depth
//! below the rotor plane. They depend on the airframe and its mass alone. [`Section::hung`] places one
//! in the world and cuts it where the wake ends.

use crate::volumes::frame::{self, NotFinite};
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

/// Where no other drone's rotor centre may be: from the rotor plane to the end of the near field, out to the rotor tips.
pub fn column(wake: &Wake) -> Section {
    Section {
        from_depth_m: 0.0,
        to_depth_m: wake.near_field_depth_m(),
        from_radius_m: wake.column_radius_m(),
        to_radius_m: wake.column_radius_m(),
    }
}

/// All points of the far field within the half-width, `ξ ≤ 1`, down to a depth: exact, since the half-width is
/// linear in depth. `None` if the depth does not reach the far field.
///
/// Of a jet that effects have moved or widened: a frustum that stands upright below the drone and holds all of it.
pub fn cone(wake: &Wake, to_depth_m: f64) -> Option<Section> {
    let from_depth_m = wake.near_field_depth_m();
    if wake.is_shaped() {
        return (to_depth_m > from_depth_m).then(|| upright_around(wake, from_depth_m, to_depth_m));
    }
    (to_depth_m > from_depth_m).then(|| Section {
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
    /// Of a wake below a rotor centre, down to the height where it ends. Where the wind has taken the jet away it is drawn
    /// as it begins.
    pub fn new(wake: &Wake, at_m: Point3<f64>, ends_at_z_m: f64) -> Outline {
        let column = column(wake);
        let joins_z_m = (at_m.z - column.to_depth_m).max(ends_at_z_m);
        let of_tips = Level {
            aside_m: [0.0; 2],
            radius_m: wake.tip_radius_m(),
        };
        let upper = Level::of(wake, at_m.z - joins_z_m).unwrap_or(of_tips);
        let lower = Level::of(wake, at_m.z - ends_at_z_m).unwrap_or(upper);
        Outline {
            at_m,
            column_radius_m: column.to_radius_m,
            half_width_m: [upper.radius_m, lower.radius_m],
            z_m: [joins_z_m, ends_at_z_m],
            aside_m: [upper.aside_m, lower.aside_m],
        }
    }
}

/// A level cross-section of a jet: where its axis is, from below the drone, and its half-width, at its widest (m).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level {
    pub(crate) aside_m: [f64; 2],
    pub(crate) radius_m: f64,
}

impl Level {
    /// `None` where the wind has taken the jet away.
    pub(crate) fn of(wake: &Wake, depth_m: f64) -> Option<Level> {
        Some(Level {
            aside_m: wake.axis_m(depth_m)?,
            radius_m: wake.spread_m(depth_m)?,
        })
    }
}

/// Depths at which a moved jet is looked at; chosen here.
const MOVED_LEVELS: u32 = 64;
/// Just above the depth where the wind takes a jet away, as a part of it.
const JUST_ABOVE: f64 = 1.0 - 1e-9;
/// What may lie between two of them, on the radius, where tilt and wind pull apart and neither end is the wider: chosen here.
const MOVED_MARGIN: f64 = 1.02;

/// The frustum over a range of depths that holds a moved jet's half-width discs: that of its ends, lifted until it holds all between.
fn upright_around(wake: &Wake, from_depth_m: f64, to_depth_m: f64) -> Section {
    let radius_m = |depth_m: f64| {
        let level = Level::of(wake, depth_m)?;
        Some(MOVED_MARGIN * (level.aside_m[0].hypot(level.aside_m[1]) + level.radius_m))
    };
    // A jet that the wind lays down goes farthest just before it is gone.
    let last_m = wake
        .gone_from_m()
        .map_or(to_depth_m, |gone_m| to_depth_m.min(gone_m * JUST_ABOVE));
    let height_m = to_depth_m - from_depth_m;
    let levels = (0..=MOVED_LEVELS).map(|k| f64::from(k) / f64::from(MOVED_LEVELS));
    let radii_m: Vec<(f64, f64)> = levels
        .filter_map(|level| {
            let depth_m = from_depth_m + level * (last_m - from_depth_m);
            radius_m(depth_m).map(|radius_m| ((depth_m - from_depth_m) / height_m, radius_m))
        })
        .collect();
    // Below that the last radius that it had is kept.
    let first_m = radii_m.first().map_or(0.0, |(_, radius_m)| *radius_m);
    let last_m = radii_m.last().map_or(0.0, |(_, radius_m)| *radius_m);
    let line_m = |share: f64| first_m + share * (last_m - first_m);
    // Between two levels it is no wider than at the wider of both.
    let short_m = radii_m
        .windows(2)
        .map(|two| two[0].1.max(two[1].1) - line_m(two[0].0).min(line_m(two[1].0)))
        .fold(0.0, f64::max);
    Section {
        from_depth_m,
        to_depth_m,
        from_radius_m: first_m + short_m,
        to_radius_m: last_m + short_m,
    }
}

impl Section {
    /// Whether a straight path relative to the rotor centre (m, z up) enters a section with upright sides. One that
    /// only touches its upper or lower face stays outside.
    pub fn is_entered(&self, from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> bool {
        let Some((from_m, to_m)) = clip_depth(from_m, to_m, self.from_depth_m, self.to_depth_m)
        else {
            return false;
        };
        if from_m.z.max(to_m.z) <= -self.to_depth_m || from_m.z.min(to_m.z) >= -self.from_depth_m {
            return false;
        }
        nearest_radius_m(&from_m, &to_m) < self.from_radius_m.max(self.to_radius_m)
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
    pub fn holds(&self, offset_m: Vector3<f64>) -> bool {
        self.radius_m(-offset_m.z)
            .is_some_and(|radius_m| offset_m.x.hypot(offset_m.y) <= radius_m)
    }

    /// The part above a depth; `None` if nothing is left.
    pub fn cut_at(&self, depth_m: f64) -> Option<Self> {
        if depth_m >= self.to_depth_m {
            return Some(*self);
        }
        let to_radius_m = self.radius_m(depth_m)?;
        (depth_m > self.from_depth_m).then_some(Self {
            to_depth_m: depth_m,
            to_radius_m,
            ..*self
        })
    }

    /// Placed below a rotor centre (m, world) and cut where the wake ends; `None` if it ends above this section.
    ///
    /// # Errors
    /// The rotor centre or the height is NaN or infinite.
    pub fn hung(
        &self,
        rotor_centre_m: Point3<f64>,
        wake_ends_at_z_m: f64,
    ) -> Result<Option<Placed>, NotFinite> {
        frame::point(Point3::new(
            rotor_centre_m.x,
            rotor_centre_m.y,
            wake_ends_at_z_m,
        ))?;
        let centre = frame::point(rotor_centre_m).map(frame::world_point)?;
        let Some(part) = self.cut_at(centre.z - wake_ends_at_z_m) else {
            return Ok(None);
        };
        let depth_m = f64::midpoint(part.from_depth_m, part.to_depth_m);
        let pose = frame::upright(centre - Vector3::z() * depth_m)?;
        let frustum = Frustum::new(part.height_m(), part.from_radius_m, part.to_radius_m);
        Ok(frustum.map(|frustum| Placed { frustum, pose }))
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
