//! Bodies and columns of two drones at moments of their own: each early or late by the time margin,
//! and off its path by the tracking margin while it flies.
//!
//! Both margins of time together are a shift of one clock against the other of at most twice the
//! margin. Over all moments of both and all shifts the nearest approach is a closed form
//! ([`Shifted`]); no sample decides.

use super::column::SHORTEST_PATH_M;
use super::obstacle::TOUCH_M;
use crate::plan::ViolationKind;
use crate::plan::trajectory::{Approach, SAME_PLACE_M, Shifted};
use crate::verify::extents::{Places, Span};
use crate::verify::scene::{Flight, Part, Scene, level_gap_m};
use crate::verify::time::encounters::Encounter;
use crate::verify::time::spans::join;
use crate::verify::violation::{IndexedViolation, Worst};

/// Resolution of a moment (s): chosen here.
const MOMENT_S: f64 = 1e-3;
/// Two parts whose offset is this near to that of their chords count as straight (m): chosen here,
/// a tenth of what bodies may touch by.
const STRAIGHT_M: f64 = 0.1 * TOUCH_M;

/// The violations of two drones over a range of shifts.
#[derive(Default)]
struct PairViolations {
    /// On the clock of the one (s).
    spans_s: Vec<Span>,
    /// The nearest of all, and what the gap or the distance from the axis must be (m).
    nearest: Option<(Approach, f64)>,
}

/// Bodies of one flight and those after it, and both in one another's columns, at any shift of the
/// clocks within the margins.
pub(crate) fn check(scene: &Scene<'_>, near: &[Encounter], k: usize) -> Vec<IndexedViolation> {
    let margin_s = 2.0 * scene.margins.time_s;
    if margin_s <= 0.0 && scene.margins.tracking_m <= 0.0 {
        return Vec::new();
    }
    let one = &scene.flights[k];
    let mut found = Vec::new();
    // By drone and then by time: see `encounters`.
    let after = near.partition_point(|encounter| encounter.other <= k);
    let before = near.partition_point(|encounter| encounter.other < k);
    for same in ([&near[after..], &near[..before]].into_iter())
        .flat_map(|near| near.chunk_by(|a, b| a.other == b.other))
    {
        let other = &scene.flights[same[0].other];
        let pair = Pair {
            scene,
            one,
            other,
            shift_s: (-margin_s, margin_s),
            tracking_m: scene.margins.tracking_m,
        };
        if same[0].other > k {
            let bodies = pair.meeting(same, &Pair::bodies);
            let sum_m = one.body_radius_m + other.body_radius_m;
            found.extend(pair.violations_of(
                bodies,
                ViolationKind::CollisionMargin,
                (sum_m, TOUCH_M),
            ));
        }
        if margin_s > 0.0 {
            let below = pair.meeting(same, &Pair::column);
            found.extend(pair.violations_of(
                below,
                ViolationKind::ColumnMargin,
                (0.0, SAME_PLACE_M),
            ));
        }
    }
    found
}

/// Two flights whose clocks may differ.
pub(super) struct Pair<'a> {
    /// All flights and the place.
    pub(super) scene: &'a Scene<'a>,
    /// Times are on its clock.
    pub(super) one: &'a Flight,
    pub(super) other: &'a Flight,
    /// By how much the other's clock may be ahead, at least and at most (s).
    pub(super) shift_s: Span,
    /// How far each may be off its path while it flies (m).
    pub(super) tracking_m: f64,
}

/// A rule for a part of each flight: the moments that may break it, and what the distance must be
/// (m).
type Rule<'r, 'a> = &'r dyn Fn(&Pair<'a>, &Part, &Part) -> Option<Broken>;

/// Moments of both among which a rule is broken.
pub(super) struct Broken {
    moments: Shifted,
    /// Distance of the centres, or from the axis, that is too small (m).
    least_m: f64,
    /// From the axis, not from the centre.
    is_level: bool,
}

impl Broken {
    /// Where the two are nearest.
    pub(super) fn nearest(&self) -> Approach {
        nearest(&self.moments, self.is_level)
    }

