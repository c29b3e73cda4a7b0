#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

use planner::plan::AtEnd;
use serde_json::{Value, json};

use super::{Handled, Service};
use crate::message::{Code, Record, Told};

/// Two drones that pass one another, planned to bear 0.3 s and 0.1 m.
const PAIR: &str = r#"Scenario(
  name: "pair",
  bounds_m: (min: (0, 0, 0), max: (24, 12, 4)),
  drones: [
    (name: "left", airframe: "kolibri", start_m: (2.5, 2.5, 1.5), tasks: [(to_m: (20.5, 2.5, 1.5))]),
    (name: "right", airframe: "kolibri", start_m: (20.5, 8.5, 1.5), tasks: [(to_m: (2.5, 8.5, 1.5))]),
  ],
)
"#;

fn tell(service: &mut Service, request: &Value) -> Handled {
    service.handle(&request.to_string(), &|| 0.0)
}

fn opened() -> Service {
    let mut service = Service::default();
    let open = json!({"id": 1, "method": "open", "params": {"scenario": PAIR}});
    let told = tell(&mut service, &open);
    assert_eq!(told.answer.error, None);
    assert_eq!(told.answer.protocol, Some("serve/1"));
    service
}

fn plan_text(service: &mut Service) -> String {
    let told = tell(service, &json!({"method": "plan"}));
    serde_json::to_string(&told.answer.result.unwrap()).unwrap()
}

fn change(revision: u64, at_s: f64, changes: &Value) -> Value {
    json!({"method": "change", "params": {"revision": revision, "at_s": at_s, "changes": changes}})
}

fn state(at_s: f64, drone: &str, position_m: [f64; 3]) -> Value {
    let drones = json!({drone: {"position_m": position_m}});
    json!({"method": "state", "params": {"at_s": at_s, "drones": drones}})
}

fn planned_m(service: &Service, drone: &str, at_s: f64) -> [f64; 3] {
    let plan = service.flown.as_ref().unwrap().running.plan();
    let entry = plan.drones.iter().find(|it| it.name == drone).unwrap();
    entry.trajectory.position_m(at_s).unwrap().coords.into()
}

#[test]
fn what_is_refused_says_what_and_where_and_changes_nothing() {
    let mut service = opened();
    tell(
        &mut service,
        &change(1, 2.0, &json!([{"late": {"drone": "left", "by_s": 1.0}}])),
    );
    let before = plan_text(&mut service);
    let late = |drone: &str, by_s: Value| json!([{"late": {"drone": drone, "by_s": by_s}}]);
    let cases: Vec<(String, Code, &str)> = vec![
        ("{".to_owned(), Code::Malformed, "column 1"),
        ("[]".to_owned(), Code::Field, ""),
        ("{}".to_owned(), Code::Field, "method"),
        (
            json!({"method": "fly"}).to_string(),
            Code::UnknownMethod,
            "method",
        ),
        (
            json!({"method": "plan", "parms": 1}).to_string(),
            Code::Field,
            "parms",
        ),
        (
            json!({"method": "state"}).to_string(),
            Code::Field,
            "params",
        ),
        (
            json!({"id": [], "method": "plan"}).to_string(),
            Code::Field,
            "id",
        ),
        (
            json!({"method": "open", "params": {"scenario": PAIR}}).to_string(),
            Code::AlreadyOpen,
            "method",
        ),
        (
            change(1, 3.0, &late("left", json!(1))).to_string(),
            Code::StaleRevision,
            "params.revision",
        ),
        (
            change(3, 3.0, &late("left", json!(1))).to_string(),
            Code::FutureRevision,
            "params.revision",
        ),
        (
            change(2, 1.0, &late("left", json!(1))).to_string(),
            Code::ClockBack,
            "params.at_s",
        ),
        (
            change(2, 1e6, &late("left", json!(1))).to_string(),
            Code::Time,
            "params.at_s",
        ),
        (
            change(2, 1e12, &late("left", json!(1))).to_string(),
            Code::Range,
            "params.at_s",
        ),
        (
            change(2, -5.0, &late("left", json!(1))).to_string(),
            Code::Range,
            "params.at_s",
        ),
        (
            change(2, 3.0, &late("left", json!(1e9))).to_string(),
            Code::Range,
            "params.changes[0].late.by_s",
        ),
        (
            state(3.0, "left", [2.5, 2.5, 1e9]).to_string(),
            Code::Range,
            "params.drones.left.position_m[2]",
        ),
        (
            json!({"method": "land_all", "params": {"at_s": 3, "time_limit_s": -1}}).to_string(),
            Code::Range,
            "params.time_limit_s",
        ),
        (
            json!({"method": "open", "params": {"scenario": PAIR, "plan": {"drones": 1}}})
                .to_string(),
            Code::AlreadyOpen,
            "method",
        ),
        (
            change(2, 3.0, &late("absent", json!(1))).to_string(),
            Code::UnknownDrone,
            "params.changes[0]",
        ),
        (
            change(2, 3.0, &late("left", json!(-1))).to_string(),
            Code::Range,
            "params.changes[0].late.by_s",
        ),
        (
            change(2, 3.0, &late("left", json!("1"))).to_string(),
            Code::Field,
            "params.changes[0].late.by_s",
        ),
        (
            change(2, 3.0, &json!([])).to_string(),
            Code::Change,
            "params.changes",
        ),
        (
            change(
                2,
                3.0,
                &json!(vec![json!({"remove": {"drone": "left"}}); 1001]),
            )
            .to_string(),
            Code::TooMuch,
            "params.changes",
        ),
        (
            change(
                2,
                3.0,
                &json!([{"add": {"drone": "new", "like": "old", "start_m": [1, 1, 1]}}]),
            )
            .to_string(),
            Code::UnknownDrone,
            "params.changes[0].add.like",
        ),
        (
            change(
                2,
                3.0,
                &json!([{"retask": {"drone": "left", "tasks": [{"to_m": [99, 1, 1]}]}}]),
            )
            .to_string(),
            Code::Change,
            "params.changes",
        ),
        (
            state(1e5, "left", [2.5, 2.5, 1.5]).to_string(),
            Code::Time,
            "params.at_s",
        ),
        (
            state(1.0, "left", [2.5, 2.5, 1.5]).to_string(),
            Code::ClockBack,
            "params.at_s",
        ),
        (
            state(3.0, "absent", [2.5, 2.5, 1.5]).to_string(),
            Code::UnknownDrone,
            "params.drones.absent",
        ),
        (
            state(3.0, "left", [102.5, 2.5, 1.5]).to_string(),
            Code::Jump,
            "params.drones.left.position_m",
        ),
    ];
    for (line, code, place) in cases {
        let Handled { answer, record, .. } = service.handle(&line, &|| 0.0);
        let error = answer.error.unwrap_or_else(|| panic!("taken: {line}"));
        assert_eq!(error.code, code, "{line}: {error:?}");
        let starts = code == Code::Change && error.place.starts_with(place);
        assert!(error.place == place || starts, "{line}: {error:?}");
        assert_eq!(record, None, "{line}");
        assert_eq!(plan_text(&mut service), before, "{line}");
    }
}

