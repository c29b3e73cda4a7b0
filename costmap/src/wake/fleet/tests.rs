use super::*;
use crate::leg::{DroneId, Tick};

fn fleet(superposition: Superposition) -> Fleet {
    let airframes = ["offboard-2", "kolibri"].map(|name| Airframe::preset(name).expect("a preset"));
    let kind = |airframe: usize, mass_kg: f64| Kind {
        airframe,
        mass_kg,
        body_radius_m: airframes[airframe].tip_radius_m(),
    };
    let kinds = vec![kind(0, 1.207), kind(0, 1.6), kind(1, 0.23)];
    let conditions = Conditions {
        density_kg_per_m3: 1.204,
        jet: Jet::default(),
        superposition,
        flown: airflow::Flown::default(),
        fastest_mps: 2.0,
        gaps_m: [0.1; 3],
        shift: 0,
        path_deviation_m: 0.0,
        deepest_m: 6.0,
        lowest_air_limit: 0.3,
        lowest_zone_limit_mps: f64::INFINITY,
        wakes: true,
    };
    Fleet::new(&airframes, kinds, conditions)
}

fn leg(drone: u32, kind: u32, from_m: [f64; 3], to_m: [f64; 3], ticks: [u32; 2]) -> Leg {
    Leg {
        drone: DroneId(drone),
        kind: KindId(kind),
        start: Tick(ticks[0]),
        end: Tick(ticks[1]),
        from_m: from_m.into(),
        to_m: to_m.into(),
        flying: true,
        air_limit: 0.3,
    }
}

/// A number from 0 to 1, the same for the same index.
fn at(index: u32) -> f64 {
    (f64::from(index) * 0.754_877_666_246_69).fract()
}

#[test]
fn to_swap_two_legs_is_to_swap_what_they_do_to_each_other() {
    let fleet = fleet(Superposition::Momentum);
    let mut met = 0;
    for i in 0..3_000_u32 {
        let place = |k: u32| {
            [
                2.0 * at(20 * i + k),
                2.0 * at(20 * i + k + 1),
                6.0 * at(20 * i + k + 2),
            ]
        };
        let first = leg(0, i % 3, place(1), place(4), [0, 90]);
        let mut second = leg(1, i / 3 % 3, place(7), place(10), [i % 80, 130]);
        second.flying = i % 7 != 0;
        let ends = [3.0 * at(20 * i + 13) - 1.0, 3.0 * at(20 * i + 14) - 1.0];
        let there = fleet.meet(&first, &second, ends);
        let back = fleet.meet(&second, &first, [ends[1], ends[0]]);
        met += u32::from(there.is_some());
        let swapped = back.map(|meeting| LegInteraction {
            load_on_first: meeting.load_on_second,
            load_on_second: meeting.load_on_first,
            alpha_first: meeting.alpha_second,
            alpha_second: meeting.alpha_first,
            ..meeting
        });
        // To the last bit: loads are taken back by adding up the same numbers from the other side.
        assert_eq!(there, swapped);
    }
    assert!(met > 1_000, "{met}");
}

#[test]
fn no_delay_within_the_margin_does_more_than_the_shifted_legs_say() {
    const SHIFT: u32 = 20;
    let planned = fleet(Superposition::Momentum);
    let mut shifted = planned.clone();
    shifted.conditions.shift = SHIFT;
    let (mut met, mut touched) = (0, 0);
    for i in 0..600_u32 {
        let place = |k: u32| {
            let on = |k: u32| at(23 * i + k);
            [2.5 * on(k), 2.5 * on(k + 1), 3.0 + 3.0 * on(k + 2)]
        };
        let still = |k: u32| (i + k).is_multiple_of(5);
        let to = |k: u32, from: [f64; 3]| if still(k) { from } else { place(k) };
        let (a, b) = (place(1), place(7));
        let first = leg(0, i % 3, a, to(4, a), [100, 190]);
        let second = leg(1, i / 3 % 3, b, to(10, b), [60 + i % 120, 230]);
        let ends = [0.0; 2];
        let said = shifted.meet(&first, &second, ends).unwrap_or_default();
        let moments = |leg: &Leg| (leg.start.0..=leg.end.0).step_by(6);
        for (mine, theirs) in
            moments(&first).flat_map(|mine| moments(&second).map(move |theirs| (mine, theirs)))
        {
            if mine.abs_diff(theirs) > SHIFT {
                continue;
            }
            let held = |leg: &Leg, at: u32| {
                let at_m = leg.position_m(Tick(at)).coords.into();
                Leg {
                    flying: leg.flying,
                    ..self::leg(leg.drone.0, leg.kind.0, at_m, at_m, [0, 1])
                }
            };
            let there = planned.meet(&held(&first, mine), &held(&second, theirs), ends);
            let there = there.unwrap_or_default();
            met += u32::from(there != LegInteraction::default());
            touched += u32::from(there.bodies);
            let holds = (said.bodies || !there.bodies)
                && (said.column || !there.column)
                && said.load_on_first >= there.load_on_first
                && said.load_on_second >= there.load_on_second;
            assert!(holds, "{i} at {mine} and {theirs}: {there:?} {said:?}");
        }
    }
    assert!(met > 5_000 && touched > 50, "{met} {touched}");
}

