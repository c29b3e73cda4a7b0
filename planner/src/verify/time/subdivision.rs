//! Where the air in a window is highest, where it exceeds a limit, and what it sums to, by subdivision
//! of time on bounds that close in on the value as spans shrink.
//!
//! A span is dropped when its upper bound is not above what is looked for, and halved otherwise, down to
//! [`SHORTEST_S`]. So what is dropped holds in continuous time; only what is left at the shortest spans is
//! judged by its middle.

use super::window::Window;
use crate::verify::Span;

/// Shortest span that is still divided (s). What is judged by its middle alone lasts no longer than
/// this; at 2 m/s it is 2 mm of path, a hundredth of the half-width of the narrowest wake known here.
pub(crate) const SHORTEST_S: f64 = 1e-3;

/// Raises `best` (s, m/s) to the highest mean air on a span of a window.
///
/// It is found to within `tolerance` of it (m/s, a function of the value): spans whose bound is no more than
/// that above the best known are not searched.
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

/// Appends the parts of a span of a window where the mean air exceeds a limit (m/s), in order; adjacent
/// parts are joined.
///
/// In far fields by the chord between the ends of a span, from which the mean is never farther than its
/// bend: so the moment at which a limit is crossed takes few spans. Elsewhere by slopes from the middle.
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

/// Appends a span, or lengthens the last one where they touch: gaps up to [`SHORTEST_S`] are none.
pub(crate) fn join(parts: &mut Vec<Span>, span_s: Span) {
    match parts.last_mut() {
        Some(last) if span_s.0 - last.1 <= SHORTEST_S => last.1 = last.1.max(span_s.1),
        _ => parts.push(span_s),
    }
}

/// The spans between cuts (s, ascending), each with the indices of those `lasting` over its middle,
/// ascending.
pub(crate) fn between(cuts_s: &[f64], lasting_s: &[Span]) -> Vec<(Span, Vec<usize>)> {
    let mut by_begin: Vec<usize> = (0..lasting_s.len()).collect();
    by_begin.sort_by(|&a, &b| lasting_s[a].0.total_cmp(&lasting_s[b].0));
    let mut next = by_begin.into_iter().peekable();
    let mut under_way: Vec<usize> = Vec::new();
    let spans = cuts_s.windows(2).map(|cuts_s| {
        let middle_s = 0.5 * (cuts_s[0] + cuts_s[1]);
        while let Some(begun) = next.next_if(|&k| lasting_s[k].0 <= middle_s) {
            under_way.push(begun);
        }
        under_way.retain(|&k| lasting_s[k].1 > middle_s);
        under_way.sort_unstable();
        ((cuts_s[0], cuts_s[1]), under_way.clone())
    });
    spans.collect()
}

/// Nodes on [-1, 1] and weights of the 7-point Kronrod rule, and weights of the 3-point Gauss rule in it
/// (Kronrod 1965; any table of quadrature rules), from the outermost node to the middle.
const RULES: [[f64; 3]; 4] = [
    [0.960_491_268_708_020_3, 0.104_656_226_026_467_27, 0.0],
    [0.774_596_669_241_483_4, 0.268_488_089_868_333_44, 5.0 / 9.0],
    [0.434_243_749_346_802_6, 0.401_397_414_775_962_2, 0.0],
    [0.0, 0.450_916_538_658_474_14, 8.0 / 9.0],
];

/// Integral of two functions over a span. A part is accepted when `smooth(span_s)` says that no feature
/// can hide between the nodes and the two rules agree, in the first function, to 0.1 % or to `floor`
/// times its length.
pub(crate) fn integrate(
    span_s: Span,
    floor: f64,
    value: &mut impl FnMut(f64) -> [f64; 2],
    smooth: &impl Fn(Span) -> bool,
) -> [f64; 2] {
    let (from_s, until_s) = span_s;
    let (middle_s, half_s) = (0.5 * (from_s + until_s), 0.5 * (until_s - from_s));
    let shortest = until_s - from_s <= SHORTEST_S;
    if shortest || smooth(span_s) {
        let mut kronrod = [0.0; 2];
        let mut gauss = 0.0;
        for k in 0..7_usize {
            let [node, weight, gauss_weight] = RULES[k.min(6 - k)];
            let node = if k < 3 { -node } else { node };
            let here = value(middle_s + half_s * node);
            kronrod[0] += half_s * weight * here[0];
            kronrod[1] += half_s * weight * here[1];
            gauss += half_s * gauss_weight * here[0];
        }
        let allowed = (1e-3 * kronrod[0]).max(floor * (until_s - from_s));
        if shortest || (kronrod[0] - gauss).abs() <= allowed {
            return kronrod;
        }
    }
    let first = integrate((from_s, middle_s), floor, value, smooth);
    let second = integrate((middle_s, until_s), floor, value, smooth);
    [first[0] + second[0], first[1] + second[1]]
}
