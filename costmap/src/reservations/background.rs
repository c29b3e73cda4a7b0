//! The far-wake background: what weak wakes from farther off add up to at most, by place and time.
//!
//! Beyond [`Fleet::pairwise_within_m`] no wake is worth looking at one by one, but many together
//! may be. So every bin of the floor keeps, second by second, the sum of what drones that far off
//! can bring to a drone in it; seconds in which nothing changes are kept once.

use std::ops::Range;
use std::sync::Arc;

use crate::leg::{Leg, Tick};
use crate::reservations::ground::{Bins, Footprint, Ground};
use crate::reservations::over_time::{BUCKET_TICKS, OverTime, begins, buckets, spans};
use crate::wake::fleet::Fleet;

/// A number for every bin, by rows; rows that are the same at several times are kept once.
type Sums = Vec<Arc<Vec<u32>>>;

/// Sums of weak loads, in millionths of the lowest budget of the fleet.
#[derive(Clone, Debug)]
pub(crate) struct FarWakes {
    /// By time and bin.
    sums: OverTime<Sums>,
    /// Bins in a row.
    width: usize,
    /// By bin, the greatest sum of weak loads there has ever been.
    worst: Vec<u32>,
}

/// In which buckets how much falls into which bin.
#[derive(Clone, Debug)]
pub(crate) struct FarWakeLoads {
    during: Range<u32>,
    /// Row by row.
    loads: Vec<(usize, u32)>,
}

impl FarWakes {
    pub(crate) fn new(ground: &Ground) -> FarWakes {
        let row = Arc::new(vec![0; ground.width()]);
        FarWakes {
            sums: OverTime::new(vec![row; ground.row_count()]),
            width: ground.width(),
            worst: vec![0; ground.count()],
        }
    }

    /// Adds what a drone brings to others.
    pub(crate) fn add(&mut self, far_wake_loads: &[FarWakeLoads]) {
        let mut worst = std::mem::take(&mut self.worst);
        self.change(far_wake_loads, |bin, sum, load| {
            *sum += load;
            worst[bin] = (*sum).max(worst[bin]);
        });
        self.worst = worst;
    }

    pub(crate) fn take_back(&mut self, far_wake_loads: &[FarWakeLoads]) {
        self.change(far_wake_loads, |_, sum, load| *sum -= load);
    }

    fn change(
        &mut self,
        far_wake_loads: &[FarWakeLoads],
        mut change: impl FnMut(usize, &mut u32, u32),
    ) {
        let width = self.width;
        for span_loads in far_wake_loads
            .iter()
            .filter(|span_loads| !span_loads.loads.is_empty())
        {
            for sums in self.sums.during_mut(span_loads.during.clone()) {
                for row in (span_loads.loads).chunk_by(|a, b| a.0 / width == b.0 / width) {
                    let sums = Arc::make_mut(&mut sums[row[0].0 / width]);
                    for &(bin, load) in row {
                        change(bin, &mut sums[bin % width], load);
                    }
                }
            }
        }
    }

    /// The most that far wakes bring to a drone over some bins, at any moment between two ticks.
    pub(crate) fn on(&self, ground: &Ground, bins: Bins, start: Tick, end: Tick) -> u64 {
        let mut most = 0;
        for sums in self.sums.during(buckets(start, end)) {
            for row in ground.rows(bins) {
                let (y, x) = (row.start / self.width, row.start % self.width);
                let sums = &sums[y][x..x + row.len()];
                most = sums.iter().fold(most, |most, sum| most.max(*sum));
            }
        }
        u64::from(most)
    }

    /// The most that weak wakes bring, or have brought, to a drone in a bin.
    pub(crate) fn worst_in(&self, bin: usize) -> u64 {
        u64::from(self.worst[bin])
    }

    /// The same over some bins.
    pub(crate) fn worst(&self, ground: &Ground, bins: Bins) -> u64 {
        let bins = ground.rows(bins).flatten();
        bins.map(|bin| self.worst_in(bin)).max().unwrap_or(0)
    }
}

/// What a drone on these legs brings to every bin that it is not near to, at most, bucket by
/// bucket, however early or late it is and its air comes: every drone on its own, so that sums of
/// these bound what all of them bring at any one moment.
pub(crate) fn far_wake_loads(
    fleet: &Fleet,
    ground: &Ground,
    floor_z_m: f64,
    legs: &[Leg],
) -> Vec<FarWakeLoads> {
    let (Some(first), Some(last)) = (legs.first(), legs.last()) else {
        return Vec::new();
    };
    let early = fleet.conditions().shift;
    let delays = legs.iter().map(|leg| fleet.delay_down_to(leg, floor_z_m));
    let late = delays.max().unwrap_or(0) + early;
    let mut far_wake_loads = Vec::new();
    let mut next = 0;
    let mut bucket = first.start.before(early).0 / BUCKET_TICKS;
    while begins(bucket) < last.end.after(late) {
        let start = begins(bucket);
        while legs[next].end.after(late) <= start && next + 1 < legs.len() {
            next += 1;
        }
        let during = alike(&legs[next], bucket);
        let end = begins(during.end);
        let parts: Vec<Leg> = legs[next..]
            .iter()
            .take_while(|leg| leg.start.before(early) < end)
            .filter(|leg| leg.flying)
            .map(|leg| leg.between(start.before(late), end.after(early)))
            .filter(|part| part.start < part.end)
            .collect();
        bucket = during.end;
        far_wake_loads.push(FarWakeLoads {
            during,
            loads: loads(fleet, ground, &parts),
        });
    }
    far_wake_loads
}

/// Buckets from one on in which a leg that lasts at its beginning is looked at as one: a single one
/// unless it fills several.
fn alike(leg: &Leg, bucket: u32) -> Range<u32> {
    if leg.end == Tick::FOREVER && leg.start <= begins(bucket) {
        return bucket..u32::MAX;
    }
    let filled = leg.end.0 / BUCKET_TICKS;
    let is_filled = leg.start <= begins(bucket) && bucket + 1 < filled;
    let span = is_filled.then(|| spans(leg, bucket..filled).next());
    span.flatten().unwrap_or(bucket..bucket + 1)
}

fn loads(fleet: &Fleet, ground: &Ground, parts: &[Leg]) -> Vec<(usize, u32)> {
    let around = parts
        .iter()
        .map(|part| Footprint::around(part, fleet.wake_reach_m(part.kind)))
        .reduce(|a, b| a.joined(&b));
    let Some(around) = around else {
        return Vec::new();
    };
    let bins = ground.bins(&around);
    let mut loads: Vec<(usize, u32)> = Vec::with_capacity(bins.count());
    loads.extend(ground.rows(bins).flatten().map(|bin| (bin, 0)));
    for part in parts {
        let gaps_m = ground.gaps_m(&Footprint::around(part, 0.0), bins);
        for ((_, most), gap_m) in loads.iter_mut().zip(gaps_m) {
            if gap_m >= fleet.pairwise_within_m() {
                *most = fleet.far_load_on_any(part.kind, gap_m).max(*most);
            }
        }
    }
    loads.retain(|(_, load)| *load > 0);
    loads
}
