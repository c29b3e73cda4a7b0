//! What a planner makes of what its neighbours say.

use nalgebra::Point3;
use planner::plan::{AtEnd, DronePlan, TrajectoryEntry};
use planner::{Control, Plan};

use super::union;
use crate::airspace::message::{
    Border, Fact, Message, Offer, PROTOCOL, Proposal, Says, Settled, Vote,
};
use crate::airspace::traffic::Grid;
use crate::airspace::{Area, Refused};
use crate::message::{Add, Land, Late, OneChange, Retask, Task};

/// Two by two areas of 16 m, whose worlds reach 6 m into one another.
const SQUARE: Grid = Grid {
    areas: [2, 2],
    side_m: 16,
    strip_m: 6,
    drones: 0,
    seed: 1,
};
const PAIR: Grid = Grid {
    areas: [2, 1],
    ..SQUARE
};

/// The planner of an area with one drone, which hovers.
fn planner(grid: &Grid, name: &str, at_m: [f64; 3]) -> Area {
    let [x, y, z] = at_m;
    let drone =
        format!("(name: \"{name}-0\", airframe: \"offboard-2\", start_m: ({x}, {y}, {z})),\n])\n");
    let scenario = grid.scenario(name).unwrap().replace("])\n", &drone);
    let world = planner::read_world(&scenario).unwrap();
    let outcome = planner::plan_world(&world, &Control::QUIET).unwrap();
    let plan = outcome.into_planned().unwrap().plan;
    Area::new(grid.site(1.0), name, world, plan).unwrap()
}

fn hear(area: &mut Area, now_s: f64, from: &str, says: Says) {
    let message = Message {
        protocol: PROTOCOL.to_owned(),
        from: from.to_owned(),
        to: area.name().to_owned(),
        says,
    };
    area.receive(now_s, &message);
}

fn border(now_s: f64, revision: u64, drones: &[DronePlan]) -> Border {
    Border {
        revision,
        at_s: now_s,
        until_s: now_s + 60.0,
        settled: 0,
        heard: 0,
        drones: drones.to_vec(),
        offers: Vec::new(),
    }
}

fn proposal(number: u64, from_s: f64, drone: &DronePlan, takes: Option<&str>) -> Proposal {
    Proposal {
        number,
        revision: number + 1,
        seen: 0,
        from_s,
        drones: vec![drone.clone()],
        takes: takes.map(str::to_owned),
    }
}

fn offer(drone: &str, tasks: &[[f64; 3]]) -> Offer {
    let task = |to_m: &[f64; 3]| Task {
        to_m: *to_m,
        dwell_s: 0.0,
        load_kg: None,
    };
    Offer {
        drone: drone.to_owned(),
        tasks: tasks.iter().map(task).collect(),
        at_end: AtEnd::Hover,
    }
}

fn retask(drone: &str, to_m: [f64; 3]) -> Vec<OneChange> {
    let Offer { drone, tasks, .. } = offer(drone, &[to_m]);
    vec![OneChange::Retask(Retask { drone, tasks })]
}

/// A drone like those of the planner, in straight flight.
fn flies(area: &Area, name: &str, points: &[(f64, [f64; 3])]) -> DronePlan {
    let like = area.running.plan().drones[0].clone();
    let mass_kg = like.airframe.mass_kg;
    DronePlan {
        name: name.to_owned(),
        enters_s: (points[0].0 > 0.0).then_some(points[0].0),
        arrives_s: points[points.len() - 1].0,
        trajectory: TrajectoryEntry {
            t_s: points.iter().map(|it| it.0).collect(),
            position_m: points.iter().map(|it| it.1.into()).collect(),
            mass_kg: vec![mass_kg; points.len()],
            ..TrajectoryEntry::default()
        },
        ..like
    }
}

fn of<'a>(plan: &'a Plan, drone: &str) -> &'a DronePlan {
    plan.drones.iter().find(|it| it.name == drone).unwrap()
}

fn at_m(plan: &Plan, drone: &str, t_s: f64) -> Point3<f64> {
    of(plan, drone).trajectory.position_m(t_s).unwrap()
}

