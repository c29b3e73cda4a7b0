//! Fields of a record and the plain values in them, each checked where it stands.
//!
//! No error stops the reading: it is noted with its place, and the caller gets `None`.

use std::ops::Range;

use nalgebra::Point3;

use super::limits::{Limits, MOST_ITEMS, PLACE_M, name_fault};
use super::problem::{Cited, Problem, did_you_mean, nearest};
use super::source::{Pair, Value, line, root};
use super::written::At;

/// Gathers what is wrong while a text is read.
#[derive(Debug)]
pub(super) struct Reader<'t> {
    /// The whole text that is read.
    pub(super) text: &'t str,
    /// In the order in which they were met.
    pub(super) problems: Vec<Problem>,
}

/// `key: value, ...` of one thing, with its keys checked off as they are read.
#[derive(Debug)]
pub(super) struct Record<'t> {
    /// What messages call it: "drone `k1`".
    pub(super) subject: String,
    /// Its first line, where problems of the whole record point.
    head: Range<usize>,
    /// As typed, repeated keys included.
    pairs: Vec<Pair<'t>>,
    /// Keys that have been asked for: what the record takes.
    known: Vec<&'static str>,
    /// Required keys that are not there.
    missing: Vec<&'static str>,
}

/// A value with the words for it in messages.
#[derive(Clone, Copy)]
pub(super) struct Field<'r, 't> {
    /// As typed.
    pub(super) value: Value<'t>,
    pub(super) key: &'static str,
    /// Owner: "drone `k1`".
    pub(super) subject: &'r str,
}

impl Field<'_, '_> {
    /// The problem that the value is of another kind than `what`, labelled with the kind that it
    /// is.
    fn must_be(&self, what: &str) -> Problem {
        let Field {
            value,
            key,
            subject,
        } = self;
        let problem = Problem::at(
            &value.head(),
            format!("`{key}` of {subject} must be {what}"),
        );
        problem.label(format!("this is {}", value.kind()))
    }

    /// The problem that the whole value is wrong: "`key` of drone `k1` is out of range".
    fn is(&self, what: &str) -> Problem {
        let Field {
            value,
            key,
            subject,
        } = self;
        Problem::at(&value.at(), format!("`{key}` of {subject} is {what}"))
    }

    /// What was read, with its place.
    pub(super) fn found<T>(&self, value: T) -> At<T> {
        let at = self.value.at();
        At { value, at }
    }
}

/// Reads a whole text that is RON, and reports what is wrong with it.
pub(super) fn whole<'t, T>(
    text: &'t str,
    read: impl FnOnce(&mut Reader<'t>, Value<'t>) -> Option<T>,
) -> (Option<T>, Vec<Problem>) {
    let mut reader = Reader {
        text,
        problems: Vec::new(),
    };
    let found = match root(text) {
        Ok(value) => read(&mut reader, value),
        Err(problem) => {
            reader.report(*problem);
            None
        }
    };
    (found, reader.problems)
}

/// Reads a file that a scenario cites.
///
/// # Errors
/// Everything that is wrong with it, each at its place in it.
pub(super) fn cited<'t, T>(
    file: &str,
    text: &'t str,
    read: impl FnOnce(&mut Reader<'t>, Value<'t>) -> Option<T>,
) -> Result<T, Vec<Problem>> {
    let (found, mut problems) = whole(text, read);
    if let Some(found) = found.filter(|_| problems.is_empty()) {
        return Ok(found);
    }
    let cited = Box::new(Cited {
        file: file.to_owned(),
        text: text.to_owned(),
    });
    for problem in &mut problems {
        problem.cited = Some(cited.clone());
    }
    Err(problems)
}

/// Reads a finite number within limits, for [`Record::required`] and [`Record::optional`].
pub(super) fn within<'t>(
    limits: &'static Limits,
) -> impl Fn(&mut Reader<'t>, Field<'_, 't>) -> Option<f64> {
    |reader, field| reader.number(field, limits)
}

impl<'t> Reader<'t> {
    /// Notes a problem and goes on.
    pub(super) fn report(&mut self, problem: Problem) {
        self.problems.push(problem);
    }

