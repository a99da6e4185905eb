//! An identification for people: one screenful on the terminal, one HTML page that needs nothing else.

mod figure;
mod page;
mod terminal;

pub use page::page;
pub use terminal::screenful;

use super::identification::{Identification, Parameter};

/// The verdict in a sentence.
fn verdict(found: &Identification) -> String {
    let law = found.law();
    let others = |same: bool| -> Vec<&str> {
        let of = found.alike.iter().map(|&place| found.laws[place].law);
        of.filter(|other| other.same_force(law.law) == same).map(|other| other.name).collect()
    };
    let (same, rivals) = (others(true), others(false));
    let mut sentence = format!("{}: {}", law.law.name, law.law.equation);
    if !rivals.is_empty() {
        sentence = format!("{sentence}. These recordings cannot tell it from {}", rivals.join(", "));
    }
    if !same.is_empty() {
        sentence = format!(
            "{sentence}. {} {} the same force; this one's restitution is nearest to what the force does",
            same.join(" and "),
            if same.len() == 1 { "gives" } else { "give" }
        );
    }
    sentence
}

/// What is left, in a sentence.
fn left(found: &Identification) -> String {
    let law = found.law();
    let rest = law.held_out_rmse_n();
    format!(
        "It leaves {} N rms of recordings that took no part, {:.2} times the noise before contact",
        short(rest),
        rest / found.noise_n
    )
}

/// Digits that a person reads.
fn short(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e6).contains(&magnitude) {
        let decimals = (3.0 - magnitude.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.3e}")
    }
}

/// A parameter's value with its interval, in few words.
fn with_interval(parameter: &Parameter) -> String {
    if parameter.low == parameter.high {
        format!("{} (held)", short(parameter.value))
    } else {
        format!("{} ({} to {})", short(parameter.value), short(parameter.low), short(parameter.high))
    }
}
