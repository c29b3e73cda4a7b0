//! The text as a tree whose every value knows its place.
//!
//! ron judges the syntax of the whole text first, and every number, word and text later. In between
//! the text is cut at its brackets, commas and colons here, because ron stops at its first error
//! and keeps no places: raw values would, but re-reading each layer through them took 0.7 s for
//! 5000 drones.

use std::ops::Range;

use ron::extensions::Extensions;
use serde::de::{Deserialize, DeserializeOwned, IgnoredAny};

use super::problem::Problem;
use super::tokens::{Token, Tokens};

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
    /// As typed, before the colon.
    pub(super) key: &'t str,
    /// In bytes of the whole text.
    pub(super) key_at: Range<usize>,
    /// Behind the colon.
    pub(super) value: Value<'t>,
}

/// Reads the whole text as one value. ron judges its syntax; what it accepts is only cut up below.
pub(super) fn root(text: &str) -> Result<Value<'_>, Box<Problem>> {
    let body = text.strip_prefix('\u{feff}').unwrap_or(text);
    let options = options();
    let mut reader = ron::Deserializer::from_str_with_options(body, &options)
        .map_err(|error| syntax(text, body, &error))?;
    let read = IgnoredAny::deserialize(&mut reader).and_then(|_| reader.end());
    read.map_err(|error| syntax(text, body, &reader.span_error(error)))?;
    // Behind the `#![enable(...)]` lines that may come first.
    let mut tokens = Tokens::of(body).peekable();
    while tokens
        .peek()
        .is_some_and(|token| body.as_bytes()[token.at] == b'#')
    {
        tokens
            .by_ref()
            .find(|token| body.as_bytes()[token.at] == b']');
    }
    let (first, last) = (tokens.next(), tokens.last());
    let (start, end) = match (first, last) {
        (Some(first), last) => (first.at, last.map_or(first.end, |last| last.end)),
        (None, _) => (0, body.len()),
    };
    Ok(Value {
        text: &body[start..end],
        start: text.len() - body.len() + start,
    })
}

/// A scenario's text with a number in place of what one of its sections says for a key, or added
/// there. A text that is no record is left as it is: reading it says what is wrong.
#[must_use]
pub fn with_setting(text: &str, (section, key): (&str, &str), value: f64) -> String {
    let mut changed = text.to_owned();
    let Ok(whole) = root(text) else {
        return changed;
    };
    let Some(sections) = whole.pairs("Scenario") else {
        return changed;
    };
    let known = sections.iter().find(|it| it.key == section);
    let record = known.and_then(|it| it.value.given());
    let fields = record.and_then(|it| it.pairs(it.name()));
    let field = fields
        .iter()
        .flatten()
        .find(|it| it.key == key)
        .map(|it| it.value.at());
    match (known, record, field) {
        (_, _, Some(at)) => changed.replace_range(at, &value.to_string()),
        (_, Some(record), None) => {
            changed.insert_str(record.inside(), &format!("{key}: {value}, "));
        }
        (Some(none), None, None) => {
            changed.replace_range(none.value.at(), &format!("({key}: {value})"));
        }
        (None, None, None) => {
            changed.insert_str(whole.inside(), &format!("{section}: ({key}: {value}), "));
        }
    }
    changed
}

impl<'t> Value<'t> {
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
        match self.text.strip_prefix("Some") {
            Some(rest) if rest.trim_start().starts_with('(') => match self.parts('(').as_slice() {
                [
                    Element {
                        colon: None, after, ..
                    },
                ] => Some(self.cut(after)),
                _ => Some(self),
            },
            _ => (self.text != "None").then_some(self),
        }
    }

    /// The values of a list `[a, b]`.
    pub(super) fn items(&self) -> Option<Vec<Value<'t>>> {
        let parts = self.text.starts_with('[').then(|| self.parts('['))?;
        Some(parts.iter().map(|part| self.cut(&part.after)).collect())
    }

    /// The values of a tuple `(a, b)`, however many there are.
    pub(super) fn tuple(&self) -> Option<Vec<Value<'t>>> {
        let parts = self.text.starts_with('(').then(|| self.parts('('))?;
        let value = |part: &Element| part.colon.is_none().then(|| self.cut(&part.after));
        parts.iter().map(value).collect()
    }

    /// The entries of a map `{ "a": b }`, repeated keys included.
    pub(super) fn entries(&self) -> Option<Vec<(Value<'t>, Value<'t>)>> {
        let parts = self.text.starts_with('{').then(|| self.parts('{'))?;
        let entry = |part: &Element| (self.cut(&part.before), self.cut(&part.after));
        Some(parts.iter().map(entry).collect())
    }

    /// The fields of `(a: 1, b: 2)`, repeated keys included. The name before the bracket is
    /// optional.
    pub(super) fn pairs(&self, name: &str) -> Option<Vec<Pair<'t>>> {
        let typed = self.name();
        if !self.text.ends_with(')') || (!typed.is_empty() && typed != name) {
            return None;
        }
        let pair = |part: &Element| {
            let (key, value) = (self.cut(&part.before), self.cut(&part.after));
            part.colon.map(|_| Pair {
                key: key.text,
                key_at: key.at(),
                value,
            })
        };
        self.parts('(').iter().map(pair).collect()
    }

    /// What is typed before its bracket.
    fn name(&self) -> &'t str {
        let typed = self.text.split(['(', '/']).next();
        typed.unwrap_or_default().trim_end()
    }

    /// Behind its first round bracket, in bytes of the whole text; its start without one.
    fn inside(&self) -> usize {
        let mut tokens = Tokens::of(self.text);
        let open = tokens.find(|it| self.text.as_bytes()[it.at] == b'(');
        self.start + open.map_or(0, |it| it.end)
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

    /// A part of this value, by bytes of its own text.
    fn cut(&self, range: &Range<usize>) -> Value<'t> {
        Value {
            text: &self.text[range.clone()],
            start: self.start + range.start,
        }
    }

    /// What stands between the commas of its outermost bracket, without blanks and comments around.
    fn parts(&self, bracket: char) -> Vec<Element> {
        let mut parts = Vec::new();
        let mut part = Element::default();
        let mut depth = 0;
        for Token { at, end } in Tokens::of(self.text) {
            let letter = self.text.as_bytes()[at];
            match letter {
                b'(' | b'[' | b'{' if depth == 0 => {
                    depth = usize::from(char::from(letter) == bracket);
                    continue;
                }
                b'(' | b'[' | b'{' => depth += 1,
                b')' | b']' | b'}' => {
                    depth = depth.saturating_sub(1);
                    if depth == 0 {
                        break;
                    }
                }
                b',' if depth == 1 => {
                    parts.push(std::mem::take(&mut part));
                    continue;
                }
                b':' if depth == 1 && part.colon.is_none() => {
                    part.colon = Some(at);
                    part.before = std::mem::take(&mut part.after);
                    continue;
                }
                _ if depth == 0 => continue,
                _ => {}
            }
            if part.after.is_empty() {
                part.after.start = at;
            }
            part.after.end = end;
        }
        parts.push(part);
        // A comma may stand behind the last one.
        parts.retain(|part| part.colon.is_some() || !part.after.is_empty());
        parts
    }
}

