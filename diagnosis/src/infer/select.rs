//! Which candidates are missing: fits of all, gains on blocks that were not fitted, one effect or
//! two, and what cannot be told apart.
//!
//! The thresholds of selection and naming stand first. What they come to is measured on recordings
//! that were not used here: `plan prove` counts names without an effect, second effects withheld,
//! and unique names that were wrong.

use std::cell::LazyCell;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::forward::hypothesis::Hypothesis;
use crate::infer::candidates::{Candidate, Kind, Scope};
use crate::infer::fit::{Fit, Setting, by_member};
use crate::infer::scopes::SATURATION;
use crate::statistics::held_out::Gain;
use crate::statistics::quantile::{difference, root_mean_square};
use crate::statistics::trees::{self, HeldOut};

/// Least gain in held-out log density, alone and in standard errors, that a term needs. Chosen
/// here: the standard error is optimistic by up to two where the model is not quite right.
const LEAST_GAIN: f64 = 6.0;
const LEAST_ERRORS: f64 = 2.5;
/// What a gain that rests on few blocks needs. Chosen here: four times what a term alone needs.
const LARGE_GAIN: f64 = 25.0;
/// p-value of the global test below which gains may rest on few blocks, and below which faint ones
/// are enough: one in ten thousand recordings, and one in a thousand, which 0 alarms in some
/// hundreds need.
const RARE_P: f64 = 1e-4;
const FAINT_P: f64 = 0.001;
/// Least gain where it is known that something is there. Chosen here: twenty to one.
const FAINT_GAIN: f64 = 3.0;
/// Least log likelihood over nothing, all samples fitted, of what is seen once. Chosen here: three
/// thousand to one.
const ONCE: f64 = 8.0;
/// A second term must bring this share of the whole gain, whatever else; less is enough beside a
/// law that is not itself a closure.
const LEAST_SHARE: f64 = 0.12;
/// This share is enough if the term takes most of what any function could still take.
const LARGE_SHARE: f64 = 0.08;
const MOST: f64 = 0.8;
/// A law that may be off by more than this share is a closure.
const CLOSURE: f64 = 0.05;
/// Beside a closure (known to a tenth or two), this share, more of the squares than it may be off
/// ([`beyond_closure`]), and clearly more than any function of the covariates could still take: a
/// law that is right needs less to be learnt than trees do, and what only mends a closure does not
/// beat them.
const BESIDE_A_CLOSURE: f64 = 0.03;
const BEATS: f64 = 1.25;
/// Beside any other, this share, and as much as any function could take.
const BESIDE_A_LAW: f64 = 0.003;
const MATCHES: f64 = 1.0;
/// What a law may be off from its mechanism, in parts of the effect, where it states less: as much
/// as the laws in closed form of this library state, for the jet below every law is one of them.
const LAW_ERROR: f64 = 0.1;
/// Standard deviations of that which are no news: 95 % of a normal law.
const CLOSURES: f64 = 2.0;
/// Up to this part of the noise, that is nothing at all: in a thousand readings it comes to a log
/// density of 5, less than any term needs.
const SILENT: f64 = 0.1;
/// Naming: a rival does as well within so many standard errors of the difference, but no more than
/// half of what the term in question brings; within 4 % of that; or within 2 (seven to one).
const TIE_ERRORS: f64 = 2.0;
const TIE_MOST_SHARE: f64 = 0.5;
const TIE_SHARE: f64 = 0.04;
const TIE_GAIN: f64 = 2.0;
/// So many readings above a ceiling by so many standard deviations of the noise are no noise: where
/// that is normal, of a hundred readings at the ceiling three are with a probability of 4e-4.
const EXCEEDED: usize = 3;
const EXCEEDED_SD: f64 = 3.0;
/// How many are paired with the best single, and how many singles among themselves, so that an
/// instrument's fault that ranks low beside an effect is tried with it; how many more are tried in
/// the place of each of a chosen pair. Chosen here, for time.
const PAIRED: usize = 7;
const PAIRED_SINGLES: usize = 8;
const RIVALS: usize = 3;
/// Least promise (χ²) of a second with which a pair is fitted: half of what a term needs, since
/// half of it shows from a start that points to the side.
const LEAST_PROMISE: f64 = 0.5 * (2.0 * LEAST_GAIN);

