//! What the project promises, one module per promise, through its public face.

mod commands;
mod paper;
