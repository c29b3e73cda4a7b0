//! What Leeward promises, kept through the public faces of its crates. One module for each kind of promise.

mod volumes;
