//! `plan compare A B`: two plans beside one another: what each keeps, and what that costs.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use nalgebra::Point3;
use planner::Plan;
use planner::plan::smoothing::Kernel;
use planner::plan::{AirframeEntry, DronePlan};
use planner::verify::examination::{Examination, examine};
use serde::Serialize;

use crate::commands::answers::Wanted;
use crate::io::answer::Answer;
use crate::io::failure::Failure;
use crate::io::plans::Source;
use crate::plots::curves;
use crate::report::sections::{Part, Report};
use crate::report::words::{count, first_few, shortest};

/// Drones that are listed: chosen here, those that differ most.
const MOST_LISTED: usize = 15;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Plan
    #[arg(value_name = "A.json")]
    a: PathBuf,
    /// Plan that it is compared with
    #[arg(value_name = "B.json")]
    b: PathBuf,
    #[command(flatten)]
    wanted: Wanted,
}

/// `comparison/1`.
#[derive(Serialize)]
struct Compared {
    a: Figures,
    b: Figures,
    /// Where the plans are of different scenarios.
    #[serde(skip_serializing_if = "Differs::is_empty")]
    differs: Differs,
    /// Drones that A plans and B does not, and the other way round.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    planned_in_a_alone: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    planned_in_b_alone: Vec<String>,
    /// Of drones that both plan: its arrivals (s) in A and in B, those that differ most first.
    drones: Vec<Both>,
}

/// What one plan's scenario has and the other's has not; drones by name, in the plans' order.
#[derive(Default, PartialEq, Serialize)]
struct Differs {
    /// Drones of A that B does not have.
    only_in_a: Vec<String>,
    /// Drones of B that A does not have.
    only_in_b: Vec<String>,
    /// Drones with another airframe, or other limits of it.
    airframe: Vec<String>,
    /// Drones that begin at another place.
    start: Vec<String>,
    /// Drones that end at another place, where the places are others.
    end: Vec<String>,
    /// Of `bounds`, `obstacles`, `zones`, `air`.
    place: Vec<&'static str>,
}

impl Differs {
    fn of(a: &Plan, b: &Plan) -> Differs {
        let (in_a, in_b) = (by_name(a), by_name(b));
        let only = |plan: &Plan, other: &BTreeMap<&str, &DronePlan>| -> Vec<String> {
            let names = plan.drones.iter().map(|it| &it.name);
            let alone = names.filter(|name| !other.contains_key(&name[..]));
            alone.cloned().collect()
        };
        let unlike = |is_unlike: &dyn Fn(&DronePlan, &DronePlan) -> bool| -> Vec<String> {
            let both = a
                .drones
                .iter()
                .filter_map(|it| Some((it, in_b.get(&it.name[..])?)));
            let unlike = both.filter(|(a, b)| is_unlike(a, b));
            unlike.map(|(a, _)| a.name.clone()).collect()
        };
        let start_m = |it: &DronePlan| it.trajectory.position_m.first().copied();
        let apart_m = |a: &DronePlan, b: &DronePlan| {
            let both = start_m(a).zip(start_m(b));
            both.map_or(0.0, |(a_m, b_m)| (a_m - b_m).norm())
        };
        let place = [
            ("bounds", a.bounds_m != b.bounds_m),
            ("obstacles", a.obstacles != b.obstacles),
            ("zones", a.zones != b.zones),
            ("air", a.air != b.air),
        ];
        let place = place.into_iter().filter(|(_, is_unlike)| *is_unlike);
        Differs {
            only_in_a: only(a, &in_b),
            only_in_b: only(b, &in_a),
            airframe: unlike(&|a, b| airframe(a) != airframe(b)),
            start: unlike(&|a, b| apart_m(a, b) > SAME_PLACE_M),
            end: ends(a, b),
            place: place.map(|(what, _)| what).collect(),
        }
    }

    fn is_empty(&self) -> bool {
        *self == Differs::default()
    }

    fn lines(&self) -> Vec<String> {
        let of_drones = [
            ("only in A", &self.only_in_a),
            ("only in B", &self.only_in_b),
            ("another airframe, or other limits of it", &self.airframe),
            ("begin at another place", &self.start),
            ("end at another place", &self.end),
        ];
        let of_drones = of_drones.into_iter().filter(|(_, names)| !names.is_empty());
        let mut lines: Vec<String> = of_drones
            .map(|(what, names)| {
                let listed = first_few(names.iter().map(quoted), MOST_LISTED, ", ");
                let drones = count(names.len(), "drone", "drones");
                format!("{what}: {drones}, {listed}")
            })
            .collect();
        if !self.place.is_empty() {
            lines.push(format!("the place: other {}", self.place.join(", other ")));
        }
        lines
    }
}

