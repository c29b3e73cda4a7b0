//! From the bytes of files to a [`Recording`](crate::record::recording::Recording): every fault at
//! once at its place, everything noticed as a remark.
//!
//! # In reading order
//!
//! `found`: problems and remarks as they are met. `table` and `json`: the files as such. `columns`:
//! names, units, and a table of vehicles. `samples`, `checks` and `track`: one vehicle as logged,
//! judged, and turned into the world. `declared`: the words of a baseline. Then the formats:
//! `folder` with `meta` and `probes`; `written` and `campaign`: what the logs of a campaign leave
//! unsaid; `flight`: one table; `px4` with `topics`: flights of PX4.

mod campaign;
mod checks;
mod columns;
mod declared;
mod flight;
mod folder;
mod found;
mod json;
mod meta;
mod probes;
mod px4;
mod samples;
mod table;
mod topics;
mod track;
mod written;

pub use declared::Declared;
pub use flight::read_flight;
pub use folder::{FOLDER_FILES, read_folder};
pub use px4::{read_ulog, read_ulog_tables};
pub use topics::table_name;
pub use track::{Acceleration, Frame, Pitch, Turns};
pub use written::{
    Campaign, Finite, NotNegative, Pairs, Positive, Sourced, VehicleType, WrittenAir, WrittenClock,
    WrittenForce, WrittenTerm, WrittenThrustMap,
};
