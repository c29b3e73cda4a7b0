//! How planning grows with the fleet: instances planned one a process, the table of their figures,
//! and the growth fitted to it.
//!
//! In reading order: [`suite`], all that is planned; [`instance`], one fleet of it and what came of
//! it; [`apart`], the process of its own; [`row`], instances that differ in their seed alone;
//! [`growth`], straight lines through the rows; [`machine`], what the figures were taken on;
//! [`table`], all of it as Markdown; [`peers`], other planners on the same instances.

pub mod apart;
pub mod growth;
pub mod instance;
pub mod machine;
pub mod peers;
pub mod row;
pub mod suite;
pub mod table;
