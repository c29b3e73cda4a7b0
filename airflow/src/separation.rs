//! How far one drone must stay from the wake of another: how far below, how far beside, what
//! passing below costs, and the ellipsoid that holds all of it.
//!
//! Both hover level in still air, or the lower one passes straight below at constant height and
//! speed; the mean flow. Whichever way the lower one lies from the upper one: the worst of the
//! azimuths counts.

use nalgebra::Point3;
use serde::Serialize;

use crate::airframe::Airframe;
use crate::discs::DiscPoints;
use crate::field::{Source, mean_over_discs_mps};
use crate::golden_section::GoldenSection;
use crate::power;
use crate::superposition::Superposition;
use crate::wake::Wake;

/// Steps of the azimuths at which the lower one is looked for (deg). The four jets above repeat
/// every 90, mirrored at 45; with four rotors, or eight, so does the air over its discs, and with
/// others all of them are looked at.
const AZIMUTH_STEP_DEG: usize = 15;
/// Depths and offsets looked at before the last that exceeds is made fine: chosen here, their steps
/// are a hundredth of the wake's length and width.
const STEPS: usize = 100;
/// Halvings of the last step, chosen here: to a ten-thousandth of a millimetre of ten metres.
const HALVINGS: usize = 20;
/// Steps of a passage, of equal angle as seen from a half-width and the lower one's tips beside the
/// axis: a jet's edge falls with the fourth power of the offset, so that they reach through all of
/// it. Chosen here: sums to a thousandth.
const PASSAGE_STEPS: usize = 400;

/// One drone in the wake of another.
#[derive(Clone, Debug)]
pub struct Separation {
    upper: Wake,
    discs: DiscPoints,
    /// As cosine and sine.
    azimuths: Vec<(f64, f64)>,
    lower_tips_m: f64,
    lower_mass_kg: f64,
    lower_u_h_mps: f64,
}

/// What the lower drone meets at one place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SeparationExposure {
    /// Mean over its rotor discs (m/s).
    pub air_mps: f64,
    /// The same over its induced velocity.
    pub alpha: f64,
    /// Power to hover there over that in still air.
    pub power: f64,
}

/// What a straight level passage through the axis of the upper drone's wake costs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Passage {
    /// Time with more than the limit (s).
    pub over_limit_s: f64,
    /// Integral of the air over time (m).
    pub dose_m: f64,
    /// Energy beyond that in still air (J).
    pub extra_energy_j: f64,
}

/// Half-axes of an ellipsoid about the upper drone's centre (m).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ellipsoid {
    /// Level.
    pub beside_m: f64,
    /// Upright.
    pub below_m: f64,
}

impl Separation {
    /// A drone with its mass (kg) under the wake of another, in air of a density (kg/m³).
    #[must_use]
    pub fn new(lower: &Airframe, mass_kg: f64, density_kg_per_m3: f64, upper: Wake) -> Separation {
        let last_deg = match lower.propellers() % 4 {
            0 => 45,
            _ => 360 - AZIMUTH_STEP_DEG,
        };
        let azimuths = (0..=last_deg).step_by(AZIMUTH_STEP_DEG);
        let unit = |azimuth_deg: usize| {
            let (sin, cos) = (azimuth_deg as f64).to_radians().sin_cos();
            (cos, sin)
        };
        Separation {
            upper,
            discs: lower.disc_points(),
            azimuths: azimuths.map(unit).collect(),
            lower_tips_m: lower.tip_radius_m(),
            lower_mass_kg: mass_kg,
            lower_u_h_mps: lower.hover_induced_velocity_mps(mass_kg, density_kg_per_m3),
        }
    }

    /// The wake it is about.
    #[must_use]
    pub fn upper(&self) -> &Wake {
        &self.upper
    }

