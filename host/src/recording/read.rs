//! Reading the CSV format, with the place of everything that is wrong.
//!
//! The lines are split here, because the `csv` crate's positions count comments and blank lines to the record after
//! them and know no column. The format needs no more: numbers hold no comma and no line break, and a quoted cell, as
//! some spreadsheets write, is taken without its quotes.

use std::ops::Range;
use std::path::Path;

use super::{Channel, Recording, TIME, unit_of};
use crate::input::{InputError, read_text, text_of};

/// Longest piece of a cell that an error repeats.
const REPEATED_CHARS: usize = 40;

/// Reads a recording from a file.
///
/// # Errors
/// The file could not be read, or is not the format; with line and column.
pub fn read(path: &Path) -> Result<Recording, InputError> {
    Reader { file: &path.display().to_string(), text: &read_text(path)? }.recording()
}

/// Reads a recording from the bytes of a file; `file` is the name that errors give it.
///
/// # Errors
/// The first thing that is not the format; with line and column.
pub fn parse(file: &str, bytes: &[u8]) -> Result<Recording, InputError> {
    Reader { file, text: &text_of(file, bytes.to_vec())? }.recording()
}

struct Reader<'a> {
    file: &'a str,
    text: &'a str,
}

/// A cell without surrounding blanks and quotes, and where it stands.
#[derive(Clone)]
struct Cell<'a> {
    text: &'a str,
    span: Range<usize>,
}

impl<'a> Reader<'a> {
    fn refuse(&self, span: Range<usize>, problem: impl Into<String>, remedy: impl Into<String>) -> InputError {
        InputError::at(self.file, self.text, span, problem, remedy)
    }

    fn recording(&self) -> Result<Recording, InputError> {
        // A byte order mark, as some editors put, is no part of the first name.
        let start = if self.text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
        let mut comments = Vec::new();
        let mut header: Option<Vec<Cell<'a>>> = None;
        let mut times_s: Vec<f64> = Vec::new();
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut at = start;
        for line in self.text[start..].split_inclusive('\n') {
            let offset = at;
            at += line.len();
            let line = line.trim_end_matches(['\n', '\r']);
            if line.trim().is_empty() {
                continue;
            }
            if let Some(comment) = line.trim_start().strip_prefix('#') {
                comments.push(comment.trim().to_owned());
                continue;
            }
            let cells = cells(line, offset);
            match &header {
                None => {
                    self.check_header(&cells)?;
                    columns = vec![Vec::new(); cells.len() - 1];
                    header = Some(cells);
                }
                Some(names) => self.row(names, &cells, offset..offset + line.len(), &mut times_s, &mut columns)?,
            }
        }
        let end = self.text.len()..self.text.len();
        let Some(names) = header else {
            return Err(self.refuse(
                end,
                "the file holds no header and no samples",
                "begin with a line such as `time_s,force_N`, then one line for each sample",
            ));
        };
        if times_s.len() < 2 {
            return Err(self.refuse(
                end,
                format!("a recording has at least two samples, this one has {}", times_s.len()),
                "add a line for each sample: its time and its values, separated by commas",
            ));
        }
        let channels = names[1..]
            .iter()
            .zip(columns)
            .map(|(name, values)| Channel { name: name.text.to_owned(), values })
            .collect();
        let recording = Recording::new(times_s, channels)
            .map_err(|malformed| InputError::whole(self.file, malformed.to_string(), "correct the file"))?;
        Ok(recording.with_comments(comments))
    }

