//! How a receiver answers, beyond momentum theory.

use super::Effects;

/// Where a receiver is and what its battery does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reception {
    /// Height of its rotor plane over the floor (m), where there is one.
    pub height_m: Option<f64>,
    /// Distance to the ceiling (m), where there is one.
    pub gap_m: Option<f64>,
    /// Radius of its propellers (m).
    pub propeller_radius_m: f64,
    /// Battery voltage over that of the beginning, where it is logged.
    pub voltage_ratio: Option<f64>,
}

impl Effects {
    /// The air that counts, over the receiver's induced velocity.
    #[must_use]
    pub fn receiver_alpha(&self, alpha: f64) -> f64 {
        self.receiver_inflow
            .map_or(alpha, |inflow| inflow.alpha(alpha))
    }

    /// Thrust over that in free air at the same throttle, near floor and ceiling.
    #[must_use]
    pub fn thrust_ratio(&self, at: &Reception) -> f64 {
        let ground = self.ground_effect_thrust.zip(at.height_m);
        let ceiling = self.ceiling_effect.zip(at.gap_m);
        ground.map_or(1.0, |(effect, height_m)| {
            effect.thrust_ratio(height_m / at.propeller_radius_m)
        }) * ceiling.map_or(1.0, |(effect, gap_m)| {
            effect.thrust_ratio(gap_m / at.propeller_radius_m)
        })
    }

    /// Factor on the throttle that holds the thrust: near floor and ceiling it falls with the root
    /// of what is gained, and it rises as the battery falls.
    #[must_use]
    pub fn throttle_factor(&self, at: &Reception) -> f64 {
        let battery = self.battery_sag.zip(at.voltage_ratio);
        self.thrust_ratio(at).recip().max(0.0).sqrt()
            * battery.map_or(1.0, |(effect, ratio)| effect.throttle_factor(ratio))
    }

    /// Factor on the power that holds a drone up, over that far from floor and ceiling: induced
    /// power goes with `T^1.5`.
    #[must_use]
    pub fn power_factor(&self, at: &Reception) -> f64 {
        self.thrust_ratio(at).recip().max(0.0).powf(1.5)
    }
}
