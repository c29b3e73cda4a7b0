//! One jet with what the hover jet leaves out, as a function of the place below its drone.

use nalgebra::Vector3;

use crate::airframe::Airframe;
use crate::effects::{Effects, Plume};
use crate::far_field::FarField;
use crate::jet::{FAR_FIELD_FROM_S_OVER_L, Jet};
use crate::near_field::NearField;
use crate::wake::Wake;

/// Distances from the axis at which humps of a profile are looked for, in half-widths: steps, and
/// how many. Chosen here: a jet of one rotor is half as wide, and between two steps within a
/// hundredth of its peak; beyond two half-widths every profile falls.
const HUMP_STEP: f64 = 0.05;
const HUMP_STEPS: u32 = 40;

/// Steady effects made ready for one drone.
#[derive(Debug)]
pub(crate) struct Shape {
    effects: Effects,
    plain_mps: f64,
    origin: f64,
    /// The bent jet, and the wind's direction.
    plume: Option<(Plume, [f64; 2])>,
    /// The four-rotor field that replaces an extrapolated one.
    near: Option<NearField>,
}

/// Where the axis is at a depth and what the jet has become there; lengths in `l`.
struct JetSection {
    axis: [f64; 2],
    width: f64,
    speed: f64,
    /// Sine and cosine of the tilt towards the wind.
    tilt: [f64; 2],
}

impl Shape {
    /// Whether both are of the same effects, for wakes of one airframe at one mass: the rest
    /// follows from these.
    pub(crate) fn is_same(&self, other: &Shape) -> bool {
        let of = |it: &Shape| (it.effects, it.plain_mps, it.origin);
        of(self) == of(other)
    }

    /// Factor of all scale effects on `U_H`; that of a payload taken up in flight is
    /// of [`crate::Surroundings::velocity_mps`].
    pub(crate) fn strength(effects: &Effects, diameter_over_l: f64) -> f64 {
        let payload = effects.payload_mass.filter(|payload| payload.is_constant());
        payload.map_or(1.0, |payload| payload.factor(0.0))
            * effects
                .momentum_scale
                .map_or(1.0, |effect| effect.speed_factor)
            * effects.air_density.map_or(1.0, |effect| effect.factor())
            * effects
                .dl_ratio
                .map_or(1.0, |effect| effect.factor(diameter_over_l))
    }

    pub(crate) fn new(
        effects: &Effects,
        plain_mps: f64,
        induced_velocity_mps: f64,
        airframe: &Airframe,
        jet: &Jet,
    ) -> Shape {
        let plume = effects.crossflow.map(|crossflow| {
            let [x, y] = crossflow.wind_mps;
            let wind_mps = x.hypot(y);
            let towards = if wind_mps > 0.0 {
                [x / wind_mps, y / wind_mps]
            } else {
                [1.0, 0.0]
            };
            (Plume::new(jet, wind_mps / induced_velocity_mps), towards)
        });
        let near = effects
            .near_field
            .filter(|_| airframe.has_near_field_model())
            .map(|near| {
                let diameter_over_l = airframe.propeller_diameter_m() / airframe.motor_distance_m();
                NearField::new(diameter_over_l, airframe.width_factor(), jet, near.shadow())
            });
        Shape {
            effects: *effects,
            plain_mps,
            origin: jet.origin,
            plume,
            near,
        }
    }

    pub(crate) fn effects(&self) -> &Effects {
        &self.effects
    }

    /// `U_H` (m/s) without any effect.
    pub(crate) fn plain_induced_velocity_mps(&self) -> f64 {
        self.plain_mps
    }

    /// `U_H` (m/s) of the drone's own rotors.
    pub(crate) fn hover_velocity_mps(&self) -> f64 {
        self.plain_mps * Shape::of_rotors(&self.effects)
    }

