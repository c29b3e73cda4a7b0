//! Bad scenarios, each with its errors exactly as a person sees them. The expected text of all is
//! one file, to be read from top to bottom: `../snapshots/promises__scenario__*.snap`.

use super::{drawn, reviewed};

/// A scenario in order, but for what is put in.
fn with(fields: &str, drones: &str) -> String {
    format!(
        "(\n  name: \"s\",\n  bounds_m: (min: (0, 0, 0), max: (20, 10, 8)),\n{fields}  drones: [\n{drones}  ],\n)\n"
    )
}

fn with_fields(fields: &str) -> String {
    with(
        fields,
        "    (name: \"k1\", airframe: \"kolibri\", start_m: (1, 1, 1)),\n",
    )
}

fn with_drone(rest: &str) -> String {
    with(
        "",
        &format!("    (name: \"k1\", airframe: \"kolibri\", {rest}),\n"),
    )
}

fn with_airframe(fields: &str) -> String {
    with(
        &format!("  airframes: {{ \"own\": ({fields}) }},\n"),
        "    (name: \"k1\", airframe: \"own\", start_m: (1, 1, 1)),\n",
    )
}

/// Every case under its name, one after the other.
fn pages(cases: &[(&str, String)]) -> String {
    cases
        .iter()
        .map(|(name, text)| format!("==== {name}\n\n{}\n", drawn(text)))
        .collect()
}

#[test]
fn text_that_is_no_scenario_is_reported_where_it_breaks() {
    reviewed(
        "no_scenario",
        &pages(&[
            ("an empty file", String::new()),
            (
                "a missing comma",
                "(\n  name: \"s\"\n  bounds_m: (min: (0, 0, 0), max: (20, 10, 8)),\n)\n".into(),
            ),
            (
                "a bracket left open",
                "(\n  name: \"s\",\n  drones: [\n    (name: \"k1\", start_m: (1, 1, 1)),\n)\n"
                    .into(),
            ),
            (
                "a file cut short",
                "(\n  name: \"s\",\n  drones: [\n    (name: \"k1\", // :-(\n".into(),
            ),
            (
                "a text left open",
                "(\n  name: \"s,\n  drones: [],\n)\n".into(),
            ),
            ("a list instead of a record", "[1, 2]\n".into()),
            ("another thing's name", "World(name: \"s\")\n".into()),
            ("nothing in it", "()\n".into()),
        ]),
    );
}

#[test]
fn keys_and_names_that_are_unknown_missing_or_doubled_are_pointed_at() {
    reviewed(
        "keys_and_names",
        &pages(&[
            ("a slip in a key", with_drone("start: (1, 1, 1)")),
            (
                "a key from elsewhere",
                with_drone("start_m: (1, 1, 1), colour: \"red\""),
            ),
            (
                "a key given twice",
                with_drone("start_m: (1, 1, 1),\n     start_m: (2, 2, 2)"),
            ),
            (
                "a slip in an airframe",
                with(
                    "",
                    "    (name: \"k1\", airframe: \"Kolibry\", start_m: (1, 1, 1)),\n",
                ),
            ),
            (
                "an airframe from nowhere",
                with(
                    "",
                    "    (name: \"k1\", airframe: \"x\", start_m: (1, 1, 1)),\n",
                ),
            ),
            (
                "an airframe given twice",
                with_fields(
                    "  airframes: {\n    \"a\": (mass_kg: 1, propeller_diameter_m: 0.2, motor_distance_m: 0.4),\n    \"a\": (mass_kg: 2, propeller_diameter_m: 0.2, motor_distance_m: 0.4),\n  },\n",
                ),
            ),
            (
                "two drones of one name",
                with(
                    "",
                    "    (name: \"k1\", airframe: \"kolibri\", start_m: (1, 1, 1)),\n    (name: \"k1\", airframe: \"kolibri\", start_m: (5, 1, 1)),\n",
                ),
            ),
            ("no drones", with("", "")),
            (
                "a name that is none",
                with(
                    "",
                    "    (name: \"\", airframe: \"kolibri\", start_m: (1, 1, 1)),\n",
                ),
            ),
            (
                "a wrong word",
                with_drone("start_m: (1, 1, 1), at_end: land"),
            ),
            (
                "a word in quotes",
                with_drone("start_m: (1, 1, 1), at_start: \"Landed\""),
            ),
            (
                "a text without quotes",
                with(
                    "",
                    "    (name: k1, airframe: \"kolibri\", start_m: (1, 1, 1)),\n",
                ),
            ),
        ]),
    );
}

