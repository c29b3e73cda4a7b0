//! Advected wakes: air leaves a drone at its real place, and arrives below after its delay.
//!
//! All air that left one drone lies along its streakline. What left an age `τ` ago has come down by
//!
//! ```text
//! s(τ) = l (√(s₀² + 2 k B U τ/l) + s₀)
//! ```
//!
//! the inverse of `τ(s) = l (σ² - s₀²)/(2 B U k)`, with the `U` of the moment it left. So at any
//! moment the streakline is a chain of places, one for each moment of the past, and a receiver is
//! exposed where the chain crosses its height. A drone that sinks faster than its air, or whose
//! thrust has just risen, is crossed several times: of these the strongest counts, as in the
//! verifier. The chain is cut at ages at which the air has come down by `LINK_M` more; what crosses
//! a height twice between two cuts is ignored.
//!
//! The strength of air is that of a drone hovering with the thrust of the moment it left: `U` goes
//! with the root of the thrust. Where wind or warmth bend a jet, its shape is that of the nearest
//! of the masses that are flown. Cross-flow of the drone's own motion does not weaken it: no
//! measurement says by how much it would.

use std::collections::VecDeque;

use airflow::{DiscPoints, Superposition, Wake};
use nalgebra::{Point3, Vector2, Vector3};
use planner::verify::FAINTEST_WAKE_MPS;

use crate::gusts::JetAt;

/// The chain is cut where the air has come down by so much more (m): chosen here, half of the
/// width of a wake some metres down.
pub(crate) const LINK_M: f64 = 0.5;

/// One moment of a drone's past.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterMoment {
    /// Centre of the rotor plane (m).
    pub position_m: Point3<f64>,
    /// Induced velocity over that of the emitter's wake: the root of the thrust over its weight; 0:
    /// no wake.
    pub strength: f64,
    /// Horizontal over vertical of the air that leaves (x, y); zeros: straight down.
    pub lean: [f64; 2],
    /// Height at which air of this moment ends (m).
    pub ends_at_z_m: f64,
}

/// A drone as a source of air: its wake, and where it was.
#[derive(Clone, Debug)]
pub struct Emitter {
    wake: Wake,
    /// The same drone's wakes at other masses, where their shape goes with it, with the strength
    /// that they have.
    loaded_wakes: Vec<(f64, Wake)>,
    convection: f64,
    /// Ages (steps) at which its streakline is cut.
    cuts: Vec<usize>,
    /// For each cut, how far from the axis the air of a strength of [`USUAL_STRENGTH`] counts (m).
    reach_m: Vec<f64>,
    /// From the latest on, `step_s` apart.
    past: VecDeque<EmitterMoment>,
    step_s: f64,
}

/// Air of one emitter at a height.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parcel<'a> {
    wake: &'a Wake,
    /// Axis at that height, less the shift of a moved wake (m).
    from_m: Point3<f64>,
    strength: f64,
}

/// A part of a streakline between two cuts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub(crate) emitter: u32,
    /// Index of the older cut.
    pub(crate) cut: u32,
    /// Heights at both ends (m), the newer end first.
    pub(crate) z_m: [f64; 2],
    /// Middle of both ends (m).
    pub(crate) middle_m: [f64; 2],
    /// Beyond this distance from the middle it is too faint to count (m).
    pub(crate) reach_m: f64,
}

impl Emitter {
    /// A drone that has hovered at a place long enough for its wake to be whole; `wake` at the mass
    /// that strengths refer to, `convection` the speed of its air over the centreline's, `step_s`
    /// between two moments (s). Air is followed down to `deepest_m` below it (m).
    #[must_use]
    pub fn new(wake: Wake, (convection, step_s): (f64, f64), deepest_m: f64) -> Emitter {
        let far = wake.far_field();
        let faint_m = wake.iso_speed_end_m(FAINTEST_WAKE_MPS);
        let oldest_s = far.transport_time_s(deepest_m.min(faint_m), convection);
        let mut cuts = vec![0];
        for n in 1_u32.. {
            let age_s = far.transport_time_s(f64::from(n) * LINK_M, convection);
            let age = (age_s.min(oldest_s) / step_s).ceil() as usize;
            // Near the rotors one step may be longer than a link.
            if age > cuts[cuts.len() - 1] {
                cuts.push(age);
            }
            if age_s >= oldest_s {
                break;
            }
        }
        let reach_m = |&age: &usize| {
            let depth_m = far.transported_m(age as f64 * step_s, convection * USUAL_STRENGTH);
            reach_m(&wake, depth_m, USUAL_STRENGTH)
        };
        Emitter {
            reach_m: cuts.iter().map(reach_m).collect(),
            past: VecDeque::new(),
            wake,
            loaded_wakes: Vec::new(),
            convection,
            cuts,
            step_s,
        }
    }

