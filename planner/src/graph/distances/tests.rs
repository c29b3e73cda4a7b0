use nalgebra::Point3;
use petgraph::algo::dijkstra;
use petgraph::graph::{DiGraph, NodeIndex};

use super::*;
use crate::graph::lattice::Spacing;
use crate::graph::roadmap::Stop;
use crate::scenario::solid::Solids;
use crate::scenario::world::{Bounds, Obstacle, Solid};

const RADIUS_M: f64 = 0.3;

/// A number from 0 to 1, the same for the same index.
fn at(index: u32) -> f64 {
    (f64::from(index) * 0.754_877_666_246_69).fract()
}

/// A roadmap around four random boxes, its stops, and a mover that may use all of them.
fn random(seed: u32, on_cells: bool) -> (Roadmap, Vec<Vertex>, Mover) {
    let size_m = [9.0, 8.0, 5.0];
    let place = |i: u32| {
        Point3::from([0, 1, 2].map(|axis| size_m[axis as usize] * at(100 * seed + 3 * i + axis)))
    };
    let obstacles: Vec<Obstacle> = (0..4)
        .map(|i| {
            let min = place(i);
            Obstacle {
                name: format!("box-{i}"),
                shape: Solid::Box {
                    min_m: min,
                    max_m: min + nalgebra::Vector3::new(1.2, 1.2, 2.5),
                },
            }
        })
        .collect();
    let bounds = Bounds {
        min: Point3::origin(),
        max: size_m.into(),
    };
    let solids = Solids::new(&obstacles);
    let stops: Vec<Stop> = (10..14)
        .map(place)
        .map(|p| {
            if on_cells {
                p.map(|c| c.floor() + 0.5)
            } else {
                p
            }
        })
        .map(|point_m| Stop {
            point_m,
            radius_m: RADIUS_M,
            corner_deviation_m: 0.0,
            lift_m: None,
        })
        .collect();
    let (roadmap, vertices) = Roadmap::new(&bounds, &Spacing::of(1.0), Some(&solids), &stops);
    let mut own = vertices.clone();
    own.retain(|vertex| roadmap.is_stop(*vertex));
    own.sort_unstable();
    own.dedup();
    let mover = Mover::new(roadmap.lattice(), speeds(0.7 + at(seed)), RADIUS_M, own);
    (roadmap, vertices, mover)
}

/// Ticks from every place, without the closed form.
fn searched(roadmap: &Roadmap, goal: Vertex, mover: Mover) -> Vec<u32> {
    let distances = Distances {
        closed_form: None,
        ..Distances::new(roadmap, goal, 0, mover)
    };
    let places = 0..roadmap.place_count() as Vertex;
    places.map(|from| distances.ticks(roadmap, from)).collect()
}

#[test]
fn the_table_is_what_petgraph_finds() {
    for seed in 0..6 {
        let (roadmap, vertices, mover) = random(seed, seed % 2 == 0);
        let mut graph: DiGraph<(), u32> = DiGraph::new();
        (0..roadmap.place_count()).for_each(|_| {
            graph.add_node(());
        });
        // Backwards: the table counts from anywhere to the goal.
        for from in 0..roadmap.place_count() as Vertex {
            for (to, edge) in roadmap.edges(from) {
                if let Some(ticks) = mover.ticks(&roadmap, to, edge) {
                    graph.add_edge(
                        NodeIndex::new(to as usize),
                        NodeIndex::new(from as usize),
                        ticks,
                    );
                }
            }
        }
        let goal = vertices[0];
        let found = dijkstra(&graph, NodeIndex::new(goal as usize), None, |edge| {
            *edge.weight()
        });
        let table = searched(&roadmap, goal, mover.clone());
        let foreign = |v: Vertex| roadmap.is_stop(v) && !mover.stops.contains(&v);
        for vertex in (0..roadmap.place_count() as Vertex).filter(|v| !foreign(*v)) {
            let expected = found.get(&NodeIndex::new(vertex as usize)).copied();
            assert_eq!(
                table[vertex as usize],
                expected.unwrap_or(UNREACHABLE),
                "{seed}: {vertex}"
            );
        }
    }
}

