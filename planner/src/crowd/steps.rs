//! What two steps on the lattice do to one another, as a table.
//!
//! Bodies, columns and wakes of two drones keep them a radius apart that depends on the height between them alone. Two steps
//! from neighbouring places break it for some delays of one against the other, which are one interval: so all of it
//! fits into a table by direction, direction and offset. It serves to find ways, not to judge them: pairs only, no
//! sums, and the height between two steps counts as all that it becomes on the way.

use costmap::costmap::Costmap;
use costmap::fleet::{BUDGET, Fleet, Meeting};
use costmap::leg::{DroneId, KindId, Leg, Tick};
use costmap::verdict::price;
use nalgebra::Point3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::span::{Way, least_distance, meeting, passing};
use crate::errand::Errand;
use crate::lattice::Lattice;

/// Fleets of more classes than this are planned without. Chosen here: every class keeps intervals of its own.
const MOST_CLASSES: usize = 4;
/// Tables of more entries than this are not made. Chosen here: 64 MiB.
const MOST_ENTRIES: usize = 8 << 20;
/// Share of a budget that one wake may fill here: chosen here, the rest is for wakes farther off.
const ONE_WAKES_SHARE: f64 = 0.4;
/// Prices below this are left to the verdict: chosen here, three hundredths of a second a step (s/s).
const LEAST_PRICE: f64 = 0.0625;
/// Loads below this share of a budget are left to the verdict: chosen here, three of them fit into what is left
/// for wakes farther off.
const LEAST_LOAD: f64 = 0.04;
/// Azimuths at which a wake is asked for: chosen here, moved jets are not round.
const AZIMUTHS: u32 = 8;

/// Number of directions, standing still included.
pub(super) const WAYS: usize = 27;
/// The direction of who stands still.
pub(super) const STILL: usize = 13;

/// Cells of a direction along x, y and z.
pub(super) const fn cells(way: usize) -> [i32; 3] {
    let way = way as i32;
    [way % 3 - 1, way / 3 % 3 - 1, way / 9 - 1]
}

/// Ways to turn and mirror a square.
const TURNS: usize = 8;

/// A direction or offset, turned by quarters and mirrored.
fn turned([x, y, z]: [i32; 3], turn: usize) -> [i32; 3] {
    let (x, y) = if turn & 1 == 0 { (x, y) } else { (y, x) };
    let x = if turn & 2 == 0 { x } else { -x };
    let y = if turn & 4 == 0 { y } else { -y };
    [x, y, z]
}

/// Number of a direction.
pub(super) const fn index([x, y, z]: [i32; 3]) -> usize {
    (x + 1 + 3 * (y + 1) + 9 * (z + 1)) as usize
}

/// What flies alike as others are concerned.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Class {
    kind: KindId,
    air_limit: f64,
    /// Of a step along one, two and three axes.
    ticks: [u32; 3],
}

/// What one step does to another that begins at some offset from it.
///
/// Both move: the delays of the first against the second, in ticks, at which they are too near. One stands still: when
/// the other is too near, in ticks since it began. Nobody moves: not empty if they are too near.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Span {
    pub(super) from: i16,
    pub(super) to: i16,
    /// What it costs both while they are not too near (thousandths of a second a second).
    pub(super) price: u16,
    /// What the second's wake fills of the first's budget, at most, while they are not too near (parts of
    /// [`LOADS`]), and the other way round.
    pub(super) on_first: u8,
    pub(super) on_second: u8,
}

/// Parts of a budget that are told apart.
pub(super) const LOADS: f64 = 250.0;

impl Span {
    pub(super) fn is_empty(&self) -> bool {
        self.from >= self.to
    }
}

/// Tables of a fleet: they do not change while it is planned.
#[derive(Debug)]
pub struct Steps {
    pub(super) lattice: Lattice,
    classes: Vec<Class>,
    /// Per drone, its classes by kind.
    of_drones: Vec<Vec<(KindId, usize)>>,
    /// `[class][other class]`.
    pairs: Vec<Pair>,
    /// By class and place, the lowest layer that the wake of who hovers there reaches; empty without covers.
    wake_ends: Vec<Vec<u16>>,
}

