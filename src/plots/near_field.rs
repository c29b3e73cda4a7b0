//! Where the jets of the rotors are on their way to the axis: the distance of the maxima from it, against depth.

use airflow::FAR_FIELD_FROM_S_OVER_L;

use super::axes::{Axis, Sign, Stroke, axes, bar, legend, line, mark};
use super::colours::SERIES;
use super::sheet::{INK, SOFT, px, sheet};

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 440.0;
const SIDE: f64 = 250.0;

/// Maxima of one drone at one depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lobe {
    /// Which of the drones.
    pub(crate) drone: usize,
    pub(crate) s_over_l: f64,
    /// Distance of the maxima from the axis over the motor distance.
    pub(crate) delta_over_l: f64,
    /// Its interval, where it is known.
    pub(crate) interval: Option<(f64, f64)>,
}

/// `drones`: names, hollow where they are beside the fit; `None` without lobes.
pub(crate) fn draw(
    title: &str,
    subtitle: &str,
    drones: &[(String, bool)],
    lobes: &[Lobe],
) -> Option<String> {
    let widest = lobes
        .iter()
        .map(|lobe| lobe.interval.map_or(lobe.delta_over_l, |(_, high)| high))
        .reduce(f64::max)?;
    let deepest = lobes
        .iter()
        .map(|lobe| lobe.s_over_l)
        .fold(FAR_FIELD_FROM_S_OVER_L, f64::max);
    Some(sheet((WIDTH, HEIGHT), title, subtitle, |area| {
        let (panel, side) = area.split_horizontally(px(WIDTH - SIDE));
        let top = widest.clamp(0.5, 1.0) * 1.08;
        let x = Axis {
            label: "depth below the rotor plane s / l",
            from: 0.0,
            to: deepest * 1.05,
        };
        let y = Axis {
            label: "distance of the maxima from the axis delta / l",
            from: 0.0,
            to: top,
        };
        let mut chart = axes(&panel, "", x, y)?;
        // Where a rotor's hub stands, seen along an axis of the body: l/(2 √2) from the centre.
        let hub = 0.5 * std::f64::consts::FRAC_1_SQRT_2;
        line(
            &mut chart,
            &[(0.0, hub), (deepest * 1.05, hub)],
            SOFT,
            0.9,
            Stroke::Dashed,
        )?;
        for merged in [1.5, FAR_FIELD_FROM_S_OVER_L] {
            line(
                &mut chart,
                &[(merged, 0.0), (merged, top)],
                INK,
                0.9,
                Stroke::Solid,
            )?;
        }
        for lobe in lobes {
            if let Some((low, high)) = lobe.interval {
                let colour = SERIES[lobe.drone % SERIES.len()];
                bar(
                    &mut chart,
                    lobe.s_over_l,
                    (low.max(0.0), high.min(top)),
                    colour,
                )?;
            }
            let hollow = drones.get(lobe.drone).is_some_and(|(_, hollow)| *hollow);
            let at = (lobe.s_over_l, lobe.delta_over_l.clamp(0.0, top));
            mark(&mut chart, at, lobe.drone, 3.6, hollow)?;
        }
        let mut entries: Vec<(Sign, String)> = drones
            .iter()
            .enumerate()
            .filter(|(series, _)| lobes.iter().any(|lobe| lobe.drone == *series))
            .map(|(series, (name, hollow))| {
                (
                    Sign::Mark {
                        series,
                        hollow: *hollow,
                    },
                    name.clone(),
                )
            })
            .collect();
        entries.push((
            Sign::Line(SOFT, Stroke::Dashed),
            "rotor hub, along x or y".into(),
        ));
        entries.push((
            Sign::Line(INK, Stroke::Solid),
            "1.5 l and 2.5 l: where the".into(),
        ));
        entries.push((Sign::Nothing, "        paper sees the jets merge".into()));
        legend(&side, (12.0, 24.0), &entries)
    }))
}
