//! A finding tested on recordings that it was not fitted to: before and after, by flight and over
//! all, with one offset a drone (or probe) and flight, and without.
//!
//! Nothing of the air is fitted here. The offset is the median of what is left, once for the
//! simulation as it is and once for the corrected one: a thrust map, or a sensor's zero, is not
//! known better from one flight to the next. Without it nothing at all is fitted.

use rayon::prelude::*;
use serde::Serialize;

use super::diagnose::CampaignError;
use super::forces::{CampaignOptions, Forces};
use crate::forward::held_out::{ABOVE_FLOOR_M, R2Figures, R2Sums, UNDER_M};
use crate::forward::hypothesis::Hypothesis;
use crate::forward::observed::{Explained, Observed};
use crate::forward::simulate::{Channel, Sample};
use crate::record::recording::Recording;
use crate::statistics::held_out::FOLDS;
use crate::statistics::quantile::median;
use crate::statistics::sequence::{Blocks, Sequence};

/// A finding, judged.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Applied {
    /// What was compared.
    pub channel: Channel,
    /// Over all recordings: by place, each without offsets and with them.
    pub all: Vec<Compared>,
    /// Recording by recording, all rows, without offsets and with them.
    pub by_flight: Vec<Compared>,
    /// Of every recording, its index and its samples with what the corrected simulation makes of
    /// them.
    #[serde(skip)]
    pub corrected: Vec<(usize, Vec<Sample>)>,
    /// The same with the simulation as it is.
    #[serde(skip)]
    pub plain: Vec<(usize, Vec<Sample>)>,
}

/// Errors before and after over some rows, in the channel's unit. Intervals are 95 % by bootstrap
/// over whole recordings, or over blocks of time where there are fewer than six recordings: lower
/// end, value, upper end. The ends are not numbers where there is one block.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// Which rows.
    pub rows_where: String,
    /// Whether one offset a drone or probe and flight is taken off either side.
    pub has_offsets: bool,
    /// How many rows, of how many recordings.
    pub rows: usize,
    /// Recordings with any.
    pub recordings: usize,
    /// Root mean square of what the simulation as it is leaves.
    pub rms_before: f64,
    /// The same corrected.
    pub rms_after: [f64; 3],
    /// `R²` against the mean of these rows, as it is.
    pub r2_before: f64,
    /// Corrected.
    pub r2_after: [f64; 3],
    /// The difference.
    pub r2_gained: [f64; 3],
}

/// One recording, before and after.
struct JudgedRecording {
    recording: usize,
    name: String,
    /// With the simulation as it is.
    samples: Vec<Sample>,
    after: Vec<f64>,
    /// Probe or drone, and block of time.
    series: Vec<usize>,
    blocks: Vec<usize>,
    /// Whether a row lies under another drone, as it is judged.
    is_under: Vec<bool>,
}

/// Applies a correction to recordings of probes or receivers; those without the channel, the first
/// that any has where none is named, are left out. `None`: nothing can be compared.
#[must_use]
pub fn apply(
    recordings: &[Recording],
    channel: Option<Channel>,
    correction: &Hypothesis,
) -> Option<Applied> {
    let of = |(recording, of): (usize, &Recording)| {
        let observed = Observed::of(of, channel)?;
        let times_s = observed.times_s();
        let sequence = Sequence::new(&times_s, &observed.series_of);
        Some(JudgedRecording {
            recording,
            name: of.name.clone(),
            after: observed.predict(correction),
            series: observed.series_of.clone(),
            blocks: Blocks::new(&sequence, &times_s).of_sample,
            is_under: vec![false; observed.samples.len()],
            samples: observed.samples,
        })
    };
    let flights = recordings.par_iter().enumerate().filter_map(of);
    let mut flights: Vec<JudgedRecording> = flights.collect();
    let channel = flights.first()?.samples.first()?.channel;
    flights.retain(|flight| flight.samples.first().is_some_and(|s| s.channel == channel));
    Some(applied(channel, flights))
}

/// Applies a correction to the vertical forces of flights. Thrust maps come from flights other than
/// the one that is judged; recordings that are not judged serve them too.
///
/// # Errors
/// No force, or no thrust map.
pub fn apply_campaign(
    recordings: &[Recording],
    options: &CampaignOptions,
    correction: &Hypothesis,
) -> Result<Applied, CampaignError> {
    let forces = Forces::new(recordings, options)?;
    if forces.rows == 0 {
        return Err(CampaignError::no_force(recordings));
    }
    let before = forces.predict(&Hypothesis::default());
    let after = forces.predict(correction);
    let covariates = forces.covariates().columns;
    let [beside_m, height_m] = [1, 3].map(|at| &covariates[at]);
    let mut flights: Vec<JudgedRecording> = Vec::new();
    let rows = forces.samples(&before).into_iter().zip(forces.judged());
    for (row, (sample, (part, _))) in rows.enumerate() {
        if flights
            .last()
            .is_none_or(|last| last.recording != part.recording)
        {
            flights.push(JudgedRecording {
                recording: part.recording,
                name: recordings[part.recording].name.clone(),
                samples: Vec::new(),
                after: Vec::new(),
                series: Vec::new(),
                blocks: Vec::new(),
                is_under: Vec::new(),
            });
        }
        let flight = flights
            .last_mut()
            .expect("one was pushed where there was none");
        flight.samples.push(sample);
        flight.after.push(after[row]);
        flight.series.push(part.vehicle);
        let is_under = beside_m[row] < UNDER_M && height_m[row] > ABOVE_FLOOR_M;
        flight.is_under.push(is_under);
    }
    for flight in &mut flights {
        let times_s: Vec<f64> = flight.samples.iter().map(|sample| sample.t_s).collect();
        let sequence = Sequence::new(&times_s, &flight.series);
        flight.blocks = Blocks::new(&sequence, &times_s).of_sample;
    }
    Ok(applied(Channel::VerticalForce, flights))
}

