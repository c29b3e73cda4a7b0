//! Slips of a recording that only the air shows: readings in another unit, axes that are swapped or
//! turned, coordinates in centimetres. They are looked for before any physics: momentum fixes how
//! fast the air below a drone is, and no wake moves from one axis to another.
//!
//! Each slip is undone on a copy, and the readings are compared with the simulation again, up to a
//! factor. A slip is named where undoing it explains what no scale and no clock of an instrument
//! does: those are faults that a diagnosis names.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::forward::flow::Flow;
use crate::forward::hypothesis::CLOCK_RANGE_S;
use crate::record::recording::{ProbeSample, Probes, Recording};
use crate::statistics::quantile::median;

/// Most readings that are compared; more are thinned evenly. Chosen here: a share that is left
/// unexplained is known to 0.05 from 400.
const READINGS: usize = 400;
/// Fewest readings, and fewest times the accuracy that the fastest simulated air has. Chosen here:
/// less says nothing about either.
const FEWEST: usize = 40;
const ABOVE_ACCURACY: f64 = 5.0;
/// Readings over simulation that momentum allows, in either direction. Momentum goes with the
/// square of the speed, so the thrust would be off by a factor of six.
const FACTOR: f64 = 2.5;
/// The same where a unit is near: no multirotor lifts more than one and a half times its own mass,
/// 2.5 times the momentum (DJI's Matrice 300, 3.6 kg without batteries, takes off with 9 kg), and
/// the model is a tenth off.
const FACTOR_OF_UNITS: f64 = 1.75;
/// Share of the variance that is left unexplained: below the first the geometry is right; a slip is
/// undone where less than the second is left, and less than a quarter of what an instrument's
/// faults leave. Chosen here.
const RIGHT: f64 = 0.15;
const EXPLAINED: f64 = 0.3;
const OF_BEFORE: f64 = 0.25;
/// Between clocks that are tried (s). Chosen here: a pass through a jet lasts a second.
const CLOCK_STEP_S: f64 = 0.4;
/// Farthest clock that is tried as a slip (s): chosen here, a logger that was started by hand.
const FARTHEST_CLOCK_S: f64 = 60.0;
/// Readings of which it is judged whether they follow one another by chance: chosen here.
const SUCCESSIVE: usize = 10_000;
/// Standard deviation of their ratio above which they are too few: 204 have it, and a ratio of
/// [`SMOOTH`] is seven of it away from chance.
const MOST_SIGMA: f64 = 0.07;
/// Ratio of simulated air that is smooth from reading to reading. Chosen here: half of what chance
/// makes.
const SMOOTH: f64 = 0.5;
/// Readings (times the accuracy) that no still air gives. Chosen here: gusts of a hall are slower.
const NOT_STILL: f64 = 20.0;
/// Readings over simulation that units make, with how far off a factor may be (a natural logarithm;
/// chosen here: turbulence and a wake's own error are within a fifth, units apart by more).
const UNITS: [(f64, &str); 10] = [
    (1000.0, "mm/s"),
    (100.0, "cm/s"),
    (3.6, "km/h"),
    (60.0, "m/min"),
    (196.85, "ft/min"),
    (3.281, "ft/s"),
    (2.237, "mph"),
    (1.944, "knots"),
    (0.01, "hundreds of m/s"),
    (0.001, "km/s"),
];
const NEAR: f64 = 0.25;

/// What a recording seems to get wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct Mistake {
    /// What was found, with its figures.
    pub message: String,
    /// What it looks like.
    pub help: String,
}

/// How well a simulation follows some readings.
#[derive(Clone, Copy, Debug)]
struct Likeness {
    /// Readings over simulation, least squares.
    factor: f64,
    /// Share of the readings' variance that the scaled simulation leaves.
    left: f64,
}

/// A reading and what is simulated at its place (m/s).
#[derive(Clone, Copy, Debug)]
struct Pair {
    t_s: f64,
    read_mps: f64,
    made_mps: f64,
}

/// Something in a recording put otherwise.
struct Slip {
    words: String,
    /// Whether drones are elsewhere without it.
    of_drones: bool,
    undo: Box<dyn Fn(&mut Recording)>,
}

