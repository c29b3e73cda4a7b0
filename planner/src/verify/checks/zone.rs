//! The air in a zone: all airborne wakes superposed, and the wall jets along the floor where a
//! finding names them, highest over the box and over time.
//!
//! The box and the time are divided together, always where the upper bound is highest, until no
//! part of them can exceed the limit or a place that does has been found. Wakes from above add up
//! as the plan says, wall jets as vectors. A wall jet spreads along the floor from below every
//! airborne drone, whatever stands between them.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

use airflow::effects::GroundImpingement;
use airflow::{Source, Superposition, Wake, axial_speed_mps};
use nalgebra::{Point3, Vector3};

use crate::plan::trajectory::Motion;
use crate::plan::{ViolationKind, Zone};
use crate::verify::bounds::obstacles::Obstacles;
use crate::verify::extents::{FAINTEST_WAKE_MPS, Places, Span};
use crate::verify::scene::{Attached, Flight, Scene, level_gap_m, reaches, superpose};
use crate::verify::time::advected::Advected;
use crate::verify::time::spans::{between, join};
use crate::verify::violation::{IndexedViolation, Worst};

/// A zone is violated above this part of its limit, chosen here.
pub(crate) const VIOLATED: f64 = 1.005;
/// What cannot exceed this part of the limit is not searched further: no point of a zone found in
/// order exceeds its limit by more. Chosen here: half as much again as is violated.
const CLEARED: f64 = 1.0075;
/// Steps in which the air is no more than this above the highest known are left, where it is only
/// reported: with [`CLEARED`] 3 %, chosen here.
const REPORTED_SHARE: f64 = 1.02;
/// A step of time ends when an emitter has moved by this (m), chosen here: the time of a violation
/// is reported to one step.
const STEP_PATH_M: f64 = 0.1;
/// A part of box and time this small is judged by its middle, and by those of its corners that are
/// on the zone's surface (m), chosen here: a tenth of the half-width of the narrowest wake known
/// here.
const SMALLEST_M: f64 = 1e-2;
/// Spans in which the wake of a drone that climbs or sinks is bounded within its margin of time,
/// chosen here: 0.2 s at 2 m/s are then 5 cm of depth each.
const CLIMB_STEPS: u32 = 8;
/// Parts searched in one step before the highest bound counts as found, chosen here: about a second
/// of work.
const MOST_PARTS: usize = 500_000;
/// Parts searched for one zone in all before the highest bound of a step counts as found after
/// [`FEWEST_PARTS`], chosen here: some seconds of work.
const MOST_PARTS_IN_ALL: usize = 1_500_000;
/// The same where it is only asked whether limits are kept, chosen here: less than a second.
const MOST_PARTS_ASKED: usize = 200_000;
/// What a part costs where wakes are advected, in parts without: chosen here, since where air left
/// is looked for.
const ADVECTED_COST: usize = 4;
/// Parts searched in a step once [`MOST_PARTS_IN_ALL`] are used up, chosen here.
const FEWEST_PARTS: usize = 32;
/// Air up to this is not searched further where it is only reported (m/s): a closed hall drifts as
/// fast, 0.06 to 0.12 m/s during the flights the jet was fitted to.
pub(crate) const SLIGHTEST_MPS: f64 = 0.1;
/// Parts searched in one step where the air is only reported, chosen here: about a millisecond, as
/// many as once the limit is broken.
const PARTS_REPORTED: usize = PARTS_ONCE_VIOLATED;
/// Parts searched for one zone in all where the air is only reported, and in a step once they are
/// used up, chosen here: a second or two of work.
const PARTS_REPORTED_IN_ALL: usize = 1_000_000;
const FEWEST_PARTS_REPORTED: usize = 4;
/// Parts searched for one zone over all delays of all flights before what is left counts as too
/// strong after [`FEWEST_PARTS`] a step, chosen here: some seconds of work.
const MOST_PARTS_LATE: usize = 1_500_000;
/// Delays of one step (s), chosen here: a fifth of a metre of path at 2 m/s.
const LATE_STEP_S: f64 = 0.1;
/// Steps in all, chosen here: three hours of flight at 1 m/s; of longer ones they are longer.
const MOST_STEPS: f64 = 100_000.0;
/// Steps where the air is only reported, chosen here: half an hour of flight at 1 m/s, and in all a
/// second or two of work; of longer flights they are longer.
const MOST_STEPS_REPORTED: f64 = 20_000.0;
/// So many wakes that bring the most to a part are looked at in its middle before all are, chosen
/// here: few count at one place.
const FOREMOST: usize = 6;
/// What the wakes of a part bring by its bounds counts this many times in that, chosen here: far
/// more than air that left within [`Advected`]'s shortest span makes of it.
const ROUNDING: f64 = 1.001;
/// Wakes that together bring no more than this part of what is looked for count as a constant from
/// then on: chosen here, well below what lies between [`VIOLATED`] and [`CLEARED`].
const FAINT: f64 = 1e-3;
/// Parts searched once the limit is known to be broken, chosen here: the worst value reported is
/// then within a few percent of the highest. Below a rotor plane, where the air begins at full
/// speed, more would not help.
const PARTS_ONCE_VIOLATED: usize = 400;

/// The place and moment of the highest air found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Peak {
    /// m/s.
    pub(crate) air_mps: f64,
    /// When (s).
    t_s: f64,
    /// Where in the zone (m).
    place_m: Point3<f64>,
    /// It is an upper bound: no more parts were searched.
    is_bound: bool,
}

impl Peak {
    /// Whether another says more: what was found before what may be, then the higher.
    fn is_exceeded_by(&self, other: &Peak) -> bool {
        match (self.is_bound, other.is_bound) {
            (true, false) => true,
            (false, true) => false,
            _ => other.air_mps > self.air_mps,
        }
    }
}