#[test]
fn all_that_is_wrong_with_a_request_is_reported_at_once() {
    let mut service = opened();
    let changes = json!([
        {"late": {"drone": "left", "by_s": -1}},
        {"remove": {"drone": "absent"}},
    ]);
    let error = tell(&mut service, &change(1, 2.0, &changes))
        .answer
        .error
        .unwrap();
    let mut places = vec![error.place.clone()];
    places.extend(error.also.iter().map(|it| it.place.clone()));
    assert_eq!(places, ["params.changes[0].late.by_s", "params.changes[1]"]);

    // Of a drone that changes twice what is wrong with either stands where it is.
    for first_is_wrong in [true, false] {
        let by_s = |is_wrong: bool| if is_wrong { -1 } else { 1 };
        let changes = json!([
            {"late": {"drone": "left", "by_s": by_s(first_is_wrong)}},
            {"late": {"drone": "left", "by_s": by_s(!first_is_wrong)}},
        ]);
        let told = tell(&mut service, &change(1, 2.0, &changes));
        let error = told.answer.error.unwrap();
        let place = format!("params.changes[{}].late.by_s", usize::from(!first_is_wrong));
        assert_eq!((error.code, &error.place), (Code::Range, &place));
        let also: Vec<(&str, &str)> = (error.also.iter())
            .map(|it| (&it.place[..], &it.message[..]))
            .collect();
        let twice = "`left` changes twice; say all of it in one change";
        match first_is_wrong {
            true => assert_eq!(also, [("params.changes[1]", twice)]),
            // Its place is told already.
            false => assert_eq!(also, []),
        }
    }
}

#[test]
fn a_load_or_a_name_that_cannot_be_is_reported_at_its_change() {
    let mut service = opened();
    let heavy = json!({"to_m": [10.5, 2.5, 3], "load_kg": 999});
    let changes = json!([
        {"retask": {"drone": "right", "tasks": [{"to_m": [10.5, 8.5, 3]}]}},
        {"retask": {"drone": "left", "tasks": [heavy]}},
        {"add": {"drone": "a\nb", "like": "left", "start_m": [5.5, 5.5, 2]}},
    ]);
    let told = tell(&mut service, &change(1, 2.0, &changes));
    let error = told.answer.error.unwrap();
    assert_eq!(error.place, "params.changes[1]", "{error:?}");
    let [name] = &error.also[..] else {
        panic!("{error:?}")
    };
    assert_eq!(name.place, "params.changes[2]");
    let words = "is broken by a line break or another control character";
    assert!(name.message.ends_with(words), "{}", name.message);
}

/// Every value in a request, by its path.
fn paths(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                paths(item, &format!("{at}/{index}"), found);
            }
        }
        Value::Object(fields) => {
            for (name, field) in fields {
                paths(field, &format!("{at}/{name}"), found);
            }
        }
        _ => {}
    }
}

#[test]
fn a_field_of_another_kind_is_reported_at_its_place_in_words_of_the_message_and_not_of_its_reader()
{
    let mut service = opened();
    let task = json!({"to_m": [12.5, 9.5, 1.5], "dwell_s": 1, "load_kg": 0.1});
    let changes = json!([
        {"late": {"drone": "left", "by_s": 1}},
        {"add": {
            "drone": "new", "like": "left", "start_m": [12.5, 10.5, 1.5], "at_start": "hover",
            "tasks": [task], "at_end": "leave",
        }},
        {"remove": {"drone": "one"}},
        {"fail": {"drone": "two", "lies_m": [1, 1, 1]}},
        {"retask": {"drone": "right", "tasks": [task]}},
        {"land": {"drone": "three", "over_m": [1, 1, 1]}},
    ]);
    let good = [
        json!({"id": 1, "method": "change", "params": {
            "revision": 1, "at_s": 2, "time_limit_s": 10, "changes": changes,
        }}),
        json!({"id": null, "method": "state", "params": {
            "at_s": 1, "time_limit_s": 1, "drones": {"left": {"position_m": [2.5, 2.5, 1.5]}},
        }}),
        json!({"method": "land_all", "params": {"revision": 1, "at_s": 2, "time_limit_s": 1}}),
        json!({"method": "open", "params": {"scenario": PAIR, "time_limit_s": 1}}),
    ];
    let others = [
        json!(null),
        json!(true),
        json!(-1),
        json!(2.5),
        json!(1e300),
        json!(u64::MAX),
        json!("x"),
        json!([]),
        json!([1, "2", 3]),
        json!({}),
        json!({"more": 1, "other": 2}),
    ];
    let of_reader = [
        "expected",
        "invalid",
        "variant",
        "enum",
        "struct",
        "sequence",
        "u64",
        "f64",
        "i64",
        "untagged",
        "plan schema serve",
    ];
    let mut refused = 0;
    for request in &good {
        let mut places = Vec::new();
        paths(request, "", &mut places);
        for at in &places {
            for other in &others {
                let mut request = request.clone();
                *request.pointer_mut(at).unwrap() = other.clone();
                let told = tell(&mut service.clone(), &request).answer;
                let Some(error) = told.error else { continue };
                for it in std::iter::once(&error).chain(&error.also) {
                    if it.code == Code::Field {
                        refused += 1;
                        let words = of_reader.iter().find(|word| it.message.contains(**word));
                        assert_eq!(words, None, "{request}: {it:?}");
                        let is_there = !it.place.is_empty() || at.is_empty();
                        assert!(is_there, "{request}: {it:?}");
                    }
                }
            }
        }
    }
    assert!(refused > 300, "{refused}");
    let told = tell(
        &mut service,
        &json!({"method": "change", "params": {"revision": "1", "changes": [{"late": 1}]}}),
    );
    let error = told.answer.error.unwrap();
    let told: Vec<&str> = (std::iter::once(&error).chain(&error.also))
        .map(|it| &it.message[..])
        .collect();
    assert_eq!(
        told,
        [
            "`revision`: a whole number from 0 on, not \"1\"",
            "`late`: an object with drone, by_s, not 1",
            "`at_s`: missing: a number from 0 to 32000000",
        ]
    );
}

#[test]
fn a_plan_that_is_handed_in_and_is_none_is_reported_at_its_field() {
    let mut service = opened();
    let whole = tell(&mut service, &json!({"method": "plan"})).answer.result;
    let whole = serde_json::to_value(whole.unwrap()).unwrap();
    let mut plan = whole["plan"].clone();
    plan["drones"][1]["trajectory"]["t_s"][0] = json!("0");
    let open = json!({"method": "open", "params": {"scenario": PAIR, "plan": plan}});
    let error = tell(&mut Service::default(), &open).answer.error.unwrap();
    assert_eq!(
        (error.code, &error.place[..], &error.message[..]),
        (
            Code::Plan,
            "params.plan.drones[1].trajectory.t_s[0]",
            "`t_s[0]`: a number, not \"0\""
        )
    );
    for none in [json!("x"), json!(3), json!([1])] {
        let open = json!({"method": "open", "params": {"scenario": PAIR, "plan": none}});
        let error = tell(&mut Service::default(), &open).answer.error.unwrap();
        let told = (error.code, &error.place[..], error.also.len());
        assert_eq!(told, (Code::Plan, "params.plan", 0), "{none}");
        assert!(error.message.starts_with("an object with"), "{error:?}");
    }
}

#[test]
fn a_scenario_s_errors_stand_at_their_lines() {
    let mut service = Service::default();
    let broken = PAIR.replace("kolibri", "colibri");
    let open = json!({"method": "open", "params": {"scenario": broken}});
    let error = tell(&mut service, &open).answer.error.unwrap();
    assert_eq!(error.code, Code::Scenario);
    assert!(error.place.starts_with("params.scenario:5:"), "{error:?}");
    assert!(
        error
            .also
            .iter()
            .any(|it| it.place.starts_with("params.scenario:6:"))
    );
}

#[test]
fn a_patch_begins_at_the_hundredth_from_which_the_planner_changed_it() {
    // 1.1 in hundredths is a little above 110, 2.301 is on its way to 231.
    for (at_s, from_s) in [(1.1, 1.1), (2.301, 2.31)] {
        let late = json!([{"late": {"drone": "left", "by_s": 0.5}}]);
        let told = tell(&mut opened(), &change(1, at_s, &late)).answer;
        let Some(Told::Patch(patch)) = told.result else {
            panic!("{told:?}")
        };
        assert_eq!(patch.from_s, from_s);
        // So does one in which all land already.
        let mut service = open(THREE);
        land_all(&mut service, at_s.floor());
        let told = land_all(&mut service, at_s).answer;
        let Some(Told::Landing(landing)) = told.result else {
            panic!("{told:?}");
        };
        assert_eq!((landing.revision, landing.patch.from_s), (2, from_s));
    }
}