#[test]
fn the_closed_form_is_what_the_table_says() {
    let mut closed = 0;
    for seed in 0..12 {
        let (roadmap, vertices, all) = random(seed, seed % 2 == 0);
        for &goal in &vertices {
            // A drone with one stop beyond the lattice: its goal.
            let mut mover = all.clone();
            mover.stops = vec![goal];
            let distances = Distances::new(&roadmap, goal, goal, mover.clone());
            let table = searched(&roadmap, goal, mover);
            for from in 0..roadmap.lattice().place_count() as Vertex {
                let Some(ticks) = distances.straight(&roadmap, from) else {
                    continue;
                };
                closed += 1;
                assert_eq!(ticks, table[from as usize], "{seed}: from {from} to {goal}");
            }
        }
    }
    assert!(closed > 1_000, "{closed}");
}

/// Between other stops of its own a drone may cut a corner that the lattice does not cut; the
/// heuristic must not exceed that way.
#[test]
fn the_closed_form_never_exceeds_a_way_through_own_stops() {
    for seed in 0..12 {
        let (roadmap, vertices, mover) = random(seed, false);
        for &goal in &vertices {
            let distances = Distances::new(&roadmap, goal, goal, mover.clone());
            let table = searched(&roadmap, goal, mover.clone());
            for from in 0..roadmap.lattice().place_count() as Vertex {
                if let Some(ticks) = distances.straight(&roadmap, from) {
                    let exact = table[from as usize];
                    assert!(
                        ticks <= exact,
                        "{seed}: from {from} to {goal}: {ticks}, table {exact}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_floor_never_exceeds_the_way_through_the_air_past_closed_columns() {
    let bounds = Bounds {
        min: Point3::origin(),
        max: [12.0, 11.0, 6.0].into(),
    };
    let stop = Stop {
        point_m: Point3::new(0.5, 0.5, 0.5),
        radius_m: RADIUS_M,
        corner_deviation_m: 0.0,
        lift_m: None,
    };
    let (roadmap, _) = Roadmap::new(&bounds, &Spacing::of(1.0), None, &[stop]);
    let lattice = roadmap.lattice();
    let mut farther = 0;
    for seed in 0..40 {
        let place = |i: u32| (at(100 * seed + i) * lattice.place_count() as f64) as Vertex;
        let (from, goal) = (place(0), place(1));
        let closed: Vec<usize> = (2..50).map(|i| lattice.column(place(i))).collect();
        // Some are closed only to late drones.
        let is_open = |column: usize, lead: u32| {
            let index = closed.iter().position(|closed| *closed == column);
            index.is_none_or(|index| index % 4 == 0 && lead < 300)
        };
        let mover = Mover::new(lattice, speeds(0.7 + at(seed)), RADIUS_M, Vec::new());
        let distances = Distances::new(&roadmap, goal, from, mover);
        let mut floor = distances.floor(&roadmap, from).expect("nothing is solid");
        let mut air = distances.backwards(&roadmap, from);
        for asked in [from].into_iter().chain((50..80).map(place)) {
            let known_before = floor.at_least(asked).0;
            floor.extend_bound(asked, u32::MAX, |column, lead| {
                is_open(column as usize, lead)
            });
            let bound = floor.at_least(asked).0;
            let exact = air.ticks(&roadmap, &distances.mover, goal, asked, |place, lead| {
                is_open(lattice.column(place), lead)
            });
            assert!(
                known_before <= bound && bound <= exact,
                "{seed}: from {asked} to {goal}: {known_before}, {bound}, {exact}"
            );
            farther += u32::from(
                bound != UNREACHABLE && bound > distances.ticks(&roadmap, asked) && asked != goal,
            );
        }
    }
    // It knows of detours.
    assert!(farther > 100, "{farther}");
}

/// A drone that climbs and descends as fast as it flies.
fn speeds(along_mps: f64) -> Speeds {
    Speeds {
        along_mps,
        climb_mps: along_mps,
        descent_mps: along_mps,
    }
}
