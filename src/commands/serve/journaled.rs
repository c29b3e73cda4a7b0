//! The one place where requests become changes: one after the other, kept by the journal before
//! they are answered.

use std::collections::VecDeque;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::Value;
use service::message::{Answer, Code, Event, PROTOCOL, Patch, Record};
use service::{Handled, Service};

use super::log::Log;
use crate::io::failure::Failure;
use crate::io::journal::Journal;
use crate::report::words::count;

/// Patches whose times are kept for the quantiles that are reported at the end. Chosen here: three
/// hours of ten a second.
const MOST_TIMES: usize = 100_000;

/// Most wrong lines of a journal that are listed. Chosen here: a screen.
const MOST_LISTED: usize = 20;

/// The plan, the journal, and how long patches took.
pub(super) struct JournaledService {
    service: Service,
    journal: Option<Journal>,
    log: Log,
    took: VecDeque<Duration>,
    /// What the journal was replayed to: lines as they are kept, and the listeners' events.
    replayed: Vec<(String, Event)>,
}

/// The outcome of a request.
pub(super) struct Done {
    pub(super) answer: Answer,
    /// `none` where it could not be read.
    pub(super) method: &'static str,
    /// How long a patch took, if there is one.
    pub(super) patch: Option<Duration>,
    /// The line of the journal, and the listeners' event.
    pub(super) kept: Option<(String, Event)>,
}

impl JournaledService {
    /// With what a journal holds, `compact` if it is to hold no more than it must.
    pub(super) fn new(
        journal: Option<&Path>,
        compact: bool,
        log: Log,
    ) -> Result<JournaledService, Failure> {
        let mut journaled = JournaledService {
            service: Service::default(),
            journal: None,
            log,
            took: VecDeque::new(),
            replayed: Vec::new(),
        };
        if let Some(path) = journal {
            journaled.journal = Some(journaled.replay(path, compact)?);
        }
        Ok(journaled)
    }

    /// Answers a request that came at a moment; what it changes is on the disk.
    pub(super) fn answer(&mut self, line: &str, came: Instant) -> Result<Done, Failure> {
        let began = Instant::now();
        let elapsed_s = || came.elapsed().as_secs_f64();
        let before = self.service.revision();
        let Handled {
            answer,
            record,
            method,
        } = self.service.handle(line, &elapsed_s);
        // A landing that changes nothing is none.
        let patch = answer.patch().filter(|_| record.is_some());
        let patch = patch.map(|_| began.elapsed());
        let mut kept = None;
        if let Some(record) = record {
            let text = line_of(&record)?;
            if let Some(journal) = &mut self.journal {
                journal.append(&text)?;
            }
            let event = event_of(&record, answer.patch(), before);
            kept = event.map(|event| (text, event));
        }
        if let Some(took) = patch {
            self.took.truncate(MOST_TIMES - 1);
            self.took.push_front(took);
        }
        self.tell(&answer, began.elapsed());
        let method = method.unwrap_or("none");
        Ok(Done {
            answer,
            method,
            patch,
            kept,
        })
    }

    /// Refuses what is no text, or too much of it.
    pub(super) fn refuse(&mut self, code: Code, message: &str, came: Instant) -> Done {
        let answer = self.service.refuse(code, message);
        self.tell(&answer, came.elapsed());
        Done {
            answer,
            method: "none",
            patch: None,
            kept: None,
        }
    }

    /// Of the plan that is open.
    pub(super) fn revision(&self) -> Option<u64> {
        self.service.revision()
    }

    /// Of the plan that is open; 0 where there is none.
    pub(super) fn drones(&self) -> usize {
        self.service.drones()
    }

    pub(super) fn log(&self) -> Log {
        self.log
    }

    /// What the journal was replayed to, once.
    pub(super) fn take_replayed(&mut self) -> Vec<(String, Event)> {
        std::mem::take(&mut self.replayed)
    }

    /// One line for each answer.
    fn tell(&self, answer: &Answer, took: Duration) {
        let revision = self.service.revision();
        let shown = revision.map_or("none".to_owned(), |it| it.to_string());
        let took_s = (took.as_secs_f64() * 1e4).round() / 1e4;
        let mut fields = vec![
            ("took_s", Value::from(took_s)),
            ("revision", revision.into()),
        ];
        match &answer.error {
            None => {
                let words = format!("answered took_s={took_s:.4} revision={shown}");
                self.log.tell(words, "answered", &fields);
            }
            Some(error) => {
                let code = error.code.name();
                let words = format!("refused took_s={took_s:.4} revision={shown} code=\"{code}\"");
                fields.push(("code", code.into()));
                fields.push(("message", error.message.clone().into()));
                self.log.tell(words, "refused", &fields);
            }
        }
    }

