//! What two classes do to one another: by the directions of two steps, and how far one begins from
//! the other.
//!
//! Turned by quarters and mirrored about the vertical all is the same, so that one of each eight
//! pairs of directions is worked out and kept: a table that stays close to the processor, where
//! searches ask it all the time.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::directions::{DIRECTIONS, STILL, TURNS, cells, index, turned};
use super::steps::Span;

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

/// By so many layers two steps may come farther from one another: each climbs or sinks by one.
const CLIMBS: i32 = 2;

/// What two classes do to one another, by directions and offset.
#[derive(Debug)]
pub(super) struct ConflictTable {
    pub(super) extent: Extent,
    /// `[directions kept][column][dz]`, which of `spans` it is.
    kinds: Vec<u16>,
    /// The first is nothing.
    spans: Vec<Span>,
    /// By direction and direction: how they are turned, and which of those that are kept they are
    /// then.
    alike: Vec<(u8, u16)>,
    /// By turn and column, which column it becomes.
    turned: Vec<u16>,
    columns: usize,
    /// By layers of the second above the first, from the lowest on: how long the air of the first
    /// and of the second may last down that far (ticks).
    lasts: Vec<[u32; 2]>,
    /// By direction of the second: offsets of its beginning from where the first hovers, with what
    /// it forbids or costs there.
    pub(super) hovering: Vec<Vec<([i32; 3], Span)>>,
    /// By direction of the first: columns in which a drone can matter.
    pub(super) near: Vec<Vec<Near>>,
    /// By direction of the first: columns in which a drone who hovers can matter.
    pub(super) near_still: Vec<Vec<Near>>,
}

/// A column of the floor beside a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    /// How far from the beginning of the step.
    pub(super) aside: [i32; 2],
    column: usize,
}

impl ConflictTable {
    /// `lasts` is asked for layers of the second above the first, `spans_of` for direction,
    /// direction and the column of the second; it says by layer.
    pub(super) fn new(
        (extent, lasts): (Extent, &dyn Fn(i32) -> [u32; 2]),
        spans_of: impl Fn(usize, usize, [i32; 2]) -> Vec<Span> + Sync,
    ) -> ConflictTable {
        let aside = -extent.reach..=extent.reach;
        let columns: Vec<[i32; 2]> = aside
            .clone()
            .flat_map(|dy| aside.clone().map(move |dx| [dx, dy]))
            .collect();
        let layers = -extent.layers..=extent.layers;
        let first_alike = |directions: usize| {
            let all = (0..TURNS).map(|turn| {
                let turned = |direction: usize| index(turned(cells(direction), turn));
                (
                    turned(directions / DIRECTIONS),
                    turned(directions % DIRECTIONS),
                    turn,
                )
            });
            let (direction, others, turn) = all.min().unwrap_or_default();
            ((direction, others), turn)
        };
        let mut kept: Vec<(usize, usize)> = (0..DIRECTIONS * DIRECTIONS)
            .map(|directions| first_alike(directions).0)
            .collect();
        kept.sort_unstable();
        kept.dedup();
        let alike = |directions: usize| {
            let (directions, turn) = first_alike(directions);
            let kept = kept.binary_search(&directions).unwrap_or_default();
            (turn as u8, kept as u16)
        };
        let of_directions = |&(direction, others): &(usize, usize)| -> Vec<Span> {
            let of_column = |aside: &[i32; 2]| spans_of(direction, others, *aside);
            columns.iter().flat_map(of_column).collect()
        };
        let worked_out: Vec<Vec<Span>> = kept.par_iter().map(of_directions).collect();
        let mut spans = vec![Span::default()];
        let mut known = FxHashMap::from_iter([(Span::default(), 0)]);
        let kind = |span: Span| {
            if span == Span::default() {
                // Most of them.
                return 0;
            }
            *known.entry(span).or_insert_with(|| {
                spans.push(span);
                (spans.len() - 1) as u16
            })
        };
        let kinds = worked_out.into_iter().flatten().map(kind).collect();
        let becomes = |turn: usize| {
            let at = move |[dx, dy]: &[i32; 2]| {
                let [dx, dy, _] = turned([*dx, *dy, 0], turn);
                (dx + extent.reach + (2 * extent.reach + 1) * (dy + extent.reach)) as u16
            };
            columns.iter().map(at)
        };
        let mut table = ConflictTable {
            extent,
            kinds,
            spans,
            alike: (0..DIRECTIONS * DIRECTIONS).map(alike).collect(),
            turned: (0..TURNS).flat_map(becomes).collect(),
            columns: columns.len(),
            lasts: (-extent.layers - CLIMBS..=extent.layers + CLIMBS)
                .map(lasts)
                .collect(),
            hovering: Vec::new(),
            near: Vec::new(),
            near_still: Vec::new(),
        };
        let all_near = columns.iter().enumerate();
        let all_near: Vec<Near> = all_near
            .map(|(column, &aside)| Near { aside, column })
            .collect();
        let hovering = |others: usize| {
            let offsets = layers
                .clone()
                .flat_map(|dz| all_near.iter().map(move |near| (near, dz)));
            offsets
                .map(|(near, dz)| {
                    let [dx, dy] = near.aside;
                    ([dx, dy, dz], table.span([STILL, others], near, dz))
                })
                .filter(|(_, span)| !span.is_empty() || span.price > 0)
                .collect()
        };
        let near_to = |direction: usize, others: std::ops::Range<usize>| -> Vec<Near> {
            let is_something = |kind: &u16| *kind != 0;
            let matters = |near: &&Near| {
                (others.clone())
                    .any(|others| table.layers_of([direction, others], near).any(is_something))
            };
            all_near.iter().filter(matters).copied().collect()
        };
        let directions = (0..DIRECTIONS).into_par_iter();
        (table.hovering, table.near, table.near_still) = (
            directions.clone().map(hovering).collect(),
            directions
                .clone()
                .map(|direction| near_to(direction, 0..DIRECTIONS))
                .collect(),
            directions
                .map(|direction| near_to(direction, STILL..STILL + 1))
                .collect(),
        );
        table
    }