    /// The first and the last moment of the one at which the rule is broken at some shift:
    /// distances of straight paths are convex, so that between the nearest and each of them it is
    /// broken throughout.
    fn span_s(&self) -> Span {
        let [(from_s, until_s), _] = self.moments.spans_s();
        let at_s = self.nearest().t_s.clamp(from_s, until_s);
        let is_broken = |from_s: f64, until_s: f64| {
            let part = self.moments.during(from_s, until_s);
            part.is_some_and(|it| nearest(&it, self.is_level).distance_m < self.least_m)
        };
        let bisect = |mut out_s: f64, is_broken: &dyn Fn(f64) -> bool| {
            if is_broken(out_s) {
                return out_s;
            }
            let mut in_s = at_s;
            while (in_s - out_s).abs() > MOMENT_S {
                let middle_s = 0.5 * (in_s + out_s);
                match is_broken(middle_s) {
                    true => in_s = middle_s,
                    false => out_s = middle_s,
                }
            }
            in_s
        };
        (
            bisect(from_s, &|t_s| is_broken(from_s, t_s)),
            bisect(until_s, &|t_s| is_broken(t_s, until_s)),
        )
    }

    /// The least shift, either way, at which the rule is broken, to a resolution (s); at most
    /// `highest_s`.
    pub(super) fn least_shift_s(&self, highest_s: f64, fine_s: f64) -> f64 {
        let is_broken = |shift_s: f64| {
            let part = self.moments.with_shift((-shift_s, shift_s));
            part.is_some_and(|it| nearest(&it, self.is_level).distance_m < self.least_m)
        };
        let (mut low_s, mut high_s) = (0.0, highest_s);
        if is_broken(low_s) {
            return low_s;
        }
        while high_s - low_s > fine_s {
            let middle_s = 0.5 * (low_s + high_s);
            match is_broken(middle_s) {
                true => high_s = middle_s,
                false => low_s = middle_s,
            }
        }
        low_s
    }
}

fn nearest(moments: &Shifted, is_level: bool) -> Approach {
    match is_level {
        true => moments.nearest_to_axis(),
        false => moments.nearest(),
    }
}

impl<'a> Pair<'a> {
    /// All that breaks a rule while the two are near one another.
    pub(super) fn broken(
        &self,
        near: &[Encounter],
        rule: Rule<'_, 'a>,
        report: &mut dyn FnMut(Broken),
    ) {
        for &Encounter { span_s, .. } in near {
            let theirs_s = (span_s.0 + self.shift_s.0, span_s.1 + self.shift_s.1);
            let theirs: Vec<Part> = self.other.parts(theirs_s).collect();
            for mine in self.one.parts(span_s) {
                let (from_s, until_s) = (mine.motion.from_s, mine.motion.until_s);
                let meet = |part: &&Part| {
                    part.motion.until_s >= from_s + self.shift_s.0
                        && part.motion.from_s <= until_s + self.shift_s.1
                };
                for part in theirs.iter().filter(meet) {
                    self.broken_parts(&mine, part, rule, report);
                }
            }
        }
    }

    /// All that breaks a rule during a part of each flight: where either is not straight, by halves
    /// of it until it is as good as its chord.
    fn broken_parts(
        &self,
        mine: &Part,
        theirs: &Part,
        rule: Rule<'_, 'a>,
        report: &mut dyn FnMut(Broken),
    ) {
        let Some(broken) = rule(self, mine, theirs) else {
            return;
        };
        if broken.moments.off_m() <= STRAIGHT_M {
            return report(broken);
        }
        let off_m = |it: &Part| it.motion.off_chord_m(it.motion.from_s, it.motion.until_s);
        let halves = |it: &Part| it.motion.halves().map(|motion| Part { motion, ..*it });
        if off_m(mine) >= off_m(theirs) {
            for half in halves(mine) {
                self.broken_parts(&half, theirs, rule, report);
            }
        } else {
            for half in halves(theirs) {
                self.broken_parts(mine, &half, rule, report);
            }
        }
    }

    fn meeting(&self, near: &[Encounter], rule: Rule<'_, 'a>) -> PairViolations {
        let mut meeting = PairViolations::default();
        self.broken(near, rule, &mut |broken| {
            let nearest = broken.nearest();
            meeting.spans_s.push(broken.span_s());
            let lacks_m = |(it, least_m): &(Approach, f64)| least_m - it.distance_m;
            let here = (nearest, broken.least_m);
            if meeting
                .nearest
                .is_none_or(|known| lacks_m(&here) > lacks_m(&known))
            {
                meeting.nearest = Some(here);
            }
        });
        meeting
    }

    /// Two bodies, each with what it may be off its path while it flies.
    pub(super) fn bodies(&self, mine: &Part, theirs: &Part) -> Option<Broken> {
        let flying = [mine.flies, theirs.flies]
            .into_iter()
            .filter(|flies| *flies);
        let off_m = self.tracking_m * flying.count() as f64;
        let least_m = self.one.body_radius_m + self.other.body_radius_m + off_m - TOUCH_M;
        let boxes_m = boxes_m(mine, theirs);
        let apart_m = (boxes_m[0].0 - boxes_m[1].1).sup(&(boxes_m[1].0 - boxes_m[0].1));
        if apart_m.max() >= least_m {
            return None;
        }
        let broken = Broken {
            moments: Shifted::new(&mine.motion, &theirs.motion, self.shift_s)?,
            least_m,
            is_level: false,
        };
        (broken.nearest().distance_m < least_m).then_some(broken)
    }

