//! Effects in a part of a recording: what sets in part-way through it, as a door that opens or a
//! knock on a sensor, and what one probe of several has alone.
//!
//! Every candidate is held, to first order, against the residual with its change counted from each
//! of some moments on, and faults of a sensor with that of each probe. Where that takes clearly
//! more than the change over the whole recording, the candidate is fitted so, and a moment by the
//! likelihood of every reading.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use crate::forward::observed::PROBE;
use crate::infer::candidates::{Candidate, Onset, Scope};
use crate::infer::fit::{Fit, Setting};
use crate::infer::select::{Singles, attempt};

/// Moments that are tried, which part the readings evenly.
const MOMENTS: usize = 12;
/// What a part must gain in log likelihood over the whole, to first order and held out, beside the
/// logarithm of how many parts there are to choose from, and in standard errors: what any term must
/// (see [`mod@crate::infer::select`]); for a fault of one probe, which has no more parameters than
/// that of all, one standard error.
const LEAST_GAIN: f64 = 6.0;
const LEAST_ERRORS: f64 = 2.5;
const LEAST_ERRORS_OF_A_PROBE: f64 = 1.0;
/// How many candidates are fitted from a moment on, and how many of one probe. Chosen here, for
/// time.
const FITTED: usize = 5;
const FITTED_OF_PROBES: usize = 10;
/// Fall of twice a log likelihood that ends a 95 % interval of the moment: χ² of one degree of
/// freedom.
const CHI2_95: f64 = 3.84;
/// Candidates whose own parameters tell a moment, or a slope in time.
const OWN_TIME: [&str; 3] = ["payload_mass", "recirculation", "sensor_drift"];
/// Faults that one probe of several may have alone: all have one clock and one make, and a vent
/// below one does what an offset does.
const OF_ONE: [&str; 3] = ["sensor_gain", "sensor_lag", SATURATION];
/// Its parameter is over the highest reading.
pub(crate) const SATURATION: &str = "sensor_saturation";
/// What settles a fault of one probe.
const EXCHANGED: &str = "that probe and another one exchanged, and the same flight once more: what stays with the place is no fault of the probe";

/// The same candidates in the parts of a recording in which they explain clearly more than over
/// the whole.
#[must_use]
pub fn in_parts(setting: &Setting, tried: &Singles) -> Vec<Candidate> {
    let Some(first_order) = FirstOrder::of(setting, &tried.nothing.fit) else {
        return Vec::new();
    };
    let mut parts = from_moments(&first_order);
    parts.extend(of_probes(&first_order));
    parts
}

/// What changes would take of what nothing leaves, to first order.
struct FirstOrder<'s> {
    setting: &'s Setting<'s>,
    /// What gain and offset may still take, whitened.
    nuisances: DMatrix<f64>,
    gram: Cholesky<f64, Dyn>,
    left: DVector<f64>,
    /// What the base predicts.
    clean: Vec<f64>,
}

impl<'s> FirstOrder<'s> {
    fn of(setting: &'s Setting<'s>, nothing: &Fit) -> Option<FirstOrder<'s>> {
        let nuisances = setting.free_columns(nothing);
        let columns = nuisances.ncols();
        let gram = nuisances.tr_mul(&nuisances);
        let ridge = DMatrix::identity(columns, columns) * (1e-9 * gram.trace() + 1e-12);
        Some(FirstOrder {
            setting,
            gram: (gram + ridge).cholesky()?,
            nuisances,
            left: DVector::from_column_slice(&nothing.whitened),
            clean: setting.predicted(&[], &[]),
        })
    }

    /// Twice the log likelihood that a candidate takes in each of some scopes, from the start that
    /// takes most.
    fn takes(&self, candidate: &Candidate, scopes: &[Scope]) -> Vec<f64> {
        let setting = self.setting;
        let mut most = vec![0.0f64; scopes.len()];
        for start in &candidate.starts {
            let change = setting.change(candidate, start, &self.clean);
            let parts = scopes.iter().map(|scope| setting.in_scope(scope, &change));
            let parts: Vec<Vec<f64>> = parts.collect();
            let parts: Vec<&[f64]> = parts.iter().map(Vec::as_slice).collect();
            let whitened = setting.noise.whiten_all(&parts);
            for (most, whitened) in most.iter_mut().zip(whitened) {
                *most = most.max(self.taken(whitened));
            }
        }
        most
    }

    /// The same of a change, whitened.
    fn taken(&self, change: Vec<f64>) -> f64 {
        let change = DVector::from_vec(change);
        let beside = self.gram.solve(&self.nuisances.tr_mul(&change));
        let own = &change - &self.nuisances * beside;
        let (along, square) = (own.dot(&self.left), own.norm_squared());
        if square > 1e-9 {
            along * along / square
        } else {
            0.0
        }
    }
}

/// So many of those that take most.
fn most_first<T>(mut found: Vec<(f64, T)>, count: usize) -> Vec<T> {
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(count);
    found.into_iter().map(|(_, of)| of).collect()
}