#[derive(Debug, Default)]
struct Pair {
    /// How many columns aside, and how many layers above and below, anything matters.
    reach: i32,
    layers: i32,
    /// Layers between two drones from which on only air matters.
    bodies: i32,
    /// `[direction][direction][dz][dy][dx]`, which of `spans` it is.
    kinds: Vec<u16>,
    spans: Vec<Span>,
    /// By direction of the first: columns in which something can matter.
    near: Vec<Vec<[i32; 2]>>,
}

impl Steps {
    /// Tables for a fleet, and for whoever else is in the costmap; `None` where there are zones, air that comes late, too
    /// many classes, or too much to tabulate.
    pub fn new(lattice: &Lattice, errands: &[Errand], costmap: &Costmap) -> Option<Steps> {
        if costmap.has_zones() || costmap.has_late_air() {
            return None;
        }
        let mut classes: Vec<Class> = Vec::new();
        let mut of_drones = Vec::with_capacity(costmap.drone_count());
        for errand in errands {
            let ticks = errand.mover.step_ticks();
            let mut own = Vec::new();
            for &kind in &errand.kinds {
                let class = Class {
                    kind,
                    air_limit: errand.air_limit,
                    ticks,
                };
                own.push((kind, index_of(&mut classes, class)));
            }
            of_drones.push(own);
        }
        for drone in errands.len()..costmap.drone_count() {
            let legs = costmap.legs(DroneId(drone as u32)).iter();
            let own = legs.map(|leg| {
                let class = Class {
                    kind: leg.kind,
                    air_limit: leg.air_limit,
                    // It is taken to stand still a while here, a while there.
                    ticks: [1; 3],
                };
                (leg.kind, index_of(&mut classes, class))
            });
            let mut own: Vec<(KindId, usize)> = own.collect();
            own.dedup();
            of_drones.push(own);
        }
        if classes.len() > MOST_CLASSES {
            return None;
        }
        let of_pairs = classes
            .iter()
            .flat_map(|me| classes.iter().map(move |other| (*me, *other)));
        let shapes: Vec<Shape> = of_pairs
            .map(|(me, other)| Shape::new(lattice, costmap.fleet(), me, other))
            .collect();
        let entries = shapes.iter().map(Shape::entries).sum::<usize>();
        if entries > MOST_ENTRIES || shapes.iter().any(Shape::is_too_slow) {
            return None;
        }
        let pairs = shapes.iter().map(Shape::pair).collect();
        let wake_ends = if costmap.has_covers() {
            let of_class = |class| wake_ends(lattice, costmap, class);
            classes.iter().map(of_class).collect()
        } else {
            Vec::new()
        };
        Some(Steps {
            lattice: lattice.clone(),
            classes,
            of_drones,
            pairs,
            wake_ends,
        })
    }

    pub(super) fn class_count(&self) -> usize {
        self.classes.len()
    }

    /// The class of a drone as it flies now.
    pub(super) fn class(&self, drone: DroneId, kind: KindId) -> Option<usize> {
        let own = self.of_drones.get(drone.0 as usize)?;
        let found = own.iter().find(|(known, _)| *known == kind);
        found.map(|(_, class)| *class)
    }

    /// Columns around the beginning of a step in which others can matter to it.
    pub(super) fn near(&self, me: usize, other: usize, way: usize) -> &[[i32; 2]] {
        &self.pairs[me * self.classes.len() + other].near[way]
    }

    /// How many layers above and below matter.
    pub(super) fn layers(&self, me: usize, other: usize) -> i32 {
        self.pairs[me * self.classes.len() + other].layers
    }

    /// What a step does to another, that begins at an offset from it.
    pub(super) fn span(
        &self,
        [me, other]: [usize; 2],
        [way, others]: [usize; 2],
        offset: [i32; 3],
    ) -> Span {
        let pair = &self.pairs[me * self.classes.len() + other];
        pair.index(way, others, offset)
            .map_or(Span::default(), |index| {
                pair.spans[usize::from(pair.kinds[index])]
            })
    }

    /// Whether only air keeps two drones apart with so many layers between them.
    pub(super) fn is_air_alone(&self, me: usize, other: usize, layers: i32) -> bool {
        layers.abs() >= self.pairs[me * self.classes.len() + other].bodies
    }

