//! Advected wakes: which air of a flight is at a height at a time, and from where it left its
//! drone.
//!
//! Air at height `z` at `t` left a drone at every `t'` with
//!
//! ```text
//! g(t') = t' + m τ(z_drone(t') - z) = t,      lag m = 1/k of a range, 0: at once
//! ```
//!
//! In level flight there is one such `t'` for each lag. A drone that sinks faster than its air has
//! several: all of them count, the strongest at each moment. They are found by subdivision: `τ`
//! grows with depth, so over a span of `t'`, of `t`, of lags and of heights `g` has bounds, and
//! spans whose bounds miss `t` are dropped, and Newton's step on intervals closes in on the rest.
//! Air older than the flight came from where it began.
//! Where a drone becomes lighter its air becomes slower, and what arrives in between left at that
//! moment.
//!
//! `τ(s) = l (σ² - s0²)/(2 B U_H)` with `σ = s/l - s0`: at the centreline speed, integrated from
//! the rotor plane down ([`airflow::FarField::transport_time_s`]).

use std::sync::Arc;

use airflow::Source;
use nalgebra::Point3;

use crate::plan::trajectory::{Motion, Piece};
use crate::verify::bounds::obstacles::Obstacles;
use crate::verify::bounds::wake::BoundedWake;
use crate::verify::extents::{Places, Span};
use crate::verify::scene::{Attached, Flight, Scene, level_gap_m, reaches};

/// Spans of leaving no longer than this, and those whose air arrives within as much, are not
/// divided (s), chosen here: 0.2 mm of path at 2 m/s.
const SHORTEST_S: f64 = 1e-4;
/// Nor those shorter than this part of the span of arrival, or of what the range of heights makes
/// of it; chosen here.
const FINE: f64 = 0.25;
/// A span that is cut to less than this part of itself is cut again before it is halved; chosen
/// here.
const SHRUNK: f64 = 0.7;

/// Air that is over earlier than this before it is asked for does not count (s), and what left this
/// long beside what may arrive does, chosen here: far above rounding.
const ROUNDING_S: f64 = 1e-6;

/// Air that left along a path is bounded in boxes of so much of it (m), chosen here: the half-width
/// of a wake some metres down. What arrives at one moment below a drone that sinks as fast as its
/// air left along metres of its path.
const PATH_M: f64 = 0.25;
/// In no more boxes than this, chosen here.
const MOST_BOXES: f64 = 16.0;

/// A drone that climbs or sinks has its air bounded in steps of so much height (m), chosen here,
/// and in no more steps than this.
const CLIMB_M: f64 = 0.1;
const MOST_CLIMB_STEPS: f64 = 32.0;
/// The same for the air of drones over their discs, chosen here.
pub(crate) const COARSE_M: f64 = 0.25;

/// The advected wake of one flight.
#[derive(Clone, Copy)]
pub(crate) struct Advected<'a> {
    /// Index in the scene's flights.
    pub(crate) from: usize,
    /// The emitter.
    flight: &'a Flight,
    /// Lags: least and greatest delay over that at the centreline's speed.
    lags: Span,
    /// To the floor, over all wakes of the scene (s).
    longest_lag_s: f64,
}

/// Air of one flight that may be at some heights in a span of time.
#[derive(Clone, Copy)]
pub(crate) struct Emission {
    /// The piece in which it left.
    pub(crate) piece: usize,
    /// When (s).
    pub(crate) span_s: Span,
    /// It left in a single moment, whenever it arrives: before the flight began, or where the drone
    /// became lighter.
    pub(crate) is_moment: bool,
}

/// Air that left during one piece of a flight.
pub(crate) struct Left<'a> {
    /// The wake at that piece's mass.
    pub(crate) wake: &'a BoundedWake,
    /// Solids on whose top it may end.
    stops: &'a [u32],
    /// Where its drone was then (m).
    pub(crate) from_m: Places,
}

