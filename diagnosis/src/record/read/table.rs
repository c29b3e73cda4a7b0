//! A comma-separated table as numbers: only the columns that are asked for, each fault at its line
//! and column.

use std::io::Read;

use super::found::{Found, did_you_mean, listed};
use crate::record::problem::Problem;
use crate::record::remark::RemarkKind;

/// Most faulty cells reported of one column; the rest are counted. Chosen here: enough to see the
/// pattern.
const MOST_REPORTED: usize = 5;

/// A table whose header has been read.
pub(super) struct Table<'b> {
    file: &'b str,
    header: Vec<String>,
    reader: csv::Reader<Box<dyn Read + 'b>>,
}

/// Most rows kept of a table. Chosen here: those of six vehicles over half an hour at 100 Hz, and a
/// quarter of a gigabyte with all columns that are known.
const MOST_ROWS: usize = 1 << 20;

/// The columns that were asked for.
#[derive(Debug, Default)]
pub(super) struct Rows {
    /// Line in the file of each row.
    pub(super) lines: Vec<u64>,
    /// In the order asked for; NaN where a cell is empty.
    pub(super) numbers: Vec<Vec<f64>>,
    /// Which of `names` stands in the column of names, for each row; empty without such a column.
    pub(super) named: Vec<usize>,
    /// The different names, in the order in which they first appear.
    pub(super) names: Vec<String>,
    /// Of how many rows of a name one is kept.
    pub(super) stride: usize,
}

/// Bytes with every line ended by one `\n`, the last one too: the csv crate counts the `\n` of a
/// `\r\n` to the line below.
struct Lines<R> {
    bytes: R,
    before: u8,
}

impl<R: Read> Lines<R> {
    fn of(bytes: R) -> Lines<R> {
        Lines {
            bytes,
            before: b'\n',
        }
    }
}

impl<R: Read> Read for Lines<R> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        loop {
            let read = self.bytes.read(into)?;
            if read == 0 {
                let is_open = !into.is_empty() && !matches!(self.before, b'\r' | b'\n');
                if is_open {
                    self.before = b'\n';
                    into[0] = b'\n';
                }
                return Ok(usize::from(is_open));
            }
            let mut kept = 0;
            for at in 0..read {
                let byte = into[at];
                if (self.before, byte) != (b'\r', b'\n') {
                    into[kept] = if byte == b'\r' { b'\n' } else { byte };
                    kept += 1;
                }
                self.before = byte;
            }
            // A lone second half of an end: nothing is no end of the file.
            if kept > 0 {
                return Ok(kept);
            }
        }
    }
}

