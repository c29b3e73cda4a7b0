//! A finding as programs read it: `diagnosis/1`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use diagnosis::forward::simulate::Channel;
use diagnosis::infer::candidates::Kind;
use diagnosis::infer::finding::Verdict;
use diagnosis::infer::finding::{
    Effect, Estimate, Finding, HeldOut, Perhaps, Ranked, Region, Smallest,
};
use diagnosis::infer::outside::Shape;
use serde::Serialize;

/// What `--format json` prints. Rows count from 0 and are those of probes.csv, or of receiver.csv where there are no probes.
#[derive(Serialize)]
pub(super) struct Printed<'a> {
    format: &'static str,
    recording: &'a str,
    verdict: Verdict,
    channel: Channel,
    samples: usize,
    effects: Vec<Named<'a>>,
    region: &'a Region,
    /// Chance of as much structure in noise alone.
    chance: f64,
    /// What is outside the library.
    shape: Option<&'a Shape>,
    heldout: &'a HeldOut,
    candidates: &'a [Ranked],
    /// A second effect that was not taken, and might be there.
    perhaps: Option<&'a Perhaps>,
    advice: &'a [String],
    smallest: &'a [Smallest],
    /// One value a row of the file; null where none can be simulated.
    prediction: &'a [f64],
    #[serde(skip_serializing_if = "Option::is_none")]
    files: Option<&'a [PathBuf]>,
}

#[derive(Serialize)]
struct Named<'a> {
    name: &'a str,
    kind: Option<Kind>,
    alternatives: &'a [String],
    equation: &'a str,
    story: &'a str,
    parameters: &'a BTreeMap<String, Estimate>,
}

impl<'a> Printed<'a> {
    pub(super) fn of(finding: &'a Finding, files: Option<&'a [PathBuf]>) -> Printed<'a> {
        let named = |effect: &'a Effect| Named {
            name: &effect.name,
            kind: effect.kind,
            alternatives: &effect.alternatives,
            equation: &effect.equation,
            story: &effect.story,
            parameters: &effect.parameters,
        };
        Printed {
            format: "diagnosis/1",
            recording: &finding.recording,
            verdict: finding.verdict,
            channel: finding.channel,
            samples: finding.samples,
            effects: finding.effects.iter().map(named).collect(),
            region: &finding.region,
            chance: finding.chance,
            shape: finding.shape.as_ref(),
            heldout: &finding.held_out,
            candidates: &finding.candidates,
            perhaps: finding.perhaps.as_ref(),
            advice: &finding.advice,
            smallest: &finding.smallest,
            prediction: &finding.prediction,
            files,
        }
    }
}
