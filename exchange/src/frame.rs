//! Which axes a file has, and where the world's lie in them.

use nalgebra::{Point3, Vector3};
use planner::plan::Origin;

/// Heading of the world's +x where none is given (deg, clockwise from north): x points east and y
/// north, so that the world is its own ENU frame (REP 103's convention).
pub const HEADING_DEFAULT_DEG: f64 = 90.0;

/// The axes of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axes {
    /// North, east, down: PX4's local frame.
    #[default]
    Ned,
    /// East, north, up: REP 103, MAVROS.
    Enu,
}

impl Axes {
    /// As a manifest has it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Axes::Ned => "ned",
            Axes::Enu => "enu",
        }
    }
}

/// The world as a file's axes see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Of the file.
    pub axes: Axes,
    /// Heading of the world's +x (deg, clockwise from north).
    pub heading_deg: f64,
}

impl Frame {
    /// Sine and cosine of the heading; exact at whole quarters of a turn.
    fn turn(&self) -> (f64, f64) {
        let quarters = self.heading_deg / 90.0;
        if quarters.fract() == 0.0 {
            return match quarters.rem_euclid(4.0) as u8 {
                0 => (0.0, 1.0),
                1 => (1.0, 0.0),
                2 => (0.0, -1.0),
                _ => (-1.0, 0.0),
            };
        }
        self.heading_deg.to_radians().sin_cos()
    }

    /// A vector of the world along the file's axes.
    #[must_use]
    pub fn from_world(&self, v: Vector3<f64>) -> Vector3<f64> {
        let (sin, cos) = self.turn();
        let (east, north) = (v.x * sin - v.y * cos, v.x * cos + v.y * sin);
        match self.axes {
            Axes::Ned => Vector3::new(north, east, -v.z),
            Axes::Enu => Vector3::new(east, north, v.z),
        }
    }

    /// A vector along the file's axes in the world.
    #[must_use]
    pub fn to_world(&self, v: Vector3<f64>) -> Vector3<f64> {
        let (sin, cos) = self.turn();
        let (east, north, up) = match self.axes {
            Axes::Ned => (v.y, v.x, -v.z),
            Axes::Enu => (v.x, v.y, v.z),
        };
        Vector3::new(east * sin + north * cos, north * sin - east * cos, up)
    }

    /// Yaw of a drone that faces the world's +x, as the file counts it (rad, -pi to pi): in NED
    /// from north clockwise, in ENU from east anticlockwise.
    #[must_use]
    pub fn yaw_rad(&self) -> f64 {
        let yaw_rad = match self.axes {
            Axes::Ned => self.heading_deg.to_radians(),
            Axes::Enu => (90.0 - self.heading_deg).to_radians(),
        };
        let turn = std::f64::consts::TAU;
        yaw_rad - turn * (yaw_rad / turn).round()
    }
}

/// Where the world lies on the Earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Georeference {
    /// Of (0, 0, 0) (deg, north positive).
    pub latitude_deg: f64,
    /// Of (0, 0, 0) (deg, east positive).
    pub longitude_deg: f64,
    /// Height of (0, 0, 0) above mean sea level (m).
    pub altitude_m: f64,
    /// Heading of +x (deg, clockwise from north).
    pub heading_deg: f64,
}

/// Semi-major axis of WGS 84 (m; NIMA TR8350.2).
const WGS84_MAJOR_M: f64 = 6_378_137.0;
/// Flattening of WGS 84 (NIMA TR8350.2).
const WGS84_FLATTENING: f64 = 1.0 / 298.257_223_563;

impl Georeference {
    /// From latitude, longitude (deg), altitude (m) and heading (deg), in this order.
    ///
    /// # Errors
    ///
    /// What lies outside its range; near the poles east has no meaning.
    pub fn new(numbers: [f64; 4]) -> Result<Georeference, String> {
        for (what, value, low, high) in [
            ("the latitude", numbers[0], -85.0, 85.0),
            ("the longitude", numbers[1], -180.0, 180.0),
            ("the altitude", numbers[2], -500.0, 9000.0),
            ("the heading", numbers[3], -360.0, 360.0),
        ] {
            if !(low..=high).contains(&value) {
                return Err(format!("{what} must lie within {low} to {high}"));
            }
        }
        let [latitude_deg, longitude_deg, altitude_m, heading_deg] = numbers;
        Ok(Georeference {
            latitude_deg,
            longitude_deg,
            altitude_m,
            heading_deg,
        })
    }

    /// Of a plan whose scenario says where it lies.
    ///
    /// # Errors
    ///
    /// As [`Georeference::new`].
    pub fn of(origin: &Origin) -> Result<Georeference, String> {
        Georeference::new([
            origin.latitude_deg,
            origin.longitude_deg,
            origin.altitude_m,
            origin.heading_deg,
        ])
    }

