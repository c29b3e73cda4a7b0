//! Flights of one kind of drone against its normal flights: has a weight or a propeller changed?

use diagnosis::campaign::hardware::{HardwareRow, hardware_rows};
use diagnosis::record::recording::Recording;
use serde_json::json;

use crate::io::answer::{Answer, Format, print};
use crate::io::failure::Failure;
use crate::io::files;
use crate::report::sections::{Part, Report};
use crate::report::words::count;

/// Answers yes: each flight is normal, or has a change with a name.
pub(super) fn run(
    format: Format,
    recordings: &[Recording],
    (normal, drones): (&str, &[String]),
) -> Result<Answer, Failure> {
    let rows = judge(recordings, normal, drones)?;
    print(&match format {
        Format::Json => files::json(&json!({"format": "hardware/1", "flights": rows})),
        Format::Text => report(&rows, recordings.len()).text(),
    })?;
    Ok(Answer::Yes)
}

/// Every flight against the normal ones of its drone.
pub(crate) fn judge(
    recordings: &[Recording],
    normal: &str,
    drones: &[String],
) -> Result<Vec<HardwareRow>, Failure> {
    let names = || recordings.iter().map(|one| &one.name);
    let drone_of = |name: &String| {
        let found = drones.iter().find(|drone| name.contains(drone.as_str()));
        found.map_or("", String::as_str)
    };
    let drone_of: Vec<&str> = names().map(drone_of).collect();
    let is_normal: Vec<bool> = names().map(|name| name.starts_with(normal)).collect();
    let rows = hardware_rows(recordings, &drone_of, &is_normal);
    if rows.is_empty() {
        return Err(Failure::NoHardware(format!(
            "at least two flights of one drone whose names begin with \"{normal}\" are needed, with duty cycles, battery voltage and two seconds of steady hover higher than 0.4 m"
        )));
    }
    Ok(rows)
}

fn report(rows: &[HardwareRow], read: usize) -> Report {
    let row = |row: &HardwareRow| {
        let mut cells = vec![row.flight.clone()];
        let change = |change: f64| format!("{:+.1} %", 100.0 * change);
        cells.extend(row.found.motors.map(change));
        cells.push(format!("{:.4}", row.found.chance));
        cells.push(row.found.to_string());
        cells
    };
    let changed = rows.iter().filter(|row| !row.found.answers.is_empty());
    let without = match read - rows.len() {
        0 => String::new(),
        few => {
            let flights = count(few, "flight", "flights");
            format!("; {flights} without enough steady hover")
        }
    };
    let (changed, all) = (changed.count(), count(rows.len(), "flight", "flights"));
    let mut report = Report::new(
        format!("{changed} of {all} changed{without}"),
        String::new(),
    );
    let headings = "flight | M1 | M2 | M3 | M4 | p-value | what has changed";
    let below = "M1 to M4: voltage of each motor over that of normal flights; p-value: of a normal flight that far out";
    let table = Part::table("lrrrrrl", headings, rows.iter().map(row));
    report.section("", vec![table, Part::line(below)]);
    report
}
