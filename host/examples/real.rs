//! Makes campaigns of other people's recordings, diagnoses them without hints, and sets what is said beside what their authors documented:
//! `real OUT [NAME…]`. Needs the recordings (tests/shared_recordings.rs says where).
//!
//! Writes OUT/NAME/ (the campaign), OUT/NAME.html (the diagnosis), OUT/NAME.json, OUT/index.html and OUT/table.md.

use std::path::{Path, PathBuf};

use maud::html;
use miette::{IntoDiagnostic as _, WrapErr as _, miette};
use real_campaigns::{Agreement, Real, named};
use serde_json::Value;
use thud::diagnosis::{self, Options, answer, shown};
use thud::proof::lighter::lighter;
use thud::report::document::document;

#[path = "../../tests/real_campaigns/mod.rs"]
mod real_campaigns;
#[path = "../../tests/shared_recordings.rs"]
mod shared_recordings;

const TITLE: &str = "Real recordings with a documented cause";
/// Many columns of words.
const STYLE: &str = "body { max-width: 76rem } table { font-size: .84rem }";

/// One campaign beside its documentation.
struct Row {
    real: Real,
    answer: Value,
    agreement: Agreement,
}

fn main() -> miette::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().map(PathBuf::from).ok_or_else(|| miette!("where to? `real OUT [NAME…]`"))?;
    let wanted: Vec<String> = arguments.collect();
    let Some(recordings) = shared_recordings::find("") else {
        return Err(miette!("no recordings: set THUD_SHARED to the folder in which `recordings` lies"));
    };
    let mut rows = Vec::new();
    for real in real_campaigns::all() {
        if wanted.is_empty() || wanted.contains(&real.name) {
            let answer = diagnosed(&real, &recordings, &out)?;
            let agreement = real.expected.agrees(&answer);
            println!("{:28} {:9} {}", real.name, word(agreement), said(&answer));
            rows.push(Row { real, answer, agreement });
        }
    }
    written(&out.join("table.md"), &markdown(&rows))?;
    written(&out.join("index.html"), &page(&rows))
}

fn written(path: &Path, text: &str) -> miette::Result<()> {
    std::fs::write(path, text).into_diagnostic().wrap_err_with(|| format!("cannot write {}", path.display()))
}

fn diagnosed(real: &Real, recordings: &Path, out: &Path) -> miette::Result<Value> {
    let folder = out.join(&real.name);
    std::fs::create_dir_all(&folder).into_diagnostic()?;
    (real.make)(recordings, &folder).write(&folder);
    let loaded = thud::campaign::load(&folder)?;
    let found = diagnosis::diagnose(&loaded, &Options::default(), &mut |_| ())?;
    let answer = answer::answer(&found);
    written(&out.join(format!("{}.html", real.name)), &lighter(&shown::page(&found, &answer, real.about)))?;
    let value = serde_json::to_value(&answer).into_diagnostic()?;
    written(&out.join(format!("{}.json", real.name)), &serde_json::to_string_pretty(&value).into_diagnostic()?)?;
    Ok(value)
}

/// Whether it agrees, in a word.
fn word(agreement: Agreement) -> &'static str {
    match agreement {
        Agreement::Yes => "yes",
        Agreement::InPart => "in part",
        Agreement::No => "no",
        Agreement::Open => "open",
    }
}

/// Verdict and names.
fn said(answer: &Value) -> String {
    let verdict = answer["verdict"].as_str().unwrap_or_default();
    let names: Vec<String> = named(answer)
        .iter()
        .map(|names| match names.split_first() {
            Some((first, others)) if !others.is_empty() => format!("{first} (or {})", others.join(", ")),
            Some((first, _)) => first.clone(),
            None => String::new(),
        })
        .collect();
    if names.is_empty() { verdict.to_owned() } else { format!("{verdict}: {}", names.join(" and ")) }
}

/// The first mechanism's strength with its interval.
fn strength(answer: &Value) -> String {
    let parameter = &answer["mechanisms"][0]["parameters"][0];
    let number = |key: &str| parameter[key].as_f64();
    match (number("value"), number("low"), number("high")) {
        (Some(value), Some(low), Some(high)) => {
            let short = |value: f64| thud::decimal::significant(value, 3);
            let name = parameter["name"].as_str().unwrap_or_default();
            format!("{name} {} ({} to {})", short(value), short(low), short(high))
        }
        _ => String::new(),
    }
}

/// Rmse of the re-tuned simulation and of the final model, on the recordings and on recordings left out, over the noise.
fn rmse(answer: &Value) -> [String; 3] {
    let short = |value: &Value| {
        value.as_f64().map_or_else(String::new, |value| thud::decimal::significant(value, 3).to_string())
    };
    [
        short(&answer["baseline"]["noise_rms"]),
        short(&answer["baseline"]["held_out_rmse"]),
        short(&answer["model"]["held_out_rmse"]),
    ]
}

fn markdown(rows: &[Row]) -> String {
    let mut text = "| campaign | documented | said | first one's strength | noise, then rmse left out before and after | agreement |\n|---|---|---|---|---|---|\n".to_owned();
    for Row { real, answer, agreement } in rows {
        let [noise, before, after] = rmse(answer);
        text.push_str(&format!(
            "| {} | {} | {} | {} | {noise}; {before}, {after} | {} |\n",
            real.name,
            real.documented,
            said(answer),
            strength(answer),
            word(*agreement)
        ));
    }
    text
}

fn page(rows: &[Row]) -> String {
    let count = |wanted: Agreement| rows.iter().filter(|row| row.agreement == wanted).count();
    let body = html! {
        h1 { (TITLE) }
        p {
            "Recordings that other people made, each as a campaign with the baseline that its plan implies, diagnosed without hints. Of " (rows.len())
            " the diagnosis agrees with what is documented in " (count(Agreement::Yes)) ", in part in " (count(Agreement::InPart)) ", not in "
            (count(Agreement::No)) "; in " (count(Agreement::Open)) " nothing is documented to agree with."
        }
        table {
            thead { tr {
                th { "campaign" } th { "recorded" } th { "documented" } th { "the diagnosis" } th { "first one's strength" }
                th { "noise" } th { "left out, before" } th { "after" } th { "agreement" }
            } }
            tbody {
                @for Row { real, answer, agreement } in rows {
                    tr {
                        td { a href=(format!("{}.html", real.name)) { (real.name) } }
                        td { (real.about) }
                        td { (real.documented) }
                        td { (said(answer)) }
                        td { (strength(answer)) }
                        @for one in rmse(answer) { td { (one) } }
                        td { (word(*agreement)) }
                    }
                }
            }
        }
        p { "Noise and rmse are in the observed channel's unit. “In part”: what is documented is named beside something else, or with a rest that
             no mechanism explains; where nothing is documented to be visible: no physics is invented, but what is left is not taken for noise." }
    };
    document(TITLE, &[STYLE], &body)
}
