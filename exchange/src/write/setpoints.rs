//! Setpoints at a rate: one CSV a drone, for PX4 offboard, MAVROS, ArduPilot's guided mode, and
//! anything else that takes positions.
//!
//! Columns as in PX4's `TrajectorySetpoint` message (position, velocity, acceleration, yaw), local
//! NED; or the same in ENU.

use nalgebra::Point3;

use super::decimal;
use crate::course::Course;
use crate::frame::{Axes, Frame};

/// Header in NED.
pub const NED: &str = "t_s,n_m,e_m,d_m,vn_mps,ve_mps,vd_mps,an_mps2,ae_mps2,ad_mps2,yaw_rad";
/// Header in ENU.
pub const ENU: &str = "t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,yaw_rad";

/// One drone's setpoints, `rate_hz` times a second (1/s) from time 0 to its end and once at or
/// after it, as seen from a place of the world (m).
#[must_use]
pub fn table(course: &Course, frame: &Frame, rate_hz: f64, from_m: Point3<f64>) -> String {
    let header = match frame.axes {
        Axes::Ned => NED,
        Axes::Enu => ENU,
    };
    let mut text = format!("{header}\n");
    let yaw = decimal(frame.yaw_rad(), 6);
    // A rounding of the rate adds no row after the end.
    let rows = (course.until_s() * rate_hz - 1e-6).ceil().max(0.0) as u64;
    for k in 0..=rows {
        let t_s = k as f64 / rate_hz;
        let state = course.state(t_s);
        text += &decimal(t_s, 6);
        for vector in [
            state.position_m - from_m,
            state.velocity_mps,
            state.acceleration_mps2,
        ] {
            for value in frame.from_world(vector).iter() {
                text += ",";
                text += &decimal(*value, 6);
            }
        }
        text += &format!(",{yaw}\n");
    }
    text
}
