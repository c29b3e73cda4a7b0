//! Feed-forward: what a drone adds to its throttle for the air that it is in, before its altitude
//! shows it.
//!
//! The paper's rule is a factor `β` on the power, `√β` on the throttle where power goes with
//! throttle squared, for the air at the drone's centre in quasi-static wakes. Better is the mean
//! over the rotor discs of advected wakes. [`FleetAir`] holds a fleet's recent past and answers for
//! any of its drones:
//!
//! ```
//! use airflow::{Airframe, Jet, Wake};
//! use flight::feed_forward::{FleetAir, FleetDrone};
//! use nalgebra::Point3;
//!
//! let drone = |name: &str| {
//!     let airframe = Airframe::preset(name).expect("a preset");
//!     let wake = Wake::new(&airframe, airframe.mass_kg(), 1.204, &Jet::default());
//!     FleetDrone { wake, discs: airframe.disc_points() }
//! };
//! let fleet = vec![drone("offboard-2"), drone("kolibri")];
//! // Air at the centreline's speed, a moment every 20 ms, over a floor at 0.
//! let mut air = FleetAir::new(fleet, (1.0, 0.02), (0.0, 8.0)).expect("in range");
//! for step in 0..100 {
//!     // A drone crosses 2 m/s fast above one that hovers: places (m) and thrusts over weight.
//!     let x_m = -2.0 + 0.04 * f64::from(step);
//!     air.record(&[(Point3::new(x_m, 0.0, 5.0), 1.0), (Point3::new(0.0, 0.0, 3.0), 1.0)]);
//! }
//! let factors = air.factors(1, Point3::new(0.0, 0.0, 3.0));
//! assert!(factors.power > 1.0 && factors.throttle > 1.0 && factors.throttle < factors.power);
//! ```

use std::ops::RangeInclusive;

use airflow::{CONVECTION_FACTORS, DiscPoints, Superposition, Wake, power};
use nalgebra::Point3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fleet::FlyError;
use crate::wakes::{Emitter, EmitterMoment, Receiver};

/// Power goes with the third power of the rotors' speed, so a factor on power is its cube root on
/// the speed.
const SPEED_EXPONENT: f64 = 1.0 / 3.0;

/// Between two records of places (s): chosen here, what a flight stack may do.
const STEPS_S: RangeInclusive<f64> = 0.001..=1.0;

/// What a drone knows of the air it is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FeedForward {
    /// Nothing.
    None,
    /// The paper's: the value at its centre, of quasi-static wakes.
    Paper,
    /// The mean over its rotor discs, of advected wakes.
    Late,
    /// The same, with the speed that holds the thrust of its own rotors ([`Rotor`]) in place of
    /// `∛β`: what a stack can do that has identified them.
    ///
    /// [`Rotor`]: crate::rotor::Rotor
    Matched,
}

impl FeedForward {
    /// As files and the command line have it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            FeedForward::None => "none",
            FeedForward::Paper => "paper",
            FeedForward::Late => "late",
            FeedForward::Matched => "matched",
        }
    }
}

/// Factors for one drone at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors {
    /// Air from above over its own induced velocity.
    pub alpha: f64,
    /// On its power: `β`.
    pub power: f64,
    /// On its throttle, where power goes with throttle squared: `√β`.
    pub throttle: f64,
    /// On its rotors' speed: `∛β`.
    pub rotor_speed: f64,
}

impl Factors {
    /// For air from above (m/s), and the drone's induced velocity at its mass (m/s).
    #[must_use]
    pub fn of(air_mps: f64, induced_mps: f64) -> Factors {
        let alpha = air_mps / induced_mps;
        let power = power::beta(alpha);
        Factors {
            alpha,
            power,
            throttle: power.powf(power::THROTTLE_EXPONENT),
            rotor_speed: power.powf(SPEED_EXPONENT),
        }
    }
}

/// One drone of a fleet: its wake at its mass, and points over its rotor discs.
#[derive(Clone, Debug)]
pub struct FleetDrone {
    /// Its air.
    pub wake: Wake,
    /// See [`airflow::Airframe::disc_points`].
    pub discs: DiscPoints,
}

/// The air of a fleet: where its drones were, as long as their air is under way.
#[derive(Clone, Debug)]
pub struct FleetAir {
    emitters: Vec<Emitter>,
    receivers: Vec<Receiver>,
    floor_z_m: f64,
}

impl FleetAir {
    /// A fleet's; air at `convection` times the centreline's speed, places recorded `step_s` apart
    /// (s), between a floor and the highest place (m, world).
    ///
    /// # Errors
    /// A `convection` beyond [`CONVECTION_FACTORS`], a `step_s` that is not within a millisecond to
    /// a second, or heights that are not finite.
    pub fn new(
        fleet: Vec<FleetDrone>,
        (convection, step_s): (f64, f64),
        (floor_z_m, highest_z_m): (f64, f64),
    ) -> Result<FleetAir, FlyError> {
        let [low, high] = CONVECTION_FACTORS;
        let ranges = [
            ("convection", convection, low..=high),
            ("step_s", step_s, STEPS_S),
            ("floor_z_m", floor_z_m, f64::MIN..=f64::MAX),
            ("highest_z_m", highest_z_m, f64::MIN..=f64::MAX),
        ];
        let wrong = ranges.iter().filter(|(_, value, of)| !of.contains(value));
        let told = wrong.map(|(what, value, of)| format!("{what} is {value}: not within {of:?}"));
        let told: Vec<String> = told.collect();
        if !told.is_empty() {
            return Err(FlyError::Options(told.join("; ")));
        }
        let (mut emitters, mut receivers) = (Vec::new(), Vec::new());
        for FleetDrone { wake, discs } in fleet {
            emitters.push(Emitter::new(
                wake,
                (convection, step_s),
                highest_z_m - floor_z_m,
            ));
            receivers.push(Receiver::new(discs, Superposition::Momentum));
        }
        Ok(FleetAir {
            emitters,
            receivers,
            floor_z_m,
        })
    }

    /// The place (m) of every drone, in the fleet's order, and its thrust over the weight that its
    /// wake was made with; 0: its rotors stand still. Further ones are left alone.
    pub fn record(&mut self, fleet: &[(Point3<f64>, f64)]) {
        for (emitter, (position_m, thrust)) in self.emitters.iter_mut().zip(fleet) {
            emitter.record(EmitterMoment {
                position_m: *position_m,
                strength: thrust.max(0.0).sqrt(),
                lean: [0.0; 2],
                ends_at_z_m: self.floor_z_m,
            });
        }
    }

    /// Factors for a drone of the fleet at a place (m), in the air of all others. No factor where
    /// there is no such drone.
    pub fn factors(&mut self, drone: usize, centre_m: Point3<f64>) -> Factors {
        let Some(receiver) = self.receivers.get_mut(drone) else {
            return Factors::of(0.0, 1.0);
        };
        receiver.clear();
        let others = self.emitters.iter().enumerate().filter(|it| it.0 != drone);
        let parcels = others.flat_map(|(k, it)| it.parcels(centre_m.z).map(move |it| (k, it)));
        let mut found: Vec<_> = parcels.collect();
        receiver.add_all(&mut found, &centre_m);
        let hover_mps = self.emitters[drone].wake().hover_velocity_mps();
        Factors::of(receiver.mean_mps(), hover_mps)
    }
}
