//! Places for random flights: hall, warehouse, field.

use serde::Serialize;

use super::grid::Grid;
use super::scene::Scene;
use super::{InstanceError, scatter};

/// A place where drones fly from one random cell to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Floor {
    /// Empty, 64 x 64 x 8 m.
    Hall,
    /// The hall, every tenth drone a Matrice 300.
    MixedHall,
    /// 80 x 60 x 8 m with 76 shelves of 2 x 12 x 6 m in four rows, aisles of 2 m.
    Warehouse,
    /// Empty, 160 x 160 x 8 m.
    Field,
}

/// Flight levels of 1 m: the height of every floor (m). Chosen here, as the sides of the floors.
const LEVELS: u32 = 8;
/// Side of the hall (m).
const HALL_M: u32 = 64;
/// Side of the field (m).
const FIELD_M: u32 = 160;
/// Floor of the warehouse (m).
const WAREHOUSE_M: [u32; 2] = [80, 60];

impl Floor {
    /// Every floor, smallest first.
    pub const ALL: [Floor; 4] = [
        Floor::Hall,
        Floor::MixedHall,
        Floor::Warehouse,
        Floor::Field,
    ];

    /// A scenario as RON: each drone hovers from its start to its goal and stays there.
    ///
    /// # Errors
    /// More drones than fit.
    pub fn scenario(self, drones: usize, seed: u64) -> Result<String, InstanceError> {
        Ok(self.scene(drones, seed)?.to_ron())
    }

    /// The same instance in cells of 1 m, for planners on grids; which airframe a drone has is left
    /// out.
    ///
    /// # Errors
    /// More drones than fit.
    pub fn grid(self, drones: usize, seed: u64) -> Result<Grid, InstanceError> {
        Ok(self.scene(drones, seed)?.grid())
    }

    /// Columns of cells that are free from floor to ceiling: each can hold one start, and one goal.
    #[must_use]
    pub(crate) fn open_columns(self) -> usize {
        self.columns().len()
    }

    fn scene(self, drones: usize, seed: u64) -> Result<Scene, InstanceError> {
        let name = self.name();
        let [x_m, y_m] = self.size_m();
        let (made_by, about) = match self {
            Floor::Hall | Floor::Field => (
                name,
                format!(
                    "An empty {name}: {drones} drones fly from one random cell to another, each goal in a column of its own."
                ),
            ),
            Floor::MixedHall => (
                "hall --every-tenth matrice-300",
                format!(
                    "An empty hall: {drones} drones, every tenth a Matrice 300, fly from one random cell to another."
                ),
            ),
            Floor::Warehouse => (
                name,
                format!(
                    "A warehouse: {drones} drones between random places in the aisles. Shelf tops stop the wakes above them."
                ),
            ),
        };
        Ok(Scene {
            about,
            command: format!("plan generate {made_by} --drones {drones} --seed {seed}"),
            name: format!("{name}-{drones}-{seed}"),
            size_m: [f64::from(x_m), f64::from(y_m), f64::from(LEVELS)],
            boxes: self.shelves(),
            flights: match self {
                Floor::MixedHall => scatter::mixed(HALL_M as usize, LEVELS as usize, drones, seed)?,
                _ => scatter::alike(name, &self.columns(), LEVELS as usize, drones, seed)?,
            },
        })
    }

    /// One word, the first of every instance's name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Floor::Hall => "hall",
            Floor::MixedHall => "mixed-hall",
            Floor::Warehouse => "warehouse",
            Floor::Field => "field",
        }
    }

    fn size_m(self) -> [u32; 2] {
        match self {
            Floor::Hall | Floor::MixedHall => [HALL_M; 2],
            Floor::Warehouse => WAREHOUSE_M,
            Floor::Field => [FIELD_M; 2],
        }
    }

    /// Named boxes, lowest and highest corner (m).
    fn shelves(self) -> Vec<(String, [f64; 3], [f64; 3])> {
        if self != Floor::Warehouse {
            return Vec::new();
        }
        let shelf = |row: u32, column: u32| {
            // 3 m of border, then four rows with cross aisles of 2 m: 3 + 4·12 + 3·2 + 3 = 60.
            let y = 3.0 + 14.0 * f64::from(row);
            // 3 m of border, then 19 shelves with aisles of 2 m: 3 + 19·2 + 18·2 + 3 = 80.
            let x = 3.0 + 4.0 * f64::from(column);
            let name = format!("shelf-{}-{}", row + 1, column + 1);
            (name, [x, y, 0.0], [x + 2.0, y + 12.0, 6.0])
        };
        (0..4)
            .flat_map(|row| (0..19).map(move |column| shelf(row, column)))
            .collect()
    }

    /// Centres of the open columns, row by row (m).
    fn columns(self) -> Vec<[f64; 2]> {
        let [x_m, y_m] = self.size_m();
        let shelves = self.shelves();
        let open = |[x, y]: &[f64; 2]| {
            !shelves.iter().any(|(_, low, high)| {
                low[0] <= *x && *x <= high[0] && low[1] <= *y && *y <= high[1]
            })
        };
        (0..y_m)
            .flat_map(|y| (0..x_m).map(move |x| [f64::from(x) + 0.5, f64::from(y) + 0.5]))
            .filter(open)
            .collect()
    }
}

/// [`Floor::scenario`] of the hall.
///
/// # Errors
/// More than 4096 drones.
///
/// ```
/// let text = tools::instances::hall(200, 1)?;
/// assert_eq!(text, tools::instances::hall(200, 1)?);
/// # Ok::<(), tools::instances::InstanceError>(())
/// ```
pub fn hall(drones: usize, seed: u64) -> Result<String, InstanceError> {
    Floor::Hall.scenario(drones, seed)
}

/// [`Floor::scenario`] of the field: a larger floor, for a thousand drones and more.
///
/// # Errors
/// More than 25600 drones.
pub fn field(drones: usize, seed: u64) -> Result<String, InstanceError> {
    Floor::Field.scenario(drones, seed)
}

/// [`Floor::scenario`] of the warehouse: starts and goals in the aisles. Above the shelves 2 m are
/// left to fly, and their tops stop the wakes.
///
/// # Errors
/// More drones than the aisles have columns (2976).
pub fn warehouse(drones: usize, seed: u64) -> Result<String, InstanceError> {
    Floor::Warehouse.scenario(drones, seed)
}

#[cfg(test)]
mod tests {
    use super::super::scene::AIR_LIMIT;
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
        // The wakes widen downwards: the lowest level is exposed most.
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
    fn no_drone_starts_in_a_shelf() {
        let room = match warehouse(usize::MAX, 0) {
            Err(InstanceError::TooMany { room, .. }) => room,
            other => panic!("expected no room, got {other:?}"),
        };
        // 80 x 60 columns less 76 shelves of 2 x 12.
        assert_eq!(room, 80 * 60 - 76 * 24);
    }
}
