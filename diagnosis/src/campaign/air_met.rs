//! The air that a hypothesis has each drone meet, and the force of it.

use std::collections::VecDeque;
use std::sync::{Arc, PoisonError};

use airflow::effects::{Effects, Reception, Surroundings};
use airflow::{DiscPoints, Superposition, Wake};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::forces::Forces;
use super::steps::{Above, Part, Step};
use crate::forward::hypothesis::Hypothesis;
use crate::forward::low_pass;
use crate::forward::receiver::thrust_ratio;
use crate::record::baseline::{Delay, ReceiverAir, Upper};
use crate::record::recording::{Recording, Role};

/// Effects of the air and a clock (s), and the air (m/s) that they make at every step of every part.
pub(super) type Kept = ((Effects, f64), Arc<Vec<Vec<f64>>>);

/// Airs kept. Chosen here: some megabytes each for an hour of flights, and as many as fits on all threads ask for at a time.
const MOST_KEPT: usize = 24;

impl Forces<'_> {
    /// Forces (N) at every step of every part under a hypothesis.
    #[must_use]
    pub fn at_every_step(&self, hypothesis: &Hypothesis) -> Vec<Vec<f64>> {
        let of_air = of_the_air(&hypothesis.effects);
        let blows = !self.alone || hypothesis.downwash.is_some();
        let factor = hypothesis.downwash.unwrap_or(1.0);
        let is_plain = of_air == Effects::default() && hypothesis.sensor.clock_s == 0.0;
        let known = (blows && !is_plain).then(|| self.moved_air_mps(&of_air, hypothesis));
        let of_part = |(index, part): (usize, &Part)| {
            let air_mps = match (blows, is_plain) {
                (false, _) => vec![0.0; part.steps.len()],
                (true, true) => self.hover_air_mps[index]
                    .iter()
                    .map(|u| factor * u)
                    .collect(),
                (true, false) => {
                    let air_mps = known.iter().flat_map(|known| &known[index]);
                    air_mps.map(|u| factor * u).collect()
                }
            };
            self.forces_n(part, hypothesis, &air_mps)
        };
        let parts: Vec<(usize, &Part)> = self.parts.iter().enumerate().collect();
        parts.into_par_iter().map(of_part).collect()
    }

    /// Air (m/s) at every step of every part, effects on. Many hypotheses differ in what a drone makes of the same air: the last few are kept.
    fn moved_air_mps(&self, of_air: &Effects, hypothesis: &Hypothesis) -> Arc<Vec<Vec<f64>>> {
        let key = (*of_air, hypothesis.sensor.clock_s);
        let find = |kept: &VecDeque<Kept>| {
            let found = kept.iter().find(|(known, _)| *known == key);
            found.map(|(_, air_mps)| Arc::clone(air_mps))
        };
        // A thread that has panicked leaves nothing half done here.
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(air_mps) = find(&kept()) {
            return air_mps;
        }
        let wakes: Vec<Wake> = self.wakes.iter().map(|w| w.with_effects(of_air)).collect();
        let parts = self.parts.par_iter();
        let air_mps = Arc::new(
            parts
                .map(|part| self.air_mps(part, hypothesis, &wakes))
                .collect(),
        );
        let mut kept = kept();
        if kept.len() >= MOST_KEPT {
            kept.pop_front();
        }
        kept.push_back((key, Arc::clone(&air_mps)));
        air_mps
    }

    fn forces_n(&self, part: &Part, hypothesis: &Hypothesis, air_mps: &[f64]) -> Vec<f64> {
        let effects = &hypothesis.effects;
        let law = self.recordings[part.recording].baseline.receiver_law;
        let mut forces_n: Vec<f64> = part
            .steps
            .iter()
            .zip(air_mps)
            .zip(&part.is_needed)
            .map(|((step, air_mps), is_needed)| {
                if !is_needed {
                    return 0.0;
                }
                let velocity_mps = step.velocity_mps;
                let mut alpha = air_mps / part.hover_mps;
                let reception = Reception {
                    height_m: Some(step.height_m),
                    gap_m: None,
                    propeller_radius_m: part.radius_m,
                    voltage_ratio: Some(step.voltage_ratio),
                };
                let mut factor = effects.thrust_ratio(&reception);
                if let Some(motion) = &effects.own_motion {
                    alpha = motion.alpha(alpha, velocity_mps.z / part.hover_mps);
                    let forward = velocity_mps.x.hypot(velocity_mps.y) / part.hover_mps;
                    factor *= motion.thrust_ratio(forward);
                }
                if let Some(battery) = &effects.battery_sag {
                    let throttle = battery.throttle_factor(step.voltage_ratio);
                    factor /= throttle * throttle;
                }
                let left = match effects.receiver_alpha(alpha) {
                    0.0 => 1.0,
                    alpha => thrust_ratio(law, alpha),
                };
                let drag_n = effects.body_drag.map_or(0.0, |drag| {
                    let past_mps = air_mps + velocity_mps.z;
                    drag.force_n(part.density_kg_per_m3, part.length_m, past_mps)
                });
                (left * factor - 1.0) * step.thrust_n + drag_n
            })
            .collect();
        let times_s: Vec<f64> = part.steps.iter().map(|step| step.t_s).collect();
        let sensor = &hypothesis.sensor;
        for run in &part.runs {
            let t_s = &times_s[run.clone()];
            low_pass::lag(sensor.lag_s, t_s, &mut forces_n[run.clone()]);
            self.low_pass.smooth(t_s, &mut forces_n[run.clone()]);
        }
        let began_s = times_s.first().copied().unwrap_or(0.0);
        for (force_n, t_s) in forces_n.iter_mut().zip(&times_s) {
            *force_n = sensor.reads(*force_n, t_s - began_s);
        }
        forces_n
    }

    /// Air (m/s) at every step of a part: over the rotor discs or at the centre, as its baseline declares.
    pub(super) fn air_mps(&self, part: &Part, hypothesis: &Hypothesis, wakes: &[Wake]) -> Vec<f64> {
        let recording = &self.recordings[part.recording];
        let effects = &hypothesis.effects;
        let clock_s = hypothesis.sensor.clock_s;
        let convection = match (effects.wake_transport, recording.baseline.delay) {
            (Some(transport), _) => transport.convection(),
            (None, Delay::Transport { convection }) => Some(convection),
            (None, Delay::None) => None,
        };
        let centre = DiscPoints {
            offsets_m: vec![[0.0; 2]],
            weights: vec![1.0],
        };
        let discs = match recording.baseline.receiver_air {
            ReceiverAir::Centre => &centre,
            ReceiverAir::DiscMean => &part.discs,
        };
        let wake_of = &self.wake_of[part.recording];
        let mut gathered = vec![0.0; discs.weights.len()];
        let mut at_step = |step: &Step| -> f64 {
            gathered.fill(0.0);
            for above in &step.above {
                let Some(wake) = wake_of[above.vehicle].map(|wake| &wakes[wake]) else {
                    continue;
                };
                let moved = match convection.is_some() || clock_s != 0.0 {
                    true => earlier(recording, step, above, wake, convection, clock_s),
                    false => *above,
                };
                let from_emitter_m = step.position_m - moved.position_m;
                if from_emitter_m.z >= 0.0 {
                    continue;
                }
                let at = Surroundings {
                    t_s: step.t_s,
                    climb_mps: moved.velocity_mps.z,
                    floor_z_m: recording.environment.floor_z_m,
                    emitter_z_m: moved.position_m.z,
                };
                for (so_far, &[x, y]) in gathered.iter_mut().zip(&discs.offsets_m) {
                    let offset_m = from_emitter_m + Vector3::new(x, y, 0.0);
                    let down_mps = -effects.meet(wake, offset_m, &at).z;
                    *so_far = match &effects.jet_merging {
                        Some(merging) => merging.gather(*so_far, down_mps),
                        None => match recording.baseline.superposition {
                            Superposition::Momentum => *so_far + down_mps * down_mps,
                            Superposition::Linear => *so_far + down_mps,
                            Superposition::Strongest => so_far.max(down_mps),
                        },
                    };
                }
            }
            let finish =
                |so_far: f64| match (&effects.jet_merging, recording.baseline.superposition) {
                    (Some(merging), _) => merging.finish(so_far),
                    (None, Superposition::Momentum) => so_far.sqrt(),
                    (None, _) => so_far,
                };
            let weighed = discs.weights.iter().zip(&gathered);
            weighed
                .map(|(weight, so_far)| weight * finish(*so_far))
                .sum()
        };
        let steps = part.steps.iter().zip(&part.is_needed);
        steps
            .map(|(step, is_needed)| if *is_needed { at_step(step) } else { 0.0 })
            .collect()
    }
}

