//! `plan serve`: a plan that is being flown, changed by messages on standard input.

use std::io::{self, BufRead, Read as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use service::message::{Answer as Told, Code, MOST_BYTES, PROTOCOL, Record};
use service::{Handled, Service};

use crate::io::answer::Answer;
use crate::io::failure::{Failure, tell};
use crate::io::journal::Journal;
use crate::report::words::count;

#[derive(Args)]
pub(crate) struct Arguments {
    /// File to which every change is added before it is answered; what it holds is replayed first
    /// [default: a plan ends with the process]
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
}

/// A line of standard input.
enum Line {
    Text(String),
    Refused(Code, String),
    End,
}

/// Answers a line for each line, in their order, until standard input ends.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let mut service = Service::default();
    let mut journal = match &arguments.journal {
        Some(path) => Some(replayed(path, &mut service)?),
        None => None,
    };
    let (mut input, mut output) = (io::stdin().lock(), io::stdout().lock());
    let mut patches = Vec::new();
    loop {
        let line = line_of(&mut input).map_err(Failure::read(Path::new("standard input")))?;
        let began = Instant::now();
        let answer = match line {
            Line::End => break,
            Line::Refused(code, message) => service.refuse(code, &message),
            Line::Text(line) => {
                let elapsed_s = || began.elapsed().as_secs_f64();
                let Handled { answer, record } = service.handle(&line, &elapsed_s);
                if let (Some(journal), Some(record)) = (&mut journal, &record) {
                    journal.append(record)?;
                }
                if let Some(Record::Changed { .. }) = record {
                    patches.push(began.elapsed());
                }
                answer
            }
        };
        log(&service, &answer, began.elapsed());
        if !send(&mut output, &answer)? {
            break;
        }
    }
    tell_patches(patches);
    Ok(Answer::Yes)
}

/// The journal, and its plan in the service.
fn replayed(path: &Path, service: &mut Service) -> Result<Journal, Failure> {
    let (mut journal, kept) = Journal::open(path)?;
    if kept.torn > 0 {
        tell(&format!(
            "{}: the last line is torn, {} dropped: it was not answered",
            path.display(),
            count(kept.torn, "byte", "bytes")
        ));
    }
    if kept.lines.is_empty() {
        journal.append(&Record::Journal(PROTOCOL.to_owned()))?;
        return Ok(journal);
    }
    for (index, line) in kept.lines.iter().enumerate() {
        let wrong = |reason: String| Failure::Journal {
            path: path.to_owned(),
            reason: format!("line {}: {reason}", index + 1),
        };
        let record: Record = serde_json::from_str(line).map_err(|it| wrong(it.to_string()))?;
        if (index == 0) != matches!(record, Record::Journal(_)) {
            let what = format!("a journal begins with {{\"journal\":\"{PROTOCOL}\"}}, once");
            return Err(wrong(what));
        }
        service.replay(record).map_err(|it| wrong(it.to_string()))?;
    }
    let now = match service.revision() {
        Some(revision) => format!("revision {revision}"),
        None => "no plan is open".to_owned(),
    };
    let lines = count(kept.lines.len(), "line", "lines");
    tell(&format!("{}: {lines} replayed, {now}", path.display()));
    Ok(journal)
}

/// The next line; of one that is too long no more is kept than a line may have.
fn line_of(input: &mut impl BufRead) -> io::Result<Line> {
    let mut bytes = Vec::new();
    let most = MOST_BYTES as u64 + 1;
    if input.by_ref().take(most).read_until(b'\n', &mut bytes)? == 0 {
        return Ok(Line::End);
    }
    if bytes.last() == Some(&b'\n') {
        bytes.pop();
    } else if bytes.len() > MOST_BYTES {
        input.skip_until(b'\n')?;
        let message = format!("the line has more than {} MiB", MOST_BYTES >> 20);
        return Ok(Line::Refused(Code::TooMuch, message));
    }
    Ok(match String::from_utf8(bytes) {
        Ok(line) => Line::Text(line),
        Err(error) => {
            let at = error.utf8_error().valid_up_to() + 1;
            Line::Refused(Code::Malformed, format!("byte {at} is not UTF-8"))
        }
    })
}

/// Whether there is a reader left.
fn send(output: &mut impl io::Write, answer: &Told) -> Result<bool, Failure> {
    let text = serde_json::to_string(answer).map_err(|it| Failure::Print(it.into()))?;
    match writeln!(output, "{text}").and_then(|()| output.flush()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(Failure::Print(error)),
    }
}

/// One line for each answer, `key=value`.
fn log(service: &Service, answer: &Told, took: Duration) {
    let revision = service
        .revision()
        .map_or("none".to_owned(), |it| it.to_string());
    let took_s = took.as_secs_f64();
    tell(&match &answer.error {
        None => format!("answered took_s={took_s:.4} revision={revision}"),
        Some(error) => {
            let code = serde_json::to_string(&error.code).unwrap_or_default();
            format!("refused took_s={took_s:.4} revision={revision} code={code}")
        }
    });
}

/// How long patches took, at the end.
fn tell_patches(mut took: Vec<Duration>) {
    took.sort_unstable();
    let Some(last) = took.len().checked_sub(1) else {
        return;
    };
    let quantile_s = |share: f64| took[(share * last as f64).round() as usize].as_secs_f64();
    tell(&format!(
        "{}: p50 {:.4} s, p99 {:.4} s, longest {:.4} s",
        count(took.len(), "patch", "patches"),
        quantile_s(0.5),
        quantile_s(0.99),
        quantile_s(1.0)
    ));
}
