//! Pictures of a run: shares with their intervals as bars, and who was taken for whom as a chequered table. Black, greys and
//! outlines only, so that they can be printed.

use std::collections::BTreeSet;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::interval::Share;
use super::super::score::Confusion;
use crate::report::plot::{FONT, GRID, svg};

const BAR: RGBColor = RGBColor(165, 165, 165);
const WIDTH: u32 = 940;
/// Height of a row.
const ROW: i32 = 22;
/// Pixels for names at the left.
const NAMES: i32 = 270;
/// Pixels for counts at the right.
const COUNTS: i32 = 110;
/// Pixels for the scale at the top.
const HEAD: i32 = 24;

fn words(side: HPos) -> TextStyle<'static> {
    (FONT, 13).into_font().color(&BLACK).pos(Pos::new(side, VPos::Center))
}

/// A bar: its name, the share of the filled part with its interval, and a wider share as an outline around it.
pub(super) struct Bar {
    pub(super) name: String,
    pub(super) filled: Share,
    pub(super) outlined: Option<Share>,
}

/// Bars from 0 to 100 %; a line over each filled bar is its 95 % interval.
pub(super) fn bars(bars: &[Bar]) -> String {
    let height = HEAD + ROW * bars.len() as i32 + 8;
    let span = WIDTH as i32 - NAMES - COUNTS;
    let x = |share: f64| NAMES + (share * f64::from(span)) as i32;
    svg((WIDTH, height as u32), |area| {
        for tenth in 0..=5 {
            let share = f64::from(tenth) / 5.0;
            let line = vec![(x(share), HEAD - 4), (x(share), height - 6)];
            area.draw(&PathElement::new(line, GRID.stroke_width(1)))?;
            area.draw(&Text::new(format!("{:.0} %", 100.0 * share), (x(share), HEAD - 13), words(HPos::Center)))?;
        }
        for (row, bar) in bars.iter().enumerate() {
            let middle = HEAD + ROW * row as i32 + ROW / 2;
            let (top, foot) = (middle - 6, middle + 6);
            area.draw(&Text::new(bar.name.clone(), (NAMES - 8, middle), words(HPos::Right)))?;
            if let Some(share) = bar.outlined.and_then(|share| share.share) {
                area.draw(&Rectangle::new([(x(0.0), top), (x(share), foot)], BLACK.stroke_width(1)))?;
            }
            let Some(share) = bar.filled.share else { continue };
            area.draw(&Rectangle::new([(x(0.0), top), (x(share), foot)], BAR.filled()))?;
            let (low, high) = (x(bar.filled.low), x(bar.filled.high));
            area.draw(&PathElement::new(vec![(low, middle), (high, middle)], BLACK.stroke_width(2)))?;
            for end in [low, high] {
                area.draw(&PathElement::new(vec![(end, middle - 4), (end, middle + 4)], BLACK.stroke_width(2)))?;
            }
            let counts = match bar.outlined {
                Some(wide) => format!("{} ({}) of {}", bar.filled.hits, wide.hits, bar.filled.of),
                None => format!("{} of {}", bar.filled.hits, bar.filled.of),
            };
            area.draw(&Text::new(counts, (x(1.0) + 10, middle), words(HPos::Left)))?;
        }
        Ok(())
    })
}

/// Side of a cell.
const CELL: i32 = 19;
/// Pixels for the words at the top, which stand upright.
const TOP: i32 = 170;

/// Rows: what was hidden. Columns: what was said first. The darker, the more often.
pub(super) fn confusion(rows: &[Confusion]) -> String {
    let mut said: BTreeSet<&str> = rows.iter().flat_map(|row| row.said.keys().map(String::as_str)).collect();
    let last: Vec<&str> =
        ["unexplained", "consistent", "failed"].into_iter().filter(|word| said.remove(word)).collect();
    // Names in the order of the rows, so that what is right lies on the diagonal.
    let mut columns: Vec<&str> = Vec::new();
    for row in rows.iter().filter(|row| row.nameable) {
        said.remove(row.truth.as_str());
        columns.push(&row.truth);
    }
    columns.extend(said);
    columns.extend(last);
    let width = NAMES + CELL * columns.len() as i32 + 12;
    let height = TOP + CELL * rows.len() as i32 + 12;
    svg((width as u32, height as u32), |area| {
        for (at, column) in columns.iter().enumerate() {
            let x = NAMES + CELL * at as i32 + CELL / 2;
            let style = (FONT, 13)
                .into_font()
                .transform(FontTransform::Rotate270)
                .color(&BLACK)
                .pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new((*column).to_owned(), (x, TOP - 6), style))?;
        }
        for (number, row) in rows.iter().enumerate() {
            let top = TOP + CELL * number as i32;
            let count: usize = row.said.values().sum();
            let name =
                if row.nameable || row.truth == "nothing" { row.truth.clone() } else { format!("{} *", row.truth) };
            area.draw(&Text::new(name, (NAMES - 8, top + CELL / 2), words(HPos::Right)))?;
            for (at, column) in columns.iter().enumerate() {
                let left = NAMES + CELL * at as i32;
                let corners = [(left, top), (left + CELL, top + CELL)];
                let times = row.said.get(*column).copied().unwrap_or(0);
                if times > 0 {
                    let share = times as f64 / count as f64;
                    let grey = (235.0 - 190.0 * share) as u8;
                    area.draw(&Rectangle::new(corners, RGBColor(grey, grey, grey).filled()))?;
                    let ink = if share > 0.45 { &WHITE } else { &BLACK };
                    let style = (FONT, 12).into_font().color(ink).pos(Pos::new(HPos::Center, VPos::Center));
                    area.draw(&Text::new(times.to_string(), (left + CELL / 2, top + CELL / 2), style))?;
                }
                area.draw(&Rectangle::new(corners, GRID.stroke_width(1)))?;
            }
        }
        // Over the lines of all others: where it should be.
        for (number, row) in rows.iter().enumerate() {
            let right = match (row.nameable, row.truth.as_str()) {
                (true, truth) => truth,
                (false, "nothing") => "consistent",
                (false, _) => "unexplained",
            };
            if let Some(at) = columns.iter().position(|column| *column == right) {
                let (left, top) = (NAMES + CELL * at as i32, TOP + CELL * number as i32);
                let corners = [(left, top), (left + CELL, top + CELL)];
                area.draw(&Rectangle::new(corners, BLACK.stroke_width(2)))?;
            }
        }
        Ok(())
    })
}
