//! report.html: one file with its figures and style inside, for a browser without a network and for print.

use crate::plots::{Figure, escape};

/// A light page that keeps figures whole in print; digits of one width in tables.
const STYLE: &str = "\
:root{color-scheme:light}\
body{font:15px/1.5 Helvetica,Arial,'Liberation Sans',sans-serif;color:#1f2933;background:#fcfcfa;max-width:1120px;margin:2rem auto;padding:0 1rem}\
h1{font-size:1.6rem;margin:0 0 .2rem}h2{font-size:1.15rem;margin:2.2rem 0 .6rem;border-bottom:1px solid #dde1e6}\
p{max-width:46rem}p.lead{color:#52606d;margin-top:0}\
figure{margin:1.2rem 0;break-inside:avoid}figure svg{max-width:100%;height:auto;border:1px solid #dde1e6}\
figcaption{max-width:46rem;color:#52606d;font-size:.92rem}\
div.wide{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.9rem}\
th,td{padding:.18rem .7rem;text-align:right;border-bottom:1px solid #eceff2}th:first-child,td:first-child{text-align:left}\
thead th{border-bottom:1px solid #7b8794}tr.head td{font-weight:bold;padding-top:.7rem}\
li{max-width:46rem}code{font-size:.95em}\
@media print{body{margin:0;max-width:none;background:#fff}}";

/// A page under construction.
pub(crate) struct Page {
    html: String,
}

/// A table: headings, then rows; a row with one cell is a heading of its own.
#[derive(Clone, Debug, Default)]
pub(crate) struct Table {
    pub(crate) headings: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
}

impl Page {
    pub(crate) fn new(title: &str, lead: &str) -> Page {
        let (title, lead) = (escape(title), escape(lead));
        Page {
            html: format!(
                "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
                 <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
                 <title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
                 <h1>{title}</h1>\n<p class=\"lead\">{lead}</p>\n"
            ),
        }
    }

    pub(crate) fn section(&mut self, heading: &str) {
        self.html += &format!("<h2>{}</h2>\n", escape(heading));
    }

    pub(crate) fn paragraph(&mut self, text: &str) {
        self.html += &format!("<p>{}</p>\n", escape(text));
    }

    pub(crate) fn list(&mut self, entries: &[String]) {
        self.html += "<ul>\n";
        for entry in entries {
            self.html += &format!("<li>{}</li>\n", escape(entry));
        }
        self.html += "</ul>\n";
    }

    pub(crate) fn table(&mut self, table: &Table) {
        self.html += "<div class=\"wide\"><table>\n<thead><tr>";
        for heading in &table.headings {
            self.html += &format!("<th>{}</th>", escape(heading));
        }
        self.html += "</tr></thead>\n<tbody>\n";
        for row in &table.rows {
            if let [only] = row.as_slice() {
                let across = table.headings.len();
                self.html += &format!(
                    "<tr class=\"head\"><td colspan=\"{across}\">{}</td></tr>\n",
                    escape(only)
                );
                continue;
            }
            self.html += "<tr>";
            for cell in row {
                self.html += &format!("<td>{}</td>", escape(cell));
            }
            self.html += "</tr>\n";
        }
        self.html += "</tbody>\n</table></div>\n";
    }

    pub(crate) fn figure(&mut self, figure: &Figure) {
        self.html += &format!(
            "<figure>\n{}<figcaption>{}</figcaption>\n</figure>\n",
            figure.svg,
            escape(&figure.caption)
        );
    }

    pub(crate) fn finish(mut self) -> String {
        self.html += "</body>\n</html>\n";
        self.html
    }
}

impl Table {
    /// In columns of a terminal: the first to the left, the others to the right.
    pub(crate) fn text(&self) -> String {
        let wide_rows =
            || std::iter::once(&self.headings).chain(self.rows.iter().filter(|row| row.len() > 1));
        let widths: Vec<usize> = (0..self.headings.len())
            .map(|column| {
                wide_rows()
                    .filter_map(|row| row.get(column))
                    .map(|cell| cell.chars().count())
                    .max()
                    .unwrap_or(0)
            })
            .collect();
        let mut text = String::new();
        for row in std::iter::once(&self.headings).chain(&self.rows) {
            let mut line = String::from("  ");
            for (column, (cell, width)) in row.iter().zip(&widths).enumerate() {
                if column == 0 {
                    line += &format!("{cell:<width$}");
                } else {
                    line += &format!("  {cell:>width$}");
                }
            }
            text += line.trim_end();
            text.push('\n');
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_escaped_and_columns_stand_below_one_another() {
        let table = Table {
            headings: vec!["where".into(), "n".into()],
            rows: vec![vec!["<depth>".into()], vec!["a & b".into(), "12".into()]],
        };
        assert_eq!(table.text(), "  where   n\n  <depth>\n  a & b  12\n");
        let mut page = Page::new("a<b", "c");
        page.table(&table);
        let html = page.finish();
        assert!(html.contains("<title>a&lt;b</title>") && html.contains("<td>a &amp; b</td>"));
    }
}
