//! Tables for the terminal: columns as wide as their widest cell, numbers to the right, words to the left.

use std::fmt;

/// Which side of its column a cell stands at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// A table with a heading over each column.
#[derive(Clone, Debug)]
pub struct Table {
    columns: Vec<(String, Side)>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table with these headings.
    #[must_use]
    pub fn new(columns: &[(&str, Side)]) -> Self {
        Self {
            columns: columns.iter().map(|(heading, side)| ((*heading).to_owned(), *side)).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row; cells that are missing stay empty, superfluous ones are not shown.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let headings: Vec<String> = self.columns.iter().map(|(heading, _)| heading.clone()).collect();
        let cell = |row: &[String], column: usize| row.get(column).cloned().unwrap_or_default();
        for row in std::iter::once(&headings).chain(&self.rows) {
            let mut line = String::new();
            for (column, (_, side)) in self.columns.iter().enumerate() {
                let width = std::iter::once(&headings)
                    .chain(&self.rows)
                    .map(|row| cell(row, column).chars().count())
                    .max()
                    .unwrap_or(0);
                let cell = cell(row, column);
                let blanks = " ".repeat(width - cell.chars().count());
                line.push_str("  ");
                match side {
                    Side::Left => line.extend([cell.as_str(), &blanks]),
                    Side::Right => line.extend([blanks.as_str(), &cell]),
                }
            }
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let mut table = Table::new(&[("force N", Side::Right), ("verdict", Side::Left)]);
        table.row(["7.5".to_owned(), "pass".to_owned()]);
        table.row(["1234.5".to_owned()]);
        assert_eq!(table.to_string(), "  force N  verdict\n      7.5  pass\n   1234.5\n");
    }
}
