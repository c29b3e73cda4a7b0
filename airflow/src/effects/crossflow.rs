//! Cross-flow: wind across a jet bends it, and weakens it as it takes the wind's air in.
//!
//! An integral jet (top hat of radius `b`, speed `u` along its axis, at angle `θ` to the wind `W`),
//! followed from the rotor plane down the arc `ς`, all in `l` and `U_H`:
//!
//! ```text
//! dQ/dς  = 2π b ( α |u - W cos θ| + β_n |W sin θ| )      volume flux over π
//! dM_x/dς = W dQ/dς + F sin θ,   dM_z/dς = -F cos θ        F = c_d b (W sin θ)²: the wind's pressure, normal to the axis
//! u = |M|/Q,   b = √(Q/(π u))
//! ```
//!
//! `α = 1.6986 S/2` makes the still-air jet that of the paper (a top hat of its mass and momentum
//! is √2 · 1.2011 = 1.6986 half-widths wide). `β_n = 0.34` is the entrainment of a jet in a normal
//! current (Lee & Chu, Turbulent Jets and Plumes, 2003). `c_d = 1.2` is chosen here: 1.0 to 1.3
//! reproduces the drift of weak winds, `x/l = 2.3 (W/U_H)(s/l)²/(2 B)` and above. Nothing in it is
//! fitted but `W`.
//!
//! Range: `W` up to 0.4 `U_H`; beyond that the drone tilts into the wind more than the level rotor
//! plane allows. Taken for: a tilted emitter (grows with `s`, not `s²`), a shifted probe (constant
//! in `s`), a lopsided jet (turns with yaw; leaves no wind far from the jet).

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, FitOver, Home, Parameter, Treatment};
use crate::jet::Jet;

/// Entrainment by the current's normal part (Lee & Chu 2003).
const NORMAL_ENTRAINMENT: f64 = 0.34;
/// Drag of the wind on the jet's flank, see the module.
const DRAG: f64 = 1.2;
/// Top-hat radius over half-width: `√2 · 1.2011`, the latter `1/√ln2`.
const TOP_HAT: f64 = 1.698_6;
/// Step along the arc, in `l`. Chosen here: halving it changes no drift by more than 1e-3.
const STEP: f64 = 0.05;
/// Depth to which the plume is followed, in `l`; and arc, for plumes that level off. Chosen here:
/// twice as far as any jet was measured.
const DEEPEST: f64 = 50.0;
const LONGEST: f64 = 120.0;
/// Between two depths of the table, in `l`. Chosen here: a tenth of where the near field ends.
const SPACING: f64 = 0.25;

/// Largest wind over the induced velocity for which the bent jet holds.
pub(crate) const MOST_WIND: f64 = 0.4;

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "crossflow",
    aliases: &["ambient_wind", "jet_in_crossflow"],
    equation: "integral jet in a wind (W_x, W_y): dM_x/ds = W dQ/ds + F, Q' = 2 pi b (alpha |u - W cos| + 0.34 |W sin|)",
    description: "wind bends the jet downwind, weakens it, and leaves a level flow beside it",
    parameters: &[
        // The fastest induced velocity known here is 14 m/s; beyond `MOST_WIND` of it the model
        // does not hold.
        Parameter {
            fit_over: FitOver::InducedVelocity,
            ..Parameter::new("wind_mps", &["wind_x", "wind_y"], "m/s", [-10.0, 10.0])
                .fit(-MOST_WIND, MOST_WIND)
        },
    ],
    essential: 2,
    home: Home::Jet,
    treatment: |_| Treatment::Exact,
    get: |effects| Some(effects.crossflow?.wind_mps.to_vec()),
    set: |effects, p| {
        effects.crossflow = Some(Crossflow {
            wind_mps: [p[0], p[1]],
        });
    },
};

/// A steady horizontal wind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Crossflow {
    /// Wind, x and y of the world (m/s).
    pub wind_mps: [f64; 2],
}

/// Where a bent jet is at a depth, what of it is left, and how it is tilted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlumeSection {
    /// Drift downwind (l).
    pub(crate) drift: f64,
    /// Speed along the axis over that in still air.
    pub(crate) speed: f64,
    /// Width over that in still air.
    pub(crate) width: f64,
    /// Sine and cosine of the tilt from the vertical.
    pub(crate) tilt: [f64; 2],
}

/// One bent jet by depth.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Plume {
    sections: Vec<PlumeSection>,
    /// It came to [`DEEPEST`] before it levelled off.
    goes_on: bool,
}

