//! The page: what was tried, how good it is, pictures, and what the words mean.

use maud::{Markup, PreEscaped, html};

use super::terminal::cells;
use super::{Tested, figure};
use crate::predict::task::Task;
use crate::predict::trial::Trial;
use crate::report::document::{document, glossary};

const OWN_STYLE: &str = "
.leaky td { color: #666; font-style: italic } .best td { font-weight: bold } .number { white-space: nowrap }
td:nth-child(2) { white-space: nowrap } .groups th { border-bottom: 1px solid #999; text-align: center }
table { font-size: .84rem } th, td { padding: .2rem .4rem }
.multiples { display: grid; grid-template-columns: repeat(2, 1fr); gap: .4rem 1.4rem } .multiples figure { margin: .6rem 0 }
@media (max-width: 50rem) { .multiples { grid-template-columns: 1fr } }
";

/// The page as one HTML document without anything outside it.
#[must_use]
pub fn page(tested: &Tested) -> String {
    let (low, high) = tested.peaks_n();
    let body = html! {
        h1 { "How well is the force foretold?" }
        p {
            "The force of " (tested.dataset.impacts.len()) " impacts was forecast by learners that had seen other impacts, and compared with what was
             recorded. Every figure here is of impacts that took no part in the learning."
        }
        @for task in Task::ALL { (best(tested, task)) }
        dl {
            dt { "campaigns" } dd { (tested.from.join(", ")) }
            dt { "peaks" } dd { (format!("{low:.0} to {high:.0} N, standard deviation {:.0} N", tested.peak_sd_n())) }
            dt { "folds" } dd { (tested.folds) ", of whole " (tested.whole.name()) "s, drawn by seed " (tested.seed) }
        }
        @if !tested.dataset.notes.is_empty() {
            h3 { "To be noted" }
            ul { @for note in &tested.dataset.notes { li { (note) } } }
        }
        h2 { "All forecasts" }
        (table(tested))
        p {
            "In italics and marked " strong { "leaky" } ": an input that is known only when the impact is over. The force is nearly stiffness times stroke,
             so these forecast what has been measured already. They stand here beside the paper, which has them; none is of use before an impact."
        }
        p {
            "The paper's figures are of its own recordings, which are not public, and of folds over samples of the same impacts. scikit-learn's are of the
             very rows and folds of this page."
        }
        @for task in Task::ALL { (pictures(tested, task)) }
        (words_meant())
    };
    document("How well is the force foretold?", &[OWN_STYLE], &body)
}

/// The best trial of a task among those that know nothing that is still to come.
fn honest(tested: &Tested, task: Task) -> Option<&Trial> {
    let of_task = tested.trials.iter().filter(|trial| trial.case.task == task && !trial.case.leaky());
    of_task.min_by(|a, b| a.score.rmse_N.total_cmp(&b.score.rmse_N))
}

fn best(tested: &Tested, task: Task) -> Markup {
    let Some(trial) = honest(tested, task) else { return html! {} };
    let what = match task {
        Task::Profile => "The force over time, before the contact",
        Task::Peak => "The largest force, before the contact",
        Task::Online => "The largest force, from the first 4 ms of the rise, the speed unknown",
    };
    html! {
        p {
            (what) ": " strong { (format!("within {:.1} N in 95 of 100, R² {:.3}", trial.score.error_95_N, trial.score.r_squared)) }
            " (" (trial.case.by()) " from " (trial.case.from()) ")."
        }
    }
}

fn table(tested: &Tested) -> Markup {
    let best: Vec<*const Trial> =
        Task::ALL.iter().filter_map(|task| honest(tested, *task)).map(std::ptr::from_ref).collect();
    html! {
        table {
            thead {
                tr.groups { th colspan="3" {} th colspan="3" { "here" } th colspan="2" { "the paper" } th colspan="2" { "scikit-learn" } th {} }
                tr {
                    th { "forecast" } th { "from" } th { "by" } th.number { "R²" } th.number { "RMSE N" } th.number { "95 % within N" }
                    @for _ in 0..2 { th.number { "R²" } th.number { "RMSE N" } }
                    th {}
                }
            }
            tbody {
                @for trial in &tested.trials {
                    tr.leaky[trial.case.leaky()].best[best.contains(&std::ptr::from_ref(trial))] {
                        @for (place, cell) in cells(trial).into_iter().enumerate() {
                            td.number[(3..10).contains(&place)] { (cell) }
                        }
                    }
                }
            }
        }
    }
}

fn pictures(tested: &Tested, task: Task) -> Markup {
    let heading = match task {
        Task::Profile => "Force over time",
        Task::Peak => "Largest force, before the contact",
        Task::Online => "Largest force, from the first milliseconds of the rise",
    };
    let trials = tested.trials.iter().filter(|trial| trial.case.task == task);
    // Those of the paper, and the best two of ours: all would be a wall.
    let mut ours: Vec<&Trial> =
        trials.clone().filter(|trial| !trial.case.leaky() && trial.case.printed.is_none()).collect();
    ours.sort_by(|a, b| a.score.rmse_N.total_cmp(&b.score.rmse_N));
    ours.truncate(2);
    let shown: Vec<&Trial> = trials.filter(|trial| trial.case.printed.is_some()).chain(ours).collect();
    if shown.is_empty() {
        return html! {};
    }
    html! {
        h2 { (heading) }
        div.legend { @for (swatch, words) in figure::legend(task) { span { (PreEscaped(swatch)) (words) } } }
        div.multiples {
            @for trial in shown {
                figure {
                    (PreEscaped(figure::forecast(trial)))
                    figcaption {
                        strong { (trial.case.by()) } " from " (trial.case.from())
                        @if trial.case.leaky() { " – leaky" }
                        (format!(": R² {:.3}, RMSE {:.1} N", trial.score.r_squared, trial.score.rmse_N))
                    }
                }
            }
        }
    }
}

fn words_meant() -> Markup {
    glossary(&[
        ("profile", "the force at 16 instants, from the contact to 1.4 times the duration of an ideal impact"),
        ("peak", "the largest force, forecast before the contact"),
        (
            "online",
            "the largest force, forecast by the sensor 4 ms after it noticed the contact; from the rise: ωt₄, √(K/m_R) times the time since the contact; F₂/F₄, F₃/F₄, F₄, with the force 2, 3 and 4 ms after",
        ),
        (
            "v, m_R, K, m_H",
            "speed at contact; effective mass of the robot; stiffness of springs and pad in series (online: of the springs); effective mass of the body region",
        ),
        ("q1, q2, q4", "joint angles of the robot"),
        ("δ, δ_max", "stroke of the springs: leaky"),
        ("physics", "v·√(K·m_R), the half sine of the ideal impact; online: F₄/sin(ωt₄)"),
        ("physics+…", "that, times one plus what was learned"),
        ("table", "as many and as deep trees as the sensor carries"),
        ("force", "through the filter of the verdict, 100 Hz, forward and back"),
        (
            "R²",
            "share of the variance that is foretold; 1 is all of it. Where forces differ much, it is near 1 for poor forecasts too: look at the newtons",
        ),
    ])
}
