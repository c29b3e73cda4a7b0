//! The air below one hovering drone, near field and far field joined.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::airframe::Airframe;
use crate::effects::Effects;
use crate::far_field::FarField;
use crate::jet::Jet;
use crate::near_field::NearField;
use crate::rotor_jets::SHADOW;
use cross_section::CrossSection;
use shape::Shape;

pub(crate) mod cross_section;
pub(crate) mod shape;

/// The mean air below one airframe at one mass, hovering in still air of one density. Cheap to
/// clone.
///
/// Offsets are from the centre of the rotor plane, world frame, metres, z up; the airframe is level
/// with yaw 0. Above the rotor plane, and in it, there is no air. From 2.5 l down it is the paper's
/// jet. In between:
///
/// - four propellers: four rotor jets that merge, joined at 1.8 and 2.5 l with continuous first
///   derivatives, carrying the same momentum at every depth. Around a circle at any depth the air
///   is fastest on the diagonals, under the rotors;
/// - any other number: no model. The far-field profile of 2.5 l is held up to the rotor plane,
///   without radial flow. Outside the column of the rotor tips that is never less than the far
///   field extrapolated upwards (its speed at a fixed radius falls upwards where r > 0.9 r_half),
///   so it is the careful choice for a receiver outside the column.
#[derive(Clone, Debug)]
pub struct Wake {
    far: FarField,
    induced_velocity_mps: f64,
    length_m: f64,
    shared: Arc<Shared>,
    /// What the hover jet leaves out; `None`: nothing.
    shape: Option<Arc<Shape>>,
    /// Factor on every speed of a shaped wake.
    gain: f64,
    /// Sideways over down, that a shaped wake may lean by in any direction.
    lean: f64,
}

/// What a change of mass leaves as it is.
#[derive(Debug)]
struct Shared {
    airframe: Airframe,
    density_kg_per_m3: f64,
    jet: Jet,
    /// `None`: the far field of 2.5 l is held.
    near: Option<NearField>,
}

impl Wake {
    /// The wake of `airframe` at `mass_kg`, payload included. Tabulates the near field: make one
    /// per airframe and use [`Wake::with_mass`] for others of the kind.
    #[must_use]
    pub fn new(airframe: &Airframe, mass_kg: f64, density_kg_per_m3: f64, jet: &Jet) -> Wake {
        let diameter_over_l = airframe.propeller_diameter_m() / airframe.motor_distance_m();
        let near = airframe
            .has_near_field_model()
            .then(|| NearField::new(diameter_over_l, airframe.width_factor(), jet, SHADOW));
        Wake::of(
            Arc::new(Shared {
                airframe: airframe.clone(),
                density_kg_per_m3,
                jet: *jet,
                near,
            }),
            mass_kg,
        )
    }

    /// The same airframe in the same air at another mass (kg): no new table.
    #[must_use]
    pub fn with_mass(&self, mass_kg: f64) -> Wake {
        let mut wake = Wake::of(Arc::clone(&self.shared), mass_kg);
        if self.far.is_extrapolated() {
            wake = wake.extrapolated();
        }
        match &self.shape {
            Some(shape) => Wake {
                gain: self.gain,
                lean: self.lean,
                ..wake.with_effects(shape.effects())
            },
            None => wake,
        }
    }

    /// The same drone with what the hover jet leaves out, as far as it depends on the place below
    /// the drone alone; the rest is of [`crate::Surroundings::velocity_mps`]. Made of the plain
    /// wake, which effects do not pile up on.
    #[must_use]
    pub fn with_effects(&self, effects: &Effects) -> Wake {
        let airframe = &self.shared.airframe;
        let diameter_over_l = airframe.propeller_diameter_m() / airframe.motor_distance_m();
        let plain_mps = match &self.shape {
            Some(shape) => shape.plain_induced_velocity_mps(),
            None => self.induced_velocity_mps,
        };
        let induced_velocity_mps = plain_mps * Shape::strength(effects, diameter_over_l);
        let mut far = FarField::new(
            induced_velocity_mps,
            self.length_m,
            airframe.width_factor(),
            &self.shared.jet,
        );
        if self.far.is_extrapolated() {
            far = far.extrapolated();
        }
        let shape = Shape::new(
            effects,
            plain_mps,
            induced_velocity_mps,
            airframe,
            &self.shared.jet,
        );
        Wake {
            far,
            induced_velocity_mps,
            length_m: self.length_m,
            shared: Arc::clone(&self.shared),
            shape: Some(Arc::new(shape)),
            gain: 1.0,
            lean: 0.0,
        }
    }

