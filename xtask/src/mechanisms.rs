//! `cargo xtask mechanisms`: `docs/mechanisms.md`, written from the list of mechanisms, which is the single source.

use std::fmt::Write as _;
use std::path::PathBuf;

use thud_sim::mechanism::{Group, LIST, Mechanism};

use crate::step;

const HEAD: &str = "\
# Mechanisms

The physics that a rig may have beyond the ideal impact. `thud simulate --mechanism` adds it, `thud diagnose` looks for it,
`thud mechanisms ID` shows it. This page is written by `cargo xtask mechanisms` from `hal-sim/src/mechanism/`, one file each;
[adding-a-mechanism.md](adding-a-mechanism.md) adds another.

\"Usual\" is what a rig of this kind is likely to have, \"possible\" what is accepted at all; at \"absent\" the mechanism does nothing.
";

const GROUPS: [Group; 6] = [Group::Contact, Group::Guide, Group::Bodies, Group::Robot, Group::Measuring, Group::Fall];

fn file() -> PathBuf {
    step::root().join("docs/mechanisms.md")
}

/// Writes the page.
///
/// # Errors
/// Says that it could not be written.
pub fn run() -> Result<(), String> {
    std::fs::write(file(), write()).map_err(|error| format!("{}: {error}", file().display()))?;
    eprintln!("wrote {}", file().display());
    Ok(())
}

fn write() -> String {
    let mut text = HEAD.to_owned();
    text.push_str("\n| group | ids |\n|---|---|\n");
    for group in GROUPS {
        let ids: Vec<String> = of(group).map(|mechanism| format!("[`{0}`](#{0})", mechanism.id)).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "| {} | {} |", group.name(), ids.join(" "));
    }
    for group in GROUPS {
        let name = group.name();
        let _ = writeln!(text, "\n## {}{}", name[..1].to_uppercase(), &name[1..]);
        of(group).for_each(|mechanism| section(&mut text, mechanism));
    }
    text
}

fn of(group: Group) -> impl Iterator<Item = &'static Mechanism> {
    LIST.iter().copied().filter(move |mechanism| mechanism.group == group)
}

fn section(text: &mut String, mechanism: &Mechanism) {
    let _ = writeln!(text, "\n### {}\n\n```text\n{}\n```\n", mechanism.id, mechanism.equation);
    text.push_str("| parameter | unit | meaning | usual | possible | absent | |\n|---|---|---|---|---|---|---|\n");
    for parameter in mechanism.parameters {
        let range = |(low, high): (f64, f64)| format!("{low} to {high}");
        let _ = writeln!(
            text,
            "| `{}` | {} | {} | {} | {} | {} | {} |",
            parameter.name,
            parameter.unit,
            parameter.meaning.replace('|', "\\|"),
            range(parameter.plausible),
            range(parameter.range),
            parameter.null.map_or_else(String::new, |null| null.to_string()),
            mechanism.remark(parameter),
        );
    }
    let rivals: Vec<String> = mechanism.confused_with.iter().map(|id| format!("[`{id}`](#{id})")).collect();
    let _ = writeln!(
        text,
        "\nActs at: {}. Shows as: {}. Occurs: {}. Confused with: {}. Separated by: {}. Source: {}.",
        mechanism.site.name(),
        mechanism.signature,
        mechanism.occurrence(),
        rivals.join(" "),
        mechanism.separated_by,
        mechanism.source
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_current() {
        let written = std::fs::read_to_string(file()).unwrap_or_default();
        assert!(written == write(), "{} is stale: cargo xtask mechanisms", file().display());
    }

    #[test]
    fn every_mechanism_has_its_section() {
        let text = write();
        assert_eq!(text.matches("\n### ").count(), LIST.len());
    }
}
