//! A plan from anywhere, examined: what it breaks, which of the figures that it states differ from
//! what follows from its trajectories, and how much room it leaves.

use std::collections::BTreeMap;
use std::fmt;

use nalgebra::Point3;
use rustc_hash::FxHashSet;
use serde::Serialize;

use super::checks::air;
use super::checks::lateness::{self, Lateness};
use super::scene::Scene;
use super::time::closest::{Nearest, closest};
use super::time::encounters::{Encounter, encounters};
use super::{Report, checks::contents, crowd, extra_energy_j, judged};
use crate::plan::cause::as_typed;
use crate::plan::file::{DroneClaims, PlanFile, TIME_S, arrival_s};
use crate::plan::{
    AtEnd, DronePlan, FORMAT_BEFORE, Plan, Status, Violation, ViolationKind, ZoneAir,
};

/// The verifier's own error in the highest air: 0.1 % and 1e-4 U_H. Two programs may both err so.
const AIR: (f64, f64) = (2e-3, 2e-4);
/// The same with advected wakes: 2 % and 0.002 U_H, both below what it is.
const LATE_AIR: (f64, f64) = (2e-2, 2e-3);
/// Sums over time are found to 0.1 % by the verifier; two programs may both err so, and energy goes
/// with a power of the air. Besides, a millimetre of exposure and what it costs (m), chosen here,
/// and what [`air::DOSE_FLOOR`] leaves.
const DOSE: (f64, f64) = (5e-3, 1e-3);
/// Of extra energy over that of the flight (%), chosen here: a fifth of what is printed.
const PERCENT: f64 = 2e-2;
/// Standard gravity as 9.81 or 9.806 65 m/s² differs by 2e-4 in an induced velocity.
const HOVER: f64 = 1e-3;
/// What the air of a zone may differ by beside what the verifier leaves open (m/s), chosen here: a
/// tenth of what is printed.
const SAME_AIR_MPS: f64 = 1e-3;

/// What was found out about a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Examination {
    /// The plan with the results that follow from it in place of those that its file states; what
    /// needs planning stays as stated.
    #[serde(skip)]
    pub plan: Plan,
    /// How many more violations there are than the plan lists; see [`super::Report::omitted`].
    #[serde(rename = "untold")]
    pub omitted: usize,
    /// How many drones are in crowds; see [`super::Report::crowded`]. Figures are not compared
    /// then, and it is not asked how late drones may be.
    pub crowded: usize,
    /// Figures that the file states and that do not follow from the plan.
    pub differences: Vec<Difference>,
    /// The two bodies that come nearest to one another, at least one of them flying.
    pub closest: Option<Closest>,
    /// The drone whose air comes nearest to its limit.
    pub worst_air: Option<WorstAir>,
    /// For each drone of the plan how late it may be, all others on time; `None` where it was not
    /// asked for or cannot be judged.
    pub late: Vec<Option<Lateness>>,
}

/// A figure that does not follow from the plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// The drone, by name; `None`: of the whole plan.
    pub drone: Option<String>,
    /// Its key in the file.
    pub figure: String,
    /// What the file states.
    pub stated: String,
    /// What follows from the plan.
    pub found: String,
}

/// Two bodies and the gap between them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Closest {
    /// Both, by name.
    pub drones: [String; 2],
    /// Between the balls (m); negative: they overlap.
    pub gap_m: f64,
    /// When (s).
    pub at_s: f64,
    /// Where the first is (m).
    pub position_m: Point3<f64>,
}

/// A drone's highest air beside its limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstAir {
    /// Its name.
    pub drone: String,
    /// Mean air over its discs, over its induced velocity at that moment.
    pub alpha: f64,
    /// Its limit.
    pub limit: f64,
    /// The drone with the strongest wake.
    pub from: Option<String>,
    /// When (s).
    pub at_s: f64,
    /// Where the drone is (m).
    pub position_m: Point3<f64>,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Difference {
            drone,
            figure,
            stated,
            found,
        } = self;
        match drone {
            Some(drone) => write!(f, "`{drone}`: ")?,
            None => f.write_str("the plan: ")?,
        }
        write!(
            f,
            "`{figure}` is {stated} in the file, {found} by the trajectories"
        )
    }
}