impl Left<'_> {
    /// Whether it may reach up to the highest of some places (m).
    pub(crate) fn may_reach(&self, obstacles: &Obstacles, places_m: &Places) -> bool {
        let heights_m = (places_m.0.z, places_m.1.z);
        reaches(self.wake, self.stops, &self.from_m, obstacles, heights_m).1
    }

    /// Places as seen from where it left (m).
    pub(crate) fn offsets_m(&self, places_m: &Places) -> Places {
        (places_m.0 - self.from_m.1, places_m.1 - self.from_m.0)
    }

    /// An upper bound over a box of offsets (m/s).
    pub(crate) fn highest_mps(&self, offsets_m: &Places) -> f64 {
        let here_m = (Default::default(), Default::default());
        let off_axis_m = level_gap_m(offsets_m, &here_m);
        let middle_m = 0.5 * (offsets_m.0 + offsets_m.1);
        let half_m = 0.5 * (offsets_m.1 - offsets_m.0).norm();
        (self.wake).highest_along_mps(offsets_m, off_axis_m, &middle_m, half_m)
    }
}

/// When (s) and at which heights (m) air arrives, and how finely it is asked when it left (s).
#[derive(Clone, Copy)]
struct Arrival {
    /// From, until (s).
    span_s: Span,
    /// Lowest, highest (m).
    heights_m: (f64, f64),
    /// Spans of leaving that are no longer are not divided (s).
    shortest_s: f64,
}

/// What is left of a span of leaving after a step of Newton's on intervals.
struct NewtonStep {
    /// Before and after its middle; empty where it ends before it begins (s).
    halves_s: [Span; 2],
    /// The moments at which one height's air of one lag arrives are at most so far apart (s).
    spread_s: f64,
}

