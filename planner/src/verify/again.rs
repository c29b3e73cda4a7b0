//! A plan that changes while it is flown, verified again: a drone is judged anew where it, or one
//! that may touch it or reach it with its air, has changed, comes near or has gone.
//!
//! The judgement of a drone depends on its own flight, on the flights near it ([`encounters_of`])
//! and on what the whole plan shares. After the last time all rest: a longer rest changes nothing.
//! Another flight matters up to the end of the last encounter with it, advected air included; since
//! when it differs follows from the last break point that both have.

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use super::Judgement;
use super::extents::Span;
use super::scene::Scene;
use super::time::encounters::{Encounter, encounters_of};
use super::time::spans::join;
use crate::plan::{DronePlan, Plan, TrajectoryEntry, Violation};

/// The judgement of every drone of a plan whose places, air and margins stay as they are. Copies
/// share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Judgements {
    of_drones: FxHashMap<String, Arc<KeptJudgement>>,
}

/// The judgement of one drone, and what it depends on.
#[derive(Debug)]
struct KeptJudgement {
    judgement: Arc<Judgement>,
    /// The judged flight.
    flown: FlownEntry,
    /// The flights near it, by name, and until when (s).
    near: Vec<(String, f64)>,
}

/// What a drone flies, as far as other drones and limits depend on it.
#[derive(Clone, Debug, PartialEq)]
struct FlownEntry {
    entry: DronePlan,
    is_unplanned: bool,
}

impl FlownEntry {
    /// Of the drone with this index.
    fn of(plan: &Plan, index: usize) -> FlownEntry {
        let drone = &plan.drones[index];
        let is_unplanned = plan.is_unplanned(&drone.name);
        // Results are not part of it.
        let entry = DronePlan {
            arrives_s: 0.0,
            alone_s: 0.0,
            waits_s: 0.0,
            detour_m: 0.0,
            worst_air_mps: 0.0,
            worst_air_from: None,
            worst_air_at_s: None,
            dose_m: 0.0,
            extra_energy_j: 0.0,
            extra_energy_percent: 0.0,
            may_be_late_s: None,
            ..drone.clone()
        };
        FlownEntry {
            entry,
            is_unplanned,
        }
    }

    /// When the other begins to differ (s); infinite if never.
    fn differs_s(&self, other: &FlownEntry) -> f64 {
        if self == other {
            return f64::INFINITY;
        }
        let [mine, theirs] = [&self.entry, &other.entry];
        let whole = |it: &DronePlan| DronePlan {
            at_end: mine.at_end,
            airborne_s: (it.airborne_s.0, None),
            landed_s: Vec::new(),
            trajectory: TrajectoryEntry::default(),
            ..it.clone()
        };
        if self.is_unplanned != other.is_unplanned || whole(mine) != whole(theirs) {
            return f64::NEG_INFINITY;
        }
        let [one, two] = [&mine.trajectory, &theirs.trajectory];
        let is_same = |k: &usize| {
            one.t_s.get(*k) == two.t_s.get(*k)
                && one.position_m.get(*k) == two.position_m.get(*k)
                && one.mass_kg.get(*k) == two.mass_kg.get(*k)
                && one.control_m.get(*k) == two.control_m.get(*k)
        };
        let shorter = one.t_s.len().min(two.t_s.len());
        let same = (0..shorter).take_while(is_same).count();
        // The piece that begins at the last common point may differ already.
        let Some(last) = same.checked_sub(1) else {
            return f64::NEG_INFINITY;
        };
        let ends_s = |it: &DronePlan| it.airborne_s.1.unwrap_or(f64::INFINITY);
        let rests = (0..).map(|k| [mine, theirs].map(|it| it.landed_s.get(k)));
        let mut rests = rests.take_while(|both| *both != [None; 2]);
        let other = rests.find(|[mine, theirs]| mine != theirs);
        let rests_s = other.into_iter().flatten().flatten().map(|rest| rest.0);
        let until_s = rests_s.fold(one.t_s[last], f64::min);
        until_s.min(ends_s(mine)).min(ends_s(theirs))
    }
}

/// What still holds of a flight.
pub(super) enum Validity {
    /// The whole judgement.
    True(Arc<Judgement>),
    /// Its violations, all before these spans (s, in order of time); it breaks nothing else outside
    /// of them. With `another` the flight itself differs in the last span: what it breaks by itself
    /// is unknown.
    During {
        before: Arc<Judgement>,
        spans_s: Vec<Span>,
        another: bool,
    },
    /// Nothing is known.
    Unknown,
}

/// What still holds of the flights of a plan, and the encounters of the others.
pub(super) struct ValidJudgements {
    /// By flight.
    pub(super) validity: Vec<Validity>,
    /// Encounters of each flight to judge.
    pub(super) near: Vec<Vec<Encounter>>,
}

