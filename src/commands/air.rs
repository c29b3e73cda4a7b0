//! `plan air AIRFRAME`: the air that a hovering drone makes.

use std::ops::RangeInclusive;

use airflow::{Air, Airframe, Jet, Wake};
use clap::Args;
use nalgebra::Vector3;
use serde::Serialize;

use crate::commands::answers::Wanted;
use crate::commands::{ABOVE_0, number};
use crate::io::answer::Answer;
use crate::io::failure::Failure;
use crate::plots::map::{self, Map};
use crate::report::sections::{Part, Report};

/// Depths of the table, in motor distances: from the near field to where little is left.
const DEPTHS_L: [f64; 9] = [1.0, 2.5, 5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0];
/// Depths at which the width is looked at for its widest, distances from the axis at which the
/// farthest air is looked for, and points of a drawn line: chosen here, each step is half a
/// percent.
const STEPS: usize = 200;
/// Speed of the slowest air that carries a wake down over the centreline's: that of large eddies
/// (docs/formats.md, `convection`).
const SLOWEST: f64 = 0.6;

/// What can be asked for (m/s): slower air is that of any room.
const BEARABLE_MPS: RangeInclusive<f64> = 0.01..=100.0;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Airframe, by its preset's name
    #[arg(value_name = "AIRFRAME")]
    airframe: String,
    /// Mass with payload [default: the airframe's]
    #[arg(long, value_name = "KG", value_parser = number(ABOVE_0..=1e4, "kg"), allow_negative_numbers = true)]
    mass: Option<f64>,
    /// What a person or a sensor bears (m/s)
    #[arg(long, value_name = "M/S", default_value_t = 1.0, value_parser = number(BEARABLE_MPS, "m/s"), allow_negative_numbers = true)]
    less_than: f64,
    #[command(flatten)]
    wanted: Wanted,
}

/// `air/1`.
#[derive(Serialize)]
struct AirAnswer {
    airframe: String,
    mass_kg: f64,
    motor_distance_m: f64,
    hover_induced_velocity_mps: f64,
    near_field: Column,
    /// What `quiet` is about (m/s).
    less_than_mps: f64,
    quiet: Quiet,
    rows: Vec<DepthRow>,
}

#[derive(Serialize)]
struct Column {
    radius_m: f64,
    depth_m: f64,
}

/// Where and when the axial speed is less than asked for.
#[derive(Serialize)]
struct Quiet {
    /// From this depth on everywhere (m).
    below_m: f64,
    /// From this distance to the axis on at every depth (m).
    beside_m: f64,
    /// The depth at which that is (m).
    beside_at_m: f64,
    /// So long after the drone has left, at every depth (s).
    after_s: f64,
}

#[derive(Serialize)]
struct DepthRow {
    depth_m: f64,
    /// On the axis; `null`: within the near field, whose jets are four.
    centreline_mps: Option<f64>,
    /// Where the speed is half of that on the axis.
    half_width_m: f64,
    /// Within this distance to the axis it is more than asked for.
    quiet_beside_m: f64,
    /// How long air is under way to here: at the centreline's speed, and at that of large eddies.
    arrives_s: [f64; 2],
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let airframe = Airframe::named(&arguments.airframe)?;
    let density_kg_per_m3 = Air::default().density_kg_per_m3();
    let mass_kg = arguments.mass.unwrap_or(airframe.mass_kg());
    let wake = Wake::new(&airframe, mass_kg, density_kg_per_m3, &Jet::default());
    let length_m = airframe.motor_distance_m();
    let limit_mps = arguments.less_than;
    let end_m = wake.iso_speed_end_m(limit_mps);
    let beside_m = |depth_m: f64| beside_m(&wake, depth_m, limit_mps);
    let depths =
        (1..=STEPS).map(|k| end_m.max(wake.near_field_depth_m()) * k as f64 / STEPS as f64);
    let widest = depths.map(|depth_m| (beside_m(depth_m), depth_m));
    let widest = widest.fold((0.0, 0.0), |most, it| if it.0 > most.0 { it } else { most });
    let far = wake.far_field();
    let row = |depth_l: f64| {
        let depth_m = depth_l * length_m;
        DepthRow {
            depth_m,
            centreline_mps: wake.centreline_mps(depth_m),
            half_width_m: wake.half_width_m(depth_m),
            quiet_beside_m: beside_m(depth_m),
            arrives_s: [1.0, SLOWEST].map(|factor| far.transport_time_s(depth_m, factor)),
        }
    };
    let found = AirAnswer {
        airframe: airframe.name().to_owned(),
        mass_kg,
        motor_distance_m: length_m,
        hover_induced_velocity_mps: wake.induced_velocity_mps(),
        near_field: Column {
            radius_m: wake.column_radius_m(),
            depth_m: wake.near_field_depth_m(),
        },
        less_than_mps: limit_mps,
        quiet: Quiet {
            below_m: end_m,
            beside_m: widest.0,
            beside_at_m: widest.1,
            after_s: far.transport_time_s(end_m, SLOWEST),
        },
        rows: DEPTHS_L.map(row).into(),
    };
    let report = report(&found, &wake);
    let json = ("air.json", 2, "air/1");
    arguments
        .wanted
        .deliver((airframe.name(), &report), json, &found)?;
    Ok(Answer::Yes)
}

