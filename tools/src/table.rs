//! Tables as values: columns with their alignment, rows of cells, Markdown; and numbers as cells show them.

/// A column by its heading, and where its cells stand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Column {
    /// Words.
    Left(String),
    /// Numbers.
    Right(String),
}

impl Column {
    /// Words below a heading.
    #[must_use]
    pub fn left(heading: &str) -> Column {
        Column::Left(heading.to_owned())
    }

    /// Numbers below a heading.
    #[must_use]
    pub fn right(heading: &str) -> Column {
        Column::Right(heading.to_owned())
    }

    /// What stands above it.
    #[must_use]
    pub fn heading(&self) -> &str {
        let (Column::Left(heading) | Column::Right(heading)) = self;
        heading
    }
}

/// Columns, and rows of as many cells; a row of one cell is a heading for those that follow.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// From left to right.
    pub columns: Vec<Column>,
    /// From top to bottom.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Words in the first column and numbers in all others.
    #[must_use]
    pub fn of_numbers(headings: &[&str], rows: Vec<Vec<String>>) -> Table {
        let column = |(index, heading): (usize, &&str)| match index {
            0 => Column::left(heading),
            _ => Column::right(heading),
        };
        Table {
            columns: headings.iter().enumerate().map(column).collect(),
            rows,
        }
    }

    /// Words throughout.
    #[must_use]
    pub fn of_words(headings: &[&str], rows: Vec<Vec<String>>) -> Table {
        Table {
            columns: headings.iter().copied().map(Column::left).collect(),
            rows,
        }
    }

    /// As Markdown; a bar within a cell, which would end it, becomes a slash.
    #[must_use]
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let rule = |column: &Column| match column {
            Column::Left(_) => "---".to_owned(),
            Column::Right(_) => "---:".to_owned(),
        };
        let headings = self
            .columns
            .iter()
            .map(|column| column.heading().to_owned());
        let mut text = line(headings.collect()) + &line(self.columns.iter().map(rule).collect());
        for row in &self.rows {
            text += &line(row.iter().map(|cell| cell.replace('|', "/")).collect());
        }
        text
    }
}

/// Three figures, never fewer than the whole number.
#[must_use]
pub fn figures(value: f64) -> String {
    if !value.is_finite() {
        return "unknown".into();
    }
    let decimals = match value.abs() {
        100.0.. => 0,
        10.0.. => 1,
        1.0.. => 2,
        _ => 3,
    };
    let text = format!("{value:.decimals$}");
    match text.contains(|c: char| ('1'..='9').contains(&c)) {
        true => text,
        false => "0".into(),
    }
}

/// `1 drone`, `5 drones`, `2 drones fly` from a count and the words for one and for many.
#[must_use]
pub fn count(number: usize, one: &str, many: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { many })
}
