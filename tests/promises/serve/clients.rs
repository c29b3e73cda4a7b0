//! The clients and the unit in `service/contrib`, run as they are.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

use super::YARD;
use super::http::{Server, TOKEN};
use crate::readme::root;

fn contrib(name: &str) -> PathBuf {
    root().join("service/contrib").join(name)
}

/// What a client prints with a server that asks for a token.
fn run(program: &str, client: &str) -> Output {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("yard.ron"), YARD).unwrap();
    fs::write(folder.path().join("token"), TOKEN).unwrap();
    let server = Server::start(folder.path(), &["--token-file", "token"]);
    let output = Command::new(program)
        .current_dir(folder.path())
        .arg(contrib(client))
        .args([&format!("http://{}", server.address), "yard.ron", "left"])
        .env("LEEWARD_TOKEN", TOKEN)
        .output()
        .unwrap_or_else(|it| panic!("{program} does not run: {it}"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    output
}

#[test]
fn the_shell_client_opens_changes_lands_and_closes() {
    let output = run("sh", "client.sh");
    let text = String::from_utf8(output.stdout).unwrap();
    let answers: Vec<Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|it| panic!("{line}: {it}")))
        .collect();
    let [opened, late, landing, closed] = &answers[..] else {
        panic!("{text}");
    };
    assert_eq!(opened["result"]["revision"], 1);
    assert_eq!(late["result"]["changed"][0]["drone"], "left");
    assert_eq!(landing["result"]["not_landing"], serde_json::json!([]));
    assert_eq!(closed["result"]["closed"], 3);
}

#[test]
fn the_python_client_keeps_a_copy_of_the_plan() {
    let output = run("python3", "client.py");
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let [refused, copied, landing] = lines[..] else {
        panic!("{text}");
    };
    assert_eq!(
        refused,
        "refused: future_revision: revision 7 of a plan at revision 1: there is none such yet (params.revision)"
    );
    assert!(
        copied.starts_with("revision 2: left ends at [20.5, 2.5, 1.5] at "),
        "{copied}"
    );
    assert_eq!(landing, "revision 3: not landing: []");
}

#[test]
fn the_command_in_the_systemd_unit_is_one_that_the_program_takes() {
    let unit = fs::read_to_string(contrib("leeward.service")).unwrap();
    let commands: Vec<&str> = unit
        .lines()
        .filter_map(|line| {
            line.strip_prefix("ExecStart=/usr/local/bin/plan serve --http 127.0.0.1:8080 ")
        })
        .collect();
    let [more] = commands[..] else {
        panic!("{unit}");
    };
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().to_str().unwrap();
    let more = more.replace("/var/lib/leeward", state);
    let more: Vec<&str> = more.split(' ').collect();
    let server = Server::start(folder.path(), &more);
    let (code, said) = server.stop();
    assert_eq!(code, Some(0), "{said}");
    assert!(folder.path().join("site.jsonl").exists());
    assert!(
        said.lines()
            .all(|line| serde_json::from_str::<Value>(line).is_ok()),
        "{said}"
    );
}
