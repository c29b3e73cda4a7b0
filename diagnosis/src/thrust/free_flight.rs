//! Rows at which a drone's thrust follows from its specific force alone: no drone above, the floor
//! far away.
//!
//! There, `m a_z = T z_z` with `a` the specific force and `z_z` the vertical part of the body's
//! axis: whatever is left over is the thrust map's fault, not the air's.

use std::borrow::Cow;

use airflow::FarField;
use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use crate::record::recording::{Recording, Track, Vehicle};
use crate::record::thrust_map::{FULL_CELL_V, Term, ThrustMap};
use crate::record::track::ThrustSource;
use crate::thrust::low_pass::{self, LowPass};

/// A drone counts as flying in undisturbed air where no other drone is closer than this, measured
/// horizontally (m) ... Chosen here, for drones of 0.1 m.
pub(crate) const BESIDE_M: f64 = 0.8;
/// ... nor than so many half-widths of its jet, where it is above ... Chosen here: there the jet
/// has less than a twentieth of its speed on the axis.
const BESIDE_HALF_WIDTHS: f64 = 3.0;
/// ... unless it is lower by more than this (m). Chosen here, for the same drones.
const BELOW_M: f64 = 0.1;
/// ... and its own height above the floor (m) is more than this. Chosen here: ground effect is
/// below a tenth of a percent (`(R/4z)²` with `R` a rotor's radius).
pub(crate) const ABOVE_FLOOR_M: f64 = 0.35;

/// What is around a vehicle at an entry of its track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Around {
    /// In undisturbed air: no drone near, none above, the floor far away.
    Free,
    /// A drone is above, close to its axis.
    Below,
    /// Neither.
    Between,
    /// Some drone's place is not known.
    Unknown,
}

/// What is around a vehicle at every entry of its track; "below" is with another drone higher and
/// horizontally closer than `under_m`.
fn around(recording: &Recording, vehicle: usize, under_m: f64) -> Vec<Around> {
    let track = &recording.vehicles[vehicle].track;
    let floor_z_m = recording.environment.floor_z_m.unwrap_or(0.0);
    let jet = |of: &Vehicle| {
        let (length_m, wide) = (of.airframe.motor_distance_m(), of.airframe.width_factor());
        FarField::new(1.0, length_m, wide, &recording.jet)
    };
    let jets: Vec<FarField> = recording.vehicles.iter().map(jet).collect();
    let entry = |(&t_s, position_m): (&f64, &nalgebra::Point3<f64>)| {
        let mut clear = position_m.z - floor_z_m > ABOVE_FLOOR_M;
        let mut below = false;
        for (index, other) in recording.vehicles.iter().enumerate() {
            if index == vehicle {
                continue;
            }
            let Some(moment) = other.track.moment(t_s) else {
                return Around::Unknown;
            };
            let apart_m: Vector3<f64> = other.track.position_at(moment) - position_m;
            let beside_m = apart_m.x.hypot(apart_m.y);
            below |= apart_m.z > 0.0 && beside_m < under_m;
            let depth_m = apart_m.z.max(jets[index].from_m());
            let wide_m = BESIDE_HALF_WIDTHS * jets[index].half_width_m(depth_m).unwrap_or(0.0);
            clear &= beside_m > wide_m.max(BESIDE_M) || apart_m.z < -BELOW_M;
        }
        match (below, clear) {
            (true, _) => Around::Below,
            (false, true) => Around::Free,
            (false, false) => Around::Between,
        }
    };
    track.t_s.iter().zip(&track.position_m).map(entry).collect()
}

/// One vehicle's flight, ready to identify its thrust map and to judge the force on it.
#[derive(Clone, Debug)]
pub(crate) struct Trace<'a> {
    pub(crate) recording: usize,
    pub(crate) vehicle: usize,
    pub(crate) of: &'a Vehicle,
    pub(crate) around: Vec<Around>,
    /// Mass times vertical specific force (N), low-passed; not a number where it is not known.
    pub(crate) lift_n: Vec<f64>,
    /// Vertical part of the body's axis.
    pub(crate) upright: Vec<f64>,
    pub(crate) source: ThrustSource,
    /// What a thrust map takes for duty cycle and battery (V).
    motors: Cow<'a, [[f64; 4]]>,
    battery_v: Cow<'a, [f64]>,
    /// Vertical thrust (N) that needs no map: beside a ready force.
    ready_n: Option<Vec<f64>>,
    runs: Vec<std::ops::Range<usize>>,
    low_pass: LowPass,
}

