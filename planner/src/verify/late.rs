//! Air that takes its time: whose air is at a height at a time, and from where it left its drone.
//!
//! Air at height `z` at `t` left a drone at every `t'` with
//!
//! ```text
//! g(t') = t' + τ(z_drone(t') - z) = t
//! ```
//!
//! In level flight there is one such `t'`. A drone that sinks faster than its air has several: all of them count, the strongest at each
//! moment. They are found by subdivision: `τ` grows with depth, so over a span of `t'`, of `t` and of heights `g` has bounds, and spans whose
//! bounds miss `t` are dropped. Air older than the flight came from where it began. Where a drone becomes lighter its air becomes slower,
//! and what arrives in between left at that moment.

use airflow::Source;
use nalgebra::{Point3, Vector3};

use super::flight::{Flight, Scene};
use super::wake_bound::BoundedWake;
use super::wake_end::Stops;
use crate::plan::trajectory::Piece;

/// Spans of leaving no longer than this are not divided (s), chosen here: 0.2 mm of way at 2 m/s.
const SHORTEST_S: f64 = 1e-4;
/// Nor those shorter than this part of the span of arrival, or of what the range of heights makes of it; chosen here.
const FINE: f64 = 0.25;
/// A span that is cut to less than this part of itself is cut again before it is halved; chosen here.
const SHRUNK: f64 = 0.7;

type Span = (f64, f64);
type Places = (Vector3<f64>, Vector3<f64>);

/// A flight whose air comes late.
#[derive(Clone, Copy)]
pub(crate) struct Late<'a> {
    /// Index in the scene's flights.
    pub(super) other: usize,
    flight: &'a Flight,
    convection: f64,
    lag_s: f64,
}

/// Air that left during one piece of a flight.
pub(crate) struct Left<'a> {
    pub(super) wake: &'a BoundedWake,
    pub(super) stops: &'a [u32],
    /// Where its drone was then (m).
    pub(super) places_m: Places,
}

impl Left<'_> {
    /// Places as seen from where it left (m).
    pub(super) fn offsets_m(&self, places_m: &Places) -> Places {
        (places_m.0 - self.places_m.1, places_m.1 - self.places_m.0)
    }

    /// An upper bound over a box of offsets (m/s).
    pub(super) fn highest_mps(&self, offsets_m: &Places) -> f64 {
        let gap = |axis: usize| offsets_m.0[axis].max(-offsets_m.1[axis]).max(0.0);
        let off_axis_m = gap(0).hypot(gap(1));
        let middle_m = 0.5 * (offsets_m.0 + offsets_m.1);
        let half_m = 0.5 * (offsets_m.1 - offsets_m.0).norm();
        let depths_m = (-offsets_m.1.z, -offsets_m.0.z);
        (self.wake).high_mps(depths_m, off_axis_m, offsets_m, &middle_m, half_m)
    }
}

