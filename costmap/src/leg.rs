//! A leg: one drone moving straight, or standing still, for a whole number of ticks.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

/// A moment of the search, in hundredths of a second since the plan begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Tick(pub u32);

impl Tick {
    /// Chosen here: a duration rounds up by less than 2 % of half a second, a typical cell's.
    pub const PER_SECOND: f64 = 100.0;
    /// Later than any plan: the end of what does not end.
    pub const FOREVER: Tick = Tick(u32::MAX);

    /// Seconds since the plan begins.
    pub fn seconds(self) -> f64 {
        f64::from(self.0) / Self::PER_SECOND
    }

    /// `ticks` earlier, and not before the plan begins.
    #[must_use]
    pub fn before(self, ticks: u32) -> Tick {
        match self {
            Tick::FOREVER => self,
            Tick(tick) => Tick(tick.saturating_sub(ticks)),
        }
    }

    /// The whole number of ticks that `duration_s` needs, rounded up (a nanosecond is forgiven).
    pub fn lasting(duration_s: f64) -> u32 {
        (duration_s * Self::PER_SECOND - 1e-9 * Self::PER_SECOND)
            .ceil()
            .max(0.0) as u32
    }

    /// `ticks` later; what does not end stays so.
    #[must_use]
    pub fn after(self, ticks: u32) -> Tick {
        Tick(self.0.saturating_add(ticks))
    }
}

/// Index of a drone in its fleet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DroneId(pub u32);

/// Index of a [`Kind`](crate::wake::fleet::Kind): an airframe at one mass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct KindId(pub u32);

impl KindId {
    /// Where a list of all kinds holds it.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// One drone on a straight path at constant speed, from one tick to another.
///
/// Half open in time: the end belongs to the next leg. Positions are rotor-plane centres (m, world,
/// z up). A leg that ends at [`Tick::FOREVER`] stands still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// The drone.
    pub drone: DroneId,
    /// What flies, at which mass.
    pub kind: KindId,
    /// First moment.
    pub start: Tick,
    /// First moment after.
    pub end: Tick,
    /// Where it begins.
    pub from_m: Point3<f64>,
    /// Where it ends.
    pub to_m: Point3<f64>,
    /// In the air: its wake counts, and its air limit holds.
    pub flying: bool,
    /// Highest mean air over its discs, over its induced velocity.
    pub air_limit: f64,
}

impl Leg {
    /// A leg that stays where it is.
    pub fn stays(&self) -> bool {
        self.from_m == self.to_m
    }

    /// Where it is at a tick between its start and its end (both included).
    pub fn position_m(&self, at: Tick) -> Point3<f64> {
        if self.stays() || at <= self.start {
            return self.from_m;
        }
        if at >= self.end {
            return self.to_m;
        }
        let share = f64::from(at.0 - self.start.0) / f64::from(self.end.0 - self.start.0);
        self.from_m + (self.to_m - self.from_m) * share
    }

    /// The ticks that two legs share.
    pub(crate) fn overlap(&self, other: &Leg) -> Range<Tick> {
        self.start.max(other.start)..self.end.min(other.end)
    }

    /// The ticks of this leg at which the other may be under way, either of them by up to `shift`
    /// ticks earlier or later than it says.
    pub fn shared(&self, other: &Leg, shift: u32) -> Range<Tick> {
        self.within(other, [shift; 2])
    }

    /// The ticks of this leg from so many before the other begins until so many after its end.
    pub fn within(&self, other: &Leg, [before, after]: [u32; 2]) -> Range<Tick> {
        let since = Tick(other.start.0.saturating_sub(before));
        self.start.max(since)..self.end.min(other.end.after(after))
    }

    /// The part between two ticks.
    #[must_use]
    pub fn between(&self, start: Tick, end: Tick) -> Leg {
        let (start, end) = (start.max(self.start), end.min(self.end));
        Leg {
            start,
            end,
            from_m: self.position_m(start),
            to_m: self.position_m(end),
            ..*self
        }
    }

    /// Length over duration (m/s).
    pub fn velocity_mps(&self) -> Vector3<f64> {
        if self.stays() {
            return Vector3::zeros();
        }
        (self.to_m - self.from_m) / (self.end.seconds() - self.start.seconds())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_round_up_but_forgive_the_last_digit() {
        assert_eq!(Tick::lasting(0.5), 50);
        assert_eq!(Tick::lasting(0.5 + 1e-12), 50);
        assert_eq!(Tick::lasting(std::f64::consts::FRAC_1_SQRT_2), 71);
        assert_eq!(Tick::lasting(0.0), 0);
    }
}
