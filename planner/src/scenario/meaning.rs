//! From what was written to what it means: airframes by name, meshes and the jet by file, places
//! against solids.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use airflow::{Air, Convection};
use nalgebra::Point3;

use super::Files;
use super::cell;
use super::fields::listed;
use super::finding_file::{self, citation, unfit};
use super::formations;
use super::jet_file;
use super::limits::{BUSY_S, STOP_S};
use super::mesh::mesh;
use super::problem::{Problem, did_you_mean, nearest};
use super::written::{self, Written};
use crate::plan::Origin;
use crate::plan::cause::as_typed;
use crate::plan::limits::{MOST_INDUCED_VELOCITY_MPS, MOST_MASS_RATIO};
use crate::scenario::placement::{Misfit, Spot, misplaced};
use crate::scenario::solid::Solids;
use crate::scenario::world::{
    AtEnd, Bounds, CONVECTION_DEFAULT, Drone, Margins, Obstacle, PathMotion, Planning, Relaxable,
    Solid, Task, Vehicle, World, Zone,
};

/// The world of all that is sound in `written`, and what is not.
pub(super) fn world(
    written: &Written,
    spoilt_airframes: &[String],
    files: &Files<'_>,
) -> (World, Vec<Problem>) {
    let mut meaning = Meaning {
        written,
        spoilt_airframes,
        air: written.air(),
        problems: Vec::new(),
        notes: Vec::new(),
        refused: BTreeSet::new(),
    };
    let jet = written.air.jet.as_ref();
    let jet = jet.and_then(|cited| meaning.cited(jet_file::read(cited, files)));
    let citation = citation(written, files.finding);
    let finding = citation.as_ref();
    let effects = finding.and_then(|cited| meaning.cited(finding_file::read(cited, files)));
    let effects = effects.unwrap_or_default();
    let obstacle = |obstacle: &written::Obstacle| {
        let shape = shape(obstacle, files).map_err(|problem| vec![*problem]);
        Some(Obstacle {
            name: obstacle.name.clone(),
            shape: meaning.kept(shape)??,
        })
    };
    let obstacles = written.obstacles.iter().filter_map(obstacle).collect();
    let zone = |zone: &written::Zone| Zone {
        name: zone.name.clone(),
        min_m: zone.min_m.value,
        max_m: zone.max_m.value,
        air_limit_mps: (zone.air_limit_mps)
            .or((!zone.keep_out).then_some(written::ZONE_AIR_LIMIT_DEFAULT_MPS)),
        keep_out: zone.keep_out,
    };
    let planning = &written.planning;
    let (low_m, high_m) = (&written.bounds_m.min.value, &written.bounds_m.max.value);
    for zone in &written.zones {
        let is_apart =
            |k: usize| zone.max_m.value[k] <= low_m[k] || zone.min_m.value[k] >= high_m[k];
        if (0..3).any(is_apart) {
            let name = &zone.name;
            (meaning.notes).push(format!(
                "zone `{name}` lies outside the bounds: no drone enters it"
            ));
        }
    }
    let mut world = World {
        name: written.name.clone(),
        bounds_m: Bounds {
            min: written.bounds_m.min.value,
            max: written.bounds_m.max.value,
        },
        origin: written.origin.map(|it| Origin {
            latitude_deg: it.latitude_deg,
            longitude_deg: it.longitude_deg,
            altitude_m: it.altitude_m,
            heading_deg: it.heading_deg,
        }),
        air: meaning.air,
        jet: jet.unwrap_or_default(),
        superposition: (airflow::Flown::of(&effects).ok())
            .and_then(|flown| flown.superposition)
            .unwrap_or(written.air.superposition),
        effects,
        // Its limits are narrower than those of any factor.
        convection: (written.air.convection)
            .unwrap_or(Some(CONVECTION_DEFAULT))
            .and_then(|range| Convection::new(range).ok()),
        obstacles,
        zones: written.zones.iter().map(zone).collect(),
        drones: Vec::new(),
        formations: Vec::new(),
        planning: Planning {
            cell_m: planning.cell_m.unwrap_or_default(),
            clearance_m: planning.clearance_m,
            margins: Margins {
                time_s: planning.time_margin_s,
                tracking_m: planning.tracking_m,
            },
            motion: planning.motion.unwrap_or_default(),
            relaxable: Relaxable {
                motion: planning.motion.is_none(),
                convection: written.air.convection.is_none(),
                spacing: planning.cell_m.is_none(),
            },
            seed: planning.seed,
            energy_weight: planning.energy_weight,
        },
        notes: Vec::new(),
    };
    let assigned = formations::assigned(written, &world);
    let (with_formations, formations, of_formations) = assigned;
    meaning.written = &with_formations;
    let (sound, unsound): (Vec<_>, Vec<_>) =
        meaning.drones().into_iter().partition(|it| it.is_sound);
    let (mut sources, drones): (Vec<_>, Vec<_>) =
        sound.into_iter().map(|it| (it.source, it.drone)).unzip();
    let Meaning {
        mut problems,
        notes,
        ..
    } = meaning;
    (world.drones, world.formations, world.notes) = (drones, formations, notes);
    if let Some(citation) = &citation {
        problems.extend(unfit(&world, &world.drones).into_iter().map(|why| {
            let problem = citation.problem("the finding does not fit this fleet".to_owned());
            problem.label(why)
        }));
    }
    // Places of the others are checked, too: a place out of bounds is reported beside an unknown
    // airframe.
    for it in unsound {
        sources.push(it.source);
        world.drones.push(it.drone);
    }
    for found in misplaced(&world, &Solids::of(&world)) {
        let source = sources[found.drone];
        let span = Some(place_of(source, &found.spot).clone());
        let is_out = matches!(found.why, Misfit::OutOfBounds { .. });
        // Of an unknown airframe nothing says how high it rests.
        let is_point = world.drones[found.drone].vehicle.body_radius_m == 0.0;
        let rests = matches!(found.why, Misfit::Unsupported { .. });
        let is_told = is_point && rests || is_out && of_formations.iter().any(|it| it.span == span);
        if !is_told && (found.spot != Spot::Start || source.has_start) {
            let words = found.words(&world);
            problems.push(Problem { span, ..words });
        }
    }
    problems.extend(of_formations);
    if planning.cell_m.is_none() {
        let (cell_m, why) = cell::chosen(&world);
        world.planning.cell_m = cell_m;
        world.notes.extend(why);
    } else if let Some((cell_m, why)) = cell::between_neighbours(&world) {
        world.planning.cell_m = cell_m;
        world.notes.push(why);
    }
    (world, problems)
}