/// The slip in a recording of probes, if its readings show one.
#[must_use]
pub fn mistaken(recording: &Recording) -> Option<Mistake> {
    let thinned = thinned(recording)?;
    let accuracy_mps = thinned.probes.as_ref()?.instrument.accuracy_abs_mps;
    let accuracy_mps = accuracy_mps.max(0.02);
    let flow = Flow::new(&thinned);
    let pairs = pairs(&flow, &thinned, 0.0);
    let as_it_lies = likeness(&pairs, accuracy_mps);
    if let Some(it) = as_it_lies.filter(|it| it.left < EXPLAINED) {
        // What shelters the probes may make the air as slow as it likes.
        let is_of_no_unit = units(it.factor).is_empty();
        let is_possible =
            it.factor <= FACTOR && (is_of_no_unit || (1.0..FACTOR_OF_UNITS).contains(&it.factor));
        if it.left < RIGHT || !is_possible {
            return (!is_possible).then(|| scaled(it.factor));
        }
    }
    let clocks = (CLOCK_RANGE_S / CLOCK_STEP_S) as i32;
    let clocks_s = (-clocks..=clocks).map(|step| f64::from(step) * CLOCK_STEP_S);
    let left = clocks_s.map(|clock_s| left_by_instrument(self::pairs(&flow, &thinned, clock_s)));
    let by_instrument = left.fold(1.0, f64::min);
    let by_instrument = (by_instrument, "with any scale and clock");
    let mut best: Option<((f64, &str), f64, String)> = None;
    let mut judge = |pairs: &[Pair], before: (f64, &'static str), words: String| {
        let is_better = |it: &Likeness| {
            it.left < EXPLAINED.min(OF_BEFORE * before.0)
                && (1.0 / FACTOR..=FACTOR).contains(&it.factor)
        };
        let it = likeness(pairs, accuracy_mps).filter(is_better);
        let is_best = |it: &Likeness| best.as_ref().is_none_or(|(_, left, _)| it.left < *left);
        if let Some(it) = it.filter(is_best) {
            best = Some((before, it.left, words));
        }
    };
    for slip in slips() {
        let mut undone = thinned.clone();
        (slip.undo)(&mut undone);
        let undone_pairs = match slip.of_drones {
            true => self::pairs(&Flow::new(&undone), &undone, 0.0),
            false => self::pairs(&flow, &undone, 0.0),
        };
        judge(&undone_pairs, by_instrument, slip.words);
    }
    let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
    let speed_mps = |pressure_pa: f64| (2.0 * pressure_pa / density_kg_per_m3).max(0.0).sqrt();
    let as_pressure = pairs.iter().map(|pair| Pair {
        read_mps: speed_mps(pair.read_mps),
        ..*pair
    });
    // A scale that is bent so is one of those that an instrument may have.
    judge(
        &as_pressure.collect::<Vec<_>>(),
        (
            as_it_lies.map_or(1.0, |it| it.left.min(1.0)),
            "with any gain",
        ),
        "the readings taken as dynamic pressure in Pa".to_owned(),
    );
    let rows = recording.probes.as_ref()?.samples.len();
    let step = rows.div_ceil(pairs.len().max(1));
    for by in 1..pairs.len() {
        let moved_s = |at: usize| (pairs[(at + by) % pairs.len()].t_s - pairs[at].t_s).abs();
        let mut moved_s: Vec<f64> = (0..pairs.len()).map(moved_s).collect();
        if median(&mut moved_s).is_none_or(|moved_s| moved_s <= CLOCK_RANGE_S) {
            continue;
        }
        let mut shifted = pairs.clone();
        for (at, pair) in shifted.iter_mut().enumerate() {
            pair.read_mps = pairs[(at + by) % pairs.len()].read_mps;
        }
        // The best of so many has to explain as much as the right geometry does.
        if likeness(&shifted, accuracy_mps).is_some_and(|it| it.left < RIGHT) {
            judge(
                &shifted,
                by_instrument,
                format!("the readings moved up by {} rows", by * step),
            );
        }
    }
    let beyond = (clocks + 1)..=(FARTHEST_CLOCK_S / CLOCK_STEP_S) as i32;
    for clock_s in beyond.flat_map(|step| [-1.0, 1.0].map(|to| to * f64::from(step) * CLOCK_STEP_S))
    {
        let moved = self::pairs(&flow, &thinned, clock_s);
        // As above.
        if likeness(&moved, accuracy_mps).is_some_and(|it| it.left < RIGHT) {
            let which = if clock_s < 0.0 { "earlier" } else { "later" };
            let words = format!("the readings taken {:.1} s {which}", clock_s.abs());
            judge(&moved, by_instrument, words);
        }
    }
    let backwards = pairs.iter().zip(pairs.iter().rev());
    let backwards = backwards.map(|(pair, last)| Pair {
        read_mps: last.read_mps,
        ..*pair
    });
    judge(
        &backwards.collect::<Vec<_>>(),
        by_instrument,
        "the readings in the opposite order".to_owned(),
    );
    if let Some(((before, by), left, words)) = best {
        return Some(Mistake {
            message: format!(
                "its readings leave {:.0} % of their variance unexplained by where probes and drones are {by} of the instrument, and {:.0} % with {words}",
                100.0 * before,
                100.0 * left
            ),
            help: format!("{words}? Put the table right; no physics is looked for until then"),
        });
    }
    impossible(&thinned, &pairs, accuracy_mps).or_else(|| shuffled(&flow, recording, accuracy_mps))
}

