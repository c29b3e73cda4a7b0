//! What the project promises, one module per promise, through its public face.

mod endpoints;
mod verifier;
