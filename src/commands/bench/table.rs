//! The scaling table in Markdown, and the sentences below it.

use super::fit::{FEWEST_ROWS, Growth, Line, growth};
use super::listed;
use super::machine::Machine;
use super::row::Row;
use crate::report::words::count;

/// Growth is stated for so many drones: a number that one can picture.
const PER_DRONES: f64 = 100.0;

pub(super) fn text(command: &str, machine: &Machine, rows: &[Row], instances: usize) -> String {
    let mut text = format!("`{command}`\n\n{machine}.\n\n");
    text += "| place | drones | of the open columns | planned and verified | planning (s) | verification (s) | searches | evictions | steps together | arrivals / alone | extra energy (J) | of hovering | over the limit if downwash is ignored | peak memory (MiB) |\n";
    text += "| --- | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n";
    for row in rows {
        text += &line(row);
    }
    text += &format!(
        "\nMedians of {}. Planning: endpoints, roadmap and search, without reading the scenario; memory: the highest of the process until the plan is verified, each instance in a process of its own.\n\n",
        count(instances, "instance", "instances")
    );
    for grown in growth(rows) {
        text += &sentence(&grown);
    }
    text
}

fn line(row: &Row) -> String {
    let shown = |value: Option<f64>, digits: usize| {
        value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
    };
    let time = |value: Option<f64>| match value {
        Some(long_s) if long_s >= 10.0 => shown(value, 1),
        _ => shown(value, 3),
    };
    let cells = [
        row.place.word().to_owned(),
        row.drones.to_string(),
        format!("{:.1} %", 100.0 * row.density()),
        row.answer(),
        time(row.planning_time_s()),
        time(row.median(|run| Some(run.verification_time_s))),
        shown(row.median(|run| Some(run.searches as f64)), 0),
        shown(row.median(|run| Some(run.evictions as f64)), 0),
        shown(row.median(|run| Some(run.steps_together as f64)), 0),
        shown(
            row.median(|run| ratio(run.sum_of_arrivals_s, run.sum_alone_s)),
            4,
        ),
        shown(row.median(|run| Some(run.extra_energy_j)), 0),
        match row.median(|run| ratio(100.0 * run.extra_energy_j, run.hover_energy_j)) {
            Some(percent) => format!("+{percent:.2} %"),
            None => "-".to_owned(),
        },
        shown(
            row.median(|run| run.over_limit_ignoring_downwash.map(|over| over as f64)),
            0,
        ),
        shown(row.peak_memory_mib(), 0),
    ];
    format!("| {} |\n", cells.join(" | "))
}

fn ratio(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}

/// How one place's cost grows, or why that is not known.
fn sentence(grown: &Growth) -> String {
    let Growth {
        place,
        fitted_drones,
        left_out_drones,
        log_planning_time,
        memory_mib,
    } = grown;
    let mut said = format!("Growth in the {}", place.word());
    if !left_out_drones.is_empty() {
        said += &format!(
            ", without N = {} (not all planned, verified and run to the end)",
            listed(left_out_drones)
        );
    }
    if fitted_drones.len() < FEWEST_ROWS {
        return said
            + &format!(
                ": not fitted, {FEWEST_ROWS} rows are needed and there {}.\n",
                match fitted_drones.len() {
                    1 => "is 1".to_owned(),
                    rows => format!("are {rows}"),
                }
            );
    }
    let quality = |line: &Line| {
        format!(
            "(standard error; R² {:.3}, {} rows)",
            line.r_squared,
            fitted_drones.len()
        )
    };
    let unknown = "not fitted".to_owned();
    let time = log_planning_time.as_ref().map_or(unknown.clone(), |line| {
        let at_s = (line.intercept + line.slope * PER_DRONES.ln()).exp();
        format!(
            "{at_s:.3} s · (N / {PER_DRONES})^p, p = {:.2} ± {:.2} {}",
            line.slope,
            line.slope_error,
            quality(line)
        )
    });
    let memory = memory_mib.as_ref().map_or(unknown, |line| {
        format!(
            "{:.1} MiB + ({:.2} ± {:.2}) MiB · N / {PER_DRONES} {}",
            line.intercept,
            PER_DRONES * line.slope,
            PER_DRONES * line.slope_error,
            quality(line)
        )
    });
    said + &format!(": planning time {time}; memory {memory}.\n")
}
