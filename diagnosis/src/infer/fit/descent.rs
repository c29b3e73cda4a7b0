//! The way down from one start: Levenberg-Marquardt within bounds, with slopes that each step
//! mends.
//!
//! A prediction is what takes long, and slopes by differences take one for each parameter. They are
//! measured where a descent begins and where the best one ends. In between each step tells how far
//! off they were along it, and is made to fit with the least change of them (C. G. Broyden, "A
//! class of methods for solving nonlinear simultaneous equations", Mathematics of Computation 19,
//! 1965).

use nalgebra::DMatrix;

use super::{Fit, Setting, bounded_step, normal_equations, parameters};
use crate::infer::candidates::{Candidate, Parameter};
use crate::statistics::quantile::difference;
use crate::statistics::robust::weight;

/// Most iterations of a fit, and the relative gain in cost at which it stops.
const ITERATIONS: usize = 25;
const ENOUGH: f64 = 1e-4;
/// Dampings that are tried in one iteration before it counts as converged.
const DAMPINGS: usize = 6;
/// Step of a difference quotient, in parts of what matters of a parameter.
const DIFFERENCE: f64 = 0.02;

/// A fit on its way down from a start.
pub(super) struct Descent<'a> {
    setting: &'a Setting<'a>,
    candidates: &'a [&'a Candidate],
    parameters: Vec<Parameter>,
    bounds: Vec<[f64; 2]>,
    /// Values, and each instrument's gain and offset.
    at: Vec<f64>,
    /// Predicted before gain and offset.
    plain: Vec<f64>,
    whitened: Vec<f64>,
    pub(super) cost: f64,
    slopes: Slopes,
    damping: f64,
    /// Iterations that are left.
    left: usize,
}

impl<'a> Descent<'a> {
    pub(super) fn from(
        setting: &'a Setting<'a>,
        candidates: &'a [&'a Candidate],
        start: &[f64],
    ) -> Descent<'a> {
        let parameters = parameters(candidates);
        let plain = setting.predicted(candidates, start);
        let mut at = start.to_vec();
        at.extend(vec![0.0; 2 * setting.instruments]);
        let whitened = setting.whitened(&plain, &at);
        let mut descent = Descent {
            setting,
            candidates,
            bounds: setting.bounds(&parameters),
            parameters,
            cost: setting.cost(&whitened, &at),
            at,
            plain,
            whitened,
            slopes: Slopes::default(),
            damping: 1e-3,
            left: ITERATIONS,
        };
        descent.measure();
        descent
    }

    /// Slopes by differences.
    fn measure(&mut self) {
        let predict = |at: &[f64]| self.predicted(at);
        self.slopes = Slopes::measured(&self.parameters, &self.at, &self.plain, &predict);
    }

    fn predicted(&self, at: &[f64]) -> Vec<f64> {
        let count = self.parameters.len();
        self.setting.predicted(self.candidates, &at[..count])
    }

    /// As far as the slopes lead that are measured last.
    pub(super) fn go_down(&mut self) {
        while self.left > 0 && self.step() {}
    }

    /// Where not even slopes that are measured there lead further.
    pub(super) fn settled(mut self) -> Fit {
        self.go_down();
        while self.left > 0 && !self.slopes.is_measured {
            self.measure();
            self.go_down();
        }
        if !self.slopes.is_measured {
            self.measure();
        }
        let jacobian = self.jacobian();
        let count = self.parameters.len();
        let tolerance = self.setting.tolerance_in(&self.at).to_vec();
        self.at.truncate(count);
        Fit {
            predicted: self.setting.read(&self.plain, &tolerance),
            values: self.at,
            tolerance,
            whitened: self.whitened,
            jacobian,
            cost: self.cost,
        }
    }

    /// Whether a step led on.
    fn step(&mut self) -> bool {
        self.left -= 1;
        let weights: Vec<f64> = self.whitened.iter().map(|e| weight(*e)).collect();
        let errors = (&self.whitened[..], &weights[..]);
        let spreads = self.setting.wide_spreads();
        let (normal, gradient) = normal_equations(&self.jacobian(), errors, &self.at, &spreads);
        let enough = ENOUGH * self.cost.max(1.0);
        // Slopes that were brought up to date may be why a step fails.
        let dampings = if self.slopes.is_measured { DAMPINGS } else { 1 };
        for _ in 0..dampings {
            let step = bounded_step(&normal, &gradient, &self.at, &self.bounds, self.damping);
            let ends = self.bounds.iter().zip(self.at.iter().zip(&step));
            let next: Vec<f64> = ends
                .map(|([low, high], (at, step))| (at + step).clamp(*low, *high))
                .collect();
            // Gain and offset act after the air: the air need not be asked again for them alone.
            let count = self.parameters.len();
            let moved = next[..count] != self.at[..count];
            let plain = if moved {
                self.predicted(&next)
            } else {
                self.plain.clone()
            };
            let whitened = self.setting.whitened(&plain, &next);
            let cost = self.setting.cost(&whitened, &next);
            if cost < self.cost {
                let leads_on = self.cost - cost > enough;
                if moved && leads_on {
                    let change = difference(&plain, &self.plain);
                    self.slopes
                        .update(&self.parameters, [&self.at, &next], change);
                }
                (self.at, self.plain) = (next, plain);
                (self.whitened, self.cost) = (whitened, cost);
                self.damping = (self.damping * 0.2).max(1e-9);
                return leads_on;
            }
            let promised = 2.0 * gradient.dot(&step) - step.dot(&(&normal * &step));
            if promised <= enough {
                return false;
            }
            self.damping = (self.damping * 8.0).min(1e9);
        }
        false
    }

    /// Change of the whitened prediction with each parameter, gains and offsets last.
    fn jacobian(&self) -> DMatrix<f64> {
        let setting = self.setting;
        let mut gains = setting.tolerance_in(&self.at).to_vec();
        gains.iter_mut().for_each(|[_, offset]| *offset = 0.0);
        let of_parameters = self.slopes.columns.iter();
        let mut columns: Vec<Vec<f64>> = of_parameters
            .map(|column| setting.read(column, &gains))
            .collect();
        let instruments = 0..setting.instruments;
        columns.extend(instruments.flat_map(|which| setting.of_instrument(&self.plain, which)));
        let noise = setting.noise;
        let plain: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let whitened = noise.whiten_all(&plain).concat();
        DMatrix::from_vec(self.plain.len(), columns.len(), whitened)
    }
}

