//! What the drones' own throttle and power say about mass and density, before any air is judged.
//!
//! ```text
//! throttle t ~ √(m/ρ),  power p ~ m^1.5 ρ^-0.5   =>   m = p/t,  ρ = m/t²        each over what the metadata give
//! ```
//!
//! Speeds alone cannot tell a heavier drone from thinner air or from a probe that reads too much;
//! this can, and it reveals pairs that cancel one another in the speeds.

use airflow::effects::EffectSpec;

use crate::forward::hypothesis::Hypothesis;
use crate::infer::intervals::NINETY_FIVE;
use crate::record::recording::{Recording, Role, Vehicle};
use crate::statistics::change_point;
use crate::statistics::quantile::mean;

/// Departure of the throttle from hover that counts. A hover's mean throttle is known to less than
/// a percent.
const LEAST: f64 = 0.025;
/// Share of the electrical power that ends as the induced power of momentum theory. Assumed here,
/// because figures of merit and motor efficiencies of small electric quadrotors multiply to 0.5 to
/// 0.7; it matters only where a mass is told from a density.
const EFFICIENCY: f64 = 0.6;

/// How many entries the moment of a step may be off. Chosen here: a throttle settles in one or two.
const CHANGE_WITHIN: f64 = 2.0;

/// A cause in the drones: more or less mass or density than stated.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// Its name in the effect table: `payload_mass` or `air_density`.
    pub effect: &'static str,
    /// Values of its parameters: the factor (1), and of a payload the moments from which and until
    /// which it is carried (s); infinite: always.
    pub values: Vec<f64>,
    /// Half-widths of their 95 % intervals, in their units; of a moment how far off it may be.
    pub half_widths: Vec<f64>,
}

impl Cause {
    fn payload(mass_factor: f64, error: f64, [since_s, until_s]: [f64; 2], within_s: f64) -> Cause {
        Cause {
            effect: "payload_mass",
            values: vec![mass_factor, since_s, until_s],
            half_widths: vec![NINETY_FIVE * error, within_s],
        }
    }

    /// Its row of the effect table.
    pub(crate) fn spec(&self) -> &'static EffectSpec {
        EffectSpec::named(self.effect).expect("both are rows of the effect table")
    }

    /// Whether its values are such as a finding may hold.
    fn is_possible(&self) -> bool {
        let components = self.spec().components().zip(&self.values);
        let mut ranges = components.map(|((of, _), value)| (of.range, value));
        ranges.all(|([low, high], value)| (low..=high).contains(value))
    }

    /// Puts it into a hypothesis.
    pub fn set(&self, hypothesis: &mut Hypothesis) {
        self.spec().set(&mut hypothesis.effects, &self.values);
    }
}

/// An emitter in the air: rotors that idle say nothing of its mass.
struct AirborneEmitter<'r> {
    vehicle: &'r Vehicle,
    t_s: Vec<f64>,
    /// Over hover's.
    throttle: Vec<f64>,
    power_w: Option<Vec<f64>>,
}

impl AirborneEmitter<'_> {
    /// `None` where no throttle is logged, or its rotors only idle.
    fn of(vehicle: &Vehicle) -> Option<AirborneEmitter<'_>> {
        let track = &vehicle.track;
        let throttle = track.throttle_ratio.as_ref()?;
        let entries = 0..throttle.len();
        let entries: Vec<usize> = entries.filter(|&entry| !track.is_idle(entry)).collect();
        let of = |column: &Vec<f64>| entries.iter().map(|&entry| column[entry]).collect();
        (!entries.is_empty()).then(|| AirborneEmitter {
            vehicle,
            t_s: of(&track.t_s),
            throttle: of(throttle),
            power_w: track.power_w.as_ref().map(of),
        })
    }
}

fn emitters(recording: &Recording) -> impl Iterator<Item = &Vehicle> {
    let vehicles = recording.vehicles.iter();
    vehicles.filter(|vehicle| vehicle.role == Role::Emitter)
}

/// Whether any emitter's throttle is logged.
#[must_use]
pub fn is_logged(recording: &Recording) -> bool {
    emitters(recording).any(|vehicle| vehicle.track.throttle_ratio.is_some())
}

