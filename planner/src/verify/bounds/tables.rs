//! Wakes without a closed form, in tables: the highest speed and the steepest slope of each layer
//! of depth, at or beyond a distance from its axis.
//!
//! Over a short path the speed differs from that at its middle by at most slope times half the
//! path, so the bounds close in on the field as paths shrink. Speeds are over the induced velocity
//! at hover.

use std::f64::consts::{FRAC_PI_4, TAU};
use std::ops::RangeInclusive;
use std::sync::OnceLock;

use airflow::Wake;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::verify::extents::{FAINTEST_WAKE_MPS, Places};

/// Highest speed over U_H, and steepest slope over U_H (1/m).
pub(super) type Highest = (f64, f64);

/// Speeds over U_H at depths, on rings about an axis, at bearings.
struct RingSamples {
    step_s_m: f64,
    radii_m: Vec<f64>,
    /// Between two bearings (rad).
    turn: f64,
    bearings: usize,
    /// The bearing after the last is the first.
    all_around: bool,
    speeds: Vec<f64>,
}

impl RingSamples {
    /// By depth, ring and bearing.
    fn speed(&self, s: usize, r: usize, b: usize) -> f64 {
        self.speeds[(s * self.radii_m.len() + r) * self.bearings + b % self.bearings]
    }

    /// Differences to the next sample down, outwards and around, as one slope over U_H (1/m); 0
    /// towards where there is none.
    fn slope(&self, s: usize, r: usize, b: usize) -> f64 {
        let here = self.speed(s, r, b);
        let (mut down, mut outwards, mut around) = (0.0, 0.0, 0.0);
        if (s + 1) * self.radii_m.len() * self.bearings < self.speeds.len() {
            down = (self.speed(s + 1, r, b) - here) / self.step_s_m;
        }
        if r + 1 < self.radii_m.len() {
            let step_m = self.radii_m[r + 1] - self.radii_m[r];
            outwards = (self.speed(s, r + 1, b) - here) / step_m;
        }
        if r > 0 && (self.all_around || b + 1 < self.bearings) {
            around = (self.speed(s, r, b + 1) - here) / (self.radii_m[r] * self.turn);
        }
        Vector3::new(down, outwards, around).norm()
    }

    /// Appends the speeds at one depth, which `speed` tells at x and y (m), from a bearing on
    /// (rad).
    fn push(&mut self, first: f64, speed: impl Fn(f64, f64) -> f64) {
        for r_m in &self.radii_m {
            for b in 0..self.bearings {
                let (sin, cos) = (first + b as f64 * self.turn).sin_cos();
                self.speeds.push(speed(r_m * cos, r_m * sin));
            }
        }
    }

    /// By ring, what is highest at or beyond it over a range of depths, times margins.
    fn at_or_beyond(&self, depths: RangeInclusive<usize>, margins: Highest) -> Vec<Highest> {
        let mut highest = vec![(0.0, 0.0); self.radii_m.len()];
        let (mut speed, mut slope_per_m) = (0.0_f64, 0.0_f64);
        for r in (0..self.radii_m.len()).rev() {
            for s in depths.clone() {
                for b in 0..self.bearings {
                    speed = speed.max(self.speed(s, r, b));
                    slope_per_m = slope_per_m.max(self.slope(s, r, b));
                }
            }
            highest[r] = (margins.0 * speed, margins.1 * slope_per_m);
        }
        highest
    }
}

/// Layers of the near field, between the rotor plane and 2.5 motor distances: chosen here, 0.1
/// motor distances each.
const LAYERS: usize = 25;
/// Runs of 1, 2, 4 and more layers that are no longer than all of them.
const RUNS: usize = LAYERS.ilog2() as usize + 1;
/// Rings of the near field, chosen here: 30 to a motor distance; what is farther out than 4 counts
/// as the last one.
const RINGS: usize = 120;
const RINGS_PER_MOTOR_DISTANCE: f64 = 30.0;
/// Depths sampled in a layer of the near field, chosen here: as close as the rings.
const FINE: usize = 3;
/// Samples between one diagonal and the next axis: the field of four rotors repeats every 90
/// degrees and is its own mirror image about each diagonal. How many: chosen here.
const NEAR_BEARINGS: usize = 9;
/// On what is sampled in the near field, chosen here: the highest speed between samples 0.033 motor
/// distances apart exceeds the sampled by curvature (2 ln 2 / b² per rotor flow, half-width b >=
/// 0.23) times step² / 8, 0.4 % of the peak, and by 1.5 % between two bearings; slopes are
/// differences.
const NEAR_MARGINS: Highest = (1.03, 1.25);