/// Candidates from the moments on from which they take clearly more than always.
fn from_moments(first_order: &FirstOrder) -> Vec<Candidate> {
    let setting = first_order.setting;
    let mut sorted_s = setting.observed.times_s();
    sorted_s.sort_by(f64::total_cmp);
    let moment_s = |k: usize| sorted_s[k * (sorted_s.len() - 1) / (MOMENTS + 1)];
    let moments_s: Vec<f64> = (1..=MOMENTS).map(moment_s).collect();
    let since = |at_s: &f64| Scope::Since(Onset::new(*at_s, [*at_s; 2]));
    let scopes = std::iter::once(Scope::Whole).chain(moments_s.iter().map(since));
    let scopes: Vec<Scope> = scopes.collect();
    let best = |candidate| {
        let takes = first_order.takes(candidate, &scopes);
        let (always, later) = takes.split_first()?;
        let later = later.iter().copied().zip(moments_s.iter().copied());
        let (most, from_s) = later.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let gains = 0.5 * (most - always) > least_gain(MOMENTS);
        gains.then_some((most, (candidate, from_s)))
    };
    let candidates = setting.candidates.par_iter();
    let candidates = candidates.filter(|of| !OWN_TIME.contains(&of.name));
    let found = most_first(candidates.filter_map(best).collect(), FITTED).into_par_iter();
    let found = found.filter_map(|(of, from_s)| settled(setting, of, from_s, &sorted_s));
    found.collect()
}

/// Faults of single probes that take something. What all have is that of one, too, while the
/// tolerance of the others makes up for it: whether one has it alone is asked of the fits.
fn of_probes(first_order: &FirstOrder) -> Vec<Candidate> {
    let setting = first_order.setting;
    let probes = probes(setting);
    let faults = setting.candidates.iter();
    let faults = faults.filter(|of| OF_ONE.contains(&of.name));
    let of_each = faults.flat_map(|of| probes.iter().map(move |probe| (of, *probe)));
    let of_each: Vec<(&Candidate, Scope)> = of_each.collect();
    let found = of_each.into_par_iter().filter_map(|(fault, scope)| {
        let own = of_probe(setting, fault, scope)?;
        let takes = first_order.takes(&own, &[scope])[0];
        (0.5 * takes > least_gain(probes.len())).then_some((takes, own))
    });
    most_first(found.collect(), FITTED_OF_PROBES)
}

/// A fault as that of one probe; `None`: it reads nothing that could be cut off.
fn of_probe(setting: &Setting, fault: &Candidate, scope: Scope) -> Option<Candidate> {
    let recorded = setting.observed.recorded();
    let highest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let over = match fault.name {
        SATURATION => highest(&setting.in_scope(&scope, &recorded)) / highest(&recorded),
        _ => 1.0,
    };
    let mut own = fault.clone();
    for parameter in &mut own.parameters {
        parameter.low *= over;
        parameter.high *= over;
        parameter.neutral *= over;
        parameter.practical *= over;
    }
    let starts = own.starts.iter_mut().flatten();
    starts.for_each(|value| *value *= over);
    (over > 0.0).then_some(Candidate {
        scope,
        settled_by: EXCHANGED,
        ..own
    })
}

/// What a part must gain over the whole, chosen among so many.
fn least_gain(among: usize) -> f64 {
    LEAST_GAIN + (among as f64).ln()
}

/// Each probe, where there are several.
fn probes(setting: &Setting) -> Vec<Scope> {
    let count = setting.instrument_count();
    let around = setting.observed.covariates();
    let number = around.names.iter().position(|(name, _)| *name == PROBE);
    let Some(ids) = number.map(|k| &around.columns[k]).filter(|_| count > 1) else {
        return Vec::new();
    };
    let instruments = setting.observed.instruments();
    let first = |index: usize| instruments.iter().position(|of| *of == index);
    let probe = |index: usize| {
        let id = *ids.get(first(index)?)?;
        Some(Scope::Probe {
            index,
            id: id as u32,
        })
    };
    (0..count).filter_map(probe).collect()
}

/// A candidate from the moment on at which every reading is likeliest, found from a first guess.
fn settled(
    setting: &Setting,
    candidate: &Candidate,
    guess_s: f64,
    sorted_s: &[f64],
) -> Option<Candidate> {
    let at = |onset: Onset| Candidate {
        scope: Scope::Since(onset),
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

/// Fits those of a part, which are the last candidates, and adds each that predicts held-out
/// readings clearly better than itself over the whole recording.
pub fn add(setting: &Setting, tried: &mut Singles) {
    for (k, candidate) in setting.candidates.iter().enumerate() {
        let (among, errors) = match candidate.scope {
            Scope::Whole => continue,
            Scope::Since(_) => (MOMENTS, LEAST_ERRORS),
            Scope::Probe { .. } => (setting.instrument_count(), LEAST_ERRORS_OF_A_PROBE),
        };
        let place = tried.singles.iter().position(|one| {
            let other = &setting.candidates[one.which[0]];
            other.scope == Scope::Whole && other.name == candidate.name
        });
        let part = attempt(setting, &tried.nothing, &[k], &candidate.starts);
        if let (Some(place), Some(part)) = (place, part) {
            let more = part.beyond(setting, &tried.singles[place]);
            if more.total > least_gain(among).max(errors * more.standard_error) {
                tried.singles.push(part);
            }
        }
    }
    tried
        .singles
        .sort_by(|a, b| b.gain.total.total_cmp(&a.gain.total));
}
