//! `plan serve`, by the built command: what docs/serve.md shows is what it answers, and what it has
//! answered outlives it.

mod clients;
mod http;
mod soak;

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use serde_json::{Value, json};

use crate::readme::{blocks, root};
use crate::samples;

const YARD: &str = r#"Scenario(
  name: "yard",
  bounds_m: (min: (0, 0, 0), max: (24, 12, 4)),
  drones: [
    (name: "left", airframe: "kolibri", start_m: (2.5, 2.5, 1.5), tasks: [(to_m: (20.5, 2.5, 1.5))]),
    (name: "right", airframe: "kolibri", start_m: (20.5, 8.5, 1.5), tasks: [(to_m: (2.5, 8.5, 1.5))]),
  ],
)
"#;

/// Opens a plan, then changes it, once for each line.
fn requests() -> Vec<String> {
    let third = json!({
        "drone": "third", "like": "left", "start_m": [12.5, 10.5, 1.5],
        "tasks": [{"to_m": [12.5, 1.5, 2.5], "dwell_s": 2}],
    });
    let changes = [
        json!([{"late": {"drone": "left", "by_s": 1.5}}]),
        json!([{"add": third}]),
        json!([{"retask": {"drone": "right", "tasks": [{"to_m": [12.5, 5.5, 3]}]}}]),
        json!([{"late": {"drone": "third", "by_s": 0.4}}]),
        json!([{"retask": {"drone": "left", "tasks": [{"to_m": [4.5, 10.5, 2]}, {"to_m": [20.5, 2.5, 1]}]}}]),
        json!([{"remove": {"drone": "third"}}]),
        json!([{"late": {"drone": "right", "by_s": 0.9}}, {"late": {"drone": "left", "by_s": 0.6}}]),
    ];
    let open = json!({"method": "open", "params": {"scenario": YARD}});
    let change = |(index, changes): (usize, &Value)| {
        let (revision, at_s) = (index + 1, 1.5 * (index + 1) as f64);
        let params = json!({"revision": revision, "at_s": at_s, "changes": changes});
        json!({"method": "change", "params": params}).to_string()
    };
    let changes = changes.iter().enumerate().map(change);
    [open.to_string()].into_iter().chain(changes).collect()
}

fn command(folder: &Path, journal: Option<&str>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plan"));
    command.current_dir(folder).arg("serve");
    if let Some(journal) = journal {
        command.args(["--journal", journal]);
    }
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// All lines at once, and what came of them.
fn told(folder: &Path, journal: Option<&str>, lines: &[String]) -> Output {
    let mut server = command(folder, journal).spawn().unwrap();
    let mut text = lines.join("\n");
    text.push('\n');
    let mut input = server.stdin.take().unwrap();
    // One that refuses its journal reads nothing.
    let _ = input.write_all(text.as_bytes());
    drop(input);
    server.wait_with_output().unwrap()
}

fn answers(output: &Output) -> Vec<Value> {
    let text = std::str::from_utf8(&output.stdout).unwrap();
    let lines = text.lines().map(|line| serde_json::from_str(line).unwrap());
    lines.collect()
}

/// The plan after each revision, from the first on, as its bytes.
fn uninterrupted(folder: &Path) -> Vec<String> {
    let mut lines = Vec::new();
    for request in requests() {
        lines.push(request);
        lines.push(json!({"method": "plan"}).to_string());
    }
    let output = told(folder, None, &lines);
    let answers = answers(&output);
    assert_eq!(answers.len(), lines.len());
    let plans = answers.iter().skip(1).step_by(2).enumerate();
    let plan = |(index, answer): (usize, &Value)| {
        assert_eq!(answer["result"]["revision"], index + 1, "{answer}");
        answer["result"]["plan"].to_string()
    };
    plans.map(plan).collect()
}

/// The next number of a sequence (M. E. O'Neill, PCG, 2014: its multiplier and increment), below
/// one.
fn next(state: &mut u64, below: u64) -> u64 {
    *state =
        (state.wrapping_mul(6_364_136_223_846_793_005)).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) % below
}

