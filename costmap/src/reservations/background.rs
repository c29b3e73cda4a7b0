//! The far-wake background: what weak wakes from farther off add up to at most, by place and time.
//!
//! Beyond [`Fleet::near_m`] no wake is worth looking at one by one, but many together may be. So
//! every bin of the floor keeps, second by second, the sum of what those who are that far off can
//! bring to a drone in it.

use crate::leg::{Leg, Tick};
use crate::reservations::ground::{Footprint, Ground};
use crate::reservations::timeline::{BUCKET_TICKS, Timeline};
use crate::wake::fleet::Fleet;

/// Sums of weak loads, in millionths of the lowest budget of the fleet.
#[derive(Clone, Debug)]
pub(crate) struct FarWakes {
    /// By bucket and bin.
    sums: Vec<Vec<u32>>,
    /// After the last bucket, by bin.
    after: Vec<u32>,
    /// By bin, the greatest sum of weak loads there has ever been.
    worst: Vec<u32>,
}

/// From and to which bucket (`u32::MAX`: without end) how much falls into which bin.
#[derive(Clone, Debug)]
pub(crate) struct Spread {
    from: u32,
    to: u32,
    loads: Vec<(usize, u32)>,
}

impl FarWakes {
    pub(crate) fn new(ground: &Ground) -> FarWakes {
        FarWakes {
            sums: Vec::new(),
            after: vec![0; ground.count()],
            worst: vec![0; ground.count()],
        }
    }

    pub(crate) fn extend_to(&mut self, buckets: usize) {
        while self.sums.len() < buckets {
            self.sums.push(self.after.clone());
        }
    }

    /// Adds what a drone brings to others.
    pub(crate) fn add(&mut self, spreads: &[Spread]) {
        let mut worst = std::mem::take(&mut self.worst);
        self.change(spreads, |bin, sum, load| {
            *sum += load;
            worst[bin] = (*sum).max(worst[bin]);
        });
        self.worst = worst;
    }

    /// Takes it back.
    pub(crate) fn take_back(&mut self, spreads: &[Spread]) {
        self.change(spreads, |_, sum, load| *sum -= load);
    }

    fn change(&mut self, spreads: &[Spread], mut change: impl FnMut(usize, &mut u32, u32)) {
        for spread in spreads {
            let last = (spread.to as usize).min(self.sums.len());
            for sums in &mut self.sums[(spread.from as usize).min(last)..last] {
                for &(bin, load) in &spread.loads {
                    change(bin, &mut sums[bin], load);
                }
            }
            if spread.to == u32::MAX {
                for &(bin, load) in &spread.loads {
                    change(bin, &mut self.after[bin], load);
                }
            }
        }
    }

    /// The most that far wakes bring to a drone within a footprint, at any moment between two
    /// ticks.
    pub(crate) fn on(&self, timeline: &Timeline, at: &Footprint, start: Tick, end: Tick) -> u64 {
        let ground = timeline.ground();
        let bins = ground.bins(at);
        let mut most = 0;
        for bucket in timeline.buckets(start, end) {
            let sums = self.sums.get(bucket as usize).unwrap_or(&self.after);
            for row in ground.rows(bins) {
                most = sums[row].iter().fold(most, |most, sum| most.max(*sum));
            }
        }
        u64::from(most)
    }

    /// The most that weak wakes bring, or have brought, to a drone in a bin.
    pub(crate) fn worst_in(&self, bin: usize) -> u64 {
        u64::from(self.worst[bin])
    }

    /// The same within a footprint.
    pub(crate) fn worst(&self, ground: &Ground, at: &Footprint) -> u64 {
        let bins = ground.rows(ground.bins(at)).flatten();
        bins.map(|bin| self.worst_in(bin)).max().unwrap_or(0)
    }
}

/// What a drone on these legs brings to every bin that it is not near to, at most, bucket by
/// bucket.
pub(crate) fn spreads(fleet: &Fleet, ground: &Ground, legs: &[Leg]) -> Vec<Spread> {
    let (Some(first), Some(last)) = (legs.first(), legs.last()) else {
        return Vec::new();
    };
    let mut spreads = Vec::new();
    let mut next = 0;
    for bucket in first.start.0 / BUCKET_TICKS.. {
        let start = Tick(bucket * BUCKET_TICKS);
        if last.end <= start {
            break;
        }
        let lasts = last.end == Tick::FOREVER && last.start <= start;
        let end = if lasts {
            Tick::FOREVER
        } else {
            start.after(BUCKET_TICKS)
        };
        while legs[next].end <= start && next + 1 < legs.len() {
            next += 1;
        }
        let parts: Vec<Leg> = legs[next..]
            .iter()
            .take_while(|leg| leg.start < end)
            .filter(|leg| leg.flying)
            .map(|leg| leg.between(start, end))
            .filter(|part| part.start < part.end)
            .collect();
        spreads.push(Spread {
            from: bucket,
            to: if lasts { u32::MAX } else { bucket + 1 },
            loads: loads(fleet, ground, &parts),
        });
        if lasts {
            break;
        }
    }
    spreads
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
            if gap_m >= fleet.near_m() {
                *most = fleet.far_load_on_any(part.kind, gap_m).max(*most);
            }
        }
    }
    loads.retain(|(_, load)| *load > 0);
    loads
}
