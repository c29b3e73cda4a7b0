//! The scaling table in Markdown, and the sentences below it.

use super::growth::{FEWEST_ROWS, Growth, Line, growth};
use super::instance::Figures;
use super::machine::Machine;
use super::row::Row;
use crate::table::{Table, cell, count, joined};

/// Growth is stated for so many drones: a number that one can picture.
const PER_DRONES: f64 = 100.0;

/// The command, the machine, the table, and how each place's cost grows; `instances` of every size.
#[must_use]
pub fn text(command: &str, machine: &Machine, rows: &[Row], instances: usize) -> String {
    let mut text = format!("`{command}`\n\n{machine}.\n\n{}", table(rows).markdown());
    text += &format!(
        "\nMedians of {}. Planning: endpoints, roadmap and search, without reading the scenario. Suboptimality: sum of costs over its lower bound, the individual lower bounds (every drone with no other there, on the same roadmap) added up. \
         Memory: the highest of the process until the plan is verified, each instance in a process of its own.\n\n",
        count(instances, "instance", "instances")
    );
    text + &growth(rows).iter().map(sentence).collect::<String>()
}

fn table(rows: &[Row]) -> Table {
    let headings = "place | drones | of the open columns | motion, wakes | planned and verified | planning (s) | verification (s) | searches | evictions | PIBT rounds | suboptimality | extra energy (J) | of hovering | over the limit if downwash is ignored | peak memory (MiB)";
    Table::new("lrrllrrrrrrrrrr", headings, rows.iter().map(cells))
}

fn cells(row: &Row) -> Vec<String> {
    let time = |value: Option<f64>| match value {
        Some(10.0..) => cell(value, 1),
        _ => cell(value, 3),
    };
    let number = |of: fn(&Figures) -> u64| cell(row.median(|run| Some(of(run) as f64)), 0);
    let percent = row.median(|run| ratio(100.0 * run.extra_energy_j, run.hover_energy_j));
    let over = |run: &Figures| run.over_limit_ignoring_downwash.map(|over| over as f64);
    vec![
        row.place.name().to_owned(),
        row.drones.to_string(),
        format!("{:.1} %", 100.0 * row.density()),
        row.rules(),
        row.answer(),
        time(row.planning_time_s()),
        time(row.median(|run| Some(run.verification_time_s))),
        number(|run| run.searches),
        number(|run| run.evictions),
        number(|run| run.steps_together),
        cell(
            row.median(|run| ratio(run.sum_of_arrivals_s, run.sum_alone_s)),
            4,
        ),
        cell(row.median(|run| Some(run.extra_energy_j)), 0),
        percent.map_or("-".to_owned(), |percent| format!("+{percent:.2} %")),
        cell(row.median(over), 0),
        cell(row.peak_memory_mib(), 0),
    ]
}

fn ratio(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}

/// How one place's cost grows, or why that is not known.
fn sentence(grown: &Growth) -> String {
    let sizes = grown.fitted_drones.len();
    let mut said = format!("Growth in the {}", grown.place.name());
    if !grown.left_out_drones.is_empty() {
        said += &format!(
            ", without N = {} (not all planned by the same rules, verified and run to the end)",
            joined(&grown.left_out_drones, ",")
        );
    }
    if sizes < FEWEST_ROWS {
        let are = if sizes == 1 { "is" } else { "are" };
        return said
            + &format!(": not fitted, {FEWEST_ROWS} rows are needed and there {are} {sizes}.\n");
    }
    let known = |line: Option<&Line>, law: &dyn Fn(&Line) -> String| match line {
        Some(line) => format!(
            "{} (standard error; R² {:.3}, {sizes} rows)",
            law(line),
            line.r_squared
        ),
        None => "not fitted".to_owned(),
    };
    let time = known(grown.log_planning_time.as_ref(), &|line| {
        let at_s = (line.intercept + line.slope * PER_DRONES.ln()).exp();
        let (power, error) = (line.slope, line.slope_error);
        format!("{at_s:.3} s · (N / {PER_DRONES})^p, p = {power:.2} ± {error:.2}")
    });
    let memory = known(grown.memory_mib.as_ref(), &|line| {
        let [slope, error] = [line.slope, line.slope_error].map(|each| PER_DRONES * each);
        let base = line.intercept;
        format!("{base:.1} MiB + ({slope:.2} ± {error:.2}) MiB · N / {PER_DRONES}")
    });
    said + &format!(": planning time {time}; memory {memory}.\n")
}