/// One wake that may reach a zone.
pub(crate) enum Downwash<'a> {
    /// Quasi-static, while its drone flies one piece.
    Attached(Attached<'a>),
    /// Of a whole flight, for as long as its air is anywhere.
    Advected(Advected<'a>, Span),
    /// Of a flight that may be early or late.
    Shifted(Shifted<'a>),
}

/// The wake of a flight that is late or early by no more than a margin.
pub(crate) struct Shifted<'a> {
    /// An index of the caller's.
    from: usize,
    /// The emitter.
    flight: &'a Flight,
    /// Where wakes are advected.
    advected: Option<Advected<'a>>,
    /// How far its clock may be behind, and ahead (s).
    margins_s: (f64, f64),
    /// While it counts (s).
    span_s: Span,
}

impl Downwash<'_> {
    /// The emitter: an index of the caller's.
    pub(crate) fn from(&self) -> usize {
        match self {
            Downwash::Attached(attached) => attached.from,
            Downwash::Advected(advected, _) => advected.from,
            Downwash::Shifted(shifted) => shifted.from,
        }
    }

    /// While it is there (s).
    fn span_s(&self) -> Span {
        match self {
            Downwash::Attached(attached) => (attached.motion.from_s, attached.motion.until_s),
            Downwash::Advected(_, span_s) => *span_s,
            Downwash::Shifted(shifted) => shifted.span_s,
        }
    }

    /// Of its drone (m/s).
    fn max_speed_mps(&self) -> f64 {
        match self {
            Downwash::Attached(attached) => attached.motion.max_speed_mps(),
            Downwash::Advected(advected, _) => advected.max_speed_mps(),
            Downwash::Shifted(shifted) => {
                let motions = shifted.flight.parts(shifted.span_s).map(|it| it.motion);
                motions.map(|it| it.max_speed_mps()).fold(0.0, f64::max)
            }
        }
    }
}

/// How much is asked about the limit of a zone.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum ZoneQuestion {
    /// All spans over it.
    Spans,
    /// The first span over it, or that may be.
    IsKept,
}

/// The spans over the limit of a zone: on time, or else with every drone early or late by the time
/// margin, each by itself.
pub(crate) fn check(scene: &Scene<'_>, zone: &Zone, asked: ZoneQuestion) -> Vec<IndexedViolation> {
    let Some(air_limit_mps) = zone.air_limit_mps else {
        return Vec::new();
    };
    let found = on_time(scene, zone, asked);
    let margin_s = scene.margins.time_s;
    if !found.is_empty() || margin_s <= 0.0 {
        return found;
    }
    let mut air = ZoneAir::new(scene, zone);
    let on_time = air.downwash.iter().map(|it| (it.from(), it.span_s()));
    let on_time: Vec<(usize, Span)> = on_time.collect();
    air.downwash = shifts(scene, &on_time, (margin_s, margin_s));
    over_limit(
        scene,
        &air,
        (air_limit_mps, asked),
        ViolationKind::ZoneMargin,
    )
}

/// The spans over the limit of a zone with every drone on time.
fn on_time(scene: &Scene<'_>, zone: &Zone, asked: ZoneQuestion) -> Vec<IndexedViolation> {
    let Some(air_limit_mps) = zone.air_limit_mps else {
        return Vec::new();
    };
    let air = ZoneAir::new(scene, zone);
    over_limit(scene, &air, (air_limit_mps, asked), ViolationKind::Zone)
}

/// The least delay of one flight, up to one (s) and to a resolution (s), at which the air of a zone
/// exceeds its limit, all others on time; `None`: there is none. Step by step of the delay, the
/// first that breaks the limit by halves.
pub(crate) fn least_delay_s(
    scene: &Scene<'_>,
    zone: &Zone,
    from: usize,
    (up_to_s, fine_s): (f64, f64),
) -> Option<f64> {
    let mut late = LateFlightAir::new(scene, zone, from, up_to_s)?;
    let mut from_s = 0.0;
    while from_s < up_to_s {
        let until_s = (from_s + LATE_STEP_S).min(up_to_s);
        if late.is_over((from_s, until_s)) {
            let (mut low_s, mut high_s) = (from_s, until_s);
            while high_s - low_s > fine_s {
                let middle_s = 0.5 * (low_s + high_s);
                match late.is_over((from_s, middle_s)) {
                    true => high_s = middle_s,
                    false => low_s = middle_s,
                }
            }
            return Some(low_s);
        }
        from_s = until_s;
    }
    None
}

/// The air of a zone with one flight late.
struct LateFlightAir<'a> {
    scene: &'a Scene<'a>,
    /// First the wakes on time, those of the late flight after them.
    air: ZoneAir<'a>,
    /// How many are on time.
    on_time: usize,
    /// When the wakes of the late flight reach the zone on time (s).
    spans_s: Vec<(usize, Span)>,
    /// Of the wakes that count (m/s).
    limit_mps: f64,
    /// Parts that may still be searched.
    left: usize,
}

impl<'a> LateFlightAir<'a> {
    /// `None`: the flight brings nothing to the zone while others do, or the zone has no limit.
    fn new(
        scene: &'a Scene<'_>,
        zone: &Zone,
        from: usize,
        up_to_s: f64,
    ) -> Option<LateFlightAir<'a>> {
        let limit_mps = zone.air_limit_mps? - scene.flown.return_flow_mps;
        let mut air = ZoneAir::new(scene, zone);
        let own = air.downwash.iter().filter(|it| it.from() == from);
        let spans_s: Vec<(usize, Span)> = own.map(|it| (from, it.span_s())).collect();
        let meets = |it: &Downwash<'_>| {
            let (begins_s, ends_s) = it.span_s();
            let is_during = |own: &Span| begins_s < own.1 + up_to_s && own.0 < ends_s;
            it.from() != from && spans_s.iter().any(|(_, own)| is_during(own))
        };
        air.downwash.retain(meets);
        let on_time = air.downwash.len();
        (on_time > 0).then(|| LateFlightAir {
            scene,
            air,
            on_time,
            spans_s,
            limit_mps,
            left: MOST_PARTS_LATE / scene.flights.len().max(1),
        })
    }

    /// Whether the limit is exceeded while others are in the zone, at some delay of at least and at
    /// most so much (s); what cannot be decided counts as exceeded.
    fn is_over(&mut self, late_s: Span) -> bool {
        self.air.downwash.truncate(self.on_time);
        let shifted = shifts(self.scene, &self.spans_s, (late_s.1, -late_s.0));
        self.air.downwash.extend(shifted);
        let (field, places_m, cost) = (&self.air.field, &self.air.places_m, self.air.cost);
        let (limit_mps, left) = (self.limit_mps, &mut self.left);
        let is_late = |it: &&&Downwash<'_>| matches!(it, Downwash::Shifted(_));
        let mut is_over = false;
        self.air
            .walk(MOST_STEPS_REPORTED, &mut |here, span_s, is_step| {
                let late = here.all.iter().filter(is_late).count();
                if late == 0 || late == here.all.len() && !here.has_faint() {
                    return ControlFlow::Continue(None);
                }
                if !is_step {
                    let (_, halves) = field.divided(here, places_m, span_s, limit_mps);
                    return ControlFlow::Continue(halves);
                }
                let decided = Above {
                    limit_mps,
                    known_mps: limit_mps,
                    most_parts: (*left / cost).clamp(FEWEST_PARTS, MOST_PARTS),
                    once_violated: 0,
                    is_decided: true,
                };
                let found = field.search(here, places_m, span_s, decided);
                *left = left.saturating_sub(cost * found.parts);
                is_over = found.peak.is_some();
                match is_over {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(None),
                }
            });
        is_over
    }
}

