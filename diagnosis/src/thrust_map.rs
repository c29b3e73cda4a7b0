//! From duty cycle and battery voltage to thrust, identified before any air is judged.

/// Thrust of one motor as a polynomial of duty cycle and battery voltage.
#[derive(Clone, Debug, PartialEq)]
pub struct ThrustMap {}