#[test]
fn all_that_is_wrong_with_a_cited_jet_is_pointed_at_in_its_own_file() {
    let cites =
        |file: &str| with_fields(&format!("  air: (jet: \"{file}\", temperature_c: 90),\n"));
    reviewed(
        "cited_jet",
        &pages(&[
            (
                "a jet with many errors, and one of the scenario's",
                cites("wrong.ron"),
            ),
            ("a jet that ends too early", cites("half.ron")),
            ("no such file", cites("missing.ron")),
        ]),
    );
}

#[test]
fn numbers_out_of_range_are_pointed_at_with_their_range() {
    reviewed("numbers", &pages(&[
        ("a negative mass", with_airframe("mass_kg: -1.6, propeller_diameter_m: 0.2, motor_distance_m: 0.45")),
        ("a decimal point in a count", with_airframe("mass_kg: 1.6, propellers: 4.0, propeller_diameter_m: 0.2, motor_distance_m: 0.45")),
        ("one propeller", with_airframe("mass_kg: 1.6, propellers: 1, propeller_diameter_m: 0.2, motor_distance_m: 0.45")),
        ("grams and millimetres", with_airframe("mass_kg: 950, propeller_diameter_m: 0.2, motor_distance_m: 0.45")),
        ("no speed", with_airframe("mass_kg: 1.6, propeller_diameter_m: 0.2, motor_distance_m: 0.45, max_speed_mps: 0")),
        ("not a number", with_drone("start_m: (1, NaN, 1)")),
        ("nor an airframe", with("", "    (name: \"k1\", airframe: \"Kolibry\", start_m: (1, NaN, 1)),\n")),
        ("infinite", with_drone("start_m: (1, 1, 1), tasks: [(to_m: (2, 2, 2), dwell_s: 1e999)]")),
        ("back in time", with_drone("start_m: (1, 1, 1), tasks: [(to_m: (2, 2, 2), dwell_s: -3)]")),
        ("two coordinates", with_drone("start_m: (1, 1)")),
        ("a number in quotes", with_drone("start_m: (1, 1, \"1.5\")")),
        ("no air at all", with_drone("start_m: (1, 1, 1), air_limit: 0")),
        ("more load than it lifts", with_drone("start_m: (1, 1, 1), tasks: [(to_m: (2, 2, 2), load_kg: 400)]")),
        ("kelvin and hectopascal", with_fields("  air: (temperature_c: 293.15, pressure_pa: 1013.25),\n")),
        ("a convection range upside down", with_fields("  air: (convection: (1.0, 0.6)),\n")),
        ("air that stands still, and faster than any", with_fields("  air: (convection: (0, 5.0)),\n")),
        ("a convection that is not finite", with_fields("  air: (convection: (-0.6, inf)),\n")),
        ("one factor", with_fields("  air: (convection: 0.6),\n")),
        ("three factors", with_fields("  air: (convection: (0.6, 0.8, 1.0)),\n")),
        ("nowhere on the Earth", with_fields("  origin: (latitude_deg: 91, longitude_deg: 8.55, altitude_m: 4880000, heading_deg: 30),\n")),
        ("a place without a heading", with_fields("  origin: (latitude_deg: 47.4, longitude_deg: 8.55, altitude_m: 488),\n")),
        ("a seed too long", with_fields("  planning: (seed: 18446744073709551616),\n")),
        ("cells too small", with_fields("  planning: (cell_m: 0.05),\n")),
        ("bounds the wrong way round", "(\n  name: \"s\",\n  bounds_m: (min: (20, 10, 8), max: (0, 0, 0)),\n  drones: [(name: \"k1\", airframe: \"kolibri\", start_m: (1, 1, 1))],\n)\n".into()),
        ("bounds without height", "(\n  name: \"s\",\n  bounds_m: (min: (0, 0, 0), max: (20, 10, 0)),\n  drones: [(name: \"k1\", airframe: \"kolibri\", start_m: (1, 1, 0))],\n)\n".into()),
        ("bounds too large for the default cells", "(\n  name: \"s\",\n  bounds_m: (min: (0, 0, 0), max: (5000, 5000, 100)),\n  drones: [(name: \"k1\", airframe: \"kolibri\", start_m: (1, 1, 1))],\n)\n".into()),
    ]));
}