/// Free flight (s) below which a drone's thrust is not compared with its airframe's. Chosen here:
/// tens of times what the low-pass remembers.
const SCALED_S: f64 = 5.0;

/// How much more a drone's rotors give in one flight than its airframe's map says, from so much
/// free flight (s): sums of lift times thrust, and of thrust squared. `None`: too little.
pub(crate) fn scale(free_s: f64, [both, square]: [f64; 2]) -> Option<f64> {
    let scale = both / square;
    (free_s >= SCALED_S && scale.is_finite() && scale > 0.0).then_some(scale)
}

/// Thrust (N) by a map, lag and all, at every entry of a track, from what stands for its duty cycle
/// and battery voltage; not a number where one of them is not, and the lag starts afresh after such
/// a row or a gap.
fn lagged_n(map: &ThrustMap, (duty, battery_v): (&[[f64; 4]], &[f64]), track: &Track) -> Vec<f64> {
    let steady_n = |(&duty, &v): (&[f64; 4], &f64)| map.steady_n(duty, v);
    let mut thrust_n: Vec<f64> = duty.iter().zip(battery_v).map(steady_n).collect();
    let runs = low_pass::runs(&track.t_s, track.longest_step_s, |row| {
        thrust_n[row].is_finite()
    });
    for run in runs {
        low_pass::lag(map.lag_s(), &track.t_s[run.clone()], &mut thrust_n[run]);
    }
    thrust_n
}

/// Speed of sound (m/s) at 15 °C, by which tips of rotors are made shares: no propeller's tips
/// reach it.
const SOUND_MPS: f64 = 340.3;
/// Logged thrust is made a share of so many weights. Chosen here: beyond any drone's.
const MOST_WEIGHTS: f64 = 8.0;

/// What stands for the duty cycles of a vehicle, each a share of what is never reached.
fn motors(source: ThrustSource, of: &Vehicle, weight_n: f64) -> Option<Cow<'_, [[f64; 4]]>> {
    let track = &of.track;
    Some(match source {
        ThrustSource::DutyCycle => Cow::Borrowed(track.duty.as_deref()?),
        ThrustSource::RotorSpeed => {
            let per_radps = 0.5 * of.airframe.propeller_diameter_m() / SOUND_MPS;
            let share = |radps: &[f64; 4]| radps.map(|radps| radps * per_radps);
            track
                .rotor_speed_radps
                .as_ref()?
                .iter()
                .map(share)
                .collect()
        }
        ThrustSource::Thrust => {
            let share = |thrust_n: &f64| [thrust_n / (MOST_WEIGHTS * weight_n); 4];
            track.thrust_n.as_ref()?.iter().map(share).collect()
        }
        ThrustSource::ReadyForce => vec![[0.0; 4]; track.t_s.len()].into(),
    })
}

