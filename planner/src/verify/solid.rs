//! Distance from a point to a solid.

use nalgebra::{Point3, Vector3};
use parry3d::query::PointQuery;
use parry3d::shape::{TriMesh, TriMeshFlags};

/// A named solid in the world (m).
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub(crate) name: String,
    pub(crate) shape: Shape,
    /// Its bounding box.
    pub(crate) box_m: (Vector3<f64>, Vector3<f64>),
}

#[derive(Clone, Debug)]
pub(crate) enum Shape {
    Box {
        min_m: Point3<f64>,
        max_m: Point3<f64>,
    },
    Cylinder {
        base_m: Point3<f64>,
        radius_m: f64,
        height_m: f64,
    },
    /// `closed`: its triangles enclose a volume, and point out of it.
    Mesh { mesh: Box<TriMesh>, closed: bool },
}

impl Solid {
    /// A solid, or why its numbers make none.
    pub(crate) fn new(name: &str, raw: RawShape) -> Result<Solid, String> {
        let (shape, box_m) = match raw {
            RawShape::Box { min_m, max_m } => {
                if !(0..3)
                    .all(|k| min_m[k].is_finite() && max_m[k].is_finite() && min_m[k] <= max_m[k])
                {
                    return Err(format!("obstacle `{name}` is no box"));
                }
                (Shape::Box { min_m, max_m }, (min_m.coords, max_m.coords))
            }
            RawShape::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => {
                let numbers = [base_m.x, base_m.y, base_m.z, radius_m, height_m];
                if !numbers.iter().all(|x| x.is_finite()) || radius_m < 0.0 || height_m < 0.0 {
                    return Err(format!("obstacle `{name}` is no cylinder"));
                }
                let low = base_m.coords - Vector3::new(radius_m, radius_m, 0.0);
                let high = base_m.coords + Vector3::new(radius_m, radius_m, height_m);
                (
                    Shape::Cylinder {
                        base_m,
                        radius_m,
                        height_m,
                    },
                    (low, high),
                )
            }
            RawShape::Mesh {
                vertices_m,
                triangles,
            } => {
                let (mesh, closed) = mesh(vertices_m, triangles)
                    .ok_or_else(|| format!("obstacle `{name}` is no mesh"))?;
                let extent = vertices_m.iter().fold(
                    (
                        Vector3::repeat(f64::INFINITY),
                        Vector3::repeat(f64::NEG_INFINITY),
                    ),
                    |(low, high), v| (low.inf(&v.coords), high.sup(&v.coords)),
                );
                (
                    Shape::Mesh {
                        mesh: Box::new(mesh),
                        closed,
                    },
                    extent,
                )
            }
        };
        Ok(Solid {
            name: name.to_owned(),
            shape,
            box_m,
        })
    }

    /// Distance from a point to the solid (m); 0 inside. It changes no faster than the point moves.
    pub(crate) fn distance_m(&self, point_m: &Vector3<f64>) -> f64 {
        match &self.shape {
            Shape::Box { .. } => self.box_distance_m(&(*point_m, *point_m)),
            Shape::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => {
                let outside = ((point_m.xy() - base_m.coords.xy()).norm() - radius_m).max(0.0);
                let above = (base_m.z - point_m.z)
                    .max(point_m.z - base_m.z - height_m)
                    .max(0.0);
                outside.hypot(above)
            }
            Shape::Mesh { mesh, closed } => {
                let point = [point_m.x, point_m.y, point_m.z].into();
                if *closed && mesh.contains_local_point(point) {
                    0.0
                } else {
                    mesh.distance_to_local_point(point, true)
                }
            }
        }
    }

    /// Distance between its bounding box and another box (m): never more than to the solid itself.
    pub(crate) fn box_distance_m(&self, places_m: &(Vector3<f64>, Vector3<f64>)) -> f64 {
        let gap = |k: usize| {
            (self.box_m.0[k] - places_m.1[k])
                .max(places_m.0[k] - self.box_m.1[k])
                .max(0.0)
        };
        Vector3::new(gap(0), gap(1), gap(2)).norm()
    }

