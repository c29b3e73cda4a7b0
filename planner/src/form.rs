//! JSON held against the schema of what it is to be: each field that is not so, at its place, in
//! words for the one who wrote it. Readers of [`crate::plan::file`] and of messages share it.
//!
//! It knows what schemars writes for plain types: references, texts, numbers with ranges, lists,
//! objects, maps, choices of texts, and objects whose one key says which of several they are.

use std::fmt;

use serde_json::{Map, Value};

/// Faults that are told of one text: chosen here, a screen's worth.
pub const MOST_FAULTS: usize = 20;
/// Characters of a value that are repeated: chosen here, so that a line stays one.
const MOST_SHOWN: usize = 40;

/// A field that is not as its schema says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldFault {
    /// Where: `params.changes[0].late.by_s`.
    pub place: String,
    /// The last part of the place; empty: the whole text.
    pub name: String,
    /// How it is at fault.
    pub kind: FieldFaultKind,
    /// What it may be, and what it is.
    pub what: String,
}

impl fmt::Display for FieldFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.name[..] {
            "" => f.write_str(&self.what),
            name => write!(f, "`{name}`: {}", self.what),
        }
    }
}

/// How a field is at fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldFaultKind {
    /// It has to be there.
    Missing,
    /// There is none such.
    Unknown,
    /// It is of another kind.
    Kind,
    /// A number outside its range.
    Range,
}

/// All that is wrong with a value at a place, at most [`MOST_FAULTS`]. `whole` is a schema with its
/// `$defs`, `part` the part of it that the value is to be.
pub fn faults(whole: &Value, part: &Value, value: &Value, place: &str) -> Vec<FieldFault> {
    let name = place.rsplit('.').next().unwrap_or(place).to_owned();
    let place = ValuePath {
        path: place.to_owned(),
        name,
    };
    let mut reader = Reader {
        whole,
        found: Vec::new(),
    };
    reader.hold(part, value, &place);
    reader.found
}

/// Where a value stands.
struct ValuePath {
    path: String,
    /// Its last part.
    name: String,
}

impl ValuePath {
    fn key(&self, name: &str) -> ValuePath {
        let path = match &self.path[..] {
            "" => name.to_owned(),
            path => format!("{path}.{name}"),
        };
        ValuePath {
            path,
            name: name.to_owned(),
        }
    }

    fn item(&self, index: usize) -> ValuePath {
        ValuePath {
            path: format!("{}[{index}]", self.path),
            name: format!("{}[{index}]", self.name),
        }
    }
}

struct Reader<'a> {
    whole: &'a Value,
    found: Vec<FieldFault>,
}

impl<'a> Reader<'a> {
    fn fault(&mut self, kind: FieldFaultKind, place: &ValuePath, what: fmt::Arguments<'_>) {
        if self.found.len() < MOST_FAULTS {
            self.found.push(FieldFault {
                place: place.path.clone(),
                name: place.name.clone(),
                kind,
                what: what.to_string(),
            });
        }
    }

    fn is_of_another_kind(&mut self, part: &Value, value: &Value, place: &ValuePath) {
        let (wanted, given) = (self.wanted(part), shown(value));
        let what = format_args!("{wanted}, not {given}");
        self.fault(FieldFaultKind::Kind, place, what);
    }

