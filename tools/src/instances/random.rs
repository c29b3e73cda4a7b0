//! Random worlds of everything that a scenario may hold: what a planner has to bear, not what a
//! fleet is.

use std::fmt::Write as _;

use airflow::Airframe;
use diagnosis::statistics::draws::Draws;
use planner::plan::outcome::EndpointKind;
use planner::{Files, World};

/// A scenario and the meshes that it names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RandomWorld {
    /// RON.
    pub scenario: String,
    /// File names and OBJ texts.
    pub meshes: Vec<(String, String)>,
}

/// Drones asked for, at most; chosen here: a world is planned in seconds.
const MOST_DRONES: usize = 10;
/// Draws of a drone before it is left out: chosen here.
const TRIES: usize = 4;

/// A world of up to ten drones, presets and frames of its own, hovering and landed, with tasks,
/// dwells, payloads, limits and margins of any kind, among boxes, cylinders, meshes and zones. It
/// is in order, and no two starts exclude one another; whether every drone has a path is not known.
///
/// The same seed gives the same world.
#[must_use]
pub fn world(seed: u64) -> RandomWorld {
    let mut draws = Draws::new(seed);
    let mut made = Made::new(seed, &mut draws);
    let wanted = 1 + draws.index(MOST_DRONES);
    for index in 0..wanted {
        for _ in 0..TRIES {
            let drone = made.drone(index, &mut draws);
            made.drones.push(drone);
            if made.world().is_some() {
                break;
            }
            made.drones.pop();
        }
    }
    // At least one drone that has all the room there is.
    if made.drones.is_empty() {
        made.surroundings.clear();
        made.meshes.clear();
        let [x, y, z] = [0, 1, 2].map(|axis| (made.low_m[axis] + made.high_m[axis]) / 2.0);
        let drone = format!(r#"(name: "d0", airframe: "kolibri", start_m: ({x}, {y}, {z}))"#);
        made.drones.push(drone);
    }
    RandomWorld {
        scenario: made.text(),
        meshes: made.meshes,
    }
}

impl RandomWorld {
    /// The world that it is.
    ///
    /// # Errors
    /// None that is known of: the generator keeps what is in order.
    pub fn read(&self) -> Result<World, planner::scenario::Problems> {
        let load = |file: &str| {
            let mesh = self.meshes.iter().find(|(name, _)| name == file);
            mesh.map(|(_, text)| text.clone())
                .ok_or_else(|| "no such mesh".to_owned())
        };
        planner::read_world_with(&self.scenario, &Files::new(&load))
    }
}

/// A world in the making.
struct Made {
    seed: u64,
    low_m: [f64; 3],
    high_m: [f64; 3],
    /// Air, airframes, obstacles, zones.
    surroundings: String,
    planning: String,
    meshes: Vec<(String, String)>,
    drones: Vec<String>,
}

/// To the centimetre, as coordinates are typed.
fn typed(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

fn triple(place: [f64; 3]) -> String {
    let [x, y, z] = place.map(typed);
    format!("({x}, {y}, {z})")
}

/// One of several, as often as it stands there.
fn one<'a>(draws: &mut Draws, of: &[&'a str]) -> &'a str {
    of[draws.index(of.len())]
}

impl Made {
    fn new(seed: u64, draws: &mut Draws) -> Made {
        let low_m = [-3.0, 2.0, 0.0].map(|at| if draws.index(3) == 0 { 0.0 } else { at });
        let size_m = [
            draws.between(5.0, 18.0),
            draws.between(5.0, 18.0),
            draws.between(3.0, 10.0),
        ];
        let high_m = [0, 1, 2].map(|axis| typed(low_m[axis] + size_m[axis]));
        let mut made = Made {
            seed,
            low_m,
            high_m,
            surroundings: String::new(),
            planning: String::new(),
            meshes: Vec::new(),
            drones: Vec::new(),
        };
        made.air(draws);
        made.airframes(draws);
        made.obstacles(draws);
        made.zones(draws);
        made.plan(draws);
        made
    }

