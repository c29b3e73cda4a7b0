//! Files, standard output and error, the clock and interrupts: all that the libraries leave to the
//! command.

pub(crate) mod answer;
pub(crate) mod failure;
pub(crate) mod files;
pub(crate) mod journal;
pub(crate) mod plans;
pub(crate) mod problems;
pub(crate) mod progress;
pub(crate) mod watch;
