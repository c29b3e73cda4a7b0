//! What a benchmark plans: fleets of several sizes in several places, each from several seeds.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

use super::instance::{Figures, Instance};
use super::row::{Row, Run};
use crate::instances::Floor;
use crate::table::joined;

/// Places, sizes and seeds, and how each instance is planned.
#[derive(Clone, Debug)]
pub struct Suite {
    /// Where the fleets fly.
    pub places: Vec<Floor>,
    /// How many drones each has.
    pub drones: Vec<usize>,
    /// What starts and goals are drawn from; a row has one instance of each.
    pub seeds: Vec<u64>,
    /// Planning of an instance stops after it with the best plan so far.
    pub time_limit: Option<Duration>,
    /// Threads; `None`: one a core.
    pub jobs: Option<NonZeroUsize>,
    /// Whether each fleet is planned once more, ignoring downwash.
    pub contrast: bool,
    /// Whether each is planned in straight motion with quasi-static wakes from the start.
    pub relaxed: bool,
    /// Where the programs of other planners lie, if they are asked as well.
    pub peers: Option<PathBuf>,
}

impl Suite {
    /// Every instance, row by row, seed by seed.
    #[must_use]
    pub fn instances(&self) -> Vec<Instance> {
        let mut all = Vec::new();
        for &place in &self.places {
            for &drones in &self.drones {
                all.extend(self.seeds.iter().map(|&seed| Instance {
                    place,
                    drones,
                    seed,
                    time_limit: self.time_limit,
                    jobs: self.jobs,
                    contrast: self.contrast,
                    relaxed: self.relaxed,
                }));
            }
        }
        all
    }

    /// One instance after another, so that none takes another's time; `plan` gives its figures, or
    /// why there are none.
    pub fn rows(&self, plan: impl Fn(&Instance) -> Result<Figures, String>) -> Vec<Row> {
        let all = self.instances();
        let rows = all.chunks(self.seeds.len().max(1)).map(|row| {
            let runs = row.iter().map(|one| Run::of(one.seed, plan(one)));
            Row::of(row[0].place, row[0].drones, runs.collect())
        });
        rows.collect()
    }

    /// The command that does this again.
    #[must_use]
    pub fn command(&self) -> String {
        let mut words = vec![
            "plan bench".to_owned(),
            joined(self.places.iter().map(|place| place.name()), " "),
            format!("--drones {}", joined(&self.drones, ",")),
            format!("--seeds {}", joined(&self.seeds, ",")),
        ];
        words.extend(
            self.instances()
                .first()
                .into_iter()
                .flat_map(Instance::options),
        );
        if let Some(folder) = &self.peers {
            words.push(format!("--peers {}", folder.display()));
        }
        words.join(" ")
    }
}
