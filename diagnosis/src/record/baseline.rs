//! What "simulation" means for one recording: declared in its metadata, obeyed everywhere.
//!
//! A difference between a recording and a simulation says something only if the simulation is
//! pinned down. Two recordings of one campaign may declare different ones.

use airflow::Superposition;

/// The simulation that a recording is compared with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Baseline {
    /// Whether drones are exposed to one another at all. `false`: each flies alone.
    pub wakes: bool,
    /// How several wakes add up.
    pub superposition: Superposition,
    /// Whether the air knows where its drone is at once.
    pub delay: Delay,
    /// What stands above 2.5 motor distances.
    pub upper: Upper,
    /// Where a receiver is exposed.
    pub receiver_air: ReceiverAir,
    /// How a receiver answers to it.
    pub receiver_law: ReceiverLaw,
    /// What a speed probe makes of it.
    pub observation: Observation,
}

/// When the air at a depth left its drone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Delay {
    /// At the same moment: wakes are attached to their drones.
    None,
    /// `τ(s) = l (σ² - s₀²)/(2 B k U_H)` earlier, `k` the convection speed over that of the
    /// centreline.
    Transport {
        /// `k`, above 0; 1: everything moves at the centreline's speed.
        convection: f64,
    },
}

/// The air above 2.5 motor distances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Upper {
    /// The far field's formula, extrapolated to the rotor plane.
    FarFieldExtrapolated,
    /// Four rotor jets that merge ([`airflow::Wake`]).
    FourRotors,
}

/// Where a receiver is exposed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReceiverAir {
    /// At the centre of its rotor plane.
    Centre,
    /// The mean over its rotor discs.
    DiscMean,
}

/// How a receiver answers to its exposure, `alpha` of its own induced velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReceiverLaw {
    /// It holds its thrust: power is multiplied by `beta`, throttle by `beta^exponent` (the
    /// paper's: one half).
    HoldsThrust {
        /// Of `beta` in the throttle.
        exponent: f64,
    },
    /// It holds its aerodynamic power, and thrust falls
    /// ([`airflow::power::thrust_ratio_at_constant_power`]).
    HoldsPower,
}

/// What a speed probe reads of the axial speed `U`, the radial speed `V` and the ambient speed `a`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Observation {
    /// `√(U² + a²)`.
    AxialAndAmbient,
    /// `√(U² + V² + a²)`.
    VelocityAndAmbient,
}

/// What a recording of a swarm means when it says nothing: the planner's own air.
impl Default for Baseline {
    fn default() -> Baseline {
        Baseline {
            wakes: true,
            superposition: Superposition::Momentum,
            delay: Delay::None,
            upper: Upper::FourRotors,
            receiver_air: ReceiverAir::DiscMean,
            receiver_law: ReceiverLaw::HoldsPower,
            observation: Observation::VelocityAndAmbient,
        }
    }
}
