//! What happens to a fleet: tasks, delays, drones that come, land, fail and are carried off, and
//! requests that no client should send.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use diagnosis::statistics::draws::Draws;
use nalgebra::Point3;
use planner::Plan;
use planner::plan::{AtEnd, TrajectoryEntry};
use serde_json::{Value, json};
use service::message::{Answer, Code, Patch, Record, Told};
use service::{Handled, Service};

use super::tally::Tally;

/// Tries to find a free place: chosen here.
const TRIES: usize = 30;
/// How far apart two drones' last places are at least, seen from above (m): bodies, columns and
/// margins of an Offboard 2, in cells of 1 m.
const APART_M: f64 = 1.4;
/// How long a wreck lies (s): chosen here.
const LIES_S: f64 = 30.0;
/// Largest delay (s), chosen here: what a fleet that looks at itself every second does not see
/// before.
const LATEST_S: f64 = 0.6;
/// How much longer a copy of the plan is compared with it (s): chosen here.
const AHEAD_S: f64 = 60.0;

/// What a client knows of a drone.
struct KnownDrone {
    trajectory: TrajectoryEntry,
    at_end: AtEnd,
    /// When it failed, of a wreck, or was sent to land (s).
    since_s: Option<f64>,
}

/// A fleet's life so far.
pub(super) struct Life {
    service: Service,
    draws: Draws,
    /// At most so many.
    most: usize,
    /// A client's copy of the plan, kept by patches alone.
    known: BTreeMap<String, KnownDrone>,
    records: Vec<Record>,
    /// Free columns (m).
    columns: Vec<[f64; 2]>,
    revision: u64,
    at_s: f64,
    named: u64,
    model: String,
}

impl Life {
    /// Opens a scenario; an answer that is no plan is handed back.
    pub(super) fn new(
        scenario: &str,
        most: usize,
        seed: u64,
        tally: &mut Tally,
    ) -> Result<Life, String> {
        let mut life = Life {
            service: Service::default(),
            draws: Draws::new(seed),
            most,
            known: BTreeMap::new(),
            records: Vec::new(),
            columns: Vec::new(),
            revision: 1,
            at_s: 0.0,
            named: 0,
            model: String::new(),
        };
        let open = json!({"method": "open", "params": {"scenario": scenario}});
        let began = Instant::now();
        let told = life.told(&open.to_string());
        tally.opened = began.elapsed();
        let Some(Told::Whole(whole)) = told.result else {
            return Err(serde_json::to_string(&told.error).unwrap_or_default());
        };
        let plan = whole.plan;
        life.model = plan.drones[0].name.clone();
        let (low, high) = (plan.bounds_m.min, plan.bounds_m.max);
        let solid = |x: f64, y: f64| {
            plan.obstacles.iter().any(|it| match &it.shape {
                planner::plan::Solid::Box { min_m, max_m } => {
                    let near = |k: usize, at: f64| min_m[k] - 0.5 < at && at < max_m[k] + 0.5;
                    near(0, x) && near(1, y)
                }
                _ => false,
            })
        };
        let cells = |k: usize| (low[k] as i64..high[k] as i64).map(|it| it as f64 + 0.5);
        let all = cells(0).flat_map(|x| cells(1).map(move |y| [x, y]));
        life.columns = all.filter(|[x, y]| !solid(*x, *y)).collect();
        life.take_over(&plan);
        Ok(life)
    }

    fn take_over(&mut self, plan: &Plan) {
        let known = plan.drones.iter().map(|it| {
            let known = KnownDrone {
                trajectory: it.trajectory.clone(),
                at_end: it.at_end,
                since_s: None,
            };
            (it.name.clone(), known)
        });
        self.known = known.collect();
    }

    fn told(&mut self, line: &str) -> Answer {
        let Handled { answer, record, .. } = self.service.handle(line, &|| 0.0);
        self.records.extend(record);
        answer
    }

    /// So many changes, which hold from a time on (s), and now and then what must be refused.
    pub(super) fn round(&mut self, at_s: f64, count: usize, tally: &mut Tally) {
        self.at_s = at_s;
        self.misbehave(tally);
        let mut taken = BTreeSet::new();
        let (mut changes, mut seen) = (Vec::new(), serde_json::Map::new());
        for _ in 0..count {
            let Some((drone, change)) = self.change(&taken) else {
                continue;
            };
            taken.insert(drone.clone());
            tally.happened(&change);
            // Half of the delays are seen in positions.
            let by_s = change["late"]["by_s"].as_f64();
            match by_s.filter(|_| self.draws.below(2) == 0) {
                Some(by_s) => {
                    let was_m = self.known[&drone].trajectory.position_m(at_s - by_s);
                    let place = was_m.map(|it| json!({"position_m": [it.x, it.y, it.z]}));
                    seen.extend(place.map(|it| (drone, it)));
                }
                None => changes.push(change),
            }
        }
        self.ask(changes, tally);
        if !seen.is_empty() {
            let params = json!({"at_s": at_s, "drones": seen, "time_limit_s": tally.deadline_s});
            self.send("state", &params, tally);
        }
    }

