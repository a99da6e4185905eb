//! `thud prove`: conceals effects, diagnoses blind, opens the answers and scores.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::ValueEnum as _;
use indicatif::{ProgressBar, ProgressStyle};
use miette::{IntoDiagnostic as _, WrapErr as _, miette};

use super::written;
use crate::json::JsonOption;
use crate::proof::conceal::{self, Composition, Request};
use crate::proof::folder::{Done, Folder, Run};
use crate::proof::followed::{self, Advised, Followed};
use crate::proof::judged::{Ended, judge};
use crate::proof::lighter::lighter;
use crate::proof::outcome::{Origin, Outcome};
use crate::proof::peers::compared::compared;
use crate::proof::prober::{self, Prober};
use crate::proof::seal::{self, Seal, sha256};
use crate::proof::{hidden, said, shown};
use crate::{interrupt, say};

/// Prove the diagnosis on data in which an effect is concealed
///
/// A simulator that shares no code with the diagnosis hides effects in campaigns, or hides nothing, from a seed that nobody
/// chose. The answers are hashed, the hash is printed, and they are sealed with a key that only this process has. Each
/// campaign is then diagnosed by a process of its own that gets the campaign and nothing else. Only then the answers are opened and
/// scored. Whoever doubts it runs it again, with the printed seed or with a new one.
///
/// Interrupted, it keeps what is done; with the same --seed and --out it goes on.
///
/// Example: thud prove --cases 60 --report proof.html
#[derive(clap::Args, Debug)]
pub struct Prove {
    /// How many cases, mixed as the frozen set is
    #[arg(long, value_name = "N", default_value_t = 60, conflicts_with_all = ["frozen", "sample"])]
    cases: usize,
    /// Draw the cases of this seed instead of one from the operating system's randomness
    #[arg(long, value_name = "S", conflicts_with_all = ["frozen", "sample"])]
    seed: Option<u64>,
    /// Recordings in each campaign
    #[arg(long, value_name = "N", default_value_t = conceal::FROZEN_RECORDINGS, conflicts_with_all = ["frozen", "sample"])]
    recordings: usize,
    /// Run the frozen set: a thousand cases from a seed that ships with the tool (two hours and a half on two cores)
    #[arg(long, conflicts_with = "sample")]
    frozen: bool,
    /// Run N cases of the frozen set, spread over every way of concealing
    #[arg(long, value_name = "N")]
    sample: Option<usize>,
    /// Only cases of this composition, for work on the diagnosis
    #[arg(long, value_name = "MIX", value_parser = mixes(), conflicts_with_all = ["frozen", "sample"])]
    mix: Option<String>,
    /// Only cases that hide this effect alone, for work on one mechanism
    #[arg(long, value_name = "EFFECT", conflicts_with_all = ["frozen", "sample", "mix"])]
    only: Option<String>,
    /// Folder of the run [default: out/proof-… of the seed]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Diagnose again the campaigns of a finished run in --out, whose answers lie open: quick for work on the diagnosis, no proof
    #[arg(long, requires = "out", conflicts_with_all = ["cases", "seed", "recordings", "frozen", "sample", "mix", "only"])]
    opened: bool,
    #[command(flatten)]
    json: JsonOption,
    /// Write one HTML page with the scores in pictures
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Write the diagnosis' page of a few telling cases into this folder, one of each kind and one that went wrong
    #[arg(long, value_name = "DIR")]
    stories: Option<PathBuf>,
    /// Processes side by side [default: as many as there are cores]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Longest processor time for a campaign, s; one that takes longer counts as wrong
    #[arg(long, value_name = "S", default_value_t = 300.0)]
    limit: f64,
}

fn mixes() -> clap::builder::PossibleValuesParser {
    clap::builder::PossibleValuesParser::new(
        conceal::Mix::value_variants().iter().filter_map(clap::ValueEnum::to_possible_value),
    )
}

/// A run that is drawn and not yet diagnosed.
struct Drawn {
    folder: Folder,
    seed: u64,
    composition: String,
    hash: String,
    /// Name of each case, and what is left out of the tool's list.
    cases: Vec<(String, Vec<String>)>,
    /// What was asked of the concealing simulator, by the names of the cases; nothing of an earlier run.
    requests: BTreeMap<String, Request>,
    /// None where the answers lie open.
    seal: Option<Seal>,
}

