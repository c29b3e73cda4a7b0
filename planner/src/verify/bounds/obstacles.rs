//! The obstacles of a plan: how far a place is from them, what lies below it, and where a wake
//! ends.
//!
//! A wake ends at the floor, or at the first top face of a box or a cylinder that covers its whole
//! half-width disc; unions of faces and meshes stop no wake. Of a box of places of the drone it is
//! asked whether the wake may end on a face from one of them, and whether it does from all: between
//! the two the end is not known, and both are taken into account.

use airflow::Wake;
use nalgebra::{Point3, Vector3};
use parry3d::query::{PointQuery, Ray, RayCast};
use parry3d::shape::{TriMesh, TriMeshFlags};

use crate::plan;
use crate::verify::extents::{Places, is_box};

/// Heights at which a moved wake is looked at between two, chosen here: what lies between them is
/// added to what is found.
const MOVED_STEPS: u32 = 8;

/// All obstacles above a floor.
#[derive(Debug)]
pub(crate) struct Obstacles {
    /// Height of the floor (m).
    pub(crate) floor_z_m: f64,
    /// In the plan's order.
    pub(crate) solids: Vec<NamedSolid>,
}

/// A named solid in the world.
#[derive(Debug)]
pub struct NamedSolid {
    /// The plan's name for it.
    pub name: String,
    shape: SolidForm,
    /// Its bounding box.
    box_m: Places,
}

#[derive(Debug)]
enum SolidForm {
    /// Its bounding box.
    Box,
    Cylinder {
        base_m: Point3<f64>,
        radius_m: f64,
        height_m: f64,
    },
    /// `insides`: of it, the connected parts that enclose a volume, their triangles facing outward.
    Mesh {
        surface: Box<TriMesh>,
        insides: Vec<TriMesh>,
    },
}

impl Obstacles {
    /// Height of the highest surface straight below a place, at least the floor's (m).
    pub(crate) fn support_z_m(&self, place_m: &Point3<f64>) -> f64 {
        let supports_m = self.solids.iter().filter_map(|it| it.support_z_m(place_m));
        supports_m.fold(self.floor_z_m, f64::max)
    }

    /// Indices of the solids on whose top a wake may end whose drone is somewhere in a box.
    pub(crate) fn that_may_stop(&self, wake: &Wake, places_m: &Places) -> Vec<u32> {
        let may = |solid: &NamedSolid| {
            let top_z_m = solid.top_z_m().filter(|top_z_m| *top_z_m > self.floor_z_m);
            top_z_m.is_some_and(|top_z_m| solid.stops(wake, places_m, top_z_m).0)
        };
        let solids = (0..).zip(&self.solids);
        solids.filter(|(_, it)| may(it)).map(|(k, _)| k).collect()
    }

    /// Lowest and highest end of a wake whose drone is somewhere in a box (m).
    ///
    /// `stops` are the solids of [`Obstacles::that_may_stop`].
    pub(crate) fn end_range_m(&self, wake: &Wake, places_m: &Places, stops: &[u32]) -> (f64, f64) {
        let mut ends_m = (self.floor_z_m, self.floor_z_m);
        for &k in stops {
            let solid = &self.solids[k as usize];
            let Some(top_z_m) = solid.top_z_m() else {
                continue;
            };
            let (may, surely) = solid.stops(wake, places_m, top_z_m);
            if may {
                ends_m.1 = ends_m.1.max(top_z_m);
            }
            if surely {
                ends_m.0 = ends_m.0.max(top_z_m);
            }
        }
        ends_m
    }

    /// Height below which the wake of a drone at a place has ended (m).
    pub(crate) fn end_z_m(&self, wake: &Wake, place_m: &Point3<f64>, stops: &[u32]) -> f64 {
        let here_m = (place_m.coords, place_m.coords);
        self.end_range_m(wake, &here_m, stops).0
    }
}

