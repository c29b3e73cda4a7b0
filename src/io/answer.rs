//! What a command answers, and how it prints that.

use std::io::Write as _;
use std::process::ExitCode;

use clap::ValueEnum;

use super::failure::Failure;

/// How to print an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For people
    Text,
    /// One JSON object on standard output, and nothing else there
    Json,
}

/// What a command that could be carried out answers: exit code 0 or 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    Yes,
    No,
}

impl From<bool> for Answer {
    fn from(yes: bool) -> Answer {
        if yes { Answer::Yes } else { Answer::No }
    }
}

impl Answer {
    /// Yes where both are.
    pub(crate) fn and(self, other: Answer) -> Answer {
        Answer::from(self == Answer::Yes && other == Answer::Yes)
    }
}

impl From<Answer> for ExitCode {
    fn from(answer: Answer) -> ExitCode {
        ExitCode::from(u8::from(answer == Answer::No))
    }
}

/// Text on standard output. A reader that closes it early (`plan ... | head`) is no failure.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(Failure::Print(error)),
        _ => Ok(()),
    }
}
