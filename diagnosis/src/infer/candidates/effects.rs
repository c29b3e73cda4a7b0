//! What a fit needs beside the effect table: which recordings can show an effect, the size from
//! which it matters, where fits begin, how far its law may be off, and which measurement settles
//! it.

use airflow::effects::{EffectSpec, FitOver};

use super::candidate::{Candidate, Change, Kind, Parameter, Scope};
use super::shows::Shows;

/// One effect as a fit tries it. Numbers without a source are chosen here.
pub(crate) struct Trial {
    /// Name in [`airflow::effects::EFFECTS`].
    effect: &'static str,
    /// Whether a recording can show it.
    shown: fn(&Shows) -> bool,
    /// For each parameter, in its unit, the distance from neutral below which it would change no
    /// decision; a moment's is all of the recording.
    practical: &'static [f64],
    /// Where fits begin, in what the fit's range is over.
    starts: &'static [&'static [f64]],
    /// See [`Candidate::closure_error`].
    closure_error: f64,
    /// See [`Candidate::settled_by`].
    settled_by: &'static str,
}

/// Those of some effects that a recording can show.
pub(crate) fn shown(trials: &[Trial], shows: &Shows) -> Vec<Candidate> {
    let shown = trials.iter().filter(|trial| (trial.shown)(shows));
    shown.map(|trial| trial.candidate(shows)).collect()
}

impl Trial {
    /// A law that is exact for what it describes, shown wherever there is a jet: its name in the
    /// effect table, what is practical, where fits begin.
    const fn new(
        effect: &'static str,
        practical: &'static [f64],
        starts: &'static [&'static [f64]],
    ) -> Trial {
        Trial {
            effect,
            shown: |_| true,
            practical,
            starts,
            closure_error: 0.0,
            settled_by: "",
        }
    }

    const fn shown(self, shown: fn(&Shows) -> bool) -> Trial {
        Trial { shown, ..self }
    }

    const fn closure_error(self, closure_error: f64) -> Trial {
        Trial {
            closure_error,
            ..self
        }
    }

    const fn settled_by(self, settled_by: &'static str) -> Trial {
        Trial { settled_by, ..self }
    }

    /// The row of the effect table with what this adds, its ranges in the recording's own units.
    pub(crate) fn candidate(&self, shows: &Shows) -> Candidate {
        let spec = EffectSpec::named(self.effect).expect("every trial is of a row of the table");
        let fitted = || {
            let components = spec.components();
            components.filter_map(|(parameter, symbol)| Some((parameter, symbol, parameter.fit?)))
        };
        let parameters = fitted().zip(self.practical);
        let parameters = parameters.map(|((parameter, symbol, ends), &practical)| {
            let [low, high] = ends.map(|end| shows.scaled(end, parameter.fit_over));
            // More than all of another profile or field, or of a tilt, says that its form is wrong.
            let is_share = ["share", "shadow"].contains(&parameter.key);
            let high = if is_share { 1.0 } else { high };
            let is_moment = parameter.fit_over == FitOver::Recording;
            let neutral = shows.declared(spec.name).unwrap_or(parameter.neutral);
            // Between what is declared and none of it: less than that no plan could fly.
            let low = match neutral > parameter.neutral {
                true => low.max(parameter.neutral),
                false => low,
            };
            Parameter {
                name: symbol,
                unit: parameter.unit,
                low,
                high,
                neutral: if is_moment { low } else { neutral },
                practical: if is_moment { high - low } else { practical },
                // Where it vanishes altogether, whatever is declared.
                is_all: [low == parameter.neutral, is_share],
            }
        });
        let parameters: Vec<Parameter> = parameters.collect();
        let start = |values: &&[f64]| {
            let pairs = fitted().zip(*values);
            let scaled = pairs.map(|((p, ..), &value)| shows.scaled(value, p.fit_over));
            scaled.collect()
        };
        // A fit that begins where nothing changes shows no change.
        let is_neutral = |start: &Vec<f64>| {
            let essential = start.iter().zip(&parameters).take(spec.essential);
            essential
                .into_iter()
                .all(|(value, of)| *value == of.neutral)
        };
        let starts = self.starts.iter().map(start);
        let starts = starts.filter(|start| !is_neutral(start)).collect();
        Candidate {
            name: spec.name,
            kind: Kind::Physics,
            equation: spec.equation,
            description: spec.description,
            parameters,
            essential: spec.essential,
            starts,
            closure_error: self.closure_error,
            settled_by: self.settled_by,
            change: Change::Effect(spec),
            scope: Scope::Whole,
        }
    }
}

impl Shows {
    /// A value of a fit's range in the parameter's own unit.
    fn scaled(&self, value: f64, over: FitOver) -> f64 {
        let [from_s, to_s] = self.span_s;
        match over {
            FitOver::Unit => value,
            FitOver::InducedVelocity => value * self.hover_mps,
            FitOver::Recording if value == 1.0 => to_s,
            FitOver::Recording => from_s + value * (to_s - from_s),
        }
    }
}

const SCALE: &str = "the weight of the drone on a scale, and its throttle and power in hover";
pub(super) const ONE_AXIS: &str =
    "the same places with a probe of one axis, held down the jet and across it";
const LEVEL: &str = "the wind beside the jet, ten motor distances from it, and the same hover turned by half a turn";
const PLACES: &str = "the probe's place once more, and the same hover twice as far above it and turned by half a turn: at one depth a probe that is written down aside reads as below a jet that leans";
pub(super) const MOTORS_OFF: &str =
    "a minute with the motors off before take-off and one after landing, the probe running";
