//! The air that a recording's baseline simulates, and a hypothesis on top of it: at any point, at any moment.

use airflow::effects::{Effects, EntrainmentRadial, Surroundings};
use airflow::{Source, Superposition, Wake};
use nalgebra::{Point3, Vector3};

use crate::forward::hypothesis::Hypothesis;
use crate::forward::simulate::Place;
use crate::record::baseline::{Delay, Observation, Upper};
use crate::record::recording::{Recording, Role, Track};
use crate::record::track::Moment;

/// Throttle over that of hover, and mean duty cycle, below which a drone is taken to stand with idle rotors and not to blow. Chosen
/// here: well above idle, and half of the least that holds any drone in the air.
const IDLE_THROTTLE: f64 = 0.3;
const IDLE_DUTY: f64 = 0.2;

/// Turns of the fixed point `t' = t - τ(z_e(t') - z)`. It contracts by the climb speed over the jet's speed, a few percent:
/// four leave less than a microsecond.
const DELAY_TURNS: usize = 4;

/// All wakes of one recording over its time.
#[derive(Clone, Debug)]
pub struct Flow<'a> {
    recording: &'a Recording,
    emitters: Vec<Emitter<'a>>,
    effects: Effects,
    /// Speed of the air that carries the wake down over that of the centreline; `None`: at once.
    convection: Option<f64>,
    /// Whether the radial flow is left out.
    axial_only: bool,
    /// When the first drone's track begins (s).
    began_s: f64,
}

/// A vehicle that blows.
#[derive(Clone, Debug)]
struct Emitter<'a> {
    vehicle: usize,
    wake: Wake,
    track: &'a Track,
    /// Added to the recording's time to get that of the vehicle's clock (s).
    clock_s: f64,
}

/// Plain wakes of a recording's vehicles, by index: made once, shared by many flows.
#[derive(Clone, Debug)]
pub struct Wakes(Vec<Option<Wake>>);

impl Wakes {
    /// That of one vehicle.
    #[must_use]
    pub fn of(&self, vehicle: usize) -> Option<&Wake> {
        self.0.get(vehicle)?.as_ref()
    }

    /// The wakes that the baseline declares; `None` for those who do not blow.
    #[must_use]
    pub fn new(recording: &Recording) -> Wakes {
        let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
        let mut known: Vec<Wake> = Vec::new();
        let blows = |role| recording.baseline.wakes && role != Role::Receiver;
        let mut wake_of = |airframe: &airflow::Airframe| {
            if let Some(wake) = known.iter().find(|wake| wake.airframe() == airframe) {
                return wake.clone();
            }
            let mass_kg = airframe.mass_kg();
            let wake = Wake::new(airframe, mass_kg, density_kg_per_m3, &recording.jet);
            let wake = match recording.baseline.upper {
                Upper::FourRotors => wake,
                Upper::FarFieldExtrapolated => wake.extrapolated(),
            };
            known.push(wake.clone());
            wake
        };
        let of_vehicle = |vehicle: &crate::record::recording::Vehicle| {
            blows(vehicle.role).then(|| wake_of(&vehicle.airframe))
        };
        Wakes(recording.vehicles.iter().map(of_vehicle).collect())
    }
}

