//! Worlds built by hand, checked against the rules that scenarios are read by.

use nalgebra::{Point3, Vector3};
use thiserror::Error;

use super::finding_file::unfit;
use super::limits::{
    AIR_LIMIT, ALTITUDE_M, BODY_RADIUS_M, BUSY_S, CELL_M, CENTRELINE, CLEARANCE_M, DURING_S,
    DWELL_S, ENERGY_WEIGHT, HEADING_DEG, LATITUDE_DEG, LOAD_KG, LONGITUDE_DEG, Limits, MASS_KG,
    MAX_ACCELERATION_MPS2, MAX_JERK_MPS3, MAX_SPEED_MPS, MOST_ITEMS, MOST_LATTICE_PLACES,
    MOST_TRIANGLES, MOTOR_DISTANCE_M, ORIGIN, PLACE_M, PRESSURE_PA, PROPELLER_DIAMETER_M,
    PROPELLERS, SIZE_M, SPREADING, STOP_S, TEMPERATURE_C, TIME_MARGIN_S, TRACKING_M,
    VERTICAL_SPEED_MPS, WIDTH_FACTOR, ZONE_AIR_LIMIT_MPS, lattice_places, name_fault,
};
use super::problem::{Problem, Problems};
use crate::plan::cause::as_typed;
use crate::plan::limits::is_overloaded;
use crate::scenario::placement::{Misfit, Misplaced, Spot, misplaced};
use crate::scenario::solid::Solids;
use crate::scenario::world::{Drone, PathMotion, Solid, World};

/// What is wrong with a [`World`].
#[derive(Clone, Debug, Error, PartialEq)]
pub enum WorldError {
    /// Nothing to plan.
    #[error("there are no drones")]
    NoDrones,
    /// A name that cannot stand in a table.
    #[error("the name of {owner} is {fault}")]
    Name {
        /// Of what.
        owner: String,
        /// What is wrong with it.
        fault: &'static str,
    },
    /// Two drones have one name.
    #[error("two drones are called `{0}`")]
    SameName(String),
    /// More of something than a plan is made for.
    #[error("{owner} has {count} {what}, at most {most}")]
    TooMany {
        /// Of what.
        owner: String,
        /// What there is too much of.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many are allowed.
        most: usize,
    },
    /// A number that is not finite or out of range.
    #[error("{quantity} of {owner} is {value}: must be from {low} to {high} {unit}")]
    OutOfRange {
        /// Of what.
        owner: String,
        /// Which quantity.
        quantity: &'static str,
        /// What it is.
        value: f64,
        /// Lowest allowed value.
        low: f64,
        /// Highest allowed value.
        high: f64,
        /// Of all three.
        unit: &'static str,
    },
    /// A box without volume.
    #[error("{0} encloses nothing")]
    Flat(String),
    /// A mesh without faces, or with a face whose vertex is not there.
    #[error("the mesh of {0} has no sound faces")]
    Mesh(String),
    /// A lattice that no memory holds.
    #[error(
        "cells of {} m are too small for these bounds: {places:.1e} places, at most {most:.0e}",
        as_typed(*cell_m)
    )]
    Lattice {
        /// Spacing (m).
        cell_m: f64,
        /// Places that it makes.
        places: f64,
        /// Places that are allowed.
        most: f64,
    },
    /// A mass that its rotors cannot carry.
    #[error("drone `{drone}` cannot lift {} kg", as_typed(*mass_kg))]
    Mass {
        /// Which drone.
        drone: String,
        /// With load (kg).
        mass_kg: f64,
    },
    /// A drone cannot be where it has to be.
    #[error("{words}")]
    Misplaced {
        /// Where, why, and a place near it that would do.
        found: Misplaced,
        /// The same as a sentence.
        words: String,
    },
    /// The effects of a finding that the planner cannot fly, or that this fleet cannot.
    #[error("the effects of the air cannot be flown: {0}")]
    Effects(String),
}

