//! The legs of a fleet by bin of the floor, in order of time.
//!
//! Prioritized planning asks what is near at a time for every step it considers, and mostly
//! appends. Every bin of the [`Ground`] lists the legs over it by their beginning, each with the
//! latest end up to there: of those that have ended before a moment one bisection skips nearly all.

use std::sync::OnceLock;

use crate::leg::{DroneId, Leg, Tick};
use crate::reservations::ground::{Bins, Footprint, Ground};
use crate::verdict::{IncomingLoad, peak};

/// A leg of the fleet, or a part of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// The leg or part.
    pub leg: Leg,
    /// When the whole leg began.
    pub began: Tick,
    /// When the whole leg ends.
    pub clear: Tick,
    /// Height at which its wake ends (m).
    pub wake_end_z_m: f64,
    /// Where it is.
    pub footprint: Footprint,
    /// The wakes that it meets.
    pub incoming: Vec<IncomingLoad>,
    /// Bound on the budget that they fill together at any moment, in millionths.
    pub peak: u64,
    /// All wakes that it meets, however weak and far off, once they were asked for.
    pub all_incoming: OnceLock<Vec<IncomingLoad>>,
    /// The bins that it is over.
    pub(crate) bins: Bins,
}

impl Item {
    /// Bound on the budget that all wakes met between two ticks fill together, in millionths.
    pub fn filled(&self, start: Tick, end: Tick) -> u64 {
        peak(&self.incoming, start, end)
    }

    fn meets(&mut self, incoming: IncomingLoad) {
        self.incoming.push(incoming);
        self.peak = self
            .peak
            .max(peak(&self.incoming, incoming.start, incoming.end));
    }

    fn forgets(&mut self, drone: DroneId) {
        self.incoming.retain(|incoming| incoming.from != drone);
        self.peak = peak(&self.incoming, Tick(0), Tick::FOREVER);
    }
}

#[derive(Clone, Copy, Debug)]
struct BinEntry {
    start: Tick,
    end: Tick,
    /// Latest end of this and all before it in the bin.
    latest: Tick,
    item: u32,
    /// Those of the item.
    bins: Bins,
}

/// The legs over a bin.
#[derive(Clone, Debug, Default)]
struct Bin {
    /// Those that end.
    passing: Vec<BinEntry>,
    /// Those that do not: kept apart, or else nothing that begins later would ever be over.
    staying: Vec<BinEntry>,
}

impl Bin {
    fn insert(&mut self, entry: BinEntry) {
        let kept = match entry.end {
            Tick::FOREVER => &mut self.staying,
            _ => &mut self.passing,
        };
        let at = kept.partition_point(|known| known.start <= entry.start);
        kept.insert(at, entry);
        settle_latest(kept, at);
    }

    /// In order of time between two ticks, those that never end last.
    fn during(&self, start: Tick, end: Tick) -> impl Iterator<Item = &BinEntry> {
        let first = self.passing.partition_point(|entry| entry.latest <= start);
        let passing = self.passing[first..].iter();
        let staying = self.staying.iter();
        passing
            .take_while(move |entry| entry.start < end)
            .filter(move |entry| entry.end > start)
            .chain(staying.take_while(move |entry| entry.start < end))
    }

    fn remove(&mut self, item: u32) {
        for kept in [&mut self.passing, &mut self.staying] {
            if let Some(at) = kept.iter().position(|entry| entry.item == item) {
                kept.remove(at);
                settle_latest(kept, at);
            }
        }
    }
}

/// All legs of a fleet over time.
#[derive(Clone, Debug)]
pub struct Timeline {
    ground: Ground,
    bins: Vec<Bin>,
    /// By bin, the greatest [`Item::peak`] there has ever been.
    fullest: Vec<u64>,
    items: Vec<Item>,
    unused: Vec<u32>,
    /// Per drone, its items in order of time.
    of_drones: Vec<Vec<u32>>,
}

