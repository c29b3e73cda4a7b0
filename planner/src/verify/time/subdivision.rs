//! Where the air in a window is highest, where it exceeds a limit, and what it sums to, by
//! subdivision of time on bounds that close in on the value as spans shrink.
//!
//! A span is dropped when its upper bound is not above what is looked for, and halved otherwise,
//! down to [`SHORTEST_S`]. So what is dropped holds in continuous time; only what is left at the
//! shortest spans is judged by its middle.

use super::spans::{SHORTEST_S, join};
use super::window::Window;
use crate::verify::extents::Span;

/// Raises `best` (s, m/s) to the highest mean air on a span of a window.
///
/// It is found to within `tolerance` of it (m/s, a function of the value): spans whose bound is no
/// more than that above the best known are not searched.
pub(crate) fn maximise(
    window: &Window<'_>,
    span_s: Span,
    best: &mut (f64, f64),
    tolerance: &impl Fn(f64) -> f64,
) {
    let enough_mps = best.1 + tolerance(best.1);
    if window.rough_mps(span_s) <= enough_mps || window.high_mps(span_s) <= enough_mps {
        return;
    }
    let middle_s = 0.5 * (span_s.0 + span_s.1);
    let here_mps = window.mean_mps(middle_s);
    if here_mps > best.1 {
        *best = (middle_s, here_mps);
    }
    // A last step below the shortest span: a smooth peak is then met to rounding.
    if span_s.1 - span_s.0 > 0.1 * SHORTEST_S {
        maximise(window, (span_s.0, middle_s), best, tolerance);
        maximise(window, (middle_s, span_s.1), best, tolerance);
    }
}

/// A span of a window and, where they have been looked at, the values at its ends (m/s).
#[derive(Clone, Copy)]
pub(crate) struct Chord {
    /// From, until (s).
    pub(crate) span_s: Span,
    /// Mean air at both (m/s); `None`: not looked at yet.
    pub(crate) ends_mps: Option<(f64, f64)>,
}

/// Appends the parts of a span of a window where the mean air exceeds a limit (m/s), in order;
/// adjacent parts are joined.
///
/// In far fields by the chord between the ends of a span, from which the mean is never farther than
/// its bend: so the moment at which a limit is crossed takes few spans. Elsewhere by slopes from
/// the middle.
pub(crate) fn above(window: &Window<'_>, chord: Chord, limit_mps: f64, parts: &mut Vec<Span>) {
    let Chord { span_s, ends_mps } = chord;
    if window.rough_mps(span_s) <= limit_mps {
        return;
    }
    let chord = window.bend_mps(span_s).map(|bend_mps| {
        let ends = || (window.mean_mps(span_s.0), window.mean_mps(span_s.1));
        (ends_mps.unwrap_or_else(ends), bend_mps)
    });
    let (low_mps, high_mps) = match chord {
        Some(((a, b), bend_mps)) => (a.min(b) - bend_mps, a.max(b) + bend_mps),
        None => window.range_mps(span_s),
    };
    if high_mps <= limit_mps {
        return;
    }
    let middle_s = 0.5 * (span_s.0 + span_s.1);
    let shortest = span_s.1 - span_s.0 <= SHORTEST_S;
    if low_mps > limit_mps || shortest && window.mean_mps(middle_s) > limit_mps {
        join(parts, span_s);
    } else if !shortest {
        let ends = chord.map(|(ends_mps, _)| (ends_mps, window.mean_mps(middle_s)));
        let first = Chord {
            span_s: (span_s.0, middle_s),
            ends_mps: ends.map(|((from, _), middle)| (from, middle)),
        };
        let second = Chord {
            span_s: (middle_s, span_s.1),
            ends_mps: ends.map(|((_, until), middle)| (middle, until)),
        };
        above(window, first, limit_mps, parts);
        above(window, second, limit_mps, parts);
    }
}
