//! Which effect a simulation leaves out: candidates, fits, selection, and the finding.
//!
//! # In reading order
//!
//! [`mod@actuation`]: what throttle and power say before any air is judged. [`mod@noise`]: how far
//! readings scatter where nothing is missing. [`candidates`]: what may be missing. [`fit`]: one
//! hypothesis fitted, bounded, and what it predicts held out. [`mod@scopes`]: what sets in
//! part-way, or is of one probe. [`mod@select`]: one effect or two, and what cannot be told apart;
//! the thresholds of selection and naming. [`intervals`]: how sure. [`mod@outside`]: the global
//! lack-of-fit test, and what no candidate explains; its thresholds. [`mod@advice`]: what to
//! measure next. [`mod@diagnose`]: all of it, from a recording to a [`finding`], and
//! [`finding_file`]: the text that a scenario cites. [`mod@noticed`]: remarks beside it.

pub mod actuation;
pub mod advice;
pub mod candidates;
pub mod diagnose;
pub mod finding;
pub mod finding_file;
pub mod fit;
pub mod intervals;
pub mod noise;
pub mod noticed;
pub mod outside;
pub mod scopes;
pub mod select;
