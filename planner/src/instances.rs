//! Scenarios made by rule and seed, as RON text: the questions of the benches and of `plan generate`.
//!
//! The same arguments give the same bytes, on every machine and for good: the generator is written
//! out below instead of borrowed from a crate whose streams may change. Starts and goals lie at the
//! centres of 1 m cells (the circle's lie on the circle), Offboard 2 throughout, `air_limit` 0.3,
//! everybody hovers from start to end and blows on at its goal for ever. No two starts share a column
//! of cells and no two goals do, which keeps both free of downwash: an Offboard 2 one metre beside
//! the axis of another meets at most 0.08 of its induced velocity in a hall 8 m high.

mod scene;

use thiserror::Error;

use scene::Scene;

/// Why there is no such scenario.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum InstanceError {
    /// More drones than free columns.
    #[error(
        "{drones} drones do not fit into a {name}: it has {room} free columns, and each wants its own"
    )]
    TooMany {
        /// Which scenario.
        name: &'static str,
        /// Asked for.
        drones: usize,
        /// Possible.
        room: usize,
    },
    /// Neighbours on the circle would touch.
    #[error(
        "{drones} drones on a circle of {radius_m} m start {spacing_m:.2} m apart, and they need {needs_m} m: take a radius of {wants_m:.1} m or more"
    )]
    Crowded {
        /// Asked for.
        drones: usize,
        /// Of the circle (m).
        radius_m: f64,
        /// Distance between neighbours (m).
        spacing_m: f64,
        /// What it must be (m).
        needs_m: f64,
        /// The smallest radius that has room (m).
        wants_m: f64,
    },
    /// Not a radius.
    #[error("a circle needs a positive radius, not {0} m")]
    Radius(f64),
}

/// Height of every generated hall (m): eight flight levels of 1 m.
const HEIGHT_M: f64 = 8.0;
/// Smallest distance between neighbours on the circle (m), chosen here: two bodies of Offboard 2
/// (0.198 m each to the rotor tips) and the default clearance of 0.1 m need 0.495 m.
const CIRCLE_SPACING_M: f64 = 0.5;

/// An empty hall, 64 x 64 x 8 m: every drone flies from one random cell to another.
///
/// # Errors
/// More than 4096 drones.
///
/// ```
/// let text = planner::instances::hall(200, 1)?;
/// assert_eq!(text, planner::instances::hall(200, 1)?);
/// # Ok::<(), planner::instances::InstanceError>(())
/// ```
pub fn hall(drones: usize, seed: u64) -> Result<String, InstanceError> {
    open_floor("hall", 64, drones, seed)
}

/// The hall on a larger floor, 160 x 160 x 8 m, for a thousand drones and more.
///
/// # Errors
/// More than 25600 drones.
pub fn field(drones: usize, seed: u64) -> Result<String, InstanceError> {
    open_floor("field", 160, drones, seed)
}

fn open_floor(
    name: &'static str,
    side_m: u32,
    drones: usize,
    seed: u64,
) -> Result<String, InstanceError> {
    let columns: Vec<[f64; 2]> = cells(side_m, side_m).collect();
    let mut scene = Scene {
        about: format!(
            "An empty {name}: {drones} drones fly from one random cell to another, each goal in a column of its own."
        ),
        command: format!("plan generate {name} --drones {drones} --seed {seed}"),
        name: format!("{name}-{drones}-{seed}"),
        size_m: [f64::from(side_m), f64::from(side_m), HEIGHT_M],
        ..Scene::default()
    };
    scene.scatter(name, columns, drones, seed)?;
    Ok(scene.to_ron())
}

