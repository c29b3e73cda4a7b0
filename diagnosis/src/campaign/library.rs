//! What may be missing in the vertical force on a drone.

use airflow::effects::BodyDrag;

use super::forces::Forces;
use crate::infer::candidates::{
    Candidate, Kind, Shows, of_the_jet, of_the_receiver, of_the_surroundings, own_motion, parameter,
};

/// Effects of the jet that no vertical force can show, or that another name here stands for.
const NOT_IN_FORCES: [&str; 8] = [
    "crossflow",
    "wake_tilt",
    "swirl",
    "payload_mass",
    "recirculation",
    "ceiling_effect",
    "entrainment_radial",
    "near_field",
];

/// Candidates for the forces of a campaign, physics first. With `alone` no jet blows, and the other drone's wake is one of them; what changes
/// a jet changes nothing then until the wake is taken.
#[must_use]
pub fn library(forces: &Forces, alone: bool) -> Vec<Candidate> {
    let shows = shows(forces, alone);
    let mut candidates = Vec::new();
    let is_below = forces.judged().any(|(_, step)| !step.above.is_empty());
    if alone && is_below {
        candidates.push(downwash());
    }
    if is_below {
        candidates.extend(of_the_jet(&shows));
        candidates.extend(of_the_surroundings(&shows));
        candidates.extend(impingement(&shows));
    }
    candidates.extend(of_the_receiver(&shows));
    candidates.extend(of_motion());
    candidates.extend(of_the_force());
    // Where the wake itself is a candidate, its strength is its own parameter.
    let is_its_own = |name: &str| alone && name == "momentum_scale";
    candidates
        .iter_mut()
        .filter(|c| c.name == "profile_tail")
        .for_each(edge);
    candidates.retain(|candidate| {
        !NOT_IN_FORCES.contains(&candidate.name) && !is_its_own(candidate.name)
    });
    candidates
}

/// A force is a mean over rotor discs: it tells how much of the jet ends in an edge, not how steep that is. Chosen here: steeper than a normal
/// distribution's, as far as forces tell anything of it.
fn edge(candidate: &mut Candidate) {
    candidate.equation = "f = (1 - tau)/(1 + a xi^2)^2 + tau exp(-ln2 xi^4)";
    candidate.parameters.truncate(1);
    candidate.starts = vec![vec![0.4], vec![1.0], vec![-0.2]];
    candidate.set = |p, h| {
        h.effects.profile_tail = Some(airflow::effects::ProfileTail {
            share: p[0],
            steepness: 2.0,
        });
    };
}

fn shows(forces: &Forces, alone: bool) -> Shows {
    let vehicles = || forces.recordings.iter().flat_map(|r| &r.vehicles);
    let ratio = |v: &crate::record::recording::Vehicle| {
        v.airframe.propeller_diameter_m() / v.airframe.motor_distance_m()
    };
    let low = vehicles().map(ratio).fold(f64::INFINITY, f64::min);
    let high = vehicles().map(ratio).fold(0.0, f64::max);
    let lowest_m = forces.judged().map(|(_, step)| step.height_m);
    Shows {
        air: !alone,
        probes: false,
        hover_mps: 4.5,
        jets: forces
            .judged()
            .map(|(_, step)| step.above.len())
            .max()
            .unwrap_or(0),
        sizes_differ: high > 1.03 * low,
        near: false,
        // Five propeller radii of a large drone, ten of a small one: ground effect ends there.
        floor: lowest_m.fold(f64::INFINITY, f64::min) < 0.25,
        ceiling: false,
        moves: true,
        climbs: true,
        battery: true,
        receiver_moves: false,
        axial_only: false,
        span_s: [0.0, 60.0],
        fastest: 1.0,
    }
}

fn downwash() -> Candidate {
    Candidate {
        name: "downwash",
        kind: Kind::Physics,
        equation: "U = f U_jet(s, r) of every drone above; F = (tau(U/U_H) - 1) T",
        story: "the drone flies in the wake of another one above it, which pushes it down",
        parameters: vec![parameter("f", "1", [0.0, 2.5], 0.0, 0.1)],
        essential: 1,
        starts: vec![vec![0.7]],
        set: |p, h| h.downwash = Some(p[0]),
    }
}

