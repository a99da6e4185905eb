//! The answer in sentences: the verdict, why a mechanism was taken, why another was not.

use std::borrow::Borrow;

use thud_sim::mechanism::Mechanism;
use thud_sim::rig::Quantity;

use super::answer::{Answer, Rejected};
use super::evidence::{Contest, Evidence, Limit, Standing, evidence, scope_words};
use super::layout::Role;
use super::retuned::retuned;
use super::select::{BY_CHANCE, ENOUGH, TRACE};
use super::verdict::{Unlikely, is_doubtful, is_doubtful_choice, is_of_another_rig, unlikely};
use super::{Diagnosis, RigKind};
use crate::decimal::significant;

/// A score below this is no reason to look further.
const POOR: f64 = 3.5;
/// A misreading below this part is not worth a word.
const MISREAD: f64 = 0.003;

/// A number with three significant digits, never with an exponent where a person would not use one.
#[must_use]
pub fn short(value: f64) -> String {
    let rounded = significant(value, 3);
    let size = rounded.abs();
    if size == 0.0 || (1e-4..1e7).contains(&size) { format!("{rounded}") } else { format!("{rounded:e}") }
}

/// A value with an interval, in the digits that the interval deserves.
#[must_use]
pub fn with_interval(value: f64, low: f64, high: f64) -> (String, String, String) {
    let half = 0.5 * (high - low);
    let plain = |value: f64| (1e-4..1e7).contains(&value.abs()) || value == 0.0;
    let is_lost_in_it = value != 0.0 && half > 3.0 * value.abs();
    if !(half.is_finite() && half > 0.0 && plain(value)) || is_lost_in_it {
        return (short(value), short(low), short(high));
    }
    let decimals = (1.0 - half.log10().floor()).clamp(0.0, 9.0) as usize;
    let digits = |value: f64| format!("{value:.decimals$}");
    (digits(value), digits(low), digits(high))
}

/// A value in the decimals in which another one has three digits.
#[must_use]
pub fn beside(value: f64, other: f64) -> String {
    let decimals = (2.0 - other.abs().max(1e-12).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.decimals$}")
}

/// A part as a percentage.
#[must_use]
pub fn percent(part: f64) -> String {
    let percent = 100.0 * part;
    if percent.abs() >= 9.95 { format!("{percent:.0} %") } else { format!("{percent:.1} %") }
}

/// A p-value as one writes it.
#[must_use]
pub fn p_words(p_value: f64) -> String {
    match p_value {
        p if p < 1e-9 => "p < 1e-9".to_owned(),
        p if p < 1e-3 => format!("p = {p:.0e}"),
        p => format!("p = {}", significant(p, 1)),
    }
}

/// What a series of words reads like: "a", "a and b", "a, b and c".
#[must_use]
pub fn listed<S: Borrow<str>>(words: &[S], last: &str) -> String {
    match words {
        [] => String::new(),
        [one] => one.borrow().to_owned(),
        [most @ .., end] => format!("{} {last} {}", most.join(", "), end.borrow()),
    }
}

/// A unit as it stands behind a number: what has none has nothing there.
#[must_use]
pub fn behind_a_number(unit: &str) -> String {
    if unit == "1" { String::new() } else { format!(" {unit}") }
}

/// Unit of the observed channel.
#[must_use]
pub fn unit(diagnosis: &Diagnosis) -> &'static str {
    match diagnosis.problem.channels[0].column.as_str() {
        "force_N" => "N",
        "acceleration_m_per_s2" => "m/s²",
        _ => "m",
    }
}

