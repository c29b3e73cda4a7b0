//! A mismatch along the coordinates in which it shows most, with the fitted law through it.

use plotters::style::{Color, RGBColor};

use super::axes::{Axis, Sign, Stroke, axes, band, legend, line, mark};
use super::colours::SERIES;
use super::readings::Spread;
use super::sheet::{FAINT, INK, px, sheet};

const WIDTH: f64 = 1080.0;
const HEIGHT: f64 = 470.0;
const LEGEND: f64 = 34.0;
/// What is left after the correction.
const AFTER: usize = 1;
const LAW: RGBColor = INK;

/// One coordinate.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    pub(crate) label: String,
    /// Rising in the coordinate.
    pub(crate) bins: Vec<Bin>,
}

/// Samples that are neighbours in that coordinate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bin {
    pub(crate) x: f64,
    /// Recorded minus simulated.
    pub(crate) before: Spread,
    /// Median of recorded minus corrected.
    pub(crate) after: f64,
    /// Median of corrected minus simulated.
    pub(crate) law: f64,
}

/// `y` says what is drawn, with its unit; without a law only the mismatch is drawn. `None` without curves.
pub(crate) fn draw(
    title: &str,
    subtitle: &str,
    y: &str,
    law: Option<&str>,
    curves: &[Curve],
) -> Option<String> {
    let bins = || curves.iter().flat_map(|curve| &curve.bins);
    let highest = bins()
        .map(|bin| bin.before.high.max(bin.law))
        .fold(0.0, f64::max);
    let lowest = bins()
        .map(|bin| bin.before.low.min(bin.law))
        .fold(0.0, f64::min);
    let margin = 0.05 * (highest - lowest).max(1e-6);
    bins().next()?;
    Some(sheet((WIDTH, HEIGHT), title, subtitle, |area| {
        let (signs, panels) = area.split_vertically(px(LEGEND));
        let mut entries = vec![
            (
                Sign::Mark {
                    series: 0,
                    hollow: false,
                },
                "recorded - simulated: median".to_owned(),
            ),
            (Sign::Patch(SERIES[0].mix(0.16)), "middle 68 %".to_owned()),
        ];
        if let Some(law) = law {
            entries.push((Sign::Line(LAW, Stroke::Solid), law.to_owned()));
            entries.push((
                Sign::Mark {
                    series: AFTER,
                    hollow: true,
                },
                "left after it: median".to_owned(),
            ));
        }
        let mut x = 20.0;
        for (sign, text) in entries {
            let width = 52.0 + text.chars().count() as f64 * 6.2;
            legend(&signs, (x, 10.0), &[(sign, text)])?;
            x += width;
        }
        for (panel, curve) in panels.split_evenly((1, curves.len())).iter().zip(curves) {
            let (Some(first), Some(last)) = (curve.bins.first(), curve.bins.last()) else {
                continue;
            };
            let room = 0.03 * (last.x - first.x).max(1e-6);
            let x = Axis {
                label: &curve.label,
                from: first.x - room,
                to: last.x + room,
            };
            let y = Axis {
                label: y,
                from: lowest - margin,
                to: highest + margin,
            };
            let mut chart = axes(panel, "", x, y)?;
            let zero = [(first.x - room, 0.0), (last.x + room, 0.0)];
            line(&mut chart, &zero, FAINT, 1.4, Stroke::Solid)?;
            let edges: Vec<(f64, f64, f64)> = curve
                .bins
                .iter()
                .map(|bin| (bin.x, bin.before.low, bin.before.high))
                .collect();
            band(&mut chart, &edges, SERIES[0].mix(0.16))?;
            if law.is_some() {
                for bin in &curve.bins {
                    mark(&mut chart, (bin.x, bin.after), AFTER, 2.8, true)?;
                }
                let points: Vec<(f64, f64)> =
                    curve.bins.iter().map(|bin| (bin.x, bin.law)).collect();
                line(&mut chart, &points, LAW, 2.0, Stroke::Solid)?;
            }
            for bin in &curve.bins {
                mark(&mut chart, (bin.x, bin.before.median), 0, 3.4, false)?;
            }
        }
        Ok(())
    }))
}