impl Prove {
    pub(super) fn run(self) -> miette::Result<()> {
        let jobs = self.jobs.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)).max(1);
        let prober = Prober::this_program(prober::limit(self.limit)?)?;
        interrupt::catch();
        prober::close_memory();
        let drawn = if self.opened { self.reopened()? } else { self.drawn(jobs)? };
        let done = drawn.folder.done(&prober.hash, drawn.seal.is_some())?;
        let rest: Vec<_> = drawn.cases.iter().filter(|(case, _)| !done.contains_key(case)).cloned().collect();
        if rest.len() < drawn.cases.len() {
            self.words(&format!("{} of {} cases are already done.", drawn.cases.len() - rest.len(), drawn.cases.len()));
        }
        let bar = bar("diagnosing", rest.len())?;
        let ended = prober.diagnose(&drawn.folder, &rest, drawn.seal.is_some(), jobs, &|| bar.inc(1));
        bar.finish_and_clear();
        ended?;
        let done = drawn.folder.done(&prober.hash, drawn.seal.is_some())?;
        if interrupt::asked() {
            let seed = if self.frozen || self.sample.is_some() || self.opened {
                String::new()
            } else {
                format!("--seed {} ", drawn.seed)
            };
            self.words(&format!(
                "Stopped: {} of {} cases are diagnosed. The same options with {seed}--out {} go on from there.",
                done.len(),
                drawn.cases.len(),
                drawn.folder.root().display()
            ));
            return Ok(());
        }
        let outcome = opened(&drawn, &done, &prober.hash, jobs)?;
        if let Some(path) = &self.report {
            written::write(path, &shown::page::page(&outcome))?;
        }
        if let Some(folder) = &self.stories {
            tell(&outcome, &prober, &drawn, folder)?;
        }
        drawn.folder.write(&drawn.folder.tables(), shown::markdown::tables(&outcome).as_bytes())?;
        if !outcome.peers.is_empty() {
            drawn
                .folder
                .write(&drawn.folder.peers().join("table.md"), shown::peers::markdown(&outcome.peers).as_bytes())?;
        }
        self.json.write(&outcome)?;
        if !self.json.owns_stdout() {
            crate::standard_output::say(format_args!("\n{}", shown::terminal::screenful(&outcome)));
            say!("  Campaigns, diagnoses, answers and tables are in {}.", drawn.folder.root().display());
            if let Some(path) = &self.report {
                say!("  The page is in {}.", path.display());
            }
        }
        Ok(())
    }

    /// On standard output, or beside it where that belongs to the JSON.
    fn words(&self, sentence: &str) {
        if self.json.owns_stdout() {
            eprintln!("  {sentence}");
        } else {
            say!("  {sentence}");
        }
    }

    fn composition(&self) -> miette::Result<Composition> {
        Ok(match (&self.mix, &self.only, self.sample) {
            (Some(word), _, _) => Composition::mixed(word, self.cases)?,
            (_, Some(effect), _) => Composition::only(effect, self.cases)?,
            (_, _, Some(count)) => Composition::Sample(count),
            _ if self.frozen => Composition::Frozen,
            _ => Composition::Drawn(self.cases),
        })
    }

    /// Draws cases and answers, prints the hash, seals.
    fn drawn(&self, jobs: usize) -> miette::Result<Drawn> {
        let composition = self.composition()?;
        let frozen = self.frozen || self.sample.is_some();
        let seed = match self.seed {
            _ if frozen => conceal::FROZEN_SEED,
            Some(seed) => seed,
            None => seal::seed()?,
        };
        let whose = match self.seed {
            _ if frozen => "of the frozen set",
            Some(_) => "as given",
            None => "from the operating system's randomness",
        };
        conceal::enough(self.recordings)?;
        let requests = composition.requests(seed, self.recordings);
        if requests.is_empty() {
            return Err(miette!("no cases, no proof: choose --cases 1 or more"));
        }
        let drawn_from = sha256(format!("{seed}, {}, {}", composition.words(), self.recordings).as_bytes());
        let root = self.out.clone().unwrap_or_else(|| PathBuf::from(format!("out/proof-{}", &drawn_from[..8])));
        self.words(&format!("Seed {seed}, {whose}. {}.", capital(&composition.words())));
        let folder = Folder::at(&root)?;
        folder.claim(&Run::new(requests.len(), drawn_from))?;
        let bar = bar("concealing", requests.len())?;
        let answers = conceal::draw(&requests, seed, &folder.cases(), jobs, &|| bar.inc(1));
        bar.finish_and_clear();
        let answers = answers?;
        let hash = sha256(&answers);
        folder.commit(&hash)?;
        self.words(&format!("SHA-256 of the answers: {hash}"));
        // What an earlier run in this folder opened is shut away again.
        folder.forget(&folder.answers())?;
        let seal = Seal::draw()?;
        folder.write(&folder.sealed(), &seal.close(&answers)?)?;
        let cases = conceal::left_out(&answers)?;
        self.words(&format!(
            "The answers are sealed in {}; {} campaigns are diagnosed by processes that do not have them.",
            folder.sealed().display(),
            cases.len()
        ));
        let requests = conceal::by_name(requests, seed);
        Ok(Drawn { folder, seed, composition: composition.words(), hash, cases, requests, seal: Some(seal) })
    }

    /// A finished run.
    fn reopened(&self) -> miette::Result<Drawn> {
        let root = self.out.as_deref().unwrap_or_else(|| Path::new("."));
        let folder = Folder::at(root)?;
        let run = folder.run()?.ok_or_else(|| miette!("{} holds no run of `thud prove`", root.display()))?;
        let answers = folder.read(&folder.answers()).wrap_err("--opened is for a run that was finished once")?;
        let hash = sha256(&answers);
        if run.answers_sha256.as_ref() != Some(&hash) {
            return Err(miette!("{} is not what was sealed", folder.answers().display()));
        }
        let seed = hidden::read(&answers)?.seed;
        let cases = conceal::left_out(&answers)?;
        self.words(&format!("Seed {seed}, {} cases, answers open: good for work, no proof.", cases.len()));
        let composition = format!("{} cases of an earlier run", cases.len());
        Ok(Drawn { folder, seed, composition, hash, cases, requests: BTreeMap::new(), seal: None })
    }
}

