//! `plan serve --http`, over sockets of this machine.

use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{Shutdown, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::{self, JoinHandle};

use serde_json::{Value, json};

use super::{requests, uninterrupted};

pub(super) const TOKEN: &str = "0123456789abcdef0123456789abcdef";

/// A server on a free port.
pub(super) struct Server {
    child: Child,
    /// `127.0.0.1:PORT`.
    pub(super) address: String,
    /// The other lines of standard error.
    said: Option<JoinHandle<String>>,
}

impl Server {
    pub(super) fn start(folder: &Path, more: &[&str]) -> Server {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plan"));
        command
            .current_dir(folder)
            .args(["serve", "--http", "127.0.0.1:0"]);
        command.args(more).stdin(Stdio::null());
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap());
        let mut said = String::new();
        let address = loop {
            let mut line = String::new();
            assert!(lines.read_line(&mut line).unwrap() > 0, "{said}");
            said.push_str(&line);
            if let Some((_, address)) = line.split_once("http://") {
                break address.trim_end_matches(['"', '}', '\n']).to_owned();
            }
        };
        let rest = thread::spawn(move || {
            lines.read_to_string(&mut said).unwrap();
            said
        });
        Server {
            child,
            address,
            said: Some(rest),
        }
    }

    fn connect(&self) -> TcpStream {
        TcpStream::connect(&self.address).unwrap()
    }

    /// Status, head and body of the answer to bytes.
    fn told(&self, bytes: &[u8]) -> (u16, String, String) {
        let mut stream = self.connect();
        stream.write_all(bytes).unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
        let status = head.split(' ').nth(1).and_then(|it| it.parse().ok());
        (status.unwrap_or(0), head.to_lowercase(), body.to_owned())
    }

    fn get(&self, path: &str) -> (u16, String, String) {
        self.told(
            format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                .as_bytes(),
        )
    }

    fn post(&self, body: &str) -> (u16, Value) {
        let (status, _, body) = self.told(posted(body).as_bytes());
        (status, serde_json::from_str(&body).unwrap_or_default())
    }

    /// Ends it as `kill -9` does.
    fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Ends it as a service manager does; exit code and standard error.
    pub(super) fn stop(mut self) -> (Option<i32>, String) {
        let id = self.child.id().to_string();
        assert!(
            Command::new("kill")
                .args(["-TERM", &id])
                .status()
                .unwrap()
                .success()
        );
        let code = self.child.wait().unwrap().code();
        (code, self.said.take().unwrap().join().unwrap())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A request with a body, as bytes.
fn posted(body: &str) -> String {
    format!(
        "POST /v1/requests HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n\
         Content-Length: {}\r\nConnection: close\r\n\r\n{body}",
        body.len()
    )
}

/// The answers to server-sent events, one after the other: name, kind, data.
struct Listener(BufReader<TcpStream>);

impl Listener {
    fn new(server: &Server, last: Option<&str>) -> Listener {
        let mut head = "GET /v1/events HTTP/1.1\r\nHost: 127.0.0.1\r\n".to_owned();
        if let Some(last) = last {
            write!(head, "Last-Event-ID: {last}\r\n").unwrap();
        }
        head.push_str("\r\n");
        let mut stream = server.connect();
        stream.write_all(head.as_bytes()).unwrap();
        let mut listener = Listener(BufReader::new(stream));
        // From its first line on it hears everything.
        while !listener.line().unwrap().starts_with("retry: ") {}
        listener
    }

    /// A line that is not of the transfer encoding.
    fn line(&mut self) -> Option<String> {
        let mut line = String::new();
        (self.0.read_line(&mut line).unwrap() > 0).then(|| line.trim_end().to_owned())
    }

    fn next(&mut self) -> (String, String, Value) {
        let (mut name, mut kind) = (String::new(), String::new());
        loop {
            let line = self.line().expect("an event");
            if let Some(it) = line.strip_prefix("id: ") {
                it.clone_into(&mut name);
            } else if let Some(it) = line.strip_prefix("event: ") {
                it.clone_into(&mut kind);
            } else if let Some(it) = line.strip_prefix("data: ") {
                return (name, kind, serde_json::from_str(it).unwrap());
            }
        }
    }
}

fn plan_of(server: &Server) -> String {
    let (status, answer) = server.post(r#"{"method": "plan"}"#);
    assert_eq!(status, 200, "{answer}");
    answer["result"]["plan"].to_string()
}

#[test]
fn over_http_every_request_has_the_answer_that_it_has_on_standard_input() {
    let folder = tempfile::tempdir().unwrap();
    let mut lines = requests();
    lines.push(json!({"id": 7, "method": "plan"}).to_string());
    lines.push(
        json!({"method": "change", "params": {"revision": 1, "at_s": 99, "changes": []}})
            .to_string(),
    );
    let shown = super::answers(&super::told(folder.path(), None, &lines));
    let server = Server::start(folder.path(), &[]);
    for (line, shown) in lines.iter().zip(&shown) {
        let (status, answer) = server.post(line);
        assert_eq!(&answer, shown, "{line}");
        let expected = if shown["error"].is_null() { 200 } else { 409 };
        assert_eq!(status, expected, "{answer}");
    }
}

#[test]
fn what_cannot_be_answered_says_why_as_json_with_a_status() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &[]);
    let head = |line: &str, more: &str| {
        format!("{line} HTTP/1.1\r\nHost: localhost\r\n{more}Connection: close\r\n\r\n")
    };
    let json = "Content-Type: application/json\r\n";
    let cases = [
        (posted("{"), 400, "malformed"),
        (posted("{}"), 400, "field"),
        (posted(r#"{"method": "fly"}"#), 400, "unknown_method"),
        (posted(r#"{"method": "plan"}"#), 409, "not_open"),
        (
            posted(r#"{"method": "open", "params": {"scenario": "Scenario("}}"#),
            422,
            "scenario",
        ),
        (head("GET /", ""), 404, "unknown_path"),
        (head("GET /v2/requests", ""), 404, "unknown_path"),
        (head("GET /v1/requests", ""), 405, "http_method"),
        (head("DELETE /v1/events", ""), 405, "http_method"),
        (
            head("POST /v1/requests", "Content-Length: 0\r\n"),
            415,
            "media_type",
        ),
        (
            head(
                "POST /v1/requests",
                &format!("{json}Content-Length: 268435457\r\n"),
            ),
            413,
            "too_much",
        ),
        (
            posted("").replace("localhost", "elsewhere.example:80"),
            421,
            "foreign_host",
        ),
    ];
    for (bytes, status, code) in cases {
        let told = server.told(bytes.as_bytes());
        let answer: Value =
            serde_json::from_str(&told.2).unwrap_or_else(|it| panic!("{it}: {told:?}"));
        assert_eq!((told.0, &answer["error"]["code"]), (status, &json!(code)));
        assert!(!answer["error"]["message"].as_str().unwrap().is_empty());
        assert!(
            told.1.contains("content-type: application/json"),
            "{told:?}"
        );
    }
    // Not UTF-8, and not HTTP.
    let mut bytes = posted("{\"method\": \"pl!n\"}").into_bytes();
    let at = bytes.iter().rposition(|it| *it == b'!').unwrap();
    bytes[at] = 0xff;
    assert!(server.told(&bytes).2.contains("byte 15 is not UTF-8"));
    assert_eq!(server.told(b"HELLO\r\n\r\n").0, 400);
    assert_eq!(server.get("/healthz").0, 200);
}

#[test]
fn an_address_that_others_can_reach_needs_a_token_and_a_request_must_carry_it() {
    let folder = tempfile::tempdir().unwrap();
    let (code, _, said) = crate::run(folder.path(), "serve --http 0.0.0.0:0");
    assert_eq!(code, Some(2));
    assert!(said.contains("--token-file FILE"), "{said}");
    fs::write(folder.path().join("short"), "secret\n").unwrap();
    let (code, _, said) = crate::run(
        folder.path(),
        "serve --http 127.0.0.1:0 --token-file short --log json",
    );
    assert_eq!(code, Some(2));
    let said: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(said["event"], "failed");
    let (code, _, said) = crate::run(folder.path(), "serve --http nowhere");
    assert_eq!(code, Some(2));
    assert!(said.contains("cannot listen at nowhere"), "{said}");

    fs::write(folder.path().join("token"), format!("{TOKEN}\n")).unwrap();
    let server = Server::start(folder.path(), &["--token-file", "token"]);
    let ask = |path: &str, line: &str| {
        let text =
            format!("GET {path} HTTP/1.1\r\nHost: site.example\r\n{line}Connection: close\r\n\r\n");
        server.told(text.as_bytes())
    };
    assert_eq!(ask("/healthz", "").0, 200);
    let wrong = TOKEN.replace('f', "e");
    for line in [
        String::new(),
        format!("Authorization: Bearer {wrong}\r\n"),
        format!("Authorization: Basic {TOKEN}\r\n"),
        format!("Authorization: {TOKEN}\r\n"),
        format!("Authorization: Bearer {}\r\n", &TOKEN[..31]),
    ] {
        for path in ["/metrics", "/v1/events", "/nothing"] {
            let told = ask(path, &line);
            assert_eq!(told.0, 401, "{line}: {told:?}");
            assert!(told.1.contains("www-authenticate: bearer"));
            assert!(told.2.contains("\"unauthorized\""));
        }
    }
    let right = format!("Authorization: Bearer {TOKEN}\r\n");
    assert_eq!(ask("/metrics", &right).0, 200);
}

#[test]
fn listeners_hear_every_patch_and_go_on_where_they_were_after_a_kill_too() {
    let folder = tempfile::tempdir().unwrap();
    let journal = ["--journal", "heard.jsonl"];
    let server = Server::start(folder.path(), &journal);
    let requests = requests();
    let mut first = Listener::new(&server, None);
    let mut heard = Vec::new();
    for (index, request) in requests.iter().enumerate() {
        let (_, answer) = server.post(request);
        let event = first.next();
        let revision = index as u64 + 1;
        assert!(event.0.starts_with(&format!("{revision}-")), "{event:?}");
        if index == 0 {
            assert_eq!(
                (&event.1[..], &event.2),
                ("opened", &json!({"revision": 1}))
            );
        } else {
            assert_eq!((&event.1[..], &event.2), ("patch", &answer["result"]));
        }
        heard.push(event);
    }
    let resumed = |server: &Server| {
        for (index, event) in heard.iter().enumerate().take(heard.len() - 1) {
            let mut again = Listener::new(server, Some(&event.0));
            for expected in &heard[index + 1..] {
                assert_eq!(&again.next(), expected);
            }
        }
    };
    resumed(&server);
    server.kill();
    let server = Server::start(folder.path(), &journal);
    resumed(&server);
    // Who knows something that never was, as of another plan, is told to ask.
    let mut lost = Listener::new(&server, Some("3-00000000"));
    let event = lost.next();
    let revision = requests.len();
    assert_eq!(
        (&event.1[..], &event.2),
        ("ask_plan", &json!({"revision": revision}))
    );
    assert_eq!(event.0, heard[heard.len() - 1].0);
    server.post(r#"{"method": "close"}"#);
    let event = lost.next();
    assert_eq!(
        (&event.1[..], &event.2),
        ("closed", &json!({"closed": revision}))
    );
    // At the end a stream ends.
    let (code, _) = server.stop();
    assert_eq!(code, Some(0));
    while lost.line().is_some() {}
}

#[test]
fn a_server_killed_between_requests_over_http_keeps_what_it_answered() {
    let folder = tempfile::tempdir().unwrap();
    let plans = uninterrupted(folder.path());
    let journal = ["--journal", "killed.jsonl"];
    for (request, plan) in requests().iter().zip(&plans) {
        let server = Server::start(folder.path(), &journal);
        assert_eq!(server.post(request).0, 200);
        server.kill();
        let server = Server::start(folder.path(), &journal);
        assert_eq!(&plan_of(&server), plan);
    }
}

#[test]
fn a_server_that_is_stopped_has_kept_what_it_answered_and_says_how_long_patches_took() {
    let folder = tempfile::tempdir().unwrap();
    let plans = uninterrupted(folder.path());
    let more = ["--journal", "ended.jsonl", "--log", "json"];
    let server = Server::start(folder.path(), &more);
    for request in requests() {
        server.post(&request);
    }
    server.post("{");
    // Connections that do nothing do not keep it.
    let idle = server.connect();
    let (code, said) = server.stop();
    drop(idle);
    assert_eq!(code, Some(0), "{said}");
    let events: Vec<Value> = said
        .lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|it| panic!("{line}: {it}")))
        .collect();
    let named = |name: &str| events.iter().filter(|it| it["event"] == name).count();
    assert_eq!(named("listening"), 1);
    assert_eq!(named("answered"), plans.len());
    assert_eq!(named("refused"), 1);
    let last = events.last().unwrap();
    assert_eq!(
        (&last["event"], &last["patches"]),
        (&json!("ended"), &json!(plans.len() - 1))
    );
    assert!(events.iter().all(|it| it["unix_s"].as_f64() > Some(1.7e9)));

    let server = Server::start(folder.path(), &more[..2]);
    assert_eq!(&plan_of(&server), &plans[plans.len() - 1]);
}

#[test]
fn clients_that_flood_or_go_away_do_not_stop_others() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &["--most-waiting", "4"]);
    server.post(&requests()[0]);
    // Half a head, half a body, a request whose answer is not read.
    let whole = posted(r#"{"method": "plan"}"#);
    let mut held = Vec::new();
    for bytes in [&whole[..20], &whole[..whole.len() - 5], &whole[..]] {
        let mut stream = server.connect();
        stream.write_all(bytes.as_bytes()).unwrap();
        held.push(stream);
    }
    assert_eq!(server.get("/healthz").0, 200);
    for stream in held {
        let _ = stream.shutdown(Shutdown::Both);
    }
    let statuses: Vec<u16> = thread::scope(|scope| {
        let one = || {
            (0..10)
                .map(|_| server.post(r#"{"method": "plan"}"#).0)
                .collect::<Vec<u16>>()
        };
        let all: Vec<_> = (0..12).map(|_| scope.spawn(one)).collect();
        for _ in 0..5 {
            assert_eq!(server.get("/healthz").0, 200);
        }
        all.into_iter().flat_map(|it| it.join().unwrap()).collect()
    });
    let counted = |status: u16| statuses.iter().filter(|it| **it == status).count();
    assert_eq!(counted(200) + counted(429), statuses.len(), "{statuses:?}");
    assert!(counted(200) > 0 && counted(429) > 0, "{statuses:?}");
    assert_eq!(server.post(&requests()[1]).0, 200);

    // No more connections than may be, and at most half of them from here.
    let server = Server::start(folder.path(), &["--most-connections", "6"]);
    let mut held = Vec::new();
    for _ in 0..3 {
        let mut stream = server.connect();
        stream
            .write_all(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
            .unwrap();
        stream.read_exact(&mut [0; 12]).unwrap();
        held.push(stream);
    }
    // Whatever it has sent.
    for _ in 0..20 {
        let (status, told) = server.post(&requests()[1]);
        assert_eq!((status, &told["error"]["code"]), (429, &json!("busy")));
    }
}

#[test]
fn figures_for_prometheus_count_what_was_asked() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &[]);
    for request in requests() {
        server.post(&request);
    }
    server.post("{");
    server.get("/nothing");
    let _listener = Listener::new(&server, None);
    let (status, head, text) = server.get("/metrics");
    assert_eq!(status, 200);
    assert!(
        head.contains("content-type: application/openmetrics-text"),
        "{head}"
    );
    let changes = requests().len() - 1;
    for line in [
        format!("leeward_requests_total{{method=\"change\",code=\"ok\"}} {changes}"),
        "leeward_requests_total{method=\"open\",code=\"ok\"} 1".to_owned(),
        "leeward_requests_total{method=\"none\",code=\"malformed\"} 1".to_owned(),
        "leeward_requests_total{method=\"none\",code=\"unknown_path\"} 1".to_owned(),
        format!("leeward_patches_total {changes}"),
        format!("leeward_patch_seconds_count {changes}"),
        format!("leeward_revision {}", changes + 1),
        "leeward_drones 3".to_owned(),
        "leeward_listeners 1".to_owned(),
        "# EOF".to_owned(),
    ] {
        assert!(text.lines().any(|it| it == line), "{line}\n{text}");
    }
    let (_, _, health) = server.get("/healthz");
    let health: Value = serde_json::from_str(&health).unwrap();
    assert_eq!(
        health,
        json!({"status": "ok", "protocol": "serve/1", "revision": changes + 1})
    );
}
