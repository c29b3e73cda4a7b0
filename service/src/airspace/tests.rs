#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod heard;

use std::collections::BTreeMap;

use planner::plan::{AtEnd, Bounds, DronePlan};
use planner::{Control, Plan};

use super::message::{Message, Offer, Says};
use super::traffic::{Grid, Traffic};
use super::{Area, InProcess, Neighbours, Record, Refused, Seat, Site};
use crate::message::{Late, OneChange, Retask, Task};

/// Between two looks at what has come (s).
const STEP_S: f64 = 0.1;

struct Planner {
    area: Area,
    traffic: Traffic,
    seat: Seat,
    journal: Vec<Record>,
}

fn area(grid: &Grid, site: &Site, name: &str) -> Area {
    let world = planner::read_world(&grid.scenario(name).unwrap()).unwrap();
    let outcome = planner::plan_world(&world, &Control::QUIET).unwrap();
    let plan = outcome.into_planned().unwrap().plan;
    assert_eq!(plan.violations, []);
    Area::new(site.clone(), name, world, plan).unwrap()
}

struct Run {
    grid: Grid,
    site: Site,
    air: InProcess,
    planners: BTreeMap<String, Planner>,
    now_s: f64,
}

impl Run {
    fn new(grid: Grid, crossing: usize) -> Run {
        let (site, air) = (grid.site(0.5), InProcess::default());
        let planner = |name: &String| Planner {
            area: area(&grid, &site, name),
            traffic: Traffic::new(grid, name, crossing),
            seat: air.seat(name),
            journal: Vec::new(),
        };
        let planners = site.areas.keys().map(|name| (name.clone(), planner(name)));
        Run {
            planners: planners.collect(),
            grid,
            site,
            air,
            now_s: 0.0,
        }
    }

    fn step(&mut self, has_traffic: bool) {
        self.now_s += STEP_S;
        for it in self.planners.values_mut() {
            for message in it.seat.received() {
                it.area.receive(self.now_s, &message);
            }
            it.area.tick(self.now_s);
            if has_traffic {
                it.traffic.step(&mut it.area, self.now_s);
            }
            it.journal.extend(it.area.take_records());
            for message in it.area.take_messages() {
                it.seat.send(&message);
            }
        }
    }

    /// What all fly from now on, judged together.
    fn is_sound(&self) {
        let plan = union(
            self.planners.values().map(|it| &it.area),
            &self.grid.whole_m(),
        );
        let now_s = self.now_s;
        let found = planner::verify(&plan).violations;
        let ahead = found.iter().filter(|it| it.matters_from(now_s));
        let ahead: Vec<String> = ahead.map(ToString::to_string).collect();
        assert!(ahead.is_empty(), "at {now_s:.1} s: {ahead:#?}");
    }

    fn run(&mut self, for_s: f64) {
        let until_s = self.now_s + for_s;
        let mut steps = 0;
        while self.now_s < until_s {
            self.step(steps % 3 == 0);
            steps += 1;
            if steps % 10 == 0 {
                self.is_sound();
            }
        }
    }

    fn taken(&self) -> u64 {
        self.planners
            .values()
            .map(|it| it.area.counts().taken)
            .sum()
    }

    fn no_contradictions(&self) {
        for it in self.planners.values() {
            assert_eq!(it.area.counts().contradictions, [], "{}", it.area.name());
        }
    }
}

/// One plan of all drones, each as its planner has it; one with two owners as the taking one.
fn union<'a>(areas: impl Iterator<Item = &'a Area>, whole_m: &Bounds) -> Plan {
    let mut plan: Option<Plan> = None;
    let mut drones: BTreeMap<String, DronePlan> = BTreeMap::new();
    for area in areas {
        plan = plan.or_else(|| Some(area.running.plan().clone()));
        for it in area.own() {
            let ends_s = |it: &DronePlan| it.trajectory.t_s.last().copied();
            let known = drones.get(&it.name);
            if known.is_none_or(|known| ends_s(known) < ends_s(it)) {
                drones.insert(it.name.clone(), it.clone());
            }
        }
    }
    Plan {
        bounds_m: *whole_m,
        drones: drones.into_values().collect(),
        unplanned: Vec::new(),
        violations: Vec::new(),
        ..plan.unwrap()
    }
}

const SMALL: Grid = Grid {
    areas: [2, 2],
    side_m: 12,
    strip_m: 3,
    drones: 2,
    seed: 1,
};