    /// The same wake with every speed this many times as high, and its place unchanged: of a drone
    /// that climbs or sinks.
    #[must_use]
    pub fn with_gain(&self, gain: f64) -> Wake {
        let mut wake = match &self.shape {
            Some(_) => self.clone(),
            None => self.with_effects(&Effects::default()),
        };
        wake.gain = gain;
        wake
    }

    /// The fastest of all wakes that lean by up to so much (sideways over down) in any direction:
    /// at every place below the drone, an upper bound of the air of each of them.
    #[must_use]
    pub fn leaning(&self, most: f64) -> Wake {
        let mut wake = match &self.shape {
            Some(_) => self.clone(),
            None => self.with_effects(&Effects::default()),
        };
        wake.lean = most;
        wake
    }

    /// How far (m) it may lie beside its axis at a depth (m), whatever it leans.
    pub(crate) fn lean_offset_m(&self, depth_m: f64) -> f64 {
        self.lean * depth_m
    }

    /// What [`Wake::with_gain`] was given; 1: nothing.
    #[must_use]
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// Whether it is more than the hover jet: then it need not be round, nor below its drone, and
    /// the closed forms of the far field do not hold for it.
    #[must_use]
    pub fn is_shaped(&self) -> bool {
        self.shape.is_some()
    }

    /// Whether both are the same: of one airframe at one mass in the same air, with the same
    /// effects.
    #[must_use]
    pub fn is_same(&self, other: &Wake) -> bool {
        let air = |it: &Wake| (it.shared.density_kg_per_m3, it.shared.jet);
        let own = |it: &Wake| (it.far, it.induced_velocity_mps, it.gain, it.lean);
        let shapes_are_same = match (&self.shape, &other.shape) {
            (None, None) => true,
            (Some(one), Some(other)) => one.is_same(other),
            _ => false,
        };
        own(self) == own(other)
            && air(self) == air(other)
            && self.shared.airframe == other.shared.airframe
            && shapes_are_same
    }

    /// Induced velocity (m/s) of the drone's own rotors, by which its exposure is measured: that of
    /// the jet unless effects make the jet stronger or weaker than the rotors. Never more than the
    /// stated mass asks for.
    #[must_use]
    pub fn hover_velocity_mps(&self) -> f64 {
        match &self.shape {
            None => self.induced_velocity_mps,
            Some(shape) => shape.hover_velocity_mps(),
        }
    }

    /// Radius around the axis (m) within which the far field is faster than half its axis, in the
    /// widest direction of a level cross-section; above 2.5 l that of 2.5 l at least. What must be
    /// covered to stop it. `None` where the wind has taken the jet away.
    #[must_use]
    pub fn spread_m(&self, depth_m: f64) -> Option<f64> {
        let half_width_m = self.half_width_m(depth_m);
        match &self.shape {
            None => Some(half_width_m),
            Some(shape) => shape
                .spread(depth_m / self.length_m)
                .map(|times| times * half_width_m + self.lean_offset_m(depth_m)),
        }
    }

    /// Radius of the near-field column (m): to the rotor tips, wherever above 2.5 l the jet has
    /// been moved and widened to.
    #[must_use]
    pub fn column_radius_m(&self) -> f64 {
        let tips_m = self.tip_radius_m();
        let Some(shape) = &self.shape else {
            return tips_m;
        };
        let levels = (0..=16).map(|k| f64::from(k) / 16.0 * self.far.from_m() / self.length_m);
        let radius_m = levels.filter_map(|s| {
            let [x, y] = shape.axis(s)?;
            let lean_offset_m = self.lean_offset_m(s * self.length_m);
            Some(x.hypot(y) * self.length_m + shape.spread(s)?.max(1.0) * tips_m + lean_offset_m)
        });
        radius_m.fold(tips_m, f64::max)
    }

