//! From the flights of a campaign to what their simulation leaves out.

use serde::Serialize;

use super::forces::{COORDINATES, CampaignOptions, Forces, PLACES, PLACES_OF_LAWS, RATE_HZ};
use super::forward::{Chosen, Turn, forward};
use super::library::library;
use super::scatter::{Scatter, scatter};
use super::skill::{Curve, Judged, Skill};
use crate::forward::hypothesis::Hypothesis;
use crate::forward::observed::Explained;
use crate::forward::simulate::{Channel, Sample};
use crate::infer::advice::narrowing;
use crate::infer::candidates::{Candidate, Kind};
use crate::infer::diagnose::{NEARLY_ALL, departing, detectable, effects, ranked};
use crate::infer::finding::{Finding, HeldOut, Region, verdict};
use crate::infer::fit::Setting;
use crate::infer::noticed::RemarkOf;
use crate::infer::outside::{
    Remains, global_test, is_beyond_doubt, is_steady, is_sure, outside, standing,
};
use crate::infer::select::{Tried, flexible, singles};
use crate::record::recording::Recording;
use crate::record::remark::{Remark, RemarkKind};
use crate::statistics::held_out::{FOLDS, Gain};
use crate::statistics::quantile::root_mean_square;
use crate::statistics::scan;
use crate::thrust::free_flight::ABOVE_FLOOR_M;
use crate::thrust::identify::IdentifyError;

/// Offset (N) that all flights together may have without a fault: 0.2 g.
const TOLERANCE_N: f64 = 0.002;

/// Most vehicles of which a message says what they lack. Chosen here: a look at them all.
const MOST_LISTED: usize = 5;

/// Most effects named. Chosen here: beyond four, terms mend the form of others.
const MOST_EFFECTS: usize = 4;

/// Why a campaign cannot be diagnosed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CampaignError {
    /// A thrust map is needed and cannot be had.
    #[error("no thrust map: {0}")]
    ThrustMap(#[from] IdentifyError),
    /// Nothing to compare: what some vehicles lack, in words.
    #[error("no force in any flight{}", missing(.0))]
    NoForce(Vec<String>),
    /// None is near the floor.
    #[error("no flight is lower than {ABOVE_FLOOR_M} m above the floor for half of its time")]
    NoneLow,
    /// Too little flight to hold blocks of it out.
    #[error("{0} blocks of 15 s; at least {1} are needed, for whole blocks are held out")]
    TooShort(usize, usize),
    /// Too few flights to hold any out.
    #[error("{0} flights; at least {FOLDS} are needed, for whole flights are held out")]
    TooFew(usize),
}

/// Behind the statement that there is no force.
fn missing(missing: &[String]) -> String {
    match missing {
        [] => "; the drones' places, or the time in the air, are missing".to_owned(),
        several => format!(": {}", several.join("; ")),
    }
}

impl CampaignError {
    /// Says what the vehicles lack.
    #[must_use]
    pub fn no_force(recordings: &[Recording]) -> CampaignError {
        let lacking = recordings.iter().flat_map(lacking);
        CampaignError::NoForce(lacking.take(MOST_LISTED).collect())
    }
}

/// The columns that a force needs and that vehicles of a recording lack, in words, a vehicle each.
#[must_use]
pub fn lacking(recording: &Recording) -> Vec<String> {
    let words = |id: &str, missing| format!("`{id}` of {} lacks {missing}", recording.name);
    missing_in(recording, words)
}

/// Removes flight logs that yield no force from recordings where others yield one; a remark on each
/// says what it lacks.
#[must_use]
pub fn take_forceless(recordings: &mut Vec<Recording>) -> Vec<RemarkOf> {
    if !recordings.iter().any(Recording::is_of_a_force) {
        return Vec::new();
    }
    let is_forceless = |one: &mut Recording| one.is_flight_log() && !one.is_of_a_force();
    let taken = recordings.extract_if(.., is_forceless);
    let remark = |one: Recording| {
        let lacks = missing_in(&one, |id, missing| format!("`{id}` lacks {missing}"));
        let message = format!(
            "is left out: no force can be told from it: {}",
            lacks.join("; ")
        );
        RemarkOf::new(&one, &Remark::new(RemarkKind::Unused, None, message))
    };
    taken.map(remark).collect()
}

