//! Which pairs of candidates are worth a fit, and their fits.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::Tried;
use crate::infer::candidates::Candidate;
use crate::infer::fit::Setting;

/// How many are tried beside the best single, and how many singles among themselves.
const PAIRED: usize = 7;
const PAIRED_SINGLES: usize = 4;

/// How many more are tried in the place of each of a chosen pair.
const RIVALS: usize = 3;

/// Pairs among the best singles, and of the very best with those that promise most beside it.
pub(super) fn pairs(
    setting: &Setting,
    candidates: &[Candidate],
    singles: &[Tried],
    attempt: &(impl Fn(&[usize], &[Vec<f64>]) -> Option<Tried> + Sync),
) -> Vec<Tried> {
    let Some(best) = singles.first() else {
        return Vec::new();
    };
    let mut wanted: Vec<[usize; 2]> = promising(setting, candidates, best)
        .into_iter()
        .take(PAIRED)
        .map(|k| [best.which[0], k])
        .collect();
    for (i, a) in singles.iter().enumerate().take(PAIRED_SINGLES) {
        for b in &singles[i + 1..PAIRED_SINGLES.min(singles.len()).max(i + 1)] {
            let pair = [a.which[0], b.which[0]];
            if !wanted.contains(&pair) {
                wanted.push(pair);
            }
        }
    }
    together(candidates, singles, wanted, attempt)
}

/// Pairs fitted from where each ended alone, and the second also from its own beginning: next to the first it may be another.
fn together(
    candidates: &[Candidate],
    singles: &[Tried],
    wanted: Vec<[usize; 2]>,
    attempt: &(impl Fn(&[usize], &[Vec<f64>]) -> Option<Tried> + Sync),
) -> Vec<Tried> {
    let alone = |k: usize| singles.iter().find(|tried| tried.which == [k]);
    wanted
        .into_par_iter()
        .filter_map(|[a, b]| {
            let (first, second) = (alone(a)?.fit.values.clone(), alone(b)?.fit.values.clone());
            let fresh = candidates[b].starts.first()?.clone();
            attempt(
                &[a, b],
                &[[first.clone(), second].concat(), [first, fresh].concat()],
            )
        })
        .collect()
}

/// What might stand in the place of one of a chosen pair: the candidates that promise most beside the other, where not tried yet.
pub(super) fn beside(
    setting: &Setting,
    candidates: &[Candidate],
    singles: &[Tried],
    pairs: &[Tried],
    chosen: [usize; 2],
    attempt: &(impl Fn(&[usize], &[Vec<f64>]) -> Option<Tried> + Sync),
) -> Vec<Tried> {
    let mut wanted = Vec::new();
    for kept in chosen {
        let Some(first) = singles.iter().find(|tried| tried.which == [kept]) else {
            continue;
        };
        let is_tried = |k: usize| {
            pairs
                .iter()
                .any(|pair| pair.which.contains(&k) && pair.which.contains(&kept))
        };
        wanted.extend(
            promising(setting, candidates, first)
                .into_iter()
                .filter(|k| !chosen.contains(k))
                .filter(|&k| !is_tried(k))
                .take(RIVALS)
                .map(|k| [kept, k]),
        );
    }
    together(candidates, singles, wanted, attempt)
}

/// The candidates beside those taken, most promising first.
pub(crate) fn promising(setting: &Setting, candidates: &[Candidate], taken: &Tried) -> Vec<usize> {
    let mut promising: Vec<(f64, usize)> = (0..candidates.len())
        .into_par_iter()
        .filter(|k| !taken.which.contains(k))
        .map(|k| (promise(setting, candidates, taken, k), k))
        .collect();
    promising.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    promising.into_iter().map(|(_, k)| k).collect()
}

/// What another candidate could gain beside those taken, to first order, from the best of its starts.
fn promise(setting: &Setting, candidates: &[Candidate], first: &Tried, second: usize) -> f64 {
    let mut members = first.members(candidates);
    // Gain and offset at their tolerance take no more: what a sensor's fault adds there is its own.
    let count = first.fit.jacobian.ncols();
    let free: Vec<usize> = (0..count)
        .filter(|&j| {
            let nuisance = (j + 2).checked_sub(count);
            nuisance.is_none_or(|which| !setting.at_tolerance(which, first.fit.tolerance[which]))
        })
        .collect();
    let jacobian = first.fit.jacobian.select_columns(&free);
    let columns = jacobian.ncols();
    let gram = jacobian.transpose() * &jacobian;
    let ridge = DMatrix::identity(columns, columns) * (1e-9 * gram.trace());
    let Some(gram) = (gram + ridge).cholesky() else {
        return 0.0;
    };
    let clean = setting
        .observed
        .predict(&setting.hypothesis(&members, &first.fit.values));
    members.push(&candidates[second]);
    let of_start = |start: &Vec<f64>| {
        let values = [first.fit.values.clone(), start.clone()].concat();
        let changed = setting
            .observed
            .predict(&setting.hypothesis(&members, &values));
        let change: Vec<f64> = changed
            .iter()
            .zip(&clean)
            .map(|(to, from)| to - from)
            .collect();
        let change = nalgebra::DVector::from_vec(setting.noise.whiten(&change));
        let shared = gram.solve(&(jacobian.transpose() * &change));
        let own = change - &jacobian * shared;
        let along: f64 = own
            .iter()
            .zip(&first.fit.whitened)
            .map(|(g, e)| g * e)
            .sum();
        let square = own.norm_squared();
        if square > 1e-9 {
            along * along / square
        } else {
            0.0
        }
    };
    let starts = &candidates[second].starts;
    starts.iter().map(of_start).fold(0.0, f64::max)
}
