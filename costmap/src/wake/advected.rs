//! Wakes that take their time: the air at a depth left its drone a while ago.
//!
//! The search does not ask when exactly. A wake is taken to be below every place that its drone has been at for no longer than its air
//! needs down to there: from at once, as of a wake that hangs below its drone, until the latest. With `λ` the time at the greatest depth
//! of two legs, the receiver may be at `t` in the air that left at `t'` wherever
//!
//! ```text
//! 0 <= t - t' <= λ,      t in the receiver's leg, t' in the emitter's
//! ```
//!
//! That is a convex region of `(t', t)`, and what the receiver is to the emitter is linear in both: its nearest distance to an axis is met
//! on an edge, or is nothing.

use nalgebra::Vector3;

use crate::leg::{KindId, Leg, Tick};
use crate::wake::envelope::nearest_radius_m;
use crate::wake::fleet::{Fleet, Meeting};

/// All that a receiver may be to an emitter whose air comes late.
struct Region {
    /// `(t', t)` in ticks, in order around it.
    corners: Vec<[f64; 2]>,
    /// Receiver minus emitter at each (m).
    offsets_m: Vec<Vector3<f64>>,
    /// Where they are at tick 0 on their lines, and how fast: `offset + t velocity - t' velocity` (m, m/tick).
    origin_m: Vector3<f64>,
    receiver_m: Vector3<f64>,
    emitter_m: Vector3<f64>,
}

/// Place at tick 0 and speed (m, m/tick) of the line that a leg flies on.
fn line(leg: &Leg) -> (Vector3<f64>, Vector3<f64>) {
    if leg.stays() || leg.end <= leg.start {
        return (leg.from_m.coords, Vector3::zeros());
    }
    let velocity_m = (leg.to_m - leg.from_m) / f64::from(leg.end.0 - leg.start.0);
    (
        leg.from_m.coords - velocity_m * f64::from(leg.start.0),
        velocity_m,
    )
}

/// The part of a convex polygon where a linear function is not negative.
fn clip(corners: &[[f64; 2]], value: impl Fn(&[f64; 2]) -> f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::with_capacity(corners.len() + 1);
    for (index, here) in corners.iter().enumerate() {
        let next = &corners[(index + 1) % corners.len()];
        let (a, b) = (value(here), value(next));
        if a >= 0.0 {
            kept.push(*here);
        }
        if (a < 0.0) != (b < 0.0) {
            let share = a / (a - b);
            kept.push([0, 1].map(|axis| here[axis] + share * (next[axis] - here[axis])));
        }
    }
    kept
}

impl Region {
    /// `None` where no air of the emitter's leg can reach the receiver's within `lag` ticks.
    fn new(emitter: &Leg, receiver: &Leg, lag: u32) -> Option<Region> {
        let [left_0, left_1, met_0, met_1] =
            [emitter.start, emitter.end, receiver.start, receiver.end]
                .map(|tick| f64::from(tick.0));
        let lag = f64::from(lag);
        if met_1 <= left_0 || left_1 + lag <= met_0 {
            return None;
        }
        let all = [
            [left_0, met_0],
            [left_1, met_0],
            [left_1, met_1],
            [left_0, met_1],
        ];
        let after = clip(&all, |[left, met]| met - left);
        let corners = clip(&after, |[left, met]| lag - (met - left));
        if corners.is_empty() {
            return None;
        }
        let ((from_m, receiver_m), (emitted_m, emitter_m)) = (line(receiver), line(emitter));
        let mut region = Region {
            corners,
            offsets_m: Vec::new(),
            origin_m: from_m - emitted_m,
            receiver_m,
            emitter_m,
        };
        region.offsets_m = (region.corners.iter())
            .map(|&corner| region.offset_m(corner))
            .collect();
        Some(region)
    }

    fn offset_m(&self, [left, met]: [f64; 2]) -> Vector3<f64> {
        self.origin_m + self.receiver_m * met - self.emitter_m * left
    }