/// What the laws of terms may be off, two standard deviations, in parts of the effect.
pub(crate) fn closure(setting: &Setting, terms: &Tried) -> f64 {
    let members = terms.members(setting.candidates);
    let off = members.iter().map(|of| of.closure_error);
    CLOSURES * off.fold(LAW_ERROR, f64::max)
}

/// How much more of the squares of what the recording differs by something takes from what some
/// terms leave, than their laws may be off: in the square of the channel's unit, block by block,
/// where `after` is what it leaves of the recorded values.
///
/// ```text
/// Σ_b [ rest² - after² - (2 c)² (before² - after²) ],    c = max(0.1, closure errors of the terms)
/// ```
///
/// Squares in the reading's own unit, since a robust density counts a gross error that a law
/// leaves hardly more than a small one.
pub(crate) fn beyond_closure(
    setting: &Setting,
    nothing: &Tried,
    terms: &Tried,
    after: &[f64],
) -> Gain {
    let off = closure(setting, terms);
    let blocks = &setting.noise.blocks;
    let squares = |values: &[f64]| blocks.sums(values.iter().map(|value| value * value));
    let rest = squares(&setting.left(&terms.fit.predicted));
    let before = squares(&setting.left(&nothing.fit.predicted));
    let of_blocks = rest.into_iter().zip(before).zip(squares(after));
    let beyond =
        of_blocks.map(|((rest, before), after)| rest - after - off * off * (before - after));
    Gain::new(beyond.collect())
}

/// What trees over the covariates predict, held out, of what a fit leaves.
#[must_use]
pub fn flexible(setting: &Setting, fit: &Fit) -> HeldOut {
    let covariates = setting.observed.covariates().columns;
    trees::held_out(covariates, &setting.left(&fit.predicted), setting.noise)
}

/// One set of candidates, fitted.
#[derive(Clone, Debug)]
pub struct Tried {
    /// Indices into the candidates.
    pub which: Vec<usize>,
    /// The fit.
    pub fit: Fit,
    /// Log density of each sample, held out.
    pub log_density: Vec<f64>,
    /// Held-out gain over the baseline.
    pub gain: Gain,
    /// Whether each of its terms is large enough to act on.
    pub practical: bool,
}

impl Setting<'_> {
    /// What a fit says is there, on top of the base, but for what is of one probe.
    pub(crate) fn explanation(&self, tried: &Tried) -> Hypothesis {
        let mut hypothesis = self.base;
        for (of, own) in by_member(&tried.members(self.candidates), &tried.fit.values) {
            if of.scope.probe().is_none() {
                of.set(own, &mut hypothesis);
            }
        }
        hypothesis
    }
}

impl Tried {
    /// Whether no term was driven to an end of what it may be.
    pub(crate) fn is_inside(&self, candidates: &[Candidate]) -> bool {
        let members = self.members(candidates);
        by_member(&members, &self.fit.values).all(|(member, own)| !member.is_at_bound(own))
    }