    /// Opens a record; `name` may stand before its bracket.
    pub(super) fn record(
        &mut self,
        value: Value<'t>,
        name: &'static str,
        subject: String,
    ) -> Option<Record<'t>> {
        let Some(pairs) = value.pairs(name) else {
            let before = value.text.split('(').next().unwrap_or_default().trim();
            let is_name =
                !before.is_empty() && before.chars().all(|c| c.is_alphanumeric() || c == '_');
            let problem = if is_name && before != name && value.text.contains('(') {
                Problem::at(&value.head(), format!("{subject} is called `{before}`"))
                    .label(format!("write `{name}(...)`, or only `(...)`"))
            } else {
                let message = format!("{subject} must be written `(key: value, ...)`");
                Problem::at(&value.head(), message).label(format!("this is {}", value.kind()))
            };
            self.report(problem);
            return None;
        };
        Some(Record {
            subject,
            head: value.head(),
            pairs,
            known: Vec::new(),
            missing: Vec::new(),
        })
    }

    /// Opens a record that messages call by its name, or by its number where it has none.
    pub(super) fn named(
        &mut self,
        value: Value<'t>,
        kind: &'static str,
        index: usize,
    ) -> Option<Record<'t>> {
        let thing = kind.to_lowercase();
        let mut record = self.record(value, kind, format!("{thing} {}", index + 1))?;
        if let Some(name) = record.plain_name() {
            record.subject = format!("{thing} `{name}`");
        }
        Some(record)
    }

    /// Adds `help` to the first problem that `read` reports.
    pub(super) fn helped<T>(
        &mut self,
        help: Option<String>,
        read: impl FnOnce(&mut Reader<'t>) -> T,
    ) -> T {
        let before = self.problems.len();
        let value = read(self);
        if let Some(problem) = self.problems.get_mut(before) {
            problem.help = help.or(problem.help.take());
        }
        value
    }

    /// A finite number within limits.
    pub(super) fn number(&mut self, field: Field<'_, 't>, limits: &Limits) -> Option<f64> {
        let Some(number) = field.value.plain::<f64>() else {
            let problem = field.must_be("a number");
            self.report(match field.value.plain::<String>() {
                Some(quoted) if quoted.trim().parse::<f64>().is_ok() => {
                    problem.help(format!("write it without quotes: {}", quoted.trim()))
                }
                _ => problem,
            });
            return None;
        };
        self.limited(field, number, limits).then_some(number)
    }

    /// Whether a number is finite and within limits; notes it where it is not.
    fn limited(&mut self, field: Field<'_, 't>, number: f64, limits: &Limits) -> bool {
        let what = match number.is_finite() {
            true if limits.contain(number) => return true,
            true => "out of range",
            false => "not a finite number",
        };
        self.report(field.is(what).label(limits.words()));
        false
    }

    /// So many numbers in round brackets, each within limits; `what` they must be, in words.
    pub(super) fn numbers(
        &mut self,
        field: Field<'_, 't>,
        (count, what): (usize, &str),
        limits: &Limits,
    ) {
        match field.value.tuple() {
            Some(items) if items.len() == count => {
                for value in items {
                    self.number(Field { value, ..field }, limits);
                }
            }
            _ => self.report(
                field
                    .must_be(what)
                    .label("in round brackets, commas between them"),
            ),
        }
    }

    /// Two numbers in round brackets, each within limits, the first no more than the second.
    pub(super) fn range(&mut self, field: Field<'_, 't>, limits: &Limits) -> Option<[f64; 2]> {
        let before = self.problems.len();
        self.numbers(field, (2, "a range: two numbers"), limits);
        let numbers: Vec<f64> = field
            .value
            .tuple()?
            .iter()
            .filter_map(Value::plain)
            .collect();
        let [low, high] = numbers.try_into().ok()?;
        if low > high {
            let problem = field.is("upside down").label("the lower comes first");
            self.report(problem.help(format!("write ({high}, {low})")));
        }
        (self.problems.len() == before).then_some([low, high])
    }

    /// A whole number within limits.
    pub(super) fn whole(&mut self, field: Field<'_, 't>, limits: &Limits) -> Option<u32> {
        let Some(number) = field.value.plain::<u32>() else {
            self.not_whole(field, &limits.words());
            return None;
        };
        let is_limited = self.limited(field, f64::from(number), limits);
        is_limited.then_some(number)
    }

    /// A whole number of 64 bits.
    pub(super) fn seed(&mut self, field: Field<'_, 't>) -> Option<u64> {
        let seed = field.value.plain::<u64>();
        if seed.is_none() {
            self.not_whole(field, "must be from 0 to 18446744073709551615");
        }
        seed
    }

    /// Notes a value that is no whole number; `range` is the label of a number with a fraction or a
    /// sign.
    fn not_whole(&mut self, field: Field<'_, 't>, range: &str) {
        let problem = field.must_be("a whole number");
        self.report(match field.value.plain::<f64>() {
            Some(number) if number.fract() == 0.0 && (0.0..1e9).contains(&number) => problem
                .label("this has a decimal point")
                .help(format!("write {number:.0}")),
            Some(_) => problem.label(range),
            None => problem,
        });
    }

    /// Three coordinates within limits (m).
    pub(super) fn place(&mut self, field: Field<'_, 't>) -> Option<At<Point3<f64>>> {
        let Field {
            value,
            key,
            subject,
        } = field;
        let label = match value.tuple().as_deref() {
            Some([x, y, z]) => {
                let subject = &format!("`{key}` of {subject}");
                let [x, y, z] = [(x, "x"), (y, "y"), (z, "z")].map(|(&value, key)| {
                    let coordinate = Field {
                        value,
                        key,
                        subject,
                    };
                    self.number(coordinate, &PLACE_M)
                });
                return Some(field.found(Point3::new(x?, y?, z?)));
            }
            Some(items) => format!("{} numbers instead of 3", items.len()),
            None if value.text.starts_with('(') => "these are named fields".to_owned(),
            None => value.kind().to_owned(),
        };
        self.report(field.must_be("(x, y, z)").label(label));
        None
    }

    /// A text in quotes.
    pub(super) fn text(&mut self, field: Field<'_, 't>) -> Option<At<String>> {
        if let Some(text) = field.value.plain::<String>() {
            return Some(field.found(text));
        }
        let problem = field.must_be("a text in quotes");
        let typed = field.value.text;
        let is_in_word = |c: char| c.is_alphanumeric() || "_-.".contains(c);
        self.report(match typed.chars().all(is_in_word) {
            true => problem
                .label("no quotes")
                .help(format!("write \"{typed}\"")),
            false => problem,
        });
        None
    }

    /// A text that can stand in a table: not empty, on one line.
    pub(super) fn name(&mut self, field: Field<'_, 't>) -> Option<String> {
        let name = self.text(field)?.value;
        let Some(fault) = name_fault(&name) else {
            return Some(name);
        };
        self.report(field.is("no name").label(fault));
        None
    }

    /// One of a few words, without quotes.
    pub(super) fn word<T: Copy>(
        &mut self,
        field: Field<'_, 't>,
        choices: &[(&'static str, T)],
    ) -> Option<T> {
        let Field {
            value,
            key,
            subject,
        } = field;
        if let Some((_, choice)) = choices.iter().find(|(word, _)| *word == value.text) {
            return Some(*choice);
        }
        let known = || choices.iter().map(|(word, _)| *word);
        let words: Vec<String> = known().map(|word| format!("`{word}`")).collect();
        let typed = value.plain::<String>();
        let typed = typed.unwrap_or_else(|| value.text.to_owned());
        let message = format!("`{key}` of {subject} is none of its words");
        let problem = Problem::at(&value.head(), message);
        let problem = problem.label(format!("must be {}", listed(&words, "or")));
        self.report(match known().find(|word| *word == typed) {
            Some(word) => problem.help(format!("write {word}, without quotes")),
            None => problem.maybe_help(nearest(&typed, known()).map(did_you_mean)),
        });
        None
    }

    /// The values of a list in square brackets.
    pub(super) fn items(&mut self, field: Field<'_, 't>) -> Option<Vec<Value<'t>>> {
        let items = field.value.items();
        let Some(items) = items else {
            self.report(field.must_be("a list `[...]`"));
            return None;
        };
        let count = items.len();
        if count > MOST_ITEMS {
            let problem = field.is("too long");
            self.report(problem.label(format!("{count} items, at most {MOST_ITEMS}")));
            return None;
        }
        Some(items)
    }

    /// The items of a list as `read` reads each by its index; wrong ones are left out.
    pub(super) fn list<T>(
        &mut self,
        field: Field<'_, 't>,
        read: impl Fn(&mut Reader<'t>, Value<'t>, usize) -> Option<T>,
    ) -> Vec<T> {
        let items = self.items(field).unwrap_or_default();
        let items = items.into_iter().enumerate();
        let read = items.filter_map(|(index, item)| read(self, item, index));
        read.collect()
    }
}

impl<'t> Record<'t> {
    /// What `read` makes of the value of a key that must be there.
    pub(super) fn required<T>(
        &mut self,
        reader: &mut Reader<'t>,
        key: &'static str,
        read: impl FnOnce(&mut Reader<'t>, Field<'_, 't>) -> Option<T>,
    ) -> Option<T> {
        if !self.has(key) {
            self.missing.push(key);
        }
        self.optional(reader, key, read)
    }

    /// What `read` makes of the value of a key that has a default; `None` where it is left out, and
    /// where it is wrong (then noted).
    pub(super) fn optional<T>(
        &mut self,
        reader: &mut Reader<'t>,
        key: &'static str,
        read: impl FnOnce(&mut Reader<'t>, Field<'_, 't>) -> Option<T>,
    ) -> Option<T> {
        read(reader, self.field(key)?)
    }

    /// [`Record::optional`] of a key for which `None` is a value of its own; the outer `None` where
    /// it is left out or wrong.
    pub(super) fn or_none<T>(
        &mut self,
        reader: &mut Reader<'t>,
        key: &'static str,
        read: impl FnOnce(&mut Reader<'t>, Field<'_, 't>) -> Option<T>,
    ) -> Option<Option<T>> {
        if self.has(key) && self.field(key).is_none() {
            return Some(None);
        }
        self.optional(reader, key, read).map(Some)
    }

    /// Puts what `read` makes of the value of a key in the place of its default, if it is there and
    /// in order.
    pub(super) fn set<T>(
        &mut self,
        reader: &mut Reader<'t>,
        (key, value): (&'static str, &mut T),
        read: impl FnOnce(&mut Reader<'t>, Field<'_, 't>) -> Option<T>,
    ) {
        if let Some(given) = self.optional(reader, key, read) {
            *value = given;
        }
    }

    /// The field of a key, which is known from now on; `None` where it is left out or `None`.
    fn field(&mut self, key: &'static str) -> Option<Field<'_, 't>> {
        self.known.push(key);
        let pair = self.pairs.iter().find(|pair| pair.key == key)?;
        Some(Field {
            value: pair.value.given()?,
            key,
            subject: &self.subject,
        })
    }

    /// Whether the key is there.
    pub(super) fn has(&self, key: &str) -> bool {
        self.pairs.iter().any(|pair| pair.key == key)
    }

    /// The name in it, if that is a text.
    pub(super) fn plain_name(&self) -> Option<String> {
        let name = self.pairs.iter().find(|pair| pair.key == "name")?;
        let name = name.value.plain::<String>()?;
        (!name.is_empty() && !name.contains('\n')).then_some(name)
    }

    /// Its first line.
    pub(super) fn head(&self) -> &Range<usize> {
        &self.head
    }

    /// Notes keys that are given twice, that are not known or that are missing; says whether all
    /// was well.
    pub(super) fn close(self, reader: &mut Reader<'t>) -> bool {
        let Record {
            subject,
            head,
            pairs,
            known,
            mut missing,
        } = self;
        let before = reader.problems.len();
        for (index, pair) in pairs.iter().enumerate() {
            let mut earlier = pairs[..index].iter();
            if let Some(first) = earlier.find(|earlier| earlier.key == pair.key) {
                let first_line = line(reader.text, first.key_at.start);
                let message = format!("`{}` of {subject} is given twice", pair.key);
                let problem = Problem::at(&pair.key_at, message);
                reader.report(problem.label(format!("first given on line {first_line}")));
            }
        }
        let is_used = |key: &str| pairs.iter().any(|pair| pair.key == key);
        let unused = || known.iter().copied().filter(|key| !is_used(key));
        for pair in pairs.iter().filter(|pair| !known.contains(&pair.key)) {
            let problem = Problem::at(
                &pair.key_at,
                format!("{subject} has no field `{}`", pair.key),
            );
            let words: Vec<String> = known.iter().map(|key| format!("`{key}`")).collect();
            let meant = nearest(pair.key, unused());
            // A slip for a required key is one error, not two.
            missing.retain(|key| Some(*key) != meant);
            reader.report(problem.label("unknown").help(match meant {
                Some(meant) => did_you_mean(meant),
                None => format!("it takes {}", listed(&words, "and")),
            }));
        }
        if !missing.is_empty() {
            let keys: Vec<String> = missing.iter().map(|key| format!("`{key}`")).collect();
            let label = match missing.len() {
                1 => "required here",
                _ => "all required here",
            };
            let message = format!("{subject} has no {}", listed(&keys, "or"));
            reader.report(Problem::at(&head, message).label(label));
        }
        reader.problems.len() == before
    }
}

impl Limits {
    /// "must be from 0 to 10 m".
    pub(super) fn words(&self) -> String {
        let Limits { low, high, unit } = self;
        let gap = if unit.is_empty() { "" } else { " " };
        format!("must be from {low} to {high}{gap}{unit}")
    }
}

/// "`a`, `b` and `c`".
pub(super) fn listed(words: &[String], last: &str) -> String {
    match words {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., end] => format!("{} {last} {end}", first.join(", ")),
    }
}
