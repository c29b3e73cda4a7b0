//! Scenarios planned; plans read, checked, flown.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use flight::Options;
use flight::controller::Controller;
use loader::files::{self, MOST_SCENARIO_BYTES};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1};
use planner::plan::file::{self, PlanFile};
use planner::plan::outcome::{Blocker, EndpointConflicts, IMPROVING_SHARE, PLANNING_SHARE};
use planner::verify::examination::{Examination, examine};
use planner::{Control, Files, Outcome};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use serde_json::{Value, json};
use viewer::View;

use crate::refused::{fault, json_text, no_plan, refused, scenario, sentence};
use crate::waiting::{Stop, wait};

/// A scenario that was read.
#[pyclass(frozen)]
pub(crate) struct World(pub(crate) Arc<planner::World>);

#[pymethods]
impl World {
    /// Reads a scenario's text (RON). What it cites is read from `folder`; a finding is named as
    /// seen from the working folder.
    #[new]
    fn new(
        py: Python<'_>,
        named: (String, String),
        folder: &str,
        finding: Option<&str>,
    ) -> PyResult<World> {
        let (name, text) = (named.0.as_str(), named.1.as_str());
        let load = |cited: &str| {
            let path = match finding {
                Some(finding) if finding == cited => Path::new(cited).to_owned(),
                _ => Path::new(folder).join(cited),
            };
            files::text(&path, MOST_SCENARIO_BYTES).map_err(|error| error.to_string())
        };
        let cited = Files::new(&load);
        let cited = match finding {
            Some(finding) => cited.with_finding(finding),
            None => cited,
        };
        let world = planner::read_world_with(text, &cited);
        let world = world.map_err(|problems| scenario(py, (name, text), &problems))?;
        Ok(World(Arc::new(world)))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn drones(&self) -> Vec<String> {
        self.0.drones.iter().map(|it| it.name.clone()).collect()
    }
}

/// A plan, as `plan.json` has it, what to know of it, and how many more violations there are than
/// it tells.
#[pyclass(frozen)]
pub(crate) struct Plan(pub(crate) Arc<planner::Plan>, Vec<String>, usize);

impl Plan {
    pub(crate) fn of(plan: planner::Plan, notes: Vec<String>) -> Plan {
        Plan(Arc::new(plan), notes, 0)
    }
}

#[pymethods]
impl Plan {
    /// Reads the text of a plan.json, called `path`, with the results that follow from it.
    #[staticmethod]
    fn read(py: Python<'_>, path: &str, text: &str) -> PyResult<Plan> {
        let file = file::read(text).map_err(|error| no_plan(py, Some(path), &error))?;
        wait(py, &Stop::default(), move || {
            let Examination {
                mut plan,
                omitted: untold,
                ..
            } = examine(&file, false);
            // How late each may be takes longer to find: it stays as stated.
            for (drone, stated) in plan.drones.iter_mut().zip(&file.plan.drones) {
                drone.may_be_late_s = stated.may_be_late_s;
            }
            Plan(Arc::new(plan), file.remarks, untold)
        })
    }

    /// What another process had as [`Plan::json`], notes and more; nothing is judged again.
    #[staticmethod]
    fn restored(py: Python<'_>, text: &str, notes: Vec<String>, untold: usize) -> PyResult<Plan> {
        let file = file::read(text).map_err(|error| no_plan(py, None, &error))?;
        Ok(Plan(Arc::new(file.plan), notes, untold))
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.1.clone()
    }

    /// How many more violations there are than it tells.
    #[getter]
    fn untold(&self) -> usize {
        self.2
    }

    fn json(&self) -> PyResult<String> {
        json_text(&*self.0)
    }

    /// The text of a plan.html; `world`: what was planned, which tells dwells and waits apart.
    fn page(&self, py: Python<'_>, world: Option<&World>) -> String {
        let (plan, world) = (self.0.clone(), world.map(|it| it.0.clone()));
        let untold = self.2;
        py.detach(|| {
            let view = View::of(&plan, world.as_deref()).with_omitted(untold);
            view.page(None)
        })
    }

    /// Where a drone is at some times (s), a row each (m); NaN where it is not there.
    fn positions<'py>(
        &self,
        py: Python<'py>,
        drone: usize,
        t_s: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let drones = &self.0.drones;
        let drone = drones
            .get(drone)
            .ok_or_else(|| PyIndexError::new_err(drone))?;
        let t_s = t_s.as_array();
        let mut found = Array2::from_elem((t_s.len(), 3), f64::NAN);
        let leaves_s = self.0.leaves_s(drone);
        for (mut row, &t_s) in found.outer_iter_mut().zip(t_s) {
            let has_come = drone.enters_s.is_none_or(|enters_s| enters_s <= t_s);
            let is_there = has_come && leaves_s.is_none_or(|leaves_s| t_s <= leaves_s);
            let there_m = drone.trajectory.position_m(t_s).filter(|_| is_there);
            if let Some(there_m) = there_m {
                (row[0], row[1], row[2]) = (there_m.x, there_m.y, there_m.z);
            }
        }
        Ok(found.into_pyarray(py))
    }
}

