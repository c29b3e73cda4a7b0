//! The air that a drone meets along a leg: axial exposure, worst speed, and the energy it costs to
//! hold height in it.
//!
//! The drone's rotor discs are thin and level. At every instant all wakes are added up at each
//! point of the discs, then averaged; what is integrated is that mean. Wakes hang below their
//! drones without delay. Between the knots where a wake begins, ends, or changes its formula, the
//! air met is smooth in time, and adaptive quadrature settles it to [`RELATIVE_ERROR`].

use nalgebra::{Point3, Vector3};

use crate::volumes::frame::{self, NotFinite};
use airflow::{
    DiscPoints, GoldenSection, HEIGHT_TOLERANCE_M, Source, Superposition, Wake,
    mean_over_discs_mps, power,
};

/// Relative error of axial exposure and energy. Chosen here: ten times better than the 0.1 % a plan
/// reports.
pub const RELATIVE_ERROR: f64 = 1e-4;

/// Where the near field begins to blend into the far field, over the depth where the near field
/// ends: 1.8 l of 2.5 l. A knot for the quadrature, nothing else.
const BLEND_BEGINS: f64 = 1.8 / 2.5;

/// Halvings after which a piece is taken as it is: a thousandth of a piece of at most two
/// half-widths. Chosen here.
const MAX_HALVINGS: u32 = 10;

/// From one place and time to another, in a straight line at constant velocity; equal ends are a
/// hover.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Where it starts, in the world (m).
    pub start_m: Point3<f64>,
    /// Where it ends, in the world (m).
    pub end_m: Point3<f64>,
    /// When it starts (s).
    pub start_s: f64,
    /// When it ends (s); not before it starts, infinite for a hover without end.
    pub end_s: f64,
}

impl Flight {
    /// A hover at one place.
    pub fn hover(at_m: Point3<f64>, start_s: f64, end_s: f64) -> Self {
        Self {
            start_m: at_m,
            end_m: at_m,
            start_s,
            end_s,
        }
    }

    /// How long it takes (s).
    pub fn duration_s(&self) -> f64 {
        self.end_s - self.start_s
    }

    /// Velocity (m/s); zero for a hover, and for a flight without duration.
    pub fn velocity_mps(&self) -> Vector3<f64> {
        let duration_s = self.duration_s();
        if duration_s > 0.0 && duration_s.is_finite() {
            (self.end_m - self.start_m) / duration_s
        } else {
            Vector3::zeros()
        }
    }

    /// Position at a time (m); held at the ends outside of the flight.
    pub fn position_m(&self, time_s: f64) -> Point3<f64> {
        if time_s >= self.end_s {
            return self.end_m;
        }
        let elapsed_s = (time_s - self.start_s).max(0.0);
        self.start_m + self.velocity_mps() * elapsed_s
    }

    /// The times shared with another flight, start before end; `None` if they share less than an
    /// instant.
    fn common_s(&self, other: &Flight) -> Option<(f64, f64)> {
        let start_s = self.start_s.max(other.start_s);
        let end_s = self.end_s.min(other.end_s);
        (start_s < end_s).then_some((start_s, end_s))
    }
}

/// A drone on a leg, as the receiver of wakes.
#[derive(Clone, Copy, Debug)]
pub struct Receiver<'a> {
    /// How its rotor-plane centre flies.
    pub leg: Flight,
    /// Points of its rotor discs.
    pub discs: &'a DiscPoints,
    /// Its mass, payload included (kg).
    pub mass_kg: f64,
    /// Its own induced velocity `U_H` at that mass (m/s).
    pub induced_velocity_mps: f64,
}

/// A drone on a leg, as the source of a wake from the start to the end of its leg.
#[derive(Clone, Copy, Debug)]
pub struct Emitter<'a> {
    /// How its rotor-plane centre flies.
    pub leg: Flight,
    /// Its air, at its mass during this leg.
    pub wake: &'a Wake,
    /// Height where that air ends (m, world).
    pub ends_at_z_m: f64,
}

