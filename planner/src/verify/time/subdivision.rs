//! Where the air in a window is highest, where it exceeds a limit, and what it sums to, by
//! subdivision of time on bounds that close in on the value as spans shrink.
//!
//! A span is dropped when its upper bound is not above what is looked for, and halved otherwise,
//! down to [`SHORTEST_S`]. So what is dropped holds in continuous time; only what is left at the
//! shortest spans is judged by its middle.

use super::spans::{SHORTEST_S, join};
use super::window::Window;
use crate::verify::extents::Span;

/// A span of a window and, where they have been looked at, the values at its ends (m/s).
#[derive(Clone, Copy)]
pub(crate) struct Chord {
    /// From, until (s).
    pub(crate) span_s: Span,
    /// Mean air at both (m/s); `None`: not looked at yet.
    pub(crate) ends_mps: Option<(f64, f64)>,
}

impl Chord {
    /// Of a whole window.
    pub(crate) fn of(window: &Window<'_>) -> Chord {
        Chord {
            span_s: window.span_s,
            ends_mps: None,
        }
    }

    fn middle_s(&self) -> f64 {
        0.5 * (self.span_s.0 + self.span_s.1)
    }

    fn is_longer_than(&self, duration_s: f64) -> bool {
        self.span_s.1 - self.span_s.0 > duration_s
    }

    /// The values at its ends (m/s) and, in far fields, how far the mean may be from the straight
    /// line between them.
    fn bend(&self, window: &Window<'_>) -> Option<((f64, f64), f64)> {
        let bend_mps = window.bend_mps(self.span_s)?;
        let (from_s, until_s) = self.span_s;
        let ends = || (window.mean_mps(from_s), window.mean_mps(until_s));
        Some((self.ends_mps.unwrap_or_else(ends), bend_mps))
    }

    /// Its halves, given the values at its ends and in its middle where they are known.
    fn halves(&self, known_mps: Option<((f64, f64), f64)>) -> [Chord; 2] {
        let middle_s = self.middle_s();
        [
            Chord {
                span_s: (self.span_s.0, middle_s),
                ends_mps: known_mps.map(|((from, _), middle)| (from, middle)),
            },
            Chord {
                span_s: (middle_s, self.span_s.1),
                ends_mps: known_mps.map(|((_, until), middle)| (middle, until)),
            },
        ]
    }
}

/// Raises `best` (s, m/s) to the highest mean air on a span of a window.
///
/// It is found to within `tolerance` of it (m/s, a function of the value): spans whose bound is no
/// more than that above the best known are not searched. In far fields the bound is the chord
/// between the ends of a span and its bend, elsewhere that of each point of the discs.
pub(crate) fn maximise(
    window: &Window<'_>,
    chord: Chord,
    best: &mut (f64, f64),
    tolerance: &impl Fn(f64) -> f64,
) {
    let mut raise = |t_s: f64, here_mps: f64| {
        if here_mps > best.1 {
            *best = (t_s, here_mps);
        }
        best.1 + tolerance(best.1)
    };
    let known = chord.bend(window);
    let (high_mps, enough_mps) = match known {
        Some(((from_mps, until_mps), bend_mps)) => {
            raise(chord.span_s.0, from_mps);
            let enough_mps = raise(chord.span_s.1, until_mps);
            (from_mps.max(until_mps) + bend_mps, enough_mps)
        }
        None => {
            let enough_mps = raise(0.0, 0.0);
            let rough_mps = window.rough_mps(chord.span_s);
            let high = || window.high_mps(chord.span_s);
            let is_open = rough_mps > enough_mps;
            (if is_open { high() } else { rough_mps }, enough_mps)
        }
    };
    if high_mps <= enough_mps {
        return;
    }
    let middle_s = chord.middle_s();
    let middle_mps = window.mean_mps(middle_s);
    raise(middle_s, middle_mps);
    // A last step below the shortest span: a smooth peak is then met to rounding.
    if chord.is_longer_than(0.1 * SHORTEST_S) {
        for half in chord.halves(known.map(|(ends_mps, _)| (ends_mps, middle_mps))) {
            maximise(window, half, best, tolerance);
        }
    }
}

/// Appends the parts of a span of a window where the mean air exceeds a limit (m/s), in order;
/// adjacent parts are joined.
///
/// In far fields by the chord between the ends of a span, from which the mean is never farther than
/// its bend: so the moment at which a limit is crossed takes few spans. Elsewhere by slopes from
/// the middle.
pub(crate) fn above(window: &Window<'_>, chord: Chord, limit_mps: f64, parts: &mut Vec<Span>) {
    let span_s = chord.span_s;
    if window.rough_mps(span_s) <= limit_mps {
        return;
    }
    let known = chord.bend(window);
    let (low_mps, high_mps) = match known {
        Some(((a, b), bend_mps)) => (a.min(b) - bend_mps, a.max(b) + bend_mps),
        None => window.range_mps(span_s),
    };
    if high_mps <= limit_mps {
        return;
    }
    let middle_mps = || window.mean_mps(chord.middle_s());
    let is_shortest = !chord.is_longer_than(SHORTEST_S);
    if low_mps > limit_mps || is_shortest && middle_mps() > limit_mps {
        join(parts, span_s);
    } else if !is_shortest {
        for half in chord.halves(known.map(|(ends_mps, _)| (ends_mps, middle_mps()))) {
            above(window, half, limit_mps, parts);
        }
    }
}