/// From the first moment to the last (s).
pub(crate) const ALWAYS_S: Span = (f64::NEG_INFINITY, f64::INFINITY);

/// The highest air of a zone as far as few parts of each step show it.
pub(crate) struct ZoneAirBounds {
    /// The highest found (m/s), when (s), and the flight with the strongest wake in it (an index);
    /// `None`: none above [`SLIGHTEST_MPS`].
    pub(crate) worst: Option<(f64, f64, usize)>,
    /// No air is faster (m/s), but in parts of a centimetre.
    pub(crate) at_most_mps: f64,
}

/// The highest air of a zone, while steps meet a span of time (s); `is_kept`: its limit is known to
/// hold. Always the span of time with the highest bound is divided, until none can have more than
/// what was found.
pub(crate) fn worst(
    scene: &Scene<'_>,
    zone: &Zone,
    is_kept: bool,
    during_s: Span,
) -> ZoneAirBounds {
    let air = ZoneAir::new(scene, zone);
    let (field, places_m) = (&air.field, &air.places_m);
    let mut worst: Option<(Peak, usize)> = None;
    let mut left = PARTS_REPORTED_IN_ALL;
    let mut at_most_mps = if air.downwash.is_empty() {
        0.0
    } else {
        FAINTEST_WAKE_MPS
    };
    let mut new: Vec<Stretch<'_, '_>> = (air.spans(MOST_STEPS_REPORTED).into_iter())
        .map(|(steps, here)| Stretch {
            steps,
            between: (0, steps.count),
            here,
        })
        .collect();
    // By upper bounds, of equal ones the first.
    let mut stretches: Vec<Stretch<'_, '_>> = Vec::new();
    let mut open: BinaryHeap<(u64, Reverse<usize>)> = BinaryHeap::new();
    loop {
        let found_mps = worst.map_or(0.0, |(peak, _)| peak.air_mps);
        let known_mps = (REPORTED_SHARE * found_mps).max(SLIGHTEST_MPS / CLEARED);
        for it in new.drain(..) {
            let span_s = it.steps.span_of_s(it.between);
            if span_s.1 < during_s.0 || during_s.1 < span_s.0 {
                continue;
            }
            let (high_mps, counting) = field.divided(&it.here, places_m, span_s, known_mps);
            let Some(here) = counting else {
                at_most_mps = at_most_mps.max(high_mps);
                continue;
            };
            open.push((high_mps.to_bits(), Reverse(stretches.len())));
            stretches.push(Stretch { here, ..it });
        }
        let Some((bits, Reverse(number))) = open.pop() else {
            break;
        };
        if f64::from_bits(bits) <= CLEARED * known_mps {
            at_most_mps = at_most_mps.max(f64::from_bits(bits));
            break;
        }
        let Stretch {
            steps,
            between: (from, until),
            ref here,
        } = stretches[number];
        if until - from > 1 {
            let middle = from + (until - from) / 2;
            new.extend([(from, middle), (middle, until)].map(|between| Stretch {
                steps,
                between,
                here: here.clone(),
            }));
            continue;
        }
        let above = Above {
            limit_mps: known_mps,
            known_mps: found_mps.max(SLIGHTEST_MPS / CLEARED),
            most_parts: (left / air.cost).clamp(FEWEST_PARTS_REPORTED, PARTS_REPORTED),
            once_violated: PARTS_ONCE_VIOLATED,
            is_decided: false,
        };
        let found = field.search(here, places_m, steps.span_of_s((from, until)), above);
        left = left.saturating_sub(air.cost * found.parts);
        at_most_mps = at_most_mps.max(found.at_most_mps);
        if let Some(peak) = found.peak {
            let from = field.strongest(&here.all, &peak).unwrap_or_default();
            worst = Some((peak, from));
        }
    }
    let return_flow_mps = scene.flown.return_flow_mps;
    let worst = worst.map(|(peak, from)| (peak.air_mps + return_flow_mps, peak.t_s, from));
    let limit_mps = zone.air_limit_mps.filter(|_| is_kept);
    let kept_mps = limit_mps.map_or(f64::INFINITY, |limit_mps| CLEARED * limit_mps);
    ZoneAirBounds {
        worst,
        at_most_mps: match at_most_mps > 0.0 {
            true => (at_most_mps + return_flow_mps).min(kept_mps),
            false => 0.0,
        },
    }
}

/// The highest air of a zone over its limit with every drone on time (m/s); `None`: it is kept.
pub(crate) fn worst_over_limit_mps(scene: &Scene<'_>, zone: &Zone) -> Option<f64> {
    let limit_mps = zone.air_limit_mps?;
    let ZoneAirBounds { worst, at_most_mps } = worst(scene, zone, false, ALWAYS_S);
    let worst_mps = worst.map_or(0.0, |(air_mps, _, _)| air_mps);
    if worst_mps > VIOLATED * limit_mps {
        return Some(worst_mps);
    }
    // In between a closer search decides.
    let found = || on_time(scene, zone, ZoneQuestion::IsKept);
    let found = (at_most_mps > limit_mps).then(found)?;
    found.first().map(|(_, violation)| violation.value)
}

