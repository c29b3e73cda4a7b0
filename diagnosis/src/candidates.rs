//! What may be missing: every effect and every sensor fault, with its parameters, their bounds, and the size from which it matters.

use airflow::effects::{
    BatterySag, Buoyancy, CeilingEffect, ClimbDescent, Crossflow, DlRatio, EntrainmentRadial,
    GroundEffectThrust, GroundImpingement, JetMerging, MomentumScale, NearFieldShape, PayloadMass,
    ProfileTail, ReceiverInflow, Recirculation, RotorCant, Swirl, WakeTilt, WakeTransport, Wander,
};
use serde::{Deserialize, Serialize};

use crate::baseline::{Observation, Upper};
use crate::hypothesis::Hypothesis;
use crate::observed::Observed;
use crate::recording::Role;
use crate::simulate::Channel;

/// Whether an effect is one of the air or of an instrument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Of the air, or of how a drone answers to it.
    Physics,
    /// Of an instrument or a clock.
    Sensor,
}

/// One parameter of a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// As in the equation.
    pub name: &'static str,
    /// Its unit; 1 for a ratio.
    pub unit: &'static str,
    /// Lowest value that the fit may take.
    pub low: f64,
    /// Highest.
    pub high: f64,
    /// The value at which the effect vanishes.
    pub neutral: f64,
    /// Distance from there below which nobody would act on it.
    pub practical: f64,
}

/// One thing that may be missing.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Canonical name.
    pub name: &'static str,
    /// Of the air or of the sensor.
    pub kind: Kind,
    /// Its equation, with the parameters' names in it.
    pub equation: &'static str,
    /// What happens, in one sentence.
    pub story: &'static str,
    /// Its parameters. Those after the first `essential` shape the effect but cannot make it vanish.
    pub parameters: Vec<Parameter>,
    /// How many of the parameters make it vanish when they are neutral.
    pub essential: usize,
    /// Where fits begin.
    pub starts: Vec<Vec<f64>>,
    /// Puts values of the parameters into a hypothesis.
    pub set: fn(&[f64], &mut Hypothesis),
}

impl Candidate {
    /// How large a fitted effect is, in units of what matters: below 1 nobody would act on it.
    #[must_use]
    pub fn size(&self, values: &[f64]) -> f64 {
        let parts = self.parameters.iter().zip(values).take(self.essential);
        let squares = parts.map(|(parameter, value)| {
            let part = (value - parameter.neutral) / parameter.practical;
            part * part
        });
        squares.sum::<f64>().sqrt()
    }

    /// The hypothesis with its parameters at these values.
    #[must_use]
    pub fn on(&self, base: &Hypothesis, values: &[f64]) -> Hypothesis {
        let mut hypothesis = *base;
        (self.set)(values, &mut hypothesis);
        hypothesis
    }
}

pub(crate) fn parameter(
    name: &'static str,
    unit: &'static str,
    bounds: [f64; 2],
    neutral: f64,
    practical: f64,
) -> Parameter {
    let [low, high] = bounds;
    Parameter {
        name,
        unit,
        low,
        high,
        neutral,
        practical,
    }
}

/// Everything that a recording could show, physics first; what it could not (a second jet's sum with one drone, a floor far below) is left out.
#[must_use]
pub fn applicable(observed: &Observed) -> Vec<Candidate> {
    let shows = Shows::of(observed);
    let mut candidates = Vec::new();
    if shows.air {
        candidates.extend(of_the_jet(&shows));
        candidates.extend(of_the_surroundings(&shows));
    }
    if observed.channel == Channel::Throttle {
        candidates.extend(of_the_receiver(&shows));
    }
    candidates.extend(of_the_sensor(&shows, observed));
    candidates
}

/// What a recording has that effects need.
pub(crate) struct Shows {
    pub(crate) air: bool,
    pub(crate) probes: bool,
    pub(crate) hover_mps: f64,
    pub(crate) jets: usize,
    pub(crate) sizes_differ: bool,
    pub(crate) near: bool,
    pub(crate) floor: bool,
    pub(crate) ceiling: bool,
    pub(crate) moves: bool,
    pub(crate) climbs: bool,
    pub(crate) battery: bool,
    pub(crate) axial_only: bool,
    pub(crate) span_s: [f64; 2],
    pub(crate) fastest: f64,
}