#[test]
fn only_a_drone_off_its_plan_by_more_than_its_margin_becomes_a_change() {
    let mut service = opened();
    let margins = service.flown.as_ref().unwrap().running.plan().margins;
    let near = planned_m(&service, "left", 4.0 - 0.5 * margins.time_s);
    let told = tell(&mut service, &state(4.0, "left", near));
    let Some(Told::Seen(seen)) = told.answer.result else {
        panic!("{:?}", told.answer)
    };
    assert_eq!(
        (seen.patch, seen.off_path.len(), told.record),
        (None, 0, None)
    );

    // It is where it was to be 2 s before: that much late.
    let behind = planned_m(&service, "left", 2.5);
    let told = tell(&mut service, &state(4.5, "left", behind));
    let Some(Told::Seen(seen)) = told.answer.result else {
        panic!("{:?}", told.answer)
    };
    let patch = seen.patch.expect("a patch");
    assert_eq!((patch.revision, &patch.changed[0].drone[..]), (2, "left"));
    let Some(Record::Changed { changes, .. }) = told.record else {
        panic!()
    };
    let change = serde_json::to_value(&changes).unwrap();
    let by_s = change[0]["late"]["by_s"].as_f64().unwrap();
    assert!((by_s - 2.0).abs() < 0.011, "{by_s}");
    // From the break point before the change on, to the end of what it flies.
    let rest = &patch.changed[0].trajectory;
    assert!(rest.t_s[0] <= patch.from_s && rest.t_s.get(1).is_none_or(|it| *it > patch.from_s));
    let whole = &service.flown.as_ref().unwrap().running.plan().drones[0].trajectory;
    assert_eq!(rest.t_s.last(), whole.t_s.last());

    // Beside its path it is not late, and no change says where it is.
    let [x, y, z] = planned_m(&service, "left", 5.0);
    let told = tell(&mut service, &state(5.0, "left", [x, y + 1.0, z]));
    let Some(Told::Seen(seen)) = told.answer.result else {
        panic!("{:?}", told.answer)
    };
    assert_eq!(seen.patch, None);
    assert_eq!(seen.off_path[0].drone, "left");
    assert!((seen.off_path[0].off_m - 1.0).abs() < 1e-9);
}

#[test]
fn a_request_that_takes_too_long_leaves_no_trace() {
    let (mut hurried, mut unhurried) = (opened(), opened());
    let retask = json!([{"retask": {"drone": "left", "tasks": [{"to_m": [12.5, 9.5, 2.5]}]}}]);
    let request = change(1, 3.0, &retask);
    let mut limited = request.clone();
    limited["params"]["time_limit_s"] = json!(0.5);
    let before = plan_text(&mut hurried);
    let told = hurried.handle(&limited.to_string(), &|| 0.6);
    assert_eq!(told.answer.error.unwrap().code, Code::Deadline);
    assert_eq!(plan_text(&mut hurried), before);
    for service in [&mut hurried, &mut unhurried] {
        assert_eq!(tell(service, &request).answer.error, None);
    }
    assert_eq!(plan_text(&mut hurried), plan_text(&mut unhurried));
}

#[test]
fn what_a_journal_keeps_gives_the_same_plan_to_the_byte() {
    let mut service = Service::default();
    let open = json!({"method": "open", "params": {"scenario": PAIR}});
    let add = json!({"add": {
        "drone": "third", "like": "left", "start_m": [12.5, 10.5, 1.5],
        "tasks": [{"to_m": [12.5, 1.5, 2.5], "dwell_s": 2}], "at_end": "land",
    }});
    let retask = json!([{"retask": {"drone": "right", "tasks": [{"to_m": [12.5, 5.5, 3.0]}]}}]);
    let requests = [
        open,
        change(1, 2.0, &json!([{"late": {"drone": "left", "by_s": 1.5}}])),
        change(2, 3.0, &json!([add])),
        change(3, 4.333, &retask),
        change(4, 6.0, &json!([{"remove": {"drone": "left"}}])),
    ];
    let mut records = Vec::new();
    for request in &requests {
        let told = tell(&mut service, request);
        assert_eq!(told.answer.error, None, "{request}");
        records.push(serde_json::to_string(&told.record.unwrap()).unwrap());
    }
    let mut again = Service::default();
    for record in &records {
        again.replay(serde_json::from_str(record).unwrap()).unwrap();
    }
    assert_eq!(again.revision(), Some(5));
    assert_eq!(plan_text(&mut again), plan_text(&mut service));

    // And on with it: a copy that was replayed plans on as the original does.
    let on = change(5, 7.0, &json!([{"late": {"drone": "third", "by_s": 0.7}}]));
    assert_eq!(
        tell(&mut again, &on).answer.result,
        tell(&mut service, &on).answer.result
    );
}

#[test]
fn a_plan_that_is_handed_in_is_verified() {
    let mut service = opened();
    let told = tell(&mut service, &json!({"method": "plan"})).answer;
    let mut whole = serde_json::to_value(told.result.unwrap()).unwrap();
    let plan = whole["plan"].take();
    tell(&mut service, &json!({"method": "close"}));
    let mut broken = plan.clone();
    // Both fly along the same line, the other way round.
    broken["drones"][1]["trajectory"]["position_m"] = json!([[20.5, 2.5, 1.5], [2.5, 2.5, 1.5]]);
    broken["drones"][1]["trajectory"]["t_s"] = json!([0.0, 9.0]);
    broken["drones"][1]["trajectory"]["mass_kg"] = json!([]);
    let open = |plan: Value| json!({"method": "open", "params": {"scenario": PAIR, "plan": plan}});
    let refused = tell(&mut service, &open(broken)).answer.error.unwrap();
    assert_eq!(refused.code, Code::NotVerified, "{refused:?}");
    let taken = tell(&mut service, &open(plan)).answer;
    assert_eq!(taken.error, None);
}

/// All that is wrong with a plan and a scenario that are handed in.
fn wrong_with(scenario: &str, plan: &Value) -> Vec<(Code, String)> {
    let params = json!({"scenario": scenario, "plan": plan});
    let open = json!({"method": "open", "params": params});
    let error = tell(&mut Service::default(), &open).answer.error;
    let also = error.iter().flat_map(|it| &it.also);
    let all = error.iter().chain(also);
    all.map(|it| (it.code, it.message.clone())).collect()
}

#[test]
fn a_plan_of_another_scenario_is_refused_with_all_that_it_does_not_answer() {
    let mut service = opened();
    let told = tell(&mut service, &json!({"method": "plan"})).answer;
    let plan = serde_json::to_value(told.result.unwrap()).unwrap()["plan"].take();
    assert_eq!(wrong_with(PAIR, &plan), []);
    let shelf = r#"obstacles: [(name: "shelf", min_m: (9, 1, 0), max_m: (11, 4, 3))], drones: ["#;
    let other = PAIR.replace("drones: [", shelf);
    let other = other.replace("to_m: (2.5, 8.5, 1.5)", "to_m: (2.5, 6.5, 1.5)");
    let wrong = wrong_with(&other, &plan);
    assert!(wrong.iter().all(|(code, _)| *code == Code::Plan));
    let [what, shelf, goal] = &wrong[..] else {
        panic!("{wrong:?}")
    };
    assert!(
        what.1
            .contains("none of this scenario, or was changed in flight")
    );
    assert!(shelf.1.contains("obstacle `shelf` is not in the plan"));
    assert!(
        goal.1
            .starts_with("`right`: task 1 at (2.50, 6.50, 1.50) is not reached")
    );
}

