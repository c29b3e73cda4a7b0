//! A leg against the fleet, in full: whether it may be flown, and the air along it, integrated.
//!
//! The search asks [`Costmap::judge`], which bounds; what is printed about a leg comes from here. A
//! wake counts where its iso-speed volume, swept along its leg, meets the drone's rotor tips, swept
//! along its own: parry decides that. Wakes hang below their drones without delay.

use nalgebra::Point3;
use parry3d::shape::Ball;

use crate::costmap::Costmap;
use crate::leg::{DroneId, Leg, Tick};
use crate::verdict::{Blocker, Verdict};
use crate::volumes::frame::{self, NotFinite};
use crate::volumes::swept::{Mover, may_meet};
use crate::wake::exposure::{Emitter, Exposure, Flight, Receiver, exposure};

/// What a leg means to its drone and to the fleet.
#[derive(Clone, Debug, PartialEq)]
pub struct Assessment {
    /// Who is in the way, and how; empty: it may be flown past all others.
    pub blockers: Vec<Blocker>,
    /// The zone (its index) into which it brings too much all by itself.
    pub breaks_zone: Option<usize>,
    /// Axial exposure, worst speed and extra energy of the drone.
    pub own: Exposure,
    /// Where the worst speed was met; `None` where no air was met.
    pub worst: Option<Worst>,
}

/// The moment of the highest speed on a leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// Mean speed over the discs, over the velocity by which the drone measures air.
    pub alpha: f64,
    /// Where the drone was (m).
    pub at_m: Point3<f64>,
    /// Whose wake contributed most.
    pub from: DroneId,
    /// Where that drone was (m).
    pub from_m: Point3<f64>,
}

impl Assessment {
    /// Whether it may be flown.
    pub fn is_allowed(&self) -> bool {
        self.blockers.is_empty() && self.breaks_zone.is_none()
    }
}

impl Costmap {
    /// Whether a leg may be flown, and the air along it, whether or not. Of a leg without end that
    /// is the air until all others have come to rest.
    ///
    /// # Errors
    /// A position of the leg is NaN or infinite.
    pub fn assess(&self, leg: &Leg) -> Result<Assessment, NotFinite> {
        frame::point(leg.from_m)?;
        frame::point(leg.to_m)?;
        let mut verdict = Verdict::default();
        self.judge(leg, &mut verdict);
        let rest = self.horizon().max(leg.start.after(1));
        let end = if leg.end == Tick::FOREVER {
            rest
        } else {
            leg.end
        };
        let leg = &leg.between(leg.start, end);
        let mut above = Vec::new();
        for item in self.near(leg) {
            if leg.flying
                && item.leg.flying
                && self.meets_wake(leg, &item.leg, item.wake_end_z_m)?
            {
                above.push(item);
            }
        }
        let emitters: Vec<Emitter> = (above.iter())
            .map(|item| Emitter {
                leg: flight(&item.leg),
                wake: self.fleet().wake(item.leg.kind),
                ends_at_z_m: item.wake_end_z_m,
            })
            .collect();
        let measure_mps = self.fleet().measure_mps(leg.kind);
        let receiver = Receiver {
            leg: flight(leg),
            discs: self.fleet().discs(leg.kind),
            mass_kg: self.fleet().kind(leg.kind).mass_kg,
            induced_velocity_mps: measure_mps,
        };
        let own = exposure(
            &receiver,
            &emitters,
            self.fleet().conditions().superposition,
        )?;
        let worst = own.from.map(|index| Worst {
            alpha: own.worst_mps / measure_mps,
            at_m: receiver.leg.position_m(own.worst_at_s),
            from: above[index].leg.drone,
            from_m: emitters[index].leg.position_m(own.worst_at_s),
        });
        Ok(Assessment {
            blockers: verdict.blockers,
            breaks_zone: verdict.breaks_zone,
            own,
            worst,
        })
    }

