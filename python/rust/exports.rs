//! Plans written as other programs fly them.

use std::path::PathBuf;

use exchange::frame::{Axes, Georeference};
use exchange::{ExportError, Options, RATE_DEFAULT_HZ, RATES_HZ, Target};
use loader::files::other_writer;
use planner::plan::file;
use planner::verify::examination::examine;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::{Value, json};

use crate::refused::{fault, json_text, no_plan, refused, sentence};
use crate::waiting::{Stop, wait};

/// Setpoints: axes, how many a second, and whether they count from each drone's own start; as far
/// as that is said.
type Setpoints = (Option<String>, Option<f64>, bool);
/// The manifest as JSON, and each file's name and contents.
type Exported = (String, Vec<(String, Py<PyBytes>)>);

/// A plan.json in a format, verified before and read back after.
#[pyfunction]
pub(crate) fn export(
    py: Python<'_>,
    text: &str,
    to: (&str, String),
    georeference: Option<[f64; 4]>,
    setpoints: Setpoints,
    only: (bool, bool),
) -> PyResult<Exported> {
    let ((format, plan_id), (compressed_alone, untimed_ok)) = (to, only);
    let target = Target::ALL.into_iter().find(|it| it.as_str() == format);
    let target = target.ok_or_else(|| {
        let known = Target::ALL.map(Target::as_str).join(", ");
        PyValueError::new_err(format!("there is no format {format:?}; there are {known}"))
    })?;
    let given = [
        ("georeference", georeference.is_some()),
        ("frame", setpoints.0.is_some()),
        ("rate_hz", setpoints.1.is_some()),
        ("own_origin", setpoints.2),
        ("compressed", compressed_alone),
        ("untimed_ok", untimed_ok),
    ];
    if let Some((option, of)) = target.idle(given).next() {
        let message = format!("{option} is for {of}: it says nothing of {format}");
        return Err(PyValueError::new_err(message));
    }
    let georeference = georeference.map(Georeference::new).transpose();
    let georeference = georeference.map_err(PyValueError::new_err)?;
    let (frame, rate_hz, own_origin) = setpoints;
    let frame = frame.unwrap_or_else(|| Axes::Ned.as_str().to_owned());
    let rate_hz = rate_hz.unwrap_or(RATE_DEFAULT_HZ);
    let mut axes = [Axes::Ned, Axes::Enu].into_iter();
    let axes = axes.find(|it| it.as_str() == frame);
    let axes =
        axes.ok_or_else(|| PyValueError::new_err(format!("frame is {frame:?}; it is ned or enu")))?;
    if !RATES_HZ.contains(&rate_hz) {
        let (low, high) = (RATES_HZ.start(), RATES_HZ.end());
        let message = format!("rate_hz is {rate_hz}; it lies within {low} to {high}");
        return Err(PyValueError::new_err(message));
    }
    let options = Options {
        plan_id,
        georeference,
        axes,
        rate_hz,
        own_origin,
        compressed_alone,
        untimed_ok,
        kept: Default::default(),
    };
    let file = file::read(text).map_err(|error| no_plan(py, None, &error))?;
    let made = wait(py, &Stop::default(), move || {
        let examined = examine(&file, false);
        match examined.plan.violations.len() + examined.omitted {
            0 => Ok(exchange::export(&file.plan, target, &options)),
            violations => Err(violations),
        }
    })?;
    let made = made.map_err(|violations| {
        let what = format!("not exported: the verifier finds {violations} violations");
        sentence(py, "PlanError", what)
    })?;
    let made = made.map_err(|error| match error {
        ExportError::Refused(drones) => {
            let entry = |it: &exchange::Refusal| json!({ "message": it.to_string() });
            let entries: Vec<Value> = drones.iter().map(entry).collect();
            let lines: Vec<String> = drones.iter().map(ToString::to_string).collect();
            refused(py, "PlanError", &lines.join("\n"), &entries)
        }
        ExportError::NoGeoreference => PyValueError::new_err(format!(
            "{format} lies on the Earth: georeference=(latitude, longitude, altitude, heading)"
        )),
        ExportError::Untimed(_) => sentence(
            py,
            "PlanError",
            format!("{error}; untimed_ok=True writes them all the same"),
        ),
        ExportError::ReadBack { .. } => fault(error),
        ExportError::Off { .. } | ExportError::Origin(_) | ExportError::Original(_) => {
            sentence(py, "PlanError", error)
        }
    })?;
    let files = made.files.into_iter();
    let files = files.map(|it| (it.name, PyBytes::new(py, &it.bytes).unbind()));
    Ok((json_text(&made.manifest)?, files.collect()))
}

/// The file by which one knows that another command wrote to a folder, and that command.
#[pyfunction]
pub(crate) fn written_by_another(folder: PathBuf) -> Option<(&'static str, &'static str)> {
    other_writer(&folder, exchange::import::MANIFEST)
}
