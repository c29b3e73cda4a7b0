//! From the flights of a campaign to what their simulation leaves out.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use serde::Serialize;

use super::covariates::{COORDINATES, PLACES, covariates};
use super::forces::Forces;
use super::forward::{Chosen, forward};
use super::library::library;
use super::options::CampaignOptions;
use super::scatter::{Scatter, scatter};
use super::skill::{Curve, Skill, curves, skills};
use crate::candidates::{Candidate, Kind};
use crate::finding::{Effect, Estimate, Finding, HeldOut, Ranked, Region, Smallest};
use crate::fit::{Setting, refit_without};
use crate::hypothesis::Hypothesis;
use crate::identify::IdentifyError;
use crate::intervals;
use crate::observed::Explained;
use crate::prove::Verdict;
use crate::recording::Recording;
use crate::simulate::Channel;
use crate::statistics::noise::{NoiseModel, Whitener};
use crate::statistics::scan::{self, Coordinate};
use crate::statistics::sequence::{Blocks, Sequence};
use crate::statistics::trees;

/// Offset (N) that all flights together may have without anybody's fault: 0.2 g.
const TOLERANCE_N: f64 = 0.002;
/// Height (m) below which a flight counts as near the floor: what thrust maps are identified above.
const LOW_M: f64 = 0.35;

/// Why a campaign cannot be diagnosed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CampaignError {
    /// A thrust map is needed and cannot be had.
    #[error("no thrust map: {0}")]
    ThrustMap(#[from] IdentifyError),
    /// Nothing to compare.
    #[error("no flight logs specific force, attitude, duty cycles and battery voltage")]
    NoForce,
    /// Too few flights to hold any out.
    #[error("{flights} flights; at least {least} are needed, for whole flights are held out")]
    TooFew {
        /// There are.
        flights: usize,
        /// Needed.
        least: usize,
    },
}

/// A finding over several flights.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CampaignFinding {
    /// As of one recording; rows are counted along the judged rows, blocks are flights.
    pub finding: Finding,
    /// Flights judged.
    pub flights: usize,
    /// The terms in the order in which they were taken.
    pub taken: Vec<Taken>,
    /// How well the force is predicted in flights that were not fitted, by where the rows lie.
    pub skills: Vec<Skill>,
    /// Mean force by depth below another drone or by height: recorded, before and after.
    pub curves: Vec<Curve>,
    /// The box in which the residual leaves the noise most, found without any candidate.
    pub located: Option<Located>,
    /// Held-out gain of any function of the coordinates (boosted trees) before, and on what is left.
    pub flexible_gain: [f64; 2],
    /// Its standard error over flights, on what is left.
    pub flexible_gain_error: f64,
    /// Scatter in still air (N), as part of the force, and what flights differ by (N).
    pub scatter: [f64; 3],
}

/// One term that was taken.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Taken {
    /// Canonical name.
    pub name: String,
    /// Gain in held-out log density over what stood before.
    pub gain: f64,
    /// Its standard error over flights.
    pub gain_error: f64,
    /// Names that would have done as well.
    pub alternatives: Vec<String>,
    /// Others that were fitted in its place, with their gains.
    pub rivals: Vec<(String, f64, f64)>,
}

/// Where a residual leaves the noise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Located {
    /// In words.
    pub description: String,
    /// Of all rows.
    pub share: f64,
    /// Mean of recorded minus simulated there (N).
    pub mean_error_n: f64,
    /// Sum of whitened residuals over the root of their number.
    pub z: f64,
    /// Chance of as much anywhere, with the signs of whole flights flipped.
    pub p: f64,
}

/// Recordings that fly near the floor: more than half of their entries lower than 0.35 m above it.
#[must_use]
pub fn near_floor(recordings: &[Recording]) -> Vec<usize> {
    let is_low = |recording: &Recording| {
        let Some(floor_z_m) = recording.environment.floor_z_m else {
            return false;
        };
        let heights = || {
            let tracks = recording.vehicles.iter().map(|vehicle| &vehicle.track);
            tracks.flat_map(|track| track.position_m.iter().map(|p| p.z - floor_z_m))
        };
        2 * heights().filter(|h| *h < LOW_M).count() > heights().count()
    };
    (0..recordings.len())
        .filter(|&index| is_low(&recordings[index]))
        .collect()
}