/// Readings that follow one another by chance where the air does not, whatever makes it.
///
/// Mean squared difference of successive readings over twice their variance: 1 of shuffled ones,
/// give or take 1/sqrt(n) (J. von Neumann, "Distribution of the ratio of the mean square successive
/// difference to the variance", Annals of Mathematical Statistics 12, 1941).
fn shuffled(flow: &Flow, recording: &Recording, accuracy_mps: f64) -> Option<Mistake> {
    let mut of_probes: BTreeMap<u32, Vec<(f64, f64)>> = BTreeMap::new();
    let samples = recording.probes.iter().flat_map(|probes| &probes.samples);
    for sample in samples.take(SUCCESSIVE) {
        let air_mps = flow.velocity_mps(sample.t_s, sample.position_m, None);
        if let Some(air_mps) = air_mps.filter(|_| sample.speed_mps.is_finite()) {
            let simulated_mps = air_mps.norm().hypot(flow.ambient_mps(sample.t_s));
            let pairs = of_probes.entry(sample.probe_id).or_default();
            pairs.push((sample.speed_mps, simulated_mps));
        }
    }
    // The ratio, its standard deviation and that of the speeds (m/s).
    let ratio = |of: fn(&(f64, f64)) -> f64| {
        let all = of_probes.values().flatten().map(of);
        let count = all.clone().count() as f64;
        let mean = all.clone().sum::<f64>() / count;
        let variance = all.map(|mps| (mps - mean).powi(2)).sum::<f64>() / count;
        let steps = (of_probes.values()).flat_map(|it| it.windows(2));
        let squares = steps.map(|pair| (of(&pair[1]) - of(&pair[0])).powi(2));
        let successive = squares.clone().count() as f64;
        let mean_square = squares.sum::<f64>() / successive;
        let ratio = 0.5 * mean_square / variance;
        (ratio, 1.0 / successive.sqrt(), variance.sqrt())
    };
    let ((read, sigma, spread_mps), (made, _, made_mps)) = (ratio(|it| it.0), ratio(|it| it.1));
    let least_mps = ABOVE_ACCURACY * accuracy_mps;
    let is_shuffled = sigma < MOST_SIGMA && read > 1.0 - 3.0 * sigma && made < SMOOTH;
    (is_shuffled && spread_mps.min(made_mps) > least_mps).then(|| Mistake {
        message: format!(
            "its readings follow one another by chance: successive ones differ by {read:.2} of what any two do, and by {made:.2} in the simulation"
        ),
        help: "rows that are shuffled, readings of another flight, or a dead instrument? No physics is looked for until then".to_owned(),
    })
}

/// Readings where no wake is, or too fast for any. That readings have nothing to do with the wakes
/// is no slip by itself: what is left out may be as large as what is known.
fn impossible(recording: &Recording, pairs: &[Pair], accuracy_mps: f64) -> Option<Mistake> {
    let ambient_mps = recording.environment.ambient_mps;
    let help = "columns or rows that do not belong together, a dead instrument, or places in another frame? No physics is looked for until then".to_owned();
    let mut read: Vec<f64> = pairs.iter().map(|pair| pair.read_mps).collect();
    let fastest_mps = pairs.iter().map(|pair| pair.made_mps).fold(0.0, f64::max);
    let typical_mps = median(&mut read)?;
    if fastest_mps < ambient_mps + accuracy_mps && typical_mps > NOT_STILL * accuracy_mps {
        return Some(Mistake {
            message: format!(
                "its probes read {typical_mps:.2} m/s in the middle, and no drone's wake reaches any of them"
            ),
            help,
        });
    }
    let it = likeness(pairs, accuracy_mps)?;
    (it.factor > FACTOR * FACTOR).then(|| scaled(it.factor))
}

