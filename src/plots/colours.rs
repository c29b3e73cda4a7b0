//! Colour maps that keep their order in grey print and for any common colour vision, in even steps.

use plotters::style::RGBColor;

/// "viridis" of S. van der Walt and N. Smith (matplotlib 1.5, 2015, CC0) at 0, 0.1, ... 1: dark is slow, light is fast, perceived
/// lightness rises evenly.
const VIRIDIS: [(u8, u8, u8); 11] = [
    (0x44, 0x01, 0x54),
    (0x48, 0x25, 0x76),
    (0x41, 0x44, 0x87),
    (0x35, 0x60, 0x8D),
    (0x2A, 0x78, 0x8E),
    (0x21, 0x90, 0x8C),
    (0x22, 0xA8, 0x84),
    (0x43, 0xBF, 0x71),
    (0x7A, 0xD1, 0x51),
    (0xBB, 0xDF, 0x27),
    (0xFD, 0xE7, 0x25),
];

/// "RdBu" of C. Brewer (colorbrewer2.org, 11 classes, marked as safe for colour-blind readers), turned round: blue is below, red is
/// above, white is none.
const BLUE_TO_RED: [(u8, u8, u8); 11] = [
    (0x05, 0x30, 0x61),
    (0x21, 0x66, 0xAC),
    (0x43, 0x93, 0xC3),
    (0x92, 0xC5, 0xDE),
    (0xD1, 0xE5, 0xF0),
    (0xF7, 0xF7, 0xF7),
    (0xFD, 0xDB, 0xC7),
    (0xF4, 0xA5, 0x82),
    (0xD6, 0x60, 0x4D),
    (0xB2, 0x18, 0x2B),
    (0x67, 0x00, 0x1F),
];

/// Lines and marks of several drones, told apart by shape as well: Paul Tol's "muted" (personal.sron.nl/~pault), the seven that
/// stand out most on a light sheet.
pub(super) const SERIES: [RGBColor; 7] = [
    RGBColor(0x33, 0x22, 0x88),
    RGBColor(0x11, 0x77, 0x33),
    RGBColor(0x88, 0x22, 0x55),
    RGBColor(0xCC, 0x66, 0x77),
    RGBColor(0x99, 0x99, 0x33),
    RGBColor(0x44, 0xAA, 0x99),
    RGBColor(0xAA, 0x44, 0x99),
];

/// A colour scale in even steps between two values.
#[derive(Clone, Debug)]
pub(super) struct Scale {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) steps: usize,
    colours: &'static [(u8, u8, u8); 11],
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

    /// Symmetric around 0, with an odd number of steps so that the middle one holds it: for residuals.
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

    pub(super) fn colour(&self, step: usize) -> RGBColor {
        let part = if self.steps > 1 {
            step as f64 / (self.steps - 1) as f64
        } else {
            0.5
        };
        let place = part * (self.colours.len() - 1) as f64;
        let below = (place.floor() as usize).min(self.colours.len() - 2);
        let share = place - below as f64;
        let ((r0, g0, b0), (r1, g1, b1)) = (self.colours[below], self.colours[below + 1]);
        let between = |from: u8, to: u8| {
            (f64::from(from) + share * (f64::from(to) - f64::from(from))).round() as u8
        };
        RGBColor(between(r0, r1), between(g0, g1), between(b0, b1))
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
    let round = [1.0, 2.0, 2.5, 5.0, 10.0]
        .into_iter()
        .find(|step| *step >= digits - 1e-9)
        .unwrap_or(10.0);
    round * power
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of sRGB (IEC 61966-2-1), which grey print keeps.
    fn luminance(RGBColor(r, g, b): RGBColor) -> f64 {
        let linear = |byte: u8| {
            let part = f64::from(byte) / 255.0;
            if part <= 0.04045 {
                part / 12.92
            } else {
                ((part + 0.055) / 1.055).powf(2.4)
            }
        };
        0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b)
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
        assert_eq!(scale.colour(5), RGBColor(0xF7, 0xF7, 0xF7));
    }
}
