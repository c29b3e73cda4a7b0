//! Messages of ROS 2 whose types are known once the file is open: definitions as texts
//! (design.ros2.org, "Interface definition"; mcap.dev, "ros2msg"), values as CDR (OMG DDSI-RTPS
//! 2.5, chapter 10), of which a reader asks for some by their paths.
//!
//! ```text
//! a definition, a line of 80 '=', "MSG: package/Name", another, ...
//! 0x00 · 0 big-endian or 1 little-endian · u16 · values, each at a multiple of its own size from here on
//! ```

use std::collections::BTreeMap;

use super::binary;

/// Types within types. Chosen here: a dozen is beyond any message that is flown; types that hold
/// themselves end here.
const MOST_DEPTH: usize = 16;
/// Bytes before the first value.
const HEAD_BYTES: usize = 4;
/// Ends a definition.
const RULE: &str = "====";

/// The types of a message.
#[derive(Debug, Default)]
pub(super) struct Layout {
    /// That of the message first.
    types: Vec<Vec<Member>>,
}

#[derive(Clone, Debug)]
struct Member {
    name: String,
    kind: CdrType,
    count: Count,
}

#[derive(Clone, Copy, Debug)]
enum CdrType {
    /// By its letter.
    Number(u8),
    Text,
    /// Which of the types.
    Group(usize),
}

#[derive(Clone, Copy, Debug)]
enum Count {
    One,
    Fixed(usize),
    Any,
}

/// A value on its way out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value<'b> {
    Number(f64),
    Text(&'b str),
}

/// Members from the outermost in; of an array one element, or all of them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Path(Vec<(usize, Option<usize>)>);

impl Layout {
    /// The types of a definition; what is wrong with it, in words.
    pub(super) fn parse(name: &str, text: &str) -> Result<Layout, String> {
        let mut texts: Vec<(&str, Vec<&str>)> = vec![(name, Vec::new())];
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            match line.strip_prefix("MSG:") {
                Some(name) => texts.push((name.trim(), Vec::new())),
                None if line.is_empty() || line.starts_with(RULE) => {}
                None => texts.last_mut().expect("one to begin with").1.push(line),
            }
        }
        // What every bag's messages hold and some writers leave out.
        texts.push((
            "builtin_interfaces/Time",
            vec!["int32 sec", "uint32 nanosec"],
        ));
        texts.push((
            "builtin_interfaces/Duration",
            vec!["int32 sec", "uint32 nanosec"],
        ));
        let mut places = BTreeMap::new();
        for (place, (name, _)) in texts.iter().enumerate() {
            places.entry(short(name)).or_insert(place);
        }
        let types = texts.iter().map(|(name, lines)| {
            let package = short(name);
            let package = package.split('/').next().unwrap_or_default().to_owned();
            let lines = lines.iter();
            let members = lines.filter_map(|line| member(line, &package, &places).transpose());
            members.collect::<Result<Vec<_>, String>>()
        });
        let mut types: Vec<Vec<Member>> = types.collect::<Result<_, _>>()?;
        // A type without a member holds one byte (rosidl: `structure_needs_at_least_one_member`).
        for members in types.iter_mut().filter(|members| members.is_empty()) {
            members.push(Member {
                name: String::new(),
                kind: CdrType::Number(b'B'),
                count: Count::One,
            });
        }
        Ok(Layout { types })
    }

    /// Where `poses[*].pose.position.x` lies; `None` where there is no such number or text.
    pub(super) fn path(&self, words: &str) -> Option<Path> {
        let mut path = Vec::new();
        let mut within = Some(0);
        for word in words.split('.') {
            let (name, element) = match word.split_once('[') {
                Some((name, rest)) => (name, Some(rest.strip_suffix(']')?)),
                None => (word, None),
            };
            let members = self.types.get(within?)?;
            let at = members.iter().position(|member| member.name == name)?;
            let element = match (members[at].count, element) {
                (Count::One, None) => Some(0),
                (Count::Fixed(_) | Count::Any, Some("*")) => None,
                (Count::Fixed(_) | Count::Any, Some(number)) => Some(number.parse().ok()?),
                _ => return None,
            };
            path.push((at, element));
            within = match members[at].kind {
                CdrType::Group(of) => Some(of),
                CdrType::Number(_) | CdrType::Text => None,
            };
        }
        within.is_none().then_some(Path(path))
    }

    /// Visits the values that are asked for, in the order in which the message holds them, each
    /// with the number of its path; why it cannot, in words.
    pub(super) fn visit<'b>(
        &self,
        message: &'b [u8],
        wanted: &[Path],
        visit: impl FnMut(usize, Value<'b>),
    ) -> Result<(), &'static str> {
        let Some((head, values)) = message.split_first_chunk::<HEAD_BYTES>() else {
            return Err("it has no head of four bytes");
        };
        let is_big = match head {
            [0, 0, ..] => true,
            [0, 1, ..] => false,
            _ => return Err("its encoding is not plain CDR"),
        };
        let mut walk = Walk {
            layout: self,
            cursor: Cursor {
                values,
                at: 0,
                is_big,
            },
            wanted,
            path: Vec::new(),
            visit,
        };
        walk.group(0)
    }
}