#[test]
fn obstacles_that_are_no_solids_are_pointed_at() {
    reviewed(
        "obstacles",
        &pages(&[
            (
                "no shape",
                with_fields("  obstacles: [(name: \"rack\")],\n"),
            ),
            (
                "half a box",
                with_fields("  obstacles: [(name: \"rack\", min_m: (4, 4, 0))],\n"),
            ),
            (
                "two shapes",
                with_fields(
                    "  obstacles: [(name: \"rack\", min_m: (4, 4, 0), max_m: (5, 5, 2), radius_m: 1)],\n",
                ),
            ),
            (
                "a flat box",
                with_fields(
                    "  obstacles: [(name: \"rack\", min_m: (4, 4, 0), max_m: (5, 4, 2))],\n",
                ),
            ),
            (
                "a mesh that is not there",
                with_fields("  obstacles: [(name: \"crane\", mesh: \"kran.obj\")],\n"),
            ),
            (
                "a mesh that is none",
                with_fields("  obstacles: [(name: \"crane\", mesh: \"nonsense.obj\")],\n"),
            ),
            (
                "a mesh in millimetres",
                with_fields("  obstacles: [(name: \"crane\", mesh: \"millimetres.obj\")],\n"),
            ),
        ]),
    );
}

#[test]
fn places_in_obstacles_and_out_of_bounds_come_with_the_nearest_free_one() {
    let rack = "  obstacles: [(name: \"rack-2\", min_m: (4.5, 5, 0), max_m: (6.5, 9, 6))],\n";
    let drone =
        |rest: &str| format!("    (name: \"m1\", airframe: \"matrice-300\",\n      {rest}),\n");
    reviewed(
        "places",
        &pages(&[
            ("a start inside", with(rack, &drone("start_m: (5, 7, 3)"))),
            ("a start too near", with(rack, &drone("start_m: (4, 7, 3)"))),
            (
                "a task inside",
                with(
                    rack,
                    &drone("start_m: (1, 7, 3), tasks: [(to_m: (2, 7, 3)), (to_m: (6, 6, 5.9))]"),
                ),
            ),
            (
                "a start out of bounds",
                with(rack, &drone("start_m: (5, 7, 8.5)")),
            ),
            (
                "a landed start sunk in",
                with(rack, &drone("start_m: (5.5, 7, 6.5), at_start: Landed")),
            ),
            (
                "a start landed in mid-air",
                with(rack, &drone("start_m: (1, 7, 3), at_start: Landed")),
            ),
            (
                "a landing on the edge",
                with(
                    "  obstacles: [(name: \"pad\", min_m: (4, 4, 0), max_m: (6, 6, 1)), (name: \"wall\", min_m: (6, 4, 0), max_m: (6.2, 6, 3))],\n",
                    &drone("start_m: (1, 7, 3), tasks: [(to_m: (5.8, 5, 5))], at_end: Land"),
                ),
            ),
            (
                "inside a mesh",
                with(
                    "  obstacles: [(name: \"crane\", mesh: \"crane.obj\", at_m: (5, 5, 2))],\n",
                    &drone("start_m: (5.2, 5.2, 2.2)"),
                ),
            ),
        ]),
    );
}