    /// What a step does to another that begins so many layers above it in a column.
    #[inline]
    pub(super) fn span(&self, directions: [usize; 2], near: &Near, layers: i32) -> Span {
        let kind =
            self.kinds[self.first(directions, near) + (layers + self.extent.layers) as usize];
        self.spans[usize::from(kind)]
    }

    /// How long the air of a step, and of another that begins so many layers above it, may last
    /// down to one another (ticks).
    #[inline]
    pub(super) fn lasts(&self, [direction, others]: [usize; 2], layers: i32) -> [u32; 2] {
        let (mine, theirs) = (cells(direction)[2], cells(others)[2]);
        let rises = [0, theirs, -mine, theirs - mine];
        let ends = rises.iter().fold([0; 2], |[low, high], rise| {
            [low.min(*rise), high.max(*rise)]
        });
        let at = |rise: i32| self.lasts[(layers + rise + self.extent.layers + CLIMBS) as usize];
        [at(ends[0])[0], at(ends[1])[1]]
    }

    /// The same for any steps and layers.
    pub(super) fn longest(&self) -> [u32; 2] {
        let ends = [self.lasts.first(), self.lasts.last()];
        let [first, last] = ends.map(|it| it.copied().unwrap_or_default());
        [first[0], last[1]]
    }

    fn layers_of(&self, directions: [usize; 2], near: &Near) -> impl Iterator<Item = &u16> {
        let first = self.first(directions, near);
        self.kinds[first..].iter().take(self.tall())
    }

    #[inline]
    fn first(&self, [direction, others]: [usize; 2], near: &Near) -> usize {
        let (turn, kept) = self.alike[direction * DIRECTIONS + others];
        let column = self.turned[usize::from(turn) * self.columns + near.column];
        (usize::from(kept) * self.columns + usize::from(column)) * self.tall()
    }

    #[inline]
    fn tall(&self) -> usize {
        (2 * self.extent.layers + 1) as usize
    }
}