/// Without the word that later versions put between package and name.
fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

/// What a line declares; `None` for a constant.
fn member(
    line: &str,
    package: &str,
    places: &BTreeMap<String, usize>,
) -> Result<Option<Member>, String> {
    let fault = || format!("`{line}` declares nothing");
    let (of, rest) = line.split_once(char::is_whitespace).ok_or_else(fault)?;
    let rest = rest.trim();
    let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    let (name, after) = rest.split_at(end.unwrap_or(rest.len()));
    if after.trim_start().starts_with('=') {
        return Ok(None);
    }
    let (of, count) = match of.split_once('[') {
        None => (of, Count::One),
        Some((of, length)) => {
            let length = length.strip_suffix(']').ok_or_else(fault)?;
            let count = match length {
                "" => Count::Any,
                bounded if bounded.starts_with("<=") => Count::Any,
                fixed => match fixed.parse() {
                    Ok(count) if count > 0 => Count::Fixed(count),
                    _ => return Err(fault()),
                },
            };
            (of, count)
        }
    };
    let letter = match of {
        "bool" => Some(b'?'),
        "byte" | "char" | "uint8" => Some(b'B'),
        "int8" => Some(b'b'),
        "uint16" => Some(b'H'),
        "int16" => Some(b'h'),
        "uint32" => Some(b'I'),
        "int32" => Some(b'i'),
        "uint64" => Some(b'Q'),
        "int64" => Some(b'q'),
        "float32" => Some(b'f'),
        "float64" => Some(b'd'),
        _ => None,
    };
    let is_text = of == "string" || of.starts_with("string<=");
    let kind = match letter {
        Some(letter) => CdrType::Number(letter),
        None if is_text => CdrType::Text,
        None => {
            let whole = match of {
                "Header" => "std_msgs/Header".to_owned(),
                _ if of.contains('/') => short(of),
                _ => format!("{package}/{of}"),
            };
            let place = places.get(&whole);
            let place = place.ok_or_else(|| format!("the type `{of}` is not defined"))?;
            CdrType::Group(*place)
        }
    };
    Ok(Some(Member {
        name: name.to_owned(),
        kind,
        count,
    }))
}

/// The bytes of a message behind its head.
struct Cursor<'b> {
    values: &'b [u8],
    at: usize,
    is_big: bool,
}

const ENDS: &str = "it ends within a value";

