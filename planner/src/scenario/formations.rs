//! Goals that any drone of a group may take: read, checked against the bounds and the spacing, and
//! assigned to drones, as ordinary tasks from then on.
//!
//! Which drone takes which place is an assignment of least cost (H. W. Kuhn, "The Hungarian method
//! for the assignment problem", Naval Research Logistics Quarterly 2, 1955). A drone's cost at a
//! place is the time of its straight flight there and, in a fleet of several airframes, the power
//! that its wake costs the other places and theirs costs it, while all stay. The others are not
//! known before: their mean stands for each. With one airframe this power is the same in every
//! assignment. A drone takes a place barred by solids, zones or the next place only if no
//! assignment avoids it.

use std::borrow::Cow;
use std::cmp::Reverse;
use std::f64::consts::TAU;
use std::ops::Range;

use airflow::Flown;
use costmap::volumes::iso_speed::IsoSpeedVolume;
use costmap::wake::fleet::wake_of;
use costmap::wake::surfaces::BlockingSurfaces;
use nalgebra::{Point3, Vector3};
use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;
use petgraph::algo::dsatur_coloring;
use petgraph::graph::{NodeIndex, UnGraph};

use super::fields::{Field, Reader, within};
use super::limits::{DWELL_S, SIZE_M};
use super::placement::{landing_misfit, misfit};
use super::problem::{Problem, did_you_mean, nearest};
use super::read::during;
use super::solid::{Solids, top};
use super::source::Value;
use super::world::{AtEnd, PathMotion, Vehicle, World};
use super::written::{At, Bounds, Drone, Formation, Place, Round, Task, Written};
use crate::plan::trajectory::SAME_PLACE_M;

/// Most drones of one formation: chosen here; the assignment takes the cube of their number.
const MOST_ASSIGNED: usize = 1000;
/// Cost of being late in smooth motion (ms): chosen here, more than all flights of a formation
/// together.
const LATE_MS: i64 = 1_000_000_000_000;
/// Cost of what cannot be (ms): chosen here, as much as if all were late.
pub(super) const NEVER_MS: i64 = LATE_MS * MOST_ASSIGNED as i64;
/// The golden angle (rad), by which places of a sphere turn from one to the next: Á. González,
/// "Measurement of areas on a sphere using Fibonacci and latitude-longitude lattices",
/// Mathematical Geosciences 42, 2010.
const GOLDEN_ANGLE_RAD: f64 = 2.399_963_229_728_653;

/// One formation; `None` unless its keys make exactly one set of places.
pub(super) fn formation<'t>(
    reader: &mut Reader<'t>,
    value: Value<'t>,
    index: usize,
) -> Option<Formation> {
    let mut record = reader.record(value, "Formation", format!("formation {}", index + 1))?;
    let before = reader.problems.len();
    let drones = record.optional(reader, "drones", |reader, field| {
        let name = |reader: &mut Reader<'t>, value, _| reader.text(Field { value, ..field });
        let before = reader.problems.len();
        let names = reader.list(field, name);
        if names.is_empty() && reader.problems.len() == before {
            let message = format!("{} has no drones", field.subject);
            let problem = Problem::at(&field.value.at(), message).label("at least one is required");
            reader.report(problem.help("leave `drones` out for all"));
        }
        Some(names)
    });
    let to_m = record.optional(reader, "to_m", |reader, field| {
        let place = |reader: &mut Reader<'t>, value, _| reader.place(Field { value, ..field });
        let places = reader.list(field, place);
        Some(At {
            value: places,
            at: field.value.head(),
        })
    });
    let circle = record.optional(reader, "circle", round);
    let sphere = record.optional(reader, "sphere", round);
    let mut height = |reader: &mut Reader<'t>, key| {
        record.optional(reader, key, |reader, field| {
            Some(field.found(reader.number(field, &SIZE_M)?))
        })
    };
    let home_m = height(reader, "home_m");
    let layer_m = height(reader, "layer_m");
    let dwell_s = record.optional(reader, "dwell_s", within(&DWELL_S));
    let during_s = record.optional(reader, "during_s", during);
    let shapes = ["to_m", "circle", "sphere", "home_m"].map(|key| record.has(key));
    let count = shapes.iter().filter(|is_there| **is_there).count();
    if count != 1 {
        let message = format!("{} has {count} sets of places", record.subject);
        let problem = Problem::at(record.head(), message).label("exactly one is required");
        reader.report(problem.help("give to_m, circle, sphere or home_m"));
    }
    if let (None, Some(layer_m)) = (&home_m, &layer_m) {
        let message = format!("{} has `layer_m` without `home_m`", record.subject);
        let problem = Problem::at(&layer_m.at, message).label("places are where they are given");
        reader.report(problem.help("layers are of drones above their own starts"));
    }
    record.close(reader);
    let formation = Formation {
        index,
        drones,
        to_m,
        circle,
        sphere,
        home_m,
        layer_m,
        dwell_s: dwell_s.unwrap_or_default(),
        during_s,
        at: value.head(),
    };
    (reader.problems.len() == before).then_some(formation)
}

