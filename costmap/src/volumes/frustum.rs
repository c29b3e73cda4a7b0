//! The truncated cone as a parry shape: exact, no facets.
//!
//! In its own frame the axis is y, the centre lies halfway up, and the top and bottom faces are discs at
//! `y = +half height` and `y = -half height`. A cylinder is the frustum with equal radii, a cone the one with a
//! radius of zero; a height of zero leaves a disc.
//!
//! A frustum is a figure of revolution, so every question about one point is a question about its
//! half profile in the plane of radius and height: a convex quadrilateral with the axis as one side.
//! The support map needs one comparison, the nearest point three projections on segments. Parry
//! sends ball queries to the nearest point (closed form) and all others to the support map (GJK, EPA);
//! the two share no code, so one can be held against the other.

use parry3d::bounding_volume::{Aabb, BoundingSphere};
use parry3d::mass_properties::MassProperties;
use parry3d::math::{Real, Vector};
use parry3d::query::details::local_ray_intersection_with_support_map_with_params;
use parry3d::query::gjk::VoronoiSimplex;
use parry3d::query::{PointProjection, PointQuery, Ray, RayCast, RayIntersection};
use parry3d::shape::{FeatureId, Shape, ShapeType, SubShapeId, SupportMap, TypedShape};
use std::f64::consts::PI;
use thiserror::Error;

/// A solid truncated cone with its axis on local y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    half_height_m: f64,
    top_radius_m: f64,
    bottom_radius_m: f64,
}

/// A height or radius that no frustum has.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error(
    "a frustum {height_m} m high with radii {top_radius_m} m and {bottom_radius_m} m does not exist: all three must be finite and not negative"
)]
pub struct NoSuchFrustum {
    /// Height asked for (m).
    pub height_m: f64,
    /// Radius asked for at the top (m).
    pub top_radius_m: f64,
    /// Radius asked for at the bottom (m).
    pub bottom_radius_m: f64,
}

