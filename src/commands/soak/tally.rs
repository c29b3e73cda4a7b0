//! What is counted while a fleet lives, and how it is reported.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use diagnosis::statistics::quantile::nearest_rank;
use flight::report::{DroneFlight, Flight};
use planner::plan::{Violation, ViolationKind};
use serde_json::{Value, json};
use service::message::Patch;

use crate::io::watch::resident_memory_bytes;

/// Memory may grow by so much in one of the last two thirds of the time (ratio). Chosen here: an
/// allocator keeps what the largest patch so far took, so it rises in steps; what is never given
/// back rises all along, by a fifth over both.
const FLAT: f64 = 1.1;
/// A contact in flight is what a patch has told from so long before to so long after it (s). Chosen
/// here: what drones in flight are off their plans.
const TOLD_S: f64 = 1.0;
/// Faults listed of each kind: chosen here, a screen's worth.
const MOST_LISTED: usize = 20;
/// From how many looks at it on memory is judged, chosen here: before, a fleet still fills what it
/// has.
const MOST_LOOKS: usize = 20;

/// A look at the plan.
struct Look {
    at_s: f64,
    drones: usize,
    points: usize,
    off_m: f64,
    violations: Vec<String>,
    memory_bytes: Option<u64>,
}

/// What was counted.
pub(super) struct Tally {
    pub(super) deadline_s: f64,
    pub(super) opened: Duration,
    /// CPU time of the whole life, verified once more at every look (s).
    pub(super) cpu_s: Option<f64>,
    took: Vec<Duration>,
    late: usize,
    happened: BTreeMap<String, usize>,
    refused: BTreeMap<String, usize>,
    /// What was said with that.
    why: BTreeSet<String>,
    without_path: usize,
    /// In words, and as it was told.
    unavoidable: BTreeMap<String, Violation>,
    looks: Vec<Look>,
    /// Requests that had to be refused, and those that were not as they should.
    pub(super) faults: usize,
    pub(super) faults_taken: Vec<String>,
    pub(super) replayed: Option<bool>,
    pub(super) flight: Option<Flight>,
}

/// Whether memory (bytes), looked at in even steps, does not grow all along.
fn is_flat(looks: &[u64]) -> bool {
    let last = looks.len() - 1;
    let thirds = [last / 3, last * 2 / 3, last].map(|at| looks[at] as f64);
    thirds.windows(2).any(|it| it[1] <= FLAT * it[0])
}

impl Tally {
    pub(super) fn new(deadline_s: f64) -> Tally {
        Tally {
            deadline_s,
            opened: Duration::ZERO,
            cpu_s: None,
            took: Vec::new(),
            late: 0,
            happened: BTreeMap::new(),
            refused: BTreeMap::new(),
            why: BTreeSet::new(),
            without_path: 0,
            unavoidable: BTreeMap::new(),
            looks: Vec::new(),
            faults: 0,
            faults_taken: Vec::new(),
            replayed: None,
            flight: None,
        }
    }

    pub(super) fn happened(&mut self, change: &Value) {
        let kind = change.as_object().and_then(|it| it.keys().next());
        *self
            .happened
            .entry(kind.cloned().unwrap_or_default())
            .or_default() += 1;
    }

    pub(super) fn patched(&mut self, patch: &Patch, took: Duration) {
        self.count(took);
        self.without_path += patch.refused.len();
        let told = patch.unavoidable.iter();
        (self.unavoidable).extend(told.map(|it| (it.to_string(), it.clone())));
    }

    pub(super) fn refused(&mut self, code: &str, message: &str, took: Duration) {
        *self.refused.entry(code.to_owned()).or_default() += 1;
        self.why.insert(format!("{code}: {message}"));
        self.late += usize::from(took.as_secs_f64() > self.deadline_s);
    }

    fn count(&mut self, took: Duration) {
        self.took.push(took);
        self.late += usize::from(took.as_secs_f64() > self.deadline_s);
    }

    /// A patch said that it cannot be avoided.
    pub(super) fn is_unavoidable(&self, violation: &str) -> bool {
        self.unavoidable.contains_key(violation)
    }

