//! From a world to what the search needs: roadmap, agents, and an empty costmap.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use airflow::Airframe;
use costmap::costmap::Costmap;
use costmap::leg::{DroneId, KindId, Tick};
use costmap::reservations::ground::Ground;
use costmap::reservations::zones::ZoneBox;
use costmap::wake::fleet::{Conditions, Fleet, Kind};
use costmap::wake::surfaces::BlockingSurfaces;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::graph::agent::{Agent, Ending, Waypoint};
use crate::graph::distances::{Distances, Mover, Speeds, UNREACHABLE};
use crate::graph::lattice::{Lattice, Spacing};
use crate::graph::passage::{Passage, Passages};
use crate::graph::roadmap::{Channel, Edge, Roadmap, Stop, Vertex};
use crate::graph::turns::{Smoothing, corner_deviation_m, lift_beyond_m};
use crate::plan::cause::MissingRoom;
use crate::scenario::placement::{Misfit, REST_TOLERANCE_M, beside_misfit, landing_place_m};
use crate::scenario::solid::{Solids, top};
use crate::scenario::world::{
    AtEnd, AtStart, Bounds, Drone, LIFT_M, LIFT_MPS, PathMotion, Task, Vehicle, World,
};

/// For how many drones without a path on the lattice one is looked for beyond it: chosen here.
const MOST_PASSAGES: usize = 8;

/// Everything that stays the same while a fleet is planned.
#[derive(Clone, Debug)]
pub(crate) struct Job {
    /// Paths through free space.
    pub(crate) roadmap: Roadmap,
    /// One per drone, in the world's order.
    pub(crate) agents: Vec<Agent>,
    /// What flies, by the kinds of the agents' legs.
    pub(crate) kinds: Kinds,
    /// Drones whose landing is blocked, and what it lacks.
    pub(crate) blocked_landings: Vec<(usize, MissingRoom)>,
    /// Drones of which it is proven that they cannot do one of their tasks, on whatever lattice,
    /// and which: they fit through to it nowhere, or their downwash there is too strong for a zone.
    pub(crate) closed: Vec<(DroneId, usize)>,
    /// Drones that a zone stops like others, and after how many states that was enough.
    pub(crate) ended: Vec<(DroneId, u64)>,
    /// How far fixed drones fly from their legs (m).
    pub(crate) fixed_path_deviation_m: f64,
}

/// Makes the roadmap and every drone's agent. For drones that have no path on the lattice one is
/// looked for beyond it, among `passages` of the same solids, until it says to `stop`.
pub(crate) fn prepare(world: &World, passages: &Passages, stop: &dyn Fn() -> bool) -> Job {
    let mut job = prepare_with(world, &Spacing::of(world.planning.cell_m), &[]);
    let mut looked = 0;
    for index in 0..job.agents.len() {
        if job.agents[index].lower_bound_ticks != UNREACHABLE || looked == MOST_PASSAGES || stop() {
            continue;
        }
        looked += 1;
        let found = job.channels(world, passages, index);
        let is_open = !found.is_empty();
        for channel in found {
            (job.roadmap).open_channel(&world.bounds_m, &passages.solids, &channel);
        }
        if is_open {
            job.use_channels();
        }
    }
    job
}

