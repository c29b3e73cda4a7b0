//! What of the effects a planner can fly through: all of each, a bound of it, nothing because it is
//! not of the air that limits count, or not yet.
//!
//! Limits count the vertical air over rotor discs and in zones, and in zones the wall jet along the
//! floor. An effect that only moves air sideways otherwise, or that changes how a drone answers,
//! leaves them as they are. What has no bound is refused: nothing is left out in silence.

use crate::airframe::Airframe;
use crate::convection::Convection;
use crate::effects::{
    ClimbDescent, Effects, GroundImpingement, Home, MOST_WIND, PayloadMass, Treatment, WakeLean,
};
use crate::superposition::Superposition;
use crate::wake::Wake;
use crate::wake::shape::Shape;

/// The effects as they are flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flown {
    /// What changes one drone's steady wake.
    steady: Effects,
    climb: Option<ClimbDescent>,
    /// How jets add up, where that was found; in place of what the scenario says.
    pub superposition: Option<Superposition>,
    /// Receiver gain: factor on the air that a receiver is exposed to; 1: momentum theory.
    pub receiver_gain: f64,
    /// Air that is there without any jet, in whatever direction (m/s).
    pub return_flow_mps: f64,
    /// How fast air is carried down, for every delay from none on; `None`: wakes are quasi-static.
    pub convection: Option<Convection>,
    /// The wall jet along the floor.
    pub wall: Option<GroundImpingement>,
    /// How far jets follow the tilt of their drones' thrust.
    pub lean: Option<WakeLean>,
    /// Sideways over down, that every wake is taken to lean by at most, in any direction.
    most_lean: f64,
}

impl Default for Flown {
    fn default() -> Flown {
        Flown {
            steady: Effects::default(),
            climb: None,
            superposition: None,
            receiver_gain: 1.0,
            return_flow_mps: 0.0,
            convection: None,
            wall: None,
            lean: None,
            most_lean: 0.0,
        }
    }
}

impl Flown {
    /// Effects made ready to be flown.
    ///
    /// # Errors
    /// Names of effects that cannot be, and why.
    pub fn of(effects: &Effects) -> Result<Flown, Vec<(&'static str, &'static str)>> {
        let refused: Vec<_> = effects
            .treatments()
            .into_iter()
            .filter_map(|(name, treatment)| match treatment {
                Treatment::Refused(why) => Some((name, why)),
                _ => None,
            })
            .collect();
        if !refused.is_empty() {
            return Err(refused);
        }
        // What was taken up in flight is carried from the beginning, what was dropped is carried
        // on.
        let constant = effects.payload_mass.and_then(|payload| {
            let heavier = payload.mass_factor > 1.0;
            (heavier || payload.is_constant()).then(|| PayloadMass::always(payload.mass_factor))
        });
        Ok(Flown {
            steady: Effects {
                payload_mass: constant,
                ..steady(effects)
            },
            climb: effects.climb_descent,
            superposition: effects.jet_merging.map(|merging| {
                if merging.exponent >= 2.0 {
                    Superposition::Momentum
                } else {
                    Superposition::Linear
                }
            }),
            receiver_gain: effects.receiver_alpha(1.0),
            return_flow_mps: effects.recirculation.map_or(0.0, |room| room.speed_mps),
            // A thousandth of the delay at the centreline's speed is none.
            convection: (effects.wake_transport)
                .and_then(|transport| transport.convection())
                .and_then(|factor| Convection::new([factor; 2]).ok()),
            wall: effects
                .ground_impingement
                .filter(|ground| ground.wall_jet > 0.0),
            lean: effects.wake_lean,
            most_lean: 0.0,
        })
    }

    /// What every drone weighs, over what is stated of it.
    #[must_use]
    pub fn mass_factor(&self) -> f64 {
        let payload = self.steady.payload_mass;
        payload.map_or(1.0, |payload| payload.mass_factor)
    }

    /// A plain wake with what changes it, hovering.
    #[must_use]
    pub fn wake(&self, plain: &Wake) -> Wake {
        let is_leaning = self.most_lean > 0.0;
        if self.steady == Effects::default() && self.climb.is_none() && !is_leaning {
            return plain.clone();
        }
        plain.with_effects(&self.steady).leaning(self.most_lean)
    }

    /// The wake of a drone (of [`Flown::wake`]) while it climbs at a speed (m/s, up positive).
    #[must_use]
    pub fn climbing(&self, wake: &Wake, climb_mps: f64) -> Wake {
        match self.climb {
            None => wake.clone(),
            Some(climb) => wake.with_gain(climb.factor(climb_mps / wake.induced_velocity_mps())),
        }
    }

