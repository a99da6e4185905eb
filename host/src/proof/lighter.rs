//! A page with the same pictures in fewer bytes, for pages that are kept with the documentation.
//!
//! A picture is drawn on a grid of pixels and a recording has many samples on each: of those above one another only the first, the lowest,
//! the highest and the last can be seen. Lines of one kind that follow each other (the dashes of a dashed one) become one path, and attributes
//! that say what holds anyway are left out.

/// What is said too long in a picture, and how it is said as well.
const SHORTER: [(&str, &str); 4] =
    [(" opacity=\"1\"", ""), (" stroke-width=\"1\"", ""), (" stroke=\"none\"", ""), ("=\"#000000\"", "=\"#000\"")];

const LINE: &str = "<polyline ";

/// The page with lighter pictures.
#[must_use]
pub fn lighter(page: &str) -> String {
    let shorter = SHORTER.iter().fold(page.to_owned(), |page, (long, short)| page.replace(long, short));
    let mut rest = shorter.as_str();
    let mut light = String::with_capacity(rest.len());
    while let Some(begin) = rest.find(LINE) {
        light.push_str(&rest[..begin]);
        rest = &rest[begin..];
        let Some((mut line, mut behind)) = Line::read(rest) else {
            light.push_str(LINE);
            rest = &rest[LINE.len()..];
            continue;
        };
        while let Some((next, further)) = Line::read(behind.trim_start())
            && next.before == line.before
            && next.after == line.after
        {
            line.d.push_str(&next.d);
            behind = further;
        }
        light.push_str(&format!("<path {}d=\"{}\"{}", line.before, line.d, line.after));
        rest = behind;
    }
    light.push_str(rest);
    light
}

/// A line of a picture.
struct Line<'a> {
    /// What its tag says before the points.
    before: &'a str,
    /// The points as a path.
    d: String,
    /// What it says behind them.
    after: &'a str,
}

impl<'a> Line<'a> {
    /// The line that a text begins with, and what follows. None: it begins with something else, or its points are no whole numbers.
    fn read(text: &'a str) -> Option<(Self, &'a str)> {
        let tag = text.strip_prefix(LINE)?;
        let (tag, rest) = tag.split_at(tag.find("/>")? + 2);
        let (before, points) = tag.split_once("points=\"")?;
        let (points, after) = points.split_once('"')?;
        let points = thinned(points)?;
        let (first, others) = points.split_first()?;
        let others: Vec<String> = others.iter().map(|(x, y)| format!("{x},{y}")).collect();
        let d = if others.is_empty() {
            format!("M{},{}", first.0, first.1)
        } else {
            format!("M{},{}L{}", first.0, first.1, others.join(" "))
        };
        Some((Self { before, d, after }, rest))
    }
}

/// Points without those that lie between others of the same column or on the same level. None where they are not whole numbers.
fn thinned(points: &str) -> Option<Vec<(i64, i64)>> {
    let points: Vec<(i64, i64)> = points
        .split_whitespace()
        .map(|point| {
            let (x, y) = point.split_once(',')?;
            Some((x.parse().ok()?, y.parse().ok()?))
        })
        .collect::<Option<_>>()?;
    let mut kept: Vec<(i64, i64)> = Vec::with_capacity(points.len());
    for column in points.chunk_by(|a, b| a.0 == b.0) {
        let lowest = (0..column.len()).min_by_key(|place| column[*place].1);
        let highest = (0..column.len()).max_by_key(|place| column[*place].1);
        let mut places: Vec<usize> =
            [Some(0), lowest, highest, column.len().checked_sub(1)].into_iter().flatten().collect();
        places.sort_unstable();
        places.dedup();
        kept.extend(places.into_iter().map(|place| column[place]));
    }
    let between = |a: (i64, i64), b: (i64, i64), c: (i64, i64)| {
        (a.1 == b.1 && b.1 == c.1 && (a.0 <= b.0) == (b.0 <= c.0))
            || (a.0 == b.0 && b.0 == c.0 && (a.1 <= b.1) == (b.1 <= c.1))
    };
    let mut ends: Vec<(i64, i64)> = Vec::with_capacity(kept.len());
    for point in kept {
        if let [.., before, last] = ends[..]
            && between(before, last, point)
        {
            ends.pop();
        }
        ends.push(point);
    }
    Some(ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_keeps_its_ends_and_extremes_and_a_level_its_ends() {
        assert_eq!(thinned("1,5 1,9 1,2 1,7 2,4 ").unwrap(), [(1, 5), (1, 9), (1, 2), (1, 7), (2, 4)]);
        assert_eq!(thinned("1,5 1,6 1,7 1,9").unwrap(), [(1, 5), (1, 9)]);
        assert_eq!(thinned("1,5 2,5 3,5 4,5 5,6").unwrap(), [(1, 5), (4, 5), (5, 6)]);
        assert_eq!(thinned("1.5,2 3,4"), None);
    }

    #[test]
    fn dashes_of_one_line_become_one_path() {
        let page = "<svg>\n<polyline stroke=\"#969696\" points=\"1,1 2,1 3,1 \"/>\n<polyline stroke=\"#969696\" points=\"5,1 7,1\"/>\n\
                    <polyline stroke=\"#000000\" points=\"5,2 \"/></svg>";
        assert_eq!(
            lighter(page),
            "<svg>\n<path stroke=\"#969696\" d=\"M1,1L3,1M5,1L7,1\"/>\n<path stroke=\"#000\" d=\"M5,2\"/></svg>"
        );
    }

    #[test]
    fn what_is_no_line_of_whole_numbers_stays() {
        let page = "<p>3 points=all, opacity of 1, a <polyline </p><svg><polyline points=\"1.5,1 2,1\"/></svg>";
        assert_eq!(lighter(page), page);
    }
}
