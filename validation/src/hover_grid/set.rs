//! Flights of several drones over one probe, each as the folder of its recording.

use diagnosis::record::NoSuchAirframe;

use super::HoverGrid;
use crate::folder;

/// The drones that the paper's fit is made from: those without cant.
pub const UNCANTED: [&str; 4] = ["kolibri", "offboard-1", "offboard-2", "matrice-300"];

/// Which flights.
#[derive(Clone, Debug)]
pub struct GridSet<'a> {
    /// Names of airframes.
    pub airframes: &'a [&'a str],
    /// Flights of each drone.
    pub flights: u64,
    /// Whether each flies above 2.5 motor distances as well, along the body's y axis.
    pub near_field: bool,
    /// Whether the grids are thinned to 5 depths and 9 offsets, and the track to 2 rows a second.
    pub short: bool,
    /// Draws weather, gusts and the probe's faults. Below 2^45: flights share none then.
    pub seed: u64,
}

impl GridSet<'_> {
    /// One folder a flight, named by drone and number, each with its files by name.
    ///
    /// # Errors
    /// An airframe is not known; nothing is flown then.
    pub fn folders(&self) -> Result<Vec<Folder>, NoSuchAirframe> {
        let mut grids = Vec::new();
        for (index, name) in (0_u64..).zip(self.airframes) {
            let grid = HoverGrid::over_one_probe(name)?;
            grids.push((2 * index, (*name).to_owned(), grid));
            if self.near_field {
                let grid = HoverGrid::near_field(name)?;
                grids.push((2 * index + 1, format!("{name}-near"), grid));
            }
        }
        let mut folders = Vec::new();
        for (kind, name, mut grid) in grids {
            if self.short {
                shorten(&mut grid);
            }
            for flight in 0..self.flights {
                // No two flights share a seed: 32 drones, each over a probe and near it, 4096
                // times.
                let seed = (self.seed * 128 + kind) * 4096 + flight;
                let texts = folder::texts(&grid.fly(seed));
                folders.push((format!("{name}-{}", flight + 1), texts));
            }
        }
        Ok(folders)
    }
}

/// The name of a folder, and names and texts of its files.
pub type Folder = (String, Vec<(&'static str, String)>);

/// So many of a list, evenly spaced, ends included.
fn thinned(values: &[f64], left: usize) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    (0..left)
        .filter_map(|i| values.get((i * last + (left - 1) / 2) / (left - 1)))
        .copied()
        .collect()
}

fn shorten(grid: &mut HoverGrid) {
    grid.depths_over_l = thinned(&grid.depths_over_l, 5);
    grid.offsets_over_l = thinned(&grid.offsets_over_l, 9);
    grid.track_hz = 2.0;
}
