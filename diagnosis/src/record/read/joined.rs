//! Logs of several vehicles that flew together, each with a clock of its own, as one recording.

use std::io::BufRead;

use super::campaign::Campaign;
use super::found::{Found, Start};
use super::log::read_into;
use crate::record::problem::{Problem, Problems};
use crate::record::recording::{Clock, Recording};
use crate::record::remark::{Remark, RemarkKind};

/// One of the logs of a flight.
#[derive(Debug)]
pub struct JoinedLog<R> {
    /// Whose it is, as the campaign calls it.
    pub vehicle: String,
    /// Its name without its ending, as in the campaign's `starts_s`.
    pub log: String,
    /// What messages call it; says by its ending what its bytes do not.
    pub file: String,
    /// Its unpacked bytes.
    pub bytes: R,
}

/// A recording of logs that were written at the same time, brought to one clock: that which the
/// campaign states when each begins on (`starts_s`), else each log's own of GPS, UTC or an epoch.
///
/// # Errors
/// Everything that keeps one of them from being read, and logs that share no clock.
pub fn read_joined<R: BufRead>(
    name: &str,
    logs: Vec<JoinedLog<R>>,
    campaign: &Campaign,
) -> Result<Recording, Problems> {
    let mut problems = Vec::new();
    let mut parts: Vec<(Recording, Option<Start>, JoinedLog<()>)> = Vec::new();
    for mut log in logs {
        let mut found = Found::default();
        let bytes = &mut log.bytes;
        let read = read_into(&log.vehicle, &log.file, bytes, campaign, &mut found);
        problems.append(&mut found.problems);
        let stated = campaign.starts_s.get(&log.log).map(|start_s| Start {
            at_s: start_s.0,
            within_s: 0.0,
        });
        if let Some(mut recording) = read {
            recording.remarks = found.remarks;
            let log = JoinedLog {
                vehicle: log.vehicle,
                log: log.log,
                file: log.file,
                bytes: (),
            };
            parts.push((recording, stated.or(found.starts), log));
        }
    }
    for (recording, start, log) in &parts {
        if start.is_none() {
            let help = format!(
                "write when it begins on a clock that all share: `starts_s: {{ \"{}\": ?, ... }}`",
                log.log
            );
            problems.push(Problem {
                message: "has no clock that other logs share".to_owned(),
                help: Some(help),
                ..Problem::file(&log.file)
            });
        }
        let others = recording.vehicles.iter().filter(|of| of.id != log.vehicle);
        for other in others {
            let message = format!(
                "holds `{}`, and is listed as of `{}`",
                other.id, log.vehicle
            );
            problems.push(Problem {
                message,
                ..Problem::file(&log.file)
            });
        }
    }
    if !problems.is_empty() {
        return Err(Problems(problems));
    }
    let starts = parts.iter().filter_map(|(_, start, _)| *start);
    let first_s = starts
        .clone()
        .map(|start| start.at_s)
        .fold(f64::INFINITY, f64::min);
    let within_s = starts.map(|start| start.within_s).fold(0.0, f64::max);
    let mut joined: Option<Recording> = None;
    for (mut recording, start, log) in parts {
        let later_s = start.map_or(0.0, |start| start.at_s - first_s);
        for vehicle in &mut recording.vehicles {
            vehicle.track.t_s.iter_mut().for_each(|t_s| *t_s += later_s);
            if campaign.clock.is_none() && within_s > 0.0 {
                vehicle.clock = Clock::Own { within_s };
            }
        }
        for remark in &mut recording.remarks {
            remark.span_s = remark
                .span_s
                .map(|(from, to)| (from + later_s, to + later_s));
        }
        let message = format!(
            "{} begins {later_s:.3} s after the first log of the flight",
            log.file
        );
        let remark = Remark::new(RemarkKind::Assumed, Some(&log.vehicle), message);
        recording.remarks.push(remark);
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
}