impl<'b> Table<'b> {
    /// Reads the header; `None` when there is none that could be used.
    pub(super) fn open(
        file: &'b str,
        bytes: impl Read + 'b,
        found: &mut Found,
    ) -> Option<Table<'b>> {
        let before = found.problems.len();
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .trim(csv::Trim::Headers)
            .from_reader(Box::new(Lines::of(bytes)) as Box<dyn Read>);
        let header: Vec<String> = match reader.headers() {
            Ok(header) => header.iter().map(str::to_owned).collect(),
            Err(error) => {
                let message = format!("is no table of text: {error}");
                found.problem(Problem::file(file).line(1), message);
                return None;
            }
        };
        if header.iter().all(String::is_empty) {
            let message = "is empty; it needs a line of column names";
            found.problem(Problem::file(file), message);
            return None;
        }
        let separators = [(';', "semicolons"), ('\t', "tabs")].into_iter();
        let separator = |only: &str| separators.clone().find(|(mark, _)| only.contains(*mark));
        if let [only] = header.as_slice()
            && let Some((_, separator)) = separator(only)
        {
            let help = format!("write commas instead of {separator}");
            let message = format!("has one column, `{only}`");
            found.helped(Problem::file(file).line(1), message, Some(help));
        }
        for (index, name) in header.iter().enumerate() {
            if header[..index].contains(name) {
                let place = Problem::field(file, name).line(1);
                found.problem(place, "stands in the header twice");
            }
        }
        (found.problems.len() == before).then_some(Table {
            file,
            header,
            reader,
        })
    }

    /// Names of the columns.
    pub(super) fn header(&self) -> &[String] {
        &self.header
    }

    /// Place of a column by name.
    pub(super) fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|column| column == name)
    }

    /// Places of some columns by name, a problem where one is missing; a remark names the columns
    /// that are neither among them nor `optional`.
    pub(super) fn columns(
        &self,
        names: &[&str],
        optional: &[&str],
        found: &mut Found,
    ) -> Option<Vec<usize>> {
        let mut columns = Vec::with_capacity(names.len());
        for name in names {
            match self.column(name) {
                Some(column) => columns.push(column),
                None => found.problem(Problem::field(self.file, name).line(1), "is missing"),
            }
        }
        for name in &self.header {
            if !names.contains(&name.as_str()) && !optional.contains(&name.as_str()) {
                let message = format!("column `{name}` of {} is not used", self.file);
                found.remark(RemarkKind::Unused, None, message);
            }
        }
        (columns.len() == names.len()).then_some(columns)
    }

    /// Reads all rows; cells that are no numbers and rows of the wrong length are problems.
    pub(super) fn read(
        mut self,
        numbers: &[usize],
        names: Option<usize>,
        found: &mut Found,
    ) -> Rows {
        let mut rows = Rows {
            numbers: vec![Vec::new(); numbers.len()],
            ..Rows::default()
        };
        let mut faults = vec![0_usize; numbers.len()];
        let mut misshapen = 0_usize;
        let mut record = csv::ByteRecord::new();
        // Rows of each name, and of how many one is kept.
        let (mut met, mut stride) = (Vec::<usize>::new(), 1);
        loop {
            match self.reader.read_byte_record(&mut record) {
                Ok(true) => {}
                Ok(false) => break,
                Err(error) => {
                    found.problem(Problem::file(self.file), error.to_string());
                    break;
                }
            }
            // Where it ends: blank lines before it count to where a record begins.
            let line = self.reader.position().line() - 1;
            let (fields, wanted) = (record.len(), self.header.len());
            if fields != wanted {
                misshapen += 1;
                if misshapen <= MOST_REPORTED {
                    let message = format!("has {fields} fields where the header has {wanted}");
                    found.problem(Problem::file(self.file).line(line), message);
                }
                continue;
            }
            let which = names.map_or(0, |column| rows.name(&record[column]));
            met.resize(met.len().max(which + 1), 0);
            met[which] += 1;
            if !(met[which] - 1).is_multiple_of(stride) {
                continue;
            }
            for (at, &column) in numbers.iter().enumerate() {
                let number = number(&record[column]).unwrap_or_else(|| {
                    faults[at] += 1;
                    if faults[at] <= MOST_REPORTED {
                        let place = Problem::field(self.file, &self.header[column]).line(line);
                        let cell = String::from_utf8_lossy(&record[column]);
                        found.problem(place, format!("is not a number: \"{cell}\""));
                    }
                    f64::NAN
                });
                rows.numbers[at].push(number);
            }
            if names.is_some() {
                rows.named.push(which);
            }
            rows.lines.push(line);
            if rows.lines.len() >= MOST_ROWS {
                rows.thin();
                stride *= 2;
            }
        }
        rows.stride = stride;
        if stride > 1 {
            let message = format!(
                "{}: one row in {stride} of each vehicle or probe is kept",
                self.file
            );
            found.remark(RemarkKind::Unused, None, message);
        }
        for (&column, &count) in numbers.iter().zip(&faults) {
            if count > MOST_REPORTED {
                let place = Problem::field(self.file, &self.header[column]);
                let more = count - MOST_REPORTED;
                found.problem(place, format!("and {more} more cells like these"));
            }
        }
        if misshapen > MOST_REPORTED {
            let more = misshapen - MOST_REPORTED;
            let message = format!("and {more} more lines of another length");
            found.problem(Problem::file(self.file), message);
        }
        if rows.lines.is_empty() && misshapen == 0 {
            found.problem(Problem::file(self.file), "has a header and no rows");
        }
        rows
    }
}

