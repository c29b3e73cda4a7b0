//! The wall jet of a wake over a floor: how fast, where, and at most over boxes.
//!
//! The law is that of [`GroundImpingement`]; here it meets a [`Wake`].

use nalgebra::Vector3;

use crate::effects::{FASTEST_ETA, GroundImpingement, HIGHEST_PROFILE, profile};
use crate::wake::Wake;

/// Depths at which an axis is looked at to see where it goes between two; chosen here. It may be
/// farther out by half a step.
const AXIS_LEVELS: u32 = 8;

impl GroundImpingement {
    /// Speed (m/s) along the floor, outwards, at most, over ranges: height of the rotor plane above
    /// the floor, height of the point above it and distance from the axis (m). Ranges of one value
    /// give the speed itself.
    ///
    /// `U_m ~ H^0.10 r^-1.10` and `δ ~ H^0.10 r^0.90`, so that each factor is highest at an end of
    /// its range.
    #[must_use]
    fn highest_outward_mps(
        &self,
        wake: &Wake,
        emitter_height_m: (f64, f64),
        height_m: (f64, f64),
        radius_m: (f64, f64),
    ) -> f64 {
        let least_m = wake.motor_distance_m();
        let (low_m, high_m) = (
            emitter_height_m.0.max(least_m),
            emitter_height_m.1.max(least_m),
        );
        let inner_m = |height_m: f64| 1.3 * wake.half_width_m(height_m);
        let radii_m = (
            radius_m.0.max(inner_m(low_m)),
            radius_m.1.max(inner_m(high_m)),
        );
        let root = wake.far_field().momentum_flux_m4_per_s2().sqrt();
        let fastest_mps = self.wall_jet * 1.32 * root / high_m * (radii_m.0 / high_m).powf(-1.10);
        let thickness =
            |height_m: f64, radius_m: f64| 0.098 * height_m * (radius_m / height_m).powf(0.90);
        let etas = (
            height_m.0.max(0.0) / thickness(high_m, radii_m.1),
            height_m.1.max(0.0) / thickness(low_m, radii_m.0),
        );
        let highest = if etas.0 == etas.1 || etas.1 < FASTEST_ETA {
            profile(etas.1)
        } else if etas.0 > FASTEST_ETA {
            profile(etas.0)
        } else {
            HIGHEST_PROFILE
        };
        fastest_mps * highest * (radius_m.1 / inner_m(low_m)).min(1.0)
    }

    /// The same over all places of a box as seen from all places of another, lowest and highest
    /// corners, in air over a floor.
    #[must_use]
    pub fn highest_between_mps(
        &self,
        wake: &Wake,
        floor_z_m: f64,
        emitter_m: &Corners,
        places_m: &Corners,
    ) -> f64 {
        let depths_m = (emitter_m.0.z - places_m.1.z, emitter_m.1.z - places_m.0.z);
        if depths_m.1 <= 0.0 {
            return 0.0;
        }
        let axis_m = axes_m(wake, depths_m);
        let low = |axis: usize| places_m.0[axis] - emitter_m.1[axis] - axis_m.1[axis];
        let high = |axis: usize| places_m.1[axis] - emitter_m.0[axis] - axis_m.0[axis];
        let gap = |axis: usize| low(axis).max(-high(axis)).max(0.0);
        let far = |axis: usize| low(axis).abs().max(high(axis).abs());
        self.highest_outward_mps(
            wake,
            (emitter_m.0.z - floor_z_m, emitter_m.1.z - floor_z_m),
            (places_m.0.z - floor_z_m, places_m.1.z - floor_z_m),
            (gap(0).hypot(gap(1)), far(0).hypot(far(1))),
        )
    }

    /// Velocity along the floor (m/s, x and y) at an offset from a drone at a height above it (m).
    #[must_use]
    pub fn outward_mps(
        &self,
        wake: &Wake,
        emitter_height_m: f64,
        offset_m: Vector3<f64>,
    ) -> [f64; 2] {
        if offset_m.z >= 0.0 {
            return [0.0; 2];
        }
        let [x_m, y_m] = wake.axis_m(-offset_m.z).unwrap_or([0.0; 2]);
        let (dx_m, dy_m) = (offset_m.x - x_m, offset_m.y - y_m);
        let radius_m = dx_m.hypot(dy_m);
        if radius_m == 0.0 {
            return [0.0; 2];
        }
        let height_m = emitter_height_m + offset_m.z;
        let both = |value: f64| (value, value);
        let speed_mps =
            self.highest_outward_mps(wake, both(emitter_height_m), both(height_m), both(radius_m));
        [dx_m, dy_m].map(|along_m| along_m / radius_m * speed_mps)
    }
}