#[test]
fn formations_that_cannot_be_flown_are_reported_where_they_are_asked_for() {
    let show = |formations: &str| {
        let drone = |k: usize| {
            format!(
                "    (name: \"k{k}\", airframe: \"kolibri\", start_m: ({}, 1, 1)),\n",
                2 * k
            )
        };
        let fields = format!("  formations: [\n    {formations},\n  ],\n");
        with(&fields, &(1..4).map(drone).collect::<String>())
    };
    let three = "to_m: [(2, 5, 2), (4, 5, 2), (6, 5, 2)]";
    reviewed(
        "formations",
        &pages(&[
            (
                "fewer places than drones",
                show("(to_m: [(2, 5, 2), (4, 5, 2)])"),
            ),
            (
                "no places and two sets of them",
                show(&format!("(dwell_s: 2), ({three}, home_m: 1)")),
            ),
            (
                "places out of bounds",
                show(
                    "(to_m: [(2, 5, 2), (4, 11, 2), (6, 5, 9)]), (circle: (centre_m: (10, 5, 4), radius_m: 6))",
                ),
            ),
            (
                "places too near to one another",
                show(
                    "(to_m: [(2, 5, 2), (4, 5, 2), (4.1, 5, 2)]), (sphere: (centre_m: (10, 5, 4), radius_m: 0.1))",
                ),
            ),
            (
                "drones too near to be over home together, layers too near, layers of no home",
                with(
                    "  formations: [(home_m: 1, during_s: (5, 6)), (home_m: 1, layer_m: 0.1), (to_m: [(2, 5, 2), (4, 5, 2)], layer_m: 1)],\n",
                    "    (name: \"k1\", airframe: \"kolibri\", start_m: (2, 1, 0.096), at_start: Landed),\n    (name: \"k2\", airframe: \"kolibri\", start_m: (2.3, 1, 0.096), at_start: Landed),\n",
                ),
            ),
            (
                "a time that cannot be flown",
                show(&format!(
                    "({three}, during_s: (1, 5)), (home_m: 1, during_s: (5.5, 6))"
                )),
            ),
            (
                "a time upside down and out of range",
                show(&format!(
                    "({three}, during_s: (9, 5)), ({three}, during_s: (9, 1e6))"
                )),
            ),
            (
                "drones that are not there, and none",
                show(&format!(
                    "(drones: [\"k1\", \"k1\", \"k22\", \"k3\"], {three}), (drones: [], {three})"
                )),
            ),
            (
                "a round without its parts",
                show("(circle: (center_m: (10, 5, 4))), (sphere: 3)"),
            ),
            (
                "a task due upside down",
                with_drone("start_m: (1, 1, 1), tasks: [(to_m: (2, 2, 2), during_s: (3, 2))]"),
            ),
            (
                "due while at another task",
                with_drone(
                    "start_m: (1, 1, 1), tasks: [\n      (to_m: (2, 2, 2), during_s: (30, 40)),\n      (to_m: (2, 2, 2), during_s: (35, 50)),\n      (to_m: (4, 4, 4), during_s: (20, 25))]",
                ),
            ),
        ]),
    );
}

#[test]
fn all_errors_of_a_file_are_reported_at_once() {
    let text = r#"Scenario(
  name: "many",
  bounds_m: (min: (0, 0, 0), max: (20, 10, 8)),
  air: (temperature_c: 400),
  obstacles: [
    (name: "rack-1", min_m: (4, 2, 0), max_m: (5, 8, 6)),
    (name: "rack-2", min_m: (8, 2, 0), max_mm: (9, 8, 6)),
  ],
  airframes: { "courier": (mass_kg: 1.6, propellers: 4.5, propeller_diameter_m: 0.2, motor_distance_m: 0.45) },
  drones: [
    (name: "k1", airframe: "kolibri", start_m: (4.5, 5, 3)),
    (name: "k2", airframe: "colibri", start_m: (1, 5, 3)),
    (name: "c1", airframe: "courier", start_m: (1, 3, 3)),
    (name: "k1", airframe: "kolibri", start_m: (1, 1, 3), tasks: [(to_m: (21, 1, 3), dwell_s: 1)]),
  ],
  planning: (clearence_m: 0.2),
)
"#;
    reviewed("all_at_once", &drawn(text));
}