/// The verdict in a sentence.
#[must_use]
pub fn verdict(diagnosis: &Diagnosis, answer: &Answer) -> String {
    let count = diagnosis.problem.recordings.len();
    let recordings = if count == 1 { "this one recording".to_owned() } else { format!("these {count} recordings") };
    let (show, are) = if count == 1 { ("shows", "is") } else { ("show", "are") };
    let names: Vec<String> = answer
        .mechanisms
        .iter()
        .map(|named| {
            let twins: Vec<String> = named.indistinguishable_from.iter().map(|id| (*id).to_owned()).collect();
            if twins.is_empty() {
                named.id.to_owned()
            } else {
                format!("{} (or {}, which {recordings} cannot tell from it)", named.id, listed(&twins, "or"))
            }
        })
        .collect();
    match answer.verdict {
        "consistent" => {
            format!("The simulation holds: {recordings} {show} nothing beyond noise and what is stated as uncertain.")
        }
        "unexplained" if names.is_empty() && is_of_another_rig(&diagnosis.selection) => format!(
            "The simulation does not hold: {recordings} {are} not of the rig that is stated, and no mechanism of the list explains the difference."
        ),
        "unexplained" if names.is_empty() => {
            format!(
                "The simulation does not hold: {recordings} {show} something that no mechanism of the list explains."
            )
        }
        "unexplained" => {
            let selection = &diagnosis.selection;
            let misnamed = (0..names.len()).any(|place| is_doubtful(selection, place));
            let names = listed(&names, "and");
            let more = if is_of_another_rig(&diagnosis.selection) {
                "but only on another rig than the stated one; on that, no mechanism of the list explains them"
            } else if misnamed {
                "or rather something that looks like it and that no mechanism of the list explains"
            } else {
                "and something more that no mechanism of the list explains"
            };
            format!("The simulation does not hold: {recordings} {show} {names}, {more}.")
        }
        _ => format!("The simulation leaves something out: {}.", listed(&names, "and")),
    }
}

/// What the model is worth, on recordings that took no part.
#[must_use]
pub fn gain(diagnosis: &Diagnosis, answer: &Answer) -> String {
    let unit = unit(diagnosis);
    let noise = answer.baseline.noise_rms;
    let (before, after) = (answer.baseline.held_out_rmse, answer.model.held_out_rmse);
    if diagnosis.problem.recordings.len() == 1 {
        return format!(
            "With one recording alone nothing can be left out: the model shows it within {} {unit} rms, {:.2} times the noise.",
            short(answer.model.rmse),
            answer.model.noise_ratio
        );
    }
    if answer.verdict == "unexplained" {
        let with = answer.unexplained.held_out_rmse;
        return format!(
            "On recordings that took no part the re-tuned simulation is off by {} {unit} rms, {:.2} times the noise; with a map of what has no name by {}, {:.2} times.",
            beside(before, noise),
            before / noise,
            beside(with, noise),
            with / noise
        );
    }
    if answer.mechanisms.is_empty() {
        return format!(
            "On recordings that took no part the re-tuned simulation is off by {} {unit} rms, {:.2} times the noise.",
            beside(before, noise),
            before / noise
        );
    }
    format!(
        "On recordings that took no part the simulation is then off by {} {unit} rms instead of {}: {:.2} times the noise instead of {:.2}.",
        beside(after, noise),
        beside(before, noise),
        after / noise,
        before / noise
    )
}

