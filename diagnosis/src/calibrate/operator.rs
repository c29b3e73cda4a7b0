//! What a probe reads of a jet with given constants, and how that changes with them.
//!
//! ```text
//! reading = √( (1 + 2 i²) U² + V² + a² )       a magnitude probe: ambient speed a, lateral turbulence i (0 unless wanted)
//! reading = U                                  an axial one
//! ```
//!
//! `U` and `V` are those of [`airflow::FarField`]; written once more here because the fit needs their derivatives by `B`, `S` and
//! `s₀`, and a test holds the two together. A scalar is never taken off a reading.

use nalgebra::Vector3;

/// `a = √2 - 1` of the paper's profile.
const PROFILE_A: f64 = std::f64::consts::SQRT_2 - 1.0;

/// What one flight and its probe bring to a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Operator {
    /// `U_H` (m/s).
    pub(super) induced_velocity_mps: f64,
    /// Ambient speed (m/s); 0 for an axial probe.
    pub(super) ambient_mps: f64,
    /// 1 where the probe sees the radial flow, else 0.
    pub(super) radial: f64,
    /// Lateral turbulence over the local mean; 0 for an axial probe.
    pub(super) lateral: f64,
}

/// `B`, `S`, `s₀`.
pub(super) type Constants = Vector3<f64>;

/// A predicted reading.
#[derive(Clone, Copy, Debug)]
pub(super) struct Predicted {
    /// (m/s)
    pub(super) reading_mps: f64,
    /// By `B`, `S`, `s₀`.
    pub(super) gradient: Vector3<f64>,
}

/// `ξ` at a place.
pub(super) fn xi(constants: &Constants, s_over_l: f64, r_over_l: f64) -> f64 {
    r_over_l / (constants[1] * (s_over_l - constants[2]))
}

impl Operator {
    /// Speed on the axis (m/s).
    pub(super) fn centreline_mps(&self, constants: &Constants, s_over_l: f64) -> f64 {
        self.induced_velocity_mps * constants[0] / (s_over_l - constants[2])
    }

    /// Mean axial speed alone (m/s).
    pub(super) fn axial_mps(&self, constants: &Constants, s_over_l: f64, r_over_l: f64) -> f64 {
        let xi = xi(constants, s_over_l, r_over_l);
        self.centreline_mps(constants, s_over_l) / (1.0 + PROFILE_A * xi * xi).powi(2)
    }

    /// The reading at a depth and radius over the motor distance.
    pub(super) fn predict(&self, constants: &Constants, s_over_l: f64, r_over_l: f64) -> Predicted {
        let (centreline, spreading) = (constants[0], constants[1]);
        let sigma = s_over_l - constants[2];
        let centre_mps = self.induced_velocity_mps * centreline / sigma;
        let xi = r_over_l / (spreading * sigma);
        let x = PROFILE_A * xi * xi;
        let inverse = 1.0 / (1.0 + x);
        let axial_mps = centre_mps * inverse * inverse;
        // ξ ∂/∂ξ of the two profiles: what a change of width does to them.
        let axial_slope_mps = -4.0 * x * axial_mps * inverse;
        let spread_mps = self.radial * centre_mps * spreading;
        let radial_mps = spread_mps * 0.5 * xi * (1.0 - x) * inverse * inverse;
        let radial_slope_mps =
            spread_mps * 0.5 * xi * (1.0 - 6.0 * x + x * x) * inverse * inverse * inverse;
        let axial_share = 1.0 + 2.0 * self.lateral * self.lateral;
        let reading_mps = (axial_share * axial_mps * axial_mps
            + radial_mps * radial_mps
            + self.ambient_mps * self.ambient_mps)
            .sqrt();
        if reading_mps == 0.0 {
            let gradient = Vector3::zeros();
            return Predicted {
                reading_mps,
                gradient,
            };
        }
        let by = |axial: f64, radial: f64| {
            (axial_share * axial_mps * axial + radial_mps * radial) / reading_mps
        };
        let gradient = Vector3::new(
            by(axial_mps, radial_mps) / centreline,
            by(-axial_slope_mps, radial_mps - radial_slope_mps) / spreading,
            by(axial_mps + axial_slope_mps, radial_mps + radial_slope_mps) / sigma,
        );
        Predicted {
            reading_mps,
            gradient,
        }
    }
}

#[cfg(test)]
mod tests {
    use airflow::{FarField, Jet};

    use super::*;

    const OPERATOR: Operator = Operator {
        induced_velocity_mps: 7.41,
        ambient_mps: 0.09,
        radial: 1.0,
        lateral: 0.0,
    };
    const PLACES: [(f64, f64); 5] = [(2.6, 0.0), (3.0, 0.5), (6.0, 1.4), (12.0, 3.0), (20.0, 9.0)];

    fn constants() -> Constants {
        let jet = Jet::default();
        Constants::new(jet.centreline, jet.spreading, jet.origin)
    }

    #[test]
    fn a_reading_is_made_of_the_speeds_of_airflow() {
        let l_m = 0.118;
        let far = FarField::new(7.41, l_m, 1.0, &Jet::default());
        for (s, r) in PLACES {
            let axial_mps = far.axial_speed_mps(s * l_m, r * l_m).expect("deep");
            let radial_mps = far.radial_speed_mps(s * l_m, r * l_m).expect("deep");
            let expected_mps = axial_mps.hypot(radial_mps).hypot(0.09);
            let found_mps = OPERATOR.predict(&constants(), s, r).reading_mps;
            assert!(
                (found_mps - expected_mps).abs() < 1e-12,
                "{found_mps} {expected_mps}"
            );
        }
    }

    #[test]
    fn the_gradient_is_that_of_the_reading() {
        let turbulent = Operator {
            lateral: 0.2,
            ..OPERATOR
        };
        for operator in [OPERATOR, turbulent] {
            for (s, r) in PLACES {
                let at = operator.predict(&constants(), s, r);
                for k in 0..3 {
                    let step = 1e-5 * constants()[k].abs();
                    let moved = |by: f64| {
                        let mut moved = constants();
                        moved[k] += by;
                        operator.predict(&moved, s, r).reading_mps
                    };
                    let slope = (moved(step) - moved(-step)) / (2.0 * step);
                    // Central differences: (1e-5)² of the third derivative, and rounding over the step.
                    let off = (slope - at.gradient[k]).abs();
                    assert!(
                        off < 1e-7 * (1.0 + slope.abs()),
                        "{s} {r} {k}: {slope} {}",
                        at.gradient[k]
                    );
                }
            }
        }
    }
}