/// The same on another lattice, with paths beyond it that are known already, and no others.
pub(crate) fn prepare_with(world: &World, spacing: &Spacing, channels: &[Channel]) -> Job {
    let solids = Arc::new(Solids::of(world));
    let stops = world.drones.iter().flat_map(|drone| {
        let grounded = drone.at_start == AtStart::Landed;
        let start = start_of(world, drone, drone.start_m, grounded);
        std::iter::once(start).chain(goals_of(world, &solids, drone, &drone.tasks))
    });
    let stops: Vec<Stop> = stops.collect();
    let (mut roadmap, vertices) = Roadmap::new(
        &world.bounds_m,
        spacing,
        (!solids.is_empty()).then_some(&*solids),
        &stops,
    );
    for channel in channels {
        roadmap.open_channel(&world.bounds_m, &solids, channel);
    }
    if world.planning.motion == PathMotion::Smooth {
        roadmap.keep_solids(&solids);
    }
    let mut kinds = Kinds::default();
    let mut blocked_landings = Vec::new();
    let mut agents = Vec::with_capacity(world.drones.len());
    let mut next = 0;
    for (index, drone) in world.drones.iter().enumerate() {
        let agent_tasks = AgentTasks {
            roadmap: &roadmap,
            tasks: &drone.tasks,
            vertices: &vertices[next..=next + drone.tasks.len()],
            clearance_m: world.planning.gap_to_solids_m(),
            motion: world.planning.motion,
        };
        next += drone.tasks.len() + 1;
        let last_m = drone.tasks.last().map_or(drone.start_m, |task| task.to_m);
        let ending = ending_from(world, &solids, drone, last_m);
        let ending = ending.unwrap_or_else(|lacks| {
            blocked_landings.push((index, lacks));
            Ending::Hover
        });
        let bare = kinds.kind(&drone.vehicle, drone.vehicle.airframe.mass_kg());
        let own = kinds.along(&drone.vehicle, bare, &drone.tasks);
        agents.push(Agent {
            grounded: drone.at_start == AtStart::Landed,
            ..agent_of(DroneId(index as u32), drone, &agent_tasks, own, ending)
        });
    }
    agents.par_iter_mut().for_each(|agent| {
        agent.chain(&roadmap);
        agent.find_lower_bound(&roadmap);
    });
    let mut job = Job {
        roadmap,
        agents,
        kinds,
        blocked_landings,
        closed: Vec::new(),
        ended: Vec::new(),
        fixed_path_deviation_m: 0.0,
    };
    if !channels.is_empty() {
        job.use_channels();
    }
    job
}

impl Job {
    /// Whether it is proven that one of a drone's tasks cannot be reached.
    pub(crate) fn is_closed(&self, drone: DroneId) -> bool {
        self.closed.iter().any(|(closed, _)| *closed == drone)
    }

    /// Lets drones that have no path on the lattice alone use those beyond it.
    fn use_channels(&mut self) {
        let roadmap = &self.roadmap;
        let agents = self.agents.par_iter_mut();
        let refused = agents.filter(|agent| agent.lower_bound_ticks == UNREACHABLE);
        refused.for_each(|agent| {
            agent.use_channels(roadmap);
            agent.find_lower_bound(roadmap);
        });
    }

    /// Paths beyond the lattice for the parts of a drone's job that no path on it leads along;
    /// notes which are closed to its body.
    fn channels(&mut self, world: &World, passages: &Passages, index: usize) -> Vec<Channel> {
        let agent = &self.agents[index];
        let (mut found, mut closed) = (Vec::new(), Vec::new());
        let mut from = agent.start;
        for (task, waypoint) in agent.waypoints.iter().enumerate() {
            let to = waypoint.distances.goal();
            let before = std::mem::replace(&mut from, to);
            if waypoint.distances.ticks(&self.roadmap, before) != UNREACHABLE {
                continue;
            }
            let radius_m = agent.mover.radius_m();
            // What stands on something, or is low over its pad, is nearer to it than it may fly.
            let typed = &world.drones[index];
            let is_low = goals_of(world, &passages.solids, typed, &typed.tasks).nth(task);
            let is_low = is_low.is_some_and(|goal| goal.lift_m.is_some());
            let is_grounded = before == agent.start && agent.grounded;
            let [leaves, reaches] = [(before, is_grounded), (to, is_low)].map(|(end, is_low)| {
                let is_lift = |(_, edge): &(Vertex, Edge)| edge.is_lift;
                let above = self.roadmap.edges_beyond(end).find(is_lift);
                match is_low {
                    true => above.map_or((end, false), |(above, _)| (above, true)),
                    false => (end, true),
                }
            });
            let is_above = leaves.1 && reaches.1;
            let ends_m = [leaves.0, reaches.0].map(|end| self.roadmap.position_m(end));
            let body_m = typed.vehicle.body_radius_m;
            match flown_through(&world.bounds_m, passages, (radius_m, ends_m)) {
                Passage::Open(points_m) if is_above => found.push(Channel { radius_m, points_m }),
                Passage::Closed if is_above => closed.push((agent.drone, task)),
                _ if !is_above
                    && passages.find(&world.bounds_m, body_m, ends_m) == Passage::Closed =>
                {
                    closed.push((agent.drone, task));
                }
                _ => {}
            }
        }
        agent.forget();
        self.closed.extend(closed);
        found
    }

    /// An empty costmap of a world for this many drones of its kinds.
    pub(crate) fn costmap(&self, world: &World, drones: usize) -> Costmap {
        self.empty_costmap(world, true, drones)
    }

