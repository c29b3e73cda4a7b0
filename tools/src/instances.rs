//! Scenarios made by rule and seed, as RON text: the questions of the benches and of
//! `plan generate`.
//!
//! The same arguments give the same bytes, on every machine: the generator is SplitMix64, whose
//! stream a test fixes. Starts and goals lie at the centres of 1 m cells (the circle's lie on the
//! circle), Offboard 2 throughout, `air_limit` 0.3, every drone hovers from start to end, and goes
//! on at its goal. No two starts share a column of cells and no two goals do, which keeps both free
//! of downwash: an Offboard 2 one metre beside the axis of another is exposed to at most 0.08 of
//! its induced velocity in a hall 8 m high. In the mixed hall every tenth drone is a Matrice 300,
//! which keeps the eight columns around its own free as well.
//!
//! [`random`] worlds hold everything that a scenario may hold, for tests.
//!
//! What flies over a [`Floor`] lies on a grid throughout, and can be had as a [`Grid`] for other
//! planners.

mod floors;
mod grid;
mod movingai;
mod multi_robot;
pub mod random;
mod scatter;
mod scene;
mod shortest;

use thiserror::Error;

pub use floors::{Floor, field, hall, warehouse};
pub use grid::{Agent, Grid};
pub use movingai::movingai;
pub use multi_robot::lib_multi_robot_planning;
use scene::{Flight, OFFBOARD_2, Scene};

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
    /// More drones than this draw of a mixed fleet has room for.
    #[error(
        "{drones} drones, every tenth a Matrice 300, do not fit into the hall with seed {seed}, {room} do: a Matrice 300 keeps the eight columns around its own free"
    )]
    TooManyMixed {
        /// Asked for.
        drones: usize,
        /// Of the draw.
        seed: u64,
        /// The largest fleet of this seed.
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

/// Height of every generated hall (m): chosen here, eight flight levels of 1 m.
const HEIGHT_M: f64 = 8.0;
/// Smallest distance between neighbours on the circle (m), chosen here: two bodies of Offboard 2
/// (0.198 m each to the rotor tips) and the default clearance of 0.1 m need 0.495 m.
const CIRCLE_SPACING_M: f64 = 0.5;

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
        let (start_m, goal_m) = if index % 2 == 0 {
            (here, there)
        } else {
            (there, here)
        };
        scene.flights.push(Flight {
            airframe: OFFBOARD_2,
            start_m,
            goal_m,
        });
    }
    Ok(scene.to_ron())
}

/// Every drone on a circle at one height, each to the opposite point.
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
        scene.flights.push(Flight {
            airframe: OFFBOARD_2,
            start_m: at(1.0),
            goal_m: at(-1.0),
        });
    }
    Ok(scene.to_ron())
}

fn millimetres(length_m: f64) -> f64 {
    (length_m * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_many_drones_are_refused_with_the_number_that_fits() {
        let message = window(49).expect_err("48 fit").to_string();
        assert!(message.contains("48"), "{message}");
        let message = circle(64, 1.0).expect_err("too close").to_string();
        assert!(message.contains("radius of 5.1 m"), "{message}");
    }
}
