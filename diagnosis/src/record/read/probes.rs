//! `probes.csv`: readings of anemometers, and which of them cannot be used.
//!
//! Sample `i` is data row `i`, so nothing is taken out: a reading that cannot be used becomes NaN,
//! is counted and reported.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::checks::is_shuffled;
use super::found::{Found, RowRemarks};
use super::table::Table;
use crate::record::problem::Problem;
use crate::record::recording::{Instrument, ProbeSample, Probes};
use crate::record::remark::RemarkKind;
use crate::statistics::quantile::median;

/// The file's name.
pub(super) const PROBES: &str = "probes.csv";
/// Identical readings in a row that make a stuck probe.
pub(crate) const STUCK_READINGS: usize = 8;
/// Fastest reading (m/s). Chosen here: four times the fastest jet of the paper's airframes at their
/// rotors.
const FASTEST_MPS: f64 = 100.0;
/// Readings within half a step of the highest that make a plateau. Chosen here: a jet's highest
/// reading stands alone.
const PLATEAU_READINGS: usize = 8;
/// Longest step that is no gap, in steps of the rate. Chosen here: two lost readings are none.
const LONGEST_STEP: f64 = 3.0;

/// Height above the floor in which no anemometer reads a jet (m): the floor stops the air. Chosen
/// here: the size of an instrument's head.
const ON_FLOOR_M: f64 = 0.01;

/// Reads the table.
pub(super) fn probes(
    bytes: &[u8],
    (instrument, floor_z_m): (&Instrument, Option<f64>),
    found: &mut Found,
) -> Option<Probes> {
    let table = Table::open(PROBES, bytes, found)?;
    let wanted = ["t_s", "probe_id", "x_m", "y_m", "z_m", "speed_mps"];
    let columns = table.columns(&wanted, &[], found)?;
    let rows = table.read(&columns, columns.get(1).copied(), found);
    let instrument = &Instrument {
        rate_hz: instrument.rate_hz / rows.stride as f64,
        ..instrument.clone()
    };
    let mut samples = Vec::with_capacity(rows.lines.len());
    let mut are_numbered = true;
    for (row, &line) in rows.lines.iter().enumerate() {
        let at = |column: usize| rows.numbers[column][row];
        let (t_s, id) = (at(0), at(1));
        if !t_s.is_finite() {
            found.problem(Problem::field(PROBES, "t_s").line(line), "has no time");
        }
        // Exact for every id that passes the comparison; the cast saturates for the others.
        let probe_id = id as u32;
        if f64::from(probe_id) != id {
            are_numbered = false;
            let cell = rows.named.get(row).map_or("", |&name| &rows.names[name]);
            let wanted = "it must be a whole number, 0 or more";
            let cell = cell.trim();
            let message = match cell.parse::<f64>() {
                _ if cell.is_empty() => Some(format!("is empty; {wanted}")),
                // It was reported where it was read.
                Err(_) => None,
                Ok(_) => Some(format!("is {id}; {wanted}")),
            };
            let place = Problem::field(PROBES, "probe_id").line(line);
            message
                .into_iter()
                .for_each(|text| found.problem(place.clone(), text));
        }
        samples.push(ProbeSample {
            t_s,
            probe_id,
            position_m: Point3::new(at(2), at(3), at(4)),
            speed_mps: at(5),
        });
    }
    // Otherwise the readings' probes are unknown.
    if are_numbered {
        judge(&mut samples, (instrument, floor_z_m), found);
    }
    if !samples.is_empty() && samples.iter().all(|sample| sample.speed_mps.is_nan()) {
        let help = found.remarks.last().map(|remark| remark.message.clone());
        let message = "no reading of any probe can be used";
        found.helped(Problem::field(PROBES, "speed_mps"), message, help);
    }
    Some(Probes {
        instrument: instrument.clone(),
        samples,
    })
}

/// Air that does not stop from one reading to the next and start again (m/s): faster than this, and
/// than twice the slowest reading that is not 0, which an instrument's bearing may hold. Chosen
/// here.
pub(crate) const FAST_MPS: f64 = 0.5;

/// Of one probe's rows those that read 0 between two readings of fast air; none of a few.
fn dropped(rows: &[usize], samples: &[ProbeSample]) -> Vec<usize> {
    let speed_mps = |row: &usize| samples[*row].speed_mps;
    let turning = rows.iter().map(speed_mps).filter(|mps| *mps > 0.0);
    let least_mps = FAST_MPS.max(2.0 * turning.fold(f64::INFINITY, f64::min));
    let between = rows.windows(3).filter(|of| {
        let [before, at, after] = [0, 1, 2].map(|which| speed_mps(&of[which]));
        at == 0.0 && before.min(after) > least_mps
    });
    let between: Vec<usize> = between.map(|of| of[1]).collect();
    match between.len() >= STUCK_READINGS {
        true => between,
        false => Vec::new(),
    }
}