    /// The same for a fleet that ignores downwash.
    pub(crate) fn costmap_ignoring_downwash(&self, world: &World, drones: usize) -> Costmap {
        self.empty_costmap(world, false, drones)
    }

    fn empty_costmap(&self, world: &World, wakes: bool, drones: usize) -> Costmap {
        let lattice = self.roadmap.lattice();
        let mut airframes: Vec<Airframe> = Vec::new();
        let kind = |(vehicle, mass_kg): &(Vehicle, f64)| {
            let known = airframes.iter().position(|it| *it == vehicle.airframe);
            let airframe = known.unwrap_or_else(|| {
                airframes.push(vehicle.airframe.clone());
                airframes.len() - 1
            });
            Kind {
                airframe,
                mass_kg: *mass_kg,
                body_radius_m: vehicle.body_radius_m,
            }
        };
        let kinds = self.kinds.kinds.iter().map(kind).collect();
        let limits = world.drones.iter().map(|drone| drone.air_limit);
        let speeds = world.drones.iter().map(|drone| drone.vehicle.max_speed_mps);
        let chords = self.agents.iter().filter_map(|it| it.smoothing.as_ref());
        let path_deviation_m = chords
            .map(Smoothing::chord_m)
            .fold(self.fixed_path_deviation_m, f64::max);
        let zone_limits = world.zones.iter().filter_map(|zone| zone.air_limit_mps);
        let conditions = Conditions {
            density_kg_per_m3: world.air.density_kg_per_m3(),
            jet: world.jet,
            superposition: world.superposition,
            // A world is checked: nothing in it is refused.
            flown: world.flown(),
            fastest_mps: speeds.fold(0.0, f64::max),
            gaps_m: [0, 1, 2]
                .map(|flying| world.planning.gap_to_bodies_m(flying) + 2.0 * path_deviation_m),
            shift: Tick::lasting(2.0 * world.planning.margins.time_s),
            path_deviation_m,
            deepest_m: world.bounds_m.max.z - world.bounds_m.min.z,
            lowest_air_limit: limits.fold(f64::INFINITY, f64::min),
            lowest_zone_limit_mps: zone_limits.fold(f64::INFINITY, f64::min),
            wakes,
        };
        let tops = world.obstacles.iter().filter_map(top);
        let tops = tops.map(|top| top.shrunk(2.0 * path_deviation_m)).collect();
        let zones = world.zones.iter().map(|zone| ZoneBox {
            min_m: zone.min_m,
            max_m: zone.max_m,
            air_limit_mps: zone.air_limit_mps.unwrap_or(f64::INFINITY),
        });
        Costmap::new(
            Fleet::new(&airframes, kinds, conditions),
            BlockingSurfaces::new(world.bounds_m.min.z, tops),
            zones.collect(),
            ground(world, lattice),
            drones,
        )
    }
}

/// A path from one place (m) to another for a ball (m) that keeps off the floor as well, as far as
/// both places are; it is closed only where the floor is not why.
fn flown_through(
    bounds_m: &Bounds,
    passages: &Passages,
    (radius_m, ends_m): (f64, [Point3<f64>; 2]),
) -> Passage {
    let mut above_m = *bounds_m;
    let lowest_m = ends_m[0].z.min(ends_m[1].z);
    above_m.min.z = (above_m.min.z + radius_m).min(lowest_m).max(above_m.min.z);
    match passages.find(&above_m, radius_m, ends_m) {
        Passage::Closed if above_m.min.z > bounds_m.min.z => {
            match passages.find(bounds_m, radius_m, ends_m) {
                Passage::Closed => Passage::Closed,
                _ => Passage::Undecided,
            }
        }
        known => known,
    }
}

/// How far beyond its body's radius a vehicle goes straight up from where it stands (m).
fn lift_m(world: &World, vehicle: &Vehicle) -> f64 {
    match world.planning.motion {
        PathMotion::Straight => LIFT_M,
        PathMotion::Smooth => LIFT_M + lift_beyond_m(vehicle, LIFT_MPS),
    }
}

/// The height (m) from which a vehicle comes straight down to a last task that is low over where it
/// rests then (m); `None` of one that is not: it stands there before it descends.
fn above_z_m(world: &World, vehicle: &Vehicle, [last_m, rest_m]: [Point3<f64>; 2]) -> Option<f64> {
    let pad_m = rest_m.z + vehicle.body_radius_m;
    (last_m.z < pad_m + LIFT_M).then(|| pad_m + lift_m(world, vehicle))
}

