//! What is counted of one drone while it flies, and what follows for the fleet.

use nalgebra::Point3;

use crate::fleet::{SimulatedDrone, SimulatedFleet};
use crate::fly::STEP_S;
use crate::reference::ReferencePath;
use crate::report::{DroneFlight, FleetFlight};
use crate::vehicle::Body;

/// Over its limit is a drone from this much on (over its induced velocity): the rounding of plans
/// and steps.
const OVER: f64 = 0.01;
/// Above this alpha what altitude does counts as done by the air; chosen here, 2.5 % of power.
const IN_AIR: f64 = 0.05;
/// Steps over which alpha is averaged, chosen here: 0.24 s, the time that rotors and altitude take
/// to answer.
const MEAN_STEPS: usize = 12;
/// Beyond its limit by so much counts with lean of wakes and averaged alpha: chosen here.
const TENTH: f64 = 0.1;

/// The nearest that something came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Contact {
    /// Between the surfaces (m); negative: they overlap.
    pub(crate) gap_m: f64,
    /// A drone's, or a solid's index.
    pub(crate) with: usize,
    /// When (s).
    pub(crate) at_s: f64,
}

impl Contact {
    /// Keeps the nearer one.
    pub(crate) fn keep(so_far: &mut Option<Contact>, other: Contact) {
        if so_far.is_none_or(|known| other.gap_m < known.gap_m) {
            *so_far = Some(other);
        }
    }
}

/// Sums of squares, with how many and the largest.
#[derive(Clone, Copy, Debug, Default)]
struct Squares {
    sum: f64,
    count: f64,
    most: f64,
}

impl Squares {
    fn add(&mut self, value: f64) {
        self.sum += value * value;
        self.count += 1.0;
        self.most = self.most.max(value.abs());
    }

    fn and(mut self, other: &Squares) -> Squares {
        self.sum += other.sum;
        self.count += other.count;
        self.most = self.most.max(other.most);
        self
    }

    fn rms(&self) -> f64 {
        (self.sum / self.count.max(1.0)).sqrt()
    }
}

/// What is counted of one drone.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    pub(crate) worst_alpha: f64,
    worst: Option<(f64, Option<usize>)>,
    worst_mean_alpha: f64,
    /// The latest alphas, round and round, and their number.
    recent: [f64; MEAN_STEPS],
    seen: usize,
    over_limit_s: f64,
    dose_m: f64,
    tracking: Squares,
    across_max_m: f64,
    altitude: Squares,
    by_air: Squares,
    /// Aerodynamic, to the plan's last time.
    pub(crate) energy_j: f64,
    pub(crate) full_tilt_s: f64,
    pub(crate) body: Option<Contact>,
    pub(crate) obstacle: Option<Contact>,
    /// Of the same drone in calm air.
    pub(crate) calm_energy_j: f64,
}

impl Tally {
    /// Air over one step: alpha, the mean over the discs (m/s), the strongest emitter;
    /// `is_counted`: the time is within the plan.
    pub(crate) fn air(
        &mut self,
        (alpha, air_mps, from): (f64, f64, Option<usize>),
        air_limit: f64,
        (t_s, is_counted): (f64, bool),
    ) {
        if alpha > self.worst_alpha {
            self.worst_alpha = alpha;
            self.worst = Some((t_s, from));
        }
        self.recent[self.seen % MEAN_STEPS] = alpha;
        self.seen += 1;
        if self.seen >= MEAN_STEPS {
            let mean = self.recent.iter().sum::<f64>() / MEAN_STEPS as f64;
            self.worst_mean_alpha = self.worst_mean_alpha.max(mean);
        }
        if alpha > air_limit + OVER {
            self.over_limit_s += STEP_S;
        }
        if is_counted {
            self.dose_m += air_mps * STEP_S;
        }
    }

    /// What the air alone has done to the altitude by now (m), where that is known.
    pub(crate) fn by_air(&mut self, alpha: f64, risen_m: Option<f64>) {
        if let Some(risen_m) = risen_m.filter(|_| alpha > IN_AIR) {
            self.by_air.add(risen_m);
        }
    }

