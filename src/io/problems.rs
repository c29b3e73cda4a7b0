//! Problems of scenarios, drawn beside their text, and the list of any file's problems, for a
//! person at a terminal.

use std::collections::BTreeMap;
use std::io::IsTerminal;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use diagnosis::record::problem as record;
use planner::scenario::Problem;
use tools::table::joined;

/// Most problems drawn at once. Chosen here: two screens' worth.
const MOST_DRAWN: usize = 40;

/// Whether standard error takes colour: a terminal, and `NO_COLOR` unset or empty.
pub(crate) fn colour_on_stderr() -> bool {
    let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    std::io::stderr().is_terminal() && !refused
}

/// All problems of the file at `path`, whose contents are `text`, and a last line that counts them.
pub(crate) fn draw(problems: &[Problem], path: &str, text: &str, colour: bool) -> String {
    let texts = problems.iter().map(|problem| {
        let label = problem.label.as_deref().unwrap_or_default();
        format!("{}: {label}", problem.message)
    });
    let texts: Vec<String> = texts.collect();
    let told = told_once(&texts, "at", |index| place(&problems[index], text));
    let others = told.iter().map(|it| it.others.as_deref());
    let groups = told.iter().zip(others).map(|(it, others)| {
        let group = group(&problems[it.first], path, text);
        match others {
            Some(others) => group.element(Level::NOTE.message(others)),
            None => group,
        }
    });
    listed(groups, told.len(), colour) + &format!("{path}: {}\n", counted(problems.len()))
}

/// Problems of recordings one below the other, with their helps, and a last line that counts them.
pub(crate) fn of_recordings(problems: &record::Problems) -> String {
    let problems = &problems.0;
    let titles: Vec<String> = problems.iter().map(ToString::to_string).collect();
    let groups = problems.iter().zip(&titles).map(|(problem, title)| {
        let group = Group::with_title(Level::ERROR.primary_title(title.as_str()));
        match &problem.help {
            Some(help) => group.element(Level::HELP.message(help.as_str())),
            None => group,
        }
    });
    let drawn = listed(groups, problems.len(), colour_on_stderr());
    drawn + &counted(problems.len()) + "\n"
}

/// Where a problem is, in a few words.
fn place(problem: &Problem, text: &str) -> String {
    let of = problem.cited.as_ref();
    let of = of.map_or(String::new(), |cited| format!(" of {}", cited.file));
    match problem.line_column(text) {
        Some((line, _)) => format!("line {line}{of}"),
        None => problem.message.clone(),
    }
}

/// The first of so many, one below the other, and how many more there are.
pub(crate) fn listed<'a>(
    groups: impl Iterator<Item = Group<'a>>,
    count: usize,
    colour: bool,
) -> String {
    let renderer = renderer(colour);
    let mut drawn = String::new();
    for group in groups.take(MOST_DRAWN) {
        drawn += &renderer.render(&[group]);
        drawn += "\n\n";
    }
    if count > MOST_DRAWN {
        drawn += &format!("... and {} more\n\n", count - MOST_DRAWN);
    }
    drawn
}

/// From so many errors of one kind on, the first is printed whole and the rest by their places
/// alone: chosen here, so that what a person can read at a glance is printed whole.
const REPEATED: usize = 4;
/// Most places named of the rest: chosen here.
const PLACES_NAMED: usize = 8;

/// Errors of a kind: the first of them, and the places of the others, if only these are printed.
pub(crate) struct Repeated {
    /// Index of the one printed whole.
    pub(crate) first: usize,
    /// "the same at line 4, line 9 and 30 more"; `None`: there are no others.
    pub(crate) others: Option<String>,
}

