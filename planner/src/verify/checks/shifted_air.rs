//! The downwash that one drone is exposed to when it and every other are early or late, each by
//! itself, and when wakes are advected.
//!
//! With the receiver at `t` on its own clock and each emitter `k` at `t + s_k` on its own,
//!
//! ```text
//! mean(t, s, m) = Σ w_p ⊕ u_k(p, t, t + s_k - m τ_k)   all clocks, the receiver's included, within 2 margins of one another
//! ```
//!
//! must stay within the limit for a margin of time and for every lag `m` of the air, one for all
//! wakes (`τ`: [`Advected`]). A span of `t`, a range of lags and a range of each `s_k` are a part;
//! a part is in order when its upper bound is: each wake's worst over the part, superposed at every
//! point of the discs. What is not is looked at in its middle and at its ends, and halved where it
//! is longest, until paths are as short as what is judged by its middle. Bounds come from closed
//! forms of both motions together ([`Shifted`]), so that hovering, or flying side by side, costs no
//! more than without a margin.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use airflow::{Source, mean_over_discs_mps};
use nalgebra::{Point3, Vector2, Vector3};

use super::air::ALPHA_TOLERANCE;
use crate::plan::ViolationKind;
use crate::plan::trajectory::{LevelRegion, Motion, Shifted};
use crate::verify::bounds::wake::BoundedWake;
use crate::verify::extents::{FAINTEST_WAKE_MPS, Places, Span};
use crate::verify::scene::{Flight, Scene, level_gap_m, reaches, superpose};
use crate::verify::time::advected::{Advected, COARSE_M, Emission};
use crate::verify::time::encounters::Encounter;
use crate::verify::time::spans::between;
use crate::verify::violation::{IndexedViolation, Worst};

/// What cannot exceed the limit by more than this, over U_H, is not searched further, chosen here:
/// twice what a violation takes, so that the search ends where the mean touches the limit.
const CLEARED_ALPHA: f64 = 2.0 * ALPHA_TOLERANCE;
/// A part whose paths are this short is judged by its middle (m), chosen here: the path of a
/// millisecond at 2 m/s, as without margins.
const SHORTEST_PATH_M: f64 = 2e-3;
/// Parts of one slice of time that are looked at before the highest bound counts as found, chosen
/// here: a tenth of a second of work.
const MOST_PARTS: usize = 50_000;
/// Air that arrives in a part and left in a span of time this many times as long as the part's own
/// spans together is divided by when it left, chosen here: a drone that sinks about as fast as its
/// air leaves metres of it that arrive at one moment, and one of them counts.
const LONG_LEAVING: f64 = 4.0;
/// On either side of a moment of another clock (s), so that it lies within a span: rounding.
const MOMENT_S: f64 = 1e-6;
/// Points of the discs that are looked at together, chosen here: a quadrotor's 28 fit.
const CHUNK: usize = 32;

/// The same for the search for a drone's lateness, chosen here: with [`MOST_PARTS`] three of 85
/// drones in dense fleets get up to 0.07 s more, which takes twice as long.
const PARTS_LATE: usize = 20_000;

/// Parts of one slice of time that are looked at where the air is only reported, chosen here: a few
/// milliseconds of work.
const PARTS_REPORTED: usize = 4_000;
/// What is not higher by this, over U_H, is not reported as higher, chosen here: below the
/// hundredths that are printed.
const REPORTED_ALPHA: f64 = 2e-3;
/// Parts of one slice of time that are looked at for a bound, and how far it may be above what is
/// found, over U_H: chosen here, a bound serves where the air is far below the limit.
const PARTS_BOUNDED: usize = 1_000;
const BOUND_ALPHA: f64 = 0.02;
/// Resolution of the start and end of a violation (s): chosen here, the hundredths that are
/// printed.
const EXTENT_S: f64 = 0.01;
/// Parts of one moment that are looked at for that, chosen here: enough to tell lags apart.
const PARTS_OF_MOMENT: usize = 50;
/// Parts looked at once the limit is known to be exceeded, chosen here, and how much worse a part
/// must be to be looked at: the worst reported is then within a few percent of it.
const PARTS_ONCE_VIOLATED: usize = 400;
const WORSE: f64 = 1.02;
/// Two slices of time this close are one (s), chosen here: the reported lateness is no finer.
const JOINED_S: f64 = 0.1;

/// A wake that may reach the receiver, and the shift of its drone's clock.
#[derive(Clone, Copy)]
pub(super) struct ShiftedEmitter {
    /// Index in the scene's flights.
    pub(super) from: usize,
    /// Index in the shifts of a part.
    pub(super) clock: usize,
    /// Its air left within this span of its own clock (s); where wakes are quasi-static, any.
    left_s: Span,
}

impl ShiftedEmitter {
    /// All of its air.
    pub(super) fn new(from: usize, clock: usize) -> ShiftedEmitter {
        ShiftedEmitter {
            from,
            clock,
            left_s: (f64::NEG_INFINITY, f64::INFINITY),
        }
    }
}

/// The receiver's flight within one of its pieces, and its air limit.
#[derive(Clone)]
pub(super) struct Exposed<'a> {
    /// All flights and the air.
    scene: &'a Scene<'a>,
    /// The exposed drone.
    receiver: &'a Flight,
    /// Of its centre, one formula.
    motion: Motion,
    /// Its induced velocity at its mass (m/s).
    u_h_mps: f64,
    /// All clocks are within this of one another (s); infinite: they are free.
    together_s: f64,
}

/// A span of the receiver's time, and a range for the shift of each other clock.
#[derive(Clone)]
pub(super) struct Subdomain {
    /// From, until (s).
    pub(super) span_s: Span,
    /// Least, greatest (s).
    pub(super) shifts_s: Vec<Span>,
    /// Least and greatest lag of all air: its delay over that at the centreline's speed.
    pub(super) lags: Span,
    /// Emitters that may count.
    pub(super) emitters: Vec<ShiftedEmitter>,
}

