//! Samples of one channel as a table: what was recorded, what was simulated, and where in whose wake.

use std::fmt::Write as _;

use diagnosis::forward::simulate::{Channel, Sample};
use rayon::prelude::*;

use super::Simulated;
use crate::report::words::channel_words;

/// One row a sample, in the order of the recordings; empty where there is no wake to be in.
pub(super) fn table(channel: Channel, all: &[Simulated]) -> String {
    let unit = channel_words(channel).suffix;
    let mut text = format!(
        "recording,row,t_s,subject,x_m,y_m,z_m,height_m,recorded_{unit},simulated_{unit},residual_{unit},air_mps,emitter,s_over_l,r_over_l,xi,azimuth_rad\n"
    );
    let parts: Vec<String> = all.par_iter().map(|one| rows(channel, one)).collect();
    for part in parts {
        text += &part;
    }
    text
}

fn rows(channel: Channel, one: &Simulated) -> String {
    let floor_m = one.recording.environment.floor_z_m.unwrap_or(0.0);
    let name = quoted(&one.recording.name);
    let id = |index: usize| quoted(&one.recording.vehicles[index].id);
    let mut text = String::new();
    for sample in one
        .samples
        .iter()
        .filter(|sample| sample.channel == channel)
    {
        let subject = match channel {
            Channel::Speed => sample.subject.to_string(),
            _ => id(sample.subject as usize),
        };
        let Sample {
            row,
            t_s,
            position_m: at,
            recorded,
            simulated,
            air_mps,
            ..
        } = sample;
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "{name},{row},{t_s:.3},{subject},{:.4},{:.4},{:.4},{:.4},{recorded:.5},{simulated:.5},{:.5},{air_mps:.4},",
            at.x,
            at.y,
            at.z,
            at.z - floor_m,
            sample.residual()
        );
        let _ = match &sample.place {
            Some(place) => writeln!(
                text,
                "{},{:.4},{:.4},{:.4},{:.4}",
                id(place.emitter),
                place.s_over_l,
                place.r_over_l,
                place.xi,
                place.azimuth_rad
            ),
            None => writeln!(text, ",,,,"),
        };
    }
    text
}

/// As RFC 4180 has it.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
