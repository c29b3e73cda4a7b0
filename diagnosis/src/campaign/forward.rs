//! One effect after another: at each turn the candidate that gains most on flights not fitted, all
//! taken so far fitted again with it.
//!
//! Real flights hold more than one or two things, so the search does not end at a pair. A term is
//! taken only where it gains clearly over what stands, and where whole flights agree on it; it is
//! kept only if what is left without it is clearly worse.

use rayon::prelude::*;

use crate::infer::candidates::Kind;
use crate::infer::fit::Setting;
use crate::infer::select::{Selection, Singles, Tried, attempt, promising};
use crate::statistics::held_out::Gain;

/// Least gain of a term in held-out log density, alone, in standard errors over flights, and as
/// part of the whole gain: 2.5 errors, for they come out too small, up to twofold, where the law is
/// not the right one (see [`crate::statistics::held_out`]). Chosen here: terms of less than 2 %
/// mend the form of others.
const LEAST_GAIN: f64 = 10.0;
const LEAST_ERRORS: f64 = 2.5;
const LEAST_SHARE: f64 = 0.02;
/// A rival does as well within so many standard errors of the difference, but no more than this
/// share of what the term brings; or within the smaller share. Chosen here.
const TIE_ERRORS: f64 = 2.0;
const TIE_MOST_SHARE: f64 = 0.25;
const TIE_SHARE: f64 = 0.04;
/// How many of those that promise most are fitted beside what is taken. Chosen here, for time.
const FITTED: usize = 8;

/// What was taken, and everything tried on the way.
#[derive(Clone, Debug)]
pub(super) struct Chosen {
    /// As of one recording, of any number of terms.
    pub(super) selection: Selection,
    /// The terms in the order in which they were taken.
    pub(super) turns: Vec<Turn>,
    /// What would have come next and was not taken, with its gain over what stands.
    pub(super) next: Option<(usize, Gain)>,
}

impl Chosen {
    /// Takes all of it back: neither what was taken nor what would have come next stands.
    pub(super) fn withdraw(&mut self) {
        self.selection.withdraw();
        self.turns.clear();
        self.next = None;
    }
}

/// One term that was taken.
#[derive(Clone, Debug)]
pub(super) struct Turn {
    /// Which candidate.
    pub(super) which: usize,
    /// What it gained over what stood before it.
    pub(super) gain: Gain,
    /// Candidates that would have done as well in its place, best first.
    pub(super) alternatives: Vec<usize>,
    /// Every candidate fitted at this turn with its gain over what stood, best first.
    pub(super) fitted: Vec<(usize, Gain)>,
    /// The fit with it, of what stood before and no more.
    pub(super) with: Tried,
}

/// Chooses at most so many effects, from the fits of each alone; of each `helps` says whether
/// held-out flights are not surely predicted worse with it (second) than with what stood before
/// (first).
pub(super) fn forward(
    setting: &Setting,
    tried: Singles,
    most: usize,
    helps: impl Fn(&Tried, &Tried) -> bool,
) -> Chosen {
    let candidates = setting.candidates;
    let Singles { nothing, singles } = tried;
    let mut best = nothing.clone();
    let mut turns: Vec<Turn> = Vec::new();
    let mut next = None;
    while turns.len() < most {
        let tried = match turns.is_empty() {
            true => singles.clone(),
            false => beside(setting, &nothing, &best),
        };
        let mut fitted: Vec<(Gain, Tried)> = tried
            .into_iter()
            .filter(|tried| tried.is_inside(candidates))
            .map(|tried| (tried.beyond(setting, &best), tried))
            .collect();
        fitted.sort_by(|(a, x), (b, y)| b.total.total_cmp(&a.total).then(x.which.cmp(&y.which)));
        let beside: Vec<(usize, Gain)> = fitted
            .iter()
            .filter_map(|(gain, tried)| Some((*tried.which.last()?, gain.clone())))
            .collect();
        if let Some(last) = turns.last_mut() {
            keep_substitutes(last, &beside);
        }
        // Each by itself: one that gains most, but in a few flights alone, must not keep a surer
        // one away.
        let is_enough = |(lead, winner): &&(Gain, Tried)| {
            lead.total > LEAST_GAIN
                && lead.total > LEAST_ERRORS * lead.standard_error
                && lead.total > LEAST_SHARE * winner.gain.total
                && helps(&best, winner)
        };
        let Some((lead, winner)) = fitted.iter().find(is_enough).cloned() else {
            next = beside.into_iter().next();
            break;
        };
        let Some(&which) = winner.which.last() else {
            break;
        };
        let rivals = fitted.iter().map(|(_, rival)| rival);
        let rivals = rivals.filter(|rival| rival.which.last() != Some(&which));
        let alternatives = rivals.filter(|rival| does_as_well(setting, rival, &winner, &lead));
        turns.push(Turn {
            which,
            alternatives: alternatives
                .filter_map(|of| of.which.last().copied())
                .collect(),
            gain: lead,
            fitted: beside,
            with: winner.clone(),
        });
        best = winner;
    }
    sensors_first(setting, &nothing, &mut best, &mut turns);
    // What stands beside a term is no alternative to it.
    for turn in &mut turns {
        turn.alternatives.retain(|k| !best.which.contains(k));
    }
    Chosen {
        selection: Selection {
            nothing,
            singles,
            rivals: Vec::new(),
            runner_up: None,
            chosen: best,
        },
        turns,
        next,
    }
}

