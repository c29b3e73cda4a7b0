//! What a caller may choose, and why the defaults are what they are.

/// How to calibrate. The default is the paper's way wherever the paper says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Readings count while the drone is slower than this (m/s); the paper's 0.1.
    pub slower_than_mps: f64,
    /// Depth of a grid cell over the motor distance. Chosen here: the centreline changes by 3 % over it at 2.5 l.
    pub cell_s_over_l: f64,
    /// Width of a grid cell over the motor distance. Chosen here: a sixth of the half-width at 2.5 l.
    pub cell_r_over_l: f64,
    /// Thickness of a slice of depth over the motor distance, for profiles. Chosen here: the jet widens by 12 % over it at 2.5 l.
    pub slice_s_over_l: f64,
    /// Standard deviation of each lateral speed over the local mean, which a magnitude probe reads in quadrature. 0, the default:
    /// the fitted jet is what such a probe reads. Round jets have about 0.2 on the axis (recalled), which would lower `B` by 4 %.
    pub lateral_turbulence: f64,
    /// Bootstrap draws.
    pub draws: usize,
    /// Fewest flights in the fit that are resampled as wholes; with fewer, blocks of time are. Chosen here: below eight the
    /// interval of a mean of flights is already a fifth wider by Student's t alone.
    pub fewest_flights: usize,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            slower_than_mps: 0.1,
            cell_s_over_l: 0.25,
            cell_r_over_l: 0.1,
            slice_s_over_l: 1.0,
            lateral_turbulence: 0.0,
            draws: 1999,
            fewest_flights: 8,
            seed: 0,
        }
    }
}