/// `None` where the keys make no shape: that has been noted while reading.
fn shape(obstacle: &written::Obstacle, files: &Files<'_>) -> Result<Option<Solid>, Box<Problem>> {
    if let (Some(min), Some(max)) = (&obstacle.min_m, &obstacle.max_m) {
        return Ok(Some(Solid::Box {
            min_m: min.value,
            max_m: max.value,
        }));
    }
    if let (Some(base), Some(radius_m), Some(height_m)) =
        (&obstacle.base_m, obstacle.radius_m, obstacle.height_m)
    {
        return Ok(Some(Solid::Cylinder {
            base_m: base.value,
            radius_m,
            height_m,
        }));
    }
    let Some(file) = &obstacle.mesh else {
        return Ok(None);
    };
    let name = &obstacle.name;
    let unreadable = |why: String| {
        let message = format!("the mesh of obstacle `{name}` cannot be used");
        Box::new(Problem::at(&file.at, message).label(why))
    };
    let text = files.text(&file.value).map_err(unreadable)?;
    let at_m = obstacle.at_m.as_ref();
    let at_m = at_m.map_or(Point3::origin(), |place| place.value);
    let (vertices_m, triangles) = mesh(&text, at_m).map_err(unreadable)?;
    Ok(Some(Solid::Mesh {
        mesh: file.value.clone(),
        vertices_m,
        triangles,
    }))
}

/// Where in the text a misplaced drone's place stands.
fn place_of<'s>(source: &'s written::Drone, spot: &Spot) -> &'s Range<usize> {
    let last = || source.tasks.last();
    &match spot {
        Spot::Start => &source.start_m,
        Spot::Task(index) => &source.tasks[*index].to_m,
        Spot::Landing => last().map_or(&source.start_m, |task| &task.to_m),
    }
    .at
}

/// A drone beside what was written for it.
struct Sourced<'w> {
    /// As typed, with its places in the text.
    source: &'w written::Drone,
    /// As it is planned.
    drone: Drone,
    /// Whether all of it is in order; otherwise its places are checked, and nothing else.
    is_sound: bool,
}

