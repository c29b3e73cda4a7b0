//! From a grid to a recording: the route of the drone, the air that reaches the probe, what the
//! probe makes of it.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::HoverGrid;
use super::true_jet::PreparedJet;
use diagnosis::record::Superposition;
use diagnosis::record::baseline::{Baseline, Delay, Observation, ReceiverAir, ReceiverLaw, Upper};
use diagnosis::record::recording::{
    Clock, Environment, Instrument, Measures, ProbeSample, Probes, Recording, Role, Track, Vehicle,
};
use diagnosis::statistics::draws::Draws;

/// Speed between grid points (m/s): quick enough that the speed filter has something to drop.
const HOP_MPS: f64 = 0.8;

pub(super) fn fly(grid: &HoverGrid, seed: u64) -> Recording {
    let mut random = Draws::new(seed ^ 0x6D61_6465_5F75_7021);
    let route = Route::over(grid, &mut random);
    let duration_s = route.knots.last().map_or(0.0, |knot| knot.0);
    let ambient_mps = random.between(grid.ambient_mps.0, grid.ambient_mps.1);
    let mut track = Track {
        longest_step_s: 2.5 / grid.track_hz,
        ..Track::default()
    };
    for i in 0..=(duration_s * grid.track_hz) as usize {
        let t_s = i as f64 / grid.track_hz;
        let (position_m, velocity_mps) = route.at(t_s);
        track.t_s.push(t_s);
        track.position_m.push(position_m);
        track.velocity_mps.push(velocity_mps);
        track
            .attitude
            .push(UnitQuaternion::from_euler_angles(0.0, 0.0, route.yaw_rad));
    }
    let samples = readings(grid, &route, ambient_mps, duration_s, &mut random);
    Recording {
        name: format!("{}-{seed}", grid.airframe.name()),
        environment: Environment {
            gravity_mps2: 9.81,
            air: grid.air,
            floor_z_m: Some(0.0),
            ceiling_z_m: None,
            ambient_mps,
            ambient_is_subtracted: false,
        },
        vehicles: vec![Vehicle {
            id: "v0".to_owned(),
            airframe: grid.airframe.clone(),
            role: Role::Emitter,
            track,
            thrust_map: None,
            clock: Clock::Shared,
        }],
        probes: Some(Probes {
            instrument: Instrument {
                kind: "hot_ball".to_owned(),
                measures: Measures::SpeedMagnitude,
                rate_hz: grid.rate_hz,
                lowpass_tau_s: 0.0,
                accuracy_abs_mps: grid.accuracy_abs_mps,
                accuracy_rel: grid.accuracy_rel,
                resolution_mps: grid.resolution_mps,
            },
            samples,
        }),
        receivers: Vec::new(),
        baseline: Baseline {
            wakes: true,
            superposition: Superposition::Linear,
            delay: Delay::None,
            upper: Upper::FarFieldExtrapolated,
            receiver_air: ReceiverAir::Centre,
            receiver_law: ReceiverLaw::HoldsThrust { exponent: 0.5 },
            observation: Observation::VelocityAndAmbient,
        },
        jet: Default::default(),
        remarks: Vec::new(),
    }
}

/// `√(m g/(2 ρ A))`, with the paper's gas law.
fn induced_velocity_mps(grid: &HoverGrid) -> f64 {
    let temperature_k = grid.air.temperature_c + 273.15;
    let density = grid.air.pressure_pa * 0.028966 / (8.3144 * temperature_k);
    let radius_m = 0.5 * grid.airframe.propeller_diameter_m();
    let area_m2 = f64::from(grid.airframe.propellers()) * PI * radius_m * radius_m;
    (grid.airframe.mass_kg() * 9.81 / (2.0 * density * area_m2)).sqrt()
}