impl World {
    /// Holds a world against the rules of a scenario: numbers finite and in range, names sound and
    /// unique, drones where they can be. A world that was read is in order.
    ///
    /// # Errors
    /// Everything that is wrong; places are checked once all numbers are in order.
    pub fn check(&self) -> Result<(), Problems<WorldError>> {
        let mut check = Check { errors: Vec::new() };
        check.numbers(self);
        if check.errors.is_empty() {
            check.places(self);
        }
        match check.errors.is_empty() {
            true => Ok(()),
            false => Err(Problems(check.errors)),
        }
    }
}

impl World {
    /// What no scenario may have of a drone that is to be in this world: its name, its numbers, air
    /// that it cannot fly in. `since_s`: from when on it has its tasks (s).
    pub(crate) fn faults_of(&self, drone: &Drone, since_s: f64) -> Vec<WorldError> {
        let mut check = Check { errors: Vec::new() };
        let owner = format!("drone `{}`", drone.name);
        check.name(owner.clone(), &drone.name);
        check.drone(drone, self.air.density_kg_per_m3());
        let ends_s = since_s + drone.busy_s();
        if check.errors.is_empty() && !BUSY_S.contain(ends_s) {
            check.number(&owner, "end of all tasks", ends_s, &BUSY_S);
        }
        if check.errors.is_empty() {
            let unfit = unfit(self, std::slice::from_ref(drone));
            check
                .errors
                .extend(unfit.into_iter().map(WorldError::Effects));
        }
        check.errors
    }

    /// That a drone planned in this world takes longer to stop than is flown smoothly, where its
    /// motion is to be.
    pub(crate) fn slow_to_stop(&self, drone: &Drone) -> Option<WorldError> {
        let planning = &self.planning;
        if planning.motion != PathMotion::Smooth || planning.relaxable.motion {
            return None;
        }
        let mut check = Check { errors: Vec::new() };
        let owner = format!("drone `{}`", drone.name);
        check.number(&owner, "time to stop", drone.vehicle.stop_s(), &STOP_S);
        check.errors.pop()
    }
}

impl Drone {
    /// What its tasks take at least (s): dwells, and flights from place to place straight at full
    /// speed.
    pub(super) fn busy_s(&self) -> f64 {
        let mut from_m = self.start_m;
        let mut busy_s = 0.0;
        for task in &self.tasks {
            busy_s += (task.to_m - from_m).norm() / self.vehicle.max_speed_mps + task.dwell_s;
            if let Some([_, until_s]) = task.during_s {
                busy_s = busy_s.max(until_s);
            }
            from_m = task.to_m;
        }
        busy_s
    }
}

/// Gathers what is wrong with a world, in the order of its fields.
struct Check {
    /// All that was found so far.
    errors: Vec<WorldError>,
}

impl Check {
    /// A number and its range; `owner` and `quantity` as messages say them.
    fn number(&mut self, owner: &str, quantity: &'static str, value: f64, limits: &Limits) {
        let Limits { low, high, unit } = *limits;
        if !limits.contain(value) {
            self.errors.push(WorldError::OutOfRange {
                owner: owner.to_owned(),
                quantity,
                value,
                low,
                high,
                unit,
            });
        }
    }

    /// A point with every coordinate within 10 km of the origin (m).
    fn place(&mut self, owner: &str, quantity: &'static str, place_m: &Point3<f64>) {
        for &coordinate in place_m.iter() {
            self.number(owner, quantity, coordinate, &PLACE_M);
        }
    }

    /// Two corners (m) that enclose a volume.
    fn corners(&mut self, owner: &str, min_m: &Point3<f64>, max_m: &Point3<f64>) {
        self.place(owner, "the lowest corner", min_m);
        self.place(owner, "the highest corner", max_m);
        let size_m: Vector3<f64> = max_m - min_m;
        if size_m.iter().any(|size_m| *size_m < SIZE_M.low) {
            self.errors.push(WorldError::Flat(owner.to_owned()));
        }
    }