/// What a leg through other drones' air amounts to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exposure {
    /// Integral of the air met over time (m).
    pub axial_exposure_m: f64,
    /// Highest air met (m/s).
    pub worst_mps: f64,
    /// When that was, at the earliest (s); the start of the leg where no air was met.
    pub worst_at_s: f64,
    /// Index of the emitter that contributed most at that time; `None` where no air was met.
    pub from: Option<usize>,
    /// Energy beyond hovering in still air, at constant thrust: integral of (β - 1) m g `U_H` (J).
    pub extra_energy_j: f64,
}

/// Axial exposure, worst speed and extra energy of one leg below (or above, or beside) the given
/// emitters.
///
/// # Errors
/// A position of a leg is NaN or infinite, or so is a time of the receiver's leg; a time of an
/// emitter's leg or the end of its wake is NaN. An emitter's leg may be without end.
pub fn exposure(
    receiver: &Receiver,
    emitters: &[Emitter],
    superposition: Superposition,
) -> Result<Exposure, NotFinite> {
    check(receiver, emitters)?;
    let mut met = Exposure {
        worst_at_s: receiver.leg.start_s,
        ..Exposure::default()
    };
    let knots_s = knots_s(receiver, emitters);
    if let [instant_s] = knots_s[..] {
        let air = Air::new(receiver, emitters, superposition, instant_s);
        met.note(air.met_mps(instant_s), instant_s, &air);
    }
    for piece in knots_s.windows(2) {
        let (from_s, to_s) = (piece[0], piece[1]);
        let air = Air::new(
            receiver,
            emitters,
            superposition,
            f64::midpoint(from_s, to_s),
        );
        if air.emitting.is_empty() {
            continue;
        }
        let mut samples = Vec::with_capacity(64);
        let mut sample = |time_s: f64| {
            let speed_mps = air.met_mps(time_s);
            samples.push((time_s, speed_mps));
            speed_mps
        };
        // The ends from inside: at a knot itself the wake may already be gone.
        let inside_s = (to_s - from_s) * 1e-9;
        let mut f = |time_s: f64| {
            let speed_mps = sample(time_s.clamp(from_s + inside_s, to_s - inside_s));
            (time_s, [speed_mps, receiver.extra_power_w(speed_mps)])
        };
        let ends = [from_s, f64::midpoint(from_s, to_s), to_s].map(&mut f);
        let [axial_exposure_m, energy_j] = integrate(&mut f, ends, MAX_HALVINGS);
        met.axial_exposure_m += axial_exposure_m;
        met.extra_energy_j += energy_j;
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (time_s, speed_mps) = highest(&samples, |time_s| air.met_mps(time_s));
        met.note(speed_mps, time_s, &air);
    }
    Ok(met)
}

impl Receiver<'_> {
    fn extra_power_w(&self, speed_mps: f64) -> f64 {
        power::extra_power_w(
            self.mass_kg,
            self.induced_velocity_mps,
            speed_mps / self.induced_velocity_mps,
        )
    }
}

impl Exposure {
    /// Keeps the worst air; the earlier of two that are equal up to rounding.
    fn note(&mut self, speed_mps: f64, time_s: f64, air: &Air) {
        if speed_mps > self.worst_mps * (1.0 + 1e-12) {
            self.worst_mps = speed_mps;
            self.worst_at_s = time_s;
            self.from = air.strongest_at(time_s);
        }
    }
}

fn check(receiver: &Receiver, emitters: &[Emitter]) -> Result<(), NotFinite> {
    let leg = &receiver.leg;
    frame::point([leg.start_s, leg.end_s, leg.duration_s()].into())?;
    for leg in emitters.iter().map(|emitter| &emitter.leg).chain([leg]) {
        frame::point(leg.start_m)?;
        frame::point(leg.end_m)?;
    }
    for emitter in emitters {
        // Clamped, because these may be infinite: a hover without end, a wake without floor. NaN
        // stays NaN.
        let times_s = [emitter.leg.start_s, emitter.leg.end_s];
        let bounded =
            [times_s[0], times_s[1], emitter.ends_at_z_m].map(|x| x.clamp(f64::MIN, f64::MAX));
        frame::point(bounded.into())?;
    }
    Ok(())
}

