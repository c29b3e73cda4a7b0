use super::survey::CLEARANCE_TOLERANCE_M;
use super::*;
use crate::scenario::world::{Obstacle, Solid};

const RADIUS_M: f64 = 0.3;

fn at(index: u32) -> f64 {
    (f64::from(index) * 0.754_877_666_246_69).fract()
}

fn room(size_m: [f64; 3]) -> Bounds {
    Bounds {
        min: Point3::origin(),
        max: size_m.into(),
    }
}

fn solids(boxes: &[([f64; 3], [f64; 3])]) -> Solids {
    let obstacles: Vec<Obstacle> = boxes
        .iter()
        .map(|(min_m, max_m)| Obstacle {
            name: "box".to_owned(),
            shape: Solid::Box {
                min_m: (*min_m).into(),
                max_m: (*max_m).into(),
            },
        })
        .collect();
    Solids::new(&obstacles)
}

fn stop(point_m: [f64; 3], grounded: bool) -> Stop {
    Stop {
        point_m: point_m.into(),
        radius_m: RADIUS_M,
        corner_deviation_m: 0.0,
        lift_m: grounded.then_some(0.02),
    }
}

#[test]
fn every_way_is_as_clear_as_it_says() {
    for seed in 0..4 {
        let boxes: Vec<_> = (0..4)
            .map(|i| {
                let min_m = [0, 1, 2].map(|axis| 6.0 * at(50 * seed + 3 * i + axis));
                (min_m, [min_m[0] + 1.5, min_m[1] + 0.4, min_m[2] + 2.0])
            })
            .collect();
        let solids = solids(&boxes);
        let stops: Vec<Stop> = (0..5)
            .map(|i| {
                stop(
                    [0, 1, 2].map(|axis| 6.0 * at(50 * seed + 20 + 3 * i + axis)),
                    false,
                )
            })
            .collect();
        let (roadmap, _) = Roadmap::new(
            &room([7.0, 7.0, 6.0]),
            &Spacing::of(1.0),
            Some(&solids),
            &stops,
        );
        let mut fitting = 0;
        for from in 0..roadmap.place_count() as Vertex {
            for (to, edge) in roadmap.edges(from).filter(|(_, edge)| edge.fits(RADIUS_M)) {
                fitting += 1;
                let (from_m, to_m) = (roadmap.position_m(from), roadmap.position_m(to));
                assert!((f64::from(edge.length_m) - (to_m - from_m).norm()).abs() < 1e-6);
                for k in 0..=10 {
                    let place_m = from_m + (to_m - from_m) * (f64::from(k) / 10.0);
                    let clear_m = solids.distance_to_point_m(place_m).0;
                    assert!(
                        clear_m + 2.0 * CLEARANCE_TOLERANCE_M >= RADIUS_M,
                        "{from_m} to {to_m}: {clear_m} m at {place_m}"
                    );
                }
            }
        }
        assert!(fitting > 500, "{fitting}");
    }
}

#[test]
fn a_drone_takes_off_straight_up_from_the_shelf_it_stands_on() {
    let solids = solids(&[([1.0, 1.0, 0.0], [4.0, 4.0, 1.0])]);
    // Its body of 0.2 m touches the shelf; with a clearance of 0.1 m it is 0.3 m.
    let standing = stop([2.3, 2.4, 1.2], true);
    let (roadmap, vertices) = Roadmap::new(
        &room([6.0, 6.0, 5.0]),
        &Spacing::of(1.0),
        Some(&solids),
        &[standing],
    );
    let out: Vec<(Vertex, Edge)> = roadmap.edges(vertices[0]).collect();
    assert_eq!(out.len(), 1);
    let (above, edge) = out[0];
    assert!(edge.fits(RADIUS_M));
    let above_m = roadmap.position_m(above);
    assert_eq!((above_m.x, above_m.y), (2.3, 2.4));
    assert!((1.3 - 1e-9..1.3 + 0.02).contains(&above_m.z), "{above_m}");
    assert!(
        roadmap
            .edges(above)
            .any(|(to, edge)| !roadmap.is_stop(to) && edge.fits(RADIUS_M))
    );
    // In the air at the same place it has nowhere to go: it is too near to the shelf.
    let (roadmap, vertices) = Roadmap::new(
        &room([6.0, 6.0, 5.0]),
        &Spacing::of(1.0),
        Some(&solids),
        &[stop([2.3, 2.4, 1.2], false)],
    );
    assert!(
        roadmap
            .edges(vertices[0])
            .all(|(_, edge)| !edge.fits(RADIUS_M))
    );
}

#[test]
fn no_drone_takes_off_under_a_roof() {
    let solids = solids(&[
        ([1.0, 1.0, 0.0], [4.0, 4.0, 1.0]),
        ([1.0, 1.0, 1.45], [4.0, 4.0, 1.6]),
    ]);
    let standing = stop([2.3, 2.4, 1.2], true);
    let (roadmap, vertices) = Roadmap::new(
        &room([6.0, 6.0, 5.0]),
        &Spacing::of(1.0),
        Some(&solids),
        &[standing],
    );
    assert_eq!(roadmap.edges(vertices[0]).count(), 0);
}

#[test]
fn a_slit_lets_through_only_drones_that_fit() {
    // A wall from side to side with a slit 0.5 m wide about y = 2.
    let solids = solids(&[
        ([3.0, 0.0, 0.0], [3.2, 1.75, 3.0]),
        ([3.0, 2.25, 0.0], [3.2, 4.0, 3.0]),
    ]);
    let stops = [stop([1.5, 2.0, 1.5], false), stop([5.5, 2.0, 1.5], false)];
    let (roadmap, vertices) = Roadmap::new(
        &room([7.0, 4.0, 3.0]),
        &Spacing::of(0.5),
        Some(&solids),
        &stops,
    );
    let reaches = |radius_m: f64| {
        let mut seen = vec![false; roadmap.place_count()];
        let mut open = vec![vertices[0]];
        while let Some(vertex) = open.pop() {
            if std::mem::replace(&mut seen[vertex as usize], true) {
                continue;
            }
            let fitting = roadmap
                .edges(vertex)
                .filter(|(_, edge)| edge.fits(radius_m));
            open.extend(fitting.map(|(to, _)| to));
        }
        seen[vertices[1] as usize]
    };
    assert!(reaches(0.2) && !reaches(RADIUS_M));
}