    fn text(&self) -> String {
        let (low, high) = (triple(self.low_m), triple(self.high_m));
        format!(
            "Scenario(\n  name: \"random {}\",\n  bounds_m: (min: {low}, max: {high}),\n{}  drones: [\n    {},\n  ],\n  planning: ({}),\n)\n",
            self.seed,
            self.surroundings,
            self.drones.join(",\n    "),
            self.planning,
        )
    }

    /// As read, if it is in order and no starts exclude one another.
    fn world(&self) -> Option<World> {
        let read = RandomWorld {
            scenario: self.text(),
            meshes: self.meshes.clone(),
        };
        let world = read.read().ok()?;
        let found = planner::endpoint_conflicts(&world);
        let mut found = found.worst.iter();
        found
            .all(|it| it.when != EndpointKind::Starts)
            .then_some(world)
    }

    fn air(&mut self, draws: &mut Draws) {
        let how = one(draws, &["Momentum", "Momentum", "Linear", "Strongest"]);
        let (celsius, pascal) = (
            draws.between(-20.0, 40.0),
            draws.between(70_000.0, 105_000.0),
        );
        // Every third world has advected wakes.
        let late = match self.seed % 3 {
            0 => "convection: (0.6, 1.0)",
            _ => "",
        };
        if draws.index(3) > 0 {
            let _ = writeln!(
                self.surroundings,
                "  air: (superposition: {how}, temperature_c: {celsius:.1}, pressure_pa: {pascal:.0}, {late}),"
            );
        } else if !late.is_empty() {
            let _ = writeln!(self.surroundings, "  air: ({late}),");
        }
    }

    /// Frames of its own: from a hand's breadth to a metre, three to eight propellers.
    fn airframes(&mut self, draws: &mut Draws) {
        let mut own = |name: &str| {
            let scale = draws.between(0.1, 0.6);
            let mass_kg = 12.0 * scale.powi(3) * draws.between(0.6, 1.6) + 0.03;
            let propellers = one(draws, &["4", "4", "3", "6", "8"]);
            let share = if propellers == "4" { 0.6 } else { 0.35 };
            let diameter_m = scale * share * draws.between(0.7, 1.0);
            let mut text = format!(
                "\"{name}\": (mass_kg: {mass_kg:.3}, propellers: {propellers}, propeller_diameter_m: {diameter_m:.3}, motor_distance_m: {scale:.3}"
            );
            for (key, low, high) in [
                ("width_factor", 0.8, 1.3),
                ("max_speed_mps", 0.3, 6.0),
                ("max_climb_mps", 0.3, 3.0),
                ("max_descent_mps", 0.2, 2.0),
            ] {
                if draws.index(3) == 0 {
                    let _ = write!(text, ", {key}: {:.2}", draws.between(low, high));
                }
            }
            text + ")"
        };
        let (a, b) = (own("own-a"), own("own-b"));
        let _ = writeln!(self.surroundings, "  airframes: {{ {a},\n    {b} }},");
    }

    /// A place in the bounds.
    fn place(&self, draws: &mut Draws) -> [f64; 3] {
        [0, 1, 2].map(|axis| draws.between(self.low_m[axis], self.high_m[axis]))
    }

    fn obstacles(&mut self, draws: &mut Draws) {
        let mut all = Vec::new();
        for index in 0..draws.index(6) {
            let [x, y, z] = self.place(draws);
            let half = [0, 1].map(|_| draws.between(0.1, 1.5));
            let height_m = draws.between(0.2, self.high_m[2] - self.low_m[2]);
            let base_z_m = if draws.index(4) == 0 {
                z
            } else {
                self.low_m[2]
            };
            all.push(match draws.index(3) {
                0 => format!(
                    "(name: \"post-{index}\", base_m: {}, radius_m: {:.2}, height_m: {height_m:.2})",
                    triple([x, y, base_z_m]),
                    half[0] / 2.0 + 0.05
                ),
                1 => {
                    let name = format!("mesh-{index}.obj");
                    // A pyramid or a prism: its own floor, sides and a top off its middle.
                    let lean_m = draws.between(-1.0, 1.0);
                    let (a, b) = (half[0], half[1]);
                    let text = format!(
                        "v {0:.3} {1:.3} 0\nv {2:.3} {1:.3} 0\nv {2:.3} {3:.3} 0\nv {0:.3} {3:.3} 0\nv {lean_m:.3} {lean_m:.3} {height_m:.3}\n\
                         f 1 2 3 4\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n",
                        -a, -b, a, b
                    );
                    let at = triple([x, y, base_z_m]);
                    let obstacle = format!("(name: \"mesh-{index}\", mesh: \"{name}\", at_m: {at})");
                    self.meshes.push((name, text));
                    obstacle
                }
                _ => format!(
                    "(name: \"box-{index}\", min_m: {}, max_m: {})",
                    triple([x - half[0], y - half[1], base_z_m]),
                    triple([x + half[0], y + half[1], base_z_m + height_m])
                ),
            });
        }
        let _ = writeln!(self.surroundings, "  obstacles: [{}],", all.join(",\n    "));
    }

