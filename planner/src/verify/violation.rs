//! A violation: how a check makes one, and how it reads as a sentence.

use std::fmt;

use nalgebra::Point3;

use super::extents::Span;
use super::scene::{Flight, Scene};
use crate::plan::{Violation, ViolationKind};

/// A violation with the index of its drone, by which the report is ordered.
pub(super) type IndexedViolation = (usize, Violation);

/// The worst moment of a violation.
pub(crate) struct Worst {
    /// The other party.
    pub(crate) with: Option<String>,
    /// Where the drone is (m).
    pub(crate) position_m: Point3<f64>,
    /// In the unit of the check.
    pub(crate) value: f64,
    /// In the unit of the check.
    pub(crate) limit: f64,
}

impl Scene<'_> {
    /// A violation by one flight over a span of time; open if it lasts into the rest after the last
    /// time.
    pub(crate) fn violation(
        &self,
        flight: &Flight,
        kind: ViolationKind,
        (from_s, until_s): Span,
        worst: Worst,
    ) -> IndexedViolation {
        let violation = Violation {
            kind,
            drone: flight.name.clone(),
            with: worst.with,
            from_s,
            until_s: (until_s < self.horizon_s).then_some(until_s),
            shift_s: None,
            position_m: worst.position_m,
            value: worst.value,
            is_bound: false,
            limit: worst.limit,
            unit: unit(kind).to_owned(),
        };
        (flight.index, violation)
    }
}

/// A violation of the kind `malformed`: a contradiction of the plan as a whole (drone 0), or of one
/// drone, at a time (s) and a place (m).
pub(crate) fn malformed(
    (index, drone): (usize, &str),
    why: String,
    (from_s, position_m): (f64, Point3<f64>),
) -> IndexedViolation {
    let kind = ViolationKind::Malformed;
    let violation = Violation {
        kind,
        drone: drone.to_owned(),
        with: Some(why),
        from_s,
        until_s: Some(from_s),
        shift_s: None,
        position_m,
        value: 0.0,
        is_bound: false,
        limit: 0.0,
        unit: unit(kind).to_owned(),
    };
    (index, violation)
}

