//! Vertical forces of several flights, thinned to what a diagnosis needs, and what any hypothesis makes of them.
//!
//! ```text
//! F = [ τ(α) g(z) s(V) f(V_h) - 1 ] T + F_drag          α = η (U + κ V_z)/U_H
//! ```
//!
//! `T` is the vertical thrust in still air by a thrust map that was identified in *other* flights, with nobody above and away from the floor; `τ` the receiver
//! law of the baseline; `g`, `s`, `f` what floor, battery and forward flight do. Recorded and simulated force pass the same low-pass.

use std::collections::VecDeque;
use std::sync::Mutex;

use airflow::Wake;
use rayon::prelude::*;

use super::air_met::{Kept, wakes};
use super::covariates::{COORDINATES, covariates};
use super::options::CampaignOptions;
use super::steps::{Part, Step, part};
use crate::forward::hypothesis::Hypothesis;
use crate::forward::low_pass::LowPass;
use crate::forward::observed::{Covariates, Explained};
use crate::forward::simulate::{Channel, Place, Sample};
use crate::record::recording::Recording;
use crate::statistics::held_out::FOLDS;
use crate::thrust::free_flight::{self, Trace};
use crate::thrust::held_out::deal;
use crate::thrust::identify::{Bench, IdentifyError};

/// Of steps where nothing is near, one in so many is judged, and of the others. Chosen here: half a second and a fifth of one, in which the
/// scatter forgets most.
const THINNED: usize = 5;
const NEAR: usize = 2;
/// Steps of a window, and before and after one that are simulated for what low-pass and lags remember.
const WINDOW: usize = 40;
const BEFORE: usize = 10;

/// Forces of a campaign.
#[derive(Debug)]
pub struct Forces<'a> {
    /// All recordings.
    pub recordings: &'a [Recording],
    /// One vehicle in one flight each, in the order of the flights' names.
    pub parts: Vec<Part>,
    /// Judged rows.
    pub rows: usize,
    /// What a hypothesis-free simulation gives.
    pub(super) alone: bool,
    pub(super) low_pass: LowPass,
    pub(super) wakes: Vec<Wake>,
    /// Of every recording and vehicle: which of the wakes, `None` where it does not blow.
    pub(super) wake_of: Vec<Vec<Option<usize>>>,
    /// Air of the hover jets at every step of every part (m/s).
    pub(super) hover_air_mps: Vec<Vec<f64>>,
    /// One column for each of [`COORDINATES`].
    columns: Vec<Vec<f64>>,
    places: Vec<Option<Place>>,
    pub(super) kept: Mutex<VecDeque<Kept>>,
}

