//! A plan as people read it: which drone arrives when, what the others cost it, and what ignoring
//! downwash would have meant.

use planner::plan::{DronePlan, IgnoringDownwash, Plan, ZoneAir};
use planner::verify::lateness::LATEST_S;
use viewer::Bottlenecks;

use super::sections::{Part, Report};
use super::words::{LIST_ALL_UP_TO, LIST_MOST, count, decimal, joined, place, tally};
use crate::io::watch::Durations;

/// Less air than this (m/s) prints as none: half of the last digit shown.
const NO_AIR_MPS: f64 = 0.05;

/// Waits of all drones together below this are not reported (s): chosen here.
const TELL_WAITS_FROM_S: f64 = 1.0;

/// Which drone arrives when, exposed to what, and how the fleet does.
pub(crate) fn report(
    plan: &Plan,
    durations: &Durations,
    improved_s: Option<f64>,
    bottlenecks: &Bottlenecks,
) -> Report {
    let mut report = Report::new(heading(plan), String::new());
    report.section("", table(plan));
    let mut lines = vec![summary(plan, durations)];
    if plan.drones.len() > LIST_ALL_UP_TO && plan.violations.is_empty() {
        let told = format!(
            "told for up to {LIST_ALL_UP_TO} drones; plan check --format json tells it for any"
        );
        lines.push(format!("How late each drone may be is {told}."));
    }
    lines.extend(zones(plan));
    lines.extend(waits(bottlenecks));
    lines.extend(improved_s.map(|improved_s| improved(plan, improved_s)));
    let ignoring = plan.ignoring_downwash.as_ref();
    if ignoring.is_some() || !durations.ignoring_downwash.is_zero() {
        lines.push(contrast(ignoring));
    }
    report.section("", lines.into_iter().map(Part::Line).collect());
    report
}

/// "warehouse: 12 drones (8 kolibri, 4 offboard-1), 30 x 20 x 8 m, 9 obstacles"
fn heading(plan: &Plan) -> String {
    let airframes = plan.drones.iter().map(|drone| &drone.airframe.name);
    let kinds = tally(airframes).into_iter();
    let kinds = kinds.map(|(kind, number)| format!("{number} {kind}"));
    let size = plan.bounds_m.max - plan.bounds_m.min;
    let mut text = format!(
        "{}: {} ({}), {} x {} x {} m",
        plan.scenario,
        count(plan.drones.len(), "drone", "drones"),
        joined(kinds, ", "),
        decimal(size.x),
        decimal(size.y),
        decimal(size.z)
    );
    if !plan.obstacles.is_empty() {
        text += &format!(", {}", count(plan.obstacles.len(), "obstacle", "obstacles"));
    }
    if !plan.zones.is_empty() {
        text += &format!(", {}", count(plan.zones.len(), "zone", "zones"));
    }
    let effects = plan.flown_effects();
    if !effects.is_empty() {
        text += &format!(", air with {}", effects.join(", "));
    }
    text
}

fn table(plan: &Plan) -> Vec<Part> {
    let listed = most_affected_first(plan);
    let rows = listed.iter().map(|drone| cells(plan, drone));
    let headings = "drone | arrives | waits | detour | worst downwash | extra energy";
    let mut parts = match plan.drones.iter().any(|it| it.may_be_late_s.is_some()) {
        true => vec![Part::table(
            "lrrrlrr",
            &format!("{headings} | may be late"),
            rows,
        )],
        false => vec![Part::table("lrrrlr", headings, rows)],
    };
    let hidden = plan.drones.len() - listed.len();
    if hidden > 0 {
        parts.push(Part::Line(format!(
            "... and {hidden} more, delayed less; plan.json has them all"
        )));
    }
    parts
}

