//! Obstacles as geometry: how far a point or a straight leg is from them, and what lies below.
//!
//! World frame, metres, z up. Distances are signed: negative inside a solid, where the value is the
//! path to the nearest face. Boxes and cylinders are closed forms, because GJK answers 0 for every
//! overlap and the depth is wanted here; meshes and the broad phase are parry's.

use std::collections::BTreeMap;

use costmap::GoldenSection;
use costmap::wake::surfaces::Top;
use nalgebra::Point3;
use parry3d::bounding_volume::Aabb;
use parry3d::math::{Pose, Vector};
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhNode};
use parry3d::query::{PointQuery, Ray, RayCast};
use parry3d::shape::{Cuboid, Segment, TriMesh, TriMeshFlags};
use petgraph::unionfind::UnionFind;

use crate::scenario::world::{Obstacle, Solid, World};

/// Two surfaces nearer than this count as touching (m): far above the rounding of coordinates up to
/// 10 km (2e-12 m), far below anything a drone can fly.
pub(crate) const TOUCHING_M: f64 = 1e-9;

/// The level face of an obstacle that may stop a wake, in the world; `None`: a mesh stops none.
pub(crate) fn top(obstacle: &Obstacle) -> Option<Top> {
    match &obstacle.shape {
        Solid::Box { min_m, max_m } => Some(Top::Rectangle {
            min_m: [min_m.x, min_m.y],
            max_m: [max_m.x, max_m.y],
            z_m: max_m.z,
        }),
        Solid::Cylinder {
            base_m,
            radius_m,
            height_m,
        } => Some(Top::Disc {
            centre_m: [base_m.x, base_m.y],
            radius_m: *radius_m,
            z_m: base_m.z + height_m,
        }),
        Solid::Mesh { .. } => None,
    }
}

/// Obstacles, ready to be asked for distances. Indices are those of the slice it was made from.
#[derive(Debug)]
pub(crate) struct Solids {
    /// By box; its leaves are `parts`.
    tree: Bvh,
    /// Convex solids, and connected parts of meshes.
    parts: Vec<Leaf>,
    /// Those of higher index bear nothing: zones that keep bodies out.
    obstacle_count: usize,
}

/// What the tree tells apart.
#[derive(Debug)]
struct Leaf {
    /// Index in the slice that the solids were made from.
    obstacle: usize,
    /// Its geometry (m).
    form: Form,
}

/// A closed form, or parry's mesh; all lengths in metres.
#[derive(Debug)]
enum Form {
    Box {
        low: Vector,
        high: Vector,
    },
    Cylinder {
        base: Vector,
        radius_m: f64,
        height_m: f64,
    },
    Mesh {
        mesh: Box<TriMesh>,
        closed: bool,
    },
}

impl Solids {
    /// Sorts the obstacles into a tree. A mesh is cut into its connected parts: a closed part has
    /// an inside, an open one is a sheet without thickness.
    pub(crate) fn new(obstacles: &[Obstacle]) -> Solids {
        let mut parts = Vec::new();
        for (obstacle, Obstacle { shape, .. }) in obstacles.iter().enumerate() {
            let forms = match shape {
                Solid::Box { min_m, max_m } => vec![Form::Box {
                    low: vector(min_m),
                    high: vector(max_m),
                }],
                Solid::Cylinder {
                    base_m,
                    radius_m,
                    height_m,
                } => vec![Form::Cylinder {
                    base: vector(base_m),
                    radius_m: *radius_m,
                    height_m: *height_m,
                }],
                Solid::Mesh {
                    vertices_m,
                    triangles,
                    ..
                } => mesh_parts(vertices_m, triangles),
            };
            parts.extend(forms.into_iter().map(|form| Leaf { obstacle, form }));
        }
        let boxes: Vec<Aabb> = parts.iter().map(|part| part.form.aabb()).collect();
        Solids {
            tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            parts,
            obstacle_count: obstacles.len(),
        }
    }

    /// All that bodies keep out of in a world: its obstacles, and after them its zones that keep
    /// bodies out, on which no drone stands.
    pub(crate) fn of(world: &World) -> Solids {
        let zones = world.zones.iter().filter(|zone| zone.keep_out);
        let zones = zones.map(|zone| Obstacle {
            name: zone.name.clone(),
            shape: Solid::Box {
                min_m: zone.min_m,
                max_m: zone.max_m,
            },
        });
        let all: Vec<Obstacle> = world.obstacles.iter().cloned().chain(zones).collect();
        Solids {
            obstacle_count: world.obstacles.len(),
            ..Solids::new(&all)
        }
    }