    /// What is met so far below and beside (m, rotor plane to rotor plane, axis to axis).
    #[must_use]
    pub fn met(&self, below_m: f64, beside_m: f64) -> SeparationExposure {
        let source = [Source {
            wake: &self.upper,
            position_m: Point3::origin(),
            ends_at_z_m: f64::NEG_INFINITY,
        }];
        let azimuths = match beside_m == 0.0 {
            true => &self.azimuths[..1],
            false => &self.azimuths[..],
        };
        let means = azimuths.iter().map(|(cos, sin)| {
            let centre_m = Point3::new(beside_m * cos, beside_m * sin, -below_m);
            mean_over_discs_mps(&source, &self.discs, centre_m, Superposition::Momentum)
        });
        let air_mps = means.fold(0.0, f64::max);
        let alpha = air_mps / self.lower_u_h_mps;
        SeparationExposure {
            air_mps,
            alpha,
            power: power::beta(alpha),
        }
    }

    /// Depth at which even the centreline is below a limit for good (m).
    fn deepest_m(&self, alpha: f64) -> f64 {
        let end_m = self.upper.iso_speed_end_m(alpha * self.lower_u_h_mps);
        end_m.max(self.upper.near_field_depth_m())
    }

    /// From which depth on (m) the lower one meets no more than a limit, so far beside (m). At
    /// least 0: there is no depth at which it meets more.
    #[must_use]
    pub fn below_m(&self, alpha: f64, beside_m: f64) -> f64 {
        let to_m = self.deepest_m(alpha);
        last_over(to_m, &|below_m| self.met(below_m, beside_m).alpha > alpha)
    }

    /// From which offset on (m) it meets no more than a limit, so far below (m).
    #[must_use]
    pub fn beside_m(&self, alpha: f64, below_m: f64) -> f64 {
        let limit_mps = alpha * self.lower_u_h_mps;
        let reach_m = self.upper.reach_at_speed_m(below_m, limit_mps);
        let to_m = reach_m + self.lower_tips_m;
        last_over(to_m, &|beside_m| self.met(below_m, beside_m).alpha > alpha)
    }

    /// The offset that holds a limit at every depth, and the depth that asks for it (m).
    #[must_use]
    pub fn widest_m(&self, alpha: f64) -> (f64, f64) {
        let to_m = self
            .below_m(alpha, 0.0)
            .max(self.upper.near_field_depth_m());
        let depths = (1..=STEPS).map(|k| to_m * k as f64 / STEPS as f64);
        let wide = depths.map(|below_m| (self.beside_m(alpha, below_m), below_m));
        wide.fold((0.0, 0.0), |most, it| if it.0 > most.0 { it } else { most })
    }

    /// A straight level passage through the axis, so far below (m), at a speed (m/s, above 0).
    #[must_use]
    pub fn passage(&self, below_m: f64, speed_mps: f64, limit: f64) -> Passage {
        let wide_m = self.upper.half_width_m(below_m) + self.lower_tips_m;
        let step_rad = std::f64::consts::PI / PASSAGE_STEPS as f64;
        let mut passage = Passage {
            over_limit_s: 0.0,
            dose_m: 0.0,
            extra_energy_j: 0.0,
        };
        let mut before: Option<(f64, f64)> = None;
        for k in 0..PASSAGE_STEPS {
            let angle_rad = (k as f64 + 0.5) * step_rad - std::f64::consts::FRAC_PI_2;
            let tan = angle_rad.tan();
            let along_m = wide_m * tan;
            let step_s = wide_m * (1.0 + tan * tan) * step_rad / speed_mps;
            let SeparationExposure { air_mps, alpha, .. } = self.met(below_m, along_m.abs());
            if let Some(before) = before.replace((angle_rad, alpha)) {
                let over_rad = part_over([before, (angle_rad, alpha)], limit);
                let over = over_rad[1].tan() - over_rad[0].tan();
                passage.over_limit_s += wide_m * over / speed_mps;
            }
            passage.dose_m += air_mps * step_s;
            let (mass_kg, u_h_mps) = (self.lower_mass_kg, self.lower_u_h_mps);
            passage.extra_energy_j += power::extra_energy_j(mass_kg, u_h_mps, alpha, step_s);
        }
        passage
    }

