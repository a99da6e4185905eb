//! `thud-conceal`: see `--help`.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::{Parser, Subcommand, ValueEnum};
use thud_conceal::case::{self, Request};
use thud_conceal::chosen::{self, WayWord};
use thud_conceal::effect;
use thud_conceal::files::{self, Answer, Answers};
use thud_conceal::frozen;
use thud_conceal::mix::{self, Mix};

/// Makes campaigns with a hidden effect, for someone else to diagnose.
///
/// An independent simulator of the impact rig hides one or more effects among ordinary imperfections. The campaign goes to
/// one place, the answer to another: keep the answer away from whoever diagnoses.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Hides chosen effects in one campaign
    #[command(
        after_help = "Example: thud-conceal conceal --effect guide-friction --strength 20 --seed 7 --out riddle --answer riddle-answer.json"
    )]
    Conceal {
        /// Effects to hide, separated by commas (`thud-conceal effects` lists them)
        #[arg(long, value_delimiter = ',', required = true)]
        effect: Vec<String>,
        /// Strength d of each effect: below 5 nobody can see it, from 10 on it should be found, 60 is plain
        #[arg(long, default_value_t = 20.0)]
        strength: f64,
        /// How it is concealed
        #[arg(long, value_enum, default_value_t = WayWord::Unnamed)]
        way: WayWord,
        /// The same seed makes the same campaign
        #[arg(long)]
        seed: u64,
        /// Number of recordings
        #[arg(long, default_value_t = 12)]
        recordings: usize,
        /// Folder for the campaign
        #[arg(long)]
        out: PathBuf,
        /// File for the answer (JSON)
        #[arg(long)]
        answer: PathBuf,
    },
    /// Draws many cases of a composition
    ///
    /// Beside the cases lies options.json: for some cases, mechanisms that the tool is to leave out of its list
    /// (`--without`). Some of them are what is hidden, some are decoys.
    #[command(
        after_help = "Example: thud-conceal draw --cases 100 --seed 1 --mix single --out cases --answers answers.json"
    )]
    Draw {
        /// Number of cases
        #[arg(long)]
        cases: usize,
        /// The same seed draws the same cases
        #[arg(long)]
        seed: u64,
        /// Folder for case-0001, case-0002, …
        #[arg(long)]
        out: PathBuf,
        /// File for all answers (JSON)
        #[arg(long)]
        answers: PathBuf,
        /// Composition
        #[arg(long, value_enum, default_value_t = Mix::Frozen)]
        mix: Mix,
        /// Only cases that hide this effect alone (listed or not), for work on one mechanism
        #[arg(long)]
        only: Option<String>,
        /// Number of recordings in a campaign
        #[arg(long, default_value_t = 12)]
        recordings: usize,
        /// Threads
        #[arg(long, default_value_t = 2)]
        threads: usize,
    },
    /// Lists what can be hidden
    Effects,
    /// Draws the frozen set and prints its list, one line a case with a digest of what it draws
    ///
    /// The list that ships is tests/conceal/frozen.txt; whoever changes what is drawn writes it anew, and a review sees it.
    #[command(after_help = "Example: thud-conceal frozen > tests/conceal/frozen.txt")]
    Frozen {
        /// Draw only so many, spread over every way; the others have no digest
        #[arg(long, default_value_t = frozen::CASES)]
        digests: usize,
        /// Threads
        #[arg(long, default_value_t = 2)]
        threads: usize,
    },
}

fn main() -> ExitCode {
    match run(Arguments::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::from(2)
        }
    }
}

