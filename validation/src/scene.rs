//! One synthetic flight: which drone flies where, through what air, measured with what; and what is
//! recorded of it.

use nalgebra::Vector3;

use crate::recorded;
use crate::truth::{Injected, Truth};
use crate::world::{
    Air, Answer, Drone, Emitter, Faults, GRAVITY, Instrument, Noise, Readings, ReceiverConditions,
    Route, Seen, Summing, World, density, detectable,
};
use diagnosis::record::recording::Recording;
use diagnosis::statistics::draws::Draws;

/// White noise of a logged throttle and power, relative.
const THROTTLE_NOISE: f64 = 0.015;
/// Noise of a motion-capture position (m).
const CAPTURE_NOISE_M: f64 = 0.0015;
/// Power that lifts over electrical power. Chosen here, as small drones have it.
const FIGURE_OF_MERIT: f64 = 0.6;
/// How well mass and propellers are known, as a relative error of the jet's speed. Chosen here: a
/// percent of the mass.
const KNOWN: f64 = 0.003;

/// A synthetic flight.
#[derive(Clone, Debug)]
pub(super) struct Scene {
    pub(super) emitters: Vec<Emitter>,
    pub(super) receiver: Option<Receiver>,
    pub(super) probes: Vec<Probe>,
    pub(super) air: Air,
    pub(super) faults: Faults,
    pub(super) noise: Noise,
    pub(super) instrument: Instrument,
    pub(super) temperature_k: f64,
    pub(super) pressure_pa: f64,
    /// True density over that of the stated temperature and pressure.
    pub(super) density_factor: f64,
    pub(super) floor_z_m: f64,
    pub(super) ceiling_z_m: Option<f64>,
    pub(super) track_hz: f64,
    /// Whether the metadata say that momenta add, and that probes feel the radial flow.
    pub(super) declares_momentum_sum: bool,
    pub(super) declares_radial: bool,
    /// What they say of the speed of a parcel over that on the axis; `None`: jets hang on their
    /// drones.
    pub(super) declares_convection: Option<f64>,
    /// When (s) effects of the air set in; before, the air is as declared.
    pub(super) begins_s: f64,
    /// Spans (s) of which the logger lost the readings.
    pub(super) lost_s: Vec<[f64; 2]>,
    pub(super) effects: Vec<Injected>,
    pub(super) is_outside: bool,
}

/// A probe, and when it was switched on.
#[derive(Clone, Debug)]
pub(super) struct Probe {
    /// In the room, or off the drone that carries it.
    pub(super) place_m: Vector3<f64>,
    pub(super) on_s: [f64; 2],
    /// The route of a drone that carries it, whose own wake it does not meet.
    pub(super) carried_by: Option<Route>,
}

impl Probe {
    /// Fixed in the room, always on.
    pub(super) fn at(place_m: Vector3<f64>) -> Probe {
        Probe {
            place_m,
            on_s: [f64::NEG_INFINITY, f64::INFINITY],
            carried_by: None,
        }
    }

    pub(super) fn position_m(&self, t_s: f64) -> Vector3<f64> {
        let carried = self.carried_by.as_ref();
        self.place_m + carried.map_or_else(Vector3::zeros, |route| route.position_m(t_s))
    }
}

/// A drone whose throttle is recorded.
#[derive(Clone, Debug)]
pub(super) struct Receiver {
    pub(super) drone: Drone,
    pub(super) route: Route,
    pub(super) answer: Answer,
    /// Voltage when full, and what it loses over the flight.
    pub(super) full_v: f64,
    pub(super) sags_v: f64,
}

/// One row of the main channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) t_s: f64,
    /// Which probe; for a receiver 0.
    pub(super) probe: usize,
    pub(super) logged: f64,
    pub(super) battery_v: Option<f64>,
    clean: f64,
    simulated: f64,
    noise: f64,
    /// Mean that the turbulence scales with.
    mean: f64,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct TrackRow {
    pub(super) t_s: f64,
    pub(super) place_m: Vector3<f64>,
    pub(super) velocity_mps: Vector3<f64>,
    /// Roll, pitch, yaw (rad).
    pub(super) attitude_rad: [f64; 3],
    pub(super) throttle: f64,
    pub(super) power_w: f64,
}

