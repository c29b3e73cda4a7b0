//! How good answers are, given the truth: one case, then all of them.
//!
//! | metric | of | a hit |
//! | --- | --- | --- |
//! | false alarms | recordings without an injected effect | any verdict but none |
//! | accusations | only an instrument is at fault | an effect of the air is named |
//! | detected | χ² of 25 (200) and more | any verdict but none |
//! | named | in the library, 25 and more | every effect has its own name in first place |
//! | in the set | the same | or among the alternatives printed with one |
//! | spurious | in the library | more effects than there are, one of them nowhere right |
//! | location | 25 and more | mean of intersection over union of the rows |
//! | skill | in the library, 25 and more | `1 - Σ(p - t)²/σ² / Σ(b - t)²/σ²` of prediction, truth, baseline, noise |
//! | covered | parameters defined alike, effect named | true value within the interval |
//! | outside | not in the library, 25 and more | verdict outside_library |
//! | rises, at bound | answers other than none | the held-out error rises; a parameter at its bound |
//! | masked | one effect takes back the other, 25 and more | named |

mod table;

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

pub use table::Metric;

use crate::answer::{Answer, Named};
use crate::names::canonical;
use crate::truth::{DETECTABLE_CHI2, Injected, Truth};
use diagnosis::infer::candidates::is_sensor;
use diagnosis::infer::finding::{Estimate, Verdict};
use diagnosis::statistics::quantile::quantile;

/// From here on (χ²) nearly nothing may be missed.
const PLAIN_CHI2: f64 = 200.0;
/// Families of pairs in which one effect takes back what the other does begin with this.
const MASKED: &str = "masked";
/// Recordings of so many samples and more count for the time.
pub const LONG_SAMPLES: usize = 3500;

/// One answer, assessed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Assessed {
    /// Kind of recording.
    pub family: String,
    /// What was injected: [`Truth::label`].
    pub truth: String,
    /// What was answered: names joined by `+`, `none` or `outside_library`.
    pub answered: String,
    /// The verdict.
    pub verdict: Verdict,
    /// [`Truth::oracle_chi2`].
    pub oracle_chi2: f64,
    /// Whether only an instrument is at fault.
    pub is_sensor_only: bool,
    /// Whether it is in no library.
    pub is_outside: bool,
    /// Whether something other than "none" was answered.
    pub detected: bool,
    /// Whether every effect was named, each by its own first name.
    pub named: bool,
    /// Whether every effect was at least among the names printed.
    pub in_set: bool,
    /// Whether there were more effects than there are, one of them nowhere right.
    pub spurious: bool,
    /// Whether an effect of the air was named that is not there.
    pub accused: bool,
    /// Intersection over union of the rows; `None`: the truth has no rows.
    pub location: Option<f64>,
    /// Part of the baseline's error that the prediction takes away; `None`: there is none.
    pub skill: Option<f64>,
    /// Parameters whose interval holds the true value, of those that are defined alike.
    pub covered: Share,
    /// [`Answer::rises`].
    pub rises: bool,
    /// [`Answer::at_bound`].
    pub at_bound: bool,
    /// Rows.
    pub samples: usize,
    /// Time taken (s).
    pub seconds: f64,
}

/// So many of so many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Share {
    /// So many.
    pub hits: usize,
    /// Of so many.
    pub of: usize,
}

impl Share {
    /// `None` of none.
    #[must_use]
    pub fn rate(self) -> Option<f64> {
        (self.of > 0).then(|| self.hits as f64 / self.of as f64)
    }

    fn count(&mut self, hit: bool) {
        self.hits += usize::from(hit);
        self.of += 1;
    }
}

/// All answers, assessed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Recordings without an injected effect and were said to.
    pub false_alarms: Share,
    /// Faults of instruments that were put on the air.
    pub accusations: Share,
    /// Found, of those that can be.
    pub detected: Share,
    /// Found, of those that are plain to see.
    pub detected_plain: Share,
    /// Every effect named in first place.
    pub named: Share,
    /// Every effect within what is printed.
    pub in_set: Share,
    /// An effect too many.
    pub spurious: Share,
    /// Mean intersection over union.
    pub location: Option<f64>,
    /// Median skill.
    pub skill_median: Option<f64>,
    /// Skill that one in ten stays below.
    pub skill_tenth: Option<f64>,
    /// Intervals that hold the true value.
    pub covered: Share,
    /// Said to be outside the library, of those that are.
    pub outside: Share,
    /// Masked pairs with both named.
    pub masked: Share,
    /// Answers that name something and predict held-out readings worse than before.
    pub rises: Share,
    /// Answers with a parameter at its bound.
    pub at_bound: Share,
    /// How often each truth got each answer.
    pub confusion: BTreeMap<String, BTreeMap<String, usize>>,
    /// Every case, in order.
    pub cases: Vec<Assessed>,
}

