//! What surrounds each judged row of a campaign: the coordinates that regions and curves are told
//! in.

use super::forces::Forces;
use crate::forward::flow::Place;

/// How many of them, from the first, say where a row is: what regions are told in.
pub(super) const PLACES: usize = 4;

/// Names of the coordinates and their letters, in the order of `covariates`.
pub const COORDINATES: [(&str, &str); 13] = [
    ("depth m", "s"),
    ("beside m", "r"),
    ("beside/half-width", "xi"),
    ("height m", "h"),
    ("drones above", "n"),
    ("air m/s", "U"),
    ("own climb m/s", "V_z"),
    ("own speed m/s", "V_h"),
    ("emitter climb m/s", "v_z"),
    ("emitter speed m/s", "v_e"),
    ("thrust N", "T"),
    ("battery V", "V"),
    ("time s", "t"),
];

/// One column for each of [`COORDINATES`], one entry a judged row, and the place in the wake of the
/// drone above. Those of the drone above are of the one whose axis is nearest in half-widths of its
/// hover jet; not a number where none is above.
pub(super) fn covariates(forces: &Forces) -> (Vec<Vec<f64>>, Vec<Option<Place>>) {
    let mut columns = vec![Vec::with_capacity(forces.rows); COORDINATES.len()];
    let mut places = Vec::with_capacity(forces.rows);
    for ((part, step), air_mps) in forces.judged().zip(forces.hover_air_mps()) {
        let mut nearest = [f64::NAN; 5];
        let mut place = None;
        for above in &step.above {
            let apart_m = above.position_m - step.position_m;
            let Some(wake) = forces.wake_of(part, above) else {
                continue;
            };
            let (half_m, length_m) = (wake.half_width_m(apart_m.z), wake.motor_distance_m());
            let beside_m = apart_m.x.hypot(apart_m.y);
            let xi = beside_m / half_m;
            if nearest[2].is_nan() || xi < nearest[2] {
                let velocity_mps = above.velocity_mps;
                nearest = [apart_m.z, beside_m, xi, velocity_mps.z, velocity_mps.norm()];
                place = Some(Place {
                    emitter: above.vehicle,
                    s_over_l: apart_m.z / length_m,
                    r_over_l: beside_m / length_m,
                    xi,
                    azimuth_rad: (-apart_m.y).atan2(-apart_m.x),
                });
            }
        }
        let [depth_m, beside_m, xi, emitter_climb_mps, emitter_mps] = nearest;
        let row = [
            depth_m,
            beside_m,
            xi,
            step.height_m,
            step.above.len() as f64,
            air_mps,
            step.velocity_mps.z,
            step.velocity_mps.xy().norm(),
            emitter_climb_mps,
            emitter_mps,
            step.thrust_n,
            step.battery_v,
            step.t_s,
        ];
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(value);
        }
        places.push(place);
    }
    (columns, places)
}