    /// How long patches took, at the end.
    pub(super) fn tell_patches(self) {
        let mut took = Vec::from(self.took);
        took.sort_unstable();
        let Some(last) = took.len().checked_sub(1) else {
            return;
        };
        let quantile_s = |share: f64| took[(share * last as f64).round() as usize].as_secs_f64();
        let [p50, p99, longest] = [0.5, 0.99, 1.0].map(quantile_s);
        let patches = count(took.len(), "patch", "patches");
        let words = format!("{patches}: p50 {p50:.4} s, p99 {p99:.4} s, longest {longest:.4} s");
        let fields = [
            ("patches", Value::from(took.len())),
            ("p50_s", p50.into()),
            ("p99_s", p99.into()),
            ("longest_s", longest.into()),
        ];
        self.log.tell(words, "ended", &fields);
    }

    /// The journal, and its plan in the service.
    fn replay(&mut self, path: &Path, compact: bool) -> Result<Journal, Failure> {
        let (mut journal, kept) = Journal::open(path)?;
        let name = Value::from(path.display().to_string());
        if kept.torn > 0 {
            let torn = count(kept.torn, "byte", "bytes");
            let words = format!(
                "{}: the last line is torn, {torn} dropped: it was not answered",
                path.display()
            );
            let fields = [("journal", name.clone()), ("bytes", kept.torn.into())];
            self.log.tell(words, "torn", &fields);
        }
        let mut lines = kept.lines;
        if lines.is_empty() {
            journal.append(&line_of(&Record::Journal(PROTOCOL.to_owned()))?)?;
            return Ok(journal);
        }
        let wrong = |faults: Vec<String>| Failure::Journal {
            path: path.to_owned(),
            faults,
        };
        let at = |index: usize, what: &str| format!("line {}: {what}", index + 1);
        let mut records = Vec::with_capacity(lines.len());
        let mut faults = Vec::new();
        for (index, line) in lines.iter().enumerate() {
            match Record::read(line) {
                Ok(record) if (index == 0) == matches!(record, Record::Journal(_)) => {
                    records.push(record);
                }
                Ok(_) => {
                    let begins = format!("{{\"journal\":\"{PROTOCOL}\"}}");
                    faults.push(at(index, &format!("a journal begins with {begins}, once")));
                }
                Err(what) => faults.push(at(index, &what)),
            }
        }
        if faults.len() > MOST_LISTED {
            let more = count(faults.len() - MOST_LISTED, "line", "lines");
            faults.truncate(MOST_LISTED);
            faults.push(format!("{more} more"));
        }
        if !faults.is_empty() {
            return Err(wrong(faults));
        }
        // What was closed is not flown any more.
        let closed = records.iter().rposition(|it| *it == Record::Closed);
        let first = closed.map_or(1, |it| it + 1);
        for (index, record) in records.into_iter().enumerate() {
            if index > 0 && index < first {
                continue;
            }
            let before = self.service.revision();
            let patch = self.service.replay(record.clone());
            let patch = patch.map_err(|it| wrong(vec![at(index, &it.to_string())]))?;
            let event = event_of(&record, patch.as_ref(), before);
            let line = lines[index].clone();
            self.replayed.extend(event.map(|event| (line, event)));
        }
        if compact && first > 1 {
            lines.drain(1..first);
            journal = journal.rewritten(&lines)?;
            let dropped = count(first - 1, "line", "lines");
            let words = format!("{}: {dropped} of closed plans dropped", path.display());
            let fields = [("journal", name.clone()), ("lines", (first - 1).into())];
            self.log.tell(words, "compacted", &fields);
        }
        let revision = self.service.revision();
        let now = match revision {
            Some(revision) => format!("revision {revision}"),
            None => "no plan is open".to_owned(),
        };
        let shown = count(lines.len(), "line", "lines");
        let words = format!("{}: {shown} replayed, {now}", path.display());
        let fields = [
            ("journal", name),
            ("lines", lines.len().into()),
            ("revision", revision.into()),
        ];
        self.log.tell(words, "replayed", &fields);
        Ok(journal)
    }
}

fn line_of(record: &Record) -> Result<String, Failure> {
    serde_json::to_string(record).map_err(|it| Failure::Print(it.into()))
}

/// The listeners' event of a record; `before` is the revision before it.
fn event_of(record: &Record, patch: Option<&Patch>, before: Option<u64>) -> Option<Event> {
    use service::message::{At, Closed};
    match record {
        Record::Journal(_) => None,
        Record::Opened { .. } => Some(Event::Opened(At { revision: Some(1) })),
        Record::Changed { .. } => patch.cloned().map(Event::Patch),
        Record::Closed => before.map(|closed| Event::Closed(Closed { closed })),
    }
}