/// Casting one shape at another reports no hit for shapes that overlap and do not move against
/// each other; bodies and wakes must be found all the same.
#[test]
fn what_overlaps_at_zero_relative_velocity_is_found() {
    let fleet = fleet(Superposition::Momentum);
    let low = [0.0; 2];
    for shift_m in [[0.0; 3], [3.0, 1.0, 0.0]] {
        let to = |from: [f64; 3]| [0, 1, 2].map(|axis| from[axis] + shift_m[axis]);
        let pair = |offset_m: [f64; 3]| {
            let (a, b) = ([5.0, 5.0, 4.0], [5.0 + offset_m[0], 5.0, 4.0 + offset_m[2]]);
            let first = leg(0, 0, a, to(a), [0, 200]);
            let second = leg(1, 0, b, to(b), [0, 200]);
            fleet.meet(&first, &second, low).unwrap_or_default()
        };
        assert!(pair([0.3, 0.0, 0.0]).bodies);
        assert!(!pair([0.6, 0.0, 0.0]).bodies);
        assert!(pair([0.1, 0.0, -0.6]).column);
        assert!(pair([0.2, 0.0, -3.0]).load_on_second > BUDGET);
        assert_eq!(pair([0.2, 0.0, -3.0]).load_on_first, 0);
    }
}

#[test]
fn landed_drones_and_wakes_that_end_above_do_nothing_to_each_other() {
    let fleet = fleet(Superposition::Linear);
    let upper = leg(0, 0, [5.0, 5.0, 5.0], [5.0, 5.0, 5.0], [0, 100]);
    let lower = leg(1, 0, [5.2, 5.0, 2.0], [5.2, 5.0, 2.0], [0, 100]);
    assert!(fleet.meet(&upper, &lower, [0.0; 2]).is_some());
    assert_eq!(fleet.meet(&upper, &lower, [2.1, 0.0]), None);
    let landed = Leg {
        flying: false,
        ..lower
    };
    assert_eq!(fleet.meet(&upper, &landed, [0.0; 2]), None);
}

#[test]
fn what_differs_in_mass_alone_has_one_table() {
    let names = ["crazyflie-2.1", "kolibri", "crazyflie-2.1-deck"];
    let airframes = names.map(|name| Airframe::preset(name).expect("a preset"));
    let kinds = (0..3).map(|airframe| Kind {
        airframe,
        mass_kg: airframes[airframe].mass_kg(),
        body_radius_m: airframes[airframe].tip_radius_m(),
    });
    let conditions = *fleet(Superposition::Momentum).conditions();
    let fleet = Fleet::new(&airframes, kinds.collect(), conditions);
    let table = |emitter, receiver| std::ptr::from_ref(fleet.envelope(emitter, receiver));
    for other in 0..3 {
        assert_eq!(table(0, other), table(2, other));
        assert_eq!(table(other, 0), table(other, 2));
    }
    assert_ne!(table(0, 1), table(1, 0));
    // As an own table would say: no less air than of the one that was made for itself.
    let alone = Fleet::new(
        &airframes[2..],
        vec![fleet.kinds[2].clone()]
            .into_iter()
            .map(|kind| Kind {
                airframe: 0,
                ..kind
            })
            .collect(),
        conditions,
    );
    for k in 0..200 {
        let at_m = Vector3::new(2.0 * at(3 * k) - 1.0, 0.0, -4.0 * at(3 * k + 1));
        let shared = fleet.envelope(2, 2).along(&at_m, &at_m).peak_square;
        let own = alone.envelope(0, 0).along(&at_m, &at_m).peak_square;
        assert!(shared >= 0.99 * own, "{at_m:?}: {shared} {own}");
    }
}
