//! Logs of several vehicles that flew together, each with a clock of its own, as one recording.

use std::io::BufRead;

use super::campaign::Campaign;
use super::checks::BELOW_FLOOR_M;
use super::found::{Found, Start};
use super::log::read_into;
use super::origin::Origin;
use crate::record::problem::{Problem, Problems};
use crate::record::recording::{Clock, Recording};
use crate::record::remark::{Remark, RemarkKind};

/// One of the logs of a flight.
#[derive(Debug)]
pub struct JoinedLog<R> {
    /// The vehicle, as the campaign calls it.
    pub vehicle: String,
    /// Its name without its ending, as in the campaign's `starts_s`.
    pub log: String,
    /// What messages call it; says by its ending what its bytes do not.
    pub file: String,
    /// Its unpacked bytes.
    pub bytes: R,
}

/// A log that was read, on its own clock and in its own frame.
struct ReadLog {
    recording: Recording,
    /// When its own time is 0, on the clock that all share.
    zero: Option<Start>,
    /// Its own time of its first row (s).
    first_s: f64,
    origin: Option<Origin>,
    vehicle: String,
    log: String,
    file: String,
}

/// A recording of logs that were written at the same time, brought to one clock: that which the
/// campaign states when each begins on (`starts_s`), else each log's own of GPS, UTC or an epoch.
/// Its time 0 is when the first of them begins, and its frame that of the first log, as far as each
/// says where on the Earth its places count from.
///
/// # Errors
/// Everything that keeps one of them from being read, and logs that share no clock.
pub fn read_joined<R: BufRead>(
    name: &str,
    logs: Vec<JoinedLog<R>>,
    campaign: &Campaign,
) -> Result<Recording, Problems> {
    let mut problems = Vec::new();
    let mut parts: Vec<ReadLog> = Vec::new();
    for mut log in logs {
        let mut found = Found::default();
        let bytes = &mut log.bytes;
        let read = read_into(&log.vehicle, &log.file, bytes, campaign, &mut found);
        problems.append(&mut found.problems);
        let first_s = found.first_s.unwrap_or(0.0);
        let stated = campaign.starts_s.get(&log.log).map(|start_s| Start {
            at_s: start_s.0 - first_s,
            within_s: 0.0,
        });
        if let Some(mut recording) = read {
            recording.remarks = found.remarks;
            parts.push(ReadLog {
                recording,
                zero: stated.or(found.starts),
                first_s,
                origin: found.origin,
                vehicle: log.vehicle,
                log: log.log,
                file: log.file,
            });
        }
    }
    for part in &parts {
        if part.zero.is_none() {
            let help = format!(
                "write when it begins on a clock that all share: `starts_s: {{ \"{}\": ?, ... }}`",
                part.log
            );
            problems.push(Problem {
                message: "has no clock that other logs share".to_owned(),
                help: Some(help),
                ..Problem::file(&part.file)
            });
        }
        let vehicles = part.recording.vehicles.iter();
        for other in vehicles.filter(|of| of.id != part.vehicle) {
            let message = format!(
                "holds `{}`, and is listed as of `{}`",
                other.id, part.vehicle
            );
            problems.push(Problem {
                message,
                ..Problem::file(&part.file)
            });
        }
    }
    if !problems.is_empty() {
        return Err(Problems(problems));
    }
    let zeros = parts.iter().filter_map(|part| part.zero);
    let within_s = zeros.map(|zero| zero.within_s).fold(0.0, f64::max);
    let begins_s = |part: &ReadLog| part.zero.map_or(0.0, |zero| zero.at_s) + part.first_s;
    let start_s = parts.iter().map(begins_s).fold(f64::INFINITY, f64::min);
    let frame = parts.iter().find_map(|part| part.origin);
    let mut joined: Option<Recording> = None;
    for part in parts {
        let later_s = begins_s(&part) - start_s;
        let since_s = later_s - part.first_s;
        let mut recording = part.recording;
        for vehicle in &mut recording.vehicles {
            vehicle.track.t_s.iter_mut().for_each(|t_s| *t_s += since_s);
            if campaign.clock.is_none() && within_s > 0.0 {
                vehicle.clock = Clock::Own { within_s };
            }
        }
        for remark in &mut recording.remarks {
            remark.span_s = remark
                .span_s
                .map(|(from, to)| (from + since_s, to + since_s));
        }
        let begins = format!(
            "{} begins {later_s:.3} s after the first log of the flight",
            part.file
        );
        let places = moved(&mut recording, part.origin, frame);
        for message in std::iter::once(begins).chain(places) {
            let remark = Remark::new(RemarkKind::Assumed, Some(&part.vehicle), message);
            recording.remarks.push(remark);
        }
        match &mut joined {
            None => joined = Some(recording),
            Some(all) => {
                all.vehicles.append(&mut recording.vehicles);
                let is_new = |remark: &Remark| !all.remarks.contains(remark);
                let new: Vec<Remark> = recording.remarks.into_iter().filter(is_new).collect();
                all.remarks.extend(new);
            }
        }
    }
    let mut joined = joined.ok_or_else(|| {
        Problems(vec![Problem {
            message: "has no log".to_owned(),
            ..Problem::file(name)
        }])
    })?;
    joined.name = name.to_owned();
    joined.vehicles.sort_by(|a, b| a.id.cmp(&b.id));
    if within_s > 0.0 && campaign.clock.is_none() {
        let message = format!("clocks by GPS, each taken as known within {within_s} s");
        (joined.remarks).push(Remark::new(RemarkKind::Assumed, None, message));
    }
    Ok(joined)
}

