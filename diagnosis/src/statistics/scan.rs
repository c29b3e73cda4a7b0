//! Where is it? Boxes in a few coordinates: where a residual leaves the noise, or where a
//! correction is large.
//!
//! The scan looks at every interval between sixteenths of every coordinate, and within the best
//! again at every other coordinate, for the largest `|Σ e|/√n` (Kulldorff 1997, Commun. Stat.
//! 26:1481, for normal values); the same greedy search on residuals whose blocks have flipped sign
//! says how large that is in noise.
//!
//! The description starts from samples that are known (where a correction exceeds half a standard
//! deviation) and finds the fewest intervals that overlap with them most: intersection over union.

use std::ops::Range;

use super::draws::Draws;
use super::quantile::{interval_of, quantile_edges};
use super::sequence::Blocks;

/// An interval of one coordinate, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Which coordinate, by its place in the list.
    pub coordinate: usize,
    /// Lower end, in the coordinate's unit.
    pub from: f64,
    /// Upper end.
    pub to: f64,
}

/// Where a residual leaves the noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// All of them hold.
    pub intervals: Vec<Interval>,
    /// Share of all samples that lie in it.
    pub share: f64,
    /// Mean residual there, in the residual's unit, signed.
    pub mean_error: f64,
    /// Sum of whitened residuals over the root of their number; signed.
    pub z: f64,
    /// p-value of as large a |z| anywhere, in noise.
    pub p: f64,
}

/// Parts of equal count between which intervals end.
const PARTS: usize = 16;
/// Samples that a region needs. Chosen here: fewer are an accident.
const LEAST_SAMPLES: usize = 10;
/// Coordinates of a region. Chosen here: a third is rarely understood.
const MOST_INTERVALS: usize = 2;
/// What another coordinate must add to be worth a reader's attention: of |z|, of the overlap.
/// Chosen here.
const WORTH_Z: f64 = 0.1;
const WORTH_OVERLAP: f64 = 0.03;
/// Sign flips of the scan: p-values are multiples of 1/200.
const FLIPS: usize = 199;

/// Neighbouring parts of one coordinate.
type NeighbouringParts = Range<usize>;

/// Coordinates by parts.
struct ScanGrid<'a> {
    coordinates: &'a [Vec<f64>],
    /// Of every coordinate, how many parts.
    counts: Vec<usize>,
    /// Of every coordinate, every sample's part; `None` where it is not finite.
    parts: Vec<Vec<Option<usize>>>,
}

impl<'a> ScanGrid<'a> {
    fn new(coordinates: &'a [Vec<f64>], parts: usize) -> Self {
        let binned = coordinates.iter().map(|values| {
            let edges = quantile_edges(values, parts);
            let of_samples = values.iter().map(|&v| interval_of(&edges, v)).collect();
            (edges.len().saturating_sub(1), of_samples)
        });
        let (counts, parts) = binned.unzip();
        Self {
            coordinates,
            counts,
            parts,
        }
    }

    /// All runs of parts of a coordinate but the whole.
    fn runs(&self, coordinate: usize) -> impl Iterator<Item = NeighbouringParts> + use<> {
        let parts = self.counts[coordinate];
        (0..parts)
            .flat_map(move |first| (first + 1..=parts).map(move |end| first..end))
            .filter(move |run| run.len() < parts)
    }

    fn holds(&self, coordinate: usize, run: &NeighbouringParts, sample: usize) -> bool {
        self.parts[coordinate][sample].is_some_and(|part| run.contains(&part))
    }

    /// Running sums over the parts of a coordinate, of a value and of the number of samples inside:
    /// any run is one difference.
    fn sums(
        &self,
        coordinate: usize,
        inside: &[usize],
        value: impl Fn(usize) -> f64,
    ) -> Vec<(f64, usize)> {
        let mut parts = vec![(0.0, 0); self.counts[coordinate]];
        for &i in inside {
            if let Some(part) = self.parts[coordinate][i] {
                parts[part].0 += value(i);
                parts[part].1 += 1;
            }
        }
        let mut sums = vec![(0.0, 0)];
        for (k, part) in parts.into_iter().enumerate() {
            sums.push((sums[k].0 + part.0, sums[k].1 + part.1));
        }
        sums
    }

    /// Of all runs of some coordinates, the one whose samples inside score most by size, from the
    /// sum of a value over them and their number; the first of equals, `None` where none has a
    /// score.
    fn best(
        &self,
        coordinates: impl Iterator<Item = usize>,
        inside: &[usize],
        value: impl Fn(usize) -> f64,
        score: impl Fn(f64, usize) -> Option<f64>,
    ) -> Option<(f64, usize, NeighbouringParts)> {
        let mut best: Option<(f64, usize, NeighbouringParts)> = None;
        for coordinate in coordinates {
            let sums = self.sums(coordinate, inside, &value);
            for run in self.runs(coordinate) {
                let (from, to) = (sums[run.start], sums[run.end]);
                let scored = score(to.0 - from.0, to.1 - from.1);
                let is_best = |s: f64| best.as_ref().is_none_or(|(most, ..)| s.abs() > most.abs());
                if let Some(scored) = scored.filter(|s| is_best(*s)) {
                    best = Some((scored, coordinate, run));
                }
            }
        }
        best
    }

