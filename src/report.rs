//! Answers as people read them: words and numbers, tables, sections, and the page report.html.

pub(crate) mod conflicts;
pub(crate) mod flight;
pub(crate) mod page;
pub(crate) mod plan;
pub(crate) mod sections;
pub(crate) mod slice;
mod tables;
pub(crate) mod words;