    /// One patch for all; where that is refused, one for each half.
    fn ask(&mut self, mut changes: Vec<Value>, tally: &mut Tally) {
        if changes.is_empty() {
            return;
        }
        let params = json!({
            "revision": self.revision, "at_s": self.at_s, "changes": changes,
            "time_limit_s": tally.deadline_s,
        });
        if self.send("change", &params, tally) || changes.len() == 1 {
            return;
        }
        let rest = changes.split_off(changes.len() / 2);
        self.ask(changes, tally);
        self.ask(rest, tally);
    }

    /// Whether it was done.
    fn send(&mut self, method: &str, params: &Value, tally: &mut Tally) -> bool {
        let line = json!({"method": method, "params": params}).to_string();
        let began = Instant::now();
        let Handled { answer, record, .. } =
            (self.service).handle(&line, &|| began.elapsed().as_secs_f64());
        let took = began.elapsed();
        self.records.extend(record);
        if let Some(error) = &answer.error {
            tally.refused(&error.code.name(), &error.message, took);
            return false;
        }
        if let Some(patch) = answer.patch() {
            tally.patched(patch, took);
            self.take(patch);
        }
        true
    }

    /// A client's copy of the plan.
    fn take(&mut self, patch: &Patch) {
        self.revision = patch.revision;
        for it in &patch.changed {
            let since_s = it.drone.ends_with("(wreck)").then_some(self.at_s);
            let before = self.known.get(&it.drone).and_then(|it| it.since_s);
            let known = KnownDrone {
                trajectory: it.trajectory.clone(),
                at_end: it.at_end,
                since_s: since_s.or(before),
            };
            self.known.insert(it.drone.clone(), known);
        }
        let is_gone = |it: &KnownDrone| {
            it.at_end == AtEnd::Leave
                && it.trajectory.t_s.last().is_some_and(|t_s| *t_s < self.at_s)
        };
        self.known.retain(|_, it| !is_gone(it));
    }

    /// Something that happens to a drone, and to which.
    fn change(&mut self, taken: &BTreeSet<String>) -> Option<(String, Value)> {
        let at_s = self.at_s;
        let ends_s = |it: &KnownDrone| it.trajectory.t_s.last().copied().unwrap_or(0.0);
        let hovers = |it: &KnownDrone| it.at_end == AtEnd::Hover;
        let idle = |it: &KnownDrone| hovers(it) && ends_s(it) + 1.0 < at_s;
        let flies = |it: &KnownDrone| hovers(it) && ends_s(it) > at_s + 1.0;
        let since =
            |it: &KnownDrone, for_s: f64| it.since_s.is_some_and(|then| then + for_s < at_s);
        match self.draws.below(100) {
            0..40 => {
                let drone = self.one(taken, idle)?;
                let to_m = self.free_place(&drone)?;
                let tasks = json!([{"to_m": to_m, "dwell_s": self.draws.below(3)}]);
                Some((
                    drone.clone(),
                    json!({"retask": {"drone": drone, "tasks": tasks}}),
                ))
            }
            40..75 => {
                let drone = self.one(taken, flies)?;
                let by_s = (100.0 * self.draws.between(0.05, LATEST_S)).round() / 100.0;
                Some((
                    drone.clone(),
                    json!({"late": {"drone": drone, "by_s": by_s}}),
                ))
            }
            75..84 if self.known.len() < self.most => {
                self.named += 1;
                let drone = format!("n{}", self.named);
                let (start_m, to_m) = (self.free_place("")?, self.free_place("")?);
                let comes = json!({
                    "drone": drone, "like": self.model, "start_m": start_m,
                    "tasks": [{"to_m": to_m}],
                });
                Some((drone, json!({"add": comes})))
            }
            84..89 => {
                let drone = self.one(taken, idle).filter(|it| *it != self.model)?;
                let over_m = self.known[&drone].trajectory.position_m.last()?;
                let land = json!({"drone": drone, "over_m": [over_m.x, over_m.y, over_m.z]});
                if let Some(it) = self.known.get_mut(&drone) {
                    it.since_s = Some(at_s);
                }
                Some((drone, json!({"land": land})))
            }
            89..92 => {
                let drone = self.one(taken, flies).filter(|it| *it != self.model)?;
                Some((drone.clone(), json!({"fail": {"drone": drone}})))
            }
            // A drone that has landed, or lies there, is carried off.
            _ => {
                let drone = self.one(taken, |it| !hovers(it) && since(it, LIES_S))?;
                Some((drone.clone(), json!({"remove": {"drone": drone}})))
            }
        }
    }

    /// One of those of which it is so.
    fn one(
        &mut self,
        taken: &BTreeSet<String>,
        is_so: impl Fn(&KnownDrone) -> bool,
    ) -> Option<String> {
        let all = self
            .known
            .iter()
            .filter(|(name, it)| !taken.contains(*name) && is_so(it));
        let all: Vec<&String> = all.map(|(name, _)| name).collect();
        let index = self.draws.below(all.len().max(1));
        all.get(index).map(|it| (*it).clone())
    }

