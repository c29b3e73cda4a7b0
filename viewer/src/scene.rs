//! What plan.html shows, as data: trajectories in whole tenths of millimetres and milliseconds, the
//! air in 255 steps. plan.json keeps the exact values.

use std::collections::BTreeMap;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use flight::FlightReport;
use flight::report::Paths;
use planner::plan::{Bounds, Margins, Obstacle, Plan, Sample, Status, Zone};
use serde::Serialize;

use crate::air::AirOfPlan;
use crate::waits::Waits;

/// Levels of a wake's far field: chosen here, it is drawn straight between them.
const LEVELS: [usize; 2] = [10, 4];
/// Fleets with more drones are drawn with fewer levels: chosen here.
const FINE_UP_TO: usize = 150;
/// Violations that the page lists at most: chosen here.
const MOST_VIOLATIONS: usize = 50;
/// In one unit of the page (m, s): a tenth of a millimetre and of a millisecond.
const UNIT: f64 = 1e-4;

/// The contents of the page.
#[derive(Serialize)]
pub(crate) struct PageData<'a> {
    scenario: &'a str,
    status: Status,
    bounds_m: &'a Bounds,
    obstacles: &'a [Obstacle],
    zones: &'a [Zone],
    margins: Margins,
    clearance_m: f64,
    /// Speed of the air over the centreline's; `null`: wakes follow without delay.
    convection: Option<f64>,
    end_s: f64,
    /// Between two samples of the air.
    step_s: f64,
    /// The air that 255 stands for (m/s).
    max_air_mps: f64,
    /// The first of them.
    violations: Vec<String>,
    /// How many there are in all.
    pub(crate) violation_count: usize,
    /// Each wake: levels of depth, radius, aside in x and y (m), delay (s).
    wakes: Vec<Vec<[f32; 5]>>,
    drones: Vec<Drone<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    flight: Option<&'a FlightReport>,
    /// Where drones flew in each flight.
    #[serde(skip_serializing_if = "Option::is_none")]
    flown: Option<FlownPlaces>,
}

/// Where drones flew.
#[derive(Serialize)]
struct FlownPlaces {
    from_s: f64,
    step_s: f64,
    /// Of each flight by the drones' indices, how far from where the plan has them: whole
    /// millimetres along x, y and z, 16 bits each, low byte first, as base64. The lowest number: it
    /// does not fly.
    flights: Vec<BTreeMap<usize, String>>,
}

impl FlownPlaces {
    fn of(paths: &Paths) -> FlownPlaces {
        // Farther than 32 m it is shown at 32 m.
        let whole_mm = |it: f32| (it * 1e3).round().clamp(-32_767.0, 32_767.0) as i16;
        let bytes = |path: &[Option<[f32; 3]>]| {
            let off_mm = path.iter().map(|it| match it {
                Some(off_m) => off_m.map(whole_mm),
                None => [i16::MIN; 3],
            });
            let bytes: Vec<u8> = off_mm.flatten().flat_map(i16::to_le_bytes).collect();
            BASE64_STANDARD.encode(bytes)
        };
        let of_flight = |drones: &Vec<(usize, Vec<Option<[f32; 3]>>)>| {
            let drones = drones.iter();
            drones.map(|(drone, path)| (*drone, bytes(path))).collect()
        };
        FlownPlaces {
            from_s: paths.from_s,
            step_s: paths.step_s,
            flights: paths.flights.iter().map(of_flight).collect(),
        }
    }
}

/// One drone; times and places of its points as differences, in units of [`UNIT`].
#[derive(Serialize)]
struct Drone<'a> {
    name: &'a str,
    airframe: &'a str,
    body_radius_m: f64,
    max_speed_mps: f64,
    max_climb_mps: Option<f64>,
    max_descent_mps: Option<f64>,
    /// Mean air (m/s) of an alpha of 0, of 1, and of its limit, with the load that it carries from
    /// which point on: changes alone.
    alpha_mps: Vec<(usize, [f64; 3])>,
    may_be_late_s: Option<f64>,
    arrives_s: f64,
    waits_s: f64,
    worst_air_mps: f64,
    worst_air_from: Option<&'a str>,
    worst_air_at_s: Option<f64>,
    extra_energy_percent: f64,
    enters_s: Option<f64>,
    leaves: bool,
    airborne_s: (f64, Option<f64>),
    unplanned: Option<&'a str>,
    /// Times.
    t: Vec<i64>,
    /// Places, three numbers a point.
    p: Vec<i64>,
    /// Inner Bézier points from the piece's beginning, six numbers for a cubic, none for a straight
    /// piece; empty where all are straight.
    c: Vec<Vec<i64>>,
    /// Which wake from which point on: changes alone.
    w: Vec<(usize, Option<usize>)>,
    /// From which time on its wake ends at which height: changes alone (s, m; `null`: none).
    ends: Vec<(f32, Option<f32>)>,
    /// Its exposure, a byte a sample, as base64; empty without any.
    air: String,
    /// Its exposures: from, until (s), the emitter, at most (m/s).
    meets: Vec<(f32, f32, usize, f32)>,
    stops: Vec<StopRow>,
}

