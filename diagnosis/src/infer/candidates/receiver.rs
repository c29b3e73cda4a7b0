//! How a drone answers to air.

use airflow::effects::{BatterySag, CeilingEffect, GroundEffectThrust, OwnMotion, ReceiverInflow};

use super::{Candidate, Kind, Shows, parameter};

/// What a drone's own speed does to the air that it meets.
pub(crate) fn own_motion() -> Candidate {
    Candidate {
        name: "own_motion",
        kind: Kind::Physics,
        equation: "alpha -> alpha + kappa V_z/U_H, T -> T (1 + b (V_h/U_H)^2)",
        story: "a drone that climbs meets air from above, one that flies forward finds fresh air",
        parameters: vec![
            parameter("kappa", "1", [-2.0, 4.0], 0.0, 0.2),
            parameter("b", "1", [-3.0, 6.0], 0.0, 0.5),
        ],
        essential: 2,
        starts: vec![vec![0.5, 0.2]],
        set: |p, h| {
            h.effects.own_motion = Some(OwnMotion {
                climb: p[0],
                forward: p[1],
            });
        },
    }
}

pub(crate) fn of_the_receiver(shows: &Shows) -> Vec<Candidate> {
    let mut candidates = Vec::new();
    if shows.air {
        candidates.push(Candidate {
            name: "receiver_inflow",
            kind: Kind::Physics,
            equation: "alpha -> eta alpha",
            story: "the rotors feel more or less of the air from above than momentum theory has it",
            parameters: vec![parameter("eta", "1", [0.0, 2.5], 1.0, 0.06)],
            essential: 1,
            starts: vec![vec![0.8], vec![1.2]],
            set: |p, h| h.effects.receiver_inflow = Some(ReceiverInflow { factor: p[0] }),
        });
    }
    if shows.receiver_moves {
        candidates.push(own_motion());
    }
    if shows.battery {
        candidates.push(Candidate {
            name: "battery_sag",
            kind: Kind::Physics,
            equation: "throttle -> throttle (1 + k (V0 - V)/V0)",
            story: "as the battery weakens, the same thrust takes more throttle",
            parameters: vec![parameter("k", "1", [-2.0, 4.0], 0.0, 0.1)],
            essential: 1,
            starts: vec![vec![0.5]],
            set: |p, h| h.effects.battery_sag = Some(BatterySag { sensitivity: p[0] }),
        });
    }
    if shows.floor {
        candidates.push(Candidate {
            name: "ground_effect_thrust",
            kind: Kind::Physics,
            equation: "T/T_inf = 1 + c_a exp(-c_b z/R)",
            story: "near the floor the same throttle lifts more",
            parameters: vec![
                parameter("c_a", "1", [-0.5, 3.0], 0.0, 0.05),
                parameter("c_b", "1", [0.05, 3.0], 0.5, 1.0),
            ],
            essential: 1,
            starts: vec![vec![0.2, 0.5], vec![0.2, 0.2]],
            set: |p, h| {
                h.effects.ground_effect_thrust = Some(GroundEffectThrust {
                    gain: p[0],
                    decay: p[1],
                });
            },
        });
    }
    if shows.ceiling {
        candidates.push(Candidate {
            name: "ceiling_effect",
            kind: Kind::Physics,
            equation: "T/T_inf = 1/(1 - c (R/(z_c + R/4))^2)",
            story: "below a ceiling the rotors draw themselves up",
            parameters: vec![parameter("c", "1", [-0.2, 0.9], 0.0, 0.05)],
            essential: 1,
            starts: vec![vec![0.1]],
            set: |p, h| h.effects.ceiling_effect = Some(CeilingEffect { strength: p[0] }),
        });
    }
    candidates
}