impl<'a> Flow<'a> {
    /// The air of a recording as its baseline declares it.
    #[must_use]
    pub fn new(recording: &'a Recording) -> Flow<'a> {
        Flow::supposing(recording, &Wakes::new(recording), &Hypothesis::default())
    }

    /// The same with a hypothesis on top.
    #[must_use]
    pub fn supposing(recording: &'a Recording, wakes: &Wakes, hypothesis: &Hypothesis) -> Flow<'a> {
        let mut effects = hypothesis.effects;
        let axial_only = recording.baseline.observation == Observation::AxialAndAmbient
            && effects.entrainment_radial.is_none();
        let plain = effects == Effects::default();
        if axial_only && !plain {
            effects.entrainment_radial = Some(EntrainmentRadial { factor: 0.0 });
        }
        let emitters = recording.vehicles.iter().zip(&wakes.0).enumerate();
        let emitters: Vec<Emitter> = emitters
            .filter_map(|(index, (vehicle, wake))| {
                let wake = wake.as_ref()?;
                Some(Emitter {
                    vehicle: index,
                    wake: if plain {
                        wake.clone()
                    } else {
                        wake.with_effects(&effects)
                    },
                    track: &vehicle.track,
                    clock_s: hypothesis.sensor.clock_s,
                })
            })
            .collect();
        let took_off = |emitter: &Emitter| emitter.track.t_s.first().copied();
        let began_s = emitters
            .iter()
            .filter_map(took_off)
            .fold(f64::INFINITY, f64::min);
        let declared = match recording.baseline.delay {
            Delay::None => None,
            Delay::Transport { convection } => Some(convection),
        };
        Flow {
            recording,
            emitters,
            began_s,
            effects,
            convection: effects
                .wake_transport
                .map_or(declared, |transport| transport.convection()),
            axial_only: axial_only && plain,
        }
    }

    /// Sets a vehicle's clock offset: `offset_s` is added to the recording's time to read its track.
    pub fn set_clock_offset(&mut self, vehicle: usize, offset_s: f64) {
        for emitter in &mut self.emitters {
            if emitter.vehicle == vehicle {
                emitter.clock_s = offset_s;
            }
        }
    }

    /// The wakes that can reach a point at a time, each where its drone was when that air left it; `but` names a vehicle that does
    /// not blow on itself. `false`: some drone's place is not known then (a gap in its track), and the air is not either.
    pub fn sources_at<'s>(
        &'s self,
        t_s: f64,
        point_m: Point3<f64>,
        but: Option<usize>,
        sources: &mut Vec<Source<'s>>,
    ) -> bool {
        sources.clear();
        for emitter in self.but(but) {
            let Some(moment) = self.moment_of(emitter, t_s, point_m) else {
                return false;
            };
            if !emitter.track.is_idle(moment.entry) {
                sources.push(Source {
                    wake: &emitter.wake,
                    position_m: emitter.track.position_at(moment),
                    ends_at_z_m: self.floor_z_m().unwrap_or(f64::NEG_INFINITY),
                });
            }
        }
        true
    }

    /// Velocity (m/s, world) of the air at a point: axial speeds added as the baseline says, horizontal ones as vectors, the wind on
    /// top. Without the radial flow where the baseline's probe does not see it. `None` where some drone's place is not known.
    #[must_use]
    pub fn velocity_mps(
        &self,
        t_s: f64,
        point_m: Point3<f64>,
        but: Option<usize>,
    ) -> Option<Vector3<f64>> {
        let floor_z_m = self.floor_z_m();
        let below_floor =
            floor_z_m.is_some_and(|z_m| point_m.z < z_m - airflow::HEIGHT_TOLERANCE_M);
        let mut horizontal_mps = Vector3::zeros();
        let mut gathered = 0.0;
        for emitter in self.but(but) {
            let moment = self.moment_of(emitter, t_s, point_m)?;
            if emitter.track.is_idle(moment.entry) {
                continue;
            }
            let position_m = emitter.track.position_at(moment);
            let offset_m = point_m - position_m;
            if offset_m.z >= -airflow::HEIGHT_TOLERANCE_M || below_floor {
                continue;
            }
            let velocity_mps = if self.axial_only {
                Vector3::new(0.0, 0.0, -emitter.wake.axial_speed_mps(offset_m))
            } else {
                let at = Surroundings {
                    t_s,
                    climb_mps: emitter.track.velocity_mps[moment.entry].z,
                    floor_z_m,
                    emitter_z_m: position_m.z,
                };
                self.effects.meet(&emitter.wake, offset_m, &at)
            };
            horizontal_mps += Vector3::new(velocity_mps.x, velocity_mps.y, 0.0);
            gathered = self.gather(gathered, -velocity_mps.z);
        }
        let (wind_mps, _) = self.effects.background_mps(t_s - self.began_s);
        let down_mps = self.finish(gathered);
        Some(horizontal_mps + wind_mps - Vector3::z() * down_mps)
    }

    /// The speed (m/s) without direction that is there at a time beside the jets: the ambient of the metadata, and a draught.
    #[must_use]
    pub fn ambient_mps(&self, t_s: f64) -> f64 {
        let (_, draught_mps) = self.effects.background_mps(t_s - self.began_s);
        self.recording.environment.ambient_mps.hypot(draught_mps)
    }

    /// What is added to the baseline.
    #[must_use]
    pub fn effects(&self) -> &Effects {
        &self.effects
    }

    /// Where a point lies in the wake that blows hardest on it, or, where none does, in that of the drone above whose axis is
    /// nearest in half-widths. `None` with no drone above, or none whose place is known.
    #[must_use]
    pub fn place(&self, t_s: f64, point_m: Point3<f64>, but: Option<usize>) -> Option<Place> {
        let mut best: Option<(f64, Place)> = None;
        for emitter in self.but(but) {
            let Some(moment) = self.moment_of(emitter, t_s, point_m) else {
                continue;
            };
            let offset_m = point_m - emitter.track.position_at(moment);
            if offset_m.z >= 0.0 || emitter.track.is_idle(moment.entry) {
                continue;
            }
            let length_m = emitter.wake.motor_distance_m();
            let radius_m = offset_m.x.hypot(offset_m.y);
            let place = Place {
                emitter: emitter.vehicle,
                s_over_l: -offset_m.z / length_m,
                r_over_l: radius_m / length_m,
                xi: radius_m / emitter.wake.half_width_m(-offset_m.z),
                azimuth_rad: offset_m.y.atan2(offset_m.x),
            };
            let speed_mps = emitter.wake.axial_speed_mps(offset_m);
            let harder = best.is_none_or(|(best_mps, best)| {
                speed_mps > best_mps || (speed_mps == best_mps && place.xi < best.xi)
            });
            if harder {
                best = Some((speed_mps, place));
            }
        }
        best.map(|(_, place)| place)
    }

    /// Axial speeds (m/s) of the two jets that blow hardest on a point, harder first; 0 where there is none.
    #[must_use]
    pub fn strongest_mps(&self, t_s: f64, point_m: Point3<f64>, but: Option<usize>) -> [f64; 2] {
        let mut strongest_mps = [0.0; 2];
        for emitter in self.but(but) {
            let Some(moment) = self.moment_of(emitter, t_s, point_m) else {
                continue;
            };
            let offset_m = point_m - emitter.track.position_at(moment);
            let speed_mps = emitter.wake.axial_speed_mps(offset_m);
            if speed_mps > strongest_mps[0] {
                strongest_mps = [speed_mps, strongest_mps[0]];
            } else if speed_mps > strongest_mps[1] {
                strongest_mps[1] = speed_mps;
            }
        }
        strongest_mps
    }

    /// How wakes add up in the baseline.
    #[must_use]
    pub fn superposition(&self) -> Superposition {
        self.recording.baseline.superposition
    }

    fn gather(&self, so_far: f64, speed_mps: f64) -> f64 {
        if let Some(merging) = &self.effects.jet_merging {
            return merging.gather(so_far, speed_mps);
        }
        match self.superposition() {
            Superposition::Momentum => so_far + speed_mps * speed_mps,
            Superposition::Linear => so_far + speed_mps,
            Superposition::Strongest => so_far.max(speed_mps),
        }
    }

    fn finish(&self, gathered: f64) -> f64 {
        if let Some(merging) = &self.effects.jet_merging {
            return merging.finish(gathered);
        }
        match self.superposition() {
            Superposition::Momentum => gathered.sqrt(),
            Superposition::Linear | Superposition::Strongest => gathered,
        }
    }

    fn floor_z_m(&self) -> Option<f64> {
        self.recording.environment.floor_z_m
    }

    fn but(&self, vehicle: Option<usize>) -> impl Iterator<Item = &Emitter<'a>> {
        self.emitters
            .iter()
            .filter(move |emitter| Some(emitter.vehicle) != vehicle)
    }

