//! How near two drones may be, by the height between them, and what follows for their steps.

use costmap::verdict::price;
use costmap::volumes::conflict_volume::{ConflictVolume, ConvectiveDelay, QuasiStatic};
use costmap::volumes::relative::{Line, Relative};
use costmap::wake::advected::ConvectiveDelayBound;
use costmap::wake::fleet::{BUDGET, Fleet, LegInteraction};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::directions::{DIRECTIONS, STILL, cells};
use super::steps::{Class, DelaySpan, LOADS};
use crate::graph::lattice::Lattice;

/// Share of a budget that one wake may fill here: chosen here, the rest is for wakes farther off.
const ONE_WAKES_SHARE: f64 = 0.4;
/// The same of advected wakes: chosen here. It is there for a part of the time for which it
/// may be, and mostly alone.
const LATE_WAKES_SHARE: f64 = 0.6;
/// Prices below this are left to the verdict: chosen here, three hundredths of a second a step
/// (s/s).
const LEAST_PRICE: f64 = 0.0625;
/// Loads below this share of a budget are left to the verdict: chosen here, an eighth of the most
/// that one wake may fill.
const LEAST_LOAD: f64 = 0.05;
/// The same in PIBT rounds, where nothing is looked for again: chosen here, three parts of
/// [`LOADS`].
const LEAST_SYNCHRONOUS: f64 = 0.012;
/// Azimuths at which a wake is asked for that is not round: chosen here.
const AZIMUTHS: u32 = 8;

/// Heights that miss a layer by no more are there (cells): far above rounding.
const WHOLE_CELLS: f64 = 1e-6;

/// How far two classes keep from one another, by the layers between them.
#[derive(Debug)]
pub(super) struct Shape {
    pub(super) me: Class,
    pub(super) other: Class,
    pub(super) extent: Extent,
    /// Where the first must not be, seen from the second (cells).
    pub(super) conflict_volume: ConflictVolume,
    /// The convective delays of the air of both.
    pub(super) delays: ConvectiveDelays,
    /// Its radius (cells) at `k` layers above the other and between `k` and `k + 1`, from the
    /// lowest on.
    at: Vec<f64>,
    between: Vec<f64>,
    air: PairAir,
    /// Farther aside (cells) nothing is forbidden, and no load counts.
    widest: f64,
    /// Farther aside (cells) nothing is priced.
    priced: f64,
}

/// How far two classes matter to one another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    /// Columns aside.
    pub(super) reach: i32,
    /// Layers above and below.
    pub(super) layers: i32,
    /// Layers between two drones from which on only air matters.
    pub(super) bodies: i32,
}

/// The longest convective delay of the air of two classes (ticks), by depth (cells): of the first,
/// which moves, and of the second.
#[derive(Debug)]
pub(super) struct ConvectiveDelays {
    delay_bounds: [ConvectiveDelayBound; 2],
    cell_m: f64,
    /// By how much two drones may be farther apart than it seems (m).
    relative_deviation_m: f64,
}

impl ConvectiveDelays {
    /// Whether wakes are quasi-static.
    fn is_none(&self) -> bool {
        self.delay_bounds
            .iter()
            .all(|it| it.delay_ticks(1.0) == 0.0)
    }
}

impl ConvectiveDelay for ConvectiveDelays {
    fn of_reference(&self, depth: f64) -> f64 {
        self.delay_bounds[1].delay_ticks(depth * self.cell_m + self.relative_deviation_m)
    }

    fn of_mover(&self, depth: f64) -> f64 {
        self.delay_bounds[0].delay_ticks(depth * self.cell_m + self.relative_deviation_m)
    }
}

/// Distances in a cell at which wakes are asked for: chosen here, five centimetres of a metre.
const RINGS: usize = 20;

/// What wakes of two classes bring to one another, by layers of the first above the second and
/// [`RINGS`] aside.
#[derive(Debug)]
pub(super) struct PairAir {
    /// From the lowest layer on, what hovering costs both (s/s).
    prices: Vec<Vec<f64>>,
    /// From the lowest layer on, loads on both (parts of a budget).
    at: Vec<Vec<[f64; 2]>>,
    /// The same between each layer and the next, from the one below the lowest on.
    between: Vec<Vec<[f64; 2]>>,
}