    fn zones(&mut self, draws: &mut Draws) {
        let mut all = Vec::new();
        for index in 0..draws.index(4) {
            let low = self.place(draws);
            let size = [0, 1, 2].map(|_| draws.between(0.3, 3.0));
            let high = [0, 1, 2].map(|axis| low[axis] + size[axis]);
            let limit = format!("air_limit_mps: {:.2}", draws.between(0.3, 4.0));
            let limits = match draws.index(3) {
                0 => limit,
                1 => "keep_out: true".to_owned(),
                _ => limit + ", keep_out: true",
            };
            let (low, high) = (triple(low), triple(high));
            all.push(format!(
                "(name: \"zone-{index}\", min_m: {low}, max_m: {high}, {limits})"
            ));
        }
        let _ = writeln!(self.surroundings, "  zones: [{}],", all.join(",\n    "));
    }

    fn plan(&mut self, draws: &mut Draws) {
        let mut fields = vec![
            format!("cell_m: {}", one(draws, &["0.5", "0.75", "1", "1"])),
            format!("seed: {}", draws.index(1000)),
        ];
        // Every fourth world is flown smoothly.
        if self.seed.is_multiple_of(4) {
            fields.push("motion: Smooth".to_owned());
        }
        for (key, values) in [
            ("clearance_m", ["0", "0.05", "0.2"]),
            ("time_margin_s", ["0", "0.05", "0.3"]),
            ("tracking_m", ["0", "0.05", "0.2"]),
            ("energy_weight", ["0", "1", "20"]),
            ("air_limit", ["0.15", "0.5", "0.9"]),
        ] {
            if draws.index(2) == 0 {
                fields.push(format!("{key}: {}", one(draws, &values)));
            }
        }
        self.planning = fields.join(", ");
    }

    fn drone(&self, index: usize, draws: &mut Draws) -> String {
        let own = ["own-a", "own-b"];
        let presets = Airframe::PRESETS;
        // Few kinds a world: every pair of them costs a table.
        let kinds = [
            presets[self.seed as usize % presets.len()],
            "kolibri",
            own[0],
            own[1],
        ];
        let airframe = one(draws, &kinds);
        let mut start_m = self.place(draws);
        let lands = draws.index(4) == 0;
        if lands {
            // On the floor: the centre of its body as high as its rotors reach out.
            let radius_m = Airframe::preset(airframe).map_or(0.3, |it| it.tip_radius_m());
            start_m[2] = self.low_m[2] + radius_m;
        }
        let mut tasks = Vec::new();
        for _ in 0..draws.index(4) {
            let mut task = format!("(to_m: {}", triple(self.place(draws)));
            if draws.index(3) == 0 {
                let _ = write!(task, ", dwell_s: {:.1}", draws.between(0.0, 8.0));
            }
            if draws.index(4) == 0 {
                let _ = write!(task, ", load_kg: {:.3}", draws.between(0.0, 0.06));
            }
            tasks.push(task + ")");
        }
        let mut text = format!(
            "(name: \"d{index}\", airframe: \"{airframe}\", start_m: {}",
            triple(start_m)
        );
        if lands {
            text += ", at_start: Landed";
        }
        if draws.index(3) == 0 {
            let _ = write!(text, ", air_limit: {:.2}", draws.between(0.1, 1.0));
        }
        let end = one(draws, &["Hover", "Hover", "Land", "Leave"]);
        let _ = write!(text, ", at_end: {end}, tasks: [{}])", tasks.join(", "));
        text
    }
}
