//! Problems of scenarios, drawn beside their text, and the list of any file's problems, for a
//! person at a terminal.

use std::io::IsTerminal;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use planner::scenario::Problem;

/// Most problems drawn at once. Chosen here: two screens' worth.
const MOST_DRAWN: usize = 40;

/// Whether standard error takes colour: a terminal, and `NO_COLOR` unset or empty.
pub(crate) fn colour_on_stderr() -> bool {
    let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    std::io::stderr().is_terminal() && !refused
}

/// All problems of the file at `path`, whose contents are `text`, and a last line that counts them.
pub(crate) fn draw(problems: &[Problem], path: &str, text: &str, colour: bool) -> String {
    let groups = problems.iter().map(|problem| group(problem, path, text));
    listed(groups, problems.len(), colour) + &format!("{path}: {}\n", counted(problems.len()))
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
