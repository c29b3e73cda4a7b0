//! What the project promises, one module per promise, through its public face.

mod hover;
mod near_field;
mod paper;
mod wakes;