impl PairAir {
    pub(super) fn new(lattice: &Lattice, fleet: &Fleet, classes: [Class; 2]) -> PairAir {
        let cell_m = lattice.cell_m();
        let most = lattice.counts()[2] as i32;
        let near_m = 2.0 * fleet.pairwise_within_m() + cell_m;
        let rings = 0..=(near_m / cell_m * RINGS as f64).ceil() as usize;
        let azimuths = if fleet.is_round() { 1 } else { AZIMUTHS };
        let meet = |ring: usize, layers: [i32; 2]| {
            let aside_m = ring as f64 / RINGS as f64 * cell_m;
            let heights_m = layers.map(|layer| f64::from(layer) * cell_m);
            meet_at(fleet, classes, (aside_m, azimuths), heights_m)
        };
        let prices = |k: i32| -> Vec<f64> {
            let at_ring = |ring: usize| {
                let prices =
                    meet(ring, [k; 2]).map(|it| price(it.alpha_first) + price(it.alpha_second));
                prices.fold(0.0, f64::max)
            };
            rings.clone().map(at_ring).collect()
        };
        let loads = |low: i32, high: i32| -> Vec<[f64; 2]> {
            let at_ring = |ring: usize| {
                let loads = meet(ring, [low, high]).map(|it| [it.load_on_first, it.load_on_second]);
                loads
                    .map(|loads| loads.map(|load| f64::from(load) / f64::from(BUDGET)))
                    .fold([0.0_f64; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])])
            };
            rings.clone().map(at_ring).collect()
        };
        let between = (-most - 1..=most).into_par_iter();
        PairAir {
            prices: (-most..=most).into_par_iter().map(prices).collect(),
            at: (-most..=most)
                .into_par_iter()
                .map(|k| loads(k, k))
                .collect(),
            between: between.map(|k| loads(k, k + 1)).collect(),
        }
    }

    /// The same of the second as seen from the first.
    pub(super) fn reversed(&self) -> PairAir {
        let swapped = |rings: &Vec<[f64; 2]>| rings.iter().map(|[a, b]| [*b, *a]).collect();
        PairAir {
            prices: self.prices.iter().rev().cloned().collect(),
            at: self.at.iter().rev().map(swapped).collect(),
            between: self.between.iter().rev().map(swapped).collect(),
        }
    }

    /// From how far aside on (cells) none of these matters at any layer.
    fn farthest<T>(layers: &[Vec<T>], matters: impl Fn(&T) -> bool) -> f64 {
        let of_layer = |rings: &Vec<T>| rings.iter().rposition(&matters);
        let last = layers.iter().filter_map(of_layer).max();
        last.map_or(0.0, |ring| (ring + 1) as f64 / RINGS as f64)
    }
}

impl Shape {
    /// `air` is that of the same classes.
    pub(super) fn new(
        (lattice, fleet): (&Lattice, &Fleet),
        [me, other]: [Class; 2],
        air: PairAir,
    ) -> Shape {
        let cell_m = lattice.cell_m();
        let most = lattice.counts()[2] as i32;
        let conflict_volume = fleet
            .conflict_volume(
                [me, other].map(|it| (it.kind, it.air_limit)),
                [ONE_WAKES_SHARE, LATE_WAKES_SHARE],
            )
            .scaled(1.0 / cell_m);
        let all: Vec<i32> = (-most..=most).collect();
        // Heights of the first over the second are depths of the second below it, backwards.
        let widest =
            |low: i32, high: i32| conflict_volume.widest_between(-f64::from(high), -f64::from(low));
        let at: Vec<f64> = all.iter().map(|k| widest(*k, *k)).collect();
        let between: Vec<f64> = all.iter().map(|k| widest(*k, k + 1)).collect();
        let bodies = (1..most).find(|k| f64::from(k - 1) >= conflict_volume.body_radius());
        let counts = |loads: &[f64; 2]| loads.iter().any(|load| *load >= LEAST_LOAD);
        let loaded = [&air.at, &air.between].map(|layers| PairAir::farthest(layers, counts));
        let is_priced = |price: &f64| *price >= LEAST_PRICE;
        let matters = |index: usize| {
            at[index] > 0.0 || between[index] > 0.0 || air.prices[index].iter().any(is_priced)
        };
        let farthest = (0..all.len()).filter(|&index| matters(index));
        let layers = farthest.map(|index| all[index].abs()).max().unwrap_or(0);
        let radii = at.iter().chain(&between).chain(&loaded);
        let farthest = radii.copied().fold(0.0, f64::max);
        Shape {
            me,
            other,
            extent: Extent {
                // Each may come a cell nearer.
                reach: (farthest.ceil() as i32 + 1).max(2),
                layers: (layers + 2).min(most),
                bodies: bodies.unwrap_or(most),
            },
            conflict_volume,
            delays: ConvectiveDelays {
                delay_bounds: [me, other].map(|it| *fleet.delay_bound(it.kind)),
                cell_m,
                relative_deviation_m: 2.0 * fleet.conditions().path_deviation_m,
            },
            at,
            between,
            widest: farthest,
            priced: PairAir::farthest(&air.prices, is_priced),
            air,
        }
    }

