//! The forces on drones to the sides: what of them the thrust and the wakes above do not explain.
//!
//! ```text
//! e = [ m a - T z - (τ(α) - 1) T z ]_xy / m          a: specific force, z: the body's axis, T: thrust map
//! ```
//!
//! The baseline is that of the vertical force, turned with the drone: air from above takes thrust
//! away along the body's axis, so that a drone which leans loses some of what holds it sideways.
//! On top of it every candidate is linear in its parameters, beside a rate or a frequency that is
//! looked for on a grid, and between its points once that has shown the candidate to be there:
//!
//! ```text
//! sensor_gain           g T z_xy/m                      instruments: a factor, and a lag
//! sensor_lag            τ d/dt (T z_xy/m)
//! rotor_drag            -k V T/(m g)                    V: the drone's own horizontal velocity
//! wind                  w, one vector a flight          k times the wind's speed
//! wind_turning          w turned by Ω t
//! thrust_misalignment   (T/m) R(yaw) δ, one angle δ a vehicle
//! swinging_payload      μ g θ,   θ'' + 2 ζ ω θ' + ω² θ = -ω² T z_xy/(m g)
//! entrainment_radial    -c α (T/m) e_r                  e_r: away from the axis of the wake above
//! ```
//!
//! Rotor drag is linear in the speed: Faessler, Franchi & Scaramuzza, "Differential flatness of
//! quadrotor dynamics subject to rotor drag", RA-L 2018, who measure `k` of 0.2 to 0.5 1/s. The
//! payload hangs from one cord of the length `L` and swings by little: a pendulum on a support that
//! it drags along, so that `ω² = (1 + m_p/m) g/L`, and `μ` is its share of the whole mass. What
//! drives it is the thrust, not the acceleration, whose noise is that of the force. A term is taken
//! where it predicts blocks of 15 s that it was not fitted on.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Vector2, Vector3};
use rayon::prelude::*;
use serde::Serialize;

use super::diagnose::CampaignError;
use super::forces::{Above, CampaignOptions, LOW_PASS, RATE_HZ, above};
use crate::forward::flow::Flow;
use crate::forward::receiver::thrust_ratio;
use crate::record::recording::Recording;
use crate::record::track::ThrustSource;
use crate::statistics::held_out::{FOLDS, Gain};
use crate::statistics::robust::loss;
use crate::thrust::free_flight::{Around, Trace};
use crate::thrust::identify::{self, FoldMap, deal, fold_maps};
use crate::thrust::low_pass;

/// Blocks (s) that are held out whole, and what is left out at the beginning of each, in which it
/// still remembers the one before. Chosen here: as of probes, and what low-pass and swing forget
/// in.
const BLOCK_S: f64 = 15.0;
const FORGETS_S: f64 = 2.0;
/// Fewest blocks. Chosen here: below, a standard error over blocks is itself not known.
const FEWEST_BLOCKS: usize = 8;
/// Most steps looked at. Chosen here: an hour of flights within some seconds.
const MOST_STEPS: usize = 40_000;
/// Most effects named; least gain, alone and in standard errors, and when two do as well: as of the
/// vertical force ([`super::forward`]).
const MOST_EFFECTS: usize = 4;
const LEAST_GAIN: f64 = 10.0;
const LEAST_ERRORS: f64 = 2.5;
const TIE_ERRORS: f64 = 2.0;
const TIE_MOST_SHARE: f64 = 0.25;
/// Periods (s) in which a wind may turn once, either way. Chosen here: slower is constant over a
/// flight, faster is no wind that turns slowly, and between two a flight of some minutes turns by
/// less than half of one more.
const TURNS_IN_S: [f64; 9] = [600.0, 424.0, 300.0, 212.0, 150.0, 106.0, 75.0, 53.0, 40.0];
/// Frequencies (rad/s) of cords of 9.8 to 0.2 m, and dampings of their swings. The last damping and
/// the outermost frequencies are there to be beaten: what is best there is no swing.
const SWINGS_RADPS: [f64; 16] = [
    1.0, 1.2, 1.4, 1.7, 2.0, 2.3, 2.6, 2.9, 3.2, 3.6, 4.0, 4.5, 5.0, 5.6, 6.3, 7.0,
];
const DAMPINGS: [f64; 3] = [0.03, 0.12, 0.4];
/// Factors by which what a grid says best is first moved, rate and damping, either way, and how
/// often they are halved. Chosen here: half a step of the grids, down to less than is printed.
const FIRST_MOVE: [f64; 2] = [1.2, 2.0];
const HALVINGS: usize = 6;
const SWING: &str = "swinging_payload";
/// Part of a swing's power that must lie at its own frequency: its mean square frequency (Rice)
/// over that. Half, for below as much of it follows the thrust at the thrust's own frequencies, as
/// a factor on the thrust does, and shows nothing of a cord.
const LEAST_RESONANCE: f64 = 0.5;
/// Moments (s) apart by which the noise is read at the end. As long as the noise of the simulated
/// campaigns without any effect lasts, which comes to 1.3 times what is read so.
const NOISE_OVER_S: f64 = 0.5;
/// Steps of a swing's equation within one of the forces.
const FINER: usize = 10;
/// Least noise (m/s²), and root mean square of the least effect. Chosen here: a milligravity, which
/// no accelerometer that is flown holds.
const LEAST_NOISE_MPS2: f64 = 0.01;
/// Prior of every parameter over what would explain the scatter by itself. Chosen here, so wide
/// that it only keeps apart what the steps of a fold cannot.
const RIDGE: f64 = 1e-6;