/// Whether a rival predicts as well as the winner of a turn, which gained so much.
fn does_as_well(setting: &Setting, rival: &Tried, winner: &Tried, lead: &Gain) -> bool {
    let behind = winner.beyond(setting, rival);
    let tie = (TIE_ERRORS * behind.standard_error).min(TIE_MOST_SHARE * lead.total);
    behind.total < tie.max(TIE_SHARE * lead.total)
}

/// An instrument that does as well as an effect of the air, beside all that was taken and within
/// its range, takes its place; one that then does not is no alternative any more.
fn sensors_first(setting: &Setting, nothing: &Tried, best: &mut Tried, turns: &mut [Turn]) {
    let candidates = setting.candidates;
    let is_sensor = |k: &usize| candidates[*k].kind == Kind::Sensor;
    for (at, turn) in turns.iter_mut().enumerate() {
        if is_sensor(&turn.which) {
            continue;
        }
        let sensors = turn.alternatives.iter().copied().filter(is_sensor);
        let sensors: Vec<usize> = sensors.filter(|k| !best.which.contains(k)).collect();
        for sensor in sensors {
            let Some(place) = turn.alternatives.iter().position(|&k| k == sensor) else {
                continue;
            };
            turn.alternatives.remove(place);
            let Some(tried) = in_place(setting, nothing, best, (at, sensor)) else {
                continue;
            };
            if tried.is_inside(candidates) && does_as_well(setting, &tried, best, &turn.gain) {
                turn.alternatives.insert(0, turn.which);
                turn.which = sensor;
                *best = tried;
                break;
            }
        }
    }
}

/// What was taken with another candidate in one of its places.
fn in_place(
    setting: &Setting,
    nothing: &Tried,
    best: &Tried,
    (at, other): (usize, usize),
) -> Option<Tried> {
    let candidates = setting.candidates;
    let count = |k: &usize| candidates[*k].parameters.len();
    let from: usize = best.which[..at].iter().map(count).sum();
    let mut which = best.which.clone();
    which[at] = other;
    let swapped = |start: &Vec<f64>| {
        let mut values = best.fit.values.clone();
        values.splice(from..from + count(&best.which[at]), start.iter().copied());
        values
    };
    let starts: Vec<Vec<f64>> = candidates[other].starts.iter().map(swapped).collect();
    attempt(setting, nothing, &which, &starts)
}

/// Leaves only those alternatives that say the same thing: what still gains half as much beside the
/// term is another effect, not the same by another name.
fn keep_substitutes(turn: &mut Turn, beside: &[(usize, Gain)]) {
    let total = |gains: &[(usize, Gain)], which: usize| {
        let found = gains.iter().find(|(k, _)| *k == which);
        found.map_or(0.0, |(_, gain)| gain.total)
    };
    let (alternatives, fitted) = (&mut turn.alternatives, &turn.fitted);
    alternatives.retain(|&k| total(beside, k) < 0.5 * total(fitted, k));
}

/// Candidates beside what is taken, those that promise most.
fn beside(setting: &Setting, nothing: &Tried, best: &Tried) -> Vec<Tried> {
    promising(setting, best)
        .into_par_iter()
        .take(FITTED)
        .filter_map(|(_, k)| {
            let which = [&best.which[..], &[k]].concat();
            let beside = |start: &Vec<f64>| [&best.fit.values[..], start].concat();
            let starts = setting.candidates[k].starts.iter();
            let starts: Vec<Vec<f64>> = starts.map(beside).collect();
            attempt(setting, nothing, &which, &starts)
        })
        .collect()
}