    pub(super) fn entries(&self) -> usize {
        let wide = 2 * self.extent.reach + 1;
        (wide * wide * (2 * self.extent.layers + 1)) as usize * DIRECTIONS * DIRECTIONS
    }

    /// Whether steps last longer than a table can hold.
    pub(super) fn is_too_slow(&self) -> bool {
        let slowest = self.me.ticks.iter().chain(&self.other.ticks).max();
        slowest.is_some_and(|ticks| *ticks > i16::MAX as u32 / 2)
    }

    /// Index in the tables of the layer that is so many above the other.
    fn index(&self, layer: i32) -> usize {
        let most = (self.at.len() / 2) as i32;
        (layer + most).clamp(0, 2 * most) as usize
    }

    /// Radius while the height of the first over the second is between these layers.
    fn radius(&self, low: i32, high: i32) -> f64 {
        let between = (low..high).map(|k| self.between[self.index(k)]);
        let ends = self.at[self.index(low)].max(self.at[self.index(high)]);
        between.fold(ends, f64::max)
    }

    fn price(&self, layers: f64, aside: f64) -> f64 {
        let most = (self.at.len() / 2) as f64;
        let row = &self.air.prices[(layers + most).round().clamp(0.0, 2.0 * most) as usize];
        let ring = (aside * RINGS as f64).round() as usize;
        row.get(ring).copied().unwrap_or(0.0)
    }

    /// Loads on both at a distance, while the height of the first over the second is between these
    /// layers; nothing where it is less than this share of a budget.
    fn loads(&self, low: i32, high: i32, distance: f64, least: f64) -> [u8; 2] {
        let ring = (distance * RINGS as f64) as usize;
        let ends = [low, high].map(|k| &self.air.at[self.index(k)]);
        let between = (low..high).map(|k| &self.air.between[self.index(k) + 1]);
        let rows = ends.into_iter().chain(between);
        let most_of = |side: usize| {
            let loads = rows.clone().filter_map(|row| row.get(ring));
            let load = loads.map(|both| both[side]).fold(0.0, f64::max);
            if load < least {
                return 0;
            }
            // What is more is forbidden.
            let most = match self.delays.is_none() {
                true => ONE_WAKES_SHARE,
                false => LATE_WAKES_SHARE,
            };
            (load.min(most) * LOADS).ceil() as u8
        };
        [most_of(0), most_of(1)]
    }

    /// Whether the second may matter to the first at any height over it, where it begins in this
    /// column.
    pub(super) fn may_matter(&self, directions: [usize; 2], aside: [i32; 2]) -> bool {
        let [x, y, _] = halfway(directions, [aside[0], aside[1], 0]);
        self.relative(directions, aside).nearest([0.0; 2]) <= self.widest
            || x.hypot(y) <= self.priced
    }

    /// By layer, from the lowest on in which the second may begin.
    pub(super) fn spans(&self, direction: usize, others: usize, aside: [i32; 2]) -> Vec<DelaySpan> {
        let level = self.relative([direction, others], aside);
        // The same whatever the height between them.
        let distance = level.nearest([0.0; 2]);
        let (mine, theirs) = (cells(direction), cells(others));
        let at_layer = |layer: i32| {
            // Heights of the first over the second: at the beginning, and when either or both have
            // arrived.
            let rises = [0, mine[2], -theirs[2], mine[2] - theirs[2]];
            let [low, high] = lowest_and_highest(&rises.map(|rise| rise - layer));
            let radius = self.radius(low, high);
            let [on_first, on_second] = self.loads(low, high, distance.max(radius), LEAST_LOAD);
            let mut span = DelaySpan {
                on_first,
                on_second,
                ..DelaySpan::default()
            };
            let forbidden = (distance < radius)
                .then(|| self.forbidden(&level, [direction, others], layer))
                .flatten();
            if let Some([from, to]) = forbidden {
                (span.from, span.to) = (from.floor() as i16, to.ceil() as i16);
            } else {
                let [x, y, z] = halfway([direction, others], [aside[0], aside[1], layer]);
                let price = self.price(-z, x.hypot(y));
                if price >= LEAST_PRICE {
                    span.price = (price * 1000.0).min(f64::from(u16::MAX)) as u16;
                }
            }
            span
        };
        let layers = self.extent.layers;
        (-layers..=layers).map(at_layer).collect()
    }

