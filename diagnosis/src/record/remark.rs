//! What was noticed about a recording without being an error: named, counted, placed in time.
//! Nothing is dropped in silence.

use serde::Serialize;

/// One thing noticed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Remark {
    /// What kind of thing.
    pub kind: RemarkKind,
    /// The vehicle or probe concerned; `None`: the recording.
    pub subject: Option<String>,
    /// How many samples.
    pub samples: usize,
    /// First and last time concerned (s), where it has a time.
    pub span_s: Option<(f64, f64)>,
    /// The sentence for a person, with numbers and units.
    pub message: String,
}

impl Remark {
    /// A remark without a time, on the whole recording or on one vehicle or probe.
    #[must_use]
    pub fn new(kind: RemarkKind, subject: Option<&str>, message: impl Into<String>) -> Remark {
        Remark {
            kind,
            subject: subject.map(str::to_owned),
            samples: 0,
            span_s: None,
            message: message.into(),
        }
    }
}

/// Kinds of remarks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RemarkKind {
    /// A value was assumed.
    Assumed,
    /// A hole in the times.
    Gap,
    /// Steps that differ.
    UnevenSteps,
    /// Values that cannot be: reported, and left out of what follows.
    Impossible,
    /// The same reading again and again.
    Stuck,
    /// Readings at the end of the scale.
    Saturated,
    /// On or near the floor, or crashed.
    Touch,
    /// Throttle and power contradict each other, the metadata, or what an instrument is blamed for.
    Contradicted,
    /// Outside the range of the thrust map.
    OutOfRange,
    /// Rows for something that nothing here uses.
    Unused,
}
