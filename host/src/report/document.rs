//! What all pages of the tool are: one HTML document without anything outside it, of one look.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The look that all of them share.
const STYLE: &str = "
body { font: 16px/1.45 sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #111; background: #fff }
h1 { font-size: 1.7rem; margin-bottom: .3rem } h2 { margin-top: 2.2rem; border-top: 1px solid #999; padding-top: .8rem } h3 { margin-top: 1.6rem }
table { border-collapse: collapse; width: 100%; font-size: .92rem; margin: .6rem 0 }
th { text-align: left; border-bottom: 2px solid #111; vertical-align: bottom } td { border-bottom: 1px solid #ccc; vertical-align: top }
th, td { padding: .25rem .5rem } td:first-child { white-space: nowrap } .number { text-align: right; font-variant-numeric: tabular-nums }
dl { display: grid; grid-template-columns: minmax(11rem, 17rem) 1fr; gap: .2rem 1rem } dt { color: #444 } dd { margin: 0 }
figure { margin: 1.2rem 0 } figure svg { width: 100%; height: auto } figcaption { font-size: .92rem }
.verdict { border: 3px solid #111; padding: .7rem 1rem; font-size: 1.15rem; margin: 1rem 0 }
.verdict.inconclusive { border-style: dashed } .verdict.fail { border-width: 7px } .verdict.none { border-color: #999; border-width: 1px }
.legend { display: flex; flex-wrap: wrap; gap: .2rem 1.4rem; font-size: .9rem; margin: .3rem 0 } .legend span { white-space: nowrap }
.legend svg { vertical-align: middle; margin-right: .4rem; width: 44px; height: 14px }
@media (max-width: 50rem) { table { display: block; overflow-x: auto } }
@media print { body { margin: 0; max-width: none } figure { break-inside: avoid } }
";

/// A document of a title and a body, with the styles that it has beyond the shared ones.
#[must_use]
pub fn document(title: &str, styles: &[&str], body: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { (title) }
                style { (PreEscaped(STYLE)) @for style in styles { (PreEscaped(style)) } }
            }
            body { (body) }
        }
    }
    .into_string()
}

/// What the words of a page mean, at its end.
pub(crate) fn glossary(words: &[(&str, &str)]) -> Markup {
    html! {
        h2 { "What the words mean" }
        dl { @for (word, meaning) in words { dt { (word) } dd { (meaning) } } }
    }
}
