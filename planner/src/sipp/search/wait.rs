//! When it is worth trying a step later.
//!
//! A state stands for all the time for which its place is free to hover at from then on. Its steps
//! are thought of for the first moment; one that is blocked then is thought of again for when it
//! may be free, and one that is not for when the place it leads to is free the next time.

use costmap::leg::Tick;
use costmap::verdict::Blocker;

use super::label::{Label, Step};
use super::walk::Search;

/// Departures after a wait are on whole multiples of this, so that a crowd does not make a state of
/// every moment: chosen here, a quarter second.
const WAIT_GRID_TICKS: u32 = 25;

impl Search<'_> {
    /// Thinks of what a label does, but from a later moment on.
    pub(super) fn postpone(&mut self, label: &Label, departs: Tick) {
        let Some(departs) = departs.0.checked_next_multiple_of(WAIT_GRID_TICKS) else {
            return;
        };
        let from = self.labels[label.parent as usize];
        let at = label.at.after(departs - label.departs.0);
        if departs <= label.departs.0 || at == Tick::FOREVER {
            return;
        }
        self.push(Label {
            departs: Tick(departs),
            at,
            paid: from.paid,
            met: from.met,
            judged: false,
            expanded: None,
            ..*label
        });
    }

    /// Keeps in mind that the place of a label may be reached at another time as well.
    pub(super) fn remember(&mut self, index: u32) {
        let label = self.labels[index as usize];
        self.push(Label {
            step: Step::Later,
            at: label.at.after(WAIT_GRID_TICKS),
            parent: index,
            ..label
        });
    }

    /// Steps to a place when it is free the next time, if it is not free for good.
    pub(super) fn step_later(&mut self, index: u32) {
        let label = self.labels[self.labels[index as usize].parent as usize];
        let node = self.nodes.at(&label);
        let gives_way = |drone| self.met.has(label.met, drone);
        let (until, again) = (self.nodes).free_until(node, &label, label.at, gives_way);
        if until < Tick::FOREVER && again < Tick::FOREVER {
            let later = again.0.saturating_sub(label.at.0).max(1);
            self.postpone(&label, label.departs.after(later));
        }
    }

    /// Waits for those who will have passed where it has to stay in the end.
    pub(super) fn wait_for_stays(&mut self, index: u32) {
        let label = self.labels[index as usize];
        if label.met != 0 {
            return;
        }
        let node = self.nodes.at(&label);
        let ends = label.at.0.saturating_add(self.nodes.remaining(node));
        let slack = self.stays.slack(label.waypoint, ends);
        if slack > 0 {
            let at = label.at.after(slack);
            self.push(Label {
                step: Step::Wait,
                departs: at,
                at,
                parent: index,
                judged: false,
                expanded: None,
                ..label
            });
        }
    }
}

/// The first moment after `departs` at which none of these may be in the way any more; `None` if
/// one stays. Times known `roughly` are those of whole legs.
pub(super) fn clear_after(
    departs: Tick,
    blockers: &[Blocker],
    roughly: bool,
    is_met: impl Fn(&Blocker) -> bool,
) -> Option<Tick> {
    let mut latest = None;
    for blocker in blockers.iter().filter(|blocker| !is_met(blocker)) {
        if blocker.clear == Tick::FOREVER {
            return None;
        }
        // A drone on its leg may be out of the way half-way already.
        let half = Tick(blocker.began.0.midpoint(blocker.clear.0));
        let early = roughly && half > departs;
        let clear = if early { half } else { blocker.clear };
        latest = latest.max(Some(clear));
    }
    latest
}
