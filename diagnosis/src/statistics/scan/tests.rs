//! Regions of known bounds, and noise without any.

use super::*;
use crate::statistics::sequence::Sequence;

const COUNT: usize = 2000;

struct Made {
    x: Vec<f64>,
    y: Vec<f64>,
    az: Vec<f64>,
    noise: Vec<f64>,
    blocks: Blocks,
}

fn made(seed: u64) -> Made {
    let mut draws = Draws::new(seed);
    let mut values = || (0..COUNT).map(|_| draws.uniform()).collect::<Vec<f64>>();
    let (x, y, az) = (values(), values(), values());
    let mut draws = Draws::new(seed + 1000);
    let t_s: Vec<f64> = (0..COUNT).map(|i| i as f64).collect();
    Made {
        x,
        y,
        az: az.iter().map(|a| std::f64::consts::TAU * a).collect(),
        noise: (0..COUNT).map(|_| draws.normal()).collect(),
        blocks: Blocks::new(&Sequence::new(&t_s, &[0; COUNT]), &t_s),
    }
}

fn coordinates(made: &Made) -> [Coordinate<'_>; 3] {
    let coordinate = |values, is_cyclic| Coordinate { values, is_cyclic };
    [
        coordinate(&made.x, false),
        coordinate(&made.y, false),
        coordinate(&made.az, true),
    ]
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
    assert!(x.is_open.0 && !x.is_open.1 && y.is_open.1);
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
    let description = describe(&coordinates(&made), &one).expect("some marked");
    assert_eq!(description.intervals.len(), 1);
    assert_eq!(description.intervals[0].coordinate, 1);
    assert!(description.overlap > 0.9, "{description:?}");
    let two: Vec<bool> = (0..COUNT).map(|i| one[i] && made.x[i] < 0.3).collect();
    let description = describe(&coordinates(&made), &two).expect("some marked");
    assert_eq!(description.intervals.len(), 2);
    // Edges off by half a thirty-second on two sides of 0.3 x 0.4.
    assert!(description.overlap > 0.85, "{description:?}");
}

#[test]
fn a_region_over_the_seam_of_an_azimuth_is_one_interval() {
    let made = made(3);
    let marked: Vec<bool> = made.az.iter().map(|a| a.cos() > 0.5).collect();
    let description = describe(&coordinates(&made), &marked).expect("some marked");
    let interval = description.intervals[0];
    assert!(interval.from > interval.to, "{interval:?}");
    assert!(interval.holds(6.0) && interval.holds(0.1) && !interval.holds(3.0));
    assert!(description.overlap > 0.9);
}

#[test]
fn nothing_marked_has_no_description() {
    let made = made(4);
    assert_eq!(describe(&coordinates(&made), &[false; COUNT]), None);
    assert_eq!(describe(&coordinates(&made), &[true; COUNT]), None);
}
