//! Where a vehicle was, from the places that a tracker logs with white noise.
//!
//! A simulation errs with its own places, and so do the columns that its residual is tested
//! against: what both have of the noise passes for a law (errors in variables), near the edge of a
//! thin jet at millimetres.
//!
//! Of parabolas over windows that grow, the widest one which agrees with all narrower ones
//! (intersection of confidence intervals: Goldenshluger & Nemirovski 1997, Math. Methods Stat.
//! 6:135; Katkovnik 1999, IEEE Trans. Signal Process. 47:2567), so that a turn is no rounder than
//! it is. White noise is read from third differences, which smooth motion hardly has (Hall, Kay &
//! Titterington 1990, Biometrika 77:521).

use nalgebra::{Matrix3, Point3, Vector3};

use crate::record::recording::Track;
use crate::statistics::quantile::{median, selected};

/// Entries to either side of the windows, as far as [`LONGEST_S`] allows. Chosen here.
const WINDOWS: [usize; 7] = [2, 3, 5, 8, 12, 20, 32];
/// Longest window (s). Of swaying at 1 Hz a parabola loses 2 % over half a second, of swaying at
/// 0.3 Hz, as hovering drones sway, two in ten thousand: `3/840 (π f · 0.5 s)⁴`.
const LONGEST_S: f64 = 0.5;
/// Standard errors to either side of an interval. Chosen here: half as wide again as the noise.
const WITHIN: f64 = 1.5;
/// Share of differences whose largest tells the noise, and that size in normal noise of variance 1:
/// where a share c of them is of turns, noise is taken for `1/(1 - c)` of itself about, no more.
const QUARTER: (f64, f64) = (0.25, 0.318_639);
/// Differences that the noise needs. Chosen here: of 20 it is known to a half.
const LEAST_DIFFERENCES: usize = 20;
/// Steps longer than so many typical ones are gaps.
const LONGEST_STEP: f64 = 1.5;

impl Track {
    /// Its places (m) without what is white noise, one an entry.
    #[must_use]
    pub fn settled_m(&self) -> Vec<Point3<f64>> {
        let steps = self.t_s.windows(2).map(|pair| pair[1] - pair[0]);
        let typical_s = median(&mut steps.collect::<Vec<f64>>()).unwrap_or(0.0);
        let mut settled_m = Vec::with_capacity(self.t_s.len());
        let noise_m = white_noise_m(&self.t_s, &self.position_m, LONGEST_STEP * typical_s);
        // Stretches without a gap.
        let mut from = 0;
        let is_next = |a: &f64, b: &f64| b - a <= LONGEST_STEP * typical_s;
        for times_s in self.t_s.chunk_by(is_next) {
            let places_m = &self.position_m[from..from + times_s.len()];
            from += times_s.len();
            settled_m.extend((0..times_s.len()).map(|at| settled(times_s, places_m, at, noise_m)));
        }
        settled_m
    }
}

/// The place at one entry of a stretch without gaps.
fn settled(t_s: &[f64], places_m: &[Point3<f64>], at: usize, noise_m: Vector3<f64>) -> Point3<f64> {
    let mut best_m = places_m[at];
    let within_m = noise_m * WITHIN;
    let (mut low_m, mut high_m) = (best_m.coords - within_m, best_m.coords + within_m);
    let mut is_open = [true; 3];
    for half in WINDOWS {
        if at < half || at + half >= t_s.len() || t_s[at + half] - t_s[at - half] > LONGEST_S {
            break;
        }
        let window = at - half..=at + half;
        let Some(weights) = parabola(&t_s[window.clone()], t_s[at]) else {
            break;
        };
        let square: f64 = weights.iter().map(|w| w * w).sum();
        let within_m = noise_m * (WITHIN * square.sqrt());
        let fitted_m: Vector3<f64> = weights
            .iter()
            .zip(&places_m[window])
            .map(|(w, place)| place.coords * *w)
            .sum();
        for axis in 0..3 {
            low_m[axis] = low_m[axis].max(fitted_m[axis] - within_m[axis]);
            high_m[axis] = high_m[axis].min(fitted_m[axis] + within_m[axis]);
            is_open[axis] &= low_m[axis] <= high_m[axis];
            if is_open[axis] {
                best_m[axis] = fitted_m[axis];
            }
        }
    }
    best_m
}