impl<'a> Advected<'a> {
    /// At a range of lags; `None` where wakes are quasi-static.
    pub(crate) fn new(scene: &'a Scene<'_>, from: usize, lags: Span) -> Option<Advected<'a>> {
        scene.flown.convection.map(|_| Advected {
            from,
            flight: &scene.flights[from],
            lags,
            longest_lag_s: scene.longest_lag_s,
        })
    }

    /// While its air is anywhere (s).
    pub(crate) fn lasts_s(&self) -> Span {
        let (from_s, until_s) = self.flight.airborne_s;
        (from_s, until_s + self.longest_lag_s)
    }

    /// Highest speed of the drone (m/s).
    pub(crate) fn max_speed_mps(&self) -> f64 {
        let pieces = self.flight.trajectory.pieces().iter();
        let speeds_mps = pieces.map(|piece| piece.motion.max_speed_mps());
        speeds_mps.fold(0.0, f64::max)
    }

    /// All of its air that may be at the heights of some places (m) within a span of time.
    pub(crate) fn left(&self, span_s: Span, places_m: &Places) -> Vec<Left<'a>> {
        let pieces = self.flight.trajectory.pieces();
        let spans = self.emitted(span_s, (places_m.0.z, places_m.1.z));
        let left = spans.into_iter().flat_map(|it| {
            let (k, (from_s, until_s)) = (it.piece, it.span_s);
            let motion = &pieces[k].motion;
            let path_m = 2.0 * motion.half_path_m(from_s, until_s);
            let boxes = (path_m / PATH_M).ceil().clamp(1.0, MOST_BOXES) as u32;
            let step_s = (until_s - from_s) / f64::from(boxes);
            (0..boxes).map(move |n| {
                let begin_s = from_s + f64::from(n) * step_s;
                let end_s = if n + 1 == boxes {
                    until_s
                } else {
                    begin_s + step_s
                };
                Left {
                    wake: &self.flight.wakes[k],
                    stops: &self.flight.stops[k],
                    from_m: motion.box_m(begin_s, end_s),
                }
            })
        });
        left.collect()
    }

    /// Every wake of it that may be at a height (m) at a time (s), from both ends of the shortest
    /// spans.
    pub(crate) fn sources(&self, obstacles: &Obstacles, t_s: f64, z_m: f64) -> Vec<Source<'a>> {
        let mut sources = Vec::new();
        for it in self.emitted((t_s, t_s), (z_m, z_m)) {
            let attached = self.attached(&it, it.span_s);
            sources.push(attached.source(obstacles, it.span_s.0));
            if it.span_s.1 > it.span_s.0 {
                let steps = self.steps(&it, CLIMB_M);
                sources.extend(steps.map(|(_, until_s)| attached.source(obstacles, until_s)));
            }
        }
        sources
    }

    /// Its wakes at those moments of leaving at which the air that is at a place (m) in a span of
    /// time may be the highest.
    pub(crate) fn sources_near(
        &self,
        obstacles: &Obstacles,
        span_s: Span,
        place_m: Point3<f64>,
    ) -> Vec<Source<'a>> {
        let mut sources = Vec::new();
        for attached in self.wakes(span_s, (place_m.z, place_m.z)) {
            let motion = attached.motion;
            let span_s = (motion.from_s, motion.until_s);
            let there = Motion::straight(span_s, place_m, place_m);
            let nearest_s = (there.seen_from(&motion)).map(|it| it.nearest_to_axis_s(span_s));
            let moments = [Some(span_s.0), nearest_s, Some(span_s.1)];
            let moments = moments.into_iter().flatten();
            sources.extend(moments.map(|t_s| attached.source(obstacles, t_s)));
        }
        sources
    }

    /// Its wakes while air leaves that may be at heights (m) within a span of time, each at about
    /// one height.
    pub(crate) fn wakes(&self, span_s: Span, heights_m: (f64, f64)) -> Vec<Attached<'a>> {
        let mut wakes = Vec::new();
        for it in self.emitted(span_s, heights_m) {
            wakes.extend(
                self.steps(&it, CLIMB_M)
                    .map(|step_s| self.attached(&it, step_s)),
            );
        }
        wakes
    }

    /// An emission in steps of no more than so much height (m), as far as there are not too many;
    /// what is curved, of so much path.
    pub(crate) fn steps(&self, it: &Emission, most_m: f64) -> impl Iterator<Item = Span> + use<> {
        let (from_s, until_s) = it.span_s;
        let motion = &self.flight.trajectory.pieces()[it.piece].motion;
        let (low_m, high_m) = motion.box_m(from_s, until_s);
        let extent_m = match motion.is_straight() {
            true => high_m.z - low_m.z,
            false => (high_m - low_m).max(),
        };
        let steps = (extent_m / most_m).ceil().clamp(1.0, MOST_CLIMB_STEPS) as u32;
        let step_s = (until_s - from_s) / f64::from(steps);
        (0..steps).map(move |n| {
            let begin_s = from_s + f64::from(n) * step_s;
            let is_last = n + 1 == steps;
            (begin_s, if is_last { until_s } else { begin_s + step_s })
        })
    }

    /// The wake of an emission during a part of its span.
    pub(crate) fn attached(&self, it: &Emission, (from_s, until_s): Span) -> Attached<'a> {
        let motion = &self.flight.trajectory.pieces()[it.piece].motion;
        let motion = motion.during(from_s, until_s);
        self.flight.attached(self.from, it.piece, motion)
    }

    /// By how much the air of an emission left before it is at heights (m), at least and at most
    /// (s).
    pub(crate) fn ages_s(&self, it: &Emission, heights_m: (f64, f64)) -> Span {
        let piece = &self.flight.trajectory.pieces()[it.piece];
        let (low_m, high_m) = depths_m(piece, it.span_s, heights_m);
        (
            self.lags.0 * self.lag_s(it.piece, low_m),
            self.lags.1 * self.lag_s(it.piece, high_m),
        )
    }

    /// Pieces, and the spans of them in which air left that may be at heights within a span of
    /// time.
    pub(crate) fn emitted(&self, span_s: Span, heights_m: (f64, f64)) -> Vec<Emission> {
        let (begins_s, ends_s) = self.flight.airborne_s;
        let moment = |piece: usize, at_s: Span| Emission {
            piece,
            span_s: at_s,
            is_moment: true,
        };
        let mut found = Vec::new();
        let deepest_m = self.flight.top_m - heights_m.0;
        if begins_s >= ends_s || span_s.1 < begins_s || deepest_m <= 0.0 {
            return found;
        }
        let pieces = self.flight.trajectory.pieces();
        let slowest_s = self.lags.1 * self.flight.slowest.transport_time_s(deepest_m, 1.0);
        let since_s = span_s.0 - self.longest_lag_s.min(slowest_s + ROUNDING_S);
        let first = pieces.partition_point(|piece| piece.motion.until_s < since_s.max(begins_s));
        let mut before: Option<(usize, &Piece)> = None;
        for (k, piece) in pieces.iter().enumerate().skip(first) {
            let from_s = piece.motion.from_s.max(begins_s);
            let until_s = piece.motion.until_s.min(ends_s).min(span_s.1);
            if from_s > until_s {
                break;
            }
            // What is over before the span, wherever in the piece it left.
            let most_m = self.flight.heights_m[k].1 - heights_m.0;
            let over_s = until_s + self.lags.1 * self.lag_s(k, most_m);
            if most_m <= 0.0 || over_s < span_s.0 - ROUNDING_S {
                before = Some((k, piece));
                continue;
            }
            let at_s = (from_s, from_s);
            if piece.motion.from_s <= begins_s {
                let (_, high_m) = depths_m(piece, at_s, heights_m);
                // It is at its beginning: air older than that came from there.
                if high_m > 0.0 && span_s.0 - self.lags.1 * self.lag_s(k, high_m) <= begins_s {
                    found.push(moment(k, at_s));
                }
            } else if let Some((earlier, last)) = before
                && !Arc::ptr_eq(&self.flight.wakes[earlier], &self.flight.wakes[k])
            {
                // Between the last air of one piece and the first of the next.
                let (low_m, _) = depths_m(last, at_s, heights_m);
                let (_, high_m) = depths_m(piece, at_s, heights_m);
                let first_s = from_s + self.lags.0 * self.lag_s(earlier, low_m);
                let last_s = from_s + self.lags.1 * self.lag_s(k, high_m);
                if high_m > 0.0 && first_s <= span_s.1 && span_s.0 <= last_s {
                    found.extend([moment(earlier, at_s), moment(k, at_s)]);
                }
            }
            let leaves = (from_s, until_s);
            let whole = (piece.motion.from_s, piece.motion.until_s);
            let (low_m, high_m) = match leaves == whole {
                true => below_m(self.flight.heights_m[k], heights_m),
                false => depths_m(piece, leaves, heights_m),
            };
            let extent_m = heights_m.1 - heights_m.0;
            let deep_s = self.lag_s(k, high_m);
            let of_heights_s = deep_s - self.lag_s(k, (high_m - extent_m).max(low_m));
            let spread_s = (self.lags.1 * of_heights_s).max((self.lags.1 - self.lags.0) * deep_s);
            let arrival = Arrival {
                span_s,
                heights_m,
                shortest_s: (FINE * (span_s.1 - span_s.0).max(spread_s)).max(SHORTEST_S),
            };
            self.divide(k, (leaves, (low_m, high_m)), arrival, &mut found);
            before = Some((k, piece));
        }
        found
    }

    /// Appends the parts of a span of leaving, within one piece, that may arrive in time; the
    /// depths of what it arrives at are known (m).
    fn divide(
        &self,
        k: usize,
        ((from_s, until_s), (low_m, high_m)): (Span, (f64, f64)),
        arrival: Arrival,
        found: &mut Vec<Emission>,
    ) {
        let piece = &self.flight.trajectory.pieces()[k];
        if high_m <= 0.0 {
            return;
        }
        let cut_s = (
            from_s.max(arrival.span_s.0 - self.lags.1 * self.lag_s(k, high_m)),
            until_s.min(arrival.span_s.1 - self.lags.0 * self.lag_s(k, low_m)),
        );
        if cut_s.0 > cut_s.1 {
            return;
        }
        let mut arrives = |span_s: Span| match found.last_mut() {
            Some(last) if last.piece == k && !last.is_moment && last.span_s.1 >= span_s.0 => {
                last.span_s.1 = span_s.1.max(last.span_s.1);
            }
            _ => found.push(Emission {
                piece: k,
                span_s,
                is_moment: false,
            }),
        };
        let is_shrunk = |it: Span| it.1 - it.0 < SHRUNK * (until_s - from_s);
        let with_depths = |it: Span| (it, depths_m(piece, it, arrival.heights_m));
        if piece.motion.is_level() {
            return arrives(cut_s);
        }
        if cut_s.1 - cut_s.0 <= arrival.shortest_s {
            // The depths of the whole span may be far from those of what is left.
            return match until_s - from_s > arrival.shortest_s && is_shrunk(cut_s) {
                true => self.divide(k, with_depths(cut_s), arrival, found),
                false => arrives(cut_s),
            };
        }
        let step = self.newton_step(k, cut_s, (low_m, high_m), arrival);
        let [before_s, after_s] = step.halves_s;
        let both_s = (before_s.0, after_s.1);
        let is_one = before_s.1 == after_s.0;
        if is_one && step.spread_s <= arrival.shortest_s {
            return arrives(both_s);
        }
        let rest = match is_one && is_shrunk(both_s) {
            true => &[both_s][..],
            false => &step.halves_s,
        };
        for &span_s in rest.iter().filter(|it| it.0 <= it.1) {
            self.divide(k, with_depths(span_s), arrival, found);
        }
    }

    /// A span of leaving on either side of its middle without what cannot arrive in time, by the
    /// slope of `g` over the span. The depths of what it arrives at are known (m).
    ///
    /// ```text
    /// g' = 1 + m τ'(depth) climb
    /// ```
    fn newton_step(
        &self,
        k: usize,
        (from_s, until_s): Span,
        (low_m, high_m): (f64, f64),
        arrival: Arrival,
    ) -> NewtonStep {
        let motion = &self.flight.trajectory.pieces()[k].motion;
        let far = self.flight.wakes[k].wake.far_field();
        let climb_mps = motion.climb_within_mps(from_s, until_s);
        let [least, most] = [low_m, high_m].map(|depth_m| far.transport_time_s_per_m(depth_m));
        let slowest = (climb_mps.0 * least).min(climb_mps.0 * most);
        let fastest = (climb_mps.1 * least).max(climb_mps.1 * most);
        let slopes = |lag: f64| (1.0 + lag * slowest, 1.0 + lag * fastest);
        let (soonest, latest) = (slopes(self.lags.0), slopes(self.lags.1));
        let middle_s = 0.5 * (from_s + until_s);
        let height_m = motion.heights_m(middle_s, middle_s).0;
        let arrives_s = |lag: f64, at_m: f64| middle_s + lag * self.lag_s(k, height_m - at_m);
        // By how much what leaves in the middle arrives too late, or too early.
        let late_s = arrives_s(self.lags.0, arrival.heights_m.1) - arrival.span_s.1;
        let early_s = arrival.span_s.0 - arrives_s(self.lags.1, arrival.heights_m.0);
        // It takes at least so long until `g` has changed by as much.
        let takes_s = |change_s: f64, slope: f64| match slope > 0.0 {
            true => change_s / slope,
            false => f64::INFINITY,
        };
        let (before_s, after_s) = match (late_s > 0.0, early_s > 0.0) {
            (true, _) => (takes_s(late_s, soonest.1), takes_s(late_s, -soonest.0)),
            (_, true) => (takes_s(early_s, -latest.0), takes_s(early_s, latest.1)),
            _ => (0.0, 0.0),
        };
        // Where `g` rises all along, no longer than so.
        let until = |left_s: f64, slope: f64| takes_s(left_s.max(0.0), slope);
        let ends_s = (
            middle_s - until(-early_s, latest.0) - ROUNDING_S,
            middle_s + until(-late_s, soonest.0) + ROUNDING_S,
        );
        let steepest = [soonest.0, soonest.1, latest.0, latest.1].map(f64::abs);
        NewtonStep {
            halves_s: [
                (
                    from_s.max(ends_s.0),
                    middle_s.min(middle_s - before_s + ROUNDING_S),
                ),
                (
                    middle_s.max(middle_s + after_s - ROUNDING_S),
                    until_s.min(ends_s.1),
                ),
            ],
            spread_s: steepest.into_iter().fold(0.0, f64::max) * (until_s - from_s),
        }
    }

    /// How long the air of a piece takes down to a depth at the centreline's speed (s).
    pub(crate) fn lag_s(&self, k: usize, depth_m: f64) -> f64 {
        let far = self.flight.wakes[k].wake.far_field();
        far.transport_time_s(depth_m, 1.0)
    }
}