impl Plume {
    /// Follows the jet in a wind of `wind` induced velocities.
    #[must_use]
    pub(crate) fn new(jet: &Jet, wind: f64) -> Plume {
        let alpha = 0.5 * TOP_HAT * jet.spreading;
        let radius = |s: f64| TOP_HAT * jet.spreading * (s - jet.origin);
        let momentum = jet.momentum();
        // State: volume flux, momentum downwind and down, drift, depth.
        let u0 = (momentum / PI).sqrt() / radius(0.0);
        let mut state = [PI * radius(0.0) * radius(0.0) * u0, 0.0, momentum, 0.0, 0.0];
        let rate = |[q, mx, mz, _, _]: [f64; 5]| {
            let m = mx.hypot(mz);
            let u = m / q;
            let b = (q / (PI * u)).sqrt();
            let (sin, cos) = (mz / m, mx / m); // to the wind
            let normal = wind * sin;
            let dq =
                2.0 * PI * b * (alpha * (u - wind * cos).abs() + NORMAL_ENTRAINMENT * normal.abs());
            let force = DRAG * b * normal * normal;
            [dq, wind * dq + force * sin, -force * cos, cos, sin]
        };
        let still_u = |s: f64| (momentum / PI).sqrt() / radius(s);
        let section = |[q, mx, mz, drift, depth]: [f64; 5]| {
            let m = mx.hypot(mz);
            let u = m / q;
            PlumeSection {
                drift,
                speed: u / still_u(depth),
                width: (q / (PI * u)).sqrt() / radius(depth),
                tilt: [mx / m, mz / m],
            }
        };
        let mut sections = vec![section(state)];
        let mut arc = 0.0;
        while arc < LONGEST && state[4] < DEEPEST {
            let before = state;
            // Midpoint rule.
            let half = rate(state);
            let mut middle = state;
            middle
                .iter_mut()
                .zip(half)
                .for_each(|(x, d)| *x += 0.5 * STEP * d);
            let full = rate(middle);
            state.iter_mut().zip(full).for_each(|(x, d)| *x += STEP * d);
            arc += STEP;
            let mut next = sections.len() as f64 * SPACING;
            while state[4] >= next {
                let share = (next - before[4]) / (state[4] - before[4]);
                let mut between = before;
                between
                    .iter_mut()
                    .zip(state)
                    .for_each(|(x, to)| *x += share * (to - *x));
                sections.push(section(between));
                next = sections.len() as f64 * SPACING;
            }
        }
        Plume {
            sections,
            goes_on: state[4] >= DEEPEST,
        }
    }

    /// The jet at a depth (l), linear between the entries of the table; `None` where the wind has
    /// taken it away before. Below the table it goes on as it ends there, straight and no weaker
    /// against the jet in still air: no measurement reaches so far down.
    pub(crate) fn at(&self, s: f64) -> Option<PlumeSection> {
        let place = (s / SPACING).max(0.0);
        let before = place as usize;
        let Some(&a) = self.sections.get(before) else {
            let last = *self.sections.last().filter(|_| self.goes_on)?;
            let below = s - (self.sections.len() - 1) as f64 * SPACING;
            let [sin, cos] = last.tilt;
            return Some(PlumeSection {
                drift: last.drift + below * sin / cos,
                ..last
            });
        };
        let share = place - before as f64;
        let Some(b) = self.sections.get(before + 1) else {
            let [sin, cos] = a.tilt;
            return Some(PlumeSection {
                drift: a.drift + share * SPACING * sin / cos,
                ..a
            });
        };
        let mix = |a: f64, b: f64| a + share * (b - a);
        Some(PlumeSection {
            drift: mix(a.drift, b.drift),
            speed: mix(a.speed, b.speed),
            width: mix(a.width, b.width),
            tilt: [mix(a.tilt[0], b.tilt[0]), mix(a.tilt[1], b.tilt[1])],
        })
    }

    /// Depth (l) from which on the wind has taken the jet away: it lies level. `None`: nowhere
    /// within the table.
    #[must_use]
    pub(crate) fn gone_from(&self) -> Option<f64> {
        (!self.goes_on).then_some(self.sections.len() as f64 * SPACING)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_wind_the_jet_is_the_paper_s() {
        let plume = Plume::new(&Jet::default(), 0.0);
        for s in [0.0, 2.5, 7.3, 20.0] {
            let section = plume.at(s).expect("it reaches there");
            // The midpoint rule's error over 400 steps.
            assert!(
                (section.speed - 1.0).abs() < 2e-4 && (section.width - 1.0).abs() < 2e-4,
                "{section:?}"
            );
            assert_eq!(section.drift, 0.0);
        }
    }

    #[test]
    fn a_weak_wind_drifts_it_by_the_closed_form_and_a_stronger_one_by_more() {
        let c = |wind: f64, s: f64| {
            let plume = Plume::new(&Jet::default(), wind);
            plume.at(s).expect("it reaches there").drift * 2.0 * 10.11 / (wind * s * s)
        };
        // Integral model with this closure: 2.3 at W = 0.02 U_H and 6 l, growing with wind and
        // depth; 8 % by the choice of the drag.
        for (wind, s, expected) in [
            (0.02, 6.0, 2.3),
            (0.05, 6.0, 3.0),
            (0.10, 6.0, 4.6),
            (0.02, 10.0, 2.35),
            (0.10, 10.0, 5.5),
        ] {
            let found = c(wind, s);
            assert!(
                (found / expected - 1.0).abs() < 0.15,
                "W = {wind}, s = {s}: {found}, not {expected}"
            );
        }
    }
}
