//! What may be wrong with a jet itself.

use airflow::effects::{
    Buoyancy, Crossflow, DlRatio, EntrainmentRadial, JetMerging, MomentumScale, NearFieldShape,
    ProfileTail, RotorCant, Swirl, WakeTilt, Wander,
};

use super::{Candidate, Kind, Shows, parameter};

pub(crate) fn of_the_jet(shows: &Shows) -> Vec<Candidate> {
    let wind = 0.4 * shows.hover_mps;
    let gust = 0.06 * shows.hover_mps;
    let mut candidates = vec![
        Candidate {
            name: "crossflow",
            kind: Kind::Physics,
            equation: "integral jet in a wind (W_x, W_y): dM_x/ds = W dQ/ds + F, Q' = 2 pi b (alpha |u - W cos| + 0.34 |W sin|)",
            story: "wind bends the jet downwind, weakens it, and leaves a draught beside it",
            parameters: vec![
                parameter("wind_x", "m/s", [-wind, wind], 0.0, 0.08),
                parameter("wind_y", "m/s", [-wind, wind], 0.0, 0.08),
            ],
            essential: 2,
            starts: vec![
                vec![gust, 0.0],
                vec![-gust, 0.0],
                vec![0.0, gust],
                vec![0.0, -gust],
            ],
            set: |p, h| {
                h.effects.crossflow = Some(Crossflow {
                    wind_mps: [p[0], p[1]],
                })
            },
        },
        Candidate {
            name: "wake_tilt",
            kind: Kind::Physics,
            equation: "x(s) = s tan(lean)",
            story: "the jet leaves its drone at an angle",
            parameters: vec![
                parameter("lean_x", "1", [-0.4, 0.4], 0.0, 0.02),
                parameter("lean_y", "1", [-0.4, 0.4], 0.0, 0.02),
            ],
            essential: 2,
            starts: vec![
                vec![0.03, 0.03],
                vec![-0.03, -0.03],
                vec![0.03, -0.03],
                vec![-0.03, 0.03],
            ],
            set: |p, h| h.effects.wake_tilt = Some(WakeTilt { lean: [p[0], p[1]] }),
        },
        Candidate {
            name: "rotor_cant",
            kind: Kind::Physics,
            equation: "r_half -> q r_half, U_C -> U_C/q",
            story: "canted propellers make the jet wider or narrower at the same momentum",
            parameters: vec![parameter("q", "1", [0.7, 1.45], 1.0, 0.05)],
            essential: 1,
            starts: vec![vec![1.1], vec![0.9]],
            set: |p, h| h.effects.rotor_cant = Some(RotorCant { width_factor: p[0] }),
        },
        Candidate {
            name: "wander",
            kind: Kind::Physics,
            equation: "g^2 = 1 + w2 (z(s)/z(6))^2, z = s/(s - s0), r_half -> g r_half, U_C -> U_C/g^2",
            story: "the jet's axis meanders, more with depth, so its mean is wider and slower",
            parameters: vec![parameter("w2", "1", [-0.4, 3.0], 0.0, 0.05)],
            essential: 1,
            starts: vec![vec![0.2], vec![-0.1]],
            set: |p, h| h.effects.wander = Some(Wander { growth: p[0] }),
        },
        Candidate {
            name: "profile_tail",
            kind: Kind::Physics,
            equation: "f = (1 - tau)/(1 + a xi^2)^2 + tau exp(-ln2 xi^(2+n))",
            story: "the jet ends in an edge where the paper's profile has a long tail",
            parameters: vec![
                parameter("tau", "1", [-0.6, 1.6], 0.0, 0.1),
                parameter("n", "1", [-0.6, 4.0], 0.0, 1.0),
            ],
            essential: 1,
            starts: vec![vec![0.4, 0.0], vec![0.6, 2.0], vec![-0.2, 0.0]],
            set: |p, h| {
                h.effects.profile_tail = Some(ProfileTail {
                    share: p[0],
                    steepness: p[1],
                });
            },
        },
        Candidate {
            name: "momentum_scale",
            kind: Kind::Physics,
            equation: "U -> f U",
            story: "the whole jet is stronger or weaker by one factor",
            parameters: vec![parameter("f", "1", [0.4, 1.9], 1.0, 0.06)],
            essential: 1,
            starts: vec![vec![1.05]],
            set: |p, h| h.effects.momentum_scale = Some(MomentumScale { speed_factor: p[0] }),
        },
        Candidate {
            name: "buoyancy",
            kind: Kind::Physics,
            equation: "U_C -> U_C sqrt(1 - c (s/10l)^2)",
            story: "warm air slows on its way down, cold air gains",
            parameters: vec![parameter("c", "1", [-1.0, 1.0], 0.0, 0.15)],
            essential: 1,
            starts: vec![vec![0.1], vec![-0.1]],
            set: |p, h| h.effects.buoyancy = Some(Buoyancy { strength: p[0] }),
        },
        Candidate {
            name: "swirl",
            kind: Kind::Physics,
            equation: "W_theta = k U_C xi/(1 + a xi^2)^2 s0/(s0 - s)",
            story: "the jet turns about its axis",
            parameters: vec![parameter("k", "1", [0.0, 0.8], 0.0, 0.25)],
            essential: 1,
            starts: vec![vec![0.4]],
            set: |p, h| h.effects.swirl = Some(Swirl { ratio: p[0] }),
        },
    ];
    if shows.near {
        candidates.push(Candidate {
            name: "near_field",
            kind: Kind::Physics,
            equation: "U = (1 - lambda) U_far + lambda U_four(D0), s < 2.5 l",
            story: "close below the rotors there are four jets and a slow core, not one jet",
            parameters: vec![
                parameter("lambda", "1", [-0.3, 1.8], 0.0, 0.15),
                parameter("D0", "1", [0.0, 1.0], 0.5, 0.3),
            ],
            essential: 1,
            starts: vec![vec![0.5, 0.5]],
            set: |p, h| {
                h.effects.near_field = Some(NearFieldShape {
                    share: p[0],
                    shadow: p[1],
                });
            },
        });
    }
    if shows.jets > 1 {
        candidates.push(Candidate {
            name: "jet_merging",
            kind: Kind::Physics,
            equation: "U = (sum U_i^q)^(1/q)",
            story: "jets side by side merge, and their speeds do not simply add",
            parameters: vec![parameter("q", "1", [0.7, 4.0], 1.0, 0.1)],
            essential: 1,
            starts: vec![vec![1.4]],
            set: |p, h| h.effects.jet_merging = Some(JetMerging { exponent: p[0] }),
        });
    }
    if shows.sizes_differ {
        candidates.push(Candidate {
            name: "dl_ratio",
            kind: Kind::Physics,
            equation: "U_C ~ U_H l (d/(0.53 l))^p",
            story: "jets scale with the size of the propellers, not with the motor distance alone",
            parameters: vec![parameter("p", "1", [-0.5, 1.5], 0.0, 0.2)],
            essential: 1,
            starts: vec![vec![0.4]],
            set: |p, h| h.effects.dl_ratio = Some(DlRatio { exponent: p[0] }),
        });
    }
    if shows.probes && !shows.axial_only {
        candidates.push(Candidate {
            name: "entrainment_radial",
            kind: Kind::Physics,
            equation: "V -> kappa V",
            story: "the jet draws in more or less air than its mean profile asks for",
            parameters: vec![parameter("kappa", "1", [0.0, 3.0], 1.0, 0.4)],
            essential: 1,
            starts: vec![vec![1.4]],
            set: |p, h| h.effects.entrainment_radial = Some(EntrainmentRadial { factor: p[0] }),
        });
    }
    candidates
}
