//! The air of a plan, and the wakes of its airframes in it.

use std::str::FromStr;
use std::sync::Arc;

use airflow::effects::Flown;
use airflow::{Airframe, DiscPoints, Jet, Superposition, Wake};

use super::wake_bound::BoundedWake;
use crate::plan::{AirframeEntry, Plan};

/// The air of the plan, checked.
#[derive(Clone, Copy)]
pub(super) struct PlanAir {
    density_kg_per_m3: f64,
    jet: Jet,
    pub(super) superposition: Superposition,
    pub(super) flown: Flown,
}

pub(super) fn air(plan: &Plan) -> Result<PlanAir, String> {
    let density_kg_per_m3 = plan.air.density_kg_per_m3;
    if !(density_kg_per_m3.is_finite() && density_kg_per_m3 > 0.0) {
        return Err(format!("the air's density is {density_kg_per_m3} kg/m3"));
    }
    let entry = plan.air.jet;
    let jet = Jet {
        centreline: entry.centreline,
        spreading: entry.spreading,
        origin: entry.origin,
    };
    if let Some(problem) = jet.problems().first() {
        return Err(format!("the jet: {problem}"));
    }
    let superposition =
        Superposition::from_str(&plan.air.superposition).map_err(|error| error.to_string())?;
    let effects = plan.air.effects.unwrap_or_default();
    if let Some(problem) = effects.problems().first() {
        return Err(format!("an effect: {problem}"));
    }
    let flown = effects.flown().map_err(|refused| {
        let (name, why) = refused[0];
        format!("`{name}` cannot be judged: {why}")
    })?;
    Ok(PlanAir {
        density_kg_per_m3,
        jet,
        superposition: flown.superposition.unwrap_or(superposition),
        flown,
    })
}

/// Wakes by airframe: the near field is tabulated once for each.
pub(super) struct Hangar {
    pub(super) air: PlanAir,
    /// How far down wakes are looked at (m).
    deepest_m: f64,
    known: Vec<(Airframe, Arc<BoundedWake>, Arc<DiscPoints>)>,
}

impl Hangar {
    pub(super) fn new(air: PlanAir, deepest_m: f64) -> Hangar {
        Hangar {
            air,
            deepest_m,
            known: Vec::new(),
        }
    }

    pub(super) fn get(
        &mut self,
        entry: &AirframeEntry,
    ) -> Result<(Airframe, Arc<BoundedWake>, Arc<DiscPoints>), String> {
        let airframe = entry.airframe()?;
        if let Some(known) = self.known.iter().find(|known| known.0 == airframe) {
            return Ok(known.clone());
        }
        let wake = Wake::new(
            &airframe,
            entry.mass_kg,
            self.air.density_kg_per_m3,
            &self.air.jet,
        );
        if let Some(why) = (self.air.flown).beyond(&airframe, self.air.density_kg_per_m3) {
            return Err(why);
        }
        let wake = BoundedWake::new(self.air.flown.wake(&wake), self.deepest_m);
        let discs = Arc::new(airframe.disc_points());
        self.known.push((airframe.clone(), Arc::new(wake), discs));
        Ok(self.known[self.known.len() - 1].clone())
    }
}