    /// Air over a drone's discs as its limit counts it: the mean (m/s) and the return flow, as the
    /// receiver feels them, over its induced velocity (m/s).
    #[must_use]
    pub fn alpha(&self, mean_mps: f64, induced_velocity_mps: f64) -> f64 {
        (mean_mps + self.return_flow_mps) * self.receiver_gain / induced_velocity_mps
    }

    /// Induced velocity (m/s) by which a drone's exposure is measured, of what its mass asks for in
    /// air of the stated density; see [`Wake::hover_velocity_mps`].
    #[must_use]
    pub fn hover_velocity_mps(&self, stated_mps: f64) -> f64 {
        stated_mps * Shape::of_rotors(&self.steady)
    }

    /// Density of the air (kg/m³) where another is stated.
    #[must_use]
    pub fn density_kg_per_m3(&self, stated_kg_per_m3: f64) -> f64 {
        let found = self.steady.air_density;
        stated_kg_per_m3 * found.map_or(1.0, |it| it.density_factor)
    }

    /// The mean over the discs (m/s) at which [`Flown::alpha`] is so much.
    #[must_use]
    pub fn mean_mps(&self, alpha: f64, induced_velocity_mps: f64) -> f64 {
        alpha * (induced_velocity_mps / self.receiver_gain) - self.return_flow_mps
    }

    /// The same effects with air that is carried down at a range of factors, beside that of the
    /// effects themselves.
    #[must_use]
    pub fn with_convection(mut self, convection: Option<Convection>) -> Flown {
        self.convection = match (self.convection, convection) {
            (Some(own), Some(other)) => Some(own.hull(other)),
            (own, other) => own.or(other),
        };
        self
    }

    /// The same for drones that accelerate by at most so much (m/s²; infinite where nothing limits
    /// it): every wake is the bound of all that those may bring about. Without this wakes are as of
    /// drones that keep their velocity.
    #[must_use]
    pub fn accelerating(mut self, most_mps2: f64) -> Flown {
        self.most_lean = self.lean.map_or(0.0, |lean| lean.most(most_mps2));
        self
    }

    /// The longest that air of a wake (of [`Flown::wake`]) is under way down to a depth (s); 0
    /// where it takes no time.
    #[must_use]
    pub fn lag_s(&self, wake: &Wake, depth_m: f64) -> f64 {
        self.convection.map_or(0.0, |convection| {
            convection.longest_lag() * wake.far_field().transport_time_s(depth_m, 1.0)
        })
    }

    /// Whether wakes depend on how fast their drones climb.
    #[must_use]
    pub fn depends_on_climb(&self) -> bool {
        self.climb.is_some()
    }