    /// The lowest layer that the wake of a drone on its way from a place reaches.
    pub(super) fn wake_end(&self, class: usize, at: [i32; 3], way: usize) -> i32 {
        let Some(ends) = self.wake_ends.get(class) else {
            return 0;
        };
        let to = cells(way);
        let end = |at: [i32; 3]| {
            let place = self.lattice.at(at);
            place.map_or(0, |place| i32::from(ends[place as usize]))
        };
        end(at).min(end([0, 1, 2].map(|axis| at[axis] + to[axis])))
    }
}

fn index_of(classes: &mut Vec<Class>, class: Class) -> usize {
    let known = classes.iter().position(|known| *known == class);
    known.unwrap_or_else(|| {
        classes.push(class);
        classes.len() - 1
    })
}

fn wake_ends(lattice: &Lattice, costmap: &Costmap, class: &Class) -> Vec<u16> {
    let of = |place: u32| {
        let at_m = lattice.position_m(place);
        let end_z_m = costmap.wake_end_z_m(&class.leg(0, at_m, at_m));
        let [i, j, _] = lattice.steps(place);
        let reached = (0..lattice.counts()[2] as i32).position(|k| {
            let there = lattice.at([i, j, k]);
            there.is_some_and(|there| lattice.position_m(there).z >= end_z_m - 1e-6)
        });
        reached.unwrap_or(lattice.counts()[2]) as u16
    };
    (0..lattice.place_count() as u32).map(of).collect()
}

impl Class {
    fn leg(&self, drone: u32, from_m: Point3<f64>, to_m: Point3<f64>) -> Leg {
        Leg {
            drone: DroneId(drone),
            kind: self.kind,
            start: Tick(0),
            end: Tick(1),
            from_m,
            to_m,
            flying: true,
            air_limit: self.air_limit,
        }
    }

    /// Ticks of a step in a direction; of standing still, any.
    fn ticks(&self, way: usize) -> f64 {
        let axes = cells(way).iter().filter(|cells| **cells != 0).count();
        f64::from(self.ticks[axes.max(1) - 1])
    }
}

impl Pair {
    fn index(&self, way: usize, others: usize, [dx, dy, dz]: [i32; 3]) -> Option<usize> {
        let (reach, layers) = (self.reach, self.layers);
        if dx.abs() > reach || dy.abs() > reach || dz.abs() > layers {
            return None;
        }
        let (wide, tall) = (2 * reach + 1, 2 * layers + 1);
        let offset = (dx + reach) + wide * ((dy + reach) + wide * (dz + layers));
        let of_ways = (way * WAYS + others) * (wide * wide * tall) as usize;
        Some(of_ways + offset as usize)
    }
}

/// How far two classes keep from one another, by the layers between them.
struct Shape {
    me: Class,
    other: Class,
    layers: i32,
    reach: i32,
    bodies: i32,
    /// Radius (cells) at `k` layers above the other and between `k` and `k + 1`, from the lowest on.
    at: Vec<f64>,
    between: Vec<f64>,
    /// By layers above the other and [`RINGS`] aside, what hovering costs both (s/s).
    prices: Vec<Vec<f64>>,
    /// Loads on both, in the same way, at `k` layers above the other and between `k` and `k + 1`.
    loads_at: Vec<Vec<[f64; 2]>>,
    loads_between: Vec<Vec<[f64; 2]>>,
    /// From this distance on there is no load (cells).
    far: f64,
}

/// Distances in a cell at which wakes are asked for: chosen here, five centimetres of a metre.
const RINGS: usize = 20;

