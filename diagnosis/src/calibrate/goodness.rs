//! Whether one jet describes what was measured, and where not: the misfit of regions against what
//! resampling says that they vary.
//!
//! ```text
//! t_b = Σ_f z_bf / √(Σ_f z_bf²),    z_bf = misfit of region b in flight f, less what flight f does to it through the fitted constants
//! ```
//!
//! If the jet is right each flight's share is as likely up as down. Flipping the signs of whole
//! flights at random (all regions of a flight together) gives the largest `|t|` and the sum of `t²`
//! that noise makes.

use nalgebra::{Vector2, Vector3};

use super::calibration::{Goodness, Misfit, Options, Unit, Verdict};
use super::jet_fit::{Joint, xi};
use super::samples::quantile;
use super::spread::{Units, units};
use crate::statistics::draws::Draws;
use crate::statistics::quantile::interval_of;

/// Edges of the regions in `ξ`. Chosen here: halves where the profile bends, wider where there is
/// little air.
const XI_EDGES: [f64; 8] = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, f64::INFINITY];
/// Edges in depth over the motor distance. Chosen here, roughly doubling from the virtual origin.
const S_EDGES: [f64; 5] = [2.5, 4.0, 6.0, 10.0, f64::INFINITY];
/// Fewest cells of a region that is judged.
const FEWEST_CELLS: usize = 8;
/// Fewest flights or blocks: with nine, the 2⁹ patterns of signs cannot show 1 % in two looks from
/// two sides.
const FEWEST_UNITS: usize = 10;
/// A jet is called poor where noise makes as much misfit in 1 % of cases or fewer, and ...
const POOR_P: f64 = 0.01;
/// ... some region is off by this part of the centreline speed: less could not be flown
/// differently. Chosen here.
const LEAST_MISFIT: f64 = 0.004;

#[derive(Clone, Debug, Default)]
struct MisfitRegion {
    cells: usize,
    /// Σ w U_C r and Σ w U_C².
    weighted: f64,
    weights: f64,
    /// Misfit by unit.
    by_unit: Vec<f64>,
    /// What the constants do to it: Σ w U_C · freed gradient.
    by_constants: Vector3<f64>,
    /// What gain and zero of each flight do to it.
    by_instrument: Vec<Vector2<f64>>,
}

pub(super) fn goodness(joint: &Joint<'_>, options: &Options) -> Goodness {
    match units(joint, FEWEST_UNITS) {
        Some(units) => judge(joint, &units, options),
        None => Goodness {
            verdict: Verdict::Undecided,
            p: 1.0,
            rms_over_centreline: 0.0,
            regions: Vec::new(),
            sentence: sentence(Verdict::Undecided, 1.0, &[]),
        },
    }
}

fn judge(joint: &Joint<'_>, units: &Units, options: &Options) -> Goodness {
    let data = joint.data;
    let within = |edges: &[f64], value: f64| interval_of(edges, value).unwrap_or(0);
    let columns = S_EDGES.len() - 1;
    let empty = MisfitRegion {
        by_unit: vec![0.0; units.units.len()],
        by_instrument: vec![Vector2::zeros(); data.flights.len()],
        ..MisfitRegion::default()
    };
    let mut regions = vec![empty; (XI_EDGES.len() - 1) * columns];
    let mut squares = 0.0;
    for (i, (cell, fitted)) in data.cells.iter().zip(&joint.cells).enumerate() {
        let operator = &data.flights[cell.flight].operator;
        let centre_mps = operator.centreline_mps(&joint.constants, cell.s);
        squares += (fitted.residual_mps / centre_mps).powi(2);
        let row = within(&XI_EDGES, xi(&joint.constants, cell.s, cell.r));
        let region = &mut regions[row * columns + within(&S_EDGES, cell.s)];
        let weight = fitted.weight() * centre_mps;
        region.cells += 1;
        region.weighted += weight * fitted.residual_mps;
        region.weights += weight * centre_mps;
        region.by_unit[units.unit_of[i]] += weight * fitted.residual_mps;
        region.by_constants += weight * units.freed[i];
        region.by_instrument[cell.flight] += weight * Vector2::new(fitted.predicted_mps, 1.0);
    }
    let enough = |b: &usize| regions[*b].cells >= FEWEST_CELLS;
    let judged: Vec<usize> = (0..regions.len()).filter(enough).collect();
    let of_region = |b: &usize| {
        let shares = shares(&regions[*b], joint, units);
        let error = shares.iter().map(|share| share * share).sum::<f64>().sqrt();
        (shares, error.max(f64::MIN_POSITIVE))
    };
    let shares: Vec<(Vec<f64>, f64)> = judged.iter().map(of_region).collect();
    let seen = |(shares, error): &(Vec<f64>, f64)| shares.iter().sum::<f64>() / error;
    let t: Vec<f64> = shares.iter().map(seen).collect();
    let (p, most_in_noise) = against_noise(&shares, &t, options);
    let deepest = data.cells.iter().map(|cell| cell.s).fold(0.0, f64::max);
    let misfit = |(&b, &t): (&usize, &f64)| {
        let (row, column, region) = (b / columns, b % columns, &regions[b]);
        Misfit {
            xi_from: XI_EDGES[row],
            xi_to: XI_EDGES[row + 1].min(6.0),
            s_from: S_EDGES[column],
            s_to: S_EDGES[column + 1].min(deepest),
            cells: region.cells,
            mean: region.weighted / region.weights,
            t,
            significant: t.abs() > most_in_noise,
        }
    };
    let misfits: Vec<Misfit> = judged.iter().zip(&t).map(misfit).collect();
    let verdict = verdict(units.units.len(), p, &misfits);
    Goodness {
        verdict,
        p,
        rms_over_centreline: (squares / data.cells.len() as f64).sqrt(),
        sentence: sentence(verdict, p, &misfits),
        regions: misfits,
    }
}

