//! The loop: all drones of a plan together, each in the air of the others.
//!
//! Wakes and bookkeeping go in steps of 20 ms, controllers and motion in halves of that. At every
//! step each drone leaves air where it is; then each looks for the air that has come to it, and
//! flies on. Drones are worked on in parallel, each from the same picture of the others, so the
//! number of threads changes nothing.

use airflow::CONVECTION_FACTORS;
use airflow::effects::WakeLean;
use nalgebra::{Point3, Vector3};
use planner::Plan;
use planner::verify::PAD_M;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::bins::{Bins, Entry};
use crate::controller::{Cascade, Controller, Gains, most_speed_mps};
use crate::feed_forward::{Factors, FeedForward};
use crate::fleet::{FlyError, SimulatedDrone, SimulatedFleet};
use crate::gusts::{Gusts, INTENSITY};
use crate::reference::Reference;
use crate::report::{
    Case, DroneFlight, FORMAT, Flight, FlightReport, Paths, Trace, Traces, VehicleFlown,
};
use crate::setup::Setup;
use crate::tally::{Contact, Tally};
use crate::vehicle::Body;
use crate::wakes::{Emitter, EmitterMoment, LINK_M, Link, Receiver, crosses, speed_mps};

/// Step of wakes and contacts (s): chosen here, 4 cm of flight at 2 m/s.
pub(crate) const STEP_S: f64 = 0.02;
/// Steps of controller and motion in one of these: chosen here, 100 Hz, well within the lag of
/// motors.
const SUBSTEPS: u32 = 2;
/// Drones hover for so long before the plan begins (s), so that the air of those above is there and
/// has been answered; not counted. Chosen here.
const SETTLE_S: f64 = 2.0;
/// Flown on after the last trajectory has ended (s), chosen here: air is still under way.
const TAIL_S: f64 = 6.0;
/// A drone that lands late flies on until it is as near to its pad (m), for no longer than that
/// (s); chosen here.
const DOWN_M: f64 = 0.05;
const DOWN_S: f64 = 2.0;
/// Thrust over weight that leaves air, at most: chosen here, more than rotors give for long.
const MOST_THRUST: f64 = 4.0;
/// The floor is this far below the lowest centre (m), chosen here: no body is a point.
const FLOOR_M: f64 = 0.02;
/// Gaps between bodies are reported up to this (m): chosen here.
const CONTACT_M: f64 = 2.0;
/// Drones times seconds that are flown at most: chosen here, some 400 MiB of what is kept of them.
const MOST_DRONE_SECONDS: f64 = 3e5;
/// Drones in one cell of floor at most: chosen here; a million pairs a step take tens of seconds.
const MOST_IN_A_CELL: usize = 1000;
/// Steps between two values of a trace: chosen here, 10 Hz.
const TRACE_EVERY: usize = 5;
/// Drones whose flight is kept over time: chosen here.
const WORST: usize = 3;
/// Places of [`Paths`] in all: chosen here, a megabyte and a half of a page.
const MOST_PLACES: usize = 180_000;
/// Drones to a task at least, chosen here: less work than it takes to hand out would be in one.
const PER_TASK: usize = 16;

/// How to fly.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Options {
    /// Each of them flies; one at least.
    pub controllers: Vec<Controller>,
    /// Each of them flies; `none` is flown in any case.
    pub feed_forward: Vec<FeedForward>,
    /// Speeds of the air in wakes over that of the centreline, within [`CONVECTION_FACTORS`]; each
    /// is flown; one at least.
    pub convection: Vec<f64>,
    /// Intensity of gusts over the centreline speed, 0 to 1; 0: none.
    pub gusts: f64,
    /// Whether air leaves along the thrust, turned about, whatever a finding says of it.
    pub lean: bool,
    /// Of the gusts.
    pub seed: u64,
    /// Fly only up to this time (s, from 0); `None`: to the end.
    pub until_s: Option<f64>,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            controllers: vec![Controller::Px4],
            feed_forward: vec![
                FeedForward::None,
                FeedForward::Paper,
                FeedForward::Late,
                FeedForward::Matched,
            ],
            convection: vec![1.0, 0.6],
            gusts: INTENSITY,
            lean: false,
            seed: 0,
            until_s: None,
        }
    }
}

impl Options {
    /// All that keeps anything from being flown with them.
    fn problems(&self) -> Vec<String> {
        let [low, high] = CONVECTION_FACTORS;
        let is_factor = |it: &&f64| (low..=high).contains(*it);
        let factors = self.convection.iter().filter(|it| !is_factor(it));
        let factors =
            factors.map(|it| format!("a convection factor is {it}: not within {low} to {high}"));
        let gusts = self.gusts;
        let gusty = (!(0.0..=1.0).contains(&gusts))
            .then(|| format!("the intensity of gusts is {gusts}: not within 0 to 1"));
        let until = (self.until_s.filter(|it| it.is_nan() || *it < 0.0))
            .map(|it| format!("the time up to which it is flown is {it} s: not from 0"));
        let lists = [
            ("controller", self.controllers.is_empty()),
            ("convection factor", self.convection.is_empty()),
        ];
        let empty = lists.into_iter().filter(|(_, is_empty)| *is_empty);
        let empty = empty.map(|(what, _)| format!("there is no {what} to fly with"));
        factors.chain(gusty).chain(until).chain(empty).collect()
    }
}

