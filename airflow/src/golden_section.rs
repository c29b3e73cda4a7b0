//! The least value of a function of one number, for the crates above this one.

/// Two places within an interval that closes in on a minimum, and the function there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoldenSection {
    /// Lower end of what is left of the interval, in the unit of its ends.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// The lower place and its value.
    pub left: (f64, f64),
    /// The upper place and its value.
    pub right: (f64, f64),
}

impl GoldenSection {
    /// Closes in on the minimum of a function that falls, then rises, between two ends (Kiefer
    /// 1953, Proc. Amer. Math. Soc. 4:502), to `0.618^sections` of their distance; each section
    /// asks once. Of equal values the lower place counts.
    #[must_use]
    pub fn of([low, high]: [f64; 2], sections: usize, mut f: impl FnMut(f64) -> f64) -> Self {
        let section = 0.5 * (5.0_f64.sqrt() - 1.0);
        let mut at = |x: f64| (x, f(x));
        let (mut low, mut high) = (low, high);
        let mut left = at(high - section * (high - low));
        let mut right = at(low + section * (high - low));
        for _ in 0..sections {
            if left.1 <= right.1 {
                (high, right) = (right.0, left);
                left = at(high - section * (high - low));
            } else {
                (low, left) = (left.0, right);
                right = at(low + section * (high - low));
            }
        }
        Self {
            low,
            high,
            left,
            right,
        }
    }

    /// The middle of what is left of the interval.
    #[must_use]
    pub fn middle(&self) -> f64 {
        0.5 * (self.low + self.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_minimum_of_a_parabola_is_found_to_the_length_that_is_left() {
        let found = GoldenSection::of([-3.0, 5.0], 30, |x| (x - 1.25) * (x - 1.25));
        // 0.618^30 of 8.
        assert!((found.middle() - 1.25).abs() < 5e-6, "{found:?}");
        assert!(found.left.0 >= found.low && found.right.0 <= found.high);
    }
}
