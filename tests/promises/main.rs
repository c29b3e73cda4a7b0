//! What Leeward promises, seen from outside: one module per promise.

mod commands;
