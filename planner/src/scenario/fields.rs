//! Fields of a record and the plain values in them, each checked where it stands.
//!
//! Nothing here stops at an error: it is noted with its place, and the caller gets `None`.

use std::ops::Range;

use nalgebra::Point3;

use super::limits::{Limits, PLACE_M, name_fault};
use super::problem::{Cited, Problem, did_you_mean, nearest};
use super::source::{Pair, Value, line, root};
use super::written::At;

/// Gathers what is wrong while a text is read.
#[derive(Debug)]
pub(super) struct Reader<'t> {
    pub(super) text: &'t str,
    pub(super) problems: Vec<Problem>,
}

/// `key: value, ...` of one thing, with its keys checked off as they are read.
#[derive(Debug)]
pub(super) struct Record<'t> {
    /// What messages call it: "drone `k1`".
    pub(super) who: String,
    head: Range<usize>,
    pairs: Vec<Pair<'t>>,
    known: Vec<&'static str>,
    missing: Vec<&'static str>,
}

/// A value with the words for it in messages.
#[derive(Clone, Copy)]
pub(super) struct Field<'r, 't> {
    pub(super) value: Value<'t>,
    pub(super) key: &'static str,
    pub(super) who: &'r str,
}

/// Reads a file that a scenario cites.
///
/// # Errors
/// Everything that is wrong with it, each at its place in it.
pub(super) fn cited<T>(
    file: &str,
    text: &str,
    read: impl FnOnce(&mut Reader<'_>) -> Option<T>,
) -> Result<T, Vec<Problem>> {
    let mut reader = Reader {
        text,
        problems: Vec::new(),
    };
    let found = match root(text) {
        Ok(_) => read(&mut reader),
        Err(problem) => {
            reader.report(*problem);
            None
        }
    };
    if let Some(found) = found.filter(|_| reader.problems.is_empty()) {
        return Ok(found);
    }
    let cited = Box::new(Cited {
        file: file.to_owned(),
        text: text.to_owned(),
    });
    for problem in &mut reader.problems {
        problem.cited = Some(cited.clone());
    }
    Err(reader.problems)
}

impl<'t> Reader<'t> {
    pub(super) fn report(&mut self, problem: Problem) {
        self.problems.push(problem);
    }

    /// Opens a record; `name` may stand before its bracket.
    pub(super) fn record(
        &mut self,
        value: Value<'t>,
        name: &'static str,
        who: String,
    ) -> Option<Record<'t>> {
        let Some(pairs) = value.pairs(name) else {
            let before = value.text.split('(').next().unwrap_or_default().trim();
            let is_name =
                !before.is_empty() && before.chars().all(|c| c.is_alphanumeric() || c == '_');
            let problem = if is_name && before != name && value.text.contains('(') {
                Problem::at(&value.head(), format!("{who} is called `{before}`"))
                    .label(format!("write `{name}(...)`, or only `(...)`"))
            } else {
                Problem::at(
                    &value.head(),
                    format!("{who} must be written `(key: value, ...)`"),
                )
                .label(format!("this is {}", value.kind()))
            };
            self.report(problem);
            return None;
        };
        Some(Record {
            who,
            head: value.head(),
            pairs,
            known: Vec::new(),
            missing: Vec::new(),
        })
    }

    /// A finite number within limits.
    pub(super) fn number(&mut self, field: Field<'_, 't>, limits: &Limits) -> Option<At<f64>> {
        let Field { value, key, who } = field;
        let Some(number) = value.plain::<f64>() else {
            let problem = Problem::at(&value.head(), format!("`{key}` of {who} must be a number"))
                .label(format!("this is {}", value.kind()));
            self.report(match value.plain::<String>() {
                Some(quoted) if quoted.trim().parse::<f64>().is_ok() => {
                    problem.help(format!("write it without quotes: {}", quoted.trim()))
                }
                _ => problem,
            });
            return None;
        };
        let problem = if !number.is_finite() {
            Problem::at(
                &value.at(),
                format!("`{key}` of {who} is not a finite number"),
            )
        } else if number < limits.low || number > limits.high {
            Problem::at(&value.at(), format!("`{key}` of {who} is out of range"))
        } else {
            return Some(At {
                value: number,
                at: value.at(),
            });
        };
        self.report(problem.label(limits.words()));
        None
    }

    /// A whole number within limits.
    pub(super) fn whole(&mut self, field: Field<'_, 't>, limits: &Limits) -> Option<At<u32>> {
        let Field { value, key, who } = field;
        if let Some(number) = value.plain::<u32>() {
            if f64::from(number) >= limits.low && f64::from(number) <= limits.high {
                return Some(At {
                    value: number,
                    at: value.at(),
                });
            }
            let problem = Problem::at(&value.at(), format!("`{key}` of {who} is out of range"));
            self.report(problem.label(limits.words()));
            return None;
        }
        self.not_whole(field, &limits.words());
        None
    }

    /// A whole number of 64 bits.
    pub(super) fn seed(&mut self, field: Field<'_, 't>) -> Option<At<u64>> {
        if let Some(number) = field.value.plain::<u64>() {
            return Some(At {
                value: number,
                at: field.value.at(),
            });
        }
        self.not_whole(field, "must be from 0 to 18446744073709551615");
        None
    }

    fn not_whole(&mut self, Field { value, key, who }: Field<'_, 't>, range: &str) {
        let problem = Problem::at(
            &value.head(),
            format!("`{key}` of {who} must be a whole number"),
        );
        let problem = match value.plain::<f64>() {
            Some(number) if number.fract() == 0.0 && (0.0..1e9).contains(&number) => problem
                .label("this has a decimal point")
                .help(format!("write {number:.0}")),
            Some(_) => problem.label(range),
            None => problem.label(format!("this is {}", value.kind())),
        };
        self.report(problem);
    }

    /// Three coordinates within limits (m).
    pub(super) fn place(&mut self, field: Field<'_, 't>) -> Option<At<Point3<f64>>> {
        let Field { value, key, who } = field;
        let items = value.tuple().filter(|_| value.text.starts_with('('));
        let problem = match items.as_deref() {
            Some([x, y, z]) => {
                let [x, y, z] = [(x, "x"), (y, "y"), (z, "z")].map(|(item, axis)| {
                    let who = format!("`{key}` of {who}");
                    self.number(
                        Field {
                            value: *item,
                            key: axis,
                            who: &who,
                        },
                        &PLACE_M,
                    )
                });
                let place = Point3::new(x?.value, y?.value, z?.value);
                return Some(At {
                    value: place,
                    at: value.at(),
                });
            }
            Some(items) => {
                Problem::at(&value.head(), format!("`{key}` of {who} must be (x, y, z)"))
                    .label(format!("{} numbers instead of 3", items.len()))
            }
            None => Problem::at(&value.head(), format!("`{key}` of {who} must be (x, y, z)"))
                .label(match value.text.chars().next() {
                    Some('(') => "these are named fields",
                    _ => value.kind(),
                }),
        };
        self.report(problem);
        None
    }

    /// A text in quotes.
    pub(super) fn text(&mut self, field: Field<'_, 't>) -> Option<At<String>> {
        let Field { value, key, who } = field;
        let Some(text) = value.plain::<String>() else {
            let problem = Problem::at(
                &value.head(),
                format!("`{key}` of {who} must be a text in quotes"),
            );
            let bare = value
                .text
                .chars()
                .all(|c| c.is_alphanumeric() || "_-.".contains(c));
            self.report(match bare {
                true => problem
                    .label("no quotes")
                    .help(format!("write \"{}\"", value.text)),
                false => problem.label(format!("this is {}", value.kind())),
            });
            return None;
        };
        Some(At {
            value: text,
            at: value.at(),
        })
    }

    /// A text that can stand in a table: not empty, on one line.
    pub(super) fn name(&mut self, field: Field<'_, 't>) -> Option<At<String>> {
        let name = self.text(field)?;
        let Some(fault) = name_fault(&name.value) else {
            return Some(name);
        };
        let Field { key, who, .. } = field;
        self.report(Problem::at(&name.at, format!("`{key}` of {who} is no name")).label(fault));
        None
    }

    /// One of a few words, without quotes.
    pub(super) fn word<T: Copy>(
        &mut self,
        field: Field<'_, 't>,
        choices: &[(&'static str, T)],
    ) -> Option<At<T>> {
        let Field { value, key, who } = field;
        if let Some((_, choice)) = choices.iter().find(|(word, _)| *word == value.text) {
            return Some(At {
                value: *choice,
                at: value.at(),
            });
        }
        let words: Vec<String> = choices
            .iter()
            .map(|(word, _)| format!("`{word}`"))
            .collect();
        let typed = value
            .plain::<String>()
            .unwrap_or_else(|| value.text.to_owned());
        let quoted = choices.iter().find(|(word, _)| *word == typed);
        let problem = Problem::at(
            &value.head(),
            format!("`{key}` of {who} is none of its words"),
        )
        .label(format!("must be {}", listed(&words, "or")));
        self.report(match quoted {
            Some((word, _)) => problem.help(format!("write {word}, without quotes")),
            None => problem.maybe_help(
                nearest(&typed, choices.iter().map(|choice| choice.0)).map(did_you_mean),
            ),
        });
        None
    }

    /// A list in square brackets.
    pub(super) fn items(&mut self, field: Field<'_, 't>) -> Option<Vec<Value<'t>>> {
        let Field { value, key, who } = field;
        let items = value.items();
        if items.is_none() {
            self.report(
                Problem::at(
                    &value.head(),
                    format!("`{key}` of {who} must be a list `[...]`"),
                )
                .label(format!("this is {}", value.kind())),
            );
        }
        items
    }
}

impl<'t> Record<'t> {
    /// The value of a key that must be there.
    pub(super) fn required(&mut self, key: &'static str) -> Option<Field<'_, 't>> {
        if !self.pairs.iter().any(|pair| pair.key == key) {
            self.missing.push(key);
        }
        self.optional(key)
    }

    /// The value of a key that has a default.
    pub(super) fn optional(&mut self, key: &'static str) -> Option<Field<'_, 't>> {
        self.known.push(key);
        let pair = self.pairs.iter().find(|pair| pair.key == key)?;
        Some(Field {
            value: pair.value.given()?,
            key,
            who: &self.who,
        })
    }

    /// Whether the key is there.
    pub(super) fn has(&self, key: &str) -> bool {
        self.pairs.iter().any(|pair| pair.key == key)
    }

    /// The name in it, if that is a text.
    pub(super) fn plain_name(&self) -> Option<String> {
        let name = self
            .pairs
            .iter()
            .find(|pair| pair.key == "name")?
            .value
            .plain::<String>()?;
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
            who,
            head,
            pairs,
            known,
            mut missing,
        } = self;
        let before = reader.problems.len();
        for (index, pair) in pairs.iter().enumerate() {
            if let Some(first) = pairs[..index]
                .iter()
                .find(|earlier| earlier.key == pair.key)
            {
                let first_line = line(reader.text, first.key_at.start);
                reader.report(
                    Problem::at(
                        &pair.key_at,
                        format!("`{}` of {who} is given twice", pair.key),
                    )
                    .label(format!("first given on line {first_line}")),
                );
            }
        }
        let unused: Vec<&str> = known
            .iter()
            .copied()
            .filter(|key| !pairs.iter().any(|pair| pair.key == *key))
            .collect();
        for pair in pairs.iter().filter(|pair| !known.contains(&pair.key)) {
            let problem = Problem::at(&pair.key_at, format!("{who} has no field `{}`", pair.key));
            let words: Vec<String> = known.iter().map(|key| format!("`{key}`")).collect();
            let meant = nearest(pair.key, unused.iter().copied());
            // A slip for a required key is one error, not two.
            missing.retain(|key| Some(*key) != meant);
            reader.report(problem.label("unknown").help(match meant {
                Some(meant) => did_you_mean(meant),
                None => format!("it takes {}", listed(&words, "and")),
            }));
        }
        if !missing.is_empty() {
            let keys: Vec<String> = missing.iter().map(|key| format!("`{key}`")).collect();
            let label = if missing.len() == 1 {
                "required here"
            } else {
                "all required here"
            };
            reader.report(
                Problem::at(&head, format!("{who} has no {}", listed(&keys, "or"))).label(label),
            );
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