/// One moment of every clock, and a lag.
#[derive(Clone, Debug)]
pub(super) struct ClockMoment {
    /// The receiver's (s).
    pub(super) t_s: f64,
    /// Mean air over its discs, over its induced velocity.
    alpha: f64,
    /// The same of the air itself (m/s).
    pub(super) mean_mps: f64,
    /// The flight whose wake is the strongest of all, and the shift of its clock (s).
    pub(super) strongest: (usize, f64),
    /// Of each clock that counts (s).
    shifts_s: Vec<Option<f64>>,
}

/// What is known of a part.
pub(super) enum SubdomainVerdict {
    /// The limit holds throughout.
    Clear,
    /// It does not, at this moment; its halves may hold worse, or the same at a lesser shift.
    Over(ClockMoment, Option<[Subdomain; 2]>),
    /// Its halves have to be looked at.
    Open([Subdomain; 2]),
}

/// What the least is looked for of.
#[derive(Clone, Copy)]
enum Along {
    /// The shift of the first clock, either way.
    Shift,
    /// The receiver's time since then (s).
    Since(f64),
    /// Its time until then (s).
    Until(f64),
}

impl Along {
    /// The least in a part (s).
    fn low_s(self, part: &Subdomain) -> f64 {
        match self {
            Along::Shift => part.shifts_s[0].0.max(-part.shifts_s[0].1).max(0.0),
            Along::Since(from_s) => part.span_s.0 - from_s,
            Along::Until(until_s) => until_s - part.span_s.1,
        }
    }

    fn of_s(self, moment: &ClockMoment) -> f64 {
        match self {
            Along::Shift => {
                let shift_s = moment.shifts_s.first().copied().flatten();
                shift_s.map_or(0.0, f64::abs)
            }
            Along::Since(from_s) => moment.t_s - from_s,
            Along::Until(until_s) => until_s - moment.t_s,
        }
    }

    /// The dimension of a part that it is (s).
    fn range(self, part: &mut Subdomain) -> &mut Span {
        match self {
            Along::Shift => &mut part.shifts_s[0],
            Along::Since(_) | Along::Until(_) => &mut part.span_s,
        }
    }

    fn in_two(self, mut part: Subdomain) -> [Subdomain; 2] {
        let (low_s, high_s) = *self.range(&mut part);
        let middle_s = 0.5 * (low_s + high_s);
        let mut halves = [part.clone(), part];
        self.range(&mut halves[0]).1 = middle_s;
        self.range(&mut halves[1]).0 = middle_s;
        halves
    }
}

/// One wake during one piece of its drone as seen from the receiver.
struct Passing<'a> {
    wake: &'a BoundedWake,
    /// When its air left, where wakes are advected (s).
    left_s: Option<Span>,
    /// Offsets of the receiver from where the air left (m).
    places_m: Places,
    /// The same in closed form.
    moments: Shifted,
    /// The same from above.
    region: LevelRegion,
    /// An upper bound anywhere on the receiver's discs (m/s).
    high_mps: f64,
}

/// Slices over the limit one after another.
struct SlicesOverLimit<'a> {
    /// With margins or without.
    kind: ViolationKind,
    /// The first and the last of them, each with a moment over the limit (s).
    first: (Slice<'a>, f64),
    last: (Slice<'a>, f64),
    /// Of all of them.
    worst: ClockMoment,
}

impl SlicesOverLimit<'_> {
    /// From its first to its last moment over the limit (s).
    fn span_s(&self, margin_s: f64) -> Span {
        let margin_s = match self.kind {
            ViolationKind::Air => 0.0,
            _ => margin_s,
        };
        let extent_s = |(slice, known_s): &(Slice<'_>, f64)| {
            let whole = slice.whole(margin_s);
            slice.exposed.extent_s(&whole, *known_s)
        };
        (extent_s(&self.first).0, extent_s(&self.last).1)
    }
}

/// Whether one receiver may exceed its limit when wakes are advected, or at some shift of the
/// clocks within the margin, and when.
pub(crate) fn check(
    scene: &Scene<'_>,
    slices: Vec<Bounded<'_>>,
    receiver: &Flight,
) -> Vec<IndexedViolation> {
    let margin_s = 2.0 * scene.margins.time_s;
    let is_advected = scene.lags().1 > 0.0;
    let mut runs: Vec<SlicesOverLimit> = Vec::new();
    for Bounded { slice, most_mps } in slices {
        if most_mps <= slice.exposed.cleared_mps() {
            continue;
        }
        let Some(shifted) = slice.exposed.over(slice.whole(margin_s)) else {
            continue;
        };
        let on_time = match margin_s > 0.0 {
            true => is_advected
                .then(|| slice.exposed.over(slice.whole(0.0)))
                .flatten(),
            false => Some(shifted.clone()),
        };
        let (kind, worst) = match on_time {
            Some(moment) => (ViolationKind::Air, moment),
            None => (ViolationKind::AirMargin, shifted),
        };
        let here = (slice, worst.t_s);
        match runs.last_mut() {
            Some(run) if run.kind == kind && here.0.span_s.0 - run.last.0.span_s.1 <= JOINED_S => {
                run.last = here;
                if worst.alpha > run.worst.alpha {
                    run.worst = worst;
                }
            }
            _ => runs.push(SlicesOverLimit {
                kind,
                first: here.clone(),
                last: here,
                worst,
            }),
        }
    }
    let found = runs.into_iter().map(|run| {
        let span_s = run.span_s(margin_s);
        let SlicesOverLimit {
            kind,
            worst: moment,
            ..
        } = run;
        let (from, shift_s) = moment.strongest;
        let worst = Worst {
            with: Some(scene.flights[from].name.clone()),
            position_m: receiver.position_m(moment.t_s),
            value: moment.alpha,
            limit: receiver.air_limit,
        };
        let (index, mut violation) = scene.violation(receiver, kind, span_s, worst);
        violation.shift_s = (kind == ViolationKind::AirMargin).then_some(shift_s);
        (index, violation)
    });
    found.collect()
}

