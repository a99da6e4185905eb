//! The set that ships: a seed, its composition, and a digest of what each case draws.
//!
//! ```text
//! SEED, CASES, RECORDINGS ─▶ mix::requests(Mix::Frozen) ─▶ 1,000 requests ─▶ campaigns ─▶ frozen.txt (a line and a digest each)
//! ```
//!
//! `frozen.txt` lies beside the code, so that whatever changes what is drawn (an equation, a range, the order of draws) is seen
//! in review. A test draws a few cases and compares.

use sha2::{Digest as _, Sha256};

use crate::case::{Case, Request, Way};
use crate::effect;
use crate::files;
use crate::mix::{self, Mix};
use crate::world::Kind;

/// The seed: eight bytes of the operating system's randomness, drawn once before anything was diagnosed with it.
pub const SEED: u64 = 18384523988413070286;
/// How many cases.
pub const CASES: usize = 1000;
/// Recordings in each campaign.
pub const RECORDINGS: usize = 12;
/// The list as it is kept.
pub const LIST: &str = include_str!("../frozen.txt");
/// Stands for the digest of a case that was not drawn when the list was written.
pub const NO_DIGEST: &str = "-";
/// Hexadecimal digits of a digest that are kept.
const DIGITS: usize = 16;

/// All requests of the set.
#[must_use]
pub fn requests() -> Vec<Request> {
    mix::requests(Mix::Frozen, CASES, SEED, RECORDINGS)
}

/// SHA-256 of the campaign's files, its first sixteen digits. Readings are quantised as the converter has them, so that the last
/// bit of a sine, which differs from one C library to another, does not show but once in many cases.
#[must_use]
pub fn digest(case: &Case) -> String {
    let (files, _) = files::render(case, "campaign");
    let mut hash = Sha256::new();
    for (path, text) in files {
        hash.update(path.as_bytes());
        hash.update([0]);
        hash.update(text.as_bytes());
        hash.update([0]);
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect::<String>()[..DIGITS].to_owned()
}

/// The line of a case: its number, way, kind, what is hidden how strongly, what the tool leaves out, and the digest.
#[must_use]
pub fn line(index: usize, request: &Request, digest: &str) -> String {
    let effects: Vec<String> = request.effects.iter().map(|(e, d)| format!("{}:{d:.1}", e.id)).collect();
    let word = |words: String| if words.is_empty() { "-".to_owned() } else { words };
    format!(
        "{:04} {} {} {} {} {digest}",
        index + 1,
        request.way.name(),
        request.wish.kind.name(),
        word(effects.join("+")),
        word(request.without.join("+"))
    )
}

/// The whole file.
#[must_use]
pub fn list(lines: &[String]) -> String {
    format!(
        "# The frozen set: seed {SEED}, {CASES} cases of {RECORDINGS} recordings. Written by `thud-conceal frozen`.\n\
         # case, way, kind, hidden:strength, left out of the tool's list, SHA-256 of the campaign (its first {DIGITS} digits)\n{}\n",
        lines.join("\n")
    )
}

/// A part of the set that a sample must not miss.
fn stratum(request: &Request) -> usize {
    let strong = request.effects.iter().all(|(_, d)| *d >= 10.0);
    let taken_out = request.effects.iter().any(|(e, _)| e.listed);
    let twins = |a: &str, b: &str| effect::TWINS.iter().any(|(x, y)| (*x, *y) == (a, b) || (*x, *y) == (b, a));
    match (request.way, request.effects.len()) {
        (Way::Absent, _) if request.wish.kind == Kind::Impact => 0,
        (Way::Absent, _) => 1,
        (Way::Unnamed, 2) if twins(request.effects[0].0.id, request.effects[1].0.id) => 2,
        (Way::Unnamed, 2) => 3,
        (Way::Unnamed, _) if strong => 4,
        (Way::Unnamed, _) => 5,
        (Way::Absorbed, _) => 6,
        (Way::Conditional, _) => 7,
        (Way::Unlisted, _) if taken_out => 8,
        (Way::Unlisted, _) => 9,
    }
}

const STRATA: usize = 10;

/// Numbers of `count` requests that hold every part of `requests`, as far as `count` reaches: one of each, then in proportion.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "counts of cases")]
pub fn sample(requests: &[Request], count: usize) -> Vec<usize> {
    let mut parts: Vec<Vec<usize>> = vec![Vec::new(); STRATA];
    for (index, request) in requests.iter().enumerate() {
        parts[stratum(request)].push(index);
    }
    let mut taken = [0usize; STRATA];
    let mut chosen = Vec::with_capacity(count.min(requests.len()));
    while chosen.len() < count.min(requests.len()) {
        // The part that is furthest behind its share; an empty-handed one first.
        let behind = |part: &usize| (taken[*part] as f64) / (parts[*part].len() as f64);
        let Some(part) = (0..STRATA)
            .filter(|part| taken[*part] < parts[*part].len())
            .min_by(|a, b| (taken[*a] > 0).cmp(&(taken[*b] > 0)).then(behind(a).total_cmp(&behind(b))))
        else {
            break;
        };
        chosen.push(parts[part][taken[part]]);
        taken[part] += 1;
    }
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests;