    /// Factor on `U_H` of a drone's own rotors. Density changes it; a payload found that is carried
    /// on counts where it lowers it, since a finding may be about another drone of the fleet.
    pub(crate) fn of_rotors(effects: &Effects) -> f64 {
        let payload = effects
            .payload_mass
            .map_or(1.0, |payload| payload.factor(f64::MAX).min(1.0));
        payload * effects.air_density.map_or(1.0, |effect| effect.factor())
    }

    /// Widening along the longest direction of a level cross-section, over the jet in still air.
    pub(crate) fn spread(&self, s: f64) -> Option<f64> {
        let section = self.section(s)?;
        let [_, cos] = section.tilt;
        Some(section.width / cos.max(1e-3))
    }

    /// The axis (l) at a depth (l).
    pub(crate) fn axis(&self, s: f64) -> Option<[f64; 2]> {
        Some(self.section(s)?.axis)
    }

    /// Depth (l) from which on there is no jet.
    pub(crate) fn gone_from(&self) -> Option<f64> {
        self.plume.as_ref()?.0.gone_from()
    }

    fn section(&self, s: f64) -> Option<JetSection> {
        let effects = &self.effects;
        let mut axis = effects.wake_tilt.map_or([0.0; 2], |tilt| tilt.shift(s));
        let (mut width, mut speed, mut tilt) = (1.0, 1.0, [0.0, 1.0]);
        if let Some((plume, towards)) = &self.plume {
            let section = plume.at(s)?;
            axis = [
                axis[0] + section.drift * towards[0],
                axis[1] + section.drift * towards[1],
            ];
            (width, speed, tilt) = (section.width, section.speed, section.tilt);
        }
        let cant = effects.rotor_cant.map(|cant| cant.factors());
        let wander = effects.wander.map(|wander| wander.factors(s, self.origin));
        for [wider, faster] in [cant, wander].into_iter().flatten() {
            width *= wider;
            speed *= faster;
        }
        speed *= effects.buoyancy.map_or(1.0, |buoyancy| buoyancy.factor(s));
        Some(JetSection {
            axis,
            width,
            speed,
            tilt,
        })
    }

    /// Velocity (m/s, world) at an offset (m) from the rotor centre; zero at and above the rotor
    /// plane, and where the wind has taken the jet away. The wind itself is not in it.
    pub(crate) fn velocity_mps(&self, wake: &Wake, offset_m: Vector3<f64>) -> Vector3<f64> {
        let length_m = wake.motor_distance_m();
        let s = -offset_m.z / length_m;
        if s <= 0.0 {
            return Vector3::zeros();
        }
        let Some(section) = self.section(s) else {
            return Vector3::zeros();
        };
        let [sin, cos] = section.tilt;
        let towards = self
            .plume
            .as_ref()
            .map_or([1.0, 0.0], |(_, towards)| *towards);
        let from_axis = [
            offset_m.x - section.axis[0] * length_m,
            offset_m.y - section.axis[1] * length_m,
        ];
        // The cross-section normal to a leaning axis is shorter along the wind than the level one.
        let along = from_axis[0] * towards[0] + from_axis[1] * towards[1];
        let shortened = along * (cos - 1.0);
        let place_m = Vector3::new(
            (from_axis[0] + shortened * towards[0]) / section.width,
            (from_axis[1] + shortened * towards[1]) / section.width,
            offset_m.z,
        );
        let lean_offset_m = wake.lean_offset_m(s * length_m) / section.width;
        let place_m = match lean_offset_m {
            0.0 => place_m,
            _ => self.fastest_near(wake, place_m, lean_offset_m),
        };
        let radius_m = place_m.xy().norm();
        let plain_mps = wake.plain_velocity_mps(place_m);
        let axial_mps = section.speed * self.profile_mps(wake, place_m, radius_m, -plain_mps.z);
        let entrained = self
            .effects
            .entrainment_radial
            .map_or(1.0, |effect| effect.factor);
        let mut velocity_mps = Vector3::new(
            axial_mps * sin * towards[0] + entrained * section.speed * section.width * plain_mps.x,
            axial_mps * sin * towards[1] + entrained * section.speed * section.width * plain_mps.y,
            -axial_mps * cos,
        );
        if let Some(swirl) = self.effects.swirl {
            let far = wake.far_field();
            let depth_m = -place_m.z;
            let xi = radius_m / wake.half_width_m(depth_m);
            let centreline_mps = far.extrapolated().centreline_mps(depth_m).unwrap_or(0.0);
            let around_mps = centreline_mps * swirl.speed(xi, s, self.origin);
            if radius_m > 0.0 {
                velocity_mps += Vector3::new(-place_m.y, place_m.x, 0.0) * (around_mps / radius_m);
            }
        }
        velocity_mps
    }