impl<'a> Forces<'a> {
    /// The forces of the flights to be judged.
    ///
    /// # Errors
    /// A thrust map that cannot be identified.
    pub fn new(
        recordings: &'a [Recording],
        options: &CampaignOptions,
    ) -> Result<Forces<'a>, IdentifyError> {
        let is_judged = |index: usize| options.judge.is_empty() || options.judge.contains(&index);
        let (by_name, _) = deal(recordings, FOLDS);
        // Folds count the judged flights alone, so that each holds as many.
        let mut flight_of = vec![usize::MAX; recordings.len()];
        for (flight, &index) in by_name.iter().filter(|&&i| is_judged(i)).enumerate() {
            flight_of[index] = flight;
        }
        let wanted: Vec<(usize, usize)> = by_name
            .iter()
            .flat_map(|&index| (0..recordings[index].vehicles.len()).map(move |v| (index, v)))
            .filter(|&(index, v)| !options.except.contains(&recordings[index].vehicles[v].id))
            .collect();
        let low_pass = options.identify.low_pass;
        let traces: Vec<Trace> = wanted
            .par_iter()
            .filter_map(|&(index, vehicle)| {
                let free = &options.identify.free;
                let around = free_flight::around(&recordings[index], vehicle, free, 0.0);
                Trace::new(recordings, (index, vehicle), around, low_pass)
            })
            .collect();
        let mut groups: Vec<&str> = traces.iter().map(|t| options.share.group(t.of)).collect();
        groups.sort_unstable();
        groups.dedup();
        let mut parts: Vec<Part> = Vec::new();
        for group in groups {
            let of_group = || traces.iter().filter(|t| options.share.group(t.of) == group);
            let bench = Bench::new(of_group().collect(), &options.identify);
            for fold in 0..FOLDS {
                let held = |index: usize| {
                    flight_of[index] != usize::MAX && flight_of[index] % FOLDS == fold
                };
                if !of_group().any(|trace| held(trace.recording)) {
                    continue;
                }
                let map = bench.fit(|index| !held(index))?.map;
                let of_fold: Vec<&Trace> = of_group().filter(|t| held(t.recording)).collect();
                let made: Vec<Option<Part>> = of_fold
                    .par_iter()
                    .map(|trace| {
                        let thrust_n = trace.thrust_n(&map)?;
                        let flight = flight_of[trace.recording];
                        part(recordings, trace, &thrust_n, flight, options)
                    })
                    .collect();
                parts.extend(made.into_iter().flatten());
            }
        }
        parts.sort_by_key(|part| (part.flight, part.vehicle));
        let (wakes, wake_of) = wakes(recordings);
        let mut forces = Forces {
            recordings,
            parts,
            rows: 0,
            alone: options.alone || recordings.iter().all(|one| !one.baseline.wakes),
            low_pass,
            wakes,
            wake_of,
            hover_air_mps: Vec::new(),
            columns: Vec::new(),
            places: Vec::new(),
            kept: Mutex::default(),
        };
        forces.choose_rows(options.most_rows);
        let plain = Hypothesis::default();
        forces.hover_air_mps = forces
            .parts
            .par_iter()
            .map(|part| forces.air_mps(part, &plain, &forces.wakes))
            .collect();
        (forces.columns, forces.places) = covariates(&forces);
        Ok(forces)
    }

    /// Windows of a few seconds, as many as are allowed, spread over all flights: simulating costs what is judged and little more.
    fn choose_rows(&mut self, most: usize) {
        let mut stride = 1;
        loop {
            let mut rows = 0;
            for (index, part) in self.parts.iter_mut().enumerate() {
                let is_kept = |at: usize| (at / WINDOW + index).is_multiple_of(stride);
                let steps = part.steps.iter().enumerate();
                let kept = steps.filter(|(at, step)| {
                    let every = if step.is_free { THINNED } else { NEAR };
                    is_kept(*at) && at % every == 0
                });
                part.judged = kept.map(|(at, _)| at).collect();
                part.is_needed = (0..part.steps.len())
                    .map(|at| {
                        is_kept(at) || is_kept(at + BEFORE) || is_kept(at.saturating_sub(BEFORE))
                    })
                    .collect();
                rows += part.judged.len();
            }
            self.rows = rows;
            if rows <= most.max(1) || stride > 50 {
                return;
            }
            stride += 1;
        }
    }

    /// Whether no wakes blow unless a hypothesis says so.
    #[must_use]
    pub fn is_alone(&self) -> bool {
        self.alone
    }

    /// Judged steps with their part, in order.
    pub fn judged(&self) -> impl Iterator<Item = (&Part, &Step)> + '_ {
        let of = |part: &'_ Part| part.judged.len();
        debug_assert_eq!(self.parts.iter().map(of).sum::<usize>(), self.rows);
        self.parts
            .iter()
            .flat_map(|part| part.judged.iter().map(move |&at| (part, &part.steps[at])))
    }

    /// Air of the hover jets at every judged row (m/s).
    #[must_use]
    pub fn hover_air_mps(&self) -> Vec<f64> {
        let parts = self.parts.iter().zip(&self.hover_air_mps);
        parts
            .flat_map(|(part, air_mps)| part.judged.iter().map(|&at| air_mps[at]))
            .collect()
    }

    /// The judged rows, beside a simulation of them; rows count along them.
    #[must_use]
    pub fn samples(&self, simulated_n: &[f64]) -> Vec<Sample> {
        let air_mps = self.hover_air_mps();
        self.judged()
            .enumerate()
            .map(|(row, (part, step))| Sample {
                channel: Channel::VerticalForce,
                row,
                t_s: step.t_s,
                subject: part.vehicle as u32,
                position_m: step.position_m,
                recorded: step.recorded_n,
                simulated: simulated_n[row],
                air_mps: air_mps[row],
                place: self.places[row],
            })
            .collect()
    }

    /// Half-width (m) of a vehicle's hover jet at a depth.
    #[must_use]
    pub fn half_width_m(&self, recording: usize, vehicle: usize, depth_m: f64) -> Option<f64> {
        let wake = self.wake_of[recording][vehicle]?;
        Some(self.wakes[wake].half_width_m(depth_m))
    }
}

impl Explained for Forces<'_> {
    fn recorded(&self) -> Vec<f64> {
        self.judged().map(|(_, step)| step.recorded_n).collect()
    }

    fn predict(&self, hypothesis: &Hypothesis) -> Vec<f64> {
        let every = self.at_every_step(hypothesis);
        let parts = self.parts.iter().zip(&every);
        parts
            .flat_map(|(part, forces_n)| part.judged.iter().map(|&at| forces_n[at]))
            .collect()
    }

    fn times_s(&self) -> Vec<f64> {
        self.judged().map(|(_, step)| step.t_s).collect()
    }

    fn covariates(&self) -> Covariates<'_> {
        Covariates {
            names: &COORDINATES,
            columns: &self.columns,
        }
    }

    /// Rows are windows of a few seconds: too short for a rhythm.
    fn releases(&self) -> Vec<(Vec<usize>, Vec<f64>)> {
        Vec::new()
    }
}
