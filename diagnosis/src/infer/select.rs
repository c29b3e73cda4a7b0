//! Which candidates are missing: fits of all, gains on blocks that were not fitted, one effect or two, and what cannot be told apart.

mod pairs;
mod ties;

use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::Serialize;

pub(crate) use pairs::promising;
use pairs::{beside, pairs};
use ties::Pool;

use crate::infer::candidates::Candidate;
use crate::infer::fit::{Fit, Setting, held_out};
use crate::statistics::trees::{self, HeldOut};

/// Parts that the blocks are dealt to.
pub const FOLDS: usize = 6;
/// Least gain in held-out log density, alone and in standard errors, that a term needs. Chosen here: the standard error is
/// optimistic by up to two where the model is not quite right.
const LEAST_GAIN: f64 = 6.0;
const LEAST_ERRORS: f64 = 2.5;
/// What a gain that rests on few blocks needs. Chosen here: four times what a term alone needs.
const LARGE_GAIN: f64 = 25.0;
/// Chance of as much structure in noise alone below which gains may rest on few blocks, and below which faint ones are enough.
const RARE_CHANCE: f64 = 1e-4;
const FAINT_CHANCE: f64 = 0.002;
/// Least gain where it is known that something is there. Chosen here: twenty to one.
const FAINT_GAIN: f64 = 3.0;
/// Least log likelihood over nothing, all samples fitted, of what is seen once. Chosen here: three thousand to one.
const ONCE: f64 = 8.0;
/// A second term must bring this share of the whole gain, whatever else; less is enough beside a law that is not itself a closure.
const LEAST_SHARE: f64 = 0.12;
/// This share is enough if the term takes most of what any function could still take.
const LARGE_SHARE: f64 = 0.08;
const MOST: f64 = 0.8;
/// A law that may be off by more than this share is a closure.
const CLOSURE: f64 = 0.05;
/// Beside a closure (known to a tenth or two), this share, and clearly more than any function of the circumstances could still take: a law
/// that is right needs less to be learnt than trees do, and what only mends a closure does not beat them.
const BESIDE_A_CLOSURE: f64 = 0.03;
const BEATS: f64 = 1.25;
/// Beside any other, this share, and as much as any function could take.
const BESIDE_A_LAW: f64 = 0.003;
const MATCHES: f64 = 1.0;
/// What trees over the circumstances predict, held out, of what a fit leaves.
#[must_use]
pub fn flexible(setting: &Setting, fit: &Fit) -> HeldOut {
    let columns = setting.observed.circumstances().columns;
    let recorded = setting.observed.recorded();
    let circumstances = DMatrix::from_fn(recorded.len(), columns.len(), |i, j| columns[j][i]);
    let left: Vec<f64> = recorded
        .iter()
        .zip(&fit.predicted)
        .map(|(y, f)| y - f)
        .collect();
    let noise = setting.noise;
    let (whitener, blocks) = (&noise.whitener, &noise.sequence_blocks);
    trees::held_out(
        &circumstances,
        &left,
        whitener,
        blocks,
        FOLDS,
        trees::Options::default(),
    )
}

/// Held-out gain of one set of candidates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gain {
    /// Sum of log densities over those of the baseline.
    pub total: f64,
    /// Its standard error over blocks.
    pub error: f64,
    /// The sum without the block that gains most.
    pub without_best: f64,
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
    /// Against the baseline.
    pub gain: Gain,
    /// Whether each of its terms is large enough to act on.
    pub practical: bool,
}

impl Tried {
    /// The candidates that it is made of, in the order of their values.
    pub(crate) fn members<'c>(&self, candidates: &'c [Candidate]) -> Vec<&'c Candidate> {
        self.which.iter().map(|&k| &candidates[k]).collect()
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
    /// For each chosen term, the candidates that would do as well in its place, best first.
    pub alternatives: Vec<Vec<usize>>,
    /// The same with their fits.
    pub rivals: Vec<Vec<Tried>>,
    /// A second term that would predict more, by too small a part of the whole to be told from an error in the first one's form: not taken.
    pub withheld: Option<(usize, Gain)>,
}

