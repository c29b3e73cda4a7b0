//! Numbers, places and findings as people read them.

use std::path::PathBuf;

use diagnosis::forward::simulate::Channel;
use nalgebra::Point3;

pub(crate) use tools::table::{cell, count, figures, first_few, joined};

/// Fleets up to this size are listed whole: chosen here, it fits on a screen or two.
pub(crate) const LIST_ALL_UP_TO: usize = 40;
/// How many of a larger fleet are listed: chosen here.
pub(crate) const LIST_MOST: usize = 15;

/// `(5, 6.25, 1)`: metres to the centimetre, without idle zeros.
pub(crate) fn place(point: &Point3<f64>) -> String {
    let [x, y, z] = [point.x, point.y, point.z].map(decimal);
    format!("({x}, {y}, {z})")
}

/// To two decimals, without idle zeros and never `-0`.
pub(crate) fn decimal(value: f64) -> String {
    shortest(value, 2)
}

/// To so many decimals, without idle zeros and never `-0`.
pub(crate) fn shortest(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.to_owned()
}

/// What a channel is called.
pub(crate) struct ChannelWords {
    /// On screen, with its unit.
    pub(crate) quantity: &'static str,
    /// Its unit alone.
    pub(crate) unit: &'static str,
    /// In names of files and on the command line.
    pub(crate) file_stem: &'static str,
    /// What the columns of its table end in.
    pub(crate) suffix: &'static str,
}

pub(crate) fn channel_words(channel: Channel) -> ChannelWords {
    let [quantity, unit, file_stem, suffix] = match channel {
        Channel::Speed => ["speed (m/s)", "m/s", "speed", "mps"],
        Channel::Throttle => ["throttle over hover", "of hover", "throttle", "over_hover"],
        Channel::Power => ["power over hover", "of hover", "power", "over_hover"],
        Channel::VerticalForce => ["vertical force (N)", "N", "vertical-force", "n"],
    };
    ChannelWords {
        quantity,
        unit,
        file_stem,
        suffix,
    }
}

/// Kinds of what is counted, each once, with how many there are of it, in the order in which they
/// come.
pub(crate) fn tally<T: PartialEq>(all: impl IntoIterator<Item = T>) -> Vec<(T, usize)> {
    let mut kinds: Vec<(T, usize)> = Vec::new();
    for one in all {
        match kinds.iter_mut().find(|(kind, _)| *kind == one) {
            Some((_, number)) => *number += 1,
            None => kinds.push((one, 1)),
        }
    }
    kinds
}

/// Each once, joined by commas, in the order in which they come.
pub(crate) fn each_once<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    joined(tally(names).into_iter().map(|(name, _)| name), ", ")
}

/// Text as XML and HTML have it.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            // XML 1.0 has no other control characters.
            control if control.is_control() => escaped.push(' '),
            other => escaped.push(other),
        }
    }
    escaped
}

/// The last line of a report: what was written, the folder once.
pub(crate) fn wrote(files: &[PathBuf]) -> String {
    let Some((first, others)) = files.split_first() else {
        return String::new();
    };
    let names = others.iter().filter_map(|path| path.file_name());
    let names: String = names
        .map(|name| format!("  {}", name.to_string_lossy()))
        .collect();
    format!("\nwrote {}{names}\n", first.display())
}

/// Below what names it.
pub(crate) const ALPHA: &str = "note: alpha is the mean downwash over a drone's rotor discs divided by its own induced velocity at hover";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_lose_idle_zeros_and_the_minus_of_nothing() {
        let words: Vec<String> = [1.0, 0.5, -0.001, -2.25, 10.0].map(decimal).into();
        assert_eq!(words, ["1", "0.5", "0", "-2.25", "10"]);
    }
}
