//! The legs that exist in each second, in one parry tree a second.
//!
//! Prioritized planning asks "who is near here then" for every step it considers, and mostly appends.
//! One `Bvh` per bucket of time answers faster than one tree with a time filter, or than a tree of
//! boxes in space and time. A leg is cut at the bucket's ends; what lasts for ever stands in every
//! bucket there is, and in one more for the time after. Removed legs leave a gap until a quarter of
//! a bucket is gaps: `Bvh::remove` is slower than the rebuild it saves.

use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};

use crate::leg::{DroneId, Leg, Tick};

/// Length of a bucket: chosen here, a drone flies one or two cells in a second.
const BUCKET_TICKS: u32 = 100;

/// A leg cut to one bucket.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Item {
    /// The part within the bucket.
    pub leg: Leg,
    /// When the whole leg began.
    pub began: Tick,
    /// When the whole leg ends.
    pub clear: Tick,
    /// Height at which its wake ends (m).
    pub wake_end_z_m: f64,
    /// Bound on the budget that the wakes of all others fill, in millionths.
    pub load: u64,
}

#[derive(Clone, Debug)]
struct Bucket {
    items: Vec<Item>,
    alive: Vec<bool>,
    gaps: usize,
    tree: Bvh,
}

/// All legs of a fleet over time.
#[derive(Clone, Debug)]
pub struct Timeline {
    buckets: Vec<Bucket>,
    /// What lasts for ever, after the last bucket.
    after: Bucket,
}

/// A place in a [`Timeline`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Slot {
    /// Which bucket; one past the last stands for the time after.
    pub bucket: u32,
    /// Which item there.
    pub item: u32,
}

/// A horizontal box: everything above and below it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Lowest x and y (m).
    pub min_m: [f64; 2],
    /// Highest x and y (m).
    pub max_m: [f64; 2],
}

impl Footprint {
    /// The box around a leg, wider by a margin on every side.
    pub fn around(leg: &Leg, margin_m: f64) -> Footprint {
        Footprint {
            min_m: [
                leg.from_m.x.min(leg.to_m.x) - margin_m,
                leg.from_m.y.min(leg.to_m.y) - margin_m,
            ],
            max_m: [
                leg.from_m.x.max(leg.to_m.x) + margin_m,
                leg.from_m.y.max(leg.to_m.y) + margin_m,
            ],
        }
    }

    /// Whether two of them have a point in common.
    pub fn meets(&self, other: &Footprint) -> bool {
        (0..2).all(|axis| {
            self.min_m[axis] <= other.max_m[axis] && other.min_m[axis] <= self.max_m[axis]
        })
    }

    /// As a parry box of the height of every world.
    fn tall(&self) -> Aabb {
        const TALL_M: f64 = 1e9;
        Aabb::new(
            Vector::new(self.min_m[0], self.min_m[1], -TALL_M),
            Vector::new(self.max_m[0], self.max_m[1], TALL_M),
        )
    }
}

impl Bucket {
    fn new() -> Bucket {
        Bucket {
            items: Vec::new(),
            alive: Vec::new(),
            gaps: 0,
            tree: Bvh::new(),
        }
    }

    fn add(&mut self, item: Item) -> u32 {
        let index = self.items.len() as u32;
        self.tree
            .insert(Footprint::around(&item.leg, 0.0).tall(), index);
        self.items.push(item);
        self.alive.push(true);
        index
    }

    fn drop_gaps(&mut self) {
        if self.gaps * 4 <= self.items.len() {
            return;
        }
        let mut alive = std::mem::take(&mut self.alive).into_iter();
        self.items.retain(|_| alive.next().unwrap_or(false));
        self.alive = vec![true; self.items.len()];
        self.gaps = 0;
        let boxes: Vec<Aabb> = self
            .items
            .iter()
            .map(|item| Footprint::around(&item.leg, 0.0).tall())
            .collect();
        self.tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    }
}

impl Default for Timeline {
    fn default() -> Timeline {
        Timeline {
            buckets: Vec::new(),
            after: Bucket::new(),
        }
    }
}

impl Timeline {
    /// The first moment after the last bucket.
    pub fn horizon(&self) -> Tick {
        Tick(self.buckets.len() as u32 * BUCKET_TICKS)
    }

    /// Buckets that end.
    pub fn bucket_count(&self) -> usize {
        self.buckets.len()
    }

    /// Makes buckets up to a moment; what lasts for ever is in them from the start.
    pub fn extend_to(&mut self, moment: Tick) {
        while self.horizon() < moment {
            let start = self.horizon();
            let end = start.after(BUCKET_TICKS);
            let mut bucket = Bucket::new();
            for (item, alive) in self.after.items.iter().zip(&self.after.alive) {
                if *alive {
                    let leg = Leg {
                        start: start.max(item.leg.start),
                        end,
                        ..item.leg
                    };
                    bucket.add(Item { leg, ..*item });
                }
            }
            self.buckets.push(bucket);
        }
    }

    /// Buckets that a span of time touches, the time after included.
    pub fn buckets(&self, start: Tick, end: Tick) -> std::ops::Range<u32> {
        let last = self.buckets.len() as u32;
        let first = (start.0 / BUCKET_TICKS).min(last);
        let past = if end > self.horizon() {
            last + 1
        } else {
            end.0.div_ceil(BUCKET_TICKS)
        };
        first..past.max(first + 1)
    }

    /// When a bucket begins and ends.
    pub fn span(&self, bucket: u32) -> (Tick, Tick) {
        let start = Tick(bucket * BUCKET_TICKS);
        if (bucket as usize) < self.buckets.len() {
            (start, start.after(BUCKET_TICKS))
        } else {
            (start, Tick::FOREVER)
        }
    }

