use super::*;
use crate::statistics::draws::Draws;

/// Dwells of 30 samples at flows from 0 to 4, noise of known size, and a residual of half the flow,
/// which is signal.
fn synthetic(seed: u64, n: usize, truth: NoiseModel) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut random = Draws::new(seed);
    let mut state = random.normal();
    let mut flow = 0.0;
    let (mut t_s, mut flows, mut residuals) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..n {
        if i % 30 == 0 {
            flow = 4.0 * random.uniform();
        }
        state = truth.rho * state + (1.0 - truth.rho * truth.rho).sqrt() * random.normal();
        t_s.push(i as f64 * truth.step_s);
        flows.push(flow);
        residuals.push(0.5 * flow + truth.sd(flow) * state);
    }
    (t_s, flows, residuals)
}

const TRUTH: NoiseModel = NoiseModel {
    s0: 0.03,
    s1: 0.12,
    rho: 0.5,
    step_s: 1.0,
};

#[test]
fn noise_is_read_beside_a_signal_of_half_the_flow() {
    for seed in 0..10 {
        let (t_s, flows, residuals) = synthetic(seed, 3000, TRUTH);
        let sequence = Sequence::new(&t_s, &vec![0; t_s.len()]);
        let noise = estimate(&sequence, &residuals, &flows, 0.0).expect("enough differences");
        // Three standard errors of a variance from 3000 correlated values, and of a correlation.
        assert!((noise.s1 / TRUTH.s1 - 1.0).abs() < 0.15, "{noise:?}");
        assert!((noise.s0 / TRUTH.s0 - 1.0).abs() < 0.6, "{noise:?}");
        assert!((noise.rho - TRUTH.rho).abs() < 0.1, "{noise:?}");
    }
}

#[test]
fn a_tenth_of_wild_readings_changes_sd_by_less_than_a_third() {
    let (t_s, flows, mut residuals) = synthetic(3, 3000, TRUTH);
    for residual in residuals.iter_mut().step_by(20) {
        *residual += 5.0;
    }
    let sequence = Sequence::new(&t_s, &vec![0; t_s.len()]);
    let noise = estimate(&sequence, &residuals, &flows, 0.0).expect("enough");
    // A tenth of the differences are wild; Huber's scale then rises by a sixth, and ρ falls, which
    // the factor 2 covers.
    assert!(noise.sd(3.0) < 1.34 * TRUTH.sd(3.0), "{noise:?}");
}

#[test]
fn whitened_noise_has_variance_one_and_no_memory_at_uneven_steps() {
    let mut random = Draws::new(5);
    let (mut t_s, mut values, mut now_s, mut state) = (Vec::new(), Vec::new(), 0.0, 0.0);
    for i in 0..20_000 {
        let step_s = 0.5 + random.uniform();
        now_s += step_s;
        let kept = TRUTH.rho.powf(step_s);
        state = if i == 0 {
            random.normal()
        } else {
            kept * state + f64::sqrt(1.0 - kept * kept) * random.normal()
        };
        t_s.push(now_s);
        values.push(TRUTH.sd(2.0) * state);
    }
    let sequence = Sequence::new(&t_s, &vec![0; t_s.len()]);
    let white = Whitener::new(&TRUTH, &sequence, &vec![2.0; t_s.len()]).whiten(&values);
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
    assert_eq!((noise.s0, noise.s1), (0.003, 0.0));
}
