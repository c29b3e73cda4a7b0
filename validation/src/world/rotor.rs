//! How a drone's throttle answers: to air from above, to floor and ceiling, to its battery.

use super::jet::Drone;

/// What a receiver's throttle feels besides the wake.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Answer {
    /// Share of the blades' lift that the inflow takes at hover; 0: the paper's law alone.
    pub(crate) inflow: f64,
    /// Whether floor and ceiling act on it.
    pub(crate) floor: bool,
    pub(crate) ceiling: bool,
    /// Power by which the throttle rises as the voltage falls.
    pub(crate) battery: f64,
}

/// Where a receiver is, and on what.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReceiverConditions {
    /// Air from above over its induced speed.
    pub(crate) alpha: f64,
    pub(crate) above_floor_m: Option<f64>,
    pub(crate) below_ceiling_m: Option<f64>,
    /// Voltage over that of a full battery.
    pub(crate) battery: f64,
}

impl Answer {
    /// Throttle over that of hover.
    pub(crate) fn throttle(&self, drone: &Drone, met: &ReceiverConditions) -> f64 {
        // Momentum theory at constant thrust: the speed through the disc solves v (v - alpha) = 1.
        let through = 0.5 * (met.alpha + (met.alpha * met.alpha + 4.0).sqrt());
        let mut throttle = through.sqrt();
        // Blades at constant thrust: Ω² (1 + k) - Ω k v = 1.
        let k = self.inflow;
        let bend = k * through;
        throttle *= (bend + (bend * bend + 4.0 * (1.0 + k)).sqrt()) / (2.0 * (1.0 + k));
        if let (true, Some(height_m)) = (self.floor, met.above_floor_m) {
            throttle *= (1.0 - from_images(drone, height_m)).sqrt();
        }
        if let (true, Some(gap_m)) = (self.ceiling, met.below_ceiling_m) {
            // Sinks above: the disc's inflow is fed from the side, and its pressure falls.
            throttle *= (1.0 - 0.9 * from_images(drone, gap_m + 0.1 * drone.propeller_m)).sqrt();
        }
        throttle * met.battery.powf(-self.battery)
    }
}

/// Upwash of the mirror images of four rotors over the induced speed: each image is a disc of
/// sources (its axis exactly, beside it as a point).
fn from_images(drone: &Drone, height_m: f64) -> f64 {
    let radius_m = 0.5 * drone.propeller_m;
    let away_m = 2.0 * height_m.max(0.25 * radius_m);
    let own = 0.5 * (1.0 - away_m / away_m.hypot(radius_m));
    let side_m = drone.motors_m / 2f64.sqrt();
    let others: f64 = [side_m, side_m, drone.motors_m]
        .iter()
        .map(|beside_m| 0.25 * radius_m * radius_m * away_m / away_m.hypot(*beside_m).powi(3))
        .sum();
    (own + others).min(0.6)
}