#[test]
fn a_plan_that_was_changed_in_flight_is_taken_over_with_a_scenario_that_says_what_is_flown() {
    let mut service = opened();
    let tasks = json!([{"to_m": [12.5, 5.5, 3.0]}]);
    let retask = json!({"retask": {"drone": "right", "tasks": tasks}});
    let requests = [
        change(1, 3.0, &json!([third(), retask])),
        // By then what was flown at first is dropped.
        change(
            2,
            90.0,
            &json!([{"retask": {"drone": "left", "tasks": [{"to_m": [19.5, 2.5, 1.5]}]}}]),
        ),
        change(
            3,
            120.0,
            &json!([
                {"retask": {"drone": "left", "tasks": [{"to_m": [18.5, 2.5, 1.5]}]}},
                {"fail": {"drone": "third"}},
            ]),
        ),
    ];
    for request in &requests {
        assert_eq!(tell(&mut service, request).answer.error, None);
    }
    let told = tell(&mut service, &json!({"method": "plan"})).answer;
    let plan = serde_json::to_value(told.result.unwrap()).unwrap()["plan"].take();
    assert!(plan["drones"][0]["enters_s"].as_f64() > Some(0.0));
    assert!(wrong_with(PAIR, &plan).len() > 1);
    // Where each is known first, and what it still does from there on.
    let said: Vec<String> = flown(&service)
        .drones
        .iter()
        .map(|it| {
            let places_m = &it.trajectory.position_m;
            let (first, last) = (places_m[0], places_m[places_m.len() - 1]);
            let tasks = match it.at_end {
                AtEnd::Hover => format!("(to_m: ({:?}, {:?}, {:?}))", last.x, last.y, last.z),
                AtEnd::Land | AtEnd::Leave => String::new(),
            };
            format!(
                "(name: \"{}\", airframe: \"kolibri\", start_m: ({:?}, {:?}, {:?}), tasks: [{tasks}],
                  at_start: {:?}, at_end: {:?})",
                it.name, first.x, first.y, first.z, it.at_start, it.at_end
            )
        })
        .collect();
    let bounds = "bounds_m: (min: (0, 0, 0), max: (24, 12, 4))";
    let scenario = format!(
        "Scenario(name: \"pair\", {bounds}, drones: [{}])",
        said.join(", ")
    );
    assert_eq!(wrong_with(&scenario, &plan), []);
}

#[test]
fn a_change_days_after_the_last_one_is_replayed_without_the_positions_in_between() {
    let mut service = opened();
    let whole = tell(&mut service, &json!({"method": "plan"})).answer;
    let plan = serde_json::to_value(whole.result.unwrap()).unwrap()["plan"].take();
    for at_s in [80_000.0, 160_000.0] {
        let told = tell(&mut service, &state(at_s, "left", [20.5, 2.5, 1.5]));
        assert_eq!((told.answer.error, told.record), (None, None));
    }
    let back = json!([{"retask": {"drone": "left", "tasks": [{"to_m": [2.5, 2.5, 1.5]}]}}]);
    let told = tell(&mut service, &change(1, 160_001.0, &back));
    assert_eq!(told.answer.error, None);
    let mut again = Service::default();
    let scenario = PAIR.to_owned();
    again.replay(Record::Opened { scenario, plan }).unwrap();
    again.replay(told.record.unwrap()).unwrap();
    assert_eq!(plan_text(&mut again), plan_text(&mut service));
}

/// Two that fly, one below them that is yet to take off.
const THREE: &str = r#"Scenario(
  name: "three",
  bounds_m: (min: (0, 0, 0), max: (24, 12, 4)),
  drones: [
    (name: "left", airframe: "kolibri", start_m: (2.5, 2.5, 1.5), tasks: [(to_m: (20.5, 2.5, 1.5))]),
    (name: "right", airframe: "kolibri", start_m: (20.5, 8.5, 1.5), tasks: [(to_m: (2.5, 8.5, 1.5), dwell_s: 60)]),
    (name: "parked", airframe: "kolibri", start_m: (2.5, 2.5, 0.1), at_start: Landed, tasks: [(to_m: (4.5, 6.5, 1.5))]),
  ],
)
"#;

fn open(scenario: &str) -> Service {
    let mut service = Service::default();
    let open = json!({"method": "open", "params": {"scenario": scenario}});
    let told = tell(&mut service, &open);
    assert_eq!(told.answer.error, None);
    service
}

fn land_all(service: &mut Service, at_s: f64) -> Handled {
    let params = json!({"at_s": at_s});
    tell(service, &json!({"method": "land_all", "params": params}))
}

#[test]
fn all_that_fly_land_soon_and_near_in_one_patch_and_those_on_the_ground_stay_there() {
    let mut service = open(THREE);
    let opened_records = {
        let mut again = Service::default();
        let open = json!({"method": "open", "params": {"scenario": THREE}});
        tell(&mut again, &open).record.unwrap()
    };
    let at_s = 0.2;
    let before: Vec<[f64; 3]> = ["left", "right"]
        .map(|it| planned_m(&service, it, at_s))
        .to_vec();
    let parked = service.flown.as_ref().unwrap().running.plan().drones[2].clone();
    assert!(parked.airborne_s.0 > at_s, "{:?}", parked.airborne_s);
    let told = land_all(&mut service, at_s);
    let Some(Told::Landing(landing)) = told.answer.result else {
        panic!("{:?}", told.answer.error);
    };
    assert_eq!((landing.revision, landing.patch.revision), (2, 2));
    assert_eq!(landing.not_landing, Vec::<String>::new());
    let plan = service.flown.as_ref().unwrap().running.plan().clone();
    assert_eq!(planner::verify(&plan).violations, []);
    for (entry, from_m) in plan.drones.iter().zip(before) {
        assert_eq!(entry.at_end, planner::plan::AtEnd::Land);
        let until_s = entry.airborne_s.1.unwrap();
        assert!(until_s < 12.0, "{}: {until_s}", entry.name);
        let down_m = entry.trajectory.position_m.last().unwrap();
        assert!(down_m.z < 0.5, "{down_m}");
        let from_m = nalgebra::Point3::from(from_m);
        assert!((down_m.xy() - from_m.xy()).norm() < 4.0, "{down_m}");
    }

    let stays = &plan.drones[2];
    assert_eq!(stays.airborne_s, (0.0, Some(0.0)));
    let there_m = stays.trajectory.position_m.last();
    assert_eq!(there_m, parked.trajectory.position_m.first());

    // What the journal keeps gives the same plan, and no drone is left to land: nothing changes.
    let mut replayed = Service::default();
    replayed.replay(opened_records).unwrap();
    let patch = replayed.replay(told.record.unwrap()).unwrap();
    assert_eq!(patch, Some(landing.patch));
    assert_eq!(plan_text(&mut replayed), plan_text(&mut service));
    let again = land_all(&mut service, 100.0);
    assert!(again.record.is_none());
    let Some(Told::Landing(again)) = again.answer.result else {
        panic!("no landing: {:?}", again.answer.error);
    };
    assert_eq!(
        (again.patch.changed.len(), again.revision),
        (0, landing.revision)
    );
}

