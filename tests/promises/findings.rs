//! What a diagnosis found is flown: in the search's bounds, in the verifier, in what is written;
//! and what cannot be is refused in words.

mod advected;
mod command;
mod corrected_air;
mod exposed;
mod reading;

use airflow::effects::{Crossflow, Effects, PayloadMass, WakeTilt};

fn wind(x_mps: f64, y_mps: f64) -> Effects {
    Effects {
        crossflow: Some(Crossflow {
            wind_mps: [x_mps, y_mps],
        }),
        ..Effects::default()
    }
}

fn heavier(mass_factor: f64) -> Effects {
    Effects {
        payload_mass: Some(PayloadMass::always(mass_factor)),
        ..Effects::default()
    }
}

fn tilt(x: f64, y: f64) -> Effects {
    Effects {
        wake_tilt: Some(WakeTilt { tilt: [x, y] }),
        ..Effects::default()
    }
}
