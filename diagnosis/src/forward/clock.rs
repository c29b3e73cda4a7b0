//! Clocks of vehicles that log on their own: how far each is from the others, as far as the forces
//! show.
//!
//! A drone that flies below another is pushed down at a moment that both logs know, each by its own
//! clock. The offset is the shift that makes the simulated force fit best, within the bounds that
//! the recording states, beside a gain and a constant for each receiver, so that a force simulated
//! too strong does not pass for a clock.
//!
//! ```text
//! F_r(t) = g_r F_simulated,r(t; δ) + c_r + e,       |δ_v| ≤ bound,  δ = 0 for the reference
//! ```
//!
//! It is an *effective* offset: a convective delay from drone to drone shifts the force just
//! so, unless the baseline declares that delay. Two clocks alone cannot be told from it when the
//! same drone is always the lower one.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::forward::flow::Flow;
use crate::forward::force::Force;
use crate::record::recording::{Clock, Recording, Vehicle};
use crate::record::thrust_map::ThrustMap;
use crate::thrust::free_flight::{Around, BESIDE_M, Trace};
use crate::thrust::least_squares::Normal;
use crate::thrust::low_pass::LowPass;

/// Half the step of the differences that the search goes by (s). Chosen here: half a sample of a 50
/// Hz log, below the time in which a low-passed force changes.
const HALF_STEP_S: f64 = 0.01;

/// Iterations of the search, all with the slopes at no offset. Chosen here: offsets are small
/// against the time in which a low-passed force changes, and the second hardly moves them.
const ITERATIONS: usize = 3;

/// Rows this long (s) count as one when the interval is worked out, because what is left of the
/// force is anything but independent from row to row. Chosen here: longer than a passage.
const BLOCK_S: f64 = 2.0;

/// Blocks below which nothing is estimated. Chosen here: fewer make no spread.
const LEAST_BLOCKS: usize = 6;

/// Least gain of a receiver, and inverse of the largest, that the shift is worked out with. Chosen
/// here: beyond it there is no force to estimate a time by.
const LEAST_GAIN: f64 = 0.25;

/// Half-width of the interval in standard errors: 95 % of a normal distribution.
const HALF_WIDTH: f64 = 1.96;

/// What is known of one vehicle's clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClockOffset {
    /// Index of the vehicle.
    pub vehicle: usize,
    /// What its clock is ahead of that of the reference (s); 0 where that is unknown.
    pub offset_s: f64,
    /// 95 % interval (s), within the bounds; all of them where it is unknown.
    pub interval_s: [f64; 2],
    /// How it is known.
    pub known: ClockKnown,
}

/// How a clock offset is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum ClockKnown {
    /// It is the reference, or shares its clock.
    Shared,
    /// The forces show it.
    Told,
    /// The forces ask for more than the bounds allow; it stands at the bound.
    AtBound,
    /// The forces do not distinguish it from 0 better than the bounds do.
    CannotBeTold,
}

/// Estimates the clock offsets of a recording: one entry for each vehicle. The reference is the
/// first vehicle on the recording's clock, or else the first of all.
///
/// `maps` holds each vehicle's thrust map, as far as there is one. They should come from other
/// flights.
#[must_use]
pub fn offsets(
    recording: &Recording,
    maps: &[Option<&ThrustMap>],
    low_pass: LowPass,
) -> Vec<ClockOffset> {
    let mut vehicles = recording.vehicles.iter();
    let reference = vehicles.position(|vehicle| vehicle.clock == Clock::Shared);
    let reference = reference.unwrap_or(0);
    let own = |(vehicle, of): (usize, &Vehicle)| match of.clock {
        Clock::Own { within_s } if vehicle != reference => Some((vehicle, within_s)),
        Clock::Own { .. } | Clock::Shared => None,
    };
    let vehicles = recording.vehicles.iter().enumerate();
    let unknown: Vec<(usize, f64)> = vehicles.filter_map(own).collect();
    let shared = |vehicle| ClockOffset {
        vehicle,
        offset_s: 0.0,
        interval_s: [-0.0, 0.0],
        known: ClockKnown::Shared,
    };
    let mut offsets: Vec<ClockOffset> = (0..recording.vehicles.len()).map(shared).collect();
    let all = std::slice::from_ref(recording);
    let traces = Trace::of_all(all, &[0], BESIDE_M, low_pass);
    let force = |trace| Force::of(recording, trace, *maps.get(trace.vehicle)?, low_pass);
    let search = ClockSearch {
        recording,
        forces: traces.iter().filter_map(force).collect(),
        unknown: &unknown,
    };
    for (estimate, &(vehicle, bound_s)) in search.run().iter().zip(&unknown) {
        let told = estimate.map(|(offset_s, error_s)| (offset_s, HALF_WIDTH * error_s));
        let told = told.filter(|(_, half_s)| *half_s < bound_s);
        let (offset_s, half_s) = told.unwrap_or((0.0, bound_s));
        let known = match told {
            Some(_) if offset_s.abs() < bound_s => ClockKnown::Told,
            Some(_) => ClockKnown::AtBound,
            None => ClockKnown::CannotBeTold,
        };
        offsets[vehicle] = ClockOffset {
            vehicle,
            offset_s,
            interval_s: [offset_s - half_s, offset_s + half_s].map(|s| s.clamp(-bound_s, bound_s)),
            known,
        };
    }
    offsets
}

/// What an iteration of the search finds: shifts of the clocks (s), their standard errors, gains of
/// the receivers.
struct ClockIteration {
    shifts_s: Vec<f64>,
    errors_s: Vec<f64>,
    gains: Vec<f64>,
}