#[test]
fn a_drone_that_has_landed_flies_again_and_has_met_no_air_on_the_ground() {
    // One lands on a rack, or on the floor; the other passes above while it stands there.
    for (rack, to_m) in [("", "(10.5, 5.5, 1.5)"), (RACK, "(10.5, 5.5, 2.5)")] {
        let scenario = format!(
            r#"Scenario(name: "pad", bounds_m: (min: (0, 0, 0), max: (24, 10, 5)), {rack}
                drones: [
                    (name: "a", airframe: "kolibri", start_m: (8.5, 5.5, 2.5), at_end: Land,
                        tasks: [(to_m: {to_m})]),
                    (name: "b", airframe: "offboard-2", start_m: (2.5, 5.5, 3.5),
                        tasks: [(to_m: (2.5, 5.5, 3.5), dwell_s: 12), (to_m: (20.5, 5.5, 3.5))]),
                ])"#
        );
        let mut service = open(&scenario);
        let retask = json!({"retask": {"drone": "a", "tasks": [{"to_m": [10.5, 2.5, 2.5]}]}});
        let params = json!({"revision": 1, "at_s": 25.0, "changes": [retask]});
        let told = tell(&mut service, &json!({"method": "change", "params": params}));
        assert_eq!(told.answer.error, None);
        let plan = service.flown.as_ref().unwrap().running.plan().clone();
        assert_eq!(planner::verify(&plan).violations, []);
        let a = &plan.drones[0];
        let [(lands_s, rises_s)] = a.landed_s[..] else {
            panic!("{:?}", a.landed_s);
        };
        assert!(lands_s < 10.0 && rises_s >= 25.0, "{:?}", a.landed_s);
        // As if it had hovered there, the air of the other would have been too much.
        let mut hovers = plan.clone();
        hovers.drones[0].landed_s.clear();
        let found = planner::verify(&hovers).violations;
        assert!(found.iter().any(|it| it.drone == "a"), "{found:?}");
        // Taken over from what was answered, it is the same plan.
        let params = json!({"scenario": scenario, "plan": plan});
        let taken = tell(
            &mut Service::default(),
            &json!({"method": "open", "params": params}),
        );
        assert_eq!(taken.answer.error, None);
    }
}

#[test]
fn a_drone_on_the_ground_waits_until_another_has_passed_above() {
    let scenario = r#"Scenario(name: "pad", bounds_m: (min: (0, 0, 0), max: (24, 10, 5)), drones: [
        (name: "a", airframe: "kolibri", start_m: (8.5, 5.5, 1.5), at_end: Land,
            tasks: [(to_m: (10.5, 5.5, 1.5))]),
        (name: "b", airframe: "offboard-2", start_m: (2.5, 5.5, 3.5),
            tasks: [(to_m: (2.5, 5.5, 3.5), dwell_s: 12), (to_m: (20.5, 5.5, 3.5))]),
    ])"#;
    // It comes over the pad at 17 s.
    for at_s in [16.0, 16.5, 17.0, 17.5, 18.0] {
        let mut service = open(scenario);
        let retask = json!({"retask": {"drone": "a", "tasks": [{"to_m": [10.5, 2.5, 1.5]}]}});
        let params = json!({"revision": 1, "at_s": at_s, "changes": [retask]});
        let told = tell(&mut service, &json!({"method": "change", "params": params}));
        let Some(Told::Patch(patch)) = told.answer.result else {
            panic!("{at_s}: {:?}", told.answer.error);
        };
        assert!(patch.refused.is_empty(), "{at_s}: {:?}", patch.refused);
        let plan = service.flown.as_ref().unwrap().running.plan();
        assert_eq!(planner::verify(plan).violations, [], "{at_s}");
        let arrives_s = plan.drones[0].arrives_s;
        assert!(arrives_s < 26.0, "{at_s}: {arrives_s}");
    }
}

/// A rack below what lands on it.
const RACK: &str = r#"obstacles: [(name: "rack", min_m: (9.5, 3, 0), max_m: (11.5, 8, 1))],"#;

#[test]
fn those_that_land_already_are_left_as_they_are_however_often_it_is_asked() {
    let mut service = open(THREE);
    let first = land_all(&mut service, 0.2);
    assert!(first.record.is_some());
    let plan = plan_text(&mut service);
    let down_s = {
        let drones = &service.flown.as_ref().unwrap().running.plan().drones;
        drones
            .iter()
            .filter_map(|it| it.airborne_s.1)
            .fold(0.0, f64::max)
    };
    let mut at_s = 0.2;
    while at_s < down_s {
        let again = land_all(&mut service, at_s);
        assert_eq!(again.record, None, "{at_s}");
        let Some(Told::Landing(landing)) = again.answer.result else {
            panic!("{at_s}: {:?}", again.answer.error);
        };
        assert_eq!((landing.revision, landing.patch.revision), (2, 2), "{at_s}");
        assert!(landing.patch.changed.is_empty() && landing.not_landing.is_empty());
        assert_eq!(plan_text(&mut service), plan, "{at_s}");
        let back = tell(&mut service, &state(at_s - 0.1, "left", [2.5, 2.5, 1.5]));
        assert_eq!(back.answer.error.unwrap().code, Code::ClockBack, "{at_s}");
        at_s += 0.7;
    }
}

#[test]
fn one_that_has_no_place_to_land_is_named_and_goes_on() {
    // On the floor there is room for the two drones that stand there.
    let mut service = open(
        r#"Scenario(
  name: "shaft",
  bounds_m: (min: (0, 0, 0), max: (2, 1, 6)),
  drones: [
    (name: "one", airframe: "kolibri", start_m: (0.5, 0.5, 0.1), at_start: Landed, at_end: Land),
    (name: "two", airframe: "kolibri", start_m: (1.5, 0.5, 0.1), at_start: Landed, at_end: Land),
    (name: "over", airframe: "kolibri", start_m: (0.5, 0.5, 4.5), tasks: [(to_m: (1.5, 0.5, 4.5))]),
  ],
)
"#,
    );
    let before = plan_text(&mut service);
    let told = land_all(&mut service, 0.5);
    let error = told.answer.error.unwrap();
    assert_eq!(error.code, Code::Change);
    assert_eq!(error.message, "there is no place to land for over");
    assert_eq!((told.record, plan_text(&mut service)), (None, before));
}

#[test]
fn a_flying_drone_lands_where_it_is_sent() {
    let mut service = open(THREE);
    let land = |place: Value| json!([{"land": place}]);
    let nowhere = land(json!({"drone": "left"}));
    let told = tell(&mut service, &change(1, 2.0, &nowhere));
    let error = told.answer.error.unwrap();
    assert_eq!(
        (error.code, &error.place[..]),
        (Code::Change, "params.changes[0].land.over_m")
    );
    let somewhere = land(json!({"drone": "left", "over_m": [10.5, 4.5, 1.5]}));
    let told = tell(&mut service, &change(1, 2.0, &somewhere));
    assert_eq!(told.answer.error, None);
    let [x, y, z] = planned_m(&service, "left", 60.0);
    assert!((x - 10.5).abs() < 1e-9 && (y - 4.5).abs() < 1e-9 && z < 0.5);
}

#[test]
fn a_drone_that_fails_lies_where_it_came_down_until_it_is_removed() {
    let mut service = opened();
    let fail = json!([{"fail": {"drone": "left", "lies_m": [6.5, 3.0, 0.1]}}]);
    let told = tell(&mut service, &change(1, 3.0, &fail));
    let patch = told
        .answer
        .patch()
        .unwrap_or_else(|| panic!("{:?}", told.answer))
        .clone();
    let names: Vec<&str> = patch.changed.iter().map(|it| &it.drone[..]).collect();
    assert_eq!(names, ["left", "left (wreck)"]);
    assert_eq!(
        patch.changed[1].trajectory.position_m,
        [[6.5, 3.0, 0.1].into()]
    );
    // What lies there does nothing more.
    let late = json!([{"late": {"drone": "left (wreck)", "by_s": 1}}]);
    let told = tell(&mut service, &change(2, 4.0, &late));
    assert_eq!(told.answer.error.unwrap().code, Code::Change);
    let told = tell(
        &mut service,
        &json!({"method": "land_all", "params": {"at_s": 4.0}}),
    );
    let told = told.answer.patch().expect("the other lands").clone();
    assert!(told.changed.iter().all(|it| it.drone == "right"));
    let remove = json!([{"remove": {"drone": "left (wreck)"}}]);
    let told = tell(&mut service, &change(3, 5.0, &remove));
    assert_eq!(told.answer.error, None);
}

