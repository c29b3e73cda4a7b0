//! What an airframe is to the air: mass, propellers, motor distance; and the six of the paper by
//! name.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use crate::air::GRAVITY_MPS2;
use crate::discs::DiscPoints;

/// Depths to which the jet was measured (motor distances), below small drones (Kolibri) and below
/// the largest (Matrice 300): Bauersfeld et al., "Robotics meets Fluid Dynamics", RA-L 2025.
const MEASURED_TO_L: [f64; 2] = [25.0, 5.0];

/// Width factors that are accepted. Chosen here: cant changes the width of the paper's two canted
/// drones "slightly" (0.9 and 1.15 below), and half or double the width would no longer be the same
/// flow.
pub const WIDTH_FACTOR_RANGE: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// A multirotor reduced to what its wake depends on. Every number in it has been checked.
///
/// Level attitude, yaw 0, x forward: rotor hubs at radius `l/2`, azimuth 45° + k 360°/N.
#[derive(Clone, Debug, PartialEq)]
pub struct Airframe {
    name: String,
    mass_kg: f64,
    propellers: u32,
    propeller_diameter_m: f64,
    motor_distance_m: f64,
    width_factor: f64,
}

/// An airframe that no preset has, by its name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no airframe is called `{0}`; known are {known}", known = Airframe::PRESETS.join(", "))]
pub struct NoSuchAirframe(pub String);

/// Why numbers do not make an airframe.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AirframeError {
    /// A mass or a length that is zero, negative, infinite or not a number.
    #[error("{field} is {value}; it must be finite and above 0")]
    NotPositive {
        /// The field at fault, its unit at the end.
        field: &'static str,
        /// What it held.
        value: f64,
    },
    /// Nothing that could lift it.
    #[error("propellers is 0; it must be at least 1")]
    NoPropeller,
    /// A jet far narrower or wider than any that was measured.
    #[error("width_factor is {value}; it must lie between {} and {}", WIDTH_FACTOR_RANGE.start(), WIDTH_FACTOR_RANGE.end())]
    WidthFactor {
        /// What it held.
        value: f64,
    },
}

impl AirframeError {
    /// The field at fault, as the constructor calls it.
    #[must_use]
    pub fn field(&self) -> &'static str {
        match self {
            AirframeError::NotPositive { field, .. } => field,
            AirframeError::NoPropeller => "propellers",
            AirframeError::WidthFactor { .. } => "width_factor",
        }
    }
}

