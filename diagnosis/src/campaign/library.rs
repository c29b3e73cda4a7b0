//! What may be missing in the vertical force on a drone.

use airflow::effects::{GroundImpingement, ProfileTail};

use super::forces::Forces;
use super::scatter::heaviest_n;
use crate::infer::candidates::{
    BODY_DRAG, CLOCK, Candidate, Change, DRIFT, Fault, GAIN, GROUND_IMPINGEMENT, Kind, LAG,
    OF_THE_AIR, OF_THE_RECEIVER, OFFSET, OWN_MOTION, Parameter, Scope, Shows, lag_factor, lean,
    merging, shown, sizes_differ,
};

/// Effects of the jet that no vertical force can show, or that another name here stands for.
const NOT_IN_FORCES: [&str; 7] = [
    "crossflow",
    "swirl",
    "payload_mass",
    "recirculation",
    "ceiling_effect",
    "entrainment_radial",
    "near_field",
];

/// Weight of the drones whose forces the ranges of [`OF_THE_FORCE`] are made for (N): 34 g.
const CRAZYFLIE_N: f64 = 0.334;

/// Candidates for the forces of a campaign, physics first. With `alone` there is no wake, and the
/// other drone's wake is one of them; what changes a jet changes nothing then until the wake is
/// taken.
pub(super) fn library(forces: &Forces, alone: bool) -> Vec<Candidate> {
    let shows = shows(forces, alone);
    let mut candidates = Vec::new();
    let is_below = forces.judged().any(|(_, step)| !step.above.is_empty());
    if alone && is_below {
        candidates.push(downwash());
    }
    if is_below {
        candidates.extend(shown(OF_THE_AIR, &shows));
        candidates.extend(shows.floor.then(|| {
            let mut impingement = GROUND_IMPINGEMENT.candidate(&shows);
            stops_at_the_floor(&mut impingement);
            impingement
        }));
    }
    candidates.extend(shown(OF_THE_RECEIVER, &shows));
    candidates.extend([OWN_MOTION, BODY_DRAG].map(|trial| trial.candidate(&shows)));
    candidates.extend(OF_THE_FORCE.iter().map(|fault| fault.candidate(&shows)));
    // An amount that is far off for a Crazyflie is little of a drone of half a kilogram.
    let over = (heaviest_n(forces) / CRAZYFLIE_N).max(1.0);
    let amounts = [OFFSET.name, DRIFT.name];
    let amounts = candidates.iter_mut().filter(|c| amounts.contains(&c.name));
    for parameter in amounts.flat_map(|candidate| &mut candidate.parameters) {
        parameter.low *= over;
        parameter.high *= over;
    }
    // Where the wake itself is a candidate, its strength is its own parameter.
    let is_its_own = |name: &str| alone && name == "momentum_scale";
    let tails = candidates.iter_mut().filter(|c| c.name == "profile_tail");
    tails.for_each(edge);
    candidates.retain(|c| !NOT_IN_FORCES.contains(&c.name) && !is_its_own(c.name));
    candidates
}

/// A force is a mean over rotor discs: it tells how much of the jet ends in an edge, not how steep
/// that is. Chosen here: steeper than a normal distribution's, as far as forces tell anything of
/// it.
fn edge(candidate: &mut Candidate) {
    candidate.equation = "f = (1 - tau)/(1 + a xi^2)^2 + tau exp(-ln2 xi^4)";
    candidate.parameters.truncate(1);
    candidate.starts = vec![vec![0.4], vec![1.0], vec![-0.2]];
    candidate.change = Change::Hypothesis(|p, h| {
        h.effects.profile_tail = Some(ProfileTail {
            share: p[0],
            steepness: 2.0,
        });
    });
}