/// All drones in the scenario's order; of a large fleet those unplanned and those delayed most,
/// most delayed first, ties by extra energy, then in the scenario's order.
fn most_affected_first(plan: &Plan) -> Vec<&DronePlan> {
    if plan.drones.len() <= LIST_ALL_UP_TO {
        return plan.drones.iter().collect();
    }
    let delay_s = |drone: &DronePlan| match plan.is_unplanned(&drone.name) {
        true => f64::INFINITY,
        false => drone.arrives_s - drone.alone_s,
    };
    let drones = plan.drones.iter().map(|drone| (delay_s(drone), drone));
    let mut drones: Vec<(f64, &DronePlan)> = drones.collect();
    drones.sort_by(|(delay_a, a), (delay_b, b)| {
        let later = delay_b.total_cmp(delay_a);
        later.then(b.extra_energy_percent.total_cmp(&a.extra_energy_percent))
    });
    let most = drones.into_iter().take(LIST_MOST);
    most.map(|(_, drone)| drone).collect()
}

fn cells(plan: &Plan, drone: &DronePlan) -> Vec<String> {
    let is_parked = drone.trajectory.t_s.len() == 1 && drone.arrives_s == 0.0;
    let [arrives, waits, detour, energy] = match plan.is_unplanned(&drone.name) {
        true => ["stays", "-", "-", "-"].map(str::to_owned),
        false => [
            match is_parked {
                true => "parked".to_owned(),
                false => format!("{:.1} s", drone.arrives_s),
            },
            format!("{:.1} s", positive_zero(drone.waits_s)),
            format!("{:+.1} m", positive_zero(drone.detour_m)),
            format!("{:+.1} %", positive_zero(drone.extra_energy_percent)),
        ],
    };
    let late = drone.may_be_late_s.map(|late_s| match late_s < LATEST_S {
        true => format!("{late_s:.2} s"),
        false => format!("{LATEST_S:.0} s+"),
    });
    let name = drone.name.clone();
    let cells = [name, arrives, waits, detour, air(drone), energy];
    cells.into_iter().chain(late).collect()
}

/// "0.2 m/s (m1, t=7.1 s)"
fn air(drone: &DronePlan) -> String {
    if drone.worst_air_mps < NO_AIR_MPS {
        return "none".into();
    }
    let from = drone.worst_air_from.as_deref().unwrap_or("several");
    let when = drone.worst_air_at_s.iter();
    let when: String = when.map(|at_s| format!(", t={at_s:.1} s")).collect();
    format!("{:.1} m/s ({from}{when})", drone.worst_air_mps)
}

/// What rounds to zero loses its minus.
fn positive_zero(value: f64) -> f64 {
    if value.abs() < 0.05 { 0.0 } else { value }
}

fn summary(plan: &Plan, durations: &Durations) -> String {
    let fleet = plan.drones.len();
    format!(
        "{} of {fleet} reach their goals   makespan {:.1} s   planned in {:.2} s   verified: {}",
        fleet - plan.unplanned.len(),
        plan.fleet.makespan_s,
        durations.planning.as_secs_f64(),
        count(plan.violations.len(), "violation", "violations")
    )
}

/// The highest air of each zone that limits it, and the bodies that pass through.
fn zones(plan: &Plan) -> Vec<String> {
    let line = |zone: &ZoneAir| {
        let from = zone.worst_air_from.as_deref().zip(zone.worst_air_at_s);
        let from = from.map(|(from, at_s)| format!(" ({from}, t={at_s:.1} s)"));
        let air = match zone.worst_air_mps < NO_AIR_MPS {
            true => "no downwash".to_owned(),
            false => {
                let from = from.unwrap_or_default();
                let found = format!("{:.1} m/s", zone.worst_air_mps);
                let most = zone.at_most_mps.map(|mps| format!("{mps:.1} m/s"));
                match most.filter(|most| *most != found) {
                    Some(most) => format!("at most {most}; {found} found{from}"),
                    None => format!("at most {found}{from}"),
                }
            }
        };
        let (flying, staying): (Vec<_>, Vec<_>) =
            zone.entered_by.iter().partition(|name| moves(plan, name));
        let of = |names: &[&String], verbs: [&str; 2]| match *names {
            [] => None,
            [one] => Some(format!("`{one}` {}", verbs[0])),
            [one, ref more @ ..] => Some(format!("`{one}` and {} more {}", more.len(), verbs[1])),
        };
        let through = of(&flying, ["flies through it", "fly through it"]);
        let inside = of(&staying, ["is in it", "are in it"]);
        let bodies = joined(through.into_iter().chain(inside), ", ");
        let bodies = match bodies.is_empty() {
            true => bodies,
            false => format!("; {bodies}: where there are people, write keep_out: true"),
        };
        format!("Zone {}: {air}{bodies}.", zone.zone)
    };
    plan.zone_air.iter().map(line).collect()
}