impl Shape {
    fn new(lattice: &Lattice, fleet: &Fleet, me: Class, other: Class) -> Shape {
        let cell_m = lattice.cell_m();
        let most = lattice.counts()[2] as i32;
        let near_m = 2.0 * fleet.near_m() + cell_m;
        let radius = |low: i32, high: i32, air: bool| {
            let z_m = [low, high].map(|layers| f64::from(layers) * cell_m);
            let is_near = |radius_m: f64| is_too_near(fleet, [me, other], radius_m, z_m, air);
            if !is_near(0.0) {
                return 0.0;
            }
            let (mut inside_m, mut outside_m) = (0.0, near_m);
            // To a hundredth of a cell.
            while outside_m - inside_m > 0.01 * cell_m {
                let middle_m = 0.5 * (inside_m + outside_m);
                if is_near(middle_m) {
                    inside_m = middle_m;
                } else {
                    outside_m = middle_m;
                }
            }
            outside_m / cell_m
        };
        let all: Vec<i32> = (-most..=most).collect();
        let at = all.iter().map(|k| radius(*k, *k, true)).collect::<Vec<_>>();
        let between = all
            .iter()
            .map(|k| radius(*k, k + 1, true))
            .collect::<Vec<_>>();
        let bodies = (1..most).find(|k| radius(*k - 1, *k, false) == 0.0);
        let rings = 0..=(near_m / cell_m * RINGS as f64).ceil() as usize;
        let cost = |k: &i32| {
            let at_price = |ring: usize| {
                let height_m = f64::from(*k) * cell_m;
                let met = meet_at(
                    fleet,
                    [me, other],
                    ring as f64 / RINGS as f64 * cell_m,
                    [height_m; 2],
                );
                met.map(|it| price(it.alpha_first) + price(it.alpha_second))
                    .fold(0.0, f64::max)
            };
            rings.clone().map(at_price).collect()
        };
        let prices: Vec<Vec<f64>> = all.iter().map(cost).collect();
        let loads = |low: i32, high: i32| -> Vec<[f64; 2]> {
            let z_m = [low, high].map(|layers| f64::from(layers) * cell_m);
            let at_ring = |ring: usize| {
                let met = meet_at(fleet, [me, other], ring as f64 / RINGS as f64 * cell_m, z_m);
                met.map(|it| [it.load_on_first, it.load_on_second])
                    .map(|loads| loads.map(|load| f64::from(load) / f64::from(BUDGET)))
                    .fold([0.0_f64; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])])
            };
            rings.clone().map(at_ring).collect()
        };
        let loads_at: Vec<Vec<[f64; 2]>> = all.iter().map(|k| loads(*k, *k)).collect();
        let loads_between: Vec<Vec<[f64; 2]>> = all.iter().map(|k| loads(*k, k + 1)).collect();
        let counts = |ring: &usize| {
            let both = loads_at.iter().chain(&loads_between);
            both.flat_map(|rings| rings[*ring])
                .any(|load| load >= LEAST_LOAD)
        };
        let far = rings.clone().rev().find(counts).map_or(0, |ring| ring + 1) as f64 / RINGS as f64;
        let matters = |index: usize| {
            at[index] > 0.0
                || between[index] > 0.0
                || prices[index].iter().any(|price| *price >= LEAST_PRICE)
        };
        let farthest = (0..all.len()).filter(|&index| matters(index));
        let layers = farthest.map(|index| all[index].abs()).max().unwrap_or(0);
        let widest = at.iter().chain(&between).copied().fold(far, f64::max);
        Shape {
            me,
            other,
            layers: (layers + 2).min(most),
            // Each may come a cell nearer.
            reach: (widest.ceil() as i32 + 1).max(2),
            bodies: bodies.unwrap_or(most),
            at,
            between,
            prices,
            loads_at,
            loads_between,
            far: far.max(widest),
        }
    }

    fn entries(&self) -> usize {
        let wide = 2 * self.reach + 1;
        (wide * wide * (2 * self.layers + 1)) as usize * WAYS * WAYS
    }

    /// Whether steps last longer than a table can hold.
    fn is_too_slow(&self) -> bool {
        let slowest = self.me.ticks.iter().chain(&self.other.ticks).max();
        slowest.is_some_and(|ticks| *ticks > i16::MAX as u32 / 2)
    }

    /// Radius while the height of the first over the second is between these layers.
    fn radius(&self, low: i32, high: i32) -> f64 {
        let most = (self.at.len() / 2) as i32;
        let index = |k: i32| (k + most).clamp(0, 2 * most) as usize;
        let between = (low..high).map(|k| self.between[index(k)]);
        between.fold(self.at[index(low)].max(self.at[index(high)]), f64::max)
    }

    fn price(&self, layers: f64, aside: f64) -> f64 {
        let most = (self.at.len() / 2) as f64;
        let row = &self.prices[(layers + most).round().clamp(0.0, 2.0 * most) as usize];
        let ring = (aside * RINGS as f64).round() as usize;
        row.get(ring).copied().unwrap_or(0.0)
    }

    /// Loads on both at a distance, while the height of the first over the second is between these layers.
    fn loads(&self, low: i32, high: i32, distance: f64) -> [u8; 2] {
        let most = (self.at.len() / 2) as i32;
        let index = |k: i32| (k + most).clamp(0, 2 * most) as usize;
        let ring = (distance * RINGS as f64) as usize;
        let rows = [&self.loads_at[index(low)], &self.loads_at[index(high)]];
        let rows = rows
            .into_iter()
            .chain((low..high).map(|k| &self.loads_between[index(k)]));
        let most_of = |side: usize| {
            let loads = rows.clone().filter_map(|row| row.get(ring));
            let load = loads.map(|both| both[side]).fold(0.0, f64::max);
            // What is more is forbidden.
            (load.min(ONE_WAKES_SHARE) * LOADS).ceil() as u8
        };
        [most_of(0), most_of(1)]
    }

    fn pair(&self) -> Pair {
        let wide = 2 * self.reach + 1;
        let count = (wide * wide * (2 * self.layers + 1)) as usize;
        let of_ways = |&(way, others): &(usize, usize)| {
            let mut spans = Vec::with_capacity(count);
            for dz in -self.layers..=self.layers {
                for dy in -self.reach..=self.reach {
                    for dx in -self.reach..=self.reach {
                        spans.push(self.span(way, others, [dx, dy, dz]));
                    }
                }
            }
            spans
        };
        // Turned and mirrored about the vertical all is the same: what is worked out is one of each eight.
        let alike: Vec<(usize, (usize, usize))> = (0..WAYS * WAYS)
            .map(|ways| {
                let turned = |turn| {
                    (
                        turned(cells(ways / WAYS), turn),
                        turned(cells(ways % WAYS), turn),
                    )
                };
                let first =
                    (0..TURNS).map(|turn| (index(turned(turn).0), index(turned(turn).1), turn));
                let (way, others, turn) = first.min().unwrap_or_default();
                (turn, (way, others))
            })
            .collect();
        let mut distinct: Vec<(usize, usize)> = alike.iter().map(|(_, ways)| *ways).collect();
        distinct.sort_unstable();
        distinct.dedup();
        let worked_out: Vec<Vec<Span>> = distinct.par_iter().map(of_ways).collect();
        let at = |ways: usize, [dx, dy, dz]: [i32; 3]| {
            let (turn, ways) = alike[ways];
            let [dx, dy, dz] = turned([dx, dy, dz], turn);
            let offset = (dx + self.reach) + wide * ((dy + self.reach) + wide * (dz + self.layers));
            let known = distinct.binary_search(&ways).unwrap_or_default();
            worked_out[known][offset as usize]
        };
        let mut spans: Vec<Span> = Vec::new();
        let mut known: FxHashMap<Span, u16> = FxHashMap::default();
        let mut kinds = Vec::with_capacity(count * WAYS * WAYS);
        for ways in 0..WAYS * WAYS {
            for dz in -self.layers..=self.layers {
                for dy in -self.reach..=self.reach {
                    for dx in -self.reach..=self.reach {
                        let span = at(ways, [dx, dy, dz]);
                        let kind = known.entry(span).or_insert_with(|| {
                            spans.push(span);
                            (spans.len() - 1) as u16
                        });
                        kinds.push(*kind);
                    }
                }
            }
        }
        let nothing = known.get(&Span::default()).copied();
        let matters = |way: usize, [dx, dy]: [i32; 2]| {
            let column = (dx + self.reach) + wide * (dy + self.reach);
            let own = &kinds[way * WAYS * count..(way + 1) * WAYS * count];
            let mut layers = own
                .iter()
                .skip(column as usize)
                .step_by((wide * wide) as usize);
            layers.any(|kind| Some(*kind) != nothing)
        };
        let aside = -self.reach..=self.reach;
        let columns: Vec<[i32; 2]> = aside
            .clone()
            .flat_map(|dy| aside.clone().map(move |dx| [dx, dy]))
            .collect();
        let near_to = |way: usize| {
            let near = columns.iter().copied();
            near.filter(|column| matters(way, *column)).collect()
        };
        Pair {
            reach: self.reach,
            layers: self.layers,
            bodies: self.bodies,
            near: (0..WAYS).map(near_to).collect(),
            kinds,
            spans,
        }
    }

    /// `offset`: the second's beginning from the first's.
    fn span(&self, way: usize, others: usize, offset: [i32; 3]) -> Span {
        let (mine, theirs) = (cells(way), cells(others));
        // Heights of the first over the second: at the beginning, and when either or both have arrived.
        let rises = [0, mine[2], -theirs[2], mine[2] - theirs[2]];
        let heights = rises.map(|rise| rise - offset[2]);
        let (low, high) = heights
            .iter()
            .fold((i32::MAX, i32::MIN), |(low, high), &height| {
                (low.min(height), high.max(height))
            });
        let radius = self.radius(low, high);
        let on_floor = |cells: [i32; 3]| [f64::from(cells[0]), f64::from(cells[1])];
        let first = Way {
            from: [0.0; 2],
            by: on_floor(mine),
            ticks: self.me.ticks(way),
        };
        let second = Way {
            from: on_floor(offset),
            by: on_floor(theirs),
            ticks: self.other.ticks(others),
        };
        let (found, distance) = match (way == STILL, others == STILL) {
            (true, true) => {
                let [x, y] = second.from;
                let distance = x.hypot(y);
                ((distance < radius).then_some([0.0, 1.0]), distance)
            }
            (false, true) => {
                let past = Way {
                    from: second.from.map(|at| -at),
                    ..first
                };
                (passing(&past, radius), least_distance(&past))
            }
            (true, false) => (passing(&second, radius), least_distance(&second)),
            (false, false) => meeting(&first, &second, radius, self.far),
        };
        let [on_first, on_second] = self.loads(low, high, distance.max(radius));
        let mut span = Span {
            on_first,
            on_second,
            ..Span::default()
        };
        if let Some([from, to]) = found {
            (span.from, span.to) = (from.floor() as i16, to.ceil() as i16);
        } else {
            let middle =
                |axis: usize| f64::from(offset[axis]) + 0.5 * f64::from(theirs[axis] - mine[axis]);
            let price = self.price(-middle(2), middle(0).hypot(middle(1)));
            if price >= LEAST_PRICE {
                span.price = (price * 1000.0).min(f64::from(u16::MAX)) as u16;
            }
        }
        span
    }
}