/// Why the mechanism in this place of the chosen model was taken.
#[must_use]
pub fn because(diagnosis: &Diagnosis, place: usize) -> String {
    let selection = &diagnosis.selection;
    let fit = &selection.best.fit;
    let entrant = &fit.layout.entrants[place];
    let id = entrant.effect.mechanism().id;
    let all = evidence(diagnosis);
    let mut parts = Vec::new();
    if fit.layout.entrants.len() == 1 {
        let parameters = fit.parameters();
        let own = match fit.layout.own_parameters() {
            0 => String::new(),
            _ if parameters == 1 => ", which each recording has for itself".to_owned(),
            own => format!(", {own} of which each recording has for itself"),
        };
        parts.push(format!(
            "χ² falls by {:.0} for {parameters} parameter{}{own}",
            selection.baseline.cost - fit.cost,
            if parameters == 1 { "" } else { "s" }
        ));
    } else if let Some(deviations) = strength_in_deviations(diagnosis, place) {
        parts.push(format!("its strength is {deviations:.0} standard deviations from none"));
        let worth = selection.worth[place];
        if worth < ENOUGH && !selection.is_likely_without[place] {
            parts.push(format!("without it χ² is {worth:.0} higher, but another has a shape that nothing has"));
        }
    }
    let scope = scope_words(diagnosis, entrant.scope);
    if !scope.is_empty() {
        parts.push(format!("it acts {scope}"));
    }
    if selection.best.coincidences.contains(&place) {
        let doubt =
            if is_doubtful_choice(selection, place) { "" } else { ", but nothing else of the list comes near it" };
        let chosen = if entrant.effect.mechanism().lasting {
            "these have nothing else in common, and it is a thing that lasts"
        } else {
            "it comes where each contact begins, turns or ends, which chance does not do"
        };
        parts.push(format!("{chosen}{doubt}"));
    }
    if let Some(Unlikely { name, unit, value, likely: (low, high) }) = unlikely(selection, place) {
        parts.push(format!(
            "it is hardly what it is called: {name} = {}{unit} is far from the {} to {}{unit} that are likely",
            short(value),
            short(low),
            short(high),
            unit = behind_a_number(unit)
        ));
    }
    if let Some(stands) = newtons_stand_for(diagnosis, entrant.effect.mechanism()) {
        parts.push(stands);
    }
    if let Some(absorbed) = all.iter().find(|e| e.mechanism.id == id).and_then(|e| e.absorbed) {
        parts.push(format!("re-tuning had hidden {} of it", percent(absorbed)));
    }
    let next = all.iter().filter(|e| e.mechanism.id != id).filter_map(|e| Some((e, e.contest?)));
    // A trace is none.
    let is_rival = |contest: &Contest| contest.instead_of == Some(id) && contest.trace.is_none();
    let next = next.filter(|(_, contest)| is_rival(contest)).min_by(|a, b| a.1.bic.total_cmp(&b.1.bic));
    if let Some((rival, contest)) = next {
        let gap = contest.bic;
        if gap >= 0.0 {
            parts.push(format!("the nearest rival is {}, {gap:.0} behind in BIC", rival.mechanism.id));
        } else {
            let leaves = if contest.chi_squared > 0.0 {
                format!(", but leaves χ² {:.0} higher", contest.chi_squared)
            } else {
                ", too little to prefer it".to_owned()
            };
            parts.push(format!("{} is {:.0} ahead in BIC{leaves}", rival.mechanism.id, -gap));
        }
    }
    parts.join("; ")
}

/// What a newton of the measuring chain is where no force was observed.
fn newtons_stand_for(diagnosis: &Diagnosis, mechanism: &Mechanism) -> Option<String> {
    let channel = &diagnosis.problem.channels[0];
    if !mechanism.is_of_one_channel() || channel.quantity == Quantity::CellForce {
        return None;
    }
    let one_is = 1.0 / channel.newtons?;
    Some(format!("its newtons stand for what was observed: 1 N is {} {}", short(one_is), unit(diagnosis)))
}

/// How far a strength is from its absence, in its own standard deviations.
fn strength_in_deviations(diagnosis: &Diagnosis, place: usize) -> Option<f64> {
    let selection = &diagnosis.selection;
    let fit = &selection.best.fit;
    let role = Role::Mechanism { entrant: place, place: 0 };
    let global = fit.layout.globals.iter().position(|coordinate| coordinate.role == role)?;
    let sd = selection.deviations.as_ref()?[global];
    let parameter = &fit.layout.entrants[place].effect.mechanism().parameters[0];
    // In the logarithm a relative deviation: one over it is the strength in its own deviations.
    let distance = match parameter.scale {
        thud_sim::mechanism::Scale::Logarithmic => 1.0,
        thud_sim::mechanism::Scale::Linear => (fit.point.globals[global] - parameter.null.unwrap_or(0.0)).abs(),
    };
    (sd > 0.0).then_some(distance / sd)
}

