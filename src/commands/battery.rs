//! Batteries beside a plan: what each drone takes of its own, warned of, and limited if asked for.

use flight::Setup;
use flight::battery::{Charge, of_plan};
use planner::Plan;

use crate::report::words::{each_once, first_few};

/// From this share of a full battery on a drone is warned of, where no limit is given (%): chosen
/// here, makers ask for a fifth to be left.
const WARN_FROM_PERCENT: f64 = 80.0;
/// Below this (%) nothing is said unless it is asked for: chosen here.
const TELL_FROM_PERCENT: f64 = 10.0;
/// Drones that are named, chosen here.
const NAME_UP_TO: usize = 5;

/// What was found.
pub(crate) struct Batteries {
    pub(crate) charges: Vec<Charge>,
    limit_percent: Option<f64>,
    /// It was asked for.
    is_asked: bool,
}

impl Batteries {
    /// Of a plan, with a limit (%) and vehicles, where they are asked for.
    pub(crate) fn of(plan: &Plan, limit_percent: Option<f64>, setup: Option<&Setup>) -> Batteries {
        Batteries {
            charges: of_plan(plan, setup.unwrap_or(&Setup::default())),
            limit_percent,
            is_asked: limit_percent.is_some() || setup.is_some(),
        }
    }

    /// Drones above a share of their battery (%), the emptiest first.
    fn above(&self, percent: f64) -> Vec<&Charge> {
        let taken = |it: &Charge| it.percent.unwrap_or(0.0);
        let all = self.charges.iter().filter(|it| taken(it) > percent);
        let mut all: Vec<&Charge> = all.collect();
        all.sort_by(|a, b| taken(b).total_cmp(&taken(a)));
        all
    }

    /// No drone takes more than the limit.
    pub(crate) fn are_within(&self) -> bool {
        self.limit_percent
            .is_none_or(|limit| self.above(limit).is_empty())
    }

    /// A line for the report.
    pub(crate) fn line(&self) -> Option<String> {
        let unknown = self.charges.iter().filter(|it| it.percent.is_none());
        let unknown = each_once(unknown.map(|it| &it.airframe[..]));
        let unknown = match unknown.is_empty() || !self.is_asked {
            true => String::new(),
            false => format!(" The capacity of {unknown} is not known; --vehicles may say it."),
        };
        let all = self.above(0.0);
        let Some(most) = all.first() else {
            return self
                .is_asked
                .then(|| format!("Battery: nothing is known.{unknown}"));
        };
        let percent = most.percent.unwrap_or(0.0);
        (self.is_asked || percent >= TELL_FROM_PERCENT).then(|| {
            format!(
                "Battery: `{}` takes most, {percent:.1} % of its {} Wh, at a drive efficiency of {} (--vehicles may state another).{unknown}",
                most.drone,
                most.capacity_wh.unwrap_or(0.0),
                most.drive_efficiency
            )
        })
    }

    /// What is beyond the limit, or should be warned of; drag is not counted.
    pub(crate) fn warning(&self) -> Option<String> {
        let limit_percent = self.limit_percent.unwrap_or(WARN_FROM_PERCENT);
        let above = self.above(limit_percent);
        if above.is_empty() {
            return None;
        }
        let taken = |it: &&Charge| format!("`{}` {:.0} %", it.drone, it.percent.unwrap_or(0.0));
        let named = first_few(above.iter().map(taken), NAME_UP_TO, ", ");
        let allowed = match self.limit_percent {
            Some(limit) => format!("{limit} % of a battery are allowed"),
            None => format!("more than {limit_percent} % of a full battery"),
        };
        Some(format!(
            "{allowed}: {named}, hovering and climbing alone; `plan fly` counts drag as well"
        ))
    }
}