/// Of each vehicle that lacks something for a force: words of its id and what that is.
fn missing_in(recording: &Recording, words: impl Fn(&str, String) -> String) -> Vec<String> {
    let lacks = recording.vehicles.iter().filter_map(|vehicle| {
        let missing = vehicle.track.missing_for_a_force().join(" and ");
        (!missing.is_empty()).then(|| words(&vehicle.id, missing))
    });
    lacks.collect()
}

/// A finding over several flights.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CampaignFinding {
    /// As of one recording; rows are counted along the judged rows, blocks are flights.
    #[serde(skip)]
    pub finding: Finding,
    /// Flights judged.
    pub flights: usize,
    /// The terms in the order in which they were taken.
    pub taken: Vec<Taken>,
    /// What would have come next and does not gain enough: its name, its gain over what was taken,
    /// and the standard error of that.
    pub next: Option<(String, f64, f64)>,
    /// The judged rows as simulated.
    #[serde(skip)]
    pub samples: Vec<Sample>,
    /// Index of the recording that each row is of.
    #[serde(skip)]
    pub recording_of: Vec<usize>,
    /// What each scatters by (N).
    #[serde(skip)]
    pub noise_n: Vec<f64>,
    /// What surrounds each row: one column for each of [`super::COORDINATES`].
    #[serde(skip)]
    pub columns: Vec<Vec<f64>>,
    /// How well the force is predicted in flights that were not fitted, by where the rows lie.
    pub skills: Vec<Skill>,
    /// Mean force by depth below another drone or by height: recorded, before and after.
    pub curves: Vec<Curve>,
    /// The box in which the residual leaves the noise most, found without any candidate.
    pub located: Option<Located>,
    /// Held-out gain of any function of the coordinates (boosted trees) before, and on what is
    /// left.
    pub flexible_gain: [f64; 2],
    /// Its standard error over flights, on what is left.
    pub flexible_gain_error: f64,
    /// What flights differ by (N).
    pub offset_n: f64,
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
    /// `R²` under another drone, or of all rows where none is, in flights that were not fitted:
    /// what it gains over what stood before, with its 95 % interval over flights. Lower end, value,
    /// upper end.
    pub r2_gained: Option<[f64; 3]>,
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
    /// p-value: how often as much is found anywhere with the signs of whole flights flipped.
    pub p: f64,
}

/// Recordings that fly near the floor: more than half of their entries lower than 0.35 m above it,
/// from where on thrust maps are identified.
///
/// # Errors
/// None does.
pub fn near_floor(recordings: &[Recording]) -> Result<Vec<usize>, CampaignError> {
    let is_low = |recording: &Recording| {
        let Some(floor_z_m) = recording.environment.floor_z_m else {
            return false;
        };
        let tracks = recording.vehicles.iter().map(|vehicle| &vehicle.track);
        let positions_m: Vec<_> = tracks.flat_map(|track| &track.position_m).collect();
        let low = positions_m
            .iter()
            .filter(|p| p.z - floor_z_m < ABOVE_FLOOR_M);
        2 * low.count() > positions_m.len()
    };
    let all = 0..recordings.len();
    let low: Vec<usize> = all.filter(|&index| is_low(&recordings[index])).collect();
    match low.is_empty() {
        true => Err(CampaignError::NoneLow),
        false => Ok(low),
    }
}