/// The near field of one airframe; its layers are worked out when they are first asked for.
#[derive(Debug)]
pub(super) struct NearTable {
    wake: Wake,
    layer_m: f64,
    ring_m: f64,
    /// By ring, what is highest over 2ⁿ layers from one on: two such runs cover any range of layers
    /// (a sparse table: M. A. Bender and M. Farach-Colton, "The LCA problem revisited", LATIN
    /// 2000).
    runs: [[OnceLock<Vec<Highest>>; LAYERS]; RUNS],
}

impl NearTable {
    /// Of a wake at any mass: in units of its induced velocity the near field is the same.
    pub(super) fn new(wake: &Wake) -> NearTable {
        NearTable {
            layer_m: wake.near_field_depth_m() / LAYERS as f64,
            ring_m: wake.motor_distance_m() / RINGS_PER_MOTOR_DISTANCE,
            wake: wake.clone(),
            runs: std::array::from_fn(|_| std::array::from_fn(|_| OnceLock::new())),
        }
    }

    /// What is highest in 2ⁿ layers from one on, by ring.
    fn run(&self, n: usize, first: usize) -> &[Highest] {
        self.runs[n][first].get_or_init(|| {
            let Some(half) = n.checked_sub(1) else {
                return self.layer(first);
            };
            let halves = [first, first + (1 << half)].map(|first| self.run(half, first));
            let rings = halves[0].iter().zip(halves[1]);
            rings.map(|(one, other)| higher(*one, *other)).collect()
        })
    }

    /// What is highest in a layer, by ring.
    fn layer(&self, layer: usize) -> Vec<Highest> {
        let mut samples = RingSamples {
            step_s_m: self.layer_m / FINE as f64,
            radii_m: (0..=RINGS).map(|r| r as f64 * self.ring_m).collect(),
            turn: FRAC_PI_4 / (NEAR_BEARINGS - 1) as f64,
            bearings: NEAR_BEARINGS,
            all_around: false,
            speeds: Vec::with_capacity((FINE + 2) * (RINGS + 1) * NEAR_BEARINGS),
        };
        let u_h_mps = self.wake.induced_velocity_mps();
        // One depth more, for the slope down from the last.
        let first = layer * FINE;
        for s in first..=(first + FINE + 1).min(LAYERS * FINE) {
            // Just below the rotor plane: at it the field jumps to zero.
            let least_m = 1e-6 * self.wake.near_field_depth_m();
            let depth_m = (s as f64 * samples.step_s_m).max(least_m);
            let section = self.wake.cross_section(depth_m);
            samples.push(0.0, |x_m, y_m| section.axial_speed_mps(x_m, y_m) / u_h_mps);
        }
        samples.at_or_beyond(0..=FINE, NEAR_MARGINS)
    }

    /// The layers between two depths (m).
    pub(super) fn layers(&self, from_m: f64, until_m: f64) -> RangeInclusive<usize> {
        let layer = |depth_m: f64| ((depth_m / self.layer_m) as usize).min(LAYERS - 1);
        layer(from_m)..=layer(until_m)
    }

    /// What is highest in some layers, at or beyond a distance from the axis (m).
    pub(super) fn highest(&self, layers: RangeInclusive<usize>, off_axis_m: f64) -> Highest {
        let (first, last) = layers.into_inner();
        let n = (last + 1 - first).ilog2() as usize;
        let rings = (off_axis_m / self.ring_m).min(RINGS as f64);
        let ring = (rings as usize).min(RINGS - 1);
        let beyond = rings - ring as f64;
        let of_run = |first: usize| {
            let run = self.run(n, first);
            let ((inner, slope_per_m), (outer, _)) = (run[ring], run[ring + 1]);
            // The highest speed beyond a radius falls with it; its chord lies within the margin
            // of it.
            (inner + beyond * (outer - inner), slope_per_m)
        };
        higher(of_run(first), of_run(last + 1 - (1 << n)))
    }
}

