//! A violation as a sentence.

use std::fmt;

use crate::plan::{Violation, ViolationKind};

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let who = format!("`{}`", self.drone);
        let with = self.with.as_deref().unwrap_or("?");
        let at = format!(
            "({:.2}, {:.2}, {:.2})",
            self.position_m.x, self.position_m.y, self.position_m.z
        );
        let when = match self.until_s {
            Some(until_s) if until_s - self.from_s < 0.005 => format!("at {:.2} s", self.from_s),
            Some(until_s) => format!("from {:.2} s to {until_s:.2} s", self.from_s),
            None => format!("from {:.2} s on", self.from_s),
        };
        let (value, limit) = (self.value, self.limit);
        match self.kind {
            ViolationKind::Malformed => write!(f, "{who}: {with}"),
            ViolationKind::Jump => write!(
                f,
                "{who} is in two places {value:.3} m apart {when}, at {at}"
            ),
            ViolationKind::Speed => write!(
                f,
                "{who} flies {value:.3} m/s {when}, at {at}; its highest speed is {limit:.3} m/s"
            ),
            ViolationKind::Bounds => write!(
                f,
                "{who} is {value:.3} m outside the bounds {when}, at {at}"
            ),
            ViolationKind::Obstacle => write!(
                f,
                "{who} is {:.3} m inside obstacle `{with}` {when}, at {at}",
                -value
            ),
            ViolationKind::Collision => write!(
                f,
                "{who} and `{with}` overlap by {:.3} m {when}, at {at}",
                -value
            ),
            ViolationKind::Column => write!(
                f,
                "{who} is in the near-field column of `{with}` {when}: at {at} it is {value:.2} m off its axis, less than {limit:.2} m"
            ),
            ViolationKind::Air => write!(
                f,
                "{who} meets {value:.3} of its induced velocity {when}, at {at}, most of it from `{with}`; its limit is {limit:.3}"
            ),
            ViolationKind::Zone => write!(
                f,
                "zone `{with}` has {value:.2} m/s of air {when}, most of it from {who} at {at}; its limit is {limit:.2} m/s"
            ),
        }
    }
}