    /// The smallest ellipsoid about the upper drone that holds every place where the lower one
    /// meets more than a limit, the near-field column, and a ball of so much about the centre (m):
    /// where two bodies touch. For planners that take one ellipsoid for a pair (Preiss et al.,
    /// IROS 2017); it is as high above the drone as it is deep below.
    #[must_use]
    pub fn ellipsoid(&self, alpha: f64, bodies_m: f64) -> Ellipsoid {
        let column_m = self.upper.column_radius_m();
        let near_m = self.upper.near_field_depth_m();
        let below_m = self.below_m(alpha, 0.0).max(near_m).max(bodies_m);
        let mut rim_m: Vec<[f64; 2]> = (0..=STEPS)
            .map(|k| below_m * k as f64 / STEPS as f64)
            .map(|z_m| {
                let column_m = if z_m <= near_m { column_m } else { 0.0 };
                [self.beside_m(alpha, z_m).max(column_m), z_m]
            })
            .collect();
        rim_m.extend((0..=STEPS).map(|k| {
            let (sin, cos) = (k as f64 / STEPS as f64 * std::f64::consts::FRAC_PI_2).sin_cos();
            [bodies_m * cos, bodies_m * sin]
        }));
        // (beside/a)² + (below/c)² is at most 1 on the rim; the volume goes with a² c.
        let beside_m = |c_m: f64| {
            let of = |[r_m, z_m]: &[f64; 2]| r_m / (1.0 - (z_m / c_m).powi(2)).max(1e-12).sqrt();
            rim_m.iter().map(of).fold(0.0, f64::max)
        };
        // Longer by a thousandth at least: at its tip the ellipsoid has no width.
        let range_m = [1.001 * below_m, 4.0 * below_m];
        let best = GoldenSection::of(range_m, 60, |c_m| beside_m(c_m).powi(2) * c_m);
        let c_m = best.middle();
        Ellipsoid {
            beside_m: beside_m(c_m),
            below_m: c_m,
        }
    }
}

/// The end of the last stretch from 0 to a length (m) at which something holds; 0: it never does.
fn last_over(to_m: f64, over: &dyn Fn(f64) -> bool) -> f64 {
    let at = |k: usize| to_m * k as f64 / STEPS as f64;
    // At no depth at all there is no air: just beside 0 there is.
    let start = |k: usize| if k == 0 { 1e-3 * at(1) } else { at(k) };
    let Some(last) = (0..=STEPS).rev().find(|&k| over(start(k))) else {
        return 0.0;
    };
    let (mut low_m, mut high_m) = (start(last), at(last + 1));
    for _ in 0..HALVINGS {
        let middle_m = 0.5 * (low_m + high_m);
        match over(middle_m) {
            true => low_m = middle_m,
            false => high_m = middle_m,
        }
    }
    high_m
}