/// What it has said to a neighbour: proposals.
fn proposed(area: &mut Area) -> Vec<(String, Proposal)> {
    let said = area.take_messages().into_iter();
    said.filter_map(|it| match it.says {
        Says::Propose(proposal) => Some((it.to, proposal)),
        _ => None,
    })
    .collect()
}

/// Its last vote, and that it has cast one.
fn voted(area: &mut Area) -> Option<String> {
    let votes = area.take_messages().into_iter();
    let mut votes = votes.filter_map(|it| match it.says {
        Says::Vote(vote) => Some(vote.against),
        _ => None,
    });
    votes.next_back().unwrap()
}

fn contradiction(area: &Area) -> Option<&str> {
    area.counts()
        .contradictions
        .back()
        .map(|(_, what)| &what[..])
}

/// Lets it take what is offered, with the votes of all that it asks.
fn takes(area: &mut Area, now_s: f64) -> Proposal {
    area.tick(now_s);
    let asked = proposed(area);
    let (_, proposal) = asked[0].clone();
    let number = proposal.number;
    for (to, _) in asked {
        let against = None;
        hear(area, now_s, &to, Says::Vote(Vote { number, against }));
    }
    assert!(
        area.own()
            .any(|it| Some(&it.name) == proposal.takes.as_ref())
    );
    proposal
}

#[test]
fn of_two_hand_overs_at_once_that_exclude_one_another_one_is_flown() {
    let mut all = [
        planner(&PAIR, "a0-0", [13.5, 4.5, 2.5]),
        planner(&PAIR, "a1-0", [18.5, 11.5, 2.5]),
    ];
    let mut now_s = 0.0;
    let mut step = |all: &mut [Area; 2]| {
        now_s += 0.1;
        all.iter_mut().for_each(|it| it.tick(now_s));
        // What both say crosses on the way.
        let said: Vec<Message> = all.iter_mut().flat_map(Area::take_messages).collect();
        for (message, area) in said.iter().flat_map(|it| [(it, 0), (it, 1)]) {
            all[area].receive(now_s, message);
        }
        let whole_m = PAIR.whole_m();
        let found = planner::verify(&union(all.iter(), &whole_m)).violations;
        let ahead = found.iter().find(|it| it.matters_from(now_s));
        assert!(ahead.is_none(), "at {now_s:.1} s: {}", ahead.unwrap());
    };
    (0..3).for_each(|_| step(&mut all));
    all[0]
        .offer("a1-0", offer("a0-0-0", &[[16.5, 8.5, 1.5]]))
        .unwrap();
    all[1]
        .offer("a0-0", offer("a1-0-0", &[[16.5, 8.5, 4.5]]))
        .unwrap();
    (0..60).for_each(|_| step(&mut all));
    assert!(all.iter().map(|it| it.counts().taken).sum::<u64>() >= 1);
    assert!(all.iter().all(|it| it.counts().contradictions.is_empty()));
}

#[test]
fn a_drone_that_is_replanned_flies_what_it_has_flown_so_far() {
    let mut area = planner(&PAIR, "a0-0", [1.5, 1.5, 2.5]);
    assert_eq!(area.ask(0.0, retask("a0-0-0", [4.5, 14.5, 2.5])), Ok(true));
    let before = area.running.plan().clone();
    let ends_s = *of(&before, "a0-0-0").trajectory.t_s.last().unwrap();
    let now_s = 3.0;
    let ahead_m = at_m(&before, "a0-0-0", now_s + 0.6 * (ends_s - now_s));
    let x = flies(&area, "x", &[(now_s - 0.05, ahead_m.coords.into())]);
    let (revision, drones) = (2, vec![x]);
    hear(
        &mut area,
        now_s,
        "a1-0",
        Says::Fact(Fact { revision, drones }),
    );
    assert_eq!(area.counts().gave_way, 1);
    for t_s in [0.5, 1.0, 1.5, 2.0, 2.5, 3.0] {
        let [was, is] = [&before, area.running.plan()].map(|it| at_m(it, "a0-0-0", t_s));
        assert!((was - is).norm() < 1e-6, "at {t_s} s: {was} and {is}");
    }
    let (drone, by_s) = ("a0-0-0".to_owned(), 0.1);
    let late = OneChange::Late(Late { drone, by_s });
    assert_eq!(area.report(now_s, vec![late]), Ok(()));
}

