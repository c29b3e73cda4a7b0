use airflow::{Airframe, Jet, Superposition};
use nalgebra::Point3;

use super::*;
use crate::leg::KindId;
use crate::verdict::Verdict;
use crate::wake::fleet::{Conditions, Kind};
use crate::wake::surfaces::Top;

const DRONES: u32 = 24;

fn empty() -> Costmap {
    let airframes = ["offboard-2", "kolibri"].map(|name| Airframe::preset(name).expect("a preset"));
    let kinds = [(0, 1.207), (1, 0.23)].map(|(airframe, mass_kg): (usize, f64)| Kind {
        airframe,
        mass_kg,
        body_radius_m: airframes[airframe].tip_radius_m(),
    });
    let conditions = Conditions {
        density_kg_per_m3: 1.204,
        jet: Jet::default(),
        superposition: Superposition::Momentum,
        flown: airflow::Flown::default(),
        fastest_mps: 2.0,
        gaps_m: [0.1; 3],
        shift: 0,
        path_deviation_m: 0.0,
        deepest_m: 6.0,
        lowest_air_limit: 0.3,
        lowest_zone_limit_mps: 1.5,
        wakes: true,
    };
    let top = Top::Rectangle {
        min_m: [0.0, 0.0],
        max_m: [3.0, 3.0],
        z_m: 1.0,
    };
    let zone = ZoneBox {
        min_m: Point3::new(4.0, 4.0, 0.0),
        max_m: Point3::new(6.0, 6.0, 1.0),
        air_limit_mps: 2.0,
    };
    Costmap::new(
        Fleet::new(&airframes, kinds.to_vec(), conditions),
        BlockingSurfaces::new(0.0, vec![top]),
        vec![zone],
        Ground::new([0.0, 0.0], [7.0, 6.5], 1.0),
        DRONES as usize,
    )
}

fn at(index: u32) -> f64 {
    (f64::from(index) * 0.754_877_666_246_69).fract()
}

/// Five random legs, back to back; two drones in three stay at the end without end.
fn legs(drone: u32, round: u32) -> Vec<Leg> {
    let place = |k: u32| {
        let i = 1000 * round + 31 * drone + 3 * k;
        Point3::new(7.0 * at(i), 7.0 * at(i + 1), 6.0 * at(i + 2))
    };
    let leg = |k: u32| Leg {
        drone: DroneId(drone),
        kind: KindId(drone % 2),
        start: Tick(170 * k),
        end: Tick(170 * (k + 1)),
        from_m: place(k),
        to_m: place(k + 1),
        flying: k > 0 || !drone.is_multiple_of(4),
        air_limit: 0.3,
    };
    let mut legs: Vec<Leg> = (0..5).map(leg).collect();
    if !drone.is_multiple_of(3) {
        legs.push(Leg {
            start: legs[4].end,
            end: Tick::FOREVER,
            from_m: legs[4].to_m,
            ..legs[4]
        });
    }
    legs
}

/// By drone and start: loads by drone, start and size.
type Loads = Vec<(DroneId, Tick, Vec<(DroneId, Tick, u32)>, u64)>;

fn loads(costmap: &Costmap) -> (Loads, Vec<Vec<(DroneId, u32)>>) {
    let mut loads = Loads::new();
    for drone in (0..DRONES).map(DroneId) {
        for &index in costmap.timeline.of(drone) {
            let item = costmap.timeline.item(index);
            let mut incoming: Vec<_> = item
                .incoming
                .iter()
                .map(|it| (it.from, it.start, it.load))
                .collect();
            incoming.sort_unstable();
            loads.push((drone, item.leg.start, incoming, item.peak));
        }
    }
    let in_zone = (0..12)
        .map(|bucket| {
            let zones = &costmap.zones.loads.during(bucket..bucket + 1)[0];
            let mut zone: Vec<_> = zones[0]
                .iter()
                .map(|load| (load.drone, load.load))
                .collect();
            zone.sort_unstable();
            zone
        })
        .collect();
    (loads, in_zone)
}

#[test]
fn what_was_taken_back_leaves_no_trace() {
    let mut used = empty();
    for round in 0..4 {
        for drone in 0..DRONES {
            used.remove(DroneId(drone));
            used.insert(legs(drone, round));
        }
    }
    // Some are gone in the end, and the others were inserted in another order.
    let gone = |drone: u32| drone % 5 == 2;
    (0..DRONES)
        .filter(|d| gone(*d))
        .for_each(|d| _ = used.remove(DroneId(d)));
    let mut fresh = empty();
    for drone in (0..DRONES).rev().filter(|drone| !gone(*drone)) {
        fresh.insert(legs(drone, 3));
    }
    assert_eq!(loads(&used), loads(&fresh));
    let (loads, zones) = loads(&used);
    assert!(loads.iter().filter(|load| load.3 > 0).count() > 25);
    assert!(zones.iter().flatten().count() > 5);
}

#[test]
fn an_empty_sky_forbids_nothing_but_a_zone() {
    let costmap = empty();
    let mut verdict = Verdict::default();
    for leg in (0..DRONES).flat_map(|drone| legs(drone, 0)) {
        assert!(costmap.near(&leg).is_empty());
        costmap.judge(&leg, &mut verdict);
        assert!(verdict.blockers.is_empty() && verdict.price_s == 0.0);
    }
}

#[test]
fn what_a_look_nearby_allows_a_full_one_allows_if_it_is_borne() {
    let mut allowed = 0;
    let mut costmap = empty();
    for drone in 0..DRONES {
        for round in 0..60 {
            for leg in legs(drone, round)
                .into_iter()
                .flat_map(|leg| parts(&leg).collect::<Vec<_>>())
            {
                let (mut nearby, mut full) = (Verdict::default(), Verdict::default());
                costmap.judge_nearby(&leg, false, &mut nearby);
                costmap.judge(&leg, &mut full);
                let allows = nearby.blockers.is_empty() && costmap.are_loads_within_budget(&[leg]);
                assert!(!allows || full.blockers.is_empty(), "{leg:?} {full:?}");
                allowed += u32::from(allows && !costmap.near(&leg).is_empty());
            }
        }
        costmap.insert(legs(drone, 0));
    }
    assert!(allowed > 1_000, "{allowed}");
}