/// Diagnoses the vertical forces of several flights together.
///
/// Thrust maps first, each from flights that it is not used on; then the noise; then one effect after another, judged on whole flights that were not
/// fitted; then where, how well, and how surely.
///
/// # Errors
/// No force, no thrust map, or too few flights.
pub fn diagnose_campaign(
    recordings: &[Recording],
    options: &CampaignOptions,
) -> Result<CampaignFinding, CampaignError> {
    let forces = Forces::new(recordings, options)?;
    if forces.rows == 0 {
        return Err(CampaignError::NoForce);
    }
    let base = Hypothesis::default();
    let scatter = scatter(&forces, &forces.at_every_step(&base));
    let flights = scatter.noise.blocks;
    if flights < options.folds {
        return Err(CampaignError::TooFew {
            flights,
            least: options.folds,
        });
    }
    let setting = Setting::within(&forces, &scatter.noise, base, [1e-6, TOLERANCE_N]);
    let candidates = library(&forces, forces.is_alone());
    let chosen = forward(&setting, &candidates, options.most_effects);
    let members: Vec<&Candidate> = chosen.best.which.iter().map(|&k| &candidates[k]).collect();
    let correction = setting.hypothesis(&members, &chosen.best.fit.values);
    let simulated = forces.predict(&base);
    let corrected = forces.predict(&correction);
    let columns = covariates(&forces);
    let held_out = [
        predicted_held_out(&setting, &[], &chosen.nothing.fit, options.folds),
        predicted_held_out(&setting, &members, &chosen.best.fit, options.folds),
    ];
    let skills = skills(&forces, &columns, &held_out);
    let effects = effects(&setting, &candidates, &chosen);
    let ambiguous = effects.iter().any(|effect| !effect.alternatives.is_empty());
    let verdict = match (effects.is_empty(), ambiguous) {
        (true, _) => Verdict::None,
        (false, true) => Verdict::Ambiguous,
        (false, false) => Verdict::Library,
    };
    let recorded = forces.recorded();
    let rest = |predicted: &[f64]| -> Vec<f64> {
        recorded.iter().zip(predicted).map(|(y, f)| y - f).collect()
    };
    let flexible = [&simulated, &corrected].map(|predicted| {
        flexible(
            &forces,
            &scatter,
            &columns,
            &rest(predicted),
            &simulated,
            options.folds,
        )
    });
    let everywhere = skills.first();
    let finding = Finding {
        recording: format!("{flights} flights"),
        channel: Channel::VerticalForce,
        samples: forces.rows,
        verdict,
        region: region(&columns, &scatter, &recorded, &simulated, &corrected),
        held_out: everywhere.map_or_else(HeldOut::default, |skill| HeldOut {
            rms_before: skill.rms_before_n,
            rms_after: skill.rms_after_n[1],
            rms_after_low: skill.rms_after_n[0],
            rms_after_high: skill.rms_after_n[2],
            noise_floor: scatter.still_n,
        }),
        candidates: ranked(&candidates, &chosen),
        advice: advice(&candidates, &chosen),
        smallest: smallest(&setting, &candidates),
        effects,
        prediction: corrected.clone(),
        correction,
    };
    Ok(CampaignFinding {
        flights,
        taken: taken(&candidates, &chosen),
        curves: curves(&forces, &columns, &held_out),
        located: located(&columns, &scatter, &rest(&simulated)),
        flexible_gain: [flexible[0].total, flexible[1].total],
        flexible_gain_error: flexible[1].standard_error,
        scatter: [scatter.still_n, scatter.per_force, scatter.offset_n],
        skills,
        finding,
    })
}

/// Predicted force at every judged row by the fit without its flight's fold.
fn predicted_held_out(
    setting: &Setting,
    members: &[&Candidate],
    fit: &crate::fit::Fit,
    folds: usize,
) -> Vec<f64> {
    let mut predicted = fit.predicted.clone();
    for fold in 0..folds {
        let of_fold = refit_without(setting, members, fit, fold, folds);
        for (i, block) in setting.noise.block.iter().enumerate() {
            if block % folds == fold {
                predicted[i] = of_fold[i];
            }
        }
    }
    predicted
}

