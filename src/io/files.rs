//! What `plan` writes: whole files or none, and the line breaks of its JSON.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

pub(crate) use loader::files::{
    MOST_BYTES, MOST_SCENARIO_BYTES, WRITERS, bytes_of, is_plain, other_writer, text, text_of,
};
use serde::Serialize;
use serde_json::Value;
use tempfile::NamedTempFile;

use crate::io::failure::Failure;

/// The folder that a run writes to, made before the planning so that a folder which cannot be made
/// is known at once.
pub(crate) struct OutFolder {
    pub(crate) path: PathBuf,
    /// The folders that were not there before, innermost first.
    made: Vec<PathBuf>,
}

impl OutFolder {
    /// A folder for what a command writes, whose main file this is.
    ///
    /// # Errors
    /// It cannot be made, or holds what another command wrote.
    pub(crate) fn prepare(path: PathBuf, main: &str) -> Result<OutFolder, Failure> {
        if let Some((file, command)) = other_writer(&path, main) {
            return Err(Failure::Foreign {
                path,
                file,
                command,
            });
        }
        let missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        let made = path
            .ancestors()
            .take_while(missing)
            .map(Path::to_owned)
            .collect();
        fs::create_dir_all(&path).map_err(Failure::write(&path))?;
        Ok(OutFolder { path, made })
    }

    /// The folder asked for, else the command's own for a run of this name.
    pub(crate) fn of(asked: Option<&Path>, name: &str, main: &str) -> Result<OutFolder, Failure> {
        let writer = WRITERS.iter().find(|(file, ..)| *file == main);
        let own = writer.map_or("out", |&(_, _, folder)| folder);
        let path = asked.map_or_else(|| Path::new(own).join(name), Path::to_owned);
        OutFolder::prepare(path, main)
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
pub(crate) fn write<B: AsRef<[u8]>>(files: &[(PathBuf, B)]) -> Result<(), Failure> {
    let mut waiting = Vec::with_capacity(files.len());
    for (path, contents) in files {
        let contents = contents.as_ref();
        waiting.push((
            path,
            complete(path, contents).map_err(Failure::write(path))?,
        ));
    }
    for (path, file) in waiting {
        file.persist(path)
            .map_err(|error| Failure::write(path)(error.error))?;
    }
    Ok(())
}

/// Files by their names in a folder.
pub(crate) fn below<N: AsRef<Path>, B>(folder: &Path, files: Vec<(N, B)>) -> Vec<(PathBuf, B)> {
    let there = |(name, text)| (folder.join(name), text);
    files.into_iter().map(there).collect()
}

/// [`write()`] of files by their names in a folder; gives their paths.
pub(crate) fn write_below<B: AsRef<[u8]>>(
    folder: &Path,
    files: Vec<(String, B)>,
) -> Result<Vec<PathBuf>, Failure> {
    let files = below(folder, files);
    write(&files)?;
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

/// A file complete on disk beside its place; dropped before it takes its name, it is deleted.
fn complete(path: &Path, contents: &[u8]) -> io::Result<NamedTempFile> {
    if path.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    let mut temporary = tempfile::Builder::new();
    // As any file is made: the user's mask decides who may read it.
    #[cfg(unix)]
    temporary.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let folder = path.parent().filter(|it| !it.as_os_str().is_empty());
    let mut file = temporary.tempfile_in(folder.unwrap_or(Path::new(".")))?;
    file.write_all(contents)?;
    file.as_file().sync_all()?;
    Ok(file)
}

/// JSON with the outermost object and the lists and objects in it broken into lines, everything
/// deeper on one line: a plan has one line per drone, and two plans can be compared line by line.
pub(crate) fn json(value: &impl Serialize) -> String {
    json_down_to(value, 2)
}

/// The same where the plan is itself a member: its drones keep their lines.
pub(crate) fn json_with_plan_inside(value: &impl Serialize) -> String {
    json_down_to(value, 3)
}

/// The same, every value on a line of its own.
pub(crate) fn json_pretty(value: &impl Serialize) -> String {
    json_down_to(value, usize::MAX)
}

/// The same with lines down to so many brackets.
pub(crate) fn json_down_to(value: &impl Serialize, levels: usize) -> String {
    let value = serde_json::to_value(value).expect("answers hold string keys alone");
    let mut text = String::new();
    write_value(&mut text, &value, 0, levels);
    text + "\n"
}

/// Writes a value `depth` brackets deep: down to `levels` each member has a line.
fn write_value(text: &mut String, value: &Value, depth: usize, levels: usize) {
    let (brackets, members): (_, Vec<(String, &Value)>) = match value {
        Value::Array(items) => ("[]", items.iter().map(|it| (String::new(), it)).collect()),
        Value::Object(fields) => {
            let named = |(key, it)| (format!("{}: ", Value::from(String::as_str(key))), it);
            ("{}", fields.iter().map(named).collect())
        }
        leaf => return *text += &leaf.to_string(),
    };
    let breaks = depth < levels && !members.is_empty();
    let line = |depth: usize| match breaks {
        true => format!("\n{:width$}", "", width = 2 * depth),
        false => String::new(),
    };
    *text += &brackets[..1];
    for (index, (key, member)) in members.into_iter().enumerate() {
        let gap = if breaks { "," } else { ", " };
        *text += if index == 0 { "" } else { gap };
        *text += &(line(depth + 1) + &key);
        write_value(text, member, depth + 1, levels);
    }
    *text += &(line(depth) + &brackets[1..]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_drone_has_one_line_and_the_json_reads_back() {
        let plan = crate::tests::warehouse();
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
        write(&[(good, "{}"), (bad, "<svg/>")]).expect_err("no such folder");
        assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 0);
    }

    #[test]
    fn a_file_is_replaced_and_leaves_nothing_beside_it() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("plan.json");
        for text in ["first", "second"] {
            write(&[(path.clone(), text)]).expect("writes");
            assert_eq!(fs::read_to_string(&path).expect("reads"), text);
        }
        assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 1);
    }
}
