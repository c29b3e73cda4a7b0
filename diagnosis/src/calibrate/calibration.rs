//! What a calibration says: the jet with its intervals, how well it fits and where not, and
//! everything that a figure of it needs.
//!
//! Plain data. Lengths are over the motor distance `l`, speeds over the induced velocity `U_H`,
//! except where a name ends in a unit.

use airflow::Jet;
use serde::Serialize;

/// How to calibrate. The default follows the paper wherever the paper says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Standard deviation of each lateral speed over the local mean, which a magnitude probe reads
    /// in quadrature. 0, the default: the fitted jet is what such a probe reads. Assumed here,
    /// because round jets have about 0.2 on the axis (Panchapakesan & Lumley 1993, J. Fluid Mech.
    /// 246:197), which would lower `B` by 4 %.
    pub lateral_turbulence: f64,
    /// How often the flights' or blocks' signs are drawn, for the p-value of the misfit.
    pub draws: usize,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            lateral_turbulence: 0.0,
            draws: 1999,
            seed: 0,
        }
    }
}

/// A range that holds the true value with 95 % confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// `half` to either side of a value.
    pub(super) fn around(value: f64, half: f64) -> Interval {
        Interval {
            low: value - half,
            high: value + half,
        }
    }
}

/// An estimate and its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The value that fits best.
    pub value: f64,
    /// Where it may lie.
    pub interval: Interval,
}

/// Everything that a calibration says.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// `B`, `S`, `s₀` over all drones without cant.
    pub jet: FittedJet,
    /// How well one jet describes all of them.
    pub goodness: Goodness,
    /// One for every airframe, in the order of the recordings: canted ones stand beside the fit,
    /// not in it.
    pub drones: Vec<DroneFit>,
    /// The paper's residual test per interval of `ξ`.
    pub residual_tests: ResidualTests,
    /// What was read, used and dropped.
    pub counts: Counts,
    /// The recordings used, by name, in order.
    pub recordings: Vec<String>,
    /// Sentences that a reader of the numbers must know.
    pub caveats: Vec<String>,
}

/// The three constants of the jet with their intervals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FittedJet {
    /// `B`, see [`airflow::Jet::centreline`].
    pub centreline: Estimate,
    /// `S`, see [`airflow::Jet::spreading`].
    pub spreading: Estimate,
    /// `s₀`, see [`airflow::Jet::origin`].
    pub origin: Estimate,
    /// Correlations of the three estimates.
    pub correlation: Correlation,
    /// How the intervals were made.
    pub resampling: Resampling,
    /// `B` with an interval that also holds if all flights shared one gain of the probe, which
    /// resampling cannot see.
    pub centreline_if_one_gain: Interval,
    /// Gain of the probe as estimated for each flight in the fit (0: as stated), shrunk towards 0
    /// by the stated accuracy.
    pub gains: Vec<FlightGain>,
}

impl FittedJet {
    /// The constants alone.
    #[must_use]
    pub fn jet(&self) -> Jet {
        Jet {
            centreline: self.centreline.value,
            spreading: self.spreading.value,
            origin: self.origin.value,
        }
    }
}

/// Correlations of the estimates of `B`, `S` and `s₀`, each from -1 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Correlation {
    /// Of `B` with `S`.
    pub centreline_spreading: f64,
    /// Of `B` with `s₀`.
    pub centreline_origin: f64,
    /// Of `S` with `s₀`.
    pub spreading_origin: f64,
}

/// What was left out one at a time for the intervals: jackknife errors times Student's t.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub struct Resampling {
    /// What was left out as a whole.
    pub unit: Unit,
    /// How many there are.
    pub units: usize,
    /// Shortest block (s), where blocks were left out.
    pub block_s: Option<f64>,
}

/// What is left out as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// Whole flights: gain and background of a flight are left out with it.
    Flight,
    /// Blocks of time, where there are too few flights; the probe's stated accuracy is then added.
    Block,
}

/// The gain of the probe over one flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FlightGain {
    /// Name of the recording.
    pub recording: String,
    /// Estimate of (true gain - 1).
    pub gain: f64,
    /// Estimate of the offset (m/s).
    pub offset_mps: f64,
}

/// How well one jet describes what was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Goodness {
    /// The answer.
    pub verdict: Verdict,
    /// Probability of a misfit at least as large if the jet were right.
    pub p: f64,
    /// Root mean square of the cells' misfit over the centreline speed.
    pub rms_over_centreline: f64,
    /// Mean misfit by region, every region that has cells; `significant` ones are where the jet is
    /// wrong.
    pub regions: Vec<Misfit>,
    /// One sentence for a person.
    pub sentence: String,
}

/// Whether the jet fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing speaks against it.
    Fits,
    /// The shape is wrong: intervals of the parameters mean little.
    Poor,
    /// Too few flights or blocks to judge.
    Undecided,
}