    /// Height of its highest point straight below a place (m); `None`: nothing of it is below.
    pub(crate) fn support_z_m(&self, place_m: &Point3<f64>) -> Option<f64> {
        let beside = (0..2).any(|k| place_m[k] < self.box_m.0[k] || place_m[k] > self.box_m.1[k]);
        if beside || place_m.z < self.box_m.0.z {
            return None;
        }
        match &self.shape {
            Shape::Box { max_m, .. } => Some(max_m.z.min(place_m.z)),
            Shape::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => ((place_m - base_m).xy().norm() <= *radius_m)
                .then_some((base_m.z + height_m).min(place_m.z)),
            Shape::Mesh { mesh, .. } => {
                use parry3d::query::{Ray, RayCast};
                let ray = Ray::new(
                    [place_m.x, place_m.y, place_m.z].into(),
                    [0.0, 0.0, -1.0].into(),
                );
                mesh.cast_local_ray(&ray, place_m.z - self.box_m.0.z + 1.0, true)
                    .map(|fall_m| place_m.z - fall_m)
            }
        }
    }
}

/// The numbers a solid is read from.
pub(crate) enum RawShape<'a> {
    Box {
        min_m: Point3<f64>,
        max_m: Point3<f64>,
    },
    Cylinder {
        base_m: Point3<f64>,
        radius_m: f64,
        height_m: f64,
    },
    Mesh {
        vertices_m: &'a [Point3<f64>],
        triangles: &'a [[u32; 3]],
    },
}

/// A mesh; where its triangles close a volume, also its inside counts.
fn mesh(vertices_m: &[Point3<f64>], triangles: &[[u32; 3]]) -> Option<(TriMesh, bool)> {
    let known = triangles
        .iter()
        .flatten()
        .all(|&k| (k as usize) < vertices_m.len());
    if !known || !vertices_m.iter().all(|v| v.iter().all(|x| x.is_finite())) {
        return None;
    }
    let vertices = vertices_m.iter().map(|v| [v.x, v.y, v.z].into()).collect();
    let oriented = TriMeshFlags::ORIENTED | TriMeshFlags::MERGE_DUPLICATE_VERTICES;
    let outward = closed_outward(vertices_m, triangles);
    let closed = outward.is_some();
    let mesh = match outward {
        Some(triangles) => TriMesh::with_flags(vertices, triangles, oriented),
        None => TriMesh::new(vertices, triangles.to_vec()),
    };
    mesh.ok().map(|mesh| (mesh, closed))
}

/// The triangles turned outward, if every edge is used once in each direction; `None` for a surface with
/// a rim or without a consistent side, of which only the triangles themselves count.
fn closed_outward(vertices_m: &[Point3<f64>], triangles: &[[u32; 3]]) -> Option<Vec<[u32; 3]>> {
    let place = |k: u32| vertices_m[k as usize].coords.map(f64::to_bits);
    let mut edges: Vec<_> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .map(|(a, b)| {
            let (a, b) = (place(a), place(b));
            ([a.x, a.y, a.z], [b.x, b.y, b.z])
        })
        .collect();
    edges.sort_unstable();
    let once = edges.windows(2).all(|pair| pair[0] != pair[1]);
    let closed = edges
        .iter()
        .all(|&(a, b)| edges.binary_search(&(b, a)).is_ok());
    if !once || !closed {
        return None;
    }
    let corner = |k: u32| vertices_m[k as usize].coords;
    let volume6_m3: f64 = triangles
        .iter()
        .map(|&[a, b, c]| corner(a).dot(&corner(b).cross(&corner(c))))
        .sum();
    let turn = |&[a, b, c]: &[u32; 3]| {
        if volume6_m3 < 0.0 {
            [a, c, b]
        } else {
            [a, b, c]
        }
    };
    Some(triangles.iter().map(turn).collect())
}