fn effects(setting: &Setting, candidates: &[Candidate], chosen: &Chosen) -> Vec<Effect> {
    let members: Vec<&Candidate> = chosen.best.which.iter().map(|&k| &candidates[k]).collect();
    let half_widths = intervals::half_widths(&members, &chosen.best.fit, setting.noise);
    let mut place = 0;
    let mut effects = Vec::with_capacity(members.len());
    for (member, turn) in members.iter().zip(&chosen.turns) {
        let values = &chosen.best.fit.values[place..];
        let widths = &half_widths[place..];
        place += member.parameters.len();
        let estimates = member.parameters.iter().zip(values).zip(widths);
        let parameters = estimates.map(|((parameter, &value), half)| {
            let estimate = Estimate {
                value,
                low: (value - half).max(parameter.low),
                high: (value + half).min(parameter.high),
                unit: parameter.unit.into(),
            };
            (parameter.name.to_owned(), estimate)
        });
        let mut alternatives = turn.alternatives.clone();
        // A sensor is printed before physics.
        alternatives.sort_by_key(|&k| candidates[k].kind == Kind::Physics);
        effects.push(Effect {
            name: member.name.into(),
            kind: Some(member.kind),
            alternatives: alternatives
                .iter()
                .map(|&k| candidates[k].name.to_owned())
                .collect(),
            equation: member.equation.into(),
            story: member.story.into(),
            parameters: parameters.collect(),
        });
    }
    effects
}

fn taken(candidates: &[Candidate], chosen: &Chosen) -> Vec<Taken> {
    let name = |k: usize| candidates[k].name.to_owned();
    let of = |turn: &super::forward::Turn| Taken {
        name: name(turn.which),
        gain: turn.gain.total,
        gain_error: turn.gain.error,
        alternatives: turn.alternatives.iter().map(|&k| name(k)).collect(),
        rivals: turn
            .fitted
            .iter()
            .filter(|(k, _)| *k != turn.which)
            .map(|(k, gain)| (name(*k), gain.total, gain.error))
            .collect(),
    };
    chosen.turns.iter().map(of).collect()
}

/// Where the corrected simulation differs from the baseline by more than half a standard deviation.
fn region(
    columns: &[Vec<f64>],
    scatter: &Scatter,
    recorded: &[f64],
    simulated: &[f64],
    corrected: &[f64],
) -> Region {
    let sd = &scatter.noise.sd;
    let marked: Vec<bool> = (0..corrected.len())
        .map(|i| (corrected[i] - simulated[i]).abs() > 0.5 * sd[i])
        .collect();
    let inside: Vec<usize> = (0..marked.len()).filter(|&i| marked[i]).collect();
    if inside.is_empty() {
        return Region::default();
    }
    let mean = |value: &dyn Fn(usize) -> f64| {
        inside.iter().map(|&i| value(i)).sum::<f64>() / inside.len() as f64
    };
    let mean_error = mean(&|i| recorded[i] - simulated[i]);
    let mean_square = mean(&|i| ((recorded[i] - simulated[i]) / sd[i]).powi(2));
    let mut bounds = BTreeMap::new();
    if let Some(description) = scan::describe(&coordinates(&columns[..PLACES]), &marked) {
        for interval in description.intervals {
            let name = COORDINATES[interval.coordinate].to_owned();
            bounds.insert(name, [interval.from, interval.to]);
        }
    }
    Region {
        description: match bounds.is_empty() {
            true => "everywhere".into(),
            false => words(bounds.iter().map(|(name, ends)| (name.as_str(), *ends))),
        },
        bounds,
        share: inside.len() as f64 / marked.len() as f64,
        mean_error,
        relative_error: mean_error / mean(&|i| recorded[i]),
        error_over_noise: mean_square.sqrt(),
        sample_indices: inside,
    }
}

fn coordinates(columns: &[Vec<f64>]) -> Vec<Coordinate<'_>> {
    let columns = columns.iter().map(Vec::as_slice);
    columns
        .map(|values| Coordinate {
            values,
            is_cyclic: false,
        })
        .collect()
}

fn words<'n>(ends: impl Iterator<Item = (&'n str, [f64; 2])>) -> String {
    let words: Vec<String> = ends
        .map(|(name, [from, to])| format!("{name} {from:.2} to {to:.2}"))
        .collect();
    words.join(", ")
}

