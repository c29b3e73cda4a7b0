//! Which values the parameters may have: the ranges that each effect's own page gives.

use super::Effects;

/// One parameter of one effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name of the effect, as in [`Effects`].
    pub effect: &'static str,
    /// Name of its field.
    pub name: &'static str,
    /// Whether it is a pair along x and y.
    pub pair: bool,
    /// Whether files may leave it out.
    pub optional: bool,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
    /// Its unit; empty for ratios.
    pub unit: &'static str,
}

const fn ratio(effect: &'static str, name: &'static str, low: f64, high: f64) -> Parameter {
    Parameter {
        effect,
        name,
        pair: false,
        optional: false,
        low,
        high,
        unit: "",
    }
}

const fn measured(
    effect: &'static str,
    name: &'static str,
    low: f64,
    high: f64,
    unit: &'static str,
) -> Parameter {
    Parameter {
        unit,
        ..ratio(effect, name, low, high)
    }
}

const fn pair(
    effect: &'static str,
    name: &'static str,
    most: f64,
    unit: &'static str,
) -> Parameter {
    Parameter {
        pair: true,
        ..measured(effect, name, -most, most, unit)
    }
}

/// Every parameter of every effect, in the order of [`Effects`]. Where an effect's page gives no range, the one here is chosen to keep
/// out slips of the hand.
pub const PARAMETERS: &[Parameter] = &[
    // Beyond 0.4 U_H the model does not hold; the fastest induced velocity known here is 14 m/s.
    pair("crossflow", "wind_mps", 10.0, "m/s"),
    pair("wake_tilt", "lean", 1.0, ""),
    ratio("rotor_cant", "width_factor", 0.7, 1.45),
    ratio("wander", "growth", -1.0, 3.0),
    ratio("profile_tail", "share", -0.6, 1.6),
    ratio("profile_tail", "steepness", -0.6, 4.0),
    ratio("momentum_scale", "speed_factor", 0.1, 4.0),
    ratio("payload_mass", "mass_factor", 0.4, 2.5),
    Parameter {
        optional: true,
        ..measured("payload_mass", "since_s", f64::NEG_INFINITY, f64::MAX, "s")
    },
    Parameter {
        optional: true,
        ..measured("payload_mass", "until_s", f64::MIN, f64::INFINITY, "s")
    },
    ratio("air_density", "density_factor", 0.6, 1.4),
    ratio("dl_ratio", "exponent", -0.5, 1.5),
    ratio("near_field", "share", -0.5, 2.0),
    ratio("near_field", "shadow", 0.0, 1.0),
    ratio("buoyancy", "strength", -1.0, 1.0),
    ratio("swirl", "ratio", -0.8, 0.8),
    ratio("entrainment_radial", "factor", 0.0, 3.0),
    ratio("jet_merging", "exponent", 0.7, 4.0),
    ratio("wake_transport", "lag_factor", 0.0, 3.0),
    ratio("climb_descent", "exponent", 0.0, 3.0),
    ratio("ground_impingement", "reach", 0.0, 10.0),
    ratio("ground_impingement", "wall_jet", 0.0, 10.0),
    measured("recirculation", "speed_mps", 0.0, 5.0, "m/s"),
    measured("recirculation", "time_s", 1e-3, 1e5, "s"),
    Parameter {
        optional: true,
        ..ratio("recirculation", "rise", -1.0, 1.0)
    },
    ratio("ground_effect_thrust", "gain", -10.0, 10.0),
    ratio("ground_effect_thrust", "decay", 0.0, 100.0),
    ratio("ceiling_effect", "strength", -10.0, 10.0),
    ratio("receiver_inflow", "factor", 0.0, 2.5),
    ratio("battery_sag", "sensitivity", -2.0, 4.0),
    ratio("own_motion", "climb", -2.0, 4.0),
    ratio("own_motion", "forward", -3.0, 6.0),
    ratio("body_drag", "area_over_l2", 0.0, 10.0),
];

/// A parameter that is not what it may be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("`{name}` of `{effect}` is {value}; it must be from {low} to {high}",
    name = parameter.name, effect = parameter.effect, low = parameter.low, high = parameter.high)]
pub struct OutOfRange {
    /// Which.
    pub parameter: Parameter,
    /// What it is.
    pub value: f64,
}

impl Effects {
    /// Every parameter that is not in its range, not a number included; empty when all can be used.
    #[must_use]
    pub fn problems(&self) -> Vec<OutOfRange> {
        let mut problems = Vec::new();
        self.for_each_value(|effect, name, value| {
            let found = PARAMETERS
                .iter()
                .find(|known| known.effect == effect && known.name == name);
            if let Some(&parameter) = found
                && !(parameter.low..=parameter.high).contains(&value)
            {
                problems.push(OutOfRange { parameter, value });
            }
        });
        problems
    }

    fn for_each_value(&self, mut see: impl FnMut(&'static str, &'static str, f64)) {
        macro_rules! single {
            ($($effect:ident: $($name:ident),+;)+) => {
                $(if let Some(effect) = &self.$effect {
                    $(see(stringify!($effect), stringify!($name), effect.$name);)+
                })+
            };
        }
        if let Some([x, y]) = self.crossflow.map(|effect| effect.wind_mps) {
            see("crossflow", "wind_mps", x);
            see("crossflow", "wind_mps", y);
        }
        if let Some([x, y]) = self.wake_tilt.map(|effect| effect.lean) {
            see("wake_tilt", "lean", x);
            see("wake_tilt", "lean", y);
        }
        single! {
            rotor_cant: width_factor;
            wander: growth;
            profile_tail: share, steepness;
            momentum_scale: speed_factor;
            payload_mass: mass_factor, since_s, until_s;
            air_density: density_factor;
            dl_ratio: exponent;
            near_field: share, shadow;
            buoyancy: strength;
            swirl: ratio;
            entrainment_radial: factor;
            jet_merging: exponent;
            wake_transport: lag_factor;
            climb_descent: exponent;
            ground_impingement: reach, wall_jet;
            recirculation: speed_mps, time_s, rise;
            ground_effect_thrust: gain, decay;
            ceiling_effect: strength;
            receiver_inflow: factor;
            battery_sag: sensitivity;
            own_motion: climb, forward;
            body_drag: area_over_l2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Crossflow, PayloadMass, Wander};
    use super::*;

    #[test]
    fn what_is_out_of_range_is_named_and_what_is_within_is_not() {
        let fine = Effects {
            payload_mass: Some(PayloadMass::always(1.3)),
            ..Effects::default()
        };
        assert!(fine.problems().is_empty());
        let wrong = Effects {
            crossflow: Some(Crossflow {
                wind_mps: [0.5, f64::NAN],
            }),
            wander: Some(Wander { growth: 30.0 }),
            ..fine
        };
        let words: Vec<String> = wrong.problems().iter().map(ToString::to_string).collect();
        assert_eq!(
            words,
            [
                "`wind_mps` of `crossflow` is NaN; it must be from -10 to 10",
                "`growth` of `wander` is 30; it must be from -1 to 3",
            ]
        );
    }
}
