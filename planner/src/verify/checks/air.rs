//! The downwash that one drone is exposed to: its worst, its exposure and energy, and when it
//! exceeds the limit.
//!
//! ```text
//! exposure = ∫ U_D dt            energy = ∫ (β(α) - 1) m g U_H dt,   α = gain U_D / U_H
//! ```
//!
//! over its airborne flight, by Gauss-Kronrod quadrature; the worst and the spans over the limit by
//! subdivision on bounds, the rest after the plan included.

use airflow::power;
use serde::Serialize;

use super::shifted_air::Bounded;
use super::{column, shifted_air};
use crate::plan::ViolationKind;
use crate::verify::extents::Span;
use crate::verify::scene::{Flight, Scene};
use crate::verify::time::encounters::Encounter;
use crate::verify::time::spans::{Known, integrate, join};
use crate::verify::time::subdivision::{Chord, above, maximise};
use crate::verify::time::window::{Window, windows};
use crate::verify::violation::{IndexedViolation, Worst};

/// How far the mean may exceed the limit, over U_H: chosen here, a three-hundredth of the default
/// limit.
pub(crate) const ALPHA_TOLERANCE: f64 = 1e-3;

/// Errors allowed in the highest air, as a part of it and over U_H: chosen here, below what is
/// printed.
const WORST_TOLERANCE: f64 = 1e-3;
const WORST_FLOOR: f64 = 1e-4;
/// Error allowed in the mean over a part of the flight, over U_H: chosen here, 0.005 % of extra
/// energy.
pub(crate) const DOSE_FLOOR: f64 = 1e-4;

/// The downwash that one drone is exposed to while it is airborne.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DroneExposure {
    /// Highest mean axial speed over its rotor discs (m/s), to 0.1 %; with advected wakes the
    /// highest at any lag, to 2 % and 0.002 of the induced velocity. Its rest after the plan
    /// included.
    pub worst_air_mps: f64,
    /// The drone whose wake contributed most to that.
    pub worst_air_from: Option<String>,
    /// When (s).
    pub worst_air_at_s: Option<f64>,
    /// Axial exposure: integral of the mean axial speed over its flight (m); with
    /// advected wakes that of the mean flow.
    pub dose_m: f64,
    /// Integral of (β − 1) m g U_H over its flight (J).
    pub extra_energy_j: f64,
    /// The same over the integral of m g U_H (%).
    pub extra_energy_percent: f64,
}

/// A moment of the flight: window, time, value.
#[derive(Clone, Copy)]
struct WindowMoment {
    /// Index in the windows.
    window: usize,
    t_s: f64,
    /// Mean air over the receiver's discs (m/s).
    mean_mps: f64,
}

