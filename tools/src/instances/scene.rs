//! A generated scenario before it is text.

use std::fmt::Write as _;

use super::Grid;

/// Fleet-wide limit of the air over the rotor discs, over the induced velocity: +16 % power.
pub(super) const AIR_LIMIT: f64 = 0.3;
/// The airframe unless a scene says otherwise.
pub(super) const OFFBOARD_2: &str = "offboard-2";

/// What a scenario says, before it is text.
#[derive(Default)]
pub(super) struct Scene {
    pub(super) about: String,
    pub(super) command: String,
    pub(super) name: String,
    pub(super) size_m: [f64; 3],
    pub(super) boxes: Vec<(String, [f64; 3], [f64; 3])>,
    pub(super) flights: Vec<Flight>,
}

/// One drone of a scene.
pub(super) struct Flight {
    pub(super) airframe: &'static str,
    pub(super) start_m: [f64; 3],
    pub(super) goal_m: [f64; 3],
}

impl Scene {
    /// The same in cells of 1 m, for scenes whose obstacles and flights lie on them.
    pub(super) fn grid(&self) -> Grid {
        let cell = |place_m: [f64; 3]| place_m.map(|at_m| at_m as usize);
        let mut grid = Grid::open(self.name.clone(), cell(self.size_m));
        for (_, low_m, high_m) in &self.boxes {
            grid.block(cell(*low_m), cell(*high_m));
        }
        for (index, flight) in self.flights.iter().enumerate() {
            grid.add(name_of(index), cell(flight.start_m), cell(flight.goal_m));
        }
        grid
    }

    pub(super) fn to_ron(&self) -> String {
        let Scene {
            about,
            command,
            name,
            size_m: [x, y, z],
            ..
        } = self;
        let mut text = format!(
            "// {about}\n// Made by: {command}\nScenario(\n  name: \"{name}\",\n  bounds_m: (min: (0, 0, 0), max: ({x}, {y}, {z})),\n"
        );
        let mut put = |line: std::fmt::Arguments| {
            // Writing to a String cannot fail.
            let _ = text.write_fmt(line);
        };
        if !self.boxes.is_empty() {
            put(format_args!("  obstacles: [\n"));
            for (name, [x0, y0, z0], [x1, y1, z1]) in &self.boxes {
                put(format_args!(
                    "    (name: \"{name}\", min_m: ({x0}, {y0}, {z0}), max_m: ({x1}, {y1}, {z1})),\n"
                ));
            }
            put(format_args!("  ],\n"));
        }
        put(format_args!("  drones: [\n"));
        for (index, flight) in self.flights.iter().enumerate() {
            let Flight {
                airframe,
                start_m: [x0, y0, z0],
                goal_m: [x1, y1, z1],
            } = flight;
            put(format_args!(
                "    (name: \"{}\", airframe: \"{airframe}\", start_m: ({x0}, {y0}, {z0}), tasks: [(to_m: ({x1}, {y1}, {z1}))]),\n",
                name_of(index)
            ));
        }
        put(format_args!(
            "  ],\n  planning: (cell_m: 1.0, air_limit: {AIR_LIMIT}),\n)\n"
        ));
        text
    }
}

fn name_of(index: usize) -> String {
    format!("d{}", index + 1)
}
