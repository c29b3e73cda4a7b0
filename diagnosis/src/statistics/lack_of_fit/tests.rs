//! Synthetic recordings of known content; how often noise alone passes is measured by the benchmark
//! `false_alarms`.

use super::*;
use crate::statistics::column;
use crate::statistics::sequence::Sequence;

/// White noise of 1200 samples at 1 Hz, a covariate, and what is added to the noise.
struct Made {
    t_s: Vec<f64>,
    x: Vec<f64>,
    residual: Vec<f64>,
}

fn made(seed: u64, signal: impl Fn(f64, f64) -> f64) -> Made {
    let mut random = Draws::new(seed);
    let t_s: Vec<f64> = (0..1200).map(f64::from).collect();
    let mut x = Vec::new();
    for i in 0..1200 {
        // A new place every 20 s.
        let here = if i % 20 == 0 {
            random.uniform()
        } else {
            x[i - 1]
        };
        x.push(here);
    }
    let residual = (0..1200)
        .map(|i| signal(t_s[i], x[i]) + random.normal())
        .collect();
    Made { t_s, x, residual }
}

fn test(made: &Made, nuisances: &DMatrix<f64>) -> LackOfFit {
    let count = made.t_s.len();
    let covariates = [made.x.clone(), made.t_s.clone()];
    let mut columns = column::bins(&covariates, &vec![1.0; count]);
    columns.push(Column {
        is_law: true,
        values: made.x.iter().map(|x| x * x).collect(),
    });
    columns.push(Column {
        is_law: true,
        values: made
            .t_s
            .iter()
            .map(|&t| if t < 36.0 { 1.0 } else { 0.0 })
            .collect(),
    });
    let blocks = Blocks::new(&Sequence::new(&made.t_s, &vec![0; count]), &made.t_s);
    lack_of_fit(&Evidence {
        residual: &made.residual,
        columns: &columns,
        nuisances,
        blocks: &blocks,
        rhythms: &[Rhythm {
            samples: (0..count).collect(),
            clock_s: made.t_s.clone(),
            weight: vec![1.0; count],
            is_slow: false,
        }],
    })
}

fn offset(count: usize) -> DMatrix<f64> {
    DMatrix::from_element(count, 1, 1.0)
}

#[test]
fn an_effect_of_a_third_of_the_noise_passes_by_the_first_statistic() {
    let made = made(1, |_, x| x * x);
    let answer = test(&made, &offset(1200));
    assert!(answer.is_significant, "{answer:?}");
    assert!(answer.p_values[0] <= 0.003, "{answer:?}");
}

#[test]
fn noise_alone_does_not_pass() {
    for seed in 0..40 {
        let answer = test(&made(seed, |_, _| 0.0), &offset(1200));
        // 0.2 expected among 40.
        assert!(!answer.is_significant, "seed {seed}: {answer:?}");
    }
}

#[test]
fn what_the_nuisances_may_take_does_not_pass() {
    let answer = test(&made(2, |_, _| 5.0), &offset(1200));
    assert!(!answer.is_significant, "{answer:?}");
    let answer = test(&made(2, |_, _| 5.0), &DMatrix::zeros(1200, 0));
    assert!(answer.is_significant, "{answer:?}");
}

#[test]
fn an_effect_in_two_blocks_passes_by_the_second_statistic() {
    let answer = test(
        &made(3, |t_s, _| if t_s < 36.0 { 2.5 } else { 0.0 }),
        &offset(1200),
    );
    assert!(answer.is_significant, "{answer:?}");
    assert_eq!(answer.statistic, Statistic::Rare);
}

#[test]
fn a_pulsation_passes_by_the_third_statistic() {
    let answer = test(&made(4, |t_s, _| 0.8 * (2.1 * t_s).sin()), &offset(1200));
    assert!(answer.is_significant, "{answer:?}");
    assert_eq!(answer.statistic, Statistic::Rhythm);
    let line = answer.line.expect("long enough");
    // Half of 1/1200 s.
    assert!((line.frequency_hz - 2.1 / std::f64::consts::TAU).abs() < 5e-4);
}

#[test]
fn the_minimum_detectable_effect_is_noticed_four_times_in_five() {
    let none = [const { (Vec::new(), 0.0) }; 2];
    // What the spread of a single law accepts.
    let z = tail::normal_two_sided_quantile(0.5 * ACCEPTED * SHARES[0]);
    let mut noticed = 0;
    for seed in 100..300 {
        let made = made(seed, |_, _| 0.0);
        let tangent = DVector::from_iterator(made.x.len(), made.x.iter().map(|x| x * x));
        let least = minimum_detectable(tangent.as_slice(), std::slice::from_ref(&none), 1)
            .expect("it changes");
        let read = DVector::from_column_slice(&made.residual) + least * &tangent;
        noticed += usize::from((tangent.dot(&read) / tangent.norm()).abs() > z);
    }
    // 160 expected; four standard deviations of a count.
    assert!((137..=183).contains(&noticed), "{noticed}");
}

#[test]
fn what_gain_and_offset_may_take_is_not_detected() {
    let [along, across] = [vec![1.0; 400], (0..400).map(f64::from).collect()];
    let alone = |tolerated| minimum_detectable(&along, &[tolerated], 20).expect("it changes");
    let least = alone([(Vec::new(), 0.0), (Vec::new(), 0.0)]);
    let beside = alone([(across, 0.0), (along.clone(), 0.04)]);
    assert!((beside - least - 0.04).abs() < 1e-9, "{least} {beside}");
    // Two that take it together, where either is held back by nothing.
    let slope: Vec<f64> = (0..400).map(|i| 2.0 - f64::from(i) / 400.0).collect();
    let both = alone([(slope, 1e6), (along.clone(), 0.04)]);
    assert!(both > beside, "{both} {beside}");
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
    let answer = lack_of_fit(&evidence);
    assert!(!answer.is_significant && answer.p == 1.0);
}
