//! What of the effects a planner can fly through: all of each, a bound of it, nothing because it is not of the air that limits count,
//! or not yet.
//!
//! Limits count the vertical air over rotor discs and in zones, and in zones the wall jet along the floor. An effect that only
//! moves air sideways otherwise, or that changes how a drone answers, leaves them as they are. What has no bound is refused: nothing is
//! left out in silence.

use super::{ClimbDescent, Effects, GroundImpingement, PayloadMass};
use crate::airframe::Airframe;
use crate::field::Superposition;
use crate::shape::Shape;
use crate::wake::Wake;

/// What becomes of an effect when it is flown through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// Flown as it was found.
    Flown,
    /// Flown as more air than was found; how.
    Bounded(&'static str),
    /// It does not move the air that limits count; why.
    Unmoved(&'static str),
    /// It cannot be flown; why.
    Refused(&'static str),
}

/// Largest wind over induced velocity that the bent jet holds for ([`super::Crossflow`]).
const MOST_WIND: f64 = 0.4;

/// The effects as they are flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flown {
    /// What changes one drone's steady wake.
    steady: Effects,
    climb: Option<ClimbDescent>,
    /// How jets add up, where that was found; in place of what the scenario says.
    pub superposition: Option<Superposition>,
    /// Part of the air that a receiver feels; 1: all.
    pub felt: f64,
    /// Air that is there without any jet, in whatever direction (m/s).
    pub draught_mps: f64,
    /// Speed of the air that carries wakes down over that of the centreline, where it takes its time.
    pub convection: Option<f64>,
    /// The wall jet along the floor.
    pub wall: Option<GroundImpingement>,
}

impl Default for Flown {
    fn default() -> Flown {
        Flown {
            steady: Effects::default(),
            climb: None,
            superposition: None,
            felt: 1.0,
            draught_mps: 0.0,
            convection: None,
            wall: None,
        }
    }
}

impl Effects {
    /// What becomes of each effect that is there, in the order of [`Effects`].
    #[must_use]
    pub fn fates(&self) -> Vec<(&'static str, Fate)> {
        use Fate::{Bounded, Flown, Refused, Unmoved};
        let payload = match self.payload_mass {
            Some(payload) if payload.is_constant() => Flown,
            Some(payload) if payload.mass_factor > 1.0 => {
                Bounded("the drones are taken as heavier from the beginning")
            }
            _ => Bounded("the drones are taken as heavy as before it was dropped"),
        };
        let merging = match self.jet_merging.map_or(2.0, |merging| merging.exponent) {
            q if q == 1.0 || q == 2.0 => Flown,
            q if q > 2.0 => Bounded("jets add up by momentum, which is more"),
            q if q > 1.0 => Bounded("jets add up linearly, which is more"),
            _ => Refused("jets that add up to more than their sum have no bound here"),
        };
        let sideways = "it moves air sideways only, and limits count vertical air";
        let own = "it is of a drone's own frame and speed, not the air of others";
        let thrust = "it changes the thrust of a drone, not the air that it meets";
        let all = [
            ("crossflow", self.crossflow.is_some(), Flown),
            ("wake_tilt", self.wake_tilt.is_some(), Flown),
            ("rotor_cant", self.rotor_cant.is_some(), Flown),
            ("wander", self.wander.is_some(), Flown),
            ("profile_tail", self.profile_tail.is_some(), Flown),
            ("momentum_scale", self.momentum_scale.is_some(), Flown),
            ("payload_mass", self.payload_mass.is_some(), payload),
            ("air_density", self.air_density.is_some(), Flown),
            ("dl_ratio", self.dl_ratio.is_some(), Flown),
            ("near_field", self.near_field.is_some(), Flown),
            ("buoyancy", self.buoyancy.is_some(), Flown),
            ("swirl", self.swirl.is_some(), Unmoved(sideways)),
            (
                "entrainment_radial",
                self.entrainment_radial.is_some(),
                Unmoved(sideways),
            ),
            ("jet_merging", self.jet_merging.is_some(), merging),
            (
                "wake_transport",
                self.wake_transport.is_some(),
                Bounded(
                    "while the plan is sought every wake stays below wherever its drone has been for as long as its air needs; the check \
                     takes it from where the air left its drone",
                ),
            ),
            (
                "climb_descent",
                self.climb_descent.is_some(),
                Bounded(
                    "while the plan is sought every wake is taken as of a drone that sinks at full speed; the check takes each as it is",
                ),
            ),
            (
                "ground_impingement",
                self.ground_impingement.is_some(),
                Bounded(
                    "wakes keep their speed down to the floor; the wall jet along it counts in zones, and not for drones, whose limits \
                     count vertical air",
                ),
            ),
            (
                "recirculation",
                self.recirculation.is_some(),
                Bounded("every limit is lower by the draught at its strongest"),
            ),
            (
                "ground_effect_thrust",
                self.ground_effect_thrust.is_some(),
                Unmoved(thrust),
            ),
            (
                "ceiling_effect",
                self.ceiling_effect.is_some(),
                Unmoved(thrust),
            ),
            ("receiver_inflow", self.receiver_inflow.is_some(), Flown),
            (
                "battery_sag",
                self.battery_sag.is_some(),
                Unmoved("it changes the throttle of a drone, not the air that it meets"),
            ),
            ("own_motion", self.own_motion.is_some(), Unmoved(own)),
            ("body_drag", self.body_drag.is_some(), Unmoved(own)),
        ];
        all.into_iter()
            .filter(|(_, there, _)| *there)
            .map(|(name, _, fate)| (name, fate))
            .collect()
    }

    /// The effects made ready to be flown.
    ///
    /// # Errors
    /// Names of effects that cannot be, and why.
    pub fn flown(&self) -> Result<Flown, Vec<(&'static str, &'static str)>> {
        let refused: Vec<_> = self
            .fates()
            .into_iter()
            .filter_map(|(name, fate)| match fate {
                Fate::Refused(why) => Some((name, why)),
                _ => None,
            })
            .collect();
        if !refused.is_empty() {
            return Err(refused);
        }
        let payload_mass = self.payload_mass.and_then(|payload| {
            let heavier = payload.mass_factor > 1.0;
            (heavier || payload.is_constant()).then(|| PayloadMass::always(payload.mass_factor))
        });
        Ok(Flown {
            steady: Effects {
                crossflow: self.crossflow,
                wake_tilt: self.wake_tilt,
                rotor_cant: self.rotor_cant,
                wander: self.wander,
                profile_tail: self.profile_tail,
                momentum_scale: self.momentum_scale,
                payload_mass,
                air_density: self.air_density,
                dl_ratio: self.dl_ratio,
                near_field: self.near_field,
                buoyancy: self.buoyancy,
                ..Effects::default()
            },
            climb: self.climb_descent,
            superposition: self.jet_merging.map(|merging| {
                if merging.exponent >= 2.0 {
                    Superposition::Momentum
                } else {
                    Superposition::Linear
                }
            }),
            felt: self.felt(1.0),
            draught_mps: self.recirculation.map_or(0.0, |room| room.speed_mps),
            convection: (self.wake_transport).and_then(|transport| transport.convection()),
            wall: self
                .ground_impingement
                .filter(|ground| ground.wall_jet > 0.0),
        })
    }
}

impl Flown {
    /// A plain wake with what changes it, hovering.
    #[must_use]
    pub fn wake(&self, plain: &Wake) -> Wake {
        if self.steady == Effects::default() && self.climb.is_none() {
            return plain.clone();
        }
        plain.with_effects(&self.steady)
    }

    /// The wake of a drone (of [`Flown::wake`]) while it climbs at a speed (m/s, up positive).
    #[must_use]
    pub fn climbing(&self, wake: &Wake, climb_mps: f64) -> Wake {
        match self.climb {
            None => wake.clone(),
            Some(climb) => wake.with_gain(climb.factor(climb_mps / wake.induced_velocity_mps())),
        }
    }

    /// How long the air of a wake (of [`Flown::wake`]) is under way down to a depth (s); 0 where it takes no time.
    #[must_use]
    pub fn lag_s(&self, wake: &Wake, depth_m: f64) -> f64 {
        self.convection.map_or(0.0, |convection| {
            wake.far_field().transport_time_s(depth_m, convection)
        })
    }

    /// Whether wakes depend on how fast their drones climb.
    #[must_use]
    pub fn depends_on_climb(&self) -> bool {
        self.climb.is_some()
    }

    /// Why drones of this airframe cannot be flown with these effects, in air of this density (kg/m³): a wind too strong for the model of
    /// the bent jet.
    #[must_use]
    pub fn beyond(&self, airframe: &Airframe, density_kg_per_m3: f64) -> Option<String> {
        let [x, y] = self.steady.crossflow?.wind_mps;
        let wind_mps = x.hypot(y);
        let plain_mps = airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3);
        let diameter_over_l = airframe.propeller_diameter_m() / airframe.motor_distance_m();
        let most_mps = MOST_WIND * plain_mps * Shape::strength(&self.steady, diameter_over_l);
        (wind_mps > most_mps).then(|| {
            format!(
                "a wind of {wind_mps:.2} m/s is too strong for the jet of `{}`, whose bend is known to {most_mps:.2} m/s: {MOST_WIND} of \
                 its induced velocity",
                airframe.name()
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Crossflow, JetMerging, MomentumScale, ReceiverInflow, WakeTransport};
    use super::*;
    use crate::jet::Jet;

    fn plain() -> Wake {
        let airframe = Airframe::preset("kolibri").expect("a preset");
        Wake::new(&airframe, airframe.mass_kg(), 1.204, &Jet::default())
    }

    #[test]
    fn nothing_found_leaves_a_wake_as_it_is() {
        let flown = Effects::default().flown().expect("nothing to refuse");
        assert_eq!(flown, Flown::default());
        assert!(!flown.wake(&plain()).is_shaped());
        let receiver = Effects {
            receiver_inflow: Some(ReceiverInflow { factor: 0.8 }),
            ..Effects::default()
        };
        let flown = receiver.flown().expect("flown as a factor");
        assert!(!flown.wake(&plain()).is_shaped() && flown.felt == 0.8);
    }

    #[test]
    fn a_stronger_jet_does_not_raise_what_its_drone_bears() {
        let effects = Effects {
            momentum_scale: Some(MomentumScale { speed_factor: 1.3 }),
            ..Effects::default()
        };
        let wake = effects.flown().expect("flown").wake(&plain());
        let own_mps = plain().induced_velocity_mps();
        assert_eq!(wake.hover_velocity_mps(), own_mps);
        assert_eq!(wake.induced_velocity_mps(), 1.3 * own_mps);
    }

    #[test]
    fn what_cannot_be_flown_is_refused_by_name() {
        let effects = Effects {
            jet_merging: Some(JetMerging { exponent: 0.8 }),
            ..Effects::default()
        };
        let refused = effects.flown().expect_err("one of them");
        assert_eq!(
            refused.iter().map(|(name, _)| *name).collect::<Vec<_>>(),
            ["jet_merging"]
        );
    }

    #[test]
    fn air_that_takes_its_time_takes_longer_the_deeper_it_is() {
        let effects = Effects {
            wake_transport: Some(WakeTransport { lag_factor: 1.5 }),
            ..Effects::default()
        };
        let flown = effects.flown().expect("flown");
        let lag_s = |depth_m: f64| flown.lag_s(&flown.wake(&plain()), depth_m);
        assert!(lag_s(0.0) == 0.0 && lag_s(2.0) < lag_s(4.0));
        assert_eq!(Flown::default().lag_s(&plain(), 4.0), 0.0);
    }

    #[test]
    fn a_wind_beyond_the_model_is_told_from_one_within() {
        let airframe = Airframe::preset("kolibri").expect("a preset");
        let wind = |wind_mps: f64| {
            let effects = Effects {
                crossflow: Some(Crossflow {
                    wind_mps: [wind_mps, 0.0],
                }),
                ..Effects::default()
            };
            effects.flown().expect("flown").beyond(&airframe, 1.204)
        };
        // 0.4 of 7.41 m/s is 2.96 m/s.
        assert!(wind(2.9).is_none() && wind(3.0).is_some());
    }
}