pub(super) const THERE_AND_BACK: &str = "a pass through the jet and back at two speeds: a clock shifts both passes alike, a slow sensor and slow air do not";
const BRAKING: &str = "the same pass at a steady speed, and braking above the probe: only a jet that leans goes ahead of a drone that brakes";
const HEIGHTS: &str = "a hover at three heights with no drone above";

/// Effects of a jet, and of what it reaches: loads, motion, floor, room.
pub(crate) const OF_THE_AIR: &[Trial] = &[
    Trial::new(
        "crossflow",
        &[0.08, 0.08],
        &[&[0.06, 0.0], &[-0.06, 0.0], &[0.0, 0.06], &[0.0, -0.06]],
    )
    .closure_error(0.12)
    .settled_by(LEVEL),
    Trial::new(
        "wake_tilt",
        &[0.02, 0.02],
        &[
            &[0.03, 0.03],
            &[-0.03, -0.03],
            &[0.03, -0.03],
            &[-0.03, 0.03],
        ],
    )
    .settled_by(PLACES),
    Trial::new("rotor_cant", &[0.05], &[&[1.1], &[0.9]]),
    Trial::new("wander", &[0.05], &[&[0.2], &[-0.1]])
        .closure_error(0.1)
        .settled_by("a probe of 20 Hz or more on the axis: a wandering jet is gusty there"),
    Trial::new(
        "profile_tail",
        &[0.1, 1.0],
        &[&[0.4, 0.0], &[0.6, 2.0], &[-0.2, 0.0]],
    ),
    Trial::new("momentum_scale", &[0.06], &[&[1.05]]).settled_by(SCALE),
    Trial::new("buoyancy", &[0.15], &[&[0.1], &[-0.1]]),
    // Where the air turns fastest: from 0.5 (a vortex with a core) to 0.9 half-widths (this law).
    Trial::new("swirl", &[0.25], &[&[0.4], &[1.2]])
        .closure_error(0.2)
        .settled_by(ONE_AXIS),
    // Half-widths of its four jets run from 0.7 to 1.05 rotor radii among closures.
    Trial::new("near_field", &[0.15, 0.3, 0.5], &[&[0.5, 0.5, 0.7]])
        .shown(|shows| shows.near)
        .closure_error(0.2),
    Trial::new("jet_merging", &[0.1], &[&[1.4]])
        .shown(|shows| shows.jets > 1)
        .closure_error(0.2),
    Trial::new("dl_ratio", &[0.2], &[&[0.4]])
        .shown(|shows| shows.sizes_differ)
        .settled_by(SCALE),
    Trial::new("entrainment_radial", &[0.4], &[&[1.4]])
        .shown(|shows| shows.probes && !shows.axial_only)
        .settled_by(ONE_AXIS),
    Trial::new(
        "payload_mass",
        &[0.1, 1.0],
        &[&[1.1, 0.3], &[1.1, 0.5], &[1.1, 0.7]],
    )
    .settled_by(SCALE),
    // The last where the recording declares advected wakes.
    Trial::new("wake_transport", &[0.3], &[&[1.0], &[2.0], &[0.0]])
        .shown(|shows| shows.moves)
        .settled_by(THERE_AND_BACK),
    Trial::new("wake_lean", &[0.2], &[&[0.7]])
        .shown(|shows| shows.leans)
        .settled_by(BRAKING),
    Trial::new("climb_descent", &[0.5], &[&[1.0]]).shown(|shows| shows.climbs),
    GROUND_IMPINGEMENT,
    Trial::new(
        "recirculation",
        &[0.1, 1000.0, 1.0],
        &[&[0.2, 60.0, 0.3], &[0.2, 400.0, 0.3], &[0.2, 120.0, -0.3]],
    )
    .shown(|shows| shows.probes)
    .settled_by(MOTORS_OFF),
];

/// Effects of how a drone answers to air.
pub(crate) const OF_THE_RECEIVER: &[Trial] = &[
    Trial::new("receiver_inflow", &[0.06], &[&[0.8], &[1.2]])
        .shown(|shows| shows.air)
        .settled_by("a speed probe in the place of the receiver"),
    OWN_MOTION,
    Trial::new("battery_sag", &[0.1], &[&[0.5]])
        .shown(|shows| shows.battery)
        .settled_by("the same passes with a fresh battery, in the other order"),
    Trial::new(
        "ground_effect_thrust",
        &[0.05, 1.0],
        &[&[0.2, 0.5], &[0.2, 0.2]],
    )
    .shown(|shows| shows.floor)
    .settled_by(HEIGHTS),
    Trial::new("ceiling_effect", &[0.05], &[&[0.1]])
        .shown(|shows| shows.ceiling)
        .settled_by(HEIGHTS),
];

/// What a drone's own speed does to its exposure.
pub(crate) const OWN_MOTION: Trial =
    Trial::new("own_motion", &[0.2, 0.5], &[&[0.5, 0.2]]).shown(|shows| shows.receiver_moves);

/// Drag of the frame: of forces alone, where throttle and inflow are known.
pub(crate) const BODY_DRAG: Trial = Trial::new("body_drag", &[0.05], &[&[0.1]]);

/// The floor below a jet.
pub(crate) const GROUND_IMPINGEMENT: Trial = Trial::new(
    "ground_impingement",
    &[0.2, 0.2],
    &[&[0.8, 0.8], &[0.3, 0.3]],
)
.shown(|shows| shows.floor && shows.probes)
.closure_error(0.1);
