//! `plan separation A --under B`: how far one drone must stay from the wake of another.

use airflow::separation::{Ellipsoid, Passage, Separation, SeparationExposure};
use airflow::{Air, Airframe, Jet, Wake};
use clap::Args;
use serde::Serialize;

use crate::commands::answers::Wanted;
use crate::commands::{ABOVE_0, number};
use crate::io::answer::Answer;
use crate::io::failure::Failure;
use crate::plots::map::{self, Map};
use crate::report::sections::{Part, Report};

/// Depths of the table, in motor distances of the upper drone: from its near field to where little
/// is left.
const DEPTHS_L: [f64; 9] = [1.0, 2.5, 5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0];
/// Points along a drawn line: chosen here.
const POINTS: usize = 120;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Airframe of the lower drone, by its preset's name
    #[arg(value_name = "LOWER")]
    lower: String,
    /// Airframe of the upper drone
    #[arg(long, value_name = "UPPER")]
    under: String,
    /// Mass of the lower drone with its payload [default: the airframe's]
    #[arg(long, value_name = "KG", value_parser = number(ABOVE_0..=1e4, "kg"), allow_negative_numbers = true)]
    mass: Option<f64>,
    /// Mass of the upper drone with its payload [default: the airframe's]
    #[arg(long, value_name = "KG", value_parser = number(ABOVE_0..=1e4, "kg"), allow_negative_numbers = true)]
    under_mass: Option<f64>,
    /// Highest mean air over the lower one's rotor discs, over its own induced velocity
    #[arg(long, value_name = "ALPHA", default_value_t = 0.3, value_parser = number(ABOVE_0..=1e4, ""), allow_negative_numbers = true)]
    limit: f64,
    /// Speed at which it passes below (m/s)
    #[arg(long, value_name = "M/S", default_value_t = 2.0, value_parser = number(ABOVE_0..=1e4, "m/s"), allow_negative_numbers = true)]
    speed: f64,
    #[command(flatten)]
    wanted: Wanted,
}

/// `separation/1`.
#[derive(Serialize)]
struct SeparationAnswer {
    lower: Drone,
    upper: Drone,
    /// Alpha.
    limit: f64,
    speed_mps: f64,
    /// From here on straight below the limit is kept, off the column and body from body (m).
    below_m: f64,
    /// From here on beside it is kept at every depth, off the column and body from body (m).
    beside_m: f64,
    /// The depth that asks for most room beside (m).
    beside_most_at_m: f64,
    /// No centre may be in it, whatever the air.
    column: Column,
    /// Half-axes about the upper drone's centre; a planner that takes one ellipsoid a drone takes
    /// half of each for either.
    ellipsoid: Ellipsoid,
    rows: Vec<SeparationRow>,
}

#[derive(Serialize)]
struct Drone {
    airframe: String,
    mass_kg: f64,
    hover_induced_velocity_mps: f64,
}

#[derive(Serialize)]
struct Column {
    radius_m: f64,
    depth_m: f64,
}

/// One depth.
#[derive(Serialize)]
struct SeparationRow {
    below_m: f64,
    #[serde(flatten)]
    met: SeparationExposure,
    /// From here on beside, at this depth, the limit is kept.
    beside_m: f64,
    passing: Passage,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let lower = Airframe::named(&arguments.lower)?;
    let upper = Airframe::named(&arguments.under)?;
    let density_kg_per_m3 = Air::default().density_kg_per_m3();
    let lower_kg = arguments.mass.unwrap_or(lower.mass_kg());
    let upper_kg = arguments.under_mass.unwrap_or(upper.mass_kg());
    let wake = Wake::new(&upper, upper_kg, density_kg_per_m3, &Jet::default());
    let pair = Separation::new(&lower, lower_kg, density_kg_per_m3, wake);
    let limit = arguments.limit;
    let bodies_m = lower.tip_radius_m() + upper.tip_radius_m();
    let (beside_m, beside_most_at_m) = pair.widest_m(limit);
    let column = Column {
        radius_m: pair.upper().column_radius_m(),
        depth_m: pair.upper().near_field_depth_m(),
    };
    let row = |depth_l: f64| {
        let below_m = depth_l * upper.motor_distance_m();
        SeparationRow {
            below_m,
            met: pair.met(below_m, 0.0),
            beside_m: pair.beside_m(limit, below_m),
            passing: pair.passage(below_m, arguments.speed, limit),
        }
    };
    let drone = |airframe: &Airframe, mass_kg: f64| Drone {
        airframe: airframe.name().to_owned(),
        mass_kg,
        hover_induced_velocity_mps: airframe.hover_induced_velocity_mps(mass_kg, density_kg_per_m3),
    };
    let found = SeparationAnswer {
        lower: drone(&lower, lower_kg),
        upper: drone(&upper, upper_kg),
        limit,
        speed_mps: arguments.speed,
        below_m: pair.below_m(limit, 0.0).max(column.depth_m).max(bodies_m),
        beside_m: beside_m.max(column.radius_m).max(bodies_m),
        beside_most_at_m,
        column,
        ellipsoid: pair.ellipsoid(limit, bodies_m),
        rows: DEPTHS_L.map(row).into(),
    };
    let name = format!("{}-under-{}", lower.name(), upper.name());
    let report = report(&found, (&pair, [&lower, &upper]), arguments.speed);
    let json = ("separation.json", 2, "separation/1");
    arguments.wanted.deliver((&name, &report), json, &found)?;
    Ok(Answer::Yes)
}

