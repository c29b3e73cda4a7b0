//! The air that a recording's baseline simulates, and a hypothesis on top of it: at any point, at
//! any moment.

use std::borrow::Borrow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use airflow::Surroundings;
use airflow::effects::{Effects, EntrainmentRadial, WakeLean};
use airflow::{Airframe, DiscPoints, FarField, Wake};
use nalgebra::{Point3, Vector3};

use crate::forward::hypothesis::Hypothesis;
use crate::record::baseline::{Delay, Observation, ReceiverAir, Upper};
use crate::record::recording::{Recording, Role, Track, Vehicle};
use crate::record::track::Moment;

/// Iterations of the fixed point `t' = t - τ(z_e(t') - z)`. It contracts by the climb speed over
/// the jet's speed, a few percent: four leave less than a microsecond.
const DELAY_ITERATIONS: usize = 4;

/// All wakes of one recording over its time.
#[derive(Clone, Debug)]
pub struct Flow<'a> {
    recording: &'a Recording,
    emitters: Vec<TrackedEmitter<'a>>,
    effects: Effects,
    /// Speed of the air that carries the wake down over that of the centreline; `None`: at once.
    convection: Option<f64>,
    /// Whether the radial flow is left out.
    axial_only: bool,
    /// Where each vehicle was at each entry of its track (m).
    places_m: Vec<Arc<[Point3<f64>]>>,
    /// When the first drone's track begins (s).
    began_s: f64,
    /// Whether its drones hover all the time.
    hovers: bool,
}

/// A vehicle with a wake.
#[derive(Clone, Debug)]
struct TrackedEmitter<'a> {
    vehicle: usize,
    wake: Wake,
    track: &'a Track,
    /// Added to the recording's time to get that of the vehicle's clock (s).
    clock_s: f64,
    near: Near,
}

/// The entry of a track that was asked for last: the next is mostly near it. No answer depends on
/// it.
#[derive(Debug, Default)]
struct Near(AtomicUsize);

impl Clone for Near {
    fn clone(&self) -> Near {
        Near::default()
    }
}

/// A place in one drone's wake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Index of the vehicle whose wake it is.
    pub emitter: usize,
    /// Depth below its rotor plane over its motor distance.
    pub s_over_l: f64,
    /// Distance from its axis over its motor distance.
    pub r_over_l: f64,
    /// The same distance over the half-width at that depth.
    pub xi: f64,
    /// Azimuth around its axis in the world (rad), from x towards y.
    pub azimuth_rad: f64,
}

/// One drone's wake as its air arrives at a point.
struct Arrival<'a> {
    vehicle: usize,
    wake: &'a Wake,
    /// From where the drone was when the air left it (m).
    offset_m: Vector3<f64>,
    at: Surroundings,
}

/// One drone, seen from a point at the moment when the air there left it.
#[derive(Clone, Copy, Debug)]
pub enum Sighting {
    /// Its place is not known then.
    Unknown,
    /// Its rotors are idle: it has no wake.
    Idle,
    /// It flies.
    Flying {
        /// From the drone to the point (m).
        offset_m: Vector3<f64>,
        /// What of it and of the room the wake meets.
        at: Surroundings,
    },
}

/// What tells where drones are seen from a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View {
    convection: Option<f64>,
    /// Clock of each (s), and what carries its air, where that takes time.
    emitters: Vec<(f64, Option<FarField>)>,
}

impl View {
    /// How many drones have a wake.
    #[must_use]
    pub fn emitters(&self) -> usize {
        self.emitters.len()
    }
}

/// Wakes of the vehicles of some recordings, alike ones made once, shared by many flows.
#[derive(Clone, Debug)]
pub struct Wakes {
    made: Vec<Wake>,
    /// By recording and vehicle: which of them; `None` where it has none.
    of: Vec<Vec<Option<usize>>>,
    /// By recording and vehicle: where it was at each entry of its track (m).
    places_m: Vec<Vec<Arc<[Point3<f64>]>>>,
    /// By recording: whether its drones hover all the time.
    hovers: Vec<bool>,
}