    /// The first on its step as seen from the second on its own, which begins in another column:
    /// one layer (cells, ticks).
    pub(super) fn relative(&self, [direction, others]: [usize; 2], [x, y]: [i32; 2]) -> Relative {
        let line = |direction: usize, from: [i32; 2], ticks: f64| {
            let is_still = direction == STILL;
            let line = Line {
                origin: Vector3::new(f64::from(from[0]), f64::from(from[1]), 0.0),
                velocity: Vector3::from(cells(direction).map(f64::from)) / ticks,
            };
            // Standing still, any moment will do.
            (line, [0.0, if is_still { 0.0 } else { ticks }])
        };
        let (first, first_time) = line(direction, [0; 2], self.me.ticks(direction));
        let (second, second_time) = line(others, [x, y], self.other.ticks(others));
        Relative::new(&second, &first, [second_time, first_time])
    }

    /// When the two are too near one another if the second begins so many layers above the first,
    /// at any convective delay: from and to, as [`DelaySpan`] has it, before rounding; `None`:
    /// never.
    pub(super) fn forbidden(
        &self,
        level: &Relative,
        [direction, others]: [usize; 2],
        layer: i32,
    ) -> Option<[f64; 2]> {
        let raised = level.raised(-f64::from(layer));
        let [from, to] = self.conflict_volume.delays(&raised, &self.delays)?;
        match (direction == STILL, others == STILL) {
            (true, true) => Some([-to, 1.0 - from]),
            // The second stands still at its moment zero.
            (false, true) => Some([-to, -from]),
            _ => Some([from, to]),
        }
    }

    /// Loads on both of two steps that last as long, by how far each leads and where the second
    /// begins as seen from the first (cells), while the first is ahead of the second on its step by
    /// no less and no more than these parts of it; `None`: they are too near one another.
    pub(super) fn synchronous(
        &self,
        [mine, theirs]: [[f64; 3]; 2],
        offset: [f64; 3],
        ahead: [f64; 2],
    ) -> Option<[u8; 2]> {
        let line = |by: [f64; 3], from: [f64; 3]| Line {
            origin: Vector3::from(from),
            velocity: Vector3::from(by),
        };
        let past = if ahead == [0.0; 2] {
            // Seen from the second, the first moves straight on.
            let by = [0, 1, 2].map(|axis| mine[axis] - theirs[axis]);
            let still = line([0.0; 3], offset);
            Relative::new(&still, &line(by, [0.0; 3]), [[0.0; 2], [0.0, 1.0]])
        } else {
            let (first, second) = (line(mine, [0.0; 3]), line(theirs, offset));
            let past = Relative::new(&second, &first, [[0.0, 1.0]; 2]).delayed(ahead);
            let Some(past) = past else {
                return Some([0; 2]);
            };
            past
        };
        let [shallow, deep] = past.depths();
        let low = (WHOLE_CELLS - deep).floor() as i32;
        let high = (-shallow - WHOLE_CELLS).ceil() as i32;
        let nearest = past.nearest([0.0; 2]);
        let radius = self.radius(low, high);
        // Only where the volume is that wide at any of these heights can it be met.
        if nearest < radius && self.conflict_volume.delays(&past, &QuasiStatic).is_some() {
            return None;
        }
        Some(self.loads(low, high, nearest.max(radius), LEAST_SYNCHRONOUS))
    }