struct ClockSearch<'a> {
    recording: &'a Recording,
    /// Of the vehicles whose thrust map is known.
    forces: Vec<Force<'a>>,
    /// Vehicles with a clock of their own, and the bound on its offset (s).
    unknown: &'a [(usize, f64)],
}

impl ClockSearch<'_> {
    /// Simulated force of each receiver (N) with the clocks so far off.
    fn simulated_n(&self, offsets_s: &[f64]) -> Vec<Vec<f64>> {
        let mut flow = Flow::new(self.recording);
        let mut own_s = vec![0.0; self.recording.vehicles.len()];
        for (&(vehicle, _), &offset_s) in self.unknown.iter().zip(offsets_s) {
            flow.set_clock_offset(vehicle, offset_s);
            own_s[vehicle] = offset_s;
        }
        let air = self.recording.baseline.receiver_air;
        let one = |force: &Force| {
            force.simulated_n(&force.air_mps(&flow, air, own_s[force.trace.vehicle]))
        };
        self.forces.iter().map(one).collect()
    }

    /// Offset and standard error (s) of each unknown clock; `None` where nothing depends on it.
    fn run(&self) -> Vec<Option<(f64, f64)>> {
        let clocks = self.unknown.len();
        if clocks == 0 || self.forces.is_empty() {
            return vec![None; clocks];
        }
        let mut offsets_s = vec![0.0; clocks];
        let mut gains = vec![1.0; self.forces.len()];
        let mut errors_s = vec![f64::INFINITY; clocks];
        let slopes: Vec<Vec<Vec<f64>>> = (0..clocks)
            .map(|clock| self.slopes(&offsets_s, clock))
            .collect();
        for _ in 0..ITERATIONS {
            let Some(step) = self.step(&offsets_s, &gains, &slopes) else {
                return vec![None; clocks];
            };
            let unknown = offsets_s.iter_mut().zip(self.unknown);
            for ((offset_s, (_, bound_s)), shift_s) in unknown.zip(step.shifts_s) {
                *offset_s = (*offset_s + shift_s).clamp(-bound_s, *bound_s);
            }
            (gains, errors_s) = (step.gains, step.errors_s);
        }
        offsets_s.into_iter().zip(errors_s).map(Some).collect()
    }

    /// A Gauss-Newton iteration; `slopes` by clock, receiver and row.
    fn step(
        &self,
        offsets_s: &[f64],
        gains: &[f64],
        slopes: &[Vec<Vec<f64>>],
    ) -> Option<ClockIteration> {
        let clocks = offsets_s.len();
        let middle_n = self.simulated_n(offsets_s);
        let width = clocks + 2 * self.forces.len();
        let mut square = DMatrix::zeros(width, width);
        let mut right = DVector::zeros(width);
        let mut rows: Vec<(usize, DVector<f64>, f64)> = Vec::new();
        let mut blocks = 0;
        for (r, force) in self.forces.iter().enumerate() {
            let track = &force.trace.of.track;
            let mut block_ends_s = f64::NEG_INFINITY;
            for row in 0..track.t_s.len() {
                let mut x = DVector::zeros(width);
                for clock in 0..clocks {
                    x[clock] = gains[r] * slopes[clock][r][row];
                }
                x[clocks + 2 * r] = middle_n[r][row];
                x[clocks + 2 * r + 1] = 1.0;
                let left_n = force.recorded_n[row] - middle_n[r][row];
                let judged = force.trace.around[row] == Around::Below;
                if !judged || !(left_n + x.sum()).is_finite() {
                    continue;
                }
                if track.t_s[row] >= block_ends_s {
                    block_ends_s = track.t_s[row] + BLOCK_S;
                    blocks += 1;
                }
                square.syger(1.0, &x, &x, 1.0);
                right.axpy(left_n, &x, 1.0);
                rows.push((blocks - 1, x, left_n));
            }
        }
        square.fill_upper_triangle_with_lower_triangle();
        // A receiver that is never below another drone leaves empty columns, and so does a clock
        // that no force depends on.
        for i in 0..width {
            if square[(i, i)] <= 0.0 {
                square[(i, i)] = 1.0;
            }
        }
        if blocks < LEAST_BLOCKS {
            return None;
        }
        let normal = Normal::new(&square)?;
        let solution = normal.solve(&right);
        let mut scores = vec![DVector::zeros(width); blocks];
        for (block, x, left_n) in &rows {
            scores[*block].axpy(left_n - x.dot(&solution), x, 1.0);
        }
        let variance = normal.clustered_variance(&scores);
        let errors_s = (0..clocks).map(|clock| match variance[clock] > 0.0 {
            true => variance[clock].sqrt(),
            false => f64::INFINITY, // no force depends on it
        });
        let gain =
            |r: usize| (1.0 + solution[clocks + 2 * r]).clamp(LEAST_GAIN, LEAST_GAIN.recip());
        Some(ClockIteration {
            shifts_s: solution.rows(0, clocks).iter().copied().collect(),
            errors_s: errors_s.collect(),
            gains: (0..self.forces.len()).map(gain).collect(),
        })
    }

    /// Change of each receiver's simulated force with one clock (N/s), by a central difference.
    fn slopes(&self, offsets_s: &[f64], clock: usize) -> Vec<Vec<f64>> {
        let [before_n, after_n] = [-HALF_STEP_S, HALF_STEP_S].map(|shift_s| {
            let mut shifted_s = offsets_s.to_vec();
            shifted_s[clock] += shift_s;
            self.simulated_n(&shifted_s)
        });
        let slope = |(before, after): (&f64, &f64)| (after - before) / (2.0 * HALF_STEP_S);
        let forces = before_n.iter().zip(&after_n);
        let slopes = forces.map(|(before, after)| before.iter().zip(after).map(slope).collect());
        slopes.collect()
    }
}