/// What forces sideways say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SidewaysFinding {
    /// Steps judged, two axes each.
    pub samples: usize,
    /// Flights and blocks that they come from.
    pub flights: usize,
    /// Blocks of 15 s.
    pub blocks: usize,
    /// What is named, in the order in which it was taken.
    pub effects: Vec<SidewaysEffect>,
    /// Root mean square of force over mass (m/s²) as recorded; what is named was not fitted on the
    /// blocks that it is judged by.
    pub rms_recorded_mps2: f64,
    /// Left by the baseline.
    pub rms_before_mps2: f64,
    /// Left by what is named.
    pub rms_after_mps2: f64,
    /// What of that differs between moments half a second apart, as one of them.
    pub noise_mps2: f64,
    /// What was tried and not taken, with gain and standard error.
    pub not_taken: Vec<(String, f64, f64)>,
    /// Vehicles that cannot be judged, each with the columns that it lacks.
    pub lacking: Vec<String>,
}

/// One effect on forces sideways.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SidewaysEffect {
    /// Its name.
    pub name: String,
    /// What it is, in words.
    pub description: String,
    /// Gain in log density on blocks that were not fitted, over what was taken before.
    pub gain: f64,
    /// Its standard error over blocks.
    pub gain_error: f64,
    /// Names that would have done as well.
    pub alternatives: Vec<String>,
    /// What was fitted.
    pub parameters: Vec<SidewaysParameter>,
}

/// A fitted number.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SidewaysParameter {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Over whole blocks; none of what was looked for on a grid.
    pub standard_error: Option<f64>,
}

/// One moment of one vehicle.
#[derive(Clone, Debug)]
struct SidewaysSample {
    t_s: f64,
    flight: usize,
    /// Place among the ids of all vehicles.
    vehicle: usize,
    block: usize,
    /// Whether the block before is forgotten.
    is_judged: bool,
    /// Whether the step before follows without a gap.
    follows: bool,
    recorded_mps2: Vector2<f64>,
    baseline_mps2: Vector2<f64>,
    velocity_mps: Vector2<f64>,
    /// Thrust sideways over mass.
    drive_mps2: Vector2<f64>,
    thrust_mps2: f64,
    gravity_mps2: f64,
    heading: Vector2<f64>,
    alpha: f64,
    /// Away from the axis of the nearest wake above; 0 where there is none.
    outward: Vector2<f64>,
}

struct Steps {
    all: Vec<SidewaysSample>,
    flights: Vec<String>,
    vehicles: Vec<String>,
    blocks: usize,
}

/// The point of a candidate that is looked for nowhere.
const NO_GRID: [f64; 2] = [0.0; 2];

/// A candidate: columns for a number of its grid.
#[derive(Clone)]
struct Candidate {
    name: &'static str,
    description: &'static str,
    grid: Vec<[f64; 2]>,
    columns: fn(&Steps, [f64; 2]) -> Vec<Regressor>,
    /// Whether its parameter is one that cannot be below 0.
    is_positive: bool,
    /// What a point of the grid says.
    told: fn([f64; 2]) -> Vec<SidewaysParameter>,
}

/// What multiplies one parameter: nothing but over one stretch of the steps, those of a flight, or
/// all.
struct Regressor {
    name: String,
    unit: &'static str,
    from: usize,
    values: Vec<Vector2<f64>>,
}

/// Diagnoses the forces sideways of several flights together.
///
/// # Errors
/// No vehicle that logs what it takes, no thrust map, or too little flight.
pub fn diagnose_sideways(
    recordings: &[Recording],
    options: &CampaignOptions,
) -> Result<SidewaysFinding, CampaignError> {
    let lacking = lacking(recordings);
    let steps = steps(recordings, options)?;
    if steps.all.is_empty() {
        return Err(CampaignError::NoForce(lacking));
    }
    if steps.blocks < FEWEST_BLOCKS {
        return Err(CampaignError::TooShort(steps.blocks, FEWEST_BLOCKS));
    }
    let mut candidates = candidates(&steps);
    let turns = chosen(&steps, &mut candidates);
    Ok(found(&steps, &candidates, turns, lacking))
}

/// What was taken, in order: which, its gain, and what would have done as well. Then what was not,
/// with its gain over all that was.
struct Turns {
    taken: Vec<(usize, Gain, Vec<usize>)>,
    next: Vec<(usize, Gain)>,
}

impl Turns {
    fn which(&self) -> Vec<usize> {
        self.taken.iter().map(|(which, ..)| *which).collect()
    }
}