#[test]
fn a_third_learns_of_a_hand_over_from_the_border_where_the_word_of_it_is_lost() {
    let mut area = planner(&SQUARE, "a1-1", [28.5, 28.5, 2.5]);
    let here = [15.5, 14.5, 2.5];
    let old = flies(&area, "d", &[(0.0, here)]);
    hear(&mut area, 0.1, "a0-0", Says::Border(border(0.1, 1, &[old])));
    let new = flies(
        &area,
        "d",
        &[(0.0, here), (1.0, here), (9.0, [3.5, 20.5, 2.5])],
    );
    let asked = proposal(1, 1.0, &new, Some("d"));
    hear(&mut area, 0.2, "a0-1", Says::Propose(asked));
    assert_eq!(voted(&mut area), None);
    let settled = 1;
    let told = border(1.5, 2, std::slice::from_ref(&new));
    // Its first owner does not say it any more.
    hear(&mut area, 1.4, "a0-0", Says::Border(border(1.4, 2, &[])));
    hear(
        &mut area,
        1.5,
        "a0-1",
        Says::Border(Border { settled, ..told }),
    );
    assert_eq!(contradiction(&area), None);
    assert_eq!(of(area.running.plan(), "d").trajectory, new.trajectory);
}

#[test]
fn a_drone_that_was_taken_and_handed_on_is_not_its_first_owners_again() {
    let mut area = planner(&SQUARE, "a0-0", [3.5, 3.5, 2.5]);
    let here = [14.5, 14.5, 2.5];
    let first = flies(&area, "d", &[(0.0, here)]);
    for from in ["a0-1", "a1-1"] {
        hear(&mut area, 0.1, from, Says::Border(border(0.1, 1, &[])));
    }
    let offers = vec![offer("d", &[])];
    let told = border(0.1, 1, std::slice::from_ref(&first));
    let offering = Border { offers, ..told };
    hear(&mut area, 0.1, "a1-0", Says::Border(offering.clone()));
    let mut again = area.clone();
    let number = takes(&mut area, 0.2).number;
    area.offer("a0-1", offer("d", &[])).unwrap();
    let third = flies(&area, "d", &[(2.5, here), (12.0, [4.5, 24.5, 2.5])]);
    let asked = proposal(1, 2.5, &third, Some("d"));
    hear(&mut area, 1.5, "a0-1", Says::Propose(asked));
    assert_eq!(voted(&mut area), None);
    let (settled, is_flown) = (1, true);
    hear(
        &mut area,
        1.6,
        "a0-1",
        Says::Settle(Settled {
            number: settled,
            is_flown,
        }),
    );
    // The first owner was not heard since it agreed.
    hear(&mut area, 14.0, "a1-0", Says::Border(offering.clone()));
    area.tick(14.1);
    assert_eq!(proposed(&mut area), []);
    assert_eq!(of(area.running.plan(), "d").trajectory, third.trajectory);
    let tells = |area: &Area| {
        area.border("a1-0", 14.0)
            .drones
            .iter()
            .any(|it| it.name == "d")
    };
    assert!(tells(&area));
    let told = border(14.2, 2, &[]);
    hear(
        &mut area,
        14.2,
        "a1-0",
        Says::Border(Border {
            heard: number,
            ..told
        }),
    );
    assert!(!tells(&area));
    assert_eq!(contradiction(&area), None);
    let journal = area.take_records().into_iter();
    journal.for_each(|it| again.replay(it).unwrap());
    assert_eq!(again.running.plan(), area.running.plan());
    assert_eq!(again.revision, area.revision);
    assert!(!tells(&again));
}

#[test]
fn what_a_border_leaves_out_is_not_there_any_more() {
    let mut area = planner(&PAIR, "a0-0", [3.5, 8.5, 2.5]);
    let [x, again] =
        [(0.0, [14.5, 3.5, 2.5]), (5.5, [14.5, 12.5, 2.5])].map(|at| flies(&area, "x", &[at]));
    hear(&mut area, 1.0, "a1-0", Says::Border(border(1.0, 1, &[x])));
    hear(&mut area, 3.0, "a1-0", Says::Border(border(3.0, 2, &[])));
    let gone = of(area.running.plan(), "x");
    assert_eq!(gone.at_end, AtEnd::Leave);
    assert!(*gone.trajectory.t_s.last().unwrap() <= 3.01);
    let told = border(5.6, 3, std::slice::from_ref(&again));
    hear(&mut area, 5.6, "a1-0", Says::Border(told));
    assert_eq!(contradiction(&area), None);
    assert_eq!(of(area.running.plan(), "x").trajectory, again.trajectory);
}

