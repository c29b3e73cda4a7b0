//! The steps that begin over one cell of the floor, in order of time.

use costmap::leg::{DroneId, Tick};

/// A drone's step, or stay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StepRecord {
    pub(super) start: Tick,
    pub(super) end: Tick,
    pub(super) drone: DroneId,
    /// Which of its parts in the costmap.
    pub(super) part: u32,
    /// By how much it may be ahead of these times, and behind them, beyond the margins (ticks).
    pub(super) early: u16,
    pub(super) late: u16,
    pub(super) layer: i16,
    pub(super) direction: u8,
    pub(super) class: u8,
    pub(super) flying: bool,
}

/// All of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct StepColumn {
    /// What ends.
    passing: Vec<StepRecord>,
    /// Latest end of each of these and all before it: apart, so that a bisection meets nothing
    /// else.
    latest: Vec<Tick>,
    /// What does not: kept apart, or else nothing that begins later would ever be over.
    staying: Vec<StepRecord>,
}

impl StepColumn {
    pub(super) fn insert(&mut self, record: StepRecord) {
        if record.end == Tick::FOREVER {
            return self.staying.push(record);
        }
        let begun = |known: &StepRecord| known.start <= record.start;
        let index = self.passing.partition_point(begun);
        self.passing.insert(index, record);
        self.settle_latest(index);
    }

    pub(super) fn remove(&mut self, drone: DroneId) {
        self.staying.retain(|record| record.drone != drone);
        self.passing.retain(|record| record.drone != drone);
        self.settle_latest(0);
    }

    fn settle_latest(&mut self, from: usize) {
        self.latest.truncate(from);
        let mut latest = self.latest.last().copied().unwrap_or_default();
        for record in &self.passing[from..] {
            latest = latest.max(record.end);
            self.latest.push(latest);
        }
    }

    /// When a drone may be there.
    pub(super) fn occupancy_mask(&self) -> OccupancyMask {
        let mut mask = OccupancyMask::default();
        for record in self.passing.iter().chain(&self.staying) {
            mask.add(record);
        }
        mask
    }

    /// What lasts between two ticks and ends, in order of time.
    pub(super) fn passing(&self, [from, until]: [Tick; 2]) -> impl Iterator<Item = &StepRecord> {
        let first = self.latest.partition_point(|latest| *latest <= from);
        let begun = self.passing[first..].iter();
        begun
            .take_while(move |record| record.start < until)
            .filter(move |record| record.end > from)
    }

    /// What begins before a tick and does not end.
    pub(super) fn staying(&self, until: Tick) -> impl Iterator<Item = &StepRecord> {
        (self.staying.iter()).filter(move |record| record.start < until)
    }
}

/// Length of a spell: chosen here, most steps of a metre at 2 m/s touch two.
const SPELL_TICKS: u32 = 64;

/// The spells of a time as bits: over and over, from the first one again after the last.
pub(super) fn spells([from, until]: [Tick; 2]) -> u64 {
    let first = from.0 / SPELL_TICKS;
    let count = until.0.saturating_sub(1).max(from.0) / SPELL_TICKS - first + 1;
    let bits = 1_u64.checked_shl(count).map_or(u64::MAX, |bit| bit - 1);
    bits.rotate_left(first % u64::BITS)
}

/// When a drone may be in a column: what is known of it without a look at its steps, which are
/// elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OccupancyMask {
    passing: u64,
    stays_from: Tick,
}

impl Default for OccupancyMask {
    fn default() -> OccupancyMask {
        OccupancyMask {
            passing: 0,
            stays_from: Tick::FOREVER,
        }
    }
}

impl OccupancyMask {
    pub(super) fn add(&mut self, record: &StepRecord) {
        if record.end == Tick::FOREVER {
            self.stays_from = self.stays_from.min(record.start);
        } else {
            self.passing |= spells([record.start, record.end]);
        }
    }

    /// Whether a drone may pass in a time that has these spells.
    pub(super) fn may_be_passed(&self, spells: u64) -> bool {
        self.passing & spells != 0
    }

    /// Whether a drone that stays is there before a tick.
    pub(super) fn is_held(&self, until: Tick) -> bool {
        self.stays_from < until
    }
}
