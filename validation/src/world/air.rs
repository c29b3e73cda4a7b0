//! All the air of the synthetic world: jets, what bends and stops them, and what else moves.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::bent::Bent;
use super::carried::Carried;
use super::draughts::{Flap, Panel, Room, Shelf, Vent, Wall};
use super::floor;
use super::jet::{Across, Cut, Drone, SPREADING};
use super::lobes::Lobes;
use super::route::Route;

/// A drone with its wake.
#[derive(Clone, Debug)]
pub(crate) struct Emitter {
    pub(crate) drone: Drone,
    pub(crate) route: Route,
    pub(crate) load: Load,
}

/// Mass over the stated one, during a part of the flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Load {
    pub(crate) factor: f64,
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
}

impl Default for Load {
    fn default() -> Load {
        Load {
            factor: 1.0,
            from_s: f64::NEG_INFINITY,
            to_s: f64::INFINITY,
        }
    }
}

impl Load {
    pub(crate) fn at(&self, t_s: f64) -> f64 {
        if (self.from_s..self.to_s).contains(&t_s) {
            self.factor
        } else {
            1.0
        }
    }
}

/// What the air does beyond hover jets in still air; the default does nothing.
#[derive(Clone, Debug)]
pub(crate) struct Air {
    /// Horizontal wind (m/s).
    pub(crate) wind_mps: Option<[f64; 2]>,
    /// Buoyancy frequency (1/s) of layered air.
    pub(crate) stability: f64,
    /// Speed of a parcel over that on the axis; `None`: jets hang on their drones.
    pub(crate) convection: Option<f64>,
    /// How far a jet leaves along the drone's own axis: 0 straight down, 1 all the way.
    pub(crate) leans: f64,
    /// Whether climbing weakens a jet.
    pub(crate) climbs: bool,
    /// Whether jets stop at the floor.
    pub(crate) floor: bool,
    pub(crate) across: Across,
    /// Factor on every jet's speed.
    pub(crate) strength: f64,
    /// Power of propeller diameter over motor distance that a jet's speed goes with besides.
    pub(crate) size_exponent: f64,
    /// Part of the speed that the body takes away between four lobes; `None`: one jet from the
    /// rotor plane on.
    pub(crate) lobes: Option<f64>,
    pub(crate) summing: Summing,
    /// Whether the air that jets draw in counts.
    pub(crate) radial: bool,
    pub(crate) room: Option<Room>,
    pub(crate) vent: Option<Vent>,
    pub(crate) panel: Option<Panel>,
    pub(crate) flap: Option<Flap>,
    /// Things that stand in the room.
    pub(crate) shelf: Option<Shelf>,
    pub(crate) wall: Option<Wall>,
}

impl Default for Air {
    fn default() -> Air {
        Air {
            wind_mps: None,
            stability: 0.0,
            convection: None,
            leans: 0.0,
            climbs: false,
            floor: false,
            across: Across::default(),
            strength: 1.0,
            size_exponent: 0.0,
            lobes: None,
            summing: Summing::default(),
            radial: false,
            room: None,
            vent: None,
            panel: None,
            flap: None,
            shelf: None,
            wall: None,
        }
    }
}

/// How several jets are one air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Summing {
    /// `(Σ Uᵠ)^(1/q)`.
    pub(crate) exponent: f64,
    /// Part of the entrainment of one jet that draws the other towards it.
    pub(crate) attraction: f64,
}

impl Default for Summing {
    fn default() -> Summing {
        Summing {
            exponent: 1.0,
            attraction: 0.0,
        }
    }
}

/// Jets and surroundings, ready to be asked.
#[derive(Clone, Debug)]
pub(crate) struct World {
    pub(crate) emitters: Vec<Emitter>,
    pub(crate) air: Air,
    pub(crate) floor_z_m: f64,
    prepared: Vec<Prepared>,
    /// Until when (s) the air was another.
    before: Option<(f64, Box<World>)>,
}

/// Tables of one emitter.
#[derive(Clone, Debug)]
struct Prepared {
    hover_mps: f64,
    bent: Option<Bent>,
    carried: Option<Carried>,
    lobes: Option<Lobes>,
    /// How long air takes: for pulsation.
    age: Option<Carried>,
}

/// What one jet gives to a point: downwards, and aside.
struct Share {
    down_mps: f64,
    aside_mps: Vector3<f64>,
}