/// Mean difference between measured and fitted speed in one region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Misfit {
    /// Radius over half-width, from.
    pub xi_from: f64,
    /// To.
    pub xi_to: f64,
    /// Depth over motor distance, from.
    pub s_from: f64,
    /// To.
    pub s_to: f64,
    /// How many cells.
    pub cells: usize,
    /// Measured minus fitted, over the centreline speed.
    pub mean: f64,
    /// The same over its standard error, as resampling has it.
    pub t: f64,
    /// Whether it stands out beyond what the largest of all regions would in noise (5 %).
    pub significant: bool,
}

/// One airframe: what was measured below it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DroneFit {
    /// Name of the airframe.
    pub airframe: String,
    /// Whether it took part in the joint fit; canted ones do not.
    pub in_fit: bool,
    /// `U_H` (m/s), mean over its flights.
    pub induced_velocity_mps: f64,
    /// `l` (m).
    pub motor_distance_m: f64,
    /// Flights, readings and cells used.
    pub flights: usize,
    /// Readings used, near field included.
    pub samples: usize,
    /// Radial profiles, shallowest first; those above 2.5 l are not fitted.
    pub profiles: Vec<Profile>,
    /// Near-field lobes, shallowest first.
    pub lobes: Vec<Lobes>,
    /// Depths between which the lobes reach the axis: the last slice with two maxima and the first
    /// with one.
    pub lobes_merge_s_over_l: Option<Interval>,
    /// Fitted over measured by interval of `ξ`, with the joint jet: where a drone beside the fit
    /// departs from it.
    pub departures: Vec<Departure>,
}

/// A radial profile in one slice of depth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Profile {
    /// Slice, from.
    pub s_from: f64,
    /// To.
    pub s_to: f64,
    /// Mean depth of its readings.
    pub s_over_l: f64,
    /// Medians by radius, innermost first.
    pub bins: Vec<RadialBin>,
    /// This slice fitted alone, where it reaches far enough.
    pub fit: Option<SliceFit>,
}

/// Median of the readings between two radii, nothing subtracted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RadialBin {
    /// Mean radius of its readings.
    pub r_over_l: f64,
    /// Median of the readings' medians per grid cell.
    pub median: f64,
    /// 16 % of the readings are lower: the lower edge of the 1-sigma band.
    pub low: f64,
    /// 84 % are lower: the upper edge.
    pub high: f64,
    /// How many readings.
    pub samples: usize,
    /// From how many flights.
    pub flights: usize,
}

/// Centreline and half-width of one slice: a point of the paper's expansion figure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SliceFit {
    /// `U_C/U_H`.
    pub centreline: Estimate,
    /// `r_half/l`.
    pub half_width: Estimate,
}

/// Two maxima along the body's y axis: `A (exp(-(y-δ)²/(2w²)) + exp(-(y+δ)²/(2w²)))`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Lobes {
    /// Mean depth of the slice.
    pub s_over_l: f64,
    /// `δ/l`.
    pub delta: Estimate,
    /// `w/l`: the sum has one maximum, on the axis, where `δ ≤ w`.
    pub width: f64,
    /// Peak speed of the fitted profile.
    pub peak: f64,
    /// How many readings.
    pub samples: usize,
}

/// How far one drone departs from the joint jet in one interval of `ξ`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Departure {
    /// Radius over half-width, from.
    pub xi_from: f64,
    /// To.
    pub xi_to: f64,
    /// How many cells.
    pub cells: usize,
    /// Mean of measured minus fitted, over the centreline speed.
    pub mean: f64,
    /// Standard deviation of the same over the cells.
    pub deviation: f64,
}

/// The paper's residual test, twice: through the observation operator, and as the paper does it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ResidualTests {
    /// `ε = (predicted reading - reading)/U_C`, the prediction with radial flow and ambient speed
    /// in it.
    pub through_operator: Vec<ResidualTest>,
    /// `ε = (U_theory - (reading - ambient))/U_C`, a scalar taken off the reading.
    pub scalar_subtracted: Vec<ResidualTest>,
    /// What the numbers cannot bear.
    pub caveats: Vec<String>,
}