    /// What air of earlier rounds means to the first, and that of this round to both, of two steps
    /// that last `ticks`: by how far each leads and where the second begins as seen from the first
    /// (cells), each of the two up to `shift` ticks early or late against the other.
    pub(super) fn advected(
        &self,
        [mine, theirs]: [[f64; 3]; 2],
        offset: [f64; 3],
        (ticks, shift): (u32, f64),
    ) -> AdvectedStep {
        let line = |by: [f64; 3], from: [f64; 3]| Line {
            origin: Vector3::from(from),
            velocity: Vector3::from(by),
        };
        let second = line(theirs, offset);
        let relative = Relative::new(&second, &line(mine, [0.0; 3]), [[0.0, 1.0]; 2]);
        let rounds = Rounds {
            delays: &self.delays,
            ticks: f64::from(ticks),
        };
        let apart = shift / f64::from(ticks);
        let met = self.conflict_volume.air_delays(&relative, &rounds);
        let [below, above] = met.map(|delays| delays.map(|[from, to]| [from - apart, to + apart]));
        let is_now = |delays: Option<[f64; 2]>| {
            delays.is_some_and(|[from, to]| from <= WHOLE_CELLS && to >= -WHOLE_CELLS)
        };
        let whole = |rounds: f64| rounds.clamp(0.0, f64::from(u8::MAX)) as u8;
        let [shallow, deep] = relative.depths();
        let later = below.filter(|[_, to]| *to >= 1.0 - WHOLE_CELLS);
        let later = later.map(|[from, to]| {
            [
                whole((from - WHOLE_CELLS).ceil().max(1.0)),
                whole((to + WHOLE_CELLS).floor()),
            ]
        });
        let (low, high) = (-deep, -shallow);
        let low = (low + WHOLE_CELLS).floor() as i32;
        let high = (high - WHOLE_CELLS).ceil() as i32;
        let distance = relative.nearest([0.0; 2]).max(self.radius(low, high));
        let [load, _] = self.loads(low, high.max(low), distance, LEAST_SYNCHRONOUS);
        let lasts = if deep > 0.0 {
            (rounds.of_reference(deep) + apart).ceil()
        } else {
            0.0
        };
        AdvectedStep {
            now: is_now(below) || is_now(above),
            rounds: later.unwrap_or_default(),
            load: if deep > 0.0 { load } else { 0 },
            lasts: whole(lasts),
        }
    }
}

/// How long ago, in rounds of steps that last as long, a step of the second forbids one of the
/// first by its air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct AdvectedStep {
    /// In the same round air of either is too much for the other.
    pub(super) now: bool,
    /// From so many rounds after it until so many; nothing where the first is 0.
    pub(super) rounds: [u8; 2],
    /// What it fills of the first's budget, at most (parts of [`LOADS`]), and for how many rounds.
    pub(super) load: u8,
    pub(super) lasts: u8,
}

impl AdvectedStep {
    /// Whether it means anything.
    pub(super) fn matters(&self) -> bool {
        self.now || self.rounds[0] > 0 || self.load > 0 && self.lasts > 0
    }
}

/// The longest convective delay, in rounds of so many ticks.
struct Rounds<'a> {
    delays: &'a ConvectiveDelays,
    ticks: f64,
}

impl ConvectiveDelay for Rounds<'_> {
    fn of_reference(&self, depth: f64) -> f64 {
        self.delays.of_reference(depth) / self.ticks
    }

    fn of_mover(&self, depth: f64) -> f64 {
        self.delays.of_mover(depth) / self.ticks
    }
}

/// Heights of one over another between which they are on the way.
fn lowest_and_highest(heights: &[i32]) -> [i32; 2] {
    let ends = |[low, high]: [i32; 2], height: &i32| [low.min(*height), high.max(*height)];
    heights.iter().fold([heights[0]; 2], ends)
}

/// Where the second is as seen from the first, both half-way on their steps (cells).
fn halfway(directions: [usize; 2], offset: [i32; 3]) -> [f64; 3] {
    let [mine, theirs] = directions.map(cells);
    [0, 1, 2].map(|axis| f64::from(offset[axis]) + 0.5 * f64::from(theirs[axis] - mine[axis]))
}

/// What two drones are to one another, one this far aside of the other, at heights over it between
/// these: at so many azimuths.
fn meet_at(
    fleet: &Fleet,
    [me, other]: [Class; 2],
    (radius_m, azimuths): (f64, u32),
    [low_m, high_m]: [f64; 2],
) -> impl Iterator<Item = LegInteraction> {
    (0..azimuths).filter_map(move |azimuth| {
        let turn = f64::from(azimuth) * std::f64::consts::TAU / f64::from(azimuths);
        let (sin, cos) = turn.sin_cos();
        let at_m = |z_m: f64| Point3::new(radius_m * cos, radius_m * sin, z_m);
        let passing = me.leg(0, at_m(low_m), at_m(high_m));
        let still = other.leg(1, Point3::origin(), Point3::origin());
        fleet.meet_as_planned(&passing, &still, [f64::NEG_INFINITY; 2])
    })
}