/// Flies a plan. `progress` gets how many seconds of how many, over all flights; it is called from
/// any thread.
///
/// Every controller flies once in calm air, which is not reported: the difference is the effect of
/// the air.
///
/// # Errors
/// What keeps the plan from being flown.
pub fn fly(
    plan: &Plan,
    setup: &Setup,
    options: &Options,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<FlightReport, FlyError> {
    let problems = options.problems();
    if !problems.is_empty() {
        return Err(FlyError::Options(problems.join("; ")));
    }
    let fleet = SimulatedFleet::new(plan, setup)?;
    let until_s = options.until_s.unwrap_or(f64::INFINITY);
    let until_s = until_s.min(fleet.last_s + TAIL_S);
    let drones = fleet.drones.len();
    let lasts_s = until_s + SETTLE_S;
    if lasts_s * drones as f64 > MOST_DRONE_SECONDS {
        return Err(FlyError::TooLong {
            drones,
            lasts_s,
            most: MOST_DRONE_SECONDS,
        });
    }
    // However soon it ends, of what counts there is one.
    let settling = (SETTLE_S / STEP_S).round() as usize;
    let steps = ((lasts_s / STEP_S).round() as usize).max(settling + 1);
    let mut feed_forward = options.feed_forward.clone();
    if !feed_forward.contains(&FeedForward::None) {
        feed_forward.insert(0, FeedForward::None);
    }
    let mut cases = Vec::new();
    for &controller in &options.controllers {
        let gains = setup.gains(controller);
        for &convection in &options.convection {
            for &feed_forward in &feed_forward {
                cases.push(Case {
                    controller,
                    gains,
                    feed_forward,
                    convection,
                });
            }
        }
    }
    let all = (cases.len() + options.controllers.len()) * (lasts_s as usize);
    let done = |seconds: usize| progress(seconds, all);
    let calm: Result<Vec<FlightLog>, FlyError> = (options.controllers.par_iter())
        .map(|controller| {
            let setting = FlightSetting {
                fleet: &fleet,
                gains: setup.gains(*controller),
                air: None,
                steps,
                calm: None,
                options,
            };
            setting.run(&done)
        })
        .collect();
    let calm = calm?;
    let logs: Result<Vec<FlightLog>, FlyError> = (cases.par_iter())
        .map(|case| {
            let controllers = options.controllers.iter();
            let of = controllers.zip(&calm).find(|it| *it.0 == case.controller);
            let setting = FlightSetting {
                fleet: &fleet,
                gains: case.gains,
                air: Some((case.convection, case.feed_forward)),
                steps,
                calm: of.map(|(_, log)| log),
                options,
            };
            setting.run(&done)
        })
        .collect();
    let logs = logs?;
    let most_air_first = most_air_first(&fleet, &cases, &logs);
    let worst = most_air_first.iter().copied().filter(|it| it.1 > 0.0);
    let traces = worst.take(WORST).map(|it| it.0).map(|k| Traces {
        drone: fleet.drones[k].name.clone(),
        air_limit: fleet.drones[k].air_limit,
        from_s: -SETTLE_S,
        step_s: STEP_S * TRACE_EVERY as f64,
        flights: logs.iter().map(|log| log.pilots[k].trace()).collect(),
    });
    let worst = traces.collect();
    let paths = paths(&most_air_first, &logs, steps);
    let flights = cases.iter().zip(&logs).map(|(case, log)| {
        let tallies = log.pilots.iter().map(|it| &it.tally);
        let drones: Vec<DroneFlight> = (fleet.drones.iter().zip(tallies.clone()))
            .map(|(simulated, tally)| tally.drone(simulated, &fleet))
            .collect();
        Flight {
            case: *case,
            fleet: Tally::fleet(tallies, &drones),
            drones,
        }
    });
    Ok(FlightReport {
        format: FORMAT,
        scenario: plan.scenario.clone(),
        seed: options.seed,
        gusts: options.gusts,
        lean: options.lean,
        until_s,
        unplanned: plan.unplanned.iter().map(|it| it.name.clone()).collect(),
        flights: flights.collect(),
        vehicles: (fleet.vehicles.iter())
            .map(|(airframe, vehicle)| VehicleFlown {
                airframe: airframe.clone(),
                vehicle: vehicle.clone(),
            })
            .collect(),
        worst,
        paths,
    })
}

/// Where drones really flew, in each flight the same, as many as [`MOST_PLACES`] allow, one at
/// least.
fn paths(most_air_first: &[(usize, f64)], logs: &[FlightLog], steps: usize) -> Paths {
    let each = steps.div_ceil(TRACE_EVERY).max(1);
    let most = (MOST_PLACES / each / logs.len().max(1)).max(1);
    let of_flight = |log: &FlightLog| {
        let some = most_air_first.iter().take(most).map(|it| it.0);
        some.map(|k| (k, log.pilots[k].off_m())).collect()
    };
    Paths {
        from_s: -SETTLE_S,
        step_s: STEP_S * TRACE_EVERY as f64,
        flights: logs.iter().map(of_flight).collect(),
    }
}

/// All drones, those with the most air over their limit in any flight without feed-forward first,
/// each with that maximum.
fn most_air_first(fleet: &SimulatedFleet, cases: &[Case], logs: &[FlightLog]) -> Vec<(usize, f64)> {
    let plain = cases.iter().zip(logs);
    let plain: Vec<&FlightLog> = plain
        .filter(|(case, _)| case.feed_forward == FeedForward::None)
        .map(|(_, log)| log)
        .collect();
    let most = |k: usize| {
        let alphas = plain.iter().map(|log| log.pilots[k].tally.worst_alpha);
        alphas.fold(0.0, f64::max)
    };
    let over = |k: usize| most(k) - fleet.drones[k].air_limit;
    let mut drones: Vec<usize> = (0..fleet.drones.len()).collect();
    drones.sort_by(|&a, &b| over(b).total_cmp(&over(a)).then(a.cmp(&b)));
    drones.into_iter().map(|k| (k, most(k))).collect()
}

/// One flight to be flown.
struct FlightSetting<'a> {
    fleet: &'a SimulatedFleet,
    gains: Gains,
    /// Convection and feed-forward; `None`: calm air.
    air: Option<(f64, FeedForward)>,
    steps: usize,
    /// The same in calm air.
    calm: Option<&'a FlightLog>,
    options: &'a Options,
}

/// What is kept of one flight.
struct FlightLog {
    pilots: Vec<Pilot>,
}

/// One drone in flight.
struct Pilot {
    body: Body,
    cascade: Cascade,
    receiver: Receiver,
    gusts: Gusts,
    is_flying: bool,
    /// Root of thrust over weight without payload.
    strength: f64,
    /// Mean over the discs, with its gust, and what feed-forward goes by (m/s).
    air_mps: f64,
    gust_mps: f64,
    known_mps: f64,
    links: Vec<Link>,
    tally: Tally,
    /// In calm air, altitude at every step (m); not a number: not flying.
    altitude_m: Vec<f32>,
    /// Distance from the plan along the axes (m), and alpha; not numbers: not flying.
    trace: Vec<[f32; 4]>,
}