/// Reads so many answers and kills the server a random while later; the revisions that were
/// answered by then.
fn killed(mut server: Child, lines: &[String], after: u64, spins: u64) -> Vec<u64> {
    let mut input = server.stdin.take().unwrap();
    let mut output = BufReader::new(server.stdout.take().unwrap());
    let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
    input.write_all(text.as_bytes()).unwrap();
    let mut revisions = Vec::new();
    let mut read = |output: &mut BufReader<_>| {
        let mut line = String::new();
        let is_whole = output.read_line(&mut line).unwrap() > 0 && line.ends_with('\n');
        if is_whole {
            let answer: Value = serde_json::from_str(&line).unwrap();
            revisions.push(answer["result"]["revision"].as_u64().expect("a revision"));
        }
        is_whole
    };
    for _ in 0..after {
        assert!(read(&mut output));
    }
    for _ in 0..spins {
        std::hint::spin_loop();
    }
    server.kill().unwrap();
    server.wait().unwrap();
    // What it had written by then was answered, too.
    while read(&mut output) {}
    revisions
}

#[test]
fn a_server_killed_at_any_point_loses_nothing_that_it_answered() {
    let folder = tempfile::tempdir().unwrap();
    let plans = uninterrupted(folder.path());
    let requests = requests();
    let (mut state, mut cut_short) = (1, 0);
    for round in 0..samples(10, 200) {
        let journal = format!("{round}.jsonl");
        let server = command(folder.path(), Some(&journal)).spawn().unwrap();
        let after = next(&mut state, requests.len() as u64);
        let spins = next(&mut state, 3_000_000);
        let answered = killed(server, &requests, after, spins);
        assert!(answered.len() as u64 >= after);
        cut_short += usize::from(answered.len() < requests.len());

        let output = told(
            folder.path(),
            Some(&journal),
            &[json!({"method": "plan"}).to_string()],
        );
        let after = &answers(&output)[0];
        let Some(revision) = after["result"]["revision"].as_u64() else {
            assert_eq!(after["error"]["code"], "not_open", "{after}");
            assert_eq!(answered, [0; 0], "round {round}");
            continue;
        };
        assert!(
            answered.last().is_none_or(|it| revision >= *it),
            "round {round}: {revision}, {answered:?}"
        );
        assert_eq!(
            after["result"]["plan"].to_string(),
            plans[revision as usize - 1],
            "round {round}"
        );

        // It goes on from there as if nothing had been.
        let mut rest = requests[revision as usize..].to_vec();
        rest.push(json!({"method": "plan"}).to_string());
        let output = told(folder.path(), Some(&journal), &rest);
        let last = answers(&output).pop().unwrap();
        assert_eq!(
            last["result"]["plan"].to_string(),
            plans[plans.len() - 1],
            "round {round}"
        );
    }
    assert!(cut_short > 0, "no server was killed before it was done");
}

#[test]
fn a_torn_last_line_is_dropped_with_a_remark_and_a_broken_one_before_it_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let plans = uninterrupted(folder.path());
    let journal = Some("kept.jsonl");
    told(folder.path(), journal, &requests());
    let path = folder.path().join("kept.jsonl");
    let whole = fs::read(&path).unwrap();
    let plan = [json!({"method": "plan"}).to_string()];

    fs::write(&path, &whole[..whole.len() - 7]).unwrap();
    let output = told(folder.path(), journal, &plan);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("the last line is torn"), "{said}");
    let answer = &answers(&output)[0]["result"];
    assert_eq!(answer["revision"], plans.len() - 1);
    assert_eq!(answer["plan"].to_string(), plans[plans.len() - 2]);
    // The rest is whole again.
    let output = told(folder.path(), journal, &plan);
    assert!(!String::from_utf8_lossy(&output.stderr).contains("torn"));

    let text = String::from_utf8(whole).unwrap();
    for (broken, words) in [
        (
            text.replacen("\"changed\"", "\"chnged\"", 1),
            "line 3: column 9: unknown variant `chnged`",
        ),
        // All at once.
        (
            text.replace("\"changed\"", "\"chnged\""),
            "line 4: column 9: unknown variant `chnged`",
        ),
        (
            text.replacen("\"revision\":3", "\"revision\":4", 1),
            "line 4: revision 4 does not follow revision 2",
        ),
        (
            text.replacen("serve/1", "serve/9", 1),
            "line 1: the journal is of `serve/9`",
        ),
        ("{\"closed\":null}\n".to_owned(), "it is no journal"),
        // A file of something else is left as it is, though its last line has no end.
        ("{\"note\":\"mine\"}".to_owned(), "it is no journal"),
    ] {
        fs::write(&path, &broken).unwrap();
        let output = told(folder.path(), journal, &plan);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(words), "{words}: {said}");
        assert_eq!(fs::read_to_string(&path).unwrap(), broken);
    }
}