fn applied(channel: Channel, flights: Vec<JudgedRecording>) -> Applied {
    let everywhere = |_: &JudgedRecording, _: usize| true;
    let under = |flight: &JudgedRecording, row: usize| flight.is_under[row];
    let name =
        format!("under another drone (within {UNDER_M} m, {ABOVE_FLOOR_M} m above the floor)");
    let sides = [false, true];
    let mut all = sides.map(|offsets| compared("all rows", &flights, offsets, everywhere));
    let mut all: Vec<Option<Compared>> = all.iter_mut().map(Option::take).collect();
    all.extend(sides.map(|offsets| compared(&name, &flights, offsets, under)));
    let by_flight = flights.iter().flat_map(|flight| {
        let one = std::slice::from_ref(flight);
        sides.map(|offsets| compared(&flight.name, one, offsets, everywhere))
    });
    let corrected = |flight: &JudgedRecording| {
        let pairs = flight.samples.iter().zip(&flight.after);
        let samples = pairs.map(|(sample, &simulated)| Sample {
            simulated,
            ..*sample
        });
        (flight.recording, samples.collect())
    };
    Applied {
        channel,
        all: all.into_iter().flatten().collect(),
        by_flight: by_flight.flatten().collect(),
        corrected: flights.iter().map(corrected).collect(),
        plain: flights
            .iter()
            .map(|of| (of.recording, of.samples.clone()))
            .collect(),
    }
}

/// Figures over the rows of a place; `None` where there are too few.
fn compared(
    rows_where: &str,
    flights: &[JudgedRecording],
    has_offsets: bool,
    is_inside: impl Fn(&JudgedRecording, usize) -> bool,
) -> Option<Compared> {
    // Whole recordings are drawn where there are enough of them.
    let by_flight = flights.len() >= FOLDS;
    let mut units: Vec<R2Sums> = Vec::new();
    let mut recordings = 0;
    for flight in flights {
        let recorded: Vec<f64> = flight
            .samples
            .iter()
            .map(|sample| sample.recorded)
            .collect();
        let before: Vec<f64> = flight
            .samples
            .iter()
            .map(|sample| sample.simulated)
            .collect();
        let [before, after] = [before, flight.after.clone()].map(|predicted| match has_offsets {
            true => with_offsets(&flight.series, &recorded, predicted),
            false => predicted,
        });
        let first = units.len();
        let last = flight.blocks.iter().max().map_or(0, |last| last + 1);
        units.resize(first + if by_flight { 1 } else { last }, R2Sums::default());
        let inside: Vec<usize> = (0..recorded.len())
            .filter(|&i| is_inside(flight, i))
            .collect();
        recordings += usize::from(!inside.is_empty());
        for i in inside {
            let unit = first + if by_flight { 0 } else { flight.blocks[i] };
            units[unit].add(recorded[i], [before[i], after[i]]);
        }
    }
    units.retain(|sums| sums.rows > 0.0);
    let figures = R2Figures::over(&units)?;
    let with_ends = |of: [f64; 3]| match units.len() {
        1 => [f64::NAN, of[1], f64::NAN],
        _ => of,
    };
    Some(Compared {
        rows_where: rows_where.to_owned(),
        has_offsets,
        rows: figures.rows,
        recordings,
        rms_before: figures.rms.0,
        rms_after: with_ends(figures.rms.1),
        r2_before: figures.r2.0,
        r2_after: with_ends(figures.r2.1),
        r2_gained: with_ends(figures.r2_gained),
    })
}

/// Predictions with one offset a series, whatever its size, that brings their median to the
/// recorded one.
fn with_offsets(series: &[usize], recorded: &[f64], mut predicted: Vec<f64>) -> Vec<f64> {
    for of in 0..series.iter().max().map_or(0, |last| last + 1) {
        let inside = || (0..series.len()).filter(|&i| series[i] == of);
        let mut rests: Vec<f64> = inside().map(|i| recorded[i] - predicted[i]).collect();
        let offset = median(&mut rests).unwrap_or(0.0);
        inside().for_each(|i| predicted[i] += offset);
    }
    predicted
}
