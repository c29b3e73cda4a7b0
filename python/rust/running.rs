//! A plan changed while it is flown.

use std::sync::{Arc, Mutex};

use planner::Control;
use planner::replan::change::{Change, ChangeError};
use planner::scenario::world::Task;
use pyo3::prelude::*;
use serde_json::{Value, json};

use crate::fleet::{Plan, World};
use crate::refused::{fault, json_text, refused, sentence};
use crate::waiting::{Stop, wait};

/// A plan that is being flown.
#[pyclass(frozen)]
pub(crate) struct Running(Arc<Mutex<Option<planner::Running>>>);

/// A place to go to: where (m), how long to hover there (s), payload from there on (kg).
type To = ([f64; 3], f64, Option<f64>);

/// A change: what (`late`, `removed`, `retasked`), of which drone, how far behind (s), its tasks.
type Changed = (String, String, f64, Vec<To>);

#[pymethods]
impl Running {
    #[new]
    fn new(py: Python<'_>, world: &World, plan: &Plan) -> PyResult<Running> {
        let (world, plan) = ((*world.0).clone(), (*plan.0).clone());
        let made = wait(py, &Stop::default(), move || {
            planner::Running::new(world, plan)
        })?;
        let made = made.map_err(|error| sentence(py, "ChangeError", error))?;
        Ok(Running(Arc::new(Mutex::new(Some(made)))))
    }

    fn plan(&self, py: Python<'_>) -> PyResult<Plan> {
        let kept = self.0.lock().map_err(fault)?;
        let running = kept.as_ref().ok_or_else(|| gone(py))?;
        Ok(Plan::of(running.plan().clone(), Vec::new()))
    }

    /// Plans on from a moment (s); what became of the changes, as JSON.
    fn replan(&self, py: Python<'_>, at_s: f64, changes: Vec<Changed>) -> PyResult<String> {
        let changes = changes.into_iter().map(change).collect::<Vec<Change>>();
        // While it is planned on nothing else can be asked of it; a stop takes it along.
        let taken = self.0.lock().map_err(fault)?.take();
        let mut running = taken.ok_or_else(|| gone(py))?;
        let (asked, kept) = (Stop::default(), Arc::clone(&self.0));
        let stop = asked.clone();
        let told = wait(py, &asked, move || {
            let control = Control {
                stop: &|| stop.is_asked(),
                ..Control::QUIET
            };
            let told = running.replan(at_s, &changes, &control);
            if let (Ok(mut kept), false) = (kept.lock(), stop.is_asked()) {
                *kept = Some(running);
            }
            told
        })?;
        let told = told.map_err(|errors| {
            let entry = |it: &ChangeError| json!({ "message": it.to_string() });
            let entries: Vec<Value> = errors.iter().map(entry).collect();
            let lines: Vec<String> = errors.iter().map(ToString::to_string).collect();
            refused(py, "ChangeError", &lines.join("\n"), &entries)
        })?;
        json_text(&told)
    }
}

fn change((what, drone, by_s, tasks): Changed) -> Change {
    match what.as_str() {
        "late" => Change::Late { drone, by_s },
        "removed" => Change::Removed { drone },
        _ => Change::Retasked {
            drone,
            tasks: tasks
                .into_iter()
                .map(|(to_m, dwell_s, load_kg)| Task {
                    to_m: to_m.into(),
                    dwell_s,
                    load_kg,
                    during_s: None,
                })
                .collect(),
        },
    }
}

fn gone(py: Python<'_>) -> PyErr {
    let told = "this run was interrupted, or is being planned on; make another of its last plan";
    sentence(py, "ChangeError", told)
}
