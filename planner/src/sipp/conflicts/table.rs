//! What two classes do to one another: by the directions of two steps, and how far one begins from
//! the other.
//!
//! Turned by quarters and mirrored about the vertical all is the same, so that one of each eight
//! pairs of directions is kept. What is asked for is worked out then, column by column, and kept:
//! of a fleet of many airframes most never is.

use std::sync::OnceLock;

use costmap::volumes::conflict_volume::ConvectiveDelay;

use super::directions::{DIRECTIONS, STILL, TURNS, cells, index, turned};
use super::shape::Shape;
use super::steps::DelaySpan;

/// By so many layers two steps may come farther from one another: each climbs or sinks by one.
const CLIMBS: i32 = 2;

/// What two classes do to one another, by directions and offset.
#[derive(Debug)]
pub(super) struct ConflictTable {
    /// What the rows are worked out from.
    pub(super) shape: Shape,
    /// `[directions kept][column]`, once it was asked for: by layer from the lowest on, or nothing
    /// where no layer matters.
    rows: Vec<OnceLock<Box<[DelaySpan]>>>,
    /// The pairs of directions that are kept.
    kept: Vec<[usize; 2]>,
    /// By direction and direction: how they are turned, and which of those that are kept they are
    /// then.
    alike: Vec<(u8, u16)>,
    /// How far each column of the floor is from a step's beginning.
    columns: Vec<[i32; 2]>,
    /// By turn and column, which column it becomes.
    turned: Vec<u16>,
    /// By layers of the second above the first, from the lowest on: how long the air of the first
    /// and of the second may last down that far (ticks).
    lasts: Vec<[u32; 2]>,
    /// See [`ConflictTable::hovering`].
    hovering: [OnceLock<Vec<Hovering>>; DIRECTIONS],
    /// See [`ConflictTable::near`].
    near: [OnceLock<Vec<Near>>; DIRECTIONS],
    /// See [`ConflictTable::near_still`].
    near_still: [OnceLock<Vec<Near>>; DIRECTIONS],
}

/// What a step does to a drone that hovers beside it.
#[derive(Debug)]
pub(super) struct Hovering {
    /// Of the beginning of the step from where the drone hovers.
    pub(super) offset: [i32; 3],
    pub(super) span: DelaySpan,
}

/// A column of the floor beside a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    /// How far from the beginning of the step.
    pub(super) aside: [i32; 2],
    column: usize,
}

impl ConflictTable {
    /// Nothing is worked out yet.
    pub(super) fn new(shape: Shape) -> ConflictTable {
        let extent = shape.extent;
        let aside = -extent.reach..=extent.reach;
        let columns: Vec<[i32; 2]> = aside
            .clone()
            .flat_map(|dy| aside.clone().map(move |dx| [dx, dy]))
            .collect();
        let first_alike = |directions: usize| {
            let all = (0..TURNS).map(|turn| {
                let turned = |direction: usize| index(turned(cells(direction), turn));
                let both = [directions / DIRECTIONS, directions % DIRECTIONS];
                (both.map(turned), turn)
            });
            all.min().unwrap_or_default()
        };
        let all_alike = (0..DIRECTIONS * DIRECTIONS).map(first_alike);
        let mut kept: Vec<[usize; 2]> = all_alike.clone().map(|(kept, _)| kept).collect();
        kept.sort_unstable();
        kept.dedup();
        let alike = all_alike.map(|(directions, turn)| {
            let kept = kept.binary_search(&directions).unwrap_or_default();
            (turn as u8, kept as u16)
        });
        let becomes = |turn: usize| {
            let at = move |[dx, dy]: &[i32; 2]| {
                let [dx, dy, _] = turned([*dx, *dy, 0], turn);
                (dx + extent.reach + (2 * extent.reach + 1) * (dy + extent.reach)) as u16
            };
            columns.iter().map(at)
        };
        let lasts = |layers: i32| {
            let depth = f64::from(layers);
            let delays = [
                shape.delays.of_mover(-depth),
                shape.delays.of_reference(depth),
            ];
            delays.map(|ticks| ticks.ceil() as u32)
        };
        ConflictTable {
            alike: alike.collect(),
            turned: (0..TURNS).flat_map(becomes).collect(),
            lasts: (-extent.layers - CLIMBS..=extent.layers + CLIMBS)
                .map(lasts)
                .collect(),
            rows: vec![OnceLock::new(); kept.len() * columns.len()],
            kept,
            columns,
            hovering: Default::default(),
            near: Default::default(),
            near_still: Default::default(),
            shape,
        }
    }