impl Rows {
    /// Rows of each name, in the order of [`Rows::names`]; a problem for every name that the
    /// metadata do not know: without a mass such a drone cannot be simulated, and left out its wake
    /// would be missing.
    pub(super) fn by_vehicle<'a>(
        &self,
        file: &str,
        known: impl Iterator<Item = &'a str> + Clone,
        found: &mut Found,
    ) -> Vec<Vec<usize>> {
        let mut by_name = vec![Vec::new(); self.names.len()];
        for (row, &name) in self.named.iter().enumerate() {
            by_name[name].push(row);
        }
        for (name, mine) in self.names.iter().zip(&by_name) {
            if !known.clone().any(|id| id == name) {
                let line = mine.first().map_or(0, |&row| self.lines[row]);
                let count = mine.len();
                let message = format!("vehicle `{name}` is not in the metadata ({count} rows)");
                let listed = || Some(format!("known are {}", listed(known.clone())));
                let help = did_you_mean(name, known.clone()).or_else(listed);
                found.helped(Problem::file(file).line(line), message, help);
            }
        }
        by_name
    }

    /// Leaves every other row of each name.
    fn thin(&mut self) {
        let mut odd = vec![false; self.names.len().max(1)];
        let keep = |row: usize| {
            let odd = &mut odd[self.named.get(row).copied().unwrap_or(0)];
            *odd = !*odd;
            *odd
        };
        let keep: Vec<bool> = (0..self.lines.len()).map(keep).collect();
        thin(&mut self.lines, &keep);
        thin(&mut self.named, &keep);
        self.numbers
            .iter_mut()
            .for_each(|column| thin(column, &keep));
    }

    /// Index of a name.
    fn name(&mut self, name: &[u8]) -> usize {
        let mut names = self.names.iter();
        let known = names.position(|known| known.as_bytes() == name);
        known.unwrap_or_else(|| {
            self.names.push(String::from_utf8_lossy(name).into_owned());
            self.names.len() - 1
        })
    }
}

/// Leaves the rows that are to be kept; an empty column stays so.
pub(super) fn thin<T>(column: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    column.retain(|_| *keep.next().unwrap_or(&true));
}

/// The number in a cell: NaN for an empty one, `None` for anything else that is no number.
fn number(cell: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(cell).ok()?.trim();
    if text.is_empty() {
        return Some(f64::NAN);
    }
    text.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, columns: &[usize]) -> (Rows, Vec<String>) {
        let mut found = Found::default();
        let rows = Table::open("t.csv", text.as_bytes(), &mut found)
            .map(|table| table.read(columns, None, &mut found))
            .unwrap_or_default();
        (
            rows,
            found.problems.iter().map(ToString::to_string).collect(),
        )
    }

    #[test]
    fn a_cell_that_is_no_number_is_named_with_line_and_column() {
        let (_, problems) = read("t_s,x_m\n0,1\n1,oops\n", &[0, 1]);
        assert_eq!(problems, ["t.csv:3: `x_m`: is not a number: \"oops\""]);
    }

    #[test]
    fn empty_cells_are_missing_values_and_no_problem() {
        let (rows, problems) = read("\u{feff}t_s,x_m\n0,\n1,2e-1\n", &[1]);
        assert!(problems.is_empty());
        assert!(rows.numbers[0][0].is_nan());
        assert_eq!(rows.numbers[0][1], 0.2);
    }

    #[test]
    fn a_row_of_another_length_is_named_with_its_line() {
        let (_, problems) = read("t_s,x_m\n0,1\n1\n", &[0]);
        assert_eq!(problems, ["t.csv:3: has 1 fields where the header has 2"]);
    }

    #[test]
    fn lines_are_counted_whatever_ends_them_and_blank_ones_too() {
        for end in ["\n", "\r\n", "\r"] {
            for (blank, line) in [("", 4), (end, 5)] {
                let text = format!("t_s{end}0{end}{blank}1{end}oops");
                let said = format!("t.csv:{line}: `t_s`: is not a number: \"oops\"");
                assert_eq!(read(&text, &[0]).1, [said], "{text:?}");
            }
        }
        // Cut anywhere, an end is one.
        let (mut lines, mut all) = (Lines::of(&b"a\r\nb\r\n"[..]), Vec::new());
        let mut one = [0];
        while lines.read(&mut one).is_ok_and(|read| read == 1) {
            all.push(one[0]);
        }
        assert_eq!(all, b"a\nb\n");
    }

    #[test]
    fn many_faults_of_one_column_are_counted() {
        let cells = "a\n".repeat(9);
        let (_, problems) = read(&format!("t_s\n{cells}"), &[0]);
        assert_eq!(problems.len(), 6);
        assert_eq!(problems[5], "t.csv: `t_s`: and 4 more cells like these");
    }

    #[test]
    fn empty_files_lone_headers_twins_and_semicolons_are_said() {
        for (text, said) in [
            ("", "t.csv: is empty; it needs a line of column names"),
            ("t_s\n", "t.csv: has a header and no rows"),
            (
                "t_s,t_s\n1,2\n",
                "t.csv:1: `t_s`: stands in the header twice",
            ),
            ("t_s;x_m\n1;2\n", "t.csv:1: has one column, `t_s;x_m`"),
        ] {
            assert_eq!(read(text, &[0]).1, [said]);
        }
    }
}