#[test]
fn a_plan_that_is_flown_for_long_stays_small_and_replays_to_the_same_bytes() {
    let mut service = opened();
    let mut records = Vec::new();
    let open = json!({"method": "open", "params": {"scenario": PAIR}});
    records.extend(tell(&mut Service::default(), &open).record);
    let mut sizes = Vec::new();
    for round in 0..40_u32 {
        let x_m = if round % 2 == 0 { 4.5 } else { 18.5 };
        let tasks = json!([{"to_m": [x_m, 2.5, 1.5]}, {"to_m": [x_m, 4.5, 2.5]}]);
        let comes = json!({
            "drone": format!("guest {round}"), "like": "right", "start_m": [12.5, 10.5, 1.5],
            "tasks": [{"to_m": [12.5, 9.5, 1.5]}], "at_end": "leave",
        });
        let changes = json!([{"retask": {"drone": "left", "tasks": tasks}}, {"add": comes}]);
        let at_s = 25.0 * f64::from(round + 1);
        let told = tell(&mut service, &change(u64::from(round) + 1, at_s, &changes));
        assert_eq!(told.answer.error, None, "round {round}");
        records.extend(told.record);
        sizes.push(plan_text(&mut service).len());
        // What it says of now is what it said before.
        let [x, y, z] = planned_m(&service, "left", at_s);
        let seen = tell(&mut service, &state(at_s, "left", [x, y, z]))
            .answer
            .result;
        let Some(Told::Seen(seen)) = seen else {
            panic!("{seen:?}")
        };
        assert_eq!((seen.patch, seen.off_path), (None, Vec::new()));
    }
    let (early, late) = (sizes[8..20].iter().max(), sizes[28..].iter().max());
    // But for the digits of later times.
    let (early, late) = (early.unwrap() / 10, late.unwrap() / 11);
    assert!(late <= early, "{sizes:?}");
    let mut again = Service::default();
    for record in records {
        again.replay(record).unwrap();
    }
    assert_eq!(plan_text(&mut again), plan_text(&mut service));
}

/// The plan of a service now, and what the verifier finds of it.
fn flown(service: &Service) -> planner::Plan {
    let plan = service.flown.as_ref().unwrap().running.plan().clone();
    assert_eq!(planner::verify(&plan).violations, []);
    plan
}

#[test]
fn a_drone_that_is_sent_below_one_that_dwells_comes_there_once_that_is_gone() {
    let mut service = open(
        r#"Scenario(
  name: "yard",
  bounds_m: (min: (0, 0, 0), max: (24, 12, 4)),
  drones: [
    (name: "above", airframe: "kolibri", start_m: (12.5, 6.5, 3.5),
      tasks: [(to_m: (12.5, 6.5, 3.5), dwell_s: 60), (to_m: (2.5, 6.5, 3.5))]),
    (name: "below", airframe: "kolibri", start_m: (12.5, 9.5, 1.5)),
  ],
)
"#,
    );
    let tasks = json!([{"to_m": [12.5, 6.5, 1.5]}, {"to_m": [12.5, 3.5, 1.5]}]);
    let retask = json!([{"retask": {"drone": "below", "tasks": tasks}}]);
    let told = tell(&mut service, &change(1, 10.0, &retask));
    let patch = told.answer.patch().expect("it waits").clone();
    assert_eq!((patch.unavoidable, patch.refused), (vec![], vec![]));
    assert!(flown(&service).drones[1].arrives_s > 60.0);
}

#[test]
fn a_drone_that_was_taken_out_or_has_failed_is_not_flown_again_while_it_stops() {
    for gone in ["fail", "remove"] {
        let mut service = opened();
        let out = json!([{gone: {"drone": "left"}}]);
        assert_eq!(tell(&mut service, &change(1, 4.0, &out)).answer.error, None);
        let [x, y, z] = planned_m(&service, "left", 4.3);
        let seen = tell(&mut service, &state(4.3, "left", [x - 1.0, y, z]));
        assert_eq!((seen.answer.error, seen.record), (None, None));
        let told = land_all(&mut service, 4.3);
        let patch = told.answer.patch().expect("the other lands").clone();
        assert!(patch.changed.iter().all(|it| it.drone == "right"));
        let retask = json!([{"retask": {"drone": "left", "tasks": [{"to_m": [10.5, 5.5, 2.5]}]}}]);
        let error = tell(&mut service, &change(3, 4.4, &retask)).answer.error;
        assert_eq!(
            error.unwrap().message,
            "`left` is not there any more, or not yet"
        );
    }
}

/// One that comes at 3 s, and lands where it comes.
fn third() -> Value {
    json!({"add": {
        "drone": "third", "like": "left", "start_m": [12.5, 6.5, 1.5],
        "tasks": [{"to_m": [12.5, 6.5, 1.5]}], "at_end": "land",
    }})
}

#[test]
fn a_drone_that_has_landed_stays_where_it_is_sent_to_land() {
    let mut service = opened();
    tell(&mut service, &change(1, 3.0, &json!([third()])));
    let before = flown(&service).drones[2].clone();
    let land = json!([{"land": {"drone": "third"}}]);
    let told = tell(&mut service, &change(2, 12.0, &land));
    assert_eq!(told.answer.patch().expect("it stays").unavoidable, []);
    let told = land_all(&mut service, 14.0);
    let patch = told.answer.patch().expect("the others land").clone();
    assert!(patch.changed.iter().all(|it| it.drone != "third"));
    let after = flown(&service).drones[2].clone();
    let told = |it: &planner::plan::DronePlan| (it.at_end, it.airborne_s, it.arrives_s);
    assert_eq!(told(&after), told(&before));
}

#[test]
fn a_drone_that_waits_on_the_ground_to_fly_again_stands_there() {
    let text = PAIR.replace(
        "(24, 12, 4)),",
        "(24, 12, 4)), planning: (motion: Straight),",
    );
    let mut service = open(&text);
    tell(&mut service, &change(1, 3.0, &json!([third()])));
    let over = json!([{"to_m": [12.5, 6.5, 3.5], "dwell_s": 30}, {"to_m": [20.5, 2.5, 1.5]}]);
    let over = json!([{"retask": {"drone": "left", "tasks": over}}]);
    tell(&mut service, &change(2, 12.0, &over));
    let up = json!([{"retask": {"drone": "third", "tasks": [{"to_m": [12.5, 9.5, 1.5]}]}}]);
    tell(&mut service, &change(3, 28.0, &up));
    assert!(planned_m(&service, "third", 40.0)[2] < 0.5, "it waits");
    let told = land_all(&mut service, 30.0);
    let Some(Told::Landing(landing)) = told.answer.result else {
        panic!("{:?}", told.answer.error);
    };
    assert_eq!(landing.not_landing, Vec::<String>::new());
    let third = flown(&service).drones[2].clone();
    let there_m = planned_m(&service, "third", 20.0);
    assert_eq!(planned_m(&service, "third", 90.0), there_m);
    assert!(third.airborne_s.1.unwrap() < 12.0, "{:?}", third.airborne_s);
}