    /// Where its axis is (m, x and y from the drone) at a depth: below the drone unless wind or
    /// tilt move it. `None` where the wind has taken the jet away.
    #[must_use]
    pub fn axis_m(&self, depth_m: f64) -> Option<[f64; 2]> {
        match &self.shape {
            None => Some([0.0; 2]),
            Some(shape) => shape
                .axis(depth_m / self.length_m)
                .map(|axis| axis.map(|x| x * self.length_m)),
        }
    }

    /// Depth (m) from which on the wind has taken the jet away, and [`Wake::axis_m`] is `None`;
    /// just above it the jet lies nearly level and far downwind. `None`: nowhere.
    #[must_use]
    pub fn gone_from_m(&self) -> Option<f64> {
        let shape = self.shape.as_ref()?;
        shape.gone_from().map(|s| s * self.length_m)
    }

    /// The far field's formula in place of any near field, up to the rotor plane. It is wrong there
    /// (its centreline exceeds what was measured above 2.3 l), so no plan uses it; recordings may
    /// declare it as the simulation they were made against.
    #[must_use]
    pub fn extrapolated(&self) -> Wake {
        Wake {
            far: self.far.extrapolated(),
            ..self.clone()
        }
    }

    fn of(shared: Arc<Shared>, mass_kg: f64) -> Wake {
        let airframe = &shared.airframe;
        let induced_velocity_mps =
            airframe.hover_induced_velocity_mps(mass_kg, shared.density_kg_per_m3);
        let length_m = airframe.motor_distance_m();
        let far = FarField::new(
            induced_velocity_mps,
            length_m,
            airframe.width_factor(),
            &shared.jet,
        );
        Wake {
            far,
            induced_velocity_mps,
            length_m,
            shared,
            shape: None,
            gain: 1.0,
            lean: 0.0,
        }
    }

    /// `U_H` (m/s).
    #[must_use]
    pub fn induced_velocity_mps(&self) -> f64 {
        self.induced_velocity_mps
    }

    /// `l` (m).
    #[must_use]
    pub fn motor_distance_m(&self) -> f64 {
        self.length_m
    }

    /// Radius to the rotor tips (m): that of the near-field column.
    #[must_use]
    pub fn tip_radius_m(&self) -> f64 {
        self.shared.airframe.tip_radius_m()
    }

    /// Depth at which the near field ends and the far field begins (m): 2.5 l.
    #[must_use]
    pub fn near_field_depth_m(&self) -> f64 {
        self.far.from_m()
    }

    /// The airframe that makes it.
    #[must_use]
    pub fn airframe(&self) -> &Airframe {
        &self.shared.airframe
    }

    /// The jet below 2.5 l, with its gradients, fluxes and doses.
    #[must_use]
    pub fn far_field(&self) -> &FarField {
        &self.far
    }

    /// Mean axial speed (m/s) at an offset: 0 or more, downwards; 0 at and above the rotor plane.
    #[must_use]
    #[inline]
    pub fn axial_speed_mps(&self, offset_m: Vector3<f64>) -> f64 {
        if let Some(shape) = &self.shape {
            return -self.gain * shape.velocity_mps(self, offset_m).z;
        }
        self.plain_axial_speed_mps(offset_m)
    }

    #[inline]
    pub(crate) fn plain_axial_speed_mps(&self, offset_m: Vector3<f64>) -> f64 {
        let depth_m = -offset_m.z;
        if depth_m >= self.far.from_m() {
            return self
                .far
                .level(depth_m)
                .axial_speed_mps(offset_m.x * offset_m.x + offset_m.y * offset_m.y);
        }
        self.near_axial_speed_mps(offset_m)
    }

    /// The same above 2.5 l, kept out of the short path.
    fn near_axial_speed_mps(&self, offset_m: Vector3<f64>) -> f64 {
        if offset_m.z >= 0.0 {
            return 0.0;
        }
        match &self.shared.near {
            Some(near) => {
                let [x, y, s] =
                    [offset_m.x, offset_m.y, -offset_m.z].map(|metres| metres / self.length_m);
                self.induced_velocity_mps * near.axial_speed(x, y, s)
            }
            None => {
                let radius2_m2 = offset_m.x * offset_m.x + offset_m.y * offset_m.y;
                self.far
                    .level(self.far.from_m())
                    .axial_speed_mps(radius2_m2)
            }
        }
    }

