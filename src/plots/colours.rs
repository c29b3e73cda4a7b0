//! The one palette, and colour maps that keep their order in grey print and for any common colour
//! vision, in even steps.

use std::fmt;

/// Text and axes.
pub(super) const INK: Colour = Colour(0x1f2933);
/// Second to the ink.
pub(super) const SOFT: Colour = Colour(0x52606d);
/// Grid lines, places without samples.
pub(super) const FAINT: Colour = Colour(0xdde1e6);
/// The sheet itself.
pub(super) const PAPER: Colour = Colour(0xfcfcfa);
/// The ground of a room.
pub(super) const WHITE: Colour = Colour(0xffffff);
/// Wakes.
pub(super) const AIR: Colour = Colour(0x2b7bba);
/// The worst air of a plan.
pub(super) const WORST: Colour = Colour(0xb3243b);
/// Solids, and their edges.
pub(super) const SOLID: Colour = Colour(0xc3cad2);
pub(super) const SOLID_EDGE: Colour = Colour(0x7b8794);
/// Zones with an air limit.
pub(super) const ZONE: Colour = Colour(0xe8a33d);
/// Edges and names of such zones.
pub(super) const ZONE_EDGE: Colour = Colour(0x8a5a10);

/// Lines and marks of several drones, told apart by shape or dashes as well: Paul Tol's "muted"
/// (personal.sron.nl/~pault), the seven that stand out most on a light sheet.
pub(super) const SERIES: [Colour; 7] = [
    Colour(0x332288),
    Colour(0x117733),
    Colour(0x882255),
    Colour(0xcc6677),
    Colour(0x999933),
    Colour(0x44aa99),
    Colour(0xaa4499),
];

/// The colour of the marks and lines of one series, by its number.
pub(super) fn series_colour(series: usize) -> Colour {
    SERIES[series % SERIES.len()]
}

/// "viridis" of S. van der Walt and N. Smith (matplotlib 1.5, 2015, CC0) at 0, 0.1, ... 1: dark is
/// slow, light is fast, perceived lightness rises evenly.
const VIRIDIS: [u32; 11] = [
    0x440154, 0x482576, 0x414487, 0x35608d, 0x2a788e, 0x21908c, 0x22a884, 0x43bf71, 0x7ad151,
    0xbbdf27, 0xfde725,
];

/// "RdBu" of C. Brewer (colorbrewer2.org, 11 classes, marked as safe for colour-blind readers),
/// turned round: blue is below, red is above, white is none.
const BLUE_TO_RED: [u32; 11] = [
    0x053061, 0x2166ac, 0x4393c3, 0x92c5de, 0xd1e5f0, 0xf7f7f7, 0xfddbc7, 0xf4a582, 0xd6604d,
    0xb2182b, 0x67001f,
];

/// An sRGB colour, `0xrrggbb`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Colour(pub(super) u32);

impl fmt::Display for Colour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:06x}", self.0)
    }
}

impl Colour {
    /// Between this colour (0) and another (1), channel by channel.
    pub(super) fn towards(self, other: Colour, part: f64) -> Colour {
        let channel = |colour: Colour, shift: u32| f64::from((colour.0 >> shift) & 0xff);
        let mixed = |shift| {
            let from = channel(self, shift);
            ((from + part * (channel(other, shift) - from)).round() as u32) << shift
        };
        Colour(mixed(16) | mixed(8) | mixed(0))
    }
}

/// A colour scale in even steps between two values.
#[derive(Clone, Debug)]
pub(super) struct Scale {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) steps: usize,
    colours: &'static [u32; 11],
}

impl Scale {
    /// From 0 to a round value at or above `largest`: for speeds.
    pub(super) fn of_speeds(largest: f64) -> Scale {
        // Chosen here: about a dozen steps are still told apart.
        let step = round_step(largest / 14.0);
        let steps = (largest / step).ceil().max(1.0);
        Scale {
            low: 0.0,
            high: steps * step,
            steps: steps as usize,
            colours: &VIRIDIS,
        }
    }

    /// Symmetric around 0, with an odd number of steps so that the middle one holds it: for
    /// residuals.
    pub(super) fn of_residuals(largest: f64) -> Scale {
        let step = round_step(largest / 5.0);
        Scale {
            low: -5.5 * step,
            high: 5.5 * step,
            steps: 11,
            colours: &BLUE_TO_RED,
        }
    }

    /// The step that a value falls into; what is beyond an end takes the end's.
    pub(super) fn step_of(&self, value: f64) -> usize {
        let part = (value - self.low) / (self.high - self.low);
        ((part * self.steps as f64).floor().max(0.0) as usize).min(self.steps - 1)
    }

    /// The colour of a step, counted from 0.
    pub(super) fn colour(&self, step: usize) -> Colour {
        let last = self.colours.len() - 1;
        let place = match self.steps {
            1 => 0.5,
            steps => step as f64 / (steps - 1) as f64,
        } * last as f64;
        let below = (place.floor() as usize).min(last - 1);
        Colour(self.colours[below]).towards(Colour(self.colours[below + 1]), place - below as f64)
    }

    /// Lower edge of a step.
    pub(super) fn edge(&self, step: usize) -> f64 {
        self.low + (self.high - self.low) * step as f64 / self.steps as f64
    }
}

/// The next of 1, 2, 2.5, 5, 10 ... at or above a value.
pub(super) fn round_step(value: f64) -> f64 {
    if !(value.is_finite() && value > 0.0) {
        return 0.1;
    }
    let power = 10.0_f64.powf(value.log10().floor());
    let digits = value / power;
    let round = [1.0, 2.0, 2.5, 5.0]
        .into_iter()
        .find(|step| *step >= digits - 1e-9);
    round.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of sRGB (IEC 61966-2-1), which grey print keeps.
    fn luminance(Colour(rgb): Colour) -> f64 {
        let linear = |shift: u32| {
            let part = f64::from((rgb >> shift) & 0xff) / 255.0;
            if part <= 0.04045 {
                part / 12.92
            } else {
                ((part + 0.055) / 1.055).powf(2.4)
            }
        };
        0.2126 * linear(16) + 0.7152 * linear(8) + 0.0722 * linear(0)
    }

    #[test]
    fn faster_air_is_lighter_in_every_step() {
        let scale = Scale::of_speeds(1.27);
        assert!(scale.high >= 1.27 && scale.steps <= 14, "{scale:?}");
        for step in 1..scale.steps {
            assert!(luminance(scale.colour(step)) > luminance(scale.colour(step - 1)));
        }
    }

    #[test]
    fn no_residual_is_the_middle_step_of_a_symmetric_scale() {
        let scale = Scale::of_residuals(0.37);
        assert_eq!((scale.low, scale.step_of(0.0)), (-scale.high, 5));
        assert!(scale.high >= 0.37);
        assert_eq!(scale.step_of(f64::MAX), 10);
        assert_eq!(scale.colour(5), Colour(0xf7f7f7));
    }
}