/// Brings places of a log into the frame that all share, and says what was done or taken for
/// granted.
fn moved(
    recording: &mut Recording,
    origin: Option<Origin>,
    frame: Option<Origin>,
) -> Option<String> {
    let Some((origin, frame)) = origin.zip(frame) else {
        let what = "its places are taken to be in the frame of the other logs, for it does not say where on the Earth they count from";
        return Some(what.to_owned());
    };
    let shift_m = origin.shift_m(&frame);
    let lowest_m = (recording.environment.floor_z_m).map(|floor_z_m| floor_z_m - BELOW_FLOOR_M);
    let (mut rows, mut below) = (0, 0);
    let tracks = recording.vehicles.iter_mut().map(|of| &mut of.track);
    for position_m in tracks.flat_map(|track| &mut track.position_m) {
        *position_m += shift_m;
        rows += 1;
        below += usize::from(lowest_m.is_some_and(|lowest_m| position_m.z < lowest_m));
    }
    let mut heights = match origin.altitude_m.and(frame.altitude_m) {
        Some(_) => String::new(),
        None => "; heights are taken to be over the same level".to_owned(),
    };
    if below > 0 {
        heights += &format!(
            "; {below} of its {rows} rows are then more than {BELOW_FLOOR_M} m below the floor: heights of origins are GPS's, and can be metres off"
        );
    }
    (origin != frame).then(|| {
        let [x, y, z]: [f64; 3] = shift_m.into();
        format!("its places are moved by ({x:.2}, {y:.2}, {z:.2}) m into the frame of the first log, as both say where on the Earth they count from{heights}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMPAIGN: &str = r#"(
        name: "two", air: (temperature_c: 20),
        types: { "quad": (mass_kg: Stated(1.5), propeller_diameter_m: Stated(0.25), motor_distance_m: Stated(0.45)) },
        vehicles: { "q1": "quad", "q2": "quad" },
        joined: { "noon": { "q1": "a", "q2": "b" } },
        STARTS
    )"#;

    /// A second at 10 Hz, 2 m up, moving north at 1 m/s from where it was at the epoch's 1000000 s.
    fn table(from_s: f64) -> Vec<u8> {
        let row = |tick: u32| {
            let t_s = from_s + 0.1 * f64::from(tick);
            format!("{t_s:.3},{:.3},0,2\n", t_s.rem_euclid(1000.0))
        };
        let rows: String = (0..10).map(row).collect();
        format!("t_s,x_m,y_m,z_m\n{rows}").into_bytes()
    }

    fn logs(tables: &[Vec<u8>; 2]) -> Vec<JoinedLog<&[u8]>> {
        [("q1", "a"), ("q2", "b")]
            .into_iter()
            .zip(tables)
            .map(|((vehicle, log), bytes)| JoinedLog {
                vehicle: vehicle.to_owned(),
                log: log.to_owned(),
                file: format!("{log}.csv"),
                bytes: bytes.as_slice(),
            })
            .collect()
    }

    fn campaign(starts: &str) -> Campaign {
        Campaign::parse("c.ron", &CAMPAIGN.replace("STARTS", starts)).expect("in order")
    }

    #[test]
    fn logs_of_one_epoch_lie_on_one_clock() {
        let tables = [table(1_700_000_000.0), table(1_700_000_000.5)];
        let joined = read_joined("noon", logs(&tables), &campaign("")).expect("in order");
        let [q1, q2] = &joined.vehicles[..] else {
            panic!("two: {joined:?}");
        };
        assert_eq!((joined.name.as_str(), q1.id.as_str()), ("noon", "q1"));
        // Times near 1.7e9 s are doubles to within 2.4e-7 s.
        assert!((q1.track.t_s[0]).abs() < 1e-6 && (q2.track.t_s[0] - 0.5).abs() < 1e-6);
        // Both passed the same places at the same times.
        let both = q1.track.position_m[5].x - q2.track.position_m[0].x;
        assert!(both.abs() < 1e-9, "{both}");
    }

    #[test]
    fn logs_without_a_clock_ask_for_when_they_begin_and_take_it() {
        let tables = [table(0.0), table(0.0)];
        let Problems(problems) =
            read_joined("noon", logs(&tables), &campaign("")).expect_err("none");
        assert_eq!(problems.len(), 2);
        assert!(
            problems[1]
                .help
                .as_deref()
                .is_some_and(|help| help.contains("\"b\": ?"))
        );
        let starts = campaign(r#"starts_s: { "a": 10.0, "b": 9.75 },"#);
        let joined = read_joined("noon", logs(&tables), &starts).expect("in order");
        let begins = |vehicle: usize| joined.vehicles[vehicle].track.t_s[0];
        assert_eq!((begins(0), begins(1)), (0.25, 0.0));
    }

    #[test]
    fn a_stated_start_is_that_of_the_first_row_whatever_the_log_counts_from() {
        let starts = campaign(r#"starts_s: { "a": 0.0, "b": 0.5 },"#);
        for from_s in [[100.0, 40.0], [-100.0, 40.0], [0.0, 0.0]] {
            let tables = from_s.map(table);
            let joined = read_joined("noon", logs(&tables), &starts).expect("in order");
            let begins = |vehicle: usize| joined.vehicles[vehicle].track.t_s[0];
            assert_eq!((begins(0), begins(1)), (0.0, 0.5), "{from_s:?}");
            let said = |what: &str| joined.remarks.iter().any(|of| of.message.contains(what));
            assert!(said("a.csv begins 0.000 s after") && said("b.csv begins 0.500 s after"));
            assert!(said("it does not say where on the Earth"));
        }
    }
}
