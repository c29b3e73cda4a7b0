//! Tables of a wake for each of its receivers. Those of hover jets are kept for as long as the
//! process runs: one fleet is planned several times, by other rules, on finer cells and after every
//! change, and what flies in it stays the same.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use airflow::{DiscPoints, Wake};
use rayon::prelude::*;

use super::Envelope;

/// Tables that are kept, chosen here: 40 kB each, those of a fleet of 16 airframes.
const MOST_KEPT: usize = 256;

/// A table, and all that it depends on.
struct Kept {
    wake: Wake,
    discs: DiscPoints,
    /// How deep and how far astray (m), and the mean square that is still air.
    terms: [f64; 3],
    envelope: Arc<Envelope>,
}

/// The oldest first.
static KEPT: Mutex<VecDeque<Kept>> = Mutex::new(VecDeque::new());

/// Tables of one wake for several receivers, each with the mean square that counts as still air to
/// it, down to a depth, for receivers that may be so far from where they seem (m).
pub(crate) fn of_each(
    wake: &Wake,
    receivers: &[(&DiscPoints, f64)],
    [deepest_m, astray_m]: [f64; 2],
) -> Vec<Arc<Envelope>> {
    if wake.is_shaped() {
        let made = Envelope::of_moved(wake, receivers, deepest_m).into_par_iter();
        return made.map(|it| Arc::new(it.grown(astray_m))).collect();
    }
    let of_one = |&(discs, still): &(&DiscPoints, f64)| {
        let terms = [deepest_m, astray_m, still];
        known(wake, discs, terms).unwrap_or_else(|| {
            let made = Envelope::new(wake, discs, deepest_m, still).grown(astray_m);
            let envelope = Arc::new(made);
            keep(Kept {
                wake: wake.clone(),
                discs: discs.clone(),
                terms,
                envelope: envelope.clone(),
            });
            envelope
        })
    };
    receivers.par_iter().map(of_one).collect()
}

fn known(wake: &Wake, discs: &DiscPoints, terms: [f64; 3]) -> Option<Arc<Envelope>> {
    let kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let same =
        |it: &&Kept| it.terms == terms && it.discs == *discs && it.wake.is_same_hover_jet(wake);
    kept.iter().find(same).map(|it| it.envelope.clone())
}

fn keep(made: Kept) {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if kept.len() == MOST_KEPT {
        kept.pop_front();
    }
    kept.push_back(made);
}