impl<'a> Trace<'a> {
    /// Every vehicle that logs what a force needs, recordings in the given order;
    /// [`Around::Below`] is within `under_m` (m) of another drone's axis.
    pub(crate) fn of_all(
        recordings: &'a [Recording],
        in_order: &[usize],
        under_m: f64,
        low_pass: LowPass,
    ) -> Vec<Trace<'a>> {
        let vehicles =
            |&index: &usize| (0..recordings[index].vehicles.len()).map(move |v| (index, v));
        let all = in_order.iter().flat_map(vehicles).collect();
        Trace::of_each(recordings, all, under_m, low_pass)
    }

    /// Some vehicles, by recording and vehicle, as [`Trace::of_all`]; those that do not log a force
    /// are passed over.
    pub(crate) fn of_each(
        recordings: &'a [Recording],
        vehicles: Vec<(usize, usize)>,
        under_m: f64,
        low_pass: LowPass,
    ) -> Vec<Trace<'a>> {
        let trace = |(recording, vehicle): (usize, usize)| {
            let around = around(recordings.get(recording)?, vehicle, under_m);
            Trace::new(recordings, (recording, vehicle), around, low_pass)
        };
        vehicles.into_par_iter().filter_map(trace).collect()
    }

    /// `None` without specific force and a thrust source, or a ready force.
    fn new(
        recordings: &'a [Recording],
        (recording, vehicle): (usize, usize),
        around: Vec<Around>,
        low_pass: LowPass,
    ) -> Option<Trace<'a>> {
        let of = recordings.get(recording)?.vehicles.get(vehicle)?;
        let track = &of.track;
        let source = track.thrust_source()?;
        let mass_kg = of.airframe.mass_kg();
        let weight_n = mass_kg * recordings[recording].environment.gravity_mps2;
        let motors = motors(source, of, weight_n)?;
        // Of a source that does not depend on it, any is as good.
        let battery_v = match (&track.battery_v, source) {
            (Some(battery_v), ThrustSource::DutyCycle) => Cow::Borrowed(battery_v.as_slice()),
            _ => vec![FULL_CELL_V; track.t_s.len()].into(),
        };
        let attitudes = track.attitude.iter();
        let upright = attitudes.map(|body_to_world| (body_to_world * Vector3::z()).z);
        let upright: Vec<f64> = upright.collect();
        let ready_n = track.force_n.as_ref();
        let ready_n = ready_n.filter(|_| source == ThrustSource::ReadyForce);
        let (logged_n, ready_n): (Vec<f64>, Option<Vec<f64>>) = match ready_n {
            None => {
                let force = track.specific_force_mps2.as_ref()?;
                (
                    force.iter().map(|a_mps2| mass_kg * a_mps2.z).collect(),
                    None,
                )
            }
            Some(force_n) => {
                // Thrust as logged, or that of hover.
                let thrust_n: Vec<f64> = match &track.thrust_n {
                    Some(thrust_n) => thrust_n.iter().zip(&upright).map(|(t, z)| t * z).collect(),
                    None => vec![weight_n; track.t_s.len()],
                };
                let both = force_n.iter().zip(&thrust_n);
                let lift_n = both.map(|(force_n, thrust_n)| force_n.z + thrust_n);
                (lift_n.collect(), Some(thrust_n))
            }
        };
        let runs = low_pass::runs(&track.t_s, track.longest_step_s, |row| {
            let motors = motors[row].iter().sum::<f64>();
            (logged_n[row] + upright[row] + battery_v[row] + motors).is_finite()
        });
        let mut lift_n = vec![f64::NAN; track.t_s.len()];
        for run in &runs {
            let smooth_n = &mut lift_n[run.clone()];
            smooth_n.copy_from_slice(&logged_n[run.clone()]);
            low_pass.smooth(&track.t_s[run.clone()], smooth_n);
        }
        Some(Trace {
            recording,
            vehicle,
            of,
            around,
            lift_n,
            upright,
            source,
            motors,
            battery_v,
            ready_n,
            runs,
            low_pass,
        })
    }

    /// Name of its airframe: drones of one airframe share a thrust map.
    pub(crate) fn airframe(&self) -> &'a str {
        self.of.airframe.name()
    }

    /// Entries at which the thrust map can be identified, in order.
    pub(crate) fn free_rows(&self) -> impl Iterator<Item = usize> + '_ {
        let rows = self.around.iter().zip(&self.lift_n).enumerate();
        rows.filter(|(_, (around, lift_n))| **around == Around::Free && lift_n.is_finite())
            .map(|(row, _)| row)
    }

    /// How long it flies free (s), at the rate of its track.
    pub(crate) fn free_s(&self) -> f64 {
        let t_s = &self.of.track.t_s;
        let whole_s = t_s
            .first()
            .zip(t_s.last())
            .map_or(0.0, |(from, until)| until - from);
        self.free_rows().count() as f64 * whole_s / (t_s.len() as f64 - 1.0).max(1.0)
    }

    /// What stands for duty cycles, and battery voltages, of [`Trace::free_rows`].
    pub(crate) fn free_duty(&self) -> impl Iterator<Item = ([f64; 4], f64)> + '_ {
        self.free_rows()
            .map(|row| (self.motors[row], self.battery_v[row]))
    }

    /// Vertical part of the thrust (N) by a map, as flown, lag and all; not low-passed. A ready
    /// force needs no map. Drones of one airframe differ, and so do packs: what carries this one in
    /// its own free flight says by how much, if there is enough of that.
    pub(crate) fn thrust_n(&self, map: Option<&ThrustMap>) -> Option<Vec<f64>> {
        if let Some(ready_n) = &self.ready_n {
            return Some(ready_n.clone());
        }
        let mut thrust_n = lagged_n(map?, (&self.motors, &self.battery_v), &self.of.track);
        for (thrust_n, upright) in thrust_n.iter_mut().zip(&self.upright) {
            *thrust_n *= upright;
        }
        let mut smooth_n = thrust_n.clone();
        self.smooth(self.low_pass, &mut smooth_n);
        let (mut both, mut square) = (0.0, 0.0);
        for row in self.free_rows() {
            both += self.lift_n[row] * smooth_n[row];
            square += smooth_n[row] * smooth_n[row];
        }
        if let Some(scale) = scale(self.free_s(), [both, square]) {
            thrust_n.iter_mut().for_each(|thrust_n| *thrust_n *= scale);
        }
        Some(thrust_n)
    }

    /// Whether all motors of an entry are within the range that a map was fitted in.
    pub(crate) fn is_covered(&self, map: &ThrustMap, row: usize) -> bool {
        map.covers(self.motors[row])
    }

    /// Low-passes a series within the runs of this trace.
    pub(crate) fn smooth(&self, low_pass: LowPass, values: &mut [f64]) {
        for run in &self.runs {
            low_pass.smooth(&self.of.track.t_s[run.clone()], &mut values[run.clone()]);
        }
    }

    /// Products over the free rows of everything that a least-squares fit needs: `Σ z zᵀ` with `z`
    /// the terms' values (lagged, made vertical, low-passed), the lift minus what `base` gives, and
    /// 1.
    pub(crate) fn gram(
        &self,
        terms: &[Term],
        (base, reference_v): (Option<&ThrustMap>, f64),
        lag_s: f64,
        low_pass: LowPass,
    ) -> DMatrix<f64> {
        let ready = |mut column: Vec<f64>| {
            for run in &self.runs {
                let t_s = &self.of.track.t_s[run.clone()];
                low_pass::lag(lag_s, t_s, &mut column[run.clone()]);
            }
            for (value, upright) in column.iter_mut().zip(&self.upright) {
                *value *= upright;
            }
            self.smooth(low_pass, &mut column);
            column
        };
        let inputs = || self.motors.iter().zip(self.battery_v.iter());
        let of_term = |term: &Term| {
            let value = |(&duty, v): (&[f64; 4], &f64)| term.over_motors(duty, v / reference_v);
            ready(inputs().map(value).collect())
        };
        let mut columns: Vec<Vec<f64>> = terms.iter().map(of_term).collect();
        let mut left_n = self.lift_n.clone();
        if let Some(base) = base {
            let steady_n = inputs().map(|(&duty, &v)| base.steady_n(duty, v)).collect();
            for (left_n, base_n) in left_n.iter_mut().zip(ready(steady_n)) {
                *left_n -= base_n;
            }
        }
        columns.push(left_n);
        let width = columns.len() + 1;
        let mut gram = DMatrix::zeros(width, width);
        let mut values = DVector::from_element(width, 1.0);
        for row in self.free_rows() {
            for (value, column) in values.iter_mut().zip(&columns) {
                *value = column[row];
            }
            gram.syger(1.0, &values, &values, 1.0);
        }
        gram.fill_upper_triangle_with_lower_triangle();
        gram
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lag_starts_afresh_after_a_gap() {
        let track = Track {
            t_s: vec![0.0, 0.02, 1.0, 1.02],
            longest_step_s: 0.05,
            ..Track::default()
        };
        let map = ThrustMap::new(vec![(Term::new(1, 1), 0.1)], 4.2, 0.05, [0.1, 0.9]);
        let map = map.expect("valid");
        let duty = [[0.2; 4], [0.5; 4], [0.8; 4], [0.8; 4]];
        let thrust_n = lagged_n(&map, (&duty, &[4.2; 4]), &track);
        assert!(thrust_n[1] < map.steady_n([0.5; 4], 4.2));
        assert_eq!(thrust_n[2], map.steady_n([0.8; 4], 4.2));
        assert_eq!(map.rows_outside(&duty), 0);
    }
}