    /// By the direction of the second's step, where it forbids the first to hover, or costs
    /// something.
    pub(super) fn hovering(&self, others: usize) -> &[Hovering] {
        self.hovering[others].get_or_init(|| {
            let layers = self.shape.extent.layers;
            let all_near: Vec<Near> = self.all_near().collect();
            let at_layer = |dz: i32| {
                all_near.iter().map(move |near| Hovering {
                    offset: [near.aside[0], near.aside[1], dz],
                    span: self.span([STILL, others], near, dz),
                })
            };
            let all = (-layers..=layers).flat_map(at_layer);
            all.filter(|it| !it.span.is_empty() || it.span.price > 0)
                .collect()
        })
    }

    /// By the direction of the first: columns in which a drone may matter.
    pub(super) fn near(&self, direction: usize) -> &[Near] {
        // As seen from above all that climb or sink are alike.
        let level = (0..DIRECTIONS).filter(|others| cells(*others)[2] == 0);
        self.near[direction].get_or_init(|| self.near_to(direction, level))
    }

    /// By the direction of the first: columns in which a hovering drone may matter.
    pub(super) fn near_still(&self, direction: usize) -> &[Near] {
        self.near_still[direction].get_or_init(|| self.near_to(direction, STILL..STILL + 1))
    }

    fn near_to(&self, direction: usize, others: impl Iterator<Item = usize> + Clone) -> Vec<Near> {
        let matters = |near: &Near| {
            let mut others = others.clone();
            others.any(|others| self.shape.may_matter([direction, others], near.aside))
        };
        self.all_near().filter(matters).collect()
    }

    fn all_near(&self) -> impl Iterator<Item = Near> {
        let columns = self.columns.iter().enumerate();
        columns.map(|(column, &aside)| Near { aside, column })
    }

    /// What a step does to another that begins so many layers above it in a column.
    #[inline]
    pub(super) fn span(
        &self,
        [direction, others]: [usize; 2],
        near: &Near,
        layers: i32,
    ) -> DelaySpan {
        let (turn, kept) = self.alike[direction * DIRECTIONS + others];
        let column = self.turned[usize::from(turn) * self.columns.len() + near.column];
        let (kept, column) = (usize::from(kept), usize::from(column));
        let row = &self.rows[kept * self.columns.len() + column];
        let row = row.get_or_init(|| {
            let [direction, others] = self.kept[kept];
            let spans = self.shape.spans(direction, others, self.columns[column]);
            match spans.iter().all(|span| *span == DelaySpan::default()) {
                true => Box::default(),
                false => spans.into(),
            }
        });
        let layer = (layers + self.shape.extent.layers) as usize;
        row.get(layer).copied().unwrap_or_default()
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
        let at =
            |rise: i32| self.lasts[(layers + rise + self.shape.extent.layers + CLIMBS) as usize];
        [at(ends[0])[0], at(ends[1])[1]]
    }

    /// The same for any steps and layers.
    pub(super) fn longest(&self) -> [u32; 2] {
        let ends = [self.lasts.first(), self.lasts.last()];
        let [first, last] = ends.map(|it| it.copied().unwrap_or_default());
        [first[0], last[1]]
    }
}
