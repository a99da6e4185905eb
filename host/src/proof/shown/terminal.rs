//! The screenful.

use std::fmt::Write as _;

use super::super::interval::Share;
use super::super::outcome::Outcome;
use super::super::score::Group;
use super::{demand, interval, number, reached, value};
use crate::proof::target::Unit;
use crate::table::{Side, Table};

/// What was reached, how each way and strength did, and what gave no answer.
#[must_use]
pub fn screenful(outcome: &Outcome) -> String {
    let mut text = String::new();
    let scores = &outcome.scores;
    let mut targets = Table::new(&[
        ("what is to be reached", Side::Left),
        ("wanted", Side::Right),
        ("reached", Side::Right),
        ("95 % interval", Side::Right),
        ("cases", Side::Right),
        ("", Side::Left),
    ]);
    let mut of = "";
    for target in &outcome.targets {
        if target.of != of {
            of = target.of;
            targets.row([of.to_owned()]);
        }
        targets.row([
            format!("  {}", target.what),
            demand(target),
            value(target),
            interval(target),
            target.cases.to_string(),
            reached(target).to_owned(),
        ]);
    }
    // Writing into a string does not fail.
    let _ = write!(text, "{targets}");
    let _ = writeln!(text, "  (?): the interval holds both yes and no; more cases would tell.\n");
    let _ = writeln!(text, "{}", groups("way", &scores.by_way));
    let _ = writeln!(text, "{}", groups("one effect, d", &scores.by_strength));
    let _ = writeln!(text, "{}", groups("effect", &scores.by_effect));
    let _ = writeln!(
        text,
        "  right: verdict. first, exact, in set: the names. set: its mean size. wrong: and confident. ÷ true: rmse held out over the true model's.\n"
    );
    let imitated = scores.imitated;
    if imitated.of > 0 {
        let _ = writeln!(
            text,
            "  Of {} cases with something that is not in the list, {} were named as something else that describes them within half a per cent\n  \
             of the true model on recordings held out.\n",
            imitated.of, imitated.hits
        );
    }
    if !outcome.peers.is_empty() {
        let _ = writeln!(text, "{}", super::peers::rows(&outcome.peers));
    }
    let failed: Vec<_> = outcome.cases.iter().filter(|case| case.failure.is_some()).collect();
    if !failed.is_empty() {
        let _ = writeln!(text, "  Without an answer:");
    }
    for case in failed {
        let why = case.failure.as_deref().unwrap_or_default();
        let _ = writeln!(text, "    {} ({}): {why}", case.case, case.truth.join(" and "));
    }
    text
}

fn groups(heading: &str, groups: &[Group]) -> Table {
    let mut table = Table::new(&[
        (heading, Side::Left),
        ("cases", Side::Right),
        ("right", Side::Right),
        ("first", Side::Right),
        ("exact", Side::Right),
        ("in set", Side::Right),
        ("set", Side::Right),
        ("unexpl.", Side::Right),
        ("wrong", Side::Right),
        ("phase", Side::Right),
        ("÷ true", Side::Right),
    ]);
    for group in groups {
        table.row([
            group.name.clone(),
            group.cases.to_string(),
            share(group.right),
            share(group.first),
            share(group.exact),
            share(group.within),
            group.set.value.map_or_else(String::new, |set| format!("{set:.2}")),
            share(group.unexplained),
            share(group.wrong_and_confident),
            share(group.right_phase),
            group.over_true.value.map_or_else(String::new, |ratio| number(ratio, Unit::Plain)),
        ]);
    }
    table
}

fn share(share: Share) -> String {
    share.share.map_or_else(String::new, |_| format!("{}/{}", share.hits, share.of))
}