    /// How far from the plan it is at one moment (s), where it is to be as the course has it.
    pub(crate) fn tracking(
        &mut self,
        course: &ReferencePath,
        (t_s, to_m): (f64, Point3<f64>),
        body: &Body,
    ) {
        let off_m = body.position_m - to_m;
        self.tracking.add(off_m.norm());
        self.altitude.add(off_m.z);
        // It is no farther from its path than from its place.
        if off_m.norm() > self.across_max_m {
            let across_m = course.across_m(t_s, &body.position_m, self.across_max_m);
            self.across_max_m = self.across_max_m.max(across_m);
        }
    }

    pub(crate) fn drone(&self, simulated: &SimulatedDrone, fleet: &SimulatedFleet) -> DroneFlight {
        let name = |k: usize| fleet.drones[k].name.clone();
        let vehicle = &simulated.dynamics.vehicle;
        let (claimed_mps, claimed_kg) = simulated.claimed;
        let drawn_wh = self.energy_j / vehicle.drive_efficiency / 3600.0;
        DroneFlight {
            name: simulated.name.clone(),
            flew: self.tracking.count > 0.0,
            worst_alpha: self.worst_alpha,
            worst_at_s: self.worst.map(|(at_s, _)| at_s),
            worst_from: self.worst.and_then(|(_, from)| from).map(name),
            worst_mean_alpha: self.worst_mean_alpha,
            claimed_alpha: Some(
                fleet
                    .flown
                    .alpha(claimed_mps, simulated.hover_mps(claimed_kg)),
            ),
            air_limit: simulated.air_limit,
            over_limit_s: self.over_limit_s,
            dose_m: self.dose_m,
            tracking_max_m: self.tracking.most,
            tracking_rms_m: self.tracking.rms(),
            across_max_m: self.across_max_m,
            altitude_max_m: self.altitude.most,
            altitude_rms_m: self.altitude.rms(),
            altitude_rms_by_air_m: self.by_air.rms(),
            least_gap_m: self.body.map(|it| it.gap_m),
            least_gap_to: self.body.map(|it| name(it.with)),
            least_gap_at_s: self.body.map(|it| it.at_s),
            least_obstacle_gap_m: self.obstacle.map(|it| it.gap_m),
            least_obstacle: (self.obstacle).map(|it| fleet.solids[it.with].solid.name.clone()),
            full_tilt_s: self.full_tilt_s,
            energy_j: self.energy_j,
            extra_energy_j: self.energy_j - self.calm_energy_j,
            battery_percent: vehicle.battery_wh.map(|it| 100.0 * drawn_wh / it),
        }
    }

    /// Sums over a fleet; `drones` of the same tallies.
    pub(crate) fn fleet<'a>(
        tallies: impl Iterator<Item = &'a Tally> + Clone,
        drones: &[DroneFlight],
    ) -> FleetFlight {
        let sum = |of: fn(&Tally) -> &Squares| {
            let each = tallies.clone().map(of);
            each.fold(Squares::default(), |so_far, it| so_far.and(it))
        };
        let (tracking, altitude) = (sum(|it| &it.tracking), sum(|it| &it.altitude));
        let by_air = sum(|it| &it.by_air);
        let count = |is: fn(&DroneFlight) -> bool| drones.iter().filter(|it| is(it)).count();
        let most = |of: fn(&DroneFlight) -> f64| drones.iter().map(of).fold(0.0, f64::max);
        let least =
            |of: fn(&DroneFlight) -> Option<f64>| drones.iter().filter_map(of).reduce(f64::min);
        FleetFlight {
            flown: count(|it| it.flew),
            over_limit: count(|it| it.worst_alpha > it.air_limit + OVER),
            longest_over_limit_s: most(|it| it.over_limit_s),
            over_limit_by_a_tenth: count(|it| it.worst_mean_alpha > it.air_limit + TENTH),
            worst_alpha: most(|it| it.worst_alpha),
            touching: count(DroneFlight::touches),
            in_obstacles: count(DroneFlight::is_in_obstacle),
            least_gap_m: least(|it| it.least_gap_m),
            least_obstacle_gap_m: least(|it| it.least_obstacle_gap_m),
            tracking_max_m: tracking.most,
            tracking_rms_m: tracking.rms(),
            across_max_m: most(|it| it.across_max_m),
            altitude_rms_m: altitude.rms(),
            altitude_rms_by_air_m: by_air.rms(),
            altitude_max_by_air_m: by_air.most,
            extra_energy_j: drones.iter().map(|it| it.extra_energy_j).sum(),
        }
    }
}
