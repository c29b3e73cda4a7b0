//! The mean air over a receiver's discs as a function of time within a window: its value and its bounds.

use airflow::{Source, Superposition};
use nalgebra::Vector3;

use super::clock::Bounded;
use super::window::{Emission, Window};

/// Points of the discs that are looked at together; a quadrotor's 28 fit.
const CHUNK: usize = 32;

/// The mean air (m/s) in a window.
pub(super) struct Mean<'w, 'a> {
    window: &'w Window<'a>,
    sources: &'w mut Vec<Source<'a>>,
    chords: bool,
}

impl<'a> Window<'a> {
    /// The mean air of this window; what `sources` holds does not matter.
    pub(super) fn mean<'w>(&'w self, sources: &'w mut Vec<Source<'a>>) -> Mean<'w, 'a> {
        Mean {
            window: self,
            sources,
            chords: false,
        }
    }

    /// The same, also bounded by chords: far fewer spans then follow a peak. The worst of a flight is found without, so that the figures
    /// of a plan stay those of earlier versions to the byte.
    pub(super) fn mean_by_chords<'w>(&'w self, sources: &'w mut Vec<Source<'a>>) -> Mean<'w, 'a> {
        Mean {
            chords: true,
            ..self.mean(sources)
        }
    }
}

impl Bounded for Mean<'_, '_> {
    fn value(&mut self, t_s: f64) -> f64 {
        self.window.mean_mps(t_s, self.sources)
    }

    fn rough(&mut self, from_s: f64, until_s: f64) -> f64 {
        let window = self.window;
        if window.is_late() {
            return window.late_rough_mps(from_s, until_s);
        }
        let highs_mps =
            (window.emissions.iter()).map(|e| window.rough_high_mps(e, from_s, until_s));
        window.scene.superpose(highs_mps)
    }

    fn high(&mut self, from_s: f64, until_s: f64) -> f64 {
        let window = self.window;
        if window.is_late() {
            return window.late_high_mps(from_s, until_s);
        }
        let discs = &window.receiver.discs;
        let superposition = window.scene.superposition;
        let mut high = 0.0;
        for (points_m, weights) in discs
            .offsets_m
            .chunks(CHUNK)
            .zip(discs.weights.chunks(CHUNK))
        {
            let mut gathered = [0.0; CHUNK];
            for emission in &window.emissions {
                window.gather_highs(emission, (from_s, until_s), points_m, &mut gathered);
            }
            for (&gathered, weight) in gathered.iter().zip(weights) {
                high += weight * superposition.finish(gathered);
            }
        }
        high
    }

    /// From the value at the middle, by how much each wake may change on the way from there: superposed, changes are no more than
    /// the changes superposed.
    fn range(&mut self, from_s: f64, until_s: f64) -> (f64, f64) {
        let window = self.window;
        let changes: Option<Vec<f64>> = (!window.is_late())
            .then(|| (window.emissions.iter()).map(|e| window.change_mps(e, from_s, until_s)))
            .and_then(Iterator::collect);
        let Some(changes_mps) = changes else {
            return (0.0, self.high(from_s, until_s));
        };
        let change = window.scene.superpose(changes_mps.into_iter());
        let middle = self.value(0.5 * (from_s + until_s));
        ((middle - change).max(0.0), middle + change)
    }

    /// In far fields, by how much each of them bends on the way. Along straight ways two places `L` apart a function stays within
    /// `max |f''| L²/8` of its chord; of superposed wakes
    ///
    /// ```text
    /// f = √(Σ u²):   f f'' = Σ (u'² + u u'') - f'²,   0 <= Σ u'² - f'²   so   |f''| <= √(Σ (u'²/u + |u''|)²)
    /// ```
    ///
    /// and for sums alike, with sums in place of roots.
    fn bulge(&mut self, from_s: f64, until_s: f64) -> Option<f64> {
        let window = self.window;
        if !self.chords
            || window.is_late()
            || window.scene.superposition == Superposition::Strongest
        {
            return None;
        }
        let mut gathered = 0.0;
        for emission in &window.emissions {
            let bend_mps = window.bend_mps(emission, from_s, until_s)?;
            gathered = window.scene.superposition.gather(gathered, bend_mps);
        }
        Some(window.scene.superposition.finish(gathered) / 8.0)
    }
}

