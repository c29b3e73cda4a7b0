//! What may be missing: every effect and every sensor fault, with its parameters, their bounds, and the size from which it matters.

mod effects;
mod sensor;

use airflow::effects::EffectSpec;
use serde::{Deserialize, Serialize};

pub(crate) use effects::{
    BODY_DRAG, GROUND_IMPINGEMENT, OWN_MOTION, of_the_jet, of_the_receiver, of_the_surroundings,
};
pub(crate) use sensor::{CLOCK, DRIFT, GAIN, LAG, OFFSET};
use sensor::{FAULTS, of_the_sensor};

use crate::forward::hypothesis::Hypothesis;
use crate::forward::observed::Observed;
use crate::forward::simulate::Channel;
use crate::record::baseline::{Observation, Upper};
use crate::record::recording::Role;

/// Whether an effect is one of the air or of an instrument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Of the air, or of how a drone answers to it.
    Physics,
    /// Of an instrument or a clock.
    Sensor,
}

/// One parameter of a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// As in the equation.
    pub name: &'static str,
    /// Its unit; 1 for a ratio.
    pub unit: &'static str,
    /// Lowest value that the fit may take.
    pub low: f64,
    /// Highest.
    pub high: f64,
    /// The value at which the effect vanishes.
    pub neutral: f64,
    /// Distance from there below which it changes no decision.
    pub practical: f64,
}

/// One thing that may be missing.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Canonical name.
    pub name: &'static str,
    /// Of the air or of the sensor.
    pub kind: Kind,
    /// Its equation, with the parameters' names in it.
    pub equation: &'static str,
    /// What happens, in one sentence.
    pub description: &'static str,
    /// Its parameters. Those after the first `essential` shape the effect but cannot make it vanish.
    pub parameters: Vec<Parameter>,
    /// How many of the parameters make it vanish when they are neutral.
    pub essential: usize,
    /// Where fits begin.
    pub starts: Vec<Vec<f64>>,
    /// One standard deviation of what its law in closed form may be off from the mechanism, in parts of the effect: chosen here, as far as
    /// other closures of the same mechanism differ from it.
    pub closure_error: f64,
    /// The measurement that settles whether it is there, whatever the air; empty where none is known.
    pub settled_by: &'static str,
    /// What values of its parameters change.
    pub change: Change,
}

/// Where the values of a candidate's parameters go.
#[derive(Clone, Copy, Debug)]
pub enum Change {
    /// Into an effect of the air or of a receiver.
    Effect(&'static EffectSpec),
    /// Into anything else that is assumed.
    Hypothesis(fn(&[f64], &mut Hypothesis)),
}

impl Candidate {
    /// How large a fitted effect is, in units of what matters: below 1 it changes no decision.
    #[must_use]
    pub fn size(&self, values: &[f64]) -> f64 {
        let parts = self.parameters.iter().zip(values).take(self.essential);
        let squares = parts.map(|(parameter, value)| {
            let part = (value - parameter.neutral) / parameter.practical;
            part * part
        });
        squares.sum::<f64>().sqrt()
    }

    /// The hypothesis with its parameters at these values.
    #[must_use]
    pub fn on(&self, base: &Hypothesis, values: &[f64]) -> Hypothesis {
        let mut hypothesis = *base;
        self.set(values, &mut hypothesis);
        hypothesis
    }

    /// Puts values of the parameters into a hypothesis.
    pub(crate) fn set(&self, values: &[f64], hypothesis: &mut Hypothesis) {
        match self.change {
            Change::Effect(spec) => spec.set(&mut hypothesis.effects, values),
            Change::Hypothesis(set) => set(values, hypothesis),
        }
    }
}

pub(crate) fn parameter(
    name: &'static str,
    unit: &'static str,
    bounds: [f64; 2],
    neutral: f64,
    practical: f64,
) -> Parameter {
    let [low, high] = bounds;
    Parameter {
        name,
        unit,
        low,
        high,
        neutral,
        practical,
    }
}

/// Every name of an effect or a fault, the canonical one first; `None`: the name is of neither.
#[must_use]
pub fn names_of(name: &str) -> Option<Vec<&'static str>> {
    let effect = EffectSpec::named(name).map(|spec| (spec.name, spec.aliases));
    let names = effect.or_else(|| fault(name).map(|fault| (fault.name, fault.aliases)));
    names.map(|(name, aliases)| [&[name], aliases].concat())
}

/// Whether a name is that of an instrument's or a clock's fault.
#[must_use]
pub fn is_sensor(name: &str) -> bool {
    fault(name).is_some()
}

fn fault(name: &str) -> Option<&'static sensor::Fault> {
    let is_named = |fault: &&sensor::Fault| fault.name == name || fault.aliases.contains(&name);
    FAULTS.into_iter().find(is_named)
}