/// Of those that it takes the grid becomes the best point on it and between.
fn chosen(steps: &Steps, candidates: &mut [Candidate]) -> Turns {
    let mut turns = Turns {
        taken: Vec::new(),
        next: Vec::new(),
    };
    loop {
        let noise = Noise::of(steps, candidates);
        let which = turns.which();
        let base = noise.held_out(steps, candidates, &which);
        let others = (0..candidates.len()).filter(|k| !which.contains(k));
        let others: Vec<usize> = others.collect();
        let all = &*candidates;
        let with = |&k: &usize| {
            let both: Vec<usize> = which.iter().copied().chain([k]).collect();
            let gain = |of: &[Candidate]| {
                let held = noise.held_out(steps, of, &both);
                noise.gain(steps, &held, &base)
            };
            let on_grid = gain(all);
            if all[k].grid.len() == 1 || !is_sure(&on_grid) {
                return (k, on_grid, all[k].grid[0]);
            }
            let mut of = all.to_vec();
            let point = refined(&noise, steps, all, &both);
            of[k].grid = vec![point];
            (k, gain(&of), point)
        };
        let found: Vec<(usize, Gain, [f64; 2])> = others.par_iter().map(with).collect();
        let points: BTreeMap<usize, [f64; 2]> =
            found.iter().map(|(k, _, point)| (*k, *point)).collect();
        let mut gains: Vec<(usize, Gain)> =
            found.into_iter().map(|(k, gain, _)| (k, gain)).collect();
        gains.sort_by(|a, b| b.1.total.total_cmp(&a.1.total));
        // What contradicts its own description is no effect.
        let is_possible = |k: usize| {
            let both: Vec<usize> = which.iter().copied().chain([k]).collect();
            let tables = Tables::new(&noise, steps, candidates, &both);
            let (choice, fitted) = tables.best(None);
            let last = fitted.values.iter().next_back();
            let has_sign = !candidates[k].is_positive || last.is_some_and(|value| *value > 0.0);
            let is_inside = |point: &[f64; 2]| candidates[k].is_inside(*point);
            let swings = |[radps, _]: &[f64; 2]| {
                candidates[k].name != SWING || is_resonant(steps, choice.columns.last(), *radps)
            };
            // Its share of the force, where all are fitted.
            let own =
                choice.columns.len() - (candidates[k].columns)(steps, candidates[k].grid[0]).len();
            let mut share = vec![Vector2::zeros(); steps.all.len()];
            for (value, column) in fitted.values.iter().zip(&choice.columns).skip(own) {
                let both = share[column.from..].iter_mut().zip(&column.values);
                both.for_each(|(share, of)| *share += of * *value);
            }
            let square: f64 = share.iter().map(Vector2::norm_squared).sum();
            let is_felt = square > steps.all.len() as f64 * LEAST_NOISE_MPS2.powi(2);
            is_felt
                && has_sign
                && choice
                    .points
                    .last()
                    .is_none_or(|at| is_inside(at) && swings(at))
        };
        gains.retain(|(k, gain)| !is_sure(gain) || is_possible(*k));
        let best = gains.iter().find(|(_, gain)| is_sure(gain)).cloned();
        let Some((best, gain)) = best.filter(|_| turns.taken.len() < MOST_EFFECTS) else {
            turns.next = gains;
            break;
        };
        let is_tied = |(k, other): &&(usize, Gain)| {
            let apart = gain.beyond(other);
            let within = (TIE_ERRORS * apart.standard_error).min(TIE_MOST_SHARE * gain.total);
            *k != best && is_sure(other) && apart.total < within
        };
        let mut tied: Vec<usize> = gains.iter().filter(is_tied).map(|(k, _)| *k).collect();
        // A wind that stands is the simpler of the two.
        let mut which = best;
        if let ("wind_turning", Some(at)) = (
            candidates[best].name,
            tied.iter().position(|&k| candidates[k].name == "wind"),
        ) {
            which = std::mem::replace(&mut tied[at], best);
        }
        let gain = gains.into_iter().find(|(k, _)| *k == which);
        let Some((_, gain)) = gain else {
            break;
        };
        candidates[which].grid = vec![points[&which]];
        turns.taken.push((which, gain, tied));
    }
    // Beside what was taken after it, each once more.
    let noise = Noise::of(steps, candidates);
    let taken = turns.which();
    for &k in &taken {
        if candidates[k].grid == [NO_GRID] {
            continue;
        }
        let others = taken.iter().copied().filter(|other| *other != k);
        let last: Vec<usize> = others.chain([k]).collect();
        candidates[k].grid = vec![refined(&noise, steps, candidates, &last)];
    }
    turns
}

/// The point between those of its grid at which the last of some candidates leaves least: the best
/// on the grid, moved by ever less.
fn refined(noise: &Noise, steps: &Steps, candidates: &[Candidate], which: &[usize]) -> [f64; 2] {
    let tables = Tables::new(noise, steps, candidates, which);
    let (choice, fitted) = tables.best(None);
    let (mut points, mut least) = (choice.points.clone(), fitted.square);
    let last = points.len() - 1;
    for halving in 0..HALVINGS {
        let part = 0.5_f64.powi(halving as i32);
        loop {
            let moved = |(axis, sign): (usize, f64)| {
                let mut at = points.clone();
                at[last][axis] *= FIRST_MOVE[axis].powf(sign * part);
                let square = Choice::at(noise, steps, candidates, (which, at.clone()));
                (square.fit(None).square, at)
            };
            let ways = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)];
            let ways: Vec<(usize, f64)> = (ways.into_iter())
                .filter(|(axis, _)| points[last][*axis] != 0.0)
                .collect();
            let tried: Vec<(f64, Vec<[f64; 2]>)> = ways.into_par_iter().map(moved).collect();
            let best = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
            match best {
                Some((square, at)) if square < least => (least, points) = (square, at),
                _ => break,
            }
        }
    }
    points[last]
}

fn is_sure(gain: &Gain) -> bool {
    gain.total > LEAST_GAIN.max(LEAST_ERRORS * gain.standard_error) && gain.without_best() > 0.0
}

/// Noise of the force over mass: one of white and its memory over a step.
struct Noise {
    sd_mps2: f64,
    memory: f64,
}

impl Noise {
    /// What is left of the first step of every candidate's grid fitted together, of those that are
    /// taken the best one: what no candidate here explains.
    fn of(steps: &Steps, candidates: &[Candidate]) -> Noise {
        let white = Noise {
            sd_mps2: 1.0,
            memory: 0.0,
        };
        let all: Vec<Regressor> = candidates
            .iter()
            .flat_map(|of| (of.columns)(steps, of.grid[0]))
            .collect();
        let choice = Choice::new(&white, steps, Vec::new(), all);
        let left = choice.fit(None).left(steps, &choice.columns);
        let (mut square, mut product, mut pairs) = (0.0, 0.0, 0.0);
        for (at, step) in steps.all.iter().enumerate() {
            square += left[at].norm_squared();
            if step.follows {
                product += left[at].dot(&left[at - 1]);
                pairs += 2.0;
            }
        }
        let variance = square / (2.0 * steps.all.len() as f64);
        let memory = product / f64::max(pairs, 1.0) / variance.max(f64::MIN_POSITIVE);
        Noise {
            sd_mps2: variance.sqrt().max(LEAST_NOISE_MPS2),
            memory: memory.clamp(0.0, 0.98),
        }
    }

