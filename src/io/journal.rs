//! A file to which lines are added and never changed, so that what was answered outlives the
//! process.

use std::fs::{File, OpenOptions};
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::failure::Failure;

/// A journal that this process alone writes to.
pub(crate) struct Journal {
    file: File,
    path: PathBuf,
}

/// What a journal held when it was opened.
pub(crate) struct Kept {
    /// Its whole lines, in order.
    pub(crate) lines: Vec<String>,
    /// Bytes of a last line without an end, which are dropped: it was never acknowledged.
    pub(crate) torn: usize,
}

impl Journal {
    /// Opens a journal, or begins one.
    ///
    /// # Errors
    /// It cannot be read or written, another process has it open, or it is no text.
    pub(crate) fn open(path: &Path) -> Result<(Journal, Kept), Failure> {
        let is_new = !path.exists();
        let file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(path);
        let mut file = file.map_err(Failure::write(path))?;
        let wrong = |reason: String| Failure::Journal {
            path: path.to_owned(),
            reason,
        };
        file.try_lock()
            .map_err(|error| wrong(format!("another process has it open ({error})")))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(Failure::read(path))?;
        let whole = bytes
            .iter()
            .rposition(|it| *it == b'\n')
            .map_or(0, |it| it + 1);
        let torn = bytes.len() - whole;
        if torn > 0 {
            file.set_len(whole as u64).map_err(Failure::write(path))?;
            file.seek(SeekFrom::End(0)).map_err(Failure::write(path))?;
            file.sync_all().map_err(Failure::write(path))?;
        }
        if is_new {
            // The name of a new file is its folder's to keep.
            let folder = path.parent().filter(|it| !it.as_os_str().is_empty());
            let folder = File::open(folder.unwrap_or(Path::new(".")));
            folder
                .and_then(|it| it.sync_all())
                .map_err(Failure::write(path))?;
        }
        bytes.truncate(whole);
        let text = String::from_utf8(bytes)
            .map_err(|_| wrong("it is no journal: not all of it is UTF-8".to_owned()))?;
        let lines = text.lines().map(str::to_owned).collect();
        let path = path.to_owned();
        Ok((Journal { file, path }, Kept { lines, torn }))
    }

    /// Adds a line; it is on the disk when this returns.
    pub(crate) fn append(&mut self, line: &impl Serialize) -> Result<(), Failure> {
        let mut text = serde_json::to_string(line).map_err(|error| Failure::Journal {
            path: self.path.clone(),
            reason: error.to_string(),
        })?;
        text.push('\n');
        let added = self.file.write_all(text.as_bytes());
        added
            .and_then(|()| self.file.sync_data())
            .map_err(Failure::write(&self.path))
    }
}