impl Scene {
    pub(super) fn end_s(&self) -> f64 {
        let routes = self.emitters.iter().map(|emitter| &emitter.route);
        let routes = routes.chain(self.receiver.iter().map(|receiver| &receiver.route));
        routes.map(Route::end_s).fold(0.0, f64::max)
    }

    /// How far drones and probes are along a horizontal unit vector, from the origin (m).
    pub(super) fn reaches_m(&self, normal: [f64; 2]) -> f64 {
        let routes = self.emitters.iter().map(|emitter| &emitter.route);
        let carriers = (self.probes.iter()).filter_map(|probe| probe.carried_by.as_ref());
        let receivers = self.receiver.iter().map(|receiver| &receiver.route);
        let flown = routes
            .chain(carriers)
            .chain(receivers)
            .map(|route| route.reaches_m(normal));
        let standing = self
            .probes
            .iter()
            .filter(|probe| probe.carried_by.is_none());
        let standing = standing.map(|it| normal[0] * it.place_m.x + normal[1] * it.place_m.y);
        flown.chain(standing).fold(f64::NEG_INFINITY, f64::max)
    }

    fn density(&self) -> f64 {
        density(self.pressure_pa, self.temperature_k)
    }

    /// The air as it is.
    fn true_world(&self, known: f64) -> World {
        let mut air = self.air.clone();
        air.strength *= known;
        air.radial |= self.declares_radial;
        air.convection = air.convection.or(self.declares_convection);
        if self.declares_momentum_sum && air.summing == Summing::default() {
            air.summing.exponent = 2.0;
        }
        let density = self.density() * self.density_factor;
        let mut world = World::new(self.emitters.clone(), air, self.floor_z_m, density);
        if self.begins_s.is_finite() {
            let mut air = self.declared_air();
            air.strength *= known;
            let before = World::new(self.emitters.clone(), air, self.floor_z_m, density);
            world.begins(self.begins_s, before);
        }
        world
    }

    fn declared_air(&self) -> Air {
        let mut air = Air {
            radial: self.declares_radial,
            convection: self.declares_convection,
            ..Air::default()
        };
        if self.declares_momentum_sum {
            air.summing.exponent = 2.0;
        }
        air
    }

    /// The air as the metadata declare it.
    fn declared_world(&self) -> World {
        let air = self.declared_air();
        let mut emitters = self.emitters.clone();
        for emitter in &mut emitters {
            emitter.load = crate::world::Load::default();
        }
        World::new(emitters, air, self.floor_z_m, self.density())
    }

    /// Flies it.
    pub(super) fn fly(&self, name: &str, family: String, random: &mut Draws) -> (Recording, Truth) {
        let known = 1.0 + KNOWN * random.normal().clamp(-2.5, 2.5);
        let (world, declared) = (self.true_world(known), self.declared_world());
        let mut rows = match &self.receiver {
            None => self.speeds(&world, &declared, random),
            Some(receiver) => self.throttles(receiver, &world, &declared, random),
        };
        rows.retain(|row| {
            !self
                .lost_s
                .iter()
                .any(|[from_s, to_s]| (*from_s..*to_s).contains(&row.t_s))
        });
        let chi2 = self.chi2_of_rows(&rows) + self.chi2_of_drones();
        let is_null = self.effects.is_empty();
        let differs = |row: &Row| (row.clean - row.simulated).abs() > 0.5 * row.noise;
        let region = (0..rows.len()).filter(|&i| !is_null && differs(&rows[i]));
        let truth = Truth {
            family,
            effects: self.effects.clone(),
            is_outside: self.is_outside,
            region: region.collect(),
            truth_clean: rows.iter().map(|row| row.clean).collect(),
            baseline_clean: rows.iter().map(|row| row.simulated).collect(),
            noise: rows.iter().map(|row| row.noise).collect(),
            oracle_chi2: chi2,
        };
        let recording = recorded::recording(self, name, &rows, random);
        (recording, truth)
    }