/// Errors that differ in names, numbers and places alone, told once: `texts` is what each says,
/// `place` where it is by its index, and `prefix` what stands before places.
pub(crate) fn told_once(
    texts: &[String],
    prefix: &str,
    place: impl Fn(usize) -> String,
) -> Vec<Repeated> {
    let mut kinds: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (index, text) in texts.iter().enumerate() {
        kinds.entry(kind(text)).or_default().push(index);
    }
    let mut told = Vec::new();
    for members in kinds.into_values() {
        if members.len() < REPEATED {
            told.extend(members.into_iter().map(|first| Repeated {
                first,
                others: None,
            }));
            continue;
        }
        let others = &members[1..];
        let more = others.len().saturating_sub(PLACES_NAMED);
        let named = others.iter().take(PLACES_NAMED);
        let mut places: Vec<String> = named.map(|&index| place(index)).collect();
        places.dedup();
        let places = joined(places, ", ");
        let rest = match more {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        told.push(Repeated {
            first: members[0],
            others: Some(format!("the same {prefix} {places}{rest}")),
        });
    }
    told.sort_by_key(|it| it.first);
    told
}

/// A text without its names in backticks and without its numbers.
fn kind(text: &str) -> String {
    let outside = text.split('`').step_by(2);
    outside
        .flat_map(str::chars)
        .filter(|letter| !letter.is_ascii_digit() && !"-+.".contains(*letter))
        .collect()
}

/// `1 error`, `3 errors`.
pub(crate) fn counted(errors: usize) -> String {
    format!("{errors} {}", if errors == 1 { "error" } else { "errors" })
}

/// Notes on a scenario that is in order.
pub(crate) fn draw_notes(notes: &[String], colour: bool) -> String {
    let renderer = renderer(colour);
    let note = |note: &String| {
        let group = Group::with_title(Level::NOTE.primary_title(note.as_str()));
        renderer.render(&[group]) + "\n"
    };
    notes.iter().map(note).collect()
}

fn renderer(colour: bool) -> Renderer {
    match colour {
        true => Renderer::styled(),
        false => Renderer::plain(),
    }
}

fn group<'a>(problem: &'a Problem, path: &'a str, text: &'a str) -> Group<'a> {
    let (path, text) = match &problem.cited {
        Some(cited) => (cited.file.as_str(), cited.text.as_str()),
        None => (path, text),
    };
    let mut group = Group::with_title(Level::ERROR.primary_title(problem.message.as_str()));
    if let Some(span) = &problem.span {
        // Only the lines concerned: drawing a whole file for every problem would take its time.
        let start = span.start.min(text.len());
        let end = span.end.clamp(start, text.len());
        let from = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let to = text[end..].find('\n').map_or(text.len(), |at| end + at);
        let line = 1 + text[..from].matches('\n').count();
        let mark = AnnotationKind::Primary
            .span(start - from..end - from)
            .label(problem.label.as_deref());
        let lines = Snippet::source(&text[from..to])
            .line_start(line)
            .path(path)
            .annotation(mark);
        group = group.element(lines);
    } else if let Some(label) = &problem.label {
        group = group.element(Level::NOTE.message(label.as_str()));
    }
    for note in &problem.notes {
        group = group.element(Level::NOTE.message(note.as_str()));
    }
    if let Some(help) = &problem.help {
        group = group.element(Level::HELP.message(help.as_str()));
    }
    group
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_one_kind_are_reported_once_with_their_places() {
        let texts = (0..40).map(|k| format!("no airframe is called `a{k}` (line {k})"));
        let texts: Vec<String> = texts.chain(["no drones".to_owned()]).collect();
        let told = told_once(&texts, "at", |index| format!("line {index}"));
        assert_eq!((told.len(), told[0].first, told[1].first), (2, 0, 40));
        let others = told[0].others.as_deref();
        let expected = "the same at line 1, line 2, line 3, line 4, line 5, line 6, line 7, line 8 and 31 more";
        assert_eq!(others, Some(expected));
        assert_eq!(told[1].others, None);
        let few = told_once(&texts[..3], "at", |index| format!("line {index}"));
        assert!(few.len() == 3 && few.iter().all(|it| it.others.is_none()));
    }
}
