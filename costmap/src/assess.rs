//! A leg against the fleet, in full: free, priced in joules and metres of dose, or forbidden.
//!
//! The search asks [`Costmap::judge`](crate::costmap::Costmap::judge), which bounds; here the air is
//! integrated. A leg is priced if the drone's rotor tips, swept along it, meet somebody's near-field
//! column or half-width cone, or if the drone's own reach somebody else: parry decides that, on the
//! volumes themselves. Outside every cone the air is below a quarter of its centreline and counts as
//! free.

use parry3d::shape::Ball;

use crate::costmap::Costmap;
use crate::leg::{DroneId, Leg, Tick};
use crate::reservations::timeline::Item;
use crate::verdict::{Blocker, Verdict};
use crate::volumes::downwash::{column, cone};
use crate::volumes::frame::{self, NotFinite};
use crate::volumes::swept::{Mover, may_meet};
use crate::wake::exposure::Flight;
use crate::wake::exposure::{Emitter, Exposure, Receiver, exposure};

/// What a leg means to its drone and to the fleet.
#[derive(Clone, Debug, PartialEq)]
pub enum Assessment {
    /// It meets nobody's volumes, nor do its own meet anybody.
    Free,
    /// It may be flown, through or over somebody.
    Priced(Price),
    /// It may not: a body, a column, a limit or a zone.
    Forbidden {
        /// Who is in the way, and how.
        blockers: Vec<Blocker>,
        /// The zone (its index) into which it blows too much all by itself.
        breaks_zone: Option<usize>,
    },
}

/// What a leg through others' air costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Price {
    /// Dose, worst speed, when, and the extra energy of the drone itself.
    pub own: Exposure,
    /// Who contributed most to the worst speed.
    pub worst_from: Option<DroneId>,
    /// Extra energy that the leg's own wake costs others, each counted alone (J).
    pub others_extra_energy_j: f64,
}

impl Costmap {
    /// Free, priced or forbidden, and by whom.
    ///
    /// # Errors
    /// A position of the leg is NaN or infinite, or the leg lasts for ever.
    pub fn assess(&self, leg: &Leg) -> Result<Assessment, NotFinite> {
        frame::point(leg.from_m)?;
        frame::point(leg.to_m)?;
        let mut verdict = Verdict::default();
        self.judge(leg, &mut verdict);
        if !verdict.is_allowed() {
            return Ok(Assessment::Forbidden {
                blockers: verdict.blockers,
                breaks_zone: verdict.breaks_zone,
            });
        }
        let own_end_z_m = self.wake_end_z_m(leg);
        let (mut above, mut below) = (Vec::new(), Vec::new());
        for neighbour in self
            .near(leg)
            .into_iter()
            .filter(|n| leg.flying && n.leg.flying)
        {
            if self.meets_wake(leg, &neighbour.leg, neighbour.wake_end_z_m)? {
                above.push(neighbour);
            }
            if self.meets_wake(&neighbour.leg, leg, own_end_z_m)? {
                below.push(neighbour);
            }
        }
        if above.is_empty() && below.is_empty() {
            return Ok(Assessment::Free);
        }
        self.price(leg, own_end_z_m, &above, &below)
            .map(Assessment::Priced)
    }

    /// Whether one leg's rotor tips meet the volumes of another's wake while both last.
    fn meets_wake(
        &self,
        receiver: &Leg,
        emitter: &Leg,
        ends_at_z_m: f64,
    ) -> Result<bool, NotFinite> {
        let time = receiver.overlap(emitter);
        if time.is_empty() {
            return Ok(false);
        }
        let wake = self.fleet().wake(emitter.kind);
        let (from_m, to_m) = (emitter.position_m(time.start), emitter.position_m(time.end));
        // Hung where the leg begins, long enough to reach as low from wherever it goes: outward.
        let lowest_z_m =
            ends_at_z_m.min(receiver.from_m.z.min(receiver.to_m.z)) - (to_m.z - from_m.z).max(0.0);
        let ball = Ball::new(self.fleet().wake(receiver.kind).tip_radius_m());
        let receiver_m = receiver.position_m(time.start);
        let tips = Mover::new(
            &ball,
            frame::centred(receiver_m)?,
            receiver.position_m(time.end) - receiver_m,
        )?;
        let sections = [Some(column(wake)), cone(wake, from_m.z - lowest_z_m)];
        for section in sections.into_iter().flatten() {
            let Some(placed) = section.hung(from_m, lowest_z_m)? else {
                continue;
            };
            let volume = Mover::new(&placed.frustum, placed.pose, to_m - from_m)?;
            if may_meet(&tips, &volume) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn price(
        &self,
        leg: &Leg,
        own_end_z_m: f64,
        above: &[&Item],
        below: &[&Item],
    ) -> Result<Price, NotFinite> {
        let emitters: Vec<Emitter> = above
            .iter()
            .map(|n| self.emitter(&n.leg, n.wake_end_z_m))
            .collect();
        let superposition = self.fleet().conditions().superposition;
        let own = exposure(&self.receiver(leg), &emitters, superposition)?;
        let me = [self.emitter(leg, own_end_z_m)];
        let mut others_extra_energy_j = 0.0;
        for neighbour in below {
            let time = leg.overlap(&neighbour.leg);
            let theirs = neighbour.leg.between(time.start, time.end);
            others_extra_energy_j +=
                exposure(&self.receiver(&theirs), &me, superposition)?.extra_energy_j;
        }
        Ok(Price {
            worst_from: own.from.map(|index| above[index].leg.drone),
            own,
            others_extra_energy_j,
        })
    }

    fn receiver(&self, leg: &Leg) -> Receiver<'_> {
        Receiver {
            leg: flight(leg),
            discs: self.fleet().discs(leg.kind),
            mass_kg: self.fleet().kind(leg.kind).mass_kg,
            induced_velocity_mps: self.fleet().measure_mps(leg.kind),
        }
    }

    fn emitter(&self, leg: &Leg, ends_at_z_m: f64) -> Emitter<'_> {
        Emitter {
            leg: flight(leg),
            wake: self.fleet().wake(leg.kind),
            ends_at_z_m,
        }
    }
}