/// The units that readings at so many times the simulated speed may be in, the nearest first.
fn units(factor: f64) -> Vec<&'static str> {
    let far = |(unit, _): &(f64, &str)| (factor / unit).ln().abs();
    let mut near: Vec<&(f64, &str)> = UNITS.iter().filter(|it| far(it) < NEAR).collect();
    near.sort_by(|a, b| far(a).total_cmp(&far(b)));
    near.into_iter().map(|(_, word)| *word).collect()
}

fn scaled(factor: f64) -> Mistake {
    Mistake {
        message: format!(
            "its readings follow the simulation at {factor:.3} times its speed, which is {:.3} times the momentum that the stated masses make",
            factor * factor
        ),
        help: match units(factor).as_slice() {
            [] => "the unit of the readings, or the stated mass, propellers or air?".to_owned(),
            units => format!("readings in {}? `speed_mps` is in m/s", units.join(" or ")),
        },
    }
}

/// With fewer readings; `None` where it has none of a probe, or too few.
fn thinned(recording: &Recording) -> Option<Recording> {
    let probes = recording.probes.as_ref()?;
    let readable = |sample: &&ProbeSample| {
        sample.speed_mps.is_finite() && sample.position_m.iter().all(|m| m.is_finite())
    };
    let all: Vec<_> = probes.samples.iter().filter(readable).copied().collect();
    let step = all.len().div_ceil(READINGS).max(1);
    let samples: Vec<_> = all.into_iter().step_by(step).collect();
    (samples.len() >= FEWEST).then(|| Recording {
        probes: Some(Probes {
            instrument: probes.instrument.clone(),
            samples,
        }),
        receivers: Vec::new(),
        remarks: Vec::new(),
        ..recording.clone()
    })
}

/// Readings in the air of drones where their places are known, with their clock ahead by so much.
fn pairs(flow: &Flow, recording: &Recording, clock_s: f64) -> Vec<Pair> {
    let Some(probes) = &recording.probes else {
        return Vec::new();
    };
    let mut rows: Vec<usize> = (0..probes.samples.len()).collect();
    rows.sort_by(|&a, &b| {
        let [a, b] = [a, b].map(|row| &probes.samples[row]);
        (a.probe_id.cmp(&b.probe_id)).then(a.t_s.total_cmp(&b.t_s))
    });
    let mut places_m = vec![Point3::origin(); rows.len()];
    let later_s = flow.place_ahead_s(clock_s);
    for of_probe in rows.chunk_by(|&a, &b| probes.samples[a].probe_id == probes.samples[b].probe_id)
    {
        let moved_m = probes.places_m(of_probe, later_s);
        let each = of_probe.iter().zip(moved_m);
        each.for_each(|(&row, at_m)| places_m[row] = at_m);
    }
    let pair = |(sample, place_m): (&ProbeSample, &Point3<f64>)| {
        let t_s = sample.t_s + clock_s;
        let air_mps = flow.velocity_mps(t_s, *place_m, None)?;
        Some(Pair {
            t_s: sample.t_s,
            read_mps: sample.speed_mps,
            made_mps: air_mps.norm().hypot(flow.ambient_mps(t_s)),
        })
    };
    let samples = probes.samples.iter().zip(&places_m);
    samples.filter_map(pair).collect()
}

/// `None` of few pairs, or where the simulated air is no faster than the accuracy.
fn likeness(pairs: &[Pair], accuracy_mps: f64) -> Option<Likeness> {
    let fastest_mps = pairs.iter().map(|pair| pair.made_mps).fold(0.0, f64::max);
    if pairs.len() < FEWEST || fastest_mps < ABOVE_ACCURACY * accuracy_mps {
        return None;
    }
    let sum = |of: fn(&Pair) -> f64| pairs.iter().map(of).sum::<f64>();
    let factor = sum(|it| it.read_mps * it.made_mps) / sum(|it| it.made_mps.powi(2));
    let left_of = |it: &Pair| (it.read_mps - factor * it.made_mps).powi(2);
    let left: f64 = pairs.iter().map(left_of).sum();
    let scatter = scatter(pairs);
    (scatter > 0.0 && factor > 0.0).then(|| Likeness {
        factor,
        left: left / scatter,
    })
}

/// Squares of the readings about their mean, summed.
fn scatter(pairs: &[Pair]) -> f64 {
    let mean_mps = pairs.iter().map(|it| it.read_mps).sum::<f64>() / pairs.len() as f64;
    pairs
        .iter()
        .map(|it| (it.read_mps - mean_mps).powi(2))
        .sum()
}