/// Whether a drone is ever elsewhere than at its start.
fn moves(plan: &Plan, name: &str) -> bool {
    let drone = plan.drone(name);
    let places_m = drone.map_or(&[][..], |it| &it.trajectory.position_m);
    places_m.iter().any(|place_m| *place_m != places_m[0])
}

/// For which drones and where drones wait most.
fn waits(bottlenecks: &Bottlenecks) -> Option<String> {
    // Without a place drones only hold their goals until a time.
    if bottlenecks.waits_s < TELL_WAITS_FROM_S || bottlenecks.places.is_empty() {
        return None;
    }
    let of = |drones: usize, waits_s: f64| {
        let drones = count(drones, "drone", "drones");
        format!("{waits_s:.1} s, {drones}")
    };
    let drones = bottlenecks.drones.iter();
    let drones = drones.map(|it| format!("`{}` ({})", it.name, of(it.drones, it.waits_s)));
    let drones = match joined(drones, ", ") {
        none if none.is_empty() => "no one drone".to_owned(),
        some => some,
    };
    let places = bottlenecks.places.iter();
    let places = places.map(|it| format!("{} ({})", place(&it.at_m), of(it.drones, it.waits_s)));
    let waits_s = bottlenecks.waits_s;
    let places = joined(places, ", ");
    Some(format!(
        "Waits: {waits_s:.1} s in all, most for {drones}; most at {places}."
    ))
}

/// What improving a complete plan was good for.
fn improved(plan: &Plan, improved_s: f64) -> String {
    // Less than is printed is none.
    if improved_s < 0.05 {
        return "No better plan was found.".into();
    }
    let sum_s = plan.fleet.sum_of_arrivals_s;
    format!(
        "Improved: sum of costs {improved_s:.1} s lower ({:.1} %), {sum_s:.1} s now.",
        100.0 * improved_s / (sum_s + improved_s)
    )
}