/// A stop: from, until (s), `dwell`, `wait` or `stop` where that is not known, for which drone it
/// waits, and how much later it is for that (s).
type StopRow = (f32, f32, &'static str, Option<usize>, Option<f32>);

impl<'a> PageData<'a> {
    pub(crate) fn new(
        plan: &'a Plan,
        (air, waits): (&AirOfPlan<'_>, &Waits),
        flight: Option<&'a FlightReport>,
    ) -> PageData<'a> {
        let fleet = plan.drones.len();
        let end_s = plan.ends_s();
        let (samples, step_s) = (&waits.samples, waits.step_s);
        let met = air.met(samples);
        let max_air_mps = met
            .iter()
            .flatten()
            .map(|it| it.air_mps)
            .fold(1e-3, f64::max);
        let flown = plan.flown();
        let levels = LEVELS[usize::from(fleet > FINE_UP_TO)];
        let wakes = air.kinds.iter().map(|kind| {
            let levels = air.levels(kind, levels);
            levels
                .into_iter()
                .map(|level| level.map(|it| it as f32))
                .collect()
        });
        let wakes = wakes.collect();
        let drones =
            (0..fleet).map(|k| {
                let of_drone = || met.iter().map(move |all| &all[k]);
                let stops = waits.stops[k].iter().map(|it| {
                    let (from_s, until_s) = (it.from_s as f32, it.until_s as f32);
                    let costs_s = it.costs_s.map(|it| it as f32);
                    (from_s, until_s, it.what, it.waits_for, costs_s)
                });
                let drone = &plan.drones[k];
                let path = &drone.trajectory;
                let units = |value: f64| (value / UNIT).round() as i64;
                let places: Vec<[i64; 3]> = path
                    .position_m
                    .iter()
                    .map(|it| [units(it.x), units(it.y), units(it.z)])
                    .collect();
                let times: Vec<i64> = path.t_s.iter().map(|&it| units(it)).collect();
                let control = |(piece, control_m): (usize, &Vec<nalgebra::Point3<f64>>)| {
                    let from = places[piece];
                    control_m
                        .iter()
                        .flat_map(|it| {
                            [
                                units(it.x) - from[0],
                                units(it.y) - from[1],
                                units(it.z) - from[2],
                            ]
                        })
                        .collect()
                };
                let kinds = (0..times.len()).map(|point| (point, air.kind(k, point)));
                let ends = air.ends_z_m(k, samples).into_iter();
                let ends = samples
                    .iter()
                    .zip(ends)
                    .map(|(sample, end)| (sample.t_s as f32, end.map(|it| it as f32)));
                let level = |it: f64| (it / max_air_mps * 255.0).round() as u8;
                let bytes: Vec<u8> = of_drone().map(|it| level(it.air_mps)).collect();
                let none = path.t_s.is_empty().then_some(&0.0);
                let unplanned = plan.unplanned.iter().find(|it| it.name == drone.name);
                Drone {
                    name: &drone.name,
                    airframe: &drone.airframe.name,
                    body_radius_m: drone.airframe.body_radius_m,
                    max_speed_mps: drone.airframe.max_speed_mps,
                    max_climb_mps: drone.airframe.max_climb_mps,
                    max_descent_mps: drone.airframe.max_descent_mps,
                    alpha_mps: changes(path.t_s.iter().chain(none).enumerate().map(
                        |(point, &t_s)| {
                            let u_h_mps = flown.hover_velocity_mps(drone.hover_mps(t_s));
                            let alphas = [0.0, 1.0, drone.air_limit];
                            (point, alphas.map(|alpha| flown.mean_mps(alpha, u_h_mps)))
                        },
                    )),
                    may_be_late_s: drone.may_be_late_s,
                    arrives_s: drone.arrives_s,
                    waits_s: drone.waits_s,
                    worst_air_mps: drone.worst_air_mps,
                    worst_air_from: drone.worst_air_from.as_deref(),
                    worst_air_at_s: drone.worst_air_at_s,
                    extra_energy_percent: drone.extra_energy_percent,
                    enters_s: drone.enters_s,
                    leaves: plan.leaves_s(drone).is_some(),
                    airborne_s: drone.airborne_s,
                    unplanned: unplanned.map(|it| &it.reason[..]),
                    c: path.control_m.iter().enumerate().map(control).collect(),
                    t: differences(&times),
                    p: places
                        .iter()
                        .enumerate()
                        .flat_map(|(k, it)| {
                            let before = if k == 0 { [0; 3] } else { places[k - 1] };
                            [it[0] - before[0], it[1] - before[1], it[2] - before[2]]
                        })
                        .collect(),
                    w: changes(kinds),
                    ends: changes(ends),
                    air: match bytes.iter().any(|&it| it > 0) {
                        true => BASE64_STANDARD.encode(&bytes),
                        false => String::new(),
                    },
                    meets: meets(samples, of_drone().map(|it| &it.from[..])),
                    stops: stops.collect(),
                }
            });
        PageData {
            scenario: &plan.scenario,
            status: plan.status,
            bounds_m: &plan.bounds_m,
            obstacles: &plan.obstacles,
            zones: &plan.zones,
            margins: plan.margins,
            clearance_m: plan.clearance_m.unwrap_or(0.0),
            convection: air.convection,
            end_s,
            step_s,
            max_air_mps,
            violation_count: plan.violations.len(),
            violations: plan
                .violations
                .iter()
                .take(MOST_VIOLATIONS)
                .map(ToString::to_string)
                .collect(),
            drones: drones.collect(),
            wakes,
            flight,
            flown: flight.map(|it| FlownPlaces::of(&it.paths)),
        }
    }
}

fn differences(values: &[i64]) -> Vec<i64> {
    let before = std::iter::once(&0).chain(values);
    values
        .iter()
        .zip(before)
        .map(|(value, before)| value - before)
        .collect()
}

/// Of keys with values those at which the value changes.
fn changes<K, V: PartialEq>(all: impl Iterator<Item = (K, V)>) -> Vec<(K, V)> {
    let mut kept: Vec<(K, V)> = Vec::new();
    for (key, value) in all {
        if kept.last().is_none_or(|last| last.1 != value) {
            kept.push((key, value));
        }
    }
    kept
}

/// Spans of exposure to one wake, by their beginning.
fn meets<'m>(
    samples: &[Sample],
    met: impl Iterator<Item = &'m [(usize, f64)]>,
) -> Vec<(f32, f32, usize, f32)> {
    let mut spans: Vec<(f32, f32, usize, f32)> = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    for (sample, from) in samples.iter().zip(met) {
        open.retain(|&span| from.iter().any(|it| it.0 == spans[span].2));
        for &(other, air_mps) in from {
            let known = open.iter().find(|&&span| spans[span].2 == other);
            let span = known.copied().unwrap_or_else(|| {
                spans.push((sample.t_s as f32, 0.0, other, 0.0));
                open.push(spans.len() - 1);
                spans.len() - 1
            });
            spans[span].1 = sample.t_s as f32;
            // To a hundredth: what is shown.
            spans[span].3 = spans[span].3.max((air_mps * 100.0).round() as f32 / 100.0);
        }
    }
    spans
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_of_the_page_are_those_of_what_a_drone_carries_and_its_count_is_of_all_violations() {
        let text = r#"{"format": "plan/1", "scenario": "s", "bounds_m": {"min": [0,0,0], "max": [9,9,9]},
            "drones": [{"name": "a", "airframe": "kolibri", "trajectory": {"t_s": [0, 5, 9],
                "position_m": [[1,1,4],[5,1,4],[8,1,4]], "mass_kg": [0.92, 0.23, 0.23]}}]}"#;
        let mut plan = planner::plan::file::read(text).expect("a plan").plan;
        // Too fast for a moment.
        plan.drones[0].trajectory.t_s[1] = 0.5;
        let violation = planner::verify(&plan).violations.swap_remove(0);
        plan.drones[0].trajectory.t_s[1] = 5.0;
        plan.violations = vec![violation; MOST_VIOLATIONS + 7];
        let air = AirOfPlan::new(&plan);
        let scene = PageData::new(&plan, (&air, &Waits::of(&plan, None, &air)), None);
        let u_h_mps = plan.drones[0].airframe.hover_induced_velocity_mps;
        let of = |hover_mps: f64| [0.0, hover_mps, plan.drones[0].air_limit * hover_mps];
        let expected = [(0, of(2.0 * u_h_mps)), (1, of(u_h_mps))];
        assert_eq!(scene.drones[0].alpha_mps, expected);
        assert_eq!(scene.violation_count, 57);
    }

    #[test]
    fn the_air_of_the_page_is_that_of_the_verifier_between_its_samples() {
        let plan = crate::tests::hall(60);
        let air = AirOfPlan::new(&plan);
        let scene = PageData::new(&plan, (&air, &Waits::of(&plan, None, &air)), None);
        let worst_mps = |k: usize| plan.drones[k].worst_air_mps;
        let most_mps = (0..60).map(worst_mps).fold(0.0, f64::max);
        assert!(most_mps > 0.2);
        let ratio = scene.max_air_mps / most_mps;
        assert!((0.8..1.01).contains(&ratio), "{ratio}");
        for (drone, shown) in plan.drones.iter().zip(&scene.drones) {
            if drone.worst_air_mps < 0.2 {
                continue;
            }
            let from = drone.worst_air_from.as_deref();
            let named = |it: &(f32, f32, usize, f32)| Some(&plan.drones[it.2].name[..]) == from;
            assert!(shown.meets.iter().any(named), "{}", drone.name);
        }
    }
}