/// One row: is the mean of `ε` above 0 between two values of `ξ`?
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ResidualTest {
    /// Radius over half-width, from.
    pub xi_from: f64,
    /// To.
    pub xi_to: f64,
    /// How many grid cells.
    pub n: usize,
    /// How many independent ones they are worth, by their autocorrelation in time and by what the
    /// stated accuracy of their probes lets whole flights share.
    pub n_effective: f64,
    /// Mean of `ε`.
    pub mean: f64,
    /// Standard deviation of `ε`.
    pub deviation: f64,
    /// Student's t with `n`, as the paper has it.
    pub t: f64,
    /// One-sided probability of such a t with `n`.
    pub p: f64,
    /// Student's t with `n_effective`.
    pub t_effective: f64,
    /// One-sided probability with `n_effective`.
    pub p_effective: f64,
    /// The same after Holm's correction for the number of rows.
    pub p_effective_holm: f64,
    /// `p <= 0.05`: the paper's answer.
    pub above_zero: bool,
    /// `p_effective_holm <= 0.05`: the answer that bears repeating.
    pub above_zero_corrected: bool,
    /// Probability of the histogram of `ε` if it were normal (chi-squared test); `None`: too few
    /// cells.
    pub p_normal: Option<f64>,
}

/// Readings and cells: read, used, dropped and why.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Counts {
    /// Readings in the recordings.
    pub read: usize,
    /// Readings used in the far field.
    pub far: usize,
    /// Of those the ones that the joint fit compares: below drones without cant.
    pub fitted: usize,
    /// Readings used in the near field.
    pub near: usize,
    /// Grid cells of single flights that the joint fit compares.
    pub cells: usize,
    /// Readings left out, by reason, the most frequent first.
    pub dropped: Vec<DroppedCount>,
}

/// How many readings were left out for one reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct DroppedCount {
    /// Why.
    pub reason: Dropped,
    /// How many.
    pub samples: usize,
}

/// Why a reading is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Dropped {
    /// Not a finite speed of 0 or more.
    NotAReading,
    /// No drone's track covers the time, or only with a gap.
    NoTrack,
    /// No drone was in the air.
    #[serde(rename = "nobody_blows")]
    NoneFlying,
    /// Two or more drones were in the air.
    #[serde(rename = "several_blow")]
    SeveralFlying,
    /// The drone moved at 0.1 m/s or faster while the probe averaged.
    Moving,
    /// The probe stood above the rotor plane.
    Above,
    /// So near the floor that the jet spreads along it.
    NearFloor,
    /// Farther out than the model is compared.
    FarOut,
}

/// The fitted jet with its intervals and where it comes from, as RON that a scenario cites: `air:
/// (jet: "jet.ron")`.
///
/// ```text
/// Jet(
///     centreline: 10.11,           B; the three constants are required
///     spreading: 0.07668,          S
///     origin: -5.817,              s₀ in motor distances
///     centreline_95: (9.8, 10.4),  95 % intervals, and what else is known: optional
///     ...
/// )
/// ```
///
/// It names recordings and counts, no date: the same recordings give the same bytes.
#[must_use]
pub fn jet_ron(calibration: &Calibration) -> String {
    let jet = &calibration.jet;
    let mut text = String::from(
        "// The mean jet below hovering drones, calibrated: U_C/U_H = centreline/(s/l - origin), half-width/l = spreading (s/l - origin).\n\
         // A scenario flies with it: air: (jet: \"jet.ron\")\n\
         Jet(\n",
    );
    let constants: [(&str, &Estimate, usize); 3] = [
        ("centreline", &jet.centreline, 4),
        ("spreading", &jet.spreading, 6),
        ("origin", &jet.origin, 4),
    ];
    let mut member = |key: &str, value: String| text.push_str(&format!("    {key}: {value},\n"));
    let tuple = |values: &[f64], digits: usize| {
        let values = values.iter().map(|value| format!("{value:.digits$}"));
        format!("({})", values.collect::<Vec<String>>().join(", "))
    };
    for (key, estimate, digits) in constants {
        member(key, format!("{:.digits$}", estimate.value));
    }
    for (key, estimate, digits) in constants {
        let Interval { low, high } = estimate.interval;
        member(&format!("{key}_95"), tuple(&[low, high], digits));
    }
    let Interval { low, high } = jet.centreline_if_one_gain;
    member(
        "// If all flights shared one gain of the probe, which resampling cannot see:\n    \
         centreline_95_if_one_gain",
        tuple(&[low, high], 4),
    );
    let of = &jet.correlation;
    let correlations = [
        of.centreline_spreading,
        of.centreline_origin,
        of.spreading_origin,
    ];
    member(
        "// Of centreline with spreading, centreline with origin, spreading with origin:\n    \
         correlation",
        tuple(&correlations, 3),
    );
    let (goodness, counts) = (&calibration.goodness, &calibration.counts);
    let fit = format!("// {}\n    fit", goodness.sentence);
    member(&fit, format!("{:?}", goodness.verdict));
    member("readings", counts.fitted.to_string());
    member("cells", counts.cells.to_string());
    member("flights", jet.gains.len().to_string());
    // Rust and RON escape a text alike.
    let names = calibration.recordings.iter();
    let names: String = names.map(|name| format!("        {name:?},\n")).collect();
    member("recordings", format!("[\n{names}    ]"));
    text + ")\n"
}
