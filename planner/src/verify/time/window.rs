//! One receiver during a span of time in which it and every drone that reaches it fly one piece
//! each: the mean air over its rotor discs as a function of time, and what bounds it.
//!
//! With weights `w` of the points `p` of the discs and wakes `u` superposed at each of them,
//!
//! ```text
//! mean(t) = Σ w_p ⊕ u_k(p, t)          ⊕: momentum √Σu², linear Σu, or the strongest
//! rough   = ⊕ max over the box around the discs        one bound a wake
//! high    = Σ w_p ⊕ max over the path of p             one bound a wake and point
//! range   = mean(middle) ± ⊕ slope_k × half the path   where no wake begins or ends
//! ```
//!
//! All three hold over a whole span, because `⊕` grows with each of its arguments and is
//! subadditive.

use airflow::{Source, Superposition, mean_over_discs_mps};
use nalgebra::{Point3, Vector3};

use super::advected::{Advected, Left};
use super::encounters::Encounter;
use super::spans::between;
use crate::plan::trajectory::{Motion, SAME_TIME_S};
use crate::verify::extents::{FAINTEST_WAKE_MPS, Places, Span};
use crate::verify::scene::{Attached, Flight, Scene, level_gap_m, superpose};

/// Points of the discs that are looked at together, chosen here: a quadrotor's 28 fit.
const CHUNK: usize = 32;

/// How exactly it is known when a receiver is near enough to a wake (m): chosen here, a small part
/// of how far wakes reach.
const NEAR_M: f64 = 0.1;

/// A wake that may reach the receiver.
pub(crate) struct Passing<'a> {
    /// The emitter, during one piece.
    pub(crate) emitter: Attached<'a>,
    /// The receiver's centre as seen from the emitter's.
    pub(crate) relative: Motion,
    /// An upper bound of this wake alone anywhere on the receiver's discs, over the whole window
    /// (m/s).
    alone_mps: f64,
}

/// A receiver and the wakes that may reach it; neither side changes its piece within the span.
pub(crate) struct Window<'a> {
    /// From, until (s).
    pub(crate) span_s: Span,
    /// The receiver's induced velocity at its mass (m/s).
    pub(crate) induced_velocity_mps: f64,
    /// The receiver's mass (kg).
    pub(crate) mass_kg: f64,
    /// Quasi-static wakes; columns go by these even where wakes are advected.
    pub(crate) passing: Vec<Passing<'a>>,
    /// Where a finding has wakes advected: those whose air may arrive in this window.
    advected: Vec<Advected<'a>>,
    /// The exposed drone.
    receiver: &'a Flight,
    /// Of its centre, one formula over the span.
    motion: Motion,
    /// All flights, the obstacles and the air.
    scene: &'a Scene<'a>,
}

/// One piece of another flight while its wake may reach a receiver during one piece of its own.
struct Reaching {
    /// Index in the scene's flights.
    other: usize,
    /// Index in that flight's pieces.
    piece: usize,
    /// The receiver's centre as seen from the other's.
    relative: Motion,
    /// When that is near enough (s).
    span_s: Span,
}

/// All that may reach a receiver between two moments: where it is below, and no farther from the
/// axis than wakes count.
fn reaching(
    scene: &Scene<'_>,
    near: &[Encounter],
    receiver: &Flight,
    (up_s, down_s): Span,
) -> Vec<Reaching> {
    let mut all = Vec::new();
    for encounter in near {
        let other = &scene.flights[encounter.other];
        let from_s = encounter.span_s.0.max(up_s).max(other.airborne_s.0);
        let until_s = encounter.span_s.1.min(down_s).min(other.airborne_s.1);
        if from_s >= until_s {
            continue;
        }
        for mine in
            &receiver.trajectory.pieces()[receiver.trajectory.pieces_during(from_s, until_s)]
        {
            let from_s = from_s.max(mine.motion.from_s);
            let until_s = until_s.min(mine.motion.until_s);
            let here = mine.motion.during(from_s, until_s);
            for piece in other.trajectory.pieces_during(from_s, until_s) {
                let there = other.trajectory.pieces()[piece].motion;
                let Some(relative) = here.seen_from(&there) else {
                    continue;
                };
                let (low_m, _) = relative.box_m(relative.from_s, relative.until_s);
                if low_m.z >= 0.0 {
                    continue;
                }
                let radius_m = other.wakes[piece].reach_m(-low_m.z) + receiver.tip_radius_m;
                let below_m = (f64::NEG_INFINITY, 0.0);
                let Some(span_s) = relative.near_cylinder_s(radius_m, below_m, NEAR_M) else {
                    continue;
                };
                all.push(Reaching {
                    other: encounter.other,
                    piece,
                    relative,
                    span_s,
                });
            }
        }
    }
    all
}