/// How far (m) a drone that hovers all the time may be from its mean place, but for this part of
/// the time. Chosen here: hovers sway by centimetres, and a metre below an Offboard the jet's
/// half-width is 0.2 m.
const HOVERS_WITHIN_M: f64 = 0.2;
const BUT_FOR: f64 = 0.02;

/// Whether a drone hovers in one place all the time.
fn hovers(vehicle: &Vehicle) -> bool {
    let places_m = &vehicle.track.position_m;
    let entries = places_m.len() as f64;
    let mean_m = places_m.iter().map(|at| at.coords).sum::<Vector3<f64>>() / entries;
    let away = places_m
        .iter()
        .filter(|at| (at.coords - mean_m).norm() > HOVERS_WITHIN_M);
    away.count() as f64 <= BUT_FOR * entries
}

impl Wakes {
    /// The wakes that the baseline of one recording declares: none where each of its drones flies
    /// alone.
    #[must_use]
    pub fn new(recording: &Recording) -> Wakes {
        let mut wakes = Wakes::of_all(std::slice::from_ref(recording));
        if !recording.baseline.wakes {
            wakes.of = vec![vec![None; recording.vehicles.len()]];
        }
        wakes
    }

    /// The wakes of all vehicles but receivers, whether or not their baselines declare any.
    #[must_use]
    pub fn of_all(recordings: &[Recording]) -> Wakes {
        let mut made: Vec<(Wake, &Recording)> = Vec::new();
        let mut of = Vec::with_capacity(recordings.len());
        let mut places_m: Vec<Vec<Arc<[Point3<f64>]>>> = Vec::with_capacity(recordings.len());
        let emits = |vehicle: &&Vehicle| vehicle.role != Role::Receiver;
        let all_hover = |it: &Recording| it.vehicles.iter().filter(emits).all(hovers);
        for recording in recordings {
            let mut of_vehicle = |vehicle: &Vehicle| {
                let same = |(wake, known): &(Wake, &Recording)| {
                    *wake.airframe() == vehicle.airframe
                        && known.environment.air == recording.environment.air
                        && known.jet == recording.jet
                        && known.baseline.upper == recording.baseline.upper
                };
                if vehicle.role == Role::Receiver {
                    return None;
                }
                made.iter().position(same).or_else(|| {
                    made.push((hover_wake(recording, &vehicle.airframe), recording));
                    Some(made.len() - 1)
                })
            };
            of.push(recording.vehicles.iter().map(&mut of_vehicle).collect());
            let settled = |vehicle: &Vehicle| vehicle.track.settled_m().into();
            places_m.push(recording.vehicles.iter().map(settled).collect());
        }
        Wakes {
            made: made.into_iter().map(|(wake, _)| wake).collect(),
            of,
            places_m,
            hovers: recordings.iter().map(all_hover).collect(),
        }
    }

    /// That of one vehicle of one recording.
    #[must_use]
    pub fn of(&self, recording: usize, vehicle: usize) -> Option<&Wake> {
        let wake = (*self.of.get(recording)?.get(vehicle)?)?;
        self.made.get(wake)
    }

    /// Where one vehicle of one recording was at each entry of its track (m).
    #[must_use]
    pub fn places_m(&self, recording: usize, vehicle: usize) -> &[Point3<f64>] {
        &self.places_m[recording][vehicle]
    }

    /// All of them with effects of the air on.
    #[must_use]
    pub fn with_effects(&self, effects: &Effects) -> Wakes {
        let made = self.made.iter().map(|wake| wake.with_effects(effects));
        Wakes {
            made: made.collect(),
            of: self.of.clone(),
            places_m: self.places_m.clone(),
            hovers: self.hovers.clone(),
        }
    }
}

/// The wake in hover, its upper part as the recording's baseline declares it.
fn hover_wake(recording: &Recording, airframe: &Airframe) -> Wake {
    let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
    let (mass_kg, jet) = (airframe.mass_kg(), &recording.jet);
    let wake = Wake::new(airframe, mass_kg, density_kg_per_m3, jet);
    match recording.baseline.upper {
        Upper::FourRotors => wake,
        Upper::FarFieldExtrapolated => wake.extrapolated(),
    }
}