/// Of which drones it is asked how late they may be.
#[derive(Clone, Copy)]
enum LatenessOf {
    None,
    /// That one which may be late by the least.
    Least,
    Each,
}

/// Judges a plan file: its plan, its claims, and, if `late` is asked for, how late each drone may
/// be.
pub fn examine(file: &PlanFile, late: bool) -> Examination {
    let of_which = match late {
        true => LatenessOf::Each,
        false => LatenessOf::None,
    };
    examined(file, of_which)
}

/// The same, asked how late that one drone may be which may be late by the least: of a large fleet
/// this takes a fraction of the time. Where the file states it of a drone it is asked of each.
pub fn examine_least(file: &PlanFile) -> Examination {
    let mut claims = file.claims.drones.iter();
    let of_which = match claims.any(|it| it.may_be_late_s.is_some()) {
        true => LatenessOf::Each,
        false => LatenessOf::Least,
    };
    examined(file, of_which)
}

fn examined(file: &PlanFile, of_which: LatenessOf) -> Examination {
    let mut examined = file.plan.clone();
    for (drone, claims) in examined.drones.iter_mut().zip(&file.claims.drones) {
        drone.arrives_s = arrives_s(&file.plan, drone, claims.arrives_s);
    }
    let is_planned = |it: &&DronePlan| !file.plan.is_unplanned(&it.name);
    let arrivals = || (examined.drones.iter().filter(is_planned)).map(|it| it.arrives_s);
    (examined.fleet.makespan_s, examined.fleet.sum_of_arrivals_s) =
        (arrivals().fold(0.0, f64::max), arrivals().sum());
    let plan = &examined;
    let (mut scene, malformed) = contents::read(plan);
    let closest = scene.as_ref().and_then(nearest_bodies);
    let crowds = scene.as_mut().map(crowd::set_aside).unwrap_or_default();
    // Contradictory plans have no figures to compare; those of crowds are not computed.
    let is_whole = malformed.is_empty() && crowds.drones == 0;
    let of_which = match crowds.drones {
        0 => of_which,
        _ => LatenessOf::None,
    };
    let found = (malformed, crowds);
    let report = super::report(
        plan,
        scene.as_ref(),
        found,
        (super::ZoneQuestion::Spans, None),
    );
    let mut late = vec![None; plan.drones.len()];
    let near = scene.as_ref().map(|scene| encounters(scene, 0.0));
    let judged_by = scene.as_ref().zip(near.as_deref());
    if let Some((scene, near)) = judged_by {
        let over = report.violations.iter();
        let over = over.filter(|it| it.kind == ViolationKind::Air);
        let over: FxHashSet<&str> = over.map(|it| &it.drone[..]).collect();
        let flights = scene.flights.iter();
        let is_over = flights.map(|it| over.contains(&it.name[..])).collect();
        match of_which {
            LatenessOf::None => {}
            LatenessOf::Least => lateness::of_least(scene, (near, is_over), &mut late),
            LatenessOf::Each => lateness::of_each(scene, (near, is_over), &mut late, &|| false),
        }
    }
    let worst_air = worst_air(plan, &report);
    let mut differences = Differences {
        list: Vec::new(),
        late: &late,
        file,
        examined: plan,
        report: &report,
        judged_by,
    };
    if is_whole {
        differences.gather();
    }
    let differences = differences.list;
    let (omitted, crowded) = (report.omitted, report.crowded);
    let unplanned = examined.unplanned.clone();
    let mut plan = judged(examined, report, unplanned);
    for (drone, late) in plan.drones.iter_mut().zip(&late) {
        drone.may_be_late_s = late.as_ref().map(|it| it.late_s);
    }
    Examination {
        omitted,
        crowded,
        differences,
        closest,
        worst_air,
        late,
        plan,
    }
}

/// The gap between two bodies that is the smallest of all.
fn nearest_bodies(scene: &Scene<'_>) -> Option<Closest> {
    let Nearest {
        gap_m,
        flights,
        at_s,
    } = closest(scene)?;
    Some(Closest {
        drones: flights.map(|it| scene.flights[it].name.clone()),
        gap_m,
        at_s,
        position_m: scene.flights[flights[0]].position_m(at_s),
    })
}

