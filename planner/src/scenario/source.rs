//! The text as a tree whose every value knows its place.
//!
//! ron reads the text; it is asked for one layer at a time, as raw values, so that reading goes on
//! after an error and every value keeps its byte range. All of the text has been read once before
//! any layer is opened: what fails later has the wrong shape, not the wrong syntax.

use std::fmt;
use std::ops::Range;

use ron::extensions::Extensions;
use ron::value::RawValue;
use serde::de::{Deserialize, DeserializeOwned, Deserializer, MapAccess, Visitor};

use super::problem::Problem;

/// One value of the text.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value<'t> {
    /// As typed, without the blanks and comments around it.
    pub(super) text: &'t str,
    /// Byte offset of `text` in the whole.
    pub(super) start: usize,
}

/// One `key: value`.
#[derive(Clone, Debug)]
pub(super) struct Pair<'t> {
    pub(super) key: &'t str,
    pub(super) key_at: Range<usize>,
    pub(super) value: Value<'t>,
}

/// Reads the whole text as one value.
pub(super) fn root(text: &str) -> Result<Value<'_>, Box<Problem>> {
    let body = text.strip_prefix('\u{feff}').unwrap_or(text);
    // First alone, because raw values cannot see the `#![enable(...)]` line that may come first.
    let raw = options()
        .from_str::<&RawValue>(body)
        .map_err(|error| syntax(text, body, &error))?;
    Ok(Value::of(text, raw))
}

impl<'t> Value<'t> {
    fn of(whole: &'t str, raw: &'t RawValue) -> Value<'t> {
        Value::within(whole, raw.get_ron(), raw)
    }

    fn within(whole: &'t str, typed: &'t str, raw: &'t RawValue) -> Value<'t> {
        // ron trims comments by reading the value again; most values have none.
        let text = if typed.contains("//") || typed.contains("/*") {
            raw.trim().get_ron()
        } else {
            typed.trim()
        };
        Value {
            text,
            start: text.as_ptr() as usize - whole.as_ptr() as usize,
        }
    }

    fn inner(&self, raw: &'t RawValue) -> Value<'t> {
        let inner = Value::within(self.text, raw.get_ron(), raw);
        Value {
            start: self.start + inner.start,
            ..inner
        }
    }

    /// Where it stands, in bytes of the whole text.
    pub(super) fn at(&self) -> Range<usize> {
        self.start..self.start + self.text.len()
    }

    /// Where it stands, or only the start of it where it goes over several lines.
    pub(super) fn head(&self) -> Range<usize> {
        let first = self.text.lines().next().unwrap_or(self.text).trim_end();
        self.start..self.start + first.len()
    }

    /// The value as a plain Rust value.
    pub(super) fn plain<T: DeserializeOwned>(&self) -> Option<T> {
        options().from_str(self.text).ok()
    }

    /// Strips `Some( )`; `None` for `None`.
    pub(super) fn given(self) -> Option<Value<'t>> {
        if !self.text.starts_with("Some") && !self.text.starts_with("None") {
            return Some(self);
        }
        match options().from_str::<Option<&RawValue>>(self.text) {
            Ok(Some(raw)) => Some(self.inner(raw)),
            Ok(None) => None,
            Err(_) => Some(self),
        }
    }

    /// The values of a list `[a, b]`.
    pub(super) fn items(&self) -> Option<Vec<Value<'t>>> {
        let raw: Vec<&'t RawValue> = options().from_str(self.text).ok()?;
        Some(raw.into_iter().map(|raw| self.inner(raw)).collect())
    }

    /// The values of a tuple `(a, b)`, however many there are.
    pub(super) fn tuple(&self) -> Option<Vec<Value<'t>>> {
        let Tuple(raw) = options().from_str(self.text).ok()?;
        Some(raw.into_iter().map(|raw| self.inner(raw)).collect())
    }

    /// The entries of a map `{ "a": b }`, repeated keys included.
    pub(super) fn entries(&self) -> Option<Vec<(Value<'t>, Value<'t>)>> {
        let Entries(raw) = options().from_str(self.text).ok()?;
        Some(
            raw.into_iter()
                .map(|(key, value)| (self.inner(key), self.inner(value)))
                .collect(),
        )
    }

    /// The fields of `(a: 1, b: 2)`, repeated keys included. The name before the bracket is optional.
    pub(super) fn pairs(&self, name: &'static str) -> Option<Vec<Pair<'t>>> {
        let mut deserializer =
            ron::Deserializer::from_str_with_options(self.text, &options()).ok()?;
        let visitor = RecordVisitor;
        let raw = deserializer.deserialize_struct(name, &[], visitor).ok()?;
        let pair = |(key, value): (&'t str, &'t RawValue)| {
            let from = self.start + (key.as_ptr() as usize - self.text.as_ptr() as usize);
            Pair {
                key,
                key_at: from..from + key.len(),
                value: self.inner(value),
            }
        };
        Some(raw.into_iter().map(pair).collect())
    }

    /// What it looks like, for messages.
    pub(super) fn kind(&self) -> &'static str {
        match self.text.chars().next() {
            Some('"') => "a text in quotes",
            Some('[') => "a list in square brackets",
            Some('{') => "a map in curly brackets",
            Some('(') => "something in round brackets",
            Some('0'..='9' | '-' | '+' | '.') => "a number",
            Some('\'') => "a character",
            _ => "a word",
        }
    }
}

fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}

struct Tuple<'t>(Vec<&'t RawValue>);
struct Entries<'t>(Vec<(&'t RawValue, &'t RawValue)>);
struct TupleVisitor;
struct EntriesVisitor;
struct RecordVisitor;

impl<'t> Deserialize<'t> for Tuple<'t> {
    fn deserialize<D: Deserializer<'t>>(deserializer: D) -> Result<Self, D::Error> {
        // ron takes as many as there are, whatever the length asked for.
        deserializer.deserialize_tuple(0, TupleVisitor).map(Tuple)
    }
}

impl<'t> Deserialize<'t> for Entries<'t> {
    fn deserialize<D: Deserializer<'t>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(EntriesVisitor).map(Entries)
    }
}

impl<'t> Visitor<'t> for TupleVisitor {
    type Value = Vec<&'t RawValue>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a tuple")
    }

    fn visit_seq<A: serde::de::SeqAccess<'t>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = seq.next_element()? {
            items.push(item);
        }
        Ok(items)
    }
}

impl<'t> Visitor<'t> for EntriesVisitor {
    type Value = Vec<(&'t RawValue, &'t RawValue)>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a map")
    }

    fn visit_map<A: MapAccess<'t>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut entries = Vec::new();
        while let Some(entry) = map.next_entry()? {
            entries.push(entry);
        }
        Ok(entries)
    }
}

impl<'t> Visitor<'t> for RecordVisitor {
    type Value = Vec<(&'t str, &'t RawValue)>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("named fields")
    }

    fn visit_map<A: MapAccess<'t>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut fields = Vec::new();
        while let Some(field) = map.next_entry()? {
            fields.push(field);
        }
        Ok(fields)
    }
}

fn syntax(text: &str, body: &str, error: &ron::error::SpannedError) -> Box<Problem> {
    let shift = text.len() - body.len();
    let start = shift + offset(body, error.span.start);
    let end = (shift + offset(body, error.span.end)).max(start);
    if text.trim().is_empty() {
        return Box::new(Problem {
            message: "the text is empty".to_owned(),
            ..Problem::default()
        });
    }
    if text[start..].trim().is_empty() {
        let last = text.trim_end().len();
        let end_of_text =
            last.saturating_sub(text[..last].chars().next_back().map_or(0, char::len_utf8))..last;
        let problem = Problem::at(&end_of_text, "the text ends too early");
        return Box::new(match open_bracket(text) {
            Some((at, bracket)) => problem.label(format!(
                "the `{bracket}` of line {} is still open here",
                line(text, at)
            )),
            None => problem.label("something is missing after this"),
        });
    }
    let reason = error.code.to_string();
    let mut letters = reason.chars();
    let reason: String = letters
        .next()
        .map(|first| first.to_lowercase().chain(letters).collect())
        .unwrap_or_default();
    // A bracket that closes another than the innermost one: say which that is.
    let closing = text[start..]
        .chars()
        .next()
        .and_then(|letter| match letter {
            ')' => Some('('),
            ']' => Some('['),
            '}' => Some('{'),
            _ => None,
        });
    let reason = match (closing, open_bracket(&text[..start])) {
        (Some(opening), Some((at, bracket))) if bracket != opening => {
            format!(
                "the `{bracket}` of line {} is still open here",
                line(text, at)
            )
        }
        _ => reason,
    };
    // ron points behind a character; a person looks for something to see.
    let width = text[start..].chars().next().map_or(0, char::len_utf8);
    Box::new(Problem::at(&(start..end.max(start + width)), "this is not RON").label(reason))
}

/// Line of a byte offset, from 1.
pub(super) fn line(text: &str, at: usize) -> usize {
    1 + text.as_bytes()[..at.min(text.len())]
        .iter()
        .filter(|byte| **byte == b'\n')
        .count()
}

/// Byte offset of a position that ron counts in characters, from 1.
fn offset(text: &str, position: ron::error::Position) -> usize {
    let before: usize = text
        .split_inclusive('\n')
        .take(position.line.saturating_sub(1))
        .map(str::len)
        .sum();
    let column = position.col.saturating_sub(1);
    let line = &text[before..];
    before
        + line
            .char_indices()
            .nth(column)
            .map_or(line.len(), |(at, _)| at)
}

/// The innermost bracket that is never closed, outside texts and comments.
fn open_bracket(text: &str) -> Option<(usize, char)> {
    let mut open = Vec::new();
    let mut letters = text.char_indices().peekable();
    while let Some((at, letter)) = letters.next() {
        match letter {
            '(' | '[' | '{' => open.push((at, letter)),
            ')' | ']' | '}' => {
                open.pop();
            }
            '"' => {
                while let Some((_, inside)) = letters.next() {
                    match inside {
                        '\\' => {
                            letters.next();
                        }
                        '"' => break,
                        _ => {}
                    }
                }
            }
            '/' if matches!(letters.peek(), Some((_, '/'))) => {
                letters.by_ref().find(|(_, inside)| *inside == '\n');
            }
            _ => {}
        }
    }
    open.pop()
}