    /// When the air at a point left a drone; `None`: its place is not known then.
    fn moment_of(&self, emitter: &Emitter, t_s: f64, point_m: Point3<f64>) -> Option<Moment> {
        let t_s = t_s + emitter.clock_s;
        let mut moment = emitter.track.moment(t_s)?;
        if let Some(convection) = self.convection {
            for _ in 0..DELAY_TURNS {
                let depth_m = emitter.track.position_at(moment).z - point_m.z;
                let far = emitter.wake.far_field();
                // Air older than the track came from where the track begins.
                let left_s = (t_s - far.transport_time_s(depth_m, convection))
                    .max(*emitter.track.t_s.first()?);
                let before = moment;
                moment = emitter.track.moment(left_s)?;
                // A drone that keeps its height needs one turn.
                if moment == before {
                    break;
                }
            }
        }
        Some(moment)
    }
}

impl Track {
    /// Whether the rotors are idle at an entry, as far as throttle or duty cycle tell.
    #[must_use]
    pub fn is_idle(&self, entry: usize) -> bool {
        let throttle = self.throttle_ratio.as_ref().map(|column| column[entry]);
        let duty = self.duty.as_ref().map(|column| column[entry]);
        throttle.is_some_and(|ratio| ratio < IDLE_THROTTLE)
            || duty.is_some_and(|motors| motors.iter().sum::<f64>() / 4.0 < IDLE_DUTY)
    }
}
