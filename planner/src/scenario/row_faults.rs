//! What is wrong with the rows of a table: reported together, each fault once for all of its rows.

use std::fmt;

/// Faults that are listed; the others are counted. Chosen here: what one reads.
const MOST_LISTED: usize = 20;
/// Lines that are named of one fault; the others are counted. Chosen here.
const MOST_LINES: usize = 3;

/// What is wrong with the rows of a table, in the order in which it was found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RowFaults {
    listed: Vec<RowFault>,
    /// Beyond [`MOST_LISTED`].
    omitted: usize,
}

/// One fault of one row or several.
#[derive(Clone, Debug, PartialEq, Eq)]
struct RowFault {
    /// From 1; the first few.
    lines: Vec<u64>,
    /// Rows of that fault.
    count: usize,
    what: String,
}

impl RowFaults {
    /// Adds what is wrong at a line, counted from 1.
    pub fn add(&mut self, line: u64, what: impl Into<String>) {
        let what = what.into();
        if let Some(known) = self.listed.iter_mut().find(|it| it.what == what) {
            known.count += 1;
            if known.lines.len() < MOST_LINES {
                known.lines.push(line);
            }
        } else if self.listed.len() < MOST_LISTED {
            let (lines, count) = (vec![line], 1);
            self.listed.push(RowFault { lines, count, what });
        } else {
            self.omitted += 1;
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.listed.is_empty()
    }

    /// What was read, where nothing is wrong.
    ///
    /// # Errors
    ///
    /// They themselves, where there are any.
    pub fn or<T>(self, read: T) -> Result<T, RowFaults> {
        match self.is_empty() {
            true => Ok(read),
            false => Err(self),
        }
    }
}

impl fmt::Display for RowFaults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, RowFault { lines, count, what }) in self.listed.iter().enumerate() {
            let more = count - lines.len();
            let lines: Vec<String> = lines.iter().map(u64::to_string).collect();
            let lines = lines.join(", ");
            if index > 0 {
                f.write_str("\n  ")?;
            }
            match (count, more) {
                (1, _) => write!(f, "line {lines}: {what}")?,
                (_, 0) => write!(f, "lines {lines}: {what}")?,
                _ => write!(f, "lines {lines} and {more} more: {what}")?,
            }
        }
        match self.omitted {
            0 => Ok(()),
            1 => f.write_str("\n  and one more"),
            omitted => write!(f, "\n  and {omitted} more"),
        }
    }
}

impl std::error::Error for RowFaults {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_is_reported_once_and_no_more_than_one_reads() {
        let mut faults = RowFaults::default();
        assert_eq!(faults.clone().or(7), Ok(7));
        for line in [3, 5, 6, 9, 11] {
            faults.add(line, "3 columns, 4 expected");
        }
        faults.add(4, "time does not go on");
        let told = "lines 3, 5, 6 and 2 more: 3 columns, 4 expected\n  line 4: time does not go on";
        assert_eq!(faults.to_string(), told);
        for line in 20..100 {
            faults.add(line, format!("`{line}`"));
        }
        let told = faults.to_string();
        assert_eq!(told.lines().count(), MOST_LISTED + 1);
        assert!(told.ends_with("\n  and 62 more"), "{told}");
        assert!(faults.or(7).is_err());
    }
}