impl Judgements {
    /// Keeps what still holds once a plan has lost its history: each drone begins where it rested,
    /// and drones that had left are gone. A drone that broke nothing breaks nothing from then on;
    /// the others are to be judged anew.
    pub(crate) fn forget(&mut self, plan: &Plan) {
        let mut before = std::mem::take(&mut self.of_drones);
        let there: FxHashSet<&str> = plan.drones.iter().map(|it| &it.name[..]).collect();
        for (index, drone) in plan.drones.iter().enumerate() {
            let known = before.remove(&drone.name);
            let is_sound = |it: &Arc<KeptJudgement>| {
                it.judgement.found.is_empty() && it.judgement.omitted == 0
            };
            if let Some(known) = known.filter(is_sound) {
                let near = known.near.iter();
                let near = near.filter(|(other, _)| there.contains(&other[..]));
                let kept = KeptJudgement {
                    judgement: Arc::clone(&known.judgement),
                    flown: FlownEntry::of(plan, index),
                    near: near.cloned().collect(),
                };
                self.of_drones.insert(drone.name.clone(), Arc::new(kept));
            }
        }
    }

    /// What still holds of a plan that was read, where both clocks of a pair may differ by up to
    /// `apart_s` (s).
    pub(super) fn still_valid(
        &self,
        plan: &Plan,
        scene: &Scene<'_>,
        apart_s: f64,
    ) -> ValidJudgements {
        let flights = &scene.flights;
        let known = |k: usize| self.of_drones.get(&flights[k].name);
        // From when on each flight differs (s).
        let differs_s = |k: usize| match known(k) {
            Some(known) => known
                .flown
                .differs_s(&FlownEntry::of(plan, flights[k].index)),
            // It was not there before it begins.
            None => {
                let first = flights[k].trajectory.pieces().first();
                first.map_or(f64::NEG_INFINITY, |it| it.motion.from_s)
            }
        };
        let differs_s: Vec<f64> = (0..flights.len()).map(differs_s).collect();
        let by_name = flights.iter().zip(&differs_s);
        let by_name: FxHashMap<&str, f64> = by_name.map(|(it, s)| (&it.name[..], *s)).collect();
        let of_other_s = |name: &str| by_name.get(name).copied().unwrap_or(f64::NEG_INFINITY);
        let first_s = differs_s.iter().copied().fold(f64::INFINITY, f64::min);
        let is_changed = |k: usize| differs_s[k] < f64::INFINITY;
        let with_changed = encounters_of(scene, apart_s, first_s, &is_changed);
        let validity = |k: usize| {
            let Some(known) = known(k).filter(|_| differs_s[k] > f64::NEG_INFINITY) else {
                return Validity::Unknown;
            };
            let another = differs_s[k] < f64::INFINITY;
            // A clock may be ahead. New encounters of a changed flight end after the change: the
            // kept ones stay complete.
            let is_over = |differs_s: f64, until_s: f64| until_s + apart_s < differs_s;
            let before = known.near.iter();
            let before = before.map(|(other, until_s)| (of_other_s(other), *until_s));
            let was = before.filter(|it| !is_over(it.0, it.1));
            let was_s = was.map(|it| it.0).fold(f64::INFINITY, f64::min);
            let now = with_changed[k].iter();
            let mut spans_s: Vec<Span> = now
                .filter(|it| differs_s[it.other] < f64::INFINITY)
                .filter(|it| !is_over(differs_s[it.other], it.span_s.1))
                .map(|it| (it.span_s.0.max(differs_s[it.other] - apart_s), it.span_s.1))
                .collect();
            if was_s == f64::INFINITY && spans_s.is_empty() && !another {
                return Validity::True(Arc::clone(&known.judgement));
            }
            // What ended before the first change stays; after it, less air and fewer bodies break
            // nothing.
            let since_s = was_s.min(differs_s[k]) - apart_s;
            let since_s = spans_s.iter().map(|it| it.0).fold(since_s, f64::min);
            let mut broken = known.judgement.found.iter();
            let is_past = |it: &Violation| it.until_s.is_some_and(|it| it < since_s);
            if known.judgement.omitted > 0 || !broken.all(is_past) {
                return Validity::Unknown;
            }
            if another {
                spans_s.push((differs_s[k] - apart_s, f64::INFINITY));
            }
            spans_s.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut joined = Vec::new();
            spans_s.into_iter().for_each(|it| join(&mut joined, it));
            let spans_s = joined;
            Validity::During {
                before: Arc::clone(&known.judgement),
                spans_s,
                another,
            }
        };
        let validity: Vec<Validity> = (0..flights.len()).map(validity).collect();
        let is_judged = |k: usize| !matches!(validity[k], Validity::True(_));
        let near = encounters_of(scene, apart_s, f64::NEG_INFINITY, &is_judged);
        ValidJudgements { validity, near }
    }

    /// Keeps the judgements of the flights of a plan for the next time.
    pub(super) fn keep(
        &mut self,
        plan: &Plan,
        scene: &Scene<'_>,
        near: &[Vec<Encounter>],
        judged: &[Arc<Judgement>],
    ) {
        let mut before = std::mem::take(&mut self.of_drones);
        for ((flight, near), judgement) in scene.flights.iter().zip(near).zip(judged) {
            let known = before.remove(&flight.name);
            let known = known.filter(|it| Arc::ptr_eq(&it.judgement, judgement));
            let kept = known.unwrap_or_else(|| {
                let others = near.iter();
                let others = others.map(|it| (scene.flights[it.other].name.clone(), it.span_s.1));
                Arc::new(KeptJudgement {
                    judgement: Arc::clone(judgement),
                    flown: FlownEntry::of(plan, flight.index),
                    near: others.collect(),
                })
            });
            self.of_drones.insert(flight.name.clone(), kept);
        }
    }
}