    fn speeds(&self, world: &World, declared: &World, random: &mut Draws) -> Vec<Row> {
        let end_s = self.end_s();
        let lags_s = self.faults.lag_s + self.instrument.lowpass_s;
        // A slow probe averages turbulence out.
        let passes = (self.noise.memory_s / (self.noise.memory_s + lags_s)).sqrt();
        let mut rows = Vec::new();
        for (index, probe) in self.probes.iter().enumerate() {
            let noise = Some((&self.noise, &mut *random));
            let Readings { t_s, clean, logged } = self.instrument_of(index).read(
                world,
                |t_s| probe.position_m(t_s),
                end_s,
                &self.faults,
                noise,
            );
            let sound = Faults::default();
            let simulated =
                self.instrument
                    .read(declared, |t_s| probe.position_m(t_s), end_s, &sound, None);
            for (i, &t_s) in t_s.iter().enumerate() {
                if !(probe.on_s[0]..probe.on_s[1]).contains(&t_s) {
                    continue;
                }
                let turbulent = self.noise.turbulence * clean[i] * passes;
                rows.push(Row {
                    t_s,
                    probe: index,
                    logged: logged[i],
                    battery_v: None,
                    clean: clean[i],
                    simulated: simulated.clean[i],
                    noise: turbulent.hypot(self.noise.white),
                    mean: clean[i] * passes,
                });
            }
        }
        rows.sort_by(|a, b| a.t_s.total_cmp(&b.t_s).then(a.probe.cmp(&b.probe)));
        rows
    }

    /// The instrument of a probe: all but the first have an error of their own.
    fn instrument_of(&self, probe: usize) -> Instrument {
        if probe == 0 {
            return self.instrument;
        }
        let mut random = Draws::new(
            self.instrument
                .own_gain
                .to_bits()
                .wrapping_add(probe as u64),
        );
        Instrument {
            own_gain: random.within(ACCURACY_REL),
            own_offset_mps: random.within(ACCURACY_ABS_MPS),
            ..self.instrument
        }
    }

    fn throttles(
        &self,
        receiver: &Receiver,
        world: &World,
        declared: &World,
        random: &mut Draws,
    ) -> Vec<Row> {
        let end_s = self.end_s();
        let hover_mps = receiver.drone.hover_mps(self.density());
        let mut gust = 0.0;
        let step_s = 1.0 / self.instrument.rate_hz;
        let kept = (-step_s / self.noise.memory_s).exp();
        let mut rows = Vec::new();
        for i in 0..((end_s - 1.0) * self.instrument.rate_hz) as usize {
            let t_s = 1.0 + i as f64 * step_s;
            let battery_v = receiver.full_v - receiver.sags_v * t_s / end_s;
            // What is read at `t` was there a little later or earlier.
            let throttle = |world: &World, answer: &Answer, at_s: f64| {
                let place_m = receiver.route.position_m(at_s);
                let down_mps = -world.velocity_mps(at_s, place_m).z;
                let met = ReceiverConditions {
                    alpha: down_mps / hover_mps,
                    above_floor_m: Some(place_m.z - self.floor_z_m),
                    below_ceiling_m: self.ceiling_z_m.map(|z_m| z_m - place_m.z),
                    battery: battery_v / receiver.full_v,
                };
                answer.throttle(&receiver.drone, &met)
            };
            let true_throttle = throttle(
                world,
                &receiver.answer,
                t_s + self.faults.ahead_s(t_s - 1.0),
            );
            let clean = self.faults.makes(true_throttle, t_s);
            let simulated = throttle(declared, &Answer::default(), t_s);
            gust = kept * gust + (1.0 - kept * kept).sqrt() * random.normal();
            // Turbulence comes with the wake: it scales with what the wake adds to the throttle.
            let mean = (clean - 1.0).abs();
            let turbulent = self.noise.turbulence * mean;
            let logged = clean + turbulent * gust + self.noise.white_draw(random);
            rows.push(Row {
                t_s,
                probe: 0,
                logged: (logged * 1e4).round() / 1e4,
                battery_v: Some((battery_v * 100.0 + random.normal()).round() / 100.0),
                clean,
                simulated,
                noise: turbulent.hypot(self.noise.white),
                mean,
            });
        }
        rows
    }

