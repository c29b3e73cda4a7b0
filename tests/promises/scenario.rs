//! Scenarios are read as the format says, and a bad one is told so at every place, all at once.

use planner::read_world_with;
use planner::scenario::world::{AtEnd, AtStart, Solid, World};
use planner::scenario::{Files, Problem, schema};
use proptest::prelude::*;

#[path = "../../src/io/problems.rs"]
#[allow(dead_code, reason = "the command uses the rest")]
mod problems;

#[path = "scenario/bad.rs"]
mod bad;

/// The example of the format's definition, to the letter.
const EXAMPLE: &str = include_str!("scenario/example.ron");

/// A tetrahedron with a leg of 1 m along each axis.
const CRANE: &str =
    "o crane\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

/// A jet that is not the paper's.
const CALIBRATED: &str = "// calibrated
Jet(
    centreline: 9.5, spreading: 0.08, origin: -5.5,
    centreline_95: (9.1, 9.9), correlation: (-0.2, -0.9, 0.4),
    fit: Poor, readings: 5387, recordings: [\"a\", \"b\"],
)";

/// A jet with something wrong on every line.
const WRONG_JET: &str = "Jet(
    centreline: -10.11,
    spreeding: 0.07668,
    origin: 5.817,
    centreline_95: (9.9),
    fit: Good,
)
";

fn files(file: &str) -> Result<String, String> {
    match file {
        "crane.obj" => Ok(CRANE.to_owned()),
        "nonsense.obj" => Ok("f 1 2 3".to_owned()),
        "millimetres.obj" => Ok("v 0 0 0\nv 50000 0 0\nv 0 50000 0\nf 1 2 3\n".to_owned()),
        "calibrated.ron" => Ok(CALIBRATED.to_owned()),
        "wrong.ron" => Ok(WRONG_JET.to_owned()),
        "half.ron" => Ok("Jet(centreline: 10,".to_owned()),
        _ => Err("no such file".to_owned()),
    }
}

fn world(text: &str) -> World {
    read_world_with(text, &Files::new(&files))
        .unwrap_or_else(|problems| panic!("{}", draw(text, &problems)))
}

fn draw(text: &str, problems: &[Problem]) -> String {
    problems::draw(problems, "bad.ron", text, false)
}

/// What a person sees for `text`.
fn drawn(text: &str) -> String {
    match read_world_with(text, &Files::new(&files)) {
        Ok(world) => panic!("{text}\nis a scenario after all: {world:?}"),
        Err(problems) => draw(text, &problems),
    }
}

/// Compares with what was reviewed under this name.
fn reviewed(name: &str, text: &str) {
    insta::with_settings!({omit_expression => true}, { insta::assert_snapshot!(name, text) });
}

#[test]
fn the_example_of_the_format_means_what_it_says() {
    let world = world(EXAMPLE);
    assert_eq!(world.name, "example");
    assert_eq!(world.bounds_m.max, [30.0, 20.0, 8.0].into());
    assert_eq!(
        (world.air.temperature_c, world.air.pressure_pa),
        (20.0, 101_325.0)
    );
    assert_eq!(world.superposition, airflow::Superposition::Momentum);
    let names: Vec<&str> = world
        .obstacles
        .iter()
        .map(|obstacle| obstacle.name.as_str())
        .collect();
    assert_eq!(names, ["rack-1", "column-1", "crane"]);
    assert!(
        matches!(world.obstacles[0].shape, Solid::Box { max_m, .. } if max_m == [5.0, 18.0, 6.0].into())
    );
    assert!(matches!(
        world.obstacles[1].shape,
        Solid::Cylinder {
            radius_m: 0.4,
            height_m: 8.0,
            ..
        }
    ));
    let Solid::Mesh {
        mesh,
        vertices_m,
        triangles,
    } = &world.obstacles[2].shape
    else {
        panic!("a mesh")
    };
    assert_eq!(
        (mesh.as_str(), vertices_m.len(), triangles.len()),
        ("crane.obj", 4, 4)
    );
    assert!(
        vertices_m.contains(&[13.0, 4.0, 0.0].into()),
        "moved to its place"
    );
    assert_eq!(world.zones[0].air_limit_mps, Some(1.5));
    let [k1, c1] = &world.drones[..] else {
        panic!("two drones")
    };
    assert_eq!(
        k1.vehicle.airframe,
        airflow::Airframe::preset("kolibri").unwrap()
    );
    assert_eq!(k1.vehicle.body_radius_m, k1.vehicle.airframe.tip_radius_m());
    assert_eq!((k1.vehicle.max_speed_mps, k1.air_limit), (2.0, 0.3));
    assert_eq!((k1.at_start, k1.at_end), (AtStart::Hover, AtEnd::Hover));
    assert_eq!(
        (k1.tasks[0].to_m, k1.tasks[0].dwell_s, k1.tasks[0].load_kg),
        ([20.0, 10.0, 3.0].into(), 10.0, None)
    );
    assert_eq!(
        (c1.vehicle.airframe.name(), c1.vehicle.airframe.mass_kg()),
        ("courier", 1.6)
    );
    assert_eq!((c1.at_start, c1.at_end), (AtStart::Landed, AtEnd::Land));
    assert_eq!(
        (
            c1.tasks[0].load_kg,
            c1.tasks[1].load_kg,
            c1.tasks[1].dwell_s
        ),
        (Some(0.4), None, 0.0)
    );
    assert_eq!(
        (
            world.planning.cell_m,
            world.planning.clearance_m,
            world.planning.seed
        ),
        (1.0, 0.1, 0)
    );
    assert_eq!(world.notes, Vec::<String>::new());
}