/// What stands between two commas: `before: after`, or only `after`. Ranges are empty where there
/// is nothing.
#[derive(Debug, Default)]
struct Element {
    /// Where the colon stands, in bytes of the bracket's text.
    colon: Option<usize>,
    /// Before the colon.
    before: Range<usize>,
    /// Behind it; without a colon the whole of it.
    after: Range<usize>,
}

/// How every value is read: `Some( )` may be left out.
fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}

/// ron's error in words for a person, at a place with something to see.
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
    let still_open = |at: usize, bracket: char| {
        let line = line(text, at);
        format!("the `{bracket}` of line {line} is still open here")
    };
    if text[start..].trim().is_empty() {
        let last = text.trim_end().len();
        let end_of_text =
            last.saturating_sub(text[..last].chars().next_back().map_or(0, char::len_utf8))..last;
        let problem = Problem::at(&end_of_text, "the text ends too early");
        return Box::new(match open_bracket(text) {
            Some((at, bracket)) => problem.label(still_open(at, bracket)),
            None => problem.label("something is missing after this"),
        });
    }
    let reason = error.code.to_string();
    let mut letters = reason.chars();
    let first = letters.next().into_iter().flat_map(char::to_lowercase);
    let reason: String = first.chain(letters).collect();
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
        (Some(opening), Some((at, bracket))) if bracket != opening => still_open(at, bracket),
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
    let within = line.char_indices().nth(column);
    before + within.map_or(line.len(), |(at, _)| at)
}

/// The innermost bracket that is never closed, outside texts and comments.
fn open_bracket(text: &str) -> Option<(usize, char)> {
    let mut open = Vec::new();
    for Token { at, .. } in Tokens::of(text) {
        match text.as_bytes()[at] {
            bracket @ (b'(' | b'[' | b'{') => open.push((at, char::from(bracket))),
            b')' | b']' | b'}' => {
                open.pop();
            }
            _ => {}
        }
    }
    open.pop()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_is_replaced_where_it_stands_and_added_where_it_does_not() {
        let text = r#"Scenario(name: "planning: (air_limit: 9)", // planning: (air_limit: 8)
            drones: [(air_limit: 0.2, tasks: [(to_m: (1, 2, 3))])],
            planning: (cell_m: 1, air_limit: 0.3 /* alpha */, seed: 0))"#;
        let changed = with_setting(text, ("planning", "air_limit"), 0.45);
        assert_eq!(
            changed,
            text.replace("air_limit: 0.3 /* alpha */", "air_limit: 0.45 /* alpha */")
        );
        let added = with_setting(text, ("planning", "clearance_m"), 0.2);
        assert!(
            added.contains("planning: (clearance_m: 0.2, cell_m: 1"),
            "{added}"
        );
        let new = with_setting(text, ("air", "temperature_c"), 30.0);
        assert!(
            new.starts_with("Scenario(air: (temperature_c: 30), name:"),
            "{new}"
        );
        let wrapped = text
            .replace("planning: (", "planning: Some(Planning(")
            .replace("seed: 0))", "seed: 0)))");
        let changed = with_setting(&wrapped, ("planning", "air_limit"), 0.45);
        assert_eq!(
            changed,
            wrapped.replace("air_limit: 0.3 /* alpha */", "air_limit: 0.45 /* alpha */")
        );
        let none = with_setting("Scenario(air: None)", ("air", "temperature_c"), 30.0);
        assert_eq!(none, "Scenario(air: (temperature_c: 30))");
    }
}
