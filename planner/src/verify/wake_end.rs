//! Where a wake ends: the floor, or the first top face that covers its whole half-width disc.
//!
//! Boxes and cylinders have such faces; unions of faces and meshes stop no wake.

use airflow::Wake;
use nalgebra::{Point3, Vector3};

use super::solid::{Shape, Solid};

/// Lowest and highest corner (m).
type Places = (Vector3<f64>, Vector3<f64>);

/// A level face seen from above.
#[derive(Clone, Copy, Debug)]
struct Top {
    z_m: f64,
    outline: Outline,
}

#[derive(Clone, Copy, Debug)]
enum Outline {
    Rectangle { min_m: [f64; 2], max_m: [f64; 2] },
    Disc { centre_m: [f64; 2], radius_m: f64 },
}

/// Every face that can stop a wake, and the floor.
#[derive(Clone, Debug)]
pub(crate) struct Stops {
    floor_z_m: f64,
    tops: Vec<Top>,
}

impl Stops {
    pub(crate) fn new(floor_z_m: f64, solids: &[Solid]) -> Stops {
        let tops = solids.iter().filter_map(|solid| match solid.shape {
            Shape::Box { min_m, max_m } => Some(Top {
                z_m: max_m.z,
                outline: Outline::Rectangle {
                    min_m: [min_m.x, min_m.y],
                    max_m: [max_m.x, max_m.y],
                },
            }),
            Shape::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => Some(Top {
                z_m: base_m.z + height_m,
                outline: Outline::Disc {
                    centre_m: [base_m.x, base_m.y],
                    radius_m,
                },
            }),
            Shape::Mesh { .. } => None,
        });
        Stops {
            floor_z_m,
            tops: tops.filter(|top| top.z_m > floor_z_m).collect(),
        }
    }

    /// The faces that may stop this wake from somewhere in a box of places (m).
    pub(crate) fn candidates(
        &self,
        wake: &Wake,
        places_m: &(Vector3<f64>, Vector3<f64>),
    ) -> Vec<u32> {
        let may = |top: &Top| places_m.1.z > top.z_m && may_stop(wake, places_m, top);
        (0u32..)
            .zip(&self.tops)
            .filter(|(_, top)| may(top))
            .map(|(k, _)| k)
            .collect()
    }

    /// Height below which a wake is not felt (m).
    pub(crate) fn end_z_m(&self, wake: &Wake, place_m: &Point3<f64>, candidates: &[u32]) -> f64 {
        let here = (place_m.coords, place_m.coords);
        self.end_range_m(wake, &here, candidates).0
    }

    /// Lowest and highest end of the wake over a box of places (m).
    pub(crate) fn end_range_m(
        &self,
        wake: &Wake,
        places_m: &(Vector3<f64>, Vector3<f64>),
        candidates: &[u32],
    ) -> (f64, f64) {
        let mut ends_m = (self.floor_z_m, self.floor_z_m);
        for &k in candidates {
            let top = &self.tops[k as usize];
            if places_m.1.z > top.z_m && may_stop(wake, places_m, top) {
                ends_m.1 = ends_m.1.max(top.z_m);
            }
            if places_m.0.z > top.z_m && must_stop(wake, places_m, top) {
                ends_m.0 = ends_m.0.max(top.z_m);
            }
        }
        ends_m
    }
}

/// Whether a wake from some place of a box ends on a face.
fn may_stop(wake: &Wake, places_m: &Places, top: &Top) -> bool {
    if !wake.is_shaped() {
        return top.may_cover(places_m, narrowest_m(wake, places_m, top.z_m));
    }
    moved(wake, places_m, top.z_m)
        .is_some_and(|(moved_m, spreads_m)| top.may_cover(&moved_m, spreads_m.0))
}

/// Whether a wake from every place of a box ends on a face.
fn must_stop(wake: &Wake, places_m: &Places, top: &Top) -> bool {
    if !wake.is_shaped() {
        return top.must_cover(places_m, wake.half_width_m(places_m.1.z - top.z_m));
    }
    moved(wake, places_m, top.z_m)
        .is_some_and(|(moved_m, spreads_m)| top.must_cover(&moved_m, spreads_m.1))
}

