//! Recordings: read, simulated, diagnosed, calibrated.

use std::io::Error;
use std::path::PathBuf;
use std::sync::Arc;

use diagnosis::calibrate::{self as fits, jet_ron};
use diagnosis::campaign::flights::Flights;
use diagnosis::campaign::{
    CampaignError, CampaignOptions, diagnose_campaign, diagnose_sideways, lacking, near_floor,
    take_forceless,
};
use diagnosis::forward::force;
use diagnosis::forward::simulate::{Channel, Sample, Simulation};
use diagnosis::infer::diagnose::diagnose_channel;
use diagnosis::infer::finding::FORMAT;
use diagnosis::infer::finding_file::finding_ron;
use diagnosis::infer::noticed::{RemarkOf, Remarked, doubts, noticed};
use diagnosis::thrust::maps::identify_all;
use loader::recordings::{self, LoadError, Meta};
use numpy::IntoPyArray;
use numpy::ndarray::{Array1, Array2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use serde::Serialize;

use crate::refused::{fault, json_text, recording, sentence};
use crate::waiting::{Stop, wait};

/// A recording that was read.
#[pyclass(frozen)]
pub(crate) struct Recording(Arc<diagnosis::record::recording::Recording>);

#[pymethods]
impl Recording {
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Whether it holds tracks alone.
    #[getter]
    fn is_flight_log(&self) -> bool {
        self.0.is_flight_log()
    }

    /// Whether it is a flight log of which a drone's force can be told.
    #[getter]
    fn is_of_a_force(&self) -> bool {
        self.0.is_of_a_force()
    }
}

/// Every recording at some paths, as `plan diagnose` finds them, and remarks on what is left out, as
/// JSON.
#[pyfunction]
pub(crate) fn read_all(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    meta: Option<PathBuf>,
) -> PyResult<(Vec<Recording>, String)> {
    let read = wait(py, &Stop::default(), move || {
        let meta = Meta {
            file: meta.as_deref(),
            option: "meta=",
        };
        recordings::read_all(&paths, meta)
    })?;
    let read = read.map_err(|error| unread(py, &error))?;
    let left_out = read.left_out.into_iter();
    let left_out = left_out.map(|(recording, remark)| RemarkOf { recording, remark });
    let left_out = json_text(&left_out.collect::<Vec<_>>())?;
    let all = read.recordings.into_iter();
    Ok((all.map(|it| Recording(Arc::new(it))).collect(), left_out))
}

/// As an exception of the package, or the operating system's.
fn unread(py: Python<'_>, error: &LoadError) -> PyErr {
    match error {
        LoadError::Read { source, .. } => Error::new(source.kind(), error.to_string()).into(),
        LoadError::Problems(problems) => recording(py, &error.to_string(), &problems.0),
        LoadError::Several(several) => {
            let mut problems = Vec::new();
            for one in several {
                match one {
                    LoadError::Problems(more) => problems.extend_from_slice(&more.0),
                    other => return unread(py, other),
                }
            }
            recording(py, &error.to_string(), &problems)
        }
    }
}

/// Why no force of any of these flight logs can be told.
#[pyfunction]
pub(crate) fn no_force(recordings: Vec<Bound<'_, Recording>>) -> String {
    CampaignError::no_force(&all(&recordings)).to_string()
}

/// Of one recording: columns, what was left out, and remarks as JSON.
type Simulated<'py> = (Bound<'py, PyDict>, Vec<String>, String);

/// Recordings as their simulation would have made them, with the thrust maps of all of them: of each
/// a column of each field of its samples, what was left out, and all remarks, as JSON.
#[pyfunction]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    recordings: Vec<Bound<'py, Recording>>,
) -> PyResult<Vec<Simulated<'py>>> {
    let mut recordings = all(&recordings);
    let found = wait(py, &Stop::default(), move || {
        identify_all(&mut recordings);
        let found = recordings.into_par_iter().map(|of| {
            let simulation = force::simulate_all(&of);
            (of, simulation)
        });
        found.collect::<Vec<_>>()
    })?;
    let told = |(of, found): (diagnosis::record::recording::Recording, Simulation)| {
        let remarks = of.remarks.iter().chain(&found.left_out);
        let remarks: Vec<RemarkOf> = remarks.map(|it| RemarkOf::new(&of, it)).collect();
        let mut left_out = match of.is_flight_log() && found.samples.is_empty() {
            true => without_force(&of),
            false => Vec::new(),
        };
        left_out.extend(found.left_out.iter().map(|it| it.message.clone()));
        Ok((columns(py, &found.samples)?, left_out, json_text(&remarks)?))
    };
    found.into_iter().map(told).collect()
}

/// Why a flight log has no force: what its drones lack, or that no thrust map is theirs.
fn without_force(log: &diagnosis::record::recording::Recording) -> Vec<String> {
    let lacking = lacking(log);
    let mapless = log.vehicles.iter().filter(|it| it.thrust_map.is_none());
    let mapless = mapless.map(|it| format!("`{}` of {} has no thrust map", it.id, log.name));
    match lacking.is_empty() {
        true => mapless.collect(),
        false => lacking,
    }
}

