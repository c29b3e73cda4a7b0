//! report.html: one file with its figures and style inside, for a browser without a network and for
//! print.

use super::sections::{Figure, Part, Report};
use super::tables;
use super::words::escape;

/// A light page that keeps figures whole in print; digits of one width in tables.
const STYLE: &str = "\
:root{color-scheme:light}\
body{font:15px/1.5 Helvetica,Arial,'Liberation Sans',sans-serif;color:#1f2933;background:#fcfcfa;max-width:1120px;margin:2rem auto;padding:0 1rem}\
h1{font-size:1.6rem;margin:0 0 .2rem}h2{font-size:1.15rem;margin:2.2rem 0 .6rem;border-bottom:1px solid #dde1e6}\
p{max-width:46rem}p.lead{color:#52606d;margin-top:0}\
figure{margin:1.2rem 0;break-inside:avoid}figure svg{max-width:100%;height:auto;border:1px solid #dde1e6}\
figcaption{max-width:46rem;color:#52606d;font-size:.92rem}\
div.wide{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.9rem}\
th,td{padding:.18rem .7rem;text-align:right;border-bottom:1px solid #eceff2}th.words,td.words{text-align:left}\
thead th{border-bottom:1px solid #7b8794}tr.head td{font-weight:bold;padding-top:.7rem}\
li{max-width:46rem}code{font-size:.95em}\
@media print{body{margin:0;max-width:none;background:#fff}}";

/// Names and contents of the files that hold a report: its figures, and report.html.
pub(crate) fn files(report: &Report) -> Vec<(String, String)> {
    let svg = |figure: &Figure| (format!("{}.svg", figure.name), figure.svg.clone());
    let mut files: Vec<(String, String)> = report.figures().map(svg).collect();
    files.push(("report.html".to_owned(), html(report)));
    files
}

/// The whole page.
fn html(report: &Report) -> String {
    let title = escape(&report.title);
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <h1>{title}</h1>\n<p class=\"lead\">{}</p>\n",
        escape(&report.lead)
    );
    for section in &report.sections {
        if !section.heading.is_empty() {
            html += &format!("<h2>{}</h2>\n", escape(section.heading));
        }
        section.parts.iter().for_each(|it| html += &part(it));
    }
    html + "</body>\n</html>\n"
}

fn part(part: &Part) -> String {
    let list = |tag: &str, entries: &[String]| {
        let entries: String = entries
            .iter()
            .map(|entry| format!("<li>{}</li>\n", escape(entry)))
            .collect();
        format!("<{tag}>\n{entries}</{tag}>\n")
    };
    match part {
        Part::Line(line) => format!("<p>{}</p>\n", escape(line)),
        Part::List(entries) => list("ul", entries),
        Part::Steps(steps) => list("ol", steps),
        Part::Table { table, .. } => tables::html(table),
        Part::Figure(figure) => format!(
            "<figure>\n{}<figcaption>{}</figcaption>\n{}</figure>\n",
            figure.svg,
            escape(&figure.caption),
            figure.live.as_deref().unwrap_or_default()
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_value_is_text_in_columns_and_a_page_with_its_texts_escaped() {
        let rows = vec![vec!["<depth>".into()], vec!["a & b".into(), "12".into()]];
        let mut report = Report::new("a<b".into(), "c".into());
        report.section("Here", vec![Part::table("lr", "where | n", rows)]);
        report.section("Nothing", Vec::new());
        assert_eq!(
            report.text(),
            "a<b\nc\n\nHERE\n  where   n\n  <depth>\n  a & b  12\n"
        );
        let html = html(&report);
        for part in [
            "<title>a&lt;b</title>",
            "<h2>Here</h2>",
            "a &amp; b</td><td>12</td>",
        ] {
            assert!(html.contains(part), "{html}");
        }
    }
}
