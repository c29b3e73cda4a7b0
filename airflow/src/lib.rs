//! The mean airflow below hovering multirotors: the wake of one drone, the sum of several, and what
//! it costs to hover in it.
//!
//! The model is the turbulent jet of
//!
//! > L. Bauersfeld, K. Muller, D. Ziegler, F. Coletti, D. Scaramuzza, "Robotics meets Fluid
//! > Dynamics: A Characterization of the Induced Airflow below a Quadrotor as a Turbulent Jet",
//! > IEEE Robotics and Automation Letters, 2025, arXiv:2403.13321,
//!
//! "the paper" everywhere in this crate. Two things here are not the paper's: the near field above
//! 2.5 motor distances ([`Wake`]), which the paper describes without an equation that conserves
//! momentum, and the sum of several jets ([`Superposition`]).
//!
//! # Symbols
//!
//! | paper | code | unit | equation |
//! |---|---|---|---|
//! | ρ | [`Air::density_kg_per_m3`] | kg/m³ | ρ = p M/(R T) |
//! | m | [`Airframe::mass_kg`], or the mass with payload | kg | |
//! | N_P, d | [`Airframe::propellers`], [`Airframe::propeller_diameter_m`] | 1, m | |
//! | A | [`Airframe::disc_area_m2`] | m² | A = N_P π (d/2)² |
//! | l | [`Airframe::motor_distance_m`] | m | the diagonal from motor to motor |
//! | U_H | [`Airframe::hover_induced_velocity_mps`] | m/s | U_H = √(m g/(2 ρ A)) |
//! | B, S, s₀ | [`Jet`] | l, 1, l | 10.11, 0.07668, -5.817 |
//! | s, r | depth below the rotor plane, radius from the axis | m | both divided by l in the paper |
//! | r_half | [`FarField::half_width_m`] | m | r_half/l = S (s/l - s₀) |
//! | U_C | [`FarField::centreline_mps`] | m/s | U_C/U_H = B/(s/l - s₀) |
//! | ξ | r/r_half | 1 | |
//! | ⟨U⟩ | [`FarField::axial_speed_mps`], [`Wake::axial_speed_mps`] | m/s | ⟨U⟩ = U_C/(1 + (√2 - 1) ξ²)² |
//! | V | in [`Wake::velocity_mps`] | m/s | from continuity |
//! | U_D | [`mean_over_discs_mps`] | m/s | the air that a receiver meets |
//! | α | air met over the receiver's U_H | 1 | α = U_D/U_H |
//! | U_H' | U_H times [`power::beta`] | m/s | U_H' = U_D/2 + √((U_D/2)² + U_H²) |
//! | β | [`power::beta`] | 1 | β = P'/P = α/2 + √(α² + 4)/2 |
//! | q (ours) | [`Airframe::width_factor`] | 1 | r_half → q r_half, U_C → U_C/q |
//! | K (ours) | [`Jet::momentum`] | ρ U_H² l² | K = π (B S)²/(3 (√2 - 1)) |
//! | τ (ours) | [`power::thrust_ratio_at_constant_power`] | 1 | τ³ + α τ = 1 |
//!
//! Frames: the world is metres with z up; offsets are point minus rotor centre; axial speed is
//! positive downwards and radial speed positive outwards. The air itself is still, the drones hover
//! or fly slower than 0.1 m/s, and the flow is a time mean: gusts of the jet's own turbulence,
//! about a quarter of U_C on the axis (Pope, Turbulent Flows, 2000, fig. 5.7), come on top.
//!
//! # The paper's recipe
//!
//! Six steps from an airframe to the air below it, for the six airframes of the paper, here at
//! s = 4 l and r = l/2:
//!
//! ```
//! use airflow::{Air, Airframe, Jet, Wake};
//! use nalgebra::Vector3;
//!
//! let jet = Jet::default();
//! for name in &Airframe::PRESETS[..6] {
//!     let airframe = Airframe::preset(name).expect("a preset");
//!
//!     // 1. Density, from temperature and pressure.
//!     let density_kg_per_m3 = Air { temperature_c: 20.0, pressure_pa: 101_325.0 }.density_kg_per_m3();
//!     // 2. Induced velocity at hover.
//!     let u_h_mps = airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3);
//!     // 3. Lengths over the motor distance.
//!     let (s_m, r_m) = (4.0 * airframe.motor_distance_m(), 0.5 * airframe.motor_distance_m());
//!     let s_over_l = s_m / airframe.motor_distance_m();
//!     // 4. Centreline and half-width. The fit leaves out the two canted drones; their width factor stands in for it.
//!     assert_eq!(airframe.fit_excludes(), ["mavic-3e", "elios-3"].contains(name));
//!     let q = airframe.width_factor();
//!     let u_c_mps = u_h_mps * jet.centreline / (s_over_l - jet.origin) / q;
//!     let half_width_m = airframe.motor_distance_m() * jet.spreading * (s_over_l - jet.origin) * q;
//!     // 5. Profile.
//!     let a = 2.0_f64.sqrt() - 1.0;
//!     let xi = r_m / half_width_m;
//!     let axial_mps = u_c_mps / (1.0 + a * xi * xi).powi(2);
//!     // 6. Radial flow, from continuity.
//!     let radial_mps = u_c_mps * q * jet.spreading * xi * (1.0 - a * xi * xi) / (2.0 * (1.0 + a * xi * xi).powi(2));
//!
//!     // One call does all six.
//!     let wake = Wake::new(&airframe, airframe.mass_kg(), density_kg_per_m3, &jet);
//!     let velocity_mps = wake.velocity_mps(Vector3::new(r_m, 0.0, -s_m));
//!     assert!((velocity_mps - Vector3::new(radial_mps, 0.0, -axial_mps)).norm() < 1e-12);
//!     println!("{name}: {axial_mps:.2} m/s down, {radial_mps:.2} m/s outwards");
//! }
//! ```
//!
//! # In reading order
//!
//! `air` and `airframe`: the source. `jet` and `far_field`: the paper's fit, below 2.5 l.
//! `rotor_jets` and `near_field`: four jets that merge, above it. [`effects`]: what the hover jet
//! leaves out, one table and one file each. `wake`: both fields joined, with the effects that shape
//! one drone's steady jet; `wake/cross_section`: at one depth. `superposition`, `discs` and
//! `field`: several drones, and a receiver. `surroundings` and `wall_jet`: a wake at one moment,
//! and over a floor; `convection`: how fast air is carried down; `flown`: effects as a planner
//! flies them. [`power`]: what it costs. `golden_section`: a minimum along one line, for the crates
//! above.

mod air;
mod airframe;
mod convection;
mod discs;
pub mod effects;
mod far_field;
mod field;
mod flown;
mod golden_section;
mod jet;
mod near_field;
pub mod power;
mod rotor_jets;
pub mod separation;
mod superposition;
mod surroundings;
mod wake;
mod wall_jet;

pub use air::{Air, AirError, GRAVITY_MPS2};
pub use airframe::{Airframe, AirframeError, NoSuchAirframe, WIDTH_FACTOR_RANGE};
pub use convection::{CONVECTION_FACTORS, Convection, NoConvection};
pub use discs::DiscPoints;
pub use far_field::FarField;
pub use field::{HEIGHT_TOLERANCE_M, Source, axial_speed_mps, mean_over_discs_mps};
pub use flown::Flown;
pub use golden_section::GoldenSection;
pub use jet::{FAR_FIELD_FROM_S_OVER_L, Jet, JetError};
pub use superposition::{Superposition, UnknownSuperposition};
pub use surroundings::Surroundings;
pub use wake::Wake;
pub use wake::cross_section::CrossSection;