impl Selection {
    /// Takes the choice back: nothing stands.
    pub fn withdraw(&mut self) {
        self.chosen = self.nothing.clone();
        self.alternatives.clear();
        self.rivals.clear();
        self.withheld = None;
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

/// Fits every candidate alone.
#[must_use]
pub fn singles(setting: &Setting, candidates: &[Candidate]) -> Singles {
    let nothing = nothing(setting);
    let attempt = |which: &[usize], starts: &[Vec<f64>]| {
        attempt(setting, candidates, &nothing, which, starts)
    };
    let mut singles: Vec<Tried> = (0..candidates.len())
        .into_par_iter()
        .filter_map(|k| attempt(&[k], &candidates[k].starts))
        .collect();
    singles.sort_by(|a, b| {
        let key = |tried: &Tried| (tried.practical, tried.gain.total);
        let ((pa, ga), (pb, gb)) = (key(a), key(b));
        pb.cmp(&pa).then(gb.total_cmp(&ga))
    });
    Singles { nothing, singles }
}

/// Tries pairs and chooses, with the gate's chance of as much structure in noise alone. Where it is all but certain that something is there, a
/// faint gain is enough to say what it may be.
#[must_use]
pub fn select(
    setting: &Setting,
    candidates: &[Candidate],
    tried: Singles,
    chance: f64,
) -> Selection {
    let Singles { nothing, singles } = tried;
    let attempt = |which: &[usize], starts: &[Vec<f64>]| {
        attempt(setting, candidates, &nothing, which, starts)
    };
    let none = || Selection {
        nothing: nothing.clone(),
        singles: singles.clone(),
        chosen: nothing.clone(),
        alternatives: Vec::new(),
        rivals: Vec::new(),
        withheld: None,
    };
    let Some(first) = singles.first().filter(|tried| tried.practical) else {
        return none();
    };
    // Two effects can mask one another, so pairs are tried even where no single stands out.
    let pairs = pairs(setting, candidates, &singles, &attempt);
    let best_pair = pairs
        .iter()
        .filter(|tried| tried.practical)
        .max_by(|a, b| a.gain.total.total_cmp(&b.gain.total));
    // What a function of the circumstances, without any physics, could still take from the best single.
    let left = |tried: &Tried| flexible(setting, &tried.fit).gain.total.max(0.0);
    let chosen = match best_pair {
        Some(pair) if both_needed(setting, candidates, pair, &singles, left(first), chance) => pair,
        _ if enough(&first.gain, chance) => first,
        _ if chance < FAINT_CHANCE && faint(&first.gain) => first,
        _ if chance < FAINT_CHANCE => match seen_once(&nothing, &singles) {
            Some(once) => once,
            None => return none(),
        },
        _ => return none(),
    };
    let withheld = best_pair
        .filter(|pair| chosen.which.len() == 1 && pair.which.contains(&chosen.which[0]))
        .and_then(|pair| {
            let second = *pair.which.iter().find(|k| !chosen.which.contains(k))?;
            let more = gain(setting, &pair.log_density, &chosen.log_density);
            enough(&more, chance).then_some((second, more))
        });
    let in_place: Vec<Tried> = match chosen.which[..] {
        [a, b] => beside(setting, candidates, &singles, &pairs, [a, b], &attempt),
        _ => Vec::new(),
    };
    let pool = Pool {
        singles: &singles,
        pairs: &[&pairs[..], &in_place].concat(),
    };
    let mut chosen = chosen.clone();
    for place in 0..chosen.which.len() {
        if let Some(preferred) = pool.preferred(setting, candidates, &chosen, place) {
            chosen = preferred;
        }
    }
    let ties = (0..chosen.which.len()).map(|place| pool.ties(setting, &chosen, place));
    let (alternatives, rivals) = ties
        .map(|ties| {
            let ties = ties.into_iter();
            ties.map(|(rival, tried)| (rival, tried.clone())).unzip()
        })
        .unzip();
    Selection {
        nothing: nothing.clone(),
        chosen,
        alternatives,
        singles,
        rivals,
        withheld,
    }
}

fn nothing(setting: &Setting) -> Tried {
    let fit = setting.nothing();
    Tried {
        which: Vec::new(),
        log_density: held_out(setting, &[], &fit, FOLDS),
        fit,
        gain: Gain {
            total: 0.0,
            error: 0.0,
            without_best: 0.0,
        },
        practical: true,
    }
}

pub(crate) fn attempt(
    setting: &Setting,
    candidates: &[Candidate],
    nothing: &Tried,
    which: &[usize],
    starts: &[Vec<f64>],
) -> Option<Tried> {
    let members: Vec<&Candidate> = which.iter().map(|&k| &candidates[k]).collect();
    let fit = setting.fit(&members, starts)?;
    let log_density = held_out(setting, &members, &fit, FOLDS);
    let gain = gain(setting, &log_density, &nothing.log_density);
    let mut rest = fit.values.as_slice();
    let mut practical = true;
    for member in members {
        let (own, others) = rest.split_at(member.parameters.len());
        practical &= member.size(own) >= 1.0;
        rest = others;
    }
    Some(Tried {
        which: which.to_vec(),
        fit,
        log_density,
        gain,
        practical,
    })
}

/// Gains in a few blocks alone have a large standard error whatever their size; a large one must not rest on one block.
fn enough(gain: &Gain, chance: f64) -> bool {
    let steady = gain.total > LEAST_ERRORS * gain.error;
    let rare = chance < RARE_CHANCE && gain.total > LARGE_GAIN && gain.without_best > LEAST_GAIN;
    gain.total > LEAST_GAIN && (steady || rare)
}

/// What is enough where the gate has shown that something is there.
fn faint(gain: &Gain) -> bool {
    gain.total > FAINT_GAIN.max(gain.error)
}

/// The likeliest single where something shows in one place only, so that no held-out block can speak for it.
fn seen_once<'a>(nothing: &Tried, singles: &'a [Tried]) -> Option<&'a Tried> {
    let practical = singles.iter().filter(|tried| tried.practical);
    practical
        .filter(|tried| 0.5 * (nothing.fit.cost - tried.fit.cost) > ONCE)
        .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))
}