/// A warehouse, 80 x 60 x 8 m: 76 shelves of 2 x 12 x 6 m in four rows, aisles of 2 m, starts and
/// goals in the aisles. Above the shelves 2 m are left to fly, and their tops stop the wakes.
///
/// # Errors
/// More drones than the aisles have columns (2976).
pub fn warehouse(drones: usize, seed: u64) -> Result<String, InstanceError> {
    // 3 m of border, then 19 shelves with aisles of 2 m: 3 + 19·2 + 18·2 + 3 = 80.
    let shelf_x_m: Vec<f64> = (0..19).map(|k| 3.0 + 4.0 * f64::from(k)).collect();
    // 3 m of border, then four rows with cross aisles of 2 m: 3 + 4·12 + 3·2 + 3 = 60.
    let shelf_y_m: Vec<f64> = (0..4).map(|k| 3.0 + 14.0 * f64::from(k)).collect();
    let inside = |low: &f64, width: f64, at: f64| *low <= at && at <= *low + width;
    let aisle = |[x, y]: &[f64; 2]| {
        !(shelf_x_m.iter().any(|low| inside(low, 2.0, *x))
            && shelf_y_m.iter().any(|low| inside(low, 12.0, *y)))
    };
    let columns: Vec<[f64; 2]> = cells(80, 60).filter(aisle).collect();
    let mut scene = Scene {
        about: format!(
            "A warehouse: {drones} drones between random places in the aisles. Shelf tops stop the wakes above them."
        ),
        command: format!("plan generate warehouse --drones {drones} --seed {seed}"),
        name: format!("warehouse-{drones}-{seed}"),
        size_m: [80.0, 60.0, HEIGHT_M],
        ..Scene::default()
    };
    for (row, y) in shelf_y_m.iter().enumerate() {
        for (column, x) in shelf_x_m.iter().enumerate() {
            let name = format!("shelf-{}-{}", row + 1, column + 1);
            scene
                .boxes
                .push((name, [*x, *y, 0.0], [x + 2.0, y + 12.0, 6.0]));
        }
    }
    scene.scatter("warehouse", columns, drones, seed)?;
    Ok(scene.to_ron())
}

/// Two rooms and one window 2 m wide and 3 m high: both sides swap places through it.
///
/// # Errors
/// More than 48 drones.
pub fn window(drones: usize) -> Result<String, InstanceError> {
    const ROOM: usize = 48;
    if drones > ROOM {
        return Err(InstanceError::TooMany {
            name: "window",
            drones,
            room: ROOM,
        });
    }
    let mut scene = Scene {
        about: format!(
            "Two rooms and one window 2 m wide: {drones} drones change sides through it."
        ),
        command: format!("plan generate window --drones {drones}"),
        name: format!("window-{drones}"),
        size_m: [24.0, 12.0, 5.0],
        ..Scene::default()
    };
    let wall = |name: &str, y: [f64; 2], z: [f64; 2]| {
        (name.to_owned(), [11.5, y[0], z[0]], [12.5, y[1], z[1]])
    };
    scene.boxes = vec![
        wall("wall-right", [0.0, 5.0], [0.0, 5.0]),
        wall("wall-left", [7.0, 12.0], [0.0, 5.0]),
        wall("sill", [5.0, 7.0], [0.0, 1.0]),
        wall("lintel", [5.0, 7.0], [4.0, 5.0]),
    ];
    for index in 0..drones {
        // Pairs face each other: the even one on the left, the odd one at its mirror image. Rows of
        // six, 2 m apart, the row nearest to the window first.
        let pair = index / 2;
        let x = 7.5 - 2.0 * (pair / 6) as f64;
        let y = 0.5 + 2.0 * (pair % 6) as f64;
        let (here, there) = ([x, y, 2.5], [24.0 - x, y, 2.5]);
        scene.flights.push(if index % 2 == 0 {
            (here, there)
        } else {
            (there, here)
        });
    }
    Ok(scene.to_ron())
}

/// Everybody on a circle at one height, everybody to the opposite point.
///
/// # Errors
/// A radius that is not positive, or neighbours closer than 0.5 m.
pub fn circle(drones: usize, radius_m: f64) -> Result<String, InstanceError> {
    if !(radius_m.is_finite() && radius_m > 0.0) {
        return Err(InstanceError::Radius(radius_m));
    }
    // An odd fleet's goals lie half a step beside its starts, but starts meet starts only.
    let half_step = std::f64::consts::PI / drones.max(2) as f64;
    let spacing_m = 2.0 * radius_m * half_step.sin();
    if drones > 1 && spacing_m < CIRCLE_SPACING_M {
        return Err(InstanceError::Crowded {
            drones,
            radius_m,
            spacing_m,
            needs_m: CIRCLE_SPACING_M,
            wants_m: (CIRCLE_SPACING_M / (2.0 * half_step.sin()) * 10.0).ceil() / 10.0,
        });
    }
    let side_m = (2.0 * radius_m).ceil() + 8.0;
    let (middle_m, height_m) = (side_m / 2.0, HEIGHT_M / 2.0);
    let mut scene = Scene {
        about: format!(
            "{drones} drones on a circle of {radius_m} m, each flies to the opposite point: all want the centre."
        ),
        command: format!("plan generate circle --drones {drones} --radius {radius_m}"),
        name: format!("circle-{drones}"),
        size_m: [side_m, side_m, HEIGHT_M],
        ..Scene::default()
    };
    for index in 0..drones {
        let (sin, cos) = (2.0 * half_step * index as f64).sin_cos();
        let at = |sign: f64| {
            [
                millimetres(middle_m + sign * radius_m * cos),
                millimetres(middle_m + sign * radius_m * sin),
                height_m,
            ]
        };
        scene.flights.push((at(1.0), at(-1.0)));
    }
    Ok(scene.to_ron())
}

