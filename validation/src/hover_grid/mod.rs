//! One flight as the paper flew them: a drone hovers for some seconds at each point of a grid above
//! a fixed anemometer.

mod flight;
pub mod set;
mod true_jet;

use diagnosis::record::recording::Recording;
use diagnosis::record::{Air, Airframe, NoSuchAirframe};
use nalgebra::Point3;

pub use true_jet::{TrueJet, TrueProfile};

/// A synthetic grid flight. Every number may be changed before it is flown.
#[derive(Clone, Debug)]
pub struct HoverGrid {
    /// The drone.
    pub airframe: Airframe,
    /// The mean air below it.
    pub jet: TrueJet,
    /// Depths of the probe below the rotors, over the motor distance.
    pub depths_over_l: Vec<f64>,
    /// Distances of the axis from the probe, over the motor distance, along a line whose direction
    /// is drawn for every flight.
    pub offsets_over_l: Vec<f64>,
    /// Whether the line goes along the body's y axis (for near-field profiles) instead of any
    /// direction.
    pub along_body_y: bool,
    /// Where the probes stand (m).
    pub probes_m: Vec<Point3<f64>>,
    /// Hover at each point (s); the paper's 5.
    pub dwell_s: f64,
    /// Readings a second; the paper's probe: 1.
    pub rate_hz: f64,
    /// Rows of the track a second.
    pub track_hz: f64,
    /// Standard deviation of the axial speed over the local mean. What a slow probe sees of a
    /// turbulence of 0.25 on the axis.
    pub turbulence: f64,
    /// Memory of that (s).
    pub memory_s: f64,
    /// Standard deviation of each of the two lateral speeds over the local mean, faster than the
    /// probe: it reads them in quadrature, so they raise what it reads. 0 unless wanted: the mean
    /// jet is then what a speed probe reads.
    pub lateral_turbulence: f64,
    /// How far the drone strays around each point (m, standard deviation per axis); the track
    /// knows.
    pub jitter_m: f64,
    /// Range of the ambient speed (m/s), one draw a flight.
    pub ambient_mps: (f64, f64),
    /// Plus or minus what the gain of the probe may be off, one draw a flight; the paper's probe:
    /// 0.05.
    pub accuracy_rel: f64,
    /// Plus or minus what its zero may be off (m/s), one draw a flight; the paper's probe: 0.03.
    pub accuracy_abs_mps: f64,
    /// Step of a reading (m/s).
    pub resolution_mps: f64,
    /// The weather.
    pub air: Air,
}

/// Greatest height of the rotors above the probe in the paper's hall (m): 7 m high, the probe at 2
/// m.
const MOST_DEPTH_M: f64 = 4.5;
/// Where the paper's deepest data lie (`s/l`).
const DEEPEST_OVER_L: f64 = 24.0;
/// Greatest depth flown (m) under small drones: 12 motor distances of an Offboard.
const MOST_DEPTH_SMALL_M: f64 = 3.0;

impl HoverGrid {
    /// The paper's kind of flight for one of its drones: seven depths from 2.6 l to where its hall
    /// or its interest ends, thirteen offsets to 1.5 half-widths of the deepest; eight minutes at
    /// one reading a second.
    ///
    /// # Errors
    /// No preset has that name.
    pub fn over_one_probe(airframe: &str) -> Result<HoverGrid, NoSuchAirframe> {
        let airframe = Airframe::named(airframe)?;
        let l_m = airframe.motor_distance_m();
        let most_m = if l_m > 0.5 {
            MOST_DEPTH_M
        } else {
            MOST_DEPTH_SMALL_M
        };
        let deepest = (most_m / l_m).min(DEEPEST_OVER_L);
        let jet = TrueJet {
            width_factor: airframe.width_factor(),
            ..TrueJet::default()
        };
        let shallowest = 2.6_f64;
        let depths = (0..7).map(|i| shallowest * (deepest / shallowest).powf(f64::from(i) / 6.0));
        let widest = 1.5 * jet.spreading * (deepest - jet.origin);
        Ok(HoverGrid {
            airframe,
            jet,
            depths_over_l: depths.collect(),
            offsets_over_l: (-6..=6).map(|i| widest * f64::from(i) / 6.0).collect(),
            along_body_y: false,
            probes_m: vec![Point3::new(0.0, 0.0, 2.0)],
            dwell_s: 5.0,
            rate_hz: 1.0,
            track_hz: 4.0,
            turbulence: 0.12,
            memory_s: 1.5,
            lateral_turbulence: 0.0,
            jitter_m: 0.01,
            ambient_mps: (0.06, 0.12),
            accuracy_rel: 0.05,
            accuracy_abs_mps: 0.03,
            resolution_mps: 0.01,
            air: Air::default(),
        })
    }

    /// Profiles along the body's y axis from 0.4 to 2.4 motor distances: what the near field's
    /// lobes are measured on.
    ///
    /// # Errors
    /// No preset has that name.
    pub fn near_field(airframe: &str) -> Result<HoverGrid, NoSuchAirframe> {
        let mut grid = HoverGrid::over_one_probe(airframe)?;
        grid.along_body_y = true;
        grid.depths_over_l = (0..9).map(|i| 0.4 + 0.25 * f64::from(i)).collect();
        grid.offsets_over_l = (-10..=10).map(|i| 0.08 * f64::from(i)).collect();
        grid.jitter_m = 0.005;
        Ok(grid)
    }

    /// Flies it: the same seed gives the same recording, byte for byte.
    #[must_use]
    pub fn fly(&self, seed: u64) -> Recording {
        flight::fly(self, seed)
    }
}
