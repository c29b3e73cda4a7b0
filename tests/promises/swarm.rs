//! Synthetic logs of two Crazyflies, one crossing over the other, with the jet of the upper one
//! vertical or leaning; and what the diagnosis of their vertical forces says of it.

use airflow::power::thrust_ratio_at_constant_power;
use airflow::{Airframe, Jet, Wake};
use diagnosis::campaign::{CampaignFinding, CampaignOptions, diagnose_campaign};
use diagnosis::record::read::{Campaign, read_log};
use diagnosis::record::recording::Recording;
use diagnosis::statistics::draws::Draws;
use nalgebra::{UnitQuaternion, Vector2, Vector3};

/// Flights that a diagnosis is made of, each so long (s).
pub(crate) const FLIGHTS: u64 = 12;
const LASTS_S: f64 = 30.0;
const STEP_S: f64 = 0.02;
pub(crate) const MASS_KG: f64 = 0.034;
/// Rotor drag over mass (1/s): of a small drone (Faessler et al., RA-L 2018).
const DRAG_PER_S: f64 = 0.3;

/// Thrust of a rotor over the square of its speed: 16 000 turns a minute in hover.
pub(crate) const THRUST_N_PER_RPM2: f64 = 0.25 * 9.81 * MASS_KG / (16_000.0 * 16_000.0);

/// What leaves no question open.
pub(crate) const CAMPAIGN: &str = r#"(
    name: "crossing", floor_z_m: 0, air: (temperature_c: 20, pressure_pa: 101325), acceleration: SpecificForceInWorld, clock: Shared,
    types: { "t": (mass_kg: Stated(0.034), propeller_diameter_m: Stated(0.0462), motor_distance_m: Stated(0.092), rotor_offset_m: Stated((0, 0, 0))) },
    vehicles: { "u": "t", "v": "t" },
)"#;

/// A sum of two swings about a place: position, velocity and acceleration along one axis.
struct Swing {
    about_m: f64,
    parts: [(f64, f64, f64); 2],
}

impl Swing {
    fn new(about_m: f64, metres: f64, radps: f64, draws: &mut Draws) -> Swing {
        let mut part = |share: f64, times: f64| {
            let radps = radps * times * (0.9 + 0.2 * draws.uniform());
            (
                metres * share,
                radps,
                std::f64::consts::TAU * draws.uniform(),
            )
        };
        Swing {
            about_m,
            parts: [part(0.8, 1.0), part(0.2, 1.7)],
        }
    }

    fn at(&self, t_s: f64) -> [f64; 3] {
        let mut sums = [self.about_m, 0.0, 0.0];
        for (metres, radps, phase) in self.parts {
            let (sin, cos) = (radps * t_s + phase).sin_cos();
            sums[0] += metres * sin;
            sums[1] += metres * radps * cos;
            sums[2] -= metres * radps * radps * sin;
        }
        sums
    }
}

/// A drone's way.
struct Way([Swing; 3]);

impl Way {
    /// Place, velocity and acceleration.
    fn at(&self, t_s: f64) -> [Vector3<f64>; 3] {
        let [x, y, z] = [0, 1, 2].map(|axis| self.0[axis].at(t_s));
        [0, 1, 2].map(|order| Vector3::new(x[order], y[order], z[order]))
    }

    /// Thrust over mass (m/s²).
    fn thrust_mps2(&self, t_s: f64) -> Vector3<f64> {
        let [_, velocity_mps, acceleration_mps2] = self.at(t_s);
        let drag_mps2 = DRAG_PER_S * Vector3::new(velocity_mps.x, velocity_mps.y, 0.0);
        acceleration_mps2 + drag_mps2 + 9.81 * Vector3::z()
    }
}

/// One flight as a log at 50 Hz. `lean`: how far the jet of the upper drone follows its thrust.
pub(crate) fn log(seed: u64, lean: f64) -> String {
    log_of_jet(seed, lean, Vector2::zeros())
}