/// A line for each mechanism that was tried and is neither named nor a twin of one.
#[must_use]
pub fn rejected(diagnosis: &Diagnosis) -> Vec<Rejected> {
    evidence(diagnosis)
        .iter()
        .filter(|evidence| evidence.standing == Standing::Rejected)
        .map(|evidence| Rejected { id: evidence.mechanism.id.to_owned(), because: against(evidence) })
        .collect()
}

/// What speaks against a mechanism.
#[must_use]
pub fn against(evidence: &Evidence) -> String {
    if let Some(contest) = evidence.contest {
        return against_rival(contest);
    }
    let Some(score) = evidence.score else {
        return "it changes nothing in these recordings that could be seen".to_owned();
    };
    let imitated =
        evidence.absorbed.map_or(String::new(), |absorbed| format!("re-tuning imitates {} of it", percent(absorbed)));
    let seen = evidence.limit.map_or(String::new(), |limit| format!(", {}", limit_words(limit)));
    if score > POOR {
        format!("its score is {score:.1}, less than that of those that were refitted; {imitated}")
    } else if score <= 0.0 {
        format!("only with an impossible sign would it help; {imitated}{seen}")
    } else {
        format!("its score is {score:.1}, which chance gives as well; {imitated}{seen}")
    }
}

fn limit_words(limit: Limit) -> String {
    let side = if limit.upwards_is_less { "below" } else { "above" };
    let (name, unit) = (limit.name, behind_a_number(limit.unit));
    format!("{side} {name} = {}{unit} it would have been seen", significant(limit.value, 2))
}

fn against_rival(contest: Contest) -> String {
    if let Some(seen) = contest.trace {
        let asked = TRACE * TRACE;
        return format!("what is observed hardly shows it: χ² of that falls by {seen:.0}, and {asked:.0} is asked for");
    }
    let more = contest.parameters;
    let cost = match more {
        0 => "with as many parameters".to_owned(),
        more => format!(
            "with {} parameter{} {}",
            more.abs(),
            if more.abs() == 1 { "" } else { "s" },
            if more > 0 { "more" } else { "less" }
        ),
    };
    let size = contest.chi_squared.abs();
    let side = if contest.chi_squared >= 0.0 { "higher" } else { "lower" };
    match (contest.instead_of, contest.by_chance) {
        (None, Some(by_chance)) if contest.chi_squared < 0.0 => {
            format!("χ² {size:.0} {side} {cost}: by chance {}, and {BY_CHANCE:.0e} is asked for", p_words(by_chance))
        }
        (None, None) if contest.bic < 0.0 => {
            format!("χ² {size:.0} {side} {cost}: BIC gains {:.0}, and {ENOUGH:.0} is asked for", -contest.bic)
        }
        (None, _) => format!("χ² {size:.0} {side} {cost}: BIC {:.0} worse", contest.bic),
        (Some(id), _) => format!("leaves χ² {size:.0} {side} than {id} {cost}: BIC {:.0} worse", contest.bic),
    }
}

/// What the baseline misread to hide what was left out, in a sentence without its end; `None`: nothing worth a word.
#[must_use]
pub fn misread(diagnosis: &Diagnosis) -> Option<String> {
    /// More would be a table.
    const SHOWN: usize = 4;
    let entrants = &diagnosis.selection.best.fit.layout.entrants;
    if entrants.is_empty() {
        return None;
    }
    let names: Vec<String> = entrants.iter().map(|entrant| entrant.effect.mechanism().id.to_owned()).collect();
    let mut beliefs = retuned(diagnosis);
    beliefs.retain(|belief| belief.misread().abs() > MISREAD);
    beliefs.sort_by(|a, b| b.misread().abs().total_cmp(&a.misread().abs()));
    let readings: Vec<String> = beliefs
        .iter()
        .take(SHOWN)
        .map(|belief| {
            let side = if belief.misread() > 0.0 { "high" } else { "low" };
            format!("the {} {} {side}", belief.label, percent(belief.misread().abs()))
        })
        .collect();
    (!readings.is_empty()).then(|| {
        format!("the re-tuned simulation reads {} to hide {}", listed(&readings, "and"), listed(&names, "and"))
    })
}

