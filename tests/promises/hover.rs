//! The drones that the promises about air speak of, hovering in the air of the paper's table.

use airflow::{Airframe, Jet, Wake};

/// The air behind the paper's table (kg/m³), 20 °C at sea level.
pub(crate) const DENSITY_KG_PER_M3: f64 = 1.204;

/// An airframe that has a name.
pub(crate) fn airframe(name: &str) -> Airframe {
    Airframe::preset(name).expect("a preset")
}

/// Its wake at its own mass in that air, with the paper's jet.
pub(crate) fn wake(name: &str) -> Wake {
    let airframe = airframe(name);
    Wake::new(
        &airframe,
        airframe.mass_kg(),
        DENSITY_KG_PER_M3,
        &Jet::default(),
    )
}