/// From which distance to the axis on the axial speed is below a limit (m/s), at a depth (m): by
/// halves of the last step that exceeds, along the rotors and between them.
fn beside_m(wake: &Wake, depth_m: f64, limit_mps: f64) -> f64 {
    if depth_m >= wake.near_field_depth_m() {
        return wake.radius_at_speed_m(depth_m, limit_mps).unwrap_or(0.0);
    }
    let exceeds = |offset_m: f64| {
        [0.0, 15.0, 30.0, 45.0_f64].iter().any(|azimuth_deg| {
            let (sin, cos) = azimuth_deg.to_radians().sin_cos();
            let at_m = Vector3::new(offset_m * cos, offset_m * sin, -depth_m);
            wake.axial_speed_mps(at_m) >= limit_mps
        })
    };
    let to_m = wake.reach_at_speed_m(depth_m, limit_mps);
    let last = (0..=STEPS)
        .rev()
        .map(|k| to_m * k as f64 / STEPS as f64)
        .find(|it| exceeds(*it));
    last.map_or(0.0, |it| it + to_m / STEPS as f64)
}

fn report(found: &AirAnswer, wake: &Wake) -> Report {
    let limit_mps = found.less_than_mps;
    let mut report = Report::new(
        format!("Air of {}", found.airframe),
        format!(
            "{:.3} kg, {:.3} m from motor to motor; hovers on {:.2} m/s through its rotors",
            found.mass_kg, found.motor_distance_m, found.hover_induced_velocity_mps
        ),
    );
    let quiet = &found.quiet;
    let Column { radius_m, depth_m } = found.near_field;
    let end_l = quiet.below_m / found.motor_distance_m;
    let beyond = match end_l > 60.0 {
        true => format!(
            " ({end_l:.0} motor distances: the jet's law carried on far beyond what was measured)"
        ),
        false => String::new(),
    };
    report.section("Where it is less than asked for", vec![Part::List(vec![
        format!("below: less than {limit_mps} m/s from {:.2} m down{beyond}", quiet.below_m),
        format!("beside: less than {limit_mps} m/s from {:.2} m off the axis at any depth (widest at {:.2} m)", quiet.beside_m, quiet.beside_at_m),
        format!("after: {:.1} s after the drone has left, or landed, its last air of that strength has passed all depths, carried by its slowest eddies ({SLOWEST} of the centreline's speed)", quiet.after_s),
    ])]);
    let rows = found.rows.iter().map(|row| {
        let [fast_s, slow_s] = row.arrives_s;
        let centreline = row.centreline_mps.map(|it| format!("{it:.2}"));
        [
            format!("{:.2}", row.depth_m),
            centreline.unwrap_or_else(|| "four jets".to_owned()),
            format!("{:.2}", row.half_width_m),
            format!("{:.2}", row.quiet_beside_m),
            format!("{fast_s:.2}"),
            format!("{slow_s:.2}"),
        ]
        .into()
    });
    let headings = format!(
        "below (m)|on the axis (m/s)|half-width (m)|less than {limit_mps} m/s beside (m)|arrives after (s)|at the latest (s)"
    );
    let mut down = vec![Part::table("rrrrrr", &headings, rows)];
    down.extend(wake.airframe().fit_note().map(Part::line));
    down.push(Part::line(wake.airframe().measured_note()));
    down.push(
        Part::line(format!(
            "The near field, down to {depth_m:.2} m and {radius_m:.2} m around the axis, is four jets that merge. Mean axial speed in still air, without floor or walls; gusts of about a quarter of the centreline's speed come on top. On a floor the air turns outwards: docs/limits.md."
        )),
    );
    report.section("Down the axis", down);
    let deep_m = (1.1 * quiet.below_m).clamp(4.0 * depth_m, 30.0 * found.motor_distance_m);
    let wide_m = 2.0 * (quiet.beside_m.max(radius_m)).min(deep_m / 2.0);
    let rim = (0..=STEPS).map(|k| deep_m * (k as f64 + 0.02) / STEPS as f64);
    let rim = rim.map(|z_m| [beside_m(wake, z_m, limit_mps), z_m]);
    let rim: Vec<[f64; 2]> = rim.filter(|it| it[0] > 0.0).collect();
    let title = format!("Air below {}, hovering", found.airframe);
    let line = format!("{limit_mps} m/s");
    let figure = map::draw(&Map {
        name: "air",
        title: (
            &title,
            "mean axial speed in a plane through the axis and two rotors",
        ),
        caption: "Inside the line the mean axial speed exceeds what was asked for.",
        reach_m: [wide_m, deep_m],
        value: &|depth_m, offset_m| {
            wake.axial_speed_mps(Vector3::new(offset_m * AXIS, offset_m * AXIS, -depth_m))
        },
        unit: "m/s",
        lines: vec![(&line, rim)],
    });
    report.section("", vec![Part::Figure(figure)]);
    report
}

/// Of x and y along a line through two rotors of a quadrotor.
const AXIS: f64 = std::f64::consts::FRAC_1_SQRT_2;