    /// Values of a stretch of the steps, less what is remembered of the step before, in standard
    /// deviations.
    fn whiten(&self, steps: &Steps, from: usize, values: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
        let fresh = self.sd_mps2 * (1.0 - self.memory * self.memory).sqrt();
        let one = |(at, value): (usize, &Vector2<f64>)| match steps.all[from + at].follows {
            true if at > 0 => (value - values[at - 1] * self.memory) / fresh,
            true => value / fresh,
            false => value / self.sd_mps2,
        };
        values.iter().enumerate().map(one).collect()
    }

    /// What each block's fit leaves of it, fitted on the other folds, each with its own choice of
    /// the grid.
    fn held_out(
        &self,
        steps: &Steps,
        candidates: &[Candidate],
        which: &[usize],
    ) -> Vec<Vector2<f64>> {
        let mut left: Vec<Vector2<f64>> = steps.all.iter().map(SidewaysSample::left_mps2).collect();
        if which.is_empty() {
            return left;
        }
        let tables = Tables::new(self, steps, candidates, which);
        for fold in 0..FOLDS {
            let (choice, fitted) = tables.best(Some(fold));
            let here = fitted.left(steps, &choice.columns);
            for (at, step) in steps.all.iter().enumerate() {
                if step.block % FOLDS == fold {
                    left[at] = here[at];
                }
            }
        }
        left
    }

    /// Gain in log density of what one leaves over what another does, over blocks.
    fn gain(&self, steps: &Steps, left: &[Vector2<f64>], other: &[Vector2<f64>]) -> Gain {
        let [left, other] = [left, other].map(|of| self.whiten(steps, 0, of));
        let mut by_block = vec![0.0; steps.blocks];
        for (at, step) in steps.all.iter().enumerate().filter(|(_, of)| of.is_judged) {
            let of = |white: &[Vector2<f64>]| -0.5 * (loss(white[at].x) + loss(white[at].y));
            by_block[step.block] += of(&left) - of(&other);
        }
        Gain::new(by_block)
    }
}

/// Parameters of some columns.
struct Fitted {
    values: DVector<f64>,
    inverse: DMatrix<f64>,
    /// Sum of squares that is left, in variances.
    square: f64,
}

impl Fitted {
    fn left(&self, steps: &Steps, columns: &[Regressor]) -> Vec<Vector2<f64>> {
        let mut left: Vec<Vector2<f64>> = steps.all.iter().map(SidewaysSample::left_mps2).collect();
        for (value, column) in self.values.iter().zip(columns) {
            let both = left[column.from..].iter_mut().zip(&column.values);
            both.for_each(|(left, of)| *left -= of * *value);
        }
        left
    }

    /// Standard errors over blocks: `√ diag( K/(K-p) H⁻¹ (Σ g gᵀ) H⁻¹ )`.
    fn standard_errors(&self, noise: &Noise, steps: &Steps, columns: &[Regressor]) -> Vec<f64> {
        let left = noise.whiten(steps, 0, &self.left(steps, columns));
        let mut scores = vec![DVector::zeros(columns.len()); steps.blocks];
        for (k, column) in columns.iter().enumerate() {
            let white = noise.whiten(steps, column.from, &column.values);
            for (at, white) in (column.from..).zip(white) {
                let step = &steps.all[at];
                if step.is_judged {
                    scores[step.block][k] += white.dot(&left[at]);
                }
            }
        }
        let mut middle = DMatrix::zeros(columns.len(), columns.len());
        scores.iter().for_each(|g| middle.ger(1.0, g, g, 1.0));
        let blocks = steps.blocks as f64;
        let factor = blocks / (blocks - columns.len() as f64).max(1.0);
        let covariance = &self.inverse * middle * &self.inverse * factor;
        covariance
            .diagonal()
            .iter()
            .map(|v| v.max(0.0).sqrt())
            .collect()
    }
}

/// One choice of the grids of some candidates, with all that least squares needs, by fold.
struct Choice {
    points: Vec<[f64; 2]>,
    columns: Vec<Regressor>,
    sums: Vec<Sums>,
}

/// `Σ z zᵀ`, `Σ z y` and `Σ y²` over whitened rows.
#[derive(Clone)]
struct Sums {
    normal: DMatrix<f64>,
    right: DVector<f64>,
    square: f64,
}

impl Choice {
    fn new(noise: &Noise, steps: &Steps, points: Vec<[f64; 2]>, columns: Vec<Regressor>) -> Choice {
        let white = columns
            .iter()
            .map(|column| noise.whiten(steps, column.from, &column.values));
        let white: Vec<Vec<Vector2<f64>>> = white.collect();
        let target: Vec<Vector2<f64>> = steps.all.iter().map(SidewaysSample::left_mps2).collect();
        let target = noise.whiten(steps, 0, &target);
        let none = Sums {
            normal: DMatrix::zeros(columns.len(), columns.len()),
            right: DVector::zeros(columns.len()),
            square: 0.0,
        };
        let mut sums = vec![none; FOLDS];
        let mut here = Vec::new();
        for (at, step) in steps.all.iter().enumerate().filter(|(_, of)| of.is_judged) {
            let sums = &mut sums[step.block % FOLDS];
            let values = columns.iter().zip(&white).enumerate();
            let values = values.filter_map(|(k, (column, white))| {
                Some((k, *white.get(at.checked_sub(column.from)?)?))
            });
            here.clear();
            here.extend(values);
            for (place, (k, value)) in here.iter().enumerate() {
                sums.right[*k] += value.dot(&target[at]);
                for (other, beside) in &here[..=place] {
                    sums.normal[(*k, *other)] += value.dot(beside);
                }
            }
            sums.square += target[at].norm_squared();
        }
        Choice {
            points,
            columns,
            sums,
        }
    }