impl NamedSolid {
    /// A solid.
    ///
    /// # Errors
    ///
    /// In words, why its numbers make none: not finite, corners in disorder, a negative size, or
    /// triangles between vertices that are not there.
    pub fn new(entry: &plan::Obstacle) -> Result<NamedSolid, String> {
        let no = |what: &str| format!("obstacle `{}` is no {what}", entry.name);
        let (shape, box_m) = match &entry.shape {
            plan::Solid::Box { min_m, max_m } => {
                if !is_box(min_m, max_m) {
                    return Err(no("box"));
                }
                (SolidForm::Box, (min_m.coords, max_m.coords))
            }
            &plan::Solid::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => {
                let numbers = [base_m.x, base_m.y, base_m.z, radius_m, height_m];
                if !numbers.iter().all(|x| x.is_finite()) || radius_m < 0.0 || height_m < 0.0 {
                    return Err(no("cylinder"));
                }
                let low_m = base_m.coords - Vector3::new(radius_m, radius_m, 0.0);
                let high_m = base_m.coords + Vector3::new(radius_m, radius_m, height_m);
                let shape = SolidForm::Cylinder {
                    base_m,
                    radius_m,
                    height_m,
                };
                (shape, (low_m, high_m))
            }
            plan::Solid::Mesh {
                vertices_m,
                triangles,
                ..
            } => {
                let shape = mesh(vertices_m, triangles).ok_or_else(|| no("mesh"))?;
                let farthest = Vector3::repeat(f64::INFINITY);
                let around = |(low, high): Places, v: &Point3<f64>| {
                    (low.inf(&v.coords), high.sup(&v.coords))
                };
                let box_m = vertices_m.iter().fold((farthest, -farthest), around);
                (shape, box_m)
            }
        };
        Ok(NamedSolid {
            name: entry.name.clone(),
            shape,
            box_m,
        })
    }

    /// A zone as a solid.
    pub fn of_zone(zone: &plan::Zone) -> NamedSolid {
        NamedSolid {
            name: zone.name.clone(),
            shape: SolidForm::Box,
            box_m: (zone.min_m.coords, zone.max_m.coords),
        }
    }

    /// Lowest and highest corner of its bounding box (m).
    pub fn corners_m(&self) -> [Point3<f64>; 2] {
        [self.box_m.0.into(), self.box_m.1.into()]
    }

    /// Distance from a place to the solid (m); 0 inside. It changes no faster than the place moves.
    pub fn distance_m(&self, place_m: &Vector3<f64>) -> f64 {
        match &self.shape {
            SolidForm::Box => self.box_distance_m(&(*place_m, *place_m)),
            SolidForm::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => {
                let outside = ((place_m.xy() - base_m.coords.xy()).norm() - radius_m).max(0.0);
                let above = (base_m.z - place_m.z).max(place_m.z - base_m.z - height_m);
                outside.hypot(above.max(0.0))
            }
            SolidForm::Mesh { surface, insides } => {
                let point = [place_m.x, place_m.y, place_m.z].into();
                let is_inside = |it: &TriMesh| {
                    it.local_aabb().contains_local_point(point) && it.contains_local_point(point)
                };
                match insides.iter().any(is_inside) {
                    true => 0.0,
                    false => surface.distance_to_local_point(point, true),
                }
            }
        }
    }

    /// Distance between its bounding box and another box (m): never more than to the solid itself.
    pub(crate) fn box_distance_m(&self, places_m: &Places) -> f64 {
        let beside = (self.box_m.0 - places_m.1).sup(&(places_m.0 - self.box_m.1));
        beside.sup(&Vector3::zeros()).norm()
    }

    /// Height of its highest point straight below a place (m); `None`: nothing of it is below.
    fn support_z_m(&self, place_m: &Point3<f64>) -> Option<f64> {
        let beside = (0..2).any(|k| place_m[k] < self.box_m.0[k] || place_m[k] > self.box_m.1[k]);
        if beside || place_m.z < self.box_m.0.z {
            return None;
        }
        let top_z_m = self.box_m.1.z.min(place_m.z);
        match &self.shape {
            SolidForm::Box => Some(top_z_m),
            SolidForm::Cylinder {
                base_m, radius_m, ..
            } => ((place_m - base_m).xy().norm() <= *radius_m).then_some(top_z_m),
            SolidForm::Mesh { surface, .. } => {
                let from = [place_m.x, place_m.y, place_m.z].into();
                let down = Ray::new(from, [0.0, 0.0, -1.0].into());
                surface
                    .cast_local_ray(&down, place_m.z - self.box_m.0.z + 1.0, true)
                    .map(|fall_m| place_m.z - fall_m)
            }
        }
    }