    /// The place (m) of the undeformed jet where it is fastest among those at most so far away at
    /// the same depth: the nearest to the axis, or one between it and the farthest where the
    /// profile has a hump, at any bearing.
    fn fastest_near(&self, wake: &Wake, place_m: Vector3<f64>, away_m: f64) -> Vector3<f64> {
        let (radius_m, depth_m) = (place_m.xy().norm(), -place_m.z);
        let nearest_m = (radius_m - away_m).max(0.0);
        let is_near = depth_m < wake.near_field_depth_m();
        // The four rotors are fastest on the diagonals.
        let [x, y] = match radius_m {
            _ if is_near => [std::f64::consts::FRAC_1_SQRT_2; 2],
            0.0 => [1.0, 0.0],
            _ => [place_m.x / radius_m, place_m.y / radius_m],
        };
        let at = |radius_m: f64| Vector3::new(x * radius_m, y * radius_m, place_m.z);
        let has_humps = is_near || self.effects.profile_tail.is_some();
        if !has_humps {
            return at(nearest_m);
        }
        let with_speed = |radius_m: f64| {
            let plain_mps = wake.plain_axial_speed_mps(at(radius_m));
            (
                self.profile_mps(wake, at(radius_m), radius_m, plain_mps),
                radius_m,
            )
        };
        let step_m = HUMP_STEP * wake.half_width_m(depth_m);
        let humps_m = (1..=HUMP_STEPS).map(|step| f64::from(step) * step_m);
        let within_m = humps_m.filter(|m| (nearest_m..radius_m + away_m).contains(m));
        let ends_m = [nearest_m, radius_m + away_m];
        let speeds = ends_m.into_iter().chain(within_m).map(with_speed);
        let fastest = speeds.reduce(|best, next| if next.0 > best.0 { next } else { best });
        at(fastest.map_or(nearest_m, |(_, radius_m)| radius_m))
    }

    /// Axial speed (m/s) of the undeformed jet with its own profile: another edge, another near
    /// field.
    fn profile_mps(
        &self,
        wake: &Wake,
        place_m: Vector3<f64>,
        radius_m: f64,
        plain_mps: f64,
    ) -> f64 {
        let depth_m = -place_m.z;
        let s = depth_m / wake.motor_distance_m();
        let far: FarField = wake.far_field().extrapolated();
        let mut axial_mps = plain_mps;
        if let Some(tail) = self.effects.profile_tail {
            let xi = radius_m / far.half_width_m(depth_m).unwrap_or(f64::INFINITY);
            let centreline_mps = far.centreline_mps(depth_m).unwrap_or(0.0);
            let algebraic = far.axial_speed_mps(depth_m, radius_m).unwrap_or(0.0);
            // In the four-rotor field the edge changes by as much as the far field's would.
            axial_mps += tail.profile(xi, algebraic / centreline_mps) * centreline_mps - algebraic;
        }
        if let (Some(effect), Some(near)) = (self.effects.near_field, &self.near)
            && s < FAR_FIELD_FROM_S_OVER_L
        {
            let [x, y] = [place_m.x, place_m.y].map(|metres| metres / wake.motor_distance_m());
            let four_mps = wake.induced_velocity_mps() * near.axial_speed(x, y, s);
            axial_mps += effect.share * (four_mps - plain_mps);
        }
        axial_mps.max(0.0)
    }
}