/// What each unit adds to the misfit of a region, its pull on the fitted constants taken off.
fn shares(region: &MisfitRegion, joint: &Joint<'_>, units: &Units) -> Vec<f64> {
    let through = units.inverse * region.by_constants;
    let own = region.by_unit.iter().zip(&units.units);
    let shares = own.map(|(own, unit)| own - through.dot(&unit.pull));
    let mut shares: Vec<f64> = shares.collect();
    if units.unit == Unit::Block {
        // Blocks of one flight share its gain and zero, which were fitted too.
        for (i, (cell, fitted)) in joint.data.cells.iter().zip(&joint.cells).enumerate() {
            let columns = Vector2::new(fitted.predicted_mps, 1.0);
            let inverse = &joint.nuisance_inverse[cell.flight];
            let moved = region.by_instrument[cell.flight].dot(&(inverse * columns));
            shares[units.unit_of[i]] -= fitted.weight() * fitted.residual_mps * moved;
        }
    }
    shares
}

/// p-value of such a misfit, and the largest `|t|` of all regions that noise exceeds in 5 % of
/// cases.
///
/// `shares`: of every region what each unit adds, and the root of the sum of squares of that.
fn against_noise(shares: &[(Vec<f64>, f64)], t: &[f64], options: &Options) -> (f64, f64) {
    let most = |t: &[f64]| t.iter().fold(0.0_f64, |most, t| most.max(t.abs()));
    let sum = |t: &[f64]| t.iter().map(|t| t * t).sum::<f64>();
    let units = shares.first().map_or(0, |(shares, _)| shares.len());
    if units < FEWEST_UNITS {
        return (1.0, f64::INFINITY);
    }
    let (seen_most, seen_sum) = (most(t), sum(t));
    let mut random = Draws::new(options.seed ^ 0x676F_6F64_6E65_7373);
    let (mut more, mut larger) = (0_usize, 0_usize);
    let mut in_noise = Vec::with_capacity(options.draws);
    let mut signs = vec![0.0; units];
    for _ in 0..options.draws {
        signs.fill_with(|| random.sign());
        let flip = |(shares, error): &(Vec<f64>, f64)| {
            let flipped = shares.iter().zip(&signs).map(|(share, sign)| share * sign);
            flipped.sum::<f64>() / error
        };
        let flipped: Vec<f64> = shares.iter().map(flip).collect();
        more += usize::from(most(&flipped) >= seen_most);
        larger += usize::from(sum(&flipped) >= seen_sum);
        in_noise.push(most(&flipped));
    }
    // Two looks at the same data: the smaller counts twice.
    let p = 2.0 * (1 + more.min(larger)) as f64 / (1 + options.draws) as f64;
    (p.min(1.0), quantile(&mut in_noise, 0.95))
}

fn verdict(units: usize, p: f64, misfits: &[Misfit]) -> Verdict {
    if units < FEWEST_UNITS {
        return Verdict::Undecided;
    }
    let mut sizes = misfits.iter().map(|misfit| misfit.mean.abs());
    match p <= POOR_P && sizes.any(|size| size >= LEAST_MISFIT) {
        true => Verdict::Poor,
        false => Verdict::Fits,
    }
}

fn sentence(verdict: Verdict, p: f64, misfits: &[Misfit]) -> String {
    // Where it stands out, the largest; where nothing does by itself, the clearest.
    let rank = |misfit: &Misfit| match misfit.significant {
        true => (1, misfit.mean.abs()),
        false => (0, misfit.t.abs()),
    };
    let worst = misfits.iter().max_by(|a, b| {
        let ((ra, a), (rb, b)) = (rank(a), rank(b));
        ra.cmp(&rb).then(a.total_cmp(&b))
    });
    match (verdict, worst) {
        (Verdict::Undecided, _) | (_, None) => {
            "too few flights to say whether one jet describes them".to_owned()
        }
        (Verdict::Fits, Some(_)) => {
            format!(
                "one jet describes what was measured (p = {p:.2} that chance alone misfits so much)"
            )
        }
        (Verdict::Poor, Some(worst)) => {
            let side = ["weaker", "stronger"][usize::from(worst.mean > 0.0)];
            format!(
                "the fit is poor (p = {p:.4}): most at xi {} to {}, s/l {} to {:.1}, where the air is {side} than the jet by \
                 {:.1} % of the centreline speed; the intervals of the constants assume a shape that the data contradict",
                worst.xi_from,
                worst.xi_to,
                worst.s_from,
                worst.s_to,
                100.0 * worst.mean.abs()
            )
        }
    }
}