/// How far from a corner of its path a vehicle may pass (m).
fn corner_deviation_of(world: &World, vehicle: &Vehicle) -> f64 {
    match world.planning.motion {
        PathMotion::Straight => 0.0,
        PathMotion::Smooth => corner_deviation_m(vehicle),
    }
}

/// Where a drone begins (m); from the ground it goes straight up first.
pub(crate) fn start_of(world: &World, drone: &Drone, at_m: Point3<f64>, grounded: bool) -> Stop {
    let body_m = drone.vehicle.body_radius_m;
    Stop {
        point_m: at_m,
        radius_m: body_m + world.planning.gap_to_solids_m(),
        corner_deviation_m: corner_deviation_of(world, &drone.vehicle),
        lift_m: grounded.then_some(body_m + lift_m(world, &drone.vehicle)),
    }
}

/// The places of a drone's tasks, in order. One that is low over the pad that the drone lands on
/// after it is reached from straight above, as a pad is.
pub(crate) fn goals_of(
    world: &World,
    solids: &Solids,
    drone: &Drone,
    tasks: &[Task],
) -> impl Iterator<Item = Stop> {
    let body_m = drone.vehicle.body_radius_m;
    let radius_m = body_m + world.planning.gap_to_solids_m();
    let last = tasks.len().wrapping_sub(1);
    let goal = move |(index, task): (usize, &Task)| {
        let lands = drone.at_end == AtEnd::Land && index == last;
        let rest_m = || landing_place_m(&world.bounds_m, solids, task.to_m, body_m);
        let above_z_m = lands.then(|| above_z_m(world, &drone.vehicle, [task.to_m, rest_m()]));
        Stop {
            point_m: task.to_m,
            radius_m,
            corner_deviation_m: corner_deviation_of(world, &drone.vehicle),
            lift_m: above_z_m.flatten().map(|z_m| z_m - task.to_m.z),
        }
    };
    tasks.iter().enumerate().map(goal)
}

/// What a drone has to do, and where on the roadmap.
pub(crate) struct AgentTasks<'a> {
    /// Its lattice gives steps their lengths.
    pub(crate) roadmap: &'a Roadmap,
    /// In order.
    pub(crate) tasks: &'a [Task],
    /// Where it begins, and where each task is.
    pub(crate) vertices: &'a [Vertex],
    /// That its body keeps from obstacles (m).
    pub(crate) clearance_m: f64,
    /// What is flown between places.
    pub(crate) motion: PathMotion,
}

/// The agent of a drone that is in the air and does its tasks; how long it takes is not worked out
/// yet.
pub(crate) fn agent_of(
    id: DroneId,
    drone: &Drone,
    agent_tasks: &AgentTasks<'_>,
    kinds: Vec<KindId>,
    ending: Ending,
) -> Agent {
    let AgentTasks {
        roadmap, vertices, ..
    } = *agent_tasks;
    let mover = Mover::new(
        roadmap.lattice(),
        Speeds::of(&drone.vehicle),
        drone.vehicle.body_radius_m + agent_tasks.clearance_m,
        with_lifts(roadmap, vertices),
    );
    let smoothing = (agent_tasks.motion == PathMotion::Smooth)
        .then(|| Smoothing::new(&drone.vehicle, roadmap.lattice(), mover.step_ticks()));
    // It is there and at rest so long after its path is, and leaves so long before.
    let lead_ticks = smoothing.as_ref().map_or(0, Smoothing::lead_ticks);
    // Between two windows at one place that meet it neither arrives nor leaves; a load is taken up
    // at rest.
    let stays_on = |task: usize| {
        let before = task
            .checked_sub(1)
            .and_then(|it| agent_tasks.tasks[it].during_s);
        let next = &agent_tasks.tasks[task];
        let meet = before.zip(next.during_s).is_some_and(|(a, b)| b[0] <= a[1]);
        meet && next.load_kg.is_none() && vertices[task] == vertices[task + 1]
    };
    let count = agent_tasks.tasks.len();
    let waypoints = (agent_tasks.tasks.iter().enumerate())
        .zip(vertices.windows(2))
        .map(|((index, task), ends)| {
            let lead = |has: bool| if has { lead_ticks } else { 0 };
            let before = lead(!stays_on(index));
            let after = lead(index + 1 < count && !stays_on(index + 1));
            Waypoint {
                distances: Arc::new(Distances::new(roadmap, ends[1], ends[0], mover.clone())),
                dwell_ticks: Tick::lasting(task.dwell_s) + before + after,
                due: (task.during_s).map_or(Tick::FOREVER, |[from_s, _]| {
                    Tick(Tick::lasting(from_s).saturating_sub(before))
                }),
                until: (task.during_s).map_or(Tick(0), |[_, until_s]| {
                    Tick(Tick::lasting(until_s)).after(after)
                }),
                ends: Tick(0),
                rest_ticks: 0,
            }
        })
        .collect();
    Agent {
        drone: id,
        start: vertices[0],
        departs: Tick(0),
        begun: Vec::new(),
        tolerated_drones: Vec::new(),
        tolerance_ticks: 0,
        is_sent: false,
        is_stopped_in_conflict: false,
        grounded: false,
        takes_off: Tick(0),
        waypoints,
        kinds,
        ending: ending.after_rest(lead_ticks),
        mover,
        smoothing,
        air_limit: drone.air_limit,
        lower_bound_ticks: UNREACHABLE,
        lower_bound_m: 0.0,
    }
}

