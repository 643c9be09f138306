//! Recorded streams as CSV tables: header, rows, numbers, times. What the numbers mean is said in `streams`.

use std::path::{Path, PathBuf};

use csv::{ReaderBuilder, StringRecord, Trim};

use crate::base::{Error, Result, nearest_name};

/// A CSV file with an accepted header and rows of the same length.
pub(super) struct Table {
    /// The file, for messages.
    pub file: PathBuf,
    /// Its header.
    pub columns: Vec<String>,
    records: Vec<StringRecord>,
}

impl Table {
    /// Parses `bytes`; the header must be one of `headers`, and there must be a row.
    pub fn parse(file: &Path, bytes: &[u8], headers: &[&str]) -> Result<Self> {
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(Trim::All)
            .from_reader(bytes);
        let mut records = Vec::new();
        for (i, record) in reader.records().enumerate() {
            let place = if i == 0 { "header".into() } else { format!("row {i}") };
            let record = record.map_err(|_| {
                Error::bad_input(file, place, "bytes that are not UTF-8 text", "comma-separated numbers")
            })?;
            records.push(record);
        }
        if records.is_empty() {
            return Err(Error::bad_input(file, "header", "an empty file", quoted(headers)));
        }
        let columns = check_header(file, &records.remove(0), headers)?;
        if records.is_empty() {
            return Err(Error::bad_input(
                file,
                "row 1",
                "the end of the file",
                "at least one row under the header",
            ));
        }
        let table = Self {
            file: file.to_path_buf(),
            columns,
            records,
        };
        table.check_lengths()?;
        Ok(table)
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// The index of the column `name`, if the header has it.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|c| c == name)
    }

    /// An error about row `row` (from 0) of the column or columns called `column`.
    pub fn fault(&self, row: usize, column: &str, found: impl Into<String>, expected: &str) -> Error {
        Error::bad_input(&self.file, format!("row {}, column {column}", row + 1), found, expected)
    }

    /// The text of one field.
    pub fn text(&self, row: usize, column: usize) -> &str {
        self.records[row].get(column).unwrap_or_default()
    }

    /// One number; an empty field or `nan` is NaN, infinity and words are refused.
    pub fn number(&self, row: usize, column: usize) -> Result<f64> {
        let text = self.text(row, column);
        if text.is_empty() || text.eq_ignore_ascii_case("nan") {
            return Ok(f64::NAN);
        }
        match text.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => {
                let found = format!("`{}`", text.escape_debug());
                Err(self.fault(
                    row,
                    &self.columns[column],
                    found,
                    "a finite number, or nothing for a missing reading",
                ))
            }
        }
    }

    /// `N` numbers of one row, from column `first` on.
    pub fn numbers<const N: usize>(&self, row: usize, first: usize) -> Result<[f64; N]> {
        let mut out = [0.0; N];
        for (i, x) in out.iter_mut().enumerate() {
            *x = self.number(row, first + i)?;
        }
        Ok(out)
    }

    /// The first column: a time in every row, none before the one above.
    pub fn times(&self) -> Result<Vec<f64>> {
        let mut times: Vec<f64> = Vec::with_capacity(self.len());
        for row in 0..self.len() {
            let time = self.number(row, 0)?;
            if time.is_nan() {
                return Err(self.fault(row, "time", "no time", "a time in seconds in every row"));
            }
            if let Some(last) = times.last().filter(|last| time < **last) {
                let found = format!("{time} after {last}");
                return Err(self.fault(row, "time", found, "times that do not run backwards"));
            }
            times.push(time);
        }
        Ok(times)
    }

    fn check_lengths(&self) -> Result<()> {
        let wanted = self.columns.len();
        match self.records.iter().position(|record| record.len() != wanted) {
            None => Ok(()),
            Some(row) => Err(Error::bad_input(
                &self.file,
                format!("row {}", row + 1),
                format!("{} fields", self.records[row].len()),
                format!("{wanted} fields as in the header"),
            )),
        }
    }
}

fn check_header(file: &Path, record: &StringRecord, headers: &[&str]) -> Result<Vec<String>> {
    let found: Vec<String> = record.iter().map(str::to_owned).collect();
    let line = found.join(",");
    if headers.contains(&line.as_str()) {
        return Ok(found);
    }
    let known = headers.iter().flat_map(|h| h.split(','));
    let stranger = found.iter().find(|name| !known.clone().any(|k| k == name.as_str()));
    let hint = match stranger.and_then(|name| nearest_name(name, known).map(|near| (name, near))) {
        Some((name, near)) => format!(" (`{}` is unknown, did you mean `{near}`?)", name.escape_debug()),
        None => String::new(),
    };
    let found = format!("`{}`", line.escape_debug());
    Err(Error::bad_input(
        file,
        "header",
        found,
        format!("{}{hint}", quoted(headers)),
    ))
}

fn quoted(headers: &[&str]) -> String {
    headers
        .iter()
        .map(|h| format!("`{h}`"))
        .collect::<Vec<_>>()
        .join(" or ")
}