impl World {
    pub(crate) fn new(emitters: Vec<Emitter>, air: Air, floor_z_m: f64, density: f64) -> World {
        let prepare = |emitter: &Emitter| {
            let drone = &emitter.drone;
            let hover_mps = drone.hover_mps(density);
            let is_bent = air.wind_mps.is_some() || air.stability > 0.0;
            let wind_mps = air.wind_mps.unwrap_or_default();
            Prepared {
                hover_mps,
                bent: is_bent.then(|| Bent::new(drone, hover_mps, wind_mps, air.stability)),
                carried: air
                    .convection
                    .map(|part| Carried::new(drone, hover_mps, part)),
                lobes: air.lobes.map(|core| Lobes::new(drone, core)),
                age: air.flap.map(|_| Carried::new(drone, hover_mps, 0.7)),
            }
        };
        World {
            prepared: emitters.iter().map(prepare).collect(),
            emitters,
            air,
            floor_z_m,
            before: None,
        }
    }

    /// Until a time (s) the air is another.
    pub(crate) fn begins(&mut self, from_s: f64, before: World) {
        self.before = Some((from_s, Box::new(before)));
    }

    /// Velocity of the air (m/s, z up).
    pub(crate) fn velocity_mps(&self, t_s: f64, point_m: Vector3<f64>) -> Vector3<f64> {
        if let Some((from_s, before)) = &self.before
            && t_s < *from_s
        {
            return before.velocity_mps(t_s, point_m);
        }
        let mut aside_mps = Vector3::zeros();
        let mut powers = 0.0;
        let exponent = self.air.summing.exponent;
        for emitter in 0..self.emitters.len() {
            if let Some(share) = self.share(emitter, t_s, point_m) {
                powers += share.down_mps.max(0.0).powf(exponent);
                aside_mps += share.aside_mps;
            }
            // What a wall keeps from spreading comes back as the wake of a mirror image.
            let image = self.air.wall.map(|wall| wall.mirrored(point_m));
            if let Some(share) = image.and_then(|point_m| self.share(emitter, t_s, point_m)) {
                powers += share.down_mps.max(0.0).powf(exponent);
            }
        }
        let down_mps = powers.powf(1.0 / exponent);
        let mut velocity_mps = aside_mps - down_mps * Vector3::z();
        if let Some([x, y]) = self.air.wind_mps {
            velocity_mps += Vector3::new(x, y, 0.0);
        }
        if let Some(room) = self.air.room {
            velocity_mps += room.velocity_mps(t_s);
        }
        if let Some(vent) = self.air.vent {
            velocity_mps += vent.velocity_mps(point_m) * vent.is_on(t_s);
        }
        velocity_mps
    }

    fn share(&self, index: usize, t_s: f64, point_m: Vector3<f64>) -> Option<Share> {
        let (emitter, prepared, air) = (&self.emitters[index], &self.prepared[index], &self.air);
        let drone = &emitter.drone;
        let mut centre_m = emitter.route.position_m(t_s);
        let mut left_s = t_s;
        if let Some(carried) = &prepared.carried {
            let (axis_m, sunk_m, at_s) = carried.crossing(&emitter.route, t_s, point_m.z)?;
            centre_m = Vector3::new(axis_m.x, axis_m.y, point_m.z + sunk_m);
            left_s = at_s;
        }
        let mut from_m = point_m - centre_m;
        if from_m.z >= 0.0 || point_m.z < self.floor_z_m {
            return None;
        }
        from_m -= self.drawn_aside(index, t_s, centre_m, -from_m.z);
        let knot = emitter.route.knot(left_s);
        let cut = self.cut(index, from_m, left_s, knot.yaw_rad, knot.lean_rad)?;
        let mut speed_mps = air.across.speed_mps(&cut);
        if let Some(lobes) = &prepared.lobes {
            let (sin, cos) = knot.yaw_rad.sin_cos();
            let off_m = cut.off_m;
            let in_body_m = [
                cos * off_m.x + sin * off_m.y,
                cos * off_m.y - sin * off_m.x,
                cut.s_m,
            ];
            let hover_mps = cut.centre_mps / drone.centre(cut.s_m);
            speed_mps = lobes.speed_mps(drone, hover_mps, in_body_m, speed_mps);
        }
        if let (Some(flap), Some(age)) = (air.flap, &prepared.age) {
            speed_mps *= 1.0 + flap.part * (TAU * flap.hz * (t_s - age.age_s(cut.s_m))).sin();
        }
        if let Some(panel) = air.panel {
            speed_mps *= panel.lets_through(centre_m - point_m, drone.motors_m);
        }
        if let Some(shelf) = air.shelf {
            speed_mps *= shelf.lets_through(centre_m, point_m);
        }
        let mut aside_mps = Vector3::zeros();
        let outwards = cut.off_m.try_normalize(1e-9).unwrap_or_else(Vector3::x);
        if air.floor {
            let drop_m = centre_m.z - self.floor_z_m;
            let height_m = point_m.z - self.floor_z_m;
            let hover_mps = cut.centre_mps / drone.centre(cut.s_m);
            let (share, along_floor_mps) =
                floor::turned(drone, hover_mps, drop_m, height_m, cut.off_m.norm());
            speed_mps *= share;
            aside_mps += along_floor_mps * outwards;
        }
        if air.across.swirl != 0.0 {
            aside_mps += air.across.around_mps(&cut, drone) * cut.along.cross(&outwards);
        }
        if air.radial {
            aside_mps += air.across.outwards_mps(&cut, drone) * outwards;
        }
        let jet_mps = speed_mps * cut.along + aside_mps;
        Some(Share {
            down_mps: -jet_mps.z,
            aside_mps: Vector3::new(jet_mps.x, jet_mps.y, 0.0),
        })
    }