/// Own stops beyond the lattice, and the places right above those on the ground.
pub(crate) fn with_lifts(roadmap: &Roadmap, vertices: &[Vertex]) -> Vec<Vertex> {
    let mut stops: Vec<Vertex> = Vec::new();
    for &vertex in vertices.iter().filter(|v| roadmap.is_stop(**v)) {
        stops.push(vertex);
        let above = roadmap.edges(vertex).map(|(to, _)| to);
        stops.extend(above.filter(|to| roadmap.is_stop(*to) && !roadmap.is_in_channel(*to)));
    }
    stops.sort_unstable();
    stops.dedup();
    stops
}

/// The ending of a drone that is here after its last dwell.
///
/// # Errors
/// The room that a landing lacks.
pub(crate) fn ending_from(
    world: &World,
    solids: &Solids,
    drone: &Drone,
    from_m: Point3<f64>,
) -> Result<Ending, MissingRoom> {
    match drone.at_end {
        AtEnd::Hover => Ok(Ending::Hover),
        AtEnd::Leave => Ok(Ending::Leave),
        AtEnd::Land => {
            let radius_m = drone.vehicle.body_radius_m;
            let rest_m = landing_place_m(&world.bounds_m, solids, from_m, radius_m);
            let descent_m = from_m.z - rest_m.z;
            let lift_m = lift_m(world, &drone.vehicle);
            let mut top_m = from_m;
            if !drone.tasks.is_empty()
                && let Some(z_m) = above_z_m(world, &drone.vehicle, [from_m, rest_m])
            {
                // What leads there comes from straight above, too.
                top_m.z = z_m;
            }
            let highest_m = from_m.z.max(world.bounds_m.max.z);
            let along_m = ([top_m, rest_m], highest_m);
            if let Some(lacks) = missing_room(world, solids, along_m, radius_m) {
                return Err(lacks);
            }
            // To the bit where it was, or it would have to go there first.
            let approach_m = match descent_m <= radius_m + lift_m {
                true => from_m,
                false => rest_m + Vector3::z() * (radius_m + lift_m),
            };
            let speeds = Speeds::of(&drone.vehicle);
            let ticks = |from_m: Point3<f64>, to_m: Point3<f64>, slow: bool| {
                let rise_m = to_m.z - from_m.z;
                match slow {
                    _ if rise_m == 0.0 => 0,
                    true => speeds.lift_ticks(rise_m),
                    false => speeds.ticks(-rise_m, rise_m),
                }
            };
            Ok(Ending::Land {
                approach_m,
                rest_m,
                rest_ticks: 0,
                ticks: [
                    ticks(from_m, approach_m, false),
                    ticks(approach_m, rest_m, true),
                ],
            })
        }
    }
}

