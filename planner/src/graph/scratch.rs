//! A number for each place, zero at first: what searches write on.
//!
//! A buffer is wiped where it was written on, and used again by the next search of its thread: a
//! new one takes as long to fill as a short search.

use std::cell::RefCell;

use crate::graph::roadmap::Vertex;

/// Wiped buffers that a thread keeps: chosen here, a search uses two at a time.
const MOST_WIPED: usize = 4;

thread_local! {
    /// Buffers of zeros, by length, that searches of this thread have given back.
    static WIPED: RefCell<Vec<Vec<u32>>> = const { RefCell::new(Vec::new()) };
}

/// A number for each place.
#[derive(Debug, Default)]
pub(crate) struct ScratchBuffer {
    /// By place.
    numbers: Vec<u32>,
    /// Places that are not zero any more.
    written: Vec<Vertex>,
}

impl ScratchBuffer {
    /// So many zeros.
    pub(crate) fn new(places: usize) -> ScratchBuffer {
        let wiped = WIPED.with_borrow_mut(|wiped| {
            let index = wiped.iter().position(|buffer| buffer.len() == places)?;
            Some(wiped.remove(index))
        });
        ScratchBuffer {
            numbers: wiped.unwrap_or_else(|| vec![0; places]),
            written: Vec::new(),
        }
    }

    /// Whether there is room for no place at all.
    pub(crate) fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    /// The number of a place.
    #[inline]
    pub(crate) fn get(&self, place: Vertex) -> u32 {
        self.numbers[place as usize]
    }

    /// Writes the number of a place; anything but 0 is wiped when the buffer is dropped.
    #[inline]
    pub(crate) fn set(&mut self, place: Vertex, number: u32) {
        let known = &mut self.numbers[place as usize];
        if *known == 0 {
            self.written.push(place);
        }
        *known = number;
    }
}

impl Drop for ScratchBuffer {
    fn drop(&mut self) {
        for place in &self.written {
            self.numbers[*place as usize] = 0;
        }
        let numbers = std::mem::take(&mut self.numbers);
        if numbers.is_empty() {
            return;
        }
        // A thread that is ending keeps none.
        let _ = WIPED.try_with(|wiped| {
            let mut wiped = wiped.borrow_mut();
            wiped.push(numbers);
            if wiped.len() > MOST_WIPED {
                wiped.remove(0);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_buffer_is_blank_after_any_use() {
        for round in 0..5 {
            let mut buffers = [
                ScratchBuffer::new(100),
                ScratchBuffer::new(100),
                ScratchBuffer::new(7),
            ];
            for buffer in &mut buffers {
                assert!((0..7).all(|place| buffer.get(place) == 0));
                buffer.set(round, 3);
                buffer.set(round, 4);
                assert_eq!(buffer.get(round), 4);
            }
            assert!(!buffers[0].is_empty() && ScratchBuffer::default().is_empty());
        }
        let kept = WIPED.with_borrow(|wiped| wiped.iter().map(Vec::len).collect::<Vec<_>>());
        assert_eq!(kept.iter().filter(|len| **len == 100).count(), 2);
        assert!(kept.len() <= MOST_WIPED);
    }
}
