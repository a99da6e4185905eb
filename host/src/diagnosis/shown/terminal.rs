//! The answer in a screenful: at most 40 lines of 100 columns.

use crate::diagnosis::answer::{Answer, Place, Value};
use crate::diagnosis::words::{self, listed, p_words, percent, short};
use crate::diagnosis::{Diagnosis, Note};

/// Columns of a terminal that everyone has.
const WIDTH: usize = 100;
/// Lines of it.
const HEIGHT: usize = 40;
/// Where the words begin, behind the name of their part.
const INDENT: &str = "         ";
/// Values of one parameter that are told one by one.
const FEW_VALUES: usize = 6;
/// Most lines that notes may take before the answer itself would have to give way.
const NOTE_LINES: usize = 6;

/// Everything that is said, line by line. `name` is the campaign's.
#[must_use]
pub fn screenful(diagnosis: &Diagnosis, answer: &Answer, name: &str) -> String {
    let mut lines = Vec::new();
    let mut say = |head: &str, words: &str| push(&mut lines, head, words);
    say("", &format!("{name}: {}", words::verdict(diagnosis, answer)));
    say("", "");
    match answer.places.as_slice() {
        [] => say("Where", words::nowhere(answer)),
        places => {
            for (number, found) in places.iter().enumerate() {
                say(if number == 0 { "Where" } else { "" }, &place(diagnosis, found));
            }
        }
    }
    say("", "");
    for (number, named) in answer.mechanisms.iter().enumerate() {
        let parameters = values(&named.parameters);
        say(if number == 0 { "What" } else { "" }, &format!("{}: {}", named.id, parameters.join(", ")));
        say("", &format!("  {}", named.because));
        if !named.indistinguishable_from.is_empty() {
            let twins: Vec<String> = named.indistinguishable_from.iter().map(|id| (*id).to_owned()).collect();
            say("", &format!("  these recordings cannot tell it from {}", listed(&twins, "or")));
        }
    }
    if answer.verdict == "unexplained" {
        let head = if answer.mechanisms.is_empty() { "What" } else { "" };
        say(head, &unexplained(answer));
    } else if answer.mechanisms.is_empty() {
        say("What", &format!("nothing; {} mechanisms were tried", diagnosis.tried.len()));
    }
    if let Some(misread) = words::misread(diagnosis) {
        say("", &format!("  {misread}"));
    }
    say("", "");
    shown(diagnosis, answer, &mut say);
    if !answer.advice.is_empty() {
        say("", "");
        for (number, advice) in answer.advice.iter().enumerate() {
            say(if number == 0 { "Next" } else { "" }, advice);
        }
    }
    if !diagnosis.notes.is_empty() {
        let mut noted = vec![String::new()];
        for (number, note) in diagnosis.notes.iter().map(Note::to_string).enumerate() {
            push(&mut noted, if number == 0 { "Notes" } else { "" }, &note);
        }
        let room = NOTE_LINES.min(HEIGHT.saturating_sub(lines.len())).max(2);
        if noted.len() > room {
            noted.truncate(room - 1);
            noted.push(format!("{INDENT}… and more: --report has all {} notes", diagnosis.notes.len()));
        }
        lines.append(&mut noted);
    }
    if lines.len() > HEIGHT {
        lines.truncate(HEIGHT - 1);
        lines.push(format!("{INDENT}… --report FILE.html has the rest"));
    }
    lines.iter().fold(String::new(), |text, line| text + line.trim_end() + "\n")
}

/// Words behind the name of their part, broken into lines.
fn push(lines: &mut Vec<String>, head: &str, words: &str) {
    if words.is_empty() {
        // One blank line is enough.
        if lines.last().is_some_and(|line: &String| !line.is_empty()) {
            lines.push(String::new());
        }
        return;
    }
    let first = lines.is_empty();
    let inner = words.len() - words.trim_start().len();
    let indent = if first { String::new() } else { INDENT.to_owned() + &" ".repeat(inner) };
    let begin = if first { String::new() } else { format!("{head:<9}") + &" ".repeat(inner) };
    let options = textwrap::Options::new(WIDTH).initial_indent(&begin).subsequent_indent(&indent);
    lines.extend(textwrap::wrap(words.trim_start(), options).into_iter().map(std::borrow::Cow::into_owned));
}