    /// The same for a drone of `own_kg`, as which its wake is, that weighs so much at times (kg):
    /// wind bends the jet of a laden drone less.
    #[must_use]
    pub fn with_loads(mut self, own_kg: f64, masses_kg: &[f64]) -> Emitter {
        if self.wake.is_shaped() {
            let others = masses_kg.iter().filter(|it| **it != own_kg);
            let wakes = others.map(|&kg| ((kg / own_kg).sqrt(), self.wake.with_mass(kg)));
            self.loaded_wakes = wakes.collect();
        }
        self
    }

    /// The wake whose strength is nearest to one, and what that one is to it.
    fn shaped(&self, strength: f64) -> (&Wake, f64) {
        let own = (1.0, &self.wake);
        let others = self.loaded_wakes.iter().map(|(at, wake)| (*at, wake));
        let off = |at: f64| (at - strength).abs();
        let nearest = others.fold(own, |a, b| if off(b.0) < off(a.0) { b } else { a });
        (nearest.1, strength / nearest.0)
    }

    /// One more moment, a step after the last. Before the first the drone was where it was then.
    pub fn record(&mut self, moment: EmitterMoment) {
        if self.past.len() > self.cuts[self.cuts.len() - 1] {
            self.past.pop_back();
        }
        self.past.push_front(moment);
    }

    /// The wake that strengths refer to.
    #[must_use]
    pub fn wake(&self) -> &Wake {
        &self.wake
    }

    /// The moment of an age (steps), at most that of the first record.
    fn moment(&self, age: usize) -> &EmitterMoment {
        &self.past[age.min(self.past.len() - 1)]
    }

    /// How far the air of an age (steps) has come down (m).
    fn depth_m(&self, age: usize) -> f64 {
        // Where there is no wake the chain goes on as if there were; such air is never found.
        let strength = match self.moment(age).strength {
            none if none <= 0.0 => 1.0,
            some => some,
        };
        let far = self.wake.far_field();
        far.transported_m(age as f64 * self.step_s, self.convection * strength)
    }

    /// Height of the air of an age (m).
    fn z_m(&self, age: usize) -> f64 {
        self.moment(age).position_m.z - self.depth_m(age)
    }

    /// The links of its streakline that hold air; `emitter` is the caller's index, `max_speed_mps`
    /// how fast the drone may have been.
    pub(crate) fn links(&self, emitter: u32, max_speed_mps: f64, links: &mut Vec<Link>) {
        if self.past.is_empty() {
            return;
        }
        let at = |age: usize| {
            let (moment, depth_m) = (self.moment(age), self.depth_m(age));
            (moment, moment.position_m.z - depth_m, depth_m)
        };
        let mut newer = at(self.cuts[0]);
        for (cut, ages) in (1..).zip(self.cuts.windows(2)) {
            let older = at(ages[1]);
            let ((a, a_z_m, a_deep_m), (b, b_z_m, b_deep_m)) = (newer, older);
            newer = older;
            if a.strength <= 0.0 && b.strength <= 0.0 {
                continue;
            }
            let place = |it: &EmitterMoment, depth_m: f64| {
                let (wake, _) = self.shaped(it.strength);
                let [x, y] = wake.axis_m(depth_m).unwrap_or_default();
                let lean = Vector2::from(it.lean) * depth_m;
                it.position_m.xy().coords + Vector2::new(x, y) + lean
            };
            let (from_m, to_m) = (place(a, a_deep_m), place(b, b_deep_m));
            let middle_m = 0.5 * (from_m + to_m);
            // Between two cuts the drone may have been aside of the straight line.
            let lasts_s = (ages[1] - ages[0]) as f64 * self.step_s;
            let half_m = 0.5 * (from_m - to_m).norm().max(max_speed_mps * lasts_s);
            let faint_m = match a.strength.max(b.strength) {
                usual if usual <= USUAL_STRENGTH => self.reach_m[cut as usize],
                strong => reach_m(&self.wake, b_deep_m, strong),
            };
            links.push(Link {
                emitter,
                cut,
                z_m: [a_z_m, b_z_m],
                middle_m: middle_m.into(),
                reach_m: half_m + faint_m,
            });
        }
    }

