//! JSON as it was written: which keys stand in it twice.

use std::fmt;

use planner::form::MOST_FAULTS;
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

/// A key that an object has twice or more often, after its place.
type Repeated = (String, String);

/// Reads a text, and all keys that an object has twice, each once: the first [`MOST_FAULTS`] of
/// them.
pub(crate) fn read(text: &str) -> Result<(Value, Vec<Repeated>), serde_json::Error> {
    let mut repeated = Vec::new();
    let mut reader = serde_json::Deserializer::from_str(text);
    let whole = Reading {
        place: &JsonPath::Whole,
        repeated: &mut repeated,
    };
    let value = whole.deserialize(&mut reader)?;
    reader.end()?;
    Ok((value, repeated))
}

/// Where a value stands.
enum JsonPath<'a> {
    Whole,
    Key(&'a JsonPath<'a>, &'a str),
    Item(&'a JsonPath<'a>, usize),
}

impl fmt::Display for JsonPath<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            JsonPath::Whole => Ok(()),
            JsonPath::Key(JsonPath::Whole, key) => f.write_str(key),
            JsonPath::Key(of, key) => write!(f, "{of}.{key}"),
            JsonPath::Item(of, index) => write!(f, "{of}[{index}]"),
        }
    }
}

/// A value that is being read.
struct Reading<'a> {
    place: &'a JsonPath<'a>,
    repeated: &'a mut Vec<Repeated>,
}

impl<'de> DeserializeSeed<'de> for Reading<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, reader: D) -> Result<Value, D::Error> {
        reader.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Reading<'_> {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("any value of JSON")
    }

    fn visit_unit<E: Error>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E: Error>(self, given: bool) -> Result<Value, E> {
        Ok(Value::Bool(given))
    }

    fn visit_u64<E: Error>(self, given: u64) -> Result<Value, E> {
        Ok(given.into())
    }

    fn visit_i64<E: Error>(self, given: i64) -> Result<Value, E> {
        Ok(given.into())
    }

    fn visit_f64<E: Error>(self, given: f64) -> Result<Value, E> {
        Ok(Number::from_f64(given).map_or(Value::Null, Value::Number))
    }

    fn visit_str<E: Error>(self, given: &str) -> Result<Value, E> {
        Ok(given.into())
    }

    fn visit_string<E: Error>(self, given: String) -> Result<Value, E> {
        Ok(Value::String(given))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut read = Vec::new();
        loop {
            let place = &JsonPath::Item(self.place, read.len());
            let repeated = &mut *self.repeated;
            match items.next_element_seed(Reading { place, repeated })? {
                Some(item) => read.push(item),
                None => return Ok(Value::Array(read)),
            }
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, mut fields: A) -> Result<Value, A::Error> {
        let mut read = Map::new();
        while let Some(key) = fields.next_key::<String>()? {
            let place = &JsonPath::Key(self.place, &key);
            if read.contains_key(&key) && self.repeated.len() < MOST_FAULTS {
                let known = (place.to_string(), key.clone());
                if !self.repeated.contains(&known) {
                    self.repeated.push(known);
                }
            }
            let repeated = &mut *self.repeated;
            let value = fields.next_value_seed(Reading { place, repeated })?;
            read.insert(key, value);
        }
        Ok(Value::Object(read))
    }
}