    /// How many there are of something.
    fn count(&mut self, owner: &str, what: &'static str, count: usize, most: usize) {
        if count > most {
            let owner = owner.to_owned();
            self.errors.push(WorldError::TooMany {
                owner,
                what,
                count,
                most,
            });
        }
    }

    /// A name that can stand in a table.
    fn name(&mut self, owner: String, name: &str) {
        let fault = name_fault(name).map(|fault| WorldError::Name { owner, fault });
        self.errors.extend(fault);
    }

    /// Everything but where drones are.
    fn numbers(&mut self, world: &World) {
        self.name("the world".to_owned(), &world.name);
        self.corners("the bounds", &world.bounds_m.min, &world.bounds_m.max);
        let World {
            air, jet, planning, ..
        } = world;
        let margins = planning.margins;
        for (owner, quantity, value, limits) in [
            ("the air", "temperature", air.temperature_c, &TEMPERATURE_C),
            ("the air", "pressure", air.pressure_pa, &PRESSURE_PA),
            ("the jet", "centreline", jet.centreline, &CENTRELINE),
            ("the jet", "spreading", jet.spreading, &SPREADING),
            ("the jet", "origin", jet.origin, &ORIGIN),
            ("the lattice", "spacing", planning.cell_m, &CELL_M),
            ("the fleet", "clearance", planning.clearance_m, &CLEARANCE_M),
            ("the fleet", "time margin", margins.time_s, &TIME_MARGIN_S),
            (
                "the fleet",
                "tracking margin",
                margins.tracking_m,
                &TRACKING_M,
            ),
            (
                "the fleet",
                "energy weight",
                planning.energy_weight,
                &ENERGY_WEIGHT,
            ),
        ] {
            self.number(owner, quantity, value, limits);
        }
        if let Some(origin) = &world.origin {
            for (quantity, value, limits) in [
                ("latitude", origin.latitude_deg, &LATITUDE_DEG),
                ("longitude", origin.longitude_deg, &LONGITUDE_DEG),
                ("altitude", origin.altitude_m, &ALTITUDE_M),
                ("heading", origin.heading_deg, &HEADING_DEG),
            ] {
                self.number("the origin", quantity, value, limits);
            }
        }
        for (what, count) in [
            ("drones", world.drones.len()),
            ("obstacles", world.obstacles.len()),
            ("zones", world.zones.len()),
        ] {
            self.count("the world", what, count, MOST_ITEMS);
        }
        let places = lattice_places(world.bounds_m.max - world.bounds_m.min, planning.cell_m);
        if places > MOST_LATTICE_PLACES {
            self.errors.push(WorldError::Lattice {
                cell_m: planning.cell_m,
                places,
                most: MOST_LATTICE_PLACES,
            });
        }
        for (index, obstacle) in world.obstacles.iter().enumerate() {
            self.name(format!("obstacle {}", index + 1), &obstacle.name);
            self.solid(&format!("obstacle `{}`", obstacle.name), &obstacle.shape);
        }
        for (index, zone) in world.zones.iter().enumerate() {
            let owner = format!("zone `{}`", zone.name);
            self.name(format!("zone {}", index + 1), &zone.name);
            self.corners(&owner, &zone.min_m, &zone.max_m);
            if let Some(limit_mps) = zone.air_limit_mps {
                self.number(&owner, "air limit", limit_mps, &ZONE_AIR_LIMIT_MPS);
            }
        }
        if world.drones.is_empty() {
            self.errors.push(WorldError::NoDrones);
        }
        let mut names: Vec<&str> = world.drones.iter().map(|it| it.name.as_str()).collect();
        names.sort_unstable();
        let twice = names.windows(2).filter(|pair| pair[0] == pair[1]);
        (self.errors).extend(twice.map(|pair| WorldError::SameName(pair[0].to_owned())));
        for (index, drone) in world.drones.iter().enumerate() {
            self.name(format!("drone {}", index + 1), &drone.name);
            self.drone(drone, world.air.density_kg_per_m3());
            self.errors.extend(world.slow_to_stop(drone));
        }
    }