/// The drone whose highest air is the largest part of its limit.
fn worst_air(plan: &Plan, report: &Report) -> Option<WorstAir> {
    let density_kg_per_m3 = plan.air.density_kg_per_m3;
    let flown = plan.flown();
    let of_one = |(drone, met): (&DronePlan, &super::DroneExposure)| {
        let at_s = met.worst_air_at_s?;
        let entry = &drone.trajectory;
        let point = entry.point_at(at_s).unwrap_or(0);
        let mass_kg = *entry.mass_kg.get(point)?;
        let airframe = drone.airframe.airframe().ok()?;
        let stated_mps = airframe.hover_induced_velocity_mps(mass_kg, density_kg_per_m3);
        let u_h_mps = flown.hover_velocity_mps(stated_mps);
        Some(WorstAir {
            drone: drone.name.clone(),
            alpha: flown.alpha(met.worst_air_mps, u_h_mps),
            limit: drone.air_limit,
            from: met.worst_air_from.clone(),
            at_s,
            position_m: entry.position_m(at_s)?,
        })
    };
    let all = plan.drones.iter().zip(&report.exposures).filter_map(of_one);
    all.max_by(|a, b| (a.alpha / a.limit).total_cmp(&(b.alpha / b.limit)))
}

/// When a drone's last dwell ends: as stated where that may be, else as its trajectory suggests
/// (s).
fn arrives_s(plan: &Plan, drone: &DronePlan, stated_s: Option<f64>) -> f64 {
    // The last dwell of a drone that stays may be missing from trajectories of plan/1.
    let last_s = drone.trajectory.t_s.last().copied();
    let later_s = stated_s.filter(|stated_s| Some(*stated_s) > last_s);
    if let Some(later_s) = later_s.filter(|_| plan.format == FORMAT_BEFORE)
        && drone.at_end == AtEnd::Hover
    {
        return later_s;
    }
    arrival_s(drone, stated_s)
}

/// Gathers stated figures that do not follow.
struct Differences<'a> {
    list: Vec<Difference>,
    /// How late each drone may be, where that was asked for.
    late: &'a [Option<Lateness>],
    file: &'a PlanFile,
    /// Its plan with the arrivals that follow.
    examined: &'a Plan,
    report: &'a Report,
    /// The plan as it was read, and which drones are near one another.
    judged_by: Option<(&'a Scene<'a>, &'a [Vec<Encounter>])>,
}