/// name, mass (kg), propellers, propeller diameter (m), motor distance (m), width factor.
type Preset = (&'static str, f64, u32, f64, f64, f64);

/// The first six: the paper's table of drones. Their width factors are 1 where the propellers are
/// not canted; 0.9 (inward) and 1.15 (outward) are chosen here, because the paper shows a slightly
/// narrower and a wider jet and gives no number. Crazyflie 2.1: masses and lengths as its maker and
/// its users state them (bare, and with a positioning deck).
const PRESETS: [Preset; 8] = [
    ("kolibri", 0.230, 4, 0.0737, 0.118, 1.0),
    ("offboard-1", 0.572, 4, 0.1295, 0.266, 1.0),
    ("offboard-2", 1.207, 4, 0.1295, 0.266, 1.0),
    ("matrice-300", 6.300, 4, 0.5334, 0.894, 1.0),
    ("mavic-3e", 0.958, 4, 0.2388, 0.385, 0.9),
    ("elios-3", 2.398, 4, 0.1270, 0.275, 1.15),
    ("crazyflie-2.1", 0.027, 4, 0.0462, 0.092, 1.0),
    ("crazyflie-2.1-deck", 0.034, 4, 0.0462, 0.092, 1.0),
];

impl Airframe {
    /// The names that [`Airframe::preset`] knows: the six of the paper in its order, then Crazyflie
    /// 2.1 bare and with a deck.
    pub const PRESETS: [&str; 8] = {
        let mut names = [""; 8];
        let mut i = 0;
        while i < 8 {
            names[i] = PRESETS[i].0;
            i += 1;
        }
        names
    };

    /// An airframe from its numbers. `motor_distance_m` is the paper's `l`, the *diagonal* from
    /// motor to motor; `width_factor` is 1 for propellers that are not canted (see
    /// [`Airframe::width_factor`]).
    ///
    /// # Errors
    /// The first problem in the order of the arguments; [`Airframe::problems`] lists all of them.
    pub fn new(
        name: impl Into<String>,
        mass_kg: f64,
        propellers: u32,
        propeller_diameter_m: f64,
        motor_distance_m: f64,
        width_factor: f64,
    ) -> Result<Airframe, AirframeError> {
        let name = name.into();
        let airframe = Airframe {
            name,
            mass_kg,
            propellers,
            propeller_diameter_m,
            motor_distance_m,
            width_factor,
        };
        match Airframe::problems(
            mass_kg,
            propellers,
            propeller_diameter_m,
            motor_distance_m,
            width_factor,
        )
        .first()
        {
            None => Ok(airframe),
            Some(&problem) => Err(problem),
        }
    }

    /// Everything that keeps these numbers from being an airframe, in the order of the arguments;
    /// empty when nothing does.
    #[must_use]
    pub fn problems(
        mass_kg: f64,
        propellers: u32,
        propeller_diameter_m: f64,
        motor_distance_m: f64,
        width_factor: f64,
    ) -> Vec<AirframeError> {
        let not_positive = |field, value: f64| {
            let usable = value.is_finite() && value > 0.0;
            (!usable).then_some(AirframeError::NotPositive { field, value })
        };
        [
            not_positive("mass_kg", mass_kg),
            (propellers == 0).then_some(AirframeError::NoPropeller),
            not_positive("propeller_diameter_m", propeller_diameter_m),
            not_positive("motor_distance_m", motor_distance_m),
            (!WIDTH_FACTOR_RANGE.contains(&width_factor)).then_some(AirframeError::WidthFactor {
                value: width_factor,
            }),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// One of [`Airframe::PRESETS`] by name, or `None`.
    #[must_use]
    pub fn preset(name: &str) -> Option<Airframe> {
        let &(name, mass_kg, propellers, propeller_diameter_m, motor_distance_m, width_factor) =
            PRESETS.iter().find(|preset| preset.0 == name)?;
        let name = name.to_owned();
        Some(Airframe {
            name,
            mass_kg,
            propellers,
            propeller_diameter_m,
            motor_distance_m,
            width_factor,
        })
    }

    /// The same, with what to say where there is none.
    ///
    /// # Errors
    /// No preset has that name.
    pub fn named(name: &str) -> Result<Airframe, NoSuchAirframe> {
        Airframe::preset(name).ok_or_else(|| NoSuchAirframe(name.to_owned()))
    }

    /// What messages call it.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Mass without payload (kg).
    #[must_use]
    pub fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    /// Number of propellers `N_P`.
    #[must_use]
    pub fn propellers(&self) -> u32 {
        self.propellers
    }

    /// Propeller diameter `d` (m).
    #[must_use]
    pub fn propeller_diameter_m(&self) -> f64 {
        self.propeller_diameter_m
    }

    /// Diagonal distance `l` from motor to motor (m): the length scale of the jet.
    #[must_use]
    pub fn motor_distance_m(&self) -> f64 {
        self.motor_distance_m
    }

    /// Factor `q` on the half-width of the far field; the centreline is divided by it, so the
    /// momentum stays. 1: not canted.
    #[must_use]
    pub fn width_factor(&self) -> f64 {
        self.width_factor
    }

    /// Whether the paper's fit leaves this airframe out: its propellers are canted, so its width
    /// factor is not 1 and its jet is an estimate. True of `mavic-3e` and `elios-3`.
    #[must_use]
    pub fn fit_excludes(&self) -> bool {
        self.width_factor != 1.0
    }

    /// What to tell of an airframe that the paper's fit leaves out; `None` of the others.
    #[must_use]
    pub fn fit_note(&self) -> Option<String> {
        let (name, factor) = (self.name(), self.width_factor);
        self.fit_excludes().then(|| {
            format!(
                "the jet's fit excludes {name}; its width factor {factor} is chosen, not measured"
            )
        })
    }

    /// To what depth the jet was measured, in metres below this drone.
    #[must_use]
    pub fn measured_note(&self) -> String {
        let [small_m, large_m] = MEASURED_TO_L.map(|of_l| of_l * self.motor_distance_m);
        let [small, large] = MEASURED_TO_L;
        format!(
            "The jet was measured to about {small} motor distances below small drones and {large} \
             below the largest ({small_m:.1} m and {large_m:.1} m below {}); further down it is \
             the same formula, unmeasured.",
            self.name()
        )
    }

    /// Whether the four-rotor near field describes it. Other rotor counts get the far-field profile
    /// of 2.5 l held up to the rotor plane (see [`crate::Wake`]).
    #[must_use]
    pub fn has_near_field_model(&self) -> bool {
        self.propellers == 4
    }

    /// Distance from the centre to the rotor tips (m), `l/2 + d/2`: body radius and radius of the
    /// near-field column.
    #[must_use]
    pub fn tip_radius_m(&self) -> f64 {
        0.5 * (self.motor_distance_m + self.propeller_diameter_m)
    }

    /// Area `A` swept by all propellers together (m²), `N_P π (d/2)²`.
    #[must_use]
    pub fn disc_area_m2(&self) -> f64 {
        let radius_m = 0.5 * self.propeller_diameter_m;
        f64::from(self.propellers) * PI * radius_m * radius_m
    }

    /// Velocity `U_H` (m/s) that the rotors induce at their plane in hover at `mass_kg`, payload
    /// included.
    ///
    /// ```text
    /// U_H = √( m g / (2 ρ A) )
    /// ```
    #[must_use]
    pub fn hover_induced_velocity_mps(&self, mass_kg: f64, density_kg_per_m3: f64) -> f64 {
        (mass_kg * GRAVITY_MPS2 / (2.0 * density_kg_per_m3 * self.disc_area_m2())).sqrt()
    }

    /// Ideal power (W) to hover in still air at `mass_kg`: thrust times induced velocity,
    /// `m g U_H`. The battery pays this divided by the figure of merit and the efficiency of the
    /// drive.
    #[must_use]
    pub fn hover_power_w(&self, mass_kg: f64, density_kg_per_m3: f64) -> f64 {
        mass_kg * GRAVITY_MPS2 * self.hover_induced_velocity_mps(mass_kg, density_kg_per_m3)
    }

    /// Hub of rotor `k` as an offset (x, y) from the centre (m). A single rotor sits on the centre.
    fn hub_m(&self, k: u32) -> [f64; 2] {
        if self.propellers == 1 {
            return [0.0, 0.0];
        }
        let azimuth = FRAC_PI_4 + f64::from(k) * TAU / f64::from(self.propellers);
        let radius_m = 0.5 * self.motor_distance_m;
        [radius_m * azimuth.cos(), radius_m * azimuth.sin()]
    }

    /// Points over its rotor discs for the mean of the axial speed over them: seven a disc, exact
    /// for polynomials of degree 5.
    #[must_use]
    pub fn disc_points(&self) -> DiscPoints {
        let hubs_m: Vec<[f64; 2]> = (0..self.propellers).map(|k| self.hub_m(k)).collect();
        DiscPoints::seven_per_disc(&hubs_m, 0.5 * self.propeller_diameter_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_name_is_known_and_passes_its_own_checks() {
        for name in Airframe::PRESETS {
            let a = Airframe::preset(name).expect("listed");
            let again = Airframe::new(
                a.name(),
                a.mass_kg(),
                a.propellers(),
                a.propeller_diameter_m(),
                a.motor_distance_m(),
                a.width_factor(),
            );
            assert_eq!(again, Ok(a));
        }
        assert_eq!(Airframe::preset("Kolibri"), None);
    }

    #[test]
    fn every_bad_number_is_named_at_once() {
        let problems = Airframe::problems(f64::NAN, 0, -1.0, f64::INFINITY, 3.0);
        let fields: Vec<&str> = problems.iter().map(AirframeError::field).collect();
        assert_eq!(
            fields,
            [
                "mass_kg",
                "propellers",
                "propeller_diameter_m",
                "motor_distance_m",
                "width_factor"
            ]
        );
        assert_eq!(
            problems[2].to_string(),
            "propeller_diameter_m is -1; it must be finite and above 0"
        );
        assert_eq!(
            problems[4].to_string(),
            "width_factor is 3; it must lie between 0.5 and 2"
        );
        assert!(Airframe::new("x", 0.0, 4, 0.1, 0.2, 1.0).is_err());
    }

    #[test]
    fn only_the_canted_drones_are_left_out_of_the_fit() {
        let excluded: Vec<&str> = Airframe::PRESETS
            .into_iter()
            .filter(|name| Airframe::preset(name).expect("listed").fit_excludes())
            .collect();
        assert_eq!(excluded, ["mavic-3e", "elios-3"]);
    }

    #[test]
    fn disc_points_of_a_quadrotor_stand_around_its_diagonal_hubs() {
        let airframe = Airframe::preset("offboard-2").expect("listed");
        let discs = airframe.disc_points();
        assert_eq!(discs.offsets_m.len(), 28);
        let hub_m = 0.266 / 2.0 * 0.5_f64.sqrt();
        for (disc, sign) in [
            (0, [1.0, 1.0]),
            (1, [-1.0, 1.0]),
            (2, [-1.0, -1.0]),
            (3, [1.0, -1.0]),
        ] {
            let centre = discs.offsets_m[7 * disc];
            // Rounding of sine and cosine.
            assert!(
                (centre[0] - sign[0] * hub_m).abs() < 1e-15
                    && (centre[1] - sign[1] * hub_m).abs() < 1e-15
            );
        }
    }

    #[test]
    fn hover_power_is_weight_times_induced_velocity() {
        let airframe = Airframe::preset("kolibri").expect("listed");
        // 0.230 kg · 9.81 m/s² · 7.410 m/s, to the rounding of the last factor.
        assert!((airframe.hover_power_w(0.230, 1.204) - 16.72).abs() < 0.02);
    }
}