    /// Sizes of a solid, and the indices of a mesh.
    fn solid(&mut self, owner: &str, shape: &Solid) {
        match shape {
            Solid::Box { min_m, max_m } => self.corners(owner, min_m, max_m),
            Solid::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => {
                self.place(owner, "the base", base_m);
                self.number(owner, "radius", *radius_m, &SIZE_M);
                self.number(owner, "height", *height_m, &SIZE_M);
            }
            Solid::Mesh {
                vertices_m,
                triangles,
                ..
            } => {
                for vertex_m in vertices_m {
                    self.place(owner, "a vertex", vertex_m);
                }
                let size = vertices_m.len().max(triangles.len());
                self.count(owner, "triangles or vertices", size, MOST_TRIANGLES);
                let is_there = |corner: &u32| (*corner as usize) < vertices_m.len();
                if triangles.is_empty() || !triangles.iter().flatten().all(is_there) {
                    self.errors.push(WorldError::Mesh(owner.to_owned()));
                }
            }
        }
    }

    /// Airframe, limits, tasks and loads of a drone in air of a density (kg/m³).
    fn drone(&mut self, drone: &Drone, density_kg_per_m3: f64) {
        let owner = format!("drone `{}`", drone.name);
        let (vehicle, airframe) = (&drone.vehicle, &drone.vehicle.airframe);
        let (propellers, diameter_m) = (airframe.propellers(), airframe.propeller_diameter_m());
        let motor_distance_m = airframe.motor_distance_m();
        for (quantity, value, limits) in [
            ("mass", airframe.mass_kg(), &MASS_KG),
            ("number of propellers", f64::from(propellers), &PROPELLERS),
            ("propeller diameter", diameter_m, &PROPELLER_DIAMETER_M),
            ("motor distance", motor_distance_m, &MOTOR_DISTANCE_M),
            ("width factor", airframe.width_factor(), &WIDTH_FACTOR),
            ("body radius", vehicle.body_radius_m, &BODY_RADIUS_M),
            ("highest speed", vehicle.max_speed_mps, &MAX_SPEED_MPS),
            ("highest climb", vehicle.max_climb_mps, &VERTICAL_SPEED_MPS),
            (
                "highest descent",
                vehicle.max_descent_mps,
                &VERTICAL_SPEED_MPS,
            ),
            (
                "highest acceleration",
                vehicle.max_acceleration_mps2,
                &MAX_ACCELERATION_MPS2,
            ),
            ("highest jerk", vehicle.max_jerk_mps3, &MAX_JERK_MPS3),
            ("air limit", drone.air_limit, &AIR_LIMIT),
        ] {
            self.number(&owner, quantity, value, limits);
        }
        self.place(&owner, "the start", &drone.start_m);
        self.count(&owner, "tasks", drone.tasks.len(), MOST_ITEMS);
        let mut loads_kg = vec![0.0];
        for task in &drone.tasks {
            self.place(&owner, "a task", &task.to_m);
            self.number(&owner, "a dwell", task.dwell_s, &DWELL_S);
            if let Some([from_s, until_s]) = task.during_s {
                self.number(&owner, "the time it is due", from_s, &DURING_S);
                let after = Limits {
                    low: from_s.max(DURING_S.low),
                    ..DURING_S
                };
                self.number(&owner, "the time it stays until", until_s, &after);
            }
            if let Some(load_kg) = task.load_kg {
                self.number(&owner, "a load", load_kg, &LOAD_KG);
                loads_kg.push(load_kg);
            }
        }
        self.number(&owner, "time of all tasks", drone.busy_s(), &BUSY_S);
        let is_too_heavy = |mass_kg: &f64| is_overloaded(airframe, *mass_kg, density_kg_per_m3);
        let mut masses_kg = loads_kg.iter().map(|load_kg| airframe.mass_kg() + load_kg);
        if let Some(mass_kg) = masses_kg.find(is_too_heavy) {
            let drone = drone.name.clone();
            self.errors.push(WorldError::Mass { drone, mass_kg });
        }
    }

