//! An identification on the terminal.

use std::fmt::Write as _;

use super::{left, short, verdict, with_interval};
use crate::contact_law::depth::Source;
use crate::contact_law::found_model::NearestModel;
use crate::contact_law::identification::Identification;
use crate::table::{Side, Table};

/// Columns of a terminal that everyone has.
const COLUMNS: usize = 100;

/// The screenful.
#[must_use]
pub fn screenful(found: &Identification, nearest: &NearestModel, name: &str) -> String {
    let mut text = String::new();
    let law = found.law();
    // Writing to a string cannot fail.
    let mut say = |line: &str| {
        let _ = writeln!(text, "{line}");
    };
    let wrapped = |indent: &str, hanging: &str, sentence: &str| {
        textwrap::fill(sentence, textwrap::Options::new(COLUMNS).initial_indent(indent).subsequent_indent(hanging))
    };
    say(&wrapped("", "  ", &format!("{name}: {}.", verdict(found))));
    say(&wrapped("  ", "  ", &format!("{}.", left(found))));
    say(&wrapped(
        "  ",
        "  ",
        &format!(
            "{} recordings at {} to {} m/s; depth {}.",
            found.recordings.len(),
            found.recordings.iter().map(|recording| recording.speed_m_per_s).fold(f64::INFINITY, f64::min),
            found.recordings.iter().map(|recording| recording.speed_m_per_s).fold(0.0, f64::max),
            match found.source {
                Source::Measured => "measured",
                Source::Reconstructed => "reconstructed from force, mass and speed",
            }
        ),
    ));
    say("");
    let mut table = Table::new(&[("parameter", Side::Left), ("value (95 %)", Side::Left), ("unit", Side::Left)]);
    for parameter in &law.parameters {
        let name = if parameter.name == "force_at_middle_depth" {
            format!("force at {:.2} mm", 1e3 * found.middle.0)
        } else {
            parameter.name.to_owned()
        };
        let unit = if parameter.unit == "1" { "" } else { parameter.unit };
        table.row([name, with_interval(parameter), unit.to_owned()]);
    }
    say(table.to_string().trim_end());
    say("");
    let middle = format!("e at {} m/s", found.middle.2);
    let mut table = Table::new(&[
        ("law", Side::Left),
        ("held out N", Side::Right),
        ("÷ noise", Side::Right),
        ("exponent", Side::Right),
        (&middle, Side::Right),
        ("it claims", Side::Right),
        ("", Side::Left),
    ]);
    for (place, law) in found.laws.iter().enumerate() {
        let mark = if place == found.chosen {
            "named"
        } else if found.alike.contains(&place) {
            if law.law.same_force(found.law().law) { "the same force" } else { "as good" }
        } else {
            ""
        };
        table.row([
            law.law.name.to_owned(),
            short(law.held_out_rmse_n()),
            format!("{:.2}", law.held_out_rmse_n() / found.noise_n),
            if law.law.exponent { format!("{:.3}", law.values.exponent) } else { "1".to_owned() },
            format!("{:.3}", law.true_restitution),
            law.claimed_restitution.map_or("–".to_owned(), |claimed| format!("{claimed:.3}")),
            mark.to_owned(),
        ]);
    }
    say(table.to_string().trim_end());
    for (law, because) in &found.unfitted {
        say(&wrapped("  - ", "    ", &format!("{} is not fitted: {because}.", law.name)));
    }
    let lists = [("Cannot be identified", &found.cannot), ("To be noted", &found.notes)];
    for (heading, sentences) in lists.iter().filter(|(_, sentences)| !sentences.is_empty()) {
        say("");
        say(&format!("{heading}:"));
        for sentence in sentences.iter() {
            say(&wrapped("  - ", "    ", &format!("{sentence}.")));
        }
    }
    if !found.left_out.is_empty() {
        say("");
        say("Recordings that could not be used:");
        for (file, because) in &found.left_out {
            say(&wrapped("  - ", "    ", &format!("{file}: {because}.")));
        }
    }
    if !nearest.exact {
        say("");
        say(&wrapped(
            "",
            "  ",
            &format!(
                "A model file cannot carry this law itself: {}. Its force is {} N rms off the law's, its peaks up to {:.1} %.",
                nearest.because,
                short(nearest.error_rms_n),
                100.0 * nearest.worst_peak_error
            ),
        ));
    }
    text
}