/// Share of the readings' variance that is left by the scale which fits best of all those that rise
/// with the simulated speed: gain, offset, ceiling, or bent.
///
/// Pool adjacent violators: M. Ayer et al., "An empirical distribution function for sampling with
/// incomplete information", Annals of Mathematical Statistics 26, 1955.
fn left_by_instrument(mut pairs: Vec<Pair>) -> f64 {
    if pairs.len() < FEWEST {
        return 1.0;
    }
    pairs.sort_by(|a, b| a.made_mps.total_cmp(&b.made_mps));
    // Of each block its readings' number, mean (m/s) and squares about it.
    let mut blocks: Vec<(f64, f64, f64)> = Vec::new();
    for pair in &pairs {
        let mut block = (1.0, pair.read_mps, 0.0);
        while let Some(last) = blocks.pop_if(|last| last.1 >= block.1) {
            let count = last.0 + block.0;
            let apart_mps = block.1 - last.1;
            let squares = last.2 + block.2 + apart_mps * apart_mps * last.0 * block.0 / count;
            block = (count, last.1 + apart_mps * block.0 / count, squares);
        }
        blocks.push(block);
    }
    let scatter = scatter(&pairs);
    if scatter > 0.0 {
        blocks.iter().map(|block| block.2).sum::<f64>() / scatter
    } else {
        1.0
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Every slip that is looked for. Feet are not among the units of length: a wake that is wider or
/// narrower than the model by a factor of three may be physics, one by ten and more may not.
fn slips() -> Vec<Slip> {
    let mut slips = Vec::new();
    for of_probes in [true, false] {
        let of = match of_probes {
            true => "the probes",
            false => "the drones",
        };
        let mut add = |words: String, put: Box<dyn Fn(Point3<f64>) -> Point3<f64>>| {
            let undo = move |recording: &mut Recording| match of_probes {
                true => {
                    let probes = recording.probes.iter_mut();
                    let samples = probes.flat_map(|probes| &mut probes.samples);
                    samples.for_each(|sample| sample.position_m = put(sample.position_m));
                }
                false => {
                    let vehicles = recording.vehicles.iter_mut();
                    let places = vehicles.flat_map(|of| &mut of.track.position_m);
                    places.for_each(|place_m| *place_m = put(*place_m));
                }
            };
            slips.push(Slip {
                words,
                of_drones: !of_probes,
                undo: Box::new(undo),
            });
        };
        for order in [[1, 0, 2], [2, 1, 0], [0, 2, 1], [1, 2, 0], [2, 0, 1]] {
            let names = order.map(|axis| AXES[axis]);
            let words = format!("x, y, z of {of} read as {}", names.join(", "));
            add(
                words,
                Box::new(move |m| Point3::from(order.map(|axis| m[axis]))),
            );
        }
        for axis in 0..3 {
            let words = format!("the sign of {} of {of} turned", AXES[axis]);
            let put = move |mut m: Point3<f64>| {
                m[axis] = -m[axis];
                m
            };
            add(words, Box::new(put));
        }
        for (unit, factor) in [("mm", 1e-3), ("cm", 1e-2), ("inches", 0.0254), ("km", 1e3)] {
            let words = format!("the places of {of} read as {unit}");
            add(words, Box::new(move |m| m * factor));
            for axis in 0..3 {
                let words = format!("{} of {of} read as {unit}", AXES[axis]);
                let put = move |mut m: Point3<f64>| {
                    m[axis] *= factor;
                    m
                };
                add(words, Box::new(put));
            }
        }
    }
    for (unit, factor) in [("mm", 1e-3), ("cm", 1e-2), ("inches", 0.0254)] {
        let undo = move |recording: &mut Recording| {
            let probes = recording.probes.iter_mut();
            let samples = probes.flat_map(|probes| &mut probes.samples);
            samples.for_each(|sample| sample.position_m *= factor);
            let vehicles = recording.vehicles.iter_mut();
            let places = vehicles.flat_map(|of| &mut of.track.position_m);
            places.for_each(|place_m| *place_m *= factor);
        };
        slips.push(Slip {
            words: format!("all places read as {unit}"),
            of_drones: true,
            undo: Box::new(undo),
        });
    }
    slips.push(Slip {
        words: "z of the probes counted down from the highest drone".to_owned(),
        of_drones: false,
        undo: Box::new(|recording| {
            let tracks = recording.vehicles.iter().map(|it| &it.track.position_m);
            let top_m = tracks.flatten().map(|m| m.z).fold(0.0, f64::max);
            let probes = recording.probes.iter_mut();
            let samples = probes.flat_map(|probes| &mut probes.samples);
            samples.for_each(|sample| sample.position_m.z = top_m - sample.position_m.z);
        }),
    });
    slips
}
