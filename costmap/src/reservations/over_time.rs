//! A value that changes over time, kept once for as long as it stays the same: memory grows with
//! how often it changes, not with the clock.

use std::ops::Range;

use crate::leg::{Leg, Tick};

/// Length of a bucket: chosen here, a drone flies one or two cells in a second.
pub const BUCKET_TICKS: u32 = 100;
/// A leg on the move is looked at in parts of whole buckets, in each of which it moves about so far
/// (m); chosen here, half a typical bin: legs at 0.5 m/s and faster have parts of one bucket.
const PART_M: f64 = 0.5;
/// No part has more buckets; chosen here: an hour.
const MOST_BUCKETS: f64 = 3600.0;

/// The buckets that a span of time touches; what does not end has no last one (`u32::MAX`).
pub(crate) fn buckets(start: Tick, end: Tick) -> Range<u32> {
    let first = start.0 / BUCKET_TICKS;
    let past = match end {
        Tick::FOREVER => u32::MAX,
        end => end.0.div_ceil(BUCKET_TICKS),
    };
    first..past.max(first + 1)
}

/// When a bucket begins; `u32::MAX`: never.
pub(crate) fn begins(bucket: u32) -> Tick {
    Tick(bucket.saturating_mul(BUCKET_TICKS))
}

/// The ticks of a part of a leg on the move: whole buckets.
pub(crate) fn part_ticks(leg: &Leg) -> u32 {
    let ticks = f64::from(leg.end.0 - leg.start.0);
    let length_m = (leg.to_m - leg.from_m).norm();
    let buckets = PART_M * ticks / (length_m * f64::from(BUCKET_TICKS));
    BUCKET_TICKS * buckets.clamp(1.0, MOST_BUCKETS) as u32
}

/// The spans of buckets in which a leg is looked at: whole where it stays, part by part where it
/// moves.
pub(crate) fn spans(leg: &Leg, within: Range<u32>) -> impl Iterator<Item = Range<u32>> + use<> {
    let step = match leg.stays() {
        true => u32::MAX,
        false => part_ticks(leg) / BUCKET_TICKS,
    };
    let mut next = within.start;
    std::iter::from_fn(move || {
        let start = next;
        next = start.saturating_add(step).min(within.end);
        (start < next).then_some(start..next)
    })
}

/// A value for every bucket of time.
#[derive(Clone, Debug)]
pub(crate) struct OverTime<T> {
    /// The first bucket of each value, ascending from 0; each lasts to the next, the last without
    /// end.
    from: Vec<u32>,
    /// As many.
    values: Vec<T>,
}

impl<T: Clone> OverTime<T> {
    /// The same at all times.
    pub(crate) fn new(value: T) -> OverTime<T> {
        OverTime {
            from: vec![0],
            values: vec![value],
        }
    }

    /// The values in some buckets.
    pub(crate) fn during(&self, buckets: Range<u32>) -> &[T] {
        let first = self.index(buckets.start);
        let past = match buckets.end {
            u32::MAX => self.from.len(),
            end => self.index(end - 1) + 1,
        };
        &self.values[first..past]
    }

    /// The values in some buckets and in no others.
    pub(crate) fn during_mut(&mut self, buckets: Range<u32>) -> &mut [T] {
        let first = self.cut(buckets.start);
        let past = match buckets.end {
            u32::MAX => self.from.len(),
            end => self.cut(end),
        };
        &mut self.values[first..past]
    }

    /// Index of the value in a bucket. While every bucket has its own, that is the bucket's number.
    fn index(&self, bucket: u32) -> usize {
        let number = (bucket as usize).min(self.from.len() - 1);
        match self.from[number] == bucket {
            true => number,
            false => self.from.partition_point(|from| *from <= bucket) - 1,
        }
    }

    /// Index of the value that begins with a bucket; one begins there from now on.
    fn cut(&mut self, bucket: u32) -> usize {
        let index = self.index(bucket);
        if self.from[index] == bucket {
            return index;
        }
        self.from.insert(index + 1, bucket);
        self.values.insert(index + 1, self.values[index].clone());
        index + 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bucket_has_the_value_that_a_plain_list_has() {
        let mut kept = OverTime::new(0_u32);
        let mut plain = vec![0_u32; 300];
        for k in 0..200_u32 {
            let at = |n: u32| (f64::from(3 * k + n) * 0.754_877_666_246_69).fract();
            let start = (250.0 * at(1)) as u32;
            let end = match k % 7 {
                0 => u32::MAX,
                _ => start + 1 + (40.0 * at(2)) as u32,
            };
            kept.during_mut(start..end)
                .iter_mut()
                .for_each(|it| *it += k);
            for it in &mut plain[start as usize..(end as usize).min(300)] {
                *it += k;
            }
            let from = (280.0 * at(3)) as u32;
            let most = kept.during(from..from + 15).iter().max();
            assert_eq!(most, plain[from as usize..from as usize + 15].iter().max());
        }
    }

    #[test]
    fn what_lasts_is_kept_once_however_long() {
        let mut kept = OverTime::new(0);
        let late = 86_400 * 200;
        kept.during_mut(late..late + 5).fill(1);
        kept.during_mut(10..late).fill(2);
        assert_eq!(kept.values, [0, 2, 1, 0]);
    }
}
