//! The air that a recording's baseline simulates: at any point, at any moment.

use airflow::{Source, Superposition, Wake};
use nalgebra::{Point3, Vector3};

use crate::baseline::{Delay, Upper};
use crate::recording::{Recording, Role, Track};
use crate::simulate::Place;

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

impl<'a> Flow<'a> {
    /// The air of a recording as its baseline declares it.
    #[must_use]
    pub fn new(recording: &'a Recording) -> Flow<'a> {
        let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
        let mut wakes: Vec<Wake> = Vec::new();
        let mut emitters = Vec::new();
        for (index, vehicle) in recording.vehicles.iter().enumerate() {
            if !recording.baseline.wakes || vehicle.role == Role::Receiver {
                continue;
            }
            let airframe = &vehicle.airframe;
            let known = wakes.iter().find(|wake| wake.airframe() == airframe);
            let wake = known.cloned().unwrap_or_else(|| {
                let wake = Wake::new(
                    airframe,
                    airframe.mass_kg(),
                    density_kg_per_m3,
                    &recording.jet,
                );
                let wake = match recording.baseline.upper {
                    Upper::FourRotors => wake,
                    Upper::FarFieldExtrapolated => wake.extrapolated(),
                };
                wakes.push(wake.clone());
                wake
            });
            emitters.push(Emitter {
                vehicle: index,
                wake,
                track: &vehicle.track,
                clock_s: 0.0,
            });
        }
        Flow {
            recording,
            emitters,
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
            match self.position_of(emitter, t_s, point_m) {
                None => return false,
                Some(None) => {}
                Some(Some(position_m)) => sources.push(Source {
                    wake: &emitter.wake,
                    position_m,
                    ends_at_z_m: self.floor_z_m(),
                }),
            }
        }
        true
    }

    /// Velocity (m/s, world) of the air at a point: axial speeds added as the baseline says, horizontal ones as vectors.
    /// `None` where some drone's place is not known.
    #[must_use]
    pub fn velocity_mps(&self, t_s: f64, point_m: Point3<f64>) -> Option<Vector3<f64>> {
        let mut horizontal_mps = Vector3::zeros();
        let mut sources = Vec::with_capacity(self.emitters.len());
        if !self.sources_at(t_s, point_m, None, &mut sources) {
            return None;
        }
        for source in &sources {
            if point_m.z >= source.ends_at_z_m - airflow::HEIGHT_TOLERANCE_M {
                horizontal_mps += source.wake.velocity_mps(point_m - source.position_m);
            }
        }
        let down_mps =
            airflow::axial_speed_mps(&sources, point_m, self.recording.baseline.superposition);
        Some(Vector3::new(horizontal_mps.x, horizontal_mps.y, -down_mps))
    }

    /// Where a point lies in the wake that blows hardest on it, or, where none does, in that of the drone above whose axis is
    /// nearest in half-widths. `None` with no drone above, or none whose place is known.
    #[must_use]
    pub fn place(&self, t_s: f64, point_m: Point3<f64>, but: Option<usize>) -> Option<Place> {
        let mut best: Option<(f64, Place)> = None;
        for emitter in self.but(but) {
            let Some(Some(position_m)) = self.position_of(emitter, t_s, point_m) else {
                continue;
            };
            let offset_m = point_m - position_m;
            if offset_m.z >= 0.0 {
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

    /// How wakes add up.
    #[must_use]
    pub fn superposition(&self) -> Superposition {
        self.recording.baseline.superposition
    }

    fn floor_z_m(&self) -> f64 {
        self.recording
            .environment
            .floor_z_m
            .unwrap_or(f64::NEG_INFINITY)
    }

    fn but(&self, vehicle: Option<usize>) -> impl Iterator<Item = &Emitter<'a>> {
        self.emitters
            .iter()
            .filter(move |emitter| Some(emitter.vehicle) != vehicle)
    }

    /// `None`: not known. `Some(None)`: stands with idle rotors.
    fn position_of(
        &self,
        emitter: &Emitter,
        t_s: f64,
        point_m: Point3<f64>,
    ) -> Option<Option<Point3<f64>>> {
        let t_s = t_s + emitter.clock_s;
        let mut moment = emitter.track.moment(t_s)?;
        if let Delay::Transport { convection } = self.recording.baseline.delay {
            for _ in 0..DELAY_TURNS {
                let depth_m = emitter.track.position_at(moment).z - point_m.z;
                let far = emitter.wake.far_field();
                // Air older than the track came from where the track begins.
                let left_s = (t_s - far.transport_time_s(depth_m, convection))
                    .max(*emitter.track.t_s.first()?);
                moment = emitter.track.moment(left_s)?;
            }
        }
        if emitter.track.is_idle(moment.entry) {
            return Some(None);
        }
        Some(Some(emitter.track.position_at(moment)))
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