/// A flight in slices, each with a bound; empty where no drone is early or late and no air is.
pub(crate) fn bounded<'a>(
    scene: &'a Scene<'a>,
    near: &[Encounter],
    receiver: &'a Flight,
) -> Vec<Bounded<'a>> {
    let margin_s = 2.0 * scene.margins.time_s;
    let is_advected = scene.lags().1 > 0.0;
    if margin_s <= 0.0 && !is_advected {
        return Vec::new();
    }
    let slices = slices(scene, near, receiver, margin_s).into_iter();
    let bounded = slices.map(|slice| Bounded {
        // Else the limit alone is asked for, which begins with the same.
        most_mps: match is_advected {
            true => slice.exposed.rough_of_all_mps(&slice.whole(margin_s)),
            false => f64::INFINITY,
        },
        slice,
    });
    bounded.collect()
}

/// The highest mean air over a receiver's discs with every drone on time, over all lags of the air
/// and the moments of a span (s), to [`REPORTED_ALPHA`] and a few percent, as far as that is looked
/// for; `None`: none is found that is higher than that above what is known (m/s).
pub(super) fn highest(
    slices: &[Bounded<'_>],
    within_s: Span,
    mut known_mps: f64,
) -> Option<ClockMoment> {
    // Where the bound is the highest is looked at first: it mostly settles the rest. Speeds are not
    // negative: their bits are in their order.
    let mut open = Queue::new();
    for (index, Bounded { slice, most_mps }) in slices.iter().enumerate() {
        let mut part = slice.whole(0.0);
        let (from_s, until_s) = part.span_s;
        part.span_s = (from_s.max(within_s.0), until_s.min(within_s.1));
        if part.span_s.0 <= part.span_s.1 {
            open.push(most_mps.to_bits(), (index, part));
        }
    }
    let mut looked_at = vec![0; slices.len()];
    let mut highest: Option<ClockMoment> = None;
    while let Some((most, (index, part))) = open.pop() {
        let exposed = &slices[index].slice.exposed;
        let known = exposed.alpha(known_mps) + REPORTED_ALPHA;
        let is_settled = f64::from_bits(most) <= exposed.mean_mps(known * WORSE);
        if is_settled || looked_at[index] == PARTS_REPORTED {
            continue;
        }
        looked_at[index] += 1;
        let (verdict, high_mps) = exposed.judge(part, Some(known));
        let halves = match verdict {
            SubdomainVerdict::Clear => None,
            SubdomainVerdict::Open(halves) => Some(halves),
            SubdomainVerdict::Over(moment, halves) => {
                known_mps = moment.mean_mps;
                highest = Some(moment);
                halves
            }
        };
        for half in halves.into_iter().flatten() {
            open.push(high_mps.to_bits(), (index, half));
        }
    }
    highest
}

/// Whether a receiver exceeds its limit with every drone on time, at any lag of the air.
pub(super) fn exceeds(scene: &Scene<'_>, near: &[Encounter], receiver: &Flight) -> bool {
    let slices = slices(scene, near, receiver, 0.0).into_iter();
    let mut over = slices.map(|slice| slice.exposed.over(slice.whole(0.0)));
    over.any(|moment| moment.is_some())
}

/// The spans within pieces of a receiver and some encounters (s) in which the wake of one flight
/// may count at some shift of its clock (s).
pub(super) fn within_reach_s(
    scene: &Scene<'_>,
    receiver: &Flight,
    near: &[Encounter],
    (from, shift_s): (usize, Span),
) -> Vec<Span> {
    let parts = near.iter().flat_map(|it| receiver.parts(it.span_s));
    let within = parts.filter(|it| it.flies).filter_map(|it| {
        let exposed = Exposed {
            scene,
            receiver,
            motion: it.motion,
            u_h_mps: receiver.wakes[it.piece].wake.hover_velocity_mps(),
            together_s: f64::INFINITY,
        };
        let part = Subdomain {
            span_s: (it.motion.from_s, it.motion.until_s),
            shifts_s: vec![shift_s],
            lags: scene.lags(),
            emitters: Vec::new(),
        };
        let high_mps = exposed.rough_mps(&part, ShiftedEmitter::new(from, 0));
        (high_mps > FAINTEST_WAKE_MPS).then_some(part.span_s)
    });
    within.collect()
}

/// A slice, and an upper bound of the mean air over the receiver's discs in it (m/s): at every lag
/// of the air, all clocks within the margins.
pub(crate) struct Bounded<'a> {
    slice: Slice<'a>,
    most_mps: f64,
}

/// What is open, each with a key: the highest comes first, of equals the last.
struct Queue<K, T> {
    keys: BinaryHeap<(K, usize)>,
    items: Vec<Option<T>>,
}

impl<K: Ord + Copy, T> Queue<K, T> {
    /// Nothing is open.
    fn new() -> Queue<K, T> {
        Queue {
            keys: BinaryHeap::new(),
            items: Vec::new(),
        }
    }

    /// Opens one more.
    fn push(&mut self, key: K, item: T) {
        self.keys.push((key, self.items.len()));
        self.items.push(Some(item));
    }

    /// The next, which is no longer open.
    fn pop(&mut self) -> Option<(K, T)> {
        let (key, index) = self.keys.pop()?;
        self.items[index].take().map(|item| (key, item))
    }

    fn next_key(&self) -> Option<K> {
        self.keys.peek().map(|it| it.0)
    }
}

/// A span of the receiver's time within one of its pieces, and the flights near it.
#[derive(Clone)]
pub(super) struct Slice<'a> {
    /// The receiver in it.
    pub(super) exposed: Exposed<'a>,
    /// From, until (s).
    pub(super) span_s: Span,
    /// Indices in the scene's flights.
    pub(super) met: Vec<usize>,
}

impl Slice<'_> {
    /// Lags of the air that have to be borne.
    pub(super) fn lags(&self) -> Span {
        self.exposed.scene.lags()
    }

    /// An upper bound of the mean air over the receiver's discs with every drone on time, at every
    /// lag of the air (m/s).
    pub(super) fn bound_mps(&self) -> f64 {
        self.exposed.bound_mps(self.whole(0.0))
    }

    /// All of it, every clock by itself up to a margin early or late (s).
    fn whole(&self, margin_s: f64) -> Subdomain {
        let emitters = self.met.iter().enumerate();
        Subdomain {
            span_s: self.span_s,
            shifts_s: vec![(-margin_s, margin_s); self.met.len()],
            lags: self.lags(),
            emitters: emitters
                .map(|(clock, &from)| ShiftedEmitter::new(from, clock))
                .collect(),
        }
    }
}