    /// Radii of curvature at the origin's height: along the meridian, and across it (m).
    fn radii_m(&self) -> (f64, f64) {
        let e2 = WGS84_FLATTENING * (2.0 - WGS84_FLATTENING);
        let w2 = 1.0 - e2 * self.latitude_deg.to_radians().sin().powi(2);
        let across_m = WGS84_MAJOR_M / w2.sqrt();
        let along_m = WGS84_MAJOR_M * (1.0 - e2) / (w2 * w2.sqrt());
        (along_m + self.altitude_m, across_m + self.altitude_m)
    }

    fn enu(&self) -> Frame {
        Frame {
            axes: Axes::Enu,
            heading_deg: self.heading_deg,
        }
    }

    /// Longitude, latitude (deg) and height (m) of a place in the world, in the plane that touches
    /// the Earth at the origin: good to centimetres over two kilometres.
    #[must_use]
    pub fn on_earth(&self, at_m: Point3<f64>) -> [f64; 3] {
        let enu_m = self.enu().from_world(at_m.coords);
        let (along_m, across_m) = self.radii_m();
        let parallel_m = across_m * self.latitude_deg.to_radians().cos();
        let longitude_deg = self.longitude_deg + (enu_m.x / parallel_m).to_degrees();
        [
            // Across the date line.
            (longitude_deg + 180.0).rem_euclid(360.0) - 180.0,
            self.latitude_deg + (enu_m.y / along_m).to_degrees(),
            self.altitude_m + enu_m.z,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(axes: Axes, heading_deg: f64) -> Frame {
        Frame { axes, heading_deg }
    }

    #[test]
    fn x_north_is_north_west_up_and_x_east_is_east_north_up() {
        let v = Vector3::new(1.0, 2.0, 3.0);
        let seen = |axes, heading_deg| frame(axes, heading_deg).from_world(v);
        assert_eq!(seen(Axes::Ned, 0.0), Vector3::new(1.0, -2.0, -3.0));
        assert_eq!(seen(Axes::Ned, 90.0), Vector3::new(2.0, 1.0, -3.0));
        assert_eq!(seen(Axes::Enu, 90.0), v);
        assert_eq!(seen(Axes::Enu, -270.0), v);
        assert_eq!(seen(Axes::Enu, 180.0), Vector3::new(2.0, -1.0, 3.0));
    }

    #[test]
    fn what_is_turned_into_a_file_turns_back_and_keeps_its_length() {
        let v = Vector3::new(1.0, -2.0, 3.0);
        for axes in [Axes::Ned, Axes::Enu] {
            for heading_deg in [-170.0, -33.3, 0.0, 30.0, 90.0, 271.5, 359.0] {
                let frame = frame(axes, heading_deg);
                let there = frame.from_world(v);
                assert!((frame.to_world(there) - v).norm() < 1e-12);
                assert!((there.norm() - v.norm()).abs() < 1e-12);
                let x = frame.from_world(Vector3::x());
                let faced = match axes {
                    Axes::Ned => x.y.atan2(x.x),
                    Axes::Enu => x.y.atan2(x.x),
                };
                let off = (faced - frame.yaw_rad()).rem_euclid(std::f64::consts::TAU);
                assert!(off.min(std::f64::consts::TAU - off) < 1e-9, "{heading_deg}");
            }
        }
    }

    #[test]
    fn a_degree_of_latitude_is_as_long_as_on_the_ellipsoid() {
        // 111 132.95 m at 45 degrees (IAG, GRS 80 and WGS 84 alike); the equator's is 110 574.28 m.
        for (latitude_deg, length_m) in [(45.0, 111_132.0), (0.0, 110_574.0)] {
            let here = Georeference {
                latitude_deg,
                longitude_deg: 7.0,
                altitude_m: 0.0,
                heading_deg: 0.0,
            };
            let at = here.on_earth(Point3::new(length_m, 0.0, 5.0));
            assert!((at[1] - latitude_deg - 1.0).abs() < 2e-5, "{at:?}");
            assert_eq!((at[0], at[2]), (7.0, 5.0));
        }
    }

    #[test]
    fn across_the_date_line_longitudes_go_on_from_the_other_end() {
        for (longitude_deg, x_m) in [(-180.0, -10.0), (179.9999, 100.0)] {
            let here = Georeference {
                latitude_deg: 0.0,
                longitude_deg,
                altitude_m: 0.0,
                heading_deg: 90.0,
            };
            let [found_deg, ..] = here.on_earth(Point3::new(x_m, 0.0, 0.0));
            let east_deg = (found_deg - longitude_deg).rem_euclid(360.0);
            let apart_deg = east_deg.min(360.0 - east_deg);
            assert!(
                (-180.0..180.0).contains(&found_deg) && apart_deg < 1e-3,
                "{found_deg}"
            );
        }
    }
}
