//! Where is it? Boxes in a few coordinates: where a residual leaves the noise, or where a correction is large.
//!
//! The scan looks at every interval between sixteenths of every coordinate, and within the best again at every other coordinate, for the
//! largest `|Σ e|/√n` (Kulldorff 1997, Commun. Stat. 26:1481, for normal values); the same greedy search on residuals whose blocks
//! have flipped sign says how large that is by chance.
//!
//! The description starts from samples that are known (where a correction exceeds half a standard deviation) and finds
//! the fewest intervals that overlap with them most: intersection over union.

use super::column::{interval_of, quantile_edges};
use super::draws::Draws;
use super::sequence::Blocks;

/// A coordinate that regions are told in.
#[derive(Clone, Copy, Debug)]
pub struct Coordinate<'a> {
    /// Of every sample; one where it is not finite lies in no interval.
    pub values: &'a [f64],
    /// Whether it comes round (an azimuth): then an interval may run over the seam.
    pub is_cyclic: bool,
}

/// An interval of one coordinate, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Which, by its place in the list.
    pub coordinate: usize,
    /// Lower end.
    pub from: f64,
    /// Upper end; below `from` where the interval runs over the seam of a cyclic coordinate.
    pub to: f64,
    /// Whether nothing lies below (above) it: the end is that of the data, no limit of the region.
    pub is_open: (bool, bool),
}

impl Interval {
    /// Whether a value lies in it.
    #[must_use]
    pub fn holds(&self, value: f64) -> bool {
        if self.from <= self.to {
            value >= self.from && value <= self.to
        } else {
            value >= self.from || value <= self.to
        }
    }
}

/// Where a residual leaves the noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// All of them hold.
    pub intervals: Vec<Interval>,
    /// The samples in it.
    pub samples: Vec<usize>,
    /// Their share of all.
    pub share: f64,
    /// Mean residual there, in the residual's unit, signed.
    pub mean_error: f64,
    /// Sum of whitened residuals over the root of their number; signed.
    pub z: f64,
    /// Chance of as large a |z| anywhere, in noise.
    pub p: f64,
}

/// A region known by its samples, in intervals.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// All of them hold.
    pub intervals: Vec<Interval>,
    /// Samples in both over samples in either, from 0 to 1.
    pub overlap: f64,
}

/// Parts of equal count between which intervals end.
const PARTS: usize = 16;
/// Samples that a region needs.
const LEAST_SAMPLES: usize = 10;
/// Coordinates of a region. Chosen here: a third is rarely understood.
const MOST_INTERVALS: usize = 2;
/// What another coordinate must add to be worth a reader's attention: of |z|, of the overlap.
const WORTH_Z: f64 = 0.1;
const WORTH_OVERLAP: f64 = 0.03;
/// Flips of the scan.
const FLIPS: usize = 199;

/// Neighbouring parts: the first, and how many.
type Run = (usize, usize);

/// Coordinates by parts.
struct Grid {
    edges: Vec<Vec<f64>>,
    /// Of every coordinate, every sample's part.
    parts: Vec<Vec<Option<usize>>>,
    is_cyclic: Vec<bool>,
}

