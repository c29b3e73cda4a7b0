//! Spans of time: joined, cut at the same moments for many, and integrated over.

use crate::verify::extents::Span;

/// Shortest span that is still divided (s), chosen here. What is judged by its middle alone lasts
/// no longer than this; at 2 m/s it is 2 mm of path, a hundredth of the half-width of the narrowest
/// wake known here.
pub(crate) const SHORTEST_S: f64 = 1e-3;

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

/// Nodes on [-1, 1] and weights of the 7-point Kronrod rule, and weights of the 3-point Gauss rule
/// in it (Kronrod 1965; any table of quadrature rules), from the outermost node to the middle.
const RULES: [[f64; 3]; 4] = [
    [0.960_491_268_708_020_3, 0.104_656_226_026_467_27, 0.0],
    [0.774_596_669_241_483_4, 0.268_488_089_868_333_44, 5.0 / 9.0],
    [0.434_243_749_346_802_6, 0.401_397_414_775_962_2, 0.0],
    [0.0, 0.450_916_538_658_474_14, 8.0 / 9.0],
];

/// Nodes on [-1, 1] and weights of the Gauss rules of one to five points.
const GAUSS: [&[[f64; 2]]; 5] = [
    &[[0.0, 2.0]],
    &[
        [-0.577_350_269_189_625_8, 1.0],
        [0.577_350_269_189_625_8, 1.0],
    ],
    &[
        [-0.774_596_669_241_483_4, 5.0 / 9.0],
        [0.0, 8.0 / 9.0],
        [0.774_596_669_241_483_4, 5.0 / 9.0],
    ],
    &[
        [-0.861_136_311_594_052_6, 0.347_854_845_137_453_9],
        [-0.339_981_043_584_856_3, 0.652_145_154_862_546_1],
        [0.339_981_043_584_856_3, 0.652_145_154_862_546_1],
        [0.861_136_311_594_052_6, 0.347_854_845_137_453_9],
    ],
    &[
        [-0.906_179_845_938_664, 0.236_926_885_056_189_1],
        [-0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
        [0.0, 0.568_888_888_888_888_9],
        [0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
        [0.906_179_845_938_664, 0.236_926_885_056_189_1],
    ],
];

/// Part of a value by which the Gauss rules of one to five points may miss it where the path is one
/// half-width long, or one distance from the axis, and the power of that length with which this
/// grows.
///
/// The remainder of `n` points is `f⁽²ⁿ⁾ h²ⁿ (n!)⁴/((2n + 1) (2n)!³)` (Abramowitz and Stegun,
/// 25.4.30). Over the value the derivatives of the far field's profile are largest far aside, where
/// it falls with the fourth power of the distance: `(2n + 3)!/3!`.
const REMAINDERS: [(f64, i32); 5] = [(0.83, 2), (0.195, 4), (0.03, 6), (3.8e-3, 8), (4.1e-4, 10)];

/// Path through a feature, in its half-widths, up to which none hides between seven nodes: chosen
/// here.
const MOST_WIDTHS: f64 = 2.0;

/// Part of an integral by which it may be wrong: chosen here.
const RELATIVE_ERROR: f64 = 1e-3;

/// What is known of two functions before they are integrated over spans of time.
pub(crate) struct Known<W, M> {
    /// Error allowed in the mean of the first, where [`RELATIVE_ERROR`] of it is less.
    pub(crate) floor: f64,
    /// No value of the first is higher.
    pub(crate) highest: f64,
    /// Over a span, how long the path through any feature is, in its half-widths, and whether few
    /// nodes may be trusted.
    pub(crate) widths: W,
    /// The functions at a time (s).
    pub(crate) values: M,
}

/// Integral of two functions over a span. Where features are so wide that few nodes do, they are
/// trusted. Elsewhere a part is accepted when no feature can hide between the nodes and two rules
/// agree, in the first function, to [`RELATIVE_ERROR`] or to `floor` times its length.
pub(crate) fn integrate(
    span_s: Span,
    known: &mut Known<impl Fn(Span) -> (f64, bool), impl FnMut(f64) -> [f64; 2]>,
) -> [f64; 2] {
    let (from_s, until_s) = span_s;
    let (middle_s, half_s) = (0.5 * (from_s + until_s), 0.5 * (until_s - from_s));
    let (widths, is_plain) = (known.widths)(span_s);
    let allowed = RELATIVE_ERROR.max(known.floor / known.highest);
    let few = REMAINDERS.map(|(error, power)| error * widths.powi(power) <= allowed);
    if let (true, Some(rule)) = (is_plain, few.iter().position(|enough| *enough)) {
        let mut sums = [0.0; 2];
        for [node, weight] in GAUSS[rule] {
            let here = (known.values)(middle_s + half_s * node);
            sums = [0, 1].map(|k| sums[k] + half_s * weight * here[k]);
        }
        return sums;
    }
    let shortest = until_s - from_s <= SHORTEST_S;
    if shortest || widths <= MOST_WIDTHS {
        let mut kronrod = [0.0; 2];
        let mut gauss = 0.0;
        for k in 0..7_usize {
            let [node, weight, gauss_weight] = RULES[k.min(6 - k)];
            let node = if k < 3 { -node } else { node };
            let here = (known.values)(middle_s + half_s * node);
            kronrod[0] += half_s * weight * here[0];
            kronrod[1] += half_s * weight * here[1];
            gauss += half_s * gauss_weight * here[0];
        }
        let allowed = (RELATIVE_ERROR * kronrod[0]).max(known.floor * (until_s - from_s));
        if shortest || (kronrod[0] - gauss).abs() <= allowed {
            return kronrod;
        }
    }
    let first = integrate((from_s, middle_s), known);
    let second = integrate((middle_s, until_s), known);
    [first[0] + second[0], first[1] + second[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_nodes_integrate_a_path_past_a_wake_to_a_part_in_a_thousand() {
        for off_axis in [0.0, 0.3, 1.0, 2.5, 6.0] {
            for length in [0.05, 0.2, 0.6, 1.0, 1.7, 4.0, 12.0] {
                for begin in [-5.0, -1.0, -0.5 * length, 0.4, 3.0] {
                    let speed = |t: f64| {
                        let x: f64 = begin + t;
                        (1.0 + 0.414 * (x * x + off_axis * off_axis)).powi(-2)
                    };
                    let widths = |(from, until): Span| {
                        let nearest = (0.0_f64).clamp(begin + from, begin + until);
                        ((until - from) / nearest.hypot(off_axis).max(1.0), true)
                    };
                    let mut evaluations = 0;
                    let mut known = Known {
                        floor: 0.0,
                        highest: 1.0,
                        widths,
                        values: |t: f64| {
                            evaluations += 1;
                            [speed(t), 0.0]
                        },
                    };
                    let [sum, _] = integrate((0.0, length), &mut known);
                    let steps = 20_000;
                    let step = length / f64::from(steps);
                    let middles = (0..steps).map(|k| speed((f64::from(k) + 0.5) * step));
                    let exact = middles.sum::<f64>() * step;
                    let error = (sum / exact - 1.0).abs();
                    let place = format!("{off_axis} {begin} {length}: {error:e}");
                    assert!(error < RELATIVE_ERROR, "{place}");
                    assert!(length > 1.0 || evaluations <= 7, "{place}: {evaluations}");
                }
            }
        }
    }
}