    fn bucket(&self, bucket: u32) -> &Bucket {
        self.buckets.get(bucket as usize).unwrap_or(&self.after)
    }

    fn bucket_mut(&mut self, bucket: u32) -> &mut Bucket {
        self.buckets
            .get_mut(bucket as usize)
            .unwrap_or(&mut self.after)
    }

    /// Puts an item, already cut to the bucket, into it.
    pub fn add(&mut self, bucket: u32, item: Item) -> Slot {
        let item = self.bucket_mut(bucket).add(item);
        Slot { bucket, item }
    }

    /// What stands in a slot.
    pub fn item(&self, slot: Slot) -> &Item {
        &self.bucket(slot.bucket).items[slot.item as usize]
    }

    /// Changes the load of what stands in a slot.
    pub fn item_mut(&mut self, slot: Slot) -> &mut Item {
        &mut self.bucket_mut(slot.bucket).items[slot.item as usize]
    }

    /// The slots of one bucket whose legs come near a footprint, in no particular order.
    pub fn near(&self, bucket: u32, footprint: &Footprint, found: &mut Vec<Slot>) {
        let content = self.bucket(bucket);
        if content.items.is_empty() {
            return;
        }
        let tall = footprint.tall();
        found.extend(
            content
                .tree
                .intersect_aabb(&tall)
                .filter(|&item| content.alive[item as usize])
                .map(|item| Slot { bucket, item }),
        );
    }

    /// The slots of one drone in one bucket.
    pub fn of(&self, bucket: u32, drone: DroneId) -> Vec<Slot> {
        let content = self.bucket(bucket);
        (0..content.items.len() as u32)
            .filter(|&item| {
                content.alive[item as usize] && content.items[item as usize].leg.drone == drone
            })
            .map(|item| Slot { bucket, item })
            .collect()
    }

    /// Takes slots of one bucket out; other slots of that bucket are void after.
    pub fn remove(&mut self, bucket: u32, slots: &[Slot]) {
        let content = self.bucket_mut(bucket);
        for slot in slots {
            content.alive[slot.item as usize] = false;
            content.gaps += 1;
        }
        content.drop_gaps();
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

    fn insert(timeline: &mut Timeline, leg: &Leg) {
        let last = if leg.end == Tick::FOREVER {
            leg.start
        } else {
            leg.end
        };
        timeline.extend_to(last);
        for bucket in timeline.buckets(leg.start, leg.end) {
            let (start, end) = timeline.span(bucket);
            let part = leg.between(start, end);
            if part.start < part.end {
                let item = Item {
                    leg: part,
                    began: leg.start,
                    clear: leg.end,
                    wake_end_z_m: 0.0,
                    load: 0,
                };
                timeline.add(bucket, item);
            }
        }
    }

    fn at(index: u32) -> f64 {
        (f64::from(index) * 0.754_877_666_246_69).fract()
    }

    fn drones_near(timeline: &Timeline, bucket: u32, footprint: &Footprint) -> Vec<u32> {
        let mut found = Vec::new();
        timeline.near(bucket, footprint, &mut found);
        let mut drones: Vec<u32> = found
            .iter()
            .map(|&slot| timeline.item(slot).leg.drone.0)
            .collect();
        drones.sort_unstable();
        drones.dedup();
        drones
    }

    #[test]
    fn the_tree_finds_what_a_plain_scan_finds() {
        let mut timeline = Timeline::default();
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
            insert(&mut timeline, leg);
        }
        let removed = |drone: u32| drone % 3 == 1;
        for bucket in 0..=timeline.bucket_count() as u32 {
            for drone in (0..60).filter(|drone| removed(*drone)) {
                let slots = timeline.of(bucket, DroneId(drone));
                timeline.remove(bucket, &slots);
            }
        }
        legs.retain(|leg| !removed(leg.drone.0));
        for bucket in 0..=timeline.bucket_count() as u32 {
            let (start, end) = timeline.span(bucket);
            for query in 0..40 {
                let middle = leg(
                    0,
                    [20.0 * at(query + 7); 2],
                    [20.0 * at(query + 9); 2],
                    0,
                    Tick(1),
                );
                let footprint = Footprint::around(&middle, 3.0 * at(query));
                let scanned: Vec<u32> = legs
                    .iter()
                    .map(|leg| leg.between(start, end))
                    .filter(|part| part.start < part.end)
                    .filter(|part| footprint.meets(&Footprint::around(part, 0.0)))
                    .map(|part| part.drone.0)
                    .collect();
                assert_eq!(drones_near(&timeline, bucket, &footprint), scanned);
            }
        }
    }

    #[test]
    fn what_lasts_for_ever_is_in_buckets_made_later() {
        let mut timeline = Timeline::default();
        insert(
            &mut timeline,
            &leg(7, [1.0, 1.0], [1.0, 1.0], 130, Tick::FOREVER),
        );
        insert(
            &mut timeline,
            &leg(8, [9.0, 9.0], [9.0, 8.0], 0, Tick(1_000)),
        );
        let here = Footprint::around(&leg(0, [1.0, 1.0], [1.0, 1.0], 0, Tick(1)), 0.1);
        assert_eq!(timeline.bucket_count(), 10);
        // It begins within the second bucket; the last one is the time after.
        assert!(drones_near(&timeline, 0, &here).is_empty());
        for bucket in 1..=10 {
            assert_eq!(drones_near(&timeline, bucket, &here), [7]);
            let slot = timeline.of(bucket, DroneId(7))[0];
            let item = timeline.item(slot);
            assert!(
                item.leg.start <= Tick((bucket * 100).max(130)),
                "{bucket}: {item:?}"
            );
            assert_eq!((item.began, item.clear), (Tick(130), Tick::FOREVER));
        }
    }
}
