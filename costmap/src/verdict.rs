//! What a costmap says of a leg: its blockers, and its cost.

use airflow::power;

use crate::leg::{DroneId, Tick};

/// Mean air below this share of the induced velocity costs nothing: chosen here, half a percent of
/// power.
const LEAST_PRICED_ALPHA: f64 = 0.01;

/// What another's wake brings a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IncomingLoad {
    /// Emitter.
    pub from: DroneId,
    /// First moment.
    pub start: Tick,
    /// First moment after.
    pub end: Tick,
    /// Bound on the share of the budget that it fills, in millionths.
    pub load: u32,
}

/// The greatest sum of loads at one moment between two ticks. Of what one drone brings in a row
/// only the greatest counts: within the time margin it may be on either of two legs.
pub fn peak(incoming: &[IncomingLoad], start: Tick, end: Tick) -> u64 {
    let at = |moment: Tick| sum_at(incoming, moment);
    // A sum only grows where something begins.
    incoming
        .iter()
        .map(|it| it.start)
        .filter(|&moment| start < moment && moment < end)
        .map(at)
        .fold(at(start), u64::max)
}

/// The sum of loads at a moment, of each drone's in a row the greatest.
fn sum_at(incoming: &[IncomingLoad], moment: Tick) -> u64 {
    let lasting = incoming
        .iter()
        .filter(|it| it.start <= moment && moment < it.end);
    let mut sum = 0;
    let mut last: Option<(DroneId, u32)> = None;
    for it in lasting {
        match &mut last {
            Some((from, most)) if *from == it.from => {
                sum += u64::from(it.load.saturating_sub(*most));
                *most = it.load.max(*most);
            }
            _ => {
                sum += u64::from(it.load);
                last = Some((it.from, it.load));
            }
        }
    }
    sum
}

/// Why a leg may not be flown past a drone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// The bodies would touch.
    Bodies,
    /// One would be in the other's near-field column.
    Column,
    /// The leg's own air limit would be exceeded.
    OwnLimit,
    /// The other's air limit would be exceeded.
    TheirLimit,
    /// Both wakes together are too strong for a zone.
    Zone,
}

/// A drone that forbids a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Blocker {
    /// The drone.
    pub drone: DroneId,
    /// How.
    pub why: Why,
    /// When its leg began, margins of time and air under way included.
    pub began: Tick,
    /// When its leg ends, likewise: before, trying again is in vain or nearly so.
    pub clear: Tick,
    /// When its leg begins and ends as it is planned.
    pub flown: [Tick; 2],
}

/// The answer to "may I fly this leg, and what does it cost".
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// Empty: no drone forbids it.
    pub blockers: Vec<Blocker>,
    /// The zone (its index) for which its wake alone is too strong.
    pub breaks_zone: Option<usize>,
    /// Extra energy of all that are affected, in seconds of its own hovering in still air.
    pub price_s: f64,
    /// What the leg meets of others' wakes, while it is judged, and their legs as blockers.
    pub(crate) incoming: Vec<(IncomingLoad, Blocker)>,
}

impl Verdict {
    /// Whether neither a drone nor a zone forbids it.
    pub fn is_allowed(&self) -> bool {
        self.blockers.is_empty() && self.breaks_zone.is_none()
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.blockers.clear();
        self.breaks_zone = None;
        self.price_s = 0.0;
    }
}

/// The greatest load of each drone: its legs follow one another.
pub(crate) fn record_max_load(loads: &mut Vec<(u32, Blocker)>, load: u32, blocker: Blocker) {
    match loads
        .iter_mut()
        .find(|(_, known)| known.drone == blocker.drone)
    {
        Some((known, last)) => {
            *known = load.max(*known);
            last.began = last.began.min(blocker.began);
            last.clear = last.clear.max(blocker.clear);
            last.flown = [
                last.flown[0].min(blocker.flown[0]),
                last.flown[1].max(blocker.flown[1]),
            ];
        }
        None => loads.push((load, blocker)),
    }
}

/// Blocks the heaviest loads until the rest fits into the budget beside `own`.
pub(crate) fn block_largest(
    loads: &mut [(u32, Blocker)],
    own: u32,
    budget: u32,
    verdict: &mut Verdict,
) {
    let mut total = loads
        .iter()
        .fold(own, |sum, (load, _)| sum.saturating_add(*load));
    if total <= budget {
        return;
    }
    loads.sort_by_key(|(load, blocker)| (std::cmp::Reverse(*load), blocker.drone));
    for (load, blocker) in loads.iter() {
        if total <= budget {
            return;
        }
        verdict.blockers.push(*blocker);
        total = total.saturating_sub(*load);
    }
}

/// Extra power over the power of hovering in still air.
pub fn price(alpha: f64) -> f64 {
    if alpha < LEAST_PRICED_ALPHA {
        0.0
    } else {
        power::beta(alpha) - 1.0
    }
}