    /// The cut through a jet on which a point lies, from the rotor plane's centre.
    fn cut(
        &self,
        index: usize,
        from_m: Vector3<f64>,
        left_s: f64,
        yaw_rad: f64,
        lean_rad: [f64; 2],
    ) -> Option<Cut> {
        let (emitter, prepared) = (&self.emitters[index], &self.prepared[index]);
        let drone = &emitter.drone;
        let mut hover_mps = prepared.hover_mps * emitter.load.at(left_s).sqrt() * self.air.strength;
        // The paper's drones lie around a ratio of 0.53.
        hover_mps *= (drone.propeller_m / drone.motors_m / 0.53).powf(self.air.size_exponent);
        if self.air.climbs {
            hover_mps *= climbing(emitter.route.velocity_mps(left_s).z / prepared.hover_mps);
        }
        if let Some(bent) = &prepared.bent {
            let beside = bent.beside(from_m);
            return (beside.s_m > 0.0).then(|| Cut {
                s_m: beside.s_m,
                centre_mps: hover_mps * drone.centre(beside.s_m) * beside.speed,
                half_m: drone.half_m(beside.s_m) * beside.radius,
                off_m: beside.off_m,
                along: beside.along,
                yaw_rad,
            });
        }
        let [roll, pitch] = lean_rad;
        let up = nalgebra::Rotation3::from_euler_angles(roll, pitch, yaw_rad) * Vector3::z();
        let aside = self.air.leans / up.z;
        let along = -Vector3::new(aside * up.x, aside * up.y, 1.0).normalize();
        let s_m = from_m.dot(&along);
        (s_m > 0.0).then(|| Cut {
            s_m,
            centre_mps: hover_mps * drone.centre(s_m),
            half_m: drone.half_m(s_m),
            off_m: from_m - s_m * along,
            along,
            yaw_rad,
        })
    }

    /// How far other jets and a vent have drawn an axis aside at a depth (m).
    fn drawn_aside(
        &self,
        index: usize,
        t_s: f64,
        centre_m: Vector3<f64>,
        depth_m: f64,
    ) -> Vector3<f64> {
        let drone = &self.emitters[index].drone;
        let mut aside_m = Vector3::zeros();
        if self.air.summing.attraction > 0.0 {
            for (other, emitter) in self.emitters.iter().enumerate() {
                let mut towards_m = emitter.route.position_m(t_s) - centre_m;
                towards_m.z = 0.0;
                let apart_m = towards_m.norm();
                if other == index || !(1e-3..4.0).contains(&apart_m) {
                    continue;
                }
                // Sink flow of the other, (dQ/ds)/(2π D), against the fall at the centre speed:
                // summed over the depth.
                let (start, end) = (drone.past_origin(0.0), drone.past_origin(depth_m));
                let sum = 0.5 * (end * end - start * start) * drone.motors_m * drone.motors_m;
                let drawn_m = self.air.summing.attraction * SPREADING * SPREADING * sum
                    / (2.0 * (2f64.sqrt() - 1.0) * apart_m);
                aside_m += towards_m / apart_m * drawn_m.min(0.5 * apart_m);
            }
        }
        if let Some(vent) = self.air.vent {
            let steps = 20;
            let step_m = depth_m / f64::from(steps);
            for step in 0..steps {
                let at_m = (f64::from(step) + 0.5) * step_m;
                let along_m = centre_m + aside_m - Vector3::z() * at_m;
                let wind_mps = vent.velocity_mps(along_m) * vent.is_on(t_s);
                // Momentum of the air taken in so far over that of the jet: 2.3 between a
                // Gaussian's 2 and the paper's 3.
                let taken = 2.3 * at_m / (10.11 * drone.motors_m * self.prepared[index].hover_mps);
                aside_m += wind_mps * (taken * step_m);
            }
        }
        aside_m
    }
}

/// Induced speed over that of hover when climbing at a speed over that of hover: `(V + v) v = 1`,
/// by Newton's route.
fn climbing(climb: f64) -> f64 {
    let mut induced = 1.0;
    for _ in 0..6 {
        induced -= ((climb + induced) * induced - 1.0) / (climb + 2.0 * induced).max(0.2);
    }
    induced
}