    /// Depths of the receiver below the emitter (m).
    fn depths_m(&self) -> (f64, f64) {
        let depths_m = self.offsets_m.iter().map(|offset_m| -offset_m.z);
        depths_m.fold(
            (f64::INFINITY, f64::NEG_INFINITY),
            |(low, high), depth_m| (low.min(depth_m), high.max(depth_m)),
        )
    }

    /// Smallest horizontal distance from a vertical axis (m).
    fn nearest_m(&self, [x_m, y_m]: [f64; 2]) -> f64 {
        let axis_m = Vector3::new(x_m, y_m, 0.0);
        if self.passes(&axis_m) {
            return 0.0;
        }
        let next = self.offsets_m.iter().cycle().skip(1);
        (self.offsets_m.iter().zip(next))
            .map(|(a_m, b_m)| nearest_radius_m(&(a_m - axis_m), &(b_m - axis_m)))
            .fold(f64::INFINITY, f64::min)
    }

    /// Whether it meets the axis inside. Where both fly along one line, or one stays, the nearest place is on an edge as well.
    fn passes(&self, axis_m: &Vector3<f64>) -> bool {
        let (met_m, left_m) = (self.receiver_m, -self.emitter_m);
        let to_m = axis_m - self.origin_m;
        let turned = met_m.x * left_m.y - met_m.y * left_m.x;
        if turned.abs() <= 1e-12 * met_m.norm() * left_m.norm() {
            return false;
        }
        let met = (to_m.x * left_m.y - to_m.y * left_m.x) / turned;
        let left = (met_m.x * to_m.y - met_m.y * to_m.x) / turned;
        let sides = (self.corners.iter()).zip(self.corners.iter().cycle().skip(1));
        let sides =
            sides.map(|(a, b)| (b[0] - a[0]) * (met - a[1]) - (b[1] - a[1]) * (left - a[0]));
        // Corners go round against the clock.
        sides.fold(f64::INFINITY, f64::min) >= -1e-9
    }
}

impl Fleet {
    /// The kind of the same airframe whose air takes longest to come down.
    pub(crate) fn slowest_like(&self, kind: usize) -> usize {
        let like = |other: &usize| self.kinds[*other].airframe == self.kinds[kind].airframe;
        let speed_mps = |other: &usize| self.wakes[*other].induced_velocity_mps();
        (0..self.kinds.len())
            .filter(like)
            .min_by(|a, b| speed_mps(a).total_cmp(&speed_mps(b)))
            .unwrap_or(kind)
    }

    /// How long air that left a drone of this kind is under way down to a depth, at most (ticks, rounded up); 0 where it takes no time.
    pub(crate) fn lag_ticks(&self, kind: KindId, depth_m: f64) -> u32 {
        let conditions = self.conditions();
        if !conditions.wakes || conditions.flown.convection.is_none() {
            return 0;
        }
        let wake = &self.wakes[self.slowest[usize::from(kind.0)]];
        // One more: plans are written with rounded places.
        Tick::lasting(conditions.flown.lag_s(wake, depth_m)) + 1
    }

    /// How long any wake of the fleet outlasts its drone, at most (ticks).
    pub(crate) fn longest_lag(&self) -> u32 {
        self.longest_lag
    }

    /// How long air is under way from any place of one leg down to any of another, at most (ticks).
    pub(crate) fn lag_between(&self, emitter: &Leg, receiver: &Leg) -> u32 {
        let highest_m = emitter.from_m.z.max(emitter.to_m.z);
        let lowest_m = receiver.from_m.z.min(receiver.to_m.z);
        self.lag_ticks(emitter.kind, highest_m - lowest_m)
    }