/// Median step over that of the rate, or the inverse, that a slip of units makes and no gaps do.
/// Chosen here.
const RATE_SLIP: f64 = 3.3;

/// Marks what cannot be used, and remarks on it, probe by probe.
fn judge(
    samples: &mut [ProbeSample],
    (instrument, floor_z_m): (&Instrument, Option<f64>),
    found: &mut Found,
) {
    let t_s: Vec<f64> = samples.iter().map(|sample| sample.t_s).collect();
    let mut of_probe: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (row, sample) in samples.iter().enumerate() {
        of_probe.entry(sample.probe_id).or_default().push(row);
    }
    if samples.len() > STUCK_READINGS && 2 * of_probe.len() > samples.len() {
        let message = format!("names {} probes in {} rows", of_probe.len(), samples.len());
        let help = "columns shifted, or another column's numbers?";
        let place = Problem::field(PROBES, "probe_id");
        found.helped(place, message, Some(help.to_owned()));
        return;
    }
    for (probe_id, mut good) in of_probe {
        let mut remarks = RowRemarks {
            found,
            subject: Some(&format!("probe {probe_id}")),
            noun: "reading",
            t_s: &t_s,
        };
        let times_s: Vec<f64> = good.iter().map(|&row| t_s[row]).collect();
        if is_shuffled(&times_s) {
            let message = format!("the rows of probe {probe_id} are not in the order of time");
            let help = "sort the rows by time, or name the column that holds it";
            let place = Problem::field(PROBES, "t_s");
            remarks.found.helped(place, message, Some(help.to_owned()));
        }
        let mut heights_m: Vec<f64> = (good.iter())
            .filter_map(|&row| Some(samples[row].position_m.z - floor_z_m?))
            .collect();
        let height_m = median(&mut heights_m).filter(|height_m| *height_m < ON_FLOOR_M);
        if let Some(height_m) = height_m {
            let message = format!(
                "probe {probe_id} is {height_m:.3} m above the floor in the middle of its readings, where air does not flow"
            );
            let help = "heights in another unit or turned, columns swapped, or another `environment.floor_z_m`?";
            let place = Problem::field(PROBES, "z_m");
            remarks.found.helped(place, message, Some(help.to_owned()));
        }
        let mut last_s = f64::NEG_INFINITY;
        let is_backward = |row: &mut usize| {
            let is_backward = t_s[*row] <= last_s;
            last_s = last_s.max(t_s[*row]);
            is_backward
        };
        let backward: Vec<usize> = good.extract_if(.., is_backward).collect();
        let is_missing = |row: &mut usize| {
            let position_m = samples[*row].position_m;
            !(samples[*row].speed_mps.is_finite() && position_m.iter().all(|v| v.is_finite()))
        };
        let missing: Vec<usize> = good.extract_if(.., is_missing).collect();
        let is_impossible =
            |row: &mut usize| !(0.0..=FASTEST_MPS).contains(&samples[*row].speed_mps);
        let impossible: Vec<usize> = good.extract_if(.., is_impossible).collect();
        let first_mps = impossible
            .first()
            .map_or(0.0, |&row| samples[row].speed_mps);
        let range = format!("a speed outside 0 to 100 m/s (first {first_mps})");
        let speeds = good.iter().map(|&row| samples[row].speed_mps);
        let top_mps = speeds.fold(0.0, f64::max);
        // The highest speed, repeated, is the end of the scale.
        let is_stuck = |run: &&[usize]| {
            let mps = samples[run[0]].speed_mps;
            run.len() >= STUCK_READINGS && mps != 0.0 && mps < top_mps - instrument.resolution_mps
        };
        let is_top =
            |row: &usize| samples[*row].speed_mps >= top_mps - 0.5 * instrument.resolution_mps;
        let at_top: Vec<usize> = good.iter().copied().filter(is_top).collect();
        let stuck: Vec<usize> = good
            .chunk_by(|&a, &b| samples[a].speed_mps == samples[b].speed_mps)
            .filter(is_stuck)
            .flat_map(|run| run[1..].iter().copied())
            .collect();
        let again = "the same speed as before, eight or more times in a row";
        let dropped = dropped(&good, samples);
        let out = "0 between two readings of fast air: contacts that open?";
        for (rows, kind, what) in [
            (
                backward,
                RemarkKind::Impossible,
                "their time repeats or goes back",
            ),
            (missing, RemarkKind::Impossible, "no speed or no position"),
            (impossible, RemarkKind::Impossible, &range),
            (stuck, RemarkKind::Stuck, again),
            (dropped, RemarkKind::Impossible, out),
        ] {
            remarks.tell(kind, &rows, &format!("left out: {what}"));
            rows.iter()
                .for_each(|&row| samples[row].speed_mps = f64::NAN);
        }
        if top_mps > 0.0 && at_top.len() >= PLATEAU_READINGS {
            let what =
                format!("at the highest speed of all, {top_mps} m/s: the end of its scale? Kept");
            remarks.tell(RemarkKind::Saturated, &at_top, &what);
        }
        let step_s = |pair: &[usize]| t_s[pair[1]] - t_s[pair[0]];
        let rate_hz = instrument.rate_hz;
        let mut steps_s: Vec<f64> = good.windows(2).map(step_s).collect();
        let slip = median(&mut steps_s).map_or(1.0, |median_s| median_s * rate_hz);
        if good.len() > STUCK_READINGS && !(1.0 / RATE_SLIP..=RATE_SLIP).contains(&slip) {
            let message = format!(
                "the steps of probe {probe_id} are {:.4} s in the middle, and `probe.rate_hz` is {rate_hz}",
                slip / rate_hz
            );
            let help = "times in ms or us, or another rate?";
            let place = Problem::field(PROBES, "t_s");
            remarks.found.helped(place, message, Some(help.to_owned()));
        }
        let first = good.first().map(|&row| samples[row].speed_mps);
        let is_dead = |mps: f64| good.iter().all(|&row| samples[row].speed_mps == mps);
        if let Some(mps) = first.filter(|mps| good.len() >= STUCK_READINGS && is_dead(*mps)) {
            let what = format!("left out: all that probe {probe_id} reads is {mps} m/s: dead");
            remarks.tell(RemarkKind::Stuck, &good, &what);
            good.iter()
                .for_each(|&row| samples[row].speed_mps = f64::NAN);
            continue;
        }
        let gaps = good
            .windows(2)
            .filter(|pair| step_s(pair) > LONGEST_STEP / rate_hz);
        let gaps: Vec<usize> = gaps.map(|pair| pair[0]).collect();
        let worst_s = good.windows(2).map(step_s).fold(0.0, f64::max);
        let what = format!(
            "with a gap after them, the longest of {worst_s:.2} s (the rate is {rate_hz} Hz)"
        );
        remarks.tell(RemarkKind::Gap, &gaps, &what);
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;
    use crate::record::recording::Measures;

    fn vane() -> Instrument {
        Instrument {
            kind: "vane".into(),
            measures: Measures::SpeedMagnitude,
            rate_hz: 0.5,
            lowpass_tau_s: 0.0,
            accuracy_abs_mps: 0.03,
            accuracy_rel: 0.05,
            resolution_mps: 0.01,
        }
    }

    #[test]
    fn a_probe_without_a_number_is_told_once_a_row() {
        let text = "t_s,probe_id,x_m,y_m,z_m,speed_mps\n0,left,0,0,1,2\n2,,0,0,1,2\n4,-1,0,0,1,2\n6,nan,0,0,1,2\n";
        let mut found = Found::default();
        probes(text.as_bytes(), (&vane(), None), &mut found);
        let told: Vec<String> = found.problems.iter().map(ToString::to_string).collect();
        assert_eq!(told.len(), 4, "{told:?}");
        assert_eq!(told.concat().matches("NaN").count(), 1, "{told:?}");
    }

    #[test]
    fn of_a_long_table_every_probe_keeps_every_second_row() {
        let mut text = "t_s,probe_id,x_m,y_m,z_m,speed_mps\n".to_owned();
        for row in 0..1_060_000_u32 {
            let (t_s, probe) = (f64::from(row / 2), row % 2);
            writeln!(text, "{t_s},{probe},0,0,1,{}.{}", 1 + probe, row % 7).expect("memory");
        }
        let mut found = Found::default();
        let read = probes(text.as_bytes(), (&vane(), None), &mut found).expect("in order");
        assert!(found.problems.is_empty(), "{:?}", found.problems);
        for probe in [0, 1] {
            let own = read.samples.iter().filter(|of| of.probe_id == probe);
            assert_eq!(own.count(), 265_000);
        }
    }
}