/// Drones planned in both that end elsewhere; none where the places are the same and other drones
/// have taken them.
fn ends(a: &Plan, b: &Plan) -> Vec<String> {
    let in_b = by_name(b);
    let planned = |it: &DronePlan| !a.is_unplanned(&it.name) && !b.is_unplanned(&it.name);
    let both = a.drones.iter().filter(|it| planned(it));
    let both = both.filter_map(|it| Some((it, *in_b.get(&it.name[..])?)));
    let end_m = |it: &DronePlan| it.trajectory.position_m.last().copied();
    let both: Vec<_> = (both.filter_map(|(a, b)| Some((&a.name, end_m(a)?, end_m(b)?)))).collect();
    let taken = |end_m: &Point3<f64>| {
        let mut ends = both.iter().map(|it| it.2);
        ends.any(|it| (it - end_m).norm() <= SAME_PLACE_M)
    };
    if both.iter().all(|it| taken(&it.1)) {
        return Vec::new();
    }
    let apart = both.iter().filter(|it| (it.1 - it.2).norm() > SAME_PLACE_M);
    apart.map(|it| it.0.clone()).collect()
}

fn by_name(plan: &Plan) -> BTreeMap<&str, &DronePlan> {
    let drones = plan.drones.iter();
    drones.map(|it| (&it.name[..], it)).collect()
}

/// Starts nearer than this are one (m): chosen here, what rounding to millimetres makes of one.
const SAME_PLACE_M: f64 = 1e-3;

fn quoted(name: &String) -> String {
    format!("`{name}`")
}

/// Without what follows from the rest.
fn airframe(drone: &DronePlan) -> AirframeEntry {
    AirframeEntry {
        hover_induced_velocity_mps: 0.0,
        ..drone.airframe.clone()
    }
}

/// What one plan keeps, and how it does.
#[derive(Serialize)]
struct Figures {
    scenario: String,
    drones: usize,
    unplanned: usize,
    violations: usize,
    makespan_s: f64,
    sum_of_arrivals_s: f64,
    extra_energy_j: f64,
    /// Highest alpha over its drone's limit.
    worst_over_limit: Option<f64>,
    closest_gap_m: Option<f64>,
    /// How late the drone may be that may be least.
    least_late_s: Option<f64>,
    zone_air_mps: Option<f64>,
    /// What is asked for.
    air_limits: (f64, f64),
    time_margin_s: f64,
    tracking_m: f64,
    clearance_m: Option<f64>,
    /// Of the search, where the plan says so.
    cell_m: Option<f64>,
    is_smooth: bool,
    /// `T1 + T2` of the airframe that takes longest to change its velocity, where motion is smooth.
    longest_kernel_s: Option<f64>,
    convection: Option<[f64; 2]>,
    superposition: String,
}

#[derive(Serialize)]
struct Both {
    drone: String,
    arrives_s: [f64; 2],
}

fn figures(plan: &Plan, found: &Examination) -> Figures {
    let limits = plan.drones.iter().map(|it| it.air_limit);
    let late = found.late.iter().flatten().map(|it| it.late_s);
    let zones = found.plan.zone_air.iter().map(|it| it.worst_air_mps);
    Figures {
        scenario: plan.scenario.clone(),
        drones: plan.drones.len(),
        unplanned: plan.unplanned.len(),
        violations: found.plan.violations.len() + found.omitted,
        makespan_s: found.plan.fleet.makespan_s,
        sum_of_arrivals_s: found.plan.fleet.sum_of_arrivals_s,
        extra_energy_j: found.plan.fleet.extra_energy_j,
        worst_over_limit: found.worst_air.as_ref().map(|it| it.alpha / it.limit),
        closest_gap_m: found.closest.as_ref().map(|it| it.gap_m),
        least_late_s: late.reduce(f64::min),
        zone_air_mps: zones.reduce(f64::max),
        air_limits: limits.fold((f64::INFINITY, 0.0), |(low, high), it| {
            (low.min(it), it.max(high))
        }),
        time_margin_s: plan.margins.time_s,
        tracking_m: plan.margins.tracking_m,
        clearance_m: plan.clearance_m,
        cell_m: plan.cell_m,
        longest_kernel_s: plan.drones.iter().filter_map(kernel_s).reduce(f64::max),
        is_smooth: plan.drones.iter().any(|it| it.trajectory.is_smooth()),
        convection: plan.convection().map(|it| it.factors()),
        superposition: plan.air.superposition.clone(),
    }
}