/// From where to where a straight line between two points (x, value) is above a level; nowhere is
/// from a place to itself.
fn part_over([(x0, value0), (x1, value1)]: [(f64, f64); 2], level: f64) -> [f64; 2] {
    let crosses = x0 + (x1 - x0) * (level - value0) / (value1 - value0);
    match (value0 > level, value1 > level) {
        (true, true) => [x0, x1],
        (true, false) => [x0, crosses],
        (false, true) => [crosses, x1],
        (false, false) => [x0, x0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Air, Jet};

    fn of(lower: &str, upper: &str) -> Separation {
        let density = Air::default().density_kg_per_m3();
        let [lower, upper] = [lower, upper].map(|it| Airframe::preset(it).expect("a preset"));
        let wake = Wake::new(&upper, upper.mass_kg(), density, &Jet::default());
        Separation::new(&lower, lower.mass_kg(), density, wake)
    }

    /// Mean over the lower one's discs (m/s) at one place (m) and azimuth (deg).
    fn mean_mps(pair: &Separation, below_m: f64, beside_m: f64, azimuth_deg: f64) -> f64 {
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        let source = Source {
            wake: &pair.upper,
            position_m: Point3::origin(),
            ends_at_z_m: f64::NEG_INFINITY,
        };
        let centre_m = Point3::new(beside_m * cos, beside_m * sin, -below_m);
        mean_over_discs_mps(&[source], &pair.discs, centre_m, Superposition::Momentum)
    }

    #[test]
    fn no_azimuth_brings_two_or_three_rotors_more_than_what_is_met() {
        for propellers in [2, 3] {
            let lower = Airframe::new("own", 0.6, propellers, 0.13, 0.27, 1.0).expect("sound");
            let upper = of("kolibri", "matrice-300").upper;
            let pair = Separation::new(&lower, 0.6, 1.204, upper);
            for (below_m, beside_m) in [(0.5, 0.257), (1.5, 0.6), (6.0, 1.0)] {
                let met = pair.met(below_m, beside_m);
                for k in 0..72 {
                    let here_mps = mean_mps(&pair, below_m, beside_m, 5.0 * f64::from(k));
                    // Between two of the azimuths that are looked at by a little.
                    assert!(
                        here_mps <= 1.005 * met.air_mps,
                        "{propellers} {k}: {here_mps}"
                    );
                }
            }
        }
    }

    #[test]
    fn no_place_farther_than_what_is_asked_for_exceeds_the_limit() {
        for (lower, upper) in [
            ("kolibri", "matrice-300"),
            ("crazyflie-2.1", "crazyflie-2.1"),
            ("matrice-300", "kolibri"),
        ] {
            let pair = of(lower, upper);
            for limit in [0.1, 0.3, 1.0] {
                let below_m = pair.below_m(limit, 0.0);
                let (widest_m, _) = pair.widest_m(limit);
                for k in 0..400 {
                    let away = f64::from(k) / 100.0;
                    let met = pair.met(below_m * (1.0 + away) + 1e-6, 0.0);
                    assert!(
                        met.alpha <= limit * 1.0001,
                        "{lower} {limit} {away}: {met:?}"
                    );
                    let deep_m = 0.01 + 1.2 * below_m.max(1.0) * away / 4.0;
                    // Between two of the depths that were looked at it may be wider by a little.
                    let met = pair.met(deep_m, widest_m + 1e-6);
                    assert!(
                        met.alpha <= limit * 1.02,
                        "{lower} {limit} {deep_m}: {met:?}"
                    );
                }
                if below_m > 0.0 {
                    let met = pair.met(below_m * 0.999, 0.0);
                    assert!(met.alpha > limit * 0.999, "{lower} {limit}: {met:?}");
                }
            }
        }
    }

    #[test]
    fn beside_the_near_field_no_place_farther_than_is_asked_for_exceeds_the_limit_either() {
        for (lower, upper) in [
            ("crazyflie-2.1", "matrice-300"),
            ("kolibri", "elios-3"),
            ("matrice-300", "mavic-3e"),
        ] {
            let pair = of(lower, upper);
            let alpha = |below_m: f64, beside_m: f64, azimuth_deg: f64| {
                mean_mps(&pair, below_m, beside_m, azimuth_deg) / pair.lower_u_h_mps
            };
            for limit in [0.05, 0.3, 0.6] {
                for k in 1..=20 {
                    let below_m = pair.upper.near_field_depth_m() * f64::from(k) / 20.0;
                    let beside_m = pair.beside_m(limit, below_m);
                    for (away, turn) in (0..20).flat_map(|it| (0..18).map(move |on| (it, on))) {
                        let there_m = beside_m + 1e-6 + 0.05 * f64::from(away);
                        let met = alpha(below_m, there_m, 5.0 * f64::from(turn));
                        // Between two of the azimuths that are looked at by a little.
                        let told = (lower, upper, limit, below_m, there_m, turn);
                        assert!(met <= limit * 1.001, "{told:?}: {met}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_ellipsoid_holds_every_place_that_exceeds_and_is_not_much_larger() {
        let pair = of("kolibri", "matrice-300");
        let bodies_m = 0.9;
        let it = pair.ellipsoid(0.3, bodies_m);
        for k in 0..60 {
            for j in 0..60 {
                let (z_m, r_m) = (
                    it.below_m * 1.2 * f64::from(k + 1) / 60.0,
                    it.beside_m * 1.2 * f64::from(j) / 60.0,
                );
                let is_outside = (r_m / it.beside_m).powi(2) + (z_m / it.below_m).powi(2) > 1.0;
                assert!(
                    !is_outside || pair.met(z_m, r_m).alpha <= 0.306,
                    "{z_m} {r_m}"
                );
            }
        }
        assert!(it.below_m < 1.6 * pair.below_m(0.3, 0.0));
        assert!(it.beside_m >= bodies_m && it.beside_m < 2.0 * pair.widest_m(0.3).0.max(bodies_m));
    }

    #[test]
    fn a_passage_costs_half_at_twice_the_speed() {
        let pair = of("kolibri", "matrice-300");
        let [slow, fast] = [1.0, 2.0].map(|it| pair.passage(4.0, it, 0.3));
        assert!((slow.dose_m / fast.dose_m - 2.0).abs() < 1e-9);
        assert!((slow.extra_energy_j / fast.extra_energy_j - 2.0).abs() < 1e-9);
        assert!((slow.over_limit_s / fast.over_limit_s - 2.0).abs() < 1e-9);
    }

    /// What is beside the axis by less than the limit asks for is over it, and nothing else.
    #[test]
    fn a_passage_is_over_a_limit_for_as_long_as_it_is_nearer_than_the_limit_asks_for() {
        for (below_m, limit) in [(1.0, 0.3), (7.08, 1e-4), (1.18, 1e-4)] {
            let pair = of("kolibri", "kolibri");
            let over_m = 2.0 * pair.passage(below_m, 2.0, limit).over_limit_s;
            let wide_m = 2.0 * pair.beside_m(limit, below_m);
            assert!(
                (over_m / wide_m - 1.0).abs() < 2e-3,
                "{below_m}: {over_m} {wide_m}"
            );
        }
    }

    #[test]
    fn a_passage_counts_the_edge_of_the_jet_too() {
        for (lower, upper, below_m) in [
            ("kolibri", "matrice-300", 4.0),
            ("kolibri", "matrice-300", 1.0),
            ("matrice-300", "kolibri", 8.0),
        ] {
            let pair = of(lower, upper);
            let passage = pair.passage(below_m, 1.0, 0.3);
            // Against sums of even steps, up to where the edge has a ten-thousandth left.
            let far_m = 40.0 * (pair.upper.half_width_m(below_m) + pair.lower_tips_m);
            let step_m = far_m / 20_000.0;
            let (mut dose_m, mut energy_j) = (0.0, 0.0);
            for k in 0..20_000 {
                let met = pair.met(below_m, (f64::from(k) + 0.5) * step_m);
                let (mass_kg, u_h_mps) = (pair.lower_mass_kg, pair.lower_u_h_mps);
                dose_m += 2.0 * met.air_mps * step_m;
                energy_j += 2.0 * power::extra_energy_j(mass_kg, u_h_mps, met.alpha, step_m);
            }
            for (found, sum) in [(passage.dose_m, dose_m), (passage.extra_energy_j, energy_j)] {
                assert!(
                    (found / sum - 1.0).abs() < 1e-3,
                    "{lower} {below_m}: {found} {sum}"
                );
            }
        }
    }
}
