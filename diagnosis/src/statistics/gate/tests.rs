//! Made-up recordings of known content; how often noise alone passes is measured by the benchmark `false_alarms`.

use super::*;
use crate::statistics::column::{self, Covariate, Kind};
use crate::statistics::sequence::Sequence;

/// White noise of 1200 samples at 1 Hz, a covariate, and what is added to the noise.
struct Made {
    t_s: Vec<f64>,
    x: Vec<f64>,
    residual: Vec<f64>,
}

fn made(seed: u64, signal: impl Fn(f64, f64) -> f64) -> Made {
    let mut draws = Draws::new(seed);
    let t_s: Vec<f64> = (0..1200).map(f64::from).collect();
    let mut x = Vec::new();
    for i in 0..1200 {
        // A new place every 20 s.
        let here = if i % 20 == 0 {
            draws.uniform()
        } else {
            x[i - 1]
        };
        x.push(here);
    }
    let residual = (0..1200)
        .map(|i| signal(t_s[i], x[i]) + draws.normal())
        .collect();
    Made { t_s, x, residual }
}

fn test(made: &Made, nuisances: &DMatrix<f64>) -> Gate {
    let count = made.t_s.len();
    let covariates = [
        Covariate {
            name: "x",
            values: &made.x,
        },
        Covariate {
            name: "t",
            values: &made.t_s,
        },
    ];
    let mut columns = column::bins(&covariates, &vec![1.0; count]);
    columns.push(Column {
        name: "square".into(),
        kind: Kind::Tangent,
        values: made.x.iter().map(|x| x * x).collect(),
    });
    columns.push(Column {
        name: "early".into(),
        kind: Kind::Tangent,
        values: made
            .t_s
            .iter()
            .map(|&t| if t < 36.0 { 1.0 } else { 0.0 })
            .collect(),
    });
    let blocks = Blocks::new(&Sequence::new(&made.t_s, &vec![0; count]), &made.t_s);
    gate(
        &Evidence {
            residual: &made.residual,
            columns: &columns,
            nuisances,
            blocks: &blocks,
            rhythms: &[Rhythm {
                samples: (0..count).collect(),
                clock_s: made.t_s.clone(),
                weight: vec![1.0; count],
            }],
        },
        Options::default(),
    )
}

fn offset(count: usize) -> DMatrix<f64> {
    DMatrix::from_element(count, 1, 1.0)
}

#[test]
fn an_effect_of_a_third_of_the_noise_passes_and_is_named_first() {
    let made = made(1, |_, x| x * x);
    let gate = test(&made, &offset(1200));
    assert!(gate.passed, "{gate:?}");
    assert!(gate.chances[0] <= 0.003, "{gate:?}");
    assert_eq!(gate.scores[0].name, "square");
}

#[test]
fn noise_alone_does_not_pass() {
    for seed in 0..40 {
        let gate = test(&made(seed, |_, _| 0.0), &offset(1200));
        // 0.2 expected among 40.
        assert!(!gate.passed, "seed {seed}: {gate:?}");
    }
}

#[test]
fn what_the_nuisances_may_take_does_not_pass() {
    let gate = test(&made(2, |_, _| 5.0), &offset(1200));
    assert!(!gate.passed, "{gate:?}");
    let gate = test(&made(2, |_, _| 5.0), &DMatrix::zeros(1200, 0));
    assert!(gate.passed, "{gate:?}");
}

#[test]
fn an_effect_in_two_blocks_passes_by_the_second_test() {
    let gate = test(
        &made(3, |t_s, _| if t_s < 36.0 { 2.5 } else { 0.0 }),
        &offset(1200),
    );
    assert!(gate.passed, "{gate:?}");
    assert_eq!(gate.statistic, Statistic::Rare);
}

#[test]
fn a_pulsation_passes_by_the_third_test() {
    let gate = test(&made(4, |t_s, _| 0.8 * (2.1 * t_s).sin()), &offset(1200));
    assert!(gate.passed, "{gate:?}");
    assert_eq!(gate.statistic, Statistic::Rhythm);
    let (_, line) = gate.line.expect("long enough");
    // Half of 1/1200 s.
    assert!((line.frequency_hz - 2.1 / std::f64::consts::TAU).abs() < 5e-4);
}

#[test]
fn the_least_detectable_effect_is_noticed_four_times_in_five() {
    // One recording's own standard error is off by a tenth: the mean of twenty is not.
    let least_of = |seed| test(&made(seed, |_, _| 0.0), &offset(1200)).detectable[0].least;
    let least = (0..20).map(least_of).sum::<f64>() / 20.0;
    let mut noticed = 0;
    for seed in 100..300 {
        let gate = test(&made(seed, |_, x| least * x * x), &offset(1200));
        let score = gate.scores.iter().find(|s| s.name == "square");
        // Over the spread that is left once the fit is taken off, z/√(1 - z²/K).
        let z = score.map_or(0.0, |s| s.z_spread);
        let beyond = z / (1.0 - z * z / gate.blocks as f64).sqrt();
        noticed += usize::from(beyond.abs() > 1.96);
    }
    // 160 expected; four standard deviations of a count.
    assert!((137..=183).contains(&noticed), "{noticed}");
}

#[test]
fn the_same_seed_gives_the_same_answer() {
    let made = made(6, |_, x| 0.2 * x);
    assert_eq!(test(&made, &offset(1200)), test(&made, &offset(1200)));
}

#[test]
fn without_columns_only_a_rhythm_can_pass() {
    let made = made(7, |_, _| 3.0);
    let blocks = Blocks::new(&Sequence::new(&made.t_s, &[0; 1200]), &made.t_s);
    let evidence = Evidence {
        residual: &made.residual,
        columns: &[],
        nuisances: &DMatrix::zeros(1200, 0),
        blocks: &blocks,
        rhythms: &[],
    };
    let gate = gate(&evidence, Options::default());
    assert!(!gate.passed && gate.p == 1.0);
}