#[test]
fn a_delay_is_heard_however_long_and_a_jump_is_not() {
    let mut area = planner(&PAIR, "a0-0", [3.5, 8.5, 2.5]);
    let [from, to] = [[14.5, 1.5, 2.5], [14.5, 15.5, 2.5]];
    let on_time = [(0.0, from), (3.0, from), (10.0, to)];
    let x = flies(&area, "x", &on_time);
    hear(&mut area, 8.0, "a1-0", Says::Border(border(8.0, 1, &[x])));
    let waits = [14.5, 5.5, 2.5];
    let late = [
        (0.0, from),
        (3.0, from),
        (5.0, waits),
        (8.5, waits),
        (13.5, to),
    ];
    let x = flies(&area, "x", &late);
    let fact = |revision: u64, x: &DronePlan| {
        let drones = vec![x.clone()];
        Says::Fact(Fact { revision, drones })
    };
    hear(&mut area, 8.4, "a1-0", fact(2, &x));
    assert_eq!(contradiction(&area), None);
    assert_eq!(of(area.running.plan(), "x").trajectory, x.trajectory);
    let mut points = late.to_vec();
    points.insert(4, (8.51, [4.5, 5.5, 2.5]));
    let jumps = flies(&area, "x", &points);
    hear(&mut area, 8.6, "a1-0", fact(3, &jumps));
    assert!(contradiction(&area).is_some_and(|it| it.contains("`x`")));
    assert_eq!(of(area.running.plan(), "x").trajectory, x.trajectory);
    // Nor where it jumps later on.
    let ahead = [(0.0, from), (8.6, waits), (12.0, waits), (12.01, to)];
    let jumps = flies(&area, "x", &ahead);
    hear(&mut area, 8.6, "a1-0", fact(3, &jumps));
    assert_eq!(of(area.running.plan(), "x").trajectory, x.trajectory);
}

#[test]
fn an_offered_drone_is_taken_from_where_it_hovers() {
    let mut area = planner(&PAIR, "a0-0", [12.5, 8.5, 2.5]);
    area.offer("a1-0", offer("a0-0-0", &[])).unwrap();
    let beside = flies(
        &area,
        "a0-0-0",
        &[(1.0, [12.5, 14.2, 2.5]), (6.0, [20.5, 8.5, 2.5])],
    );
    let asked = proposal(1, 1.0, &beside, Some("a0-0-0"));
    hear(&mut area, 0.2, "a1-0", Says::Propose(asked));
    assert!(contradiction(&area).is_some_and(|it| it.contains("5.7 m from where it said")));
}

#[test]
fn a_drone_that_is_promised_to_one_neighbour_is_not_promised_to_a_second() {
    let here = [14.5, 14.5, 2.5];
    let mut area = planner(&SQUARE, "a0-0", here);
    area.offer("a1-0", offer("a0-0-0", &[])).unwrap();
    let first = flies(&area, "a0-0-0", &[(1.0, here), (6.0, [20.5, 14.5, 2.5])]);
    let asked = proposal(1, 1.0, &first, Some("a0-0-0"));
    hear(&mut area, 0.2, "a1-0", Says::Propose(asked));
    assert_eq!(voted(&mut area), None);
    assert!(area.offer("a0-1", offer("a0-0-0", &[])).is_err());
    let mut both = planner(&SQUARE, "a0-0", here);
    // As a journal may have it that was written before.
    area.take_records()
        .into_iter()
        .for_each(|it| both.replay(it).unwrap());
    let offered = crate::airspace::Record::Offered {
        to: "a0-1".to_owned(),
        offer: offer("a0-0-0", &[]),
    };
    both.replay(offered).unwrap();
    let second = flies(&both, "a0-0-0", &[(3.0, here), (8.0, [14.5, 20.5, 2.5])]);
    let asked = proposal(1, 3.0, &second, Some("a0-0-0"));
    hear(&mut both, 1.5, "a0-1", Says::Propose(asked));
    assert!(voted(&mut both).is_some_and(|it| it.contains("promised to `a1-0`")));
}