/// Where a drone is, for all others.
#[derive(Clone, Copy)]
struct DroneState {
    position_m: Point3<f64>,
    velocity_mps: Vector3<f64>,
    is_flying: bool,
    is_there: bool,
}

/// What all drones see of one another at one step.
struct WorldSnapshot<'a> {
    emitters: &'a [Emitter],
    links: &'a [Link],
    link_bins: &'a Bins,
    drone_states: &'a [DroneState],
    drone_bins: &'a Bins,
    /// Radius of the largest body (m).
    largest_m: f64,
    /// Of spots, as far as wakes that take no time reach; empty where nothing asks.
    wake_bins: &'a Bins,
}

impl FlightSetting<'_> {
    fn run(&self, done: &(dyn Fn(usize) + Sync)) -> Result<FlightLog, FlyError> {
        let fleet = self.fleet;
        let mut pilots: Vec<Pilot> = (0..fleet.drones.len()).map(|k| self.pilot(k)).collect();
        let convection = self.air.map_or(1.0, |it| it.0);
        let highest_m = fleet.drones.iter().map(|it| it.course.highest_m);
        let height_m = highest_m.fold(fleet.bounds_m.min.z, f64::max) - fleet.bounds_m.min.z;
        let new = |simulated: &SimulatedDrone| {
            let air = Emitter::new(
                simulated.wake.clone(),
                (convection, STEP_S),
                height_m + LINK_M,
            );
            air.with_loads(simulated.mass_kg, &simulated.course.masses_kg)
        };
        let mut emitters: Vec<Emitter> = match self.air {
            Some(_) => fleet.drones.iter().map(new).collect(),
            None => Vec::new(),
        };
        let mut link_bins = Bins::new(&fleet.bounds_m, LINK_M);
        let mut drone_bins = Bins::new(&fleet.bounds_m, f64::INFINITY);
        let mut wake_bins = drone_bins.clone();
        let radii_m = fleet.drones.iter().map(|it| it.body_radius_m);
        let largest_m = radii_m.fold(0.0, f64::max);
        let reaches_m: Vec<f64> = emitters.iter().map(Emitter::most_reach_m).collect();
        let is_paper = self.air.is_some_and(|it| it.1 == FeedForward::Paper);
        let (mut links, mut drone_states) = (Vec::new(), Vec::new());
        let per_second = (1.0 / STEP_S).round() as usize;
        for step in 0..self.steps {
            let t_s = step as f64 * STEP_S - SETTLE_S;
            self.leave_air(&mut pilots, &mut emitters, t_s);
            links.clear();
            pilots
                .iter()
                .for_each(|it| links.extend_from_slice(&it.links));
            link_bins.fill(links.iter().map(|link: &Link| Entry {
                middle_m: link.middle_m,
                z_m: link.z_m,
                reach_m: link.reach_m,
            }));
            drone_states.clear();
            drone_states.extend(pilots.iter().zip(&fleet.drones).map(|(pilot, simulated)| {
                DroneState {
                    position_m: pilot.body.position_m,
                    velocity_mps: pilot.body.velocity_mps,
                    is_flying: pilot.is_flying,
                    is_there: simulated.course.there_s.0 <= t_s && t_s < simulated.course.there_s.1,
                }
            }));
            let entry = |drone_state: &DroneState, reach_m: f64| Entry {
                middle_m: [drone_state.position_m.x, drone_state.position_m.y],
                z_m: [drone_state.position_m.z; 2],
                reach_m,
            };
            // In calm air nothing is looked for.
            if self.air.is_some() {
                drone_bins.fill(
                    drone_states
                        .iter()
                        .map(|drone_state| entry(drone_state, 0.0)),
                );
            }
            if step % per_second == 0 && drone_bins.fullest() > MOST_IN_A_CELL {
                return Err(FlyError::TooDense {
                    drones: drone_bins.fullest(),
                    at_s: t_s,
                    most: MOST_IN_A_CELL,
                });
            }
            if is_paper {
                let reaching = drone_states.iter().zip(&reaches_m);
                wake_bins.fill(reaching.map(|(drone_state, reach_m)| entry(drone_state, *reach_m)));
            }
            let snapshot = WorldSnapshot {
                emitters: &emitters,
                links: &links,
                link_bins: &link_bins,
                drone_states: &drone_states,
                drone_bins: &drone_bins,
                largest_m,
                wake_bins: &wake_bins,
            };
            let each = pilots.par_iter_mut().with_min_len(PER_TASK).enumerate();
            each.for_each(|(k, pilot)| self.fly_on(pilot, k, &snapshot, step));
            if (step + 1) % per_second == 0 {
                done(1);
            }
        }
        if let Some(calm) = self.calm {
            for (pilot, calm) in pilots.iter_mut().zip(&calm.pilots) {
                pilot.tally.calm_energy_j = calm.tally.energy_j;
            }
        }
        Ok(FlightLog { pilots })
    }

    fn pilot(&self, k: usize) -> Pilot {
        let simulated = &self.fleet.drones[k];
        let start = simulated.course.at(-SETTLE_S);
        Pilot {
            body: simulated.dynamics.hovering(start.position_m, start.mass_kg),
            cascade: Cascade::default(),
            receiver: Receiver::new(simulated.discs.clone(), self.fleet.superposition),
            gusts: Gusts::new(self.options.seed, k),
            is_flying: false,
            strength: 0.0,
            air_mps: 0.0,
            gust_mps: 0.0,
            known_mps: 0.0,
            links: Vec::new(),
            tally: Tally::default(),
            altitude_m: Vec::new(),
            trace: Vec::with_capacity(self.steps / TRACE_EVERY + 1),
        }
    }

    /// Which drones fly, and their new air.
    fn leave_air(&self, pilots: &mut [Pilot], emitters: &mut [Emitter], t_s: f64) {
        let drones = &self.fleet.drones;
        for (pilot, simulated) in pilots.iter_mut().zip(drones) {
            pilot.begin_step(simulated, t_s);
        }
        let pilots = pilots.par_iter_mut().with_min_len(PER_TASK);
        let each = pilots.zip(emitters).zip(drones).enumerate();
        each.for_each(|(k, ((pilot, emitter), simulated))| {
            emitter.record(self.moment(pilot, simulated));
            pilot.links.clear();
            let fastest_mps = most_speed_mps(simulated.max_speed_mps);
            emitter.links(k as u32, fastest_mps, &mut pilot.links);
        });
    }

    fn moment(&self, pilot: &Pilot, simulated: &SimulatedDrone) -> EmitterMoment {
        let (body, fleet) = (&pilot.body, self.fleet);
        let mut strength = if pilot.is_flying { pilot.strength } else { 0.0 };
        if fleet.flown.depends_on_climb() {
            strength *= fleet
                .flown
                .climbing(&simulated.wake, body.velocity_mps.z)
                .gain();
        }
        let found = fleet.flown.lean.map_or(0.0, |lean| lean.share);
        let share = if self.options.lean { 1.0 } else { found };
        let lean = match pilot.is_flying {
            true => WakeLean::against(body.up).map(|lean| share * lean),
            false => [0.0; 2],
        };
        let at_m = &body.position_m;
        EmitterMoment {
            position_m: *at_m,
            strength,
            lean,
            ends_at_z_m: fleet.surfaces.wake_end_z_m(&simulated.wake, at_m, at_m),
        }
    }

    /// One drone over one step.
    fn fly_on(&self, pilot: &mut Pilot, k: usize, snapshot: &WorldSnapshot<'_>, step: usize) {
        let simulated = &self.fleet.drones[k];
        let t_s = step as f64 * STEP_S - SETTLE_S;
        let reference = simulated.course.at(t_s);
        let hover_mps = simulated.hover_mps(reference.mass_kg);
        if let Some((_, feed_forward)) = self.air {
            self.meet_air(pilot, (k, simulated), snapshot, feed_forward);
        }
        let counts = t_s >= 0.0;
        let alpha = self.alpha(pilot.air_mps, hover_mps);
        if pilot.is_flying && counts {
            let strongest = pilot.receiver.strongest.map(|(from, _)| from);
            let is_counted = t_s <= self.fleet.last_s;
            let air = (alpha, pilot.air_mps, strongest);
            pilot.tally.air(air, simulated.air_limit, (t_s, is_counted));
            let calm = self
                .calm
                .map(|log| f64::from(log.pilots[k].altitude_m[step]));
            let risen_m = calm.map(|calm_m| pilot.body.position_m.z - calm_m);
            pilot
                .tally
                .by_air(alpha, risen_m.filter(|it| it.is_finite()));
        }
        let shown = |value: f64| {
            if pilot.is_flying {
                value as f32
            } else {
                f32::NAN
            }
        };
        if self.air.is_none() {
            pilot.altitude_m.push(shown(pilot.body.position_m.z));
        }
        if step.is_multiple_of(TRACE_EVERY) && self.air.is_some() {
            let off_m = pilot.body.position_m - reference.position_m;
            let values = [off_m.x, off_m.y, off_m.z, alpha];
            pilot.trace.push(values.map(shown));
        }
        if counts && self.air.is_some() {
            self.contacts(pilot, (k, simulated), snapshot, t_s);
        }
        for substep in 0..SUBSTEPS {
            let step_s = STEP_S / f64::from(SUBSTEPS);
            let at_s = t_s + f64::from(substep) * step_s;
            let reference = simulated.course.at(at_s);
            if !pilot.is_flying {
                pilot.body.position_m = reference.position_m;
                pilot.body.velocity_mps = reference.velocity_mps;
                continue;
            }
            if counts {
                let planned = (at_s, reference.position_m);
                pilot
                    .tally
                    .tracking(&simulated.course, planned, &pilot.body);
            }
            // A drone that hovers on at its end draws as much as before.
            let is_counted = counts && at_s <= self.fleet.last_s;
            self.move_on(
                pilot,
                simulated,
                &reference,
                (step_s, is_counted, hover_mps),
            );
        }
    }

    /// Air from above over a drone's induced velocity (both m/s), as limits count it.
    fn alpha(&self, air_mps: f64, hover_mps: f64) -> f64 {
        match self.air {
            Some(_) => self.fleet.flown.alpha(air_mps, hover_mps),
            None => 0.0,
        }
    }

    /// Controller and motion of one drone over a substep.
    fn move_on(
        &self,
        pilot: &mut Pilot,
        simulated: &SimulatedDrone,
        reference: &Reference,
        (step_s, is_counted, hover_mps): (f64, bool, f64),
    ) {
        let speed_mps = simulated.max_speed_mps;
        let state = (reference, &pilot.body);
        let dynamics = &simulated.dynamics;
        let asked = pilot
            .cascade
            .command(&self.gains, (dynamics, speed_mps), state, step_s);
        let (mut command, is_full) = asked;
        let known = self.fleet.flown.receiver_gain * pilot.known_mps / hover_mps;
        command.speed_factor = match self.air {
            Some((_, FeedForward::Matched)) => dynamics.vehicle.rotor.holding_factor(known),
            _ => Factors::of(known, 1.0).rotor_speed,
        };
        let felt_mps = hover_mps * self.alpha(pilot.air_mps, hover_mps) + pilot.gust_mps;
        let around = (reference.mass_kg, felt_mps);
        let effort = dynamics.step(&mut pilot.body, &command, around, step_s);
        let floor_m = self.fleet.bounds_m.min.z + FLOOR_M;
        if pilot.body.position_m.z < floor_m {
            pilot.body.position_m.z = floor_m;
            pilot.body.velocity_mps.z = pilot.body.velocity_mps.z.max(0.0);
        }
        let most = MOST_THRUST * reference.mass_kg / simulated.mass_kg;
        pilot.strength = (effort.thrust_n / dynamics.weight_n)
            .clamp(0.05, most.max(0.05))
            .sqrt();
        if is_counted {
            pilot.tally.energy_j += effort.power_w * step_s;
        }
        if is_full {
            pilot.tally.full_tilt_s += step_s;
        }
    }

    /// The air that reaches a drone.
    fn meet_air(
        &self,
        pilot: &mut Pilot,
        (k, simulated): (usize, &SimulatedDrone),
        snapshot: &WorldSnapshot<'_>,
        feed_forward: FeedForward,
    ) {
        pilot.receiver.clear();
        (pilot.air_mps, pilot.known_mps) = (0.0, 0.0);
        let at_m = pilot.body.position_m;
        if pilot.is_flying {
            let mut found = Vec::new();
            for link in snapshot.link_bins.near(&at_m) {
                let link = &snapshot.links[link];
                let from = link.emitter as usize;
                let reach_m = link.reach_m + simulated.wake.tip_radius_m();
                let [x, y] = link.middle_m;
                let away_m2 = (at_m.x - x).powi(2) + (at_m.y - y).powi(2);
                if from == k || !crosses(link.z_m, at_m.z) || away_m2 > reach_m * reach_m {
                    continue;
                }
                if let Some(parcel) = snapshot.emitters[from].parcel(link.cut, at_m.z) {
                    found.push((from, parcel));
                }
            }
            pilot.receiver.add_all(&mut found, &at_m);
            pilot.air_mps = pilot.receiver.mean_mps();
            pilot.known_mps = match feed_forward {
                FeedForward::None => 0.0,
                FeedForward::Late | FeedForward::Matched => pilot.air_mps,
                FeedForward::Paper => self.centre_mps(k, &at_m, snapshot),
            };
        }
        let jet = pilot.receiver.strongest.as_ref().map(|(_, jet)| jet);
        pilot.gust_mps = pilot.gusts.step(jet, self.options.gusts, STEP_S);
    }

    /// The air at a drone's centre (m/s) with quasi-static wakes.
    fn centre_mps(&self, k: usize, at_m: &Point3<f64>, snapshot: &WorldSnapshot<'_>) -> f64 {
        let how = self.fleet.superposition;
        let others = snapshot.wake_bins.near(at_m).filter(|it| *it != k);
        let parcels = others.filter_map(|it| snapshot.emitters[it].quasi_static(at_m.z));
        let gathered = parcels.fold(0.0, |so_far, it| how.gather(so_far, speed_mps(&it, at_m)));
        how.finish(gathered)
    }

    /// How near a drone comes to others and to obstacles.
    fn contacts(
        &self,
        pilot: &mut Pilot,
        (k, simulated): (usize, &SimulatedDrone),
        snapshot: &WorldSnapshot<'_>,
        t_s: f64,
    ) {
        let here = &snapshot.drone_states[k];
        if !here.is_there {
            return;
        }
        let at_m = here.position_m;
        let reach_m = CONTACT_M + simulated.body_radius_m + snapshot.largest_m;
        let others = snapshot.drone_bins.within(&at_m, reach_m);
        for other in others.filter(|it| *it != k) {
            let drone_state = &snapshot.drone_states[other];
            if !drone_state.is_there || !(here.is_flying || drone_state.is_flying) {
                continue;
            }
            let apart_m = drone_state.position_m - at_m;
            let past_mps = drone_state.velocity_mps - here.velocity_mps;
            // Nearest within the step, as if neither changed its velocity.
            let speed2 = past_mps.norm_squared().max(f64::MIN_POSITIVE);
            let after_s = (-apart_m.dot(&past_mps) / speed2).clamp(0.0, STEP_S);
            let distance_m = (apart_m + past_mps * after_s).norm();
            let radii_m = simulated.body_radius_m + self.fleet.drones[other].body_radius_m;
            let gap_m = distance_m - radii_m;
            if gap_m > CONTACT_M {
                continue;
            }
            let contact = Contact {
                gap_m,
                with: other,
                at_s: t_s + after_s,
            };
            Contact::keep(&mut pilot.tally.body, contact);
        }
        if !here.is_flying {
            return;
        }
        let is_near = |pad_m: &Point3<f64>| (pad_m.xy() - at_m.xy()).norm() < PAD_M;
        let is_over_pad = simulated.course.pads_m.iter().any(is_near);
        let far_m = CONTACT_M + simulated.body_radius_m;
        for (with, it) in self.fleet.solids.iter().enumerate() {
            let is_pad = || it.bears && is_over_pad && it.solid.is_below(&at_m);
            if it.is_beyond(&at_m.coords, far_m) || is_pad() {
                continue;
            }
            let contact = Contact {
                gap_m: it.solid.distance_m(&at_m.coords) - simulated.body_radius_m,
                with,
                at_s: t_s,
            };
            Contact::keep(&mut pilot.tally.obstacle, contact);
        }
    }
}

