//! The YAML that the examples of libMultiRobotPlanning read (W. Hönig,
//! github.com/whoenig/libMultiRobotPlanning, `example/cbs.cpp`, `benchmark/`).

use std::fmt::Write as _;

use super::grid::Grid;

/// An instance as one file, name and text, with three numbers for every cell.
///
/// The examples there take the first two numbers of a cell and leave the rest: as they are, they
/// solve the floor seen from above, where a column with anything in it is blocked. To solve the
/// instance itself, a reader has to take the third number of `dimensions`, `obstacles`, `start` and
/// `goal`, and its neighbours have to go up and down as well.
#[must_use]
pub fn lib_multi_robot_planning(grid: &Grid) -> (String, String) {
    // Numbers, and names of letters and digits: nothing here wants quotes.
    let cell = |[x, y, z]: [usize; 3]| format!("[{x}, {y}, {z}]");
    let mut text = "agents:".to_owned();
    if grid.agents().is_empty() {
        text += " []";
    }
    text.push('\n');
    for agent in grid.agents() {
        let (start, goal) = (cell(agent.start), cell(agent.goal));
        let name = &agent.name;
        let _ = writeln!(text, "- name: {name}\n  start: {start}\n  goal: {goal}");
    }
    let size = cell(grid.size());
    let _ = writeln!(text, "map:\n  dimensions: {size}");
    let mut blocked = grid.blocked().peekable();
    let none = if blocked.peek().is_none() { " []" } else { "" };
    let _ = writeln!(text, "  obstacles:{none}");
    for at in blocked {
        let _ = writeln!(text, "  - {}", cell(at));
    }
    (format!("{}.yaml", grid.name()), text)
}
