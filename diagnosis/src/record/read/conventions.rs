//! How a log is to be understood: frames, signs, kinds of acceleration.

use nalgebra::Vector3;
use serde::Deserialize;

/// Frame of the logged positions, velocities and attitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum Frame {
    /// World z up; body x forward, y left, z up.
    #[default]
    ZUp,
    /// World x north, y east, z down; body x forward, y right, z down. Turned by half a turn about
    /// x, into x north, y west, z up.
    NorthEastDown,
}

/// What the logged acceleration is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Acceleration {
    /// What an accelerometer feels, turned into the world: at hover one gravity upwards.
    SpecificForceInWorld,
    /// What an accelerometer feels, in its own frame.
    SpecificForceInBody,
    /// Change of velocity, in the world: 0 at hover.
    GravityRemovedInWorld,
    /// Change of velocity, in the frame of the body.
    GravityRemovedInBody,
}

/// Which way the logged quaternion turns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum Turns {
    /// Vectors of the body into the world.
    #[default]
    BodyToWorld,
    /// Vectors of the world into the body.
    WorldToBody,
}

/// Sign of the logged pitch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Pitch {
    /// Positive with the nose down: right-handed about y to the left.
    NoseDown,
    /// Positive with the nose up: right-handed about y to the right, and in the Crazyflie's logs.
    NoseUp,
}

/// How a log is to be understood, and where its rows stop being flight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conventions {
    pub(super) frame: Frame,
    /// `None`: the log has none, or it is not to be used.
    pub(super) acceleration: Option<Acceleration>,
    pub(super) rotation: Turns,
    /// `None`: right-handed in the frame of the log.
    pub(super) pitch: Option<Pitch>,
    pub(super) gravity_mps2: f64,
    /// From the logged point to the centre of the rotor plane, in the body (x forward, y left, z
    /// up; m).
    pub(super) rotor_offset_m: Vector3<f64>,
    /// Height of the floor (m), if there is one.
    pub(super) floor_z_m: Option<f64>,
    /// Logged height (m) below which the vehicle stands on the floor or touches it.
    pub(super) touch_z_m: Option<f64>,
    pub(super) crash_tilt_rad: f64,
}

/// Tilt (deg) taken for a crash. Chosen here: the model is of hover and slow flight.
pub(super) const CRASH_TILT_DEG: f64 = 45.0;
