//! The wakes of a plan's drones as shapes to draw, from the volumes that are flown.

use airflow::Flown;
use airflow::Jet;
use costmap::volumes::downwash::Outline;
use costmap::wake::fleet::wake_of;
use costmap::wake::surfaces::BlockingSurfaces;
use nalgebra::Point3;

use crate::plan::{DronePlan, Plan};
use crate::scenario::solid::top;

/// Outlines of wakes in the world of one plan.
#[derive(Clone, Debug)]
pub struct WakeOutlines {
    /// Of the plan's air.
    density_kg_per_m3: f64,
    /// Constants of the merged jet.
    jet: Jet,
    /// What a finding adds to it.
    flown: Flown,
    /// Floor and level faces, on which wakes end.
    surfaces: BlockingSurfaces,
}

impl WakeOutlines {
    /// Of a plan's air and obstacles. Effects that cannot be flown are left out.
    pub fn new(plan: &Plan) -> WakeOutlines {
        let effects = plan
            .air
            .effects
            .and_then(|effects| Flown::of(&effects).ok());
        WakeOutlines {
            density_kg_per_m3: plan.air.density_kg_per_m3,
            jet: plan.air.jet,
            flown: effects.unwrap_or_default(),
            surfaces: blocking_surfaces(plan),
        }
    }

    /// Of a drone that hovers at a place (m) with a mass (kg). Of an airframe that cannot be, the
    /// column is all that there is.
    pub fn of(&self, drone: &DronePlan, at_m: Point3<f64>, mass_kg: f64) -> Outline {
        let entry = &drone.airframe;
        let Ok(airframe) = entry.airframe() else {
            let tip_radius_m = (entry.motor_distance_m + entry.propeller_diameter_m) / 2.0;
            return Outline {
                at_m,
                column_radius_m: tip_radius_m,
                half_width_m: [tip_radius_m; 2],
                z_m: [self.surfaces.floor_z_m(); 2],
                aside_m: [[0.0; 2]; 2],
            };
        };
        let air = (&self.jet, &self.flown);
        let wake = wake_of(&airframe, mass_kg, self.density_kg_per_m3, air);
        let ends_at_z_m = self.surfaces.wake_end_z_m(&wake, &at_m, &at_m);
        Outline::new(&wake, at_m, ends_at_z_m)
    }

    /// The floor and level faces on which the wakes end.
    pub fn surfaces(&self) -> &BlockingSurfaces {
        &self.surfaces
    }
}

/// The floor and level faces of a plan's place, on which wakes end.
pub fn blocking_surfaces(plan: &Plan) -> BlockingSurfaces {
    let tops = plan.obstacles.iter().filter_map(top);
    BlockingSurfaces::new(plan.bounds_m.min.z, tops.collect())
}
