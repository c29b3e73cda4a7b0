//! Boxes of places and spans of time, and what is too faint to count in them.

use nalgebra::{Point3, Vector3};

/// A single wake below this axial speed is left out (m/s), chosen here: a tenth of the air that
/// drifts through a closed hall (0.06 to 0.12 m/s during the flights the jet was fitted to).
pub const FAINTEST_WAKE_MPS: f64 = 0.01;

/// Lowest and highest corner of a box (m).
pub(crate) type Places = (Vector3<f64>, Vector3<f64>);

/// Begin and end (s).
pub(super) type Span = (f64, f64);

/// Whether two corners are finite and in order.
pub(super) fn is_box(min_m: &Point3<f64>, max_m: &Point3<f64>) -> bool {
    (0..3).all(|k| min_m[k].is_finite() && max_m[k].is_finite() && min_m[k] <= max_m[k])
}
