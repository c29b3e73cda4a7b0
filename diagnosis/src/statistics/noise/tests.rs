use super::*;
use crate::statistics::draws::Draws;

/// Dwells of 30 s at flows from 0 to 4, noise of known size, and a residual of half the flow, which
/// is signal.
fn synthetic(seed: u64, n: usize, step_s: f64, truth: NoiseModel) -> [Vec<f64>; 3] {
    let mut random = Draws::new(seed);
    let mut gust = random.normal();
    let mut flow = 0.0;
    let [mut t_s, mut flows, mut residuals] = [const { Vec::new() }; 3];
    let kept = truth.kept(step_s);
    let per_dwell = (30.0 / step_s) as usize;
    for i in 0..n {
        if i % per_dwell == 0 {
            flow = 4.0 * random.uniform();
        }
        gust = kept * gust + (1.0 - kept * kept).sqrt() * random.normal();
        t_s.push(i as f64 * step_s);
        flows.push(flow);
        let noise = truth.white * random.normal() + truth.of_gusts(flow) * gust;
        residuals.push(0.5 * flow + noise);
    }
    [t_s, flows, residuals]
}

/// Half of a gust is left after 1 s.
const TRUTH: NoiseModel = NoiseModel {
    white: 0.0,
    s0: 0.03,
    s1: 0.12,
    memory_s: std::f64::consts::LOG2_E,
};

#[test]
fn noise_is_read_beside_a_signal_of_half_the_flow() {
    for seed in 0..10 {
        let [t_s, flows, residuals] = synthetic(seed, 3000, 1.0, TRUTH);
        let sequence = Sequence::new(&t_s, &vec![0; t_s.len()]);
        let noise = estimate(&sequence, &residuals, &flows, 0.0).expect("enough differences");
        // Three standard errors of a variance from 3000 correlated values, and of a correlation;
        // what a shorter memory leaves out of it.
        assert!(
            (noise.sd(3.0) / TRUTH.sd(3.0) - 1.0).abs() < 0.15,
            "{noise:?}"
        );
        assert!(
            (noise.sd(0.0) / TRUTH.sd(0.0) - 1.0).abs() < 0.6,
            "{noise:?}"
        );
        assert!(
            (noise.kept(1.0) - TRUTH.kept(1.0)).abs() < 0.15,
            "{noise:?}"
        );
    }
}

#[test]
fn gusts_that_last_seconds_are_read_beside_white_noise_at_10_hz() {
    let truth = NoiseModel {
        white: 0.05,
        s0: 0.02,
        s1: 0.15,
        memory_s: 1.0,
    };
    let mut ratios = Vec::new();
    for seed in 0..20 {
        let [t_s, flows, residuals] = synthetic(seed, 6000, 0.1, truth);
        let sequence = Sequence::new(&t_s, &vec![0; t_s.len()]);
        let noise = estimate(&sequence, &residuals, &flows, 0.0).expect("enough differences");
        assert!((noise.white / truth.white - 1.0).abs() < 0.3, "{noise:?}");
        assert!(
            (noise.sd(3.0) / truth.sd(3.0) - 1.0).abs() < 0.3,
            "{noise:?}"
        );
        ratios.push(noise.memory_s / truth.memory_s);
    }
    // A memory is known worse than a size.
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    assert!((mean - 1.0).abs() < 0.3, "{mean} {ratios:?}");
}

#[test]
fn a_tenth_of_wild_readings_changes_sd_by_less_than_a_third() {
    let [t_s, flows, mut residuals] = synthetic(3, 3000, 1.0, TRUTH);
    for residual in residuals.iter_mut().step_by(20) {
        *residual += 5.0;
    }
    let sequence = Sequence::new(&t_s, &vec![0; t_s.len()]);
    let noise = estimate(&sequence, &residuals, &flows, 0.0).expect("enough");
    // A tenth of the differences are wild; Huber's scale then rises by a sixth, as much again for
    // two that share a wild reading.
    assert!(noise.sd(3.0) < 1.34 * TRUTH.sd(3.0), "{noise:?}");
}

#[test]
fn whitened_noise_has_variance_one_and_no_memory_at_uneven_steps() {
    let mut random = Draws::new(5);
    let truth = NoiseModel {
        white: 0.2,
        ..TRUTH
    };
    let (mut t_s, mut values, mut now_s, mut state) = (Vec::new(), Vec::new(), 0.0, 0.0);
    for i in 0..20_000 {
        let step_s = 0.5 + random.uniform();
        now_s += step_s;
        let kept = truth.kept(step_s);
        state = if i == 0 {
            random.normal()
        } else {
            kept * state + f64::sqrt(1.0 - kept * kept) * random.normal()
        };
        t_s.push(now_s);
        values.push(truth.white * random.normal() + truth.of_gusts(2.0) * state);
    }
    let sequence = Sequence::new(&t_s, &vec![0; t_s.len()]);
    let white = Whitener::new(&truth, &sequence, &vec![2.0; t_s.len()]).whiten(&values);
    let n = white.len() as f64;
    let variance = white.iter().map(|e| e * e).sum::<f64>() / n;
    let memory = white.windows(2).map(|e| e[0] * e[1]).sum::<f64>() / n;
    // Four standard errors.
    assert!((variance - 1.0).abs() < 4.0 * (2.0 / n).sqrt());
    assert!(memory.abs() < 4.0 / n.sqrt());
}

#[test]
fn an_instrument_that_is_stuck_has_the_least_noise_that_was_declared() {
    let t_s: Vec<f64> = (0..100).map(f64::from).collect();
    let sequence = Sequence::new(&t_s, &[0; 100]);
    let noise = estimate(&sequence, &[0.2; 100], &[1.0; 100], 0.003).expect("enough");
    assert_eq!(noise, NoiseModel::white(0.003));
}