/// `T1 + T2` (s) of a drone that flies smoothly within stated limits.
fn kernel_s(drone: &DronePlan) -> Option<f64> {
    let of = &drone.airframe;
    let limits = of.max_acceleration_mps2.zip(of.max_jerk_mps3);
    let (acceleration, jerk) = limits.filter(|_| drone.trajectory.is_smooth())?;
    Some(2.0 * Kernel::new(of.max_speed_mps, acceleration, jerk).half_s())
}

/// Exit codes: 0 both are without violations, and all drones planned; 1: one is not.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let read = |path: &PathBuf| Source::one(path, None, None).read().map(|it| it.file);
    let (a, b) = (read(&arguments.a)?, read(&arguments.b)?);
    let (found_a, found_b) = (examine(&a, true), examine(&b, true));
    let arrivals = |found: &Examination| -> BTreeMap<String, f64> {
        let of = |it: &DronePlan| (it.name.clone(), it.arrives_s);
        let mut all: BTreeMap<String, f64> = found.plan.drones.iter().map(of).collect();
        for left in &found.plan.unplanned {
            all.remove(&left.name);
        }
        all
    };
    let (in_a, in_b) = (arrivals(&found_a), arrivals(&found_b));
    let both = in_a.iter().filter_map(|(drone, a_s)| {
        Some(Both {
            drone: drone.clone(),
            arrives_s: [*a_s, *in_b.get(drone)?],
        })
    });
    let mut drones: Vec<Both> = both.collect();
    let apart_s = |it: &Both| (it.arrives_s[1] - it.arrives_s[0]).abs();
    drones.sort_by(|x, y| apart_s(y).total_cmp(&apart_s(x)));
    let alone = |one: &BTreeMap<String, f64>, other: &BTreeMap<String, f64>| {
        let names = one.keys().filter(|name| !other.contains_key(*name));
        names.cloned().collect()
    };
    let compared = Compared {
        planned_in_a_alone: alone(&in_a, &in_b),
        planned_in_b_alone: alone(&in_b, &in_a),
        a: figures(&a.plan, &found_a),
        b: figures(&b.plan, &found_b),
        differs: Differs::of(&a.plan, &b.plan),
        drones,
    };
    let good = |it: &Figures| it.violations == 0 && it.unplanned == 0;
    let report = report(arguments, &compared);
    let stem = |path: &PathBuf| {
        let folder = path
            .parent()
            .and_then(|it| it.file_name())
            .filter(|_| path.file_stem().is_some_and(|it| it == "plan"));
        folder
            .or(path.file_stem())
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let name = format!("{}-{}", stem(&arguments.a), stem(&arguments.b));
    let json = ("comparison.json", 2, "comparison/1");
    arguments
        .wanted
        .deliver((&name, &report), json, &compared)?;
    Ok(Answer::from(good(&compared.a) && good(&compared.b)))
}

/// How much more the second is, of the first's size (percent); of nothing there is no part.
fn percent([a, b]: [f64; 2]) -> Option<f64> {
    (a != 0.0).then(|| 100.0 * (b - a) / a.abs())
}