/// The airborne flight of a receiver in slices, those with no other drone near left out; all clocks
/// within `together_s` of one another (s).
pub(super) fn slices<'a>(
    scene: &'a Scene<'a>,
    near: &[Encounter],
    receiver: &'a Flight,
    together_s: f64,
) -> Vec<Slice<'a>> {
    let spans_s: Vec<Span> = near.iter().map(|encounter| encounter.span_s).collect();
    let (from_s, until_s) = (
        receiver.airborne_s.0,
        receiver.airborne_s.1.min(scene.horizon_s),
    );
    let parts: Vec<_> = receiver
        .parts((from_s, until_s))
        .filter(|it| it.flies)
        .collect();
    let mut cuts_s: Vec<f64> = spans_s
        .iter()
        .flat_map(|span_s| [span_s.0, span_s.1])
        .collect();
    cuts_s.extend(
        parts
            .iter()
            .flat_map(|it| [it.motion.from_s, it.motion.until_s]),
    );
    cuts_s.retain(|&t_s| t_s >= from_s && t_s <= until_s);
    cuts_s.sort_by(f64::total_cmp);
    cuts_s.dedup();
    let mut parts = parts.into_iter().peekable();
    let mut slices = Vec::new();
    for (span_s, met) in between(&cuts_s, &spans_s) {
        while parts.next_if(|it| it.motion.until_s <= span_s.0).is_some() {}
        let Some(part) = parts.peek().filter(|it| it.motion.from_s <= span_s.0) else {
            continue;
        };
        if met.is_empty() {
            continue;
        }
        let exposed = Exposed {
            scene,
            receiver,
            motion: part.motion,
            u_h_mps: receiver.wakes[part.piece].wake.hover_velocity_mps(),
            together_s,
        };
        let met = met.iter().map(|&k| near[k].other).collect();
        slices.push(Slice {
            exposed,
            span_s,
            met,
        });
    }
    slices
}

impl<'a> Exposed<'a> {
    /// Mean air (m/s) of which the part that counts is so much over the induced velocity.
    fn mean_mps(&self, alpha: f64) -> f64 {
        self.scene.flown.mean_mps(alpha, self.u_h_mps)
    }

    /// Mean air over the induced velocity (m/s of it), backwards.
    fn alpha(&self, mean_mps: f64) -> f64 {
        self.scene.flown.alpha(mean_mps, self.u_h_mps)
    }

    /// Mean air up to which the limit holds (m/s).
    fn cleared_mps(&self) -> f64 {
        self.mean_mps(self.receiver.air_limit + CLEARED_ALPHA)
    }

    /// The worst moment of a part at which the limit is exceeded, if there is one: to a few percent
    /// of it, as far as that is looked for.
    fn over(&self, whole: Subdomain) -> Option<ClockMoment> {
        let mut open = vec![whole];
        let mut worst: Option<ClockMoment> = None;
        for made in 0..MOST_PARTS {
            if worst.is_some() && made > PARTS_ONCE_VIOLATED {
                return worst;
            }
            let Some(part) = open.pop() else {
                return worst;
            };
            let known = worst.as_ref().map(|it| it.alpha);
            match self.judge(part, known).0 {
                SubdomainVerdict::Clear => {}
                SubdomainVerdict::Open(halves) => open.extend(halves),
                SubdomainVerdict::Over(moment, halves) => {
                    worst = Some(moment);
                    open.extend(halves.into_iter().flatten());
                }
            }
        }
        // Not decided: what may exceed the limit counts as if it did.
        worst.or_else(|| {
            let part = open.pop()?;
            let from = part.emitters.first()?.from;
            Some(ClockMoment {
                t_s: part.span_s.0,
                alpha: self.receiver.air_limit + CLEARED_ALPHA,
                mean_mps: self.mean_mps(self.receiver.air_limit + CLEARED_ALPHA),
                strongest: (from, 0.0),
                shifts_s: Vec::new(),
            })
        })
    }

    /// The least shift of the first clock, either way, at which the limit is exceeded in a part, to
    /// a resolution (s); `None`: none below one that is known (s).
    pub(super) fn least_shift_s(&self, whole: Subdomain, below_s: f64, fine_s: f64) -> Option<f64> {
        let (found_s, open_s) = self.least_s(Along::Shift, whole, below_s, (fine_s, PARTS_LATE));
        // Not decided: the least that may be.
        let least_s = found_s.min(open_s);
        (least_s < below_s).then_some(least_s)
    }

    /// From when on and until when the limit is exceeded in a part (s), to [`EXTENT_S`], as far as
    /// that is looked for; it is at a moment that is known (s).
    fn extent_s(&self, whole: &Subdomain, known_s: f64) -> Span {
        let (from_s, until_s) = whole.span_s;
        let how = (EXTENT_S, PARTS_ONCE_VIOLATED);
        let least_s = |along, known_s| self.least_s(along, whole.clone(), known_s, how).0;
        // About the known moment first, then what there may be apart from it.
        let [first_s, last_s] =
            [from_s, until_s].map(|end_s| self.bisected_s(whole, known_s, end_s));
        let after_s = least_s(Along::Since(from_s), first_s - from_s);
        let before_s = least_s(Along::Until(until_s), until_s - last_s);
        (from_s + after_s, until_s - before_s)
    }

    /// The moment between one at which the limit is exceeded and an end of a part (s) from which on
    /// it is not, to [`EXTENT_S`]; the end itself where it is exceeded there.
    fn bisected_s(&self, whole: &Subdomain, over_s: f64, end_s: f64) -> f64 {
        let is_over = |t_s: f64| {
            let mut open = vec![Subdomain {
                span_s: (t_s, t_s),
                ..whole.clone()
            }];
            for _ in 0..PARTS_OF_MOMENT {
                match open.pop().map(|part| self.judge(part, None).0) {
                    Some(SubdomainVerdict::Over(..)) => return true,
                    Some(SubdomainVerdict::Open(halves)) => open.extend(halves),
                    Some(SubdomainVerdict::Clear) => {}
                    None => break,
                }
            }
            false
        };
        if is_over(end_s) {
            return end_s;
        }
        let (mut over_s, mut clear_s) = (over_s, end_s);
        while (over_s - clear_s).abs() > EXTENT_S {
            let middle_s = 0.5 * (over_s + clear_s);
            match is_over(middle_s) {
                true => over_s = middle_s,
                false => clear_s = middle_s,
            }
        }
        over_s
    }