    fn chi2_of_rows(&self, rows: &[Row]) -> f64 {
        let accuracy = match self.receiver {
            // A throttle is a number of the autopilot: the rotors' calibration is what is not
            // known.
            Some(_) => [0.02, 0.01],
            None => [ACCURACY_REL, ACCURACY_ABS_MPS],
        };
        let chi2_of = |probe: usize| {
            let mine = rows.iter().filter(|row| row.probe == probe);
            let seen = mine.map(|row| Seen {
                t_s: row.t_s,
                difference: row.clean - row.simulated,
                simulated: row.simulated,
                mean: row.mean,
            });
            detectable(&seen.collect::<Vec<_>>(), &self.noise, accuracy)
        };
        (0..self.probes.len().max(1)).map(chi2_of).sum()
    }

    /// What the throttles and powers of the emitters tell.
    fn chi2_of_drones(&self) -> f64 {
        let rows = (self.end_s() * self.track_hz) as usize;
        let of_emitter = |emitter: &Emitter| {
            let squared = |i: usize| {
                let (throttle, power) = self.works(emitter.load.at(i as f64 / self.track_hz));
                (throttle - 1.0).powi(2) + (power - 1.0).powi(2)
            };
            (0..rows).map(squared).sum::<f64>() / (THROTTLE_NOISE * THROTTLE_NOISE)
        };
        self.emitters.iter().map(of_emitter).sum()
    }

    /// Throttle and power over those of hover at the stated mass and density.
    fn works(&self, load: f64) -> (f64, f64) {
        let throttle = (load / self.density_factor).sqrt();
        (throttle, throttle * load)
    }

    /// What the tracker and the autopilot log of an emitter.
    pub(super) fn track(&self, emitter: &Emitter, random: &mut Draws) -> Vec<TrackRow> {
        let drone = &emitter.drone;
        let hover_w = drone.mass_kg * GRAVITY * drone.hover_mps(self.density()) / FIGURE_OF_MERIT;
        let mut rows = self.route_rows(&emitter.route, random);
        for row in &mut rows {
            let (throttle, power) = self.works(emitter.load.at(row.t_s));
            row.throttle = rounded(throttle * (1.0 + THROTTLE_NOISE * random.normal()), 3);
            row.power_w = rounded(
                hover_w * power * (1.0 + THROTTLE_NOISE * random.normal()),
                1,
            );
        }
        rows
    }

    /// What the tracker logs of a route.
    pub(super) fn route_rows(&self, route: &Route, random: &mut Draws) -> Vec<TrackRow> {
        let rows = (self.end_s() * self.track_hz) as usize;
        let row = |i: usize| {
            let t_s = i as f64 / self.track_hz;
            let knot = route.knot(t_s);
            let mut captured = |value: f64| rounded(value + CAPTURE_NOISE_M * random.normal(), 4);
            let [roll, pitch] = knot.lean_rad;
            TrackRow {
                t_s,
                place_m: route.position_m(t_s).map(&mut captured),
                velocity_mps: route.velocity_mps(t_s).map(&mut captured),
                attitude_rad: [roll, pitch, knot.yaw_rad].map(|angle| rounded(angle, 4)),
                throttle: 1.0,
                power_w: 0.0,
            }
        };
        (0..=rows).map(row).collect()
    }
}

/// What the makers promise of the probes.
pub(super) const ACCURACY_REL: f64 = 0.05;
pub(super) const ACCURACY_ABS_MPS: f64 = 0.03;

fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    (value * scale).round() / scale
}