    /// The boxes around them, those of meshes in connected parts (m).
    pub(crate) fn boxes(&self) -> Vec<Aabb> {
        self.parts.iter().map(|part| part.form.aabb()).collect()
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Signed distance from `point_m` to the nearest obstacle, and which one it is; infinite and
    /// `None` where there are no obstacles.
    pub(crate) fn distance_to_point_m(&self, point_m: Point3<f64>) -> (f64, Option<usize>) {
        self.nearest(point_m, point_m)
    }

    /// Smallest signed distance from the straight leg `a_m`..`b_m` to any obstacle, or `at_most_m`
    /// where all of them are farther than that. Of a leg that pierces a mesh and ends outside, 0.
    pub(crate) fn segment_clearance_m(
        &self,
        a_m: Point3<f64>,
        b_m: Point3<f64>,
        at_most_m: f64,
    ) -> f64 {
        self.nearest_within(a_m, b_m, at_most_m).0
    }

    /// Smallest signed distance from the straight leg `a_m`..`b_m` to any obstacle, and which one.
    pub(crate) fn nearest(&self, a_m: Point3<f64>, b_m: Point3<f64>) -> (f64, Option<usize>) {
        match self.nearest_within(a_m, b_m, f64::MAX) {
            (_, None) => (f64::INFINITY, None),
            found => found,
        }
    }

    /// Distance of an upright box (m) from all obstacles, at most `at_most_m`; 0: it meets one.
    pub(crate) fn box_clearance_m(&self, [low_m, high_m]: [Point3<f64>; 2], at_most_m: f64) -> f64 {
        let (low, high) = (vector(&low_m), vector(&high_m));
        let gap = |mins: Vector, maxs: Vector| {
            let apart = (mins - high).max(low - maxs).max(Vector::ZERO);
            apart.length()
        };
        let best = self.tree.find_best(
            at_most_m,
            |node, _| gap(node.mins(), node.maxs()),
            |part, _| Some(self.parts[part as usize].form.distance_to_box_m(low, high)),
        );
        best.map_or(at_most_m, |(_, distance_m)| distance_m)
    }

    /// Whether every place of an upright box (m) is nearer than `within_m` to the solid that its
    /// middle is nearest to, if that is convex: the distance to it is greatest at a corner.
    pub(crate) fn cover_box(&self, [low_m, high_m]: [Point3<f64>; 2], within_m: f64) -> bool {
        let (low, high) = (vector(&low_m), vector(&high_m));
        let middle = (low + high) * 0.5;
        let nearest = self.tree.find_best(
            within_m,
            |node, _| bound_m(node, middle, middle),
            |part, _| Some(self.parts[part as usize].form.distance_to_point_m(middle)),
        );
        let corner = |k: u32| {
            let of = |axis: u32, low: f64, high: f64| if k >> axis & 1 == 0 { low } else { high };
            Vector::new(
                of(0, low.x, high.x),
                of(1, low.y, high.y),
                of(2, low.z, high.z),
            )
        };
        nearest.is_some_and(|(part, _)| match &self.parts[part as usize].form {
            Form::Mesh { .. } => false,
            form => (0..8).all(|k| form.distance_to_point_m(corner(k)) < within_m),
        })
    }

    /// The highest surface straight below `point_m` (z, m) and its obstacle: `floor_z_m` and `None`
    /// where there is no obstacle between.
    pub(crate) fn support_below_z_m(
        &self,
        point_m: Point3<f64>,
        floor_z_m: f64,
    ) -> (f64, Option<usize>) {
        let from = vector(&point_m) + Vector::new(0.0, 0.0, TOUCHING_M);
        let deepest = Vector::new(from.x, from.y, floor_z_m.min(from.z));
        let below = Aabb::new(deepest, from);
        let mut best = (floor_z_m, None);
        let mut hits: Vec<u32> = self.tree.intersect_aabb(&below).collect();
        hits.sort_unstable();
        for hit in hits {
            let part = &self.parts[hit as usize];
            if part.obstacle >= self.obstacle_count {
                continue;
            }
            if let Some(top_z_m) = part.form.top_below_z_m(from)
                && top_z_m > best.0
            {
                best = (top_z_m, Some(part.obstacle));
            }
        }
        best
    }

    /// [`Solids::nearest`] of all but one obstacle: what a drone stands on, or comes down to.
    pub(crate) fn nearest_beside(
        &self,
        a_m: Point3<f64>,
        b_m: Point3<f64>,
        except: Option<usize>,
    ) -> (f64, Option<usize>) {
        match self.nearest_of(a_m, b_m, f64::MAX, |obstacle| Some(obstacle) != except) {
            (_, None) => (f64::INFINITY, None),
            found => found,
        }
    }

    /// The nearest obstacle to a leg (m), if one is nearer than `at_most_m`.
    fn nearest_within(
        &self,
        a_m: Point3<f64>,
        b_m: Point3<f64>,
        at_most_m: f64,
    ) -> (f64, Option<usize>) {
        self.nearest_of(a_m, b_m, at_most_m, |_| true)
    }

    /// The same of those that count.
    fn nearest_of(
        &self,
        a_m: Point3<f64>,
        b_m: Point3<f64>,
        at_most_m: f64,
        counts: impl Fn(usize) -> bool,
    ) -> (f64, Option<usize>) {
        let (a, b) = (vector(&a_m), vector(&b_m));
        let best = self.tree.find_best(
            at_most_m,
            |node, _| bound_m(node, a, b),
            |part, _| {
                let part = &self.parts[part as usize];
                counts(part.obstacle).then(|| part.form.distance_to_segment_m(a, b))
            },
        );
        match best {
            Some((part, distance_m)) => (distance_m, Some(self.parts[part as usize].obstacle)),
            None => (at_most_m, None),
        }
    }
}

/// Nothing in `node` is nearer to the segment than this (m).
fn bound_m(node: &BvhNode, a: Vector, b: Vector) -> f64 {
    let gap = (node.mins() - a.max(b))
        .max(a.min(b) - node.maxs())
        .max(Vector::ZERO);
    // Where the boxes overlap the segment may be inside a solid, at any depth.
    match gap == Vector::ZERO {
        true => f64::MIN,
        false => gap.length(),
    }
}

impl Form {
    /// Its axis-aligned box.
    fn aabb(&self) -> Aabb {
        match self {
            Form::Box { low, high } => Aabb::new(*low, *high),
            Form::Cylinder {
                base,
                radius_m,
                height_m,
            } => {
                let reach = Vector::new(*radius_m, *radius_m, 0.0);
                Aabb::new(
                    *base - reach,
                    *base + reach + Vector::new(0.0, 0.0, *height_m),
                )
            }
            Form::Mesh { mesh, .. } => mesh.local_aabb(),
        }
    }

