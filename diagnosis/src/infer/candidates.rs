//! What may be missing: every effect and every sensor fault, with its parameters, their bounds, and
//! the size from which it matters.

mod candidate;
mod effects;
mod faults;
mod shows;

use airflow::effects::EffectSpec;

pub use candidate::{Candidate, Change, Kind, Onset, Parameter, Scope};
pub(crate) use effects::{
    BODY_DRAG, GROUND_IMPINGEMENT, OF_THE_AIR, OF_THE_RECEIVER, OWN_MOTION, shown,
};
use faults::FAULTS;
pub(crate) use faults::{CLOCK, DRIFT, Fault, GAIN, LAG, OFFSET};
pub(crate) use shows::{Shows, lag_factor, lean, merging, sizes_differ};

use crate::forward::observed::Observed;
use crate::forward::simulate::Channel;

/// Every name of an effect or a fault, the canonical one first; `None`: the name is of neither.
#[must_use]
pub fn names_of(name: &str) -> Option<Vec<&'static str>> {
    let effect = EffectSpec::named(name).map(|spec| (spec.name, spec.aliases));
    let names = effect.or_else(|| fault(name).map(|fault| (fault.name, fault.aliases)));
    names.map(|(name, aliases)| [&[name], aliases].concat())
}

/// Names of the parameters without which an effect or a fault vanishes; the others shape it.
#[must_use]
pub fn essential(name: &str) -> Vec<&'static str> {
    if let Some(spec) = EffectSpec::named(name) {
        let symbols = spec.components().map(|(_, symbol)| symbol);
        return symbols.take(spec.essential).collect();
    }
    let parameters = fault(name).map_or(&[][..], |fault| fault.parameters);
    parameters.iter().map(|parameter| parameter.name).collect()
}

/// Whether a name is that of an instrument's or a clock's fault.
#[must_use]
pub fn is_sensor(name: &str) -> bool {
    fault(name).is_some()
}

fn fault(name: &str) -> Option<&'static Fault> {
    let is_named = |fault: &&Fault| fault.name == name || fault.aliases.contains(&name);
    FAULTS.iter().find(is_named)
}

/// Everything that a recording could show, physics first; what it could not (a second jet's sum
/// with one drone, a floor far below) is left out.
#[must_use]
pub fn applicable(observed: &Observed) -> Vec<Candidate> {
    let shows = Shows::of(observed);
    let mut candidates = Vec::new();
    if shows.air {
        candidates.extend(shown(OF_THE_AIR, &shows));
    }
    if matches!(observed.channel, Channel::Throttle | Channel::Power) {
        candidates.extend(shown(OF_THE_RECEIVER, &shows));
    }
    let faults = FAULTS.iter().filter(|fault| (fault.shown)(&shows));
    candidates.extend(faults.map(|fault| fault.candidate(&shows)));
    candidates
}
