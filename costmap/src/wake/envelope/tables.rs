//! Tables of a wake for each of its receivers, kept for as long as the process runs: one fleet is
//! planned several times, by other rules, on finer cells and after every change, and what flies in
//! it stays the same.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use airflow::{DiscPoints, Wake};
use rayon::prelude::*;

use super::Envelope;

/// Cells of the tables that are kept, of 8 bytes each, chosen here: those of hover jets of a fleet
/// of 32 airframes, or some twenty leaning or bent ones.
const MOST_KEPT: usize = 4 << 20;

/// Tables that were made together, and all that they depend on.
struct CachedTables {
    wake: Wake,
    receivers: Vec<(DiscPoints, f64)>,
    /// How deep, and how far off the path (m).
    terms: [f64; 2],
    tables: Vec<Arc<Envelope>>,
}

impl CachedTables {
    fn cells(&self) -> usize {
        let cells = self.tables.iter().map(|it| it.squares.len());
        cells.sum()
    }
}

/// The oldest first.
static KEPT: Mutex<VecDeque<CachedTables>> = Mutex::new(VecDeque::new());

/// A wake's receiver: the points of its discs, and the mean square that counts as still air to it.
type TableReceiver<'a> = (&'a DiscPoints, f64);

/// Tables of one wake for several receivers, down to a depth, for receivers that may be so far from
/// where they seem (m).
pub(crate) fn of_each(
    wake: &Wake,
    receivers: &[TableReceiver<'_>],
    terms: [f64; 2],
) -> Vec<Arc<Envelope>> {
    match wake.is_shaped() {
        // What a moved jet is like is worked out once for all of them.
        true => kept_or_made(wake, receivers, terms),
        false => {
            let alone = receivers.par_iter().map(std::slice::from_ref);
            let each = alone.map(|it| kept_or_made(wake, it, terms));
            each.flatten_iter().collect()
        }
    }
}

fn kept_or_made(
    wake: &Wake,
    receivers: &[TableReceiver<'_>],
    [deepest_m, relative_deviation_m]: [f64; 2],
) -> Vec<Arc<Envelope>> {
    known(wake, receivers, [deepest_m, relative_deviation_m]).unwrap_or_else(|| {
        let tables = match relative_deviation_m {
            0.0 => Envelope::of_each(wake, receivers, deepest_m).into_iter(),
            _ => {
                let exact = kept_or_made(wake, receivers, [deepest_m, 0.0]).into_par_iter();
                let grown = exact.map(|it| Envelope::clone(&it).grown(relative_deviation_m));
                grown.collect::<Vec<_>>().into_iter()
            }
        };
        let tables: Vec<Arc<Envelope>> = tables.map(Arc::new).collect();
        let receivers = receivers.iter();
        keep(CachedTables {
            wake: wake.clone(),
            receivers: receivers
                .map(|&(discs, still)| (discs.clone(), still))
                .collect(),
            terms: [deepest_m, relative_deviation_m],
            tables: tables.clone(),
        });
        tables
    })
}

fn known(
    wake: &Wake,
    receivers: &[TableReceiver<'_>],
    terms: [f64; 2],
) -> Option<Vec<Arc<Envelope>>> {
    let same = |it: &&CachedTables| {
        let own = it.receivers.iter().map(|(discs, still)| (discs, *still));
        it.terms == terms && own.eq(receivers.iter().copied()) && it.wake.is_same(wake)
    };
    let kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    kept.iter().find(same).map(|it| it.tables.clone())
}

fn keep(made: CachedTables) {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    kept.push_back(made);
    let mut cells: usize = kept.iter().map(CachedTables::cells).sum();
    while cells > MOST_KEPT {
        cells -= kept.pop_front().map_or(cells, |oldest| oldest.cells());
    }
}