    /// Of some candidates, each at a point of its own.
    fn at(
        noise: &Noise,
        steps: &Steps,
        candidates: &[Candidate],
        (which, points): (&[usize], Vec<[f64; 2]>),
    ) -> Choice {
        let all = which.iter().zip(&points);
        let columns = all.flat_map(|(&k, &point)| (candidates[k].columns)(steps, point));
        let columns = columns.collect();
        Choice::new(noise, steps, points, columns)
    }

    /// Least squares over all folds but one.
    fn fit(&self, but: Option<usize>) -> Fitted {
        let count = self.columns.len();
        let mut normal = DMatrix::zeros(count, count);
        let mut right = DVector::zeros(count);
        let mut square = 0.0;
        let used = self
            .sums
            .iter()
            .enumerate()
            .filter(|(fold, _)| Some(*fold) != but);
        for (_, sums) in used {
            normal += &sums.normal;
            right += &sums.right;
            square += sums.square;
        }
        normal.fill_upper_triangle_with_lower_triangle();
        for k in 0..count {
            normal[(k, k)] += RIDGE * normal[(k, k)].max(1.0);
        }
        let inverse = normal.cholesky().map(|of| of.inverse());
        let inverse = inverse.unwrap_or_else(|| DMatrix::zeros(count, count));
        let values = &inverse * &right;
        Fitted {
            square: square - values.dot(&right),
            values,
            inverse,
        }
    }
}

/// Columns of some candidates together, for every choice of their grids.
struct Tables {
    choices: Vec<Choice>,
}

impl Tables {
    fn new(noise: &Noise, steps: &Steps, candidates: &[Candidate], which: &[usize]) -> Tables {
        let mut points: Vec<Vec<[f64; 2]>> = vec![Vec::new()];
        for &k in which {
            let with = |before: &Vec<[f64; 2]>| {
                let one = |&point: &[f64; 2]| before.iter().copied().chain([point]).collect();
                candidates[k].grid.iter().map(one).collect::<Vec<_>>()
            };
            points = points.iter().flat_map(with).collect();
        }
        let choice = |points| Choice::at(noise, steps, candidates, (which, points));
        Tables {
            choices: points.into_par_iter().map(choice).collect(),
        }
    }

    /// The choice that leaves least in all folds but one.
    fn best(&self, but: Option<usize>) -> (&Choice, Fitted) {
        let fits = self.choices.iter().map(|choice| (choice, choice.fit(but)));
        fits.min_by(|a, b| a.1.square.total_cmp(&b.1.square))
            .expect("every grid has a point")
    }
}

/// The finding, of all blocks together.
fn found(
    steps: &Steps,
    candidates: &[Candidate],
    turns: Turns,
    lacking: Vec<String>,
) -> SidewaysFinding {
    let noise = Noise::of(steps, candidates);
    let which = turns.which();
    let after = noise.held_out(steps, candidates, &which);
    let tables = Tables::new(&noise, steps, candidates, &which);
    let (choice, fitted) = tables.best(None);
    let (points, columns) = (&choice.points, &choice.columns);
    let errors = fitted.standard_errors(&noise, steps, columns);
    let mut parameters = columns.iter().zip(fitted.values.iter().zip(errors));
    let name = |k: &usize| candidates[*k].name.to_owned();
    let mut effects = Vec::new();
    for ((k, gain, tied), point) in turns.taken.iter().zip(points) {
        let candidate = &candidates[*k];
        let own = (candidate.columns)(steps, *point).len();
        let parameter = |(column, (value, error)): (&Regressor, (&f64, f64))| SidewaysParameter {
            name: column.name.clone(),
            value: *value,
            unit: column.unit.to_owned(),
            standard_error: Some(error),
        };
        let mut all: Vec<SidewaysParameter> =
            parameters.by_ref().take(own).map(parameter).collect();
        all.extend((candidate.told)(*point));
        effects.push(SidewaysEffect {
            name: candidate.name.to_owned(),
            description: candidate.description.to_owned(),
            gain: gain.total,
            gain_error: gain.standard_error,
            // What was taken as well is no alternative.
            alternatives: tied
                .iter()
                .filter(|k| !which.contains(k))
                .map(name)
                .collect(),
            parameters: all,
        });
    }
    let rms = |of: &dyn Fn(usize) -> Vector2<f64>| {
        let judged: Vec<usize> = (0..steps.all.len())
            .filter(|&at| steps.all[at].is_judged)
            .collect();
        let square: f64 = judged.iter().map(|&at| of(at).norm_squared()).sum();
        (square / judged.len().max(1) as f64).sqrt()
    };
    let next = turns.next.iter();
    SidewaysFinding {
        samples: steps.all.iter().filter(|step| step.is_judged).count(),
        flights: steps.flights.len(),
        blocks: steps.blocks,
        rms_recorded_mps2: rms(&|at| steps.all[at].recorded_mps2),
        rms_before_mps2: rms(&|at| steps.all[at].left_mps2()),
        rms_after_mps2: rms(&|at| after[at]),
        noise_mps2: noise_mps2(steps, &after),
        not_taken: next
            .map(|(k, gain)| (name(k), gain.total, gain.standard_error))
            .collect(),
        effects,
        lacking,
    }
}

/// Root mean square of half of the differences over half a second of what is left.
fn noise_mps2(steps: &Steps, left: &[Vector2<f64>]) -> f64 {
    let apart = (NOISE_OVER_S * RATE_HZ) as usize;
    // Steps since the last gap.
    let mut since = 0;
    let (mut square, mut pairs) = (0.0, 0.0);
    for (at, step) in steps.all.iter().enumerate() {
        since = if step.follows { since + 1 } else { 0 };
        if since >= apart {
            square += 0.5 * (left[at] - left[at - apart]).norm_squared();
            pairs += 1.0;
        }
    }
    (square / f64::max(pairs, 1.0)).sqrt()
}

