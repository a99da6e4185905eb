//! Files that came from outside, and what is said when one cannot be used.
//!
//! A refusal has three parts: what is wrong, where (file, line, column), and what would be right. Recordings,
//! campaigns and models all refuse with the same type, so that a caller can show any of them the same way.

use std::fmt;
use std::ops::Range;
use std::path::Path;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};

/// Longest line that is shown beside the words; a longer one (a binary file, most often) says nothing to a person.
const SHOWN_LINE_BYTES: usize = 240;

/// Why a file was refused.
#[derive(Debug)]
pub struct InputError(Box<Inner>);

#[derive(Debug)]
struct Inner {
    file: String,
    place: Option<Place>,
    problem: String,
    remedy: String,
}

#[derive(Debug)]
struct Place {
    line: usize,
    column: usize,
    bytes: Range<usize>,
    shown: Option<NamedSource<String>>,
}

impl InputError {
    /// A refusal that concerns a place in a file's text.
    ///
    /// `bytes` is the offending range of `text`; ends beyond the text are clipped to it.
    #[must_use]
    pub fn at(
        file: &str,
        text: &str,
        bytes: Range<usize>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        let start = floor_char_boundary(text, bytes.start);
        let end = floor_char_boundary(text, bytes.end).max(start);
        let before = &text[..start];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |newline| start + newline);
        let shown = (line_end - line_start <= SHOWN_LINE_BYTES).then(|| NamedSource::new(file, text.to_owned()));
        let place = Place {
            line: before.matches('\n').count() + 1,
            column: text[line_start..start].chars().count() + 1,
            // One line is enough to show where.
            bytes: start..end.min(line_end).max(start),
            shown,
        };
        Self(Box::new(Inner {
            file: file.to_owned(),
            place: Some(place),
            problem: problem.into(),
            remedy: remedy.into(),
        }))
    }

    /// A refusal that concerns a whole file.
    #[must_use]
    pub fn whole(file: &str, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self(Box::new(Inner { file: file.to_owned(), place: None, problem: problem.into(), remedy: remedy.into() }))
    }

    /// A refusal because the file could not be read at all.
    #[must_use]
    pub fn unreadable(path: &Path, error: &std::io::Error) -> Self {
        let remedy = match error.kind() {
            std::io::ErrorKind::NotFound => "give the path of an existing file",
            std::io::ErrorKind::PermissionDenied => "make the file readable",
            _ => "check the file and the disk it is on",
        };
        Self::whole(&path.display().to_string(), format!("cannot be read: {error}"), remedy)
    }

    /// A refusal by the TOML reader: broken syntax, an unknown key, a value of the wrong kind.
    #[must_use]
    pub fn toml(file: &str, text: &str, error: &toml::de::Error) -> Self {
        let message = error.message().trim();
        let remedy = if message.starts_with("unknown field") {
            "correct the key or remove it; keys that mean nothing are refused, so that a slip of the pen is seen"
        } else if message.starts_with("missing field") {
            "add the key to this table"
        } else if message.starts_with("invalid type") {
            "write a value of the kind that is expected"
        } else {
            "correct the TOML at this place"
        };
        Self::at(file, text, error.span().unwrap_or(0..0), message, remedy)
    }

    /// The file, as it was named by the caller.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.0.file
    }

    /// Line, counted from 1; `None` where the whole file is meant.
    #[must_use]
    pub fn line(&self) -> Option<usize> {
        self.0.place.as_ref().map(|place| place.line)
    }

    /// Column in characters, counted from 1; `None` where the whole file is meant.
    #[must_use]
    pub fn column(&self) -> Option<usize> {
        self.0.place.as_ref().map(|place| place.column)
    }

    /// What is wrong.
    #[must_use]
    pub fn problem(&self) -> &str {
        &self.0.problem
    }

    /// What would be right.
    #[must_use]
    pub fn remedy(&self) -> &str {
        &self.0.remedy
    }
}

/// Reads a file as text.
///
/// # Errors
/// The file cannot be read, or is not UTF-8; then with line and column.
pub fn read_text(path: &Path) -> Result<String, InputError> {
    let bytes = std::fs::read(path).map_err(|error| InputError::unreadable(path, &error))?;
    text_of(&path.display().to_string(), bytes)
}

/// The bytes of a file as text; `file` is the name that errors give it.
///
/// # Errors
/// They are not UTF-8; with line and column.
pub fn text_of(file: &str, bytes: Vec<u8>) -> Result<String, InputError> {
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let lossy = String::from_utf8_lossy(error.as_bytes());
        let problem = format!("byte 0x{:02X} is not UTF-8 text", error.as_bytes()[at]);
        InputError::at(file, &lossy, at..at + 1, problem, "save the file as UTF-8 (or plain ASCII) text")
    })
}

fn floor_char_boundary(text: &str, index: usize) -> usize {
    let mut index = index.min(text.len());
    while !text.is_char_boundary(index) {
        index -= 1;
    }
    index
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.file)?;
        if let Some(place) = &self.0.place {
            write!(f, ":{}:{}", place.line, place.column)?;
        }
        write!(f, ": {}", self.0.problem)
    }
}

impl std::error::Error for InputError {}

impl Diagnostic for InputError {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(&self.0.remedy))
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        let shown = self.0.place.as_ref()?.shown.as_ref()?;
        Some(shown)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let place = self.0.place.as_ref()?;
        place.shown.as_ref()?;
        let span = (place.bytes.start, place.bytes.len());
        Some(Box::new(std::iter::once(LabeledSpan::new_with_span(Some("here".to_owned()), span))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_place_counts_lines_and_characters_from_one() {
        let text = "first\nzweite Größe = x\n";
        let at = text.find('x').unwrap_or_default();
        let error = InputError::at("a.toml", text, at..at + 1, "not a number", "write a number");
        assert_eq!((error.line(), error.column()), (Some(2), Some(16)));
        assert_eq!(error.to_string(), "a.toml:2:16: not a number");
    }

    #[test]
    fn a_place_beyond_the_text_or_inside_a_character_is_clipped() {
        for range in [0..99, 99..100, 1..2, 0..0] {
            let error = InputError::at("a", "ö\n", range, "p", "r");
            assert!(error.line().is_some());
        }
    }
}