/// The windows of one receiver while it is airborne, in order of time, those without any wake
/// included.
pub(crate) fn windows<'a>(
    scene: &'a Scene<'a>,
    near: &[Encounter],
    receiver: &'a Flight,
) -> Vec<Window<'a>> {
    let up_s = receiver.airborne_s.0;
    let down_s = receiver.airborne_s.1.min(scene.horizon_s);
    let mut cuts_s: Vec<f64> = vec![up_s, down_s, receiver.trajectory.last_s(), scene.last_s];
    cuts_s.extend(receiver.landed_s.iter().flat_map(|it| [it.0, it.1]));
    for piece in &receiver.trajectory.pieces()[receiver.trajectory.pieces_during(up_s, down_s)] {
        cuts_s.extend([piece.motion.from_s, piece.motion.until_s]);
    }
    let reaching = reaching(scene, near, receiver, (up_s, down_s));
    cuts_s.extend(reaching.iter().flat_map(|it| [it.span_s.0, it.span_s.1]));
    // Advected air comes from wherever its drone was: it may arrive as long as the two are near.
    let advected = match scene.flown.convection {
        Some(_) => near,
        None => &[],
    };
    cuts_s.extend(advected.iter().flat_map(|it| [it.span_s.0, it.span_s.1]));
    cuts_s.retain(|&t_s| t_s >= up_s && t_s <= down_s);
    cuts_s.sort_by(f64::total_cmp);
    cuts_s.dedup_by(|b, a| *b - *a <= SAME_TIME_S);

    let spans_s = reaching.iter().map(|it| it.span_s);
    let spans_s = spans_s.chain(advected.iter().map(|it| it.span_s));
    let spans_s: Vec<Span> = spans_s.collect();
    let mut windows = Vec::with_capacity(cuts_s.len());
    for (span_s, met) in between(&cuts_s, &spans_s) {
        let middle_s = 0.5 * (span_s.0 + span_s.1);
        if receiver.rests_at(middle_s) {
            continue;
        }
        let Some(piece) = receiver.trajectory.piece_index(middle_s) else {
            continue;
        };
        let mut window = Window {
            span_s,
            induced_velocity_mps: receiver.wakes[piece].wake.hover_velocity_mps(),
            mass_kg: receiver.trajectory.pieces()[piece].mass_kg,
            passing: Vec::new(),
            advected: Vec::new(),
            receiver,
            motion: receiver.trajectory.pieces()[piece].motion,
            scene,
        };
        let (attached, late): (Vec<usize>, Vec<usize>) =
            met.iter().partition(|&&k| k < reaching.len());
        let passing = attached
            .iter()
            .filter_map(|&k| window.passing(&reaching[k]));
        window.passing = passing.collect();
        let late = late.iter().map(|&k| advected[k - reaching.len()].other);
        let advected =
            late.filter_map(|it| Advected::new(scene, it, (scene.mean_lag(), scene.mean_lag())));
        window.advected = advected
            .filter(|it| window.advected_alone_mps(it, span_s) > FAINTEST_WAKE_MPS)
            .collect();
        windows.push(window);
    }
    windows
}

impl<'a> Window<'a> {
    /// Whether wakes are advected.
    fn is_advected(&self) -> bool {
        self.scene.flown.convection.is_some()
    }

    /// The quasi-static wakes that count for its air: none where wakes are advected.
    fn attached(&self) -> &[Passing<'a>] {
        match self.is_advected() {
            true => &[],
            false => &self.passing,
        }
    }