/// What the entries of a window weigh in the value at one of them of the parabola of least squares.
fn parabola(t_s: &[f64], at_s: f64) -> Option<Vec<f64>> {
    let span_s = t_s[t_s.len() - 1] - t_s[0];
    let from_it = |t_s: &f64| (t_s - at_s) / span_s;
    let mut sums = [0.0; 5];
    for x in t_s.iter().map(from_it) {
        let mut power = 1.0;
        for sum in &mut sums {
            *sum += power;
            power *= x;
        }
    }
    let gram = Matrix3::from_fn(|i, j| sums[i + j]);
    let [a, b, c] = gram.cholesky()?.solve(&Vector3::x()).into();
    Some(
        t_s.iter()
            .map(from_it)
            .map(|x| a + x * (b + x * c))
            .collect(),
    )
}

/// Standard deviation of white noise along each axis (m); 0 where too few entries follow one
/// another.
fn white_noise_m(t_s: &[f64], position_m: &[Point3<f64>], longest_s: f64) -> Vector3<f64> {
    let differences = t_s.windows(4).zip(position_m.windows(4));
    let differences = differences.filter_map(|(t_s, position_m)| {
        let is_even = t_s
            .windows(2)
            .all(|pair| pair[1] > pair[0] && pair[1] - pair[0] <= longest_s);
        is_even.then(|| third_difference(t_s, position_m))
    });
    let differences: Vec<Vector3<f64>> = differences.collect();
    if differences.len() < LEAST_DIFFERENCES {
        return Vector3::zeros();
    }
    let of_axis = |axis: usize| {
        let mut sizes: Vec<f64> = differences.iter().map(|d| d[axis].abs()).collect();
        selected(&mut sizes, QUARTER.0).unwrap_or(0.0) / QUARTER.1
    };
    Vector3::new(of_axis(0), of_axis(1), of_axis(2))
}

/// Third divided difference of four places, with weights of square sum 1: white noise keeps its
/// variance, and what is a parabola over time is gone.
fn third_difference(t_s: &[f64], position_m: &[Point3<f64>]) -> Vector3<f64> {
    let weight = |k: usize| {
        let others = (0..4).filter(|j| *j != k);
        others.map(|j| t_s[k] - t_s[j]).product::<f64>().recip()
    };
    let weights = [0, 1, 2, 3].map(weight);
    let length = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
    let weighed = weights.iter().zip(position_m);
    weighed.map(|(w, p)| p.coords * (w / length)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::draws::Draws;

    /// A drone that hovers and sways by 3 mm, and from 20 s on crosses the room and comes back, at
    /// half a metre a second; and what a tracker logs of it at 20 Hz with this noise (m).
    fn logged(noise_m: f64) -> (Vec<Point3<f64>>, Track) {
        let mut random = Draws::new(1);
        let t_s: Vec<f64> = (0..800).map(|i| 0.05 * f64::from(i)).collect();
        let place = |t_s: &f64| {
            let along_m = 0.5 * (10.0 - (t_s - 30.0).abs()).max(0.0);
            Point3::new(along_m, 0.003 * (1.3 * t_s).sin(), 1.0)
        };
        let true_m: Vec<Point3<f64>> = t_s.iter().map(place).collect();
        let mut with_noise = |place: &Point3<f64>| place.map(|m| m + noise_m * random.normal());
        let track = Track {
            position_m: true_m.iter().map(&mut with_noise).collect(),
            t_s,
            ..Track::default()
        };
        (true_m, track)
    }

    #[test]
    fn of_white_noise_half_is_left_and_a_turn_is_no_rounder_than_the_noise() {
        let (true_m, track) = logged(0.0015);
        let settled_m = track.settled_m();
        let off_m: Vec<f64> = (settled_m.iter().zip(&true_m))
            .map(|(place, true_m)| (place - true_m).norm())
            .collect();
        let rms_m = crate::statistics::quantile::root_mean_square(&off_m);
        assert!(rms_m < 0.6 * 0.0015 * 3f64.sqrt(), "{rms_m}");
        // Of three axes.
        let worst_m = off_m.iter().fold(0.0f64, |most, m| most.max(*m));
        assert!(worst_m < 5.0 * 0.0015, "{worst_m}");
    }

    #[test]
    fn places_without_noise_stay_where_they_are() {
        let (true_m, track) = logged(0.0);
        for (place, true_m) in track.settled_m().iter().zip(&true_m) {
            assert!((place - true_m).norm() < 1e-4, "{place} {true_m}");
        }
    }

    #[test]
    fn no_window_reaches_across_a_gap() {
        let (_, mut track) = logged(0.0015);
        track.t_s[400..].iter_mut().for_each(|t_s| *t_s += 10.0);
        let apart = track.settled_m();
        // Nothing is on both sides of the entries beside it.
        let is_logged = |at: &usize| apart[*at] == track.position_m[*at];
        let logged: Vec<usize> = (2..798).filter(is_logged).collect();
        assert_eq!(logged, [398, 399, 400, 401]);
    }
}
