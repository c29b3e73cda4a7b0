//! The synthetic world: its own jets and what else moves its air, its own instruments, its own
//! flights.
//!
//! It shares no code with `airflow` and sees nothing of this crate but random draws: a diagnosis
//! that finds an effect injected here has not met its own formulas again. Where a mechanism has
//! several forms, another one stands here: parcels that are let go and sink for transport,
//! entraining slices for a bent jet, an average over places for a wandering axis, discs of image
//! sources for floor and ceiling, flat-topped lobes for the near field, an edge that comes and goes
//! for the outer edge.

mod air;
mod bent;
mod carried;
mod draughts;
mod floor;
mod instrument;
mod jet;
mod lobes;
mod noise;
mod rotor;
mod route;

pub(crate) use air::{Air, Emitter, Load, Summing, World};
pub(crate) use bent::stability;
pub(crate) use draughts::{Flap, Panel, Room, Shelf, Vent, Wall};
pub(crate) use instrument::{Faults, Instrument, Odd, Readings};
pub(crate) use jet::{Drone, GRAVITY, KOLIBRI, MATRICE, OFFBOARD_1, OFFBOARD_2, density};
pub(crate) use noise::{Noise, Seen, detectable};
pub(crate) use rotor::{Answer, ReceiverConditions};
pub(crate) use route::Route;