fn shows(forces: &Forces, alone: bool) -> Shows {
    let jets = forces.judged().map(|(_, step)| step.above.len());
    let has_battery = forces
        .judged()
        .any(|(_, step)| step.voltage_ratio.is_some());
    let baseline = forces.recordings.first().map(|one| one.baseline);
    let baseline = baseline.unwrap_or_default();
    let lowest_m = forces.judged().map(|(_, step)| step.height_m);
    Shows {
        air: !alone,
        probes: false,
        hover_mps: 4.5,
        jets: jets.max().unwrap_or(0),
        sizes_differ: sizes_differ(forces.recordings.iter().flat_map(|r| &r.vehicles)),
        near: false,
        // Five propeller radii of a large drone, ten of a small one: ground effect ends there.
        floor: lowest_m.fold(f64::INFINITY, f64::min) < 0.25,
        ceiling: false,
        moves: true,
        leans: lean(forces.recordings.iter().flat_map(|r| &r.vehicles)),
        climbs: true,
        battery: has_battery,
        receiver_moves: false,
        receiver_travels: true,
        axial_only: false,
        merging: merging(&baseline),
        lag_factor: lag_factor(&baseline),
        span_s: [0.0, 60.0],
        fastest: 1.0,
    }
}

fn downwash() -> Candidate {
    Candidate {
        name: "downwash",
        kind: Kind::Physics,
        equation: "U = f U_jet(s, r) of every drone above; F = (tau(U/U_H) - 1) T",
        description: "the drone flies in the wake of another one above it, which pushes it down",
        parameters: vec![Parameter::new("f", "1", [0.0, 2.5], 0.1)],
        essential: 1,
        starts: vec![vec![0.7]],
        closure_error: 0.0,
        settled_by: "",
        change: Change::Hypothesis(|p, h| h.downwash = Some(p[0])),
        scope: Scope::Whole,
    }
}

/// The other drone's jet stops at the floor; its wall jet is horizontal and pushes no drone down.
fn stops_at_the_floor(candidate: &mut Candidate) {
    candidate.equation = "U -> U (1 - exp(-(h/(c r_f))^2))";
    candidate.description = "the other drone's jet stops above the floor";
    candidate.parameters = vec![Parameter {
        neutral: 0.02,
        ..Parameter::new("c", "1", [0.02, 3.0], 0.3)
    }];
    candidate.essential = 1;
    candidate.starts = vec![vec![0.8]];
    candidate.change = Change::Hypothesis(|p, h| {
        h.effects.ground_impingement = Some(GroundImpingement {
            reach: p[0],
            wall_jet: 1.0,
        });
    });
}

/// Faults of the force itself: accelerometer, thrust map, clocks.
const OF_THE_FORCE: [Fault; 5] = [
    Fault {
        equation: "F -> (1 + g) F",
        description: "every simulated force is too large or too small by one factor",
        // A thrust map that carries its drone in free flight cannot be further off than this.
        parameters: &[Parameter::new("g", "1", [-0.3, 0.3], 0.07)],
        ..GAIN
    },
    Fault {
        equation: "F -> F + b",
        description: "the accelerometer or the thrust map is off by one amount in all flights",
        parameters: &[Parameter::new("b", "N", [-0.05, 0.05], 0.005)],
        starts: &[0.005],
        ..OFFSET
    },
    Fault {
        equation: "F -> F + b' t",
        description: "the accelerometer or the thrust map drifts in the same way in all flights",
        parameters: &[Parameter::new("b'", "N/h", [-3.0, 3.0], 0.3)],
        starts: &[0.3],
        is_over_hours: false,
        change: |p, h| h.sensor.offset_drift_per_h = p[0],
        ..DRIFT
    },
    Fault {
        equation: "tau F' = F_met - F",
        description: "the force arrives later than the air: rotors and drones answer with a lag",
        parameters: &[Parameter::new("tau", "s", [0.0, 1.0], 0.03)],
        starts: &[0.05],
        ..LAG
    },
    Fault {
        equation: "the other drones' tracks are read at t + dt",
        description: "the clocks of drones above and below disagree, in all flights alike",
        parameters: &[Parameter::new("dt", "s", [-0.5, 0.5], 0.04)],
        starts: &[-0.08, 0.08],
        ..CLOCK
    },
];
