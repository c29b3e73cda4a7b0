//! Fields of a JSON object, each fault at its path (`vehicles.v0.mass_kg`), all of them at once.

use std::collections::BTreeSet;

use serde_json::{Map, Value};

use super::found::{Found, did_you_mean, listed};
use crate::record::problem::Problem;
use crate::record::remark::RemarkKind;

/// An object whose keys are checked off as they are read.
pub(super) struct Fields<'a> {
    file: &'a str,
    path: String,
    map: &'a Map<String, Value>,
    known: BTreeSet<&'static str>,
}

impl<'a> Fields<'a> {
    /// The whole file.
    pub(super) fn root(file: &'a str, value: &'a Value, found: &mut Found) -> Option<Fields<'a>> {
        Fields::of(file, String::new(), value, found)
    }

    fn of(file: &'a str, path: String, value: &'a Value, found: &mut Found) -> Option<Fields<'a>> {
        let Some(map) = value.as_object() else {
            let place = match path.as_str() {
                "" => Problem::file(file),
                path => Problem::field(file, path),
            };
            let message = format!("must be an object `{{...}}`, not {}", kind(value));
            found.problem(place, message);
            return None;
        };
        Some(Fields {
            file,
            path,
            map,
            known: BTreeSet::new(),
        })
    }

    fn path_of(&self, key: &str) -> String {
        match self.path.as_str() {
            "" => key.to_owned(),
            path => format!("{path}.{key}"),
        }
    }

    /// A value that is there and not null.
    fn value(&mut self, key: &'static str) -> Option<&'a Value> {
        self.known.insert(key);
        self.map.get(key).filter(|value| !value.is_null())
    }

    fn required(&mut self, key: &'static str, found: &mut Found) -> Option<&'a Value> {
        let value = self.value(key);
        if value.is_none() {
            let similar = did_you_mean(key, self.map.keys().map(String::as_str));
            let path = self.path_of(key);
            found.helped(Problem::field(self.file, &path), "is missing", similar);
        }
        value
    }

    /// Says what is wrong with the value of a key.
    pub(super) fn fault(&self, key: &str, message: impl Into<String>, found: &mut Found) {
        found.problem(Problem::field(self.file, &self.path_of(key)), message);
    }

    pub(super) fn object(&mut self, key: &'static str, found: &mut Found) -> Option<Fields<'a>> {
        let value = self.required(key, found)?;
        Fields::of(self.file, self.path_of(key), value, found)
    }

    /// Every key with its object, sorted by key: the order of a JSON map depends on how the reader
    /// was built.
    pub(super) fn objects(
        &mut self,
        key: &'static str,
        found: &mut Found,
    ) -> Vec<(&'a str, Fields<'a>)> {
        let Some(all) = self.object(key, found) else {
            return Vec::new();
        };
        let of = |(name, value): (&'a String, &'a Value)| {
            let fields = Fields::of(all.file, all.path_of(name), value, found)?;
            Some((name.as_str(), fields))
        };
        let mut objects: Vec<_> = all.map.iter().filter_map(of).collect();
        objects.sort_by_key(|(name, _)| *name);
        objects
    }

    /// The value of a key that must be there.
    fn get<T>(
        &mut self,
        key: &'static str,
        (what, held): Held<'a, T>,
        found: &mut Found,
    ) -> Option<T> {
        let value = self.required(key, found)?;
        let meant = held(value);
        if meant.is_none() {
            let message = format!("must be {what}, not {}", kind(value));
            self.fault(key, message, found);
        }
        meant
    }

    pub(super) fn number(&mut self, key: &'static str, found: &mut Found) -> Option<f64> {
        self.get(key, ("a number", Value::as_f64), found)
    }

    /// A number that may be left out or null.
    pub(super) fn optional_number(&mut self, key: &'static str, found: &mut Found) -> Option<f64> {
        self.value(key)?;
        self.number(key, found)
    }

    pub(super) fn text(&mut self, key: &'static str, found: &mut Found) -> Option<&'a str> {
        self.get(key, ("a text", Value::as_str), found)
    }

    pub(super) fn flag(&mut self, key: &'static str, found: &mut Found) -> Option<bool> {
        self.get(key, ("true or false", Value::as_bool), found)
    }

    pub(super) fn texts(&mut self, key: &'static str, found: &mut Found) -> Option<Vec<String>> {
        let texts = |value: &Value| {
            let text = |item: &Value| item.as_str().map(str::to_owned);
            value.as_array()?.iter().map(text).collect()
        };
        self.get(key, ("a list of texts", texts), found)
    }

    /// A number that must be above 0.
    pub(super) fn positive(&mut self, key: &'static str, found: &mut Found) -> Option<f64> {
        let number = self.number(key, found)?;
        if number <= 0.0 {
            self.fault(key, format!("is {number}; it must be above 0"), found);
        }
        Some(number)
    }

    /// A number that must not be below 0.
    pub(super) fn not_negative(&mut self, key: &'static str, found: &mut Found) -> Option<f64> {
        let number = self.number(key, found)?;
        if number < 0.0 {
            self.fault(key, format!("is {number}; it must be 0 or more"), found);
        }
        Some(number)
    }

    /// One of some words, by what it means.
    pub(super) fn word<T: Copy>(
        &mut self,
        key: &'static str,
        words: &[(&str, T)],
        found: &mut Found,
    ) -> Option<T> {
        let text = self.text(key, found)?;
        let meant = words.iter().find(|(word, _)| *word == text);
        if meant.is_none() {
            let known = listed(words.iter().map(|(word, _)| *word));
            let message = format!("is \"{text}\"; it must be one of {known}");
            self.fault(key, message, found);
        }
        meant.map(|(_, meaning)| *meaning)
    }

    /// Whether the key is there.
    pub(super) fn has(&self, key: &str) -> bool {
        self.map.get(key).is_some_and(|value| !value.is_null())
    }

    /// Remarks on the keys that were not read.
    pub(super) fn finish(&self, found: &mut Found) {
        let unread = self.map.keys();
        for key in unread.filter(|key| !self.known.contains(key.as_str())) {
            let message = format!("`{}` of {} is not used", self.path_of(key), self.file);
            found.remark(RemarkKind::Unused, None, message);
        }
    }
}

/// What a key may hold: in words, and how it is read; `None` where a value is something else.
type Held<'a, T> = (&'static str, fn(&'a Value) -> Option<T>);

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}
