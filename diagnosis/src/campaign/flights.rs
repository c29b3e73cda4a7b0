//! What several flights say together, as diagnosis.json has it.

use serde::Serialize;

use crate::campaign::diagnose::CampaignFinding;
use crate::campaign::sideways::SidewaysFinding;
use crate::forward::simulate::Sample;
use crate::infer::finding::Finding;
use crate::record::recording::Recording;

/// A finding with what only several flights can say.
#[derive(Serialize)]
pub struct Flights<'a> {
    #[serde(flatten)]
    finding: &'a Finding,
    /// Which flight, drone and moment each row is.
    rows: Vec<FlightRow<'a>>,
    #[serde(flatten)]
    found: &'a CampaignFinding,
    /// What forces to the sides say; none where they cannot be judged.
    sideways: Option<&'a SidewaysFinding>,
}

#[derive(Serialize)]
struct FlightRow<'a> {
    flight: &'a str,
    vehicle: &'a str,
    t_s: f64,
}

impl<'a> Flights<'a> {
    /// Of the recordings that were diagnosed.
    #[must_use]
    pub fn of(
        found: &'a CampaignFinding,
        sideways: Option<&'a SidewaysFinding>,
        recordings: &'a [Recording],
    ) -> Flights<'a> {
        let row = |(sample, &of): (&Sample, &usize)| FlightRow {
            flight: &recordings[of].name,
            vehicle: &recordings[of].vehicles[sample.subject as usize].id,
            t_s: sample.t_s,
        };
        let rows = found.samples.iter().zip(&found.recording_of);
        Flights {
            finding: &found.finding,
            rows: rows.map(row).collect(),
            found,
            sideways,
        }
    }
}
