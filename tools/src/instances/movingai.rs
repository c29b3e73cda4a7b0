//! The text formats of the Moving AI benchmarks.
//!
//! - `.map` and `.scen`, for grids seen from above: N. R. Sturtevant, "Benchmarks for grid-based
//!   pathfinding", IEEE Transactions on Computational Intelligence and AI in Games, 2012, and its
//!   page of formats, movingai.com/benchmarks/formats.html.
//! - `.3dmap` and `.3dscen`, for voxels: D. Brewer and N. R. Sturtevant, "Benchmarks for
//!   pathfinding in 3D voxel space", SoCS 2018; laid out as `environments/VoxelGrid.cpp` of HOG2
//!   reads the first (`voxel`, three sizes, then a blocked voxel a line).

use std::fmt::Write as _;

use super::grid::Grid;
use super::shortest::{Shortest, unobstructed};

/// An instance as four files, name and text: voxels with their pairs, and the floor seen from above
/// with the same pairs, where a column with anything in it is blocked.
///
/// Line k of both lists of pairs is drone k. Row 0 of the map is y = 0.
#[must_use]
pub fn movingai(grid: &Grid) -> [(String, String); 4] {
    let flat = grid.projected();
    let file = |ending: &str| format!("{}.{ending}", grid.name());
    let (map, voxels) = (file("map"), file("3dmap"));
    [
        (file("scen"), scen(&flat, &map)),
        (map, plan(&flat)),
        (file("3dscen"), voxel_scen(grid, &voxels)),
        (voxels, voxel_map(grid)),
    ]
}

/// `@` is out of bounds, `.` is passable.
fn plan(flat: &Grid) -> String {
    let [width, height, _] = flat.size();
    let mut text = format!("type octile\nheight {height}\nwidth {width}\nmap\n");
    for y in 0..height {
        text.extend((0..width).map(|x| if flat.is_blocked([x, y, 0]) { '@' } else { '.' }));
        text.push('\n');
    }
    text
}

/// Bucket (four cells of length each), map, its size, start, goal, shortest length, between tabs.
fn scen(flat: &Grid, map: &str) -> String {
    let [width, height, _] = flat.size();
    let mut shortest = Shortest::new(flat);
    let mut text = "version 1\n".to_owned();
    for agent in flat.agents() {
        let ([sx, sy, _], [gx, gy, _]) = (agent.start, agent.goal);
        // The floors are in one piece.
        let length = shortest.between(agent.start, agent.goal).unwrap_or(0.0);
        let bucket = (length / 4.0).floor();
        let _ = writeln!(
            text,
            "{bucket}\t{map}\t{width}\t{height}\t{sx}\t{sy}\t{gx}\t{gy}\t{length:.8}"
        );
    }
    text
}

fn voxel_map(grid: &Grid) -> String {
    let [x, y, z] = grid.size();
    let mut text = format!("voxel {x} {y} {z}\n");
    for [x, y, z] in grid.blocked() {
        let _ = writeln!(text, "{x} {y} {z}");
    }
    text
}

/// Start, goal, shortest length, and that over the length with nothing in between.
fn voxel_scen(grid: &Grid, map: &str) -> String {
    let mut shortest = Shortest::new(grid);
    let mut text = format!("version 1\n{map}\n");
    for agent in grid.agents() {
        let ([sx, sy, sz], [gx, gy, gz]) = (agent.start, agent.goal);
        let straight = unobstructed(agent.start, agent.goal);
        let length = shortest.between(agent.start, agent.goal).unwrap_or(0.0);
        let ratio = if straight > 0.0 {
            length / straight
        } else {
            1.0
        };
        let _ = writeln!(text, "{sx} {sy} {sz} {gx} {gy} {gz} {length:.8} {ratio:.8}");
    }
    text
}
