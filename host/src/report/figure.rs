//! Force over time as SVG: lines that differ in weight and dash, bands, and marks with words on them.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::plot::{Area, Axes, FONT, Failure, svg};

/// How a line is drawn, and so what it means in every figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stroke {
    /// Thin and grey: the unfiltered force.
    Raw,
    /// Heavy and black: the judged force.
    Judged,
    /// Dotted: what was true.
    Truth,
    /// Dots: the samples themselves.
    Samples,
}

/// A line of points: time and force.
#[derive(Clone, Debug)]
pub(super) struct Line {
    pub(super) stroke: Stroke,
    pub(super) points: Vec<(f64, f64)>,
}

/// A level over the whole width or a part of it, with a word at its right end.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) value: f64,
    /// The guard band around it.
    pub(super) guard: Option<(f64, f64)>,
    pub(super) label: String,
}

/// An instant, with a word at the top.
#[derive(Clone, Debug)]
pub(super) struct Instant {
    pub(super) at: f64,
    pub(super) label: String,
    /// Dotted: an instant that was true rather than sensed.
    pub(super) truth: bool,
    /// In which row of words the label stands, from the top; so that near labels do not cover each other.
    pub(super) row: i32,
    /// A short stroke at the top instead of a line over the whole height, which could hide a short pulse.
    pub(super) tick: bool,
}

/// A point with a word beside it.
#[derive(Clone, Debug)]
pub(super) struct Spot {
    pub(super) at: (f64, f64),
    pub(super) label: String,
}

/// A figure.
#[derive(Clone, Debug)]
pub(super) struct Figure {
    pub(super) size: (u32, u32),
    pub(super) x: (f64, f64),
    pub(super) y: (f64, f64),
    pub(super) x_label: &'static str,
    pub(super) y_label: &'static str,
    /// A shaded stretch of time with its name.
    pub(super) window: Option<(f64, f64, &'static str)>,
    pub(super) lines: Vec<Line>,
    pub(super) levels: Vec<Level>,
    pub(super) instants: Vec<Instant>,
    pub(super) spots: Vec<Spot>,
}

const GREY: RGBColor = RGBColor(125, 125, 125);
const WINDOW: RGBColor = RGBColor(244, 244, 241);
const GUARD: RGBColor = RGBColor(222, 222, 218);
const ROW: i32 = 15;

impl Figure {
    /// The figure as an SVG element.
    pub(super) fn svg(&self) -> String {
        svg(self.size, |area| self.draw(area))
    }

    fn draw(&self, area: &Area<'_>) -> Result<(), Failure> {
        let rows = self.instants.iter().map(|instant| instant.row + 1).max().unwrap_or(0);
        let axes = Axes {
            x: self.x,
            y: self.y,
            x_words: Some(self.x_label),
            y_words: self.y_label,
            ticks: (9, 8),
            font: 13,
            top: 10 + rows * ROW,
        };
        let mut chart = axes.empty(area)?;
        let inside = |x: f64| x.clamp(self.x.0, self.x.1);
        if let Some((from, to, _)) = self.window {
            let shade = Rectangle::new([(inside(from), self.y.0), (inside(to), self.y.1)], WINDOW.filled());
            chart.draw_series(std::iter::once(shade))?;
        }
        for level in &self.levels {
            if let Some((low, high)) = level.guard {
                let corners = [(inside(level.from), low.max(self.y.0)), (inside(level.to), high.min(self.y.1))];
                if corners[0].1 < corners[1].1 {
                    chart.draw_series(std::iter::once(Rectangle::new(corners, GUARD.filled())))?;
                }
            }
        }
        axes.draw(&mut chart)?;
        for line in &self.lines {
            // What lies outside would be drawn on the frame, as a value that is not.
            for points in self.runs(&line.points) {
                let points = points.iter().copied();
                match line.stroke {
                    Stroke::Raw => {
                        chart.draw_series(LineSeries::new(points, GREY.stroke_width(1)))?;
                    }
                    Stroke::Judged => {
                        chart.draw_series(LineSeries::new(points, BLACK.stroke_width(3)))?;
                    }
                    Stroke::Truth => {
                        chart.draw_series(DashedLineSeries::new(points, 2, 4, BLACK.stroke_width(2)))?;
                    }
                    Stroke::Samples => {
                        chart.draw_series(points.map(|point| Circle::new(point, 2, BLACK.filled())))?;
                    }
                }
            }
        }
        let mut labels: Vec<Word> = Vec::new();
        for level in &self.levels {
            let ends = [(inside(level.from), level.value), (inside(level.to), level.value)];
            if !(self.y.0..=self.y.1).contains(&level.value) || ends[0].0 >= ends[1].0 {
                continue;
            }
            chart.draw_series(DashedLineSeries::new(ends, 9, 5, BLACK.stroke_width(2)))?;
            let style = (FONT, 13).into_font().color(&BLACK).pos(Pos::new(HPos::Right, VPos::Bottom));
            let place = EmptyElement::at(ends[1]) + Text::new(level.label.clone(), (-4, -3), style);
            chart.draw_series(std::iter::once(place))?;
            let (x, y) = chart.backend_coord(&ends[1]);
            labels.push(Word { x: (x - 4 - width(&level.label), x - 4), y: (y - 3 - HEIGHT, y - 3) });
        }
        if let Some((from, to, name)) = self.window
            && inside(to) > inside(from)
        {
            let style = (FONT, 13).into_font().color(&BLACK).pos(Pos::new(HPos::Right, VPos::Bottom));
            let place = EmptyElement::at((inside(to), self.y.0)) + Text::new(name, (-4, -4), style);
            chart.draw_series(std::iter::once(place))?;
        }
        for instant in &self.instants {
            if !(self.x.0..=self.x.1).contains(&instant.at) {
                continue;
            }
            let foot = if instant.tick { self.y.1 - 0.08 * (self.y.1 - self.y.0) } else { self.y.0 };
            let ends = [(instant.at, foot), (instant.at, self.y.1)];
            let (x, top) = chart.backend_coord(&(instant.at, self.y.1));
            if instant.truth {
                chart.draw_series(DashedLineSeries::new(ends, 2, 4, BLACK.stroke_width(1)))?;
            } else {
                let (_, foot) = chart.backend_coord(&ends[0]);
                for (from, to) in around(&labels, x, (top, foot)) {
                    area.draw(&PathElement::new(vec![(x, from), (x, to)], BLACK.stroke_width(1)))?;
                }
            }
            let right = (instant.at - self.x.0) > 0.7 * (self.x.1 - self.x.0);
            let side = if right { HPos::Right } else { HPos::Left };
            let style = (FONT, 13).into_font().color(&BLACK).pos(Pos::new(side, VPos::Bottom));
            let shift = if right { -3 } else { 3 };
            area.draw(&Text::new(instant.label.clone(), (x + shift, top - 2 - (rows - 1 - instant.row) * ROW), style))?;
            // A stroke from the frame up to the word.
            let stem = vec![(x, top), (x, top - 2 - (rows - 1 - instant.row) * ROW - 8)];
            area.draw(&PathElement::new(stem, BLACK.stroke_width(1)))?;
        }
        for spot in &self.spots {
            let style = (FONT, 13).into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
            let levels: Vec<i32> =
                self.levels.iter().map(|level| chart.backend_coord(&(level.to, level.value)).1).collect();
            let (x, y) = chart.backend_coord(&spot.at);
            let shift = clear((x + 9, x + 9 + width(&spot.label)), y, &levels, &labels);
            let place = EmptyElement::at(spot.at)
                + Circle::new((0, 0), 4, BLACK.stroke_width(2))
                + Text::new(spot.label.clone(), (9, shift), style);
            chart.draw_series(std::iter::once(place))?;
        }
        Ok(())
    }

