//! The air of the synthetic world: a mean jet of any profile, its radial flow integrated from
//! continuity, four lobes near the rotors.

use std::f64::consts::LN_2;

/// Half-widths up to which the profile is tabulated; beyond, the air is still.
const WIDEST_XI: f64 = 40.0;
/// Steps of the table per half-width: the trapezoidal sum of the flow is then good to 1e-4 of the
/// centreline.
const STEPS_PER_XI: f64 = 64.0;

/// A jet as the synthetic world has it; lengths over the motor distance, speeds over the induced
/// velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueJet {
    /// Decay constant.
    pub centreline: f64,
    /// Spreading rate.
    pub spreading: f64,
    /// Virtual origin, negative above the rotor plane.
    pub origin: f64,
    /// Shape across.
    pub profile: TrueProfile,
    /// Half-width and inverse speed of this drone's jet over those of the others: 1 without cant.
    pub width_factor: f64,
    /// Depth at which the lobes of the four rotors reach the axis.
    pub lobes_merge: f64,
}

/// Shapes of a jet, all 1 on the axis and one half at `ξ = 1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrueProfile {
    /// The paper's, `1/(1 + (√2 - 1) ξ²)²`.
    Paper,
    /// The paper's up to `ξ = 1`, `exp(-ln 2 ξ²)` outside.
    GaussianTail,
    /// `exp(-ln 2 ξ²)`.
    Gaussian,
    /// Flat in the middle, steep at the edge: `1/(1 + ξ⁶)`.
    TopHat,
}

impl Default for TrueJet {
    /// The paper's numbers.
    fn default() -> TrueJet {
        TrueJet {
            centreline: 10.11,
            spreading: 0.07668,
            origin: -5.817,
            profile: TrueProfile::Paper,
            width_factor: 1.0,
            lobes_merge: 2.0,
        }
    }
}

impl TrueProfile {
    /// Speed over that on the axis.
    #[must_use]
    pub fn shape(self, xi: f64) -> f64 {
        match self {
            TrueProfile::GaussianTail if xi > 1.0 => (-LN_2 * xi * xi).exp(),
            TrueProfile::Paper | TrueProfile::GaussianTail => {
                let bracket = xi.mul_add(xi * (2.0_f64.sqrt() - 1.0), 1.0);
                bracket.powi(-2)
            }
            TrueProfile::Gaussian => (-LN_2 * xi * xi).exp(),
            TrueProfile::TopHat => 1.0 / (1.0 + xi.powi(6)),
        }
    }
}

/// A jet ready to be asked.
#[derive(Clone, Debug)]
pub(super) struct PreparedJet {
    jet: TrueJet,
    /// Shape and `∫₀^ξ f ξ' dξ'` at multiples of the step.
    table: Vec<(f64, f64)>,
}

impl PreparedJet {
    pub(super) fn new(jet: TrueJet) -> PreparedJet {
        let steps = (WIDEST_XI * STEPS_PER_XI) as usize;
        let step = 1.0 / STEPS_PER_XI;
        let mut flow = 0.0;
        let mut table = Vec::with_capacity(steps + 1);
        for i in 0..=steps {
            let xi = i as f64 * step;
            let shape = jet.profile.shape(xi);
            if i > 0 {
                let before = xi - step;
                flow += 0.5 * step * (shape * xi + jet.profile.shape(before) * before);
            }
            table.push((shape, flow));
        }
        PreparedJet { jet, table }
    }

    /// Axial and radial speed below 2.5 motor distances.
    ///
    /// With `U_C ~ 1/σ` and `r_half ~ σ`, continuity gives `V = U_C S (ξ f - F/ξ)`, `F = ∫₀^ξ f ξ'
    /// dξ'`.
    fn far(&self, depth: f64, radius: f64) -> (f64, f64) {
        let q = self.jet.width_factor;
        let past_origin = depth - self.jet.origin;
        let centre = self.jet.centreline / past_origin / q;
        let spreading = q * self.jet.spreading;
        let xi = radius / (spreading * past_origin);
        let place = (xi * STEPS_PER_XI).min((self.table.len() - 2) as f64);
        let i = place as usize;
        let part = place - i as f64;
        let ((f0, flow0), (f1, flow1)) = (self.table[i], self.table[i + 1]);
        let (shape, flow) = (f0 + part * (f1 - f0), flow0 + part * (flow1 - flow0));
        let outwards = if xi < 1e-6 {
            0.0
        } else {
            xi * shape - flow / xi
        };
        (centre * shape, centre * spreading * outwards)
    }

    /// Axial and radial speed at a place in the body's horizontal frame: `x` forward, `y` left,
    /// depth below the rotors.
    ///
    /// Above 2.5: four Gaussians whose centres stand on the diagonals and come to the axis at
    /// `lobes_merge`, faded into the jet between 2 and 2.5. Chosen so that the distance of the
    /// lobes is known.
    pub(super) fn velocity(&self, x: f64, y: f64, depth: f64) -> (f64, f64) {
        let radius = x.hypot(y);
        if depth <= 0.0 {
            return (0.0, 0.0);
        }
        if depth >= 2.5 {
            return self.far(depth, radius);
        }
        let aside = self.lobe(depth);
        let width = 0.12 + 0.06 * depth;
        let gaussian = |from: f64, to: f64| (-0.5 * ((from - to) / width).powi(2)).exp();
        let lobes: f64 = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
            .into_iter()
            .map(|(i, j)| gaussian(x, i * aside) * gaussian(y, j * aside))
            .sum();
        let near = 1.2 * lobes / (1.0 + 3.0 * gaussian(aside, 0.0).powi(4)); // no more than 1.2 where all four meet
        let part = ((depth - 2.0) / 0.5).clamp(0.0, 1.0);
        let (far, outwards) = self.far(depth, radius);
        ((1.0 - part) * near + part * far, part * outwards)
    }

    /// `δ`: distance of the lobes from the axis along `x` and along `y`, from that of the rotors to
    /// 0.
    pub(super) fn lobe(&self, depth: f64) -> f64 {
        0.125_f64.sqrt() * (1.0 - depth / self.jet.lobes_merge).max(0.0)
    }
}