/// Plans a world; raises `Blocked` where the starts exclude one another.
#[pyfunction]
pub(crate) fn plan(
    py: Python<'_>,
    world: &World,
    seed: Option<u64>,
    time_limit_s: Option<f64>,
    contrast: bool,
) -> PyResult<Plan> {
    let mut world = (*world.0).clone();
    if let Some(seed) = seed {
        world.planning.seed = seed;
    }
    let limit = time_limit_s.map(|limit_s| {
        let limit = Duration::try_from_secs_f64(limit_s).ok();
        let told = || PyValueError::new_err(format!("time_limit_s is {limit_s} s, no time"));
        limit.filter(|it| !it.is_zero()).ok_or_else(told)
    });
    let limit = limit.transpose()?;
    let world = Arc::new(world);
    let (asked, planned) = (Stop::default(), Arc::clone(&world));
    let stop = asked.clone();
    let outcome = wait(py, &asked, move || {
        let begun = Instant::now();
        let is_past = |share: f64| limit.is_some_and(|it| begun.elapsed() > it.mul_f64(share));
        let control = Control {
            stop: &|| stop.is_asked() || is_past(PLANNING_SHARE),
            improve: &|| limit.is_some() && !stop.is_asked() && !is_past(IMPROVING_SHARE),
            progress: &|_| {},
            contrast,
        };
        planner::plan_world(&planned, &control)
    })?;
    match outcome.map_err(fault)? {
        Outcome::Safe(found) | Outcome::Partial(found) | Outcome::Unsafe(found) => {
            let notes = [&world.notes[..], &found.notes].concat();
            Ok(Plan::of(found.plan, notes))
        }
        Outcome::Infeasible { conflicts } => Err(blocked(py, &conflicts, &world)),
    }
}

/// Endpoints that exclude one another, as data.
fn blocked(py: Python<'_>, conflicts: &EndpointConflicts, world: &planner::World) -> PyErr {
    let entries = conflicts.worst.iter().map(|it| {
        let meeting = it.meeting.as_ref().map(|it| {
            json!({
                "task": it.task,
                "their_task": it.their_task,
                "during_s": it.during_s,
            })
        });
        let with = match it.blocker {
            Blocker::Drone(index) => &world.drones[index].name,
            Blocker::Zone(index) => &world.zones[index].name,
        };
        json!({
            "drone": world.drones[it.drone].name,
            "with": with,
            "when": it.when,
            "meeting": meeting,
            "why": it.why,
            "nearest_fix_m": it.nearest_fix_m,
        })
    });
    let entries: Vec<Value> = entries.collect();
    let pairs = match conflicts.count() {
        1 => "1 pair excludes one another".to_owned(),
        many => format!("{many} pairs exclude one another"),
    };
    let first = entries
        .first()
        .map(|it| format!(": {} with {}", it["drone"], it["with"]));
    let message = format!("no plan can be safe: {pairs}{}", first.unwrap_or_default());
    refused(
        py,
        "Blocked",
        &message,
        &[json!({ "conflicts": entries, "more": conflicts.more })],
    )
}

/// The verifier's examination of a plan's text, of a file where it has one, as JSON.
#[pyfunction]
pub(crate) fn check(
    py: Python<'_>,
    path: Option<&str>,
    text: &str,
    late: bool,
) -> PyResult<String> {
    let file: PlanFile = file::read(text).map_err(|error| no_plan(py, path, &error))?;
    wait(py, &Stop::default(), move || {
        let found = examine(&file, late);
        let violations = &found.plan.violations;
        json_text(&json!({
            "drones": found.plan.drones.len(),
            "unplanned": found.plan.unplanned,
            "violations": violations,
            "zone_air": found.plan.zone_air,
            "examination": found,
        }))
    })?
}

/// How a plan is flown: controllers, feed-forward, convection factors.
type Cases = (Vec<String>, Vec<String>, Vec<f64>);

/// A plan flown in closed loop, as JSON.
#[pyfunction]
pub(crate) fn fly(
    py: Python<'_>,
    plan: &Plan,
    cases: Cases,
    air: (Option<f64>, bool, u64),
    until_s: Option<f64>,
) -> PyResult<String> {
    let ((controllers, feed_forward, convection), (gusts, lean, seed)) = (cases, air);
    let known = Options::default();
    let mut options = Options {
        controllers: each(
            &controllers,
            "controllers",
            &[Controller::Px4, Controller::Research],
        )?,
        feed_forward: each(&feed_forward, "feed_forward", &known.feed_forward)?,
        lean,
        seed,
        until_s,
        gusts: gusts.unwrap_or(known.gusts),
        ..known
    };
    if !convection.is_empty() {
        options.convection = convection;
    } else if let Some(stated) = plan.0.convection() {
        let [lowest, highest] = stated.factors();
        options.convection = vec![highest, lowest];
        options.convection.dedup();
    }
    let plan = Arc::clone(&plan.0);
    let flown = wait(py, &Stop::default(), move || {
        flight::fly(&plan, &flight::Setup::default(), &options, &|_, _| {})
    })?;
    let flown = flown.map_err(|error| sentence(py, "PlanError", error))?;
    let mut value = serde_json::to_value(&flown).map_err(fault)?;
    value["is_within_limits"] = json!(flown.is_within_limits());
    json_text(&value)
}

/// Names as the crates have them, of some that are known.
fn each<T: serde::Serialize + Copy>(names: &[String], what: &str, known: &[T]) -> PyResult<Vec<T>> {
    let called = |it: &T| match serde_json::to_value(it) {
        Ok(Value::String(name)) => name,
        _ => String::new(),
    };
    let one = |name: &String| {
        let found = known.iter().find(|it| called(it) == *name).copied();
        found.ok_or_else(|| {
            let known: Vec<String> = known.iter().map(called).collect();
            PyValueError::new_err(format!("{what}: `{name}` is none of {}", known.join(", ")))
        })
    };
    names.iter().map(one).collect()
}
