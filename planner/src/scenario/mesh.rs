//! A triangle mesh from the text of an OBJ file, in metres, z up.

use std::collections::HashMap;

use nalgebra::Point3;

use super::limits::{MOST_TRIANGLES, PLACE_M};

/// Vertices (m) and corner indices.
pub(super) type Mesh = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// Reads every object of the file, polygons cut into triangles, moved by `at_m`.
///
/// # Errors
/// What is wrong with the file, for a person.
pub(super) fn mesh(text: &str, at_m: Point3<f64>) -> Result<Mesh, String> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let no_materials = |_: &std::path::Path| Ok((Vec::new(), HashMap::new()));
    let text = places_alone(text)?;
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials)
        .map_err(|error| format!("this is no OBJ file: {error}"))?;
    let (mut vertices_m, mut triangles): Mesh = (Vec::new(), Vec::new());
    for tobj::Model { mesh, .. } in &models {
        let first = vertices_m.len() as u32;
        let (places, _) = mesh.positions.as_chunks::<3>();
        let moved = |place: &[f64; 3]| at_m + Point3::from(*place).coords;
        vertices_m.extend(places.iter().map(moved));
        let (corners, _) = mesh.indices.as_chunks::<3>();
        let renumbered = |corners: &[u32; 3]| corners.map(|corner| first + corner);
        triangles.extend(corners.iter().map(renumbered));
    }
    let size = vertices_m.len().max(triangles.len());
    if size > MOST_TRIANGLES {
        return Err(format!(
            "it has {size} triangles or vertices, at most {MOST_TRIANGLES}"
        ));
    }
    let outside = |place_m: &&Point3<f64>| !place_m.iter().all(|x| PLACE_M.contain(*x));
    if let Some(place_m) = vertices_m.iter().find(outside) {
        let [x, y, z] = place_m.coords.into();
        return Err(format!(
            "it has a vertex at ({x}, {y}, {z}), more than 10 km away: is it in metres?"
        ));
    }
    let mut corners = triangles.iter().flatten();
    if corners.any(|corner| *corner as usize >= vertices_m.len()) {
        return Err("it has a face with a vertex that is not there".to_owned());
    }
    let has_area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| vertices_m[corner as usize]);
        (b - a).cross(&(c - a)).norm() > 0.0
    };
    triangles.retain(has_area);
    if triangles.is_empty() {
        return Err("it has no face".to_owned());
    }
    Ok((vertices_m, triangles))
}

/// The vertices and faces of the text, faces by the numbers of their vertices from 1: textures and
/// normals say nothing about places, and tobj counts with their indices, and with vertices that are
/// not there, past the ends of its types.
fn places_alone(text: &str) -> Result<String, String> {
    let mut places = String::with_capacity(text.len());
    let mut count = 0;
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                count += 1;
                places.push_str(line);
            }
            Some("f") => {
                places.push('f');
                for word in words {
                    let typed = word.split('/').next().unwrap_or_default();
                    let corner: i64 = typed
                        .parse()
                        .map_err(|_| format!("this is no OBJ file: `{typed}` is no vertex"))?;
                    let number = if corner < 0 {
                        count + 1 + corner
                    } else {
                        corner
                    };
                    if !(1..=count).contains(&number) {
                        return Err("it has a face with a vertex that is not there".to_owned());
                    }
                    places.push_str(&format!(" {number}"));
                }
            }
            _ => continue,
        }
        places.push('\n');
    }
    Ok(places)
}