/// What has been made of a scenario so far.
struct Meaning<'w> {
    /// What was typed.
    written: &'w Written,
    /// Airframes that are defined, but wrongly: noted where they are.
    spoilt_airframes: &'w [String],
    /// Temperature and pressure, for induced velocities.
    air: Air,
    /// What is wrong so far.
    problems: Vec<Problem>,
    /// What a reader of the plan should know.
    notes: Vec<String>,
    /// Airframes whose induced velocity has been refused.
    refused: BTreeSet<String>,
}

impl<'w> Meaning<'w> {
    /// What could be had; the problems in place of it are noted.
    fn kept<T>(&mut self, read: Result<T, Vec<Problem>>) -> Option<T> {
        read.map_err(|more| self.problems.extend(more)).ok()
    }

    /// What a cited file gives; its notes or its problems are noted.
    fn cited<T>(&mut self, read: Result<(T, Vec<String>), Vec<Problem>>) -> Option<T> {
        let (found, notes) = self.kept(read)?;
        self.notes.extend(notes);
        Some(found)
    }

    /// Every drone with what is typed of it, in the scenario's order; one of an unknown airframe
    /// stands in as a point.
    fn drones(&mut self) -> Vec<Sourced<'w>> {
        let mut vehicles: BTreeMap<&str, Option<Vehicle>> = BTreeMap::new();
        let mut drones = Vec::new();
        for source in &self.written.drones {
            let name = source.airframe.value.as_str();
            let vehicle = vehicles.entry(name).or_insert_with(|| {
                let vehicle = self.vehicle(source);
                vehicle.inspect(|vehicle| self.note(vehicle))
            });
            let vehicle = vehicle.as_ref();
            let bears = vehicle.is_some_and(|vehicle| self.bears_all(source, vehicle));
            self.appointments(source);
            if vehicle.is_none() {
                self.unknown_airframe(source);
            }
            let is_sound = bears && source.is_whole;
            if let Some(vehicle) = vehicle.cloned().or_else(point) {
                self.can_stop(source, &vehicle);
                let drone = self.drone(source, vehicle, is_sound);
                self.ends_in_time(source, &drone);
                drones.push(Sourced {
                    source,
                    drone,
                    is_sound,
                });
            }
        }
        drones
    }

    /// The scenario's own airframe of this name, or the preset; `None` where there is none, or it
    /// cannot fly.
    fn vehicle(&mut self, source: &written::Drone) -> Option<Vehicle> {
        let name = source.airframe.value.as_str();
        let is_own = self.written.airframes.contains_key(name);
        if !is_own && self.spoilt_airframes.iter().any(|spoilt| spoilt == name) {
            return None;
        }
        let vehicle = self.written.vehicle(name)?.map_err(|error| {
            let message = format!("airframe `{name}` cannot fly");
            vec![Problem::at(&source.airframe.at, message).label(error)]
        });
        self.kept(vehicle)
    }

    /// Notes an airframe whose acceleration and jerk are too low for smooth motion at its speed,
    /// where that is asked for.
    fn can_stop(&mut self, source: &written::Drone, vehicle: &Vehicle) {
        let is_smooth = self.written.planning.motion == Some(PathMotion::Smooth);
        let stop_s = vehicle.stop_s();
        if !is_smooth || STOP_S.contain(stop_s) {
            return;
        }
        let name = source.airframe.value.as_str();
        let message = format!(
            "airframe `{name}` of drone `{}` is slow to stop",
            source.name
        );
        let label = format!(
            "{stop_s:.1} s from {} m/s at {} m/s2 and {} m/s3, at most {:.0} s",
            vehicle.max_speed_mps,
            vehicle.max_acceleration_mps2,
            vehicle.max_jerk_mps3,
            STOP_S.high
        );
        let problem = Problem::at(&source.airframe.at, message).label(label);
        let help = "raise `max_jerk_mps3` or `max_acceleration_mps2`, or lower `max_speed_mps`";
        self.problems.push(problem.help(help.to_owned()));
    }

    /// Notes a name that is neither a preset nor the scenario's own, with the nearest that is.
    fn unknown_airframe(&mut self, source: &written::Drone) {
        let name = source.airframe.value.as_str();
        // Spoilt where it is defined, or not written at all: noted there, once.
        let is_noted = self.written.airframes.contains_key(name)
            || self.spoilt_airframes.iter().any(|spoilt| spoilt == name)
            || name.is_empty() && !source.is_whole;
        if is_noted {
            return;
        }
        let own = self.written.airframes.keys().map(String::as_str);
        let known: Vec<&str> = own.chain(airflow::Airframe::PRESETS).collect();
        let meant = nearest(name, known.iter().copied()).map(did_you_mean);
        let help = meant.unwrap_or_else(|| {
            let known: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
            format!("known are {}", listed(&known, "and"))
        });
        let message = format!("drone `{}` has an unknown airframe", source.name);
        let problem = Problem::at(&source.airframe.at, message);
        let problem = problem.label("neither in `airframes` nor a preset");
        self.problems.push(problem.help(help));
    }

    /// The drone as a planner takes it; one that is not sound hovers at its end.
    fn drone(&self, source: &written::Drone, vehicle: Vehicle, is_sound: bool) -> Drone {
        let task = |task: &written::Task| Task {
            to_m: task.to_m.value,
            dwell_s: task.dwell_s,
            load_kg: task.load_kg.as_ref().map(|load| load.value),
            during_s: task.during_s.as_ref().map(|during| during.value),
        };
        Drone {
            name: source.name.clone(),
            vehicle,
            start_m: source.start_m.value,
            at_start: source.at_start,
            tasks: source.tasks.iter().map(task).collect(),
            // Where it would land depends on what is not in order.
            at_end: match is_sound {
                true => source.at_end,
                false => AtEnd::Hover,
            },
            air_limit: source.air_limit.unwrap_or(self.written.planning.air_limit),
        }
    }

    /// Refuses tasks that take longer than a plan may last.
    fn ends_in_time(&mut self, source: &written::Drone, drone: &Drone) {
        let (busy_s, most_s) = (drone.busy_s(), BUSY_S.high);
        let last = source.tasks.last().filter(|_| !BUSY_S.contain(busy_s));
        let Some(last) = last else { return };
        let message = format!("the tasks of drone `{}` take too long", source.name);
        let label = format!("done after {busy_s:.1e} s at the earliest, dwells included");
        let help = format!("at most {most_s:.1e} s, a year");
        let problem = Problem::at(&last.to_m.at, message).label(label);
        self.problems.push(problem.help(help));
    }

    /// Refuses a task that is due while the drone is to be at another place.
    fn appointments(&mut self, source: &written::Drone) {
        let mut held: Option<(usize, &written::Task, f64)> = None;
        for (index, task) in source.tasks.iter().enumerate() {
            let Some(during) = &task.during_s else {
                continue;
            };
            let [due_s, until_s] = during.value;
            if let Some((other, before, held_s)) = held
                && due_s < held_s
                && before.to_m.value != task.to_m.value
            {
                let name = &source.name;
                let message = format!("drone `{name}` cannot be at task {} in time", index + 1);
                let label = format!("until {} s it is at task {}", as_typed(held_s), other + 1);
                self.problems
                    .push(Problem::at(&during.at, message).label(label));
            }
            if held.is_none_or(|(.., held_s)| until_s > held_s) {
                held = Some((index, task, until_s));
            }
        }
    }

    /// Whether a drone can carry itself and all of its loads.
    fn bears_all(&mut self, source: &written::Drone, vehicle: &Vehicle) -> bool {
        let before = self.problems.len();
        let own_kg = vehicle.airframe.mass_kg();
        let most_kg = own_kg * (MOST_MASS_RATIO - 1.0);
        let own = &source.airframe.at;
        self.bears(source, vehicle, (own_kg, own, "when it hovers"));
        for (index, task) in source.tasks.iter().enumerate() {
            let Some(load) = &task.load_kg else { continue };
            if load.value <= most_kg {
                let mass_kg = own_kg + load.value;
                self.bears(source, vehicle, (mass_kg, &load.at, "with this load"));
                continue;
            }
            let (task, name) = (index + 1, &source.name);
            let message = format!("task {task} of drone `{name}` loads more than it could lift");
            let own_kg = as_typed(own_kg);
            let label = format!("`{}` weighs {own_kg} kg itself", vehicle.airframe.name());
            let times = MOST_MASS_RATIO - 1.0;
            // Rounded, it would not do.
            let most_g = (most_kg * 1000.0).floor();
            let help = format!("at most {} kg: {times} times its own mass", most_g / 1000.0);
            let problem = Problem::at(&load.at, message).label(label);
            self.problems.push(problem.help(help));
        }
        self.problems.len() == before
    }

    /// Refuses a mass (kg) that would need air faster than any rotor's: a unit mistaken, once per
    /// airframe.
    fn bears(
        &mut self,
        source: &written::Drone,
        vehicle: &Vehicle,
        (mass_kg, at, when): (f64, &Range<usize>, &str),
    ) {
        let airframe = &vehicle.airframe;
        let name = airframe.name();
        let speed_mps = airframe.hover_induced_velocity_mps(mass_kg, self.air.density_kg_per_m3());
        if speed_mps <= MOST_INDUCED_VELOCITY_MPS || !self.refused.insert(name.to_owned()) {
            return;
        }
        let message = format!("airframe `{name}` would induce {speed_mps:.0} m/s {when}");
        let area_m2 = airframe.disc_area_m2();
        let label = format!("{} kg on {area_m2:.4} m2 of rotor discs", as_typed(mass_kg));
        let problem = Problem::at(at, message).label(label);
        self.problems.push(problem.note(format!("first used by drone `{}`", source.name)).help(format!(
            "at most {MOST_INDUCED_VELOCITY_MPS} m/s: check mass_kg (kg) and propeller_diameter_m (m)"
        )));
    }

    /// Notes what a reader of the plan should know of an airframe.
    fn note(&mut self, vehicle: &Vehicle) {
        let (airframe, body_radius_m) = (&vehicle.airframe, vehicle.body_radius_m);
        let name = airframe.name();
        let own = self.written.airframes.contains_key(name);
        if own && airflow::Airframe::PRESETS.contains(&name) {
            self.notes.push(format!(
                "airframe `{name}` of this scenario replaces the preset of that name"
            ));
        }
        if !own {
            self.notes.extend(airframe.fit_note());
        }
        if !airframe.has_near_field_model() {
            self.notes.push(format!(
                "airframe `{name}` has {} propellers and the near-field model knows four: within 2.5 motor \
                 distances below it the column is closed, and beside it the air is taken as at that depth",
                airframe.propellers()
            ));
        }
        if body_radius_m < airframe.tip_radius_m() {
            self.notes.push(format!(
                "the body radius of `{name}`, {} m, does not reach its rotor tips at {:.3} m",
                as_typed(body_radius_m),
                airframe.tip_radius_m()
            ));
        }
    }
}