/// Centres of the 1 m cells of a floor, row by row.
fn cells(x_m: u32, y_m: u32) -> impl Iterator<Item = [f64; 2]> {
    (0..y_m).flat_map(move |y| (0..x_m).map(move |x| [f64::from(x) + 0.5, f64::from(y) + 0.5]))
}

fn millimetres(length_m: f64) -> f64 {
    (length_m * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::scene::AIR_LIMIT;
    use super::*;
    use airflow::{Air, Airframe, Jet, Source, Superposition, Wake, mean_over_discs_mps};
    use nalgebra::Point3;

    #[test]
    fn a_drone_among_eight_neighbours_hovering_above_is_within_its_limit() {
        let frame = Airframe::preset("offboard-2").expect("a preset");
        let wake = Wake::new(
            &frame,
            frame.mass_kg(),
            Air::default().density_kg_per_m3(),
            &Jet::default(),
        );
        let around = (-1..=1).flat_map(|x| (-1..=1).map(move |y| (f64::from(x), f64::from(y))));
        let sources: Vec<Source> = around
            .filter(|&place| place != (0.0, 0.0))
            .map(|(x, y)| Source {
                wake: &wake,
                position_m: Point3::new(x, y, 7.5),
                ends_at_z_m: 0.0,
            })
            .collect();
        // The wakes widen downwards: the lowest level meets most.
        let below_m = Point3::new(0.0, 0.0, 0.5);
        let air_mps = mean_over_discs_mps(
            &sources,
            &frame.disc_points(),
            below_m,
            Superposition::Momentum,
        );
        assert!(
            air_mps / wake.induced_velocity_mps() < 0.75 * AIR_LIMIT,
            "{air_mps} m/s"
        );
    }

    #[test]
    fn the_same_seed_gives_the_same_text_and_another_seed_another() {
        assert_eq!(warehouse(50, 3), warehouse(50, 3));
        assert_ne!(warehouse(50, 3), warehouse(50, 4));
    }

    #[test]
    fn every_fleet_has_as_many_drones_as_asked_for() {
        for drones in [0, 1, 200] {
            let text = hall(drones, 1).expect("the hall has room");
            assert_eq!(text.matches("start_m").count(), drones);
        }
    }

    #[test]
    fn starts_have_columns_of_their_own_and_so_have_goals() {
        let columns: Vec<[f64; 2]> = cells(9, 9).collect();
        let mut scene = Scene {
            size_m: [9.0, 9.0, 8.0],
            ..Scene::default()
        };
        scene.scatter("test", columns, 81, 5).expect("81 columns");
        for pick in [
            |f: &([f64; 3], [f64; 3])| f.0,
            |f: &([f64; 3], [f64; 3])| f.1,
        ] {
            let mut seen: Vec<[u64; 2]> = scene
                .flights
                .iter()
                .map(pick)
                .map(|[x, y, _]| [x as u64, y as u64])
                .collect();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), 81);
        }
    }

    #[test]
    fn nobody_is_asked_to_start_in_a_shelf() {
        let room = match warehouse(usize::MAX, 0) {
            Err(InstanceError::TooMany { room, .. }) => room,
            other => panic!("expected no room, got {other:?}"),
        };
        // 80 x 60 columns less 76 shelves of 2 x 12.
        assert_eq!(room, 80 * 60 - 76 * 24);
    }

    #[test]
    fn too_many_drones_are_refused_with_the_number_that_fits() {
        let message = window(49).expect_err("48 fit").to_string();
        assert!(message.contains("48"), "{message}");
        let message = circle(64, 1.0).expect_err("too close").to_string();
        assert!(message.contains("radius of 5.1 m"), "{message}");
    }
}