    /// The least at which the limit is exceeded in a part, along one of its dimensions, to a
    /// resolution (s), by no more than so many parts; it is exceeded at what is known (s). And
    /// the least of what is not decided; infinite: all is.
    fn least_s(
        &self,
        along: Along,
        whole: Subdomain,
        known_s: f64,
        (fine_s, most): (f64, usize),
    ) -> (f64, f64) {
        if known_s <= 0.0 {
            return (known_s, f64::INFINITY);
        }
        let mut least_s = known_s;
        // Those of the least have their turn first, of equals the last: what is not decided in the
        // end lies beyond as much as can be.
        let mut open = Queue::new();
        open.push(Reverse(0), whole);
        for _ in 0..most {
            let part = open.pop().map(|(_, part)| part);
            // What begins at none is decided, however near it the least is.
            let matters = |it: &Subdomain| along.low_s(it) <= (least_s - fine_s).max(0.0);
            let Some(part) = part.filter(matters) else {
                return (least_s, f64::INFINITY);
            };
            let low_s = along.low_s(&part);
            let mut whole = part.clone();
            let (from_s, until_s) = *along.range(&mut whole);
            let is_short = until_s - from_s <= fine_s;
            let halves = match self.judge(part, None).0 {
                SubdomainVerdict::Clear => None,
                SubdomainVerdict::Open(halves) => Some(halves),
                SubdomainVerdict::Over(moment, halves) => {
                    let at_s = along.of_s(&moment);
                    if at_s <= 0.0 || is_short && low_s <= 0.0 {
                        return (0.0, f64::INFINITY);
                    }
                    least_s = least_s.min(at_s);
                    // Where no path is long it is the same in all of it, or there is air in some.
                    (!is_short).then(|| halves.unwrap_or_else(|| along.in_two(whole)))
                }
            };
            for half in halves.into_iter().flatten() {
                // They are not negative: their bits are in their order.
                open.push(Reverse(along.low_s(&half).to_bits()), half);
            }
        }
        let least_open_s = open.next_key().map(|it| f64::from_bits(it.0));
        (least_s, least_open_s.unwrap_or(f64::INFINITY))
    }

    /// Whether the limit holds throughout a part, whatever else is there, of which there is at most
    /// so much (m/s): superposed, it and a wake are no more than both together.
    pub(super) fn bears(&self, part: &Subdomain, emitter: ShiftedEmitter, most_mps: f64) -> bool {
        let cleared_mps = self.cleared_mps();
        most_mps <= cleared_mps && most_mps + self.rough_mps(part, emitter) <= cleared_mps
    }

    /// An upper bound of the mean air over a part (m/s), by no more than [`BOUND_ALPHA`] where that
    /// many parts are enough.
    fn bound_mps(&self, whole: Subdomain) -> f64 {
        let how = self.scene.superposition;
        let within_mps = BOUND_ALPHA * self.u_h_mps;
        let mut found_mps = 0.0_f64;
        let mut open = Queue::new();
        open.push(f64::MAX.to_bits(), whole);
        for _ in 0..PARTS_BOUNDED {
            let Some((high, part)) = open.pop() else {
                break;
            };
            if f64::from_bits(high) <= found_mps + within_mps {
                break;
            }
            let Some(window_s) = self.feasible_s(&part) else {
                continue;
            };
            let passing = part.emitters.iter().map(|it| self.passing(&part, *it));
            let passing: Vec<Vec<Passing<'a>>> = passing.collect();
            let rough: Vec<f64> = passing.iter().map(|it| rough_of_mps(it)).collect();
            let high_mps = superpose(how, rough.iter().copied()).min(self.high_mps(&passing));
            found_mps = found_mps.max(self.worst_of(&part, window_s, &passing).mean_mps);
            if high_mps <= found_mps + within_mps {
                continue;
            }
            for half in self.halves(part, &rough, &passing).into_iter().flatten() {
                open.push(high_mps.to_bits(), half);
            }
        }
        let open_mps = open.next_key().map_or(0.0, f64::from_bits);
        open_mps.max(found_mps + within_mps)
    }

    /// Looks at a part: on bounds, then at some of its moments. What is no more than a few percent
    /// above what is known over the limit is in order. And an upper bound of its air (m/s).
    fn judge(&self, mut part: Subdomain, known: Option<f64>) -> (SubdomainVerdict, f64) {
        let Some(window_s) = self.feasible_s(&part) else {
            return (SubdomainVerdict::Clear, 0.0);
        };
        let limit = self.receiver.air_limit;
        let cleared = known.map_or(limit + CLEARED_ALPHA, |alpha| alpha * WORSE);
        let cleared_mps = self.mean_mps(cleared);
        let how = self.scene.superposition;
        let mut rough: Vec<f64> = Vec::with_capacity(part.emitters.len());
        let mut passing: Vec<Vec<Passing<'a>>> = Vec::with_capacity(part.emitters.len());
        for emitter in std::mem::take(&mut part.emitters) {
            let of_one = self.passing(&part, emitter);
            let high_mps = rough_of_mps(&of_one);
            if high_mps > FAINTEST_WAKE_MPS {
                part.emitters.push(emitter);
                rough.push(high_mps);
                passing.push(of_one);
            }
        }
        let mut high_mps = superpose(how, rough.iter().copied());
        if high_mps > cleared_mps {
            high_mps = high_mps.min(self.high_mps(&passing));
        }
        if high_mps <= cleared_mps {
            return (SubdomainVerdict::Clear, high_mps);
        }
        let moment = self.worst_of(&part, window_s, &passing);
        let halves = self.halves(part, &rough, &passing);
        if moment.alpha > known.unwrap_or(limit + ALPHA_TOLERANCE) {
            return (SubdomainVerdict::Over(moment, halves), high_mps);
        }
        (
            halves.map_or(SubdomainVerdict::Clear, SubdomainVerdict::Open),
            high_mps,
        )
    }