#[test]
fn everything_but_the_required_fields_has_the_default_that_the_schema_prints() {
    let minimal = r#"(name: "m", bounds_m: (min: (0, 0, 0), max: (9, 9, 9)),
        airframes: {"own": (mass_kg: 1, propeller_diameter_m: 0.2, motor_distance_m: 0.4)},
        zones: [(min_m: (0, 0, 0), max_m: (1, 1, 1))], obstacles: [(min_m: (4, 4, 4), max_m: (5, 5, 5))],
        drones: [(name: "a", airframe: "own", start_m: (7, 7, 7), tasks: [(to_m: (2, 2, 2))])])"#;
    let world = world(minimal);
    let schema = schema().to_value();
    let default = |path: &str| schema["defaults"][path].clone();
    let number = |path: &str| {
        default(path)
            .as_f64()
            .unwrap_or_else(|| panic!("{path}: {schema:#}"))
    };
    assert_eq!(number("air.temperature_c"), world.air.temperature_c);
    assert_eq!(number("air.pressure_pa"), world.air.pressure_pa);
    assert_eq!(default("air.superposition"), "Momentum");
    assert!(default("planning.cell_m").as_str().is_some());
    assert_eq!(world.planning.cell_m, 1.0);
    assert_eq!(number("planning.clearance_m"), world.planning.clearance_m);
    assert_eq!(number("planning.seed"), world.planning.seed as f64);
    assert_eq!(
        number("planning.energy_weight"),
        world.planning.energy_weight
    );
    assert_eq!(number("planning.air_limit"), world.drones[0].air_limit);
    assert_eq!(
        number("drones[].tasks[].dwell_s"),
        world.drones[0].tasks[0].dwell_s
    );
    assert_eq!(default("drones[].at_start"), "Hover");
    assert_eq!(default("drones[].at_end"), "Hover");
    assert_eq!(
        Some(number("zones[].air_limit_mps")),
        world.zones[0].air_limit_mps
    );
    let own = &world.drones[0].vehicle;
    assert_eq!(
        number("airframes{}.propellers"),
        f64::from(own.airframe.propellers())
    );
    assert_eq!(
        number("airframes{}.width_factor"),
        own.airframe.width_factor()
    );
    assert_eq!(number("airframes{}.max_speed_mps"), own.max_speed_mps);
    assert_eq!(
        (
            world.zones[0].name.as_str(),
            world.obstacles[0].name.as_str()
        ),
        ("zone-1", "obstacle-1")
    );
}