/// The air met while the same emitters reach the receiver.
struct Air<'a> {
    receiver: &'a Receiver<'a>,
    superposition: Superposition,
    /// Those whose wakes reach it, with their indices.
    emitting: Vec<(usize, &'a Emitter<'a>)>,
}

impl<'a> Air<'a> {
    /// Of the emitters that reach the receiver at `time_s`.
    fn new(
        receiver: &'a Receiver,
        emitters: &'a [Emitter],
        superposition: Superposition,
        time_s: f64,
    ) -> Self {
        let z_m = receiver.leg.position_m(time_s).z;
        let reaches = |emitter: &Emitter| {
            (emitter.leg.start_s..=emitter.leg.end_s).contains(&time_s)
                && z_m < emitter.leg.position_m(time_s).z - HEIGHT_TOLERANCE_M
                && z_m >= emitter.ends_at_z_m - HEIGHT_TOLERANCE_M
        };
        let emitting = emitters
            .iter()
            .enumerate()
            .filter(|(_, emitter)| reaches(emitter))
            .collect();
        Self {
            receiver,
            superposition,
            emitting,
        }
    }

    fn source(emitter: &'a Emitter, time_s: f64) -> Source<'a> {
        // Whether it reaches the receiver is settled for the whole piece: rounding at its ends
        // shall not undo it.
        Source {
            wake: emitter.wake,
            position_m: emitter.leg.position_m(time_s),
            ends_at_z_m: f64::NEG_INFINITY,
        }
    }

    fn met_mps(&self, time_s: f64) -> f64 {
        let centre_m = self.receiver.leg.position_m(time_s);
        let mean = |sources: &[Source]| {
            mean_over_discs_mps(sources, self.receiver.discs, centre_m, self.superposition)
        };
        if let [(_, only)] = self.emitting[..] {
            return mean(&[Self::source(only, time_s)]);
        }
        let sources: Vec<Source> = self
            .emitting
            .iter()
            .map(|(_, e)| Self::source(e, time_s))
            .collect();
        mean(&sources)
    }

    /// Index of the emitter whose air alone is the strongest at a time; the first of equals.
    fn strongest_at(&self, time_s: f64) -> Option<usize> {
        let centre_m = self.receiver.leg.position_m(time_s);
        let mut strongest: Option<(usize, f64)> = None;
        for (index, emitter) in &self.emitting {
            let alone = [Self::source(emitter, time_s)];
            let speed_mps =
                mean_over_discs_mps(&alone, self.receiver.discs, centre_m, self.superposition);
            if strongest.is_none_or(|(_, so_far_mps)| speed_mps > so_far_mps) {
                strongest = Some((*index, speed_mps));
            }
        }
        strongest.map(|(index, _)| index)
    }
}

/// The highest value near the highest of the samples (in order of time): golden section between its
/// neighbours.
fn highest(samples: &[(f64, f64)], f: impl Fn(f64) -> f64) -> (f64, f64) {
    let Some(peak) = (0..samples.len()).reduce(|best, i| {
        if samples[i].1 > samples[best].1 {
            i
        } else {
            best
        }
    }) else {
        return (0.0, 0.0);
    };
    let ends_s = [
        samples[peak.saturating_sub(1)].0,
        samples[(peak + 1).min(samples.len() - 1)].0,
    ];
    // The bracket shrinks to 5e-4 of a sample step: at a smooth peak the speed is then exact to
    // about 1e-7.
    let found = GoldenSection::of(ends_s, 16, |time_s| -f(time_s));
    let mut best = samples[peak];
    for (time_s, below) in [found.left, found.right] {
        if -below > best.1 {
            best = (time_s, -below);
        }
    }
    best
}

/// Times that no smooth piece of the air met may straddle, and those that find a narrow wake on a
/// long leg; ascending, from the start to the end of the receiver's leg.
fn knots_s(receiver: &Receiver, emitters: &[Emitter]) -> Vec<f64> {
    let leg = &receiver.leg;
    let mut knots_s = vec![leg.start_s];
    if leg.end_s > leg.start_s {
        knots_s.push(leg.end_s);
    }
    for emitter in emitters {
        if let Some((from_s, to_s)) = leg.common_s(&emitter.leg) {
            let mut candidates_s = vec![from_s, to_s];
            height_knots_s(leg, emitter, from_s, &mut candidates_s);
            pass_knots_s(leg, emitter, (from_s, to_s), &mut candidates_s);
            knots_s.extend(
                candidates_s
                    .into_iter()
                    .filter(|t| (from_s..=to_s).contains(t)),
            );
        }
    }
    knots_s.sort_by(f64::total_cmp);
    // Closer than a billionth of the leg is the same time.
    let apart_s = leg.duration_s() * 1e-9;
    knots_s.dedup_by(|later, earlier| *later - *earlier <= apart_s);
    if let Some(last) = knots_s.last_mut() {
        *last = last.max(leg.end_s);
    }
    knots_s
}

/// When the receiver crosses the rotor plane, 1.8 l, 2.5 l, and the height where the wake ends.
fn height_knots_s(leg: &Flight, emitter: &Emitter, from_s: f64, knots_s: &mut Vec<f64>) {
    let depth_m = emitter.leg.position_m(from_s).z - leg.position_m(from_s).z;
    let sinking_mps = emitter.leg.velocity_mps().z - leg.velocity_mps().z;
    let near_m = emitter.wake.near_field_depth_m();
    for knot_m in [HEIGHT_TOLERANCE_M, BLEND_BEGINS * near_m, near_m] {
        knots_s.push(from_s + (knot_m - depth_m) / sinking_mps);
    }
    let end_m = emitter.ends_at_z_m - HEIGHT_TOLERANCE_M;
    knots_s.push(leg.start_s + (end_m - leg.start_m.z) / leg.velocity_mps().z);
}

/// On a long pass pieces short enough that no wake hides between nodes: the flow structure is two
/// half-widths wide.
fn pass_knots_s(
    leg: &Flight,
    emitter: &Emitter,
    (from_s, to_s): (f64, f64),
    knots_s: &mut Vec<f64>,
) {
    let depth_m = |time_s: f64| emitter.leg.position_m(time_s).z - leg.position_m(time_s).z;
    let width_m = emitter
        .wake
        .half_width_m(depth_m(from_s).min(depth_m(to_s)));
    let speed_mps = (leg.velocity_mps() - emitter.leg.velocity_mps())
        .xy()
        .norm();
    let pieces = (speed_mps * (to_s - from_s) / (2.0 * width_m)).ceil();
    let step_s = (to_s - from_s) / pieces.max(1.0);
    knots_s.extend((1..pieces as u32).map(|k| from_s + f64::from(k) * step_s));
}

/// A time with the values of two functions.
type Node = (f64, [f64; 2]);

/// Integrals of two functions between the first and the last of three evenly spaced nodes, each to
/// [`RELATIVE_ERROR`]: Simpson's rule, halved until it settles (J. N. Lyness, "Notes on the
/// adaptive Simpson quadrature routine", Journal of the ACM 16, 1969).
fn integrate(
    f: &mut impl FnMut(f64) -> Node,
    [from, middle, to]: [Node; 3],
    halvings: u32,
) -> [f64; 2] {
    let rule =
        |[a, m, b]: [Node; 3]| [0, 1].map(|i| (b.0 - a.0) / 6.0 * (a.1[i] + 4.0 * m.1[i] + b.1[i]));
    let first = [from, f(f64::midpoint(from.0, middle.0)), middle];
    let second = [middle, f(f64::midpoint(middle.0, to.0)), to];
    let (whole, a, b) = (rule([from, middle, to]), rule(first), rule(second));
    let halves = [0, 1].map(|i| a[i] + b[i]);
    // The error of the halves is a fifteenth of the difference.
    let off = [0, 1].map(|i| (halves[i] - whole[i]) / 15.0);
    if halvings == 0 || (0..2).all(|i| off[i].abs() <= RELATIVE_ERROR * halves[i].abs()) {
        return [0, 1].map(|i| halves[i] + off[i]);
    }
    let (a, b) = (
        integrate(f, first, halvings - 1),
        integrate(f, second, halvings - 1),
    );
    [0, 1].map(|i| a[i] + b[i])
}
