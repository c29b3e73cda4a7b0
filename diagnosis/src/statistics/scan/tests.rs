//! Regions of known bounds, and noise without any.

use super::*;
use crate::statistics::sequence::Sequence;

const COUNT: usize = 2000;

struct Made {
    x: Vec<f64>,
    y: Vec<f64>,
    noise: Vec<f64>,
    blocks: Blocks,
}

fn made(seed: u64) -> Made {
    let mut random = Draws::new(seed);
    let mut values = || (0..COUNT).map(|_| random.uniform()).collect::<Vec<f64>>();
    let (x, y) = (values(), values());
    let mut random = Draws::new(seed + 1000);
    let t_s: Vec<f64> = (0..COUNT).map(|i| i as f64).collect();
    Made {
        x,
        y,
        noise: (0..COUNT).map(|_| random.normal()).collect(),
        blocks: Blocks::new(&Sequence::new(&t_s, &[0; COUNT]), &t_s),
    }
}

fn coordinates(made: &Made) -> [Vec<f64>; 2] {
    [made.x.clone(), made.y.clone()]
}

/// Samples in both over samples in either, of the samples marked and those in all intervals.
fn overlap(made: &Made, intervals: &[Interval], marked: &[bool]) -> f64 {
    let coordinates = coordinates(made);
    let holds = |i: usize| {
        let within = |of: &Interval| {
            let value = coordinates[of.coordinate][i];
            value >= of.from && value <= of.to
        };
        intervals.iter().all(within)
    };
    let both = (0..COUNT).filter(|&i| marked[i] && holds(i)).count();
    let either = (0..COUNT).filter(|&i| marked[i] || holds(i)).count();
    both as f64 / either as f64
}

#[test]
fn a_box_of_two_coordinates_is_found() {
    let made = made(1);
    let white: Vec<f64> = (0..COUNT)
        .map(|i| {
            let inside = made.x[i] < 0.25 && made.y[i] > 0.5;
            made.noise[i] - if inside { 1.5 } else { 0.0 }
        })
        .collect();
    let region = scan(&coordinates(&made), &white, &white, &made.blocks, 1).expect("samples");
    assert!(region.p <= 0.01 && region.z < 0.0, "{region:?}");
    let bounds = |c| region.intervals.iter().find(|i| i.coordinate == c);
    let (x, y) = (bounds(0).expect("x"), bounds(1).expect("y"));
    // A sixteenth either way.
    assert!(
        (x.to - 0.25).abs() < 0.07 && (y.from - 0.5).abs() < 0.07,
        "{region:?}"
    );
    assert!((region.mean_error + 1.5).abs() < 0.3);
    assert!((region.share - 0.125).abs() < 0.04);
}

#[test]
fn noise_has_no_region() {
    let mut found = 0;
    for seed in 0..60 {
        let made = made(seed);
        let white = &made.noise;
        let region = scan(&coordinates(&made), white, white, &made.blocks, 1);
        found += usize::from(region.is_some_and(|region| region.p <= 0.05));
    }
    // 3 expected; four standard deviations more.
    assert!(found <= 10, "{found}");
}

#[test]
fn marked_samples_are_told_in_the_fewest_intervals() {
    let made = made(2);
    let one: Vec<bool> = made.y.iter().map(|&y| y > 0.6).collect();
    let intervals = describe(&coordinates(&made), &one);
    assert_eq!(intervals.len(), 1);
    assert_eq!(intervals[0].coordinate, 1);
    assert!(overlap(&made, &intervals, &one) > 0.9, "{intervals:?}");
    let two: Vec<bool> = (0..COUNT).map(|i| one[i] && made.x[i] < 0.3).collect();
    let intervals = describe(&coordinates(&made), &two);
    assert_eq!(intervals.len(), 2);
    // Edges off by half a thirty-second on two sides of 0.3 x 0.4.
    assert!(overlap(&made, &intervals, &two) > 0.85, "{intervals:?}");
}

#[test]
fn nothing_marked_has_no_description() {
    let made = made(4);
    assert!(describe(&coordinates(&made), &[false; COUNT]).is_empty());
    assert!(describe(&coordinates(&made), &[true; COUNT]).is_empty());
}
