//! Tables as values: columns with their alignment, rows of cells, Markdown; and numbers as cells
//! show them.

/// A column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// What stands above it.
    pub heading: String,
    /// Whether its cells stand to the right, as numbers do.
    pub is_right: bool,
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
    /// Headings are parted by bars; `alignment` has a letter for each, `l` or `r`, as a `tabular`
    /// of LaTeX.
    #[must_use]
    pub fn new(
        alignment: &str,
        headings: &str,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) -> Table {
        let column = |(heading, letter): (&str, char)| Column {
            heading: heading.trim().to_owned(),
            is_right: letter == 'r',
        };
        let headings = headings.split('|').zip(alignment.chars());
        Table {
            columns: headings.map(column).collect(),
            rows: rows.into_iter().collect(),
        }
    }

    /// As Markdown; a bar within a cell, which would end it, becomes a slash.
    #[must_use]
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let rule = |column: &Column| if column.is_right { "---:" } else { "---" }.to_owned();
        let headings = self.columns.iter().map(|column| column.heading.clone());
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

/// To so many decimals, or a dash.
#[must_use]
pub fn cell(value: Option<f64>, decimals: usize) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.decimals$}"))
}

/// Words with the same between each two.
#[must_use]
pub fn joined<T: ToString>(words: impl IntoIterator<Item = T>, between: &str) -> String {
    let words: Vec<String> = words.into_iter().map(|word| word.to_string()).collect();
    words.join(between)
}

/// The first few, and how many more there are: `a, b and 3 more`.
#[must_use]
pub fn first_few<T: ToString>(
    all: impl ExactSizeIterator<Item = T>,
    most: usize,
    between: &str,
) -> String {
    let more = all.len().saturating_sub(most);
    let shown = joined(all.take(most), between);
    match more {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// `1 drone`, `5 drones`, `2 drones fly` from a count and the words for one and for many.
#[must_use]
pub fn count(number: usize, one: &str, many: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_that_is_cut_says_how_many_more_there_are() {
        let told = |most| first_few(["a", "b", "c"].iter(), most, ", ");
        assert_eq!(told(3), "a, b, c");
        assert_eq!(told(2), "a, b and 1 more");
    }

    #[test]
    fn a_table_is_markdown_with_its_alignment_and_no_bar_within_a_cell() {
        let rows = [vec!["a|b".to_owned(), "1".to_owned()]];
        assert_eq!(
            Table::new("lr", "place | drones", rows).markdown(),
            "| place | drones |\n| --- | ---: |\n| a/b | 1 |\n"
        );
    }

    #[test]
    fn numbers_keep_three_figures_and_the_whole_number() {
        let shown = [12345.6, 99.96, 1.234, 0.0126, -0.0001, 0.0, f64::NAN].map(figures);
        let expected = ["12346", "100.0", "1.23", "0.013", "0", "0", "unknown"];
        assert_eq!(shown, expected);
    }
}