/// A place in words.
pub(super) fn place(diagnosis: &Diagnosis, place: &Place) -> String {
    let [from, to] = place.time_from_contact_s;
    let [low, high] = place.frequency_Hz;
    let depends = match place.depends_on.as_slice() {
        [] => String::new(),
        conditions => {
            let conditions: Vec<String> = conditions.iter().map(|word| (*word).to_owned()).collect();
            format!(", goes with {}", listed(&conditions, "and"))
        }
    };
    format!(
        "{}, {:.1} to {:.1} ms after contact, {low:.0} to {high:.0} Hz, {}{depends}: {} of the misfit, {}",
        words::phase(diagnosis, place.phase),
        1e3 * from,
        1e3 * to,
        words::which(diagnosis, &place.recordings),
        percent(place.share),
        p_words(place.p_value)
    )
}

/// Parameters with their intervals; of one with many values from where to where they go.
fn values(parameters: &[Value]) -> Vec<String> {
    let stem = |value: &Value| value.name.split('[').next().unwrap_or_default().to_owned();
    let of_one = parameters.chunk_by(|one, other| stem(one) == stem(other));
    let told = |values: &[Value]| -> Vec<String> {
        if values.len() <= FEW_VALUES {
            return values.iter().map(value).collect();
        }
        let least = values.iter().map(|value| value.value).fold(f64::INFINITY, f64::min);
        let most = values.iter().map(|value| value.value).fold(f64::NEG_INFINITY, f64::max);
        let unit = words::behind_a_number(&values[0].unit);
        vec![format!("{} = {} to {}{unit}, {} values", stem(&values[0]), short(least), short(most), values.len())]
    };
    of_one.flat_map(told).collect()
}

/// A parameter with its interval.
pub(super) fn value(value: &Value) -> String {
    let unit = words::behind_a_number(&value.unit);
    if value.low == value.high {
        return format!("{} = {}{unit}", value.name, short(value.value));
    }
    let (here, low, high) = words::with_interval(value.value, value.low, value.high);
    format!("{} = {here}{unit} ({low} to {high})", value.name)
}

/// What is left that nothing explains.
pub(super) fn unexplained(answer: &Answer) -> String {
    let rest = &answer.unexplained;
    let depends = match rest.depends_on.as_slice() {
        [] => String::new(),
        conditions => {
            let conditions: Vec<String> = conditions.iter().map(|word| (*word).to_owned()).collect();
            format!(", goes with {}", listed(&conditions, "and"))
        }
    };
    if rest.share == 0.0 {
        return rest.form.clone();
    }
    let form = if rest.form.is_empty() { String::new() } else { format!("; {}", rest.form) };
    format!("{} of the misfit has no name{depends}{form}", percent(rest.share))
}

fn shown(diagnosis: &Diagnosis, answer: &Answer, say: &mut impl FnMut(&str, &str)) {
    let unit = words::unit(diagnosis);
    let noise = answer.baseline.noise_rms;
    let mut columns: Vec<(&str, f64)> = vec![
        ("as stated", answer.baseline.nominal_rmse),
        ("re-tuned", answer.baseline.retuned_rmse),
        ("held out", answer.baseline.held_out_rmse),
    ];
    if !answer.mechanisms.is_empty() {
        columns.extend([("with it", answer.model.rmse), ("held out", answer.model.held_out_rmse)]);
    }
    if answer.verdict == "unexplained" {
        columns.push(("and a map", answer.unexplained.held_out_rmse));
    }
    let row = |name: &str, cell: &dyn Fn(&(&str, f64)) -> String| {
        columns.iter().fold(format!("{name:<18}"), |line, column| format!("{line}{:>11}", cell(column)))
    };
    say("Show", &row("", &|(name, _)| (*name).to_owned()));
    say("", &row(&format!("rmse, {unit}"), &|(_, rmse)| words::beside(*rmse, noise)));
    say("", &row("over the noise", &|(_, rmse)| format!("{:.2}", rmse / noise)));
    let white =
        if answer.model.residual_is_white { "nothing is left but noise" } else { "what is left is not only noise" };
    say("", &format!("noise {} {unit} rms; {white}", short(noise)));
}