/// Everything that a recording could show, physics first; what it could not (a second jet's sum with one drone, a floor far below) is left out.
#[must_use]
pub fn applicable(observed: &Observed) -> Vec<Candidate> {
    let shows = Shows::of(observed);
    let mut candidates = Vec::new();
    if shows.air {
        candidates.extend(of_the_jet(&shows));
        candidates.extend(of_the_surroundings(&shows));
    }
    if matches!(observed.channel, Channel::Throttle | Channel::Power) {
        candidates.extend(of_the_receiver(&shows));
    }
    candidates.extend(of_the_sensor(&shows, observed));
    candidates
}

/// What a recording has that effects need.
pub(crate) struct Shows {
    pub(crate) air: bool,
    pub(crate) probes: bool,
    pub(crate) hover_mps: f64,
    pub(crate) jets: usize,
    pub(crate) sizes_differ: bool,
    pub(crate) near: bool,
    pub(crate) floor: bool,
    pub(crate) ceiling: bool,
    pub(crate) moves: bool,
    pub(crate) climbs: bool,
    pub(crate) battery: bool,
    pub(crate) receiver_moves: bool,
    pub(crate) axial_only: bool,
    pub(crate) span_s: [f64; 2],
    pub(crate) fastest: f64,
}

/// Whether a receiver climbs or flies forward at a tenth of its own induced velocity in more than 2 % of the samples.
fn receiver_moves(observed: &Observed) -> bool {
    let recording = observed.recording;
    let density = recording.environment.air.density_kg_per_m3();
    let moves = |sample: &crate::forward::simulate::Sample| {
        let vehicle = recording.vehicles.get(sample.subject as usize)?;
        let moment = vehicle.track.moment(sample.t_s)?;
        let airframe = &vehicle.airframe;
        let hover_mps = airframe.hover_induced_velocity_mps(airframe.mass_kg(), density);
        Some(vehicle.track.velocity_at(moment).norm() > 0.1 * hover_mps)
    };
    let moving = observed.samples.iter().filter(|s| moves(s) == Some(true));
    moving.count() as f64 > 0.02 * observed.samples.len() as f64
}

impl Shows {
    fn of(observed: &Observed) -> Shows {
        let recording = observed.recording;
        let density = recording.environment.air.density_kg_per_m3();
        let emitters: Vec<_> = recording
            .vehicles
            .iter()
            .filter(|vehicle| vehicle.role != Role::Receiver && recording.baseline.wakes)
            .collect();
        let hover = |v: &&crate::record::recording::Vehicle| {
            v.airframe
                .hover_induced_velocity_mps(v.airframe.mass_kg(), density)
        };
        let ratio = |v: &&crate::record::recording::Vehicle| {
            v.airframe.propeller_diameter_m() / v.airframe.motor_distance_m()
        };
        let range = |name: &str| {
            let column = observed.covariate(name).unwrap_or_default();
            let low = column.iter().copied().fold(f64::INFINITY, f64::min);
            let high = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            [low, high]
        };
        let share = |name: &str, test: &dyn Fn(f64) -> bool| {
            let column = observed.covariate(name).unwrap_or_default();
            column.iter().filter(|x| test(**x)).count() as f64 / column.len().max(1) as f64
        };
        let [ratio_low, ratio_high] = emitters
            .iter()
            .map(ratio)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], r| {
                [low.min(r), high.max(r)]
            });
        let fastest = observed
            .samples
            .iter()
            .map(|s| s.recorded)
            .fold(0.0, f64::max);
        Shows {
            air: !emitters.is_empty(),
            probes: observed.channel == Channel::Speed,
            hover_mps: emitters.iter().map(hover).fold(0.1, f64::max),
            jets: emitters.len(),
            // 3 %: what the exponent could do then is below any noise.
            sizes_differ: ratio_high > 1.03 * ratio_low,
            near: share("s/l", &|s| (0.0..2.5).contains(&s)) > 0.005
                && recording.baseline.upper == Upper::FarFieldExtrapolated,
            floor: recording.environment.floor_z_m.is_some()
                && share("height/half-width", &|h| h < 2.5) > 0.005,
            ceiling: recording.environment.ceiling_z_m.is_some(),
            // The paper's limit for hover is 0.1 m/s.
            moves: share("emitter speed m/s", &|v| v > 0.1) > 0.02,
            climbs: share("climb m/s", &|v| v.abs() > 0.1) > 0.02,
            battery: {
                let [low, high] = range("battery V");
                low > 0.0 && high > 1.01 * low && observed.channel != Channel::Power
            },
            receiver_moves: observed.channel != Channel::Speed && receiver_moves(observed),
            axial_only: recording.baseline.observation == Observation::AxialAndAmbient,
            span_s: range("time s"),
            fastest,
        }
    }
}