impl Window<'_> {
    /// By how much one wake may differ, anywhere on the receiver's discs, from what it is in the middle of a part of the window (m/s);
    /// `None` where it may begin or end within it.
    fn change_mps(&self, emission: &Emission<'_>, from_s: f64, until_s: f64) -> Option<f64> {
        let depths_m = Self::depths_m(emission, from_s, until_s);
        let (surely, maybe) = self.reaches(emission, from_s, until_s);
        if depths_m.1 <= 0.0 || !maybe {
            return Some(0.0);
        }
        // At the rotor plane itself the wake begins; within rounding of it nothing is certain.
        if !surely || depths_m.0 <= airflow::HEIGHT_TOLERANCE_M {
            return None;
        }
        let half_path_m = emission.relative.half_path_m(from_s, until_s);
        if half_path_m == 0.0 {
            return Some(0.0);
        }
        let (off_axis_m, places_m) = self.around_discs_m(emission, from_s, until_s);
        let steepest = emission
            .wake
            .steepest_per_s(depths_m, off_axis_m, &places_m);
        Some(steepest * half_path_m)
    }

    /// `u'²/u + |u''|` of one wake anywhere on the receiver's discs, by the square of the way through a part of the window (m/s); `None` outside
    /// the far field, and where the wake may begin or end.
    fn bend_mps(&self, emission: &Emission<'_>, from_s: f64, until_s: f64) -> Option<f64> {
        let depths_m = Self::depths_m(emission, from_s, until_s);
        let (surely, maybe) = self.reaches(emission, from_s, until_s);
        if depths_m.1 <= 0.0 || !maybe {
            return Some(0.0);
        }
        if !surely {
            return None;
        }
        let bent_per_m2 = emission.wake.bent_over_speed_per_m2(depths_m.0)?;
        let way_m = 2.0 * emission.relative.half_path_m(from_s, until_s);
        if way_m == 0.0 {
            return Some(0.0);
        }
        let (off_axis_m, places_m) = self.around_discs_m(emission, from_s, until_s);
        let high_mps = emission.wake.highest_mps(depths_m, off_axis_m, &places_m);
        Some(bent_per_m2 * way_m * way_m * high_mps)
    }

    /// Adds the highest of one wake at each of some points of the discs to what has been gathered there.
    fn gather_highs(
        &self,
        emission: &Emission<'_>,
        (from_s, until_s): (f64, f64),
        points_m: &[[f64; 2]],
        gathered: &mut [f64; CHUNK],
    ) {
        let relative = &emission.relative;
        let (low_m, high_m) = relative.box_m(from_s, until_s);
        if low_m.z >= 0.0 || !self.reaches(emission, from_s, until_s).1 {
            return;
        }
        let way = relative.level_way(from_s, until_s);
        let middle_m = relative.at_m(0.5 * (from_s + until_s));
        let mut passage = emission.wake.passage(
            (-high_m.z, -low_m.z),
            relative.half_path_m(from_s, until_s),
            -middle_m.z,
        );
        let superposition = self.scene.superposition;
        if let Some(far) = passage.far_alone() {
            for (so_far, &point_m) in gathered.iter_mut().zip(points_m) {
                let high_mps = far.highest_mps(way.extremes_m(point_m).0);
                *so_far = superposition.gather(*so_far, high_mps);
            }
            return;
        }
        for (so_far, &[x, y]) in gathered.iter_mut().zip(points_m) {
            let point_m = Vector3::new(x, y, 0.0);
            let high_mps = passage.highest_mps(
                way.extremes_m([x, y]).0,
                &(low_m + point_m, high_m + point_m),
                middle_m.xy() + point_m.xy(),
            );
            *so_far = superposition.gather(*so_far, high_mps);
        }
    }
}