/// The spans over the limit of a zone (m/s).
fn over_limit(
    scene: &Scene<'_>,
    air: &ZoneAir<'_>,
    (air_limit_mps, asked): (f64, ZoneQuestion),
    kind: ViolationKind,
) -> Vec<IndexedViolation> {
    let limit_mps = air_limit_mps - scene.flown.return_flow_mps;
    let mut parts: Vec<Span> = Vec::new();
    let mut worst: Vec<(Peak, usize)> = Vec::new();
    let mut left = match asked {
        ZoneQuestion::Spans => MOST_PARTS_IN_ALL,
        ZoneQuestion::IsKept => MOST_PARTS_ASKED,
    };
    air.walk(MOST_STEPS, &mut |here, span_s, is_step| {
        if !is_step {
            let (_, halves) = air.field.divided(here, &air.places_m, span_s, limit_mps);
            return ControlFlow::Continue(halves);
        }
        let decided = Above {
            limit_mps,
            known_mps: limit_mps,
            most_parts: (left / air.cost).clamp(FEWEST_PARTS, MOST_PARTS),
            once_violated: PARTS_ONCE_VIOLATED,
            is_decided: true,
        };
        let step = air.field.search(here, &air.places_m, span_s, decided);
        left = left.saturating_sub(air.cost * step.parts);
        let Some(peak) = step.peak else {
            return ControlFlow::Continue(None);
        };
        let before = parts.len();
        join(&mut parts, span_s);
        let from = air.field.strongest(&here.all, &peak).unwrap_or_default();
        if parts.len() > before {
            worst.push((peak, from));
        } else if let Some(known) = worst.last_mut()
            && known.0.is_exceeded_by(&peak)
        {
            *known = (peak, from);
        }
        match asked {
            ZoneQuestion::Spans => ControlFlow::Continue(None),
            ZoneQuestion::IsKept => ControlFlow::Break(()),
        }
    });
    let found = parts.into_iter().zip(worst).map(|(span_s, (peak, from))| {
        let flight = &scene.flights[from];
        let worst = Worst {
            with: Some(air.name.clone()),
            position_m: flight.position_m(peak.t_s),
            value: peak.air_mps + scene.flown.return_flow_mps,
            limit: air_limit_mps,
        };
        let (index, mut violation) = scene.violation(flight, kind, span_s, worst);
        violation.is_bound = peak.is_bound;
        (index, violation)
    });
    found.collect()
}

/// The wakes that reach one zone.
struct ZoneAir<'a> {
    /// The zone's.
    name: String,
    field: Field<'a>,
    /// Lowest and highest corner of the zone (m).
    places_m: Places,
    downwash: Vec<Downwash<'a>>,
    /// Of a part, in parts of quasi-static air.
    cost: usize,
    /// Where rest begins (s).
    rests_s: f64,
}

impl<'a> ZoneAir<'a> {
    fn new(scene: &'a Scene<'_>, zone: &Zone) -> ZoneAir<'a> {
        let places_m = (zone.min_m.coords, zone.max_m.coords);
        let field = Field {
            obstacles: &scene.obstacles,
            superposition: scene.superposition,
            wall: scene.flown.wall,
        };
        let mut downwash = emitted(scene);
        downwash.retain(|it| field.high_mps(it, &places_m, it.span_s()) > FAINTEST_WAKE_MPS);
        ZoneAir {
            name: zone.name.clone(),
            field,
            places_m,
            downwash,
            cost: scene.flown.convection.map_or(1, |_| ADVECTED_COST),
            rests_s: scene.last_s.min(scene.horizon_s),
        }
    }

    /// Spans of time with the wakes that are there, in order, each in steps short enough for every
    /// drone, as far as there are no more than so many.
    fn spans<'d>(&'d self, most: f64) -> Vec<(SpanSteps, Together<'d, 'a>)> {
        let spans_s: Vec<Span> = self.downwash.iter().map(Downwash::span_s).collect();
        let cuts_s = spans_s.iter().flat_map(|span_s| [span_s.0, span_s.1]);
        let mut cuts_s: Vec<f64> = cuts_s.collect();
        cuts_s.push(self.rests_s);
        cuts_s.sort_by(f64::total_cmp);
        cuts_s.dedup();
        let at = |under_way: &[usize]| -> Vec<&'d Downwash<'a>> {
            under_way.iter().map(|&k| &self.downwash[k]).collect()
        };
        let between = between(&cuts_s, &spans_s);
        let between = between.iter().map(|(span_s, here)| (*span_s, at(here)));
        let between: Vec<(Span, Vec<&'d Downwash<'a>>)> = between.collect();
        let path_m =
            |span_s: Span, here: &[&Downwash<'_>]| fastest_mps(here) * (span_s.1 - span_s.0);
        let paths_m = between.iter().map(|(span_s, here)| path_m(*span_s, here));
        let step_m = STEP_PATH_M.max(paths_m.sum::<f64>() / most);
        let in_steps = |(span_s, here): (Span, Vec<&'d Downwash<'a>>)| {
            let count = (path_m(span_s, &here) / step_m).ceil().max(1.0) as u64;
            (SpanSteps { span_s, count }, Together::new(here))
        };
        let in_steps = between.into_iter().map(in_steps);
        in_steps.filter(|(_, it)| !it.all.is_empty()).collect()
    }

    /// Shows these spans, and wherever one has to be divided, its halves, down to steps, in order
    /// of time, with the wakes that count there.
    fn walk<'d>(&'d self, most: f64, visit: SpanVisitor<'_, 'd, 'a>) {
        for (steps, here) in self.spans(most) {
            if steps.walk(&here, (0, steps.count), visit).is_break() {
                return;
            }
        }
    }
}

/// Some of the steps of one of [`ZoneAir::spans`], with the wakes that count there.
struct Stretch<'d, 'a> {
    /// All of that span.
    steps: SpanSteps,
    /// From which step until which.
    between: (u64, u64),
    /// What counts in what it is a part of, and once it is bounded in itself.
    here: Together<'d, 'a>,
}

/// What is done with the wakes that are there during a span of time, and whether that is a step,
/// which is not divided: those that count in its halves, where these are to be shown; a break ends
/// it.
type SpanVisitor<'v, 'd, 'a> =
    &'v mut dyn FnMut(&Together<'d, 'a>, Span, bool) -> ControlFlow<(), Option<Together<'d, 'a>>>;

/// The wakes that count during a span of time, and what those do that are too faint to be looked
/// at.
#[derive(Clone)]
struct Together<'d, 'a> {
    /// Those that count.
    all: Vec<&'d Downwash<'a>>,
    /// An upper bound of the faint ones: from above, gathered, and along the floor (m/s).
    faint: (f64, f64),
}

impl<'d, 'a> Together<'d, 'a> {
    /// None of them is faint yet.
    fn new(all: Vec<&'d Downwash<'a>>) -> Together<'d, 'a> {
        Together {
            all,
            faint: (0.0, 0.0),
        }
    }