impl<'a> Flow<'a> {
    /// The air of a recording as its baseline declares it.
    #[must_use]
    pub fn new(recording: &'a Recording) -> Flow<'a> {
        Flow::supposing(recording, &Wakes::new(recording), &Hypothesis::default())
    }

    /// The same with a hypothesis on top of the recording's own plain wakes.
    #[must_use]
    pub fn supposing(recording: &'a Recording, wakes: &Wakes, hypothesis: &Hypothesis) -> Flow<'a> {
        let mut hypothesis = *hypothesis;
        let effects = &mut hypothesis.effects;
        let axial_only = recording.baseline.observation == Observation::AxialAndAmbient
            && effects.entrainment_radial.is_none();
        if *effects == Effects::default() {
            let mut flow = Flow::through((recording, 0), wakes, &hypothesis);
            flow.axial_only = axial_only;
            return flow;
        }
        if axial_only {
            effects.entrainment_radial = Some(EntrainmentRadial { factor: 0.0 });
        }
        let wakes = wakes.with_effects(effects);
        Flow::through((recording, 0), &wakes, &hypothesis)
    }

    /// A hypothesis on wakes that have its effects on already; the recording comes with its place
    /// among those that the wakes are of.
    #[must_use]
    pub fn through(
        (recording, at): (&'a Recording, usize),
        wakes: &Wakes,
        hypothesis: &Hypothesis,
    ) -> Flow<'a> {
        let emitter = |(vehicle, of): (usize, &'a Vehicle)| {
            Some(TrackedEmitter {
                vehicle,
                wake: wakes.of(at, vehicle)?.clone(),
                track: &of.track,
                clock_s: hypothesis.sensor.clock_s,
                near: Near::default(),
            })
        };
        let vehicles = recording.vehicles.iter().enumerate();
        let emitters: Vec<TrackedEmitter> = vehicles.filter_map(emitter).collect();
        let took_off = |emitter: &TrackedEmitter| emitter.track.t_s.first().copied();
        let began_s = emitters.iter().filter_map(took_off);
        let declared = match recording.baseline.delay {
            Delay::None => None,
            Delay::Transport { convection } => Some(convection),
        };
        let transport = hypothesis.effects.wake_transport;
        Flow {
            recording,
            began_s: began_s.fold(f64::INFINITY, f64::min),
            emitters,
            effects: hypothesis.effects,
            convection: transport.map_or(declared, |transport| transport.convection()),
            axial_only: false,
            places_m: wakes.places_m[at].clone(),
            hovers: wakes.hovers[at],
        }
    }

    /// The recording whose air it is.
    #[must_use]
    pub fn recording(&self) -> &'a Recording {
        self.recording
    }

    /// How far (s) a clock that is off by `clock_s` moves the place of a probe along its way, too:
    /// below drones that hover their own clock shows nowhere, so that it is the readings' against
    /// that of all places. Below drones that move, a probe's place is by its own clock.
    #[must_use]
    pub fn place_ahead_s(&self, clock_s: f64) -> f64 {
        if self.hovers { clock_s } else { 0.0 }
    }

    /// Where a vehicle was at each entry of its track (m).
    #[must_use]
    pub fn places_m(&self, vehicle: usize) -> &[Point3<f64>] {
        &self.places_m[vehicle]
    }

    /// Where a vehicle was at a moment of its track (m).
    #[must_use]
    pub fn position_m(&self, vehicle: usize, moment: Moment) -> Point3<f64> {
        Track::place_at(self.places_m(vehicle), moment)
    }

    /// Sets a vehicle's clock offset: `offset_s` is added to the recording's time to read its
    /// track.
    pub fn set_clock_offset(&mut self, vehicle: usize, offset_s: f64) {
        let mut emitters = self.emitters.iter_mut();
        if let Some(emitter) = emitters.find(|emitter| emitter.vehicle == vehicle) {
            emitter.clock_s = offset_s;
        }
    }

    /// Air (m/s, downwards) to which a rotor plane centred at `centre_m` is exposed: at its centre
    /// or over its discs, from the vehicles whose index `counts`. `None` where the place of one of
    /// them is not known then: a gap in its track.
    pub fn met_mps(
        &self,
        air: ReceiverAir,
        discs: &DiscPoints,
        (t_s, centre_m): (f64, Point3<f64>),
        counts: impl Fn(usize) -> bool,
    ) -> Option<f64> {
        if air == ReceiverAir::Centre {
            return Some(-self.velocity_among_mps(t_s, centre_m, counts)?.z);
        }
        let plain = self.effects == Effects::default();
        let mut gathered = vec![0.0; discs.weights.len()];
        for arrival in self.arrivals(t_s, centre_m, counts) {
            let Arrival {
                wake, offset_m, at, ..
            } = arrival?;
            if offset_m.z >= -airflow::HEIGHT_TOLERANCE_M {
                continue;
            }
            for (so_far, &[x, y]) in gathered.iter_mut().zip(&discs.offsets_m) {
                let offset_m = offset_m + Vector3::new(x, y, 0.0);
                let down_mps = match plain {
                    true => wake.axial_speed_mps(offset_m),
                    false => -at.velocity_mps(&self.effects, wake, offset_m).z,
                };
                *so_far = self.gather(*so_far, down_mps);
            }
        }
        let (wind_mps, _) = self.effects.background_mps(t_s - self.began_s);
        let weighed = discs.weights.iter().zip(gathered);
        let mean_mps: f64 = weighed
            .map(|(weight, gathered)| weight * self.finish(gathered))
            .sum();
        Some(mean_mps - wind_mps.z)
    }

    /// Velocity (m/s, world) of the air at a point: axial speeds added as the baseline says,
    /// horizontal ones as vectors, the wind on top. Without the radial flow where the baseline's
    /// probe does not see it. `None` where some drone's place is not known.
    #[must_use]
    pub fn velocity_mps(
        &self,
        t_s: f64,
        point_m: Point3<f64>,
        but: Option<usize>,
    ) -> Option<Vector3<f64>> {
        self.velocity_among_mps(t_s, point_m, |vehicle| Some(vehicle) != but)
    }

    /// What [`Flow::velocity_mps`] is with every vehicle, from where they are seen from the point
    /// already: by a flow of the same [`View`].
    #[must_use]
    pub fn velocity_seen_mps(
        &self,
        t_s: f64,
        point_m: Point3<f64>,
        seen: &[Sighting],
    ) -> Option<Vector3<f64>> {
        self.velocity_of_mps(t_s, point_m, self.emitters.iter().zip(seen))
    }

    fn velocity_among_mps(
        &self,
        t_s: f64,
        point_m: Point3<f64>,
        counts: impl Fn(usize) -> bool,
    ) -> Option<Vector3<f64>> {
        self.velocity_of_mps(t_s, point_m, self.sighted(t_s, point_m, counts))
    }

    fn velocity_of_mps<'f>(
        &'f self,
        t_s: f64,
        point_m: Point3<f64>,
        sighted: impl Iterator<Item = (&'f TrackedEmitter<'a>, impl Borrow<Sighting>)>,
    ) -> Option<Vector3<f64>>
    where
        'a: 'f,
    {
        let floor_z_m = self.floor_z_m().unwrap_or(f64::NEG_INFINITY);
        let below_floor = point_m.z < floor_z_m - airflow::HEIGHT_TOLERANCE_M;
        let mut horizontal_mps = Vector3::zeros();
        let mut gathered = 0.0;
        for (TrackedEmitter { wake, .. }, sighting) in sighted {
            let (offset_m, at) = match sighting.borrow() {
                Sighting::Unknown => return None,
                Sighting::Idle => continue,
                Sighting::Flying { offset_m, at } => (*offset_m, at),
            };
            if offset_m.z >= -airflow::HEIGHT_TOLERANCE_M || below_floor {
                continue;
            }
            let velocity_mps = match self.axial_only {
                true => Vector3::new(0.0, 0.0, -wake.axial_speed_mps(offset_m)),
                false => at.velocity_mps(&self.effects, wake, offset_m),
            };
            horizontal_mps += Vector3::new(velocity_mps.x, velocity_mps.y, 0.0);
            gathered = self.gather(gathered, -velocity_mps.z);
        }
        let (wind_mps, _) = self.effects.background_mps(t_s - self.began_s);
        let down_mps = self.finish(gathered);
        Some(horizontal_mps + wind_mps - Vector3::z() * down_mps)
    }