impl Timeline {
    /// Without any leg.
    pub(crate) fn new(ground: Ground, drones: usize) -> Timeline {
        Timeline {
            ground,
            bins: vec![Bin::default(); ground.count()],
            fullest: vec![0; ground.count()],
            items: Vec::new(),
            unused: Vec::new(),
            of_drones: vec![Vec::new(); drones],
        }
    }

    /// The floor.
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// Adds a leg, or a part of one that began and ends at other times.
    pub fn add(&mut self, leg: Leg, [began, clear]: [Tick; 2], wake_end_z_m: f64) -> u32 {
        let footprint = Footprint::around(&leg, 0.0);
        let bins = self.ground.bins(&footprint);
        let item = Item {
            leg,
            began,
            clear,
            wake_end_z_m,
            footprint,
            incoming: Vec::new(),
            peak: 0,
            all_incoming: OnceLock::new(),
            bins,
        };
        let index = match self.unused.pop() {
            Some(index) => {
                self.items[index as usize] = item;
                index
            }
            None => {
                self.items.push(item);
                self.items.len() as u32 - 1
            }
        };
        self.of_drones[leg.drone.0 as usize].push(index);
        for bin in self.ground.rows(bins).flatten() {
            self.bins[bin].insert(BinEntry {
                start: leg.start,
                end: leg.end,
                latest: leg.end,
                item: index,
                bins,
            });
        }
        index
    }

    #[inline]
    pub(crate) fn item(&self, index: u32) -> &Item {
        &self.items[index as usize]
    }

    /// Forgets all that was asked for: something is about to change.
    pub(crate) fn forget_all_incoming(&mut self) {
        for item in &mut self.items {
            item.all_incoming.take();
        }
    }

    /// Notes that an item meets a wake.
    pub(crate) fn meets(&mut self, index: u32, incoming: IncomingLoad) {
        let item = &mut self.items[index as usize];
        item.meets(incoming);
        for bin in self.ground.rows(item.bins).flatten() {
            self.fullest[bin] = self.fullest[bin].max(item.peak);
        }
    }

    /// The most that wakes that are close fill, or have filled, of the budget of a leg over a bin,
    /// in millionths.
    pub fn fullest(&self, bin: usize) -> u64 {
        self.fullest[bin]
    }

    /// Items of a drone, in order of time.
    pub(crate) fn of(&self, drone: DroneId) -> &[u32] {
        &self.of_drones[drone.0 as usize]
    }

    /// Those that last between two ticks.
    pub(crate) fn lasting(
        &self,
        drone: DroneId,
        [start, end]: [Tick; 2],
    ) -> impl Iterator<Item = &Item> {
        let items = self.of(drone);
        let first = items.partition_point(|&it| self.item(it).leg.end <= start);
        let lasting = items[first..].iter().map(|&it| self.item(it));
        lasting.take_while(move |item| item.leg.start < end)
    }

    /// Takes a drone's items out. What they brought others is forgotten by [`Timeline::forget`].
    pub(crate) fn remove(&mut self, drone: DroneId) {
        for index in std::mem::take(&mut self.of_drones[drone.0 as usize]) {
            for bin in self.ground.rows(self.items[index as usize].bins).flatten() {
                self.bins[bin].remove(index);
            }
            self.items[index as usize].incoming = Vec::new();
            self.unused.push(index);
        }
    }

    /// Takes back what a drone brought an item.
    pub(crate) fn forget(&mut self, index: u32, drone: DroneId) {
        self.items[index as usize].forgets(drone);
    }

    /// Calls `f` with every item over the bins of a footprint between two ticks, each once: bin by
    /// bin, as [`Timeline::over`] has them.
    pub fn around<'a>(
        &'a self,
        footprint: &Footprint,
        start: Tick,
        end: Tick,
        mut f: impl FnMut(u32, &'a Item),
    ) {
        let bins = self.ground.bins(footprint);
        for bin in self.ground.rows(bins).flatten() {
            let entries = self.bins[bin].during(start, end);
            for entry in entries.filter(|it| self.ground.is_first_common(bin, bins, it.bins)) {
                f(entry.item, &self.items[entry.item as usize]);
            }
        }
    }