    /// How early the earliest clock may be so that every clock has a moment of the part, at least
    /// and at most (s); `None`: clocks so far apart are not asked for.
    fn feasible_s(&self, part: &Subdomain) -> Option<Span> {
        let used = part.emitters.iter().map(|it| part.shifts_s[it.clock]);
        // The receiver's own shift is 0.
        let (latest_low, earliest_high) = used.fold((0.0_f64, 0.0_f64), |(low, high), it| {
            (low.max(it.0), high.min(it.1))
        });
        let window_s = (latest_low - self.together_s, earliest_high);
        (window_s.0 <= window_s.1).then_some(window_s)
    }

    /// The wakes of an emitter that may reach the receiver in a part.
    fn passing(&self, part: &Subdomain, emitter: ShiftedEmitter) -> Vec<Passing<'a>> {
        let mut passing = Vec::new();
        self.each(part, emitter, &mut |it| passing.push(it));
        passing
    }

    /// Hands on the wakes of an emitter that may reach the receiver in a part.
    fn each(&self, part: &Subdomain, emitter: ShiftedEmitter, report: &mut dyn FnMut(Passing<'a>)) {
        let (span_s, shift_s) = (part.span_s, part.shifts_s[emitter.clock]);
        let theirs_s = (span_s.0 + shift_s.0, span_s.1 + shift_s.1);
        let obstacles = &self.scene.obstacles;
        if let Some(advected) = Advected::new(self.scene, emitter.from, part.lags) {
            self.each_advected(part, (&advected, emitter), report);
            return;
        }
        let flight = &self.scene.flights[emitter.from];
        let mine = self.motion.during(span_s.0, span_s.1);
        let my_chord = mine.chord();
        let mine_m = mine.box_m(span_s.0, span_s.1);
        // A moment alone is asked for as well.
        let around_s = (theirs_s.0 - MOMENT_S, theirs_s.1 + MOMENT_S);
        for theirs in flight.parts(around_s).filter(|it| it.flies) {
            let motion = &theirs.motion;
            let from_m = motion.box_m(motion.from_s, motion.until_s);
            if self.is_beyond_reach(&flight.wakes[theirs.piece], &from_m, &mine_m) {
                continue;
            }
            let Some(moments) = Shifted::of_chords(&my_chord, &theirs.motion.chord(), shift_s)
            else {
                continue;
            };
            let places_m = moments.box_m();
            if places_m.0.z >= 0.0 {
                continue;
            }
            let (wake, stops) = (&flight.wakes[theirs.piece], &flight.stops[theirs.piece]);
            if !stops.is_empty() {
                let [_, (leaves_s, left_s)] = moments.spans_s();
                let from_m = theirs.motion.box_m(leaves_s, left_s);
                let heights_m = (mine_m.0.z, mine_m.1.z);
                if !reaches(wake, stops, &from_m, obstacles, heights_m).1 {
                    continue;
                }
            }
            report(self.passing_of(wake, None, moments, places_m));
        }
    }

    /// Hands on the advected wakes of an emitter that may reach the receiver in a part.
    fn each_advected(
        &self,
        part: &Subdomain,
        (advected, emitter): (&Advected<'a>, ShiftedEmitter),
        report: &mut dyn FnMut(Passing<'a>),
    ) {
        let ((from_s, until_s), shift_s) = (part.span_s, part.shifts_s[emitter.clock]);
        let mine = self.motion.during(from_s, until_s);
        let my_chord = mine.chord();
        let (low_m, high_m) = mine.box_m(from_s, until_s);
        let heights_m = (low_m.z, high_m.z);
        let emitted = advected.emitted((from_s + shift_s.0, until_s + shift_s.1), heights_m);
        let (first_s, last_s) = emitter.left_s;
        let allowed = emitted.into_iter().filter_map(|it| {
            let span_s = (it.span_s.0.max(first_s), it.span_s.1.min(last_s));
            (span_s.0 <= span_s.1).then_some(Emission { span_s, ..it })
        });
        let steps = allowed.flat_map(|it| {
            let steps = advected.steps(&it, COARSE_M);
            steps.map(move |span_s| Emission { span_s, ..it })
        });
        for it in steps {
            let attached = advected.attached(&it, it.span_s);
            let from_m = attached.motion.box_m(it.span_s.0, it.span_s.1);
            if self.is_beyond_reach(attached.wake, &from_m, &(low_m, high_m)) {
                continue;
            }
            let ages_s = advected.ages_s(&it, heights_m);
            let moments = match it.is_moment {
                true => {
                    let there_m = Point3::from(attached.motion.at_m(it.span_s.0));
                    let stands = Motion::straight(part.span_s, there_m, there_m);
                    let any_s = (f64::NEG_INFINITY, f64::INFINITY);
                    Shifted::of_chords(&my_chord, &(stands, 0.0), any_s)
                }
                false => {
                    let least_s = shift_s.0 - ages_s.1 - MOMENT_S;
                    Shifted::of_chords(
                        &my_chord,
                        &attached.motion.chord(),
                        (least_s, shift_s.1 - ages_s.0 + MOMENT_S),
                    )
                }
            };
            let Some(moments) = moments else { continue };
            let places_m = moments.box_m();
            if places_m.0.z >= 0.0 {
                continue;
            }
            if !attached.stops.is_empty() {
                let obstacles = &self.scene.obstacles;
                if !reaches(attached.wake, attached.stops, &from_m, obstacles, heights_m).1 {
                    continue;
                }
            }
            report(self.passing_of(attached.wake, Some(it.span_s), moments, places_m));
        }
    }

    /// Whether a wake whose air left at some places is faint at all of the receiver's, to judge by
    /// their distance (m): what would not be counted is not looked at.
    fn is_beyond_reach(&self, wake: &BoundedWake, from_m: &Places, mine_m: &Places) -> bool {
        let gap_m = level_gap_m(from_m, mine_m) - self.receiver.tip_radius_m;
        !wake.is_moved() && gap_m > wake.reach_m(from_m.1.z - mine_m.0.z)
    }

    /// One wake while the receiver is at some offsets from where its air left.
    fn passing_of(
        &self,
        wake: &'a BoundedWake,
        left_s: Option<Span>,
        moments: Shifted,
        places_m: Places,
    ) -> Passing<'a> {
        let tip_m = self.receiver.tip_radius_m;
        let around_m = Vector3::new(tip_m, tip_m, 0.0);
        let region = moments.level_region();
        let off_axis_m = (region.nearest_m([0.0; 2]).norm() - tip_m).max(0.0);
        let around_m = (places_m.0 - around_m, places_m.1 + around_m);
        Passing {
            high_mps: wake.highest_mps(&around_m, off_axis_m),
            wake,
            left_s,
            places_m,
            moments,
            region,
        }
    }

    /// An upper bound of one wake anywhere on the receiver's discs over a part (m/s).
    fn rough_mps(&self, part: &Subdomain, emitter: ShiftedEmitter) -> f64 {
        let mut high_mps = 0.0_f64;
        self.each(part, emitter, &mut |it| {
            high_mps = high_mps.max(it.high_mps)
        });
        high_mps
    }

    /// Whether the limit may be exceeded somewhere in a part, by a bound of each wake.
    pub(super) fn may_be_over(&self, part: &Subdomain) -> bool {
        self.rough_of_all_mps(part) > self.cleared_mps()
    }

    /// An upper bound of all wakes anywhere on the receiver's discs over a part (m/s).
    fn rough_of_all_mps(&self, part: &Subdomain) -> f64 {
        let of_one = part.emitters.iter().map(|it| self.rough_mps(part, *it));
        superpose(self.scene.superposition, of_one)
    }

    /// An upper bound of the mean air that closes in on it as the part shrinks (m/s).
    fn high_mps(&self, passing: &[Vec<Passing<'a>>]) -> f64 {
        let (how, discs) = (self.scene.superposition, &self.receiver.discs);
        let mut high_mps = 0.0;
        for (points_m, weights) in (discs.offsets_m.chunks(CHUNK)).zip(discs.weights.chunks(CHUNK))
        {
            let mut gathered = [0.0; CHUNK];
            for of_one in passing {
                let mut highest = [0.0_f64; CHUNK];
                // What is nowhere higher than the strongest is everywhere need not be looked at.
                let all = of_one.iter().enumerate();
                let strongest = all.max_by(|a, b| a.1.high_mps.total_cmp(&b.1.high_mps));
                let Some((first, strongest)) = strongest else {
                    continue;
                };
                strongest.raise(points_m, &mut highest);
                let others = of_one.iter().enumerate().filter(|(k, _)| *k != first);
                for (_, it) in others {
                    let known = highest.iter().take(points_m.len());
                    if it.high_mps > known.copied().fold(f64::INFINITY, f64::min) {
                        it.raise(points_m, &mut highest);
                    }
                }
                for (so_far, highest_mps) in gathered.iter_mut().zip(highest) {
                    *so_far = how.gather(*so_far, highest_mps);
                }
            }
            for (&gathered, weight) in gathered.iter().zip(weights) {
                high_mps += weight * how.finish(gathered);
            }
        }
        high_mps
    }

    /// A moment of every clock where the air may be the highest of a part: the middle of the
    /// receiver's time, the middle or an end of the lags, and, for each emitter, the end, the
    /// middle or the nearest approach that is the worst by itself.
    fn worst_of(
        &self,
        part: &Subdomain,
        window_s: Span,
        passing: &[Vec<Passing<'a>>],
    ) -> ClockMoment {
        let (low, high) = part.lags;
        let worst = self.worst_at(part, window_s, (passing, 0.5 * (low + high)));
        if low == high {
            return worst;
        }
        let ends = [low, high].map(|lag| self.worst_at(part, window_s, (passing, lag)));
        let worse = |a: ClockMoment, b: ClockMoment| if b.alpha > a.alpha { b } else { a };
        ends.into_iter().fold(worst, worse)
    }

    /// The same at one lag.
    fn worst_at(
        &self,
        part: &Subdomain,
        window_s: Span,
        (passing, lag): (&[Vec<Passing<'a>>], f64),
    ) -> ClockMoment {
        let t_s = 0.5 * (part.span_s.0 + part.span_s.1);
        let earliest_s = 0.5 * (window_s.0.max(-self.together_s) + window_s.1.min(0.0));
        let place_m = Point3::from(self.motion.at_m(t_s));
        let mut chosen: Vec<Option<f64>> = vec![None; part.shifts_s.len()];
        let mut sources: Vec<Source<'a>> = Vec::new();
        let mut strongest = (0.0, (0, 0.0));
        for (emitter, of_one) in part.emitters.iter().zip(passing) {
            let (low_s, high_s) = part.shifts_s[emitter.clock];
            let (low_s, high_s) = match earliest_s.is_finite() {
                true => (
                    low_s.max(earliest_s),
                    high_s.min(earliest_s + self.together_s),
                ),
                false => (low_s, high_s),
            };
            let nearest = of_one.iter().map(|it| {
                let approach = it.moments.nearest_to_axis();
                let age_s = match lag > 0.0 {
                    true => {
                        lag * it
                            .wake
                            .wake
                            .far_field()
                            .transport_time_s(-it.places_m.0.z, 1.0)
                    }
                    false => 0.0,
                };
                (approach.other_s - approach.t_s + age_s).clamp(low_s, high_s.max(low_s))
            });
            let candidates = [0.5 * (low_s + high_s), low_s, high_s].into_iter();
            let candidates: Vec<f64> = match chosen[emitter.clock] {
                Some(shift_s) => vec![shift_s],
                None if low_s == high_s => vec![low_s],
                None => candidates.chain(nearest).collect(),
            };
            let mut worst: Option<(f64, f64, Source<'a>)> = None;
            for shift_s in candidates {
                let at_s = t_s + shift_s;
                for source in self.sources((emitter.from, lag), at_s, place_m.z) {
                    let mean_mps = self.mean_of_mps(&[source], place_m);
                    if worst.as_ref().is_none_or(|known| mean_mps > known.0) {
                        worst = Some((mean_mps, shift_s, source));
                    }
                }
            }
            if let Some((mean_mps, shift_s, source)) = worst {
                chosen[emitter.clock] = Some(shift_s);
                sources.push(source);
                if mean_mps > strongest.0 {
                    strongest = (mean_mps, (emitter.from, shift_s));
                }
            }
        }
        let mean_mps = self.mean_of_mps(&sources, place_m);
        ClockMoment {
            t_s,
            alpha: self.alpha(mean_mps),
            mean_mps,
            strongest: strongest.1,
            shifts_s: chosen,
        }
    }

    /// Mean over the receiver's discs of some wakes, superposed (m/s).
    fn mean_of_mps(&self, sources: &[Source<'a>], place_m: Point3<f64>) -> f64 {
        mean_over_discs_mps(
            sources,
            &self.receiver.discs,
            place_m,
            self.scene.superposition,
        )
    }

    /// The wakes of a flight that may be at a height (m) at a time of its clock (s), at a lag.
    fn sources(&self, (from, lag): (usize, f64), t_s: f64, z_m: f64) -> Vec<Source<'a>> {
        let obstacles = &self.scene.obstacles;
        if let Some(advected) = Advected::new(self.scene, from, (lag, lag)) {
            return advected.sources(obstacles, t_s, z_m);
        }
        let flight = &self.scene.flights[from];
        let (up_s, down_s) = flight.airborne_s;
        // Before it comes or begins it is where it begins.
        let t_s = t_s.max(
            flight
                .trajectory
                .pieces()
                .first()
                .map_or(0.0, |it| it.motion.from_s),
        );
        let flies = up_s <= t_s && t_s <= down_s;
        let piece = flight.trajectory.piece_index(t_s).filter(|_| flies);
        let source = piece.map(|piece| {
            let motion = flight.trajectory.pieces()[piece].motion;
            flight.attached(from, piece, motion).source(obstacles, t_s)
        });
        source.into_iter().collect()
    }

    /// A part in two, where the paths of what counts most are longest; `None`: they are too short.
    fn halves(
        &self,
        part: Subdomain,
        rough: &[f64],
        passing: &[Vec<Passing<'a>>],
    ) -> Option<[Subdomain; 2]> {
        let path_m = |of_one: &[Passing<'a>]| {
            let paths_m = of_one
                .iter()
                .map(|it| (it.places_m.1 - it.places_m.0).norm());
            paths_m.fold(0.0, f64::max)
        };
        let paths_m: Vec<f64> = passing.iter().map(|it| path_m(it)).collect();
        if paths_m.iter().all(|path_m| *path_m <= SHORTEST_PATH_M) {
            return None;
        }
        let weights = rough.iter().zip(&paths_m).map(|(mps, path_m)| mps * path_m);
        let longest = weights.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        let longest = longest.map_or(0, |(k, _)| k);
        let clock = part.emitters[longest].clock;
        let (from_s, until_s) = part.span_s;
        let (low_s, high_s) = part.shifts_s[clock];
        let (least, most) = part.lags;
        // What the range of lags makes of the moments at which its air left.
        let ages_s = match most > least {
            true => {
                let ages_s = passing[longest].iter().map(|it| {
                    let far = it.wake.wake.far_field();
                    far.transport_time_s(-it.places_m.0.z, 1.0)
                });
                (most - least) * ages_s.fold(0.0, f64::max)
            }
            false => 0.0,
        };
        let left_s = passing[longest].iter().filter_map(|it| it.left_s);
        let left_s = left_s.fold((f64::INFINITY, f64::NEG_INFINITY), |all, it| {
            (all.0.min(it.0), all.1.max(it.1))
        });
        let spread_s = ages_s.max(high_s - low_s).max(until_s - from_s);
        let mut halves = [part.clone(), part];
        if left_s.1 - left_s.0 > LONG_LEAVING * spread_s {
            let middle_s = 0.5 * (left_s.0 + left_s.1);
            halves[0].emitters[longest].left_s.1 = middle_s;
            halves[1].emitters[longest].left_s.0 = middle_s;
        } else if ages_s > (high_s - low_s).max(until_s - from_s) {
            let middle = 0.5 * (least + most);
            halves[0].lags.1 = middle;
            halves[1].lags.0 = middle;
        } else if high_s - low_s > until_s - from_s {
            let middle_s = 0.5 * (low_s + high_s);
            halves[0].shifts_s[clock].1 = middle_s;
            halves[1].shifts_s[clock].0 = middle_s;
        } else {
            let middle_s = 0.5 * (from_s + until_s);
            halves[0].span_s.1 = middle_s;
            halves[1].span_s.0 = middle_s;
        }
        // The last is looked at first: the earlier, or the one with the lesser shift.
        halves.swap(0, 1);
        Some(halves)
    }
}

/// An upper bound anywhere on the receiver's discs of all that passes (m/s).
fn rough_of_mps(passing: &[Passing<'_>]) -> f64 {
    let high_mps = passing.iter().map(|it| it.high_mps);
    high_mps.fold(0.0, f64::max)
}

impl Passing<'_> {
    /// The place of a point beside the receiver's centre (m, x and y) that is nearest to the axis,
    /// as seen from there (m).
    fn nearest_m(&self, beside_m: [f64; 2]) -> Vector2<f64> {
        self.region.nearest_m(beside_m)
    }

    /// Raises what is known of some points of the discs to the highest of this wake there (m/s).
    fn raise(&self, points_m: &[[f64; 2]], highest: &mut [f64; CHUNK]) {
        let (low_m, high_m) = self.places_m;
        if low_m.z >= 0.0 {
            return;
        }
        let mut passage = self.wake.passage((-high_m.z, -low_m.z));
        let middle_m = 0.5 * (low_m + high_m);
        let half_path_m = 0.5 * (high_m - low_m).norm();
        for (so_far, &[x, y]) in highest.iter_mut().zip(points_m) {
            let point_m = Vector3::new(x, y, 0.0);
            let nearest_m = self.nearest_m([x, y]);
            let high_mps = match passage.far_alone() {
                Some(far) => far.highest_mps(nearest_m),
                None => passage.highest_along_mps(
                    nearest_m,
                    &(low_m + point_m, high_m + point_m),
                    &(middle_m + point_m),
                    half_path_m,
                ),
            };
            *so_far = so_far.max(high_mps);
        }
    }
}