impl Assessed {
    /// Assesses one answer.
    #[must_use]
    pub fn of(truth: &Truth, answer: &Answer) -> Assessed {
        let effects = match answer.verdict {
            Verdict::Library | Verdict::Ambiguous => &answer.effects[..],
            Verdict::None | Verdict::OutsideLibrary => &[],
        };
        let first = pairing(&truth.effects, effects, is_right);
        let within = pairing(&truth.effects, effects, is_within);
        let is_true = |named: &Named| truth.effects.iter().any(|of| is_right(of, named));
        let nowhere_right = |named: &&Named| !truth.effects.iter().any(|of| is_within(of, named));
        let is_complete = |pairs: &[Option<usize>]| {
            !truth.effects.is_empty() && pairs.iter().all(Option::is_some)
        };
        let mut covered = Share::default();
        for (of, named) in truth.effects.iter().zip(&first) {
            let Some(named) = named.map(|at| &effects[at]) else {
                continue;
            };
            for (name, value) in &of.parameters {
                if let Some(Estimate { low, high, .. }) = named.parameters.get(name) {
                    covered.count((*low..=*high).contains(value));
                }
            }
        }
        Assessed {
            family: truth.family.clone(),
            truth: truth.label(),
            answered: label(answer.verdict, effects),
            verdict: answer.verdict,
            oracle_chi2: truth.oracle_chi2,
            is_sensor_only: truth.is_sensor_only(),
            is_outside: truth.is_outside,
            detected: answer.verdict != Verdict::None,
            named: is_complete(&first),
            in_set: is_complete(&within),
            spurious: effects.len() > truth.effects.len()
                && effects.iter().any(|named| nowhere_right(&named)),
            accused: effects
                .iter()
                .any(|named| !is_sensor(&named.name) && !is_true(named)),
            location: location(&truth.region, &answer.region),
            skill: skill(truth, &answer.prediction),
            covered,
            rises: answer.rises,
            at_bound: answer.at_bound,
            samples: truth.truth_clean.len(),
            seconds: answer.seconds,
        }
    }

    /// Whether it is worth a look: a false alarm, or something that can be seen and was not said
    /// rightly.
    #[must_use]
    pub fn is_missed(&self) -> bool {
        if self.is_null() {
            return self.detected;
        }
        let right = if self.is_outside {
            self.verdict == Verdict::OutsideLibrary
        } else {
            self.named && !self.spurious
        };
        !right && (self.detected || self.oracle_chi2 >= DETECTABLE_CHI2)
    }

    /// Whether no effect was injected.
    #[must_use]
    pub fn is_null(&self) -> bool {
        self.truth == "none"
    }
}

impl Metrics {
    /// Adds cases up, in their order.
    #[must_use]
    pub fn over(cases: Vec<Assessed>) -> Metrics {
        let share = |among: &dyn Fn(&Assessed) -> bool, hit: &dyn Fn(&Assessed) -> bool| {
            let mut share = Share::default();
            cases
                .iter()
                .filter(|case| among(case))
                .for_each(|case| share.count(hit(case)));
            share
        };
        let injects = |case: &Assessed| !case.is_null();
        let visible = |case: &Assessed| injects(case) && case.oracle_chi2 >= DETECTABLE_CHI2;
        let in_library = |case: &Assessed| visible(case) && !case.is_outside;
        let masks = |case: &Assessed| visible(case) && case.family.starts_with(MASKED);
        let detected = |case: &Assessed| case.detected;
        let named = |case: &Assessed| case.named;
        let locations = cases
            .iter()
            .filter(|case| visible(case))
            .filter_map(|case| case.location);
        let locations: Vec<f64> = locations.collect();
        let skills = cases
            .iter()
            .filter(|case| in_library(case))
            .filter_map(|case| case.skill);
        let mut skills: Vec<f64> = skills.collect();
        skills.sort_by(f64::total_cmp);
        let mut confusion: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
        for case in &cases {
            let row = confusion.entry(case.truth.clone()).or_default();
            *row.entry(case.answered.clone()).or_default() += 1;
        }
        let covered = cases.iter().fold(Share::default(), |sum, case| Share {
            hits: sum.hits + case.covered.hits,
            of: sum.of + case.covered.of,
        });
        Metrics {
            false_alarms: share(&|case| case.is_null(), &detected),
            accusations: share(&|case| case.is_sensor_only, &|case| case.accused),
            detected: share(&visible, &detected),
            detected_plain: share(
                &|case| injects(case) && case.oracle_chi2 >= PLAIN_CHI2,
                &detected,
            ),
            named: share(&in_library, &named),
            in_set: share(&in_library, &|case| case.in_set),
            spurious: share(&|case| injects(case) && !case.is_outside, &|case| {
                case.spurious
            }),
            location: (!locations.is_empty())
                .then(|| locations.iter().sum::<f64>() / locations.len() as f64),
            skill_median: quantile(&skills, 0.5),
            skill_tenth: quantile(&skills, 0.1),
            covered,
            outside: share(&|case| visible(case) && case.is_outside, &|case| {
                case.verdict == Verdict::OutsideLibrary
            }),
            masked: share(&masks, &named),
            rises: share(&detected, &|case| case.rises),
            at_bound: share(&detected, &|case| case.at_bound),
            confusion,
            cases,
        }
    }
}