/// What throttle and power of the emitters say; `None` where no throttle is logged, nothing
/// departs from what is stated, or as much as no drone could.
#[must_use]
pub fn cause(recording: &Recording) -> Option<Cause> {
    let flown: Vec<AirborneEmitter> = emitters(recording)
        .filter_map(AirborneEmitter::of)
        .collect();
    let first = flown.first()?;
    let ratios: Vec<f64> = flown.iter().map(|of| mean(&of.throttle)).collect();
    let density = recording.environment.air.density_kg_per_m3();
    let airframe = &first.vehicle.airframe;
    let hover_w = airframe.hover_power_w(airframe.mass_kg(), density) / EFFICIENCY;
    let power_ratio = first
        .power_w
        .as_ref()
        .map(|power_w| mean(power_w) / hover_w);
    let cause = step(first).or_else(|| always(first, mean(&ratios), power_ratio));
    cause.filter(Cause::is_possible)
}

/// A constant departure.
fn always(first: &AirborneEmitter, throttle: f64, power: Option<f64>) -> Option<Cause> {
    if (throttle - 1.0).abs() < LEAST {
        return None;
    }
    let error = 2.0 * throttle * standard_error(&first.throttle);
    let mass_factor = power.map_or(throttle * throttle, |power| power / throttle);
    let density_factor = mass_factor / (throttle * throttle);
    // Whichever departs more is taken for the cause, alone.
    if power.is_some() && (density_factor - 1.0).abs() > (mass_factor - 1.0).abs() {
        return Some(Cause {
            effect: "air_density",
            values: vec![(throttle * throttle).recip()],
            half_widths: vec![NINETY_FIVE * error],
        });
    }
    let always_s = [f64::NEG_INFINITY, f64::INFINITY];
    Some(Cause::payload(throttle * throttle, error, always_s, 0.0))
}

/// A step from the stated mass to another, and back where there is a second one.
fn step(flown: &AirborneEmitter) -> Option<Cause> {
    let AirborneEmitter { t_s, throttle, .. } = flown;
    let steps = change_point::steps(throttle);
    let first = steps.first()?;
    let end = steps.get(1).map_or(throttle.len(), |second| second.index);
    // The level that is nearer to hover is the stated mass.
    let starts_loaded = (first.before - 1.0).abs() > (first.after - 1.0).abs();
    let (loaded, plain, since_s) = match first.index {
        to if starts_loaded => (0..to, first.after, f64::NEG_INFINITY),
        from => (from..end, first.before, t_s[from]),
    };
    let until_s = t_s.get(loaded.end).copied().unwrap_or(f64::INFINITY);
    let step_s = (t_s[t_s.len() - 1] - t_s[0]) / t_s.len().max(2) as f64;
    let part = &throttle[loaded];
    let mass_factor = (mean(part) / plain).powi(2);
    let (error, within_s) = (2.0 * standard_error(part), CHANGE_WITHIN * step_s);
    Some(Cause::payload(
        mass_factor,
        error,
        [since_s, until_s],
        within_s,
    ))
}

/// Standard error of the mean, neighbours taken as independent in tens.
fn standard_error(values: &[f64]) -> f64 {
    let middle = mean(values);
    let count = values.len().max(2) as f64;
    let squares = values.iter().map(|x| (x - middle) * (x - middle));
    (10.0 * squares.sum::<f64>() / (count - 1.0) / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::infer::diagnose::tests::hall;

    #[test]
    fn rotors_that_idle_say_nothing_of_mass() {
        let mut recording = hall();
        let track = &mut recording.vehicles[0].track;
        // As stated, and idle for half of the time at first.
        let entries = track.t_s.len();
        let throttle = track.throttle_ratio.as_mut().expect("it is logged");
        throttle[..entries / 2].fill(0.0);
        assert_eq!(cause(&recording), None);
        // Three tenths more in the air, whatever stood on the floor.
        let throttle = recording.vehicles[0].track.throttle_ratio.as_mut();
        let flown = throttle.into_iter().flatten().filter(|ratio| **ratio > 0.0);
        flown.for_each(|ratio| *ratio *= 1.3_f64.sqrt());
        recording.vehicles[0].track.power_w = None;
        let found = cause(&recording).expect("it is heavier");
        assert_eq!(found.effect, "payload_mass");
        assert!((found.values[0] - 1.3).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn no_cause_is_named_that_a_finding_could_not_hold() {
        let mut recording = hall();
        let track = &mut recording.vehicles[0].track;
        track.power_w = None;
        // Above what idles; a drone of a sixth of its mass.
        let throttle = track.throttle_ratio.as_mut().expect("it is logged");
        throttle.iter_mut().for_each(|ratio| *ratio *= 0.4);
        assert_eq!(cause(&recording), None);
    }
}
