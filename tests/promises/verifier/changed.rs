//! What a part of a plan is judged for is all that can have changed.

use airflow::effects::{Crossflow, Effects, WakeTransport};
use planner::plan::{DronePlan, Plan, ViolationKind};
use planner::verify::{verify, verify_changed};

use super::plans::{Knot, drone, plan, with_box, with_zone};

/// The same numbers every time, from 0 to 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        // Knuth's MMIX generator.
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn place_m(&mut self) -> [f64; 3] {
        let [x, y, z] = [0; 3].map(|_| self.next());
        [1.0 + 14.0 * x, 1.0 + 14.0 * y, 1.0 + 5.0 * z]
    }
}

/// Thirty-six drones: most hover above places of their own, some fly across, three of them too low for their neighbours.
fn fleet(numbers: &mut Numbers) -> Vec<DronePlan> {
    let each = (0..36_u32).map(|k| {
        let home_m = [
            1.0 + 2.5 * f64::from(k % 6),
            1.0 + 2.5 * f64::from(k / 6),
            1.0 + 5.0 * numbers.next(),
        ];
        let mut knots: Vec<Knot> = vec![(0.0, home_m)];
        if k % 12 == 5 {
            knots.push((9.0, numbers.place_m()));
        }
        let airframe = ["offboard-2", "kolibri", "offboard-1"][k as usize % 3];
        drone(&format!("d{k}"), airframe, &knots)
    });
    each.collect()
}

/// Three drones fly elsewhere than before, one of them for longer than anybody did.
fn change(plan: &mut Plan, numbers: &mut Numbers) -> Vec<usize> {
    let mut changed: Vec<usize> = (0..3).map(|_| (36.0 * numbers.next()) as usize).collect();
    changed.sort_unstable();
    changed.dedup();
    for &k in &changed {
        let one = &plan.drones[k];
        let first_m = one.trajectory.position_m[0].into();
        let knots = [
            (0.0, first_m),
            (8.0, numbers.place_m()),
            (16.0 + 4.0 * numbers.next(), numbers.place_m()),
        ];
        plan.drones[k] = drone(&one.name, &one.airframe.name, &knots);
    }
    changed
}

fn airs() -> Vec<Effects> {
    let wind = Crossflow {
        wind_mps: [0.3, -0.2],
    };
    vec![
        Effects::default(),
        Effects {
            wake_transport: Some(WakeTransport { lag_factor: 1.0 }),
            ..Effects::default()
        },
        Effects {
            crossflow: Some(wind),
            ..Effects::default()
        },
    ]
}

#[test]
fn the_whole_check_finds_nothing_new_that_the_check_of_the_changed_drones_misses() {
    let mut numbers = Numbers(7);
    let (mut new_ones, mut spared, mut kinds) = (0, 0, Vec::new());
    for (effects, rounds) in airs().into_iter().zip([12, 3, 3]) {
        for _ in 0..rounds {
            let bare = plan(fleet(&mut numbers));
            let bare = with_box(bare, "pillar", [7.0, 7.5, 0.0], [7.5, 8.0, 4.0]);
            let mut before = with_zone(bare, [11.0, 11.0, 0.0], [12.5, 12.5, 1.0], 2.5);
            before.air.effects = (effects != Effects::default()).then_some(effects);
            let mut after = before.clone();
            let changed = change(&mut after, &mut numbers);

            let (old, whole) = (verify(&before), verify(&after));
            let part = verify_changed(&after, &changed);
            for found in &whole.violations {
                // What is there for ever is, whatever the last time of the plan.
                let known = old.violations.iter().any(|v| {
                    (v.kind, &v.drone, v.position_m) == (found.kind, &found.drone, found.position_m)
                        || v.kind == found.kind && v.drone == found.drone && v.with == found.with
                });
                let told = part.report.violations.contains(found);
                assert!(told || known, "{changed:?} {found}");
                new_ones += usize::from(told);
                kinds.push(found.kind);
            }
            let all_known = |v| whole.violations.contains(v);
            assert!(part.report.violations.iter().all(all_known));
            for &k in &part.judged {
                assert_eq!(part.report.air_met[k], whole.air_met[k]);
            }
            let left = |k: &usize| !part.judged.contains(k);
            for k in (0..36).filter(left) {
                assert!(!changed.contains(&k));
                // They meet what they met, to the tolerance of the highest air, or less.
                let [was_mps, is_mps] =
                    [&old, &whole].map(|report| report.air_met[k].worst_air_mps);
                assert!(
                    is_mps <= was_mps * 1.001 + 1e-3,
                    "d{k}: {is_mps} after {was_mps}"
                );
                spared += 1;
            }
        }
    }
    // It was worth it, and there was something to find.
    assert!(spared > 200 && new_ones > 50, "{spared} {new_ones}");
    for kind in [
        ViolationKind::Air,
        ViolationKind::Column,
        ViolationKind::Obstacle,
        ViolationKind::Zone,
    ] {
        assert!(kinds.contains(&kind), "{kind:?}");
    }
}

#[test]
fn everybody_given_is_everybody_judged() {
    let mut numbers = Numbers(11);
    let plan = with_zone(
        plan(fleet(&mut numbers)),
        [5.0, 5.0, 0.0],
        [6.0, 6.0, 1.0],
        1.0,
    );
    let everybody: Vec<usize> = (0..36).collect();
    let part = verify_changed(&plan, &everybody);
    assert_eq!(part.report, verify(&plan));
    assert_eq!(part.judged, everybody);

    let nobody = verify_changed(&plan, &[]);
    assert!(nobody.judged.is_empty() && nobody.report.violations.is_empty());
}