    /// The speed (m/s) without direction that is there at a time beside the jets: the ambient of
    /// the metadata, and a level flow of the room.
    #[must_use]
    pub fn ambient_mps(&self, t_s: f64) -> f64 {
        let (_, return_flow_mps) = self.effects.background_mps(t_s - self.began_s);
        let ambient_mps = self.recording.environment.ambient_mps;
        // Mostly there is none: the same to the last bit.
        match return_flow_mps {
            0.0 => ambient_mps.abs(),
            _ => ambient_mps.hypot(return_flow_mps),
        }
    }

    /// What is added to the baseline.
    #[must_use]
    pub fn effects(&self) -> &Effects {
        &self.effects
    }

    /// Where a point lies in the wake that is fastest there, or, where none does, in that of the
    /// drone above whose axis is nearest in half-widths. `None` with no drone above, or none whose
    /// place is known.
    #[must_use]
    pub fn place(&self, t_s: f64, point_m: Point3<f64>, but: Option<usize>) -> Option<Place> {
        let others = |vehicle| Some(vehicle) != but;
        let arrivals = self.arrivals(t_s, point_m, others).flatten();
        let of_arrival = |arrival: Arrival| {
            let (wake, offset_m) = (arrival.wake, arrival.offset_m);
            let length_m = wake.motor_distance_m();
            let radius_m = offset_m.x.hypot(offset_m.y);
            let place = Place {
                emitter: arrival.vehicle,
                s_over_l: -offset_m.z / length_m,
                r_over_l: radius_m / length_m,
                xi: radius_m / wake.half_width_m(-offset_m.z),
                azimuth_rad: offset_m.y.atan2(offset_m.x),
            };
            (wake.axial_speed_mps(offset_m), place)
        };
        let below = arrivals.filter(|arrival| arrival.offset_m.z < 0.0);
        let best = below.map(of_arrival).reduce(|best, next| {
            let is_faster = next.0 > best.0 || (next.0 == best.0 && next.1.xi < best.1.xi);
            if is_faster { next } else { best }
        });
        best.map(|(_, place)| place)
    }