/// The unit of a violation's value and limit.
fn unit(kind: ViolationKind) -> &'static str {
    match kind {
        ViolationKind::Malformed => "",
        ViolationKind::Speed
        | ViolationKind::Climb
        | ViolationKind::Descent
        | ViolationKind::Sideways
        | ViolationKind::Touchdown
        | ViolationKind::VelocityJump
        | ViolationKind::Zone
        | ViolationKind::ZoneMargin => "m/s",
        ViolationKind::Air | ViolationKind::AirMargin => "U_D/U_H",
        ViolationKind::Acceleration | ViolationKind::AccelerationJump => "m/s2",
        ViolationKind::Jerk => "m/s3",
        _ => "m",
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let who = format!("`{}`", self.drone);
        let with = self.with.as_deref().unwrap_or("?");
        let Point3 { coords: c } = self.position_m;
        let at = format!("({:.2}, {:.2}, {:.2})", c.x, c.y, c.z);
        let when = match self.until_s {
            Some(until_s) if until_s - self.from_s < 0.005 => format!("at {:.2} s", self.from_s),
            Some(until_s) => format!("from {:.2} s to {until_s:.2} s", self.from_s),
            None => format!("from {:.2} s on", self.from_s),
        };
        let (value, limit) = (self.value, self.limit);
        let inside = -value;
        let there = format!("{when}, at {at}");
        // A zone's air is measured in the zone; the place is the drone's.
        let while_there = format!("{when}, with {who} at {at}");
        let shifted = match self.shift_s {
            Some(shift_s) if shift_s >= 0.005 => {
                format!(" with `{with}` {shift_s:.2} s early against it")
            }
            Some(shift_s) if shift_s <= -0.005 => {
                format!(" with `{with}` {:.2} s late against it", -shift_s)
            }
            _ => String::new(),
        };
        f.write_str(&match self.kind {
            ViolationKind::Malformed => format!("{who} contradicts itself: {with}"),
            ViolationKind::Jump => format!("{who} is in two places {value:.3} m apart {there}"),
            ViolationKind::Speed => {
                format!("{who} flies {value:.3} m/s {there}; its limit is {limit:.3} m/s")
            }
            ViolationKind::Bounds => format!("{who} is {value:.3} m out of bounds {there}"),
            ViolationKind::Obstacle => {
                format!("{who} is {inside:.3} m inside obstacle `{with}` {there}")
            }
            ViolationKind::Collision => {
                format!("the bodies of {who} and `{with}` overlap by {inside:.3} m {there}")
            }
            ViolationKind::Column => format!(
                "{who} is in the near-field column of `{with}` {when}: at {at} it is {value:.2} m off its axis, less than {limit:.2} m"
            ),
            ViolationKind::Air => format!(
                "{who} is exposed to downwash of alpha {value:.3} {there}, mostly from `{with}`; its limit is {limit:.3}"
            ),
            ViolationKind::Climb => {
                format!("{who} climbs at {value:.3} m/s {there}; its limit is {limit:.3} m/s")
            }
            ViolationKind::Descent => {
                format!("{who} sinks at {value:.3} m/s {there}; its limit is {limit:.3} m/s")
            }
            ViolationKind::Sideways => format!(
                "{who} moves sideways at {value:.3} m/s {there}; beside its pad it goes straight up and down"
            ),
            ViolationKind::Touchdown => {
                format!("{who} sets down at {value:.3} m/s {there}; the limit is {limit:.1} m/s")
            }
            ViolationKind::VelocityJump => {
                format!("{who} changes its velocity by {value:.3} m/s in no time {there}")
            }
            ViolationKind::AccelerationJump => {
                format!("{who} changes its acceleration by {value:.3} m/s2 in no time {there}")
            }
            ViolationKind::Acceleration => format!(
                "{who} accelerates at {value:.3} m/s2 {there}; its limit is {limit:.3} m/s2"
            ),
            ViolationKind::Jerk => {
                format!("{who} jerks at {value:.3} m/s3 {there}; its limit is {limit:.3} m/s3")
            }
            ViolationKind::KeepOut => format!(
                "{who} is {value:.3} m from zone `{with}` {there}, which keeps bodies out; it must be {limit:.3} m"
            ),
            ViolationKind::ObstacleMargin => format!(
                "{who} is {value:.3} m from obstacle `{with}` {there}; its tracking margin takes {limit:.3} m"
            ),
            ViolationKind::CollisionMargin => format!(
                "{who} and `{with}` are {value:.3} m apart {there}{shifted}; their margins take {limit:.3} m"
            ),
            ViolationKind::ColumnMargin => format!(
                "{who} is in the near-field column of `{with}` {when}{shifted}: at {at} it is {value:.2} m off its axis, less than {limit:.2} m"
            ),
            ViolationKind::AirMargin => format!(
                "{who} is exposed to downwash of alpha {value:.3} {there}{shifted}, mostly from `{with}`; its limit is {limit:.3}"
            ),
            ViolationKind::Zone | ViolationKind::ZoneMargin if self.is_bound => format!(
                "whether the air in zone `{with}` stays below {limit:.2} m/s {while_there}, could not be decided; by bounds it is at most {value:.2} m/s"
            ),
            ViolationKind::ZoneMargin => format!(
                "with drones early or late the air in zone `{with}` is over {limit:.2} m/s {when}; at worst {value:.2} m/s, by {who} at {at}"
            ),
            ViolationKind::Zone => format!(
                "the air in zone `{with}` is over {limit:.2} m/s {when}; at worst {value:.2} m/s, by {who} at {at}"
            ),
        })
    }
}