#[test]
fn the_schema_knows_every_key_that_the_reader_takes_and_no_other() {
    // The reader lists its keys where it finds one that it does not know.
    let asked = [
        ("", r#"(nonsense_: 1)"#),
        ("Bounds", r#"(bounds_m: (nonsense_: 1))"#),
        ("Air", r#"(air: (nonsense_: 1))"#),
        ("Obstacle", r#"(obstacles: [(nonsense_: 1)])"#),
        ("Zone", r#"(zones: [(nonsense_: 1)])"#),
        ("Airframe", r#"(airframes: {"a": (nonsense_: 1)})"#),
        ("Drone", r#"(drones: [(nonsense_: 1)])"#),
        ("Task", r#"(drones: [(tasks: [(nonsense_: 1)])])"#),
        ("Planning", r#"(planning: (nonsense_: 1))"#),
    ];
    let schema = schema().to_value();
    for (name, text) in asked {
        let problems = planner::read_world(text).unwrap_err();
        let unknown = problems
            .iter()
            .find(|problem| problem.message.contains("nonsense_"))
            .unwrap();
        let help = unknown.help.as_deref().unwrap();
        let reader: Vec<&str> = help.split('`').skip(1).step_by(2).collect();
        let of_schema = if name.is_empty() {
            &schema
        } else {
            &schema["$defs"][name]
        };
        let mut reader = reader;
        let mut keys: Vec<&str> = of_schema["properties"]
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .collect();
        reader.sort_unstable();
        keys.sort_unstable();
        assert_eq!(reader, keys, "{name}");
    }
}

#[test]
fn the_schema_prints_as_reviewed() {
    reviewed("schema", &serde_json::to_string_pretty(&schema()).unwrap());
}

#[test]
fn a_cited_jet_is_the_one_that_is_flown_and_a_poor_fit_is_noted() {
    let text = r#"(name: "m", bounds_m: (min: (0, 0, 0), max: (20, 9, 9)), air: (jet: "calibrated.ron"), drones: [
        (name: "a", airframe: "offboard-2", start_m: (2, 2, 7), tasks: [(to_m: (17, 2, 7))]),
        (name: "b", airframe: "kolibri", start_m: (17, 2, 2), tasks: [(to_m: (2, 2, 2))]),
    ])"#;
    let world = world(text);
    let jet = airflow::Jet {
        centreline: 9.5,
        spreading: 0.08,
        origin: -5.5,
    };
    assert_eq!(world.jet, jet);
    assert_eq!(
        world.notes,
        ["the jet of calibrated.ron fits what it was calibrated on poorly"]
    );
    let outcome = planner::plan_world(&world, &planner::Control::QUIET).expect("in order");
    let plan = outcome.into_planned().expect("a plan").plan;
    let flown = plan.air.jet;
    assert_eq!(
        (flown.centreline, flown.spreading, flown.origin),
        (9.5, 0.08, -5.5)
    );
    assert_eq!(plan.violations, Vec::new());
}

#[test]
fn some_and_none_may_be_written_out() {
    let text = r#"(name: "m", bounds_m: (min: (0, 0, 0), max: (9, 9, 9)), drones: [
        (name: "a", airframe: "kolibri", start_m: (7, 7, 7), air_limit: None, tasks: [(to_m: (2, 2, 2), load_kg: Some(0.1))])])"#;
    assert_eq!(world(text).drones[0].tasks[0].load_kg, Some(0.1));
}

#[test]
fn comments_blanks_and_a_byte_order_mark_change_nothing() {
    let text = "\u{feff}#![enable(implicit_some)]\n// first\nScenario( /* a */ name /* b */ : \"m\" // c\n,
        bounds_m: (min: (0, 0, 0), max: (9, /* d */ 9, 9)), drones: [ // e
        Drone(name: \"a\", airframe: \"kolibri\", start_m: (7, 7, 7 /* f */)), ], )";
    assert_eq!(world(text).bounds_m.max, [9.0, 9.0, 9.0].into());
}

#[test]
fn brackets_commas_and_colons_in_texts_and_comments_are_no_structure() {
    let text = r##"(name: "m: (a, [b], \"{c}", /* ( /* , */ [ */ bounds_m: (min: (0, 0, 0), max: (9, 9, 9)), // {,(
        drones: [(name: r#"d"),("#, airframe: "kolibri", start_m: (7, 7, 7)), (airframe: "kolibri", start_m: (1, 1, 1), name: "r")])"##;
    let world = world(text);
    assert_eq!(world.name, "m: (a, [b], \"{c}");
    assert_eq!(world.drones[0].name, "d\"),(");
    assert_eq!(world.drones[1].name, "r");
}

#[test]
fn canted_and_unusual_frames_and_replaced_presets_are_noted() {
    let text = r#"(name: "m", bounds_m: (min: (0, 0, 0), max: (9, 9, 9)),
        airframes: {
            "hexa": (mass_kg: 1, propellers: 6, propeller_diameter_m: 0.2, motor_distance_m: 0.4, body_radius_m: 0.2),
            "elios-3": (mass_kg: 2.4, propeller_diameter_m: 0.127, motor_distance_m: 0.275),
        },
        drones: [
            (name: "a", airframe: "hexa", start_m: (1, 1, 1)), (name: "b", airframe: "mavic-3e", start_m: (3, 3, 3)),
            (name: "c", airframe: "elios-3", start_m: (5, 5, 5)), (name: "d", airframe: "mavic-3e", start_m: (7, 7, 7)),
        ])"#;
    reviewed("notes", &problems::draw_notes(&world(text).notes, false));
}

#[test]
fn a_landed_drone_may_touch_what_it_stands_on_and_sink_in_half_a_centimetre() {
    let standing_at = |z_m: f64| {
        let text = format!(
            r#"(name: "m", bounds_m: (min: (0, 0, 0), max: (9, 9, 9)), obstacles: [(name: "pad", min_m: (1, 1, 0), max_m: (3, 3, 1))],
            airframes: {{"own": (mass_kg: 1, propeller_diameter_m: 0.2, motor_distance_m: 0.4, body_radius_m: 0.3)}},
            drones: [(name: "a", airframe: "own", start_m: (2, 2, {z_m}), at_start: Landed, tasks: [(to_m: (2, 2, 4))], at_end: Land)])"#
        );
        read_world_with(&text, &Files::new(&files)).is_ok()
    };
    assert!(standing_at(1.3));
    assert!(standing_at(1.2951));
    assert!(!standing_at(1.2949));
    assert!(!standing_at(0.5));
}

#[test]
fn the_nearest_free_place_that_an_error_names_is_free() {
    let text = |start: &str| {
        format!(
            r#"(name: "m", bounds_m: (min: (0, 0, 0), max: (9, 9, 9)), obstacles: [(name: "rack", min_m: (2, 2, 0), max_m: (6, 6, 8.9)),
            (name: "post", base_m: (7.1, 4, 0), radius_m: 0.5, height_m: 9)],
            drones: [(name: "a", airframe: "offboard-2", start_m: {start})])"#
        )
    };
    for start in [
        "(5.5, 4, 3)",
        "(2.123456, 2.2, 8.8)",
        "(6.4, 4.01, 1)",
        "(-3, 4, 12)",
    ] {
        let problems = read_world_with(&text(start), &Files::new(&files)).unwrap_err();
        let help = problems[0].help.as_deref().unwrap();
        let place = help.rsplit_once(" is ").unwrap().1;
        let (place, _) = place.split_once(", or ").unwrap_or((place, ""));
        world(&text(place));
    }
}

#[test]
fn a_start_in_mid_air_beside_an_obstacle_is_reported_as_both_with_no_margin_that_does_not_help() {
    let text = |airframe: &str, start: &str, planning: &str| {
        format!(
            r#"(name: "m", bounds_m: (min: (0, 0, 0), max: (12, 12, 9)),
            obstacles: [(name: "rack", min_m: (4, 4, 0), max_m: (4.9, 6, 2))],
            drones: [(name: "a", airframe: "{airframe}", start_m: {start}, at_start: Landed, tasks: [(to_m: (9, 9, 3))])],
            planning: ({planning}))"#
        )
    };
    for (airframe, start) in [
        ("matrice-300", "(5, 5, 2.7137)"),
        ("kolibri", "(4.95, 5, 2.1)"),
    ] {
        let text = text(airframe, start, "");
        let problems = read_world_with(&text, &Files::new(&files)).unwrap_err();
        let told: Vec<&str> = problems.iter().map(|it| it.message.as_str()).collect();
        let (air, beside) = (
            "`a` starts landed in mid-air",
            "`a` starts too near to obstacle `rack`",
        );
        assert_eq!(told, [air, beside]);
        let fits = |it: &Problem| it.help.as_deref().is_some_and(|it| it.contains("fits"));
        assert!(!problems.iter().any(fits), "{problems:?}");
    }
    // Where a margin is all there is, what is named is taken.
    let beside = text("kolibri", "(5, 5, 0.08)", "");
    let problems = read_world_with(&beside, &Files::new(&files)).unwrap_err();
    let help = problems[0].help.as_deref().unwrap();
    let planning = help.split_once("planning: (").unwrap().1;
    let planning = planning.split_once(") fits").unwrap().0;
    world(&text("kolibri", "(5, 5, 0.08)", planning));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_text_makes_the_reader_panic(
        cut in 0..EXAMPLE.len(), lost in 0..40usize, at in 0..EXAMPLE.len(),
        put in prop_oneof![
            Just("("), Just(")"), Just("\""), Just("/*"), Just("//"), Just("Some("), Just("None"), Just("1e999"), Just("é"),
            Just("\\"), Just("r#\""), Just("'"), Just("{"), Just("]"), Just("NaN"), Just(","), Just("\n"), Just("-"), Just("0x"),
        ],
    ) {
        let kept: String = EXAMPLE.char_indices().filter(|(i, _)| !(cut..cut + lost).contains(i)).map(|(_, c)| c).collect();
        let at = (0..=at.min(kept.len())).rev().find(|at| kept.is_char_boundary(*at)).unwrap_or(0);
        let text = format!("{}{put}{}", &kept[..at], &kept[at..]);
        for text in [text.as_str(), &text[..at], &kept] {
            if let Err(problems) = read_world_with(text, &Files::new(&files)) {
                prop_assert!(!problems.is_empty());
                for problem in problems.iter() {
                    if let Some(span) = &problem.span {
                        prop_assert!(text.get(span.clone()).is_some(), "{problem:?}");
                    }
                }
                draw(text, &problems);
            }
        }
    }

    #[test]
    fn no_noise_makes_the_reader_panic(text in "[(){}\\[\\]:,a-z0-9\"/*. \n#!_-]{0,80}") {
        if let Err(problems) = read_world_with(&text, &Files::new(&files)) {
            draw(&text, &problems);
        }
    }
}