    /// Signed distance of a point (m); not negative for an open sheet.
    fn distance_to_point_m(&self, point: Vector) -> f64 {
        match self {
            Form::Box { low, high } => {
                let out = (*low - point).max(point - *high);
                out.max(Vector::ZERO).length() + out.max_element().min(0.0)
            }
            Form::Cylinder {
                base,
                radius_m,
                height_m,
            } => {
                let from_axis = point - *base;
                let side = from_axis.x.hypot(from_axis.y) - radius_m;
                let cap = (-from_axis.z).max(from_axis.z - height_m);
                side.max(0.0).hypot(cap.max(0.0)) + side.max(cap).min(0.0)
            }
            Form::Mesh { mesh, closed } => {
                let surface = mesh.project_local_point(point, false);
                let distance_m = surface.point.distance(point);
                match *closed && surface.is_inside {
                    true => -distance_m,
                    false => distance_m,
                }
            }
        }
    }

    /// Smallest signed distance on a segment (m).
    fn distance_to_segment_m(&self, a: Vector, b: Vector) -> f64 {
        if a == b {
            return self.distance_to_point_m(a);
        }
        let Form::Mesh { mesh, closed } = self else {
            return smallest_on_segment_m(a, b, |point| self.distance_to_point_m(point));
        };
        let ends_m = self.distance_to_point_m(a).min(self.distance_to_point_m(b));
        if *closed && ends_m <= 0.0 {
            return ends_m;
        }
        let leg = Segment::new(a, b);
        parry3d::query::distance(&Pose::IDENTITY, mesh.as_ref(), &Pose::IDENTITY, &leg)
            .map_or(0.0, |found| found.distance.min(ends_m))
    }

    /// Distance of an upright box (m); 0 where they meet.
    fn distance_to_box_m(&self, low: Vector, high: Vector) -> f64 {
        match self {
            Form::Box {
                low: own_low,
                high: own_high,
            } => (*own_low - high)
                .max(low - *own_high)
                .max(Vector::ZERO)
                .length(),
            Form::Cylinder {
                base,
                radius_m,
                height_m,
            } => {
                let aside = (low - *base).max(*base - high).max(Vector::ZERO);
                let beside_m = (aside.x.hypot(aside.y) - radius_m).max(0.0);
                let above_m = (base.z - high.z).max(low.z - base.z - height_m).max(0.0);
                beside_m.hypot(above_m)
            }
            Form::Mesh { mesh, .. } => {
                let middle = (low + high) * 0.5;
                if self.distance_to_point_m(middle) <= 0.0 {
                    return 0.0;
                }
                let solid = Cuboid::new((high - low) * 0.5);
                let at = Pose::from_translation(middle);
                parry3d::query::distance(&Pose::IDENTITY, mesh.as_ref(), &at, &solid)
                    .map_or(0.0, |found| found.distance)
            }
        }
    }