    /// Axial speeds (m/s) of the two jets that are fastest at a point, the faster first; 0 where
    /// there is none.
    #[must_use]
    pub fn strongest_mps(&self, t_s: f64, point_m: Point3<f64>, but: Option<usize>) -> [f64; 2] {
        let others = |vehicle| Some(vehicle) != but;
        let arrivals = self.arrivals(t_s, point_m, others).flatten();
        let speeds_mps = arrivals.map(|arrival| arrival.wake.axial_speed_mps(arrival.offset_m));
        speeds_mps.fold([0.0; 2], |[first, second], speed_mps| {
            [first.max(speed_mps), second.max(speed_mps.min(first))]
        })
    }

    fn gather(&self, so_far: f64, speed_mps: f64) -> f64 {
        let declared = self.recording.baseline.superposition;
        let merging = self.effects.jet_merging.as_ref();
        let gathered = merging.map(|merging| merging.gather(so_far, speed_mps));
        gathered.unwrap_or_else(|| declared.gather(so_far, speed_mps))
    }

    fn finish(&self, gathered: f64) -> f64 {
        match &self.effects.jet_merging {
            Some(merging) => merging.finish(gathered),
            None => self.recording.baseline.superposition.finish(gathered),
        }
    }

    fn floor_z_m(&self) -> Option<f64> {
        self.recording.environment.floor_z_m
    }