/// Whether a pair beats each of its members alone, and the best single, by enough.
fn both_needed(
    setting: &Setting,
    candidates: &[Candidate],
    pair: &Tried,
    singles: &[Tried],
    left: f64,
    chance: f64,
) -> bool {
    if !enough(&pair.gain, chance) {
        return false;
    }
    let others = singles.iter().take(1).chain(
        singles
            .iter()
            .filter(|single| pair.which.contains(&single.which[0])),
    );
    let left = left.max(LEAST_GAIN);
    let mut needed = true;
    for single in others {
        let more = gain(setting, &pair.log_density, &single.log_density);
        let share = more.total / pair.gain.total;
        let (least, over) = if candidates[single.which[0]].closure_error > CLOSURE {
            (BESIDE_A_CLOSURE, BEATS)
        } else {
            (BESIDE_A_LAW, MATCHES)
        };
        let beats = share > least && more.total > over * left;
        let is_large = share > LEAST_SHARE || share > LARGE_SHARE && more.total > MOST * left;
        needed &= enough(&more, chance) && (is_large || beats);
    }
    needed
}

/// Log densities over others, block by block.
pub(crate) fn gain(setting: &Setting, log_density: &[f64], over: &[f64]) -> Gain {
    let mut blocks = vec![0.0; setting.noise.blocks];
    for ((a, b), &block) in log_density.iter().zip(over).zip(&setting.noise.block) {
        blocks[block] += a - b;
    }
    let count = blocks.len().max(2) as f64;
    let total: f64 = blocks.iter().sum();
    let mean = total / count;
    let variance = blocks.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
    Gain {
        total,
        error: (count * variance).sqrt(),
        without_best: total - blocks.iter().copied().fold(0.0, f64::max),
    }
}