fn readings(
    grid: &HoverGrid,
    route: &Route,
    ambient_mps: f64,
    duration_s: f64,
    random: &mut Draws,
) -> Vec<ProbeSample> {
    let jet = PreparedJet::new(grid.jet);
    let l_m = grid.airframe.motor_distance_m();
    let u_h_mps = induced_velocity_mps(grid);
    let gain = 1.0 + random.within(grid.accuracy_rel);
    let zero_mps = random.within(grid.accuracy_abs_mps);
    let step_s = 1.0 / grid.rate_hz;
    let kept = (-step_s / grid.memory_s).exp();
    let mut gusts: Vec<f64> = grid.probes_m.iter().map(|_| random.normal()).collect();
    let mut samples = Vec::new();
    for i in 1..=(duration_s * grid.rate_hz) as usize {
        let t_s = i as f64 * step_s;
        let (centre_m, _) = route.at(t_s);
        for (probe, position_m) in grid.probes_m.iter().enumerate() {
            let gust = &mut gusts[probe];
            *gust = kept * *gust + (1.0 - kept * kept).sqrt() * random.normal();
            let away_m = position_m - centre_m;
            let (sin, cos) = route.yaw_rad.sin_cos();
            let forward = (cos * away_m.x + sin * away_m.y) / l_m;
            let left = (cos * away_m.y - sin * away_m.x) / l_m;
            let (axial, radial) = jet.velocity(forward, left, -away_m.z / l_m);
            let axial_mps = u_h_mps * axial * (1.0 + grid.turbulence * *gust);
            let lateral_mps = u_h_mps * axial * grid.lateral_turbulence;
            let squares = axial_mps * axial_mps
                + (u_h_mps * radial).powi(2)
                + 2.0 * lateral_mps * lateral_mps
                + ambient_mps * ambient_mps;
            let read_mps = gain * squares.sqrt() + zero_mps;
            let steps = (read_mps / grid.resolution_mps).round().max(0.0);
            samples.push(ProbeSample {
                t_s,
                probe_id: probe as u32,
                position_m: *position_m,
                speed_mps: steps * grid.resolution_mps,
            });
        }
    }
    samples
}

/// Where the drone is: knots joined by straight lines, and a slow straying about them.
struct Route {
    knots: Vec<(f64, Point3<f64>)>,
    yaw_rad: f64,
    /// Amplitude (m), angular speed (rad/s) and phase, three for each axis.
    straying: [[(f64, f64, f64); 3]; 3],
}

impl Route {
    fn over(grid: &HoverGrid, random: &mut Draws) -> Route {
        let l_m = grid.airframe.motor_distance_m();
        let yaw_rad = random.between(0.0, TAU);
        let line_rad = if grid.along_body_y {
            yaw_rad + 0.5 * PI
        } else {
            random.between(0.0, TAU)
        };
        let along = Vector3::new(line_rad.cos(), line_rad.sin(), 0.0);
        let over_m = grid
            .probes_m
            .first()
            .copied()
            .unwrap_or_else(Point3::origin);
        let mut knots: Vec<(f64, Point3<f64>)> = Vec::new();
        for (row, depth) in grid.depths_over_l.iter().enumerate() {
            let mut offsets = grid.offsets_over_l.clone();
            if row % 2 == 1 {
                offsets.reverse();
            }
            for offset in offsets {
                let place_m = over_m + l_m * (along * offset + Vector3::z() * *depth);
                let arrival_s = knots.last().map_or(0.0, |&(t_s, from_m)| {
                    t_s + ((place_m - from_m).norm() / HOP_MPS).max(0.4)
                });
                knots.push((arrival_s, place_m));
                knots.push((arrival_s + grid.dwell_s, place_m));
            }
        }
        let straying = [(); 3].map(|()| {
            [(); 3].map(|()| {
                // Three sines of equal power; 0.1 to 0.3 Hz is how hovering drones sway (chosen
                // here).
                let amplitude_m = grid.jitter_m * (2.0_f64 / 3.0).sqrt();
                let rad_per_s = TAU * random.between(0.1, 0.3);
                (amplitude_m, rad_per_s, random.between(0.0, TAU))
            })
        });
        Route {
            knots,
            yaw_rad,
            straying,
        }
    }

    fn at(&self, t_s: f64) -> (Point3<f64>, Vector3<f64>) {
        let after = self.knots.partition_point(|knot| knot.0 <= t_s);
        let (mut position_m, mut velocity_mps) = match (
            after.checked_sub(1).and_then(|i| self.knots.get(i)),
            self.knots.get(after),
        ) {
            (Some((t0_s, from_m)), Some((t1_s, to_m))) => {
                let step_m = to_m - from_m;
                (
                    from_m + step_m * ((t_s - t0_s) / (t1_s - t0_s)),
                    step_m / (t1_s - t0_s),
                )
            }
            (Some((_, place_m)), None) | (None, Some((_, place_m))) => (*place_m, Vector3::zeros()),
            (None, None) => (Point3::origin(), Vector3::zeros()),
        };
        for (axis, waves) in self.straying.iter().enumerate() {
            for (amplitude_m, rad_per_s, phase) in waves {
                let (sin, cos) = (rad_per_s * t_s + phase).sin_cos();
                position_m[axis] += amplitude_m * sin;
                velocity_mps[axis] += amplitude_m * rad_per_s * cos;
            }
        }
        (position_m, velocity_mps)
    }
}
