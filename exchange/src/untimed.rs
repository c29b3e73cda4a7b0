//! A plan whose times are not kept: each drone in turn so much late, all others on time, judged by
//! the verifier.

use std::fmt;

use planner::Plan;
use planner::plan::file::{Claims, PlanFile};
use planner::plan::{DronePlan, ViolationKind};
use planner::verify::examination::{WorstAir, examine};
use rayon::prelude::*;
use serde::Serialize;

/// How late each drone is (s): chosen here, what a vehicle loses at one waypoint that it takes its
/// time to reach.
pub const LATE_S: f64 = 5.0;
/// Drones of a fleet that is judged so: chosen here, each takes a verification of the whole plan.
pub const MOST_DRONES: usize = 100;

/// What was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Untimed {
    /// How late each drone was (s).
    pub late_s: f64,
    /// Drones that were tried; fewer than the fleet's: it is too large to try any.
    pub tried: usize,
    /// Of these, those whose being late exposes a drone to more than its limit.
    pub air: usize,
    /// And those whose being late brings bodies together, or a drone into a near-field column.
    pub bodies: usize,
    /// The highest air over its limit of all these flights, and which drone was late.
    pub worst: Option<(String, WorstAir)>,
}

/// A drone that begins so much later (s), and flies on as planned.
fn late(drone: &DronePlan, by_s: f64) -> DronePlan {
    let mut drone = drone.clone();
    let path = &mut drone.trajectory;
    path.t_s.iter_mut().for_each(|it| *it += by_s);
    if drone.enters_s.is_none() {
        path.hold_from_0();
    }
    drone.enters_s = drone.enters_s.map(|it| it + by_s);
    let (from_s, until_s) = drone.airborne_s;
    // What hovers from the beginning does so before it begins.
    let from_s = if from_s > 0.0 { from_s + by_s } else { from_s };
    for rest_s in &mut drone.landed_s {
        *rest_s = (rest_s.0 + by_s, rest_s.1 + by_s);
    }
    drone.airborne_s = (
        from_s,
        until_s.map(|it| if it > 0.0 { it + by_s } else { it }),
    );
    drone
}

impl fmt::Display for Untimed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let late_s = self.late_s;
        if self.tried == 0 {
            return write!(
                f,
                "what becomes of the air if each drone runs {late_s} s late was not worked out: \
                 that is done for up to {MOST_DRONES} drones"
            );
        }
        write!(
            f,
            "each drone in turn {late_s} s late, all others on time: of {}, {} expose a drone or a \
             zone to more than its limit, {} bring bodies together or into a near-field column",
            self.tried, self.air, self.bodies
        )?;
        let Some((drone, air)) = &self.worst else {
            return Ok(());
        };
        let from = air.from.as_deref().unwrap_or("several");
        write!(
            f,
            "; at worst `{}` meets alpha {:.2} of {from}'s air at {:.1} s, its limit is {}, when \
             `{drone}` is late",
            air.drone, air.alpha, air.at_s, air.limit
        )
    }
}

/// Each drone in turn [`LATE_S`] late.
#[must_use]
pub fn of(plan: &Plan) -> Untimed {
    let fleet = plan.drones.len();
    if fleet > MOST_DRONES {
        return Untimed {
            late_s: LATE_S,
            ..Untimed::default()
        };
    }
    let one = |k: usize| {
        let mut plan = plan.clone();
        plan.drones[k] = late(&plan.drones[k], LATE_S);
        // Rules, not the room for being late that they were planned with.
        (plan.margins.time_s, plan.margins.tracking_m) = (0.0, 0.0);
        let file = PlanFile {
            plan,
            claims: Claims::default(),
            filled: Vec::new(),
            remarks: Vec::new(),
        };
        let found = examine(&file, false);
        let has = |kinds: &[ViolationKind]| {
            found
                .plan
                .violations
                .iter()
                .any(|it| kinds.contains(&it.kind))
        };
        let air = has(&[ViolationKind::Air, ViolationKind::Zone]);
        let bodies = has(&[ViolationKind::Collision, ViolationKind::Column]);
        (air, bodies, found.worst_air)
    };
    let found: Vec<_> = (0..fleet).into_par_iter().map(one).collect();
    let over = |it: &WorstAir| it.alpha / it.limit.max(1e-9);
    let mut worst: Option<(String, WorstAir)> = None;
    for (drone, (_, _, air)) in plan.drones.iter().zip(&found) {
        let is_worse = |air: &&WorstAir| worst.as_ref().is_none_or(|it| over(air) > over(&it.1));
        if let Some(air) = air.as_ref().filter(is_worse) {
            worst = Some((drone.name.clone(), air.clone()));
        }
    }
    Untimed {
        late_s: LATE_S,
        tried: fleet,
        air: found.iter().filter(|it| it.0).count(),
        bodies: found.iter().filter(|it| it.1).count(),
        worst,
    }
}