/// Depths of heights (m) below the drone during a span of one piece.
fn depths_m(piece: &Piece, span_s: Span, heights_m: (f64, f64)) -> (f64, f64) {
    below_m(piece.motion.heights_m(span_s.0, span_s.1), heights_m)
}

/// Least and greatest depth of heights below a drone that is between two heights (m).
fn below_m(drone_m: (f64, f64), heights_m: (f64, f64)) -> (f64, f64) {
    (drone_m.0 - heights_m.1, drone_m.1 - heights_m.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::checks::contents;

    /// A Crazyflie that sinks by 12 m in so long (s), smoothly: faster than the air below it, as
    /// fast, or slower.
    fn sinks(within_s: f64) -> crate::plan::Plan {
        let text = format!(
            r#"{{"format": "plan/2", "scenario": "one", "bounds_m": {{"min": [0, 0, 0], "max": [9, 9, 20]}},
            "air_delay": {{"convection": [0.6, 1.0]}}, "drones": [{{"name": "a", "airframe": "crazyflie-2.1",
            "trajectory": {{"t_s": [0, {within_s}], "position_m": [[1, 4, 16], [7, 4, 4]],
            "control_m": [[[1, 4, 16], [7, 4, 4]]]}}}}]}}"#
        );
        crate::plan::file::read(&text).expect("a plan").plan
    }

    #[test]
    fn all_air_that_arrives_is_found_and_what_is_found_arrives() {
        for within_s in [6.0, 12.0, 30.0, 90.0] {
            let plan = sinks(within_s);
            let (scene, _) = contents::read(&plan);
            let scene = scene.expect("it can be judged");
            for lag in [0.0, 1.0, 1.0 / 0.6] {
                let air = Advected::new(&scene, 0, (lag, lag)).expect("advected");
                let motion = &air.flight.trajectory.pieces()[0].motion;
                let arrives_s = |left_s: f64, height_m: f64| {
                    let depth_m = motion.at_m(left_s).z - height_m;
                    (depth_m > 0.0).then(|| left_s + lag * air.lag_s(0, depth_m))
                };
                for (height_m, step) in (0..7).flat_map(|h| (0..200).map(move |k| (h, k))) {
                    let height_m = 0.5 + 2.0 * f64::from(height_m);
                    let left_s = within_s * (f64::from(step) + 0.37) / 200.0;
                    let Some(at_s) = arrives_s(left_s, height_m) else {
                        continue;
                    };
                    let found = air.emitted((at_s, at_s), (height_m, height_m));
                    let place = format!("{within_s} s, lag {lag}, {height_m} m, left {left_s} s");
                    let holds = |it: &Emission| {
                        it.span_s.0 <= left_s + 1e-9 && left_s <= it.span_s.1 + 1e-9
                    };
                    assert!(found.iter().any(holds), "{place}");
                    for it in found.iter().filter(|it| it.piece == 0 && !it.is_moment) {
                        for left_s in [it.span_s.0, it.span_s.1] {
                            let off_s = arrives_s(left_s, height_m).map_or(0.0, |it| it - at_s);
                            // Arrival falls by up to 14 s for each second of leaving.
                            assert!(off_s.abs() < 20.0 * SHORTEST_S, "{place}: {off_s} s off");
                        }
                    }
                }
            }
        }
    }
}