    /// Every item over a bin between two ticks: in order of time, those that never end last.
    pub fn over(&self, bin: usize, start: Tick, end: Tick) -> impl Iterator<Item = (u32, &Item)> {
        let entries = self.bins[bin].during(start, end);
        entries.map(|entry| (entry.item, &self.items[entry.item as usize]))
    }
}

fn settle_latest(entries: &mut [BinEntry], from: usize) {
    let mut latest = match from.checked_sub(1) {
        Some(before) => entries[before].latest,
        None => Tick(0),
    };
    for entry in &mut entries[from..] {
        latest = latest.max(entry.end);
        entry.latest = latest;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::leg::KindId;

    fn leg(drone: u32, from_m: [f64; 2], to_m: [f64; 2], start: u32, end: Tick) -> Leg {
        Leg {
            drone: DroneId(drone),
            kind: KindId(0),
            start: Tick(start),
            end,
            from_m: Point3::new(from_m[0], from_m[1], 1.0),
            to_m: Point3::new(to_m[0], to_m[1], 1.0),
            flying: true,
            air_limit: 0.3,
        }
    }

    fn at(index: u32) -> f64 {
        (f64::from(index) * 0.754_877_666_246_69).fract()
    }

    #[test]
    fn the_bins_find_what_a_plain_scan_finds() {
        let ground = Ground::new([0.0, 0.0], [18.0, 19.0], 1.0);
        let mut timeline = Timeline::new(ground, 60);
        let mut legs: Vec<Leg> = (0..60_u32)
            .map(|i| {
                let place = |k: u32| [20.0 * at(9 * i + k), 20.0 * at(9 * i + k + 1)];
                if i % 5 == 0 {
                    leg(i, place(1), place(1), 37 * i, Tick::FOREVER)
                } else {
                    leg(i, place(1), place(3), 37 * i, Tick(37 * i + 450))
                }
            })
            .collect();
        for leg in &legs {
            timeline.add(*leg, [leg.start, leg.end], 0.0);
        }
        let removed = |drone: u32| drone % 3 == 1;
        for drone in (0..60).filter(|drone| removed(*drone)) {
            timeline.remove(DroneId(drone));
        }
        legs.retain(|leg| !removed(leg.drone.0));
        for query in 0..400 {
            let middle = leg(
                0,
                [20.0 * at(query + 7); 2],
                [20.0 * at(query + 9); 2],
                0,
                Tick(1),
            );
            let footprint = Footprint::around(&middle, 3.0 * at(query));
            let start = Tick((2500.0 * at(query + 3)) as u32);
            let end = start.after(1 + (500.0 * at(query + 4)) as u32);
            let near = |leg: &&Leg| {
                Footprint::around(leg, 0.0).gap_m(&footprint) == 0.0
                    && leg.start < end
                    && start < leg.end
            };
            let scanned: Vec<u32> = legs.iter().filter(near).map(|leg| leg.drone.0).collect();
            let mut found = Vec::new();
            timeline.around(&footprint, start, end, |_, item| {
                if item.footprint.gap_m(&footprint) == 0.0 {
                    found.push(item.leg.drone.0);
                }
            });
            found.sort_unstable();
            assert_eq!(found, scanned);
        }
    }

    #[test]
    fn loads_add_up_only_where_they_last_together() {
        let incoming =
            [(0, 10, 300), (10, 20, 500), (15, 40, 400)].map(|(start, end, load)| IncomingLoad {
                from: DroneId(start),
                start: Tick(start),
                end: Tick(end),
                load,
            });
        assert_eq!(peak(&incoming, Tick(0), Tick::FOREVER), 900);
        assert_eq!(peak(&incoming, Tick(0), Tick(15)), 500);
        assert_eq!(peak(&incoming, Tick(20), Tick(30)), 400);
        assert_eq!(peak(&incoming, Tick(50), Tick::FOREVER), 0);
    }
}