/// A phase in words.
#[must_use]
pub fn phase(diagnosis: &Diagnosis, word: &str) -> &'static str {
    let falls = diagnosis.problem.rig.kind == RigKind::Fall;
    match word {
        "before" => "before contact",
        "rise" if falls => "while falling",
        "rise" => "on the rise to the peak",
        "fall" if falls => "while falling",
        "fall" => "from the peak to separation",
        _ => "after separation",
    }
}

/// What is said where no place stands out.
#[must_use]
pub fn nowhere(answer: &Answer) -> &'static str {
    if answer.verdict == "consistent" {
        "nowhere: in no phase, recording or band of frequency is more left than noise"
    } else {
        "in no place by itself: only all recordings together show it"
    }
}

/// Which recordings: all, or by name, shortened where they are many.
#[must_use]
pub fn which(diagnosis: &Diagnosis, names: &[String]) -> String {
    const SHOWN: usize = 6;
    let count = diagnosis.problem.recordings.len();
    match names.len() {
        0 => "in no recording by itself".to_owned(),
        all if all == count => format!("in all {count} recordings"),
        few if few <= SHOWN => format!("in {}", listed(names, "and")),
        many => format!("in {many} of {count} recordings ({}, …)", names[..SHOWN - 1].join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        assert_eq!(short(25_123.4), "25100");
        assert_eq!(short(0.150_61), "0.151");
        assert_eq!(short(1.5e-7), "1.5e-7");
        let three = |a: &str, b: &str, c: &str| (a.to_owned(), b.to_owned(), c.to_owned());
        assert_eq!(with_interval(18.004, 17.98, 18.03), three("18.004", "17.980", "18.030"));
        assert_eq!(with_interval(0.1518, 0.1376, 0.1676), three("0.152", "0.138", "0.168"));
        assert_eq!(with_interval(0.05, 0.001, 10_000.0), three("0.05", "0.001", "10000"));
        assert_eq!(with_interval(25_000.0, 25_000.0, 25_000.0), three("25000", "25000", "25000"));
        assert_eq!(beside(0.3, 0.301), "0.300");
        assert_eq!((percent(0.9712), percent(0.029)), ("97 %".to_owned(), "2.9 %".to_owned()));
        assert_eq!([1e-12, 8e-9, 0.0042].map(p_words), ["p < 1e-9", "p = 8e-9", "p = 0.004"]);
        let words: Vec<String> = ["a", "b", "c"].map(str::to_owned).into();
        assert_eq!(listed(&words, "or"), "a, b or c");
    }

    #[test]
    fn a_rival_is_rejected_by_what_it_leaves() {
        let contest = Contest {
            instead_of: Some("guide-friction"),
            chi_squared: 106.2,
            bic: 106.2,
            parameters: 0,
            by_chance: None,
            trace: None,
        };
        assert_eq!(
            against_rival(contest),
            "leaves χ² 106 higher than guide-friction with as many parameters: BIC 106 worse"
        );
        let added = Contest {
            instead_of: None,
            chi_squared: -14.0,
            bic: -6.0,
            parameters: 1,
            by_chance: Some(1.8e-4),
            trace: None,
        };
        let loose = Contest { by_chance: None, ..added };
        assert_eq!(
            against_rival(added),
            "χ² 14 lower with 1 parameter more: by chance p = 2e-4, and 3e-5 is asked for"
        );
        let faint = Contest { trace: Some(11.7), ..added };
        assert_eq!(
            against_rival(faint),
            "what is observed hardly shows it: χ² of that falls by 12, and 25 is asked for"
        );
        assert_eq!(against_rival(loose), "χ² 14 lower with 1 parameter more: BIC gains 6, and 20 is asked for");
    }
}