#[test]
fn a_journal_without_its_closed_plans_gives_the_same_plan_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let plans = uninterrupted(folder.path());
    let journal = Some("compact.jsonl");
    let path = folder.path().join("compact.jsonl");
    let half = plans.len() / 2;
    let close = json!({"method": "close"}).to_string();
    let first = [requests(), vec![close.clone()], requests()[..half].to_vec()].concat();
    told(folder.path(), journal, &first);
    let before = fs::read_to_string(&path).unwrap();
    assert_eq!(before.lines().count(), 1 + first.len());

    let compacted = |lines: &[String]| {
        let mut server = command(folder.path(), journal);
        let mut server = server.arg("--compact").spawn().unwrap();
        let mut input = server.stdin.take().unwrap();
        for line in lines {
            writeln!(input, "{line}").unwrap();
        }
        drop(input);
        server.wait_with_output().unwrap()
    };
    let plan = json!({"method": "plan"}).to_string();
    let output = compacted(std::slice::from_ref(&plan));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let dropped = format!("{} lines of closed plans dropped", requests().len() + 1);
    assert!(said.contains(&dropped), "{said}");
    let answer = &answers(&output)[0]["result"];
    assert_eq!(answer["plan"].to_string(), plans[half - 1]);
    let after = fs::read_to_string(&path).unwrap();
    let kept: Vec<&str> = before.lines().skip(1 + requests().len() + 1).collect();
    let header = before.lines().next().unwrap();
    assert_eq!(after, format!("{header}\n{}\n", kept.join("\n")));
    // A second time there is nothing to drop.
    let rest = [requests()[half..].to_vec(), vec![plan.clone()]].concat();
    let output = compacted(&rest);
    assert!(!String::from_utf8_lossy(&output.stderr).contains("dropped"));
    let last = answers(&output).pop().unwrap();
    assert_eq!(last["result"]["plan"].to_string(), plans[plans.len() - 1]);
    // With nothing open there is nothing to keep.
    told(folder.path(), journal, &[close]);
    let output = compacted(&[plan]);
    assert_eq!(answers(&output)[0]["error"]["code"], "not_open");
    assert_eq!(fs::read_to_string(&path).unwrap(), format!("{header}\n"));
    let left = fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 1, "a file was left behind");
}

#[test]
fn one_process_at_a_time_writes_to_a_journal() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = command(folder.path(), Some("one.jsonl")).spawn().unwrap();
    let mut input = first.stdin.take().unwrap();
    let mut output = BufReader::new(first.stdout.take().unwrap());
    // Once it has answered it has the journal.
    input.write_all(b"{\"method\": \"plan\"}\n").unwrap();
    output.read_line(&mut String::new()).unwrap();
    let second = told(folder.path(), Some("one.jsonl"), &requests());
    assert_eq!(second.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&second.stderr).contains("another process has it open"));
    drop(input);
    assert_eq!(first.wait().unwrap().code(), Some(0));

    // Nor to one that has just been written anew.
    let lines = [&requests()[0], r#"{"method": "close"}"#].map(str::to_owned);
    told(folder.path(), Some("one.jsonl"), &lines);
    let mut first = command(folder.path(), Some("one.jsonl"));
    let mut first = first.arg("--compact").spawn().unwrap();
    let mut input = first.stdin.take().unwrap();
    let mut output = BufReader::new(first.stdout.take().unwrap());
    input.write_all(b"{\"method\": \"plan\"}\n").unwrap();
    output.read_line(&mut String::new()).unwrap();
    let second = told(folder.path(), Some("one.jsonl"), &requests());
    assert!(String::from_utf8_lossy(&second.stderr).contains("another process has it open"));
    // What it answers is in the file that has the name now.
    input
        .write_all(format!("{}\n", requests()[0]).as_bytes())
        .unwrap();
    output.read_line(&mut String::new()).unwrap();
    first.kill().unwrap();
    first.wait().unwrap();
    let plan = r#"{"method": "plan"}"#.to_owned();
    let output = told(folder.path(), Some("one.jsonl"), &[plan]);
    assert_eq!(answers(&output)[0]["result"]["revision"], 1);
}