    /// Whether a place (m) is over it: its top, or any of its faces, lies straight below.
    pub fn is_below(&self, place_m: &Point3<f64>) -> bool {
        let is_above = match &self.shape {
            SolidForm::Mesh { .. } => true,
            _ => place_m.z >= self.box_m.1.z,
        };
        is_above && self.support_z_m(place_m).is_some()
    }

    /// Height of the level face that may stop a wake (m).
    fn top_z_m(&self) -> Option<f64> {
        (!matches!(self.shape, SolidForm::Mesh { .. })).then_some(self.box_m.1.z)
    }

    /// Whether a wake from some place of a box ends on the top face, and whether it does from every
    /// one.
    fn stops(&self, wake: &Wake, places_m: &Places, top_z_m: f64) -> (bool, bool) {
        let (lowest_m, highest_m) = (places_m.0.z - top_z_m, places_m.1.z - top_z_m);
        if highest_m <= 0.0 {
            return (false, false);
        }
        let at_top = if wake.is_shaped() {
            moved(wake, places_m, top_z_m)
        } else {
            let least_m = wake.half_width_m(lowest_m.max(0.0));
            Some((*places_m, (least_m, wake.half_width_m(highest_m))))
        };
        let Some((axes_m, discs_m)) = at_top else {
            return (false, false);
        };
        let (may, surely) = self.covers(&axes_m, discs_m);
        (may, lowest_m > 0.0 && surely)
    }

    /// Whether a level disc lies within the outline: one of the first radius from at least one
    /// place of a box, and one of the second from every place of it (m).
    fn covers(&self, (low_m, high_m): &Places, (least_m, most_m): (f64, f64)) -> (bool, bool) {
        if let SolidForm::Cylinder {
            base_m, radius_m, ..
        } = &self.shape
        {
            let near = |k: usize| (low_m[k] - base_m[k]).max(base_m[k] - high_m[k]).max(0.0);
            let far = |k: usize| (high_m[k] - base_m[k]).max(base_m[k] - low_m[k]);
            let from_one = near(0).hypot(near(1)) + least_m <= *radius_m;
            return (from_one, far(0).hypot(far(1)) + most_m <= *radius_m);
        }
        let (min_m, max_m) = &self.box_m;
        let from_one = |k: usize| {
            min_m[k] + least_m <= max_m[k] - least_m
                && high_m[k] - least_m >= min_m[k]
                && low_m[k] + least_m <= max_m[k]
        };
        let from_all = |k| low_m[k] - most_m >= min_m[k] && high_m[k] + most_m <= max_m[k];
        ((0..2).all(from_one), (0..2).all(from_all))
    }
}

/// Where the axes of moved wakes from a box of places meet a height, and how far they spread there
/// at least and at most (m); `None` where the wind has taken one of them away before: such a wake
/// ends nowhere.
fn moved(wake: &Wake, places_m: &Places, z_m: f64) -> Option<(Places, (f64, f64))> {
    let (from_m, to_m) = ((places_m.0.z - z_m).max(0.0), places_m.1.z - z_m);
    let steps = if from_m == to_m { 0 } else { MOVED_STEPS };
    let farthest = Vector3::repeat(f64::INFINITY);
    let (mut low_m, mut high_m) = (farthest, -farthest);
    let mut apart_m = 0.0_f64;
    let mut before: Option<Vector3<f64>> = None;
    for k in 0..=steps {
        let depth_m = from_m + f64::from(k) / f64::from(steps.max(1)) * (to_m - from_m);
        let [x, y] = wake.axis_m(depth_m)?;
        // Where the axis is, and in place of a height how far the wake spreads.
        let here_m = Vector3::new(x, y, wake.spread_m(depth_m)?);
        (low_m, high_m) = (low_m.inf(&here_m), high_m.sup(&here_m));
        if let Some(known_m) = before {
            let change_m = here_m - known_m;
            apart_m = apart_m.max(change_m.x.hypot(change_m.y) + change_m.z.abs());
        }
        before = Some(here_m);
    }
    // Between two heights looked at it is nowhere farther from one of them than they are apart.
    let places = |corner: &Vector3<f64>, aside_m: Vector3<f64>, more_m: f64| {
        corner + Vector3::new(aside_m.x + more_m, aside_m.y + more_m, 0.0)
    };
    Some((
        (
            places(&places_m.0, low_m, -apart_m),
            places(&places_m.1, high_m, apart_m),
        ),
        ((low_m.z - apart_m).max(0.0), high_m.z + apart_m),
    ))
}

