//! The two tables of a run as they stand in `docs/proof.md`.

use std::fmt::Write as _;

use super::super::interval::Share;
use super::super::outcome::Outcome;
use super::super::score::Group;
use super::{demand, interval, value};

/// The ways of concealing, in words.
const WAYS: [(&str, &str); 6] = [
    ("unnamed", "one effect among ordinary imperfections"),
    ("pairs", "two effects"),
    ("absorbed", "what is stated absorbs it"),
    ("conditional", "in a few recordings"),
    ("unlisted", "not in the list"),
    ("absent", "nothing"),
];

/// What was to be reached and what was, and how each way of concealing did.
#[must_use]
pub fn tables(outcome: &Outcome) -> String {
    let mut text = "| | wanted | reached | 95 % interval | cases |\n|---|---|---|---|---|\n".to_owned();
    for target in &outcome.targets {
        // Writing into a string does not fail.
        let _ = writeln!(
            text,
            "| {}: {} | {} | {} | {} | {} |",
            target.of,
            target.what,
            demand(target),
            value(target),
            interval(target),
            target.cases
        );
    }
    text.push_str("\n| way | cases | right | named first | exact | wrong and confident |\n|---|---|---|---|---|---|\n");
    for group in &outcome.scores.by_way {
        let Group { right, first, exact, wrong_and_confident, .. } = group;
        let shares = [*right, *first, *exact, *wrong_and_confident].map(percent).join(" | ");
        let _ = writeln!(text, "| {} | {} | {shares} |", way(&group.name), group.cases);
    }
    text
}

fn way(name: &str) -> &str {
    WAYS.iter().find(|(way, _)| *way == name).map_or(name, |(_, words)| words)
}

fn percent(share: Share) -> String {
    share.share.map_or_else(String::new, |share| format!("{:.0} %", 100.0 * share))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::proof::score;

    #[test]
    fn every_way_has_words() {
        assert!(score::WAYS.iter().all(|name| way(name) != *name));
    }
}