    /// Starts, tasks and landings against bounds and obstacles; effects that cannot be flown.
    fn places(&mut self, world: &World) {
        for found in misplaced(world, &Solids::of(world)) {
            let words = found.words(world).to_string();
            self.errors.push(WorldError::Misplaced { found, words });
        }
        let problems = world.effects.problems().into_iter();
        let problems = problems.map(|it| WorldError::Effects(it.to_string()));
        self.errors.extend(problems);
        let refused = airflow::Flown::of(&world.effects)
            .err()
            .into_iter()
            .flatten();
        let refused = refused.map(|(name, why)| format!("`{name}`: {why}"));
        let unfit = refused
            .chain(unfit(world, &world.drones))
            .map(WorldError::Effects);
        self.errors.extend(unfit);
    }
}

impl Misplaced {
    /// The gaps to obstacles with which a place is in order that is too near to one for those
    /// there are, as they are typed.
    fn bearable_gap(&self, world: &World) -> Option<String> {
        let bears_m = self.bears_m?;
        let planning = &world.planning;
        let gaps = [
            ("clearance_m", planning.clearance_m),
            ("tracking_m", planning.margins.tracking_m),
        ];
        let wider = gaps.into_iter().filter(|(_, gap_m)| *gap_m > bears_m);
        let wider: Vec<String> = wider.map(|(key, _)| format!("{key}: {bears_m}")).collect();
        (!wider.is_empty()).then(|| format!("planning: ({}) fits", wider.join(", ")))
    }