/// Change of the prediction, before gain and offset, with each of the candidates' parameters.
#[derive(Default)]
struct Slopes {
    columns: Vec<Vec<f64>>,
    /// By differences, and not brought up to date since.
    is_measured: bool,
}

impl Slopes {
    /// By differences at a point, where the prediction is `plain`.
    fn measured(
        parameters: &[Parameter],
        at: &[f64],
        plain: &[f64],
        clean: &impl Fn(&[f64]) -> Vec<f64>,
    ) -> Slopes {
        let column = |(j, parameter): (usize, &Parameter)| {
            let mut step = DIFFERENCE * parameter.practical;
            if at[j] + step > parameter.high {
                step = -step;
            }
            let mut moved = at.to_vec();
            moved[j] += step;
            let changed = clean(&moved);
            let pairs = changed.iter().zip(plain);
            pairs.map(|(to, from)| (to - from) / step).collect()
        };
        Slopes {
            columns: parameters.iter().enumerate().map(column).collect(),
            is_measured: true,
        }
    }

    /// The least change of them, in parts of what matters of each parameter, with which they tell
    /// the step that was taken: so much `change` of the prediction.
    fn update(&mut self, parameters: &[Parameter], [from, to]: [&[f64]; 2], change: Vec<f64>) {
        let step: Vec<f64> = (0..parameters.len()).map(|j| to[j] - from[j]).collect();
        let scaled = |j: usize| step[j] / parameters[j].practical;
        let square: f64 = (0..step.len()).map(|j| scaled(j) * scaled(j)).sum();
        let mut missed = change;
        for (column, step) in self.columns.iter().zip(&step) {
            let told = missed.iter_mut().zip(column);
            told.for_each(|(missed, slope)| *missed -= slope * step);
        }
        for (j, column) in self.columns.iter_mut().enumerate() {
            let share = scaled(j) / parameters[j].practical / square;
            let pairs = column.iter_mut().zip(&missed);
            pairs.for_each(|(slope, missed)| *slope += share * missed);
        }
        self.is_measured = false;
    }
}