/// Steps of height at which a moved wake is looked at; chosen here.
const MOVED_STEPS: u32 = 8;

/// Where the axes of moved wakes from a box of places meet a height, and how far they spread there at least and at most (m); `None`
/// where the wind has taken one of them away before: such a wake ends nowhere.
fn moved(wake: &Wake, places_m: &Places, z_m: f64) -> Option<(Places, (f64, f64))> {
    let (from_m, to_m) = ((places_m.0.z - z_m).max(0.0), places_m.1.z - z_m);
    let steps = if from_m == to_m { 0 } else { MOVED_STEPS };
    let (mut low_m, mut high_m) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut spreads_m = (f64::INFINITY, 0.0_f64);
    let mut apart_m = 0.0_f64;
    let mut before: Option<([f64; 2], f64)> = None;
    for k in 0..=steps {
        let depth_m = from_m + f64::from(k) / f64::from(steps.max(1)) * (to_m - from_m);
        let (axis_m, spread_m) = (wake.axis_m(depth_m)?, wake.spread_m(depth_m)?);
        for axis in 0..2 {
            low_m[axis] = low_m[axis].min(axis_m[axis]);
            high_m[axis] = high_m[axis].max(axis_m[axis]);
        }
        spreads_m = (spreads_m.0.min(spread_m), spreads_m.1.max(spread_m));
        if let Some((known_m, known)) = before {
            let gap_m = (axis_m[0] - known_m[0]).hypot(axis_m[1] - known_m[1]);
            apart_m = apart_m.max(gap_m + (spread_m - known).abs());
        }
        before = Some((axis_m, spread_m));
    }
    // Between two heights looked at it is nowhere farther from one of them than they are apart.
    let places = |corner: &Vector3<f64>, aside_m: [f64; 2], more_m: f64| {
        Vector3::new(
            corner.x + aside_m[0] + more_m,
            corner.y + aside_m[1] + more_m,
            corner.z,
        )
    };
    Some((
        (
            places(&places_m.0, low_m, -apart_m),
            places(&places_m.1, high_m, apart_m),
        ),
        ((spreads_m.0 - apart_m).max(0.0), spreads_m.1 + apart_m),
    ))
}

/// Half-width at the face from the lowest place above it (m).
fn narrowest_m(wake: &Wake, places_m: &(Vector3<f64>, Vector3<f64>), top_z_m: f64) -> f64 {
    wake.half_width_m((places_m.0.z - top_z_m).max(0.0))
}

impl Top {
    /// Whether a disc of this radius lies on the face from at least one place of the box.
    fn may_cover(&self, places_m: &(Vector3<f64>, Vector3<f64>), disc_m: f64) -> bool {
        match self.outline {
            Outline::Rectangle { min_m, max_m } => (0..2).all(|axis| {
                min_m[axis] + disc_m <= max_m[axis] - disc_m
                    && places_m.1[axis] - disc_m >= min_m[axis]
                    && places_m.0[axis] + disc_m <= max_m[axis]
            }),
            Outline::Disc { centre_m, radius_m } => {
                let off = |axis: usize| {
                    (places_m.0[axis] - centre_m[axis])
                        .max(centre_m[axis] - places_m.1[axis])
                        .max(0.0)
                };
                off(0).hypot(off(1)) + disc_m <= radius_m
            }
        }
    }

    /// Whether it does from every place of the box.
    fn must_cover(&self, places_m: &(Vector3<f64>, Vector3<f64>), disc_m: f64) -> bool {
        match self.outline {
            Outline::Rectangle { min_m, max_m } => (0..2).all(|axis| {
                places_m.0[axis] - disc_m >= min_m[axis] && places_m.1[axis] + disc_m <= max_m[axis]
            }),
            Outline::Disc { centre_m, radius_m } => {
                let off = |axis: usize| {
                    (places_m.1[axis] - centre_m[axis]).max(centre_m[axis] - places_m.0[axis])
                };
                off(0).hypot(off(1)) + disc_m <= radius_m
            }
        }
    }
}