impl Differences<'_> {
    fn gather(&mut self) {
        let PlanFile { plan, claims, .. } = self.file;
        let claims = claims.clone();
        for (k, stated) in claims.drones.iter().enumerate().take(plan.drones.len()) {
            self.drone(k, stated);
        }
        let is_planned = |drone: &&DronePlan| !plan.is_unplanned(&drone.name);
        let planned = || {
            let all = plan.drones.iter().zip(&claims.drones);
            all.filter(|(it, _)| is_planned(it))
        };
        let slack_s = TIME_S * planned().count().max(1) as f64;
        let alone = planned()
            .map(|(_, stated)| stated.alone_s)
            .sum::<Option<f64>>();
        let energy_j = extra_energy_j(&self.report.exposures);
        let (fleet, found) = (claims.fleet, &self.examined.fleet);
        self.number(
            None,
            "fleet.makespan_s",
            fleet.makespan_s,
            (found.makespan_s, TIME_S),
        );
        self.number(
            None,
            "fleet.sum_of_arrivals_s",
            fleet.sum_of_arrivals_s,
            (found.sum_of_arrivals_s, slack_s),
        );
        if let Some(alone_s) = alone {
            let alone_s = (alone_s, slack_s);
            self.number(None, "fleet.sum_alone_s", fleet.sum_alone_s, alone_s);
        }
        let slack_j = DOSE.0 * energy_j + 1e-6;
        // The sum of the stated figures, each checked against its drone's exposure, suffices.
        let stated = claims.drones.iter().map(|it| it.extra_energy_j);
        let sums = fleet.extra_energy_j.zip(stated.sum::<Option<f64>>());
        if !sums.is_some_and(|(told_j, sum_j)| (told_j - sum_j).abs() <= slack_j) {
            self.number(
                None,
                "fleet.extra_energy_j",
                fleet.extra_energy_j,
                (energy_j, slack_j),
            );
        }
        let status = self.report.status(&plan.unplanned);
        if let Some(stated) = claims.status.filter(|it| *it != status) {
            let told = |status: Status| format!("\"{}\"", status.as_str());
            self.tell(None, "status", told(stated), told(status));
        }
        if let Some(stated) = &claims.zone_air {
            self.zones(stated);
        }
        // Some of very many cannot be compared.
        if let Some(stated) = (claims.violations.as_ref()).filter(|_| self.report.omitted == 0) {
            self.violations(stated);
        }
    }

    /// One drone's figures.
    fn drone(&mut self, k: usize, stated: &DroneClaims) {
        let drone = &self.file.plan.drones[k];
        let is_unplanned = self
            .file
            .plan
            .unplanned
            .iter()
            .any(|it| it.name == drone.name);
        let Ok(airframe) = drone.airframe.airframe() else {
            return;
        };
        let mass_kg = airframe.mass_kg();
        let density_kg_per_m3 = self.file.plan.air.density_kg_per_m3;
        let u_h_mps = airframe.hover_induced_velocity_mps(mass_kg, density_kg_per_m3);
        let key = "airframe.hover_induced_velocity_mps";
        let slack_mps = HOVER * u_h_mps;
        self.number(
            Some(k),
            key,
            stated.airframe.hover_induced_velocity_mps,
            (u_h_mps, slack_mps),
        );
        if !is_unplanned {
            let arrival_s = self.examined.drones[k].arrives_s;
            self.number(Some(k), "arrives_s", stated.arrives_s, (arrival_s, TIME_S));
        }
        let met = &self.report.exposures[k];
        let error = match self.file.plan.convection() {
            Some(_) => LATE_AIR,
            None => AIR,
        };
        let higher_mps = stated.worst_air_mps.unwrap_or(0.0).max(met.worst_air_mps);
        let slack_mps = error.0 * higher_mps + error.1 * u_h_mps;
        self.number(
            Some(k),
            "worst_air_mps",
            stated.worst_air_mps,
            (met.worst_air_mps, slack_mps),
        );
        self.worst(k, stated, slack_mps);
        let (from_s, until_s) = drone.airborne_s;
        let last_s = drone.trajectory.t_s.last().copied().unwrap_or(0.0);
        let flies_s = (until_s.unwrap_or(last_s).min(last_s) - from_s).max(0.0);
        let least_m = DOSE.1 + 2.0 * air::DOSE_FLOOR * u_h_mps * flies_s;
        let slack_m = DOSE.0 * met.dose_m + least_m;
        self.number(Some(k), "dose_m", stated.dose_m, (met.dose_m, slack_m));
        // Downwash costs at most the weight times the exposure.
        let slack_j = DOSE.0 * met.extra_energy_j + least_m * mass_kg * airflow::GRAVITY_MPS2;
        let energy_j = (met.extra_energy_j, slack_j);
        self.number(Some(k), "extra_energy_j", stated.extra_energy_j, energy_j);
        let percent = (
            met.extra_energy_percent,
            DOSE.0 * met.extra_energy_percent + PERCENT,
        );
        self.number(
            Some(k),
            "extra_energy_percent",
            stated.extra_energy_percent,
            percent,
        );
        if let Some(late) = &self.late[k] {
            let late_s = (late.late_s, 2.0 * lateness::FINE_S);
            self.number(Some(k), "may_be_late_s", stated.may_be_late_s, late_s);
        }
    }

    /// The stated time and emitter of the highest air: any moment at which it is as high is
    /// accepted, with the strongest wake of that moment.
    fn worst(&mut self, k: usize, stated: &DroneClaims, slack_mps: f64) {
        let met = &self.report.exposures[k];
        let told_s = |at_s: Option<f64>| {
            at_s.map_or("none".to_owned(), |at_s| format!("{} s", as_typed(at_s)))
        };
        let told = |from: &Option<String>| {
            let name = from.as_ref().map(|from| format!("`{from}`"));
            name.unwrap_or("none".to_owned())
        };
        let same_s = |at_s: f64| {
            met.worst_air_at_s
                .is_some_and(|it| (it - at_s).abs() <= TIME_S)
        };
        let (at_s, from) = (stated.worst_air_at_s, &stated.worst_air_from);
        if at_s.is_none_or(same_s) && (from.is_none() || *from == met.worst_air_from) {
            return;
        }
        let there_s = at_s.or(met.worst_air_at_s);
        let there = (self.judged_by.zip(there_s))
            .and_then(|((scene, near), t_s)| air::at(scene, near, k, t_s));
        let (mean_mps, strongest) = there.unwrap_or((0.0, None));
        // Where the drone's found and stated air are within the slack, which hides such faint
        // wakes, any moment of its flight and any other drone of the plan are accepted.
        let is_hidden = |air_mps: f64| air_mps > 0.0 && air_mps.max(met.worst_air_mps) <= slack_mps;
        let is_faint = stated.worst_air_mps.is_some_and(is_hidden);
        let mut drones = self.file.plan.drones.iter().enumerate();
        let is_another = drones.any(|(other, it)| other != k && from.as_ref() == Some(&it.name));
        let (takes_off_s, until_s) = self.file.plan.drones[k].airborne_s;
        let flies = |t_s: f64| takes_off_s <= t_s && until_s.is_none_or(|until_s| t_s <= until_s);
        let is_highest = (met.worst_air_mps > 0.0 || is_faint)
            && there_s.is_some_and(flies)
            && mean_mps + slack_mps >= met.worst_air_mps;
        if at_s.is_some() && !is_highest {
            self.tell(
                Some(k),
                "worst_air_at_s",
                told_s(at_s),
                told_s(met.worst_air_at_s),
            );
        }
        let is_of = *from == met.worst_air_from
            || is_highest && *from == strongest
            || is_faint && is_another;
        if from.is_some() && !is_of {
            self.tell(
                Some(k),
                "worst_air_from",
                told(from),
                told(&met.worst_air_from),
            );
        }
    }

    /// The highest air of the zones that are stated.
    fn zones(&mut self, stated: &[ZoneAir]) {
        for stated in stated {
            let key = |figure: &str| format!("zone_air `{}`: {figure}", stated.zone);
            let found = self
                .report
                .zone_air
                .iter()
                .find(|it| it.zone == stated.zone);
            let Some(found) = found.cloned() else {
                self.tell(None, &key("zone"), "stated".to_owned(), "none".to_owned());
                continue;
            };
            if stated.worst_air_from.is_some() && stated.worst_air_from != found.worst_air_from {
                let told = |from: &Option<String>| from.clone().unwrap_or("none".to_owned());
                let (stated, found) = (&stated.worst_air_from, &found.worst_air_from);
                self.tell(None, &key("worst_air_from"), told(stated), told(found));
            }
            let (worst_mps, most_mps) = (found.worst_air_mps, found.at_most_mps);
            let most_mps = most_mps.unwrap_or(worst_mps);
            // The highest air there is lies between both.
            let slack_mps = (most_mps - worst_mps).max(0.0) + SAME_AIR_MPS;
            let told_mps = stated.worst_air_mps;
            let figure = key("worst_air_mps");
            self.number(None, &figure, Some(told_mps), (worst_mps, slack_mps));
            let figure = key("at_most_mps");
            self.number(None, &figure, stated.at_most_mps, (most_mps, slack_mps));
            if let Some(stated_mps) = stated.at_most_mps.filter(|it| *it < told_mps) {
                let worst = format!("its own worst_air_mps of {} above it", as_typed(told_mps));
                self.tell(None, &figure, as_typed(stated_mps).to_string(), worst);
            }
            self.zone_moment(stated, &found, slack_mps);
            let names = |it: &ZoneAir| it.entered_by.join(", ");
            if stated.entered_by != found.entered_by {
                self.tell(None, &key("entered_by"), names(stated), names(&found));
            }
        }
    }

    /// The stated time of a zone's highest air: any moment at which it may be as high is accepted.
    fn zone_moment(&mut self, stated: &ZoneAir, found: &ZoneAir, slack_mps: f64) {
        let Some(at_s) = stated.worst_air_at_s else {
            return;
        };
        let is_same = |it: f64| (it - at_s).abs() <= TIME_S;
        let most_mps = || {
            let scene = self.judged_by.map(|(scene, _)| scene);
            scene.map_or(0.0, |it| super::most_air_mps(it, &stated.zone, at_s))
        };
        let found_s = found.worst_air_at_s;
        let is_as_high = || found_s.is_some() && most_mps() + slack_mps >= found.worst_air_mps;
        if !found_s.is_some_and(is_same) && !is_as_high() {
            let figure = format!("zone_air `{}`: worst_air_at_s", stated.zone);
            let told = found_s.map_or("none".to_owned(), |it| as_typed(it).to_string());
            self.tell(None, &figure, as_typed(at_s).to_string(), told);
        }
    }

    /// Violations that are stated and not found, or found and not stated.
    fn violations(&mut self, stated: &[Violation]) {
        type Key = (crate::plan::ViolationKind, String, Option<String>);
        let mut count: BTreeMap<Key, [usize; 2]> = BTreeMap::new();
        let sides = [stated, &self.report.violations];
        for (side, violations) in sides.into_iter().enumerate() {
            for it in violations {
                let key = (it.kind, it.drone.clone(), it.with.clone());
                count.entry(key).or_default()[side] += 1;
            }
        }
        for ((kind, drone, with), [stated, found]) in count {
            if stated != found {
                let kind = serde_json::to_value(kind).unwrap_or_default();
                let kind = kind.as_str().unwrap_or_default();
                let with = with
                    .map(|with| format!(" with `{with}`"))
                    .unwrap_or_default();
                let k = self.file.plan.drones.iter().position(|it| it.name == drone);
                let figure = format!("violations: {kind}{with}");
                self.tell(k, &figure, stated.to_string(), found.to_string());
            }
        }
    }

    /// A number, where it is stated and farther from what is found than the slack.
    fn number(
        &mut self,
        drone: Option<usize>,
        figure: &str,
        stated: Option<f64>,
        (found, slack): (f64, f64),
    ) {
        let is_close = |it: &f64| (it - found).abs() <= slack;
        if let Some(stated) = stated.filter(|it| !is_close(it)) {
            let [stated, found] = [stated, found].map(|it| as_typed(it).to_string());
            self.tell(drone, figure, stated, found);
        }
    }

    fn tell(&mut self, drone: Option<usize>, figure: &str, stated: String, found: String) {
        let name = |k: usize| self.file.plan.drones[k].name.clone();
        self.list.push(Difference {
            drone: drone.map(name),
            figure: figure.to_owned(),
            stated,
            found,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::file::read;

    #[test]
    fn of_the_least_lateness_as_much_is_known_as_where_each_is_asked_for() {
        let text = tools::instances::hall(24, 1).expect("the hall has room");
        let world = crate::read_world(&text).expect("in order");
        let outcome = crate::plan_world(&world, &crate::Control::QUIET).expect("in order");
        let plan = outcome.into_planned().expect("the hall has a plan").plan;
        // As it is, and with a drone that is over its limit on time.
        for air_limit in [plan.drones[7].air_limit, 1e-4] {
            let mut plan = plan.clone();
            plan.drones[7].air_limit = air_limit;
            let text = serde_json::to_string(&plan).expect("a plan");
            let mut file = read(&text).expect("a plan");
            let each = examine(&file, true).late;
            let least_s = |it: &[Option<Lateness>]| {
                let late_s = it.iter().flatten().map(|it| it.late_s);
                late_s.fold(f64::INFINITY, f64::min)
            };
            let least = examine_least(&file).late;
            assert_eq!(least.iter().flatten().count(), 1);
            let known = least.iter().zip(&each).find(|it| it.0.is_some());
            let (Some(one), Some(same)) = known.expect("one") else {
                panic!("it is known of each");
            };
            assert!((one.late_s - least_s(&each)).abs() <= lateness::FINE_S);
            assert!((one.late_s - same.late_s).abs() <= lateness::FINE_S);
            file.claims.drones[3].may_be_late_s = each[3].as_ref().map(|it| it.late_s);
            assert_eq!(examine_least(&file).late, each);
        }
    }

    /// The figures that differ where a drone far from another is stated to be in its air.
    fn differences(worst_air_mps: f64, from: &str) -> Vec<String> {
        let drone = |name: &str, x: f64, stated: &str| {
            format!(
                r#"{{"name": "{name}", "airframe": "kolibri", {stated}
                "trajectory": {{"t_s": [0, 6], "position_m": [[{x}, 5, 2], [{x}, 9, 2]]}}}}"#
            )
        };
        let stated = format!(
            r#""worst_air_mps": {worst_air_mps}, "worst_air_from": "{from}", "worst_air_at_s": 3,"#
        );
        let text = format!(
            r#"{{"format": "plan/2", "scenario": "two", "bounds_m": {{"min": [0, 0, 0], "max": [40, 20, 8]}},
            "air_delay": {{"convection": [0.6, 1.0]}}, "drones": [{}, {}]}}"#,
            drone("a", 2.0, &stated),
            drone("b", 38.0, "")
        );
        let found = examine(&read(&text).expect("a plan"), false);
        let figures = found.differences.into_iter();
        figures.map(|it| it.figure).collect()
    }

    #[test]
    fn the_source_of_air_that_the_slack_hides_is_no_difference() {
        assert_eq!(differences(1e-4, "b"), Vec::<String>::new());
        assert_eq!(differences(1e-4, "x"), ["worst_air_from"]);
        assert_eq!(differences(1e-4, "a"), ["worst_air_from"]);
        let stated = ["worst_air_mps", "worst_air_at_s", "worst_air_from"];
        assert_eq!(differences(0.1, "b"), stated);
    }

    #[test]
    fn a_last_task_where_the_drone_rests_ends_on_its_pad() {
        for (motion, dwell_s) in [("Smooth", 0.0), ("Smooth", 3.0), ("Straight", 0.0)] {
            let text = format!(
                r#"(name: "rest", bounds_m: (min: (0, 0, 0), max: (6, 4, 3)), planning: (motion: {motion}),
                drones: [(name: "d", airframe: "crazyflie-2.1", start_m: (1, 2, 0.0691), at_start: Landed,
                    tasks: [(to_m: (5, 2, 0.0691), dwell_s: {dwell_s})], at_end: Land)])"#
            );
            let world = crate::read_world(&text).expect("in order");
            let outcome = crate::plan_world(&world, &crate::Control::QUIET).expect("in order");
            let planned = outcome.into_planned().expect("a plan");
            let text = serde_json::to_string(&planned.plan).expect("plain data");
            let found = examine(&read(&text).expect("a plan"), false);
            assert_eq!(found.differences, [], "{motion}, {dwell_s} s");
        }
    }

    /// The figures that differ where the air of a zone that a drone crosses is stated so.
    fn of_zone(change: impl Fn(&mut ZoneAir)) -> Vec<String> {
        let text = r#"{"format": "plan/2", "scenario": "one", "bounds_m": {"min": [0, 0, 0], "max": [20, 8, 8]},
            "zones": [{"name": "z", "min_m": [8, 3, 0], "max_m": [10, 5, 1], "air_limit_mps": 6}],
            "air_delay": {"convection": [0.6, 1.0]}, "drones": [{"name": "a", "airframe": "offboard-2",
            "trajectory": {"t_s": [0, 16], "position_m": [[1, 4, 5], [17, 4, 5]]}}]}"#;
        let mut file = read(text).expect("a plan");
        let mut zone_air = examine(&file, false).plan.zone_air;
        assert!(zone_air[0].worst_air_mps > 1.0, "{zone_air:?}");
        change(&mut zone_air[0]);
        file.claims.zone_air = Some(zone_air);
        let figures = examine(&file, false).differences.into_iter();
        figures.map(|it| it.figure).collect()
    }

    #[test]
    fn what_is_stated_of_the_air_of_a_zone_is_held_against_what_the_verifier_leaves_open() {
        assert!(of_zone(|_| {}).is_empty());
        let figure = |key: &str| format!("zone_air `z`: {key}");
        for by_mps in [-0.2, 0.2] {
            let figures = of_zone(|it| it.worst_air_mps += by_mps);
            assert!(figures.contains(&figure("worst_air_mps")), "{figures:?}");
            let figures = of_zone(|it| it.at_most_mps = it.at_most_mps.map(|mps| mps + by_mps));
            assert!(figures.contains(&figure("at_most_mps")), "{figures:?}");
        }
        // However little it is.
        let figures = of_zone(|it| it.at_most_mps = Some(it.worst_air_mps - 1e-4));
        assert!(figures.contains(&figure("at_most_mps")), "{figures:?}");
        for by_s in [-5.0, 5.0] {
            let figures = of_zone(|it| it.worst_air_at_s = it.worst_air_at_s.map(|it| it + by_s));
            assert_eq!(figures, [figure("worst_air_at_s")]);
        }
        let same = of_zone(|it| it.worst_air_at_s = it.worst_air_at_s.map(|it| it + 0.05));
        assert!(same.is_empty(), "{same:?}");
    }
}
