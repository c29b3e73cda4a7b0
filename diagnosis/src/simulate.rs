//! What the declared simulation would have recorded, at every sample that was.

use nalgebra::Point3;

/// A quantity that was recorded and can be simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// Reading of a speed probe (m/s).
    Speed,
    /// A receiver's throttle over that of its hover.
    Throttle,
    /// A receiver's power over that of its hover.
    Power,
    /// Vertical force on a receiver beyond thrust and weight (N), up positive.
    VerticalForce,
}

/// One recorded value beside the simulated one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// What it is of.
    pub channel: Channel,
    /// Data row, from 0, in the file that holds the channel.
    pub row: usize,
    /// Time (s).
    pub t_s: f64,
    /// Probe id, or index of the vehicle.
    pub subject: u32,
    /// Where it was measured (m).
    pub position_m: Point3<f64>,
    /// What was recorded.
    pub recorded: f64,
    /// What the simulation gives.
    pub simulated: f64,
    /// Axial speed of the air that is simulated there (m/s).
    pub air_mps: f64,
    /// Place in the wake that blows hardest there; `None`: no drone above.
    pub place: Option<Place>,
}

/// A place in one drone's wake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Index of the vehicle that blows.
    pub emitter: usize,
    /// Depth below its rotor plane over its motor distance.
    pub s_over_l: f64,
    /// Distance from its axis over its motor distance.
    pub r_over_l: f64,
    /// The same distance over the half-width at that depth.
    pub xi: f64,
    /// Azimuth around its axis in the world (rad), from x towards y.
    pub azimuth_rad: f64,
}

impl Sample {
    /// Recorded minus simulated.
    #[must_use]
    pub fn residual(&self) -> f64 {
        self.recorded - self.simulated
    }
}
