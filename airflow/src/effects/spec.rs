//! The effect table: what is known of each effect beside its formula, one row in the effect's own
//! file.
//!
//! Candidates of a diagnosis, readers and writers of `finding.ron`, ranges with their messages,
//! what a planner flies and what reports print all read these rows. Another effect is a file with
//! its formula and its row, its field in [`Effects`] and its place in [`EFFECTS`], the function
//! that evaluates it, and what a fit needs beside this table.

use super::{EFFECTS, Effects};

/// One row of the effect table.
#[derive(Debug)]
pub struct EffectSpec {
    /// Canonical name, that of the field in [`Effects`] and in files.
    pub name: &'static str,
    /// Other names of the same effect.
    pub aliases: &'static [&'static str],
    /// Equation in plain characters, with the symbols of its parameters in it.
    pub equation: &'static str,
    /// What happens, in one sentence.
    pub description: &'static str,
    /// Parameters in the order in which [`EffectSpec::set`] takes their values; those that a fit
    /// finds come first.
    pub parameters: &'static [Parameter],
    /// How many values, from the first, make the effect vanish when they are neutral; the others
    /// shape it.
    pub essential: usize,
    /// What evaluates it.
    pub home: Home,
    /// What a planner does with it, by its values.
    pub treatment: fn(&Effects) -> Treatment,
    pub(super) get: fn(&Effects) -> Option<Vec<f64>>,
    pub(super) set: fn(&mut Effects, &[f64]),
}

/// Where an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Home {
    /// In one drone's steady jet: [`crate::Wake::with_effects`].
    Jet,
    /// In how a jet meets its surroundings at one moment: [`crate::Surroundings::velocity_mps`] and
    /// [`Effects::background_mps`].
    Surroundings,
    /// In how a receiver answers: [`Effects::receiver_alpha`], [`Effects::thrust_ratio`],
    /// [`Effects::throttle_factor`].
    Receiver,
}

/// What becomes of an effect when a plan is flown through it, with the sentence that is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Treatment {
    /// Flown as it was found.
    Exact,
    /// Flown as more air than was found; how.
    Bounded(&'static str),
    /// It does not change the air that limits count; why.
    Ignored(&'static str),
    /// It cannot be flown; why.
    Refused(&'static str),
}

/// What only moves air sideways.
pub(super) const SIDEWAYS: Treatment =
    Treatment::Ignored("it moves air sideways only, and limits count vertical air");
/// What a drone brings about itself.
pub(super) const OWN: Treatment =
    Treatment::Ignored("it is of a drone's own frame and speed, not the air of others");
/// What changes how much a rotor lifts.
pub(super) const THRUST: Treatment =
    Treatment::Ignored("it changes the thrust of a drone, not the air that it meets");

/// One parameter of one effect: a field of its struct.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name of the field in the struct and in files.
    pub key: &'static str,
    /// Its letter in the equation; two for a pair along x and y of the world.
    pub symbols: &'static [&'static str],
    /// Its unit; 1 for a ratio.
    pub unit: &'static str,
    /// Lowest and highest value that files may hold. Where an effect's page gives no range, chosen
    /// here to keep out slips of the hand.
    pub range: [f64; 2],
    /// The value at which it changes nothing, or, of one that shapes, the usual value.
    pub neutral: f64,
    /// Lowest and highest value that a fit may take; `None`: it is not fitted.
    pub fit: Option<[f64; 2]>,
    /// What the fit's range is over.
    pub fit_over: FitOver,
    /// Whether files may leave it out.
    pub is_optional: bool,
}

/// What the range of a fit is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitOver {
    /// The parameter's own unit.
    Unit,
    /// The induced velocity at hover of the fastest jet.
    InducedVelocity,
    /// The time from the first sample, 0, to the last, 1.
    Recording,
}

impl Parameter {
    /// A required parameter with a range that is also the fit's, neutral at 0.
    pub(super) const fn new(
        key: &'static str,
        symbols: &'static [&'static str],
        unit: &'static str,
        range: [f64; 2],
    ) -> Parameter {
        Parameter {
            key,
            symbols,
            unit,
            range,
            neutral: 0.0,
            fit: Some(range),
            fit_over: FitOver::Unit,
            is_optional: false,
        }
    }

    pub(super) const fn ratio(
        key: &'static str,
        symbols: &'static [&'static str],
        neutral: f64,
        range: [f64; 2],
    ) -> Parameter {
        Parameter::new(key, symbols, "1", range).neutral(neutral)
    }

    pub(super) const fn neutral(self, neutral: f64) -> Parameter {
        Parameter { neutral, ..self }
    }

    pub(super) const fn fit(self, low: f64, high: f64) -> Parameter {
        Parameter {
            fit: Some([low, high]),
            ..self
        }
    }
}

impl EffectSpec {
    /// The row of an effect, by its name or an alias.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static EffectSpec> {
        EFFECTS
            .into_iter()
            .find(|spec| spec.name == name || spec.aliases.contains(&name))
    }

    /// Each value's parameter and symbol, in the order of [`EffectSpec::set`]: a pair gives two.
    pub fn components(&self) -> impl Iterator<Item = (&'static Parameter, &'static str)> {
        let parameters = self.parameters.iter();
        parameters.flat_map(|parameter| parameter.symbols.iter().map(move |s| (parameter, *s)))
    }

    /// The values of its parameters; `None` where the effect is not among these.
    #[must_use]
    pub fn values(&self, effects: &Effects) -> Option<Vec<f64>> {
        (self.get)(effects)
    }

    /// Adds the effect with these values, in the order of [`EffectSpec::components`]; those beyond
    /// the last are neutral.
    pub fn set(&self, effects: &mut Effects, values: &[f64]) {
        let neutral = self.components().map(|(parameter, _)| parameter.neutral);
        let rest = neutral.skip(values.len());
        let all: Vec<f64> = values.iter().copied().chain(rest).collect();
        (self.set)(effects, &all);
    }
}

/// A parameter outside its range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("`{key}` of `{effect}` is {value}; it must be from {low} to {high}",
    key = parameter.key, low = parameter.range[0], high = parameter.range[1])]
pub struct OutOfRange {
    /// Name of the effect.
    pub effect: &'static str,
    /// Its parameter.
    pub parameter: Parameter,
    /// What it is.
    pub value: f64,
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

    #[test]
    fn what_a_fit_may_take_a_file_may_hold() {
        for spec in EFFECTS {
            let in_units = spec.parameters.iter();
            let in_units = in_units.filter(|of| of.fit_over == FitOver::Unit);
            for (of, fit) in in_units.filter_map(|of| Some((of, of.fit?))) {
                let is_readable = of.range[0] <= fit[0] && fit[1] <= of.range[1];
                assert!(is_readable, "{} {}", spec.name, of.key);
            }
        }
    }

    #[test]
    fn every_row_sets_and_reads_its_own_field_and_no_name_is_given_twice() {
        let mut names = std::collections::BTreeSet::new();
        for spec in EFFECTS {
            let mut effects = Effects::default();
            let count = spec.components().count();
            let values: Vec<f64> = (0..count).map(|k| 0.25 + k as f64).collect();
            spec.set(&mut effects, &values);
            let there: Vec<&str> = effects.specs().map(|spec| spec.name).collect();
            assert_eq!(there, [spec.name]);
            assert_eq!(spec.values(&effects), Some(values));
            assert!(1 <= spec.essential && spec.essential <= count);
            for name in spec.aliases.iter().chain([&spec.name]) {
                assert!(names.insert(*name), "{name}");
            }
        }
    }
}
