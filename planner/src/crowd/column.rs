//! The steps that begin over one cell of the floor, in order of time.

use costmap::leg::{DroneId, Tick};

/// Somebody's step, or stay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Record {
    pub(super) start: Tick,
    pub(super) end: Tick,
    pub(super) drone: DroneId,
    /// In the costmap.
    pub(super) item: u32,
    pub(super) layer: i16,
    pub(super) way: u8,
    pub(super) class: u8,
    pub(super) flying: bool,
}

/// All of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Column {
    /// What ends, each with the latest end of this and all before it.
    passing: Vec<(Tick, Record)>,
    /// What does not: kept apart, or else nothing that begins later would ever be over.
    staying: Vec<Record>,
}

impl Column {
    pub(super) fn insert(&mut self, record: Record) {
        if record.end == Tick::FOREVER {
            return self.staying.push(record);
        }
        let begun = |(_, known): &(Tick, Record)| known.start <= record.start;
        let index = self.passing.partition_point(begun);
        self.passing.insert(index, (record.end, record));
        self.settle_latest(index);
    }

    pub(super) fn remove(&mut self, drone: DroneId) {
        self.staying.retain(|record| record.drone != drone);
        self.passing.retain(|(_, record)| record.drone != drone);
        self.settle_latest(0);
    }

    fn settle_latest(&mut self, from: usize) {
        let before = from.checked_sub(1).map(|before| self.passing[before].0);
        let mut latest = before.unwrap_or_default();
        for (known, record) in &mut self.passing[from..] {
            latest = latest.max(record.end);
            *known = latest;
        }
    }

    /// What lasts between two ticks: in order of time, those who stay last.
    pub(super) fn between(&self, [from, until]: [Tick; 2]) -> impl Iterator<Item = &Record> {
        let first = self.passing.partition_point(|(latest, _)| *latest <= from);
        let passing = self.passing[first..].iter().map(|(_, record)| record);
        passing
            .take_while(move |record| record.start < until)
            .filter(move |record| record.end > from)
            .chain(self.staying.iter().filter(move |it| it.start < until))
    }
}
