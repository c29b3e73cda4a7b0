//! Drawings of one look that follow one another become one path: a heat map shrinks to a third.

use std::fmt::Write as _;

/// Rewrites lines of `<rect/>` and `<polyline/>` as plotters writes them, one element a line; all else stays as it is.
pub(super) fn alike_in_one(svg: &str) -> String {
    let mut out = String::with_capacity(svg.len() / 2);
    let mut look: Option<String> = None;
    for line in svg.lines() {
        let drawn = filled_rectangle(line).or_else(|| stroke(line));
        let same = drawn.as_ref().map(|(found, _)| found) == look.as_ref();
        if look.is_some() && !same {
            out.push_str("\"/>\n");
        }
        match drawn {
            Some((found, path)) => {
                if !same {
                    // Writing to a String cannot fail.
                    let _ = write!(out, "<path {found} d=\"");
                    look = Some(found);
                }
                out.push_str(&path);
            }
            None => {
                look = None;
                out.push_str(line);
                out.push('\n');
            }
        }
    }
    if look.is_some() {
        out.push_str("\"/>\n");
    }
    out
}

fn attribute<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    let after = line.split_once(&format!(" {name}=\""))?.1;
    Some(after.split_once('"')?.0)
}

/// Look and path of a filled rectangle without opacity; its edges fall on whole pixels, or neighbours would show seams.
fn filled_rectangle(line: &str) -> Option<(String, String)> {
    if !line.starts_with("<rect ") || line.contains(" opacity=") || line.contains(" stroke=") {
        return None;
    }
    let value = |name| attribute(line, name);
    let path = format!(
        "M{} {}h{}v{}H{}z",
        value("x")?,
        value("y")?,
        value("width")?,
        value("height")?,
        value("x")?
    );
    let look = format!("shape-rendering=\"crispEdges\" fill=\"{}\"", value("fill")?);
    Some((look, path))
}

/// Look and path of an open line without opacity: where such lines cross, one above the other looks as both in one.
fn stroke(line: &str) -> Option<(String, String)> {
    if !line.starts_with("<polyline ") || line.contains(" opacity=") {
        return None;
    }
    let value = |name| attribute(line, name);
    let look = format!(
        "fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"",
        value("stroke")?,
        value("stroke-width")?
    );
    let mut path = String::new();
    let mut before: Option<(i64, i64)> = None;
    for point in value("points")?.split_whitespace() {
        let (x, y) = point.split_once(',')?;
        let (x, y) = (x.parse::<i64>().ok()?, y.parse::<i64>().ok()?);
        let _ = match before {
            None => write!(path, "M{x} {y}"),
            Some((x0, y0)) if (x0, y0) == (x, y) => Ok(()),
            Some((x0, y0)) if y0 == y => write!(path, "h{}", x - x0),
            Some((x0, y0)) if x0 == x => write!(path, "v{}", y - y0),
            Some((x0, y0)) => write!(path, "l{} {}", x - x0, y - y0),
        };
        before = Some((x, y));
    }
    Some((look, path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_of_one_look_share_a_path_and_others_stay() {
        let svg = "<rect x=\"1\" y=\"2\" width=\"3\" height=\"4\" fill=\"#AA0000\"/>\n\
                   <rect x=\"5\" y=\"2\" width=\"3\" height=\"4\" fill=\"#AA0000\"/>\n\
                   <rect x=\"9\" y=\"2\" width=\"3\" height=\"4\" fill=\"#00AA00\"/>\n\
                   <text x=\"1\">a</text>\n\
                   <polyline fill=\"none\" stroke=\"#000000\" stroke-width=\"3\" points=\"0,0 4,0 4,5 6,8 \"/>\n\
                   <rect x=\"1\" y=\"2\" width=\"3\" height=\"4\" opacity=\"0.5\" fill=\"#AA0000\"/>\n\
                   </svg>\n";
        assert_eq!(
            alike_in_one(svg),
            "<path shape-rendering=\"crispEdges\" fill=\"#AA0000\" d=\"M1 2h3v4H1zM5 2h3v4H5z\"/>\n\
             <path shape-rendering=\"crispEdges\" fill=\"#00AA00\" d=\"M9 2h3v4H9z\"/>\n\
             <text x=\"1\">a</text>\n\
             <path fill=\"none\" stroke=\"#000000\" stroke-width=\"3\" d=\"M0 0h4v5l2 3\"/>\n\
             <rect x=\"1\" y=\"2\" width=\"3\" height=\"4\" opacity=\"0.5\" fill=\"#AA0000\"/>\n\
             </svg>\n"
        );
    }
}
