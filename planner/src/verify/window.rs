//! One receiver during a span of time in which it and everybody blowing on it fly one piece each.

use airflow::{Source, mean_over_discs_mps};
use nalgebra::{Point3, Vector3};

use super::FAINTEST_WAKE_MPS;
use super::flight::{Flight, Scene};
use super::late::Late;
use super::nearby::Near;
use super::wake_bound::BoundedWake;
use crate::plan::trajectory::Motion;

/// A wake that the receiver may feel.
pub(super) struct Emission<'a> {
    /// Index in the scene's flights.
    pub(super) other: usize,
    pub(super) wake: &'a BoundedWake,
    pub(super) motion: Motion,
    /// The receiver's centre as seen from the emitter's.
    pub(super) relative: Motion,
    pub(super) stops: &'a [u32],
}

/// A receiver and the wakes it may feel; neither side changes its piece within the span.
pub(super) struct Window<'a> {
    pub(super) from_s: f64,
    pub(super) until_s: f64,
    /// The receiver's induced velocity at its mass (m/s).
    pub(super) induced_velocity_mps: f64,
    /// The receiver's mass (kg).
    pub(super) mass_kg: f64,
    pub(super) emissions: Vec<Emission<'a>>,
    /// Where air takes its time: everybody whose air may arrive in this window, in place of the emissions, which columns go by.
    pub(super) late: Vec<Late<'a>>,
    pub(super) receiver: &'a Flight,
    pub(super) motion: Motion,
    pub(super) scene: &'a Scene<'a>,
}

/// The windows of one receiver while it is airborne, in order of time, those without any wake included.
pub(super) fn windows<'a>(
    scene: &'a Scene<'a>,
    near: &[Near],
    receiver: &'a Flight,
) -> Vec<Window<'a>> {
    let (up_s, down_s) = (
        receiver.airborne_s.0,
        receiver.airborne_s.1.min(scene.horizon_s),
    );
    let mut cuts_s: Vec<f64> = vec![up_s, down_s, receiver.trajectory.last_s(), scene.last_s];
    let ends = |flight: &Flight, from_s: f64, until_s: f64, cuts_s: &mut Vec<f64>| {
        for piece in &flight.trajectory.pieces()[flight.trajectory.pieces_during(from_s, until_s)] {
            cuts_s.extend([
                piece.motion.from_s.max(from_s),
                piece.motion.until_s.min(until_s),
            ]);
        }
    };
    ends(receiver, up_s, down_s, &mut cuts_s);
    for encounter in near {
        let other = &scene.flights[encounter.other];
        let (from_s, until_s) = (encounter.from_s.max(up_s), encounter.until_s.min(down_s));
        if from_s < until_s {
            cuts_s.extend([
                encounter.from_s,
                encounter.until_s,
                other.airborne_s.0,
                other.airborne_s.1,
            ]);
            ends(other, from_s, until_s, &mut cuts_s);
        }
    }
    cuts_s.retain(|&t_s| t_s >= up_s && t_s <= down_s);
    cuts_s.sort_by(f64::total_cmp);
    cuts_s.dedup_by(|b, a| *b - *a <= crate::plan::trajectory::SAME_TIME_S);
    let mut by_start: Vec<&Near> = near.iter().collect();
    by_start.sort_by(|a, b| a.from_s.total_cmp(&b.from_s).then(a.other.cmp(&b.other)));

    let mut under_way: Vec<&Near> = Vec::new();
    let mut next = 0;
    let mut windows = Vec::with_capacity(cuts_s.len());
    for span in cuts_s.windows(2) {
        let (from_s, until_s) = (span[0], span[1]);
        let middle_s = 0.5 * (from_s + until_s);
        while next < by_start.len() && by_start[next].from_s <= middle_s {
            under_way.push(by_start[next]);
            next += 1;
        }
        under_way.retain(|encounter| encounter.until_s > middle_s);
        let Some(piece) = receiver.trajectory.piece_index(middle_s) else {
            continue;
        };
        let mut others: Vec<usize> = under_way.iter().map(|encounter| encounter.other).collect();
        others.sort_unstable();
        let motion = receiver.trajectory.pieces()[piece].motion;
        let mut window = Window {
            from_s,
            until_s,
            induced_velocity_mps: receiver.wakes[piece].wake.hover_velocity_mps(),
            mass_kg: receiver.trajectory.pieces()[piece].mass_kg,
            emissions: Vec::new(),
            late: Vec::new(),
            receiver,
            motion,
            scene,
        };
        window.emissions = others
            .iter()
            .filter_map(|&other| window.emission(other))
            .collect();
        if scene.convection.is_some() {
            window.late = others
                .iter()
                .filter_map(|&other| Late::new(scene, other))
                .filter(|late| window.late_alone_mps(late, from_s, until_s) > FAINTEST_WAKE_MPS)
                .collect();
        }
        windows.push(window);
    }
    windows
}