    /// Whether some were left out for being faint.
    fn has_faint(&self) -> bool {
        self.faint != (0.0, 0.0)
    }

    /// Those that are left without the faintest, as many as bring no more than this together (m/s),
    /// by upper bounds of each from above and along the floor (m/s).
    fn without_faint(
        &self,
        how: Superposition,
        highs: &[(f64, f64)],
        most_mps: f64,
    ) -> Together<'d, 'a> {
        let alone_mps = |k: usize| highs[k].0.hypot(highs[k].1);
        let mut faintest: Vec<usize> = (0..highs.len()).collect();
        faintest.sort_by(|a, b| alone_mps(*a).total_cmp(&alone_mps(*b)));
        let mut faint = self.faint;
        let mut stays = vec![true; highs.len()];
        for k in faintest {
            let with = gathered(how, faint, highs[k]);
            if finished_mps(how, with) > most_mps {
                break;
            }
            (faint, stays[k]) = (with, false);
        }
        let all = self.all.iter().zip(stays);
        let all = all.filter(|(_, stays)| *stays).map(|(it, _)| *it);
        Together {
            all: all.collect(),
            faint,
        }
    }
}

/// A span of time, in steps.
#[derive(Clone, Copy)]
struct SpanSteps {
    span_s: Span,
    count: u64,
}

impl SpanSteps {
    /// The span of time of some of the steps (s).
    fn span_of_s(&self, (from, until): (u64, u64)) -> Span {
        let at_s = |step: u64| match step == self.count {
            true => self.span_s.1,
            false => {
                let share = step as f64 / self.count as f64;
                self.span_s.0 + share * (self.span_s.1 - self.span_s.0)
            }
        };
        (at_s(from), at_s(until))
    }

    /// Shows some of the steps as one span, and one by one if asked to.
    fn walk<'d, 'a>(
        &self,
        here: &Together<'d, 'a>,
        (from, until): (u64, u64),
        visit: SpanVisitor<'_, 'd, 'a>,
    ) -> ControlFlow<()> {
        let is_step = until - from == 1;
        let halves = visit(here, self.span_of_s((from, until)), is_step)?;
        if let Some(here) = halves.filter(|_| !is_step) {
            let middle = from + (until - from) / 2;
            self.walk(&here, (from, middle), visit)?;
            self.walk(&here, (middle, until), visit)?;
        }
        ControlFlow::Continue(())
    }
}

/// The wakes of all flights while they are airborne.
fn emitted<'a>(scene: &'a Scene<'_>) -> Vec<Downwash<'a>> {
    let mut emitted = Vec::new();
    for (from, flight) in scene.flights.iter().enumerate() {
        let (up_s, down_s) = flight.airborne_s;
        if up_s >= down_s {
            continue;
        }
        if let Some(advected) = Advected::new(scene, from, scene.lags()) {
            let (from_s, until_s) = advected.lasts_s();
            let span_s = (from_s, until_s.min(scene.horizon_s));
            emitted.push(Downwash::Advected(advected, span_s));
            continue;
        }
        for (k, piece) in flight.trajectory.pieces().iter().enumerate() {
            let from_s = piece.motion.from_s.max(up_s);
            let until_s = piece.motion.until_s.min(down_s);
            if from_s < until_s {
                let motion = piece.motion.during(from_s, until_s);
                emitted.push(Downwash::Attached(flight.attached(from, k, motion)));
            }
        }
    }
    emitted
}

/// The flights of some wakes, by emitter and span on time (s): each while one of its
/// wakes counts at some shift of its clock, behind and ahead by up to so much (s).
fn shifts<'a>(
    scene: &'a Scene<'_>,
    on_time: &[(usize, Span)],
    margins_s: (f64, f64),
) -> Vec<Downwash<'a>> {
    let mut shifted: Vec<Shifted<'a>> = Vec::new();
    for &(from, (from_s, until_s)) in on_time {
        // Behind its clock it comes later.
        let span_s = ((from_s - margins_s.1).max(0.0), until_s + margins_s.0);
        match shifted.last_mut() {
            Some(last) if last.from == from && last.span_s.1 >= span_s.0 => {
                last.span_s.1 = span_s.1;
            }
            _ => shifted.push(Shifted {
                from,
                flight: &scene.flights[from],
                advected: Advected::new(scene, from, scene.lags()),
                margins_s,
                span_s,
            }),
        }
    }
    shifted.into_iter().map(Downwash::Shifted).collect()
}

/// What wakes bring from above, gathered, and along the floor (m/s), with one more of them (m/s).
fn gathered(how: Superposition, so_far: (f64, f64), one: (f64, f64)) -> (f64, f64) {
    (how.gather(so_far.0, one.0), so_far.1 + one.1)
}

/// The corners of a box (m).
fn corners_m(places_m: &Places) -> impl Iterator<Item = Point3<f64>> {
    let ends_m = [places_m.0, places_m.1];
    (0..8).map(move |corner: usize| {
        Point3::from([0, 1, 2].map(|axis| ends_m[corner >> axis & 1][axis]))
    })
}

/// Whether a place within a box is on one of its faces (m).
fn is_on_surface(place_m: &Point3<f64>, (low_m, high_m): &Places) -> bool {
    (0..3).any(|axis| place_m[axis] == low_m[axis] || place_m[axis] == high_m[axis])
}

/// An upper bound of both together (m/s).
fn finished_mps(how: Superposition, (above, along_mps): (f64, f64)) -> f64 {
    how.finish(above).hypot(along_mps)
}

