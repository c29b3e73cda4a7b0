//! Recordings, simulated, and what programs read of them.

use diagnosis::campaign::Applied;
use diagnosis::forward::force;
use diagnosis::forward::residuals::Region;
use diagnosis::forward::simulate::Sample;
use diagnosis::infer::noticed::RemarkOf;
use diagnosis::record::recording::Recording;
use diagnosis::record::remark::Remark;
use diagnosis::thrust::maps::IdentifiedMap;
use rayon::prelude::*;
use serde::Serialize;

use super::skill::Skill;
use crate::io::progress::Progress;

/// One recording, simulated.
pub(super) struct Simulated {
    pub(super) recording: Recording,
    /// Of probes and receivers, and every force that the thrust maps allow.
    pub(super) samples: Vec<Sample>,
    /// Of reading and of simulating.
    remarks: Vec<Remark>,
}

/// Contents of residuals.json.
#[derive(Serialize)]
pub(super) struct Printed<'a> {
    pub(super) recordings: Vec<&'a str>,
    pub(super) samples: usize,
    pub(super) regions: Vec<Region>,
    pub(super) thrust_maps: Vec<IdentifiedMap>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) held_out: Option<Skill>,
    /// What a finding from other recordings changes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) applied: Option<Applied>,
    pub(super) remarks: Vec<RemarkOf>,
}

impl Simulated {
    fn of(recording: Recording) -> Simulated {
        let simulation = force::simulate_all(&recording);
        Simulated {
            samples: simulation.samples,
            remarks: [&recording.remarks[..], &simulation.left_out].concat(),
            recording,
        }
    }

    pub(super) fn remarks(&self) -> impl Iterator<Item = RemarkOf> {
        let of = |remark| RemarkOf::new(&self.recording, remark);
        self.remarks.iter().map(of)
    }
}

pub(super) fn simulate_all(recordings: Vec<Recording>) -> Vec<Simulated> {
    let progress = Progress::start("simulating", recordings.len());
    let simulated = recordings.into_par_iter().map(|recording| {
        let simulated = Simulated::of(recording);
        progress.done_one();
        simulated
    });
    let all = simulated.collect();
    progress.finish();
    all
}