fn word(mix: Mix) -> String {
    mix.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

fn run(command: Command) -> Result<(), String> {
    match command {
        Command::Effects => {
            list_effects();
            Ok(())
        }
        Command::Frozen { digests, threads } => {
            let requests = frozen::requests();
            let drawn = frozen::sample(&requests, digests);
            let lines = each(&requests, threads, |index, request| {
                let known = drawn.binary_search(&index).is_ok();
                let digest = if known { frozen::digest(&case::make(request)) } else { frozen::NO_DIGEST.to_owned() };
                Ok(frozen::line(index, request, &digest))
            })?;
            print!("{}", frozen::list(&lines));
            Ok(())
        }
        Command::Conceal { effect, strength, way, seed, recordings, out, answer } => {
            let request = chosen::request(&effect, strength, way, seed, recordings)?;
            chosen::refuse_answer_inside(&answer, &out)?;
            let case = case::make(&request);
            if !case.on_target {
                eprintln!(
                    "note: the effect cannot reach d = {strength} in this kind of campaign; the nearest is in the answer"
                );
            }
            let answer_value = files::write(&case, &out, "campaign").map_err(|e| cannot_write(&out, &e))?;
            write_json(&answer, &Answers { format: files::FORMAT, mix: None, seed, cases: vec![answer_value] })
        }
        Command::Draw { cases, seed, out, answers, mix, only, recordings, threads } => {
            chosen::enough(recordings)?;
            chosen::refuse_answer_inside(&answers, &out)?;
            let only = only.as_deref().map(chosen::known).transpose()?;
            let requests = match only {
                None => mix::requests(mix, cases, seed, recordings),
                Some(effect) => mix::only(effect, cases, seed, recordings),
            };
            let list = draw(&requests, &out, threads)?;
            write_json(&out.join("options.json"), &options(&list))?;
            let mix = only.map_or_else(|| word(mix), |effect| effect.id.to_owned());
            write_json(&answers, &Answers { format: files::FORMAT, mix: Some(mix), seed, cases: list })
        }
    }
}

/// What anyone may know before a diagnosis: which mechanisms the tool is to leave out of its list in which case.
fn options(answers: &[Answer]) -> std::collections::BTreeMap<&str, serde_json::Value> {
    answers
        .iter()
        .filter(|answer| !answer.without.is_empty())
        .map(|answer| (answer.case.as_str(), serde_json::json!({ "without": answer.without })))
        .collect()
}

/// A campaign and an answer per case, in the order of the cases.
fn draw(requests: &[Request], out: &Path, threads: usize) -> Result<Vec<Answer>, String> {
    each(requests, threads, |index, request| {
        let name = format!("case-{:04}", index + 1);
        let folder = out.join(&name);
        files::write(&case::make(request), &folder, &name).map_err(|e| cannot_write(&folder, &e))
    })
}

/// What `make` makes of each request, in their order, with a progress line.
fn each<T: Send>(
    requests: &[Request],
    threads: usize,
    make: impl Fn(usize, &Request) -> Result<T, String> + Sync,
) -> Result<Vec<T>, String> {
    let next = AtomicUsize::new(0);
    let done = AtomicUsize::new(0);
    let made: Mutex<Vec<Option<T>>> = Mutex::new(requests.iter().map(|_| None).collect());
    let fault: Mutex<Option<String>> = Mutex::new(None);
    std::thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= requests.len() || fault.lock().is_ok_and(|f| f.is_some()) {
                        return;
                    }
                    match make(index, &requests[index]) {
                        Ok(one) => {
                            if let Ok(mut made) = made.lock() {
                                made[index] = Some(one);
                            }
                        }
                        Err(e) => {
                            if let Ok(mut fault) = fault.lock() {
                                *fault = Some(e);
                            }
                        }
                    }
                    let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                    eprint!("\r{done} of {} cases", requests.len());
                    let _ = std::io::stderr().flush();
                }
            });
        }
    });
    eprintln!();
    if let Ok(Some(fault)) = fault.into_inner() {
        return Err(fault);
    }
    made.into_inner()
        .ok()
        .and_then(|list| list.into_iter().collect::<Option<Vec<_>>>())
        .ok_or_else(|| "a case was not made".to_owned())
}

fn cannot_write(path: &Path, error: &std::io::Error) -> String {
    format!("cannot write {}: {error}", path.display())
}

fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<(), String> {
    let text = serde_json::to_string_pretty(value).map_err(|e| e.to_string())?;
    fs::write(path, text).map_err(|e| cannot_write(path, &e))
}

fn list_effects() {
    println!("In the contract's list:");
    for e in effect::ALL.iter().filter(|e| e.listed) {
        println!("  {:24} {}", e.id, e.about);
    }
    println!("Not in the list:");
    for e in effect::ALL.iter().filter(|e| !e.listed) {
        println!("  {:24} {}", e.id, e.about);
    }
}