/// A mesh; of its connected parts that close a volume also the inside counts. `None` where the
/// numbers make none.
fn mesh(vertices_m: &[Point3<f64>], triangles: &[[u32; 3]]) -> Option<SolidForm> {
    let mut corners = triangles.iter().flatten();
    let known = corners.all(|&k| (k as usize) < vertices_m.len());
    if !known || !vertices_m.iter().all(|v| v.iter().all(|x| x.is_finite())) {
        return None;
    }
    let vertices = vertices_m.iter().map(|v| [v.x, v.y, v.z].into()).collect();
    let surface = Box::new(TriMesh::new(vertices, triangles.to_vec()).ok()?);
    let parts = closed_parts(vertices_m, triangles);
    let insides = parts.iter().map(|part| outward(part));
    let insides = insides.collect::<Option<_>>()?;
    Some(SolidForm::Mesh { surface, insides })
}

/// Corners of a triangle (m).
type Triangle = [Vector3<f64>; 3];

/// The parts of a surface, joined along edges, of which every edge is used once in each direction:
/// of one with a rim or without a consistent side only the triangles themselves count.
fn closed_parts(vertices_m: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<Vec<Triangle>> {
    // Equal places are one corner; so are both zeros.
    let corner = |&k: &u32| vertices_m[k as usize].coords.map(|x| x + 0.0);
    let bits = |v: &Vector3<f64>| <[u64; 3]>::from(v.map(f64::to_bits));
    let triangles = triangles.iter().map(|it| [0, 1, 2].map(|k| corner(&it[k])));
    let has_sides = |[a, b, c]: &Triangle| a != b && b != c && c != a;
    let triangles: Vec<Triangle> = triangles.filter(has_sides).collect();
    // Each edge from its lower to its higher place, whether it is walked so, and its triangle.
    let edges = triangles.iter().enumerate().flat_map(|(by, [a, b, c])| {
        [(a, b), (b, c), (c, a)].map(|(from, to)| {
            let (from, to) = (bits(from), bits(to));
            (from.min(to), from.max(to), from < to, by)
        })
    });
    let mut edges: Vec<_> = edges.collect();
    edges.sort_unstable();
    let mut beside: Vec<Vec<usize>> = vec![Vec::new(); triangles.len()];
    let mut is_at_rim = vec![false; triangles.len()];
    for edge in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let first = edge[0].3;
        is_at_rim[first] |= edge.len() != 2 || edge[0].2 == edge[1].2;
        for &(.., other) in &edge[1..] {
            beside[first].push(other);
            beside[other].push(first);
        }
    }
    let mut is_seen = vec![false; triangles.len()];
    let mut parts = Vec::new();
    for first in 0..triangles.len() {
        let (mut part, mut is_closed) = (Vec::new(), true);
        let mut open = vec![first];
        while let Some(k) = open.pop() {
            if !std::mem::replace(&mut is_seen[k], true) {
                part.push(triangles[k]);
                is_closed &= !is_at_rim[k];
                open.extend(&beside[k]);
            }
        }
        if is_closed && !part.is_empty() {
            parts.push(part);
        }
    }
    parts
}

/// A closed part with its triangles facing outward.
fn outward(part: &[Triangle]) -> Option<TriMesh> {
    let origin_m = part.first()?[0];
    let volumes6_m3 = part.iter().map(|corners| {
        let [a, b, c] = corners.map(|it| it - origin_m);
        a.dot(&b.cross(&c))
    });
    let is_inward = volumes6_m3.sum::<f64>() < 0.0;
    let turn = |[a, b, c]: [u32; 3]| if is_inward { [a, c, b] } else { [a, b, c] };
    let corners = part.iter().flatten();
    let corners = corners.map(|v| [v.x, v.y, v.z].into()).collect();
    let triangles = (0..part.len() as u32).map(|k| turn([3 * k, 3 * k + 1, 3 * k + 2]));
    let flags = TriMeshFlags::ORIENTED | TriMeshFlags::MERGE_DUPLICATE_VERTICES;
    TriMesh::with_flags(corners, triangles.collect(), flags).ok()
}