#[test]
fn a_hand_over_keeps_the_load() {
    let mut area = planner(&PAIR, "a0-0", [3.5, 8.5, 2.5]);
    let mut x = flies(&area, "x", &[(0.0, [14.5, 3.5, 2.5])]);
    let laden_kg = x.airframe.mass_kg + 0.3;
    x.trajectory.mass_kg = vec![laden_kg];
    let offers = vec![offer("x", &[[12.5, 3.5, 2.5]])];
    let told = border(0.1, 1, &[x]);
    hear(
        &mut area,
        0.1,
        "a1-0",
        Says::Border(Border { offers, ..told }),
    );
    let asked = takes(&mut area, 0.2);
    let masses_kg = &asked.drones[0].trajectory.mass_kg;
    let is_laden = |kg: &f64| (kg - laden_kg).abs() < 1e-6;
    assert!(masses_kg.iter().all(is_laden), "{masses_kg:?}");
}

#[test]
fn another_load_or_airframe_in_a_border_is_noticed() {
    let mut area = planner(&PAIR, "a0-0", [3.5, 8.5, 2.5]);
    let mut x = flies(&area, "x", &[(0.0, [14.5, 3.5, 2.5])]);
    let tell = |area: &mut Area, revision: u64, x: &DronePlan| {
        let drones = std::slice::from_ref(x);
        hear(
            area,
            1.0,
            "a1-0",
            Says::Border(border(1.0, revision, drones)),
        );
        assert_eq!(contradiction(area), None);
        let known = of(area.running.plan(), "x");
        assert_eq!(known.trajectory, x.trajectory);
        assert_eq!(known.airframe, x.airframe);
        assert_eq!(known.air_limit, x.air_limit);
    };
    tell(&mut area, 1, &x);
    x.trajectory.mass_kg[0] += 0.3;
    tell(&mut area, 2, &x);
    x.airframe.body_radius_m += 0.1;
    tell(&mut area, 3, &x);
    x.air_limit *= 0.5;
    tell(&mut area, 4, &x);
}

#[test]
fn a_drone_that_comes_under_the_name_of_one_that_has_left_is_own() {
    let mut area = planner(&PAIR, "a0-0", [3.5, 8.5, 2.5]);
    let there = [14.5, 3.5, 2.5];
    let mut x = flies(&area, "x", &[(0.0, there), (1.0, there)]);
    (x.at_end, x.airborne_s) = (AtEnd::Leave, (0.0, Some(1.0)));
    hear(&mut area, 0.1, "a1-0", Says::Border(border(0.1, 1, &[x])));
    let comes = |start_m| {
        OneChange::Add(Add {
            drone: "x".to_owned(),
            like: "a0-0-0".to_owned(),
            start_m,
            at_start: planner::plan::AtStart::Hover,
            tasks: Vec::new(),
            at_end: AtEnd::Hover,
        })
    };
    // While it is there its name is taken.
    let mut before = area.clone();
    assert!(before.ask(0.0, vec![comes([3.5, 4.5, 2.5])]).is_err());
    assert_eq!(area.ask(2.0, vec![comes([3.5, 4.5, 2.5])]), Ok(true));
    assert!(area.own().any(|it| it.name == "x"));
}