    /// What is wrong, as a problem that has no place in a text yet.
    pub(crate) fn words(&self, world: &World) -> Problem {
        let name = &world.drones[self.drone].name;
        let (subject, verb, word) = match self.spot {
            Spot::Start => (format!("`{name}`"), "starts", "start"),
            Spot::Task(index) => (format!("task {} of `{name}`", index + 1), "lies", "place"),
            Spot::Landing => (format!("`{name}`"), "lands", "place to come down from"),
        };
        let (place, label) = match self.why {
            Misfit::OutOfBounds { by_m } => {
                ("out of bounds".to_owned(), format!("{by_m:.2} m outside"))
            }
            Misfit::Unsupported { gap_m } => (
                "landed in mid-air".to_owned(),
                format!("{gap_m:.2} m above where it would rest on what is below"),
            ),
            Misfit::Obstacle {
                obstacle,
                distance_m,
                needs_m,
            } => {
                let solid = match world.obstacles.get(obstacle) {
                    Some(solid) => format!("obstacle `{}`", solid.name),
                    None => {
                        let mut zones = world.zones.iter().filter(|zone| zone.keep_out);
                        let zone = zones.nth(obstacle - world.obstacles.len());
                        format!("keep_out zone `{}`", zone.map_or("", |zone| &zone.name))
                    }
                };
                let needs = format!("its body needs {needs_m:.2} m to the face");
                if self.spot == Spot::Landing {
                    let (rest_z_m, passes_m) = (self.place_m.z, distance_m.max(0.0));
                    let label = format!(
                        "coming down from here to z = {rest_z_m:.2} m it passes {passes_m:.2} m from it; {needs}"
                    );
                    (format!("in {solid}"), label)
                } else if distance_m.abs() < 0.005 {
                    let label = format!("on its face; {needs}");
                    (format!("in {solid}"), label)
                } else if distance_m < 0.0 {
                    let label = format!("{:.2} m inside; {needs}", -distance_m);
                    (format!("inside {solid}"), label)
                } else {
                    let label = format!("{distance_m:.2} m from it; {needs}");
                    (format!("too near to {solid}"), label)
                }
            }
        };
        let nearest = self.nearest_m.map(|nearest_m| {
            let [x, y, z] = nearest_m.coords.into();
            format!("nearest free {word} is ({x:.2}, {y:.2}, {z:.2})")
        });
        let nearest = match (nearest, self.bearable_gap(world)) {
            (Some(nearest), Some(gap)) => Some(format!("{nearest}, or {gap}")),
            (nearest, gap) => nearest.or(gap),
        };
        Problem {
            message: format!("{subject} {verb} {place}"),
            label: Some(label),
            help: nearest,
            ..Problem::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::read_world;
    use crate::scenario::world::Obstacle;
    use crate::{Control, plan_world};

    #[test]
    fn airframes_that_hardly_stop_are_refused_where_they_have_to() {
        let text = |motion: &str| {
            format!(
                r#"(name: "slow", bounds_m: (min: (0, 0, 0), max: (20, 10, 8)),
                airframes: {{ "barge": (mass_kg: 1.6, propeller_diameter_m: 0.2, motor_distance_m: 0.45,
                max_jerk_mps3: 0.5) }},
                drones: [(name: "a", airframe: "barge", start_m: (1, 1, 1))], planning: (motion: {motion}))"#
            )
        };
        assert!(crate::read_world(&text("Straight")).is_ok());
        let error = crate::read_world(&text("Smooth")).expect_err("it takes 32 s to stop");
        let told = format!("{error:?}");
        assert!(
            told.contains("is slow to stop") && told.contains("32.0 s"),
            "{told}"
        );
        let mut world = crate::read_world(&text("Straight")).expect("in order");
        world.planning.motion = PathMotion::Smooth;
        assert!(world.check().is_err());
    }

    fn world() -> World {
        let text = r#"(name: "two", bounds_m: (min: (0, 0, 0), max: (20, 10, 8)), drones: [
            (name: "a", airframe: "kolibri", start_m: (1, 1, 1), tasks: [(to_m: (9, 9, 3), load_kg: 0.1)]),
            (name: "b", airframe: "kolibri", start_m: (1, 9, 1)),
        ])"#;
        read_world(text).expect("in order")
    }

    #[test]
    fn a_world_changed_by_hand_is_refused_with_all_that_is_wrong() {
        assert_eq!(world().check(), Ok(()));
        let mut broken = world();
        broken.drones[1].name = "a".to_owned();
        broken.drones[0].tasks[0].dwell_s = f64::INFINITY;
        broken.drones[0].tasks[0].load_kg = Some(2.0);
        broken.planning.cell_m = 0.0;
        let faults = broken.check().expect_err("four faults");
        let is_named = faults.contains(&WorldError::SameName("a".to_owned()));
        let ranges = faults.iter().filter_map(|fault| match fault {
            WorldError::OutOfRange { quantity, .. } => Some(*quantity),
            _ => None,
        });
        assert!(is_named, "{faults}");
        assert_eq!(
            ranges.collect::<Vec<_>>(),
            ["spacing", "a dwell", "time of all tasks"],
            "{faults}"
        );
        assert!(matches!(faults[faults.len() - 1], WorldError::Mass { .. }));
        assert_eq!(plan_world(&broken, &Control::QUIET), Err(faults));
    }

    #[test]
    fn a_start_moved_into_an_obstacle_is_refused_with_a_place_near_it() {
        let mut broken = world();
        broken.obstacles.push(Obstacle {
            name: "rack".to_owned(),
            shape: Solid::Box {
                min_m: Point3::new(0.0, 8.0, 0.0),
                max_m: Point3::new(3.0, 10.0, 2.0),
            },
        });
        let faults = broken.check().expect_err("in the rack");
        let [WorldError::Misplaced { found, words }] = &faults[..] else {
            panic!("{faults}");
        };
        assert_eq!((found.drone, found.spot), (1, Spot::Start));
        assert!(found.nearest_m.is_some());
        assert!(
            words.starts_with("`b` starts inside obstacle `rack`"),
            "{words}"
        );
    }
}