    /// Whether one leg's rotor tips meet another's wake where it counts while both last.
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
        let ends_m = |leg: &Leg| [leg.position_m(time.start), leg.position_m(time.end)];
        let ([from_m, to_m], [receiver_m, received_m]) = (ends_m(emitter), ends_m(receiver));
        let ball = Ball::new(self.fleet().wake(receiver.kind).tip_radius_m());
        let tips = Mover::new(&ball, frame::centred(receiver_m)?, received_m - receiver_m)?;
        // Hung where the leg begins, long enough to reach as low from wherever it goes: outward.
        let lowest_z_m =
            ends_at_z_m.min(receiver_m.z.min(received_m.z)) - (to_m.z - from_m.z).max(0.0);
        let volumes = self
            .fleet()
            .iso_speed(emitter.kind)
            .hung(from_m, lowest_z_m)?;
        for placed in &volumes {
            let volume = Mover::new(&placed.frustum, placed.pose, to_m - from_m)?;
            if may_meet(&tips, &volume) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

fn flight(leg: &Leg) -> Flight {
    Flight {
        start_m: leg.from_m,
        end_m: leg.to_m,
        start_s: leg.start.seconds(),
        // Without end: later than any leg that is assessed.
        end_s: leg.end.seconds(),
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

    /// Offboard 2 over Offboard 2 in a hall 30 m high: the paper's wake reaches far below its
    /// limit.
    fn costmap() -> Costmap {
        let airframe = Airframe::preset("offboard-2").expect("a preset");
        let conditions = Conditions {
            density_kg_per_m3: 1.204,
            jet: Jet::default(),
            superposition: Superposition::Momentum,
            flown: airflow::Flown::default(),
            fastest_mps: 2.0,
            gaps_m: [0.1; 3],
            shift: 0,
            astray_m: 0.0,
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
        let mut costmap = costmap();
        let above = [10.0, 10.0, 28.0];
        costmap.insert(vec![leg(0, above, above, Tick::FOREVER)]);
        let y_m = 10.0 + aside_m;
        let z_m = 28.0 - depth_m;
        let pass = leg(1, [9.0, y_m, z_m], [11.0, y_m, z_m], Tick(100));
        costmap.assess(&pass).expect("finite")
    }

    #[test]
    fn near_below_is_forbidden_far_below_is_priced_and_far_aside_is_free() {
        assert_eq!(below_a_hover(0.5, 0.0).blockers[0].drone, DroneId(0));
        let forbidden = below_a_hover(4.0, 0.0);
        assert!(!forbidden.is_allowed());
        assert!(forbidden.worst.expect("in its wake").alpha > 0.3);
        let crossing = below_a_hover(10.0, 0.0);
        assert!(crossing.is_allowed(), "below the limit");
        let worst = crossing.worst.expect("in its wake");
        assert_eq!(worst.from, DroneId(0));
        // Right below it.
        assert!((worst.at_m.xy() - worst.from_m.xy()).norm() < 1e-3);
        assert!(crossing.own.extra_energy_j > 0.0 && crossing.own.axial_exposure_m > 0.0);
        let aside = below_a_hover(10.0, 6.0);
        assert!(aside.is_allowed() && aside.own.axial_exposure_m == 0.0);
    }

    #[test]
    fn a_drone_that_flies_over_another_meets_no_air_itself() {
        let mut costmap = costmap();
        let below = [10.0, 10.0, 2.0];
        costmap.insert(vec![leg(0, below, below, Tick::FOREVER)]);
        let pass = leg(1, [9.0, 10.0, 14.0], [11.0, 10.0, 14.0], Tick(100));
        let over = costmap.assess(&pass).expect("finite");
        assert!(over.worst.is_none() && over.own.axial_exposure_m == 0.0);
        costmap.insert(vec![pass]);
        let hover = leg(0, below, below, Tick::FOREVER);
        let worst = costmap.assess(&hover).expect("finite").worst;
        assert_eq!(worst.expect("its wake reaches down").from, DroneId(1));
    }
}