#[test]
fn an_offer_that_cannot_be_taken_is_refused_and_one_that_is_not_can_be_withdrawn() {
    let mut area = planner(&PAIR, "a0-0", [12.5, 8.5, 2.5]);
    let mut again = area.clone();
    let beyond = offer("a0-0-0", &[[20.5, 8.5, 2.5], [4.5, 8.5, 2.5]]);
    let why = area.offer("a1-0", beyond).unwrap_err().to_string();
    assert!(why.contains("task 2"), "{why}");
    area.offer("a1-0", offer("a0-0-0", &[[20.5, 8.5, 2.5]]))
        .unwrap();
    let back = retask("a0-0-0", [4.5, 8.5, 2.5]);
    assert!(area.ask(0.1, back.clone()).is_err());
    area.withdraw("a0-0-0").unwrap();
    assert_eq!(area.border("a1-0", 0.1).offers, []);
    assert!(!area.is_offered("a0-0-0"));
    let journal = area.take_records().into_iter();
    journal.for_each(|it| again.replay(it).unwrap());
    assert!(!again.is_offered("a0-0-0"));
    // What is promised is not taken back.
    let here = [12.5, 8.5, 2.5];
    area.offer("a1-0", offer("a0-0-0", &[])).unwrap();
    let taken = flies(&area, "a0-0-0", &[(1.0, here), (6.0, [20.5, 8.5, 2.5])]);
    let asked = proposal(1, 1.0, &taken, Some("a0-0-0"));
    hear(&mut area, 0.2, "a1-0", Says::Propose(asked));
    assert_eq!(voted(&mut area), None);
    assert!(area.withdraw("a0-0-0").is_err());
}

#[test]
fn a_drone_near_a_lost_neighbour_may_go_away_from_it_and_land_but_come_no_nearer() {
    let mut area = planner(&PAIR, "a0-0", [14.5, 8.5, 2.5]);
    let until_s = 2.5;
    let told = border(0.1, 1, &[]);
    hear(
        &mut area,
        0.1,
        "a1-0",
        Says::Border(Border { until_s, ..told }),
    );
    let nearer = area.ask(5.0, retask("a0-0-0", [16.5, 8.5, 2.5]));
    assert_eq!(nearer, Err(Refused::Closed("a1-0".to_owned())));
    let mut other = area.clone();
    assert_eq!(other.ask(5.0, retask("a0-0-0", [4.5, 8.5, 2.5])), Ok(true));
    let land = OneChange::Land(Land {
        drone: "a0-0-0".to_owned(),
        over_m: Some([14.5, 8.5, 2.5]),
    });
    assert_eq!(area.ask(5.0, vec![land]), Ok(true));
}

#[test]
fn a_drone_that_has_landed_is_the_same_once_its_flight_is_dropped() {
    let mut area = planner(&PAIR, "a0-0", [3.5, 8.5, 2.5]);
    let mut other = planner(&PAIR, "a1-0", [14.5, 8.5, 2.5]);
    let land = OneChange::Land(Land {
        drone: "a1-0-0".to_owned(),
        over_m: Some([14.5, 4.5, 2.5]),
    });
    other.report(0.2, vec![land]).unwrap();
    // What a neighbour flies is known, and does not change the plan.
    let z = flies(&area, "z", &[(0.0, [12.5, 12.5, 2.5])]);
    let told = border(60.0, 1, &[z]);
    hear(&mut other, 60.0, "a0-0", Says::Border(told));
    let before = other.border("a0-0", 61.0);
    hear(&mut area, 61.0, "a1-0", Says::Border(before.clone()));
    other.tick(130.0);
    let after = other.border("a0-0", 130.0);
    assert_eq!(after.revision, before.revision);
    assert_ne!(after.drones, before.drones);
    hear(&mut area, 130.0, "a1-0", Says::Border(after));
    assert_eq!(contradiction(&area), None);
}

#[test]
fn a_drone_is_heard_again_wherever_it_may_have_flown_meanwhile() {
    let mut area = planner(&PAIR, "a0-0", [3.5, 8.5, 2.5]);
    let [from, to] = [[14.5, 1.5, 2.5], [14.5, 14.5, 2.5]];
    let x = flies(&area, "x", &[(0.0, from)]);
    hear(&mut area, 1.0, "a1-0", Says::Border(border(1.0, 1, &[x])));
    let x = flies(&area, "x", &[(0.0, from), (5.0, from), (15.0, to)]);
    // What is heard first says nothing of it.
    let (number, is_flown) = (1, false);
    hear(
        &mut area,
        20.0,
        "a1-0",
        Says::Settle(Settled { number, is_flown }),
    );
    let told = |now_s, revision, x: &DronePlan| {
        let drones = std::slice::from_ref(x);
        Says::Border(border(now_s, revision, drones))
    };
    hear(&mut area, 20.0, "a1-0", told(20.0, 2, &x));
    assert_eq!(contradiction(&area), None);
    assert_eq!(of(area.running.plan(), "x").trajectory, x.trajectory);
    // Not so far in a moment.
    let x = flies(&area, "x", &[(0.0, [21.5, 14.5, 2.5])]);
    hear(&mut area, 20.1, "a1-0", told(20.1, 3, &x));
    assert!(contradiction(&area).is_some_and(|it| it.contains("from where it said")));
}

