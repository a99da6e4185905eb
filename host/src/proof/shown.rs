//! A run for people: a screenful, and a page.

mod figure;
pub mod markdown;
pub mod page;
pub mod peers;
pub mod terminal;

use super::target::{Demand, Target, Unit};

/// A number as its unit has it.
#[must_use]
pub fn number(value: f64, unit: Unit) -> String {
    match unit {
        Unit::Share => format!("{:.1} %", 100.0 * value),
        Unit::Plain if value >= 10.0 => format!("{value:.1}"),
        Unit::Plain => format!("{value:.3}"),
        Unit::Seconds => format!("{value:.1} s"),
        Unit::Megabytes => format!("{value:.0} MB"),
    }
}

/// What is demanded, in words.
#[must_use]
pub fn demand(target: &Target) -> String {
    let short = |value: f64| match target.unit {
        Unit::Share => format!("{:.0} %", 100.0 * value),
        Unit::Plain => format!("{value}"),
        Unit::Seconds => format!("{value} s"),
        Unit::Megabytes => format!("{value} MB"),
    };
    match target.demand {
        Demand::AtLeast(least) if least >= 1.0 && target.unit == Unit::Share => "all".to_owned(),
        Demand::AtLeast(least) => format!("≥ {}", short(least)),
        Demand::AtMost(most) => format!("≤ {}", short(most)),
        Demand::Between(low, high) => format!("{} to {}", short(low), short(high)),
    }
}

/// What was reached.
#[must_use]
pub fn value(target: &Target) -> String {
    target.value.map_or_else(|| "-".to_owned(), |value| number(value, target.unit))
}

/// Its interval.
#[must_use]
pub fn interval(target: &Target) -> String {
    target.interval.filter(|[low, high]| low < high).map_or_else(String::new, |[low, high]| {
        format!(
            "{} to {}",
            number(low, target.unit).trim_end_matches(" %").trim_end_matches(" s"),
            number(high, target.unit)
        )
    })
}

/// Whether it was reached, in a word; with a question mark where the interval holds both.
#[must_use]
pub fn reached(target: &Target) -> &'static str {
    match (target.reached, target.sure) {
        (None, _) => "?",
        (Some(true), Some("reached")) => "yes",
        (Some(true), _) => "yes (?)",
        (Some(false), Some("missed")) => "no",
        (Some(false), _) => "no (?)",
    }
}
