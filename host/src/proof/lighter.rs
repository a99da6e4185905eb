//! A page with the same pictures in fewer bytes, for pages that are kept with the documentation.
//!
//! A picture is drawn on a grid of pixels and a recording has many samples on each: of those above one another only the first, the lowest,
//! the highest and the last can be seen. Attributes that say what holds anyway are left out.

/// What an attribute of a picture says that holds anyway.
const IDLE: [&str; 2] = [" opacity=\"1\"", " stroke-width=\"1\""];

/// The page with lighter pictures.
#[must_use]
pub fn lighter(page: &str) -> String {
    let mut rest = page.to_owned();
    for idle in IDLE {
        rest = rest.replace(idle, "");
    }
    let mut light = String::with_capacity(rest.len());
    let mut parts = rest.split("points=\"");
    light.push_str(parts.next().unwrap_or_default());
    for part in parts {
        light.push_str("points=\"");
        match part.split_once('"') {
            Some((points, behind)) => {
                light.push_str(&thinned(points).unwrap_or_else(|| points.to_owned()));
                light.push('"');
                light.push_str(behind);
            }
            None => light.push_str(part),
        }
    }
    light
}

/// Points without those that lie between others of the same column. None where they are not whole numbers.
fn thinned(points: &str) -> Option<String> {
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
    // Of points on a level or in a column the ends.
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
    Some(ends.iter().map(|(x, y)| format!("{x},{y}")).collect::<Vec<_>>().join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_keeps_its_ends_and_extremes_and_a_level_its_ends() {
        assert_eq!(thinned("1,5 1,9 1,2 1,7 2,4 ").unwrap(), "1,5 1,9 1,2 1,7 2,4");
        assert_eq!(thinned("1,5 1,6 1,7 1,9").unwrap(), "1,5 1,9");
        assert_eq!(thinned("1,5 2,5 3,5 4,5 5,6").unwrap(), "1,5 4,5 5,6");
        assert_eq!(thinned("1.5,2 3,4"), None);
    }

    #[test]
    fn what_is_no_picture_stays() {
        let page = "<p>3 points=all, opacity of 1</p><svg><polyline stroke-width=\"1\" points=\"1,1 2,1 3,1 \"/></svg>";
        assert_eq!(lighter(page), "<p>3 points=all, opacity of 1</p><svg><polyline points=\"1,1 3,1\"/></svg>");
    }
}