impl Pilot {
    /// Takes off, or stays down.
    fn begin_step(&mut self, simulated: &SimulatedDrone, t_s: f64) {
        let (from_s, until_s) = simulated.course.airborne_s;
        let reference = simulated.course.at(t_s);
        let mut rests = simulated.course.landed_s.iter();
        let rest_s = rests.find(|rest_s| rest_s.0 <= t_s && t_s < rest_s.1);
        let is_up = from_s <= t_s && t_s < until_s && rest_s.is_none();
        let until_s = rest_s.map_or(until_s, |rest_s| rest_s.0);
        let is_high = self.body.position_m.z > reference.position_m.z + DOWN_M;
        let is_late = self.is_flying && t_s < until_s + DOWN_S && t_s < simulated.course.there_s.1;
        let flies = is_up || is_late && is_high;
        if flies && !self.is_flying {
            let mass_kg = reference.mass_kg;
            self.body = simulated.dynamics.hovering(reference.position_m, mass_kg);
            self.cascade = Cascade::default();
            self.strength = (mass_kg / simulated.mass_kg).sqrt();
        }
        if !flies {
            self.body.position_m = reference.position_m;
            self.body.velocity_mps = reference.velocity_mps;
        }
        self.is_flying = flies;
    }

    fn trace(&self) -> Trace {
        let column = |k: usize, scale: f32| {
            let values = self.trace.iter().map(|it| it[k]);
            let rounded = values.map(|it| it.is_finite().then(|| (it * scale).round() / scale));
            rounded.collect()
        };
        Trace {
            altitude_error_m: column(2, 1e4),
            alpha: column(3, 1e4),
        }
    }

