//! Bounds of a wake that effects have moved or reshaped: tables, layer by layer, about the axis of each layer.
//!
//! There is no closed form. Down to the floor the air is sampled in layers, each looked at from the vertical line through its middle: the
//! highest speed and the steepest slope at or beyond a distance from that line. Over a short way the speed differs from that at its middle
//! by at most slope times half the way, so the bounds close in on the field as ways shrink.

use airflow::Wake;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::FAINTEST_WAKE_MPS;

/// Thickness of a layer: this many motor distances, or this part of the distance to the virtual origin, whichever is more. Chosen here.
const LAYER_L: f64 = 0.1;
const LAYER_GROWTH: f64 = 0.03;
/// Distance of the virtual origin above the rotors, in motor distances: the paper's; any jet's is near.
const ORIGIN_L: f64 = 5.8;
/// Inner radii of rings in spreads of the jet: steps up to the first, a factor up to the last, all chosen here. At 30 spreads the
/// paper's profile has fallen to a part in a hundred thousand.
const RING_STEP: f64 = 0.1;
const EVEN_UNTIL: f64 = 3.0;
const RING_FACTOR: f64 = 1.08;
const OUTERMOST: f64 = 30.0;
/// Bearings sampled: an eighth of a lobe of four rotors; chosen here.
const BEARINGS: usize = 32;
/// The axis moves by at most this part of the half-width between two sampled depths.
const AXIS_STEP: f64 = 0.2;
const FEWEST_DEPTHS: f64 = 3.0;
const MOST_DEPTHS: f64 = 40.0;
/// No layer is thinner than this part of its depth: chosen here, a jet that the wind lays down sweeps tens of metres within centimetres.
const THINNEST: f64 = 1e-7;
/// A jet this much slower on its axis than any wake that counts is nowhere as fast as one: 1.1 for its steepest edge, 2.1 for a drone
/// that sinks.
const FAINT_ON_AXIS: f64 = 0.4;
/// On sampled speeds and on slopes taken as differences of neighbouring samples: what lies between samples. Chosen here, and checked by
/// random places under random effects.
const BETWEEN_SAMPLES: f64 = 1.04;
const SLOPE_MARGIN: f64 = 1.3;

/// A box of offsets below a drone (m): lowest and highest corner.
type Places = (Vector3<f64>, Vector3<f64>);

#[derive(Debug)]
struct Layer {
    to_m: f64,
    centre_m: [f64; 2],
    spread_m: f64,
    /// By ring, at or beyond its inner radius: speed over U_H, and its slope over U_H (1/m).
    highest: Vec<(f64, f64)>,
}

/// Bounds per unit of induced velocity.
#[derive(Debug)]
pub(super) struct MovedTable {
    layers: Vec<Layer>,
    /// In spreads.
    rings: Vec<f64>,
}

impl MovedTable {
    /// Down to a depth (m).
    pub(super) fn new(wake: &Wake, deepest_m: f64) -> MovedTable {
        let l = wake.motor_distance_m();
        let rings = rings();
        let mut edges_m = vec![0.0];
        let mut depth_m = 0.0;
        while depth_m < deepest_m.max(wake.near_field_depth_m()) {
            let over_l: f64 = depth_m / l;
            let next_m = depth_m + l * (LAYER_GROWTH * (over_l + ORIGIN_L) - 0.1).max(LAYER_L);
            edges_below(wake, depth_m, next_m, &mut edges_m);
            depth_m = next_m;
        }
        let layers = edges_m
            .par_windows(2)
            .map(|ends_m| Layer::new(wake, ends_m[0], ends_m[1], &rings))
            .collect();
        MovedTable { layers, rings }
    }

    /// Highest speed over U_H and steepest slope over U_H (1/m) in a box of offsets.
    pub(super) fn highest(&self, places_m: &Places) -> (f64, f64) {
        let (from_m, to_m) = (-places_m.1.z, -places_m.0.z);
        let first = self.layers.partition_point(|layer| layer.to_m < from_m);
        let last = self.layers.partition_point(|layer| layer.to_m < to_m);
        if last >= self.layers.len() {
            // Below the floor nothing is known.
            return (f64::INFINITY, f64::INFINITY);
        }
        let within = self.layers[first..=last].iter().map(|layer| {
            let gap = |axis: usize| {
                let at_m = layer.centre_m[axis];
                (places_m.0[axis] - at_m)
                    .max(at_m - places_m.1[axis])
                    .max(0.0)
            };
            let away = gap(0).hypot(gap(1)) / layer.spread_m;
            let ring = self.rings.partition_point(|inner| *inner <= away);
            layer.highest[ring.saturating_sub(1)]
        });
        within.fold((0.0, 0.0), |(speed, slope), here| {
            (here.0.max(speed), here.1.max(slope))
        })
    }

    /// Distance from the vertical below the drone beyond which the air is slower than a speed over U_H, down to a depth (m).
    pub(super) fn reach_m(&self, speed: f64, depth_m: f64) -> f64 {
        let down_to = self.layers.partition_point(|layer| layer.to_m < depth_m);
        let layers = &self.layers[..(down_to + 1).min(self.layers.len())];
        let reach_m = layers.iter().map(|layer| {
            let faint = layer.highest.partition_point(|(here, _)| *here >= speed);
            if faint == 0 {
                return 0.0;
            }
            // Where even the last ring is not faint: as far again, at the fourth power of the distance.
            let out = self.rings.get(faint).copied().unwrap_or_else(|| {
                let (here, _) = layer.highest[layer.highest.len() - 1];
                OUTERMOST * (here / speed).powf(0.25).max(1.0) * RING_FACTOR
            });
            layer.centre_m[0].hypot(layer.centre_m[1]) + out * layer.spread_m
        });
        reach_m.fold(0.0, f64::max)
    }
}

