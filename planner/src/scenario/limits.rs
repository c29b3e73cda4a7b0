//! What each number may be. The bounds keep out slips of the hand and wrong units, not ambition:
//! all are chosen here, for the reason beside each.

use nalgebra::Vector3;

/// The range of one quantity.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Lowest allowed value.
    pub low: f64,
    /// Highest allowed value.
    pub high: f64,
    /// What follows the number in messages.
    pub unit: &'static str,
}

impl Limits {
    /// Whether a value is finite and within.
    pub fn contain(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// What keeps a text from being a name, in words; `None`: it is one.
pub(crate) fn name_fault(name: &str) -> Option<&'static str> {
    if name.trim().is_empty() {
        Some("empty")
    } else if name.chars().any(char::is_control) {
        Some("broken by a line break or another control character")
    } else if name.chars().count() > LONGEST_NAME {
        Some("longer than 100 characters")
    } else {
        None
    }
}

/// Places of a lattice in a box of this size (m).
pub(crate) fn lattice_places(size_m: Vector3<f64>, cell_m: f64) -> f64 {
    let along = |size_m: &f64| (size_m / cell_m).floor() + 1.0;
    size_m.iter().map(along).product()
}

const fn from(low: f64, high: f64, unit: &'static str) -> Limits {
    Limits { low, high, unit }
}

/// Insect-sized to cargo.
pub(super) const MASS_KG: Limits = from(0.001, 1000.0, "kg");
/// From insect-sized to a light helicopter's rotor.
pub(super) const PROPELLER_DIAMETER_M: Limits = from(0.005, 10.0, "m");
/// As for the propellers, of which it holds several.
pub(super) const MOTOR_DISTANCE_M: Limits = from(0.01, 20.0, "m");
/// One propeller has no motor distance; beyond 16 none has been built.
pub(super) const PROPELLERS: Limits = from(2.0, 16.0, "");
/// The paper's canted drones are within 15 % of 1; twice or half is another jet.
pub(super) const WIDTH_FACTOR: Limits = from(0.5, 2.0, "");
/// A ball that small has no drone in it; one that large fills a hall.
pub(super) const BODY_RADIUS_M: Limits = from(0.005, 20.0, "m");
/// Multirotors at walking pace to racing; slower is a unit mistaken.
pub(super) const MAX_SPEED_MPS: Limits = from(0.01, 50.0, "m/s");
/// As for the highest speed, of which it is a part.
pub(super) const VERTICAL_SPEED_MPS: Limits = MAX_SPEED_MPS;
/// A tenth of a metre per second squared is drifting; racing drones reach a hundred.
pub(super) const MAX_ACCELERATION_MPS2: Limits = from(0.1, 100.0, "m/s2");
/// From slower than any autopilot's setting to steps of the command.
pub(super) const MAX_JERK_MPS3: Limits = from(0.1, 10_000.0, "m/s3");
/// From full speed to rest and back, smoothly: chosen here, beyond that a hall is too small.
pub(crate) const STOP_S: Limits = from(0.0, 10.0, "s");
/// Being early or late: beyond half a minute two flights have nothing to do with one another.
pub(super) const TIME_MARGIN_S: Limits = from(0.0, 30.0, "s");
/// A tracking error; as for the clearance.
pub(super) const TRACKING_M: Limits = CLEARANCE_M;
/// Coordinates: a site, in its own frame, not a map in UTM metres.
pub const PLACE_M: Limits = from(-10_000.0, 10_000.0, "m");
/// Up to where east has a meaning, as for exports.
pub(super) const LATITUDE_DEG: Limits = from(-85.0, 85.0, "deg");
/// All around.
pub(super) const LONGITUDE_DEG: Limits = from(-180.0, 180.0, "deg");
/// From below the Dead Sea to the top of Everest.
pub(super) const ALTITUDE_M: Limits = from(-500.0, 9_000.0, "m");
/// All around, either way.
pub(super) const HEADING_DEG: Limits = from(-360.0, 360.0, "deg");
/// Size of a solid.
pub(super) const SIZE_M: Limits = from(0.001, 20_000.0, "m");
/// A dwell of at most a day.
pub const DWELL_S: Limits = from(0.0, 86_400.0, "s");
/// How far a drone may be behind its plan: a day, as for a dwell.
pub const DELAY_S: Limits = DWELL_S;
/// A time of the plan at which a drone has to be somewhere: a day, as for a dwell.
pub(super) const DURING_S: Limits = DWELL_S;
/// What all tasks of a drone take at least, dwells and straight flights together: a year. Ticks
/// count to 2³² hundredths of a second, 1.3 years; the rest is for detours and waits.
pub const BUSY_S: Limits = from(0.0, 3.2e7, "s");
/// What a load may weigh by itself; the airframe sets a narrower limit.
pub const LOAD_KG: Limits = from(0.0, 1000.0, "kg");
/// From a thousandth (no drone may be below another) to twice the own induced velocity, where
/// hovering costs 2.4 times the power (β(2) = 1 + √2).
pub(super) const AIR_LIMIT: Limits = from(0.001, 2.0, "times its induced velocity");
/// Still air to a strong breeze's mean.
pub(super) const ZONE_AIR_LIMIT_MPS: Limits = from(0.01, 50.0, "m/s");
/// Weather stations have read -89 and +57 °C.
pub(super) const TEMPERATURE_C: Limits = from(-90.0, 60.0, "deg C");
/// From the top of Everest (33 700 Pa, rounded down) to the highest reading at sea level (108 400
/// Pa, rounded up).
pub(super) const PRESSURE_PA: Limits = from(30_000.0, 110_000.0, "Pa");
/// Speed of the air that carries a wake down over the centreline's: large eddies have 0.5 to 0.65,
/// nothing in the jet is faster than its centreline in the mean.
pub(super) const CONVECTION: Limits = from(0.1, 4.0, "times the centreline's speed");
/// A jet's decay constant: the paper's is 10; a hundredth or ten times that is a slip or another
/// unit.
pub(super) const CENTRELINE: Limits = from(0.1, 100.0, "");
/// A jet's spreading rate: the paper's is 0.077, round jets have 0.094 to 0.102 (Pope, Turbulent
/// Flows, 2000, table 5.1); the range leaves room for walls and swirl.
pub(super) const SPREADING: Limits = from(0.005, 1.0, "");
/// A jet's virtual origin: above the rotors, where `airflow` needs it; the paper's is -5.8.
pub(super) const ORIGIN: Limits = from(-100.0, -0.01, "motor distances below the rotors");
/// A number of readings or a part of one kind or another that a file merely reports.
pub(super) const ANY: Limits = from(-1e12, 1e12, "");
/// Below 1 cm no lattice is meant; above 100 m no building is.
pub(super) const CELL_M: Limits = from(0.01, 100.0, "m");
/// A gap; more than 10 m is a mistake.
pub(super) const CLEARANCE_M: Limits = from(0.0, 10.0, "m");
/// 0 ignores energy; 1000 s of delay for one second's energy is already absurd.
pub(super) const ENERGY_WEIGHT: Limits = from(0.0, 1000.0, "");

/// Most places in the roadmap's lattice: its 26 edges each, at 16 bytes, are then 0.8 GB.
pub(super) const MOST_LATTICE_PLACES: f64 = 2e6;
/// Most items of a list, as drones, obstacles, zones, or the tasks of a drone: twice the largest
/// fleet that was planned.
pub(super) const MOST_ITEMS: usize = 20_000;
/// Most triangles of a mesh, and vertices: chosen here, a building in detail.
pub(super) const MOST_TRIANGLES: usize = 500_000;
/// Most characters of a name: it has to fit a table.
pub(super) const LONGEST_NAME: usize = 100;