    /// Each run's ends, at the outermost samples it holds.
    fn intervals(&self, runs: &[(usize, NeighbouringParts)]) -> Vec<Interval> {
        let interval = |(coordinate, run): &(usize, NeighbouringParts)| {
            let values = self.coordinates[*coordinate].iter().enumerate();
            let held = values.filter(|(i, _)| self.holds(*coordinate, run, *i));
            let held = held.map(|(_, value)| *value);
            Interval {
                coordinate: *coordinate,
                from: held.clone().fold(f64::INFINITY, f64::min),
                to: held.fold(f64::NEG_INFINITY, f64::max),
            }
        };
        runs.iter().map(interval).collect()
    }
}

/// Scans a whitened residual over coordinates (one value a sample each; one that is not finite lies
/// in no interval). `residual` is the same in its own unit, for the mean. `None` where no interval
/// holds ten samples.
#[must_use]
pub fn scan(
    coordinates: &[Vec<f64>],
    white: &[f64],
    residual: &[f64],
    blocks: &Blocks,
    seed: u64,
) -> Option<Region> {
    let grid = ScanGrid::new(coordinates, PARTS);
    let (runs, samples, z) = search(&grid, white);
    if runs.is_empty() {
        return None;
    }
    let mut random = Draws::new(seed);
    let mut as_large = 0;
    for _ in 0..FLIPS {
        let signs: Vec<f64> = (0..blocks.count()).map(|_| random.sign()).collect();
        let of_sample = white.iter().zip(&blocks.of_sample);
        let flipped: Vec<f64> = of_sample.map(|(e, &block)| e * signs[block]).collect();
        as_large += usize::from(search(&grid, &flipped).2.abs() >= z.abs());
    }
    let sum: f64 = samples.iter().map(|&i| residual[i]).sum();
    Some(Region {
        intervals: grid.intervals(&runs),
        share: samples.len() as f64 / white.len() as f64,
        mean_error: sum / samples.len() as f64,
        z,
        p: (as_large + 1) as f64 / (FLIPS + 1) as f64,
    })
}

/// The best box, one coordinate after the other, the samples in it, and its z.
fn search(grid: &ScanGrid, white: &[f64]) -> (Vec<(usize, NeighbouringParts)>, Vec<usize>, f64) {
    let mut runs: Vec<(usize, NeighbouringParts)> = Vec::new();
    let mut z_of_box = 0.0f64;
    let mut inside: Vec<usize> = (0..white.len()).collect();
    while runs.len() < MOST_INTERVALS {
        let free = (0..grid.counts.len()).filter(|c| runs.iter().all(|(used, _)| used != c));
        let z =
            |sum: f64, count: usize| (count >= LEAST_SAMPLES).then(|| sum / (count as f64).sqrt());
        let best = grid.best(free, &inside, |i| white[i], z);
        let Some((z, coordinate, run)) = best else {
            break;
        };
        if !runs.is_empty() && z.abs() < (1.0 + WORTH_Z) * z_of_box.abs() {
            break;
        }
        inside.retain(|&i| grid.holds(coordinate, &run, i));
        runs.push((coordinate, run));
        z_of_box = z;
    }
    (runs, inside, z_of_box)
}

/// The fewest intervals that overlap most with the samples marked; none where none or all are, or
/// no interval overlaps.
#[must_use]
pub fn describe(coordinates: &[Vec<f64>], marked: &[bool]) -> Vec<Interval> {
    // Finer than the scan: what is marked is known here.
    let grid = ScanGrid::new(coordinates, 2 * PARTS);
    let wanted = marked.iter().filter(|m| **m).count();
    if wanted == 0 || wanted == marked.len() {
        return Vec::new();
    }
    let overlap = |both: f64, count: usize| Some(both / (count as f64 + wanted as f64 - both));
    let best_overlap = |coordinates: Range<usize>, inside: &[usize]| {
        let is_marked = |i: usize| f64::from(u8::from(marked[i]));
        grid.best(coordinates, inside, is_marked, overlap)
    };
    // Pairs are searched whole: of two coordinates that only together bound a region, neither need
    // be best alone.
    let all: Vec<usize> = (0..marked.len()).collect();
    let coordinates = 0..grid.counts.len();
    let Some((overlap, coordinate, run)) = best_overlap(coordinates.clone(), &all) else {
        return Vec::new();
    };
    let mut best = vec![(coordinate, run)];
    let mut bar = overlap + WORTH_OVERLAP;
    for first in coordinates.clone() {
        for run in grid.runs(first) {
            let inside: Vec<usize> = (0..marked.len())
                .filter(|&i| grid.holds(first, &run, i))
                .collect();
            let held = inside.iter().filter(|&&i| marked[i]).count();
            // Nothing within it can overlap more than all that it holds.
            if held as f64 / wanted as f64 <= bar {
                continue;
            }
            if let Some((overlap, second, other)) =
                best_overlap(first + 1..coordinates.end, &inside)
                && overlap > bar
            {
                bar = overlap;
                best = vec![(first, run), (second, other)];
            }
        }
    }
    grid.intervals(&best)
}

#[cfg(test)]
mod tests;