    /// A part, or what it refers to.
    fn followed(&self, part: &'a Value) -> &'a Value {
        let name = part["$ref"].as_str();
        match name.and_then(|it| it.strip_prefix("#/$defs/")) {
            Some(name) => self.followed(&self.whole["$defs"][name]),
            None => part,
        }
    }

    fn hold(&mut self, part: &'a Value, value: &Value, place: &ValuePath) {
        if self.found.len() >= MOST_FAULTS {
            return;
        }
        let part = self.followed(part);
        if let Some(branches) = part["anyOf"].as_array() {
            let fitting = branches.iter().filter(|it| self.is_of_kind(it, value));
            // Of several it is meant to be the one that it is most like.
            match fitting.min_by_key(|it| self.faults_as(it, value)) {
                Some(branch) => self.hold(branch, value, place),
                None => self.is_of_another_kind(part, value, place),
            }
        } else if !self.is_of_kind(part, value) {
            self.is_of_another_kind(part, value, place);
        } else if let Some(branches) = part["oneOf"].as_array() {
            self.hold_one_of(branches, value, place);
        } else {
            match value {
                Value::Number(number) => {
                    let [low, high] = ends(part);
                    let is_low = |it: f64| low.is_some_and(|low| it < low);
                    let is_high = |it: f64| high.is_some_and(|high| it > high);
                    if number.as_f64().is_some_and(|it| is_low(it) || is_high(it)) {
                        let (wanted, given) = (self.wanted(part), shown(value));
                        let what = format_args!("{wanted}, not {given}");
                        self.fault(FieldFaultKind::Range, place, what);
                    }
                }
                Value::Array(items) => {
                    for (index, item) in items.iter().enumerate() {
                        self.hold(&part["items"], item, &place.item(index));
                    }
                }
                Value::Object(fields) => self.hold_fields(part, fields, place),
                Value::Null | Value::Bool(_) | Value::String(_) => {}
            }
        }
    }

    /// How many faults a value would have.
    fn faults_as(&self, part: &'a Value, value: &Value) -> usize {
        let mut reader = Reader {
            whole: self.whole,
            found: Vec::new(),
        };
        let place = ValuePath {
            path: String::new(),
            name: String::new(),
        };
        reader.hold(part, value, &place);
        reader.found.len()
    }

    fn hold_fields(&mut self, part: &'a Value, fields: &Map<String, Value>, place: &ValuePath) {
        let none = Map::new();
        let known = part["properties"].as_object().unwrap_or(&none);
        let others = &part["additionalProperties"];
        for (name, value) in fields {
            match part["properties"].get(name) {
                Some(field) => self.hold(field, value, &place.key(name)),
                None if others.is_object() => self.hold(others, value, &place.key(name)),
                None if *others == Value::Bool(false) => {
                    let there = names(known.keys());
                    let what = format_args!("no such field, there are {there}");
                    self.fault(FieldFaultKind::Unknown, &place.key(name), what);
                }
                None => {}
            }
        }
        for name in texts(&part["required"]) {
            if !fields.contains_key(name) {
                let wanted = self.wanted(&part["properties"][name]);
                let what = format_args!("missing: {wanted}");
                self.fault(FieldFaultKind::Missing, &place.key(name), what);
            }
        }
    }

    /// An object whose one key says which it is.
    fn hold_one_of(&mut self, branches: &'a [Value], value: &Value, place: &ValuePath) {
        let Some(fields) = value.as_object() else {
            return;
        };
        for (name, value) in fields {
            let mut fitting = branches.iter().map(|it| &it["properties"][name]);
            match fitting.find(|it| !it.is_null()) {
                Some(field) => self.hold(field, value, &place.key(name)),
                None => {
                    let there = names(keys_of(branches));
                    let what = format_args!("no such field, there are {there}");
                    self.fault(FieldFaultKind::Unknown, &place.key(name), what);
                }
            }
        }
    }

    /// Whether a value is of the kind of a part, whatever is in it.
    fn is_of_kind(&self, part: &'a Value, value: &Value) -> bool {
        let part = self.followed(part);
        if let Some(branches) = part["anyOf"].as_array() {
            return branches.iter().any(|it| self.is_of_kind(it, value));
        }
        if let Some(branches) = part["oneOf"].as_array() {
            return match value {
                Value::Object(fields) => fields.len() == 1 && keys_of(branches).next().is_some(),
                _ => (branches.iter())
                    .filter(|it| it["type"] != "object")
                    .any(|it| self.is_of_kind(it, value)),
            };
        }
        if let Some(constant) = part.get("const") {
            return constant == value;
        }
        if let Some(choices) = part["enum"].as_array() {
            return choices.contains(value);
        }
        let types = match &part["type"] {
            Value::String(one) => vec![&one[..]],
            several => texts(several).collect(),
        };
        // A part without a type takes everything.
        types.is_empty() || types.into_iter().any(|it| is_of_type(it, part, value))
    }

    /// What a part may be, in words.
    fn wanted(&self, part: &'a Value) -> String {
        let part = self.followed(part);
        if let Some(branches) = part["anyOf"].as_array() {
            let several = branches.iter().filter(|it| it["type"] != "null");
            let several: Vec<String> = several.map(|it| self.wanted(it)).collect();
            return several.join(" or ");
        }
        if let Some(branches) = part["oneOf"].as_array() {
            let plain = branches.iter().filter(|it| it["type"] != "object");
            let mut several: Vec<String> = plain.map(|it| self.wanted(it)).collect();
            let keys = names(keys_of(branches));
            if !keys.is_empty() {
                several.push(format!("an object with one of {keys}"));
            }
            return several.join(" or ");
        }
        if let Some(constant) = part.get("const") {
            return constant.to_string();
        }
        if let Some(choices) = part["enum"].as_array() {
            let choices: Vec<String> = choices.iter().map(Value::to_string).collect();
            return choices.join(" or ");
        }
        let mut types = match &part["type"] {
            Value::String(one) => vec![&one[..]],
            several => texts(several).collect(),
        };
        types.retain(|it| *it != "null");
        let one = |it: &&str| match *it {
            "string" => "a text".to_owned(),
            "boolean" => "true or false".to_owned(),
            "integer" => format!("a whole number{}", range(part)),
            "number" => format!("a number{}", range(part)),
            "array" => match fixed_count(part) {
                Some(count) => format!("a list of {count}, each {}", self.wanted(&part["items"])),
                None => "a list".to_owned(),
            },
            _ => match &names(texts(&part["required"]))[..] {
                "" => "an object".to_owned(),
                required => format!("an object with {required}"),
            },
        };
        let several: Vec<String> = types.iter().map(one).collect();
        several.join(" or ")
    }
}

fn is_of_type(name: &str, part: &Value, value: &Value) -> bool {
    match name {
        "null" => value.is_null(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64() && part["format"] != "int64",
        "array" => {
            let count = value.as_array().map(Vec::len);
            count.is_some_and(|it| fixed_count(part).is_none_or(|wanted| it as u64 == wanted))
        }
        _ => value.is_object(),
    }
}

fn fixed_count(part: &Value) -> Option<u64> {
    let (low, high) = (part["minItems"].as_u64(), part["maxItems"].as_u64());
    low.filter(|_| low == high)
}

fn range(part: &Value) -> String {
    match ends(part) {
        [Some(low), Some(high)] => format!(" from {low} to {high}"),
        [Some(low), None] => format!(" from {low} on"),
        [None, Some(high)] => format!(" up to {high}"),
        [None, None] => String::new(),
    }
}

fn ends(part: &Value) -> [Option<f64>; 2] {
    let widest = (part["format"] == "uint32").then_some(f64::from(u32::MAX));
    let highest = part["maximum"].as_f64();
    [part["minimum"].as_f64(), highest.or(widest)]
}

fn texts(list: &Value) -> impl Iterator<Item = &str> {
    let items = list.as_array().into_iter().flatten();
    items.filter_map(Value::as_str)
}

/// The keys that say which of several an object is.
fn keys_of(branches: &[Value]) -> impl Iterator<Item = &str> {
    let keys = branches
        .iter()
        .filter_map(|it| it["properties"].as_object());
    keys.flat_map(Map::keys).map(String::as_str)
}

fn names(all: impl Iterator<Item = impl AsRef<str>>) -> String {
    let all: Vec<String> = all.map(|it| it.as_ref().to_owned()).collect();
    all.join(", ")
}

/// A value as it is repeated in a message.
fn shown(value: &Value) -> String {
    match value {
        Value::Object(fields) if fields.len() > 1 => "an object with other keys".to_owned(),
        Value::Array(items) => format!("a list of {}", items.len()),
        value => {
            let text = value.to_string();
            match text.char_indices().nth(MOST_SHOWN) {
                Some((end, _)) => format!("{}...", &text[..end]),
                None => text,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use schemars::JsonSchema;
    use serde_json::{Value, json};

    use super::{FieldFaultKind, faults};

    #[derive(JsonSchema)]
    #[schemars(deny_unknown_fields)]
    #[expect(dead_code, reason = "for the schema alone")]
    struct Leg {
        #[schemars(inner(range(min = -10, max = 10)))]
        to_m: [f64; 3],
        #[schemars(range(min = 0, max = 5))]
        #[schemars(default)]
        dwell_s: Option<f64>,
        count: u32,
        how: How,
        #[schemars(default)]
        name: Named,
    }

    #[derive(JsonSchema)]
    #[schemars(rename_all = "snake_case")]
    #[expect(dead_code, reason = "for the schema alone")]
    enum How {
        Slow(Slow),
        Fast(Slow),
        Still,
    }

    #[derive(JsonSchema)]
    #[schemars(deny_unknown_fields)]
    #[expect(dead_code, reason = "for the schema alone")]
    struct Slow {
        by: f64,
    }

    #[derive(Default, JsonSchema)]
    #[schemars(untagged)]
    #[expect(dead_code, reason = "for the schema alone")]
    enum Named {
        Number(i64),
        Text(String),
        #[default]
        None,
    }

    fn told(value: &Value) -> Vec<(String, FieldFaultKind, String)> {
        let schema = schemars::schema_for!(Leg);
        let found = faults(schema.as_value(), schema.as_value(), value, "leg");
        let found = found.into_iter();
        found
            .map(|it| (it.place.clone(), it.kind, it.to_string()))
            .collect()
    }

    #[test]
    fn each_field_at_fault_is_reported_in_its_own_words_and_nothing_else_is() {
        let good = json!({
            "to_m": [1, 2.5, -10], "dwell_s": null, "count": 3, "how": {"slow": {"by": 1}},
            "name": "k1",
        });
        assert_eq!(told(&good), []);
        let still = json!({"to_m": [1, 2, 3], "count": 0, "how": "still", "name": 7});
        assert_eq!(told(&still), []);
        let bad = json!({
            "to_m": [1, "2", 11], "dwell_s": -1, "count": 2.5, "how": {"slow": {"bye": 1}},
            "name": [], "more": 1,
        });
        let wanted = [
            (
                "leg.to_m[1]",
                FieldFaultKind::Kind,
                "`to_m[1]`: a number from -10 to 10, not \"2\"",
            ),
            (
                "leg.to_m[2]",
                FieldFaultKind::Range,
                "`to_m[2]`: a number from -10 to 10, not 11",
            ),
            (
                "leg.dwell_s",
                FieldFaultKind::Range,
                "`dwell_s`: a number from 0 to 5, not -1",
            ),
            (
                "leg.count",
                FieldFaultKind::Kind,
                "`count`: a whole number from 0 to 4294967295, not 2.5",
            ),
            (
                "leg.how.slow.bye",
                FieldFaultKind::Unknown,
                "`bye`: no such field, there are by",
            ),
            (
                "leg.how.slow.by",
                FieldFaultKind::Missing,
                "`by`: missing: a number",
            ),
            (
                "leg.name",
                FieldFaultKind::Kind,
                "`name`: a whole number or a text, not a list of 0",
            ),
            (
                "leg.more",
                FieldFaultKind::Unknown,
                "`more`: no such field, there are to_m, dwell_s, count, how, name",
            ),
        ];
        let found = told(&bad);
        let found: Vec<_> = found.iter().map(|(p, k, m)| (&p[..], *k, &m[..])).collect();
        assert_eq!(found, wanted);
        let how = "`how`: \"still\" or an object with one of slow, fast, not \"stil\"";
        let other = json!({"to_m": [1, 2], "count": 0, "how": "stil"});
        let found: Vec<String> = told(&other).into_iter().map(|(_, _, it)| it).collect();
        let three = "`to_m`: a list of 3, each a number from -10 to 10, not a list of 2";
        assert_eq!(found, [three, how]);
        let found: Vec<String> = told(&json!("x")).into_iter().map(|(_, _, it)| it).collect();
        assert_eq!(found, ["`leg`: an object with to_m, count, how, not \"x\""]);
    }
}
