//! A straight line through weighted pairs, by least squares.

/// Weighted sums of pairs `(x, y)`, from which the line `y = c x + d` follows.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Line {
    w: f64,
    x: f64,
    xx: f64,
    y: f64,
    xy: f64,
}

impl Line {
    /// Adds a pair with a weight (1/variance of `y`).
    pub(crate) fn add(&mut self, weight: f64, x: f64, y: f64) {
        self.w += weight;
        self.x += weight * x;
        self.xx += weight * x * x;
        self.y += weight * y;
        self.xy += weight * x * y;
    }

    /// Slope c and constant d; `None` where the square of x beside a constant is less than a share
    /// of its own.
    pub(crate) fn fit(&self, least_share: f64) -> Option<(f64, f64)> {
        let determinant = self.w * self.xx - self.x * self.x;
        (determinant > least_share * self.w * self.xx).then(|| {
            let slope = (self.w * self.xy - self.x * self.y) / determinant;
            (slope, (self.y - slope * self.x) / self.w)
        })
    }

    /// Slope of the line through the origin.
    pub(crate) fn proportion(&self) -> f64 {
        self.xy / self.xx
    }

    /// Mean of y.
    pub(crate) fn mean(&self) -> f64 {
        self.y / self.w
    }

    /// Sum of squares that a line takes off that of y.
    pub(crate) fn taken(&self, (slope, constant): (f64, f64)) -> f64 {
        slope * self.xy + constant * self.y
    }
}