/// The highest of both.
fn higher(one: Highest, other: Highest) -> Highest {
    (one.0.max(other.0), one.1.max(other.1))
}

/// Thickness of a layer of a moved wake: this many motor distances, or this part of the distance to
/// the virtual origin, whichever is more. Chosen here.
const LAYER_L: f64 = 0.1;
const LAYER_GROWTH: f64 = 0.03;
/// Distance of the virtual origin above the rotors, in motor distances: the paper's; any jet's is
/// near.
const ORIGIN_L: f64 = 5.8;
/// Inner radii of rings in spreads of the jet: steps up to the first, a factor up to the last, all
/// chosen here. At 30 spreads the paper's profile has fallen to a part in a hundred thousand.
const RING_STEP: f64 = 0.1;
const EVEN_UNTIL: f64 = 3.0;
const RING_FACTOR: f64 = 1.08;
const OUTERMOST: f64 = 30.0;
/// Bearings sampled: an eighth of a lobe of four rotors; chosen here.
const BEARINGS: usize = 32;
/// The axis moves by at most this part of the half-width between two sampled depths, with no fewer
/// and no more than so many: chosen here.
const AXIS_STEP: f64 = 0.2;
const FEWEST_DEPTHS: f64 = 3.0;
const MOST_DEPTHS: f64 = 40.0;
/// No layer is thinner than this part of its depth: chosen here, a jet that the wind lays down
/// sweeps tens of metres within centimetres.
const THINNEST: f64 = 1e-7;
/// A jet this much slower on its axis than any wake that counts is nowhere as fast as one: 1.1 for
/// its steepest edge, 2.1 for a drone that sinks.
const FAINT_ON_AXIS: f64 = 0.4;
/// On what is sampled of a moved wake, chosen here, and checked by random places under random
/// effects.
const MOVED_MARGINS: Highest = (1.04, 1.3);

/// A wake that effects have moved or reshaped, in layers about the vertical through the middle of
/// each.
#[derive(Debug)]
pub(super) struct MovedTable {
    layers: Vec<Layer>,
    /// Inner radii, in spreads.
    rings: Vec<f64>,
}

#[derive(Debug)]
struct Layer {
    to_m: f64,
    centre_m: [f64; 2],
    spread_m: f64,
    /// By ring.
    highest: Vec<Highest>,
}

impl MovedTable {
    /// Down to a depth (m).
    pub(super) fn new(wake: &Wake, deepest_m: f64) -> MovedTable {
        let l = wake.motor_distance_m();
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
        let mut edges_m = vec![0.0];
        let mut depth_m = 0.0;
        while depth_m < deepest_m.max(wake.near_field_depth_m()) {
            let over_l: f64 = depth_m / l;
            let next_m = depth_m + l * (LAYER_GROWTH * (over_l + ORIGIN_L) - 0.1).max(LAYER_L);
            edges_below(wake, depth_m, next_m, &mut edges_m);
            depth_m = next_m;
        }
        let layers = (edges_m.par_windows(2))
            .map(|ends_m| Layer::new(wake, ends_m[0], ends_m[1], &rings))
            .collect();
        MovedTable { layers, rings }
    }