    /// The wake at one depth (m) below the rotor plane, for many points of it.
    #[must_use]
    #[inline]
    pub fn cross_section(&self, depth_m: f64) -> CrossSection<'_> {
        CrossSection::new(self, depth_m)
    }

    pub(crate) fn near_field(&self) -> Option<&NearField> {
        self.shared.near.as_ref()
    }

    /// Mean velocity (m/s) at an offset, world frame: z negative is down, x and y the radial flow
    /// that continuity asks for (out of the jet's core, into it from outside). Zero at and above
    /// the rotor plane.
    #[must_use]
    pub fn velocity_mps(&self, offset_m: Vector3<f64>) -> Vector3<f64> {
        match &self.shape {
            Some(shape) => shape.velocity_mps(self, offset_m) * self.gain,
            None => self.plain_velocity_mps(offset_m),
        }
    }

    pub(crate) fn plain_velocity_mps(&self, offset_m: Vector3<f64>) -> Vector3<f64> {
        if offset_m.z >= 0.0 {
            return Vector3::zeros();
        }
        let down_mps = self.plain_axial_speed_mps(offset_m);
        let depth_m = -offset_m.z;
        if depth_m >= self.far.from_m() {
            let radius2_m2 = offset_m.x * offset_m.x + offset_m.y * offset_m.y;
            let per_radius = self.far.radial_speed_over_radius_per_s(depth_m, radius2_m2);
            return Vector3::new(per_radius * offset_m.x, per_radius * offset_m.y, -down_mps);
        }
        let [x, y] = match &self.shared.near {
            Some(near) => {
                let [x, y, s] =
                    [offset_m.x, offset_m.y, depth_m].map(|metres| metres / self.length_m);
                near.horizontal_velocity(x, y, s)
                    .map(|v| v * self.induced_velocity_mps)
            }
            None => [0.0; 2],
        };
        Vector3::new(x, y, -down_mps)
    }

    /// Half-width of the jet (m) at a depth below the rotor plane; above 2.5 l that of 2.5 l. What
    /// must be covered to stop it.
    #[must_use]
    pub fn half_width_m(&self, depth_m: f64) -> f64 {
        let from_m = self.far.from_m();
        let depth_m = if depth_m > from_m { depth_m } else { from_m };
        self.far.half_width_m(depth_m).unwrap_or(f64::NAN)
    }

    /// Speed on the axis (m/s) of the far field; `None` above 2.5 l.
    #[must_use]
    pub fn centreline_mps(&self, depth_m: f64) -> Option<f64> {
        self.far.centreline_mps(depth_m)
    }

    /// Radius (m) within which the far field exceeds a speed: the iso-speed volume. `None` above
    /// 2.5 l and below its tip.
    #[must_use]
    pub fn radius_at_speed_m(&self, depth_m: f64, speed_mps: f64) -> Option<f64> {
        self.far.radius_at_speed_m(depth_m, speed_mps)
    }

    /// Radius (m) beyond which no air exceeds a speed, at any azimuth: in the far field where it
    /// does, above 2.5 l a bound; 0 where there is none so fast. Of the hover jet alone.
    #[must_use]
    pub fn reach_at_speed_m(&self, depth_m: f64, speed_mps: f64) -> f64 {
        let from_m = self.far.from_m();
        match &self.shared.near {
            Some(near) if depth_m < from_m => {
                let speed = speed_mps / self.induced_velocity_mps;
                self.length_m * near.level(depth_m / self.length_m).reach_at_speed(speed)
            }
            _ => {
                let radius_m = self.radius_at_speed_m(depth_m.max(from_m), speed_mps);
                radius_m.unwrap_or(0.0)
            }
        }
    }

    /// Depth (m) below which no far-field point exceeds `speed_mps`: where the axis has slowed to
    /// it, and 2.5 l where all of the far field is slower. Infinite for a speed of 0.
    #[must_use]
    pub fn iso_speed_end_m(&self, speed_mps: f64) -> f64 {
        self.far
            .iso_speed_end_m(speed_mps)
            .unwrap_or(self.far.from_m())
    }
}
