//! Wakes that take their time: the air at a depth left its drone a while ago.
//!
//! The search does not ask when exactly. A wake is taken to be below every place that its drone has
//! been at for no longer than its air needs down to there: from at once, as of a wake that hangs
//! below its drone, until the latest. With `λ` the time at the greatest depth of two legs, the
//! receiver may be at `t` in the air that left at `t'` wherever
//!
//! ```text
//! 0 <= t - t' <= λ,      t in the receiver's leg, t' in the emitter's
//! ```
//!
//! That is a convex region of `(t', t)`, and what the receiver is to the emitter is linear in both:
//! its nearest distance to an axis is met on an edge, or is nothing.

use nalgebra::Vector3;

use crate::leg::{KindId, Leg, Tick};
use crate::volumes::relative::{Line, Relative};
use crate::wake::fleet::{Fleet, Meeting};

/// The line that a leg flies on, by ticks since one that is near: far from it squares of places
/// would lose their last digits.
fn line(leg: &Leg, since: Tick) -> Line {
    if leg.stays() || leg.end <= leg.start {
        return Line {
            origin: leg.from_m.coords,
            velocity: Vector3::zeros(),
        };
    }
    let velocity = (leg.to_m - leg.from_m) / f64::from(leg.end.0 - leg.start.0);
    Line {
        origin: leg.from_m.coords - velocity * f64::from(leg.start.0 - since.0),
        velocity,
    }
}

/// All that a receiver may be to an emitter whose air is under way for up to `delay` ticks, while
/// either of them may be earlier or later by `shift` (m, ticks); `None` where no air of the
/// emitter's leg can reach the receiver's.
fn advected(emitter: &Leg, receiver: &Leg, delay: u32, shift: u32) -> Option<Relative> {
    let since = emitter.start.min(receiver.start);
    let moments =
        [emitter, receiver].map(|leg| [leg.start, leg.end].map(|tick| f64::from(tick.0 - since.0)));
    let ([left_0, left_1], [met_0, met_1]) = (moments[0], moments[1]);
    let [delay, shift] = [delay, shift].map(f64::from);
    if met_1 + shift <= left_0 || left_1 + delay + shift <= met_0 {
        return None;
    }
    let lines = [emitter, receiver].map(|leg| line(leg, since));
    Relative::new(&lines[0], &lines[1], moments).delayed([-shift, delay + shift])
}

impl Fleet {
    /// All that a drone on the first leg may be to one on the second, seen from there, while either
    /// of them may be up to `shift` ticks earlier or later (m, ticks); `None` where their times are
    /// farther apart.
    pub(crate) fn shared(&self, first: &Leg, second: &Leg, shift: u32) -> Option<Relative> {
        advected(second, first, 0, shift)
    }

    /// The kind of the same airframe whose air takes longest to come down.
    pub(crate) fn slowest_like(&self, kind: usize) -> usize {
        let like = |other: &usize| self.kinds[*other].airframe == self.kinds[kind].airframe;
        let speed_mps = |other: &usize| self.wakes[*other].induced_velocity_mps();
        (0..self.kinds.len())
            .filter(like)
            .min_by(|a, b| speed_mps(a).total_cmp(&speed_mps(b)))
            .unwrap_or(kind)
    }

    /// Convective delay of a wake of this kind down to a depth (m), at most (ticks, rounded up); 0
    /// where wakes are quasi-static.
    pub(crate) fn delay_ticks(&self, kind: KindId, depth_m: f64) -> u32 {
        let conditions = self.conditions();
        if !conditions.wakes || conditions.flown.convection.is_none() {
            return 0;
        }
        let wake = &self.wakes[self.slowest[usize::from(kind.0)]];
        // One more: plans are written with rounded places.
        Tick::lasting(conditions.flown.lag_s(wake, depth_m)) + 1
    }

    /// How long any wake of the fleet outlasts its drone, at most (ticks).
    pub(crate) fn longest_delay(&self) -> u32 {
        self.longest_delay
    }

    /// Convective delay from any place of one leg down to any of another, at most (ticks).
    pub(crate) fn delay_between(&self, emitter: &Leg, receiver: &Leg) -> u32 {
        let highest_m = emitter.from_m.z.max(emitter.to_m.z);
        let lowest_m = receiver.from_m.z.min(receiver.to_m.z);
        self.delay_ticks(emitter.kind, highest_m - lowest_m)
    }

    /// Bound on the receiver's budget that air of the emitter's leg fills, whenever it left, in
    /// millionths.
    pub(crate) fn advected_load(&self, emitter: &Leg, receiver: &Leg, wake_end_z_m: f64) -> u32 {
        let reaches = receiver.from_m.z.max(receiver.to_m.z) >= wake_end_z_m - 1e-6;
        if !self.conditions().wakes || !emitter.flying || !receiver.flying || !reaches {
            return 0;
        }
        let delay = self.delay_between(emitter, receiver);
        let shift = self.conditions().shift;
        let Some(region) = advected(emitter, receiver, delay, shift) else {
            return 0;
        };
        let envelope = self.envelope(usize::from(emitter.kind.0), usize::from(receiver.kind.0));
        let square = envelope.highest_among(region.depths(), |axis_m| region.nearest(axis_m));
        if square == 0.0 {
            return 0;
        }
        self.load_of(emitter, receiver, square)
    }

    /// [`Fleet::meet`], with advected wakes in the loads.
    pub(crate) fn meet_advected(&self, first: &Leg, second: &Leg, ends: [f64; 2]) -> Meeting {
        let at_once = self.meet(first, second, ends).unwrap_or_default();
        Meeting {
            load_on_first: at_once
                .load_on_first
                .max(self.advected_load(second, first, ends[1])),
            load_on_second: at_once
                .load_on_second
                .max(self.advected_load(first, second, ends[0])),
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
            let delay = tick(16);
            let axis_m = [value(3) - 0.5, value(4) - 0.5];
            let region = advected(&emitter, &receiver, delay, 0);
            let mut nearest_m = f64::INFINITY;
            for left in emitter.start.0..=emitter.end.0 {
                for met in receiver.start.0.max(left)..=receiver.end.0.min(left + delay) {
                    let Some(region) = &region else {
                        // Only where they touch for a moment.
                        assert!(met == receiver.end.0 || met == left + delay);
                        continue;
                    };
                    let offset_m = receiver.position_m(Tick(met)) - emitter.position_m(Tick(left));
                    let away_m = (offset_m.x - axis_m[0]).hypot(offset_m.y - axis_m[1]);
                    nearest_m = nearest_m.min(away_m);
                    let [low_m, high_m] = region.depths();
                    assert!(low_m - 1e-9 <= -offset_m.z && -offset_m.z <= high_m + 1e-9);
                }
            }
            if let Some(region) = &region
                && nearest_m.is_finite()
            {
                let said_m = region.nearest(axis_m);
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
