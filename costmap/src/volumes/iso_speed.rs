//! All points where one drone's wake is faster than a limit, covered by stacked frusta.
//!
//! Far field. With `U_C = B' U_H/σ` on the axis, half-width `r_half = S' σ` and the profile
//! `U = U_C/(1 + aξ²)²`, `a = √2 - 1` (Bauersfeld et al. 2025), the air is faster than a limit
//! within
//!
//! ```text
//! ξ² = (√(U_C/limit) - 1)/a            u = σ/σ_end, where U_C(σ_end) = limit
//! r(u) = r_end g(u)/√a                  g(u)² = f(u) = u^{3/2} - u²,  r_end = half-width at u = 1
//! ```
//!
//! for 0 < u < 1: a closed volume that ends at u = 1. It is convex, so its tangents never cut it:
//!
//! ```text
//! g'' = (2 f f″ - f′²)/(4 f^{3/2}),    2 f f″ - f′² = -u (3/4 - √u/2) < 0  on (0, 1]
//! ```
//!
//! The cover is the stack of frusta between neighbouring tangents, cut at 2.5 l above and at u = 1
//! below.
//!
//! Near field. There is no closed form between the rotor plane and 2.5 l; one cylinder covers what
//! is faster than the limit there, its radius found by search on the azimuth of a hub. N equal
//! Gaussian jets on a ring are, at a fixed radius, fastest on a hub's azimuth: Σ_k e^{c cos(θ -
//! θ_k)} = N Σ_m I_{Nm}(c) cos(N m θ) with Bessel functions I > 0, and everything else in the model
//! is round.
//!
//! A jet that effects have moved or reshaped has no closed form at all: there the sections are
//! cylinders upright below the drone, out to the farthest point that is faster than the limit,
//! found by search at every bearing.

use crate::volumes::downwash::Section;
use airflow::Wake;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// Constant of the profile, `a = √2 - 1`: half the speed at the half-width, by definition.
const PROFILE_A: f64 = SQRT_2 - 1.0;

/// Frusta that cover the far field: seven hold its volume within 2 % at any limit (the tests
/// measure it).
pub const FRUSTA: usize = 7;

/// Relative growth of every radius, and of the lower end, against rounding. Chosen here: thousands
/// of times the rounding of the formulas, and a nanometre per metre.
const GROWTH: f64 = 1e-9;

/// Depths at which the near field is searched, between the rotor plane and 2.5 l: chosen here.
const NEAR_FIELD_LEVELS: usize = 128;

/// The near field is searched for this part of the limit. Between one searched depth and the next
/// (l/51) the speed at a given radius changes by less than the rest; chosen here, and checked by
/// random points.
const NEAR_FIELD_LIMIT_PART: f64 = 0.97;

/// The volume in which one drone's wake exceeds a speed, covered from outside.
#[derive(Clone, Debug, PartialEq)]
pub struct IsoSpeedVolume {
    /// From above; none if the limit is not reached.
    pub sections: Vec<Section>,
}

impl IsoSpeedVolume {
    /// Covers the air faster than `limit_mps` with a cylinder over the near field and [`FRUSTA`]
    /// frusta over the far field.
    ///
    /// Returns `None` unless the limit is a positive number.
    pub fn new(wake: &Wake, limit_mps: f64) -> Option<Self> {
        if !(limit_mps.is_finite() && limit_mps > 0.0) {
            return None;
        }
        if wake.is_shaped() {
            return Some(moved_volume(wake, limit_mps));
        }
        let far_field = FarField::new(wake, limit_mps).map(|far| far.cover(FRUSTA));
        let near_field = near_field(wake, limit_mps).into_iter();
        Some(Self {
            sections: near_field.chain(far_field.unwrap_or_default()).collect(),
        })
    }

    /// Whether it enters a box, given by its corners as offsets from the rotor centre (m, z up).
    pub fn enters(&self, [low_m, high_m]: [Vector3<f64>; 2]) -> bool {
        let beside_m = |axis: usize| low_m[axis].max(-high_m[axis]).max(0.0);
        let beside_m = beside_m(0).hypot(beside_m(1));
        self.sections.iter().any(|section| {
            let from_m = section.from_depth_m.max(-high_m.z);
            let to_m = section.to_depth_m.min(-low_m.z);
            let mut ends = [from_m, to_m].into_iter();
            let is_within = |depth_m| section.radius_m(depth_m).is_some_and(|it| it > beside_m);
            from_m < to_m && ends.any(is_within)
        })
    }
}

