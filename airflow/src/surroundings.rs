//! How one jet meets its surroundings at one moment.

use nalgebra::Vector3;

use crate::effects::{Effects, NearFloor};
use crate::wake::Wake;

/// The moment and the place in which a jet is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Time (s), the clock that [`crate::effects::PayloadMass::since_s`] is on.
    pub t_s: f64,
    /// Metres sideways for each metre down (x, y) of air that the drone's thrust pushes away, when
    /// the air left: [`crate::effects::WakeLean::against`].
    pub lean: [f64; 2],
    /// Vertical speed of the drone (m/s), up positive.
    pub climb_mps: f64,
    /// Height of the floor (m, world), where there is one.
    pub floor_z_m: Option<f64>,
    /// Height of the drone's rotor plane (m, world).
    pub emitter_z_m: f64,
}

impl Surroundings {
    /// Velocity (m/s, world) of the air at an offset below a drone, from its steady `wake`, with
    /// what this moment changes: payload taken up in flight, lean, climb, the floor. `wake` is made
    /// [`Wake::with_effects`] of the same effects.
    #[must_use]
    pub fn velocity_mps(
        &self,
        effects: &Effects,
        wake: &Wake,
        offset_m: Vector3<f64>,
    ) -> Vector3<f64> {
        let share = effects.wake_lean.map_or(0.0, |lean| lean.share);
        let lean = Vector3::new(self.lean[0], self.lean[1], 0.0) * share;
        // A jet that leans is sheared: the air of each depth lies beside where it would lie.
        let offset_m = offset_m + lean * offset_m.z;
        let mut velocity_mps = wake.velocity_mps(offset_m);
        velocity_mps -= lean * velocity_mps.z;
        if offset_m.z >= 0.0 {
            return velocity_mps;
        }
        if let Some(payload) = effects.payload_mass
            && !payload.is_constant()
        {
            velocity_mps *= payload.factor(self.t_s);
        }
        if let Some(climb) = effects.climb_descent {
            velocity_mps *= climb.factor(self.climb_mps / wake.induced_velocity_mps());
        }
        if let (Some(ground), Some(floor_z_m)) = (effects.ground_impingement, self.floor_z_m) {
            let emitter_height_m = (self.emitter_z_m - floor_z_m).max(wake.motor_distance_m());
            let [x, y] = wake.axis_m(-offset_m.z).unwrap_or([0.0; 2]);
            let (dx, dy) = (offset_m.x - x, offset_m.y - y);
            let radius_m = dx.hypot(dy);
            let (kept, outward_mps) = ground.meet(&NearFloor {
                height: self.emitter_z_m + offset_m.z - floor_z_m,
                emitter_height: emitter_height_m,
                radius: radius_m,
                half_width: wake.half_width_m(emitter_height_m),
                root_momentum: wake.far_field().momentum_flux_m4_per_s2().sqrt(),
            });
            velocity_mps *= kept;
            if radius_m > 0.0 {
                velocity_mps += Vector3::new(dx, dy, 0.0) * (outward_mps / radius_m);
            }
        }
        velocity_mps
    }
}