    /// Bound on the receiver's budget that air of the emitter's leg fills, whenever it left, in millionths.
    pub(crate) fn late_load(&self, emitter: &Leg, receiver: &Leg, wake_end_z_m: f64) -> u32 {
        let reaches = receiver.from_m.z.max(receiver.to_m.z) >= wake_end_z_m - 1e-6;
        if !self.conditions().wakes || !emitter.flying || !receiver.flying || !reaches {
            return 0;
        }
        let lag = self.lag_between(emitter, receiver);
        let Some(region) = Region::new(emitter, receiver, lag) else {
            return 0;
        };
        let envelope = self.envelope(usize::from(emitter.kind.0), usize::from(receiver.kind.0));
        let square = envelope.highest_among(region.depths_m(), |axis_m| region.nearest_m(axis_m));
        if square == 0.0 {
            return 0;
        }
        self.load_of(emitter, receiver, square)
    }

    /// [`Fleet::meet`], with air that comes late in the loads.
    pub(crate) fn meet_late(&self, first: &Leg, second: &Leg, ends: [f64; 2]) -> Meeting {
        let at_once = self.meet(first, second, ends).unwrap_or_default();
        Meeting {
            load_on_first: at_once
                .load_on_first
                .max(self.late_load(second, first, ends[1])),
            load_on_second: at_once
                .load_on_second
                .max(self.late_load(first, second, ends[0])),
            ..at_once
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leg::DroneId;
    use nalgebra::Point3;

    fn leg(span: (u32, u32), from_m: [f64; 3], to_m: [f64; 3]) -> Leg {
        Leg {
            drone: DroneId(0),
            kind: KindId(0),
            start: Tick(span.0),
            end: Tick(span.1),
            from_m: Point3::from(from_m),
            to_m: Point3::from(to_m),
            flying: true,
            air_limit: 0.3,
        }
    }

    fn at(index: u32) -> f64 {
        (f64::from(index) * 0.754_877_666_246_69).fract()
    }

    #[test]
    fn no_moment_brings_two_legs_nearer_than_their_region_says() {
        for case in 0..400 {
            let value = |k: u32| at(17 * case + k + 1);
            let place = |k: u32| [4.0 * value(k), 4.0 * value(k + 1), 4.0 * value(k + 2)];
            let tick = |k: u32| (200.0 * value(k)) as u32;
            let emitter = leg((tick(0), tick(0) + 1 + tick(1)), place(2), place(5));
            let receiver = leg((tick(8), tick(8) + 1 + tick(9)), place(10), place(13));
            let lag = tick(16);
            let axis_m = [value(3) - 0.5, value(4) - 0.5];
            let region = Region::new(&emitter, &receiver, lag);
            let mut nearest_m = f64::INFINITY;
            for left in emitter.start.0..=emitter.end.0 {
                for met in receiver.start.0.max(left)..=receiver.end.0.min(left + lag) {
                    let Some(region) = &region else {
                        // Only where they touch for a moment.
                        assert!(met == receiver.end.0 || met == left + lag);
                        continue;
                    };
                    let offset_m = receiver.position_m(Tick(met)) - emitter.position_m(Tick(left));
                    let away_m = (offset_m.x - axis_m[0]).hypot(offset_m.y - axis_m[1]);
                    nearest_m = nearest_m.min(away_m);
                    let (low_m, high_m) = region.depths_m();
                    assert!(low_m - 1e-9 <= -offset_m.z && -offset_m.z <= high_m + 1e-9);
                }
            }
            if let Some(region) = &region
                && nearest_m.is_finite()
            {
                let said_m = region.nearest_m(axis_m);
                assert!(said_m <= nearest_m + 1e-9, "{said_m} {nearest_m} in {case}");
                // Two ticks move both by a few centimetres at most.
                let step_m = 8.0 / f64::from(1 + tick(1).min(tick(9)));
                assert!(
                    said_m >= nearest_m - step_m,
                    "{said_m} {nearest_m} in {case}"
                );
            }
        }
    }
}