/// A circle or a sphere.
fn round<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>) -> Option<At<Round>> {
    let subject = format!("`{}` of {}", field.key, field.subject);
    let mut record = reader.record(field.value, "Round", subject)?;
    let centre_m = record.required(reader, "centre_m", Reader::place);
    let radius_m = record.required(reader, "radius_m", |reader, field| {
        reader.number(field, &SIZE_M)
    });
    record.close(reader);
    Some(At {
        value: Round {
            centre_m: centre_m?,
            radius_m: radius_m?,
        },
        at: field.value.head(),
    })
}

/// The scenario with the goals of its formations among the tasks of its drones, and what is wrong
/// with the formations; formations without a place for each drone are left out. Between them the
/// tasks, as [`World::formations`]. `place`: the world without drones.
pub(super) fn assigned<'w>(
    written: &'w Written,
    place: &World,
) -> (Cow<'w, Written>, TasksOf, Vec<Problem>) {
    if written.formations.is_empty() {
        return (Cow::Borrowed(written), Vec::new(), Vec::new());
    }
    let members = written
        .drones
        .iter()
        .map(|drone| FormationMember::of(drone, written));
    let mut assignment = Assignment {
        place,
        members: members.collect(),
        with_tasks: written.clone(),
        tasks: Vec::new(),
        problems: Vec::new(),
    };
    let mut later = written.formations.as_slice();
    while let Some((formation, rest)) = later.split_first() {
        let subject = format!("formation {}", formation.index + 1);
        assignment.add(formation, rest, &subject);
        later = rest;
    }
    let Assignment {
        with_tasks,
        tasks,
        problems,
        ..
    } = assignment;
    (Cow::Owned(with_tasks), tasks, problems)
}

/// The tasks of each formation, as [`World::formations`].
type TasksOf = Vec<Vec<(String, usize)>>;

/// The part of a drone that formations need.
struct FormationMember {
    /// The vehicle; `None` where its airframe is not in order, which is reported elsewhere.
    vehicle: Option<Vehicle>,
    /// Where it is after its tasks (m).
    at_m: Point3<f64>,
    /// When that is, at the earliest (s): flying straight, and in the motion that is asked for.
    ready_s: [f64; 2],
}

impl FormationMember {
    /// After its own tasks.
    fn of(drone: &Drone, written: &Written) -> FormationMember {
        let mut member = FormationMember {
            vehicle: written.vehicle(&drone.airframe.value).and_then(Result::ok),
            at_m: drone.start_m.value,
            ready_s: [0.0; 2],
        };
        for task in &drone.tasks {
            member.goes(task, written.planning.motion);
        }
        member
    }

    /// When the drone is at a place at the earliest (s), as [`FormationMember::ready_s`].
    fn there_s(&self, to_m: &Point3<f64>, motion: Option<PathMotion>) -> [f64; 2] {
        let moves = (to_m - self.at_m).norm() > SAME_PLACE_M;
        let is_smooth = moves && motion.unwrap_or_default() == PathMotion::Smooth;
        // From rest to rest.
        let turns = self.vehicle.as_ref().filter(|_| is_smooth);
        let turns_s = turns.map_or(0.0, Vehicle::stop_s);
        let [straight_s, smooth_s] = self.ready_s.map(|it| it + self.flight_s(to_m));
        [straight_s, smooth_s + turns_s]
    }

    /// The least time of a flight from the drone's place (s).
    fn flight_s(&self, to_m: &Point3<f64>) -> f64 {
        let Some(vehicle) = &self.vehicle else {
            return 0.0;
        };
        let way_m = to_m - self.at_m;
        let rise_s = way_m.z / vehicle.max_climb_mps;
        let sink_s = -way_m.z / vehicle.max_descent_mps;
        (way_m.norm() / vehicle.max_speed_mps)
            .max(rise_s)
            .max(sink_s)
    }

    /// Flies to a task, and does it.
    fn goes(&mut self, task: &Task, motion: Option<PathMotion>) {
        let until_s = task.during_s.as_ref().map_or(0.0, |it| it.value[1]);
        let there_s = self.there_s(&task.to_m.value, motion);
        self.ready_s = there_s.map(|it| (it + task.dwell_s).max(until_s));
        self.at_m = task.to_m.value;
    }
}

/// What drones at a place have in common.
#[derive(PartialEq)]
struct Hovering<'a> {
    /// The vehicle.
    vehicle: &'a Vehicle,
    /// With its load (kg).
    mass_kg: f64,
    /// The drone lands from there.
    lands: bool,
    /// Smallest body radius of the group's others (m).
    beside_m: f64,
}

/// Formations assigned to drones so far.
struct Assignment<'p> {
    /// The world, without drones.
    place: &'p World,
    /// In the scenario's order.
    members: Vec<FormationMember>,
    /// With the formations' tasks.
    with_tasks: Written,
    /// These tasks.
    tasks: TasksOf,
    /// What is wrong with formations.
    problems: Vec<Problem>,
}

