//! An answer as one value: titled sections of sentences, lists, tables and figures. The terminal's
//! text and report.html are both made from it.

use tools::table::Table;

use super::tables;

/// What a command has to say.
#[derive(Debug, Default)]
pub(crate) struct Report {
    /// What it is about, and the answer in a line.
    pub(crate) title: String,
    /// What was looked at; may be empty.
    pub(crate) lead: String,
    pub(crate) sections: Vec<Section>,
}

/// One picture.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    /// Its file's name, without ending.
    pub(crate) name: String,
    pub(crate) svg: String,
    /// How to read it.
    pub(crate) caption: String,
    /// What a page shows below it that answers to a pointer, as HTML.
    pub(crate) live: Option<String>,
}

impl Figure {
    /// `None` without a picture.
    pub(crate) fn of(name: &str, svg: Option<String>, caption: &str) -> Option<Figure> {
        let (name, caption) = (name.to_owned(), caption.to_owned());
        svg.map(|svg| Figure {
            name,
            svg,
            caption,
            live: None,
        })
    }
}

/// A heading with what stands below it; without a heading it goes on after a gap.
#[derive(Debug)]
pub(crate) struct Section {
    pub(crate) heading: &'static str,
    pub(crate) parts: Vec<Part>,
}

/// One part of a section.
#[derive(Debug)]
pub(crate) enum Part {
    /// A sentence or more.
    Line(String),
    /// Entries of equal rank.
    List(Vec<String>),
    /// Entries in an order.
    Steps(Vec<String>),
    /// Rows, all of them or so many at a terminal; the page has all.
    Table { table: Table, on_screen: usize },
    /// For the page, and a file of its own.
    Figure(Figure),
}

impl Part {
    pub(crate) fn line(text: impl Into<String>) -> Part {
        Part::Line(text.into())
    }

    /// Nothing where there are none.
    pub(crate) fn list(entries: Vec<String>) -> Vec<Part> {
        let all = (!entries.is_empty()).then_some(Part::List(entries));
        all.into_iter().collect()
    }

    /// See [`Table::new`]; shown whole.
    pub(crate) fn table(
        alignment: &str,
        headings: &str,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) -> Part {
        Part::Table {
            table: Table::new(alignment, headings, rows),
            on_screen: usize::MAX,
        }
    }

    /// With so many of its rows at a terminal.
    pub(crate) fn shortened(self, on_screen: usize) -> Part {
        match self {
            Part::Table { table, .. } => Part::Table { table, on_screen },
            other => other,
        }
    }
}

impl Report {
    pub(crate) fn new(title: String, lead: String) -> Report {
        Report {
            title,
            lead,
            sections: Vec::new(),
        }
    }

    /// Appends a section; one without parts is not.
    pub(crate) fn section(&mut self, heading: &'static str, parts: Vec<Part>) {
        if !parts.is_empty() {
            self.sections.push(Section { heading, parts });
        }
    }

    /// Every figure, in its order.
    pub(crate) fn figures(&self) -> impl Iterator<Item = &Figure> {
        let parts = self.sections.iter().flat_map(|section| &section.parts);
        parts.filter_map(|part| match part {
            Part::Figure(figure) => Some(figure),
            _ => None,
        })
    }

    /// For a terminal.
    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        for line in [&self.title, &self.lead] {
            if !line.is_empty() {
                text += &format!("{line}\n");
            }
        }
        for section in &self.sections {
            let parts: String = section.parts.iter().map(Part::text).collect();
            // What is for the page alone needs no heading at a terminal.
            if parts.is_empty() {
                continue;
            }
            text.push('\n');
            if !section.heading.is_empty() {
                text += &format!("{}\n", section.heading.to_uppercase());
            }
            text += &parts;
        }
        text
    }
}

impl Part {
    fn text(&self) -> String {
        match self {
            Part::Line(line) => format!("  {line}\n"),
            Part::List(entries) => entries.iter().map(|it| format!("  - {it}\n")).collect(),
            Part::Steps(steps) => (1..)
                .zip(steps)
                .map(|(number, step)| format!("    {number}. {step}\n"))
                .collect(),
            Part::Table { on_screen: 0, .. } | Part::Figure(_) => String::new(),
            Part::Table { table, on_screen } => {
                let more = table.rows.len().saturating_sub(*on_screen);
                let rest = match more {
                    0 => String::new(),
                    more => format!("  and {more} more: see the report\n"),
                };
                tables::text(table, *on_screen) + &rest
            }
        }
    }
}
