//! `thud mechanisms`: the physics that simulation and diagnosis know.

use miette::miette;
use serde::Serialize;
use thud_sim::mechanism::{LIST, Mechanism, Parameter};

use crate::json::JsonOption;
use crate::table::{Side, Table};

/// List the mechanisms that simulation and diagnosis know, or show one in full
///
/// Example: thud mechanisms guide-friction
#[derive(clap::Args, Debug)]
pub struct Mechanisms {
    /// Show this one: its equation, parameters and ranges, where its mismatch shows, what it is confused with
    #[arg(value_name = "ID")]
    id: Option<String>,
    #[command(flatten)]
    json: JsonOption,
}

/// A mechanism as JSON.
#[derive(Serialize)]
struct Shown {
    id: &'static str,
    group: &'static str,
    site: &'static str,
    equation: &'static str,
    parameters: Vec<ShownParameter>,
    lasting: bool,
    exact: bool,
    by_configuration: &'static [&'static str],
    by_recording: &'static [&'static str],
    used_in: Vec<ShownUse>,
    sized: &'static [&'static str],
    signature: &'static str,
    confused_with: &'static [&'static str],
    separated_by: &'static str,
    source: &'static str,
}

/// A parameter; an absence at an infinite value is `"infinity"`, which JSON has no number for.
#[derive(Serialize)]
struct ShownParameter {
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
    range: [f64; 2],
    plausible: [f64; 2],
    typical: f64,
    absent_at: Option<serde_json::Value>,
    fitted: bool,
    of_each_impact: bool,
}

impl Shown {
    fn new(mechanism: &'static Mechanism) -> Self {
        Self {
            id: mechanism.id,
            group: mechanism.group.name(),
            site: mechanism.site.name(),
            equation: mechanism.equation,
            parameters: mechanism.parameters.iter().map(ShownParameter::new).collect(),
            lasting: mechanism.lasting,
            exact: mechanism.exact,
            by_configuration: mechanism.by_configuration,
            by_recording: mechanism.by_recording,
            used_in: mechanism.used_in.iter().map(ShownUse::new).collect(),
            sized: mechanism.sized,
            signature: mechanism.signature,
            confused_with: mechanism.confused_with,
            separated_by: mechanism.separated_by,
            source: mechanism.source,
        }
    }
}

/// A parameter that does something in some forms only.
#[derive(Serialize)]
struct ShownUse {
    parameter: &'static str,
    choice: &'static str,
    values: &'static [f64],
}

impl ShownUse {
    fn new(&(parameter, choice, values): &(&'static str, &'static str, &'static [f64])) -> Self {
        Self { parameter, choice, values }
    }
}

impl ShownParameter {
    fn new(parameter: &'static Parameter) -> Self {
        let absent = |null: f64| if null.is_infinite() { "infinity".into() } else { null.into() };
        Self {
            name: parameter.name,
            unit: parameter.unit,
            meaning: parameter.meaning,
            range: parameter.range.into(),
            plausible: parameter.plausible.into(),
            typical: parameter.typical,
            absent_at: parameter.null.map(absent),
            fitted: !parameter.is_held(),
            of_each_impact: parameter.is_of_each_impact(),
        }
    }
}

impl Mechanisms {
    pub(super) fn run(self) -> miette::Result<()> {
        let Some(id) = &self.id else {
            self.json.write(&LIST.iter().map(|mechanism| Shown::new(mechanism)).collect::<Vec<_>>())?;
            if !self.json.owns_stdout() {
                list();
            }
            return Ok(());
        };
        let mechanism = Mechanism::find(id).map_err(|error| {
            miette!(help = "`thud mechanisms` without an id lists them with their equations", "{error}")
        })?;
        self.json.write(&Shown::new(mechanism))?;
        if !self.json.owns_stdout() {
            crate::standard_output::say(format_args!("{}", screen(mechanism)));
        }
        Ok(())
    }
}

/// Columns for an equation in the list.
const EQUATION: usize = 62;

fn list() {
    let mut table = Table::new(&[("mechanism", Side::Left), ("group", Side::Left), ("equation", Side::Left)]);
    for mechanism in LIST {
        // What does not fit is in the mechanism's own screen.
        let whole = mechanism.equation;
        let cut = || whole.chars().take(EQUATION - 1).collect::<String>() + "…";
        let equation = if whole.chars().count() > EQUATION { cut() } else { whole.to_owned() };
        table.row([mechanism.id.to_owned(), mechanism.group.name().to_owned(), equation]);
    }
    crate::standard_output::say(format_args!("{table}"));
    crate::say!("\n`thud mechanisms ID` shows one in full; `docs/adding-a-mechanism.md` adds another.");
}

/// Columns of a terminal.
const WIDTH: usize = 100;

/// One mechanism in full, for a terminal.
fn screen(mechanism: &'static Mechanism) -> String {
    use std::fmt::Write as _;

    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{}  ({}, at the {})\n", mechanism.id, mechanism.group.name(), mechanism.site.name());
    let equation = textwrap::Options::new(WIDTH).initial_indent("  ").subsequent_indent("    ");
    let _ = writeln!(text, "{}\n", textwrap::fill(mechanism.equation, equation));
    let mut table = Table::new(&[
        ("parameter", Side::Left),
        ("unit", Side::Left),
        ("usual", Side::Left),
        ("possible", Side::Left),
        ("absent at", Side::Right),
        ("", Side::Left),
    ]);
    for parameter in mechanism.parameters {
        let range = |(low, high): (f64, f64)| format!("{low} to {high}");
        table.row([
            parameter.name.to_owned(),
            parameter.unit.to_owned(),
            range(parameter.plausible),
            range(parameter.range),
            parameter.null.map_or_else(String::new, |null| null.to_string()),
            mechanism.remark(parameter),
        ]);
    }
    let _ = writeln!(text, "{table}");
    let names = mechanism.parameters.iter().map(|parameter| parameter.name.len());
    let head_width = names.fold("confused with".len(), usize::max) + 2;
    let below = " ".repeat(2 + head_width);
    let mut part = |head: &str, words: &str| {
        let begin = format!("  {head:<head_width$}");
        let options = textwrap::Options::new(WIDTH).initial_indent(&begin).subsequent_indent(&below);
        let _ = writeln!(text, "{}", textwrap::fill(words, options));
    };
    for parameter in mechanism.parameters {
        part(parameter.name, parameter.meaning);
    }
    part("shows as", mechanism.signature);
    part("occurs", mechanism.occurrence());
    part("confused with", &mechanism.confused_with.join(", "));
    part("separated by", mechanism.separated_by);
    part("source", mechanism.source);
    let _ = writeln!(text, "\n  thud simulate --mechanism {}", mechanism.typical());
    text
}
