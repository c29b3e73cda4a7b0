//! Where a fleet waits most, and for whom: what is told of it.

use nalgebra::Point3;
use serde::Serialize;

/// Where a fleet waits most, and for whom.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Bottlenecks {
    /// All waits together (s).
    pub(crate) waits_s: f64,
    /// Drones that others wait for, the most first.
    pub(crate) drones: Vec<BottleneckDrone>,
    /// Places where drones wait, the most first.
    pub(crate) places: Vec<BottleneckPlace>,
}

/// A drone that others wait for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct BottleneckDrone {
    pub(crate) name: String,
    /// How many others wait for it.
    pub(crate) drones: usize,
    /// All together (s).
    pub(crate) waits_s: f64,
}

/// A place where drones wait.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct BottleneckPlace {
    /// The mean of their places (m).
    pub(crate) at_m: Point3<f64>,
    /// How many wait there.
    pub(crate) drones: usize,
    /// All together (s).
    pub(crate) waits_s: f64,
}
