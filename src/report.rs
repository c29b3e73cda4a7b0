//! Answers as people read them: words, tables and the page of a report.

pub(crate) mod conflicts;
pub(crate) mod page;
pub(crate) mod plan;
pub(crate) mod well_formed;
pub(crate) mod words;