    /// Whether a patch told this kind of conflict of a drone with another at about a time (s).
    fn was_told(
        &self,
        kind: ViolationKind,
        (drone, with): (&str, Option<&str>),
        at_s: Option<f64>,
    ) -> bool {
        let is_then = |it: &Violation| {
            let until_s = it.until_s.unwrap_or(f64::INFINITY);
            at_s.is_some_and(|at_s| it.from_s - TOLD_S <= at_s && at_s <= until_s + TOLD_S)
        };
        self.unavoidable.values().any(|it| {
            let told = (Some(&*it.drone), it.with.as_deref());
            let is_of_kind = it.kind.without_margin() == kind;
            is_of_kind
                && is_then(it)
                && (told == (Some(drone), with) || told == (with, Some(drone)))
        })
    }

    fn touch_was_told(&self, it: &DroneFlight) -> bool {
        let pair = (&*it.name, it.least_gap_to.as_deref());
        self.was_told(ViolationKind::Collision, pair, it.least_gap_at_s)
    }

    fn air_was_told(&self, it: &DroneFlight) -> bool {
        let pair = (&*it.name, it.worst_from.as_deref());
        self.was_told(ViolationKind::Air, pair, it.worst_at_s)
    }

    /// Whether it flew into something that no patch had told.
    fn flew_badly(&self, it: &DroneFlight) -> bool {
        it.touches() && !self.touch_was_told(it) || it.over_limit_s > 0.0 && !self.air_was_told(it)
    }

    pub(super) fn examined(
        &mut self,
        at_s: f64,
        drones: usize,
        points: usize,
        off_m: f64,
        violations: Vec<String>,
    ) {
        self.looks.push(Look {
            at_s,
            drones,
            points,
            off_m,
            violations,
            memory_bytes: resident_memory_bytes(),
        });
    }

    fn quantile_s(&self, share: f64) -> f64 {
        let mut took_s: Vec<f64> = self.took.iter().map(Duration::as_secs_f64).collect();
        took_s.sort_unstable_by(f64::total_cmp);
        nearest_rank(&took_s, share).unwrap_or(0.0)
    }

    fn is_flat(&self) -> bool {
        let all: Vec<u64> = self.looks.iter().filter_map(|it| it.memory_bytes).collect();
        all.len() < MOST_LOOKS || is_flat(&all)
    }

    fn violations(&self) -> Vec<&String> {
        self.looks.iter().flat_map(|it| &it.violations).collect()
    }

    fn off_m(&self) -> f64 {
        self.looks.iter().map(|it| it.off_m).fold(0.0, f64::max)
    }

    pub(super) fn is_in_order(&self) -> bool {
        let flown = |it: &Flight| {
            it.fleet.in_obstacles == 0 && !it.drones.iter().any(|it| self.flew_badly(it))
        };
        self.late == 0
            && !self.took.is_empty()
            && self.violations().is_empty()
            && self.off_m() < 1e-6
            && self.faults_taken.is_empty()
            && self.is_flat()
            && self.replayed != Some(false)
            && self.flight.as_ref().is_none_or(flown)
    }

    pub(super) fn json(&self, minutes: f64) -> Value {
        let looks = self.looks.iter().map(|it| {
            json!({
                "at_s": it.at_s, "drones": it.drones, "break_points": it.points,
                "copy_off_m": it.off_m, "violations": it.violations,
                "memory_bytes": it.memory_bytes,
            })
        });
        let busy_s: f64 = self.took.iter().map(Duration::as_secs_f64).sum();
        json!({
            "format": "soak/1",
            "is_in_order": self.is_in_order(),
            "minutes": minutes,
            "opened_s": self.opened.as_secs_f64(),
            "changes": self.happened,
            "patches": self.took.len(),
            "patch_s": {
                "p50": self.quantile_s(0.5), "p99": self.quantile_s(0.99),
                "longest": self.quantile_s(1.0), "all": busy_s,
            },
            "cpu_s": self.cpu_s,
            "deadline_s": self.deadline_s,
            "late": self.late,
            "refused": self.refused,
            "refused_because": self.why,
            "drones_without_path": self.without_path,
            "unavoidable": self.unavoidable.keys().collect::<Vec<_>>(),
            "faults": self.faults,
            "faults_taken": self.faults_taken,
            "is_replayed": self.replayed,
            "looks": looks.collect::<Vec<Value>>(),
            "flight": self.flight.as_ref().map(|it| &it.fleet),
        })
    }

