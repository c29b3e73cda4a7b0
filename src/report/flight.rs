//! A flight in words: drones with too much air, contacts, the benefit of feed-forward.

use flight::feed_forward::FeedForward;
use flight::paper::{Paper, PaperRow};
use flight::report::{Case, DroneFlight, Flight, FlightReport};

use super::sections::{Figure, Part, Report};
use super::words::{LIST_ALL_UP_TO, LIST_MOST, cell, count, first_few, joined, shortest};

/// How many are named in a line: chosen here.
const NAME_UP_TO: usize = 8;

/// What became of a plan.
pub(crate) fn report(name: &str, flown: &FlightReport, figure: Option<Figure>) -> Report {
    let mut report = Report::new(heading(name, flown), setting(flown));
    report.section("", drones(flown));
    report.section("Flights", flights(flown));
    report.section("", verdict(flown).into_iter().map(Part::Line).collect());
    report.section("Over time", figure.map(Part::Figure).into_iter().collect());
    let vehicles = flown.vehicles.iter().map(|it| {
        let v = &it.vehicle;
        let battery = v.battery_wh.map(|wh| format!("{} Wh", shortest(wh, 3)));
        vec![
            it.airframe.clone(),
            shortest(v.thrust_to_weight, 2),
            format!("{} deg", shortest(v.max_tilt_deg, 1)),
            format!("{:.0} ms", 1e3 * v.motor_lag_s),
            format!("{:.0} ms", 1e3 * v.attitude_lag_s),
            format!("{} l²", shortest(v.drag_area_over_l2, 3)),
            format!("{} /s", shortest(v.rotor_drag_per_s, 3)),
            format!("{:?}", v.rotor),
            battery.unwrap_or_else(|| "not known".to_owned()),
        ]
    });
    let headings = "airframe | thrust/weight | tilt | motor lag | attitude lag | drag area | rotor drag | rotor | battery";
    let table = Part::table("lrrrrrrll", headings, vehicles).shortened(0);
    report.section("Vehicles", vec![table]);
    report
}

/// "hall: 200 drones flown for 58.2 s: 3 over their limit"
fn heading(name: &str, flown: &FlightReport) -> String {
    let drones = flown.flights.first().map_or(0, |it| it.fleet.flown);
    let most = |of: fn(&Flight) -> usize| flown.flights.iter().map(of).max().unwrap_or(0);
    let said = [
        (most(|it| it.fleet.over_limit), "over their limit of air"),
        (most(|it| it.fleet.touching), "touch"),
        (most(|it| it.fleet.in_obstacles), "in obstacles"),
    ];
    let said = said.into_iter().filter(|(some, _)| *some > 0);
    let said: Vec<String> = said.map(|(some, what)| format!("{some} {what}")).collect();
    let answer = match said.is_empty() {
        true => "within limits".to_owned(),
        false => joined(said, ", "),
    };
    let drones = count(drones, "drone", "drones");
    format!(
        "{name}: {drones} flown for {:.1} s: {answer}",
        flown.until_s
    )
}

fn setting(flown: &FlightReport) -> String {
    let gusts = match flown.gusts {
        none if none <= 0.0 => "no gusts".to_owned(),
        some => format!(
            "gusts {} of the centreline (seed {})",
            shortest(some, 3),
            flown.seed
        ),
    };
    let lean = if flown.lean {
        ", wakes lean with the thrust"
    } else {
        ""
    };
    format!("advected wakes, {gusts}{lean}; figures of a drone are the worst over the flights")
}

/// The flights without feed-forward, and those with the best that was flown.
fn pair(flown: &FlightReport) -> (Vec<&Flight>, Vec<&Flight>) {
    let of = |wanted: FeedForward| -> Vec<&Flight> {
        let all = flown.flights.iter();
        all.filter(|it| it.case.feed_forward == wanted).collect()
    };
    let known = [FeedForward::Late, FeedForward::Paper, FeedForward::Matched];
    let with = known.into_iter().map(of).find(|it| !it.is_empty());
    (of(FeedForward::None), with.unwrap_or_default())
}

/// The worst of one drone over some flights.
fn most(flights: &[&Flight], k: usize, of: impl Fn(&DroneFlight) -> f64) -> f64 {
    let values = flights.iter().map(|flight| of(&flight.drones[k]));
    values.fold(0.0, f64::max)
}