impl<'a> Late<'a> {
    /// `None` where air takes no time.
    pub(super) fn new(scene: &'a Scene<'_>, other: usize) -> Option<Late<'a>> {
        Some(Late {
            other,
            flight: &scene.flights[other],
            convection: scene.convection?,
            lag_s: scene.longest_lag_s,
        })
    }

    /// While its air is anywhere (s); `None` where it never flies.
    pub(super) fn lasts_s(&self) -> Option<Span> {
        let (from_s, until_s) = self.flight.airborne_s;
        (from_s < until_s).then_some((from_s, until_s + self.lag_s))
    }

    /// Its highest speed (m/s).
    pub(super) fn fastest_mps(&self) -> f64 {
        let pieces = self.flight.trajectory.pieces().iter();
        let speeds_mps = pieces.map(|piece| piece.motion.max_speed_mps());
        speeds_mps.fold(0.0, f64::max)
    }

    /// All of its air that may be at heights (m) within a span of time (s).
    pub(super) fn left(&self, span_s: Span, heights_m: (f64, f64)) -> Vec<Left<'a>> {
        let pieces = self.flight.trajectory.pieces();
        self.spans(span_s, heights_m)
            .into_iter()
            .map(|(k, (from_s, until_s))| Left {
                wake: &self.flight.wakes[k],
                stops: &self.flight.stops[k],
                places_m: pieces[k].motion.box_m(from_s, until_s),
            })
            .collect()
    }

    /// Every wake of it that may be at a height (m) at a time (s), from both ends of the shortest spans.
    pub(super) fn sources(&self, stops: &Stops, t_s: f64, z_m: f64) -> Vec<Source<'a>> {
        let pieces = self.flight.trajectory.pieces();
        let mut sources = Vec::new();
        for (k, (from_s, until_s)) in self.spans((t_s, t_s), (z_m, z_m)) {
            let wake = &self.flight.wakes[k].wake;
            let ends_s = [from_s, until_s];
            let ends_s = if until_s > from_s {
                &ends_s[..]
            } else {
                &ends_s[..1]
            };
            for &left_s in ends_s {
                let position_m = Point3::from(pieces[k].motion.at_m(left_s));
                let ends_at_z_m = stops.end_z_m(wake, &position_m, &self.flight.stops[k]);
                sources.push(Source {
                    wake,
                    position_m,
                    ends_at_z_m,
                });
            }
        }
        sources
    }

    /// Pieces, and the spans of them in which air left that may be at heights within a span of time.
    fn spans(&self, span_s: Span, heights_m: (f64, f64)) -> Vec<(usize, Span)> {
        let (begins_s, ends_s) = self.flight.airborne_s;
        let mut found = Vec::new();
        if begins_s >= ends_s || span_s.1 < begins_s {
            return found;
        }
        let pieces = self.flight.trajectory.pieces();
        let since_s = span_s.0 - self.lag_s;
        let first = pieces.partition_point(|piece| piece.motion.until_s < since_s.max(begins_s));
        let mut before: Option<(usize, &Piece)> = None;
        for (k, piece) in pieces.iter().enumerate().skip(first) {
            let from_s = piece.motion.from_s.max(begins_s);
            let until_s = piece.motion.until_s.min(ends_s).min(span_s.1);
            if from_s > until_s {
                break;
            }
            if piece.motion.from_s <= begins_s {
                // It is at its beginning: air older than that came from there.
                let at_s = (begins_s, begins_s);
                let (_, high_m) = self.depths_m(piece, at_s, heights_m);
                if high_m > 0.0 && span_s.0 - self.lag(k, high_m) <= begins_s {
                    found.push((k, at_s));
                }
            } else if let Some((earlier, last)) = before {
                // Between the last air of one piece and the first of the next.
                let at_s = (from_s, from_s);
                let (low_m, _) = self.depths_m(last, at_s, heights_m);
                let (_, high_m) = self.depths_m(piece, at_s, heights_m);
                let arrives_s = (
                    from_s + self.lag(earlier, low_m),
                    from_s + self.lag(k, high_m),
                );
                if high_m > 0.0 && arrives_s.0 <= span_s.1 && span_s.0 <= arrives_s.1 {
                    found.extend([(earlier, at_s), (k, at_s)]);
                }
            }
            let spread_s = {
                let (low_m, high_m) = self.depths_m(piece, (from_s, until_s), heights_m);
                let extent_m = heights_m.1 - heights_m.0;
                self.lag(k, high_m) - self.lag(k, (high_m - extent_m).max(low_m))
            };
            let shortest_s = (FINE * (span_s.1 - span_s.0).max(spread_s)).max(SHORTEST_S);
            self.divide(
                k,
                (from_s, until_s),
                span_s,
                heights_m,
                shortest_s,
                &mut found,
            );
            before = Some((k, piece));
        }
        found
    }

    /// Appends the parts of a span of leaving, within one piece, that may arrive in time.
    fn divide(
        &self,
        k: usize,
        (from_s, until_s): Span,
        span_s: Span,
        heights_m: (f64, f64),
        shortest_s: f64,
        found: &mut Vec<(usize, Span)>,
    ) {
        let piece = &self.flight.trajectory.pieces()[k];
        let (low_m, high_m) = self.depths_m(piece, (from_s, until_s), heights_m);
        if high_m <= 0.0 {
            return;
        }
        let cut_s = (
            from_s.max(span_s.0 - self.lag(k, high_m)),
            until_s.min(span_s.1 - self.lag(k, low_m)),
        );
        if cut_s.0 > cut_s.1 {
            return;
        }
        let length_s = cut_s.1 - cut_s.0;
        if piece.motion.climb_mps() == 0.0 || length_s <= shortest_s {
            match found.last_mut() {
                Some((last, (_, end_s))) if *last == k && *end_s >= cut_s.0 => {
                    *end_s = cut_s.1.max(*end_s);
                }
                _ => found.push((k, cut_s)),
            }
            return;
        }
        let middle_s = if length_s < SHRUNK * (until_s - from_s) {
            cut_s.1
        } else {
            0.5 * (cut_s.0 + cut_s.1)
        };
        for part_s in [(cut_s.0, middle_s), (middle_s, cut_s.1)] {
            if part_s.0 < part_s.1 {
                self.divide(k, part_s, span_s, heights_m, shortest_s, found);
            }
        }
    }

    /// Depths of heights (m) below the drone during a span of one piece.
    fn depths_m(&self, piece: &Piece, span_s: Span, heights_m: (f64, f64)) -> (f64, f64) {
        let (low_m, high_m) = piece.motion.box_m(span_s.0, span_s.1);
        (low_m.z - heights_m.1, high_m.z - heights_m.0)
    }

    /// How long the air of a piece is under way down to a depth (s).
    fn lag(&self, k: usize, depth_m: f64) -> f64 {
        let far = self.flight.wakes[k].wake.far_field();
        far.transport_time_s(depth_m, self.convection)
    }
}
