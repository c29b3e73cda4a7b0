//! `probes.csv`: readings of anemometers, and which of them cannot be used.
//!
//! Sample `i` is data row `i`, so nothing is taken out: a reading that cannot be used becomes NaN,
//! is counted and told.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::found::{Found, Place};
use super::table::Table;
use crate::record::recording::{Instrument, ProbeSample, Probes};
use crate::record::remark::RemarkKind;

/// The file's name.
pub(super) const PROBES: &str = "probes.csv";
/// Identical readings in a row that make a stuck probe.
const STUCK_READINGS: usize = 8;
/// Fastest reading (m/s). Chosen here: four times the fastest jet of the paper's airframes at their
/// rotors.
const FASTEST_MPS: f64 = 100.0;
/// Readings within half a step of the highest that make a plateau. Chosen here: a jet's highest
/// reading stands alone.
const PLATEAU_READINGS: usize = 8;

/// Reads the table.
pub(super) fn probes(bytes: &[u8], instrument: &Instrument, found: &mut Found) -> Option<Probes> {
    let table = Table::open(PROBES, bytes, found)?;
    let wanted = ["t_s", "probe_id", "x_m", "y_m", "z_m", "speed_mps"];
    let columns = table.columns(&wanted, &[], found)?;
    let rows = table.read(&columns, None, found);
    let mut samples = Vec::with_capacity(rows.lines.len());
    for (row, &line) in rows.lines.iter().enumerate() {
        let at = |column: usize| rows.numbers[column][row];
        let (t_s, id) = (at(0), at(1));
        if !t_s.is_finite() {
            found.problem(Place::field(PROBES, "t_s").line(line), "has no time");
        }
        // Exact for every id that passes the comparison; the cast saturates for the others.
        let probe_id = id as u32;
        if f64::from(probe_id) != id {
            let message = format!("is {id}; it must be a whole number, 0 or more");
            found.problem(Place::field(PROBES, "probe_id").line(line), message);
        }
        samples.push(ProbeSample {
            t_s,
            probe_id,
            position_m: Point3::new(at(2), at(3), at(4)),
            speed_mps: at(5),
        });
    }
    judge(&mut samples, instrument, found);
    Some(Probes {
        instrument: instrument.clone(),
        samples,
    })
}

/// Marks what cannot be used, and remarks on it, probe by probe.
fn judge(samples: &mut [ProbeSample], instrument: &Instrument, found: &mut Found) {
    let mut of_probe: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (row, sample) in samples.iter().enumerate() {
        of_probe.entry(sample.probe_id).or_default().push(row);
    }
    for (probe_id, rows) in of_probe {
        let subject = format!("probe {probe_id}");
        let mut tell = |kind, rows: &[usize], samples: &[ProbeSample], what: &str| {
            let times_s = rows.iter().map(|&row| samples[row].t_s);
            found.rows(kind, Some(&subject), ("reading", times_s), what);
        };
        let mut last_s = f64::NEG_INFINITY;
        let (mut backward, mut missing, mut impossible) = (Vec::new(), Vec::new(), Vec::new());
        for &row in &rows {
            let ProbeSample {
                t_s,
                speed_mps,
                position_m,
                ..
            } = samples[row];
            if t_s <= last_s {
                backward.push(row);
            } else if !(speed_mps.is_finite() && position_m.iter().all(|v| v.is_finite())) {
                missing.push(row);
            } else if !(0.0..=FASTEST_MPS).contains(&speed_mps) {
                impossible.push(row);
            }
            last_s = last_s.max(t_s);
        }
        let good: Vec<usize> = rows
            .iter()
            .copied()
            .filter(|row| {
                ![&backward, &missing, &impossible]
                    .iter()
                    .any(|bad| bad.binary_search(row).is_ok())
            })
            .collect();
        tell(
            RemarkKind::Impossible,
            &backward,
            samples,
            "left out: their time repeats or goes back",
        );
        tell(
            RemarkKind::Impossible,
            &missing,
            samples,
            "left out: no speed or no position",
        );
        if let Some(&first) = impossible.first() {
            let first_mps = samples[first].speed_mps;
            let what = format!("left out: a speed outside 0 to 100 m/s (first {first_mps})");
            tell(RemarkKind::Impossible, &impossible, samples, &what);
        }
        let stuck: Vec<usize> = good
            .chunk_by(|&a, &b| samples[a].speed_mps == samples[b].speed_mps)
            .filter(|run| run.len() >= STUCK_READINGS && samples[run[0]].speed_mps != 0.0)
            .filter(|run| !plateau(samples[run[0]].speed_mps, &good, samples, instrument))
            .flat_map(|run| run[1..].iter().copied())
            .collect();
        tell(
            RemarkKind::Stuck,
            &stuck,
            samples,
            "left out: the same speed as before, eight or more times in a row",
        );
        saturated(&good, samples, instrument, &mut tell);
        gaps(&good, samples, instrument, &mut tell);
        for row in backward
            .into_iter()
            .chain(missing)
            .chain(impossible)
            .chain(stuck)
        {
            samples[row].speed_mps = f64::NAN;
        }
    }
}

/// Whether a speed is the highest that the probe read: repeated, it is the end of its scale.
fn plateau(
    speed_mps: f64,
    good: &[usize],
    samples: &[ProbeSample],
    instrument: &Instrument,
) -> bool {
    let top_mps = top(good, samples);
    speed_mps >= top_mps - instrument.resolution_mps
}

fn top(good: &[usize], samples: &[ProbeSample]) -> f64 {
    let speeds = good.iter().map(|&row| samples[row].speed_mps);
    speeds.fold(0.0, f64::max)
}

/// Many readings at the very top are the end of the scale.
fn saturated(
    good: &[usize],
    samples: &[ProbeSample],
    instrument: &Instrument,
    tell: &mut impl FnMut(RemarkKind, &[usize], &[ProbeSample], &str),
) {
    let top_mps = top(good, samples);
    let at_top = |row: &usize| samples[*row].speed_mps >= top_mps - 0.5 * instrument.resolution_mps;
    let rows: Vec<usize> = good.iter().copied().filter(at_top).collect();
    if top_mps > 0.0 && rows.len() >= PLATEAU_READINGS {
        let what =
            format!("at the highest speed of all, {top_mps} m/s: the end of its scale? Kept");
        tell(RemarkKind::Saturated, &rows, samples, &what);
    }
}

fn gaps(
    good: &[usize],
    samples: &[ProbeSample],
    instrument: &Instrument,
    tell: &mut impl FnMut(RemarkKind, &[usize], &[ProbeSample], &str),
) {
    let step_s = |pair: &[usize]| samples[pair[1]].t_s - samples[pair[0]].t_s;
    let longest_s = 3.0 / instrument.rate_hz;
    let rows: Vec<usize> = good
        .windows(2)
        .filter(|pair| step_s(pair) > longest_s)
        .map(|pair| pair[0])
        .collect();
    let worst_s = good.windows(2).map(step_s).fold(0.0, f64::max);
    let rate_hz = instrument.rate_hz;
    let what =
        format!("with a gap after them, the longest of {worst_s:.2} s (the rate is {rate_hz} Hz)");
    tell(RemarkKind::Gap, &rows, samples, &what);
}
