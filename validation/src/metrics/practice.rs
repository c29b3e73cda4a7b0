//! Truths of the practice set, which another world made: one JSON text a recording.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::{Injected, Truth, canonical};

/// White part of the noise of its probes (m/s) and of its throttles. Recovered from the rows that
/// its truths list: those where the difference exceeds half a deviation.
const WHITE_MPS: f64 = 0.06;
const WHITE_THROTTLE: f64 = 0.0125;

/// A truth that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum PracticeError {
    /// Not the JSON of a truth.
    #[error("not a truth of the practice set: {0}")]
    Unreadable(#[from] serde_json::Error),
    /// Its columns differ in length.
    #[error("its columns have {truth} and {baseline} rows")]
    Uneven {
        /// Rows of `truth_clean`.
        truth: usize,
        /// Rows of `baseline_clean`.
        baseline: usize,
    },
}

#[derive(Deserialize)]
struct Written {
    family: String,
    effects: Vec<WrittenEffect>,
    region_sample_index: Vec<usize>,
    truth_clean: Vec<f64>,
    baseline_clean: Vec<f64>,
    noise_level: f64,
    oracle_chi2: f64,
}

#[derive(Deserialize)]
struct WrittenEffect {
    effect: String,
    params: BTreeMap<String, f64>,
    accept: Vec<String>,
}

/// The truth of one recording of the practice set from its `truth/<id>.json`; `is_throttle` where
/// it has a receiver and no probes.
///
/// # Errors
/// A text of another kind.
pub fn practice(text: &str, is_throttle: bool) -> Result<Truth, PracticeError> {
    let written: Written = serde_json::from_str(text)?;
    if written.truth_clean.len() != written.baseline_clean.len() {
        return Err(PracticeError::Uneven {
            truth: written.truth_clean.len(),
            baseline: written.baseline_clean.len(),
        });
    }
    let noise = |&value: &f64| match is_throttle {
        true => (written.noise_level * (value - 1.0)).hypot(WHITE_THROTTLE),
        false => (written.noise_level * value).hypot(WHITE_MPS),
    };
    Ok(Truth {
        family: written.family,
        is_outside: written
            .effects
            .iter()
            .any(|effect| effect.accept.is_empty()),
        effects: written.effects.into_iter().map(injected).collect(),
        region: written.region_sample_index,
        noise: written.truth_clean.iter().map(noise).collect(),
        truth_clean: written.truth_clean,
        baseline_clean: written.baseline_clean,
        oracle_chi2: written.oracle_chi2,
    })
}

fn injected(written: WrittenEffect) -> Injected {
    let value = |name: &str| written.params.get(name).copied();
    let renamed = |name: &str, value: Option<f64>| Some((name.to_owned(), value?));
    // The parameters that mean the same as in the library, by its names.
    let parameters = match written.effect.as_str() {
        "cant" => vec![renamed("q", value("q"))],
        "crossflow" => {
            let wind = value("w").zip(value("dir"));
            vec![
                renamed("wind_x", wind.map(|(speed, azimuth)| speed * azimuth.cos())),
                renamed("wind_y", wind.map(|(speed, azimuth)| speed * azimuth.sin())),
            ]
        }
        "payload" | "payload_step" => vec![renamed("m/m0", value("frac").map(|part| 1.0 + part))],
        "recirc" => vec![renamed("u", value("u"))],
        "motion" => vec![renamed("m", value("kc").map(f64::recip))],
        "dl" => vec![renamed("p", value("p"))],
        "lag" => vec![renamed("tau", value("tau"))],
        "offset" => vec![renamed("b", value("b"))],
        _ => Vec::new(),
    };
    let first = written
        .accept
        .first()
        .map_or(written.effect.as_str(), |name| canonical(name));
    Injected {
        name: first.to_owned(),
        parameters: parameters.into_iter().flatten().collect(),
        accepted: written.accept,
    }
}
