//! Flights of one kind of drone against its normal flights: has a weight or a propeller changed?

use diagnosis::campaign::hardware::{
    Change, Effort, Hardware, HardwareRow, LEAST_NORMAL, LEAST_P, SessionRow, StatedFlight,
    hardware,
};
use diagnosis::infer::noticed::{RemarkOf, Remarked, noticed};
use diagnosis::record::recording::Recording;

use crate::commands::recordings::{Asked, sentences};
use crate::io::answer::Answer;
use crate::io::failure::Failure;
use crate::report::sections::{Part, Report};
use crate::report::words::{count, joined};

/// Which flights are normal, and how drones and sessions are told apart.
#[derive(Clone, Copy)]
pub(crate) struct Names<'a> {
    /// With what the names of normal flights begin.
    pub(crate) normal: &'a str,
    /// Parts of names, one a drone.
    pub(crate) drones: &'a [String],
    /// Parts of names, one a session.
    pub(crate) sessions: &'a [String],
}

/// Of what is written.
const HARDWARE: (&str, usize, &str) = ("hardware.json", 3, "hardware/1");

/// Answers no where a flight has changed, and what has changed has no name.
pub(super) fn run(
    asked: &Asked,
    name: &str,
    (recordings, mut remarks): (&[Recording], Vec<RemarkOf>),
    names: Names<'_>,
) -> Result<Answer, Failure> {
    let hardware = judge(recordings, names)?;
    remarks.extend(noticed(recordings));
    let mut report = report(&hardware);
    report.section("Remarks", Part::list(sentences(&remarks, HARDWARE.0)));
    let answer = Remarked {
        answer: &hardware,
        remarks: &remarks,
    };
    asked.deliver((name, &report), HARDWARE, &answer, Vec::new())?;
    let mut found = hardware.flights.iter().map(|row| &row.found);
    Ok(Answer::from(
        found.all(|of| !of.change.is_seen() || !of.answers.is_empty()),
    ))
}

/// Every flight against the normal ones of its drone and session.
pub(crate) fn judge(recordings: &[Recording], names: Names<'_>) -> Result<Hardware, Failure> {
    let flights: Vec<StatedFlight<'_>> = recordings
        .iter()
        .map(|one| StatedFlight {
            name: &one.name,
            effort: Effort::of(one),
            drone: part_of(&one.name, names.drones),
            session: part_of(&one.name, names.sessions),
            is_normal: one.name.starts_with(names.normal),
        })
        .collect();
    let hardware = hardware(&flights);
    if hardware.flights.is_empty() {
        return Err(Failure::NoHardware(format!(
            "at least two flights of one drone in one session whose names begin with \"{}\" are needed, with duty cycles, battery voltage and two seconds of steady hover higher than 0.4 m",
            names.normal
        )));
    }
    Ok(hardware)
}

/// The part of a name that tells it from others, of these; empty: none.
fn part_of<'p>(name: &str, parts: &'p [String]) -> &'p str {
    let found = parts.iter().find(|part| name.contains(part.as_str()));
    found.map_or("", String::as_str)
}

/// Changes of the four motors' voltages, in words.
fn motors(change: &Change) -> [String; 4] {
    change.motors.map(|one| format!("{:+.1} %", 100.0 * one))
}

fn report(hardware: &Hardware) -> Report {
    let rows = &hardware.flights;
    let row = |row: &HardwareRow| {
        let mut cells = vec![row.flight.clone()];
        cells.extend(motors(&row.found.change));
        cells.push(row.compared_with.to_string());
        cells.push(format!("{:.4}", row.found.change.p_value));
        cells.push(row.found.to_string());
        cells
    };
    let changed = rows.iter().filter(|row| row.found.change.is_seen());
    let without = [
        (&hardware.without_hover, "enough steady hover"),
        (
            &hardware.without_normal,
            "another normal flight of the same drone and session",
        ),
    ];
    let without = without
        .into_iter()
        .filter(|(flights, _)| !flights.is_empty());
    let without = without.map(|(flights, what)| {
        let flights = count(flights.len(), "flight", "flights");
        format!("; {flights} without {what}")
    });
    let (changed, all) = (changed.count(), count(rows.len(), "flight", "flights"));
    let without: String = without.collect();
    let mut report = Report::new(
        format!("{changed} of {all} changed{without}"),
        String::new(),
    );
    let headings = "flight | M1 | M2 | M3 | M4 | over | p-value | what has changed";
    let below = format!(
        "M1 to M4: voltage of each motor over that of as many normal flights of the same drone and session; p-value: of a normal flight that far out. Below {LEAST_P} a flight counts as changed: one normal flight in {:.0} does.",
        1.0 / LEAST_P
    );
    let table = Part::table("lrrrrrrl", headings, rows.iter().map(row));
    let mut parts = vec![table, Part::Line(below)];
    let few: Vec<String> = (hardware.sessions.iter())
        .filter(|it| it.has_few())
        .map(|it| format!("{} of {}", it.normal_flights, called(it)))
        .collect();
    if !few.is_empty() {
        parts.push(Part::line(format!(
            "Too few normal flights to see small changes: {} ({LEAST_NORMAL} or more of a drone in a session).",
            joined(few, ", ")
        )));
    }
    report.section("", parts);
    let drifts: Vec<Vec<String>> = (hardware.sessions.iter())
        .filter_map(|it| it.drift.as_ref().map(|drift| (it, drift)))
        .map(|(it, drift)| {
            let mut cells = vec![called(it)];
            cells.extend(motors(drift));
            cells.push(it.normal_flights.to_string());
            cells.push(format!("{:.4}", drift.p_value));
            cells.push(
                if drift.is_seen() {
                    "changed"
                } else {
                    "as before"
                }
                .to_owned(),
            );
            cells
        })
        .collect();
    if !drifts.is_empty() {
        let headings =
            "normal flights of | M1 | M2 | M3 | M4 | flights | p-value | since the first session";
        let table = Part::table("lrrrrrrl", headings, drifts);
        report.section("between sessions", vec![table]);
    }
    report
}

/// A drone and a session by the parts of names that tell them apart.
fn called(row: &SessionRow) -> String {
    match (row.drone.as_str(), row.session.as_str()) {
        ("", "") => "the drone".to_owned(),
        (drone, "") => format!("`{drone}`"),
        ("", session) => format!("session `{session}`"),
        (drone, session) => format!("`{drone}` in session `{session}`"),
    }
}
