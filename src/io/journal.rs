//! A file to which lines are added and never changed, so that what was answered outlives the
//! process; what is over may be left out.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use super::failure::Failure;

/// A journal that this process alone writes to.
pub(crate) struct Journal {
    file: File,
    path: PathBuf,
    /// The file that had the name before, locked for as long as this: a process that opened it just
    /// before it lost its name must not write to it.
    _before: Option<File>,
}

/// What a journal held when it was opened.
pub(crate) struct Kept {
    /// Its whole lines, in order.
    pub(crate) lines: Vec<String>,
    /// Bytes of a last line without an end, which are dropped: it was never acknowledged.
    pub(crate) torn: usize,
}

/// How every journal begins. What begins otherwise is left as it is.
const HEAD: &[u8] = b"{\"journal\":\"";

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
            faults: vec![reason],
        };
        file.try_lock()
            .map_err(|error| wrong(format!("another process has it open ({error})")))?;
        // What is something else may be of any length.
        let mut bytes = Vec::new();
        let mut head = Read::by_ref(&mut file).take(HEAD.len() as u64);
        let head = head.read_to_end(&mut bytes);
        head.map_err(Failure::read(path))?;
        if !HEAD.starts_with(&bytes) {
            return Err(wrong("it is no journal".to_owned()));
        }
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
            File::open(folder_of(path))
                .and_then(|it| it.sync_all())
                .map_err(Failure::write(path))?;
        }
        bytes.truncate(whole);
        let text = String::from_utf8(bytes)
            .map_err(|_| wrong("it is no journal: not all of it is UTF-8".to_owned()))?;
        let lines = text.lines().map(str::to_owned).collect();
        let path = path.to_owned();
        let journal = Journal {
            file,
            path,
            _before: None,
        };
        Ok((journal, Kept { lines, torn }))
    }

    /// Adds a line; it is on the disk when this returns.
    pub(crate) fn append(&mut self, line: &str) -> Result<(), Failure> {
        let added = self.file.write_all(format!("{line}\n").as_bytes());
        added
            .and_then(|()| self.file.sync_data())
            .map_err(Failure::write(&self.path))
    }

    /// The same journal with these lines alone, which are on the disk when this returns. A
    /// process that opens it at any time, or after a kill, finds it as it was or as it is to be.
    pub(crate) fn rewritten(self, lines: &[String]) -> Result<Journal, Failure> {
        let path = self.path.clone();
        let wrote = || -> io::Result<File> {
            let mut new = tempfile::Builder::new()
                .prefix(".journal-")
                .permissions(self.file.metadata()?.permissions())
                .append(true)
                .tempfile_in(folder_of(&path))?;
            // Before it has the name: no process finds it unlocked.
            new.as_file().try_lock()?;
            for line in lines {
                writeln!(new, "{line}")?;
            }
            new.as_file().sync_all()?;
            let file = new.persist(&path).map_err(|it| it.error)?;
            File::open(folder_of(&path))?.sync_all()?;
            Ok(file)
        };
        let file = wrote().map_err(Failure::write(&path))?;
        Ok(Journal {
            file,
            path,
            _before: Some(self.file),
        })
    }
}

/// The folder that keeps the name of a file.
fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|it| !it.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}
