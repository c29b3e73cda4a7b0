//! A queue of places by whole ticks: one list for each, all in one array.

use crate::graph::roadmap::Vertex;

/// The end of a list.
const NOTHING: u32 = u32::MAX;

/// Places that wait in buckets; of one bucket the newest comes first.
#[derive(Debug, Default)]
pub(super) struct Buckets {
    /// The newest entry of each bucket.
    newest: Vec<u32>,
    /// Places, each with the entry before it in its bucket.
    entries: Vec<(Vertex, u32)>,
}

impl Buckets {
    /// Buckets up to the last that ever held a place.
    pub(super) fn len(&self) -> usize {
        self.newest.len()
    }

    /// Puts a place into the bucket of so many ticks.
    pub(super) fn push(&mut self, bucket: usize, place: Vertex) {
        if self.newest.len() <= bucket {
            self.newest.resize(bucket + 1, NOTHING);
        }
        let before = std::mem::replace(&mut self.newest[bucket], self.entries.len() as u32);
        self.entries.push((place, before));
    }

    /// Takes the newest place out of a bucket, if there is one.
    pub(super) fn pop(&mut self, bucket: usize) -> Option<Vertex> {
        let newest = &mut self.newest[bucket];
        let (place, before) = *self.entries.get(*newest as usize)?;
        *newest = before;
        Some(place)
    }
}
