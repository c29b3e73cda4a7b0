//! Writers, one file a format: courses in, bytes out. None imports a reader.

pub mod compressed;
pub mod crazyswarm;
pub mod czml;
pub mod mcap;
pub mod mission;
pub mod setpoints;
pub mod skyb;
pub mod skyc;

/// A number with at most so many decimals, without a sign on zero.
fn decimal(value: f64, decimals: i32) -> String {
    let scale = 10_f64.powi(decimals);
    format!("{}", (value * scale).round() / scale + 0.0)
}