#[test]
fn bytes_that_are_no_text_are_refused_and_the_next_line_is_answered() {
    let folder = tempfile::tempdir().unwrap();
    let mut server = command(folder.path(), None).spawn().unwrap();
    let mut input = server.stdin.take().unwrap();
    input
        .write_all(b"{\"method\": \"pl\xffn\"}\n\n{\"id\": \"a\", \"method\": \"plan\"}")
        .unwrap();
    drop(input);
    let answers = answers(&server.wait_with_output().unwrap());
    let codes: Vec<&Value> = answers.iter().map(|it| &it["error"]["code"]).collect();
    assert_eq!(codes, ["malformed", "malformed", "not_open"]);
    assert_eq!(answers[0]["protocol"], "serve/1");
    assert_eq!(answers[2]["protocol"], Value::Null);
    assert_eq!(answers[2]["id"], "a");
}

/// Whether an answer is what the page shows, where "..." stands for anything.
fn is_shown(shown: &Value, told: &Value) -> bool {
    match (shown, told) {
        (Value::String(dots), _) if dots == "..." => true,
        (Value::Object(shown), Value::Object(told)) => {
            shown.len() == told.len()
                && shown
                    .iter()
                    .all(|(key, it)| told.get(key).is_some_and(|told| is_shown(it, told)))
        }
        (Value::Array(shown), Value::Array(told)) => {
            shown.len() == told.len() && shown.iter().zip(told).all(|(a, b)| is_shown(a, b))
        }
        (Value::Number(shown), Value::Number(told)) => shown.as_f64() == told.as_f64(),
        _ => shown == told,
    }
}

#[test]
fn every_exchange_on_the_page_is_what_the_command_answers() {
    let page = fs::read_to_string(root().join("docs/serve.md")).unwrap();
    let shown = blocks(&page, "jsonl").join("\n");
    let lines = |mark: &str| -> Vec<String> {
        let lines = shown.lines().filter_map(|line| line.strip_prefix(mark));
        lines.map(str::to_owned).collect()
    };
    let (asked, shown_answers) = (lines("> "), lines("< "));
    assert_eq!(asked.len() + shown_answers.len(), shown.lines().count());
    assert_eq!(asked.len(), shown_answers.len());
    assert!(asked.len() >= 12, "the page shows {}", asked.len());
    let folder = tempfile::tempdir().unwrap();
    let answers = answers(&told(folder.path(), None, &asked));
    assert_eq!(answers.len(), asked.len());
    for ((asked, shown), told) in asked.iter().zip(&shown_answers).zip(&answers) {
        let shown: Value = serde_json::from_str(shown).unwrap_or_else(|it| panic!("{shown}: {it}"));
        assert!(
            is_shown(&shown, told),
            "{asked}\nshown: {shown}\ntold:  {told}"
        );
    }
}

#[test]
fn the_schema_names_every_code_and_the_page_explains_each() {
    let folder = tempfile::tempdir().unwrap();
    let (code, schema, _) = crate::run(folder.path(), "schema serve");
    assert_eq!(code, Some(0));
    let schema: Value = serde_json::from_str(&schema).unwrap();
    assert_eq!(schema["protocol"], "serve/1");
    let methods = schema["message"]["oneOf"].as_array().unwrap();
    assert_eq!(methods.len(), 6);
    let page = fs::read_to_string(root().join("docs/serve.md")).unwrap();
    let codes = schema["answer"]["$defs"]["Code"]["oneOf"]
        .as_array()
        .unwrap();
    assert!(codes.len() > 10);
    for code in codes {
        let name = code["const"].as_str().unwrap();
        assert!(
            page.contains(&format!("`{name}`")),
            "docs/serve.md does not explain {name}"
        );
    }
}
