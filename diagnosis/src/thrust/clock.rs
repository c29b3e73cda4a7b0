//! Clocks of vehicles that log on their own: how far each is from the others, as far as the forces tell.
//!
//! A drone that flies under another is pushed at a moment that both logs know, each by its own clock. The offset is the shift that makes
//! the simulated force fit best, within the bounds that the recording states, beside a gain and a constant for each receiver, so
//! that a force simulated too strong does not pass for a clock.
//!
//! ```text
//! F_r(t) = g_r F_simulated,r(t; δ) + c_r + e,       |δ_v| ≤ bound,  δ = 0 for the reference
//! ```
//!
//! It is an *effective* offset: air that takes its time from drone to drone shifts the force just so, unless the baseline declares that
//! delay. Two clocks alone cannot be told from it when the same drone is always the lower one.

use nalgebra::{Cholesky, DMatrix, DVector};
use serde::Serialize;

use crate::forward::flow::Flow;
use crate::forward::force::{self, AirMet};
use crate::forward::low_pass::LowPass;
use crate::record::recording::{Clock, Recording};
use crate::thrust::free_flight::{self, Around, FreeFlight, Trace};
use crate::thrust::thrust_map::ThrustMap;

/// Half the step of the differences that the search goes by (s). Chosen here: half a sample of a 50 Hz log, below the time in which a
/// low-passed force changes.
const HALF_STEP_S: f64 = 0.01;

/// Turns of the search, all with the slopes at no offset. Chosen here: offsets are small against the time in which a low-passed force
/// changes, and the second turn hardly moves them.
const TURNS: usize = 3;

/// Rows this long (s) count as one when the interval is worked out, because what is left of the force is anything but
/// independent from row to row. Chosen here: longer than a passage.
const BLOCK_S: f64 = 2.0;

/// Blocks below which nothing is told. Chosen here: fewer make no spread.
const LEAST_BLOCKS: usize = 6;

/// Least gain of a receiver, and inverse of the largest, that the shift is worked out with. Chosen here: beyond it there is no force
/// to tell a time by.
const LEAST_GAIN: f64 = 0.25;

/// Half-width of the interval in standard errors: 95 % of a normal distribution.
const HALF_WIDTH: f64 = 1.96;

/// What is known of one vehicle's clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClockOffset {
    /// Index of the vehicle.
    pub vehicle: usize,
    /// What its clock is ahead of that of the reference (s); 0 where it cannot be told.
    pub offset_s: f64,
    /// 95 % interval (s), within the bounds; all of them where it cannot be told.
    pub interval_s: [f64; 2],
    /// How it is known.
    pub known: ClockKnown,
}

/// How a clock offset is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum ClockKnown {
    /// It is the reference, or shares its clock.
    Shared,
    /// The forces tell it.
    Told,
    /// The forces ask for more than the bounds allow; it stands at the bound.
    AtBound,
    /// The forces do not tell it from 0 better than the bounds do.
    CannotBeTold,
}