fn report(
    found: &SeparationAnswer,
    (pair, airframes): (&Separation, [&Airframe; 2]),
    speed_mps: f64,
) -> Report {
    let (lower, upper) = (&found.lower, &found.upper);
    let of = |it: &Drone| {
        format!(
            "{} ({:.3} kg, hovers on {:.2} m/s)",
            it.airframe, it.mass_kg, it.hover_induced_velocity_mps
        )
    };
    let mut report = Report::new(
        format!("{} under {}", lower.airframe, upper.airframe),
        format!(
            "{} below {}; limit: alpha {}",
            of(lower),
            of(upper),
            found.limit
        ),
    );
    let Column { radius_m, depth_m } = found.column;
    let answer = format!(
        "Keep {} at least {:.2} m straight below {}, or {:.2} m beside its axis at any depth; never in its near-field column.",
        lower.airframe, found.below_m, upper.airframe, found.beside_m
    );
    report.section("How far", vec![Part::line(answer), Part::List(vec![
        format!("straight below: from {:.2} m down it meets no more, is below the near-field column, and no bodies touch", found.below_m),
        format!("beside: from {:.2} m on it meets no more at any depth and no bodies touch (the air asks for most at {:.2} m below)", found.beside_m, found.beside_most_at_m),
        format!("never in the near-field column, whatever the air: {radius_m:.2} m around the axis down to {depth_m:.2} m below"),
        format!(
            "as one ellipsoid about the upper drone: half-axes {:.2} m beside, {:.2} m below; for planners that give each drone an ellipsoid (|E⁻¹Δ| ≥ 2): {:.2} m and {:.2} m",
            found.ellipsoid.beside_m, found.ellipsoid.below_m, found.ellipsoid.beside_m / 2.0, found.ellipsoid.below_m / 2.0
        ),
    ])]);
    let rows = found.rows.iter().map(|row| {
        let passing = &row.passing;
        let extra = (row.met.power - 1.0) * 100.0;
        [
            format!("{:.2}", row.below_m),
            format!("{:.2}", row.met.air_mps),
            format!("{:.3}", row.met.alpha),
            format!("+{extra:.1} %"),
            format!("{:.2}", row.beside_m),
            format!("{:.2}", passing.over_limit_s),
            format!("{:.2}", passing.dose_m),
            format!("{:.1}", passing.extra_energy_j),
        ]
        .into()
    });
    let headings =
        "below (m)|air (m/s)|alpha|power|beside (m)|over limit (s)|exposure (m)|energy (J)";
    let mut below = vec![Part::table("rrrrrrrrr", headings, rows)];
    let mut notes: Vec<String> = airframes.iter().filter_map(|it| it.fit_note()).collect();
    notes.dedup();
    below.extend(notes.into_iter().map(Part::line));
    below.push(Part::line(airframes[1].measured_note()));
    below.extend([
        Part::line(format!(
            "The first four columns: hovering straight below. Beside: where the limit is kept at that depth. The last three: passing through the axis at {speed_mps} m/s."
        )),
        Part::line("Mean flow in still air; gusts of about a quarter come on top, and the worst of all azimuths counts. The column's rule stands beside the air's."),
    ]);
    report.section("Straight below, and passing", below);
    let deep_m = 1.25 * found.below_m.max(found.ellipsoid.below_m);
    let wide_m = 1.6 * found.beside_m.max(found.ellipsoid.beside_m);
    let rim = (0..=POINTS).map(|k| deep_m * (k as f64 + 0.02) / POINTS as f64);
    let rim: Vec<[f64; 2]> = rim
        .map(|z_m| [pair.beside_m(found.limit, z_m), z_m])
        .filter(|it| it[0] > 0.0)
        .collect();
    let ellipse = (0..=POINTS).map(|k| {
        let (sin, cos) = (k as f64 / POINTS as f64 * std::f64::consts::FRAC_PI_2).sin_cos();
        [
            found.ellipsoid.beside_m * sin,
            found.ellipsoid.below_m * cos,
        ]
    });
    let title = format!("{} under {}", lower.airframe, upper.airframe);
    let figure = map::draw(&Map {
        name: "separation",
        title: (
            &title,
            "alpha: mean air over the lower drone's rotor discs, over its induced velocity",
        ),
        caption: "Where the lower drone's centre is, seen from the upper drone's. Inside the limit's line alpha exceeds it; the ellipsoid holds that, the near-field column and both bodies.",
        reach_m: [wide_m, deep_m],
        value: &|depth_m, offset_m| pair.met(depth_m, offset_m).alpha,
        unit: "alpha",
        lines: vec![
            ("limit", rim),
            ("ellipsoid", ellipse.collect()),
            (
                "near-field column",
                vec![[radius_m, 0.0], [radius_m, depth_m], [0.0, depth_m]],
            ),
        ],
    });
    report.section("", vec![Part::Figure(figure)]);
    report
}
