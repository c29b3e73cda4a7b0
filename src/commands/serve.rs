//! `plan serve`: a plan that is being flown, changed by messages on standard input or over HTTP.

mod connections;
mod events;
mod figures;
mod http;
mod journaled;
mod log;

use std::io::{self, BufRead, Read as _};
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use service::message::{Answer as Told, Code, MOST_BYTES};

use crate::io::answer::Answer;
use crate::io::failure::Failure;
use http::HttpListener;
use journaled::JournaledService;
use log::{Log, Style};

#[derive(Args)]
pub(crate) struct Arguments {
    /// File to which every change is added before it is answered; what it holds is replayed first
    /// [default: a plan ends with the process]
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
    /// Drop from the journal, at the start, the plans that are closed
    #[arg(long, requires = "journal")]
    compact: bool,
    /// Address and port to listen at for HTTP, in place of standard input; port 0 takes a free one.
    /// Without a token only this machine can be listened to
    #[arg(long, value_name = "ADDRESS:PORT")]
    http: Option<String>,
    /// File with the token that requests must carry (`Authorization: Bearer TOKEN`)
    #[arg(long, value_name = "FILE", requires = "http")]
    token_file: Option<PathBuf>,
    /// Most requests over HTTP that wait or are worked on, at most half of them of one address;
    /// others are refused
    #[arg(long, value_name = "N", default_value_t = 64, requires = "http",
        value_parser = clap::value_parser!(u32).range(1..=100_000))]
    most_waiting: u32,
    /// Most connections over HTTP, at most half of them of one address; others are refused
    #[arg(long, value_name = "N", default_value_t = 256, requires = "http",
        value_parser = clap::value_parser!(u32).range(1..=100_000))]
    most_connections: u32,
    /// How to write the lines on standard error
    #[arg(long, value_enum, value_name = "STYLE", default_value_t = Style::Text)]
    log: Style,
}

/// Answers requests until there are no more to come.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let log = Log::new(arguments.log);
    served(arguments, log).map_err(|failure| log.failure(failure))
}

fn served(arguments: &Arguments, log: Log) -> Result<Answer, Failure> {
    let listener = match &arguments.http {
        Some(address) => Some(HttpListener::open(
            address,
            arguments.token_file.as_deref(),
            (arguments.most_waiting, arguments.most_connections),
        )?),
        None => None,
    };
    let service = JournaledService::new(arguments.journal.as_deref(), arguments.compact, log)?;
    match listener {
        Some(listener) => listener.serve(service),
        None => lines(service),
    }
}

/// A line of standard input.
enum Line {
    Text(String),
    Refused(Code, String),
    End,
}

/// Answers a line for each line, in their order, until standard input ends.
fn lines(mut service: JournaledService) -> Result<Answer, Failure> {
    let (mut input, mut output) = (io::stdin().lock(), io::stdout().lock());
    loop {
        let line = line_of(&mut input).map_err(Failure::read(Path::new("standard input")))?;
        let came = Instant::now();
        let done = match line {
            Line::End => break,
            Line::Refused(code, message) => service.refuse(code, &message, came),
            Line::Text(line) => service.answer(&line, came)?,
        };
        if !send(&mut output, &done.answer)? {
            break;
        }
    }
    service.tell_patches();
    Ok(Answer::Yes)
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
    Ok(match text_of(bytes) {
        Ok(line) => Line::Text(line),
        Err(message) => Line::Refused(Code::Malformed, message),
    })
}

/// A request as text.
fn text_of(bytes: Vec<u8>) -> Result<String, String> {
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to() + 1;
        format!("byte {at} is not UTF-8")
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