    /// The air of one link at a height within it (m); `None`: of that moment there is none, or it
    /// has ended before.
    pub(crate) fn parcel(&self, cut: u32, z_m: f64) -> Option<Parcel<'_>> {
        let cut = cut as usize;
        let (mut newer, mut older) = (self.cuts[cut - 1], self.cuts[cut]);
        let is_above = self.z_m(newer) > z_m;
        while older - newer > 1 {
            let middle = newer + (older - newer) / 2;
            match (self.z_m(middle) > z_m) == is_above {
                true => newer = middle,
                false => older = middle,
            }
        }
        let (a, b) = (self.moment(newer), self.moment(older));
        let (a_z_m, b_z_m) = (self.z_m(newer), self.z_m(older));
        let share = match a_z_m - b_z_m {
            level if level.abs() < 1e-12 => 0.0,
            apart => ((a_z_m - z_m) / apart).clamp(0.0, 1.0),
        };
        let nearer = if share < 0.5 { a } else { b };
        if nearer.strength <= 0.0 || z_m < nearer.ends_at_z_m - airflow::HEIGHT_TOLERANCE_M {
            return None;
        }
        let from_m = a.position_m + (b.position_m - a.position_m) * share;
        let strength = match a.strength.min(b.strength) {
            none if none <= 0.0 => nearer.strength,
            _ => a.strength + (b.strength - a.strength) * share,
        };
        let depth_m = from_m.z - z_m;
        let [x, y] = nearer.lean.map(|lean| lean * depth_m);
        let (wake, strength) = self.shaped(strength);
        (depth_m > airflow::HEIGHT_TOLERANCE_M).then_some(Parcel {
            wake,
            from_m: from_m + Vector3::new(x, y, 0.0),
            strength,
        })
    }

    /// Every parcel of it at a height (m), for a few emitters without bins.
    pub(crate) fn parcels(&self, z_m: f64) -> impl Iterator<Item = Parcel<'_>> {
        let last = if self.past.is_empty() {
            0
        } else {
            self.cuts.len()
        };
        (1..last).filter_map(move |cut| {
            let ends_m = [self.z_m(self.cuts[cut - 1]), self.z_m(self.cuts[cut])];
            crosses(ends_m, z_m)
                .then(|| self.parcel(cut as u32, z_m))
                .flatten()
        })
    }

    /// How far from its drone its air may count, if quasi-static (m).
    pub(crate) fn most_reach_m(&self) -> f64 {
        self.reach_m.iter().copied().fold(0.0, f64::max)
    }

    /// The wake as if quasi-static, where it reaches down to a height (m).
    pub(crate) fn quasi_static(&self, z_m: f64) -> Option<Parcel<'_>> {
        let now = self.past.front()?;
        let reaches = now.strength > 0.0
            && now.position_m.z > z_m + airflow::HEIGHT_TOLERANCE_M
            && z_m >= now.ends_at_z_m - airflow::HEIGHT_TOLERANCE_M;
        let [x, y] = now.lean.map(|lean| lean * (now.position_m.z - z_m));
        let (wake, strength) = self.shaped(now.strength);
        reaches.then_some(Parcel {
            wake,
            from_m: now.position_m + Vector3::new(x, y, 0.0),
            strength,
        })
    }
}

/// Reaches are tabulated for this strength, and worked out where it is exceeded; chosen here: 2.25
/// times the weight.
const USUAL_STRENGTH: f64 = 1.5;

