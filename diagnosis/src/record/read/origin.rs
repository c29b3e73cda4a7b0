//! Where logs that were written together have their places from, so that they can be brought into
//! one frame.

use nalgebra::Vector3;

/// A point of the Earth that a log states, and where that lies in its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Origin {
    pub(super) latitude_deg: f64,
    pub(super) longitude_deg: f64,
    /// `None`: not stated.
    pub(super) altitude_m: Option<f64>,
    /// x north, y west, z up.
    pub(super) at_m: Vector3<f64>,
}

/// Equatorial radius (m) and square of the eccentricity of the ellipsoid (WGS 84).
const EQUATOR_M: f64 = 6_378_137.0;
const ECCENTRICITY2: f64 = 6.694_379_990_14e-3;

impl Origin {
    /// `None` for a point that no log means: not finite, or the zeros that stand for none.
    pub(super) fn new(
        [latitude_deg, longitude_deg]: [f64; 2],
        altitude_m: Option<f64>,
        at_m: Vector3<f64>,
    ) -> Option<Origin> {
        let is_set = latitude_deg != 0.0 || longitude_deg != 0.0;
        let is_point = is_set && latitude_deg.abs() <= 90.0 && longitude_deg.is_finite();
        let is_placed = at_m.iter().all(|m| m.is_finite());
        (is_point && is_placed).then_some(Origin {
            latitude_deg,
            longitude_deg,
            altitude_m: altitude_m.filter(|height_m| height_m.is_finite()),
            at_m,
        })
    }

    /// What is to be added to places of its log to have them in the frame of `first`: a plane at
    /// its latitude, which a kilometre off is 8 cm too high.
    pub(super) fn shift_m(&self, first: &Origin) -> Vector3<f64> {
        let (sine, cosine) = first.latitude_deg.to_radians().sin_cos();
        let squeezed = 1.0 - ECCENTRICITY2 * sine * sine;
        let across_m = EQUATOR_M / squeezed.sqrt();
        let along_m = across_m * (1.0 - ECCENTRICITY2) / squeezed;
        let north = self.latitude_deg - first.latitude_deg;
        let east = self.longitude_deg - first.longitude_deg;
        let east = (east + 180.0).rem_euclid(360.0) - 180.0;
        let heights_m = self.altitude_m.zip(first.altitude_m);
        let apart_m = Vector3::new(
            along_m * north.to_radians(),
            -across_m * cosine * east.to_radians(),
            heights_m.map_or(0.0, |(own_m, first_m)| own_m - first_m),
        );
        apart_m + first.at_m - self.at_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_degree_is_as_long_as_on_the_ellipsoid() {
        let at =
            |place_deg| Origin::new(place_deg, Some(100.0), Vector3::zeros()).expect("a point");
        // NGA.STND.0036 (WGS 84): at 45 degrees 111 131.8 m north and 78 846.8 m east.
        let first = at([45.0, 179.999_95]);
        let shift_m = at([45.000_1, -179.999_95]).shift_m(&first);
        let known_m = Vector3::new(11.113_18, -7.884_68, 0.0);
        assert!((shift_m - known_m).norm() < 1e-4, "{shift_m}");
        for unset in [[0.0, 0.0], [f64::NAN, 8.0], [91.0, 8.0]] {
            assert_eq!(Origin::new(unset, None, Vector3::zeros()), None);
        }
    }
}