/// The box in which whole flights agree most that something is missing.
fn located(columns: &[Vec<f64>], scatter: &Scatter, rest: &[f64]) -> Option<Located> {
    let blocks = Blocks {
        of_sample: scatter.noise.block.clone(),
        follows: vec![false; scatter.noise.blocks],
    };
    let white = scatter.noise.whiten(rest);
    let found = scan::scan(&coordinates(&columns[..PLACES]), &white, rest, &blocks, 1)?;
    let ends = found.intervals.iter();
    Some(Located {
        description: words(ends.map(|i| (COORDINATES[i.coordinate], [i.from, i.to]))),
        share: found.share,
        mean_error_n: found.mean_error,
        z: found.z,
        p: found.p,
    })
}

/// What trees explain of a residual in flights that they have not seen.
fn flexible(
    forces: &Forces,
    scatter: &Scatter,
    columns: &[Vec<f64>],
    rest: &[f64],
    simulated: &[f64],
    folds: usize,
) -> crate::statistics::held_out::Gain {
    let t_s: Vec<f64> = forces.judged().map(|(_, step)| step.t_s).collect();
    let lengths = forces.parts.iter().map(|part| part.judged.len());
    let series: Vec<usize> = lengths
        .enumerate()
        .flat_map(|(part, rows)| std::iter::repeat_n(part, rows))
        .collect();
    let sequence = Sequence::new(&t_s, &series);
    let model = NoiseModel {
        s0: scatter.still_n,
        s1: scatter.per_force,
        rho: scatter.memory,
        step_s: 0.1,
    };
    let whitener = Whitener::new(&model, &sequence, simulated);
    let blocks = Blocks {
        of_sample: scatter.noise.block.clone(),
        follows: vec![false; scatter.noise.blocks],
    };
    let x = DMatrix::from_fn(rest.len(), columns.len(), |i, j| columns[j][i]);
    trees::held_out(
        &x,
        rest,
        &whitener,
        &blocks,
        folds,
        trees::Options::default(),
    )
    .gain
}

fn ranked(candidates: &[Candidate], chosen: &Chosen) -> Vec<Ranked> {
    let of = |tried: &crate::select::Tried| {
        let candidate = &candidates[tried.which[0]];
        let names = candidate.parameters.iter().map(|p| p.name.to_owned());
        Ranked {
            name: candidate.name.into(),
            gain: tried.gain.total,
            gain_error: tried.gain.error,
            practical: tried.practical,
            parameters: names.zip(tried.fit.values.iter().copied()).collect(),
        }
    };
    chosen.singles.iter().map(of).collect()
}

/// Measurements that would part what these flights cannot.
fn advice(candidates: &[Candidate], chosen: &Chosen) -> Vec<String> {
    let mut advice = Vec::new();
    for turn in &chosen.turns {
        if turn.alternatives.is_empty() {
            continue;
        }
        let others: Vec<&str> = turn
            .alternatives
            .iter()
            .map(|&k| candidates[k].name)
            .collect();
        advice.push(format!(
            "these flights cannot tell {} from {}: hover for 10 s each at 3, 6 and 12 motor distances below a hovering drone, on its axis and 0.1 m beside it, and log the upper drone's throttle",
            candidates[turn.which].name,
            others.join(", ")
        ));
    }
    advice
}

fn smallest(setting: &Setting, candidates: &[Candidate]) -> Vec<Smallest> {
    let clean = setting.observed.predict(&setting.base);
    let of = |candidate: &Candidate| {
        let parameter = candidate.parameters.first()?;
        let values = candidate.starts.first()?;
        let step = values[0] - parameter.neutral;
        let changed = setting
            .observed
            .predict(&candidate.on(&setting.base, values));
        let change: Vec<f64> = changed
            .iter()
            .zip(&clean)
            .map(|(a, b)| (a - b) / step)
            .collect();
        let square: f64 = setting.noise.whiten(&change).iter().map(|g| g * g).sum();
        (square > 0.0).then(|| Smallest {
            name: candidate.name.into(),
            parameter: parameter.name.into(),
            // 80 % power at 5 %.
            departure: (1.96 + 0.84) / square.sqrt(),
            unit: parameter.unit.into(),
        })
    };
    candidates.iter().filter_map(of).collect()
}