#[test]
fn an_area_that_has_no_room_for_its_drones_is_refused() {
    let full = Grid {
        drones: 20,
        ..SMALL
    };
    assert!(
        full.scenario("a0-0")
            .is_err_and(|it| it.contains("20 drones"))
    );
    assert!(SMALL.scenario("a0-0").is_ok());
}

#[test]
fn drones_change_hands_between_four_areas_and_all_plans_together_stay_sound() {
    let mut run = Run::new(SMALL, 60);
    run.run(25.0);
    assert!(run.taken() >= 4, "{} were handed over", run.taken());
    run.no_contradictions();
    let drones: usize = run.planners.values().map(|it| it.area.own().count()).sum();
    assert_eq!(drones, 8);
}

#[test]
fn a_planner_that_is_killed_goes_on_from_its_journal() {
    let mut run = Run::new(SMALL, 60);
    run.run(8.0);
    let name = "a0-1".to_owned();
    let killed = run.planners.remove(&name).unwrap();
    // What was not answered for is lost with it.
    run.run(5.0);
    let mut area = area(&run.grid, &run.site, &name);
    for record in killed.journal.clone() {
        area.replay(record).unwrap();
    }
    assert_eq!(area.running.plan(), killed.area.running.plan());
    assert_eq!(area.revision, killed.area.revision);
    run.planners.insert(name, Planner { area, ..killed });
    let taken = run.taken();
    run.run(15.0);
    assert!(run.taken() > taken);
    run.no_contradictions();
}

#[test]
fn a_planner_that_is_cut_off_flies_on_and_nothing_is_changed_near_it() {
    let mut run = Run::new(SMALL, 60);
    run.run(10.0);
    run.air.cut_off("a1-0", true);
    run.run(10.0);
    let silent = |run: &Run| {
        let refused = run
            .planners
            .values()
            .map(|it| it.traffic.refused().get("silent neighbour"));
        refused.map(|it| it.copied().unwrap_or(0)).sum::<u64>()
    };
    assert!(silent(&run) > 0);
    run.air.cut_off("a1-0", false);
    run.run(3.0);
    let (before, taken) = (silent(&run), run.taken());
    run.run(12.0);
    assert_eq!(silent(&run), before);
    assert!(run.taken() > taken);
    run.no_contradictions();
}

#[test]
fn near_a_planner_that_is_lost_nothing_is_planned_until_it_is_heard_again() {
    let mut run = Run::new(
        Grid {
            areas: [2, 1],
            drones: 2,
            ..SMALL
        },
        0,
    );
    run.run(2.0);
    let lost = run.planners.remove("a1-0").unwrap();
    let there = Task {
        to_m: [11.5, 6.5, 2.5],
        dwell_s: 0.0,
        load_kg: None,
    };
    let drone = "a0-0-0".to_owned();
    let retask = OneChange::Retask(Retask {
        drone,
        tasks: vec![there],
    });
    let ask = |run: &mut Run| {
        let now_s = run.now_s;
        let area = &mut run.planners.get_mut("a0-0").unwrap().area;
        area.ask(now_s, vec![retask.clone()])
    };
    run.run(6.0);
    assert_eq!(ask(&mut run), Err(Refused::Silent("a1-0".to_owned())));
    run.run(70.0);
    assert_eq!(ask(&mut run), Err(Refused::Closed("a1-0".to_owned())));
    // What it flew is still there.
    assert!(run.planners["a0-0"].area.running.plan().drones.len() >= 2);
    run.planners.insert("a1-0".to_owned(), lost);
    (0..25).for_each(|_| run.step(false));
    let flown = run.planners["a0-0"].area.counts().flown;
    assert_eq!(ask(&mut run), Ok(false));
    (0..25).for_each(|_| run.step(false));
    assert_eq!(run.planners["a0-0"].area.counts().flown, flown + 1);
    run.is_sound();
}

#[test]
fn events_are_reported_and_others_replan_around_them() {
    let mut run = Run::new(SMALL, 60);
    run.run(8.0);
    let mut told = 0;
    for _ in 0..20 {
        let now_s = run.now_s;
        for it in run.planners.values_mut() {
            let flies = |it: &&DronePlan| {
                it.trajectory
                    .t_s
                    .last()
                    .is_some_and(|last_s| *last_s > now_s + 2.0)
            };
            let drone = it.area.own().find(flies).map(|it| it.name.clone());
            if let Some(drone) = drone.filter(|_| told % 7 == 0) {
                let late = OneChange::Late(Late { drone, by_s: 0.2 });
                it.area.report(now_s, vec![late]).unwrap();
            }
            told += 1;
        }
        (0..3).for_each(|k| run.step(k == 0));
    }
    run.no_contradictions();
}