/// Lower edges of layers between two depths: so thin that the axis moves by no more than a half-width in each, while the jet is not faint.
fn edges_below(wake: &Wake, from_m: f64, to_m: f64, edges_m: &mut Vec<f64>) {
    let thin = to_m - from_m <= THINNEST * to_m;
    let halve = !thin
        && match (wake.axis_m(from_m), wake.axis_m(to_m)) {
            (Some(from), Some(to)) => {
                let moved_m = (to[0] - from[0]).hypot(to[1] - from[1]);
                moved_m > wake.half_width_m(from_m) && !is_faint(wake, from_m, from)
            }
            // Somewhere in between the wind takes it away.
            (Some(from), None) => !is_faint(wake, from_m, from),
            (None, _) => false,
        };
    if !halve {
        edges_m.push(to_m);
        return;
    }
    let middle_m = 0.5 * (from_m + to_m);
    edges_below(wake, from_m, middle_m, edges_m);
    edges_below(wake, middle_m, to_m, edges_m);
}

/// Whether a far field is too slow on its axis to count anywhere, and below.
fn is_faint(wake: &Wake, depth_m: f64, axis_m: [f64; 2]) -> bool {
    let on_axis_m = Vector3::new(axis_m[0], axis_m[1], -depth_m);
    depth_m > wake.near_field_depth_m()
        && wake.axial_speed_mps(on_axis_m) <= FAINT_ON_AXIS * FAINTEST_WAKE_MPS
}

fn rings() -> Vec<f64> {
    let mut rings = vec![0.0];
    let mut ring = 0.0_f64;
    while ring < OUTERMOST {
        ring = if ring < EVEN_UNTIL {
            ring + RING_STEP
        } else {
            ring * RING_FACTOR
        };
        rings.push(ring);
    }
    rings
}

impl Layer {
    fn new(wake: &Wake, from_m: f64, to_m: f64, rings: &[f64]) -> Layer {
        // Just below the rotor plane: at it the field jumps to zero.
        let from_m = from_m.max(1e-6 * wake.near_field_depth_m());
        let first_m = wake.axis_m(from_m).unwrap_or_default();
        let last_m = wake.axis_m(to_m).unwrap_or(first_m);
        let spread_m = wake.spread_m(from_m).unwrap_or(wake.half_width_m(from_m));
        let moved_m = (last_m[0] - first_m[0]).hypot(last_m[1] - first_m[1]);
        let steps = (moved_m / (AXIS_STEP * wake.half_width_m(from_m)))
            .ceil()
            .clamp(FEWEST_DEPTHS, MOST_DEPTHS) as usize;
        let centre_m = [0, 1].map(|axis| 0.5 * (first_m[axis] + last_m[axis]));
        let step_s_m = (to_m - from_m) / steps as f64;
        let turn = std::f64::consts::TAU / BEARINGS as f64;
        // From the way it leans, in which a level cut is longest.
        let first = (last_m[1] - first_m[1]).atan2(last_m[0] - first_m[0]);
        let u_h = wake.induced_velocity_mps();
        let mut sampled = Vec::with_capacity((steps + 1) * rings.len() * BEARINGS);
        for s in 0..=steps {
            let z_m = -(from_m + s as f64 * step_s_m);
            for ring in rings {
                for b in 0..BEARINGS {
                    let (sin, cos) = (first + b as f64 * turn).sin_cos();
                    let r_m = ring * spread_m;
                    let offset_m =
                        Vector3::new(centre_m[0] + r_m * cos, centre_m[1] + r_m * sin, z_m);
                    sampled.push(wake.axial_speed_mps(offset_m) / u_h);
                }
            }
        }
        let value =
            |s: usize, r: usize, b: usize| sampled[(s * rings.len() + r) * BEARINGS + b % BEARINGS];
        let slope = |s: usize, r: usize, b: usize| {
            let here = value(s, r, b);
            let along_s = if s < steps {
                (value(s + 1, r, b) - here) / step_s_m
            } else {
                0.0
            };
            let along_r = if r + 1 < rings.len() {
                (value(s, r + 1, b) - here) / ((rings[r + 1] - rings[r]) * spread_m)
            } else {
                0.0
            };
            let around = if r > 0 {
                (value(s, r, b + 1) - here) / (rings[r] * spread_m * turn)
            } else {
                0.0
            };
            Vector3::new(along_s, along_r, around).norm()
        };
        let mut highest = vec![(0.0, 0.0); rings.len()];
        let (mut speed, mut slope_per_m) = (0.0_f64, 0.0_f64);
        for r in (0..rings.len()).rev() {
            for s in 0..=steps {
                for b in 0..BEARINGS {
                    speed = speed.max(value(s, r, b));
                    slope_per_m = slope_per_m.max(slope(s, r, b));
                }
            }
            highest[r] = (BETWEEN_SAMPLES * speed, SLOPE_MARGIN * slope_per_m);
        }
        Layer {
            to_m,
            centre_m,
            spread_m,
            highest,
        }
    }
}

#[cfg(test)]
mod tests;