    fn check_header(&self, names: &[Cell<'a>]) -> Result<(), InputError> {
        let whole = names[0].span.start..names[names.len() - 1].span.end;
        let first = &names[0];
        if names.len() == 1 && first.text.contains([';', '\t']) {
            return Err(self.refuse(
                whole,
                "the columns are not separated by commas",
                "separate columns by commas and write decimals with a point",
            ));
        }
        if first.text.parse::<f64>().is_ok() {
            return Err(self.refuse(
                first.span.clone(),
                format!("the header is missing: the first line begins with the number {}", first.text),
                "begin with a line that names the columns with their units, such as `time_s,force_N`",
            ));
        }
        if first.text != TIME {
            let remedy = if names.iter().any(|name| name.text == TIME) {
                "put `time_s` first".to_owned()
            } else {
                "name the first column `time_s` and give the time in seconds".to_owned()
            };
            return Err(self.refuse(
                first.span.clone(),
                format!("the first column is `{}`, not `time_s`", repeated(first.text)),
                remedy,
            ));
        }
        if names.len() == 1 {
            return Err(self.refuse(
                whole,
                "there is no channel beside the time",
                "add a column for what was measured, such as `force_N`",
            ));
        }
        for (index, name) in names.iter().enumerate() {
            if name.text.is_empty() {
                return Err(self.refuse(
                    name.span.clone(),
                    format!("column {} has no name", index + 1),
                    "name it with its unit, such as `force_N`, or remove the comma before it",
                ));
            }
            if names[..index].iter().any(|other| other.text == name.text) {
                return Err(self.refuse(
                    name.span.clone(),
                    format!("two columns are named `{}`", repeated(name.text)),
                    "give every column a name of its own",
                ));
            }
            if unit_of(name.text).is_none() || name.text.contains(['"', '#']) {
                return Err(self.refuse(
                    name.span.clone(),
                    format!("column `{}` does not end in a unit", repeated(name.text)),
                    "append the unit after `_`: `force_N`, `displacement_m`, `velocity_m_per_s`, `overrun_count`",
                ));
            }
        }
        Ok(())
    }

    fn row(
        &self,
        names: &[Cell<'a>],
        cells: &[Cell<'a>],
        line: Range<usize>,
        times_s: &mut Vec<f64>,
        columns: &mut [Vec<f64>],
    ) -> Result<(), InputError> {
        if cells.len() != names.len() {
            // The first superfluous cell, or the end of the line where one is missing.
            let place = cells.get(names.len()).map_or(line.end..line.end, |cell| cell.span.clone());
            return Err(self.refuse(
                place,
                format!("the line has {} values, the header names {} columns", cells.len(), names.len()),
                "write one value for each column, separated by commas, decimals with a point",
            ));
        }
        let time = self.number(&cells[0], TIME)?;
        if let Some(last) = times_s.last()
            && time <= *last
        {
            return Err(self.refuse(
                cells[0].span.clone(),
                format!("time does not rise: {time} s comes after {last} s"),
                "put the samples in the order of time, each instant once",
            ));
        }
        times_s.push(time);
        for ((cell, name), column) in cells[1..].iter().zip(&names[1..]).zip(columns) {
            column.push(self.number(cell, name.text)?);
        }
        Ok(())
    }

    fn number(&self, cell: &Cell<'a>, column: &str) -> Result<f64, InputError> {
        let problem = match cell.text.parse::<f64>() {
            Ok(value) if value.is_finite() => return Ok(value),
            Ok(_) => format!("`{}` in column `{column}` is not a finite number", repeated(cell.text)),
            Err(_) if cell.text.is_empty() => format!("column `{column}` is empty"),
            Err(_) => format!("`{}` in column `{column}` is not a number", repeated(cell.text)),
        };
        let remedy = "write a number such as -0.25 or 1.5e-3; leave out the whole line of a sample that was lost";
        Err(self.refuse(cell.span.clone(), problem, remedy))
    }
}

fn cells(line: &str, offset: usize) -> Vec<Cell<'_>> {
    let mut at = offset;
    line.split(',')
        .map(|cell| {
            let start = at + (cell.len() - cell.trim_start().len());
            at += cell.len() + 1;
            let trimmed = cell.trim();
            let text = trimmed.strip_prefix('"').and_then(|inner| inner.strip_suffix('"')).unwrap_or(trimmed);
            Cell { text, span: start..start + trimmed.len() }
        })
        .collect()
}

/// A cell's text, cut where it is too long to be repeated in a sentence, and without control characters.
fn repeated(text: &str) -> String {
    let mut shown: String = text.chars().take(REPEATED_CHARS).flat_map(char::escape_debug).collect();
    if text.chars().nth(REPEATED_CHARS).is_some() {
        shown.push_str("...");
    }
    shown
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn refusal(text: &str) -> (usize, usize, String, String) {
        let error = parse("a.csv", text.as_bytes()).expect_err(text);
        let place = (error.line().expect(text), error.column().expect(text));
        assert!(error.to_string().starts_with(&format!("a.csv:{}:{}: ", place.0, place.1)));
        (place.0, place.1, error.problem().to_owned(), error.remedy().to_owned())
    }

    #[test]
    fn what_people_write_is_read() {
        let text = "\u{feff}# made by hand\r\n\r\ntime_s , \"force_N\",displacement_m\r\n# in between\r\n-1e-3, 0 ,+1\r\n0.5,-2.5,1e-3";
        let recording = parse("a.csv", text.as_bytes()).unwrap();
        assert_eq!(recording.comments(), ["made by hand", "in between"]);
        assert_eq!(recording.times_s(), [-1e-3, 0.5]);
        assert_eq!(recording.channel("force_N"), Some([0.0, -2.5].as_slice()));
        assert_eq!(recording.channel("displacement_m"), Some([1.0, 1e-3].as_slice()));
        assert_eq!(recording.channel("velocity_m_per_s"), None);
    }

    #[test]
    fn every_fault_is_placed_and_named() {
        for (text, line, column, problem) in [
            ("", 1, 1, "no header"),
            ("# only a comment\n", 2, 1, "no header"),
            ("0.0,1.0\n", 1, 1, "header is missing"),
            ("force_N,time_s\n0,0\n", 1, 1, "first column is `force_N`"),
            ("time,force_N\n", 1, 1, "first column is `time`"),
            ("t;f\n0;0\n", 1, 1, "not separated by commas"),
            ("time_s\n0\n1\n", 1, 1, "no channel"),
            ("time_s,force\n", 1, 8, "`force` does not end in a unit"),
            ("time_s,force_N,\n", 1, 16, "column 3 has no name"),
            ("time_s,force_N,force_N\n", 1, 16, "two columns"),
            ("time_s,time_s\n", 1, 8, "two columns"),
            ("time_s,force_N\n", 2, 1, "at least two samples"),
            ("time_s,force_N\n0,0\n", 3, 1, "at least two samples"),
            ("# c\ntime_s,force_N\n0,0\n# c\n\n0.1,x\n", 6, 5, "`x` in column `force_N` is not a number"),
            ("time_s,force_N\n0,0\n0.1,NaN\n", 3, 5, "not a finite number"),
            ("time_s,force_N\n0,0\n0.1,1e999\n", 3, 5, "not a finite number"),
            ("time_s,force_N\n0,0\n0.1,\n", 3, 5, "`force_N` is empty"),
            ("time_s,force_N\n0,0\n,1\n", 3, 1, "`time_s` is empty"),
            ("time_s,force_N\n0,0\n0,1\n", 3, 1, "time does not rise: 0 s comes after 0 s"),
            ("time_s,force_N\n0,0\n-1,1\n", 3, 1, "time does not rise"),
            ("time_s,force_N\n0\n", 2, 2, "1 values, the header names 2"),
            ("time_s,force_N\n0,1,5\n", 2, 5, "3 values, the header names 2"),
            ("time_s,force_N\n0,1,\n", 2, 5, "3 values"),
        ] {
            let (at_line, at_column, said, remedy) = refusal(text);
            assert_eq!((at_line, at_column), (line, column), "{text:?}: {said}");
            assert!(said.contains(problem), "{text:?}: {said}");
            assert!(!remedy.is_empty());
        }
    }

    #[test]
    fn bytes_that_are_no_text_are_placed_too() {
        let error = parse("a.csv", b"time_s,force_N\n0,\xff\n").unwrap_err();
        assert_eq!((error.line(), error.column()), (Some(2), Some(3)));
        assert!(error.problem().contains("0xFF"));
    }

    #[test]
    fn a_binary_file_is_not_poured_onto_the_terminal() {
        let bytes = vec![b'A'; 100_000];
        let error = parse("a.csv", &bytes).unwrap_err();
        let shown = format!("{:?}", miette::Report::new(error));
        assert!(shown.len() < 2_000, "{} bytes", shown.len());
    }

    #[test]
    fn a_file_that_is_not_there_is_said() {
        let error = read(Path::new("does/not/exist.csv")).unwrap_err();
        assert!(error.to_string().contains("does/not/exist.csv"), "{error}");
    }

    proptest! {
            #[test]
            fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
                let _ = parse("a.csv", &bytes);
            }

            /// Bytes that look like the format reach further in.
            #[test]
            fn nothing_that_looks_like_the_format_makes_it_panic(
                rows in prop::collection::vec("[0-9eE+\\-.,#\"; naif\r\té]{0,24}", 0..12),
                header in "(time_s)?,?(force_N|force|x_m)?,?[a-z_N\"#]{0,6}",
            ) {
                let text = format!("{header}\n{}", rows.join("\n"));
                match parse("a.csv", text.as_bytes()) {
                    Ok(recording) => {
                        prop_assert!(recording.times_s().windows(2).all(|pair| pair[1] > pair[0]));
    let again = parse("b.csv", recording.to_csv().as_bytes()).unwrap();
                        prop_assert_eq!(again.channels(), recording.channels());
                    }
                    Err(error) => { let _ = format!("{:?}", miette::Report::new(error)); }
                }
            }
        }
}
