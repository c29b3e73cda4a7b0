//! Piecewise polynomials of `uav_trajectories` and Crazyswarm2: a row a piece, 33 columns.

use planner::plan::cause::as_typed;

use super::{ReadError, Table, table};
use crate::flown::{Flown, Span};

/// Duration and eight coefficients each of x, y, z and yaw.
const COLUMNS: usize = 33;

/// One drone, from time 0 on.
///
/// # Errors
///
/// All that is wrong, each at its line.
pub fn read(text: &str) -> Result<Flown, ReadError> {
    let mut flown = Flown::default();
    let mut now_s = 0.0;
    let Table { rows, mut faults } = table(text, COLUMNS, COLUMNS)?;
    for (line, row) in rows {
        let duration_s = row[0];
        if duration_s <= 0.0 {
            faults.add(line, format!("a piece of {} s", as_typed(duration_s)));
            continue;
        }
        let axis = |k: usize| row[1 + 8 * k..][..8].to_vec();
        let span = Span {
            from_s: now_s,
            until_s: now_s + duration_s,
            axes: [axis(0), axis(1), axis(2)],
        };
        let what = span.fault();
        what.into_iter().for_each(|what| faults.add(line, what));
        flown.spans.push(span);
        now_s += duration_s;
    }
    Ok(faults.or(flown)?)
}
