//! What a plan takes of each drone's battery, before anything is flown: hovering for as long as it
//! is in the air, up to the plan's end, the climbs, and the cost of its exposure up to the end of
//! its own trajectory, with the mass and the air of a finding. Drag is left out; `fly` has it, and
//! all the air.

use airflow::{Flown, GRAVITY_MPS2};
use planner::Plan;
use planner::plan::DronePlan;
use serde::Serialize;

use crate::fleet::as_found_to_weigh;
use crate::setup::Setup;
use crate::vehicle::Vehicle;

/// What one drone takes of its battery.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Charge {
    /// Its name.
    pub drone: String,
    /// Its airframe's.
    pub airframe: String,
    /// Electrical energy to the last time of the plan (Wh).
    pub energy_wh: f64,
    /// Of a full battery (Wh); `None`: not known.
    pub capacity_wh: Option<f64>,
    /// Of that (%).
    pub percent: Option<f64>,
    /// Aerodynamic over electrical power: its airframe's, where no file states it.
    pub drive_efficiency: f64,
}

/// Of every drone of a plan whose airframe can be, in the plan's order.
#[must_use]
pub fn of_plan(plan: &Plan, setup: &Setup) -> Vec<Charge> {
    let ends_s = plan.ends_s();
    let flown = plan.flown();
    let plan = &*as_found_to_weigh(plan, &flown);
    let charge = |drone: &DronePlan| {
        let airframe = drone.airframe.airframe().ok()?;
        let vehicle = Vehicle::of(&airframe, &setup.entry(airframe.name()));
        let energy_wh = energy_j(drone, (ends_s, &flown)) / vehicle.drive_efficiency / 3600.0;
        Some(Charge {
            drone: drone.name.clone(),
            airframe: airframe.name().to_owned(),
            energy_wh,
            capacity_wh: vehicle.battery_wh,
            percent: vehicle.battery_wh.map(|it| 100.0 * energy_wh / it),
            drive_efficiency: vehicle.drive_efficiency,
        })
    };
    plan.drones.iter().filter_map(charge).collect()
}

