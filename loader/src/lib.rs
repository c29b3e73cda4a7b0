//! What command and Python package read from disk alike: files up to an end, recordings at paths.
//!
//! The libraries below read no files; this crate finds them, and says which it left out.

pub mod files;
pub mod recordings;