/// What a flight breaks: as [`check`], without exposures not needed for it.
pub(crate) fn violations(
    scene: &Scene<'_>,
    (near, slices): (&[Encounter], &[Bounded<'_>]),
    receiver: &Flight,
) -> Vec<IndexedViolation> {
    if receiver.airborne_s.1 <= receiver.airborne_s.0 {
        return Vec::new();
    }
    match scene.lags().1 > 0.0 {
        true => column::check(scene, receiver, &windows(scene, near, receiver)),
        false => check(scene, (near, slices), receiver).0,
    }
}

/// The exposure of a flight.
pub(crate) fn exposure(scene: &Scene<'_>, near: &[Encounter], receiver: &Flight) -> DroneExposure {
    let slices = shifted_air::bounded(scene, near, receiver);
    check(scene, (near, &slices), receiver).1
}

/// Judges the air of a flight, and its stays in columns.
pub(crate) fn check(
    scene: &Scene<'_>,
    (near, slices): (&[Encounter], &[Bounded<'_>]),
    receiver: &Flight,
) -> (Vec<IndexedViolation>, DroneExposure) {
    if receiver.airborne_s.1 <= receiver.airborne_s.0 {
        return (Vec::new(), DroneExposure::default());
    }
    let windows = windows(scene, near, receiver);
    let mut met = DroneExposure::default();
    let mut seed: Option<WindowMoment> = None;
    let mut own_energy_j = 0.0;
    for (index, window) in windows.iter().enumerate() {
        if window.span_s.1 > receiver.flight_end_s() {
            continue;
        }
        let u_h_mps = window.induced_velocity_mps;
        own_energy_j +=
            window.mass_kg * airflow::GRAVITY_MPS2 * u_h_mps * (window.span_s.1 - window.span_s.0);
        if window.is_calm() {
            continue;
        }
        let values = |t_s: f64| {
            let mean_mps = window.mean_mps(t_s);
            if seed.is_none_or(|known| mean_mps > known.mean_mps) {
                seed = Some(WindowMoment {
                    window: index,
                    t_s,
                    mean_mps,
                });
            }
            let alpha = scene.flown.receiver_gain * mean_mps / u_h_mps;
            let extra_w = power::extra_power_w(window.mass_kg, u_h_mps, alpha);
            [mean_mps, extra_w]
        };
        let mut known = Known {
            floor: DOSE_FLOOR * u_h_mps,
            highest: window.most_mps(),
            widths: |span_s| window.widths(span_s),
            values,
        };
        let sums = integrate(window.span_s, &mut known);
        met.dose_m += sums[0];
        met.extra_energy_j += sums[1];
    }
    if own_energy_j > 0.0 {
        met.extra_energy_percent = 100.0 * met.extra_energy_j / own_energy_j;
    }
    let columns = column::check(scene, receiver, &windows);
    let everything_s = (f64::NEG_INFINITY, f64::INFINITY);
    if scene.lags().1 > 0.0 {
        // The limit is judged with the margins: see `shifted_air`.
        let known_mps = seed.map_or(0.0, |it| it.mean_mps);
        let late = shifted_air::highest(slices, everything_s, known_mps);
        let known = seed.filter(|it| it.mean_mps > 0.0);
        (met.worst_air_mps, met.worst_air_at_s, met.worst_air_from) = match (late, known) {
            (Some(it), _) => {
                let from = scene.flights[it.strongest.0].name.clone();
                (it.mean_mps, Some(it.t_s), Some(from))
            }
            (None, Some(it)) => {
                let from = strongest(scene, &windows, it);
                (it.mean_mps, Some(it.t_s), from)
            }
            (None, None) => (0.0, None, None),
        };
        return (columns, met);
    }
    let worst = highest(&windows, seed, everything_s).filter(|worst| worst.mean_mps > 0.0);
    if let Some(worst) = worst {
        met.worst_air_mps = worst.mean_mps;
        met.worst_air_at_s = Some(worst.t_s);
        met.worst_air_from = strongest(scene, &windows, worst);
    }
    let mut found = over_limit(scene, (receiver, &windows), worst, met.worst_air_mps);
    found.extend(columns);
    (found, met)
}

/// Whether a drone exceeds its limit or enters a column at any time, and the highest mean air over
/// its discs (m/s) where that is higher than `known_mps`, or else that. No more than these two: it
/// stops at the first moment over the limit.
pub(crate) fn exceeds(
    scene: &Scene<'_>,
    near: &[Encounter],
    receiver: &Flight,
    known_mps: f64,
) -> (bool, f64) {
    if receiver.airborne_s.1 <= receiver.airborne_s.0 {
        return (false, known_mps);
    }
    let windows = windows(scene, near, receiver);
    let everything_s = (f64::NEG_INFINITY, f64::INFINITY);
    if scene.lags().1 > 0.0 {
        let is_over = shifted_air::exceeds(scene, near, receiver)
            || !column::check(scene, receiver, &windows).is_empty();
        let slices = shifted_air::bounded(scene, near, receiver);
        let late = shifted_air::highest(&slices, everything_s, known_mps);
        return (is_over, late.map_or(known_mps, |it| it.mean_mps));
    }
    let (mut is_over, mut highest_mps) = (false, known_mps);
    for (most_mps, index) in by_most(&windows, everything_s) {
        let window = &windows[index];
        let limit_mps = limit_mps(scene, receiver, window);
        let matters = !is_over && most_mps > limit_mps;
        if matters || most_mps > highest_mps {
            let middle_s = 0.5 * (window.span_s.0 + window.span_s.1);
            let middle_mps = window.mean_mps(middle_s);
            highest_mps = highest_mps.max(middle_mps);
            is_over |= middle_mps > limit_mps;
        }
        if !is_over && most_mps > limit_mps {
            let mut parts = Vec::new();
            above(window, Chord::of(window), limit_mps, &mut parts);
            is_over = !parts.is_empty();
        }
    }
    let seed = WindowMoment {
        window: 0,
        t_s: 0.0,
        mean_mps: highest_mps,
    };
    let worst = highest(&windows, Some(seed), everything_s);
    let is_over = is_over || !column::check(scene, receiver, &windows).is_empty();
    (is_over, worst.map_or(highest_mps, |worst| worst.mean_mps))
}

/// Mean air over its discs above which a drone is over its limit in a window (m/s).
fn limit_mps(scene: &Scene<'_>, receiver: &Flight, window: &Window<'_>) -> f64 {
    let most = receiver.air_limit + ALPHA_TOLERANCE;
    scene.flown.mean_mps(most, window.induced_velocity_mps)
}

/// The windows with a wake in them, cut to a span: an upper bound of the air (m/s), and the index;
/// highest bound first, for it often settles the rest.
fn by_most(windows: &[Window<'_>], within_s: Span) -> Vec<(f64, usize)> {
    let all = windows.iter().enumerate().filter(|(_, window)| {
        let (from_s, until_s) = window.span_s;
        !window.is_calm() && from_s.max(within_s.0) < until_s.min(within_s.1)
    });
    let mut by_most: Vec<(f64, usize)> = all
        .map(|(index, window)| (window.most_mps(), index))
        .collect();
    by_most.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    by_most
}

/// Mean air over the discs of a flight (by its place in the plan) at a time (m/s), and the emitter
/// with the strongest wake; `None` where it is not airborne. `near` are the encounters of all.
pub(crate) fn at(
    scene: &Scene<'_>,
    near: &[Vec<Encounter>],
    index: usize,
    t_s: f64,
) -> Option<(f64, Option<String>)> {
    let k = scene.flights.iter().position(|it| it.index == index)?;
    let then = near[k].iter().copied();
    let then: Vec<Encounter> =
        (then.filter(|it| it.span_s.0 <= t_s && t_s <= it.span_s.1)).collect();
    if scene.lags().1 > 0.0 {
        let slices = shifted_air::bounded(scene, &then, &scene.flights[k]);
        let late = shifted_air::highest(&slices, (t_s, t_s), 0.0)?;
        let from = scene.flights[late.strongest.0].name.clone();
        return Some((late.mean_mps, Some(from)));
    }
    let windows = windows(scene, &then, &scene.flights[k]);
    let holds = |window: &&Window<'_>| window.span_s.0 <= t_s && t_s <= window.span_s.1;
    let airs = windows.iter().filter(holds).map(|window| {
        let from = window.strongest(t_s);
        let name = from.map(|from| scene.flights[from].name.clone());
        (window.mean_mps(t_s), name)
    });
    airs.max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The emitter with the strongest wake at a moment.
fn strongest(scene: &Scene<'_>, windows: &[Window<'_>], at: WindowMoment) -> Option<String> {
    let from = windows[at.window].strongest(at.t_s)?;
    Some(scene.flights[from].name.clone())
}

/// The highest mean air over the windows, as far as they lie within a span, from what is known
/// already.
fn highest(
    windows: &[Window<'_>],
    seed: Option<WindowMoment>,
    within_s: Span,
) -> Option<WindowMoment> {
    let mut best = seed;
    for (most_mps, index) in by_most(windows, within_s) {
        let window = &windows[index];
        let floor_mps = WORST_FLOOR * window.induced_velocity_mps;
        let before_mps = best.map_or(0.0, |known| known.mean_mps);
        let tolerance = |mean_mps| WORST_TOLERANCE * mean_mps + floor_mps;
        if most_mps <= before_mps + tolerance(before_mps) {
            continue;
        }
        let (from_s, until_s) = window.span_s;
        let span_s = (from_s.max(within_s.0), until_s.min(within_s.1));
        let mut here = (span_s.0, before_mps);
        let chord = Chord {
            span_s,
            ends_mps: None,
        };
        maximise(window, chord, &mut here, &tolerance);
        if here.1 > before_mps {
            best = Some(WindowMoment {
                window: index,
                t_s: here.0,
                mean_mps: here.1,
            });
        }
    }
    best
}

/// The spans over the drone's limit, each with its worst moment; that of the whole flight is known.
fn over_limit(
    scene: &Scene<'_>,
    (receiver, windows): (&Flight, &[Window<'_>]),
    worst: Option<WindowMoment>,
    worst_air_mps: f64,
) -> Vec<IndexedViolation> {
    let flown = &scene.flown;
    let mut parts = Vec::new();
    for window in windows.iter().filter(|window| !window.is_calm()) {
        let u_h_mps = window.induced_velocity_mps;
        let limit_mps = limit_mps(scene, receiver, window);
        let worst_mps = worst_air_mps * (1.0 + WORST_TOLERANCE) + WORST_FLOOR * u_h_mps;
        if worst_mps > limit_mps && window.most_mps() > limit_mps {
            let mut here = Vec::new();
            above(window, Chord::of(window), limit_mps, &mut here);
            here.into_iter().for_each(|span_s| join(&mut parts, span_s));
        }
    }
    let mut found = Vec::new();
    for span_s in parts {
        let known = worst.filter(|it| span_s.0 <= it.t_s && it.t_s <= span_s.1);
        let Some(at) = known.or_else(|| highest(windows, None, span_s)) else {
            continue;
        };
        let window = &windows[at.window];
        let worst = Worst {
            with: strongest(scene, windows, at),
            position_m: window.place_m(at.t_s),
            value: flown.alpha(at.mean_mps, window.induced_velocity_mps),
            limit: receiver.air_limit,
        };
        found.push(scene.violation(receiver, ViolationKind::Air, span_s, worst));
    }
    found
}
