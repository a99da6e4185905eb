//! The page: order of things, and the sentences between them.

use maud::{Markup, PreEscaped, html};

use super::super::comparable;
use super::super::followed::Followed;
use super::super::interval::{Number, Share};
use super::super::judged::Judged;
use super::super::outcome::Outcome;
use super::super::score::Group;
use super::super::target::Target;
use super::figure::{self, Bar};
use super::{demand, interval, reached, value};
use crate::report::document::{document, glossary};

const TITLE: &str = "Is what is hidden found?";

const OWN_STYLE: &str = "
td.number, td.reached { white-space: nowrap } .missed td { font-weight: bold } .note { color: #444; font-size: .84rem; font-weight: normal }
.part td { border-bottom: 1px solid #111; padding-top: .8rem; font-style: italic } td.what { white-space: normal; padding-left: 1.2rem }
.groups { font-size: .84rem } .groups th, .groups td { padding: .2rem .35rem }
.cases td, .cases th { font-size: .78rem; padding: .12rem .35rem } .wrong td { font-weight: bold } code { font-size: .86rem; overflow-wrap: anywhere }
.matrix svg { width: auto; max-width: 100% } summary { cursor: pointer }
";

/// The page of a run as one HTML document without anything outside it.
#[must_use]
pub fn page(outcome: &Outcome) -> String {
    let scores = &outcome.scores;
    let body = html! {
        h1 { (TITLE) }
        p {
            "A simulator that shares no code with the diagnosis made " (outcome.cases.len()) " campaigns and hid physics in them, or hid
             nothing. Each was diagnosed by a process that had the campaign and nothing else. Then the answers were opened. This page is the
             comparison."
        }
        (origin(outcome))
        h2 { "What is to be reached, and what was" }
        (targets(&outcome.targets))
        p.note {
            "Intervals hold the true share in 95 of 100 such runs (shares: Wilson; medians: order statistics); a question mark where they hold both yes and no. d is the strength of what
             is hidden: the norm of what the best re-tuned simulation leaves of it, in units of the noise."
        }
        h2 { "By way of concealing" }
        (picture(&scores.by_way, |group| (group.right, None), "The right verdict: for what may be named, named and within the named set; else \
            “unexplained” or “consistent” as it is right. Pairs are two effects at once."))
        (groups(&scores.by_way))
        @if !scores.by_strength.is_empty() {
            h2 { "One effect, by strength" }
            (picture(&scores.by_strength, |group| (group.first, Some(group.within)), "Filled: named first. Outline: within the set that the tool cannot tell apart."))
            (groups(&scores.by_strength))
        }
        h2 { "By effect" }
        (picture(&scores.by_effect, |group| (if group.first.of > 0 { group.first } else { group.right }, (group.first.of > 0).then_some(group.within)),
            "Effects of the list: named first (filled), within the named set (outline). Effects that are not in the list, or were taken out of it: called “unexplained”."))
        @if scores.imitated.of > 0 {
            p {
                "Of " (scores.imitated.of) " cases with something that is not in the list, " (scores.imitated.hits) " were named as something else that describes
                 them within half a per cent of the true model on recordings held out: there, nothing in the data calls for “unexplained”."
            }
        }
        @if !outcome.peers.is_empty() {
            h2 { "Other methods on the same cases" }
            (super::peers::table(&outcome.peers))
        }
        h2 { "Who was taken for whom" }
        figure.matrix {
            (PreEscaped(figure::confusion(&scores.confusion)))
            figcaption {
                "Rows: what was hidden alone (with an asterisk: not in the tool's list, or taken out of it). Columns: what the tool named first, or its
                 verdict. The darker, the larger the share of the row; a heavy frame is where it should be."
            }
        }
        @if !outcome.stories.is_empty() {
            h2 { "Telling cases" }
            dl { @for story in &outcome.stories { dt { (story.name.replace('-', " ")) } dd { (story.about) " (case " (story.case) ")" } } }
        }
        @if !outcome.followed.is_empty() {
            h2 { "The advice, followed" }
            (followed(&outcome.followed))
        }
        h2 { "When it says p, is it p?" }
        (calibration(outcome))
        h2 { "Numbers" }
        (parameters(outcome))
        h2 { "Every case" }
        (cases(&outcome.cases))
        (definitions())
    };
    document(TITLE, &[OWN_STYLE], &body)
}

fn origin(outcome: &Outcome) -> Markup {
    html! {
        dl {
            dt { "seed" } dd { (outcome.origin.seed) ", " (outcome.origin.composition) }
            dt { "answers" }
            dd {
                @if outcome.origin.sealed { "sealed while the campaigns were diagnosed" } @else { "open: from an earlier run, so this is work on the diagnosis and no proof" }
                "; SHA-256 " code { (outcome.origin.answers_sha256) }
            }
            dt { "program" } dd { "SHA-256 " code { (outcome.origin.program_sha256) } }
            dt { "time for a campaign" }
            dd {
                "median " (plain(outcome.scores.seconds.value, 2)) " s, longest " (format!("{:.1}", outcome.scores.longest_s)) " s, all together " (format!("{:.1}", outcome.scores.all_s / 60.0)) " min of a
                 processor; one thread each, " (outcome.origin.jobs) " side by side"
            }
            dt { "rmse, held out" }
            dd {
                "median " (plain(outcome.scores.over_noise.value, 3)) " times the noise before contact; "
                (plain(outcome.scores.over_baseline.value, 3)) " times the re-tuned simulation's where something is hidden"
            }
        }
    }
}

fn plain(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
}

fn targets(targets: &[Target]) -> Markup {
    html! {
        table {
            thead { tr { th { "" } th.number { "wanted" } th.number { "reached" } th.number { "95 % interval" } th.number { "cases" } th { "" } } }
            tbody {
                @for part in targets.chunk_by(|a, b| a.of == b.of) {
                    tr.part { td colspan="6" { (part[0].of) } }
                    @for target in part {
                        tr.missed[target.reached == Some(false)] {
                            td.what { (target.what) @if !target.note.is_empty() { br; span.note { (target.note) } } }
                            td.number { (demand(target)) }
                            td.number { (value(target)) }
                            td.number { (interval(target)) }
                            td.number { (target.cases) }
                            td.reached { (reached(target)) }
                        }
                    }
                }
            }
        }
    }
}

fn followed(followed: &[Followed]) -> Markup {
    html! {
        p {
            "Where an answer could not tell what is hidden from a twin, the recording that it asks for was made three times by the concealing simulator. Apart: the root of what
             the twin alone leaves of χ² beyond what the truth alone leaves, in standard deviations; below 1 is chance."
        }
        table.cases {
            thead {
                tr { th { "case" } th { "hidden" } th { "not told from" } th { "advice" } th.number { "apart before" } th.number { "and after" } th.number { "times" } }
            }
            tbody {
                @for followed in followed {
                    tr.wrong[followed.raised() < 1.5] {
                        td { code { (followed.case) } } td { (followed.truth) } td { (followed.twin) }
                        td { (followed.advice.split_once(" One such").map_or(followed.advice.as_str(), |(asked, _)| asked)) }
                        td.number { (format!("{:.1}", followed.before)) } td.number { (format!("{:.1}", followed.after)) }
                        td.number { (format!("{:.1}", followed.raised())) }
                    }
                }
            }
        }
    }
}

fn picture(groups: &[Group], shares: impl Fn(&Group) -> (Share, Option<Share>), caption: &str) -> Markup {
    let bars: Vec<Bar> = groups
        .iter()
        .map(|group| {
            let (filled, outlined) = shares(group);
            Bar { name: group.name.clone(), filled, outlined }
        })
        .collect();
    html! { figure { (PreEscaped(figure::bars(&bars))) figcaption { (caption) " Lines are 95 % intervals." } } }
}

fn groups(groups: &[Group]) -> Markup {
    html! {
        table.groups {
            thead { tr {
                th { "" } th.number { "cases" } th.number { "right verdict" } th.number { "first" } th.number { "exact" } th.number { "in the set" }
                th.number { "size of set" } th.number { "unexplained" } th.number { "wrong, confident" } th.number { "right phase" } th.number { "held out ÷ true model" }
            } }
            tbody {
                @for group in groups {
                    tr {
                        td { (group.name) }
                        td.number { (group.cases) }
                        @for share in [group.right, group.first, group.exact, group.within] { td.number { (percent(share)) } }
                        td.number { (number(group.set, 2)) }
                        @for share in [group.unexplained, group.wrong_and_confident, group.right_phase] { td.number { (percent(share)) } }
                        td.number { (number(group.over_true, 3)) }
                    }
                }
            }
        }
    }
}

fn percent(share: Share) -> String {
    share.share.map_or_else(String::new, |value| format!("{:.0} %", 100.0 * value))
}

fn number(number: Number, decimals: usize) -> String {
    number.value.map_or_else(String::new, |value| format!("{value:.decimals$}"))
}

fn calibration(outcome: &Outcome) -> Markup {
    html! {
        p {
            "Where nothing is hidden a place with p = 0.01 may turn up in one campaign of a hundred; if it turns up more often, p is too small. A 95 % interval should
             hold the truth in 95 of 100 cases."
        }
        table {
            thead { tr { th { "the smallest p of a place is at most" } th.number { "in this share of the campaigns with nothing hidden" } th.number { "95 % interval" } th.number { "campaigns" } } }
            tbody {
                @for line in &outcome.scores.calibration {
                    tr {
                        td { (line.p) }
                        td.number { @if let Some(share) = line.happened.share { (format!("{:.1} %", 100.0 * share)) } }
                        td.number { (format!("{:.1} to {:.1} %", 100.0 * line.happened.low, 100.0 * line.happened.high)) }
                        td.number { (line.happened.of) }
                    }
                }
            }
        }
        p.note { "A place is told only where it is significant, so that large ps cannot be looked at here." }
    }
}

fn parameters(outcome: &Outcome) -> Markup {
    let rows = outcome.scores.parameters.iter().chain(std::iter::once(&outcome.scores.all_parameters));
    html! {
        p {
            "Parameters of effects that were named rightly and alone, where a number of the concealing simulator means the same as the tool's. How the true value is
             reckoned stands in the last column."
        }
        table {
            thead { tr { th { "mechanism" } th { "parameter" } th.number { "cases" } th.number { "median error" } th.number { "95 % interval held the truth" } th { "true value" } } }
            tbody {
                @for row in rows {
                    tr {
                        td { (row.mechanism) }
                        td { (row.parameter) }
                        td.number { (row.error.of) }
                        td.number { @if let Some(error) = row.error.value { (format!("{:.1} %", 100.0 * error)) } }
                        td.number { (row.covered.hits) " of " (row.covered.of) }
                        td {
                            @for one in comparable::ALL.iter().filter(|one| one.mechanism == row.mechanism && one.parameter == row.parameter) { (one.from) }
                        }
                    }
                }
            }
        }
        details {
            summary { "What cannot be compared, and why" }
            ul { @for (what, why) in comparable::NOT { li { strong { (what) } ": " (why) "." } } }
        }
    }
}

fn cases(cases: &[Judged]) -> Markup {
    let mut order: Vec<&Judged> = cases.iter().collect();
    order.sort_by(|a, b| (&a.way, &a.truth).cmp(&(&b.way, &b.truth)).then(a.d.total_cmp(&b.d)));
    html! {
        details {
            summary { "All " (cases.len()) " cases; bold where the verdict is wrong" }
            table.cases {
                thead { tr {
                    th { "case" } th { "way" } th { "hidden" } th.number { "d" } th.number { "lowest R² as stated" } th { "verdict" } th { "named (or not told from)" }
                    th.number { "held out ÷ noise" } th.number { "÷ true model" } th.number { "s" }
                } }
                tbody {
                    @for case in order {
                        tr.wrong[!case.right] {
                            td { (case.case) }
                            td { (case.way) @if case.kind != "impact" { ", " (case.kind) } }
                            td { (case.truth.join(" and ")) @if case.right_verdict == "unexplained" { " *" } }
                            td.number { (format!("{:.1}", case.d)) }
                            td.number { (format!("{:.4}", case.stated_r_squared)) }
                            td { (case.verdict) @if let Some(why) = &case.failure { ": " (why) } }
                            td { (case.names().join(" + ")) }
                            td.number { (plain(case.over_noise, 3)) }
                            td.number { (plain(case.over_true, 3)) }
                            td.number { (format!("{:.1}", case.seconds)) }
                        }
                    }
                }
            }
        }
    }
}

fn definitions() -> Markup {
    glossary(&[
        ("found", "the verdict is not “consistent”"),
        ("named first", "the first mechanism of the answer is what is hidden (of two effects: one of them)"),
        (
            "exact",
            "the mechanisms named are what is hidden, all and nothing else, and the verdict is not “unexplained”",
        ),
        (
            "within the named set",
            "what is hidden is the first mechanism or one that the answer says it cannot be told from (of two effects: each stands beside one of the names)",
        ),
        (
            "wrong and confident",
            "verdict “named” or “ambiguous” with a mechanism that is not hidden and beside which nothing else is held possible",
        ),
        (
            "right phase",
            "the place with the largest share lies in a phase (before contact, rise, fall, after) that truly holds at least a quarter, or the most, of what the re-tuned baseline leaves of the noise-free recordings",
        ),
        (
            "held out",
            "rmse on recordings that took no part in fitting or choosing, as the tool says it; with its map of the unexplained where it has one. Over the true model's: the rms of what was written less the noise-free recordings",
        ),
        (
            "absorbed",
            "the stated stiffness, masses and speeds are those that hide the effect best: peaks agree and R² exceeds 0.98 before any diagnosis",
        ),
        ("conditional", "the effect acts in a few recordings only"),
        ("no answer", "a process that failed or took too long counts as wrong wherever its case counts"),
    ])
}