/// The same of a jet that goes aside by so much of its depth, too.
fn log_of_jet(seed: u64, lean: f64, tilt: Vector2<f64>) -> String {
    let mut draws = Draws::new(seed);
    let mut swing =
        |about_m: f64, metres: f64, radps: f64| Swing::new(about_m, metres, radps, &mut draws);
    // The upper one turns about above the lower one: slow there, and leaning most.
    let upper = Way([
        swing(0.6, 0.65, 1.3),
        swing(0.0, 0.1, 1.1),
        swing(1.6, 0.05, 0.9),
    ]);
    let lower = Way([
        swing(0.0, 0.15, 0.8),
        swing(0.0, 0.15, 0.7),
        swing(0.95, 0.1, 0.6),
    ]);
    let airframe = Airframe::new("t", MASS_KG, 4, 0.0462, 0.092, 1.0).unwrap();
    let air = airflow::Air {
        temperature_c: 20.0,
        pressure_pa: 101_325.0,
    };
    let wake = Wake::new(&airframe, MASS_KG, air.density_kg_per_m3(), &Jet::default());
    let discs = airframe.disc_points();
    let mut text = String::from(
        "t_s,vehicle,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,qx,qy,qz,qw,rpm1,rpm2,rpm3,rpm4\n",
    );
    let mut gusts = 0.0;
    for step in 0..(LASTS_S / STEP_S) as u32 {
        let t_s = f64::from(step) * STEP_S;
        let [above_m, ..] = upper.at(t_s);
        let [below_m, ..] = lower.at(t_s);
        let depth_m = above_m.z - below_m.z;
        // The air that is there now left by so much earlier.
        let age_s = wake.far_field().transport_time_s(depth_m, 1.0);
        let thrust_mps2 = upper.thrust_mps2(t_s - age_s);
        let aside_m = thrust_mps2.xy() * (-lean * depth_m / thrust_mps2.z) + tilt * depth_m;
        let mean = |[x, y]: &[f64; 2]| {
            let at_m = Vector3::new(
                below_m.x + x - above_m.x - aside_m.x,
                below_m.y + y - above_m.y - aside_m.y,
                -depth_m,
            );
            wake.axial_speed_mps(at_m)
        };
        let points = discs.offsets_m.iter().zip(&discs.weights);
        let met_mps: f64 = points.map(|(at, weight)| weight * mean(at)).sum();
        // Gusts of a tenth that last a fifth of a second.
        gusts = 0.9 * gusts + 0.1 * (1.0_f64 - 0.81).sqrt() * draws.normal();
        let alpha = met_mps * (1.0 + gusts) / wake.induced_velocity_mps();
        for (id, way, alpha) in [("u", &upper, 0.0), ("v", &lower, alpha)] {
            let [place_m, velocity_mps, _] = way.at(t_s);
            let thrust_mps2 = way.thrust_mps2(t_s);
            let up = UnitQuaternion::rotation_between(&Vector3::z(), &thrust_mps2).unwrap();
            let still_n = MASS_KG * thrust_mps2.norm() / thrust_ratio_at_constant_power(alpha);
            let rpm = (0.25 * still_n / THRUST_N_PER_RPM2).sqrt();
            let drag_mps2 = DRAG_PER_S * Vector3::new(velocity_mps.x, velocity_mps.y, 0.0);
            let mut row = vec![format!("{t_s:.3}"), id.to_owned()];
            let mut push = |value: f64, digits: usize| row.push(format!("{value:.digits$}"));
            place_m.iter().for_each(|value| push(*value, 4));
            velocity_mps.iter().for_each(|value| push(*value, 4));
            for force_mps2 in (thrust_mps2 - drag_mps2).iter() {
                push(force_mps2 + 0.25 * draws.normal(), 3);
            }
            [up.i, up.j, up.k, up.w]
                .iter()
                .for_each(|value| push(*value, 5));
            for part in [1.01, 0.98, 1.02, 0.99] {
                push(part * rpm, 1);
            }
            text += &(row.join(",") + "\n");
        }
    }
    text
}

/// Flights, their jets leaning by so much.
fn flights(first_seed: u64, lean: f64) -> Vec<Recording> {
    flights_of_jets(first_seed, lean, Vector2::zeros())
}

fn flights_of_jets(first_seed: u64, lean: f64, tilt: Vector2<f64>) -> Vec<Recording> {
    let campaign = Campaign::parse("campaign.ron", CAMPAIGN).unwrap();
    let seeds = first_seed..first_seed + FLIGHTS;
    let read = |seed: u64| {
        let name = format!("flight-{seed:03}");
        read_log(
            &name,
            "flight.csv",
            log_of_jet(seed, lean, tilt).as_bytes(),
            &campaign,
        )
    };
    let flights = seeds.map(|seed| read(seed).unwrap_or_else(|problems| panic!("{problems}")));
    flights.collect()
}

pub(crate) fn diagnosed(flights: &[Recording]) -> CampaignFinding {
    diagnose_campaign(flights, &CampaignOptions::default()).unwrap()
}

fn names(found: &CampaignFinding) -> Vec<&str> {
    let effects = found.finding.effects.iter();
    effects.map(|effect| effect.name.as_str()).collect()
}

#[test]
fn a_jet_that_leans_as_its_drone_does_is_named_with_its_gain() {
    let found = diagnosed(&flights(100, 0.8));
    assert_eq!(names(&found), ["wake_lean"], "{:?}", found.taken);
    let gain = &found.finding.effects[0].parameters["g"];
    assert!(gain.low < 0.8 && 0.8 < gain.high, "{gain:?}");
    assert!(gain.high - gain.low < 0.4, "{gain:?}");
    let [low, ..] = found.taken[0].r2_gained.unwrap();
    assert!(low > 0.0, "{:?}", found.taken[0]);
}

#[test]
fn a_jet_that_leaves_its_drone_at_an_angle_is_named_by_vertical_forces_alone() {
    let found = diagnosed(&flights_of_jets(300, 0.0, Vector2::new(0.08, 0.05)));
    assert_eq!(names(&found), ["wake_tilt"], "{:?}", found.taken);
    for (name, tilt) in [("lean_x", 0.08), ("lean_y", 0.05)] {
        let lean = &found.finding.effects[0].parameters[name];
        assert!(lean.low < tilt && tilt < lean.high, "{name}: {lean:?}");
    }
}

#[test]
fn where_jets_stay_vertical_nothing_is_named() {
    let found = diagnosed(&flights(200, 0.0));
    assert!(names(&found).is_empty(), "{:?}", found.taken);
    let lean = found.finding.detectable.iter();
    let mut lean = lean.filter(|of| of.name == "wake_lean");
    // It could have been seen: a lean of a tenth of the drone's own.
    let departure = lean.next().unwrap().departure;
    assert!(departure < 0.3, "{departure}");
}