/// Whether a swing does so at its own frequency (rad/s) rather than follow what drives it.
fn is_resonant(steps: &Steps, swing: Option<&Regressor>, radps: f64) -> bool {
    let Some(swing) = swing else {
        return false;
    };
    let (mut slopes, mut squares) = (0.0, 0.0);
    for at in 1..swing.values.len() {
        if steps.all[swing.from + at].follows {
            let slope = (swing.values[at] - swing.values[at - 1]) * RATE_HZ;
            slopes += slope.norm_squared();
            squares += swing.values[at].norm_squared();
        }
    }
    slopes >= LEAST_RESONANCE * radps * radps * squares
}

/// Every vehicle that cannot be judged, and by which columns.
fn lacking(recordings: &[Recording]) -> Vec<String> {
    let mut lacking = Vec::new();
    for recording in recordings {
        for vehicle in &recording.vehicles {
            let mut missing = vehicle.track.missing_for_a_force();
            if vehicle.track.force_n.is_none() && !vehicle.track.attitude_is_logged {
                missing.push("an attitude (qx qy qz qw, or roll, pitch, yaw)");
            }
            if !missing.is_empty() {
                let missing = missing.join(" and ");
                lacking.push(format!(
                    "`{}` of {} lacks {missing}",
                    vehicle.id, recording.name
                ));
            }
        }
    }
    lacking
}

impl Candidate {
    /// Whether a point of its grid is none of those that stand for something else.
    fn is_inside(&self, [radps, damping]: [f64; 2]) -> bool {
        let is_end = |ends: &[f64]| ends.first() == Some(&radps) || ends.last() == Some(&radps);
        self.name != SWING || !(is_end(&SWINGS_RADPS) || DAMPINGS.last() == Some(&damping))
    }
}

impl SidewaysSample {
    fn left_mps2(&self) -> Vector2<f64> {
        self.recorded_mps2 - self.baseline_mps2
    }
}

/// Equal steps of every vehicle that logs what it takes.
fn steps(recordings: &[Recording], options: &CampaignOptions) -> Result<Steps, CampaignError> {
    let is_judged = |index: usize| options.judge.is_empty() || options.judge.contains(&index);
    let (by_name, fold_of) = deal(recordings, FOLDS);
    let traces = Trace::of_all(recordings, &by_name, 0.0, LOW_PASS);
    let identify = identify::Options {
        low_pass: LOW_PASS,
        ..identify::Options::default()
    };
    let held: Vec<Option<usize>> = fold_of.iter().map(|&fold| Some(fold)).collect();
    let maps = fold_maps(&traces, &held, &identify).map_err(|failed| failed.error)?;
    let mut vehicles: Vec<String> = traces.iter().map(|trace| trace.of.id.clone()).collect();
    vehicles.sort();
    vehicles.dedup();
    let usable = |trace: &&Trace| {
        let has_attitude = trace.of.track.attitude_is_logged;
        is_judged(trace.recording) && (has_attitude || trace.source == ThrustSource::ReadyForce)
    };
    let used: Vec<&Trace> = traces.iter().filter(usable).collect();
    let of_trace = |trace: &&Trace| -> Vec<SidewaysSample> {
        let map = FoldMap::of(&maps, fold_of[trace.recording], trace.of);
        let vehicle = vehicles.binary_search(&trace.of.id).unwrap_or(0);
        trace.thrust_n(map).map_or(Vec::new(), |upright_n| {
            of_vehicle(recordings, options, trace, &upright_n, vehicle)
        })
    };
    let parts: Vec<Vec<SidewaysSample>> = used.par_iter().map(of_trace).collect();
    let mut flights: Vec<usize> = used.iter().map(|trace| trace.recording).collect();
    flights.dedup();
    // Blocks of one flight are the same for all of its vehicles.
    let total: usize = parts.iter().map(Vec::len).sum();
    let stride = total.div_ceil(MOST_STEPS).max(1);
    let mut all: Vec<SidewaysSample> = Vec::new();
    let mut blocks: Vec<(usize, usize)> = Vec::new();
    for part in parts {
        let mut was_kept = false;
        for mut step in part {
            let window = (step.t_s / BLOCK_S).floor().max(0.0) as usize;
            let is_kept = (window + step.flight).is_multiple_of(stride);
            if !is_kept {
                was_kept = false;
                continue;
            }
            let key = (step.flight, window);
            step.block = blocks.iter().position(|of| *of == key).unwrap_or_else(|| {
                blocks.push(key);
                blocks.len() - 1
            });
            step.follows &= was_kept;
            step.is_judged = step.t_s - BLOCK_S * window as f64 > FORGETS_S;
            step.flight = flights
                .iter()
                .position(|of| *of == step.flight)
                .unwrap_or(0);
            was_kept = true;
            all.push(step);
        }
    }
    let names = flights.iter().map(|&of| recordings[of].name.clone());
    Ok(Steps {
        all,
        flights: names.collect(),
        vehicles,
        blocks: blocks.len(),
    })
}

