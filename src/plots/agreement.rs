//! Recorded against predicted, before and after a correction.

use super::receiver::{BEYOND, against, range};
use super::sheet::{HEAD, px, sheet};

const WIDTH: f64 = 900.0;
const PANEL: f64 = 430.0;

/// Words and `(recorded, predicted)` of every sample, first by the simulation, then corrected; `None` without samples.
pub(crate) fn draw(
    title: &str,
    subtitle: &str,
    quantity: &str,
    panels: [(&str, &[(f64, f64)]); 2],
) -> Option<String> {
    let all: Vec<(f64, f64)> = panels
        .iter()
        .flat_map(|(_, pairs)| pairs.iter())
        .copied()
        .collect();
    let ends = range(&all, BEYOND)?;
    Some(sheet((WIDTH, HEAD + PANEL), title, subtitle, |area| {
        let (both, _) = area.split_vertically(px(PANEL));
        let predicted = ["simulated", "corrected"];
        let both = both.split_evenly((1, 2));
        for ((panel, (heading, pairs)), word) in both.iter().zip(panels).zip(predicted) {
            against(panel, (heading, word), pairs, quantity, ends)?;
        }
        Ok(())
    }))
}