/// Diagnoses the vertical forces of several flights together.
///
/// Thrust maps first, each from flights that it is not used on; then the noise; then one effect
/// after another, judged on whole flights that were not fitted; then where, how well, and how
/// surely.
///
/// # Errors
/// No force, no thrust map, or too few flights.
pub fn diagnose_campaign(
    recordings: &[Recording],
    options: &CampaignOptions,
) -> Result<CampaignFinding, CampaignError> {
    let forces = Forces::new(recordings, options)?;
    if forces.rows == 0 {
        return Err(CampaignError::no_force(recordings));
    }
    let base = Hypothesis::default();
    let scatter = scatter(&forces, &forces.at_every_moment(&base), 1.0 / RATE_HZ);
    let flights = scatter.noise.blocks.count();
    if flights < FOLDS {
        return Err(CampaignError::TooFew(flights));
    }
    let candidates = library(&forces, forces.alone);
    let tolerances = [1e-6, TOLERANCE_N];
    let mut setting = Setting::within(&forces, &scatter.noise, &candidates, tolerances);
    setting.base = base;
    let columns = forces.covariates().columns;
    let most_n = scatter.most_offset_n();
    let skill_over = |before: &Tried, after: &Tried| {
        let held_out =
            |tried: &Tried| setting.predicted_held_out(&tried.members(&candidates), &tried.fit);
        let both = [before, after].map(held_out);
        Judged::new(&forces, columns, &both, most_n)
    };
    let is_no_worse = |before: &Tried, after: &Tried| {
        let skill = skill_over(before, after);
        skill.r2_gained().is_none_or(|[_, _, high]| high >= 0.0) && !skill.is_worse_in_all()
    };
    let mut chosen = forward(&setting, singles(&setting), MOST_EFFECTS, is_no_worse);
    let test = global_test(&setting, &chosen.selection.nothing.fit);
    let gain = &chosen.selection.chosen.gain;
    if !test.is_significant && !is_beyond_doubt(gain) && !is_steady(gain) {
        chosen.withdraw();
    }
    let best = &chosen.selection.chosen;
    let members = best.members(&candidates);
    let correction = setting.explanation(best);
    let simulated = forces.predict(&base);
    let mut corrected = forces.predict(&correction);
    let mut held_out = [
        setting.predicted_held_out(&[], &chosen.selection.nothing.fit),
        setting.predicted_held_out(&members, &best.fit),
    ];
    let of_rest = flexible(&setting, &best.fit);
    let shape = outside(&setting, &chosen.selection, &test, &of_rest, false);
    let shape = shape.and_then(|shape| standing(&setting, &chosen.selection, shape));
    if let Some(shape) = shape.as_ref().filter(|_| members.is_empty()) {
        // Without a name there is nothing else to show; beside names their own figures stand.
        for predicted in [&mut corrected, &mut held_out[1]] {
            let both = predicted.iter_mut().zip(&shape.correction);
            both.for_each(|(f, more)| *f += more);
        }
    }
    let judged = Judged::new(&forces, columns, &held_out, most_n);
    let held_out_of = |skill: &Skill| HeldOut {
        rms_before: skill.rms_before_n,
        rms_after: skill.rms_after_n[1],
        rms_after_low: skill.rms_after_n[0],
        rms_after_high: skill.rms_after_n[2],
        noise_floor: root_mean_square(scatter.noise.sd()).min(skill.rms_after_n[1]),
        ..HeldOut::default()
    };
    let skills = judged.skills();
    let turns = chosen.turns.iter().map(|turn| &turn.with);
    let stood = std::iter::once(&chosen.selection.nothing).chain(turns.clone());
    let r2_gained = stood
        .zip(turns)
        .map(|(before, after)| skill_over(before, after).r2_gained());
    let sensors_first = |turn: &Turn| {
        let mut alternatives = turn.alternatives.clone();
        alternatives.sort_by_key(|&k| candidates[k].kind == Kind::Physics);
        alternatives
    };
    let alternatives = chosen.turns.iter().map(sensors_first);
    let effects = effects(&setting, best, alternatives);
    let recorded = forces.recorded();
    let before = flexible(&setting, &chosen.selection.nothing.fit).gain;
    let left = &of_rest.gain;
    let remains = Remains {
        gain: left.total,
        gain_error: left.standard_error,
        is_sure: is_sure(left),
        rms: root_mean_square(&of_rest.predictions),
        ..Remains::default()
    };
    let next = match &shape {
        Some(shape) => narrowing(shape),
        None => advice(&candidates, &chosen),
    };
    let finding = Finding {
        recording: format!("{flights} flights"),
        channel: Channel::VerticalForce,
        samples: forces.rows,
        fitted_every: 1,
        withdrawn: None,
        verdict: verdict(shape.is_some(), &effects),
        region: {
            // No law knows the room.
            let places = if members.is_empty() {
                PLACES
            } else {
                PLACES_OF_LAWS
            };
            region(
                &columns[..places],
                &scatter,
                &recorded,
                &simulated,
                &corrected,
            )
        },
        errors_follow: false,
        held_out: skills.first().map_or_else(HeldOut::default, held_out_of),
        // Before a wake is taken, what changes jets changes nothing.
        candidates: ranked(&candidates, &chosen.selection)
            .into_iter()
            .filter(|ranked| ranked.gain_error > 0.0)
            .collect(),
        shape,
        remains,
        p: test.p,
        runner_up: None,
        advice: next,
        detectable: detectable(&setting),
        effects,
        prediction: corrected,
        correction,
    };
    let turns = chosen.turns.iter();
    let next = chosen.next.as_ref();
    Ok(CampaignFinding {
        flights,
        taken: turns
            .zip(r2_gained)
            .map(|(turn, r2_gained)| taken(&candidates, turn, r2_gained))
            .collect(),
        samples: forces.samples(&simulated),
        recording_of: forces.judged().map(|(part, _)| part.recording).collect(),
        noise_n: scatter.noise.sd().to_vec(),
        columns: columns.to_vec(),
        next: next.map(|of| with_gain(&candidates, of)),
        curves: judged.curves(),
        located: located(columns, &scatter, &judged.rest_n()),
        flexible_gain: [before.total, left.total],
        flexible_gain_error: left.standard_error,
        offset_n: scatter.offset_n,
        skills,
        finding,
    })
}