impl<'a> Window<'a> {
    /// Whether air takes its time in it.
    pub(super) fn is_late(&self) -> bool {
        !self.late.is_empty()
    }

    /// Whether no wake is felt in it.
    pub(super) fn is_calm(&self) -> bool {
        match self.scene.convection {
            Some(_) => self.late.is_empty(),
            None => self.emissions.is_empty(),
        }
    }

    /// The wake of another flight, if it can be felt in this window.
    fn emission(&self, other: usize) -> Option<Emission<'a>> {
        let emitter = &self.scene.flights[other];
        if !emitter.airborne_during(self.from_s, self.until_s) {
            return None;
        }
        let piece = emitter
            .trajectory
            .piece_index(0.5 * (self.from_s + self.until_s))?;
        let motion = emitter.trajectory.pieces()[piece].motion;
        let relative = self
            .motion
            .during(self.from_s, self.until_s)
            .seen_from(&motion)?;
        let emission = Emission {
            other,
            wake: &emitter.wakes[piece],
            motion,
            relative,
            stops: &emitter.stops[piece],
        };
        (self.rough_high_mps(&emission, self.from_s, self.until_s) > FAINTEST_WAKE_MPS)
            .then_some(emission)
    }

    /// Depths of the receiver below an emitter (m).
    pub(super) fn depths_m(emission: &Emission<'_>, from_s: f64, until_s: f64) -> (f64, f64) {
        let (low_m, high_m) = emission.relative.box_m(from_s, until_s);
        (-high_m.z, -low_m.z)
    }

    /// Whether the wake surely reaches the receiver's height, and whether it may.
    pub(super) fn reaches(
        &self,
        emission: &Emission<'_>,
        from_s: f64,
        until_s: f64,
    ) -> (bool, bool) {
        let heights_m = self.motion.box_m(from_s, until_s);
        let places_m = emission.motion.box_m(from_s, until_s);
        let (lowest_m, highest_m) =
            self.scene
                .stops
                .end_range_m(&emission.wake.wake, &places_m, emission.stops);
        (
            heights_m.0.z >= highest_m,
            heights_m.1.z >= lowest_m - airflow::HEIGHT_TOLERANCE_M,
        )
    }

    /// An upper bound of one wake anywhere on the receiver's discs (m/s).
    pub(super) fn rough_high_mps(&self, emission: &Emission<'_>, from_s: f64, until_s: f64) -> f64 {
        let depths_m = Self::depths_m(emission, from_s, until_s);
        if depths_m.1 <= 0.0 || !self.reaches(emission, from_s, until_s).1 {
            return 0.0;
        }
        let (off_axis_m, places_m) = self.around_discs_m(emission, from_s, until_s);
        emission.wake.highest_mps(depths_m, off_axis_m, &places_m)
    }

    /// Smallest distance of the receiver's discs from an emitter's axis, and the box of their offsets from it (m).
    pub(super) fn around_discs_m(
        &self,
        emission: &Emission<'_>,
        from_s: f64,
        until_s: f64,
    ) -> (f64, (Vector3<f64>, Vector3<f64>)) {
        let way = emission.relative.level_way(from_s, until_s);
        let off_axis_m = way.extremes_m([0.0; 2]).0.norm();
        let tip_m = self.receiver.tip_radius_m;
        let around_m = Vector3::new(tip_m, tip_m, 0.0);
        let (low_m, high_m) = emission.relative.box_m(from_s, until_s);
        (
            (off_axis_m - tip_m).max(0.0),
            (low_m - around_m, high_m + around_m),
        )
    }

    /// The wakes at a time of the window, and whose.
    fn sources(&self, t_s: f64, sources: &mut Vec<Source<'a>>, from: &mut Vec<usize>) {
        sources.clear();
        from.clear();
        for late in &self.late {
            if let Some(source) = self.late_source(late, t_s) {
                sources.push(source);
                from.push(late.other);
            }
        }
        if self.scene.convection.is_some() {
            return;
        }
        from.extend(self.emissions.iter().map(|emission| emission.other));
        sources.extend(self.emissions.iter().map(|emission| {
            let position_m = Point3::from(emission.motion.at_m(t_s));
            let wake = &emission.wake.wake;
            let ends_at_z_m = self.scene.stops.end_z_m(wake, &position_m, emission.stops);
            Source {
                wake,
                position_m,
                ends_at_z_m,
            }
        }));
    }

    /// Where the receiver is (m).
    pub(super) fn place_m(&self, t_s: f64) -> Point3<f64> {
        self.motion.at_m(t_s).into()
    }

    /// Mean air over the receiver's discs at a time of the window (m/s).
    pub(super) fn mean_mps(&self, t_s: f64, sources: &mut Vec<Source<'a>>) -> f64 {
        if self.is_calm() {
            return 0.0;
        }
        self.sources(t_s, sources, &mut Vec::new());
        mean_over_discs_mps(
            sources,
            &self.receiver.discs,
            self.place_m(t_s),
            self.scene.superposition,
        )
    }

    /// Whose wake alone is the strongest over the discs at a time: index in the scene's flights.
    pub(super) fn strongest(&self, t_s: f64) -> Option<usize> {
        let (mut sources, mut from) = (Vec::new(), Vec::new());
        self.sources(t_s, &mut sources, &mut from);
        let mut strongest: Option<(usize, f64)> = None;
        for (other, source) in from.iter().zip(&sources) {
            let one = std::slice::from_ref(source);
            let alone_mps = mean_over_discs_mps(
                one,
                &self.receiver.discs,
                self.place_m(t_s),
                self.scene.superposition,
            );
            if strongest.is_none_or(|(_, known_mps)| alone_mps > known_mps) {
                strongest = Some((*other, alone_mps));
            }
        }
        strongest.map(|(other, _)| other)
    }

    /// Whether no wake can rise and fall unseen within a part of the window: the way flown as seen from each
    /// emitter is at most twice the half-width there, or the distance from its axis.
    pub(super) fn is_smooth(&self, from_s: f64, until_s: f64) -> bool {
        if self.scene.convection.is_some() {
            return self.late_is_smooth(from_s, until_s);
        }
        self.emissions.iter().all(|e| {
            let way_m = 2.0 * e.relative.half_path_m(from_s, until_s);
            let depths_m = Self::depths_m(e, from_s, until_s);
            let off_axis_m = e.relative.axis_distance_m(from_s, until_s, [0.0; 2]).0;
            if e.wake.is_moved() {
                // It may be narrower than the hover jet, and anywhere.
                return way_m <= e.wake.wake.half_width_m(depths_m.0.max(0.0));
            }
            way_m
                <= 2.0
                    * e.wake
                        .wake
                        .half_width_m(depths_m.0.max(0.0))
                        .max(off_axis_m)
        })
    }

    /// Whether the emitter's wake reaches the receiver's height at a time.
    pub(super) fn felt_at(&self, emission: &Emission<'_>, t_s: f64) -> bool {
        self.reaches(emission, t_s, t_s).1
    }

    /// Whether something other than the floor may stop this wake in the window.
    pub(super) fn may_stop(&self, emission: &Emission<'_>) -> bool {
        !emission.stops.is_empty()
    }
}