/// Aerodynamic: m g U_H while it is in the air before a plan ends (s), m g per metre of climb, and
/// the air's price (J).
fn energy_j(drone: &DronePlan, (ends_s, flown): (f64, &Flown)) -> f64 {
    let path = &drone.trajectory;
    let (from_s, until_s) = drone.airborne_s;
    let until_s = until_s.unwrap_or(ends_s);
    let mut energy_j = drone.extra_energy_j;
    // It may hover before its first time, and on after its last.
    let (t_s, at_m) = (&path.t_s, &path.position_m);
    let comes_s = drone.enters_s.unwrap_or(0.0);
    let pieces = [&comes_s].into_iter().chain(t_s);
    let pieces = pieces.zip(t_s.iter().chain([&ends_s]));
    let places_m = at_m.first().into_iter().chain(at_m);
    let places_m = places_m.zip(at_m.iter().chain(at_m.last()));
    let masses_kg = path.mass_kg.first().into_iter().chain(&path.mass_kg);
    for ((times_s, places_m), mass_kg) in pieces.zip(places_m).zip(masses_kg) {
        // Through thin air that was found.
        let hover_mps = drone.hover_mps(*times_s.0) / flown.density_kg_per_m3(1.0).sqrt();
        let weight_n = mass_kg * GRAVITY_MPS2;
        let both = |(from_s, until_s): (f64, f64)| {
            (times_s.1.min(until_s) - times_s.0.max(from_s)).max(0.0)
        };
        let rests_s: f64 = drone.landed_s.iter().map(|rest_s| both(*rest_s)).sum();
        let flies_s = both((from_s, until_s)) - rests_s;
        let climbs_m = places_m.1.z - places_m.0.z;
        energy_j += weight_n * (hover_mps * flies_s.max(0.0) + climbs_m.max(0.0));
    }
    energy_j
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drone_that_hovers_takes_its_hover_power_and_nothing_is_said_of_unknown_batteries() {
        let text = r#"{"format": "plan/1", "scenario": "s", "bounds_m": {"min": [0,0,0], "max": [9,9,9]},
            "drones": [
                {"name": "a", "airframe": "matrice-300", "trajectory": {"t_s": [0, 60], "position_m": [[1,1,4],[1,1,4]]}},
                {"name": "b", "airframe": "kolibri", "trajectory": {"t_s": [0, 60], "position_m": [[7,7,1],[7,7,3]]}},
                {"name": "c", "airframe": "matrice-300", "trajectory": {"t_s": [0], "position_m": [[1,7,4]]}},
                {"name": "d", "airframe": "matrice-300", "trajectory": {"t_s": [50, 60], "position_m": [[4,7,4],[4,7,4]]}},
                {"name": "e", "airframe": "matrice-300", "enters_s": 30, "trajectory": {"t_s": [50, 60], "position_m": [[7,4,4],[7,4,4]]}}]}"#;
        let plan = planner::plan::file::read(text).expect("a plan").plan;
        let [a, b, c, d, e] = &of_plan(&plan, &Setup::default())[..] else {
            panic!("five drones");
        };
        // Whatever a trajectory says of a drone that hovers on, or has hovered before.
        assert_eq!(a.energy_wh, c.energy_wh);
        assert!((a.energy_wh - d.energy_wh).abs() < 1e-9);
        assert!((a.energy_wh - 2.0 * e.energy_wh).abs() < 1e-9);
        let airframe = &plan.drones[0].airframe;
        let hover_w = airframe.mass_kg * GRAVITY_MPS2 * airframe.hover_induced_velocity_mps;
        assert!((a.energy_wh - hover_w * 60.0 / 0.5 / 3600.0).abs() < 1e-9);
        assert!((a.percent.expect("known") - 100.0 * a.energy_wh / 548.0).abs() < 1e-9);
        assert_eq!((b.capacity_wh, b.percent), (None, None));
        let climb_j = 0.23 * GRAVITY_MPS2 * 2.0;
        let hover_j = b.energy_wh * 3600.0 * 0.5 - climb_j;
        let airframe = &plan.drones[1].airframe;
        let hover_w = 0.23 * GRAVITY_MPS2 * airframe.hover_induced_velocity_mps;
        assert!((hover_j - 60.0 * hover_w).abs() < 1e-6);
    }

    #[test]
    fn a_crazyflie_hovers_for_seven_minutes() {
        let text = r#"{"format": "plan/1", "scenario": "s", "bounds_m": {"min": [0,0,0], "max": [9,9,9]},
            "drones": [{"name": "a", "airframe": "crazyflie-2.1",
            "trajectory": {"t_s": [0, 420], "position_m": [[1,1,4],[1,1,4]]}}]}"#;
        let plan = planner::plan::file::read(text).expect("a plan").plan;
        let charges = of_plan(&plan, &Setup::default());
        let percent = charges[0].percent.expect("known");
        assert!((percent - 100.0).abs() < 1.0, "{percent} %");
    }

    #[test]
    fn a_finding_that_a_drone_is_heavier_takes_more_of_its_battery() {
        let energy_wh = |effects: &str| {
            let text = format!(
                r#"{{"format": "plan/2", "scenario": "s", "bounds_m": {{"min": [0,0,0], "max": [9,9,9]}},
                "air": {{"effects": {effects}}}, "drones": [{{"name": "a", "airframe": "matrice-300",
                "trajectory": {{"t_s": [0, 60], "position_m": [[1,1,4],[1,1,4]]}}}}]}}"#
            );
            let plan = planner::plan::file::read(&text).expect("a plan").plan;
            of_plan(&plan, &Setup::default())[0].energy_wh
        };
        let heavier = energy_wh(r#"{"payload_mass": {"mass_factor": 1.5}}"#) / energy_wh("{}");
        // m g U_H, U_H with the root of m.
        assert!((heavier - 1.5_f64.powf(1.5)).abs() < 1e-9, "{heavier}");
    }
}