    /// The candidates that it is made of, in the order of their values.
    pub(crate) fn members<'c>(&self, candidates: &'c [Candidate]) -> Vec<&'c Candidate> {
        self.which.iter().map(|&k| &candidates[k]).collect()
    }

    /// Held-out gain over another.
    pub(crate) fn beyond(&self, setting: &Setting, other: &Tried) -> Gain {
        Gain::over(&setting.noise.blocks, &self.log_density, &other.log_density)
    }

    /// The two terms of a pair in the other order.
    fn swapped(&self, candidates: &[Candidate]) -> Tried {
        let [a, b] = self.which[..] else {
            return self.clone();
        };
        let first = candidates[a].parameters.len();
        let count = self.fit.values.len();
        let order = (first..count).chain(0..first).chain(count..count + 2);
        let order: Vec<usize> = order.collect();
        let mut swapped = self.clone();
        swapped.which = vec![b, a];
        swapped.fit.values.rotate_left(first);
        swapped.fit.jacobian = self.fit.jacobian.select_columns(&order);
        swapped
    }
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Selection {
    /// The baseline with the instrument's tolerance alone.
    pub nothing: Tried,
    /// Every candidate alone, best first.
    pub singles: Vec<Tried>,
    /// What is taken: no term, one, or two.
    pub chosen: Tried,
    /// For each chosen term, the candidates that would do as well in its place, with the fits
    /// there, best first.
    pub rivals: Vec<Vec<(usize, Tried)>>,
    /// Runner-up: a second term that would predict more, by too small a part of the whole to be
    /// told from an error in the first one's form; not taken.
    pub runner_up: Option<(usize, Gain)>,
}

impl Selection {
    /// Takes the choice back: nothing stands.
    pub fn withdraw(&mut self) {
        self.chosen = self.nothing.clone();
        self.rivals.clear();
        self.runner_up = None;
    }
}

/// Every candidate alone, and none.
#[derive(Clone, Debug)]
pub struct Singles {
    /// The baseline with the instrument's tolerance alone.
    pub nothing: Tried,
    /// Every candidate alone, best first.
    pub singles: Vec<Tried>,
}

/// Fits every candidate alone, over the whole recording.
#[must_use]
pub fn singles(setting: &Setting) -> Singles {
    let fit = setting.nothing();
    let log_density = setting.held_out(&[], &fit);
    let nothing = Tried {
        which: Vec::new(),
        gain: Gain::over(&setting.noise.blocks, &log_density, &log_density),
        log_density,
        fit,
        practical: true,
    };
    let alone = setting.candidates.par_iter().enumerate();
    let alone = alone.filter(|(_, of)| of.scope == Scope::Whole);
    let alone = alone.filter_map(|(k, of)| attempt(setting, &nothing, &[k], &of.starts));
    let mut singles: Vec<Tried> = alone.collect();
    singles.sort_by(|a, b| b.gain.total.total_cmp(&a.gain.total));
    Singles { nothing, singles }
}

/// Candidates together, from each of some starts; `None` without a start.
pub(crate) fn attempt(
    setting: &Setting,
    nothing: &Tried,
    which: &[usize],
    starts: &[Vec<f64>],
) -> Option<Tried> {
    let members: Vec<&Candidate> = which.iter().map(|&k| &setting.candidates[k]).collect();
    let fit = setting.fit(&members, starts)?;
    let log_density = setting.held_out(&members, &fit);
    let is_practical = |(member, own): (&Candidate, &[f64])| member.size(own) >= 1.0;
    let practical = by_member(&members, &fit.values).all(is_practical);
    Some(Tried {
        which: which.to_vec(),
        gain: Gain::over(&setting.noise.blocks, &log_density, &nothing.log_density),
        fit,
        log_density,
        practical,
    })
}

/// Tries pairs and chooses, with the p-value `p` of the global lack-of-fit test. Where it is all
/// but certain that something is there, a faint gain is enough to say what it may be.
#[must_use]
pub fn select(setting: &Setting, tried: Singles, p: f64) -> Selection {
    let mut search = ModelSearch {
        setting,
        tried: &tried,
        pairs: Vec::new(),
    };
    // Two effects can mask one another, so pairs are tried even where no single stands out.
    let mut inside = tried
        .singles
        .iter()
        .filter(|one| one.is_inside(setting.candidates));
    let best = inside.next();
    search.pairs = best.map_or(Vec::new(), |best| search.pairs(best));
    let choice = best.and_then(|best| search.choice(best, p));
    // None: no term.
    let (mut chosen, runner_up) = choice.unwrap_or_else(|| (tried.nothing.clone(), None));
    if let [a, b] = chosen.which[..] {
        let in_place = search.beside([a, b]);
        search.pairs.extend(in_place);
    }
    for place in 0..chosen.which.len() {
        chosen = search.preferred(&chosen, place).unwrap_or(chosen);
    }
    let ties = (0..chosen.which.len()).map(|place| {
        let ties = search.ties(&chosen, place).into_iter();
        ties.map(|(rival, tried)| (rival, tried.clone())).collect()
    });
    Selection {
        rivals: ties.collect(),
        chosen,
        runner_up,
        nothing: tried.nothing,
        singles: tried.singles,
    }
}