    /// The one in the column of the other, as far down as its wake reaches.
    pub(super) fn column(&self, mine: &Part, theirs: &Part) -> Option<Broken> {
        let wake = &self.other.wakes[theirs.piece].wake;
        // On the rim is outside: a micrometre less on every side.
        let least_m = wake.column_radius_m() - SAME_PLACE_M;
        let heights_m = (SAME_PLACE_M - wake.near_field_depth_m(), -SAME_PLACE_M);
        let [here_m, there_m] = boxes_m(mine, theirs);
        if !(mine.flies && theirs.flies)
            || level_gap_m(&here_m, &there_m) >= least_m
            || here_m.0.z - there_m.1.z >= heights_m.1
            || here_m.1.z - there_m.0.z <= heights_m.0
        {
            return None;
        }
        let moments = Shifted::new(&mine.motion, &theirs.motion, self.shift_s)?;
        let inside = Broken {
            moments: moments.between_heights(heights_m.0, heights_m.1)?,
            least_m,
            is_level: true,
        };
        if inside.nearest().distance_m >= least_m {
            return None;
        }
        let stops = !self.other.stops[theirs.piece].is_empty();
        (!stops || self.is_reached(mine, theirs, &inside)).then_some(inside)
    }

    /// Whether the wake reaches down at some of the moments in the column: by halves of either
    /// time, since where a wake ends depends on its drone.
    fn is_reached(&self, mine: &Part, theirs: &Part, inside: &Broken) -> bool {
        let [(from_s, until_s), (leaves_s, left_s)] = inside.moments.spans_s();
        let (low_m, high_m) = mine.motion.box_m(from_s, until_s);
        let emitter = self.other.attached(0, theirs.piece, theirs.motion);
        let heights_m = (low_m.z, high_m.z);
        let (surely, maybe) = emitter.reaches(&self.scene.obstacles, heights_m, (leaves_s, left_s));
        let other_m = 2.0 * theirs.motion.half_path_m(leaves_s, left_s);
        let mine_m = 2.0 * mine.motion.half_path_m(from_s, until_s);
        if surely || !maybe || other_m.max(mine_m) <= SHORTEST_PATH_M {
            return maybe;
        }
        let halves = match other_m >= mine_m {
            true => {
                let middle_s = 0.5 * (leaves_s + left_s);
                let half = |from_s, until_s| inside.moments.other_during(from_s, until_s);
                [half(leaves_s, middle_s), half(middle_s, left_s)]
            }
            false => {
                let middle_s = 0.5 * (from_s + until_s);
                let half = |from_s, until_s| inside.moments.during(from_s, until_s);
                [half(from_s, middle_s), half(middle_s, until_s)]
            }
        };
        let mut halves = halves.into_iter().flatten();
        halves.any(|moments| {
            let half = Broken { moments, ..*inside };
            half.nearest().distance_m < half.least_m && self.is_reached(mine, theirs, &half)
        })
    }

    /// A meeting as violations; values are less both bodies, for gaps, and limits without what is
    /// allowed for rounding (m).
    fn violations_of(
        &self,
        meeting: PairViolations,
        kind: ViolationKind,
        (bodies_m, rounding_m): (f64, f64),
    ) -> Vec<IndexedViolation> {
        let Some((nearest, least_m)) = meeting.nearest else {
            return Vec::new();
        };
        let mut spans_s = meeting.spans_s;
        spans_s.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut parts_s = Vec::new();
        spans_s
            .into_iter()
            .for_each(|span_s| join(&mut parts_s, span_s));
        let found = parts_s.into_iter().map(|span_s| {
            let worst = Worst {
                with: Some(self.other.name.clone()),
                position_m: self.one.position_m(nearest.t_s),
                value: nearest.distance_m - bodies_m,
                limit: least_m + rounding_m - bodies_m,
            };
            let (index, mut violation) = self.scene.violation(self.one, kind, span_s, worst);
            violation.shift_s = Some(nearest.other_s - nearest.t_s);
            (index, violation)
        });
        found.collect()
    }
}

/// The boxes of both motions (m).
fn boxes_m(mine: &Part, theirs: &Part) -> [Places; 2] {
    [mine, theirs].map(|it| it.motion.box_m(it.motion.from_s, it.motion.until_s))
}
