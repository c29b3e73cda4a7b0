//! How well forces are predicted in flights that nothing was fitted to, and how far apart the
//! drones' clocks are.

use diagnosis::forward::clock::{ClockKnown, ClockOffset};
use diagnosis::forward::held_out::{ForceSkill, ForceTest, clock_offsets, held_out_force};
use diagnosis::record::recording::Recording;
use serde::Serialize;

use crate::io::progress::Progress;
use crate::report::words::count;

/// The answer of `--held-out`.
#[derive(Serialize)]
pub(super) struct Skill {
    #[serde(flatten)]
    forces: ForceSkill,
    /// With every clock shifted by its own estimate, where the forces tell one.
    r2_disc_mean_with_clocks: Option<f64>,
    clocks: Vec<Clocks>,
}

/// Clocks of one recording against that of its first drone.
#[derive(Serialize)]
struct Clocks {
    recording: String,
    offsets: Vec<ClockOffset>,
}

/// Thrust maps from some flights, forces in the others; in words where that cannot be done.
pub(super) fn held_out(recordings: &[Recording]) -> Result<Skill, String> {
    let progress = Progress::start("holding flights out", 3);
    let test = ForceTest::default();
    let forces = held_out_force(recordings, &[], &test).map_err(|error| error.to_string())?;
    progress.done_one();
    let offsets = clock_offsets(recordings, &forces, &test);
    progress.done_one();
    let shifts_s: Vec<Vec<f64>> = offsets
        .iter()
        .map(|of| of.iter().map(|clock| clock.offset_s).collect())
        .collect();
    let shifted = held_out_force(recordings, &shifts_s, &test);
    progress.finish();
    let names = recordings.iter().map(|one| one.name.clone());
    let clocks = names.zip(offsets);
    let clocks = clocks.map(|(recording, offsets)| Clocks { recording, offsets });
    Ok(Skill {
        forces,
        r2_disc_mean_with_clocks: shifted.ok().map(|skill| skill.r2_disc_mean),
        clocks: clocks.collect(),
    })
}

impl Skill {
    /// How well forces are predicted, and what is known of the clocks.
    pub(super) fn sentences(&self) -> Vec<String> {
        let known = |kind: ClockKnown| {
            let all = self.clocks.iter().flat_map(|clocks| &clocks.offsets);
            all.filter(|clock| clock.known == kind).count()
        };
        let shifted = self.r2_disc_mean_with_clocks.iter();
        let shifted =
            shifted.map(|r2| format!("; {r2:.3} with clocks shifted by what the forces say"));
        let with_clocks: String = shifted.collect();
        let forces = &self.forces;
        vec![
            format!(
                "on the lower drone, {} folds, nothing fitted but the thrust map: R2 {:.3} with the air averaged over the rotor discs, {:.3} at the rotor centre ({} of {}){with_clocks}",
                forces.folds,
                forces.r2_disc_mean,
                forces.r2_centre,
                count(forces.rows, "row", "rows"),
                count(forces.flights, "flight", "flights"),
            ),
            format!(
                "clocks against the first drone's: {} told, {} at their bound, {} cannot be told from the forces",
                known(ClockKnown::Told),
                known(ClockKnown::AtBound),
                known(ClockKnown::CannotBeTold),
            ),
        ]
    }
}
