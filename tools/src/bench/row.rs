//! One line of the table: instances that differ in their seed alone.

use diagnosis::statistics::quantile::quantile;
use serde::Serialize;

use super::instance::Figures;
use crate::instances::Floor;
use crate::table::joined;

/// Instances that differ in their seed alone.
#[derive(Debug, Serialize)]
pub struct Row {
    /// Where they fly.
    pub place: Floor,
    /// How many of them.
    pub drones: usize,
    /// Columns of cells free from floor to ceiling.
    pub open_columns: usize,
    /// One for each seed.
    pub runs: Vec<Run>,
}

/// What became of one instance.
#[derive(Debug, Serialize)]
pub struct Run {
    /// Its seed.
    pub seed: u64,
    /// What came of it.
    pub figures: Option<Figures>,
    /// Why there are none.
    pub failure: Option<String>,
}

impl Run {
    /// Figures, or why there are none.
    #[must_use]
    pub fn of(seed: u64, result: Result<Figures, String>) -> Run {
        let (figures, failure) = match result {
            Ok(figures) => (Some(figures), None),
            Err(failure) => (None, Some(failure)),
        };
        Run {
            seed,
            figures,
            failure,
        }
    }

    fn is_safe(&self) -> bool {
        self.figures.as_ref().is_some_and(Figures::is_safe)
    }

    /// What there is to say against it, if anything.
    fn remark(&self) -> Option<String> {
        let Some(figures) = &self.figures else {
            return Some(self.failure.clone().unwrap_or_default());
        };
        let mut said = Vec::new();
        match figures.status.as_str() {
            "blocked" => said.push("starts exclude one another".to_owned()),
            _ if figures.left_out > 0 => said.push(format!("{} unplanned", figures.left_out)),
            _ => {}
        }
        if figures.violations > 0 {
            said.push(format!("not verified, {} violations", figures.violations));
        }
        if figures.cut_short && figures.has_plan() {
            said.push("stopped early".to_owned());
        }
        (!said.is_empty()).then(|| said.join(", "))
    }
}

impl Row {
    /// Runs at one place and of one size.
    #[must_use]
    pub fn of(place: Floor, drones: usize, runs: Vec<Run>) -> Row {
        Row {
            place,
            drones,
            open_columns: place.open_columns(),
            runs,
        }
    }

    /// Every drone planned and every plan verified, in all instances.
    #[must_use]
    pub fn is_safe(&self) -> bool {
        self.runs.iter().all(Run::is_safe)
    }

    /// Safe, and each run came to its own end: what a growth can be read from.
    pub(super) fn is_complete(&self) -> bool {
        let early = |run: &Run| run.figures.as_ref().is_some_and(|it| it.cut_short);
        self.is_safe() && !self.runs.iter().any(early)
    }

    /// By which rules its fleets are planned.
    pub(super) fn rules(&self) -> String {
        let figures = self.runs.iter().filter_map(|run| run.figures.as_ref());
        let mut all: Vec<&str> = figures.map(|it| it.rules.as_str()).collect();
        all.sort_unstable();
        all.dedup();
        joined(&all, "; ")
    }

    /// Drones for each open column.
    pub(super) fn density(&self) -> f64 {
        self.drones as f64 / self.open_columns as f64
    }

    /// "3 of 3", or what is wrong with which seed.
    pub(super) fn answer(&self) -> String {
        let safe = self.runs.iter().filter(|run| run.is_safe()).count();
        let mut answer = format!("{safe} of {}", self.runs.len());
        for run in &self.runs {
            if let Some(remark) = run.remark() {
                answer += &format!("; seed {}: {remark}", run.seed);
            }
        }
        answer
    }

    pub(super) fn planning_time_s(&self) -> Option<f64> {
        self.median(|run| Some(run.planning_time_s))
    }

    pub(super) fn peak_memory_mib(&self) -> Option<f64> {
        self.median(|run| {
            run.peak_memory_bytes
                .map(|bytes| bytes as f64 / 1_048_576.0)
        })
    }

    /// Over the runs that have a plan; of an even number the mean of the middle two.
    pub(super) fn median(&self, of: impl Fn(&Figures) -> Option<f64>) -> Option<f64> {
        let planned = self.runs.iter().filter_map(|run| run.figures.as_ref());
        let planned = planned.filter(|figures| figures.has_plan());
        let mut values: Vec<f64> = planned.filter_map(of).collect();
        values.sort_unstable_by(f64::total_cmp);
        quantile(&values, 0.5)
    }
}