/// Gains in a few blocks alone have a large standard error whatever their size; a large one must
/// not rest on one block.
fn enough(gain: &Gain, p: f64) -> bool {
    let steady = gain.total > LEAST_ERRORS * gain.standard_error;
    let rare = p < RARE_P && gain.total > LARGE_GAIN && gain.without_best() > LEAST_GAIN;
    gain.total > LEAST_GAIN && (steady || rare)
}

/// Everything that was tried.
struct ModelSearch<'a> {
    setting: &'a Setting<'a>,
    tried: &'a Singles,
    pairs: Vec<Tried>,
}

impl ModelSearch<'_> {
    /// What is taken, and the runner-up.
    fn choice(&self, best: &Tried, p: f64) -> Option<(Tried, Option<(usize, Gain)>)> {
        let candidates = self.setting.candidates;
        // The best first: whether one may stand takes its time.
        let mut pairs: Vec<&Tried> = self.pairs.iter().collect();
        pairs.sort_by(|a, b| b.gain.total.total_cmp(&a.gain.total));
        let best_pair = pairs.into_iter().find(|pair| self.may_stand(pair));
        // Each single by itself: one that gains most, but in a few blocks alone, must not keep a
        // surer one away.
        let singles = || self.tried.singles.iter();
        let sure = |one: &&Tried| enough(&one.gain, p) && self.may_stand(one);
        let faint = |one: &&Tried| {
            one.gain.total > FAINT_GAIN.max(one.gain.standard_error) && self.may_stand(one)
        };
        // One that leads and was driven to its bound is not named, and nothing that explains
        // clearly less is named in its place.
        let leader = singles()
            .next()
            .filter(|leader| !leader.is_inside(candidates));
        let is_behind = |tried: &Tried| {
            leader.is_some_and(|leader| {
                let lead = leader.beyond(self.setting, tried);
                lead.total > (TIE_ERRORS * lead.standard_error).max(LEAST_GAIN)
            })
        };
        let chosen = match best_pair {
            Some(pair) if self.both_needed(pair, best, p) && !is_behind(pair) => pair,
            _ if is_behind(best) => return None,
            _ => match singles().find(sure) {
                Some(single) => single,
                None if p >= FAINT_P => return None,
                None => singles().find(faint).or_else(|| self.seen_once())?,
            },
        };
        let runner_up = best_pair
            .filter(|pair| chosen.which.len() == 1 && pair.which.contains(&chosen.which[0]))
            .and_then(|pair| {
                let second = *pair.which.iter().find(|k| !chosen.which.contains(k))?;
                Some((second, pair.beyond(self.setting, chosen)))
            })
            .filter(|(_, more)| enough(more, p));
        Some((chosen.clone(), runner_up))
    }

    /// Whether an answer may be given at all: no parameter at its bound, no ceiling that readings
    /// exceed, and held-out readings predicted better than without it, in their own unit.
    fn may_stand(&self, tried: &Tried) -> bool {
        let candidates = self.setting.candidates;
        let error = |members: &[&Candidate], fit: &Fit| {
            let predicted = self.setting.predicted_held_out(members, fit);
            root_mean_square(&self.setting.left(&predicted))
        };
        tried.is_inside(candidates)
            && !self.is_exceeded(tried)
            && error(&tried.members(candidates), &tried.fit) < error(&[], &self.tried.nothing.fit)
    }

    /// Whether readings lie above a ceiling that is one of the terms by more than noise does.
    fn is_exceeded(&self, tried: &Tried) -> bool {
        let setting = self.setting;
        let members = tried.members(setting.candidates);
        let mut ceilings =
            by_member(&members, &tried.fit.values).filter(|(of, _)| of.name == SATURATION);
        ceilings.any(|(of, own)| {
            let readings = setting.in_scope(&of.scope, &setting.observed.recorded());
            let above = readings.iter().zip(setting.noise.sd());
            let above = above.filter(|(reading, sd)| **reading > own[0] + EXCEEDED_SD * **sd);
            above.count() >= EXCEEDED
        })
    }

    /// The likeliest single where something shows in one place only, so that no held-out block can
    /// speak for it.
    fn seen_once(&self) -> Option<&Tried> {
        let nothing = self.tried.nothing.fit.cost;
        let singles = self.tried.singles.iter();
        singles
            .filter(|tried| 0.5 * (nothing - tried.fit.cost) > ONCE && self.may_stand(tried))
            .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))
    }

    /// Whether a pair beats each of its members alone, and the best single, by enough.
    fn both_needed(&self, pair: &Tried, best: &Tried, p: f64) -> bool {
        if !enough(&pair.gain, p) {
            return false;
        }
        // What a function of the covariates, without any physics, could still take from the best
        // single: asked only where a share leaves it open, for trees take long.
        let left = LazyCell::new(|| {
            let left = flexible(self.setting, &best.fit).gain.total;
            left.max(LEAST_GAIN)
        });
        let is_member = |single: &&Tried| pair.which.contains(&single.which[0]);
        let members = self.tried.singles.iter().filter(is_member);
        [best].into_iter().chain(members).all(|single| {
            let more = pair.beyond(self.setting, single);
            let share = more.total / pair.gain.total;
            let is_closure = self.setting.candidates[single.which[0]].closure_error > CLOSURE;
            // What only mends its form is no second effect.
            let mends = || {
                let after = self.setting.left(&pair.fit.predicted);
                let beyond = beyond_closure(self.setting, &self.tried.nothing, single, &after);
                beyond.total <= 0.0 && !enough(&self.where_silent(single, pair), p)
            };
            if is_closure && mends() {
                return false;
            }
            let (least, over) = match is_closure {
                true => (BESIDE_A_CLOSURE, BEATS),
                false => (BESIDE_A_LAW, MATCHES),
            };
            let beats = || share > least && more.total > over * *left;
            let is_large =
                || share > LEAST_SHARE || share > LARGE_SHARE && more.total > MOST * *left;
            enough(&more, p) && (is_large() || beats())
        })
    }

    /// What a pair gains over one of its terms in the blocks in which that term changes nothing:
    /// there its law has no form that could be mended. Whole blocks, since a change that passes
    /// through zero is somewhere small without being absent.
    fn where_silent(&self, single: &Tried, pair: &Tried) -> Gain {
        let setting = self.setting;
        let members = single.members(setting.candidates);
        let change = difference(
            &setting.predicted(&members, &single.fit.values),
            &setting.predicted(&[], &[]),
        );
        let off = closure(setting, single);
        let blocks = &setting.noise.blocks;
        let acts = change.iter().zip(setting.noise.sd());
        let acts = acts.map(|(change, sd)| f64::from(off * change.abs() > SILENT * sd));
        let acts = blocks.sums(acts);
        let is_silent = |block: usize| acts[block] == 0.0;
        let gained = pair.log_density.iter().zip(&single.log_density);
        let gained = gained.zip(&blocks.of_sample);
        let gained = gained.map(|((with, without), &block)| match is_silent(block) {
            true => with - without,
            false => 0.0,
        });
        Gain::new(blocks.sums(gained))
    }

    /// Pairs among the best singles, and of the very best with those that promise most beside it.
    fn pairs(&self, best: &Tried) -> Vec<Tried> {
        let singles = &self.tried.singles;
        let promising = promising(self.setting, best).into_iter();
        let first = best.which[0];
        let mut wanted: Vec<[usize; 2]> = promising
            .filter(|&(promise, k)| {
                promise > LEAST_PROMISE && self.alone(k).is_some() && self.are_two(first, k)
            })
            .take(PAIRED)
            .map(|(_, k)| [first, k])
            .collect();
        let few = &singles[..PAIRED_SINGLES.min(singles.len())];
        for (i, a) in few.iter().enumerate() {
            for b in &few[i + 1..] {
                let pair = [a.which[0], b.which[0]];
                let promises = || {
                    let second = &self.setting.candidates[pair[1]];
                    promise(self.setting, a, second) > LEAST_PROMISE
                };
                if self.are_two(pair[0], pair[1]) && !wanted.contains(&pair) && promises() {
                    wanted.push(pair);
                }
            }
        }
        self.together(wanted)
    }

    /// What might stand in the place of one of a chosen pair: the candidates that promise most
    /// beside the other, where not tried yet.
    fn beside(&self, chosen: [usize; 2]) -> Vec<Tried> {
        let mut wanted = Vec::new();
        for kept in chosen {
            let Some(first) = self.alone(kept) else {
                continue;
            };
            let is_tried = |k: usize| {
                let mut pairs = self.pairs.iter();
                pairs.any(|pair| pair.which.contains(&k) && pair.which.contains(&kept))
            };
            let promising = promising(self.setting, first).into_iter();
            let fresh = promising
                .map(|(_, k)| k)
                .filter(|&k| self.are_two(kept, k) && !chosen.contains(&k) && !is_tried(k));
            wanted.extend(fresh.take(RIVALS).map(|k| [kept, k]));
        }
        self.together(wanted)
    }

    /// Pairs fitted from where each ended alone, and the second also from its own beginning: next
    /// to the first it may be another.
    fn together(&self, wanted: Vec<[usize; 2]>) -> Vec<Tried> {
        wanted
            .into_par_iter()
            .filter_map(|[a, b]| {
                let (first, second) = (&self.alone(a)?.fit.values, &self.alone(b)?.fit.values);
                let fresh = self.setting.candidates[b].starts.first()?;
                let starts = [second, fresh].map(|second| [&first[..], second].concat());
                attempt(self.setting, &self.tried.nothing, &[a, b], &starts)
            })
            .collect()
    }

    /// Whether two candidates are two effects, and not one in two parts: faults of two probes are.
    fn are_two(&self, a: usize, b: usize) -> bool {
        let [a, b] = [a, b].map(|k| &self.setting.candidates[k]);
        let probes = [a.scope.probe(), b.scope.probe()];
        a.name != b.name || probes[0].is_some() && probes[1].is_some() && probes[0] != probes[1]
    }

    fn alone(&self, k: usize) -> Option<&Tried> {
        self.tried.singles.iter().find(|tried| tried.which == [k])
    }

    /// What does as well with another candidate in the place of one of the chosen, best first.
    fn ties(&self, chosen: &Tried, place: usize) -> Vec<(usize, &Tried)> {
        let kept = |k: &usize| *k != chosen.which[place] && chosen.which.contains(k);
        let pool = match chosen.which.len() {
            1 => &self.tried.singles,
            _ => &self.pairs,
        };
        // What the term in question brings.
        let rest = chosen.which.iter().filter(|k| kept(k));
        let rest = rest.filter_map(|&k| self.alone(k));
        let own = chosen.gain.total - rest.map(|t| t.gain.total.max(0.0)).sum::<f64>();
        let mut close: Vec<(f64, usize, &Tried)> = Vec::new();
        for tried in pool
            .iter()
            .filter(|tried| tried.is_inside(self.setting.candidates))
        {
            let others: Vec<usize> = tried.which.iter().copied().filter(|k| !kept(k)).collect();
            let [rival] = others[..] else {
                continue;
            };
            // The same from another moment on is no other effect.
            let named = |k: &usize| self.setting.candidates[*k].name;
            if chosen.which.iter().any(|k| named(k) == named(&rival)) {
                continue;
            }
            if chosen.which.contains(&rival) || close.iter().any(|(_, known, _)| *known == rival) {
                continue;
            }
            let lead = chosen.beyond(self.setting, tried);
            let tie = (TIE_ERRORS * lead.standard_error).min(TIE_MOST_SHARE * own);
            // What was seen once is compared as fitted.
            let (lead, tie) = if chosen.gain.total < FAINT_GAIN {
                (0.5 * (tried.fit.cost - chosen.fit.cost), FAINT_GAIN)
            } else {
                (lead.total, tie.max(TIE_SHARE * own).max(TIE_GAIN))
            };
            if lead < tie {
                close.push((lead, rival, tried));
            }
        }
        close.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let close = close.into_iter();
        close.map(|(_, rival, tried)| (rival, tried)).collect()
    }

    /// What is named before one of the chosen that it cannot be told from: an instrument of the
    /// printed set before physics, and within one standard error a mechanism before a factor.
    fn preferred(&self, chosen: &Tried, place: usize) -> Option<Tried> {
        let candidates = self.setting.candidates;
        let own = &candidates[chosen.which[place]];
        let comes_first = |rival: &Candidate| match (own.kind, rival.kind) {
            (Kind::Physics, Kind::Sensor) => true,
            (Kind::Physics, Kind::Physics) => own.name == "momentum_scale",
            (Kind::Sensor, _) => false,
        };
        let is_even = |tried: &Tried| {
            let lead = chosen.beyond(self.setting, tried);
            if chosen.gain.total < FAINT_GAIN {
                tried.fit.cost < chosen.fit.cost + 2.0
            } else {
                lead.total < lead.standard_error.max(TIE_GAIN)
            }
        };
        let mut ties = self.ties(chosen, place).into_iter();
        let (rival, tried) = ties.find(|(rival, tried)| {
            let rival = &candidates[*rival];
            comes_first(rival)
                && (rival.kind == Kind::Sensor || is_even(tried))
                && self.may_stand(tried)
        })?;
        // The same order of terms, values and columns as in the fit that stands.
        let is_in_place = tried.which.iter().position(|k| *k == rival) == Some(place);
        Some(match is_in_place {
            true => tried.clone(),
            false => tried.swapped(candidates),
        })
    }
}