    /// Whether no wake reaches the receiver in it.
    pub(crate) fn is_calm(&self) -> bool {
        self.advected.is_empty() && self.attached().is_empty()
    }

    /// The wake of another flight, if it counts in this window.
    fn passing(&self, reaching: &Reaching) -> Option<Passing<'a>> {
        let flight = &self.scene.flights[reaching.other];
        let motion = flight.trajectory.pieces()[reaching.piece].motion;
        let mut passing = Passing {
            emitter: flight.attached(reaching.other, reaching.piece, motion),
            relative: (reaching.relative).during(self.span_s.0, self.span_s.1),
            alone_mps: 0.0,
        };
        passing.alone_mps = self.alone_mps(&passing, self.span_s);
        (passing.alone_mps > FAINTEST_WAKE_MPS).then_some(passing)
    }

    /// Whether a wake surely reaches the receiver's height over a span, and whether it may: a top
    /// face may stop it above.
    pub(crate) fn reaches(&self, emitter: &Attached<'_>, span_s: Span) -> (bool, bool) {
        let (low_m, high_m) = self.motion.box_m(span_s.0, span_s.1);
        emitter.reaches(&self.scene.obstacles, (low_m.z, high_m.z), span_s)
    }

    /// The longer path of the receiver and of an emitter over a span (m).
    pub(crate) fn longest_path_m(&self, emitter: &Attached<'_>, (from_s, until_s): Span) -> f64 {
        let motions = [&self.motion, &emitter.motion];
        let paths_m = motions.map(|it| 2.0 * it.half_path_m(from_s, until_s));
        paths_m[0].max(paths_m[1])
    }

    /// An upper bound of one wake anywhere on the receiver's discs (m/s).
    fn alone_mps(&self, passing: &Passing<'_>, span_s: Span) -> f64 {
        let (low_m, _) = passing.relative.box_m(span_s.0, span_s.1);
        if low_m.z >= 0.0 || !self.reaches(&passing.emitter, span_s).1 {
            return 0.0;
        }
        let (off_axis_m, places_m) = self.around_discs_m(passing, span_s);
        passing.emitter.wake.highest_mps(&places_m, off_axis_m)
    }

    /// Smallest distance of the receiver's discs from an emitter's axis, and the box of their
    /// offsets from it (m).
    fn around_discs_m(&self, passing: &Passing<'_>, (from_s, until_s): Span) -> (f64, Places) {
        let level = passing.relative.level_path(from_s, until_s);
        let nearest_m = level.nearest_m([0.0; 2]).norm();
        let (low_m, high_m) = passing.relative.box_m(from_s, until_s);
        let off_axis_m = (nearest_m - self.receiver.tip_radius_m).max(0.0);
        (off_axis_m, self.widened(&(low_m, high_m)))
    }

    /// A box with the receiver's discs around each of its places (m).
    fn widened(&self, places_m: &Places) -> Places {
        let tip_m = self.receiver.tip_radius_m;
        let around_m = Vector3::new(tip_m, tip_m, 0.0);
        (places_m.0 - around_m, places_m.1 + around_m)
    }

    /// Advected air of one flight that may be at the receiver's heights, and the receiver's offsets
    /// from where it left (m).
    fn arriving(&self, from: &Advected<'a>, span_s: Span) -> Vec<(Left<'a>, Places)> {
        let places_m = self.motion.box_m(span_s.0, span_s.1);
        let mut left = from.left(span_s, &places_m);
        left.retain(|left| left.may_reach(&self.scene.obstacles, &places_m));
        let offsets = left.into_iter().map(|left| {
            let offsets_m = left.offsets_m(&places_m);
            (left, offsets_m)
        });
        offsets.collect()
    }

    /// An upper bound of one advected wake anywhere on the receiver's discs (m/s).
    fn advected_alone_mps(&self, from: &Advected<'a>, span_s: Span) -> f64 {
        let arriving = self.arriving(from, span_s);
        let high_mps =
            |(left, offsets_m): &(Left<'a>, Places)| left.highest_mps(&self.widened(offsets_m));
        arriving.iter().map(high_mps).fold(0.0, f64::max)
    }

    /// Where the advected air of a flight that is at the receiver at a time comes from; where it
    /// comes from several places, the strongest.
    fn advected_source(&self, from: &Advected<'a>, t_s: f64) -> Option<Source<'a>> {
        let z_m = self.place_m(t_s).z;
        let sources = from.sources(&self.scene.obstacles, t_s, z_m);
        if sources.len() < 2 {
            return sources.first().copied();
        }
        let alone_mps = |source: &Source<'_>| self.mean_of_mps(&[*source], t_s);
        let stronger = |a: &Source<'_>, b: &Source<'_>| alone_mps(a).total_cmp(&alone_mps(b));
        sources.into_iter().max_by(stronger)
    }

    /// The wakes at a time of the window, and whose.
    fn sources(&self, t_s: f64) -> impl Iterator<Item = (usize, Source<'a>)> {
        let advected = (self.advected.iter())
            .filter_map(move |it| Some((it.from, self.advected_source(it, t_s)?)));
        let attached = self.attached().iter().map(move |passing| {
            let emitter = &passing.emitter;
            (emitter.from, emitter.source(&self.scene.obstacles, t_s))
        });
        advected.chain(attached)
    }

    /// Where the receiver's rotor-plane centre is (m, world).
    pub(crate) fn place_m(&self, t_s: f64) -> Point3<f64> {
        self.motion.at_m(t_s).into()
    }

    /// Mean over the receiver's discs of some wakes, superposed (m/s).
    fn mean_of_mps(&self, sources: &[Source<'a>], t_s: f64) -> f64 {
        let (discs, how) = (&self.receiver.discs, self.scene.superposition);
        mean_over_discs_mps(sources, discs, self.place_m(t_s), how)
    }

    /// Mean air over the receiver's discs at a time of the window (m/s).
    pub(crate) fn mean_mps(&self, t_s: f64) -> f64 {
        let mut sources = Vec::with_capacity(self.advected.len() + self.attached().len());
        sources.extend(self.sources(t_s).map(|(_, source)| source));
        self.mean_of_mps(&sources, t_s)
    }

    /// The flight whose wake alone is the strongest over the discs at a time: index in the scene's
    /// flights.
    pub(crate) fn strongest(&self, t_s: f64) -> Option<usize> {
        let alone = |(from, source)| (from, self.mean_of_mps(&[source], t_s));
        let alone = self.sources(t_s).map(alone);
        let strongest = alone.reduce(|a, b| if b.1 > a.1 { b } else { a });
        strongest.map(|(from, _)| from)
    }

    /// An upper bound of the mean air over the whole window, which is known already (m/s); infinite
    /// where wakes are advected.
    pub(crate) fn most_mps(&self) -> f64 {
        if self.is_advected() {
            return f64::INFINITY;
        }
        let alone = self.passing.iter().map(|passing| passing.alone_mps);
        superpose(self.scene.superposition, alone)
    }

    /// An upper bound of the mean air that costs little (m/s).
    pub(crate) fn rough_mps(&self, span_s: Span) -> f64 {
        let advected = self.advected.iter();
        let advected = advected.map(|it| self.advected_alone_mps(it, span_s));
        let attached = self.attached().iter();
        let attached = attached.map(|it| self.alone_mps(it, span_s));
        superpose(self.scene.superposition, advected.chain(attached))
    }

    /// An upper bound of the mean air that closes in on it as the span shrinks (m/s).
    pub(crate) fn high_mps(&self, span_s: Span) -> f64 {
        let how = self.scene.superposition;
        let arriving: Vec<_> = (self.advected.iter())
            .map(|from| self.arriving(from, span_s))
            .collect();
        let discs = &self.receiver.discs;
        let mut high_mps = 0.0;
        for (points_m, weights) in (discs.offsets_m.chunks(CHUNK)).zip(discs.weights.chunks(CHUNK))
        {
            let mut gathered = [0.0; CHUNK];
            for from_one in &arriving {
                for (so_far, &[x, y]) in gathered.iter_mut().zip(points_m) {
                    let point_m = Vector3::new(x, y, 0.0);
                    let highs_mps = from_one.iter().map(|(left, (low_m, high_m))| {
                        left.highest_mps(&(low_m + point_m, high_m + point_m))
                    });
                    *so_far = how.gather(*so_far, highs_mps.fold(0.0, f64::max));
                }
            }
            for passing in self.attached() {
                self.gather_highs(passing, span_s, points_m, &mut gathered);
            }
            for (&gathered, weight) in gathered.iter().zip(weights) {
                high_mps += weight * how.finish(gathered);
            }
        }
        high_mps
    }

    /// Adds the highest of one wake at each of some points of the discs to what has been gathered
    /// there.
    fn gather_highs(
        &self,
        passing: &Passing<'_>,
        span_s: Span,
        points_m: &[[f64; 2]],
        gathered: &mut [f64; CHUNK],
    ) {
        let Passing {
            emitter, relative, ..
        } = passing;
        let (low_m, high_m) = relative.box_m(span_s.0, span_s.1);
        if low_m.z >= 0.0 || !self.reaches(emitter, span_s).1 {
            return;
        }
        let level = relative.level_path(span_s.0, span_s.1);
        let middle_m = relative.at_m(0.5 * (span_s.0 + span_s.1));
        let half_path_m = relative.half_path_m(span_s.0, span_s.1);
        let mut passage = emitter.wake.passage((-high_m.z, -low_m.z));
        let how = self.scene.superposition;
        if let Some(far) = passage.far_alone() {
            for (so_far, &point_m) in gathered.iter_mut().zip(points_m) {
                *so_far = how.gather(*so_far, far.highest_mps(level.nearest_m(point_m)));
            }
            return;
        }
        for (so_far, &[x, y]) in gathered.iter_mut().zip(points_m) {
            let point_m = Vector3::new(x, y, 0.0);
            let high_mps = passage.highest_along_mps(
                level.nearest_m([x, y]),
                &(low_m + point_m, high_m + point_m),
                &(middle_m + point_m),
                half_path_m,
            );
            *so_far = how.gather(*so_far, high_mps);
        }
    }

    /// A lower and an upper bound of the mean air that close in on it (m/s): from the value at the
    /// middle, by how much each wake may change from there. Superposed, changes are no more than
    /// the changes superposed.
    pub(crate) fn range_mps(&self, span_s: Span) -> (f64, f64) {
        let changes_mps = self.passing.iter().map(|it| self.change_mps(it, span_s));
        let changes_mps: Option<Vec<f64>> = changes_mps.collect();
        let Some(changes_mps) = changes_mps.filter(|_| !self.is_advected()) else {
            return (0.0, self.high_mps(span_s));
        };
        let change_mps = superpose(self.scene.superposition, changes_mps.into_iter());
        let middle_mps = self.mean_mps(0.5 * (span_s.0 + span_s.1));
        ((middle_mps - change_mps).max(0.0), middle_mps + change_mps)
    }

    /// By how much one wake may differ, anywhere on the receiver's discs, from what it is in the
    /// middle of a part of the window (m/s); `None` where it may begin or end within it.
    fn change_mps(&self, passing: &Passing<'_>, span_s: Span) -> Option<f64> {
        let (low_m, high_m) = passing.relative.box_m(span_s.0, span_s.1);
        let (surely, maybe) = self.reaches(&passing.emitter, span_s);
        if low_m.z >= 0.0 || !maybe {
            return Some(0.0);
        }
        // At the rotor plane itself the wake begins; within rounding of it nothing is certain.
        if !surely || -high_m.z <= airflow::HEIGHT_TOLERANCE_M {
            return None;
        }
        let half_path_m = passing.relative.half_path_m(span_s.0, span_s.1);
        if half_path_m == 0.0 {
            return Some(0.0);
        }
        let (off_axis_m, places_m) = self.around_discs_m(passing, span_s);
        Some(passing.emitter.wake.steepest_per_s(&places_m, off_axis_m) * half_path_m)
    }

    /// By how much the mean air may leave its chord over a span (m/s); `None` outside the far
    /// field, and where a wake may begin or end. Along straight paths two places `L` apart a
    /// function stays within `max |f''| L²/8` of its chord; of superposed wakes
    ///
    /// ```text
    /// f = √(Σ u²):   f f'' = Σ (u'² + u u'') - f'²,   0 <= Σ u'² - f'²   so   |f''| <= √(Σ (u'²/u + |u''|)²)
    /// ```
    ///
    /// and for sums alike, with sums in place of roots. Off its chord a path changes each wake by
    /// no more than its steepest times how far.
    pub(crate) fn bend_mps(&self, span_s: Span) -> Option<f64> {
        let how = self.scene.superposition;
        if self.is_advected() || how == Superposition::Strongest {
            return None;
        }
        let mut gathered = 0.0;
        for passing in &self.passing {
            let (wake, relative) = (passing.emitter.wake, &passing.relative);
            let (low_m, high_m) = relative.box_m(span_s.0, span_s.1);
            let (surely, maybe) = self.reaches(&passing.emitter, span_s);
            if low_m.z >= 0.0 || !maybe {
                continue;
            }
            if !surely || wake.is_moved() {
                return None;
            }
            let bent_per_m2 = wake.wake.far_field().bent_over_speed_per_m2(-high_m.z)?;
            let path_m = 2.0 * relative.half_path_m(span_s.0, span_s.1);
            if path_m > 0.0 {
                let (off_axis_m, places_m) = self.around_discs_m(passing, span_s);
                let high_mps = wake.highest_mps(&places_m, off_axis_m);
                let off_m = relative.off_chord_m(span_s.0, span_s.1);
                let off_mps = match off_m > 0.0 {
                    true => 8.0 * off_m * wake.steepest_per_s(&places_m, off_axis_m),
                    false => 0.0,
                };
                let bent_mps = bent_per_m2 * path_m * path_m * high_mps;
                gathered = how.gather(gathered, bent_mps + off_mps);
            }
        }
        Some(how.finish(gathered) / 8.0)
    }

    /// How long the path flown in a part of the window is as seen from each emitter, in half-widths
    /// of its wake there or, where that is more, distances from its axis: within 2 no wake rises
    /// and falls unseen. A wake that is moved or advected may be narrower than the hover jet, and
    /// the jets of single rotors in the near field are: their paths count twice. And whether all
    /// wakes are those of hover jets, passed at constant velocity, none of which begins or ends
    /// within it.
    pub(crate) fn widths(&self, span_s: Span) -> (f64, bool) {
        if self.is_advected() {
            let advected = self.advected.iter();
            let arriving = advected.flat_map(|it| self.arriving(it, span_s));
            let axis_m = (Vector3::zeros(), Vector3::zeros());
            let widths = arriving.map(|(left, offsets_m)| {
                let (low_m, high_m) = offsets_m;
                let half_width_m = left.wake.wake.half_width_m((-high_m.z).max(0.0));
                let off_axis_m = level_gap_m(&offsets_m, &axis_m);
                2.0 * (high_m - low_m).norm() / half_width_m.max(off_axis_m)
            });
            return (widths.fold(0.0, f64::max), false);
        }
        let (mut widths, mut is_plain) = (0.0_f64, true);
        for Passing {
            emitter, relative, ..
        } in &self.passing
        {
            let path_m = 2.0 * relative.half_path_m(span_s.0, span_s.1);
            let (_, high_m) = relative.box_m(span_s.0, span_s.1);
            let wake = &emitter.wake.wake;
            let half_width_m = wake.half_width_m((-high_m.z).max(0.0));
            if emitter.wake.is_moved() {
                (widths, is_plain) = (widths.max(2.0 * path_m / half_width_m), false);
                continue;
            }
            let is_near = -high_m.z < wake.near_field_depth_m();
            let level = relative.level_path(span_s.0, span_s.1);
            let off_axis_m = level.nearest_m([0.0; 2]).norm();
            let here = path_m / half_width_m.max(off_axis_m);
            widths = widths.max(if is_near { 2.0 * here } else { here });
            is_plain &= relative.is_straight() && high_m.z < 0.0 && self.reaches(emitter, span_s).0;
        }
        (widths, is_plain)
    }
}