/// Opens the answers, compares the hash, judges every case.
fn opened(
    drawn: &Drawn,
    done: &std::collections::HashMap<String, Done>,
    program: &str,
    jobs: usize,
) -> miette::Result<Outcome> {
    let folder = &drawn.folder;
    let answers = match &drawn.seal {
        Some(seal) => seal.open(&folder.read(&folder.sealed())?)?,
        None => folder.read(&folder.answers())?,
    };
    if sha256(&answers) != drawn.hash {
        return Err(seal::SealError::Broken.into());
    }
    if drawn.seal.is_some() {
        folder.write(&folder.answers(), &answers)?;
    }
    let hidden = hidden::read(&answers)?.cases;
    let mut advised = Vec::new();
    let judged = hidden
        .iter()
        .map(|hidden| {
            let done = done.get(&hidden.case).ok_or_else(|| miette!("case {} was not diagnosed", hidden.case))?;
            let ended = match &done.failure {
                Some(why) => Ended::Failed(why.clone()),
                None => {
                    let text = folder.read(&folder.diagnosis(&hidden.case))?;
                    match serde_json::from_slice::<said::Said>(&text) {
                        Ok(said) => {
                            advised.extend(Advised::of(hidden, &said));
                            Ended::Said(Box::new(said))
                        }
                        Err(error) => Ended::Failed(format!("its answer cannot be read: {error}")),
                    }
                }
            };
            Ok(judge(hidden, &ended, done.processor_s.unwrap_or(done.seconds), done.memory_mb))
        })
        .collect::<miette::Result<Vec<_>>>()?;
    let followed = followed(drawn, &advised)?;
    let peers = compared(&folder.peers(), &hidden, &judged)?;
    let origin = Origin {
        seed: drawn.seed,
        composition: drawn.composition.clone(),
        sealed: drawn.seal.is_some(),
        answers_sha256: drawn.hash.clone(),
        program_sha256: program.to_owned(),
        jobs,
    };
    Ok(Outcome { peers, ..Outcome::of(origin, hidden.into_iter().zip(judged).collect(), followed) })
}

/// Follows the advice of ambiguous answers.
fn followed(drawn: &Drawn, advised: &[Advised]) -> miette::Result<Vec<Followed>> {
    let bar = bar("following the advice", advised.len().min(followed::MOST))?;
    let folder = &drawn.folder;
    let request = |case: &str| drawn.requests.get(case).cloned();
    let all = followed::follow(advised, &request, &folder.cases(), &folder.followed(), &|| bar.inc(1));
    bar.finish_and_clear();
    all
}

/// Writes the pages of the telling cases.
fn tell(outcome: &Outcome, prober: &Prober, drawn: &Drawn, pages: &Path) -> miette::Result<()> {
    std::fs::create_dir_all(pages)
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot make the folder {}", pages.display()))?;
    let bar = bar("telling cases", outcome.stories.len())?;
    for story in &outcome.stories {
        let without = drawn.cases.iter().find(|(case, _)| *case == story.case).map_or(&[][..], |(_, without)| without);
        let page = pages.join(format!("{}.html", story.name));
        prober.report(&drawn.folder, &story.case, without, &page)?;
        let told = String::from_utf8_lossy(&drawn.folder.read(&page)?).into_owned();
        drawn.folder.write(&page, lighter(&told).as_bytes())?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}

fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn bar(what: &'static str, count: usize) -> miette::Result<ProgressBar> {
    let style = ProgressStyle::with_template("  {msg} {wide_bar} {pos}/{len}, {elapsed} of about {duration}")
        .into_diagnostic()?;
    let bar = ProgressBar::new(count as u64).with_style(style).with_message(what);
    bar.tick();
    Ok(bar)
}
