//! What instruments make of the air: magnitude, lag, calibration, faults, noise, steps of the
//! reading.

use nalgebra::Vector3;

use super::air::World;
use super::noise::{Gust, Noise};
use diagnosis::statistics::draws::Draws;

/// A fault of an instrument or of a clock; the default is none.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Faults {
    pub(crate) gain: f64,
    pub(crate) offset: f64,
    pub(crate) gain_per_h: f64,
    pub(crate) offset_per_h: f64,
    pub(crate) lag_s: f64,
    pub(crate) highest: f64,
    /// What is read at `t` was there at `t + clock_s` of the drones' clock.
    pub(crate) clock_s: f64,
    /// Before this time (s since the first reading) gain, offset and clock are right.
    pub(crate) from_s: f64,
    /// What no library has.
    pub(crate) odd: Odd,
}

/// Failures of an instrument that no library holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Odd {
    None,
    /// It reads `reference (y/reference)^power`.
    Bent {
        power: f64,
        reference: f64,
    },
    /// It does not turn below a speed (m/s).
    Starts {
        at_mps: f64,
    },
    /// A loose contact: within spans of time (s) it reads a part only.
    Loose {
        part: f64,
        spans_s: Vec<[f64; 2]>,
    },
}

impl Default for Faults {
    fn default() -> Faults {
        Faults {
            gain: 0.0,
            offset: 0.0,
            gain_per_h: 0.0,
            offset_per_h: 0.0,
            lag_s: 0.0,
            highest: f64::INFINITY,
            clock_s: 0.0,
            from_s: f64::NEG_INFINITY,
            odd: Odd::None,
        }
    }
}

impl Faults {
    pub(crate) fn makes(&self, value: f64, since_s: f64) -> f64 {
        if since_s < self.from_s {
            return value;
        }
        let hours = since_s / 3600.0;
        let read = (1.0 + self.gain + self.gain_per_h * hours) * value;
        let read = (read + self.offset + self.offset_per_h * hours).min(self.highest);
        let is_within = |span: &&[f64; 2]| (span[0]..span[1]).contains(&since_s);
        match &self.odd {
            Odd::Bent { power, reference } => reference * (read.max(0.0) / reference).powf(*power),
            Odd::Starts { at_mps } if read < *at_mps => 0.0,
            Odd::Loose { part, spans_s } if spans_s.iter().find(is_within).is_some() => part * read,
            Odd::None | Odd::Starts { .. } | Odd::Loose { .. } => read,
        }
    }

    /// How far (s) the drones' clock is ahead at a time since the first reading (s).
    pub(crate) fn ahead_s(&self, since_s: f64) -> f64 {
        match since_s < self.from_s {
            true => 0.0,
            false => self.clock_s,
        }
    }
}

/// A speed probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Instrument {
    pub(crate) rate_hz: f64,
    /// Low-pass that its maker states (s).
    pub(crate) lowpass_s: f64,
    /// Steady speed (m/s) of the surroundings, which it reads in quadrature.
    pub(crate) ambient_mps: f64,
    pub(crate) resolution_mps: f64,
    /// This one's own error within its accuracy.
    pub(crate) own_gain: f64,
    pub(crate) own_offset_mps: f64,
}

/// What one probe reads over a flight.
#[derive(Clone, Debug, Default)]
pub(crate) struct Readings {
    pub(crate) t_s: Vec<f64>,
    /// Without noise and without the error that its maker allows.
    pub(crate) clean: Vec<f64>,
    /// What the logger writes.
    pub(crate) logged: Vec<f64>,
}

/// Longest step (s) of the air that a slow probe is carried through, by the mean of both its ends.
const FINE_S: f64 = 0.02;

impl Instrument {
    /// Reads from one second after the start to the end. With no noise, `logged` is `clean`.
    pub(crate) fn read(
        &self,
        world: &World,
        place_m: impl Fn(f64) -> Vector3<f64>,
        end_s: f64,
        faults: &Faults,
        noise: Option<(&Noise, &mut Draws)>,
    ) -> Readings {
        let speed = |t_s: f64| {
            let at_s = t_s + faults.ahead_s(t_s - 1.0);
            let velocity_mps = world.velocity_mps(at_s, place_m(t_s));
            (velocity_mps.norm_squared() + self.ambient_mps * self.ambient_mps).sqrt()
        };
        let lags_s = [self.lowpass_s, faults.lag_s];
        let is_slow = lags_s.iter().any(|&lag_s| lag_s > 0.0);
        let step_s = 1.0 / self.rate_hz;
        let parts = if is_slow {
            (step_s / FINE_S).ceil().max(1.0)
        } else {
            1.0
        };
        let fine_s = step_s / parts;
        let mut readings = Readings::default();
        let mut noise = noise.map(|(noise, random)| (noise, Gust::new(random), random));
        // Clean and noisy, through both low-passes.
        let mut held: Option<[[[f64; 2]; 2]; 2]> = None;
        for i in 0..((end_s - 1.0) * self.rate_hz) as usize {
            let t_s = 1.0 + i as f64 * step_s;
            let mut now = [0.0; 2];
            for part in 1..=parts as usize {
                let at_s = t_s - step_s + part as f64 * fine_s;
                let clean = speed(at_s);
                let gust = noise.as_mut().map_or(0.0, |(noise, gust, random)| {
                    noise.turbulence * gust.at(at_s, noise.memory_s, random)
                });
                now = [clean, clean * (1.0 + gust)];
                // What went in last and what came out, one stage after the other.
                let state = held.get_or_insert([[now; 2]; 2]);
                for (stage, lag_s) in lags_s.iter().enumerate().filter(|it| *it.1 > 0.0) {
                    let taken = 1.0 - (-fine_s / lag_s).exp();
                    let [went_in, held] = &mut state[stage];
                    let before = std::mem::replace(went_in, now);
                    for ((held, before), now) in held.iter_mut().zip(before).zip(&mut now) {
                        *held += taken * (0.5 * (before + *now) - *held);
                        *now = *held;
                    }
                }
            }
            let since_s = t_s - 1.0;
            let [clean, noisy] = now.map(|value| faults.makes(value, since_s));
            readings.t_s.push(t_s);
            readings.clean.push(clean);
            readings.logged.push(match noise.as_mut() {
                None => clean,
                Some((noise, _, random)) => {
                    let read = (1.0 + self.own_gain) * noisy + self.own_offset_mps;
                    let read = (read + noise.white_draw(random)).min(faults.highest);
                    (read.max(0.0) / self.resolution_mps).round() * self.resolution_mps
                }
            });
        }
        readings
    }
}