/// Of the drones whose wakes these are (m/s).
fn fastest_mps(downwash: &[&Downwash<'_>]) -> f64 {
    let speeds_mps = downwash.iter().map(|it| it.max_speed_mps());
    speeds_mps.fold(0.0, f64::max)
}

impl<'a> Shifted<'a> {
    /// The wakes of its drone during a span of its clock: while it climbs or sinks in short spans,
    /// so that each is bounded at about one depth.
    fn attached(&self, span_s: Span) -> impl Iterator<Item = Attached<'a>> {
        let (flight, from) = (self.flight, self.from);
        let parts = flight.parts(span_s).filter(|it| it.flies);
        parts.flat_map(move |part| {
            let steps = if part.motion.is_level() {
                1
            } else {
                CLIMB_STEPS
            };
            let from_s = part.motion.from_s;
            let step_s = (part.motion.until_s - from_s) / f64::from(steps);
            (0..steps).map(move |k| {
                let from_s = from_s + f64::from(k) * step_s;
                flight.attached(
                    from,
                    part.piece,
                    part.motion.during(from_s, from_s + step_s),
                )
            })
        })
    }

    /// Its wakes at those moments of its clock at which the air at a place (m) may be the highest.
    fn sources(&self, obstacles: &Obstacles, t_s: f64, place_m: Point3<f64>) -> Vec<Source<'a>> {
        let span_s = (t_s - self.margins_s.0, t_s + self.margins_s.1);
        if let Some(advected) = &self.advected {
            return advected.sources_near(obstacles, span_s, place_m);
        }
        let sources = self.attached(span_s).flat_map(|attached| {
            let motion = attached.motion;
            let span_s = (motion.from_s, motion.until_s);
            let there = Motion::straight(span_s, place_m, place_m);
            let nearest_s = there
                .seen_from(&motion)
                .map(|it| it.nearest_to_axis_s(span_s));
            let moments = [Some(span_s.0), nearest_s, Some(span_s.1)]
                .into_iter()
                .flatten();
            let sources = moments.map(|t_s| attached.source(obstacles, t_s));
            sources.collect::<Vec<_>>()
        });
        sources.collect()
    }
}

/// What the air in a zone depends on besides the drones.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    /// Where wakes end, and the floor.
    pub(crate) obstacles: &'a Obstacles,
    /// How wakes from above add up.
    pub(crate) superposition: Superposition,
    /// What a jet becomes at the floor.
    pub(crate) wall: Option<GroundImpingement>,
}

/// What is looked for in a step.
#[derive(Clone, Copy)]
struct Above {
    /// Air above this (m/s).
    limit_mps: f64,
    /// Air up to this changes nothing in the answer (m/s).
    known_mps: f64,
    /// Parts looked at.
    most_parts: usize,
    /// Parts looked at once the limit is known to be broken.
    once_violated: usize,
    /// What may be above it counts as found when there are no more; otherwise it is left.
    is_decided: bool,
}

/// What was found in a step.
struct ZoneSearch {
    /// The highest air, if it violates the limit.
    peak: Option<Peak>,
    /// No air is faster (m/s), but what is known, and within parts of a centimetre.
    at_most_mps: f64,
    /// How many parts were made.
    parts: usize,
}

/// A part of box and time.
#[derive(Clone, Copy)]
struct SpaceTimeBox {
    /// No air in it is faster (m/s).
    high_mps: f64,
    /// Lowest and highest corner (m).
    places_m: Places,
    /// From, until (s).
    span_s: Span,
    /// The wakes that count most in it.
    foremost: Foremost,
}

/// The wakes that may bring the most to a part, and an upper bound of all others.
#[derive(Clone, Copy, Default)]
struct Foremost {
    /// Indices in the list of all wakes, and the bounds of each (m/s); the first `count` of them.
    wakes: [(usize, (f64, f64)); FOREMOST],
    count: usize,
    /// From above, gathered, and along the floor (m/s).
    others: (f64, f64),
}