    fn off_m(&self) -> Vec<Option<[f32; 3]>> {
        let off = |&[x, y, z, _]: &[f32; 4]| x.is_finite().then_some([x, y, z]);
        self.trace.iter().map(off).collect()
    }
}

#[cfg(test)]
mod tests {
    use airflow::Airframe;
    use planner::plan::{Violation, ViolationKind};

    use super::*;

    /// A drone as plan.json has it: name, airframe, times (s) and places (m), and further keys.
    fn drone((name, airframe): (&str, &str), points: &[(f64, [f64; 3])], more: &str) -> String {
        let (times, places): (Vec<f64>, Vec<[f64; 3]>) = points.iter().copied().unzip();
        format!(
            r#"{{"name": "{name}", "airframe": "{airframe}", {more}
            "trajectory": {{"t_s": {times:?}, "position_m": {places:?}}}}}"#
        )
    }

    fn plan(drones: &[String]) -> Plan {
        let text = format!(
            r#"{{"format": "plan/1", "scenario": "test", "bounds_m": {{"min": [0, 0, 0], "max": [20, 20, 8]}},
            "obstacles": [{{"name": "shelf", "min_m": [15, 15, 0], "max_m": [17, 17, 3]}}], "drones": [{}]}}"#,
            drones.join(",")
        );
        planner::plan::file::read(&text).expect("a plan").plan
    }

    fn flown(plan: &Plan, options: &Options) -> FlightReport {
        fly(plan, &Setup::default(), options, &|_, _| ()).expect("can be flown")
    }

    /// Without gusts, at one speed of the air.
    fn calm_at(convection: f64) -> Options {
        Options {
            convection: vec![convection],
            gusts: 0.0,
            ..Options::default()
        }
    }

    #[test]
    fn a_drone_alone_stays_where_it_hovers() {
        let plan = plan(&[drone(("a", "kolibri"), &[(5.0, [5.0, 5.0, 2.0])], "")]);
        let both = Options {
            controllers: vec![Controller::Px4, Controller::Research],
            ..Options::default()
        };
        let report = flown(&plan, &both);
        assert!(report.is_within_limits() && report.worst.is_empty());
        for flight in &report.flights {
            // Rounding over a thousand steps.
            assert!(flight.fleet.tracking_max_m < 1e-9);
            assert_eq!(flight.fleet.worst_alpha, 0.0);
        }
    }

    #[test]
    fn what_cannot_be_flown_is_reported() {
        let alone = |more: &str| plan(&[drone(("a", "kolibri"), &[(5.0, [5.0, 5.0, 2.0])], more)]);
        let told = |plan: &Plan, options: &Options| {
            let flown = fly(plan, &Setup::default(), options, &|_, _| ());
            flown.expect_err("cannot be flown").to_string()
        };
        for convection in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
            let said = told(&alone(""), &calm_at(convection));
            assert!(said.contains("convection factor"), "{said}");
        }
        let gusty = Options {
            gusts: f64::NAN,
            ..Options::default()
        };
        assert!(told(&alone(""), &gusty).contains("gusts"));
        for until_s in [f64::NAN, -1.0] {
            let until = Options {
                until_s: Some(until_s),
                ..calm_at(1.0)
            };
            let said = told(&alone(""), &until);
            assert!(said.contains("up to which it is flown"), "{said}");
        }
        let nothing = Options {
            controllers: Vec::new(),
            convection: Vec::new(),
            ..Options::default()
        };
        let said = told(&alone(""), &nothing);
        assert!(said.contains("no controller") && said.contains("no convection factor"));
        let mut heavy = alone("");
        heavy.drones[0].trajectory.mass_kg[0] *= 5.0;
        let said = told(&heavy, &Options::default());
        assert!(said.contains("its rotors lift"), "{said}");
        // However light it is.
        let mut light = alone("");
        light.drones[0].trajectory.mass_kg[0] *= 0.01;
        assert!(flown(&light, &Options::default()).is_within_limits());
        // However little of it is flown, it is.
        let short = Options {
            until_s: Some(0.001),
            ..calm_at(1.0)
        };
        assert_eq!(flown(&alone(""), &short).flights[0].fleet.flown, 1);
    }

    #[test]
    fn what_a_plan_claims_is_measured_by_what_the_drone_carries_then() {
        let mut plan = plan(&[drone(("a", "kolibri"), &[(5.0, [5.0, 5.0, 2.0])], "")]);
        let claims = &mut plan.drones[0];
        claims
            .trajectory
            .mass_kg
            .iter_mut()
            .for_each(|it| *it *= 2.0);
        (claims.worst_air_mps, claims.worst_air_at_s) = (2.0, Some(1.0));
        let expected = 2.0 / (claims.airframe.hover_induced_velocity_mps * 2.0_f64.sqrt());
        let told = flown(&plan, &calm_at(1.0)).flights[0].drones[0].claimed_alpha;
        assert!((told.expect("claimed") - expected).abs() < 1e-9, "{told:?}");
    }

    #[test]
    fn advected_air_arrives_after_its_convective_delay() {
        // One comes in at 3 s, 4 m above the other.
        let low = drone(("low", "kolibri"), &[(9.0, [5.0, 5.0, 2.0])], "");
        let high = [(3.0, [5.0, 5.0, 6.0]), (9.0, [5.0, 5.0, 6.0])];
        let high = drone(("high", "offboard-2"), &high, r#""enters_s": 3.0,"#);
        let plan = plan(&[low, high]);
        let airframe = Airframe::preset("offboard-2").expect("a preset");
        let jet = airflow::Jet::default();
        let wake = airflow::Wake::new(&airframe, airframe.mass_kg(), 1.204, &jet);
        for convection in [1.0, 0.6] {
            let report = flown(&plan, &calm_at(convection));
            let traces = &report.worst[0];
            assert_eq!(traces.drone, "low");
            let alpha = &traces.flights[0].alpha;
            let first = alpha.iter().position(|it| it.is_some_and(|it| it > 0.3));
            let came_s = traces.from_s + first.expect("meets it") as f64 * traces.step_s;
            let lag_s = wake.far_field().transport_time_s(4.0, convection);
            // Seen at the next of the trace's moments, a step of the loop later at most.
            let late_s = came_s - (3.0 + lag_s);
            assert!((-STEP_S..0.1 + STEP_S).contains(&late_s), "{late_s}");
            let found = &report.flights[0].drones[0];
            assert_eq!(found.worst_from.as_deref(), Some("high"));
            assert!(found.over_limit_s > 5.0 && !report.is_within_limits());
        }
    }

    /// A drone that crosses above another.
    fn passing() -> Plan {
        let low = drone(("low", "kolibri"), &[(9.0, [10.0, 5.0, 2.0])], "");
        let high = [(2.0, [4.0, 5.0, 4.0]), (8.0, [16.0, 5.0, 4.0])];
        plan(&[low, drone(("high", "offboard-2"), &high, "")])
    }

    #[test]
    fn feed_forward_takes_most_of_what_a_passing_jet_does() {
        let report = flown(&passing(), &calm_at(1.0));
        let [none, paper, late, matched] = [0, 1, 2, 3].map(|k| &report.flights[k]);
        assert_eq!(late.case.feed_forward, FeedForward::Late);
        let by_air_m = |flight: &Flight| flight.drones[0].altitude_rms_by_air_m;
        assert!(by_air_m(none) > 0.02);
        // The goal for fleets: at most 45 %.
        assert!(by_air_m(late) < 0.45 * by_air_m(none));
        // Where the jet is already gone, and not where it still is: the paper's comes too soon.
        assert!(by_air_m(late) < by_air_m(paper));
        assert!(by_air_m(matched) < by_air_m(late));
        // Air that pushes down costs energy; the one above meets none.
        assert!(none.drones[0].extra_energy_j > 0.0);
        assert_eq!(none.drones[1].extra_energy_j, 0.0);
    }

    #[test]
    fn gusts_come_by_seed_and_only_in_jets() {
        let with = |seed: u64| {
            let options = Options {
                gusts: INTENSITY,
                seed,
                ..calm_at(1.0)
            };
            flown(&passing(), &options)
        };
        let (one, other) = (with(1), with(2));
        assert_eq!(one, with(1));
        let low = |report: &FlightReport| report.flights[0].drones[0].altitude_rms_m;
        assert_ne!(low(&one), low(&other));
        // All but how near the lower one came.
        let high = |report: &FlightReport| DroneFlight {
            least_gap_m: None,
            least_gap_at_s: None,
            ..report.flights[0].drones[1].clone()
        };
        assert_eq!(high(&one), high(&other));
    }

    #[test]
    fn threads_change_nothing() {
        let each = |k: usize| {
            let (x, y) = (2.0 + (k % 8) as f64 * 2.0, 2.0 + (k / 8) as f64 * 3.0);
            let z = 1.5 + (k % 3) as f64 * 2.0;
            let name = format!("d{k}");
            let points = [(0.0, [x, y, z]), (6.0, [18.0 - x, 19.0 - y, z])];
            drone((&name, Airframe::PRESETS[k % 4]), &points, "")
        };
        let plan = plan(&(0..40).map(each).collect::<Vec<_>>());
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.expect("two threads start");
            pool.install(|| flown(&plan, &Options::default()))
        };
        assert_eq!(on(1), on(2));
    }

    #[test]
    fn contacts_are_reported_with_both_drones_and_the_time() {
        let one = [(0.0, [2.0, 5.0, 2.0]), (6.0, [14.0, 5.0, 2.0])];
        let other = [(0.0, [14.0, 5.0, 2.0]), (6.0, [2.0, 5.0, 2.0])];
        let third = [(0.0, [10.0, 16.0, 2.0]), (3.0, [16.0, 16.0, 2.0])];
        let drones = [("a", one.as_slice()), ("b", &other), ("c", &third)];
        let plan = plan(&drones.map(|(name, points)| drone((name, "kolibri"), points, "")));
        let report = flown(&plan, &calm_at(1.0));
        let flight = &report.flights[0];
        assert_eq!((flight.fleet.touching, flight.fleet.in_obstacles), (2, 1));
        let [a, _, c] = [0, 1, 2].map(|k| &flight.drones[k]);
        assert_eq!(a.least_gap_to.as_deref(), Some("b"));
        // Both have made up for their start: they meet half-way.
        assert!((a.least_gap_at_s.expect("when") - 3.0).abs() < 0.05);
        assert_eq!(c.least_obstacle.as_deref(), Some("shelf"));
        assert!(!report.is_within_limits());
    }

    #[test]
    fn large_bodies_touch_however_far_apart_their_centres_are() {
        // They reach 1.5 m from their centres.
        let barge = r#"{"name": "barge", "mass_kg": 40, "propeller_diameter_m": 1.0, "motor_distance_m": 2.0}"#;
        let hovering = |name: &str, x_m: f64| {
            let drone = drone((name, "barge"), &[(2.0, [x_m, 10.0, 5.0])], "");
            drone.replace(r#""barge""#, barge)
        };
        // What the verifier lets pass is no touch.
        for (apart_m, touching) in [(2.9, 2), (2.998, 2), (2.9995, 0), (3.5, 0)] {
            let plan = plan(&[hovering("a", 8.0), hovering("b", 8.0 + apart_m)]);
            let report = flown(&plan, &calm_at(1.0));
            let fleet = &report.flights[0].fleet;
            assert_eq!(fleet.touching, touching, "{apart_m}");
            let violations = planner::verify(&plan).violations;
            let touches = |it: &Violation| it.kind == ViolationKind::Collision;
            assert_eq!(violations.iter().any(touches), touching > 0, "{apart_m}");
            let gap_m = fleet.least_gap_m.expect("within two metres");
            assert!((gap_m - (apart_m - 3.0)).abs() < 1e-6, "{gap_m}");
        }
    }

    #[test]
    fn a_drone_that_lands_leaves_no_air_and_stands_in_no_obstacle() {
        let down = [(0.0, [5.0, 5.0, 3.0]), (6.0, [5.0, 5.0, 0.1])];
        let below = drone(
            ("below", "kolibri"),
            &[(20.0, [9.0, 5.0, 0.1])],
            r#""at_start": "landed","#,
        );
        let lands = drone(("lands", "kolibri"), &down, r#""at_end": "land","#);
        let report = flown(&plan(&[below, lands]), &calm_at(1.0));
        let [below, lands] = [0, 1].map(|k| &report.flights[0].drones[k]);
        assert!(!below.flew && lands.flew);
        assert!(report.is_within_limits());
        // It flew for six seconds and two at most.
        let hover_w = 0.23 * 9.81 * 7.41;
        assert!(lands.energy_j < 8.0 * hover_w && lands.energy_j > 5.0 * hover_w);
    }

    /// The most alpha of the first drone, as it is flown and as the verifier has it.
    fn alphas(plan: &Plan, convection: f64) -> [f64; 2] {
        let flown = flown(plan, &calm_at(convection));
        let verified = planner::verify(plan).exposures[0].worst_air_mps;
        let u_h_mps = plan
            .flown()
            .hover_velocity_mps(plan.drones[0].hover_mps(0.0));
        let claimed = plan.flown().alpha(verified, u_h_mps);
        [flown.flights[0].drones[0].worst_alpha, claimed]
    }

    /// A drone below another that hovers for some seconds, each at a place (m).
    fn below((low, low_m): (&str, [f64; 3]), (high, high_m): (&str, [f64; 3]), more: &str) -> Plan {
        plan(&[
            drone(("low", low), &[(0.0, low_m), (6.0, low_m)], ""),
            drone(("high", high), &[(0.0, high_m), (6.0, high_m)], more),
        ])
    }

    #[test]
    fn wind_bends_the_jet_of_a_laden_drone_as_the_verifier_has_it() {
        let (low, high) = (
            ("offboard-2", [5.0, 6.2, 2.0]),
            ("matrice-300", [5.0, 5.0, 7.8]),
        );
        let mut laden = below(low, high, "");
        laden.drones[1].trajectory.mass_kg.fill(11.5);
        laden.air.effects = Some(airflow::effects::Effects {
            crossflow: Some(airflow::effects::Crossflow {
                wind_mps: [0.0, 1.0],
            }),
            ..Default::default()
        });
        let [flown, claimed] = alphas(&laden, 1.0);
        // The lower one is pushed down a little.
        assert!((flown / claimed - 1.0).abs() < 0.05, "{flown} {claimed}");
    }

    #[test]
    fn air_counts_however_long_it_is_under_way_and_from_however_high() {
        let mut tall = below(
            ("kolibri", [5.0, 5.0, 1.0]),
            ("crazyflie-2.1", [5.0, 5.0, 15.5]),
            "",
        );
        tall.bounds_m.max.z = 18.0;
        let [flown, claimed] = alphas(&tall, 0.6);
        assert!(
            claimed > 0.01 && (flown / claimed - 1.0).abs() < 0.05,
            "{flown} {claimed}"
        );
        let above = below(
            ("kolibri", [5.0, 5.0, 2.0]),
            ("matrice-300", [5.0, 5.0, 14.0]),
            "",
        );
        let [flown, claimed] = alphas(&above, 1.0);
        assert!(
            claimed > 0.3 && (flown / claimed - 1.0).abs() < 0.05,
            "{flown} {claimed}"
        );
    }

    #[test]
    fn air_found_to_be_thin_is_flown_in_by_its_own_drone_too() {
        let mut thin = below(
            ("kolibri", [5.0, 5.0, 2.0]),
            ("offboard-2", [5.0, 5.0, 6.0]),
            "",
        );
        let energy_j = |plan: &Plan| flown(plan, &calm_at(1.0)).flights[0].drones[1].energy_j;
        let battery_wh =
            |plan: &Plan| crate::battery::of_plan(plan, &Setup::default())[1].energy_wh;
        let before = [energy_j(&thin), battery_wh(&thin)];
        thin.air.effects = Some(airflow::effects::Effects {
            air_density: Some(airflow::effects::AirDensity {
                density_factor: 0.8,
            }),
            ..Default::default()
        });
        for (before, after) in before.into_iter().zip([energy_j(&thin), battery_wh(&thin)]) {
            // m g U_H, of which the high one has no exposure.
            assert!(
                (after / before - 0.8_f64.powf(-0.5)).abs() < 1e-3,
                "{before} {after}"
            );
        }
    }

    #[test]
    fn a_pad_excuses_what_drones_stand_on_and_no_zone() {
        let climbs = [(0.0, [16.0, 16.0, 3.1]), (3.0, [16.0, 16.0, 5.0])];
        let mut plan = plan(&[drone(("a", "kolibri"), &climbs, r#""at_start": "landed","#)]);
        assert!(flown(&plan, &calm_at(1.0)).is_within_limits());
        plan.zones = vec![planner::plan::Zone {
            name: "people".to_owned(),
            min_m: [14.0, 14.0, 0.0].into(),
            max_m: [18.0, 18.0, 3.05].into(),
            keep_out: true,
            air_limit_mps: None,
        }];
        let report = flown(&plan, &calm_at(1.0));
        let found = &report.flights[0].drones[0];
        assert_eq!(found.least_obstacle.as_deref(), Some("people"));
        assert!(found.is_in_obstacle() && !report.is_within_limits());
    }

    #[test]
    fn plans_that_cannot_be_flown_are_refused_in_words() {
        let refusal = |plan: &Plan| {
            let refused = fly(plan, &Setup::default(), &Options::default(), &|_, _| ());
            refused.expect_err("refused").to_string()
        };
        let good = passing();
        let mut plan = good.clone();
        plan.drones[1].trajectory.t_s.pop();
        assert!(refusal(&plan).starts_with("`high`: the trajectory lists"));
        let mut plan = good.clone();
        plan.drones[0].airframe.mass_kg = f64::NAN;
        assert!(refusal(&plan).starts_with("`low`:"));
        let mut plan = good.clone();
        plan.air.superposition = "most".to_owned();
        assert!(refusal(&plan).contains("superposition"));
        let mut plan = good.clone();
        plan.drones.clear();
        assert_eq!(refusal(&plan), "the plan has no drones");
        let crowd = (0..1001).map(|k| {
            let name = format!("d{k}");
            drone((&name, "kolibri"), &[(0.0, [5.0, 5.0, 2.0])], "")
        });
        let crowd = super::tests::plan(&crowd.collect::<Vec<_>>());
        assert!(refusal(&crowd).starts_with("1001 drones are in one place"));
        let mut plan = good;
        plan.drones[0].trajectory.t_s = vec![1e6];
        assert!(refusal(&plan).contains("drone-seconds"));
    }
}