/// In place of an unknown airframe: where it cannot be, no body can.
fn point() -> Option<Vehicle> {
    let [preset, ..] = airflow::Airframe::PRESETS;
    let airframe = airflow::Airframe::preset(preset)?;
    let density_kg_per_m3 = Air::default().density_kg_per_m3();
    Some(Vehicle {
        body_radius_m: 0.0,
        ..Vehicle::new(airframe, written::MAX_SPEED_DEFAULT_MPS, density_kg_per_m3)
    })
}

#[cfg(test)]
mod tests {
    use crate::scenario::read_world;

    #[test]
    fn where_a_drone_cannot_be_is_reported_beside_what_else_is_wrong_with_it() {
        let wrongs = [
            (
                "airframe: \"colibri\", start_m: (1, 1, 1)",
                "unknown airframe",
            ),
            ("start_m: (1, 1, 1)", "has no `airframe`"),
            (
                "airframe: \"kolibri\", start_m: (1, 1, 1), air_limit: 9",
                "out of range",
            ),
            (
                "airframe: \"kolibri\", start_m: (1, 1, 1), at_ende: Land",
                "no field `at_ende`",
            ),
            ("airframe: \"kolibri\", start_m: 1", "must be (x, y, z)"),
            (
                "airframe: \"ton\", start_m: (1, 1, 1)",
                "airframe `ton` would induce",
            ),
        ];
        for (fields, wrong) in wrongs {
            let text = format!(
                r#"(name: "s", bounds_m: (min: (0, 0, 0), max: (20, 10, 8)), airframes: {{
                    "ton": (mass_kg: 1000, propeller_diameter_m: 0.1, motor_distance_m: 0.3) }},
                drones: [(name: "k1", {fields}, tasks: [(to_m: (5, 5, 3)), (to_m: (21, 1, 3))])])"#
            );
            let problems = read_world(&text).expect_err(wrong);
            let messages: Vec<&str> = (problems.iter()).map(|it| it.message.as_str()).collect();
            let told = |words: &str| messages.iter().any(|message| message.contains(words));
            assert!(told(wrong), "{fields}: {messages:?}");
            assert!(
                told("task 2 of `k1` lies out of bounds"),
                "{fields}: {messages:?}"
            );
            assert_eq!(messages.len(), 2, "{fields}: {messages:?}");
        }
    }
}
