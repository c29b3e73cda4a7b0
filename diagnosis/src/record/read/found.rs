//! What reading turns up: problems that keep a file from being read, and remarks on one that was.

use crate::record::problem::{Problem, Problems};
use crate::record::recording::Recording;
use crate::record::remark::{Remark, RemarkKind};

/// Gathers problems and remarks while the files of one recording are read.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) problems: Vec<Problem>,
    pub(super) remarks: Vec<Remark>,
}

/// A place in a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    pub(super) file: &'a str,
    pub(super) line: Option<u64>,
    pub(super) field: Option<&'a str>,
}

impl<'a> Place<'a> {
    pub(super) fn file(file: &'a str) -> Place<'a> {
        Place {
            file,
            line: None,
            field: None,
        }
    }

    pub(super) fn field(file: &'a str, field: &'a str) -> Place<'a> {
        Place {
            field: Some(field),
            ..Place::file(file)
        }
    }

    pub(super) fn line(self, line: u64) -> Place<'a> {
        Place {
            line: Some(line),
            ..self
        }
    }
}

impl Found {
    pub(super) fn problem(&mut self, place: Place<'_>, message: impl Into<String>) {
        self.helped(place, message, None);
    }

    /// A problem with its way out.
    pub(super) fn helped(
        &mut self,
        place: Place<'_>,
        message: impl Into<String>,
        help: Option<String>,
    ) {
        self.problems.push(Problem {
            file: place.file.to_owned(),
            line: place.line,
            field: place.field.map(str::to_owned),
            message: message.into(),
            help,
        });
    }

    /// A remark without a time, on the whole recording or on one vehicle.
    pub(super) fn remark(
        &mut self,
        kind: RemarkKind,
        subject: Option<&str>,
        message: impl Into<String>,
    ) {
        self.remarks.push(Remark {
            kind,
            subject: subject.map(str::to_owned),
            samples: 0,
            span_s: None,
            message: message.into(),
        });
    }

    /// A remark on rows (`noun`: "row", "reading") at these times (s), in the order of the file:
    /// "12 rows `what`"; none where there are none.
    pub(super) fn rows(
        &mut self,
        kind: RemarkKind,
        subject: Option<&str>,
        (noun, times_s): (&str, impl IntoIterator<Item = f64>),
        what: &str,
    ) {
        let times_s: Vec<f64> = times_s.into_iter().collect();
        let finite = || times_s.iter().copied().filter(|t_s| t_s.is_finite());
        let (first_s, last_s) = (finite().reduce(f64::min), finite().reduce(f64::max));
        if times_s.is_empty() {
            return;
        }
        let several = if times_s.len() == 1 { "" } else { "s" };
        self.remarks.push(Remark {
            kind,
            subject: subject.map(str::to_owned),
            samples: times_s.len(),
            span_s: first_s.zip(last_s),
            message: format!("{} {noun}{several} {what}", times_s.len()),
        });
    }

    /// The recording with its remarks if nothing is wrong with it, else everything that is.
    pub(super) fn recording(self, read: Option<Recording>) -> Result<Recording, Problems> {
        let (mut recording, remarks) = self.into_result(read)?;
        recording.remarks = remarks;
        Ok(recording)
    }

    /// What was read if nothing is wrong with it, else everything that is: files in the order they
    /// were read, lines rising.
    pub(super) fn into_result<T>(self, read: Option<T>) -> Result<(T, Vec<Remark>), Problems> {
        match read {
            Some(read) if self.problems.is_empty() => Ok((read, self.remarks)),
            _ => Err(Problems(self.problems)),
        }
    }
}

/// "`a`, `b`".
pub(super) fn listed<'a>(words: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = words.into_iter().map(|word| format!("`{word}`")).collect();
    quoted.join(", ")
}

/// "did you mean `x`?" for the nearest of `known`, if one is near enough for `typed` to be a slip
/// of the hand.
pub(super) fn did_you_mean<'a>(
    typed: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    // A third of the letters, at least one: chosen here, so that `kolbri` finds `kolibri` and `x`
    // nothing.
    let slips = (typed.chars().count() / 3).max(1);
    let nearest = known
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(typed, name), name))
        .filter(|(distance, name)| *distance <= slips && *distance < name.chars().count())
        .min_by_key(|(distance, _)| *distance);
    nearest.map(|(_, name)| format!("did you mean `{name}`?"))
}