    /// A place in a column that no other drone is to end in or near.
    fn free_place(&mut self, drone: &str) -> Option<[f64; 3]> {
        for _ in 0..TRIES {
            let [x, y] = self.columns[self.draws.below(self.columns.len())];
            let near = |(name, it): (&String, &KnownDrone)| {
                let last_m = it.trajectory.position_m.last();
                name != drone && last_m.is_some_and(|it| (it.x - x).hypot(it.y - y) < APART_M)
            };
            if !self.known.iter().any(near) {
                return Some([x, y, self.draws.below(7) as f64 + 0.5]);
            }
        }
        None
    }

    /// Now and then what must be refused: nothing may come of it.
    fn misbehave(&mut self, tally: &mut Tally) {
        if self.draws.below(4) > 0 {
            return;
        }
        let (at_s, drone) = (self.at_s, self.model.clone());
        let change = |revision: u64, at_s: f64, change: Value| {
            let params = json!({"revision": revision, "at_s": at_s, "changes": [change]});
            json!({"method": "change", "params": params}).to_string()
        };
        let late = |drone: &str| json!({"late": {"drone": drone, "by_s": 1}});
        let far = |place: Point3<f64>| {
            let far = json!({"position_m": [place.x + 100.0, place.y, place.z]});
            json!({"method": "state", "params": {"at_s": at_s, "drones": {&drone: far}}})
                .to_string()
        };
        let here_m = self.known[&drone]
            .trajectory
            .position_m(at_s)
            .unwrap_or_default();
        // Where it is was said just before.
        let here = json!({"position_m": [here_m.x, here_m.y, here_m.z]});
        let here =
            json!({"at_s": at_s, "drones": {&drone: here}, "time_limit_s": tally.deadline_s});
        self.send("state", &here, tally);
        let revision = self.revision;
        let (line, code) = match self.draws.below(7) {
            0 => ("{\"method\": \"chan".to_owned(), Code::Malformed),
            1 => (json!({"method": "fly"}).to_string(), Code::UnknownMethod),
            2 => (
                change(revision + 7, at_s, late(&drone)),
                Code::FutureRevision,
            ),
            3 => (
                change(revision - 1, at_s, late(&drone)),
                Code::StaleRevision,
            ),
            4 => (change(revision, at_s, late("unknown")), Code::UnknownDrone),
            5 => (
                change(revision, at_s, json!({"late": {"drone": drone}})),
                Code::Field,
            ),
            _ => (far(here_m), Code::Jump),
        };
        let answer = self.told(&line);
        let told = answer.error.as_ref().map(|it| it.code);
        tally.faults += 1;
        if told != Some(code) || self.service.revision() != Some(self.revision) {
            let told = told.map_or("taken".to_owned(), |it| format!("refused as {}", it.name()));
            tally
                .faults_taken
                .push(format!("{told}, not refused as {}: {line}", code.name()));
        }
    }

    /// The plan as the service has it.
    pub(super) fn plan(&mut self) -> Plan {
        let told = self.told(r#"{"method": "plan"}"#);
        match told.result {
            Some(Told::Whole(whole)) => whole.plan,
            _ => unreachable!("a plan is open"),
        }
    }

    /// Has the whole plan verified once more, and compares the copy that patches have kept with it.
    pub(super) fn examine(&mut self, tally: &mut Tally) {
        let plan = self.plan();
        let found = planner::verify(&plan).violations;
        let at_s = self.at_s;
        let ahead = found.into_iter().filter(|it| it.matters_from(at_s));
        let ahead = ahead.map(|it| it.to_string());
        let ahead: Vec<String> = ahead.filter(|it| !tally.is_unavoidable(it)).collect();
        let mut off_m: f64 = 0.0;
        for entry in &plan.drones {
            let Some(known) = self.known.get(&entry.name) else {
                continue;
            };
            for step in 0..=30 {
                let then_s = at_s + AHEAD_S * f64::from(step) / 30.0;
                let places = [&entry.trajectory, &known.trajectory].map(|it| it.position_m(then_s));
                if let [Some(a), Some(b)] = places {
                    off_m = off_m.max((a - b).norm());
                }
            }
        }
        let points = plan.drones.iter().map(|it| it.trajectory.t_s.len()).sum();
        tally.examined(at_s, plan.drones.len(), points, off_m, ahead);
    }

    /// Whether what a journal would keep gives the same plan, to the byte.
    pub(super) fn is_replayed(&mut self) -> bool {
        let mut again = Service::default();
        for record in self.records.clone() {
            if again.replay(record).is_err() {
                return false;
            }
        }
        let plan = r#"{"method": "plan"}"#;
        let text = |service: &mut Service| {
            let told = service.handle(plan, &|| 0.0).answer.result;
            serde_json::to_string(&told).ok()
        };
        text(&mut again) == text(&mut self.service)
    }
}