/// The candidates beside those taken and what they promise, most first.
pub(crate) fn promising(setting: &Setting, taken: &Tried) -> Vec<(f64, usize)> {
    let beside = (0..setting.candidates.len()).into_par_iter();
    let beside = beside.filter(|k| !taken.which.contains(k));
    let promising = beside.map(|k| (promise(setting, taken, &setting.candidates[k]), k));
    let mut promising: Vec<(f64, usize)> = promising.collect();
    promising.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    promising
}

/// What another candidate could gain beside those taken (χ²), to first order, from the best of its
/// starts.
fn promise(setting: &Setting, taken: &Tried, second: &Candidate) -> f64 {
    let mut members = taken.members(setting.candidates);
    let fit = &taken.fit;
    // Gain and offset at their tolerance take no more: what a sensor's fault adds there is its own.
    let jacobian = setting.free_columns(fit);
    let columns = jacobian.ncols();
    let gram = jacobian.tr_mul(&jacobian);
    let ridge = DMatrix::identity(columns, columns) * (1e-9 * gram.trace());
    let Some(gram) = (gram + ridge).cholesky() else {
        return 0.0;
    };
    let predict = |members: &[&Candidate], values: &[f64]| setting.predicted(members, values);
    let clean = predict(&members, &fit.values);
    members.push(second);
    let left = DVector::from_column_slice(&fit.whitened);
    let of_start = |start: &Vec<f64>| {
        let changed = predict(&members, &[&fit.values[..], start].concat());
        let change = setting.noise.whiten(&difference(&changed, &clean));
        let change = DVector::from_vec(change);
        let own = &change - &jacobian * gram.solve(&jacobian.tr_mul(&change));
        let (along, square) = (own.dot(&left), own.norm_squared());
        let told = square > 1e-9;
        if told { along * along / square } else { 0.0 }
    };
    second.starts.iter().map(of_start).fold(0.0, f64::max)
}