/// The steps of one vehicle in one flight; `upright_n`: the vertical part of its thrust.
fn of_vehicle(
    recordings: &[Recording],
    options: &CampaignOptions,
    trace: &Trace,
    upright_n: &[f64],
    vehicle: usize,
) -> Vec<SidewaysSample> {
    let recording = &recordings[trace.recording];
    let (track, airframe) = (&trace.of.track, &trace.of.airframe);
    let (mass_kg, rows) = (airframe.mass_kg(), track.t_s.len());
    // One clock for all vehicles of a flight.
    let firsts = recording
        .vehicles
        .iter()
        .filter_map(|it| it.track.t_s.first());
    let begins_s = firsts.copied().fold(f64::INFINITY, f64::min);
    let axis = |row: usize| track.attitude[row] * Vector3::z();
    let thrust_mps2 = |row: usize| upright_n[row] / axis(row).z / mass_kg;
    let is_ready = trace.source == ThrustSource::ReadyForce;
    let ready_n = track.force_n.as_ref().filter(|_| is_ready);
    let recorded = |row: usize| match (ready_n, &track.specific_force_mps2) {
        (Some(force_n), _) => force_n[row].xy() / mass_kg,
        (None, Some(felt)) => felt[row].xy() - axis(row).xy() * thrust_mps2(row),
        (None, None) => Vector2::repeat(f64::NAN),
    };
    let recorded: Vec<Vector2<f64>> = (0..rows).map(recorded).collect();
    let thrust: Vec<f64> = (0..rows).map(thrust_mps2).collect();
    let usable = |row: usize| {
        (recorded[row].sum() + thrust[row] + track.velocity_mps[row].sum()).is_finite()
            && trace.around[row] != Around::Unknown
    };
    let flow = Flow::new(recording);
    let discs = airframe.disc_points();
    let hover_mps = recording.hover_mps(trace.of);
    let law = recording.baseline.receiver_law;
    let has_wakes = !options.alone && recording.baseline.wakes;
    let mut steps = Vec::new();
    for run in low_pass::runs(&track.t_s, track.longest_step_s, usable) {
        let t_s = &track.t_s[run.clone()];
        let smooth = |values: &dyn Fn(usize) -> f64| {
            let mut values: Vec<f64> = run.clone().map(values).collect();
            LOW_PASS.smooth(t_s, &mut values);
            values
        };
        let [force_x, force_y] = [0, 1].map(|axis| smooth(&|row| recorded[row][axis]));
        let [lean_x, lean_y] = [0, 1].map(|of| smooth(&|row| axis(row)[of] * thrust[row]));
        let mut next_s = f64::NEG_INFINITY;
        let mut follows = false;
        for (at, row) in run.clone().enumerate() {
            let (time_s, position_m) = (t_s[at], flow.places_m(trace.vehicle)[row]);
            // A millisecond: times are decimal fractions.
            if time_s < next_s - 1e-3 {
                continue;
            }
            next_s = time_s.max(next_s) + 1.0 / RATE_HZ;
            let near = above(recording, trace.vehicle, (time_s, position_m));
            let near = near.filter(|_| has_wakes).unwrap_or_default();
            let counts = |vehicle| near.iter().any(|above| above.vehicle == vehicle);
            let met = || {
                flow.met_mps(
                    recording.baseline.receiver_air,
                    &discs,
                    (time_s, position_m),
                    counts,
                )
            };
            let air_mps = match near.is_empty() {
                true => 0.0,
                false => met().unwrap_or(0.0),
            };
            let alpha = air_mps / hover_mps;
            let left = match (is_ready, alpha == 0.0) {
                (_, true) => 1.0,
                _ => thrust_ratio(law, alpha),
            };
            let beside = |above: &Above| (position_m - above.position_m).xy();
            let nearest = near.iter().map(beside);
            let nearest = nearest.min_by(|a, b| a.norm().total_cmp(&b.norm()));
            let outward = nearest.and_then(|of| of.try_normalize(1e-9));
            let nose = (track.attitude[row] * Vector3::x()).xy();
            steps.push(SidewaysSample {
                t_s: time_s - begins_s,
                flight: trace.recording,
                vehicle,
                block: 0,
                is_judged: true,
                follows,
                recorded_mps2: Vector2::new(force_x[at], force_y[at]),
                baseline_mps2: Vector2::new(lean_x[at], lean_y[at]) * (left - 1.0),
                velocity_mps: track.velocity_mps[row].xy(),
                drive_mps2: Vector2::new(lean_x[at], lean_y[at]),
                thrust_mps2: thrust[row],
                gravity_mps2: recording.environment.gravity_mps2,
                heading: nose.try_normalize(1e-9).unwrap_or_else(Vector2::x),
                alpha,
                outward: outward.unwrap_or_default(),
            });
            follows = true;
        }
    }
    steps
}