impl Assignment<'_> {
    /// Assigns the places of a formation, `subject` in messages, before the `later` ones.
    fn add(&mut self, formation: &Formation, later: &[Formation], subject: &str) {
        let before = self.problems.len();
        let group = self.group(formation, subject);
        if group.len() > MOST_ASSIGNED {
            let message = format!("{subject} is too large");
            let label = format!("{} drones, at most {MOST_ASSIGNED}", group.len());
            let problem = Problem::at(&formation.at, message).label(label);
            self.problems.push(problem);
            return;
        }
        let layers = self.layers(formation, &group);
        let places = self.places(formation, &group, &layers);
        if places.len() != group.len() {
            let at = formation.to_m.as_ref().map_or(&formation.at, |it| &it.at);
            // Unknown names have been reported.
            if self.problems.len() == before {
                let (places, drones) = (places.len(), group.len());
                let counted = |many: usize, of: &str| match many {
                    1 => format!("1 {of}"),
                    _ => format!("{many} {of}s"),
                };
                let (places, drones) = (counted(places, "place"), counted(drones, "drone"));
                let message = format!("{subject} has {places} for {drones}");
                let problem = Problem::at(at, message).label("as many of both are required");
                self.problems.push(problem);
            }
            return;
        }
        self.are_inside(&places, subject);
        self.are_apart(formation, &group, &places, subject);
        // Places that are wrong are assigned in their order, so that all of them are checked
        // against obstacles.
        let is_sound = self.problems.len() == before;
        let taken = match formation.home_m {
            None if is_sound => least_cost(&self.costs_ms(formation, &group, &places, later)),
            _ => (0..places.len()).collect(),
        };
        if is_sound {
            self.are_in_time(formation, (&group, &taken), &places, subject);
        }
        if formation.home_m.is_none() {
            let drones = group.iter().map(|&drone| &self.with_tasks.drones[drone]);
            let tasks = drones.map(|drone| (drone.name.clone(), drone.tasks.len()));
            self.tasks.push(tasks.collect());
        }
        let after_s = self.landing_s(&group, &places, &layers);
        for ((&drone, place), layer) in group.iter().zip(taken).zip(layers) {
            let mut during_s = formation.during_s.clone();
            if self.lands_from_here(drone, later) {
                // Layers land one after another, the lowest first.
                let lower_s: f64 = after_s[..layer].iter().sum();
                during_s.iter_mut().for_each(|it| it.value[1] += lower_s);
            }
            let task = Task {
                to_m: places[place].clone(),
                dwell_s: formation.dwell_s,
                load_kg: None,
                during_s,
            };
            self.members[drone].goes(&task, self.with_tasks.planning.motion);
            self.with_tasks.drones[drone].tasks.push(task);
        }
    }

    /// Indices of a formation's drones, in its order.
    fn group(&mut self, formation: &Formation, subject: &str) -> Vec<usize> {
        let drones = &self.with_tasks.drones;
        let Some(names) = &formation.drones else {
            return (0..drones.len()).collect();
        };
        let mut group = Vec::new();
        for name in names {
            let found = drones.iter().position(|it| it.name == name.value);
            let problem = match found {
                Some(index) if !group.contains(&index) => {
                    group.push(index);
                    continue;
                }
                Some(_) => Problem::at(&name.at, format!("{subject} names `{}` twice", name.value)),
                None => {
                    let known = drones.iter().map(|it| it.name.as_str());
                    let meant = nearest(&name.value, known).map(did_you_mean);
                    let message = format!("{subject} has no drone `{}`", name.value);
                    Problem::at(&name.at, message).maybe_help(meant)
                }
            };
            self.problems.push(problem);
        }
        group
    }

    /// The places of a formation, in its order (m).
    fn places(&self, formation: &Formation, group: &[usize], layers: &[usize]) -> Vec<Place> {
        if let Some(listed) = &formation.to_m {
            return listed.value.clone();
        }
        let count = group.len() as f64;
        let places = |at: &Range<usize>, place_m: &dyn Fn(usize) -> Point3<f64>| {
            let place = |index| At {
                value: rounded(place_m(index)),
                at: at.clone(),
            };
            (0..group.len()).map(place).collect()
        };
        if let Some(At { value, at }) = &formation.circle {
            return places(at, &|index| {
                let (sin, cos) = (TAU * index as f64 / count).sin_cos();
                value.centre_m.value + value.radius_m * Vector3::new(cos, sin, 0.0)
            });
        }
        if let Some(At { value, at }) = &formation.sphere {
            return places(at, &|index| {
                let (sin, cos) = (GOLDEN_ANGLE_RAD * index as f64).sin_cos();
                let up = 1.0 - (2.0 * index as f64 + 1.0) / count;
                let beside = (1.0 - up * up).sqrt();
                value.centre_m.value + value.radius_m * Vector3::new(beside * cos, beside * sin, up)
            });
        }
        let home = formation.home_m.iter();
        let layer_m = formation.layer_m.as_ref().map_or(0.0, |it| it.value);
        home.flat_map(|At { value, at }| {
            places(at, &|index| {
                let start_m = self.with_tasks.drones[group[index]].start_m.value;
                start_m + Vector3::z() * (*value + layers[index] as f64 * layer_m)
            })
        })
        .collect()
    }

    /// How long the drones of each layer take to land from their places, down to the floor (s).
    fn landing_s(&self, group: &[usize], places: &[Place], layers: &[usize]) -> Vec<f64> {
        let floor_z_m = self.with_tasks.bounds_m.min.value.z;
        let mut takes_s = vec![0.0; layers.iter().max().map_or(0, |top| top + 1)];
        for ((&drone, place), &layer) in group.iter().zip(places).zip(layers) {
            if let Some(vehicle) = &self.members[drone].vehicle {
                let own_s = vehicle.landing_s(place.value.z - floor_z_m);
                takes_s[layer] = own_s.max(takes_s[layer]);
            }
        }
        takes_s
    }

    /// Whether a drone lands from this formation: in none of `later`.
    fn lands_from_here(&self, drone: usize, later: &[Formation]) -> bool {
        let drone = &self.with_tasks.drones[drone];
        let is_in = |formation: &Formation| {
            let names = formation.drones.as_ref();
            names.is_none_or(|all| all.iter().any(|name| name.value == drone.name))
        };
        drone.at_end == AtEnd::Land && !later.iter().any(is_in)
    }

    /// The layer of each drone of a group over its start, from the lowest on: drones too near to
    /// fly beside one another are in different layers (D. Brélaz, "New methods to color the
    /// vertices of a graph", Communications of the ACM 22, 1979); lower ones hold more drones.
    fn layers(&self, formation: &Formation, group: &[usize]) -> Vec<usize> {
        let count = group.len();
        if formation.layer_m.is_none() {
            return vec![0; count];
        }
        let start_m = |index: usize| self.with_tasks.drones[group[index]].start_m.value;
        let pairs = (0..count).flat_map(|b| (0..b).map(move |a| (a, b)));
        let are_near = |&(a, b): &(usize, usize)| {
            let needs_m = self.apart_m([group[a], group[b]]);
            (start_m(a) - start_m(b)).xy().norm() < needs_m.unwrap_or_default()
        };
        let mut near = UnGraph::<(), ()>::with_capacity(count, 0);
        let nodes: Vec<NodeIndex> = (0..count).map(|_| near.add_node(())).collect();
        for (a, b) in pairs.filter(are_near) {
            near.add_edge(nodes[a], nodes[b], ());
        }
        let (colours, number) = dsatur_coloring(&near);
        let colour_of: Vec<usize> = nodes.iter().map(|node| colours[node]).collect();
        let mut by_size: Vec<usize> = (0..number).collect();
        by_size.sort_by_key(|colour| {
            let same = colour_of.iter().filter(|it| *it == colour);
            Reverse(same.count())
        });
        let layer_of = |colour: &usize| by_size.iter().position(|it| it == colour);
        let layers = colour_of.iter().filter_map(layer_of);
        layers.collect()
    }

    /// How far apart the centres of two flying drones must be (m); `None` where an airframe is not
    /// in order.
    fn apart_m(&self, pair: [usize; 2]) -> Option<f64> {
        let [a, b] = pair.map(|drone| self.members[drone].vehicle.as_ref());
        let gap_m = self.place.planning.gap_to_bodies_m(2);
        Some(a?.body_radius_m + b?.body_radius_m + gap_m)
    }

    /// Reports places out of bounds: each that is listed, those of a shape together.
    fn are_inside(&mut self, places: &[Place], subject: &str) {
        let Bounds { min, max } = &self.with_tasks.bounds_m;
        let is_outside = |place: &&Place| {
            let at = place.value;
            (0..3).any(|axis| at[axis] < min.value[axis] || at[axis] > max.value[axis])
        };
        let outside: Vec<&Place> = places.iter().filter(is_outside).collect();
        for same in outside.chunk_by(|a, b| a.at == b.at) {
            let [first, ..] = same else { continue };
            let Point3 { coords } = first.value;
            let message = match same.len() {
                1 => format!("a place of {subject} lies out of bounds"),
                count => format!("{count} places of {subject} lie out of bounds"),
            };
            let label = format!("({:.2}, {:.2}, {:.2})", coords.x, coords.y, coords.z);
            let problem = Problem::at(&first.at, message).label(label);
            self.problems.push(problem);
        }
    }

    /// Reports places too close for any two bodies of the group: each that is listed, the nearest
    /// two of a shape; of `home_m` where drones are to be there together.
    fn are_apart(
        &mut self,
        formation: &Formation,
        group: &[usize],
        places: &[Place],
        subject: &str,
    ) {
        let is_together = formation.during_s.is_some() || formation.layer_m.is_some();
        if formation.home_m.is_some() && !is_together {
            return;
        }
        // The assignment is not known yet: the smallest drone could take each place.
        let needs_m = group.iter().filter_map(|&drone| self.apart_m([drone; 2]));
        let needs_m = needs_m.fold(f64::INFINITY, f64::min);
        let mut near: Vec<(&Range<usize>, f64)> = Vec::new();
        for (index, At { value, at }) in places.iter().enumerate().skip(1) {
            let before = places[..index].iter();
            let nearest_m = before.map(|it| (it.value - value).norm());
            let nearest_m = nearest_m.fold(f64::INFINITY, f64::min);
            match near.last_mut().filter(|(known, _)| *known == at) {
                Some((_, known_m)) => *known_m = known_m.min(nearest_m),
                None => near.push((at, nearest_m)),
            }
        }
        let near = near.into_iter();
        for (at, nearest_m) in near.filter(|it| needs_m.is_finite() && it.1 < needs_m) {
            let message = format!("places of {subject} are too near to one another");
            let label = format!("{nearest_m:.2} m from another, at least {needs_m:.2} m");
            let (at, help) = match (&formation.home_m, &formation.layer_m) {
                (Some(_), Some(layer_m)) => (&layer_m.at, "layers farther from one another"),
                (Some(_), None) => (
                    at,
                    "`layer_m` lets neighbours hover one above the other's height",
                ),
                _ => (
                    at,
                    "two bodies, and the clearance or both tracking margins, whichever is more",
                ),
            };
            let problem = Problem::at(at, message).label(label).help(help);
            self.problems.push(problem);
        }
    }

    /// What each drone of a group costs at each place (ms), before later formations.
    fn costs_ms(
        &self,
        formation: &Formation,
        group: &[usize],
        places: &[Place],
        later: &[Formation],
    ) -> Vec<Vec<i64>> {
        let prices_s = self.prices_s(formation, group, places);
        let is_barred = self.is_barred(group, places, later);
        let due_s = formation.during_s.as_ref();
        let due_s = due_s.map_or(f64::INFINITY, |it| it.value[0]);
        let cost_ms = |drone: usize, place: usize, price_s: f64| {
            let member = &self.members[group[drone]];
            let to_m = &places[place].value;
            let flight_s = member.flight_s(to_m);
            let there_s = member.there_s(to_m, self.with_tasks.planning.motion);
            let [never, late] = there_s.map(|it| it > due_s);
            let never = never || is_barred.get(drone).is_some_and(|it| it[place]);
            let added_ms = i64::from(never) * NEVER_MS + i64::from(late) * LATE_MS;
            (1000.0 * (flight_s + price_s)).round() as i64 + added_ms
        };
        let row = |drone: usize| -> Vec<i64> {
            let prices_s = prices_s.get(drone);
            let price_s = |place| prices_s.map_or(0.0, |it: &Vec<f64>| it[place]);
            let places = 0..places.len();
            places
                .map(|place| cost_ms(drone, place, price_s(place)))
                .collect()
        };
        (0..group.len()).map(row).collect()
    }

    /// Where each drone of a group cannot be, of these places, before later formations: too near to
    /// a solid, above a zone whose limit its own wake breaks, or nearer to another place than the
    /// smallest other drone allows. Empty where an airframe is not in order.
    fn is_barred(&self, group: &[usize], places: &[Place], later: &[Formation]) -> Vec<Vec<bool>> {
        let body_m = |drone: usize| Some(self.members[drone].vehicle.as_ref()?.body_radius_m);
        let bodies_m: Option<Vec<f64>> = group.iter().map(|&drone| body_m(drone)).collect();
        let mut by_size = bodies_m.unwrap_or_default();
        by_size.sort_by(f64::total_cmp);
        let mut kinds: Vec<Hovering<'_>> = Vec::new();
        let mut kind_of = Vec::new();
        for &drone in group {
            let Some(vehicle) = &self.members[drone].vehicle else {
                return Vec::new();
            };
            let mut tasks = self.with_tasks.drones[drone].tasks.iter().rev();
            let load_kg = tasks.find_map(|task| task.load_kg.as_ref());
            let is_smallest = by_size.first() == Some(&vehicle.body_radius_m);
            let beside_m = by_size.get(usize::from(is_smallest));
            let kind = Hovering {
                vehicle,
                mass_kg: vehicle.airframe.mass_kg() + load_kg.map_or(0.0, |it| it.value),
                lands: self.lands_from_here(drone, later),
                beside_m: beside_m.copied().unwrap_or(f64::NEG_INFINITY),
            };
            let known = kinds.iter().position(|it| *it == kind);
            kind_of.push(known.unwrap_or(kinds.len()));
            if known.is_none() {
                kinds.push(kind);
            }
        }
        let (world, solids) = (self.place, Solids::of(self.place));
        let tops = world.obstacles.iter().filter_map(top).collect();
        let surfaces = BlockingSurfaces::new(world.bounds_m.min.z, tops);
        let planning = &world.planning;
        let (density_kg_per_m3, flown) = (world.air.density_kg_per_m3(), self.flown());
        let air = (&world.jet, &flown);
        let nearest_m = |place: usize| {
            let others = places
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != place);
            let others_m = others.map(|(_, it)| (it.value - places[place].value).norm());
            others_m.fold(f64::INFINITY, f64::min)
        };
        let nearest_m: Vec<f64> = (0..places.len()).map(nearest_m).collect();
        let barred = |kind: &Hovering<'_>| -> Vec<bool> {
            let body_m = kind.vehicle.body_radius_m;
            let airframe = &kind.vehicle.airframe;
            let wake = wake_of(airframe, kind.mass_kg, density_kg_per_m3, air);
            let beside_m = body_m + kind.beside_m + planning.gap_to_bodies_m(2);
            let zones = world.zones.iter().filter_map(|zone| {
                let limit_mps = zone.air_limit_mps? - flown.return_flow_mps;
                Some((zone, IsoSpeedVolume::new(&wake, limit_mps)?))
            });
            let zones: Vec<_> = zones.collect();
            let is_barred = |(place, nearest_m): (&Place, &f64)| {
                let at_m = place.value;
                let ends_z_m = surfaces.wake_end_z_m(&wake, &at_m, &at_m);
                *nearest_m < beside_m - SAME_PLACE_M
                    || misfit(world, &solids, at_m, body_m + planning.gap_to_solids_m()).is_some()
                    || kind.lands && landing_misfit(world, &solids, at_m, body_m).is_some()
                    || zones.iter().any(|(zone, faster)| {
                        let [low_m, mut high_m] = [zone.min_m, zone.max_m].map(|it| it - at_m);
                        let low_z_m = low_m.z.max(ends_z_m - at_m.z);
                        high_m.z = high_m.z.max(low_z_m);
                        faster.enters([Vector3::new(low_m.x, low_m.y, low_z_m), high_m])
                    })
            };
            places.iter().zip(&nearest_m).map(is_barred).collect()
        };
        let barred: Vec<Vec<bool>> = kinds.iter().map(barred).collect();
        kind_of.iter().map(|kind| barred[*kind].clone()).collect()
    }

    /// The flow model as the fleet flies it.
    fn flown(&self) -> Flown {
        let vehicles = self.members.iter().filter_map(|it| it.vehicle.as_ref());
        let accelerations = vehicles.map(|it| it.max_acceleration_mps2);
        let flown = self.place.flown();
        flown.accelerating(accelerations.fold(0.0, f64::max))
    }

    /// What downwash costs where each drone of a group could be (s); empty where it is the same for
    /// every assignment.
    fn prices_s(&self, formation: &Formation, group: &[usize], places: &[Place]) -> Vec<Vec<f64>> {
        let vehicles = group
            .iter()
            .map(|&drone| self.members[drone].vehicle.as_ref());
        let Some(vehicles) = vehicles.collect::<Option<Vec<&Vehicle>>>() else {
            return Vec::new();
        };
        let mut kinds: Vec<&Vehicle> = Vec::new();
        let mut kind_of = Vec::new();
        for vehicle in vehicles {
            let known = kinds.iter().position(|kind| *kind == vehicle);
            kind_of.push(known.unwrap_or(kinds.len()));
            if known.is_none() {
                kinds.push(vehicle);
            }
        }
        let held_s = formation
            .during_s
            .as_ref()
            .map_or(0.0, |it| it.value[1] - it.value[0]);
        let stay_s = formation.dwell_s.max(held_s);
        let weight_s = stay_s * self.with_tasks.planning.energy_weight;
        if kinds.len() < 2 || weight_s == 0.0 {
            return Vec::new();
        }
        let density_kg_per_m3 = self.place.air.density_kg_per_m3();
        let air = (&self.place.jet, &self.flown());
        let wakes = kinds.iter().map(|kind| {
            let mass_kg = kind.airframe.mass_kg();
            wake_of(&kind.airframe, mass_kg, density_kg_per_m3, air)
        });
        let wakes: Vec<_> = wakes.collect();
        let share = |kind: usize| {
            let same = kind_of.iter().filter(|it| **it == kind).count();
            same as f64 / kind_of.len() as f64
        };
        let shares: Vec<f64> = (0..kinds.len()).map(share).collect();
        // Extra power over hover power at the end of an offset (m), from one kind to another.
        let extra = |from: usize, to: usize, offset_m: Vector3<f64>| {
            let alpha = wakes[from].axial_speed_mps(offset_m) / wakes[to].hover_velocity_mps();
            airflow::power::beta(alpha) - 1.0
        };
        let price_s = |kind: usize, place: usize| {
            let mut price = 0.0;
            let others = places
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != place);
            for (_, to) in others {
                let offset_m = to.value - places[place].value;
                for (mean, share) in shares.iter().enumerate() {
                    price += share * (extra(kind, mean, offset_m) + extra(mean, kind, -offset_m));
                }
            }
            // Both drones of a pair count it.
            0.5 * price * weight_s
        };
        let of_kind = |kind| -> Vec<f64> {
            (0..places.len())
                .map(|place| price_s(kind, place))
                .collect()
        };
        let by_kind: Vec<Vec<f64>> = (0..kinds.len()).map(of_kind).collect();
        kind_of.iter().map(|kind| by_kind[*kind].clone()).collect()
    }

    /// Reports a time by which some drones cannot be at their places, flying straight.
    fn are_in_time(
        &mut self,
        formation: &Formation,
        (group, taken): (&[usize], &[usize]),
        places: &[Place],
        subject: &str,
    ) {
        let Some(during) = &formation.during_s else {
            return;
        };
        let there = group.iter().zip(taken).map(|(&drone, &place)| {
            let motion = self.with_tasks.planning.motion;
            let there_s = self.members[drone].there_s(&places[place].value, motion);
            (drone, there_s[0])
        });
        let [due_s, _] = during.value;
        let late: Vec<(usize, f64)> = there.filter(|(_, at_s)| *at_s > due_s).collect();
        let last = late
            .iter()
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        let Some(&(drone, at_s)) = last else { return };
        let message = format!(
            "{} drones of {subject} cannot be in place at {due_s} s",
            late.len()
        );
        let name = &self.with_tasks.drones[drone].name;
        let label = format!("`{name}` is there at {at_s:.2} s at the earliest");
        let problem = Problem::at(&during.at, message).label(label);
        self.problems.push(problem);
    }
}

