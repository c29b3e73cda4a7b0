//! The air that one drone meets: its worst, its dose and energy, and when it exceeds the limit.

use airflow::power;

use super::clock::{Span, above, integrate, join, maximise};
use super::flight::{Flight, Scene};
use super::nearby::Near;
use super::window::{Window, windows};
use super::{AirMet, Found, column};
use crate::plan::{Violation, ViolationKind};

/// How far the mean may exceed the limit, over U_H: chosen here, a three-hundredth of the default limit.
pub(crate) const ALPHA_TOLERANCE: f64 = 1e-3;

/// Errors allowed in the highest air, as a part of it and over U_H.
const WORST_TOLERANCE: f64 = 1e-3;
const WORST_FLOOR: f64 = 1e-4;
/// Error allowed in the mean over a part of the flight, over U_H: 0.005 % of extra energy.
const DOSE_FLOOR: f64 = 1e-4;

/// A moment of the flight: window, time, value.
#[derive(Clone, Copy)]
struct Moment {
    window: usize,
    t_s: f64,
    value: f64,
}

/// Judges the air of flight `k` and its stays in columns.
pub(super) fn judge(scene: &Scene<'_>, near: &[Near], k: usize) -> (Vec<Found>, AirMet) {
    let receiver = &scene.flights[k];
    if receiver.airborne_s.1 <= receiver.airborne_s.0 {
        return (Vec::new(), AirMet::default());
    }
    let windows = windows(scene, near, receiver);
    let mut met = AirMet::default();
    let mut seed: Option<Moment> = None;
    let mut own_energy_j = 0.0;
    for (index, window) in windows.iter().enumerate() {
        if window.until_s > receiver.flight_end_s() {
            continue;
        }
        let u_h_mps = window.induced_velocity_mps;
        own_energy_j +=
            window.mass_kg * airflow::GRAVITY_MPS2 * u_h_mps * (window.until_s - window.from_s);
        if window.is_calm() {
            continue;
        }
        let mut sources = Vec::new();
        let mut value = |t_s: f64| {
            let mean_mps = window.mean_mps(t_s, &mut sources);
            if seed.is_none_or(|known| mean_mps > known.value) {
                seed = Some(Moment {
                    window: index,
                    t_s,
                    value: mean_mps,
                });
            }
            [
                mean_mps,
                power::extra_power_w(
                    window.mass_kg,
                    u_h_mps,
                    scene.receiver_gain * mean_mps / u_h_mps,
                ),
            ]
        };
        let span_s = (window.from_s, window.until_s);
        let sums = integrate(span_s, DOSE_FLOOR * u_h_mps, &mut value, &|a, b| {
            window.is_smooth(a, b)
        });
        met.dose_m += sums[0];
        met.extra_energy_j += sums[1];
    }
    if own_energy_j > 0.0 {
        met.extra_energy_percent = 100.0 * met.extra_energy_j / own_energy_j;
    }

    let worst = highest(&windows, seed, None);
    if let Some(worst) = worst.filter(|worst| worst.value > 0.0) {
        met.worst_air_mps = worst.value;
        met.worst_air_at_s = Some(worst.t_s);
        met.worst_air_from = windows[worst.window]
            .strongest(worst.t_s)
            .map(|other| scene.flights[other].name.clone());
    }
    let mut found = over_limit(scene, receiver, &windows, &mut met);
    found.extend(column::check(scene, receiver, &windows));
    (found, met)
}

/// The highest mean air (m/s) over the windows, or over the part of them within a span.
fn highest(
    windows: &[Window<'_>],
    seed: Option<Moment>,
    within: Option<(f64, f64)>,
) -> Option<Moment> {
    let mut best = seed;
    for (index, window) in windows.iter().enumerate() {
        let within_s = within.unwrap_or((window.from_s, window.until_s));
        let span_s = (
            window.from_s.max(within_s.0),
            window.until_s.min(within_s.1),
        );
        if window.is_calm() || span_s.0 >= span_s.1 {
            continue;
        }
        let floor_mps = WORST_FLOOR * window.induced_velocity_mps;
        let mut sources = Vec::new();
        let mut here = (span_s.0, best.map_or(0.0, |known| known.value));
        let before = here.1;
        let mut air = match within {
            Some(_) => window.mean_by_chords(&mut sources),
            None => window.mean(&mut sources),
        };
        maximise(Span::new(span_s), &mut here, &mut air, &|value| {
            WORST_TOLERANCE * value + floor_mps
        });
        if here.1 > before {
            best = Some(Moment {
                window: index,
                t_s: here.0,
                value: here.1,
            });
        }
    }
    best
}

/// The spans over the drone's limit, each with its worst moment; adds up the time in `met`.
fn over_limit(
    scene: &Scene<'_>,
    receiver: &Flight,
    windows: &[Window<'_>],
    met: &mut AirMet,
) -> Vec<Found> {
    let mut parts = Vec::new();
    for window in windows.iter().filter(|window| !window.is_calm()) {
        let measure_mps = window.induced_velocity_mps / scene.receiver_gain;
        let limit_mps = (receiver.air_limit + ALPHA_TOLERANCE) * measure_mps - scene.draught_mps;
        if met.worst_air_mps * (1.0 + WORST_TOLERANCE) + WORST_FLOOR * window.induced_velocity_mps
            <= limit_mps
        {
            continue;
        }
        let mut sources = Vec::new();
        let mut here = Vec::new();
        above(
            Span::new((window.from_s, window.until_s)),
            limit_mps,
            &mut window.mean_by_chords(&mut sources),
            &mut here,
        );
        for span_s in here {
            join(&mut parts, span_s);
        }
    }
    let mut found = Vec::new();
    for span_s in parts {
        met.time_over_limit_s += (span_s.1.min(scene.last_s) - span_s.0).max(0.0);
        let Some(worst) = highest(windows, None, Some(span_s)) else {
            continue;
        };
        let window = &windows[worst.window];
        found.push((
            receiver.index,
            Violation {
                kind: ViolationKind::Air,
                drone: receiver.name.clone(),
                with: window
                    .strongest(worst.t_s)
                    .map(|other| scene.flights[other].name.clone()),
                from_s: span_s.0,
                until_s: scene.until(span_s.1),
                position_m: window.place_m(worst.t_s),
                value: (worst.value + scene.draught_mps) * scene.receiver_gain
                    / window.induced_velocity_mps,
                limit: receiver.air_limit,
                unit: "U_D/U_H".to_owned(),
            },
        ));
    }
    found
}