/// What two drones are to one another, one this far aside of the other, at heights over it between these: at all azimuths.
fn meet_at(
    fleet: &Fleet,
    [me, other]: [Class; 2],
    radius_m: f64,
    [low_m, high_m]: [f64; 2],
) -> impl Iterator<Item = Meeting> {
    (0..AZIMUTHS).filter_map(move |azimuth| {
        let turn = f64::from(azimuth) * std::f64::consts::TAU / f64::from(AZIMUTHS);
        let (sin, cos) = turn.sin_cos();
        let at_m = |z_m: f64| Point3::new(radius_m * cos, radius_m * sin, z_m);
        let passing = me.leg(0, at_m(low_m), at_m(high_m));
        let still = other.leg(1, Point3::origin(), Point3::origin());
        fleet.meet(&passing, &still, [f64::NEG_INFINITY; 2])
    })
}

/// Whether they are too near, all in all or their bodies alone.
fn is_too_near(
    fleet: &Fleet,
    classes: [Class; 2],
    radius_m: f64,
    z_m: [f64; 2],
    air: bool,
) -> bool {
    let most = (ONE_WAKES_SHARE * f64::from(BUDGET)) as u32;
    meet_at(fleet, classes, radius_m, z_m).any(|met| {
        let blown = met.column || met.load_on_first > most || met.load_on_second > most;
        met.bodies || air && blown
    })
}
