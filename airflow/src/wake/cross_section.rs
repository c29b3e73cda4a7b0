//! One wake at one depth: what the points of a level disc share is worked out once for all of them.

use nalgebra::{Vector2, Vector3};

use crate::far_field::Level;
use crate::near_field::NearLevel;
use crate::superposition::Superposition;
use crate::wake::Wake;

/// A level cross-section through a wake, made by [`Wake::cross_section`]: the same speeds as
/// [`Wake::axial_speed_mps`], to the bit.
#[derive(Clone, Copy, Debug)]
pub struct CrossSection<'a>(SectionKind<'a>);

#[derive(Clone, Copy, Debug)]
enum SectionKind<'a> {
    /// At and above the rotor plane.
    Calm,
    /// The far field, or that of 2.5 l held.
    Far(Level),
    Near {
        level: NearLevel,
        length_m: f64,
        induced_velocity_mps: f64,
    },
    Shaped {
        wake: &'a Wake,
        depth_m: f64,
    },
}

impl<'a> CrossSection<'a> {
    pub(crate) fn new(wake: &'a Wake, depth_m: f64) -> CrossSection<'a> {
        if wake.is_shaped() {
            return CrossSection(SectionKind::Shaped { wake, depth_m });
        }
        let far = wake.far_field();
        if depth_m >= far.from_m() {
            return CrossSection(SectionKind::Far(far.level(depth_m)));
        }
        if depth_m <= 0.0 {
            return CrossSection(SectionKind::Calm);
        }
        let length_m = wake.motor_distance_m();
        match wake.near_field() {
            Some(near) => CrossSection(SectionKind::Near {
                level: near.level(depth_m / length_m),
                length_m,
                induced_velocity_mps: wake.induced_velocity_mps(),
            }),
            None => CrossSection(SectionKind::Far(far.level(far.from_m()))),
        }
    }

    /// Mean axial speed (m/s, downwards) at a horizontal offset (m) from the drone.
    #[must_use]
    #[inline]
    pub fn axial_speed_mps(&self, x_m: f64, y_m: f64) -> f64 {
        match &self.0 {
            SectionKind::Far(level) => level.axial_speed_mps(x_m * x_m + y_m * y_m),
            other => other.elsewhere_mps(x_m, y_m),
        }
    }

    /// Adds the axial speed at each of several steps (m, x and y) from an offset (m) to what has
    /// been gathered there.
    pub(crate) fn gather(
        &self,
        offset_m: Vector2<f64>,
        steps_m: &[[f64; 2]],
        superposition: Superposition,
        gathered: &mut [f64],
    ) {
        // One loop for each way to add: without a choice inside, the far field's divisions go in
        // pairs.
        match superposition {
            Superposition::Momentum => {
                self.each(offset_m, steps_m, gathered, |so_far, mps| {
                    Superposition::Momentum.gather(so_far, mps)
                });
            }
            Superposition::Linear | Superposition::Strongest => {
                self.each(offset_m, steps_m, gathered, |so_far, mps| {
                    superposition.gather(so_far, mps)
                });
            }
        }
    }

    #[inline]
    fn each(
        &self,
        offset_m: Vector2<f64>,
        steps_m: &[[f64; 2]],
        gathered: &mut [f64],
        add: impl Fn(f64, f64) -> f64,
    ) {
        let places_m = steps_m
            .iter()
            .map(|&[x, y]| (offset_m.x + x, offset_m.y + y));
        let points = gathered.iter_mut().zip(places_m);
        if let SectionKind::Far(level) = self.0 {
            for (so_far, (x, y)) in points {
                *so_far = add(*so_far, level.axial_speed_mps(x * x + y * y));
            }
            return;
        }
        for (so_far, (x, y)) in points {
            *so_far = add(*so_far, self.0.elsewhere_mps(x, y));
        }
    }
}

impl SectionKind<'_> {
    /// Kept out of the short path.
    fn elsewhere_mps(&self, x_m: f64, y_m: f64) -> f64 {
        match self {
            SectionKind::Calm => 0.0,
            SectionKind::Far(level) => level.axial_speed_mps(x_m * x_m + y_m * y_m),
            SectionKind::Near {
                level,
                length_m,
                induced_velocity_mps,
            } => induced_velocity_mps * level.axial_speed(x_m / length_m, y_m / length_m),
            SectionKind::Shaped { wake, depth_m } => {
                wake.axial_speed_mps(Vector3::new(x_m, y_m, -depth_m))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use crate::effects::{Crossflow, Effects};
    use crate::{Airframe, Jet, Wake};

    #[test]
    fn a_cut_has_the_speeds_of_its_wake_to_the_bit() {
        let wind = Effects {
            crossflow: Some(Crossflow {
                wind_mps: [0.7, -0.3],
            }),
            ..Effects::default()
        };
        for name in ["offboard-2", "matrice-300"] {
            let airframe = Airframe::preset(name).expect("a preset");
            let plain = Wake::new(&airframe, airframe.mass_kg(), 1.204, &Jet::default());
            for wake in [
                plain.with_effects(&wind),
                plain.extrapolated(),
                plain.clone(),
            ] {
                for s in -1..30 {
                    let depth_m = 0.13 * f64::from(s) * wake.motor_distance_m();
                    let section = wake.cross_section(depth_m);
                    for k in 0..12 {
                        let (x, y) = (0.11 * f64::from(k), 0.4 - 0.07 * f64::from(k));
                        let one_mps = wake.axial_speed_mps(Vector3::new(x, y, -depth_m));
                        assert_eq!(section.axial_speed_mps(x, y).to_bits(), one_mps.to_bits());
                    }
                }
            }
        }
    }
}
