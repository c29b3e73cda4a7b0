//! What was noticed about the recordings of an answer, reported with it.

use serde::Serialize;

use crate::forward::simulate::simulate;
use crate::infer::actuation::actuation;
use crate::record::recording::Recording;
use crate::record::remark::{Remark, RemarkKind};

/// What was noticed about one recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RemarkOf {
    /// Its name.
    pub recording: String,
    /// What was noticed.
    #[serde(flatten)]
    pub remark: Remark,
}

impl RemarkOf {
    /// Of a recording.
    #[must_use]
    pub fn new(recording: &Recording, remark: &Remark) -> RemarkOf {
        RemarkOf {
            recording: recording.name.clone(),
            remark: remark.clone(),
        }
    }
}

/// An answer with what was noticed about its recordings, as diagnosis.json and calibration.json
/// have it.
#[derive(Clone, Debug, Serialize)]
pub struct Remarked<'a, T> {
    /// What was asked for.
    #[serde(flatten)]
    pub answer: &'a T,
    /// In the order of the recordings.
    pub remarks: &'a [RemarkOf],
}

/// What reading these recordings and simulating their probes and receivers noticed, and what their
/// throttles and powers say that no cause explains.
#[must_use]
pub fn noticed(recordings: &[Recording]) -> Vec<RemarkOf> {
    let of = |recording: &Recording| {
        let left_out = simulate(recording).left_out;
        let unexplained = actuation(recording).remarks;
        let all = recording
            .remarks
            .iter()
            .chain(&left_out)
            .chain(&unexplained);
        all.map(|remark| RemarkOf::new(recording, remark))
            .collect::<Vec<_>>()
    };
    recordings.iter().flat_map(of).collect()
}

/// Why the induced velocities that a jet is calibrated by may not be those of the drones which
/// flew, of each recording of which that is so.
#[must_use]
pub fn doubts(recordings: &[Recording]) -> Vec<RemarkOf> {
    recordings.iter().filter_map(doubt).collect()
}

fn doubt(recording: &Recording) -> Option<RemarkOf> {
    let said = actuation(recording);
    let message = match said.cause {
        Some(cause) => format!(
            "throttle and power say {cause}; the jet is calibrated by what is stated, so its speeds are off"
        ),
        None if said.is_contradicted => "throttle and power are not those of the stated masses and density, and the jet is calibrated by these".to_owned(),
        None => return None,
    };
    let remark = Remark::new(RemarkKind::Contradicted, None, message);
    Some(RemarkOf::new(recording, &remark))
}