/// The closed form in `u`, see the head of this file.
struct FarField {
    /// Depth at u = 0 (m, negative: the virtual origin lies above the rotors).
    origin_m: f64,
    /// Distance from u = 0 to u = 1 (m).
    length_m: f64,
    /// r_end/√a (m).
    scale_m: f64,
    /// u at 2.5 l.
    from_u: f64,
}

impl FarField {
    /// `None` if the centreline at 2.5 l is no faster than the limit.
    fn new(wake: &Wake, limit_mps: f64) -> Option<Self> {
        let from_m = wake.near_field_depth_m();
        let end_m = wake.iso_speed_end_m(limit_mps);
        if end_m <= from_m {
            return None;
        }
        let (from_width_m, end_width_m) = (wake.half_width_m(from_m), wake.half_width_m(end_m));
        // The half-width is linear in depth and zero at the virtual origin.
        let from_u = from_width_m / end_width_m;
        let length_m = (end_m - from_m) / (1.0 - from_u);
        Some(Self {
            origin_m: end_m - length_m,
            length_m,
            scale_m: end_width_m / PROFILE_A.sqrt(),
            from_u,
        })
    }

    /// Radius (m) and its derivative by u at 0 < u < 1.
    fn radius_and_slope_m(&self, u: f64) -> (f64, f64) {
        let g = (u.powf(1.5) - u * u).sqrt();
        (
            self.scale_m * g,
            self.scale_m * (1.5 * u.sqrt() - 2.0 * u) / (2.0 * g),
        )
    }

    /// Stacked frusta between tangents.
    fn cover(&self, frusta: usize) -> Vec<Section> {
        let tangents: Vec<Tangent> = self
            .tangent_points(frusta)
            .map(|u| {
                let (radius_m, slope_m) = self.radius_and_slope_m(u);
                Tangent {
                    u,
                    radius_m,
                    slope_m,
                }
            })
            .collect();
        let mut bounds = vec![self.from_u];
        bounds.extend(tangents.windows(2).map(|pair| pair[0].crossing(&pair[1])));
        bounds.push(1.0 + GROWTH);
        let depth_m = |u: f64| self.origin_m + u * self.length_m;
        let section = |(tangent, ends): (&Tangent, &[f64])| Section {
            from_depth_m: depth_m(ends[0]),
            to_depth_m: depth_m(ends[1]),
            from_radius_m: tangent.radius_at_m(ends[0]) * (1.0 + GROWTH),
            to_radius_m: tangent.radius_at_m(ends[1]) * (1.0 + GROWTH),
        };
        tangents
            .iter()
            .zip(bounds.windows(2))
            .map(section)
            .collect()
    }

    /// Where the tangents touch: equally spaced in (1 - u)^{2/3}.
    ///
    /// The slice cut off between tangents a distance h apart has the volume r |r″| h³, which is
    /// smallest in total when they are spaced with density (r |r″|)^{1/3}. That is close to (1 -
    /// u)^{-1/3}, exactly so at the blunt end.
    fn tangent_points(&self, frusta: usize) -> impl Iterator<Item = f64> {
        let whole = (1.0 - self.from_u).powf(2.0 / 3.0);
        let step = whole / frusta as f64;
        (0..frusta).map(move |i| 1.0 - (whole - step * (i as f64 + 0.5)).powf(1.5))
    }
}

/// A straight line that touches the profile from outside.
struct Tangent {
    u: f64,
    radius_m: f64,
    slope_m: f64,
}

impl Tangent {
    fn radius_at_m(&self, u: f64) -> f64 {
        (self.radius_m + self.slope_m * (u - self.u)).max(0.0)
    }

    /// Where it meets the next one. The profile is strictly concave, so slopes fall and the
    /// crossing lies between the two.
    fn crossing(&self, next: &Tangent) -> f64 {
        let u = (next.radius_m - self.radius_m + self.slope_m * self.u - next.slope_m * next.u)
            / (self.slope_m - next.slope_m);
        u.clamp(self.u, next.u)
    }
}