impl<'b> Cursor<'b> {
    /// So many values of so many bytes each, from the next place where one may lie.
    fn take(&mut self, size: usize, count: usize) -> Result<&'b [u8], &'static str> {
        let from = self.at.next_multiple_of(size);
        let length = size.checked_mul(count).ok_or(ENDS)?;
        let end = from.checked_add(length).ok_or(ENDS)?;
        let taken = self.values.get(from..end).ok_or(ENDS)?;
        self.at = end;
        Ok(taken)
    }

    fn length(&mut self) -> Result<usize, &'static str> {
        let raw = self.take(4, 1)?;
        Ok(self.number(b'I', raw) as usize)
    }

    fn text(&mut self) -> Result<&'b str, &'static str> {
        let length = self.length()?;
        let raw = self.take(1, length)?;
        // The zero that ends it counts.
        let raw = raw.strip_suffix(&[0]).unwrap_or(raw);
        std::str::from_utf8(raw).map_err(|_| "a text is not UTF-8")
    }

    fn number(&self, letter: u8, raw: &[u8]) -> f64 {
        if !self.is_big {
            return binary::value(letter, raw);
        }
        let mut turned = [0; 8];
        let turned = &mut turned[..raw.len()];
        turned.copy_from_slice(raw);
        turned.reverse();
        binary::value(letter, turned)
    }
}

struct Walk<'a, 'b, V> {
    layout: &'a Layout,
    cursor: Cursor<'b>,
    wanted: &'a [Path],
    /// Members and elements from the outermost to where it is.
    path: Vec<(usize, usize)>,
    visit: V,
}

impl<'b, V: FnMut(usize, Value<'b>)> Walk<'_, 'b, V> {
    fn group(&mut self, of: usize) -> Result<(), &'static str> {
        if self.path.len() >= MOST_DEPTH {
            return Err("its type holds types beyond a depth of 16");
        }
        let layout = self.layout;
        for (at, member) in layout.types[of].iter().enumerate() {
            let count = match member.count {
                Count::One => 1,
                Count::Fixed(count) => count,
                Count::Any => self.cursor.length()?,
            };
            if let CdrType::Number(letter) = member.kind {
                let size = binary::size(letter).unwrap_or(1);
                // An array of none takes no place and moves to none.
                let raw = match count {
                    0 => &[][..],
                    _ => self.cursor.take(size, count)?,
                };
                if self.is_wanted_within(at) {
                    for (element, raw) in raw.chunks_exact(size).enumerate() {
                        let value = Value::Number(self.cursor.number(letter, raw));
                        self.tell(at, element, value);
                    }
                }
                continue;
            }
            for element in 0..count {
                match member.kind {
                    CdrType::Group(of) => {
                        self.path.push((at, element));
                        self.group(of)?;
                        self.path.pop();
                    }
                    _ => {
                        let text = self.cursor.text()?;
                        self.tell(at, element, Value::Text(text));
                    }
                }
            }
        }
        Ok(())
    }

    /// Whether a path leads to a member of where it is.
    fn is_wanted_within(&self, member: usize) -> bool {
        let leads = |Path(path): &Path| {
            path.len() == self.path.len() + 1
                && path[self.path.len()].0 == member
                && passes(path, &self.path)
        };
        self.wanted.iter().any(leads)
    }

    fn tell(&mut self, member: usize, element: usize, value: Value<'b>) {
        self.path.push((member, element));
        for (number, Path(path)) in self.wanted.iter().enumerate() {
            if path.len() == self.path.len() && passes(path, &self.path) {
                (self.visit)(number, value);
            }
        }
        self.path.pop();
    }
}