    /// What is highest in a box of offsets from the drone (m).
    pub(super) fn highest(&self, places_m: &Places) -> Highest {
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
                let beside_m = (places_m.0[axis] - at_m).max(at_m - places_m.1[axis]);
                beside_m.max(0.0)
            };
            let away = gap(0).hypot(gap(1)) / layer.spread_m;
            let ring = self.rings.partition_point(|inner| *inner <= away);
            layer.highest[ring.saturating_sub(1)]
        });
        within.fold((0.0, 0.0), higher)
    }

    /// Distance from the vertical below the drone beyond which the air is slower than a speed over
    /// U_H, down to a depth (m).
    pub(super) fn reach_m(&self, speed: f64, depth_m: f64) -> f64 {
        let down_to = self.layers.partition_point(|layer| layer.to_m < depth_m);
        let layers = &self.layers[..(down_to + 1).min(self.layers.len())];
        let reach_m = layers.iter().map(|layer| {
            let faint = layer.highest.partition_point(|(here, _)| *here >= speed);
            if faint == 0 {
                return 0.0;
            }
            // Where even the last ring is not faint: as far again, at the fourth power of the
            // distance.
            let out = self.rings.get(faint).copied().unwrap_or_else(|| {
                let (here, _) = layer.highest[layer.highest.len() - 1];
                OUTERMOST * (here / speed).powf(0.25).max(1.0) * RING_FACTOR
            });
            layer.centre_m[0].hypot(layer.centre_m[1]) + out * layer.spread_m
        });
        reach_m.fold(0.0, f64::max)
    }
}

/// Lower edges of layers between two depths: so thin that the axis moves by no more than a
/// half-width in each, while the jet is not faint.
fn edges_below(wake: &Wake, from_m: f64, to_m: f64, edges_m: &mut Vec<f64>) {
    // Too slow on its axis to count anywhere, and below.
    let is_faint = |axis_m: [f64; 2]| {
        let on_axis_m = Vector3::new(axis_m[0], axis_m[1], -from_m);
        from_m > wake.near_field_depth_m()
            && wake.axial_speed_mps(on_axis_m) <= FAINT_ON_AXIS * FAINTEST_WAKE_MPS
    };
    let thin = to_m - from_m <= THINNEST * to_m;
    let halve = !thin
        && match (wake.axis_m(from_m), wake.axis_m(to_m)) {
            (Some(from), Some(to)) => {
                let moved_m = (to[0] - from[0]).hypot(to[1] - from[1]);
                moved_m > wake.half_width_m(from_m) && !is_faint(from)
            }
            // Somewhere in between the wind takes it away.
            (Some(from), None) => !is_faint(from),
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

impl Layer {
    /// Between two depths (m): the vertical through the middle of the axis there, and what is
    /// sampled about it at as many depths as the axis needs.
    fn new(wake: &Wake, from_m: f64, to_m: f64, rings: &[f64]) -> Layer {
        // Just below the rotor plane: at it the field jumps to zero.
        let from_m = from_m.max(1e-6 * wake.near_field_depth_m());
        let first_m = wake.axis_m(from_m).unwrap_or_default();
        let last_m = wake.axis_m(to_m).unwrap_or(first_m);
        let spread_m = wake.spread_m(from_m).unwrap_or(wake.half_width_m(from_m));
        let moved_m = (last_m[0] - first_m[0]).hypot(last_m[1] - first_m[1]);
        let steps = (moved_m / (AXIS_STEP * wake.half_width_m(from_m))).ceil();
        let steps = steps.clamp(FEWEST_DEPTHS, MOST_DEPTHS) as usize;
        let centre_m = [0, 1].map(|axis| 0.5 * (first_m[axis] + last_m[axis]));
        // From the bearing it leans to, along which a level cut is longest.
        let first = (last_m[1] - first_m[1]).atan2(last_m[0] - first_m[0]);
        let mut samples = RingSamples {
            step_s_m: (to_m - from_m) / steps as f64,
            radii_m: rings.iter().map(|ring| ring * spread_m).collect(),
            turn: TAU / BEARINGS as f64,
            bearings: BEARINGS,
            all_around: true,
            speeds: Vec::with_capacity((steps + 1) * rings.len() * BEARINGS),
        };
        let u_h_mps = wake.induced_velocity_mps();
        for s in 0..=steps {
            let z_m = -(from_m + s as f64 * samples.step_s_m);
            samples.push(first, |x_m, y_m| {
                let at_m = Vector3::new(centre_m[0] + x_m, centre_m[1] + y_m, z_m);
                wake.axial_speed_mps(at_m) / u_h_mps
            });
        }
        Layer {
            to_m,
            centre_m,
            spread_m,
            highest: samples.at_or_beyond(0..=steps, MOVED_MARGINS),
        }
    }
}