impl Grid {
    fn new(coordinates: &[Coordinate<'_>], parts: usize) -> Self {
        let edges: Vec<Vec<f64>> = coordinates
            .iter()
            .map(|c| quantile_edges(c.values, parts))
            .collect();
        let parts = coordinates
            .iter()
            .zip(&edges)
            .map(|(c, edges)| c.values.iter().map(|&v| interval_of(edges, v)).collect())
            .collect();
        Self {
            edges,
            parts,
            is_cyclic: coordinates.iter().map(|c| c.is_cyclic).collect(),
        }
    }

    /// All runs of parts of a coordinate but the whole: first and how many.
    fn runs(&self, coordinate: usize) -> impl Iterator<Item = Run> + use<> {
        let parts = self.edges[coordinate].len().saturating_sub(1);
        let is_cyclic = self.is_cyclic[coordinate];
        (0..parts).flat_map(move |first| {
            let most = if is_cyclic { parts } else { parts - first };
            (1..=most)
                .map(move |count| (first, count))
                .filter(move |run| run.1 < parts)
        })
    }

    fn holds(&self, coordinate: usize, run: Run, sample: usize) -> bool {
        let parts = self.edges[coordinate].len().saturating_sub(1);
        self.parts[coordinate][sample].is_some_and(|part| (part + parts - run.0) % parts < run.1)
    }

    /// A run's ends, at the outermost samples it holds.
    fn interval(&self, of: &Coordinate<'_>, coordinate: usize, run: Run) -> Interval {
        let parts = self.edges[coordinate].len().saturating_sub(1);
        let last = (run.0 + run.1 - 1) % parts;
        let mut from = f64::INFINITY;
        let mut to = f64::NEG_INFINITY;
        for (part, &value) in self.parts[coordinate].iter().zip(of.values) {
            if *part == Some(run.0) {
                from = from.min(value);
            }
            if *part == Some(last) {
                to = to.max(value);
            }
        }
        let is_cyclic = self.is_cyclic[coordinate];
        Interval {
            coordinate,
            from,
            to,
            is_open: (run.0 == 0 && !is_cyclic, last == parts - 1 && !is_cyclic),
        }
    }
}

/// A box under construction.
#[derive(Clone, Default)]
struct Found {
    runs: Vec<(usize, Run)>,
    z: f64,
}

/// Scans a whitened residual; `residual` is the same in its own unit, for the mean. `None` where no interval holds ten samples.
#[must_use]
pub fn scan(
    coordinates: &[Coordinate<'_>],
    white: &[f64],
    residual: &[f64],
    blocks: &Blocks,
    seed: u64,
) -> Option<Region> {
    let grid = Grid::new(coordinates, PARTS);
    let seen = search(&grid, white);
    if seen.runs.is_empty() {
        return None;
    }
    let mut draws = Draws::new(seed);
    let mut as_large = 0;
    for _ in 0..FLIPS {
        let signs: Vec<f64> = (0..blocks.count()).map(|_| draws.sign()).collect();
        let of_sample = white.iter().zip(&blocks.of_sample);
        let flipped: Vec<f64> = of_sample.map(|(e, &block)| e * signs[block]).collect();
        as_large += usize::from(search(&grid, &flipped).z.abs() >= seen.z.abs());
    }
    let inside = |i: &usize| seen.runs.iter().all(|&(c, run)| grid.holds(c, run, *i));
    let samples: Vec<usize> = (0..white.len()).filter(inside).collect();
    let sum: f64 = samples.iter().map(|&i| residual[i]).sum();
    Some(Region {
        intervals: intervals(&grid, coordinates, &seen.runs),
        share: samples.len() as f64 / white.len() as f64,
        mean_error: sum / samples.len() as f64,
        z: seen.z,
        p: (as_large + 1) as f64 / (FLIPS + 1) as f64,
        samples,
    })
}

fn intervals(grid: &Grid, coordinates: &[Coordinate<'_>], runs: &[(usize, Run)]) -> Vec<Interval> {
    runs.iter()
        .map(|&(c, run)| grid.interval(&coordinates[c], c, run))
        .collect()
}

/// The best box, one coordinate after the other.
fn search(grid: &Grid, white: &[f64]) -> Found {
    let mut found = Found::default();
    let mut inside: Vec<usize> = (0..white.len()).collect();
    while found.runs.len() < MOST_INTERVALS {
        let mut best: Option<(f64, usize, Run)> = None;
        for coordinate in 0..grid.edges.len() {
            if found.runs.iter().any(|(used, _)| *used == coordinate) {
                continue;
            }
            let parts = grid.edges[coordinate].len().saturating_sub(1);
            let mut sums = vec![(0.0, 0usize); parts];
            for &i in &inside {
                if let Some(part) = grid.parts[coordinate][i] {
                    sums[part].0 += white[i];
                    sums[part].1 += 1;
                }
            }
            let sums = turned_twice(&sums);
            for run in grid.runs(coordinate) {
                let (from, to) = (sums[run.0], sums[run.0 + run.1]);
                let count = to.1 - from.1;
                let z = (to.0 - from.0) / (count as f64).sqrt();
                if count >= LEAST_SAMPLES && best.is_none_or(|(most, _, _)| z.abs() > most.abs()) {
                    best = Some((z, coordinate, run));
                }
            }
        }
        let Some((z, coordinate, run)) = best else {
            break;
        };
        if !found.runs.is_empty() && z.abs() < (1.0 + WORTH_Z) * found.z.abs() {
            break;
        }
        inside.retain(|&i| grid.holds(coordinate, run, i));
        found.runs.push((coordinate, run));
        found.z = z;
    }
    found
}

/// Running sums over the parts, gone through twice: any run, over the seam too, is one difference.
fn turned_twice(parts: &[(f64, usize)]) -> Vec<(f64, usize)> {
    let mut sums = vec![(0.0, 0)];
    let (mut sum, mut count) = (0.0, 0);
    for part in parts.iter().chain(parts) {
        sum += part.0;
        count += part.1;
        sums.push((sum, count));
    }
    sums
}

/// The fewest intervals that overlap most with the samples marked; `None` where none or all are, or no interval overlaps.
#[must_use]
pub fn describe(coordinates: &[Coordinate<'_>], marked: &[bool]) -> Option<Description> {
    // Finer than the scan: nothing is searched by chance here.
    let grid = Grid::new(coordinates, 2 * PARTS);
    let wanted = marked.iter().filter(|m| **m).count();
    if wanted == 0 || wanted == marked.len() {
        return None;
    }
    // Pairs are searched whole: of two coordinates that only together bound a region, neither need be best alone.
    let all: Vec<usize> = (0..marked.len()).collect();
    let singles = best_overlaps(&grid, marked, &all, wanted, 0..grid.edges.len());
    let mut best: Option<(f64, Vec<(usize, Run)>)> = None;
    for &(overlap, coordinate, run) in &singles {
        if best.as_ref().is_none_or(|(most, _)| overlap > *most) {
            best = Some((overlap, vec![(coordinate, run)]));
        }
    }
    let (alone, _) = best.clone()?;
    let mut bar = alone + WORTH_OVERLAP;
    for &(_, first, _) in &singles {
        for run in grid.runs(first) {
            let inside: Vec<usize> = (0..marked.len())
                .filter(|&i| grid.holds(first, run, i))
                .collect();
            let held = inside.iter().filter(|&&i| marked[i]).count();
            // Nothing within it can overlap more than all that it holds.
            if held as f64 / wanted as f64 <= bar {
                continue;
            }
            let later = first + 1..grid.edges.len();
            for (overlap, second, other) in best_overlaps(&grid, marked, &inside, wanted, later) {
                if overlap > bar {
                    bar = overlap;
                    best = Some((overlap, vec![(first, run), (second, other)]));
                }
            }
        }
    }
    best.map(|(overlap, runs)| Description {
        intervals: intervals(&grid, coordinates, &runs),
        overlap,
    })
}

/// Of each of some coordinates, the run that overlaps most with the marked samples among those inside.
fn best_overlaps(
    grid: &Grid,
    marked: &[bool],
    inside: &[usize],
    wanted: usize,
    coordinates: std::ops::Range<usize>,
) -> Vec<(f64, usize, Run)> {
    let mut best = Vec::new();
    for coordinate in coordinates {
        let parts = grid.edges[coordinate].len().saturating_sub(1);
        let mut counts = vec![(0.0, 0usize); parts];
        for &i in inside {
            if let Some(part) = grid.parts[coordinate][i] {
                counts[part].0 += if marked[i] { 1.0 } else { 0.0 };
                counts[part].1 += 1;
            }
        }
        let counts = turned_twice(&counts);
        let overlap = |run: Run| {
            let (from, to) = (counts[run.0], counts[run.0 + run.1]);
            let both = to.0 - from.0;
            both / ((to.1 - from.1) as f64 + wanted as f64 - both)
        };
        let most = grid
            .runs(coordinate)
            .map(|run| (overlap(run), coordinate, run))
            .reduce(|best, other| if other.0 > best.0 { other } else { best });
        best.extend(most);
    }
    best
}

#[cfg(test)]
mod tests;
