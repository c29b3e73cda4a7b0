//! RON cut into tokens that are just fine enough to tell its commas, colons and brackets from those
//! in texts and comments. Only text that ron accepts needs to be cut right; any text is cut without
//! a panic.

/// A text in quotes, a character in quotes, or one other byte that is neither blank nor comment.
pub(super) struct Token {
    /// Where it begins (bytes).
    pub(super) at: usize,
    /// Behind its last byte.
    pub(super) end: usize,
}

/// Cuts RON into tokens just fine enough to find its commas and brackets.
pub(super) struct Tokens<'t> {
    /// The whole text.
    bytes: &'t [u8],
    /// Where the next token is looked for.
    at: usize,
}

impl Tokens<'_> {
    /// The tokens of a text from its beginning.
    pub(super) fn of(text: &str) -> Tokens<'_> {
        Tokens {
            bytes: text.as_bytes(),
            at: 0,
        }
    }

    /// The first place from `from` on behind `end`, or the end of the text.
    fn behind(&self, from: usize, end: &[u8]) -> usize {
        let rest = self.bytes.get(from..).unwrap_or_default();
        let found = rest.windows(end.len()).position(|window| window == end);
        found.map_or(self.bytes.len(), |at| from + at + end.len())
    }

    /// Behind the closing quote of what opens at `open`, over what a backslash escapes.
    fn behind_quote(&self, open: usize, quote: u8) -> usize {
        let mut at = open + 1;
        while at < self.bytes.len() && self.bytes[at] != quote {
            at += if self.bytes[at] == b'\\' { 2 } else { 1 };
        }
        (at + 1).min(self.bytes.len())
    }

    /// Behind a block comment, which may hold others.
    fn behind_comment(&self, open: usize) -> usize {
        let (mut at, mut depth) = (open + 2, 1);
        while depth > 0 && at < self.bytes.len() {
            let (open, close) = (
                self.bytes[at..].starts_with(b"/*"),
                self.bytes[at..].starts_with(b"*/"),
            );
            depth = depth + usize::from(open) - usize::from(close);
            at += if open || close { 2 } else { 1 };
        }
        at.min(self.bytes.len())
    }

    /// The number of `#` where a raw text `r#"` begins.
    fn raw_text(&self, at: usize) -> Option<usize> {
        let in_word =
            at > 0 && (self.bytes[at - 1].is_ascii_alphanumeric() && self.bytes[at - 1] != b'b');
        let hashes = self.bytes[at + 1..]
            .iter()
            .take_while(|byte| **byte == b'#')
            .count();
        (!in_word && self.bytes.get(at + 1 + hashes) == Some(&b'"')).then_some(hashes)
    }
}

impl Iterator for Tokens<'_> {
    type Item = Token;

    fn next(&mut self) -> Option<Token> {
        loop {
            let at = self.at;
            let rest = self.bytes.get(at..).filter(|rest| !rest.is_empty())?;
            if let Some(blanks) = blank(rest) {
                self.at += blanks;
            } else if rest.starts_with(b"//") {
                self.at = self.behind(at, b"\n");
            } else if rest.starts_with(b"/*") {
                self.at = self.behind_comment(at);
            } else {
                self.at = match rest[0] {
                    quote @ (b'"' | b'\'') => self.behind_quote(at, quote),
                    b'r' => match self.raw_text(at) {
                        Some(hashes) => {
                            let end = [b"\"".as_slice(), &b"#".repeat(hashes)].concat();
                            self.behind(at + hashes + 2, &end)
                        }
                        None => at + 1,
                    },
                    // The rest of a letter outside ASCII belongs to it.
                    _ => {
                        at + 1
                            + rest[1..]
                                .iter()
                                .take_while(|byte| **byte & 0xC0 == 0x80)
                                .count()
                    }
                };
                return Some(Token { at, end: self.at });
            }
        }
    }
}

/// How many bytes of blanks come first.
fn blank(rest: &[u8]) -> Option<usize> {
    // ron takes these beside ASCII's: next line, left-to-right and right-to-left marks, line and
    // paragraph separators.
    const WIDE: [&str; 5] = ["\u{85}", "\u{200e}", "\u{200f}", "\u{2028}", "\u{2029}"];
    match rest[0] {
        b' ' | b'\t' | b'\n' | b'\r' | 0x0b | 0x0c => Some(1),
        0..0x80 => None,
        _ => WIDE
            .iter()
            .find(|wide| rest.starts_with(wide.as_bytes()))
            .map(|wide| wide.len()),
    }
}