/// The cylinder that covers the near field where it is faster than the limit; `None` if it is
/// nowhere.
fn near_field(wake: &Wake, limit_mps: f64) -> Option<Section> {
    let depth_m = wake.near_field_depth_m();
    let searched_mps = NEAR_FIELD_LIMIT_PART * limit_mps;
    let radius_m = (0..=NEAR_FIELD_LEVELS)
        .filter_map(|level| {
            // At the rotor plane itself there is no air yet: the limit from below counts.
            let part = (level as f64 / NEAR_FIELD_LEVELS as f64).max(GROWTH);
            outermost_radius_m(wake, part * depth_m, searched_mps)
        })
        .max_by(f64::total_cmp)?;
    Some(Section {
        from_depth_m: 0.0,
        to_depth_m: depth_m,
        from_radius_m: radius_m,
        to_radius_m: radius_m,
    })
}

/// The largest radius at a depth where the wake is as fast as `speed_mps`, from outside.
///
/// Beyond the hubs every part of the model falls with radius, so the first radius that is fast
/// enough, coming from outside, is the outermost; inside of them steps of l/50 resolve the lobes,
/// each half a propeller wide.
fn outermost_radius_m(wake: &Wake, depth_m: f64, speed_mps: f64) -> Option<f64> {
    let is_fast = |radius_m: f64| {
        let sideways_m = radius_m * FRAC_1_SQRT_2; // hubs stand on the diagonals
        wake.axial_speed_mps(Vector3::new(sideways_m, sideways_m, -depth_m)) >= speed_mps
    };
    let step_m = wake.motor_distance_m() / 50.0;
    let mut slow_m = wake.tip_radius_m();
    while is_fast(slow_m) {
        slow_m *= 2.0;
    }
    let mut fast_m = slow_m - step_m;
    while !is_fast(fast_m) {
        slow_m = fast_m;
        fast_m -= step_m;
        if fast_m < 0.0 {
            return None;
        }
    }
    // Twenty halvings of l/50: to 2e-8 l, and the outer end is kept.
    for _ in 0..20 {
        let middle_m = f64::midpoint(fast_m, slow_m);
        if is_fast(middle_m) {
            fast_m = middle_m;
        } else {
            slow_m = middle_m;
        }
    }
    Some(slow_m)
}

/// Bearings at which the edge is searched for. Chosen here: between two the farthest point of a jet
/// moved by less than ten of its widths is missed by less than [`MARGIN`] allows for.
const BEARINGS: u32 = 72;
/// Depths searched in each section: chosen here.
const LEVELS: u32 = 12;
/// The edge is searched for at this part of the limit: what lies between bearings and depths looked
/// at. Chosen here, and checked by random points.
const LIMIT_PART: f64 = 0.93;
/// On every radius, for the same reason.
const MARGIN: f64 = 1.02;
/// The search ends so many motor distances below: the deepest halls are a tenth of it for the
/// smallest drones.
const DEEPEST_L: f64 = 2000.0;

fn moved_volume(wake: &Wake, limit_mps: f64) -> IsoSpeedVolume {
    let near_m = wake.near_field_depth_m();
    let section = |from_depth_m: f64, to_depth_m: f64| {
        let radius_m = farthest_m(wake, from_depth_m, to_depth_m, LIMIT_PART * limit_mps)?;
        Some(Section {
            from_depth_m,
            to_depth_m,
            from_radius_m: MARGIN * radius_m,
            to_radius_m: MARGIN * radius_m,
        })
    };
    let end_m = end_m(wake, LIMIT_PART * limit_mps);
    // Cylinders are a coarser cover than cones: four for each.
    let count = 4 * FRUSTA;
    let ratio = (end_m / near_m).max(1.0).powf(1.0 / count as f64);
    let depth_m = |k: usize| near_m * ratio.powi(k as i32);
    let far_field = (0..count)
        .filter(|_| end_m > near_m)
        .filter_map(|k| section(depth_m(k), depth_m(k + 1)));
    IsoSpeedVolume {
        sections: section(0.0, near_m).into_iter().chain(far_field).collect(),
    }
}

