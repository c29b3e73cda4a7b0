//! Problems of a scenario, drawn beside its text for a person at a terminal.

use std::io::IsTerminal;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use planner::scenario::Problem;

/// Most problems drawn of one file. Chosen here: two screens' worth; nobody mends more at once.
const MOST_DRAWN: usize = 40;

/// Whether standard error takes colour: a terminal, and `NO_COLOR` unset or empty.
pub(crate) fn colour_on_stderr() -> bool {
    let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    std::io::stderr().is_terminal() && !refused
}

/// All problems of the file at `path`, whose contents are `text`, and a last line that counts them.
pub(crate) fn draw(problems: &[Problem], path: &str, text: &str, colour: bool) -> String {
    let renderer = if colour {
        Renderer::styled()
    } else {
        Renderer::plain()
    };
    let mut drawn = String::new();
    for problem in problems.iter().take(MOST_DRAWN) {
        drawn.push_str(&renderer.render(&[group(problem, path, text)]));
        drawn.push_str("\n\n");
    }
    let count = problems.len();
    if count > MOST_DRAWN {
        drawn.push_str(&format!("... and {} more\n\n", count - MOST_DRAWN));
    }
    let word = if count == 1 { "error" } else { "errors" };
    drawn.push_str(&format!("{path}: {count} {word}\n"));
    drawn
}

/// Notes on a scenario that is in order.
pub(crate) fn draw_notes(notes: &[String], colour: bool) -> String {
    let renderer = if colour {
        Renderer::styled()
    } else {
        Renderer::plain()
    };
    let note = |note: &String| {
        let group = Group::with_title(Level::NOTE.primary_title(note.as_str()));
        renderer.render(&[group]) + "\n"
    };
    notes.iter().map(note).collect()
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