    /// The wakes of the vehicles that count, as their air arrives at a point; idle rotors have
    /// none. `None` for a drone whose place is not known.
    fn arrivals(
        &self,
        t_s: f64,
        point_m: Point3<f64>,
        counts: impl Fn(usize) -> bool,
    ) -> impl Iterator<Item = Option<Arrival<'_>>> {
        self.sighted(t_s, point_m, counts)
            .filter_map(|(emitter, seen)| Flow::arrival(emitter, seen))
    }

    /// The vehicles that count, and each as it is seen from a point.
    fn sighted(
        &self,
        t_s: f64,
        point_m: Point3<f64>,
        counts: impl Fn(usize) -> bool,
    ) -> impl Iterator<Item = (&TrackedEmitter<'a>, Sighting)> {
        let leans = self.effects.wake_lean.is_some();
        let counted = self.emitters.iter();
        counted
            .filter(move |emitter| counts(emitter.vehicle))
            .map(move |emitter| (emitter, self.sighting(emitter, leans, (t_s, point_m))))
    }

    /// An emitter's wake as it is seen; nothing where its rotors are idle.
    fn arrival<'f>(emitter: &'f TrackedEmitter, seen: Sighting) -> Option<Option<Arrival<'f>>> {
        match seen {
            Sighting::Unknown => Some(None),
            Sighting::Idle => None,
            Sighting::Flying { offset_m, at } => Some(Some(Arrival {
                vehicle: emitter.vehicle,
                wake: &emitter.wake,
                offset_m,
                at,
            })),
        }
    }

    /// One drone as it is seen from a point; how it leaned when the air left is looked for where a
    /// wake `leans`.
    fn sighting(
        &self,
        emitter: &TrackedEmitter,
        leans: bool,
        (t_s, point_m): (f64, Point3<f64>),
    ) -> Sighting {
        let Some(moment) = self.moment_of(emitter, self.convection, t_s, point_m) else {
            return Sighting::Unknown;
        };
        if emitter.track.is_idle(moment.entry) {
            return Sighting::Idle;
        }
        let position_m = self.position_m(emitter.vehicle, moment);
        let lean = leans.then(|| {
            // Where a baseline has air arrive at once, it leans as its drone did when it left all
            // the same; before the track, or across a gap, as the drone does now.
            let left = match self.convection {
                None => self
                    .moment_of(emitter, Some(1.0), t_s, point_m)
                    .unwrap_or(moment),
                Some(_) => moment,
            };
            WakeLean::against(emitter.track.attitude_at(left) * Vector3::z())
        });
        Sighting::Flying {
            offset_m: point_m - position_m,
            at: Surroundings {
                t_s,
                lean: lean.unwrap_or_default(),
                climb_mps: emitter.track.velocity_mps[moment.entry].z,
                floor_z_m: self.floor_z_m(),
                emitter_z_m: position_m.z,
            },
        }
    }

    /// Every vehicle with a wake, as it is seen from a point at a time; how it leans where that is
    /// asked for.
    pub fn sightings(
        &self,
        leans: bool,
        t_s: f64,
        point_m: Point3<f64>,
    ) -> impl Iterator<Item = Sighting> {
        let emitters = self.emitters.iter();
        emitters.map(move |emitter| self.sighting(emitter, leans, (t_s, point_m)))
    }

    /// What of it tells where drones are seen from any point, how they lean apart.
    #[must_use]
    pub fn view(&self) -> View {
        let is_carried = self.convection.is_some();
        let emitter =
            |of: &TrackedEmitter| (of.clock_s, is_carried.then_some(*of.wake.far_field()));
        View {
            convection: self.convection,
            emitters: self.emitters.iter().map(emitter).collect(),
        }
    }

    /// When the air at a point left a drone; `None`: its place is not known then.
    fn moment_of(
        &self,
        emitter: &TrackedEmitter,
        convection: Option<f64>,
        t_s: f64,
        point_m: Point3<f64>,
    ) -> Option<Moment> {
        let t_s = t_s + emitter.clock_s;
        let near = &emitter.near.0;
        let mut moment = emitter
            .track
            .moment_near(t_s, near.load(Ordering::Relaxed))?;
        near.store(moment.entry, Ordering::Relaxed);
        if let Some(convection) = convection {
            for _ in 0..DELAY_ITERATIONS {
                let depth_m = self.position_m(emitter.vehicle, moment).z - point_m.z;
                let far = emitter.wake.far_field();
                // Air older than the track came from where the track begins.
                let left_s = (t_s - far.transport_time_s(depth_m, convection))
                    .max(*emitter.track.t_s.first()?);
                let before = moment;
                moment = emitter.track.moment_near(left_s, moment.entry)?;
                // A drone that keeps its height needs one iteration.
                if moment == before {
                    break;
                }
            }
        }
        Some(moment)
    }
}
