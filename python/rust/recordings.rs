//! Recordings: read, simulated, diagnosed, calibrated.

use std::collections::BTreeMap;
use std::sync::Arc;

use diagnosis::calibrate::{self as fits, jet_ron};
use diagnosis::campaign::flights::Flights;
use diagnosis::campaign::{
    CampaignError, CampaignOptions, diagnose_campaign, diagnose_sideways, near_floor,
};
use diagnosis::forward::simulate::{self as forward, Channel, Sample};
use diagnosis::infer::diagnose::diagnose_channel;
use diagnosis::infer::finding::FORMAT;
use diagnosis::infer::finding_file::finding_ron;
use diagnosis::infer::noticed::{RemarkOf, Remarked, doubts, noticed};
use diagnosis::record::read::{self, Campaign};
use numpy::IntoPyArray;
use numpy::ndarray::{Array1, Array2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;

use crate::refused::{fault, recording, sentence};
use crate::waiting::{Stop, wait};

/// A recording that was read.
#[pyclass(frozen)]
pub(crate) struct Recording(Arc<diagnosis::record::recording::Recording>);

#[pymethods]
impl Recording {
    /// From the files of its folder, by name.
    #[staticmethod]
    fn read_folder(
        py: Python<'_>,
        name: &str,
        files: BTreeMap<String, Vec<u8>>,
    ) -> PyResult<Recording> {
        let read = read::read_folder(name, &files);
        Ok(Recording(Arc::new(read.map_err(|it| recording(py, &it))?)))
    }

    /// From a flight log, with what it leaves unsaid.
    #[staticmethod]
    fn read_log(
        py: Python<'_>,
        named: (String, String),
        bytes: &[u8],
        campaign: (String, String),
    ) -> PyResult<Recording> {
        let (name, file) = (named.0.as_str(), named.1.as_str());
        let refused = |it| recording(py, &it);
        let campaign = Campaign::parse(&campaign.0, &campaign.1).map_err(refused)?;
        let read = read::read_log(name, file, bytes, &campaign);
        Ok(Recording(Arc::new(read.map_err(refused)?)))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Whether it can only be judged by the forces on its drones.
    #[getter]
    fn is_flight_log(&self) -> bool {
        self.0.probes.is_none()
            && self.0.receivers.is_empty()
            && self.0.vehicles.iter().any(|it| it.track.is_of_a_force())
    }
}

/// The name of a flight log without its ending, by its name and first bytes; none of another file.
#[pyfunction]
pub(crate) fn log_name(file: &str, head: &[u8]) -> Option<String> {
    read::log_name(file, head).map(str::to_owned)
}

/// A recording as its simulation would have made it: a column of each field of its samples.
#[pyfunction]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    recording: &Recording,
) -> PyResult<(Bound<'py, PyDict>, Vec<String>)> {
    let of = Arc::clone(&recording.0);
    let found = wait(py, &Stop::default(), move || forward::simulate(&of))?;
    let samples = &found.samples;
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
    Ok((
        table,
        found.left_out.iter().map(|it| it.message.clone()).collect(),
    ))
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
    let logs = all(&recordings);
    let judge = match near_the_floor {
        true => near_floor(&logs).map_err(|error| sentence(py, "RecordingError", error))?,
        false => Vec::new(),
    };
    let options = CampaignOptions { judge, alone };
    let found = wait(py, &Stop::default(), move || {
        let found = diagnose_campaign(&logs, &options)?;
        let sideways = diagnose_sideways(&logs, &options);
        Ok::<_, CampaignError>((found, sideways, noticed(&logs), logs))
    })?;
    let found = found.map_err(|error| sentence(py, "RecordingError", error))?;
    let (found, sideways, remarks, logs) = found;
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
