//! Numbers, places and findings as people read them.

use diagnosis::forward::simulate::Channel;
use nalgebra::Point3;
use planner::plan::{Violation, ViolationKind};
pub(crate) use tools::table::{count, figures};

/// `(5, 6.25, 1)`: metres to the centimetre, without idle zeros.
pub(crate) fn place(point: &Point3<f64>) -> String {
    format!(
        "({}, {}, {})",
        metres(point.x),
        metres(point.y),
        metres(point.z)
    )
}

/// Metres to the centimetre, without idle zeros and never `-0`.
pub(crate) fn metres(length_m: f64) -> String {
    let text = format!("{length_m:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}

/// What a person calls a channel, with its unit.
pub(crate) fn quantity(channel: Channel) -> &'static str {
    match channel {
        Channel::Speed => "speed (m/s)",
        Channel::Throttle => "throttle / hover",
        Channel::Power => "power / hover",
        Channel::VerticalForce => "vertical force (N)",
    }
}

/// Its unit alone.
pub(crate) fn unit(channel: Channel) -> &'static str {
    match channel {
        Channel::Speed => "m/s",
        Channel::Throttle | Channel::Power => "of hover",
        Channel::VerticalForce => "N",
    }
}

/// What its files are called.
pub(crate) fn file_stem(channel: Channel) -> &'static str {
    match channel {
        Channel::Speed => "speed",
        Channel::Throttle => "throttle",
        Channel::Power => "power",
        Channel::VerticalForce => "vertical-force",
    }
}

/// One finding of the verifier in one line.
pub(crate) fn violation(found: &Violation) -> String {
    let Violation {
        drone,
        value,
        limit,
        unit,
        ..
    } = found;
    let other = found.with.as_deref().unwrap_or("something");
    let what = match found.kind {
        ViolationKind::Malformed => format!("`{drone}`: its entry contradicts itself"),
        ViolationKind::Jump => {
            format!("`{drone}` is in two places at once, {value:.2} {unit} apart")
        }
        ViolationKind::Speed => {
            format!("`{drone}` flies {value:.2} {unit}, its limit is {limit:.2}")
        }
        ViolationKind::Bounds => format!("`{drone}` is {value:.2} {unit} out of bounds"),
        ViolationKind::Obstacle => {
            format!(
                "`{drone}` comes within {value:.2} {unit} of obstacle `{other}`, it needs {limit:.2}"
            )
        }
        ViolationKind::Collision if *value < 0.0 => {
            format!(
                "the bodies of `{drone}` and `{other}` overlap by {:.2} {unit}",
                -value
            )
        }
        ViolationKind::Collision => {
            format!("`{drone}` comes within {value:.2} {unit} of `{other}`, they need {limit:.2}")
        }
        ViolationKind::Column => format!("`{drone}` is in the near-field column of `{other}`"),
        ViolationKind::Air => {
            let from = found
                .with
                .as_ref()
                .map(|with| format!(", mostly from `{with}`"));
            format!(
                "`{drone}` meets {value:.2} {unit} of air{}, its limit is {limit:.2}",
                from.unwrap_or_default()
            )
        }
        ViolationKind::Zone => format!(
            "`{drone}` blows {value:.2} {unit} into zone `{other}`, its limit is {limit:.2}"
        ),
    };
    let until = found
        .until_s
        .map_or("for ever".into(), |until_s| format!("to {until_s:.2} s"));
    format!(
        "{what}: from {:.2} s {until}, at {}",
        found.from_s,
        place(&found.position_m)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metres_lose_idle_zeros_and_the_minus_of_nothing() {
        let words: Vec<String> = [1.0, 0.5, -0.001, -2.25, 10.0].map(metres).into();
        assert_eq!(words, ["1", "0.5", "0", "-2.25", "10"]);
    }
}