impl Field<'_> {
    /// An upper bound of one wake over places (m) and a span of time (m/s).
    pub(crate) fn high_mps(&self, it: &Downwash<'_>, places_m: &Places, span_s: Span) -> f64 {
        let (above_mps, along_mps) = self.highs_mps(it, places_m, span_s);
        above_mps.hypot(along_mps)
    }

    /// An upper bound of one wake from above and of its wall jet along the floor (m/s).
    fn highs_mps(&self, it: &Downwash<'_>, places_m: &Places, span_s: Span) -> (f64, f64) {
        match it {
            Downwash::Advected(advected, _) => self.advected_highs_mps(advected, places_m, span_s),
            Downwash::Attached(attached) => {
                let motion = attached.motion.during(span_s.0, span_s.1);
                self.attached_highs_mps(
                    &Attached {
                        motion,
                        ..*attached
                    },
                    places_m,
                )
            }
            Downwash::Shifted(shifted) => {
                let (behind_s, ahead_s) = shifted.margins_s;
                let around_s = (span_s.0 - behind_s, span_s.1 + ahead_s);
                if let Some(advected) = &shifted.advected {
                    return self.advected_highs_mps(advected, places_m, around_s);
                }
                let highs = shifted
                    .attached(around_s)
                    .map(|it| self.attached_highs_mps(&it, places_m));
                highs.fold((0.0, 0.0), |a, b| (a.0.max(b.0), a.1.max(b.1)))
            }
        }
    }

    /// An upper bound of the wall jet of a wake whose drone is somewhere in a box (m/s).
    fn along_mps(&self, wake: &Wake, from_m: &Places, places_m: &Places) -> f64 {
        let floor_z_m = self.obstacles.floor_z_m;
        let wall = self.wall.as_ref();
        wall.map_or(0.0, |wall| {
            wall.highest_between_mps(wake, floor_z_m, from_m, places_m)
        })
    }

    /// Those of advected air (m/s).
    fn advected_highs_mps(
        &self,
        advected: &Advected<'_>,
        places_m: &Places,
        span_s: Span,
    ) -> (f64, f64) {
        let wakes = advected
            .wakes(span_s, (places_m.0.z, places_m.1.z))
            .into_iter();
        let highs = wakes.map(|it| self.attached_highs_mps(&it, places_m));
        highs.fold((0.0, 0.0), |a, b| (a.0.max(b.0), a.1.max(b.1)))
    }

    /// Those of a quasi-static wake over the whole motion of its drone (m/s).
    fn attached_highs_mps(&self, attached: &Attached<'_>, places_m: &Places) -> (f64, f64) {
        let (motion, wake) = (&attached.motion, attached.wake);
        let span_s = (motion.from_s, motion.until_s);
        let from_m = motion.box_m(span_s.0, span_s.1);
        let along_mps = self.along_mps(&wake.wake, &from_m, places_m);
        let offsets_m = (places_m.0 - from_m.1, places_m.1 - from_m.0);
        let heights_m = (places_m.0.z, places_m.1.z);
        let may_reach =
            |it: &Attached<'_>| reaches(it.wake, it.stops, &from_m, self.obstacles, heights_m).1;
        if offsets_m.0.z >= 0.0 || !may_reach(attached) {
            return (0.0, along_mps);
        }
        let centre_m = 0.5 * (places_m.0 + places_m.1);
        let half_m = 0.5 * (places_m.1 - places_m.0);
        let middle_m = centre_m - motion.at_m(0.5 * (span_s.0 + span_s.1));
        let half_path_m = motion.half_path_m(span_s.0, span_s.1) + half_m.norm();
        // From the path itself to the middle of the box: nearer to the truth than box to box where
        // the drone flies askew.
        let path_m = motion.level_path(span_s.0, span_s.1);
        let from_path_m = path_m.nearest_m([-centre_m.x, -centre_m.y]).norm() - half_m.xy().norm();
        let off_axis_m = level_gap_m(&from_m, places_m).max(from_path_m);
        let above_mps = wake.highest_along_mps(&offsets_m, off_axis_m, &middle_m, half_path_m);
        (above_mps, along_mps)
    }

    /// Upper bounds of each wake and of all together over places and a span of time (m/s).
    fn together_mps(
        &self,
        here: &Together<'_, '_>,
        places_m: &Places,
        span_s: Span,
    ) -> (Vec<(f64, f64)>, f64) {
        let highs = (here.all.iter()).map(|it| self.highs_mps(it, places_m, span_s));
        let highs: Vec<(f64, f64)> = highs.collect();
        let how = self.superposition;
        let together = (highs.iter()).fold(here.faint, |so_far, it| gathered(how, so_far, *it));
        (highs, finished_mps(how, together))
    }

    /// An upper bound of all wakes over places and a span of time (m/s); where it is not clear by
    /// that that they stay below a limit (m/s), those that count in a part of both.
    fn divided<'d, 'a>(
        &self,
        here: &Together<'d, 'a>,
        places_m: &Places,
        span_s: Span,
        limit_mps: f64,
    ) -> (f64, Option<Together<'d, 'a>>) {
        let (highs, high_mps) = self.together_mps(here, places_m, span_s);
        let counting = || here.without_faint(self.superposition, &highs, FAINT * limit_mps);
        (high_mps, (high_mps > CLEARED * limit_mps).then(counting))
    }

    /// An upper bound of all wakes over places and a span of time (m/s), and those that bring the
    /// most to it.
    fn bounded(&self, here: &Together<'_, '_>, places_m: &Places, span_s: Span) -> (f64, Foremost) {
        let (mut highs, high_mps) = self.together_mps(here, places_m, span_s);
        let how = self.superposition;
        let mut foremost = Foremost {
            others: here.faint,
            ..Foremost::default()
        };
        let alone_mps = |it: &(f64, f64)| it.0.hypot(it.1);
        while foremost.count < FOREMOST.min(here.all.len()) {
            let strongest = (highs.iter().map(alone_mps).enumerate())
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .map_or(0, |(k, _)| k);
            let (above_mps, along_mps) = std::mem::take(&mut highs[strongest]);
            let bounds = (above_mps * ROUNDING, along_mps * ROUNDING);
            foremost.wakes[foremost.count] = (strongest, bounds);
            foremost.count += 1;
        }
        for (above_mps, along_mps) in highs {
            let one = (above_mps * ROUNDING, along_mps * ROUNDING);
            foremost.others = gathered(how, foremost.others, one);
        }
        (high_mps, foremost)
    }

    /// Whether all wakes at one place and time of a part may be more than is known (m/s): those
    /// that count most one after the other by their bounds there, then as they are.
    fn may_exceed(
        &self,
        (all, foremost): (&[&Downwash<'_>], &Foremost),
        t_s: f64,
        place_m: Point3<f64>,
        known_mps: f64,
    ) -> bool {
        let how = self.superposition;
        let there_m = (place_m.coords, place_m.coords);
        let mut wakes = foremost.wakes;
        let wakes = &mut wakes[..foremost.count];
        let mut exceeds_with = |n: usize, is_exact: bool| {
            let it = all[wakes[n].0];
            let (above_mps, along_mps) = match is_exact {
                true => {
                    let (above_mps, along_mps) = self.one_mps(it, t_s, place_m);
                    (above_mps, along_mps.norm())
                }
                false => self.highs_mps(it, &there_m, (t_s, t_s)),
            };
            wakes[n].1 = (above_mps * ROUNDING, along_mps * ROUNDING);
            let together = (wakes.iter()).fold(foremost.others, |so_far, (_, it)| {
                gathered(how, so_far, *it)
            });
            finished_mps(how, together) > known_mps
        };
        let count = foremost.count;
        (0..count).all(|n| exceeds_with(n, false)) && (0..count).all(|n| exceeds_with(n, true))
    }

    /// One wake at one place and time: from above (m/s), and along the floor (m/s, x and y).
    fn one_mps(&self, it: &Downwash<'_>, t_s: f64, place_m: Point3<f64>) -> (f64, Vector3<f64>) {
        let sources: Vec<Source<'_>> = match it {
            Downwash::Advected(advected, _) => {
                advected.sources_near(self.obstacles, (t_s, t_s), place_m)
            }
            Downwash::Attached(attached) => vec![attached.source(self.obstacles, t_s)],
            Downwash::Shifted(shifted) => shifted.sources(self.obstacles, t_s, place_m),
        };
        let (mut above_mps, mut along_mps) = (0.0_f64, Vector3::zeros());
        for source in sources {
            above_mps = above_mps.max(axial_speed_mps(&[source], place_m, self.superposition));
            let Some(wall) = &self.wall else { continue };
            let height_m = source.position_m.z - self.obstacles.floor_z_m;
            let [x, y] = wall.outward_mps(source.wake, height_m, place_m - source.position_m);
            let here_mps = Vector3::new(x, y, 0.0);
            if here_mps.norm() > along_mps.norm() {
                along_mps = here_mps;
            }
        }
        (above_mps, along_mps)
    }

    /// All wakes at one place and time (m/s).
    fn at_mps(&self, all: &[&Downwash<'_>], t_s: f64, place_m: Point3<f64>) -> f64 {
        let each = all.iter().map(|it| self.one_mps(it, t_s, place_m));
        let each: Vec<(f64, Vector3<f64>)> = each.collect();
        let above_mps = superpose(self.superposition, each.iter().map(|(above, _)| *above));
        let along_mps: Vector3<f64> = each.iter().map(|(_, along)| along).sum();
        above_mps.hypot(along_mps.norm())
    }

    /// The emitter with the strongest wake at a peak.
    pub(crate) fn strongest(&self, all: &[&Downwash<'_>], peak: &Peak) -> Option<usize> {
        let alone = all.iter().map(|it| {
            let (above_mps, along_mps) = self.one_mps(it, peak.t_s, peak.place_m);
            (it.from(), above_mps.hypot(along_mps.norm()))
        });
        let strongest = alone.reduce(|a, b| if b.1 > a.1 { b } else { a });
        strongest.map(|(from, _)| from)
    }

    /// The highest air over the box and the span, if it violates the limit (m/s).
    ///
    /// Best first: the part of box and time with the highest upper bound is cut in two where it is
    /// longest, a second of time counting as the path that the fastest drone flies in it, until
    /// that bound is no more than [`CLEARED`] above the limit, or the highest violation known.
    pub(crate) fn highest(
        &self,
        all: &[&Downwash<'_>],
        places_m: &Places,
        span_s: Span,
        limit_mps: f64,
    ) -> Option<Peak> {
        self.decided(all, places_m, span_s, (limit_mps, PARTS_ONCE_VIOLATED))
    }

    /// Whether there is air over the box and the span that violates the limit (m/s).
    pub(crate) fn is_over(
        &self,
        all: &[&Downwash<'_>],
        places_m: &Places,
        span_s: Span,
        limit_mps: f64,
    ) -> bool {
        let found = self.decided(all, places_m, span_s, (limit_mps, 0));
        found.is_some()
    }

    /// Air that violates a limit (m/s), the highest found in so many parts once there is some.
    fn decided(
        &self,
        all: &[&Downwash<'_>],
        places_m: &Places,
        span_s: Span,
        (limit_mps, once_violated): (f64, usize),
    ) -> Option<Peak> {
        let decided = Above {
            limit_mps,
            known_mps: limit_mps,
            most_parts: MOST_PARTS,
            once_violated,
            is_decided: true,
        };
        let here = Together::new(all.to_vec());
        self.search(&here, places_m, span_s, decided).peak
    }

    /// The same for a limit of any purpose.
    fn search(
        &self,
        here: &Together<'_, '_>,
        places_m: &Places,
        span_s: Span,
        above: Above,
    ) -> ZoneSearch {
        let limit_mps = above.limit_mps;
        let (high_mps, here) = self.divided(here, places_m, span_s, limit_mps);
        let Some(here) = here else {
            return ZoneSearch {
                peak: None,
                at_most_mps: high_mps,
                parts: 0,
            };
        };
        let all = &here.all[..];
        let bound = |places_m, span_s, at_most_mps: f64| {
            let (high_mps, foremost) = self.bounded(&here, &places_m, span_s);
            SpaceTimeBox {
                high_mps: high_mps.min(at_most_mps),
                places_m,
                span_s,
                foremost,
            }
        };
        // Bits of numbers from 0 on are in the order of the numbers; of equal ones the first
        // counts.
        let rank = |part: &SpaceTimeBox, number: usize| (part.high_mps.to_bits(), Reverse(number));
        let speed_mps = fastest_mps(all);
        let mut parts = vec![bound(*places_m, span_s, high_mps)];
        let mut open = BinaryHeap::from([rank(&parts[0], 0)]);
        let mut best: Option<Peak> = None;
        let mut open_mps = 0.0_f64;
        // Corners cost as much as parts.
        let mut looked = 0;
        while let Some((_, Reverse(number))) = open.pop() {
            let part = parts[number];
            let made = parts.len() - 1 + looked;
            let violation = best.filter(|peak| peak.air_mps > VIOLATED * limit_mps);
            // A place between both is no violation yet, and must not hide one.
            let enough_mps = CLEARED * violation.map_or(limit_mps, |peak| peak.air_mps);
            let is_worst_told = violation.is_some() && made > above.once_violated;
            if part.high_mps <= enough_mps || is_worst_told {
                open_mps = part.high_mps;
                break;
            }
            let t_s = 0.5 * (part.span_s.0 + part.span_s.1);
            let place_m = Point3::from(0.5 * (part.places_m.0 + part.places_m.1));
            let given_up = made >= above.most_parts;
            if given_up && !above.is_decided {
                open_mps = part.high_mps;
                break;
            }
            if given_up && violation.is_some() {
                // That it is over the limit is known: no bound takes the place of what was found.
                open_mps = part.high_mps;
                break;
            }
            if given_up {
                let known_mps = best.map_or(above.known_mps, |it| it.air_mps);
                let bound = Peak {
                    air_mps: part.high_mps,
                    t_s,
                    place_m,
                    is_bound: true,
                };
                best = Some(bound).filter(|it| it.air_mps > known_mps).or(best);
                break;
            }
            let mut look = |t_s: f64, place_m: Point3<f64>| {
                let known_mps = best.map_or(above.known_mps, |it| it.air_mps);
                if self.may_exceed((all, &part.foremost), t_s, place_m, known_mps) {
                    let air_mps = self.at_mps(all, t_s, place_m);
                    let here = Peak {
                        air_mps,
                        t_s,
                        place_m,
                        is_bound: false,
                    };
                    best = Some(here).filter(|it| it.air_mps > known_mps).or(best);
                }
            };
            look(t_s, place_m);
            let extent_m = part.places_m.1 - part.places_m.0;
            let path_m = speed_mps * (part.span_s.1 - part.span_s.0);
            if extent_m.max().max(path_m) <= SMALLEST_M {
                // The air is highest where it comes nearest to a wake: at the surface of the zone
                // rather than within it.
                for corner in corners_m(&part.places_m).filter(|it| is_on_surface(it, places_m)) {
                    looked += 1;
                    look(t_s, corner);
                }
                continue;
            }
            // Cut in two where it is longest.
            let mut halves = [(part.places_m, part.span_s); 2];
            if path_m > extent_m.max() {
                (halves[0].1.1, halves[1].1.0) = (t_s, t_s);
            } else {
                let axis = extent_m.imax();
                (halves[0].0.1[axis], halves[1].0.0[axis]) = (place_m[axis], place_m[axis]);
            }
            for (places_m, span_s) in halves {
                let half = bound(places_m, span_s, part.high_mps);
                open.push(rank(&half, parts.len()));
                parts.push(half);
            }
        }
        ZoneSearch {
            peak: best.filter(|peak| peak.air_mps > VIOLATED * limit_mps),
            at_most_mps: best.map_or(open_mps, |peak| peak.air_mps.max(open_mps)),
            parts: parts.len() - 1 + looked,
        }
    }
}
