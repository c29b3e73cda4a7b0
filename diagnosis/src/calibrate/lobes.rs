//! The near field along the body's y axis: two lobes that come together, the paper's `δ(s)`.

use airflow::FAR_FIELD_FROM_S_OVER_L;
use nalgebra::Vector3;

use super::calibration::{Estimate, Interval, Lobes};
use super::curve::{self, AtReading, Fitted};
use super::intervals::student_quantile;
use super::samples::{Flight, Sample};

/// Readings within this of the body's y axis make its profile, over the motor distance. Chosen here: a third of the distance
/// between axis and rotors.
const BESIDE: f64 = 0.1;
/// Thickness of a slice over the motor distance. Chosen here: the lobes move by a twentieth of l within it.
const SLICE: f64 = 0.25;
/// Readings of one flight in so wide a strip share their errors: about one grid point. Chosen here.
const STRIP: f64 = 0.05;
/// Fewest readings of a slice.
const FEWEST_READINGS: usize = 20;
/// Distance of the rotors along y over the motor distance: they stand on diagonals, `1/(2 √2)`.
const ROTORS: f64 = 0.353_553_390_593_273_8;

/// Lobes of one drone by depth, and between which depths two maxima become one.
pub(super) fn lobes(
    drone: usize,
    flights: &[Flight],
    near: &[Sample],
) -> (Vec<Lobes>, Option<Interval>) {
    let slice = |sample: &Sample| (sample.s / SLICE) as usize;
    let mut samples: Vec<&Sample> = near
        .iter()
        .filter(|sample| flights[sample.flight].drone == drone)
        .filter(|sample| sample.forward.abs() < BESIDE && sample.s < FAR_FIELD_FROM_S_OVER_L)
        .collect();
    samples.sort_by_key(|sample| slice(sample));
    let lobes: Vec<Lobes> = samples
        .chunk_by(|a, b| slice(a) == slice(b))
        .filter_map(|slice| fit(flights, slice))
        .collect();
    let two = |lobes: &Lobes| lobes.delta.value > lobes.width;
    let last = lobes.iter().rposition(two);
    let merged = last.and_then(|last| {
        Some(Interval {
            low: lobes[last].s_over_l,
            high: lobes.get(last + 1)?.s_over_l,
        })
    });
    (lobes, merged)
}

fn fit(flights: &[Flight], samples: &[&Sample]) -> Option<Lobes> {
    let strip = |sample: &Sample| (sample.flight, (sample.left / STRIP).floor() as i64);
    let mut strips: Vec<(usize, i64)> = samples.iter().map(|sample| strip(sample)).collect();
    strips.sort_unstable();
    strips.dedup();
    if samples.len() < FEWEST_READINGS || strips.len() < 6 {
        return None;
    }
    let group = |row: usize| strips.binary_search(&strip(samples[row])).unwrap_or(0);
    let at = |row: usize, x: &Vector3<f64>| {
        let sample = samples[row];
        let operator = &flights[sample.flight].operator;
        let u_h_mps = operator.induced_velocity_mps;
        let (ambient, read) = (operator.ambient_mps / u_h_mps, sample.speed_mps / u_h_mps);
        let [height, delta, width] = (*x).into();
        let lobe = |centre: f64| (-0.5 * ((sample.left - centre) / width).powi(2)).exp();
        let (right, left) = (lobe(delta), lobe(-delta));
        let flow = height * (right + left);
        let reading = flow.hypot(ambient);
        let by_flow = if reading > 0.0 { flow / reading } else { 0.0 };
        let (to_right, to_left) = (sample.left - delta, sample.left + delta);
        let by_delta = height * (right * to_right - left * to_left) / (width * width);
        let by_width =
            height * (right * to_right * to_right + left * to_left * to_left) / width.powi(3);
        AtReading {
            // A twentieth of U_H besides a seventh of the reading: gusts (chosen here, weights only).
            root_weight: (0.05_f64.powi(2) + (0.15 * read).powi(2)).sqrt().recip(),
            residual: read - reading,
            gradient: by_flow * Vector3::new(right + left, by_delta, by_width),
        }
    };
    let best: Fitted<3> = [ROTORS, 0.2, 0.08]
        .into_iter()
        .filter_map(|delta| curve::fit(samples.len(), Vector3::new(1.0, delta, 0.15), at, group))
        .filter(|fitted| fitted.constants[0] > 0.0 && fitted.constants[1].abs() < 2.0)
        .filter(|fitted| fitted.constants[2].abs() > 1e-3)
        .min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let [height, delta, width] = best.constants.into();
    let (delta, width) = (delta.abs(), width.abs());
    let half = best.covariance.map_or(width, |covariance| {
        student_quantile(best.groups as f64 - 3.0) * covariance[(1, 1)].max(0.0).sqrt()
    });
    // With one maximum nothing holds the lobes apart: they may lie on the axis, and no farther out than they are wide.
    let (low, high) = if delta > width {
        (delta - half, delta + half)
    } else {
        (0.0, (delta + half).min(width))
    };
    let at_y = |y: f64| {
        let lobe = |centre: f64| (-0.5 * ((y - centre) / width).powi(2)).exp();
        height * (lobe(delta) + lobe(-delta))
    };
    Some(Lobes {
        s_over_l: samples.iter().map(|sample| sample.s).sum::<f64>() / samples.len() as f64,
        delta: Estimate {
            value: delta,
            interval: Interval { low, high },
        },
        width,
        peak: at_y(delta).max(at_y(0.0)),
        samples: samples.len(),
    })
}
