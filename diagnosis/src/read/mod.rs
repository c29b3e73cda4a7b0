//! From the bytes of files to a [`Recording`](crate::recording::Recording): every fault at once at its place, everything noticed as
//! a remark.
//!
//! # In reading order
//!
//! `found`: what reading turns up. `table` and `json`: the files as such. `columns`: names and units. `samples`, `checks` and
//! `track`: one vehicle, as logged, judged, and turned into the world. `declared`: the words of a baseline. Then the formats: `folder`
//! (`meta`, `probes`).

mod checks;
mod columns;
mod declared;
mod folder;
mod found;
mod json;
mod meta;
mod probes;
mod samples;
mod table;
mod track;

pub use declared::Declared;
pub use folder::read_folder;