/// The place of each drone, by its cost at each place (rows are drones), so that the sum is least.
pub(super) fn least_cost(costs: &[Vec<i64>]) -> Vec<usize> {
    // Rows are as long as there are rows.
    match Matrix::from_rows(costs.iter().cloned()) {
        Ok(matrix) if !costs.is_empty() => kuhn_munkres_min(&matrix).1,
        _ => Vec::new(),
    }
}

/// To the millimetre, as places are typed (m).
fn rounded(at_m: Point3<f64>) -> Point3<f64> {
    at_m.map(|coordinate| (1000.0 * coordinate).round() / 1000.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::read_world;
    use crate::scenario::world::World;
    use proptest::prelude::*;

    /// Drones at places (m), of these airframes, with these formations.
    fn world(starts: &[(&str, [f64; 3])], formations: &str) -> World {
        let drone = |(index, (airframe, [x, y, z])): (usize, &(&str, [f64; 3]))| {
            format!(r#"(name: "k{index}", airframe: "{airframe}", start_m: ({x}, {y}, {z}))"#)
        };
        let drones: Vec<String> = starts.iter().enumerate().map(drone).collect();
        let text = format!(
            r#"(name: "s", bounds_m: (min: (0, 0, 0), max: (40, 40, 20)), drones: [{}],
                formations: [{formations}])"#,
            drones.join(", ")
        );
        read_world(&text).expect("in order")
    }

    #[test]
    fn all_that_is_wrong_with_places_is_reported_at_once() {
        let text = r#"(name: "s", bounds_m: (min: (0, 0, 0), max: (6, 5, 3)),
            obstacles: [(name: "desk", min_m: (0, 4, 0), max_m: (2, 5, 0.8))],
            drones: [
                (name: "a", airframe: "crazyflie-2.1", start_m: (1, 1, 1)),
                (name: "b", airframe: "crazyflie-2.1", start_m: (2, 1, 1)),
                (name: "c", airframe: "crazyflie-2.1", start_m: (3, 1, 1)),
                (name: "d", airframe: "crazyflie-2.1", start_m: (4, 1, 1)),
                (name: "e", airframe: "crazyflie-2.1", start_m: (5, 1, 1)),
            ],
            formations: [
                (to_m: [(1, 4.5, 0.5), (4, 2, 1), (4, 2.1, 1), (4.1, 2, 1), (30, 3, 1)]),
                (to_m: [(1, 2, 1), (2, 2, 1), (3, 2, 9), (4, 2, 1), (5, 2, 1)]),
            ])"#;
        let found = read_world(text).expect_err("places are wrong");
        let told: Vec<(String, &str)> = found
            .iter()
            .map(|it| (it.message.clone(), &text[it.span.clone().unwrap_or(0..0)]))
            .collect();
        let near = "places of formation 1 are too near to one another";
        let expected = [
            ("a place of formation 1 lies out of bounds", "(30, 3, 1)"),
            (near, "(4, 2.1, 1)"),
            (near, "(4.1, 2, 1)"),
            ("a place of formation 2 lies out of bounds", "(3, 2, 9)"),
            ("task 1 of `a` lies inside obstacle `desk`", "(1, 4.5, 0.5)"),
        ];
        for (message, at) in expected {
            assert!(told.contains(&(message.to_owned(), at)), "{told:?}");
        }
        assert_eq!(told.len(), expected.len(), "{told:?}");
    }

    /// The least sum over all orders of places.
    fn least_sum(costs: &[Vec<i64>], taken: &mut Vec<usize>) -> i64 {
        let drone = taken.len();
        let mut least = if drone == costs.len() { 0 } else { i64::MAX };
        for place in 0..costs.len() {
            if drone < costs.len() && !taken.contains(&place) {
                taken.push(place);
                least = least.min(costs[drone][place] + least_sum(costs, taken));
                taken.pop();
            }
        }
        least
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_order_of_places_is_cheaper_than_the_one_assigned(
            costs in (1_usize..7).prop_flat_map(|n| {
                prop::collection::vec(prop::collection::vec(0_i64..100_000, n), n)
            })
        ) {
            let taken = least_cost(&costs);
            let sum: i64 = taken.iter().zip(&costs).map(|(place, row)| row[*place]).sum();
            prop_assert_eq!(sum, least_sum(&costs, &mut Vec::new()));
            let mut places = taken;
            places.sort_unstable();
            prop_assert_eq!(places, (0..costs.len()).collect::<Vec<usize>>());
        }
    }

    #[test]
    fn one_that_is_not_in_order_keeps_the_number_of_the_next() {
        let text = r#"(name: "s", bounds_m: (min: (0, 0, 0), max: (40, 40, 20)),
            drones: [(name: "k0", airframe: "kolibri", start_m: (1, 1, 3))],
            formations: [(home_m: 1, during_s: (9, 3)), (drones: ["k7"], to_m: [(9, 1, 3)])])"#;
        let said = read_world(text)
            .expect_err("two are not in order")
            .to_string();
        assert!(said.contains("formation 2"), "{said}");
    }

    #[test]
    fn each_drone_of_a_group_takes_the_place_beside_it_and_the_others_none() {
        let starts = [[1, 1, 3], [1, 9, 3], [1, 17, 3]].map(|at| ("kolibri", at.map(f64::from)));
        let formations =
            r#"(drones: ["k2", "k0"], to_m: [(9, 1, 3), (9, 17, 3)], dwell_s: 2), (home_m: 1)"#;
        let world = world(&starts, formations);
        let goals: Vec<Vec<Point3<f64>>> = (world.drones.iter())
            .map(|drone| drone.tasks.iter().map(|task| task.to_m).collect())
            .collect();
        let home = |drone: usize| Point3::from(starts[drone].1) + Vector3::z();
        assert_eq!(goals[0], [Point3::new(9.0, 1.0, 3.0), home(0)]);
        assert_eq!(goals[1], [home(1)]);
        assert_eq!(goals[2], [Point3::new(9.0, 17.0, 3.0), home(2)]);
        assert_eq!(world.drones[0].tasks[0].dwell_s, 2.0);
    }

    #[test]
    fn the_light_one_stays_above_the_heavy_one_where_both_hold_for_long() {
        // By flight alone the heavy one takes the upper place, 0.1 m nearer to it.
        let starts = [
            ("matrice-300", [10.0, 10.0, 10.1]),
            ("kolibri", [30.0, 10.0, 10.0]),
        ];
        let column =
            |dwell_s: f64| format!("(to_m: [(20, 10, 16), (20, 10, 4)], dwell_s: {dwell_s})");
        let heavy_at_m = |dwell_s: f64| world(&starts, &column(dwell_s)).drones[0].tasks[0].to_m.z;
        assert_eq!(heavy_at_m(0.0), 16.0);
        assert_eq!(heavy_at_m(60.0), 4.0);
    }

    /// Crazyflies on a square of this side, 0.3 m from one another, where 0.34 m would do.
    fn packed(side: usize, formations: &str) -> World {
        let drones: Vec<String> = (0..side * side)
            .map(|k| {
                let [x, y] = [k % side, k / side].map(|it| 4.0 + 0.3 * it as f64);
                format!(
                    r#"(name: "k{k}", airframe: "crazyflie-2.1", start_m: ({x}, {y}, 0.07),
                        at_start: Landed, at_end: Land)"#
                )
            })
            .collect();
        let text = format!(
            r#"(name: "s", bounds_m: (min: (0, 0, 0), max: (10, 10, 5)), drones: [{}],
                formations: [{formations}], planning: (air_limit: 0.6))"#,
            drones.join(", ")
        );
        read_world(&text).expect("in order")
    }

    #[test]
    fn neighbours_hover_in_two_layers_and_the_upper_one_lands_once_the_lower_has() {
        let world = packed(3, "(home_m: 1, layer_m: 0.5, during_s: (7, 8))");
        let task = |k: usize| &world.drones[k].tasks[0];
        let heights_m = (0..9).map(|k| task(k).to_m.z - 0.07);
        let heights_m: Vec<f64> = heights_m.map(|it| (it * 1e3).round() / 1e3).collect();
        // Five of nine are not beside one another.
        assert_eq!(heights_m, [1.0, 1.5, 1.0, 1.5, 1.0, 1.5, 1.0, 1.5, 1.0]);
        let landing_s = world.drones[0].vehicle.landing_s(1.07);
        assert!(landing_s > 1.0, "{landing_s}");
        assert_eq!(task(0).during_s, Some([7.0, 8.0]));
        assert_eq!(task(1).during_s, Some([7.0, 8.0 + landing_s]));
        // What comes later is no landing.
        let show = "(home_m: 1, layer_m: 0.5, during_s: (7, 8)), (home_m: 0.5)";
        assert_eq!(
            packed(3, show).drones[1].tasks[0].during_s,
            Some([7.0, 8.0])
        );
    }

    #[test]
    fn a_packed_square_takes_off_and_lands_in_layers_as_it_is_asked_to() {
        let world = packed(3, "(home_m: 1, layer_m: 0.5, during_s: (7, 8))");
        let outcome = crate::plan_world(&world, &crate::Control::QUIET).expect("in order");
        let planned = outcome.into_planned().expect("a plan");
        assert!(planned.plan.unplanned.is_empty() && planned.plan.violations.is_empty());
        assert!(planned.plan.air_delay.is_some(), "wakes are advected");
        for (drone, asked) in planned.plan.drones.iter().zip(&world.drones) {
            let at_m = drone.trajectory.position_m(7.5).expect("it is there");
            assert!((at_m - asked.tasks[0].to_m).norm() < 1e-6, "{}", drone.name);
        }
    }

    #[test]
    fn places_of_a_sphere_lie_on_it_apart_from_one_another() {
        let starts: Vec<(&str, [f64; 3])> = (0..100)
            .map(|k| {
                (
                    "crazyflie-2.1",
                    [f64::from(k % 10), f64::from(k / 10), 1.0].map(|it| it + 5.0),
                )
            })
            .collect();
        let world = world(&starts, "(sphere: (centre_m: (20, 20, 10), radius_m: 5))");
        let at_m: Vec<Point3<f64>> = world.drones.iter().map(|it| it.tasks[0].to_m).collect();
        let centre_m = Point3::new(20.0, 20.0, 10.0);
        for (a, one) in at_m.iter().enumerate() {
            // Rounded to the millimetre in three directions.
            assert!(((one - centre_m).norm() - 5.0).abs() < 1e-3, "{one}");
            // Each has 4 pi r2 / n around it; a hexagonal lattice of that area has 1.07 times its
            // root between neighbours, a Fibonacci lattice not less than 0.8 times.
            let root_m = (TAU * 2.0 * 25.0 / 100.0_f64).sqrt();
            let apart_m = at_m[..a].iter().map(|other| (one - other).norm());
            assert!(apart_m.fold(f64::INFINITY, f64::min) > 0.8 * root_m);
        }
    }
}