/// Whether a path goes by where one is, as far as that is.
fn passes(path: &[(usize, Option<usize>)], at: &[(usize, usize)]) -> bool {
    let mut both = path.iter().zip(at);
    both.all(|((member, element), (at, one))| member == at && element.is_none_or(|it| it == *one))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEFINITION: &str = "# what it is\nuint8 FULL=1\nstd_msgs/Header header\nbool is_on\nfloat64[2] pair # two\nNamed[] all\nstring<=9 word \"a=b\"\n\
        ================================================================================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
        ================================================================================\nMSG: test_msgs/Named\nstring name\nfloat32 x\n";

    /// Little-endian, laid out by hand: sec 7, nanosec 8, "w", true, (1, 2), [("a", 3), ("bc", 4)],
    /// "z".
    fn message() -> Vec<u8> {
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend(7_i32.to_le_bytes());
        bytes.extend(8_u32.to_le_bytes());
        // The last byte leads to the next multiple of 8.
        bytes.extend([2, 0, 0, 0, b'w', 0, 1, 0]);
        for pair in [1.0_f64, 2.0] {
            bytes.extend(pair.to_le_bytes());
        }
        bytes.extend([2, 0, 0, 0]);
        bytes.extend([2, 0, 0, 0, b'a', 0, 0, 0]);
        bytes.extend(3_f32.to_le_bytes());
        bytes.extend([3, 0, 0, 0, b'b', b'c', 0, 0]);
        bytes.extend(4_f32.to_le_bytes());
        bytes.extend([2, 0, 0, 0, b'z', 0]);
        bytes
    }

    fn visited(layout: &Layout, message: &[u8], paths: &[&str]) -> Vec<(usize, String)> {
        let paths: Vec<Path> = paths
            .iter()
            .map(|path| layout.path(path).expect("there"))
            .collect();
        let mut seen = Vec::new();
        let tell = |number, value| seen.push((number, format!("{value:?}")));
        layout.visit(message, &paths, tell).expect("whole");
        seen
    }

    #[test]
    fn values_are_found_by_their_paths_whatever_lies_between() {
        let layout = Layout::parse("test_msgs/msg/Outer", DEFINITION).expect("in order");
        let paths = [
            "all[*].name",
            "all[*].x",
            "header.stamp.sec",
            "pair[1]",
            "word",
        ];
        let seen = visited(&layout, &message(), &paths);
        let told: Vec<(usize, &str)> = seen.iter().map(|(n, v)| (*n, v.as_str())).collect();
        assert_eq!(
            told,
            [
                (2, "Number(7.0)"),
                (3, "Number(2.0)"),
                (0, "Text(\"a\")"),
                (1, "Number(3.0)"),
                (0, "Text(\"bc\")"),
                (1, "Number(4.0)"),
                (4, "Text(\"z\")"),
            ]
        );
        for none in [
            "pair", "pair.x", "all.x", "header", "word[0]", "FULL", "all[*]",
        ] {
            assert_eq!(layout.path(none), None, "{none}");
        }
    }

    #[test]
    fn whatever_is_cut_off_or_unknown_is_said() {
        let layout = Layout::parse("test_msgs/msg/Outer", DEFINITION).expect("in order");
        let whole = message();
        for end in 0..whole.len() {
            assert!(layout.visit(&whole[..end], &[], |_, _| ()).is_err());
        }
        let of_itself = Layout::parse("a/B", "B[] b\n").expect("a type may name itself");
        let nested = [vec![0, 1, 0, 0], [1, 0, 0, 0].repeat(40)].concat();
        assert!(of_itself.visit(&nested, &[], |_, _| ()).is_err());
        let unknown = Layout::parse("a/B", "c/D d\n").expect_err("not defined");
        assert_eq!(unknown, "the type `c/D` is not defined");
    }

    #[test]
    fn the_other_order_of_bytes_is_read_as_well() {
        let layout = Layout::parse("a/B", "uint16 a\nfloat64 b\n").expect("in order");
        let mut bytes = vec![0, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0];
        bytes.extend(0.5_f64.to_be_bytes());
        let seen = visited(&layout, &bytes, &["a", "b"]);
        let told: Vec<&str> = seen.iter().map(|(_, value)| value.as_str()).collect();
        assert_eq!(told, ["Number(9.0)", "Number(0.5)"]);
    }
}
