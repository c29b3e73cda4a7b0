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

/// A ball, and convex sections above and below it. Depths of what lies above are negative.
#[derive(Clone, Debug)]
pub struct KeepOut {
    body_radius: f64,
    sections: Vec<Section>,
}

impl KeepOut {
    /// From the distance between two centres at which bodies touch, and what hangs below each of
    /// the two (m).
    ///
    /// `below` holds what the other's wake keeps from the drone, `above` what the drone's own wake
    /// keeps from the other.
    pub fn new(body_radius: f64, below: &[Section], above: &[Section]) -> Self {
        let grown = |section: &Section| Section {
            from_radius_m: section.from_radius_m + GROWTH,
            to_radius_m: section.to_radius_m + GROWTH,
            ..*section
        };
        let mirrored = |section: &Section| Section {
            from_depth_m: -section.to_depth_m,
            to_depth_m: -section.from_depth_m,
            from_radius_m: section.to_radius_m,
            to_radius_m: section.from_radius_m,
        };
        let all = below.iter().copied().chain(above.iter().map(mirrored));
        Self {
            body_radius: body_radius + GROWTH,
            sections: all.map(|section| grown(&section)).collect(),
        }
    }

    /// In another unit of length, that many of which make a metre.
    #[must_use]
    pub fn scaled(mut self, per_metre: f64) -> Self {
        self.body_radius *= per_metre;
        for section in &mut self.sections {
            *section = Section {
                from_depth_m: section.from_depth_m * per_metre,
                to_depth_m: section.to_depth_m * per_metre,
                from_radius_m: section.from_radius_m * per_metre,
                to_radius_m: section.to_radius_m * per_metre,
            };
        }
        self
    }

    /// Distance between two centres at which bodies touch.
    pub fn body_radius(&self) -> f64 {
        self.body_radius
    }

    /// Its sections; depths of those that lie above are negative.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// Its largest radius between two depths, and 0 if it does not reach them.
    pub fn widest_between(&self, shallow: f64, deep: f64) -> f64 {
        let nearest = shallow.max(-deep).max(0.0);
        let body = (self.body_radius.powi(2) - nearest.powi(2)).max(0.0).sqrt();
        let sections = self.reached([shallow, deep]);
        let ends = sections.flat_map(|section| {
            let ends = [
                shallow.max(section.from_depth_m),
                deep.min(section.to_depth_m),
            ];
            ends.map(|depth| section.radius_m(depth).unwrap_or(0.0))
        });
        ends.fold(body, f64::max)
    }

    /// By how much the reference's moment is ahead of the mover's, at least and at most, while the
    /// mover is in it; `None`: it never is. What lies between two separate spells counts as well.
    pub fn delays(&self, relative: &Relative) -> Option<[f64; 2]> {
        let depths = relative.depths();
        let near = (depths[0] < self.body_radius && depths[1] > -self.body_radius)
            .then(|| relative.delays_near(self.body_radius));
        let nearest = relative.nearest([0.0; 2]);
        let met = self
            .reached(depths)
            .filter(|it| it.from_radius_m.max(it.to_radius_m) >= nearest)
            .map(|it| relative.delays_in(it));
        let all = near.into_iter().chain(met).flatten();
        all.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    }

    /// Sections that a range of depths enters. At the height of the rotors themselves there is no
    /// air.
    fn reached(&self, [shallow, deep]: [f64; 2]) -> impl Iterator<Item = &Section> {
        self.sections.iter().filter(move |section| {
            let is_level = section.from_depth_m == 0.0 && deep <= 0.0
                || section.to_depth_m == 0.0 && shallow >= 0.0;
            !is_level && section.from_depth_m <= deep && shallow <= section.to_depth_m
        })
    }
}
