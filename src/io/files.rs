//! What `plan` writes: whole files or none, and the line breaks of its JSON.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::io::failure::Failure;

/// The folder that a run writes to, made before the planning so that a folder which cannot be made
/// is known at once.
pub(crate) struct OutFolder {
    pub(crate) path: PathBuf,
    /// The folders that were not there before, innermost first.
    made: Vec<PathBuf>,
}

impl OutFolder {
    pub(crate) fn prepare(path: PathBuf) -> Result<OutFolder, Failure> {
        let missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        let made = path
            .ancestors()
            .take_while(missing)
            .map(Path::to_owned)
            .collect();
        fs::create_dir_all(&path).map_err(Failure::write(&path))?;
        Ok(OutFolder { path, made })
    }

    /// The folder asked for, else `out/NAME`.
    pub(crate) fn of(asked: Option<&Path>, name: &str) -> Result<OutFolder, Failure> {
        OutFolder::prepare(asked.map_or_else(|| Path::new("out").join(name), Path::to_owned))
    }

    /// There is nothing to write: the empty folders that this run made go again.
    pub(crate) fn abandon(self) {
        for folder in &self.made {
            // Refuses a folder with anything in it, which is what we want then.
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Writes all files or, where one cannot be written, none: each goes to a temporary file beside its
/// place, reaches the disk, and only then do all take their names.
pub(crate) fn write(files: &[(PathBuf, String)]) -> Result<(), Failure> {
    let mut waiting = Vec::with_capacity(files.len());
    for (path, text) in files {
        waiting.push(Waiting::new(path, text).map_err(Failure::write(path))?);
    }
    for file in waiting {
        let path = file.path.clone();
        file.take_its_name().map_err(Failure::write(&path))?;
    }
    Ok(())
}

/// [`write`] of files by their names in a folder; gives their paths.
pub(crate) fn write_below(
    folder: &Path,
    files: Vec<(String, String)>,
) -> Result<Vec<PathBuf>, Failure> {
    let there = |(name, text)| (folder.join(name), text);
    let files: Vec<(PathBuf, String)> = files.into_iter().map(there).collect();
    write(&files)?;
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

/// A file complete on disk under a temporary name; dropped early, it is deleted.
struct Waiting {
    path: PathBuf,
    temporary: PathBuf,
}

impl Waiting {
    fn new(path: &Path, text: &str) -> io::Result<Waiting> {
        let name = path.file_name().ok_or(io::ErrorKind::IsADirectory)?;
        if path.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        let mut hidden = std::ffi::OsString::from(".");
        hidden.push(name);
        hidden.push(format!(".{}.partial", std::process::id()));
        let waiting = Waiting {
            path: path.to_owned(),
            temporary: path.with_file_name(hidden),
        };
        let mut file = File::create(&waiting.temporary)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        Ok(waiting)
    }

    fn take_its_name(self) -> io::Result<()> {
        fs::rename(&self.temporary, &self.path)
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        // Gone already once it has its name.
        let _ = fs::remove_file(&self.temporary);
    }
}

/// JSON with the outermost object and the lists and objects in it broken into lines, everything
/// deeper on one line: a plan has one line per drone, and two plans can be compared line by line.
pub(crate) fn json(value: &impl Serialize) -> String {
    lines_down_to(value, 2)
}

/// The same where the plan is itself a member: its drones keep their lines.
pub(crate) fn json_with_plan_inside(value: &impl Serialize) -> String {
    lines_down_to(value, 3)
}

/// The same, every value on a line of its own.
pub(crate) fn json_pretty(value: &impl Serialize) -> String {
    lines_down_to(value, usize::MAX)
}

fn lines_down_to(value: &impl Serialize, levels: usize) -> String {
    let mut bytes = Vec::new();
    let lines = Lines {
        levels,
        depth: 0,
        empty: true,
    };
    value
        .serialize(&mut serde_json::Serializer::with_formatter(
            &mut bytes, lines,
        ))
        .expect("plans hold nothing that JSON cannot: string keys, and memory takes every write");
    bytes.push(b'\n');
    String::from_utf8(bytes).expect("serde_json writes UTF-8")
}

/// Breaks lines down to a depth.
struct Lines {
    levels: usize,
    depth: usize,
    empty: bool,
}

impl Lines {
    fn open<W: ?Sized + io::Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        self.depth += 1;
        self.empty = true;
        writer.write_all(bracket)
    }

    fn member<W: ?Sized + io::Write>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        self.empty = false;
        writer.write_all(if first { b"" } else { b"," })?;
        if self.depth <= self.levels {
            return self.line(writer);
        }
        writer.write_all(if first { b"" } else { b" " })
    }

    fn close<W: ?Sized + io::Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        self.depth -= 1;
        if self.depth < self.levels && !self.empty {
            self.line(writer)?;
        }
        self.empty = false;
        writer.write_all(bracket)
    }

    fn line<W: ?Sized + io::Write>(&self, writer: &mut W) -> io::Result<()> {
        write!(writer, "\n{:width$}", "", width = 2 * self.depth)
    }
}

impl serde_json::ser::Formatter for Lines {
    fn begin_array<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.open(writer, b"[")
    }
    fn begin_array_value<W: ?Sized + io::Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        self.member(writer, first)
    }
    fn end_array<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.close(writer, b"]")
    }
    fn begin_object<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.open(writer, b"{")
    }
    fn begin_object_key<W: ?Sized + io::Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        self.member(writer, first)
    }
    fn begin_object_value<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }
    fn end_object<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.close(writer, b"}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_drone_has_one_line_and_the_json_reads_back() {
        let plan = crate::sample::warehouse();
        let text = json(&plan);
        let lines: Vec<&str> = text
            .lines()
            .filter(|line| line.contains("\"trajectory\""))
            .collect();
        assert_eq!(lines.len(), plan.drones.len());
        assert_eq!(
            serde_json::from_str::<planner::plan::Plan>(&text).expect("reads back"),
            plan
        );
        let nested =
            json_with_plan_inside(&serde_json::json!({ "plan": plan, "files": ["a", "b"] }));
        assert_eq!(
            nested
                .lines()
                .filter(|line| line.contains("\"trajectory\""))
                .count(),
            plan.drones.len()
        );
    }

    #[test]
    fn where_one_file_cannot_be_written_none_appears() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let good = folder.path().join("plan.json");
        let bad = folder.path().join("missing/plan.svg");
        write(&[(good, "{}".into()), (bad, "<svg/>".into())]).expect_err("no such folder");
        assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 0);
    }

    #[test]
    fn a_file_is_replaced_and_leaves_nothing_beside_it() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("plan.json");
        for text in ["first", "second"] {
            write(&[(path.clone(), text.into())]).expect("writes");
            assert_eq!(fs::read_to_string(&path).expect("reads"), text);
        }
        assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 1);
    }
}