/// Estimates the clock offsets of a recording: one entry for each vehicle. The reference is the first vehicle on the recording's
/// clock, or else the first of all.
///
/// `maps` holds each vehicle's thrust map, as far as there is one. They should come from other flights.
#[must_use]
pub fn offsets(
    recording: &Recording,
    maps: &[Option<&ThrustMap>],
    low_pass: LowPass,
) -> Vec<ClockOffset> {
    let reference = recording
        .vehicles
        .iter()
        .position(|vehicle| vehicle.clock == Clock::Shared);
    let reference = reference.unwrap_or(0);
    let mut offsets: Vec<ClockOffset> = Vec::with_capacity(recording.vehicles.len());
    let mut unknown: Vec<(usize, f64)> = Vec::new();
    for (vehicle, of) in recording.vehicles.iter().enumerate() {
        let (known, bound_s) = match of.clock {
            Clock::Own { within_s } if vehicle != reference => {
                unknown.push((vehicle, within_s));
                (ClockKnown::CannotBeTold, within_s)
            }
            Clock::Own { .. } | Clock::Shared => (ClockKnown::Shared, 0.0),
        };
        offsets.push(ClockOffset {
            vehicle,
            offset_s: 0.0,
            interval_s: [-bound_s, bound_s],
            known,
        });
    }
    let search = Search::new(recording, maps, low_pass, &unknown);
    for (estimate, &(vehicle, bound_s)) in search.run().iter().zip(&unknown) {
        let Some((offset_s, standard_error_s)) = *estimate else {
            continue;
        };
        let half_s = HALF_WIDTH * standard_error_s;
        if half_s >= bound_s {
            continue;
        }
        let known = match offset_s.abs() < bound_s {
            true => ClockKnown::Told,
            false => ClockKnown::AtBound,
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

/// One receiver's flight, with what was recorded.
struct Receiver<'a> {
    trace: Trace<'a>,
    thrust_n: Vec<f64>,
    recorded_n: Vec<f64>,
    hover_mps: f64,
}

/// What a turn of the search finds: shifts of the clocks (s), their standard errors, gains of the receivers.
struct Turn {
    shifts_s: Vec<f64>,
    errors_s: Vec<f64>,
    gains: Vec<f64>,
}

struct Search<'a> {
    recording: &'a Recording,
    receivers: Vec<Receiver<'a>>,
    unknown: &'a [(usize, f64)],
    low_pass: LowPass,
}

impl<'a> Search<'a> {
    fn new(
        recording: &'a Recording,
        maps: &[Option<&ThrustMap>],
        low_pass: LowPass,
        unknown: &'a [(usize, f64)],
    ) -> Search<'a> {
        let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
        let free = FreeFlight::default();
        let receiver = |(vehicle, map): (usize, &Option<&ThrustMap>)| {
            let around = free_flight::around(recording, vehicle, &free, free.beside_m);
            let all = std::slice::from_ref(recording);
            let trace = Trace::new(all, (0, vehicle), around, low_pass)?;
            let thrust_n = trace.thrust_n((*map)?)?;
            let airframe = &trace.of.airframe;
            Some(Receiver {
                recorded_n: force::recorded_n(&trace, &thrust_n, low_pass),
                hover_mps: airframe
                    .hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3),
                thrust_n,
                trace,
            })
        };
        Search {
            recording,
            receivers: maps.iter().enumerate().filter_map(receiver).collect(),
            unknown,
            low_pass,
        }
    }

    /// Simulated force of each receiver (N) with the clocks so far off.
    fn simulated_n(&self, offsets_s: &[f64]) -> Vec<Vec<f64>> {
        let mut flow = Flow::new(self.recording);
        let mut own_s = vec![0.0; self.recording.vehicles.len()];
        for (&(vehicle, _), &offset_s) in self.unknown.iter().zip(offsets_s) {
            flow.set_clock_offset(vehicle, offset_s);
            own_s[vehicle] = offset_s;
        }
        let baseline = &self.recording.baseline;
        let one = |receiver: &Receiver| {
            let vehicle = receiver.trace.vehicle;
            let met = AirMet::along(self.recording, &flow, vehicle, own_s[vehicle]);
            force::simulated_n(
                baseline.receiver_law,
                &receiver.trace,
                &receiver.thrust_n,
                met.declared(baseline.receiver_air),
                receiver.hover_mps,
                self.low_pass,
            )
        };
        self.receivers.iter().map(one).collect()
    }

    /// Offset and standard error (s) of each unknown clock; `None` where nothing depends on it.
    fn run(&self) -> Vec<Option<(f64, f64)>> {
        let clocks = self.unknown.len();
        if clocks == 0 || self.receivers.is_empty() {
            return vec![None; clocks];
        }
        let mut offsets_s = vec![0.0; clocks];
        let mut gains = vec![1.0; self.receivers.len()];
        let mut errors_s = vec![f64::INFINITY; clocks];
        let slopes: Vec<Vec<Vec<f64>>> = (0..clocks)
            .map(|clock| self.slopes(&offsets_s, clock))
            .collect();
        for _ in 0..TURNS {
            let Some(turn) = self.turn(&offsets_s, &gains, &slopes) else {
                return vec![None; clocks];
            };
            let unknown = offsets_s.iter_mut().zip(self.unknown);
            for ((offset_s, (_, bound_s)), shift_s) in unknown.zip(turn.shifts_s) {
                *offset_s = (*offset_s + shift_s).clamp(-bound_s, *bound_s);
            }
            (gains, errors_s) = (turn.gains, turn.errors_s);
        }
        offsets_s.into_iter().zip(errors_s).map(Some).collect()
    }

    /// One turn of Gauss and Newton; `slopes` by clock, receiver and row.
    fn turn(&self, offsets_s: &[f64], gains: &[f64], slopes: &[Vec<Vec<f64>>]) -> Option<Turn> {
        let clocks = offsets_s.len();
        let middle_n = self.simulated_n(offsets_s);
        let width = clocks + 2 * self.receivers.len();
        let mut square = DMatrix::zeros(width, width);
        let mut right = DVector::zeros(width);
        let mut rows: Vec<(usize, DVector<f64>, f64)> = Vec::new();
        let mut blocks = 0;
        for (r, receiver) in self.receivers.iter().enumerate() {
            let track = &receiver.trace.of.track;
            let mut block_ends_s = f64::NEG_INFINITY;
            for row in 0..track.t_s.len() {
                let mut x = DVector::zeros(width);
                for clock in 0..clocks {
                    x[clock] = gains[r] * slopes[clock][r][row];
                }
                x[clocks + 2 * r] = middle_n[r][row];
                x[clocks + 2 * r + 1] = 1.0;
                let left_n = receiver.recorded_n[row] - middle_n[r][row];
                let judged = receiver.trace.around[row] == Around::Below;
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
        // A receiver never under anybody leaves empty columns, and a clock that nobody's force depends on does too.
        for i in 0..width {
            if square[(i, i)] <= 0.0 {
                square[(i, i)] = 1.0;
            }
        }
        let scale = DVector::from_fn(width, |i, _| square[(i, i)].sqrt().recip());
        let scaled = DMatrix::from_fn(width, width, |i, j| square[(i, j)] * scale[i] * scale[j]);
        if blocks < LEAST_BLOCKS {
            return None;
        }
        let cholesky = Cholesky::new(scaled)?;
        let solution = cholesky
            .solve(&right.component_mul(&scale))
            .component_mul(&scale);
        let mut scores = vec![DVector::zeros(width); blocks];
        for (block, x, left_n) in &rows {
            scores[*block].axpy(left_n - x.dot(&solution), x, 1.0);
        }
        let mut variance = DVector::<f64>::zeros(width);
        for score in &scores {
            let shift = cholesky
                .solve(&score.component_mul(&scale))
                .component_mul(&scale);
            variance += shift.component_mul(&shift);
        }
        let few = blocks as f64 / (blocks as f64 - 1.0);
        let errors_s = (0..clocks).map(|clock| match variance[clock] > 0.0 {
            true => (few * variance[clock]).sqrt(),
            false => f64::INFINITY, // nobody's force depends on it
        });
        let gain =
            |r: usize| (1.0 + solution[clocks + 2 * r]).clamp(LEAST_GAIN, LEAST_GAIN.recip());
        Some(Turn {
            shifts_s: solution.rows(0, clocks).iter().copied().collect(),
            errors_s: errors_s.collect(),
            gains: (0..self.receivers.len()).map(gain).collect(),
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
        before_n
            .iter()
            .zip(&after_n)
            .map(|(before_n, after_n)| before_n.iter().zip(after_n).map(slope).collect())
            .collect()
    }
}