fn candidates(steps: &Steps) -> Vec<Candidate> {
    let none = || vec![NO_GRID];
    let turns = TURNS_IN_S.into_iter();
    let turns = turns.flat_map(|s| [1.0, -1.0].map(|way| [way * std::f64::consts::TAU / s, 0.0]));
    let swings = SWINGS_RADPS.into_iter();
    let swings = swings.flat_map(|radps| DAMPINGS.map(|damping| [radps, damping]));
    let mut all = vec![
        Candidate {
            name: "sensor_gain",
            description: "the thrust sideways, or the tilt, is logged too large or too small by one factor",
            grid: none(),
            columns: |steps, _| vec![Regressor::new("g", "1", steps, |of| of.drive_mps2)],
            is_positive: false,
            told: |_| Vec::new(),
        },
        Candidate {
            name: "sensor_lag",
            description: "the attitude is logged later (or, below 0, earlier) than the acceleration",
            grid: none(),
            columns: |steps, _| {
                // Over the steps on either side, so that the slope is that of this moment.
                let change = |at: usize| match steps.all.get(at + 1) {
                    Some(next) if next.follows && steps.all[at].follows => {
                        (next.drive_mps2 - steps.all[at - 1].drive_mps2) * (0.5 * RATE_HZ)
                    }
                    _ => Vector2::zeros(),
                };
                vec![Regressor {
                    name: "tau".to_owned(),
                    unit: "s",
                    from: 0,
                    values: (0..steps.all.len()).map(change).collect(),
                }]
            },
            is_positive: false,
            told: |_| Vec::new(),
        },
        Candidate {
            name: "rotor_drag",
            description: "the drone's own motion through the air drags on its rotors and frame",
            grid: none(),
            columns: |steps, _| {
                let drag =
                    |of: &SidewaysSample| -of.velocity_mps * (of.thrust_mps2 / of.gravity_mps2);
                vec![Regressor::new("k", "1/s", steps, drag)]
            },
            is_positive: true,
            told: |_| Vec::new(),
        },
        Candidate {
            name: "wind",
            description: "one force over all of a flight, fixed in the world, as a wind exerts it; or the world's z is not upright by as much",
            grid: none(),
            columns: |steps, _| of_flights(steps, 0.0),
            is_positive: false,
            told: |_| Vec::new(),
        },
        Candidate {
            name: "wind_turning",
            description: "a force that turns slowly in the world, as a wind does that changes its direction",
            grid: turns.collect(),
            columns: |steps, [radps, _]| of_flights(steps, radps),
            is_positive: false,
            told: |[radps, _]| vec![SidewaysParameter::looked_for("turns", radps, "rad/s")],
        },
        Candidate {
            name: "thrust_misalignment",
            description: "the thrust, or the frame in which the attitude is logged, leans off the body's axis; or the zero of the accelerometer is off, which looks the same",
            grid: none(),
            columns: of_bodies,
            is_positive: false,
            told: |_| Vec::new(),
        },
        Candidate {
            name: SWING,
            description: "a payload on a cord swings and pulls at its drone",
            grid: swings.collect(),
            columns: |steps, [radps, damping]| {
                let swing = swing(steps, radps, damping);
                vec![Regressor {
                    name: "share of the mass".to_owned(),
                    unit: "1",
                    from: 0,
                    values: swing,
                }]
            },
            is_positive: true,
            told: |[radps, damping]| {
                vec![
                    SidewaysParameter::looked_for("omega", radps, "rad/s"),
                    SidewaysParameter::looked_for("damping", damping, "1"),
                ]
            },
        },
    ];
    if steps.all.iter().any(|step| step.alpha > 0.0) {
        all.push(Candidate {
            name: "entrainment_radial",
            description: "air that the wake above draws in pushes towards its axis",
            grid: none(),
            columns: |steps, _| {
                let inward = |of: &SidewaysSample| -of.outward * (of.alpha * of.thrust_mps2);
                vec![Regressor::new("c", "1", steps, inward)]
            },
            is_positive: true,
            told: |_| Vec::new(),
        });
    }
    all
}

impl SidewaysParameter {
    fn looked_for(name: &str, value: f64, unit: &str) -> SidewaysParameter {
        SidewaysParameter {
            name: name.to_owned(),
            value,
            unit: unit.to_owned(),
            standard_error: None,
        }
    }
}

impl Regressor {
    fn new(
        name: &str,
        unit: &'static str,
        steps: &Steps,
        value: impl Fn(&SidewaysSample) -> Vector2<f64>,
    ) -> Regressor {
        Regressor {
            name: name.to_owned(),
            unit,
            from: 0,
            values: steps.all.iter().map(value).collect(),
        }
    }
}

/// A vector of each flight, which turns at a rate.
fn of_flights(steps: &Steps, radps: f64) -> Vec<Regressor> {
    let of_flight = |(flight, name): (usize, &String)| {
        // Flights follow one another.
        let [from, end] = [flight, flight + 1]
            .map(|flight| steps.all.partition_point(|step| step.flight < flight));
        let quarter = std::f64::consts::FRAC_PI_2;
        [("x", 0.0), ("y", quarter)].map(|(letter, quarter)| {
            let axis = |of: &SidewaysSample| {
                let (sine, cosine) = (radps * of.t_s + quarter).sin_cos();
                Vector2::new(cosine, sine)
            };
            Regressor {
                name: format!("{letter} in {name}"),
                unit: "m/s2",
                from,
                values: steps.all[from..end].iter().map(axis).collect(),
            }
        })
    };
    let flights = steps.flights.iter().enumerate();
    flights.flat_map(of_flight).collect()
}

/// Two angles of each vehicle, of its thrust forward and to the left.
fn of_bodies(steps: &Steps, _: [f64; 2]) -> Vec<Regressor> {
    let of_vehicle = |(vehicle, id): (usize, &String)| {
        [("forward", false), ("left", true)].map(|(word, is_left)| {
            let name = format!("{word} of {id}");
            Regressor::new(&name, "rad", steps, |of| {
                let ahead = of.heading;
                let along = if is_left {
                    Vector2::new(-ahead.y, ahead.x)
                } else {
                    ahead
                };
                along * (of.thrust_mps2 * f64::from(u8::from(of.vehicle == vehicle)))
            })
        })
    };
    let vehicles = steps.vehicles.iter().enumerate();
    vehicles.flat_map(of_vehicle).collect()
}

/// `g θ` of a payload, at rest where a stretch begins.
fn swing(steps: &Steps, radps: f64, damping: f64) -> Vec<Vector2<f64>> {
    let step_s = 1.0 / (RATE_HZ * FINER as f64);
    let (mut at, mut slope) = (Vector2::zeros(), Vector2::zeros());
    let one = |index: usize| {
        let step = &steps.all[index];
        if !step.follows {
            (at, slope) = (Vector2::zeros(), Vector2::zeros());
            return at;
        }
        let (from, to) = (steps.all[index - 1].drive_mps2, step.drive_mps2);
        for fine in 0..FINER {
            let driven = from.lerp(&to, (fine as f64 + 0.5) / FINER as f64);
            let pull = -(driven + at) * (radps * radps) - slope * (2.0 * damping * radps);
            slope += pull * step_s;
            at += slope * step_s;
        }
        at
    };
    (0..steps.all.len()).map(one).collect()
}

#[cfg(test)]
mod tests;
