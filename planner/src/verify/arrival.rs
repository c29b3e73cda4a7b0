//! A window of one receiver where air takes its time: bounds, moments and smoothness.

use airflow::{Source, mean_over_discs_mps};
use nalgebra::Vector3;

use super::late::{Late, Left};
use super::window::Window;

/// Lowest and highest corner (m).
type Places = (Vector3<f64>, Vector3<f64>);

impl<'a> Window<'a> {
    /// Air of another flight that may arrive at the receiver's heights in a part of the window.
    fn arriving(&self, late: &Late<'a>, from_s: f64, until_s: f64) -> Vec<(Left<'a>, Places)> {
        let heights_m = self.motion.box_m(from_s, until_s);
        let left = late.left((from_s, until_s), (heights_m.0.z, heights_m.1.z));
        left.into_iter()
            .filter(|left| {
                let (lowest_m, _) =
                    (self.scene.stops).end_range_m(&left.wake.wake, &left.places_m, left.stops);
                heights_m.1.z >= lowest_m - airflow::HEIGHT_TOLERANCE_M
            })
            .map(|left| {
                let offsets_m = left.offsets_m(&heights_m);
                (left, offsets_m)
            })
            .collect()
    }

    /// An upper bound of one late wake anywhere on the receiver's discs (m/s).
    pub(super) fn late_alone_mps(&self, late: &Late<'a>, from_s: f64, until_s: f64) -> f64 {
        let tip_m = self.receiver.tip_radius_m;
        let around_m = Vector3::new(tip_m, tip_m, 0.0);
        let arriving = self.arriving(late, from_s, until_s);
        let highs_mps = arriving.iter().map(|(left, (low_m, high_m))| {
            left.highest_mps(&(low_m - around_m, high_m + around_m))
        });
        highs_mps.fold(0.0, f64::max)
    }

    /// An upper bound of all late wakes together that costs little (m/s).
    pub(super) fn late_rough_mps(&self, from_s: f64, until_s: f64) -> f64 {
        let each_mps = (self.late.iter()).map(|late| self.late_alone_mps(late, from_s, until_s));
        self.scene.superpose(each_mps)
    }

    /// An upper bound of the mean of late air over the discs that closes in on it (m/s).
    pub(super) fn late_high_mps(&self, from_s: f64, until_s: f64) -> f64 {
        let arriving: Vec<_> = (self.late.iter())
            .map(|late| self.arriving(late, from_s, until_s))
            .collect();
        let discs = &self.receiver.discs;
        let mut high = 0.0;
        for (&[x, y], weight) in discs.offsets_m.iter().zip(&discs.weights) {
            let point_m = Vector3::new(x, y, 0.0);
            let highs_mps = arriving.iter().map(|from_one| {
                let highs_mps = from_one.iter().map(|(left, (low_m, high_m))| {
                    left.highest_mps(&(low_m + point_m, high_m + point_m))
                });
                highs_mps.fold(0.0, f64::max)
            });
            high += weight * self.scene.superpose(highs_mps);
        }
        high
    }

    /// Where the air of another flight that is at the receiver at a time comes from; where it comes from several places, the one that
    /// blows hardest.
    pub(super) fn late_source(&self, late: &Late<'a>, t_s: f64) -> Option<Source<'a>> {
        let place_m = self.place_m(t_s);
        let sources = late.sources(&self.scene.stops, t_s, place_m.z);
        if sources.len() < 2 {
            return sources.first().copied();
        }
        let alone_mps = |source: &Source<'_>| {
            let one = std::slice::from_ref(source);
            mean_over_discs_mps(one, &self.receiver.discs, place_m, self.scene.superposition)
        };
        let harder = |a: &Source<'_>, b: &Source<'_>| alone_mps(a).total_cmp(&alone_mps(b));
        sources.into_iter().max_by(harder)
    }

    /// [`Window::is_smooth`] of air that comes late: no way through it is longer than the half-width there.
    pub(super) fn late_is_smooth(&self, from_s: f64, until_s: f64) -> bool {
        let mut arriving = (self.late.iter()).flat_map(|late| self.arriving(late, from_s, until_s));
        arriving.all(|(left, (low_m, high_m))| {
            let way_m = (high_m - low_m).norm();
            way_m <= left.wake.wake.half_width_m((-high_m.z).max(0.0))
        })
    }
}
