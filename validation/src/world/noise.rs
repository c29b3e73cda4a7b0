//! Turbulence with memory on top of white noise: made, and known well enough to say how visible a
//! difference is.

use nalgebra::{Matrix2, Vector2};

use diagnosis::statistics::draws::Draws;

/// Noise of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Noise {
    /// White (m/s, or of a throttle ratio).
    pub(crate) white: f64,
    /// Turbulence over the local mean, as the instrument sees it.
    pub(crate) turbulence: f64,
    pub(crate) memory_s: f64,
    /// Whether the white part has the tails of Student's law with four degrees of freedom.
    pub(crate) is_heavy: bool,
}

impl Noise {
    /// One draw of the white part: `white` is its standard deviation under either law.
    pub(crate) fn white_draw(&self, random: &mut Draws) -> f64 {
        if !self.is_heavy {
            return self.white * random.normal();
        }
        // Student's t of 4 degrees of freedom, variance 2: a normal over the root of a mean of four
        // squares.
        let squares: f64 = (0..4).map(|_| random.normal().powi(2)).sum();
        self.white * random.normal() / (0.25 * squares).sqrt() / 2f64.sqrt()
    }
}

/// A gust that remembers: unit variance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gust {
    value: f64,
    at_s: f64,
}

impl Gust {
    pub(crate) fn new(random: &mut Draws) -> Gust {
        Gust {
            value: random.normal(),
            at_s: f64::NEG_INFINITY,
        }
    }

    pub(crate) fn at(&mut self, t_s: f64, memory_s: f64, random: &mut Draws) -> f64 {
        let kept = (-(t_s - self.at_s) / memory_s).exp();
        self.value = kept * self.value + (1.0 - kept * kept).max(0.0).sqrt() * random.normal();
        self.at_s = t_s;
        self.value
    }
}

/// One reading, as the oracle sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub(crate) t_s: f64,
    /// True minus simulated.
    pub(crate) difference: f64,
    pub(crate) simulated: f64,
    /// Local mean that turbulence scales with.
    pub(crate) mean: f64,
}

/// Likelihood ratio (χ²) of a known difference against gain and offset within what the maker allows
/// (normal, 95 % within it, none beyond), with the noise known: how detectable it is at best.
/// Readings of one instrument in the order of time.
pub(crate) fn detectable(seen: &[Seen], noise: &Noise, accuracy: [f64; 2]) -> f64 {
    // Innovations of difference, gain and offset under the same filter: it is linear.
    let mut gust = [0.0f64; 3];
    let mut variance = 1.0;
    let mut squared = 0.0;
    let mut against = Vector2::zeros();
    let mut among =
        Matrix2::from_diagonal(&Vector2::from(accuracy.map(|bound| (2.0 / bound).powi(2))));
    let mut before_s = f64::NEG_INFINITY;
    for one in seen {
        let kept = (-(one.t_s - before_s) / noise.memory_s).exp();
        before_s = one.t_s;
        variance = kept * kept * variance + (1.0 - kept * kept);
        let scale = noise.turbulence * one.mean;
        let spread = scale * scale * variance + noise.white * noise.white;
        let gain = variance * scale / spread;
        let columns = [one.difference, one.simulated, 1.0];
        let mut left = [0.0; 3];
        for (i, column) in columns.into_iter().enumerate() {
            let predicted = kept * gust[i];
            left[i] = column - scale * predicted;
            gust[i] = predicted + gain * left[i];
        }
        variance *= 1.0 - gain * scale;
        squared += left[0] * left[0] / spread;
        let nuisance = Vector2::new(left[1], left[2]);
        against += nuisance * (left[0] / spread);
        among += nuisance * nuisance.transpose() / spread;
    }
    (squared - explained(&against, &among, accuracy)).max(0.0)
}

/// Largest `2 a·x - x·M x` within a box: one coordinate after the other, which converges as it is
/// convex.
fn explained(against: &Vector2<f64>, among: &Matrix2<f64>, within: [f64; 2]) -> f64 {
    let mut at = Vector2::<f64>::zeros();
    for _ in 0..200 {
        for i in 0..2 {
            let rest = against[i] - among[(i, 1 - i)] * at[1 - i];
            at[i] = (rest / among[(i, i)]).clamp(-within[i], within[i]);
        }
    }
    2.0 * against.dot(&at) - at.dot(&(among * at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_noise_is_counted_sample_by_sample() {
        let noise = Noise {
            white: 0.1,
            turbulence: 0.0,
            memory_s: 1.0,
            is_heavy: false,
        };
        // A step in the second half, which no offset makes up for.
        let seen: Vec<Seen> = (0..200)
            .map(|i| Seen {
                t_s: f64::from(i),
                difference: if i < 100 { 0.0 } else { 0.1 },
                simulated: 0.0,
                mean: 1.0,
            })
            .collect();
        // 100 samples of one deviation each, half of which a free offset of the mean would take.
        let chi2 = detectable(&seen, &noise, [0.05, 1e-9]);
        assert!((chi2 - 100.0).abs() < 1e-6, "{chi2}");
        let chi2 = detectable(&seen, &noise, [0.05, 1e6]);
        assert!((chi2 - 50.0).abs() < 1e-6, "{chi2}");
    }
}
