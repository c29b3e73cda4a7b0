//! Functions of one coordinate.

/// A function of one coordinate, with its inner constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factor {
    /// Which coordinate, by its place in the list.
    pub coordinate: usize,
    /// Which function.
    pub shape: Shape,
    /// Inner constant in the coordinate's unit; 1 for a shape that has none.
    pub constant: f64,
}

/// Which function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shape {
    /// x.
    Itself,
    /// x².
    Square,
    /// √x.
    Root,
    /// 1/x.
    Inverse,
    /// exp(-x/a).
    Decay,
    /// exp(-(x/a)²).
    Bell,
    /// 1/(1 + x/a).
    Fade,
    /// 1/(1 + (x/a)²).
    Hill,
    /// cos φ.
    Cos,
    /// sin φ.
    Sin,
    /// cos 2φ.
    Cos2,
    /// sin 2φ.
    Sin2,
}

impl Shape {
    /// Of a coordinate that is no angle.
    pub(super) const OF_LENGTHS: [Shape; 8] = [
        Shape::Itself,
        Shape::Square,
        Shape::Root,
        Shape::Inverse,
        Shape::Decay,
        Shape::Bell,
        Shape::Fade,
        Shape::Hill,
    ];
    /// Of an angle.
    pub(super) const OF_ANGLES: [Shape; 4] = [Shape::Cos, Shape::Sin, Shape::Cos2, Shape::Sin2];

    /// Coordinate, function and constant that it adds to a formula's length.
    pub(super) fn length(self) -> usize {
        match self {
            Shape::Itself | Shape::Cos | Shape::Sin => 1,
            _ => 2,
        }
    }

    pub(super) fn has_constant(self) -> bool {
        matches!(self, Shape::Decay | Shape::Bell | Shape::Fade | Shape::Hill)
    }

    /// A power of the coordinate: two of the same coordinate are a third.
    pub(super) fn is_power(self) -> bool {
        matches!(
            self,
            Shape::Itself | Shape::Square | Shape::Root | Shape::Inverse
        )
    }

    /// Whether it is finite on values from `least` on (distances: from 0 up, with inverses away from 0).
    pub(super) fn allows(self, least: f64) -> bool {
        match self {
            Shape::Inverse => least > 0.0,
            Shape::Root | Shape::Decay | Shape::Fade => least >= 0.0,
            _ => true,
        }
    }
}

impl Factor {
    /// Its value.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        let scaled = x / self.constant;
        match self.shape {
            Shape::Itself => x,
            Shape::Square => x * x,
            // Of a coordinate that was never negative where it was fitted.
            Shape::Root => x.max(0.0).sqrt(),
            Shape::Inverse => 1.0 / x,
            Shape::Decay => (-scaled).exp(),
            Shape::Bell => (-scaled * scaled).exp(),
            Shape::Fade => 1.0 / (1.0 + scaled),
            Shape::Hill => 1.0 / (1.0 + scaled * scaled),
            Shape::Cos => x.cos(),
            Shape::Sin => x.sin(),
            Shape::Cos2 => (2.0 * x).cos(),
            Shape::Sin2 => (2.0 * x).sin(),
        }
    }

    /// In a formula, of a coordinate's letter.
    pub(super) fn written(&self, x: &str) -> String {
        let a = three_digits(self.constant);
        match self.shape {
            Shape::Itself => x.to_owned(),
            Shape::Square => format!("{x}^2"),
            Shape::Root => format!("sqrt({x})"),
            Shape::Inverse => format!("/ {x}"),
            Shape::Decay => format!("exp(-{x}/{a})"),
            Shape::Bell => format!("exp(-({x}/{a})^2)"),
            Shape::Fade => format!("/ (1 + {x}/{a})"),
            Shape::Hill => format!("/ (1 + ({x}/{a})^2)"),
            Shape::Cos => format!("cos({x})"),
            Shape::Sin => format!("sin({x})"),
            Shape::Cos2 => format!("cos(2 {x})"),
            Shape::Sin2 => format!("sin(2 {x})"),
        }
    }
}

/// Three significant digits, without zeros at the end.
pub(super) fn three_digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor() as i32;
    if !(-4..6).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    let decimals = usize::try_from(2 - magnitude).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}
