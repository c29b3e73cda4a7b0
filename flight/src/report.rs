//! The results of a flight: plain data, the contents of `flight.json`, format `flight/1`.

use planner::verify::{SINK_M, TOUCH_M};
use schemars::JsonSchema;
use serde::Serialize;

use crate::controller::{Controller, Gains};
use crate::feed_forward::FeedForward;
use crate::vehicle::Vehicle;

/// The value of [`FlightReport::format`].
pub const FORMAT: &str = "flight/1";

/// A plan as it was flown.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FlightReport {
    /// `flight/1`.
    #[schemars(extend("const" = FORMAT))]
    pub format: &'static str,
    /// The plan's scenario.
    pub scenario: String,
    /// Seed of the gusts.
    pub seed: u64,
    /// Intensity of the gusts over the centreline speed; 0: none.
    pub gusts: f64,
    /// Whether air leaves along the thrust, turned about, in place of straight down.
    pub lean: bool,
    /// Flown to this time (s).
    pub until_s: f64,
    /// Drones for which the plan has no path: they stay at their starts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unplanned: Vec<String>,
    /// Every airframe as it was flown.
    pub vehicles: Vec<VehicleFlown>,
    /// Every flight; of each controller and speed of the air those with different feed-forward.
    pub flights: Vec<Flight>,
    /// The drones with the most air over their limit, without feed-forward, and each over time in
    /// every flight.
    pub worst: Vec<Traces>,
    /// Where drones really flew, for pictures; `flight.json` has it not.
    #[serde(skip)]
    pub paths: Paths,
}

/// How far a drone is from where the plan has it, along x, y and z (m), place after place; `None`:
/// it does not fly.
pub type OffPlan = Vec<Option<[f32; 3]>>;

/// Where drones flew, beside their plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Paths {
    /// Time of the first place (s).
    pub from_s: f64,
    /// Between two places (s).
    pub step_s: f64,
    /// Of each flight some drones by their index, of a small fleet all.
    pub flights: Vec<Vec<(usize, OffPlan)>>,
}

/// An airframe as it was flown.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct VehicleFlown {
    /// Its name.
    pub airframe: String,
    /// Its limits and lags.
    #[serde(flatten)]
    pub vehicle: Vehicle,
}

/// What one flight was flown with.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Case {
    /// The controller.
    pub controller: Controller,
    /// Its gains.
    pub gains: Gains,
    /// What drones know of the air.
    pub feed_forward: FeedForward,
    /// Speed of the air in wakes over that of the centreline.
    pub convection: f64,
}

/// One flight of the whole fleet.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Flight {
    /// What it was flown with.
    #[serde(flatten)]
    pub case: Case,
    /// Sums over the fleet.
    pub fleet: FleetFlight,
    /// In the plan's order.
    pub drones: Vec<DroneFlight>,
}

/// Sums over the drones of one flight.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct FleetFlight {
    /// Drones that flew.
    pub flown: usize,
    /// Drones exposed to more than their limit and 0.01 of their induced velocity.
    pub over_limit: usize,
    /// The longest that one of them was (s, in all).
    pub longest_over_limit_s: f64,
    /// Drones that would be over with air averaged over 0.24 s, and a limit higher by 0.1.
    pub over_limit_by_a_tenth: usize,
    /// Highest air over a drone's own induced velocity.
    pub worst_alpha: f64,
    /// Drones that overlap another by more than 1 mm.
    pub touching: usize,
    /// Drones in an obstacle, or in a zone that keeps bodies out, by more than 5 mm.
    pub in_obstacles: usize,
    /// Least gap between two bodies (m); absent: none came within 2 m.
    pub least_gap_m: Option<f64>,
    /// Least gap between a body and an obstacle (m); absent: none came within 2 m.
    pub least_obstacle_gap_m: Option<f64>,
    /// Largest distance from the plan (m).
    pub tracking_max_m: f64,
    /// Root mean square of that distance (m).
    pub tracking_rms_m: f64,
    /// Largest distance from the path, about the time at which the plan is there (m): what is left
    /// of the distance from the plan is along it, early or late.
    pub across_max_m: f64,
    /// Root mean square of the altitude error (m).
    pub altitude_rms_m: f64,
    /// The same of what the air alone does: altitude less that of the same flight in calm air,
    /// while alpha exceeds 0.05 (m).
    pub altitude_rms_by_air_m: f64,
    /// Largest of that (m).
    pub altitude_max_by_air_m: f64,
    /// Energy beyond that of the same flight in calm air (J, aerodynamic).
    pub extra_energy_j: f64,
}