/// Depth below which the jet is slower than a speed everywhere, in steps of a tenth.
fn end_m(wake: &Wake, speed_mps: f64) -> f64 {
    let near_m = wake.near_field_depth_m();
    let (mut depth_m, mut end_m) = (near_m, 0.0);
    while depth_m < DEEPEST_L * wake.motor_distance_m() {
        if farthest_m(wake, depth_m, depth_m, speed_mps).is_some() {
            end_m = 1.1 * depth_m;
        } else if depth_m > 4.0 * near_m {
            break;
        }
        depth_m *= 1.1;
    }
    end_m
}

/// Distance from below the drone of the farthest point between two depths that is as fast as a
/// speed; `None`: none is.
fn farthest_m(wake: &Wake, from_m: f64, to_m: f64, speed_mps: f64) -> Option<f64> {
    let levels = if from_m == to_m { 0 } else { LEVELS };
    let mut farthest: Option<f64> = None;
    for level in 0..=levels {
        let share = f64::from(level) / f64::from(levels.max(1));
        let depth_m = (from_m + share * (to_m - from_m)).max(1e-9 * wake.near_field_depth_m());
        let (Some(axis_m), Some(spread_m)) = (wake.axis_m(depth_m), wake.spread_m(depth_m)) else {
            continue;
        };
        // From the direction in which it leans, and is longest.
        let first_bearing = axis_m[1].atan2(axis_m[0]);
        for bearing in 0..BEARINGS {
            let angle = std::f64::consts::TAU * f64::from(bearing) / f64::from(BEARINGS);
            let (sin, cos) = (angle + first_bearing).sin_cos();
            let at = |radius_m: f64| {
                Vector3::new(
                    axis_m[0] + radius_m * cos,
                    axis_m[1] + radius_m * sin,
                    -depth_m,
                )
            };
            if let Some(radius_m) =
                edge_m(|r_m| wake.axial_speed_mps(at(r_m)) >= speed_mps, spread_m)
            {
                let at_m = at(radius_m);
                farthest = Some(farthest.unwrap_or(0.0).max(at_m.xy().norm()));
            }
        }
    }
    farthest
}

/// The outermost radius about the axis that is fast enough, from outside, in steps of a thirtieth
/// of the spread.
fn edge_m(is_fast: impl Fn(f64) -> bool, spread_m: f64) -> Option<f64> {
    let mut outer_m = 2.0 * spread_m;
    while is_fast(outer_m) {
        outer_m *= 1.5;
    }
    let step_m = spread_m / 30.0;
    while outer_m > 0.0 {
        let inner_m = (outer_m - step_m).max(0.0);
        if is_fast(inner_m) {
            return Some(outer_m);
        }
        outer_m = inner_m;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use airflow::{Airframe, Jet};

    #[test]
    fn a_box_is_entered_just_where_one_of_its_points_is_held() {
        let airframe = Airframe::preset("kolibri").expect("known");
        let wake = Wake::new(&airframe, airframe.mass_kg(), 1.2, &Jet::default());
        let faster = IsoSpeedVolume::new(&wake, 2.0).expect("a limit");
        let (mut entered, mut spared) = (0, 0);
        for k in 0..200 {
            let at = |n: u32| (f64::from(3 * k + n) * 0.754_877_666_246_69).fract();
            let low_m = Vector3::new(2.0 * at(0) - 1.0, 2.0 * at(1) - 1.0, -8.0 * at(2));
            // Along each side, from corner to corner.
            let point_m = |n: u32| {
                let along = [n / 400, n / 20 % 20, n % 20].map(|it| f64::from(it) / 19.0);
                low_m + 0.5 * Vector3::from(along)
            };
            let is_held = (0..8000).any(|n| faster.sections.iter().any(|it| it.holds(point_m(n))));
            // Between two points it may be entered all the same.
            let shrunk = [0.03, 0.47].map(|it| low_m + Vector3::from([it; 3]));
            assert!(is_held || !faster.enters(shrunk), "{low_m}");
            assert!(!is_held || faster.enters([low_m, point_m(7999)]), "{low_m}");
            *(if is_held { &mut entered } else { &mut spared }) += 1;
        }
        assert!(entered > 10 && spared > 10, "{entered} {spared}");
    }
}
