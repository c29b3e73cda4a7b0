//! What a jet meets: loads, motion, floor, room.

use airflow::effects::{
    ClimbDescent, GroundImpingement, PayloadMass, Recirculation, WakeTransport,
};

use super::{Candidate, Kind, Shows, parameter};

pub(crate) fn of_the_surroundings(shows: &Shows) -> Vec<Candidate> {
    let [from_s, to_s] = shows.span_s;
    let at = |share: f64| from_s + share * (to_s - from_s);
    let mut candidates = vec![Candidate {
        name: "payload_mass",
        kind: Kind::Physics,
        equation: "U -> U sqrt(m/m0) from t0 on",
        story: "the drone is heavier or lighter than stated",
        parameters: vec![
            parameter("m/m0", "1", [0.3, 3.0], 1.0, 0.1),
            parameter("t0", "s", [from_s, to_s], from_s, to_s - from_s),
        ],
        essential: 1,
        starts: vec![vec![1.1, at(0.3)], vec![1.1, at(0.5)], vec![1.1, at(0.7)]],
        set: |p, h| {
            h.effects.payload_mass = Some(PayloadMass {
                mass_factor: p[0],
                since_s: p[1],
                until_s: f64::INFINITY,
            });
        },
    }];
    if shows.moves {
        candidates.push(Candidate {
            name: "wake_transport",
            kind: Kind::Physics,
            equation: "tau(s) = m l (sigma^2 - s0^2)/(2 B U_H)",
            story: "the air at a depth left its drone a while ago, when the drone was elsewhere",
            parameters: vec![parameter("m", "1", [0.0, 3.0], 0.0, 0.3)],
            essential: 1,
            starts: vec![vec![1.0], vec![2.0]],
            set: |p, h| h.effects.wake_transport = Some(WakeTransport { lag_factor: p[0] }),
        });
    }
    if shows.climbs {
        candidates.push(Candidate {
            name: "climb_descent",
            kind: Kind::Physics,
            equation: "U -> U (v_i/v_h)^p, v_i/v_h = -x/2 + sqrt(x^2/4 + 1), x = V_z/v_h",
            story: "a climbing drone blows less, a sinking one more",
            parameters: vec![parameter("p", "1", [0.0, 3.0], 0.0, 0.5)],
            essential: 1,
            starts: vec![vec![1.0]],
            set: |p, h| h.effects.climb_descent = Some(ClimbDescent { exponent: p[0] }),
        });
    }
    if shows.floor && shows.probes {
        candidates.push(Candidate {
            name: "ground_impingement",
            kind: Kind::Physics,
            equation: "U -> U (1 - exp(-(h/(c r_f))^2)), wall jet u = a 1.32 (sqrt J/H)(r/H)^-1.1",
            story: "the jet stops at the floor and spreads along it",
            parameters: vec![
                parameter("a", "1", [0.0, 4.0], 0.0, 0.2),
                parameter("c", "1", [0.05, 3.0], 0.05, 0.2),
            ],
            essential: 2,
            starts: vec![vec![0.8, 0.8], vec![0.3, 0.3]],
            set: |p, h| {
                h.effects.ground_impingement = Some(GroundImpingement {
                    reach: p[1],
                    wall_jet: p[0],
                });
            },
        });
    }
    if shows.probes {
        candidates.push(Candidate {
            name: "recirculation",
            kind: Kind::Physics,
            equation: "u_r(t) = u (1 - exp(-t/tau)), of which e rises",
            story: "the jets set the room in motion: a draught that grows after take-off, part of it upwards against the jets",
            parameters: vec![
                parameter("u", "m/s", [0.0, 2.0], 0.0, 0.1),
                parameter("tau", "s", [5.0, 3000.0], 120.0, 1000.0),
                parameter("e", "1", [-1.0, 1.0], 0.0, 1.0),
            ],
            essential: 1,
            starts: vec![
                vec![0.2, 60.0, 0.3],
                vec![0.2, 400.0, 0.3],
                vec![0.2, 120.0, -0.3],
            ],
            set: |p, h| {
                h.effects.recirculation = Some(Recirculation {
                    speed_mps: p[0],
                    time_s: p[1],
                    rise: p[2],
                });
            },
        });
    }
    candidates
}
