//! The checkout as the boundaries see it: files, manifests, and sources as tokens.
//!
//! Tokens, so that comments, texts and layout cannot matter. Code under `#[cfg(test)]` is left out,
//! because tests may print and reach where they like.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

pub(super) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every file below a folder of the checkout, as paths from its root with `/`, sorted.
pub(super) fn files_below(folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path: PathBuf = entry.unwrap().path();
            // The body of `#[cfg(test)] mod tests;`
            let of_tests = path.file_name().is_some_and(|name| name == "tests.rs");
            if path.is_dir() {
                folders.push(path);
            } else if !of_tests {
                let parts: Vec<_> = path
                    .strip_prefix(root())
                    .unwrap()
                    .iter()
                    .map(|part| part.to_str().unwrap())
                    .collect();
                found.push(parts.join("/"));
            }
        }
    }
    found.sort();
    found
}

pub(super) fn read(file: &str) -> String {
    fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// The sources of one crate, without its tests, examples and benches.
pub(super) fn sources_of(folder: &str) -> Vec<Source> {
    files_below(folder)
        .into_iter()
        .filter(|file| {
            let of_tests = file.ends_with("/tests.rs") || file.contains("/tests/");
            file.ends_with(".rs") && !of_tests
        })
        .map(Source::read)
        .collect()
}

/// One source file: every path it names (`std::fs::File`, one for each leaf of a `use`), and macros
/// with their `!`.
pub(super) struct Source {
    pub(super) file: String,
    pub(super) names: BTreeSet<String>,
}

impl Source {
    fn read(file: String) -> Source {
        let tokens: TokenStream = read(&file)
            .parse()
            .unwrap_or_else(|error| panic!("{file}: {error}"));
        let mut names = BTreeSet::new();
        collect(tokens, "", &mut names);
        Source { file, names }
    }

    /// The names at or below a path: `std::fs` finds `std::fs::File`, not `std::fstab`.
    pub(super) fn names_below<'a>(&'a self, path: &'a str) -> impl Iterator<Item = &'a str> {
        self.names.iter().map(String::as_str).filter(move |name| {
            name.strip_prefix(path)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
        })
    }

    pub(super) fn is_in(&self, places: &[&str]) -> bool {
        places.iter().any(|place| self.file.starts_with(place))
    }
}

/// Walks tokens; `before` is the path that a group in braces continues, as in `use std::{fs, env}`.
fn collect(tokens: TokenStream, before: &str, names: &mut BTreeSet<String>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut at = 0;
    let mut path = before.to_owned();
    let mut goes_on = !before.is_empty();
    while let Some(token) = tokens.get(at) {
        match token {
            TokenTree::Ident(word) => {
                path = if goes_on {
                    format!("{path}::{word}")
                } else {
                    word.to_string()
                };
                goes_on = false;
                let separated = is_mark(&tokens, at + 1, ':') && is_mark(&tokens, at + 2, ':');
                if separated {
                    goes_on = true;
                    at += 2;
                } else {
                    let mark = if is_mark(&tokens, at + 1, '!') {
                        "!"
                    } else {
                        ""
                    };
                    names.insert(format!("{path}{mark}"));
                }
            }
            TokenTree::Group(group) => {
                let prefix = if goes_on { path.as_str() } else { "" };
                collect(group.stream(), prefix, names);
                goes_on = false;
            }
            TokenTree::Punct(mark) if mark.as_char() == '#' && is_cfg_test(tokens.get(at + 1)) => {
                at = end_of_item(&tokens, at + 2);
                continue;
            }
            TokenTree::Punct(mark) if mark.as_char() == ',' => {
                path = before.to_owned();
                goes_on = !before.is_empty();
            }
            TokenTree::Punct(_) | TokenTree::Literal(_) => goes_on = false,
        }
        at += 1;
    }
}

fn is_mark(tokens: &[TokenTree], at: usize, mark: char) -> bool {
    matches!(tokens.get(at), Some(TokenTree::Punct(found)) if found.as_char() == mark)
}

fn is_cfg_test(token: Option<&TokenTree>) -> bool {
    token.is_some_and(|token| token.to_string().replace(' ', "") == "[cfg(test)]")
}

/// The place after the item that starts here: after its body in braces, or its semicolon.
fn end_of_item(tokens: &[TokenTree], from: usize) -> usize {
    let ends = |token: &TokenTree| match token {
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        TokenTree::Punct(mark) => mark.as_char() == ';',
        _ => false,
    };
    let length = tokens[from.min(tokens.len())..].iter().position(ends);
    length.map_or(tokens.len(), |length| from + length + 1)
}

/// The crates that a manifest names in `[dependencies]`, `[dev-dependencies]` and the like.
pub(super) fn dependencies(manifest: &str) -> BTreeSet<String> {
    let mut inside = false;
    let mut found = BTreeSet::new();
    for line in read(manifest).lines().map(str::trim) {
        if line.starts_with('[') {
            inside = line.trim_matches(['[', ']']).ends_with("dependencies")
                && !line.contains("workspace");
        } else if let Some((name, _)) = line.split_once('=').filter(|_| inside) {
            let name = name.trim().split('.').next().unwrap();
            if !name.starts_with('#') {
                found.insert(name.to_owned());
            }
        }
    }
    found
}

#[test]
fn the_reader_of_sources_sees_through_comments_groups_and_tests() {
    let text = r##"
        //! std::fs in words
        use std::{fs, path::{self, Path}};
        /* println!("no") */
        fn f() { let s = "eprintln!"; crate::search::g(s); println!("yes"); }
        #[cfg(test)]
        mod tests { use std::time::Instant; }
        fn after() { std::env::args(); }
    "##;
    let mut names = BTreeSet::new();
    collect(text.parse().unwrap(), "", &mut names);
    let seen = |name: &str| names.contains(name);
    for name in [
        "std::fs",
        "std::path::Path",
        "crate::search::g",
        "println!",
        "std::env::args",
    ] {
        assert!(seen(name), "{name} in {names:?}");
    }
    assert!(
        !seen("std::time::Instant") && !seen("eprintln!"),
        "{names:?}"
    );
}
