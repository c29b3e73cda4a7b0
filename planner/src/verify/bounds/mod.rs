//! What bounds the air and the bodies: wakes, their tables, and the obstacles on which they end.

pub(crate) mod obstacles;
mod tables;
pub(crate) mod wake;

#[cfg(test)]
mod tests;
