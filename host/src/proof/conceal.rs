//! The one place that calls the concealing simulator: requests in, campaigns and answers out.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::ValueEnum as _;
use miette::{IntoDiagnostic as _, WrapErr as _, miette};
use thud_conceal::case;
pub use thud_conceal::case::{Further, Request};
use thud_conceal::files::{self, Answer, Answers};
pub use thud_conceal::mix::Mix;
use thud_conceal::{chosen, effect, frozen, mix};

use super::hidden;
use super::seal::sha256;
use crate::interrupt;

/// Which cases a run has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Composition {
    /// So many cases, mixed in the frozen set's proportions.
    Drawn(usize),
    /// The frozen set.
    Frozen,
    /// A part of the frozen set that misses none of its ways.
    Sample(usize),
    /// So many cases of one kind.
    Mixed(Mix, usize),
    /// So many cases that hide this effect alone.
    Only(&'static str, usize),
}

impl Composition {
    /// In words.
    #[must_use]
    pub fn words(self) -> String {
        match self {
            Self::Drawn(count) => format!("{count} cases in the frozen set's proportions"),
            Self::Frozen => format!("the frozen set of {} cases", frozen::CASES),
            Self::Sample(count) => format!("{count} cases of the frozen set, of every way"),
            Self::Mixed(mix, count) => {
                let word = mix.to_possible_value();
                format!("{count} cases of the mix `{}`", word.as_ref().map_or("", |word| word.get_name()))
            }
            Self::Only(effect, count) => format!("{count} cases that hide {effect} alone"),
        }
    }

    /// Cases of the mix of this name.
    ///
    /// # Errors
    /// There is no such mix.
    pub fn mixed(word: &str, count: usize) -> miette::Result<Self> {
        Mix::from_str(word, false).map(|mix| Self::Mixed(mix, count)).map_err(|error| miette!("{error}"))
    }

    /// Cases of this effect.
    ///
    /// # Errors
    /// There is no such effect.
    pub fn only(effect: &str, count: usize) -> miette::Result<Self> {
        chosen::known(effect).map(|effect| Self::Only(effect.id, count)).map_err(|sentence| miette!("{sentence}"))
    }

    /// The requests.
    #[must_use]
    pub fn requests(self, seed: u64, recordings: usize) -> Vec<Request> {
        match self {
            Self::Drawn(count) => mix::requests(Mix::Frozen, count, seed, recordings),
            Self::Frozen => frozen::requests(),
            Self::Mixed(mix, count) => mix::requests(mix, count, seed, recordings),
            Self::Only(id, count) => {
                effect::named(id).map_or_else(Vec::new, |effect| mix::only(effect, count, seed, recordings))
            }
            Self::Sample(count) => {
                let all = frozen::requests();
                frozen::sample(&all, count).into_iter().map(|index| all[index].clone()).collect()
            }
        }
    }
}

/// The frozen set's own seed.
pub const FROZEN_SEED: u64 = frozen::SEED;
/// Recordings in each campaign of the frozen set.
pub const FROZEN_RECORDINGS: usize = frozen::RECORDINGS;

/// Whether so many recordings make a campaign.
///
/// # Errors
/// They do not.
pub fn enough(recordings: usize) -> miette::Result<()> {
    chosen::enough(recordings).map_err(|sentence| miette!("{sentence}"))
}

/// Hides one effect of strength d in a campaign of the folder.
///
/// # Errors
/// An effect or a strength that cannot be; a folder that cannot be written.
pub fn hide(effect: &str, strength: f64, seed: u64, recordings: usize, folder: &Path) -> miette::Result<()> {
    let request = chosen::request(&[effect.to_owned()], strength, chosen::WayWord::Unnamed, seed, recordings)
        .map_err(|sentence| miette!("{sentence}"))?;
    files::write(&case::make(&request), folder, "riddle")
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot write the campaign to {}", folder.display()))?;
    Ok(())
}

/// The name of a case: it says nothing, and puts the cases into an order that says nothing either.
fn name(seed: u64, index: usize) -> String {
    sha256(format!("thud prove {seed} {index}").as_bytes())[..12].to_owned()
}

/// Makes a case again with further recordings of its rig, so many of each kind, and writes the campaign into a folder.
///
/// # Errors
/// The folder that cannot be written.
pub fn go_on(request: &Request, further: Further, times: usize, folder: &Path) -> miette::Result<()> {
    let mut case = case::make(request);
    case::go_on(&mut case, &vec![further; times]);
    files::write_campaign(&case, folder, "continued")
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot write the campaign to {}", folder.display()))
}

/// The requests by the names of their cases.
#[must_use]
pub fn by_name(requests: Vec<Request>, seed: u64) -> BTreeMap<String, Request> {
    requests.into_iter().enumerate().map(|(index, request)| (name(seed, index), request)).collect()
}

/// Makes every campaign in a folder of its own in `cases`, on `jobs` threads, and gives all answers in the order of their names, as
/// the JSON that will be sealed. `done` hears of each case.
///
/// # Errors
/// The folder that cannot be written; or Ctrl-C.
pub fn draw(
    requests: &[Request],
    seed: u64,
    cases: &Path,
    jobs: usize,
    done: &(impl Fn() + Sync),
) -> miette::Result<Vec<u8>> {
    let next = AtomicUsize::new(0);
    let made: Mutex<Vec<Result<Answer, String>>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..jobs.max(1) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= requests.len() || interrupt::asked() {
                        return;
                    }
                    let name = name(seed, index);
                    let folder = cases.join(&name);
                    let one = files::write(&case::make(&requests[index]), &folder, &name)
                        .map_err(|error| format!("cannot write {}: {error}", folder.display()));
                    if let Ok(mut made) = made.lock() {
                        made.push(one);
                    }
                    done();
                }
            });
        }
    });
    let made = made.into_inner().map_err(|_| miette!("a case could not be made"))?;
    let mut answers =
        made.into_iter().collect::<Result<Vec<Answer>, String>>().map_err(|sentence| miette!("{sentence}"))?;
    if answers.len() < requests.len() {
        return Err(miette!("stopped while the cases were drawn; the same seed draws them again"));
    }
    answers.sort_by(|a, b| a.case.cmp(&b.case));
    let all = Answers { format: files::FORMAT, mix: None, seed, cases: answers };
    serde_json::to_vec_pretty(&all).into_diagnostic().wrap_err("the answers cannot be written")
}

/// What each case leaves out of the tool's list, which the process that diagnoses is told: name of the case and mechanisms.
///
/// # Errors
/// Only for text that [`draw`] did not make.
pub fn left_out(answers: &[u8]) -> miette::Result<Vec<(String, Vec<String>)>> {
    Ok(hidden::read(answers)?.cases.into_iter().map(|case| (case.case, case.without)).collect())
}