impl Shows {
    fn of(observed: &Observed) -> Shows {
        let recording = observed.recording;
        let density = recording.environment.air.density_kg_per_m3();
        let emitters: Vec<_> = recording
            .vehicles
            .iter()
            .filter(|vehicle| vehicle.role != Role::Receiver && recording.baseline.wakes)
            .collect();
        let hover = |v: &&crate::recording::Vehicle| {
            v.airframe
                .hover_induced_velocity_mps(v.airframe.mass_kg(), density)
        };
        let ratio = |v: &&crate::recording::Vehicle| {
            v.airframe.propeller_diameter_m() / v.airframe.motor_distance_m()
        };
        let range = |name: &str| {
            let column = observed.covariate(name).unwrap_or_default();
            let low = column.iter().copied().fold(f64::INFINITY, f64::min);
            let high = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            [low, high]
        };
        let share = |name: &str, test: &dyn Fn(f64) -> bool| {
            let column = observed.covariate(name).unwrap_or_default();
            column.iter().filter(|x| test(**x)).count() as f64 / column.len().max(1) as f64
        };
        let [ratio_low, ratio_high] = emitters
            .iter()
            .map(ratio)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], r| {
                [low.min(r), high.max(r)]
            });
        let fastest = observed
            .samples
            .iter()
            .map(|s| s.recorded)
            .fold(0.0, f64::max);
        Shows {
            air: !emitters.is_empty(),
            probes: observed.channel == Channel::Speed,
            hover_mps: emitters.iter().map(hover).fold(0.1, f64::max),
            jets: emitters.len(),
            // 3 %: what the exponent could do then is below any noise.
            sizes_differ: ratio_high > 1.03 * ratio_low,
            near: share("s/l", &|s| (0.0..2.5).contains(&s)) > 0.005
                && recording.baseline.upper == Upper::FarFieldExtrapolated,
            floor: recording.environment.floor_z_m.is_some()
                && share("height/half-width", &|h| h < 2.5) > 0.005,
            ceiling: recording.environment.ceiling_z_m.is_some(),
            // The paper's limit for hover is 0.1 m/s.
            moves: share("emitter speed m/s", &|v| v > 0.1) > 0.02,
            climbs: share("climb m/s", &|v| v.abs() > 0.1) > 0.02,
            battery: {
                let [low, high] = range("battery V");
                low > 0.0 && high > 1.01 * low
            },
            axial_only: recording.baseline.observation == Observation::AxialAndAmbient,
            span_s: range("time s"),
            fastest,
        }
    }
}

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

fn of_the_sensor(shows: &Shows, observed: &Observed) -> Vec<Candidate> {
    let unit = if shows.probes { "m/s" } else { "1" };
    let offset = if shows.probes { 1.5 } else { 0.3 };
    // Beyond what the maker allows: that much is fitted everywhere.
    let offset_practical = if shows.probes { 0.08 } else { 0.02 };
    let mut candidates = vec![
        Candidate {
            name: "sensor_gain",
            kind: Kind::Sensor,
            equation: "y -> (1 + g) y",
            story: "the sensor reads too much or too little by one factor",
            parameters: vec![parameter("g", "1", [-0.6, 0.9], 0.0, 0.07)],
            essential: 1,
            starts: vec![vec![0.08]],
            set: |p, h| h.sensor.gain = p[0],
        },
        Candidate {
            name: "sensor_offset",
            kind: Kind::Sensor,
            equation: "y -> y + b",
            story: "the sensor reads too much or too little by one amount",
            parameters: vec![parameter(
                "b",
                unit,
                [-offset, offset],
                0.0,
                offset_practical,
            )],
            essential: 1,
            starts: vec![vec![offset_practical]],
            set: |p, h| h.sensor.offset = p[0],
        },
    ];
    if shows.moves || observed.channel == Channel::Speed {
        candidates.push(Candidate {
            name: "sensor_lag",
            kind: Kind::Sensor,
            equation: "tau y' = x - y",
            story: "the sensor is slow",
            parameters: vec![parameter("tau", "s", [0.0, 8.0], 0.0, 0.25)],
            essential: 1,
            starts: vec![vec![0.8]],
            set: |p, h| h.sensor.lag_s = p[0],
        });
        candidates.push(Candidate {
            name: "clock_misalignment",
            kind: Kind::Sensor,
            equation: "y(t) -> y(t + dt)",
            story: "the drones' clock and the sensors' disagree",
            parameters: vec![parameter("dt", "s", [-4.0, 4.0], 0.0, 0.15)],
            essential: 1,
            // A pass through a jet lasts a second: the fit must begin within half of one.
            starts: (-10..=10)
                .filter(|step| *step != 0)
                .map(|step| vec![0.4 * f64::from(step)])
                .collect(),
            set: |p, h| h.sensor.clock_s = p[0],
        });
    }
    if shows.probes {
        candidates.push(Candidate {
            name: "sensor_drift",
            kind: Kind::Sensor,
            equation: "y -> (1 + g' t) y + b' t",
            story: "the sensor's calibration drifts with time",
            parameters: vec![
                parameter("g'", "1/h", [-6.0, 6.0], 0.0, 0.2),
                parameter(
                    "b'",
                    if shows.probes { "m/s/h" } else { "1/h" },
                    [-6.0, 6.0],
                    0.0,
                    0.3,
                ),
            ],
            essential: 2,
            starts: vec![vec![0.1, 0.1], vec![-0.1, -0.1]],
            set: |p, h| {
                h.sensor.gain_drift_per_h = p[0];
                h.sensor.offset_drift_per_h = p[1];
            },
        });
        candidates.push(Candidate {
            name: "sensor_saturation",
            kind: Kind::Sensor,
            equation: "y -> min(y, y_max)",
            story: "the sensor does not read above a ceiling",
            parameters: vec![parameter(
                "y_max",
                "m/s",
                [0.2 * shows.fastest, 1.3 * shows.fastest],
                1.3 * shows.fastest,
                0.2 * shows.fastest,
            )],
            essential: 1,
            starts: vec![vec![0.95 * shows.fastest]],
            set: |p, h| h.sensor.saturation = p[0],
        });
    }
    if shows.probes && shows.axial_only {
        candidates.push(Candidate {
            name: "magnitude_sensor",
            kind: Kind::Sensor,
            equation: "y = sqrt(U^2 + kappa^2 V^2 + a^2)",
            story: "the probe sees the air that is drawn in, which the simulation leaves out",
            parameters: vec![parameter("kappa", "1", [0.0, 2.5], 0.0, 0.5)],
            essential: 1,
            starts: vec![vec![0.8]],
            set: |p, h| h.effects.entrainment_radial = Some(EntrainmentRadial { factor: p[0] }),
        });
    }
    candidates
}