/// What a body of a radius (m) lacks to come straight down from a place to where it rests, no
/// higher than so far up (m).
fn missing_room(
    world: &World,
    solids: &Solids,
    ([top_m, rest_m], highest_m): ([Point3<f64>; 2], f64),
    radius_m: f64,
) -> Option<MissingRoom> {
    /// Bisections of a height, chosen here: to a millimetre of 32 m.
    const HALVINGS: usize = 15;
    let beside_m = |z_m: f64| {
        let from_m = Point3::new(top_m.x, top_m.y, z_m);
        let clear_m = solids.segment_clearance_m(from_m, rest_m, radius_m);
        if clear_m < radius_m - REST_TOLERANCE_M {
            return Some(radius_m - clear_m);
        }
        match beside_misfit(world, solids, [from_m, rest_m], radius_m) {
            Some(Misfit::Obstacle {
                distance_m,
                needs_m,
                ..
            }) => Some(needs_m - distance_m),
            _ => None,
        }
    };
    let is_free = |z_m: f64| z_m <= highest_m && beside_m(z_m).is_none();
    if top_m.z <= rest_m.z || is_free(top_m.z) {
        return None;
    }
    if let Some(short_m) = beside_m(rest_m.z) {
        return Some(MissingRoom {
            short_m,
            is_height: false,
        });
    }
    let (mut free_m, mut blocked_m) = (rest_m.z, top_m.z);
    for _ in 0..HALVINGS {
        let middle_m = f64::midpoint(free_m, blocked_m);
        match is_free(middle_m) {
            true => free_m = middle_m,
            false => blocked_m = middle_m,
        }
    }
    Some(MissingRoom {
        short_m: top_m.z - free_m,
        is_height: true,
    })
}

/// Distinct vehicles at distinct masses (kg), by [`KindId`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Kinds {
    /// Vehicle and mass with payload (kg), by [`KindId`].
    kinds: Vec<(Vehicle, f64)>,
}

impl Kinds {
    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.kinds.len()
    }

    /// What a kind weighs, payload included (kg).
    pub(crate) fn mass_kg(&self, kind: KindId) -> f64 {
        self.kinds[kind.index()].1
    }

    /// What is of a kind: its vehicle, and its mass with payload (kg).
    pub(crate) fn of(&self, kind: KindId) -> (&Vehicle, f64) {
        let (vehicle, mass_kg) = &self.kinds[kind.index()];
        (vehicle, *mass_kg)
    }

    /// What flies towards each task, and after the last, given what flies first.
    pub(crate) fn along(
        &mut self,
        vehicle: &Vehicle,
        first: KindId,
        tasks: &[Task],
    ) -> Vec<KindId> {
        let bare_kg = vehicle.airframe.mass_kg();
        let mut kinds = vec![first];
        for task in tasks {
            let before = kinds[kinds.len() - 1];
            let loaded = |load_kg| self.kind(vehicle, bare_kg + load_kg);
            kinds.push(task.load_kg.map_or(before, loaded));
        }
        kinds
    }

    /// The kind of a vehicle at a mass (kg), a new one if there is none yet.
    pub(crate) fn kind(&mut self, vehicle: &Vehicle, mass_kg: f64) -> KindId {
        self.known(vehicle, mass_kg).unwrap_or_else(|| {
            self.kinds.push((vehicle.clone(), mass_kg));
            KindId(self.kinds.len() as u32 - 1)
        })
    }

    /// Keeps kinds `used`, in their order; returns what each becomes.
    pub(crate) fn keep(&mut self, used: &BTreeSet<KindId>) -> BTreeMap<KindId, KindId> {
        let next = (0..).map(KindId);
        let renumbered = used.iter().copied().zip(next).collect();
        let mut index = 0;
        self.kinds.retain(|_| {
            index += 1;
            used.contains(&KindId(index - 1))
        });
        renumbered
    }

    /// The kind of a vehicle at a mass (kg), if there is one.
    pub(crate) fn known(&self, vehicle: &Vehicle, mass_kg: f64) -> Option<KindId> {
        let same = |(other, kg): &(Vehicle, f64)| other == vehicle && *kg == mass_kg;
        let index = self.kinds.iter().position(same)?;
        Some(KindId(index as u32))
    }
}

/// Bins around the lattice's places: chosen here, of half a metre or more.
fn ground(world: &World, lattice: &Lattice) -> Ground {
    const LEAST_M: f64 = 0.5;
    let bin_m = lattice.cell_m() * (LEAST_M / lattice.cell_m()).ceil();
    let first_m = lattice.position_m(0);
    let low = |axis: usize| first_m[axis] - 0.5 * lattice.cell_m();
    Ground::new(
        [low(0), low(1)],
        [world.bounds_m.max.x, world.bounds_m.max.y],
        bin_m,
    )
}