/// Name, gain and standard error of a candidate.
fn with_gain(candidates: &[Candidate], (k, gain): &(usize, Gain)) -> (String, f64, f64) {
    let name = candidates[*k].name.to_owned();
    (name, gain.total, gain.standard_error)
}

fn taken(candidates: &[Candidate], turn: &Turn, r2_gained: Option<[f64; 3]>) -> Taken {
    let name = |k: &usize| candidates[*k].name.to_owned();
    let is_rival = |(k, gain): &&(usize, Gain)| *k != turn.which && gain.standard_error > 0.0;
    let rivals = turn.fitted.iter().filter(is_rival);
    Taken {
        name: name(&turn.which),
        gain: turn.gain.total,
        gain_error: turn.gain.standard_error,
        r2_gained,
        alternatives: turn.alternatives.iter().map(name).collect(),
        rivals: rivals.map(|of| with_gain(candidates, of)).collect(),
    }
}

/// Where the corrected simulation differs from the baseline by more than half a standard deviation.
fn region(
    columns: &[Vec<f64>],
    scatter: &Scatter,
    recorded: &[f64],
    simulated: &[f64],
    corrected: &[f64],
) -> Region {
    let inside = departing(simulated, corrected, scatter.noise.sd());
    if inside.is_empty() {
        return Region::default();
    }
    let mut marked = vec![false; corrected.len()];
    inside.iter().for_each(|&i| marked[i] = true);
    let mut region = Region::of(&inside, recorded, simulated, scatter.noise.sd());
    for interval in scan::describe(columns, &marked) {
        let name = COORDINATES[interval.coordinate].0.to_owned();
        region.bounds.insert(name, [interval.from, interval.to]);
    }
    let bounds = region.bounds.iter();
    region.description = match (region.bounds.is_empty(), region.share < NEARLY_ALL) {
        (true, false) => "everywhere".into(),
        (true, true) => "scattered over all that was flown".into(),
        (false, _) => words(bounds.map(|(name, ends)| (name.as_str(), *ends))),
    };
    region.sample_indices = inside;
    region
}

fn words<'n>(ends: impl Iterator<Item = (&'n str, [f64; 2])>) -> String {
    let words: Vec<String> = ends
        .map(|(name, [from, to])| format!("{name} {from:.2} to {to:.2}"))
        .collect();
    words.join(", ")
}

/// The box in which whole flights agree most that something is missing.
fn located(columns: &[Vec<f64>], scatter: &Scatter, rest: &[f64]) -> Option<Located> {
    let white = scatter.noise.whiten(rest);
    let found = scan::scan(&columns[..PLACES], &white, rest, &scatter.noise.blocks, 1)?;
    let ends = found.intervals.iter();
    Some(Located {
        description: words(ends.map(|i| (COORDINATES[i.coordinate].0, [i.from, i.to]))),
        share: found.share,
        mean_error_n: found.mean_error,
        z: found.z,
        p: found.p,
    })
}

/// Measurements that would part what these flights cannot.
fn advice(candidates: &[Candidate], chosen: &Chosen) -> Vec<String> {
    let turns = chosen.turns.iter();
    let ambiguous = turns.filter(|turn| !turn.alternatives.is_empty());
    let advice = ambiguous.map(|turn| {
        let others: Vec<&str> = turn.alternatives.iter().map(|&k| candidates[k].name).collect();
        format!(
            "these flights cannot tell {} from {}: hover for 10 s each at 3, 6 and 12 motor distances below a hovering drone, on its axis and 0.1 m beside it, and log the upper drone's throttle",
            candidates[turn.which].name,
            others.join(", ")
        )
    });
    let mut advice: Vec<String> = advice.collect();
    if advice.is_empty() && !chosen.turns.is_empty() {
        advice.push(
            "the same flights on another day, and judge what is named by them: it must predict them better, too".into(),
        );
    }
    advice
}

#[cfg(test)]
mod tests;
