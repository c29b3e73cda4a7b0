//! Where a wake ends: the floor, or the first top face that covers its whole half-width disc.
//!
//! Boxes and cylinders have such faces; unions of faces and meshes stop no wake.

use airflow::Wake;
use nalgebra::{Point3, Vector3};

use super::solid::{Shape, Solid};

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
        let may = |top: &Top| {
            places_m.1.z > top.z_m && top.may_cover(places_m, narrowest_m(wake, places_m, top.z_m))
        };
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
            if places_m.1.z > top.z_m
                && top.may_cover(places_m, narrowest_m(wake, places_m, top.z_m))
            {
                ends_m.1 = ends_m.1.max(top.z_m);
            }
            if places_m.0.z > top.z_m
                && top.must_cover(places_m, wake.half_width_m(places_m.1.z - top.z_m))
            {
                ends_m.0 = ends_m.0.max(top.z_m);
            }
        }
        ends_m
    }
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