/// Two areas with a wide strip between them, after three seconds.
fn two_areas() -> Run {
    let mut run = Run::new(
        Grid {
            areas: [2, 1],
            drones: 3,
            strip_m: 6,
            ..SMALL
        },
        0,
    );
    run.run(3.0);
    run
}

#[test]
fn an_offer_is_said_with_every_border_and_kept_by_a_journal() {
    let mut run = two_areas();
    let now_s = run.now_s;
    let area = &mut run.planners.get_mut("a0-0").unwrap().area;
    let mut again = area.clone();
    let offers: Vec<Offer> = area
        .own()
        .map(|it| Offer {
            drone: it.name.clone(),
            tasks: Vec::new(),
            at_end: AtEnd::Hover,
        })
        .collect();
    let taken = offers
        .into_iter()
        .find(|it| area.offer("a1-0", it.clone()).is_ok());
    let offer = taken.expect("one hovers in the strip");
    for later_s in [0.0, 1.0, 2.0] {
        let border = area.border("a1-0", now_s + later_s);
        assert_eq!(border.offers, std::slice::from_ref(&offer));
    }
    // What a journal keeps brings it back.
    for record in area.take_records() {
        if matches!(record, super::Record::Offered { .. }) {
            again.replay(record).unwrap();
        }
    }
    assert!(again.is_offered(&offer.drone));
}

#[test]
fn a_neighbour_that_contradicts_itself_is_refused_and_its_last_wakes_stay() {
    let mut run = two_areas();
    let now_s = run.now_s;
    let mut border = run.planners["a1-0"].area.border("a0-0", now_s);
    assert!(!border.drones.is_empty());
    let say = |says: Says| Message {
        protocol: super::message::PROTOCOL.to_owned(),
        from: "a1-0".to_owned(),
        to: "a0-0".to_owned(),
        says,
    };
    let area = &mut run.planners.get_mut("a0-0").unwrap().area;
    let good = border.clone();
    area.receive(now_s, &say(Says::Border(good.clone())));
    assert_eq!(area.counts().contradictions, []);
    let before = area.running.plan().clone();
    let mut wrong = |says: Says, words: &str| {
        area.receive(now_s, &say(says));
        let (_, what) = area.counts().contradictions.back().expect(words);
        assert!(what.contains(words), "{what}");
        assert_eq!(*area.running.plan(), before, "{words}");
    };
    border.revision = 0;
    wrong(Says::Border(border.clone()), "revision 0 after revision");
    border.revision = good.revision + 1;
    for at_m in &mut border.drones[0].trajectory.position_m {
        at_m.x += 100.0;
    }
    wrong(Says::Border(border.clone()), "100.0 m from where it said");
    border = good.clone();
    border.drones[0].trajectory.position_m.last_mut().unwrap().z += 0.5;
    wrong(Says::Border(border.clone()), "says two things of revision");
    border = good.clone();
    border.revision += 1;
    border.drones.push(border.drones[0].clone());
    wrong(Says::Border(border.clone()), "says two things of `");
    border.drones[0].name = "a0-0-0".to_owned();
    wrong(Says::Border(border), "`a0-0-0` is of `a0-0`");
    let flown = super::message::Settled {
        number: 7,
        is_flown: true,
    };
    wrong(Says::Settle(flown), "proposal 7, which was not agreed to");
    let vote = super::message::Vote {
        number: 9,
        against: None,
    };
    area_is_silent_on(&mut run, &say(Says::Vote(vote)));
    // An offer of what is not there is passed over.
    let mut offering = run.planners["a1-0"].area.border("a0-0", now_s);
    offering.offers.push(Offer {
        drone: "ghost".to_owned(),
        tasks: Vec::new(),
        at_end: AtEnd::Hover,
    });
    area_is_silent_on(&mut run, &say(Says::Border(offering)));
}

fn area_is_silent_on(run: &mut Run, message: &Message) {
    let now_s = run.now_s;
    let area = &mut run.planners.get_mut("a0-0").unwrap().area;
    let before = area.running.plan().clone();
    area.receive(now_s, message);
    area.tick(now_s);
    assert_eq!(*area.running.plan(), before);
}
