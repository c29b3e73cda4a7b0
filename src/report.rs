//! Answers as people read them: words and numbers, tables, sections, and the page report.html.

pub(crate) mod conflicts;
pub(crate) mod flight;
pub(crate) mod page;
pub(crate) mod plan;
pub(crate) mod sections;
mod tables;
pub(crate) mod words;