#[test]
fn a_drone_that_is_about_to_take_off_lands_as_one_that_flies() {
    let landed = PAIR.replace("(name: \"left\",", "(name: \"left\", at_end: Land,");
    for later_s in [0.1, 0.3, 0.44] {
        let mut service = open(&landed);
        let up = json!([{"retask": {"drone": "left", "tasks": [{"to_m": [20.5, 5.5, 2.5]}]}}]);
        tell(&mut service, &change(1, 40.0, &up));
        let land = json!([{"land": {"drone": "left"}}]);
        let told = tell(&mut service, &change(2, 40.0 + later_s, &land));
        let error = told.answer.error.expect("it has begun to rise");
        assert!(error.message.contains("say over which place"), "{error:?}");
        let told = land_all(&mut service, 40.0 + later_s);
        let Some(Told::Landing(landing)) = told.answer.result else {
            panic!("{:?}", told.answer.error);
        };
        assert_eq!(
            (landing.not_landing, landing.patch.unavoidable),
            (vec![], vec![])
        );
        let left = flown(&service).drones[0].clone();
        assert!(left.airborne_s.1.is_some(), "{:?}", left.airborne_s);
        assert!(planned_m(&service, "left", 90.0)[2] < 0.2);
    }
}

#[test]
fn a_drone_that_took_off_and_has_hovered_for_longer_than_history_is_kept_descends() {
    for motion in ["Straight", "Smooth"] {
        let text = PAIR.replace(
            "start_m: (2.5, 2.5, 1.5), tasks: [(to_m: (20.5, 2.5, 1.5))]",
            "start_m: (2.5, 2.5, 0.1), at_start: Landed, tasks: [(to_m: (2.5, 2.5, 1.5))]",
        );
        let rules = format!("(24, 12, 4)), planning: (motion: {motion}),");
        let mut service = open(&text.replace("(24, 12, 4)),", &rules));
        let late = json!([{"retask": {"drone": "right", "tasks": [{"to_m": [4.5, 8.5, 1.5]}]}}]);
        tell(&mut service, &change(1, 100.0, &late));
        assert!(flown(&service).drones[0].enters_s.is_some(), "{motion}");
        assert!(land_all(&mut service, 110.0).record.is_some(), "{motion}");
        let left = flown(&service).drones[0].clone();
        let down_s = left.airborne_s.1.unwrap();
        assert!(down_s > 110.5, "{motion}: {down_s}");
        assert!(planned_m(&service, "left", 110.1)[2] > 1.3, "{motion}");
    }
}

#[test]
fn a_zone_that_keeps_bodies_out_is_kept_clear_of_in_flight_as_an_obstacle_is() {
    let text = r#"Scenario(
  name: "desk",
  bounds_m: (min: (0, 0, 0), max: (24, 12, 4)),
  zones: [
    (name: "desk", min_m: (4, 0, 0), max_m: (8, 5, 1), keep_out: true),
    (name: "net", min_m: (15.9, 0, 0), max_m: (16.1, 12, 2.5), keep_out: true),
  ],
  drones: [(name: "left", airframe: "kolibri", start_m: (1.5, 2.5, 3), tasks: [(to_m: (12.5, 2.5, 3))])],
  planning: (motion: Straight),
)"#;
    let mut service = open(text);
    let mut times_s = (0..100).map(|tick| 0.1 * f64::from(tick));
    let over_s = times_s.find(|at_s| planned_m(&service, "left", *at_s)[0] > 5.0);
    let over_s = over_s.expect("it flies over the desk");
    let goal = json!([6, 2.5, 0.5]);
    let comes = json!({"drone": "third", "like": "left", "start_m": [12.5, 9.5, 3],
        "tasks": [{"to_m": [6, 2.5, 3]}], "at_end": "land"});
    for (asked, words) in [
        (
            json!({"land": {"drone": "left", "over_m": [6, 2.5, 3]}}),
            "zone `desk`",
        ),
        (
            json!({"retask": {"drone": "left", "tasks": [{"to_m": goal}]}}),
            "zone `desk`",
        ),
        (json!({"add": comes}), "zone `desk`"),
    ] {
        let told = tell(&mut service, &change(1, 0.5, &json!([asked])));
        let error = told.answer.error.expect("it keeps bodies out");
        let told = (error.code, &error.place[..]);
        assert_eq!(told, (Code::Change, "params.changes[0]"), "{error:?}");
        assert!(error.message.contains(words), "{error:?}");
    }
    let behind = json!([{"retask": {"drone": "left", "tasks": [{"to_m": [16.4, 5.7, 1]}]}}]);
    let told = tell(&mut service.clone(), &change(1, 0.5, &behind)).answer;
    assert_eq!(told.patch().expect("over the net").refused, []);

    let told = land_all(&mut service, over_s);
    let Some(Told::Landing(landing)) = told.answer.result else {
        panic!("{:?}", told.answer.error);
    };
    assert_eq!(landing.not_landing, Vec::<String>::new());
    assert!(flown(&service).drones[0].airborne_s.1.is_some());
}

#[test]
fn a_drone_that_stops_for_want_of_a_path_and_is_late_is_set_back_and_one_that_is_there_is_none() {
    for motion in ["Straight", "Smooth"] {
        let rules = format!("(24, 12, 4)), planning: (motion: {motion}),");
        let low = PAIR.replace("(20.5, 2.5, 1.5)", "(20.5, 2.5, 0.3)");
        let mut service = open(&low.replace("(24, 12, 4)),", &rules));
        let fail = json!([{"fail": {"drone": "right", "lies_m": [20.5, 2.5, 0.1]}}]);
        let told = tell(&mut service, &change(1, 3.0, &fail));
        assert_eq!(told.answer.patch().unwrap().refused[0].name, "left");
        let mut revision = 2;
        for at_s in [3.5, 4.0, 4.5, 7.0] {
            let was_m = planned_m(&service, "left", at_s - 1.0);
            let rests = was_m == planned_m(&service, "left", at_s);
            let told = tell(&mut service, &state(at_s, "left", was_m));
            let Some(Told::Seen(seen)) = told.answer.result else {
                panic!("{motion} at {at_s}: {:?}", told.answer.error);
            };
            let late = seen.patch.map_or(0, |it| it.changed.len());
            assert_eq!((late, seen.off_path), (usize::from(!rests), vec![]));
            assert_eq!(told.record.is_some(), !rests, "{motion} at {at_s}");
            revision += u64::from(!rests);
            assert_eq!(seen.revision, revision, "{motion} at {at_s}");
            flown(&service);
        }
        let late = json!([{"late": {"drone": "left", "by_s": 1}}]);
        let told = tell(&mut service, &change(revision, 60.0, &late));
        assert_eq!(
            (told.answer.patch().unwrap().revision, told.record),
            (revision, None)
        );
    }
}

#[test]
fn a_drone_under_the_name_of_one_that_has_failed_before_may_fail() {
    let mut service = opened();
    let fail = json!({"fail": {"drone": "left"}});
    let comes = json!({"add": {"drone": "left", "like": "right", "start_m": [10.5, 10.5, 1.5],
        "tasks": [{"to_m": [20.5, 10.5, 1.5]}]}});
    let away = json!({"retask": {"drone": "right", "tasks": [{"to_m": [2.5, 5.5, 1.5]}]}});
    let mut patched = |revision, at_s, changes| {
        let told = tell(&mut service, &change(revision, at_s, &changes));
        let patch = told.answer.patch().cloned();
        let patch = patch.unwrap_or_else(|| panic!("{:?}", told.answer.error));
        let names = patch.changed.into_iter().map(|it| it.drone);
        names.collect::<Vec<_>>()
    };
    let names = patched(1, 1.0, json!([fail]));
    assert_eq!(names, ["left", "left (wreck)"]);
    patched(2, 70.0, json!([away]));
    assert_eq!(patched(3, 86.0, json!([comes])), ["left"]);
    let clears = json!({"remove": {"drone": "left (wreck)"}});
    let names = patched(4, 88.0, json!([clears, fail]));
    assert_eq!(names, ["left (wreck)", "left", "left (wreck 2)"]);
    let clears = json!([{"remove": {"drone": "left (wreck 2)"}}]);
    assert_eq!(patched(5, 90.0, clears), ["left (wreck 2)"]);
    flown(&service);
}