/// Distance from the axis (m) beyond which the air of a wake at a depth (m) is too faint to count.
fn reach_m(wake: &Wake, depth_m: f64, strength: f64) -> f64 {
    let deep_m = depth_m.max(wake.near_field_depth_m());
    let faint_mps = FAINTEST_WAKE_MPS / (strength * wake.gain());
    let radius_m = wake.radius_at_speed_m(deep_m, faint_mps);
    let wider = wake.spread_m(deep_m).unwrap_or(0.0) / wake.half_width_m(deep_m);
    radius_m.unwrap_or(0.0) * wider.max(1.0) + wake.tip_radius_m()
}

/// Whether a link with these ends crosses a height (m); of a chain exactly one link does where it
/// passes through.
pub(crate) fn crosses([newer_m, older_m]: [f64; 2], z_m: f64) -> bool {
    (newer_m > z_m) != (older_m > z_m)
}

/// A receiver of air: points over its discs, and how wakes add up there.
#[derive(Clone, Debug)]
pub(crate) struct Receiver {
    discs: DiscPoints,
    superposition: Superposition,
    gathered: Vec<f64>,
    pub(crate) strongest: Option<(usize, JetAt)>,
    is_calm: bool,
}

impl Receiver {
    pub(crate) fn new(discs: DiscPoints, superposition: Superposition) -> Receiver {
        Receiver {
            gathered: vec![0.0; discs.weights.len()],
            discs,
            superposition,
            strongest: None,
            is_calm: true,
        }
    }

    pub(crate) fn clear(&mut self) {
        if !self.is_calm {
            self.gathered.fill(0.0);
        }
        self.strongest = None;
        self.is_calm = true;
    }

    /// Adds the air of parcels of several emitters, by their indices, at a receiver's centre (m):
    /// of each emitter the strongest, emitters in their order.
    pub(crate) fn add_all(&mut self, found: &mut [(usize, Parcel<'_>)], centre_m: &Point3<f64>) {
        found.sort_by_key(|it| it.0);
        for of_one in found.chunk_by(|a, b| a.0 == b.0) {
            let stronger = |a, b| {
                if speed_mps(b, centre_m) > speed_mps(a, centre_m) {
                    b
                } else {
                    a
                }
            };
            let parcels = of_one.iter().map(|(_, parcel)| parcel);
            if let Some(parcel) = parcels.reduce(stronger) {
                self.add(of_one[0].0, parcel, centre_m);
            }
        }
    }

    /// Adds the air of one parcel, of the emitter of an index, at a receiver's centre (m).
    fn add(&mut self, emitter: usize, parcel: &Parcel<'_>, centre_m: &Point3<f64>) {
        let offset_m = centre_m - parcel.from_m;
        let depth_m = -offset_m.z;
        let section = parcel.wake.cross_section(depth_m);
        let mean_mps = parcel.strength * section.axial_speed_mps(offset_m.x, offset_m.y);
        for (so_far, [x, y]) in self.gathered.iter_mut().zip(&self.discs.offsets_m) {
            let speed_mps = section.axial_speed_mps(offset_m.x + x, offset_m.y + y);
            *so_far = self
                .superposition
                .gather(*so_far, parcel.strength * speed_mps);
        }
        self.is_calm = false;
        if self
            .strongest
            .is_none_or(|(_, jet)| mean_mps > jet.mean_mps)
        {
            let wake = parcel.wake;
            let deep_m = depth_m.max(wake.near_field_depth_m());
            let [x, y] = wake.axis_m(depth_m).unwrap_or_default();
            let jet = JetAt {
                mean_mps,
                centreline_mps: parcel.strength * wake.centreline_mps(deep_m).unwrap_or(0.0),
                half_width_m: wake.half_width_m(deep_m),
                radius_m: (offset_m.x - x).hypot(offset_m.y - y),
            };
            self.strongest = Some((emitter, jet));
        }
    }

    /// Mean over the discs (m/s).
    pub(crate) fn mean_mps(&self) -> f64 {
        if self.is_calm {
            return 0.0;
        }
        let each = self.gathered.iter().zip(&self.discs.weights);
        each.map(|(gathered, weight)| weight * self.superposition.finish(*gathered))
            .sum()
    }
}

/// The speed of a parcel at a place of its height (m/s).
pub(crate) fn speed_mps(parcel: &Parcel<'_>, place_m: &Point3<f64>) -> f64 {
    parcel.strength * parcel.wake.axial_speed_mps(place_m - parcel.from_m)
}