fn drones(flown: &FlightReport) -> Vec<Part> {
    let all: Vec<&Flight> = flown.flights.iter().collect();
    let (without, with) = pair(flown);
    let Some(first) = without.first() else {
        return Vec::new();
    };
    let mut listed: Vec<usize> = (0..first.drones.len()).collect();
    listed.retain(|&k| first.drones[k].flew);
    let flew = listed.len();
    if flew > LIST_ALL_UP_TO {
        let over = |k: usize| most(&all, k, |it| it.worst_alpha) - first.drones[k].air_limit;
        listed.sort_by(|&a, &b| over(b).total_cmp(&over(a)).then(a.cmp(&b)));
        listed.truncate(LIST_MOST);
    }
    let rows = listed.iter().map(|&k| {
        let drone = &first.drones[k];
        let worst = all.iter().map(|it| &it.drones[k]);
        let worst = worst.reduce(|a, b| if b.worst_alpha > a.worst_alpha { b } else { a });
        let worst = worst.unwrap_or(drone);
        let from = match (&worst.worst_from, worst.worst_at_s) {
            (Some(from), Some(at_s)) => format!(" ({from}, t={at_s:.1} s)"),
            _ => String::new(),
        };
        let claimed = drone.claimed_alpha;
        let over_s = most(&all, k, |it| it.over_limit_s);
        let millimetres = |flights: &[&Flight]| match flights {
            [] => "-".to_owned(),
            some => format!(
                "{:.0} mm",
                1e3 * most(some, k, |it| it.altitude_rms_by_air_m)
            ),
        };
        let extra = most(&all, k, |it| {
            let calm_j = it.energy_j - it.extra_energy_j;
            100.0 * it.extra_energy_j / calm_j.max(1e-9)
        });
        let battery = all.iter().filter_map(|it| it.drones[k].battery_percent);
        let battery = battery.reduce(f64::max);
        vec![
            drone.name.clone(),
            format!("{:.3}{from}", worst.worst_alpha),
            cell(claimed, 3),
            shortest(drone.air_limit, 3),
            if over_s > 0.0 {
                format!("{over_s:.2} s")
            } else {
                "-".to_owned()
            },
            format!("{:.2} m", most(&all, k, |it| it.tracking_max_m)),
            format!("{:.0} mm", 1e3 * most(&without, k, |it| it.altitude_rms_m)),
            millimetres(&without),
            millimetres(&with),
            format!("{:+.1} %", extra + 0.0),
            battery.map_or("-".to_owned(), |it| format!("{it:.1} %")),
        ]
    });
    let headings = "drone | worst alpha | plan | limit | over it | tracking | altitude RMS | by air | with feed-forward | extra energy | battery";
    let mut parts = vec![Part::table("llrrrrrrrrr", headings, rows)];
    if flew > listed.len() {
        let hidden = flew - listed.len();
        let more = format!("... and {hidden} more with less air; flight.json has them all");
        parts.push(Part::Line(more));
    }
    parts
}

fn flights(flown: &FlightReport) -> Vec<Part> {
    let rows = flown.flights.iter().map(|Flight { case, fleet, .. }| {
        let gap = |it: Option<f64>| it.map_or("over 2 m".to_owned(), |m| format!("{m:.2} m"));
        vec![
            words(case),
            fleet.over_limit.to_string(),
            format!("{:.2} s", fleet.longest_over_limit_s),
            format!("{:.3}", fleet.worst_alpha),
            fleet.touching.to_string(),
            gap(fleet.least_gap_m),
            fleet.in_obstacles.to_string(),
            gap(fleet.least_obstacle_gap_m),
            format!("{:.2} m", fleet.tracking_max_m),
            format!("{:.2} m", fleet.across_max_m),
            format!("{:.0} mm", 1e3 * fleet.altitude_rms_m),
            format!("{:.1} mm", 1e3 * fleet.altitude_rms_by_air_m),
            format!("{:.1} J", fleet.extra_energy_j),
        ]
    });
    let headings = "flight | over limit | longest | worst alpha | touch | least gap | in obstacles | least gap | tracking | across | altitude RMS | by air | extra energy";
    vec![Part::table("lrrrrrrrrrrrr", headings, rows)]
}

/// "px4, air 0.6, late feed-forward"
fn words(case: &Case) -> String {
    let known = match case.feed_forward {
        FeedForward::None => "no feed-forward".to_owned(),
        some => format!("{} feed-forward", some.as_str()),
    };
    format!(
        "{}, air {}, {known}",
        case.controller.as_str(),
        shortest(case.convection, 3)
    )
}

/// Names, not too many.
fn named(names: &[&str]) -> String {
    first_few(names.iter().map(|it| format!("`{it}`")), NAME_UP_TO, ", ")
}

