//! Samples of one channel as a table: what was recorded, what was simulated, and where in whose
//! wake.

use diagnosis::forward::simulate::{Channel, Sample};
use rayon::prelude::*;

use super::simulated::Simulated;
use crate::report::words::{channel_words, joined};

/// One row a sample, in the order of the recordings; empty where there is no wake to be in.
pub(super) fn table(channel: Channel, all: &[Simulated]) -> String {
    let unit = channel_words(channel).suffix;
    let text = format!(
        "recording,row,t_s,subject,x_m,y_m,z_m,height_m,recorded_{unit},simulated_{unit},residual_{unit},air_mps,emitter,s_over_l,r_over_l,xi,azimuth_rad\n"
    );
    let parts: Vec<String> = all.par_iter().map(|one| rows(channel, one)).collect();
    text + &parts.concat()
}

fn rows(channel: Channel, one: &Simulated) -> String {
    let floor_m = one.recording.environment.floor_z_m.unwrap_or(0.0);
    let name = quoted(&one.recording.name);
    let id = |index: usize| quoted(&one.recording.vehicles[index].id);
    let numbers = |values: &[f64]| joined(values.iter().map(|it| format!("{it:.4}")), ",");
    let row = |sample: &Sample| {
        let (at, place) = (sample.position_m, &sample.place);
        let subject = match channel {
            Channel::Speed => sample.subject.to_string(),
            _ => id(sample.subject as usize),
        };
        let wake = place.as_ref().map_or(",,,,".to_owned(), |it| {
            let there = [it.s_over_l, it.r_over_l, it.xi, it.azimuth_rad];
            format!("{},{}", id(it.emitter), numbers(&there))
        });
        let speeds = [sample.recorded, sample.simulated, sample.residual()];
        let cells = [
            name.clone(),
            sample.row.to_string(),
            format!("{:.3}", sample.t_s),
            subject,
            numbers(&[at.x, at.y, at.z, at.z - floor_m]),
            joined(speeds.map(|it| format!("{it:.5}")), ","),
            numbers(&[sample.air_mps]),
            wake + "\n",
        ];
        cells.join(",")
    };
    let samples = one.samples.iter();
    let here = samples.filter(|sample| sample.channel == channel);
    here.map(row).collect()
}

/// As RFC 4180 has it.
fn quoted(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}
