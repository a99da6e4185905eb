//! The page: order of things, and the sentences between them.

use maud::{Markup, PreEscaped, html};

use super::{figure, left, short, verdict};
use crate::contact_law::answer::Answer;
use crate::contact_law::depth::Source;
use crate::contact_law::found_model::NearestModel;
use crate::contact_law::identification::Identification;
use crate::contact_law::law::Damping;
use crate::report::document::document;

const OWN_STYLE: &str = "
.verdict.identified { border-width: 4px } .verdict.ambiguous { border-style: dashed; border-width: 4px } .verdict p { margin: .3rem 0; font-size: 1rem }
.campaign { margin-top: 0; color: #444 } .number { white-space: nowrap } .named td { font-weight: bold }
.multiples { display: grid; grid-template-columns: repeat(2, 1fr); gap: .4rem 1rem } .multiples figure { margin: 0 } .multiples figcaption { font-size: .85rem; margin-left: .4rem }
pre { font-size: .78rem; white-space: pre-wrap; border: 1px solid #ccc; padding: .6rem } summary { cursor: pointer }
@media (max-width: 50rem) { .multiples { grid-template-columns: 1fr } }
";

/// The page as one HTML document without anything outside it. `name` is the campaign's.
#[must_use]
pub fn page(found: &Identification, answer: &Answer, nearest: &NearestModel, name: &str) -> String {
    let title = format!("Which contact law holds? – {name}");
    let body = html! {
        h1 { "Which contact law holds?" }
        p.campaign { "Identification of the campaign " strong { (name) } }
        div class={ "verdict " (answer.verdict) } {
            strong { (verdict(found)) "." }
            p { (left(found)) "." }
        }
        p {
            "A contact law says which force answers a depth δ and its rate. " (found.laws.len()) " laws were fitted to all "
            (found.recordings.len()) " recordings together and judged on recordings that took no part; the simplest one that is not worse than the
             best is named."
        }
        (sentences("What cannot be identified", &found.cannot))
        (sentences("To be noted", &found.notes))
        (unused(found))
        h2 { "The law" }
        p { (found.law().law.equation) ". " (found.law().law.source) "." }
        (parameters(found))
        h2 { "Every law, on recordings that took no part" }
        figure {
            (PreEscaped(figure::held_out(found)))
            figcaption { "What a law leaves, over the noise before contact (logarithmic). 1 is as good as can be." }
        }
        (laws(found))
        h2 { "Force over depth" }
        p {
            "Grey and wide: recorded" (match found.source {
                Source::Measured => ", over the measured depth",
                Source::Reconstructed => ", over the depth that force, mass and speed give by integrating twice",
            })
            ". Thin and black: the law. Recordings of the lowest, a middle and the highest peak. Below each: what the law leaves of them, the lowest peak in grey, the highest heavy; dotted: ±2 standard deviations of noise."
        }
        div.multiples {
            @for law in figure::distinct(found).into_iter().map(|place| &found.laws[place]) {
                figure {
                    (PreEscaped(figure::loops(found, law)))
                    figcaption { strong { (figure::names(found, law.law)) } ": " (law.law.equation) "; rest " (short(law.rmse_n)) " N rms" }
                }
            }
        }
        h2 { "Restitution against speed" }
        figure {
            (PreEscaped(figure::restitution(found)))
            div.legend { @for (swatch, words) in figure::legend(found) { span { (PreEscaped(swatch)) (words) } } }
            figcaption {
                "The speed of the rebound over that of the approach, as each law's own motion has it"
                @if found.laws.iter().any(|law| matches!(law.law.damping, Damping::Dashpot)) { " (with a dashpot: at " (short(found.mass_kg)) " kg)" }
                ". What a law claims, such as c = 1 − α·v, may differ: see the table above."
            }
        }
        (model(nearest))
        h2 { "The recordings" }
        (recordings(found))
        h2 { "The answer in numbers" }
        details { summary { "JSON, as " code { "--json" } " writes it" } pre { (serde_json::to_string_pretty(answer).unwrap_or_default()) } }
    };
    document(&title, &[OWN_STYLE], &body)
}

fn sentences(heading: &str, sentences: &[String]) -> Markup {
    html! {
        @if !sentences.is_empty() {
            h3 { (heading) }
            ul { @for sentence in sentences { li { (sentence) "." } } }
        }
    }
}

fn unused(found: &Identification) -> Markup {
    html! {
        @if !found.unfitted.is_empty() {
            h3 { "Laws that were not fitted" }
            dl { @for (law, because) in &found.unfitted { dt { (law.name) } dd { (because) "." } } }
        }
        @if !found.left_out.is_empty() {
            h3 { "Recordings that could not be used" }
            dl { @for (file, because) in &found.left_out { dt { (file) } dd { (because) "." } } }
        }
    }
}

fn parameters(found: &Identification) -> Markup {
    html! {
        table {
            thead { tr { th { "parameter" } th.number { "value" } th.number { "95 % interval" } th { "unit" } } }
            tbody {
                @for parameter in &found.law().parameters {
                    tr {
                        td {
                            @if parameter.name == "force_at_middle_depth" { "force at " (format!("{:.2} mm", 1e3 * found.middle.0)) }
                            @else { (parameter.name) }
                        }
                        td.number { (short(parameter.value)) }
                        td.number { @if parameter.low == parameter.high { "held" } @else { (short(parameter.low)) " to " (short(parameter.high)) } }
                        td { @if parameter.unit != "1" { (parameter.unit) } }
                    }
                }
            }
        }
        p {
            "The interval is the wider of two: what noise, model error and the stated uncertainties of mass and speed give, and how far the value moves
             when recordings are left out."
        }
    }
}

fn laws(found: &Identification) -> Markup {
    html! {
        table {
            thead { tr {
                th { "law" } th.number { "held out, N" } th.number { "÷ noise" } th.number { "fitted, N" } th.number { "exponent" }
                th.number { "restitution at " (found.middle.2) " m/s" } th.number { "it claims" } th { "" }
            } }
            tbody {
                @for (place, law) in found.laws.iter().enumerate() {
                    tr class=(if place == found.chosen { "named" } else { "" }) {
                        td { (law.law.name) }
                        td.number { (short(law.held_out_rmse_n())) }
                        td.number { (format!("{:.2}", law.held_out_rmse_n() / found.noise_n)) }
                        td.number { (short(law.rmse_n)) }
                        td.number { @if law.law.exponent { (format!("{:.3}", law.values.exponent)) } @else { "1" } }
                        td.number { (format!("{:.3}", law.true_restitution)) }
                        td.number { @match law.claimed_restitution { Some(claimed) => { (format!("{claimed:.3}")) } None => { "–" } } }
                        td {
                            @if place == found.chosen { "named" }
                            @else if found.alike.contains(&place) && law.law.same_force(found.law().law) { "the same force" }
                            @else if found.alike.contains(&place) { "as good" }
                        }
                    }
                }
            }
        }
    }
}

fn model(nearest: &NearestModel) -> Markup {
    html! {
        h2 { "As a model file" }
        @if nearest.exact {
            p { "The model file (" code { "--model" } ") carries this law exactly: " code { "thud simulate --model" } " runs it." }
        } @else {
            p {
                "The model file (" code { "--model" } ") cannot carry this law itself: " (nearest.because) ". Simulated at every recording's speed and mass, its force is "
                (short(nearest.error_rms_n)) " N rms off the law's, and its peaks are up to " (format!("{:.1} %", 100.0 * nearest.worst_peak_error)) " off."
            }
        }
    }
}

fn recordings(found: &Identification) -> Markup {
    html! {
        table {
            thead { tr {
                th { "recording" } th.number { "speed, m/s" } th.number { "mass, kg" } th.number { "peak, N" }
                th.number { "restitution by momentum" } th.number { "left when it took no part, N" }
            } }
            tbody {
                @for (recording, rest) in found.recordings.iter().zip(&found.law().held_out_n) {
                    tr {
                        td { (recording.file) }
                        td.number { (recording.speed_m_per_s) }
                        td.number { (recording.mass_kg) }
                        td.number { (format!("{:.1}", recording.peak_n)) }
                        td.number { (format!("{:.3} ± {:.3}", recording.restitution.0, recording.restitution.1)) }
                        td.number { (short(*rest)) }
                    }
                }
            }
        }
    }
}