fn is_right(of: &Injected, named: &Named) -> bool {
    of.accepted.contains(&named.name)
}

fn is_within(of: &Injected, named: &Named) -> bool {
    is_right(of, named)
        || named
            .alternatives
            .iter()
            .any(|name| of.accepted.contains(name))
}

/// For each truth the named effect that is its own, as many as possible: augmenting paths (a
/// handful of each).
fn pairing(
    truths: &[Injected],
    named: &[Named],
    fits: fn(&Injected, &Named) -> bool,
) -> Vec<Option<usize>> {
    let mut owner: Vec<Option<usize>> = vec![None; named.len()];
    for truth in 0..truths.len() {
        let mut tried = vec![false; named.len()];
        assign(
            truth,
            &|of, at| fits(&truths[of], &named[at]),
            &mut owner,
            &mut tried,
        );
    }
    let of_truth = |truth: usize| owner.iter().position(|&of| of == Some(truth));
    (0..truths.len()).map(of_truth).collect()
}

fn assign(
    truth: usize,
    fits: &dyn Fn(usize, usize) -> bool,
    owner: &mut [Option<usize>],
    tried: &mut [bool],
) -> bool {
    for at in 0..owner.len() {
        if tried[at] || !fits(truth, at) {
            continue;
        }
        tried[at] = true;
        let is_free = match owner[at] {
            None => true,
            Some(other) => assign(other, fits, owner, tried),
        };
        if is_free {
            owner[at] = Some(truth);
            return true;
        }
    }
    false
}

fn label(verdict: Verdict, effects: &[Named]) -> String {
    let mut names: Vec<&str> = effects.iter().map(|named| canonical(&named.name)).collect();
    names.sort_unstable();
    match verdict {
        Verdict::None | Verdict::OutsideLibrary => verdict.as_str().to_owned(),
        Verdict::Library | Verdict::Ambiguous if names.is_empty() => verdict.as_str().to_owned(),
        Verdict::Library | Verdict::Ambiguous => names.join("+"),
    }
}

fn location(truth: &[usize], answer: &[usize]) -> Option<f64> {
    let truth: BTreeSet<usize> = truth.iter().copied().collect();
    let answer: BTreeSet<usize> = answer.iter().copied().collect();
    let both = truth.intersection(&answer).count();
    let either = truth.len() + answer.len() - both;
    (!truth.is_empty()).then(|| both as f64 / either as f64)
}

fn skill(truth: &Truth, prediction: &[f64]) -> Option<f64> {
    let (mut left, mut before) = (0.0, 0.0);
    for (row, &true_value) in truth.truth_clean.iter().enumerate() {
        let (baseline, noise) = (truth.baseline_clean[row], truth.noise[row]);
        let predicted = prediction
            .get(row)
            .copied()
            .filter(|value| value.is_finite());
        left += ((predicted.unwrap_or(baseline) - true_value) / noise).powi(2);
        before += ((baseline - true_value) / noise).powi(2);
    }
    (!truth.effects.is_empty() && before > 0.0).then(|| 1.0 - left / before)
}

#[cfg(test)]
mod tests;
