//! Synthetic residuals of probes in a jet: dwells, turbulence with memory, calibration errors, and
//! an effect.

use diagnosis::statistics::draws::Draws;

/// What synthetic recordings of one sort hold.
#[derive(Clone, Copy)]
pub(super) struct Sort {
    pub(super) name: &'static str,
    pub(super) samples: usize,
    pub(super) probes: usize,
    pub(super) step_s: f64,
    /// Longest stay at a place (s); stays last from a third of it.
    pub(super) dwell_s: f64,
    pub(super) rho: f64,
    /// Turbulence over flow, and that of a dwell's own error over the same.
    pub(super) s1: f64,
    pub(super) dwell_error: f64,
    /// Degrees of freedom of heavy tails; 0: normal.
    pub(super) heavy: usize,
    /// Largest gain error, per probe; offset 0.04 at most.
    pub(super) gain: f64,
    /// A law's size in standard errors.
    pub(super) signal: f64,
    /// Share of samples it shows in.
    pub(super) share: f64,
}

pub(super) const PLAIN: Sort = Sort {
    name: "plain, 1200 at 1 Hz",
    samples: 1200,
    probes: 1,
    step_s: 1.0,
    dwell_s: 30.0,
    rho: 0.3,
    s1: 0.12,
    dwell_error: 0.0,
    heavy: 0,
    gain: 0.05,
    signal: 0.0,
    share: 1.0,
};

pub(super) const S0: f64 = 0.03;
pub(super) const RESOLUTION: f64 = 0.01;
pub(super) const GAIN_BOUND: f64 = 0.05;
pub(super) const OFFSET_BOUND: f64 = 0.04;

pub(super) struct Made {
    pub(super) t_s: Vec<f64>,
    pub(super) series: Vec<usize>,
    pub(super) flow: Vec<f64>,
    pub(super) residual: Vec<f64>,
    pub(super) covariates: Vec<Vec<f64>>,
    pub(super) laws: Vec<Vec<f64>>,
}

/// Dwells at random places of a jet: flow falls with depth and distance; six covariates of the
/// place, four of the time.
pub(super) fn make(kind: &Sort, seed: u64) -> Made {
    let mut draws = Draws::new(seed);
    let mut made = Made {
        t_s: Vec::new(),
        series: Vec::new(),
        flow: Vec::new(),
        residual: Vec::new(),
        covariates: vec![Vec::new(); 12],
        laws: vec![Vec::new(); 16],
    };
    let per_probe = kind.samples / kind.probes;
    // Where the drone is, alike for all probes.
    let mut places = Vec::new();
    let (mut place, mut until_s, mut dwell) = ([0.0; 4], 0.0, 0);
    for i in 0..per_probe {
        let t_s = i as f64 * kind.step_s;
        if t_s >= until_s {
            until_s = t_s + kind.dwell_s * (1.0 + 2.0 * draws.uniform()) / 3.0;
            place = [(); 4].map(|()| draws.uniform());
            dwell += 1;
        }
        places.push((t_s, place, dwell));
    }
    for probe in 0..kind.probes {
        let gain = kind.gain * (2.0 * draws.uniform() - 1.0);
        let offset = OFFSET_BOUND * (2.0 * draws.uniform() - 1.0);
        let height = draws.uniform();
        let mut state = draws.normal();
        let (mut own, mut of_dwell) = (0.0, 0);
        for &(t_s, place, dwell) in &places {
            if dwell != of_dwell {
                (own, of_dwell) = (draws.normal(), dwell);
            }
            let depth = 2.0 + 10.0 * (0.7 * place[0] + 0.3 * height);
            let xi = 4.0 * place[1] * place[1];
            let azimuth = std::f64::consts::TAU * place[2];
            let flow = 20.0 / (depth + 5.8) / (1.0 + 0.6 * xi * xi).powi(2);
            let step = if kind.heavy > 0 {
                let chi2: f64 = (0..kind.heavy).map(|_| draws.normal().powi(2)).sum();
                let scale = (kind.heavy as f64 - 2.0) / chi2;
                draws.normal() * scale.sqrt()
            } else {
                draws.normal()
            };
            state = kind.rho * state + (1.0 - kind.rho * kind.rho).sqrt() * step;
            let sd = S0.hypot(kind.s1 * flow);
            let error = sd * (state + kind.dwell_error * own);
            let rare = if place[3] < kind.share { 1.0 } else { 0.0 };
            made.t_s.push(t_s);
            made.series.push(probe);
            made.flow.push(flow);
            made.residual.push(gain * flow + offset + error);
            let (sin, cos) = azimuth.sin_cos();
            let jitter = draws.uniform();
            let covariates = [
                depth,
                xi,
                azimuth,
                cos,
                sin,
                t_s,
                flow,
                place[3],
                place[3] * depth,
                jitter,
                flow * cos,
                height + 0.1 * place[0],
            ];
            for (into, value) in made.covariates.iter_mut().zip(covariates) {
                into.push(value);
            }
            let laws = [
                rare * flow * cos * depth,
                flow * xi,
                flow * sin * depth,
                flow * (1.0 - xi),
                flow * depth,
                flow * xi * xi * (-xi).exp(),
                flow * place[3],
                (-depth).exp(),
                flow * (2.0 * azimuth).cos(),
                flow * flow,
                t_s,
                flow * t_s,
                (-xi).exp() * cos,
                (4.0 * azimuth).cos() * flow * (-depth).exp(),
                if place[3] < 0.03 { flow } else { 0.0 },
                if depth < 3.0 { flow } else { 0.0 },
            ];
            for (into, value) in made.laws.iter_mut().zip(laws) {
                into.push(value);
            }
        }
    }
    if kind.signal > 0.0 {
        let norm: f64 = made.laws[0]
            .iter()
            .zip(&made.flow)
            .map(|(g, &u)| (g / S0.hypot(kind.s1 * u)).powi(2))
            .sum();
        // What memory takes off the weight of a law that is level over it.
        let norm = norm * (1.0 - kind.rho) / (1.0 + kind.rho);
        // A rare law may have met no dwell.
        let size = if norm > 0.0 {
            kind.signal / norm.sqrt()
        } else {
            0.0
        };
        for (residual, g) in made.residual.iter_mut().zip(&made.laws[0]) {
            *residual += size * g;
        }
    }
    for (residual, flow) in made.residual.iter_mut().zip(&made.flow) {
        // What the instrument shows, less what was simulated.
        *residual = ((*residual + flow) / RESOLUTION).round() * RESOLUTION - flow;
    }
    made
}
