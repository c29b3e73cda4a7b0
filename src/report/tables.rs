//! Tables in the columns of a terminal, and as HTML.

use tools::table::Table;

use super::words::escape;

/// The first `most` rows below the headings, two spaces from the edge; a row of one cell takes what
/// room it needs.
pub(crate) fn text(table: &Table, most: usize) -> String {
    let headings = table.columns.iter().map(|column| column.heading.clone());
    let headings: Vec<String> = headings.collect();
    let rows = table.rows.iter().take(most);
    let rows: Vec<&Vec<String>> = [&headings].into_iter().chain(rows).collect();
    let width = |column: usize| {
        let full = rows.iter().filter(|row| row.len() > 1);
        let cells = full.filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..headings.len()).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for ((cell, column), &width) in row.iter().zip(&table.columns).zip(&widths) {
            line += &match column.is_right {
                true => format!("  {cell:>width$}"),
                false => format!("  {cell:<width$}"),
            };
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

pub(crate) fn html(table: &Table) -> String {
    let left = |index: usize| match table.columns.get(index) {
        Some(column) if !column.is_right => " class=\"words\"",
        _ => "",
    };
    let mut html = String::from("<div class=\"wide\"><table>\n<thead><tr>");
    for (index, column) in table.columns.iter().enumerate() {
        html += &format!("<th{}>{}</th>", left(index), escape(&column.heading));
    }
    html += "</tr></thead>\n<tbody>\n";
    for row in &table.rows {
        if let [only] = row.as_slice() {
            let across = table.columns.len();
            html += &format!(
                "<tr class=\"head\"><td class=\"words\" colspan=\"{across}\">{}</td></tr>\n",
                escape(only)
            );
            continue;
        }
        html += "<tr>";
        for (index, cell) in row.iter().enumerate() {
            html += &format!("<td{}>{}</td>", left(index), escape(cell));
        }
        html += "</tr>\n";
    }
    html + "</tbody>\n</table></div>\n"
}
