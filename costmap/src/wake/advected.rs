//! Advected wakes: the air at a depth left its drone a while ago.
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

use std::ops::Range;

use airflow::{Convection, FarField, Wake};
use nalgebra::Vector3;

use crate::leg::{KindId, Leg, Tick};
use crate::volumes::relative::{Line, Relative};
use crate::wake::fleet::{Conditions, Fleet, Kind};

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
pub(super) fn advected(emitter: &Leg, receiver: &Leg, delay: u32, shift: u32) -> Option<Relative> {
    let since = emitter.start.min(receiver.start);
    let moments = |leg: &Leg| {
        let moment = |tick: Tick| f64::from(tick.0 - since.0);
        [moment(leg.start), moment(leg.end)]
    };
    let (left, met) = (moments(emitter), moments(receiver));
    let (delay, shift) = (f64::from(delay), f64::from(shift));
    if met[1] + shift <= left[0] || left[1] + delay + shift <= met[0] {
        return None;
    }
    let (emitted, received) = (line(emitter, since), line(receiver, since));
    Relative::new(&emitted, &received, [left, met]).delayed([-shift, delay + shift])
}

/// How late the air of a drone may be: that of the slowest that its airframe makes, since drones
/// take up and drop loads, climb and sink.
#[derive(Clone, Copy, Debug)]
pub struct ConvectiveDelayBound {
    far: FarField,
    /// Longest delay over that at the centreline's speed; 0: wakes are quasi-static.
    longest_lag: f64,
}

impl ConvectiveDelayBound {
    /// Of each kind of a fleet, whose wakes as they hover are these.
    pub(crate) fn of_each(
        kinds: &[Kind],
        hovering: &[Wake],
        air: &Conditions,
    ) -> Vec<ConvectiveDelayBound> {
        let climbs_mps = [-air.fastest_mps, 0.0, air.fastest_mps];
        let time_s = |far: &FarField| far.transport_time_s(1.0, 1.0);
        let convection = air.flown.convection.filter(|_| air.wakes);
        let of_kind = |(kind, wake): (&Kind, &Wake)| {
            let like = kinds.iter().zip(hovering);
            let like = like.filter(|(other, _)| other.airframe == kind.airframe);
            let all = like.flat_map(|(_, wake)| {
                climbs_mps.map(|climb_mps| *air.flown.climbing(wake, climb_mps).far_field())
            });
            let slowest = all.max_by(|a, b| time_s(a).total_cmp(&time_s(b)));
            ConvectiveDelayBound {
                far: slowest.unwrap_or(*wake.far_field()),
                longest_lag: convection.map_or(0.0, Convection::longest_lag),
            }
        };
        kinds.iter().zip(hovering).map(of_kind).collect()
    }

    /// Down to a depth (m), at most (ticks); 0 where wakes are quasi-static, and at no depth.
    pub fn delay_ticks(&self, depth_m: f64) -> f64 {
        if depth_m <= 0.0 || self.longest_lag == 0.0 {
            return 0.0;
        }
        // One more: plans are written with rounded places.
        self.longest_lag * self.far.transport_time_s(depth_m, 1.0) * Tick::PER_SECOND + 1.0
    }
}

impl Fleet {
    /// All that a drone on the first leg may be to one on the second, seen from there, while either
    /// of them may be up to `shift` ticks earlier or later (m, ticks); `None` where their times are
    /// farther apart.
    pub(crate) fn shared(&self, first: &Leg, second: &Leg, shift: u32) -> Option<Relative> {
        advected(second, first, 0, shift)
    }

    /// All that a drone on the receiver's leg may be to the air of the emitter's, seen from where
    /// that left, while either of them may be up to `shift` ticks earlier or later (m, ticks);
    /// `None`: no air reaches it in time.
    pub(crate) fn exposed(&self, receiver: &Leg, emitter: &Leg, shift: u32) -> Option<Relative> {
        advected(
            emitter,
            receiver,
            self.delay_between(emitter, receiver),
            shift,
        )
    }

    /// Whether wakes are advected.
    pub(crate) fn is_advected(&self) -> bool {
        let conditions = self.conditions();
        conditions.wakes && conditions.flown.convection.is_some()
    }

    /// Convective delay of a wake of this kind down to a depth (m), at most (ticks, rounded up); 0
    /// where wakes are quasi-static, and at no depth.
    pub(crate) fn delay_ticks(&self, kind: KindId, depth_m: f64) -> u32 {
        self.delay_bound(kind).delay_ticks(depth_m).ceil() as u32
    }

    /// The same for any kind of the fleet.
    pub(crate) fn longest_delay(&self, depth_m: f64) -> u32 {
        let kinds = (0..self.kinds.len() as u32).map(KindId);
        let delays = kinds.map(|kind| self.delay_ticks(kind, depth_m));
        delays.max().unwrap_or(0)
    }

    /// Convective delay from any place of a leg down to a height (m), at most (ticks).
    pub(crate) fn delay_down_to(&self, emitter: &Leg, z_m: f64) -> u32 {
        let highest_m = emitter.from_m.z.max(emitter.to_m.z);
        let relative_deviation_m = 2.0 * self.conditions().path_deviation_m;
        self.delay_ticks(emitter.kind, highest_m + relative_deviation_m - z_m)
    }

    /// Convective delay from any place of one leg down to any of another, at most (ticks).
    pub(crate) fn delay_between(&self, emitter: &Leg, receiver: &Leg) -> u32 {
        self.delay_down_to(emitter, receiver.from_m.z.min(receiver.to_m.z))
    }

    /// When a receiver may be in the air of an emitter's leg: the ticks of its own.
    pub(crate) fn exposed_during(&self, receiver: &Leg, emitter: &Leg) -> Range<Tick> {
        let shift = self.conditions().shift;
        let late = shift + self.delay_between(emitter, receiver);
        receiver.within(emitter, [shift, late])
    }

    /// An emitter's leg moved to when the mean flow carries its air to a receiver's (by the delay
    /// between the middles of both).
    pub(crate) fn arriving(&self, emitter: &Leg, receiver: &Leg) -> Leg {
        let middle_m = |leg: &Leg| 0.5 * (leg.from_m.z + leg.to_m.z);
        let lag = self
            .conditions()
            .flown
            .convection
            .map_or(0.0, |it| it.mean_lag());
        let far = self.wake(emitter.kind).far_field();
        let depth_m = (middle_m(emitter) - middle_m(receiver)).max(0.0);
        let delay = Tick::lasting(far.transport_time_s(depth_m, 1.0) * lag);
        Leg {
            start: emitter.start.after(delay),
            end: emitter.end.after(delay),
            ..*emitter
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