    /// The highest point of this solid on the vertical line below `from`, not above it.
    fn top_below_z_m(&self, from: Vector) -> Option<f64> {
        let top_z_m = match self {
            Form::Box { low, high } => {
                let over =
                    from.x >= low.x && from.x <= high.x && from.y >= low.y && from.y <= high.y;
                over.then_some(high.z)?
            }
            Form::Cylinder {
                base,
                radius_m,
                height_m,
            } => {
                let over = (from.x - base.x).hypot(from.y - base.y) <= *radius_m;
                over.then_some(base.z + height_m)?
            }
            Form::Mesh { mesh, .. } => {
                let down = Ray::new(from, Vector::new(0.0, 0.0, -1.0));
                from.z - mesh.cast_local_ray(&down, f64::MAX, false)?
            }
        };
        (top_z_m <= from.z).then_some(top_z_m)
    }
}

/// The least value on a segment of a signed distance to a convex solid.
///
/// The signed distance to a convex set is a convex function, also inside it, so golden sections
/// close in on its minimum: 48 of them leave 1e-10 of the segment's length, and the value is no
/// farther off than that, because a distance changes at most by the length gone.
fn smallest_on_segment_m(a: Vector, b: Vector, distance_m: impl Fn(Vector) -> f64) -> f64 {
    let ends_m = distance_m(a).min(distance_m(b));
    let found = GoldenSection::of([0.0, 1.0], 48, |share| distance_m(a + (b - a) * share));
    ends_m.min(found.left.1).min(found.right.1)
}

/// The parts of a mesh, joined along edges, each with its orientation outward where it is closed.
fn mesh_parts(vertices_m: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<Form> {
    // Files often repeat a corner for every face: equal places are one vertex.
    let mut known: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let mut places: Vec<Vector> = Vec::new();
    let merged: Vec<u32> = vertices_m
        .iter()
        .map(|vertex| {
            let bits = vertex.coords.map(|x| (x + 0.0).to_bits());
            *known.entry([bits.x, bits.y, bits.z]).or_insert_with(|| {
                places.push(vector(vertex));
                (places.len() - 1) as u32
            })
        })
        .collect();
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| merged[corner as usize]);
    let has_sides = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    let triangles: Vec<[u32; 3]> = triangles.iter().map(corners).filter(has_sides).collect();

    let mut joined = UnionFind::<usize>::new(triangles.len());
    let mut first_at: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for (index, [a, b, c]) in triangles.iter().enumerate() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let edge = [*from.min(to), *from.max(to)];
            joined.union(*first_at.entry(edge).or_insert(index), index);
        }
    }
    let mut groups: BTreeMap<usize, Vec<[u32; 3]>> = BTreeMap::new();
    for (index, triangle) in triangles.into_iter().enumerate() {
        groups.entry(joined.find(index)).or_default().push(triangle);
    }
    let parts = groups.into_values();
    parts
        .filter_map(|group| mesh_part(&places, group))
        .collect()
}

/// One connected part with its faces outward where it is closed; `None` where parry refuses it.
fn mesh_part(places: &[Vector], mut triangles: Vec<[u32; 3]>) -> Option<Form> {
    // Closed: every edge is walked once in each direction.
    let mut walks: BTreeMap<(u32, u32), i32> = BTreeMap::new();
    for [a, b, c] in &triangles {
        for edge in [(*a, *b), (*b, *c), (*c, *a)] {
            *walks.entry(edge).or_default() += 1;
        }
    }
    let once_back = |((a, b), n): (&(u32, u32), &i32)| *n == 1 && walks.get(&(*b, *a)) == Some(&1);
    let closed = walks.iter().all(once_back);
    let volume_m3 = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| places[corner as usize]);
        a.dot(b.cross(c)) / 6.0
    };
    if closed && triangles.iter().map(volume_m3).sum::<f64>() < 0.0 {
        let turn = |triangle: &mut [u32; 3]| triangle.swap(1, 2);
        triangles.iter_mut().for_each(turn);
    }
    // Only this part's vertices, numbered anew.
    let mut number: BTreeMap<u32, u32> = BTreeMap::new();
    let mut own: Vec<Vector> = Vec::new();
    for corner in triangles.iter_mut().flatten() {
        let old = *corner;
        *corner = *number.entry(old).or_insert_with(|| {
            own.push(places[old as usize]);
            (own.len() - 1) as u32
        });
    }
    let flags = match closed {
        true => TriMeshFlags::ORIENTED,
        false => TriMeshFlags::empty(),
    };
    let mesh = Box::new(TriMesh::with_flags(own, triangles, flags).ok()?);
    Some(Form::Mesh { mesh, closed })
}

/// A point as parry has it; no turn of axes, the world is z-up in both.
fn vector(point: &Point3<f64>) -> Vector {
    Vector::new(point.x, point.y, point.z)
}

#[cfg(test)]
mod tests;