/// The effects of the air alone, those of the receiver left out.
fn of_the_air(effects: &Effects) -> Effects {
    Effects {
        ground_effect_thrust: None,
        ceiling_effect: None,
        receiver_inflow: None,
        battery_sag: None,
        body_drag: None,
        own_motion: None,
        ..*effects
    }
}

/// A drone above when the air that arrives left it, on a clock that is ahead.
fn earlier(
    recording: &Recording,
    step: &Step,
    above: &Above,
    wake: &Wake,
    convection: Option<f64>,
    clock_s: f64,
) -> Above {
    let track = &recording.vehicles[above.vehicle].track;
    let mut moved = *above;
    // Four turns, as for single recordings: it contracts by climb speed over jet speed.
    for _ in 0..4 {
        let depth_m = moved.position_m.z - step.position_m.z;
        let ago_s = convection.map_or(0.0, |k| wake.far_field().transport_time_s(depth_m, k));
        let first_s = track.t_s.first().copied().unwrap_or(0.0);
        let Some(moment) = track.moment((step.t_s + clock_s - ago_s).max(first_s)) else {
            return *above;
        };
        moved.position_m = track.position_at(moment);
        moved.velocity_mps = track.velocity_at(moment);
    }
    moved
}

/// The wakes of a campaign, each once, and whose they are.
pub(super) fn wakes(recordings: &[Recording]) -> (Vec<Wake>, Vec<Vec<Option<usize>>>) {
    let mut wakes: Vec<Wake> = Vec::new();
    let mut made: Vec<(usize, usize)> = Vec::new();
    let mut wake_of = Vec::with_capacity(recordings.len());
    for (index, recording) in recordings.iter().enumerate() {
        let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
        let mut of_recording = Vec::with_capacity(recording.vehicles.len());
        for (vehicle, of) in recording.vehicles.iter().enumerate() {
            let same = |&(other, at): &(usize, usize)| {
                let known: &Recording = &recordings[other];
                known.vehicles[at].airframe == of.airframe
                    && known.environment.air == recording.environment.air
                    && known.jet == recording.jet
                    && known.baseline.upper == recording.baseline.upper
            };
            let found = made.iter().position(same).unwrap_or_else(|| {
                let mass_kg = of.airframe.mass_kg();
                let wake = Wake::new(&of.airframe, mass_kg, density_kg_per_m3, &recording.jet);
                wakes.push(match recording.baseline.upper {
                    Upper::FourRotors => wake,
                    Upper::FarFieldExtrapolated => wake.extrapolated(),
                });
                made.push((index, vehicle));
                made.len() - 1
            });
            of_recording.push((of.role != Role::Receiver).then_some(found));
        }
        wake_of.push(of_recording);
    }
    (wakes, wake_of)
}
