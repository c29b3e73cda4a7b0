//! How long a drone may wait, and when it is worth looking again.

use costmap::leg::{Leg, Tick};
use costmap::verdict::Verdict;

/// Waits end on whole multiples of this, so that a crowd does not make a state of every moment: chosen
/// here, a quarter second.
pub(super) const WAIT_GRID_TICKS: u32 = 25;

/// How long a hover is free, at least.
pub(super) fn free_until(hover: &Leg, verdict: &Verdict) -> Tick {
    if verdict.breaks_zone.is_some() {
        return hover.start;
    }
    verdict
        .blockers
        .iter()
        .map(|blocker| blocker.began.max(hover.start))
        .fold(hover.end, Tick::min)
}

/// The next moment at which something near may have changed.
#[derive(Clone, Copy, Debug)]
pub(super) struct NextEvent {
    now: Tick,
    earliest: Tick,
}

impl NextEvent {
    pub(super) fn after(now: Tick) -> NextEvent {
        NextEvent {
            now,
            earliest: Tick::FOREVER,
        }
    }

    pub(super) fn at(&mut self, moment: Tick) {
        if moment > self.now {
            let moment = moment.0.checked_next_multiple_of(WAIT_GRID_TICKS);
            self.earliest = self.earliest.min(moment.map_or(Tick::FOREVER, Tick));
        }
    }

    /// A drone on its leg may be out of the way half-way already.
    pub(super) fn see(&mut self, began: Tick, clear: Tick) {
        if clear != Tick::FOREVER {
            self.at(Tick(began.0.midpoint(clear.0)));
            self.at(clear);
        }
    }

    pub(super) fn earliest(&self) -> Tick {
        self.earliest
    }
}