#[test]
fn a_planner_that_has_promised_a_drone_hears_the_one_that_has_it_from_the_one_that_took_it() {
    let here = [14.5, 14.5, 2.5];
    let mut area = planner(&SQUARE, "a0-0", here);
    area.offer("a1-0", offer("a0-0-0", &[])).unwrap();
    let taken = flies(&area, "a0-0-0", &[(1.0, here), (6.0, [20.5, 14.5, 2.5])]);
    let asked = proposal(1, 1.0, &taken, Some("a0-0-0"));
    hear(&mut area, 0.2, "a1-0", Says::Propose(asked));
    assert_eq!(voted(&mut area), None);
    // The word that it is flown is lost; `a1-1` has taken it from `a1-0` since.
    let there = [20.5, 20.5, 2.5];
    let on = flies(&area, "a0-0-0", &[(10.0, [20.5, 14.5, 2.5]), (15.0, there)]);
    let y = flies(&area, "y", &[(0.0, [17.5, 19.5, 2.5])]);
    let told = border(16.0, 1, &[on, y.clone()]);
    hear(&mut area, 16.0, "a1-1", Says::Border(told));
    assert_eq!(contradiction(&area), None);
    assert_eq!(of(area.running.plan(), "y").trajectory, y.trajectory);
    let (number, is_flown) = (1, true);
    hear(
        &mut area,
        16.1,
        "a1-0",
        Says::Settle(Settled { number, is_flown }),
    );
    assert_eq!(contradiction(&area), None);
    assert!(area.own().all(|it| it.name != "a0-0-0"));
}

#[test]
fn a_hand_over_is_not_known_because_a_later_proposal_is() {
    let here = [14.5, 8.5, 2.5];
    let mut area = planner(&PAIR, "a0-0", here);
    area.offer("a1-0", offer("a0-0-0", &[])).unwrap();
    let taken = flies(&area, "a0-0-0", &[(1.0, here), (6.0, [20.5, 8.5, 2.5])]);
    let asked = proposal(1, 1.0, &taken, Some("a0-0-0"));
    hear(&mut area, 0.2, "a1-0", Says::Propose(asked));
    assert_eq!(voted(&mut area), None);
    // The word that it is flown is lost; that of the next is not.
    let y = flies(&area, "y", &[(3.0, [20.5, 3.5, 2.5])]);
    hear(
        &mut area,
        1.5,
        "a1-0",
        Says::Propose(proposal(2, 3.0, &y, None)),
    );
    assert_eq!(voted(&mut area), None);
    let (settled, is_flown) = (2, true);
    hear(
        &mut area,
        1.6,
        "a1-0",
        Says::Settle(Settled {
            number: settled,
            is_flown,
        }),
    );
    assert_eq!(area.border("a1-0", 2.0).heard, 0);
    let told = border(2.1, 3, &[taken, y]);
    hear(
        &mut area,
        2.1,
        "a1-0",
        Says::Border(Border { settled, ..told }),
    );
    assert_eq!(contradiction(&area), None);
    assert_eq!(area.border("a1-0", 2.2).heard, 2);
    assert!(area.own().all(|it| it.name != "a0-0-0"));
}

