//! How sure an error over samples is: whole blocks drawn again, with replacement (Künsch 1989 for
//! blocks; percentile intervals, Efron & Tibshirani 1993, ch. 13).

use super::draws::Draws;
use super::quantile::nearest_rank;

/// 95 % percentile intervals `[low, high]` of statistics of some units (blocks, flights).
///
/// `statistics` makes its `N` numbers from the units drawn, as indices below `units`; it is asked
/// `draws` times. The intervals are in the numbers' units, and not numbers where there are no
/// units or draws. The seed fixes them.
#[must_use]
pub fn intervals_95<const N: usize>(
    units: usize,
    draws: usize,
    seed: u64,
    statistics: impl Fn(&[usize]) -> [f64; N],
) -> [[f64; 2]; N] {
    let mut random = Draws::new(seed);
    let mut drawn: [Vec<f64>; N] = std::array::from_fn(|_| Vec::with_capacity(draws));
    for _ in 0..draws {
        let picked: Vec<usize> = (0..units).map(|_| random.index(units)).collect();
        for (values, value) in drawn.iter_mut().zip(statistics(&picked)) {
            values.push(value);
        }
    }
    drawn.map(|mut values| {
        values.sort_by(f64::total_cmp);
        [0.025, 0.975].map(|share| nearest_rank(&values, share).unwrap_or(f64::NAN))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_cover_in_about_95_of_100() {
        let mut covered = 0;
        for seed in 0..400 {
            let mut random = Draws::new(1000 + seed);
            // Sixty blocks of fifteen samples that share half of their variance.
            let squares: Vec<f64> = (0..60)
                .map(|_| {
                    let shared = random.normal();
                    (0..15).map(|_| (shared + random.normal()).powi(2)).sum()
                })
                .collect();
            let rms = |picked: &[usize]| {
                let sum: f64 = picked.iter().map(|&b| squares[b]).sum();
                [(sum / (15.0 * picked.len() as f64)).sqrt()]
            };
            let [[low, high]] = intervals_95(60, 200, seed, rms);
            covered += usize::from(low <= 2f64.sqrt() && 2f64.sqrt() <= high);
        }
        // Percentile intervals from 60 blocks of skewed squares cover 92 to 95 %; three standard
        // deviations of a count.
        assert!((352..=394).contains(&covered), "{covered}");
    }
}