/// Which drones are over a limit, which touch, which are in an obstacle, over all flights.
fn verdict(flown: &FlightReport) -> Vec<String> {
    let mut lines = Vec::new();
    if !flown.unplanned.is_empty() {
        let names: Vec<&str> = flown.unplanned.iter().map(String::as_str).collect();
        lines.push(format!(
            "Not planned, stays at its start: {}.",
            named(&names)
        ));
    }
    let worst = |is: &dyn Fn(&Flight, usize) -> bool| -> Vec<&str> {
        let Some(first) = flown.flights.first() else {
            return Vec::new();
        };
        let any = |&k: &usize| flown.flights.iter().any(|flight| is(flight, k));
        let names = (0..first.drones.len()).filter(any);
        names.map(|k| first.drones[k].name.as_str()).collect()
    };
    let over = worst(&|flight, k| flight.drones[k].over_limit_s > 0.0);
    if !over.is_empty() {
        let longest_s = flown.flights.iter().map(|it| it.fleet.longest_over_limit_s);
        lines.push(format!(
            "Over their limit, the longest for {:.2} s: {}.",
            longest_s.fold(0.0, f64::max),
            named(&over)
        ));
    }
    let pairs = flown.flights.iter().flat_map(|flight| &flight.drones);
    let touching = pairs.filter(|it| it.touches());
    let nearest = touching.min_by(|a, b| {
        let gap = |it: &DroneFlight| it.least_gap_m.unwrap_or(0.0);
        gap(a).total_cmp(&gap(b))
    });
    if let Some(drone) = nearest {
        let touching = worst(&|flight, k| flight.drones[k].touches());
        lines.push(format!(
            "Bodies touch: {}; deepest `{}` and `{}`, by {:.2} m at {:.1} s.",
            named(&touching),
            drone.name,
            drone.least_gap_to.as_deref().unwrap_or("another"),
            -drone.least_gap_m.unwrap_or(0.0),
            drone.least_gap_at_s.unwrap_or(0.0)
        ));
    }
    let inside = worst(&|flight, k| flight.drones[k].is_in_obstacle());
    if !inside.is_empty() {
        lines.push(format!(
            "In obstacles, or zones that keep bodies out: {}.",
            named(&inside)
        ));
    }
    if lines.is_empty() {
        lines.push("No drone is over its limit, none touches another or an obstacle.".to_owned());
    }
    lines.extend(feed_forward(flown));
    let empty = worst(&|flight, k| {
        flight.drones[k]
            .battery_percent
            .is_some_and(|it| it > 100.0)
    });
    if !empty.is_empty() {
        let empty = named(&empty);
        lines.push(format!("Warning: more than a full battery holds: {empty}."));
    }
    let vehicles = flown
        .vehicles
        .iter()
        .filter(|it| it.vehicle.battery_wh.is_none());
    let unknown: Vec<&str> = vehicles.map(|it| it.airframe.as_str()).collect();
    if !unknown.is_empty() {
        lines.push(format!(
            "Battery: the capacity of {} is not known; a file for --vehicles may say it.",
            joined(unknown, ", ")
        ));
    }
    lines
}

/// What feed-forward leaves of the altitude error that air causes.
fn feed_forward(flown: &FlightReport) -> Option<String> {
    let left = |wanted: FeedForward| -> Option<String> {
        let mut shares = Vec::new();
        for flight in flown
            .flights
            .iter()
            .filter(|it| it.case.feed_forward == wanted)
        {
            let none = flown.flights.iter().find(|it| {
                let (a, b) = (&it.case, &flight.case);
                a.feed_forward == FeedForward::None
                    && a.controller == b.controller
                    && a.convection == b.convection
            })?;
            let before_m = none.fleet.altitude_rms_by_air_m;
            let share = 100.0 * flight.fleet.altitude_rms_by_air_m / before_m;
            shares.push(match before_m > 0.0 {
                true => format!("{share:.0} %"),
                false => "- (no air)".to_owned(),
            });
        }
        shares
            .iter()
            .any(|it| it.ends_with('%'))
            .then(|| format!("{} leaves {}", wanted.as_str(), joined(shares, ", ")))
    };
    let told = [FeedForward::Paper, FeedForward::Late, FeedForward::Matched]
        .into_iter()
        .filter_map(left);
    let told: Vec<String> = told.collect();
    let what = "of the altitude RMS caused by air (flight by flight)";
    (!told.is_empty()).then(|| format!("Feed-forward {} {what}.", joined(told, "; ")))
}

/// The paper's own flight beside the paper's figures.
pub(crate) fn paper(found: &Paper) -> Report {
    let title = "A Kolibri passes below an Offboard 2: altitude error, mm RMS (mean)".to_owned();
    let lead = format!(
        "{} m/s, window of {} m to each side; gusts {}; no figure fitted but the gain where it says so",
        found.speed_mps,
        found.window_m,
        shortest(found.gusts, 3)
    );
    let mut report = Report::new(title, lead);
    let cell = |[rms_m, mean_m]: [f64; 2]| format!("{:.1} ({:+.1})", 1e3 * rms_m, 1e3 * mean_m);
    let mut rows: Vec<Vec<String>> = Vec::new();
    for of_one in found.rows.chunk_by(|a, b| a.rotor == b.rotor) {
        rows.push(vec![of_one[0].rotor.to_owned()]);
        let cells = |row: &PaperRow| -> Vec<String> {
            let figures = row.passes.iter().flat_map(|pass| {
                let ratio = format!("{:.2}", pass.with[0] / pass.without[0]);
                [cell(pass.without), cell(pass.with), ratio]
            });
            let named = [row.controller.clone(), row.feed_forward.to_owned()];
            named.into_iter().chain(figures).collect()
        };
        rows.extend(of_one.iter().map(cells));
    }
    let headings = "controller (K_p, K_v, K_i) | feed-forward | 1 m: without | with | ratio | 2 m: without | with | ratio";
    report.section("", vec![Part::table("llrrrrrr", headings, rows)]);
    let lines = found.notes.iter().cloned().map(Part::Line).collect();
    report.section("", lines);
    report
}