/// What the same fleet would be exposed to if its paths ignored downwash.
pub(crate) fn contrast(ignoring: Option<&IgnoringDownwash>) -> String {
    let Some(ignoring) = ignoring else {
        return "Ignoring downwash: not known, the second plan was not made.".into();
    };
    let (air_mps, zone_mps) = (ignoring.worst_air_mps, ignoring.worst_zone_air_mps);
    let mut harm = Vec::new();
    if ignoring.drones_over_limit > 0 {
        let drones = count(ignoring.drones_over_limit, "drone is", "drones are");
        harm.push(format!("{drones} exposed to up to {air_mps:.1} m/s"));
    }
    if ignoring.zones_over_limit > 0 {
        let zones = count(ignoring.zones_over_limit, "zone", "zones");
        harm.push(format!("the air in {zones} reaches {zone_mps:.1} m/s"));
    }
    let harm = match harm.is_empty() {
        true => {
            format!("and no drone would exceed its limit (worst downwash {air_mps:.1} m/s)")
        }
        false => format!("but {}", harm.join(", and ")),
    };
    let without = match ignoring.unplanned {
        0 => String::new(),
        some => {
            let drones = count(some, "drone finds", "drones find");
            format!(" {drones} no path even so.")
        }
    };
    let makespan_s = ignoring.makespan_s;
    format!("Ignoring downwash: makespan {makespan_s:.1} s, {harm}.{without}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests as sample;
    use std::time::Duration;

    fn durations() -> Durations {
        Durations {
            planning: Duration::from_millis(310),
            ..Durations::default()
        }
    }

    #[test]
    fn a_small_fleet_is_listed_whole_in_its_order_with_the_contrast_below() {
        let text = report(
            &sample::warehouse(),
            &durations(),
            None,
            &Bottlenecks::default(),
        )
        .text();
        let expected = "\
sample: 4 drones (2 kolibri, 2 matrice-300), 30 x 20 x 8 m, 3 obstacles, 1 zone

  drone  arrives  waits  detour  worst downwash         extra energy
  k1      18.4 s  0.0 s  +0.6 m  0.2 m/s (m1, t=7.1 s)        +0.1 %
  k2      23.0 s  2.0 s  +0.0 m  none                         +0.0 %
  m1      12.0 s  0.0 s  +0.0 m  none                         +0.0 %
  m2       stays      -       -  none                              -

  3 of 4 reach their goals   makespan 23.0 s   planned in 0.31 s   verified: 0 violations
  Ignoring downwash: makespan 20.0 s, but 2 drones are exposed to up to 6.1 m/s.
";
        assert_eq!(text, expected);
    }

    #[test]
    fn of_a_large_fleet_the_most_delayed_are_listed_and_the_rest_counted() {
        let text = report(
            &sample::hall(200),
            &durations(),
            Some(3.5),
            &Bottlenecks::default(),
        )
        .text();
        assert_eq!(
            text.lines().filter(|line| line.starts_with("  d")).count(),
            LIST_MOST + 1
        );
        assert!(text.contains("... and 185 more, delayed less"), "{text}");
        let better = "sum of costs 3.5 s lower";
        assert!(text.contains(better), "{text}");
        let plan = sample::hall(200);
        assert_eq!(improved(&plan, 0.04), improved(&plan, 0.0));
    }

    #[test]
    fn where_no_drone_would_be_exposed_the_contrast_says_so() {
        let harmless = IgnoringDownwash {
            makespan_s: 8.0,
            drones_over_limit: 0,
            worst_air_mps: 0.4,
            zones_over_limit: 0,
            worst_zone_air_mps: 0.0,
            unplanned: 1,
        };
        assert_eq!(
            contrast(Some(&harmless)),
            "Ignoring downwash: makespan 8.0 s, and no drone would exceed its limit (worst downwash 0.4 m/s). 1 drone finds no path even so."
        );
        assert!(contrast(None).starts_with("Ignoring downwash: "));
    }

    #[test]
    fn a_zone_is_reported_with_its_air_and_with_the_bodies_that_pass_through() {
        let mut plan = sample::warehouse();
        let air = |entered_by: &[&str]| ZoneAir {
            zone: "desk".into(),
            worst_air_mps: 0.94,
            at_most_mps: None,
            worst_air_from: Some("m1".into()),
            worst_air_at_s: Some(7.1),
            entered_by: entered_by.iter().map(|name| (*name).to_owned()).collect(),
        };
        plan.zone_air = vec![air(&[])];
        assert_eq!(zones(&plan), ["Zone desk: at most 0.9 m/s (m1, t=7.1 s)."]);
        plan.zone_air[0].at_most_mps = Some(0.97);
        let told = "Zone desk: at most 1.0 m/s; 0.9 m/s found (m1, t=7.1 s).";
        assert_eq!(zones(&plan), [told]);
        plan.zone_air = vec![air(&["k1", "k2"])];
        let told = &zones(&plan)[0];
        assert!(told.ends_with(
            "; `k1` and 1 more fly through it: where there are people, write keep_out: true."
        ));
        // It stands where it is all the time.
        plan.zone_air = vec![air(&["k1", "m2"])];
        let told = &zones(&plan)[0];
        assert!(told.ends_with(
            "; `k1` flies through it, `m2` is in it: where there are people, write keep_out: true."
        ));
    }

    #[test]
    fn a_zone_above_its_limit_is_part_of_the_contrast() {
        let gusty = IgnoringDownwash {
            makespan_s: 8.0,
            drones_over_limit: 2,
            worst_air_mps: 4.0,
            zones_over_limit: 1,
            worst_zone_air_mps: 6.5,
            unplanned: 0,
        };
        assert_eq!(
            contrast(Some(&gusty)),
            "Ignoring downwash: makespan 8.0 s, but 2 drones are exposed to up to 4.0 m/s, and the air in 1 zone reaches 6.5 m/s."
        );
    }
}
