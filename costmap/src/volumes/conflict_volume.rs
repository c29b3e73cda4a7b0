//! Where the centre of one drone must not be, seen from another: what the search's tables sample.
//!
//! A ball about the other keeps bodies apart; below it hang the near-field column and the volume in
//! which its wake brings the drone more air than it may, and above it the same with the two
//! exchanged.

use super::downwash::Section;
use super::relative::Relative;

/// Grown by this much all around, in the unit of its lengths: thousands of times the rounding of
/// closed forms.
const GROWTH: f64 = 1e-9;

/// A section of the wake below a drone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WakeSection {
    /// Where; depths of what lies above are negative.
    pub section: Section,
    /// It counts without delay alone, as the near-field column does.
    pub is_quasi_static: bool,
    /// It hangs below the mover, and keeps the reference out: depths are negative.
    pub is_above: bool,
}

/// The convective delay down to a depth, in the units of the lengths and times asked for.
pub trait ConvectiveDelay {
    /// Of the reference's air.
    fn of_reference(&self, depth: f64) -> f64;
    /// Of the mover's.
    fn of_mover(&self, depth: f64) -> f64;
}

/// Quasi-static wakes.
pub struct QuasiStatic;

impl ConvectiveDelay for QuasiStatic {
    fn of_reference(&self, _: f64) -> f64 {
        0.0
    }

    fn of_mover(&self, _: f64) -> f64 {
        0.0
    }
}

/// A ball, and convex sections above and below it.
#[derive(Clone, Debug)]
pub struct ConflictVolume {
    body_radius: f64,
    wake_sections: Vec<WakeSection>,
}

impl ConflictVolume {
    /// From the distance between two centres at which bodies touch, and what hangs below each of
    /// the two (m).
    ///
    /// `below` holds what the other's wake keeps from the drone, `above` what the drone's own wake
    /// keeps from the other.
    pub fn new(body_radius: f64, below: &[WakeSection], above: &[WakeSection]) -> Self {
        let grown = |section: Section| Section {
            from_radius_m: section.from_radius_m + GROWTH,
            to_radius_m: section.to_radius_m + GROWTH,
            ..section
        };
        let mirrored = |section: Section| Section {
            from_depth_m: -section.to_depth_m,
            to_depth_m: -section.from_depth_m,
            from_radius_m: section.to_radius_m,
            to_radius_m: section.from_radius_m,
        };
        Self {
            body_radius: body_radius + GROWTH,
            wake_sections: Vec::new(),
        }
        .with(below, false, grown)
        .with(above, true, |section| grown(mirrored(section)))
    }

    fn with(
        mut self,
        more: &[WakeSection],
        is_above: bool,
        changed: impl Fn(Section) -> Section,
    ) -> Self {
        self.wake_sections.extend(more.iter().map(|it| WakeSection {
            section: changed(it.section),
            is_above,
            ..*it
        }));
        self
    }

    /// The same with its sections changed.
    fn mapped(mut self, change: impl Fn(Section) -> Section) -> Self {
        for it in &mut self.wake_sections {
            it.section = change(it.section);
        }
        self
    }

    /// In another unit of length, that many of which make a metre.
    #[must_use]
    pub fn scaled(mut self, per_metre: f64) -> Self {
        self.body_radius *= per_metre;
        self.mapped(|section| Section {
            from_depth_m: section.from_depth_m * per_metre,
            to_depth_m: section.to_depth_m * per_metre,
            from_radius_m: section.from_radius_m * per_metre,
            to_radius_m: section.to_radius_m * per_metre,
        })
    }

    /// Distance between two centres at which bodies touch.
    pub fn body_radius(&self) -> f64 {
        self.body_radius
    }

    /// Sections of the wake below either.
    pub fn wake_sections(&self) -> &[WakeSection] {
        &self.wake_sections
    }

    /// Its largest radius between two depths, and 0 if it does not reach them.
    pub fn widest_between(&self, shallow: f64, deep: f64) -> f64 {
        let nearest = shallow.max(-deep).max(0.0);
        let body = (self.body_radius.powi(2) - nearest.powi(2)).max(0.0).sqrt();
        let sections = self.reached([shallow, deep]);
        let ends = sections.map(|it| it.section).flat_map(|section| {
            let ends = [
                shallow.max(section.from_depth_m),
                deep.min(section.to_depth_m),
            ];
            ends.map(|depth| section.radius_m(depth).unwrap_or(0.0))
        });
        ends.fold(body, f64::max)
    }

    /// By how much the mover is to begin after the reference, at least and at most, so that one of
    /// them is in what it keeps clear, at any convective delay; `None`: it never is. What
    /// lies between two separate spells counts as well.
    ///
    /// Of quasi-static air that is how far the reference's moment is ahead of the mover's; air
    /// under way since `δ` delays the mover by as much where it is the reference's, and hurries it
    /// where it is its own. All delays from none to the longest make one interval, longer at one
    /// end.
    pub fn delays(&self, relative: &Relative, late: &impl ConvectiveDelay) -> Option<[f64; 2]> {
        let depths = relative.depths();
        let near = (depths[0] < self.body_radius && depths[1] > -self.body_radius)
            .then(|| relative.delays_near(self.body_radius));
        let entered = self.entered(relative, late).map(|(_, delays)| delays);
        let all = near.flatten().into_iter().chain(entered);
        all.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    }

    /// The same of air alone: below the reference, and above it.
    pub fn air_delays(
        &self,
        relative: &Relative,
        late: &impl ConvectiveDelay,
    ) -> [Option<[f64; 2]>; 2] {
        [false, true].map(|is_above| {
            let entered = self.entered(relative, late);
            let entered = entered.filter(|(it, _)| !it.is_quasi_static && it.is_above == is_above);
            let delays = entered.map(|(_, delays)| delays);
            delays.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
        })
    }

    /// What is met of what hangs below either, and with which delays.
    fn entered<'a>(
        &'a self,
        relative: &'a Relative,
        late: &'a impl ConvectiveDelay,
    ) -> impl Iterator<Item = (&'a WakeSection, [f64; 2])> {
        let depths = relative.depths();
        let nearest = relative.nearest([0.0; 2]);
        self.reached(depths)
            .filter(move |it| it.section.from_radius_m.max(it.section.to_radius_m) >= nearest)
            .filter_map(move |it| {
                let [from, to] = relative.delays_in(&it.section)?;
                let [earlier, later] = it.lasts(depths, late);
                Some((it, [from - earlier, to + later]))
            })
    }

    /// What a range of depths enters. At the height of the rotors themselves there is no air.
    fn reached(&self, [shallow, deep]: [f64; 2]) -> impl Iterator<Item = &WakeSection> {
        self.wake_sections.iter().filter(move |it| {
            let section = &it.section;
            let is_level = section.from_depth_m == 0.0 && deep <= 0.0
                || section.to_depth_m == 0.0 && shallow >= 0.0;
            !is_level && section.from_depth_m <= deep && shallow <= section.to_depth_m
        })
    }
}

impl WakeSection {
    /// How long its air outlasts the mover, and the reference, down to the deepest of some depths
    /// that are in it.
    pub fn lasts(&self, [shallow, deep]: [f64; 2], late: &impl ConvectiveDelay) -> [f64; 2] {
        let Section {
            from_depth_m,
            to_depth_m,
            ..
        } = self.section;
        match self.is_quasi_static {
            true => [0.0; 2],
            false if !self.is_above => [0.0, late.of_reference(deep.min(to_depth_m))],
            false => [late.of_mover((-shallow).min(-from_depth_m)), 0.0],
        }
    }
}