    /// Why drones of this airframe cannot be flown with these effects, in air of this density
    /// (kg/m³): wakes that lean without bound, a wind too strong for the model of the bent jet.
    #[must_use]
    pub fn beyond(&self, airframe: &Airframe, density_kg_per_m3: f64) -> Option<String> {
        if self.most_lean.is_infinite() {
            return Some(
                "its finding holds `wake_lean`, and wakes lean without bound where a highest acceleration is not stated or is gravity's \
                 and more"
                    .to_owned(),
            );
        }
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

/// Those that change one drone's steady jet and the vertical air in it.
fn steady(effects: &Effects) -> Effects {
    let mut steady = Effects::default();
    for spec in effects.specs().filter(|spec| spec.home == Home::Jet) {
        if let (Some(values), Treatment::Exact | Treatment::Bounded(_)) =
            (spec.values(effects), (spec.treatment)(effects))
        {
            spec.set(&mut steady, &values);
        }
    }
    steady
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{
        Crossflow, JetMerging, MomentumScale, ProfileTail, ReceiverInflow, RotorCant, WakeTransport,
    };
    use crate::jet::Jet;
    use crate::surroundings::Surroundings;
    use nalgebra::Vector3;

    fn plain() -> Wake {
        let airframe = Airframe::preset("kolibri").expect("a preset");
        Wake::new(&airframe, airframe.mass_kg(), 1.204, &Jet::default())
    }

    #[test]
    fn nothing_found_leaves_a_wake_as_it_is() {
        let flown = Flown::of(&Effects::default()).expect("nothing to refuse");
        assert_eq!(flown, Flown::default());
        assert!(!flown.wake(&plain()).is_shaped());
        let receiver = Effects {
            receiver_inflow: Some(ReceiverInflow { factor: 0.8 }),
            ..Effects::default()
        };
        let flown = Flown::of(&receiver).expect("flown as a factor");
        assert!(!flown.wake(&plain()).is_shaped() && flown.receiver_gain == 0.8);
    }

    #[test]
    fn a_stronger_jet_does_not_raise_what_its_drone_bears() {
        let effects = Effects {
            momentum_scale: Some(MomentumScale { speed_factor: 1.3 }),
            ..Effects::default()
        };
        let wake = Flown::of(&effects).expect("flown").wake(&plain());
        let own_mps = plain().induced_velocity_mps();
        assert_eq!(wake.hover_velocity_mps(), own_mps);
        assert_eq!(wake.induced_velocity_mps(), 1.3 * own_mps);
        // A mass that was found raises it no more, and lowers it.
        for (mass_factor, expected) in [(1.5, 1.0), (0.6, 0.6_f64.sqrt())] {
            let effects = Effects {
                payload_mass: Some(PayloadMass::always(mass_factor)),
                ..Effects::default()
            };
            let flown = Flown::of(&effects).expect("flown");
            let wake = flown.wake(&plain());
            assert_eq!(wake.hover_velocity_mps(), expected * own_mps);
            assert_eq!(flown.hover_velocity_mps(own_mps), expected * own_mps);
        }
    }

    #[test]
    fn what_cannot_be_flown_is_refused_by_name() {
        let effects = Effects {
            jet_merging: Some(JetMerging { exponent: 0.8 }),
            ..Effects::default()
        };
        let refused = Flown::of(&effects).expect_err("one of them");
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
        let flown = Flown::of(&effects).expect("flown");
        let lag_s = |depth_m: f64| flown.lag_s(&flown.wake(&plain()), depth_m);
        assert!(lag_s(0.0) == 0.0 && lag_s(2.0) < lag_s(4.0));
        assert_eq!(Flown::default().lag_s(&plain(), 4.0), 0.0);
    }

    #[test]
    fn no_wake_that_leans_within_the_limit_is_faster_than_the_bound() {
        let tail = ProfileTail {
            share: 1.4,
            steepness: 3.0,
        };
        let lean = WakeLean { share: 0.7 };
        for (tail, cant) in [
            (None, None),
            (Some(tail), Some(RotorCant { width_factor: 1.2 })),
        ] {
            let effects = Effects {
                profile_tail: tail,
                rotor_cant: cant,
                wake_lean: Some(lean),
                ..Effects::default()
            };
            let flown = Flown::of(&effects).expect("flown").accelerating(4.0);
            let (bound, own) = (flown.wake(&plain()), plain().with_effects(&effects));
            let most = WakeLean { share: 1.0 }.most(4.0);
            // An even cover: multiples of roots that have no common measure.
            let pick = |k: u32, of: f64| (f64::from(k) * of.sqrt()).fract();
            let mut nearest = 0.0_f64;
            for k in 0..40_000 {
                let depth_m = 4.0 * pick(k, 2.0) * pick(k, 2.0);
                let beside = |of| (2.0 * pick(k, of) - 1.0) * (0.5 + depth_m);
                let offset_m = Vector3::new(beside(3.0), beside(5.0), -depth_m);
                let (sin, cos) = (std::f64::consts::TAU * pick(k, 7.0)).sin_cos();
                let at = Surroundings {
                    t_s: 0.0,
                    lean: [most * pick(k, 11.0) * cos, most * pick(k, 11.0) * sin],
                    climb_mps: 0.0,
                    floor_z_m: None,
                    emitter_z_m: 9.0,
                };
                let speed_mps = -at.velocity_mps(&effects, &own, offset_m).z;
                let bound_mps = bound.axial_speed_mps(offset_m);
                // A hundredth of the peak between two radii looked at.
                let over_mps = speed_mps - bound_mps;
                assert!(
                    over_mps <= 0.01 * own.induced_velocity_mps(),
                    "{offset_m} {at:?}"
                );
                nearest = nearest.max(speed_mps / bound_mps.max(0.1));
            }
            assert!(nearest > 0.9, "the bound is never reached: {nearest}");
        }
    }

    #[test]
    fn what_nothing_limits_cannot_be_flown_where_wakes_lean() {
        let effects = Effects {
            wake_lean: Some(WakeLean { share: 1.0 }),
            ..Effects::default()
        };
        let airframe = Airframe::preset("kolibri").expect("a preset");
        let flown = |most_mps2| {
            let flown = Flown::of(&effects).expect("flown").accelerating(most_mps2);
            flown.beyond(&airframe, 1.204)
        };
        assert!(flown(4.0).is_none() && flown(9.81).is_some() && flown(f64::INFINITY).is_some());
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
            Flown::of(&effects).expect("flown").beyond(&airframe, 1.204)
        };
        // 0.4 of 7.41 m/s is 2.96 m/s.
        assert!(wind(2.9).is_none() && wind(3.0).is_some());
    }
}
