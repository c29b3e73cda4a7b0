//! Density of the air from its temperature and pressure.

/// Standard gravity as the paper rounds it (m/s²); the weight that a hovering drone's thrust
/// carries.
pub const GRAVITY_MPS2: f64 = 9.81;

/// Molar mass `M` of dry air (kg/mol), as the paper uses it.
const MOLAR_MASS_KG_PER_MOL: f64 = 0.028966;

/// Universal gas constant `R` (J/(mol K)), as the paper rounds it.
const GAS_CONSTANT_J_PER_MOL_K: f64 = 8.3144;

/// 0 °C in kelvin.
const ZERO_CELSIUS_K: f64 = 273.15;

/// Temperature and pressure of still, dry air: one density for the whole scene.
///
/// ```
/// let summer_in_madrid = airflow::Air { temperature_c: 35.0, pressure_pa: 94_000.0 };
/// assert!((summer_in_madrid.density_kg_per_m3() - 1.063).abs() < 1e-3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Temperature (°C), above absolute zero.
    pub temperature_c: f64,
    /// Absolute pressure (Pa), above 0; not reduced to sea level.
    pub pressure_pa: f64,
}

/// What makes temperature or pressure unusable.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AirError {
    /// At or below absolute zero, or not a number.
    #[error("temperature_c is {0} °C; it must be finite and above -273.15")]
    Temperature(f64),
    /// Vacuum, or not a number.
    #[error("pressure_pa is {0} Pa; it must be finite and above 0")]
    Pressure(f64),
}

impl Air {
    /// Density `ρ` (kg/m³) of an ideal gas; only as good as [`Air::problems`] is empty.
    ///
    /// ```text
    /// ρ = p M / (R T)
    /// ```
    #[must_use]
    pub fn density_kg_per_m3(&self) -> f64 {
        let temperature_k = self.temperature_c + ZERO_CELSIUS_K;
        self.pressure_pa * MOLAR_MASS_KG_PER_MOL / (GAS_CONSTANT_J_PER_MOL_K * temperature_k)
    }

    /// Everything that is wrong with it; empty when it can be used.
    #[must_use]
    pub fn problems(&self) -> Vec<AirError> {
        let mut problems = Vec::new();
        if !(self.temperature_c.is_finite() && self.temperature_c > -ZERO_CELSIUS_K) {
            problems.push(AirError::Temperature(self.temperature_c));
        }
        if !(self.pressure_pa.is_finite() && self.pressure_pa > 0.0) {
            problems.push(AirError::Pressure(self.pressure_pa));
        }
        problems
    }
}

/// The standard atmosphere at sea level and 20 °C, 1.204 kg/m³: the air behind the paper's table of
/// airframes.
impl Default for Air {
    fn default() -> Air {
        Air {
            temperature_c: 20.0,
            pressure_pa: 101_325.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_air_has_the_density_behind_the_papers_table() {
        // 1.2042 by hand from p M / (R T); half of its last digit.
        assert!((Air::default().density_kg_per_m3() - 1.2042).abs() < 5e-5);
    }

    #[test]
    fn each_unusable_number_is_named() {
        let broken = Air {
            temperature_c: -300.0,
            pressure_pa: f64::NAN,
        };
        let words: Vec<String> = broken.problems().iter().map(ToString::to_string).collect();
        assert_eq!(words.len(), 2);
        assert!(words[0].starts_with("temperature_c is -300"));
        assert!(words[1].starts_with("pressure_pa is NaN"));
        assert!(Air::default().problems().is_empty());
    }
}
