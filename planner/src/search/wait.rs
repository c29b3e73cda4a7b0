//! How long a drone may wait, and when it is worth looking again.

use costmap::leg::{Leg, Tick};
use costmap::verdict::Verdict;

use super::label::{Label, Step};
use super::walk::Search;

/// Waits end on whole multiples of this, so that a crowd does not make a state of every moment: chosen
/// here, a quarter second.
pub(super) const WAIT_GRID_TICKS: u32 = 25;
/// How far ahead it looks, and the longest single wait: chosen here, one or two steps.
const WINDOW_TICKS: u32 = 100;

impl Search<'_> {
    /// Whether a state can as well be reached by waiting there.
    pub(super) fn is_reached(&mut self, index: u32) -> bool {
        let label = self.labels[index as usize];
        let node = self.nodes.at(&label);
        if label.step != Step::Wait {
            for at in 0..self.nodes.visits(node).len() {
                let visit = self.nodes.visits(node)[at];
                let horizon = self.scene.costmap.horizon();
                let far = visit.from.after(WINDOW_TICKS) < label.at && visit.from < horizon;
                if visit.to.is_none() && visit.from < label.at && !far {
                    let to = self.free_until(visit.label);
                    self.nodes.visits(node)[at].to = Some(to);
                }
            }
        }
        self.nodes.is_covered(node, &label)
    }

    /// Until when a state's place is free to hover at, as far as it looks.
    fn free_until(&mut self, index: u32) -> Tick {
        let hover = self.hover(index, WINDOW_TICKS);
        self.judge(&hover);
        let until = free_until(&hover, &self.verdict);
        let settled = hover.start >= self.scene.costmap.horizon();
        if settled && until >= hover.end {
            // Nothing changes any more.
            return Tick::FOREVER;
        }
        until
    }

    fn hover(&self, index: u32, ticks: u32) -> Leg {
        let label = &self.labels[index as usize];
        let here_m = self.scene.roadmap.position_m(label.vertex);
        self.leg(label, here_m, ticks)
    }

    /// Stays where it is until something near may have changed.
    pub(super) fn wait(&mut self, index: u32) {
        let stayed = self.labels[index as usize].parent;
        let label = self.labels[stayed as usize];
        let settled = label.at >= self.scene.costmap.horizon();
        if settled && self.free_until(stayed) == Tick::FOREVER {
            // To wait is to lose time.
            return;
        }
        let until = self.next_event(stayed, &label);
        let leg = self.hover(stayed, until.0 - label.at.0);
        self.judge(&leg);
        self.settle(Label {
            step: Step::Wait,
            at: until,
            parent: stayed,
            offered: None,
            ..label
        });
    }

    /// When it is worth looking again.
    fn next_event(&mut self, stayed: u32, label: &Label) -> Tick {
        let mut next = NextEvent::after(label.at);
        let ways = self.scene.roadmap.ways(label.vertex);
        let longest_m = ways.map(|(_, way)| way.length_m).fold(0.0, f32::max);
        let hover = self.hover(stayed, WINDOW_TICKS);
        self.scene
            .costmap
            .gripping(&hover, f64::from(longest_m), |began, clear| {
                next.see(began, clear);
            });
        if label.met == 0 {
            let node = self.nodes.at(label);
            let ends = label.at.0.saturating_add(self.nodes.remaining(node));
            let slack = self
                .stays_ahead(label.stage, ends)
                .max_by_key(|(stay, arrives)| stay.excess(*arrives))
                .map_or(0, |(stay, arrives)| stay.slack(arrives));
            next.at(label.at.after(slack));
        }
        next.at(Tick(label.at.0 + WINDOW_TICKS - WAIT_GRID_TICKS + 1));
        next.earliest
    }
}

/// How long a hover is free, at least.
fn free_until(hover: &Leg, verdict: &Verdict) -> Tick {
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
struct NextEvent {
    now: Tick,
    earliest: Tick,
}

impl NextEvent {
    fn after(now: Tick) -> NextEvent {
        NextEvent {
            now,
            earliest: Tick::FOREVER,
        }
    }

    fn at(&mut self, moment: Tick) {
        if moment > self.now {
            let moment = moment.0.checked_next_multiple_of(WAIT_GRID_TICKS);
            self.earliest = self.earliest.min(moment.map_or(Tick::FOREVER, Tick));
        }
    }

    /// A drone on its leg may be out of the way half-way already.
    fn see(&mut self, began: Tick, clear: Tick) {
        if clear != Tick::FOREVER {
            self.at(Tick(began.0.midpoint(clear.0)));
            self.at(clear);
        }
    }
}
