//! Peers beside the diagnosis: one table, for the page and for the terminal.

use maud::{Markup, html};

use super::super::interval::{Number, Share};
use super::super::peers::compared::Compared;
use crate::table::{Side, Table};

/// Headings of the shares, and of the medians.
const SHARES: [&str; 6] =
    ["named first", "exact", "false alarms", "“unexplained”", "wrong and confident", "right verdict"];
const MEDIANS: [&str; 2] = ["held out ÷ noise", "÷ true model"];

fn shares(row: &Compared) -> [Share; 6] {
    [row.first, row.exact, row.false_alarm, row.unexplained, row.wrong_and_confident, row.right]
}

fn medians(row: &Compared) -> [Number; 2] {
    [row.over_noise, row.over_true]
}

fn percent(share: Share) -> String {
    share.share.map_or_else(
        || "-".to_owned(),
        |value| {
            format!(
                "{:.0} % ({:.0} to {:.0}; {}/{})",
                100.0 * value,
                100.0 * share.low,
                100.0 * share.high,
                share.hits,
                share.of
            )
        },
    )
}

fn number(number: Number) -> String {
    match (number.value, number.low, number.high) {
        (Some(value), Some(low), Some(high)) => format!("{value:.3} ({low:.3} to {high:.3})"),
        (Some(value), ..) => format!("{value:.3}"),
        _ => "-".to_owned(),
    }
}

/// On the page.
pub(super) fn table(rows: &[Compared]) -> Markup {
    html! {
        p {
            "Each peer starts from the same recordings and the same re-tuned simulation as the diagnosis does; what it says is judged by the same rules. Gradient
             boosting and the Gaussian process name nothing: they can only be right that there is something, and where it is."
        }
        table.groups {
            thead { tr { th { "" } @for heading in SHARES.iter().chain(&MEDIANS) { th.number { (heading) } } } }
            tbody {
                @for row in rows {
                    tr {
                        td { (row.name) }
                        @for share in shares(row) { td.number { (percent(share)) } }
                        @for median in medians(row) { td.number { (number(median)) } }
                    }
                }
            }
        }
        p.note {
            "With 95 % intervals. Named first: one effect of the list. Exact: everything that is hidden and nothing else. False alarms: where nothing is hidden. “Unexplained”:
             of effects that are not in the list. Held out: rmse on recordings left out, median where something is hidden."
        }
    }
}

/// On the terminal.
pub(super) fn rows(rows: &[Compared]) -> Table {
    let headings = ["first", "exact", "false alarms", "unexpl.", "wrong", "right", "÷ noise", "÷ true"];
    let mut columns = vec![("method, same cases", Side::Left)];
    columns.extend(headings.map(|heading| (heading, Side::Right)));
    let mut table = Table::new(&columns);
    for row in rows {
        let counts = shares(row).map(|share| format!("{}/{}", share.hits, share.of));
        let ratios = medians(row).map(|median| median.value.map_or_else(String::new, |value| format!("{value:.3}")));
        table.row(std::iter::once(row.name.clone()).chain(counts).chain(ratios));
    }
    table
}

/// As it stands in `docs/proof.md`.
#[must_use]
pub fn markdown(rows: &[Compared]) -> String {
    let mut text = format!("| | {} |\n|---|", SHARES.iter().chain(&MEDIANS).copied().collect::<Vec<_>>().join(" | "));
    text.push_str(&"---|".repeat(SHARES.len() + MEDIANS.len()));
    for row in rows {
        let cells: Vec<String> = shares(row).map(percent).into_iter().chain(medians(row).map(number)).collect();
        text.push_str(&format!("\n| {} | {} |", row.name, cells.join(" | ")));
    }
    text.push('\n');
    text
}