/// A column of each field of some samples.
fn columns<'py>(py: Python<'py>, samples: &[Sample]) -> PyResult<Bound<'py, PyDict>> {
    let column = |of: fn(&Sample) -> f64| -> Array1<f64> { samples.iter().map(of).collect() };
    let table = PyDict::new(py);
    let channels: Vec<String> = samples.iter().map(|it| word(it.channel)).collect();
    table.set_item("channel", channels)?;
    let rows: Array1<u64> = samples.iter().map(|it| it.row as u64).collect();
    table.set_item("row", rows.into_pyarray(py))?;
    let subjects: Array1<u32> = samples.iter().map(|it| it.subject).collect();
    table.set_item("subject", subjects.into_pyarray(py))?;
    let places_m = Array2::from_shape_fn((samples.len(), 3), |(k, axis)| {
        samples[k].position_m.coords[axis]
    });
    table.set_item("position_m", places_m.into_pyarray(py))?;
    for (name, values) in [
        ("t_s", column(|it| it.t_s)),
        ("recorded", column(|it| it.recorded)),
        ("simulated", column(|it| it.simulated)),
        ("air_mps", column(|it| it.air_mps)),
    ] {
        table.set_item(name, values.into_pyarray(py))?;
    }
    Ok(table)
}

/// One recording of probes or receivers: its finding as JSON, and as a finding file.
#[pyfunction]
pub(crate) fn diagnose(
    py: Python<'_>,
    recording: &Recording,
    channel: Option<&str>,
) -> PyResult<(String, String)> {
    let known = [Channel::Speed, Channel::Throttle, Channel::Power];
    let named = |name: &str| {
        let found = known.into_iter().find(|it| word(*it) == name);
        found.ok_or_else(|| {
            let known = known.map(word).join(", ");
            PyValueError::new_err(format!("channel: `{name}` is none of {known}"))
        })
    };
    let channel = channel.map(named).transpose()?;
    let of = Arc::clone(&recording.0);
    let (found, remarks) = wait(py, &Stop::default(), move || {
        let found = diagnose_channel(&of, channel);
        (found, noticed(std::slice::from_ref(&*of)))
    })?;
    let found = found.map_err(|error| sentence(py, "RecordingError", error))?;
    Ok((told(FORMAT, &found, &remarks)?, finding_ron(&found)))
}

/// Flight logs together: their finding as JSON, and as a finding file.
#[pyfunction]
pub(crate) fn diagnose_flights(
    py: Python<'_>,
    recordings: Vec<Bound<'_, Recording>>,
    alone: bool,
    near_the_floor: bool,
) -> PyResult<(String, String)> {
    let mut logs = all(&recordings);
    let mut remarks = take_forceless(&mut logs);
    let left_out = remarks.iter();
    let left_out = left_out.map(|it| format!("; {}: {}", it.recording, it.remark.message));
    let left_out: String = left_out.collect();
    let refused =
        |error: CampaignError| sentence(py, "RecordingError", format!("{error}{left_out}"));
    let judge = match near_the_floor {
        true => near_floor(&logs).map_err(refused)?,
        false => Vec::new(),
    };
    let options = CampaignOptions { judge, alone };
    let found = wait(py, &Stop::default(), move || {
        let found = diagnose_campaign(&logs, &options)?;
        let sideways = diagnose_sideways(&logs, &options);
        Ok::<_, CampaignError>((found, sideways, noticed(&logs), logs))
    })?;
    let found = found.map_err(refused)?;
    let (found, sideways, more, logs) = found;
    remarks.extend(more);
    let answer = Flights::of(&found, sideways.as_ref().ok(), &logs);
    let json = told(FORMAT, &answer, &remarks)?;
    Ok((json, finding_ron(&found.finding)))
}

/// The constants of the jet that fit best, as JSON, and as a file that scenarios cite.
#[pyfunction]
pub(crate) fn calibrate(
    py: Python<'_>,
    recordings: Vec<Bound<'_, Recording>>,
    seed: u64,
) -> PyResult<(String, String)> {
    let recordings = all(&recordings);
    let options = fits::Options {
        seed,
        ..fits::Options::default()
    };
    let (found, remarks) = wait(py, &Stop::default(), move || {
        let found = fits::calibrate(&recordings, &options);
        let mut remarks = noticed(&recordings);
        remarks.extend(doubts(&recordings));
        (found, remarks)
    })?;
    let found = found.map_err(|error| sentence(py, "RecordingError", error))?;
    Ok((told(fits::FORMAT, &found, &remarks)?, jet_ron(&found)))
}

/// An answer as its file has it, but for the list of files.
fn told<T: Serialize>(format: &str, answer: &T, remarks: &[RemarkOf]) -> PyResult<String> {
    let mut told = serde_json::to_value(Remarked { answer, remarks }).map_err(fault)?;
    told["format"] = format.into();
    Ok(told.to_string())
}

fn all(recordings: &[Bound<'_, Recording>]) -> Vec<diagnosis::record::recording::Recording> {
    recordings.iter().map(|it| (*it.get().0).clone()).collect()
}

/// `speed`, `throttle`, ...
fn word(channel: Channel) -> String {
    match serde_json::to_value(channel) {
        Ok(serde_json::Value::String(word)) => word,
        _ => String::new(),
    }
}