/// One drone of one flight.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DroneFlight {
    /// The plan's name for it.
    pub name: String,
    /// Whether it flew at all.
    pub flew: bool,
    /// Highest mean air over its discs, over its induced velocity.
    pub worst_alpha: f64,
    /// When (s).
    pub worst_at_s: Option<f64>,
    /// The drone whose air contributed most.
    pub worst_from: Option<String>,
    /// Highest mean of alpha over 0.24 s.
    pub worst_mean_alpha: f64,
    /// What the plan claims as the worst; absent: it does not say.
    pub claimed_alpha: Option<f64>,
    /// Its limit.
    pub air_limit: f64,
    /// Time over its limit by more than 0.01 (s).
    pub over_limit_s: f64,
    /// Integral of the air over time (m).
    pub dose_m: f64,
    /// Largest distance from the plan at the same time (m).
    pub tracking_max_m: f64,
    /// Its root mean square (m).
    pub tracking_rms_m: f64,
    /// Largest distance from its path, up to a second before and after (m): it leads straight on
    /// where it stops.
    pub across_max_m: f64,
    /// Largest altitude error (m).
    pub altitude_max_m: f64,
    /// Its root mean square (m).
    pub altitude_rms_m: f64,
    /// The root mean square of what the air alone does to altitude, as of the fleet (m).
    pub altitude_rms_by_air_m: f64,
    /// Least gap to another body (m); absent: none came within 2 m.
    pub least_gap_m: Option<f64>,
    /// To which.
    pub least_gap_to: Option<String>,
    /// When (s).
    pub least_gap_at_s: Option<f64>,
    /// Least gap to an obstacle, or a zone that keeps bodies out (m).
    pub least_obstacle_gap_m: Option<f64>,
    /// Which.
    pub least_obstacle: Option<String>,
    /// Time at its largest tilt (s).
    pub full_tilt_s: f64,
    /// Aerodynamic energy to the plan's last time (J).
    pub energy_j: f64,
    /// Of that, what the same flight in calm air does not take (J).
    pub extra_energy_j: f64,
    /// Of a full battery (%); absent where its capacity is not known.
    pub battery_percent: Option<f64>,
}

impl DroneFlight {
    /// Whether its body overlaps another's by more than the verifier lets pass.
    #[must_use]
    pub fn touches(&self) -> bool {
        self.least_gap_m.is_some_and(|gap_m| gap_m < -TOUCH_M)
    }

    /// Whether it is in an obstacle, or a zone that keeps bodies out, by more than that.
    #[must_use]
    pub fn is_in_obstacle(&self) -> bool {
        let gap_m = self.least_obstacle_gap_m;
        gap_m.is_some_and(|gap_m| gap_m < -SINK_M)
    }
}

/// One drone over time, in every flight.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Traces {
    /// The plan's name for it.
    pub drone: String,
    /// Its limit.
    pub air_limit: f64,
    /// Time of the first value (s).
    pub from_s: f64,
    /// Between two values (s).
    pub step_s: f64,
    /// One for each flight, in their order.
    pub flights: Vec<Trace>,
}

/// One drone over time in one flight; absent values: it does not fly.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Trace {
    /// Altitude less that of the plan (m), to a tenth of a millimetre.
    pub altitude_error_m: Vec<Option<f32>>,
    /// Air over its induced velocity, to a ten-thousandth.
    pub alpha: Vec<Option<f32>>,
}

impl FlightReport {
    /// No drone over its limit, none touches another or anything, in any of the flights.
    #[must_use]
    pub fn is_within_limits(&self) -> bool {
        let is_fine = |it: &FleetFlight| it.over_limit + it.touching + it.in_obstacles == 0;
        self.flights.iter().all(|flight| is_fine(&flight.fleet))
    }
}

/// The schema of `flight.json`.
#[must_use]
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(FlightReport)
}