/// The other drone's jet stops at the floor; its wall jet is horizontal and pushes nobody down.
fn impingement(shows: &Shows) -> Option<Candidate> {
    shows.floor.then(|| Candidate {
        name: "ground_impingement",
        kind: Kind::Physics,
        equation: "U -> U (1 - exp(-(h/(c r_f))^2))",
        story: "the other drone's jet stops above the floor",
        parameters: vec![parameter("c", "1", [0.02, 3.0], 0.02, 0.3)],
        essential: 1,
        starts: vec![vec![0.8]],
        set: |p, h| {
            h.effects.ground_impingement = Some(airflow::effects::GroundImpingement {
                reach: p[0],
                wall_jet: 1.0,
            });
        },
    })
}

fn of_motion() -> Vec<Candidate> {
    vec![
        own_motion(),
        Candidate {
            name: "body_drag",
            kind: Kind::Physics,
            equation: "F = -1/2 rho a l^2 w |w|, w = U + V_z",
            story: "the frame itself stands in the air that passes it",
            parameters: vec![parameter("a", "1", [0.0, 0.6], 0.0, 0.05)],
            essential: 1,
            // From nothing to a frame that covers half of the squared motor distance.
            starts: vec![vec![0.1]],
            set: |p, h| h.effects.body_drag = Some(BodyDrag { area_over_l2: p[0] }),
        },
    ]
}

/// Faults of the force itself: accelerometer, thrust map, clocks.
fn of_the_force() -> Vec<Candidate> {
    vec![
        Candidate {
            name: "sensor_gain",
            kind: Kind::Sensor,
            equation: "F -> (1 + g) F",
            story: "every simulated force is too large or too small by one factor",
            // A thrust map that carries its drone in free flight cannot be further off than this.
            parameters: vec![parameter("g", "1", [-0.3, 0.3], 0.0, 0.07)],
            essential: 1,
            starts: vec![vec![0.08]],
            set: |p, h| h.sensor.gain = p[0],
        },
        Candidate {
            name: "sensor_offset",
            kind: Kind::Sensor,
            equation: "F -> F + b",
            story: "the accelerometer or the thrust map is off by one amount in all flights",
            parameters: vec![parameter("b", "N", [-0.05, 0.05], 0.0, 0.005)],
            essential: 1,
            starts: vec![vec![0.005]],
            set: |p, h| h.sensor.offset = p[0],
        },
        Candidate {
            name: "sensor_drift",
            kind: Kind::Sensor,
            equation: "F -> F + b' t",
            story: "the accelerometer or the thrust map drifts in the same way in all flights",
            parameters: vec![parameter("b'", "N/h", [-3.0, 3.0], 0.0, 0.3)],
            essential: 1,
            starts: vec![vec![0.3]],
            set: |p, h| h.sensor.offset_drift_per_h = p[0],
        },
        Candidate {
            name: "sensor_lag",
            kind: Kind::Sensor,
            equation: "tau F' = F_met - F",
            story: "the force arrives later than the air: rotors and drones answer with a lag",
            parameters: vec![parameter("tau", "s", [0.0, 1.0], 0.0, 0.03)],
            essential: 1,
            starts: vec![vec![0.05]],
            set: |p, h| h.sensor.lag_s = p[0],
        },
        Candidate {
            name: "clock_misalignment",
            kind: Kind::Sensor,
            equation: "the other drones' tracks are read at t + dt",
            story: "the clocks of drones above and below disagree, in all flights alike",
            parameters: vec![parameter("dt", "s", [-0.5, 0.5], 0.0, 0.04)],
            essential: 1,
            starts: vec![vec![-0.08], vec![0.08]],
            set: |p, h| h.sensor.clock_s = p[0],
        },
    ]
}
