//! From the bytes of files to a [`Recording`](crate::record::recording::Recording): every fault at
//! once at its place, everything noticed as a remark.
//!
//! # In reading order
//!
//! `found`: problems and remarks as they are met. `table` and `json`: the files as such. `columns`:
//! names, units, and a table of vehicles. `samples`, `conventions`, `checks` and `track`: one
//! vehicle as logged, how that is meant, judged, and turned into the world. `plausible`: numbers
//! that cannot be meant. `declared`: the words of a baseline. Then one file a format: `folder`:
//! tables with their metadata, and `probes` of one; `campaign`: what the logs of some flights leave
//! unsaid; `log`: the kinds of logs; `flight`: one table; `series`: streams brought together;
//! `binary`: packed numbers; `crazyflie` and `usd`: its names, and its card; `ulog`: PX4;
//! `dataflash`: ArduPilot; `cdr` and `mcap`: messages of ROS 2, and bags of them; `joined`:
//! logs of several vehicles as one; `needed`: what a log without metadata asks for.

mod binary;
mod campaign;
mod cdr;
mod checks;
mod columns;
mod conventions;
mod crazyflie;
mod dataflash;
mod declared;
mod flight;
mod folder;
mod found;
mod joined;
mod json;
mod log;
mod mcap;
mod needed;
mod origin;
mod plausible;
mod probes;
mod samples;
mod series;
mod table;
mod track;
mod ulog;
mod usd;

pub use campaign::{
    Campaign, Pairs, Sourced, VehicleType, WrittenAir, WrittenForce, WrittenTerm, WrittenThrustMap,
};
pub use conventions::{Acceleration, Frame, Pitch, Turns};
pub use declared::Declared;
pub use folder::{FOLDER_FILES, read_folder};
pub use joined::{JoinedLog, read_joined};
pub use log::{LOG_FILES, LOG_HEAD_BYTES, log_name, read_log};
pub use needed::needed;
pub(crate) use probes::{FAST_MPS, STUCK_READINGS};
pub use ulog::{read_ulog_tables, table_name};