    /// The stretches of a line that lie inside the frame.
    fn runs<'a>(&self, points: &'a [(f64, f64)]) -> impl Iterator<Item = &'a [(f64, f64)]> {
        let (across, up) = (self.x, self.y);
        let inside = move |(x, y): &(f64, f64)| (across.0..=across.1).contains(x) && (up.0..=up.1).contains(y);
        points.chunk_by(move |a, b| inside(a) == inside(b)).filter(move |run| inside(&run[0]))
    }
}

/// Height of a word, pixels.
const HEIGHT: i32 = 13;

/// Where a word stands: from left to right and from top to foot, in pixels, downward.
#[derive(Clone, Copy, Debug)]
struct Word {
    x: (i32, i32),
    y: (i32, i32),
}

/// About how wide a word is, pixels: the reader's font is not known here.
fn width(word: &str) -> i32 {
    6 * word.chars().count() as i32
}

/// An upright line's parts that run through no word, from its top down.
fn around(words: &[Word], x: i32, (top, foot): (i32, i32)) -> Vec<(i32, i32)> {
    let mut hit: Vec<Word> = words.iter().copied().filter(|word| (word.x.0..=word.x.1).contains(&x)).collect();
    hit.sort_by_key(|word| word.y.0);
    let mut parts = Vec::new();
    let mut from = top;
    for word in hit {
        parts.push((from, word.y.0.min(foot)));
        from = from.max(word.y.1);
    }
    parts.push((from, foot));
    parts.retain(|(from, to)| from < to);
    parts
}

/// How far from a spot its word stands, downward: where no level runs through it and no level's word stands.
fn clear(x: (i32, i32), spot: i32, levels: &[i32], words: &[Word]) -> i32 {
    /// Half the height of a word, and a little.
    const HALF: i32 = 9;
    let beside = |shift: i32, word: &Word| {
        x.1 < word.x.0 || word.x.1 < x.0 || spot + shift + HEIGHT / 2 < word.y.0 || word.y.1 < spot + shift - HEIGHT / 2
    };
    let free = |shift: &i32| {
        levels.iter().all(|level| (spot + shift - level).abs() > HALF) && words.iter().all(|word| beside(*shift, word))
    };
    [-9, 11, -28, 30].into_iter().find(free).unwrap_or(-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_stands_where_nothing_runs_through_it() {
        let clear = |levels: &[i32], words: &[Word]| clear((50, 120), 100, levels, words);
        assert_eq!(clear(&[], &[]), -9);
        assert_eq!(clear(&[95], &[]), 11, "the level just above the spot");
        assert_eq!(clear(&[91, 112], &[]), -28, "one above and one below");
        assert_eq!(clear(&[300], &[]), -9);
        assert_eq!(clear(&[], &[Word { x: (100, 300), y: (84, 97) }]), 11, "a level's word");
        assert_eq!(clear(&[], &[Word { x: (130, 300), y: (84, 97) }]), -9, "the same, further right");
    }

    #[test]
    fn an_upright_line_leaves_words_out() {
        let word = Word { x: (50, 120), y: (40, 53) };
        assert_eq!(around(&[word], 80, (10, 200)), [(10, 40), (53, 200)]);
        assert_eq!(around(&[word], 130, (10, 200)), [(10, 200)]);
        assert_eq!(around(&[word], 80, (45, 200)), [(53, 200)], "the word covers its top");
    }
}