#[test]
fn a_drone_that_comes_under_the_name_of_one_that_has_left_is_own_while_it_is_judged() {
    let mut area = planner(&PAIR, "a0-0", [3.5, 8.5, 2.5]);
    let there = [14.5, 3.5, 2.5];
    let mut x = flies(&area, "x", &[(0.0, there), (1.0, there)]);
    (x.at_end, x.airborne_s) = (AtEnd::Leave, (0.0, Some(1.0)));
    hear(&mut area, 0.1, "a1-0", Says::Border(border(0.1, 1, &[x])));
    let comes = OneChange::Add(Add {
        drone: "x".to_owned(),
        like: "a0-0-0".to_owned(),
        start_m: there,
        at_start: planner::plan::AtStart::Hover,
        tasks: Vec::new(),
        at_end: AtEnd::Hover,
    });
    let y = flies(&area, "y", &[(3.5, [19.5, 3.5, 2.5]), (6.5, there)]);
    let asked = Says::Propose(proposal(1, 3.5, &y, None));
    let mut agrees = area.clone();
    hear(&mut agrees, 2.0, "a1-0", asked.clone());
    assert_eq!(voted(&mut agrees), None);
    let against = agrees.ask(2.1, vec![comes.clone()]).unwrap_err();
    assert!(matches!(against, Refused::NotVerified(_)), "{against}");
    assert_eq!(area.ask(2.0, vec![comes]), Ok(false));
    hear(&mut area, 2.1, "a1-0", asked);
    assert!(voted(&mut area).is_some_and(|it| it.contains("`x`")));
}

#[test]
fn a_drone_that_changes_hands_hovers_in_both_plans_until_it_is_flown_on() {
    let here = [14.5, 8.5, 2.5];
    let mut first = planner(&PAIR, "a0-0", here);
    let mut taker = planner(&PAIR, "a1-0", [26.5, 8.5, 2.5]);
    let task = [20.5, 8.5, 2.5];
    first.offer("a1-0", offer("a0-0-0", &[task])).unwrap();
    let told = first.border("a1-0", 9.0);
    hear(&mut taker, 9.0, "a0-0", Says::Border(told));
    taker.tick(9.1);
    let (_, asked) = proposed(&mut taker).remove(0);
    let (number, is_flown) = (asked.number, true);
    let from_s = asked.from_s;
    hear(&mut first, 9.2, "a1-0", Says::Propose(asked));
    assert_eq!(voted(&mut first), None);
    let against = None;
    hear(
        &mut taker,
        9.3,
        "a0-0",
        Says::Vote(Vote { number, against }),
    );
    hear(
        &mut first,
        9.4,
        "a1-0",
        Says::Settle(Settled { number, is_flown }),
    );
    for area in [&first, &taker] {
        let entry = of(area.running.plan(), "a0-0-0");
        assert_eq!(entry.trajectory.t_s[0], 0.0, "{}", area.name());
        assert_eq!(entry.trajectory.position_m(from_s), Some(here.into()));
        assert_eq!(entry.trajectory.position_m.last(), Some(&task.into()));
    }
    assert_eq!(contradiction(&first), None);
}

#[test]
fn a_neighbours_drone_may_come_under_the_name_of_an_own_one_that_has_left() {
    let mut area = planner(&PAIR, "a0-0", [3.5, 8.5, 2.5]);
    let leaves = OneChange::Add(Add {
        drone: "x".to_owned(),
        like: "a0-0-0".to_owned(),
        start_m: [3.5, 4.5, 2.5],
        at_start: planner::plan::AtStart::Hover,
        tasks: Vec::new(),
        at_end: AtEnd::Leave,
    });
    assert_eq!(area.ask(0.0, vec![leaves]), Ok(true));
    let comes = [(3.5, [19.5, 3.5, 2.5]), (6.5, [14.5, 3.5, 2.5])];
    let x = flies(&area, "x", &comes);
    hear(
        &mut area,
        2.0,
        "a1-0",
        Says::Propose(proposal(1, 3.5, &x, None)),
    );
    assert_eq!(voted(&mut area), None);
}

#[test]
fn what_is_offered_is_taken_once_it_hovers() {
    let mut taker = planner(&PAIR, "a1-0", [26.5, 8.5, 2.5]);
    let here = [14.5, 8.5, 2.5];
    let d = flies(&taker, "d", &[(0.0, [3.5, 8.5, 2.5]), (9.5, here)]);
    let told = Border {
        offers: vec![offer("d", &[[20.5, 8.5, 2.5]])],
        ..border(9.0, 1, &[d])
    };
    hear(&mut taker, 9.0, "a0-0", Says::Border(told));
    taker.tick(9.1);
    assert_eq!(proposed(&mut taker), []);
    taker.tick(9.6);
    assert_eq!(proposed(&mut taker).len(), 1);
}
