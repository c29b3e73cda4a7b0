//! What a simulation adds to its baseline: effects of the air, faults of the sensor.

use airflow::effects::Effects;
use serde::{Deserialize, Serialize};

/// Most by which clocks of drones and sensors may differ (s), in either direction. Chosen here:
/// clocks that were set by hand.
pub(crate) const CLOCK_RANGE_S: f64 = 4.0;

/// What is assumed beyond the baseline. The default assumes nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    /// Of the air and of the receivers.
    pub effects: Effects,
    /// Of the instruments.
    pub sensor: Sensor,
    /// Wakes that the baseline leaves out because there every drone flies alone: their speed over
    /// that of the hover jet. `None`: as the baseline has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub downwash: Option<f64>,
}

/// A fault of the instruments, on top of what their makers allow.
///
/// ```text
/// y = min( (1 + gain + drift_g t) L[x] + offset + drift_o t, saturation ),   t in hours since the first sample
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensor {
    /// Relative; of a speed or a throttle.
    #[serde(skip_serializing_if = "is_zero")]
    pub gain: f64,
    /// Of a speed (m/s), or of a throttle ratio.
    #[serde(skip_serializing_if = "is_zero")]
    pub offset: f64,
    /// Growth of the gain (1/h).
    #[serde(skip_serializing_if = "is_zero")]
    pub gain_drift_per_h: f64,
    /// Growth of the offset (m/s or 1, per hour).
    #[serde(skip_serializing_if = "is_zero")]
    pub offset_drift_per_h: f64,
    /// Time constant (s) beside the one in the metadata; 0: none.
    #[serde(skip_serializing_if = "is_zero")]
    pub lag_s: f64,
    /// Highest reading; infinity, and left out in files: none.
    #[serde(skip_serializing_if = "is_unbounded")]
    pub saturation: f64,
    /// The drones' clock is ahead of the sensors' by so much (s).
    #[serde(skip_serializing_if = "is_zero")]
    pub clock_s: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

fn is_unbounded(value: &f64) -> bool {
    value.is_infinite()
}

impl Default for Sensor {
    fn default() -> Sensor {
        Sensor {
            gain: 0.0,
            offset: 0.0,
            gain_drift_per_h: 0.0,
            offset_drift_per_h: 0.0,
            lag_s: 0.0,
            saturation: f64::INFINITY,
            clock_s: 0.0,
        }
    }
}

impl Sensor {
    /// What it makes of a value so many seconds after the first sample.
    #[must_use]
    pub fn reads(&self, value: f64, since_s: f64) -> f64 {
        let hours = since_s / 3600.0;
        let gain = 1.0 + self.gain + self.gain_drift_per_h * hours;
        (gain * value + self.offset + self.offset_drift_per_h * hours).min(self.saturation)
    }
}
