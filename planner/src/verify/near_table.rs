//! The near field of one airframe in two tables: the highest speed and the steepest slope at or beyond a radius, layer by layer.

use std::ops::RangeInclusive;

use airflow::Wake;
use nalgebra::Vector3;

/// Layers of the near field, between the rotor plane and 2.5 motor distances: 0.1 motor distances each.
const LAYERS: usize = 25;
/// Rings, 30 to a motor distance; what is farther out than 4 counts as the last one.
const RINGS: usize = 120;
const RINGS_PER_MOTOR_DISTANCE: f64 = 30.0;
/// Samples per layer.
const FINE: usize = 3;
/// Samples between one diagonal and the next axis: the field of four rotors repeats every 90 degrees
/// and is its own mirror image about each diagonal.
const BEARINGS: usize = 9;
/// On sampled speeds, chosen here: the highest speed between samples 0.033 motor distances apart exceeds
/// the sampled by curvature (2 ln 2 / b² per rotor flow, half-width b >= 0.23) times step² / 8, 0.4 % of the peak,
/// and by 1.5 % between two bearings.
const BETWEEN_SAMPLES: f64 = 1.03;
/// On slopes taken as differences of neighbouring samples, for the same reason.
const SLOPE_MARGIN: f64 = 1.25;
/// Highest speed and steepest slope of the near field of one airframe, per unit of induced velocity.
#[derive(Debug)]
pub(super) struct NearTable {
    layer_m: f64,
    ring_m: f64,
    /// `U / U_H` in a layer at or beyond the inner radius of each ring, and of the one after the last.
    speed: Vec<f64>,
    /// `|grad U| / U_H` there (1/m).
    slope_per_m: Vec<f64>,
}

impl NearTable {
    pub(super) fn new(wake: &Wake) -> NearTable {
        let depth_m = wake.near_field_depth_m();
        let layer_m = depth_m / LAYERS as f64;
        let ring_m = wake.motor_distance_m() / RINGS_PER_MOTOR_DISTANCE;
        let (depths, radii) = (LAYERS * FINE + 1, RINGS + 1);
        let (step_s_m, step_r_m) = (layer_m / FINE as f64, ring_m);
        let step_bearing = std::f64::consts::FRAC_PI_4 / (BEARINGS - 1) as f64;
        let u_h = wake.induced_velocity_mps();
        let bearings: Vec<_> = (0..BEARINGS)
            .map(|b| (b as f64 * step_bearing).sin_cos())
            .collect();
        let mut sampled = Vec::with_capacity(depths * radii * BEARINGS);
        for s in 0..depths {
            // Just below the rotor plane: at it the field jumps to zero.
            let section = wake.cross_section((s as f64 * step_s_m).max(1e-6 * depth_m));
            for r in 0..radii {
                let r_m = r as f64 * step_r_m;
                let around = bearings
                    .iter()
                    .map(|(sin, cos)| section.axial_speed_mps(r_m * cos, r_m * sin) / u_h);
                sampled.extend(around);
            }
        }
        let value = |s: usize, r: usize, b: usize| sampled[(s * radii + r) * BEARINGS + b];
        let slope = |s: usize, r: usize, b: usize| {
            let here = value(s, r, b);
            let along_s = if s + 1 < depths {
                (value(s + 1, r, b) - here) / step_s_m
            } else {
                0.0
            };
            let along_r = if r + 1 < radii {
                (value(s, r + 1, b) - here) / step_r_m
            } else {
                0.0
            };
            let around = if b + 1 < BEARINGS && r > 0 {
                (value(s, r, b + 1) - here) / (r as f64 * step_r_m * step_bearing)
            } else {
                0.0
            };
            Vector3::new(along_s, along_r, around).norm()
        };
        let nodes = LAYERS * (RINGS + 1);
        let mut table = NearTable {
            layer_m,
            ring_m,
            speed: vec![0.0; nodes],
            slope_per_m: vec![0.0; nodes],
        };
        for layer in 0..LAYERS {
            let (mut speed, mut slope_per_m) = (0.0_f64, 0.0_f64);
            for r in (0..radii).rev() {
                for s in layer * FINE..=(layer + 1) * FINE {
                    for b in 0..BEARINGS {
                        speed = speed.max(value(s, r, b));
                        slope_per_m = slope_per_m.max(slope(s, r, b));
                    }
                }
                table.speed[layer * radii + r] = BETWEEN_SAMPLES * speed;
                table.slope_per_m[layer * radii + r] = SLOPE_MARGIN * slope_per_m;
            }
        }
        table
    }

    /// The layers between two depths (m).
    pub(super) fn layers(&self, from_m: f64, until_m: f64) -> RangeInclusive<usize> {
        let layer = |depth_m: f64| ((depth_m / self.layer_m) as usize).min(LAYERS - 1);
        layer(from_m)..=layer(until_m)
    }

    /// Highest speed over U_H and steepest slope over U_H (1/m) in some layers, at or beyond a radius.
    pub(super) fn highest(&self, layers: RangeInclusive<usize>, off_axis_m: f64) -> (f64, f64) {
        let rings = (off_axis_m / self.ring_m).min(RINGS as f64);
        let ring = (rings as usize).min(RINGS - 1);
        let beyond = rings - ring as f64;
        layers.fold((0.0, 0.0), |(speed, slope), k| {
            let at = k * (RINGS + 1) + ring;
            // The highest speed beyond a radius falls with it; its chord lies within the margin of it.
            let here = self.speed[at] + beyond * (self.speed[at + 1] - self.speed[at]);
            (here.max(speed), self.slope_per_m[at].max(slope))
        })
    }
}