impl Frustum {
    /// From its height and the radii of its upper and lower face (m).
    ///
    /// # Errors
    /// A length is negative, NaN or infinite.
    pub fn new(
        height_m: f64,
        top_radius_m: f64,
        bottom_radius_m: f64,
    ) -> Result<Self, NoSuchFrustum> {
        let valid = |length_m: f64| length_m.is_finite() && length_m >= 0.0;
        if valid(height_m) && valid(top_radius_m) && valid(bottom_radius_m) {
            Ok(Self {
                half_height_m: height_m / 2.0,
                top_radius_m,
                bottom_radius_m,
            })
        } else {
            Err(NoSuchFrustum {
                height_m,
                top_radius_m,
                bottom_radius_m,
            })
        }
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

    /// Volume (m³).
    pub fn volume_m3(&self) -> f64 {
        let (top, bottom) = (self.top_radius_m, self.bottom_radius_m);
        PI / 3.0 * self.height_m() * (top * top + top * bottom + bottom * bottom)
    }

    /// Distance from its surface (m) of a point `radius_m` off the axis at height `y_m` in its own frame;
    /// negative inside.
    pub fn signed_distance_m(&self, radius_m: f64, y_m: f64) -> f64 {
        let nearest = self.nearest_on_profile(radius_m, y_m);
        let distance_m = (nearest.radius_m - radius_m).hypot(nearest.y_m - y_m);
        if self.covers(radius_m, y_m) {
            -distance_m
        } else {
            distance_m
        }
    }

    /// Whether a ball meets it; the ball's centre lies `radius_m` off the axis at height `y_m` in its own frame.
    pub fn meets_ball(&self, radius_m: f64, y_m: f64, ball_radius_m: f64) -> bool {
        self.signed_distance_m(radius_m, y_m) <= ball_radius_m
    }

    fn radius_at_m(&self, y_m: f64) -> f64 {
        if self.half_height_m == 0.0 {
            return self.widest_m();
        }
        let from_bottom = (y_m / self.half_height_m + 1.0) / 2.0;
        self.bottom_radius_m + from_bottom * (self.top_radius_m - self.bottom_radius_m)
    }

    fn widest_m(&self) -> f64 {
        self.top_radius_m.max(self.bottom_radius_m)
    }

    fn covers(&self, radius_m: f64, y_m: f64) -> bool {
        y_m.abs() <= self.half_height_m && radius_m <= self.radius_at_m(y_m)
    }

    /// The point of the boundary nearest to a point of the half plane: on the top face, the bottom face or
    /// the side, whichever is closest; in a tie the first of these.
    fn nearest_on_profile(&self, radius_m: f64, y_m: f64) -> OnProfile {
        let h = self.half_height_m;
        let top = OnProfile {
            radius_m: radius_m.min(self.top_radius_m),
            y_m: h,
            face: TOP,
        };
        let bottom = OnProfile {
            radius_m: radius_m.min(self.bottom_radius_m),
            y_m: -h,
            face: BOTTOM,
        };
        let slope_m = self.top_radius_m - self.bottom_radius_m;
        let length_m2 = slope_m * slope_m + 4.0 * h * h;
        let along = if length_m2 > 0.0 {
            (((radius_m - self.bottom_radius_m) * slope_m + (y_m + h) * 2.0 * h) / length_m2)
                .clamp(0.0, 1.0)
        } else {
            0.0
        };
        let side = OnProfile {
            radius_m: self.bottom_radius_m + along * slope_m,
            y_m: -h + along * 2.0 * h,
            face: SIDE,
        };
        let distance_m2 = |p: &OnProfile| (p.radius_m - radius_m).powi(2) + (p.y_m - y_m).powi(2);
        let flat = if distance_m2(&bottom) < distance_m2(&top) {
            bottom
        } else {
            top
        };
        if distance_m2(&side) < distance_m2(&flat) {
            side
        } else {
            flat
        }
    }
}

const TOP: FeatureId = FeatureId::Face(0);
const BOTTOM: FeatureId = FeatureId::Face(1);
const SIDE: FeatureId = FeatureId::Face(2);

/// A point of the half profile, and the face it lies on.
struct OnProfile {
    radius_m: f64,
    y_m: f64,
    face: FeatureId,
}

/// Distance from the axis, and the unit vector from it; x for a point on the axis.
fn from_axis(p: Vector) -> (f64, Vector) {
    let radius = p.x.hypot(p.z);
    if radius > 0.0 {
        (radius, Vector::new(p.x / radius, 0.0, p.z / radius))
    } else {
        (0.0, Vector::X)
    }
}

impl SupportMap for Frustum {
    fn local_support_point(&self, dir: Vector) -> Vector {
        let (sideways, outward) = from_axis(dir);
        let top = Vector::new(0.0, self.half_height_m, 0.0) + outward * self.top_radius_m;
        let bottom = Vector::new(0.0, -self.half_height_m, 0.0) + outward * self.bottom_radius_m;
        // top·d - bottom·d, with outward·d = |sideways|
        let top_minus_bottom = 2.0 * self.half_height_m * dir.y
            + (self.top_radius_m - self.bottom_radius_m) * sideways;
        if top_minus_bottom > 0.0 { top } else { bottom }
    }
}

impl PointQuery for Frustum {
    fn project_local_point(&self, pt: Vector, solid: bool) -> PointProjection {
        if solid && self.covers(pt.x.hypot(pt.z), pt.y) {
            return PointProjection::new(true, pt);
        }
        self.project_local_point_and_get_feature(pt).0
    }

    fn project_local_point_and_get_feature(&self, pt: Vector) -> (PointProjection, FeatureId) {
        let (radius_m, outward) = from_axis(pt);
        let nearest = self.nearest_on_profile(radius_m, pt.y);
        let point = outward * nearest.radius_m + Vector::new(0.0, nearest.y_m, 0.0);
        (
            PointProjection::new(self.covers(radius_m, pt.y), point),
            nearest.face,
        )
    }
}

impl RayCast for Frustum {
    fn cast_local_ray_and_get_normal(
        &self,
        ray: &Ray,
        max_time_of_impact: Real,
        solid: bool,
    ) -> Option<RayIntersection> {
        let simplex = &mut VoronoiSimplex::new();
        local_ray_intersection_with_support_map_with_params(
            self,
            simplex,
            ray,
            max_time_of_impact,
            solid,
        )
    }
}

impl Shape for Frustum {
    fn compute_local_aabb(&self) -> Aabb {
        let corner = Vector::new(self.widest_m(), self.half_height_m, self.widest_m());
        Aabb::new(-corner, corner)
    }

