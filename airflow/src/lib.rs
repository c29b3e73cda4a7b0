//! The mean airflow below hovering multirotors.

mod air;
mod airframe;
mod discs;
mod far_field;
mod field;
mod jet;
mod near_field;
pub mod power;
mod wake;

pub use air::{Air, AirError, GRAVITY_MPS2};
pub use airframe::{Airframe, AirframeError, WIDTH_FACTOR_RANGE};
pub use discs::DiscPoints;
pub use far_field::FarField;
pub use field::{
    HEIGHT_TOLERANCE_M, Source, Superposition, UnknownSuperposition, axial_speed_mps,
    mean_over_discs_mps,
};
pub use jet::{FAR_FIELD_FROM_S_OVER_L, Jet, JetError};
pub use wake::Wake;
