//! The page: order of things, and the sentences between them.

use maud::{Markup, PreEscaped, html};

use super::pictured::{Pictured, pictured, shown_after};
use super::{figure, glossary, map, sheet, spectrum, terminal};
use crate::diagnosis::answer::Answer;
use crate::diagnosis::evidence::evidence;
use crate::diagnosis::{Diagnosis, words};
use crate::report::document::document;

const VERDICT_STYLE: &str = "
.verdict.consistent { border-width: 2px } .verdict.named { border-width: 5px } .verdict.ambiguous { border-style: dashed; border-width: 4px } .verdict.unexplained { border-style: double; border-width: 8px }
.verdict p { margin: .3rem 0; font-size: 1rem }
";

const OWN_STYLE: &str = "
.number { white-space: nowrap } .campaign { margin-top: 0; color: #444 }
.equation { font-family: serif; font-size: 1.15rem; margin: .4rem 0 .4rem 1rem }
.multiples { display: grid; grid-template-columns: repeat(3, 1fr); gap: .4rem 1rem } .multiples figure { margin: 0 } .multiples figcaption { font-size: .82rem; margin-left: .4rem }
.bars { min-width: 7rem } .bar { background: #333; height: .75rem; margin-top: .3rem; min-width: 1px } .rejected .bar { background: #aaa }
.ranking td { font-size: .86rem } .taken td { font-weight: bold; border-bottom: 1px solid #111 } .taken td:last-child { font-weight: normal }
pre { font-size: .78rem; white-space: pre-wrap; border: 1px solid #ccc; padding: .6rem } summary { cursor: pointer }
@media (max-width: 66rem) { .number { white-space: normal } }
@media (max-width: 50rem) { .multiples { grid-template-columns: 1fr } }
";

/// The page as one HTML document without anything outside it. `name` is the campaign's.
#[must_use]
pub fn page(diagnosis: &Diagnosis, answer: &Answer, name: &str) -> String {
    let shown = shown_after(diagnosis);
    let pictures = pictured(diagnosis, answer, &shown);
    let quantity = quantity(diagnosis);
    let title = format!("Does the simulation hold? – {name}");
    let body = html! {
        h1 { "Does the simulation hold?" }
        p.campaign { "Diagnosis of the campaign " strong { (name) } }
        div class={ "verdict " (answer.verdict) } {
            strong { (words::verdict(diagnosis, answer)) }
            p { (words::gain(diagnosis, answer)) }
            @if let Some(sentence) = words::misread(diagnosis) { p { "Left out, it was hidden: " (sentence) "." } }
        }
        p {
            "Recordings of impacts were compared with the simulation that the standard implies. First everything that the experimenter
             states as uncertain was re-tuned within that uncertainty; what still differs was located, "
            (diagnosis.tried.len()) " physical mechanisms were tried as its cause, and the result was tried on recordings that took no part."
        }
        dl { @for (name, value) in sheet::facts(diagnosis) { dt { (name) } dd { (value) } } }
        @if !diagnosis.notes.is_empty() {
            h3 { "To be noted" }
            ul { @for note in &diagnosis.notes { li { (note.to_string()) } } }
        }
        (place_section(diagnosis, answer, &pictures, quantity))
        (what_section(diagnosis, answer))
        h2 { "How much better is it?" }
        (sheet::overall(diagnosis, answer))
        @if diagnosis.problem.recordings.len() > 1 {
            p { "Each recording when it took no part in the fit:" }
            (sheet::left_out(diagnosis))
        }
        (next_section(answer))
        h2 { "All recordings, before and after" }
        p { "Across: time since contact, ms." }
        (legend())
        div.multiples {
            @for picture in &pictures {
                figure {
                    (PreEscaped(figure::recording(picture, quantity, false)))
                    figcaption { strong { (picture.name) } ": " (picture.conditions) }
                }
            }
        }
        (motion_section(diagnosis, &shown))
        h2 { "Every mechanism that was tried" }
        p {
            "The score compares each mechanism with what the re-tuned simulation leaves (bars are logarithmic); the promising ones were
             refitted in full and compared by BIC. What the words mean stands at the end."
        }
        (sheet::ranking(diagnosis, &evidence(diagnosis)))
        h2 { "What was stated, and what re-tuning made of it" }
        (sheet::beliefs(diagnosis))
        (glossary::glossary())
        h2 { "The answer in numbers" }
        details { summary { "JSON, as " code { "--json" } " writes it" } pre { (serde_json::to_string_pretty(&answer.with_notes(&diagnosis.notes)).unwrap_or_default()) } }
    };
    document(&title, &[VERDICT_STYLE, OWN_STYLE], &body)
}

/// The verdict and the recording that is most off, for a page of something else.
#[must_use]
pub fn telling(diagnosis: &Diagnosis, answer: &Answer) -> Markup {
    let pictures = pictured(diagnosis, answer, &shown_after(diagnosis));
    html! {
        style { (PreEscaped(VERDICT_STYLE)) }
        div class={ "verdict " (answer.verdict) } {
            strong { (words::verdict(diagnosis, answer)) }
            p { (words::gain(diagnosis, answer)) }
        }
        (place_figure(answer, &pictures, quantity(diagnosis)))
    }
}

fn quantity(diagnosis: &Diagnosis) -> &'static str {
    match words::unit(diagnosis) {
        "N" => "force, N",
        "m" => "position, m",
        _ => "acceleration, m/s²",
    }
}

fn legend() -> Markup {
    html! { div.legend { @for (swatch, words) in figure::legend() { span { (PreEscaped(swatch)) (words) } } } }
}

fn place_section(diagnosis: &Diagnosis, answer: &Answer, pictures: &[Pictured], quantity: &str) -> Markup {
    html! {
        h2 { "Where does it fail?" }
        @if answer.places.is_empty() {
            p { "Answer: " (words::nowhere(answer)) "." }
        } @else {
            p { "The re-tuned simulation differs from the recordings in these places, the largest share first:" }
            (sheet::places(diagnosis, answer))
        }
        (place_figure(answer, pictures, quantity))
    }
}

fn place_figure(answer: &Answer, pictures: &[Pictured], quantity: &str) -> Markup {
    let telling = pictures.iter().max_by(|a, b| a.misfit.total_cmp(&b.misfit));
    html! {
        @if let Some(picture) = telling {
            figure {
                (PreEscaped(figure::recording(picture, quantity, true)))
                (legend())
                figcaption {
                    "Recording " (picture.name) " (" (picture.conditions) "), in which most is left: above what was observed and simulated, below what each
                     simulation leaves: means of the rest over a fiftieth of the time shown, in standard deviations that noise gives such a mean."
                    @if answer.mechanisms.is_empty() && !picture.has_map { " As nothing had to be added, before and after are the same." }
                    @if picture.has_map { " After is with the map of what has no name." }
                }
            }
        }
    }
}

fn what_section(diagnosis: &Diagnosis, answer: &Answer) -> Markup {
    html! {
        h2 { "What was left out?" }
        @if answer.mechanisms.is_empty() && answer.verdict != "unexplained" {
            p {
                "Nothing that these recordings could show. The table of mechanisms below says, where that can be told, how strong each would have had to be
                 to be seen."
            }
        }
        @for (place, named) in answer.mechanisms.iter().enumerate() { (sheet::named(diagnosis, place, named)) }
        @if answer.verdict == "unexplained" {
            h3 { "Something without a name" }
            p {
                (terminal::unexplained(answer)) ". It is modelled all the same, as a smooth map over stroke, rate of stroke and time: a description, not a
                 cause."
            }
        }
    }
}

fn next_section(answer: &Answer) -> Markup {
    html! {
        h2 { "What to record next" }
        @if answer.advice.is_empty() {
            p { "Nothing in particular: these recordings leave no question open that another one would settle." }
        } @else {
            ul { @for advice in &answer.advice { li { (advice) } } }
        }
    }
}

fn motion_section(diagnosis: &Diagnosis, shown: &[Vec<f64>]) -> Markup {
    html! {
        @if let Some((svg, largest)) = map::figure(diagnosis, shown) {
            h2 { "Where in the motion?" }
            figure {
                (PreEscaped(svg))
                figcaption {
                    "The mean rest over stroke and its rate, from all recordings while touching. The area of a disc is its size (the largest: "
                    (words::short(largest)) " times the noise); black where more was observed than simulated, hollow where less. The way in is above, the way
                     out below: a loss is black above and hollow below, a wrong stiffness the same on both."
                }
            }
        }
        @if let Some(svg) = spectrum::figure(diagnosis, shown) {
            h2 { "In which frequencies?" }
            figure {
                (PreEscaped(svg))
                figcaption {
                    "Spectrum of the rest of all recordings from the contact on: grey before, black after. At 1 (dotted) it is as strong, at
                     that frequency, as the noise before contact."
                }
            }
        }
    }
}