    /// Through both rims where their common sphere is centred within the height, else around the wider face.
    fn compute_local_bounding_sphere(&self) -> BoundingSphere {
        let (h, top, bottom) = (self.half_height_m, self.top_radius_m, self.bottom_radius_m);
        let equidistant_m = if h > 0.0 {
            (top * top - bottom * bottom) / (4.0 * h)
        } else {
            0.0
        };
        let y = equidistant_m.clamp(-h, h);
        let radius = top.hypot(h - y).max(bottom.hypot(h + y));
        BoundingSphere::new(Vector::new(0.0, y, 0.0), radius)
    }

    fn clone_dyn(&self) -> Box<dyn Shape> {
        Box::new(*self)
    }

    /// `None` unless the scale keeps circles round; turned upside down by a negative y.
    fn scale_dyn(&self, scale: Vector, _num_subdivisions: u32) -> Option<Box<dyn Shape>> {
        let (y, sideways) = (scale.y, scale.x.abs());
        if sideways != scale.z.abs() {
            return None;
        }
        let (top, bottom) = (
            self.top_radius_m * sideways,
            self.bottom_radius_m * sideways,
        );
        let (top, bottom) = if y < 0.0 {
            (bottom, top)
        } else {
            (top, bottom)
        };
        let scaled = Self::new(self.height_m() * y.abs(), top, bottom).ok()?;
        Some(Box::new(scaled))
    }

    fn mass_properties(&self, density: Real) -> MassProperties {
        // Slices of radius r(y): exact, since four Gauss-Legendre nodes integrate degree 7 and r⁴, y² r² have degree 4.
        const NODES: [(f64, f64); 4] = [
            (-0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
            (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
            (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
            (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
        ];
        let mut area_moments = [0.0; 4]; // ∫ π r² {1, y, y², r²} dy
        for (node, weight) in NODES {
            let y = node * self.half_height_m;
            let r2 = self.radius_at_m(y).powi(2);
            let slice = weight * self.half_height_m * PI * r2;
            for (sum, factor) in area_moments.iter_mut().zip([1.0, y, y * y, r2]) {
                *sum += slice * factor;
            }
        }
        let [volume, first, second, radial] = area_moments;
        let centre = if volume > 0.0 { first / volume } else { 0.0 };
        let about_y = density * radial / 2.0;
        let across = density * (radial / 4.0 + second - volume * centre * centre);
        MassProperties::new(
            Vector::new(0.0, centre, 0.0),
            density * volume,
            Vector::new(across, about_y, across),
        )
    }

    fn shape_type(&self) -> ShapeType {
        ShapeType::Custom
    }

    fn as_typed_shape(&self) -> TypedShape<'_> {
        TypedShape::Custom(self)
    }

    fn ccd_thickness(&self) -> Real {
        self.half_height_m.min(self.widest_m())
    }

    fn ccd_angular_thickness(&self) -> Real {
        // A rim is the sharpest edge of any frustum; a right angle is what parry takes for its cylinder.
        PI / 2.0
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn as_support_map(&self) -> Option<&dyn SupportMap> {
        Some(self)
    }

    fn feature_normal_at_point(
        &self,
        _: SubShapeId,
        feature: FeatureId,
        point: Vector,
    ) -> Option<Vector> {
        match feature {
            TOP => Some(Vector::Y),
            BOTTOM => Some(-Vector::Y),
            SIDE => {
                let (_, outward) = from_axis(point);
                let widening = self.bottom_radius_m - self.top_radius_m;
                (outward * self.height_m() + Vector::new(0.0, widening, 0.0)).try_normalize()
            }
            _ => None,
        }
    }
}
