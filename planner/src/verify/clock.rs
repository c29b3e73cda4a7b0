//! Where a function of time is highest, where it exceeds a limit, and what it sums to, by
//! subdivision on bounds.
//!
//! Bounds are over a span `(from_s, until_s)` and close in on the value as the span shrinks.

/// What is known of a function of time over spans.
pub(super) trait Bounded {
    /// The value at a time.
    fn value(&mut self, t_s: f64) -> f64;
    /// An upper bound that costs little.
    fn rough(&mut self, from_s: f64, until_s: f64) -> f64;
    /// An upper bound that closes in on the value.
    fn high(&mut self, from_s: f64, until_s: f64) -> f64;
    /// A lower and an upper bound that close in on the value.
    fn range(&mut self, from_s: f64, until_s: f64) -> (f64, f64);
    /// How far it may be from its chord over the span; `None`: not known.
    fn bulge(&mut self, from_s: f64, until_s: f64) -> Option<f64>;
}

/// A span and, where they have been looked at, the values at its ends.
#[derive(Clone, Copy)]
pub(super) struct Span {
    pub(super) from_s: f64,
    pub(super) until_s: f64,
    ends: Option<(f64, f64)>,
}

impl Span {
    pub(super) fn new((from_s, until_s): (f64, f64)) -> Span {
        Span {
            from_s,
            until_s,
            ends: None,
        }
    }

    /// Bounds from the values at the ends; `None` where nothing is known of what lies between.
    fn range_by_ends(&mut self, air: &mut impl Bounded) -> Option<(f64, f64)> {
        let bulge = air.bulge(self.from_s, self.until_s)?;
        let ends = match self.ends {
            Some(ends) => ends,
            None => (air.value(self.from_s), air.value(self.until_s)),
        };
        self.ends = Some(ends);
        Some((ends.0.min(ends.1) - bulge, ends.0.max(ends.1) + bulge))
    }

    /// Its halves; `here` is the value between them.
    fn halves(&self, middle_s: f64, here: f64) -> [Span; 2] {
        let part = |from_s, until_s, ends| Span {
            from_s,
            until_s,
            ends,
        };
        [
            part(
                self.from_s,
                middle_s,
                self.ends.map(|(from, _)| (from, here)),
            ),
            part(
                middle_s,
                self.until_s,
                self.ends.map(|(_, until)| (here, until)),
            ),
        ]
    }
}

/// Shortest span that is still divided (s). What is judged by its middle alone lasts no longer than
/// this; at 2 m/s it is 2 mm of way, a hundredth of the half-width of the narrowest wake known here.
pub(super) const SHORTEST_S: f64 = 1e-3;

/// Raises `best` (time, value) to the highest value on a span, to within `tolerance` of it (a function
/// of the value).
pub(super) fn maximise(
    mut span: Span,
    best: &mut (f64, f64),
    air: &mut impl Bounded,
    tolerance: &impl Fn(f64) -> f64,
) {
    let (from_s, until_s) = (span.from_s, span.until_s);
    let enough = best.1 + tolerance(best.1);
    if air.rough(from_s, until_s) <= enough {
        return;
    }
    let high = match span.range_by_ends(air) {
        Some((_, high)) => high,
        None => air.high(from_s, until_s),
    };
    if high <= enough {
        return;
    }
    let middle_s = 0.5 * (from_s + until_s);
    let here = air.value(middle_s);
    if here > best.1 {
        *best = (middle_s, here);
    }
    // A last step below the shortest span: a smooth peak is then met to rounding.
    if until_s - from_s <= 0.1 * SHORTEST_S {
        return;
    }
    for half in span.halves(middle_s, here) {
        maximise(half, best, air, tolerance);
    }
}

/// Appends the parts of a span where the value exceeds `limit`, in order; adjacent parts are joined.
pub(super) fn above(
    mut span: Span,
    limit: f64,
    air: &mut impl Bounded,
    parts: &mut Vec<(f64, f64)>,
) {
    let (from_s, until_s) = (span.from_s, span.until_s);
    if air.rough(from_s, until_s) <= limit {
        return;
    }
    let by_ends = span.range_by_ends(air);
    let (low, high) = by_ends.unwrap_or_else(|| air.range(from_s, until_s));
    if high <= limit {
        return;
    }
    let middle_s = 0.5 * (from_s + until_s);
    let shortest = until_s - from_s <= SHORTEST_S;
    if low > limit || shortest && air.value(middle_s) > limit {
        join(parts, (from_s, until_s));
        return;
    }
    if shortest {
        return;
    }
    let here = if by_ends.is_some() {
        air.value(middle_s)
    } else {
        0.0
    };
    for half in span.halves(middle_s, here) {
        above(half, limit, air, parts);
    }
}

/// Appends a span, or lengthens the last one where they touch.
pub(super) fn join(parts: &mut Vec<(f64, f64)>, span_s: (f64, f64)) {
    match parts.last_mut() {
        Some(last) if span_s.0 - last.1 <= SHORTEST_S => last.1 = last.1.max(span_s.1),
        _ => parts.push(span_s),
    }
}

/// Nodes and weights of the 7-point Kronrod rule on [-1, 1], and of the 3-point Gauss rule in it
/// (Kronrod 1965; any table of quadrature rules).
const NODES: [f64; 7] = [
    -0.960_491_268_708_020_3,
    -0.774_596_669_241_483_4,
    -0.434_243_749_346_802_6,
    0.0,
    0.434_243_749_346_802_6,
    0.774_596_669_241_483_4,
    0.960_491_268_708_020_3,
];
const KRONROD: [f64; 7] = [
    0.104_656_226_026_467_27,
    0.268_488_089_868_333_44,
    0.401_397_414_775_962_2,
    0.450_916_538_658_474_14,
    0.401_397_414_775_962_2,
    0.268_488_089_868_333_44,
    0.104_656_226_026_467_27,
];
const GAUSS: [f64; 7] = [0.0, 5.0 / 9.0, 0.0, 8.0 / 9.0, 0.0, 5.0 / 9.0, 0.0];

/// Integral of two functions over a span. A part is accepted when `smooth(from_s, until_s)` says that no
/// feature can hide between the nodes and the two rules agree, in the first function, to 0.1 % or to
/// `floor` times its length.
pub(super) fn integrate(
    span_s: (f64, f64),
    floor: f64,
    value: &mut impl FnMut(f64) -> [f64; 2],
    smooth: &impl Fn(f64, f64) -> bool,
) -> [f64; 2] {
    let (from_s, until_s) = span_s;
    let (middle_s, half_s) = (0.5 * (from_s + until_s), 0.5 * (until_s - from_s));
    let shortest = until_s - from_s <= SHORTEST_S;
    if shortest || smooth(from_s, until_s) {
        let mut kronrod = [0.0; 2];
        let mut gauss = 0.0;
        for k in 0..7 {
            let here = value(middle_s + half_s * NODES[k]);
            kronrod[0] += half_s * KRONROD[k] * here[0];
            kronrod[1] += half_s * KRONROD[k] * here[1];
            gauss += half_s * GAUSS[k] * here[0];
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