    pub(super) fn text(&self, minutes: f64) -> String {
        let listed = |all: &BTreeMap<String, usize>| {
            let all: Vec<String> = all
                .iter()
                .map(|(what, count)| format!("{count} {what}"))
                .collect();
            if all.is_empty() {
                "none".to_owned()
            } else {
                all.join(", ")
            }
        };
        let mut lines = vec![
            format!(
                "{minutes} min, opened in {:.2} s",
                self.opened.as_secs_f64()
            ),
            format!("changes: {}", listed(&self.happened)),
            format!(
                "patches: {}, p50 {:.3} s, p99 {:.3} s, longest {:.3} s; {} over {} s",
                self.took.len(),
                self.quantile_s(0.5),
                self.quantile_s(0.99),
                self.quantile_s(1.0),
                self.late,
                self.deadline_s
            ),
            format!("requests refused: {}", listed(&self.refused)),
            format!(
                "drones without a path to what was asked: {}",
                self.without_path
            ),
            format!("too late to avoid: {}", self.unavoidable.len()),
            format!(
                "faults injected: {}, refused as they should be: {}",
                self.faults,
                self.faults - self.faults_taken.len()
            ),
        ];
        lines.extend(self.faults_taken.iter().map(|it| format!("  {it}")));
        lines.extend(
            self.why
                .iter()
                .take(MOST_LISTED)
                .map(|it| format!("  {it}")),
        );
        lines.push("  at (s)  drones  break points  memory (MiB)  violations".to_owned());
        for it in &self.looks {
            let memory = it
                .memory_bytes
                .map_or("unknown".to_owned(), |it| (it >> 20).to_string());
            lines.push(format!(
                "{:>8.0}  {:>6}  {:>12}  {memory:>12}  {:>10}",
                it.at_s,
                it.drones,
                it.points,
                it.violations.len()
            ));
        }
        lines.extend(
            self.violations()
                .into_iter()
                .take(MOST_LISTED)
                .map(|it| format!("  violated: {it}")),
        );
        lines.push(format!(
            "copy kept by patches: {:.1e} m off at most",
            self.off_m()
        ));
        if !self.is_flat() {
            lines.push("memory grows".to_owned());
        }
        if self.took.is_empty() {
            lines.push("nothing was tried: there was no patch in this time".to_owned());
        }
        if let Some(is_replayed) = self.replayed {
            let same = if is_replayed {
                "the same bytes"
            } else {
                "another plan"
            };
            lines.push(format!("journal replayed: {same}"));
        }
        if let Some(Flight {
            fleet: it, drones, ..
        }) = &self.flight
        {
            lines.push(format!(
                "flown in closed loop: {} drones, {} touch another, {} an obstacle, {} over their limit of air; off the plan by {:.2} m at most",
                it.flown, it.touching, it.in_obstacles, it.over_limit, it.tracking_max_m
            ));
            let told = |was_told| {
                if was_told {
                    ", as a patch had told"
                } else {
                    ""
                }
            };
            let touching = drones.iter().filter(|it| it.touches());
            for it in touching.take(MOST_LISTED) {
                lines.push(format!(
                    "  {} touches {} at {:.1} s, {:.2} m deep{}",
                    it.name,
                    it.least_gap_to.as_deref().unwrap_or("another"),
                    it.least_gap_at_s.unwrap_or_default(),
                    -it.least_gap_m.unwrap_or_default(),
                    told(self.touch_was_told(it))
                ));
            }
            let over = drones.iter().filter(|it| it.over_limit_s > 0.0);
            for it in over.take(MOST_LISTED) {
                lines.push(format!(
                    "  {} is over its limit for {:.2} s: {:.2} of its induced velocity, of {:.2}{}",
                    it.name,
                    it.over_limit_s,
                    it.worst_alpha,
                    it.air_limit,
                    told(self.air_was_told(it))
                ));
            }
        }
        lines.push(String::new());
        lines.join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_no_leak_and_a_leak_is_one() {
        let step = |at: usize| (0..21).map(|k| if k < at { 66 } else { 101 }).collect();
        let looks: Vec<Vec<u64>> = (0..21).map(step).collect();
        assert!(looks.iter().all(|it| is_flat(it)));
        let leak = |rate: u64| (0..21).map(|k| 1000 + rate * k).collect::<Vec<u64>>();
        assert!(is_flat(&leak(3)) && !is_flat(&leak(20)));
    }
}
