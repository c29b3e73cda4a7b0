//! Effects that set in part-way through a recording: a door that opens, a knock on a sensor.
//!
//! Every candidate is held, to first order, against the residual with its change counted from each
//! of some moments on. Where that takes clearly more than the change over the whole recording, the
//! candidate is fitted so, and the moment by the likelihood of every reading.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::infer::candidates::{Candidate, Onset};
use crate::infer::fit::Setting;
use crate::infer::select::{Singles, attempt};

/// Moments that are tried, which part the readings evenly.
const MOMENTS: usize = 12;
/// What a moment must gain in log likelihood over "from the beginning", to first order and held
/// out, and in standard errors: what any term must (see [`mod@crate::infer::select`]), and ln 12
/// for the choice among moments.
const LEAST_GAIN: f64 = 6.0 + 2.5;
const LEAST_ERRORS: f64 = 2.5;
/// How many candidates are fitted so. Chosen here, for time.
const FITTED: usize = 5;
/// Fall of twice a log likelihood that ends a 95 % interval of the moment: χ² of one degree of
/// freedom.
const CHI2_95: f64 = 3.84;
/// Candidates whose own parameters tell a moment, or a slope in time.
const OWN_TIME: [&str; 3] = ["payload_mass", "recirculation", "sensor_drift"];

/// Candidates that explain clearly more from some moment on than over the whole recording.
#[must_use]
pub fn onsets(setting: &Setting, tried: &Singles) -> Vec<Candidate> {
    let times_s = setting.observed.times_s();
    let mut sorted = times_s.clone();
    sorted.sort_by(f64::total_cmp);
    let moment = |k: usize| sorted[k * (sorted.len() - 1) / (MOMENTS + 1)];
    let moments_s: Vec<f64> = (1..=MOMENTS).map(moment).collect();
    let froms_s = [&[f64::NEG_INFINITY], &moments_s[..]].concat();
    let nothing = &tried.nothing.fit;
    let nuisances = setting.free_columns(nothing);
    let columns = nuisances.ncols();
    let gram = nuisances.tr_mul(&nuisances);
    let ridge = DMatrix::identity(columns, columns) * (1e-9 * gram.trace() + 1e-12);
    let Some(gram) = (gram + ridge).cholesky() else {
        return Vec::new();
    };
    let left = DVector::from_column_slice(&nothing.whitened);
    let clean = setting.predicted(&[], &[]);
    // Twice the log likelihood that a change takes, whitened, to first order.
    let takes = |change: Vec<f64>| {
        let change = DVector::from_vec(change);
        let own = &change - &nuisances * gram.solve(&nuisances.tr_mul(&change));
        let (along, square) = (own.dot(&left), own.norm_squared());
        if square > 1e-9 {
            along * along / square
        } else {
            0.0
        }
    };
    let of_candidate = |candidate: &Candidate| {
        let mut takes_most = vec![0.0f64; froms_s.len()];
        for start in &candidate.starts {
            let change = setting.change(candidate, start, &clean);
            let from = |from_s: &f64| -> Vec<f64> {
                let pairs = change.iter().zip(&times_s);
                let masked = pairs.map(|(d, t_s)| if t_s >= from_s { *d } else { 0.0 });
                masked.collect()
            };
            let masked: Vec<Vec<f64>> = froms_s.iter().map(from).collect();
            let masked: Vec<&[f64]> = masked.iter().map(Vec::as_slice).collect();
            let whitened = setting.noise.whiten_all(&masked);
            for (most, whitened) in takes_most.iter_mut().zip(whitened) {
                *most = most.max(takes(whitened));
            }
        }
        let (always, later) = takes_most.split_first()?;
        let by_moment = later.iter().copied().zip(moments_s.iter().copied());
        let (most, from_s) = by_moment.max_by(|a, b| a.0.total_cmp(&b.0))?;
        (0.5 * (most - always) > LEAST_GAIN).then_some((most, from_s))
    };
    let candidates = setting.candidates.par_iter();
    let own_time = |candidate: &&Candidate| OWN_TIME.contains(&candidate.name);
    let found = candidates.filter(|candidate| !own_time(candidate));
    let found = found.filter_map(|candidate| Some((of_candidate(candidate)?, candidate)));
    let mut found: Vec<((f64, f64), &Candidate)> = found.collect();
    found.sort_by(|a, b| b.0.0.total_cmp(&a.0.0));
    found.truncate(FITTED);
    let found = found.into_par_iter();
    found
        .filter_map(|((_, from_s), candidate)| settled(setting, candidate, from_s, &sorted))
        .collect()
}

/// A candidate from the moment on at which every reading is likeliest, found from a first guess.
fn settled(
    setting: &Setting,
    candidate: &Candidate,
    guess_s: f64,
    sorted_s: &[f64],
) -> Option<Candidate> {
    let at = |onset: Onset| Candidate {
        since: Some(onset),
        ..candidate.clone()
    };
    let first = at(Onset::new(guess_s, [guess_s; 2]));
    let fit = setting.fit(&[&first], &first.starts)?;
    let (before, after) = (
        setting.predicted(&[], &[]),
        setting.predicted(&[candidate], &fit.values),
    );
    let times_s = setting.observed.times_s();
    let cost = |from_s: f64| {
        let pairs = before.iter().zip(&after).zip(&times_s);
        let plain = pairs.map(|((b, a), t_s)| if *t_s >= from_s { *a } else { *b });
        setting.cost_of(&plain.collect::<Vec<f64>>(), &fit.tolerance)
    };
    // Every moment of a coarse comb over two steps of the first, then of a finer one.
    let index = sorted_s.partition_point(|t_s| *t_s < guess_s);
    let mut reach = sorted_s.len() / MOMENTS;
    let mut best = (cost(guess_s), index);
    let mut seen = vec![(best.0, guess_s)];
    while reach > 1 {
        let step = (reach / 6).max(1);
        let low = best.1.saturating_sub(reach);
        let high = (best.1 + reach).min(sorted_s.len() - 1);
        for at in (low..=high).step_by(step) {
            let here = cost(sorted_s[at]);
            seen.push((here, sorted_s[at]));
            if here < best.0 {
                best = (here, at);
            }
        }
        reach = step / 2;
    }
    let near = seen.iter().filter(|(of, _)| of - best.0 < CHI2_95);
    let ends_s = near.fold([f64::INFINITY, f64::NEG_INFINITY], |ends, (_, t_s)| {
        [ends[0].min(*t_s), ends[1].max(*t_s)]
    });
    Some(at(Onset::new(sorted_s[best.1], ends_s)))
}

/// Fits those that set in part-way, which are the last candidates, and adds each that predicts
/// held-out readings clearly better than itself over the whole recording.
pub fn add(setting: &Setting, tried: &mut Singles) {
    for (k, candidate) in setting.candidates.iter().enumerate() {
        if candidate.since.is_none() {
            continue;
        }
        let is_it = |name: &str| name == candidate.name;
        let place = tried.singles.iter().position(|one| {
            let other = &setting.candidates[one.which[0]];
            other.since.is_none() && is_it(other.name)
        });
        let later = attempt(setting, &tried.nothing, &[k], &candidate.starts);
        if let (Some(place), Some(later)) = (place, later) {
            let more = later.beyond(setting, &tried.singles[place]);
            if more.total > LEAST_GAIN.max(LEAST_ERRORS * more.standard_error) {
                tried.singles.push(later);
            }
        }
    }
    tried
        .singles
        .sort_by(|a, b| b.gain.total.total_cmp(&a.gain.total));
}
