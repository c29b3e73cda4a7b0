use super::*;

fn injected(name: &str, accepted: &[&str]) -> Injected {
    Injected {
        name: name.to_owned(),
        accepted: accepted.iter().map(|&name| name.to_owned()).collect(),
        parameters: BTreeMap::from([("q".to_owned(), 1.2)]),
    }
}

fn truth(effects: Vec<Injected>) -> Truth {
    Truth {
        family: "single_cant_mid".to_owned(),
        is_outside: effects.iter().any(|effect| effect.accepted.is_empty()),
        effects,
        region: vec![0, 1, 2],
        truth_clean: vec![2.0, 2.0, 2.0, 1.0],
        baseline_clean: vec![1.0, 1.0, 1.0, 1.0],
        noise: vec![0.1; 4],
        oracle_chi2: 300.0,
    }
}

fn named(name: &str, alternatives: &[&str], interval: [f64; 2]) -> Named {
    let [low, high] = interval;
    let q = Estimate {
        value: 0.5 * (low + high),
        low,
        high,
        unit: "1".into(),
        at_bound: false,
    };
    Named {
        name: name.to_owned(),
        alternatives: alternatives.iter().map(|&name| name.to_owned()).collect(),
        parameters: BTreeMap::from([("q".to_owned(), q)]),
    }
}

fn answer(verdict: Verdict, effects: Vec<Named>) -> Answer {
    Answer {
        verdict,
        effects,
        region: vec![1, 2, 3],
        prediction: vec![2.0, 2.0, 1.5, f64::NAN],
        rises: false,
        at_bound: false,
        seconds: 2.0,
    }
}

const CANT: &[&str] = &["rotor_cant", "width_scale"];

#[test]
fn a_right_answer_is_assessed_by_hand_counted_numbers() {
    let assessed = Assessed::of(
        &truth(vec![injected("rotor_cant", CANT)]),
        &answer(
            Verdict::Library,
            vec![named("width_scale", &[], [1.1, 1.3])],
        ),
    );
    assert!(
        assessed.detected
            && assessed.named
            && assessed.in_set
            && !assessed.spurious
            && !assessed.accused
    );
    assert_eq!(assessed.answered, "rotor_cant");
    // Two rows of four in either are in both.
    assert_eq!(assessed.location, Some(0.5));
    // Squares of 0, 0, 0.5, 0 against three of 1; a row without prediction counts as the baseline.
    assert!(
        (assessed.skill.expect("there is an error to take away") - (1.0 - 0.25 / 3.0)).abs()
            < 1e-12
    );
    assert_eq!(assessed.covered, Share { hits: 1, of: 1 });
}

#[test]
fn alternatives_count_for_the_set_and_not_for_the_first_place() {
    let assessed = Assessed::of(
        &truth(vec![injected("rotor_cant", CANT)]),
        &answer(
            Verdict::Ambiguous,
            vec![named("wander", &["rotor_cant"], [0.0, 1.0])],
        ),
    );
    assert!(!assessed.named && assessed.in_set && assessed.accused && !assessed.spurious);
    assert_eq!(assessed.covered.of, 0);
}

#[test]
fn one_name_serves_one_effect_only() {
    let both = truth(vec![
        injected("payload_mass", &["payload_mass", "momentum_scale"]),
        injected("momentum_scale", &["momentum_scale"]),
    ]);
    let once = answer(
        Verdict::Library,
        vec![named("momentum_scale", &[], [0.0, 1.0])],
    );
    assert!(!Assessed::of(&both, &once).named);
    // The first truth must leave the name to the second, which has no other.
    let effects = vec![
        named("momentum_scale", &[], [0.0, 1.0]),
        named("payload_mass", &[], [0.0, 1.0]),
    ];
    assert!(Assessed::of(&both, &answer(Verdict::Library, effects)).named);
}

#[test]
fn a_wrong_name_is_spurious_only_when_it_is_one_too_many() {
    let truth = truth(vec![injected("rotor_cant", CANT)]);
    let wrong = Assessed::of(
        &truth,
        &answer(Verdict::Library, vec![named("swirl", &[], [0.0, 1.0])]),
    );
    assert!(!wrong.spurious && !wrong.in_set);
    let effects = vec![
        named("rotor_cant", &[], [0.0, 1.0]),
        named("swirl", &[], [0.0, 1.0]),
    ];
    let extra = Assessed::of(&truth, &answer(Verdict::Library, effects));
    assert!(extra.spurious && extra.named);
    assert_eq!(extra.answered, "rotor_cant+swirl");
}

#[test]
fn a_sensor_put_on_the_air_is_an_accusation_and_the_right_fault_is_not() {
    let truth = truth(vec![injected("sensor_gain", &["sensor_gain"])]);
    let physics = answer(
        Verdict::Library,
        vec![named("momentum_scale", &["sensor_gain"], [0.0, 1.0])],
    );
    let sensor = answer(
        Verdict::Ambiguous,
        vec![named("sensor_gain", &["momentum_scale"], [0.0, 1.0])],
    );
    let metrics = Metrics::over(vec![
        Assessed::of(&truth, &physics),
        Assessed::of(&truth, &sensor),
    ]);
    assert_eq!(metrics.accusations, Share { hits: 1, of: 2 });
    assert_eq!(metrics.named, Share { hits: 1, of: 2 });
    assert_eq!(metrics.in_set, Share { hits: 2, of: 2 });
}

#[test]
fn nulls_outsiders_and_the_invisible_are_counted_where_they_belong() {
    let mut null = truth(Vec::new());
    null.region.clear();
    let outside = truth(vec![injected("vent", &[])]);
    let mut faint = truth(vec![injected("rotor_cant", CANT)]);
    faint.oracle_chi2 = 24.0;
    let some = answer(Verdict::OutsideLibrary, Vec::new());
    let cases = vec![
        Assessed::of(&null, &Answer::nothing()),
        Assessed::of(&null, &some),
        Assessed::of(&outside, &some),
        Assessed::of(&faint, &Answer::nothing()),
    ];
    let metrics = Metrics::over(cases);
    assert_eq!(metrics.false_alarms, Share { hits: 1, of: 2 });
    assert_eq!(metrics.outside, Share { hits: 1, of: 1 });
    assert_eq!(metrics.detected, Share { hits: 1, of: 1 });
    assert_eq!(metrics.named.of, 0);
    assert_eq!(metrics.skill_median, None);
    assert_eq!(metrics.confusion["none"]["outside_library"], 1);
    assert_eq!(metrics.confusion["outside: vent"]["outside_library"], 1);
    assert!(
        metrics
            .table()
            .contains("null false alarm           0.500       1/2  at most 0.005  missed")
    );
    assert!(metrics.confusion_table().contains("rotor_cant: 1 none\n"));
}

#[test]
fn answering_nothing_leaves_all_of_the_error_and_finds_no_row() {
    let assessed = Assessed::of(
        &truth(vec![injected("rotor_cant", CANT)]),
        &Answer::nothing(),
    );
    assert_eq!((assessed.skill, assessed.location), (Some(0.0), Some(0.0)));
}