#[test]
fn keys_that_are_given_twice_are_reported_all_at_their_places_and_none_of_them_counts() {
    let mut service = opened();
    let before = plan_text(&mut service);
    let line = r#"{"method": "change", "params": {"revision": 7, "revision": 1, "at_s": 2, "changes":
        [{"late": {"drone": "left", "by_s": 1}, "late": {"drone": "right", "by_s": 9, "by_s": 1}}]}}"#;
    let error = service.handle(line, &|| 0.0).answer.error.unwrap();
    assert_eq!(
        (error.code, error.message),
        (Code::Field, "`revision` is given twice".to_owned())
    );
    let also = error.also.iter().map(|it| &it.place[..]);
    let also: Vec<&str> = also.collect();
    assert_eq!(error.place, "params.revision");
    assert_eq!(
        also,
        ["params.changes[0].late", "params.changes[0].late.by_s"]
    );
    assert_eq!(plan_text(&mut service), before);
    let line = r#"{"method": "state", "params": {"at_s": 1, "drones":
        {"d1.5": 1, "d1.5": 2, "d1.5": 3}}}"#;
    let error = service.handle(line, &|| 0.0).answer.error.unwrap();
    assert_eq!(
        (&error.message[..], &error.place[..], error.also),
        ("`d1.5` is given twice", "params.drones.d1.5", vec![])
    );
}

#[test]
fn a_landing_that_the_verifier_does_not_let_pass_is_looked_for_elsewhere() {
    let closed = |zones: &str| {
        let rules = format!("(24, 12, 4)), planning: (motion: Straight), zones: [{zones}],");
        PAIR.replace("(24, 12, 4)),", &rules)
    };
    let net = r#"(name: "net", min_m: (6.4, 2.4, 0), max_m: (6.6, 2.6, 1), keep_out: true)"#;
    let mut service = open(&closed(net));
    // What plans knows of no zone.
    let world = planner::read_world(&closed("")).unwrap();
    let flown = service.flown.as_mut().unwrap();
    flown.running = planner::Running::new(world, flown.running.plan().clone()).unwrap();
    let over = |at_s: &f64| (planned_m(&service, "left", *at_s + 0.5)[0] - 6.5).abs() < 0.3;
    let mut times_s = (0..100).map(|tick| 0.1 * f64::from(tick));
    let at_s = times_s.find(over).expect("it flies over the net");
    let told = land_all(&mut service, at_s);
    let Some(Told::Landing(landing)) = told.answer.result else {
        panic!("{:?}", told.answer.error);
    };
    assert_eq!(landing.not_landing, Vec::<String>::new());
    let down_m = planned_m(&service, "left", 90.0);
    assert!(
        down_m[2] < 0.2 && (down_m[0] - 6.5).abs() > 0.3,
        "{down_m:?}"
    );
}

/// A pair of which one leaves.
fn leaving() -> Service {
    open(&PAIR.replace("(name: \"left\",", "(name: \"left\", at_end: Leave,"))
}

#[test]
fn a_drone_that_leaves_before_it_could_do_anything_else_is_not_there_any_more() {
    let mut service = leaving();
    let leaves_s = flown(&service).drones[0].arrives_s;
    let land = json!({"drone": "left", "over_m": [20.5, 5.5, 1.5]});
    let retask = json!({"drone": "left", "tasks": [{"to_m": [10.5, 5.5, 2.5]}]});
    for changes in [json!([{"land": land}]), json!([{"retask": retask}])] {
        let told = tell(&mut service, &change(1, leaves_s - 0.2, &changes));
        let error = told.answer.error.expect("it is gone");
        assert_eq!(error.message, "`left` is not there any more, or not yet");
    }
}

#[test]
fn positions_of_a_drone_that_has_left_are_passed_over_however_long_ago() {
    let mut service = leaving();
    let leaves_s = flown(&service).drones[0].arrives_s;
    let late = json!([{"late": {"drone": "right", "by_s": 1}}]);
    tell(&mut service, &change(1, 3.0, &late));
    let back = json!([{"retask": {"drone": "right", "tasks": [{"to_m": [20.5, 8.5, 1.5]}]}}]);
    tell(&mut service, &change(2, 200.0, &back));
    let drones = &service.flown.as_ref().unwrap().running.plan().drones;
    assert!(drones.iter().all(|it| it.name != "left"), "it is dropped");
    let seen = tell(&mut service, &state(200.0, "left", [20.5, 2.5, 1.5]));
    assert_eq!(seen.answer.error, None);
    // Where it was is not where another of that name comes.
    let again = json!([{"add": {
        "drone": "left", "like": "right", "start_m": [2.5, 2.5, 1.5], "tasks": [],
    }}]);
    assert_eq!(
        tell(&mut service, &change(3, 201.0, &again)).answer.error,
        None
    );
    let seen = tell(&mut service, &state(201.2, "left", [2.5, 2.5, 1.5]));
    assert_eq!(seen.answer.error, None);
    let mut service = leaving();
    let seen = tell(&mut service, &state(leaves_s, "left", [18.5, 2.5, 1.5]));
    assert_eq!((seen.answer.error, seen.record), (None, None));
}

#[test]
fn after_a_replay_the_first_time_sent_may_be_long_after_the_last_change() {
    let mut service = opened();
    let late = json!([{"late": {"drone": "left", "by_s": 1}}]);
    let told = tell(&mut service, &change(1, 4.0, &late));
    let open = json!({"method": "open", "params": {"scenario": PAIR}});
    let mut again = Service::default();
    for record in [tell(&mut Service::default(), &open).record, told.record] {
        again.replay(record.unwrap()).unwrap();
    }
    let seen = tell(&mut again, &state(172_000.0, "left", [20.5, 2.5, 1.5]));
    assert_eq!(seen.answer.error, None);
    let seen = tell(&mut again, &state(900_000.0, "left", [20.5, 2.5, 1.5]));
    assert_eq!(seen.answer.error.unwrap().code, Code::Time);
    let mut unchanged = Service::default();
    let opened = tell(&mut Service::default(), &open).record.unwrap();
    unchanged.replay(opened).unwrap();
    let seen = tell(&mut unchanged, &state(172_000.0, "left", [20.5, 2.5, 1.5]));
    assert_eq!(seen.answer.error, None);
}

#[test]
fn a_drone_beside_a_zone_goes_on_as_it_did_where_it_is_refused_something_else() {
    let mut service = open(
        r#"Scenario(
  name: "zone",
  bounds_m: (min: (0, 0, 0), max: (24, 12, 10)),
  zones: [(name: "people", min_m: (1, 0, 0), max_m: (13, 12, 1), air_limit_mps: 1.2)],
  drones: [(name: "high", airframe: "kolibri", start_m: (7.5, 6.5, 8.5),
    tasks: [(to_m: (3.5, 6.5, 8.5), dwell_s: 100), (to_m: (20.5, 6.5, 8.5))])],
)
"#,
    );
    let retask = json!([{"retask": {"drone": "high", "tasks": [{"to_m": [5.5, 6.5, 1.5]}]}}]);
    let told = tell(&mut service, &change(1, 20.0, &retask));
    let patch = told.answer.patch().expect("an answer").clone();
    let [refused] = &patch.refused[..] else {
        panic!("{patch:?}")
    };
    assert!(
        refused
            .reason
            .ends_with("it goes on with what it had to do"),
        "{}",
        refused.reason
    );
}
