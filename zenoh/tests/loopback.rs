//! Planners over loopback: their joint plan is sound, whichever of them is killed or cut off.

use std::path::Path;
use std::process::{Command, Output};

use leeward_zenoh::{Link, LinkError, Zenoh};

fn soak(out: &Path, words: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_leeward-airspace"))
        .args(["soak", "--out"])
        .arg(out)
        .args(words.split_whitespace())
        .output()
        .expect("it runs")
}

/// The first number after some words.
fn number(text: &str, words: &str) -> u64 {
    let after = text
        .split(words)
        .nth(1)
        .unwrap_or_else(|| panic!("no `{words}` in {text}"));
    let digits = after.chars().take_while(char::is_ascii_digit);
    digits.collect::<String>().parse().expect("a number")
}

#[test]
fn four_planners_of_which_one_is_killed_and_one_cut_off_fly_nothing_that_is_not_sound() {
    let out = tempfile::tempdir().expect("a folder");
    let words = "--drones 3 --seconds 24 --kill --cut 5 --lead 1.5 --rate 2";
    let output = soak(out.path(), words);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{text}{said}");
    assert!(text.contains(": 0 violations"), "{text}");
    assert!(text.contains("contradictions heard: 0"), "{text}");
    assert!(number(&text, "hand-overs: ") > 0, "{text}");
    assert!(text.contains(" to 12 drones"), "{text}");
}

#[test]
fn names_that_are_no_part_of_a_key_expression_are_refused() {
    let link = |area: &str| Link {
        site: "yard".to_owned(),
        area: area.to_owned(),
        listen: vec!["tcp/127.0.0.1:0".to_owned()],
        connect: Vec::new(),
    };
    for wrong in ["", "a/b", "a*", "a b"] {
        let told = Zenoh::open(link(wrong));
        assert!(matches!(told, Err(LinkError::Name(_))), "`{wrong}`");
    }
    assert!(Zenoh::open(link("a0-1")).is_ok());
}
