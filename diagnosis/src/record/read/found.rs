//! What reading turns up: problems that keep a file from being read, and remarks on one that was.

use super::origin::Origin;
use crate::record::problem::{Problem, Problems};
use crate::record::recording::Recording;
use crate::record::remark::{Remark, RemarkKind};

/// Gathers problems and remarks while the files of one recording are read.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) problems: Vec<Problem>,
    pub(super) remarks: Vec<Remark>,
    /// When the log's own time is 0.
    pub(super) starts: Option<Start>,
    /// The log's own time of its first row (s).
    pub(super) first_s: Option<f64>,
    /// Where its places count from.
    pub(super) origin: Option<Origin>,
}

/// How well a log's time is known by messages of its GPS receiver (s), plus or minus. Chosen here:
/// they come a fifth of a second or less after their fix, each by nearly as much.
pub(super) const GPS_WITHIN_S: f64 = 0.1;

/// A moment on a clock that other logs may share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Start {
    /// Since its epoch (s).
    pub(super) at_s: f64,
    /// How well that is known (s), plus or minus.
    pub(super) within_s: f64,
}

impl Found {
    /// Tells what is wrong at a place.
    pub(super) fn problem(&mut self, place: Problem, message: impl Into<String>) {
        self.helped(place, message, None);
    }

    /// A problem with its way out.
    pub(super) fn helped(
        &mut self,
        place: Problem,
        message: impl Into<String>,
        help: Option<String>,
    ) {
        self.problems.push(Problem {
            message: message.into(),
            help,
            ..place
        });
    }

    /// A remark without a time, on the whole recording or on one vehicle.
    pub(super) fn remark(
        &mut self,
        kind: RemarkKind,
        subject: Option<&str>,
        message: impl Into<String>,
    ) {
        self.remarks.push(Remark::new(kind, subject, message));
    }

    /// What `read` makes of some files, with its remarks, if nothing is wrong with them, else
    /// everything that is: files in the order they were read, lines rising.
    pub(super) fn recording(
        read: impl FnOnce(&mut Found) -> Option<Recording>,
    ) -> Result<Recording, Problems> {
        let mut found = Found::default();
        match read(&mut found) {
            Some(read) if found.problems.is_empty() => Ok(Recording {
                remarks: found.remarks,
                ..read
            }),
            _ => Err(Problems(found.problems)),
        }
    }
}

/// Remarks on rows of one vehicle or probe, or of a whole table.
pub(super) struct RowRemarks<'a> {
    pub(super) found: &'a mut Found,
    pub(super) subject: Option<&'a str>,
    /// "row", "reading".
    pub(super) noun: &'static str,
    /// Time of each row (s).
    pub(super) t_s: &'a [f64],
}

impl RowRemarks<'_> {
    /// A remark on these rows, in the order of the file: "12 rows `what`"; none where there are
    /// none.
    pub(super) fn tell(&mut self, kind: RemarkKind, rows: &[usize], what: &str) {
        if rows.is_empty() {
            return;
        }
        let times_s = || rows.iter().map(|&row| self.t_s[row]);
        let finite = || times_s().filter(|t_s| t_s.is_finite());
        let (first_s, last_s) = (finite().reduce(f64::min), finite().reduce(f64::max));
        let several = if rows.len() == 1 { "" } else { "s" };
        let message = format!("{} {}{several} {what}", rows.len(), self.noun);
        self.found.remarks.push(Remark {
            samples: rows.len(),
            span_s: first_s.zip(last_s),
            ..Remark::new(kind, self.subject, message)
        });
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