fn report(arguments: &Arguments, compared: &Compared) -> Report {
    let (a, b) = (&compared.a, &compared.b);
    let mut report = Report::new(
        format!("{} and {}", arguments.a.display(), arguments.b.display()),
        format!("A: {}, B: {}", a.scenario, b.scenario),
    );
    let mut differs = Part::list(compared.differs.lines());
    if !differs.is_empty() {
        let what = "These are plans of different scenarios: what one costs more may come of that.";
        differs.insert(0, Part::line(what));
    }
    report.section("Not the same scenario", differs);
    let number = |what: &str, of: &dyn Fn(&Figures) -> Option<f64>, decimals: usize| {
        // Whole numbers have no idle zeros.
        let figure = |it: f64| match decimals {
            0 => format!("{it:.0}"),
            _ => shortest(it, decimals),
        };
        let told = |it: Option<f64>| it.map_or("-".to_owned(), figure);
        let (in_a, in_b) = (of(a), of(b));
        let change = in_a.zip(in_b).filter(|(a, b)| a != b).map(|(a, b)| {
            let part = percent([a, b]).map_or(String::new(), |it| format!(" ({it:+.1} %)"));
            let sign = if b > a { "+" } else { "" };
            format!("{sign}{}{part}", figure(b - a))
        });
        vec![
            what.to_owned(),
            told(in_a),
            told(in_b),
            change.unwrap_or_default(),
        ]
    };
    let word = |what: &str, of: &dyn Fn(&Figures) -> &str| {
        let (in_a, in_b) = (of(a), of(b));
        let change = if in_a == in_b { "" } else { "another" };
        [what, in_a, in_b, change].map(str::to_owned).into()
    };
    let rows = vec![
        number("drones", &|it| Some(it.drones as f64), 0),
        number("unplanned", &|it| Some(it.unplanned as f64), 0),
        number("violations", &|it| Some(it.violations as f64), 0),
        number("makespan (s)", &|it| Some(it.makespan_s), 2),
        number("sum of costs (s)", &|it| Some(it.sum_of_arrivals_s), 2),
        number("energy by downwash (J)", &|it| Some(it.extra_energy_j), 1),
        number(
            "worst air, as a share of its limit",
            &|it| it.worst_over_limit,
            3,
        ),
        number("strongest air in a zone (m/s)", &|it| it.zone_air_mps, 2),
        number("closest bodies (m)", &|it| it.closest_gap_m, 3),
        number("least time margin (s)", &|it| it.least_late_s, 2),
    ];
    let mut come_to = vec![Part::table("lrrl", "|A|B|B against A", rows)];
    let alone = [
        ("A", &compared.planned_in_a_alone),
        ("B", &compared.planned_in_b_alone),
    ];
    for (plan, names) in alone.into_iter().filter(|(_, names)| !names.is_empty()) {
        let listed = first_few(names.iter().map(quoted), MOST_LISTED, ", ");
        come_to.push(Part::Line(format!("Planned in {plan} alone: {listed}.")));
    }
    if come_to.len() > 1 {
        let of_both = |k: usize| -> f64 { compared.drones.iter().map(|it| it.arrives_s[k]).sum() };
        come_to.push(Part::Line(format!(
            "Sums are over the drones that each plans. Of those planned in both the sum of costs is {:.2} s in A, {:.2} s in B.",
            of_both(0),
            of_both(1)
        )));
    }
    report.section("What they come to", come_to);
    let convection = |it: &Figures, end: usize| it.convection.map(|it| it[end]);
    let rows = vec![
        number("lowest air limit (alpha)", &|it| Some(it.air_limits.0), 3),
        number("highest air limit (alpha)", &|it| Some(it.air_limits.1), 3),
        number("time margin (s)", &|it| Some(it.time_margin_s), 3),
        number("tracking margin (m)", &|it| Some(it.tracking_m), 3),
        number("clearance (m)", &|it| it.clearance_m, 3),
        number("cells (m)", &|it| it.cell_m, 3),
        number(
            "smooth motion (1: yes)",
            &|it| Some(f64::from(u8::from(it.is_smooth))),
            0,
        ),
        number(
            "slowest change of velocity (s)",
            &|it| it.longest_kernel_s,
            2,
        ),
        number(
            "slowest air over the centreline's",
            &|it| convection(it, 0),
            2,
        ),
        number(
            "fastest air over the centreline's",
            &|it| convection(it, 1),
            2,
        ),
        word("superposition of wakes", &|it| &it.superposition),
    ];
    report.section(
        "What they keep",
        vec![Part::table("lrrl", "|A|B|B against A", rows)],
    );
    let rows = compared.drones.iter().take(MOST_LISTED).map(|it| {
        let [a_s, b_s] = it.arrives_s;
        vec![
            it.drone.clone(),
            format!("{a_s:.2}"),
            format!("{b_s:.2}"),
            format!("{:+.2}", b_s - a_s),
        ]
    });
    report.section(
        "Arrivals that differ most",
        vec![Part::table("lrrr", "drone|A (s)|B (s)|B - A (s)", rows)],
    );
    let mut points: Vec<(f64, f64)> = compared
        .drones
        .iter()
        .map(|it| it.arrives_s.into())
        .collect();
    points.sort_by(|x, y| x.0.total_cmp(&y.0));
    let title = (
        "Arrivals in B over arrivals in A",
        "by drone, in order of A",
    );
    let caption = "Each mark is a drone that both plan.";
    let figure = curves::draw(
        "arrivals",
        (title, caption),
        "arrives in A (s)",
        &[("arrives in B (s)", points)],
    );
    report.section("", figure.into_iter().map(Part::Figure).collect());
    report
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_is_more_whatever_the_sign_of_the_first() {
        assert_eq!(percent([-2.0, -1.0]), Some(50.0));
        assert_eq!(percent([-2.0, 3.0]), Some(250.0));
        assert_eq!(percent([2.0, 1.0]), Some(-50.0));
        assert_eq!(percent([0.0, 1.0]), None);
    }
}