fn flight(leg: &Leg) -> Flight {
    Flight {
        start_m: leg.from_m,
        end_m: leg.to_m,
        start_s: leg.start.seconds(),
        end_s: if leg.end == Tick::FOREVER {
            f64::INFINITY
        } else {
            leg.end.seconds()
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leg::KindId;
    use crate::reservations::ground::Ground;
    use crate::wake::fleet::{Conditions, Fleet, Kind};
    use crate::wake::surfaces::BlockingSurfaces;
    use airflow::{Airframe, Jet, Superposition};
    use nalgebra::Point3;

    /// Offboard 2 over Offboard 2 in a hall 30 m high: the paper's wake reaches far below its limit.
    fn sky() -> Costmap {
        let airframe = Airframe::preset("offboard-2").expect("a preset");
        let conditions = Conditions {
            density_kg_per_m3: 1.204,
            jet: Jet::default(),
            superposition: Superposition::Momentum,
            flown: airflow::effects::Flown::default(),
            fastest_mps: 2.0,
            clearance_m: 0.1,
            deepest_m: 30.0,
            lowest_air_limit: 0.3,
            lowest_zone_limit_mps: f64::INFINITY,
            wakes: true,
        };
        let kind = Kind {
            airframe: 0,
            mass_kg: airframe.mass_kg(),
            body_radius_m: airframe.tip_radius_m(),
        };
        let fleet = Fleet::new(&[airframe], vec![kind], conditions);
        Costmap::new(
            fleet,
            BlockingSurfaces::new(0.0, Vec::new()),
            Vec::new(),
            Ground::new([0.0, 0.0], [10.0, 10.0], 1.0),
            2,
        )
    }

    fn leg(drone: u32, from_m: [f64; 3], to_m: [f64; 3], end: Tick) -> Leg {
        Leg {
            drone: DroneId(drone),
            kind: KindId(0),
            start: Tick(0),
            end,
            from_m: Point3::from(from_m),
            to_m: Point3::from(to_m),
            flying: true,
            air_limit: 0.3,
        }
    }

    fn below_a_hover(depth_m: f64, aside_m: f64) -> Assessment {
        let mut sky = sky();
        let above = [10.0, 10.0, 28.0];
        sky.insert(vec![leg(0, above, above, Tick::FOREVER)]);
        let y_m = 10.0 + aside_m;
        let z_m = 28.0 - depth_m;
        let pass = leg(1, [9.0, y_m, z_m], [11.0, y_m, z_m], Tick(100));
        sky.assess(&pass).expect("finite")
    }

    #[test]
    fn near_below_is_forbidden_far_below_is_priced_and_far_aside_is_free() {
        let Assessment::Forbidden { blockers, .. } = below_a_hover(0.5, 0.0) else {
            panic!("crosses the column");
        };
        assert_eq!(blockers[0].drone, DroneId(0));
        assert!(matches!(
            below_a_hover(4.0, 0.0),
            Assessment::Forbidden { .. }
        ));
        let Assessment::Priced(price) = below_a_hover(10.0, 0.0) else {
            panic!("crosses the cone, below the limit");
        };
        assert_eq!(price.worst_from, Some(DroneId(0)));
        assert!(price.own.extra_energy_j > 0.0 && price.own.dose_m > 0.0);
        assert_eq!(price.others_extra_energy_j, 0.0);
        assert_eq!(below_a_hover(10.0, 6.0), Assessment::Free);
    }

    #[test]
    fn flying_over_somebody_costs_the_other() {
        let mut sky = sky();
        let below = [10.0, 10.0, 2.0];
        sky.insert(vec![leg(0, below, below, Tick::FOREVER)]);
        let pass = leg(1, [9.0, 10.0, 14.0], [11.0, 10.0, 14.0], Tick(100));
        let Ok(Assessment::Priced(price)) = sky.assess(&pass) else {
            panic!("its cone reaches the other");
        };
        assert!(price.others_extra_energy_j > 0.0);
        assert_eq!(price.own.dose_m, 0.0);
    }
}
