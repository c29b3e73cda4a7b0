//! Volumes of air hold all the air they stand for, and shapes are what their formulas say.

mod bodies;
mod iso_speed;
mod moved;

use costmap::volumes::downwash::Section;
use diagnosis::statistics::draws::Draws;
use nalgebra::Vector3;
use parry3d::math::Vector;

/// A point of a cube about the origin.
fn random_point(random: &mut Draws, reach: f64) -> nalgebra::Point3<f64> {
    [0; 3].map(|_| random.between(-reach, reach)).into()
}

/// Whether one of some sections holds an offset from the rotor centre (m).
fn holds(sections: &[Section], offset_m: Vector3<f64>) -> bool {
    let radius_m = |it: &Section| it.radius_m(-offset_m.z);
    let mut radii_m = sections.iter().filter_map(radius_m);
    radii_m.any(|radius_m| offset_m.x.hypot(offset_m.y) <= radius_m)
}

fn wake_of(preset: &str) -> airflow::Wake {
    let airframe = airflow::Airframe::preset(preset).expect("a preset");
    let density = airflow::Air::default().density_kg_per_m3();
    airflow::Wake::new(
        &airframe,
        airframe.mass_kg(),
        density,
        &airflow::Jet::default(),
    )
}

/// Distance (m) of a point in a frustum's own frame from its surface, negative inside: closed form
/// in the plane of radius and height, where the frustum is a quadrilateral.
fn signed_distance_m(frustum: &costmap::volumes::frustum::Frustum, at: Vector) -> f64 {
    let (radius_m, y_m, half_m) = (at.x.hypot(at.z), at.y, frustum.height_m() / 2.0);
    let (top_m, bottom_m) = (frustum.top_radius_m(), frustum.bottom_radius_m());
    let slope_m = top_m - bottom_m;
    let length_m2 = slope_m * slope_m + 4.0 * half_m * half_m;
    let along = (radius_m - bottom_m) * slope_m + (y_m + half_m) * 2.0 * half_m;
    let along = (along / length_m2).clamp(0.0, 1.0);
    let nearest_m = [
        (radius_m.min(top_m), half_m),
        (radius_m.min(bottom_m), -half_m),
        (bottom_m + along * slope_m, (2.0 * along - 1.0) * half_m),
    ];
    let distances_m = nearest_m.map(|(r_m, h_m)| (r_m - radius_m).hypot(h_m - y_m));
    let distance_m = distances_m.into_iter().fold(f64::INFINITY, f64::min);
    let side_m = bottom_m + (y_m / half_m + 1.0) / 2.0 * slope_m;
    if y_m.abs() <= half_m && radius_m <= side_m {
        -distance_m
    } else {
        distance_m
    }
}
