//! What is wrong with a scenario, and where.

use std::fmt;
use std::ops::Range;

use thiserror::Error;

/// One thing that is wrong with a scenario, for a person to read beside the text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Problem {
    /// Subject and fault, lowercase, no final period.
    pub message: String,
    /// Where, in bytes of the text (of the cited file where there is one); `None` where no place in
    /// the text is to blame.
    pub span: Option<Range<usize>>,
    /// The file that the place lies in, where that is not the scenario itself.
    pub cited: Option<Box<Cited>>,
    /// What to say at that place.
    pub label: Option<String>,
    /// What else one must know.
    pub notes: Vec<String>,
    /// What would put it right.
    pub help: Option<String>,
}

/// A file that a scenario cites, with its text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cited {
    /// As the scenario names it.
    pub file: String,
    /// What it holds.
    pub text: String,
}

impl Problem {
    /// Line and column of the place, from 1, in the scenario's text or, where one is cited, in that
    /// file; columns count characters.
    #[must_use]
    pub fn line_column(&self, text: &str) -> Option<(usize, usize)> {
        let text = self.cited.as_ref().map_or(text, |it| &it.text).as_bytes();
        let before = &text[..self.span.as_ref()?.start.min(text.len())];
        let line = before.iter().filter(|it| **it == b'\n').count() + 1;
        let last = before.rsplit(|it| *it == b'\n').next().unwrap_or_default();
        Some((line, String::from_utf8_lossy(last).chars().count() + 1))
    }

    /// A problem at a place in the text (bytes).
    pub(super) fn at(span: &Range<usize>, message: impl Into<String>) -> Problem {
        Problem {
            message: message.into(),
            span: Some(span.clone()),
            ..Problem::default()
        }
    }

    /// Says what to read at that place.
    pub(super) fn label(mut self, label: impl Into<String>) -> Problem {
        self.label = Some(label.into());
        self
    }

    /// Adds what else one must know.
    pub(super) fn note(mut self, note: impl Into<String>) -> Problem {
        self.notes.push(note.into());
        self
    }

    /// Says what would put it right.
    pub(super) fn help(mut self, help: impl Into<String>) -> Problem {
        self.help = Some(help.into());
        self
    }

    /// Says what would put it right, if that is known.
    pub(super) fn maybe_help(mut self, help: Option<String>) -> Problem {
        self.help = help.or(self.help);
        self
    }
}

impl fmt::Display for Problem {
    /// One line, for callers who have no text to point into.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(cited) = &self.cited {
            write!(f, "{}: ", cited.file)?;
        }
        f.write_str(&self.message)?;
        if let Some(label) = &self.label {
            write!(f, ": {label}")?;
        }
        if let Some(help) = &self.help {
            write!(f, "; {help}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Problem {}

/// All that is wrong, at least one thing: an error that `?` hands on, one line for each.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{}", lines(.0))]
pub struct Problems<P: fmt::Debug + fmt::Display = Problem>(pub Vec<P>);

impl<P: fmt::Debug + fmt::Display> std::ops::Deref for Problems<P> {
    type Target = [P];

    fn deref(&self) -> &[P] {
        &self.0
    }
}

fn lines<P: fmt::Display>(problems: &[P]) -> String {
    let lines: Vec<String> = problems.iter().map(P::to_string).collect();
    lines.join("\n")
}

/// The nearest of `known`, if one is near enough for `typed` to be a slip of the hand.
pub(super) fn nearest<'a>(
    typed: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    // A third of the letters, at least two: chosen here, so that `kolbri` finds `kolibri` and `x`
    // nothing.
    let slips = (typed.chars().count() / 3).max(2);
    let lower = typed.to_lowercase();
    known
        .into_iter()
        .map(|name| {
            (
                strsim::damerau_levenshtein(&lower, &name.to_lowercase()),
                name,
            )
        })
        .filter(|(distance, name)| *distance <= slips && *distance < name.chars().count())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

/// The help for a name that is nearly a known one.
pub(super) fn did_you_mean(name: &str) -> String {
    format!("did you mean `{name}`?")
}
