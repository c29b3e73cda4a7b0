//! How many may do something at once, and how many of them from one address.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Places, at most half of them for one address: a flood leaves others the rest.
#[derive(Debug)]
pub(super) struct Places {
    most: usize,
    taken: Mutex<HashMap<IpAddr, usize>>,
}

/// A place, until it is dropped.
#[derive(Debug)]
pub(super) struct Place {
    of: Arc<Places>,
    address: IpAddr,
}

impl Places {
    pub(super) fn new(most: u32) -> Arc<Places> {
        Arc::new(Places {
            most: most as usize,
            taken: Mutex::default(),
        })
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<IpAddr, usize>> {
        // Plain numbers: a panic elsewhere cannot have left them half-written.
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A place for an address, if there is one.
    pub(super) fn take(self: &Arc<Places>, address: IpAddr) -> Option<Place> {
        let mut taken = self.lock();
        let all: usize = taken.values().sum();
        let of_address = taken.get(&address).copied().unwrap_or(0);
        if all >= self.most || of_address >= self.most.div_ceil(2) {
            return None;
        }
        taken.insert(address, of_address + 1);
        drop(taken);
        Some(Place {
            of: Arc::clone(self),
            address,
        })
    }

    /// How many are taken.
    pub(super) fn taken(&self) -> usize {
        self.lock().values().sum()
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = self.of.lock();
        if let Some(count) = taken.get_mut(&self.address) {
            *count -= 1;
            if *count == 0 {
                taken.remove(&self.address);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_address_takes_at_most_half_of_the_places_and_gives_them_back() {
        let places = Places::new(4);
        let [first, second, third] = [1, 2, 3].map(|last| IpAddr::from([127, 0, 0, last]));
        let held: Vec<Place> = (0..3).filter_map(|_| places.take(first)).collect();
        assert_eq!(held.len(), 2);
        let others: Vec<Place> = (0..3).filter_map(|_| places.take(second)).collect();
        assert_eq!(others.len(), 2);
        assert!(places.take(third).is_none());
        drop(held);
        assert_eq!(places.taken(), 2);
        assert!(places.take(third).is_some());
    }
}