/// Lowest and highest corner (m).
type Corners = (Vector3<f64>, Vector3<f64>);

/// Lowest and highest place (m, x and y from the drone) of an axis between two depths.
fn axes_m(wake: &Wake, depths_m: (f64, f64)) -> ([f64; 2], [f64; 2]) {
    let at_m = |depth_m: f64| wake.axis_m(depth_m.max(0.0)).unwrap_or([0.0; 2]);
    if !wake.is_shaped() {
        return ([0.0; 2], [0.0; 2]);
    }
    if depths_m.0 == depths_m.1 {
        return (at_m(depths_m.0), at_m(depths_m.0));
    }
    let levels = (0..=AXIS_LEVELS).map(|level| {
        at_m(depths_m.0 + f64::from(level) / f64::from(AXIS_LEVELS) * (depths_m.1 - depths_m.0))
    });
    let (mut low_m, mut high_m) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut step_m = [0.0_f64; 2];
    let mut before: Option<[f64; 2]> = None;
    for here_m in levels {
        for axis in 0..2 {
            low_m[axis] = low_m[axis].min(here_m[axis]);
            high_m[axis] = high_m[axis].max(here_m[axis]);
            let moved_m = before.map_or(0.0, |before_m| (here_m[axis] - before_m[axis]).abs());
            step_m[axis] = step_m[axis].max(moved_m);
        }
        before = Some(here_m);
    }
    for axis in 0..2 {
        low_m[axis] -= 0.5 * step_m[axis];
        high_m[axis] += 0.5 * step_m[axis];
    }
    (low_m, high_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Crossflow, Effects};
    use crate::{Airframe, Jet, Surroundings};

    fn at(index: u32) -> f64 {
        (f64::from(index) * 0.754_877_666_246_69).fract()
    }

    #[test]
    fn no_place_along_the_floor_is_faster_than_the_bound_over_boxes_says() {
        let effect = GroundImpingement {
            reach: 1.0,
            wall_jet: 1.0,
        };
        let airframe = Airframe::preset("offboard-2").expect("a preset");
        let plain = Wake::new(&airframe, airframe.mass_kg(), 1.204, &Jet::default());
        for case in 0..600 {
            let value = |k: u32| at(41 * case + k + 1);
            let effects = Effects {
                ground_impingement: Some(effect),
                crossflow: (case % 2 == 0).then_some(Crossflow {
                    wind_mps: [value(0), 0.5 - value(1)],
                }),
                ..Effects::default()
            };
            let wake = plain.with_effects(&effects);
            let size = value(2).powi(3);
            let corners = |k: u32, lift_m: f64| {
                let low_m = Vector3::new(6.0 * value(k), 6.0 * value(k + 1), lift_m);
                let size_m = Vector3::new(value(k + 2), value(k + 3), value(k + 4)) * size;
                (low_m, low_m + size_m)
            };
            let emitter_m = corners(3, 1.0 + 4.0 * value(20));
            let places_m = corners(10, value(21).powi(4));
            let bound_mps = effect.highest_between_mps(&wake, 0.0, &emitter_m, &places_m);
            for point in 0..40 {
                let part = |k: u32| at(7 * (40 * case + point) + k + 1);
                let inside = |(low_m, high_m): &Corners, k: u32| {
                    let parts = Vector3::new(part(k), part(k + 1), part(k + 2));
                    low_m + (high_m - low_m).component_mul(&parts)
                };
                let (from_m, place_m) = (inside(&emitter_m, 0), inside(&places_m, 3));
                let offset_m = place_m - from_m;
                let [x, y] = effect.outward_mps(&wake, from_m.z, offset_m);
                assert!(x.hypot(y) <= bound_mps * (1.0 + 1e-9), "{case}");
                // And it is what the flow model adds.
                let at = Surroundings {
                    lean: [0.0; 2],
                    t_s: 0.0,
                    climb_mps: 0.0,
                    floor_z_m: Some(0.0),
                    emitter_z_m: from_m.z,
                };
                let without = Effects {
                    ground_impingement: Some(GroundImpingement {
                        wall_jet: 0.0,
                        ..effect
                    }),
                    ..effects
                };
                let added_mps = at.velocity_mps(&effects, &wake, offset_m)
                    - at.velocity_mps(&without, &wake, offset_m);
                assert!((added_mps - Vector3::new(x, y, 0.0)).norm() < 1e-9);
            }
        }
    }
}
